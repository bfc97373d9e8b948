# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The layouts for RViz and Foxglove and the launch file: they name what there is."""

import ast
import configparser
from importlib.util import find_spec
import json
import math
from pathlib import Path
import re
import runpy
import shlex

from linkage_ros import scene
from linkage_ros.robot_model import rviz
import numpy as np
import pytest
from scenes import example, ROOT
import yaml

CONFIG = ROOT / 'config'
LAUNCH = ROOT / 'launch' / 'scene.launch.py'
MESSAGES = {
    'rviz_default_plugins/MarkerArray': 'visualization_msgs/msg/MarkerArray',
    'rviz_default_plugins/Marker': 'visualization_msgs/msg/Marker',
    'rviz_default_plugins/RobotModel': 'std_msgs/msg/String'}
DURABLE = {'TRANSIENT_LOCAL': 'Transient Local', 'VOLATILE': 'Volatile'}


@pytest.fixture
def shown():
    """Return RViz's configuration."""
    return yaml.safe_load((CONFIG / 'linkage.rviz').read_text())


def displays(config):
    """Return all displays, those in groups too, but not the groups."""
    displays_, left = [], list(config['Visualization Manager']['Displays'])
    while left:
        display = left.pop(0)
        left += display.get('Displays', ())
        if display['Class'] != rviz.GROUP:
            displays_.append(display)
    return displays_


def topics(config):
    """Return topic, display class and durability of what is subscribed to."""
    return {(topic['Value'], display['Class'], topic['Durability Policy'])
            for display in displays(config)
            for topic in (display.get('Topic'), display.get('Description Topic')) if topic}


def test_rviz_and_foxglove_show_what_the_nodes_of_the_scene_publish(graph, shown):
    from linkage_ros.nodes.kinematics import Kinematics

    catalogue = scene.load(str(CONFIG / 'all.yaml'))
    node = graph.start(Kinematics, example('all'))
    published = set()
    for name, types in node.get_publisher_names_and_types_by_node('kinematics', '/'):
        for class_, type_ in MESSAGES.items():
            if type_ in types and name != '/robot_description':
                info, = node.get_publishers_info_by_topic(name)
                published.add((name, class_, DURABLE[info.qos_profile.durability.name]))
    assert len(published) == 3 * len(catalogue.mechanisms)
    assert topics(shown) == published
    layout = json.loads((CONFIG / 'linkage.foxglove.json').read_text())
    panels, room = layout['configById'], layout['layout']
    assert set(panels) == {room['first'], room['second']['first'], room['second']['second']}
    drawn = panels['3D!linkages']
    assert drawn['followTf'] == catalogue.frame_id and set(drawn['topics']) == {
        name for name, *_ in published if not name.endswith('/robot_description')}
    for path in panels['Plot!joints']['paths']:
        match = re.fullmatch(r'/(\w+)/joint_states\.position\[(\d)\]', path['value'])
        name, place = match.groups()
        called = [joint.name for joint in catalogue.mechanisms[name].joints.values()]
        assert path['label'] == called[int(place)]


def test_rviz_shows_any_other_scene_too(shown):
    scene_ = scene.load(str(CONFIG / 'all.yaml'))
    assert rviz.adapted(shown, scene_.mechanisms, scene_.frame_id) == shown
    mechanisms = scene.read(
        {'mechanisms': ['walker', 'jansen'], 'walker.type': 'klann'}).mechanisms
    other = rviz.adapted(shown, mechanisms, 'earth', 'left/side', True, 'left/')
    assert {name for name, *_ in topics(other)} == {
        f'/left/side/{name}/{topic}' for name in ('walker', 'jansen')
        for topic in ('markers', 'locus', 'robot_description')}
    assert other['Visualization Manager']['Global Options']['Fixed Frame'] == 'earth'
    assert all(d['Enabled'] and d['Value'] for d in displays(other))
    assert [d['TF Prefix'] for d in displays(other) if 'TF Prefix' in d] == ['left', 'left']
    assert rviz.adapted(other, scene_.mechanisms, scene_.frame_id)['Panels'] == shown['Panels']


