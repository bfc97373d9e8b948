# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Joint lines of a planar linkage: what drives it, then dyad after dyad."""

from __future__ import annotations

from cmath import phase
from itertools import combinations, permutations
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

from .loops import Loop
from .readers import Joint, SLIDE


class Drive(NamedTuple):
    """An input: its name, the joint that it is, times a ratio, and its value in the pose."""

    name: str
    joint: Joint
    ratio: float
    value: float


def short(value: float, near: float = 2e-16) -> str:
    """Return a number, and one of few digits where that is as near to it as rounding."""
    if abs(value) <= 5.0 * near:
        return '0'
    return next((text for text in (f'{value:.{digits}g}' for digits in range(1, 13))
                 if abs(float(text) - value) <= near), repr(float(value)))


class Drawing:
    """
    The lines that place the bodies of a loop.

    Attributes
    ----------
    lines : list of str
    places : dict
        Where each joint of the lines is in the pose of the file.
    drives : list of Drive
    bars : dict
        Of each body that is placed, between which joints of the lines its link is; of a block
        its pin, and where that is counted from.

    """

    def __init__(self, loop: Loop, drives: Sequence[str]):
        self.loop, self.near = loop, 1e-9 * loop.size
        self.lines: List[str] = []
        self.places: Dict[str, complex] = {}
        self.drives: List[Drive] = []
        self.driven = [joint for joint in loop.joints if joint.name in drives]
        self.bodies = list(dict.fromkeys(b for joint in loop.joints for b in joint.bodies))
        self.bars: Dict[str, Tuple[str, str]] = {}
        self._on: Dict[str, List[str]] = {body: [] for body in self.bodies}
        # The body that each joint of the lines was placed with: others turn against that.
        self._home: Dict[str, str] = {}
        # Which way blocks slide.
        self._rails: Dict[str, complex] = {}
        self._pins: List[Tuple[complex, set]] = []
        for joint in loop.joints:
            if joint.kind != SLIDE:
                same = [pin for pin in self._pins if pin[1] & {*joint.bodies}
                        and abs(pin[0] - joint.places[0]) < self.near]
                self._pins = [pin for pin in self._pins if pin not in same] + [
                    (joint.places[0], {*joint.bodies}.union(*(pin[1] for pin in same)))]
        self._place({loop.ground: ('', '')})
        while any(self._drive(joint, *way) for joint in self.driven for way in (
                (*joint.bodies, 1.0), (*joint.bodies[::-1], -1.0))) or any(
                rule(*pair) for pair in permutations(self.left, 2)
                for rule in (self._dyad, self._slider, self._slot, self._cylinder)):
            pass

    @property
    def left(self) -> List[str]:
        """The bodies that are not placed."""
        return [body for body in self.bodies if body not in self.bars]

    def seen(self, joint: Joint) -> Optional[Tuple[Tuple[str, str], float]]:
        """Return the ends of the link that tells a joint's position, and its sign, if any does."""
        if not self.bars.keys() >= {*joint.bodies}:
            return None
        parent, child = joint.bodies
        if joint.kind == SLIDE:
            block = child if child in self._rails else parent
            if block not in self._rails:
                return None
            sign = 1.0 if (self._rails[block] / joint.axis).real > 0.0 else -1.0
            return self.bars[block], sign if block == child else -sign
        pin = self._known(child, joint.places[0]) or ''
        turns = child if self._home[pin] == parent else parent
        if self._home[pin] not in joint.bodies:
            return None
        tip = self.bars[turns][1]
        if self.bars[turns][0] != pin or turns in self._rails:
            # A triangle on its link shows how that turns against the one that the pin is on.
            other = self._other(turns, pin)
            start, end = self.places[pin], self.places[other]
            side = self._say(abs(end - start))
            tip = self._name(start + (end - start) * complex(0.5, 0.75 ** 0.5), turns,
                             f'dyad {pin} {other} {side} {side} left')
        return (pin, tip), joint.axis if turns == child else -joint.axis

    def _say(self, value: float) -> str:
        return short(value, 1e-15 * self.loop.size)

    def _name(self, place: complex, body: str, line: str) -> str:
        """Write the line that places a joint, and return its name."""
        count = len(self.places)
        name = 'ABCDEFGHIJKLMNPQRSTUVWXYZ'[count % 25] + str(count // 25 or '')
        self.places[name], self._home[name] = place, body
        for each in {body}.union(*(bodies for at, bodies in self._pins
                                   if body in bodies and abs(at - place) < self.near)):
            self._on[each].append(name)
        self.lines.append(f'{name} {line}')
        return name

    def _known(self, body: str, place: complex) -> Optional[str]:
        return next((name for name in self._on[body]
                     if abs(self.places[name] - place) < self.near), None)

    def _fixed(self, body: str, place: complex) -> str:
        """Return the joint at a place on a body that is placed, a new one if there is none."""
        if name := self._known(body, place):
            return name
        say = self._say
        if body == self.loop.ground:
            return self._name(place, body, f'ground {say(place.real)} {say(place.imag)}')
        if body in self._rails:
            pin = self.bars[body][1]
            seen = self._from(pin, place, self._rails[body])
            return self._name(place, body, f'block {pin} {say(seen.real)} {say(seen.imag)}')
        # On the bar from which the triangle is the least flat.
        bars = [(self._from(first, place, self.places[second] - self.places[first]), first, second)
                for first, second in combinations(self._on[body], 2)]
        if not bars:
            raise ValueError(f'{body} is a barrel with another joint, which no word can place')
        seen, first, second = max(bars, key=lambda bar: abs(bar[0].imag))
        start, end = self.places[first], self.places[second]
        if abs(seen.imag * (end - start)) < self.near:
            return self._name(place, body,
                              f'line {first} {second} {say(seen.real * abs(end - start))}')
        return self._name(place, body, f'rigid {self._bars(place, first, second)}')

    def _from(self, name: str, place: complex, along: complex) -> complex:
        return (place - self.places[name]) / along

    def _bars(self, place: complex, first: str, second: str) -> str:
        """Return what a line says of two bars that meet."""
        start, end = self.places[first], self.places[second]
        side = 'left' if self._from(first, place, end - start).imag > 0.0 else 'right'
        return (f'{first} {second} {self._say(abs(place - start))} '
                f'{self._say(abs(place - end))} {side}')

    def _other(self, body: str, name: str) -> str:
        """Return another joint of a body that is placed."""
        return next((other for other in self._on[body] if other != name), None) or self._fixed(
            body, self.places[name] + self.loop.size * self._rails.get(body, 1.0))

    def _towards(self, body: str, origin: str, along: complex) -> Tuple[str, complex]:
        """Return another joint of a body on the line through one, and where it is from there."""
        name = next((name for name in self._on[body] if name != origin and abs(self._from(
            origin, self.places[name], along).imag) < 1e-12 * self.loop.size), None)
        name = name or self._fixed(body, self.places[origin] + self.loop.size * along)
        way = self.places[name] - self.places[origin]
        return name, way / abs(way)

    def _place(self, bars: Dict[str, Tuple[str, str]]) -> bool:
        """Note the bars of bodies that are placed, and place what else there is on them."""
        self.bars.update(bars)
        for body in bars:
            for place, bodies in self._pins:
                if body in bodies:
                    self._fixed(body, place)
        return True

    def _drive(self, joint: Joint, base: str, body: str, sign: float) -> bool:
        """Place the body that a motor moves on one that is placed."""
        places = [place for place, bodies in self._pins if body in bodies]
        if base not in self.bars or body in self.bars or not places:
            return False
        if joint.kind == SLIDE:
            place = places[0]
            origin = self._fixed(base, place - joint.axis * sign * (joint.position or 0.0))
            towards, along = self._towards(base, origin, joint.axis)
            ratio = sign if (along / joint.axis).real > 0.0 else -sign
            value, size = self._from(origin, place, along).real, self.loop.size
            name = self._name(place, body, f'carriage {origin} along {towards} '
                              f'{self._say(value - size)} {self._say(value + size)}')
            self._rails[body] = along
            return self._driven_by('carriage', joint, ratio, value) and self._place(
                {body: (origin, name)})
        centre, zero, along = self._fixed(base, joint.places[0]), '', 1.0 + 0.0j
        start = self.places[centre]
        place = next((place for place in places if abs(place - start) > self.near),
                     start + self.loop.size * next((
                         each.axis for each in self.loop.joints
                         if each.kind == SLIDE and body in each.bodies), along))
        if base != self.loop.ground:
            mark = self._other(base, centre)
            zero, along = f' zero {mark}', self.places[mark] - start
        name = self._name(place, body, f'crank {centre} {self._say(abs(place - start))}{zero}')
        return self._driven_by('crank', joint, sign * joint.axis, phase(
            (place - start) / along)) and self._place({body: (centre, name)})

    def _driven_by(self, word: str, joint: Joint, ratio: float, value: float) -> bool:
        same = sum(drive.name.rstrip('0123456789') == word for drive in self.drives)
        self.drives.append(Drive(f'{word}{same + 1 if same else ""}', joint, ratio, float(value)))
        return True

    def _shared(self, first: str, second: str) -> Optional[complex]:
        """Return where two bodies share a pin that is not placed, while the first holds one."""
        return next((place for place, bodies in self._pins if {first, second} <= bodies
                     and self._on[first] and not self._known(first, place)), None)

    def _slides(self, body: str, driven: bool = False) -> List[Tuple[Joint, str]]:
        """Return the slides of a body, each with the body at its other end."""
        return [(joint, joint.bodies[joint.bodies[0] == body]) for joint in self.loop.joints
                if joint.kind == SLIDE and body in joint.bodies
                and (joint in self.driven) is driven]

    def _dyad(self, first: str, second: str) -> bool:
        place = self._shared(first, second)
        if place is None or not self._on[second] or self._on[first][0] == self._on[second][0] \
                or any({first, second} == {*joint.bodies} for joint in self.driven):
            return False
        ends = self._on[first][0], self._on[second][0]
        line = self._alike(place, *ends) or f'dyad {self._bars(place, *ends)}'
        name = self._name(place, first, line)
        return self._place({first: (ends[0], name), second: (ends[1], name)})

    def _alike(self, place: complex, first: str, second: str) -> Optional[str]:
        """Return what a line says of bars like those from a corner: they pass their flat poses."""
        start, end = self.places[first], self.places[second]
        for corner, at in self.places.items():
            links = [{body for body in self.bars if {corner, name} <= {*self._on[body]}}
                     for name in (first, second)]
            if corner in (first, second) or not all(links) or links[0] == links[1]:
                continue
            opposite, along = start + end - at, end - start
            kite, crossed = (start + along * (self._from(first, each, along)).conjugate()
                             for each in (at, opposite))
            for word, seen in (('parallelogram', opposite), ('mirror', kite),
                               ('antiparallelogram', crossed)):
                if abs(seen - place) < self.near < abs(at - place):
                    return f'{word} {corner} {first} {second}'
        return None

    def _slider(self, rod: str, block: str) -> bool:
        place = self._shared(rod, block)
        for slide, base in self._slides(block):
            if place is not None and base in self.bars:
                pin, sign = self._on[rod][0], 1.0 if slide.bodies[1] == block else -1.0
                origin = self._fixed(base, place - slide.axis * sign * (slide.position or 0.0))
                along, way = slide.axis, short(phase(slide.axis))
                if base != self.loop.ground:
                    towards, along = self._towards(base, origin, along)
                    way = f'along {towards}'
                half = 'out' if self._from(pin, place, along).real > 0.0 else 'in'
                size = self._say(abs(place - self.places[pin]))
                name = self._name(place, rod, f'slider {pin} {size} {origin} {way} {half}')
                self._rails[block] = along
                return self._place({rod: (pin, name), block: (origin, name)})
        return False

    def _slot(self, lever: str, block: str) -> bool:
        for slide, other in self._slides(lever):
            if other == block and self._on[lever] and self._on[block]:
                pivot, pin = self._on[lever][0], self._on[block][0]
                seen = self._from(pivot, self.places[pin], slide.axis)
                sign = 1.0 if seen.real > 0.0 else -1.0
                self._rails[block] = sign * slide.axis
                name = self._name(self.places[pivot] + abs(seen) * self._rails[block], lever,
                                  f'slot {pivot} {pin} {self._say(sign * seen.imag)} out '
                                  f'{self._say(abs(seen))}')
                return self._place({lever: (pivot, name), block: (pivot, pin)})
        return False

    def _cylinder(self, barrel: str, bar: str) -> bool:
        for slide, rod in self._slides(barrel, driven=True):
            place = self._shared(bar, rod)
            if place is None or not self._on[barrel] or rod in self.bars:
                continue
            base, pivot = self._on[barrel][0], self._on[bar][0]
            seen = self._from(base, place, slide.axis)
            if base != pivot and abs(seen.imag) < self.near:
                _, _, _, length, side = self._bars(place, base, pivot).split()
                name = self._name(place, bar, f'cylinder {base} {pivot} {length} {side}')
                self._rails[rod] = slide.axis * seen.real / abs(seen)
                sign = 1.0 if (slide.bodies[1] == rod) == (seen.real > 0.0) else -1.0
                return self._driven_by('cylinder', slide, sign, abs(seen)) and self._place(
                    {barrel: (base, name), rod: (base, name), bar: (pivot, name)})
        return False
