# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
How far an answer about any linkage may be from its drawing, where joints hang on each other.

A result is measured in units of its *sensitivity*: what moving each thing that is rounded by half
ulp does to the true result. Rounded are the inputs (angles, lengths, dimensions, numbers in the
lines, what is calculated from them, what gears make of them), and each joint on the way but those
that are written down: half an ulp of the largest coordinate on its line; a gap so small that it
counts as a change point may be closed. The pin of a crank on the ground is charged only to lines
that are not drawn on an arm from the ground to that pin: for such an arm half angles keep all
digits, and the rule holds them to it. For velocities and rates also the velocity of each of those
joints is rounded, for accelerations their acceleration too, and how the inputs move. The rule is

    error <= 4 x sensitivity + 1 ulp of the result,

for velocities, rates and accelerations 8 x both, with a number wherever everything that the joint
stands on can be assembled and NaN wherever it cannot; within `GRAZE` sensitivities of a limit, of
a cylinder's within `LOOSER` times as much, either will do. What hangs on an arm that is no longer
than what the rule lets its ends be off has no direction that could be right. Angles are compared
modulo a turn, so that their ulp is that of pi.

By the `strict` rule, that of the catalogue, joints on the way are not rounded, and rates are held
to the rule of poses, or to `SPEED_RULE` x 2^-53 of their top speed over a turn if that is more.
"""

from functools import cached_property
import math
from typing import NamedTuple

import gmpy2
from gmpy2 import mpc, mpfr
from linkage_ros.linkage import theta_of
import numpy as np

from .drawing import DIGITS, draw, half_ulp, Linkage, precisely, SLIDING

# By how often an output is differentiated.
RULES = 4.0, 8.0, 8.0
SPEED_RULE = 60.0
GRAZE = 32.0
# The limits of a cylinder are as exact as its longest length.
LOOSER = 8
# Where an arm has no length exactly, its direction is that of inputs 2^-NUDGE further on.
NUDGE = 150
with gmpy2.context(gmpy2.get_context(), precision=320):
    STEP = mpfr(2) ** -100


TIME = 'time'


class Motion(NamedTuple):
    """How fast each input moves, and how that changes."""

    speeds: tuple
    changes: tuple

    def at(self, given, time):
        """Return where the inputs are at a time, given where they are at zero."""
        return [value + speed * time + change * time * time / 2
                for value, speed, change in zip(given, self.speeds, self.changes)]

    def moved(self, side):
        """Yield motions of which one number is half an ulp off."""
        for part, numbers in enumerate(self):
            for i, number in enumerate(numbers):
                if number:
                    off = *numbers[:i], number + side * half_ulp(number), *numbers[i + 1:]
                    yield Motion(*(off if k == part else row for k, row in enumerate(self)))


class Output(NamedTuple):
    """
    One thing that a mechanism answers, and the joints that it stands on.

    `what` is 'point', 'angle' or 'slide'; `parts` are bars by their two joints, that of an angle
    and that from which it is counted, from `quarters` of a turn; of one joint is what slides on
    its line. `needs` are the closures without which it is NaN: none for a driven angle. `by` is
    the number of the input by which it is differentiated, `TIME` for twice by time, None for a
    pose.
    """

    what: str
    name: str
    parts: tuple
    needs: tuple
    quarters: int = 0
    by: object = None

    def __str__(self):
        rate = ('', f' by input {self.by}', ' by time twice')[self.order]
        return f'{self.what} {self.name}{rate}'

    @property
    def order(self):
        """How often it is differentiated."""
        return 0 if self.by is None else 2 if self.by == TIME else 1


class Row(NamedTuple):
    """One output at one pose: `problem` is '', 'NaN', 'missed NaN' or 'rule'."""

    output: Output
    values: tuple
    problem: str
    ratio: float
    error: float
    sensitivity: float
    result: object
    value: object


def outputs(linkage, links):
    """Return all outputs of a pose, given a mechanism's links."""
    points = [Output('point', name, ((name,),), linkage.closures[name]) for name in linkage.placed]
    slides = iter(line.names[0] for line in linkage.lines if line.word in SLIDING)
    bars = {}
    for link in links:
        slides_on = link.kind == 'prismatic'
        zero = linkage.zero_of(link.joint, link.tip)
        parent = zero or ((bars[link.parent],) if link.parent in bars else ())
        bars[link.name] = (next(slides),) if slides_on else (link.joint, link.tip)
        parts = (bars[link.name], *parent * (not slides_on))
        needs = set().union(*(linkage.closures[joint] for part in parts for joint in part))
        if link.name in linkage.driven_names:  # it is as given, but for a carriage beyond its way
            tip = bars[link.name][0]
            needs = {tip} if linkage.placing(tip).word == 'carriage' else set()
        points.append(Output(
            'slide' if slides_on else 'angle', link.name, parts, frozenset(needs),
            0 if zero or slides_on else round(link.zero / (math.pi / 2))))
    return points


