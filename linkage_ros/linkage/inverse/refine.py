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
From candidates to solutions: Newton's method on the forward formula, and one judgement.

A candidate is a solution if the outputs there have their values up to rounding: that of the
outputs, and that of the inputs times their rates. `refine` works on floats, `refine_arrays` does
the same on arrays. Where a bracket is known, Newton's method stays inside it.
"""

from __future__ import annotations

from itertools import combinations
import math
from typing import List, Optional, Sequence, Tuple

import numpy as np

from .problem import Found, InverseProblem
from .segments import Bracket, SPECIAL, STEEPEST

# Errors in units of 2^-53 of an output's size: rounding, where refinement stops; and the largest
# of a solution, which rounding of all joints on the way may explain.
ROUNDED, ACCEPTED = 2.0, 64.0
# A larger error than this part of the output's size belongs to another assembly.
OTHER = 0.1
# A longer step leads to another solution [rad, sizes].
LONGEST = 0.1
# Steps at most: bisection alone needs one per bit of a float.
MAX_STEPS = 64
# Two solutions are one if they are no farther apart than SPECIAL [rad, sizes], or than this and
# the rates say that the outputs differ by no more than SPECIAL [sizes].
NEIGHBOURS = 1e-4

_UNIT = 2.0 ** -53


def refine(problem: InverseProblem, values: Sequence[float], inputs: Tuple[float, ...],
           bracket: Optional[Bracket] = None) -> Optional[Found]:
    """Return the solution at a candidate, with its rates; None if there is none."""
    if bracket:
        return _refine_inside(problem, values, inputs[1:], bracket)
    at, n, least, found = problem.forward.at, problem.n, math.inf, None
    for _ in range(MAX_STEPS):
        row = at(*inputs)
        gaps = [math.remainder(y - x, turn) if -math.inf < y < math.inf else math.nan
                for y, x, turn in zip(row, values, problem.periods)]
        missed = max([abs(gap) / scale for gap, scale in zip(gaps, problem.scales)])
        if not missed < least:
            break
        least, found = missed, (inputs, row, gaps)
        if not ROUNDED * _UNIT < missed <= OTHER:
            break
        step = _step(problem, gaps, row)
        if not all([abs(x) <= LONGEST * size for x, size in zip(step, problem.sizes)]):
            break
        inputs = tuple([x - by for x, by in zip(inputs, step)])
    if not found or least > OTHER:
        return None
    inputs, row, gaps = found
    # Where rates are low, rounding is that of the outputs alone.
    if least > ACCEPTED * _UNIT and not (least <= STEEPEST and _errors(
            problem, *(np.reshape(part, (-1, 1)) for part in (gaps, row, inputs)))[0] <= ACCEPTED):
        return None
    return problem.wrapped(inputs), row[n:]


def _refine_inside(problem: InverseProblem, values: Sequence[float], others: Sequence[float],
                   bracket: Bracket) -> Optional[Found]:
    """Return the solution in a bracket of the first input; the others are fixed."""
    low, high, x, sign = bracket
    at, n, value, period = problem.rated.at, problem.n, values[0], problem.periods[0]
    enough, least, best = ROUNDED * _UNIT * problem.scales[0], math.inf, math.nan
    x = x if low <= x <= high else 0.5 * (low + high)
    found: Sequence[float] = ()
    for _ in range(MAX_STEPS):
        row = at(x, *others)
        gap, rate = row[0] - value, row[n]
        if not -period <= 2.0 * gap <= period:
            gap = math.remainder(gap, period) if -math.inf < gap < math.inf else math.nan
        if abs(gap) < least:
            least, best, found = abs(gap), x, row
            if least <= enough:
                break
        elif least <= enough * (ACCEPTED / ROUNDED):
            break
        low, high = (x, high) if gap * sign < 0.0 else (low, x)
        x = x - gap / rate if rate else math.nan
        if not low < x < high:
            x = 0.5 * (low + high)
            if x in (low, high):
                break
    # At a jump or in noise both sides enclose values that the output never has.
    if not least <= STEEPEST * problem.scales[0]:
        return None
    if not -math.inf < found[n] < math.inf:
        found = _beside(problem, best, others) or found
    return problem.wrapped((best, *others)), tuple(found[n:])


def _beside(problem: InverseProblem, x: float, others: Sequence[float] = ()
            ) -> Optional[Sequence[float]]:
    """Return outputs and rates at the nearest float that has rates, for an end of a segment."""
    near = (x + side * 2.0 ** k * math.ulp(x) for k in range(MAX_STEPS // 2) for side in (1, -1))
    rows = (problem.rated.at(y, *others) for y in near)
    return next((row for row in rows if math.isfinite(row[problem.n])), None)


def _step(problem: InverseProblem, gaps: Sequence[float], row: Sequence[float]) -> Sequence[float]:
    """Return the step of Newton's method; NaN where the Jacobian is singular."""
    n = problem.n
    if n == 2:
        a, b, c, d = row[2:]
        det = a * d - b * c
        return ((gaps[0] * d - gaps[1] * c) / det, (gaps[1] * a - gaps[0] * b) / det) if det else (
            math.nan,)
    return _step_arrays(problem, np.reshape(gaps, (n, 1)), np.reshape(row, (-1, 1)))[:, 0].tolist()


