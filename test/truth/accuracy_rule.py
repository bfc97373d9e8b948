# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
How far an answer about the catalogue may be from the truth, and how far it is.

A result is measured in units of its *sensitivity*: what moving each input, the crank angle and
every length, by half an ulp does to the true result. That much uncertainty is in the question
already. The rule is

    error <= 4 x sensitivity + 1 ulp of the result,

with a number wherever the linkage can be assembled and NaN wherever it cannot; within `GRAZE`
sensitivities of a limit either will do. Points and velocities are vectors and their ulp is that
of the larger component; angles are compared modulo a turn, so that theirs is the ulp of pi.

Angles beyond a turn are charged half an ulp of pi only, as if they were exact: the library is to
reduce them without loss.
"""

from functools import partial
import math
from typing import Dict, List, NamedTuple, Optional

import numpy as np

from . import exact_poses
from .exact_poses import mp

RULE = 4.0
GRAZE = 32.0
# A velocity or rate may also err by this many u = 2^-53 of its top speed over a turn; its ratio
# is counted so that this, too, is RULE.
SPEED_RULE = 60.0
# Of a difference quotient in 80 digits.
STEP = mp.mpf(10) ** -30
UNIT = 2.0 ** -53
# How far beyond an end's value the end is the answer [rad]; or as far as so many ulps of the input
# move the output there, and no farther than the last.
BEYOND, ULPS, FARTHEST = 1e-9, 64, 1e-6
# How far inside it is the answer, too.
ENDS = 1e-13

_STEP = mp.mpf(10) ** -30


class Case(NamedTuple):
    """One linkage and the crank angles at which it is to be measured."""

    kind: str
    dimensions: Dict[str, float]
    thetas: np.ndarray
    branches: Optional[Dict[str, int]] = None
    label: str = ''


class Row(NamedTuple):
    """
    One output at one angle: ratio = (error - 1 ulp) / sensitivity, infinite for a wrong NaN.

    `problem` is '', 'NaN' (a number was due), 'missed NaN' (a NaN was due) or 'rule'.
    """

    kind: str
    label: str
    output: str
    ratio: float
    problem: str
    error: float
    sensitivity: float
    theta: float
    dimensions: Dict[str, float]
    branches: Optional[Dict[str, int]]


class Truth(NamedTuple):
    """True outputs, what half an ulp of every input does to them, and the state of closures."""

    values: dict
    sensitivity: dict
    closures: Dict[str, str]


# --- what a mechanism answers, under one set of names -------------------------------------------

def answers(mechanism, thetas, rates=False):
    """Return {output: array} of a mechanism of the library, `rates` with the derivatives."""
    found = dict(mechanism.solve(thetas))
    found.update((_joint('angle', name), value)
                 for name, value in mechanism.joint_angles(thetas).items())
    if rates:
        found.update((f'velocity {name}', value)
                     for name, value in mechanism.velocity(thetas).items())
        found.update((_joint('rate', name), value)
                     for name, value in mechanism.joint_rates(thetas).items())
    return found


def _joint(what, name):
    return name if (what, name) == ('angle', 'slide') else f'{what} {name}'


# --- the truth ----------------------------------------------------------------------------------

def truth(case, theta, links, rates=False):
    """Return the `Truth` of a case at a crank angle, for the links as a mechanism lists them."""
    def evaluate(length, angle):
        return _evaluate(case, length, angle, links, rates)
    return truth_of(evaluate, case.dimensions, float(theta), _bars(case))


def _bars(case):
    """Return the lengths of bars that are no dimension but follow from them: rounded as well."""
    length = exact_poses.exact(case.dimensions)
    if case.kind == 'water_drop':
        return {'rocker': 2 * length['a'], 'tail': 3 * length['a']}
    if case.kind == 'slotted_lever':
        return {'tip': max(9 * length['b'] / 5, length['a'] + length['b'])}
    return {}


def servo_truth(dimensions, half, lever_angle, cut):
    """Return the `Truth` of a lever's inverse on one cut of its slot with the crank circle."""
    def evaluate(length, angle):
        found = exact_poses.servo(length, angle, cut)
        after, before = (exact_poses.servo(length, angle + step, cut).angle
                         for step in (STEP, -STEP))
        turned = mp.arg(mp.expj(after - before))
        return ({'angle servo': mp.expj(found.angle),
                 'rate servo': 2 * STEP / turned if turned else mp.zero},
                {'servo': found.gap, 'slide': half * found.slide})
    return truth_of(evaluate, dimensions, float(lever_angle))


