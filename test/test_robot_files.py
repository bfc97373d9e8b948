# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Scenes from robot descriptions: what they publish closes the loops of the file, everywhere."""

import cmath
from collections import Counter
import math
import random
import re
import time
from xml.etree import ElementTree

from linkage_ros import scene
from linkage_ros.cli import RequestError
from linkage_ros.linkage import theta_of
from linkage_ros.robot_files import check, cli, closing, planar, readers
from linkage_ros.robot_model import bodies, mjcf
import numpy as np
import pytest
from robots import (
    imported,
    LIBRARIES,
    MuJoCo,
    of_text,
    Pinocchio,
    printed,
    published,
    refused,
    ROBOTS,
    said,
    written,
)
from truth import random_linkages


def test_a_rod_with_ball_ends_on_a_moving_tarsus_keeps_its_length():
    mechanism, = imported('toe_rod.xml')
    assert mechanism.frame_id == 'tarsus'
    robot = MuJoCo((ROBOTS / 'toe_rod.xml').read_text())
    for position in np.linspace(-1.75, -0.1, 20):
        joints = published(mechanism, foot_crank_joint=position)
        robot.place(joints)
        foot, rod = (robot.data.body(name) for name in ('foot', 'plantar_rod'))
        end = foot.xpos + foot.xmat.reshape(3, 3) @ robot.model.eq_data[0, 3:6]
        assert math.dist(end, rod.xpos) == pytest.approx(0.35012, abs=1e-14)
        # The side of the keyframe: the foot follows its crank, as in a parallelogram.
        assert abs(joints['foot_joint'] - position) < 0.35


FEET = [('front_foot', 'back_foot')]
# The options of a file, how far its motors move, and frames that coincide.
FILES = {
    'four_bar.urdf': ((), {'motor': (-3.0, 3.0)}, [('wrist_a', 'wrist_b')]),
    'boom.urdf': ((), {'boom_cylinder': (-0.3, 0.5)}, [('eye_a', 'eye_b')]),
    'five_bar.urdf': (('--loops', str(ROBOTS / 'five_bar_loops.yaml')),
                      {'mot_front': (-0.4, 0.4), 'mot_back': (0.5, -0.3)}, FEET),
    'palletiser.urdf': (('--loops', str(ROBOTS / 'palletiser_loops.yaml')),
                        {'joint_2': (-0.5, 0.9), 'joint_3': (0.6, -0.8)},
                        [('tail_a', 'tail_b'), ('level_a', 'level_b'), ('tool_a', 'tool_b')]),
    # The bell's angle is that of a link less that of the thigh, both on one pin of a third link.
    'wheel_leg.urdf': ((), {'hip': (-0.25, 0.3), 'crank_motor': (0.35, -0.35)},
                       [('rod_eye', 'bell_eye'), ('tendon_eye', 'shin_eye')]),
    # A second four-bar on the finger that the first one moves.
    'rack.sdf': ((), {'rack_slide': (-0.02, 0.02), 'tip_motor': (-3.0, 3.0)}, ()),
    # In an MJCF, equalities say what coincides.
    'four_bar.xml': ((), {'motor': (-3.0, 3.0)}, ()),
    'whitworth.xml': ((), {'crank_joint': (-0.9, 0.9)}, ()),
    'gripper.xml': ((), {'right_driver_joint': (0.0, 0.8), 'left_driver_joint': (0.0, 0.8)}, ())}


def check_closed(robot, joints, loops):
    """Check that frames of a robot coincide at joint positions, or what its file says does."""
    if isinstance(robot, MuJoCo):
        robot.place(joints)
        assert robot.open() < 1e-14
        return
    # A joint that closes a loop is in no tree.
    places = robot.places({name: joints[name] for name in joints.keys() & {*robot.joints}},
                          [name for pair in loops for name in pair])
    for first, second in loops:
        assert places[first] == pytest.approx(places[second], abs=2e-15)


@pytest.mark.parametrize('library', LIBRARIES)
@pytest.mark.parametrize('file', FILES)
def test_published_joints_close_the_loops_of_a_file(file, library):
    more, motors, loops = FILES[file]
    mechanisms_, path = imported(file, *more), str(ROBOTS / file)
    read = readers.read(path, *more[1:])
    robot = MuJoCo((ROBOTS / file).read_text()) if file.endswith('.xml') else library(
        readers.description(path, read))
    for part in np.linspace(0.0, 1.0, 15):
        joints, at = {}, {motor: low + part * (high - low)
                          for motor, (low, high) in motors.items()}
        for mechanism in mechanisms_:
            joints.update(published(mechanism, **{
                settings.source: at[settings.source] for settings in mechanism.inputs.values()}))
        check_closed(robot, joints, loops)
    rest, lost = cli.others(read, {mechanism.name: mechanism for mechanism in mechanisms_}, {})
    rest = scene.read({**rest, 'mechanisms': ['others']}).mechanisms if rest else {}
    assert not lost and {*robot.joints} <= joints.keys() | check.published(rest)


