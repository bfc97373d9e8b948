# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Command that prints a scene's URDF; the scene is a file or ROS parameters."""

from __future__ import annotations

import sys
from typing import List, Optional

import rclpy
from rclpy.utilities import remove_ros_args

from . import scene_node
from .. import command, scene
from ..robot_model.command import NAME, show


def main(args: Optional[List[str]] = None) -> int:
    """Print the URDF of a scene; return the exit code. `args` are by default sys.argv[1:]."""
    return command.run(NAME, _show, sys.argv[1:] if args is None else args)


def _show(args: List[str]) -> None:
    if '--ros-args' not in args:
        show(args, None)
        return
    try:
        show(remove_ros_args([NAME, *args])[1:], _scene(args))
    except RuntimeError as error:
        raise command.RequestError(f'the arguments for ROS are wrong: {error}') from None


def _scene(args: List[str]) -> scene.Scene:
    """Read the scene from the parameters in the arguments for ROS."""
    rclpy.init(args=args)
    try:
        node = scene_node.SceneNode(NAME)
        node.destroy_node()
    finally:
        rclpy.try_shutdown()
    if '--params-file' in args and not node.is_given:
        raise command.RequestError("the parameter file must have '/**:' and below it "
                                   "'ros__parameters:' with a scene")
    return node.scene


if __name__ == '__main__':
    sys.exit(main())
