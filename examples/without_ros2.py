# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What the `ros2` command line does, in Python, with the running nodes of config/all.yaml.

    python examples/without_ros2.py
"""

import time

from linkage_interfaces.srv import ServoInverse
import rclpy
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.wait_for_message import wait_for_message
from sensor_msgs.msg import JointState

rclpy.init()
shell = rclpy.create_node('shell')


def answer(future):
    """Return the response of a service."""
    rclpy.spin_until_future_complete(shell, future, timeout_sec=5.0)
    return future.result()


# ros2 topic echo --once /jansen/joint_states
_, message = wait_for_message(JointState, shell, '/jansen/joint_states', time_to_wait=5.0)
print(message.name)

# ros2 param set /kinematics jansen.dimensions.m 14.0
kinematics = AsyncParameterClient(shell, '/kinematics')
kinematics.wait_for_services(5.0)
print(answer(kinematics.set_parameters([Parameter('jansen.dimensions.m', value=14.0)])))

# ros2 service call /servo_inverse linkage_interfaces/srv/ServoInverse "{lever_angle: [0.2]}"
servo_inverse = shell.create_client(ServoInverse, '/servo_inverse')
servo_inverse.wait_for_service(5.0)
print(answer(servo_inverse.call_async(ServoInverse.Request(lever_angle=[0.2]))).servo_angle)

# ros2 topic pub --once /wanted_states sensor_msgs/msg/JointState "{name: [...], position: [0.2]}"
wanted = shell.create_publisher(JointState, '/wanted_states', 10)
while not wanted.get_subscription_count():
    time.sleep(0.1)
wanted.publish(JointState(name=['slotted_lever_lever'], position=[0.2]))