LIMIT, MOTOR = 'lower="-1.2" upper="1.2"', '<joint name="motor" axis="0 1 0"/>'
SDF_AXIS = '<axis><xyz>0 1 0</xyz></axis>'
SDF_LIMIT = SDF_AXIS.replace('</axis>', '<limit><lower>-0.4</lower>{}</limit></axis>')
BEYOND = 'its loops do not reach them'
LIMITS = [
    # Both ends are 0 by default in a URDF, and infinite in an SDF.
    ('four_bar.urdf', LIMIT, 'upper="1.2"', (0.0, 1.2), ''),
    ('four_bar.urdf', LIMIT, '', None, 'from 0 to 0: they are no range'),
    ('four_bar.urdf', LIMIT, 'lower="nan" upper="1"', None, 'from nan to 1: they are no range'),
    ('four_bar.urdf', LIMIT, 'lower="-1e7" upper="1"', None, f'from -1e+07 to 1: {BEYOND}'),
    ('four_bar.urdf', 'name="motor" type="revolute"', 'name="motor" type="continuous"', None,
     ''),
    ('boom.urdf', 'lower="-0.3" upper="0.3"', 'lower="-inf" upper="0.2"', (-0.43633, 0.2), ''),
    ('boom.urdf', 'lower="-0.3" upper="0.3"', 'lower="5" upper="9"', None,
     f'from 5 to 9: {BEYOND}'),
    ('four_bar.sdf', SDF_AXIS, SDF_LIMIT.format(''), None, f'from -0.4 to inf: {BEYOND}'),
    ('four_bar.sdf', SDF_AXIS, SDF_LIMIT.format('<upper>1</upper>'), (-0.4, 1.0), ''),
    ('four_bar.xml', MOTOR, MOTOR.replace('/>', ' range="-inf 40" limited="true"/>'), None,
     f'from -inf to 0.6981: {BEYOND}'),
    ('four_bar.xml', MOTOR, MOTOR.replace('/>', ' range="-40 40"/>'),
     (math.radians(-40.0), math.radians(40.0)), '')]


@pytest.mark.parametrize('file, old, new, ends, why', LIMITS, ids=range(len(LIMITS)))
def test_limits_of_a_motor_become_a_sweep_or_a_sentence(tmp_path, file, old, new, ends, why):
    path = of_text(tmp_path / file, (ROBOTS / file).read_text().replace(old, new, 1))
    mechanism, = imported(path)
    settings = mechanism.first
    assert (f' Left out: the limits of {settings.source}, {why}.\n' in said(path)) == bool(why)
    assert sweep(settings) == (ends and pytest.approx(ends, abs=1e-5))


def sweep(settings):
    """Return the ends of a sweep as positions of its source, None without one."""
    offset, ratio = settings.offset, settings.ratio
    return settings.ends and sorted((end - offset) / ratio for end in settings.ends)


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
    ([('servo', '<limit lower="-0.4" upper="9"/>', '')], (-0.4, 2.6)),
    ([('servo', '', '')], (-2.2, 2.6)),
    # The motor is at 0.1 - 0.5 * (1 + 2 * servo).
    ([('middle', '<limit lower="0" upper="2"/>',
       '<mimic joint="servo" multiplier="2" offset="1"/>'),
      ('servo', '<limit lower="-0.3" upper="3"/>', '')], (-0.3, 0.5)),
    ([('middle', '', '<mimic joint="servo" multiplier="2" offset="1"/>', 'fixed'),
      ('servo', '<limit lower="-0.3" upper="3"/>', '')], (-0.3, 0.8)),
    ([('servo', '<limit lower="5" upper="9"/>', '')], None)])
def test_limits_of_a_joint_are_those_of_all_that_it_follows(tmp_path, servos, ends, more):
    file = mimicking(tmp_path, *servos, more=more)
    mechanism, = imported(file)
    settings = mechanism.first
    assert settings.source == 'servo' and sweep(settings) == (ends and pytest.approx(ends))
    assert (f'poses of the robot, servo from {ends[0]:.4g} to {ends[1]:.4g}, ' if ends else
            f'the limits of servo, from 5 to 2.6: {BEYOND}') in said(file)


def test_what_a_fixed_joint_follows_may_be_held(tmp_path):
    file = mimicking(tmp_path, ('middle', '', '<mimic joint="servo"/>', 'fixed'),
                     ('servo', '<limit lower="-1" upper="1"/>', ''))
    assert 'it cannot move, as its joints hold each other' in refused(file, '--hold', 'servo=0.1')


def test_limits_of_all_joints_that_follow_a_motor_bound_it(tmp_path):
    axis = '<axis xyz="0 -1 0"/>'
    file = written(tmp_path, 'five_bar.urdf', (
        axis, f'{axis}<limit lower="-0.1" upper="0.15"/><mimic joint="mot_front" multiplier="0.5"'
        '/>'), ('"mot_back" type="continuous"', '"mot_back" type="revolute"'))
    mechanism, = imported(file, *loops_of(tmp_path, 'name_mot: [mot_front]'))
    assert sweep(mechanism.first) == pytest.approx([-0.2, 0.3])
    # Also those of a passive joint.
    mechanism, = imported(written(tmp_path, 'four_bar.urdf', (
        axis, f'<mimic joint="motor" multiplier="-1"/>{axis}')))
    settings = mechanism.first
    assert (settings.source, settings.ratio) == ('motor', -1.0)
    assert sweep(settings) == pytest.approx([-1.2, 1.2])
    # What is read is not published, too.
    assert published(mechanism, motor=0.4) == pytest.approx({'motor': 0.4, 'elbow': -0.4})
    assert {called.name for called in mechanism.joints.values() if called.published} == {'elbow'}


def test_a_joint_that_follows_a_passive_one_is_no_motor(tmp_path):
    knee = '"front_knee" type="continuous">'
    file = written(tmp_path, 'five_bar.urdf', (knee, f'{knee}<mimic joint="back_knee"/>'))
    assert 'not driven: 1 of mot_back, front_knee, back_knee must be moved' in refused(
        file, *loops_of(tmp_path, 'name_mot: [mot_front]'))


