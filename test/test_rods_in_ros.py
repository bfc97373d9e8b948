# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""An ankle of two rods in the nodes: hinges by the robot's names, markers in space."""

import math
from pathlib import Path

from linkage_ros import mechanisms
from linkage_ros.nodes.kinematics import Kinematics
import numpy as np
import pytest
from sensor_msgs.msg import JointState
from test_rods import G1
from visualization_msgs.msg import MarkerArray

EXAMPLES = Path(__file__).parents[1] / 'examples'
SCENE = {'mechanisms': ['ankle'], 'ankle.type': 'rods', 'ankle.joints': list(G1),
         'ankle.joint_names': ['pitch=left_ankle_pitch', 'roll=-left_ankle_roll+0.1'],
         'ankle.loads': ['pitch=12.0', 'roll=-3.0'],
         'ankle.right.source': 'motor_a', 'ankle.left.source': 'motor_b'}


def test_the_hinges_of_an_ankle_are_published_with_velocities_and_the_motors_efforts(graph):
    graph.start(Kinematics, SCENE)
    turn, heard = graph.crank(['motor_a', 'motor_b']), graph.listen(
        JointState, 'ankle/joint_states')
    linkage = mechanisms.create('rods', joints=G1)
    for motors in ((0.0, 0.0), (0.1, -0.05), (-0.2, 0.1)):
        message = turn(list(motors), heard, [1.0, 2.0])
        position, velocity, effort = (dict(zip(message.name, values)) for values in (
            message.position, message.velocity, message.effort))
        angles = linkage.joint_angles(motors, ['pitch', 'roll'])
        rates = [linkage.joint_rates(motors, ['pitch', 'roll'], by) for by in (0, 1)]
        assert math.isclose(position['left_ankle_pitch'], angles['pitch'], abs_tol=1e-15)
        assert math.isclose(position['left_ankle_roll'], 0.1 - angles['roll'], abs_tol=1e-15)
        assert math.isclose(velocity['left_ankle_roll'], -sum(
            rate['roll'] * speed for rate, speed in zip(rates, (1.0, 2.0))), rel_tol=1e-12)
        held = linkage.effort(motors, {'pitch': 12.0, 'roll': -3.0})
        assert np.allclose([effort['ankle_right'], effort['ankle_left']], held, rtol=1e-13)


def test_markers_are_in_space(graph):
    graph.start(Kinematics, SCENE)
    turn, heard = graph.crank(['motor_a', 'motor_b']), graph.listen(MarkerArray, 'ankle/markers')
    lines, joints, cranks = turn([0.1, -0.05], heard).markers
    linkage = mechanisms.create('rods', joints=G1)
    place = dict(zip(linkage.points, [(p.x, p.y, p.z) for p in joints.points]))
    np.testing.assert_allclose(
        [*place.values()], [*linkage.solve((0.1, -0.05)).values()], atol=1e-15)
    bars, turned = ({frozenset(map(tuple, ends)) for ends in np.reshape(
        [(p.x, p.y, p.z) for p in marker.points], (-1, 2, 3)).tolist()}
        for marker in (lines, cranks))
    # The arms of the motors are drawn as cranks.
    arms = {bar for bar in linkage.bars if bar[0] in ('right_origin', 'left_origin')}
    assert len(arms) == 2
    for found, wanted in ((turned, arms), (bars, {*linkage.bars} - arms)):
        assert found == {frozenset(place[name] for name in bar) for bar in wanted}


def test_the_example_s_rods_are_closed_in_its_own_urdf(graph):
    pin = pytest.importorskip('pinocchio')
    graph.start(Kinematics, cli_args=['--ros-args', '--params-file', str(EXAMPLES / 'ankle.yaml')])
    turn = graph.crank(['motor_right', 'motor_left'])
    heard = graph.listen(JointState, 'ankle/joint_states')
    model = pin.buildModelFromXML((EXAMPLES / 'ankle.urdf').read_text())
    data = model.createData()
    lengths = {'right': math.dist((0.0395, -0.0164, 0.2112), (0.022, -0.015, -0.0096)),
               'left': math.dist((0.035, 0.0165, 0.1469), (0.022, 0.015, -0.0096))}
    for motors in np.random.default_rng(1).uniform(-0.2, 0.2, (20, 2)).tolist():
        message = turn(motors, heard)
        joints = dict(zip(message.name, message.position))
        joints.update(motor_right=motors[0], motor_left=motors[1])
        assert joints.keys() == {*model.names[1:]}
        q = pin.neutral(model)
        for name, value in joints.items():
            q[model.joints[model.getJointId(name)].idx_q] = value
        pin.framesForwardKinematics(model, data, q)
        for side, length in lengths.items():
            ends = [data.oMf[model.getFrameId(f'{side}_{end}')].translation
                    for end in ('pin', 'eye')]
            assert abs(np.linalg.norm(ends[0] - ends[1]) - length) < 1e-12
