# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

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

from .problem import Found, InverseProblem
from .refine import refine
from .segments import Segments

# Steps of a motion at most, the shortest of them, and the longest of an input [rad, sizes].
STEPS, SHORTEST, LONGEST = 40, 1e-10, 0.7
# Newton steps to the end of each; each has to be shorter than this part of the one before.
NEWTON_STEPS, SHORTER = 30, 0.6
# After a step that is no longer than this [rad, sizes], the next one is rounding.
CLOSE = 1e-9


def follow(problem: InverseProblem, values: Sequence[float], near: Sequence[float],
           segments: Optional[Segments]) -> Optional[Found]:
    """Return the solution, with the whole turns of `near`, and its rates; None if there is none."""
    start = problem.forward.at(*near)[:problem.n]
    if not all(map(math.isfinite, start)):
        return None
    if segments:
        input_, size = problem.inputs[0], problem.sizes[0]
        turns = input_.turns_of(near[0])
        way = segments.follow(values[0], start[0], (near[0] - turns) / size, problem.turns[0])
        if not way:
            return None
        bracket, passed = way
        found, near = refine(problem, values, (), bracket), (turns + passed + bracket[2],)
    else:
        end = _followed(problem, values, near, start)
        found = end and refine(problem, values, end)
        near = end or near
    return found and (problem.beside(found[0], near), found[1])


def _followed(problem: InverseProblem, values: Sequence[float], near: Sequence[float],
              start: Sequence[float]) -> Optional[Tuple[float, ...]]:
    """Return the end of the motion; None if it passes a dead point or leaves the reach."""
    sizes, left, part = np.array(problem.sizes), 1.0, 1.0
    gaps = np.array([math.remainder(now - value, turn) for now, value, turn in zip(
        start, values, problem.periods)])
    q, side = np.divide(near, sizes), np.linalg.det(problem.jacobian(
        problem.forward.at(*near)[problem.n:]))
    for _ in range(STEPS if math.isfinite(side) and side else 0):
        rest = max(left - part, 0.0)
        found = _corrected(problem, q, np.add(values, rest * gaps), side)
        if found is not None:
            q, left = found, rest
            if not left:
                return tuple((q * sizes).tolist())
            part = min(4.0 * part, left)
        elif (part := 0.25 * part) < SHORTEST:
            break
    return None


def _corrected(problem: InverseProblem, start: np.ndarray, aim: np.ndarray,
               side: float) -> Optional[np.ndarray]:
    """Return the pose near a start at which outputs have values, without passing a fold."""
    q, last, n = start, LONGEST, problem.n
    for _ in range(NEWTON_STEPS):
        row = problem.forward.at(*(q * problem.sizes).tolist())
        jacobian = problem.jacobian(row[n:])
        gap = [math.remainder(y - x, turn) / scale if math.isfinite(y) else math.nan
               for y, x, turn, scale in zip(row, aim, problem.periods, problem.scales)]
        if not (np.isfinite(jacobian).all() and np.linalg.det(jacobian) * side > 0.0):
            return None
        step = np.linalg.solve(jacobian, gap)
        longest = float(np.abs(step).max())
        if not longest <= last or np.abs(q - step - start).max() > LONGEST:
            return None
        q, last = q - step, SHORTER * longest
        if longest <= CLOSE:
            return q
    return None
