# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Constructions in the plane, each written once for poses, arrays, rates and the accelerator.

Points and vectors are `Complex`, lengths and angles `Real`. A construction on two points takes the
`Arm` between them: the vector, its square, and the margin between that square and the square of a
radius. For an arm from the ground to a crank pin these are half-angle forms, which keep every
digit at dead points and reach limits; for other arms they are formed from coordinates.

With theta' the crank angle from the ground line (foot to crank centre), g the ground line, m the
crank, s = sin(theta'/2) and h = cos(theta'/2), the arm w and its square are, in the line's frame,

    w = (g - m) + 2 m h e^(i theta'/2),   |w|^2 = (g - m)^2 + 4 g m h^2 = (g + m)^2 - 4 g m s^2.

Sources: Norton, "Design of Machinery", ch. 4 (loop closure of the four-bar and the inverted
slider-crank); Hartenberg and Denavit, "Kinematic Synthesis of Linkages" (the inversor); Kahan,
"Miscalculating Area and Angles of a Needle-like Triangle" (factored gaps).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import Iterable, NamedTuple, Sequence

from ..tolerances import TOLERANCE
from ...formula.expression import (
    arctangent,
    Complex,
    cosine,
    cross,
    dot,
    exact_sum,
    Rate,
    Real,
    real,
    root,
    sine,
    spin,
    square,
    square_root,
    sum_and_error,
    valid_where,
    where,
    with_rate,
    with_spin,
)

# Added to a cosine that may vanish where the quotient of two zeros has a limit: its square is a
# normal number, and it is far below the rounding of a direction.
TINY = 2.0 ** -330
# An arm whose square is smaller has no direction: squares below lose digits, or are zero.
MIN_SQUARE = 2.0 ** -1000


@dataclass(frozen=True)
class Crank:
    """
    A crank: its centre, length [m], direction of the angle zero, and the angle [rad].

    The crank of a mirror image turns backwards.
    """

    centre: Complex
    length: Real
    zero: Complex
    angle: Real
    backwards: bool = False

    def bar(self, length: Real | None = None) -> Complex:
        """Return the vector from the centre to the pin, or one of another length in its place."""
        s, h = sine(0.5 * self.angle), cosine(0.5 * self.angle)
        turned = self.zero * Complex(1.0 - 2.0 * square(s), 2.0 * s * h)
        return with_spin(turned * (length or self.length),
                         Rate((self.angle,), lambda rate: rate))


class CrankEnds(NamedTuple):
    """The crank angles theta at which start cos^2 + end sin^2 of (theta + turn) / 2 vanishes."""

    start: Real
    end: Real
    turn: Real
    theta: Real


def squares_apart(first: Real, second: Real) -> Real:
    """Return first^2 - second^2, with the exact difference of lengths that are sums."""
    return exact_sum(first, -second) * (first + second)


def are_equal(first: Real, second: Real) -> Real:
    """Return whether two lengths are equal up to the rounding of one between two places."""
    return abs(first - second) <= 0.5 * TOLERANCE * second


def on_line(along: Complex, place: Real) -> Complex:
    """Return the vector of a length along a direction; both parts are NaN where the length is."""
    # Generated code omits products with zero, which would carry the NaN.
    return Complex(*(valid_where(part * place, abs(place)) if part.value == 0.0
                     else part * place for part in (along.x, along.y)))


class Limit(NamedTuple):
    """
    A margin that is negative, by more than the tolerance, where a linkage cannot be assembled.

    The margin of a crank arm vanishes at `ends`, and `smooth` is its root, whose sign continues
    smoothly through a change point.
    """

    margin: Real
    tolerance: Real
    smooth: Real | None = None
    ends: CrankEnds | None = None

    def root(self) -> Real:
        """Return the root of the margin."""
        return root(self.margin, self.tolerance)


def valid_within(value: Real, limits: Iterable[Limit]) -> Real:
    """Return a value inside limits, NaN elsewhere."""
    for limit in limits:
        value = valid_where(value, limit.margin, limit.tolerance)
    return value


class Arm:
    """The arm between two moving points; a given length is constant."""

    # None if it is not constant.
    length: Real | None = None
    _is_smooth = False

    def __init__(self, foot: Complex, vector: Complex, magnitude: Real,
                 length: Real | None = None):
        self.foot = foot
        self.vector = vector
        # A constant would have a value even where the points cannot be assembled.
        self.square = vector.squared() if length is None else valid_where(
            square(length), abs(vector.x))
        # A square that is not tiny where the arm has a direction.
        self._clear = self.square
        self._magnitude, self.length = magnitude, length

    @property
    def divisor(self) -> Real:
        """Its square, NaN where it has no direction."""
        return self.square if self.length or self._is_smooth else \
            valid_where(self.square, self._clear - MIN_SQUARE)

    def within(self, radius: Real, size: Real) -> Limit:
        """Return the margin radius^2 - square; the radius is made from lengths up to size."""
        return self._limit(radius, size, square(radius) - self.square)

    def beyond(self, radius: Real, size: Real) -> Limit:
        """Return the margin square - radius^2; the radius is made from lengths up to size."""
        return self._limit(radius, size, self.square - square(radius))

    def difference(self, first: Real, second: Real, shorter: Limit) -> Real:
        """Return by how much a bar of a dyad is longer than the other [m]; see `CrankArm`."""
        return first - second

    def stroke(self, first: Real, second: Real, size: Real) -> tuple[Limit, Limit]:
        """Return `within` of their sum and `beyond` of their difference; first varies."""
        length = self.length
        if length is None:
            return self.within(first + second, size), self.beyond(first - second, size)
        # The varying length is added last: a sum that it brings next to zero is exact.
        (near, near_error), (far, far_error) = sum_and_error(second, -length), \
            sum_and_error(second, length)
        margins = (((first + near) + near_error) * (first + far),
                   ((far - first) + far_error) * ((first - near) - near_error))
        longer, shorter = (valid_where(margin, self.square) for margin in margins)
        return (self._limit(first + second, size, longer),
                self._limit(first - second, size, shorter))

    def offset(self, point: Complex, to_point: Complex) -> Real:
        """Return the cross product of the arm and the vector from its foot to a point."""
        return cross(self.vector, to_point)

    def across(self, offset: Real) -> Complex:
        """Return the vector from a point of this offset to its mirror image in the arm's line."""
        return self.vector.turned() * (-2.0 * offset / self.divisor)

    def to_opposite(self, first: Real, second: Real) -> Complex:
        """
        Return the vector from a corner of an antiparallelogram to the opposite one.

        The bars first and second [m] go from that corner to the arm's end and to its foot. Vector
        and arm are the parallel sides of a trapezoid; their product is |first^2 - second^2|.
        """
        power = valid_where(where(are_equal(first, second), 0.0, squares_apart(first, second)),
                            self.square)
        return self.vector * (power / self.divisor)

    def _limit(self, radius: Real, size: Real, margin: Real) -> Limit:
        # At the limit the length is the radius: an error of a length changes the square by the
        # radius times that error. A tolerance is constant: size bounds a radius that varies.
        bound = (self.length or size) if radius.varies else abs(radius)
        return Limit(margin, TOLERANCE * bound * (size + self._magnitude))


class CrankArm(Arm):
    """
    The arm from a ground point to a crank pin, or back if `reverse`, from half angles.

    An arm between two equal lengths, g = m, vanishes once in a turn, and then its direction
    e^(i theta'/2) only changes its sign. A `smooth` arm is for what does not depend on that sign:
    its h is never zero, and its limits have smooth roots.
    """

    def __init__(self, ground: Complex, crank: Crank, reverse: bool = False, smooth: bool = False):
        line = crank.centre - ground
        g, m = line.length(), crank.length
        along = line.direction()
        turn = crank.zero * along.conjugate()
        s, h = _half_angle(crank.angle, turn)
        is_isosceles = are_equal(g, m)
        apart = where(is_isosceles, 0.0, g - m)
        h = h + where(is_isosceles, TINY, 0.0) if smooth else h
        vector = along * Complex(apart + 2.0 * m * square(h), 2.0 * m * s * h)
        self.foot = crank.centre + crank.bar() if reverse else ground
        self.square = square(apart) + 4.0 * g * m * square(h)
        self._clear = square(h) + where(is_isosceles, 0.0, 1.0)
        self._crank, self._turn, self._is_reversed = crank, turn, reverse
        self._g, self._m, self._s, self._h, self._is_smooth = g, m, s, h, smooth
        self._apart, self._is_isosceles = apart, is_isosceles
        # The arm between two equal lengths bisects them, also where it has no length itself.
        spin_ratio = where(is_isosceles, 0.5,
                           m * (2.0 * g * square(h) - apart) / self.square)
        vector.spin = Rate((crank.angle,), lambda rate: rate * spin_ratio)
        self.vector = -vector if reverse else vector

    def within(self, radius: Real, size: Real) -> Limit:
        """Return the margin radius^2 - square; the radius is made from lengths up to size."""
        return self._half_angle_limit(radius, size, 1.0)

    def beyond(self, radius: Real, size: Real) -> Limit:
        """Return the margin square - radius^2; the radius is made from lengths up to size."""
        return self._half_angle_limit(radius, size, -1.0)

    def difference(self, first: Real, second: Real, shorter: Limit) -> Real:
        """Return `first - second`, or its like in the arm where the limit takes both as equal."""
        difference, shortest = exact_sum(first, -second), abs(self._apart)
        return where(abs(shorter.ends.end) <= shorter.tolerance,
                     where(difference < 0.0, -shortest, shortest), difference
                     ) if shorter.smooth and shorter.ends else difference

    def offset(self, point: Complex, to_point: Complex) -> Real:
        """Return the cross product of the arm and the vector from its foot to a point."""
        if point is not self._crank.centre:
            return super().offset(point, to_point)
        # Twice the triangle of foot, centre and pin, with every digit where it is flat.
        area = 2.0 * self._g * self._m * self._s * self._h
        return area if self._is_reversed else -area

    def _half_angle_limit(self, radius: Real, size: Real, sign: float) -> Limit:
        """Return the margin sign (radius^2 - square)."""
        g, m, s, h = self._g, self._m, self._s, self._h
        gm = 4.0 * g * m
        start = sign * (exact_sum(radius, -g, -m) * exact_sum(radius, g, m))
        # Where ground and crank are equal up to rounding, bars are that differ by rounding alone.
        exact = exact_sum(radius)
        exact = where(abs(exact) <= 0.25 * TOLERANCE * size, 0.0, exact)
        end = sign * where(self._is_isosceles, square(exact),
                           exact_sum(radius, -g, m) * exact_sum(radius, g, -m))
        # The margin can vanish only next to its smaller value at an end.
        margin = where(abs(start) <= abs(end), start + sign * gm * square(s),
                       end - sign * gm * square(h))
        tolerance = TOLERANCE * abs(radius) * (size + g + m)
        least_margin, half = (start, s) if sign > 0.0 else (end, h)
        grown = square_root(gm) * self._first_sign(sign)
        smooth = where(abs(least_margin) <= tolerance, grown * half, root(margin, tolerance))
        return Limit(margin, tolerance, smooth if self._is_smooth else None, CrankEnds(
            start, end, arctangent(self._turn.y, self._turn.x), self._crank.angle))

    def _first_sign(self, sign: float) -> Real:
        """Return the sign that makes s (sign +1) or h positive at the first quarter turn."""
        ahead, behind = (-sign, 1.0) if self._crank.backwards else (1.0, sign)
        beyond = where(0.0 <= self._turn.y, behind, -behind)
        return where(-TOLERANCE <= self._turn.x, ahead, beyond)


def _half_angle(theta: Real, turn: Complex) -> tuple[Real, Real]:
    """Return sine and cosine of (theta + arg turn) / 2 for a unit vector turn."""
    s, h = sine(0.5 * theta), cosine(0.5 * theta)
    if turn.y.value == 0.0 and turn.x.value == 1.0:
        return s, h
    ahead = 0.0 <= turn.x
    large = square_root(0.5 * (1.0 + abs(turn.x)))
    small = 0.5 * abs(turn.y) / large
    cos = where(ahead, large, small)
    sin = where(ahead, small, large) * where(turn.y < 0.0, -1.0, 1.0)
    return s * cos + h * sin, h * cos - s * sin


class Dyad(NamedTuple):
    """Two bars that meet in a joint: the vector from each end to the joint, and the limits."""

    first: Complex
    second: Complex
    limits: tuple[Limit, ...]


def dyad(arm: Arm, first: Real, second: Real, side: float) -> Dyad:
    """
    Return the RRR dyad on an arm: circles of radius first [m] and second [m] about its ends.

    The joint is foot + w (u + i v) with u = 1/2 + (r1 - r2)(r1 + r2) / 2|w|^2 and
    v = side sqrt((r1 + r2)^2 - |w|^2) sqrt(|w|^2 - (r1 - r2)^2) / 2|w|^2; left of the arm for
    side = +1. At a change point of a smooth crank arm the branch continues smoothly.
    """
    radius = first + second
    limits = arm.within(radius, radius), arm.beyond(first - second, radius)
    difference = arm.difference(first, second, limits[1])
    v = _height(arm, limits, side)
    skew = _nan_with(v, arm.vector, difference * radius / (2.0 * arm.divisor))
    u, arm_spin = 0.5 + skew, spin(arm.vector)

    def bar(along: Real, length: Real) -> Complex:
        """Return the product of along + i v and the arm, whose spin it adds to its own."""
        return with_spin(arm.vector * Complex(along, v), Rate(
            (v, skew, *arm_spin.of), lambda dv, dskew, *rates: arm_spin.formula(*rates) + (
                (along * dv - v * dskew) * arm.square / square(length))))

    return Dyad(bar(u, first), bar(skew - 0.5, second), limits)


def _height(arm: Arm, limits: Sequence[Limit], side: float) -> Real:
    """Return the distance of a dyad's joint to the left of its arm, in lengths of the arm."""
    within, beyond = (limit.smooth or limit.root() for limit in limits)
    return within * beyond / (2.0 * arm.divisor) * side


def extended(arm: Arm, first: Real, second: Real, side: float, longest: Real) -> Dyad:
    """
    Return the dyad whose first bar is a cylinder c, up to `longest` [m], as a unit vector.

    With a bar r, u = (|w|^2 - r^2 + c^2) / 2|w|^2. There r^2 is subtracted from the larger of the
    other two squares; the third side bounds the difference. For each metre of the cylinder the
    bar turns by c / (v |w|^2), and the barrel by (1 - (|w|^2 - r^2) / c^2) / 2 of that. Nothing
    cancels where the bar is as long as the arm, and c and v vanish together.
    """
    limits = arm.stroke(abs(first), second, longest + second)
    length = arm.length
    power = arm.square - square(second) if length is None else \
        (length - second) * (length + second)
    v = _height(arm, limits, side)
    twice = where(square(first) <= arm.square, power + square(first),
                  (first - second) * (first + second) + arm.square)
    u = _nan_with(v, arm.vector, twice / (2.0 * arm.divisor))
    growth, arm_spin = _growth(arm, first, second, v), spin(arm.vector)

    def with_growing(bar: Complex, grown: Real, widened: Real) -> Complex:
        """Add a bar's spin to the arm's, from the rates of the cylinder and the arm's square."""
        return with_spin(bar, Rate(
            (first, arm.square, *arm_spin.of), lambda dc, dw, *rates: arm_spin.formula(*rates) - (
                growth * (dc * grown + dw * widened / (4.0 * first * arm.square)))))

    return Dyad(with_growing(arm.vector * Complex(u, v) / first, 0.5 - 0.5 * power / square(first),
                             arm.square - square(first) + square(second)),
                with_growing(arm.vector * Complex(u - 1.0, v), real(1.0),
                             -(power + square(first))), limits)


def _growth(arm: Arm, first: Real, second: Real, v: Real) -> Real:
    """
    Return the rotation of the other bar of a dyad per metre of its cylinder: c / (v |w|^2).

    On an arm of constant length d, c and v vanish together if the bar r is as long as the arm.
    The quotient hardly changes there; nothing cancels in the form of its rate.
    """
    growth = first / (v * arm.square)
    if (d := arm.length) is None:
        return growth
    ends = (second - d, second + d)
    return with_rate(growth, first, formula=lambda rate: growth * rate * (
        first / ((ends[1] - first) * (ends[1] + first))
        - square(ends[0]) / (first * (first - ends[0]) * (first + ends[0]))))


def _nan_with(other: Real, vector: Complex, part: Real) -> Real:
    """Return one part of a factor of a vector, NaN where the other is, as their product is."""
    # Generated code omits products with zero, which would carry the NaN.
    axial = 0.0 in (vector.x.value, vector.y.value)
    return valid_where(part, abs(other)) if axial else part


def triangle(base: Real, first: Real, second: Real, side: float) -> Complex:
    """
    Return k such that P + (Q - P) k is the corner of a rigid triangle on the bar PQ.

    The base is |PQ|, first and second are the corner's distances from P and Q [m]; left of
    P -> Q for side = +1. NaN where no such triangle exists.
    """
    margins = (exact_sum(first, second, -base) * exact_sum(first, second, base),
               exact_sum(base, -first, second) * exact_sum(base, first, -second))
    twice, sides = 2.0 * square(base), first + second
    # Sides that are flat up to rounding, which moves a factor of a margin, are flat.
    within, beyond = (root(where(abs(margin) <= tolerance, 0.0, margin), tolerance)
                      for margin, tolerance in zip(margins, (
                          TOLERANCE * square(sides), TOLERANCE * sides * base)))
    return Complex(0.5 + squares_apart(first, second) / twice, within * beyond / twice * side)


def mirror(arm: Arm, image: Complex, offset: Real, ends: Sequence[Complex]) -> tuple[Complex, ...]:
    """
    Return the mirror image of a point in the line of an arm, and the bars from both ends to it.

    `offset` is the point's offset from the arm. `ends` are the bars to the point from the arm's
    foot and from its end. The spin of a bar's image is twice the arm's minus the bar's own.
    """
    across, arm_spin, bars = arm.across(offset), spin(arm.vector), []
    for bar in ends:
        bar_spin = spin(bar)
        bars.append(with_spin(bar + across, Rate(
            (*arm_spin.of, *bar_spin.of), lambda *rates, bar_spin=bar_spin: valid_where(
                2.0 * arm_spin.formula(*rates[:len(arm_spin.of)])
                - bar_spin.formula(*rates[len(arm_spin.of):]), abs(image.x + image.y)))))
    return with_velocity(image, arm.foot, bars[0]), *bars


def parallel(bar: Complex, place: Complex) -> Complex:
    """Return a bar equal to another one, NaN where the place of its end is NaN."""
    bar_spin = spin(bar)
    same = Complex(*(valid_where(part, abs(place.x)) for part in (bar.x, bar.y)))
    same.spin = Rate(bar_spin.of, lambda *rates: valid_where(
        bar_spin.formula(*rates), abs(place.x)))
    return same


def with_velocity(place: Complex, start: Complex, bar: Complex) -> Complex:
    """Return a place with the velocity of the end of a bar of constant length on `start`."""
    bar_spin = spin(bar)
    return Complex(
        with_rate(place.x, start.x, *bar_spin.of,
                  formula=lambda rate, *rates: rate - bar_spin.formula(*rates) * bar.y),
        with_rate(place.y, start.y, *bar_spin.of,
                  formula=lambda rate, *rates: rate + bar_spin.formula(*rates) * bar.x))


def transmission(dyad: Dyad) -> Real:
    """
    Return the angle [rad] in [0, pi] between the two bars of a dyad, at their joint.

    With the arm w, tan^2(mu/2) = (|w|^2 - (r1 - r2)^2) / ((r1 + r2)^2 - |w|^2).
    """
    if not dyad.limits:
        return arctangent(abs(cross(dyad.first, dyad.second)), dot(dyad.first, dyad.second))
    within, beyond = dyad.limits
    return 2.0 * arctangent(beyond.root(), within.root())


def inversor(arm: Arm, long: Real, short: Real) -> tuple[Dyad, Dyad, Complex]:
    """
    Return the Peaucellier-Lipkin cell with bars long [m] from the pole and a rhombus of short [m].

    These are its right and left dyad on the arm from the pole to the pin, and the traced corner,
    which is pole + (long^2 - short^2) / conjugate(w): it runs on a straight line when the pole
    lies on the crank circle.
    """
    right = dyad(arm, long, short, -1.0)
    left = dyad(arm, long, short, 1.0)
    power = squares_apart(long, short)
    inverse = arm.vector * (power / arm.divisor)
    return right, left, Complex(*(
        valid_within(part, right.limits) for part in (inverse.x, inverse.y)))


def slot(arm: Arm, offset: Real, half: float) -> tuple[Complex, Real, Limit]:
    """
    Return the lever about the arm's foot whose slot, `offset` [m] to its left, takes the pin.

    These are the unit vector l along the lever, the slide t = half sqrt(|w|^2 - e^2) [m], with
    w = l (t + i e), and the limit.
    """
    limit = arm.beyond(offset, abs(offset))
    slide = limit.root() * half
    central, aside = abs(offset) <= 0.0, arm.vector * Complex(slide, -offset)
    along = Complex(*(valid_where(where(central, way * half, part), arm.divisor)
                      for way, part in ((arm.vector.x, aside.x), (arm.vector.y, aside.y))))
    arm_spin = spin(arm.vector)
    return with_spin(along.direction(), Rate(
        (slide, *arm_spin.of), lambda rate, *rates: arm_spin.formula(*rates) + where(
            central, 0.0, offset * rate / arm.divisor))), slide, limit


class Rail:
    """A pin relative to the line that a block slides on: its foot along it, its height above."""

    def __init__(self, pin: Complex, origin: Complex, along: Complex, magnitude: Real):
        self.along = along
        self.height, self.foot = cross(along, pin - origin), dot(along, pin - origin)
        self._magnitude = magnitude

    def limits(self, rod: Real) -> tuple[Limit, ...]:
        """Return the margins whose product is rod^2 - height^2."""
        margin = (rod - self.height) * (rod + self.height)
        return (Limit(margin, TOLERANCE * rod * (rod + self._magnitude)),)


class CrankRail(Rail):
    """
    A crank pin relative to the line that a block slides on, by half angles.

    With the height h0 of the crank's centre, the crank m and its angle psi from the line, the
    margins are (rod + h0 - m) + 2 m s^2 and (rod - h0 - m) + 2 m h^2, where s and h are sine and
    cosine of (psi + pi/2)/2.
    """

    def __init__(self, crank: Crank, origin: Complex, along: Complex):
        # Only the crank's distance from the line matters, not its place on the ground.
        magnitude = (crank.centre - origin).length() + crank.length
        super().__init__(crank.centre + crank.bar(), origin, along, magnitude)
        self._crank = crank
        self._centre = cross(along, crank.centre - origin)
        self._turn = (crank.zero * along.conjugate()).turned()

    def limits(self, rod: Real) -> tuple[Limit, ...]:
        """Return the margins whose product is rod^2 - height^2."""
        m, centre, (s, h) = self._crank.length, self._centre, _half_angle(
            self._crank.angle, self._turn)
        low, high = exact_sum(rod, centre, -m), exact_sum(rod, centre, m)
        near, far = exact_sum(rod, -centre, -m), exact_sum(rod, -centre, m)
        # Both roots are positive where the pin is farthest along the line.
        behind = where(self._turn.y < 0.0, where(self._turn.x <= 0.0, -1.0, 1.0), 1.0)
        return (self._limit(rod, low, high, low, s, behind),
                self._limit(rod, far, near, near, h, behind))

    def _limit(self, rod: Real, start: Real, end: Real, least_margin: Real, half: Real,
               sign: Real) -> Limit:
        margin = least_margin + 2.0 * self._crank.length * square(half)
        tolerance = TOLERANCE * (rod + self._magnitude)
        grown = square_root(2.0 * self._crank.length) * sign
        smooth = where(abs(least_margin) <= tolerance, grown * half, root(margin, tolerance))
        return Limit(margin, tolerance, smooth, CrankEnds(
            start, end, arctangent(self._turn.y, self._turn.x), self._crank.angle))


def slider(rail: Rail, rod: Real, side: float) -> tuple[Complex, Real, tuple[Limit, ...], Real]:
    """
    Return the RRP dyad: a rod [m] from a pin to a block on a line.

    These are the vector of the rod, the block's place along the line [m], the limits, and how far
    the block is ahead of the pin [m]. It is ahead for side = +1, and continues smoothly past a
    change point of a crank.
    """
    limits = rail.limits(rod)
    reach = reduce(lambda x, y: x * y, (limit.smooth or limit.root() for limit in limits)) * side
    height = _nan_with(reach, rail.along, rail.height)
    return rail.along * Complex(reach, -height), rail.foot + reach, limits, reach
