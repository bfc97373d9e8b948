# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""An ankle of two rods in the nodes: its rods are closed in the robot's own model."""

import math
from pathlib import Path

from linkage_ros.nodes.kinematics import Kinematics
import numpy as np
from robots import Pinocchio
from sensor_msgs.msg import JointState

EXAMPLES = Path(__file__).parents[1] / 'examples'


def test_the_example_s_rods_are_closed_in_its_own_urdf(graph):
    graph.start(Kinematics, cli_args=['--ros-args', '--params-file', str(EXAMPLES / 'ankle.yaml')])
    turn = graph.crank(['motor_right', 'motor_left'])
    heard = graph.listen(JointState, 'ankle/joint_states')
    robot = Pinocchio((EXAMPLES / 'ankle.urdf').read_text())
    lengths = {'right': math.dist((0.0395, -0.0164, 0.2112), (0.022, -0.015, -0.0096)),
               'left': math.dist((0.035, 0.0165, 0.1469), (0.022, 0.015, -0.0096))}
    for motors in np.random.default_rng(1).uniform(-0.2, 0.2, (20, 2)).tolist():
        message = turn(motors, heard)
        joints = {'motor_right': motors[0], 'motor_left': motors[1],
                  **dict(zip(message.name, message.position))}
        assert joints.keys() == {*robot.joints}
        for side, length in lengths.items():
            ends = robot.places(joints, [f'{side}_pin', f'{side}_eye']).values()
            assert abs(math.dist(*ends) - length) < 1e-12
