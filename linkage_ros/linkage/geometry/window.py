# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""
A proof that a link on two hinges and two rods has one pose at most inside its joint limits.

A rod from its pivot A, which a motor turns, to its end B, which both angles of the link turn, fits
where f = (|A - B|^2 - L^2) / 2 is zero. Suppose two poses at the same motor angles. On the line
from one to the other, each rod's f has a gradient that is square to the line (Rolle), somewhere in
the convex hull of the poses that this rod allows at this motor angle. So there is one pose, or
none, and it is not singular, if the gradients of one rod in its hull and those of the other rod
have no direction in common, up to sign.

Rectangle and motor angles are divided into cells. In a cell, f and its gradient differ from those
in the middle by at most their first derivatives there times half the cell, and a bound of the
second derivatives times half the square of that: the proof covers the whole cell.
"""

from __future__ import annotations

from itertools import product
import math
from typing import Any, NamedTuple, Sequence, Tuple

import numpy as np

from .spatial import Circle, EDGE, gap, LAST_STEP, newton_step, Pose, row, STEPS, Vector
from ..tolerances import ROUNDING, SINGULAR

# Cells per side of the rectangle, cells of all motor angles, and parts into which the needed ones
# of these are divided. The fine cells are tried if the coarse ones are too coarse.
COARSE, FINE = (10, 36, 2), (20, 48, 4)
# Newton's method is tried for this many poses per side of the rectangle. Its error [rad] one step
# before the last is well below LAST_STEP, so that it converges between these poses, too.
POSES, CONVERGED = 33, 0.01 * LAST_STEP
# Halvings in the search for the largest rectangle.
HALVINGS = 7
# Normals of the polygon of 16 sides that bounds the hull, in units of cells.
NORMALS = [(math.cos(angle), math.sin(angle)) for angle in np.arange(8) * math.pi / 8.0]


class Cells(NamedTuple):
    """Cells of one size: their middles (..., n), and half the length of their sides."""

    middle: np.ndarray
    half: np.ndarray


class Directions(NamedTuple):
    """For cells of a motor (k,): whether each allows cells of poses (k, n), directions [rad]."""

    allowed: np.ndarray
    middle: np.ndarray
    half: np.ndarray


class WindowRod(NamedTuple):
    """A rod in the frame of the first hinge; its length [m] is None if it is an input."""

    pivot: Circle
    end: Circle
    length: Any

    @property
    def sides(self) -> Tuple[float, ...]:
        """Return the sides on which a crank may be in a pose; 0 if no crank turns the pivot."""
        return (1.0, -1.0) if self.length is not None and any(self.pivot.u) else (0.0,)

    def pivots(self, poses: np.ndarray, side: float) -> Vector:
        """Return the place of the pivot for poses (2, n); NaN where the rod does not reach."""
        centre, u, v = self.pivot
        if self.length is None or not side:
            return Vector(*(x + np.zeros(poses.shape[1]) for x in centre))
        off = _place(self.end, poses).minus(centre)
        x, y = off.dot(u), off.dot(v)
        along = 0.5 * (u.dot(u) + off.dot(off) - self.length ** 2)
        size = x * x + y * y
        across = side * np.sqrt(size - along * along)
        return self.pivot.at((along * x - across * y) / size, (along * y + across * x) / size)

    def directions(self, poses: Cells, count: int, again: int) -> Directions:
        """Return the directions of its gradients in cells of a rectangle."""
        motors = self._motors(poses, count)
        if len(motors.middle) > 1:
            coarse, half = self._allowed(motors, poses).any(axis=1), motors.half / again
            motors = Cells((motors.middle[coarse, None] + half * np.arange(
                1 - again, again, 2)).ravel(), half)
        allowed = self._allowed(motors, poses)
        needed = allowed.any(axis=1)
        allowed = allowed[needed]
        gradient, spread = self._gradients(Cells(motors.middle[needed], motors.half), poses)
        first = np.take_along_axis(gradient, allowed.argmax(axis=1)[:, None], 1)
        turned, hull = np.angle(gradient * first.conj()), _hull(allowed)
        low = np.where(hull, turned - spread, np.inf).min(axis=1, initial=np.inf)
        high = np.where(hull, turned + spread, -np.inf).max(axis=1, initial=-np.inf)
        return Directions(allowed, np.angle(first[:, 0]) + 0.5 * (low + high), 0.5 * (high - low))

    def _motors(self, poses: Cells, count: int) -> Cells:
        """Return cells of all motor angles, or of all lengths, that poses may need."""
        if len(self.sides) > 1:
            low, high = -math.pi, math.pi
        elif self.length is None:
            off = _place(self.end, poses.middle).minus(self.pivot.centre)
            away, slack = np.sqrt(off.dot(off)), poses.half @ (_flat(self.end), _norm(self.end.u))
            low, high = max(away.min() - slack, 0.0), away.max() + slack
        else:
            return Cells(np.zeros(1), np.zeros(()))
        half = np.array(0.5 * (high - low) / count)
        return Cells(low + half * np.arange(1, 2 * count, 2), half)

    def _pivots(self, motors: Cells) -> Tuple[Vector, Vector, float]:
        """Return the pivot's place, its derivative by the motor's angle, and half of a cell."""
        turn = 0.0 if self.length is None else float(motors.half)
        angle = motors.middle[:, None] * (turn > 0.0)
        return (self.pivot.at(np.cos(angle), np.sin(angle)),
                self.pivot.ahead(np.cos(angle), np.sin(angle)), turn)

    def _allowed(self, motors: Cells, poses: Cells) -> np.ndarray:
        """Return whether f may be zero somewhere in cells of a motor and of poses (k, n)."""
        pivot, moved, turn = self._pivots(motors)
        length, half = (self.length, 0.0) if self.length is not None else (
            motors.middle[:, None], motors.half)
        rod, by_p, by_r = row(pivot, self.end, _pose(poses.middle))
        *bounds, size = self._bounds()
        halves = turn, *poses.half
        terms = sum(abs(x) * each for x, each in zip((rod.dot(moved), by_p, by_r), halves))
        slack = 0.5 * max(bounds) * sum(halves) ** 2 + half * (length + 0.5 * half)
        return ~(abs(gap(rod, length)) > terms + slack + ROUNDING * (size + length) ** 2)

    def _gradients(self, motors: Cells, poses: Cells) -> Tuple[np.ndarray, np.ndarray]:
        """Return gradients in the middles of cells as x + iy, and bounds of their turn [rad]."""
        pose, (pivot, moved, turn) = _pose(poses.middle), self._pivots(motors)
        rod, by_p, by_r = row(pivot, self.end, pose)
        centre, end, ahead = (each.turned(*pose[:2]) for each in (
            self.end.centre, self.end.at(*pose[2:]), self.end.ahead(*pose[2:])))
        across = pivot.x * ahead.y - pivot.y * ahead.x
        # The derivatives of the gradient by the motor, and by both angles.
        changes = (moved.x * end.y - moved.y * end.x - 1j * moved.dot(ahead),
                   pivot.x * end.x + pivot.y * end.y + 1j * across,
                   across + 1j * (ahead.dot(ahead) + rod.dot(end.minus(centre))))
        halves = turn, *poses.half
        gradient = by_p + 1j * by_r
        steep = abs(gradient)
        parts = [change * gradient.conj() * (half / steep)
                 for change, half in zip(changes, halves)]
        rest = 0.5 * math.hypot(*self._bounds()[:2]) * sum(halves) ** 2
        along, aside = steep - rest - sum(abs(x.real) for x in parts), rest + sum(
            abs(x.imag) for x in parts)
        return gradient, np.where(along > 0.0, np.arctan2(aside, along), np.pi)

    def _bounds(self) -> Tuple[float, float, float, float]:
        """Return bounds of the derivatives of f by both angles and the motor, and of |A| + |B|."""
        (pivot, rho), (end, radius) = ((_norm(path.centre), _norm(path.u))
                                       for path in (self.pivot, self.end))
        return (_flat(self.pivot) * _flat(self.end), (pivot + rho + end) * radius,
                (pivot + end + radius) * rho, pivot + rho + end + radius)


class Window:
    """A rectangle [rad] of both angles of a link on two hinges in a row, held by two rods."""

    def __init__(self, rods: Sequence[WindowRod], low: Sequence[float], high: Sequence[float]):
        self.rods = rods
        self.low, self.high = np.asarray(low, float), np.asarray(high, float)
        self.middle = 0.5 * (self.low + self.high)

    def scaled(self, factor: float) -> Window:
        """Return the rectangle made larger or smaller about its middle."""
        half = factor * (self.high - self.middle)
        return Window(self.rods, self.middle - half, self.middle + half)

    def largest(self) -> Window:
        """Return the largest rectangle of this shape, up to its size, that is proved."""
        size, step = 0.0, 0.5
        for _ in range(HALVINGS):
            larger = self.scaled(size + step)
            size += step * (larger.is_single(COARSE) and larger.converges())
            step *= 0.5
        return self.scaled(size if size > step else 0.0)

    def is_proved(self) -> bool:
        """Return whether it has one pose at most, by proof, and Newton's method finds it."""
        return (self.is_single(COARSE) or self.is_single(FINE)) and self.converges()

    def is_single(self, cells: Tuple[int, int, int]) -> bool:
        """Return whether it is proved to contain one pose at most, for any motor angles."""
        count = cells[0]
        # A little beyond the edges.
        low, half = self.low - 2.0 * EDGE, (0.5 * (self.high - self.low) + 2.0 * EDGE) / count
        poses = Cells(low[:, None] + half[:, None] * (2.0 * np.indices(
            (count, count)).reshape(2, -1) + 1.0), half)
        with np.errstate(all='ignore'):
            one, other = (rod.directions(poses, *cells[1:]) for rod in self.rods)
            away = np.mod(one.middle[:, None] - other.middle, math.pi)
            apart = np.minimum(away, math.pi - away) > one.half[:, None] + other.half + SINGULAR
        shared = np.packbits(one.allowed, axis=1)[:, None] & np.packbits(other.allowed, axis=1)
        return bool((apart | ~shared.any(axis=2)).all())

    def converges(self) -> bool:
        """Return whether Newton's method finds all poses of a grid, for all sides of cranks."""
        axes = [np.linspace(low, high, POSES) for low, high in zip(self.low, self.high)]
        poses = np.stack(np.meshgrid(*axes)).reshape(2, -1)
        with np.errstate(all='ignore'):
            return all(self._finds(poses, sides)
                       for sides in product(*(rod.sides for rod in self.rods)))

    def _finds(self, poses: np.ndarray, sides: Sequence[float]) -> bool:
        pivots = [rod.pivots(poses, side) for rod, side in zip(self.rods, sides)]
        assembled = ~np.isnan([pivot.x for pivot in pivots]).any(axis=0)
        rods = []
        for rod, pivot in zip(self.rods, pivots):
            pivot = Vector(*(x[assembled] for x in pivot))
            off = pivot.minus(_place(rod.end, poses[:, assembled]))
            rods.append((pivot, rod.end, np.sqrt(off.dot(off))))
        pose = _pose(self.middle)
        for _ in range(STEPS - 1):
            pose, _step = newton_step(rods, pose)
        errors = [np.angle((pose[2 * i] + 1j * pose[2 * i + 1])
                           * np.exp(-1j * poses[i, assembled])) for i in (0, 1)]
        # A NaN fails this comparison.
        return bool((np.abs(errors) < CONVERGED).all())


