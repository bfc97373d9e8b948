# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Planar loops of a robot as mechanisms of a scene, compared with the robot."""

from __future__ import annotations

from itertools import combinations
import math
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple

import numpy as np

from . import check, loops, model
from .dyads import Drawing, short, Source
from .robot import Joint, plain, Robot
from .. import scene
from ..linkage.dyads import ROUNDING
from ..scene.joint_names import quoted_name

# The most joints of which pairs are tried as motors.
MANY = 30
_OTHER = {'left': 'right', 'right': 'left', 'out': 'in', 'in': 'out'}


class NotPlaced(ValueError):
    """Why bodies are not placed."""

    def __init__(self, drawing: Drawing):
        super().__init__(_why(drawing))
        self.bodies = drawing.left


def described(robot: Robot, group: loops.Group, others: Sequence[str]
              ) -> Tuple[str, Dict[str, Any], List[str]]:
    """
    Return a mechanism's name, its parameters, and its report.

    Raises ValueError for loops that are no dyads, or whose poses are others than the robot's.
    """
    drawing = _drawn(robot, group)
    name = plain(drawing.moved_by[0].name, 60)
    name = f'{name}_{len(others)}' if name in others else name
    loop, given = drawing.loop, {
        f'{name}.{key}': value for key, value in _parameters(drawing)}
    machine = scene.read({'mechanisms': [name], **given}).machines[name]
    if not any(called.published for called in machine.joints.values()):
        raise NotPlaced(drawing)
    for drive in drawing.drives:
        start = f'{name}.{drive.name}.start'
        if sweep := None if drawing.measured else _sweep(drive, machine.inputs[drive.name]):
            given[f'{name}.{drive.name}.sweep'] = [*sweep]
            given[start] = min(max(given[start], sweep[0]), sweep[1])
    machine = scene.read({'mechanisms': [name], **given}).machines[name]
    if drawing.apart(machine.linkage) > drawing.allowed:
        raise ValueError('it has another pose than the robot, which is nearly stretched or folded')
    report = check.compared(robot, machine, [joint.name for joint in drawing.moved_by],
                            drawing.ends, loop.lean + loop.gap / loop.size)
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


def _drawn(robot: Robot, group: loops.Group) -> Drawing:
    """Return the lines of loops, with the inputs that place the most bodies."""
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
        # A link on the ground drives, and the motor between two moving links measures it.
        for joint in group.joints:
            if group.ground in joint.bodies and joint.position is not None:
                other = Drawing(robot, loops.flat(robot, group, [joint.name]), [joint.name])
                if (not other.left or other.freedom < 0) and [
                        each.source for each in other.drives] == [joint.name]:
                    other.measured = next(each for each in other.loop.joints
                                          if each.name == motors[0])
                    return other
    if not best.drives:
        raise NotPlaced(best) if best.left else ValueError('no motor moves it')
    for i, line in enumerate(best.lines):
        # At a change point the side in this pose may be the wrong one.
        name, *_, side = line.split()
        if side in _OTHER and not best.apart(best.linkage, name) < best.allowed:
            best.lines[i] = line[:-len(side)] + _OTHER[side]
    return best


def _why(drawing: Drawing) -> str:
    """Return why bodies are left."""
    free, held = drawing.freedom, drawing.holders
    names = ', '.join(joint.name for joint in held if joint.position is not None)
    between = [joint.name for joint in held if joint in drawing.driven
               and {*joint.bodies} <= {*drawing.left}]
    if between and free <= 0:
        return f'not of dyads, as {", ".join(between)} drives between two of them'
    return f'not driven: {free} more of {names} must be, named by --driven' if free > 0 else (
        'not of dyads: all of them hold each other, as on a platform on three bars'
        if free == 0 else f'held more than once by {names}')


def _sweep(drive: Source, read: scene.InputSettings) -> Optional[Tuple[float, float]]:
    """Return the limits of an input: those of its joint, within its reach."""
    if drive.ends is None:
        return None
    low, high = (float(short(end, 1e-15)) for end in drive.ends)
    for start, end in () if read.input.is_whole(read.reach) else read.reach:
        turns = math.tau * math.floor((drive.value - start) / math.tau) * read.input.turns
        if start + turns <= drive.value <= end + turns:
            # An end that is a dead point is not quite reached.
            edge = ROUNDING * (end - start)
            low, high = max(low, start + turns + edge), min(high, end + turns - edge)
    return (low, high) if low + 1e-6 * read.input.size < high else None


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
    links = {link.name: link for link in drawing.linkage.links}
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
