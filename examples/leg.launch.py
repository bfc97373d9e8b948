# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Bring up the leg: its own robot model, its passive joints, and motors where there are none.

    ros2 launch linkage_ros leg.launch.py simulated:=false
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

HERE = Path(__file__).parent
SCENE, ROBOT = HERE / 'leg.yaml', HERE / 'leg.urdf'
# Motors and passive joints are on one topic, as robot_state_publisher wants them.
ON_JOINT_STATES = [('crank_states', 'joint_states')]


def generate_launch_description():
    """Return robot_state_publisher and kinematics, and crank_driver in place of the motors."""
    robot = ParameterValue(ROBOT.read_text(), value_type=str)
    return LaunchDescription([
        DeclareLaunchArgument(
            'simulated', default_value='true',
            description='Whether crank_driver speaks for the motors; false: the robot does.'),
        Node(package='robot_state_publisher', executable='robot_state_publisher',
             parameters=[{'robot_description': robot, 'publish_frequency': 100.0}]),
        Node(package='linkage_ros', executable='kinematics', parameters=[str(SCENE)],
             remappings=ON_JOINT_STATES),
        Node(package='linkage_ros', executable='crank_driver', parameters=[str(SCENE)],
             remappings=ON_JOINT_STATES,
             condition=IfCondition(LaunchConfiguration('simulated'))),
    ])