def test_rviz_opens_on_all_of_a_linkage_in_space(shown):
    mechanisms = scene.load(str(ROOT / 'examples' / 'ankle.yaml')).mechanisms
    view = rviz.adapted(shown, mechanisms, 'world')['Visualization Manager']['Views']['Current']
    focus = [view['Focal Point'][axis] for axis in 'XYZ']
    linkage = mechanisms['ankle'].linkage
    places = np.array(list(linkage.solve([0.0, 0.0]).values()))
    off = np.linalg.norm(places - focus, axis=1)
    assert 0.3 < off.max() / view['Distance'] / math.sin(math.radians(22.5)) < 1.0
    assert 0.1 < view['Pitch'] < 0.5


@pytest.fixture
def constants():
    """Return the launch file's constants and functions, without importing what it imports."""
    values = {}
    lines = [line for line in ast.parse(LAUNCH.read_text()).body
             if isinstance(line, (ast.Assign, ast.FunctionDef))]
    exec(compile(ast.Module(lines, []), LAUNCH, 'exec'), values)
    return values


def test_the_launch_file_starts_executables_that_there_are(constants, setup_arguments):
    handed = setup_arguments('install')
    installed = [line.split(' = ')[0] for line in handed['entry_points']['console_scripts']]
    config = configparser.ConfigParser()
    config.read(ROOT / 'setup.cfg')
    assert constants['PACKAGE'] == config['metadata']['name']
    assert {*constants['NODES'], *constants['TOGETHER'], constants['VIEWER']} <= set(installed)
    files = {name for folder, names in handed['data_files'] for name in names}
    assert {f'config/{constants["RVIZ_CONFIG"]}', 'launch/scene.launch.py'} <= files
    kept = *CONFIG.glob('*.*'), *(ROOT / 'examples').glob('*.*')
    assert {str(path.relative_to(ROOT)) for path in kept} <= files


def test_every_argument_of_the_launch_file_is_described(constants):
    arguments = {name: (default, about) for name, default, about in constants['ARGUMENTS']}
    assert {'scene', 'rviz', 'robot_model', 'viewer', 'namespace'} <= set(arguments)
    for _, about in arguments.values():
        assert about[0].isupper() and about.endswith('.')
    assert (CONFIG / f'{arguments["scene"][0]}.yaml').is_file()
    documented = (ROOT / 'docs' / 'viewer.md').read_text()
    assert all(f'`{name}`' in documented for name in arguments)
    viewer = pytest.importorskip('linkage_ros.web.viewer')
    assert f'empty: {viewer.PORT}, or any' in arguments['port'][1]


needs_launch = pytest.mark.skipif(
    not find_spec('launch_ros'), reason='launch and launch_ros are not installed')


def started(launch=LAUNCH, **arguments):
    """Return the nodes that a launch file starts."""
    from launch import LaunchContext
    from launch.actions import DeclareLaunchArgument, OpaqueFunction
    from launch_ros.actions import Node

    context = LaunchContext()
    context.launch_configurations.update(arguments)
    nodes = []
    for entity in runpy.run_path(str(launch))['generate_launch_description']().entities:
        if isinstance(entity, DeclareLaunchArgument):
            entity.execute(context)
        elif isinstance(entity, OpaqueFunction):
            nodes += entity.execute(context)
        elif isinstance(entity, Node):
            nodes += [entity] * (not entity.condition or entity.condition.evaluate(context))
    return nodes


@needs_launch
@pytest.mark.parametrize('arguments, besides', [
    ({}, ['viewer']),
    ({'viewer': 'false', 'scene': 'strandbeest'}, []),
    ({'apart': 'true'}, ['viewer']),
    ({'scene': str(CONFIG / 'all.yaml'), 'robot_model': 'true'},
     4 * ['robot_state_publisher'] + ['viewer']),
    ({'scene': 'jansen', 'robot_model': 'True', 'viewer': 'False', 'frame_prefix': 'left'},
     ['robot_state_publisher', 'static_transform_publisher']),
    ({'rviz': 'True', 'namespace': 'left'}, ['rviz2', 'static_transform_publisher', 'viewer'])])
def test_the_launch_file_starts_the_nodes_of_a_scene(arguments, besides, monkeypatch, tmp_path):
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path))
    nodes = ['crank_driver', 'kinematics', 'servo_inverse'] if 'apart' in arguments else ['scene']
    assert [node.node_executable for node in started(**arguments)] == [*besides, *nodes]


