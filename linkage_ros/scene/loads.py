# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Loads on a mechanism: forces at joints, moments on links."""

from __future__ import annotations

import re
from typing import Iterable

from .parameters import read_lines, SceneError
from ..linkage import Mechanism

# A moment [N m], or a force [N]: x, y and, in a spatial linkage, z.
Load = float | tuple[float, ...]

_FIGURE = r'[+-]?(?:\d{1,99}\.?\d{0,99}|\.\d{1,99})(?:[eE][+-]?\d\d?)?'
_LINE = re.compile(rf'(\w+)=({_FIGURE}(?: +{_FIGURE}){{0,2}})', re.ASCII)


def read_loads(mechanism: str, linkage: Mechanism, lines: Iterable[str]) -> dict[str, Load]:
    """Return forces by joint and moments by link; raise SceneError if a line is neither."""
    loads: dict[str, Load] = {}
    for name, match in read_lines(
            f'{mechanism}.loads', lines, _LINE, (*linkage.points, *linkage.joints),
            "'C=0 -9.81', a force [N] at a joint, or 'EF=2.5', a moment [N m] on a link").items():
        first, *others = map(float, match[2].split())
        count = len(linkage.axes) if name in linkage.points else 1
        if len(others) + 1 != count:
            parts = ('the components ' + ', '.join(linkage.axes) if count > 1 else 'one number')
            raise SceneError(f'{mechanism}.loads: the load of {name} must have {parts}, not '
                             f'{match[0]!r}')
        loads[name] = (first, *others) if others else first
    return loads
