# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.


"""The nodes of linkage_ros as processes of their own, as `ros2 run` would start them."""

import os
import signal
import subprocess
import sys

from linkage_ros.command import RequestError

EXECUTABLES = ('crank_driver', 'kinematics', 'servo_inverse')
SECONDS_TO_END = 10.0


class DemoError(RequestError):
    """What is missing or went wrong, in one sentence."""


class Nodes:
    """The running nodes of a scene, with a viewer if it has a port; leaves none behind."""

    def __init__(self, scene_file, domain, viewer_port=None):
        environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain)}
        arguments = {name: ['--params-file', scene_file] for name in EXECUTABLES}
        if viewer_port is not None:
            arguments['viewer'] = ['-p', f'port:={viewer_port}']
        # In sessions of their own: Ctrl-C reaches the demo alone, which ends the nodes.
        self._processes = {name: subprocess.Popen(
            [sys.executable, '-c', f'from linkage_ros import executables; executables.{name}()',
             '--ros-args', *own], env=environment, start_new_session=True)
            for name, own in arguments.items()}

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
