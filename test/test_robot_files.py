# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Scenes from robot descriptions: what they publish closes the loops of the file, everywhere."""

import cmath
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout, suppress
from functools import lru_cache
import io
import math
from pathlib import Path
import random
import re
from tempfile import TemporaryDirectory
import time
from xml.etree import ElementTree

from hypothesis import example, given, settings, strategies as st
from linkage_ros import mechanisms, scene
from linkage_ros.cli import RequestError
from linkage_ros.robot_files import check, cli, closing, readers
from linkage_ros.robot_model.robot import posed
from linkage_ros.robot_model.urdf import write
import numpy as np
import pytest
from robots import LIBRARIES
from truth import random_linkages

ROBOTS = Path(__file__).with_name('robot_files')


def printed(name, *more):
    """Return what the command prints of a file, as a scene file."""
    return _printed(name, (ROBOTS / name).read_bytes(), *more)


@lru_cache(None)
def _printed(name, _, *more):
    with redirect_stdout(io.StringIO()) as out, redirect_stderr(io.StringIO()):
        assert cli.main([str(ROBOTS / name), *map(str, more)]) == 0
    return out.getvalue()


@pytest.fixture
def imported(tmp_path):
    """Return a function that reads the scene of a file."""
    pytest.importorskip('yaml')

    def load(name, *more):
        if str(name).endswith('.xml'):
            pytest.importorskip('mujoco', reason='MJCF is read by MuJoCo: pip install mujoco')
        file = tmp_path / 'scene.yaml'
        file.write_text(printed(name, *more))
        return scene.load(str(file)).mechanisms
    return load


def published(mechanism, **motors):
    """Return the positions of a robot's joints where its motors are, motors included."""
    values = [drive.ratio * motors[drive.source] + drive.offset
              for drive in mechanism.inputs.values()]
    angles = mechanism.linkage.joint_angles(values if len(values) > 1 else values[0])
    assert mechanism.only_named
    return {**motors, **{called.name: float(called.of(angles[link]))
                         for link, called in mechanism.joints.items() if called.published}}


def error(file, positions):
    """Return by how much MuJoCo sees equalities of a file open [m]."""
    import mujoco
    model = mujoco.MjModel.from_xml_path(str(ROBOTS / file))
    data = mujoco.MjData(model)
    for name, value in positions.items():
        data.qpos[model.joint(name).qposadr] = value
    mujoco.mj_forward(model, data)
    return np.abs(data.efc_pos[data.efc_type == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)]).max()


MODELS = {'four_bar.xml': np.linspace(-3.0, 3.0, 40), 'whitworth.xml': np.linspace(-0.9, 0.9, 40),
          'gripper.xml': np.linspace(0.0, 0.8, 20)}


@pytest.mark.parametrize('file', MODELS)
def test_mujoco_sees_the_loops_of_a_model_closed(imported, file):
    mechanisms = imported(file).values()
    for position in MODELS[file]:
        joints = {}
        for mechanism in mechanisms:
            joints.update(published(mechanism, **{mechanism.first.source: position}))
        assert error(file, joints) < 1e-14


def test_a_rod_with_ball_ends_on_a_moving_tarsus_keeps_its_length(imported):
    mujoco = pytest.importorskip('mujoco')
    mechanism, = imported('toe_rod.xml').values()
    assert mechanism.frame_id == 'tarsus'
    model = mujoco.MjModel.from_xml_path(str(ROBOTS / 'toe_rod.xml'))
    data, eye = mujoco.MjData(model), model.eq_data[0]
    for position in np.linspace(-1.75, -0.1, 20):
        for name, value in published(mechanism, foot_crank_joint=position).items():
            data.qpos[model.joint(name).qposadr] = value
        mujoco.mj_kinematics(model, data)
        foot = model.body('foot').id
        end = data.xpos[foot] + data.xmat[foot].reshape(3, 3) @ eye[3:6]
        rod = np.linalg.norm(end - data.xpos[model.body('plantar_rod').id])
        assert rod == pytest.approx(0.35012, abs=1e-14)
        # The side of the keyframe: the foot follows its crank, as in a parallelogram.
        assert abs(data.joint('foot_joint').qpos[0] - position) < 0.35


URDF = {
    'four_bar.urdf': ((), {'motor': (-3.0, 3.0)}, [('wrist_a', 'wrist_b')]),
    'boom.urdf': ((), {'boom_cylinder': (-0.3, 0.5)}, [('eye_a', 'eye_b')]),
    'five_bar.urdf': (('--loops', ROBOTS / 'five_bar_loops.yaml'),
                      {'mot_front': (-0.4, 0.4), 'mot_back': (0.5, -0.3)},
                      [('front_foot', 'back_foot')]),
    'palletiser.urdf': (('--loops', ROBOTS / 'palletiser_loops.yaml'),
                        {'joint_2': (-0.5, 0.9), 'joint_3': (0.6, -0.8)},
                        [('tail_a', 'tail_b'), ('level_a', 'level_b'), ('tool_a', 'tool_b')]),
    # The bell's angle is that of a link less that of the thigh, both on one pin of a third link.
    'wheel_leg.urdf': ((), {'hip': (-0.25, 0.3), 'crank_motor': (0.35, -0.35)},
                       [('rod_eye', 'bell_eye'), ('tendon_eye', 'shin_eye')])}


@pytest.mark.nightly(all_but=5)
@pytest.mark.parametrize('library', LIBRARIES)
@pytest.mark.parametrize('file', URDF)
def test_the_joints_of_a_urdf_close_its_loops(imported, file, library):
    more, motors, loops = URDF[file]
    robot = library((ROBOTS / file).read_text())
    mechanism, = imported(file, *more).values()
    for part in np.linspace(0.0, 1.0, 15):
        joints = published(mechanism, **{motor: low + part * (high - low)
                                         for motor, (low, high) in motors.items()})
        assert set(robot.joints) - joints.keys() <= {'swing'}
        places = robot.places(joints, [name for pair in loops for name in pair])
        for first, second in loops:
            assert places[first] == pytest.approx(places[second], abs=2e-15)


LIMIT, MOTOR = 'lower="-1.2" upper="1.2"', '<joint name="motor" axis="0 1 0"/>'
SDF_AXIS = '<axis><xyz>0 1 0</xyz></axis>'
SDF_LIMIT = SDF_AXIS.replace('</axis>', '<limit><lower>-0.4</lower>{}</limit></axis>')
LIMITS = [
    # Both ends are 0 by default in a URDF, and infinite in an SDF.
    ('four_bar.urdf', LIMIT, 'upper="1.2"', (0.0, 1.2), ''),
    ('four_bar.urdf', LIMIT, 'lower="-0.5"', (-0.5, 0.0), ''),
    ('four_bar.urdf', LIMIT, '', None, 'from 0 to 0: they are no range'),
    ('four_bar.urdf', LIMIT, 'lower="1.2" upper="-1.2"', None,
     'from 1.2 to -1.2: they are no range'),
    ('four_bar.urdf', LIMIT, 'lower="nan" upper="1"', None, 'from nan to 1: they are no range'),
    ('four_bar.urdf', LIMIT, 'lower="-1e7" upper="1"', None,
     'from -1e+07 to 1: its loops do not reach them'),
    ('four_bar.urdf', 'name="motor" type="revolute"', 'name="motor" type="continuous"', None,
     'from -1.2 to 1.2: it is continuous'),
    ('boom.urdf', 'lower="-0.3" upper="0.3"', 'upper="0.2"', (0.0, 0.2), ''),
    ('boom.urdf', 'lower="-0.3" upper="0.3"', 'lower="-inf" upper="0.2"', (-0.43633, 0.2), ''),
    ('boom.urdf', 'lower="-0.3" upper="0.3"', 'lower="5" upper="9"', None,
     'from 5 to 9: its loops do not reach them'),
    ('four_bar.sdf', SDF_AXIS, SDF_LIMIT.format(''), None,
     'from -0.4 to inf: its loops do not reach them'),
    ('four_bar.sdf', SDF_AXIS, SDF_LIMIT.format('<upper>1</upper>'), (-0.4, 1.0), ''),
    ('four_bar.xml', MOTOR, MOTOR.replace('/>', ' range="-inf 40" limited="true"/>'), None,
     'from -inf to 0.6981: its loops do not reach them'),
    ('four_bar.xml', MOTOR, MOTOR.replace('/>', ' range="-40 40"/>'),
     (math.radians(-40.0), math.radians(40.0)), '')]


