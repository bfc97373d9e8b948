# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The legs that share one crank.

Pair j of N has its left leg at theta - 2 pi j/N and its right leg, the mirror image x -> -x of a
leg at pi - (theta - 2 pi j/N), on the same crank pin.
"""

from functools import cached_property
import math
from struct import Struct
from typing import Callable, NamedTuple, Optional, Sequence

import numpy as np

from .crank_range import is_full_turn
from ..formula.program import Batch

# An angle this far [rad] beyond the reach may be its end, wrapped by a turn.
WRAPPED = 1e-12
LOCUS_POINTS = 361


class Layout(NamedTuple):
    """
    How the numbers of a solution follow each other: a row for each leg, then the drive.

    A row holds so many coordinates, joint angles and joint velocities; the drive is the angle of
    each crank and, where there are velocities, the speed of each.
    """

    legs: int
    cranks: int
    coordinates: int
    joints: int
    velocities: int

    @property
    def posed(self) -> int:
        """How many numbers of a row are not velocities."""
        return self.coordinates + self.joints

    @property
    def size(self) -> int:
        """How many numbers there are."""
        return self._rows_end() + self.cranks * (2 if self.velocities else 1)

    def rows(self, values: np.ndarray) -> np.ndarray:
        """Return the rows, one for each leg."""
        return values[:self._rows_end()].reshape(self.legs, self.posed + self.velocities)

    def drive(self, values: np.ndarray) -> np.ndarray:
        """Return the cranks' angles and, where there are velocities, their speeds."""
        return values[self._rows_end():]

    def _rows_end(self) -> int:
        return self.legs * (self.posed + self.velocities)


class Solution:
    """
    The numbers of one layout, in an array that stays where it is.

    Parameters
    ----------
    layout : Layout
        What is where.
    values : float array
        Where they go.
    batch : Batch
        Solves the legs into the rows of the values; see `Mechanism.legs`.

    """

    def __init__(self, layout: Layout, values: np.ndarray, batch: Batch):
        self.layout, self.values, self.rows = layout, values, batch.rows
        self._batch = batch
        self._thetas = list(batch.given[:layout.cranks])
        self._speeds = list(batch.given[layout.cranks:2 * layout.cranks])
        self._drive = layout.drive(values)
        self._pack: Callable = Struct(f'{self._drive.size}d').pack_into

    def finish(self) -> None:
        """Wait for what makes the first solution slower than the others."""
        self._batch.finish()

    def solve(self, thetas: Sequence[float], speeds: Sequence[float] = ()) -> None:
        """Solve at crank angles [rad] and, if there are velocities, crank speeds [rad/s]."""
        if not self.layout.velocities:
            speeds = ()
        for row, theta in zip(self._thetas, thetas):
            row.fill(theta)
        for row, speed in zip(self._speeds, speeds):
            row.fill(speed)
        # Packing costs less than assigning to a part of an array.
        self._pack(self._drive, 0, *thetas, *speeds)
        self._batch.solve()


class Leg(NamedTuple):
    """A leg: what its joints' names begin with, its lag [rad], and side +1, or -1 if mirrored."""

    prefix: str
    lag: float
    side: float

    @property
    def start(self) -> float:
        """Its own crank angle [rad] when the crank has turned by its lag."""
        return 0.0 if self.side > 0.0 else math.pi


class Assembly:
    """
    The legs of one mechanism.

    Parameters
    ----------
    linkage : Mechanism
        One leg.
    leg_pairs : int
        Left legs, evenly spread over a turn of the crank.
    mirrored : bool
        Whether each left leg has a right one.
    scale : float
        Factor of every length.
    reach : sequence of (float, float), optional
        What linkage.reach() returns, where that is known.

    """

    def __init__(self, linkage, leg_pairs: int = 1, mirrored: bool = False, scale: float = 1.0,
                 reach: Optional[Sequence] = None):
        lags = [math.tau * j / leg_pairs for j in range(leg_pairs)]
        if leg_pairs == 1 and not mirrored:
            legs = [Leg('', 0.0, 1.0)]
        else:
            sides = {'left': 1.0, 'right': -1.0} if mirrored else {'left': 1.0}
            legs = [Leg(f'{side}{j}_', lag, sign)
                    for j, lag in enumerate(lags) for side, sign in sides.items()]
        self.linkage = linkage
        self.legs = tuple(legs)
        self.joints = tuple(name for name in linkage.joints if name not in linkage.cranks)
        self.reach = linkage.reach() if reach is None else reach
        # How far one of several cranks reaches depends on the others: only a pose tells.
        self.is_limited = len(linkage.cranks) == 1 and not is_full_turn(self.reach)
        self._scale = scale

    @cached_property
    def _fastest(self):
        try:
            return self.linkage.accelerated()
        except ImportError:
            return self.linkage

    def solution(self, points: Sequence[str] = (), joints: Sequence[str] = (),
                 rates: Sequence[str] = ()) -> Solution:
        """Return what solves all legs for points, joint angles and rates, and nothing else."""
        layout = Layout(len(self.legs), len(self.linkage.cranks), 2 * len(points), len(joints),
                        len(rates))
        values = np.empty(layout.size)
        batch = self._fastest.legs(
            tuple(points), tuple(joints), tuple(rates), layout.rows(values))
        batch.given[-5:].T[:] = [
            (leg.lag, leg.start, self._scale * leg.side, leg.side, self._scale)
            for leg in self.legs]
        return Solution(layout, values, batch)

    def within_reach(self, theta: float) -> np.ndarray:
        """Return which legs can be assembled at a crank angle [rad], as far as reach tells."""
        with np.errstate(invalid='ignore'):
            angles = np.array([leg.start + leg.side * (theta - leg.lag) for leg in self.legs])
            return np.any([(angles - lo + WRAPPED) % math.tau <= hi - lo + 2.0 * WRAPPED
                           for lo, hi in self.reach], axis=0)

    def locus(self, name: str) -> np.ndarray:
        """
        Return the curve of a joint of the first leg, over its widest reach [m]: (n, 2).

        Several cranks draw no one curve: there it is empty.
        """
        if len(self.linkage.cranks) > 1:
            return np.empty((0, 2))
        low, high = max(self.reach, key=lambda arc: arc[1] - arc[0])
        places = self.linkage.solve(np.linspace(low, high, LOCUS_POINTS), (name,))[name]
        return places[np.isfinite(places).all(axis=1)] * self._scale
