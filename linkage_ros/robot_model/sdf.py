# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Robot models as SDF, for Gazebo: bodies as in the URDF, each loop closed by a fixed joint.

Where a loop was cut, a pin turns on the body that was cut off and is fixed to the other one, so
it has two parents. For engines of Gazebo that read only trees, DetachableJoint adds the second.
Positions of joints are relative to the starts of the inputs, Gazebo's zeros.

Format: the SDFormat specification (sdformat.org/spec).
"""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Element, indent, tostring

import numpy as np

from .bodies import add, COLOURS
from .robot import Body, HINGE, Joint, Robot, SLIDE
from .shapes import weight


def write(robot: Robot) -> str:
    """Return a robot, its loops closed, as SDF."""
    # Gazebo Classic reads versions up to 1.7, which have no mimic.
    root = Element('sdf', version='1.11' if robot.follows else '1.7')
    made, parents = add(root, 'model', name=robot.name), {}
    for body in robot.bodies():
        parents[body.name] = body.parent
        if body.name in robot.meets:
            hinge = Joint(f'{body.name}_hinge', HINGE, (body.parent, body.name), (), ())
            body = body._replace(joint=hinge, axis=(0.0, 0.0, 1.0))
        _add_body(made, robot, body)
    for cut, met in robot.meets.items():
        _add_joint(made, f'{cut}_closed', 'fixed', parents[met], cut)
        _add_plugin(made, 'detachable-joint', 'DetachableJoint', parent_link=parents[met],
                    child_model='__model__', child_link=cut)
    _add_plugin(made, 'joint-state-publisher', 'JointStatePublisher')
    for name in robot.driven:
        _add_plugin(made, 'joint-position-controller', 'JointPositionController',
                    joint_name=name, use_velocity_commands='true')
    indent(root)
    return tostring(root, encoding='unicode')


def _fill(element: Element, **texts: Any) -> Element:
    """Add elements with these texts to another one, and return that."""
    for tag, text in texts.items():
        add(element, tag, text)
    return element


def _add_plugin(made: Element, file: str, name: str, **values: str) -> None:
    _fill(add(made, 'plugin', filename=f'gz-sim-{file}-system',
              name=f'gz::sim::systems::{name}'), **values)


def _add_joint(made: Element, name: str, kind: str, parent: str, child: str) -> Element:
    return _fill(add(made, 'joint', name=name, type=kind), parent=parent, child=child)


def _add_body(made: Element, robot: Robot, body: Body) -> None:
    """Add a body and its joint, whose positions begin at 0."""
    base, parent = (('__model__', 'world') if body.parent == robot.root else
                    (body.parent, body.parent))
    link = add(made, 'link', name=body.name)
    add(link, 'pose', body.pose, relative_to=base)
    if pieces := robot.pieces.get(body.name, ()):
        mass, centre, moments = weight(pieces, robot.density)
        inertial = _fill(add(link, 'inertial'), pose=(*centre, 0.0, 0.0, 0.0, 0.0), mass=mass)
        _fill(add(inertial, 'inertia'), **dict(zip(('ixx', 'iyy', 'izz', 'ixy'), moments)))
    for i, piece in enumerate(pieces):
        visual = _fill(add(link, 'visual', name=f'{body.name}_{i}'), pose=piece.pose)
        _fill(add(add(visual, 'geometry'), piece.shape), **piece.sizes)
        colour = COLOURS[piece.colour]
        _fill(add(visual, 'material'), ambient=colour, diffuse=colour)
    if not (joint := body.joint):
        _add_joint(made, f'{body.name}_fixed', 'fixed', parent, body.name)
        return
    kind = 'prismatic' if joint.kind == SLIDE else 'revolute'
    made_joint = _add_joint(made, joint.name, kind, parent, body.name)
    axis = _fill(add(made_joint, 'axis'), xyz=body.axis)
    if joint.name in robot.follows:
        other, ratio, offset = robot.changes(joint.name)
        _fill(add(axis, 'mimic', joint=other), multiplier=ratio, offset=offset, reference=0.0)
    if joint.limits:
        lower, upper = np.subtract(joint.limits, joint.start)
        _fill(add(axis, 'limit'), lower=lower, upper=upper)
