# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Lengths that drive: a stroke ends and is searched to the last digits, however short it is."""

import math

from linkage_ros import mechanisms
from linkage_ros.robot_model import urdf
import numpy as np
import pytest
from robots import Pinocchio
from scenes import alone


@pytest.mark.parametrize('far, placed', [(1, True), (40, False)])
def test_a_stroke_ends_with_the_last_digits_of_its_short_base(far, placed):
    linkage = mechanisms.create('custom', joints=(
        'O ground 0 0', 'P ground 0.03125 0', 'B cylinder P O 1.25 left'))
    end = linkage.reach()[0][1]
    assert np.isfinite(linkage.solve(end + far * np.spacing(end))['B']).all() == placed


@pytest.mark.parametrize('length', [1e-1, 1e-4, 1e-8])
def test_the_barrel_of_an_isosceles_cylinder_keeps_its_digits_as_it_gets_short(length):
    linkage = mechanisms.create('custom', joints=(
        'P ground 0 0', 'O ground 1.25 0', 'B cylinder P O 1.25 left'))
    # The barrel is at alpha from P -> O, cos alpha = c / 2 d: alpha' = -1 / (2 d sin alpha).
    sine = math.sqrt((1.0 - length / 2.5) * (1.0 + length / 2.5))
    assert linkage.joint_rates(length, ('barrel',))['barrel'] == pytest.approx(
        -1.0 / (2.5 * sine), rel=4e-16)
    assert linkage.joint_accelerations(length, 1.0, 0.0, ('barrel',))['barrel'] == pytest.approx(
        -length / (2.5 * sine) ** 3, rel=1e-6, abs=1e-8)


def test_a_carriage_alone_is_a_linkage():
    rail = ['O ground 0 0', 'X ground 1 0', 'R carriage O along X -0.2 0.7']
    assert mechanisms.create('custom', joints=rail).extremes('R.x') == [((-0.2, -0.2), (0.7, 0.7))]
    assert Pinocchio(urdf.describe([alone(rail)], 'world')).joints == ['m_carriage']