def _hull(cells: np.ndarray) -> np.ndarray:
    """Return whether the polygon that bounds some cells (k, n) of a square touches each cell."""
    count = round(cells.shape[1] ** 0.5)
    hull = np.ones(cells.shape, bool)
    for cos, sin in NORMALS:
        middles = np.add.outer(cos * np.arange(count), sin * np.arange(count)).ravel()
        # The distance of the middles of two cells whose corners touch.
        size = abs(cos) + abs(sin)
        low = np.where(cells, middles, np.inf).min(axis=1, keepdims=True) - size
        high = np.where(cells, middles, -np.inf).max(axis=1, keepdims=True) + size
        hull &= (low <= middles) & (middles <= high)
    return hull


def _norm(vector: Vector) -> float:
    return float(np.linalg.norm(vector))


def _flat(path: Circle) -> float:
    """Return a bound of a point's distance from the axis of the first hinge."""
    return math.hypot(*path.centre[:2]) + _norm(path.u)


def _pose(poses: np.ndarray) -> Pose:
    """Return the cosine and sine of the first and of the second angle."""
    first, second = poses
    return np.cos(first), np.sin(first), np.cos(second), np.sin(second)


def _place(end: Circle, poses: np.ndarray) -> Vector:
    cos, sin, *second = _pose(poses)
    return end.at(*second).turned(cos, sin)
