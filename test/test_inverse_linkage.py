# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The inverse linkage: what comes apart, its joint lines, and that its answers are all."""

import math

from linkage_ros import mechanisms
import numpy as np
import pytest
from scenes import custom

FIVE_BAR = """\
# five_bar driven by P.x, P.y
O ground 0.0 0.0
Q ground 0.118 0.0
X carriage O along Q -1.912 1.912    # at P.x
Y block X 0.0 0.118
P carriage X along Y -1.912 1.912    # at P.y
A dyad O P 0.09 0.09 right
C dyad Q P 0.09 0.09 right"""


def test_the_joint_lines_of_an_inverse_are_printed():
    assert str(mechanisms.create('five_bar').inverse(('P.x', 'P.y'))) == FIVE_BAR
    assert str(mechanisms.create('jansen').inverse('G.x')) == (
        'the inverse of jansen for G.x is searched')
    zeroed = custom('O ground 0 0', 'Z ground 1 -0.5', 'A crank O 1 zero Z')
    assert '# at 1 crank - 0.463648' in str(zeroed.inverse('crank'))


@pytest.mark.nightly(all_but=3)
@pytest.mark.parametrize('kind, outputs', [
    ('four_bar', {'crank', 'AB', 'QB'}), ('jansen', {'crank', 'BC', 'AC', 'BE', 'AE', 'EF', 'DF'}),
    ('klann', {'crank', 'AD', 'BD'}), ('slider_crank', {'crank', 'AB', 'block', 'B.x'}),
    ('watt', {'crank', 'AB', 'QB'}), ('slotted_lever', {'crank', 'lever', 'slide'}),
    ('whitworth', {'crank', 'lever', 'slide', 'LR', 'block'})])
def test_joint_angles_and_slides_come_apart(kind, outputs):
    linkage = mechanisms.create(kind)
    assert {name for name in outputs if linkage.inverse(name).closed} == outputs


def test_an_output_that_only_rounding_moves_has_no_answers():
    # The corner is the pivot itself, and the mirror's line has no length.
    linkage = custom('A ground 0 0', 'B ground -0.803093 2.0884554493679546',
                     'D cylinder B A 2.237544308085028 right', 'E antiparallelogram A B D',
                     'F mirror B A E')
    assert np.isnan(linkage.input_for('E.x', 0.0)).tolist() == [True]
    (low, high), = linkage.extremes('E.x')
    assert low <= high


def test_a_slide_that_is_a_cylinder_of_the_inverse_may_be_negative():
    linkage = custom('O ground 0 1.75', 'Q ground 1.77 -1.49', 'A crank O 0.65', 'B crank Q 0.6',
                     'C slider A 2.1 Q along B in', 'D slider C 1.15 O -pi/2 in')
    inverse, outputs = linkage.inverse(('CD', 'block2')), {}
    assert ' cylinder ' in str(inverse)
    for pose in [(0.5, 2.067), (0.5, -1.033)]:
        outputs[pose] = [float(linkage.joint_angles(pose)[name]) for name in inverse.outputs]
        assert min(math.dist(x.inputs, pose) for x in inverse.all(outputs[pose])) < 1e-12
    assert len({math.copysign(1.0, place) for _, place in outputs.values()}) == 2


def test_half_a_turn_is_the_one_below_zero():
    linkage = mechanisms.create('five_bar')
    height = float(linkage.solve((math.pi, 2.5))['P'][1])
    answers = linkage.inverse(('P.y', 'crank')).all((height, math.pi))
    assert {answer.inputs[0] for answer in answers} == {-math.pi}


@pytest.mark.parametrize('shape', [(0,), (2, 0, 3)])
def test_no_values_have_no_answers(shape):
    none = np.zeros(shape)
    for kind, outputs in (('four_bar', ('B.x',)), ('five_bar', ('P.x', 'P.y'))):
        inverse = mechanisms.create(kind).inverse(outputs)
        inputs, rates = inverse.over(*[none] * len(outputs))
        assert inputs.shape == (len(outputs), *shape, 1)
        assert rates.shape == (len(outputs) ** 2, *shape, 1)
        path, _ = inverse.path([none.ravel()] * len(outputs))
        assert path[0].shape == (0,)


def test_the_rate_is_that_of_the_linkage_where_another_mode_passes():
    bar = mechanisms.create('four_bar')
    for at in (-math.pi, 0.0):
        value = float(bar.solve(at)['B'][0])
        (inputs,), rates = bar.inverse('B.x').over(value)
        for x, rate in zip(inputs, rates[0]):
            assert rate == pytest.approx(float(bar.velocity(x)['B'][0]), rel=1e-9)
    frame = custom('O ground 0 0', 'Q ground 3 0', 'A crank O 1', 'B parallelogram O A Q')
    for value in (1e-12, 1e-7, 1e-4):
        assert frame.inverse('AB').over(value)[1].tolist() == [[pytest.approx(-1.0)]]


