# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Joint lines of a planar loop of a robot: its inputs, then its dyads."""

from __future__ import annotations

from cmath import phase
import math
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from .loops import Loop
from .robot import Joint, Robot, SLIDE
from .. import mechanisms
from ..linkage.dyads import bar_name, Dyads, Hinge, Motor, Pin, ROUNDING, short, Slide
from ..linkage.mechanism import Mechanism


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
            Slide(joint.bodies, (joint.places[1] - joint.axis * joint.start,
                                 joint.places[1]), (joint.axis, joint.axis), joint)
            if joint.kind == SLIDE else
            Hinge(joint.bodies, joint.places, joint.axis, -joint.axis * joint.start,
                  joint) for joint in loop.joints]
        super().__init__(
            loop.ground, [body for joint in loop.joints for body in joint.bodies], pins,
            [each for each in moved if isinstance(each, Slide) and each.joint not in self.driven],
            [each for each in moved if each.joint in self.driven], loop.size, loop.near)
        self.take_apart()

    @property
    def moved_by(self) -> List[Joint]:
        """Return the motors: the one between two moving links, if there is one."""
        return [self.measured] if self.measured else self.driven

    @property
    def allowed(self) -> float:
        """Allowed distance of a pose from the file's, of the size."""
        return max(ROUNDING, 30.0 * self.loop.gap / self.loop.size + self.loop.lean)

    @property
    def places(self) -> Iterator[Pin]:
        """The places of the lines' joints in the pose of the file, on each of their bodies."""
        return (pin for body in self.parts for pin in self.on[body].items())

    @property
    def linkage(self) -> Mechanism:
        """The linkage of the lines."""
        return mechanisms.create('custom', joints=self.lines)

    def apart(self, linkage: Mechanism, *names: str) -> float:
        """Return the largest distance of joints from the file's pose, of the linkage's size."""
        values = [drive.value for drive in self.drives]
        places = linkage.solve(values if len(values) > 1 else values[0])
        return float(np.max([abs(complex(*places[name]) - place) for name, place in self.places
                             if name in (names or places)])) / self.loop.size

    @property
    def ends(self) -> Dict[str, Tuple[float, float]]:
        """The range of each source in a check [rad or m]."""
        if joint := self.measured:
            start = joint.start
            return {joint.name: joint.limits or (start - 0.5 * math.pi, start + 0.5 * math.pi)}
        found: Dict[str, Tuple[float, float]] = {}
        for drive in self.drives:
            around = math.pi if drive.name[:5] == 'crank' else 0.5 * self.loop.size
            low, high = drive.value - around, drive.value + around
            if drive.ends:
                low, high = max(drive.ends[0], low - around), min(drive.ends[1], high + around)
                low, high = (low, high) if low < high else drive.ends
            low, high = sorted((end - drive.offset) / drive.ratio for end in (low, high))
            found[drive.source] = low, high
        return found

    @property
    def holders(self) -> List[Joint]:
        """The joints of bodies that are left."""
        return [joint for joint in self.loop.joints if {*joint.bodies} & {*self.left}]

    @property
    def freedom(self) -> int:
        """The degrees of freedom of the bodies that are left."""
        return 3 * len(self.left) - 2 * len(self.holders) - sum(
            joint in self.driven for joint in self.holders)

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
        pin = self.known(child, joint.places[1]) or ''
        base, body = (parent, child) if self.home[pin] == parent else (child, parent)
        if self.home[pin] != base:
            return None
        link, hangs, along, slide, _ = self.parts[body]
        if hangs != pin or slide:
            # The angle of a triangle on this link is the angle between the two links.
            try:
                start, (other, end) = self.on[body][pin], self.other(body, pin)
            except ValueError:
                # No word places a second joint on this block or barrel.
                return None
            along, side = (end - start) * complex(0.5, 0.75 ** 0.5), self.said(abs(end - start))
            tip = self.name(start + along, body, f'dyad {pin} {other} {side} {side} left')
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
                said = self.said(offset) if word != 'crank' else short(
                    math.remainder(offset, math.tau))
                return number, f' geared {other.name} {gear!r} {said}'
        self.drives.append(Source(word + number, source, ratio, offset, ratio * (
            self._robot.positions.get(source) or 0.0) + offset, ends))
        return number, ''

    def position(self, joint: Joint) -> float:
        """Return the position of a joint's motor in the file."""
        return joint.start

    def alike(self, place: complex, other: complex, one: Pin, two: Pin) -> Optional[str]:
        """Return the start of a line for bars that mirror others, and so pass dead points."""
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
