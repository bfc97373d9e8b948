# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Joint lines of a planar linkage: what drives it, then dyad after dyad."""

from __future__ import annotations

from cmath import phase
from itertools import combinations
import math
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from .loops import Loop, ROUNDING
from .readers import Joint, Robot, SLIDE

Pin = Tuple[str, complex]


class Drive(NamedTuple):
    """An input, ratio * position + offset of its source; its ends, if its joint has limits."""

    name: str
    source: str
    ratio: float
    offset: float
    value: float
    ends: Optional[Tuple[float, ...]]


class Part(NamedTuple):
    """
    A body that is placed: its link, and the joint that this hangs on.

    Angles on it are counted from `along`, as it is in the file's pose; a block is on a slide,
    which is counted from `start`.
    """

    link: str
    joint: str
    along: complex
    slide: Optional[Joint] = None
    start: complex = 0.0j


def short(value: float, near: float = 2e-16) -> str:
    """Return a number, and one of few digits where that is as near to it as rounding."""
    if abs(value) <= 5.0 * near:
        return '0'
    return next((text for text in (f'{value:.{digits}g}' for digits in range(1, 13))
                 if abs(float(text) - value) <= near), repr(float(value)))


class Drawing:
    """
    The lines that place the bodies of a loop; lengths are those that each body has on its own.

    Attributes
    ----------
    lines : list of str
    drives : list of Drive
    driven : list of Joint
        The joints that motors move.
    on : dict
        Where joints of the lines are on each body, all as in the pose of the file.
    parts : dict
        The bodies that are placed.

    """

    def __init__(self, robot: Robot, loop: Loop, drives: Sequence[str]):
        self.loop, self._robot = loop, robot
        self.lines: List[str] = []
        self.drives: List[Drive] = []
        self.driven = [joint for joint in loop.joints if joint.name in drives]
        self.on: Dict[str, Dict[str, complex]] = {
            body: {} for joint in loop.joints for body in joint.bodies}
        self.parts: Dict[str, Part] = {}
        # The body that each joint of the lines was placed with: others turn against that.
        self._home: Dict[str, str] = {}
        self._pins: List[Dict[str, complex]] = []
        for joint in loop.joints:
            pin = dict(zip(joint.bodies, joint.places))
            same = [other for other in self._pins if any(
                abs(other[body] - pin[body]) < loop.near for body in other.keys() & pin.keys())]
            if joint.kind != SLIDE:
                self._pins = [other for other in self._pins if other not in same]
                self._pins.append({body: place for each in (*same, pin)
                                   for body, place in each.items()})
        self._place(loop.ground, Part('', '', 1.0 + 0.0j))
        while self._step():
            pass

    def _step(self) -> bool:
        """Place what a motor, a dyad or a slide places next; return whether there is any."""
        ways = [(joint, *way) for joint in self.loop.joints for way in (
            (*joint.bodies, 1.0), (*joint.bodies[::-1], -1.0))]
        return any(self._drive(*way) for way in ways) or any(map(self._dyad, self.left)) or any(
            rule(*way) for way in ways for rule in (self._slider, self._slot, self._cylinder))

    @property
    def left(self) -> List[str]:
        """The bodies that are not placed."""
        return [body for body in self.on if body not in self.parts]

    @property
    def allowed(self) -> float:
        """How far a pose may be from the file's, of the size: rounding, or some of its gap."""
        return max(ROUNDING, 30.0 * self.loop.gap / self.loop.size)

    @property
    def places(self) -> Iterator[Pin]:
        """Where each joint of the lines is in the pose of the file, on each body that has it."""
        return (pin for body in self.parts for pin in self.on[body].items())

    def seen(self, joint: Joint) -> Optional[Tuple[str, float, float]]:
        """Return the link that tells a joint's position, its sign, and where it is, if any."""
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
        pin = self._known(child, joint.places[1]) or ''
        base, body = (parent, child) if self._home[pin] == parent else (child, parent)
        if self._home[pin] != base:
            return None
        link, hangs, along, slide, _ = self.parts[body]
        if hangs != pin or slide:
            # A triangle on its link shows how that turns against the one that the pin is on.
            start, (other, end) = self.on[body][pin], self._other(body, pin)
            along, side = (end - start) * complex(0.5, 0.75 ** 0.5), self._say(abs(end - start))
            tip = self._name(start + along, body, f'dyad {pin} {other} {side} {side} left')
            link = _bar(pin, tip)
        return link, joint.axis if body == child else -joint.axis, phase(
            along / self.parts[base].along)

    def _say(self, value: float) -> str:
        return short(value, 1e-15 * self.loop.size)

    def _number(self, word: str) -> str:
        """Return what the next link or input of a word is called."""
        count = sum(line.split()[1] == word for line in self.lines)
        return f'{count + 1 if count else ""}'

    def _name(self, place: complex, body: str, line: str) -> str:
        """Write the line that places a joint, and return its name."""
        count = len(self.lines)
        name = 'ABCDEFGHIJKLMNPQRSTUVWXYZ'[count % 25] + str(count // 25 or '')
        self._home[name] = body
        self.on[body][name] = place
        for pin in self._pins:
            if body in pin and abs(pin[body] - place) < self.loop.near:
                self.on.update({each: {**self.on[each], name: at} for each, at in pin.items()})
        self.lines.append(f'{name} {line}')
        return name

    def _known(self, body: str, place: complex) -> Optional[str]:
        return next((name for name, at in self.on[body].items()
                     if abs(at - place) < self.loop.near), None)

    def _fixed(self, body: str, place: complex) -> Pin:
        """Return the joint at a place on a body that is placed, a new one if there is none."""
        if name := self._known(body, place):
            return name, self.on[body][name]
        say, on, part = self._say, self.on[body], self.parts[body]
        # On the bar from which the triangle is the least flat.
        bars = [(abs(((place - start) / (end - start)).imag), (first, start), (second, end))
                for (first, start), (second, end) in combinations(on.items(), 2)
                if abs(end - start) > self.loop.near]
        if body == self.loop.ground:
            line = f'ground {say(place.real)} {say(place.imag)}'
        elif part.slide:
            seen = (place - on[part.joint]) / part.along
            line = f'block {part.joint} {say(seen.real)} {say(seen.imag)}'
        elif not bars:
            raise ValueError(f'{body} is a barrel with another joint, which no word can place')
        else:
            _, (first, start), (second, end) = max(bars)
            seen = (place - start) / (end - start) * abs(end - start)
            line = f'line {first} {second} {say(seen.real)}' \
                if abs(seen.imag) < self.loop.near else \
                f'rigid {self._bars((first, start), (second, end), place, place)}'
        return self._name(place, body, line), place

    def _bars(self, one: Pin, two: Pin, place: complex, other: complex) -> str:
        """Return what a line says of bars to a place, which has another as the second sees it."""
        (first, start), (second, end) = one, two
        side = 'left' if ((place - start) / (end - start)).imag > 0.0 else 'right'
        return (f'{first} {second} {self._say(abs(place - start))} '
                f'{self._say(abs(other - end))} {side}')

    def _other(self, body: str, name: str) -> Pin:
        """Return another joint of a body that is placed."""
        return next((pin for pin in self.on[body].items() if pin[0] != name), None) or self._fixed(
            body, self.on[body][name] + self.loop.size * self.parts[body].along)

    def _line(self, body: str, place: complex, axis: complex, but: str = ''
              ) -> Tuple[Pin, str, complex]:
        """Return a joint at a place on a body, another on a line through it, and which way."""
        origin, at = self._fixed(body, place)
        name, end = next(((name, end) for name, end in self.on[body].items()
                          if name not in (origin, but)
                          and abs(((end - at) / axis).imag) < ROUNDING * self.loop.size), None) \
            or self._fixed(body, at + self.loop.size * axis)
        return (origin, at), name, (end - at) / abs(end - at)

    def _end(self, body: str) -> Pin:
        return next(iter(self.on[body].items()))

    def _place(self, body: str, part: Part) -> bool:
        """Note a body that is placed, and place what else there is on it."""
        self.parts[body] = part
        for pin in self._pins:
            if body in pin:
                self._fixed(body, pin[body])
        return True

    def _hang(self, body: str, joint: str, tip: str, link: str = '') -> bool:
        """Note a body that turns about a joint."""
        on = self.on[body]
        return self._place(body, Part(link or _bar(joint, tip), joint, on[tip] - on[joint]))

    def _input(self, word: str, joint: Joint, ratio: float, value: float) -> Tuple[str, str]:
        """Note an input; return its number, and what its line says of it if it is geared."""
        source, factor, start = self._robot.source(joint.name)
        offset = value - ratio * (joint.position or 0.0)
        ends = joint.limits and tuple(sorted(ratio * limit + offset for limit in joint.limits))
        ratio, offset, number = ratio * factor, offset + ratio * start, self._number(word)
        for other in self.drives:
            if other.source == source and (word == 'crank') == (other.name[:5] == 'crank'):
                gear = ratio / other.ratio
                offset -= gear * other.offset
                said = self._say(offset) if word != 'crank' else short(
                    math.remainder(offset, math.tau))
                return number, f' geared {other.name} {gear!r} {said}'
        self.drives.append(Drive(word + number, source, ratio, offset, ratio * (
            self._robot.positions.get(source) or 0.0) + offset, ends))
        return number, ''

    def _drive(self, joint: Joint, base: str, body: str, sign: float) -> bool:
        """Place the body that a motor moves on one that is placed."""
        places = [pin[body] for pin in self._pins if body in pin]
        if joint not in self.driven or base not in self.parts or body in self.parts or not places:
            return False
        size, position = self.loop.size, joint.position or 0.0
        if joint.kind == SLIDE:
            (origin, start), towards, along = self._line(
                base, places[0] - joint.axis * sign * position, joint.axis)
            value = ((places[0] - start) / along).real
            number, geared = self._input('carriage', joint, math.copysign(
                1.0, sign * (along / joint.axis).real), value)
            name = self._name(places[0], body, f'carriage {origin} along {towards} '
                              f'{self._say(value - size)} {self._say(value + size)}{geared}')
            return self._place(body, Part(f'carriage{number}', name, along, joint, start))
        (centre, start), zero, along = self._fixed(
            base, joint.places[joint.bodies[1] == base]), '', 1.0 + 0.0j
        if base != self.loop.ground:
            mark, end = self._other(base, centre)
            zero, along = f' zero {mark}', end - start
        rail = next((each.axis for each in self.loop.joints
                     if each.kind == SLIDE and body in each.bodies), 1.0 + 0.0j)
        centred = joint.places[joint.bodies[1] == body]
        place = next((place for place in places if abs(place - centred) > self.loop.near),
                     centred + size * rail)
        number, geared = self._input('crank', joint, sign * joint.axis, phase(
            (place - centred) / along))
        name = self._name(place, body, f'crank {centre} {self._say(abs(place - centred))}{zero}'
                          f'{geared}')
        return self._hang(body, centre, name, f'crank{number}')

    def _rods(self, body: str) -> Iterator[Tuple[str, Dict[str, complex]]]:
        """Yield what hangs on a joint and shares a pin with a body, and the pin, not placed."""
        return ((rod, pin) for pin in self._pins if body in pin for rod in pin
                if rod != body and rod not in self.parts and self.on[rod]
                and not self._known(rod, pin[rod]))

    def _dyad(self, first: str) -> bool:
        for second, pin in self._rods(first) if self.on[first] else ():
            one, two = self._end(first), self._end(second)
            if one[0] == two[0] or any({first, second} == {*each.bodies} for each in self.driven):
                continue
            if abs(one[1] - two[1]) < self.loop.near:
                raise ValueError(f'{first} and {second} are folded on each other')
            line = self._alike(pin[first], pin[second], one, two) or \
                f'dyad {self._bars(one, two, pin[first], pin[second])}'
            name = self._name(pin[first], first, line)
            return self._hang(first, one[0], name) and self._hang(second, two[0], name)
        return False

    def _alike(self, place: complex, other: complex, one: Pin, two: Pin) -> Optional[str]:
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

    def _slider(self, slide: Joint, base: str, block: str, sign: float) -> bool:
        passive = slide.kind == SLIDE and slide not in self.driven
        if not passive or base not in self.parts or block in self.parts:
            return False
        for rod, pin in self._rods(block):
            (joint, at), length = self._end(rod), abs(pin[rod] - self._end(rod)[1])
            (origin, start), towards, along = self._line(
                base, pin[block] - slide.axis * sign * (slide.position or 0.0), slide.axis, joint)
            half = 'out' if ((pin[rod] - at) / along).real > 0.0 else 'in'
            number = self._number('slider')
            name = self._name(pin[rod], rod, f'slider {joint} {self._say(length)} {origin} '
                              f'along {towards} {half}')
            return self._hang(rod, joint, name) and self._place(
                block, Part(f'block{number}', name, along, slide, start))
        return False

    def _slot(self, slide: Joint, lever: str, block: str, _: float) -> bool:
        if slide.kind != SLIDE or slide in self.driven or {lever, block} & self.parts.keys() \
                or not self.on[lever] or not self.on[block]:
            return False
        (pivot, start), (pin, end) = self._end(lever), self._end(block)
        ahead, number = ((end - start) / slide.axis).real, self._number('slot')
        along = math.copysign(1.0, ahead) * slide.axis
        name = self._name(start + abs(ahead) * along, lever, f'slot {pivot} {pin} '
                          f'{self._say(((end - start) / along).imag)} out {self._say(abs(ahead))}')
        return self._hang(lever, pivot, name, f'lever{number}') and self._place(
            block, Part(f'slide{number}', pin, along, slide, start))

    def _cylinder(self, slide: Joint, barrel: str, rod: str, sign: float) -> bool:
        if slide not in self.driven or slide.kind != SLIDE or not self.on[barrel] \
                or {barrel, rod} & self.parts.keys():
            return False
        for bar, pin in self._rods(rod):
            one, two = self._end(barrel), self._end(bar)
            seen = (pin[rod] - one[1]) / slide.axis
            if bar != barrel and one[0] != two[0] and abs(seen.imag) < self.loop.near:
                way = math.copysign(1.0, seen.real)
                number, geared = self._input('cylinder', slide, sign * way, abs(seen))
                base, pivot, _, more = self._bars(one, two, pin[rod], pin[bar]).split(' ', 3)
                name = self._name(pin[bar], bar, f'cylinder {base} {pivot} {more}{geared}')
                return self._place(barrel, Part(f'barrel{number}', base, way * slide.axis)) \
                    and self._place(rod, Part(
                        f'cylinder{number}', name, way * slide.axis, slide, one[1])) \
                    and self._hang(bar, pivot, name)
        return False


def _bar(joint: str, tip: str) -> str:
    """Return what the link of a bar is called."""
    return ('' if len(joint + tip) == 2 else '_').join((joint, tip))
