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

from typing import Sequence
from xml.etree import ElementTree

from .bodies import add, COLOURS, Model
from .pieces import Piece, weight
from .robot import Body, Robot, SLIDE
from .. import palette


def write(model: Model) -> str:
    """Return a robot model, its loops closed, as SDF."""
    # Gazebo Classic reads versions up to 1.7, which have no mimic.
    root = ElementTree.Element('sdf', version='1.11' if any(
        part.robot.follows for part in model.parts) else '1.7')
    robot = add(root, 'model', name=model.name)
    homes = {point.name: point.body for part in model.parts for point in part.robot.points}
    for part in model.parts:
        for body in part.bodies():
            is_top = body.parent == model.root
            _add_link(robot, body.name, body.pose, '__model__' if is_top else body.parent,
                      part.robot.solid(body.name), model.density)
            _add_joint(robot, body, 'world' if is_top else body.parent, part.robot)
        for point in part.robot.points:
            frame = add(robot, 'frame', name=point.name, attached_to=point.body)
            add(frame, 'pose', *point.place, *[0.0] * 4)
    cuts = [point for part in model.parts for point in part.robot.points if point.meets]
    for point in cuts:
        _add_link(robot, f'{point.name}_pin', (*point.place, *[0.0] * 4), point.body,
                  [point.ball()], model.density)
        axis = _joint(robot, f'{point.name}_hinge', 'revolute', point.body, f'{point.name}_pin')
        add(add(axis, 'axis'), 'xyz', 0.0, 0.0, 1.0)
    for point in cuts:
        ends = homes[point.meets], f'{point.name}_pin'
        _joint(robot, f'{point.name}_closed', 'fixed', *ends)
        _add_plugin(robot, 'detachable-joint', 'DetachableJoint', parent_link=ends[0],
                    child_model='__model__', child_link=ends[1])
    _add_plugin(robot, 'joint-state-publisher', 'JointStatePublisher')
    for name in (name for part in model.parts for name in part.robot.driven):
        _add_plugin(robot, 'joint-position-controller', 'JointPositionController',
                    joint_name=name, use_velocity_commands='true')
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding='unicode')


def _add_plugin(robot: ElementTree.Element, file: str, name: str, **values: str) -> None:
    plugin = add(robot, 'plugin', filename=f'gz-sim-{file}-system',
                 name=f'gz::sim::systems::{name}')
    for tag, text in values.items():
        add(plugin, tag, text)


def _joint(robot: ElementTree.Element, name: str, kind: str, parent: str, child: str
           ) -> ElementTree.Element:
    """Add a joint at the child's frame."""
    element = add(robot, 'joint', name=name, type=kind)
    add(element, 'parent', parent)
    add(element, 'child', child)
    return element


def _add_joint(robot: ElementTree.Element, body: Body, parent: str, whole: Robot) -> None:
    """Add the joint of a body, a fixed one where there is none; its positions begin at 0."""
    if not (joint := body.joint):
        _joint(robot, f'{body.name}_fixed', 'fixed', parent, body.name)
        return
    kind = 'prismatic' if joint.kind == SLIDE else 'revolute'
    axis = add(_joint(robot, joint.name, kind, parent, body.name), 'axis')
    add(axis, 'xyz', *body.axis)
    if joint.name in whole.follows:
        other, ratio, offset = whole.follows[joint.name]
        positions = whole.positions
        mimic = add(axis, 'mimic', joint=other)
        offset += ratio * positions[other] - positions[joint.name]
        for tag, value in ('multiplier', ratio), ('offset', offset), ('reference', 0.0):
            add(mimic, tag, value)
    if joint.limits:
        limit = add(axis, 'limit')
        for tag, end in zip(('lower', 'upper'), joint.limits):
            add(limit, tag, end - joint.start)


def _add_link(robot: ElementTree.Element, name: str, place: Sequence[float], parent: str,
              solid: Sequence[Piece], density: float) -> None:
    link = add(robot, 'link', name=name)
    add(link, 'pose', *place, relative_to=parent)
    mass, centre, moments = weight(solid, density)
    inertial = add(link, 'inertial')
    add(inertial, 'pose', *centre, *[0.0] * 4)
    add(inertial, 'mass', mass)
    inertia = add(inertial, 'inertia')
    for tag, moment in zip(('ixx', 'iyy', 'izz', 'ixy'), moments):
        add(inertia, tag, moment)
    for i, piece in enumerate(solid):
        _add_visual(link, f'{name}_{i}', piece)


def _add_visual(link: ElementTree.Element, name: str, piece: Piece) -> None:
    visual = add(link, 'visual', name=name)
    add(visual, 'pose', *piece.pose)
    shape = add(add(visual, 'geometry'), piece.shape)
    for tag, values in piece.sizes.items():
        add(shape, tag, *values)
    material = add(visual, 'material')
    for tag in 'ambient', 'diffuse':
        add(material, tag, *palette.rgb(COLOURS[piece.colour]), 1.0)
