# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Constructions in space, each written once for poses, arrays, rates and the accelerator.

A rod of length L with ball ends joins a point A to a point B that a hinge carries. In the hinge's
frame, z its axis and B at (rho, 0, 0) at angle zero, A = (p, q, d) and w = sqrt(p^2 + q^2),

    m1 = (L - d)(L + d) - (w - rho)^2,    m2 = (w + rho)^2 - (L - d)(L + d),
    psi = atan2(q, p) + side delta,       tan(delta/2) = sqrt(m1) / sqrt(m2),
    psi' = ((A - B).A' - L L') / (-side sqrt(m1) sqrt(m2) / 2).

The two roots are at once the half angle, both limits and the denominator of the rate: nothing
cancels next to a dead point. Two rods that hold a link on two hinges in a row have no such form;
they are solved by a fixed number of Newton steps on (|A - B|^2 - L^2) / 2: formulas again.

Sources: Chace, "Vector analysis of linkages", J. Eng. Ind. 85 (1963); Hartenberg and Denavit,
"Kinematic Synthesis of Linkages" (RSSR).
"""

from __future__ import annotations

from typing import List, NamedTuple, Optional, Sequence, Tuple

from .planar import Limit, TOLERANCE
from ..formula.expression import (
    arctangent,
    cosine,
    gated,
    Number,
    Rate,
    Real,
    real,
    sine,
    square,
    square_root,
    where,
    with_rate,
)

# Steps of Newton's method from the middle of a window: six are enough for five robots' ankles.
STEPS = 8
# After a last step [rad] of no more than this the rest is its square, less than rounding.
LAST_STEP = 1e-7
# How far beyond its window [rad] a pose counts as on its edge; the proof holds for a wider one.
EDGE = 1e-9


class Vector(NamedTuple):
    """A vector in space."""

    x: Real
    y: Real
    z: Real

    @staticmethod
    def of(x: Number, y: Number, z: Number) -> Vector:
        """Return the vector of three numbers or expressions."""
        return Vector(real(x), real(y), real(z))

    def plus(self, other: Vector) -> Vector:
        """Return the sum."""
        return Vector(self.x + other.x, self.y + other.y, self.z + other.z)

    def minus(self, other: Vector) -> Vector:
        """Return the difference."""
        return Vector(self.x - other.x, self.y - other.y, self.z - other.z)

    def times(self, factor: Number) -> Vector:
        """Return a multiple."""
        return Vector(self.x * factor, self.y * factor, self.z * factor)

    def dot(self, other: Vector) -> Real:
        """Return the inner product."""
        return self.x * other.x + self.y * other.y + self.z * other.z

    def cross(self, other: Vector) -> Vector:
        """Return the vector product."""
        return Vector(self.y * other.z - self.z * other.y, self.z * other.x - self.x * other.z,
                      self.x * other.y - self.y * other.x)

    def length(self) -> Real:
        """Return the length."""
        parts = [part for part in self if part.value != 0.0]
        return abs(parts[0]) if len(parts) == 1 else square_root(
            sum(map(square, parts), real(0.0)))

    def over(self, divisor: Number) -> Vector:
        """Return a quotient."""
        return Vector(self.x / divisor, self.y / divisor, self.z / divisor)

    def unit(self) -> Vector:
        """Return the direction."""
        return self.over(self.length())


class Turn(NamedTuple):
    """The angle [rad] of a hinge, its cosine and its sine."""

    angle: Real
    cosine: Real
    sine: Real

    @staticmethod
    def by(angle: Real) -> Turn:
        """Return the turn by an angle that is given."""
        return Turn(angle, cosine(angle), sine(angle))

    def back(self) -> Turn:
        """Return the opposite turn."""
        return Turn(-self.angle, self.cosine, -self.sine)


class Circle(NamedTuple):
    """The way of a point that turns: centre + cos u + sin v."""

    centre: Vector
    u: Vector
    v: Vector

    def at(self, cos: Real, sin: Real) -> Vector:
        """Return the place at an angle, by its cosine and sine."""
        return self.centre.plus(self.u.times(cos)).plus(self.v.times(sin))

    def ahead(self, cos: Real, sin: Real) -> Vector:
        """Return the derivative of the place by the angle."""
        return self.v.times(cos).minus(self.u.times(sin))


class Pivot(NamedTuple):
    """A point on its way; without a turn it is at the centre."""

    way: Circle
    turn: Optional[Turn] = None

    @staticmethod
    def at(point: Vector) -> Pivot:
        """Return a point that may move anyhow."""
        none = Vector.of(0.0, 0.0, 0.0)
        return Pivot(Circle(point, none, none))

    @property
    def place(self) -> Vector:
        """Where it is."""
        return self.way.at(self.turn.cosine, self.turn.sine) if self.turn else self.way.centre

    def along(self, axis: Vector, origin: Vector) -> Real:
        """Return how far it is from an origin, along an axis; constants are joined first."""
        centre = self.way.centre.minus(origin).dot(axis)
        if not self.turn:
            return centre
        u, v = self.way.u.dot(axis), self.way.v.dot(axis)
        return centre + u * self.turn.cosine + v * self.turn.sine


class Hinge(NamedTuple):
    """An axis in space: a point of it, and its direction, a vector of any length."""

    origin: Vector
    direction: Vector

    @property
    def axis(self) -> Vector:
        """The direction as a unit vector."""
        return self.direction.unit()

    def circle(self, point: Vector) -> Circle:
        """Return the way of a point that turns about the axis; it is the point at angle zero."""
        # Of the direction as given: a unit vector is rounded, and not quite of length one.
        across = self.direction.cross(point.minus(self.origin))
        u = across.cross(self.direction).over(self.direction.dot(self.direction))
        return Circle(point.minus(u), u, across.over(self.direction.length()))

    def turned(self, point: Vector, turn: Turn) -> Vector:
        """Return where a turn takes a point."""
        return self.circle(point).at(turn.cosine, turn.sine)


class Held(NamedTuple):
    """What a rod makes of a hinge: its turn, its limits, and its transmission angle [rad]."""

    turn: Turn
    limits: Tuple[Limit, ...]
    transmission: Real


def rated_turn(y: Real, x: Real, cos: Real, sin: Real, rate: Rate) -> Turn:
    """Return the turn by the angle of (x, y), of which cosine and sine are known, and the rate."""
    of, formula = rate
    # These need the turn as it is returned, so that it is differentiated no further than that.
    turn = Turn(with_rate(arctangent(y, x), *of, formula=formula),
                with_rate(cos, *of, formula=lambda *rates: -(formula(*rates) * turn.sine)),
                with_rate(sin, *of, formula=lambda *rates: formula(*rates) * turn.cosine))
    return turn


def rod_on_hinge(hinge: Hinge, pivot: Pivot, end: Vector, length: Real, side: Real,
                 span: Real) -> Held:
    """
    Turn a hinge so that a rod fits.

    Parameters
    ----------
    hinge : Hinge
        What is turned.
    pivot, end : Pivot, Vector
        The rod's ends as seen from the hinge's parent, and from its child at angle zero.
    length : Real
        Of the rod [m].
    side : Real
        1 or -1: from the direction of the pivot the end turns off to the left or right.
    span : Real
        The size of the numbers that all this is made from [m].

    """
    across = hinge.axis.cross(end.minus(hinge.origin))
    # Of an end next to the axis this is square to the axis no more than to rounding, so once more.
    along = across.unit().cross(hinge.axis).unit()
    rho = across.length()
    p = pivot.along(along, hinge.origin)
    q = pivot.along(hinge.axis.cross(along), hinge.origin)
    d = pivot.along(hinge.axis, end)
    w = square_root(square(p) + square(q))
    room = (length - d) * (length + d)
    tolerance = TOLERANCE * span * span
    near, far = (Limit(margin, tolerance) for margin in (
        room - square(w - rho), square(w + rho) - room))
    r1, r2 = near.root(), far.root()
    area = r1 * r2
    # The direction of the pivot, turned by delta: of the square of a length, as the margins are.
    x, y, px, py = far.margin - near.margin, 2.0 * side * area, p / w, q / w
    x, y = px * x - py * y, px * y + py * x
    size = square_root(square(x) + square(y))

    def rate(dp: Real, dq: Real, dd: Real, drho: Real, dlength: Real) -> Real:
        cos, sin = turn.cosine, turn.sine
        return ((p - rho * cos) * (dp - drho * cos) + (q - rho * sin) * (dq - drho * sin)
                + d * dd - length * dlength) / (-0.5 * side * area)

    turn = rated_turn(y, x, x / size, y / size, Rate((p, q, d, rho, length), rate))
    radial = p * turn.cosine + q * turn.sine - rho
    return Held(turn, (near, far), arctangent(
        0.5 * area / rho, square_root(square(radial) + square(d))))


def rod_on_slide(axis: Vector, pivot: Vector, end: Vector, length: Real, side: Real,
                 span: Real) -> Tuple[Real, Limit]:
    """Slide along an axis, a unit vector, so that a rod fits; see `rod_on_hinge`."""
    foot = pivot.minus(end)
    ahead, off = foot.dot(axis), axis.cross(foot).length()
    limit = Limit((length - off) * (length + off), TOLERANCE * span * span)
    reach = limit.root()

    def rate(dx: Real, dy: Real, dz: Real, dlength: Real) -> Real:
        left = foot.minus(axis.times(place))
        return (left.dot(Vector(dx, dy, dz)) - length * dlength) / (-(side * reach))

    place = with_rate(ahead + side * reach, *foot, length, formula=rate)
    return place, limit


class Rod(NamedTuple):
    """A rod: its end on the base, that on the moving link at angles zero, its length [m]."""

    pivot: Pivot
    end: Vector
    length: Real


class Universal:
    """
    Two hinges in a row, on whose second link two rods end.

    Everything is seen in the frame of the first hinge: z its axis, x as near the second as it can
    be. There an end is B = Rz(first angle) Q(second angle), Q on a circle about the second axis.

    Parameters
    ----------
    first, second : Hinge
        The second is carried by the first; as seen from the base at angles zero.
    home : (Real, Real)
        The angles [rad] from which the steps start.

    """

    def __init__(self, first: Hinge, second: Hinge, home: Sequence[Real]):
        self._first = first
        leaning = first.direction.cross(second.direction)
        self.sine = leaning.length() / (first.direction.length() * second.direction.length())
        x = leaning.cross(first.direction).unit()
        self._frame = x, first.axis.cross(x), first.axis
        self._second, self._home = second, home

    def _seen(self, vector: Vector) -> Vector:
        return Vector(*(vector.dot(axis) for axis in self._frame))

    def seen(self, point: Vector) -> Vector:
        """Return a point in the frame of the first hinge."""
        return self._seen(point.minus(self._first.origin))

    def frame_way(self, way: Circle) -> Circle:
        """Return the way of a point in the frame of the first hinge."""
        return Circle(self.seen(way.centre), self._seen(way.u), self._seen(way.v))

    def bars(self, rods: Sequence[Rod]) -> List[Tuple[Vector, Circle, Real]]:
        """Return rods in the frame of the first hinge: pivot, way of the end, length."""
        return [(rod.pivot._replace(way=self.frame_way(rod.pivot.way)).place,
                 self.frame_way(self._second.circle(rod.end)), rod.length) for rod in rods]

    def solved(self, rods: Sequence[Rod]) -> Tuple[Turn, Turn, Limit]:
        """Return both turns that two rods make, and what is below zero where none is found."""
        bars = self.bars(rods)
        c1, c2 = map(cosine, self._home)
        s1, s2 = map(sine, self._home)
        step = real(0.0)
        for left in reversed(range(STEPS)):
            if not left:  # what the steps before have added to the length of both
                (c1, s1), (c2, s2) = _on_circle(c1, s1), _on_circle(c2, s2)
            rows = [_row(*bar, c1, s1, c2, s2) for bar in bars]
            d1, d2 = _solution(rows, [-_gap(row.rod, bar[2]) for row, bar in zip(rows, bars)])
            (c1, s1), (c2, s2) = _stepped(c1, s1, d1), _stepped(c2, s2, d2)
            step = abs(d1) + abs(d2)
        final: List[_Row] = []

        def rates(*given: Real) -> Tuple[Real, Real]:
            if not final:
                final.extend(_row(*bar, first.cosine, first.sine, second.cosine, second.sine)
                             for bar in bars)
            return _solution(final, [
                length * rate - row.rod.dot(Vector(*moving)) for row, (_, _, length), moving, rate
                in zip(final, bars, (given[:3], given[4:7]), (given[3], given[7]))])

        of = tuple(x for pivot, _, length in bars for x in (*pivot, length))
        first, second = (rated_turn(s, c, c, s, Rate(
            of, lambda *given, which=which: rates(*given)[which]))
            for which, (c, s) in enumerate(((c1, s1), (c2, s2))))
        return first, second, Limit(with_rate(LAST_STEP - step, formula=lambda: real(0.0)),
                                    real(0.0))


class _Row(NamedTuple):
    """A rod from its end to its pivot, and the derivatives of half its square by both angles."""

    rod: Vector
    by_first: Real
    by_second: Real


def _row(pivot: Vector, circle: Circle, _: Real, c1: Real, s1: Real, c2: Real, s2: Real) -> _Row:
    def turned(v: Vector) -> Vector:
        return Vector(v.x * c1 - v.y * s1, v.x * s1 + v.y * c1, v.z)

    end, ahead = turned(circle.at(c2, s2)), turned(circle.ahead(c2, s2))
    rod = pivot.minus(end)
    return _Row(rod, pivot.x * end.y - pivot.y * end.x, -rod.dot(ahead))


def _gap(rod: Vector, length: Real) -> Real:
    return 0.5 * (rod.dot(rod) - square(length))


def _solution(rows: Sequence[_Row], wanted: Sequence[Real]) -> Tuple[Real, Real]:
    """Return what both angles change by, to change half the squares of the rods as wanted."""
    (_, a, b), (_, c, d) = rows
    e, f = wanted
    det = a * d - b * c
    return (e * d - b * f) / det, (a * f - e * c) / det


def _stepped(c: Real, s: Real, step: Real) -> Tuple[Real, Real]:
    """Return a cosine and a sine after a turn by 2 atan(step / 2), which is about the step."""
    square_ = 0.25 * square(step)
    by = 1.0 / (1.0 + square_)
    cos, sin = (1.0 - square_) * by, step * by
    return c * cos - s * sin, s * cos + c * sin


def _on_circle(c: Real, s: Real) -> Tuple[Real, Real]:
    """Return a cosine and a sine, of which rounding has moved the squares' sum from one."""
    by = 1.5 - 0.5 * (square(c) + square(s))
    return c * by, s * by


def within(value: Real, low: Real, high: Real, tolerance: Real) -> List[Limit]:
    """Return the limits of a value that is to be between two others."""
    return [Limit(value - low, tolerance), Limit(high - value, tolerance)]


def gated_by(value: Real, limits: Sequence[Limit]) -> Real:
    """Return a value where limits are kept, NaN elsewhere."""
    for limit in limits:
        value = gated(value, limit.margin, limit.tolerance)
    return value


def drawn_side(hinge: Hinge, pivot: Vector, end: Vector) -> Tuple[Real, Real]:
    """
    Return the side of a rod as `rod_on_hinge` takes it, from both ends as they are at angle zero.

    With it comes by how much it is on that side: 0 at a dead point, up to 1.
    """
    foot, arm = (hinge.axis.cross(x.minus(hinge.origin)) for x in (pivot, end))
    area = hinge.axis.dot(foot.cross(arm))
    return where(area < 0.0, -1.0, 1.0), abs(area) / (foot.length() * arm.length())

