# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Linkages in space as text: hinges with axes anywhere, and rods with ball ends.

    pitch hinge ground at 0 0 0 axis 0 1 0 within -50deg 30deg     turns on the ground
    roll hinge pitch at 0 0 -h axis 1 0 0 within -15deg 15deg      turns on pitch
    right motor ground at x 0 z axis 0 1 0                         a hinge that is an input
    block slide ground at 0 0 0 axis 0 0 1 within 0 d              slides along its axis
    R rod right 0.04 -0.02 0.2 roll 0.02 -0.02 -0.01               from a ball to a ball
    C cylinder ground 0 0 0 roll 0.02 0.02 -0.01                   a rod whose length is an input
    toe fixed roll                                                 another name for a link

Each line except those of rods and cylinders adds a link to an earlier link or to the `ground`. All
points [m] and axes are those of one drawing, in the frame of the ground. In that drawing every
angle and slide is zero; they are positive about and along the axis. A rod is as long as drawn
unless it ends in `length LENGTH`. Numbers are written as in joint lines.

Rods place the joints that are not driven, in any order that is possible. One rod places one hinge
or slide, on the side on which the rod is drawn. Two rods place two hinges in a row, which both
need `within`: with each crank on the side on which it is drawn, there is proved to be one pose at
most inside these limits.
"""

from __future__ import annotations

from itertools import combinations
import math
from typing import (
    Any,
    Collection,
    Iterable,
    Mapping,
    NamedTuple,
    Sequence,
)

import numpy as np

from .joint_lines import check_order, formula, Line, parsed
from ..geometry.builder import Bar, Builder, GROUND, Link, Point
from ..geometry.planar import Limit, valid_within
from ..geometry.spatial import (
    Circle,
    drawn_ahead,
    drawn_side,
    EDGE,
    Frame,
    Hinge,
    Pivot,
    Rod,
    rod_on_hinge,
    rod_on_slide,
    Turn,
    two_rods,
    Vector,
    ZERO,
)
from ..geometry.window import Window, WindowRod
from ..inputs import ANGLE, Input, LENGTH
from ..tolerances import SINGULAR, TOLERANCE
from ...formula.expression import Real, real
from ...words import join_names

FORMS = {
    'hinge': ('hinge LINK at X Y Z axis U V W [within ANGLE ANGLE]',),
    'slide': ('slide LINK at X Y Z axis U V W [within DISTANCE DISTANCE]',),
    'motor': ('motor LINK at X Y Z axis U V W',),
    'fixed': ('fixed LINK',),
    'rod': ('rod LINK X Y Z LINK X Y Z [length LENGTH]',),
    'cylinder': ('cylinder LINK X Y Z LINK X Y Z [within DISTANCE DISTANCE]',),
}
INPUTS = 'motor', 'cylinder'
_JOINTS, _RODS = ('hinge', 'slide', 'motor'), ('rod', 'cylinder')
# Maximum number of lines of a linkage: the order of solution is searched among all rods.
MAX_LINES = 200
# Least sine of the angle between the axes of two hinges in a row.
_LEANING = 1e-3


class WindowError(ValueError):
    """
    Missing or too wide limits.

    `problem` says why, with two poses if they are known; `limits` has the largest valid ones by
    hinge [rad], if any.
    """

    def __init__(self, line: Line, problem: str, poses: str,
                 limits: dict[str, tuple[float, float]]):
        largest = ', '.join(f'{name} within {math.degrees(low):.4g}deg {math.degrees(high):.4g}deg'
                            for name, (low, high) in limits.items())
        # Not shortened: two poses are a proof. The remedy is first: scenes shorten long texts.
        super().__init__(f'{line.error("")}{problem}; ' + (
            f'the largest proved to have one at most: {largest}' if limits else
            'no limits about their middle are proved to have one at most')
            + (f'; {poses}' if poses else ''))
        self.problem, self.limits = f'{problem}: {poses}' if poses else problem, limits


class TwoRodLink(NamedTuple):
    """A link on two hinges in a row and two rods: the data of its window, as expressions."""

    lines: tuple[Line, Line]
    inputs: tuple[str, ...]
    limits: tuple[tuple[Real, ...] | None, ...]
    rods: tuple[WindowRod, ...]

    def check(self) -> None:
        """Raise ValueError, with the largest window, unless one pose at most is proved."""
        if any(np.ndim(part) for rod in self.rods for path in rod[:2] for vector in path
               for part in vector):
            raise self.lines[1].error('two rods on two hinges need one set of dimensions, not '
                                      'arrays: the proof of their single pose takes numbers')
        # Without limits, the largest window is searched up to a quarter turn to each side.
        window = Window(self.rods, *zip(*(
            ends or (-0.5 * math.pi, 0.5 * math.pi) for ends in self.limits)))
        limited = all(self.limits)
        if limited and window.is_proved():
            return
        largest, names = window.largest(), [line.names[0] for line in self.lines]
        raise WindowError(
            self.lines[1], *_why_not(window, self.inputs, names) if limited
            else ('both hinges need limits', ''),
            dict(zip(names, zip(largest.low.tolist(), largest.high.tolist()))) if largest else {})


def _why_not(window: Window, inputs: Sequence[str], hinges: Sequence[str]) -> tuple[str, str]:
    """Return why limits are not proved, and two poses if there are some."""
    def at(names: Sequence[str], values: Iterable[float]) -> str:
        return ', '.join(f'{name} at {value:.6g}' for name, value in zip(names, values))

    if two := window.second_pose():
        motors, poses = two
        return 'there is a second pose in these limits', f'with {at(inputs, motors)}, ' + (
            ' as well as '.join(at(hinges, pose) for pose in poses))
    return ("there may be a second pose in these limits, or one that the steps of Newton's method "
            'do not reach', '')


def parse(texts: Iterable[str]) -> list[Line]:
    """Return the lines of a linkage; raise ValueError that names an invalid line."""
    lines = [parsed(text, FORMS) for text in texts]
    if len(lines) > MAX_LINES:
        raise ValueError(f'a linkage in space has up to {MAX_LINES} lines, got {len(lines)}')
    check_order(lines, 'link', (GROUND,), _RODS)
    _LinkTree(lines).order()
    return lines


def points(lines: Iterable[Line]) -> list[str]:
    """Return the points that lines place: an origin of each link, and both ends of each rod."""
    joints = [line.names[0] for line in lines if line.word in _JOINTS]
    return [*(f'{line.names[0]}_{link}' for line in lines if line.word in _RODS
              for link in line.depends_on), *(f'{name}_origin' for name in joints)]


def branches(lines: Iterable[Line]) -> dict:
    """Return the side of each rod: 1 as it is drawn."""
    return {line.names[0]: 1 for line in lines if line.word in _RODS}


def draw(builder: Builder, lines: Iterable[Line], symbols: Mapping[str, Real],
         signs: Mapping[str, int], inputs: Collection[str] = ()) -> None:
    """Place the links of a linkage; its inputs are `inputs`, by default the driven joints."""
    builder.axes = 'xyz'
    _Drawing(builder, list(lines), symbols, signs, inputs).draw()


def turning_rods(lines: Sequence[Line], inputs: Collection[str]) -> list[str]:
    """
    Return the rods that place one joint each, on either of two sides, for these inputs.

    A rod that places two hinges with another one, for the motors, keeps its crank's drawn side.
    """
    paired = {rod.names[0] for rods, _ in _LinkTree(lines).order() if len(rods) == 2
              for rod in rods}
    return [rods[0].names[0] for rods, links in _LinkTree(lines, inputs).order()
            if len(rods) == 1 and links and rods[0].names[0] not in paired]


# Rods, and the hinges or slide that they place together.
Group = tuple[tuple[Line, ...], tuple[str, ...]]


class _LinkTree:
    """The tree of links, and the order in which rods place the joints that are not inputs."""

    def __init__(self, lines: Sequence[Line], inputs: Collection[str] = ()):
        self.lines = {line.names[0]: line for line in lines}
        self.inputs = tuple(inputs) or tuple(
            name for name, line in self.lines.items() if line.word in INPUTS)
        self.parents = {name: line.depends_on[0] for name, line in self.lines.items()
                        if line.word not in _RODS}

    def chain(self, link: str) -> list[str]:
        """Return a link and the links that carry it, down to the ground."""
        chain = [link]
        while chain[-1] != GROUND:
            chain.append(self.parents[chain[-1]])
        return chain

    def between(self, first: str, second: str) -> list[str]:
        """Return the links whose joints are between two links."""
        start, end = self.chain(first), self.chain(second)
        return [link for link in start if link not in end] + [
            link for link in end if link not in start]

    def order(self) -> list[Group]:
        """Return the groups in the order of solution; raise ValueError if one has no solution."""
        unknown = {name for name, line in self.lines.items()
                   if line.word in _JOINTS and name not in self.inputs}
        unsolved = [line for line in self.lines.values() if line.word in _RODS]
        groups: list[Group] = []
        while unsolved:
            open_ = [(line, tuple(x for x in self.between(*line.depends_on) if x in unknown))
                     for line in unsolved]
            rods, links = self._next(open_)
            groups.append((rods, links))
            unknown -= {*links}
            unsolved = [line for line in unsolved if line not in rods]
        for name in unknown:
            raise self.lines[name].error(f'no rod places {name}')
        return groups

    def _next(self, unsolved: list[tuple[Line, tuple[str, ...]]]) -> Group:
        """Return the next group of rods, each given with the unplaced joints between its ends."""
        free = [line for line, _ in unsolved
                if line.word == 'cylinder' and line.names[0] not in self.inputs]
        for line, links in unsolved:
            if not links and line not in free:
                raise line.error('all joints between its ends are placed already: one rod too '
                                 'many, or one hinge too few')
            if len(links) == (line not in free):
                return (line,), links
        for (first, links), (second, between) in combinations(unsolved, 2):
            if links == between and len(links) == 2 and not {first, second} & set(free) \
                    and self._in_a_row(links):
                return (first, second), links[::-1]
        line, links = min(unsolved, key=lambda rod: len(rod[1]))
        others = [other.names[0] for other, also in unsolved
                  if other is not line and set(also) & set(links)]
        raise line.error(
            f'{join_names(links)} between its ends are unplaced'
            f'{f", as for {join_names(others)}" if others else ""}: one rod places one hinge or '
            'slide, and two rods place the same two hinges in a row')

    def _in_a_row(self, links: tuple[str, ...]) -> bool:
        second, first = links
        return self.parents[second] == first and all(
            self.lines[link].word in ('hinge', 'motor') for link in links)


class _Joint:
    """A link on its joint, which is solved once it has a turn or a shift."""

    def __init__(self, line: Line, numbers: list[Real]):
        self.line, (self.parent,) = line, line.depends_on
        self.turn: Turn | None = None
        self.shift: Real | None = None
        self.limits = numbers[6:]
        if numbers:
            self.hinge = Hinge(Vector(*numbers[:3]), Vector(*numbers[3:6]))

    def moved(self, point: Vector, back: bool = False) -> Vector:
        """Return a point of the link in its parent's coordinates, or the reverse if `back`."""
        if self.turn:
            return self.hinge.turned(point, self.turn.back() if back else self.turn)
        if self.shift is not None:
            return point.plus(self.hinge.axis.times(-self.shift if back else self.shift))
        return point

    def gate(self, limits: Iterable[Limit]) -> None:
        """Make its value NaN beyond limits."""
        if self.turn:
            self.turn = Turn(*(valid_within(x, limits) for x in self.turn))
        elif self.shift is not None:
            self.shift = valid_within(self.shift, limits)


