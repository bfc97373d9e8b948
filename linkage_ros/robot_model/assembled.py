# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Robot models for simulators: closed loops, initial pose, masses, gears and motors.

All inputs are at their starts, so that every loop is closed at the beginning of a simulation.
"""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Dict, Tuple

import numpy as np

from .bodies import Model, size
from .pieces import Point, weight
from .robot import posed, Robot, SLIDE
from ..scene import SceneError, SceneMechanism
from ..scene.motion import Motion

# Density of aluminium [kg/m^3].
DENSITY = 2700.0


def assembled(model: Model, density: float = DENSITY) -> Model:
    """Return a robot model at the start of its inputs; raise SceneError if there is no pose."""
    homes = {point.name: point for part in model.parts for point in part.robot.points}
    made = replace(model, parts=[], density=density)
    for part in model.parts:
        base, place = part.base, part.pose
        if base in homes:
            (x, y), (u, v, *turned) = homes[base].place, place
            base, place = homes[base].body, (u + x, v + y, *turned)
        made.parts.append(replace(part, base=base, pose=place, robot=_started(
            part.robot, part.machine, density) if part.machine else part.robot))
    return made


def _started(robot: Robot, machine: SceneMechanism, density: float) -> Robot:
    """Return the robot of a mechanism at the start of its inputs, with motors and gears."""
    starts = {name: Motion.of(drive).at(0)[0] for name, drive in machine.inputs.items()}
    positions, rates = _solved(machine, starts)
    robot = posed(replace(robot, points=[*robot.points], driven=[], servos={}, follows={}), {
        name: value for name, value in positions.items() if name in robot.positions})
    _add_slots(machine, robot)
    tips = {link.name: link.tip for link in machine.linkage.links}
    mass = sum(weight(robot.solid(body), density).mass for body in [*robot.frames][1:])
    sweeps = {}
    for name, drive in machine.inputs.items():
        joint = machine.joints[name]
        arm = math.hypot(*machine.linkage.frames[name][tips[name]])
        if drive.sweep:
            low, high = sorted(map(joint.of, drive.sweep))
            sweeps[joint.name] = low, high
        robot.driven.append(joint.name)
        robot.servos[joint.name] = mass, machine.scale * arm if arm else size(machine)
    robot.joints = [replace(joint, limits=sweeps.get(joint.name)) for joint in robot.joints]
    for name, each in rates.items():
        other, ratio = max(each.items(), key=lambda item: abs(item[1]))
        robot.follow(name, other, ratio, positions[name] - ratio * positions[other])
    return robot


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


def _add_slots(machine: SceneMechanism, robot: Robot) -> None:
    """Add the bodies in slots of yokes, which have no joint in the tree."""
    points = {point.name: point for point in robot.points}
    for prefix in machine.assembly().legs:
        for link, pin in machine.linkage.yokes.items():
            name, point = (f'{machine.name}_{prefix}{end}' for end in (link, pin))
            place = robot.frames[points[point].body] @ (*points[point].place, 0.0, 1.0)
            x, y = np.linalg.solve(robot.frames[f'{name}_link'], place)[:2].tolist()
            robot.hang(f'{name}_slot_link', f'{name}_link', (x, y, 0.0, 0.0, 0.0, 0.5 * math.pi),
                       SLIDE, (1.0, 0.0, 0.0), None, f'{name}_slot')
            robot.points.append(Point(f'{name}_pin', f'{name}_slot_link', (0.0, 0.0), point,
                                      points[point].radius))
