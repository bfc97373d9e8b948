# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The solution that is continuous from given inputs.

The outputs go straight from their present values to others, and a step of this motion has one
candidate. Only the length of a step differs. Of one input, segments know all special inputs
beforehand: the motion is one step, along the segments. Of several inputs, nothing is known
beforehand: the candidate is the present inputs, and a step is halved if Newton's method does not
end nearby, on the same side of all folds. With one input this would lose motions that begin at a
special input, where there is no rate: 103 of 272 in the catalogue and 40 random linkages, of which
segments lose 6 (measured at commit aebd2314).

Source: Gosselin and Angeles, "Singularity analysis of closed-loop kinematic chains", IEEE Trans.
Robotics and Automation 6 (1990).
"""

from __future__ import annotations

import math
from typing import Sequence

import numpy as np

from .problem import Candidate, InverseProblem, Row
from .refine import refine
from .segments import Segments
from ..motion.curves import HALVINGS

# The largest motion of the outputs [sizes] in a step.
FAR = 0.1


def follow(problem: InverseProblem, values: Sequence[float], seed: Sequence[float],
           source: object) -> Row | None:
    """Return the solution, with the whole turns of `seed`, and its rates; None if none."""
    start = problem.newton.at(*seed, *values)
    residuals = [residual * scale for residual, scale in zip(start[2:], problem.scales)]
    if not all(map(math.isfinite, (start[0], *residuals))):
        return None
    if not isinstance(source, Segments):
        side = _side(start[-problem.n ** 2:])
        return _followed(problem, values, residuals, seed, side, HALVINGS) if side else None
    candidate, estimate = source.follow(values[0], residuals[0], seed[0]) or (None, ())
    solution = candidate and refine(problem, values, candidate)
    return solution and (*problem.nearest_equivalent(solution, estimate), solution[1])


def _followed(problem: InverseProblem, values: Sequence[float], residuals: Sequence[float],
              seed: Sequence[float], side: float, halvings: int) -> Row | None:
    """Return the end of a motion of the outputs from `residuals` above values; None if none."""
    if solution := refine(problem, values, Candidate(tuple(seed)), FAR):
        inputs, rates = problem.nearest_equivalent(solution, seed), solution[problem.n:]
        # A fold is not passed.
        if _side(rates) == side:
            return *inputs, *rates
    if not halvings:
        return None
    halves = [0.5 * residual for residual in residuals]
    middle = _followed(problem, [x + half for x, half in zip(values, halves)], halves, seed, side,
                       halvings - 1)
    return middle and _followed(problem, values, halves, middle[:problem.n], side, halvings - 1)


def _side(rates: Sequence[float]) -> float:
    """Return the sign of the Jacobian's determinant, 0 where there is none."""
    n = math.isqrt(len(rates))
    return float(np.sign(np.linalg.det(np.reshape(rates, (n, n))))) if math.isfinite(
        sum(rates)) else 0.0
