# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0


"""
Run a scene's nodes and the viewer until they are interrupted.

    python demo/view.py config/strandbeest.yaml [PORT]
"""

from contextlib import suppress
import os
from pathlib import Path
import signal
import subprocess
import sys
import time

try:
    from domains import Domain
    from linkage_ros import cli, scene
except ImportError as error:
    sys.exit(f'view: {error}; `make view` installs and builds what is needed')

SECONDS_BETWEEN_CHECKS = 0.5
SECONDS_TO_END = 10.0
PORT = 8020


class DemoError(cli.RequestError):
    """What is missing or went wrong, in one sentence."""


class Nodes:
    """The nodes of a scene as processes, as `ros2 run` would start them; leaves none behind."""

    def __init__(self, scene_file, domain, **others):
        arguments = {**dict.fromkeys(('crank_driver', 'kinematics', 'servo_inverse'),
                                     ['--params-file', scene_file]), **others}
        # In sessions of their own: Ctrl-C reaches this process alone, which ends the nodes.
        self._processes = {name: subprocess.Popen(
            [sys.executable, '-c', f'from linkage_ros import executables; executables.{name}()',
             '--ros-args', *own], env={**os.environ, 'ROS_DOMAIN_ID': str(domain)},
            start_new_session=True) for name, own in arguments.items()}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()

    def check(self):
        """Raise DemoError if a node is no longer there."""
        for name, process in self._processes.items():
            if process.poll() is not None:
                raise DemoError(f'{name} died with exit code {process.returncode}')

    def stop(self) -> dict:
        """End the nodes that still run; return the exit code of each."""
        for process in self._processes.values():
            # A Python that just starts would answer SIGINT with a traceback.
            process.send_signal(signal.SIGTERM)
        for process in self._processes.values():
            try:
                process.wait(SECONDS_TO_END)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        return {name: process.returncode for name, process in self._processes.items()}


def view(scene_file, port=PORT):
    """Run the nodes until they are interrupted; raise DemoError if one ends."""
    scene.load(scene_file)
    try:
        with Domain() as domain, suppress(KeyboardInterrupt):
            # Nodes that listen elsewhere are heard where the user says.
            id_ = os.environ.get('ROS_DOMAIN_ID') or domain.id
            print(f'Running {scene_file}, ROS_DOMAIN_ID {id_}; Ctrl-C ends it.', flush=True)
            with Nodes(Path(scene_file).resolve(), id_, viewer=['-p', f'port:={port}']) as nodes:
                while True:
                    nodes.check()
                    time.sleep(SECONDS_BETWEEN_CHECKS)
    except RuntimeError as error:
        raise DemoError(error) from None


def run(name, work) -> int:
    """Do some work that signals interrupt, so that no node is left behind; return an exit code."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
        # The terminal is closed. With nohup it may be.
        signal.signal(signal.SIGHUP, signal.default_int_handler)
    return cli.run(name, lambda _: work(), None)


if __name__ == '__main__':
    sys.exit(run('view', lambda: view(*sys.argv[1:])))
