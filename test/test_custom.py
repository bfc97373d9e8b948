# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Linkages of the user's own: two cranks, sweeps."""

from linkage_ros import mechanisms
import numpy as np
import pytest

FOUR_BAR = ('O ground 0 0', 'Q ground g 0', 'A crank O m', 'B dyad A Q b c left')


def four_bar(m, b, c, g, side=1):
    """Return a four-bar of crank m, coupler b, rocker c and ground g."""
    return mechanisms.create('custom', joints=FOUR_BAR, branches={'B': side}, m=m, b=b, c=c, g=g)


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
