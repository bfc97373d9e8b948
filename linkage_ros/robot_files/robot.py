# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Robots: bodies and the joints between them, all in the pose of the file."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
import re
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from ..command import RequestError

HINGE, SLIDE, BALL, FIXED, UNIVERSAL, FREE = (
    'hinge', 'slide', 'ball', 'fixed', 'universal', 'free')
KINDS = {'revolute': HINGE, 'continuous': HINGE, 'prismatic': SLIDE, 'spherical': BALL,
         'floating': FREE}
# No robot has parts farther off [m], or limits [m or rad].
FARTHEST = 1e9


@dataclass(eq=False)
class Joint:
    """
    What joins two bodies: its place on each, its axis; with a name, position and limits.

    Attributes
    ----------
    places : pair of array
        Where each body has it [m].
    axis : array
        Its unit axis, as the first body has it.
    turns : pair of array
        Rotation matrices of its frame on each body.
    second : array
        The axis on its second body, where that is another.
    is_cut : bool
        Whether it closes a loop of a tree, so that its two frames may be apart.
    parts : tuple of Joint
        The hinges that a ball is made of, if it is.

    """

    name: str
    kind: str
    bodies: Tuple[str, str]
    places: Any
    axis: Any
    position: Optional[float] = None
    limits: Optional[Tuple[float, float]] = None
    turns: Any = (np.eye(3), np.eye(3))
    second: Any = None
    is_cut: bool = False
    parts: Tuple['Joint', ...] = ()

    @property
    def hinges(self) -> List['Joint']:
        """The hinges that it is made of, or itself."""
        return [one for part in self.parts for one in part.hinges] or [self]

    @property
    def axes(self) -> Tuple[np.ndarray, np.ndarray]:
        """Its axis as each body has it."""
        other = self.turns[1] @ self.turns[0].T @ self.axis if self.second is None else self.second
        return self.axis, other


def plain(name: str, most: int) -> str:
    """Return a name of letters, digits and single underscores, of no more than so many."""
    found = re.sub('[^A-Za-z0-9]+', '_', name).strip('_')[:most]
    return found if found[:1].isalpha() else f'joint_{found}'.rstrip('_')


@dataclass
class Robot:
    """
    Frames of bodies, joints, which of them motors move, and which are a multiple of others.

    Some are held where they are.
    """

    root: str
    frames: Dict[str, np.ndarray] = field(default_factory=dict)
    joints: List[Joint] = field(default_factory=list)
    driven: List[str] = field(default_factory=list)
    follows: Dict[str, Tuple[str, float, float]] = field(default_factory=dict)
    held: Dict[str, float] = field(default_factory=dict)

    def join(self, name: str, kind: str, bodies: Tuple[str, str], frame: np.ndarray,
             axis: Any = (0.0, 0.0, 1.0), other: Optional[np.ndarray] = None,
             position: Optional[float] = None, limits: Sequence[Any] = ('', ''),
             second: Any = None) -> None:
        """Add a joint by its frame on the parent, and on the child where it closes a loop."""
        for body in bodies:
            if body not in self.frames:
                raise RequestError(f'joint {name} is on {body!r}, which is no link')
        kind, size = KINDS.get(kind, kind), np.linalg.norm(axis)
        frames = frame, frame if other is None else other
        places = frames[0][:3, 3], frames[1][:3, 3]
        if not np.all(np.abs((*places, axis)) < FARTHEST):
            raise RequestError(f'joint {name} must be within {FARTHEST:g} m')
        if kind in (HINGE, SLIDE, UNIVERSAL) and not size > 0.0:
            raise RequestError(f'the axis of joint {name} has no length')
        low, high = (float(str(limit) or 'nan') for limit in limits)
        if kind == UNIVERSAL:
            # Two hinges with a cross between them.
            cross = f'{name}/cross'
            self.frames[cross] = frame
            self.join(name, HINGE, (bodies[0], cross), frame, axis)
            self.join(f'{name}/second', HINGE, (cross, bodies[1]), frame,
                      frame[:3, :3].T @ second, other)
            return
        if kind not in (HINGE, SLIDE):
            position = None
        self.joints.append(Joint(
            name, kind, bodies, places, frame[:3, :3] @ axis / (size or 1.0), position,
            (low, high) if -FARTHEST < low < high < FARTHEST else None,
            (frames[0][:3, :3], frames[1][:3, :3]), second, other is not None))

    def follow(self, name: str, other: str, ratio: float, offset: float) -> None:
        """Have a joint be a multiple of another, plus an offset."""
        if ratio:
            self.follows[name] = other, float(ratio), float(offset)

    @property
    def positions(self) -> Dict[str, float]:
        """The positions of all joints that have a name."""
        return {joint.name: joint.position for joint in self.joints if joint.position is not None}

    def source(self, name: str) -> Tuple[str, float, float]:
        """Return the joint that another follows, if not itself, its ratio and its offset."""
        ratio, offset, passed = 1.0, 0.0, [*self.driven]
        while name in self.follows and name not in passed:
            passed.append(name)
            name, factor, start = self.follows[name]
            ratio, offset = ratio * factor, offset + ratio * start
        if name not in self.positions:
            raise ValueError(f'{passed[-1]} follows {name!r}, which is no joint')
        return name, ratio, offset

    def displaced(self, moved: Mapping[str, np.ndarray], positions: Mapping[str, float]
                  ) -> 'Robot':
        """Return it with each body displaced, and joints where they are then."""
        joints = []
        for joint in self.joints:
            one, other = (moved[body] for body in joint.bodies)
            joints.append(replace(
                joint, axis=one[:3, :3] @ joint.axis,
                places=tuple(each[:3, :3] @ place + each[:3, 3]
                             for each, place in zip((one, other), joint.places)),
                turns=(one[:3, :3] @ joint.turns[0], other[:3, :3] @ joint.turns[1]),
                second=None if joint.second is None else other[:3, :3] @ joint.second,
                position=positions.get(joint.name, joint.position)
                if joint.position is not None else None))
        return replace(self, joints=joints,
                       frames={body: moved[body] @ frame for body, frame in self.frames.items()})
