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
from .bodies import add, COLOURS, Joint, Piece
from .. import palette


def write(model: Assembled) -> str:
    """Return a robot model, its loops closed, as SDF."""
    # Gazebo Classic reads versions up to 1.7, which have no mimic.
    root = ElementTree.Element('sdf', version='1.11' if model.gears else '1.7')
    robot = add(root, 'model', name=model.name)
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
            frame = add(robot, 'frame', name=point.name, attached_to=solid.name)
            add(frame, 'pose', *point.place, *[0.0] * 4)
    cuts = [(solid, point) for solid in model.solids for point in solid.points if point.meets]
    for solid, point in cuts:
        hinge = Joint(f'{point.name}_hinge', 'revolute', 1.0, None)
        pin = Solid(f'{point.name}_pin', solid.name, (*point.place, *[0.0] * 4), hinge, 0.0,
                    [point.ball()], [], weight([point.ball()], model.density))
        _add_link(robot, pin)
        _add_joint(robot, hinge.name, hinge, solid.name, pin.name)
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


def _add_plugin(robot: ElementTree.Element, file: str, name: str, **values: str) -> None:
    plugin = add(robot, 'plugin', filename=f'gz-sim-{file}-system',
                 name=f'gz::sim::systems::{name}')
    for tag, text in values.items():
        add(plugin, tag, text)


def _add_joint(robot: ElementTree.Element, name: str, joint: Optional[Joint], parent: str,
               child: str) -> ElementTree.Element:
    """Add a joint, a fixed one where there is none, at the child's frame."""
    element = add(robot, 'joint', name=name, type=joint.kind if joint else 'fixed')
    add(element, 'parent', parent)
    add(element, 'child', child)
    if joint:
        add(add(element, 'axis'), 'xyz', *joint.axis)
    return element


def _add_ends(joint: ElementTree.Element, gear: Optional[Gear], motor: Optional[Motor],
              start: float) -> None:
    """Add the gear of a joint, or the limits of its motor."""
    axis, = joint.iter('axis')
    if gear:
        mimic = add(axis, 'mimic', joint=gear.input)
        for tag, value in ('multiplier', gear.ratio), ('offset', 0.0), ('reference', 0.0):
            add(mimic, tag, value)
    if motor and motor.sweep:
        limit = add(axis, 'limit')
        for tag, end in zip(('lower', 'upper'), motor.sweep):
            add(limit, tag, end - start)


def _add_link(robot: ElementTree.Element, solid: Solid) -> None:
    link = add(robot, 'link', name=solid.name)
    add(link, 'pose', *solid.pose, relative_to=solid.parent or '__model__')
    mass, centre, moments = solid.weight
    inertial = add(link, 'inertial')
    add(inertial, 'pose', *centre, *[0.0] * 4)
    add(inertial, 'mass', mass)
    inertia = add(inertial, 'inertia')
    for tag, moment in zip(('ixx', 'iyy', 'izz', 'ixy'), moments):
        add(inertia, tag, moment)
    for i, piece in enumerate(solid.pieces):
        _add_visual(link, f'{solid.name}_{i}', piece)


def _add_visual(link: ElementTree.Element, name: str, piece: Piece) -> None:
    visual = add(link, 'visual', name=name)
    add(visual, 'pose', *piece.pose)
    shape = add(add(visual, 'geometry'), piece.shape)
    for tag, values in piece.sizes.items():
        add(shape, tag, *values)
    material = add(visual, 'material')
    for tag in 'ambient', 'diffuse':
        add(material, tag, *palette.rgb(COLOURS[piece.colour]), 1.0)
