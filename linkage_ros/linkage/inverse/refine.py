# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
From candidates to solutions: Newton's method on the forward formula, and one judgement.

A candidate is a solution if the outputs there have their values up to rounding: that of the
outputs, and that of the inputs times their rates. `refine` works on floats, `refine_arrays` does
the same on arrays. Where a bracket is known, Newton's method stays inside it.
"""

from __future__ import annotations

import math
from typing import Any, List, Optional, Sequence, Tuple, Union

import numpy as np

from .problem import InverseProblem, Row
from .segments import Bracket, ULPS
from ..motion.curves import HALVINGS
from ..tolerances import ONE, SINGULAR

# Errors relative to the output's size and the inputs times the rates: where refinement stops; and
# the largest of a solution.
ROUNDED, ACCEPTED = 2.0 ** -52, ULPS * 2.0 ** -53
# A larger error [sizes], or a longer step [rad, sizes], leads to another solution.
FAR = 0.1
# Steps of arrays: what is not refined then is refined one by one.
STEPS = 3
# Parts of a step.
HALVES = [0.5 ** k for k in range(HALVINGS)]

# The largest error of the outputs [sizes], the errors, the outputs and rates, and the inputs.
Trial = Tuple[float, Sequence[float], Row, Row]


def refine(problem: InverseProblem, values: Sequence[float], candidate: Union[Bracket, Row]
           ) -> Optional[Row]:
    """Return the solution at a candidate, its inputs and rates; None if there is none."""
    if isinstance(candidate, Bracket):
        return _refine_inside(problem, values, candidate)
    best, n = _trial(problem, values, candidate), problem.n
    if best[0] == math.inf:
        # Rounding may have led out of the reach.
        near = (_trial(problem, values, (
            *candidate[:by], candidate[by] + ulps * math.ulp(candidate[by]), *candidate[by + 1:]))
            for ulps in (2.0, -2.0, 16.0, -16.0) for by in range(n))
        best = next((trial for trial in near if trial[0] < math.inf), best)
    for _ in range(HALVINGS):
        error, gaps, row, inputs = best
        if not ROUNDED < error <= FAR:
            break
        step = _step(problem, gaps, row)
        if not sum([abs(x) / size for x, size in zip(step, problem.sizes)]) <= FAR:
            break
        # A step that leads out of the reach is halved.
        trials = (_trial(problem, values, tuple([
            float(x - part * by) for x, by in zip(inputs, step)])) for part in HALVES)
        trial = next((trial for trial in trials if trial[0] < math.inf), best)
        if not trial[0] < error:
            break
        best = trial
    error, *columns = best
    # Where rates are low, rounding is that of the outputs alone.
    if error > ACCEPTED and not (error <= SINGULAR and _errors(
            problem, *(np.reshape(part, (-1, 1)) for part in columns))[0] <= ACCEPTED):
        return None
    return *problem.wrapped(best[3]), *best[2][n:]


def _trial(problem: InverseProblem, values: Sequence[float], inputs: Row) -> Trial:
    """Return how far the outputs at some inputs are from their values, inf without a pose."""
    row = problem.forward.at(*inputs)
    if not math.isfinite(sum(row[:problem.n])):
        return math.inf, (), row, inputs
    gaps = [math.remainder(y - x, turn) for y, x, turn in zip(row, values, problem.periods)]
    return max([abs(gap) / scale for gap, scale in zip(gaps, problem.scales)]), gaps, row, inputs


def _refine_inside(problem: InverseProblem, values: Sequence[float], bracket: Bracket
                   ) -> Optional[Row]:
    """Return the solution in a bracket, which Newton's method does not leave; None if none."""
    low, high, x, sign, place, others = bracket
    n, value, at = problem.n, values[place], problem.rated.at
    period, scale, size = problem.periods[place], problem.scales[place], problem.sizes[0]
    x, least = x if low <= x <= high else 0.5 * (low + high), math.inf
    best: Tuple[float, Row] = x, ()
    most = SINGULAR / ACCEPTED * scale
    for _ in range(HALVINGS):
        row = at(x, *others)
        gap, rate = row[place] - value, row[place + n]
        if not -period <= 2.0 * gap <= period:
            gap = math.remainder(gap, period) if -math.inf < gap < math.inf else math.nan
        rounding = min(scale + abs(rate) * max(abs(x), size), most)
        if abs(gap) < least:
            least, best = abs(gap), (x, row)
        elif least <= ACCEPTED * rounding:
            break
        low, high = (x, high) if gap * sign < 0.0 else (low, x)
        x = x - gap / rate if rate else math.nan
        if not low < x < high:
            x = 0.5 * (low + high)
            if x in (low, high):
                break
    # At a jump or in noise both sides enclose values that the output never has.
    if not least <= SINGULAR * scale:
        return None
    x, row = best
    if not -math.inf < row[place + n] < math.inf:
        # At an end of a segment, rates are those of the nearest float that has them.
        near = (at(x + side * 2.0 ** k * math.ulp(x), *others) for k in range(HALVINGS // 2)
                for side in (1, -1))
        row = next((there for there in near if math.isfinite(there[place + n])), row)
    return *problem.wrapped((x, *others)), *row[n:]


def refine_arrays(problem: InverseProblem, values: np.ndarray, candidates: np.ndarray
                  ) -> np.ndarray:
    """
    Return what `refine` does for columns of values (outputs, m) and of candidates.

    The solutions have the shape (inputs and rates, m), NaN where there is none.
    """
    n, inputs = problem.n, candidates.copy()
    # What closed forms lose next to a singular pose; more is another assembly.
    far = math.inf if n == 1 else SINGULAR
    if n == 1:
        low, high, seed, _ = candidates
        inputs = np.where((low <= seed) & (seed <= high), seed, 0.5 * (low + high))[None]
    with np.errstate(all='ignore'):
        rows = problem.over(*inputs)
        error = _errors(problem, _gaps(problem, rows, values), rows, inputs)
        again, left = np.flatnonzero((error > 0.0) & (error <= far)), ~(error <= ACCEPTED)
        left &= ~(error > far)
        for _ in range(STEPS if len(again) else 0):
            x = inputs[:, again] - _step(
                problem, _gaps(problem, rows[:, again], values[:, again]), rows[:, again])
            if n == 1:
                x = np.fmin(np.fmax(x, candidates[0, again]), candidates[1, again])
            new = problem.over(*x)
            less = _errors(problem, _gaps(problem, new, values[:, again]), new, x)
            # Steps out of the reach are shortened one by one.
            left[again[np.isnan(less) & (error[again] > ROUNDED)]] = True
            better = less < error[again]
            again = again[better]
            inputs[:, again], rows[:, again] = x[:, better], new[:, better]
            error[again] = less[better]
            left[again] = ~(error[again] <= ACCEPTED)
        left |= ~np.isfinite(rows[n:]).all(axis=0)
    solutions = np.concatenate([problem.wrapped_arrays(inputs), rows[n:]])
    solutions[:, ~(error <= ACCEPTED)] = np.nan
    for k in np.flatnonzero(left).tolist():
        candidate = candidates[:, k].tolist()
        row = refine(problem, values[:, k].tolist(),
                     Bracket(*candidate) if n == 1 else tuple(candidate))
        solutions[:, k] = row or math.nan
    return solutions


def _gaps(problem: InverseProblem, rows: np.ndarray, values: np.ndarray) -> np.ndarray:
    gaps = rows[:problem.n] - values
    for gap, turn in zip(gaps, problem.periods):
        if turn < math.inf:
            gap -= turn * np.rint(gap / turn)
    return gaps


def _errors(problem: InverseProblem, gaps: np.ndarray, rows: np.ndarray,
            inputs: np.ndarray) -> np.ndarray:
    """Return the largest of the outputs' errors relative to their rounding, for columns."""
    n, errors = problem.n, []
    weights = [np.maximum(np.abs(x), size) for x, size in zip(inputs, problem.sizes)]
    for i, (gap, scale) in enumerate(zip(gaps, problem.scales)):
        rounding = scale + sum(np.abs(rate) * weight for rate, weight in zip(
            rows[n + i::n], weights))
        # Where a pose has no rates, they explain nothing.
        errors.append(np.abs(gap) / np.where(np.isnan(rounding), scale, np.minimum(
            rounding, scale * (SINGULAR / ACCEPTED))))
    return np.max(errors, axis=0)


def _step(problem: InverseProblem, gaps: Any, rows: Any) -> Any:
    """Return the step of Newton's method for numbers or columns; not finite if singular."""
    n = problem.n
    if n == 1:
        return gaps / rows[1]
    if n == 2:
        a, b, c, d = rows[2:]
        inverse = 1.0 / (a * d - b * c + 1e-300)
        return [(gaps[0] * d - gaps[1] * c) * inverse, (gaps[1] * a - gaps[0] * b) * inverse]
    jacobian = np.reshape(rows[n:], (n, n, -1)).T
    with np.errstate(all='ignore'):
        jacobian[~(np.abs(np.linalg.det(jacobian)) > 0.0)] = np.nan
        step = np.linalg.solve(jacobian, np.reshape(gaps, (n, -1)).T[..., None])
    return step[..., 0].T.reshape(np.shape(gaps))


def _same(problem: InverseProblem, one: Row, other: Row) -> bool:
    """
    Return whether two solutions are one.

    They are if they are as near as ONE, or if they are nearly as near as half of all digits and
    the rates say that the outputs differ by no more than ONE.
    """
    n = problem.n
    steps = [math.remainder(x - y, turn) for x, y, turn in zip(one, other, problem.turns)]
    away = max([abs(step) / size for step, size in zip(steps, problem.sizes)])
    return away <= ONE or away <= SINGULAR and any(
        all(abs(sum(rate * step for rate, step in zip(row[n + i::n], steps))) <= ONE * scale
            for i, scale in enumerate(problem.scales)) for row in (one, other))


def distinct(problem: InverseProblem, solutions: Sequence[Row]) -> List[Row]:
    """Return solutions in order, one of those that are one."""
    distinct: List[Row] = []
    for row in sorted(solutions):
        # Of one input only neighbours can be one, a turn apart too.
        others = distinct if problem.n > 1 else distinct[-1:] + distinct[:1]
        if not any(_same(problem, row, other) for other in others):
            distinct.append(row)
    return distinct


def distinct_arrays(problem: InverseProblem, solutions: np.ndarray) -> np.ndarray:
    """Return solutions (solutions, inputs and rates, m) in order, one of those that are one."""
    n = problem.n
    order = np.lexsort(solutions[:, :n].swapaxes(0, 1)[::-1], axis=0)
    solutions = np.take_along_axis(solutions, order[:, None], 0)
    pairs = np.triu_indices(len(solutions), 1)
    apart = np.max([problem.distance(by, *(solutions[k, by] for k in pairs)) for by in range(n)],
                   axis=0)
    for k in np.flatnonzero((apart <= SINGULAR).any(axis=0)).tolist():
        rows = distinct(problem, [row for row in map(tuple, solutions[:, :, k].tolist())
                                  if row[0] == row[0]])
        solutions[:, :, k] = math.nan
        solutions[:len(rows), :, k] = rows
    return solutions[:max(int(np.isfinite(solutions[:, 0]).any(axis=1).sum()), 1)]
