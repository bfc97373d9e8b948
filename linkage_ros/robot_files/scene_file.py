# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The scene file of a robot's closed loops, checked against the pose of its file."""

from __future__ import annotations

from itertools import combinations
import math
import re
from typing import Dict, Iterator, List, Sequence, Tuple

import numpy as np

from . import loops
from .dyads import Drawing
from .readers import Joint, Robot
from .. import mechanisms, scene
from ..command import RequestError

# Of the size of a linkage, by how much a pose of the scene may differ from that of the file.
ROUNDING = 1e-12


def write(robot: Robot, source: str) -> Tuple[str, List[str]]:
    """Return the scene file, and what is said of it: what was left out and what was checked."""
    said: List[str] = []
    drawn: Dict[str, Drawing] = {}
    for ground, joints in loops.blocks(robot):
        bodies = dict.fromkeys(b for joint in joints for b in (joint.parent, joint.child))
        try:
            drawing = _drawn(robot, ground, joints)
        except ValueError as error:
            said.append(f'{", ".join(bodies)}: {error}')
            continue
        said += _reasons(drawing)
        if drawing.drives:
            drawn[_called(drawing.drives[0].joint.joint.name, drawn)] = drawing
    if not drawn:
        raise RequestError(f'{source} has no closed loop that can be driven: '
                           + ('; '.join(said) or 'no joint closes one'))
    given, checked = {'mechanisms': list(drawn)}, []
    grounds = list(dict.fromkeys(drawing.loop.ground for drawing in drawn.values()))
    given['frame_id'] = grounds[0]
    for name, drawing in drawn.items():
        given.update(_parameters(robot, name, drawing, len(grounds) > 1))
    machines = scene.read(given).machines
    for name, drawing in drawn.items():
        error = _differs(machines[name].linkage, drawing)
        if not error <= ROUNDING:
            raise RequestError(f'{name} differs from the pose in {source} by {error:.2g} of its '
                               'size: it is nearly stretched or folded there')
        opened = (f'; the loops of the file, open by {drawing.loop.gap:.2g} m, were closed'
                  if drawing.loop.gap > ROUNDING * drawing.loop.size else '')
        checked.append(f'{name} has the pose of the file, to {error:.0e} of its size{opened}')
    head = [f'From {source}.', *(f'Left out: {why}.' for why in said),
            *(f'Checked: {what}.' for what in checked)]
    return _yaml(given, head), head[1:]


def _drawn(robot: Robot, ground: str, joints: Sequence[Joint]) -> Drawing:
    """Return the lines of a group of loops, driven by what its file drives."""
    best = None
    for drives in _drives(robot, joints):
        drawing = Drawing(loops.closed(loops.flat(robot, ground, joints, drives), drives), drives)
        if best is None or len(drawing.left) < len(best.left):
            best = drawing
        if not best.left:
            break
    if best is None:
        raise ValueError('not driven: the file names no motor on these')
    _choose_sides(best)
    return best


def _drives(robot: Robot, joints: Sequence[Joint]) -> Iterator[Sequence[str]]:
    """Yield what may drive: motors, then what follows one; where no motor is named, any joint."""
    names = [joint.name for joint in joints if joint.position is not None]
    motors = [name for name in names if name in robot.driven]
    if motors:
        yield motors
    more = [name for name in names if name in robot.follows]
    if more:
        yield [*motors, *(name for name in more if name not in motors)]
    if not robot.driven:
        for count in (1, 2):
            yield from combinations(names, count)


def _choose_sides(drawing: Drawing) -> None:
    """Change sides where the one seen in the pose is not to be written, at change points."""
    other = {'left': 'right', 'right': 'left', 'out': 'in', 'in': 'out'}
    for i, line in enumerate(drawing.lines):
        name, word = line.split()[0], line.split()[-1]
        if word in other and 'rigid' not in line:
            linkage = mechanisms.create('custom', joints=drawing.lines)
            if not _apart(linkage, drawing, [name]) <= 1e-6:
                drawing.lines[i] = line[:-len(word)] + other[word]


