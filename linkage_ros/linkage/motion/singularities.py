# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Motion of the first input: its dead points, and outputs with exact rates.

Dead points are the values at which a closure is zero, nearby ones those at which it is nearly
zero. A closure vanishes where a linkage stretches or folds. It is the margin of a limit, or the
area of a kite or parallelogram.
"""

from __future__ import annotations

from typing import Callable, Iterator, NamedTuple, Sequence

import numpy as np

from .curves import refined, sampled
from .reach import over_first, reach_of
from ..inputs import Arc, Input
from ..kinematics import Kinematics
from ..tolerances import CLOSE, TOLERANCE

# Outputs change quickly where a closure is below this fraction of its size.
NEAR = 1e-2
# A closure whose size is below this multiple of its rounding is zero everywhere.
FLAT = 256.0

Places = tuple[np.ndarray, ...]


class NearZero(NamedTuple):
    """A value of an input, how near a closure comes to zero there, its rounding and its size."""

    value: float
    distance: float
    rounding: float
    size: float


def _crossings(values: np.ndarray, folds: np.ndarray) -> Places:
    """Return row and column of the samples after which one of the folds changes sign."""
    above = values >= 0.0
    return np.nonzero((above[:, 1:] != above[:, :-1]) & folds[:, None]
                      & np.isfinite(values[:, 1:]) & np.isfinite(values[:, :-1]))


def _approaches(theta: np.ndarray, values: np.ndarray, rates: np.ndarray,
                limit: np.ndarray) -> Places:
    """Return row and column of the samples after which a closure turns back close to zero."""
    sign = np.sign(values[:, :-1])
    with np.errstate(all='ignore'):
        before, after = sign * rates[:, :-1], sign * rates[:, 1:]
        # The tangents at two samples meet below the lowest point of a smooth curve between them.
        ahead = (sign * (values[:, 1:] - values[:, :-1]) - after * np.diff(theta)) / (
            before - after)
        lowest = sign * values[:, :-1] + before * ahead
        return np.nonzero((before < 0.0) & (after >= 0.0) & ~(lowest > limit))


class Analysis:
    """
    Motion of a linkage with its first input; the other inputs are fixed.

    `first` is the first input over a part of its period, by default over all of it.
    """

    def __init__(self, linkage: Kinematics, others: Sequence[float] = (),
                 first: Input | None = None):
        self._linkage, self._others = linkage, tuple(others)
        self._first = first or linkage.inputs[0]

    # From here on the first input is in units of its step.

    def dead_points(self) -> list[float]:
        """Return the values of the input at which a dyad stretches or folds."""
        first = self._first.normalized()
        # Where a reach may only be cut off, a dead point is found as a touch.
        ends = [end for arc in self.reach() for end in arc if not first.is_cut(end)]
        touched = [zero.value for zero in self.near_zeros()
                   if zero.distance <= zero.rounding
                   and all(first.distance(zero.value, end) > CLOSE for end in ends)]
        return first.distinct([*ends, *touched])

    def reach(self) -> list[Arc]:
        """Return the reach in arcs, none of them on both sides of an end of a turn."""
        size, first = self._first.step, self._first.normalized()
        arcs = [(lo / size, hi / size) for lo, hi in reach_of(self._linkage, self._others)]
        if self._first.turn < self._linkage.inputs[0].turn:
            arcs = [(max(lo, first.low), min(hi, first.high)) for lo, hi in arcs
                    if lo < first.high and hi > first.low]
        return [part for arc in arcs for part in first.within(*arc)]

    def curve(self, kind: str, name: object) -> Callable:
        """Return the function from the first input to numbers, and each one's rate by it."""
        over, size = over_first(self._linkage, kind, name, self._others), self._first.step

        def curve(value: np.ndarray) -> np.ndarray:
            rows = over(value)
            rows[1::2] *= size
            return rows
        return curve

    def near_zeros(self) -> list[NearZero]:
        """Return the inputs at which a dyad stretches or folds, or nearly does."""
        return self._linkage.cache.get_or_make(
            ('near zeros', self._first.period, *self._others), lambda: [
                zero for arc in (self.reach() if self._linkage.formulas.closures else ())
                for zero in self._near_zeros(*arc)])

    def _near_zeros(self, lo: float, hi: float) -> Iterator[NearZero]:
        """Yield the values on an arc at which closures come near to zero."""
        formulas, curve = self._linkage.formulas, self.curve('closures', ())
        # Those that change sign at a zero; the others end the reach there, or turn back.
        folds = np.array([x in formulas.built.folds for x in formulas.closures])
        rounding = np.array([
            2.0 * float(self._linkage.value(x.tolerance)) for x in formulas.closures])
        theta = sampled(lo, hi)
        values, rates = np.reshape(curve(theta), (len(folds), 2, -1)).swapaxes(0, 1)
        size = np.fmax.reduce(np.abs(values), axis=1, initial=0.0)
        # A closure as small as its rounding counts as zero. One that is never larger, such as the
        # area of a kite that is always flat, never does.
        rounding, size = np.where(
            size > FLAT * rounding, (rounding + TOLERANCE ** 2 * size, size), -1.0)

        def near_zeros(row: np.ndarray, *zeros: np.ndarray) -> Iterator[NearZero]:
            return map(NearZero, *(x.tolist() for x in (*zeros, rounding[row], size[row])))

        # A sample may be the zero itself, with a rate of either sign.
        distances = np.pad(np.abs(values), ((0, 0), (1, 1)), constant_values=np.inf)
        before, inner, after = distances[:, :-2], distances[:, 1:-1], distances[:, 2:]
        row, place = np.nonzero(
            (inner <= rounding[:, None]) & (inner < before) & (inner <= after))
        yield from near_zeros(row, theta[place], inner[row, place])
        searched = ((_crossings(values, folds), values),
                    (_approaches(theta, values, rates, NEAR * size[:, None]), rates))
        for kind, ((row, place), samples) in enumerate(searched):
            chosen = np.arange(len(row))

            def unchanged(angles: np.ndarray, kind: int = kind, row: np.ndarray = row,
                          chosen: np.ndarray = chosen,
                          start: np.ndarray = samples[row, place] >= 0.0) -> np.ndarray:
                now = curve(angles.ravel())[kind::2].reshape(-1, *angles.shape)[row, chosen]
                return (now >= 0.0) == start[:, None]

            zeros, _ = refined(unchanged, theta[place], theta[place + 1])
            # A fold that changes sign vanishes between two neighbouring values.
            yield from near_zeros(row, zeros, np.abs(curve(zeros)[0::2][row, chosen]) if kind
                                  else np.zeros(len(row)))
