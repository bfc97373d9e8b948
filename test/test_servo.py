# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A lever's servo angle and reduction: one closed form, right to the last digits everywhere."""

from functools import partial
import math

from linkage_ros import mechanisms
import numpy as np
import pytest
from truth import accuracy_rule, hard_cases
from truth.accuracy_rule import broken, Case, mp, STEP, summary

# Levers: the lines, crank centre and pivot as complex numbers, and whether the crank's zero is up.
PIVOT_BELOW = ('O ground 0 0', 'Q ground 0 -b', 'A crank O a up',
               'L slot Q A e out max(1.8*b,a+b)')
LEVERS = {
    'slotted_lever': (None, lambda a, b, e: (0, mp.mpc(0, -b)), True),
    'written': (PIVOT_BELOW, lambda a, b, e: (0, mp.mpc(0, -b)), True),
    'with a ram': ((*PIVOT_BELOW, 'R slider L 50*a+50*b Q 0 out'),
                   lambda a, b, e: (0, mp.mpc(0, -b)), True),
    'turned': (('O ground 0 0', 'Q ground b 0', 'A crank O a', 'L slot Q A e out a'),
               lambda a, b, e: (0, mp.mpc(b)), False),
    'oblique': (('O ground x y', 'Q ground p q', 'A crank O a', 'L slot Q A e out a'),
                lambda a, e, x, y, p, q: (mp.mpc(x, y), mp.mpc(p, q)), False),
}


def random_levers(kind, seed, count):
    """Yield levers, some nearly degenerate, each with awkward lever angles."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        lengths, half = hard_cases.dimensions('slotted_lever', rng), int(rng.choice((-1, 1)))
        own = mechanisms.create('slotted_lever', branches={'L': half}, **lengths)
        ends = [end for arc in own.reach() for end in arc]
        limits = [end for arc in own.lever_reach() for end in arc]
        limits += [x for x in own.joint_angles(np.array(ends))['lever'] if x == x]
        turn = {'turned': math.pi / 2, 'oblique': rng.uniform(-3.0, 3.0)}.get(kind, 0.0)
        if kind == 'oblique':
            b, (x, y) = lengths.pop('b'), rng.uniform(-1.0, 1.0, 2)
            lengths.update(x=x, y=y, p=x + b * math.sin(turn), q=y - b * math.cos(turn))
        joints = LEVERS[kind][0]
        made = own if joints is None else mechanisms.create(
            'custom', joints=joints, branches={'L': half}, **lengths)
        yield made, hard_cases.angles(rng, 4, limits, turns=1.0) + turn


def truth_of(kind, linkage, angle, cut):
    """Return the truth of a lever's inverse on one cut of its slot with the crank circle."""
    _, places, upright = LEVERS[kind]
    half = linkage.branches['L']

    def cut_at(length, angle):
        centre, pivot = places(**length)
        slot = mp.mpc(0, 1) * mp.expj(angle)
        foot = pivot + mp.mpc(0, 1) * slot * length['e'] - centre
        seen = foot * mp.conj(slot)
        gap = length['a'] ** 2 - seen.imag ** 2
        slide = cut * mp.sqrt(max(gap, mp.zero)) - seen.real
        return (foot + slide * slot) / (mp.mpc(0, 1) if upright else 1), slide, gap

    def evaluate(length, angle):
        pin, slide, gap = cut_at(length, angle)
        after, before = (cut_at(length, angle + step)[0] for step in (STEP, -STEP))
        turned = mp.arg(after / before)
        return ({'angle servo': pin / abs(pin),
                 'rate servo': 2 * STEP / turned if turned else mp.zero},
                {'servo': gap, 'slide': half * slide})

    return accuracy_rule.truth_of(evaluate, linkage.dimensions, float(angle))


def rows_of(kind, linkage, angles):
    """Return how right the servo angles and reductions are, each asked for as the nearest."""
    length = linkage.dimensions
    case = Case('slotted_lever', length, angles, linkage.branches, kind)
    top = {'rate servo': length['a'] / length.get('b', length['a'])}
    return [row for angle in angles for row in accuracy_rule.servo_rows(
        case, linkage, angle, partial(truth_of, kind, linkage), top)]


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('levers', [3, pytest.param(12, marks=pytest.mark.nightly)])
@pytest.mark.parametrize('kind', LEVERS)
def test_servo_angles_and_reductions_of_any_lever_are_right(kind, levers):
    rows = []
    for linkage, angles in random_levers(kind, 1, levers):
        rows += rows_of(kind, linkage, angles)
    assert len(rows) > 4 * levers
    assert not broken(rows), summary(rows)


@pytest.mark.nightly
@pytest.mark.parametrize('kind', LEVERS)
def test_servo_angles_and_reductions_of_many_levers_are_right(kind):
    test_servo_angles_and_reductions_of_any_lever_are_right(kind, 250)


@pytest.mark.parametrize('half', [1, -1])
def test_a_lever_is_one_computation_whatever_it_is_asked_by(half):
    rng = np.random.default_rng(4)
    wanted, near = rng.uniform(-4.0, 4.0, 200), rng.uniform(-20.0, 20.0, 200)
    for lengths in ({'a': 80.0, 'b': 150.0, 'e': 20.0}, {'a': 150.0, 'b': 80.0, 'e': -30.0}):
        lever = mechanisms.create('slotted_lever', branches={'L': half}, **lengths)
        for written in ('slotted_lever', 'written', 'with a ram'):
            linkage = lever if written == 'slotted_lever' else mechanisms.create(
                'custom', joints=LEVERS[written][0], branches={'L': half}, **lengths)
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
    lever = mechanisms.create('slotted_lever', a=80.0, b=150.0, e=100.0, branches={'L': half})
    rows = []
    for end, inside in zip(lever.lever_reach()[0], (1.0, -1.0)):
        rows += accuracy_rule.measure_servo(lever, [
            end + inside * away for away in (1e-12, 1e-9, 1e-6, 1e-3, -1e-6, -1e-3)])
    # Rates are those of the pose at the rounded input, which an ulp of it changes here.
    rows = [row for row in rows if row.output == 'angle servo']
    assert len(rows) > 10 and not broken(rows), summary(rows)
