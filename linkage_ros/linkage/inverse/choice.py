# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The choice of one solution of an inverse, or none: next to given inputs, inside given ends."""

from __future__ import annotations

import math
from typing import Any, List, Optional, Sequence

import numpy as np

from .problem import Found, InverseProblem
from ..tolerances import CLOSE, SINGULAR, TOLERANCE

# For each input its two ends, () if it has none.
Limits = Sequence[Sequence[float]]


def choose(problem: InverseProblem, solutions: Sequence[Found], seed: Optional[Sequence[float]],
           limits: Limits) -> Found:
    """
    Return the chosen one of some solutions, NaN if there is none.

    It is the nearest to the inputs `seed`, whole turns included. Without `seed` it is, of one
    input, the least at which the output increases, else the least; of several, the one with the
    least first input. An input beyond an end by rounding of the outputs is at the end.
    """
    best, sizes, n, limited = None, problem.sizes, problem.n, any(limits)
    chosen: Found = (math.nan,) * n, (math.nan,) * (n * n)
    for inputs, rates in solutions:
        places = inputs if seed is None else problem.nearest_equivalent(inputs, seed)
        if limited:
            places = tuple([_inside(problem, by, place, rates, ends, seed is None) if ends
                            else place for by, (place, ends) in enumerate(zip(places, limits))])
            if not math.isfinite(sum(places)):
                continue
        order = [rates[0] < 0.0 and n == 1, *[x / size for x, size in zip(inputs, sizes)]] \
            if seed is None else [math.hypot(*[
                (x - y) / size for x, y, size in zip(places, seed, sizes)])]
        if best is None or _before(order, best):
            best, chosen = order, (places, rates)
    return chosen


def _before(order: Sequence[float], other: Sequence[float]) -> bool:
    """Return whether numbers precede others in lexicographic order; rounding is a tie."""
    for x, y in zip(order, other):
        if abs(x - y) > CLOSE:
            return x < y
    return False


def _inside(problem: InverseProblem, by: int, place: float, rates: Sequence[float],
            ends: Sequence[float], first: bool) -> float:
    """Return an input between two ends, after whole turns if needed; NaN if there is none."""
    (lower, upper), turn = ends, problem.turns[by]
    slack = _slack(problem, by, [abs(rate) for rate in rates], lower, upper)
    low, high = lower - slack, upper + slack
    if turn < math.inf and (first or not low <= place <= high):
        place += turn * (math.ceil((low - place) / turn) if first or place < low else
                         math.floor((high - place) / turn))
    return min(max(place, lower), upper) if low <= place <= high else math.nan


def _slack(problem: InverseProblem, by: int, speeds: Sequence[Any], low: Any, high: Any) -> Any:
    """Return how far rounding of the outputs moves an input; rates may be NaN."""
    n, size = problem.n, problem.sizes[by]
    # Next to an extreme, half of all digits.
    far: Any = SINGULAR * size
    for speed, scale in zip(speeds[n * by:n * by + n], problem.scales):
        # The distance from which on the output changes by more than its rounding.
        moved = TOLERANCE * math.pi * scale / (speed + 1e-300)
        far = np.fmin(far, moved) if isinstance(moved, np.ndarray) else min(far, moved)
    return far + TOLERANCE * (4.0 * size + abs(low) + abs(high))


def choose_arrays(problem: InverseProblem, solutions: np.ndarray,
                  seed: Optional[Sequence[np.ndarray]], limits: Limits) -> np.ndarray:
    """Return what `choose` does for columns of solutions (solutions, inputs and rates, m)."""
    n, solutions = problem.n, solutions.copy()
    places, inputs, rates = solutions[:, :n], solutions[:, :n].copy(), solutions[:, n:]
    for by, (x, turn, ends) in enumerate(zip(places.swapaxes(0, 1), problem.turns, limits)):
        if seed is not None and turn < math.inf:
            x += turn * np.rint((seed[by] - x) / turn)
        if ends:
            slack = _slack(problem, by, np.abs(rates).swapaxes(0, 1), *ends)
            low, high = ends[0] - slack, ends[1] + slack
            if turn < math.inf:
                up, down = np.ceil((low - x) / turn), np.floor((high - x) / turn)
                x += turn * np.where((x < low) | (seed is None), up, np.where(x > high, down, 0.0))
            x[:] = np.where((low <= x) & (x <= high), np.clip(x, ends[0], ends[1]), math.nan)
    sizes = np.reshape(problem.sizes, (n, 1))
    if seed is None:
        orders: List[np.ndarray] = [*inputs.swapaxes(0, 1) / sizes[..., None]]
        if n == 1:
            orders.insert(0, np.where(rates[:, 0] < 0.0, 1.0, 0.0))
    else:
        orders = [np.sqrt((((places - np.stack(seed)) / sizes) ** 2).sum(axis=1))]
    best = np.zeros(inputs.shape[2], int)
    column, valid = np.arange(inputs.shape[2]), np.isfinite(places).all(axis=1)
    for k in range(1, len(inputs)):
        before, tied = np.zeros(len(column), bool), np.ones(len(column), bool)
        for order in orders:
            gap = order[k] - order[best, column]
            before |= tied & (gap < -CLOSE)
            tied &= np.abs(gap) <= CLOSE
        best = np.where(valid[k] & (before | ~valid[best, column]), k, best)
    return np.where(valid[best, column], solutions[best, :, column].T, math.nan)
