# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Everything that a URDF, an SDF and an MJCF of a scene say, against the scene. No ROS."""

import copy
import math
from unittest.mock import ANY
from xml.etree import ElementTree

from hypothesis import given, settings, strategies as st
from linkage_ros import scene
from linkage_ros.robot_model import bodies, mjcf, robot, rviz, sdf, urdf
from linkage_ros.robot_model.cli import main
from linkage_ros.robot_model.shapes import BARREL, BLOCK, GUIDE, ROD, shapes
import numpy as np
import pytest
from robots import turned
from scenes import alone, scene_file
from test_simulators import model, simulated, some_quick
from test_urdf import ARM, FROM_CASES, in_space, joints_and_places, MECHANISMS

QUICK = ('jansen', 'slotted_lever', 'engine with zeros elsewhere', 'five_bar',
         'boom and arm', 'Scotch yoke', 'Cardan gears', 'scissor lift', 'five-bar with a gear')
GREY, BLUE, ORANGE = ([round(part / 255, 3) for part in colour] + [1.0] for colour in (
    (0x8a, 0x8a, 0x8a), (0x00, 0x81, 0xc9), (0xc8, 0x78, 0x00)))
DENSITY, WIDTHS = 1234.5, {'boom and arm': 0.06, 'slotted_lever': 0.01}


def numbers(text):
    return [float(word) for word in (text or '').split()]


def row(shape, colour, thickness, start, end):
    """Return what is seen as numbers, whichever of its ends is first."""
    ends = sorted([[round(value, 7) + 0.0 for value in end] for end in (start, end)])
    return [('sphere', 'cylinder', 'box').index(shape), *colour, thickness, *ends[0], *ends[1]]


def seen(shape, colour, sizes, pose):
    """Return a visual in a file as numbers; a cylinder is along z, a box along x."""
    assert shape != 'box' or sizes[1] == sizes[2]
    thickness, length = {'sphere': lambda r: (r, 0.0), 'cylinder': lambda r, long: (r, long),
                         'box': lambda long, wide, _: (wide, long)}[shape](*sizes)
    along = pose[:3, 2 if shape == 'cylinder' else 0] * 0.5 * length
    return row(shape, colour, thickness, pose[:3, 3] - along, pose[:3, 3] + along)


def visual(part, colours):
    """Return shape, colour, sizes and pose of what is seen in a URDF, an SDF or an MJCF."""
    if part.tag == 'geom':
        kind = part.get('type')
        sizes = np.multiply(numbers(part.get('size')), {
            'box': 2.0, 'sphere': 1.0, 'cylinder': [1.0, 2.0]}[kind])
        return kind, numbers(part.get('rgba')), sizes, turned(
            *numbers(part.get('pos')), *numbers(part.get('euler')))
    (shape,), material, place = part.find('geometry'), part.find('material'), part.find('origin')
    if name := material.get('name'):
        sizes = numbers(' '.join(filter(None, map(shape.get, ('size', 'radius', 'length')))))
        return shape.tag, colours[name], sizes, np.eye(4) if place is None else turned(
            *numbers(place.get('xyz')), *numbers(place.get('rpy')))
    ambient, diffuse = (numbers(material.findtext(way)) for way in ('ambient', 'diffuse'))
    assert ambient == diffuse
    return shape.tag, ambient, [value for size in shape for value in numbers(size.text)], turned(
        *numbers(part.findtext('pose')))


def visuals(text, frames):
    """Return what a file shows of each link, in space, where the links have these poses."""
    root = ElementTree.fromstring(text)
    colours = {each.get('name'): numbers(each.find('color').get('rgba'))
               for each in root.findall('material')}
    return {link.get('name'): [
        seen(*looks, frames[link.get('name')] @ pose)
        for part in (*link.findall('visual'), *link.findall('geom'))
        for *looks, pose in [visual(part, colours)]]
        for link in (*root.iter('link'), *root.iter('body')) if link.get('name') in frames}


