# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Visible pieces of bodies, and what they weigh."""

from __future__ import annotations

import math
from typing import Dict, NamedTuple, Sequence, Tuple

import numpy as np

# Names of shapes in all formats.
ROD, BOX, BALL = 'cylinder', 'box', 'sphere'
Place = Tuple[float, float]


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
    def pose(self) -> Tuple[float, ...]:
        """Its middle x, y, z [m], roll, pitch, yaw [rad]; pitch lays a cylinder's z along x."""
        (x, y), (u, v) = self.start, self.end
        return (0.5 * (x + u), 0.5 * (y + v), 0.0,
                0.0, 0.5 * math.pi if self.shape == ROD else 0.0, math.atan2(v - y, u - x))

    @property
    def sizes(self) -> Dict[str, Tuple[float, ...]]:
        """Its sizes [m], by their names in URDF and SDF."""
        if self.shape == BOX:
            return {'size': (self.length, self.thickness, self.thickness)}
        length = {'length': (self.length,)} if self.shape == ROD else {}
        return {'radius': (self.thickness,), **length}


class Point(NamedTuple):
    """
    A joint of a linkage on a body.

    `meets` is the coinciding point on another body if a loop was cut here.
    """

    name: str
    body: str
    place: Place
    meets: str
    radius: float

    def ball(self, place: Place = (0.0, 0.0)) -> Piece:
        """Return its visible ball, at a place in its own frame or in another."""
        return Piece(BALL, 'joint', self.radius, place, place)


class Weight(NamedTuple):
    """Mass [kg], centre of mass x, y [m], moments of inertia about it xx, yy, zz, xy [kg m^2]."""

    mass: float
    centre: Tuple[float, float]
    moments: Sequence[float]


def weight(pieces: Sequence[Piece], density: float) -> Weight:
    """Return the common weight of one or more pieces of a density [kg/m^3]."""
    solids = np.array([_solid(piece) for piece in pieces])
    masses = density * solids[:, 0]
    mass = float(masses.sum())
    x, y = masses @ [piece.pose[:2] for piece in pieces] / mass
    moments = np.zeros(4)
    for own, (along, across), piece in zip(masses, masses[:, None] * solids[:, 1:], pieces):
        u, v, *_, angle = piece.pose
        u, v, c, s = u - x, v - y, math.cos(angle), math.sin(angle)
        moments += (along * c * c + across * s * s + own * v * v,
                    along * s * s + across * c * c + own * u * u,
                    across + own * (u * u + v * v), (along - across) * c * s - own * u * v)
    return Weight(mass, (float(x), float(y)), moments.tolist())


def _solid(piece: Piece) -> Tuple[float, float, float]:
    """Return the volume [m^3], and the squares of radii of gyration about and across it [m^2]."""
    thick, long = piece.thickness ** 2, piece.length ** 2 / 12.0
    return {ROD: (math.pi * thick * piece.length, 0.5 * thick, 0.25 * thick + long),
            BOX: (thick * piece.length, thick / 6.0, thick / 12.0 + long),
            BALL: (4.0 / 3.0 * math.pi * piece.thickness ** 3, 0.4 * thick, 0.4 * thick)
            }[piece.shape]
