# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Command that prints the scene of a robot's closed loops; it needs no ROS."""

from __future__ import annotations

from itertools import combinations
import math
import re
import sys
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple

import numpy as np

from . import loops, readers
from .dyads import Drawing, short
from .. import command, mechanisms, scene
from ..linkage.mechanism import Mechanism
from ..scene.writing import in_yaml

NAME = 'from_robot'
NEEDS = 'pip install pyyaml, and mujoco for MJCF'
# Of the size of a linkage, what is rounding, and what may be left of a parallelogram made exact.
ROUNDING, NEARLY = 1e-12, 1e-9
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
    asked = parser.parse_args(args)
    robot = readers.read(asked.file, asked.loops)
    robot.driven = asked.driven or robot.driven
    given, said = described(robot)
    print(f'# From {asked.file}.', *(f'# {line}' for line in said), in_yaml(given),
          sep='\n', end='')
    print(*(f'{NAME}: {line}' for line in said), sep='\n', file=sys.stderr)


def described(robot: readers.Robot) -> Tuple[Dict[str, Any], List[str]]:
    """Return the parameters of a robot's scene, and what is left out and what was checked."""
    drawn: Dict[str, Drawing] = {}
    said: List[str] = []
    for ground, frame_id, joints in loops.groups(robot):
        try:
            drawing = _drawn(robot, ground, frame_id, joints)
        except ValueError as error:
            bodies = dict.fromkeys(body for joint in joints for body in joint.bodies)
            said.append(f'Left out: {", ".join(bodies)}: {error}.')
            continue
        said += _left_out(drawing)
        if drawing.drives:
            name = re.sub('[^A-Za-z0-9]+', '_', f'{drawing.drives[0].joint.name}').strip('_')[:60]
            name = name if name[:1].isalpha() else f'joint_{name}'
            drawn[f'{name}_{len(drawn)}' if name in drawn else name] = drawing
    if not drawn:
        raise command.RequestError(' '.join(said) or 'no joint of this robot closes a loop')
    given: Dict[str, Any] = {'mechanisms': list(drawn)}
    for name, drawing in drawn.items():
        given.update((f'{name}.{key}', value) for key, value in _parameters(robot, drawing))
    machines = scene.read(given).machines
    for name, drawing in drawn.items():
        off, gap = _apart(machines[name].linkage, drawing), drawing.loop.gap
        if not off <= NEARLY:
            raise command.RequestError(
                f'{name} is {off:.2g} of its size away from the pose of the file, where it is '
                'nearly stretched or folded')
        was = f', whose loops are open by {gap:.2g} m and were closed' \
            if gap > ROUNDING * drawing.loop.size else ''
        exact = '; its bars were made exactly parallel' if off > ROUNDING else ''
        said.append(f'Checked: {name} has the pose of the file{was}, to {off:.0e} of its size'
                    f'{exact}.')
        told = {called.name for called in machines[name].joints.values() if called.published}
        told |= {joint.name for joint in drawing.driven}
        own = [part for joint in drawing.loop.joints for part in joint.name.split('+')]
        if lost := [joint.name for joint in robot.joints if joint.position is not None
                    and joint.name in own and joint.name not in told]:
            said.append(f'Not published: {", ".join(lost)}, which no angle in the plane tells.')
    return given, said


def _drawn(robot: readers.Robot, ground: str, frame_id: str, joints: Sequence[readers.Joint]
           ) -> Drawing:
    """Return the lines of a group of loops, with the drives that place the most of it."""
    drawings: List[Drawing] = []
    for drives in _drives(robot, [joint.name for joint in joints if joint.position is not None]):
        loop = loops.flat(robot, ground, frame_id, joints, drives)
        drawings.append(Drawing(loops.closed(loop, drives), drives))
        if not drawings[-1].left:
            break
    if not drawings:
        raise ValueError('not driven: say by --driven which joint moves them')
    best = min(drawings, key=lambda drawing: len(drawing.left))
    for i, line in enumerate(best.lines):
        # At a change point the side seen in this pose is not always the one to be written.
        name, *_, side = line.split()
        if side in _OTHER and not _apart(_linkage(best), best, name) < 1e-6:
            best.lines[i] = line[:-len(side)] + _OTHER[side]
    return best


