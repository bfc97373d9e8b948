# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Command that prints a scene's URDF; the scene is a file or ROS parameters."""

from __future__ import annotations

import sys

import rclpy
from rclpy.utilities import remove_ros_args

from . import scene_node
from .. import cli, scene
from ..robot_model.cli import NAME, show


def main(args: list[str] | None = None) -> int:
    """Print the URDF of a scene; return the exit code. `args` are by default sys.argv[1:]."""
    return cli.run(NAME, _show, sys.argv[1:] if args is None else args)


def _show(args: list[str]) -> None:
    if '--ros-args' not in args:
        show(args, None)
        return
    try:
        show(remove_ros_args([NAME, *args])[1:], _scene(args))
    except RuntimeError as error:
        raise cli.RequestError(f'the arguments for ROS are wrong: {error}') from None


def _scene(args: list[str]) -> scene.Scene:
    """Read the scene from the parameters in the arguments for ROS."""
    rclpy.init(args=args)
    try:
        node = scene_node.SceneNode(NAME)
        node.destroy_node()
    finally:
        rclpy.try_shutdown()
    if '--params-file' in args and not node.is_given:
        raise cli.RequestError("the parameter file must have '/**:' and below it "
                               "'ros__parameters:' with a scene")
    return node.scene