@pytest.mark.parametrize('file, old, new, ends, why', LIMITS, ids=range(len(LIMITS)))
def test_limits_of_a_motor_become_a_sweep_or_a_sentence(
        imported, tmp_path, file, old, new, ends, why):
    path = tmp_path / file
    path.write_text((ROBOTS / file).read_text().replace(old, new, 1))
    mechanism, = imported(path).values()
    drive = mechanism.first
    assert (f'# Left out: the limits of {drive.source}, {why}.\n' in printed(path)) == bool(why)
    assert (drive.ends and [(end - drive.offset) / drive.ratio for end in drive.ends]) == (
        ends and pytest.approx(ends, abs=1e-5))


def mimicking(tmp_path, *servos, more=''):
    """Return a four-bar whose motor follows servos, each its name, its limits and its mimic."""
    def joint(name, limits, mimic, kind='revolute'):
        return (f'<link name="{name}"/><joint name="{name}" type="{kind}"><parent '
                f'link="base_link"/><child link="{name}"/>{limits}{mimic}</joint>')

    mimic = f'<mimic joint="{servos[0][0]}" multiplier="-0.5" offset="0.1"/>'
    return written(tmp_path, 'four_bar.urdf', (
        '<limit lower="-1.2"', f'{mimic}<limit lower="-1.2"'), ('</robot>', ''.join(
            joint(*servo) for servo in servos) + more + '</robot>'))


SERVO = '<transmission name="t"><joint name="servo"/></transmission>'


@pytest.mark.parametrize('more', ['', SERVO])
@pytest.mark.parametrize('servos, ends', [
    ([('servo', '<limit lower="-0.4" upper="2"/>', '')], (-0.4, 2.0)),
    ([('servo', '<limit lower="-0.4" upper="9"/>', '')], (-0.4, 2.6)),
    ([('servo', '', '')], (-2.2, 2.6)),
    # The motor is at 0.1 - 0.5 * (1 + 2 * servo).
    ([('middle', '<limit lower="0" upper="2"/>',
       '<mimic joint="servo" multiplier="2" offset="1"/>'),
      ('servo', '<limit lower="-0.3" upper="3"/>', '')], (-0.3, 0.5)),
    ([('middle', '', '<mimic joint="servo" multiplier="2" offset="1"/>', 'fixed'),
      ('servo', '<limit lower="-0.3" upper="3"/>', '')], (-0.3, 0.8)),
    ([('servo', '<limit lower="5" upper="9"/>', '')], None)])
def test_limits_of_a_joint_are_those_of_all_that_it_follows(
        imported, tmp_path, servos, ends, more):
    file = mimicking(tmp_path, *servos, more=more)
    mechanism, = imported(file).values()
    drive = mechanism.first
    assert drive.source == 'servo'
    assert ('the limits of servo, from 5 to 2.6: its loops do not reach them' in printed(
        file)) == (ends is None)
    assert (drive.ends and sorted((end - drive.offset) / drive.ratio for end in drive.ends)) == (
        ends and pytest.approx(ends))
    if ends:
        assert f'poses of the robot, servo from {ends[0]:.4g} to {ends[1]:.4g}, ' in printed(file)


def test_limits_of_a_passive_joint_bound_what_follows_it(imported, tmp_path):
    axis = '<axis xyz="0 -1 0"/>'
    file = written(tmp_path, 'four_bar.urdf', (
        axis, f'<mimic joint="motor" multiplier="-1"/>{axis}'))
    mechanism, = imported(file).values()
    drive = mechanism.first
    assert drive.source == 'motor' and drive.ratio == -1.0
    assert drive.ends == pytest.approx([drive.offset - 1.2, drive.offset + 1.2])


def test_limits_of_all_joints_that_follow_a_motor_bound_it(imported, tmp_path):
    axis, loops = '<axis xyz="0 -1 0"/>', tmp_path / 'loops.yaml'
    ends = '<limit lower="-0.1" upper="0.15"/>'
    file = written(tmp_path, 'five_bar.urdf', (
        axis, f'{axis}{ends}<mimic joint="mot_front" multiplier="0.5"/>'), (
        '"mot_back" type="continuous"', '"mot_back" type="revolute"'))
    loops.write_text('{closed_loop: [[front_foot, back_foot]], type: [3d], name_mot: [mot_front]}')
    mechanism, = imported(file, '--loops', loops).values()
    drive = mechanism.first
    assert (np.array(drive.ends) - drive.offset) / drive.ratio == pytest.approx([-0.2, 0.3])


def test_a_check_begins_at_a_pose_outside_the_limits(imported, tmp_path):
    file = written(tmp_path, 'four_bar.urdf', (LIMIT, 'lower="0.2" upper="1.2"'))
    mechanism, = imported(file).values()
    assert mechanism.first.start == pytest.approx(mechanism.first.ends[0])
    assert 'in 240 poses of the robot' in printed(file)
    assert 'motor from 0 to 1.2,' in printed(file)


def test_what_follows_a_joint_that_is_held_is_held(capsys, tmp_path):
    file = mimicking(tmp_path, ('servo', '', ''), more=SERVO)
    assert 'it cannot move, as its joints hold each other' in refused(
        capsys, file, '--hold', 'servo=0.1')


def compared(robot, given, **ends):
    """Return the report on a scene's mechanism, or how it differs from its robot."""
    mechanisms = scene.read(given).mechanisms
    reports, wrong = check.compared(robot, mechanisms, [
        check.Imported(*mechanisms, {}, [], [*ends], ends)])
    return ' '.join([*reports, *wrong.values()])


def test_a_source_of_several_mechanisms_is_checked_where_all_of_them_move():
    robot = closing.closed(readers.read(str(ROBOTS / 'four_bar.urdf'))).robot
    mechanisms = scene.read(cli.described(robot)[0]).mechanisms
    (report,), wrong = check.compared(robot, mechanisms, [
        check.Imported('motor', {}, [], ['motor'], {'motor': ends})
        for ends in ((-1.0, 0.5), (-0.5, 1.0))])
    assert not wrong and 'motor from -0.5 to 0.5, ' in report


def checked(text):
    """Return in how many poses each mechanism was checked, and how far loops are open [m]."""
    return [(int(count), float(worst)) for count, worst in re.findall(
        'Checked: .*: in (.*) poses of the robot, .* loops stand open by (.*) m at most', text)]


@pytest.mark.parametrize('place', ['0 0 0.2', '0 0 0.20001', '0 0.01 0.2', '0 0 0.26'])
def test_a_scene_is_held_against_its_robot_over_the_range_of_its_motor(tmp_path, place):
    text = printed(written(tmp_path, 'four_bar.urdf', (
        '<link2 link="rocker" xyz="0 0 0.2"/>', f'<link2 link="rocker" xyz="{place}"/>')))
    (count, worst), = checked(text)
    assert count >= 200 and worst < 1e-12 and 'motor from -1.2 to 1.2' in text


def test_of_a_wide_range_two_turns_are_checked(tmp_path):
    text = printed(written(tmp_path, 'four_bar.urdf', (LIMIT, 'lower="-40" upper="40"')))
    assert 'motor from -6.283 to 6.283,' in text and 'sweep: [-4' in text


def test_a_range_is_checked_up_to_where_loops_end(tmp_path):
    # The crank reaches from 35.6 to 112.8 degrees, by the cosine rule, and stands at 90.
    text = printed(written(tmp_path, 'four_bar.urdf', (LIMIT, ''), (
        '<link2 link="rocker" xyz="0 0 0.2"/>', '<link2 link="rocker" xyz="0 0 0.12"/>')))
    (count, worst), = checked(text)
    low, high = map(float, re.search('motor from (.*) to (.*), its', text).groups())
    assert count >= 200 and worst < 1e-12 and 'not beyond where its loops end' in text
    assert -0.40 < low < -0.35 and 0.85 < high < 0.95


@pytest.mark.parametrize('old, new, why', [
    (' parallelogram', ' antiparallelogram', 'elbow is off by 1'),
    ('ground 0.3 0', 'ground 0.3 1e-8', 'its loops stand open by 1e-08 m'),
    ('=-shoulder', '=shoulder', 'shoulder is off by 3.1'),
    ('=elbow-1.570', '=elbow-1.572', 'elbow is off by 0.002$'),
    ('=elbow-1.57079632', '=elbow-1.57079633', 'its loops stand open by 3e-09 m$')])
