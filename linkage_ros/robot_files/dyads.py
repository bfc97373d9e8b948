# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Joint lines of a planar loop of a robot: its inputs, then its dyads."""

from __future__ import annotations

from cmath import phase
import math
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from .loops import Loop, ROUNDING
from .robot import Joint, Robot, SLIDE
from ..linkage.dyads import bar_name, Dyads, Hinge, Motor, Pin, short, Slide


class Source(NamedTuple):
    """An input, ratio * position + offset of its source; its ends, if its joint has limits."""

    name: str
    source: str
    ratio: float
    offset: float
    value: float
    ends: Optional[Tuple[float, ...]]


class Drawing(Dyads):
    """
    The lines that place the bodies of a loop; lengths are those that each body has on its own.

    Attributes
    ----------
    drives : list of Source
    driven : list of Joint
        The joints that drive the lines.
    measured : Joint, optional
        The motor between two moving links that tells where what drives is.

    """

    def __init__(self, robot: Robot, loop: Loop, drives: Sequence[str]):
        self.loop, self._robot = loop, robot
        self.drives: List[Source] = []
        self.measured: Optional[Joint] = None
        self.driven = [joint for joint in loop.joints if joint.name in drives]
        pins: List[Dict[str, complex]] = []
        for joint in loop.joints:
            pin = dict(zip(joint.bodies, joint.places))
            same = [other for other in pins if any(
                abs(other[body] - pin[body]) < loop.near for body in other.keys() & pin.keys())]
            if joint.kind != SLIDE:
                pins = [other for other in pins if other not in same]
                pins.append({body: place for each in (*same, pin)
                             for body, place in each.items()})
        moved: List[Motor] = [
            Slide(joint.bodies, (joint.places[1] - joint.axis * (joint.position or 0.0),
                                 joint.places[1]), (joint.axis, joint.axis), joint)
            if joint.kind == SLIDE else
            Hinge(joint.bodies, joint.places, joint.axis, -joint.axis * (joint.position or 0.0),
                  joint) for joint in loop.joints]
        super().__init__(
            loop.ground, [body for joint in loop.joints for body in joint.bodies], pins,
            [each for each in moved if isinstance(each, Slide) and each.joint not in self.driven],
            [each for each in moved if each.joint in self.driven], loop.size, loop.near)
        self.take_apart()

    @property
    def moved_by(self) -> List[Joint]:
        """Return the joints that move it: where its motor is between moving links, that."""
        return [self.measured] if self.measured else self.driven

    @property
    def allowed(self) -> float:
        """How far a pose may be from the file's, of the size: rounding, or some of its gap."""
        return max(ROUNDING, 30.0 * self.loop.gap / self.loop.size + self.loop.lean)

    @property
    def places(self) -> Iterator[Pin]:
        """Where each joint of the lines is in the pose of the file, on each body that has it."""
        return (pin for body in self.parts for pin in self.on[body].items())

    def measured_by(self, joint: Joint) -> Optional[Tuple[str, float, float]]:
        """Return the link whose angle is a joint's position, with sign and position, if any."""
        if not self.parts.keys() >= {*joint.bodies}:
            return None
        parent, child = joint.bodies
        if joint.kind == SLIDE:
            block = child if self.parts[child].slide is joint else parent
            part = self.parts[block]
            sign = math.copysign(1.0, (part.along / joint.axis).real)
            way = (self.on[block][part.joint] - part.start) / part.along
            return (part.link, sign if block == child else -sign, way.real) \
                if part.slide is joint else None
        pin = self.joint_at(child, joint.places[1]) or ''
        base, body = (parent, child) if self.home[pin] == parent else (child, parent)
        if self.home[pin] != base:
            return None
        link, hangs, along, slide, _ = self.parts[body]
        if hangs != pin or slide:
            # A triangle on its link shows how that turns against the one that the pin is on.
            start, (other, end) = self.on[body][pin], self.other(body, pin)
            along, side = (end - start) * complex(0.5, 0.75 ** 0.5), abs(end - start)
            tip = self.name(start + along, body, f'dyad {pin} {other} {self.length_text(side)} '
                            f'{self.length_text(side)} left')
            link = bar_name(pin, tip)
        return link, joint.axis if body == child else -joint.axis, phase(
            along / self.parts[base].along)

    def drive(self, word: str, joint: Joint, ratio: float, offset: float) -> Tuple[str, str]:
        """Note an input, as `Dyads` asks for; those of one source are geared to the first."""
        source, factor, start = self._robot.source(joint.name)
        ends = joint.limits and tuple(sorted(ratio * limit + offset for limit in joint.limits))
        ratio, offset, number = ratio * factor, offset + ratio * start, self.number(word)
        for other in self.drives:
            if other.source == source and (word == 'crank') == (other.name[:5] == 'crank'):
                gear = ratio / other.ratio
                offset -= gear * other.offset
                angle_or_length = self.length_text(offset) if word != 'crank' else short(
                    math.remainder(offset, math.tau))
                return number, f' geared {other.name} {gear!r} {angle_or_length}'
        self.drives.append(Source(word + number, source, ratio, offset, ratio * (
            self._robot.positions.get(source) or 0.0) + offset, ends))
        return number, ''

    def position(self, joint: Joint) -> float:
        """Return the position of a joint's motor in the file."""
        return joint.position or 0.0

    def special_line(self, place: complex, other: complex, one: Pin, two: Pin) -> Optional[str]:
        """Return what a line says of bars like those from a corner: they pass their flat poses."""
        (first, start), (second, end) = one, two
        for corner, at in self.places:
            links = [{body for body in self.parts
                      if {corner, name} <= self.on[body].keys()} for name in (first, second)]
            if corner in (first, second) or not all(links) or links[0] == links[1]:
                continue
            opposite, along = start + end - at, end - start
            kite, crossed = (start + along * ((each - start) / along).conjugate()
                             for each in (at, opposite))
            for word, seen in (('parallelogram', opposite), ('mirror', kite),
                               ('antiparallelogram', crossed)):
                if max(abs(seen - place), abs(seen - other)) < self.loop.near < abs(at - place):
                    return f'{word} {corner} {first} {second}'
        return None
