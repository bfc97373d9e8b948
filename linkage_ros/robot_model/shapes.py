# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Shapes of a linkage for drawing: sliding parts, cranks, plates and marks of the ground.

Sliding parts are a cylinder's barrel and rod, a block, and the guide that it runs on. Each is a
straight piece of one link, so it moves with that link in markers, pictures and models.
"""

from __future__ import annotations

import cmath
from itertools import combinations
from typing import Any, Collection, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from ..linkage import GROUND, Link, LinkPoint, Mechanism
from ..scene import SceneMechanism

GUIDE, BLOCK, BARREL, ROD = 'guide', 'block', 'barrel', 'rod'
# Half the length of a block, and of a guide beyond its travel, as a fraction of the longest bar.
HALF_BLOCK = 1 / 20
# Least and greatest length of a barrel, as a fraction of the cylinder's shortest length.
SHORT_BARREL, LONG_BARREL = 0.5, 0.9
# Height of a ground joint's mark, as a fraction of the longest bar; half its width per height.
MARK, HALF_MARK = 1 / 15, 0.6
# A smaller area counts as zero, as a fraction of the longest bar squared.
FLAT = 1e-9
# Number of poses that determine the travel of a slide.
SAMPLES = 361


class Shape(NamedTuple):
    """A piece of a link from start to end, and the slide that it belongs to; before scale."""

    kind: str
    slide: Link
    start: LinkPoint
    end: LinkPoint

    @property
    def is_fixed(self) -> bool:
        """Whether it is on the ground."""
        return self.start.link == GROUND


def ground_frame(linkage: Mechanism) -> Dict[str, Tuple[float, ...]]:
    """Return the places of the joints on the ground [m]."""
    return linkage.cache.get_or_make('ground', lambda: {
        name: tuple(place.ravel().tolist()) for name, place in linkage.solve(
            [0.0] * len(linkage.inputs), linkage.grounded).items()})


def shapes(machine: SceneMechanism) -> List[Shape]:
    """Return the sliding parts, guides first; parts that no pose was found for are omitted."""
    linkage = machine.linkage
    slides = [link for link in linkage.links if link.kind == 'prismatic']
    if not slides:
        return []
    frames = {GROUND: ground_frame(linkage), **linkage.frames}
    found: List[Shape] = []
    for link, (low, high) in _travels(machine, slides):
        pieces = (_cylinder(link, low, high) if (link.joint, link.tip) in linkage.cylinders
                  else _block(link, low, high, frames, HALF_BLOCK * linkage.longest))
        found += [Shape(kind, link, start, end) for kind, start, end in pieces]
    return sorted(found, key=lambda shape: shape.kind != GUIDE)


def drawn(machine: SceneMechanism, names: Collection[str]) -> List[Shape]:
    """Return the shapes to draw between these joints; rods are drawn as bars."""
    return [shape for shape in shapes(machine)
            if shape.kind != ROD and {shape.slide.joint, shape.slide.tip} <= set(names)]


def cranks(linkage: Mechanism, parent: Optional[str] = None) -> List[Tuple[str, str]]:
    """Return the bars that inputs turn, from centre to pin; all, or those with one parent."""
    names = [input_.name for input_ in linkage.inputs if input_.turns]
    return [(link.joint, link.tip) for link in linkage.links
            if link.name in names and parent in (None, link.parent)]


def plates(linkage: Mechanism, names: Collection[str]) -> List[Tuple[str, str, str]]:
    """Return triples of joints whose bars form a triangle of one link."""
    bars = set(map(frozenset, linkage.bars))
    return [corners for frame in linkage.frames.values()
            for corners in combinations([name for name in frame if name in names], 3)
            if bars.issuperset(map(frozenset, combinations(corners, 2)))
            and _area(*(complex(*frame[name]) for name in corners)) > FLAT * linkage.longest ** 2]


def _area(p: complex, q: complex, r: complex) -> float:
    return abs(((q - p).conjugate() * (r - p)).imag) / 2.0


def marks(linkage: Mechanism, names: Collection[str]) -> List[Tuple[str, LinkPoint, LinkPoint]]:
    """Return the triangle below each of these joints that is on the ground."""
    height = MARK * linkage.longest
    width = HALF_MARK * height
    return [(name, LinkPoint(GROUND, x - width, y - height),
             LinkPoint(GROUND, x + width, y - height))
            for name, (x, y) in ground_frame(linkage).items() if name in names]


def _cylinder(link: Link, low: float, high: float) -> Iterable[Tuple[str, LinkPoint, LinkPoint]]:
    """Yield barrel and rod; the barrel is as long as the stroke, within its limits."""
    barrel = min(max(high - low, SHORT_BARREL * low), LONG_BARREL * low)
    yield BARREL, LinkPoint(link.parent, 0.0, 0.0), LinkPoint(link.parent, barrel, 0.0)
    yield ROD, LinkPoint(link.name, barrel - high, 0.0), LinkPoint(link.name, 0.0, 0.0)


def _block(link: Any, low: float, high: float, frames: Dict[str, dict],
           half: float) -> Iterable[Tuple[str, LinkPoint, LinkPoint]]:
    """Yield the guide, on the parent link of a slide, and the block."""
    x, y = frames[link.name][link.tip]
    start, along = complex(*frames[link.parent][link.joint]), cmath.rect(1.0, link.zero)
    first, last = (start + along * complex(x + end, y) for end in (low - half, high + half))
    yield (GUIDE, LinkPoint(link.parent, first.real, first.imag),
           LinkPoint(link.parent, last.real, last.imag))
    yield BLOCK, LinkPoint(link.name, x - half, y), LinkPoint(link.name, x + half, y)


def _travels(machine: SceneMechanism,
             slides: Sequence[Link]) -> Iterable[Tuple[Link, Tuple[float, float]]]:
    """Yield how far each goes [m] while the inputs take all values that they may, before scale."""
    count = max(round(SAMPLES ** (1.0 / len(machine.inputs))), 2)
    found = machine.linkage.joint_angles(input_values(machine, count),
                                         [link.name for link in slides])
    for link in slides:
        values = found[link.name][np.isfinite(found[link.name])]
        if values.size:
            yield link, (float(values.min()), float(values.max()))


def input_values(machine: SceneMechanism, count: int) -> Any:
    """Return values of the inputs through their ends or parts of their reach, before scale."""
    values = [np.concatenate([np.linspace(low, high, count) for low, high in (
        [drive.ends] if drive.ends else drive.reach)]) / machine.scale_of(name)
        for name, drive in machine.inputs.items()]
    return np.meshgrid(*values) if len(values) > 1 else values[0]
