# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The choice of one solution of an inverse, or none: next to given inputs, inside given ends."""

from __future__ import annotations

import math
from typing import Any, List, Optional, Sequence, Tuple

import numpy as np

from .problem import Found, InverseProblem
from ..tolerances import CLOSE, SINGULAR, TOLERANCE

# For each input its two ends, () if it has none.
Limits = Sequence[Sequence[float]]
# Successive solutions of a path that are placed at once, from the first to the most.
FIRST, MOST = 16, 8192


def choose(problem: InverseProblem, solutions: Sequence[Found], seed: Optional[Sequence[float]],
           limits: Limits) -> Found:
    """
    Return the chosen one of some solutions, NaN if there is none.

    It is the nearest to the inputs `seed`, whole turns included. Without `seed` it is, of one
    input, the least at which the output increases, else the least; of several, the one with the
    least first input. An input beyond an end by rounding of the outputs is at the end.
    """
    return _chosen(problem, solutions, seed, limits)[1]


def _chosen(problem: InverseProblem, solutions: Sequence[Found],
            seed: Optional[Sequence[float]], limits: Limits) -> Tuple[int, Found]:
    """Return what `choose` does, and which of the solutions it is; -1 if there is none."""
    best, sizes, n, limited = None, problem.sizes, problem.n, any(limits)
    chosen: Tuple[int, Found] = -1, ((math.nan,) * n, (math.nan,) * (n * n))
    for number, (inputs, rates) in enumerate(solutions):
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
            best, chosen = order, (number, (places, rates))
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


def _slacks(problem: InverseProblem, by: int, solutions: np.ndarray, ends: Sequence[float]
            ) -> np.ndarray:
    """Return what `_slack` does for columns of solutions."""
    return np.asarray(_slack(problem, by, np.abs(solutions[:, problem.n:]).swapaxes(0, 1), *ends))


def choose_arrays(problem: InverseProblem, solutions: np.ndarray,
                  seed: Optional[Sequence[np.ndarray]], limits: Limits) -> np.ndarray:
    """Return what `choose` does for columns of solutions (solutions, inputs and rates, m)."""
    n, solutions = problem.n, solutions.copy()
    places, inputs, rates = solutions[:, :n], solutions[:, :n].copy(), solutions[:, n:]
    for by, (x, turn, ends) in enumerate(zip(places.swapaxes(0, 1), problem.turns, limits)):
        if seed is not None and turn < math.inf:
            x += turn * np.rint((seed[by] - x) / turn)
        if ends:
            slack = _slacks(problem, by, solutions, ends)
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


def choose_path(problem: InverseProblem, solutions: np.ndarray, seed: Optional[Sequence[float]],
                limits: Limits) -> np.ndarray:
    """
    Return what `choose` does for successive columns of solutions, as `choose_arrays` does.

    Each is the nearest to the one before, which needs no choice where the input just goes on.
    """
    n, found = problem.n, np.full(solutions.shape[1:], math.nan)
    inside = _may_be_inside(problem, solutions, limits)
    places = np.flatnonzero(inside.any(axis=0))
    solutions = np.where(inside[:, None], solutions, math.nan)[:, :, places]
    following = _following(problem, solutions[:, :n])
    at, most = 0, FIRST
    while at < len(places):
        known = np.flatnonzero(inside[:, places[at]])
        number, chosen = _chosen(problem, [
            (tuple(x[:n]), tuple(x[n:])) for x in solutions[known, :, at].tolist()], seed, limits)
        if number < 0:
            at += 1
            continue
        numbers = [known[number]]
        for numbered in zip(*following[:, at:at + most - 1].tolist()):
            numbers.append(numbered[numbers[-1]])
        run = solutions[numbers, :, range(at, at + len(numbers))].T
        run[:, 0] = *chosen[0], *chosen[1]
        run = run[:, :_go_on(problem, run, limits)]
        stop = at + run.shape[1]
        found[:, places[at:stop]], seed = run, tuple(run[:n, -1].tolist())
        most = min(2 * most, MOST) if stop - at == len(numbers) else FIRST
        at = stop
    return found


def _may_be_inside(problem: InverseProblem, solutions: np.ndarray, limits: Limits) -> np.ndarray:
    """Return which solutions there are, and after whole turns are between their ends."""
    inside = np.isfinite(solutions[:, 0])
    for by, (turn, ends) in enumerate(zip(problem.turns, limits)):
        if ends:
            x, slack = solutions[:, by], _slacks(problem, by, solutions, ends)
            low, high = ends[0] - slack, ends[1] + slack
            x = x + (turn * np.ceil((low - x) / turn) if turn < math.inf else 0.0)
            inside &= (low <= x) & (x <= high)
    return inside


def _following(problem: InverseProblem, inputs: np.ndarray) -> np.ndarray:
    """Return for inputs (solutions, inputs, m) which of the next ones are the nearest to each."""
    following = np.zeros((len(inputs), max(inputs.shape[2] - 1, 0)), int)
    for nearest, here in zip(following, inputs[..., :-1]):
        least = np.full(len(nearest), math.inf)
        for number, there in enumerate(inputs[..., 1:]):
            far = np.sqrt(sum(problem.distance(by, x, y) ** 2
                              for by, (x, y) in enumerate(zip(here, there))))
            nearer = far < least - CLOSE
            nearest[nearer], least[nearer] = number, far[nearer]
    return following


def _go_on(problem: InverseProblem, run: np.ndarray, limits: Limits) -> int:
    """Add the whole turns to successive solutions; return after how many one leaves its ends."""
    n, count = problem.n, run.shape[1]
    for by, (row, turn, ends) in enumerate(zip(run[:n], problem.turns, limits)):
        if turn < math.inf:
            row[1:] += turn * np.cumsum(np.rint((row[:-1] - row[1:]) / turn))
        if ends:
            slack = _slack(problem, by, np.abs(run[n:]), *ends)
            beyond = np.flatnonzero((row < ends[0] - slack) | (ends[1] + slack < row))
            count = min([count, *beyond[:1].tolist()])
            row.clip(*ends, out=row)
    return count