def test_a_mechanism_that_differs_from_its_robot_is_refused(old, new, why):
    robot = closing.closed(readers.read(str(ROBOTS / 'four_bar.urdf'))).robot
    given, *_ = cli.described(robot)
    assert compared(robot, given, motor=(-1.2, 1.2)).startswith('Checked: motor: in 240 poses')
    key = 'motor.joint_names' if '=' in old else 'motor.joints'
    changed = [line.replace(old, new) for line in given[key]]
    assert changed != given[key]
    given[key] = changed
    assert re.match(f'with motor at .* {why}', compared(robot, given, motor=(-1.2, 1.2)))


BALL = ('<link name="a"/><link name="b"/><joint name="elbow_y" type="continuous">'
        '<parent link="crank"/><child link="a"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/>'
        '</joint><joint name="elbow_x" type="continuous"><parent link="a"/><child link="b"/>'
        '<axis xyz="1 0 0"/></joint><joint name="elbow" type="continuous">'
        '<parent link="b"/><child link="coupler"/><axis xyz="0 0 1"/>')
PIN_OF_ROD = ('<joint name="elbow" type="continuous">\n    <parent link="crank"/><child link='
         '"coupler"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/>')
ROD = [(PIN_OF_ROD, BALL), ('name="wrist" type="revolute"', 'name="wrist" type="spherical"')]


def test_hinges_that_cross_at_the_end_of_a_rod_are_a_ball(imported, capsys, tmp_path):
    file = written(tmp_path, 'four_bar.urdf', *ROD)
    assert "hold:='elbow_x=0 elbow=0'" in printed(file) and 'Not published' not in printed(file)
    mechanism, = imported(file).values()
    # About the normal of the plane first, so that the rod's other hinges stay.
    for angle in (-1.1, 0.4, 1.2):
        assert published(mechanism, motor=angle) == pytest.approx(
            {'motor': angle, 'shoulder': -angle, 'elbow_y': -angle}, abs=1e-14)
    loose = written(tmp_path, 'four_bar.urdf', *ROD, (
        'name="shoulder" type="continuous"', 'name="shoulder" type="spherical"'))
    assert 'not planar: coupler hangs on balls alone, and is no rod' in re.sub(
        'rocker hangs', 'coupler hangs', refused(capsys, loose))


def test_hinges_of_a_rod_that_its_other_end_needs_do_not_stay(imported, tmp_path):
    # A universal joint does not let the rod turn in the plane alone: it spins, too.
    file = written(tmp_path, 'four_bar.urdf', *ROD, (
        '</robot>', '<link name="cross"/><joint name="wrist_1" type="continuous">'
        '<parent link="rocker"/><child link="cross"/><origin xyz="0 0 0.2"/><axis xyz="0 1 1"/>'
        '</joint></robot>'), (
        '"wrist" type="spherical"', '"wrist" type="revolute"'), (
        '<link2 link="rocker" xyz="0 0 0.2"/>', '<link2 link="cross" xyz="0 0 0"/>'), (
        '<axis xyz="0 1 0"/>\n  </loop_joint>', '<axis xyz="0 1 -1"/>\n  </loop_joint>'))
    mechanism, = imported(file).values()
    assert published(mechanism, motor=0.4) == pytest.approx({'motor': 0.4, 'shoulder': -0.4})
    assert 'Not published: elbow_y, elbow_x, elbow, wrist_1: passive joints' in printed(file)


# A motor at the knee; a motor that follows the other; a knee that stays, as on a four-bar.
FIVE_BARS = [
    ('name_mot: [mot_front, front_knee]', '', lambda angle: {
        'mot_front': 0.2, 'front_knee': angle}),
    ('name_mot: [mot_front]', '<mimic joint="mot_front" multiplier="0.5"/>', lambda angle: {
        'mot_front': angle, 'mot_back': 0.5 * angle}),
    ('joint_name: [front_knee], joint_type: [FIXED], name_mot: [mot_front]', '', lambda angle: {
        'mot_front': 0.3 * angle, 'front_knee': 0.0})]


@pytest.mark.parametrize('more, mimic, motors', FIVE_BARS, ids=range(3))
def test_a_five_bar_is_closed_by_what_moves_it(imported, tmp_path, more, mimic, motors):
    axis, loops = '<axis xyz="0 -1 0"/>', tmp_path / 'loops.yaml'
    file = written(tmp_path, 'five_bar.urdf', (axis, axis + mimic))
    loops.write_text(f'{{closed_loop: [[front_foot, back_foot]], type: [3d], {more}}}')
    mechanism, = imported(file, '--loops', loops).values()
    assert {drive.source for drive in mechanism.inputs.values()} == {
        *re.search(r'name_mot: \[(.*)\]', more)[1].split(', ')}
    robot = LIBRARIES[1]((ROBOTS / 'five_bar.urdf').read_text())
    for angle in np.linspace(-0.3, 0.3, 7):
        joints = published(mechanism, **motors(angle))
        places = robot.places(joints, ['front_foot', 'back_foot'])
        assert places['front_foot'] == pytest.approx(places['back_foot'], abs=2e-15)
    rest, lost = cli.others(readers.read(str(file), str(loops)), {'m': mechanism}, {})
    assert not lost and [value for key, value in rest.items() if key.endswith('.source')] == [
        'front_knee'] * ('FIXED' in more) + ['mot_front'] * bool(mimic)


def test_a_ring_that_spins_on_a_pin_is_no_dead_point(imported, tmp_path):
    # Its halves are welded: where they are apart, that holds them in more ways.
    loops = tmp_path / 'loops.yaml'
    loops.write_text('{closed_loop: [[ring_a, ring_b]], type: [6d], '
                     'name_mot: [mot_front, mot_back]}')
    file = written(tmp_path, 'five_bar.urdf', ('</robot>', ''.join(
        f'<link name="{ring}"/><joint name="{ring}_pin" type="continuous"><parent link="{foot}"/>'
        f'<child link="{ring}"/><axis xyz="0 1 0"/></joint>'
        for ring, foot in (('ring_a', 'front_foot'), ('ring_b', 'back_foot'))) + '</robot>'))
    mechanism, = imported(file, '--loops', loops).values()
    said = printed(file, '--loops', loops)
    assert 'Left out: ring_a: idle, as it only turns about a pin of other bodies.' in said
    assert 'Not published: ring_a_pin, ring_b_pin: ' in said
    joints = published(mechanism, mot_front=0.3, mot_back=0.1)
    places = LIBRARIES[1]((ROBOTS / 'five_bar.urdf').read_text()).places(
        joints, ['front_foot', 'back_foot'])
    assert places['front_foot'] == pytest.approx(places['back_foot'], abs=2e-15)


def test_pins_that_are_apart_by_rounding_are_one(imported, tmp_path):
    plain, = imported('wheel_leg.urdf').values()
    file = written(tmp_path, 'wheel_leg.urdf', (
        '<child link="bell"/><axis', '<child link="bell"/><origin xyz="1e-13 0 0"/><axis'))
    mechanism, = imported(file).values()
    assert mechanism.linkage.points == plain.linkage.points


def test_angles_that_are_rounded_in_the_file_are_in_one_plane(imported, tmp_path):
    rounded = written(tmp_path, 'four_bar.urdf', (
        'xyz="0.3 0 0"/><axis xyz="0 -1 0"/>',
        'xyz="0.3 0 0" rpy="1.5708 0 0"/><axis xyz="0 0 1"/>'), (
        '<link2 link="rocker" xyz="0 0 0.2"/>',
        '<link2 link="rocker" xyz="0 0.2 0" rpy="-1.5708 0 0"/>'))
    mechanism, = imported(rounded).values()
    assert mechanism.linkage.solve(mechanism.first.offset)['D'] == pytest.approx(
        [0.3, -0.2], abs=1e-5)


def test_a_jaw_slides_as_its_crank_and_rod_say(imported):
    mechanism, = imported('slider_crank.sdf').values()
    start = 0.0175 * complex(math.cos(0.4), math.sin(0.4))
    rod = abs(complex(0.0548, 0.013) - start)
    for angle in np.linspace(-2.0, 2.0, 25):
        pin = 0.0175 * complex(math.cos(0.4 + angle), math.sin(0.4 + angle))
        slide = pin.real + math.sqrt(rod ** 2 - (0.013 - pin.imag) ** 2) - 0.0548
        assert published(mechanism, servo=angle)['finger_slide'] == pytest.approx(slide, abs=1e-16)


