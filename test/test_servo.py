# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A lever's servo angle and reduction: one closed form, right to the last digits everywhere."""

import math

from linkage_ros import mechanisms
import numpy as np
import pytest
from truth import drawing_accuracy, hard_cases
from truth.drawing import DIGITS, precisely

# The lines of levers; their angles are those of `slotted_lever` plus a turn.
PIVOT_BELOW = ('O ground 0 0', 'Q ground 0 -b', 'A crank O a up',
               'L slot Q A e out max(1.8*b,a+b)')
LEVERS = {
    'slotted_lever': None, 'written': PIVOT_BELOW,
    'with a ram': (*PIVOT_BELOW, 'R slider L 50*a+50*b Q 0 out'),
    'turned': ('O ground 0 0', 'Q ground b 0', 'A crank O a', 'L slot Q A e out a'),
    'oblique': ('O ground x y', 'Q ground p q', 'A crank O a', 'L slot Q A e out a')}


def random_levers(kind, seed, count):
    """Yield levers, some nearly degenerate, awkward crank angles, and their lengths and turn."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        lengths, half = hard_cases.dimensions('slotted_lever', rng), int(rng.choice((-1, 1)))
        own = mechanisms.create('slotted_lever', branches={'L': half}, **lengths)
        arcs, given = own.reach(), dict(lengths)
        spots = [end for arc in arcs for end in arc] + [
            at for pair in own.extremes('lever') for _, at in pair]
        turn = {'turned': math.pi / 2, 'oblique': rng.uniform(-3.0, 3.0)}.get(kind, 0.0)
        if kind == 'oblique':
            b, (x, y) = given.pop('b'), rng.uniform(-1.0, 1.0, 2)
            given.update(x=x, y=y, p=x + b * math.sin(turn), q=y - b * math.cos(turn))
        made = own if LEVERS[kind] is None else mechanisms.create(
            'custom', joints=LEVERS[kind], branches={'L': half}, **given)
        yield made, hard_cases.angles(rng, 4, spots, turns=1.0) + turn, lengths, turn


class Lever:
    """What `servo_for` answers beside the true angle of a lever and its rate."""

    def __init__(self, linkage):
        self.linkage, self.measure = linkage, drawing_accuracy.strict(linkage)
        self.angle = next(out for out in self.measure.poses if str(out) == 'angle lever')

    @precisely
    def at(self, theta):
        """Return the true angle at a crank angle, what rounding does to it, and the truth."""
        truth, i = self.measure.at([theta], True), self.measure.poses.index(self.angle)
        return DIGITS.direction(truth.values[i]), truth.sensitivity[i], truth

    @precisely
    def problem(self, value, theta, rate):
        """Return what is wrong with an answer; up to 1e-13 from an end's value is the end."""
        angle, spread, truth = self.at(theta)
        error = abs(float(DIGITS.direction(DIGITS.turned(angle - value))))
        # Next to an end of the reach an answer is up to four ulps inside.
        if not error <= max(8.0 * spread + np.spacing(math.pi), 1e-13):
            return f'{theta} has not the value {value}: {error:.2g} off, sensitivity {spread:.2g}'
        # Next to an end the rate is that of the nearest float that has one.
        rows = drawing_accuracy.judge(self.measure, [[theta]], {
            self.angle._replace(by=0): [rate]}, True, [truth]) if math.isfinite(
                self.linkage.joint_rates(theta, ('lever',))['lever']) else ()
        return drawing_accuracy.summary(self.linkage, rows) if drawing_accuracy.broken(
            rows) else ''


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('levers', [3, pytest.param(12, marks=pytest.mark.nightly)])
@pytest.mark.parametrize('kind', LEVERS)
def test_servo_angles_and_reductions_of_any_lever_are_right(kind, levers):
    judged = 0
    for linkage, thetas, _, _ in random_levers(kind, 1, levers):
        lever = Lever(linkage)
        for theta in thetas.tolist():
            angle, _, truth = lever.at(theta)
            rate = truth.values[len(lever.measure.poses) + lever.measure.poses.index(lever.angle)]
            # Steeper it is a jump: no crank's angle that is a float has the value.
            if lever.measure.due(lever.angle, truth.states) == 'number' \
                    and abs(rate) * np.spacing(math.pi) < 1e-6:
                judged += 1
                found, rate = linkage.servo_for('lever', float(angle), theta)
                assert abs(found - theta) < 1e-6, (linkage, theta, found)
                problem = lever.problem(float(angle), found, rate)
                assert not problem, (linkage, theta, problem)
    assert judged > levers


@pytest.mark.nightly
@pytest.mark.parametrize('kind', LEVERS)
def test_servo_angles_and_reductions_of_many_levers_are_right(kind):
    test_servo_angles_and_reductions_of_any_lever_are_right(kind, 250)


@pytest.mark.parametrize('kind', LEVERS)
def test_a_lever_has_an_answer_just_where_the_slot_cuts_the_circle_of_the_crank(kind):
    angles = np.random.default_rng(2).uniform(-math.pi, math.pi, 40)
    for linkage, _, lengths, turn in random_levers(kind, 3, 5):
        gap = hard_cases.lever_gap(lengths, angles, linkage.branches['L'])
        found, rates = linkage.servo_for('lever', angles + turn)
        clear = np.abs(gap) > 1e-9
        assert (np.isfinite(found) == (gap > 0.0))[clear].all(), linkage
        lever = Lever(linkage)
        for value, *answer in list(zip(angles + turn, found, rates))[:6]:
            assert math.isnan(answer[0]) or not lever.problem(float(value), *map(float, answer))


