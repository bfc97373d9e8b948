# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Joint lines of a planar linkage: what drives, then dyad after dyad."""

from __future__ import annotations

from cmath import phase as _angle
from itertools import combinations, permutations
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from .loops import Flat, Loop
from .readers import SLIDE


class Drive(NamedTuple):
    """An input: the joint whose position it is, times a ratio, and its value in the pose."""

    name: str
    joint: Flat
    ratio: float
    value: float


class Drawing:
    """
    The lines that place the bodies of a loop.

    Attributes
    ----------
    lines : list of str
    names : dict
        Where each joint of the lines is.
    drives : list of Drive
    on : dict
        The joints of the lines on each body.
    bars : dict
        Of each body that is placed the two joints that its link is between.

    """

    def __init__(self, loop: Loop, drives: Sequence[str]):
        self.loop = loop
        self.near = 1e-9 * loop.size
        self.lines: List[str] = []
        self.names: Dict[str, complex] = {}
        self.drives: List[Drive] = []
        self.driven = [joint for joint in loop.joints if joint.joint.name in drives]
        self.bodies = list(dict.fromkeys(b for joint in loop.joints for b in joint.bodies))
        self.on: Dict[str, List[str]] = {body: [] for body in self.bodies}
        self.bars: Dict[str, Tuple[str, str]] = {loop.ground: ('', '')}
        self.rails: Dict[str, complex] = {}
        self.pins = self._pins()
        self._finish(loop.ground)
        while any(step() for step in (self._drive, self._pair)):
            pass

    @property
    def left(self) -> List[str]:
        """The bodies that are not placed."""
        return [body for body in self.bodies if body not in self.bars]

    def _pins(self) -> List[Tuple[complex, set]]:
        """Return each place with the bodies that turn about it."""
        pins: List[Tuple[complex, set]] = []
        for joint in self.loop.joints:
            if joint.joint.kind != SLIDE:
                bodies = set(joint.bodies)
                same = [pin for pin in pins if pin[1] & bodies
                        and abs(pin[0] - joint.places[0]) < self.near]
                pins = [pin for pin in pins if pin not in same]
                pins.append((joint.places[0], bodies.union(*(pin[1] for pin in same))))
        return pins

    def _of(self, body: str) -> List[complex]:
        return [place for place, bodies in self.pins if body in bodies]

    def _slides(self, body: str) -> Iterator[Tuple[Flat, str]]:
        """Yield the slides of a body, each with the body at its other end."""
        for joint in self.loop.joints:
            if joint.joint.kind == SLIDE and body in joint.bodies:
                yield joint, joint.bodies[joint.bodies[0] == body]

    def _name(self, place: complex, body: str, line: str) -> str:
        """Write a line that places a joint, and return its name."""
        count = len(self.names)
        name = 'ABCDEFGHIJKLMNPQRSTUVWXYZ'[count % 25] + str(count // 25 or '')
        self.names[name] = place
        for each in {body}.union(*(pin[1] for pin in self.pins
                                   if body in pin[1] and abs(pin[0] - place) < self.near)):
            self.on[each].append(name)
        self.lines.append(f'{name} {line}')
        return name

    def _known(self, body: str, place: complex) -> Optional[str]:
        return next((name for name in self.on[body]
                     if abs(self.names[name] - place) < self.near), None)

    def _fixed(self, body: str, place: complex) -> str:
        """Return the joint at a place on a body that is placed, a new one if there is none."""
        if name := self._known(body, place):
            return name
        if body == self.loop.ground:
            return self._name(place, body, f'ground {self.say(place.real)} {self.say(place.imag)}')
        if body in self.rails:
            first = self.on[body][0]
            seen = (place - self.names[first]) / self.rails[body]
            return self._name(place, body,
                              f'block {first} {self.say(seen.real)} {self.say(seen.imag)}')

        def flatness(pair: Tuple[str, str]) -> float:
            start, end = (self.names[name] for name in pair)
            return -abs(((place - start) / (end - start)).imag)

        first, second = min(combinations(self.on[body], 2), key=flatness)
        start, end = self.names[first], self.names[second]
        seen = (place - start) * abs(end - start) / (end - start)
        if abs(seen.imag) < self.near:
            return self._name(place, body, f'line {first} {second} {self.say(seen.real)}')
        return self._name(place, body, f'rigid {first} {second} {self.say(abs(place - start))} '
                          f'{self.say(abs(place - end))} {self._side(first, second, place)}')

    def _finish(self, body: str) -> None:
        """Place what else there is on a body."""
        for place in self._of(body):
            self._fixed(body, place)

    def _side(self, first: str, second: str, place: complex) -> str:
        start, end = self.names[first], self.names[second]
        return 'left' if ((place - start) / (end - start)).imag > 0.0 else 'right'

    def _drive(self) -> bool:
        """Place the body that a motor moves on one that is placed."""
        for joint in self.driven:
            for (base, body), sign in ((joint.bodies, 1.0), (joint.bodies[::-1], -1.0)):
                if base in self.bars and body not in self.bars and (
                        self._carriage if joint.joint.kind == SLIDE else self._crank)(
                            joint, base, body, sign):
                    self._finish(body)
                    return True
        return False

    def _input(self, word: str, joint: Flat, ratio: float, value: float) -> None:
        same = sum(drive.name.rstrip('0123456789') == word for drive in self.drives)
        self.drives.append(Drive(f'{word}{same + 1}' if same else word, joint, ratio, value))

    def _crank(self, joint: Flat, base: str, body: str, sign: float) -> bool:
        centre = self._fixed(base, joint.places[0])
        start = self.names[centre]
        place = next((place for place in self._of(body) if abs(place - start) > self.near),
                     start + self.loop.size * next(
                         (slide.along for slide, _ in self._slides(body)), 1.0))
        zero, along = '', 1.0 + 0.0j
        if base != self.loop.ground:
            mark = next(name for name in self.on[base] if name != centre)
            zero, along = f' zero {mark}', self.names[mark] - start
        name = self._name(place, body, f'crank {centre} {self.say(abs(place - start))}{zero}')
        self.bars[body] = centre, name
        self._input('crank', joint, sign * joint.sign, _angle((place - start) / along))
        return True

    def _carriage(self, joint: Flat, base: str, body: str, sign: float) -> bool:
        ratio, along = sign, joint.along
        place = next(iter(self._of(body)), None)
        if place is None or self._known(body, place):
            return False
        value = ratio * (joint.joint.position or 0.0)
        origin = self._fixed(base, place - along * value)
        towards = self._on_line(base, origin, along)
        ends = [ratio * end for end in joint.joint.limits or (
            (joint.joint.position or 0.0) + off for off in (-self.loop.size, self.loop.size))]
        if (self.names[towards] - self.names[origin]) / along != 0 and (
                (self.names[towards] - self.names[origin]) / along).real < 0.0:
            ratio, along, value, ends = -ratio, -along, -value, [-end for end in ends]
        name = self._name(place, body, f'carriage {origin} along {towards} '
                          f'{self.say(min(ends))} {self.say(max(ends))}')
        self.bars[body], self.rails[body] = (name, name), along
        self._input('carriage', joint, ratio, value)
        return True

    def _on_line(self, body: str, origin: str, along: complex) -> str:
        """Return a second joint of a body on the line through one."""
        for name in self.on[body]:
            seen = (self.names[name] - self.names[origin]) / along
            if name != origin and abs(seen.imag) < self.near / 1000.0:
                return name
        return self._fixed(body, self.names[origin] + along * self.loop.size)

    def _pair(self) -> bool:
        """Place two bodies, or with a cylinder three, that hang on what is placed."""
        return any(step(*pair) for pair in permutations(self.left, 2)
                   for step in (self._dyad, self._slider, self._slot, self._cylinder))

    def _shared(self, first: str, second: str) -> Optional[complex]:
        """Return where a pin is of two bodies, not placed yet."""
        return next((place for place, bodies in self.pins
                     if {first, second} <= bodies and not self._known(first, place)), None)

    def _dyad(self, first: str, second: str) -> bool:
        place = self._shared(first, second)
        if place is None or not self.on[first] or not self.on[second]:
            return False
        ends = self.on[first][0], self.on[second][0]
        if ends[0] == ends[1] or {joint for joint in self.driven if joint.bodies in (
                (first, second), (second, first))}:
            return False
        bars = [self.say(abs(place - self.names[end])) for end in ends]
        name = self._name(place, first, self._parallel(*ends, place) or
                          f'dyad {" ".join(ends)} {" ".join(bars)} {self._side(*ends, place)}')
        self.bars[first], self.bars[second] = (ends[0], name), (ends[1], name)
        self._finish(first)
        self._finish(second)
        return True

    def _parallel(self, first: str, second: str, place: complex) -> Optional[str]:
        """Return the line of a parallelogram, which passes its flat poses; None if it is none."""
        start, end = self.names[first], self.names[second]
        for corner, at in self.names.items():
            links = [{body for body in self.bars if {corner, other} <= {*self.on[body]}}
                     for other in (first, second)]
            if corner not in (first, second) and all(links) and links[0] != links[1]:
                if abs(start + end - at - place) < self.near:
                    return f'parallelogram {corner} {first} {second}'
                mirrored = start + (end - start) * ((at - start) / (end - start)).conjugate()
                if abs(mirrored - place) < self.near:
                    return f'antiparallelogram {corner} {first} {second}'
        return None

    def _slider(self, rod: str, block: str) -> bool:
        place = self._shared(rod, block)
        for slide, base in self._slides(block):
            if place is not None and self.on[rod] and base in self.bars \
                    and slide not in self.driven:
                pin = self.on[rod][0]
                at = slide.joint.position or 0.0
                sign = 1.0 if slide.joint.child == block else -1.0
                origin = self._fixed(base, place - slide.along * at * sign)
                along, way = slide.along, self.say(_angle(slide.along))
                if base != self.loop.ground:
                    towards = self._on_line(base, origin, along)
                    along, way = self.names[towards] - self.names[origin], f'along {towards}'
                ahead = ((place - self.names[pin]) / along).real > 0.0
                name = self._name(place, rod, f'slider {pin} '
                                  f'{self.say(abs(place - self.names[pin]))} {origin} {way} '
                                  f'{"out" if ahead else "in"}')
                self.bars[rod], self.bars[block] = (pin, name), (name, name)
                self.rails[block] = along / abs(along)
                self._finish(rod)
                self._finish(block)
                return True
        return False

    def _slot(self, lever: str, block: str) -> bool:
        for slide, other in self._slides(lever):
            if other == block and slide not in self.driven and self.on[lever] and self.on[block]:
                pivot, pin = self.on[lever][0], self.on[block][0]
                seen = (self.names[pin] - self.names[pivot]) / slide.along
                along = slide.along if seen.real > 0.0 else -slide.along
                offset = seen.imag if seen.real > 0.0 else -seen.imag
                name = self._name(self.names[pivot] + along * abs(seen), lever,
                                  f'slot {pivot} {pin} {self.say(offset)} out '
                                  f'{self.say(abs(seen))}')
                self.bars[lever], self.bars[block] = (pivot, name), (pin, pin)
                self.rails[block] = along
                self.on[block].sort(key=lambda each: each != pin)
                self._finish(lever)
                self._finish(block)
                return True
        return False

    def _cylinder(self, barrel: str, rod: str) -> bool:
        for slide, other in self._slides(barrel):
            if other != rod or slide not in self.driven or not self.on[barrel]:
                continue
            for bar in self.left:
                place = self._shared(rod, bar)
                if bar in (barrel, rod) or place is None or not self.on[bar]:
                    continue
                base, pivot = self.on[barrel][0], self.on[bar][0]
                seen = (place - self.names[base]) / slide.along
                if base == pivot or abs(seen.imag) > self.near:
                    continue
                name = self._name(place, rod, f'cylinder {base} {pivot} '
                                  f'{self.say(abs(place - self.names[pivot]))} '
                                  f'{self._side(base, pivot, place)}')
                sign = 1.0 if slide.joint.child == rod else -1.0
                self._input('cylinder', slide, sign if seen.real > 0.0 else -sign, abs(seen))
                self.bars[barrel], self.bars[rod] = (base, base), (name, name)
                self.bars[bar], self.rails[rod] = (pivot, name), slide.along
                self._finish(bar)
                self._finish(rod)
                return True
        return False

    def say(self, value: float) -> str:
        """Return the shortest number that is this one, but for its last digits."""
        return next((text for text in (f'{value + 0.0:.{digits}g}' for digits in range(1, 18))
                     if abs(float(text) - value) <= 3e-16 * self.loop.size), '0') \
            if abs(value) > 3e-16 * self.loop.size else '0'