def loops_of(folder, more, pair='front_foot, back_foot', kind='3d'):
    """Return the option of a file of one loop."""
    return '--loops', of_text(
        folder / 'loops.yaml', f'{{closed_loop: [[{pair}]], type: [{kind}], {more}}}')


@pytest.fixture
def four_bar():
    """Return the closed robot of a four-bar, and the parameters of its scene."""
    robot = closing.closed(readers.read(str(ROBOTS / 'four_bar.urdf'))).robot
    return robot, cli.described(robot)[0]


def compared(robot, parameters, *motors):
    """Return the report on mechanisms of a scene that motors drive, or how one differs."""
    mechanisms = scene.read(parameters).mechanisms
    reports, wrong = check.compared(robot, mechanisms, [
        check.Imported(name, {}, [], motors) for name in mechanisms])
    return ' '.join([*reports, *wrong.values()])


def differing(robot, parameters, name, old, new, *motors):
    """Return how a scene differs from its robot if its lines are others; as it is, it does not."""
    assert compared(robot, parameters, *motors).startswith('Checked: ')
    key = f'{name}.joint_names' if '=' in old else f'{name}.joints'
    changed = [line.replace(old, new) for line in parameters[key]]
    assert changed != parameters[key]
    return compared(robot, {**parameters, key: changed}, *motors)


def test_a_source_of_several_mechanisms_is_checked_where_all_of_them_move(four_bar):
    robot, parameters = four_bar
    zero = parameters['motor.crank.offset']
    parameters.update([(key.replace('motor.', 'twin.', 1), parameters[key]) for key in parameters])
    parameters.update({'mechanisms': ['motor', 'twin'], 'twin.joint_names': ['CD=a', 'BD=b'], **{
        f'{name}.crank.sweep': [zero + low, zero + high]
        for name, low, high in (('motor', -1.0, 0.5), ('twin', -0.5, 1.0))}})
    assert 'motor, twin: in 240 poses of the robot, motor from -0.5 to 0.5, ' in compared(
        robot, parameters, 'motor')


def test_a_mechanism_that_cannot_move_is_not_checked(four_bar):
    robot, parameters = four_bar
    zero = parameters['motor.crank.start']
    parameters['motor.crank.sweep'] = [zero, zero + 1e-10]
    assert compared(robot, parameters, 'motor') == 'it could not be checked in more than 0 poses'


def checked(text):
    """Return in how many poses each mechanism was checked, and how far loops are open [m]."""
    return [(int(count), float(worst)) for count, worst in re.findall(
        'Checked: .*: in (.*) poses of the robot, .* loops stand open by (.*) m at most', text)]


def pin_at(place):
    """Return the change that moves the pin of a four-bar's rocker."""
    return ('<link2 link="rocker" xyz="0 0 0.2"/>', f'<link2 link="rocker" xyz="{place}"/>')


@pytest.mark.parametrize('changes, ends, more', [
    *(([pin_at(place)], (-1.2, 1.2), '') for place in (
        '0 0 0.2', '0 0 0.20001', '0 0.01 0.2', '0 0 0.26')),
    # From a pose outside the limits; of a wide range two turns.
    ([(LIMIT, 'lower="0.2" upper="1.2"')], (0.0, 1.2), ''),
    ([(LIMIT, 'lower="-40" upper="40"')], (-math.tau, math.tau), ''),
    # The crank reaches from 35.6 to 112.8 degrees, by the cosine rule, and stands at 90.
    ([(LIMIT, ''), pin_at('0 0 0.12')], (-0.4, 0.93), '; not beyond where its loops end')],
    ids=range(7))
def test_a_scene_is_held_against_its_robot_over_the_range_of_its_motor(
        tmp_path, changes, ends, more):
    text = said(written(tmp_path, 'four_bar.urdf', *changes))
    (count, worst), = checked(text)
    seen = map(float, re.search('motor from (.*) to (.*), its', text).groups())
    assert count >= 200 and worst < 1e-12 and f'm at most{more}.' in text
    assert [*seen] == pytest.approx(ends, abs=0.04 if more else 1e-3)


@pytest.mark.parametrize('old, new, why', [
    (' parallelogram', ' antiparallelogram', 'elbow is off by 1'),
    ('ground 0.3 0', 'ground 0.3 1e-8', 'its loops stand open by 1e-08 m'),
    ('=-shoulder', '=shoulder', 'shoulder is off by 3.1'),
    ('=elbow-1.570', '=elbow-1.572', 'elbow is off by 0.002$'),
    ('=elbow-1.57079632', '=elbow-1.57079633', 'its loops stand open by 3e-09 m$')])
def test_a_mechanism_that_differs_from_its_robot_is_refused(four_bar, old, new, why):
    assert re.match(f'with motor at .* {why}', differing(*four_bar, 'motor', old, new, 'motor'))


def test_hinges_that_cross_at_the_end_of_a_rod_are_a_ball(tmp_path):
    _, out, err = printed('rod.urdf')
    assert "hold:='elbow_x=0 elbow=0'" in out and 'Not published' not in err
    mechanism, = imported('rod.urdf')
    # About the normal of the plane first, so that the rod's other hinges stay.
    for angle in (-1.1, 0.4, 1.2):
        assert published(mechanism, motor=angle) == pytest.approx(
            {'motor': angle, 'shoulder': -angle, 'elbow_y': -angle}, abs=1e-14)
    loose = written(tmp_path, 'rod.urdf', (
        'name="shoulder" type="continuous"', 'name="shoulder" type="spherical"'))
    assert re.search('not planar: (coupler|rocker) hangs on balls alone, and is no rod',
                     refused(loose))


