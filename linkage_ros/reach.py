# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Which crank angles can be assembled.

The ends of the reach are the angles where a margin vanishes. For the dyad or slot of a crank they
are closed forms of exactly rounded gaps; elsewhere they are bracketed and refined to rounding.
Between two neighbouring ends one pose decides for the whole arc.
"""

from __future__ import annotations

import math
from typing import Callable, Iterable, List, Sequence, Tuple

import numpy as np

from .planar import Limit

Arc = Tuple[float, float]

# Samples on an arc in search of ends without a closed form.
SAMPLES = 720
# Arcs below this width [rad] are the rounding of one angle.
NARROWEST = 2e-15


def arcs(margins: Callable, limits: Sequence[Limit], value: Callable) -> List[Arc]:
    """
    Return the arcs (lo, hi) [rad] of the first crank on which every margin is at least zero.

    Parameters
    ----------
    margins : callable
        From crank angles, shape (n,), to margins, shape (limits, n).
    limits : sequence of Limit
        What the margins belong to.
    value : callable
        From an expression of dimensions to its value.

    """
    closed = [limit for limit in limits if limit.crank == 0]
    ends = [end for limit in closed
            for end in _crank_ends(*map(value, (
                limit.start, limit.end, limit.turn, limit.tolerance)))]
    for i in [i for i, x in enumerate(limits) if x.margin.varies and x.crank != 0]:
        for lo, hi in between(ends):
            ends += sign_changes(lambda theta, i=i: margins(theta)[i], lo, hi)
    return reachable_arcs(ends, lambda theta: bool(np.all(margins(theta) >= 0.0)))


def reachable_arcs(ends: Iterable[float], reachable: Callable[[float], bool]) -> List[Arc]:
    """Return the arcs between angles where reachability may change, joined where they touch."""
    parts = between(ends)
    held = [arc for arc in parts if reachable(0.5 * (arc[0] + arc[1]))]
    if held == parts:
        return [(-math.pi, math.pi)]
    joined: List[Arc] = []
    for lo, hi in held:
        if joined and lo - joined[-1][1] <= NARROWEST:
            joined[-1] = joined[-1][0], hi
        else:
            joined.append((lo, hi))
    if len(joined) > 1 and joined[0][0] + 2.0 * math.pi - joined[-1][1] <= NARROWEST:
        joined[-1] = joined[-1][0], joined.pop(0)[1] + 2.0 * math.pi
    return [(lo - 2.0 * math.pi, hi - 2.0 * math.pi) if lo >= math.pi else (lo, hi)
            for lo, hi in joined]


def _crank_ends(start: float, end: float, turn: float, tolerance: float) -> List[float]:
    """Return the crank angles where start h^2 + end s^2 vanishes; theta' = theta + turn."""
    # A gap of nothing but rounding is a limit that is touched, and may be all there is.
    start, end = (0.0 if abs(gap) <= tolerance else gap for gap in (start, end))
    if start * end > 0.0:
        return []
    half = math.atan2(math.sqrt(abs(start)), math.sqrt(abs(end)))
    return [float(2.0 * half - turn), float(-2.0 * half - turn)]


def between(ends: Iterable[float]) -> List[Arc]:
    """Return the arcs of one turn between angles, in order, from the least in [-pi, pi)."""
    marks: List[float] = []
    for end in sorted(end - 2.0 * math.pi * math.floor((end + math.pi) / (2.0 * math.pi))
                      for end in ends):
        if not marks or end - marks[-1] > NARROWEST:
            marks.append(end)
    if not marks:
        return [(-math.pi, math.pi)]
    return list(zip(marks, marks[1:] + [marks[0] + 2.0 * math.pi]))


def sign_changes(margin: Callable, lo: float, hi: float, samples: int = SAMPLES) -> List[float]:
    """Return the angles where a margin changes sign, or stops existing, on an arc."""
    theta = 0.5 * (lo + hi) - 0.5 * (hi - lo) * np.cos(np.linspace(0.0, math.pi, samples))
    theta[0], theta[-1] = lo, hi
    theta = np.unique(np.concatenate([theta, _turning_points(margin, theta)]))
    above = margin(theta) >= 0.0
    return [_bisected(margin, *theta[i:i + 2]) for i in np.flatnonzero(above[1:] != above[:-1])]


def _turning_points(margin: Callable, theta: np.ndarray) -> np.ndarray:
    """Return the extremes of a margin that come nearest to zero between samples."""
    value = margin(theta)
    inner, before, after = value[1:-1], value[:-2], value[2:]
    dips = (inner > 0.0) & (inner <= before) & (inner <= after)
    bumps = (inner < 0.0) & (inner >= before) & (inner >= after)
    found = np.flatnonzero(dips | bumps) + 1
    lo, hi = theta[found - 1], theta[found + 1]
    down = np.where(dips[found - 1], 1.0, -1.0)
    for _ in range(60 if len(found) else 0):
        third = (hi - lo) / 3.0
        left, right = down * margin(lo + third), down * margin(hi - third)
        lo, hi = np.where(left > right, lo + third, lo), np.where(left > right, hi, hi - third)
    return 0.5 * (lo + hi)


def _bisected(margin: Callable, lo: float, hi: float) -> float:
    """Return the last angle, to the last digit, on the side of a sign change that is >= 0."""
    within = bool(margin(lo) >= 0.0)
    while True:
        middle = 0.5 * (lo + hi)
        if not lo < middle < hi:
            return float(lo if within else hi)
        if bool(margin(middle) >= 0.0) == within:
            lo = middle
        else:
            hi = middle