def truth_of(evaluate, dimensions, angle, bars=()):
    """Return the `Truth` of a function of lengths and an angle to values and gaps."""
    length = exact_poses.exact(dimensions)
    values, gaps = evaluate(length, mp.mpf(angle))
    spread, slack = dict.fromkeys(values, mp.zero), dict.fromkeys(gaps, mp.zero)
    for side in (1, -1):
        one_side, one_slack = dict.fromkeys(values, mp.zero), dict.fromkeys(gaps, mp.zero)
        for moved in _moves(length, dimensions, angle, dict(bars), side):
            new_values, new_gaps = evaluate(*moved)
            for name in values:
                one_side[name] += _distance(name, values[name], new_values[name])
            for name in gaps:
                one_slack[name] += abs(new_gaps[name] - gaps[name])
        spread = {name: max(spread[name], one_side[name]) for name in spread}
        slack = {name: max(slack[name], one_slack[name]) for name in slack}
        if all(abs(gap) > 100 * slack[name] for name, gap in gaps.items()):
            break  # far from a limit both sides are alike
    closures = {name: _state(gap, slack[name]) for name, gap in gaps.items()}
    return Truth(values, spread, closures)


def _moves(length, dimensions, angle, bars, side):
    """Yield the inputs with one of them moved by half an ulp; what is zero is exact."""
    if angle:
        yield length, mp.mpf(angle) + side * _half_ulp(min(abs(angle), math.pi))
    for name, number in dimensions.items():
        if number:
            yield {**length, name: length[name] + side * _half_ulp(number)}, mp.mpf(angle)
    for name, number in bars.items():
        yield {**length, name: number + side * _half_ulp(float(number))}, mp.mpf(angle)


def _half_ulp(number):
    return mp.mpf(float(np.spacing(abs(number)))) / 2


def _distance(name, old, new):
    return abs(_turned(old, new)) if name.startswith('angle') else abs(new - old)


def _turned(old, new):
    """Return the angle between two directions that are close to each other."""
    return exact_poses.cross(old, new) / (old * mp.conj(new)).real


def _state(gap, slack):
    """Tell whether a closure meets, fails, or would do the other within rounding."""
    if abs(gap) <= GRAZE * slack:
        return 'grazes' if gap >= 0 else 'slips'
    return 'meets' if gap > 0 else 'fails'


def _evaluate(case, length, theta, links, rates):
    """Return the outputs and gaps at one angle; the angle of a joint stays a direction."""
    now = exact_poses.place(case.kind, length, theta, case.branches)
    values = _placed(now, links)
    if rates:
        before, after = (
            _placed(exact_poses.place(case.kind, length, theta + step, case.branches), links)
            for step in (-_STEP, _STEP))
        for name in list(values):
            values[_rate_name(name)] = _difference(name, before[name], after[name]) / (2 * _STEP)
    return values, now.gaps


def _placed(pose, links):
    by_name = {link.name: link for link in links}
    values = dict(pose.points)
    if pose.slide is not None:
        values['slide'] = pose.slide
    for link in links:
        if link.kind == 'revolute':
            values[f'angle {link.name}'] = _direction(pose.points, link, by_name)
    return values


def _direction(points, link, by_name):
    """Return the direction of a link as its parent sees it."""
    bar = points[link.tip] - points[link.joint]
    if link.parent != 'ground':
        parent = by_name[link.parent]
        bar *= mp.conj(points[parent.tip] - points[parent.joint])
    quarters = round(link.zero / (math.pi / 2))
    return bar * (-exact_poses.I) ** quarters


def _rate_name(name):
    if name.startswith('angle '):
        return 'rate ' + name[6:]
    return 'rate slide' if name == 'slide' else f'velocity {name}'


def _difference(name, before, after):
    return _turned(before, after) if name.startswith('angle') else after - before


# --- the verdict --------------------------------------------------------------------------------

def measure(mechanism, thetas, rates=False, label='') -> List[Row]:
    """Measure all that a mechanism answers at crank angles [rad], `rates` with the derivatives."""
    case = case_of(mechanism, thetas, label)
    return judge(case, answers(mechanism, case.thetas, rates), mechanism.links, rates)


def case_of(mechanism, thetas, label=''):
    """Return a mechanism and its crank angles [rad] as a `Case`."""
    return Case(mechanism.type, mechanism.dimensions, np.asarray(thetas, float),
                mechanism.branches, label)


