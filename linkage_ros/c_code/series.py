# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Inverses without a closed form, as power series in parts of the reach."""

import math

import numpy as np
from numpy.polynomial import chebyshev, polynomial

from ..linkage import Mechanism

# Terms of a series in double and in single precision, as in `linkage.h`, and how far it may miss
# an output [rad, longest bar]: so little that its pose needs no correction.
TERMS, CLOSE = (20, 8), (4e-15, 1e-7)
# Where an input's last digit changes the output by more, it may miss by so many times that; inputs
# of a piece that is shorter are next to an end of the reach.
DIGITS, SHORTEST = 16.0, 1e-5
# Halvings of a piece that bring an input to its rounding.
HALVINGS = 60
# Pieces at most: a curve that needs more is rounding.
MAX_PIECES = 10_000


def series(linkage: Mechanism, output: str, parts: np.ndarray, single: bool,
           scale: float = 1.0) -> np.ndarray:
    """
    Return the pieces of parts in which an output only rises or only falls: inputs and outputs.

    Each row is an `lkr_piece` of `linkage.h`, with `scale` times the inputs of the linkage. The
    root in it makes the input smooth where the output has an extreme.

    Raises
    ------
    ValueError
        If there are too many.

    """
    unit, pose = linkage.inputs[0].size, linkage.compiled_pose((), (output,))
    is_angle, terms = linkage.is_angle(output), TERMS[single]
    size = 1.0 if is_angle else linkage.longest
    nodes = chebyshev.chebpts1(terms)
    # From coefficients of Chebyshev polynomials to those of powers.
    powers = np.column_stack([np.pad(chebyshev.cheb2poly(row), (0, terms - 1 - i))
                              for i, row in enumerate(np.eye(terms))])
    # Ever denser towards both ends.
    samples = np.tanh(np.linspace(-18.0, 18.0, 129))

    def passed(inputs: np.ndarray, end: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Return which parts of a change from an end the output has behind it."""
        ahead = pose.over(unit * inputs)[0] - end
        return (ahead - is_angle * math.tau * np.round((ahead - 0.5 * change) / math.tau)) / change

    def halved(target: np.ndarray, start: np.ndarray, stop: np.ndarray, *change: np.ndarray
               ) -> np.ndarray:
        """Return where parts are those of a target, by halving."""
        below, above = np.full_like(target, start), np.full_like(target, stop)
        for _ in range(HALVINGS):
            inputs = 0.5 * (below + above)
            is_below = passed(inputs, *change) < target
            below, above = np.where(is_below, inputs, below), np.where(is_below, above, inputs)
        return below

    # Each part in two halves, from its ends to where the output is half way.
    low, high, first, last = (parts / [unit, unit, 1.0, 1.0]).T[..., None]
    cut = halved(np.full_like(low, 0.5), low, high, first, last - first)
    halves = np.vstack([np.hstack([start, cut, end, 0.5 * (first + last) - end])
                        for start, end in ((low, first), (high, last))])
    # Half way between neighbouring floats is one of them: there the output does not change.
    halves = halves[halves[:, 3] != 0.0]
    rows = np.empty((0, 7 + terms))
    # Between roots of the parts of a half's change: those that are too long are cut in two.
    half_of, roots = np.arange(len(halves)), np.tile([0.0, 1.0], (len(halves), 1))
    while len(half_of):
        if len(rows) + len(half_of) > MAX_PIECES:
            raise ValueError(f'{output} of {linkage.type} has no inverse: it has no closed form, '
                             f'and a series of more than {MAX_PIECES} pieces')
        start, cut, end, change = halves[half_of].T[..., None]
        center, half = roots.mean(axis=1, keepdims=True), 0.5 * np.diff(roots)
        squares = roots ** 2
        bounds = np.sort(halved(squares, start, cut, end, change))
        fitted = powers @ chebyshev.chebfit(nodes, halved(
            (center + half * nodes) ** 2, start, cut, end, change).T, terms - 1)
        inputs = polynomial.polyval(samples, fitted).clip(
            np.minimum(start, cut), np.maximum(start, cut))
        reached = passed(inputs, end, change)
        residual, digit = (np.abs(others - reached).max(axis=1, keepdims=True) for others in (
            (center + half * samples) ** 2, passed(np.nextafter(inputs, cut), end, change)))
        is_done = ((residual <= np.maximum(CLOSE[single] * size / np.abs(change), DIGITS * digit))
                   | (np.diff(bounds) < SHORTEST))[:, 0]
        middle = change * squares.mean(axis=1, keepdims=True)
        steepness = 1.0 / (change * half * half)
        pieces = np.hstack([
            end + middle, 0.5 * np.abs(change) * np.diff(squares),
            unit * scale * bounds, steepness,
            middle * steepness, center / half, unit * scale * fitted.T.round(17)])
        rows = np.vstack([rows, pieces[is_done]])
        ends = np.insert(roots[~is_done], [1], center[~is_done], axis=1)
        roots = np.vstack([ends[:, :2], ends[:, 1:]])
        half_of = np.tile(half_of[~is_done], 2)
    return rows[rows[:, 2].argsort(kind='stable')]
