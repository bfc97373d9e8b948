# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
A proof that a link on two hinges and two rods has one pose at most inside its joint limits.

A rod from its pivot A, which a motor turns, to its end B, which both angles of the link turn, fits
where f = (|A - B|^2 - L^2) / 2 is zero. Suppose that two poses had the same motors. On the line
from one to the other each rod's f has a gradient that is square to the line (Rolle), somewhere in
the convex hull of the poses that this rod allows at this motor angle. So there are no two poses,
and none is singular, where the directions of one rod's gradients in its hull and those of the
other's have none in common, up to sign.

Rectangle and motor angles are divided into cells. In a cell, f and its gradient differ from those
in the middle by at most their first derivatives there times half the cell, and a bound of the
second derivatives times half the square of that: all of the cell is proved, not its middle.
"""

from __future__ import annotations

from itertools import product
from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from .spatial import EDGE, LAST_STEP, STEPS

# Cells on each side of the rectangle, of all motor angles, and again of each of these that is
# needed: at first, and for limits that are given where that is too coarse.
COARSE, FINE = (12, 36, 3), (20, 48, 4)
# What directions [rad] have to be apart, and what rounding may do to f, as a part of its terms.
APART, ROUNDING = 1e-6, 1e-14
# Poses on each side of the rectangle to which the steps have to come back, one step before the
# last, and how near [rad]: what is left is the last step, which is to be below its limit between
# these poses, too.
POSES, BACK = 33, 0.01 * LAST_STEP
# Halvings on the way to the largest rectangle; how much smaller it becomes if steps do not do.
HALVINGS, SMALLER = 6, 0.9
# The hull is taken to be a polygon of 16 sides: directions in units of cells.
SIDES = [(np.cos(angle), np.sin(angle)) for angle in np.arange(8) * np.pi / 8.0]


class Way(NamedTuple):
    """The way of a point that turns: centre + cos u + sin v, arrays (3,)."""

    centre: np.ndarray
    u: np.ndarray
    v: np.ndarray

    def at(self, angle: np.ndarray) -> np.ndarray:
        """Return places (3, n)."""
        return self.centre[:, None] + np.outer(self.u, np.cos(angle)) \
            + np.outer(self.v, np.sin(angle))

    def ahead(self, angle: np.ndarray) -> np.ndarray:
        """Return the derivatives (3, n) of places by the angle."""
        return np.outer(self.v, np.cos(angle)) - np.outer(self.u, np.sin(angle))

    @property
    def radius(self) -> float:
        """How far the point is from the axis."""
        return float(np.linalg.norm(self.u))


class Cells(NamedTuple):
    """Cells of one size: their middles (..., n), and half of their sides."""

    middle: np.ndarray
    half: np.ndarray


class Directions(NamedTuple):
    """By cells of a motor (k,): which cells of poses each allows (k, n), directions [rad]."""

    allowed: np.ndarray
    middle: np.ndarray
    half: np.ndarray


class HeldBy(NamedTuple):
    """A rod in the frame of the first hinge; its length is None where it is an input."""

    pivot: Way
    end: Way
    length: Optional[float]

    @property
    def sides(self) -> Tuple[float, ...]:
        """The sides of a crank on which a pose may have it; one where no crank turns."""
        return (1.0, -1.0) if self.length is not None and self.pivot.radius > 0.0 else (0.0,)

    def motor_angles(self, poses: np.ndarray, side: float) -> np.ndarray:
        """Return motor angles (n,) for poses (2, n); NaN where the rod does not reach."""
        if self.length is None or not side:
            return np.zeros(poses.shape[1])
        off = _place(self.end, poses) - self.pivot.centre[:, None]
        x, y = self.pivot.u @ off, self.pivot.v @ off
        along = 0.5 * (self.pivot.radius ** 2 + _dot(off, off) - self.length ** 2)
        with np.errstate(invalid='ignore'):
            return np.arctan2(y, x) + side * np.arccos(along / np.hypot(x, y))

    def row(self, pivot: np.ndarray, poses: np.ndarray) -> Tuple[np.ndarray, ...]:
        """Return |A - B|^2 / 2 and its gradient, for places (3, n) of the pivot and poses."""
        end, by_r = _place(self.end, poses), _turned(self.end.ahead(poses[1]), poses[0])
        rod = pivot - end
        return 0.5 * _dot(rod, rod), -_dot(pivot, _quarter(end)), -_dot(rod, by_r)

    def directions(self, poses: Cells, count: int, again: int) -> Directions:
        """Return the directions of its gradients in cells of a rectangle."""
        motors = self._motors(poses, count)
        if len(motors.middle) > 1:
            coarse, half = self._over(motors, poses)[0].any(axis=1), motors.half / again
            motors = Cells((motors.middle[coarse, None] + half * np.arange(
                1 - again, again, 2)).ravel(), half)
        allowed, gradient, spread = self._over(motors, poses)
        needed = allowed.any(axis=1)
        allowed, gradient, spread = allowed[needed], gradient[needed], spread[needed]
        first = np.take_along_axis(gradient, allowed.argmax(axis=1)[:, None], 1)
        turned, hull = np.angle(gradient * first.conj()), _hull(allowed)
        low = np.where(hull, turned - spread, np.inf).min(axis=1, initial=np.inf)
        high = np.where(hull, turned + spread, -np.inf).max(axis=1, initial=-np.inf)
        return Directions(allowed, np.angle(first[:, 0]) + 0.5 * (low + high), 0.5 * (high - low))

    def _motors(self, poses: Cells, count: int) -> Cells:
        """Return cells of all motor angles, or of all lengths, that poses may need."""
        if len(self.sides) > 1:
            low, high = -np.pi, np.pi
        elif self.length is None:
            away = np.linalg.norm(_place(self.end, poses.middle) - self.pivot.centre[:, None],
                                  axis=0)
            slack = poses.half @ (_flat(self.end), self.end.radius)
            low, high = max(away.min() - slack, 0.0), away.max() + slack
        else:
            return Cells(np.zeros(1), np.zeros(()))
        half = np.array(0.5 * (high - low) / count)
        return Cells(low + half * np.arange(1, 2 * count, 2), half)

    def _over(self, motors: Cells, poses: Cells) -> Tuple[np.ndarray, ...]:
        """
        Return what holds over cells of a motor and of poses, arrays (k, n).

        That is whether f may be zero, the gradient in the middle as x + iy, and by how much [rad]
        its direction may differ elsewhere.
        """
        angles, turn, lengths, way = (
            (motors.middle, motors.half, self.length, 0.0) if self.length is not None else
            (np.zeros(len(motors.middle)), 0.0, motors.middle, motors.half))
        pivot, moved = self.pivot.at(angles).T, self.pivot.ahead(angles).T
        ends, own = self._ends(poses.middle)
        # Not as products of matrices: for these numpy starts threads, which take longer.
        parts, by_motor = (-np.einsum('kx,sxn->skn', x, y) for x, y in (
            (pivot, ends), (moved, ends[:3])))
        parts += own[:, None]
        parts[0] += np.reshape(0.5 * ((pivot ** 2).sum(axis=1) - lengths ** 2), (-1, 1))
        by_motor[0] += (pivot * moved).sum(axis=1)[:, None]
        halves = turn, *poses.half
        square = 0.5 * sum(halves) ** 2
        first, second, motor, size = self._bounds()
        terms = [np.abs(x) * half for x, half in zip((by_motor[0], *parts[1:3]), halves)]
        slack = np.reshape(way * (lengths + 0.5 * way), (-1, 1)) + ROUNDING * (
            size + np.max(lengths)) ** 2
        possible = ~(np.abs(parts[0]) > sum(terms) + square * max(first, second, motor) + slack)
        gradient = parts[1] + 1j * parts[2]
        length = np.abs(gradient)
        along, across = length - square * np.hypot(first, second), square * np.hypot(first, second)
        for x, y, half in zip((by_motor[1], *parts[3:5]), (by_motor[2], *parts[4:6]), halves):
            change = (x + 1j * y) * gradient.conj() * (half / length)
            along, across = along - np.abs(change.real), across + np.abs(change.imag)
        return possible, gradient, np.where(along > 0.0, np.arctan2(across, along), np.pi)

    def _ends(self, poses: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return B and its derivatives (6, 3, n): p, r, pp, pr, rr; of |B|^2 / 2 as well."""
        end, by_r = _place(self.end, poses), _turned(self.end.ahead(poses[1]), poses[0])
        by_rr = _turned(np.broadcast_to(self.end.centre[:, None], end.shape), poses[0]) - end
        none = np.zeros(end.shape[1])
        return np.array([end, _quarter(end), by_r, _quarter(_quarter(end)), _quarter(by_r),
                         by_rr]), np.array([
                             0.5 * _dot(end, end), none, _dot(end, by_r), none, none,
                             self.end.radius ** 2 + _dot(end, by_rr)])

    def _bounds(self) -> Tuple[float, float, float, float]:
        """Return bounds of derivatives of f by the first, second angle, motor; of A and B."""
        pivot, end = (float(np.linalg.norm(way.centre)) for way in (self.pivot, self.end))
        return (_flat(self.pivot) * _flat(self.end),
                (pivot + self.pivot.radius + end) * self.end.radius,
                (pivot + end + self.end.radius) * self.pivot.radius,
                pivot + self.pivot.radius + end + self.end.radius)


