# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The model of a robot: bodies and the joints between them, all in one pose.

Readers of MJCF, SDF and URDF fill it, and so do the mechanisms of a scene; writers print it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
import math
import re
from typing import Any, Collection, Iterable, Iterator, Mapping, NamedTuple, Sequence

import numpy as np

from .shapes import Piece
from ..words import RequestError, suggestion

HINGE, SLIDE, BALL, FIXED, UNIVERSAL, FREE = (
    'hinge', 'slide', 'ball', 'fixed', 'universal', 'free')
# What files call them, in small letters.
KINDS = {'revolute': HINGE, 'continuous': HINGE, 'prismatic': SLIDE, 'spherical': BALL, '3d': BALL,
         '6d': FIXED, 'revolute2': UNIVERSAL, 'floating': FREE}
# No robot has parts farther off [m], or limits [m or rad].
MAX_NUMBER = 1e9


def at(place: Any, turned: Any = ((1, 0, 0), (0, 1, 0), (0, 0, 1))) -> np.ndarray:
    """Return a pose by its place and its rotation matrix."""
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = turned, place
    return made


def pose(x: float, y: float, z: float, roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Return a pose as a matrix (4, 4), by its place [m] and its angles about fixed axes [rad]."""
    about_x, about_y, about_z = exponentials(screws(np.eye(3), np.zeros(3)), np.array([
        roll, pitch, yaw]))
    return at((x, y, z), (about_z @ about_y @ about_x)[:3, :3])


def turned_by(quaternion: Any) -> np.ndarray:
    """Return the rotation matrix of a quaternion w, x, y, z."""
    w, *axis = np.asarray(quaternion) / np.linalg.norm(quaternion)
    across = np.cross(np.eye(3), axis)
    return np.eye(3) + 2.0 * (w * across + across @ across)


def coordinates(matrix: np.ndarray) -> tuple[float, ...]:
    """Return x, y, z [m], roll, pitch and yaw [rad] of a pose (4, 4)."""
    (a, d, g, x), (b, e, h, y), (c, _, _, z), _ = matrix.tolist()
    yaw = math.atan2(b, a) if math.hypot(a, b) > 1e-9 else 0.0
    sin, cos = math.sin(yaw), math.cos(yaw)
    return (x, y, z, math.atan2(sin * g - cos * h, cos * e - sin * d),
            math.atan2(-c, cos * a + sin * b), yaw)


def screws(axes: np.ndarray, places: np.ndarray, slides: Any = False) -> np.ndarray:
    """Return the velocities (..., 4, 4) of unit motions about axes at places, or along them."""
    made = np.zeros((*axes.shape[:-1], 4, 4))
    slides = np.asarray(slides)[..., None]
    made[..., :3, :3] = np.where(slides[..., None], 0.0, np.cross(np.eye(3), axes[..., None, :]))
    made[..., :3, 3] = np.where(slides, axes, np.cross(places, axes))
    return made


def exponentials(screw: np.ndarray, by: np.ndarray, slides: Any = False) -> np.ndarray:
    """Return displacements by positions [rad or m] of screws: their exponentials."""
    sine, less = np.where(slides, by, np.sin(by)), 1.0 - np.cos(by)
    return np.eye(4) + sine[..., None, None] * screw + less[..., None, None] * (screw @ screw)


class NotDriven(ValueError):
    """The motors do not determine the poses of a loop."""


@dataclass(eq=False)
class Joint:
    """
    A joint between two bodies; its position and limits, if it has one degree of freedom.

    Attributes
    ----------
    places : pair of array
        Its place on each body [m].
    axes : pair of array
        Its unit axis on each body; of a fixed joint the axes of its frame, as columns.
    limits : pair of float, optional
        Its lower and upper limit [rad or m], one of which may be infinite.
    no_limits : str
        The limits of the file and why they do not count, if they do not.
    is_cut : bool
        Whether it closes a loop of a tree, so that its two frames may be apart.
    parts : sequence of (Joint, float)
        The hinges that a ball is made of, from its first body to its second, if it is; with each
        its sign: 1 if its second body is nearer to that of the ball.

    """

    name: str
    kind: str
    bodies: tuple[str, str]
    places: Any
    axes: Any
    position: float | None = None
    limits: tuple[float, float] | None = None
    no_limits: str = ''
    is_cut: bool = False
    parts: Sequence[tuple[Joint, float]] = ()

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
    def start(self) -> float:
        """Return the position in the file [rad or m], 0 for a joint without one."""
        return self.position or 0.0

    @property
    def range(self) -> tuple[float, float]:
        """Return its limits [rad or m], infinite ones without any."""
        return self.limits or (-math.inf, math.inf)

    @property
    def hinges(self) -> list[Joint]:
        """Return the hinges of a ball that is made of some, else the joint itself."""
        return [hinge for hinge, _ in self.parts] or [self]


def plain(name: str, length: int) -> str:
    """Return a name of at most so many letters, digits and single underscores."""
    text = re.sub('[^A-Za-z0-9]+', '_', name).strip('_')[:length]
    return text if text[:1].isalpha() else f'joint_{text}'.rstrip('_')


@dataclass(eq=False)
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
    pieces : dict
        What is seen of bodies.
    meets : dict
        For each body that was cut off a closed loop the other one, whose origin is in its own.
    servos : dict
        The mass [kg] and the arm [m] that a driven joint moves.
    stands : dict
        The pose of each ground on its link; the frames of what it carries are relative to it.
    name : str
        Its name in a model.
    density : float
        Of all bodies [kg/m^3], for a simulation.

    """

    root: str
    frames: dict[str, np.ndarray] = field(default_factory=dict)
    joints: list[Joint] = field(default_factory=list)
    driven: list[str] = field(default_factory=list)
    follows: dict[str, tuple[str, float, float]] = field(default_factory=dict)
    held: dict[str, float] = field(default_factory=dict)
    pieces: dict[str, list[Piece]] = field(default_factory=dict)
    meets: dict[str, str] = field(default_factory=dict)
    servos: dict[str, tuple[float, float]] = field(default_factory=dict)
    stands: dict[str, Sequence[float]] = field(default_factory=dict)
    name: str = 'robot'
    density: float = 0.0

    def add_body(self, name: str, parent: str, place: Sequence[float], kind: str = FIXED,
                 axis: Sequence[float] = (0.0, 0.0, 1.0),
                 limits: tuple[float, float] | None = None, joint: str = '',
                 position: float = 0.0) -> None:
        """Add a body on another one, at x, y, z [m], roll, pitch, yaw [rad], and its joint."""
        self.frames[name] = self.frames[parent] @ pose(*place)
        self.join(joint or f'{name}_fixed', kind, (parent, name), self.frames[name], axis,
                  position=position)
        self.joints[-1].limits = limits

    def bodies(self) -> Iterator[Body]:
        """Yield the bodies except the root, parents first; joints are at origins."""
        magnitude = np.abs([frame[:3, 3] for frame in self.frames.values()]).max()
        for name, (base, joint) in self.spanning_tree()[0].items():
            frame, seen = self.frames[name], self.frames[base]
            if joint.kind in (HINGE, SLIDE) and joint.position is not None:
                origin = at(joint.place(name), frame[:3, :3])
                is_apart = np.abs(origin - frame).max() > 1e-12 * magnitude
                axis = np.round(origin[:3, :3].T @ joint.motion(name), 15) + 0.0
                yield Body(f'{name}/joint' if is_apart else name, base,
                           _seen(seen, origin, magnitude), joint, axis.tolist())
                if not is_apart:
                    continue
                base, seen = f'{name}/joint', origin
            yield Body(name, base, self.stands.get(name) or _seen(seen, frame, magnitude))

    def cut_loops(self) -> Robot:
        """
        Make a tree of the joints, and return it: the last joint of each loop is cut.

        Where it has a position, it moves a body of its own in the tree, welded to the other one.
        """
        # Of each body all that are joined to it; the fewer are added to the more.
        joined = {body: {body} for body in self.frames}
        for joint in [joint for joint in self.joints if not joint.is_cut]:
            base, body = joint.bodies
            fewer, more = sorted((joined[base], joined[body]), key=len)
            if fewer is not more:
                more |= fewer
                joined.update(dict.fromkeys(fewer, more))
            elif joint.position is None:
                joint.is_cut = True
            else:
                welded, frame = f'{body}/{joint.name}', at(joint.places[1])
                joint.bodies, self.frames[welded] = (base, welded), self.frames[body]
                self.join('', FIXED, (body, welded), frame, other=frame)
        return self

    def spanning_tree(self) -> tuple[dict[str, tuple[str, Joint]], list[Joint]]:
        """Return the parent and the joint of each body, and the joints that close loops."""
        near: dict[str, list[tuple[str, Joint]]] = {body: [] for body in self.frames}
        for joint in sorted(self.joints, key=lambda joint: joint.name not in self.driven):
            for body, other in (joint.bodies, joint.bodies[::-1]):
                near[body].append((other, joint))
        tree: dict[str, tuple[str, Joint]] = {}
        for start in (self.root, *self.frames):
            if start != self.root and start not in tree:
                # A body that only cuts connect.
                places = [self.frames[start][:3, 3]] * 2
                tree[start] = self.root, Joint('', FREE, (self.root, start), places, places)
            row = [start]
            for body in row:
                others = {other: (body, joint) for other, joint in near[body] if not joint.is_cut
                          and other != self.root and other not in tree}
                tree.update(others)
                row += others
        inside = {joint for _, joint in tree.values()}
        return tree, [joint for joint in self.joints if joint not in inside]

    def join(self, name: str, kind: str, bodies: tuple[str, str], frame: np.ndarray,
             axis: Any = (0.0, 0.0, 1.0), other: np.ndarray | None = None,
             position: float | None = None,
             limits: Sequence[Any] = (-math.inf, math.inf), second: Any = None) -> None:
        """
        Add a joint by its frame on the first body, and on the second where it closes a loop.

        The axes are in these frames; `second` is that of the second body, if it is another.
        """
        for body in bodies:
            if body not in self.frames:
                raise RequestError(f'joint {name} is on {body!r}, which is no link')
        is_limited = kind.lower() != 'continuous'
        ends, no_limits = _limits(limits) if is_limited else (None, '')
        kind = KINDS.get(kind.lower(), kind.lower() or 'none')
        if kind == UNIVERSAL:
            if second is None:
                raise RequestError(f'joint {name} is universal and must have two axes')
            # Two hinges with a cross between them.
            cross = f'{name}/cross'
            self.frames[cross] = frame
            self.join(name, HINGE, (bodies[0], cross), frame, axis, None, position)
            self.join(f'{name}/second', HINGE, (cross, bodies[1]), frame, second, other, position)
            return
        turns, places = zip(*((matrix[:3, :3], matrix[:3, 3])
                              for matrix in (frame, frame if other is None else other)))
        axes = axis, axis if second is None else second
        sizes = np.linalg.norm(axes, axis=1)
        if kind in (HINGE, SLIDE) and not np.all(sizes > 0.0):
            raise RequestError(f'the axis of joint {name} has no length')
        self.joints.append(Joint(
            name, kind, bodies, places, turns if kind == FIXED else tuple(
                turn @ axis / (size or 1.0) for turn, axis, size in zip(turns, axes, sizes)),
            position if kind in (HINGE, SLIDE) else None, ends, no_limits, other is not None))

    def close(self, name: str, kind: str, bodies: tuple[str, str], frames: Sequence[np.ndarray],
              axis: Any = (0.0, 0.0, 1.0), second: Any = None) -> None:
        """Close a loop by a joint, by its frame on each body as this has it; see `join`."""
        first, other = (self.frames[body] @ frame for body, frame in zip(bodies, frames))
        self.join(name, kind, bodies, first, axis, other, second=second)

    def follow(self, name: str, other: str, ratio: float, offset: float) -> None:
        """Make a joint dependent: ratio * position + offset of another."""
        if ratio:
            self.follows[name] = other, float(ratio), float(offset)

    def changes(self, name: str) -> tuple[str, float, float]:
        """Return what a joint follows, with ratio and offset of their changes from this pose."""
        other, ratio, offset = self.follows[name]
        return other, ratio, offset + ratio * self.positions[other] - self.positions[name]

    @property
    def positions(self) -> dict[str, float]:
        """Return the positions of all joints that have a name."""
        return {joint.name: joint.position for joint in self.joints if joint.position is not None}

    def check_names(self, names: Iterable[str]) -> None:
        """Raise RequestError for a name that no joint of one degree of freedom has."""
        for name in names:
            if name not in self.positions:
                raise RequestError(
                    f'there is no hinge or slide {name!r}{suggestion(name, self.positions, 200)}')

    def sources(self, name: str) -> list[tuple[str, float, float]]:
        """Return a joint and those that it depends on in turn, each with ratio and offset."""
        sources, passed = [(name, 1.0, 0.0)], [*self.driven]
        while name in self.follows and name not in passed:
            passed.append(name)
            _, ratio, offset = sources[-1]
            name, factor, start = self.follows[name]
            sources.append((name, ratio * factor, offset + ratio * start))
        return sources

    def source(self, name: str) -> tuple[str, float, float]:
        """Return the joint that another depends on, or itself, with ratio and offset."""
        return self.sources(name)[-1]

    def followers(self, names: Collection[str]) -> list[str]:
        """Return which joints of a loop follow motors, or joints elsewhere; all without motors."""
        sources = {name: self.source(name)[0] for name in names if name in self.follows}
        return [name for name, source in sources.items()
                if not self.driven or source in self.driven or source not in names]

    def limits(self, joints: Iterable[Joint]) -> tuple[dict[str, tuple[float, float]], list[str]]:
        """
        Return the limits of each source, and a report on those that do not count.

        They are those of joints and of all that these depend on.
        """
        limits: dict[str, tuple[float, float]] = {}
        reports: dict[str, str] = {}
        named = {joint.name: joint for joint in self.joints if joint.position is not None}
        for sources in (self.sources(joint.name) for joint in joints):
            source, ratio, offset = sources[-1]
            for name, factor, start in sources:
                joint = named.get(name)
                if joint and joint.limits:
                    ends = sorted(factor / ratio * end + (start - offset) / ratio
                                  for end in joint.limits)
                    low, high = limits.get(source, (-math.inf, math.inf))
                    limits[source] = max(low, ends[0]), min(high, ends[1])
                elif joint and joint.no_limits:
                    reports[name] = f'Left out: the limits of {name}, {joint.no_limits}.'
        return limits, [*reports.values()]


class Body(NamedTuple):
    """A body as formats write it: its pose on its parent, and its joint with its axis on it."""

    name: str
    parent: str
    pose: Sequence[float]
    joint: Joint | None = None
    axis: Sequence[float] = ()


def _seen(base: np.ndarray, frame: np.ndarray, magnitude: float) -> list[float]:
    """Return the coordinates of a pose in another, without rounding of places so large [m]."""
    turned = base[:3, :3].T
    *place, roll, pitch, yaw = coordinates(at(turned @ (frame[:3, 3] - base[:3, 3]),
                                              turned @ frame[:3, :3]))
    return [*(float(f'{x:.15g}') * (abs(x) > 4e-16 * magnitude) for x in place),
            *(round(angle, 15) for angle in (roll, pitch, yaw))]


def _limits(limits: Sequence[Any]) -> tuple[tuple[float, float] | None, str]:
    """Return the limits that count, None without any, and those that do not, with the reason."""
    low, high = (math.copysign(math.inf, end) if abs(end) >= MAX_NUMBER else end
                 for end in map(float, limits))
    if -low == high == math.inf:
        return None, ''
    why = f'from {low:.4g} to {high:.4g}: they are no range'
    return ((low, high), '') if low < high else (None, why)


def with_positions(robot: Robot, values: Mapping[str, float],
                   moves: Mapping[str, np.ndarray] = {}) -> Robot:
    """
    Return a robot with some joints moved; raise RequestError for an unknown joint.

    `moves` has displacements of bodies on their parents, by these joints or by others.
    """
    robot.check_names(values)
    moved = {robot.root: np.eye(4)}
    for body, (base, joint) in robot.spanning_tree()[0].items():
        step = moves.get(body, np.eye(4))
        if body not in moves and joint.name in values and joint.position is not None:
            slides, change = joint.kind == SLIDE, np.array(values[joint.name] - joint.position)
            screw = screws(joint.motion(body), joint.place(base), slides)
            step = exponentials(screw, change, slides)
        moved[body] = moved[base] @ step
    joints = [replace(
        joint, places=[(moved[body] @ [*place, 1.0])[:3]
                       for body, place in zip(joint.bodies, joint.places)],
        axes=[moved[body][:3, :3] @ axis for body, axis in zip(joint.bodies, joint.axes)],
        position=None if joint.position is None else values.get(joint.name, joint.position))
        for joint in robot.joints]
    return replace(robot, joints=joints, frames={
        body: moved[body] @ frame for body, frame in robot.frames.items()})
