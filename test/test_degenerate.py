# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Linkages whose bars are alike, whose arms vanish, or of which a part cannot be assembled."""

import math
import tracemalloc

from effort import few_calls
from linkage_ros import mechanisms
from linkage_ros.linkage.inputs import CRANK
import numpy as np
import pytest


def linkage(*joints, **dimensions):
    """Return a linkage written down."""
    return mechanisms.create('custom', joints=joints, **dimensions)


FOUR_BAR = 'O ground 0 0', 'Q ground 4 0', 'A crank O 1', 'B dyad A Q 3.5 3 left'


@pytest.mark.parametrize('away', [0.0, 1e-15, 1e-12, 1e-8, 1e-4, 0.1])
def test_a_kite_over_an_arm_of_no_length_has_its_velocity(away):
    # B is the crank's centre, mirrored: it goes round a circle of radius r about C at crank speed.
    r = 0.3
    kite = linkage('O ground 0 0', 'C ground -r 0', 'A crank O r', 'B mirror O C A', r=r)
    for theta in (math.pi - away, away - math.pi, -away):
        expected = [-r * math.sin(theta), r * math.cos(theta)]
        np.testing.assert_allclose(kite.velocity(theta)['B'], expected, atol=1e-15)
        rates = kite.joint_rates(theta)
        assert rates['CB'] == pytest.approx(1.0, abs=1e-14)
        assert rates['AB'] == pytest.approx(-1.0, abs=1e-14)


@pytest.mark.parametrize('away', [1e-15, 1e-12, 1e-8, 1e-4, 0.1])
def test_a_lever_whose_pin_passes_the_pivot_turns_at_half_the_speed_of_the_crank(away):
    lever = mechanisms.create('slotted_lever', a=0.7, b=0.7)
    for theta in (math.pi - away, away - math.pi, 0.5):
        assert lever.joint_rates(theta)['lever'] == pytest.approx(0.5, abs=1e-14)


@pytest.mark.parametrize('far', [0.0, 1e3, 1e6])
def test_an_arm_that_is_a_bar_keeps_its_length_however_far_the_linkage_is_from_the_origin(far):
    found = linkage('O ground x x', 'Q ground x+4 x', 'A crank O 1', 'B dyad A Q 3.5 3 left',
                    'C rigid A B 2 2 left', 'L slot O A 0.6 out 3', 'D dyad A B 3 2 left',
                    'E dyad C B 2.5 2 right', x=far)
    near = linkage('O ground 0 0', 'Q ground 4 0', 'A crank O 1', 'B dyad A Q 3.5 3 left',
                   'C rigid A B 2 2 left', 'L slot O A 0.6 out 3', 'D dyad A B 3 2 left',
                   'E dyad C B 2.5 2 right')
    theta = np.linspace(-3.0, 3.0, 30)
    here, there = near.joint_angles(theta), found.joint_angles(theta)
    np.testing.assert_allclose(there['slide'], 0.8, rtol=1e-15)
    for name in ('AD', 'BD', 'CE', 'BE'):
        # They stand on one link, which they never move on.
        np.testing.assert_allclose(there[name], here[name], atol=2e-15 + 1e-15 * far)
    assert found.dead_points() == []


@pytest.mark.nightly
def test_a_long_chain_is_no_matter_of_recursion():
    chain = linkage(*FOUR_BAR[:3], 'B0 dyad A Q 3.5 3 left', *(
        f'B{i} dyad B{i - 1} Q 3 3 left' for i in range(1, 120)))
    velocity, rates = chain.velocity(0.5, ('B119',)), chain.joint_rates(0.5)
    assert np.isfinite(velocity['B119']).all() and len(rates) == 241
    ahead, behind = (chain.solve(0.5 + step, ('B119',))['B119'] for step in (1e-7, -1e-7))
    np.testing.assert_allclose(velocity['B119'], (ahead - behind) / 2e-7, rtol=1e-5)
    assert chain.reach() == [(-math.pi, math.pi)]


@pytest.mark.nightly
def test_what_is_asked_again_and_again_does_not_pile_up():
    five_bar = mechanisms.create('five_bar')

    def ask(first, last):
        for other in np.linspace(first, last, 60).tolist():
            five_bar.input_for('P.y', 40.0, others=(other,))
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        before, after = ask(0.9, 1.0), ask(0.9001, 1.0001)
    finally:
        tracemalloc.stop()
    assert after - before < 500_000


