# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Published names of joints, with a robot's signs and zero offsets."""

from __future__ import annotations

import json
import math
import re
from typing import Any, Mapping, NamedTuple

import numpy as np

from .legs import LegGroup
from .parameters import read_lines, SceneError
from ..cache import cached
from ..linkage import Mechanism

# A sign and a digit after a name begin an offset; a hyphen before a letter belongs to the name.
_PLAIN = r'[A-Za-z_][\w./:]*(?:-[A-Za-z_][\w./:]*)*'
# Other names are quoted as in JSON.
_QUOTED = r'"(?:[^"\\\x00-\x1f]|\\["\\/bfnrt]|\\u[0-9a-fA-F]{4})+"'
_LINE = re.compile(rf'(\w+)=(-?)({_PLAIN}|{_QUOTED})'
                   r'([+-](?:\d{1,99}\.?\d{0,99}|\.\d{1,99})(?:[eE][+-]?\d\d?)?)?', re.ASCII)


class JointName(NamedTuple):
    """
    Published name of a joint. Its published value is sign * position + offset [rad or m].

    `published` tells whether it is in joint states, `wraps` whether the value is wrapped to
    [-pi, pi].
    """

    name: str
    sign: float = 1.0
    offset: float = 0.0
    published: bool = True
    wraps: bool = False

    def of(self, position: Any) -> Any:
        """Return the published value of a position [rad or m], a number or an array."""
        value = self.sign * position + self.offset
        return value - math.tau * np.round(value / math.tau) if self.wraps else value

    def travel(self, ends: tuple[float, float]) -> tuple[float, float] | None:
        """Return limits of the published value from those of the position; None if it wraps."""
        low, high = sorted(self._replace(wraps=False).of(end) for end in ends)
        turns = math.tau * round(0.5 * (low + high) / math.tau) if self.wraps else 0.0
        low, high = low - turns, high - turns
        return None if self.wraps and not -math.pi < low <= high <= math.pi else (low, high)


# Many changes of a mechanism leave its names as they are.
@cached(16)
def read_joint_names(mechanism: str, linkage: Mechanism, leg_pairs: int, mirrored: bool,
                     lines: tuple[str, ...], only_named: bool) -> Mapping[str, JointName]:
    """
    Return the published names of all joints, by joint: the inputs, then the joints of each leg.

    `lines` are those of the parameter joint_names. `only_named` leaves the other joints
    unpublished. An angle wraps if it has an offset, unless it is an input. Raises SceneError if a
    line is malformed, or its joint is unknown or has another line.
    """
    assembly = LegGroup(linkage, leg_pairs, mirrored)
    is_angle = {input_.name: False for input_ in linkage.inputs}
    is_angle |= {leg + joint: linkage.is_angle(joint)
                 for leg in assembly.legs for joint in assembly.joints}
    names = {joint: JointName(f'{mechanism}_{joint}', published=not only_named)
             for joint in is_angle}
    for joint, match in read_lines(
            f'{mechanism}.joint_names', lines, _LINE, is_angle,
            "'BC=left_shin' or 'EF=-\"ankle-2\"+0.35'").items():
        _, sign, name, figure = match.groups()
        name, offset = json.loads(name) if name[0] == '"' else name, float(figure or 0.0)
        names[joint] = JointName(name, -1.0 if sign else 1.0, offset,
                                 wraps=is_angle[joint] and offset != 0.0)
    return names


def quoted_name(name: str) -> str:
    """Return a published name as it is written in joint_names: quoted if it must be."""
    return name if re.fullmatch(_PLAIN, name, re.ASCII) else json.dumps(name, ensure_ascii=False)


def check_distinct(names: Mapping[str, Mapping[str, JointName]]) -> None:
    """Raise SceneError if two joints of the scene are published by one name."""
    owners: dict[str, str] = {}
    for mechanism, joints in names.items():
        for joint, name in joints.items():
            full_name = f'{mechanism}.{joint}'
            other = owners.setdefault(name.name, full_name) if name.published else full_name
            if other != full_name:
                raise SceneError(f'{mechanism}.joint_names must give each joint of the scene a '
                                 f'name of its own: {other} and {full_name} are both {name.name}')
