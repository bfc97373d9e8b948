# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Constructions in space, each written once for poses, arrays, rates and the accelerator.

A rod of length L with ball ends joins a point A to a point B that a hinge carries. In the hinge's
frame, z its axis and B at (rho, 0, 0) at angle zero, A = (p, q, d) and w = sqrt(p^2 + q^2),

    m1 = (L - d)(L + d) - (w - rho)^2,    m2 = (w + rho)^2 - (L - d)(L + d),
    psi = atan2(q, p) + side delta,       tan(delta/2) = sqrt(m1) / sqrt(m2),
    psi' = ((A - B).A' - L L') / (-side sqrt(m1) sqrt(m2) / 2).

The two roots give the half angle, both limits and the denominator of the rate: nothing cancels
next to a dead point. A link on two hinges in a row and two rods has no such form. It is solved by
a fixed number of Newton steps on (|A - B|^2 - L^2) / 2, which are formulas, too.

Sources: Chace, "Vector analysis of linkages", J. Eng. Ind. 85 (1963); Hartenberg and Denavit,
"Kinematic Synthesis of Linkages" (RSSR).
"""

from __future__ import annotations

from typing import Any, NamedTuple, Sequence

from .planar import Limit, MIN_SQUARE, TINY
from ..tolerances import TOLERANCE
from ...formula.expression import (
    arctangent,
    cosine,
    Rate,
    Real,
    real,
    sine,
    square,
    square_root,
    where,
    with_rate,
)

# An expression; in `window`, which shares the geometry, an array.
Scalar = Any
# Steps of Newton's method from the middle of a window: six are enough for five robots' ankles.
STEPS = 8
# After a last step [rad] of this size or less, the error is its square, less than rounding. This
# and EDGE are powers of two: C, which replaces them for float, knows them from a design's numbers.
LAST_STEP = 2.0 ** -23
# A pose beyond its window by no more than this [rad] is on its edge; the proof covers twice that.
EDGE = 2.0 ** -30
# What formulas count as rounding, and what that is in single precision.
IN_SINGLE = {TOLERANCE: 8 * 2.0 ** -24, -TOLERANCE: -8 * 2.0 ** -24, LAST_STEP: 2.0 ** -11,
             EDGE: 2.0 ** -17, TINY: 2.0 ** -26, MIN_SQUARE: 2.0 ** -100}


class Vector(NamedTuple):
    """A vector in space."""

    x: Scalar
    y: Scalar
    z: Scalar

    def plus(self, other: Vector) -> Vector:
        """Return the sum."""
        return Vector(self.x + other.x, self.y + other.y, self.z + other.z)

    def minus(self, other: Vector) -> Vector:
        """Return the difference."""
        return Vector(self.x - other.x, self.y - other.y, self.z - other.z)

    def times(self, factor: Scalar) -> Vector:
        """Return a multiple."""
        return Vector(self.x * factor, self.y * factor, self.z * factor)

    def dot(self, other: Vector) -> Scalar:
        """Return the inner product."""
        return self.x * other.x + self.y * other.y + self.z * other.z

    def turned(self, cos: Scalar, sin: Scalar) -> Vector:
        """Return it turned about z, by an angle's cosine and sine."""
        return Vector(self.x * cos - self.y * sin, self.x * sin + self.y * cos, self.z)

    def cross(self, other: Vector) -> Vector:
        """Return the vector product."""
        return Vector(self.y * other.z - self.z * other.y, self.z * other.x - self.x * other.z,
                      self.x * other.y - self.y * other.x)

    def length(self) -> Real:
        """Return the length."""
        return square_root(self.dot(self))

    def over(self, divisor: Scalar) -> Vector:
        """Return a quotient."""
        return Vector(self.x / divisor, self.y / divisor, self.z / divisor)

    def unit(self) -> Vector:
        """Return the direction."""
        return self.over(self.length())


ZERO = Vector(real(0.0), real(0.0), real(0.0))


