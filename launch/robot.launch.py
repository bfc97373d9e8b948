# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Bring up a robot with the scene that from_robot has made of it, all its joints on /joint_states.

    ros2 launch linkage_ros robot.launch.py robot:=robot.xml scene:=robot.yaml
"""

from pathlib import Path
import shlex
import tempfile

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from linkage_ros import scene
from linkage_ros.robot_files import cli, readers
from linkage_ros.scene.writing import in_yaml

SWITCH = ['true', 'false', 'True', 'False']

# Name, default, and description.
ARGUMENTS = (
    ('robot', None, 'MJCF, SDF or URDF of the robot.'),
    ('scene', None, 'What from_robot has printed of it.'),
    ('loops', '', 'Its file of loops, if it has one.'),
    ('hold', '', 'Joints that stay, as in "spring=0.1 other=0".'),
    ('simulated', 'true', 'Whether crank_driver simulates the motors; false: the robot has them.'),
)
# Motors and passive joints are on one topic, as robot_state_publisher wants them.
ON_JOINT_STATES = [('crank_states', 'joint_states')]


def generate_launch_description():
    """Return the arguments and what depends on them."""
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=default, description=description,
                                choices=SWITCH if default in SWITCH else None)
          for name, default, description in ARGUMENTS),
        OpaqueFunction(function=_started)])


def _started(context):
    chosen = {name: LaunchConfiguration(name).perform(context) for name, *_ in ARGUMENTS}
    shown = scene.load(chosen['scene'])
    robot = readers.read(chosen['robot'], chosen['loops'] or None)
    held = cli.positions(shlex.split(chosen['hold']))
    files = [chosen['scene']]
    rest, lost = cli.others(robot, shown.mechanisms, held)
    if rest:
        # The last file says which mechanisms there are.
        file = Path(tempfile.mkdtemp()) / 'others.yaml'
        file.write_text(in_yaml(rest))
        files.append(str(file))
    text = ParameterValue(readers.description(chosen['robot'], robot), value_type=str)
    reports = [LogInfo(msg=f'robot.launch.py: {line}') for line in lost]
    is_simulated = IfCondition(LaunchConfiguration('simulated')).evaluate(context)
    nodes = ('kinematics', 'crank_driver') if is_simulated else ('kinematics',)
    return [*reports,
            Node(package='robot_state_publisher', executable='robot_state_publisher',
                 parameters=[{'robot_description': text, 'publish_frequency': 100.0}]),
            *(Node(package='linkage_ros', executable=name, parameters=files,
                   remappings=ON_JOINT_STATES) for name in nodes)]