def refine_arrays(problem: InverseProblem, values: np.ndarray, inputs: np.ndarray,
                  bracket: Optional[Bracket] = None) -> Tuple[np.ndarray, np.ndarray]:
    """
    Return what `refine` does for columns of values and of candidates.

    Both have the shape (inputs, m), those of a bracket (m,). The solutions have the shape
    (inputs, m), their rates (inputs * outputs, m); NaN where there is none.
    """
    n, count = problem.n, values.shape[1]
    found, least = np.full((2 * n + n * n, count), np.nan), np.full(count, np.inf)
    going = np.flatnonzero(np.isfinite(inputs).all(axis=0)) if not bracket else np.arange(count)
    if bracket:
        low, high, seed, sign = bracket
        inputs = np.where((low <= seed) & (seed <= high), seed, 0.5 * (low + high))[None]
    else:
        inputs = inputs[:, going]
    for _ in range(MAX_STEPS):
        with np.errstate(all='ignore'):
            rows = problem.over(*inputs)
            gaps = _gaps(problem, rows, values[:, going])
            error = _errors(problem, gaps, rows, inputs)
            better = error < least[going]
            at = going[better]
            least[at] = error[better]
            found[:n, at], found[n:, at] = inputs[:, better], rows[:, better]
            more = ~(error <= ROUNDED) & (
                better | (least[going] > ACCEPTED) if bracket else better)
            if bracket:
                x, behind = inputs[0], gaps[0] * sign < 0.0
                low, high = np.where(behind, x, low), np.where(behind, high, x)
                guess, middle = x - gaps[0] / rows[1], 0.5 * (low + high)
                inside = (low < guess) & (guess < high)
                more &= inside | ((low < middle) & (middle < high))
                low, high, sign = low[more], high[more], sign[more]
                inputs = np.where(inside, guess, middle)[None, more]
            else:
                step = _step_arrays(problem, gaps, rows)
                more &= (error <= OTHER / _UNIT) & (
                    np.abs(step) <= LONGEST * np.reshape(problem.sizes, (n, 1))).all(axis=0)
                inputs = (inputs - step)[:, more]
        going = going[more]
        if not len(going):
            break
    accepted = least <= ACCEPTED
    if bracket:
        with np.errstate(invalid='ignore'):
            accepted |= np.abs(_gaps(problem, found[1:], values)[0]) <= (
                STEEPEST * problem.scales[0])
        for place in np.flatnonzero(accepted & ~np.isfinite(found[2])):
            found[2, place] = (_beside(problem, float(found[0, place])) or found[1:, place])[1]
    found[:, ~accepted] = np.nan
    return problem.wrapped_arrays(found[:n]), found[2 * n:]


def _gaps(problem: InverseProblem, rows: np.ndarray, values: np.ndarray) -> np.ndarray:
    gaps = rows[:problem.n] - values
    for gap, turn in zip(gaps, problem.periods):
        if turn < math.inf:
            gap -= turn * np.rint(gap / turn)
    return gaps


