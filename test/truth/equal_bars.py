# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The limits of poses of equal bars, from both sides."""

from functools import partial
import math
from typing import NamedTuple

from gmpy2 import mpc, mpfr
import numpy as np

from . import drawing_accuracy
from .drawing import DIGITS, draw, precisely
from .drawing_accuracy import error_of, true_value
from .linkage_checks import checked, spots

# How far from a value its sides are; limits that differ by less are equal; arms below it vanish.
SIDE, EQUAL, NONE = mpfr(2) ** -150, mpfr(2) ** -50, mpfr(2) ** -280
# What special values are asked with, and the largest error of a limit: of an angle [rad], or in
# longest bars.
STEPS = [0.0, *(sign * step for step in (1e-3, 1e-12, 1e-160, 1e-200, 5e-324) for sign in (1, -1))]
CLOSE = 1e-9


class Limits(NamedTuple):
    """
    The pose next to a value of the input, in many digits.

    `before` and `after` have each output as a complex number, None where it cannot be assembled;
    `vanishing` are the joints whose lines are drawn on an arm that vanishes at the value.
    """

    before: list | None
    after: list | None
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
    value = mpc(true_value(out, drawn))
    return value / (abs(value) or 1) if out.what == 'angle' else value


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
        inputs = [value, *subject.held] if subject.held else value
        angles = mechanism.joint_angles(inputs)
        alone = {'point': mechanism.solve(inputs), 'angle': angles, 'slide': angles}
        limits_ = limits(subject, value)
        sides = [side for side in (limits_.before, limits_.after) if side]
        for k, out in enumerate(poses):
            result, single = answers[out][i], alone[out.what][out.name]
            unit = mechanism.longest if out.what != 'angle' else 1.0
            text = f'{out} at {value!r} is {result}'
            if np.isinf(result).any() or np.isinf(single).any():
                yield 'infinite', text
            if not np.array_equal(np.isnan(result), np.isnan(single)):
                yield 'in an array only', f'{single}, {text}'
            hung = limits_.vanishing & out.needs
            if not hung or len(sides) < 2 or not all(
                    linkage.half_angles[linkage.lines.index(linkage.placing(name))]
                    for name in hung):
                continue
            agree = limits_.agree(k, unit)
            # A joint is nowhere if one that it stands on is.
            whole = all(limits_.agree(n, mechanism.longest) for n, each in enumerate(poses)
                        if each.what == 'point' and each.needs <= out.needs)
            if np.isnan(result).any():
                if agree and whole:
                    yield 'no limit', f'{text}, not {complex(sides[0][k])}'
            elif min(map(precisely(partial(error_of, out, result)), (
                    side[k] for side in sides))) > CLOSE * unit:
                yield 'wrong', f'{text}, not {complex(sides[0][k])}'
            elif not agree and value == 0.0:
                yield 'a number where the sides differ', text
