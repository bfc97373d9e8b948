# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""
Bring up a scene: its nodes, and what it is looked at with.

    ros2 launch linkage_ros scene.launch.py scene:=strandbeest rviz:=true
"""

from pathlib import Path
import re

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction
from launch.logging import launch_config
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from linkage_ros import scene
from linkage_ros.optional import needs
from linkage_ros.robot_model import rviz, urdf
from linkage_ros.words import meant
import yaml

PACKAGE = 'linkage_ros'
NODES = ('crank_driver', 'kinematics', 'servo_inverse')
TOGETHER = ('scene',)
VIEWER = 'viewer'
RVIZ_CONFIG = 'linkage.rviz'
# Without a robot model nothing else publishes a transform, and RViz would know of no frame.
FRAME = 'linkages'
YES, NO = ('true', '1', 'yes', 'on'), ('false', '0', 'no', 'off')
LARGEST_PORT = 65535

# Name, default, and what it does.
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
        *(DeclareLaunchArgument(name, default_value=default, description=description)
          for name, default, description in ARGUMENTS),
        OpaqueFunction(function=_started),
    ])


def _started(context):
    chosen = {name: LaunchConfiguration(name).perform(context) for name, *_ in ARGUMENTS}
    apart, viewer, rviz_wanted, robot_model, use_sim_time = (
        switched(name, chosen[name])
        for name in ('apart', 'viewer', 'rviz', 'robot_model', 'use_sim_time'))
    listens = listening(chosen['port'])
    share = Path(get_package_share_directory(PACKAGE))
    path = _scene_path(share, chosen['scene'])
    shown = scene.load(str(path))
    prefix = chosen['frame_prefix'].strip('/')
    prefix = f'{prefix}/' if prefix else shown.frame_prefix
    common = {'namespace': chosen['namespace'], 'output': 'screen'}
    time = {'use_sim_time': use_sim_time}
    # First what may not be installed: then nothing is left running.
    nodes = []
    if robot_model:
        nodes += [_robot(machine, shown.frame_id, chosen['namespace'], prefix, time)
                  for machine in shown.machines.values()]
    if rviz_wanted:
        config = rviz.adapted(
            yaml.safe_load((share / 'config' / RVIZ_CONFIG).read_text()), shown.machines,
            shown.frame_id, chosen['namespace'], robot_model, prefix)
        # Among the logs of this launch, so that nothing is left behind elsewhere.
        adapted = Path(launch_config.log_dir, RVIZ_CONFIG)
        adapted.write_text(yaml.safe_dump(config))
        nodes.append(Node(package='rviz2', executable='rviz2', arguments=['-d', str(adapted)],
                          parameters=[time], **common))
    if prefix and (robot_model or rviz_wanted):
        nodes.append(_transform(shown.frame_id, prefix + shown.frame_id, time, common))
    elif rviz_wanted and not robot_model:
        nodes.append(_transform(shown.frame_id, FRAME, time, common))
    if viewer:
        nodes.append(_viewer(listens, common))
    return nodes + [Node(package=PACKAGE, executable=name, **common,
                         parameters=[str(path), time, {'frame_prefix': prefix}])
                    for name in (NODES if apart else TOGETHER)]


def switched(name, text):
    """Return whether an argument is true; raise RuntimeError if it is neither true nor false."""
    word = text.strip().lower()
    if word not in YES + NO:
        raise RuntimeError(f'{name} must be true or false, not {text!r}')
    return word in YES


def numbered(name, text):
    """Return the number of a port; raise RuntimeError if it is none."""
    if not re.fullmatch(r'\s*[0-9]{1,5}\s*', text) or int(text) > LARGEST_PORT:
        raise RuntimeError(f'{name} must be a whole number from 0 to {LARGEST_PORT}, not {text!r}')
    return int(text)


def listening(port):
    """Return where the viewer listens, as its parameters."""
    # A viewer of another namespace has the usual port, or is about to.
    return {'port': numbered('port', port)} if port else {'or_any_port': True}


def _transform(frame, child, time, common):
    """Return what says that a frame is where another is."""
    return Node(package='tf2_ros', executable='static_transform_publisher', parameters=[time],
                arguments=['--frame-id', frame, '--child-frame-id', child], **common)


def _viewer(listens, common):
    """Return what serves the page, or what says why that cannot be."""
    try:
        with needs('aiohttp'):
            from aiohttp import web  # noqa: F401
    except ImportError as error:
        return LogInfo(msg=f'The viewer is left out: {error}.')
    return Node(package=PACKAGE, executable=VIEWER, parameters=[listens], **common)


def _scene_path(share, name):
    path = Path(name)
    if not path.suffix and not path.is_file():
        path = share / 'config' / f'{name}.yaml'
    if not path.is_file():
        names = ', '.join(sorted(p.stem for p in (share / 'config').glob('*.yaml')))
        raise RuntimeError(f'scene must be one of {names}, or the path of a file, not {name}'
                           f'{meant(name, names.split(", "))}')
    return path


def _robot(machine, frame_id, namespace, prefix, time):
    """Return what moves the model of a mechanism by its joint states."""
    text = ParameterValue(urdf.describe([machine], frame_id), value_type=str)
    return Node(
        package='robot_state_publisher', executable='robot_state_publisher',
        namespace=f'{namespace}/{machine.name}', output='screen',
        parameters=[{'robot_description': text, 'publish_frequency': 100.0,
                     'frame_prefix': prefix}, time],
        # The model itself is offered by kinematics, which keeps it up to date.
        remappings=[('robot_description', '~/robot_description')])
