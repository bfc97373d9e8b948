# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What any linkage must hold, asked of a mechanism and compared with its drawing.

Each check yields `Problem`s. What float64 finds by brute force is believed only where the drawing
in many digits says the same, so that nothing here is a false alarm next to a limit.
"""

from contextlib import suppress
from functools import wraps
import math
from typing import NamedTuple
import warnings

from linkage_ros.linkage import theta_of
import numpy as np

from . import drawing_accuracy, inverse_judge, random_linkages
from .drawing import draw, FLOATS, Linkage

# Arcs below this width, of an input about as large as an angle, are the rounding of one or two.
NARROWEST = 1e-11
# An arm that is shorter than this part of the longest length has no direction to speak of.
SHORTEST = 1e-7
# One on which accelerations lose a digit or more.
SHORT = 0.1


class Problem(NamedTuple):
    """What does not hold: the kind of it, and the numbers that reproduce it."""

    kind: str
    text: str


class Subject:
    """
    A mechanism and its drawing, further inputs held at a value each.

    `values` are those of the first input at which brute force looks, `scale` is about how large
    they are: 1 for an angle.
    """

    def __init__(self, design, rng, samples=4000):
        self.design, self.rng = design, rng
        # What has been measured.
        self.rows = []
        self.mechanism = design.linkage()
        self.linkage = Linkage(design.joints, design.dimensions, design.branches)
        self.inputs = self.mechanism.inputs
        self.turns = self.inputs[0].is_angle
        self.held = tuple(float(rng.uniform(-3.0, 3.0) if input_.is_angle
                                else rng.uniform(input_.low, input_.high))
                          for input_ in self.inputs[1:])
        self.poses = drawing_accuracy.outputs(self.linkage, self.mechanism.links)
        self.values, self.scale = self._searched(samples)
        self.ways = sorted(self.linkage.passings(), key=self._misfit)

    def _searched(self, samples):
        middles = np.linspace(-1.0, 1.0, 2 * samples + 1)[1::2]
        if self.turns:
            return math.pi * middles, 1.0
        low, high = self.inputs[0].low, self.inputs[0].high
        if self.linkage.inputs[0].word == 'cylinder':
            middles = 1.05 * middles  # beyond its stroke it must not be assembled
        return (0.5 * low + 0.5 * high + (0.5 * high - 0.5 * low) * middles,
                max(abs(low), abs(high)) / math.pi)

    def __str__(self):
        held = f' others={self.held}' if self.held else ''
        return f'{self.design}{held}'

    def fitted(self, given, rates=False, mechanism=None, motion=None):
        """Measure all answers, on the way past the change points that fits them best."""
        results = drawing_accuracy.answers(mechanism or self.mechanism, given, self.poses, rates,
                                           motion)
        best = None
        for way in self.ways:
            measure = drawing_accuracy.Measure(self.linkage, self.poses, way)
            rows = drawing_accuracy.judge(measure, given, results, rates, motion=motion)
            count = sum(bool(row.problem) for row in rows)
            if best is None or count < best[0]:
                best = count, rows
            if not count:
                break
        return best[1]

    def _misfit(self, way):
        """Return at how many values the mechanism does not go this way past its change points."""
        given = np.column_stack([self.rng.uniform(-math.tau, math.tau, 60) if input_.is_angle else
                                 self.rng.uniform(input_.low, input_.high, 60)
                                 for input_ in self.inputs])
        drawing, unit = self._drawn(list(given.T), way)
        places, count = self.mechanism.solve(_given(given, (60,))), 0
        for name, place in places.items():
            count += np.sum(np.abs(place @ (1, 1j) / unit - drawing.points[name]) > 1e-6)
        return count

    @property
    def periodic(self):
        """Whether the joints are where they were, a period later, but for a few rounded places."""
        now, later = (self.drawn(self.values[::40] + turn)[0]
                      for turn in (0.0, self.inputs[0].turn))
        held = np.all([gap * np.ones(self.values[::40].shape) >= 0.0
                       for gap in now.gaps.values()] or [True], axis=0)
        return self.turns and all(np.mean(held & (np.abs(place - later.points[name]) > 1e-6)) < 0.1
                                  for name, place in now.points.items())

    def drawn(self, values):
        """Return the drawing in float64 at values of the first input, and the unit of length."""
        return self._drawn([np.asarray(values, float), *self.held], self.ways[0])

    def _drawn(self, given, way):
        rows, turns, unit = self.linkage.in_floats(way)
        given = [value if input_.is_angle else value / unit
                 for value, input_ in zip(given, self.inputs)]
        with np.errstate(all='ignore'):
            return draw(FLOATS, self.linkage, rows, given, way, turns), unit

    def measure(self):
        """Return the measure in many digits."""
        return drawing_accuracy.Measure(self.linkage, self.poses, self.ways[0])

    def states(self, value):
        """Return the states of all closures at a value of the first input, in many digits."""
        return set(self.measure().at([value, *self.held]).states.values())

    def shortest_arm(self, given):
        """Return the shortest arm at values of the inputs (n, inputs), in longest lengths."""
        arms = self._drawn(list(np.asarray(given).T), self.ways[0])[0].arms.values()
        return np.nan_to_num(np.min([1.0, *(np.min(arm) for arm in arms)]))

    def without_direction(self, value):
        """Tell whether something hangs on an arm of no length, at a value of the first input."""
        return self.shortest_arm([[value, *self.held]]) < SHORTEST

    def away(self, value, others):
        """Return how far a value of the first input is from the nearest of others, or turns on."""
        turn = self.inputs[0].turn if self.turns else math.inf
        return min((abs((value - other + turn / 2) % turn - turn / 2) if math.isfinite(turn)
                    else abs(value - other) for other in others), default=math.inf)

    def reachable(self, drawing):
        """Tell for every sample whether all closures are met."""
        assembled_ = np.ones(self.values.shape, bool)
        for gap in drawing.gaps.values():
            assembled_ &= gap * np.ones(self.values.shape) >= 0.0
        return assembled_


def assembled(seeds):
    """Yield the seed, the linkage and the generator of those random designs that assemble."""
    for seed in seeds:
        rng = np.random.default_rng(seed)
        drawn = random_linkages.design(rng)
        with suppress(ValueError):
            yield seed, drawn.linkage(), rng


def checked(check):
    """Make what escapes from a check a problem."""
    @wraps(check)
    def guarded(subject, *args):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter('error', RuntimeWarning)
                return [Problem(kind, f'{text}: {subject}')
                        for kind, text in check(subject, *args)]
        except Exception as error:  # noqa: B902
            return [Problem(f'{check.__name__}: {type(error).__name__}',
                            f'{str(error)[:200]}: {subject}')]
    return guarded


# --- poses and rates ----------------------------------------------------------------------------

def spots(subject):
    """Return dead points and reach ends, as far as they can be had."""
    values = []
    for method in (subject.mechanism.reach, subject.mechanism.dead_points):
        try:
            values += np.ravel(method(*subject.held)).tolist()
        except Exception:  # noqa: B902
            continue  # `reach` and `dead_points` have a check of their own
    return values


def asked(subject, count):
    """Return values of the inputs to ask for; further inputs are held for half of them."""
    given = random_linkages.given(subject.rng, count, spots(subject), subject.inputs)
    if subject.held:
        given[::2, 1:] = subject.held
    return given


@checked
def poses(subject, count=4):
    """Compare places, angles and slides with the drawing."""
    yield from _broken(subject, asked(subject, count), False)


@checked
def rates(subject, count=1):
    """Compare velocities and rates with the drawing."""
    yield from _broken(subject, asked(subject, count), True)


@checked
def accelerations(subject):
    """
    Compare accelerations at random speeds of the inputs with the drawing.

    On a short arm they lose as many digits as it is shorter than its bars.
    """
    given = asked(subject, 1)
    if subject.shortest_arm(given) < SHORT:
        return
    sizes = [1.0 if input_.is_angle else input_.high - input_.low for input_ in subject.inputs]
    motion = drawing_accuracy.Motion(*(tuple(row) for row in subject.rng.uniform(
        -2.0, 2.0, (2, len(sizes))) * sizes))
    yield from _broken(subject, given, False, motion=motion)


def _broken(subject, given, with_rates, mechanism=None, motion=None):
    rows = subject.fitted(given, with_rates, mechanism, motion)
    subject.rows += rows
    for row in drawing_accuracy.broken(rows)[:2]:
        order = ('', 'rate ', 'acceleration ')[row.output.order]
        what = f'{row.output.what} {order}{row.problem}'
        yield what, (f'{row.output} at {row.values}: got {row.result}, true is '
                     f'{complex(row.value)}, ratio {row.ratio:.3g}, error {row.error:.3g}, '
                     f'sensitivity {row.sensitivity:.3g}')


# --- one answer in many forms -------------------------------------------------------------------

@checked
def forms(subject):
    """Ask for arrays of every shape and in one function what is asked for one pose."""
    mechanism, given = subject.mechanism, asked(subject, 6)
    whole = _all(mechanism, _given(given, (3, 2)))
    for name, value in whole.items():
        if value.shape[:2] != (3, 2):
            yield 'shape', f'{name} has shape {value.shape}'
    for name, value in _all(mechanism, _given(given[:0], (0,))).items():
        if value.shape[:1] != (0,):
            yield 'shape', f'{name} has shape {value.shape} for no values'
    for index in ((0, 0), (2, 1)):
        row = given[index[0] * 2 + index[1]]
        for shape, pick in (((), ()), ((1,), 0)):
            for name, value in _all(mechanism, _given(row[None], shape)).items():
                if not _same(name, value[pick], whole[name][index]):
                    yield 'forms differ', (f'{name} at {row.tolist()} is {value[pick]} in shape '
                                           f'{shape}, {whole[name][index]} in an array')
        joints = mechanism.joints
        expected = [*(part for name in mechanism.points for part in whole[f'solve {name}'][index]),
                    *(whole[f'joint_angles {name}'][index] for name in joints),
                    *(whole[f'joint_rates {name} {by}'][index]
                      for by in range(len(subject.inputs)) for name in joints)]
        names = [*(f'solve {name}' for name in mechanism.points for _ in 'xy'),
                 *(f'joint_angles {name}' for name in joints),
                 *(f'joint_rates {name}' for _ in subject.inputs for name in joints)]
        floats = mechanism.function(None, joints, joints)(*map(float, row))
        for name, one, other in zip(names, floats, expected):
            if not _same(name, one, other):
                yield 'function() differs', f'{name} at {row.tolist()} is {one}, not {other}'
                break


@checked
def accelerated(subject):
    """Compare arrays by machine code with the drawing."""
    yield from _broken(subject, asked(subject, 2), True, subject.mechanism.accelerated())


def _given(given, shape):
    """Return values of inputs, shape (n, inputs), as a mechanism takes them."""
    columns = [column.reshape(shape)[()] for column in given.T]
    return theta_of([float(column) if shape == () else column for column in columns])


def _all(mechanism, given):
    results = {}
    for method in ('solve', 'joint_angles', 'transmission_angles'):
        answers = getattr(mechanism, method)(given)
        results.update((f'{method} {name}', np.asarray(value)) for name, value in answers.items())
    for by in range(len(mechanism.inputs)):
        for method in ('velocity', 'joint_rates'):
            answers = getattr(mechanism, method)(given, by=by)
            results.update((f'{method} {name} {by}', np.asarray(value))
                           for name, value in answers.items())
    return results


def _same(name, one, other):
    """Tell whether two answers have the same bits; an arctangent may differ by two ulps."""
    one, other = np.asarray(one), np.asarray(other)
    if one.shape != other.shape:
        return False
    with np.errstate(invalid='ignore'):
        difference = np.abs(one - other)
    arctangent = name.startswith(('joint_angles', 'transmission'))
    ulp = 2.0 * np.spacing(np.abs(other)) if arctangent else 0.0
    return bool(np.all((one == other) | (np.isnan(one) & np.isnan(other)) | (difference <= ulp)))


# --- reach and dead points ----------------------------------------------------------------------

@checked
def reach(subject):
    """Compare the reach with brute force; its ends and what lies on it must have a pose."""
    arcs = subject.mechanism.reach(*subject.held)
    drawing, _ = subject.drawn(subject.values)
    assembled_ = subject.reachable(drawing)
    is_in = inside(arcs, subject.values, subject.inputs[0].turn if subject.periodic else 0.0)
    wrong = np.flatnonzero(assembled_ != is_in)
    for i in wrong[::len(wrong) // 4 + 1]:
        value = float(subject.values[i])
        states = subject.states(value)
        if assembled_[i] and states <= {'meets', 'undirected'}:
            yield 'reach misses', f'{value!r} can be assembled, reach {arcs}'
        if is_in[i] and 'fails' in states and 'slips' not in states:
            yield 'reach too far', f'{value!r} cannot be assembled, reach {arcs}'
    for lo, hi in arcs:
        first = subject.inputs[0]
        if not first.low <= lo < first.high or not lo < hi <= (
                lo + first.turn if subject.turns else first.high):
            yield 'reach arcs', f'{arcs}'
        for value in (lo, hi, *subject.rng.uniform(lo, hi, 3)):
            missing = [name for name, place in subject.mechanism.solve(
                theta_of([float(value), *subject.held])).items() if np.any(np.isnan(place))]
            if missing and hi - lo > NARROWEST * subject.scale \
                    and not subject.without_direction(float(value)):
                where = 'end' if value in (lo, hi) else 'inside'
                yield f'reach {where} is NaN', f'{missing} at {float(value)!r}, reach {arcs}'


def inside(arcs, values, turn):
    """Tell which values of an input lie on arcs, whole turns aside if there are any."""
    inside_ = np.zeros(np.shape(values), bool)
    for lo, hi in arcs:
        ahead = np.mod(values - lo, turn) if turn else values - lo
        inside_ |= (ahead >= 0.0) & (ahead <= hi - lo)
    return inside_


@checked
def dead_points(subject):
    """Compare the dead points with where closures vanish; transmission angles lie in [0, pi]."""
    mechanism = subject.mechanism
    dead = mechanism.dead_points(*subject.held)
    low, high = subject.inputs[0].low, subject.inputs[0].high
    if dead != sorted(dead) or not all(low <= value < high or value == high
                                       and not subject.inputs[0].wraps for value in dead):
        yield 'dead points out of order', f'{dead}'
    if any(value != 0.0 and abs(value) < 1e-300 * subject.scale for value in dead):
        yield 'dead point not quite zero', f'{dead}'
    for value in dead:
        if not _is_dead(subject, value) and not subject.without_direction(value):
            yield 'dead point false', f'{value!r} of {dead}'
    for value in _vanishing(subject):
        if subject.away(value, dead) > 1e-5 * subject.scale \
                and not subject.without_direction(value):
            yield 'dead point missed', f'{value!r} is not in {dead}'
    values = subject.values[::400]
    distance = mechanism.distance_to_dead_point(values, *subject.held)
    true = [subject.away(value, dead) for value in values]
    if not np.allclose(distance, true, atol=1e-9 * subject.scale):
        yield 'distance to dead point', f'{distance} is not {true}'


def _closures(drawing, size):
    """Return everything that vanishes at a dead point, as rows."""
    return np.array([value * np.ones(size)
                     for value in (*drawing.gaps.values(), *drawing.folds.values())])


def _is_dead(subject, value):
    """Tell whether a closure vanishes within 1e-6 of a value."""
    steps = subject.scale * np.array([-1e-6, -1e-9, 0.0, 1e-9, 1e-6])
    values = np.abs(_closures(subject.drawn(value + steps)[0], steps.shape))
    return any(np.min(row) <= max(2e-3 * np.max(row), 1e-10) for row in values)


def _vanishing(subject):
    """Return the values on the reach where a closure changes its sign or touches zero."""
    drawing, _ = subject.drawn(subject.values)
    assembled_, values = subject.reachable(drawing), subject.values
    zeros = []
    for k, row in enumerate(_closures(drawing, values.shape)):
        # What is zero all along, but for lengths that are nearly equal, tells no place.
        if not np.all(np.isfinite(row)) or np.median(np.abs(row)) < 1e-8:
            continue
        # The signs of rounding, where lengths are equal but for 1e-12, tell no place either.
        sure = np.abs(row) > 1e-12
        changes = np.flatnonzero(((row[:-1] < 0.0) != (row[1:] < 0.0)) & sure[:-1] & sure[1:])
        for i in changes[assembled_[changes] | assembled_[changes + 1]][:20]:
            zeros.append(_crossing(subject, k, values[i], values[i + 1]))
        if k >= len(drawing.gaps):
            continue  # a fold that only touches zero is no more than a doubt
        inner = np.abs(row[1:-1])
        dips = np.flatnonzero((inner <= np.abs(row[:-2])) & (inner <= np.abs(row[2:]))
                              & (inner < 1e-4) & assembled_[1:-1]) + 1
        for i in dips[:20]:
            zeros.append(_touching(subject, k, values[i - 1], values[i + 1]))
    return [each for each in zeros if each is not None and _on_reach(subject, each)]


def _closure(subject, k, values):
    values = np.atleast_1d(values)
    return _closures(subject.drawn(values)[0], values.shape)[k]


def _crossing(subject, k, lo, hi):
    """Return where a closure changes its sign, None where it jumps."""
    left = _closure(subject, k, lo)[0] < 0.0
    for _ in range(12):
        grid = np.linspace(lo, hi, 17)
        at = int(np.argmax((_closure(subject, k, grid) < 0.0) != left))
        lo, hi = grid[max(at - 1, 0)], grid[max(at, 1)]
    return float(hi) if abs(_closure(subject, k, hi)[0]) < 1e-6 else None


def _touching(subject, k, lo, hi):
    """Return where a closure touches zero, None where it does not or rounding decides."""
    for _ in range(10):
        grid = np.linspace(lo, hi, 17)
        row = np.abs(_closure(subject, k, grid))
        at = int(np.argmin(row))
        if not np.isfinite(row[at]):
            return None
        lo, hi = grid[max(at - 1, 0)], grid[min(at + 1, 16)]
    middle = 0.5 * (lo + hi)
    if abs(_closure(subject, k, middle)[0]) > 1e-13:
        return None
    truth = subject.measure().at([float(middle), *subject.held])
    name = list(truth.gaps)[k]
    return float(middle) if abs(truth.gaps[name]) <= truth.slack[name] else None


def _on_reach(subject, value):
    """Tell whether a value is on the reach, by more than a graze of its other closures."""
    beside = subject.drawn(value + 1e-6 * subject.scale * np.array([-1.0, 1.0]))[0]
    gaps = [value * np.ones(2) for value in beside.gaps.values()]
    return not gaps or bool(np.any(np.min(gaps, axis=0) > 0.0))


# --- the inverse --------------------------------------------------------------------------------

def moved(mechanism):
    """Return the joint angles, slides and coordinates that move, but for the inputs."""
    driven = [input_.name for input_ in mechanism.inputs]
    return [name for name in (*mechanism.joints, *(
        f'{point}.{axis}' for point in mechanism.points for axis in 'xy'))
        if mechanism.moves(name) and name not in driven]


@checked
def inverse(subject, count=2):
    """Ask which values of the first input give values that outputs have; `inverse_judge` tells."""
    for output in map(str, subject.rng.permutation(moved(subject.mechanism))[:count]):
        counter, _ = inverse_judge.judge(subject.mechanism, output, subject.rng, 4, subject.held)
        for kind, what, *case in counter:
            if (kind, what) in (('ordinary', 'lost at'), ('ordinary', 'invented at')):
                yield f'inverse {what}', f'{output} at {case[2]!r}'


@checked
def followed(subject):
    """Follow an output to a value beside that of a pose: what is answered has the value."""
    mechanism, rng = subject.mechanism, subject.rng
    for output in map(str, rng.permutation(moved(mechanism))[:1]):
        names = (output, *(input_.name for input_ in mechanism.inputs[1:]))
        scale = 1.0 if mechanism.is_angle(output) else mechanism.longest

        def value(theta, output=output):
            given = theta_of([theta, *subject.held])
            return float(mechanism.joint_angles(given, [output])[output])

        for near in rng.choice(subject.values, 10).tolist():
            target = value(near) + rng.uniform(-0.2, 0.2) * scale
            inputs, _ = mechanism.inverse(names).follow(
                (target, *subject.held), (near, *subject.held))
            gap = value(inputs[0]) - target if math.isfinite(inputs[0]) else 0.0
            gap = math.remainder(gap, math.tau) if mechanism.is_angle(output) else gap
            if not abs(gap) < 1e-6 * scale:
                yield 'followed', f'{output} to {target!r} from {near!r}: {inputs} is {gap} off'


# --- forces -------------------------------------------------------------------------------------

@checked
def efforts(subject):
    """Compare the efforts that balance loads with the rates of what they move."""
    mechanism, given = subject.mechanism, _given(asked(subject, 1), ())
    links, loads, moved = {link.name: link for link in mechanism.links}, {}, []
    for name in (*mechanism.points, *mechanism.joints):
        link, of = links.get(name), [f'{name}.x', f'{name}.y']
        if link:
            while link and link.kind == 'prismatic':
                link = links.get(link.parent)
            of = [f'angle({link.joint},{link.tip})'] if link else []
        load = subject.rng.uniform(-9.0, 9.0, 1 if name in links else 2)
        loads[name] = load[0] if name in links else load
        moved += zip(of, load)
    rates = [mechanism.joint_rates(given, {*dict(moved)}, by)
             for by in range(len(mechanism.inputs))]
    # The rule says nothing of arms of nearly no length.
    sure = [by for by, row in enumerate(rates) if (np.abs([*row.values()]) < 1e9).all()]
    effort = mechanism.effort(given, loads)[sure]
    expected = [-sum(rates[by][output] * load for output, load in moved) for by in sure]
    if not np.allclose(effort, expected, 1e-6, 1e-8 * max(1.0, mechanism.longest)):
        yield 'effort', f'{effort}, not {expected}, for {loads}, {given}'


CHECKS = poses, rates, accelerations, forms, reach, dead_points, inverse, followed, efforts


def problems(design, rng, checks=CHECKS, samples=4000):
    """Return the problems of a design and all measured rows, None if it cannot be made."""
    try:
        subject = Subject(design, rng, samples)
    except ValueError:
        return None
    problems_ = [problem for check in checks for problem in check(subject)]
    return problems_, subject.rows