class Turn(NamedTuple):
    """The angle [rad] of a hinge, its cosine and its sine."""

    angle: Real
    cosine: Real
    sine: Real

    @staticmethod
    def by(angle: Real) -> Turn:
        """Return the turn by an angle."""
        return Turn(angle, cosine(angle), sine(angle))

    def back(self) -> Turn:
        """Return the opposite turn."""
        return Turn(-self.angle, self.cosine, -self.sine)


class Circle(NamedTuple):
    """The path of a point that turns: centre + cos u + sin v."""

    centre: Vector
    u: Vector
    v: Vector

    def at(self, cos: Scalar, sin: Scalar) -> Vector:
        """Return the place at an angle, by its cosine and sine."""
        return self.centre.plus(self.u.times(cos)).plus(self.v.times(sin))

    def ahead(self, cos: Scalar, sin: Scalar) -> Vector:
        """Return the derivative of the place by the angle."""
        return self.v.times(cos).minus(self.u.times(sin))


class Pivot(NamedTuple):
    """A point on its path; without a turn it is the path's centre."""

    path: Circle
    turn: Turn | None = None

    @property
    def place(self) -> Vector:
        """Where it is."""
        return self.path.at(self.turn.cosine, self.turn.sine) if self.turn else self.path.centre

    def along(self, axis: Vector, origin: Vector) -> Real:
        """Return its coordinate along an axis from an origin; constants are combined first."""
        centre = self.path.centre.minus(origin).dot(axis)
        if not self.turn:
            return centre
        u, v = self.path.u.dot(axis), self.path.v.dot(axis)
        return centre + u * self.turn.cosine + v * self.turn.sine


class Hinge(NamedTuple):
    """An axis in space: a point of it, and its direction, a vector of any length."""

    origin: Vector
    direction: Vector

    @property
    def axis(self) -> Vector:
        """Return the direction as a unit vector."""
        return self.direction.unit()

    def leaning(self, other: Hinge) -> Real:
        """Return the sine of the angle to another axis."""
        return self.direction.cross(other.direction).length() / (
            self.direction.length() * other.direction.length())

    def circle(self, point: Vector) -> Circle:
        """Return the path of a point that turns about the axis; it is the point at angle zero."""
        # By the direction as it is: the length of a rounded unit vector is not exactly one.
        across = self.direction.cross(point.minus(self.origin))
        u = across.cross(self.direction).over(self.direction.dot(self.direction))
        return Circle(point.minus(u), u, across.over(self.direction.length()))

    def turned(self, point: Vector, turn: Turn) -> Vector:
        """Return the place of a point after a turn."""
        return self.circle(point).at(turn.cosine, turn.sine)


def turn_with_rate(y: Real, x: Real, cos: Real, sin: Real, rate: Rate) -> Turn:
    """Return the turn by the angle of (x, y), with its cosine, sine and rate."""
    of, formula = rate
    # The rates refer to the returned turn: a second derivative then uses them again.
    turn = Turn(with_rate(arctangent(y, x), *of, formula=formula),
                with_rate(cos, *of, formula=lambda *rates: -(formula(*rates) * turn.sine)),
                with_rate(sin, *of, formula=lambda *rates: formula(*rates) * turn.cosine))
    return turn


def rod_on_hinge(hinge: Hinge, pivot: Pivot, end: Vector, length: Real, side: Real,
                 magnitude: Real) -> tuple[Turn, Limit, Limit, Real]:
    """
    Return the turn of a hinge with which a rod fits, its limits, and the transmission angle [rad].

    The rod's pivot is in the coordinates of the hinge's parent, its end in those of the child at
    angle zero. Seen from the axis, the end is to the left of the pivot if the side is 1, to the
    right if it is -1. The magnitude is the size of all coordinates [m], for the tolerance.
    """
    across = hinge.axis.cross(end.minus(hinge.origin))
    # Rounding tilts this vector against the axis if the end is next to the axis: once more.
    along = across.unit().cross(hinge.axis).unit()
    rho = across.length()
    p = pivot.along(along, hinge.origin)
    q = pivot.along(hinge.axis.cross(along), hinge.origin)
    d = pivot.along(hinge.axis, end)
    w = square_root(square(p) + square(q))
    room = (length - d) * (length + d)
    tolerance = TOLERANCE * magnitude * magnitude
    near, far = (Limit(margin, tolerance) for margin in (
        room - square(w - rho), square(w + rho) - room))
    r1, r2 = near.root(), far.root()
    area = r1 * r2
    # The direction of the pivot, turned by delta; a square of a length [m^2], as the margins are.
    x, y, px, py = far.margin - near.margin, 2.0 * side * area, p / w, q / w
    x, y = px * x - py * y, px * y + py * x
    size = square_root(square(x) + square(y))

    def rate(dp: Real, dq: Real, dd: Real, drho: Real, dlength: Real) -> Real:
        cos, sin = turn.cosine, turn.sine
        return ((p - rho * cos) * (dp - drho * cos) + (q - rho * sin) * (dq - drho * sin)
                + d * dd - length * dlength) / (-0.5 * side * area)

    turn = turn_with_rate(y, x, x / size, y / size, Rate((p, q, d, rho, length), rate))
    radial = p * turn.cosine + q * turn.sine - rho
    return turn, near, far, arctangent(
        0.5 * area / rho, square_root(square(radial) + square(d)))


