# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The planar loops of a robot, each in its plane."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple, Sequence

import numpy as np

from .spatial import ASKEW, CROSSING, lean, loops_of
from ..robot_model.robot import BALL, FIXED, HINGE, Joint, Robot, SLIDE

# Kinds of joints in planar loops.
FLAT = (HINGE, SLIDE, BALL)


class Group(NamedTuple):
    """Loops that share bars: ground, joints, why not planar, and planar parts."""

    ground: str
    joints: list[Joint]
    why: str
    parts: list['Group']


def groups(robot: Robot) -> list[Group]:
    """Return the loops of a robot, with their planar parts; bodies fixed to others are one."""
    # Whatever closes a loop joins bodies as all others do.
    robot = replace(robot, joints=[replace(joint, is_cut=False) for joint in robot.joints])
    fixed = [joint for joint in robot.joints if joint.kind == FIXED]
    home = {robot.root: robot.root}
    for body, (base, joint) in replace(robot, joints=fixed).spanning_tree()[0].items():
        home[body] = home[base] if joint.kind == FIXED else body
    # Several bodies that are one have the name of the first that a joint moves.
    names = {home[body]: body for joint in robot.joints[::-1] if joint.kind != FIXED
             for body in joint.bodies[::-1]}
    home = {body: names.get(first, first) for body, first in home.items()}
    joints = [replace(joint, bodies=(home[joint.bodies[0]], home[joint.bodies[1]]))
              for joint in robot.joints]
    robot = replace(robot, root=home[robot.root], joints=[
        joint for joint in joints if len({*joint.bodies}) == 2], frames={
        body: robot.frames[body] for body in home.values()})
    return [group._replace(parts=_parts(robot, group) if group.why else [group])
            for group in _groups(robot, _with_balls(robot))]


def _parts(robot: Robot, group: Group) -> list[Group]:
    """Return the planar parts of loops that are not planar as a whole."""
    parts: list[Group] = []
    left = group.joints
    for joint in group.joints:
        if joint.kind == HINGE and joint in left:
            flat = [other for other in left
                    if other.kind in FLAT and lean(other, joint.axes[0]) < ASKEW]
            parts += [part for part in _groups(robot, flat) if not part.why]
            left = [other for other in left if not any(other in part.joints for part in parts)]
    return parts


def _groups(robot: Robot, joints: list[Joint]) -> list[Group]:
    """Return the loops of some joints, those that share bars together."""
    tree, cuts = replace(robot, joints=joints).spanning_tree()
    groups = []
    for bodies, closing in loops_of(tree, cuts):
        edges = {tree[body][1] for body in bodies} | {*closing}
        # The parent of the first body is nearest to the root.
        ground = next(base for body, (base, _) in tree.items() if body in bodies)
        group = Group(ground, [joint for joint in joints if joint in edges], '', [])
        try:
            check_planar(ground, group.joints)
        except ValueError as error:
            group = group._replace(why=str(error))
        groups.append(group)
    return groups


def _with_balls(robot: Robot) -> list[Joint]:
    """Return the joints with a ball in place of two or three hinges that cross in a point."""
    joints = robot.joints
    for body in reversed(robot.frames):
        held = [joint for joint in joints if body in joint.bodies]
        if body == robot.root or len(held) != 2 or any(
                joint.name in robot.driven or joint.kind not in (HINGE, BALL) for joint in held):
            continue
        first, second = held
        ends = first.other(body), second.other(body)
        places = first.place(ends[0]), second.place(ends[1])
        if ends[0] != ends[1] and np.linalg.norm(places[0] - places[1]) < CROSSING \
                and (BALL in (first.kind, second.kind)
                     or np.linalg.norm(np.cross(first.axes[0], second.axes[0])) > ASKEW):
            ball = Joint(f'{first.name}+{second.name}', BALL, ends, places, first.axes,
                         parts=(*_chain(first, ends[0]), *_chain(second, body)))
            joints = [*(joint for joint in joints if joint not in held), ball]
    return joints


def _chain(joint: Joint, start: str) -> Sequence[tuple[Joint, float]]:
    """Return the hinges of a joint from one of its bodies to the other, with their signs."""
    parts = joint.parts or [(joint, 1.0)]
    return parts if joint.bodies[0] == start else [(hinge, -sign) for hinge, sign in parts[::-1]]


def check_planar(ground: str, joints: Sequence[Joint], drives: Sequence[str] = ()
                 ) -> tuple[list[Joint], float]:
    """Return the hinges, and by how much axes lean [rad]; raise ValueError if not planar."""
    hinges = sorted((joint for joint in joints if joint.kind == HINGE),
                    key=lambda joint: (joint.name not in drives, ground not in joint.bodies))
    if not hinges:
        raise ValueError('not planar: no hinge says in which plane')
    largest = 0.0
    for joint in joints:
        if joint.kind not in FLAT:
            raise ValueError(f'not planar: {joint.name} is a joint of type {joint.kind}')
        askew = lean(joint, hinges[0].axes[0])
        largest = max(largest, askew)
        if askew > ASKEW:
            raise ValueError(f'not planar: the axes of {hinges[0].name} and {joint.name} are '
                             f'{np.degrees(np.arcsin(min(askew, 1.0))):.3g} degrees from it, more '
                             f'than {np.degrees(ASKEW):.2g}')
    _check_rods(ground, joints, hinges[0].axes[0])
    return hinges, largest


def pins(joint: Joint, normal: np.ndarray) -> list[Joint]:
    """Return the hinges of a joint that turn in a plane."""
    return [hinge for hinge in joint.hinges
            if hinge.kind == HINGE and lean(hinge, normal) < ASKEW]


def _check_rods(ground: str, joints: Sequence[Joint], normal: np.ndarray) -> None:
    """Raise ValueError if a body can leave the plane: only rods may be on balls alone."""
    held = {ground}
    # A universal joint with an axis normal to the plane is a pin.
    held_by = [joint for joint in joints if joint.kind != BALL
               or len(joint.hinges) == 2 and pins(joint, normal)]
    while more := {end for joint in held_by for end in joint.bodies
                   if held & {*joint.bodies}} - held:
        held |= more
    for body in dict.fromkeys(end for joint in joints for end in joint.bodies):
        ends = [joint.bodies for joint in joints if body in joint.bodies]
        if body not in held and (len(ends) != 2 or not all(held & {*pair} for pair in ends)):
            raise ValueError(f'not planar: {body} hangs on balls alone, and is no rod')
