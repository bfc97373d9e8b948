# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Robot models as SDF, for Gazebo: bodies as in the URDF, each loop closed by a fixed joint.

Where a loop was cut, a pin turns on the body that was cut off and is fixed to the other one, so
it has two parents. For engines of Gazebo that read only trees, DetachableJoint adds the second.
Positions of joints are relative to the starts of the inputs, Gazebo's zeros.

Format: the SDFormat specification (sdformat.org/spec).
"""

from __future__ import annotations

from typing import Optional
from xml.etree import ElementTree

from .assembled import Assembled, Gear, Motor, Solid, weight
from .bodies import COLOURS, Joint, numbers, Piece
from .. import palette


def write(model: Assembled) -> str:
    """Return a robot model, its loops closed, as SDF."""
    # Gazebo Classic reads versions up to 1.7, which have no mimic.
    root = ElementTree.Element('sdf', version='1.11' if model.gears else '1.7')
    robot = ElementTree.SubElement(root, 'model', name=model.name)
    gears = {gear.joint: gear for gear in model.gears}
    motors = {motor.joint: motor for motor in model.motors}
    homes = {point.name: solid.name for solid in model.solids for point in solid.points}
    for solid in model.solids:
        _add_link(robot, solid)
        name = solid.joint.name if solid.joint else f'{solid.name}_fixed'
        joint = _add_joint(robot, name, solid.joint, solid.parent or 'world', solid.name)
        if solid.joint:
            _add_ends(joint, gears.get(name), motors.get(name), solid.position)
        for point in solid.points:
            frame = ElementTree.SubElement(robot, 'frame', name=point.name,
                                           attached_to=solid.name)
            _text(frame, 'pose', numbers(*point.place, *[0.0] * 4))
    cuts = [(solid, point) for solid in model.solids for point in solid.points if point.meets]
    for solid, point in cuts:
        pin = Solid(f'{point.name}_pin', solid.name, (*point.place, *[0.0] * 4),
                    Joint(f'{point.name}_hinge', 'revolute', 1.0, None), 0.0,
                    [point.ball()], [], weight([point.ball()], model.density))
        _add_link(robot, pin)
        _add_joint(robot, f'{point.name}_hinge', pin.joint, solid.name, pin.name)
    for _, point in cuts:
        ends = homes[point.meets], f'{point.name}_pin'
        _add_joint(robot, f'{point.name}_closed', None, *ends)
        _add_plugin(robot, 'detachable-joint', 'DetachableJoint', parent_link=ends[0],
                    child_model='__model__', child_link=ends[1])
    _add_plugin(robot, 'joint-state-publisher', 'JointStatePublisher')
    for motor in model.motors:
        _add_plugin(robot, 'joint-position-controller', 'JointPositionController',
                    joint_name=motor.joint, use_velocity_commands='true')
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding='unicode')


def _text(parent: ElementTree.Element, tag: str, text: str) -> None:
    ElementTree.SubElement(parent, tag).text = text


def _add_plugin(robot: ElementTree.Element, file: str, name: str, **values: str) -> None:
    plugin = ElementTree.SubElement(robot, 'plugin', filename=f'gz-sim-{file}-system',
                                    name=f'gz::sim::systems::{name}')
    for tag, text in values.items():
        _text(plugin, tag, text)


def _add_joint(robot: ElementTree.Element, name: str, joint: Optional[Joint], parent: str,
               child: str) -> ElementTree.Element:
    """Add a joint, a fixed one where there is none, at the child's frame."""
    element = ElementTree.SubElement(robot, 'joint', name=name,
                                     type=joint.kind if joint else 'fixed')
    _text(element, 'parent', parent)
    _text(element, 'child', child)
    if joint:
        _text(ElementTree.SubElement(element, 'axis'), 'xyz', numbers(*joint.axis))
    return element


def _add_ends(joint: ElementTree.Element, gear: Optional[Gear], motor: Optional[Motor],
              start: float) -> None:
    """Add the gear of a joint, or the limits of its motor."""
    axis, = joint.iter('axis')
    if gear:
        mimic = ElementTree.SubElement(axis, 'mimic', joint=gear.input)
        for tag, value in ('multiplier', gear.ratio), ('offset', 0.0), ('reference', 0.0):
            _text(mimic, tag, numbers(value))
    if motor and motor.sweep:
        limit = ElementTree.SubElement(axis, 'limit')
        for tag, end in zip(('lower', 'upper'), motor.sweep):
            _text(limit, tag, numbers(end - start))


def _add_link(robot: ElementTree.Element, solid: Solid) -> None:
    link = ElementTree.SubElement(robot, 'link', name=solid.name)
    pose = ElementTree.SubElement(link, 'pose', relative_to=solid.parent or '__model__')
    pose.text = numbers(*solid.pose)
    mass, centre, moments = solid.weight
    if mass:
        inertial = ElementTree.SubElement(link, 'inertial')
        _text(inertial, 'pose', numbers(*centre, *[0.0] * 4))
        _text(inertial, 'mass', numbers(mass))
        inertia = ElementTree.SubElement(inertial, 'inertia')
        for tag, moment in zip(('ixx', 'iyy', 'izz', 'ixy'), moments):
            _text(inertia, tag, numbers(moment))
    for i, piece in enumerate(solid.pieces):
        _add_visual(link, f'{solid.name}_{i}', piece)


def _add_visual(link: ElementTree.Element, name: str, piece: Piece) -> None:
    visual = ElementTree.SubElement(link, 'visual', name=name)
    _text(visual, 'pose', numbers(*piece.pose))
    geometry = ElementTree.SubElement(ElementTree.SubElement(visual, 'geometry'), piece.shape)
    for tag, values in piece.sizes.items():
        _text(geometry, tag, numbers(*values))
    material = ElementTree.SubElement(visual, 'material')
    for tag in 'ambient', 'diffuse':
        _text(material, tag, numbers(*palette.rgb(COLOURS[piece.colour]), 1.0))