def rod_on_slide(axis: Vector, pivot: Vector, end: Vector, length: Real, side: Real,
                 magnitude: Real) -> tuple[Real, Limit]:
    """Slide along an axis, a unit vector, so that a rod fits; see `rod_on_hinge`."""
    foot = pivot.minus(end)
    ahead, off = foot.dot(axis), axis.cross(foot).length()
    limit = Limit((length - off) * (length + off), TOLERANCE * magnitude * magnitude)
    reach = limit.root()

    def rate(dx: Real, dy: Real, dz: Real, dlength: Real) -> Real:
        from_foot = foot.minus(axis.times(place))
        return (from_foot.dot(Vector(dx, dy, dz)) - length * dlength) / (-(side * reach))

    place = with_rate(ahead + side * reach, *foot, length, formula=rate)
    return place, limit


class Rod(NamedTuple):
    """
    A rod in the frame of the first of two hinges: paths of its ends, and its length [m].

    `side` is the sign of (A - B).A', of its pivot A and its end B, if a motor turns the pivot.
    """

    pivot: Pivot
    end: Circle
    length: Real
    side: Real

    def drawn(self, first: Turn, second: Turn, magnitude: Real) -> Limit:
        """Return the limit of its crank, which is on its side of a dead point."""
        place = self.end.at(second.cosine, second.sine).turned(first.cosine, first.sine)
        turn = self.pivot.turn or Turn(real(0.0), real(1.0), real(0.0))
        ahead = self.pivot.path.ahead(turn.cosine, turn.sine)
        return Limit(self.side * (self.pivot.path.centre.minus(place)).dot(ahead),
                     TOLERANCE * magnitude * magnitude)


class Frame(NamedTuple):
    """
    The frame of the first of two hinges in a row.

    z is its axis, x the direction of the second axis' part square to z.
    """

    origin: Vector
    axes: tuple[Vector, Vector, Vector]

    @staticmethod
    def of(first: Hinge, second: Hinge) -> Frame:
        """Return the frame of two hinges."""
        x = first.direction.cross(second.direction).cross(first.direction).unit()
        return Frame(first.origin, (x, first.axis.cross(x), first.axis))

    def _rotated(self, vector: Vector) -> Vector:
        return Vector(*(vector.dot(axis) for axis in self.axes))

    def transformed(self, path: Circle) -> Circle:
        """Return the path of a point in this frame."""
        return Circle(self._rotated(path.centre.minus(self.origin)), self._rotated(path.u),
                      self._rotated(path.v))


class Row(NamedTuple):
    """A rod's vector from its end to its pivot; derivatives of half its square by both angles."""

    rod: Vector
    by_first: Scalar
    by_second: Scalar


# Cosine and sine of both angles.
HingeAngles = tuple[Scalar, Scalar, Scalar, Scalar]


def row(pivot: Vector, end: Circle, pose: HingeAngles) -> Row:
    """Return the row of a rod between a pivot and its end, which both angles turn."""
    c1, s1, c2, s2 = pose
    place, ahead = end.at(c2, s2).turned(c1, s1), end.ahead(c2, s2).turned(c1, s1)
    rod = pivot.minus(place)
    return Row(rod, pivot.x * place.y - pivot.y * place.x, -rod.dot(ahead))


