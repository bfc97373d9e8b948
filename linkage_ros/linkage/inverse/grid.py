# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Candidates of several inputs without a closed form: a search from many poses.

Steps of Newton's method, shortened until the error falls, lead to solutions from poses all over
the ranges of the inputs. The search may miss solutions, of two next to a fold most likely.

Source: Nocedal and Wright, "Numerical Optimization", sec. 11.2.
"""

from __future__ import annotations

import math
from typing import Iterator, Sequence

import numpy as np

from .problem import ACCEPTED, Candidate, InverseProblem, Row
from .segments import segments_of
from ..inputs import spread
from ..motion.curves import HALVINGS
from ..tolerances import CLOSE, SINGULAR
from ...words import join_names

# Starts, more of them where fewer than this number can be assembled.
COUNTS, ASSEMBLED = (4096, 65536), 500
# The longest step [rad, sizes]: longer ones lead away from folds.
MAX_STEP = 0.7


class Grid:
    """Outputs as functions of several inputs."""

    def __init__(self, problem: InverseProblem):
        self._problem, self._inputs = problem, problem.linkage.inputs
        self._steps = np.array([input_.step for input_ in self._inputs])
        self._low, self._high = np.array([
            (-math.inf, math.inf) if input_.wraps else (input_.low, input_.high)
            for input_ in self._inputs]).T
        # Inputs that are outputs, by their numbers in both.
        self._held = {by: problem.outputs.index(input_.name)
                      for by, input_ in enumerate(self._inputs) if input_.name in problem.outputs}
        # With all others known, the first input is searched as if it were the only one.
        self._sought: int | None = None
        if {*self._held} == {*range(1, problem.n)}:
            self._sought, = {*range(problem.n)} - {*self._held.values()}
            problem.linkage.check_output(problem.outputs[self._sought])
        else:
            self._check_independent()

    def candidates(self, values: Sequence[float]) -> Iterator[Candidate]:
        """Yield inputs at which the outputs may have some values."""
        problem, place = self._problem, self._sought
        held = {by: values[row] for by, row in self._held.items()}
        if place is not None:
            others = tuple(held[by] for by in range(1, problem.n))
            for candidate in segments_of(problem.linkage, problem.outputs[place],
                                         others).candidates(values[place:place + 1]):
                yield candidate._replace(inputs=candidate.inputs + others)
        else:
            solutions = self._descended(self._starts(held, values), values)
            yield from map(Candidate, solutions)
            yield from map(Candidate, self._descended(
                self._across_folds(solutions, values), values))

    def _solved(self, q: np.ndarray, values: Sequence[float]) -> np.ndarray:
        """Return what a step of Newton's method returns, for rows of inputs."""
        return self._problem.newton.over(*q.T, *values)

    def _starts(self, held: dict, values: Sequence[float]) -> np.ndarray:
        """Return assembled poses all over the inputs, more where few are assembled."""
        starts = np.empty((0, len(self._inputs)))
        for count in COUNTS:
            columns = spread(self._inputs, count)
            for by, value in held.items():
                columns[by][:] = value
            starts = np.stack(columns, axis=-1)
            starts = starts[self._solved(starts, values)[0] < math.inf]
            if len(starts) >= ASSEMBLED:
                break
        return starts

    def _across_folds(self, solutions: list[Row], values: Sequence[float]) -> np.ndarray:
        """
        Return starts on both sides of solutions, in the direction that changes outputs least.

        Beyond a fold, few of the starts all over the inputs may lead to the other solution.
        """
        n, q = self._problem.n, np.reshape(solutions, (-1, self._problem.n))
        rates = self._solved(q, values)[-n * n:].T.reshape(-1, n, n).swapaxes(1, 2)
        known = np.isfinite(rates).all(axis=(1, 2))
        *_, directions = np.linalg.svd(self._problem.scaled(rates[known]))
        steps = MAX_STEP * 0.5 ** np.arange(HALVINGS) * self._steps[:, None]
        return np.concatenate([q[known] + side * step * directions[:, -1]
                               for step in steps.T for side in (1.0, -1.0)]).clip(
                                   self._low, self._high)

    def _check_independent(self) -> None:
        """Raise ValueError if the outputs do not determine the inputs in nearly all poses."""
        n = self._problem.n
        zeros = [0.0] * n
        rates = self._solved(self._starts({}, zeros), zeros)[-n * n:]
        rates = rates[:, np.isfinite(rates).all(axis=0)].T.reshape(-1, n, n).swapaxes(1, 2)
        outputs, (weights, values, _) = self._problem.outputs, np.linalg.svd(
            self._problem.scaled(rates))
        # An output may stand still in a tenth of the poses.
        if len(values) and np.quantile(values[:, -1] / np.fmax(values[:, 0], 1e-300),
                                       0.9) <= CLOSE:
            some = np.median(np.abs(weights[:, :, -1]), axis=0) > CLOSE
            raise ValueError(
                f'{join_names(outputs)} do not determine all inputs: too few of them move '
                f'{join_names([name for name, depends in zip(outputs, some) if depends])}')

    def _descended(self, q: np.ndarray, values: Sequence[float]) -> list[Row]:
        """Return the inputs next to solutions that steps of Newton's method reach."""
        n, parts, reached = self._problem.n, np.ones(len(q)), [q[:0]]
        solved = self._solved(q, values)
        for _ in range(HALVINGS):
            final = solved[1] <= ACCEPTED
            reached.append(q[final])
            going = ~final & (parts > SINGULAR) & np.isfinite(solved[2 + n:2 + 2 * n]).all(axis=0)
            if not going.any():
                break
            q, solved, parts = q[going], solved[:, going], parts[going]
            step = solved[2 + n:2 + 2 * n].T - q
            longest = np.abs(step / self._steps).max(axis=1)
            step *= (parts * MAX_STEP / np.maximum(longest, MAX_STEP))[:, None]
            trial = (q + step).clip(self._low, self._high)
            new = self._solved(trial, values)
            better = new[0] < solved[0]
            parts = np.where(better, 1.0, 0.25 * parts)
            q = np.where(better[:, None], trial, q)
            solved = np.where(better, new, solved)
        # Most of those that reach one solution differ by rounding.
        units = CLOSE * self._steps
        places = units * np.unique(np.round(np.concatenate(reached) / units), axis=0)
        return [*map(tuple, places.tolist())]
