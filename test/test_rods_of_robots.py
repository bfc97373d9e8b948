# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Ankles on rods in robots' files: random ones, written as MJCF, and what is read of them."""

import math
import re

from linkage_ros.robot_files import cli, closing, readers
import numpy as np
import pytest
from robots import imported, MuJoCo, of_text, printed, published, said, words as text
from test_robot_files import differing
from truth import rods

# Limits of pitch and roll.
NEAR = [-0.15, -0.12], [0.15, 0.12]
LIGHT = '<inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>'


def less(one, other):
    return text(np.subtract(one, other))


def mjcf(ankle, limits, pins=None, ref=0.0):
    """
    Return an ankle as MJCF; its rods hang on balls, and their eyes are tied to the foot.

    With `pins`, they hang on hinges about these axes of each rod. `ref` is where its motors are.
    """
    held = ['<joint type="ball" name="ball {i}"/>' if pins is None else ''.join(
        f'<joint name="pin {i} {k}" axis="{text(axis)}" range="-2 2"/>'
        for k, axis in enumerate(pins[i])) for i in (0, 1)]
    legs = ''.join(
        f'<body name="crank {i}" pos="{text(ankle.motors[i])}"><joint name="{name}" '
        f'axis="{text(ankle.motor_axes[i])}" ref="{ref}"/>{LIGHT}<body name="rod {i}" '
        f'pos="{less(ankle.pivots[i], ankle.motors[i])}">{held[i].format(i=i)}'
        f'{LIGHT}<site name="eye {i}" pos="{less(ankle.ends[i], ankle.pivots[i])}"/></body></body>'
        for i, name in enumerate('lr'))
    eyes = ''.join(f'<site name="pin {i}" pos="{less(ankle.ends[i], ankle.second)}"/>'
                   for i in (0, 1))
    ranges = [f'range="{low!r} {high!r}"' if limits is not None else ''
              for low, high in (np.transpose(limits).tolist() if limits is not None
                                else ((0, 0), (0, 0)))]
    ties = ''.join(f'<connect site1="eye {i}" site2="pin {i}"/>' for i in (0, 1))
    motors = ''.join(f'<motor joint="{name}"/>' for name in 'lr')
    return (
        '<mujoco><compiler angle="radian" autolimits="true"/><worldbody><body name="shin">'
        f'{LIGHT}<joint name="knee" axis="0 1 0"/><body name="cross" pos="{text(ankle.first)}">'
        f'<joint name="pitch" axis="{text(ankle.first_axis)}" {ranges[0]}/>{LIGHT}'
        f'<body name="foot" pos="{less(ankle.second, ankle.first)}"><joint name="roll" '
        f'axis="{text(ankle.second_axis)}" {ranges[1]}/>{LIGHT}{eyes}</body></body>{legs}</body>'
        f'</worldbody><equality>{ties}</equality><actuator>{motors}</actuator></mujoco>')


def turning(seed):
    """Return a random ankle of motors, not of cylinders."""
    rng = np.random.default_rng(seed)
    while True:
        ankle = rods.random_ankle(rng)
        if ankle.motor_axes[0] is not None:
            return ankle


def check_rods(ankle, mechanism):
    """Check that a foot and a joint are published with which the rods keep their lengths."""
    assert {called.name for called in mechanism.joints.values() if called.published} == {
        'pitch', 'roll'}
    motors = np.random.default_rng(3).uniform(-0.1, 0.1, (2, 40))
    angles = np.stack(list(mechanism.linkage.joint_angles(motors, ['pitch', 'roll']).values()))
    there = np.isfinite(angles[0])
    assert there.sum() > 10
    assert np.abs(np.array(rods.gaps(ankle, motors, *angles))[:, there]).max() < 1e-15