@pytest.mark.parametrize('seed', range(6))
def test_hinges_of_a_ball_lead_from_its_first_body_to_its_second(seed):
    robot, rng = readers.read(str(ROBOTS / 'rod.urdf')), np.random.default_rng(seed)
    rng.shuffle(robot.joints)
    for joint in robot.joints:
        joint.bodies = joint.bodies[::rng.choice([1, -1])]
    group, = planar.groups(robot)
    ball, = (joint for joint in group.joints if joint.parts)
    body = ball.bodies[0]
    for hinge, sign in ball.parts:
        assert hinge.bodies[sign < 0.0] == body
        body = hinge.bodies[sign > 0.0]
    assert len(ball.parts) == 3 and body == ball.bodies[1]


def test_hinges_of_a_rod_that_its_other_end_needs_do_not_stay(tmp_path):
    # A universal joint does not let the rod turn in the plane alone: it spins, too.
    file = written(tmp_path, 'rod.urdf', (
        '</robot>', '<link name="cross"/><joint name="wrist_1" type="continuous">'
        '<parent link="rocker"/><child link="cross"/><origin xyz="0 0 0.2"/><axis xyz="0 1 1"/>'
        '</joint></robot>'), (
        '"wrist" type="spherical"', '"wrist" type="revolute"'), (
        '<link2 link="rocker" xyz="0 0 0.2"/>', '<link2 link="cross" xyz="0 0 0"/>'), (
        '<axis xyz="0 1 0"/>\n  </loop_joint>', '<axis xyz="0 1 -1"/>\n  </loop_joint>'))
    mechanism, = imported(file)
    assert published(mechanism, motor=0.4) == pytest.approx({'motor': 0.4, 'shoulder': -0.4})
    assert 'Not published: elbow_y, elbow_x, elbow, wrist_1: passive joints' in said(file)


# A motor at the knee; a motor that follows the other; a knee that stays, as on a four-bar.
FIVE_BARS = [
    ('name_mot: [mot_front, front_knee]', '', lambda angle: {
        'mot_front': 0.2, 'front_knee': angle}),
    ('name_mot: [mot_front]', '<mimic joint="mot_front" multiplier="0.5"/>', lambda angle: {
        'mot_front': angle, 'mot_back': 0.5 * angle}),
    ('joint_name: [front_knee], joint_type: [FIXED], name_mot: [mot_front]', '', lambda angle: {
        'mot_front': 0.3 * angle, 'front_knee': 0.0})]


@pytest.mark.parametrize('more, mimic, motors', FIVE_BARS, ids=range(3))
def test_a_five_bar_is_closed_by_what_moves_it(tmp_path, more, mimic, motors):
    axis, loops = '<axis xyz="0 -1 0"/>', loops_of(tmp_path, more)
    file = written(tmp_path, 'five_bar.urdf', (axis, axis + mimic))
    mechanism, = imported(file, *loops)
    # Inputs that follow one motor are geared to each other, so that their reach is known.
    assert sorted(settings.source for settings in mechanism.inputs.values()) == sorted(
        re.search(r'name_mot: \[(.*)\]', more)[1].split(', '))
    robot = Pinocchio((ROBOTS / 'five_bar.urdf').read_text())
    for angle in np.linspace(-0.3, 0.3, 7):
        check_closed(robot, published(mechanism, **motors(angle)), FEET)
    rest, lost = cli.others(readers.read(str(file), str(loops[1])), {'m': mechanism}, {})
    assert not lost and [value for key, value in rest.items() if key.endswith('.source')] == [
        'front_knee'] * ('FIXED' in more) + ['mot_front'] * bool(mimic)


def test_a_ring_that_spins_on_a_pin_is_no_dead_point(tmp_path):
    # Its halves are welded: where they are apart, that holds them in more ways.
    loops = loops_of(tmp_path, 'name_mot: [mot_front, mot_back]', 'ring_a, ring_b', '6d')
    file = written(tmp_path, 'five_bar.urdf', ('</robot>', ''.join(
        f'<link name="{ring}"/><joint name="{ring}_pin" type="continuous"><parent link="{foot}"/>'
        f'<child link="{ring}"/><axis xyz="0 1 0"/></joint>'
        for ring, foot in (('ring_a', 'front_foot'), ('ring_b', 'back_foot'))) + '</robot>'))
    mechanism, = imported(file, *loops)
    assert 'Left out: ring_a: not driven: 1 of ring_a_pin, ring_b_pin must be moved or held: ' \
        in said(file, *loops)
    assert 'Not published: ring_a_pin, ring_b_pin: ' in said(file, *loops)
    assert 'Left out' not in said(file, *loops, '--hold', 'ring_a_pin=0')
    check_closed(Pinocchio((ROBOTS / 'five_bar.urdf').read_text()),
                 published(mechanism, mot_front=0.3, mot_back=0.1), FEET)


def test_pins_that_are_apart_by_rounding_are_one(tmp_path):
    mechanism, = imported(written(tmp_path, 'wheel_leg.urdf', (
        '<child link="bell"/><axis', '<child link="bell"/><origin xyz="1e-13 0 0"/><axis')))
    assert mechanism.linkage.points == imported('wheel_leg.urdf')[0].linkage.points


