# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The inverse as expressions of the outputs: all modes in closed form, and the choice of one.

They are what `modes`, `refine` and `choice` compute, for one formula without loops: a mode is a
solution if the forward formula says so, and is not refined.
"""

from __future__ import annotations

from itertools import product
import math
from typing import List, Optional, Tuple

from .linkage import InverseLinkage
from .problem import InverseProblem
from ..geometry.spatial import IN_SINGLE
from ..tolerances import CLOSE
from ...formula.expression import argument, gated, nearest_integer, Real, real, substituted, where
from ...words import listed

# A mode whose outputs are off by more than this [sizes] is no solution.
OFF = 2.0 ** -20
# What precedes nothing, in either precision.
LAST = 1e30
# What these constants are in single precision.
SINGLE = {**IN_SINGLE, OFF: 2.0 ** -10, CLOSE: 2.0 ** -12}

Reals = List[Real]


def modes_of(problem: InverseProblem, closed: Optional[InverseLinkage]
             ) -> List[Tuple[Reals, Reals]]:
    """
    Return the inputs in each assembly mode and its turns, NaN where it is no solution.

    Beside them are the rates of each output by the first input, by the second and so on.
    """
    if not closed:
        raise ValueError(f'from {listed(problem.outputs)} there is no closed form, only a search')
    modes, forward = [], problem.linkage.structure.checked(problem.outputs)
    for mode, turns in product(closed.modes, product(*closed.turns)):
        inputs = substituted([x + turn for x, turn in zip(mode.inputs, turns)], closed.arguments)
        results = substituted(forward, dict(enumerate(inputs)))
        for by, (turn, scale) in enumerate(zip(problem.periods, problem.scales)):
            room = OFF * scale - abs(_nearest(results[by] - argument(by), turn))
            inputs = [gated(x, room, 0.0) for x in inputs]
        modes.append(([_nearest(x, turn) for x, turn in zip(inputs, problem.turns)],
                      results[problem.n:]))
    return modes


def chosen_of(problem: InverseProblem, closed: Optional[InverseLinkage], follows: bool) -> Reals:
    """Return the inputs of one mode; see `choice.choose`. To follow, next to more arguments."""
    n = problem.n
    best, *others = [_ranked(problem, *mode, follows) for mode in modes_of(problem, closed)]
    for row in others:
        precedes = row[-n - 1] < best[-n - 1]
        # Lexicographic order; rounding is a tie.
        for x, y in [*zip(row, best)][-n - 2::-1]:
            precedes = where(abs(x - y) <= CLOSE, precedes, x < y)
        best = [where(precedes, x, y) for x, y in zip(row, best)]
    return best[-n:]


def _ranked(problem: InverseProblem, inputs: Reals, rates: Reals, follows: bool) -> Reals:
    """Return by what a mode is compared with others, and its inputs."""
    order = [x / size for x, size in zip(inputs, problem.sizes)]
    if follows:
        near = [argument(problem.n + by) for by in range(problem.n)]
        steps = [_nearest(x - y, turn) for x, y, turn in zip(inputs, near, problem.turns)]
        inputs = [x + step for x, step in zip(near, steps)]
        scaled = [step / size for step, size in zip(steps, problem.sizes)]
        order = [sum([step * step for step in scaled], real(0.0))]
    elif problem.n == 1:
        order.insert(0, where(rates[0] < 0.0, 1.0, 0.0))
    return [where(abs(inputs[0]) < math.inf, order[0], LAST), *order[1:], *inputs]


def _nearest(gap: Real, turn: float) -> Real:
    """Return a difference without whole turns."""
    return gap - turn * nearest_integer(gap / turn) if turn < math.inf else gap