def scene_seen(mechanism, thetas, width):
    """Return what is seen of the links of a scene but balls."""
    _, places = joints_and_places(mechanism, thetas)
    visuals_, shown = {}, shapes(mechanism)
    ends = mechanism.assembly().solution([
        end for shape in shown for end in (shape.start, shape.end)])
    ends.solve(thetas.tolist())

    def add(link, *visual):
        visuals_.setdefault(f'm_{link}_link', []).append(row(*visual))

    def colour(link):
        return ORANGE if link in mechanism.inputs else BLUE

    for prefix, leg_ends in zip(mechanism.assembly().legs, ends.rows):
        spots = {name[len(f'm_{prefix}'):]: in_space(mechanism.pose, place)
                 for name, place in places.items() if name.startswith(f'm_{prefix}')}
        for link, frame in mechanism.linkage.frames.items():
            for start, end in mechanism.linkage.bars:
                if {start, end} <= set(frame):
                    add(prefix + link, 'cylinder', colour(link), width / 2, spots[start],
                        spots[end])
        for shape, (start, end) in zip(shown, leg_ends.reshape(-1, 2, 2)):
            link, slide = shape.start.link, shape.slide.name
            look = {GUIDE: ('box', GREY, width / 2), BLOCK: ('box', colour(slide), 2.0 * width),
                    BARREL: ('cylinder', colour(slide), 1.25 * width),
                    ROD: ('cylinder', BLUE, width / 2)}[shape.kind]
            drawn = (*look, in_space(mechanism.pose, start), in_space(mechanism.pose, end))
            if link != 'ground' or row(*drawn) not in visuals_.get('m_ground_link', []):
                add(link if link == 'ground' else prefix + link, *drawn)
    return visuals_


@pytest.mark.parametrize('name', some_quick([*MECHANISMS, *FROM_CASES], QUICK))
def test_three_formats_show_what_the_scene_has(name):
    # That their links and joints are those of the model is held where they are read again.
    mechanism = simulated(name)
    width = WIDTHS.get(name)
    robot = bodies.robot([mechanism], 'world', width)
    built = bodies.robot([mechanism], 'world', width, DENSITY)
    width = width or bodies.size(mechanism) / 40
    starts = np.array([np.clip(settings.start, *settings.sweep or (-math.inf, math.inf))
                       for settings in mechanism.inputs.values()])
    places = joints_and_places(mechanism, starts)[1]
    frames = {body: turned(*mechanism.pose) @ frame for body, frame in built.frames.items()
              if body != 'world'}
    texts = urdf.write(robot), mjcf.write(built), sdf.write(built)
    # People read it: a line for each element.
    assert all(text.count('\n') >= text.count('/>') + text.count('</') - 1 for text in texts)
    tree, loops, gazebo = (visuals(text, frames) for text in texts)
    # A body of which nothing else is seen, such as a point, is a ball.
    balls = {name: [row('sphere', GREY, width, frame[:3, 3], frame[:3, 3])]
             for name, frame in frames.items() if name != 'm_ground_link'}
    expected = {**balls, **scene_seen(mechanism, starts, width)}
    for shown in tree, loops, gazebo:
        there = {name: rows for name, rows in expected.items() if rows and name in shown}
        assert {name for name, rows in shown.items() if rows} == there.keys()
        for name, rows in there.items():
            assert np.array(sorted(shown[name])) == pytest.approx(np.array(sorted(rows)), abs=1e-6)
    # Bodies in the slots of yokes are of simulators alone.
    assert tree.keys() == robot.frames.keys() - {'world'} and frames.keys() == loops.keys()
    assert frames.keys() == gazebo.keys()
    limits = ElementTree.fromstring(texts[0]).iter('limit')
    assert {(each.get('effort'), each.get('velocity')) for each in limits} <= {('0', '0')}
    simulator, (root,) = map(ElementTree.fromstring, texts[1:])
    masses = {link.get('name'): float(link.findtext('inertial/mass'))
              for link in root.iter('link') if link.find('inertial') is not None}
    assert masses.keys() == {name for name in gazebo if gazebo[name]}
    check_mjcf(mechanism, simulator, starts, places, 9.81 * sum(masses.values()))


def check_mjcf(mechanism, root, starts, places, weight):
    """Check an MJCF's servos and their keyframe."""
    size, links = bodies.size(mechanism), {link.name: link for link in mechanism.linkage.links}
    leg = f'm_{next(iter(mechanism.assembly().legs))}'
    published = [mechanism.joints[name] for name in mechanism.inputs]
    assert numbers(root.find('keyframe')[0].get('ctrl')) == pytest.approx(
        [joint.of(start) for joint, start in zip(published, starts)])
    # A servo gives way by a thousandth [rad, or of the longest bar], and pulls ten times as much.
    for servo, joint, (name, driven) in zip(
            root.find('actuator'), published, mechanism.inputs.items(), strict=True):
        arm = math.dist(*(places[leg + point] for point in (links[name].joint, links[name].tip))
                        ) if driven.input.is_angle else size
        force, way = (weight * arm, 1e-3) if driven.input.is_angle else (weight, 1e-3 * arm)
        assert (servo.tag, servo.get('joint')) == ('position', joint.name)
        assert float(servo.get('kp')) == pytest.approx(force / way)
        assert numbers(servo.get('forcerange')) == pytest.approx([-10.0 * force, 10.0 * force])
        assert numbers(servo.get('ctrlrange')) == pytest.approx(
            sorted(map(joint.of, driven.sweep or ())))


