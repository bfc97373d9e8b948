# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A lever's servo angle and reduction, nearly degenerate ones included, and which is chosen."""

import math

from linkage_ros import mechanisms
import numpy as np
import pytest
from truth import hard_cases, linkage_checks


@pytest.mark.parametrize('half', [1, -1])
@pytest.mark.parametrize('count', [25, pytest.param(300, marks=pytest.mark.nightly)])
def test_a_lever_has_an_answer_just_where_the_slot_cuts_the_circle_of_the_crank(half, count):
    rng = np.random.default_rng(2)
    for _ in range(count):
        lengths, angles = hard_cases.dimensions('slotted_lever', rng), rng.uniform(-4.0, 4.0, 40)
        lever = mechanisms.create('slotted_lever', branches={'L': half}, **lengths)
        gap = hard_cases.lever_gap(lengths, angles, half)
        found, reductions = lever.servo(angles)
        clear = np.abs(gap) > 1e-9
        assert (np.isfinite(found) == (gap > 0.0))[clear].all(), lever
        reached = linkage_checks.inside(lever.lever_reach(), angles, math.tau)
        assert (reached == (gap > 0.0))[clear].all(), lever
        np.testing.assert_array_equal(lever.servo_angle(angles), found)
        steady = clear & (np.abs(gap) > 1e-3)
        np.testing.assert_allclose(lever.reduction(found)[steady], reductions[steady], 1e-9)


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