def answers(mechanism, values, poses, rates=False, motion=None):
    """Return {output: array} of a mechanism at values of its inputs, shape (n, inputs)."""
    given, results = theta_of(values.T), {}
    asked = [(None, mechanism.solve(given), mechanism.joint_angles(given))]
    for by in range(len(mechanism.inputs) if rates else 0):
        asked.append((by, mechanism.velocity(given, by=by), mechanism.joint_rates(given, by=by)))
    if motion:
        moving = given, *map(theta_of, motion)
        asked.append((TIME, mechanism.acceleration(*moving),
                      mechanism.joint_accelerations(*moving)))
    for by, points, angles in asked:
        results.update((out._replace(by=by),
                        (points if out.what == 'point' else angles)[out.name]) for out in poses)
    return results


def differentiated(poses, inputs, rates, motion):
    """Return outputs, then all rates of them by each input, and their accelerations, if asked."""
    ways = [None, *range(inputs if rates else 0), *([TIME] if motion else ())]
    return [out._replace(by=by) for by in ways for out in poses]


class _Move(NamedTuple):
    """
    What is drawn when something is moved.

    Joints are moved by `joints`, and along each way through the pose, by its number, with the
    speeds and accelerations in `moving`.
    """

    numbers: object
    given: list
    ways: tuple
    joints: dict = {}
    moving: dict = {}


class _Way(NamedTuple):
    """A way through a pose, and how often outputs are differentiated along it."""

    motion: Motion
    order: int
    unit: object = 1


class _Moved(NamedTuple):
    """The numbers of a linkage, one of which is moved, and where its change points are."""

    rows: list
    turns: dict


