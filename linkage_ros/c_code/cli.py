# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Command that prints the mechanisms of a scene as C; it needs no ROS."""

from typing import Sequence

from . import header
from .. import cli, scene
from ..scene import SceneMechanism
from ..words import suggestion

NAME = 'c_code'


def main(args: list[str] | None = None) -> int:
    """Print C99; return the exit code."""
    return cli.run(NAME, show, args)


def show(args: list[str] | None) -> None:
    """Print the headers that a command line requests."""
    options = arguments().parse_args(args)
    mechanisms = cli.chosen(scene.load(options.scene).mechanisms, options.mechanism)
    try:
        print(header.printed([header.Request(mechanism, options.output, names) for mechanism, names
                              in with_joints(mechanisms, options.joints)], options.float))
    except ValueError as error:
        raise cli.RequestError(str(error)) from None


def with_joints(mechanisms: Sequence[SceneMechanism], names: Sequence[str]
                ) -> list[tuple[SceneMechanism, list[str]]]:
    """Return each mechanism with its joints among those named."""
    chosen = [(mechanism, [name for name in names if mechanism.output_named(name)])
              for mechanism in mechanisms]
    known = [joint.name for mechanism in mechanisms for joint in mechanism.joints.values()]
    for name in sorted({*names}.difference(*(joints for _, joints in chosen))):
        raise cli.RequestError(f'no mechanism has a joint {name!r}{suggestion(name, known, 200)}')
    return chosen


def parser(name: str, description: str) -> cli.Parser:
    """Return the parser of a command on the mechanisms of a scene."""
    made = cli.Parser(name, description=description)
    cli.add_scene(made, help="the scene's parameter file")
    made.add_argument('--joints', nargs='+', default=[], metavar='JOINT',
                      help='what a controller commands, by its name in the scene')
    return made


def arguments() -> cli.Parser:
    """Return the parser of the command line."""
    made = parser(NAME, 'Print the mechanisms of a scene as C99 headers, one after another, '
                        'without heap and with no dependency except math.h.')
    made.add_argument('--output', nargs='+', default=[], metavar='OUTPUT',
                      help='an inverse for each of these: a link, A.x, distance(A,B), angle(A,B)')
    made.add_argument('--float', action='store_true', help='float instead of double')
    return made
