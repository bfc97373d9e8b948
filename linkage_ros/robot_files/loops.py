# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The closed loops of a robot, each linkage in its plane, and closed."""

from __future__ import annotations

from cmath import phase
from dataclasses import replace
from typing import Dict, Iterator, List, NamedTuple, Sequence, Set, Tuple

import numpy as np

from .readers import BALL, FIXED, HINGE, Joint, Robot, SLIDE

# Axes that differ by more [rad] are not parallel: files have angles such as 1.5708.
ASKEW = 1e-4
# Hinges nearer to each other [m] cross in a point; the ends of a loop [m] are in one plane.
TOGETHER = 1e-6


class Loop(NamedTuple):
    """
    Joints of a linkage on a ground; its plane is `frame`, seen from the link `frame_id`.

    In the plane places are complex, and so are the axes of slides; that of a hinge is 1 or -1.
    """

    ground: str
    frame_id: str
    frame: np.ndarray
    joints: List[Joint]
    size: float
    gap: float = 0.0


def groups(robot: Robot) -> Iterator[Tuple[str, str, List[Joint]]]:
    """Yield the loops that share bars: their ground, its name in the file, their joints."""
    home = {body: body for body in robot.frames}
    for joint in robot.joints:
        if joint.kind == FIXED:
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
            axis=complex(*axis[:2]) if joint.kind == SLIDE else float(np.sign(axis[2]))))
    places = [place for joint in found for place in joint.places]
    return Loop(ground, frame_id, frame, found, max(abs(a - b) for a in places for b in places))


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


def closed(loop: Loop, held: Sequence[str]) -> Loop:
    """Return the loops closed, by Newton's method, while the joints that drive them are held."""
    where = {body: 3 * i for i, body in enumerate(dict.fromkeys(
        body for joint in loop.joints for body in joint.bodies))}

    def seen(at: np.ndarray, joint: Joint) -> Tuple[List[complex], List[complex], complex]:
        """Return how the bodies of a joint have turned, its places, and how far it has moved."""
        moved = [at[where[body]:][:3] for body in joint.bodies]
        turns = [complex(np.exp(1j * turn)) for _, _, turn in moved]
        places = [loop.size * complex(x, y) + turn * place
                  for (x, y, _), turn, place in zip(moved, turns, joint.places)]
        apart = places[1] - places[0]
        if joint.kind == SLIDE:
            apart = (apart / turns[0] - joint.places[1] + joint.places[0]) / joint.axis
        return turns, places, apart

    def misses(at: np.ndarray) -> np.ndarray:
        found = list(at[where[loop.ground]:][:3])
        for joint in loop.joints:
            (first, second), _, apart = seen(at, joint)
            free, angle = joint.name not in held, (second / first).imag
            along, turn = (free, False) if joint.kind == SLIDE else (False, free)
            found += [0.0 if along else apart.real / loop.size, apart.imag / loop.size,
                      0.0 if turn else angle]
        return np.array(found)

    at = np.zeros(3 * len(where))
    gap = loop.size * float(np.max(np.abs(misses(at))))
    for _ in range(60):
        slope = np.array([misses(at + step) - misses(at - step)
                          for step in 1e-6 * np.eye(len(at))]).T / 2e-6
        change = np.linalg.lstsq(slope, -misses(at), rcond=1e-9)[0]
        at = at + change * min(1.0, 0.3 / max(np.max(np.abs(change)), 1e-300))
        if np.max(np.abs(change)) < 1e-15:
            break
    if np.max(np.abs(misses(at))) > 1e-13:
        raise ValueError(f'open by {gap:.3g} m in the pose of the file, and cannot be closed')
    joints = []
    for joint in loop.joints:
        (first, second), places, apart = seen(at, joint)
        moved, axis = joint.axis * phase(second / first), joint.axis
        if joint.kind == SLIDE:
            moved, axis = apart.real, axis * first
        position = None if joint.position is None else joint.position + moved
        joints.append(replace(joint, places=places, axis=axis, position=position))
    return loop._replace(gap=gap, joints=joints)
