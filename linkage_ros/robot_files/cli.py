# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Command that prints the scene of a robot's closed loops; it needs no ROS."""

from __future__ import annotations

from contextlib import suppress
import math
import shlex
import sys
from typing import Any, Mapping, Sequence

import numpy as np

from . import check, closing, planar, readers, rods
from .spatial import components
from .. import cli, scene
from ..linkage import short
from ..robot_model.robot import FIXED, HINGE, MAX_NUMBER, NotDriven, Robot, SLIDE, with_positions
from ..scene.writing import in_yaml
from ..words import join_names, sentence, suggestion, truncated

NAME = 'from_robot'
# The report on a mechanism that differs from its robot, or could not be compared.
WRONG = 'compared with the robot'
OTHERS = 'others'
# What loops raise that are no mechanism.
_FAULTS = ArithmeticError, ValueError
READING = 'joint_names: QB=-knee+0.6 is to be read as knee = 0.6 - angle of QB.'


def main(args: list[str] | None = None) -> int:
    """Print a scene file; return the exit code."""
    return cli.run(NAME, show, args)


def show(args: list[str] | None) -> None:
    """Print what a command line asks for."""
    parser = cli.Parser(NAME, description='Print the scene of the closed loops in a robot: '
                        'MJCF, SDF or URDF.')
    parser.add_argument('file', metavar='FILE', help='the robot')
    parser.add_argument('--loops', metavar='FILE', help='YAML with the loop joints of a URDF')
    # Each loop that is refused prints its own options to be added.
    parser.add_argument('--driven', metavar='JOINT', nargs='+', action='extend',
                        help='joints that motors move (default: those of the file, else any that '
                             'determines the others)')
    for option, meaning in (('pose', 'position of a joint in the pose that determines sides'),
                            ('hold', 'position at which a joint is fixed')):
        parser.add_argument(f'--{option}', metavar='JOINT=VALUE', nargs='+', action='extend',
                            default=[], help=f'{meaning} [rad or m]; several may follow')
    arguments = parser.parse_args(args)
    with np.errstate(all='ignore'):
        robot = readers.read(arguments.file, arguments.loops)
        robot.check_names(arguments.driven or ())
        if arguments.driven:
            robot.driven = _motors(robot, arguments.driven)
        robot = with_positions(robot, positions(arguments.pose))
        robot = closing.held(robot, {**robot.held, **positions(arguments.hold)})
        parameters, reports, still = described(robot)
    # Unprintable characters in names of the file could end a comment.
    head = [truncated(line, 10 ** 6) for line in (
        f'From {arguments.file}. Its joints on /joint_states, and its model:',
        _launch(arguments, still), READING)]
    lines = [*dict.fromkeys(map(sentence, reports))]
    print(*(f'# {line}' for line in head + lines), in_yaml(parameters), sep='\n', end='')
    print(*(f'{NAME}: {line}' for line in lines), sep='\n', file=sys.stderr)
    if wrong := [line for line in reports if WRONG in line]:
        raise cli.RequestError(f'{len(wrong)} mechanisms are left out, as they differ from '
                               'the robot or could not be compared with it')


def _motors(robot: Robot, chosen: Sequence[str]) -> list[str]:
    """Return the joints that motors move: those chosen, and the file's in loops without any."""
    driven = [*chosen]
    for component in components(robot):
        if not {robot.source(name)[0] for name in component.named}.intersection(driven):
            driven += [name for name in robot.driven if name in component.named]
    return driven


def _launch(parsed: Any, still: Mapping[str, float]) -> str:
    """Return the command that launches the robot with its scene; some joints stay."""
    arguments = {'robot': parsed.file, 'scene': 'SCENE.yaml', 'loops': parsed.loops or '',
                 'hold': shlex.join([*parsed.hold, *(
                     f'{name}={short(value)}' for name, value in still.items())])}
    return 'ros2 launch linkage_ros robot.launch.py ' + ' '.join(
        f'{name}:={shlex.quote(text)}' for name, text in arguments.items() if text)


