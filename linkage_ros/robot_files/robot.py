# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Robots: bodies and the joints between them, all in the pose of the file."""

from __future__ import annotations

from dataclasses import dataclass, field
import math
import re
from typing import Any, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from ..command import RequestError
from ..words import listed, meant

HINGE, SLIDE, BALL, FIXED, UNIVERSAL, FREE = (
    'hinge', 'slide', 'ball', 'fixed', 'universal', 'free')
# What files call them, in small letters.
KINDS = {'revolute': HINGE, 'continuous': HINGE, 'prismatic': SLIDE, 'spherical': BALL, '3d': BALL,
         '6d': FIXED, 'revolute2': UNIVERSAL, 'floating': FREE}
# No robot has parts farther off [m], or limits [m or rad].
FARTHEST = 1e9


class NotDriven(ValueError):
    """The motors do not determine the poses of a loop."""


class Limits(NamedTuple):
    """Between which positions a joint moves [rad or m], by the limits of some joints."""

    low: float
    high: float
    joints: Tuple[str, ...]

    def text(self, joint: str) -> str:
        """Return the limits of a joint as text."""
        own = '' if self.joints == (joint,) else f' {joint}'
        return f'{", ".join(self.joints)},{own} from {self.low:.4g} to {self.high:.4g}'


@dataclass(eq=False)
class Joint:
    """
    A joint between two bodies; its position and limits, if it has one degree of freedom.

    Attributes
    ----------
    places : pair of array
        Its place on each body [m].
    axes : pair of array
        Its unit axis on each body.
    turns : pair of array
        Rotation matrices of its frame on each body.
    limits : pair of float, optional
        Its lower and upper limit [rad or m], one of which may be infinite.
    no_limits : str
        The limits of the file and why they do not count, if they do not.
    is_cut : bool
        Whether it closes a loop of a tree, so that its two frames may be apart.
    parts : tuple of Joint
        The hinges that a ball is made of, if it is.

    """

    name: str
    kind: str
    bodies: Tuple[str, str]
    places: Any
    axes: Any
    position: Optional[float] = None
    limits: Optional[Tuple[float, float]] = None
    no_limits: str = ''
    turns: Any = (np.eye(3), np.eye(3))
    is_cut: bool = False
    parts: Tuple['Joint', ...] = ()

    def other(self, body: str) -> str:
        """Return the body that it joins to one."""
        return self.bodies[self.bodies[0] == body]

    def place(self, body: str) -> Any:
        """Return its place on a body [m]."""
        return self.places[self.bodies[1] == body]

    def motion(self, body: str) -> Any:
        """Return the axis on the other body about or along which positions move a body."""
        return self.axes[0] if self.bodies[1] == body else -self.axes[1]

    @property
    def axis(self) -> Any:
        """Return the axis on the first body."""
        return self.axes[0]

    @property
    def start(self) -> float:
        """Return the position in the file [rad or m], 0 for a joint without one."""
        return self.position or 0.0

    @property
    def range(self) -> Tuple[float, float]:
        """Return its limits [rad or m], infinite ones without any."""
        return self.limits or (-math.inf, math.inf)

    @property
    def chain(self) -> List[Tuple['Joint', float]]:
        """
        Return the hinges of a ball from its first body to its second, if all have positions.

        With each its sign: 1 if its second body is nearer to that of the ball.
        """
        found: List[Tuple[Joint, float]] = []
        body, left = self.bodies[0], self.hinges if self.parts else []
        if any(joint.position is None for joint in left):
            return []
        while near := [joint for joint in left if body in joint.bodies]:
            found.append((near[0], 1.0 if near[0].bodies[0] == body else -1.0))
            body, left = near[0].other(body), [joint for joint in left if joint is not near[0]]
        return found

    @property
    def hinges(self) -> List['Joint']:
        """Return the hinges of a ball that is made of some, else the joint itself."""
        return [one for part in self.parts for one in part.hinges] or [self]


def plain(name: str, most: int) -> str:
    """Return a name of at most so many letters, digits and single underscores."""
    found = re.sub('[^A-Za-z0-9]+', '_', name).strip('_')[:most]
    return found if found[:1].isalpha() else f'joint_{found}'.rstrip('_')


