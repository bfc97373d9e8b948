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
from typing import Any, Callable, List, Optional, Sequence, Tuple

import numpy as np

from .problem import Found, InverseProblem
from .segments import Bracket, ULPS
from ..motion.curves import HALVINGS
from ..tolerances import ONE, SINGULAR

# Errors relative to the output's size and the inputs times the rates: where refinement stops; and
# the largest of a solution.
ROUNDED, ACCEPTED = 2.0 ** -52, ULPS * 2.0 ** -53
# A larger error [sizes], or a longer step [rad, sizes], leads to another solution.
FAR = 0.1


def refine(problem: InverseProblem, values: Sequence[float], candidate: Sequence[Any]
           ) -> Optional[Found]:
    """
    Return the solution at a candidate, with its rates; None if there is none.

    A candidate is a `Bracket` of one input, values of several inputs, or a solution.
    """
    if isinstance(candidate[0], tuple):
        return problem.wrapped(candidate[0]), candidate[1]
    if problem.n == 1:
        inside = refine_inside(problem.forward.at, values[0], problem.periods[0],
                               problem.scales[0], problem.sizes[0], candidate)
        return inside and (problem.wrapped(inside[:1]), inside[1:])
    inputs, at, n, least, found = tuple(candidate), problem.forward.at, problem.n, math.inf, None
    step: Sequence[float] = ()
    if not math.isfinite(sum(at(*inputs)[:n])):
        # Rounding may have led out of the reach.
        near = ((*inputs[:by], inputs[by] + ulps * math.ulp(inputs[by]), *inputs[by + 1:])
                for ulps in (2.0, -2.0, 16.0, -16.0) for by in range(n))
        inputs = next((x for x in near if math.isfinite(sum(at(*x)[:n]))), inputs)
    for _ in range(HALVINGS):
        row = at(*inputs)
        gaps = [math.remainder(y - x, turn) if -math.inf < y < math.inf else math.nan
                for y, x, turn in zip(row, values, problem.periods)]
        error = max([abs(gap) / scale for gap, scale in zip(gaps, problem.scales)])
        error += 0.0 * sum(gaps)  # NaN if one is
        if found and error != error:
            # The step leads out of the reach.
            step = [0.5 * by for by in step]
            inputs = tuple([x - by for x, by in zip(found[0], step)])
            continue
        if not error < least:
            break
        least, found = error, (inputs, row, gaps)
        if not ROUNDED < error <= FAR:
            break
        step = _step(problem, gaps, row)
        if not sum([abs(x) / size for x, size in zip(step, problem.sizes)]) <= FAR:
            break
        inputs = tuple([x - by for x, by in zip(inputs, step)])
    # Where rates are low, rounding is that of the outputs alone.
    if not found or least > ACCEPTED and not (least <= SINGULAR and _errors(
            problem, *(np.reshape(part, (-1, 1)) for part in (
                found[2], found[1], found[0])))[0] <= ACCEPTED):
        return None
    return problem.wrapped(found[0]), found[1][n:]