def described(robot: Robot) -> tuple[dict[str, Any], list[str], dict[str, float]]:
    """
    Return the parameters of a robot's scene, and the report on omissions and checks.

    Also return the positions of joints in loops that stay.
    """
    closed = closing.closed(robot)
    robot, reports = closed.robot, closed.report
    imported: list[check.Imported] = []
    groups = planar.groups(robot)
    names = {joint.name for joint in robot.joints}
    if unknown := [name for name in robot.driven if name not in names]:
        reports.append(f'Not driven: {join_names(unknown, 200)}: no joint of the file has this '
                       f'name{suggestion(unknown[0], robot.positions, 200)}')
    if not groups:
        # Joints that are held may leave no loop.
        reports += {*map(str, closed.faults.values())} or [
            'no joint of this robot closes a loop: an MJCF needs a connect or weld, an SDF a link '
            'with two parents, a URDF an element such as loop_joint or the option --loops FILE']
    for group in groups:
        fault = next((closed.faults[joint.name] for joint in group.joints
                      if joint.name in closed.faults), None)
        joints = group.joints
        try:
            if fault and not isinstance(fault, NotDriven):
                raise fault
            for part in group.parts:
                # What is no planar mechanism may be a part of one in space.
                with suppress(*_FAULTS if group.why else ()):
                    imported.append(planar.described(robot, part, imported, fault))
                    joints = [joint for joint in joints if joint not in part.joints]
            if joints:
                imported.append(rods.described(robot, group._replace(joints=joints), imported))
        except _FAULTS as error:
            is_driven = any(joint.name in robot.driven for joint in joints)
            why = fault if fault and (is_driven or isinstance(error, NotDriven)) else error
            in_space = f'{group.why}; ' + 'as rods in space: ' * (why is not fault)
            bodies = dict.fromkeys(body for joint in joints for body in joint.bodies)
            reports.append(f'Left out: {join_names(bodies, 200)}: '
                           f'{in_space * bool(group.why)}{why}.')
    balls = [[hinge.name for hinge in joint.hinges if hinge.position is not None]
             for group in groups for joint in group.joints]
    return _checked(robot, balls, imported, reports)


def _checked(robot: Robot, balls: Sequence[Sequence[str]], imported: Sequence[check.Imported],
             reports: list[str]) -> tuple[dict[str, Any], list[str], dict[str, float]]:
    """Return what is described, without mechanisms that differ from the robot."""
    if not imported:
        raise cli.RequestError(*reports)
    parameters = {'mechanisms': [made.name for made in imported], **{
        key: value for made in imported for key, value in made.parameters.items()}}
    mechanisms = scene.read(parameters).mechanisms
    known = check.published(mechanisms)
    # Of a ball of which some hinges turn the others stay.
    still = {name: robot.positions[name] for ball in balls if known.intersection(ball)
             for name in ball if name not in known}
    rest, lost = others(robot, mechanisms, still)
    mechanisms = scene.read({**parameters, **rest}).mechanisms
    checks, wrong = check.compared(robot, mechanisms, imported)
    if wrong:
        return _checked(robot, balls, [made for made in imported if made.name not in wrong], [
            *reports, *(f'Left out: {name}: {WRONG}: {why}.' for name, why in wrong.items())])
    reports = [*reports, *(report for made in imported for report in made.reports), *checks,
               *lost]
    if free := [joint.name for joint in robot.joints
                if not joint.is_cut and joint.kind not in (HINGE, SLIDE, FIXED)]:
        reports.append(f'Not published: {", ".join(free)}: only a hinge or a slide has one '
                       'position. The model of the robot has them fixed where the file has them.')
    return parameters, reports, still


def others(robot: Robot, mechanisms: Mapping[str, scene.SceneMechanism],
           held: Mapping[str, float]) -> tuple[dict[str, Any], list[str]]:
    """
    Return the parameters that add a mechanism of all joints that a scene does not publish.

    Also return the report on joints that nothing determines: undriven ones in loops, and what
    follows them.
    `held` are positions of joints that stay.
    """
    held = {name: value for name, value in {**robot.held, **held}.items()
            if name in robot.positions}
    known = check.published(mechanisms)
    passive = {joint.name for component in components(closing.held(robot, held))
               for joint in component.joints}.difference(known, held, robot.driven)
    drives: list[check.Source] = []
    joints, lost = [], []
    for name in [name for name in robot.positions if name not in known]:
        source, ratio, offset = (name, 1.0, 0.0) if name in held else robot.source(name)
        if source in passive:
            lost.append(name)
            continue
        value = ratio * held.get(source, robot.positions[source]) + offset
        # Inputs start at zero, also that of a wheel after many turns, or on a long rail.
        crank = f'crank{len(drives) + 1 if drives else ""}'
        drives.append(check.Source(crank, source, ratio, offset - value, 0.0))
        joints += [(crank, 1.0, name, value)] * (source != name)
    reports = [f'Not published: {", ".join(lost)}: passive joints of loops that no mechanism '
               'determines. What they carry has no transform.'] * bool(lost)
    if not drives:
        return {}, reports
    lines = ['A ground 0 0', *(f'B{i} crank A 1' for i in range(1, len(drives) + 1))]
    return {'mechanisms': [*mechanisms, OTHERS], **check.parameters(
        OTHERS, 'custom', lines, drives, joints,
        **{f'{drive.name}.speed': 0.0 for drive in drives})}, reports


def positions(texts: Sequence[str]) -> dict[str, float]:
    """Parse texts such as JOINT=VALUE; raise RequestError for an invalid one."""
    values = {}
    for text in texts:
        name, _, value = text.rpartition('=')
        values[name] = math.nan
        with suppress(ValueError):
            values[name] = float(value)
        if not name or not abs(values[name]) < MAX_NUMBER:
            raise cli.RequestError(f'{text!r} must be JOINT=VALUE, its value in rad or m')
    return values
