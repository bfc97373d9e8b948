# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The planar loops of a robot, each in its plane."""

from __future__ import annotations

from dataclasses import replace
from typing import Dict, List, NamedTuple, Sequence, Tuple

import numpy as np

from .spatial import blocks, TOGETHER
from ..linkage import ROUNDING
from ..robot_model.robot import BALL, FIXED, HINGE, Joint, Robot, SLIDE, top, trees

# Kinds of joints in planar loops.
FLAT = (HINGE, SLIDE, BALL)
# Axes that differ by less [rad] are parallel, and loops with a smaller gap, of their size, are
# closed: files have rounded numbers, and mirrored legs that somebody aligned by hand.
ASKEW, OPEN = 1e-3, 1e-4


class Loop(NamedTuple):
    """
    A linkage in its plane, whose pose on the link `ground` is `frame`.

    Places of joints are complex [m], and so are the axes of slides; the axis of a hinge is 1 or
    -1. `size` is the largest distance of two joints [m], `gap` the distance that cannot be closed
    [m], and `lean` the inclination of axes [rad]. `pins` are the hinges and slides with a
    position, those of balls in the plane included, and `still` the other hinges of these balls.
    """

    ground: str
    frame: np.ndarray
    joints: List[Joint]
    size: float
    gap: float
    lean: float
    pins: List[Joint]
    still: List[str]

    @property
    def near(self) -> float:
        """Points nearer to each other [m] coincide."""
        return self.size * min(max(ROUNDING, 10.0 * self.gap / self.size), 1e-6)


class Group(NamedTuple):
    """Loops that share bars: ground, joints, why not planar, and planar parts."""

    ground: str
    joints: List[Joint]
    why: str
    parts: List['Group']


def groups(robot: Robot) -> List[Group]:
    """Return the loops of a robot, with their planar parts; bodies fixed to others are one."""
    home = {body: body for body in robot.frames}
    for joint in robot.joints:
        if joint.kind == FIXED:
            first, second = (top(home, body) for body in joint.bodies)
            home[second] = first
    # Several bodies that are one have the name of the first that a joint moves.
    names = {top(home, body): body for joint in robot.joints[::-1] if joint.kind != FIXED
             for body in joint.bodies[::-1]}
    home = {body: names.get(top(home, body), top(home, body)) for body in home}
    joints = [replace(joint, bodies=(home[joint.bodies[0]], home[joint.bodies[1]]))
              for joint in robot.joints]
    robot = replace(robot, root=home[robot.root], joints=[
        joint for joint in joints if len({*joint.bodies}) == 2], frames={
        body: robot.frames[body] for body in home.values()})
    return [group._replace(parts=_parts(robot, group) if group.why else [group])
            for group in _blocks(robot, _with_balls(robot))]


def _parts(robot: Robot, group: Group) -> List[Group]:
    """Return the planar parts of loops that are not planar as a whole."""
    parts: List[Group] = []
    left = group.joints
    for joint in sorted(group.joints, key=lambda joint: joint.name not in robot.driven):
        if joint.kind == HINGE and joint in left:
            parts += [part for part in _blocks(robot, [
                other for other in left if other.kind in FLAT and _lean(other, joint.axis) < ASKEW
                ]) if not part.why]
            left = [other for other in left if not any(other in part.joints for part in parts)]
    return parts


def _blocks(robot: Robot, joints: List[Joint]) -> List[Group]:
    """Return the loops of some joints, those that share bars together."""
    tree, cuts = trees(replace(robot, joints=joints))
    groups = []
    for block, closing in blocks(tree, cuts):
        edges = {tree[body][1] for body in block} | {*closing}
        # The parent of the first body is nearest to the root.
        ground = next(base for body, (base, _) in tree.items() if body in block)
        group = Group(ground, [joint for joint in joints if joint in edges], '', [])
        try:
            check_planar(ground, group.joints)
        except ValueError as error:
            group = group._replace(why=str(error))
        groups.append(group)
    return groups


def _with_balls(robot: Robot) -> List[Joint]:
    """Return the joints with a ball in place of two or three hinges that cross in a point."""
    joints = robot.joints
    on: Dict[str, List[Joint]] = {}
    for joint in joints:
        for body in joint.bodies:
            on.setdefault(body, []).append(joint)
    row = [*on]
    for body in row:
        own = on[body]
        if body == robot.root or len(own) != 2 or any(
                joint.name in robot.driven or joint.kind not in (HINGE, BALL) for joint in own):
            continue
        one, two = own
        bodies = one.other(body), two.other(body)
        places = one.place(bodies[0]), two.place(bodies[1])
        if bodies[0] != bodies[1] and np.linalg.norm(places[0] - places[1]) < TOGETHER \
                and (BALL in (one.kind, two.kind)
                     or np.linalg.norm(np.cross(one.axis, two.axis)) > ASKEW):
            ball = Joint(f'{one.name}+{two.name}', BALL, bodies, places, one.axes,
                         parts=(one, two))
            joints, on[body] = [*(joint for joint in joints if joint not in own), ball], []
            for end in bodies:
                on[end] = [ball if joint in own else joint for joint in on[end]]
            row += bodies
    return joints


