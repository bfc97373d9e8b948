# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Shapes of a linkage for drawing, and visible pieces of bodies with their weight.

Sliding parts are a cylinder's barrel and rod, a block, and the guide that it runs on. Each is a
straight piece of one link, so it moves with that link in markers, pictures and models.
"""

from __future__ import annotations

import cmath
from itertools import combinations
import math
from typing import Any, Collection, NamedTuple, Sequence

import numpy as np

from ..linkage import GROUND, Link, LinkPoint, Mechanism, theta_of
from ..scene import SceneMechanism

# Kinds of sliding parts.
GUIDE, BLOCK, BARREL, ROD = 'guide', 'block', 'barrel', 'rod'
# Half the length of a block, and of a guide beyond its travel, as a fraction of the longest bar.
HALF_BLOCK = 1 / 20
# Least and greatest length of a barrel, as a fraction of the cylinder's shortest length.
SHORT_BARREL, LONG_BARREL = 0.5, 0.9
# Height of a ground joint's mark, as a fraction of the longest bar; half its width per height.
MARK, HALF_MARK = 1 / 15, 0.6
# A plate with a smaller area is not drawn, as a fraction of the longest bar squared.
MIN_AREA = 1e-9
# Number of poses that determine the travel of a slide, and what a camera sees.
SAMPLES = 361
# Names of visible shapes in all formats.
CYLINDER, BOX, BALL = 'cylinder', 'box', 'sphere'
Place = tuple[float, float]


class Shape(NamedTuple):
    """A piece of a link from start to end, and the slide that it belongs to; before scale."""

    kind: str
    slide: Link
    start: LinkPoint
    end: LinkPoint


def ground_frame(linkage: Mechanism) -> dict[str, tuple[float, ...]]:
    """Return the places of the joints on the ground [m]."""
    return linkage.cache.get_or_make('ground', lambda: {
        name: tuple(place.ravel().tolist()) for name, place in linkage.solve(
            [0.0] * len(linkage.inputs), linkage.grounded).items()})


def shapes(mechanism: SceneMechanism) -> list[Shape]:
    """Return the sliding parts, guides first; parts that no pose was found for are omitted."""
    linkage = mechanism.linkage
    slides = [link for link in linkage.links if link.kind == 'prismatic']
    frames = {GROUND: ground_frame(linkage), **linkage.frames}
    lengths = linkage.joint_angles(input_values(mechanism), [link.name for link in slides])
    guides, others = [], []
    for link in slides:
        values = lengths[link.name][np.isfinite(lengths[link.name])]
        if not values.size:
            continue
        low, high = float(values.min()), float(values.max())
        if (link.joint, link.tip) in linkage.cylinders:
            # The barrel is as long as the stroke, within its limits.
            barrel = min(max(high - low, SHORT_BARREL * low), LONG_BARREL * low)
            others += [_shape(BARREL, link, link.parent, 0.0, barrel),
                       _shape(ROD, link, link.name, barrel - high, 0.0)]
            continue
        half, tip = HALF_BLOCK * linkage.longest, complex(*frames[link.name][link.tip])
        start = complex(*frames[link.parent][link.joint])
        along = cmath.rect(1.0, float(np.asarray(link.zero)))
        guides.append(_shape(GUIDE, link, link.parent, *(
            start + along * (tip + end) for end in (low - half, high + half))))
        others.append(_shape(BLOCK, link, link.name, tip - half, tip + half))
    return guides + others


def _shape(kind: str, slide: Link, link: str, *ends: complex) -> Shape:
    return Shape(kind, slide, *(LinkPoint(link, end.real, end.imag) for end in ends))


def input_values(mechanism: SceneMechanism) -> Any:
    """Return values of the inputs through their ends or parts of their reach, before scale."""
    count = max(round(SAMPLES ** (1.0 / len(mechanism.inputs))), 2)
    values = [np.concatenate([np.linspace(*arc, count) for arc in settings.arcs])
              / mechanism.scale_of(name) for name, settings in mechanism.inputs.items()]
    return theta_of(np.meshgrid(*values))


def drawn(mechanism: SceneMechanism, names: Collection[str]) -> list[Shape]:
    """Return the shapes to draw between these joints; rods are drawn as bars."""
    return [shape for shape in shapes(mechanism)
            if shape.kind != ROD and {shape.slide.joint, shape.slide.tip} <= set(names)]


def cranks(linkage: Mechanism) -> list[tuple[str, str]]:
    """Return the bars that inputs turn, from centre to pin."""
    in_space = len(linkage.axes) > 2
    names = [input_.name for input_ in linkage.inputs if input_.is_angle or in_space]
    links = [link for link in linkage.links if link.name in names]
    if in_space:
        # A link has no tip there: rods end on it.
        centres = {link.joint for link in links}
        return [bar for bar in linkage.bars if bar[0] in centres]
    return [(link.joint, link.tip) for link in links]


def plates(linkage: Mechanism, names: Collection[str]) -> list[tuple[str, str, str]]:
    """Return triples of joints whose bars form a triangle of one link."""
    bars = set(map(frozenset, linkage.bars))
    return [corners for frame in linkage.frames.values()
            for corners in combinations([name for name in frame if name in names], 3)
            if bars.issuperset(map(frozenset, combinations(corners, 2)))
            and abs(np.linalg.det([(*frame[name], 1.0) for name in corners]))
            > 2.0 * MIN_AREA * linkage.longest ** 2]


def marks(linkage: Mechanism, names: Collection[str]) -> list[tuple[str, LinkPoint, LinkPoint]]:
    """Return the triangle below each of these joints that is on the ground."""
    height = MARK * linkage.longest
    width = HALF_MARK * height
    return [(name, LinkPoint(GROUND, x - width, y - height),
             LinkPoint(GROUND, x + width, y - height))
            for name, (x, y) in ground_frame(linkage).items() if name in names]


class Piece(NamedTuple):
    """A visible shape of a body, from start to end [m], with a radius or a box's sizes [m]."""

    shape: str
    colour: str
    thickness: float
    start: Place
    end: Place

    @property
    def length(self) -> float:
        """Its length [m]."""
        return math.dist(self.start, self.end)

    @property
    def pose(self) -> tuple[float, ...]:
        """Its middle x, y, z [m], roll, pitch, yaw [rad]; pitch lays a cylinder's z along x."""
        (x, y), (u, v) = self.start, self.end
        return (0.5 * (x + u), 0.5 * (y + v), 0.0, 0.0,
                0.5 * math.pi if self.shape == CYLINDER else 0.0, math.atan2(v - y, u - x))

    @property
    def sizes(self) -> dict[str, tuple[float, ...]]:
        """Its sizes [m], by their names in URDF and SDF."""
        if self.shape == BOX:
            return {'size': (self.length, self.thickness, self.thickness)}
        length = {'length': (self.length,)} if self.shape == CYLINDER else {}
        return {'radius': (self.thickness,), **length}

    @property
    def solid(self) -> tuple[float, float, float]:
        """Its volume [m^3], and squares of radii of gyration about and across it [m^2]."""
        thick, long = self.thickness ** 2, self.length ** 2 / 12.0
        return {CYLINDER: (math.pi * thick * self.length, 0.5 * thick, 0.25 * thick + long),
                BOX: (thick * self.length, thick / 6.0, thick / 12.0 + long),
                BALL: (4.0 / 3.0 * math.pi * self.thickness ** 3, 0.4 * thick, 0.4 * thick)
                }[self.shape]


def weight(pieces: Sequence[Piece], density: float) -> tuple[float, list[float], list[float]]:
    """
    Return the common weight of one or more pieces of a density [kg/m^3].

    It is a mass [kg], the centre of mass x, y [m], and the moments of inertia xx, yy, zz, xy about
    it [kg m^2].
    """
    volumes, about, across = np.array([piece.solid for piece in pieces]).T
    poses, masses = np.array([piece.pose for piece in pieces]), density * volumes
    mass = masses.sum()
    centre = masses @ poses[:, :2] / mass
    (x, y), c, s = (poses[:, :2] - centre).T, np.cos(poses[:, 5]), np.sin(poses[:, 5])
    moments = [about * c * c + across * s * s + y * y, about * s * s + across * c * c + x * x,
               across + x * x + y * y, (about - across) * c * s - x * y]
    return float(mass), centre.tolist(), [float(masses @ moment) for moment in moments]
