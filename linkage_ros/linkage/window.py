# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
A proof that a link on two hinges and two rods has one pose at most inside its joint limits.

With J the derivatives of half the squared lengths of both rods, C a constant matrix: if C J has
positive diagonal entries and a positive determinant all over a rectangle of both angles, there is
one pose at most in it (Gale and Nikaido, "The Jacobian matrix and global univalence of mappings",
Math. Annalen 159 (1965)). C is J^-1 in the middle of the rectangle, one for each cell of motor
angles that the rectangle needs. Cells are divided until the three numbers, less their change
between the middle of a cell and its edges, are positive: all of the cell is then proved, not the
middle alone. The change is at most each first derivative in the middle times half the cell, and a
bound of the second derivatives times half the square of that.
"""

from __future__ import annotations

from functools import cached_property
from itertools import product
from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from .spatial import EDGE, STEPS

# Cells at first, on each side of the rectangle, and how often one is divided at most.
CELLS, DIVIDED = 6, 7
# Pairs of cells at most: of limits that are given, which takes a third of a second, and of those
# that are looked for.
MOST, FEW = 400_000, 150_000
# What three numbers that are 1 in the middle have to be above.
LEAST = 1e-6
# Poses on each side of the rectangle to which the steps have to come back, one step before the
# last, and how near [rad].
POSES, BACK = 33, 1e-6
# Halvings on the way to the largest rectangle.
HALVINGS = 6

Rectangle = Tuple[np.ndarray, np.ndarray]


class Way(NamedTuple):
    """The way of a point that turns: centre + cos u + sin v, arrays (3,)."""

    centre: np.ndarray
    u: np.ndarray
    v: np.ndarray

    def at(self, angle: np.ndarray) -> np.ndarray:
        """Return places (3, n)."""
        return self.centre[:, None] + self.from_centre(angle)

    def from_centre(self, angle: np.ndarray) -> np.ndarray:
        """Return places (3, n) as seen from the centre."""
        return np.outer(self.u, np.cos(angle)) + np.outer(self.v, np.sin(angle))

    def ahead(self, angle: np.ndarray) -> np.ndarray:
        """Return the derivatives (3, n) of places by the angle."""
        return np.outer(self.v, np.cos(angle)) - np.outer(self.u, np.sin(angle))

    @property
    def radius(self) -> float:
        """How far the point is from the axis."""
        return float(np.linalg.norm(self.u))


class HeldBy(NamedTuple):
    """A rod in the frame of the first hinge; its length is None where it is an input."""

    pivot: Way
    end: Way
    length: Optional[float]


class Pivots(NamedTuple):
    """Places of a rod's pivot (3, n), and their derivatives by the motor's angle."""

    place: np.ndarray
    moved: np.ndarray


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
        self._turning = [rod.length is not None and rod.pivot.radius > 0.0 for rod in rods]
        self._sides = [(1.0, -1.0) if turning else (0.0,) for turning in self._turning]

    def scaled(self, factor: float) -> Window:
        """Return the rectangle made larger or smaller about its middle."""
        middle, half = 0.5 * (self.low + self.high), 0.5 * (self.high - self.low)
        return Window(self.rods, middle - factor * half, middle + factor * half)

    def largest(self) -> Window:
        """Return the largest rectangle of this shape, up to its size, that is right."""
        size, step = 0.0, 0.5
        for _ in range(HALVINGS):
            if self.scaled(size + step).is_right(FEW):
                size += step
            step *= 0.5
        return self.scaled(size)

    def is_right(self, most: int = MOST) -> bool:
        """Return whether it holds one pose at most for any motor angles, and all are found."""
        return self._comes_back() and self.is_single(most)

    def is_single(self, most: int = MOST) -> bool:
        """Return whether it is proved that it holds one pose at most for any motor angles."""
        cells = self._cells(CELLS)
        if not any(self._turning):  # whatever the lengths are, the derivatives are the same
            cells = np.array([[*0.5 * (self.low + self.high), 0.0, 0.0]])
        chosen = np.array(list(product(*self._sides)))
        needed = np.repeat(cells, len(chosen), axis=0), np.tile(chosen, (len(cells), 1))
        self._left = most
        for _ in range(DIVIDED):
            failing = self._failing(*needed)
            if not len(failing) or self._left < 0:
                return self._left >= 0
            needed = _divided(needed[0][failing]), np.repeat(needed[1][failing], 4, axis=0)
        return False

    def _cells(self, count: int) -> np.ndarray:
        """Return cells of the rectangle, a little beyond its edges: middle and half size."""
        low, high = self.low - 2.0 * EDGE, self.high + 2.0 * EDGE
        half = 0.5 * (high - low) / count
        middles = np.stack(np.meshgrid(*(
            np.linspace(a + h, b - h, count) for a, b, h in zip(low, high, half)),
            indexing='ij'), axis=-1).reshape(-1, 2)
        return np.concatenate([middles, np.broadcast_to(half, middles.shape)], axis=1)

    def _failing(self, cells: np.ndarray, sides: np.ndarray) -> np.ndarray:
        """Return which cells of poses need motor angles that are not proved."""
        arcs = [self._arcs(*each) for each in zip(self.rods, self._turning, sides.T, [cells] * 2)]
        needed = np.flatnonzero(np.logical_and.reduce([half >= 0.0 for _, half in arcs]))
        pivots = [self._pivots(rod, middle[needed]) for rod, (middle, _) in zip(self.rods, arcs)]
        spread = np.array([half[needed] for _, half in arcs])
        middle = np.outer(0.5 * (self.low + self.high), np.ones(len(needed)))
        weights = _inverse(self._rows(pivots, middle)[0])
        boxes = self._cells(CELLS)
        motor = np.repeat(np.arange(len(needed)), len(boxes))
        boxes = np.tile(boxes, (len(needed), 1))
        failing = np.zeros(len(needed), bool)
        for _ in range(DIVIDED):
            self._left -= len(motor)
            if self._left < 0:
                break
            kept, possible = self._proved(
                weights[..., motor], [Pivots(*(x[:, motor] for x in each)) for each in pivots],
                spread[:, motor], boxes)
            # Smaller boxes are of no use where the motors' spread alone is too much.
            failing[motor[~possible]] = True
            left = ~kept & ~failing[motor]
            motor, boxes = np.repeat(motor[left], 4), _divided(boxes[left])
            if not len(motor):
                break
        failing[motor] = True
        return needed[failing]

    @staticmethod
    def _arcs(rod: HeldBy, turning: bool, side: np.ndarray,
              cells: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return the motor angles that cells of poses need: middle and half; below 0 for none."""
        if not turning or rod.length is None:
            return np.zeros(len(cells)), np.zeros(len(cells))
        end, pivot = _place(rod.end, cells[:, :2].T), rod.pivot
        rho = pivot.radius
        off = end - pivot.centre[:, None]
        x, y = pivot.u @ off / rho, pivot.v @ off / rho
        # All ends in a cell are in a ball, so the rod is as if it were shorter or longer.
        from_axis = np.hypot(*end[:2])
        ball = cells[:, 2] * from_axis + cells[:, 3] * rod.end.radius \
            + 0.5 * cells[:, 2:].sum(axis=1) ** 2 * (from_axis + rod.end.radius)
        cosines = [(rho ** 2 + _dot(off, off) - length ** 2) / (2.0 * rho * np.hypot(x, y))
                   for length in (np.maximum(rod.length - ball, 0.0), rod.length + ball)]
        low, high = (np.arccos(np.clip(c, -1.0, 1.0)) for c in cosines)
        missed = (cosines[0] < -1.0) | (cosines[1] > 1.0)
        return (np.arctan2(y, x) + side * 0.5 * (low + high),
                np.where(missed, -1.0, 0.5 * (high - low)))

    @staticmethod
    def _pivots(rod: HeldBy, angle: np.ndarray) -> Pivots:
        return Pivots(rod.pivot.at(angle), rod.pivot.ahead(angle))

    def _rows(self, pivots: Sequence[Pivots], poses: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return J (2, 2, n), and its derivatives by own motor and both angles (2, 2, 3, n)."""
        values, changes = [], []
        for rod, (pivot, moved) in zip(self.rods, pivots):
            end = _place(rod.end, poses)
            by_r, by_rr = (_turned(x, poses[0]) for x in (
                rod.end.ahead(poses[1]), -rod.end.from_centre(poses[1])))
            by_p, by_pr = _quarter(end), _quarter(by_r)
            across = -_dot(pivot, by_pr)
            values.append([-_dot(pivot, by_p), -_dot(pivot - end, by_r)])
            changes.append([[-_dot(moved, by_p), _dot(pivot[:2], end[:2]), across],
                            [-_dot(moved, by_r), across,
                             rod.end.radius ** 2 - _dot(pivot - end, by_rr)]])
        return np.array(values), np.array(changes)

    @cached_property
    def _bounds(self) -> np.ndarray:
        """Bounds (2, 2) of the entries of J and of their derivatives up to the second."""
        found = []
        for rod in self.rods:
            pivot, centre = (np.linalg.norm(x) for x in (rod.pivot.centre, rod.end.centre))
            flat, end = (np.linalg.norm(way.centre[:2]) + way.radius
                         for way in (rod.pivot, rod.end))
            found.append([flat * end, (pivot + rod.pivot.radius + centre) * rod.end.radius])
        return np.array(found)

    def _proved(self, weights: np.ndarray, pivots: Sequence[Pivots], spread: np.ndarray,
                boxes: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return which pairs of cells are proved, and which could be with smaller poses."""
        half, bounds = boxes[:, 2:].T, self._bounds
        rows, changes = self._rows(pivots, boxes[:, :2].T)
        (a, b), (c, d) = rows
        (da, db), (dc, dd) = changes
        det = _determinant(weights)
        # Either entry: each row of J changes with its own motor, and with both angles.
        parts = weights[:, :, None] * np.moveaxis(changes, 1, 0)
        value = [*(weights * rows.swapaxes(0, 1)).sum(axis=1), det * (a * d - b * c)]
        by_motors = [*(np.abs(parts[:, :, 0]) * spread).sum(axis=1), np.abs(det) * (
            np.abs(da[0] * d - db[0] * c) * spread[0] + np.abs(a * dd[0] - b * dc[0]) * spread[1])]
        slopes = [*parts[:, :, 1:].sum(axis=1), det * (
            da[1:] * d + a * dd[1:] - db[1:] * c - b * dc[1:])]
        by_poses = [(np.abs(slope) * half).sum(axis=0) for slope in slopes]

        def rest(sizes: np.ndarray) -> List[np.ndarray]:
            """Return what second derivatives add where each row changes by so much."""
            entries = np.einsum('kin,ik,in->kn', np.abs(weights), bounds, sizes ** 2)
            most = np.minimum(np.abs(rows) + bounds[..., None] * sizes[:, None], bounds[..., None])
            products = [bounds[0, i] * most[1, 1 - i] * sizes[0] ** 2
                        + 2.0 * bounds[0, i] * bounds[1, 1 - i] * sizes[0] * sizes[1]
                        + bounds[1, 1 - i] * most[0, i] * sizes[1] ** 2 for i in range(2)]
            return [*0.5 * entries, 0.5 * np.abs(det) * (products[0] + products[1])]

        alone = np.min([x - y - z for x, y, z in zip(value, by_motors, rest(spread))], axis=0)
        with_poses = np.min([x - y - z - w for x, y, z, w in zip(
            value, by_motors, by_poses, rest(spread + half.sum(axis=0)))], axis=0)
        return with_poses > LEAST, alone > LEAST

    def _comes_back(self) -> bool:
        """Return whether the steps find all poses of a grid, and none of them is singular."""
        axes = [np.linspace(low, high, POSES) for low, high in zip(self.low, self.high)]
        poses = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
        cells = np.concatenate([poses, np.zeros(poses.shape)], axis=1)
        for sides in product(*self._sides):
            arcs = [self._arcs(rod, turning, np.full(len(cells), side), cells)
                    for rod, turning, side in zip(self.rods, self._turning, sides)]
            there = np.logical_and.reduce([half >= 0.0 for _, half in arcs])
            wanted = poses[there].T
            pivots = [self._pivots(rod, middle[there])
                      for rod, (middle, _) in zip(self.rods, arcs)]
            signs = np.sign(_determinant(self._rows(pivots, wanted)[0]))
            if (signs != signs[:1]).any() or not (
                    np.abs(self._found(wanted, pivots) - wanted) < BACK).all():
                return False
        return True

    def _found(self, wanted: np.ndarray, pivots: Sequence[Pivots]) -> np.ndarray:
        """Return where the steps but the last lead from the middle, for the rods of poses."""
        def squares(poses: np.ndarray) -> np.ndarray:
            rods = [pivot - _place(rod.end, poses) for rod, (pivot, _) in zip(self.rods, pivots)]
            return 0.5 * np.array([_dot(rod, rod) for rod in rods])

        poses = np.outer(0.5 * (self.low + self.high), np.ones(wanted.shape[1]))
        target = squares(wanted)
        with np.errstate(all='ignore'):
            for _ in range(STEPS - 1):
                step = (_inverse(self._rows(pivots, poses)[0])
                        * (target - squares(poses))).sum(axis=1)
                poses = poses + 2.0 * np.arctan(0.5 * step)
        return poses


def _divided(cells: np.ndarray) -> np.ndarray:
    """Return the quarters of cells, those of each one after the other."""
    half = 0.5 * cells[:, None, 2:]
    corners = np.array([(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)])
    middles = cells[:, None, :2] + corners * half
    return np.concatenate([middles, np.broadcast_to(half, middles.shape)], -1).reshape(-1, 4)


def _determinant(rows: np.ndarray) -> np.ndarray:
    return rows[0, 0] * rows[1, 1] - rows[0, 1] * rows[1, 0]


def _inverse(rows: np.ndarray) -> np.ndarray:
    (a, b), (c, d) = rows
    with np.errstate(all='ignore'):
        return np.array([[d, -b], [-c, a]]) / _determinant(rows)


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
