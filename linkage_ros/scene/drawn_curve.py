# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A curve as the points that draw it: the closer together, the more it bends."""

from __future__ import annotations

from typing import Callable

import numpy as np

from ..linkage import ROUNDING, sampled

# Even samples at first, rounds of division, and maximum number of samples.
DRAWN, DIVISIONS, MOST_DRAWN = 181, 30, 4000
# Tolerance, as a fraction of the curve's size.
CHORD = 1 / 600


def drawn(curve: Callable, lo: float, hi: float) -> np.ndarray:
    """
    Return points (n, 2) of a plane curve on an arc, the closer together the more it bends.

    The curve takes values of an input (m,) and returns points (m, 2), NaN where there is none.
    Between neighbours no point is farther from their chord than CHORD of the curve's size.
    """
    at = sampled(lo, hi, DRAWN)
    places = curve(at)
    parts = np.array([0.25, 0.5, 0.75])
    for _ in range(DIVISIONS):
        known = np.isfinite(places).all(axis=1)
        size = np.ptp(places[known], axis=0).max(initial=0.0)
        most = max(CHORD * size, ROUNDING * abs(places[known]).max(initial=0.0))
        first = np.flatnonzero(known[:-1] & known[1:] & (at[1:] > at[:-1]))
        inner = at[first, None] + (at[first + 1] - at[first])[:, None] * parts
        between = curve(inner.ravel()).reshape(-1, 3, 2)
        bent = np.nanmax(_from_chord(places[first], places[first + 1], between), axis=1)
        halved = bent > most
        if not halved.any() or len(at) > MOST_DRAWN:
            break
        # A piece that bends too much gets its three inner points.
        at = np.insert(at, first[halved].repeat(3) + 1, inner[halved].ravel())
        places = np.insert(places, first[halved].repeat(3) + 1, between[halved].reshape(-1, 2), 0)
    return places[np.isfinite(places).all(axis=1)]


def _from_chord(start: np.ndarray, end: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the distances of points (n, m, 2) from chords (n, 2)."""
    along = (end - start)[:, None]
    away = points - start[:, None]
    part = (away * along).sum(axis=-1) / np.maximum((along ** 2).sum(axis=-1), 1e-300)
    return np.hypot(*np.moveaxis(away - part.clip(0.0, 1.0)[..., None] * along, -1, 0))
