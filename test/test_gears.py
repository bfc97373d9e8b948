# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Gears of any ratio: the inverse, the reach and the motion in any turn."""

from fractions import Fraction
import math

from linkage_ros.c_code import header
from linkage_ros.scene.motion import Motion
import numpy as np
import pytest
from scenes import alone, custom

# Ratios with their periods.
RATIOS = {'1/64': 64, '1/80': 80, '1/100': 100, '0.31': 100, '22/7': 7, '3/7': 7, '-2.37': 100,
          '0.999': 1000, '1/1000': 1000, '0.12345': 20000, '2/3+1/7919': 23757,
          'sqrt(2)': math.inf, 'pi': math.inf, '8': 1, '180': 1, '-1000': 1}
# Turns of the motor in which is asked, one of them next to an end of what is computed as one.
TURNS = 0.0, 15.93713, -1e5

# A fraction, a ratio that never repeats and a speed-up.
QUICK = '1/3', 'sqrt(2)', '8'


def motor(ratio, *more):
    """Return a motor, and a crank that is geared to it."""
    return custom('O ground 0 0', 'M crank O 0.01', f'A crank O 1 geared crank {ratio} 0', *more)


def two(ratio):
    """Return a rocker on the motor's crank, and a bar from it to a geared crank."""
    return custom('O ground 0 0', 'Q ground 3 0', 'R ground 10 0', 'A crank O 1',
                  f'D crank R 1 geared crank {ratio} 0.3', 'B dyad A Q 2.5 2 left',
                  'E dyad B D 9 8 left')


@pytest.mark.parametrize('ratio, period', RATIOS.items())
def test_there_is_one_period(ratio, period):
    linkage = motor(ratio)
    assert linkage.period() == linkage.inputs[0].period == period
    if period < math.inf:
        assert motor(ratio, 'B crank O 1 geared crank 1/9 0').period() == math.lcm(9, period)
        later = linkage.solve(0.3 + math.tau * period)['A']
        assert later == pytest.approx(linkage.solve(0.3)['A'], abs=1e-9)


@pytest.mark.parametrize('ratio', [
    ratio if ratio in QUICK else pytest.param(ratio, marks=pytest.mark.nightly)
    for ratio in ('1/3', *RATIOS)])
def test_a_pose_is_answered_in_the_turn_in_which_it_is(ratio):
    linkage, size = two(ratio), 1.0 + abs(motor(ratio).gear('crank2')[0])
    for output in ('E.x', 'QB', 'D.y', 'angle(B,D)'):
        for theta in (0.4 + math.tau * turns for turns in TURNS):
            value, rate = (float(call(theta, (output,))[output])
                           for call in (linkage.joint_angles, linkage.joint_rates))
            close = 1e-9 + 8.0 * size * math.ulp(theta) / min(1.0, abs(rate))
            assert linkage.input_for(output, value, near=theta - 0.01 / size) == pytest.approx(
                theta, abs=close), output
            assert linkage.follow(output, value, theta)[0] == pytest.approx(theta, abs=close)
            (many,), _ = linkage.inverse(output).nearest(([value] * 2,), ([theta, theta],))
            assert many == pytest.approx([theta] * 2, abs=close)
            (first, *_) = linkage.inverse(output).all(value, theta)
            assert first.inputs[0] == pytest.approx(theta, abs=close)
            error = linkage.joint_angles(first.inputs[0], (output,))[output] - value
            assert math.remainder(error, math.tau) == pytest.approx(
                0.0, abs=1e-12 + 8.0 * size * math.ulp(theta))


@pytest.mark.parametrize('turns', [0, 7, -27])
@pytest.mark.parametrize('more, outputs', [
    ((), ('E.x', 'QB')), (('drive',), ('QB', 'drive')),
    (('drive', 'shaft'), ('QB', 'drive', 'shaft'))])
