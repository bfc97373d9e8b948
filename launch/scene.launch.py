# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Bring up a scene: its nodes, and what it is looked at with.

    ros2 launch linkage_ros scene.launch.py scene:=strandbeest rviz:=true
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.logging import launch_config
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from linkage_ros import rviz, scene, urdf
import yaml

PACKAGE = 'linkage_ros'
NODES = ('crank_driver', 'kinematics', 'servo_inverse')
VIEWER = 'viewer'
RVIZ_CONFIG = 'linkage.rviz'
SWITCH = ('true', 'false')

# Name, default, what it may be besides, and what it does.
ARGUMENTS = (
    ('scene', 'all', None, 'Scene: a name in config/ without its ending, or the path of a file.'),
    ('namespace', '', None, 'Namespace of all nodes and topics.'),
    ('viewer', 'true', SWITCH, 'Whether to serve the page with the picture and the sliders.'),
    ('port', '8020', None, "Port of the viewer's page; 0: any that is free."),
    ('rviz', 'false', SWITCH, 'Whether to start RViz.'),
    ('robot_model', 'false', SWITCH,
     'Whether to start a robot_state_publisher for each mechanism, for frames and robot models.'),
    ('use_sim_time', 'false', SWITCH, 'Whether time comes from the topic /clock.'),
)


def generate_launch_description():
    """Return the arguments and what depends on them."""
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=default, choices=choices,
                                description=description)
          for name, default, choices, description in ARGUMENTS),
        OpaqueFunction(function=_started),
    ])


def _started(context):
    chosen = {name: LaunchConfiguration(name).perform(context) for name, *_ in ARGUMENTS}
    wanted = {name for name, value in chosen.items() if value == 'true'}
    share = Path(get_package_share_directory(PACKAGE))
    path = _scene_path(share, chosen['scene'])
    shown = scene.load(str(path))
    common = {'namespace': chosen['namespace'], 'output': 'screen'}
    time = {'use_sim_time': 'use_sim_time' in wanted}
    # First what may not be installed: then nothing is left running.
    nodes = []
    if 'robot_model' in wanted:
        nodes += [_robot(machine, shown.frame_id, chosen['namespace'], time)
                  for machine in shown.machines.values()]
    if 'rviz' in wanted:
        config = rviz.adapted(
            yaml.safe_load((share / 'config' / RVIZ_CONFIG).read_text()), shown.machines,
            shown.frame_id, chosen['namespace'], 'robot_model' in wanted)
        # Among the logs of this launch, so that nothing is left behind elsewhere.
        adapted = Path(launch_config.log_dir, RVIZ_CONFIG)
        adapted.write_text(yaml.safe_dump(config))
        nodes.append(Node(package='rviz2', executable='rviz2', arguments=['-d', str(adapted)],
                          parameters=[time], **common))
    if 'viewer' in wanted:
        nodes.append(Node(package=PACKAGE, executable=VIEWER,
                          parameters=[{'port': int(chosen['port'])}], **common))
    return nodes + [Node(package=PACKAGE, executable=name, parameters=[str(path), time], **common)
                    for name in NODES]


def _scene_path(share, name):
    path = Path(name)
    if not path.suffix and not path.is_file():
        path = share / 'config' / f'{name}.yaml'
    if not path.is_file():
        names = ', '.join(sorted(p.stem for p in (share / 'config').glob('*.yaml')))
        raise RuntimeError(f'scene must be one of {names}, or the path of a file, not {name}')
    return path


def _robot(machine, frame_id, namespace, time):
    """Return what moves the model of a mechanism by its joint states."""
    text = ParameterValue(urdf.describe([machine], frame_id), value_type=str)
    return Node(
        package='robot_state_publisher', executable='robot_state_publisher',
        namespace=f'{namespace}/{machine.name}', output='screen',
        parameters=[{'robot_description': text, 'publish_frequency': 100.0}, time],
        # The model itself is offered by kinematics, which keeps it up to date.
        remappings=[('robot_description', '~/robot_description')])