def judge(case, found, links, rates=False, exact=None) -> List[Row]:
    """Measure {output: array} at every angle of a case; `exact` are its truths, if known."""
    exact = exact or [truth(case, theta, links, rates) for theta in case.thetas]
    top = _top_speeds(case, links) if rates else {}
    return [row_of(case, theta, output, results[index], exact[index],
                   _due(case.kind, output, exact[index].closures, links), top)
            for index, theta in enumerate(case.thetas) for output, results in found.items()]


def _due(kind, output, closures, links):
    """Tell what is due: 'number', 'nan', 'either', or 'any' where no true pose exists nearby."""
    return due_of({closures[name] for name in _needs(kind, output, links)})


def due_of(states):
    """Tell what is due where closures are in some states, as `_due` does."""
    states = set(states)
    if states <= {'meets'}:
        return 'number'
    if 'slips' in states:
        return 'any'
    return 'either' if 'grazes' in states else 'nan'


def _needs(kind, output, links):
    """Return the closures that an output depends on; the tip of a link stands for the link."""
    needs = exact_poses.KINDS[kind].needs
    what, _, name = output.rpartition(' ')
    if name == 'slide':
        return needs['L']
    if what in ('angle', 'rate'):
        chain = _chain(name, {link.name: link for link in links})
        return ''.join(needs.get(joint, '') for joint in chain)
    return needs.get(name, '')


def _chain(name, by_name):
    link = by_name[name]
    yield from (link.joint, link.tip)
    if link.parent != 'ground':
        parent = by_name[link.parent]
        yield from (parent.joint, parent.tip)


def row_of(case, theta, output, result, exact, due, top):
    """Return the `Row` of one result, from what is due and the top speeds of outputs."""
    spread = float(exact.sensitivity[output])
    rate = output.startswith(('rate', 'velocity'))
    error, ratio, problem = math.nan, 0.0, ''
    if np.any(np.isnan(result)) or (rate and due != 'number' and np.any(np.isinf(result))):
        problem = 'NaN' if due == 'number' else ''
    elif due == 'nan':
        problem = 'missed NaN'
    elif due == 'number' or due == 'either' and not rate:
        error = float(_error(output, result, exact.values[output]))
        excess = max(0.0, error - _ulp(case, output, result, due))
        ratio = 0.0 if not excess else excess / spread if spread else math.inf
        if rate:
            ratio = min(ratio, RULE * error / (SPEED_RULE * UNIT * top[output]))
        if ratio > RULE:
            problem = 'rule'
    return Row(case.kind, case.label, output, math.inf if 'NaN' in problem else ratio, problem,
               error, spread, float(theta), case.dimensions, case.branches)


def _ulp(case, output, result, due):
    """Return an ulp of the result; on a limit, where it may be zero by itself, of its scale."""
    if output.startswith('angle'):
        return float(np.spacing(math.pi))
    size = np.max(np.abs(result))
    if due == 'either':
        size = max(size, *case.dimensions.values())
    return float(np.spacing(size))


def _error(output, result, value):
    if output.startswith('angle'):
        return abs(mp.arg(value * mp.expj(-mp.mpf(float(result)))))
    if np.ndim(result):
        return abs(mp.mpc(*map(float, result)) - value)
    return abs(mp.mpf(float(result)) - value)


def _top_speeds(case, links, angles=24):
    """Return every output's largest speed over a turn; at least a crank's of its own kind."""
    length = exact_poses.exact(case.dimensions)
    crank = abs(exact_poses.place(case.kind, length, mp.zero, case.branches).points['A'])
    top = {}
    for theta in np.arange(angles) * (2 * math.pi / angles) + 0.1:
        values, gaps = _evaluate(case, length, mp.mpf(theta), links, True)
        for name, value in values.items():
            if name.startswith(('rate', 'velocity')):
                least = 1.0 if name.startswith('rate') and name != 'rate slide' else crank
                reached = all(gap > 0 for gap in gaps.values())
                top[name] = max(top.get(name, 0.0), float(least),
                                float(abs(value)) if reached else 0.0)
    return top


def broken(rows):
    """Return the rows that break the rule, worst first."""
    return sorted((row for row in rows if row.problem), key=lambda row: -row.ratio)


def measure_servo(lever, angles, label='') -> List[Row]:
    """
    Measure a slotted lever's inverse at lever angles [rad].

    Each crank angle on the lever's half of the slot is asked for as the one nearest to the truth.
    """
    half = lever.branches['L']
    case = Case(lever.type, lever.dimensions, angles, lever.branches, label)
    top = {'rate servo': lever.dimensions['a'] / lever.dimensions['b']}
    return [row for angle in angles for row in servo_rows(
        case, lever, angle, partial(servo_truth, lever.dimensions, half), top)]