def written(tmp_path, file, *changes):
    """Return a file that is another with some of its text changed."""
    text = (ROBOTS / file).read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / file
    path.write_text(text)
    return path


def refused(capsys, *args):
    """Return the sentence that refuses a file."""
    assert cli.main([str(arg) for arg in args]) == 1
    out, err = capsys.readouterr()
    assert not out and err.count('\n') == 1 and 'Traceback' not in err
    return err


def test_a_change_point_that_is_no_parallelogram_is_passed(imported, tmp_path):
    bars = written(tmp_path, 'four_bar.sdf', (
        '<pose>0.3 0 0 0 0 0</pose>', '<pose>0.5 0 0 0 0 0</pose>'), (
        '      <pose>0 0 -0.2 0 0 0</pose>',
        f'      <pose relative_to="__model__">{pin(-1)}</pose>'))
    mechanism, = imported(bars).values()
    for angle in np.linspace(-3.0, 3.0, 61):
        place = mechanism.linkage.solve(mechanism.first.offset + angle)['D']
        assert not np.isnan(place).any()


def pin(side):
    """Return the place of joint C [m] of a four-bar of 0.2, 0.4, 0.3 and 0.5, its crank down."""
    crank, base = complex(0.0, -0.2), complex(0.5, 0.0)
    arm = base - crank
    along = (abs(arm) ** 2 + 0.4 ** 2 - 0.3 ** 2) / (2.0 * abs(arm))
    place = crank + arm / abs(arm) * complex(along, side * math.sqrt(0.4 ** 2 - along ** 2))
    return f'{place.real!r} 0 {place.imag!r} 0 0 0'


WRONG = [
    ('four_bar.urdf', '0 -1 0', '0 -1 0.2',
     'not planar: the axes of motor and shoulder are 11.3 degrees from it'),
    ('four_bar.urdf', 'link="rocker" xyz="0 0 0.2"', 'link="rocker" xyz="0 0 2.2"',
     'its loops cannot be closed: they stay open by'),
    ('four_bar.urdf', 'name="wrist" type="revolute"', 'name="wrist" type="universal"',
     'joint wrist is universal and must have two axes'),
    ('four_bar.xml', '<connect name="wrist" body1="coupler" body2="rocker" anchor="0.3 0 0"/>',
     '<weld name="wrist" body1="coupler" body2="rocker"/>',
     'it cannot move, as its joints hold each other'),
    ('four_bar.xml', '<worldbody>', '<include file="floor.xml"/><worldbody>',
     "four_bar.xml: it includes 'floor.xml', which is not there\n"),
    ('four_bar.xml', '<worldbody>',
     '<extension><plugin plugin="mujoco.none"/></extension><worldbody>',
     "four_bar.xml: it uses the plugin 'mujoco.none', which this MuJoCo does not have: remove")]


@pytest.mark.parametrize('file, old, new, why', WRONG, ids=range(len(WRONG)))
def test_what_is_wrong_in_a_robot_is_named(capsys, tmp_path, file, old, new, why):
    if file.endswith('.xml'):
        pytest.importorskip('mujoco')
    assert why in refused(capsys, written(tmp_path, file, (old, new)))


BAD = [('<robot', 'is no XML: '),
       ('<?xml version="1.0" encoding="foo-1"?><robot/>', 'is no XML: unknown encoding: foo-1'),
       ('<?xml version="1.0" encoding="utf-7"?><robot/>', 'is no XML: multi-byte encodings'),
       ('<robot><link name="a"/><link name="b"/><joint name="knee" type="continuous">'
        '<parent link="a"/><child link="b"/><mimic joint="kne"/></joint></robot>',
        "robot.xml: knee follows 'kne', which is no joint; did you mean knee?"),
       ('<a/>', 'must be MJCF, SDF or URDF, not <a>'),
       ('<robot name="r"><xacro:property name="a" value="1"/></robot>',
        'robot.xml is xacro: run xacro first, as in xacro '),
       ('<robot/>', 'a URDF has one root link, not 0'),
       ('<sdf/>', 'the SDF has no model with joints'),
       ('<mujoco><b/></mujoco>', 'Schema violation'),
       ('<robot><link name="a"/><link name="b"/><joint type="continuous"><parent link="a"/>'
        '<child link="b"/></joint></robot>', 'robot.xml: a joint has no name'),
       ('<robot><link name="a"/><link name="b"/><joint name="j" type="revolute">'
        '<parent link="a"/><child link="b"/><axis xyz="0 a"/></joint></robot>',
        "cannot be read: could not convert string to float: 'a'")]


@pytest.mark.parametrize('text, why', BAD)
def test_a_bad_file_is_refused_in_one_sentence(capsys, tmp_path, text, why):
    file = tmp_path / 'robot.xml'
    file.write_text(text)
    if '<mujoco' in text:
        pytest.importorskip('mujoco')
    assert why in refused(capsys, file)


def changed(text, rng):
    """Return a file with a byte, a number, a text or an element changed."""
    def spans(pattern):
        return [found.span() for found in re.finditer(pattern, text, re.DOTALL)]

    low, high = rng.choice(spans(rng.choice((
        '.', r'[-+]?\d+\.?\d*', r'(?<=")[^"]*(?=")', r' \w+="[^"]*"', r'<(\w+)[^<>]*/>',
        '<joint.*?</joint>', '<link.*?</link>'))) or [(0, 1)])
    start, end = rng.choice(spans(r'(?<=")[^"]*(?=")'))
    return text[:low] + rng.choice((
        '', 2 * text[low:high], text[start:end], 'nan', '-inf', '1e308', '1e-320', '0', 'é', '<')
    ) + text[high:]


@pytest.mark.parametrize('count', [4, pytest.param(60, marks=pytest.mark.nightly)])
@pytest.mark.parametrize('ending', ['sdf', 'urdf', 'xml'])
def test_whatever_is_in_a_file_it_is_read_or_refused_in_one_sentence(
        capsys, tmp_path, ending, count):
    if ending == 'xml':
        pytest.importorskip('mujoco')
    rng, texts = random.Random(ending), [
        path.read_text() for path in sorted(ROBOTS.glob(f'*.{ending}'))]
    for _ in range(count):
        file = tmp_path / f'robot.{ending}'
        file.write_text(changed(rng.choice(texts), rng), encoding='utf-8')
        code = cli.main([str(file)])
        out, err = capsys.readouterr()
        assert code == 0 or not out and err.count('\n') == 1, file.read_text()


@pytest.mark.parametrize('long', ['<!--{}-->', '<?of {}?>', '<material name="{}"/>'])
def test_a_long_comment_costs_no_more_than_its_letters(tmp_path, long):
    # A parser that is fed piece by piece reads what is unfinished anew with each piece: 20 s of
    # the processor, and not the tenth of a second that it takes.
    file = written(tmp_path, 'four_bar.urdf', (
        '</robot>', long.format(10 ** 7 * 'x') + '</robot>'))
    start = time.thread_time()
    robot = readers.read(str(file))
    assert time.thread_time() - start < 5.0
    assert {*robot.positions} == {'motor', 'elbow', 'shoulder'}


@given(st.lists(st.text(max_size=40), min_size=4, max_size=4), st.sampled_from([1, 100]))
@example(['\x9b2J'] * 4, 1)
@example(['\x1b]0;title\x07'] * 4, 1)
@example(['x', '', 'x y ', 'x'], 1500)
@settings(max_examples=3)
def test_a_name_of_the_file_is_never_more_than_text_in_the_terminal(more, times):
    text = (ROBOTS / 'four_bar.urdf').read_text()
    names = ('coupler', 'rocker', 'elbow', 'motor')
    called = {name: name + times * each for name, each in zip(names, more)}
    with TemporaryDirectory() as folder, redirect_stderr(io.StringIO()) as err, redirect_stdout(
            io.StringIO()) as out:
        file = Path(folder, 'named.urdf')
        root = ElementTree.fromstring(text)
        for part in root.iter():
            for key in ('name', 'link', 'joint'):
                if part.get(key) in called:
                    part.set(key, called[part.get(key)])
        with suppress(UnicodeEncodeError):
            ElementTree.ElementTree(root).write(file, 'utf-8')
        cli.main([str(file), '--driven', 'nobody'])
        cli.main([str(file)])
    for line in err.getvalue().splitlines():
        assert line.isprintable() and len(line) < 5000
        assert max(map(len, line.split()), default=0) <= 300
    assert all(line.isprintable() for line in out.getvalue().splitlines())


