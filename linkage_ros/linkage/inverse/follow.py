# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The solution that is continuous from given inputs.

The outputs go straight from their present values to others. Of one input, the solution is on the
segment of the present input, or on one that continues it. Of several, Newton's method follows the
motion in steps, which get shorter where it fails.

Source: Gosselin and Angeles, "Singularity analysis of closed-loop kinematic chains", IEEE Trans.
Robotics and Automation 6 (1990).
"""

from __future__ import annotations

import math
from typing import Optional, Sequence, Tuple

import numpy as np

from .problem import InverseProblem, Row
from .refine import refine
from .segments import Segments
from ..motion.curves import HALVINGS

# The longest step of an input [rad, sizes].
LONGEST = 0.7


def follow(problem: InverseProblem, values: Sequence[float], seed: Sequence[float],
           source: object) -> Optional[Row]:
    """Return the solution, with the whole turns of `seed`, and its rates; None if none."""
    start = problem.newton.at(*seed, *values)
    if not start[0] < math.inf:
        return None
    gaps = [gap * scale for gap, scale in zip(start[2:], problem.scales)]
    if isinstance(source, Segments):
        way = source.follow(values[0], gaps[0], seed[0])
        if not way:
            return None
        bracket, turns = way
        found, seed = refine(problem, values, bracket), (turns + bracket.seed,)
    else:
        found, seed = _followed(problem, values, seed, gaps, start[-problem.n ** 2:])
    return found and (*problem.nearest_equivalent(found, seed), *found[problem.n:])


def _followed(problem: InverseProblem, values: Sequence[float], seed: Sequence[float],
              gaps: Sequence[float], rates: Row) -> Tuple[Optional[Row], Sequence[float]]:
    """Return the end of the motion, None if there is none, and inputs in its turn."""
    side, left, part = _side(rates), 1.0, 1.0
    for _ in range(4 * HALVINGS if side else 0):
        rest = max(left - part, 0.0)
        found = refine(problem, [x + rest * gap for x, gap in zip(values, gaps)], tuple(seed))
        # A fold is not passed, nor is the motion left for another one.
        if found and _side(found[problem.n:]) == side and all(
                abs(x - y) <= LONGEST * size for x, y, size in zip(
                    problem.nearest_equivalent(found, seed), seed, problem.sizes)):
            seed, left = problem.nearest_equivalent(found, seed), rest
            if not left:
                return found, seed
            part = min(4.0 * part, left)
        else:
            part *= 0.25
    return None, seed


def _side(rates: Sequence[float]) -> float:
    """Return the sign of the Jacobian's determinant, 0 where there is none."""
    n = math.isqrt(len(rates))
    return float(np.sign(np.linalg.det(np.reshape(rates, (n, n))))) if math.isfinite(
        sum(rates)) else 0.0
