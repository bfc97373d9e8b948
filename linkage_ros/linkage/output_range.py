# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""How far the inputs and the joints of a linkage go, for limits of a robot model."""

from __future__ import annotations

import math
from typing import Dict, Optional, Sequence, Tuple

import numpy as np

from .curves import extremes
from .input_range import reachable_arcs
from .inputs import Arc
from .mechanism import Mechanism
from .walker import Assembly

# What is added to each end of a travel, in parts of a radian or of the longest bar.
SLACK = 1e-6

Travel = Tuple[float, float]


def common_reach(assembly: Assembly) -> Sequence[Arc]:
    """Return the arcs (lo, hi) of the first input on which every leg can be assembled."""
    if len(assembly.legs) == 1 or not assembly.is_limited:
        return assembly.reach
    ends = [leg.lag + (leg.start + leg.side * end)
            for leg in assembly.legs.values() for arc in assembly.reach for end in arc]
    return reachable_arcs(ends, lambda theta: bool(assembly.within_reach(theta).all()))


def ground_frame(linkage: Mechanism) -> Dict[str, Tuple[float, float]]:
    """Return where the joints on the ground lie [m]."""
    return linkage.cache.get_or_make('ground', lambda: {
        name: tuple(place.ravel().tolist()) for name, place in linkage.solve(
            [0.0] * len(linkage.inputs), linkage.grounded).items()})


def travels(linkage: Mechanism, reach: Sequence[Arc]) -> Dict[str, Optional[Travel]]:
    """
    Return how far each joint goes, the inputs left out.

    Parameters
    ----------
    linkage : Mechanism
        What moves.
    reach : sequence of (float, float)
        Arcs of its input [rad or m].

    Returns
    -------
    dict
        For each joint (lo, hi) [rad; a slide: m] that hold every value of `joint_angles`, no more
        than SLACK beyond it; None for a joint that turns past +-pi. Where there are several
        inputs, the reach of one depends on the others: then this is None for each joint that
        turns, and for a slide more than any pose needs.

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
    """Return a length [m] that no two joints are ever apart."""
    return float(sum(linkage.bar_lengths.values())
                 + sum(input_.high for input_ in linkage.inputs if not input_.turns)
                 + np.abs(list(ground_frame(linkage).values())).sum())
