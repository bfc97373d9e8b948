# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Command that prints the robot model of a scene's mechanisms: `ros2 run linkage_ros urdf`."""

import argparse
import sys

import rclpy
from rclpy.logging import get_logger
from rclpy.utilities import remove_ros_args

from . import node, scene, urdf

NAME = 'urdf'


def read_scene(args=None) -> scene.Scene:
    """Return the scene in the parameters that come with ROS arguments."""
    rclpy.init(args=args)
    try:
        reader = node.SceneNode(NAME)
        reader.destroy_node()
        return reader.scene
    finally:
        rclpy.try_shutdown()


def chosen(machines, names):
    """Return the machines that are named, or all; raise SceneError for one that is not there."""
    for name in names:
        if name not in machines:
            raise scene.SceneError(f'there is no mechanism {name!r}; '
                                   f'allowed: {", ".join(machines)}')
    return [machines[name] for name in names or machines]


def main(args=None) -> int:
    """Print URDF; return the exit code."""
    parser = argparse.ArgumentParser(
        NAME, description='Print the robot model of a scene as URDF.',
        epilog='The scene comes with: --ros-args --params-file SCENE')
    parser.add_argument('--mechanism', nargs='+', default=[], metavar='NAME',
                        help='only these mechanisms of the scene')
    names = parser.parse_args(remove_ros_args(args)[1:]).mechanism
    try:
        found = read_scene(args)
        print(urdf.describe(chosen(found.machines, names), found.frame_id))
    except (scene.SceneError, node.RCLError) as error:
        get_logger(NAME).fatal(str(error))
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