class Window:
    """
    A rectangle of both angles of a link on two hinges in a row, held by two rods.

    Parameters
    ----------
    rods : sequence of HeldBy
        Both rods.
    low, high : array-like (2,)
        The rectangle [rad].

    """

    def __init__(self, rods: Sequence[HeldBy], low: Sequence[float], high: Sequence[float]):
        self.rods = rods
        self.low, self.high = np.asarray(low, float), np.asarray(high, float)

    def scaled(self, factor: float) -> Window:
        """Return the rectangle made larger or smaller about its middle."""
        middle, half = 0.5 * (self.low + self.high), 0.5 * (self.high - self.low)
        return Window(self.rods, middle - factor * half, middle + factor * half)

    def largest(self) -> Window:
        """Return the largest rectangle of this shape, up to its size, that is right."""
        size, step = 0.0, 0.5
        for _ in range(HALVINGS):
            size += step * self.scaled(size + step).is_single(COARSE)
            step *= 0.5
        while size > step and not self.scaled(size).comes_back():
            size *= SMALLER
        return self.scaled(size if size > step else 0.0)

    def is_right(self) -> bool:
        """Return whether it holds one pose at most for any motor angles, and all are found."""
        return (self.is_single(COARSE) or self.is_single(FINE)) and self.comes_back()

    def is_single(self, cells: Tuple[int, int, int]) -> bool:
        """Return whether it is proved that it holds one pose at most for any motor angles."""
        poses = self._poses(cells[0])
        with np.errstate(all='ignore'):
            one, other = (rod.directions(poses, *cells[1:]) for rod in self.rods)
            shared = (np.packbits(one.allowed, axis=1)[:, None]
                      & np.packbits(other.allowed, axis=1)).any(axis=2)
            away = np.mod(one.middle[:, None] - other.middle, np.pi)
            apart = np.minimum(away, np.pi - away) > one.half[:, None] + other.half + APART
        return bool((apart | ~shared).all())

    def _poses(self, count: int) -> Cells:
        """Return cells of the rectangle, a little beyond its edges."""
        low, high = self.low - 2.0 * EDGE, self.high + 2.0 * EDGE
        half = 0.5 * (high - low) / count
        return Cells(low[:, None] + half[:, None] * (2.0 * np.indices(
            (count, count)).reshape(2, -1) + 1.0), half)

    def comes_back(self) -> bool:
        """Return whether the steps find all poses of a grid, whichever sides cranks are on."""
        axes = [np.linspace(low, high, POSES) for low, high in zip(self.low, self.high)]
        grid = np.stack(np.meshgrid(*axes)).reshape(2, -1)
        return all(self._steps_back(grid, sides) < BACK
                   for sides in product(*(rod.sides for rod in self.rods)))

    def _steps_back(self, poses: np.ndarray, sides: Sequence[float]) -> float:
        """Return how far [rad] from poses the steps but the last end at most."""
        angles = [rod.motor_angles(poses, side) for rod, side in zip(self.rods, sides)]
        there = ~np.isnan(angles).any(axis=0)
        poses, pivots = poses[:, there], [
            rod.pivot.at(angle[there]) for rod, angle in zip(self.rods, angles)]

        def rows(at: np.ndarray) -> List[Tuple[np.ndarray, ...]]:
            return [rod.row(pivot, at) for rod, pivot in zip(self.rods, pivots)]

        wanted = [row[0] for row in rows(poses)]
        found = np.outer(0.5 * (self.low + self.high), np.ones(poses.shape[1]))
        with np.errstate(all='ignore'):
            for _ in range(STEPS - 1):
                (f, a, b), (g, c, d) = rows(found)
                f, g = wanted[0] - f, wanted[1] - g
                step = np.array([f * d - b * g, a * g - f * c]) / (a * d - b * c)
                found = found + 2.0 * np.arctan(0.5 * step)
        # One that is nowhere is infinitely far.
        return float(np.nan_to_num(np.abs(found - poses), nan=np.inf).max(initial=0.0))


