# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Ranges of the inputs and the joints of a linkage, for the limits of a robot model."""

from __future__ import annotations

import math
from typing import Dict, Optional, Sequence, Tuple

import numpy as np

from ..linkage import Arc, extremes, Mechanism, reachable_arcs
from ..scene.legs import Assembly

# Margin at each end of a travel: [rad], for a slide as a fraction of the longest bar.
SLACK = 1e-6

Travel = Tuple[float, float]


def common_reach(assembly: Assembly) -> Sequence[Arc]:
    """Return the arcs (lo, hi) of the first input on which every leg can be assembled."""
    if len(assembly.legs) == 1 or not assembly.is_limited:
        return assembly.reach
    ends = [leg.lag + (leg.start + leg.side * end)
            for leg in assembly.legs.values() for arc in assembly.reach for end in arc]
    return reachable_arcs(ends, lambda theta: all(assembly.within_reach(theta)))


def ground_frame(linkage: Mechanism) -> Dict[str, Tuple[float, float]]:
    """Return the places (x, y) of the joints on the ground [m]."""
    return linkage.cache.get_or_make('ground', lambda: {
        name: tuple(place.ravel().tolist()) for name, place in linkage.solve(
            [0.0] * len(linkage.inputs), linkage.grounded).items()})


def travels(linkage: Mechanism, reach: Sequence[Arc]) -> Dict[str, Optional[Travel]]:
    """
    Return the travel of each joint except the inputs.

    Parameters
    ----------
    linkage : Mechanism
        The linkage.
    reach : sequence of (float, float)
        Arcs of its input [rad or m].

    Returns
    -------
    dict
        For each joint the bounds (lo, hi) of its values in `joint_angles` [rad; a slide: m],
        wider by SLACK at most; None for a joint that turns past +-pi. With several inputs the
        reach of one depends on the others: then None for each joint that turns, and bounds wider
        than any pose for a slide.

    """
    inputs = {input_.name for input_ in linkage.inputs}
    slides = {link.name: link.kind == 'prismatic' for link in linkage.links
              if link.name not in inputs}
    if len(inputs) > 1:
        far = _farthest(linkage)
        return {name: (-far, far) if slide else None for name, slide in slides.items()}
    if not slides:
        return {}
    names, turning = list(slides), ~np.array(list(slides.values()), bool)
    found = linkage.cache.get_or_make(('travels', *reach), lambda: np.array([extremes(
        lambda theta: np.stack([*linkage.joint_angles(theta, names).values()]), *arc, turning)
        for arc in reach]))
    slack = np.where(turning, SLACK, SLACK * float(linkage.longest))
    lows, highs = found[:, :, 0, 0].min(axis=0) - slack, found[:, :, 1, 0].max(axis=0) + slack
    return {name: None if turns and not -math.pi < lo < hi <= math.pi else (lo, hi)
            for name, turns, lo, hi in zip(names, turning, lows.tolist(), highs.tolist())}


def _farthest(linkage: Mechanism) -> float:
    """Return an upper bound of the distance between any two joints [m]."""
    return float(sum(linkage.bar_lengths.values())
                 + sum(input_.high for input_ in linkage.inputs if not input_.turns)
                 + np.abs(list(ground_frame(linkage).values())).sum())
