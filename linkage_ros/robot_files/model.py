# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A whole robot: its tree as URDF, and a mechanism of the joints that are in no loop."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict, Optional, Tuple
import xml.etree.ElementTree as ElementTree

import numpy as np

from . import readers
from .closing import posed
from .elements import at, parse
from .robot import HINGE, Robot, SLIDE
from .spatial import trees
from .. import scene
from ..scene.joint_names import quoted_name

OTHERS = 'others'


def description(path: str, loops: Optional[str] = None) -> str:
    """Return a robot as robot_state_publisher takes it: a URDF as it is, else its tree."""
    robot = readers.read(path, loops)
    return Path(path).read_text() if parse(path).tag == 'robot' else urdf(robot)


def urdf(robot: Robot) -> str:
    """Return the tree of a robot, all joints at zero where its URDF has them at zero."""
    names = {joint.name for _, joint in trees(robot)[0].values()}
    robot = posed(robot, {name: 0.0 for name in robot.positions if name in names})
    root = ElementTree.Element('robot', name='robot')
    ElementTree.SubElement(root, 'link', name=robot.root)
    for body, (base, joint) in trees(robot)[0].items():
        frame, seen = robot.frames[body], np.linalg.inv(robot.frames[base])
        if joint.kind not in (HINGE, SLIDE) or joint.position is None:
            _joint(root, f'{body}_fixed', 'fixed', base, body, seen @ frame)
            continue
        # In URDF the frame of a joint is that of its child.
        home = at(joint.place(base), frame[:3, :3])
        child = body if np.array_equal(home, frame) else f'{body}/joint'
        kind = 'prismatic' if joint.kind == SLIDE else 'revolute' if joint.limits else 'continuous'
        made = _joint(root, joint.name, kind, base, child, seen @ home)
        ElementTree.SubElement(made, 'axis', xyz=_text(home[:3, :3].T @ joint.motion(body)))
        if kind != 'continuous':
            low, high = joint.limits or (-math.inf, math.inf)
            ElementTree.SubElement(made, 'limit', lower=repr(max(low, -1e3)),
                                   upper=repr(min(high, 1e3)), effort='0', velocity='0')
        if child != body:
            _joint(root, f'{body}_fixed', 'fixed', child, body, np.linalg.inv(home) @ frame)
    return ElementTree.tostring(root, encoding='unicode')


def _joint(root: ElementTree.Element, name: str, kind: str, base: str, body: str,
           pose: np.ndarray) -> ElementTree.Element:
    ElementTree.SubElement(root, 'link', name=body)
    joint = ElementTree.SubElement(root, 'joint', name=name, type=kind)
    ElementTree.SubElement(joint, 'parent', link=base)
    ElementTree.SubElement(joint, 'child', link=body)
    ElementTree.SubElement(joint, 'origin', xyz=_text(pose[:3, 3]), rpy=_text(rpy(pose[:3, :3])))
    return joint


def _text(numbers: Any) -> str:
    return ' '.join(repr(float(number)) for number in numbers)


def rpy(turned: np.ndarray) -> Tuple[float, float, float]:
    """Return roll, pitch and yaw [rad] of a rotation matrix."""
    a, b = turned[:2, 0]
    yaw = math.atan2(b, a) if math.hypot(a, b) > 1e-9 else 0.0
    sin, cos = math.sin(yaw), math.cos(yaw)
    ahead, aside = turned[:2, 2], turned[:2, 1]
    return (math.atan2(sin * ahead[0] - cos * ahead[1], cos * aside[1] - sin * aside[0]),
            math.atan2(-turned[2, 0], cos * a + sin * b), yaw)


def others(robot: Robot, machines: Dict[str, scene.SceneMechanism], held: Dict[str, float]
           ) -> Dict[str, Any]:
    """Return the parameters of a mechanism of all joints that a scene does not publish."""
    known = {drive.source for machine in machines.values() for drive in machine.inputs.values()}
    known |= {called.name for machine in machines.values()
              for called in machine.joints.values() if called.published}
    left = [name for name in robot.positions if name not in known]
    given: Dict[str, Any] = {'joints': ['A ground 0 0', *(
        f'B{i} crank A 1' for i in range(len(left)))], 'type': 'custom', 'only_named': True}
    names = []
    for i, name in enumerate(left):
        own = f'crank{i + 1 if i else ""}'
        source, ratio, offset = robot.source(name)
        value = ratio * held.get(source, robot.positions[source]) + offset
        given.update({f'{own}.source': source, f'{own}.ratio': ratio, f'{own}.offset': offset,
                      f'{own}.start': held.get(name, value), f'{own}.speed': 0.0})
        if source != name:
            names.append(f'{own}={quoted_name(name)}')
    given['joint_names'] = names
    return {f'{OTHERS}.{key}': value for key, value in given.items()} if left else {}
