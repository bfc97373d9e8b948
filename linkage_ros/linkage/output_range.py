# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
How far the joints of a linkage go while its crank turns through its reach.

The reach is cut into parts; each is sampled, then zoomed in on where a joint is greatest or least,
until the samples are a rounding apart. That finds smooth turning points as well as the ends of the
reach, where joints are fastest.
"""

from __future__ import annotations

import math
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np

from .crank_range import Arc, is_full_turn, reachable_arcs
from .mechanism import Mechanism
from .walker import Assembly

# Parts that an arc of the reach is cut into, samples on a part, zooms until they are a rounding
# apart, and how many parts are zoomed in on: those with the greatest values.
PARTS, SAMPLES, ZOOMS, KEPT = 24, 17, 16, 4
# What is added to each end of a travel, in parts of a radian or of the longest bar.
SLACK = 1e-6

Travel = Tuple[float, float]


def crank_reach(assembly: Assembly) -> Sequence[Arc]:
    """Return the arcs (lo, hi) [rad] of the crank on which every leg can be assembled."""
    if len(assembly.legs) == 1 or is_full_turn(assembly.reach):
        return assembly.reach
    ends = [leg.lag + (leg.start + leg.side * end)
            for leg in assembly.legs for arc in assembly.reach for end in arc]
    return reachable_arcs(ends, lambda theta: bool(assembly.within_reach(theta).all()))


def ground_frame(linkage: Mechanism) -> Dict[str, Tuple[float, float]]:
    """Return where the joints lie [m] that no moving link carries."""
    frames = linkage.frames
    carried = {name for link in linkage.links for name in frames[link.name] if name != link.joint}
    names = [name for name in linkage.points if name not in carried]
    anywhere = [0.0] * len(linkage.cranks)
    return {name: tuple(place.ravel().tolist())
            for name, place in linkage.solve(anywhere, names).items()}


def travels(linkage: Mechanism, reach: Sequence[Arc]) -> Dict[str, Optional[Travel]]:
    """
    Return how far each joint goes, the cranks left out.

    Parameters
    ----------
    linkage : Mechanism
        What moves.
    reach : sequence of (float, float)
        Arcs of its crank [rad].

    Returns
    -------
    dict
        For each joint (lo, hi) [rad; a slide: m] that hold every value of `joint_angles`, no more
        than SLACK beyond it; None for a joint that turns past +-pi. Where there are several
        cranks, the reach of one depends on the others: then this is None for each joint that
        turns, and for a slide more than any pose needs.

    """
    kinds = {link.name: link.kind for link in linkage.links if link.name not in linkage.cranks}
    if not kinds:
        return {}
    if len(linkage.cranks) > 1:
        far = _farthest(linkage)
        return {name: (-far, far) if kind == 'prismatic' else None
                for name, kind in kinds.items()}
    slacks = {'revolute': SLACK, 'prismatic': SLACK * float(linkage.longest)}
    return {name: _travel(kind, float(lo) - slacks[kind], float(hi) + slacks[kind])
            for (name, kind), lo, hi in zip(kinds.items(), *_extremes(linkage, [*kinds], reach))}


def _travel(kind: str, lo: float, hi: float) -> Optional[Travel]:
    return None if kind == 'revolute' and hi - lo >= math.tau else (lo, hi)


def _farthest(linkage: Mechanism) -> float:
    """Return a length [m] that no two joints are ever apart."""
    return float(sum(linkage.bar_lengths.values())
                 + np.abs(list(ground_frame(linkage).values())).sum())


def _extremes(linkage: Mechanism, names: List[str], reach: Sequence[Arc]) -> np.ndarray:
    """Return the least and the greatest value of each joint, shape (2, joints)."""
    marks = [np.linspace(lo, hi, PARTS + 1) for lo, hi in reach]
    parts = np.concatenate([np.stack([mark[:-1], mark[1:]]) for mark in marks], axis=1)
    # One row of parts for each extreme: the greatest of minus a joint is its least.
    signs = np.repeat([-1.0, 1.0], len(names))
    low, high = np.tile(parts[:, None], (1, len(signs), 1))
    for _ in range(ZOOMS):
        theta = np.linspace(low, high, SAMPLES, axis=-1)
        solved = linkage.joint_angles(theta, names)
        value = np.stack([sign * solved[name][row]
                          for row, (name, sign) in enumerate(zip(2 * names, signs))])
        value[np.isnan(value)] = -math.inf
        best = value.argmax(axis=-1)[..., None]
        kept = np.argsort(-value.max(axis=-1), axis=1)[:, :KEPT]
        low, high = (np.take_along_axis(_at(theta, best + step), kept, 1) for step in (-1, 1))
    return (signs * value.max(axis=(1, 2))).reshape(2, -1)


def _at(samples: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return the samples at a place along the last axis, or the nearest there is."""
    return np.take_along_axis(samples, place.clip(0, SAMPLES - 1), -1)[..., 0]
