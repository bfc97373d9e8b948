# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The code that chooses one of several solutions of an inverse, or none."""

from __future__ import annotations

from functools import reduce
from itertools import chain
import math
from typing import List, Sequence, Tuple

from .inverse_problem import InverseProblem, LARGE
from .planar import TOLERANCE
from ..formula.expression import (
    argument,
    gated,
    greater,
    nearest_integer,
    Real,
    real,
    square,
    square_root,
    where,
)

# Distance to an end of a sweep that counts as that end, in sizes and as a part of the end.
CLOSE, ULPS = 1e-7, 4 * 2.0 ** -52
# Inputs that differ by less are the same one, of which the next input decides [rad, sizes].
TIE = 1e-9


def choice(problem: InverseProblem, rows: Sequence[Sequence[Real]], arguments: int, follows: bool,
           ended: Sequence[bool]) -> Tuple[List[Real], int]:
    """
    Return expressions that choose one of some solutions, and the number of their arguments.

    Parameters
    ----------
    problem : InverseProblem
        What is solved.
    rows : sequence of sequence of Real
        For each solution 1, or NaN if that it is one is not known; its inputs and rates, NaN if it
        is none.
    arguments : int
        The number of arguments of these expressions.
    follows : bool
        Whether the next arguments are inputs that the solution has to be nearest to.
    ended : sequence of bool
        For each input whether it has ends, the arguments after these. An input beyond an end by
        rounding of the outputs is at the end.

    Returns
    -------
    (list of Real, int)
        The number of the chosen one, NaN if one is not known; its inputs and its rates.

    """
    n = len(problem.outputs)
    total = arguments + n * follows + 2 * sum(ended)
    given = list(map(argument, range(arguments, total)))
    near, ends = given[:n] if follows else [], iter(given[n * follows:])
    limits = [(next(ends), next(ends)) if each else () for each in ended]
    unknown = reduce(lambda found, row: where(row[0] <= 1.0, found, math.nan), rows, real(0.0))
    choices = []
    for rank, (_, *row) in enumerate(rows):
        places, misses = zip(*(_place(problem, by, row, near, limit)
                               for by, limit in enumerate(limits)))
        if follows:
            order = [square_root(sum((square((x - y) / size) for x, y, size in zip(
                places, near, problem.sizes)), real(0.0)))]
        else:
            order = [where(row[1] < 0.0, 1.0, 0.0) if n == 1 else real(0.0), *(
                x / size for x, size in zip(row[:n], problem.sizes))]
        order[0] = reduce(lambda far, miss: where(miss, math.inf, far), chain(*misses),
                          where(row[0] <= row[0], order[0], math.inf))
        choices.append([*order, real(float(rank)), *places, *row[n:]])
    many = len(order)
    best = reduce(lambda best, other: [where(
        _before(other[:many], best[:many]), mine, its) for mine, its in zip(other, best)], choices)
    return [best[many] + unknown, *(
        gated(part, LARGE - best[0], 0.0) for part in best[many + 1:])], total


def _place(problem: InverseProblem, by: int, row: Sequence[Real], near: Sequence[Real],
           ends: Sequence[Real]) -> Tuple[Real, List[Real]]:
    """Return an input with whole turns added, and the conditions under which it is out."""
    x, size, turn = row[by], problem.sizes[by], problem.turned[by][1]

    def beside(value: Real, other: Real) -> Real:
        return value if math.isinf(turn) else value + turn * nearest_integer(
            (other - value) / turn)

    place = beside(x, near[by]) if near else x
    if not ends:
        return place, []
    speed = reduce(greater, (
        abs(rate) * (size / (TOLERANCE * (math.pi if angular else scale)))
        for rate, angular, scale in zip(
            row[len(problem.sizes) * (by + 1):], problem.angular, problem.scales)))
    slack = size * where(1.0 < CLOSE * speed, 1.0 / speed, CLOSE) + ULPS * (
        4.0 * size + abs(ends[0]) + abs(ends[1]))
    low, high = ends[0] - slack, ends[1] + slack
    first, last = (beside(x, end) for end in ends)
    if math.isfinite(turn):
        first = where(first < low, first + turn, first)
        last = where(high < last, last - turn, last)
    place = where(place < low, first, where(high < place, last, place)) if near else first
    inside = where(place < ends[0], ends[0], where(ends[1] < place, ends[1], place))
    return inside, [place < low, high < place]


def _before(one: Sequence[Real], other: Sequence[Real]) -> Real:
    """Return whether numbers precede others in lexicographic order; rounding is a tie."""
    (x, *rest), (y, *others) = one, other
    return 0.5 < where(x < y - TIE, 1.0, where(y < x - TIE, 0.0, where(
        _before(rest, others), 1.0, 0.0))) if rest else x < y