class Measure:
    """The truth of a linkage, one way past its change points, and what rounding does to it."""

    @precisely
    def __init__(self, linkage: Linkage, poses, way=None, strict=False):
        self.linkage, self.poses, self._way, self.strict = linkage, poses, way or {}, strict
        self._nominal = self._given(linkage.numbers)
        self._moved = {}
        self._lines = {name: line for line in linkage.lines for name in line.names}
        # An angle is about as large as one; lengths are as large as the longest of them.
        self._units = [1 if line.turns else linkage.longest for line in linkage.inputs]

    @cached_property
    @precisely
    def _top_speeds(self):
        """Return each output's largest speed over a turn; at least a crank's of its own kind."""
        ways, longest = self._ways(True, None), max(
            number[0] for line, number in zip(self.linkage.lines, self.linkage.numbers)
            if line.word == 'crank')
        tops = [mpfr(1) if out.what == 'angle' else longest for out in self.poses]
        for theta in np.arange(24) * (math.tau / 24) + 0.1:
            given = [mpfr(float(theta))]
            now = self._drawn(self._nominal, given)
            if all(gap > 0 for gap in now.gaps.values()):
                speeds = self._values(now, _Move(self._nominal, given, ways))[len(self.poses):]
                tops = [max(top, abs(speed)) for top, speed in zip(tops, speeds)]
        return {out: float(top) for out, top in zip(self.poses, tops)}

    def rule(self, out):
        """Return an output's rule, the ulps beside it, and the error that is allowed at all."""
        if self.strict:
            return RULES[0], 1.0, out.order and SPEED_RULE * 2.0 ** -53 * self._top_speeds[
                out._replace(by=None)]
        return RULES[out.order], RULES[out.order] if out.order else 1.0, 0.0

    def _given(self, numbers):
        return _Moved(self.linkage.prepared(numbers), self.linkage.turns(numbers, self._way))

    def _sides(self, side):
        """Return the linkage with each of its numbers moved to one side."""
        if side not in self._moved:
            linkage = self.linkage
            linkages = [linkage.values({name: side * half_ulp(number)})
                        for name, number in linkage.dimensions.items() if number]
            linkages += [linkage.values(literal={text: side * half_ulp(float(text))})
                         for text in linkage.literals()]
            passed = [(i, 0, passing.gap) for i, passing in self._way.items() if passing.gap]
            for i, k, slack in [*linkage.roundings(), *passed]:
                numbers = list(linkage.numbers)
                numbers[i] = (*numbers[i][:k], numbers[i][k] + side * slack, *numbers[i][k + 1:])
                linkages.append(numbers)
            self._moved[side] = [self._given(numbers) for numbers in linkages]
        return self._moved[side]

    @precisely
    def at(self, given, rates=False, motion=None):
        """Return the `Truth` at values of the inputs, for a `Motion` with accelerations."""
        given = [mpfr(value) for value in given]
        ways = self._ways(rates, motion)
        now = self._drawn(self._nominal, given)
        grazed = self._undirected(now)
        if grazed:
            given = [value + unit * mpfr(2) ** -NUDGE for value, unit in zip(given, self._units)]
            now = self._drawn(self._nominal, given)
        values = self._values(now, _Move(self._nominal, given, ways))
        closures, arms = {**now.gaps}, now.arms
        bent = dict.fromkeys(arms, mpfr(0))
        spread, slack = [mpfr(0)] * len(values), dict.fromkeys(closures, mpfr(0))
        speeds = [self._speeds(given, way) for way in ways]
        for side in (1, -1):
            one_side, one_slack = [mpfr(0)] * len(values), dict.fromkeys(closures, mpfr(0))
            for move in self._moves(now, given, ways, speeds, side):
                drawn = self._drawn(move.numbers, move.given, move.joints)
                for i, (old, new) in enumerate(zip(values, self._values(drawn, move))):
                    one_side[i] += self._distance(i, old, new)
                for name, gap in closures.items():
                    one_slack[name] += abs(drawn.gaps[name] - gap)
                for name, arm in arms.items():
                    bent[name] += abs(drawn.arms[name] - arm)
            for moved in self._displaced(now.points, () if self.strict else self.linkage.fixed,
                                         side):
                drawn = self._drawn(self._nominal, given, moved)
                for name, gap in closures.items():
                    one_slack[name] += abs(drawn.gaps[name] - gap)
            spread = [max(pair) for pair in zip(spread, one_side)]
            slack = {name: max(slack[name], one_slack[name]) for name in slack}
            if all(abs(gap) > 100 * slack[name] for name, gap in closures.items()):
                break  # far from a limit both sides are alike
        for i, out in enumerate(self.poses):
            if grazed and out.what == 'slide':  # which has been moved on with the inputs
                spread[i] += self.linkage.longest * mpfr(2) ** -NUDGE
        for name in closures:
            if self._lines[name].word in ('carriage', 'cylinder'):
                slack[name] = LOOSER * (slack[name] + half_ulp(self.linkage.longest))
        states = {name: _state(gap, slack[name]) for name, gap in closures.items()}
        states.update((name, 'undirected') for name, arm in arms.items()
                      if states.get(name, 'meets') == 'meets' and arm <= GRAZE * bent[name])
        states.update((name, 'adrift') for name, arm in arms.items()
                      if states.get(name) in ('undirected', 'grazes')
                      and arm <= RULES[0] * bent[name])
        states.update((name, 'grazes') for name in grazed if states.get(name) != 'fails')
        states.update((name, 'slips') for name in self._undirected(now))
        return Truth(values, [float(x) for x in spread], states, closures, slack)

    def _ways(self, rates, motion):
        """Return the ways through a pose along which it is differentiated."""
        still = (0,) * len(self._units)
        ways = [_Way(Motion((*still[:i], unit, *still[i + 1:]), still), 1, unit)
                for i, unit in enumerate(self._units if rates else ())]
        if motion:
            ways.append(_Way(Motion(*(tuple(map(mpfr, row)) for row in motion)), 2))
        return tuple(ways)

    def _undirected(self, drawn):
        """Return the joints that are hung on an arm of no length."""
        least = self.linkage.longest / mpfr(2) ** (NUDGE + 40)
        return [name for name, arm in drawn.arms.items() if arm < least]

    def _drawn(self, numbers, given, moved=None):
        return draw(DIGITS, self.linkage, numbers.rows, given, self._way, numbers.turns, moved)

    def _moves(self, now, given, ways, speeds, side):
        """Yield a `_Move` for each thing that is rounded."""
        still = _Move(self._nominal, given, ways)
        for numbers in self._sides(side):
            yield still._replace(numbers=numbers)
        for i, value in enumerate(given):
            if value:
                size = min(abs(value), math.pi) if self.linkage.inputs[i].turns else value
                yield still._replace(
                    given=[*given[:i], value + side * half_ulp(size), *given[i + 1:]])
        rows = self._nominal.rows
        for i, slack in self.linkage.geared(rows, given):
            moved = [*rows[:i], (*rows[i][:-1], rows[i][-1] + side * slack), *rows[i + 1:]]
            yield still._replace(numbers=self._nominal._replace(rows=moved))
        hung = [name for name in self.linkage.placed
                if self._lines[name].word != 'ground' and not self.strict]
        for moved in self._displaced(now.points, hung, side):
            yield still._replace(joints=moved)
        for i, (way, motion) in enumerate(zip(ways, speeds)):
            for k, row in enumerate(motion):
                for moved in self._displaced(row, hung, side):
                    yield still._replace(moving={i: (moved, {})[::-1 if k else 1]})
            for other in way.motion.moved(side) if way.order == 2 else ():
                yield still._replace(ways=(*ways[:i], way._replace(motion=other), *ways[i + 1:]))

    def _displaced(self, places, names, side):
        """Yield joints, each with what half an ulp adds to its x or y."""
        for name in names:
            size = self._largest(places, name)
            if size:
                yield {name: mpc(side * half_ulp(size))}
                yield {name: mpc(0, side * half_ulp(size))}

    def _largest(self, places, name):
        """Return the largest coordinate of a joint and of those that its line hangs it on."""
        return max(abs(part) for each in (name, *self._lines[name].joints)
                   for part in (places[each].real, places[each].imag))

    def _speeds(self, given, way):
        """Return the velocities of the joints on a way, and the accelerations if these count."""
        before, now, after = (self._drawn(self._nominal, way.motion.at(given, time)).points
                              for time in (-STEP, mpfr(0), STEP))
        return [{name: _change(before[name], now[name], after[name], order + 1) / way.unit
                 for name in now} for order in range(way.order)]

    def _values(self, drawn, move):
        values = now = self._poses(drawn)
        for i, way in enumerate(move.ways):
            before, after = (self._poses(self._on_way(move, i, time)) for time in (-STEP, STEP))
            values = values + [_difference(out, *each, way.order) / way.unit
                               for out, *each in zip(self.poses, before, now, after)]
        return values

    def _on_way(self, move, i, time):
        """Return the drawing at a time on a way through a pose."""
        joints, unit = dict(move.joints), move.ways[i].unit
        for step, moved in zip((time * unit, time * time / 2), move.moving.get(i, ())):
            joints.update((name, joints.get(name, 0) + moving * step)
                          for name, moving in moved.items())
        return self._drawn(move.numbers, move.ways[i].motion.at(move.given, time), joints)

    def _poses(self, drawn):
        return [true_value(out, drawn) for out in self.poses]

    def _distance(self, i, old, new):
        if i < len(self.poses) and self.poses[i].what == 'angle':
            return abs(_turned(old, new))
        return abs(new - old)

    def due(self, output, states):
        """
        Tell what is due: 'number', 'nan', 'any' next to a limit that is missed.

        At a limit that is reached it is 'either', and on an arm whose direction is all rounding
        'maybe' a number, which then is to be right.
        """
        needs = {states[name] for name in output.needs if name in states}
        if needs <= {'meets'}:
            return 'number'
        if 'fails' in needs:
            return 'nan' if 'slips' not in needs else 'any'
        # A limit that may be closed may leave an arm without a direction.
        if needs & {'slips', 'adrift'} or needs >= {'grazes', 'undirected'}:
            return 'any'
        return 'either' if 'grazes' in needs else 'maybe'