def _errors(problem: InverseProblem, gaps: np.ndarray, rows: np.ndarray,
            inputs: np.ndarray) -> np.ndarray:
    """Return the largest of the outputs' errors in units of their rounding, for columns."""
    n, errors = problem.n, []
    weights = [np.maximum(np.abs(x), size) for x, size in zip(inputs, problem.sizes)]
    for i, (gap, scale) in enumerate(zip(gaps, problem.scales)):
        rounding = scale + sum(np.abs(rate) * weight for rate, weight in zip(
            rows[n + i::n], weights))
        # Where a pose has no rates, they explain nothing.
        most = scale * (STEEPEST / (ACCEPTED * _UNIT))
        errors.append(np.abs(gap) / (_UNIT * np.where(np.isnan(rounding), scale, np.minimum(
            rounding, most))))
    return np.max(errors, axis=0) if n > 1 else errors[0]


def _step_arrays(problem: InverseProblem, gaps: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return what `_step` does for columns."""
    n = problem.n
    if n == 2:
        a, b, c, d = rows[2:]
        return np.stack([gaps[0] * d - gaps[1] * c, gaps[1] * a - gaps[0] * b]) / (a * d - b * c)
    jacobian = rows[n:].reshape(n, n, rows.shape[1]).T
    jacobian[~np.isfinite(jacobian).all(axis=(1, 2))] = np.eye(n)
    singular = np.linalg.det(jacobian) == 0.0
    jacobian[singular] = np.inf * np.eye(n)
    return np.linalg.solve(jacobian, gaps.T[..., None])[..., 0].T


def same(problem: InverseProblem, one: Found, other: Found) -> bool:
    """Return whether two solutions are one."""
    for x, y, turn, size in zip(one[0], other[0], problem.turns, problem.sizes):
        if NEIGHBOURS * size < abs(x - y) < turn - NEIGHBOURS * size:
            return False
    steps = [math.remainder(x - y, turn) for x, y, turn in zip(one[0], other[0], problem.turns)]
    apart = max([abs(step) / size for step, size in zip(steps, problem.sizes)])
    if not SPECIAL < apart <= NEIGHBOURS:
        return apart <= SPECIAL
    n = problem.n
    return any(all(abs(sum(rate * step for rate, step in zip(rates[i::n], steps)))
                   <= SPECIAL * scale for i, scale in enumerate(problem.scales))
               for _, rates in (one, other))


def distinct(problem: InverseProblem, solutions: Sequence[Found]) -> List[Found]:
    """Return solutions in order, one of those that are one."""
    found: List[Found] = []
    for solution in sorted(solutions):
        # Of one input only neighbours can be one, a turn apart too.
        beside = found if problem.n > 1 else found[-1:] + found[:1]
        if not any([same(problem, solution, other) for other in beside]):
            found.append(solution)
    return found


def distinct_arrays(problem: InverseProblem, inputs: np.ndarray, rates: np.ndarray
                    ) -> Tuple[np.ndarray, np.ndarray]:
    """Return solutions (solutions, inputs, m) in order, without those that are one of others."""
    def ordered() -> None:
        order = np.lexsort(np.nan_to_num(inputs, nan=np.inf).swapaxes(0, 1)[::-1], axis=0)
        for part in (inputs, rates):
            part[:] = np.take_along_axis(part, order[:, None], 0)

    ordered()
    count, places = len(inputs), np.arange(inputs.shape[2])
    last = np.isfinite(inputs[:, 0]).sum(axis=0).clip(1) - 1
    # Of one input only neighbours can be one, a turn apart too.
    pairs = [(k, np.full_like(last, i)) for k, i in combinations(range(count), 2)
             if problem.n > 1 or k + 1 == i] + [(0, last)] * (count > 1)
    for k, i in pairs:
        apart = np.max([problem.apart(by, inputs[k, by], inputs[i, by, places])
                        for by in range(problem.n)], axis=0)
        for place in np.flatnonzero((apart <= NEIGHBOURS) & (i > k)):
            one, other = ((tuple(inputs[j, :, place].tolist()), tuple(rates[j, :, place].tolist()))
                          for j in (k, i[place]))
            if same(problem, one, other):
                inputs[i[place], :, place] = rates[i[place], :, place] = math.nan
    ordered()
    most = max(int(np.isfinite(inputs[:, 0]).sum(axis=0).max(initial=0)), 1)
    return inputs[:most], rates[:most]
