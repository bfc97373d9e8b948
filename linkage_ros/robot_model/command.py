# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Command that prints the robot model of a scene's mechanisms; it needs no ROS."""

import argparse
from typing import List, Optional

from . import bodies, mjcf, sdf, urdf
from .bodies import assembled, DENSITY
from .. import command, scene

NAME = 'urdf'


def main(args: Optional[List[str]] = None) -> int:
    """Print a robot model; return the exit code."""
    return command.run(NAME, show, args)


def show(args: Optional[List[str]], given: Optional[scene.Scene] = None) -> None:
    """Print the model that a command line requests, of its scene or of the one from ROS."""
    asked = parser().parse_args(args)
    if given and asked.scene:
        raise command.RequestError('give the scene either as SCENE or with --ros-args, not both')
    found = given or (scene.load(asked.scene) if asked.scene else scene.read({}))
    if asked.format == 'urdf' and asked.density:
        raise command.RequestError('--density is for sdf and mjcf only: the URDF has no masses')
    robot = bodies.robot(command.chosen(found.machines, asked.mechanism), found.frame_id,
                         asked.width)
    if asked.format == 'urdf':
        print(urdf.write(robot))
    else:
        writer = {'sdf': sdf, 'mjcf': mjcf}[asked.format]
        print(writer.write(assembled(robot, asked.density or DENSITY)))


def parser() -> command.Parser:
    """Return the parser of the command line."""
    made = command.Parser(
        NAME, description='Print the robot model of a scene.',
        epilog='`ros2 run linkage_ros urdf` also accepts the scene as a node does: '
               '--ros-args --params-file SCENE')
    made.add_argument('scene', metavar='SCENE', nargs='?',
                      help="the scene's parameter file (default: the catalogue's linkages)")
    made.add_argument('--mechanism', nargs='+', default=[], metavar='NAME',
                      help='only these mechanisms of the scene')
    made.add_argument('--format', choices=('urdf', 'sdf', 'mjcf'), default='urdf',
                      help='a tree for robot_state_publisher, or closed loops for Gazebo or '
                           'MuJoCo (default: urdf)')
    made.add_argument('--width', type=_positive, metavar='M',
                      help='thickness of a bar, with all other shapes in proportion (default: a '
                           '40th of the longest)')
    made.add_argument('--density', type=_positive, metavar='KG/M3',
                      help='density of all bodies of sdf and mjcf '
                           f'(default: {DENSITY:g}, aluminium)')
    return made


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not bodies.SMALLEST <= value <= bodies.LARGEST:
        raise argparse.ArgumentTypeError(
            f'must be from {bodies.SMALLEST:g} to {bodies.LARGEST:g}, not {text}')
    return value