@pytest.mark.parametrize('sign', [1, -1])
def test_a_jaw_slides_as_its_crank_and_rod_say(tmp_path, sign):
    # Seen from either end of its slide.
    ends = '<parent>{}</parent><child>{}</child>'
    mechanism, = imported(written(tmp_path, 'slider_crank.sdf', (
        ends.format('palm', 'finger'), ends.format(*['palm', 'finger'][::sign]))))
    rod = abs(complex(0.0548, 0.013) - cmath.rect(0.0175, 0.4))
    for angle in np.linspace(-2.0, 2.0, 25):
        pin = cmath.rect(0.0175, 0.4 + angle)
        slide = pin.real + math.sqrt(rod ** 2 - (0.013 - pin.imag) ** 2) - 0.0548
        assert sign * published(mechanism, servo=angle)['finger_slide'] == pytest.approx(
            slide, abs=1e-16)


def changed(text, rng):
    """Return a file with a byte, a number, a text or an element changed."""
    def spans(pattern):
        return [match.span() for match in re.finditer(pattern, text, re.DOTALL)]

    low, high = rng.choice(spans(rng.choice((
        '.', r'[-+]?\d+\.?\d*', r'(?<=")[^"]*(?=")', r' \w+="[^"]*"', r'<(\w+)[^<>]*/>',
        '<joint.*?</joint>', '<link.*?</link>'))) or [(0, 1)])
    start, end = rng.choice(spans(r'(?<=")[^"]*(?=")'))
    return text[:low] + rng.choice((
        '', 2 * text[low:high], text[start:end], 'nan', '-inf', '1e308', '1e-320', '0', 'é', '<')
    ) + text[high:]


@pytest.mark.parametrize('count', [4, pytest.param(60, marks=pytest.mark.nightly)])
@pytest.mark.parametrize('ending', ['sdf', 'urdf', 'xml'])
def test_whatever_is_in_a_file_it_is_read_or_refused_in_one_sentence(tmp_path, ending, count):
    rng, texts = random.Random(ending), [
        path.read_text() for path in sorted(ROBOTS.glob(f'*.{ending}'))]
    for _ in range(count):
        file = of_text(tmp_path / f'robot.{ending}', changed(rng.choice(texts), rng))
        code, out, err = printed(file)
        assert code == 0 or not out and err.count('\n') == err.count('from_robot: ') > 0, (
            file.read_text())


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


@pytest.mark.parametrize('code, more', [
    (0, ['\x9b2J'] * 4), (1, ['\x1b]0;title\x07'] * 4),
    (1, [1500 * each for each in ('x', '', 'x y ', 'x')]),
    (0, ['\n/crank_driver: {ros__parameters: {rate: 1.0}}\n#', '\u2028evil: 1\x85', '-1', '"\\'])],
    ids=range(4))
def test_a_name_of_a_file_is_only_a_name_in_a_scene_and_in_a_terminal(tmp_path, code, more):
    yaml = pytest.importorskip('yaml')
    names = ('coupler', 'rocker', 'elbow', 'motor')
    called = {name: name + each for name, each in zip(names, more)}
    root = ElementTree.fromstring((ROBOTS / 'four_bar.urdf').read_text())
    for part in root.iter():
        for key in ('name', 'link', 'joint'):
            if part.get(key) in called:
                part.set(key, called[part.get(key)])
    file = of_text(tmp_path / 'robot\nevil: 2\n#.urdf', ElementTree.tostring(root, 'unicode'))
    for args in ['--driven', 'nobody'], []:
        status, out, err = printed(file, *args)
        for line in err.splitlines():
            assert line.isprintable() and len(line) < 5000
            assert max(map(len, line.split()), default=0) <= 300
        assert all(line.isprintable() for line in out.splitlines())
    assert status == code
    if not code:
        mechanism, = imported(file)
        assert yaml.safe_load(out).keys() == {'/**'}
        assert published(mechanism, **{called['motor']: 0.4}).keys() == {
            called['elbow'], called['motor'], 'shoulder'}


def test_a_passive_joint_of_a_loop_is_no_input(tmp_path):
    # A spring in a finger, beside the motor's loop, leaves a second one undetermined.
    body = '<body name="right_coupler" pos="0 0.0315 -0.0041">'
    spring = written(tmp_path, 'gripper.xml', (body, f'{body}<joint name="spring" axis="1 0 0"/>'))
    mechanisms = {one.name: one for one in imported(spring)}
    robot, line = readers.read(str(spring)), said(spring)
    rest, lost = cli.others(robot, mechanisms, {})
    loop = {'spring', 'right_spring_link_joint', 'right_follower_joint'}
    assert lost[0] in line and not loop & {*map(str, rest.values())}
    assert {*lost[0].split(': ')[1].split(', ')} == loop
    assert re.search('Left out: .*right_coupler, right_spring_link, right_follower: not driven: '
                     '1 of right_spring_link_joint, .* must be moved or held: add --driven', line)
    rest, lost = cli.others(robot, mechanisms, {'spring': 0.0})
    assert 'spring,' not in lost[0] and 'spring' in {*map(str, rest.values())}


FLAT = [f'{name}={value!r}' for name, value in (
    ('motor', 0.5 * math.pi), ('elbow', -0.5 * math.pi), ('shoulder', -0.5 * math.pi))]