@needs_launch
@pytest.mark.parametrize('arguments, option', [
    ({}, 'or_any_port:=true'), ({'port': '0'}, 'port:=0'), ({'port': 'abc'}, 'port:=abc')])
def test_the_port_is_left_to_the_viewer(arguments, option):
    viewer, _ = started(**arguments)
    words = [''.join(getattr(part, 'text', '') for part in word) for word in viewer.cmd]
    assert words[words.index('-p') + 1] == option


@needs_launch
def test_what_cannot_be_is_refused_with_what_is_allowed():
    for name, text, complaint in (
            ('scene', 'walker', 'must be one of all, .*, not walker$'),
            ('scene', 'strandbest', 'not strandbest; did you mean strandbeest'),
            ('viewer', 'maybe', '"viewer" .*"maybe" is not valid. Valid options are: .*true'),
            ('use_sim_time', '', '"use_sim_time" .*"" is not valid')):
        with pytest.raises(RuntimeError, match=complaint):
            started(**{name: text})


@needs_launch
@pytest.mark.parametrize('simulated, drivers', [('true', ['crank_driver']), ('false', [])])
def test_the_motors_of_the_example_are_simulated_where_that_is_wanted(simulated, drivers):
    nodes = started(ROOT / 'examples' / 'leg.launch.py', simulated=simulated)
    assert [node.node_executable for node in nodes] == [
        'robot_state_publisher', 'kinematics', *drivers]


ROBOT, ROBOTS = LAUNCH.with_name('robot.launch.py'), Path(__file__).with_name('robot_files')
COUPLER = '<body name="right_coupler" pos="0 0.0315 -0.0041">'


def robot_launched(tmp_path, monkeypatch, file, capsys, *more, **arguments):
    """Return what robot.launch.py starts of a robot, with the scene that from_robot prints."""
    from linkage_ros.robot_files import cli

    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path))
    assert cli.main([str(file), *more]) == 0
    made = tmp_path / 'scene.yaml'
    made.write_text(capsys.readouterr().out)
    return made, started(ROBOT, robot=str(file), scene=str(made), **arguments)


@needs_launch
def test_a_whole_robot_is_launched_with_all_its_joints(tmp_path, monkeypatch, capsys):
    scene_file, nodes = robot_launched(tmp_path, monkeypatch, ROBOTS / 'wheel_leg.urdf', capsys)
    assert [node.node_executable for node in nodes] == [
        'robot_state_publisher', 'kinematics', 'crank_driver']
    # No other mechanism is needed: motors are sources, and the others are published.
    _, nodes = robot_launched(tmp_path, monkeypatch, ROBOTS / 'boom.urdf', capsys,
                              simulated='false')
    assert [node.node_executable for node in nodes] == ['robot_state_publisher', 'kinematics']


@needs_launch
def test_a_joint_that_nothing_determines_is_named_and_no_input(tmp_path, monkeypatch, capsys):
    from launch.actions import LogInfo

    pytest.importorskip('mujoco')
    file = tmp_path / 'gripper.xml'
    text = (ROBOTS / 'gripper.xml').read_text()
    assert COUPLER in text
    file.write_text(text.replace(COUPLER, f'{COUPLER}<joint name="a spring" axis="1 0 0"/>'))
    _, (report, *nodes) = robot_launched(tmp_path, monkeypatch, file, capsys)
    assert isinstance(report, LogInfo) and [node.node_executable for node in nodes] == [
        'robot_state_publisher', 'kinematics', 'crank_driver']
    lost = {'a spring', 'right_spring_link_joint', 'right_follower_joint'}
    said = ''.join(part.text for part in report.msg)
    assert all(name in said for name in lost)
    # Held, all of them are there.
    made, nodes = robot_launched(tmp_path, monkeypatch, file, capsys, '--hold', 'a spring=0',
                                 hold="'a spring=0'")
    hold = re.search('hold:=(.*)', made.read_text())[1]
    assert shlex.split(*shlex.split(hold)) == ['a spring=0']
    assert not isinstance(nodes[0], LogInfo)
