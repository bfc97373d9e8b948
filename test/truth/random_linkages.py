# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Random linkages of every word of the language, a third of them nearly degenerate.

A line is a form of `LINES` or `INPUTS` with joints, numbers and sides at random. It is used if the
library accepts it and its drawing has a pose at some of two dozen random inputs. The degenerate
is made on purpose: equal bars by one name or one number, change points, sums and differences of
lengths, offsets of zero, and all that but for a rounding or a little more.
"""

from contextlib import suppress
from functools import cache
import math
import re
from typing import NamedTuple

from linkage_ros import mechanisms
import numpy as np

from .drawing import draw, FLOATS, Linkage, SLIDING

DEGENERATE = 0.35
RIGHT_ANGLES = 0.0, math.pi, -math.pi, math.pi / 2, -math.pi / 2
# How far from exactly degenerate.
NEAR = (0.0, 0.0, 0.0, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9)
# Lines, and how often they are tried: 0 and 1 are any joints, a and b joints of one link, of which
# a has a bar to c; x slides; f, g and h are on the ground; l and m are lengths, s and t may be
# negative.
LINES = {
    'dyad {0} {1} {l} {m} {side}': 18, 'rigid {a} {b} {l} {m} {side}': 8, 'line {a} {b} {s}': 4,
    'mirror {a} {b} {c}': 4, 'parallelogram {a} {b} {c}': 3, 'antiparallelogram {a} {b} {c}': 2,
    'inversor {0} {1} {l} {m}': 4, 'slot {0} {1} {s} {half} {m}': 4,
    'slider {0} {l} {f} {angle} {half}': 5, 'slider {0} {l} {a} along {b} {half}': 3,
    'yoke {0} {a} along {b}': 3, 'block {x} {s} {t}': 3, 'image {f} {g} {h}': 3,
    'crank {f} {l} geared {drive} {ratio} {turn}': 1,
    'crank {a} {l} zero {b} geared {drive} {ratio} {turn}': 1,
    'cylinder {0} {1} {l} {side} geared {drive} {ratio} {s}': 6,
    'carriage {a} along {b} {s} {m} geared {drive} {ratio} {s}': 3}
INPUTS = {'crank {f} {l}': 8, 'crank {f} {l} up': 3, 'crank {a} {l} zero {b}': 4,
          'cylinder {0} {1} {l} {side}': 5, 'carriage {a} along {b} {s} {m}': 7}
# What a first crank can carry that lies flat at times, or always.
FOLDS = ('dyad {A} {Q} {g} {k} {side}', 'dyad {A} {Q} {l} {g}+{k}-{l} {side}',
         'dyad {Q} {A} {l} {l}+{g}-{k} {side}', 'dyad {Q} {A} {l} {l} {side}',
         'antiparallelogram {O} {A} {Q}', 'mirror {O} {A} {Q}')
CHOICES = {'side': ('left', 'right'), 'half': ('out', 'in'), 'turn': ('0', '0.3', '-1.7'),
           'angle': ('0', '1.5707963267948966', '3.141592653589793', '-1.5707963267948966', '0.7',
                     '-2.9'),
           'ratio': ('1', '-1', '-2', '2', '0.5', '-0.5', '1.618', '-1.4142135623730951')}
WORDS = {form.split()[0] for form in (*LINES, *INPUTS)}
TRIES = 40
DRIVEN = 'crank', 'cylinder', 'carriage'
# Stands for a joint of which there are too few.
MISSING = '?'


class Design(NamedTuple):
    """A linkage written down: its lines, the numbers of its dimensions, its sides by joint."""

    joints: tuple
    dimensions: dict
    branches: dict

    def linkage(self):
        """Return it as the library has it."""
        return mechanisms.create('custom', joints=self.joints, branches=self.branches,
                                 **self.dimensions)

    def __str__(self):
        lines = ', '.join(map(repr, self.joints))
        given = ''.join(f', {name}={number!r}' for name, number in self.dimensions.items())
        sides = f', branches={self.branches!r}' if self.branches else ''
        return f'C({lines}{given}{sides})'


def design(rng, without=()):
    """Return a random `Design`, in which some words may not come up."""
    writer, inputs = _Writer(rng), int(rng.choice((1, 1, 1, 1, 2, 3)))
    writer.start(inputs)
    for _ in range(inputs - writer.inputs):
        writer.add(INPUTS)
    lines = {form: often for form, often in LINES.items() if form.split()[0] not in without}
    for _ in range(int(rng.integers(2, 10))):
        writer.add(lines)
    return writer.written()


def equal_bars(rng):
    """Return a random `Design` of one input, all of whose lengths are of a few equal ones."""
    writer = _EqualBars(rng)
    writer.add(INPUTS)
    for _ in range(4):
        writer.add(LINES)
    return Design(tuple(writer.lines), writer.dimensions, {})


def given(rng, count, spots, inputs):
    """Return values of inputs, (count, inputs); `spots` of the first are asked for more often."""
    spots = [spots, *([] for _ in inputs[1:])]
    return np.array([[_angle(rng, [*RIGHT_ANGLES, *near]) if input_.is_angle
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


def chosen(rng, weights):
    """Return a text at random, given how often each comes up."""
    share = np.array(list(weights.values()), float)
    return str(rng.choice(list(weights), p=share / share.sum()))


def holds(rng, joints, dimensions):
    """
    Tell whether lines are a linkage that has a pose at some of two dozen random inputs.

    In nine of ten poses no arm of the drawing may be nothing but rounding. What is flat in all of
    them has no rates.
    """
    linkage, every = Linkage(joints, dimensions), np.ones(24)
    rows, turns, unit = linkage.in_floats({})
    values = [rng.uniform(*_ends(line, row), 24) for line, row in zip(linkage.lines, rows)
              if line.word in DRIVEN and not line.geared]
    with np.errstate(all='ignore'):
        drawn = draw(FLOATS, linkage, rows, values, {}, turns)
    held = np.all([gap * every > -1e-6 for gap in (1.0, *drawn.gaps.values())], axis=0)
    apart = np.all([arm * every > 1e-6 for arm in (1.0, *drawn.arms.values())], axis=0)
    flat = any(np.all(np.abs(gap * every)[held] < 1e-9) for gap in drawn.gaps.values())
    if flat or held.sum() < 3 or np.sum(held & apart) < 0.9 * held.sum():
        return False
    with suppress(ValueError):
        return bool(Design(joints, dimensions, {}).linkage())
    return False


def _ends(line, row):
    """Return between which values an input is, a length in longest bars."""
    return {'crank': (-math.pi, math.pi), 'cylinder': (0.0, 2.0)}.get(line.word, sorted(row))


class _Writer:
    """A linkage that is being written."""

    def __init__(self, rng):
        self._rng, self.inputs = rng, 0
        self.lines, self.dimensions = [], {}
        self._letters = iter('ABCDEFGHJKLMNPQRSTUVWXYZ')
        self._joints, self._lengths = [], []
        self._degenerate = rng.random() < DEGENERATE
        self._literal = rng.choice((0.0, 0.0, 0.3, 1.0))
        self._is_near = False
        self._size = 1.0
        if rng.random() < 0.15:
            self._size = 10.0 ** int(rng.choice((-26, -20, -6, 6, 20, 26)))
            if abs(math.log10(self._size)) > 10:
                self._literal = 0.0

    def written(self):
        """Return the `Design`."""
        branches = {line.split()[0]: int(self._rng.choice((-1, 1))) for line in self.lines
                    if line.split()[1] in ('dyad', 'cylinder', 'slot', 'slider')
                    and self._rng.random() < 0.1}
        return Design(tuple(self.lines), self.dimensions, branches)

    def start(self, inputs):
        """Add the ground, and what folds flat on a first crank if it is to be degenerate."""
        if self._degenerate and self._rng.random() < 0.5:
            self._fold()
        missing = int(self._rng.integers(2, 4)) + inputs - 1 - len(self._joints) // 2
        while missing > 0:
            text = f'ground {self._coordinate()} {self._coordinate()}'
            if not any(line.endswith(text) for line in self.lines):
                self._append([self._name()], text)
                missing -= 1

    def _fold(self):
        ground = self._number()
        crank = self._nudged(ground) if self._rng.random() < 0.4 else self._number()
        names = dict(zip('OQAB', (self._name() for _ in 'OQAB')))
        place = self._rng.choice(('{} 0', '-{} 0', '0 {}', '0 -{}'))
        self._append([names['O']], 'ground 0 0')
        self._append([names['Q']], 'ground ' + place.format(ground))
        self._append([names['A']], f'crank {names["O"]} {crank}' + self._rng.choice(('', ' up')))
        self.inputs = 1
        known = {**names, 'g': lambda: self._nudged(ground), 'k': lambda: self._nudged(crank),
                 'l': cache(self._number)}
        self._try([names['B']], self._rng.choice(FOLDS), Linkage(
            self.lines, self.dimensions), known)

    def add(self, forms):
        """Add one of some lines, if one of many tries is a linkage that has a pose."""
        name, linkage = self._name(), Linkage(self.lines, self.dimensions)
        for _ in range(TRIES):
            form = chosen(self._rng, forms)
            names = [name, f'{name}b', f'{name}c'] if form.startswith('inversor') else [name]
            if self._try(names, form, linkage, {}):
                self.inputs += form in INPUTS
                return

    def _try(self, names, form, linkage, known):
        before = dict(self.dimensions), list(self._lengths)
        known = {**self._picked(linkage), **known}
        text = re.sub(r'\{(\w+)\}', lambda match: self._filled(match[1], known), form)
        if form.startswith(DRIVEN) and len(linkage.driven_names) == 1:
            text += ' called drive'
        lines = [*self.lines, ' '.join([*names, text])]
        if MISSING in text or not self._moves(form, text) or not holds(
                self._rng, lines, self.dimensions):
            self.dimensions, self._lengths = before
            return False
        self._append(names, text)
        return True

    def _picked(self, linkage):
        """Return joints and an input at random by what a form calls them."""
        rng, fixed = self._rng, sorted(linkage.fixed)
        bodies = [body for body in (*linkage.bodies, fixed) if len(body) > 1]
        first, second, *_ = rng.permutation(bodies[rng.integers(len(bodies))])
        third = {joint for body in bodies if first in body for joint in body} - {first, second}
        slide = [line.joints[1] if line.word == 'slot' else line.names[0]
                 for line in linkage.lines if line.word in SLIDING]

        def some(names):
            return rng.choice(sorted(names)) if names else MISSING

        picked = zip(('drive', *'abcx01fgh'), (
            some(linkage.driven_names), first, second, some(third), some(slide),
            *rng.permutation(linkage.placed)[:2], *rng.permutation(fixed)[:3]))
        return {key: str(joint) for key, joint in picked}

    def _moves(self, form, text):
        """Tell whether a line may move, or is an image, of which only the ground has any."""
        fixed = {line.split()[0] for line in self.lines if line.split()[1] in ('ground', 'image')}
        return form in INPUTS or 'geared' in form or form.startswith('image') or any(
            joint in text.split() for joint in self._joints if joint not in fixed)

    def _append(self, names, text):
        self.lines.append(f'{" ".join(names)} {text}')
        self._joints += names

    def _name(self):
        name = next(self._letters)
        return name if self._rng.random() < 0.8 else f'{name}_{name.lower()}1'

    def _filled(self, key, known):
        """Return what a line says in a place."""
        if key in known:
            return known[key]() if callable(known[key]) else known[key]
        if key in CHOICES:
            return str(self._rng.choice(CHOICES[key]))
        return self._number() if key in 'lm' else self._coordinate() if key in 'st' else MISSING

    # --- numbers ---

    def _coordinate(self):
        if self._rng.random() < (0.5 if self._degenerate else 0.2):
            return '0'
        text = self._number()
        return text if self._rng.random() < 0.5 or '+' in text else f'-{text}'

    def _number(self):
        """Return the text of a length: a number, a dimension, or arithmetic on one."""
        rng, known = self._rng, self._lengths
        if known and rng.random() < (0.5 if self._degenerate else 0.1):
            text = str(rng.choice(known))
            form = rng.choice(('', '', '', '2*', '+'))
            return (self._nudged(text) if not form else f'2*{text}' if form == '2*'
                    else f'{text}+{rng.choice(known)}')
        value = math.exp(rng.uniform(math.log(0.2), math.log(3.0)))
        if rng.random() < self._literal:
            text = repr(round(value * self._size, int(rng.integers(1, 17))
                              - math.floor(math.log10(value * self._size))))
        elif self.dimensions and rng.random() < 0.15:
            name, factor = rng.choice(list(self.dimensions)), f'{value:.3g}'
            return str(rng.choice((f'{factor}*{name}', f'{name}*{factor}', f'{name}/{factor}')))
        else:
            text = self._dimension(value * self._size)
        self._lengths.append(text)
        return text

    def _dimension(self, value):
        name = f'd{len(self.dimensions)}'
        self.dimensions[name] = float(value)
        return name

    def _nudged(self, text):
        """Return a text for the same number or, once, one very near it."""
        step = self._rng.choice(NEAR)
        if step == 0.0 or self._is_near:
            return text
        self._is_near = True
        value = eval(text, dict(self.dimensions))
        return self._dimension(value * (1.0 + self._rng.choice((-1, 1)) * step))


class _EqualBars(_Writer):
    """A linkage on a grid: cranks are as long as the ground, and joints coincide."""

    LENGTHS = {'a': 6, 'b': 2, 'a+b': 1, '2*a': 2}

    def __init__(self, rng):
        super().__init__(rng)
        unit = 10.0 ** int(rng.choice((-28, -9, 0, 0, 0, 0, 0, 9, 28)))
        self.dimensions = {'a': float(rng.choice((1.0, 0.3, 0.7))) * unit,
                           'b': float(rng.choice((1.0, 0.4, 2.5))) * unit}
        place = rng.choice(('a 0', '-a 0', '0 a', 'a a', '-a a'))
        self._append([self._name()], 'ground 0 0')
        self._append([self._name()], f'ground {place}')

    def _number(self):
        return chosen(self._rng, self.LENGTHS)
