# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The how-to page: its files are saved, its commands are run, and what they say is so."""

import cmath
from pathlib import Path
import re
import shlex
from xml.etree import ElementTree

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('linkage_interfaces')
yaml = pytest.importorskip('yaml')

from linkage_ros import scene  # noqa: E402
from linkage_ros.nodes.crank_driver import CrankDriver  # noqa: E402
from linkage_ros.nodes.kinematics import Kinematics  # noqa: E402
from linkage_ros.nodes.servo_inverse import ServoInverse  # noqa: E402
from linkage_ros.robot_files.command import main as from_robot  # noqa: E402
from linkage_ros.robot_model.command import main as urdf  # noqa: E402
from robots import LIBRARIES  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from std_msgs.msg import Float64MultiArray  # noqa: E402

ROOT = Path(__file__).parents[1]
SECTIONS = dict(re.findall(r'^## (.*?)\n(.*?)(?=^## |\Z)', (ROOT / 'docs/how-to.md').read_text(),
                           re.MULTILINE | re.DOTALL))
BLOCK = re.compile(r'(?:^`([\w.]+)`:\n\n)?^```(\w+)\n(.*?)^```', re.MULTILINE | re.DOTALL)
NODES = {'kinematics': Kinematics, 'crank_driver': CrankDriver, 'servo_inverse': ServoInverse}
COMMANDS = {'from_robot': from_robot, 'linkage_ros.robot_model': urdf}


@pytest.fixture
def follow(graph, capsys, monkeypatch, tmp_path):
    """Return a function that does what a section says; it returns what was printed last."""
    (tmp_path / 'examples').symlink_to(ROOT / 'examples')
    monkeypatch.chdir(tmp_path)

    def run(line):
        line, _, file = line.partition(' > ')
        name, *args = shlex.split(re.sub(r'^(ros2 run linkage_ros|python -m) ', '', line))
        if name in NODES:
            return graph.start(NODES[name], cli_args=args)
        assert COMMANDS[name](args) == 0
        printed = capsys.readouterr().out
        if file:
            Path(file).write_text(printed)
        return printed

    def followed(section):
        for file, language, text in BLOCK.findall(SECTIONS[section]):
            if file:
                Path(file).write_text(text)
            if language == 'console':
                *_, said = [run(line) for line in re.findall(r'^\$ (.*)', text, re.MULTILINE)]
        return said

    return followed


def test_every_section_is_tried():
    tried = set(re.findall(r"follow\('(.*?)'\)", Path(__file__).read_text()))
    assert tried == {*SECTIONS}


def test_an_encoder_behind_a_belt(graph, follow):
    states = graph.listen(JointState, 'joint_states', 100)
    follow('An encoder with a gear')

    def by_stamp(name):
        return {(state.header.stamp.sec, state.header.stamp.nanosec): state
                for state in states if name in state.name}

    graph.until(lambda: len(by_stamp('belt_encoder').keys() & by_stamp('press_QB').keys()) > 9)
    for stamp, state in by_stamp('press_QB').items():
        joints = dict(zip(state.name, state.position))
        assert 0.6 <= joints['press_crank'] <= 2.6
        if told := by_stamp('belt_encoder').get(stamp):
            assert joints['press_QB'] == pytest.approx(told.position[0] / 3.0 + 1.8, abs=1e-12)


@pytest.mark.parametrize('library', LIBRARIES)
def test_a_urdf_with_pairs_of_frames(graph, follow, library):
    follow('An existing URDF')
    answers, robot = [], library((ROOT / 'examples/leg.urdf').read_text())
    graph.node.create_subscription(
        JointState, 'joint_states', lambda m: 'knee' in m.name and answers.append(m), 10)
    cranks = ['abduction_crank', 'knee_crank']
    turn = graph.crank(cranks, 'joint_states')
    for at in ([-0.5, -0.4], [0.0, 0.3], [0.5, 0.7]):
        state = turn(at, answers)
        joints = dict(zip([*state.name, *cranks], [*state.position, *at]))
        places = robot.places(joints, ['abduction_eye', 'abduction_pin', 'knee_eye', 'knee_pin'])
        for loop in ('abduction', 'knee'):
            assert places[f'{loop}_eye'] == pytest.approx(places[f'{loop}_pin'], abs=1e-12)


def test_a_model_for_mujoco(graph, follow):
    pytest.importorskip('mujoco')
    follow('A MuJoCo model')
    answers = []
    graph.node.create_subscription(
        JointState, 'joint_states', lambda m: 'rod_joint' in m.name and answers.append(m), 10)
    turn = graph.crank(['driver_joint'], 'joint_states')
    for driver in (-0.6, 0.0, 0.6):
        state = turn([driver], answers)
        rod, finger = (state.position[state.name.index(f'{name}_joint')]
                       for name in ('rod', 'finger'))
        eye = 0.03j * cmath.exp(-1j * driver) + (0.05 + 0.01j) * cmath.exp(-1j * (driver + rod))
        assert eye == pytest.approx(0.05 + 0.04j * cmath.exp(-1j * finger), abs=1e-12)


def test_coordinates_of_a_drawing(follow):
    robot = LIBRARIES[0](follow('A CAD export'))
    machine = scene.load('export.yaml').machines['lid']
    angles = machine.linkage.joint_angles(machine.first.start)
    places = robot.places({f'lid_{name}': angle for name, angle in angles.items()},
                          ['lid_A', 'lid_B'])
    assert places['lid_A'] == pytest.approx([0.012, 0.0, 0.04], abs=1e-12)
    assert places['lid_B'] == pytest.approx([0.1, 0.0, 0.07], abs=1e-12)


def test_ros2_control_moves_the_motors_of_the_scene(graph, follow):
    machines = follow('ros2_control beside it').scene.machines
    sources = {name: [machine.first.source] for name, machine in machines.items()}
    motors = [motor for listed in sources.values() for motor in listed]
    controllers = yaml.safe_load(Path('controllers.yaml').read_text())
    control, robot = map(ElementTree.parse, ('control.urdf', 'examples/leg.urdf'))
    assert {name: controllers[name]['ros__parameters']['joints'] for name in machines} == sources
    assert [joint.get('name') for joint in control.iter('joint')] == motors
    assert {*motors} < {joint.get('name') for joint in robot.iter('joint')}

    # What is wanted of the knee becomes a command, which puts the knee there.
    commands, answers = graph.listen(Float64MultiArray, 'knee/commands'), []
    graph.node.create_subscription(
        JointState, 'joint_states', lambda m: 'knee' in m.name and answers.append(m), 10)
    wanted = graph.node.create_publisher(JointState, 'wanted_states', 10)
    graph.until(lambda: commands or wanted.publish(JointState(name=['knee'], position=[0.9])))
    state = graph.crank(['knee_motor'], 'joint_states')(commands[0].data, answers)
    assert state.position[state.name.index('knee')] == pytest.approx(0.9, abs=1e-12)
