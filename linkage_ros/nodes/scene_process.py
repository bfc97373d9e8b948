# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The three nodes of a scene in one process: the same names, topics, parameters and services."""

from typing import Any, Iterator

from . import scene_node, shutdown
from .crank_driver import CrankDriver
from .kinematics import Kinematics
from .scene_node import SceneNode
from .servo_inverse import ServoInverse

NAME = 'scene'


def nodes() -> Iterator[SceneNode]:
    """Create the nodes, `kinematics` first: the others start with its values of parameters."""
    yield Kinematics()
    yield ServoInverse()
    yield CrankDriver()


def main(args: Any = None) -> int:
    """Run the nodes with command-line arguments `args`; return the exit code."""
    return scene_node.run_together(nodes, NAME, args)


if __name__ == '__main__':
    shutdown.run(main)
