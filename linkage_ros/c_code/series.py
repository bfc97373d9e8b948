# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Inverses without a closed form, as series of Chebyshev polynomials in parts of the reach."""

import math
from typing import Iterator, Sequence, Tuple

import numpy as np
from numpy.polynomial import chebyshev

from ..linkage import Mechanism

# Terms of a series in double and in single precision, as in `linkage.h`, and how far it may miss
# an output [rad, longest bar]: so little that its pose needs no correction.
TERMS, CLOSE = (20, 8), (4e-15, 1e-7)
# Where rounding of the poses allows no less, a short piece may miss by more, which Newton's method
# corrects; the shortest one is next to an end of the reach.
CORRECTED, SHORT, SHORTEST = 1e-9, 1.0 / 32.0, 1e-5
# Halvings of a piece that bring an input to its rounding.
HALVINGS = 60


def series(linkage: Mechanism, output: str, part: Sequence[float], single: bool
           ) -> Iterator[Tuple[np.ndarray, np.ndarray]]:
    """
    Yield the pieces of a part, in which an output only rises or only falls: inputs and outputs.

    Each is an `lkr_piece` of `linkage.h`, with inputs in their sizes: the numbers before its
    terms, and the terms. The root in it makes the input smooth where the output has an extreme.
    """
    unit = linkage.inputs[0].size
    low, high, first, last = np.divide(part, [unit, unit, 1.0, 1.0])
    pose, is_angle = linkage.posed((), (output,)), linkage.is_angle(output)
    size, terms = 1.0 if is_angle else linkage.longest, TERMS[single]
    # A fast link's angle has the rounding of the input, times its speed.
    close = max(CLOSE[single], linkage.inputs[0].speed * CLOSE[False])
    nodes = chebyshev.chebpts1(terms)
    # Ever denser towards both ends.
    checked = np.tanh(np.linspace(-18.0, 18.0, 129))

    def parts(inputs: np.ndarray, end: float, change: float) -> np.ndarray:
        """Return which parts of a change from an end the output has behind it."""
        gap = pose.over(unit * inputs)[0] - end
        return (gap - is_angle * math.tau * np.round((gap - 0.5 * change) / math.tau)) / change

    def halved(wanted: np.ndarray, start: float, stop: float, *change: float) -> np.ndarray:
        """Return where parts are wanted ones, by halving."""
        below, above = np.full_like(wanted, start), np.full_like(wanted, stop)
        for _ in range(HALVINGS):
            inputs = 0.5 * (below + above)
            is_below = parts(inputs, *change) < wanted
            below, above = np.where(is_below, inputs, below), np.where(is_below, above, inputs)
        return below

    cut, = halved(np.array([0.5]), low, high, first, last - first)
    for start, end in ((low, first), (high, last)):
        change, roots = 0.5 * (first + last) - end, [(0.0, 1.0)]
        while roots:
            before, after = roots.pop()
            center, half = 0.5 * (before + after), 0.5 * (after - before)
            fitted = chebyshev.chebfit(nodes, halved(
                (center + half * nodes) ** 2, start, cut, end, change), terms - 1)
            inputs = chebyshev.chebval(checked, fitted).clip(*sorted((start, cut)))
            missed = np.abs(parts(inputs, end, change) - (center + half * checked) ** 2).max()
            enough = close if half > SHORT else max(close, CORRECTED)
            if missed * abs(change) <= enough * size or half < SHORTEST:
                squares = np.square([before, after])
                middle, reach = change * squares.mean(), 0.5 * abs(change) * np.ptp(squares)
                left, right = sorted(halved(squares, start, cut, end, change))
                scale = 1.0 / (change * half * half)
                yield np.array([end + middle, reach, left, right, scale, middle * scale,
                                center / half]), fitted
            else:
                roots += [(center, after), (before, center)]
