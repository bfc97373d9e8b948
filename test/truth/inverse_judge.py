# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
A judge of inverses: poses alone decide, sampled and bisected, without the code of the inverse.

A question is a pose, and an output's value there. It is lost if no answer is at that pose; an
answer is invented if its own pose has another value, and a duplicate if it is next to another.
"""

from collections import Counter
import copy
import math

from linkage_ros.linkage import Solution
import numpy as np

# Distances of questions from ends, extremes and dead points [rad, sizes].
AWAY = 1e-12, 1e-9, 1e-6, 1e-3
# An answer at a pose is no farther from it; ends and extremes have a larger one, since a value
# within 1e-13 of theirs is theirs.
AT, NEXT = 1e-7, 3e-5
# Error of an answer in units of the rule: half an ulp of the output's size, and of the input
# times the rate; what is beyond MOST is invented. Next to a special input 1e-9 of the size is
# allowed, and what 64 ulps of the input change.
MOST, ALLOWED = 64.0, 1e-9
# Samples of the range of an input, and steps of a bisection.
SAMPLES, STEPS = 721, 60
# Ends, extremes and dead points of an output that are questions, at most.
SPECIALS = 30
# Random poses of several inputs, of which the first that can be assembled are questions.
TRIES = 50
SIDES = np.array([-1.0, 1.0])
KINDS = 'ordinary', 'next to ends', 'ends', 'extremes', 'dead points'
# The rule says nothing where the next floats change the output by more than this, and of several
# inputs nothing where the margin is less.
SINGULAR = 1e-6
# An output that changes by less than ALLOWED over so much of its input stands still [sizes].
STILL = 1e-3


class Output:
    """An output over the first input, by poses; the other inputs are fixed."""

    def __init__(self, linkage, name, others=()):
        self.linkage, self.name, self.others = linkage, name, others
        self.first, self._pose = linkage.inputs[0], linkage.compiled('checked', (name,))
        self.size = 1.0 if linkage.is_angle(name) else linkage.longest
        own = name == self.first.name
        self.period = math.inf if not linkage.is_angle(name) else (
            math.tau if not own else self.first.turn if self.first.wraps else math.inf)
        low, high = self.first.low, self.first.high
        # Few of many turns: the judge is slow.
        turns = min(round((high - low) / math.tau), 3) if self.first.is_angle else 1
        if turns > 1:
            low, high = -math.pi * turns, math.pi * turns
        self.theta = np.linspace(low, high, SAMPLES * max(turns, 1))
        self.values = self.at(self.theta)

    def at(self, theta):
        """Return the output at inputs, NaN where any joint cannot be assembled."""
        return self._pose.over(np.asarray(theta, float), *self.others)[0]

    def held_at(self, others):
        """Return the output at other inputs, which an inverse may have rounded."""
        held = copy.copy(self)
        held.others = tuple(others)
        return held

    def away(self, value, other):
        """Return the distance of two values, without whole turns."""
        gap = np.asarray(value) - other
        return np.abs(gap if math.isinf(self.period) else gap - self.period * np.round(
            gap / self.period))

    def ulp_changes(self, at):
        """Return by how much 64 ulps of an input, or of its size, change the output."""
        beside = self.at(at + 64.0 * np.spacing(max(abs(at), self.first.size)) * SIDES)
        return np.nanmax([0.0, *self.away(beside, self.at(at))])

    def stands_still(self, at):
        """Tell whether the output hardly changes: its value does not tell the input."""
        beside = self.away(self.at(at + STILL * self.first.size * SIDES), self.at(at))
        return bool(np.nanmax([0.0, *beside]) < ALLOWED * self.size)

    def ends(self):
        """Return the last inputs at which there is a pose, with the direction inside."""
        known = np.isfinite(self.values)
        for i in np.flatnonzero(known[1:] != known[:-1]).tolist():
            inside, out = (self.theta[i], self.theta[i + 1])[::1 if known[i] else -1]
            for _ in range(STEPS):
                middle = 0.5 * (inside + out)
                inside, out = (middle, out) if np.isfinite(self.at(middle)) else (inside, middle)
            yield inside, -1.0 if known[i] else 1.0
        if not self.first.is_angle:  # a whole turn, or a few of many, have no ends
            yield from ((end, side) for end, side, there in (
                (self.theta[0], 1.0, known[0]), (self.theta[-1], -1.0, known[-1])) if there)

    def extremes(self):
        """Return inputs at which the output turns back, to half of all digits."""
        before, now, after = self.values[:-2], self.values[1:-1], self.values[2:]
        with np.errstate(invalid='ignore'):
            places = np.flatnonzero((now - before) * (now - after) > 0.0) + 1
        for i in places.tolist():
            if max(self.away(self.values[i], self.values[i - 1]),
                   self.away(self.values[i], self.values[i + 1])) > 0.3 * self.size:
                continue
            sign = 1.0 if self.values[i] > self.values[i - 1] else -1.0
            low, high = self.theta[i - 1], self.theta[i + 1]
            for _ in range(40):
                inner = np.linspace(low, high, 9)
                best = int(np.clip(np.argmax(sign * self.at(inner)), 1, 7))
                low, high = inner[best - 1], inner[best + 1]
            yield 0.5 * (low + high)

    def roots(self, value):
        """Return the inputs between samples at which the output passes a value."""
        gap = self.values - value
        if self.period < math.inf:
            gap = gap - self.period * np.round(gap / self.period)
        with np.errstate(invalid='ignore'):
            places = np.flatnonzero((gap[1:] * gap[:-1] < 0.0) & (
                np.abs(gap[1:] - gap[:-1]) < 0.3 * self.size))
        for i in places.tolist():
            low, high, rising = self.theta[i], self.theta[i + 1], gap[i] < 0.0
            for _ in range(STEPS):
                middle = 0.5 * (low + high)
                now = float(self.at(middle)) - value
                now = math.remainder(now, self.period) if now == now else now
                low, high = (middle, high) if (now < 0.0) == rising else (low, middle)
            if self.away(self.at(low), value) < 1e-9 * self.size:
                yield low

    def questions(self, rng, count):
        """Yield kinds and inputs of questions."""
        known = self.theta[np.isfinite(self.values)]
        for at in rng.choice(known, min(count, len(known))) if len(known) else ():
            yield 'ordinary', float(at + 0.3 * (self.theta[1] - self.theta[0]))
        special = [('ends', at, side) for at, side in self.ends()]
        special += [('extremes', at, 1.0) for at in self.extremes()]
        special += [('dead points', at, side) for at in self.linkage.dead_points(*self.others)
                    for side in (1.0, -1.0)]
        # An output over many turns has thousands of them.
        chosen = sorted(rng.permutation(len(special))[:SPECIALS])
        for kind, at, side in (special[i] for i in chosen):
            yield kind, float(at)
            for away in AWAY:
                yield 'next to ends', float(at + side * away * self.first.size)


def judge(linkage, name, rng, count=6, others=()):
    """Return counts by (kind, what), and the worst error of an answer in units of the rule."""
    output, counter, worst = Output(linkage, name, others), Counter(), 0.0
    steps = output.away(output.values[1:], output.values[:-1])
    steps = steps[np.isfinite(steps)]
    # An output that stands still at most places tells no input.
    if len(steps) < 20 or np.median(steps) < 1e-9 * output.size:
        return counter, worst
    names = (name, *(input_.name for input_ in linkage.inputs[1:]))
    inverse, reach = linkage.inverse(names), linkage.reach(*others)
    first = inverse.inputs[0]
    for kind, at in output.questions(rng, count):
        value = float(output.at(at))
        if value != value:
            continue
        solutions = inverse.all([value, *others], [at, *others])
        answers = [solution.inputs[0] for solution in solutions]
        # Of several inputs the rule promises regular solutions only.
        if others and any(solution.margin < SINGULAR for solution in (
                Solution((at, *others), inverse), *solutions)):
            kind = 'singular'
        elif output.stands_still(at) or output.ulp_changes(at) > SINGULAR * output.size:
            kind = 'no direction'
        elif 'ends' in kind and not output.first.on(reach, at):
            kind = 'beyond the reach'
        counter[kind, 'questions'] += 1
        expected = [at]
        if kind == 'ordinary':
            # Of a part of a period, a quarter on both sides of the seed is promised.
            expected += [root for root in output.roots(value) if (
                first.wraps or not first.is_angle
                or abs(root - at) <= 0.25 * (first.high - first.low))
                and output.ulp_changes(root) <= SINGULAR * output.size]
        close = (AT if kind == 'ordinary' else NEXT) * first.size
        for root in expected:
            gaps = [first.distance(root, x) for x in answers]
            if not min(gaps, default=9.0) <= close and not any(
                    # Where the output hardly changes, its value does not tell the input.
                    gap < 1e-2 and output.away(output.at(np.linspace(root, x, 9)), value).max()
                    < 1e-11 * output.size for gap, x in zip(gaps, answers)):
                _note(counter, kind, 'lost', linkage, name, at, others)
                break
        for k, x in enumerate(answers):
            error, reached, beside = _error(
                output.held_at(solutions[k].inputs[1:]), first, x, value)
            beyond = 0.0 if kind == 'ordinary' else max(2.0 * ALLOWED * output.size, beside)
            if not error <= MOST and not output.away(reached, value) <= beyond:
                _note(counter, kind, 'invented', linkage, name, at, others)
            elif kind == 'ordinary':
                worst = max(worst, error)
            # Two that are near are one if the output has its value between them, too.
            if any(first.distance(x, y) <= 1e-9 * first.size and output.away(
                    output.at(x + 0.5 * math.remainder(y - x, first.turn)), value)
                    <= MOST * 2.0 ** -53 * output.size for y in answers[:k]):
                _note(counter, kind, 'duplicates', linkage, name, at, others)
    return counter, worst


def _note(counter, kind, what, *where):
    """Count what is wrong, and where it was."""
    counter.update([(kind, what), (kind, f'{what} at', *where)])


def _error(output, first, x, value):
    """Return the error of an answer in units of the rule, and the output there."""
    # What an ulp of the input changes, on the side where there is a pose; and what 64 do. An end
    # is the same in all turns.
    sizes = np.array([1e-3 * first.size, first.size, max(first.size, abs(first.high))])
    steps = np.array([2.0, 64.0, 64.0]) * np.spacing(np.maximum(abs(x), sizes))
    values = output.at(x + np.append(0.0, np.outer(steps, SIDES)))
    # An end or an extreme that has no pose is judged by the nearest one.
    reached = next(filter(np.isfinite, values), math.nan)
    ulp, ulps, end_ulps = np.fmax.reduce(
        output.away(values[1:], reached).reshape(3, 2), axis=1, initial=0.0)
    error = output.away(reached, value) / (2.0 ** -53 * output.size + max(ulp / 4.0, ulps / 128.0))
    return float(error), reached, min(1e-6 * output.size, 2.0 * end_ulps)


def judge_several(linkage, names, rng, count=6):
    """Return what `judge` does for as many outputs as there are inputs, at ordinary poses."""
    counter, inverse = Counter(), linkage.inverse(names)
    sizes = [input_.size for input_ in linkage.inputs]
    scales = [1.0 if linkage.is_angle(name) else linkage.longest for name in names]
    poses = [[float(rng.uniform(input_.low, input_.high)) for input_ in linkage.inputs]
             for _ in range(TRIES)]
    checked = linkage.compiled('checked', names)
    regular = [pose for pose in poses if np.isfinite(checked.at(*pose)).all()
               and Solution(pose, inverse).margin > SINGULAR]
    for pose in regular[:count]:
        row = np.array(checked.at(*pose)[:len(names)])
        answers = inverse.all(row.tolist())
        counter['ordinary', 'questions'] += 1
        margin = Solution(pose, inverse).margin
        if not any(max(input_.distance(x, y) / size for input_, x, y, size in zip(
                inverse.inputs, answer.inputs, pose, sizes)) < 1e-9 / margin
                for answer in answers):
            _note(counter, 'ordinary', 'lost', linkage, names, tuple(pose), ())
        for answer in answers:
            there = np.array(checked.at(*answer.inputs)[:len(names)])
            if _differ(inverse, there - row, scales):
                _note(counter, 'ordinary', 'invented', linkage, names, tuple(pose), ())
    return counter, 0.0


def _differ(inverse, gaps, scales):
    """Return whether outputs differ, those that are inputs not only by whole periods."""
    inputs = {input_.name: input_ for input_ in inverse.inputs}
    return not all(
        (inputs[name].distance(gap, 0.0) if name in inputs else
         abs(math.remainder(gap, math.tau)) if inverse.linkage.is_angle(name) else abs(gap))
        < 1e-7 * scale for name, gap, scale in zip(inverse.outputs, gaps, scales))
