# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The closed loops of a robot, each linkage in its plane, closed."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from typing import Dict, Iterator, List, Sequence, Tuple

import numpy as np

from .readers import BALL, FIXED, HINGE, Joint, Robot, SLIDE

# Axes that differ by more [rad] are not parallel; files often have an angle as 1.5708.
ASKEW = 1e-4


@dataclass
class Flat:
    """A joint in its plane: where it is on parent and child, its direction, its axis' sign."""

    joint: Joint
    places: Tuple[complex, complex]
    along: complex
    sign: float

    @property
    def bodies(self) -> Tuple[str, str]:
        """The two bodies that it joins."""
        return self.joint.parent, self.joint.child


@dataclass
class Loop:
    """A linkage of closed loops in the plane that `frame` is, seen from its ground."""

    ground: str
    joints: List[Flat]
    frame: np.ndarray
    size: float
    gap: float = 0.0


def blocks(robot: Robot) -> Iterator[Tuple[str, List[Joint]]]:
    """Yield the joints of each group of closed loops that share bars, and its ground."""
    home = _merged(robot)
    joints = [replace(joint, parent=home[joint.parent], child=home[joint.child])
              for joint in robot.joints if home[joint.parent] != home[joint.child]]
    way: Dict[str, List[int]] = {}
    for root in (home[robot.root], *home.values()):
        if root not in way:
            way[root] = []
            _walk(joints, root, way)
    groups: List[set] = []
    for i, joint in enumerate(joints):
        first, second = way[joint.parent], way[joint.child]
        cycle = {i} | set(first) ^ set(second)
        if len(cycle) > 1:
            for group in [group for group in groups if group & cycle]:
                groups.remove(group)
                cycle |= group
            groups.append(cycle)
    for group in groups:
        found = [joints[i] for i in sorted(group)]
        bodies = [body for joint in found for body in (joint.parent, joint.child)]
        yield min(bodies, key=lambda body: len(way[body])), found


def _merged(robot: Robot) -> Dict[str, str]:
    """Return the body that each one is fixed to, the one nearest the root."""
    home = {body: body for body in robot.frames}
    for joint in robot.joints:
        if joint.kind == FIXED:
            ends = home[joint.parent], home[joint.child]
            if robot.root in ends:
                ends = robot.root, next((end for end in ends if end != robot.root), robot.root)
            home = {body: ends[0] if at == ends[1] else at for body, at in home.items()}
    return home


def _walk(joints: Sequence[Joint], root: str, way: Dict[str, List[int]]) -> None:
    """Note the joints on the way from a root to each body."""
    waiting = deque([root])
    while waiting:
        body = waiting.popleft()
        for i, joint in enumerate(joints):
            ends = joint.parent, joint.child
            for end in ends:
                if body in ends and end not in way:
                    way[end] = [*way[body], i]
                    waiting.append(end)


def flat(robot: Robot, ground: str, joints: Sequence[Joint], drives: Sequence[str]) -> Loop:
    """Return a group of loops in its plane; raise ValueError with what is not planar."""
    hinges = sorted((joint for joint in joints if joint.kind == HINGE),
                    key=lambda joint: joint.name not in drives)
    others = [joint.name for joint in joints if joint.kind not in (HINGE, SLIDE, BALL)]
    if others or not hinges:
        raise ValueError(f'not planar: {", ".join(others) or "no joint"} is no hinge')
    base = robot.frames[ground]
    normal = base[:3, :3].T @ hinges[0].axis
    for joint in joints:
        axis, lean = base[:3, :3].T @ joint.axis, 0.0
        if joint.kind == HINGE:
            lean = np.linalg.norm(np.cross(axis, normal))
        elif joint.kind == SLIDE:
            lean = abs(axis @ normal)
        if lean > ASKEW:
            what = 'parallel to' if joint.kind == HINGE else 'across'
            raise ValueError(f'not planar: the axis of {joint.name} is not {what} that of '
                             f'{hinges[0].name}, by {np.degrees(np.arcsin(min(lean, 1.0))):.3g} '
                             'degrees')
    right = np.eye(3)[0 if abs(normal[0]) < 0.9 else 1]
    right = right - (right @ normal) * normal
    right /= np.linalg.norm(right)
    frame = np.eye(4)
    frame[:3, :3] = np.column_stack([right, np.cross(normal, right), normal])
    frame[:3, 3] = (np.linalg.inv(base) @ np.append(next(
        (joint for joint in hinges if ground in (joint.parent, joint.child)),
        hinges[0]).places[0], 1.0))[:3]
    seen = np.linalg.inv(base @ frame)
    found = []
    for joint in joints:
        ends = [complex(*(seen @ np.append(place, 1.0))[:2]) for place in joint.places]
        axis = seen[:3, :3] @ joint.axis
        found.append(Flat(joint, (ends[0], ends[1]), complex(*axis[:2]), float(np.sign(axis[2]))))
    places = [place for joint in found for place in joint.places]
    size = max(abs(a - b) for a in places for b in places)
    return Loop(ground, found, frame, size)


def closed(loop: Loop, held: Sequence[str]) -> Loop:
    """Return the loops closed, by Newton's method, with the joints held that drive them."""
    bodies = [body for body in dict.fromkeys(
        body for joint in loop.joints for body in joint.bodies) if body != loop.ground]
    where = {body: 3 * i for i, body in enumerate(bodies)}

    def moved(at: np.ndarray, body: str) -> Tuple[complex, complex]:
        x, y, turn = at[where[body]:where[body] + 3] if body in where else (0.0, 0.0, 0.0)
        return complex(x, y) * loop.size, np.exp(1j * turn)

    def place(at: np.ndarray, joint: Flat, end: int) -> complex:
        shift, turn = moved(at, joint.bodies[end])
        return shift + turn * joint.places[end]

    def misses(at: np.ndarray) -> np.ndarray:
        found: List[float] = []
        for joint in loop.joints:
            turns = [moved(at, body)[1] for body in joint.bodies]
            apart = (place(at, joint, 1) - place(at, joint, 0)) / loop.size
            angle = (turns[1] / turns[0]).imag
            drives = joint.joint.name in held
            if joint.joint.kind == SLIDE:
                start = (joint.places[1] - joint.places[0]) / loop.size
                apart = apart / (turns[0] * joint.along) - start / joint.along
                found += [apart.imag, angle, *([apart.real] if drives else [])]
            else:
                found += [apart.real, apart.imag, *([angle] if drives else [])]
        return np.array(found)

    at = np.zeros(3 * len(bodies))
    gap = float(np.max(np.abs(misses(at)))) * loop.size
    for _ in range(60):
        miss, step = misses(at), 1e-6 * np.eye(len(at))
        if np.max(np.abs(miss)) < 1e-16:
            break
        slope = np.array([(misses(at + h) - misses(at - h)) / 2e-6 for h in step]).T
        change = np.linalg.lstsq(slope, -miss, rcond=1e-9)[0]
        at = at + change * min(1.0, 0.3 / max(np.max(np.abs(change)), 1e-300))
    if np.max(np.abs(misses(at))) > 1e-12:
        raise ValueError(f'not closed: its loops are open by {gap:.3g} m in the pose of the file, '
                         'and cannot be closed from there')
    return replace(loop, gap=gap, joints=[
        replace(joint, places=(place(at, joint, 0), place(at, joint, 1)),
                along=joint.along * moved(at, joint.bodies[0])[1]) for joint in loop.joints])
