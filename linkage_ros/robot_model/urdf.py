# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Robot models as URDF: the tree, for programs that move it by the positions of its joints.

Points are links of their own, fixed to their bodies. There are no inertias: a model moved by
positions needs none. Effort and velocity of limits are 0, which means unknown.

Format: the URDF XML specification of ROS (wiki.ros.org/urdf/XML).
"""

from __future__ import annotations

import math
from typing import Dict, Iterable, List, Sequence
from weakref import WeakKeyDictionary

from . import bodies
from .bodies import COLOURS, Model, numbers, Part
from .pieces import Piece, Point
from .robot import Body, HINGE
from .. import palette
from ..scene import SceneMechanism

# The end of a joint that has none [rad or m].
FAR = 1e3
# xml.sax.saxutils would bring urllib: a tenth of a node's start and memory.
_ESCAPES = str.maketrans({'&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;', '\n': '&#10;',
                          '\r': '&#13;', '\t': '&#9;'})
# When a scene is written again, most of its mechanisms are unchanged.
_written: WeakKeyDictionary[Part, str] = WeakKeyDictionary()


def describe(machines: Iterable[SceneMechanism], frame_id: str) -> str:
    """Return mechanisms as one URDF; see `bodies.robot`."""
    return write(bodies.robot(machines, frame_id))


def write(robot: Model) -> str:
    """Return a robot model as URDF."""
    materials = [f"""\
  <material name="{colour}">
    <color rgba="{numbers(*palette.rgb(code), 1.0)}" />
  </material>
""" for colour, code in COLOURS.items()]
    return ''.join([f'<robot name="{_escaped(robot.name)}">\n', *materials, _link(robot.root),
                    *map(_part, robot.parts), '</robot>'])


def _escaped(text: str) -> str:
    return text.translate(_ESCAPES)


def _part(part: Part) -> str:
    if part not in _written:
        robot, texts = part.robot, []
        points: Dict[str, List[Point]] = {body: [] for body in robot.frames}
        for point in robot.points:
            points[point.body].append(point)
        for body in part.bodies():
            texts += [_joint(body), _link(body.name, robot.pieces.get(body.name, ()))]
            for point in points.get(body.name, ()):
                texts += [_joint(Body(point.name, body.name, (*point.place, *[0.0] * 4))),
                          _link(point.name, [point.ball()])]
        _written[part] = ''.join(texts)
    return _written[part]


def _joint(body: Body) -> str:
    """Return the joint that a body hangs on; a hinge without limits is continuous."""
    name, kind, limits = f'{body.name}_fixed', 'fixed', None
    if joint := body.joint:
        turns, limits = joint.kind == HINGE, joint.limits
        limits = limits if turns else joint.range
        name, kind = joint.name, 'prismatic' if not turns else (
            'revolute' if limits else 'continuous')
    text = f"""\
  <joint name="{_escaped(name)}" type="{kind}">
    <parent link="{_escaped(body.parent)}" />
    <child link="{_escaped(body.name)}" />
{_origin('    ', body.pose)}"""
    if body.joint:
        text += f'    <axis xyz="{numbers(*body.axis)}" />\n'
    if limits:
        lower, upper = (numbers(end if math.isfinite(end) else math.copysign(FAR, end))
                        for end in limits)
        text += f'    <limit lower="{lower}" upper="{upper}" effort="0" velocity="0" />\n'
    return text + '  </joint>\n'


def _link(name: str, pieces: Iterable[Piece] = ()) -> str:
    """Return a link, and what is seen of it."""
    name = _escaped(name)
    seen = ''.join([f"""\
    <visual>
{_origin('      ', piece.pose)}\
      <geometry>
        <{piece.shape} {' '.join(
            f'{key}="{numbers(*values)}"' for key, values in piece.sizes.items())} />
      </geometry>
      <material name="{piece.colour}" />
    </visual>
""" for piece in pieces])
    return f'  <link name="{name}">\n{seen}  </link>\n' if seen else f'  <link name="{name}" />\n'


def _origin(indent: str, pose: Sequence[float]) -> str:
    if not any(pose):
        return ''
    return f'{indent}<origin xyz="{numbers(*pose[:3])}" rpy="{numbers(*pose[3:])}" />\n'
