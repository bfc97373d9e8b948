# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Published names of joints, with a robot's signs and zero offsets."""

from __future__ import annotations

import json
import math
import re
from typing import Any, Dict, Iterable, Mapping, NamedTuple, Optional, Tuple

import numpy as np

from .parameters import SceneError
from ..words import elided, listed, meant

# A sign and a digit after a name begin an offset; a hyphen before a letter belongs to the name.
_PLAIN = r'[A-Za-z_][\w./:]*(?:-[A-Za-z_][\w./:]*)*'
# Other names are quoted as in JSON.
_LINE = re.compile(rf'(\w+)=(-?)({_PLAIN}|"(?:[^"\\]|\\.)+")'
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

    def travel(self, ends: Tuple[float, float]) -> Optional[Tuple[float, float]]:
        """Return limits of the published value from those of the position; None if it wraps."""
        low, high = sorted(self._replace(wraps=False).of(end) for end in ends)
        if not self.wraps:
            return low, high
        turns = math.tau * round(0.5 * (low + high) / math.tau)
        low, high = low - turns, high - turns
        return (low, high) if -math.pi < low and high <= math.pi else None


def read_joint_names(mechanism: str, joints: Mapping[str, bool], lines: Iterable[str],
                     only_named: bool) -> Dict[str, JointName]:
    """
    Return the published names of all joints, by joint.

    `joints` tells for each joint whether it is an angle, which wraps if it has an offset. `lines`
    are those of the parameter joint_names. `only_named` leaves the other joints unpublished.
    Raises SceneError if a line is malformed, or its joint is unknown or has another line.
    """
    default = {joint: JointName(f'{mechanism}_{joint}', published=not only_named)
               for joint in joints}
    listed_names: Dict[str, JointName] = {}
    for line in lines:
        match = _LINE.fullmatch(line)
        name = _unquoted(match[3]) if match else ''
        if not match or not name or match[1] not in default or match[1] in listed_names:
            raise SceneError(
                f"{mechanism}.joint_names must be texts such as 'BC=left_shin' or "
                f"'EF=-\"ankle-2\"+0.35', each for a different one of {listed(joints, 90)}, not "
                f'{elided(line)!r}{meant(match and match[1], {*joints} - {*listed_names})}')
        offset = float(match[4] or 0.0)
        listed_names[match[1]] = JointName(
            name, -1.0 if match[2] else 1.0, offset, wraps=joints[match[1]] and offset != 0.0)
    return {**default, **listed_names}


def quoted_name(name: str) -> str:
    """Return a published name as it is written in joint_names: quoted if it must be."""
    plain = re.fullmatch(_PLAIN, name, re.ASCII)
    return name if plain else json.dumps(name, ensure_ascii=False)


def _unquoted(text: str) -> str:
    try:
        return str(json.loads(text)) if text[0] == '"' else text
    except ValueError:
        return ''


def check_distinct(names: Mapping[str, Mapping[str, JointName]]) -> None:
    """Raise SceneError if two joints of the scene are published by one name."""
    owners: Dict[str, str] = {}
    for mechanism, joints in names.items():
        for joint, name in joints.items():
            full_name = f'{mechanism}.{joint}'
            other = owners.setdefault(name.name, full_name) if name.published else full_name
            if other != full_name:
                raise SceneError(f'{mechanism}.joint_names must give each joint of the scene a '
                                 f'name of its own: {other} and {full_name} are both {name.name}')