def _hull(cells: np.ndarray) -> np.ndarray:
    """Return which cells (k, n) of a square a polygon about some of them touches."""
    count = round(cells.shape[1] ** 0.5)
    hull = np.ones(cells.shape, bool)
    for cos, sin in SIDES:
        middles = np.add.outer(cos * np.arange(count), sin * np.arange(count)).ravel()
        # From middle to middle of cells whose corners touch.
        size = abs(cos) + abs(sin)
        low = np.where(cells, middles, np.inf).min(axis=1, keepdims=True) - size
        high = np.where(cells, middles, -np.inf).max(axis=1, keepdims=True) + size
        hull &= (low <= middles) & (middles <= high)
    return hull


def _flat(way: Way) -> float:
    """Return how far a point may be from the first hinge."""
    return float(np.linalg.norm(way.centre[:2])) + way.radius


def _dot(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return sum(a * b for a, b in zip(x, y))


def _turned(vector: np.ndarray, angle: np.ndarray) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    x, y, z = vector
    return np.array([x * cos - y * sin, x * sin + y * cos, z])


def _quarter(vector: np.ndarray) -> np.ndarray:
    """Return the derivative of a vector by an angle about z."""
    x, y, _ = vector
    return np.array([-y, x, np.zeros(len(x))])


def _place(end: Way, poses: np.ndarray) -> np.ndarray:
    return _turned(end.at(poses[1]), poses[0])
