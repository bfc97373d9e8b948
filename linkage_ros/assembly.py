# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
The legs that share one crank.

Pair j of N has its left leg at theta - 2 pi j/N and its right leg, the mirror image x -> -x of a
leg at pi - (theta - 2 pi j/N), on the same crank pin. All legs are solved in one call.
"""

import math
from struct import Struct
from typing import Callable, NamedTuple, Optional, Sequence

import numpy as np

# An angle this far [rad] beyond the reach may be its end, wrapped by a turn.
WRAPPED = 1e-12
LOCUS_POINTS = 361


class Leg(NamedTuple):
    """A leg: what its joints' names begin with, its lag [rad], and side +1, or -1 if mirrored."""

    prefix: str
    lag: float
    side: float


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
        self._everywhere = np.ones(len(legs), bool)
        self._lags = np.array([leg.lag for leg in legs])
        self._sides = np.array([leg.side for leg in legs])
        self._sizes = scale * np.stack([self._sides, np.ones(len(legs))], axis=1)[:, None]
        slides = [link.name for link in linkage.links if link.kind == 'prismatic']
        self._units = np.array([scale if name in slides else 1.0 for name in self.joints])

    def angles(self, theta: float) -> np.ndarray:
        """Return the crank angle [rad] of each leg, as that leg counts it."""
        angles = theta - self._lags
        return np.where(self._sides > 0.0, angles, math.pi - angles)

    def solver(self, points: Sequence[str] = (), joints: Sequence[str] = (),
               rates: Sequence[str] = ()) -> Callable:
        """
        Return the function that solves all legs for what is wanted and nothing else.

        Returns
        -------
        callable
            From the crank angles [rad] and `speeds` [rad/s] to an array of shape (legs, n): x, y
            [m] of each point, the joint angles [rad; a slide: m] and, for those in rates, the
            joint velocities.

        """
        pose = self.linkage.function(points, joints, rates)
        cranks, posed = len(self.linkage.cranks), 2 * len(points) + len(joints)
        factors = self._factors(len(points), joints, rates * cranks)
        legs, width = factors.shape
        pack = Struct(f'{width}d').pack_into
        rows = [(i * factors.strides[0], leg.lag, leg.side > 0.0)
                for i, leg in enumerate(self.legs)]

        def solve(first, *others, speeds=()):
            solved = np.empty((legs, width))
            for place, lag, left in rows:
                angle = first - lag
                pack(solved, place, *pose(angle if left else math.pi - angle, *others))
            solved *= factors
            if not rates:
                return solved
            if cranks == 1:
                solved[:, posed:] *= speeds[0]
                return solved
            turning = solved[:, posed:].reshape(legs, cranks, -1)
            return np.hstack([solved[:, :posed], np.tensordot(turning, speeds, (1, 0))])

        return solve

    def _factors(self, points, joints, rates):
        """Return what a leg's own numbers are multiplied by, shape (legs, n)."""
        units = dict(zip(self.joints, self._units))
        # A mirrored leg's own crank turns backwards, which mirrors its rates once more.
        return np.hstack([
            np.tile(self._sizes[:, 0], (1, points)),
            np.outer(self._sides, [units[name] for name in joints]),
            np.outer(self._everywhere, [units[name] for name in rates])])

    def within_reach(self, thetas: Sequence[float]) -> np.ndarray:
        """Return which legs can be assembled at crank angles [rad], as far as reach tells."""
        if is_full_turn(self.reach) or len(thetas) > 1:
            return self._everywhere
        with np.errstate(invalid='ignore'):
            angles = self.angles(thetas[0])
            return np.any([(angles - lo + WRAPPED) % math.tau <= hi - lo + 2.0 * WRAPPED
                           for lo, hi in self.reach], axis=0)

    def points(self, angles: np.ndarray, names: Sequence[str]) -> np.ndarray:
        """Return the joints' places [m], shape (legs, names, 2)."""
        solved = self.linkage.solve(angles, names)
        return np.stack([solved[name] for name in names], axis=1) * self._sizes

    def locus(self, name: str) -> np.ndarray:
        """
        Return the curve of a joint of the first leg, over its widest reach [m]: (n, 2).

        Several cranks draw no one curve: there it is empty.
        """
        if len(self.linkage.cranks) > 1:
            return np.empty((0, 2))
        low, high = max(self.reach, key=lambda arc: arc[1] - arc[0])
        places = self.linkage.solve(np.linspace(low, high, LOCUS_POINTS), (name,))[name]
        return places[np.isfinite(places).all(axis=1)] * self._sizes[0]

    def joint_angles(self, angles: np.ndarray) -> np.ndarray:
        """Return the joint angles [rad; a slide: m], the crank's left out: (legs, joints)."""
        return self._of_joints(self.linkage.joint_angles, angles) * self._sides[:, None]

    def joint_rates(self, angles: np.ndarray) -> np.ndarray:
        """Return d joint angle / d theta, shape (legs, joints)."""
        # A mirrored leg's own crank turns backwards, which mirrors its rates once more.
        return self._of_joints(self.linkage.joint_rates, angles)

    def _of_joints(self, function, angles):
        solved = function(angles, self.joints)
        return np.stack([solved[name] for name in self.joints], axis=1) * self._units


def is_full_turn(reach) -> bool:
    """Return whether a reach is one arc of a whole turn."""
    return len(reach) == 1 and reach[0][1] - reach[0][0] >= math.tau
