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
from typing import Optional, Sequence

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
    if not isinstance(source, Segments):
        side = _side(start[-problem.n ** 2:])
        return _followed(problem, values, gaps, seed, side, HALVINGS) if side else None
    way = source.follow(values[0], gaps[0], seed[0])
    if not way:
        return None
    bracket, turns = way
    found = refine(problem, values, bracket)
    return found and (*problem.nearest_equivalent(found, (turns + bracket.seed,)), found[1])


def _followed(problem: InverseProblem, values: Sequence[float], gaps: Sequence[float],
              seed: Sequence[float], side: float, halvings: int) -> Optional[Row]:
    """Return the end of a motion of the outputs from `gaps` above values; None if none."""
    if found := refine(problem, values, tuple(seed)):
        inputs, rates = problem.nearest_equivalent(found, seed), found[problem.n:]
        # A fold is not passed, nor is the motion left for another one.
        if _side(rates) == side and all(abs(x - y) <= LONGEST * size for x, y, size in zip(
                inputs, seed, problem.sizes)):
            return *inputs, *rates
    if not halvings:
        return None
    halves = [0.5 * gap for gap in gaps]
    middle = _followed(problem, [x + gap for x, gap in zip(values, halves)], halves, seed, side,
                       halvings - 1)
    return middle and _followed(problem, values, halves, middle[:problem.n], side, halvings - 1)


def _side(rates: Sequence[float]) -> float:
    """Return the sign of the Jacobian's determinant, 0 where there is none."""
    n = math.isqrt(len(rates))
    return float(np.sign(np.linalg.det(np.reshape(rates, (n, n))))) if math.isfinite(
        sum(rates)) else 0.0
