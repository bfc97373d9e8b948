# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The three nodes of a scene in one process: the same names, topics, parameters and services."""

from typing import Any

from . import scene_node, shutdown
from .crank_driver import CrankDriver
from .kinematics import Kinematics
from .servo_inverse import ServoInverse

NAME = 'scene'


def main(args: Any = None) -> int:
    """Run the nodes with command-line arguments `args`; return the exit code."""
    # `kinematics` first: the others start with its values of parameters.
    return scene_node.run([Kinematics, ServoInverse, CrankDriver], NAME, args)


if __name__ == '__main__':
    shutdown.run(main)