@pytest.mark.parametrize('side', [0, 1])
def test_bars_in_line_move_on_as_they_are_told(tmp_path, side):
    file = written(tmp_path, 'four_bar.urdf', (LIMIT, 'lower="-3" upper="3"'))
    motor, joint, *ends = re.search(
        r'bars lie in line where the file has them, and it moves on with (.*) (.*)=(.*) as '
        r'with \2=(.*): add --pose', refused(file, '--driven', 'motor', '--pose', *FLAT)).groups()
    mechanism, = imported(file, '--driven', 'motor', '--pose', *FLAT, motor,
                          f'{joint}={ends[side]}')
    robot, elbows = Pinocchio(file.read_text()), set()
    for angle in np.linspace(0.3, 1.2, 10):
        joints = published(mechanism, motor=angle)
        check_closed(robot, joints, [('wrist_a', 'wrist_b')])
        elbows.add(abs(math.remainder(joints['elbow'] + angle, math.tau)) < 1e-12)
    # One of both ends is a parallelogram's, whose coupler does not turn.
    start = float(motor.partition('=')[2])
    is_parallel = {'elbow': -start, 'shoulder': -start}[joint] == pytest.approx(
        float(ends[side]), abs=0.02)
    assert elbows == {is_parallel}


def test_both_ways_out_of_a_fold_are_seen_if_one_is_reached_from_both_sides(tmp_path):
    crossed = scene.read({'mechanisms': ['m'], 'm.type': 'custom', 'm.joints': [
        'O ground 0 0', 'Q ground 0.1 0', 'A crank O 0.25', 'B antiparallelogram O A Q']})
    robot = bodies.robot(crossed.mechanisms.values(), 'world', density=1.0)
    line = refused(of_text(tmp_path / 'robot.xml', mjcf.write(robot)))
    assert 'it moves on with m_crank=0.1 m_AB=-0.1 as with m_AB=0.23247: add' in line


def test_a_pose_at_the_end_of_its_loops_is_left_on_the_other_side(tmp_path):
    # Coupler and rocker lie in line where the crank is up, and do not reach as far elsewhere.
    file = written(tmp_path, 'four_bar.urdf', (
        '<limit lower="-1.2" upper="1.2"', '<limit lower="-2" upper="-1"'), (
        'xyz="0 0 0.2"/><axis', f'xyz="0 0 0.2" rpy="0 {math.atan2(2.0, 3.0)!r} 0"/><axis'), (
        'xyz="0.3 0 0"/><axis', f'xyz="0.3 0 0" rpy="0 {-math.atan2(3.0, 2.0)!r} 0"/><axis'), (
        'link="coupler" xyz="0.3 0 0"', f'link="coupler" xyz="{13 ** 0.5 / 10 - 0.2!r} 0 0"'))
    line = refused(file, '--driven', 'motor')
    assert 'bars lie in line where the file has them, and it moves on with motor=0.1 ' in line
    # What is printed leads on: the loops do not let the motor inside its limits.
    for more in re.findall('--pose (.*?) (?:or (?=--)|to the command)', line):
        assert f'motor, from -2 to -1: {BEYOND}' in said(
            file, '--driven', 'motor', '--pose', *more.split())


def test_world_of_drake_is_no_second_root(tmp_path):
    base, world = '<link name="base_link"/>', '<link name="world"/>'
    file = written(tmp_path, 'four_bar.urdf', (base, world + base))
    scenes = [printed(each)[1].partition('/**:')[2] for each in ('four_bar.urdf', file)]
    assert scenes[0] == scenes[1] and 'motor.frame_id: base_link' in scenes[0]


BALLS = '{pin_loops: [], ball_loops: [{parent: coupler, child: rocker, parent_xyz: [0.3, 0, 0], ' \
    'child_xyz: [0, 0, 0.2]}], ball_upgrades: [elbow], actuated_joints: [motor]}'
PAIRS = '{closed_loop: [[wrist_a, wrist_b]], type: [3d], name_mot: [motor], ' \
    'joint_name: [elbow], joint_type: [%s]}'
CUT = re.compile('<loop_joint.*</loop_joint>', re.DOTALL)


@pytest.mark.parametrize('text', [BALLS, PAIRS % 'SPHERICAL', PAIRS % 'UJOINT_YX'])
def test_joints_of_the_tree_are_what_a_file_of_loops_makes_them(tmp_path, text):
    # A transmission is of the open tree, in which a ball is fixed.
    file = written(tmp_path, 'four_bar.urdf', ('elbow" type="continuous"', 'elbow" type="fixed"'))
    of_text(file, CUT.sub('<transmission name="t"><joint name="shoulder"/></transmission>',
                          file.read_text()))
    loops = of_text(tmp_path / 'loops.yaml', text)
    mechanism, = imported(file, '--loops', loops)
    for angle in (-1.1, 0.0, 0.7):
        assert published(mechanism, motor=angle) == pytest.approx(
            {'motor': angle, 'shoulder': -angle}, abs=1e-14)
    of_text(loops, text.replace('elbow', 'elbwo'))
    assert "names 'elbwo', which is not there" in refused(file, '--loops', loops)


def test_urdf_plus_names_the_joints_that_are_not_driven(tmp_path):
    free = [(f'<joint name="{name}"', f'<joint independent="false" name="{name}"')
            for name in ('motor', 'elbow')]
    assert readers.read(str(written(tmp_path, 'four_bar.urdf', *free))).driven == ['shoulder']
    motor = '</robot>', '<transmission name="t"><joint name="motor"/></transmission></robot>'
    assert readers.read(str(written(tmp_path, 'four_bar.urdf', *free, motor))).driven == ['motor']


@pytest.mark.parametrize('joints, pose', [
    ('', ''), ('D', ''), ('BCD', ''), ('', 'D=-0.5'), ('', 'A=0.4 B=-0.4 D=0.4')])