class Truth(NamedTuple):
    """
    True outputs, poses first, and what half an ulp does to them; the same of the closures' gaps.

    The state of a closure is 'meets', 'undirected', 'adrift', 'grazes', 'slips' or 'fails'.
    """

    values: list
    sensitivity: list
    states: dict
    gaps: dict
    slack: dict


def true_value(output, drawn):
    """Return an output of a drawing: of an angle its bar, turned back by where that is counted."""
    if output.what == 'point':
        return drawn.points[output.name]
    if output.what == 'slide':
        return drawn.slides[output.parts[0][0]]
    bars = [drawn.lines[bar[0]] if len(bar) == 1 else drawn.points[bar[1]] - drawn.points[bar[0]]
            for bar in output.parts]
    turned = bars[0] * bars[1].conjugate() if bars[1:] else bars[0]
    return turned * mpc(0, -1) ** output.quarters


def _state(gap, slack):
    if abs(gap) <= GRAZE * slack:
        return 'grazes' if gap >= 0 else 'slips'
    return 'meets' if gap > 0 else 'fails'


def _turned(old, new):
    turned = new * old.conjugate()
    if abs(turned.imag) < abs(turned.real) / 2 ** 40 and turned.real > 0:
        return turned.imag / turned.real
    return DIGITS.direction(turned)