@pytest.mark.parametrize('name', ['five-bar with a gear', 'Cardan gears'])
def test_geared_joints_follow_as_they_are_published(name):
    mechanism = simulated(name)
    parameters = {each.name: each.value for each in mechanism.parameters if each.value != ()}
    # With the signs turned of all but one of the cranks.
    mechanism = scene.read({'mechanisms': ['m'], **parameters, 'm.joint_names': [
        f'{key}=-back_{key}' for key in mechanism.joints if key != 'crank2']}).mechanisms['m']
    robot = model([mechanism])
    # With mimics it is of a version that has them.
    assert ElementTree.fromstring(sdf.write(robot)).get('version') == '1.11'
    assert len(robot.follows) == len(mechanism.linkage.geared) * len(mechanism.assembly().legs)
    for thetas in np.random.default_rng(1).uniform(-3.0, 3.0, (4, len(mechanism.inputs))):
        positions, _ = joints_and_places(mechanism, thetas)
        for geared, (driving, ratio, offset) in robot.follows.items():
            assert math.remainder(ratio * positions[driving] + offset - positions[geared], math.tau
                                  ) == pytest.approx(0.0, abs=1e-12)


def test_gazebo_has_a_plugin_for_each_cut_and_each_motor():
    root, = file = ElementTree.fromstring(sdf.write(model([simulated('five_bar')])))
    plugins = [(plugin.get('filename'), plugin.get('name').rpartition('::')[2],
                {part.tag: part.text for part in plugin}) for plugin in root.findall('plugin')]
    controller = ('gz-sim-joint-position-controller-system', 'JointPositionController')
    assert (file.get('version'), root.get('name')) == ('1.7', 'm') and plugins == [
        ('gz-sim-detachable-joint-system', 'DetachableJoint', {
            'parent_link': 'm_AP_link', 'child_model': '__model__', 'child_link': 'm_P_cut'}),
        ('gz-sim-joint-state-publisher-system', 'JointStatePublisher', {}),
        *((*controller, {'joint_name': f'm_{name}', 'use_velocity_commands': 'true'})
          for name in ('crank', 'crank2'))]


YOKE = ['O ground 0 0', 'X ground 1 0', 'A crank O 1', 'C yoke A O along X', 'D block C {} 0']
LEGS = {'mechanisms': ['leg', 'leg_left0'], 'leg.type': 'jansen', 'leg_left0.type': 'jansen'}
TWO = 'leg.joints, leg_left0.joints must have other names: the robot model would have two {}'
BASES = ('frame_id must be the same for all mechanisms of one robot model, or a link of another '
         'one of them, not {}')
LONG = 'm.scale and m.dimensions must make the longest bar from 1e-30 to 1e+30 m long, not {}'


@pytest.mark.parametrize('parameters, complaint', [
    ({'m.type': 'custom', 'm.joints': [line.format('0.9e30') for line in YOKE]}, ''),
    ({'m.type': 'custom', 'm.joints': [line.format('1.1e30') for line in YOKE]},
     LONG.format('1.1e+30')),
    ({'m.pose': [0.0, -1.1e30, 0.0, 0.0, 0.0, 0.0]},
     'm.pose must be within 1e+30 m, not (0.0, -1.1e+30, 0.0, 0.0, 0.0, 0.0)'),
    ({'m.scale': 0.99e30 / 120.0}, ''), ({'m.scale': 1.01e30 / 120.0}, LONG.format('1.01e+30')),
    ({'m.scale': 1.01e-30 / 120.0}, ''), ({'m.scale': 0.99e-30 / 120.0}, LONG.format('9.9e-31')),
    ({'m.type': 'custom', 'm.joints': [
        'O ground 0 0', 'Q ground 4 0', 'A crank O 1', 'crank_link dyad A Q 3 3 left']},
     'm.joints must have other names: the robot model would have two links m_crank_link'),
    ({**LEGS, 'leg.leg_pairs': 2, 'leg_left0.only_named': True}, TWO.format('links leg_left0_O')),
    ({**LEGS, 'leg.joint_names': ['BC=leg_O_fixed']}, TWO.format('joints leg_O_fixed')),
    ({'frame_id': 'm_crank_link'}, BASES.format('m_crank_link')),
    *(({**ARM, 'hand.frame_id': hand, 'arm.frame_id': arm}, BASES.format(f'{hand}, {arm}'))
      for hand, arm in (('thigh', 'shin'), ('thigh', 'world'), ('arm_AB_link', 'hand_AB_link'))),
    ({**ARM, 'mechanisms': ['m', 'hand', 'arm'], 'm.type': 'four_bar',
      'hand.frame_id': 'arm_B', 'arm.frame_id': 'hand_B'},
     BASES.format('world, arm_B, hand_B'))])
