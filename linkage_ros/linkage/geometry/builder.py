# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Build a linkage joint by joint.

Each joint is placed by one construction from earlier joints. The constructions determine the
links, the drawn bars, the spanning tree of joint angles and the limits of the reach.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import takewhile
from math import pi
from typing import Any, Mapping, NamedTuple, Sequence

from . import planar
from ..inputs import ANGLE, Input, LENGTH
from ..tolerances import TOLERANCE
from ...formula.expression import (
    arctangent,
    argument,
    Complex,
    cosine,
    cross,
    dot,
    nearest_integer,
    Number,
    Real,
    real,
    sine,
    valid_where,
)

GROUND = 'ground'


class ConstructionError(ValueError):
    """A construction that is impossible on its joints."""


class Link(NamedTuple):
    """
    A moving link in the spanning tree.

    It turns about the point `joint` of its parent (or slides along its parent, from that point);
    its bar points from there to `tip`. The joint angle is counted from `zero` [rad]: from +x for
    links on the ground, else from the parent's bar.
    """

    name: str
    parent: str
    joint: str
    kind: str
    zero: Any
    tip: str


def bar_name(joint: str, tip: str) -> str:
    """Return the name of a bar's link."""
    return ('' if len(joint + tip) == 2 else '_').join((joint, tip))


class Gear(NamedTuple):
    """A geared input: another input times a ratio, plus an offset [rad or m]."""

    input: str
    ratio: Real
    offset: Real


class Bar(NamedTuple):
    """Two points at a constant distance [m]."""

    first: str
    second: str
    length: Real


@dataclass
class Point:
    """A joint: its place, the link that it belongs to, and the size of its coordinates [m]."""

    place: Any
    link: str
    magnitude: Real
    crank: planar.Crank | None = None


class _Vector(NamedTuple):
    vector: Complex
    length: Real
    link: str


