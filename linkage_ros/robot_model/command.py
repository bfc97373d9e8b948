# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Command that prints the robot model of a scene's mechanisms; it needs no ROS."""

import sys
from typing import List, Optional

from . import urdf
from .. import command, scene

NAME = 'urdf'
NEEDS = 'pip install pyyaml, or apt install python3-yaml'


def main(args: Optional[List[str]] = None) -> int:
    """Print URDF; return the exit code."""
    return command.run(NAME, show, args, NEEDS)


def show(args: Optional[List[str]], told: Optional[scene.Scene] = None) -> None:
    """Print what a command line asks for, of its scene or of one that ROS told."""
    asked = parser().parse_args(args)
    if told and asked.scene:
        raise command.RequestError('the scene comes as SCENE or with --ros-args, not with both')
    found = told or (scene.load(asked.scene) if asked.scene else scene.read({}))
    print(urdf.describe(command.chosen(found.machines, asked.mechanism), found.frame_id))


def parser() -> command.Parser:
    """Return the parser of the command line."""
    made = command.Parser(
        NAME, description='Print the robot model of a scene as URDF.',
        epilog='As `ros2 run linkage_ros urdf` it takes the scene as a node does, too: '
               '--ros-args --params-file SCENE')
    made.add_argument('scene', metavar='SCENE', nargs='?',
                      help="the scene's parameter file (default: the catalogue's linkages)")
    made.add_argument('--mechanism', nargs='+', default=[], metavar='NAME',
                      help='only these mechanisms of the scene')
    return made


if __name__ == '__main__':
    sys.exit(main())
