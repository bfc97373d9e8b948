# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Linkages that people have, held to the lengths of their bars and to what is published."""

import math

from linkage_ros import mechanisms, scene
from linkage_ros.robot_model import urdf
from mpmath import mp, mpc, mpf
import numpy as np
import pytest
from robots import Pinocchio
from truth.cases import CASES, CRANK, cross, FOOT, IDLER


def made(name, size=1.0, branches=None):
    """Return the linkage of a case, larger by a factor."""
    numbers = {key: value * size for key, value in CASES[name].numbers.items()}
    return mechanisms.create('custom', joints=CASES[name].joints, branches=branches, **numbers)


def poses(name, count=5):
    """Return the inputs along a case's path, shape (poses, inputs)."""
    return np.linspace(*CASES[name].path, count)


def given(inputs):
    """Return inputs, with the last axis for each, as a mechanism takes them."""
    columns = list(np.moveaxis(np.asarray(inputs), -1, 0))
    return columns[0] if len(columns) == 1 else columns


def in_digits(place):
    """Return a joint as a number with many digits."""
    return mpc(*map(float, place))


@pytest.mark.parametrize('name', CASES)
def test_a_dead_point_is_where_a_transmission_angle_is_flat(name):
    linkage, held = made(name), poses(name)[0][1:].tolist()
    for angle in linkage.transmission_angles(given(poses(name, 50))).values():
        assert np.all((angle >= 0.0) & (angle <= math.pi))
    for value in linkage.dead_points(*held):
        angles = linkage.transmission_angles([value, *held] if held else value).values()
        assert any(math.isnan(angle) or math.sin(angle) < 1e-6 for angle in angles), value
        assert linkage.distance_to_dead_point(value, *held) == 0.0


# --- what is published about them --------------------------------------------------------------

def turned(linkage, theta, first, second):
    """Return the angles from one joint to another [rad], without jumps."""
    name = f'angle({first},{second})'
    return np.unwrap(linkage.joint_angles(theta, (name,))[name])


def corner(one, other, opposite):
    """Return the angle between two sides of a triangle, in digits: the law of cosines."""
    return mp.acos((one ** 2 + other ** 2 - opposite ** 2) / (2 * one * other))


@pytest.mark.parametrize('piston', [-0.6, -0.3, 0.0, 0.2, 0.35])
def test_an_excavator_turns_by_the_law_of_cosines(piston):
    linkage, n = made('excavator'), {key: mpf(x) for key, x in CASES['excavator'].numbers.items()}
    boom, arm, bucket = (40 * piston + zero for zero in (98.779, 130.89, 120.459))
    place = {name: in_digits(at) for name, at in linkage.solve([boom, arm, bucket]).items()}

    def angle(pivot, one, other):
        return abs(mp.arg((place[one] - place[pivot]) / (place[other] - place[pivot])))

    idler = IDLER + corner(n['e'], n['i'], mpf(120.459)) - corner(n['e'], n['i'], bucket)
    across = mp.sqrt(n['i'] ** 2 + n['g'] ** 2 - 2 * n['i'] * n['g'] * mp.cos(idler))
    for found, exact in ((angle('O', 'P', 'B'), corner(n['p'], n['b'], boom)),
                         (angle('A', 'C', 'D'), corner(n['c'], n['d'], arm)),
                         (angle('E', 'G', 'H'), idler),
                         (angle('H', 'E', 'J'), corner(n['g'], across, n['i'])
                          + corner(across, n['m'], n['k']))):
        assert abs(found - min(exact, 2 * mp.pi - exact)) < 8e-15


def test_the_side_of_a_nearly_folded_dyad_is_not_that_of_its_zero_pose():
    toe, ahead_of = made("Cassie's toe"), np.angle(FOOT - CRANK)
    tarsus, heel = np.angle(FOOT), math.atan2(0.006, 0.05512)

    def foot(linkage, crank):
        pins = linkage.solve([tarsus, crank - ahead_of])
        return np.angle((pins['B'] - pins['F']) @ (1, 1j)) - heel

    # Of the keyframe the soft closure is 2 mm open, which is 0.035 rad at the foot.
    assert foot(toe, -1.52439) == pytest.approx(-1.59681, abs=0.04)
    assert foot(made("Cassie's toe", branches={'B': 1}), 0.0) == pytest.approx(0.0, abs=1e-12)
    assert abs(foot(toe, 0.0)) > 0.1


def test_a_scissor_lift_follows_from_the_cylinder_between_its_arms():
    lift = scene.load('config/scissor_lift.yaml').mechanisms['lift'].linkage
    foot = np.linspace(0.6, 1.7, 31)
    height, length = (lift.joint_angles(foot, (name,))[name] for name in
                      ('P.y', 'distance(C,D)'))
    np.testing.assert_allclose(height, 0.2 + 2 * np.sqrt(1.8 ** 2 - foot ** 2), rtol=1e-15)
    # C, 0.6 a, and D, 0.5 a from where the arms cross, see the foot's triangle smaller.
    square = (0.1 * 0.9) ** 2 + 0.6 * 0.5 * foot ** 2
    np.testing.assert_allclose(length, np.sqrt(square), rtol=2e-15)
    for stroke, at in zip(length.tolist(), foot):
        np.testing.assert_allclose(lift.input_for('distance(C,D)', stroke), [at], rtol=1e-14)
        assert lift.follow('distance(C,D)', stroke, 1.0)[0] == pytest.approx(at, rel=1e-14)


def test_a_clamp_is_locked_where_handle_and_rod_are_in_line():
    clamp = made('toggle clamp')
    (_, locked), _ = clamp.extremes('QB', [(-0.5, 1.5)])[0]
    o, a, b = (clamp.solve(locked)[name] @ (1, 1j) for name in 'OAB')
    assert abs(cross(a - o, b - a)) < 1e-7 * abs(a - o) * abs(b - a)
    assert abs(clamp.joint_rates(locked)['QB']) < 1e-6
    assert clamp.transmission_angles(locked)['B'] > 0.5


def test_a_rack_steers_both_wheels_alike_and_the_inner_one_more():
    steering = scene.load('config/rack_steering.yaml').mechanisms['steering'].linkage
    right, left = (np.degrees(turned(steering, np.linspace(0.28, 0.42, 29), *ends))
                   for ends in ('ME', 'NF'))
    right, left = right - right[14], left - left[14]
    np.testing.assert_allclose(left, -right[::-1], atol=1e-12)
    assert np.all(right[:10] < left[:10] - 0.2) and right[0] < -20.0
    # Ackermann: the axles meet on the line of the rear one, a wheelbase behind.
    wheelbase = 1.3 / (1.0 / np.tan(np.radians(left[:10])) - 1.0 / np.tan(np.radians(right[:10])))
    assert np.ptp(np.abs(wheelbase)) < 1.0 and 2.0 < abs(wheelbase[0]) < 3.0


# --- gears, strokes and rails, asked where they are awkward --------------------------------------


def test_a_carriage_alone_is_a_linkage():
    rail = ['O ground 0 0', 'X ground 1 0', 'R carriage O along X -0.2 0.7']
    assert mechanisms.create('custom', joints=rail).extremes('R.x') == [((-0.2, -0.2), (0.7, 0.7))]
    mechanism = scene.read({
        'mechanisms': ['m'], 'm.type': 'custom', 'm.joints': rail}).mechanisms['m']
    assert Pinocchio(urdf.describe([mechanism], 'world')).joints == ['m_carriage']
