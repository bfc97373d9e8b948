# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The example robots: what arrives on `joint_states` closes the loops of their own URDFs."""

import math
import os
import subprocess
import sys
from xml.etree import ElementTree

from linkage_ros.nodes.crank_driver import CrankDriver
from linkage_ros.nodes.kinematics import Kinematics
import numpy as np
import pytest
from robots import FIRST, in_frame, LIBRARIES, Pinocchio
from ros_harness import Graph
from scenes import ROOT
from sensor_msgs.msg import JointState
from visualization_msgs.msg import MarkerArray

EXAMPLES = ROOT / 'examples'
URDF = (EXAMPLES / 'leg.urdf').read_text()
ARGS = ['--ros-args', '--params-file', str(EXAMPLES / 'leg.yaml'),
        '-r', 'crank_states:=joint_states']
# What has to coincide, by the URDF alone.
LOOPS = [('abduction_eye', 'abduction_pin'), ('knee_eye', 'knee_pin')]
# Motors of two boards, and how far each turns [rad].
BOARDS = {('abduction_motor', 'hip_motor'): np.array([[-12.0, 12.0], [-4.5, 5.8]]),
          ('knee_motor',): np.array([[-7.0, 4.5]])}
MOTORS = {name for motors in BOARDS for name in motors}
JOINTS = {joint.get('name'): joint for joint in ElementTree.fromstring(URDF).iter('joint')
          if joint.get('type') != 'fixed'}
PASSIVE = JOINTS.keys() - MOTORS
POSES = 40


class Robot:
    """The leg's kinematics and its motors, all on `joint_states`."""

    def __init__(self, graph):
        self.joints, self._answers, self._boards = {}, [], {}
        self._graph = graph
        graph.start(Kinematics, cli_args=ARGS)
        graph.node.create_subscription(JointState, 'joint_states', self._hear, 100)

    def _hear(self, message):
        if not PASSIVE.isdisjoint(message.name):
            self._answers.append(message)
            self.joints.update(zip(message.name, message.position, strict=True))

    def turn(self, motors, positions):
        """Move some motors; return the joints that then are known, from motors and node alike."""
        if motors not in self._boards:
            self._boards[motors] = self._graph.crank(list(motors), 'joint_states')
        self._boards[motors](positions, self._answers)
        self.joints.update(zip(motors, positions, strict=True))
        return dict(self.joints)


@pytest.fixture(scope='module')
def states():
    """Return the joints on the topic at poses all over the motors' range, board after board."""
    with Graph() as graph:
        robot, rng, positions = Robot(graph), np.random.default_rng(13), []
        for part in [0.0, 1.0, *rng.uniform(size=POSES)]:
            for motors, ends in BOARDS.items():
                at = ends @ ([1.0 - part, part] if part in (0.0, 1.0) else rng.dirichlet([1, 1]))
                positions.append(robot.turn(motors, list(at)))
        # A message of one motor out of two moves that one.
        positions.append(robot.turn(('hip_motor',), [1.0]))
        return positions


@pytest.mark.parametrize('library', LIBRARIES)
def test_the_loops_of_the_urdf_are_closed_at_every_pose(states, library):
    robot = library(URDF)
    for state in states:
        if len(state) == len(robot.joints):
            places = robot.places(state, [frame for loop in LOOPS for frame in loop])
            for eye, pin in LOOPS:
                assert np.abs(places[eye] - places[pin]).max() < 1e-12


def test_every_joint_is_told_and_stays_within_the_limits_of_the_urdf(states):
    assert len(states) == 2 * POSES + 5 and set(states[0]) < set(states[-1]) == set(JOINTS)
    limits = {name: [float(limit.get(end)) for end in ('lower', 'upper')]
              for name, joint in JOINTS.items() if (limit := joint.find('limit')) is not None}
    assert len(limits) == 7
    for name, (low, high) in limits.items():
        positions = [state[name] for state in states if name in state]
        assert low < min(positions) < max(positions) < high
        assert np.ptp(positions) > 0.4 * (high - low)


def test_gears_have_their_ratios_and_a_partial_message_moves_its_motor_alone(states):
    for state in states[2:]:
        for name, crank, ratio in (('abduction', 'abduction_crank', 20.0),
                                   ('hip', 'hip_pitch', 8.0), ('knee', 'knee_crank', -10.0)):
            assert state[crank] == pytest.approx(state[f'{name}_motor'] / ratio, abs=1e-15)
    before, after = states[-2:]
    assert {name for name in after if after[name] != before[name]} == {'hip_motor', 'hip_pitch'}


@pytest.mark.parametrize('name, motor, base', [
    ('abduction', 'abduction_motor', 'torso'), ('knee', 'knee_motor', 'thigh')])
def test_markers_stay_on_the_link_that_the_loop_stands_on_wherever_it_is(graph, name, motor, base):
    robot, urdf = Robot(graph), FIRST(URDF)
    drawn = graph.listen(MarkerArray, f'{name}/markers')
    for at in (-4.0, 4.0):
        robot.turn(('abduction_motor', 'hip_motor'), [at, at])
        robot.turn(('knee_motor',), [at])
        *_, pin = (spheres := graph.crank([motor], 'joint_states')([at], drawn).markers[1]).points
        expected, = urdf.places(robot.joints, [f'{name}_pin'], base).values()
        assert spheres.header.frame_id == base
        assert in_frame(spheres.pose, pin) == pytest.approx(expected, abs=1e-12)


def test_a_simulated_motor_says_what_the_real_one_would(graph):
    messages = graph.listen(JointState, 'joint_states')
    graph.start(Kinematics, cli_args=ARGS)
    graph.start(CrankDriver, cli_args=ARGS)
    graph.until(lambda: {name for message in messages for name in message.name} == set(JOINTS))
    for message in messages:
        assert {*message.name} in (MOTORS, PASSIVE) and len(message.velocity) == len(message.name)


@pytest.mark.nightly
def test_the_picture_is_drawn_by_its_command(tmp_path):
    pytest.importorskip('matplotlib')
    subprocess.run([sys.executable, EXAMPLES / 'draw_leg.py', tmp_path / 'leg.png'], check=True,
                   timeout=60, env={**os.environ, 'MPLBACKEND': 'Agg'})
    assert (tmp_path / 'leg.png').read_bytes().startswith(b'\x89PNG')


def test_the_example_s_rods_are_closed_in_its_own_urdf(graph):
    graph.start(Kinematics, cli_args=['--ros-args', '--params-file', str(EXAMPLES / 'ankle.yaml')])
    turn = graph.crank(['motor_right', 'motor_left'])
    messages = graph.listen(JointState, 'ankle/joint_states')
    robot = Pinocchio((EXAMPLES / 'ankle.urdf').read_text())
    lengths = {'right': math.dist((0.0395, -0.0164, 0.2112), (0.022, -0.015, -0.0096)),
               'left': math.dist((0.035, 0.0165, 0.1469), (0.022, 0.015, -0.0096))}
    for motors in np.random.default_rng(1).uniform(-0.2, 0.2, (20, 2)).tolist():
        message = turn(motors, messages)
        joints = {'motor_right': motors[0], 'motor_left': motors[1],
                  **dict(zip(message.name, message.position))}
        assert joints.keys() == {*robot.joints}
        for side, length in lengths.items():
            ends = robot.places(joints, [f'{side}_pin', f'{side}_eye']).values()
            assert abs(math.dist(*ends) - length) < 1e-12