def refine_inside(at: Callable, value: float, period: float, scale: float, size: float,
                  bracket: Bracket) -> Optional[Tuple[float, float]]:
    """
    Return the input in a bracket at which an output has a value, and the rate; None if none.

    `at` returns the output and its rate. Newton's method stays inside the bracket.
    """
    low, high, x, sign = bracket
    x, best, least = x if low <= x <= high else 0.5 * (low + high), (math.nan, math.nan), math.inf
    most = SINGULAR / ACCEPTED * scale
    for _ in range(HALVINGS):
        output, rate = at(x)
        gap = output - value
        if not -period <= 2.0 * gap <= period:
            gap = math.remainder(gap, period) if -math.inf < gap < math.inf else math.nan
        rounding = min(scale + abs(rate) * max(abs(x), size), most)
        if abs(gap) < least:
            least, best = abs(gap), (x, rate)
            if least <= ROUNDED * rounding:
                break
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
    x, rate = best
    if not -math.inf < rate < math.inf:
        # At an end of a segment, those of the nearest float that has rates.
        near = (x + side * 2.0 ** k * math.ulp(x) for k in range(HALVINGS // 2)
                for side in (1, -1))
        rate = next(filter(math.isfinite, (at(y)[1] for y in near)), rate)
    return x, rate


def _step(problem: InverseProblem, gaps: Sequence[float], row: Sequence[float]) -> Sequence[float]:
    """Return the step of Newton's method; NaN where the Jacobian is singular."""
    n = problem.n
    if n == 2:
        a, b, c, d = row[2:]
        det = a * d - b * c
        return ((gaps[0] * d - gaps[1] * c) / det, (gaps[1] * a - gaps[0] * b) / det) if det else (
            math.nan,)
    return _step_arrays(problem, np.reshape(gaps, (n, 1)), np.reshape(row, (-1, 1)))[:, 0].tolist()


def refine_arrays(problem: InverseProblem, values: np.ndarray, candidates: np.ndarray
                  ) -> np.ndarray:
    """
    Return what `refine` does for columns of values (outputs, m) and of candidates.

    The solutions have the shape (inputs and rates, m), NaN where there is none.
    """
    n, inputs = problem.n, candidates
    # What closed forms lose next to a singular pose; more is another assembly.
    far = math.inf if n == 1 else SINGULAR
    with np.errstate(all='ignore'):
        if n == 1:
            # Estimates need a step; closed forms may be right.
            low, high, seed, _ = candidates
            inputs = np.where((low <= seed) & (seed <= high), seed, 0.5 * (low + high))[None]
            rows = problem.over(*inputs)
            inputs = np.fmin(np.fmax(
                inputs - _step_arrays(problem, _gaps(problem, rows, values), rows), low), high)
        rows = problem.over(*inputs)
        gaps = _gaps(problem, rows, values)
        error = _errors(problem, gaps, rows, inputs)
        again = np.flatnonzero((error > ROUNDED) & (error <= far))
        x = inputs[:, again] - _step_arrays(problem, gaps[:, again], rows[:, again])
        new = problem.over(*x)
        less = _errors(problem, _gaps(problem, new, values[:, again]), new, x)
        better, beyond = less < error[again], again[np.isnan(less)]
        if n == 1:
            better &= (low[again] <= x[0]) & (x[0] <= high[again])
        again = again[better]
        inputs[:, again], rows[:, again], error[again] = x[:, better], new[:, better], less[better]
        # A part needs more steps, shorter ones at an end of the reach, or rates from beside it.
        left = ~(error <= ACCEPTED) | ~np.isfinite(rows[1]) if n == 1 else ~(
            (error <= ACCEPTED) | (error > far))
        left[beyond] = True
    solutions = np.concatenate([problem.wrapped_arrays(inputs), rows[n:]])
    solutions[:, ~(error <= ACCEPTED)] = np.nan
    for k in np.flatnonzero(left).tolist():
        found = refine(problem, values[:, k].tolist(), candidates[:, k].tolist())
        solutions[:, k] = (*found[0], *found[1]) if found else math.nan
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
    return np.max(errors, axis=0) if n > 1 else errors[0]


def _step_arrays(problem: InverseProblem, gaps: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return what `_step` does for columns."""
    n = problem.n
    if n == 1:
        return gaps / rows[1]
    if n == 2:
        a, b, c, d = rows[2:]
        return np.stack([gaps[0] * d - gaps[1] * c, gaps[1] * a - gaps[0] * b]) / (a * d - b * c)
    jacobian = rows[n:].reshape(n, n, rows.shape[1]).T
    with np.errstate(all='ignore'):
        jacobian[~(np.abs(np.linalg.det(jacobian)) > 0.0)] = np.nan
    return np.linalg.solve(jacobian, gaps.T[..., None])[..., 0].T


def same(problem: InverseProblem, one: Found, other: Found) -> bool:
    """
    Return whether two solutions are one.

    They are if they are as near as ONE, or if they are nearly as near as half of all digits and
    the rates say that the outputs differ by no more than ONE.
    """
    for x, y, turn, size in zip(one[0], other[0], problem.turns, problem.sizes):
        if SINGULAR * size < abs(x - y) < turn - SINGULAR * size:
            return False
    steps = [math.remainder(x - y, turn) for x, y, turn in zip(one[0], other[0], problem.turns)]
    return max([abs(step) / size for step, size in zip(steps, problem.sizes)]) <= ONE or any(
        all(abs(sum(rate * step for rate, step in zip(rates[i::problem.n], steps))) <= ONE * scale
            for i, scale in enumerate(problem.scales)) for _, rates in (one, other))


def distinct(problem: InverseProblem, solutions: Sequence[Found]) -> List[Found]:
    """Return solutions in order, one of those that are one."""
    found: List[Found] = []
    for solution in sorted(solutions):
        # Of one input only neighbours can be one, a turn apart too.
        others = found if problem.n > 1 else found[-1:] + found[:1]
        if not any(same(problem, solution, other) for other in others):
            found.append(solution)
    return found


def distinct_arrays(problem: InverseProblem, solutions: np.ndarray) -> np.ndarray:
    """Return solutions (solutions, inputs and rates, m) in order, one of those that are one."""
    n, solutions = problem.n, _ordered(problem, solutions)
    pairs = np.triu_indices(len(solutions), 1)
    apart = np.max([problem.distance(by, *(solutions[k, by] for k in pairs)) for by in range(n)],
                   axis=0)
    for k in np.flatnonzero((apart <= SINGULAR).any(axis=0)).tolist():
        several = distinct(problem, [(tuple(x[:n]), tuple(x[n:]))
                                     for x in solutions[:, :, k].tolist() if x[0] == x[0]])
        solutions[:, :, k] = math.nan
        solutions[:len(several), :, k] = [(*inputs, *rates) for inputs, rates in several]
    return solutions[:max(int(np.isfinite(solutions[:, 0]).any(axis=1).sum()), 1)]


def _ordered(problem: InverseProblem, solutions: np.ndarray) -> np.ndarray:
    first = np.where(np.isnan(solutions[:, 0]), np.inf, solutions[:, 0])
    if problem.n == 1 and (first[1:] >= first[:-1]).all():
        return solutions
    order = np.lexsort(solutions[:, :problem.n].swapaxes(0, 1)[::-1], axis=0)
    return np.take_along_axis(solutions, order[:, None], 0)
