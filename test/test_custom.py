# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Linkages of the user's own: change points, two cranks, sweeps."""

import math

from linkage_ros import mechanisms
import numpy as np
import pytest

TURN = [(-math.pi, math.pi)]
FOUR_BAR = ('O ground 0 0', 'Q ground g 0', 'A crank O m', 'B dyad A Q b c left')


def four_bar(m, b, c, g, side=1):
    """Return a four-bar of crank m, coupler b, rocker c and ground g."""
    return mechanisms.create('custom', joints=FOUR_BAR, branches={'B': side}, m=m, b=b, c=c, g=g)


@pytest.mark.parametrize('m, g', [(1.0, 3.0), (0.1, 0.3), (3.0, 0.7)])
def test_a_parallelogram_stays_one(m, g):
    linkage = four_bar(m, g, m, g)
    place = linkage.solve(np.linspace(-9.0, 9.0, 721))
    np.testing.assert_allclose(place['B'] - place['A'], np.full((721, 2), (g, 0.0)),
                               atol=1e-15 * (m + g))
    assert linkage.reach() == TURN
    assert linkage.dead_points() == pytest.approx([-math.pi, 0.0], abs=1e-15)


@pytest.mark.parametrize('size', [1.0, 0.01, 0.3, 7e-3])
def test_the_smooth_branch_is_followed_through_a_change_point(size):
    linkage = four_bar(1.0 * size, 2.0 * size, 3.0 * size, 4.0 * size)
    theta = math.pi + np.linspace(-0.02, 0.02, 81)
    speed = linkage.velocity(theta, ('B',))['B']
    assert np.isfinite(speed).all()
    assert np.abs(np.diff(speed, axis=0)).max() < 0.02 * size
    assert np.sign(side_of(linkage, [math.pi - 0.01, math.pi + 0.01])).tolist() == [1.0, -1.0]
    assert linkage.reach() == [(-math.tau, math.tau)]
    assert linkage.dead_points() == pytest.approx([-math.pi, math.pi], abs=1e-15)


def side_of(linkage, theta):
    """Return how far B is on the left of A -> Q."""
    place = linkage.solve(np.asarray(theta, float))
    along, across = place['Q'] - place['A'], place['B'] - place['A']
    return along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]


@pytest.mark.parametrize('side', [1, -1])
@pytest.mark.parametrize('lengths', [
    (1.0, 3.0, 1.0, 3.0), (1.0, 1.0, 3.0, 3.0), (1.0, 2.0, 3.0, 4.0), (3.0, 4.0, 3.0, 2.0)])
def test_the_side_written_is_the_one_at_a_quarter_turn(lengths, side):
    assert np.sign(side_of(four_bar(*lengths, side=side), [math.pi / 2])).tolist() == [side]


def test_a_gap_beyond_rounding_is_no_change_point():
    linkage = four_bar(1.0, 2.0 + 1e-12, 3.0, 4.0)
    assert (side_of(linkage, np.linspace(-6.0, 6.0, 401)) > 0.0).all()


@pytest.mark.parametrize('a', [1.0, 0.1, 0.03])
def test_the_block_of_an_isosceles_slider_crank_swings_through_the_centre(a):
    linkage = mechanisms.create('slider_crank', a=a, b=a, c=0.0)
    theta = np.linspace(-7.0, 7.0, 281)
    np.testing.assert_allclose(linkage.solve(theta)['B'][:, 0], 2 * a * np.cos(theta),
                               atol=2e-15 * a)
    assert linkage.dead_points() == pytest.approx([-math.pi / 2, math.pi / 2], rel=1e-15)


@pytest.mark.parametrize('degrees', [0, 30, 90, 135, 180, -45, -90, -170])
@pytest.mark.parametrize('zero', [0.0, math.pi / 2])
def test_the_block_is_ahead_where_the_pin_is_farthest_along_its_line(degrees, zero):
    linkage = mechanisms.create('custom', a=1.0, p=math.radians(degrees), joints=(
        'O ground 0 0', 'G ground 0 0', f'A crank O a {"up" if zero else ""}',
        'B slider A a G p out'))
    theta = np.linspace(-3.0, 3.0, 31)
    slide = linkage.joint_angles(theta, ('block',))['block']
    np.testing.assert_allclose(slide, 2.0 * np.cos(theta + zero - math.radians(degrees)),
                               atol=2e-15)


