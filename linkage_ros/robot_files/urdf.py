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

from graphlib import TopologicalSorter
import re
from typing import Any, Sequence
from xml.etree.ElementTree import Element

import numpy as np

from . import sdf
from .sdf import attribute, numbers, once
from ..cli import RequestError
from ..robot_model.robot import at, BALL, FIXED, HINGE, pose, Robot, UNIVERSAL
from ..words import join_names, short_repr, suggestion

# The keys of a file of loops that name its motors, and all; the last two have no effect.
_MOTORS = ('independent', 'name_mot', 'actuated_joints')
_KEYS = ('closures', 'closed_loop', 'pin_loops', 'ball_loops', 'type', 'joint_name', 'joint_type',
         'ball_upgrades', *_MOTORS, 'dependent', 'ball_limit_deg')
_CLOSING = re.compile(r'(?P<name>.*closing_.+)_1')


def read(root: Element) -> Robot:
    """Return the robot in a URDF, with the loops that its elements close."""
    links = once((link.get('name', ''), link) for link in root.findall('link'))
    joints = once((attribute(joint, 'child', 'link'), joint) for joint in root.findall('joint'))
    bases = {child: attribute(joint, 'parent', 'link') for child, joint in joints.items()}
    # Drake's ground needs no link, and a link of its name no joint.
    grounds = {*links} - {'world'} | {'world'}.intersection(bases.values())
    roots = sorted(link for link in grounds if link not in joints)
    if len(roots) != 1:
        raise RequestError(f'a URDF has one root link, not {join_names(roots, 200)}')
    robot = Robot(roots[0], {roots[0]: np.eye(4)})
    for link in TopologicalSorter({link: [base] for link, base in bases.items()}).static_order():
        if link in joints and link in links:
            robot.frames[link] = robot.frames[bases[link]] @ _origin(joints[link])
    for child, joint in joints.items():
        name, mimic, limit = joint.get('name', ''), joint.find('mimic'), joint.find('limit')
        robot.join(name, joint.get('type', ''), (bases[child], child), robot.frames[child],
                   numbers(attribute(joint, 'axis', 'xyz', '1 0 0')), position=0.0,
                   limits=('-inf', 'inf') if limit is None else (
                       limit.get('lower', '0'), limit.get('upper', '0')))
        if mimic is not None:
            ratio, start = numbers(f'{mimic.get("multiplier", 1)} {mimic.get("offset", 0)}', 2)
            robot.follow(name, mimic.get('joint', ''), ratio, start)
    if 'world' in links and 'world' not in robot.frames:
        robot.add_body('world', robot.root, [0.0] * 6)
    _close_by_elements(robot, root)
    _close_by_frames(robot)
    sdf.join(robot, root.findall('gazebo/joint'))
    for part in root.findall('gazebo'):
        sdf.obey(robot, part)
    robot.driven += [joint.get('name', '') for joint in (
        *root.findall('transmission/joint'),
        *root.findall('ros2_control/joint[command_interface]'))]
    # URDF+ says which joints are not independent.
    if not robot.driven and root.find('joint[@independent="false"]') is not None:
        robot.driven = [name for joint in joints.values() if joint.get(
            'independent') != 'false' and (name := joint.get('name', '')) in robot.positions]
    return robot


def _origin(part: Element) -> np.ndarray:
    """Return the pose in the attributes xyz and rpy of a part's origin, or of the part."""
    place = next(part.iterfind('origin'), part)
    return pose(*numbers(f'{place.get("xyz", "0 0 0")} {place.get("rpy", "0 0 0")}', 6))


def _pair(robot: Robot, name: str, kind: str, ends: Sequence[str], *axes: Any) -> None:
    """Close a loop by the frames of two links, each by its name or that of its joint."""
    links = {**{joint.name: joint.bodies[1] for joint in robot.joints},
             **{link: link for link in robot.frames}}
    robot.close(name, kind, (links[ends[0]], links[ends[1]]), [np.eye(4)] * 2, *axes)


