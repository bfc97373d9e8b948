# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The closed loops of a robot, each linkage in its plane, and closed."""

from __future__ import annotations

from dataclasses import replace
from typing import Dict, Iterator, List, NamedTuple, Sequence, Set, Tuple

import numpy as np

from .readers import BALL, FIXED, HINGE, Joint, Robot, SLIDE
from ..command import RequestError

# Axes that differ by more [rad] are not parallel: files have angles such as 1.5708.
ASKEW = 1e-4
# Hinges nearer to each other [m] cross in a point; the ends of a loop [m] are in one plane.
TOGETHER = 1e-6
# Of the size of a linkage, what is rounding.
ROUNDING = 1e-12


class Loop(NamedTuple):
    """
    Joints of a linkage on a ground; its plane is `frame`, seen from the link `frame_id`.

    In the plane places are complex, and so are the axes of slides; that of a hinge is 1 or -1.
    The file leaves a gap [m] in the loops; what is nearer than `near` [m] is at one place.
    """

    ground: str
    frame_id: str
    frame: np.ndarray
    joints: List[Joint]
    size: float
    gap: float

    @property
    def near(self) -> float:
        return self.size * min(max(ROUNDING, 10.0 * self.gap / self.size), 1e-6)


def groups(robot: Robot) -> Iterator[Tuple[str, str, List[Joint]]]:
    """Yield the loops that share bars: their ground, its name in the file, their joints."""
    home = {body: body for body in robot.frames}
    for joint in robot.joints:
        if joint.kind == FIXED:
            if joint.gap > TOGETHER:
                raise RequestError(f'{joint.name} makes {joint.bodies[0]} and {joint.bodies[1]} '
                                   f'one, which the pose of the file has {joint.gap:.3g} apart [m '
                                   'or rad]: give it a pose in which they fit')
            new, old = sorted((home[body] for body in joint.bodies), key=robot.root.__ne__)
            home = {body: new if at == old else at for body, at in home.items()}
    moved = [replace(joint, bodies=(home[joint.bodies[0]], home[joint.bodies[1]]))
             for joint in robot.joints]
    joints = _with_balls(robot, [joint for joint in moved if len({*joint.bodies}) == 2])
    way: Dict[str, Set[Joint]] = {}
    for root in (home[robot.root], *home.values()):
        way.setdefault(root, set())
        while step := next(((a, b, joint) for joint in joints for a, b in (
                joint.bodies, joint.bodies[::-1]) if a in way and b not in way), None):
            way[step[1]] = way[step[0]] | {step[2]}
    found: List[Set[Joint]] = []
    for joint in joints:
        first, second = joint.bodies
        if cycle := {joint} ^ way[first] ^ way[second]:
            shared = [group for group in found if group & cycle]
            found = [group for group in found if group not in shared] + [cycle.union(*shared)]
    for group in found:
        chosen = [joint for joint in joints if joint in group]
        ground = min((body for joint in chosen for body in joint.bodies),
                     key=lambda body: len(way[body]))
        names = {joint.name for joint in chosen}
        yield ground, next((body for joint in robot.joints for body in joint.bodies
                            if joint.name in names and home[body] == ground), ground), chosen


def _with_balls(robot: Robot, joints: List[Joint]) -> List[Joint]:
    """Return joints with one ball for each two or three hinges that cross in a point."""
    for body in dict.fromkeys(body for joint in joints for body in joint.bodies):
        own = [joint for joint in joints if body in joint.bodies and joint.name not in robot.driven
               and joint.kind in (HINGE, BALL)]
        if body == robot.root or own != [joint for joint in joints if body in joint.bodies] \
                or len(own) != 2:
            continue
        (one, two), axes = ((joint, joint.bodies[0] == body) for joint in own), np.array(
            [joint.axis for joint in own])
        bodies = one[0].bodies[one[1]], two[0].bodies[two[1]]
        places = one[0].places[one[1]], two[0].places[two[1]]
        if bodies[0] != bodies[1] and np.linalg.norm(places[0] - places[1]) < TOGETHER \
                and np.linalg.norm(np.cross(*axes)) > ASKEW:
            ball = Joint(f'{own[0].name}+{own[1].name}', BALL, bodies, places, axes[0])
            return _with_balls(robot, [*(joint for joint in joints if joint not in own), ball])
    return joints


def flat(robot: Robot, ground: str, frame_id: str, joints: Sequence[Joint],
         drives: Sequence[str]) -> Loop:
    """Return loops in their plane; raise ValueError with what is not planar."""
    hinges = sorted((joint for joint in joints if joint.kind == HINGE),
                    key=lambda joint: (joint.name not in drives, ground not in joint.bodies))
    if not hinges:
        raise ValueError('not planar: no hinge says in which plane')
    for joint in joints:
        if joint.kind not in (HINGE, SLIDE, BALL):
            raise ValueError(f'not planar: {joint.name} is a joint of type {joint.kind}')
        across = np.linalg.norm(np.cross(joint.axis, hinges[0].axis))
        lean = {HINGE: across, SLIDE: abs(joint.axis @ hinges[0].axis), BALL: 0.0}[joint.kind]
        if lean > ASKEW:
            raise ValueError(f'not planar: the axes of {hinges[0].name} and {joint.name} are '
                             f'{np.degrees(np.arcsin(min(lean, 1.0))):.3g} degrees from it')
    _check_rods(ground, joints)
    base = robot.frames[frame_id]
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
        first, second = (seen @ [*place, 1.0] for place in joint.places)
        if abs(first[2] - second[2]) > TOGETHER:
            raise ValueError(f'not planar: {joint.name} is open across the plane by '
                             f'{abs(first[2] - second[2]):.3g} m')
        axis = seen[:3, :3] @ joint.axis
        found.append(replace(
            joint, places=(complex(*first[:2]), complex(*second[:2])),
            axis=complex(*axis[:2]) / abs(complex(*axis[:2])) if joint.kind == SLIDE
            else float(np.sign(axis[2]))))
    places = [place for joint in found for place in joint.places]
    size = max(abs(place - other) for place in places for other in places)
    if not size:
        raise ValueError('all its joints are at one place')
    return Loop(ground, frame_id, frame, found, size, max(
        _gap(robot, joint, size, joint.name in drives) for joint in found))


def _gap(robot: Robot, joint: Joint, size: float, drives: bool) -> float:
    """Return by how much [m] a joint is open, or not where the joint that it follows has it."""
    slides, apart = joint.kind == SLIDE, joint.places[1] - joint.places[0]
    if not drives:
        return abs((apart / joint.axis).imag if slides else apart)
    source, ratio, offset = robot.source(joint.name)
    late = ratio * robot.positions[source] + offset - robot.positions[joint.name]
    return max(abs(late) * (1.0 if slides else size), _gap(robot, joint, size, False))


def _check_rods(ground: str, joints: Sequence[Joint]) -> None:
    """Raise ValueError if a body can leave the plane: only rods may be on balls alone."""
    held = {ground}
    while more := {end for joint in joints for end in joint.bodies if joint.kind != BALL
                   and held & {*joint.bodies}} - held:
        held |= more
    for body in dict.fromkeys(end for joint in joints for end in joint.bodies):
        own = [joint.bodies for joint in joints if body in joint.bodies]
        if body not in held and (len(own) != 2 or not all(held & {*ends} for ends in own)):
            raise ValueError(f'not planar: {body} hangs on balls alone, and is no rod')
