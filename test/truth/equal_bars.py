# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Random linkages of equal bars, and the limits of their poses from both sides.

All lengths are one of two numbers, their sum or their difference, and all joints of the ground lie
on such a grid: cranks are as long as the ground, dyads have equal bars, and joints coincide.
"""

from functools import partial
import math
from typing import NamedTuple, Optional

from gmpy2 import mpc, mpfr
from linkage_ros import mechanisms
import numpy as np

from . import drawing_accuracy
from .drawing import DIGITS, draw, FLOATS, Linkage, precisely
from .drawing_accuracy import error_of, turned_bar
from .linkage_checks import checked, spots
from .random_linkages import Design, INPUTS

# How far from a value its sides are; limits that differ by less are equal; arms below it vanish.
SIDE, EQUAL, NONE = mpfr(2) ** -150, mpfr(2) ** -50, mpfr(2) ** -280
# What special values are asked with, and the largest error of a limit: of an angle [rad], or in
# longest bars.
STEPS = [0.0, *(sign * step for step in (1e-3, 1e-12, 1e-160, 1e-200, 5e-324)
                for sign in (1, -1))]
CLOSE = 1e-9
# Lengths by their text, with how often each is drawn.
LENGTHS = {'a': 6, 'b': 2, 'a+b': 1, '2*a': 2}
LINES = {
    'dyad {0} {1} {l} {l} {side}': 8, 'dyad {0} {1} {l} {m} {side}': 2, 'mirror {0} {1} {2}': 3,
    'parallelogram {0} {1} {2}': 2, 'antiparallelogram {0} {1} {2}': 1,
    'rigid {0} {1} {l} {l} {side}': 1, 'line {0} {1} {l}': 1, 'slot {0} {1} 0 {half} {l}': 1,
    'slider {0} {l} {1} {angle} {half}': 3, 'slider {0} {l} {1} along {2} {half}': 1,
    'yoke {0} {1} along {2}': 1, 'block {0} {l} 0': 1, 'inversor {0} {1} {l} {m}': 1,
    'crank {0} {l} geared crank {ratio} 0': 1, 'crank {0} {l} zero {1} geared crank {ratio} 0': 1}
STARTS = {'crank O {l}': 6, 'crank O {l} up': 1, 'crank O {l} zero Q': 1,
          'cylinder O Q {l} {side}': 1, 'carriage O along Q -{l} {l}': 1,
          'carriage O along Q 0 {l}': 1}
CHOICES = {'side': ('left', 'right'), 'half': ('out', 'in'), 'angle': ('0', '90deg', '45deg'),
           'ratio': ('1', '-1', '2', '0.5')}


def design(rng, lines=4):
    """Return a random `Design` of equal bars with one input; every line of it is allowed."""
    unit = 10.0 ** int(rng.choice((-28, -9, 0, 0, 0, 0, 0, 9, 28)))
    dimensions = {'a': float(rng.choice((1.0, 0.3, 0.7))) * unit,
                  'b': float(rng.choice((1.0, 0.4, 2.5))) * unit}
    ground = [(x, y) for x in ('0', 'a', '-a') for y in ('0', '0', 'a') if (x, y) != ('0', '0')]
    joints = ['O ground 0 0', 'Q ground {} {}'.format(*ground[rng.integers(len(ground))])]
    names = ['O', 'Q']
    for i in range(lines + 1):
        for _ in range(40):
            name = f'X{i}'
            text = _line(rng, _chosen(rng, LINES if i else STARTS), names)
            new = [name, f'{name}b', f'{name}c'] if text.startswith('inversor') else [name]
            line = f'{" ".join(new)} {text}'
            if _is_allowed([*joints, line], dimensions):
                joints.append(line)
                names += new
                break
    return Design(tuple(joints), dimensions, {})


def _is_allowed(joints, dimensions):
    """Tell whether lines are a linkage, some pose of which has no arm of nothing but rounding."""
    try:
        first, = mechanisms.create('custom', joints=joints, **dimensions).inputs
    except ValueError:
        return False
    linkage = Linkage(joints, dimensions)
    rows, turns, unit = linkage.in_floats({})
    values = np.linspace(first.low, first.high, 25)[1:-1] / (1.0 if first.turns else unit)
    with np.errstate(all='ignore'):
        drawn = draw(FLOATS, linkage, rows, [values], {}, turns)
        held = np.all([gap > -1e-6 + 0.0 * values for gap in (1.0, *drawn.gaps.values())], axis=0)
        apart = np.all([arm > 1e-6 + 0.0 * values for arm in (1.0, *drawn.arms.values())], axis=0)
    last, = linkage.lines[-1:]
    moves = last.word in INPUTS or not linkage.fixed.issuperset(last.joints)
    return bool(moves and np.sum(held & apart) > 0.9 * np.sum(held))


def _chosen(rng, weights):
    share = np.array(list(weights.values()), float)
    return str(rng.choice(list(weights), p=share / share.sum()))


def _line(rng, form, names):
    picked = rng.permutation(names)[[0, 1, min(2, len(names) - 1)]]
    given = {key: str(rng.choice(values)) for key, values in CHOICES.items()}
    return form.format(*picked, l=_chosen(rng, LENGTHS), m=_chosen(rng, LENGTHS), **given)


class Limits(NamedTuple):
    """
    The pose next to a value of the input, in many digits.

    `before` and `after` have each output as a complex number, None where it cannot be assembled;
    `vanishing` are the joints whose lines are drawn on an arm that vanishes at the value.
    """

    before: Optional[list]
    after: Optional[list]
    vanishing: frozenset

    def agree(self, i, size):
        """Tell whether both limits of an output are the same."""
        one, other = self.before[i], self.after[i]
        return abs(one - other) <= EQUAL * max(abs(one), abs(other), size)


@precisely
def limits(subject, value: float) -> Limits:
    """Return the limits of outputs at a value of the first input from both sides."""
    linkage, way = subject.linkage, subject.ways[0]
    rows, turns = linkage.prepared(linkage.numbers), linkage.turns(linkage.numbers, way)
    unit = 1 if subject.turns else linkage.longest
    drawn = [draw(DIGITS, linkage, rows, [
        mpfr(value) + side * SIDE * unit, *map(mpfr, subject.held)], way, turns)
        for side in (-1, 0, 1)]
    sides = [None if any(gap < 0 for gap in each.gaps.values())
             else [_pose(out, each) for out in subject.poses] for each in drawn[::2]]
    return Limits(*sides, frozenset(
        name for name, arm in drawn[1].arms.items() if arm < NONE * linkage.longest))


def _pose(out, drawn):
    if out.what == 'point':
        return drawn.points[out.name]
    if out.what == 'slide':
        return mpc(drawn.slides[out.parts[0][0]])
    bar = turned_bar(out, drawn)
    return bar * mpc(0, -1) ** out.quarters / (abs(bar) or 1)


@checked
def limited(subject):
    """
    Yield what does not hold next to the special values of the first input.

    Nothing is infinite, and one pose is that of an array. Where an arm of the construction has no
    length, on which a joint stands: if it goes from the ground to the pin of a crank, the joint
    has the limit if both sides agree, and is NaN if not. On other arms, whose zero only
    coordinates tell, it has no place there.
    """
    mechanism, linkage, poses = subject.mechanism, subject.linkage, subject.poses
    at = {0.0, *spots(subject), *(0.5 * math.pi * k for k in (-2, -1, 1, 2) if subject.turns)}
    values = np.unique([spot + step * subject.inputs[0].size for spot in at for step in STEPS])
    answers = drawing_accuracy.answers(
        mechanism, np.array([[value, *subject.held] for value in values]), poses)
    for i, value in enumerate(values.tolist()):
        given = [value, *subject.held] if subject.held else value
        angles = mechanism.joint_angles(given)
        alone = {'point': mechanism.solve(given), 'angle': angles, 'slide': angles}
        near = limits(subject, value)
        sides = [side for side in (near.before, near.after) if side]
        for k, out in enumerate(poses):
            found, single = answers[out][i], alone[out.what][out.name]
            unit = mechanism.longest if out.what != 'angle' else 1.0
            text = f'{out} at {value!r} is {found}'
            if np.isinf(found).any() or np.isinf(single).any():
                yield 'infinite', text
            if not np.array_equal(np.isnan(found), np.isnan(single)):
                yield 'in an array only', f'{single}, {text}'
            hung = near.vanishing & out.needs
            if not hung or len(sides) < 2 or not all(
                    linkage.half_angles[linkage.lines.index(linkage.placing(name))]
                    for name in hung):
                continue
            agree = near.agree(k, unit)
            # A joint is nowhere if one that it stands on is.
            whole = all(near.agree(n, mechanism.longest) for n, each in enumerate(poses)
                        if each.what == 'point' and each.needs <= out.needs)
            if np.isnan(found).any():
                if agree and whole:
                    yield 'no limit', f'{text}, not {complex(sides[0][k])}'
            elif min(map(precisely(partial(error_of, out, found)), (
                    side[k] for side in sides))) > CLOSE * unit:
                yield 'wrong', f'{text}, not {complex(sides[0][k])}'
            elif not agree and value == 0.0:
                yield 'a number where the sides differ', text
