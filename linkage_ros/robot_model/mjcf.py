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
from xml.etree.ElementTree import Element, indent, tostring

from .bodies import add, COLOURS
from .robot import Body, HINGE, Robot
from .shapes import BALL, BOX, CYLINDER

# Time step [s] for a linkage of a metre; smaller linkages oscillate faster.
STEP = 1e-3
# A servo yields by this [rad, or of its arm] to the weight of all bodies, and bears so much of it.
YIELD, STRENGTH = 1e-3, 10.0
# [m/s^2]
GRAVITY = 9.81


def write(robot: Robot) -> str:
    """Return a robot, its loops closed, as MJCF."""
    step = STEP * math.sqrt(min([1.0, *(arm for _, arm in robot.servos.values())]))
    root = Element('mujoco', model=robot.name)
    add(root, 'compiler', angle='radian', eulerseq='XYZ')
    add(root, 'option', timestep=step, integrator='implicitfast')
    usual = add(root, 'default')
    add(usual, 'geom', contype='0', conaffinity='0', density=robot.density)
    add(usual, 'equality', solref=(2.0 * step, 1.0), solimp='0.9999 0.9999 1')
    elements = {robot.root: add(root, 'worldbody')}
    equality, servos = add(root, 'equality'), add(root, 'actuator')
    bodies = {body.name: body for body in robot.bodies()}
    for body in bodies.values():
        elements[body.name] = _add_body(elements[body.parent], body, robot)
    for cut, met in robot.meets.items():
        add(equality, 'connect', name=cut, body1=bodies[met].parent, body2=bodies[cut].parent,
            anchor=bodies[met].pose[:3])
    for name in robot.follows:
        other, ratio, offset = robot.changes(name)
        add(equality, 'joint', joint1=name, joint2=other, polycoef=(offset, ratio, 0, 0, 0))
    motors = [joint for name in robot.driven for joint in robot.joints if joint.name == name]
    for joint in motors:
        # A servo is stiff against weight, but too weak to break a loop.
        mass, arm = robot.servos[joint.name]
        turns = joint.kind == HINGE
        force, path = mass * GRAVITY * (arm if turns else 1.0), YIELD * (1.0 if turns else arm)
        add(servos, 'position', name=joint.name, joint=joint.name, dampratio='1', kp=force / path,
            forcerange=(-STRENGTH * force, STRENGTH * force), ctrlrange=joint.limits)
    add(add(root, 'keyframe'), 'key', name='start', ctrl=[joint.start for joint in motors])
    indent(root)
    return tostring(root, encoding='unicode')


def _add_body(parent: Element, body: Body, robot: Robot) -> Element:
    made = add(parent, 'body', name=body.name, pos=body.pose[:3], euler=body.pose[3:])
    if joint := body.joint:
        add(made, 'joint', name=joint.name, type=joint.kind, axis=body.axis, ref=joint.start,
            range=joint.limits)
    for piece in robot.pieces.get(body.name, ()):
        half, thickness = 0.5 * piece.length, piece.thickness
        sizes = {CYLINDER: (thickness, half), BOX: (half, 0.5 * thickness, 0.5 * thickness),
                 BALL: (thickness,)}[piece.shape]
        add(made, 'geom', type=piece.shape, pos=piece.pose[:3], euler=piece.pose[3:], size=sizes,
            rgba=COLOURS[piece.colour])
    return made
