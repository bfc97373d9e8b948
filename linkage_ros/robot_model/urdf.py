# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Robot models as URDF: the tree, for what moves it by the positions of its joints.

Points are links of their own, fixed to their bodies. There are no inertias, which nothing needs
that is moved by positions. Limits have effort and velocity 0: not known.

Format: the URDF XML specification of ROS (wiki.ros.org/urdf/XML).
"""

from __future__ import annotations

from typing import Iterable, Sequence
from xml.etree import ElementTree

from . import bodies
from .bodies import Body, COLOURS, numbers, Piece, Robot
from .. import palette
from ..scene import Machine


def describe(machines: Iterable[Machine], frame_id: str) -> str:
    """Return mechanisms as one URDF; see `bodies.robot`."""
    return write(bodies.robot(machines, frame_id))


def write(robot: Robot) -> str:
    """Return a robot model as URDF."""
    root = ElementTree.Element('robot', name=robot.name)
    for colour, code in COLOURS.items():
        material = ElementTree.SubElement(root, 'material', name=colour)
        ElementTree.SubElement(material, 'color', rgba=numbers(*palette.rgb(code), 1.0))
    ElementTree.SubElement(root, 'link', name=robot.root)
    for body in robot.bodies:
        _join(root, body)
        _add_link(root, body.name, body.pieces)
        for point in body.points:
            _join(root, Body(point.name, body.name, (*point.place, 0.0, 0.0, 0.0, 0.0)))
            _add_link(root, point.name, [point.ball()])
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding='unicode')


def _join(root: ElementTree.Element, body: Body) -> None:
    """Add the joint that a body hangs on."""
    joint = body.joint
    name, kind = (joint.name, joint.kind) if joint else (f'{body.name}_fixed', 'fixed')
    if joint and kind == 'revolute' and not joint.travel:
        kind = 'continuous'
    element = ElementTree.SubElement(root, 'joint', name=name, type=kind)
    ElementTree.SubElement(element, 'parent', link=body.parent)
    ElementTree.SubElement(element, 'child', link=body.name)
    _place(element, body.pose)
    if joint:
        ElementTree.SubElement(element, 'axis', xyz=numbers(*joint.axis))
    if joint and joint.travel:
        lower, upper = map(numbers, joint.travel)
        ElementTree.SubElement(element, 'limit', lower=lower, upper=upper, effort='0',
                               velocity='0')


def _add_link(root: ElementTree.Element, name: str, pieces: Iterable[Piece]) -> None:
    """Add a link, and what is seen of it."""
    link = ElementTree.SubElement(root, 'link', name=name)
    for piece in pieces:
        visual = ElementTree.SubElement(link, 'visual')
        _place(visual, piece.pose)
        ElementTree.SubElement(ElementTree.SubElement(visual, 'geometry'), piece.shape, {
            key: numbers(*values) for key, values in piece.sizes.items()})
        ElementTree.SubElement(visual, 'material', name=piece.colour)


def _place(element: ElementTree.Element, pose: Sequence[float]) -> None:
    if any(pose):
        ElementTree.SubElement(element, 'origin', xyz=numbers(*pose[:3]), rpy=numbers(*pose[3:]))