def _drives(robot: readers.Robot, names: Sequence[str]) -> Iterator[Sequence[str]]:
    """Yield what may drive: motors, then also what follows; any where the file has no motor."""
    motors = [name for name in names if name in robot.driven]
    yield from filter(None, (motors, [name for name in names
                                      if name in motors or name in robot.follows]))
    if not robot.driven:
        yield from (pair for count in (1, 2) for pair in combinations(names, count))


def _left_out(drawing: Drawing) -> Iterator[str]:
    if left := drawing.left:
        held = [joint for joint in drawing.loop.joints if {*joint.bodies} & {*left}]
        free = 3 * len(left) - 2 * len(held) - sum(joint in drawing.driven for joint in held)
        names = ', '.join(joint.name for joint in held)
        why = f'not driven: {free} more of {names} must be' if free > 0 else (
            'not of dyads: all of them hold each other, as on a platform on three bars'
            if free == 0 else f'held more than once by {names}')
        yield f'Left out: {", ".join(left)}: {why}.'


def _linkage(drawing: Drawing) -> Mechanism:
    return mechanisms.create('custom', joints=drawing.lines)


def _values(drawing: Drawing) -> Any:
    values = [drive.value for drive in drawing.drives]
    return values if len(values) > 1 else values[0]


def _apart(linkage: Mechanism, drawing: Drawing, *names: str) -> float:
    """Return how far joints are from the pose of the file, as a part of the linkage's size."""
    places = linkage.solve(_values(drawing))
    return float(np.max([abs(complex(*places[name]) - drawing.places[name])
                         for name in names or drawing.places])) / drawing.loop.size


def _parameters(robot: readers.Robot, drawing: Drawing) -> Iterator[Tuple[str, Any]]:
    seen = [(joint, joint.position, found) for joint in drawing.loop.joints
            if joint.position is not None and joint not in drawing.driven
            and (found := drawing.seen(joint))]
    linkage, frame = _linkage(drawing), drawing.loop.frame
    yield 'type', 'custom'
    yield 'joints', drawing.lines
    yield 'frame_id', drawing.loop.frame_id
    yield 'pose', [float(short(value)) for value in (*frame[:3, 3], *_rpy(frame[:3, :3]))]
    for drive in drawing.drives:
        source, ratio = drive.joint.name, drive.ratio
        offset = drive.value - ratio * (drive.joint.position or 0.0)
        if source in robot.follows and source not in robot.driven:
            source, factor, start = robot.follows[source]
            ratio, offset = ratio * factor, offset + ratio * start
        yield f'{drive.name}.source', source
        yield f'{drive.name}.ratio', ratio
        yield f'{drive.name}.offset', float(short(offset))
        yield f'{drive.name}.start', float(short(drive.value, 1e-15))
    angles, names = linkage.joint_angles(_values(drawing)), []
    for joint, position, (ends, sign) in seen:
        link = next(link.name for link in linkage.links if (link.joint, link.tip) == ends
                    and (link.kind == 'prismatic') == (joint.kind == readers.SLIDE))
        zero = float(short(position - sign * float(angles[link])))
        names.append(f'{link}={"-" * (sign < 0.0)}{joint.name}' + (f'{zero:+}' if zero else ''))
    yield 'joint_names', names
    yield 'only_named', True


def _rpy(turned: np.ndarray) -> Tuple[float, float, float]:
    a, b = turned[:2, 0]
    yaw = math.atan2(b, a) if math.hypot(a, b) > 1e-9 else 0.0
    sin, cos = math.sin(yaw), math.cos(yaw)
    ahead, aside = turned[:2, 2], turned[:2, 1]
    return (math.atan2(sin * ahead[0] - cos * ahead[1], cos * aside[1] - sin * aside[0]),
            math.atan2(-turned[2, 0], cos * a + sin * b), yaw)

