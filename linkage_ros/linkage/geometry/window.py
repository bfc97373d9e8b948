# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
A proof that a link on two hinges and two rods has one pose at most inside its joint limits.

A rod from its pivot A, on a crank that a motor turns, to its end B, which both angles of the link
turn, fits where f = (|A - B|^2 - L^2) / 2 is zero. Each crank is on its drawn side: the sign of
df/dtheta = (A - B).A' is that of the drawing. So a pose determines the motor angles.

Suppose two poses at the same motor angles, one in a box X of the joint limits and one in a box Y.
Then the motor angles of X and those of Y have some in common. And on the line from one pose to
the other each f has a gradient that is square to the line (Rolle), so somewhere in the box around
X and Y, at one of these motor angles, both rods have gradients of one direction, up to sign. Pairs
of boxes of which one of both is not so have no two poses; the others are divided. If none is left,
there is one pose at most for any motor angles, and no pose is singular.

In a box, f and its gradient differ from those in the middle by at most their first derivatives
there times half the box, and a bound of the second derivatives times half the square of that.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Sequence

import numpy as np

from .spatial import Circle, EDGE, HingeAngles, LAST_STEP, newton_step, row, STEPS, Vector
from ..tolerances import ROUNDING, SINGULAR

# The most pairs of boxes that a proof examines, and each trial in a search for a rectangle.
MAX_PAIRS, MAX_IN_SEARCH = 50_000, 4_000
# Newton's method is tried for this many poses per side of the rectangle. Its error [rad] one step
# before the last is well below LAST_STEP, so that it converges between these poses, too.
POSES, CONVERGED = 33, 0.01 * LAST_STEP
# Halvings in the search for the largest rectangle.
HALVINGS = 7
# Two poses differ by this [rad] at least; so many pairs are tried to find some.
DISTINCT, TRIED = 1e-4, 1000


class Boxes(NamedTuple):
    """Ranges of values: their middles (..., n), and half the length of their sides."""

    middle: np.ndarray
    half: Any

    def some(self, which: np.ndarray) -> Boxes:
        """Return some of the boxes, whose halves differ."""
        return Boxes(self.middle[which], self.half[which])


