# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Command that prints the scene of a robot's closed loops; it needs no ROS."""

from __future__ import annotations

from itertools import combinations
import math
import shlex
import sys
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from . import check, closing, loops, model, readers, rods
from .dyads import Drawing, short, Source
from .robot import FARTHEST, Joint, plain, Robot
from .. import command, mechanisms, scene
from ..linkage.mechanism import Mechanism
from ..scene.joint_names import quoted_name
from ..scene.writing import in_yaml
from ..words import elided

NAME = 'from_robot'
NEEDS = 'pip install pyyaml, and mujoco for MJCF'
# Of more joints no pairs are tried as motors.
MANY = 30
# What is said of a mechanism that is not its robot's, or could not be held against it.
WRONG = 'held against the robot'
_OTHER = {'left': 'right', 'right': 'left', 'out': 'in', 'in': 'out'}


def main(args: Optional[List[str]] = None) -> int:
    """Print a scene file; return the exit code."""
    return command.run(NAME, show, args, NEEDS)


def show(args: Optional[List[str]]) -> None:
    """Print what a command line asks for."""
    parser = command.Parser(NAME, description='Print the scene of the planar closed loops in a '
                            'robot: MJCF, SDF or URDF.')
    parser.add_argument('file', metavar='FILE', help='the robot')
    parser.add_argument('--loops', metavar='FILE', help='YAML with the loop joints of a URDF')
    parser.add_argument('--driven', metavar='JOINT', nargs='+', help='joints that motors move '
                        '(default: those of which the file says so, or else of any)')
    for option, meaning in (('pose', 'where a joint is while sides are read'),
                            ('hold', 'where a joint stays')):
        parser.add_argument(f'--{option}', metavar='JOINT=VALUE', nargs='+', default=[],
                            help=f'{meaning} [rad or m]; several may follow')
    asked = parser.parse_args(args)
    with np.errstate(all='ignore'):
        robot = readers.read(asked.file, asked.loops)
        robot.driven = asked.driven or robot.driven
        closing.check_names(robot, asked.driven or ())
        robot = closing.posed(robot, _values(asked.pose))
        robot = closing.held(robot, {**robot.held, **_values(asked.hold)})
        given, said = described(robot)
    # Names in the file are the file's: what is no letter in them could end a comment.
    head = [elided(line, 10 ** 6) for line in (
        f'From {asked.file}. All its joints on /joint_states, and its model:', _launch(asked),
        *said)]
    print(*(f'# {line}' for line in head), in_yaml(given), sep='\n', end='')
    print(*(f'{NAME}: {line}' for line in head[2:]), sep='\n', file=sys.stderr)
    if wrong := [line for line in said if WRONG in line]:
        raise command.RequestError(f'{len(wrong)} mechanisms are left out, as they could not be '
                                   'held against the robot')


def _launch(asked: Any) -> str:
    """Return the line that brings up the robot with its scene."""
    said = {'robot': asked.file, 'scene': 'SCENE.yaml', 'loops': asked.loops or '',
            'hold': ' '.join(asked.hold)}
    return 'ros2 launch linkage_ros robot.launch.py ' + ' '.join(
        f'{name}:={shlex.quote(text)}' for name, text in said.items() if text)


class _NotPlaced(ValueError):
    """Why bodies are not placed."""

    def __init__(self, drawing: Drawing):
        super().__init__(_why(drawing))
        self.bodies = drawing.left


def described(robot: Robot) -> Tuple[Dict[str, Any], List[str]]:
    """Return the parameters of a robot's scene, and reports on omissions and checks."""
    given: Dict[str, Any] = {'mechanisms': []}
    closed = closing.closed(robot)
    robot, said = closed.robot, closed.said

    def add(name: str, parameters: Mapping[str, Any], more: Sequence[str]) -> None:
        given['mechanisms'].append(name)
        given.update(parameters)
        said.extend(more)

    for group in loops.groups(robot, closed.stiff):
        open_one, fault = (_first(reasons, group.joints) for reasons in (
            closed.open_ones, closed.faults))
        left = group.joints
        for part in (group.parts if group.why else [group]) if not open_one else ():
            try:
                add(*_checked(robot, _drawn(robot, part), given['mechanisms']))
            except (ArithmeticError, ValueError) as error:
                if group.why:
                    continue
                reason = f'{WRONG}: {error}' if isinstance(error, check.Difference) else (
                    fault or error)
                bodies = error.bodies if isinstance(error, _NotPlaced) else _bodies(left)
                said.append(f'Left out: {", ".join(bodies)}: {reason}.')
            done = {joint.name for joint in part.joints}
            left = [joint for joint in left if joint.name not in done]
        if not left:
            continue
        try:
            if open_one:
                raise ValueError(open_one)
            add(*rods.described(robot, group._replace(joints=left), given['mechanisms']))
        except (ArithmeticError, ValueError) as error:
            why = fault or (f'as rods in space: {error}' if group.why else error)
            said.append(f'Left out: {", ".join(_bodies(left))}: '
                        + f'{group.why}; ' * bool(group.why) + f'{why}.')
    if not given['mechanisms']:
        raise command.RequestError(' '.join(said) or 'no joint of this robot closes a loop')
    return given, said