TWO_TURNS = custom('O ground 0 0', 'Q ground 4 0', 'A crank O 1', 'D crank Q 1 geared crank 1/2 0',
                   'B dyad A D 3.5 3 left')


@pytest.mark.parametrize('linkage, output, near, far', [
    (TWO_TURNS, 'A.y', -3.2, -3.0), (TWO_TURNS, 'AB', 0.33, 0.9), (TWO_TURNS, 'AB', 3.0, 3.3),
    (TWO_TURNS, 'AB', 9.3, 9.6), *(
        (mechanisms.create('jansen'), 'G.x', near + turns * math.tau, far + turns * math.tau)
        for near, far in ((3.1, 3.2), (3.2, 3.1)) for turns in (0, 2, -3))])
def test_an_input_is_followed_in_its_turn_and_past_its_end(linkage, output, near, far):
    value, _ = linkage.compiled('checked', (output,)).at(far)
    assert linkage.follow(output, value, near)[0] == pytest.approx(far, abs=1e-12)


def test_the_default_of_several_inputs_does_not_depend_on_rounding():
    inverse = mechanisms.create('five_bar').inverse(('P.x', 'P.y'))
    height = np.linspace(0.10, 0.16, 200)
    together = np.array(inverse.nearest((np.full(200, 0.05), height))[0])
    alone = np.transpose([inverse.nearest((0.05, y))[0] for y in height.tolist()])
    np.testing.assert_allclose(together, alone, atol=1e-14)
    assert abs(np.diff(alone)).max() < 0.05


@pytest.mark.parametrize('ends', [
    (0.0, math.inf), (math.nan, 1.0), (2.0, 1.0), (1.0, 2.0, 3.0), 5, '12'])
def test_ends_are_two_finite_numbers_in_order(ends):
    with pytest.raises(ValueError, match='ends must be two finite numbers in order'):
        mechanisms.create('four_bar').servo_for('B.x', 100.0, ends=ends)


def test_a_value_at_which_equal_bars_of_the_inverse_lie_on_each_other_is_answered():
    drop = mechanisms.create('water_drop')
    inverse = drop.inverse('B.x')
    assert [answer.inputs for answer in inverse.all(0.0)] == [(-math.pi,), (0.0,)]
    (inputs,), rates = inverse.over([0.0, 99.0])
    assert inputs[0].tolist() == [-math.pi, 0.0] and np.isnan(inputs[1]).all()
    np.testing.assert_allclose(rates[0, 0], [4.0, -4.0 / 3.0], rtol=1e-9)
    assert drop.servo_for('B.x', np.zeros(1))[0].tolist() == [-math.pi]
    assert drop.servo_for('B.x', 0.0, 0.1)[0] == 0.0


def test_the_rate_next_to_an_end_is_not_that_of_a_mode_that_ends_there():
    cell = mechanisms.create('peaucellier')
    at = cell.reach()[0][0] + 1e-13
    value = float(cell.joint_angles(at, ['DC'])['DC'])
    (inputs,), (rates,) = cell.inverse('DC').over(value)
    assert inputs[0] == pytest.approx(at, abs=1e-14)
    assert rates[0] == pytest.approx(float(cell.joint_rates(at, ('DC',))['DC']), rel=0.05)


@pytest.mark.nightly(all_but=6)
@pytest.mark.parametrize('limited', [False, True])
@pytest.mark.parametrize('kind, outputs', [
    ('four_bar', ('QB',)), ('jansen', ('G.x',)), ('slotted_lever', ('lever',)),
    ('klann', ('F.y',)), ('five_bar', ('P.x', 'P.y'))])
def test_a_path_is_the_nearest_of_one_value_after_the_other(kind, outputs, limited):
    linkage, rng = mechanisms.create(kind), np.random.default_rng(3)
    inverse, n = linkage.inverse(outputs), len(linkage.inputs)
    # Steps of all sizes through several turns, and values that nothing reaches.
    inputs = np.cumsum(rng.normal(0.0, 1.0, (n, 120)) * 10.0 ** rng.uniform(-3, 0.5, 120), axis=1)
    values = np.array([*linkage.joint_angles(inputs if n > 1 else inputs[0], outputs).values()])
    values[:, rng.random(120) < 0.1] += 3.0 * linkage.longest
    ends = [(-2.0, 9.0)] * n if limited else None
    seed = inputs[:, 0]
    path, _ = inverse.path(list(values), near=seed, ends=ends)
    reached = 0
    for value, place in zip(values.T, np.transpose(path)):
        expected, _ = inverse.nearest(value.tolist(), near=seed.tolist(), ends=ends)
        np.testing.assert_allclose(place, expected, rtol=0.0, atol=1e-9)
        if np.isfinite(expected).all():
            seed, reached = np.array(expected), reached + 1
    assert 20 < reached < 120
