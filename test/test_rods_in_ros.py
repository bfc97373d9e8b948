# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""An ankle of two rods in the nodes: its rods are closed in the robot's own model."""

import math
from pathlib import Path

from linkage_ros.nodes.kinematics import Kinematics
import numpy as np
import pytest
from sensor_msgs.msg import JointState

EXAMPLES = Path(__file__).parents[1] / 'examples'


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
