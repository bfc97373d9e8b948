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

from typing import Any, Iterable, List, NamedTuple, Optional, Sequence, Tuple

from .planar import Limit, TOLERANCE
from ..formula.expression import (
    arctangent,
    cosine,
    gated,
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
# After a last step [rad] of no more than this the rest is its square, less than rounding.
LAST_STEP = 1e-7
# How far beyond its window [rad] a pose counts as on its edge; the proof holds for a wider one.
EDGE = 1e-9


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
        parts = [part for part in self if part.value != 0.0]
        return abs(parts[0]) if len(parts) == 1 else square_root(
            sum(map(square, parts), real(0.0)))

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

    def at(self, cos: Scalar, sin: Scalar) -> Vector:
        """Return the place at an angle, by its cosine and sine."""
        return self.centre.plus(self.u.times(cos)).plus(self.v.times(sin))

    def ahead(self, cos: Scalar, sin: Scalar) -> Vector:
        """Return the derivative of the place by the angle."""
        return self.v.times(cos).minus(self.u.times(sin))


class Pivot(NamedTuple):
    """A point on its way, which without a turn is the centre."""

    way: Circle
    turn: Optional[Turn] = None

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
        """Return the direction as a unit vector."""
        return self.direction.unit()

    def leaning(self, other: Hinge) -> Real:
        """Return the sine of the angle to another axis."""
        return self.direction.cross(other.direction).length() / (
            self.direction.length() * other.direction.length())

    def circle(self, point: Vector) -> Circle:
        """Return the way of a point that turns about the axis; it is the point at angle zero."""
        # Of the direction as given: a unit vector is rounded, and not quite of length one.
        across = self.direction.cross(point.minus(self.origin))
        u = across.cross(self.direction).over(self.direction.dot(self.direction))
        return Circle(point.minus(u), u, across.over(self.direction.length()))

    def turned(self, point: Vector, turn: Turn) -> Vector:
        """Return where a turn takes a point."""
        return self.circle(point).at(turn.cosine, turn.sine)


def rated_turn(y: Real, x: Real, cos: Real, sin: Real, rate: Rate) -> Turn:
    """Return the turn by the angle of (x, y), of which cosine and sine are known, and the rate."""
    of, formula = rate
    # These need the turn as it is returned, so that it is differentiated no further than that.
    turn = Turn(with_rate(arctangent(y, x), *of, formula=formula),
                with_rate(cos, *of, formula=lambda *rates: -(formula(*rates) * turn.sine)),
                with_rate(sin, *of, formula=lambda *rates: formula(*rates) * turn.cosine))
    return turn


def rod_on_hinge(hinge: Hinge, pivot: Pivot, end: Vector, length: Real, side: Real,
                 span: Real) -> Tuple[Turn, Limit, Limit, Real]:
    """
    Return the turn of a hinge with which a rod fits, its limits, and the transmission angle [rad].

    The rod's ends are as seen from the hinge's parent, and from its child at angle zero. Seen from
    the axis the end turns off to the left of the pivot, where the side is 1, or right, where it is
    -1. The span is the size of the numbers that all this is made from [m].
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
    return turn, near, far, arctangent(
        0.5 * area / rho, square_root(square(radial) + square(d)))


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
    """A rod in the frame of the first of two hinges: the ways of its ends, and its length [m]."""

    pivot: Pivot
    end: Circle
    length: Real


class Frame(NamedTuple):
    """The frame of the first of two hinges in a row: z its axis, x next to that of the second."""

    origin: Vector
    axes: Tuple[Vector, Vector, Vector]

    @staticmethod
    def of(first: Hinge, second: Hinge) -> Frame:
        """Return the frame of two hinges."""
        x = first.direction.cross(second.direction).cross(first.direction).unit()
        return Frame(first.origin, (x, first.axis.cross(x), first.axis))

    def _seen(self, vector: Vector) -> Vector:
        return Vector(*(vector.dot(axis) for axis in self.axes))

    def seen(self, way: Circle) -> Circle:
        """Return the way of a point in this frame."""
        return Circle(self._seen(way.centre.minus(self.origin)), self._seen(way.u),
                      self._seen(way.v))


class Row(NamedTuple):
    """A rod from its end to its pivot, and the derivatives of half its square by both angles."""

    rod: Vector
    by_first: Scalar
    by_second: Scalar


# Cosine and sine of both angles.
Pose = Tuple[Scalar, Scalar, Scalar, Scalar]


def row(pivot: Vector, end: Circle, pose: Pose) -> Row:
    """Return a rod between a place and the end that both angles turn."""
    c1, s1, c2, s2 = pose
    place, ahead = end.at(c2, s2).turned(c1, s1), end.ahead(c2, s2).turned(c1, s1)
    rod = pivot.minus(place)
    return Row(rod, pivot.x * place.y - pivot.y * place.x, -rod.dot(ahead))


def gap(rod: Vector, length: Scalar) -> Scalar:
    """Return half of what the square of a rod is too large by."""
    return 0.5 * (rod.dot(rod) - length * length)


def newton_step(rods: Sequence[Tuple[Vector, Circle, Scalar]],
                pose: Pose) -> Tuple[Pose, Scalar]:
    """Return the pose a step nearer to where two rods fit, and the step [rad]."""
    rows = [row(pivot, end, pose) for pivot, end, _ in rods]
    d1, d2 = _solution(rows, [-gap(each.rod, rod[2]) for each, rod in zip(rows, rods)])
    return (*_stepped(*pose[:2], d1), *_stepped(*pose[2:], d2)), abs(d1) + abs(d2)


def two_rods(rods: Sequence[Rod], home: Sequence[Real]) -> Tuple[Turn, Turn, Limit]:
    """
    Turn two hinges in a row so that two rods fit, in steps from home [rad].

    In the frame of the first hinge the end of a rod is B = Rz(first angle) Q(second angle), with Q
    on a circle. The limit is below zero where no pose is found.
    """
    bars = [(rod.pivot.place, rod.end, rod.length) for rod in rods]
    pose: Pose = cosine(home[0]), sine(home[0]), cosine(home[1]), sine(home[1])
    for _ in range(STEPS - 1):
        pose, _step = newton_step(bars, pose)
    # What the steps before have added to the length of both.
    pose, step = newton_step(bars, (*_on_circle(*pose[:2]), *_on_circle(*pose[2:])))
    final: List[Row] = []

    def rates(*given: Real) -> Tuple[Real, Real]:
        if not final:
            pose = first.cosine, first.sine, second.cosine, second.sine
            final.extend(row(pivot, end, pose) for pivot, end, _ in bars)
        return _solution(final, [
            length * rate - each.rod.dot(Vector(*moving)) for each, (_, _, length), moving, rate
            in zip(final, bars, (given[:3], given[4:7]), (given[3], given[7]))])

    of = tuple(x for pivot, _, length in bars for x in (*pivot, length))
    first, second = (rated_turn(s, c, c, s, Rate(
        of, lambda *given, which=which: rates(*given)[which]))
        for which, (c, s) in enumerate((pose[:2], pose[2:])))
    return first, second, Limit(with_rate(LAST_STEP - step, formula=lambda: real(0.0)), real(0.0))


def _solution(rows: Sequence[Row], wanted: Sequence[Scalar]) -> Tuple[Scalar, Scalar]:
    """Return what both angles change by, to change half the squares of the rods as wanted."""
    (_, a, b), (_, c, d) = rows
    e, f = wanted
    det = a * d - b * c
    return (e * d - b * f) / det, (a * f - e * c) / det


def _stepped(c: Scalar, s: Scalar, step: Scalar) -> Tuple[Scalar, Scalar]:
    """Return a cosine and a sine after a turn by 2 atan(step / 2), which is about the step."""
    square_ = 0.25 * (step * step)
    by = 1.0 / (1.0 + square_)
    cos, sin = (1.0 - square_) * by, step * by
    return c * cos - s * sin, s * cos + c * sin


def _on_circle(c: Real, s: Real) -> Tuple[Real, Real]:
    """Return a cosine and a sine, of which rounding has moved the squares' sum from one."""
    by = 1.5 - 0.5 * (square(c) + square(s))
    return c * by, s * by


def gated_by(value: Real, limits: Iterable[Limit]) -> Real:
    """Return a value inside limits, NaN elsewhere."""
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


def drawn_ahead(slide: Hinge, pivot: Vector, end: Vector) -> Tuple[Real, Real]:
    """Return what `drawn_side` does, of a rod on a slide, as `rod_on_slide` takes it."""
    rod = end.minus(pivot)
    ahead = slide.axis.dot(rod)
    return where(ahead < 0.0, -1.0, 1.0), abs(ahead) / rod.length()
