# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Robot models as MJCF, for MuJoCo: bodies as in the URDF, each loop closed by `connect`.

Positions of joints equal the published ones. A servo holds each input; the keyframe `start` has
closed loops.

Format: MuJoCo's XML reference (mujoco.readthedocs.io).
"""

from __future__ import annotations

import math
from typing import Optional, Tuple
from xml.etree import ElementTree

import numpy as np

from .bodies import add, COLOURS, Model, numbers
from .pieces import BALL, BOX, Piece, ROD, weight
from .robot import Body, HINGE, Joint, Robot
from .. import palette
from ..scene import SceneError

# Time steps [s] for a linkage of a metre; smaller linkages oscillate faster.
STEP, LARGE = 1e-3, 1.0
# A servo yields by a thousandth [rad, or of the longest bar] to the weight of all bodies.
STIFFNESS = 1000.0
GRAVITY = 9.81
# The end of a joint that has none [rad or m].
FAR = 1e9
# The smallest moment of inertia [kg m^2] that MuJoCo accepts.
LEAST = 1e-14


def write(model: Model) -> str:
    """Return a robot model, its loops closed, as MJCF."""
    root = ElementTree.Element('mujoco', model=model.name)
    add(root, 'compiler', angle='radian', eulerseq='XYZ')
    robots = [part.robot for part in model.parts]
    small = min([LARGE, *(arm for robot in robots for _, arm in robot.servos.values())])
    step = STEP * math.sqrt(small / LARGE)
    add(root, 'option', timestep=numbers(step), integrator='implicitfast')
    usual = add(root, 'default')
    add(usual, 'geom', contype='0', conaffinity='0')
    add(usual, 'equality', solref=numbers(2.0 * step, 1.0), solimp='0.9999 0.9999 1')
    elements = {model.root: add(root, 'worldbody')}
    moving = set()
    for part in model.parts:
        for body in part.bodies():
            element = elements[body.name] = _add_body(elements[body.parent], body, part.robot)
            if body.joint or body.parent in moving:
                moving.add(body.name)
                _add_weight(element, body.name, part.robot, model.density)
    equality, actuator = add(root, 'equality'), add(root, 'actuator')
    starts = []
    for robot in robots:
        positions, joints = robot.positions, {joint.name: joint for joint in robot.joints}
        for point in robot.points:
            if point.meets:
                add(equality, 'connect', name=point.name, site1=point.meets, site2=point.name)
        for name, (other, ratio, offset) in robot.follows.items():
            offset += ratio * positions[other] - positions[name]
            add(equality, 'joint', joint1=name, joint2=other,
                polycoef=numbers(offset, ratio, 0.0, 0.0, 0.0))
        for name in robot.driven:
            _add_motor(actuator, joints[name], robot.servos.get(name))
            starts.append(positions[name])
    add(add(root, 'keyframe'), 'key', name='start', ctrl=numbers(*starts))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding='unicode')


def _add_body(parent: ElementTree.Element, body: Body, robot: Robot) -> ElementTree.Element:
    made = add(parent, 'body', name=body.name, pos=numbers(*body.pose[:3]),
               euler=numbers(*body.pose[3:]))
    if joint := body.joint:
        moved = add(made, 'joint', name=joint.name, type=joint.kind, axis=numbers(*body.axis),
                    ref=numbers(joint.start))
        if joint.limits:
            moved.set('range', numbers(*np.clip(joint.limits, -FAR, FAR)))
    for piece in robot.solid(body.name):
        _add_piece(made, piece)
    for point in robot.points:
        if point.body == body.name:
            add(made, 'site', name=point.name, pos=numbers(*point.place, 0.0), group='4')
    return made


def _add_weight(element: ElementTree.Element, body: str, robot: Robot, density: float) -> None:
    mass, centre, (xx, yy, zz, xy) = weight(robot.solid(body), density)
    if np.linalg.eigvalsh([[xx, xy], [xy, yy]])[0] < LEAST:
        raise SceneError(f'{body} is too light for MuJoCo: give a larger scale, --width or '
                         '--density')
    add(element, 'inertial', pos=numbers(*centre, 0.0), mass=numbers(mass),
        fullinertia=numbers(xx, yy, zz, xy, 0.0, 0.0))


def _add_piece(body: ElementTree.Element, piece: Piece) -> None:
    half, thickness = 0.5 * piece.length, piece.thickness
    sizes = {ROD: (thickness, half), BOX: (half, 0.5 * thickness, 0.5 * thickness),
             BALL: (thickness,)}[piece.shape]
    add(body, 'geom', type=piece.shape, pos=numbers(*piece.pose[:3]),
        euler=numbers(*piece.pose[3:]), size=numbers(*sizes),
        rgba=numbers(*palette.rgb(COLOURS[piece.colour]), 1.0))


def _add_motor(actuator: ElementTree.Element, joint: Joint, servo: Optional[Tuple[float, float]]
               ) -> None:
    """Add a servo that is stiff against weight, but too weak to break a loop; else a motor."""
    if not servo:
        add(actuator, 'motor', name=joint.name, joint=joint.name)
        return
    mass, arm = servo
    force, turns = mass * GRAVITY, joint.kind == HINGE
    most = 10.0 * force * (arm if turns else 1.0)
    stiffness = STIFFNESS * force * (arm if turns else 1.0 / arm)
    made = add(actuator, 'position', name=joint.name, joint=joint.name, kp=numbers(stiffness),
               dampratio='1', forcerange=numbers(-most, most))
    if joint.limits:
        made.set('ctrlrange', numbers(*joint.limits))
