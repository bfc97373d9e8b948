# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Curves over an input: samples, sign changes and extremes.

All results are refined together, in brackets that are divided repeatedly: a curve is evaluated a
few dozen times for any number of results.
"""

from __future__ import annotations

import math
from typing import Callable

import numpy as np

from ..tolerances import MIN_ANGLE

# Even samples of a whole turn; halvings of a distance after which few of its digits are left.
TURN_SAMPLES, HALVINGS = 360, 48
# Fractions at which a bracket is divided; an odd number of them, so that one is its middle.
CUTS = np.arange(1, 16) / 16


def sampled(lo: float, hi: float, count: int = 0) -> np.ndarray:
    """Return angles [rad] on an arc, evenly spaced, with more of them towards both ends."""
    even = np.linspace(lo, hi, count or max(9, math.ceil(TURN_SAMPLES * (hi - lo) / math.tau)))
    steps = (hi - lo) * 0.5 ** np.arange(2, HALVINGS)
    return ascending(np.clip(np.concatenate([even, lo + steps, hi - steps]), lo, hi))


def ascending(values: np.ndarray) -> np.ndarray:
    """Return values in order, each once; np.unique would take 8 ms to import masked arrays."""
    values = np.sort(values)
    return values[np.append(True, values[1:] > values[:-1])]


def refined(test: Callable, lo: np.ndarray, hi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """
    Return, for each bracket, the last angle that passes a test and the first that fails it.

    The test takes angles [rad] (brackets, n) and returns whether each passes. It passes at `lo`
    and fails at `hi`, which may be less than `lo`. The results are neighbouring floats.
    """
    lo, hi = np.array(lo, float), np.array(hi, float)
    row = np.arange(len(lo))
    while np.any((abs(hi - lo) > MIN_ANGLE) & (hi != np.nextafter(lo, hi))):
        theta = lo[:, None] + (hi - lo)[:, None] * CUTS
        same = test(theta)
        first = np.where(same.all(axis=1), len(CUTS), np.argmin(same, axis=1))
        edges = np.column_stack([lo, theta, hi])
        lo, hi = edges[row, first], edges[row, first + 1]
    return lo, hi


def lowest(curve: Callable, lo: np.ndarray, hi: np.ndarray, steps: int = 10) -> np.ndarray:
    """
    Return, for each bracket, the angle [rad] of a curve's minimum, to half of all digits.

    The curve takes angles, shape (brackets, n), and returns as many values.
    """
    lo, hi = np.array(lo, float), np.array(hi, float)
    row = np.arange(len(lo))
    for _ in range(steps if len(lo) else 0):
        edges = np.column_stack([lo, lo[:, None] + (hi - lo)[:, None] * CUTS, hi])
        value = curve(edges)
        best = np.argmin(np.where(np.isnan(value), np.inf, value), axis=1).clip(1, len(CUTS))
        lo, hi = edges[row, best - 1], edges[row, best + 1]
    return 0.5 * (lo + hi)


def near_misses(values: np.ndarray) -> np.ndarray:
    """
    Return 1 or -1 where a pair of zeros may lie next to a sample, for all but the outer samples.

    There a curve's distance from zero, times this sign, has a minimum that is small compared with
    its bend. Elsewhere, and where the curve is straight, it is 0.
    """
    before, inner, after = values[..., :-2], values[..., 1:-1], values[..., 2:]
    with np.errstate(invalid='ignore'):
        bend = before - 2.0 * inner + after
        sign = np.sign(bend)
        return np.where((sign * before >= sign * inner) & (sign * after >= sign * inner)
                        & (0.0 <= sign * inner) & (sign * inner <= sign * bend), sign, 0.0)


def turning_points(values: np.ndarray, rates: np.ndarray, rounding: float) -> np.ndarray:
    """
    Return the samples after which a curve has an extreme.

    An extreme lies between samples with rates of opposite signs. Two successive ones that differ
    by no more than `least` are rounding, and are omitted.
    """
    rising = np.asarray(rates) >= 0.0
    places: list = []
    for i in np.flatnonzero(rising[1:] != rising[:-1]).tolist():
        if places and abs(values[i] - values[places[-1]]) <= rounding:
            places.pop()
        else:
            places.append(i)
    return np.array(places, np.intp)


def extremes(curve: Callable, lo: float, hi: float, is_angle: bool = False
             ) -> list[tuple[float, float]]:
    """
    Return the minimum of an output on an arc and its place, then the maximum and its place.

    The curve takes values of an input (n,) and returns those of the output (n,); an angle [rad]
    continues past -pi and pi.
    """
    theta = np.linspace(lo, hi, TURN_SAMPLES + 1)
    value = curve(theta)
    known = np.isfinite(value)
    if is_angle:
        value[known] = np.unwrap(value[known])
    pairs = []
    for sign in (-1.0, 1.0):
        height = np.where(known, sign * value, -np.inf)
        around = np.pad(height, 1, constant_values=-np.inf)
        best = np.flatnonzero((height >= around[:-2]) & (height >= around[2:]))
        top = value[best, None]

        def depth(x: np.ndarray, sign: float = sign, top: np.ndarray = top) -> np.ndarray:
            """Return how far the curve is below zero, or above for a minimum, next to a top."""
            now = curve(x.ravel()).reshape(x.shape)
            return -sign * (now + math.tau * np.round((top - now) / math.tau) if is_angle else now)

        refined_at = lowest(depth, theta[(best - 1).clip(0)],
                            theta[(best + 1).clip(max=TURN_SAMPLES)])
        heights = np.append(sign * top[:, 0], -depth(refined_at[:, None])[:, 0])
        highest = np.where(np.isfinite(heights), heights, -np.inf).argmax()
        pairs.append((float(sign * heights[highest]),
                      float(np.append(theta[best], refined_at)[highest])))
    return pairs