@pytest.mark.parametrize('half', [1, -1])
def test_a_lever_is_one_computation_whatever_it_is_asked_by(half):
    rng = np.random.default_rng(4)
    wanted, near = rng.uniform(-4.0, 4.0, 200), rng.uniform(-20.0, 20.0, 200)
    for lengths in ({'a': 80.0, 'b': 150.0, 'e': 20.0}, {'a': 150.0, 'b': 80.0, 'e': -30.0}):
        lever = mechanisms.create('slotted_lever', branches={'L': half}, **lengths)
        for written in ('slotted_lever', 'written', 'with a ram'):
            linkage = lever if written == 'slotted_lever' else mechanisms.create(
                'custom', joints=LEVERS[written], branches={'L': half}, **lengths)
            # Other lines of the same lever are rounded in other places.
            for found, expected in ((linkage.input_for('lever', wanted, near),
                                     lever.servo_angle(wanted, near)),
                                    (linkage.servo_for('lever', wanted, near),
                                     lever.servo(wanted, near))):
                np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-14)
            every = linkage.input_for('lever', wanted)
            found, _ = linkage.servo_for('lever', wanted)
            assert ((every == found[:, None]).any(axis=1) == np.isfinite(found)).all()


@pytest.mark.parametrize('near, ends, answer', [
    (None, None, 0), (0.5, (0.0, 2.0), 0), (2.5, (0.0, 2.0), 0), (None, (2.0, 6.0), 1),
    (0.0, (6.0, 9.0), 0), (9.0, (6.0, 9.5), 1), (None, (0.0, 20.0), 0), (19.0, (0.0, 20.0), 0),
    (None, (-4.0, -2.0), 1), (-2.6, (-3.0, -1.0), None), (None, (1.0, 2.0), None)])
def test_an_answer_is_taken_between_the_ends_whole_turns_included(near, ends, answer):
    lever = mechanisms.create('slotted_lever')
    (both,), rates = lever.inverse('lever').over(0.3)
    theta, rate = lever.servo_for('lever', 0.3, near, ends)
    if answer is None:
        assert math.isnan(theta) and math.isnan(rate)
        return
    turns = (theta - both[answer]) / (2 * math.pi)
    assert turns == pytest.approx(round(turns), abs=1e-15) and rate == rates[0, answer]
    low, high = ends or (-math.pi, math.pi)
    assert low <= theta <= high


@pytest.mark.parametrize('kind, output', [
    ('slotted_lever', 'lever'), ('four_bar', 'QB'), ('slider_crank', 'block'),
    pytest.param('jansen', 'G.x', marks=pytest.mark.nightly)])
def test_the_value_at_an_end_is_had_at_that_end(kind, output):
    linkage, rng = mechanisms.create(kind), np.random.default_rng(5)
    joint, _, axis = output.rpartition('.')

    def value(theta):
        return (linkage.solve(theta, (joint,))[joint][..., 'xy'.index(axis)] if joint
                else linkage.joint_angles(theta, (output,))[output])

    extremes = linkage.input_for(output, np.max(value(np.linspace(-3.1, 3.1, 20001))))
    for low in (*rng.uniform(-9.0, 9.0, 20), *extremes[np.isfinite(extremes)]):
        ends = float(low), float(low) + 0.1
        for end in ends:
            theta, _ = linkage.servo_for(output, float(value(end)), None, ends)
            assert ends[0] <= theta <= ends[1]


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('near', [None, 2.5])
@pytest.mark.parametrize('ends', [None, (0.0, 6.0)])
def test_machine_code_takes_the_answers_that_plain_python_takes(near, ends):
    pytest.importorskip('llvmlite')
    lever = mechanisms.create('slotted_lever', e=20.0)
    wanted = np.linspace(-1.0, 1.0, 150)
    found = lever.accelerated().servo_for('lever', wanted, near, ends)
    alone = np.transpose([lever.servo_for('lever', each, near, ends) for each in wanted.tolist()])
    assert 50 < np.isfinite(alone[0]).sum() < 150
    np.testing.assert_allclose(found, alone, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize('half', [1, -1])
def test_next_to_the_end_of_the_slot_the_lever_is_right_and_beyond_it_has_no_answer(half):
    # There the crank stands still; a value up to 1e-9 beyond the end is the end's.
    linkage = mechanisms.create('slotted_lever', a=80.0, b=150.0, e=100.0, branches={'L': half})
    lever = Lever(linkage)
    for end, inside in zip(linkage.lever_reach()[0], (1.0, -1.0)):
        for away in (1e-12, 1e-9, 1e-6, 1e-3):
            value = end + inside * away
            for near in (-0.5 * math.pi, 0.5 * math.pi):
                problem = lever.problem(value, *linkage.servo_for('lever', value, near))
                assert 'has not the value' not in problem
        for away in (1e-6, 1e-3):
            assert math.isnan(linkage.servo_angle(end - inside * away))