def test_a_ground_joint_may_lie_on_the_crank_s_centre():
    linkage = four_bar(1.0, 2.0, 1.5, 0.0)
    place = linkage.solve(np.linspace(-3.0, 3.0, 13))
    np.testing.assert_allclose(np.linalg.norm(place['B'], axis=1), 1.5, rtol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(place['B'] - place['A'], axis=1), 2.0, rtol=1e-15)


def test_every_crank_is_asked_for():
    linkage = mechanisms.create('five_bar')
    with pytest.raises(ValueError, match='five_bar has 2 inputs: the values of all except'):
        linkage.reach()
    with pytest.raises(ValueError, match='theta must be a sequence of as many values'):
        linkage.solve(0.5)


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('shape', [(), (1,), (3,), (3, 2)])
@pytest.mark.parametrize('turned', [(), (2,), (1, 2)])
def test_an_array_of_dimensions_is_broadcast_against_the_angle(shape, turned):
    # Some cannot be assembled.
    swept = np.linspace(2.6, 9.4, int(np.prod(shape))).reshape(shape)
    theta = np.linspace(0.1, 0.9, int(np.prod(turned))).reshape(turned)
    try:
        expected = np.broadcast_shapes(shape, turned)
    except ValueError:
        pytest.skip('not broadcast')
    linkage = four_bar(1.0, swept, 2.5, 4.0)
    place = linkage.solve(theta)
    assert place['B'].shape == (*expected, 2) and place['O'].shape == (*expected, 2)
    lengths, thetas = np.broadcast_arrays(swept, theta)
    for index in np.ndindex(expected):
        one = four_bar(1.0, float(lengths[index]), 2.5, 4.0)
        np.testing.assert_allclose(place['B'][index], one.solve(float(thetas[index]))['B'],
                                   rtol=1e-14)
        np.testing.assert_allclose(linkage.transmission_angles(theta)['B'][index],
                                   one.transmission_angles(float(thetas[index]))['B'], rtol=1e-14)


@pytest.mark.filterwarnings('error')
def test_of_arrays_of_dimensions_one_may_have_no_rate():
    linkage = mechanisms.create('custom', b=np.array([1.0, 1.5]), joints=(
        'O ground 0 0', 'Q ground 1 2', 'A crank O 1', 'B dyad A Q b 1 left'))
    assert np.isfinite(linkage.velocity(0.0)['B']).all(axis=-1).tolist() == [False, True]


def test_questions_about_the_reach_are_for_one_set_of_dimensions():
    linkage = four_bar(1.0, np.array([3.0, 3.1]), 2.5, 4.0)
    for ask in (linkage.reach, linkage.dead_points, lambda: linkage.input_for('QB', 1.0)):
        with pytest.raises(ValueError, match='for one set of dimensions, not for arrays'):
            ask()


def test_arrays_of_dimensions_are_checked_too():
    with pytest.raises(ValueError, match='dimension b must be positive'):
        four_bar(1.0, np.array([3.0, -3.0]), 2.5, 4.0)
    for line, wrong in (('P line A B b-c', 'the bar A-P must be longer'),
                        ('P rigid A B 2 0.7 left', 'no triangle has these sides'),
                        ('P carriage O along Q 2.75 b', 'the lower end of the carriage must be')):
        with pytest.raises(ValueError, match=f'line "{line}": {wrong}'):
            mechanisms.create('custom', joints=(*FOUR_BAR, line), m=1.0, g=4.0, c=2.5,
                              b=np.array([3.0, 2.5]))


def test_a_joint_of_a_carriage_stands_still_while_that_is_held():
    linkage = mechanisms.create('custom', joints=(
        'A ground 0 0', 'B ground 2 0', 'C ground 0 1', 'D cylinder B A 1.5 right',
        'E carriage C along B -1 1'))
    with pytest.raises(ValueError, match='E.x of custom does not move with the cylinder'):
        linkage.input_for('E.x', 0.5, others=(0.3,))
