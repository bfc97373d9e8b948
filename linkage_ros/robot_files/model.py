# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A whole robot: its tree as URDF, and a mechanism of the joints that are in no loop."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

from . import closing, readers
from .check import published
from .elements import parse
from .spatial import components
from .. import scene
from ..robot_model import bodies
from ..robot_model.robot import posed, Robot
from ..robot_model.urdf import write
from ..scene.joint_names import quoted_name

OTHERS = 'others'


def description(path: str, loops: Optional[str] = None) -> str:
    """Return a robot as robot_state_publisher takes it: a URDF as it is, else its tree."""
    robot = readers.read(path, loops)
    return Path(path).read_text() if parse(path).tag == 'robot' else write(drawn(robot))


def drawn(robot: Robot) -> bodies.Model:
    """Return the tree of a robot as a model that is written, its joints at zero."""
    names = {joint.name for _, joint in robot.spanning_tree()[0].values()}
    return bodies.Model('robot', robot.root, [bodies.Part(posed(robot, {
        name: 0.0 for name in robot.positions if name in names}))])


def not_published(names: Sequence[str]) -> str:
    """Return the report on joints that nothing determines."""
    return (f'Not published: {", ".join(names)}: passive joints of loops that no mechanism '
            'determines. What they carry has no transform.')


def others(robot: Robot, machines: Mapping[str, scene.SceneMechanism],
           held: Mapping[str, float]) -> Tuple[Dict[str, Any], List[str]]:
    """
    Return the parameters of a mechanism of all joints that a scene does not publish.

    Also return the joints that nothing determines: undriven ones in loops, and what follows them.
    `held` are positions of joints that stay.
    """
    held = {name: value for name, value in {**robot.held, **held}.items()
            if name in robot.positions}
    known = published(machines)
    loops = components(closing.held(robot, held))
    passive = {joint.name for component in loops for joint in component.joints}.difference(
        known, held, robot.driven)
    parameters: Dict[str, Any] = {}
    lines, names, lost = ['A ground 0 0'], [], []
    for name in [name for name in robot.positions if name not in known]:
        source, ratio, offset = (name, 1.0, 0.0) if name in held else robot.source(name)
        if source in passive:
            lost.append(name)
            continue
        crank = f'crank{len(lines) if len(lines) > 1 else ""}'
        value = ratio * held.get(source, robot.positions[source]) + offset
        parameters.update({
            f'{crank}.source': source, f'{crank}.ratio': ratio, f'{crank}.offset': offset,
            f'{crank}.start': value, f'{crank}.speed': 0.0})
        lines.append(f'B{len(lines)} crank A 1')
        if source != name:
            names.append(f'{crank}={quoted_name(name)}')
    parameters.update(type='custom', joints=lines, joint_names=names, only_named=True)
    parameters = {f'{OTHERS}.{key}': value for key, value in parameters.items()}
    return parameters if lines[1:] else {}, lost
