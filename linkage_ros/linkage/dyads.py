# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Decomposition of a planar linkage of bodies, hinges and slides into dyads.

One joint line places two bodies that share a joint and are each joined to a placed body: RRR by
`dyad`, RRP by `slider`, RPR by `slot`, RPP by `yoke` if its slides are perpendicular. PRP has no
word. The bodies that stay unplaced are an Assur group of class III or higher, or depend on one.

Source: Assur's groups as in Norton, "Design of Machinery", sec. 2.13, and Galletti, "A note on
modular approaches to planar linkage kinematic analysis", Mechanism and Machine Theory 21 (1986).
"""

from __future__ import annotations

from cmath import phase
from functools import partial
from itertools import chain, combinations
import math
from typing import (
    Any,
    Callable,
    Iterator,
    NamedTuple,
    Sequence,
)

from .geometry.builder import bar_name
from .tolerances import ROUNDING

Pin = tuple[str, complex]


class Slide(NamedTuple):
    """
    Two bodies that slide on each other, with a point and the direction of the line on each.

    The slide is zero where the two points coincide. `joint` is the caller's identifier.
    """

    bodies: tuple[str, str]
    origins: tuple[complex, complex]
    axes: tuple[complex, complex]
    joint: Any = None


class Hinge(NamedTuple):
    """
    Two bodies that a motor joins, with its place on each.

    The angle of the second body relative to the first is sign * position + zero [rad].
    """

    bodies: tuple[str, str]
    places: tuple[complex, complex]
    sign: float
    zero: float
    joint: Any = None


Motor = Hinge | Slide


class Part(NamedTuple):
    """
    A placed body: its link, and the joint that carries the link.

    Angles on it are measured from the direction `along`. A block has a `slide`, whose position is
    measured from the point `start`.
    """

    link: str
    joint: str
    along: complex
    slide: Any = None
    start: complex = 0.0j


def short(value: float, near: float = 2e-16) -> str:
    """Return a number as text, with the fewest digits (up to 12) that are within `near` of it."""
    if abs(value) <= 5.0 * near:
        return '0'
    return next((text for text in (f'{value:.{digits}g}' for digits in range(1, 13))
                 if abs(float(text) - value) <= near), repr(float(value)))


class Dyads:
    """
    Joint lines that place bodies, one dyad after another.

    Parameters
    ----------
    ground : str
        The body that is placed first.
    bodies : sequence of str
        All bodies.
    pins : sequence of dict
        Hinges: the place of each on every body that it joins, in that body's coordinates.
    slides : sequence of Slide
        Slides without a motor.
    motors : sequence of Hinge or Slide
        Joints whose position is an input.
    size : float
        Approximate size of the linkage [m].
    near : float
        Points nearer to each other than this [m] coincide.

    Attributes
    ----------
    lines : list of str
        Joint lines so far.
    on : dict
        For each body, the joints of the lines on it and their places.
    parts : dict
        The placed bodies.

    """

    def __init__(self, ground: str, bodies: Sequence[str], pins: Sequence[dict[str, complex]],
                 slides: Sequence[Slide], motors: Sequence[Motor], size: float, near: float):
        self.lines: list[str] = []
        self.on: dict[str, dict[str, complex]] = {body: {} for body in bodies}
        self.parts: dict[str, Part] = {}
        self.ground, self.size, self.near, self.farthest = ground, size, near, size
        # The body with which each joint was placed: other bodies turn relative to it.
        self.placed_on: dict[str, str] = {}
        self.pins, self.slides, self.motors = list(pins), list(slides), list(motors)

    def decompose(self) -> None:
        """Place every body that can be placed."""
        self.place(self.ground, Part('', '', 1.0 + 0.0j))
        while any(rule() for rule in self.rules()):
            pass

    def rules(self) -> Iterator[Callable[[], bool]]:
        """Yield the rules that may place bodies next; each returns whether it did."""
        for motor in self.motors:
            rule: Callable = self._crank if isinstance(motor, Hinge) else self._carriage
            yield from (partial(rule, motor, way) for way in (0, 1) if self._carries(motor, way))
        yield from (partial(self._dyad, body) for body in self.left)
        for slide in self.slides:
            for way in (0, 1):
                words = (self._slider, self._yoke) if self._carries(slide, way) else (self._slot,)
                yield from (partial(rule, slide, way) for rule in words)
        yield from (partial(self._cylinder, motor, way) for motor in self.motors
                    if isinstance(motor, Slide) for way in (0, 1))

    def _carries(self, joint: Motor, way: int) -> bool:
        """Return whether the first body of a joint is placed and the other is not."""
        return joint.bodies[way] in self.parts and joint.bodies[1 - way] not in self.parts

    @property
    def left(self) -> list[str]:
        """Return the bodies that are not placed."""
        return [body for body in self.on if body not in self.parts]

    def place_in_pose(self, body: str, place: complex) -> complex:
        """Return a place on a body, in the coordinates of the pose that determines the sides."""
        return place

    def direction_in_pose(self, body: str, along: complex) -> complex:
        """Return a direction on a body, in the coordinates of the pose."""
        return along

    def drive(self, word: str, joint: Any, ratio: float, offset: float) -> tuple[str, str]:
        """
        Record an input whose value is ratio * position + offset of a joint.

        Return its number, and the option `geared` of its line; empty unless it is geared.
        """
        raise NotImplementedError

    def quarters(self, start: float) -> int | None:
        """Return an angle [rad] as 0 to 3 quarter turns; None if the line has the angle itself."""
        return None

    def special_line(self, place: complex, other: complex, *pins: Pin) -> str | None:
        """Return a more specific line than `dyad` for two bars, or None."""
        return None

    def length_text(self, value: float) -> str:
        """Return a length as a line has it."""
        return short(value, 1e-15 * self.size)

    def number(self, *words: str) -> str:
        """Return the number of the next link or input of these words; empty for the first."""
        count = sum(line.split()[1] in words for line in self.lines)
        return f'{count + 1 if count else ""}'

    def new_name(self, place: complex, body: str) -> str:
        """Return the name of a new joint at a place on a body."""
        count = len(self.lines)
        return 'ABCDEFGHIJKLMNPQRSTUVWXYZ'[count % 25] + str(count // 25 or '')

    def name(self, place: complex, body: str, line: str) -> str:
        """Add the line that places a joint, and return the joint's name."""
        name = self.new_name(place, body)
        self.placed_on[name] = body
        self.on[body][name] = place
        for pin in self.pins:
            if body in pin and abs(pin[body] - place) < self.near:
                self.on.update({link: {**self.on[link], name: at} for link, at in pin.items()})
        self.lines.append(f'{name} {line}')
        return name

    def joint_at(self, body: str, place: complex) -> str | None:
        """Return the joint at a place on a body, or None."""
        return next((name for name, at in self.on[body].items()
                     if abs(at - place) < self.near), None)

    def fixed(self, body: str, place: complex) -> Pin:
        """Return the joint at a place on a placed body; add one if there is none."""
        if name := self.joint_at(body, place):
            return name, self.on[body][name]
        text, on, part = self.length_text, self.on[body], self.parts[body]
        # The best bar to place it from is the one with which it makes the least flat triangle.
        bars = [(abs(seen.imag), (first, start), (second, end))
                for (first, start), (second, end) in combinations(on.items(), 2)
                if abs(end - start) > self.near for seen in ((place - start) / (end - start),)]
        if body == self.ground:
            line = f'ground {text(place.real)} {text(place.imag)}'
        elif part.slide and [other.joint for other in self.parts.values() if other.slide].count(
                part.joint) > 1:
            raise ValueError(f'joint {part.joint} carries two blocks; `block` allows one')
        elif part.slide:
            seen = (place - on[part.joint]) / part.along
            line = f'block {part.joint} {text(seen.real)} {text(seen.imag)}'
        elif not bars:
            raise ValueError(f'{body} is a barrel with a second joint, which no word can place')
        else:
            _, (first, start), (second, end) = max(bars)
            seen = (place - start) / (end - start) * abs(end - start)
            side = self._side(start, end, place)
            line = (f'rigid {first} {second} {text(abs(place - start))} {text(abs(place - end))} '
                    f'{side}' if abs(seen.imag) >= self.near else
                    f'line {first} {second} {text(seen.real)}')
        return self.name(place, body, line), place

    def _side(self, first: complex, second: complex, place: complex) -> str:
        return 'left' if ((place - first) / (second - first)).imag > 0.0 else 'right'

    def other(self, body: str, name: str) -> Pin:
        """Return another joint of a placed body; add one if there is none."""
        return next((pin for pin in self.on[body].items() if pin[0] != name), None) or self.fixed(
            body, self.on[body][name] + self.size * self.parts[body].along)

    def line(self, body: str, place: complex, axis: complex, but: str = ''
             ) -> tuple[Pin, str, complex]:
        """Return the joint at a place on a body, one further along an axis, and the direction."""
        origin, at = self.fixed(body, place)
        along = [(name, end) for name, end in self.on[body].items()
                 if abs(((end - at) / axis).imag) < ROUNDING * self.size]
        beyond = (self.fixed(body, at + side * axis * self.size) for side in (1, -1))
        name, end = next(pin for pin in chain(along, beyond) if pin[0] not in (origin, but))
        return (origin, at), name, (end - at) / abs(end - at)

    def end(self, body: str) -> Pin:
        """Return the first joint on a body."""
        return next(iter(self.on[body].items()))

    def place(self, body: str, part: Part) -> bool:
        """Record a placed body, and place its other joints."""
        self.parts[body] = part
        for pin in self.pins:
            if body in pin:
                self.fixed(body, pin[body])
        return True

    def place_on_joint(self, body: str, joint: str, tip: str, link: str = '') -> bool:
        """Record a placed body that turns about a joint."""
        on = self.on[body]
        return self.place(body, Part(link or bar_name(joint, tip), joint, on[tip] - on[joint]))

    def rods(self, body: str) -> Iterator[tuple[str, dict[str, complex]]]:
        """Yield unplaced bodies that have a joint and share an unplaced pin with a body."""
        return ((rod, pin) for pin in self.pins if body in pin for rod in pin
                if rod != body and rod not in self.parts and self.on[rod]
                and not self.joint_at(rod, pin[rod]))

    def _crank(self, hinge: Hinge, way: int) -> bool:
        """Place the body that a motor turns on a placed one."""
        base, body = hinge.bodies[way], hinge.bodies[1 - way]
        (centre, start), zero, along = self.fixed(base, hinge.places[way]), '', 1.0 + 0.0j
        if base != self.ground:
            mark, end = self.other(base, centre)
            zero, along = f' zero {mark}', end - start
        centred = hinge.places[1 - way]
        place = next((pin[body] for pin in self.pins
                      if body in pin and abs(pin[body] - centred) > self.near),
                     centred + self.size)
        sign = -1.0 if way else 1.0
        start = sign * hinge.zero + phase((place - centred) / along)
        quarters = self.quarters(start) if base == self.ground else None
        if quarters is not None:
            zero, start = quarters % 2 * ' up', 0.0
            place = centred + (place - centred) * (1.0 if quarters < 2 else -1.0)
        number, geared = self.drive('crank', hinge.joint, sign * hinge.sign, start)
        name = self.name(place, body, f'crank {centre} {self.length_text(abs(place - centred))}'
                         f'{zero}{geared}')
        self.on[body].setdefault(centre, centred)
        return self.place_on_joint(body, centre, name, f'crank{number}')

    def _carriage(self, slide: Slide, way: int) -> bool:
        """Place the body that a motor moves along a placed one."""
        base, body = slide.bodies[way], slide.bodies[1 - way]
        place = next((pin[body] for pin in self.pins if body in pin), slide.origins[1 - way])
        ahead = (place - slide.origins[1 - way]) / slide.axes[1 - way]
        (origin, start), towards, along = self.line(
            base, slide.origins[way] + slide.axes[way] * ahead, slide.axes[way])
        on = along / slide.axes[way]
        sign = (-1.0 if way else 1.0) * math.copysign(1.0, on.real)
        number, geared = self.drive('carriage', slide.joint, sign, 0.0)
        name = self.name(place, body, f'carriage {origin} along {towards} '
                         f'{self.length_text(-self.farthest)} {self.length_text(self.farthest)}'
                         f'{geared}')
        return self.place(body, Part(f'carriage{number}', name, slide.axes[1 - way] * on,
                                     slide.joint, start))

    def _cylinder(self, slide: Slide, way: int) -> bool:
        """Place two bodies that a motor moves along each other, and the bar at their end."""
        barrel, rod = slide.bodies[way], slide.bodies[1 - way]
        if not self.on[barrel] or {barrel, rod} & self.parts.keys():
            return False
        base, start = self.end(barrel)
        foot = self.place_in_pose(barrel, start)
        back = (start - slide.origins[way]) / slide.axes[way]
        for bar, pin in self.rods(rod):
            ahead = (pin[rod] - slide.origins[1 - way]) / slide.axes[1 - way] - back
            if bar == barrel or base == self.end(bar)[0] or abs(ahead.imag) > self.near:
                continue
            sign = math.copysign(1.0, ((self.place_in_pose(rod, pin[rod]) - foot)
                                       / self.direction_in_pose(barrel, slide.axes[way])).real)
            number, geared = self.drive('cylinder', slide.joint, sign * (-1.0 if way else 1.0),
                                        sign * ahead.real)
            pivot, at = self.end(bar)
            side = self._side(foot, self.place_in_pose(bar, at),
                              self.place_in_pose(bar, pin[bar]))
            name = self.name(pin[bar], bar, f'cylinder {base} {pivot} '
                             f'{self.length_text(abs(pin[bar] - at))} {side}{geared}')
            axis = sign * slide.axes[1 - way]
            return self.place(barrel, Part(f'barrel{number}', base, sign * slide.axes[way])) \
                and self.place(rod, Part(f'cylinder{number}', name, axis, slide.joint, start)) \
                and self.place_on_joint(bar, pivot, name)
        return False

    def _dyad(self, first: str) -> bool:
        for second, pin in self.rods(first) if self.on[first] else ():
            start, end = self.end(first), self.end(second)
            if start[0] == end[0] or any(
                    {first, second} == {*motor.bodies} for motor in self.motors):
                continue
            ends = self.place_in_pose(first, start[1]), self.place_in_pose(second, end[1])
            if abs(ends[0] - ends[1]) < self.near:
                raise ValueError(f'{first} and {second} are folded onto each other')
            side = self._side(*ends, self.place_in_pose(first, pin[first]))
            line = self.special_line(pin[first], pin[second], start, end) or (
                f'dyad {start[0]} {end[0]} {self.length_text(abs(pin[first] - start[1]))} '
                f'{self.length_text(abs(pin[second] - end[1]))} {side}')
            name = self.name(pin[first], first, line)
            return self.place_on_joint(first, start[0], name) and self.place_on_joint(
                second, end[0], name)
        return False

    def _slider(self, slide: Slide, way: int) -> bool:
        base, block = slide.bodies[way], slide.bodies[1 - way]
        origin, axis = slide.origins[way], slide.axes[way]
        for rod, pin in self.rods(block):
            (joint, at), length = self.end(rod), abs(pin[rod] - self.end(rod)[1])
            ahead = (pin[block] - slide.origins[1 - way]) / slide.axes[1 - way]
            (start, on_base), towards, along = self.line(base, origin + axis * ahead, axis, joint)
            half = 'out' if (self.direction_in_pose(rod, pin[rod] - at)
                             / self.direction_in_pose(base, along)).real > 0.0 else 'in'
            number = self.number('slider', 'yoke')
            name = self.name(pin[rod], rod, f'slider {joint} {self.length_text(length)} {start} '
                             f'along {towards} {half}')
            on_block = slide.axes[1 - way] * (along / axis)
            return self.place_on_joint(rod, joint, name) and self.place(
                block, Part(f'block{number}', name, on_block, slide.joint, on_base))
        return False

    def _slot(self, slide: Slide, way: int) -> bool:
        lever, block = slide.bodies[way], slide.bodies[1 - way]
        if {lever, block} & self.parts.keys() or not self.on[lever] or not self.on[block]:
            return False
        (pivot, start), (pin, end) = self.end(lever), self.end(block)
        if pivot == pin:
            return False
        axis, across = slide.axes[way], slide.axes[1 - way]
        ahead = ((self.place_in_pose(block, end) - self.place_in_pose(lever, start))
                 / self.direction_in_pose(lever, axis)).real
        sign, length = math.copysign(1.0, ahead), abs(ahead)
        offset = sign * (((end - slide.origins[1 - way]) / across).imag
                         - ((start - slide.origins[way]) / axis).imag)
        number = self.number('slot')
        name = self.name(start + length * sign * axis, lever,
                         f'slot {pivot} {pin} {self.length_text(offset)} out '
                         f'{self.length_text(length)}')
        return self.place_on_joint(lever, pivot, name, f'lever{number}') and self.place(
            block, Part(f'slide{number}', pin, sign * across, slide.joint, start))

    def _yoke(self, slide: Slide, way: int) -> bool:
        base, block = slide.bodies[way], slide.bodies[1 - way]
        for slot in self.slides:
            slot_way = int(slot.bodies[1] == block)
            pin_body, along = slot.bodies[1 - slot_way], slide.axes[1 - way]
            if slot is slide or block not in slot.bodies or pin_body in self.parts or \
                    abs((slot.axes[slot_way] / along).real) > ROUNDING or not self.on[pin_body]:
                continue
            pin, at = self.end(pin_body)
            aside = ((at - slot.origins[1 - slot_way]) / slot.axes[1 - slot_way]).imag
            ahead = ((slot.origins[slot_way] + 1j * slot.axes[slot_way] * aside
                      - slide.origins[1 - way]) / along).real
            (start, on_base), towards, on = self.line(base, slide.origins[way], slide.axes[way])
            number = self.number('slider', 'yoke')
            name = self.name(slide.origins[1 - way] + ahead * along, block,
                             f'yoke {pin} {start} along {towards}')
            return self.place(block, Part(f'block{number}', name, along * (on / slide.axes[way]),
                                          slide.joint, on_base)) and self.place(
                pin_body, Part('', pin, slot.axes[1 - slot_way]))
        return False
