# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
From candidates to solutions: Newton's method on the forward formula, and one judgement.

A candidate is a solution if the outputs there have their values up to rounding: that of the
outputs, and that of the inputs times their rates. Steps end where one no longer improves: what
rounding explains may still be many last digits of a small value. `refine` works on floats,
`solve_arrays` on arrays, both with one code of a step. Where a bracket is known, Newton's method
stays inside it.
"""

from __future__ import annotations

import math
from typing import Callable, Iterator, Sequence

import numpy as np

from .problem import ACCEPTED, Candidate, InverseProblem, Row
from ..motion.curves import HALVINGS
from ..tolerances import ONE, SINGULAR

# Beside a candidate without a pose or rates these are looked for so many times, each time twice as
# far as before, from an ulp on: where the margin is 1e-6, rounding of the outputs leads as far.
MAX_PERTURBATIONS = 22


def refine(problem: InverseProblem, values: Sequence[float], candidate: Candidate,
           far: float = SINGULAR) -> Row | None:
    """
    Return the solution at a candidate, its inputs and rates; None if there is none.

    Without a bracket, a larger error than `far` [sizes] is that of another assembly mode.
    """
    n, at, (inputs, low, high) = problem.n, problem.newton.at, candidate
    is_certain = low > -math.inf
    best = at(*inputs, *values)
    perturbed = inputs, best
    if not _is_known(best, n):
        perturbed = next(((x, pose) for x in _perturbed(inputs)
                          if _is_known(pose := at(*x, *values), n)), perturbed)
    if not best[0] < math.inf:
        # Rounding of the outputs may have led out of the reach.
        inputs, best = perturbed
    following = best[2 + n:2 + 2 * n]
    for _ in range(HALVINGS):
        if is_certain and not low <= following[0] <= high:
            following = (0.5 * (low + high), *inputs[1:])
        if following == inputs or not (is_certain or best[0] <= far):
            break
        trial = at(*following, *values)
        if trial[0] < best[0]:
            best, inputs, following = trial, following, trial[2 + n:2 + 2 * n]
        elif best[1] <= ACCEPTED:
            break
        else:
            # Next to an extreme a whole step leads too far.
            following = tuple([0.5 * (x + y) for x, y in zip(following, inputs)])
    # At a jump or in noise both sides enclose values that the output never has.
    if not (best[0] <= SINGULAR if is_certain else best[1] <= ACCEPTED):
        return None
    # At an end of a segment, rates are those of the nearest float that has them.
    rates = (best if _is_known(best, n) else perturbed[1])[2 + 3 * n:]
    return *best[2 + 2 * n:2 + 3 * n], *rates


def _is_known(step: Row, n: int) -> bool:
    """Return whether a step begins at a pose that has rates."""
    return math.isfinite(sum(step[2 + 3 * n:], step[0]))


def _perturbed(inputs: Row) -> Iterator[Row]:
    """Yield other inputs, each time farther away."""
    return ((*inputs[:by], inputs[by] + side * 2.0 ** k * math.ulp(inputs[by]), *inputs[by + 1:])
            for k in range(MAX_PERTURBATIONS) for side in (1.0, -1.0) for by in range(len(inputs)))


def _are_one(problem: InverseProblem, solution: Row, other: Row) -> bool:
    """
    Return whether two solutions are one.

    They are if they are as near as ONE, or if they are nearly as near as half of all digits and
    the rates say that the outputs differ by no more than ONE.
    """
    n, steps = problem.n, []
    for x, y, turn, size in zip(solution, other, problem.turns, problem.sizes):
        steps.append(math.remainder(x - y, turn))
        if not abs(steps[-1]) <= SINGULAR * size:
            return False
    return all(abs(step) <= ONE * size for step, size in zip(steps, problem.sizes)) or any(
        all(abs(sum(rate * step for rate, step in zip(row[n + i::n], steps))) <= ONE * scale
            for i, scale in enumerate(problem.scales)) for row in (solution, other))


def distinct(problem: InverseProblem, solutions: Sequence[Row]) -> list[Row]:
    """Return solutions in order, one of those that are one."""
    distinct: list[Row] = []
    for solution in sorted(solutions):
        if not any(_are_one(problem, solution, other) for other in distinct):
            distinct.append(solution)
    return distinct


def solve_arrays(problem: InverseProblem, values: np.ndarray,
                 candidate_arrays: Callable[[np.ndarray], tuple[np.ndarray, ...]]
                 ) -> tuple[np.ndarray, np.ndarray]:
    """
    Return all solutions for columns of values (outputs, m), and columns to be solved alone.

    The solutions (solutions, inputs and rates, m) are in order, padded with NaN. A column is to be
    solved alone if a candidate is not clear after a few steps, or if two solutions may be one.
    """
    n, over, values = problem.n, problem.newton.over, problem.reduced_arrays(values)
    numbers, places, candidates = candidate_arrays(values)
    goals = values[:, places]
    # What closed forms lose next to a singular pose; more is another assembly.
    low, high, inputs, far = -math.inf, math.inf, candidates, SINGULAR
    if n == 1:
        low, high, inputs, far = *candidates[:2], candidates[2:], math.inf
    best = over(*inputs.clip(low, high), *goals)
    unclear = ~np.isfinite(best).all(axis=0)
    again = np.flatnonzero((best[0] > 0.0) & (best[0] <= far))
    for _ in range(HALVINGS):
        if not len(again):
            break
        x = best[2 + n:2 + 2 * n].clip(low, high)[:, again]
        trial = over(*x, *goals[:, again])
        better = trial[0] < best[0, again]
        again = again[better]
        best[:, again] = trial[:, better]
    is_solved = best[1] <= ACCEPTED
    solutions = np.full((numbers.max(initial=0) + 1, n + n * n, values.shape[1]), math.nan)
    solutions[numbers, :, places] = np.where(is_solved, best[2 + 2 * n:], math.nan).T
    order = np.lexsort(solutions[:, :n].swapaxes(0, 1)[::-1], axis=0)
    solutions = np.take_along_axis(solutions, order[:, None], 0)
    pairs = np.triu_indices(len(solutions), 1)
    distances = np.max([input_.distance(*(solutions[k, by] for k in pairs)) / size for by, (
        input_, size) in enumerate(zip(problem.inputs, problem.sizes))], axis=0)
    alone = (distances <= SINGULAR).any(axis=0)
    alone[places[(unclear | ~is_solved) & ~(best[0] > far)]] = True
    return solutions, np.flatnonzero(alone)
