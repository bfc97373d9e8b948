# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Command that prints the robot model of a scene's mechanisms, with ROS or without it."""

import re
import sys

from . import urdf
from .. import command, scene

NAME = 'urdf'
NEEDS = ('pip install pyyaml, or apt install python3-yaml; --ros-args needs a ROS 2 that is '
         'installed and sourced')


def main(args=None) -> int:
    """Print URDF; return the exit code."""
    return command.run(NAME, _print, args, NEEDS)


def _print(args):
    args = sys.argv[1:] if args is None else args
    from_ros = '--ros-args' in args
    asked = parser().parse_args(without_ros(args) if from_ros else args)
    if from_ros and asked.scene:
        raise command.RequestError('the scene comes as SCENE or with --ros-args, not with both')
    found = (read_scene(args) if from_ros else
             scene.load(asked.scene) if asked.scene else scene.read({}))
    print(urdf.describe(command.chosen(found.machines, asked.mechanism), found.frame_id))


def parser() -> command.Parser:
    """Return the parser of the command line."""
    made = command.Parser(
        NAME, description='Print the robot model of a scene as URDF.',
        epilog='The scene may also come as for a node: --ros-args --params-file SCENE')
    made.add_argument('scene', metavar='SCENE', nargs='?',
                      help="the scene's parameter file (default: the catalogue's linkages)")
    made.add_argument('--mechanism', nargs='+', default=[], metavar='NAME',
                      help='only these mechanisms of the scene')
    return made


def without_ros(args):
    """Return the arguments that are not for ROS; raise RequestError if others are wrong."""
    from rclpy.utilities import remove_ros_args

    try:
        return remove_ros_args([NAME, *args])[1:]
    except RuntimeError as error:
        # Not where in its own source the client library found out.
        why = re.sub(r'Failed to parse ROS arguments: |, at /\S+:\d+', '', str(error))
        raise command.RequestError(f'the arguments for ROS are wrong: {why}') from None


def read_scene(args) -> scene.Scene:
    """Return the scene in the parameters that come with ROS arguments."""
    import rclpy

    from ..nodes import scene_node

    class Reader(scene_node.SceneNode):
        """A node that is told a scene, or says that it was not."""

        def __init__(self):
            super().__init__(NAME)
            if '--params-file' in args and not self._parameter_overrides:
                self.destroy_node()
                raise command.RequestError("the parameter file must have '/**:' and below it "
                                           "'ros__parameters:' with a scene")

    rclpy.init(args=args)
    try:
        reader = Reader()
        reader.destroy_node()
        return reader.scene
    finally:
        rclpy.try_shutdown()


if __name__ == '__main__':
    sys.exit(main())