def _close_by_elements(robot: Robot, root: Element) -> None:
    for tag, *words in (('loop_joint', 'link1', 'link2'), ('loop', 'predecessor', 'successor')):
        for cut in root.findall(tag):
            # An example of Isaac Sim has an empty end first.
            parts = [part for word in words if (part := cut.find(f'{word}[@link]')) is not None]
            if len(parts) < 2:
                raise RequestError(f'{tag} {cut.get("name")} must have {" and ".join(words)}')
            robot.close(cut.get('name', ''), cut.get('type', ''),
                        (parts[0].attrib['link'], parts[1].attrib['link']),
                        [*map(_origin, parts)], numbers(attribute(cut, 'axis', 'xyz', '0 0 1')))
    for cut in root.findall('ball_constraint'):
        ends = [attribute(cut, f'ball_constraint_body_{end}', 'name') for end in 'AB']
        robot.close('='.join(ends), BALL, (ends[0], ends[1]), [
            at(numbers(attribute(cut, f'ball_constraint_p_{end}', 'value', '0 0 0')))
            for end in ('AP', 'BQ')])
    frames = {frame.get('name', ''): (frame.get('link', ''), _origin(frame))
              for frame in root.findall('frame')}
    for cut in root.findall('linear_bushing_rpy'):
        ends = [attribute(cut, f'bushing_frame{end}', 'name') for end in 'AC']
        (link, start), (other, stop) = (frames.get(end, (end, np.eye(4))) for end in ends)
        stiff = numbers(attribute(cut, 'bushing_torque_stiffness', 'value', '0 0 0'))
        robot.close('='.join(ends), FIXED if stiff.all() else BALL, (link, other), [start, stop])


def _close_by_frames(robot: Robot) -> None:
    """Add the loops that links called closing_NAME_1 and closing_NAME_2 close."""
    frames = robot.frames
    for match in filter(None, map(_CLOSING.fullmatch, [*frames])):
        ends = match[0], f'{match["name"]}_2'
        if ends[1] in frames:
            axes = [np.linalg.solve(frames[end], frames[f'{end}_z'])[:3, 3] for end in ends
                    if f'{end}_z' in frames]
            _pair(robot, match['name'], HINGE if len(axes) == 2 else BALL, ends, *axes)


def close(robot: Robot, loops: Any) -> None:
    """Add the loops of another file; raise RequestError for a key or a motor that is not known."""
    for key in loops if isinstance(loops, dict) else [loops]:
        if key not in _KEYS:
            raise RequestError(f'there is no key {short_repr(key)}{suggestion(key, _KEYS, 200)}')
        if key != 'ball_limit_deg' and not isinstance(loops[key], list):
            raise RequestError(f'{key} must be a list, not {short_repr(loops[key])}')
    for i, cut in enumerate(loops.get('closures', ())):
        point = at(numbers(cut['point']))
        robot.join(f'closures[{i}]', HINGE, (cut['link_a'], cut['link_b']), point,
                   numbers(cut['axis']), point)
    pairs, names, kinds = (
        loops.get(key, ()) for key in ('closed_loop', 'joint_name', 'joint_type'))
    types = loops.get('type', [FIXED] * len(pairs))
    if len(pairs) != len(types) or len(names) != len(kinds):
        raise RequestError('type must have an entry for each of closed_loop, and joint_type one '
                           'for each of joint_name')
    for ends, kind in zip(pairs, types):
        if not isinstance(ends, list) or len(ends) != 2:
            raise RequestError(f'closed_loop must have pairs of names, not {short_repr(ends)}')
        _pair(robot, '='.join(ends), kind, ends)
    for key, kind in (('pin_loops', HINGE), ('ball_loops', BALL)):
        for i, cut in enumerate(loops.get(key, ())):
            robot.close(cut.get('name', f'{key}[{i}]'), kind, (cut['parent'], cut['child']),
                        [at(numbers(cut[f'{end}_xyz'])) for end in ('parent', 'child')],
                        numbers(cut['axis'] if kind == HINGE else '0 0 1'))
    for name, kind in (*zip(names, kinds),
                       *((name, BALL) for name in loops.get('ball_upgrades', ()))):
        _change(robot, name, kind.lower())
    # Its motors are those of the closed robot, transmissions those of the open tree.
    motors = [name for key in _MOTORS for name in loops.get(key, ())]
    robot.check_names(motors)
    robot.driven = motors or robot.driven


def _change(robot: Robot, name: str, kind: str) -> None:
    """Change the type of a joint of the tree; the axes of `UJOINT_XY` are in its frame."""
    joint = {joint.name: joint for joint in robot.joints}[name]
    if kind == FIXED and joint.position is not None:
        # The URDF still has it, so that its position is published.
        robot.held[name] = joint.position
        return
    first, second = (np.eye(3)['xyz'.index(axis)] for axis in kind[-2:]) \
        if kind.startswith('ujoint') else (np.eye(3)[2], None)
    robot.joints.remove(joint)
    robot.join(name, kind if second is None else UNIVERSAL, joint.bodies,
               robot.frames[joint.bodies[1]], first, second=second)
