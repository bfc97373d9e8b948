# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""RViz's configuration of a scene, adapted from that of the catalogue."""

import copy
import json
import math
from typing import Any, Iterable, Mapping

import numpy as np

from .robot import pose
from .shapes import input_values
from ..scene import SceneMechanism

GROUP = 'rviz_common/Group'
NEEDS_TRANSFORMS = ('rviz_default_plugins/RobotModel', 'rviz_default_plugins/TF')
# Distance of a camera with a view of 45 degrees that shows a ball of radius 1 with a margin.
DISTANCE = 1.1 / math.sin(math.radians(22.5))
# Downward angle [rad] of the camera on an upright plane, and on a flat one.
MIN_PITCH, MAX_PITCH = 0.15, 1.56
# A linkage in space is seen from the front, from the right and above, as on the viewer's page.
OBLIQUE = np.array([0.576, -0.768, 0.28])


def adapted(config: dict, mechanisms: Mapping[str, SceneMechanism], frame_id: str,
            namespace: str = '', robot_model: bool = False, frame_prefix: str = '') -> dict:
    """
    Return a configuration that shows mechanisms, and whose camera sees them all.

    `config` has one group of displays a mechanism, of the mechanism's name; the poses are in
    `frame_id`, the topics in `namespace`. `robot_model` enables displays that need a
    robot_state_publisher, whose frames begin with `frame_prefix`.
    """
    made = copy.deepcopy(config)
    manager = made['Visualization Manager']
    displays = manager['Displays']
    places = [i for i, display in enumerate(displays) if display['Class'] == GROUP]
    text, prefix = json.dumps(displays[places[0]]), f'/{namespace.strip("/")}/'.replace('//', '/')
    topic = f'"/{displays[places[0]]["Name"]}/'
    groups = [{**json.loads(text.replace(topic, f'"{prefix}{name}/')), 'Name': name}
              for name in mechanisms]
    displays[places[0]:places[-1] + 1] = groups
    manager['Global Options']['Fixed Frame'] = frame_id
    manager['Views']['Current'].update(_camera(mechanisms.values()))
    for display in displays + [display for group in groups for display in group['Displays']]:
        if display['Class'] in NEEDS_TRANSFORMS:
            display['Enabled'] = display['Value'] = robot_model
        if 'TF Prefix' in display:
            display['TF Prefix'] = frame_prefix.rstrip('/')
    return made


def _camera(mechanisms: Iterable[SceneMechanism]) -> dict[str, Any]:
    """Return a camera that sees all places of the joints, square to the first one's plane."""
    clouds, normals = zip(*map(_seen, mechanisms))
    places, normal = np.concatenate(clouds), normals[0]
    low, high = places.min(axis=0), places.max(axis=0)
    pitch = np.clip(math.asin(np.clip(normal[2], -1.0, 1.0)), MIN_PITCH, MAX_PITCH)
    # Seen from above, x is to the right.
    yaw = math.atan2(*normal[1::-1]) if math.hypot(*normal[:2]) > 0.1 else -math.pi / 2
    return {'Distance': round(DISTANCE * float(np.linalg.norm(high - low)) / 2, 2) or 1.0,
            'Focal Point': {axis: round(float(middle), 2) + 0.0
                            for axis, middle in zip('XYZ', (low + high) / 2)},
            'Pitch': round(float(pitch), 6), 'Yaw': round(yaw % math.tau, 6)}


def _seen(mechanism: SceneMechanism) -> tuple[np.ndarray, np.ndarray]:
    """Return points that a mechanism's joints come to [m], (n, 3), and the way to the camera."""
    places = mechanism.scale * np.concatenate([
        place.reshape(-1, place.shape[-1]) for place in mechanism.linkage.solve(
            input_values(mechanism), mechanism.points).values()])
    places = places[np.isfinite(places).all(axis=1)]
    if mechanism.mirrored:
        places = np.concatenate([places, places * (-1.0, 1.0)])
    frame = pose(*mechanism.pose)
    normal = OBLIQUE if mechanism.in_space else frame[:3, 2]
    return places @ frame[:3, :places.shape[1]].T + frame[:3, 3], normal