def test_an_ankle_is_imported_with_the_limits_of_its_file(tmp_path):
    ankle, half = turning(1), np.array([0.15, 0.12])
    file = of_text(tmp_path / 'robot.xml', mjcf(ankle, (-half, half)))
    _, out, err = printed(file)
    assert 'in 240 poses of the robot' in err and 'Limits' not in err
    mechanism, = imported(file)
    assert mechanism.frame_id == 'shin'
    assert {settings.source for settings in mechanism.inputs.values()} == {'l', 'r'}
    assert re.findall(r'- (\w+ \w+ \w+) (?:at|[-\d])', ' '.join(out.split())) == [
        'pitch hinge ground', 'roll hinge pitch', 'l motor ground', 'r motor ground',
        'ball_0 rod l', 'ball_1 rod r']
    limits = re.findall('within (.*) (.*)', out)
    assert [[float(end) for end in ends] for ends in limits] == pytest.approx(
        np.array([[-0.15, 0.15], [-0.12, 0.12]]))
    check_rods(ankle, mechanism)


@pytest.fixture(scope='module')
def ankle_of_a_robot(tmp_path_factory):
    """Return a robot with an ankle, and the scene that it is described by."""
    robot = closing.closed(readers.read(str(of_text(
        tmp_path_factory.mktemp('ankle') / 'robot.xml', mjcf(turning(1), NEAR))))).robot
    return robot, cli.described(robot)[0]


@pytest.mark.parametrize('old, new, why', [
    # Rods a micrometre longer than the robot's; narrower limits; a foot that turns the other way.
    ('length ', 'length 1e-6+', 'its loops stand open by '),
    ('within -0.15', 'within -0.015', 'it has no pose, where the loops of the robot are'),
    ('=pitch', '=-pitch', 'its loops stand open by ')])
def test_an_ankle_that_differs_from_its_robot_is_refused(ankle_of_a_robot, old, new, why):
    assert re.match(f'with l at .*, r at .* {why}', differing(
        *ankle_of_a_robot, 'l_rods', old, new, 'l', 'r'))


@pytest.mark.parametrize('robot', rods.REAL)
def test_the_ankle_of_a_public_model_is_imported_with_its_range(tmp_path, robot):
    # Both hinges of some feet cross in a point, and are no ball all the same; their motors turn
    # about one of them, and are no planar linkage.
    parts, limits = rods.REAL[robot]
    ankle = rods.drawn(*parts)
    file = of_text(tmp_path / 'robot.xml', mjcf(ankle, limits))
    assert 'Limits' not in said(file)
    check_rods(ankle, *imported(file))


@pytest.mark.parametrize('seed, count', [(1, 2), (2, 3)])
def test_hinges_of_rods_are_published(tmp_path, seed, count):
    # Two hinges across the rod; a third one along it stays.
    ankle, rng, pins = turning(seed), np.random.default_rng(9), []
    for pivot, end in zip(ankle.pivots, ankle.ends):
        way = np.subtract(end, pivot)
        first = np.cross(rng.normal(size=3), way)
        # The second leans, as it may.
        pins.append([first, np.cross(way, first) / np.linalg.norm(way) + 0.2 * first, way][:count])
    file = of_text(tmp_path / 'robot.xml', mjcf(ankle, NEAR, pins, 0.3))
    _, out, err = printed(file)
    assert 'Not published' not in err and ('pin 1 2=0' in out) == (count == 3)
    assert out.count(' within ') == 2
    mechanism, = imported(file)
    robot, closed = MuJoCo(file.read_text()), 0
    for left, right in np.random.default_rng(3).uniform(0.2, 0.4, (30, 2)):
        positions = published(mechanism, l=left, r=right)
        assert positions.keys() == {'l', 'r', 'pitch', 'roll', *(
            f'pin {i} {k}' for i in (0, 1) for k in (0, 1))}
        if not np.isnan([*positions.values()]).any():
            robot.place(positions)
            assert robot.open() < 1e-14
            closed += 1
    assert closed > 8


def test_hinges_of_which_the_first_is_along_a_rod_are_not_published(tmp_path):
    ankle, pins = turning(1), []
    for pivot, end in zip(ankle.pivots, ankle.ends):
        way = np.subtract(end, pivot)
        pins.append([way, across := np.cross(way, [1.0, 0.2, 0.1]), np.cross(way, across)])
    file = of_text(tmp_path / 'robot.xml', mjcf(ankle, NEAR, pins))
    assert 'Not published: pin 0 0, pin 0 1, pin 0 2, pin 1 0, pin 1 1, pin 1 2: ' in said(file)
    check_rods(ankle, *imported(file))


