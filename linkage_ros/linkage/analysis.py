# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The motion of the first input: its reach and dead points, and outputs with exact rates."""

from __future__ import annotations

from typing import Callable, Iterable, List, Optional, Sequence

import numpy as np

from .curves import LEAST
from .dead_points import near_zeros, NearZero
from .input_range import reach_of
from .inputs import Arc, Input
from .kinematics import Kinematics

# Dead points nearer to an end of the reach than this [rad] are that end.
ONE = 1e-9
# Inputs no farther apart than this [rad] are one.
SAME = 1e-13


def distinct(values: Iterable[float], input_: Input) -> List[float]:
    """Return values of an input in order, wrapped, one of those that differ by rounding."""
    found: List[float] = []
    for x in sorted(float(input_.wrapped(0.0 if abs(x) < LEAST else x)) for x in values):
        if not found or x - found[-1] > SAME:
            found.append(x)
    if input_.wraps and len(found) > 1 and found[0] + input_.turn - found[-1] <= SAME:
        found.pop()
    return found


class Analysis:
    """
    Motion of a linkage with its first input; the other inputs are fixed.

    `first` is the first input over a part of its period, by default over all of it.
    """

    def __init__(self, linkage: Kinematics, others: Sequence[float] = (),
                 first: Optional[Input] = None):
        self._linkage, self._others = linkage, tuple(others)
        self._first = first or linkage.inputs[0]

    # From here on the first input is in units of its step.

    def dead_points(self) -> List[float]:
        """Return the values of the input at which a dyad stretches or folds."""
        first = self._first.counted()
        # Where a reach may only be cut off, a dead point is found as a touch.
        ends = [end for arc in self.reach() for end in arc if not first.is_cut(end)]
        touched = [near.value for near in self.near_zeros()
                   if near.gap <= near.rounding
                   and all(first.apart(near.value, end) > ONE for end in ends)]
        return distinct([*ends, *touched], first)

    def reach(self) -> List[Arc]:
        """Return the reach in arcs, none of them on both sides of an end of a turn."""
        size, first = self._first.step, self._first.counted()
        arcs = [(lo / size, hi / size) for lo, hi in reach_of(self._linkage, self._others)]
        if self._first.turn < self._linkage.inputs[0].turn:
            arcs = [(max(lo, first.low), min(hi, first.high)) for lo, hi in arcs
                    if lo < first.high and hi > first.low]
        return [part for arc in arcs for part in first.within(*arc)]

    def curve(self, kind: str, name: object) -> Callable:
        """Return the function from the first input to numbers, and each one's rate by it."""
        pose, size, others = self._linkage.bound(kind, name), self._first.step, self._others

        def curve(value: np.ndarray) -> np.ndarray:
            rows = pose.searched(value * size, *others)
            rows[1::2] *= size
            return rows
        return curve

    def near_zeros(self) -> List[NearZero]:
        """Return the inputs at which a dyad stretches or folds, or nearly does."""
        structure = self._linkage.structure
        closures, folds = structure.closures, structure.built.folds

        def find() -> List[NearZero]:
            reach = self.reach() if closures else []
            rounding = np.array([2.0 * float(self._linkage.value(x.tolerance)) for x in closures])
            return [near for arc in reach for near in near_zeros(
                self.curve('closures', ()), arc, self._first.counted(), rounding,
                np.array([x in folds for x in closures]))]

        return self._linkage.cache.get_or_make(
            ('near zeros', self._first.period, *self._others), find)