def test_what_is_missing_is_said_in_one_sentence(capsys, tmp_path):
    assert 'nowhere.urdf: No such file' in refused(capsys, tmp_path / 'nowhere.urdf')
    loops = tmp_path / 'loops.yaml'
    loops.write_text('closed_loop: [{link_a: front')
    assert 'is no YAML' in refused(capsys, ROBOTS / 'five_bar.urdf', '--loops', loops)


PIN = '{pin_loops: [{parent: coupler, child: rocker, %s: [0.3, 0, 0]}], independent: [motor]}'


@pytest.mark.parametrize('text, why', [
    (PIN % 'parent_xzy', "names 'parent_xyz', which is not there"),
    (PIN.replace('independent', 'indepndent') % 'parent_xyz', "there is no key 'indepndent'; "
     'allowed: closures, .*; did you mean independent?'),
    ('{closures: [{link_a: coupler, link_b: rocker, 7: 8}]}', "names 'point', which is not")])
def test_an_unknown_key_of_a_file_of_loops_is_refused(capsys, tmp_path, text, why):
    loops = tmp_path / 'loops.yaml'
    loops.write_text(text)
    said = refused(capsys, ROBOTS / 'four_bar.urdf', '--loops', loops)
    assert re.search(re.escape(why).replace(r'\.\*', '.*'), said)


def test_rods_that_hold_each_other_are_named(capsys, tmp_path):
    pins = {'1': '0 0 0', '2': '1 0 0', '3': '0.4 1 0'}
    eyes = {'1': '0.3 0.3 0', '2': '0.8 0.35 0', '3': '0.5 0.7 0'}
    links = ''.join(f'<link name="rod{i}"><pose>{pins[i]} 0 0 0</pose></link>' for i in pins)
    joints = ''.join(
        f'<joint name="base{i}" type="revolute"><parent>{"crank" if i == "1" else "world"}'
        f'</parent><child>rod{i}</child></joint><joint name="eye{i}" type="revolute">'
        f'<pose relative_to="__model__">{eyes[i]} 0 0 0</pose><parent>rod{i}</parent>'
        '<child>platform</child></joint>' for i in pins)
    file = tmp_path / 'platform.sdf'
    file.write_text(f"""<sdf version="1.9"><model name="platform"><link name="platform"/>
        <link name="crank"><pose>-0.2 0 0 0 0 0</pose></link>{links}{joints}
        <joint name="motor" type="revolute"><parent>world</parent><child>crank</child></joint>
        <plugin name="p" filename="p"><joint_name>motor</joint_name></plugin></model></sdf>""")
    assert 'not of dyads: rod1, platform, rod2, rod3 hold each other' in refused(capsys, file)


def sprung(tmp_path):
    """Return a gripper with a spring in a finger."""
    pytest.importorskip('mujoco')
    body = '<body name="right_coupler" pos="0 0.0315 -0.0041">'
    return written(tmp_path, 'gripper.xml', (body, f'{body}<joint name="spring" axis="1 0 0"/>'))


@pytest.mark.nightly
def test_a_finger_with_a_spring_is_not_driven(capsys, tmp_path):
    assert cli.main([str(sprung(tmp_path))]) == 0
    assert re.search('Left out: .*right_coupler, right_spring_link, right_follower: not driven: '
                     '1 of right_spring_link_joint, .* must be moved, named by --driven, or held, '
                     'named by --hold', capsys.readouterr().err)


def test_motors_that_hold_each_other_are_named(imported, capsys):
    file = ROBOTS / 'four_bar.urdf'
    assert ('motor, shoulder drive it, and hold each other, as 1 of them tell where all is'
            in refused(capsys, file, '--driven', 'motor', 'shoulder'))
    assert imported(file, '--driven', 'shoulder')['shoulder']


FLAT = [f'{name}={value!r}' for name, value in (
    ('motor', 0.5 * math.pi), ('elbow', -0.5 * math.pi), ('shoulder', -0.5 * math.pi))]


@pytest.mark.parametrize('side', [0, 1])
def test_bars_in_line_move_on_as_they_are_told(imported, capsys, tmp_path, side):
    file = written(tmp_path, 'four_bar.urdf', (LIMIT, 'lower="-3" upper="3"'))
    line = refused(capsys, file, '--driven', 'motor', '--pose', *FLAT)
    motor, joint, *ends = re.search(
        r'bars lie in line where the file has them, and it moves on with (.*) (.*)=(.*) as '
        r'with \2=(.*): add --pose', line).groups()
    mechanism, = imported(file, '--driven', 'motor', '--pose', *FLAT, motor,
                          f'{joint}={ends[side]}').values()
    robot = LIBRARIES[1](file.read_text())
    elbows = set()
    for angle in np.linspace(0.3, 1.2, 10):
        joints = published(mechanism, motor=angle)
        places = robot.places(joints, ['wrist_a', 'wrist_b'])
        assert places['wrist_a'] == pytest.approx(places['wrist_b'], abs=2e-15)
        elbows.add(abs(math.remainder(joints['elbow'] + angle, math.tau)) < 1e-12)
    # One of both ends is a parallelogram's, whose coupler does not turn.
    start = float(motor.partition('=')[2])
    is_parallel = {'elbow': -start, 'shoulder': -start}[joint] == pytest.approx(
        float(ends[side]), abs=0.02)
    assert elbows == {is_parallel}


def test_a_pose_at_the_end_of_its_loops_is_left_on_the_other_side(capsys, tmp_path):
    # Coupler and rocker lie in line where the crank is up, and do not reach as far elsewhere.
    file = written(tmp_path, 'four_bar.urdf', (
        '<limit lower="-1.2" upper="1.2"', '<limit lower="-2" upper="-1"'), (
        'xyz="0 0 0.2"/><axis', f'xyz="0 0 0.2" rpy="0 {math.atan2(2.0, 3.0)!r} 0"/><axis'), (
        'xyz="0.3 0 0"/><axis', f'xyz="0.3 0 0" rpy="0 {-math.atan2(3.0, 2.0)!r} 0"/><axis'), (
        'link="coupler" xyz="0.3 0 0"', f'link="coupler" xyz="{13 ** 0.5 / 10 - 0.2!r} 0 0"'))
    line = refused(capsys, file, '--driven', 'motor')
    assert 'bars lie in line where the file has them, and it moves on with motor=0.1 ' in line
    # What is printed leads on: the loops do not let the motor inside its limits.
    for more in re.findall('--pose (.*?) (?:or (?=--)|to the command)', line):
        assert cli.main([str(file), '--driven', 'motor', '--pose', *more.split()]) == 0
        assert 'motor, from -2 to -1: its loops do not reach them' in capsys.readouterr().err


def test_names_of_a_file_stay_names(imported, tmp_path):
    yaml = pytest.importorskip('yaml')
    name = 'jy\n/crank_driver: {ros__parameters: {rate: 1.0}}\n#'
    text = name.replace('\n', '&#10;')
    file = written(tmp_path, 'four_bar.urdf', ('"shoulder"', f'"{text}"'), (
        '"elbow"', '"finger-1"'), ('"wrist"', '"&#x2028;evil: 1&#x85;"'))
    evil = file.rename(tmp_path / 'robot\nevil: 2\n#.urdf')
    mechanism, = imported(evil).values()
    assert published(mechanism, motor=0.4).keys() == {name, 'finger-1', 'motor'}
    assert yaml.safe_load(printed(evil)).keys() == {'/**'}


CUT = re.compile('<loop_joint.*</loop_joint>', re.DOTALL)
LINKS = ('<link name="closing_w_1"/><link name="closing_w_2"/>'
         '<joint name="c1" type="fixed"><parent link="coupler"/><child link="closing_w_1"/>'
         '<origin xyz="0.3 0 0" rpy="1 2 3"/></joint><joint name="c2" type="fixed">'
         '<parent link="rocker"/><child link="closing_w_2"/><origin xyz="0 0 0.2"/></joint>')