def _values(said: Sequence[str]) -> Dict[str, float]:
    """Parse texts such as JOINT=VALUE; raise RequestError for an invalid one."""
    found = {}
    for each in said:
        name, _, value = each.rpartition('=')
        try:
            found[name] = float(value)
        except ValueError:
            found[name] = math.nan
        if not name or not abs(found[name]) < FARTHEST:
            raise command.RequestError(f'{each!r} must be JOINT=VALUE, its value in rad or m')
    return found


def _first(reasons: Mapping[str, str], joints: Sequence[Joint]) -> str:
    return next((reasons[joint.name] for joint in joints if joint.name in reasons), '')


def _bodies(joints: Sequence[Joint]) -> List[str]:
    return [*dict.fromkeys(body for joint in joints for body in joint.bodies)]


def _drawn(robot: Robot, group: loops.Group) -> Drawing:
    """Return the lines of a group of loops, with the drives that place the most of it."""
    names = [joint.name for joint in group.joints if joint.position is not None]
    motors = [name for name in names if name in robot.driven]
    tries: List[Sequence[str]] = [motors, [name for name in names
                                           if name in motors or name in robot.follows]]
    if not robot.driven:
        tries += (pair for count in (1, 2)[:1 + (len(names) <= MANY)]
                  for pair in combinations(names, count))
    drawings: List[Drawing] = []
    for drives in tries:
        loop = loops.flat(robot, group, drives)
        drawings.append(Drawing(robot, loop, drives))
        if not drawings[-1].left:
            break
    best = min(drawings, key=lambda drawing: len(drawing.left))
    if best.left and len(motors) == 1 and all(
            group.ground not in joint.bodies for joint in group.joints if joint.name == motors[0]):
        # A motor between two moving links is measured by what moves instead, a link on the ground.
        for joint in group.joints:
            if group.ground in joint.bodies and joint.position is not None:
                other = Drawing(robot, loops.flat(robot, group, [joint.name]), [joint.name])
                if (not other.left or _free(other)[0] < 0) and [
                        each.source for each in other.drives] == [joint.name]:
                    other.measured = next(each for each in other.loop.joints
                                          if each.name == motors[0])
                    return other
    if not best.drives:
        raise _NotPlaced(best) if best.left else ValueError('no motor moves it')
    for i, line in enumerate(best.lines):
        # At a change point the side seen in this pose is not always the one to be written.
        name, *_, side = line.split()
        if side in _OTHER and not _apart(_linkage(best), best, name) < best.allowed:
            best.lines[i] = line[:-len(side)] + _OTHER[side]
    return best


def _free(drawing: Drawing) -> Tuple[int, List[Joint]]:
    """Return in how many ways bodies that are left can move, and the joints that hold them."""
    held = [joint for joint in drawing.loop.joints if {*joint.bodies} & {*drawing.left}]
    return 3 * len(drawing.left) - 2 * len(held) - sum(
        joint in drawing.driven for joint in held), held


def _why(drawing: Drawing) -> str:
    """Return why bodies are left."""
    free, held = _free(drawing)
    names = ', '.join(joint.name for joint in held if joint.position is not None)
    between = [joint.name for joint in held if joint in drawing.driven
               and {*joint.bodies} <= {*drawing.left}]
    if between and free <= 0:
        return f'not of dyads, as {", ".join(between)} drives between two of them'
    return f'not driven: {free} more of {names} must be, named by --driven' if free > 0 else (
        'not of dyads: all of them hold each other, as on a platform on three bars'
        if free == 0 else f'held more than once by {names}')


def _checked(robot: Robot, drawing: Drawing, others: Sequence[str]
             ) -> Tuple[str, Dict[str, Any], List[str]]:
    """Return a mechanism's name and parameters, and its report, for a given pose."""
    name = plain(drawing.moved_by[0].name, 60)
    name = f'{name}_{len(others)}' if name in others else name
    loop, given = drawing.loop, {
        f'{name}.{key}': value for key, value in _parameters(drawing)}
    machine = scene.read({'mechanisms': [name], **given}).machines[name]
    if not any(called.published for called in machine.joints.values()):
        raise _NotPlaced(drawing)
    for drive in drawing.drives:
        start = f'{name}.{drive.name}.start'
        if sweep := None if drawing.measured else _sweep(drive, machine.inputs[drive.name]):
            given[f'{name}.{drive.name}.sweep'] = [*sweep]
            given[start] = min(max(given[start], sweep[0]), sweep[1])
    machine = scene.read({'mechanisms': [name], **given}).machines[name]
    if _apart(machine.linkage, drawing) > drawing.allowed:
        raise ValueError('it has another pose than the robot, which is nearly stretched or folded')
    report = check.compared(robot, machine, [joint.name for joint in drawing.moved_by],
                            _ends(drawing), loop.lean + loop.gap / loop.size)
    said = [f'Left out: {", ".join(drawing.left)}: {_why(drawing)}.'] if drawing.left else []
    said.append(report)
    said += [f'{joint} has its ends {gap:.2g} m apart along its axis, on which no angle depends.'
             for joint, gap in loop.across.items()]
    published = {called.name for called in machine.joints.values() if called.published}
    published |= {joint.name for joint in drawing.moved_by}
    own = {one.name for joint in loop.joints if drawing.parts.keys() >= {*joint.bodies}
           for one in joint.hinges}
    if lost := [joint for joint in robot.positions if joint in own - published]:
        said.append(f'Not published: {", ".join(lost)}, which no angle in the plane tells.')
    return name, given, said