def residual(rod: Vector, length: Scalar) -> Scalar:
    """Return half the difference between the square of a rod's vector and of its length."""
    return 0.5 * (rod.dot(rod) - length * length)


def newton_step(rods: Sequence[tuple[Vector, Circle, Scalar]],
                pose: HingeAngles) -> tuple[HingeAngles, Scalar]:
    """Return the pose after a Newton step towards the fit of two rods, and the step [rad]."""
    rows = [row(pivot, end, pose) for pivot, end, _ in rods]
    d1, d2 = _solution(rows, [-residual(x.rod, length) for x, (_, _, length) in zip(rows, rods)])
    return (*_stepped(*pose[:2], d1), *_stepped(*pose[2:], d2)), abs(d1) + abs(d2)


def two_rods(rods: Sequence[Rod], start: Sequence[Real]) -> tuple[Turn, Turn, Limit]:
    """
    Return the turns of two hinges in a row with which two rods fit, by steps from start [rad].

    In the frame of the first hinge the end of a rod is B = Rz(first angle) Q(second angle), with Q
    on a circle. The limit is below zero where no pose is found.
    """
    bars = [(rod.pivot.place, rod.end, rod.length) for rod in rods]
    pose: HingeAngles = cosine(start[0]), sine(start[0]), cosine(start[1]), sine(start[1])
    for _ in range(STEPS):
        pose, step = newton_step(bars, pose)
    final: list[Row] = []

    def rates(*changes: Real) -> tuple[Real, Real]:
        if not final:
            pose = first.cosine, first.sine, second.cosine, second.sine
            final.extend(row(pivot, end, pose) for pivot, end, _ in bars)
        return _solution(final, [
            length * rate - x.rod.dot(Vector(*moving)) for x, (_, _, length), moving, rate in zip(
                final, bars, (changes[:3], changes[4:7]), (changes[3], changes[7]))])

    of = tuple(x for pivot, _, length in bars for x in (*pivot, length))
    first, second = (turn_with_rate(s, c, c, s, Rate(
        of, lambda *changes, which=which: rates(*changes)[which]))
        for which, (c, s) in enumerate((pose[:2], pose[2:])))
    return first, second, Limit(with_rate(LAST_STEP - step, formula=lambda: real(0.0)), real(0.0))


def _solution(rows: Sequence[Row], changes: Sequence[Scalar]) -> tuple[Scalar, Scalar]:
    """Return the steps of both angles for these changes of half the rods' squared lengths."""
    (_, a, b), (_, c, d) = rows
    e, f = changes
    det = a * d - b * c
    return (e * d - b * f) / det, (a * f - e * c) / det


def _stepped(c: Scalar, s: Scalar, step: Scalar) -> tuple[Scalar, Scalar]:
    """Return a cosine and a sine after a turn by 2 atan(step / 2), which is about the step."""
    square_ = 0.25 * (step * step)
    by = 1.0 / (1.0 + square_)
    cos, sin = (1.0 - square_) * by, step * by
    return c * cos - s * sin, s * cos + c * sin


def drawn_side(hinge: Hinge, pivot: Vector, end: Vector) -> tuple[Real, Real]:
    """
    Return a rod's side for `rod_on_hinge`, from both ends at angle zero.

    Also return the sine of the angle between end and pivot: 0 at a dead point, 1 at most.
    """
    foot, arm = (hinge.axis.cross(x.minus(hinge.origin)) for x in (pivot, end))
    area = hinge.axis.dot(foot.cross(arm))
    return where(area < 0.0, -1.0, 1.0), abs(area) / (foot.length() * arm.length())


def drawn_ahead(slide: Hinge, pivot: Vector, end: Vector) -> tuple[Real, Real]:
    """Return a rod's side for `rod_on_slide`, and the cosine of its angle to the slide."""
    rod = end.minus(pivot)
    ahead = slide.axis.dot(rod)
    return where(ahead < 0.0, -1.0, 1.0), abs(ahead) / rod.length()