def test_what_makes_no_model_is_refused(parameters, complaint):
    mechanism = {'mechanisms': ['m'], 'm.type': 'four_bar'}
    scene_ = scene.read({**(mechanism if 'mechanisms' not in parameters else {}), **parameters})
    try:
        urdf.describe(scene_.mechanisms.values(), scene_.frame_id)
        assert not complaint
    except scene.SceneError as error:
        assert str(error) == complaint


def test_a_linkage_in_space_makes_no_model():
    mechanisms = scene.load('examples/ankle.yaml').mechanisms
    with pytest.raises(scene.SceneError, match='^ankle is a linkage in space: pictures and robot '
                       'models are of linkages in a plane$'):
        model(mechanisms.values())


def test_what_has_no_length_is_not_drawn():
    # At its shortest the cylinder has no length, and so has its barrel.
    lines = ['P ground 0 0', 'O ground 1 0', 'B cylinder P O 1 right']
    mechanism = alone(lines, cylinder__start=1.0)
    pieces = [piece for pieces in model([mechanism]).pieces.values() for piece in pieces]
    assert {(piece.shape, piece.length > 0.0) for piece in pieces} == {
        ('sphere', False), ('cylinder', True)}


@settings(max_examples=40)
@given(st.lists(st.floats(-10.0, 10.0), min_size=3, max_size=3),
       st.lists(st.sampled_from([k * math.pi / 4.0 for k in range(-4, 5)])
                | st.floats(-7.0, 7.0), min_size=3, max_size=3))
def test_coordinates_of_a_pose_give_the_pose(place, angles):
    pose = turned(*place, *angles)
    coordinates = robot.coordinates(pose)
    assert turned(*coordinates) == pytest.approx(pose, abs=1e-8)
    assert robot.pose(*place, *angles) == pytest.approx(pose, abs=1e-12)
    assert all(map(math.isfinite, coordinates)) and abs(coordinates[4]) <= 0.5 * math.pi + 1e-12


def test_the_command_prints_what_its_options_ask_for(tmp_path, capsys):
    file = scene_file(tmp_path, {'mechanisms': ['a', 'b'], 'a.type': 'four_bar',
                                 'b.type': 'jansen', 'frame_id': 'base'})
    several, lever = scene.load(str(file)).mechanisms, scene.load('config/slotted_lever.yaml')
    for options, mechanisms, frame, width, density in (
            ([], scene.read({}).mechanisms.values(), 'world', None, []),
            (['config/slotted_lever.yaml', '--width', '0.5'], lever.mechanisms.values(),
             lever.frame_id, 0.5, ['--density', '7.8e3']),
            ([str(file), '--mechanism', 'b', 'a'], [several['b'], several['a']], 'base', None,
             [])):
        robot = bodies.robot(mechanisms, frame, width)
        built = bodies.robot(mechanisms, frame, width, 7800.0 if density else 2700.0)
        for more, text in (([], urdf.write(robot)), (['--format', 'urdf'], urdf.write(robot)),
                           (['--format', 'sdf', *density], sdf.write(built)),
                           (['--format', 'mjcf', *density], mjcf.write(built))):
            assert main([*options, *more]) == 0
            assert capsys.readouterr().out == text + '\n'


@pytest.mark.parametrize('arguments, complaint', [
    (['--density', '2700'], '--density is for sdf and mjcf only: the URDF has no masses'),
    (['--width', '-1'], 'argument --width: must be from 1e-30 to 1e+30, not -1'),
    (['--format', 'sdf', '--density', 'lead'],
     "argument --density: invalid number value: 'lead'"),
    (['--density', '2e30'], 'argument --density: must be from 1e-30 to 1e+30, not 2e30'),
    (['--mechanism', 'jansn'], "there is no mechanism 'jansn'; allowed: water_drop, jansen, "
     'peaucellier, slotted_lever; did you mean jansen?'),
    (['--format', 'dae'], "argument --format: invalid choice: 'dae' (choose from ")])
