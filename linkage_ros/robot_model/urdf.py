# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Robot models as URDF: the tree, for programs that move it by the positions of its joints.

Points are links of their own, fixed to their bodies. There are no inertias: a model moved by
positions needs none. Effort and velocity of limits are 0, which means unknown.

Format: the URDF XML specification of ROS (wiki.ros.org/urdf/XML).
"""

from __future__ import annotations

from typing import Iterable
from xml.etree.ElementTree import Element, indent, tostring

import numpy as np

from . import bodies
from .bodies import add, COLOURS
from .robot import HINGE, Robot, with_positions
from ..scene import SceneMechanism

# The end of a joint that has none [rad or m].
FAR = 1e3


def describe(mechanisms: Iterable[SceneMechanism], frame_id: str) -> str:
    """Return mechanisms as one URDF; see `bodies.robot`."""
    return write(bodies.robot(mechanisms, frame_id))


def write(robot: Robot) -> str:
    """Return a robot as URDF, which has it with all joints at zero."""
    robot = with_positions(robot, dict.fromkeys(robot.positions, 0.0))
    root = Element('robot', name=robot.name)
    for colour, rgba in COLOURS.items():
        add(add(root, 'material', name=colour), 'color', rgba=rgba)
    add(root, 'link', name=robot.root)
    for body in robot.bodies():
        joint = add(root, 'joint', name=f'{body.name}_fixed', type='fixed')
        add(joint, 'parent', link=body.parent)
        add(joint, 'child', link=body.name)
        add(joint, 'origin', xyz=body.pose[:3], rpy=body.pose[3:])
        if moving := body.joint:
            turns, limits = moving.kind == HINGE, moving.limits
            joint.set('name', moving.name)
            joint.set('type', 'prismatic' if not turns else 'revolute' if limits else 'continuous')
            add(joint, 'axis', xyz=body.axis)
            if limits or not turns:
                lower, upper = np.nan_to_num(moving.range, posinf=FAR, neginf=-FAR)
                add(joint, 'limit', lower=lower, upper=upper, effort='0', velocity='0')
        link = add(root, 'link', name=body.name)
        for piece in robot.pieces.get(body.name, ()):
            visual = add(link, 'visual')
            add(visual, 'origin', xyz=piece.pose[:3], rpy=piece.pose[3:])
            add(add(visual, 'geometry'), piece.shape, **piece.sizes)
            add(visual, 'material', name=piece.colour)
    indent(root)
    return tostring(root, encoding='unicode')
