# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Efforts that balance loads; on any linkage they are compared in `linkage_checks`."""


from linkage_ros import mechanisms
import numpy as np
import pytest


@pytest.mark.parametrize('shape', [(), (1,), (3, 2), (0,)])
def test_loads_may_differ_from_pose_to_pose(shape):
    arm, rng = mechanisms.create('five_bar'), np.random.default_rng(6)
    theta = rng.uniform(1.5, 2.0, shape), rng.uniform(0.5, 1.0, shape)
    loads = {'P': rng.uniform(-1.0, 1.0, (*shape, 2)), 'AP': rng.uniform(-1.0, 1.0, shape)}
    efforts = arm.effort(theta, loads)
    assert efforts.shape == (*shape, 2)
    for place in np.ndindex(shape):
        own = arm.effort([x[place] for x in theta], {name: x[place] for name, x in loads.items()})
        np.testing.assert_allclose(efforts[place], own, rtol=1e-12)


def test_what_is_not_loaded_needs_no_effort_even_at_a_dead_point():
    stretched = mechanisms.create('custom', joints=(
        'O ground 0 0', 'Q ground 1 2', 'A crank O 1', 'B dyad A Q 1 1 left'))
    assert not np.isfinite(stretched.effort(0.0, {'B': (1.0, 0.0)}))
    assert not np.isfinite(stretched.effort(0.0, {'AB': 1.0}))
    assert stretched.effort(0.0, {'B': (0.0, 0.0), 'AB': 0.0, 'A': (0.0, 4.0)}) == -4.0
    assert stretched.effort(0.0, {}) == 0.0
    assert np.array_equal(stretched.effort(np.zeros((2, 3)), {}), np.zeros((2, 3, 1)))


def test_the_effort_of_an_output_asks_for_one_input_and_an_output_that_moves():
    with pytest.raises(ValueError, match='five_bar has several inputs'):
        mechanisms.create('five_bar').output_effort('P.x', (1.9, 0.4), 1.0)
    for output, problem in (('Q.x', 'Q.x of four_bar does not move with the crank'),
                            ('Z.x', 'has no output'), (7, 'has no output')):
        with pytest.raises(ValueError, match=problem):
            mechanisms.create('four_bar').output_effort(output, 0.4, 1.0)


@pytest.mark.parametrize('output', ['QB', 'P.x', 'B.y', 'distance(O,B)', 'angle(O,B)'])
@pytest.mark.parametrize('theta', [0.4, [[0.4, 1.0], [2.2, -1.0]]])
def test_the_effort_of_an_output_has_the_power_of_the_input(output, theta):
    bars, step = mechanisms.create('four_bar'), 2.0 ** -17
    before, after = (bars.joint_angles(np.array(theta) + side * step, (output,))[output]
                     for side in (-1.0, 1.0))
    efforts = bars.output_effort(output, theta, 6.0)
    assert np.shape(efforts) == np.shape(theta)
    np.testing.assert_allclose(efforts * (after - before) / (2.0 * step), 6.0, rtol=1e-7)


@pytest.mark.parametrize('loads, reason', [
    ({'Z': (1.0, 2.0)}, "no joint or link 'Z' to load; allowed: O, Q, A"),
    ({'B': 3.0}, 'the load on the joint B must be a force x, y'),
    ({'B': (1.0, 2.0, 3.0)}, 'the load on the joint B must be a force x, y'),
    ({'QB': 'much'}, 'the load on QB'),
    *((loads, 'loads must be a mapping') for loads in ([1.0, 2.0], 'B', 3.0, None))])
def test_a_load_that_cannot_be_is_refused(loads, reason):
    with pytest.raises(ValueError, match=reason):
        mechanisms.create('four_bar').effort(0.4, loads)
