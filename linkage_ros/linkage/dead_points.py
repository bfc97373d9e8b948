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
Dead points: the values of an input at which a closure is zero or nearly zero.

A closure vanishes where a linkage stretches or folds. It is the margin of a limit, or the area of
a kite or parallelogram.
"""

from __future__ import annotations

from typing import Callable, Iterator, NamedTuple, Tuple

import numpy as np

from .curves import refined, sampled
from .inputs import Arc, Input
from .planar import TOLERANCE

# Outputs change quickly where a closure is below this fraction of its size.
NEAR = 1e-2
# A closure whose size is below this multiple of its rounding is zero everywhere.
FLAT = 256.0

Places = Tuple[np.ndarray, ...]


class NearZero(NamedTuple):
    """A value of an input, how near a closure comes to zero there, its rounding and its size."""

    value: float
    gap: float
    rounding: float
    size: float


def near_zeros(curve: Callable, arc: Arc, input_: Input, rounding: np.ndarray,
               folds: np.ndarray) -> Iterator[NearZero]:
    """
    Yield the values on an arc at which closures come near to zero.

    Parameters
    ----------
    curve : callable
        From values of the input, shape (n,), to each closure and its rate, shape (2 closures, n).
    arc : (float, float)
        The range of the input, in units of its size.
    input_ : Input
        The input.
    rounding : float array (closures,)
        The rounding of each closure.
    folds : bool array (closures,)
        Whether a closure changes sign at a zero; the others end the reach there, or turn back.

    """
    def split(value: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        rows = curve(value)
        return rows[0::2], rows[1::2]

    theta = sampled(*arc)
    values, rates = split(theta)
    size = np.fmax.reduce(np.abs(values), axis=1, initial=0.0)
    # A closure as small as its rounding counts as zero. One that is never larger, such as the area
    # of a kite that is always flat, is ignored.
    rounding = np.where(size > FLAT * rounding, rounding + TOLERANCE ** 2 * size, -np.inf)
    for end in (0, -1):
        if input_.is_cut(theta[end]):
            yield from map(NearZero, [float(theta[end])] * len(size),
                           np.abs(values[:, end]).tolist(), rounding.tolist(), size.tolist())
    # A sample may be the zero itself, with a rate of either sign.
    inner, before, after = np.abs(values[:, 1:-1]), np.abs(values[:, :-2]), np.abs(values[:, 2:])
    row, place = np.nonzero((inner <= rounding[:, None]) & (inner < before) & (inner <= after))
    yield from map(NearZero, theta[place + 1].tolist(), inner[row, place].tolist(),
                   rounding[row].tolist(), size[row].tolist())
    searched = ((_crossings(values, folds), values),
                (_approaches(theta, values, rates, NEAR * size[:, None]), rates))
    for kind, ((row, place), samples) in enumerate(searched):
        chosen = np.arange(len(row))

        def unchanged(angles: np.ndarray, kind: int = kind, row: np.ndarray = row,
                      chosen: np.ndarray = chosen,
                      start: np.ndarray = samples[row, place] >= 0.0) -> np.ndarray:
            now = split(angles.ravel())[kind].reshape(-1, *angles.shape)[row, chosen]
            return (now >= 0.0) == start[:, None]

        found, _ = refined(unchanged, theta[place], theta[place + 1])
        # A fold that changes sign vanishes between two neighbouring values.
        gaps = np.abs(split(found)[0][row, chosen]) if kind else np.zeros(len(row))
        relevant = rounding[row] > 0.0
        yield from map(NearZero, found[relevant].tolist(), gaps[relevant].tolist(),
                       rounding[row][relevant].tolist(), size[row][relevant].tolist())


def _crossings(values: np.ndarray, folds: np.ndarray) -> Places:
    """Return row and column of the samples after which one of the folds changes sign."""
    above = values >= 0.0
    return np.nonzero((above[:, 1:] != above[:, :-1]) & folds[:, None]
                      & np.isfinite(values[:, 1:]) & np.isfinite(values[:, :-1]))


def _approaches(theta: np.ndarray, values: np.ndarray, rates: np.ndarray,
                near: np.ndarray) -> Places:
    """Return row and column of the samples after which a closure turns back close to zero."""
    sign = np.sign(values[:, :-1])
    with np.errstate(all='ignore'):
        before, after = sign * rates[:, :-1], sign * rates[:, 1:]
        # The tangents at two samples meet below the lowest point of a smooth curve between them.
        ahead = (sign * (values[:, 1:] - values[:, :-1]) - after * np.diff(theta)) / (
            before - after)
        bound = sign * values[:, :-1] + before * ahead
        return np.nonzero((before < 0.0) & (after >= 0.0) & ~(bound > near))
