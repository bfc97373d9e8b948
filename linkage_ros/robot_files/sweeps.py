# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Sweeps of inputs: the limits of their joints, within the reach."""

from __future__ import annotations

import math
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from .. import scene
from ..linkage import ROUNDING, short
from ..robot_model.robot import Limits
from ..scene import FARTHEST

# Why no motion is within limits.
EMPTY, UNREACHED = 'they leave no range', 'its loops do not reach them'


class Source(NamedTuple):
    """An input: ratio * position + offset of its source."""

    name: str
    source: str
    ratio: float
    offset: float
    value: float


def added(given: Dict[str, Any], name: str, drives: Sequence[Source], limits: Dict[str, Limits],
          inputs: Mapping[str, scene.InputSettings]) -> List[str]:
    """
    Add the sweeps of inputs to the parameters of a mechanism; report on limits that are none.

    Limits within which nothing moves are removed.
    """
    reports = []
    for drive in drives:
        if drive.source in limits:
            sweep, why = _sweep(drive, limits[drive.source], inputs[drive.name])
            if sweep:
                start = f'{name}.{drive.name}.start'
                given[f'{name}.{drive.name}.sweep'] = [*sweep]
                given[start] = min(max(given[start], sweep[0]), sweep[1])
            else:
                reports.append('Left out: the limits of '
                               f'{limits[drive.source].text(drive.source)}: {why}.')
            if why in (UNREACHED, EMPTY):
                del limits[drive.source]
    return reports


def _sweep(drive: Source, limits: Limits, read: scene.InputSettings
           ) -> Tuple[Optional[Tuple[float, float]], str]:
    """Return the limits of an input within its reach, or None and why it has no such ends."""
    if limits.low >= limits.high:
        return None, EMPTY
    low, high = (float(short(end, 1e-15)) if abs(end) < FARTHEST else math.copysign(math.inf, end)
                 for end in sorted(drive.ratio * end + drive.offset for end in limits[:2]))
    for start, end in () if read.input.is_whole(read.reach) else read.reach:
        turns = math.tau * math.floor((drive.value - start) / math.tau) * read.input.turns
        if start + turns <= drive.value <= end + turns:
            # An end that is a dead point is not quite reached.
            edge = ROUNDING * (end - start)
            low, high = max(low, start + turns + edge), min(high, end + turns - edge)
    if not low + 1e-6 * read.input.size < high:
        return None, UNREACHED
    return (None, 'its reach has no end there') if math.isinf(high - low) else ((low, high), '')
