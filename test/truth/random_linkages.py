# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Random linkages of every word of the language, a third of them nearly degenerate.

A linkage is drawn joint by joint from a pose that it has: a joint is put somewhere, and the
lengths that are written are the distances found there. So nearly all can be assembled at some
angle. What is degenerate is made on purpose: equal bars by one name or one number, change points,
kites over arms of no length, pins that pass the pivot, offsets of zero, flat triangles, guides,
cylinders that can be as short as nothing. Gears come with ratios of one, whole and broken ones.
"""

import cmath
from functools import partialmethod
import math
from typing import NamedTuple

import numpy as np

DEGENERATE = 0.35
RIGHT_ANGLES = 0.0, math.pi, -math.pi, math.pi / 2, -math.pi / 2
# How far from exactly degenerate.
NEAR = (0.0, 0.0, 0.0, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9)
# The words, and how often they come up.
WORDS = {
    'dyad': 6, 'rigid': 2, 'line': 2, 'mirror': 2, 'parallelogram': 1, 'antiparallelogram': 1,
    'inversor': 1, 'slot': 2, 'slider': 3, 'yoke': 2, 'block': 2, 'image': 2, 'geared': 2,
}
# What adds an input or is geared to one, and how often.
INPUTS = {'crank': 3, 'cylinder': 1, 'carriage': 1}
RATIOS = (1.0, -1.0, -2.0, 2.0, 0.5, -0.5, 1.618, -math.sqrt(2.0))


class Design(NamedTuple):
    """A linkage written down: its lines, the numbers of its dimensions, its sides by joint."""

    joints: tuple
    dimensions: dict
    branches: dict

    def __str__(self):
        lines = ', '.join(map(repr, self.joints))
        given = ''.join(f', {name}={number!r}' for name, number in self.dimensions.items())
        sides = f', branches={self.branches!r}' if self.branches else ''
        return f'C({lines}{given}{sides})'


def design(rng, without=()):
    """Return a random `Design`, in which some words may not come up."""
    return _Writer(rng, {word: often for word, often in WORDS.items()
                         if word not in without}).written()


def given(rng, count, spots, inputs):
    """Return values of inputs, (count, inputs); `spots` of the first are asked for more often."""
    spots = [spots, *([] for _ in inputs[1:])]
    return np.array([[_angle(rng, [*RIGHT_ANGLES, *near]) if input_.turns
                      else _length(rng, input_, [input_.low, input_.high, *near])
                      for input_, near in zip(inputs, spots)] for _ in range(count)])


def _angle(rng, spots):
    kind = rng.random()
    if kind < 0.4:
        return rng.uniform(-math.pi, math.pi)
    if kind < 0.95:
        spot = spots[rng.integers(len(spots))] if rng.random() < 0.5 else spots[-1]
        if kind < 0.55:
            return spot
        return spot + rng.choice((-1.0, 1.0)) * 10.0 ** rng.integers(-15, 0)
    return rng.uniform(-math.pi, math.pi) + 2 * math.pi * rng.choice((1, -3, 1e3, 1e6, 1e9, -1e9))


def _length(rng, input_, spots):
    """Return a length inside the stroke, or at, next to and a little beyond a spot."""
    if rng.random() < 0.5:
        return rng.uniform(input_.low, input_.high)
    spot, size = spots[rng.integers(len(spots))], max(abs(input_.low), abs(input_.high))
    return spot + rng.choice((-1.0, 1.0)) * rng.choice((
        0.0, np.spacing(abs(spot) or size), size * 10.0 ** rng.integers(-15, 0)))


def _log_uniform(rng, low, high):
    return math.exp(rng.uniform(math.log(low), math.log(high)))


class _Writer:
    """A linkage that is being written."""

    def __init__(self, rng, words):
        self._rng = rng
        self._words, self._often = list(words), np.array(list(words.values())) / sum(
            words.values())
        self._lines, self._dimensions = [], {}
        self._names = iter('ABCDEFGHJKLMNPQRSTUVWXYZ')
        self._place, self._kind = {}, {}
        self._bodies, self._texts = [], {}
        self._arms, self._along, self._inputs = [], {}, {}
        self._degenerate = rng.random() < DEGENERATE
        self._literal = rng.choice((0.0, 0.0, 0.3, 1.0))
        self._size = 1.0
        if rng.random() < 0.15:
            self._size = 10.0 ** int(rng.choice((-26, -20, -6, 6, 20, 26)))
            if abs(math.log10(self._size)) > 10:
                self._literal = 0.0

    def written(self):
        """Return the `Design`."""
        rng = self._rng
        self._ground()
        inputs = int(rng.choice((1, 1, 1, 1, 2, 3)))
        for _ in range(int(rng.integers(1, 3)) + inputs - 1):
            self._ground()
        if self._degenerate and rng.random() < 0.5:
            self._special_start()
        while len(self._inputs) < inputs:
            self._driven()
        if not self._bodies:
            self._dyad()
        moving = int(rng.integers(2, 10))
        for _ in range(10 * moving):
            if len(self._place) - len(self._fixed) >= moving + inputs:
                break
            getattr(self, f'_{rng.choice(self._words, p=self._often)}')()
        branches = {}
        for line in self._lines:
            parts = line.split()
            if parts[1] in ('dyad', 'cylinder', 'slot', 'slider') and rng.random() < 0.1:
                branches[parts[0]] = int(rng.choice((-1, 1)))
        return Design(tuple(self._lines), self._dimensions, branches)

    # --- numbers ---

    @property
    def _fixed(self):
        return [name for name, kind in self._kind.items() if kind in ('ground', 'image')]

    @property
    def _pins(self):
        """Return the pins of cranks on the ground, or of whatever moves if there are none."""
        return [name for name, kind in self._kind.items() if kind == 'crank'] or self._moving

    @property
    def _moving(self):
        return [name for name, kind in self._kind.items() if kind not in ('ground', 'image')]

    def _number(self, value, positive=True):
        """Return a text for a number in units of the size; positive unless it may be negative."""
        rng, value = self._rng, float(value)
        if value == 0.0:
            return '0'
        if not positive and value < 0.0 and rng.random() < 0.5:
            return '-' + self._number(-value)
        if rng.random() < self._literal:
            text = repr(round(value * self._size, int(rng.integers(1, 17))
                              - math.floor(math.log10(abs(value * self._size)))))
            return self._known(text, float(text) / self._size)
        if positive and value > 0.0 and self._dimensions and rng.random() < 0.15:
            name = str(rng.choice(list(self._dimensions)))
            factor = float(f'{value * self._size / self._dimensions[name]:.3g}')
            if factor > 0.0:
                form = rng.choice((f'{factor!r}*{name}', f'{name}*{factor!r}',
                                   f'{name}/{1 / factor!r}'))
                return self._known(str(form), factor * self._dimensions[name] / self._size)
        name = f'd{len(self._dimensions)}'
        self._dimensions[name] = float(value * self._size)
        return self._known(name, value)

    def _known(self, text, value):
        self._texts[text] = value
        return text

    def _nudged(self, text, value):
        """Return a text for the same number, or one very near it."""
        step = self._rng.choice(NEAR)
        if step == 0.0:
            return text
        near = value * (1.0 + self._rng.choice((-1, 1)) * step)
        name = f'd{len(self._dimensions)}'
        self._dimensions[name] = float(near * self._size)
        return name

    def _name(self):
        name = next(self._names)
        return name if self._rng.random() < 0.8 else f'{name}_{name.lower()}1'

    def _put(self, name, place, kind):
        self._place[name], self._kind[name] = place, kind

    def _add(self, name, text, place, *hung_on):
        """Write the line of a joint, which has bars to others; the line begins with its word."""
        self._lines.append(f'{name} {text}')
        self._put(name, place, text.split()[0])
        for joint in hung_on:
            self._body(joint, name)

    def _somewhere(self, centre=0.0, radius=1.0):
        return centre + radius * (self._rng.normal() + 1j * self._rng.normal())

    def _pick(self, names):
        return str(self._rng.choice(names))

    def _two(self):
        """Return two joints for an arm: often from the ground to a pin, or one used before."""
        rng, names = self._rng, list(self._place)
        kind = rng.random()
        if self._arms and kind < 0.15:
            pair = self._arms[rng.integers(len(self._arms))]
            return pair if rng.random() < 0.5 else pair[::-1]
        if kind < 0.5:
            pair = self._pick(self._fixed), self._pick(self._pins)
            pair = pair if rng.random() < 0.5 else pair[::-1]
        else:
            pair = tuple(map(str, rng.choice(names, 2, replace=False)))
        if not any(name in self._moving for name in pair) or pair[0] == pair[1]:
            return self._two()
        self._arms.append(pair)
        return pair

    def _distance(self, *names):
        return abs(self._place[names[0]] - self._place[names[1]])

    def _body(self, first, second):
        self._bodies.append([first, second])

    # --- words ---

    def _ground(self):
        rng = self._rng
        place = complex(*(0.0 if zero else x for zero, x in zip(
            rng.random(2) < (0.9 if not self._place else 0.35), rng.normal(size=2) * 1.5)))
        if place in self._place.values():
            place = self._somewhere(radius=1.5)
        name = self._name()
        x, y = (self._number(value, False) for value in (place.real, place.imag))
        self._add(name, f'ground {x} {y}', complex(self._worth(x), self._worth(y)))

    def _worth(self, text):
        if text.startswith('-') and text not in self._texts:
            return -self._worth(text[1:])
        return 0.0 if text == '0' else self._texts[text]

    def _driven(self, geared=False):
        """Add an input, or what is geared to one."""
        word = str(self._rng.choice(list(INPUTS), p=np.array(list(INPUTS.values())) / sum(
            INPUTS.values())))
        getattr(self, f'_{word}')(geared)

    def _geared(self):
        self._driven(True)

    def _gear(self, word, value, geared):
        """Return what a line says of its gear and name; note the value its input would have."""
        rng, turns = self._rng, word == 'crank'
        others = [name for name, (kind, _) in self._inputs.items() if (kind == 'crank') == turns]
        before = sum(name.rstrip('0123456789') == word for name in self._inputs)
        # The second has a name of its own.
        called = 'drive' if len(self._inputs) == 1 else ''
        self._inputs[called or (f'{word}{before + 1}' if before else word)] = word, value
        called = called and f' called {called}'
        if not geared or not others:
            return called
        other = self._pick(others)
        ratio = float(rng.choice(RATIOS))
        offset = value - ratio * self._inputs[other][1]
        if turns:
            return f' geared {other} {ratio!r} {math.remainder(offset, math.tau)!r}{called}'
        return f' geared {other} {ratio!r} {self._number(offset, False)}{called}'

    def _geared_to_any(self, word, geared):
        """Tell whether a line can be geared, where it is to be."""
        return not geared or any((kind == 'crank') == (word == 'crank')
                                 for kind, _ in self._inputs.values())

    def _turn_crank(self, name, centre, length, text, more='', turn=0.0, geared=False):
        angle = self._rng.uniform(-math.pi, math.pi)
        gear = self._gear('crank', angle, geared)
        self._lines.append(f'{name} crank {centre} {text}{more}{gear}')
        on_ground = not more.startswith(' zero') or more.split()[1] in self._fixed
        self._put(name, self._place[centre] + length * cmath.exp(1j * (angle + turn)),
                  'crank' if on_ground else 'crank of a link')
        self._body(centre, name)

    def _crank(self, geared=False):
        rng = self._rng
        if not self._geared_to_any('crank', geared):
            return
        length = _log_uniform(rng, 0.2, 2.0)
        text = self._number(length)
        length = self._texts[text]
        if rng.random() < (0.6 if geared or self._bodies else 0.1):
            centre, zero = self._guide()
            if centre:
                away = self._place[zero] - self._place[centre]
                self._turn_crank(self._name(), centre, length, text, f' zero {zero}',
                                 cmath.phase(away), geared)
                return
        up = rng.random() < 0.25
        self._turn_crank(self._name(), self._pick(self._fixed), length, text, ' up' * up,
                         math.pi / 2 * up, geared)

    def _guide(self):
        """Return two joints of one link or of the ground that are apart, or none."""
        bodies = [body for body in (*self._bodies, self._fixed) if len(body) > 1]
        body = bodies[self._rng.integers(len(bodies))]
        pair = tuple(map(str, self._rng.choice(body, 2, replace=False)))
        return pair if self._distance(*pair) > 1e-3 else (None, None)

    def _cylinder(self, geared=False):
        rng = self._rng
        if not self._geared_to_any('cylinder', geared):
            return
        base, pivot = self._guide() if rng.random() < 0.4 else self._any_two()
        if not base:
            return
        p, o = self._place[base], self._place[pivot]
        place = self._somewhere((p + o) / 2)
        if self._degenerate and rng.random() < 0.5:
            # As far as the base is from the pivot: the cylinder can be as short as nothing.
            place = o + (p - o) * cmath.exp(1j * rng.uniform(0.3, 2.8))
            text = self._text_between(base, pivot)
            bar = self._nudged(text, self._texts[text]) if text else self._number(abs(place - o))
        else:
            bar = self._number(abs(place - o) or 1.0)
        gear = self._gear('cylinder', abs(place - p), geared)
        side = 'left' if ((o - p).conjugate() * (place - p)).imag > 0 else 'right'
        name = self._name()
        self._add(name, f'cylinder {base} {pivot} {bar} {side}{gear}', place, pivot)
        self._slide(name, place - p)

    def _any_two(self):
        return map(str, self._rng.choice(list(self._place), 2, replace=False))

    def _text_between(self, *joints):
        """Return the length that a line writes for a bar between two joints, if one does."""
        for line in self._lines:
            name, word, first, text, *_ = line.split()
            if word == 'crank' and {name, first} == set(joints) and text in self._texts:
                return text
        return None

    def _carriage(self, geared=False):
        rng = self._rng
        if not self._geared_to_any('carriage', geared):
            return
        origin, towards = self._guide()
        if not origin:
            return
        along = self._place[towards] - self._place[origin]
        value = rng.normal() * abs(along)
        low, high = sorted((value - abs(rng.normal()), value + abs(rng.normal())))
        if self._degenerate and rng.random() < 0.3 and low < 0.0 < high:
            low, high = rng.choice(((low, 0.0), (0.0, high)))
        ends = [self._number(low, False), self._number(high, False)]
        gear = self._gear('carriage', value, geared)
        name = self._name()
        self._add(name, f'carriage {origin} along {towards} {" ".join(ends)}{gear}',
                  self._place[origin] + along / abs(along) * value)
        self._slide(name, along)

    def _yoke(self):
        origin, towards = self._guide()
        pin = self._pick(self._moving)
        if not origin or pin in (origin, towards):
            return
        along = self._place[towards] - self._place[origin]
        seen = (self._place[pin] - self._place[origin]) / along
        name = self._name()
        self._add(name, f'yoke {pin} {origin} along {towards}',
                  self._place[origin] + along * seen.real)
        self._slide(name, along)

    def _image(self):
        if len(self._fixed) < 3:
            return
        point, *line = map(str, self._rng.choice(self._fixed, 3, replace=False))
        p, q = (self._place[end] for end in line)
        place = p + (q - p) * ((self._place[point] - p) / (q - p)).conjugate()
        if self._distance(*line) > 1e-3 and min(
                abs(place - other) for other in self._place.values()) > 1e-3:
            self._add(self._name(), f'image {point} {" ".join(line)}', place)

    def _slide(self, joint, along):
        """Note the direction in which a joint slides, the first one that it has."""
        self._along.setdefault(joint, along / (abs(along) or 1.0))

    def _block(self):
        if not self._along:
            return
        rng, joint = self._rng, self._pick(list(self._along))
        parts = [self._number(rng.normal(), False) for _ in 'xy']
        if self._degenerate and rng.random() < 0.5:
            parts[int(rng.integers(2))] = '0'
        name = self._name()
        self._add(name, f'block {joint} {parts[0]} {parts[1]}', self._place[joint]
                  + self._along[joint] * complex(*map(self._worth, parts)))
        for body in self._bodies:
            if body[0] == joint and self._kind[body[1]] == 'block':
                body.append(name)
                return
        self._body(joint, name)

    def _special_start(self):
        """Hang on the first crank what has a change point, or an arm of no length at times."""
        rng = self._rng
        centre = self._fixed[0]
        g, m = _log_uniform(rng, 0.3, 3.0), _log_uniform(rng, 0.3, 3.0)
        literal, self._literal = self._literal, 0.0 if self._literal < 1.0 else 1.0
        ground = self._number(g)
        g = self._texts[ground]
        foot, pin = self._name(), self._name()
        x, y = self._lines[0].split()[2:]
        where = rng.choice(('right', 'left', 'up', 'down'))
        sign = '+' if where in ('right', 'up') else '-'
        moved = f'{x if where in ("right", "left") else y}{sign}{ground}'
        moved = moved.replace('+-', '-').replace('--', '+')
        if moved.startswith('0'):
            moved = moved[2:] if sign == '+' else moved[1:]
        at = (moved, y) if where in ('right', 'left') else (x, moved)
        step = {'right': g, 'left': -g, 'up': 1j * g, 'down': -1j * g}[where]
        self._add(foot, f'ground {at[0]} {at[1]}', self._place[centre] + step)
        kind = rng.choice(('isosceles', 'parallelogram', 'sum', 'kite', 'difference', 'crossed'))
        if kind in ('isosceles', 'kite'):
            crank, m = self._nudged(ground, g), g
        else:
            crank = self._number(m)
            m = self._texts[crank]
        up = rng.random() < 0.25
        self._turn_crank(pin, centre, m, crank, ' up' * up, math.pi / 2 * up)
        pair = (pin, foot) if rng.random() < 0.5 else (foot, pin)
        side = rng.choice(('left', 'right'))
        name = self._name()
        b = rng.uniform(0.15, 0.85) * (g + m)
        if kind == 'crossed':
            self._add(name, f'antiparallelogram {centre} {pair[0]} {pair[1]}',
                      self._somewhere(self._place[pin]), *pair)
        elif kind == 'isosceles':
            self._arms += [pair, pair]
        elif kind == 'parallelogram':
            to_pin, to_foot = self._nudged(ground, g), self._nudged(crank, m)
            bars = (to_pin, to_foot) if pair[0] == pin else (to_foot, to_pin)
            self._finish_dyad(name, *pair, *bars, side)
        elif kind == 'kite':
            bar = self._number(abs(b))
            self._finish_dyad(name, *pair, bar, self._nudged(bar, self._texts[bar]), side)
        else:
            bar = self._number(b)
            b = self._texts[bar]
            other = g + m - b if kind == 'sum' else b + abs(g - m)
            text = (f'{ground}+{crank}-{bar}' if kind == 'sum' else
                    f'{bar}+{ground}-{crank}' if g > m else f'{bar}+{crank}-{ground}')
            if other > 0.05 * b:
                self._finish_dyad(name, *pair, bar, self._nudged(text, other), side)
        self._literal = literal

    def _finish_dyad(self, name, first, second, one, other, side):
        self._add(name, f'dyad {first} {second} {one} {other} {side}',
                  self._somewhere(self._place[second]), first, second)

    def _dyad(self):
        rng = self._rng
        first, second = self._two()
        p, q = self._place[first], self._place[second]
        equal = rng.random() < (0.6 if self._degenerate else 0.1)
        height = rng.normal() * max(abs(q - p), 0.3)
        place = ((p + q) / 2 + 1j * (q - p) / max(abs(q - p), 1e-3) * height if equal
                 else self._somewhere((p + q) / 2))
        one = self._number(abs(place - p) or 1.0)
        other = self._nudged(one, self._texts[one]) if equal \
            else self._number(abs(place - q) or 1.0)
        side = 'left' if ((q - p).conjugate() * (place - p)).imag > 0 else 'right'
        name = self._name()
        self._finish_dyad(name, first, second, one, other, side)
        self._place[name] = place

    def _pair_of_link(self):
        body = self._bodies[self._rng.integers(len(self._bodies))]
        return body, *map(str, self._rng.choice(body, 2, replace=False))

    def _rigid(self):
        rng = self._rng
        body, first, second = self._pair_of_link()
        p, q = self._place[first], self._place[second]
        base = abs(q - p)
        if base < 1e-3:
            return
        shape = rng.random() if self._degenerate else 0.0
        if shape > 0.8:
            place = p + (q - p) * rng.uniform(0.2, 0.8)
        elif shape > 0.4:
            place = (p + q) / 2 + 1j * (q - p) * rng.uniform(0.1, 2.0)
        else:
            place = self._somewhere((p + q) / 2)
        one = self._number(abs(place - p))
        other = self._nudged(one, self._texts[one]) if 0.4 < shape <= 0.8 \
            else self._number(abs(place - q))
        name = self._name()
        self._add(name, f'rigid {first} {second} {one} {other} {rng.choice(("left", "right"))}',
                  place)
        body.append(name)

    def _line(self):
        rng = self._rng
        body, first, second = self._pair_of_link()
        p, q = self._place[first], self._place[second]
        if abs(q - p) < 1e-3:
            return
        if self._degenerate and rng.random() < 0.3:
            text = str(rng.choice(list(self._texts) + ['0']))
            text = text if rng.random() < 0.5 or text == '0' or text[0] == '-' else f'2*{text}'
        else:
            text = self._number(rng.normal() * abs(q - p), False)
        name = self._name()
        self._add(name, f'line {first} {second} {text}', self._somewhere(p))
        body.append(name)

    def _corners(self):
        """Return joints with two others, each on a link with it or all of the ground."""
        bodies = [*self._bodies, self._fixed]
        found = []
        for name in self._place:
            near = sorted({other for body in bodies if name in body for other in body} - {name})
            for i, one in enumerate(near):
                found += [(name, one, other) for other in near[i + 1:]
                          if not {one, other} <= set(self._fixed)
                          and not any({one, other} <= set(body) and name in body
                                      for body in self._bodies)]
        return found

    def _reflected(self, word):
        corners = self._corners()
        if not corners:
            return
        point, first, second = corners[self._rng.integers(len(corners))]
        if self._rng.random() < 0.5:
            first, second = second, first
        o, p, q = (self._place[name] for name in (point, first, second))
        if word != 'mirror':
            o = p + q - o
        self._add(self._name(), f'{word} {point} {first} {second}',
                  o if word == 'parallelogram' or abs(q - p) < 1e-9
                  else p + (q - p) * ((o - p) / (q - p)).conjugate(), first, second)

    _mirror = partialmethod(_reflected, 'mirror')
    _parallelogram = partialmethod(_reflected, 'parallelogram')
    _antiparallelogram = partialmethod(_reflected, 'antiparallelogram')

    def _inversor(self):
        rng = self._rng
        pole, pin = self._two()
        p, q = self._place[pole], self._place[pin]
        place = self._somewhere((p + q) / 2)
        long = self._number(abs(place - p) or 1.0)
        short = self._nudged(long, self._texts[long]) \
            if self._degenerate and rng.random() < 0.3 else self._number(abs(place - q) or 1.0)
        right, corner, left = self._name(), self._name(), self._name()
        self._lines.append(f'{right} {corner} {left} inversor {pole} {pin} {long} {short}')
        for name in (right, corner, left):
            self._put(name, self._somewhere((p + q) / 2), 'inversor')
        for pair in ((pole, right), (pin, right), (pole, left), (pin, left), (right, corner),
                     (left, corner)):
            self._body(*pair)

    def _slot(self):
        rng = self._rng
        pivot, pin = self._pick(self._fixed), self._pick(self._moving)
        if rng.random() < 0.4:
            pivot, pin = self._two()
        away = self._distance(pivot, pin)
        kind = rng.random()
        if kind < (0.5 if self._degenerate else 0.2):
            offset = '0'
        else:
            offset = self._number(rng.uniform(-1.0, 1.0) * max(away, 0.1), False)
        name = self._name()
        length = self._number(_log_uniform(rng, 0.3, 3.0))
        self._add(name, f'slot {pivot} {pin} {offset} {rng.choice(("out", "in"))} {length}',
                  self._somewhere(self._place[pivot]), pivot)
        self._slide(pin, self._place[pin] - self._place[pivot])

    def _slider(self):
        rng = self._rng
        pin, origin = self._pick(self._moving), self._pick(self._fixed)
        angle, towards = rng.choice((0.0, 1.5707963267948966, 3.141592653589793,
                                     -1.5707963267948966, rng.uniform(-4.0, 4.0))), None
        along = cmath.exp(1j * angle)
        if rng.random() < 0.4:
            origin, towards = self._guide()
            if not origin or pin in (origin, towards):
                return
            along = self._place[towards] - self._place[origin]
            along /= abs(along)
        seen = (self._place[pin] - self._place[origin]) * along.conjugate()
        if self._degenerate and rng.random() < 0.5 and self._kind[pin] == 'crank':
            text = self._lines[[line.split()[0] for line in self._lines].index(pin)].split()[3]
            rod = self._nudged(text, self._texts.get(text, 1.0))
        else:
            rod = self._number(abs(seen.imag) + abs(rng.normal()))
        name = self._name()
        turn = '0' if angle == 0.0 else repr(float(angle))
        if angle and not towards and rng.random() < 0.3:
            turn = f'd{len(self._dimensions)}'
            self._dimensions[turn] = float(angle)
        way = f'along {towards}' if towards else turn
        self._add(name, f'slider {pin} {rod} {origin} {way} {rng.choice(("out", "in"))}',
                  self._place[origin] + along * seen.real, pin)
        self._slide(name, along)
