# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Reachability by brute force in plain float64, for many angles at once.

Each function returns the smallest relative gap of all closures: positive where the linkage can be
assembled, negative where it cannot, and not to be trusted closer to zero than `DOUBT`.
"""

import math

import numpy as np

from . import exact_poses

DOUBT = 1e-9


def gap(kind, dimensions, theta, branches=None):
    """Return the smallest gap at crank angles [rad], an array."""
    sides = {**exact_poses.KINDS[kind].branches, **(branches or {})}
    with np.errstate(invalid='ignore', divide='ignore'):
        return _GAP[kind](np.asarray(theta, float), sides, **dimensions)


def lever_gap(dimensions, lever, half):
    """Return the smallest gap at lever angles [rad]: the slot cuts the circle on its own half."""
    a, b, e = (dimensions[name] for name in 'abe')
    offset = e + b * np.sin(lever)
    cut = (a - np.abs(offset)) / (a + b + abs(e))
    height = np.sqrt(np.maximum(a * a - offset * offset, 0.0))
    ahead = np.maximum(half * (b * np.cos(lever) + height), half * (b * np.cos(lever) - height))
    return np.minimum(cut, ahead / (a + b + abs(e)))


def inside(arcs, theta):
    """Tell which angles lie on arcs [(lo, hi), ...], whole turns aside."""
    held = np.zeros(np.shape(theta), bool)
    for lo, hi in arcs:
        held |= np.mod(theta - lo, 2 * math.pi) <= hi - lo
    return held


def distance(arcs, theta):
    """Return how far angles are from the nearest end of an arc, whole turns aside."""
    away = np.full(np.shape(theta), math.pi)
    for end in (end for arc in arcs for end in arc):
        away = np.minimum(away, np.abs(np.mod(theta - end + math.pi, 2 * math.pi) - math.pi))
    return away


def _meet(p, radius_p, q, radius_q, side):
    """Return where two circles meet, and the gap."""
    d = np.abs(q - p)
    room = np.minimum(radius_p + radius_q - d, d - np.abs(radius_p - radius_q))
    along = (d + (radius_p - radius_q) * (radius_p + radius_q) / d) / 2
    height = side * np.sqrt(np.maximum(radius_p * radius_p - along * along, 0.0))
    return p + (q - p) / d * (along + 1j * height), room / (radius_p + radius_q)


def _water_drop(theta, sides, a):
    return np.ones(theta.shape)


def _jansen(theta, sides, a, b, c, d, e, f, g, h, i, j, k, l, m):  # noqa: E741
    A = m * np.exp(1j * theta)
    B = complex(-a, -l)
    C, gap_c = _meet(B, b, A, j, sides['C'])
    D, gap_d = _meet(B, d, C, e, 1)
    E, gap_e = _meet(B, c, A, k, sides['E'])
    F, gap_f = _meet(E, g, D, f, sides['F'])
    _, gap_g = _meet(E, i, F, h, 1)
    early = np.minimum(np.minimum(gap_c, gap_d), gap_e)
    late = np.minimum(gap_f, gap_g)
    # F and G mean nothing where the joints before them do not exist.
    return np.where(early > 0.0, np.minimum(early, late), early)


def _peaucellier(theta, sides, r, a, b):
    rho = 2 * r * np.abs(np.cos(theta / 2))
    return np.minimum(a + b - rho, rho - abs(a - b)) / (a + b)


def _slotted_lever(theta, sides, a, b, e):
    return (np.abs(b + a * np.exp(1j * theta)) - abs(e)) / (a + b + abs(e))


_GAP = {'water_drop': _water_drop, 'jansen': _jansen, 'peaucellier': _peaucellier,
        'slotted_lever': _slotted_lever}
