# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The truth of any linkage that the language can write, placed as with ruler and compasses.

Nothing here comes from the library and no formula is shared with it. A joint is where two circles,
or a circle and a line, meet on the side that is written; a rigid link is drawn once on a template
and laid on its bar. The same drawing is done in 96 digits (`DIGITS`), where such formulas cancel
as badly as they like, and with numpy's complex numbers for thousands of angles at once (`FLOATS`).

An input is an angle or a length; one geared to another is a multiple of it, plus an offset. A
change point is passed as the language says in words: the side changes each time that the crank
passes the angle at which the dyad is stretched or folded, counted from a quarter turn.
"""

import functools
import math
import re
from types import SimpleNamespace
from typing import NamedTuple

import gmpy2
from gmpy2 import mpc, mpfr
import numpy as np

BITS = 320
# A gap of the four bars that is smaller than this part of them may count as a change point.
ROUNDING = 64 * 2.0 ** -53

# What follows a word, but for the word `along`: j a joint, n a length, a an angle, s a side.
_FORMS = {
    'ground': 'nn', 'image': 'jjj', 'crank': 'jn', 'yoke': 'jjj', 'cylinder': 'jjns',
    'carriage': 'jjnn', 'block': 'jnn',
    'dyad': 'jjnns', 'rigid': 'jjnns', 'line': 'jjn', 'mirror': 'jjj', 'parallelogram': 'jjj',
    'antiparallelogram': 'jjj', 'inversor': 'jjnn', 'slot': 'jjnsn', 'slider': 'jnjas'}
_SLIDER_ALONG = 'jnjjs'
_INPUTS = 'crank', 'cylinder', 'carriage'
SLIDING = 'cylinder', 'carriage', 'yoke', 'slot', 'slider'
# To which of the joints that it stands on a joint that is placed has a bar, by their numbers.
_BARS_TO = {'crank': (0,), 'dyad': (0, 1), 'mirror': (1, 2), 'parallelogram': (1, 2),
            'antiparallelogram': (1, 2), 'slot': (0,), 'slider': (0,), 'cylinder': (1,)}
_SIDES = {'left': 1, 'right': -1, 'out': 1, 'in': -1}


def precisely(function):
    """Let a function compute with many digits."""
    @functools.wraps(function)
    def in_digits(*args, **kwargs):
        with gmpy2.context(gmpy2.get_context(), precision=BITS):
            return function(*args, **kwargs)
    return in_digits


# Arithmetic in many digits, and on arrays of float64. A root is zero where its square is negative;
# a quotient by nothing is nothing in digits, and not a number in floats.
DIGITS = SimpleNamespace(
    pi=gmpy2.const_pi, floor=gmpy2.floor, least=min, point=mpc,
    turned=lambda angle: mpc(gmpy2.cos(angle), gmpy2.sin(angle)),
    direction=lambda vector: gmpy2.atan2(vector.imag, vector.real),
    root=lambda square: gmpy2.sqrt(square) if square > 0 else mpfr(0),
    divided=lambda x, y: x / y if y != 0 else x * 0)
FLOATS = SimpleNamespace(
    pi=lambda: math.pi, floor=np.floor, least=np.minimum, point=complex, direction=np.angle,
    turned=lambda angle: np.exp(1j * np.asarray(angle)),
    root=lambda square: np.sqrt(np.maximum(square, 0.0)),
    divided=np.errstate(all='ignore')(lambda x, y: np.divide(x, y)))


# --- reading ------------------------------------------------------------------------------------

class Line(NamedTuple):
    """
    A line: the joints it places, its word, the joints it stands on, its numbers, its side.

    `kinds` are those of the numbers, n a length, a an angle, r a ratio; `zero` is the joint from
    which a crank is counted, `geared` the input that a line's own is a multiple of.
    """

    names: tuple
    word: str
    joints: tuple
    numbers: tuple
    kinds: str
    side: int
    up: bool
    zero: str = ''
    geared: str = ''
    called: str = ''

    @property
    def turns(self):
        """Whether what drives it is an angle."""
        return self.word == 'crank'


@functools.cache
def read(text):
    """Return a `Line` of the language."""
    parts = text.split()
    at = next(i for i, part in enumerate(parts) if part in _FORMS and i)
    word, rest = parts[at], [part for part in parts[at + 1:] if part != 'along']
    form = _SLIDER_ALONG if word == 'slider' and 'along' in parts else _FORMS[word]
    given = {kind: [] for kind in 'jnas'}
    for kind, part in zip(form, rest):
        given['n' if kind == 'a' else kind].append(part)
    side = _SIDES[given['s'][0]] if given['s'] else 1
    zero, (geared, *gear) = _option(rest, 'zero', 1) or ('',), _option(rest, 'geared', 3) or ('',)
    kinds = re.sub('[js]', '', form) + ('ra' if word == 'crank' else 'rn') * bool(gear)
    return Line(tuple(parts[:at]), word, (*given['j'], *filter(None, zero)),
                (*given['n'], *gear), kinds, side, rest[2:3] == ['up'],
                *zero, geared, *_option(rest, 'called', 1))


def _option(rest, word, count):
    at = rest.index(word) + 1 if word in rest else len(rest)
    return rest[at:at + count]


class Value(NamedTuple):
    """A number in many digits and what rounding its arithmetic to float64 may do to it."""

    number: mpfr
    slack: mpfr

    def __add__(self, other):
        return _rounded(self.number + other.number, self.slack + other.slack)

    def __sub__(self, other):
        return self + -other

    def __mul__(self, other):
        return _rounded(self.number * other.number, abs(self.number) * other.slack
                        + abs(other.number) * self.slack)

    def __truediv__(self, other):
        quotient = self.number / other.number
        return _rounded(quotient, self.slack / abs(other.number)
                        + abs(quotient / other.number) * other.slack)

    def __neg__(self):
        return Value(-self.number, self.slack)


_TOKEN = re.compile(r'(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?P<deg>deg)?|[A-Za-z_]\w*')


class Arithmetic:
    """
    Sums, differences, products, quotients, max() and sqrt() of numbers and dimensions.

    They are read as Python does. `moved` are literals, by their text, with what is added to them.
    """

    def __init__(self, dimensions, moved=None):
        self._moved = moved or {}
        self._known = {'max': max, 'sqrt': _square_root, 'literal': self._literal,
                       **{name: Value(number, mpfr(0)) for name, number in dimensions.items()},
                       'pi': _rounded(gmpy2.const_pi(), mpfr(0))}

    def value(self, text):
        """Return the `Value` of a text."""
        return eval(_code(text), self._known)

    def _literal(self, text, is_in_degrees):
        number = mpfr(float(text)) + self._moved.get(text, 0)
        return _rounded(number * gmpy2.const_pi() / 180, mpfr(0)) if is_in_degrees else Value(
            number, mpfr(0))


@functools.cache
def _code(text):
    return compile(_TOKEN.sub(lambda token: (
        f'literal("{token["number"]}", {bool(token["deg"])})' if token['number'] else token[0]),
        text), text, 'eval')


def _square_root(value):
    root = gmpy2.sqrt(value.number)
    return _rounded(root, value.slack / (2 * root))


def _rounded(number, slack):
    rounding = half_ulp(number) if float(number) != number else mpfr(0)
    return Value(number, slack + rounding)


def half_ulp(number):
    """Return half the distance to the next float64."""
    return mpfr(float(np.spacing(abs(float(number))))) / 2


# --- drawing ------------------------------------------------------------------------------------

class Passing(NamedTuple):
    """
    How a dyad or block on a crank pin passes its change points, if it has any.

    The gap is how much longer its first bar must be to have the change point exactly.
    """

    stretched: bool = False
    folded: bool = False
    side: int = 1
    gap: mpfr = 0


class Drawing(NamedTuple):
    """
    Points by name; gaps, slides and lines by the joint that a line places first.

    Lines are the directions in which something slides. A gap is negative where the line cannot be
    drawn. Folds vanish where a kite or a parallelogram is flat; arms are the distances on which a
    dyad, cylinder, kite, slot or cell stands.
    """

    points: dict
    gaps: dict
    slides: dict
    folds: dict
    arms: dict
    lines: dict


class Linkage:
    """
    The joint lines of a linkage, with its dimensions.

    Parameters
    ----------
    joints : sequence of str
        The lines.
    dimensions : mapping
        The float64 numbers of its dimensions.
    branches : mapping, optional
        Sides by joint, where they are not those written.

    """

    @precisely
    def __init__(self, joints, dimensions, branches=None):
        self.joints = tuple(joints)
        self.dimensions = dict(dimensions)
        self.lines = [read(text) for text in joints]
        self.lines = [line._replace(side=(branches or {}).get(line.names[0], line.side))
                      for line in self.lines]
        self.inputs = [line for line in self.lines if line.word in _INPUTS and not line.geared]
        self.fixed = set()
        for line in self.lines:
            if line.word == 'ground' or line.word in ('image', *LAID) \
                    and self.fixed.issuperset(line.joints):
                self.fixed.add(line.names[0])
        self.cranks = [line.names[0] for line in self.lines
                       if line.word == 'crank' and self.fixed.issuperset(line.joints)]
        self.placed = [name for line in self.lines for name in line.names]
        self.numbers = self.values()
        self.longest = max((abs(number) for line, row in zip(self.lines, self.numbers)
                            for kind, number in zip(line.kinds, row) if kind == 'n'),
                           default=mpfr(1))
        self._drives = self._driven()
        self.driven_names = set(self._drives.values())
        self._links()
        self._stand()
        self.half_angles = {i: self._pin_by_half_angles(line) for i, line in enumerate(self.lines)}

    def values(self, moved=None, literal=None):
        """Return the numbers of every line, with dimensions or literals moved."""
        exact = {name: mpfr(number) for name, number in self.dimensions.items()}
        for name, step in (moved or {}).items():
            exact[name] += step
        arithmetic = Arithmetic(exact, literal)
        return [tuple(arithmetic.value(text).number for text in line.numbers)
                for line in self.lines]

    @precisely
    def roundings(self):
        """Return (line, place, slack) of the numbers whose arithmetic is rounded."""
        arithmetic = Arithmetic({name: mpfr(x) for name, x in self.dimensions.items()})
        return [(i, k, slack) for i, line in enumerate(self.lines)
                for k, text in enumerate(line.numbers)
                for slack in [arithmetic.value(text).slack] if slack]

    def literals(self):
        """Return the texts of numbers that are written in the lines."""
        numbers = {token['number'] for line in self.lines for text in line.numbers
                   for token in _TOKEN.finditer(text)}
        return sorted(text for text in numbers if text and float(text))

    def _driven(self):
        """Return for each input or geared line the name that its input has."""
        driven = {}
        for i, line in enumerate(self.lines):
            if line.word in _INPUTS:
                before = sum(self.lines[k].word == line.word and not self.lines[k].called
                             for k in driven)
                driven[i] = line.called or (f'{line.word}{before + 1}' if before else line.word)
        return driven

    def driven(self, rows, values):
        """Return the angle or length that drives each line, from the values of the inputs."""
        values, angles = iter(values), {}
        for i, name in self._drives.items():
            geared = self.lines[i].geared
            angles[name] = rows[i][-2] * angles[geared] + rows[i][-1] if geared else next(values)
        return {i: angles[name] for i, name in self._drives.items()}

    def geared(self, rows, values):
        """Return (line, slack) of what is geared: half an ulp of the product and of the sum."""
        driven = self.driven(rows, values)
        return [(i, half_ulp(driven[i] - rows[i][-1]) + half_ulp(driven[i]))
                for i in driven if self.lines[i].geared]

    def zero_of(self, centre, pin):
        """Return the bar from which a crank on a link is counted, in a tuple; none for others."""
        line = self.placing(pin)
        return (line.joints,) if line.zero and line.joints[0] == centre else ()

    def _links(self):
        """Note which joints are on one moving link: a line each, from bar to bar."""
        self.bodies = []
        for line in self.lines:
            names, joints = line.names, line.joints
            if line.word in _BARS_TO:
                self.bodies += [[joints[k], names[0]] for k in _BARS_TO[line.word]]
            elif line.word == 'inversor':
                right, corner, left = names
                self.bodies += [[*ends] for side in (right, left) for ends in (
                    (joints[0], side), (joints[1], side), (side, corner))]
            elif line.word == 'block':
                others = [body for body in self.bodies if body[0] == joints[0]
                          and self.placing(body[1]).word == 'block']
                for body in others:
                    body.append(names[0])
                self.bodies += [] if others else [[joints[0], names[0]]]
            elif line.word in LAID and names[0] not in self.fixed:
                self.body_of(*joints).append(names[0])

    def placing(self, name):
        """Return the line that places a joint."""
        return next(line for line in self.lines if name in line.names)

    def line_of_block(self, joint):
        """Return the first joint of the line that has a joint slide: one it places, or a slot."""
        return next(line.names[0] for line in self.lines if line.word in SLIDING and joint == (
            line.joints[1] if line.word == 'slot' else line.names[0]))

    def body_of(self, first, second):
        """Return the joints of the moving link that has both joints, None if there is none."""
        return next((body for body in self.bodies if first in body and second in body), None)

    def _stand(self):
        """Note the closures that each joint stands on, its own among them."""
        self.closures = {}
        closed = ('dyad', 'carriage', 'cylinder', 'block', 'inversor', 'slot', 'slider', 'mirror',
                  'antiparallelogram')
        for line in self.lines:
            joints = line.joints
            if line.word == 'block':
                joints = (*joints, self.line_of_block(joints[0]))
            needs = frozenset().union(*(self.closures[name] for name in joints))
            if line.word in closed:
                needs = needs | {line.names[0]}
            self.closures.update(dict.fromkeys(line.names, needs))

    def base(self, numbers, first, second):
        """Return the length of a bar between two joints of one moving link, from its template."""
        body = self.body_of(first, second)
        return abs(self._template(numbers, body, first) - self._template(numbers, body, second))

    def _template(self, numbers, body, name):
        """Return where a joint lies on the drawing of a link: the first joint at zero, along x."""
        if name == body[0]:
            return mpc(0)
        i = next(i for i, line in enumerate(self.lines) if name in line.names)
        if self.lines[i].word == 'block' and self.lines[i].joints[0] == body[0]:
            return mpc(*numbers[i])
        if name == body[1]:
            return mpc(self._bar(numbers, body[0], name))
        first, second = (self._template(numbers, body, joint) for joint in self.lines[i].joints)
        return LAID[self.lines[i].word](first, second, numbers[i], self.lines[i].side)

    def _bar(self, numbers, first, second):
        """Return the length that is written, or follows, for a bar."""
        i = next(i for i, line in enumerate(self.lines) if second in line.names)
        line = self.lines[i]
        if line.word in ('crank', 'slider', 'cylinder'):
            return numbers[i][0]
        if line.word == 'slot':
            return numbers[i][1]
        if line.word == 'dyad':
            return numbers[i][line.joints.index(first)]
        if line.word == 'inversor':
            return numbers[i][0 if first == line.joints[0] else 1]
        if line.word == 'mirror':
            return self._distance(numbers, line.joints[0], first)
        corner, one, other = line.joints
        return self._distance(numbers, corner, other if first == one else one)

    def _distance(self, numbers, first, second):
        """Return the constant distance of two joints of one link or of the ground."""
        if self.fixed >= {first, second}:
            return abs(self._fixed(numbers, first) - self._fixed(numbers, second))
        return self.base(numbers, first, second)

    def _fixed(self, numbers, name):
        i, line = next((i, line) for i, line in enumerate(self.lines) if name in line.names)
        at = [self._fixed(numbers, joint) for joint in line.joints]
        if line.word == 'ground':
            return mpc(*numbers[i])
        return _reflected(DIGITS, *at)[0] if line.word == 'image' else LAID[line.word](
            *at, numbers[i], line.side)

    def prepared(self, numbers):
        """Return the numbers of every line, those of templates turned into what is laid on."""
        rows = []
        for line, row in zip(self.lines, numbers):
            if line.word in LAID:
                base = self._distance(numbers, *line.joints)
                row = (LAID[line.word](mpc(0), mpc(base), row, line.side) / base,)
            elif line.word == 'slider' and len(row) > 1:
                row = (row[0], DIGITS.turned(row[1]), row[1])
            rows.append(row)
        return rows

    @precisely
    def in_floats(self, way):
        """Return rows and turns for `FLOATS`, lengths in units of the longest, and that unit."""
        unit, rows = self.longest, []
        for line, row in zip(self.lines, self.prepared(self.numbers)):
            if line.word in LAID:
                rows.append((complex(row[0]),))
            elif line.word == 'slider' and len(row) > 1:
                rows.append((float(row[0] / unit), complex(row[1]), float(row[2])))
            else:
                rows.append(tuple(float(number / unit if kind == 'n' else number)
                                  for kind, number in zip(line.kinds, row)))
        turns = {i: float(turn) for i, turn in self.turns(self.numbers, way).items()}
        return rows, turns, float(unit)

    # --- change points ---

    def arm_of_crank(self, line):
        """Return (ground joint, crank pin) if a dyad hangs between these, else None."""
        for foot, pin in (line.joints, line.joints[::-1]):
            if pin in self.cranks and foot in self.fixed and foot != self.placing(pin).joints[0]:
                return foot, pin
        return None

    def _pin_by_half_angles(self, line):
        """Return the crank pin at an arm from the ground, or on a line there; none: empty."""
        if line.word == 'slider' and self.fixed.issuperset(line.joints[1:]):
            return line.joints[0] if line.joints[0] in self.cranks else ''
        if line.word not in ('dyad', 'inversor', 'slot', 'mirror', 'antiparallelogram'):
            return ''
        arm = self.arm_of_crank(line._replace(joints=line.joints[-2:]))
        return arm[1] if arm else ''

    @precisely
    def passings(self):
        """
        Return the ways, {line: `Passing`}, in which the linkage may pass its change points.

        There is one, unless rounding decides whether there is a change point.
        """
        ways = [{}]
        for i, line in enumerate(self.lines):
            choices = self._passing(i, line)
            if choices:
                ways = [{**way, i: choice} for way in ways for choice in choices]
        return ways[:16]

    def _passing(self, i, line):
        if line.word == 'dyad' and self.arm_of_crank(line):
            foot, pin = self.arm_of_crank(line)
            crank = self.placing(pin)
            ground = abs(self._fixed(self.numbers, crank.joints[0])
                         - self._fixed(self.numbers, foot))
            m = self.numbers[self.lines.index(crank)][0]
            b, c = self.numbers[i]
            size = b + c + ground + m
            gaps = ground + m - b - c, abs(ground - m) - abs(b - c)
            unsure = abs(gmpy2.cos(self._turn(self.numbers, i))) < ROUNDING
        elif line.word == 'slider' and line.joints[0] in self.cranks \
                and self.fixed.issuperset(line.joints[1:]):
            crank = self.placing(line.joints[0])
            m = self.numbers[self.lines.index(crank)][0]
            rod, line_of = self.numbers[i][0], self._rail(self.numbers, i)
            away = (self._fixed(self.numbers, crank.joints[0])
                    - self._fixed(self.numbers, line.joints[1]))
            height = (away * line_of.conjugate()).imag
            size = rod + abs(away) + m
            gaps = rod + height - m, rod - height - m
            unsure = gmpy2.const_pi() - abs(self._turn(self.numbers, i)) < ROUNDING
        else:
            return []
        stretched, folded = (_vanishes(gap, size) for gap in gaps)
        if stretched == folded == [False]:
            return []
        sides = [1, -1] if unsure else [1]
        return [Passing(s, f, side, max(abs(gap) for gap, passed in zip(gaps, (s, f)) if passed)
                        if s or f else mpfr(0))
                for s in stretched for f in folded for side in (sides if s or f else [1])]

    def _turn(self, numbers, i):
        """Return the angle of the crank's zero from the ground line, foot to centre, or a rail."""
        line = self.lines[i]
        if line.word == 'slider':
            pin, along = line.joints[0], self._rail(numbers, i)
        else:
            foot, pin = self.arm_of_crank(line)
            along = self._fixed(numbers, self.placing(pin).joints[0]) - self._fixed(numbers, foot)
        return DIGITS.direction(self._zero(numbers, self.placing(pin)) * along.conjugate())

    def _zero(self, numbers, crank):
        """Return the direction from which a crank of the ground is counted."""
        if crank.zero:
            return self._direction(numbers, *crank.joints)
        return mpc(0, 1) if crank.up else mpc(1)

    def _rail(self, numbers, i):
        """Return the direction of the line on the ground that a block slides on."""
        _, *joints = self.lines[i].joints
        return self._direction(numbers, *joints) if joints[1:] else DIGITS.turned(numbers[i][1])

    def _direction(self, numbers, first, second):
        away = self._fixed(numbers, second) - self._fixed(numbers, first)
        return away / abs(away)

    def turns(self, numbers, way):
        """Return the angles from which the passes of change points are counted."""
        return {i: self._turn(numbers, i) for i in way}