def _sweep(drive: Source, read: scene.InputSettings) -> Optional[Tuple[float, float]]:
    """Return between which ends the limits of its joint let an input move, in its reach."""
    if drive.ends is None:
        return None
    low, high = (float(short(end, 1e-15)) for end in drive.ends)
    for start, end in () if read.input.is_whole(read.reach) else read.reach:
        turns = math.tau * math.floor((drive.value - start) / math.tau) * read.input.turns
        if start + turns <= drive.value <= end + turns:
            # An end that is a dead point is not quite reached.
            edge = loops.ROUNDING * (end - start)
            low, high = max(low, start + turns + edge), min(high, end + turns - edge)
    return (low, high) if low + 1e-6 * read.input.size < high else None


def _linkage(drawing: Drawing) -> Mechanism:
    return mechanisms.create('custom', joints=drawing.lines)


def _inputs(drawing: Drawing) -> Any:
    values = [drive.value for drive in drawing.drives]
    return values if len(values) > 1 else values[0]


def _apart(linkage: Mechanism, drawing: Drawing, *names: str) -> float:
    """Return how far joints are from the pose of the file, as a part of the linkage's size."""
    places = linkage.solve(_inputs(drawing))
    return float(np.max([abs(complex(*places[name]) - place) for name, place in drawing.places
                         if name in (names or places)])) / drawing.loop.size


def _ends(drawing: Drawing) -> Dict[str, Tuple[float, float]]:
    """Return between which positions each source moves in a check."""
    found: Dict[str, Tuple[float, float]] = {}
    if joint := drawing.measured:
        start = joint.start
        return {joint.name: joint.limits or (start - 0.5 * math.pi, start + 0.5 * math.pi)}
    for drive in drawing.drives:
        around = math.pi if drive.name[:5] == 'crank' else 0.5 * drawing.loop.size
        low, high = drive.value - around, drive.value + around
        if drive.ends:
            low, high = max(drive.ends[0], low - around), min(drive.ends[1], high + around)
            low, high = (low, high) if low < high else drive.ends
        low, high = sorted((end - drive.offset) / drive.ratio for end in (low, high))
        found[drive.source] = low, high
    return found


def _parameters(drawing: Drawing) -> Iterator[Tuple[str, Any]]:
    seen = [(joint, found) for joint in drawing.loop.joints if joint.position is not None
            and joint not in drawing.moved_by and joint not in drawing.driven
            and (found := drawing.measured_by(joint))]
    frame = drawing.loop.frame
    measured = drawing.measured and drawing.measured_by(drawing.measured)
    yield 'type', 'custom'
    yield 'joints', drawing.lines
    yield 'frame_id', drawing.loop.frame_id
    yield 'pose', [float(short(value)) for value in (*frame[:3, 3], *model.rpy(frame[:3, :3]))]
    links = {link.name: link for link in _linkage(drawing).links}
    names = []

    def zero_of(joint: Joint, link: str, sign: float, angle: float) -> float:
        if links[link].kind != 'prismatic':
            angle = math.remainder(angle - float(np.asarray(links[link].zero)), math.tau)
        return float(short(joint.start - sign * angle))

    for drive in drawing.drives:
        source, ratio, offset = drive.source, drive.ratio, float(short(drive.offset))
        if measured and drawing.measured:
            names.append(_line(drive.name, ratio, source, -ratio * offset))
            link, ratio, angle = measured
            source, offset = drawing.measured.name, -ratio * zero_of(
                drawing.measured, link, ratio, angle)
            yield f'{drive.name}.measures', link
        yield f'{drive.name}.source', source
        yield f'{drive.name}.ratio', ratio
        yield f'{drive.name}.offset', offset
        yield f'{drive.name}.start', float(short(drive.value, 1e-15))
    names += [_line(found[0], found[1], joint.name, zero_of(joint, *found))
              for joint, found in seen]
    yield 'joint_names', names
    yield 'only_named', True


def _line(link: str, sign: float, name: str, zero: float) -> str:
    """Return how a link is published, for joint_names."""
    return f'{link}={"-" * (sign < 0.0)}{quoted_name(name)}' + (f'{zero:+}' if zero else '')