DIALECTS = {
    'loop_joint of RigidBodyDynamics and Isaac Sim': (
        '<loop_joint name="w" type="revolute"><link1 link="coupler" xyz="0.3 0 0" rpy="0 0 0"/>'
        '<link2 link="rocker" xyz="0 0 0.2" rpy="0 0 0"/><axis xyz="0 1 0"/></loop_joint>', ''),
    'an empty end of Isaac Sim': (
        '<loop_joint name="w" type="revolute"><link1/><link1 link="coupler" xyz="0.3 0 0"/>'
        '<link2 link="rocker" xyz="0 0 0.2"/><axis xyz="0 1 0"/></loop_joint>', ''),
    'loop of URDF+': (
        '<loop name="w" type="continuous"><predecessor link="coupler"><origin xyz="0.3 0 0"/>'
        '</predecessor><successor link="rocker"><origin xyz="0 0 0.2"/></successor>'
        '<axis xyz="0 1 0"/></loop>', ''),
    'joint of Gazebo': (
        '<gazebo><joint name="w" type="revolute"><parent>coupler</parent><child>rocker</child>'
        '<pose>0 0 0.2 0 0 0</pose><axis><xyz>0 1 0</xyz></axis></joint></gazebo>', ''),
    'universal joint of Gazebo': (
        '<gazebo><joint name="w" type="universal"><parent>coupler</parent><child>rocker</child>'
        '<pose>0 0 0.2 0 0 0</pose><axis><xyz>0 1 0</xyz></axis><axis2><xyz>1 0 0</xyz></axis2>'
        '</joint></gazebo>', ''),
    'ball_constraint of Drake': (
        '<drake:ball_constraint><drake:ball_constraint_body_A name="coupler"/>'
        '<drake:ball_constraint_body_B name="rocker"/><drake:ball_constraint_p_AP '
        'value="0.3 0 0"/><drake:ball_constraint_p_BQ value="0 0 0.2"/></drake:ball_constraint>',
        ''),
    'linear_bushing_rpy of Drake': (
        '<frame name="f" link="coupler" xyz="0.3 0 0" rpy="0 0 0"/>'
        '<frame name="g" link="rocker" xyz="0 0 0.2" rpy="0 0 0"/><drake:linear_bushing_rpy>'
        '<drake:bushing_frameA name="f"/><drake:bushing_frameC name="g"/>'
        '<drake:bushing_torque_stiffness value="1e4 0 1e4"/></drake:linear_bushing_rpy>', ''),
    'frames of onshape-to-robot': (LINKS, ''),
    'links of example-parallel-robots': (
        '', '{closed_loop: [[wrist_a, wrist_b]], type: [3d], name_mot: [motor]}'),
    'joints of example-parallel-robots': (
        '', '{closed_loop: [[wrist_a_fixed, wrist_b_fixed]], type: [3D], name_mot: [motor]}'),
    'pins of Robonex': (
        '', '{pin_loops: [{name: w, parent: coupler, child: rocker, parent_xyz: [0.3, 0, 0], '
        'child_xyz: [0, 0, 0.2], axis: [0, 1, 0]}]}'),
    'balls of Robonex': (
        '', '{ball_loops: [{parent: coupler, child: rocker, parent_xyz: [0.3, 0, 0], '
        'child_xyz: [0, 0, 0.2]}]}'),
    'closures of solidworks_urdf_exporter2': (
        '', '{closures: [{link_a: coupler, link_b: rocker, point: [0.3, 0, 0.2], '
        'axis: [0, 1, 0]}], independent: [motor]}'),
    'a rod that detaches': (
        '<gazebo><plugin filename="gz-sim-detachable-joint-system" '
        'name="gz::sim::systems::DetachableJoint"><parent_link>coupler</parent_link>'
        '<child_link>pin</child_link></plugin></gazebo><link name="pin"/><joint name="pin_joint" '
        'type="continuous"><parent link="rocker"/><child link="pin"/><origin xyz="0 0 0.2"/>'
        '<axis xyz="0 1 0"/></joint>', '')}


def test_world_of_drake_is_no_second_root(imported, tmp_path):
    plain, = imported('four_bar.urdf').values()
    file = written(tmp_path, 'four_bar.urdf', ('<link name="base_link"/>',
                                               '<link name="world"/><link name="base_link"/>'))
    mechanism, = imported(file).values()
    assert mechanism == plain and mechanism.frame_id == 'base_link'
    more = written(tmp_path, 'four_bar.urdf', ('<link name="base_link"/>',
                                               '<link name="earth"/><link name="base_link"/>'))
    with pytest.raises(readers.RequestError, match='a URDF has one root link, not 2'):
        readers.read(str(more))


def rotation(angles):
    """Return the rotation by angles about fixed x, y, z in turn."""
    turned = np.eye(3)
    for angle, (i, j) in zip(angles, ((1, 2), (2, 0), (0, 1))):
        step = np.eye(3)
        step[[i, j], [i, j]], step[j, i], step[i, j] = np.cos(angle), np.sin(angle), -np.sin(angle)
        turned = step @ turned
    return turned


def euler(rng):
    """Return three random angles, and the rotation by them."""
    angles = rng.uniform(-1.5, 1.5, 3)
    return angles, rotation(angles)


@pytest.mark.parametrize('seed', range(4))
@pytest.mark.parametrize('flag', ['', '0', '1', 'true', 'false'])
def test_the_axis_of_a_joint_of_gazebo_is_seen_as_the_file_says(tmp_path, seed, flag):
    # In the frame of the joint, which is on the child; by use_parent_model_frame in the model's.
    rng, file = np.random.default_rng(seed), tmp_path / 'robot.urdf'
    (link, on_link), (pose, on_pose) = euler(rng), euler(rng)
    axis, (place, at) = rng.normal(size=3), rng.normal(size=(2, 3))
    file.write_text(
        '<robot name="r"><link name="base"/><link name="b"/><joint name="j" type="continuous">'
        f'<parent link="base"/><child link="b"/><origin xyz="{words(place)}" rpy="{words(link)}"/>'
        '</joint><gazebo><joint name="w" type="revolute"><parent>base</parent><child>b</child>'
        f'<pose>{words(at)} {words(pose)}</pose><axis><xyz>{words(axis)}</xyz>'
        + f'<use_parent_model_frame>{flag}</use_parent_model_frame>' * bool(flag)
        + '</axis></joint></gazebo></robot>')
    joint = next(joint for joint in readers.read(str(file)).joints if joint.name == 'w')
    seen = axis / np.linalg.norm(axis)
    seen = seen if flag in ('1', 'true') else on_link @ on_pose @ seen
    assert joint.axes[0] == pytest.approx(seen, abs=1e-14)
    assert joint.axes[1] == pytest.approx(seen, abs=1e-14)
    assert joint.places[0] == pytest.approx(place + on_link @ at, abs=1e-14)


BALLS = '{pin_loops: [], ball_loops: [{parent: coupler, child: rocker, parent_xyz: [0.3, 0, 0], ' \
    'child_xyz: [0, 0, 0.2]}], joint_name: [elbow], joint_type: [SPHERICAL], independent: [motor]}'
PAIRS = '{closed_loop: [[wrist_a, wrist_b]], type: [3d], name_mot: [motor], ' \
    'joint_name: [elbow], joint_type: [%s]}'


@pytest.mark.parametrize('text', [BALLS, PAIRS % 'SPHERICAL', PAIRS % 'UJOINT_YX'])
def test_joints_of_the_tree_are_what_a_file_of_loops_makes_them(imported, capsys, tmp_path, text):
    file, loops = tmp_path / 'four_bar.urdf', tmp_path / 'loops.yaml'
    # A transmission is of the open tree.
    file.write_text(CUT.sub('<transmission name="t"><joint name="shoulder"/></transmission>',
                            (ROBOTS / 'four_bar.urdf').read_text()))
    loops.write_text(text)
    mechanism, = imported(file, '--loops', loops).values()
    for angle in (-1.1, 0.0, 0.7):
        assert published(mechanism, motor=angle) == pytest.approx(
            {'motor': angle, 'shoulder': -angle}, abs=1e-14)
    loops.write_text(text.replace('elbow', 'elbwo'))
    said = refused(capsys, file, '--loops', loops)
    assert "names 'elbwo', which is not there" in said


def test_urdf_plus_names_the_joints_that_are_not_driven(tmp_path):
    free = [(f'<joint name="{name}"', f'<joint independent="false" name="{name}"')
            for name in ('motor', 'elbow')]
    assert readers.read(str(written(tmp_path, 'four_bar.urdf', *free))).driven == ['shoulder']
    motor = '</robot>', '<transmission name="t"><joint name="motor"/></transmission></robot>'
    assert readers.read(str(written(tmp_path, 'four_bar.urdf', *free, motor))).driven == ['motor']


