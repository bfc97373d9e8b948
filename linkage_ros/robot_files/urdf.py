# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Robots in URDF, with the ways in which tools write the loops that it has no word for.

Sources: https://wiki.ros.org/urdf/XML; RigidBodyDynamics.jl, Isaac Sim and Drake (`loop_joint`,
`drake:`); URDF+ of generalized_rbda (`loop`); Gazebo's tutorial on kinematic loops (`gazebo`);
onshape-to-robot's documentation (`closing_`); example-parallel-robots (`closed_loop`);
solidworks_urdf_exporter2 (`closures`); Robonex (`pin_loops`, `ball_loops`).
"""

from __future__ import annotations

import re
from typing import Any, Dict, Iterable, List, Mapping, Sequence, Tuple

import numpy as np

from .elements import attribute, Element, numbers, once, origin, text, weld
from ..command import RequestError
from ..robot_model.places import at, pose
from ..robot_model.robot import BALL, FIXED, HINGE, KINDS, Robot, UNIVERSAL
from ..words import listed, meant, quoted

_ENDS = ('name', 'parent', 'child', 'parent_xyz', 'child_xyz', 'axis')
# The kinds of loops in a loops file, and the keys of each loop.
LOOPS = {'closures': ('link_a', 'link_b', 'point', 'axis'), 'closed_loop': (),
         'pin_loops': _ENDS, 'ball_loops': _ENDS}
# All its keys; the last two have no effect.
_KEYS = (*LOOPS, 'type', 'joint_name', 'joint_type', 'independent', 'name_mot', 'dependent',
         'ball_limit_deg')
_CLOSING = re.compile(r'(?P<name>.*closing_.+)_1')
_NOWHERE = np.eye(4)


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
        bases = {child: attribute(joint, 'parent', 'link') for child, joint in joints.items()}
        names = {**links, **{base: None for base in bases.values() if base == 'world'}}
        below: Dict[str, List[str]] = {name: [] for name in names}
        for child, joint in joints.items():
            for end in (bases[child], child):
                if end not in names:
                    raise RequestError(f'joint {joint.get("name")} is on {end!r}, which is no '
                                       'link')
            below[bases[child]].append(child)
        # The ground of Drake, which hangs on nothing and has no joints.
        row = [link for link in names if link not in joints and (link != 'world' or below[link])]
        if len(row) != 1:
            raise RequestError(f'a URDF has one root link, not {len(row)}')
        robot = self.robot = Robot(row[0], {row[0]: np.eye(4)})
        for link in row:
            for child in below[link]:
                robot.frames[child] = robot.frames[link] @ origin(joints[child].find('origin'))
            row += below[link]
        if lost := [link for link in names if link not in robot.frames and link in joints]:
            raise RequestError(f'{lost[0]} hangs on itself')
        # The link of each frame, and its pose on the link.
        self._frames = {link: (link, _NOWHERE) for link in robot.frames}
        self._frames.update((frame.get('name', ''), (frame.get('link', ''), origin(frame)))
                            for frame in root.findall('frame'))
        self._children = {joint.get('name', ''): child for child, joint in joints.items()}
        if 'world' in names and 'world' not in robot.frames:
            robot.frames['world'] = robot.frames[row[0]]
            robot.join('', FIXED, (row[0], 'world'), robot.frames['world'])
        for child, joint in joints.items():
            self._tree_joint(joint, (bases[child], child))
        self._of_elements()
        self._of_frames()
        self._of_gazebo()
        robot.driven = [joint.get('name', '') for joint in (
            *root.findall('transmission/joint'),
            *root.findall('ros2_control/joint[command_interface]'))]
        # URDF+ says which joints are not independent.
        if not robot.driven and root.find('joint[@independent="false"]') is not None:
            robot.driven = [name for joint in joints.values() if joint.get(
                'independent') != 'false' and (name := joint.get('name', '')) in robot.positions]

    def _tree_joint(self, joint: Element, ends: Tuple[str, str]) -> None:
        name, mimic, limit = joint.get('name', ''), joint.find('mimic'), joint.find('limit')
        self.robot.join(
            name, joint.get('type', ''), ends, self.robot.frames[ends[1]],
            numbers(attribute(joint, 'axis', 'xyz', '1 0 0')), position=0.0,
            limits=('-inf', 'inf') if limit is None else (
                limit.get('lower', '0'), limit.get('upper', '0')))
        if mimic is not None:
            ratio, start = numbers(f'{mimic.get("multiplier", 1)} {mimic.get("offset", 0)}', 2)
            self.robot.follow(name, mimic.get('joint', ''), ratio, start)

    def _pair(self, name: str, kind: str, frames: Tuple[str, str], *axes: Any) -> None:
        """Close a loop by two frames, each by its name or that of a link or a joint."""
        (one, start), (other, end) = (
            self._frames.get(frame) or self._frames[self._children[frame]] for frame in frames)
        self.robot.close(name, kind, (one, other), (start, end), *axes)

    def _of_elements(self) -> None:
        """Add the loops that elements of the URDF close."""
        for tag, ends in (('loop_joint', ('link1', 'link2')), (
                'loop', ('predecessor', 'successor'))):
            for cut in self._root.findall(tag):
                # An example of Isaac Sim has an empty end first.
                parts = [part for end in ends if (part := cut.find(f'{end}[@link]')) is not None]
                if len(parts) < 2:
                    raise RequestError(f'{tag} {cut.get("name")} has no {ends[0]} or {ends[1]}')
                self.robot.close(
                    cut.get('name', ''), cut.get('type', ''),
                    (parts[0].attrib['link'], parts[1].attrib['link']),
                    [origin(part if part.find('origin') is None else part.find('origin'))
                     for part in parts], numbers(attribute(cut, 'axis', 'xyz', '0 0 1')))
        for cut in self._root.findall('ball_constraint'):
            one, other = (attribute(cut, f'ball_constraint_body_{end}', 'name') for end in 'AB')
            self.robot.close(f'{one}={other}', BALL, (one, other), [
                at(numbers(attribute(cut, f'ball_constraint_p_{end}', 'value', '0 0 0')))
                for end in ('AP', 'BQ')])
        for cut in self._root.findall('linear_bushing_rpy'):
            one, other = (attribute(cut, f'bushing_frame{end}', 'name') for end in 'AC')
            stiff = numbers(attribute(cut, 'bushing_torque_stiffness', 'value', '0 0 0'))
            self._pair(f'{one}={other}', FIXED if stiff.all() else BALL, (one, other))

    def _of_frames(self) -> None:
        """Add the loops that frames called closing_NAME_1 and closing_NAME_2 close."""
        for name in self._frames:
            match = _CLOSING.fullmatch(name)
            if not match or (other := f'{match["name"]}_2') not in self._frames:
                continue
            ends, axes = (name, other), []
            if {f'{end}_z' for end in ends} <= self._frames.keys():
                axes = [np.linalg.solve(*map(self._place, (end, f'{end}_z')))[:3, 3]
                        for end in ends]
            self._pair(match['name'], HINGE if axes else BALL, ends, *axes)

    def _place(self, frame: str) -> np.ndarray:
        link, own = self._frames[frame]
        return self.robot.frames[link] @ own

    def _of_gazebo(self) -> None:
        """Add the joints that Gazebo adds to the model."""
        for cut in self._root.findall('gazebo/joint'):
            one, other = (attribute(cut, tag, 'link') or text(cut, tag)
                          for tag in ('parent', 'child'))
            frame = self.robot.frames[other] @ pose(
                *numbers(text(cut, 'pose', '0 0 0 0 0 0'), 6))
            axis = numbers(text(cut, 'axis/xyz') or attribute(cut, 'axis', 'xyz', '0 0 1'))
            if text(cut, 'axis/use_parent_model_frame') in ('1', 'true'):
                axis = frame[:3, :3].T @ axis
            kind = cut.get('type', '')
            second = numbers(text(cut, 'axis2/xyz', '0 0 1')) if KINDS.get(
                kind, kind) == UNIVERSAL else None
            self.robot.join(cut.get('name', ''), kind, (one, other), frame, axis, second=second)
        weld(self.robot, self._root.findall('gazebo/plugin'))

    def of_file(self, loops: Mapping[str, Any]) -> None:
        """Add the loops of another file; raise RequestError for a key that is not known."""
        _check_keys('the file', loops, _KEYS)
        for key, allowed in LOOPS.items():
            for i, cut in enumerate(loops.get(key, ()) if allowed else ()):
                _check_keys(f'{key}[{i}]', cut, allowed)
        for i, cut in enumerate(loops.get('closures', ())):
            point = at(numbers(cut['point']))
            self.robot.join(f'closures[{i}]', HINGE, (cut['link_a'], cut['link_b']), point,
                            numbers(cut['axis']), point)
        types = loops.get('type', ())
        for i, (first, second) in enumerate(loops.get('closed_loop', ())):
            self._pair(f'{first}={second}', str(types[i] if i < len(types) else FIXED),
                       (first, second))
        for key, kind in (('pin_loops', HINGE), ('ball_loops', BALL)):
            for i, cut in enumerate(loops.get(key, ())):
                self.robot.close(
                    str(cut.get('name', f'{key}[{i}]')), kind, (cut['parent'], cut['child']),
                    [at(numbers(cut.get(f'{end}_xyz', '0 0 0'))) for end in ('parent', 'child')],
                    numbers(cut.get('axis', '0 0 1')))
        for name, kind in zip(loops.get('joint_name', ()), loops.get('joint_type', ())):
            self._change(name, str(kind).upper())
        # Its motors are those of the closed robot, transmissions those of the open tree.
        self.robot.driven = [*loops.get('independent', ()), *loops.get('name_mot', ())] \
            or self.robot.driven

    def _change(self, name: str, kind: str) -> None:
        """Change the type of a joint of the tree; the axes of `UJOINT_XY` are in its frame."""
        joint = next((joint for joint in self.robot.joints if joint.name == name), None)
        if joint is None:
            names = [joint.name for joint in self.robot.joints]
            raise RequestError(f'there is no joint {name!r} to be made {kind}{meant(name, names)}')
        if kind.startswith('UJOINT'):
            self.robot.joints.remove(joint)
            first, second = (np.eye(3)['XYZ'.index(way)] for way in kind[-2:])
            self.robot.join(name, UNIVERSAL, joint.bodies, at(joint.places[0], joint.turns[0]),
                            first, second=second)
        else:
            joint.kind = KINDS.get(kind.lower(), kind.lower())
            if joint.kind == FIXED and joint.position is not None:
                # The URDF still has it, so that its position is published.
                self.robot.held[name], joint.kind = joint.position, HINGE
            else:
                joint.position, joint.limits, joint.no_limits = None, None, ''


def _check_keys(where: str, given: Iterable[Any], allowed: Sequence[str]) -> None:
    for key in given:
        if key not in allowed:
            raise RequestError(f'{where} has no key {quoted(key)}; allowed: '
                               f'{listed(allowed, 200)}{meant(key, allowed)}')
