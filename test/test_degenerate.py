# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Linkages whose bars are alike, whose arms vanish, whose strokes are short, or that end."""

import math
import tracemalloc

from effort import few_calls
from linkage_ros import mechanisms
from linkage_ros.robot_model import urdf
from linkage_ros.scene.legs import LegGroup
import numpy as np
import pytest
from robots import Pinocchio
from scenes import alone, custom

FOUR_BAR = 'O ground 0 0', 'Q ground 4 0', 'A crank O 1', 'B dyad A Q 3.5 3 left'


@pytest.mark.nightly
def test_a_long_chain_is_no_matter_of_recursion():
    chain = custom(*FOUR_BAR[:3], 'B0 dyad A Q 3.5 3 left', *(
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


def test_a_kite_that_always_lies_flat_has_no_dead_points_of_its_own():
    linkage = custom(*FOUR_BAR, 'P line A B 1', 'C mirror P A B')
    assert linkage.dead_points() == custom(*FOUR_BAR).dead_points() == []


@pytest.mark.parametrize('lengths, period', [
    ((1.0, 2.0, 3.0, 4.0), 2), ((1.0, 3.0, 2.0, 4.0), 2), ((2.0, 3.0, 2.0, 3.0), 1),
    ((1.0, 3.0, 3.0, 1.0), 2), ((1.0, 2.0, 2.5, 3.0), 1), ((1e-9, 2e-9, 3e-9, 4e-9), 2)])
def test_one_change_point_a_turn_doubles_the_period(lengths, period):
    linkage = mechanisms.create('four_bar', **dict(zip('abcd', lengths)))
    theta, (input_,) = np.linspace(-3.0, 3.0, 8), linkage.inputs
    assert linkage.period() == input_.period == period
    now, later, between = (linkage.solve(theta + turn, ('B',))['B'] for turn in (
        0.0, input_.turn, math.tau))
    np.testing.assert_allclose(later, now, atol=1e-14 * max(lengths))
    assert (period == 1) == np.allclose(between, now, atol=1e-3 * max(lengths))


@pytest.mark.parametrize('lengths, expected', [
    ({'a': 2.0, 'b': 3.0, 'c': 2.0, 'd': 3.0}, [-math.pi, 0.0]),
    ({'a': 2.0, 'b': 4.0, 'c': 3.0, 'd': 3.0}, [-math.tau, 0.0])])
def test_a_dead_point_at_zero_is_zero(lengths, expected):
    assert mechanisms.create('four_bar', **lengths).dead_points() == expected


def test_no_rounding_of_a_ground_square_to_the_crank_changes_a_branch():
    bars = [custom('O ground 0 0', f'Q ground {x} 4', 'A crank O 1', 'B dyad A Q 5 2 left')
            for x in ('-1e-16', '0', '1e-16')]
    assert np.ptp([bar.solve(0.3)['B'] for bar in bars], axis=0) == pytest.approx(0.0, abs=1e-14)


def test_a_dead_point_at_both_ends_of_a_period_is_one():
    linkage = custom('O ground 0 0', 'Q ground 4 -1e-15', 'A crank O 1', 'B dyad A Q 5 2 left')
    assert linkage.dead_points() == pytest.approx([-math.tau, 0.0], abs=1e-15)


@pytest.mark.parametrize('geared, rate', [('', 0.0), (' geared crank -2 0.5', -2.0)])
def test_what_drives_is_a_number_wherever_it_is(geared, rate):
    linkage = custom(*FOUR_BAR[:3], 'B dyad A Q 1 1 left', f'C crank B 1 zero A{geared}')
    inputs = 0.3 if geared else [0.3, 0.7]
    assert np.isnan(linkage.solve(inputs)['C']).all()
    assert linkage.joint_angles(inputs)['crank2'] == (0.5 - 2 * 0.3 if geared else 0.7)
    assert linkage.joint_rates(inputs)['crank2'] == rate


@pytest.mark.nightly
def test_the_reach_of_what_hangs_on_rounding_is_found_in_so_many_calls():
    # F is where A is: the mirror line F-A has a direction of rounding, and so has all behind it.
    lines = ('A ground -0.552 0', 'B ground 0 -0.4465', 'C ground 0 0',
             'D cylinder B C 0.476 left', 'E parallelogram C D A', 'F parallelogram D E C',
             'G mirror C F A', 'L dyad G B 3.5837 3.196 left')
    with few_calls(2_000_000):
        reach = custom(*lines).reach()
    assert all(low < high for low, high in reach)


def test_dead_points_of_an_arm_of_rounding_leave_the_other_outputs_their_answers():
    # E is where Dc is, so that F is on either side of it by rounding alone.
    linkage = custom('A ground -1.03 5.14', 'B ground -1.65 -0.565', 'C cylinder B A 0.83 left',
                     'D Db Dc inversor C A 1.45 0.66', 'E mirror D A Db',
                     'F mirror A Dc E', 'G mirror Dc A F', 'J parallelogram E Db F')
    value, = linkage.joint_angles([5.4], ['Dc.y'])['Dc.y']
    assert len(linkage.dead_points()) > 100
    assert linkage.input_for('Dc.y', value) == pytest.approx(5.4, abs=1e-12)


@pytest.mark.parametrize('crank', [-8, -1, 0, 1, 2])
@pytest.mark.parametrize('ulps', [-8, -2, -1, 1, 2, 8])
def test_bars_that_differ_by_rounding_keep_their_lengths_beside_an_arm_of_hardly_any(crank, ulps):
    kite = custom('O ground 0 0', 'Q ground 1 0', 'A crank O m', 'B dyad Q A 1 c left',
                  m=1.0 + crank * 2.0 ** -52, c=1.0 + ulps * 2.0 ** -52)
    theta = np.array([-1e-3, -1e-12, -1e-15, 0.0, 1e-16, 1e-14, 1e-3])
    for places in (kite.solve(theta)['B'], np.array([kite.solve(x)['B'] for x in theta])):
        np.testing.assert_allclose(np.hypot(*(places - (1.0, 0.0)).T), 1.0, rtol=1e-9)


@pytest.mark.parametrize('difference', [1e-13, 2.3e-12, 1.3e-11, 1e-9, 1e-7])
@pytest.mark.parametrize('x', [1.33087356405, 0.7, 2.123])
def test_bars_that_are_sums_have_their_lengths_where_they_are_nearly_equal(x, difference):
    bars = f'{x}+{x} {x}+{x}+{x}-d'
    cell = custom('A ground 0 0', f'B ground 0 -{x}', f'C crank A {x} up',
                  f'D E F inversor B C {bars}', d=x * (1.0 + difference))
    places = cell.solve(math.pi + np.array([-5.0, 5.0, 100.0]) * difference)
    rhombus = places['D'] + places['F'] - places['C'] - places['E']
    assert np.isfinite(rhombus).all() and np.abs(rhombus).max() < 1e-14
    corner = custom('A ground 0 0', 'C crank A b', f'E rigid A C {bars} left',
                    d=x * (1.0 + difference), b=2.0 * x * difference).solve(0.7)['E']
    assert np.hypot(*corner) == pytest.approx(2.0 * x, rel=4e-15)


@pytest.mark.parametrize('base, sides', [('x', 'y x+y'), ('x', 'x+y y'), ('x+y', 'x y')])
def test_the_corner_of_a_flat_triangle_is_on_the_line(base, sides):
    rng = np.random.default_rng(0)
    for _ in range(20):
        places = custom('A ground 0 0', f'C crank A {base}', f'E rigid A C {sides} left',
                        **dict(zip('xy', rng.uniform(0.2, 3.0, 2)))).solve(0.7)
        (a, b), (c, d) = places['C'], places['E']
        assert abs(a * d - b * c) < 1e-14


def test_angles_have_the_same_bits_with_rates_that_are_infinite():
    cell = mechanisms.create('peaucellier')
    end = cell.reach()[0][0]
    angles, both = (LegGroup(cell).solution((), cell.joints[1:], rates)
                    for rates in (None, cell.joints[1:]))
    infinite = 0
    for theta in end - np.spacing(1.0) * np.arange(20):
        angles.solve([theta])
        both.solve([theta], [1.0])
        infinite += math.isinf(both.parts['rows']['rates'][0][0])
        assert angles.rows.tolist() == both.parts['rows']['angles'].tolist()
    assert infinite


# --- lengths that drive ---

@pytest.mark.parametrize('far, placed', [(1, True), (40, False)])
def test_a_stroke_ends_with_the_last_digits_of_its_short_base(far, placed):
    linkage = custom('O ground 0 0', 'P ground 0.03125 0', 'B cylinder P O 1.25 left')
    end = linkage.reach()[0][1]
    assert np.isfinite(linkage.solve(end + far * np.spacing(end))['B']).all() == placed


@pytest.mark.parametrize('length', [1e-1, 1e-4, 1e-8])
def test_the_barrel_of_an_isosceles_cylinder_keeps_its_digits_as_it_gets_short(length):
    linkage = custom('P ground 0 0', 'O ground 1.25 0', 'B cylinder P O 1.25 left')
    # The barrel is at alpha from P -> O, cos alpha = c / 2 d: alpha' = -1 / (2 d sin alpha).
    sine = math.sqrt((1.0 - length / 2.5) * (1.0 + length / 2.5))
    assert linkage.joint_rates(length, ('barrel',))['barrel'] == pytest.approx(
        -1.0 / (2.5 * sine), rel=4e-16)
    assert linkage.joint_accelerations(length, 1.0, 0.0, ('barrel',))['barrel'] == pytest.approx(
        -length / (2.5 * sine) ** 3, rel=1e-6, abs=1e-8)


def test_a_carriage_alone_is_a_linkage():
    rail = ['O ground 0 0', 'X ground 1 0', 'R carriage O along X -0.2 0.7']
    assert custom(*rail).extremes('R.x') == [((-0.2, -0.2), (0.7, 0.7))]
    # It is as large as its stroke.
    assert custom(*rail).longest == pytest.approx(0.9)
    assert Pinocchio(urdf.describe([alone(rail)], 'world')).joints == ['m_carriage']