def servo_rows(case, lever, angle, truth_at, top) -> List[Row]:
    """Return the rows of one lever angle; `truth_at` takes it and the cut."""
    cuts = [truth_at(angle, cut) for cut in (1, -1)]
    states = [due_of(exact.closures.values()) for exact in cuts]
    wanted = 'number' if 'number' in states else 'nan' if states == ['nan', 'nan'] else ''
    rows = []
    for exact, state in zip(cuts, states):
        if state == wanted:
            near = float(mp.arg(exact.values['angle servo']))
            found = lever.servo_for('lever', float(angle), near)
            due = wanted if wanted == 'number' else _due_beyond(lever, angle, truth_at, found[0])
            if abs(exact.values['rate servo']) * np.spacing(math.pi) > FARTHEST:
                due = 'any'  # a jump: no crank's angle that is a float has the value
            exact.sensitivity['rate servo'], is_end = _rate_moved(
                lever, *found, exact.sensitivity['rate servo'])
            if is_end:
                # The answer next to an end of the crank is two ulps of pi inside.
                exact.sensitivity['angle servo'] += 0.5 * np.spacing(math.pi)
            judged = [row_of(case, angle, name, result, exact, due if name == 'angle servo'
                             or not is_end else 'any', top)
                      for name, result in zip(('angle servo', 'rate servo'), found)]
            # Up to ENDS from the value of an end that end is the answer.
            if not any(row.problem == 'rule' for row in judged) or not (
                    _ends_beside(truth_at, angle) and _missed(lever, angle, found[0]) <= ENDS):
                rows += judged
    return rows


def _ends_beside(truth_at, angle):
    """Return whether the reach ends up to twice ENDS from a lever angle."""
    return any(['nan', 'nan'] == [due_of(truth_at(angle + step, cut).closures.values())
                                  for cut in (1, -1)] for step in (-2.0 * ENDS, 2.0 * ENDS))


def _missed(lever, angle, crank):
    """Return how far the lever is from an angle [rad] at a crank's angle, with its rounding."""
    reached = float(lever.joint_angles(crank)['lever'])
    return abs(math.remainder(reached - angle, math.tau)) - 4.0 * np.spacing(abs(angle))


def _rate_moved(lever, crank, rate, spread):
    """
    Return the sensitivity of a pose's rate, and whether an end of the crank is next to the pose.

    The crank's angle is rounded, too. Where it is the end of the slot up to rounding, the rate is
    infinite: the answer has that of a pose next to it.
    """
    around = crank + np.arange(-ULPS, ULPS + 1) * np.spacing(max(abs(crank), 1.0))
    rates = lever.joint_rates(around)['lever']
    known = rates[np.isfinite(rates)]
    if len(known) < len(rates):
        return spread, len(known) and known.min() <= rate <= known.max()
    return spread + 0.5 * float(np.abs(np.diff(rates[ULPS - 1:ULPS + 2])).max()), False


def _due_beyond(lever, angle, truth_at, found):
    """
    Return what is due at a lever angle beyond the reach, as `due_of` does.

    Up to BEYOND from its end that end is the answer; or from as far as ULPS of the crank's angle
    turn the lever there.
    """
    if math.isnan(found):
        states = [due_of(truth_at(angle + step, cut).closures.values())
                  for step in (-0.5 * BEYOND, 0.5 * BEYOND) for cut in (1, -1)]
        return 'number' if 'number' in states else 'nan'
    around = found + np.array([0, -ULPS, ULPS]) * np.spacing(max(abs(found), 1.0))
    lever_angles = lever.joint_angles(around)['lever']
    change = np.nanmax(np.abs(np.sin(lever_angles - lever_angles[0])))
    missed = abs(math.remainder(lever_angles[0] - angle, math.tau))
    return 'any' if missed <= 1.001 * max(BEYOND, min(change, FARTHEST)) else 'nan'


def summary(rows, count=5):
    """Return the worst failures as text that reproduces them."""
    return '\n'.join(
        f'{row.problem} {row.kind} {row.output} at {row.theta!r}: ratio {row.ratio:.3g}, '
        f'error {row.error:.3g}, sensitivity {row.sensitivity:.3g}, {row.dimensions} '
        f'{row.branches or ""}' for row in broken(rows)[:count])
