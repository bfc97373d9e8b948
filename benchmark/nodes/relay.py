# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The usual way to close loops: Gauss-Newton on the bars' lengths, from the last pose on."""

import math

import numpy as np

TOLERANCE = 1e-9
STEP = 1e-7
MAX_STEPS = 20


class Loops:
    """
    One linkage with a crank, its other joints found numerically.

    Parameters
    ----------
    linkage : Mechanism
        Gives the bars, their lengths, and the pose that the search starts from.

    """

    def __init__(self, linkage):
        self._points = linkage.points
        pose = linkage.solve(0.0)
        moved = linkage.solve(1.0)
        crank = next(link for link in linkage.links if link.name == 'crank')
        self._pin = self._points.index(crank.tip)
        free = [p for p in self._points
                if p != crank.tip and np.abs(moved[p] - pose[p]).max() > 0.0]
        self._free = np.array([self._points.index(p) for p in free])
        self._places = np.array([pose[p] for p in self._points])
        self._centre = pose[crank.joint]
        self._radius = np.linalg.norm(pose[crank.tip] - pose[crank.joint])
        bars = [bar for bar in linkage.bar_lengths if set(bar) & set(free)]
        self._ends = np.array([[self._points.index(p) for p in bar] for bar in bars]).T
        self._lengths = np.array([linkage.bar_lengths[bar] for bar in bars], float)
        self._size = self._lengths.max()
        self._links = [(self._points.index(link.joint), self._points.index(link.tip))
                       for link in linkage.links]
        self._parents = [next((i for i, other in enumerate(linkage.links)
                               if other.name == link.parent), None) for link in linkage.links]

    def _misfit(self, unknown):
        self._places[self._free] = unknown.reshape(-1, 2)
        start, end = self._places[self._ends]
        return np.hypot(*(end - start).T) - self._lengths

    def joint_angles(self, theta: float) -> np.ndarray:
        """Return the angle of every link to its parent [rad], the crank's first."""
        self._places[self._pin] = self._centre + self._radius * np.array(
            [math.cos(theta), math.sin(theta)])
        unknown = self._places[self._free].ravel()
        for _ in range(MAX_STEPS):
            misfit = self._misfit(unknown)
            if np.abs(misfit).max() < TOLERANCE * self._size:
                break
            jacobian = np.empty((misfit.size, unknown.size))
            for i in range(unknown.size):
                moved = unknown.copy()
                moved[i] += STEP * self._size
                jacobian[:, i] = (self._misfit(moved) - misfit) / (STEP * self._size)
            unknown = unknown - np.linalg.lstsq(jacobian, misfit, rcond=None)[0]
        return self._angles()

    def _angles(self):
        arms = np.array([self._places[tip] - self._places[joint] for joint, tip in self._links])
        absolute = np.arctan2(arms[:, 1], arms[:, 0])
        angles = [a if p is None else a - absolute[p] for a, p in zip(absolute, self._parents)]
        return np.remainder(np.add(angles, math.pi), math.tau) - math.pi
