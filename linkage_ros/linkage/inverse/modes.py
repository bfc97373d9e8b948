# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The assembly modes of the inverse linkage, in closed form.

For floats and arrays they are candidates. For arrays of other packages they are one formula,
without loops: there a mode is a solution if the forward formula says so, and is not refined.
"""

from __future__ import annotations

from functools import reduce
from itertools import chain
import math
from typing import Iterator, Sequence

import numpy as np

from .choice import better, ranked
from .linkage import InverseLinkage
from .problem import Candidate, InverseProblem, nearest
from ..geometry.spatial import IN_SINGLE
from ..tolerances import CLOSE
from ...formula.expression import argument, Real, real, substituted, valid_where
from ...formula.program import Program
from ...words import join_names

# A mode whose outputs are off by more than this [sizes] is no solution.
OFF = 2.0 ** -20
# What these constants are in single precision.
SINGLE = {**IN_SINGLE, OFF: 2.0 ** -10, CLOSE: 2.0 ** -12}

Reals = list[Real]


class Modes:
    """The inputs in each assembly mode of an inverse linkage, and in each of its turns."""

    def __init__(self, problem: InverseProblem, closed: InverseLinkage):
        self._problem = problem
        self._pose = problem.linkage.bind(Program([*chain(*closed.solutions())], problem.n))

    def candidates(self, values: Sequence[float]) -> Iterator[Candidate]:
        """Return the inputs of each mode that can be assembled."""
        modes = zip(*[iter(self._pose.at(*values))] * self._problem.n)
        return (Candidate(inputs) for inputs in modes if math.isfinite(sum(inputs)))

    def candidate_arrays(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return numbers of modes, of values (outputs, m) that they have, and the inputs there."""
        modes = self._pose.over(*values).reshape(-1, *values.shape)
        numbers, places = np.nonzero(np.isfinite(modes).all(axis=1))
        return numbers, places, modes[numbers, :, places].T


def modes_of(problem: InverseProblem, closed: InverseLinkage | None) -> list[tuple[Reals, Reals]]:
    """
    Return the inputs in each assembly mode and its turns, NaN where it is no solution.

    Beside them are the rates of each output by the first input, by the second and so on.
    """
    if not closed:
        raise ValueError(f'{join_names(problem.outputs)}: no closed form is known, only a search')
    modes, forward = [], problem.linkage.formulas.checked(problem.outputs)
    for inputs in closed.solutions():
        results = substituted(forward, dict(enumerate(inputs)))
        for by, (turn, scale) in enumerate(zip(problem.periods, problem.scales)):
            # Not a product of OFF, which would be a number that single precision does not know.
            room = OFF - abs(nearest(results[by] - argument(by), real(0.0), turn)) / scale
            inputs = [valid_where(x, room, 0.0) for x in inputs]
        modes.append(([nearest(x, real(0.0), turn) for x, turn in zip(inputs, problem.turns)],
                      results[problem.n:]))
    return modes


def chosen_of(problem: InverseProblem, closed: InverseLinkage | None, follows: bool) -> Reals:
    """Return the inputs of one mode; see `choice.ranked`. To follow, next to more arguments."""
    seed = [argument(problem.n + by) for by in range(problem.n * follows)]
    _, places, _ = reduce(lambda best, mode: better(mode, best), [
        ranked(problem, *mode, seed) for mode in modes_of(problem, closed)])
    return [*places]