def test_a_branch_continues_through_change_points_in_any_turn(turns, more, outputs):
    # Each crank passes through the other ground joint of its dyad, whose bars are equal.
    linkage = custom('O ground 0 0', 'Q ground 1 0', 'R ground 5 0', 'S ground 6 0', 'A crank O 1',
                     'B dyad A Q 2.5 2.5 left', 'D crank R 1 geared crank -sqrt(2) 0',
                     'E dyad D S 2 2 left', *(f'M{name} crank S 1 called {name}' for name in more))
    theta = [0.4 + math.tau * turns, *[0.3] * len(more)]
    for chosen in [outputs] if more else [(name,) for name in outputs]:
        values = list(linkage.joint_angles(theta if more else theta[0], chosen).values())
        first, *_ = linkage.inverse(chosen).all(values, theta)
        assert first.inputs == pytest.approx(theta, abs=1e-11)


@pytest.mark.parametrize('ratio', [8, -180, pytest.param(999, marks=pytest.mark.nightly)])
def test_a_fast_gear_loses_no_answer(ratio):
    cranks = motor(ratio).input_for('A.x', 0.3)
    angle = math.acos(0.3)
    expected = sorted(math.remainder((sign * angle + math.tau * k) / abs(ratio), math.tau)
                      for sign in (1, -1) for k in range(abs(ratio)))
    assert cranks == pytest.approx(expected, abs=1e-12)


BOTH = 'D crank Q 0.7 geared crank {} 0.3; B dyad A D 1.1 1.2 left'
ONE = 'D crank O 0.7 geared crank {} 0.3; B dyad D Q 0.9 1.2 left'


@pytest.mark.nightly(all_but=4)
@pytest.mark.parametrize('ratio, lines', [
    *((ratio, ONE) for ratio in ('2', '-3', '0.5')), ('1/3', BOTH), ('0.31', BOTH), ('1/80', BOTH),
    pytest.param('1000', BOTH, marks=pytest.mark.nightly), ('sqrt(2)', BOTH), ('0.12345', BOTH)])
def test_the_reach_is_where_it_can_be_assembled(ratio, lines):
    linkage = custom('O ground 0 0', 'Q ground 2 0', 'A crank O 1',
                     *lines.format(ratio).split('; '))
    first, = linkage.inputs
    theta = np.random.default_rng(0).uniform(first.low, first.high, 4001)
    assembled = np.isfinite(linkage.solve(theta)['B']).all(axis=1)
    assert assembled.any() and not assembled.all()
    reach = linkage.reach()
    wrong = theta[[first.on(reach, x) for x in theta.tolist()] != assembled]
    ends = np.ravel(reach)
    assert all(np.min(np.abs(ends - value)) < 1e-6 for value in wrong)
    assert len(wrong) < 5
    # Beyond a part of the period the reach says nothing.
    assert first.is_part == all(first.on(reach, 1e6 + k) for k in range(99))


@pytest.mark.parametrize('ratio', ['1001', '-2e3', '1e9'])
def test_a_gear_that_is_too_fast_is_refused_with_what_is_allowed(ratio):
    with pytest.raises(ValueError, match=r'crank2 turns \S+ times as fast as the crank; '
                                         r'allowed: 1000 times'):
        motor(ratio)


@pytest.mark.parametrize('ratio', ['1/80', '0.12345', 'sqrt(2)', '22/7'])
def test_a_driver_goes_on_without_a_jump_until_all_comes_round(ratio):
    mechanism = alone(['O ground 0 0', 'M crank O 0.01', f'A crank O 1 geared crank {ratio} 0'],
                      crank__start=20.0)
    motion, gear = Motion.of(mechanism.first), Fraction(mechanism.linkage.gear('crank2')[0])
    for seconds in (1, 10 ** 4, 10 ** 7):
        angle, _ = motion.at(seconds * 10 ** 9)
        turned = float(gear * (20 + seconds) % Fraction(math.tau))
        # 2 pi is rounded, once a turn.
        assert mechanism.linkage.solve(angle)['A'] == pytest.approx(
            [math.cos(turned), math.sin(turned)], abs=1e-14 * seconds + 1e-9)


def test_what_cannot_be_searched_in_c_is_refused():
    lines = ['O ground 0 0', 'M crank O 0.01', 'A crank O 1 geared crank sqrt(2) 0']
    for more in [], ['B crank O 1 called other']:
        mechanism = alone([*lines, *more], crank__sweep=[-1.0, 1.0])
        with pytest.raises(ValueError, match='A.x.* of m .* repeats after too many turns'):
            header.written(mechanism, ['A.x', 'B.x'][:1 + len(more)])