def test_of_a_rod_on_three_hinges_and_two_the_three_do_not_stay(tmp_path):
    # Three hinges at one end and two at the other all move: none of the three stays.
    ankle = turning(1)
    written = mjcf(ankle, NEAR, [np.eye(3)] * 2)
    for i, end in enumerate(ankle.ends):
        first = np.cross(np.subtract(end, ankle.pivots[i]), [1.0, 0.2, 0.1])
        second = np.cross(np.subtract(end, ankle.pivots[i]), first)
        pins = ''.join(f'<joint name="eye {i} {k}" axis="{text(axis)}"/>'
                       for k, axis in enumerate((first, second)))
        site = f'<site name="pin {i}" pos="{less(end, ankle.second)}"/>'
        tie = f'<connect site1="eye {i}" site2="pin {i}"/>'
        assert site in written and tie in written
        written = written.replace(site, f'<body name="eye {i}" pos="{less(end, ankle.second)}">'
                                  f'{pins}{LIGHT}</body>').replace(
            tie, f'<weld body1="rod {i}" body2="eye {i}"/>')
    _, out, err = printed(of_text(tmp_path / 'robot.xml', written))
    assert 'in 240 poses' in err and 'Left out' not in err
    assert 'Not published: pin 0 0, pin 0 1, pin 0 2, pin 1 0, pin 1 1, pin 1 2: ' in err
    assert all(f'="eye {i} {k}"' in out for i in (0, 1) for k in (0, 1))
    assert '="pin' not in out and 'hold:=' not in out


def limited(folder, seed, limits, **motors):
    """Return the inputs of an ankle, by source, whose motors have limits."""
    written = mjcf(turning(seed), limits)
    for name, ends in motors.items():
        joint = f'<joint name="{name}" '
        written = written.replace(joint, f'{joint}limited="true" range="{ends}" ')
    mechanism, = imported(of_text(folder / 'robot.xml', written))
    return mechanism, {settings.source: settings for settings in mechanism.inputs.values()}


def test_limits_of_its_motors_are_sweeps(tmp_path):
    _, settings = limited(tmp_path, 1, NEAR, l='-0.1 0.08', r='0.02 0.1')
    assert settings['l'].ends == pytest.approx((-0.1, 0.08))
    assert settings['r'].ends == pytest.approx((0.02, 0.1))
    _, settings = limited(tmp_path, 1, NEAR, l='-0.1 0.08', r='-inf 0.02')
    assert settings['r'].ends[1] == 0.02


@pytest.mark.parametrize('seed, motors', [(1, {}), (2, {'l': '-1.5 1.5'})])
def test_the_sweeps_of_an_ankle_s_motors_are_in_its_window(tmp_path, seed, motors):
    mechanism, drives = limited(tmp_path, seed, ([-0.5, -0.3], [0.4, 0.3]), **motors)
    ends = [input_.ends for input_ in drives.values()]
    assert np.ptp(ends, axis=1).min() > 0.1
    values = np.meshgrid(*(np.linspace(*each, 50) for each in ends))
    assert np.isfinite(list(mechanism.linkage.joint_angles(values).values())).all()


@pytest.mark.nightly(all_but=1)
@pytest.mark.parametrize('seed, limits', [(1, ([-math.inf, -0.12], [0.15, 0.12])), (4, None)])
def test_without_an_end_the_largest_limits_are_taken_and_said(tmp_path, seed, limits):
    file = of_text(tmp_path / 'robot.xml', mjcf(turning(seed), limits))
    assert 'Limits: both hinges need limits; these are the largest proved to have one pose at ' \
        'most: pitch from -' in said(file)
    assert all(math.isfinite(end) for held in imported(file)[0].linkage.windows()
               for ends in held.limits for end in ends)
