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

from xml.etree.ElementTree import Element, indent, tostring

from .bodies import add, COLOURS, Model
from .robot import Body, HINGE, Joint, Robot, SLIDE
from .shapes import weight


def write(model: Model) -> str:
    """Return a robot model, its loops closed, as SDF."""
    # Gazebo Classic reads versions up to 1.7, which have no mimic.
    has_mimic = any(robot.follows for robot in model.parts)
    root = Element('sdf', version='1.11' if has_mimic else '1.7')
    made = add(root, 'model', name=model.name)
    for robot in model.parts:
        parents = {}
        for body in robot.bodies():
            parents[body.name] = body.parent
            if body.name in robot.meets:
                hinge = Joint(f'{body.name}_hinge', HINGE, (body.parent, body.name), (), ())
                body = body._replace(joint=hinge, axis=(0.0, 0.0, 1.0))
            _add_body(made, model, robot, body)
        for cut, met in robot.meets.items():
            _add_joint(made, f'{cut}_closed', 'fixed', parents[met], cut)
            _add_plugin(made, 'detachable-joint', 'DetachableJoint', parent_link=parents[met],
                        child_model='__model__', child_link=cut)
    _add_plugin(made, 'joint-state-publisher', 'JointStatePublisher')
    for robot in model.parts:
        for name in robot.driven:
            _add_plugin(made, 'joint-position-controller', 'JointPositionController',
                        joint_name=name, use_velocity_commands='true')
    indent(root)
    return tostring(root, encoding='unicode')


def _add_plugin(made: Element, file: str, name: str, **values: str) -> None:
    plugin = add(made, 'plugin', filename=f'gz-sim-{file}-system',
                 name=f'gz::sim::systems::{name}')
    for tag, text in values.items():
        add(plugin, tag, text)


def _add_joint(made: Element, name: str, kind: str, parent: str, child: str) -> Element:
    joint = add(made, 'joint', name=name, type=kind)
    add(joint, 'parent', parent)
    add(joint, 'child', child)
    return joint


def _add_body(made: Element, model: Model, robot: Robot, body: Body) -> None:
    """Add a body and its joint, whose positions begin at 0."""
    base, parent = (('__model__', 'world') if body.parent == model.root else
                    (body.parent, body.parent))
    link = add(made, 'link', name=body.name)
    add(link, 'pose', *body.pose, relative_to=base)
    if pieces := robot.pieces.get(body.name):
        mass, centre, moments = weight(pieces, model.density)
        inertial = add(link, 'inertial')
        add(inertial, 'pose', *centre, *4 * (0.0,))
        add(inertial, 'mass', mass)
        inertia = add(inertial, 'inertia')
        for tag, moment in zip(('ixx', 'iyy', 'izz', 'ixy'), moments):
            add(inertia, tag, moment)
    for i, piece in enumerate(pieces or ()):
        visual = add(link, 'visual', name=f'{body.name}_{i}')
        add(visual, 'pose', *piece.pose)
        shape = add(add(visual, 'geometry'), piece.shape)
        for tag, values in piece.sizes.items():
            add(shape, tag, *values)
        material = add(visual, 'material')
        for tag in 'ambient', 'diffuse':
            add(material, tag, *COLOURS[piece.colour])
    if not (joint := body.joint):
        _add_joint(made, f'{body.name}_fixed', 'fixed', parent, body.name)
        return
    kind = 'prismatic' if joint.kind == SLIDE else 'revolute'
    axis = add(_add_joint(made, joint.name, kind, parent, body.name), 'axis')
    add(axis, 'xyz', *body.axis)
    if joint.name in robot.follows:
        other, ratio, offset = robot.changes(joint.name)
        mimic = add(axis, 'mimic', joint=other)
        for tag, value in ('multiplier', ratio), ('offset', offset), ('reference', 0.0):
            add(mimic, tag, value)
    if joint.limits:
        limit = add(axis, 'limit')
        for tag, end in zip(('lower', 'upper'), joint.limits):
            add(limit, tag, end - joint.start)
