# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""
Outputs over the first input: extremes, dead points, monotone branches.

They are computed from the linkage's closures and outputs with their exact rates.
"""

from __future__ import annotations

import math
from typing import Callable, List, Optional, Sequence, TYPE_CHECKING

import numpy as np

from .curves import extremes
from .dead_points import NEAR, near_zeros, NearZero
from .inputs import Arc
from .monotone import distinct, MonotoneBranches
from .planar import TOLERANCE

if TYPE_CHECKING:
    from .mechanism import Mechanism

# Dead points nearer to an end of the reach than this [rad] are that end.
ONE = 1e-9


class Analysis:
    """Motion of a linkage with its first input; the other inputs are fixed."""

    def __init__(self, linkage: Mechanism, others: Sequence[float] = ()):
        self._linkage, self._others = linkage, tuple(others)
        self._first = linkage.inputs[0]

    def extremes(self, output: str, arcs: Optional[Sequence[Arc]] = None) -> list:
        """Implement `Mechanism.extremes`."""
        linkage = self._linkage
        linkage.check_output(output)
        pose, angular = linkage.bound('output', output), np.array([linkage.is_angle(output)])
        size = self._first.step
        parts = linkage.reach(*self._others) if arcs is None else arcs
        if arcs is None and (branches := self.branches(output)).jumps:
            parts = [(low * size, high * size) for low, high in branches.arcs]
        found = [extremes(lambda value: pose.searched(value, *self._others)[:1], low, high,
                          angular)[0].tolist() for low, high in parts]
        return [(tuple(least), tuple(greatest)) for least, greatest in found]

    # From here on the first input is in units of its step.

    def dead_points(self) -> List[float]:
        """Return the values of the input at which a dyad stretches or folds."""
        first = self._first.counted()
        # Where a reach may only be cut off, a dead point is found as a touch.
        ends = [end for arc in self._reach() for end in arc if not first.is_cut(end)]
        touched = [near.value for near in self._near_zeros()
                   if near.gap <= near.rounding
                   and all(first.apart(near.value, end) > ONE for end in ends)]
        return distinct([*ends, *touched], first)

    def branches(self, output: str) -> MonotoneBranches:
        """Return the branches on which an output is monotone."""
        return self._linkage.cache.get_or_make(
            ('branches', output, *self._others), lambda: self._branches(output))

    def _branches(self, output: str) -> MonotoneBranches:
        angular = self._linkage.is_angle(output)
        marks = distinct((near.value for near in self._near_zeros()
                          if near.gap <= NEAR * near.size), self._first.counted())
        return MonotoneBranches(self._curve('output', output), self._reach(), marks, angular,
                                TOLERANCE * (math.pi if angular else 2.0 * self._linkage.longest))

    def _reach(self) -> List[Arc]:
        """Return the reach in arcs, none of them on both sides of an end of a turn."""
        size = self._first.step
        return [part for lo, hi in self._linkage.reach(*self._others)
                for part in self._first.counted().within(lo / size, hi / size)]

    def _curve(self, kind: str, name: object) -> Callable:
        """Return the function from the first input to numbers, and each one's rate by it."""
        pose, size, others = self._linkage.bound(kind, name), self._first.step, self._others

        def curve(value: np.ndarray) -> np.ndarray:
            rows = pose.searched(value * size, *others)
            rows[1::2] *= size
            return rows
        return curve

    def _near_zeros(self) -> List[NearZero]:
        """Return the inputs at which a dyad stretches or folds, or nearly does."""
        structure = self._linkage.structure
        closures, folds = structure.closures, structure.built.folds

        def find() -> List[NearZero]:
            reach = self._reach() if closures else []
            rounding = np.array([2.0 * float(self._linkage.value(x.tolerance)) for x in closures])
            return [near for arc in reach for near in near_zeros(
                self._curve('closures', ()), arc, self._first.counted(), rounding,
                np.array([x in folds for x in closures]))]

        return self._linkage.cache.get_or_make(('near zeros', *self._others), find)