def test_the_command_says_what_is_wrong(capsys, arguments, complaint):
    assert main(arguments) == 1
    result = capsys.readouterr()
    assert not result.out and result.err.startswith(f'urdf: {complaint}')
    assert result.err.count('\n') == 1


GROUP = {'Class': 'rviz_common/Group', 'Name': 'one', 'Displays': [
    {'Class': 'rviz_default_plugins/MarkerArray', 'Topic': {'Value': '/one/markers'}}]}
RVIZ = {'Visualization Manager': {
    'Displays': [{'Class': 'Grid'}, GROUP, {**GROUP, 'Alpha': 1.0}, {'Class': 'Axes'}],
    'Global Options': {}, 'Views': {'Current': {'Class': 'Orbit'}}}}


@pytest.mark.parametrize('angles, pitch, yaw', [
    ((math.pi / 2, 0.0, 0.0), 0.15, -math.pi / 2), ((0.0, 0.0, 0.7), 1.56, -math.pi / 2),
    ((0.3, 0.0, 1.0), math.pi / 2 - 0.3, 1.0 - math.pi / 2),
    ((math.pi / 2, 0.0, 2.0), 0.15, 2.0 - math.pi / 2), ((math.pi, 0.0, 0.0), 0.15, -math.pi / 2),
    ((0.05, 0.0, 1.0), math.pi / 2 - 0.05, -math.pi / 2)])
def test_rviz_s_camera_sees_all_of_a_scene_square_to_the_first_plane(angles, pitch, yaw):
    mechanisms = scene.read({
        'mechanisms': ['m', 'n'], 'm.type': 'jansen', 'm.pose': [1.0, 2.0, 3.0, *angles],
        'n.type': 'slider_crank', 'm.scale': 0.01, 'm.mirrored': True, 'n.scale': 0.01,
        'n.pose': [-1.0, 0.5, 0.0, 0.3, 0.2, 0.1], 'n.crank.sweep': [0.5, 2.0]}).mechanisms
    before = copy.deepcopy(RVIZ)
    manager = rviz.adapted(RVIZ, mechanisms, 'base')['Visualization Manager']
    assert RVIZ == before
    assert manager['Displays'] == [{'Class': 'Grid'}, *(
        {'Class': 'rviz_common/Group', 'Name': name, 'Displays': [
            {'Class': 'rviz_default_plugins/MarkerArray', 'Topic': {'Value': f'/{name}/markers'}}]}
        for name in mechanisms), {'Class': 'Axes'}]
    view, places = manager['Views']['Current'], []
    for mechanism in mechanisms.values():
        ends = mechanism.first.ends or (0.0, math.tau)
        solution = mechanism.assembly().solution(mechanism.linkage.points)
        for theta in np.linspace(*ends, 51):
            solution.solve([theta])
            # A mirrored walker is shown with both of its sides in all poses.
            for side in (1.0, -1.0)[:1 + mechanism.mirrored]:
                places += [*in_space(mechanism.pose, solution.rows.reshape(-1, 2) * (side, 1.0))]
    low, high = np.min(places, axis=0), np.max(places, axis=0)
    focus, radius = (low + high) / 2, math.dist(low, high) / 2
    assert [view['Focal Point'][axis] for axis in 'XYZ'] == pytest.approx(focus, abs=0.02 * radius)
    # A view of 45 degrees, and a tenth more.
    assert view['Distance'] * math.sin(math.pi / 8) == pytest.approx(1.1 * radius, rel=0.02)
    assert view['Class'] == 'Orbit' and 0.0 <= view['Yaw'] < math.tau
    assert (view['Pitch'], math.remainder(view['Yaw'] - yaw, math.tau)) == (
        pytest.approx(pitch, abs=1e-6), pytest.approx(0.0, abs=1e-6))


@pytest.mark.parametrize('scale, distance', [(1e-6, 1.0), (0.01, ANY)])
def test_rviz_s_camera_sees_what_some_inputs_cannot_reach_and_what_is_tiny(scale, distance):
    mechanisms = scene.read(
        {'mechanisms': ['m'], 'm.type': 'five_bar', 'm.scale': scale}).mechanisms
    view = rviz.adapted(RVIZ, mechanisms, 'base')['Visualization Manager']['Views']['Current']
    assert view['Distance'] == distance
    assert all(map(math.isfinite, (view['Distance'], *view['Focal Point'].values())))
