# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Command that prints the robot model of a scene's mechanisms; it needs no ROS."""

from typing import Sequence

from . import bodies, mjcf, sdf, urdf
from .. import cli, scene
from ..linkage import MAX_LENGTH, MIN_LENGTH

NAME = 'urdf'


def main(args: Sequence[str] | None = None) -> int:
    """Print a robot model; return the exit code."""
    return cli.run(NAME, show, args)


def show(args: Sequence[str] | None, given_scene: scene.Scene | None = None) -> None:
    """Print the model that a command line requests, of its scene or of the one from ROS."""
    parser = cli.Parser(
        NAME, description='Print the robot model of a scene.',
        epilog='`ros2 run linkage_ros urdf` also accepts the scene as a node does: '
               '--ros-args --params-file SCENE')
    positive = cli.within(float, MIN_LENGTH, MAX_LENGTH)
    cli.add_scene(parser, nargs='?', help="the scene's parameter file (default: the "
                                          "catalogue's linkages)")
    parser.add_argument('--format', choices=('urdf', 'sdf', 'mjcf'), default='urdf',
                        help='a tree for robot_state_publisher, or closed loops for Gazebo or '
                             'MuJoCo (default: urdf)')
    parser.add_argument('--width', type=positive, metavar='M',
                        help='thickness of a bar, with all other shapes in proportion (default: a '
                             '40th of the longest)')
    parser.add_argument('--density', type=positive, metavar='KG/M3',
                        help='density of all bodies of sdf and mjcf '
                             f'(default: {bodies.DENSITY:g}, aluminium)')
    options = parser.parse_args(args)
    if given_scene and options.scene is not None:
        raise cli.RequestError('give the scene either as SCENE or with --ros-args, not both')
    shown = given_scene or (scene.read({}) if options.scene is None else scene.load(options.scene))
    if options.format == 'urdf' and options.density:
        raise cli.RequestError('--density is for sdf and mjcf only: the URDF has no masses')
    density = 0.0 if options.format == 'urdf' else options.density or bodies.DENSITY
    model = bodies.robot(cli.chosen(shown.mechanisms, options.mechanism), shown.frame_id,
                         options.width, density)
    print({'urdf': urdf, 'sdf': sdf, 'mjcf': mjcf}[options.format].write(model))
