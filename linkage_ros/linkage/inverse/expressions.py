# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The inverse as expressions of the outputs: all modes in closed form, and the choice of one.

They are what `modes` and `refine` compute, for one formula without loops: a mode is a solution if
the forward formula says so, and is not refined.
"""

from __future__ import annotations

from functools import reduce
from itertools import product
from typing import List, Optional, Tuple

from .choice import better, ranked
from .linkage import InverseLinkage
from .problem import InverseProblem, nearest
from ..geometry.spatial import IN_SINGLE
from ..tolerances import CLOSE
from ...formula.expression import argument, Real, real, substituted, valid_where
from ...words import listed

# A mode whose outputs are off by more than this [sizes] is no solution.
OFF = 2.0 ** -20
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
            # Not a product of OFF, which would be a number that single precision does not know.
            room = OFF - abs(nearest(results[by] - argument(by), real(0.0), turn)) / scale
            inputs = [valid_where(x, room, 0.0) for x in inputs]
        modes.append(([nearest(x, real(0.0), turn) for x, turn in zip(inputs, problem.turns)],
                      results[problem.n:]))
    return modes


def chosen_of(problem: InverseProblem, closed: Optional[InverseLinkage], follows: bool) -> Reals:
    """Return the inputs of one mode; see `choice.ranked`. To follow, next to more arguments."""
    seed = [argument(problem.n + by) for by in range(problem.n * follows)]
    _, places, _ = reduce(lambda best, mode: better(mode, best), [
        ranked(problem, *mode, seed) for mode in modes_of(problem, closed)])
    return [*places]
