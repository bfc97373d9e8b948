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

from typing import Optional, Tuple
from xml.etree import ElementTree

from .assembled import weight
from .bodies import add, Body, COLOURS, Joint, Motor, Piece, Robot
from .. import palette


def write(model: Robot) -> str:
    """Return a robot model, its loops closed, as SDF."""
    # Gazebo Classic reads versions up to 1.7, which have no mimic.
    root = ElementTree.Element('sdf', version='1.11' if model.gears else '1.7')
    robot = add(root, 'model', name=model.name)
    motors = {motor.joint: motor for motor in model.motors}
    homes = {point.name: body.name for body in model.bodies for point in body.points}
    for body in model.bodies:
        is_top = body.parent == model.root
        _add_link(robot, body, '__model__' if is_top else body.parent, model.density)
        name = body.joint.name if body.joint else f'{body.name}_fixed'
        joint = _add_joint(robot, name, body.joint, 'world' if is_top else body.parent, body.name)
        if body.joint:
            _add_ends(joint, model.gears.get(name), motors.get(name), body.position)
        for point in body.points:
            frame = add(robot, 'frame', name=point.name, attached_to=body.name)
            add(frame, 'pose', *point.place, *[0.0] * 4)
    cuts = [(body, point) for body in model.bodies for point in body.points if point.meets]
    for body, point in cuts:
        hinge = Joint(f'{point.name}_hinge', 'revolute', (0.0, 0.0, 1.0))
        pin = Body(f'{point.name}_pin', body.name, (*point.place, *[0.0] * 4), hinge,
                   [point.ball()])
        _add_link(robot, pin, body.name, model.density)
        _add_joint(robot, hinge.name, hinge, body.name, pin.name)
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


def _add_ends(joint: ElementTree.Element, gear: Optional[Tuple[str, float]],
              motor: Optional[Motor], start: float) -> None:
    """Add the gear of a joint, or the limits of its motor."""
    axis, = joint.iter('axis')
    if gear:
        mimic = add(axis, 'mimic', joint=gear[0])
        for tag, value in ('multiplier', gear[1]), ('offset', 0.0), ('reference', 0.0):
            add(mimic, tag, value)
    if motor and motor.sweep:
        limit = add(axis, 'limit')
        for tag, end in zip(('lower', 'upper'), motor.sweep):
            add(limit, tag, end - start)


def _add_link(robot: ElementTree.Element, body: Body, parent: str, density: float) -> None:
    link = add(robot, 'link', name=body.name)
    add(link, 'pose', *body.start, relative_to=parent)
    mass, centre, moments = weight(body.solid, density)
    inertial = add(link, 'inertial')
    add(inertial, 'pose', *centre, *[0.0] * 4)
    add(inertial, 'mass', mass)
    inertia = add(inertial, 'inertia')
    for tag, moment in zip(('ixx', 'iyy', 'izz', 'ixy'), moments):
        add(inertia, tag, moment)
    for i, piece in enumerate(body.solid):
        _add_visual(link, f'{body.name}_{i}', piece)


def _add_visual(link: ElementTree.Element, name: str, piece: Piece) -> None:
    visual = add(link, 'visual', name=name)
    add(visual, 'pose', *piece.pose)
    shape = add(add(visual, 'geometry'), piece.shape)
    for tag, values in piece.sizes.items():
        add(shape, tag, *values)
    material = add(visual, 'material')
    for tag in 'ambient', 'diffuse':
        add(material, tag, *palette.rgb(COLOURS[piece.colour]), 1.0)
