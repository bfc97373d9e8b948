# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Bring up a scene: its nodes, the viewer's page, and on request RViz and robot models.

    ros2 launch linkage_ros scene.launch.py scene:=strandbeest rviz:=true
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.conditions import IfCondition
from launch.logging import launch_config
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from linkage_ros import scene
from linkage_ros.robot_model import rviz, urdf
from linkage_ros.words import did_you_mean
import yaml

PACKAGE = 'linkage_ros'
NODES = ('crank_driver', 'kinematics', 'servo_inverse')
TOGETHER = ('scene',)
VIEWER = 'viewer'
RVIZ_CONFIG = 'linkage.rviz'
# Without a robot model nothing else publishes a transform, and RViz would know of no frame.
FRAME = 'linkages'
SWITCH = ['true', 'false', 'True', 'False']

# Name, default, and description.
ARGUMENTS = (
    ('scene', 'all', 'Scene: a name in config/ without its ending, or the path of a file.'),
    ('namespace', '', 'Namespace of all nodes and topics.'),
    ('apart', 'false', 'Whether each node is a process of its own.'),
    ('viewer', 'true', 'Whether to serve the page with the picture and the sliders.'),
    ('port', '', "Port of the viewer's page; 0: any that is free; empty: 8020, or any where that "
     'is taken, as by the viewer of another namespace.'),
    ('rviz', 'false', 'Whether to start RViz.'),
    ('robot_model', 'false',
     'Whether to start a robot_state_publisher for each mechanism, for frames and robot models.'),
    ('frame_prefix', '', "Put before all frames, as in left/; empty: the scene's."),
    ('use_sim_time', 'false', 'Whether time comes from the topic /clock.'),
)


def generate_launch_description():
    """Return the arguments and what depends on them."""
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=default, description=description,
                                choices=SWITCH if default in SWITCH else None)
          for name, default, description in ARGUMENTS),
        OpaqueFunction(function=_started),
    ])


def _started(context):
    text = {name: LaunchConfiguration(name).perform(context) for name, *_ in ARGUMENTS}
    has = {name: IfCondition(LaunchConfiguration(name)).evaluate(context)
           for name, default, _ in ARGUMENTS if default in SWITCH}
    share = Path(get_package_share_directory(PACKAGE))
    path = _scene_path(share, text['scene'])
    shown = scene.load(str(path))
    prefix = text['frame_prefix'].strip('/')
    prefix = f'{prefix}/' if prefix else shown.frame_prefix
    common = {'namespace': text['namespace'], 'output': 'screen'}
    time = {'use_sim_time': has['use_sim_time']}
    # First the packages that may not be installed: then nothing is left running.
    nodes = [_robot(mechanism, shown.frame_id, text['namespace'], prefix, time)
             for mechanism in shown.mechanisms.values() if has['robot_model']]
    if has['rviz']:
        config = rviz.adapted(
            yaml.safe_load((share / 'config' / RVIZ_CONFIG).read_text()), shown.mechanisms,
            shown.frame_id, text['namespace'], has['robot_model'], prefix)
        # Among the logs of this launch, so that nothing is left behind elsewhere.
        adapted = Path(launch_config.log_dir, RVIZ_CONFIG)
        adapted.write_text(yaml.safe_dump(config))
        nodes.append(Node(package='rviz2', executable='rviz2', arguments=['-d', str(adapted)],
                          parameters=[time], **common))
    if has['rviz'] and not has['robot_model'] or prefix and has['robot_model']:
        nodes.append(Node(
            package='tf2_ros', executable='static_transform_publisher', parameters=[time],
            arguments=['--frame-id', shown.frame_id, '--child-frame-id',
                       prefix + shown.frame_id if prefix else FRAME], **common))
    if has['viewer']:
        port = f'port:={text["port"]}' if text['port'] else 'or_any_port:=true'
        nodes.append(Node(package=PACKAGE, executable=VIEWER, ros_arguments=['-p', port],
                          **common))
    return nodes + [Node(package=PACKAGE, executable=name, **common,
                         parameters=[str(path), time, {'frame_prefix': prefix}])
                    for name in (NODES if has['apart'] else TOGETHER)]


def _scene_path(share, name):
    path = Path(name).expanduser()
    if not path.suffix and not path.is_file():
        path = share / 'config' / f'{name}.yaml'
    if not path.is_file():
        names = ', '.join(sorted(p.stem for p in (share / 'config').glob('*.yaml')))
        raise RuntimeError(f'scene must be one of {names}, or the path of a file, not {name}'
                           f'{did_you_mean(name, names.split(", "))}')
    return path


def _robot(mechanism, frame_id, namespace, prefix, time):
    """Return what moves the model of a mechanism by its joint states."""
    text = ParameterValue(urdf.describe([mechanism], frame_id), value_type=str)
    return Node(
        package='robot_state_publisher', executable='robot_state_publisher',
        namespace=f'{namespace}/{mechanism.name}', output='screen',
        parameters=[{'robot_description': text, 'publish_frequency': 100.0,
                     'frame_prefix': prefix}, time],
        # The model itself is offered by kinematics, which keeps it up to date.
        remappings=[('robot_description', '~/robot_description')])