def _difference(out, before, now, after, order):
    """Return how an output changes on its way, or how that changes; a bar's angle from now on."""
    if out.what == 'angle':
        before, now, after = _turned(now, before), mpfr(0), _turned(now, after)
    return _change(before, now, after, order)


def _change(before, now, after, order):
    return (after - before) / (2 * STEP) if order == 1 else (
        before - 2 * now + after) / (STEP * STEP)


@precisely
def judge(measure, given, results, rates=False, exact=None, motion=None):
    """Return the `Row` of each output that is found, at inputs of the shape (n, inputs)."""
    rows = []
    for index, row in enumerate(given):
        truth = exact[index] if exact else measure.at(row, rates, motion)
        outs = differentiated(measure.poses, len(row), rates, motion)
        for i, out in enumerate(outs):
            if out in results:
                rows.append(_row(out, row, results[out][index], truth.values[i],
                                 truth.sensitivity[i], measure.due(out, truth.states),
                                 *measure.rule(out)))
    return rows


def _row(out, given, result, value, spread, due, rule, ulps, allowed):
    error, ratio, problem, rate = math.nan, 0.0, '', out.order > 0
    if np.all(np.isnan(result)) or (rate and due != 'number' and not np.all(np.isfinite(result))):
        problem = 'NaN' if due == 'number' else ''
    elif due == 'nan' or due == 'number' and np.any(np.isnan(result)):
        problem = 'missed NaN'
    elif due in ('number', 'maybe') or due == 'either' and not rate:
        error = float(error_of(out, result, value))
        ulp = np.spacing(math.pi if out.what == 'angle' and not rate else np.max(np.abs(result)))
        excess = max(0.0, error - float(ulp) * ulps)
        # What the differencing leaves of a rate of zero is no error.
        still = rate and not spread and not np.any(result)
        ratio = 0.0 if not excess or still else excess / spread if spread else math.inf
        if 0.0 < error <= allowed:
            ratio = min(ratio, rule * error / allowed)
        # A limit within GRAZE sensitivities may be closed, which moves by the root of it.
        problem = 'rule' if not ratio <= rule * (
            math.sqrt(GRAZE) if due == 'either' else 1.0) else ''
    return Row(out, tuple(map(float, given)), problem, math.inf if 'NaN' in problem else ratio,
               error, spread, result, value)


def error_of(out, result, value):
    """Return how far an answer is from a true value."""
    if np.ndim(result):
        return abs(mpc(*map(float, result)) - value)
    if out.what == 'angle' and out.by is None:
        return abs(DIGITS.direction(value * DIGITS.turned(-mpfr(float(result)))))
    return abs(mpfr(float(result)) - value)


def broken(rows):
    """Return the rows that break the rule, worst first."""
    return sorted((row for row in rows if row.problem), key=lambda row: -row.ratio)


def strict(mechanism):
    """Return the measure of a mechanism by the strict rule."""
    linkage = Linkage(mechanism.design.joints, mechanism.dimensions, mechanism.branches)
    return Measure(linkage, outputs(linkage, mechanism.links), linkage.passings()[0], strict=True)
