# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Command that prints the mechanisms of a scene as C; it needs no ROS."""

import sys
from typing import List, Optional

from . import header
from .. import command, scene

NAME = 'c_code'
NEEDS = 'pip install pyyaml, or apt install python3-yaml'


def main(args: Optional[List[str]] = None) -> int:
    """Print C99; return the exit code."""
    return command.run(NAME, show, args, NEEDS)


def show(args: Optional[List[str]]) -> None:
    """Print what a command line asks for."""
    asked = parser().parse_args(args)
    machines = command.chosen(scene.load(asked.scene).machines, asked.mechanism)
    try:
        print('\n'.join(header.written(machine, asked.output, asked.float)
                        for machine in machines))
    except ValueError as error:
        raise command.RequestError(str(error)) from None


def parser() -> command.Parser:
    """Return the parser of the command line."""
    made = command.Parser(
        NAME, description='Print the mechanisms of a scene as C99: a header each, one after the '
                          'other, without heap and with no dependency but math.h.')
    made.add_argument('scene', metavar='SCENE', help="the scene's parameter file")
    made.add_argument('--mechanism', nargs='+', default=[], metavar='NAME',
                      help='only these mechanisms of the scene')
    made.add_argument('--output', nargs='+', default=[], metavar='OUTPUT',
                      help='an inverse for each of these: a link, A.x, distance(A,B), angle(A,B)')
    made.add_argument('--float', action='store_true', help='float instead of double')
    return made


if __name__ == '__main__':
    sys.exit(main())