@dataclass
class Robot:
    """
    Bodies and joints of a robot, in the pose of its file.

    Attributes
    ----------
    root : str
        The body that does not move.
    frames : dict
        The pose of each body.
    joints : list of Joint
        All joints.
    driven : list of str
        Joints that motors move.
    follows : dict
        For each dependent joint another joint, the ratio and the offset.
    held : dict
        Positions of joints that are fixed.

    """

    root: str
    frames: Dict[str, np.ndarray] = field(default_factory=dict)
    joints: List[Joint] = field(default_factory=list)
    driven: List[str] = field(default_factory=list)
    follows: Dict[str, Tuple[str, float, float]] = field(default_factory=dict)
    held: Dict[str, float] = field(default_factory=dict)

    def join(self, name: str, kind: str, bodies: Tuple[str, str], frame: np.ndarray,
             axis: Any = (0.0, 0.0, 1.0), other: Optional[np.ndarray] = None,
             position: Optional[float] = None,
             limits: Sequence[Any] = (-math.inf, math.inf), second: Any = None) -> None:
        """
        Add a joint by its frame on the first body, and on the second where it closes a loop.

        The axes are in these frames; `second` is that of the second body, if it is another.
        """
        for body in bodies:
            if body not in self.frames:
                raise RequestError(f'joint {name} is on {body!r}, which is no link')
        ends, no_limits = _limits(limits, kind.lower() == 'continuous')
        kind = KINDS.get(kind.lower(), kind.lower())
        frames, ways = (frame, frame if other is None else other), [
            axis, axis if second is None else second]
        places = tuple(each[:3, 3] for each in frames)
        sizes = np.linalg.norm(ways, axis=1)
        if not np.all(np.abs((*places, *ways)) < FARTHEST):
            raise RequestError(f'joint {name} must be within {FARTHEST:g} m')
        if kind in (HINGE, SLIDE, UNIVERSAL) and not np.all(sizes > 0.0):
            raise RequestError(f'the axis of joint {name} has no length')
        if kind == UNIVERSAL and second is None:
            raise RequestError(f'joint {name} is universal and must have two axes')
        if kind == UNIVERSAL:
            # Two hinges with a cross between them.
            cross = f'{name}/cross'
            self.frames[cross] = frame
            self.join(name, HINGE, (bodies[0], cross), frame, axis, None, position)
            self.join(f'{name}/second', HINGE, (cross, bodies[1]), frame, ways[1], other,
                      position if other is None else None)
            return
        turns = tuple(each[:3, :3] for each in frames)
        self.joints.append(Joint(
            name, kind, bodies, places,
            tuple(turn @ way / (size or 1.0) for turn, way, size in zip(turns, ways, sizes)),
            position if kind in (HINGE, SLIDE) else None, ends, no_limits, turns,
            other is not None))

    def close(self, name: str, kind: str, bodies: Tuple[str, str], own: Sequence[np.ndarray],
              axis: Any = (0.0, 0.0, 1.0), second: Any = None) -> None:
        """Close a loop by a joint, by its frame on each body as this has it; see `join`."""
        first, other = (self.frames[body] @ frame for body, frame in zip(bodies, own))
        self.join(name, kind, bodies, first, axis, other, second=second)

    def follow(self, name: str, other: str, ratio: float, offset: float) -> None:
        """Make a joint dependent: ratio * position + offset of another."""
        if ratio:
            self.follows[name] = other, float(ratio), float(offset)

    @property
    def positions(self) -> Dict[str, float]:
        """Return the positions of all joints that have a name."""
        return {joint.name: joint.position for joint in self.joints if joint.position is not None}

    def check_names(self, names: Iterable[str]) -> None:
        """Raise RequestError for a name that no joint of one degree of freedom has."""
        for name in names:
            if name not in self.positions:
                raise RequestError(f'there is no joint {name!r}; allowed: '
                                   f'{listed(self.positions, 200)}'
                                   f'{meant(name, self.positions)}')

    def sources(self, name: str) -> List[Tuple[str, float, float]]:
        """Return a joint and those that it depends on in turn, each with ratio and offset."""
        found, passed = [(name, 1.0, 0.0)], [*self.driven]
        while name in self.follows and name not in passed:
            passed.append(name)
            _, ratio, offset = found[-1]
            name, factor, start = self.follows[name]
            found.append((name, ratio * factor, offset + ratio * start))
        if name not in self.positions:
            raise RequestError(f'{passed[-1]} follows {name!r}, which is no joint'
                               f'{meant(name, self.positions)}')
        return found

    def source(self, name: str) -> Tuple[str, float, float]:
        """Return the joint that another depends on, or itself, with ratio and offset."""
        return self.sources(name)[-1]

    def limits(self, joints: Iterable[Joint]) -> Tuple[Dict[str, Limits], List[str]]:
        """
        Return the limits of each source, and a report on those that do not count.

        They are those of joints and of all that these depend on.
        """
        found: Dict[str, Limits] = {}
        reports: Dict[str, str] = {}
        named = {joint.name: joint for joint in self.joints if joint.position is not None}
        for joint in joints:
            own = self.sources(joint.name)
            source, ratio, offset = own[-1]
            for name, factor, start in own:
                if name not in named:
                    continue
                each = named[name]
                if each.limits:
                    ends = sorted(factor / ratio * end + (start - offset) / ratio
                                  for end in each.limits)
                    low, high, names = found.get(source, (-math.inf, math.inf, ()))
                    found[source] = Limits(max(low, ends[0]), min(high, ends[1]), (
                        *names, *[name] * (name not in names)))
                if each.no_limits:
                    reports[name] = f'Left out: the limits of {name}, {each.no_limits}.'
        return found, [*reports.values()]


def _limits(limits: Sequence[Any], is_continuous: bool
            ) -> Tuple[Optional[Tuple[float, float]], str]:
    """Return the limits that count, None without any, and those that do not, with the reason."""
    low, high = (math.copysign(math.inf, end) if abs(end) >= FARTHEST else end
                 for end in map(float, limits))
    if -low == high == math.inf:
        return None, ''
    text = f'from {low:.4g} to {high:.4g}'
    if is_continuous:
        return None, f'{text}: it is continuous' if low < high else ''
    return ((low, high), '') if low < high else (None, f'{text}: they are no range')