def check_planar(ground: str, joints: Sequence[Joint], drives: Sequence[str] = ()
                 ) -> Tuple[List[Joint], float]:
    """Return the hinges, and by how much axes lean [rad]; raise ValueError if not planar."""
    hinges = sorted((joint for joint in joints if joint.kind == HINGE),
                    key=lambda joint: (joint.name not in drives, ground not in joint.bodies))
    if not hinges:
        raise ValueError('not planar: no hinge says in which plane')
    lean = 0.0
    for joint in joints:
        if joint.kind not in FLAT:
            raise ValueError(f'not planar: {joint.name} is a joint of type {joint.kind}')
        askew = _lean(joint, hinges[0].axis)
        lean = max(lean, askew)
        if askew > ASKEW:
            raise ValueError(f'not planar: the axes of {hinges[0].name} and {joint.name} are '
                             f'{np.degrees(np.arcsin(min(askew, 1.0))):.3g} degrees from it, more '
                             f'than {np.degrees(ASKEW):.2g}')
    _check_rods(ground, joints, hinges[0].axis)
    return hinges, lean


def _lean(joint: Joint, normal: np.ndarray) -> float:
    """Return the inclination of a joint's axes against those of a plane [rad]."""
    if joint.kind == SLIDE:
        return float(abs(joint.axis @ normal))
    return float(max(np.linalg.norm(np.cross(axis, normal)) for axis in joint.axes)) \
        if joint.kind == HINGE else 0.0


def flat(robot: Robot, group: Group, drives: Sequence[str]) -> Loop:
    """Return loops in their plane; raise ValueError that names nonplanar parts."""
    ground, joints = group.ground, group.joints
    hinges, lean = check_planar(ground, joints, drives)
    base = robot.frames[ground]
    normal = base[:3, :3].T @ hinges[0].axis
    right = np.eye(3)[int(abs(normal[0]) > 0.9)]
    right = (right - right @ normal * normal) / np.linalg.norm(np.cross(right, normal))
    frame = np.eye(4)
    frame[:3, :3] = np.column_stack([right, np.cross(normal, right), normal])
    origin = next((joint for joint in hinges if ground in joint.bodies), hinges[0])
    frame[:3, 3] = base[:3, :3].T @ (origin.places[0] - base[:3, 3])
    seen = np.linalg.inv(base @ frame)
    found = []
    for joint in joints:
        first, second = ((seen @ [*place, 1.0])[:2] for place in joint.places)
        axis = seen[:3, :3] @ joint.axis
        way = complex(*axis[:2])
        found.append(replace(
            joint, places=(complex(*first), complex(*second)),
            axes=[way / abs(way) if joint.kind == SLIDE else float(np.sign(axis[2]))] * 2))
    places = [place for joint in found for place in joint.places]
    size = max(abs(place - other) for place in places for other in places)
    if size < TOGETHER:
        raise ValueError('all its joints are at one place')
    gaps = ((joint.places[1] - joint.places[0], joint) for joint in found)
    gap = max(abs((apart / joint.axis).imag if joint.kind == SLIDE else apart)
              for apart, joint in gaps)
    if gap > OPEN * size:
        raise ValueError(f'its loops cannot be closed: they stay open by {gap:.3g} m, more than '
                         f'{OPEN:g} of their size')
    pins = [joint for joint in found if joint.position is not None]
    still: List[str] = []
    stiff = [joint for joint in found if len(joint.hinges) == 2 and not any(
        joint.kind == HINGE and _lean(joint, hinges[0].axis) < ASKEW for joint in joint.hinges)]
    for joint in found:
        # A rod turns in the plane about one hinge of the ball at its end; the others stay, unless
        # its other end needs them.
        for hinge, sign in joint.chain:
            if _lean(hinge, hinges[0].axis) < ASKEW and not any(
                    {*joint.bodies} & {*other.bodies} for other in stiff):
                pins.append(replace(joint, name=hinge.name, kind=HINGE, position=hinge.position,
                                    axes=[sign * float(np.sign(hinge.axis @ hinges[0].axis))] * 2))
                still += [one.name for one, _ in joint.chain if one is not hinge]
                break
    return Loop(ground, frame, found, size, gap, lean, pins, still)


def _check_rods(ground: str, joints: Sequence[Joint], normal: np.ndarray) -> None:
    """Raise ValueError if a body can leave the plane: only rods may be on balls alone."""
    held = {ground}
    # A universal joint with an axis normal to the plane is a pin.
    pins = [joint for joint in joints if joint.kind != BALL or len(joint.hinges) == 2 and any(
        joint.kind == HINGE and _lean(joint, normal) < ASKEW for joint in joint.hinges)]
    while more := {end for joint in pins for end in joint.bodies
                   if held & {*joint.bodies}} - held:
        held |= more
    for body in dict.fromkeys(end for joint in joints for end in joint.bodies):
        own = [joint.bodies for joint in joints if body in joint.bodies]
        if body not in held and (len(own) != 2 or not all(held & {*ends} for ends in own)):
            raise ValueError(f'not planar: {body} hangs on balls alone, and is no rod')
