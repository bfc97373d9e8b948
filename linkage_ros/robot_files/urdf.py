# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Robots in URDF, with the ways in which tools write the loops that it has no word for.

Sources: https://wiki.ros.org/urdf/XML; urdfdom #264 (`constraint`); RigidBodyDynamics.jl, Isaac
Sim and Drake (`loop_joint`, `drake:`); URDF+ of generalized_rbda (`loop`); Gazebo's tutorial on
kinematic loops (`gazebo`); onshape-to-robot's documentation (`closing_`); example-parallel-robots
(`closed_loop`); solidworks_urdf_exporter2 (`closures`); Robonex (`pin_loops`, `ball_loops`).
"""

from __future__ import annotations

import re
from typing import Any, Dict, List, Mapping, Tuple

import numpy as np

from .elements import at, attribute, Element, numbers, once, origin, pose, text
from .robot import BALL, FIXED, HINGE, Robot, UNIVERSAL
from ..command import RequestError
from ..words import meant

# What a file of loops has one of.
LOOPS = ('closures', 'closed_loop', 'pin_loops', 'ball_loops')
_CLOSING = re.compile(r'(?P<name>.*closing_.+)_(?P<end>[12])')
_TYPES = {'6d': FIXED, '3d': BALL}


class Reader:
    """
    Reads a URDF.

    Attributes
    ----------
    robot : Robot
        The robot, with the loops that are in its file.

    """

    def __init__(self, root: Element):
        self._root = root
        links = once((link.get('name', ''), link) for link in root.findall('link'))
        joints = once((attribute(joint, 'child', 'link'), joint)
                      for joint in root.findall('joint'))
        names = [*links]
        if 'world' not in names and any(
                attribute(joint, 'parent', 'link') == 'world' for joint in joints.values()):
            names.append('world')
        for child, joint in joints.items():
            for end in (attribute(joint, 'parent', 'link'), child):
                if end not in names:
                    raise RequestError(f'joint {joint.get("name")} is on {end!r}, which is no '
                                       'link')
        tops = [link for link in names if link not in joints]
        if len(tops) != 1:
            raise RequestError(f'a URDF has one root link, not {len(tops)}')
        robot = self.robot = Robot(tops[0], {tops[0]: np.eye(4)})
        below: Dict[str, List[str]] = {}
        for child, joint in joints.items():
            below.setdefault(attribute(joint, 'parent', 'link'), []).append(child)
        row = [tops[0]]
        for link in row:
            for child in below.get(link, ()):
                robot.frames[child] = robot.frames[link] @ origin(joints[child].find('origin'))
                row.append(child)
        if lost := [link for link in names if link not in robot.frames]:
            raise RequestError(f'{lost[0]} hangs on itself')
        self._joint_frames = {joint.get('name', ''): child for child, joint in joints.items()}
        self._frames = {frame.get('name', ''): frame for frame in root.findall('frame')}
        for child, joint in joints.items():
            self._tree_joint(joint, child)
        self._of_elements()
        self._of_frames()
        self._of_gazebo()
        robot.driven = [joint.get('name', '') for joint in (
            *root.findall('transmission/joint'),
            *root.findall('ros2_control/joint[command_interface]'))]

    def _tree_joint(self, joint: Element, child: str) -> None:
        robot, name, mimic = self.robot, joint.get('name', ''), joint.find('mimic')
        robot.join(name, joint.get('type', ''), (attribute(joint, 'parent', 'link'), child),
                   robot.frames[child], numbers(attribute(joint, 'axis', 'xyz', '1 0 0')), None,
                   0.0, [attribute(joint, 'limit', end) for end in ('lower', 'upper')])
        if mimic is not None:
            ratio, start = numbers(f'{mimic.get("multiplier", 1)} {mimic.get("offset", 0)}', 2)
            robot.follow(name, mimic.get('joint', ''), ratio, start)

    def frame(self, name: str) -> Tuple[str, np.ndarray]:
        """Return the link that a frame is on, which is called as a link, a joint or by itself."""
        if name in self._frames:
            link = self._frames[name].get('link', '')
            return link, self._on(link, origin(self._frames[name]))
        link = name if name in self.robot.frames else self._joint_frames.get(name, name)
        return link, self._on(link, np.eye(4))

    def _on(self, link: str, own: np.ndarray) -> np.ndarray:
        if link not in self.robot.frames:
            raise RequestError(f'a loop is closed on {link!r}, which is no link')
        return self.robot.frames[link] @ own

    def _close(self, name: str, kind: str, ends: Tuple[str, str], own: Any, axis: Any,
               other_axis: Any = None) -> None:
        """Add what closes a loop, by its frames on two links, and its axis in them."""
        first, second = (self._on(link, frame) for link, frame in zip(ends, own))
        self.robot.join(name, kind, ends, first, axis, second,
                        second=None if other_axis is None else self._on(
                            ends[1], np.eye(4))[:3, :3] @ _unit(other_axis))

    def _of_elements(self) -> None:
        """Add the loops that elements of the URDF close."""
        for cut in (*self._root.findall('constraint'), *self._root.findall('loop_joint'),
                    *self._root.findall('loop')):
            name, kind = cut.get('name', ''), cut.get('type', '')
            tags = next((tags for tags in (('link1', 'link2'), ('predecessor', 'successor'))
                         if cut.find(tags[0]) is not None), ('parent', 'child'))
            ends = attribute(cut, tags[0], 'link'), attribute(cut, tags[1], 'link')
            own = []
            for tag in tags:
                part = cut.find(f'{tag}_origin')
                part = cut.find(f'{tag}/origin') if part is None else part
                own.append(origin(cut.find(tag) if part is None and tag == 'link1'
                                  or tag == 'link2' else part))
            axis = attribute(cut, 'parent_axis', 'xyz', attribute(cut, 'axis', 'xyz', '0 0 1'))
            other = attribute(cut, 'child_axis', 'xyz')
            if 'parent_axis' in {part.tag for part in cut}:
                turned = self._on(ends[0], own[0])[:3, :3].T @ self._on(ends[0], np.eye(4))[:3, :3]
                axis = ' '.join(map(repr, map(float, turned @ numbers(axis))))
            self._close(name, kind, ends, own, numbers(axis), numbers(other) if other else None)
        for cut in self._root.findall('ball_constraint'):
            one, other = (attribute(cut, f'ball_constraint_body_{end}', 'name') for end in 'AB')
            own = [at(numbers(attribute(cut, f'ball_constraint_p_{end}', 'value', '0 0 0')))
                   for end in ('AP', 'BQ')]
            self._close(f'{one}={other}', BALL, (one, other), own, (0.0, 0.0, 1.0))
        for cut in self._root.findall('linear_bushing_rpy'):
            names = [attribute(cut, f'bushing_frame{end}', 'name') for end in 'AC']
            stiff = numbers(attribute(cut, 'bushing_torque_stiffness', 'value', '0 0 0'))
            self._pair(names[0], names[1], FIXED if stiff.all() else BALL)

    def _pair(self, first: str, second: str, kind: str) -> None:
        (one, start), (other, end) = self.frame(first), self.frame(second)
        self.robot.join(f'{first}={second}', kind, (one, other), start, other=end)

    def _of_frames(self) -> None:
        """Add the loops that frames called closing_NAME_1 and closing_NAME_2 close."""
        names = [*self.robot.frames, *self._frames]
        for name in names:
            match = _CLOSING.fullmatch(name)
            if not match or match['end'] == '2' or (other := f'{match["name"]}_2') not in names:
                continue
            (one, start), (two, end) = self.frame(name), self.frame(other)
            if {f'{name}_z', f'{other}_z'} <= {*names}:
                axis = self.frame(f'{name}_z')[1][:3, 3] - start[:3, 3]
                second = self.frame(f'{other}_z')[1][:3, 3] - end[:3, 3]
                self.robot.join(match['name'], HINGE, (one, two), start, start[:3, :3].T @ axis,
                                end, second=_unit(second))
            else:
                self.robot.join(match['name'], BALL, (one, two), start, other=end)

    def _of_gazebo(self) -> None:
        """Add the joints that are added to the model once Gazebo has made SDF of it."""
        for cut in self._root.findall('gazebo/joint'):
            one, other = (attribute(cut, tag, 'link') or text(cut, tag)
                          for tag in ('parent', 'child'))
            frame = self._on(other, pose(*numbers(text(cut, 'pose', '0 0 0 0 0 0'), 6)))
            axis = numbers(text(cut, 'axis/xyz') or attribute(cut, 'axis', 'xyz', '0 0 1'))
            if text(cut, 'axis/use_parent_model_frame') in ('1', 'true'):
                axis = frame[:3, :3].T @ axis
            kind = cut.get('type', '')
            second = frame[:3, :3] @ numbers(text(cut, 'axis2/xyz', '0 0 1'))
            self.robot.join(cut.get('name', ''), kind, (one, other), frame, axis,
                            second=second if kind == UNIVERSAL else None)
        for plugin in self._root.findall('gazebo/plugin'):
            if 'detachable' in f'{plugin.get("name")} {plugin.get("filename")}'.lower():
                one, other = (text(plugin, tag) for tag in ('parent_link', 'child_link'))
                self.robot.join(f'{one}={other}', FIXED, (one, other), self._on(one, np.eye(4)))

    def of_file(self, loops: Mapping[str, Any]) -> None:
        """Add the loops of another file."""
        for i, cut in enumerate(loops.get('closures', ())):
            point, axis = (_vector(cut[key]) for key in ('point', 'axis'))
            self.robot.join(f'closures[{i}]', HINGE, (cut['link_a'], cut['link_b']), at(point),
                            axis, at(point))
        types = loops.get('type', ())
        for i, (first, second) in enumerate(loops.get('closed_loop', ())):
            kind = str(types[i] if i < len(types) else '6d').lower()
            self._pair(first, second, _TYPES.get(kind, kind))
        for key, kind in (('pin_loops', HINGE), ('ball_loops', BALL)):
            for i, cut in enumerate(loops.get(key, ())):
                own = [at(_vector(cut.get(f'{end}_xyz', (0, 0, 0)))) for end in (
                    'parent', 'child')]
                axis = _vector(cut.get('axis', (0, 0, 1)))
                self._close(str(cut.get('name', f'{key}[{i}]')), kind,
                            (cut['parent'], cut['child']), own, axis)
        changes = [*zip(loops.get('joint_name', ()), loops.get('joint_type', ())),
                   *((name, 'SPHERICAL') for name in loops.get('ball_upgrades', ()))]
        for name, kind in changes:
            self._change(name, str(kind).upper())
        # What it says of motors is of the closed robot, transmissions are of the open tree.
        self.robot.driven = [name for key in ('independent', 'name_mot', 'actuated_joints')
                             for name in loops.get(key, ())] or self.robot.driven

    def _change(self, name: str, kind: str) -> None:
        """Change the type of a joint of the tree, with axes in its frame."""
        joint = next((joint for joint in self.robot.joints if joint.name == name), None)
        if joint is None:
            names = [joint.name for joint in self.robot.joints]
            raise RequestError(f'there is no joint {name!r} to be made {kind}{meant(name, names)}')
        joint.position, joint.limits = None, None
        joint.kind = {'SPHERICAL': BALL, 'FIXED': FIXED}.get(kind, kind)
        if kind.startswith('UJOINT'):
            self.robot.joints.remove(joint)
            first, second = ('XYZ'.index(x) for x in kind[-2:])
            self.robot.join(name, UNIVERSAL, joint.bodies, at(joint.places[0], joint.turns[0]),
                            np.eye(3)[first], second=joint.turns[0][:, second])


def _vector(said: Any) -> np.ndarray:
    return numbers(said if isinstance(said, str) else ' '.join(map(str, said)))


def _unit(axis: Any) -> np.ndarray:
    return np.asarray(axis) / (np.linalg.norm(axis) or 1.0)
