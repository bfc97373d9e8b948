# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A linkage that a length drives does all that one driven by an angle does."""

import math

from linkage_ros import mechanisms, scene
from linkage_ros.linkage.inputs import LENGTH
from linkage_ros.render.cycle import Cycle
from linkage_ros.robot_model import urdf
from linkage_ros.scene import slider
import numpy as np
import pytest
from robots import Pinocchio

# A boom O-B on a cylinder P-B; a bar Q-D keeps the bucket C-D nearly level.
BOOM = ('O ground 0 0', 'P ground g -h', 'B cylinder P O r right', 'C line O B 1.5*r',
        'Q ground 0 0.3*g', 'D dyad C Q 0.3*g 1.5*r right')
LENGTHS = {'g': 0.5, 'h': 0.25, 'r': 1.0486}
SCENE = {'mechanisms': ['boom'], 'boom.type': 'custom', 'boom.joints': list(BOOM),
         **{f'boom.dimensions.{name}': value for name, value in LENGTHS.items()}}


def boom(**changed):
    return mechanisms.create('custom', joints=BOOM, **{**LENGTHS, **changed})


def test_the_input_is_a_length_with_a_stroke():
    input_, = boom().inputs
    base = math.hypot(LENGTHS['g'], LENGTHS['h'])
    assert (input_.name, input_.kind, input_.unit) == ('cylinder', LENGTH, 'm')
    assert (input_.low, input_.high) == pytest.approx((LENGTHS['r'] - base, LENGTHS['r'] + base))


@pytest.mark.parametrize('far, placed', [(1, True), (40, False)])
def test_a_stroke_ends_with_the_last_digits_of_its_short_base(far, placed):
    linkage = mechanisms.create('custom', joints=(
        'O ground 0 0', 'P ground 0.03125 0', 'B cylinder P O 1.25 left'))
    end = linkage.reach()[0][1]
    assert np.isfinite(linkage.solve(end + far * np.spacing(end))['B']).all() == placed


@pytest.mark.parametrize('ends', ['-d 0', '0 d', '50*d 51*d'])
def test_a_stroke_is_searched_on_its_own_scale(ends):
    low, high = (end.replace('d', '3e-9') for end in ends.split())
    linkage = mechanisms.create('custom', joints=(
        'G ground 0 0', 'H ground 1 0', f'S carriage G along H {low} {high}',
        f'F ground ({low}+{high})/2 1e-9', 'D dyad F S 1.5e-9 0.2e-9 left'))
    middle = 0.5 * (linkage.inputs[0].low + linkage.inputs[0].high)
    far, near = math.sqrt(1.7 ** 2 - 1.0) * 1e-9, math.sqrt(1.3 ** 2 - 1.0) * 1e-9
    expected = [(middle - far, middle - near), (middle + near, middle + far)]
    np.testing.assert_allclose(linkage.reach(), expected, rtol=0, atol=1e-20)
    np.testing.assert_allclose(linkage.dead_points(), np.ravel(expected), rtol=0, atol=1e-20)


def test_a_scene_counts_lengths_in_metres_scaled():
    mechanism = scene.read({**SCENE, 'boom.scale': 10.0, 'boom.cylinder.speed': 0.5,
                            'boom.cylinder.start': 9.0}).mechanisms['boom']
    drive = mechanism.first
    assert drive.reach[0] == pytest.approx(np.multiply(10.0, boom().reach()[0]))
    assert drive.start == 9.0 and drive.sweep[0] > drive.reach[0][0]
    solution = mechanism.assembly().solution(('B', 'P'), ('OB',), ('OB',))
    solution.solve([9.0], [0.5])
    *places, angle, speed = solution.rows[0]
    assert math.dist(places[:2], places[2:]) == pytest.approx(9.0)
    assert angle == boom().joint_angles(0.9)['OB']
    assert speed == pytest.approx(0.05 * boom().joint_rates(0.9)['OB'])


@pytest.mark.parametrize('name, value, text', [
    ('cylinder.sweep', [0.1, 1.0], r'boom.cylinder.sweep must be inside the reach \[.*\] m'),
    ('cylinder.sweep', [1.0, 1.0], 'boom.cylinder.sweep must be .* lower end'),
    ('cylinder.speed', 1e3, 'boom.cylinder.speed must be .* from -100 to 100'),
    ('crank.speed', 1.0, 'boom.crank.speed is not a parameter')])
def test_a_bad_value_of_a_cylinder_is_refused(name, value, text):
    with pytest.raises(scene.SceneError, match=text):
        scene.read({**SCENE, f'boom.{name}': value})


def test_its_parameters_say_metres_and_have_sliders():
    read = scene.read(SCENE)
    about = {parameter.name: parameter for parameter in read.parameters}
    assert about['boom.cylinder.speed'].field.meaning == 'Speed of the cylinder [m/s].'
    boom = read.mechanisms['boom']
    low, high = slider.ends(boom, about['boom.cylinder.start'])
    (least, greatest), = boom.first.reach
    assert low <= least and high == pytest.approx(greatest, abs=0.03)


def test_a_picture_follows_the_stroke_there_and_back():
    mechanism = scene.read({**SCENE, 'boom.cylinder.start': 0.9}).mechanisms['boom']
    cycle = Cycle(mechanism)
    assert cycle.pose(0.0).inputs == (0.9,)
    low, high = mechanism.first.sweep
    lengths = [cycle.pose(turns).inputs[0] for turns in np.linspace(0.0, 1.0, 101)]
    assert low <= min(lengths) < low + 0.03 and high - 0.03 < max(lengths) <= high
    assert np.isfinite(cycle.course).all()


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
    mechanism = scene.read({
        'mechanisms': ['m'], 'm.type': 'custom', 'm.joints': rail}).mechanisms['m']
    assert Pinocchio(urdf.describe([mechanism], 'world')).joints == ['m_carriage']