def _vanishes(gap, size):
    if gap == 0:
        return [True]
    return [True, False] if abs(gap) < ROUNDING * size else [False]


def meet(do, p, radius_p, q, radius_q, side):
    """
    Return where two circles meet, on a side of p -> q, and how far they are from touching.

    That is the squared sine of the angle at which they meet; where they do not it is negative.
    """
    meeting, square = _corner_of(do, p, radius_p, q, radius_q, side)
    return meeting, square / (radius_p * radius_q) ** 2


def _corner_of(do, p, radius_p, q, radius_q, side):
    """Return a corner of a triangle, and its squared area times four, negative without one."""
    arm = q - p
    across = arm.real * arm.real + arm.imag * arm.imag
    along = (across + (radius_p * radius_p - radius_q * radius_q)) / 2
    square = radius_p * radius_p * across - along * along
    meeting = arm * along + 1j * arm * (side * do.root(square))
    return p + do.divided(meeting, across), square


# The words for a point of a link, and where on the drawing of the link its numbers put it.
LAID = {
    'rigid': lambda p, q, row, side: meet(DIGITS, p, row[0], q, row[1], side)[0],
    'line': lambda p, q, row, _: p + (q - p) / abs(q - p) * row[0]}


def draw(do, linkage, rows, values, way=None, turns=None, moved=None):
    """
    Return the `Drawing` of a linkage.

    `rows` are its numbers as `prepared`, `values` those of its inputs, `way` how it passes its
    change points, `moved` what is added to joints. The pin of a crank is so moved only for what is
    drawn from its coordinates, not on an arm from the ground to it.
    """
    way, moved = way or {}, moved or {}
    points, gaps, slides, folds, arms, lines = {}, {}, {}, {}, {}, {}
    driven = linkage.driven(rows, values)
    angle_of, pins = {}, {}
    for i, (line, row) in enumerate(zip(linkage.lines, rows)):
        word, name, at = line.word, line.names[0], [
            pins[joint] if joint == linkage.half_angles[i] else points[joint]
            for joint in line.joints]
        side = line.side
        if word == 'ground':
            points[name] = do.point(*row)
        elif word == 'crank':
            angle_of[name] = driven[i]
            bar = do.turned(driven[i]) * row[0]
            if line.zero:
                bar = bar * _unit(do, at[1] - at[0])
            points[name] = at[0] + (1j * bar if line.up else bar)
        elif word == 'cylinder':
            slides[name] = length = driven[i]
            points[name], square = _corner_of(do, at[0], length, at[1], row[0], side)
            # A length is not negative, even where circles meet.
            gaps[name] = do.least(square / row[0] ** 3, length)
            arms[name] = abs(at[1] - at[0])
            lines[name] = do.divided(points[name] - at[0], length)
        elif word == 'carriage':
            slides[name], lines[name] = driven[i], _unit(do, at[1] - at[0])
            points[name] = at[0] + lines[name] * driven[i]
            # It has no place beyond its way.
            gaps[name] = do.least(driven[i] - row[0], row[1] - driven[i])
        elif word == 'yoke':
            lines[name] = _unit(do, at[2] - at[1])
            slides[name] = ((at[0] - at[1]) * lines[name].conjugate()).real
            points[name] = at[1] + lines[name] * slides[name]
        elif word == 'block':
            on = linkage.line_of_block(line.joints[0])
            points[name] = at[0] + lines[on] * do.point(*row)
            if linkage.placing(on).word == 'cylinder':  # of no length it has no direction
                arms[name] = abs(slides[on])
        elif word == 'dyad':
            if i in way:
                pin = linkage.arm_of_crank(line)[1]
                side = side * _passes(
                    do, way[i], angle_of[pin] + turns[i], do.pi() / 2 + turns[i], 0.0)
            points[name], gaps[name] = meet(do, at[0], row[0], at[1], row[1], side)
            arms[name] = abs(at[1] - at[0])
        elif word in LAID:
            points[name] = at[0] + (at[1] - at[0]) * row[0]
        elif word == 'image':
            points[name], _ = _reflected(do, *at)
        elif word == 'mirror':
            points[name], folds[name] = _reflected(do, *at)
            arms[name] = abs(at[2] - at[1])
        elif word == 'antiparallelogram':
            arm, middle = at[2] - at[1], (at[1] + at[2]) / 2
            ratio = do.divided(at[0] - middle, arm)
            points[name] = middle - arm * ratio.conjugate()
            folds[name] = ratio.imag
            arms[name] = abs(arm)
        elif word == 'parallelogram':
            points[name] = at[1] + (at[2] - at[0])
            folds[name] = ((at[1] - at[0]).conjugate() * (at[2] - at[0])).imag
        elif word == 'inversor':
            right, corner, left = line.names
            points[right], gaps[name] = meet(do, at[0], row[0], at[1], row[1], -1)
            points[left], _ = meet(do, at[0], row[0], at[1], row[1], 1)
            points[corner] = points[right] + (points[left] - at[1])
            arms[name] = abs(at[1] - at[0])
        elif word == 'slot':
            points[name], gaps[name], slides[name], arms[name] = _slot(do, *at, row, side)
            lines[name] = (points[name] - at[0]) / row[1]
        else:
            if i in way:
                side = side * _passes(
                    do, way[i], angle_of[line.joints[0]] + turns[i], 0.0, -do.pi() / 2)
            lines[name] = along = row[1] if len(row) > 1 else _unit(do, at[2] - at[1])
            seen = (at[0] - at[1]) * along.conjugate()
            square = row[0] * row[0] - seen.imag * seen.imag
            gaps[name] = square / (row[0] * row[0])
            slides[name] = seen.real + side * do.root(square)
            points[name] = at[1] + along * slides[name]
        if name in linkage.cranks:
            pins[name] = points[name]
        for each in line.names:
            if each in moved:
                points[each] = points[each] + moved[each]
                if word in ('slider', 'yoke'):
                    slides[name] = ((points[each] - at[1]) * lines[name].conjugate()).real
    return Drawing({**points, **pins}, gaps, slides, folds, arms, lines)


def _reflected(do, point, first, second):
    """Return a point's image in the line of two others, and how far it was from that."""
    arm = second - first
    ratio = do.divided(point - first, arm)
    return first + arm * ratio.conjugate(), ratio.imag


def _unit(do, vector):
    return do.divided(vector, abs(vector))


def _slot(do, pivot, pin, row, side):
    """Turn the radius to the pin back by the angle at which the slot leans on it."""
    offset, length = row
    radius = pin - pivot
    square = radius.real * radius.real + radius.imag * radius.imag
    slide = side * do.root(square - offset * offset)
    lean = do.direction(1j * offset + slide)
    lever = do.divided(radius, abs(radius)) * do.turned(-lean)
    return pivot + lever * length, square - offset * offset, slide, abs(radius)


def _passes(do, passing, now, start, stretched):
    """Return the side after the way of an angle from its start, given where it is stretched."""
    side, turn = passing.side, 2 * do.pi()
    for passed, at in ((passing.stretched, stretched), (passing.folded, stretched + do.pi())):
        if passed:
            count = do.floor((now - at) / turn) - do.floor((start - at) / turn)
            side = side * (1 - 2 * (count - 2 * do.floor(count / 2)))
    return side