def test_an_arc_of_the_reach_goes_on_past_a_limit_that_is_only_touched_at_minus_pi():
    # The parallelogram is flat at 0 and pi; the second dyad lets the crank swing about pi alone.
    found = linkage('O ground 0 0', 'Q ground 4 0', 'A crank O 1', 'B dyad A Q 4 1 left',
                    'R ground -2 0', 'C dyad A R 1.5 0.6 left')
    (lo, hi), = found.reach()
    assert lo < math.pi < hi and hi - math.pi == pytest.approx(math.pi - lo)


def test_a_kite_that_always_lies_flat_has_no_dead_points_of_its_own():
    found = linkage(*FOUR_BAR, 'P line A B 1', 'C mirror P A B')
    assert found.dead_points() == linkage(*FOUR_BAR).dead_points() == []


def test_the_reach_past_a_change_point_is_that_of_two_turns():
    # The four-bar changes sides at pi; the bar on its rocker meets C on one of them only.
    found = linkage('O ground 0 0', 'Q ground 4 0', 'A crank O 1', 'B dyad A Q 2 3 left',
                    'R ground 4 -4', 'C dyad B R 3 2.5 left')
    reach, theta = found.reach(), np.linspace(-math.tau, math.tau, 8001)[:-1]
    placed = np.isfinite(found.solve(theta)['C']).all(-1)
    inside = [found.inputs[0].on(reach, x) for x in theta.tolist()]
    assert placed.any() and not placed.all() and (placed == inside).all()
    assert all(-math.tau <= lo < math.tau and lo < hi for lo, hi in reach)
    # At pi the linkage changes to the side on which it is inside the reach, and back at -pi.
    ends = [float(found.inputs[0].wrapped(end)) for arc in reach for end in arc]
    assert found.dead_points() == pytest.approx(sorted([-math.pi, math.pi, *ends]))


@pytest.mark.parametrize('lengths, period', [
    ((1.0, 2.0, 3.0, 4.0), 2), ((1.0, 3.0, 2.0, 4.0), 2), ((2.0, 3.0, 2.0, 3.0), 1),
    ((1.0, 3.0, 3.0, 1.0), 2), ((1.0, 2.0, 2.5, 3.0), 1), ((1e-9, 2e-9, 3e-9, 4e-9), 2)])
def test_one_change_point_a_turn_doubles_the_period(lengths, period):
    found = mechanisms.create('four_bar', **dict(zip('abcd', lengths)))
    theta, (input_,) = np.linspace(-3.0, 3.0, 8), found.inputs
    assert found.period() == input_.period == period
    now, later, between = (found.solve(theta + turn, ('B',))['B'] for turn in (
        0.0, input_.turn, math.tau))
    np.testing.assert_allclose(later, now, atol=1e-14 * max(lengths))
    assert (period == 1) == np.allclose(between, now, atol=1e-3 * max(lengths))


@pytest.mark.parametrize('output', ['QB', 'AB', 'P.x', 'B.y'])
def test_the_inverse_has_the_answers_of_both_turns_about_a_change_point(output):
    found = mechanisms.create('four_bar', a=1.0, b=2.0, c=3.0, d=4.0)
    for theta in (0.3, -2.0, 4.0, -5.5):
        value = found.joint_angles(theta, (output,))[output]
        answers = found.input_for(output, value)
        assert np.nanmin(np.abs(answers - theta)) < 1e-12
        back = found.joint_angles(answers[np.isfinite(answers)], (output,))[output]
        np.testing.assert_allclose(np.abs(np.remainder(
            back - value + math.pi, math.tau) - math.pi), 0.0, atol=1e-13)
        assert found.input_for(output, value, theta + 2 * math.tau) == pytest.approx(
            theta + 2 * math.tau, abs=1e-12)


@pytest.mark.parametrize('theta', [3.1415926535897927, math.pi, -math.pi, 1e9, -7.0, 0.0])
def test_a_dead_point_is_between_minus_pi_and_pi(theta):
    wrapped = CRANK.distinct([theta])
    assert -math.pi <= wrapped[0] < math.pi
    assert abs(math.remainder(wrapped[0] - theta, math.tau)) < 1e-6
    assert wrapped == [theta] or not -math.pi <= theta < math.pi


@pytest.mark.parametrize('lengths, expected', [
    ({'a': 2.0, 'b': 3.0, 'c': 2.0, 'd': 3.0}, [-math.pi, 0.0]),
    ({'a': 2.0, 'b': 4.0, 'c': 3.0, 'd': 3.0}, [-math.tau, 0.0])])
