# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""
Run a scene's nodes and the viewer until they are interrupted.

    python demo/view.py config/strandbeest.yaml [PORT]
"""

import os
from pathlib import Path
import signal
import sys
import time

try:
    from domains import Domain
    from linkage_ros import command, scene
    from nodes import DemoError, Nodes
except ImportError as error:
    sys.exit(f'view: {error}; `make view` installs and builds what is needed')

SECONDS_BETWEEN_LOOKS = 0.5
PORT = 8020


def main(scene_file, port=PORT) -> int:
    """Run the nodes; return the exit code of the process."""
    # However it ends, no node is left behind.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
        # The terminal is closed. With nohup it may be.
        signal.signal(signal.SIGHUP, signal.default_int_handler)
    return command.run('view', lambda _: view(scene_file, port), None)


def view(scene_file, port):
    """Run the nodes until they are interrupted; raise DemoError if one ends."""
    scene.load(scene_file)
    try:
        with Domain() as domain:
            # Nodes that listen elsewhere are heard where the user says.
            id_ = os.environ.get('ROS_DOMAIN_ID') or domain.id
            print(f'Running {scene_file}, ROS_DOMAIN_ID {id_}; Ctrl-C ends it.', flush=True)
            with Nodes(Path(scene_file).resolve(), id_, viewer_port=port) as nodes:
                while True:
                    nodes.check()
                    time.sleep(SECONDS_BETWEEN_LOOKS)
    except KeyboardInterrupt:
        pass
    except RuntimeError as error:
        raise DemoError(error) from None


if __name__ == '__main__':
    sys.exit(main(*sys.argv[1:]))
