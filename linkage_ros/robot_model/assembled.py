# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""
Robot models for simulators: closed loops, initial pose, masses, gears and motors.

All inputs are at their starts, so that every loop is closed at the beginning of a simulation.
"""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Dict, Iterator, NamedTuple, Sequence, Tuple

import numpy as np

from .bodies import BALL, Body, BOX, Joint, Motor, Part, Piece, Point, pose, Robot, ROD, size
from ..scene import SceneError, SceneMechanism
from ..scene.motion import Motion

# Density of aluminium [kg/m^3].
DENSITY = 2700.0


class Weight(NamedTuple):
    """Mass [kg], centre of mass x, y [m], moments of inertia about it xx, yy, zz, xy [kg m^2]."""

    mass: float
    centre: Tuple[float, float]
    moments: Sequence[float]


def assembled(robot: Robot, density: float = DENSITY) -> Robot:
    """Return a robot model at the start of its inputs; raise SceneError if there is no pose."""
    homes = {point.name: (body.name, point.place) for body in robot.bodies
             for point in body.points}
    made = replace(robot, parts=[], motors=[], gears={}, density=density)
    for part in robot.parts:
        if not (machine := part.machine):
            made.parts.append(part)
            continue
        starts = {name: Motion.of(drive).at(0)[0] for name, drive in machine.inputs.items()}
        positions, rates = _solved(machine, starts)
        bodies = []
        for body in (*part.bodies, *_slots(machine, part.bodies, positions)):
            home, (x, y) = homes.get(body.parent, (body.parent, (0.0, 0.0)))
            u, v, *turned = body.pose
            bodies.append(replace(body, parent=home, pose=(u + x, v + y, *turned), position=(
                positions.get(body.joint.name, 0.0) if body.joint else 0.0)))
        made.parts.append(Part(bodies, machine))
        tips = {link.name: link.tip for link in machine.linkage.links}
        mass = sum(weight(body.solid, density).mass for body in bodies[1:])
        for name, drive in machine.inputs.items():
            joint = machine.joints[name]
            arm = math.hypot(*machine.linkage.frames[name][tips[name]])
            ends = sorted(map(joint.of, drive.sweep or ()))
            made.motors.append(Motor(joint.name, drive.input.turns, joint.of(starts[name]), ends,
                                     mass, machine.scale * arm if arm else size(machine)))
        made.gears.update((name, max(rates[name].items(), key=lambda item: abs(item[1])))
                          for name in rates)
    return made


def _solved(machine: SceneMechanism, starts: Dict[str, float]
            ) -> Tuple[Dict[str, float], Dict[str, Dict[str, float]]]:
    """Return the initial positions of joints, and the rates of geared ones by each input."""
    assembly, published, inputs = machine.assembly(), machine.joints, list(machine.inputs)
    solution = assembly.solution((), assembly.joints, assembly.joints)
    values = dict(starts)
    rates: Dict[str, Dict[str, float]] = {}
    count = len(assembly.joints)
    for driving in inputs:
        solution.solve(list(starts.values()), [float(name == driving) for name in inputs])
        for prefix, row in zip(assembly.legs, solution.rows.tolist()):
            values.update(zip([prefix + joint for joint in assembly.joints], row))
            for joint, rate in zip(assembly.joints, row[count:]):
                if joint in machine.linkage.geared:
                    own, other = published[prefix + joint], published[driving]
                    rates.setdefault(own.name, {})[other.name] = own.sign * rate * other.sign
    if not np.isfinite(list(values.values())).all():
        keys = ' and '.join(f'{machine.name}.{name}.start' for name in starts)
        actual = ', '.join(f'{value:g}' for value in starts.values())
        raise SceneError(f'{keys} must be where {machine.name} can be assembled, not at {actual}')
    return {published[name].name: published[name].of(value)
            for name, value in values.items()}, rates


def _slots(machine: SceneMechanism, bodies: Sequence[Body], positions: Dict[str, float]
           ) -> Iterator[Body]:
    """Yield the bodies in slots of yokes, which have no joint in the tree."""
    at: Dict[str, np.ndarray] = {}
    for body in bodies:
        own = pose(*replace(
            body, position=positions[body.joint.name] if body.joint else 0.0).start)
        at[body.name] = at[body.parent] @ own if at else np.eye(4)
    points = {point.name: (at[body.name] @ (*point.place, 0.0, 1.0), point)
              for body in bodies for point in body.points}
    for prefix in machine.assembly().legs:
        for link, pin in machine.linkage.yokes.items():
            name = f'{machine.name}_{prefix}{link}'
            place, point = points[f'{machine.name}_{prefix}{pin}']
            x, y = np.linalg.solve(at[f'{name}_link'], place)[:2].tolist()
            joint = Joint(f'{name}_slot', 'prismatic', (1.0, 0.0, 0.0))
            met = Point(f'{name}_pin', (0.0, 0.0), point.name, point.radius)
            yield Body(f'{name}_slot_link', f'{name}_link', (x, y, 0.0, 0.0, 0.0, 0.5 * math.pi),
                       joint, [], [met])


def weight(pieces: Sequence[Piece], density: float) -> Weight:
    """Return the common weight of one or more pieces of a density [kg/m^3]."""
    solids = np.array([_solid(piece) for piece in pieces])
    masses = density * solids[:, 0]
    mass = float(masses.sum())
    x, y = masses @ [piece.pose[:2] for piece in pieces] / mass
    moments = np.zeros(4)
    for own, (along, across), piece in zip(masses, masses[:, None] * solids[:, 1:], pieces):
        u, v, *_, angle = piece.pose
        u, v, c, s = u - x, v - y, math.cos(angle), math.sin(angle)
        moments += (along * c * c + across * s * s + own * v * v,
                    along * s * s + across * c * c + own * u * u,
                    across + own * (u * u + v * v), (along - across) * c * s - own * u * v)
    return Weight(mass, (float(x), float(y)), moments.tolist())


def _solid(piece: Piece) -> Tuple[float, float, float]:
    """Return the volume [m^3], and the squares of radii of gyration about and across it [m^2]."""
    thick, long = piece.thickness ** 2, piece.length ** 2 / 12.0
    return {ROD: (math.pi * thick * piece.length, 0.5 * thick, 0.25 * thick + long),
            BOX: (thick * piece.length, thick / 6.0, thick / 12.0 + long),
            BALL: (4.0 / 3.0 * math.pi * piece.thickness ** 3, 0.4 * thick, 0.4 * thick)
            }[piece.shape]