def _apart(linkage, drawing: Drawing, names: Sequence[str]) -> float:
    """Return how far joints are from where they are in the file, as a part of the size."""
    values = [drive.value for drive in drawing.drives]
    places = linkage.solve(values if len(values) > 1 else values[0])
    gaps = [abs(complex(*places[name]) - drawing.names[name]) for name in names
            if name in places]
    return float(np.max(gaps)) / drawing.loop.size


def _differs(linkage, drawing: Drawing) -> float:
    return _apart(linkage, drawing, list(drawing.names))


def _reasons(drawing: Drawing) -> Iterator[str]:
    left = drawing.left
    if left:
        held = [joint for joint in drawing.loop.joints if set(joint.bodies) & set(left)]
        free = 3 * len(left) - 2 * len(held) - sum(joint in drawing.driven for joint in held)
        why = (f'not driven: {free} more of {", ".join(j.joint.name for j in held)} must drive'
               if free > 0 else 'not of dyads: they hold each other, as a group of three bars '
               'or more' if free == 0 else 'held more than once')
        yield f'{", ".join(left)}: {why}'


def _called(joint: str, taken) -> str:
    """Return a mechanism's name, after the joint that drives it."""
    name = re.sub('[^A-Za-z0-9]+', '_', joint).strip('_')[:60] or 'linkage'
    name = name if name[0].isalpha() else f'joint_{name}'
    return name if name not in taken else f'{name}_{len(taken)}'


def _parameters(robot: Robot, name: str, drawing: Drawing, moving: bool) -> Dict[str, object]:
    loop = drawing.loop
    given: Dict[str, object] = {'type': 'custom', 'joints': drawing.lines}
    given['pose'] = [*loop.frame[:3, 3].tolist(), *_rpy(loop.frame)]
    if moving:
        given['frame_id'] = loop.ground
    for drive in drawing.drives:
        position = drive.joint.joint.position or 0.0
        own, ratio = drive.joint.joint.name, drive.ratio
        offset = drive.value - ratio * position
        if own in robot.follows and own not in robot.driven:
            own, factor, start = robot.follows[own]
            ratio, offset = ratio * factor, offset + ratio * start
        given[f'{drive.name}.source'] = own
        given[f'{drive.name}.ratio'] = ratio
        given[f'{drive.name}.offset'] = offset
        given[f'{drive.name}.start'] = drive.value
    linkage = mechanisms.create('custom', joints=drawing.lines)
    return {f'{name}.{key}': value for key, value in given.items()}


def _rpy(frame: np.ndarray) -> Tuple[float, float, float]:
    if abs(frame[2, 0]) > 1.0 - 1e-12:
        return math.atan2(-frame[1, 2], frame[1, 1]), -math.copysign(math.pi / 2, frame[2, 0]), 0.0
    return (math.atan2(frame[2, 1], frame[2, 2]), math.asin(-frame[2, 0]),
            math.atan2(frame[1, 0], frame[0, 0]))


def _yaml(given: Dict[str, object], head: Sequence[str]) -> str:
    lines = [*(f'# {line}' for line in head), '/**:', '  ros__parameters:']
    for key, value in given.items():
        if isinstance(value, list) and isinstance(value[0], str) and key.endswith('.joints'):
            lines += [f'    {key}:', *(f'      - "{line}"' for line in value)]
        elif isinstance(value, list) and not isinstance(value[0], str):
            lines.append(f'    {key}: [{", ".join(repr(float(x) + 0.0) for x in value)}]')
        elif isinstance(value, float):
            lines.append(f'    {key}: {float(value) + 0.0!r}')
        else:
            lines.append(f'    {key}: {str(value).replace(chr(39), "")}')
    return '\n'.join(lines)
