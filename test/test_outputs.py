# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What can be measured of a linkage: its value, its rate, and where the input then is."""

import math

import gmpy2
from linkage_ros import mechanisms
import numpy as np
import pytest

OUTPUTS = [('jansen', 'distance(A,G)'), ('jansen', 'angle(C,G)'), ('four_bar', 'distance(O,B)'),
           ('four_bar', 'angle(B,A)'), ('slotted_lever', 'distance(Q,A)'), ('klann', 'angle(O,E)')]


def measured(linkage, output, theta):
    """Return an output from where the joints are."""
    first, second = output[:-1].partition('(')[2].split(',')
    place = linkage.solve(theta)
    arm = (place[second] - place[first]) @ (1, 1j)
    return np.abs(arm) if output.startswith('distance') else np.angle(arm)


@pytest.mark.parametrize('shape', [(), (1,), (3, 2), (0,)])
@pytest.mark.parametrize('type_, output', OUTPUTS)
def test_distances_and_angles_are_those_of_the_joints(type_, output, shape):
    linkage = mechanisms.create(type_)
    theta = np.resize([0.3, 1.1, -2.0, 2.9, 0.0, -0.7], shape)
    values_ = linkage.joint_angles(theta, [output])[output]
    assert values_.shape == shape
    np.testing.assert_allclose(values_, measured(linkage, output, theta), rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize('type_, output', OUTPUTS)
def test_their_rates_are_differences(type_, output):
    linkage, step = mechanisms.create(type_), 1e-6
    theta = np.linspace(0.3, 2.5, 9)
    ahead = measured(linkage, output, theta + step) - measured(linkage, output, theta - step)
    np.testing.assert_allclose(linkage.joint_rates(theta, [output])[output],
                               ahead / (2 * step), rtol=1e-6, atol=1e-6)
    function = linkage.function((), [output], [output])
    assert function(0.3)[1] == linkage.joint_rates(0.3, [output])[output]


# --- following a measured value ---

@pytest.mark.parametrize('turns', [-2e5, -1, 2, 1e5])
def test_an_output_that_turns_all_round_takes_the_crank_along(turns):
    linkage = mechanisms.create('whitworth')
    for crank in (-3.2, -3.1, 0.0, 3.1, 3.2, 9.4):
        value = float(linkage.joint_angles(crank)['lever'])
        for near in (crank - 0.2, crank + 0.2):
            followed, _ = linkage.follow('lever', value, near + math.tau * turns)
            error = followed - math.tau * turns - crank
            assert error == pytest.approx(0.0, abs=1e-15 * abs(turns) + 1e-14)


@pytest.mark.parametrize('value', [1e6, -1e9, 1e15, 1e22, -1e300])
def test_whole_turns_of_a_wanted_angle_cost_no_digits(value):
    linkage = mechanisms.create('whitworth')
    with gmpy2.context(precision=1400):
        value_in_turn = float(gmpy2.atan2(*gmpy2.sin_cos(gmpy2.mpfr(value))))
    expected, = linkage.input_for('angle(Q,L)', value_in_turn)
    assert linkage.input_for('angle(Q,L)', value) == pytest.approx(expected, abs=1e-14)
    crank, _ = linkage.follow('angle(Q,L)', value, expected)
    assert crank == pytest.approx(expected, abs=1e-14)


