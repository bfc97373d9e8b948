# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The reach, to the last digits of its ends, and a servo's angle in it: what brute force finds."""

import math

from linkage_ros import mechanisms
import numpy as np
import pytest
from truth import drawing_accuracy, hard_cases, linkage_checks

TURN = [(-math.pi, math.pi)]


def described(mechanism, *more):
    """Return what reproduces a failure."""
    return f'{mechanism.type} {mechanism.dimensions} {mechanism.branches} {more}'


@pytest.mark.nightly
@pytest.mark.parametrize('kind, count', [
    ('jansen', 25), ('peaucellier', 60), ('slotted_lever', 100)])
def test_every_end_of_the_reach_is_a_limit_to_the_last_digits(kind, count):
    ends = 0
    for mechanism, _ in hard_cases.linkages(kind, 3, count):
        measure = drawing_accuracy.strict(mechanism)
        for end in (end for arc in mechanism.reach() if [arc] != TURN for end in arc):
            ends += 1
            states = measure.at([end]).states
            assert {'grazes', 'slips'} & {*states.values()}, described(mechanism, end, states)
    assert ends > 20


@pytest.mark.parametrize('kind', ['peaucellier', 'slotted_lever'])
def test_a_joint_that_never_ends_the_reach_moves_no_end_of_it(kind):
    for mechanism, _ in hard_cases.linkages(kind, 8, 8):
        ground, rod = mechanism.grounded[0], 100.0 * sum(map(abs, mechanism.dimensions.values()))
        larger = mechanisms.create('custom', branches=mechanism.branches, joints=(
            *map(str, mechanism.design.joints), f'ZZ slider {mechanism.tracer} {rod!r} {ground} 0'
            ' out'), **mechanism.dimensions)
        assert larger.reach() == mechanism.reach(), described(mechanism)


@pytest.mark.parametrize('a, e', [(80.0, 0.0), (math.nextafter(80.0, 90.0), 0.0), (80.0, 1e-9)])
def test_a_lever_that_swings_a_half_turn_does_so_up_to_rounding(a, e):
    (lo, hi), = mechanisms.create('slotted_lever', a=a, b=80.0, e=e).lever_reach()
    assert hi == pytest.approx(-lo, abs=1e-5) == pytest.approx(0.5 * math.pi, abs=1e-5)


@pytest.mark.parametrize('ground, crank, line', [
    (0.3, 0.2, 'B dyad A Q 0.2 0.7 left'), (0.2, 0.7, 'B dyad A Q 0.3 0.2 left'),
    (0.6, 0.4, 'B dyad A Q 0.1 0.1 left'), (0.4, 0.2, 'B slot Q A 0.6 out 0.1')])
def test_a_linkage_that_fits_in_one_pose_alone_has_no_reach(ground, crank, line):
    # In floats the lengths differ by rounding from those that just fit, to either side.
    single = mechanisms.create('custom', joints=(
        'O ground 0 0', f'Q ground {ground} 0', f'A crank O {crank}', line))
    assert single.reach() == []


@pytest.mark.parametrize('half', [1, -1])
@pytest.mark.parametrize('count', [25, pytest.param(300, marks=pytest.mark.nightly)])
def test_a_lever_has_an_answer_just_where_the_slot_cuts_the_circle_of_the_crank(half, count):
    rng = np.random.default_rng(2)
    for _ in range(count):
        lengths, angles = hard_cases.dimensions('slotted_lever', rng), rng.uniform(-4.0, 4.0, 40)
        lever = mechanisms.create('slotted_lever', branches={'L': half}, **lengths)
        gap = hard_cases.lever_gap(lengths, angles, half)
        cranks, reductions = lever.servo(angles)
        clear = np.abs(gap) > 1e-9
        assert (np.isfinite(cranks) == (gap > 0.0))[clear].all(), lever
        reached = linkage_checks.inside(lever.lever_reach(), angles, math.tau)
        assert (reached == (gap > 0.0))[clear].all(), lever
        np.testing.assert_array_equal(lever.servo_angle(angles), cranks)
        steady = clear & (np.abs(gap) > 1e-3)
        np.testing.assert_allclose(lever.reduction(cranks)[steady], reductions[steady], 1e-9)


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

    def value(theta):
        return linkage.joint_angles(theta, (output,))[output]

    extremes = linkage.input_for(output, np.max(value(np.linspace(-3.1, 3.1, 20001))))
    for low in (*rng.uniform(-9.0, 9.0, 20), *extremes[np.isfinite(extremes)]):
        ends = float(low), float(low) + 0.1
        for end in ends:
            theta, _ = linkage.servo_for(output, float(value(end)), None, ends)
            assert ends[0] <= theta <= ends[1]