class Builder:
    """The joints, links and limits of a linkage, as expressions of its dimensions and inputs."""

    def __init__(self, turned: Mapping[str, Any] | None = None) -> None:
        # Whole turns from which inputs are counted.
        self._turned = {**(turned or {})}
        self.points: dict[str, Point] = {}
        self.links: list[Link] = []
        self.bars: list[Bar] = []
        self.limits: list[planar.Limit] = []
        self.frames: dict[str, dict[str, Complex]] = {}
        self.joint_values: dict[str, Real] = {}
        self.transmissions: dict[str, Real] = {}
        self.folds: list[planar.Limit] = []
        # Limits other than dead points: the ends of strokes.
        self.ways: list[planar.Limit] = []
        self.inputs: list[Input] = []
        self.arguments: list[Real] = []
        # Lengths of cylinders, NaN if negative; in an inverse linkage they may be signed slides.
        self.positive: dict[Real, Real] = {}
        self.cylinders: list[tuple[str, str]] = []
        self.yokes: dict[str, str] = {}
        # The ground joints of the lines that what is added is mirrored in, one after the other.
        self.mirrors: tuple[tuple[str, ...], ...] = ()
        # What dimensions must make positive: the line that is drawn, an amount, the problem.
        self.drawn: Any = None
        self.demands: list[tuple[Any, Real, str]] = []
        # In space: links that must have one pose at most.
        self.axes = 'xy'
        self.windows: list[Any] = []
        self._vectors: dict[tuple[str, str], _Vector] = {}
        # Each link's bar, or the direction in which it slides or points.
        self.directions: dict[str, _Vector] = {}
        self.driven: dict[str, tuple[Input, Real]] = {}

    def require(self, amount: Real, problem: str, line: Any = None) -> None:
        """Refuse a line, the one drawn, for dimensions with which an amount is not above zero."""
        self.demands.append((line or self.drawn, amount, problem))

    @property
    def grounded(self) -> tuple[str, ...]:
        """Return the joints on the ground."""
        return tuple(name for name, point in self.points.items() if point.link == GROUND)

    def ground(self, name: str, x: Number, y: Number) -> None:
        """Fix a joint to the ground at (x, y) [m]."""
        place = Complex(x, y)
        self.points[name] = Point(place, GROUND, abs(place.x) + abs(place.y))

    def crank(self, name: str, centre: str, length: Real, up: bool = False,
              zero: str | None = None, geared: Gear | None = None,
              called: str = '') -> None:
        """Turn a crank [m] about a joint; its zero is +x, or +y if `up`, or towards a joint."""
        link = called or self._numbered('crank')
        angle = self.drive(Input(link, ANGLE), geared)
        if zero is None:
            self._on_ground(centre, ' unless the line has zero and a joint of its link')
            parent, along = GROUND, Complex(0.0, 1.0) if up else Complex(1.0, 0.0)
            start = real(pi / 2 if up else 0.0)
            if self.mirrors:
                along = self._mirrored(along)
                start = arctangent(along.y, along.x)
        else:
            parent, along, start = self._direction(centre, zero)
        crank = planar.Crank(self.points[centre].place, length, along, angle,
                             backwards=len(self.mirrors) % 2 == 1)
        bar = crank.bar() if parent == GROUND else along * Complex(
            cosine(angle), sine(angle)) * length
        self._add_link(centre, name, bar, length, link, parent, start)
        self.joint_values[link] = angle
        self._place(name, centre, bar, link, length)
        if parent == GROUND:
            self.points[name].crank = crank

    def cylinder(self, name: str, base: str, pivot: str, bar: Real, side: float,
                 geared: Gear | None = None, called: str = '') -> None:
        """Join a bar [m] from a pivot and a cylinder from a base, left of base -> pivot."""
        shortest, longest = self._stroke(base, pivot, bar)
        word = called or self._numbered('cylinder')
        length = self.drive(Input(word, LENGTH, shortest, longest), geared)
        positive = self.positive[length] = valid_where(length, length, TOLERANCE * longest)
        dyad = planar.extended(self._plain_arm(base, pivot), positive, bar, side, longest)
        self.limits += dyad.limits
        link = self._add_link(pivot, name, dyad.second, bar)
        self._place(name, pivot, dyad.second, link, bar)
        self.transmissions[name] = planar.transmission(dyad)
        barrel = self._add_link(base, name, dyad.first, None, self._numbered('barrel'))
        self._slide(word, barrel, base, name, length, dyad.first)
        self.cylinders.append((base, name))

    def carriage(self, name: str, origin: str, towards: str, low: Real, high: Real,
                 geared: Gear | None = None, called: str = '') -> None:
        """Drive a joint along the line from a joint towards another of one link, low to high."""
        word = called or self._numbered('carriage')
        place = self.drive(Input(word, LENGTH, low, high), geared)
        # A carriage has no place beyond its ends, as a cylinder beyond its stroke.
        way = abs(low) + abs(high)
        ends = [planar.Limit(margin, TOLERANCE * way) for margin in (place - low, high - place)]
        self.limits += ends
        self.ways += ends
        self._add_block(word, name, origin, towards, planar.valid_within(place, ends), way)

    def yoke(self, name: str, pin: str, origin: str, towards: str) -> None:
        """Slide a block along a line between two joints; a pin runs in a slot across it."""
        _, along, _ = self._direction(origin, towards)
        start, end = self.points[origin], self.points[pin]
        block = self._numbered('block')
        self.yokes[block] = pin
        self._add_block(block, name, origin, towards,
                        dot(along, end.place - start.place), end.magnitude + start.magnitude)

    def _add_block(self, link: str, name: str, origin: str, towards: str, place: Real, way: Real
              ) -> None:
        """Place a joint on the line of two others, as the block that slides there."""
        parent, along, direction = self._direction(origin, towards)
        self._slide(link, parent, origin, name, place, along, direction)
        start = self.points[origin]
        self.points[name] = Point(
            start.place + planar.on_line(along, place), link, start.magnitude + way)

    def block(self, name: str, joint: str, along: Real, across: Real) -> None:
        """Add a joint to the block that slides with a joint: along its line, and to its left."""
        link = next((x.name for x in self.links if x.kind == 'prismatic' and x.tip == joint), None)
        if link is None:
            raise ConstructionError(f'{joint} is not a joint of a block')
        offset = Complex(along, across)
        arm = planar.parallel(self.directions[link].vector * offset, self.points[joint].place)
        self._place(name, joint, arm, link, offset.length())
        self.frames[link][name] = self.frames[link][joint] + offset

    def drive(self, input_: Input, geared: Gear | None) -> Real:
        """Return the expression of an input [rad or m]: a new one, or a geared one."""
        if not input_.is_angle:
            self.require(real(input_.high - input_.low), f'the lower end of the {input_.name} '
                         'must be less than its upper end')
        if geared is None:
            value = argument(len(self.inputs))
            self.inputs.append(input_)
            self.arguments.append(value)
        else:
            other, driving = self.driven.get(geared.input, (None, None))
            if other is None or driving is None or other.is_angle != input_.is_angle:
                alike = [name for name, (x, _) in self.driven.items() if x.kind == input_.kind]
                raise ConstructionError(f'it cannot be geared to {geared.input}; allowed: '
                                        f'{", ".join(alike) or f"none in {input_.unit}"}')
            value = geared.ratio * driving + geared.offset
            if geared.input in self._turned:
                turns = geared.ratio * self._turned[geared.input]
                # What is geared to this one counts from the turns that are left out here: an even
                # number, after which a branch is the same whatever change points it passes.
                even = 2.0 * nearest_integer(0.5 * turns)
                self._turned[input_.name] = even
                value = value + 2.0 * pi * (turns - even)
        self.driven[input_.name] = input_, value
        return value

    def _direction(self, origin: str, towards: str) -> tuple[str, Complex, Real]:
        """Return the link of two joints, the direction between them, and its angle on the link."""
        side, crank = self._side(origin, towards), self.points[towards].crank
        along = crank.bar(real(1.0)) if crank and crank.centre is self.points[origin].place \
            else side.vector.direction()
        seen = along
        if side.link != GROUND:
            frame = self.frames[side.link]
            seen = frame[towards] - frame[origin]
        return side.link, along, arctangent(seen.y, seen.x)

    def _stroke(self, base: str, pivot: str, bar: Real) -> tuple[Real, Real]:
        """Return the shortest and longest cylinder that a bar to a pivot allows."""
        if side := self._constant(base, pivot):
            return abs(side.length - bar), side.length + bar
        return real(0.0), self.points[base].magnitude + self.points[pivot].magnitude + bar

    def image(self, name: str, point: str, first: str, second: str) -> None:
        """Fix a joint to the ground at the mirror image of another in the line of two others."""
        for joint in (point, first, second):
            self._on_ground(joint)
        self.mirrors, origin = ((first, second),), self.points[first]
        place = origin.place + self._mirrored(self.points[point].place - origin.place)
        self.points[name] = Point(
            place, GROUND, self.points[point].magnitude + 2.0 * origin.magnitude)

    def _mirrored(self, vector: Complex) -> Complex:
        """Return a vector's image in the mirror lines."""
        for ends in self.mirrors:
            line = self._side(*ends)
            axis = line.vector / line.length
            vector = axis * axis * vector.conjugate()
        return vector

    def dyad(self, name: str, first: str, second: str, to_first: Real, to_second: Real,
             side: float) -> None:
        """Join bars of to_first and to_second [m] from two joints, left of first -> second."""
        dyad = planar.dyad(self.arm(first, second, smooth=True), to_first, to_second, side)
        self.limits += dyad.limits
        start, pivot = self.points[first], self.points[second]
        place = start.place + dyad.first
        if start.link != GROUND == pivot.link:
            # About a joint of the ground it can only turn.
            place = planar.with_velocity(place, pivot.place, dyad.second)
        self._pair(name, first, second, dyad, to_first, to_second, place)

    def rigid(self, name: str, first: str, second: str, to_first: Real, to_second: Real,
              side: float) -> None:
        """Add the third corner of a rigid triangle on a bar; left of first -> second."""
        vector, base, link = self._side(first, second)
        corner = planar.triangle(base, to_first, to_second, side)
        self.limits.append(planar.Limit(abs(corner.y), real(0.0)))
        self.require(1.0 + abs(corner.y), 'no triangle has these sides: each must be shorter '
                     'than the other two together')
        self._add_to_link(name, first, second, corner, to_first)
        if link != GROUND:
            self._bar(second, name, vector * (corner - Complex(1.0, 0.0)), to_second, link)

    def line(self, name: str, first: str, second: str, distance: Real) -> None:
        """Add a point on the line of a bar, a distance [m] from first, towards second."""
        part = distance / self._side(first, second).length
        self._add_to_link(name, first, second, Complex(part, 0.0), abs(distance))

    def _add_to_link(self, name: str, first: str, second: str, corner: Complex,
                     length: Real) -> None:
        """Add a joint to the link of two others, first + corner (second - first)."""
        vector, _, link = self._side(first, second)
        if link == GROUND:
            start = self.points[first]
            self.points[name] = Point(
                start.place + vector * corner, GROUND, start.magnitude + length)
            return
        self._place(name, first, vector * corner, link, length)
        frame = self.frames[link]
        frame[name] = frame[first] + (frame[second] - frame[first]) * corner

    def mirror(self, name: str, point: str, first: str, second: str) -> None:
        """Mirror a joint in the line of two others: the far corner of a kite."""
        ends = [self._side(end, point).vector for end in (second, first)]
        place, arm = self.points[point].place, self.arm(second, first, smooth=True)
        offset = arm.offset(place, ends[0])
        self._reflect(name, first, second, arm, place + arm.across(offset), offset, ends,
                      self._side(first, point).length, self._side(second, point).length)

    def parallelogram(self, name: str, corner: str, first: str, second: str) -> None:
        """Join bars to two joints that are parallel to the bars from a corner to them."""
        to_first, to_second = (self._side(corner, end) for end in (first, second))
        self.folds.append(planar.Limit(cross(to_first.vector, to_second.vector),
                                       TOLERANCE * to_first.length * to_second.length))
        place = self.points[first].place + to_second.vector
        from_first, from_second = (planar.parallel(side.vector, place)
                                   for side in (to_second, to_first))
        self._pair(name, first, second, planar.Dyad(from_first, from_second, ()),
                   to_second.length, to_first.length)

    def antiparallelogram(self, name: str, corner: str, first: str, second: str) -> None:
        """Join two bars as long as those from a corner, but crossed."""
        to_first, to_second = (self._side(corner, end) for end in (first, second))
        arm, start = self.arm(second, first, smooth=True), self.points[corner].place
        self._reflect(name, first, second, arm,
                      start + arm.to_opposite(to_first.length, to_second.length),
                      -arm.offset(start, -to_second.vector), (to_first.vector, to_second.vector),
                      to_second.length, to_first.length)

    def _reflect(self, name: str, first: str, second: str, arm: planar.Arm, image: Complex,
                 offset: Real, ends: Sequence[Complex], to_first: Real, to_second: Real) -> None:
        """Join two bars at the image of a point, given its offset and bars to it; see `mirror`."""
        self.folds.append(planar.Limit(offset, TOLERANCE * to_first * to_second))
        place, from_second, from_first = planar.mirror(arm, image, offset, ends)
        self._pair(name, first, second, planar.Dyad(from_first, from_second, ()), to_first,
                   to_second, place)

    def inversor(self, names: tuple[str, str, str], pole: str, pin: str, long: Real,
                 short: Real) -> None:
        """Add a Peaucellier cell: the joint right of pole -> pin, the corner, the left joint."""
        right, corner, left = names
        first, second, inverse = planar.inversor(self.arm(pole, pin), long, short)
        self.limits += first.limits
        self._pair(right, pole, pin, first, long, short)
        link = self._add_link(right, corner, second.second, short)
        self._place(corner, right, second.second, link, short, self.points[pole].place + inverse)
        self._pair(left, pole, pin, second, long, short)
        link = self._add_link(left, corner, first.second, short)
        self._bar(left, corner, first.second, short, link)

    def slot(self, tip: str, pivot: str, pin: str, offset: Real, half: float,
             length: Real) -> None:
        """Turn a lever of this length [m] about a joint by a pin in its slot."""
        along, slide, limit = planar.slot(self.arm(pivot, pin), offset, half)
        self.limits.append(limit)
        start = real(pi / 2) if self.points[pivot].link == GROUND else real(0.0)
        lever = self._add_link(pivot, tip, along, None, self._numbered('lever'), start=start)
        self.frames[lever][tip] = Complex(length, 0.0)
        self._place(tip, pivot, along * length, lever, length)
        self.transmissions[tip] = arctangent(abs(slide), offset)
        self._slide(self._numbered('slide'), lever, pivot, pin, slide, along)
        self.frames[self.links[-1].name][pin] = Complex(0.0, offset)

    def slider(self, name: str, pin: str, rod: Real, origin: str, direction: Real | str,
               side: float) -> None:
        """
        Join a rod [m] from a joint to a block on a line through another.

        The line has an angle [rad] on the ground, or goes towards a joint of the same link.
        """
        if isinstance(direction, str):
            parent, along, angle = self._direction(origin, direction)
        else:
            self._on_ground(origin)
            parent, along, angle = GROUND, Complex(cosine(direction), sine(direction)), direction
            if self.mirrors:
                along = self._mirrored(along)
                angle = arctangent(along.y, along.x)
        start, end = self.points[origin], self.points[pin]
        rail = planar.CrankRail(end.crank, start.place, along) \
            if end.crank and not along.x.varies and start.link == GROUND \
            else planar.Rail(end.place, start.place, along, start.magnitude + end.magnitude)
        bar, place, limits, reach = planar.slider(rail, rod, side)
        self.limits += limits
        link = self._add_link(pin, name, bar, rod)
        self._place(name, pin, bar, link, rod)
        self.transmissions[name] = arctangent(abs(reach), rail.height)
        self._slide(self._numbered('block'), parent, origin, name, place, along, angle)

    def _on_ground(self, name: str, otherwise: str = '') -> None:
        if self.points[name].link != GROUND:
            raise ConstructionError(f'joint {name} must be on the ground{otherwise}')

    def _side(self, first: str, second: str) -> _Vector:
        """Return the vector between two joints of one link or of the ground."""
        if side := self._constant(first, second):
            return side
        raise ConstructionError(f'{first} and {second} are not joints of one moving link')

    def _constant(self, first: str, second: str) -> _Vector | None:
        """Return the vector between two joints; None if they are of two links."""
        ends = self.points[first], self.points[second]
        side = self._vectors.get((first, second))
        if ends[0].link == ends[1].link == GROUND:
            vector = ends[1].place - ends[0].place
            side = _Vector(vector, vector.length(), GROUND)
        for link, frame in () if side else self.frames.items():
            if first in frame and second in frame:
                bar, across = self.directions[link], frame[second] - frame[first]
                side = self._vectors[first, second] = _Vector(
                    bar.vector * (across / bar.length), across.length(), link)
                break
        if side:
            self.require(side.length, f'{first} and {second} are at the same place')
        return side

    def spot(self, link: str, seen: Complex) -> Complex:
        """Return the place of a point that a link carries, from where it lies on the link."""
        if link == GROUND:
            return seen
        axis, (joint, start) = self.directions[link], next(iter(self.frames[link].items()))
        along = axis.vector.direction()
        return self.points[joint].place + along * (seen - start)

    def _numbered(self, word: str) -> str:
        taken = sum(link.name.rstrip('0123456789') == word for link in self.links)
        return f'{word}{taken + 1}' if taken else word

    def _check_new(self, link: str) -> None:
        if link in self.joint_values:
            raise ConstructionError(f'its link {link} would have the name of another')

    def _slide(self, name: str, parent: str, joint: str, tip: str, place: Real, along: Complex,
               direction: Number = 0.0) -> None:
        """Add a link that slides in a direction, seen from its parent, and has its tip at zero."""
        self._check_new(name)
        self.links.append(Link(name, parent, joint, 'prismatic', real(direction), tip))
        self.joint_values[name] = place
        self.frames[name] = {tip: Complex(0.0, 0.0)}
        self.directions[name] = _Vector(along, real(1.0), name)

    def arm(self, first: str, second: str, *, smooth: bool = False) -> planar.Arm:
        """Return the arm from one joint to another; see `planar.CrankArm` for `smooth`."""
        ends = self.points[first], self.points[second]
        for (foot, pin), reverse in ((ends, False), (ends[::-1], True)):
            if pin.crank and foot.link == GROUND and foot.place is not pin.crank.centre:
                return planar.CrankArm(foot.place, pin.crank, reverse, smooth)
        return self._plain_arm(first, second)

    def _plain_arm(self, first: str, second: str) -> planar.Arm:
        """Return the arm from one joint to another by their coordinates."""
        ends = self.points[first], self.points[second]
        if side := self._constant(first, second):
            return planar.Arm(ends[0].place, side.vector, side.length, side.length)
        return planar.Arm(ends[0].place, self._between(first, second),
                          ends[0].magnitude + ends[1].magnitude)

    def _between(self, first: str, second: str) -> Complex:
        """Return the vector between two joints; bars from a common joint are more accurate."""
        # A joint that was placed after one of them may depend on both.
        for name in takewhile(lambda name: name not in (first, second), self.points):
            bars = [self._vectors[name, end] for end in (first, second)
                    if (name, end) in self._vectors]
            if len(bars) == 2:
                return bars[1].vector - bars[0].vector
        return self.points[second].place - self.points[first].place

    def _pair(self, name: str, first: str, second: str, dyad: planar.Dyad, to_first: Real,
              to_second: Real, place: Complex | None = None) -> None:
        """Join the two bars of a dyad: the joint belongs to the first, the second is cut there."""
        link = self._add_link(first, name, dyad.first, to_first)
        self._place(name, first, dyad.first, link, to_first, place)
        link = self._add_link(second, name, dyad.second, to_second)
        self._bar(second, name, dyad.second, to_second, link)
        self.transmissions[name] = planar.transmission(dyad)

    def _add_link(self, joint: str, tip: str, bar: Complex, length: Real | None,
                  name: str | None = None, parent: str | None = None,
                  start: Real | None = None) -> str:
        """
        Add a link that turns about a joint, and return its name.

        Its bar is a unit vector if it has no length [m], and then its tip is not on it. Its angle
        is counted from `start` [rad], seen from its parent: the link that the joint belongs to,
        unless another is given.
        """
        name = name or bar_name(joint, tip)
        self._check_new(name)
        parent, start = parent or self.points[joint].link, start or real(0.0)
        zero = Complex(0.0, 1.0) if start.value else Complex(1.0, 0.0)
        if parent in self.directions:
            zero = self.directions[parent].vector
        relative = bar * zero.conjugate()
        self.links.append(Link(name, parent, joint, 'revolute', start, tip))
        self.joint_values[name] = arctangent(relative.y, relative.x)
        self.frames[name] = {joint: Complex(0.0, 0.0)}
        if length is not None:
            self.frames[name][tip] = Complex(length, 0.0)
        self.directions[name] = _Vector(bar, length or real(1.0), name)
        return name

    def _place(self, name: str, start: str, vector: Complex, link: str, length: Real,
               place: Complex | None = None) -> None:
        """Place a joint at the end of a bar from another, or where it is known to be."""
        origin = self.points[start]
        self.points[name] = Point(place or origin.place + vector, link, origin.magnitude + length)
        self._bar(start, name, vector, length, link)

    def _bar(self, first: str, second: str, vector: Complex, length: Number, link: str) -> None:
        length = real(length)
        self.bars.append(Bar(first, second, length))
        self.require(length, f'the bar {first}-{second} must be longer than zero')
        self._vectors[first, second] = _Vector(vector, length, link)
        self._vectors[second, first] = _Vector(-vector, length, link)