@pytest.mark.parametrize('joints', ['', 'B', 'C', 'D', 'BD', 'BC', 'BCD'])
def test_a_universal_joint_of_an_sdf_is_a_pin(imported, tmp_path, joints):
    text = (ROBOTS / 'four_bar.sdf').read_text()
    for name in joints:
        text = re.sub(rf'(name="joint_{name}" type=")revolute(.*?)</axis>',
                      r'\1universal\2</axis><axis2><xyz>1 0 0</xyz></axis2>', text, count=1,
                      flags=re.DOTALL)
    assert text.count('universal') == len(joints)
    file = tmp_path / 'four_bar.sdf'
    file.write_text(text)
    mechanism, = imported(file).values()
    # A parallelogram stays one.
    for angle in (-2.0, 0.4, 3.0):
        found = published(mechanism, joint_A=angle)
        assert found.keys() == {f'joint_{name}' for name in 'ABCD'}
        for name, value in {'joint_B': -angle, 'joint_C': angle, 'joint_D': angle}.items():
            assert math.remainder(found[name] - value, math.tau) == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize('lean, why', [
    (9e-4, 'from_robot: Warning: the file is not exact: axes lean by 0.0009 rad, and loops stay'),
    (5e-6, 'from_robot: Warning: the file is not exact: axes lean by 5e-06 rad, and loops stay'),
    (0.0, ''), (2e-3, 'are 0.115 degrees from it, more than 0.057; ')])
def test_a_misfit_is_printed_and_imported_if_it_is_small(capsys, tmp_path, lean, why):
    pytest.importorskip('mujoco')
    file = written(tmp_path, 'four_bar.xml', ('axis="0 -1 0"', f'axis="{lean} -1 0"'))
    code = cli.main([str(file)])
    out, err = capsys.readouterr()
    assert code == (lean > 1e-3) and why in err and bool(why) == ('rad, and' in err or code > 0)
    # Where the file has it, by as much as the axis leans.
    assert code or 'motor.crank.start: -0.870796' in out
    assert all(worst <= max(2.0 * lean, 1e-15) for _, worst in checked(err))


@pytest.mark.parametrize('low, start', [(-0.5, 0.0), (0.2, 0.2)])
def test_limits_of_a_motor_between_two_moving_links_are_its_sweep(imported, tmp_path, low, start):
    file = written(tmp_path, 'four_bar.urdf', (
        '"elbow" type="continuous">', f'"elbow" type="revolute"><limit lower="{low}" upper="0.8"/>'
    ))
    mechanism, = imported(file, '--driven', 'elbow').values()
    assert mechanism.first.ends == pytest.approx((low, 0.8)) and mechanism.first.start == start


def test_a_passive_joint_of_a_loop_is_no_input(imported, tmp_path):
    # A spring beside the motor's loop leaves a second one undetermined.
    spring = sprung(tmp_path)
    mechanisms, robot = imported(spring), readers.read(str(spring))
    rest, lost = cli.others(robot, mechanisms, {})
    loop = {'spring', 'right_spring_link_joint', 'right_follower_joint'}
    assert {*lost} == loop and not loop & {*map(str, rest.values())}
    assert f'Not published: {", ".join(lost)}: passive joints of loops' in printed(spring)
    rest, lost = cli.others(robot, mechanisms, {'spring': 0.0})
    assert {*lost} == loop - {'spring'} and 'spring' in {*map(str, rest.values())}


def test_a_joint_of_the_whole_robot_that_opens_a_loop_is_named(monkeypatch, capsys):
    # As if a passive joint were an input.
    file = ROBOTS / 'wheel_leg.urdf'
    robot = closing.closed(readers.read(str(file))).robot
    given, _, _ = cli.described(robot)
    names = [line for line in given['hip.joint_names'] if 'bell' not in line]
    mechanisms = scene.read({**given, 'hip.joint_names': names}).mechanisms
    rest, lost = cli.others(robot, mechanisms, {})
    assert lost == ['bell_joint'] and not rest
    still, _ = cli.others(robot, mechanisms, {'bell_joint': 0.0})
    wrong = scene.read({**given, **still, 'hip.joint_names': names,
                        'mechanisms': ['hip', 'others']}).mechanisms
    ends = {'hip': (-0.2, 0.3), 'crank_motor': (-0.3, 0.3)}
    made = [check.Imported('hip', {}, [], [*ends], ends)]
    assert not check.compared(robot, mechanisms, made)[1]
    found = check.compared(robot, wrong, made)
    assert not found[0] and re.match('with hip at .*, crank_motor at .* its loops stand open by ',
                                     found[1]['hip'])
    monkeypatch.setattr(check, 'compared', lambda *_: found)
    assert f'Left out: hip: compared with the robot: {found[1]["hip"]}.' in refused(capsys, file)


@pytest.mark.parametrize('file', ['boom.urdf', 'gripper.xml', 'rack.sdf', 'palletiser.urdf'])
def test_all_joints_of_a_whole_robot_are_published(imported, file):
    more = ['--loops', ROBOTS / 'palletiser_loops.yaml'] * ('pallet' in file)
    mechanisms = imported(file, *more)
    robot = readers.read(str(ROBOTS / file), *map(str, more[1:]))
    rest, lost = cli.others(robot, mechanisms, {})
    assert not lost
    names = ['others'] * bool(rest)
    if names:
        mechanisms = {**mechanisms, **scene.read({**rest, 'mechanisms': names}).mechanisms}
    published = {drive.source for mechanism in mechanisms.values()
                 for drive in mechanism.inputs.values()}
    published |= {called.name for mechanism in mechanisms.values()
                  for called in mechanism.joints.values() if called.published}
    text = readers.description(str(ROBOTS / file), robot)
    assert {*LIBRARIES[1](text).joints} <= published


def test_a_comment_of_another_format_makes_no_urdf(tmp_path):
    file = written(tmp_path, 'four_bar.sdf', ('</sdf>', '</sdf><!-- from <robot> -->'))
    assert readers.description(str(file), readers.read(str(file))).startswith('<robot')


def test_a_motor_between_two_moving_links_drives_in_the_frame_of_one(imported):
    # As in a parallelogram: the elbow turns back as far as the shoulder turns.
    mechanism, = imported('four_bar.urdf', '--driven', 'elbow').values()
    assert (mechanism.first.source, mechanism.frame_id) == ('elbow', 'crank')
    for angle in (-0.8, 0.3, 1.1):
        assert published(mechanism, elbow=angle) == pytest.approx(
            {'elbow': angle, 'motor': -angle, 'shoulder': angle}, abs=1e-9)


@pytest.mark.nightly
def test_a_loop_of_too_many_links_is_refused_at_once(capsys, tmp_path):
    file, count = tmp_path / 'chain.urdf', 3000
    links = ''.join(f'<link name="l{i}"/>' for i in range(count + 1))
    joints = ''.join(f'<joint name="j{i}" type="continuous"><parent link="l{i}"/>'
                     f'<child link="l{i + 1}"/><origin xyz="0.1 0 0"/></joint>'
                     for i in range(count))
    file.write_text(f'<robot name="r">{links}{joints}<loop_joint name="w" type="revolute">'
                    f'<link1 link="l0"/><link2 link="l{count}"/></loop_joint></robot>')
    assert f'{count} bodies are in loops that share joints: no more than 150' in refused(
        capsys, file)


def random_mjcf(rng):
    """Return a random tree of bodies, with what MJCF allows of frames, units and names."""
    names = iter(rng.permutation(['a b', 'joint-1', '3', 'Hüfte', 'x&quot;y', "o'k", 'l&#10;e',
                                  *(f'j{i}' for i in range(9))]))

    def vector(scale=1.0):
        return ' '.join(map(repr, map(float, rng.normal(size=3) * scale)))

    def body(depth):
        joints = ''.join(
            f'<joint name="{next(names, rng.integers(1 << 40))}" pos="{vector(0.1)}" '
            f'axis="{vector()}" type="{rng.choice(["hinge", "slide"])}" ref="{rng.normal():.3f}" '
            f'armature="0.1" limited="true" range="-3 3"/>' for _ in range(rng.integers(3)))
        return (f'<body name="b{rng.integers(1 << 40)}" pos="{vector()}" euler="{vector(50)}">'
                f'{joints}<geom size="0.1"/>'
                f'{"".join(body(depth + 1) for _ in range(rng.integers(3 - depth)))}</body>')

    return (f'<mujoco><compiler angle="{rng.choice(["degree", "radian"])}" eulerseq="zyx"/>'
            f'<worldbody>{body(0)}{body(0)}</worldbody></mujoco>')