class _End(NamedTuple):
    link: str
    point: Vector


class _Drawing:
    """Links and rods as expressions, placed in the order of solution."""

    def __init__(self, builder: Builder, lines: list[Line], symbols: Mapping[str, Real],
                 signs: Mapping[str, int], inputs: Collection[str]):
        self._builder, self._signs = builder, signs
        self._tree = _LinkTree(lines, inputs)
        self._numbers = {line.names[0]: [formula(arg.text).expression(symbols) for arg in
                                         line.arguments if arg.kind != 'LINK'] for line in lines}
        self._joints = {name: _Joint(self._tree.lines[name], self._numbers[name])
                        for name in self._tree.parents}
        self._lengths: dict[str, Real] = {}
        self._magnitude = sum((abs(part) for name, numbers in self._numbers.items() for part in
                               numbers[:3 if name in self._joints else 6]), real(0.0))

    def draw(self) -> None:
        """Fill the builder."""
        for joint in self._joints.values():
            self._check_joint(joint)
        for name, line in self._tree.lines.items():
            if line.word == 'rod':
                self._lengths[name] = [*self._numbers[name][6:], self._distance(line)][0]
        for name in self._tree.inputs:
            self._drive(name)
        for rods, links in self._tree.order():
            if len(links) == 2:
                self._place_hinges(rods, *(self._joints[link] for link in links))
            elif links:
                self._place_joint(rods[0], self._joints[links[0]])
            else:
                (name,) = rods[0].names
                self._lengths[name] = self._within(name, self._distance(rods[0]))
        for name, line in self._tree.lines.items():
            (self._add_rod if line.word in _RODS else self._add_joint)(name, line)

    def _check_joint(self, joint: _Joint) -> None:
        if joint.line.word == 'fixed':
            return
        length = joint.hinge.direction.length()
        if length.value is None or length.value <= 0.0:
            self._builder.require(length, 'its axis has no direction', joint.line)
        for low, high in [joint.limits] if joint.limits else []:
            self._builder.require(
                high - low, 'the first end of within must be less than the second', joint.line)
            for end in (low, high) if joint.line.word == 'hinge' else ():
                self._builder.require(math.pi + EDGE - abs(end),
                                      'within must be inside -180deg and 180deg', joint.line)

    def _drive(self, name: str) -> None:
        """Make an angle or a length an input."""
        self._builder.drawn = self._tree.lines[name]
        joint, ends = self._joints.get(name), self._numbers[name][6:]
        is_angle, farthest = joint and joint.line.word != 'slide', 2.0 * self._magnitude
        value = self._within(name, self._builder.drive(Input(name, ANGLE) if is_angle else Input(
            name, LENGTH, *(ends or (-farthest if joint else real(0.0), farthest))), None))
        if joint and is_angle:
            joint.turn = Turn.by(value)
        elif joint:
            joint.shift = value
        else:
            self._lengths[name] = value

    def _ends(self, line: Line) -> tuple[_End, _End]:
        first, second = line.depends_on
        numbers = self._numbers[line.names[0]]
        return _End(first, Vector(*numbers[:3])), _End(second, Vector(*numbers[3:6]))

    def _distance(self, line: Line) -> Real:
        """Return the length between a rod's ends; joints that are not placed are as drawn."""
        first, second = self._ends(line)
        return self._on_link(second, first.link).minus(first.point).length()

    def _on_link(self, end: _End, link: str) -> Vector:
        """Return a point of one link in the coordinates of another."""
        up, down = self._tree.chain(end.link), self._tree.chain(link)
        point = end.point
        for name in up:
            if name not in down:
                point = self._joints[name].moved(point)
        for name in reversed(down):
            if name not in up:
                point = self._joints[name].moved(point, back=True)
        return point

    def _pivot(self, end: _End, link: str) -> Pivot:
        """Return a point of one link in the coordinates of another, on a circle if possible."""
        moving = self._moving(end.link, link)
        joint = self._joints[moving[0]] if len(moving) == 1 else None
        if joint is None or joint.turn is None:
            return Pivot(Circle(self._on_link(end, link), ZERO, ZERO))
        carries = moving[0] in self._tree.chain(end.link)
        return Pivot(joint.hinge.circle(end.point), joint.turn if carries else joint.turn.back())

    def _moving(self, link: str, other: str) -> list[str]:
        return [name for name in self._tree.between(link, other)
                if self._joints[name].line.word != 'fixed']

    def _beyond(self, line: Line, link: str) -> tuple[_End, _End]:
        """Return the end of a rod that a link carries, and the other."""
        first, second = self._ends(line)
        return (first, second) if link in self._tree.chain(first.link) else (second, first)

    def _place_joint(self, line: Line, joint: _Joint) -> None:
        """Turn or slide a joint so that a rod fits."""
        (link,), (name,) = joint.line.names, line.names
        end, pivot = self._beyond(line, link)
        length, hinge = self._lengths[name], joint.hinge
        base, point = self._pivot(pivot, joint.parent), self._on_link(end, link)
        magnitude = self._magnitude + (length if not length.varies else real(0.0))
        side = self._side(line, joint, pivot, end)
        if joint.line.word == 'slide':
            joint.shift, *limits = rod_on_slide(
                hinge.axis, base.place, point, length, side, magnitude)
        else:
            joint.turn, *limits, self._builder.transmissions[name] = rod_on_hinge(
                hinge, base, point, length, side, magnitude)
        self._builder.limits += limits
        joint.gate(self._add_limits(link, joint.turn.angle if joint.turn else joint.shift))

    def _side(self, line: Line, joint: _Joint, pivot: _End, end: _End) -> Real:
        """Return the side on which a rod is drawn, seen from a joint, or its other side."""
        side, sided = (drawn_ahead if joint.line.word == 'slide' else drawn_side)(
            joint.hinge, pivot.point, end.point)
        self._builder.require(
            sided - SINGULAR, f'as drawn it is at a dead point of {joint.line.names[0]}, on '
            'neither side; draw the linkage in another pose', line)
        return side * self._signs.get(line.names[0], 1)

    def _add_limits(self, name: str, value: Any) -> list[Limit]:
        """Add the limits of a joint or a cylinder to the linkage, and return them."""
        word, ends = self._tree.lines[name].word, self._numbers[name][6:]
        slack = real(EDGE) if word == 'hinge' else TOLERANCE * self._magnitude
        margins = [value - ends[0], ends[1] - value] if ends else [value] * (word == 'cylinder')
        limits = [Limit(margin, slack) for margin in margins]
        self._builder.limits += limits
        self._builder.ways += limits
        return limits

    def _within(self, name: str, value: Real) -> Real:
        """Return the value of a joint or a cylinder, NaN beyond its limits."""
        return valid_within(value, self._add_limits(name, value))

    def _place_hinges(self, lines: tuple[Line, ...], first: _Joint, second: _Joint) -> None:
        """Turn two hinges in a row so that two rods fit."""
        frame, link = Frame.of(first.hinge, second.hinge), second.line.names[0]
        self._builder.require(first.hinge.leaning(second.hinge) - _LEANING,
                              f'its axis is nearly parallel to that of {first.line.names[0]}',
                              second.line)
        rods, inputs = [], []
        for line in lines:
            end, base = self._beyond(line, link)
            pivot, length = self._pivot(base, first.parent), self._lengths[line.names[0]]
            if moving := self._moving(end.link, link):
                raise line.error(f'{join_names(moving)} moves between {link} and its end; where '
                                 f'two rods share two hinges, their ends must be fixed to {link}')
            if any(part.varies for part in pivot.path.centre) or pivot.turn and length.varies:
                what = 'be fixed to' if length.varies else 'turn about one axis on'
                raise line.error(f'its end on {base.link} must {what} {first.parent}, which '
                                 'carries the two hinges that it shares with another rod')
            inputs.append(self._moving(base.link, first.parent)[0] if pivot.turn
                          else line.names[0])
            side = self._side(line, self._joints[inputs[-1]], end, base) \
                if pivot.turn else real(0.0)
            rods.append(Rod(pivot._replace(path=frame.transformed(pivot.path)),
                            frame.transformed(second.hinge.circle(end.point)), length, side))
        self._builder.windows.append(TwoRodLink(
            (first.line, second.line), tuple(inputs),
            tuple(tuple(joint.limits) or None for joint in (first, second)), tuple(WindowRod(
                rod.pivot.path, rod.end, None if rod.length.varies else rod.length, rod.side)
                for rod in rods)))
        first.turn, second.turn, limit = two_rods(rods, [
            0.5 * sum(joint.limits, real(0.0)) for joint in (first, second)])
        drawn = [rod.drawn(first.turn, second.turn, self._magnitude)
                 for rod in rods if rod.pivot.turn]
        self._builder.limits += [limit, *drawn]
        edges = [limit, *drawn, *self._add_limits(first.line.names[0], first.turn.angle),
                 *self._add_limits(link, second.turn.angle)]
        for joint in (first, second):
            joint.gate(edges)

    def _add_joint(self, name: str, line: Line) -> None:
        """Add the outputs of a joint: its angle or slide, and its origin."""
        joint = self._joints[name]
        if line.word != 'fixed':
            self._point(f'{name}_origin', _End(name, joint.hinge.origin))
            self._add_value(name, 'revolute' if joint.turn else 'prismatic', f'{name}_origin',
                            joint.turn.angle if joint.turn else joint.shift)

    def _add_rod(self, name: str, line: Line) -> None:
        """Add the outputs of a rod: both ends, lines between them, and its length."""
        builder, ends = self._builder, self._ends(line)
        places = [f'{name}_{end.link}' for end in ends]
        for place, end in zip(places, ends):
            self._point(place, end)
            if end.link != GROUND and self._joints[end.link].line.word != 'fixed':
                length = end.point.minus(self._joints[end.link].hinge.origin).length()
                builder.bars.append(Bar(f'{end.link}_origin', place, length))
        if line.word == 'rod':
            builder.bars.append(Bar(places[0], places[1], self._lengths[name]))
            self._builder.require(self._lengths[name], 'it must be longer than zero', line)
        else:
            self._add_value(name, 'prismatic', places[0], self._lengths[name])
            builder.cylinders.append((places[0], places[1]))

    def _add_value(self, name: str, kind: str, place: str, value: Any) -> None:
        parent = self._tree.lines[name].depends_on[0]
        self._builder.links.append(Link(name, parent, place, kind, real(0.0), place))
        self._builder.joint_values[name] = value

    def _point(self, name: str, end: _End) -> None:
        if name in self._builder.points:
            raise self._tree.lines[end.link].error(f'the name {name} is used by another point')
        self._builder.points[name] = Point(self._on_link(end, GROUND), end.link, self._magnitude)
