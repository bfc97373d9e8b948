# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Command that prints the scene of a robot's closed loops; it needs no ROS."""

import sys
from typing import List, Optional

from . import readers, scene_file
from .. import command

NAME = 'from_robot'
NEEDS = 'pip install mujoco for MJCF, pyyaml (apt: python3-yaml) for --loops'


def main(args: Optional[List[str]] = None) -> int:
    """Print a scene file; return the exit code."""
    return command.run(NAME, _show, args, NEEDS)


def _show(args: Optional[List[str]]) -> None:
    made = command.Parser(NAME, description='Print the scene of the planar closed loops of a '
                          'robot, from MJCF, SDF or URDF.')
    made.add_argument('file', metavar='FILE', help='the robot')
    made.add_argument('--loops', metavar='FILE', help='YAML with the loop joints of a URDF')
    asked = made.parse_args(args)
    text, said = scene_file.write(readers.read(asked.file, asked.loops, {}), asked.file)
    print(text)
    print(*(f'{NAME}: {line}' for line in said), sep='\n', file=sys.stderr)


if __name__ == '__main__':
    sys.exit(main())
