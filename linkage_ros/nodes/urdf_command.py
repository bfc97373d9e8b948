# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Command that prints a robot model, of a scene that comes as a node's parameters too."""

import re
import sys

import rclpy
from rclpy.utilities import remove_ros_args

from . import scene_node
from .. import command, scene
from ..robot_model.command import NAME, NEEDS, show


def main(args=None) -> int:
    """Print URDF; return the exit code."""
    return command.run(NAME, _show, sys.argv[1:] if args is None else args, NEEDS)


def _show(args):
    from_ros = '--ros-args' in args
    show(_without_ros(args) if from_ros else args, _told(args) if from_ros else None)


def _without_ros(args):
    """Return the arguments that are not for ROS; raise RequestError if others are wrong."""
    try:
        return remove_ros_args([NAME, *args])[1:]
    except RuntimeError as error:
        # Not where in its own source the client library found out.
        why = re.sub(r'Failed to parse ROS arguments: |, at /\S+:\d+', '', str(error))
        raise command.RequestError(f'the arguments for ROS are wrong: {why}') from None


def _told(args) -> scene.Scene:
    """Return the scene in the parameters that come with ROS arguments."""
    rclpy.init(args=args)
    try:
        reader = _Reader('--params-file' in args)
        reader.destroy_node()
        return reader.scene
    finally:
        rclpy.try_shutdown()


class _Reader(scene_node.SceneNode):
    """A node that is told a scene, or says that it was not."""

    def __init__(self, promised: bool):
        super().__init__(NAME)
        if promised and not self._parameter_overrides:
            self.destroy_node()
            raise command.RequestError("the parameter file must have '/**:' and below it "
                                       "'ros__parameters:' with a scene")


if __name__ == '__main__':
    sys.exit(main())