class WindowRod(NamedTuple):
    """
    A rod in the frame of the first hinge; its length [m] is None if it is an input.

    `side` is the sign of (A - B).A' in the drawing, for a pivot that a motor turns.
    """

    pivot: Circle
    end: Circle
    length: Any
    side: Any

    @property
    def is_on_crank(self) -> bool:
        """Whether a motor turns its pivot."""
        return self.length is not None and any(self.pivot.u)

    def motors(self, poses: np.ndarray) -> np.ndarray:
        """Return the motor's value for poses (2, n); NaN where the rod does not reach."""
        centre, u, v = self.pivot
        off = _place(self.end, poses).minus(centre)
        if not self.is_on_crank:
            return np.sqrt(off.dot(off)) if self.length is None else np.zeros(poses.shape[1])
        x, y = off.dot(u), off.dot(v)
        along = 0.5 * (u.dot(u) + off.dot(off) - self.length ** 2)
        return np.arctan2(y, x) + self.side * np.arccos(along / np.sqrt(x * x + y * y))

    def bar(self, motors: np.ndarray) -> tuple[Vector, Circle, Any]:
        """Return the place of the pivot, the path of the end and the length at motor values."""
        if self.is_on_crank:
            return self.pivot.at(np.cos(motors), np.sin(motors)), self.end, self.length
        return self.pivot.centre, self.end, motors if self.length is None else self.length

    def ranges(self, poses: Boxes) -> Boxes:
        """Return the ranges of the motor's values in boxes of poses; NaN for none."""
        pose, (centre, u, v), (k, e, *_) = _pose(poses.middle), self.pivot, self.end
        flat, radius, (hp, hr) = _flat(self.end), _norm(e), poses.half
        end = self.end.at(*pose[2:]).turned(*pose[:2])
        off, ahead = end.minus(centre), self.end.ahead(*pose[2:]).turned(*pose[:2])
        level = math.hypot(*centre[:2])
        rest = 0.5 * (flat * hp * hp + 2.0 * radius * hp * hr + radius * hr * hr)

        def moved(way: Vector) -> np.ndarray:
            return (abs(way.y * end.x - way.x * end.y) * hp + abs(way.dot(ahead)) * hr)

        # Half the square of the distance from the crank's centre, and by how much it may differ.
        square, size = 0.5 * off.dot(off), _norm(centre) + _norm(u) + _norm(k) + radius
        slack = moved(off) + 0.5 * (
            level * flat * hp * hp + 2.0 * level * radius * hp * hr
            + (_norm(centre) + _norm(k)) * radius * hr * hr) + ROUNDING * size * size
        if not self.is_on_crank:
            if self.length is None:
                low, high = (np.sqrt(np.maximum(2.0 * (square + way * slack), 0.0))
                             for way in (-1.0, 1.0))
                return Boxes(0.5 * (low + high), 0.5 * (high - low) + SINGULAR * size)
            fits = abs(square - 0.5 * self.length ** 2) <= slack + ROUNDING * self.length ** 2
            return Boxes(np.zeros_like(square), np.where(fits, 0.0, np.nan))
        rho = _norm(u)
        x, y = off.dot(u) / rho, off.dot(v) / rho
        reach = np.sqrt(x * x + y * y)
        radial, tangent = (u.times(a / reach / rho).plus(v.times(b / reach / rho))
                           for a, b in ((x, y), (-y, x)))
        shortest, aside = reach - moved(radial) - rest, moved(tangent) + rest
        longest = np.hypot(2.0 * reach - shortest, aside)
        along = square + 0.5 * (rho * rho - self.length ** 2)
        slack = slack + ROUNDING * self.length ** 2
        lower, upper = ((along + way * slack) / (rho * np.where(
            (along + way * slack) * way >= 0.0, shortest, longest)) for way in (-1.0, 1.0))
        first, last = (np.arccos(np.clip(cos, -1.0, 1.0)) for cos in (upper, lower))
        turn = np.arctan2(aside, shortest) + SINGULAR
        none = (lower > 1.0) | (upper < -1.0)
        middle = np.arctan2(y, x) + self.side * 0.5 * (first + last)
        half = np.minimum(0.5 * (last - first) + turn, math.pi)
        return Boxes(middle, np.select([shortest <= 0.0, none], [math.pi, np.nan], half))

    def shared(self, first: Boxes, second: Boxes) -> Boxes:
        """Return the motor's values that ranges share with others, or more; NaN for none."""
        start = second.middle
        if self.is_on_crank:
            start = start - math.tau * np.round((start - first.middle) / math.tau)
        low = np.maximum(first.middle - first.half, start - second.half)
        high = np.minimum(first.middle + first.half, start + second.half)
        half = np.where(low <= high, 0.5 * (high - low), np.nan)
        # Large ranges of angles may meet at both of their ends.
        wide = self.is_on_crank & (first.half + second.half > math.pi - SINGULAR)
        smaller = np.where(first.half <= second.half, first.middle, start)
        return Boxes(np.where(wide, smaller, 0.5 * (low + high)),
                     np.where(wide, np.minimum(first.half, second.half), half))

    def directions(self, motors: Boxes, poses: Boxes) -> Boxes:
        """Return the directions [rad] of gradients in boxes of motor values and of poses."""
        pose = _pose(poses.middle)
        pivot, _, _ = self.bar(motors.middle)
        moved, turn = (self.pivot.ahead(np.cos(motors.middle), np.sin(motors.middle)),
                       motors.half) if self.is_on_crank else (Vector(0.0, 0.0, 0.0), 0.0)
        rod, by_p, by_r = row(pivot, self.end, pose)
        centre, end, ahead = (vector.turned(*pose[:2]) for vector in (
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
        rest = 0.5 * self._bent() * sum(halves) ** 2
        along, aside = steep - rest - sum(abs(x.real) for x in parts), rest + sum(
            abs(x.imag) for x in parts)
        return Boxes(np.angle(gradient), np.where(along > 0.0, np.arctan2(aside, along), np.pi))

    def _bent(self) -> float:
        """Return a bound of the second derivatives of the gradient."""
        pivot, end, radius = (_norm(self.pivot.centre) + _norm(self.pivot.u),
                              _norm(self.end.centre), _norm(self.end.u))
        return math.hypot(_flat(self.pivot) * _flat(self.end), (pivot + end) * radius)


class Window:
    """A rectangle [rad] of both angles of a link on two hinges in a row, held by two rods."""

    def __init__(self, rods: Sequence[WindowRod], low: Sequence[float], high: Sequence[float]):
        self.rods = rods
        self.low, self.high = np.asarray(low, float), np.asarray(high, float)
        self.middle = 0.5 * (self.low + self.high)

    def largest(self) -> Window | None:
        """
        Return the largest rectangle of this shape that is found to be proved, if any.

        Its ends are tenths of a degree.
        """
        size, step, best = 0.0, 0.5, None
        for _ in range(HALVINGS):
            half = (size + step) * (self.high - self.middle)
            ends = (np.ceil(10.0 * np.degrees(self.middle - half)),
                    np.floor(10.0 * np.degrees(self.middle + half)))
            tried = Window(self.rods, *np.radians(0.1 * np.array(ends)))
            if (tried.low < tried.high).all() and tried.is_proved(MAX_IN_SEARCH):
                size, best = size + step, tried
            step *= 0.5
        return best

    def is_proved(self, most: int = MAX_PAIRS) -> bool:
        """Return whether it has one pose at most, by proof, and Newton's method finds it."""
        return self._is_found() and not self.undecided(most)[0].size

    def undecided(self, most: int = MAX_PAIRS) -> tuple[np.ndarray, np.ndarray]:
        """Return the middles (2, n) of pairs of boxes that may have two poses of some motors."""
        # A little beyond the edges.
        middle, half = self.middle[:, None], 0.5 * (self.high - self.low) + 2.0 * EDGE
        first = second = np.zeros(1, int)
        while len(first):
            most -= len(first)
            open_ = self._is_open(Boxes(middle, half), first, second)
            first, second = first[open_], second[open_]
            if most < 0:
                break
            side = int(np.argmax(half))
            half = np.where(np.arange(2) == side, 0.5 * half, half)
            middle = np.repeat(middle, 2, axis=1)
            middle[side] += half[side] * np.tile((-1.0, 1.0), middle.shape[1] // 2)
            both = first != second
            first, second = (np.concatenate([
                2 * first, 2 * first, 2 * first + 1, 2 * first[both] + 1]), np.concatenate([
                    2 * second, 2 * second + 1, 2 * second + 1, 2 * second[both]]))
            used, places = np.unique(np.concatenate([first, second]), return_inverse=True)
            middle, (first, second) = middle[:, used], places.reshape(2, -1)
        return middle[:, first], middle[:, second]

    def _is_open(self, boxes: Boxes, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Return whether pairs of boxes may have two poses of some motors."""
        start, end = boxes.middle[:, first], boxes.middle[:, second]
        around = Boxes(0.5 * (start + end), boxes.half[:, None] + 0.5 * abs(start - end))
        with np.errstate(all='ignore'):
            ranges = [rod.ranges(boxes) for rod in self.rods]
            shared = [rod.shared(motors.some(first), motors.some(second))
                      for rod, motors in zip(self.rods, ranges)]
            right, left = (
                rod.directions(motors, around) for rod, motors in zip(self.rods, shared))
            angle = np.mod(right.middle - left.middle, math.pi)
            differ = np.minimum(angle, math.pi - angle) > right.half + left.half + SINGULAR
        return ~(differ | np.isnan(shared[0].half) | np.isnan(shared[1].half))

    def second_pose(self) -> tuple[tuple[float, float], Sequence[np.ndarray]] | None:
        """
        Return motors and two poses [rad] that they have, far from each other, if some are found.

        Motors are angles of cranks, or lengths [m].
        """
        start, other = (ends.clip(self.low[:, None], self.high[:, None])
                        for ends in self.undecided())
        # Not more than Newton's method can try at once.
        distance = np.abs(start - other).max(axis=0)
        some = np.argsort(-distance, kind='stable')[::max(1, len(distance) // TRIED)]
        start, other = start[:, some], other[:, some]
        with np.errstate(all='ignore'):
            motors = [rod.motors(start) for rod in self.rods]
            solved = self._closed([rod.bar(motor) for rod, motor in zip(self.rods, motors)], other,
                                  2 * STEPS)
            again = [rod.motors(solved) for rod in self.rods]
            good = (solved > self.low[:, None]) & (solved < self.high[:, None])
            good &= [abs(np.exp(1j * reached) - np.exp(1j * motor)) < CONVERGED if rod.is_on_crank
                     else abs(reached - motor) < CONVERGED * motor
                     for rod, reached, motor in zip(self.rods, again, motors)]
        distance = np.abs(solved - start).max(axis=0) * good.all(axis=0)
        if not (distance > DISTINCT).any():
            return None
        i = int(np.nanargmax(distance))
        return (motors[0][i], motors[1][i]), (start[:, i], solved[:, i])

    def _is_found(self) -> bool:
        """Return whether Newton's method finds the poses of a grid, from the middle."""
        axes = [np.linspace(low, high, POSES) for low, high in zip(self.low, self.high)]
        poses = np.stack(np.meshgrid(*axes)).reshape(2, -1)
        with np.errstate(all='ignore'):
            motors = np.array([rod.motors(poses) for rod in self.rods])
            assembled = ~np.isnan(motors).any(axis=0)
            poses, motors = poses[:, assembled], motors[:, assembled]
            solved = self._closed([rod.bar(motor) for rod, motor in zip(self.rods, motors)],
                                  self.middle, STEPS - 1)
        # A NaN fails this comparison.
        return bool((np.abs(solved - poses) < CONVERGED).all())

    @staticmethod
    def _closed(bars: Sequence[tuple[Vector, Circle, Any]], start: np.ndarray, steps: int
                ) -> np.ndarray:
        """Return poses after so many steps of Newton's method."""
        pose = _pose(start)
        for _ in range(steps):
            pose, _step = newton_step(bars, pose)
        return np.arctan2(pose[1::2], pose[::2])


def _norm(vector: Vector) -> float:
    return float(np.linalg.norm(vector))


def _flat(path: Circle) -> float:
    """Return a bound of a point's distance from the axis of the first hinge."""
    return math.hypot(*path.centre[:2]) + _norm(path.u)


def _pose(poses: np.ndarray) -> HingeAngles:
    """Return the cosine and sine of the first and of the second angle."""
    first, second = poses
    return np.cos(first), np.sin(first), np.cos(second), np.sin(second)


def _place(end: Circle, poses: np.ndarray) -> Vector:
    cos, sin, *second = _pose(poses)
    return end.at(*second).turned(cos, sin)
