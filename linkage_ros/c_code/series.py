# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Inverses without a closed form, as series of Chebyshev polynomials in parts of the reach."""

import math
from typing import Any, Iterator, Tuple

import numpy as np
from numpy.polynomial import chebyshev

from ..linkage import Mechanism

# Terms of a series, as in `linkage.h`; how far it may miss an output [rad, longest bar], and the
# shortest piece of an input [rad, sizes], next to an end of the reach.
TERMS, CLOSE, SHORTEST = 16, 1e-7, 1e-5
# Halvings of a piece that bring an input to its rounding.
HALVINGS = 60


def series(linkage: Mechanism, output: str, low: float, high: float, first: float, last: float
           ) -> Iterator[Tuple[float, float, float, float, np.ndarray]]:
    """
    Yield the middle and half the change of an output, both ends of the input, and the terms.

    From one input to the other the output only rises or only falls, from `first` to `last`. The
    series is one of the output's arcsine, which is smooth where the output is at an extreme and
    at an end of the reach.
    """
    pose, is_angle = linkage.posed((), (output,)), linkage.is_angle(output)
    middle, half = 0.5 * (first + last), 0.5 * (last - first)

    def change(inputs: np.ndarray) -> np.ndarray:
        """Return how far the output is from its middle value."""
        gap = pose.over(inputs)[0] - middle
        return gap - math.tau * np.round(gap / math.tau) if is_angle else gap

    def inverse(x: np.ndarray) -> Any:
        """Return where the output has parts of its arcsine, from the middle input, by halving."""
        below, above = np.full(x.shape, low), np.full(x.shape, high)
        for _ in range(HALVINGS):
            inputs = 0.5 * (below + above)
            is_below = change(inputs) / half < np.sin(0.5 * math.pi * x)
            below, above = np.where(is_below, inputs, below), np.where(is_below, above, inputs)
        return below - cut

    cut = 0.5 * (low + high)
    terms = chebyshev.chebinterpolate(inverse, TERMS - 1)
    terms[0] += cut
    # Ever denser towards both ends.
    x = np.tanh(np.linspace(-18.0, 18.0, 8 * TERMS + 1))
    missed = change(chebyshev.chebval(x, terms).clip(low, high)) - half * np.sin(
        0.5 * math.pi * x)
    size = 1.0 if is_angle else linkage.longest
    if np.abs(missed).max() <= CLOSE * size or high - low < SHORTEST * linkage.inputs[0].size:
        yield middle, half, low, high, terms
        return
    value = middle + float(change(np.array([cut]))[0])
    yield from series(linkage, output, low, cut, first, value)
    yield from series(linkage, output, cut, high, value, last)