def test_a_parallelogram_stays_one_on_universal_joints_and_in_any_pose(tmp_path, joints, pose):
    text = (ROBOTS / 'four_bar.sdf').read_text()
    for name in joints:
        text, count = re.subn(
            rf'(name="joint_{name}" type=")revolute(.*?)</axis>',
            r'\1universal\2</axis><axis2><xyz>1 0 0</xyz></axis2>', text, flags=re.DOTALL)
        assert count == 1
    mechanism, = imported(of_text(tmp_path / 'four_bar.sdf', text), *(
        ['--pose', *(f'joint_{each}' for each in pose.split())] * bool(pose)))
    for angle in (-2.0, 0.4, 3.0):
        # Positions count from the file's zero, also that of the joint which closes the loop.
        angles = published(mechanism, joint_A=angle)
        assert angles.keys() == {f'joint_{name}' for name in 'ABCD'}
        for name, value in {'joint_B': -angle, 'joint_C': angle, 'joint_D': angle}.items():
            assert math.remainder(angles[name] - value, math.tau) == pytest.approx(0.0, abs=1e-14)


# Of a hinge in the tree, and of one that closes a loop.
@pytest.mark.parametrize('file, axis, start', [
    ('four_bar.xml', 'axis="0 -1 0"', '-0.870796'),
    ('four_bar.urdf', 'axis xyz="0 1 0"/>\n  </loop_joint>', '-1.570796')])
@pytest.mark.parametrize('lean, why', [
    (9e-4, 'from_robot: Warning: the file is not exact: axes lean by 0.0009 rad, and loops stay'),
    (5e-6, 'from_robot: Warning: the file is not exact: axes lean by 5e-06 rad, and loops stay'),
    (0.0, ''), (2e-3, 'are 0.115 degrees from it, more than 0.057; ')])
def test_a_misfit_is_printed_and_imported_if_it_is_small(tmp_path, lean, why, file, axis, start):
    code, out, err = printed(written(tmp_path, file, (axis, axis.replace('"0 ', f'"{lean} '))))
    assert code == (lean > 1e-3) and why in err and bool(why) == ('rad, and' in err or code > 0)
    # Where the file has it, by as much as the axis leans.
    assert code or f'motor.crank.start: {start}' in out
    assert all(worst <= max(2.0 * lean, 1e-15) for _, worst in checked(err))


def test_a_gap_along_axes_that_lean_moves_nothing(tmp_path):
    assert 'Checked: motor: in 240 poses' in said(written(
        tmp_path, 'four_bar.urdf', pin_at('0 0.01 0.26'), ('0 -1 0', '1e-5 -1 0')))


def test_of_loops_in_space_the_planar_part_is_imported_alone(tmp_path):
    # Its crank also moves a flap about another axis, by a rod on balls.
    mechanism, = imported(file := written(tmp_path, 'four_bar.urdf', ('0 -1 0', '1e-5 -1 0'), (
        '</robot>', """<link name="rod"/><link name="flap"/>
          <joint name="hinge" type="continuous"><parent link="base_link"/><child link="flap"/>
            <origin xyz="0 0.2 0"/><axis xyz="1 0 0"/></joint>
          <joint name="ball" type="spherical"><parent link="crank"/><child link="rod"/>
            <origin xyz="0 0 0.2"/></joint>
          <loop_joint name="eye" type="spherical"><link1 link="rod" xyz="0 0.2 0"/>
            <link2 link="flap" xyz="0 0 0.2"/></loop_joint></robot>""")))
    assert re.search('Left out: .*: not planar: the axes of motor and hinge are 90 degrees from '
                     'it.*axes lean by 1e-05 rad, .*Not published: hinge: ', said(file), re.DOTALL)
    assert published(mechanism, motor=0.4) == pytest.approx(
        {'motor': 0.4, 'elbow': -0.4, 'shoulder': -0.4})


@pytest.mark.parametrize('low', [-0.5, 0.2])
def test_a_motor_between_two_moving_links_drives_in_the_frame_of_one(tmp_path, low):
    # As in a parallelogram: the elbow turns back as far as the shoulder turns.
    file = written(tmp_path, 'four_bar.urdf', (
        '"elbow" type="continuous">', f'"elbow" type="revolute"><limit lower="{low}" upper="0.8"/>'
    ))
    mechanism, = imported(file, '--driven', 'elbow')
    settings = mechanism.first
    assert (settings.source, mechanism.frame_id, settings.start) == ('elbow', 'crank', 0.0)
    assert settings.ends == pytest.approx((low, 0.8))
    for angle in (-0.8, 0.3, 1.1):
        assert published(mechanism, elbow=angle) == pytest.approx(
            {'elbow': angle, 'motor': -angle, 'shoulder': angle}, abs=1e-9)


def test_a_joint_of_the_whole_robot_that_opens_a_loop_is_named(monkeypatch):
    # As if a passive joint were an input.
    robot = closing.closed(readers.read(str(ROBOTS / 'wheel_leg.urdf'))).robot
    parameters, _, _ = cli.described(robot)
    names = [line for line in parameters['hip.joint_names'] if 'bell' not in line]
    mechanisms = scene.read({**parameters, 'hip.joint_names': names}).mechanisms
    rest, lost = cli.others(robot, mechanisms, {})
    assert 'Not published: bell_joint: passive joints of loops' in lost[0] and not rest
    still, _ = cli.others(robot, mechanisms, {'bell_joint': 0.0})
    wrong = scene.read({**parameters, **still, 'hip.joint_names': names,
                        'mechanisms': ['hip', 'others']}).mechanisms
    made = [check.Imported('hip', {}, [], ['hip', 'crank_motor'])]
    assert not check.compared(robot, mechanisms, made)[1]
    report = check.compared(robot, wrong, made)
    assert not report[0] and re.match('with hip at .*, crank_motor at .* its loops stand open by ',
                                      report[1]['hip'])
    monkeypatch.setattr(check, 'compared', lambda *_: report)
    assert f'Left out: hip: compared with the robot: {report[1]["hip"]}.' in refused(
        'wheel_leg.urdf', '--pose', 'hip=0')