@pytest.mark.parametrize('seed', range(12))
def test_a_tree_of_mujoco_is_the_same_tree_as_urdf(tmp_path, seed):
    mujoco = pytest.importorskip('mujoco')
    rng, file = np.random.default_rng(seed), tmp_path / 'tree.xml'
    file.write_text(random_mjcf(rng), encoding='utf-8')
    robot = readers.read(str(file))
    whole = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(whole)
    positions = {name: float(rng.normal()) for name in robot.positions}
    for name, value in positions.items():
        data.qpos[whole.joint(name).qposadr] = value
    mujoco.mj_kinematics(whole, data)
    bodies = [whole.body(i).name for i in range(1, whole.nbody)]
    found = LIBRARIES[1](write(readers.drawn(robot))).places(positions, bodies)
    for i, body in enumerate(bodies):
        assert found[body] == pytest.approx(data.xpos[i + 1], abs=1e-13)


def random_urdf(rng):
    """Return a random tree of links."""
    text, names = '<link name="base"/>', ['base']
    for i in range(rng.integers(2, 8)):
        rows = rng.normal(size=(3, 3))
        # Not all readers make axes as long as one.
        rows[2] /= np.linalg.norm(rows[2])
        numbers = [' '.join(map(repr, map(float, row))) for row in rows]
        kind = rng.choice(['revolute', 'continuous', 'prismatic', 'fixed'])
        text += (f'<link name="l {i}"/><joint name="j-{i}" type="{kind}"><parent link="'
                 f'{rng.choice(names)}"/><child link="l {i}"/><origin xyz="{numbers[0]}" '
                 f'rpy="{numbers[1]}"/><axis xyz="{numbers[2]}"/><limit lower="-9" upper="9" '
                 'effort="1" velocity="1"/></joint>')
        names.append(f'l {i}')
    return f'<robot name="r">{text}</robot>', names


@pytest.mark.parametrize('library', LIBRARIES)
@pytest.mark.parametrize('seed', range(8))
def test_links_are_where_other_readers_of_a_urdf_have_them(tmp_path, seed, library):
    rng, file = np.random.default_rng(seed), tmp_path / 'tree.urdf'
    text, names = random_urdf(rng)
    file.write_text(text)
    robot = readers.read(str(file))
    positions = {name: float(rng.uniform(-3.0, 3.0)) for name in robot.positions}
    there = library(text).places(dict.fromkeys(positions, 0.0) | positions, names)
    here = posed(robot, positions).frames
    for name in names:
        assert here[name][:3, 3] == pytest.approx(there[name], abs=1e-12)


def test_a_joint_of_an_sdf_may_end_at_a_frame(tmp_path):
    file = tmp_path / 'model.sdf'
    file.write_text("""<sdf version="1.9"><world name="w"><model name="m"><link name="a"/>
      <frame name="g" attached_to="n::c"><pose>0 0 0.5 0 0 0</pose></frame>
      <model name="n"><pose relative_to="a">0 0 3 0 0 0</pose><link name="c"/></model>
      <joint name="j" type="revolute"><parent>world</parent><child>g</child></joint>
      </model></world></sdf>""")
    joint, = readers.read(str(file)).joints
    assert joint.bodies == ('world', 'n::c')
    assert joint.places[0] == pytest.approx([0.0, 0.0, 3.5])


def robot_of(linkage, values):
    """Return a linkage as a robot: a tree of its links, and cuts where they meet once more."""
    places = {name: complex(*place) for name, place in linkage.solve(values).items()}
    robot, home, ways = readers.Robot('ground', {'ground': np.eye(4)}), {}, {}
    for name in linkage.points:
        line = linkage.line_of(name)
        if line.word in ('ground', 'image') or line.word in ('rigid', 'line') \
                and home.keys() >= {*line.depends_on}:
            home[name] = 'ground'

    def frame(name):
        made = np.eye(4)
        made[:2, 3] = places[name].real, places[name].imag
        return made

    for link in linkage.links:
        slides, along = link.kind == 'prismatic', ways.get(link.parent, 1.0)
        way = along * cmath.exp(1j * link.zero) if slides else (
            places[link.tip] - places[link.joint])
        robot.frames[link.name], ways[link.name] = np.eye(4), way
        robot.join(link.name, link.kind, (link.parent, link.name), frame(link.joint),
                   (way.real, way.imag, 0.0) if slides else (0.0, 0.0, 1.0), position=0.0)
        for name in linkage.frames[link.name]:
            if name in home and (slides or name != link.joint):
                robot.join(f'cut_{link.name}', 'revolute', (home[name], link.name), frame(name))
            if slides or name != link.joint:
                home.setdefault(name, link.name)
    robot.driven = [each.name for each in linkage.inputs]
    return robot


def check_comes_back(linkage, values, robot, steps, zeros=None):
    """
    Check that the scene of a linkage's robot moves as the linkage does, by steps of inputs.

    `zeros` are positions of the robot's joints before a step, if they are not 0.
    """
    zeros = Counter(zeros or {})
    given, said, _ = cli.described(robot)
    for count, worst in checked('\n'.join(said)):
        assert count >= 200 and worst < 1e-6
    mechanisms = scene.read(given).mechanisms.values()
    was, moved = linkage.joint_angles(values), 0
    for step in steps:
        now = linkage.joint_angles(np.add(values, step))
        motors = {each.name: zeros[each.name] + change
                  for each, change in zip(linkage.inputs, np.ravel(step))}
        found = {}
        for mechanism in mechanisms:
            found.update(published(mechanism, **{drive.source: motors[drive.source]
                                                 for drive in mechanism.inputs.values()}))
        for link in linkage.links:
            apart = found.get(link.name, math.nan) - zeros[link.name] - (
                now[link.name] - was[link.name])
            if not math.isnan(apart) and link.name not in motors:
                size = linkage.longest if link.kind == 'prismatic' else 1.0
                apart = apart if link.kind == 'prismatic' else math.remainder(apart, math.tau)
                assert abs(apart) < 1e-9 * size, (link.name, step)
                moved += 1
    return said, moved


def random_robot(seed):
    """Return a random linkage, inputs, its robot and steps; None where it has no pose."""
    rng = np.random.default_rng(seed)
    design = random_linkages.design(rng, without=('yoke', 'image'))
    try:
        linkage = mechanisms.create('custom', joints=design.joints, branches=design.branches,
                                    **design.dimensions)
    except ValueError:
        return None
    for _ in range(30 if 1e-3 < linkage.longest < 1e3 else 0):
        values = [rng.uniform(each.low, each.high) for each in linkage.inputs]
        values = values if len(values) > 1 else values[0]
        if not any(np.isnan(place).any() for place in linkage.solve(values).values()):
            robot, count = robot_of(linkage, values), Counter()
            for line in design.joints:
                _, word, *more = line.split()
                called = more[-1] if 'called' in more else ''
                count[word] += not called
                if 'geared' in more:
                    other, ratio = more[more.index('geared') + 1:][:2]
                    called = called or (f'{word}{count[word]}' if count[word] > 1 else word)
                    robot.follows[called] = other, float(ratio), 0.0
            return linkage, values, robot, 0.03 * rng.normal(size=(8, len(linkage.inputs)))
    return None


def check_random_robots(seeds):
    moved = 0
    for linkage, values, robot, steps in filter(None, map(random_robot, seeds)):
        try:
            moved += check_comes_back(linkage, values, robot, steps if len(steps[0]) > 1
                                      else steps.ravel())[1] > 0
        except RequestError as error:
            assert re.search('closes a loop|not of dyads|it cannot move', str(error))
    assert moved > len(seeds) // 2


def words(place):
    return ' '.join(repr(float(number)) for number in place)


def fixed(link, name, place):
    return (f'<link name="{name}"/><joint name="{name}_fixed" type="fixed"><parent link="{link}"/>'
            f'<child link="{name}"/><origin xyz="{words(place)}"/></joint>')


# Slots and cylinders on one pair of joints; gears of gears; crossed bars on a block.
@pytest.mark.nightly
@pytest.mark.parametrize('seeds', [
    [79, 84, 129, 179, 191, 301, 361, 531, 616, 643, 681, *range(20)],
    pytest.param(range(20, 120), marks=pytest.mark.nightly)])
def test_random_linkages_come_back_from_robots(seeds):
    check_random_robots(seeds)
