# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""RViz's configuration of any scene, made from the one that shows all of the catalogue."""

import copy
import json
from typing import Iterable

GROUP = 'rviz_common/Group'
NEEDS_TRANSFORMS = ('rviz_default_plugins/RobotModel', 'rviz_default_plugins/TF')


def adapted(config: dict, names: Iterable[str], frame_id: str, namespace: str = '',
            robot_model: bool = False, frame_prefix: str = '') -> dict:
    """
    Return a configuration that shows other mechanisms.

    Parameters
    ----------
    config : dict
        A configuration with one group of displays a mechanism, which bears its name.
    names : iterable of str
        The mechanisms to be shown.
    frame_id : str
        The frame that their poses are in.
    namespace : str
        What their topics begin with; empty: none.
    robot_model : bool
        Whether to show what needs a robot_state_publisher as well.
    frame_prefix : str
        What the robot_state_publishers put before the names of their frames.

    Returns
    -------
    dict

    """
    made = copy.deepcopy(config)
    manager = made['Visualization Manager']
    displays = manager['Displays']
    places = [i for i, display in enumerate(displays) if display['Class'] == GROUP]
    pattern = displays[places[0]]
    displays[places[0]:places[-1] + 1] = [_renamed(pattern, name, namespace) for name in names]
    manager['Global Options']['Fixed Frame'] = frame_id
    for display in _all(displays):
        if display['Class'] in NEEDS_TRANSFORMS:
            display['Enabled'] = display['Value'] = robot_model
        if 'TF Prefix' in display:
            display['TF Prefix'] = frame_prefix.rstrip('/')
    return made


def _renamed(group, name, namespace):
    start = f'/{namespace.strip("/")}/'.replace('//', '/')
    text = json.dumps(group).replace(f'"/{group["Name"]}/', f'"{start}{name}/')
    return {**json.loads(text), 'Name': name}


def _all(displays):
    for display in displays:
        yield display
        yield from _all(display.get('Displays', ()))
