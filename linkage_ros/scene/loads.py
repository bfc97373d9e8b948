# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Loads on a mechanism: forces at joints, moments on links."""

from __future__ import annotations

import re
from typing import Dict, Iterable, Tuple, Union

from .parameters import SceneError
from ..linkage import Mechanism
from ..words import elided, listed, meant

# A moment [N m], or a force [N]: x, y and, in a spatial linkage, z.
Load = Union[float, Tuple[float, ...]]

_FIGURE = r'[+-]?(?:\d{1,99}\.?\d{0,99}|\.\d{1,99})(?:[eE][+-]?\d\d?)?'
_LINE = re.compile(rf'(\w+)=({_FIGURE})(?: +({_FIGURE}))?(?: +({_FIGURE}))?', re.ASCII)


def read_loads(mechanism: str, linkage: Mechanism, lines: Iterable[str]) -> Dict[str, Load]:
    """Return forces by joint and moments by link; raise SceneError if a line is neither."""
    loads: Dict[str, Load] = {}
    names = (*linkage.points, *linkage.joints)
    for line in lines:
        match = _LINE.fullmatch(line)
        if not match or match[1] in loads or match[1] not in (
                linkage.points if match[3] else linkage.joints):
            raise SceneError(
                f"{mechanism}.loads must be texts such as 'C=0 -9.81', a force [N] at a joint, or "
                f"'EF=2.5', a moment [N m] on a link, each for a different one of "
                f'{listed(names, 90)}, not {elided(line)!r}'
                f'{meant(match and match[1], {*names} - {*loads})}')
        first, *others = (float(figure) for figure in match.groups()[1:] if figure)
        if others and len(others) + 1 != len(linkage.axes):
            raise SceneError(f'{mechanism}.loads: a force must have the components '
                             f'{", ".join(linkage.axes)}, not {elided(line)!r}')
        loads[match[1]] = (first, *others) if others else first
    return loads
