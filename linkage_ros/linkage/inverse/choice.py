# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The choice of one solution of an inverse, or none: next to given inputs, between given ends.

The rule is written once, as expressions: `ranked` and `better`. Floats, arrays and the inverse as
one formula (`expressions`) run the same code.
"""

from __future__ import annotations

from itertools import chain, count, islice
import math
from typing import Any, Sequence

import numpy as np

from .problem import InverseProblem, nearest
from ..tolerances import CLOSE, SINGULAR, TOLERANCE
from ...cache import Cache
from ...formula.expression import (
    argument,
    nearest_integer,
    Real,
    real,
    square_root,
    valid_where,
    where,
)
from ...formula.program import Program

Reals = Sequence[Real]


def ranked(problem: InverseProblem, inputs: Reals, rates: Reals, seed: Reals = (),
           ends: Sequence[Reals] = ()) -> list[Reals]:
    """
    Return by what a solution is compared with others, its inputs as chosen, and its rates.

    It is the nearest to the inputs `seed`, whole turns included. Without `seed` it is, of one
    input, the least at which the output increases, else the least; of several, the one with the
    least first input. An input beyond an end by rounding of the outputs is at the end.
    """
    order = [x / size for x, size in zip(inputs, problem.sizes)]
    places = [nearest(x, y, turn) for x, y, turn in zip(inputs, seed, problem.turns)] or inputs
    if any(ends):
        places = [_inside(problem, by, place, rates, ends[by], not seed) if ends[by] else place
                  for by, place in enumerate(places)]
    if seed:
        steps = ((x - y) / size for x, y, size in zip(places, seed, problem.sizes))
        order.insert(0, square_root(sum((step * step for step in steps), real(0.0))))
    elif problem.n == 1:
        order.insert(0, where(rates[0] < 0.0, 1.0, 0.0))
    return [order, places, rates]


def better(solution: Sequence[Reals], best: Sequence[Reals]) -> list[Reals]:
    """Return the better one of two ranked solutions; numbers that differ by rounding are tied."""
    (order, places, _), (best_order, best_places, _) = solution, best
    *pairs, (first, second) = zip(order, best_order)
    precedes = first < second - CLOSE
    for first, second in reversed(pairs):
        precedes = where(abs(first - second) <= CLOSE, precedes, first < second - CLOSE)
    is_there, was_there = (abs(sum(x[1:], x[0])) < math.inf for x in (places, best_places))
    chosen = where(was_there, where(is_there, precedes, is_there), is_there)
    return [[where(chosen, x, y) for x, y in zip(*parts)] for parts in zip(solution, best)]


def _inside(problem: InverseProblem, by: int, place: Real, rates: Reals, ends: Reals,
            first: bool) -> Real:
    """Return an input between two ends, after whole turns if needed; NaN if there is none."""
    (lower, upper), n, turn, size = ends, problem.n, problem.turns[by], problem.sizes[by]
    # How far rounding of the outputs moves an input: to an extreme, half of all digits, and one
    # more where it is flat.
    slack = real(10.0 * SINGULAR * size)
    for rate, scale in zip(rates[n * by:n * by + n], problem.scales):
        moved = TOLERANCE * math.pi * scale / (abs(rate) + 1e-300)
        slack = where(moved < slack, moved, slack)
    slack = slack + TOLERANCE * (4.0 * size + abs(lower) + abs(upper))
    low, high = lower - slack, upper + slack
    if turn < math.inf:
        up, down = _ceiling((low - place) / turn), -_ceiling((place - high) / turn)
        place = place + turn * (up if first else where(
            place < low, up, where(high < place, down, 0.0)))
    inner = where(place < lower, lower, where(upper < place, upper, place))
    return valid_where(valid_where(inner, place - low, 0.0), high - place, 0.0)


def _ceiling(x: Real) -> Real:
    nearest = nearest_integer(x)
    return where(nearest < x, nearest + 1.0, nearest)


class Choice:
    """The choice of solutions, each its inputs and rates as floats or as arrays of one shape."""

    def __init__(self, problem: InverseProblem):
        self._problem = problem
        self._codes = Cache(lambda key: self._code(*key))

    def _code(self, follows: bool, limited: Sequence[bool]) -> Any:
        """Return the code for the better one, and a state of no solution."""
        problem, numbers = self._problem, map(argument, count())
        n = problem.n
        solution = [*islice(numbers, n)], [*islice(numbers, n * n)]
        seed = [*islice(numbers, n * follows)]
        state = ranked(problem, *solution, seed, [[*islice(numbers, 2 * ends)]
                                                  for ends in limited])
        best = better(state, [[*islice(numbers, len(part))] for part in state])
        return problem.linkage.bind(Program([*chain(*best)], next(numbers).args[0])), [
            math.nan] * sum(map(len, best))

    def of(self, solutions: Any, seed: Any, limits: Sequence[Sequence[float]]) -> Any:
        """Return the chosen one of solutions, NaN if there is none; limits are () or two ends."""
        code, best = self._codes[len(seed) > 0, tuple(map(bool, limits))]
        better = code.searched if isinstance(solutions, np.ndarray) else code.at
        fixed = *seed, *chain(*limits)
        for solution in solutions:
            best = better(*solution, *fixed, *best)
        return best[-self._problem.n * (self._problem.n + 1):]

    def along(self, solutions: np.ndarray, seed: Sequence[float],
              limits: Sequence[Sequence[float]]) -> np.ndarray:
        """Return for columns of solutions the nearest one to that of the column before."""
        path = np.full(solutions.shape[1:], math.nan)
        for chosen, column in zip(path.T, np.moveaxis(solutions, 2, 0).tolist()):
            chosen[:] = self.of([row for row in column if row[0] == row[0]], seed, limits)
            if chosen[0] == chosen[0]:
                seed = chosen[:self._problem.n].tolist()
        return path
