# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The closed loops of a robot, each linkage in its plane, and closed."""

from __future__ import annotations

from cmath import phase
from typing import Dict, Iterator, List, NamedTuple, Sequence, Set, Tuple

import numpy as np

from .readers import BALL, FIXED, HINGE, Joint, Robot, SLIDE

# Axes that differ by more [rad] are not parallel: files have angles such as 1.5708.
ASKEW = 1e-4


class Flat(NamedTuple):
    """A joint in its plane: its places on both bodies, which way it slides or turns."""

    name: str
    kind: str
    bodies: Tuple[str, str]
    places: Tuple[complex, complex]
    along: complex
    sign: float
    position: float
    is_named: bool


class Loop(NamedTuple):
    """Joints of a linkage, on a ground, whose plane is `frame` in the frame of a body there."""

    ground: str
    frame_id: str
    frame: np.ndarray
    joints: List[Flat]
    size: float
    gap: float = 0.0


def groups(robot: Robot) -> Iterator[Tuple[str, str, List[Joint]]]:
    """Yield the loops that share bars: their ground, its name in the file, their joints."""
    home = {body: body for body in robot.frames}
    for joint in robot.joints:
        if joint.kind == FIXED:
            new, old = sorted((home[body] for body in joint.bodies), key=robot.root.__ne__)
            home = {body: new if at == old else at for body, at in home.items()}
    joints = [joint for joint in robot.joints if home[joint.bodies[0]] != home[joint.bodies[1]]]
    ends = [tuple(home[body] for body in joint.bodies) for joint in joints]
    way: Dict[str, Set[int]] = {}
    for root in (home[robot.root], *home.values()):
        way.setdefault(root, set())
        while step := next(((a, b, i) for i, pair in enumerate(ends) for a, b in (pair, pair[::-1])
                            if a in way and b not in way), None):
            way[step[1]] = way[step[0]] | {step[2]}
    found: List[Set[int]] = []
    for i, (first, second) in enumerate(ends):
        if cycle := {i} ^ way[first] ^ way[second]:
            shared = [group for group in found if group & cycle]
            found = [group for group in found if group not in shared] + [cycle.union(*shared)]
    for group in found:
        ground = min((end for i in group for end in ends[i]), key=lambda end: len(way[end]))
        name = next(body for i in sorted(group) for body in joints[i].bodies
                    if home[body] == ground)
        yield ground, name, [joints[i]._replace(bodies=ends[i]) for i in sorted(group)]


def flat(robot: Robot, ground: str, frame_id: str, joints: Sequence[Joint],
         drives: Sequence[str]) -> Loop:
    """Return loops in their plane; raise ValueError with what is not planar."""
    hinges = sorted((joint for joint in joints if joint.kind == HINGE),
                    key=lambda joint: (joint.name not in drives, ground not in joint.bodies))
    for joint in joints:
        if joint.kind not in (HINGE, SLIDE, BALL) or not hinges:
            raise ValueError(f'not planar: {joint.name} is a {joint.kind}')
        lean = np.linalg.norm(np.cross(joint.axis, hinges[0].axis)) if joint.kind == HINGE \
            else abs(joint.axis @ hinges[0].axis) if joint.kind == SLIDE else 0.0
        if lean > ASKEW:
            raise ValueError(f'not planar: the axes of {hinges[0].name} and {joint.name} are '
                             f'{np.degrees(np.arcsin(min(lean, 1.0))):.3g} degrees from it')
    base = robot.frames[frame_id]
    normal = base[:3, :3].T @ hinges[0].axis
    right = np.eye(3)[int(abs(normal[0]) > 0.9)]
    right = (right - right @ normal * normal) / np.linalg.norm(right - right @ normal * normal)
    frame = np.eye(4)
    frame[:3, :3] = np.column_stack([right, np.cross(normal, right), normal])
    origin = next((joint for joint in hinges if ground in joint.bodies), hinges[0])
    frame[:3, 3] = base[:3, :3].T @ (origin.places[0] - base[:3, 3])
    seen, found = np.linalg.inv(base @ frame), []
    for joint in joints:
        first, second = (complex(*(seen @ [*place, 1.0])[:2]) for place in joint.places)
        axis = seen[:3, :3] @ joint.axis
        found.append(Flat(joint.name, joint.kind, joint.bodies, (first, second),
                          complex(*axis[:2]), float(np.sign(axis[2])), joint.position or 0.0,
                          joint.position is not None))
    places = [place for joint in found for place in joint.places]
    return Loop(ground, frame_id, frame, found, max(abs(a - b) for a in places for b in places))


def closed(loop: Loop, held: Sequence[str]) -> Loop:
    """Return the loops closed, by Newton's method, while the joints that drive them are held."""
    bodies = dict.fromkeys(body for joint in loop.joints for body in joint.bodies)
    where = {body: 3 * i for i, body in enumerate(bodies)}

    def turn(at: np.ndarray, body: str) -> complex:
        return complex(np.exp(1j * at[where[body] + 2]))

    def place(at: np.ndarray, joint: Flat, end: int) -> complex:
        x, y, _ = at[where[joint.bodies[end]]:][:3]
        return loop.size * complex(x, y) + turn(at, joint.bodies[end]) * joint.places[end]

    def misses(at: np.ndarray) -> np.ndarray:
        found = list(at[where[loop.ground]:][:3])
        for joint in loop.joints:
            first, second = (turn(at, body) for body in joint.bodies)
            apart = (place(at, joint, 1) - place(at, joint, 0)) / loop.size
            angle = (second / first).imag
            if joint.kind == SLIDE:
                start = (joint.places[1] - joint.places[0]) / loop.size
                apart = (apart / first - start) / joint.along
                found += [apart.imag, angle, apart.real * (joint.name in held)]
            else:
                found += [apart.real, apart.imag, angle * (joint.name in held)]
        return np.array(found)

    def moved(joint: Flat) -> float:
        first, second = (turn(at, body) for body in joint.bodies)
        if joint.kind != SLIDE:
            return joint.sign * phase(second / first)
        apart = (place(at, joint, 1) - place(at, joint, 0)) / first
        return ((apart - joint.places[1] + joint.places[0]) / joint.along).real

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
    return loop._replace(gap=gap, joints=[joint._replace(
        places=(place(at, joint, 0), place(at, joint, 1)), position=joint.position + moved(joint),
        along=joint.along * turn(at, joint.bodies[0])) for joint in loop.joints])