@pytest.mark.nightly
@pytest.mark.parametrize('order', [1, -1])
def test_a_loop_of_too_many_links_is_refused_at_once(tmp_path, order):
    # With the leaf first, trees that grow by what they are joined to would take a minute.
    count = 20_000
    links = ''.join(f'<link name="l{i}"/>' for i in range(count + 1))
    joints = ''.join(f'<joint name="j{i}" type="continuous"><parent link="l{i}"/>'
                     f'<child link="l{i + 1}"/><origin xyz="0.1 0 0"/></joint>'
                     for i in range(count)[::order])
    assert f'{count} bodies are in loops that share joints: no more than 150' in refused(of_text(
        tmp_path / 'chain.urdf', f'<robot name="r">{links}{joints}<loop_joint name="w" '
        f'type="revolute"><link1 link="l0"/><link2 link="l{count}"/></loop_joint></robot>'))


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
                robot.join(f'cut_{link.name}', 'revolute', (home[name], link.name), frame(name),
                           position=0.0)
            if slides or name != link.joint:
                home.setdefault(name, link.name)
    robot.driven = [each.name for each in linkage.inputs]
    return robot.cut_loops()


def random_linkage(seed, without=()):
    """Return a random design, its linkage, inputs and a generator; None where it has no pose."""
    rng = np.random.default_rng(seed)
    design = random_linkages.design(rng, without=without)
    try:
        linkage = design.linkage()
    except ValueError:
        return None
    for _ in range(30 if 1e-3 < linkage.longest < 1e3 else 0):
        values = [rng.uniform(max(each.low, -12.0), min(each.high, 12.0))
                  for each in linkage.inputs]
        if not any(np.isnan(place).any() for place in linkage.solve(theta_of(values)).values()):
            return design, linkage, values, rng
    return None


def random_robot(seed):
    """Return a random linkage, inputs, its robot and steps; None where it has no pose."""
    if not (made := random_linkage(seed, without=('yoke', 'image'))):
        return None
    design, linkage, values, rng = made
    robot, count = robot_of(linkage, theta_of(values)), Counter()
    for line in design.joints:
        _, word, *more = line.split()
        called = more[-1] if 'called' in more else ''
        count[word] += not called
        if 'geared' in more:
            other, ratio = more[more.index('geared') + 1:][:2]
            called = called or (f'{word}{count[word]}' if count[word] > 1 else word)
            robot.follows[called] = other, float(ratio), 0.0
    return linkage, theta_of(values), robot, 0.03 * rng.normal(size=(8, len(linkage.inputs)))


def moves(linkage, values, robot, steps, lean=0.0, before_names=''):
    """
    Return whether the scene of a robot moves as its linkage does, by steps of the inputs.

    It does not move if the linkage has no such scene. The robot's names are those of the linkage
    with something before them.
    """
    try:
        parameters, reports, _ = cli.described(robot)
    except RequestError as error:
        assert re.search('closes a loop|not of dyads|it cannot move|lie in line|loops end',
                         str(error))
        assert cli.WRONG not in str(error)
        return False
    assert all(count >= 200 and worst < 1e-6 + 100.0 * lean
               for count, worst in checked('\n'.join(reports)))
    mechanisms = scene.read(parameters).mechanisms.values()
    before, starts, moved = linkage.joint_angles(values), robot.positions, False
    for step in steps:
        after = linkage.joint_angles(theta_of(np.ravel(values) + step))
        named = zip([before_names + each.name for each in linkage.inputs], step)
        motors, positions = {name: starts[name] + by for name, by in named}, {}
        for mechanism in mechanisms:
            positions.update(published(mechanism, **{settings.source: motors[settings.source]
                                                     for settings in mechanism.inputs.values()}))
        for link in linkage.links:
            name = before_names + link.name
            if name in positions and name not in motors:
                off = positions[name] - starts[name] - (after[link.name] - before[link.name])
                slides, moved = link.kind == 'prismatic', True
                off = off / linkage.longest if slides else math.remainder(off, math.tau)
                assert not abs(off) > 1e-9 + 100.0 * lean, (link.name, step)
    return moved


def leaning(robot, lean, seed):
    """Return a robot whose axes lean at random by so much [rad], as those of rounded files."""
    rng = np.random.default_rng(seed)
    for joint in robot.joints:
        way = lean * rng.uniform(-1.0, 1.0, 3)
        if joint.kind == 'hinge':
            axis = joint.axes[0] + way
            joint.axes = (axis / np.linalg.norm(axis),) * 2
    return robot


@pytest.mark.parametrize('seeds, lean', [
    ([36, 419], 0.0), ([17], 1e-5),
    pytest.param(range(120), 0.0, marks=pytest.mark.nightly),
    pytest.param(range(35, 74), 1e-5, marks=pytest.mark.nightly)])
def test_random_linkages_come_back_from_robots(seeds, lean):
    moved = 0
    for seed in seeds:
        if not (made := random_robot(seed)):
            continue
        linkage, values, robot, steps = made
        moved += moves(linkage, values, leaning(robot, lean, seed), steps, lean)
    assert moved > len(seeds) // 2