def test_a_dead_point_at_zero_is_zero(lengths, expected):
    assert mechanisms.create('four_bar', **lengths).dead_points() == expected


def test_a_reach_is_found_that_has_no_pose_in_its_middle():
    # At zero A, B and C are in line and E is at A, so that nothing can be mirrored in A-E.
    found = linkage('A ground 0 0', 'B ground 3 0', 'C crank A 0.3', 'E mirror A C B',
                    'H mirror B A E', 'K slider H 7 B 90deg in')
    assert found.reach() == [(-math.pi, math.pi)]


@pytest.mark.parametrize('value, last', [
    (1.5, 'S slider A 0.5 O 0 out'), (0.1, 'S slider A 0.5 O 90deg out')])
def test_a_block_that_cannot_be_assembled_has_neither_coordinate(value, last):
    found = linkage('O ground 0 0', 'A crank O 1', last)
    assert np.isnan(found.solve(value)['S']).all()


@pytest.mark.parametrize('geared, rate', [('', 0.0), (' geared crank -2 0.5', -2.0)])
def test_what_drives_is_a_number_wherever_it_is(geared, rate):
    found = linkage(*FOUR_BAR[:3], 'B dyad A Q 1 1 left', f'C crank B 1 zero A{geared}')
    given = 0.3 if geared else [0.3, 0.7]
    assert np.isnan(found.solve(given)['C']).all()
    assert found.joint_angles(given)['crank2'] == (0.5 - 2 * 0.3 if geared else 0.7)
    assert found.joint_rates(given)['crank2'] == rate


@pytest.mark.parametrize('name, ratio', [('QB', 1.0), ('SD', math.sqrt(2.0)), ('E.x', None)])
def test_gears_that_hardly_come_round_are_answered_in_the_turn_that_is_asked_for(name, ratio):
    # A four-bar, another one geared to it, and a distance that depends on both.
    found = linkage('O ground 0 0', 'Q ground 3 0', 'A crank O 1', 'B dyad A Q 3 2 left',
                    'R ground 10 0', 'S ground 13 0', 'C crank R 1 geared crank sqrt(2) 0.3',
                    'D dyad C S 3 2 left', 'E dyad B D 9 9 left')
    inverse = found.inverse(name)
    for theta in (0.4, 0.4 + 300 * 2.0 * math.pi, -1.1 - 31 * 2.0 * math.pi):
        value = float(found.joint_angles(theta, [name])[name])
        (answer,), _ = inverse.nearest((value,), (theta,))
        if ratio:
            assert answer == pytest.approx(theta, abs=1e-9)
            assert inverse.inputs[0].period == pytest.approx(1.0 / ratio)
            assert found.follow(name, value, theta)[0] == pytest.approx(theta, abs=1e-9)
        assert answer == pytest.approx(theta, abs=1e-9)
        assert float(found.joint_angles(answer, [name])[name]) == \
            pytest.approx(value, abs=1e-9)


@pytest.mark.parametrize('ratio, arcs', [('-2', 1), ('0.5', 2), ('sqrt(2)', 100)])
def test_an_arc_goes_on_past_pi_and_comes_once_a_turn_until_all_comes_round(ratio, arcs):
    # The crank swings about pi; another one turns with it.
    found = linkage('O ground 0 0', 'Q ground -3 0', 'A crank O 1', 'B dyad A Q 1.5 1.5 left',
                    f'E crank Q 1 geared crank {ratio} 0')
    reach = np.array(found.reach())
    assert reach.shape == (arcs, 2)
    # What never comes round again has the reach of the turns around zero.
    assert found.period() == (math.inf if ratio == 'sqrt(2)' else arcs)
    np.testing.assert_allclose(reach.mean(axis=1) % (2.0 * math.pi), math.pi)
    for theta in (3.1, -3.1):
        assert found.input_for('E.y', found.solve(theta)['E'][1], near=theta) == \
            pytest.approx(theta)


@pytest.mark.nightly
def test_the_reach_of_what_hangs_on_rounding_is_found_in_so_many_calls():
    # F is where A is: the mirror line F-A has a direction of rounding, and so has all behind it.
    lines = ('A ground -0.552 0', 'B ground 0 -0.4465', 'C ground 0 0',
             'D cylinder B C 0.476 left', 'E parallelogram C D A', 'F parallelogram D E C',
             'G mirror C F A', 'L dyad G B 3.5837 3.196 left')
    with few_calls(2_000_000):
        reach = linkage(*lines).reach()
    assert all(low < high for low, high in reach)
