# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""
Robot models: the mechanisms of a scene as a tree of bodies, for all formats.

Each closed loop is cut open at a joint. A body's frame is at its parent joint, x along its bar;
its other joints are fixed points on it. A body that was cut off a joint has a point for this
joint, which coincides with the joint's own point in a closed loop::

    <frame_id>
      <mechanism>_ground_link             at the mechanism's pose; its plane is x-y
        <mechanism>_<link>_link           moved by <mechanism>_<link>, or by its joint_names
          <mechanism>_<point>             fixed, one for each joint of the linkage
          <mechanism>_<point>_cut         fixed, at the same joint on the link that was cut off

Legs of a walker have their prefix before link and point, and one crank for all of them.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain
import math
from typing import Any, Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from . import shapes
from .output_range import common_reach, ground_frame, Travel, travels
from .. import palette
from ..linkage import GROUND, Link
from ..scene import SceneError, SceneMechanism
from ..scene.legs import Assembly
from ..scene.scene_mechanism import IN_SPACE
from ..words import listed

# The colours of the markers: bars, driven bodies, guides and joints.
COLOURS = {'bar': palette.BAR, 'driven': palette.DRIVEN, 'slot': palette.SLOT,
           'joint': palette.JOINT}

# Fractions of the longest bar: radii of bars, joints and barrels, thickness of guides and blocks.
BAR, JOINT, BARREL, GUIDE, BLOCK = 1 / 80, 1 / 40, 1 / 32, 1 / 80, 1 / 20

# Range of sizes [m] that displays can draw in single precision.
SMALLEST, LARGEST = 1e-30, 1e30

# Names of shapes in all formats.
ROD, BOX, BALL = 'cylinder', 'box', 'sphere'
Place = Tuple[float, float]


class Piece(NamedTuple):
    """A visible shape of a body, from start to end [m], with a radius or a box's sizes [m]."""

    shape: str
    colour: str
    thickness: float
    start: Place
    end: Place

    @property
    def length(self) -> float:
        """Its length [m]."""
        return math.dist(self.start, self.end)

    @property
    def pose(self) -> Tuple[float, ...]:
        """Its middle x, y, z [m], roll, pitch, yaw [rad]; pitch lays a cylinder's z along x."""
        (x, y), (u, v) = self.start, self.end
        return (0.5 * (x + u), 0.5 * (y + v), 0.0,
                0.0, 0.5 * math.pi if self.shape == ROD else 0.0, math.atan2(v - y, u - x))

    @property
    def sizes(self) -> Dict[str, Tuple[float, ...]]:
        """Its sizes [m], by their names in URDF and SDF."""
        if self.shape == BOX:
            return {'size': (self.length, self.thickness, self.thickness)}
        length = {'length': (self.length,)} if self.shape == ROD else {}
        return {'radius': (self.thickness,), **length}


class Point(NamedTuple):
    """A joint of the linkage on a body; `meets` is the coinciding point if a loop was cut here."""

    name: str
    place: Place
    meets: str
    radius: float

    def ball(self, place: Place = (0.0, 0.0)) -> Piece:
        """Return its visible ball, at a place in its own frame or in another."""
        return Piece(BALL, 'joint', self.radius, place, place)


class Joint(NamedTuple):
    """The joint of a body: rotation about an axis or slide along it, with optional limits."""

    name: str
    kind: str
    axis: Sequence[float]
    travel: Optional[Travel] = None

    def motion(self, position: float) -> np.ndarray:
        """Return the displacement by a position [rad or m] as a matrix (4, 4)."""
        made, axis = np.eye(4), np.asarray(self.axis, float)
        if self.kind == 'prismatic':
            made[:3, 3] = position * axis
        else:
            skew = np.cross(np.eye(3), axis)
            made[:3, :3] += math.sin(position) * skew + (1.0 - math.cos(position)) * skew @ skew
        return made


class Motor(NamedTuple):
    """The motor of an input: start, sweep if any, moved mass [kg] and arm [m]."""

    joint: str
    turns: bool
    start: float
    sweep: Sequence[float]
    mass: float
    arm: float


@dataclass
class Body:
    """
    A body.

    Attributes
    ----------
    parent : str
        The body, or the point of one, that it hangs on.
    pose : sequence of float
        x, y, z [m], roll, pitch, yaw [rad] on its parent with its joint at zero.
    position : float
        The position of its joint where a simulation starts [rad or m].

    """

    name: str
    parent: str
    pose: Sequence[float]
    joint: Optional[Joint] = None
    pieces: List[Piece] = field(default_factory=list)
    points: List[Point] = field(default_factory=list)
    position: float = 0.0

    @property
    def start(self) -> Sequence[float]:
        """Return its pose on its parent where a simulation starts."""
        return coordinates(pose(*self.pose) @ self.joint.motion(self.position)) \
            if self.joint else self.pose

    @property
    def solid(self) -> List[Piece]:
        """Return what is seen of it and of its points."""
        return [*self.pieces, *(point.ball(point.place) for point in self.points)]


@dataclass(eq=False)
class Part:
    """The bodies of one mechanism, or of a robot's file; parents first."""

    bodies: List[Body]
    machine: Optional[SceneMechanism] = None

    @cached_property
    def joints(self) -> List[str]:
        """Return the names of all joints, including fixed ones."""
        return [name for body in self.bodies for name in (
            body.joint.name if body.joint else f'{body.name}_fixed',
            *(f'{point.name}_fixed' for point in body.points))]

    @cached_property
    def links(self) -> List[str]:
        """Return the names of the bodies and their points."""
        return [name for body in self.bodies for name in (
            body.name, *(point.name for point in body.points))]


@dataclass
class Robot:
    """
    Bodies below a root link without a body: what all formats are written from.

    Attributes
    ----------
    parts : list of Part
        The bodies of each mechanism.
    motors : list of Motor
        The motors, for a simulation.
    gears : dict
        For each joint that follows another one its name and the ratio.
    density : float
        Of all bodies [kg/m^3], for a simulation.

    """

    name: str
    root: str
    parts: List[Part]
    motors: List[Motor] = field(default_factory=list)
    gears: Dict[str, Tuple[str, float]] = field(default_factory=dict)
    density: float = 0.0

    @property
    def bodies(self) -> List[Body]:
        """Return the bodies of all mechanisms."""
        return [body for part in self.parts for body in part.bodies]

    def check_names(self, parameter: str) -> None:
        """Raise SceneError if two links or two joints have the same name."""
        for tag, several in (('joint', [part.joints for part in self.parts]),
                             ('link', [part.links for part in self.parts])):
            names = set().union(*several)
            if tag == 'link' and self.root in names:
                raise SceneError('frame_id must differ from the links of the robot model, '
                                 f'not be {self.root!r}')
            if len(names) < sum(map(len, several)):
                (name, _), = Counter(chain(*several)).most_common(1)
                raise SceneError(f'{parameter} must have other names: the robot model would have '
                                 f'two {tag}s {name}')


def robot(machines: Iterable[SceneMechanism], frame_id: str,
          width: Optional[float] = None) -> Robot:
    """
    Return mechanisms as one robot model.

    Parameters
    ----------
    machines : iterable of SceneMechanism
        Mechanisms of the model; a model of one mechanism has its name.
    frame_id : str
        The root link: the frame of the poses of mechanisms without their own frame.
    width : float, optional
        Thickness of bars [m], with all else in proportion; None: 1/40 of the longest bar.

    Raises
    ------
    SceneError
        If two links or two joints would have the same name, the links would not form a tree, or
        a size is out of range.

    """
    return together([_robot(machine, machine.frame_id or frame_id, width) for machine in machines])


def together(robots: Sequence[Robot]) -> Robot:
    """
    Return robot models as one; raise SceneError if they do not form a tree.

    They must have the same root link, or the root of one must be a link of another.
    """
    if len(robots) == 1:
        return robots[0]
    roots = {robot.root for robot in robots}
    above = {name: robot.root for robot in robots for part in robot.parts
             for name in roots.intersection(part.links)}
    # From each root link those on which it is, up to the last.
    lines = {robot.root: [robot.root] for robot in robots}
    for line in lines.values():
        while len(line) <= len(roots) and line[-1] in above:
            line.append(above[line[-1]])
    root, *more = tops = dict.fromkeys(line[-1] for line in lines.values())
    if more or root in above:
        raise SceneError('frame_id must be the same for all mechanisms of one robot model, or a '
                         f'link of another one of them, not {listed(tops, 120)}')
    made = Robot('linkages', root, [part for robot in sorted(
        robots, key=lambda robot: len(lines[robot.root])) for part in robot.parts])
    made.check_names('mechanisms')
    return made


def _robot(machine: SceneMechanism, frame_id: str, width: Optional[float]) -> Robot:
    bodies = list(_Tree(machine, width).bodies(frame_id))
    made = Robot(machine.name, frame_id, [Part(bodies, machine)])
    made.check_names(f'{machine.name}.joints')
    _check_places(machine, _numbers(made))
    return made


def _numbers(robot: Robot) -> Iterator[float]:
    for body in robot.bodies:
        yield from body.pose
        yield from body.joint.travel or () if body.joint else ()
        for point in body.points:
            yield from point.place


def size(machine: SceneMechanism) -> float:
    """Return the length of the longest bar [m]; raise SceneError if it is out of range."""
    length = machine.scale * float(machine.linkage.longest)
    if not SMALLEST <= length <= LARGEST:
        raise SceneError(
            f'{machine.name}.scale and {machine.name}.dimensions must make the longest bar from '
            f'{SMALLEST:g} to {LARGEST:g} m long, not {length:g}')
    return length


def check_range(machine: SceneMechanism) -> None:
    """Raise SceneError if the longest bar or the pose is out of range."""
    size(machine)
    _check_places(machine, machine.pose)


def _check_places(machine: SceneMechanism, numbers: Iterable[float]) -> None:
    for value in numbers:
        if not abs(value) <= LARGEST:
            raise SceneError(f'{machine.name}.pose, {machine.name}.scale and {machine.name}'
                             f'.dimensions must keep everything within {LARGEST:g} m, not at '
                             f'{value:g}')


class _Tree:
    """The bodies of a mechanism."""

    def __init__(self, machine: SceneMechanism, width: Optional[float]):
        if machine.in_space:
            raise SceneError(f'{machine.name} is {IN_SPACE}')
        length = size(machine)
        self._thickness = length if width is None else 0.5 * width / BAR
        self._machine, self._assembly = machine, machine.assembly()
        self._links = machine.linkage.links
        self._shapes = shapes.shapes(machine)
        self._frames = {GROUND: ground_frame(machine.linkage), **machine.linkage.frames}
        self._travels = {**travels(machine.linkage, machine.reach),
                         **_input_travels(machine, self._assembly)}
        self._shared = len(self._assembly.legs) > 1 and self._links[0]

    def bodies(self, root: str) -> Iterator[Body]:
        """Yield ground, crank and legs."""
        legs = self._assembly.legs
        ground = Body(self._name('', GROUND), root, self._machine.pose, pieces=[
            piece for side in dict.fromkeys(leg.side for leg in legs.values())
            for piece in self._sliding(side, GROUND)])
        yield ground
        if self._shared:
            yield self._with_hub(self._moving('', 1.0, self._shared))
        for prefix, leg in legs.items():
            ends: Counter[str] = Counter()
            ground.points += self._points(prefix, leg.side, GROUND, ends)
            for link in self._links:
                # The pins of a leg are fixed to the crank of all legs.
                body = self._moving(prefix, leg.side, link) if link is not self._shared else Body(
                    self._name(prefix, link.name), self._name('', link.name),
                    (0.0, 0.0, 0.0, 0.0, 0.0, -leg.lag))
                body.pieces += (*self._bars(leg.side, link.name),
                                *self._sliding(leg.side, link.name))
                body.points += self._points(prefix, leg.side, link.name, ends, link.joint)
                yield self._with_hub(body)

    def _moving(self, prefix: str, side: float, link: Link) -> Body:
        """Return a body that moves on its parent; in a mirrored leg the other way round."""
        prismatic, mirrored = link.kind == 'prismatic', side < 0.0
        zero = float(np.asarray(link.zero))
        zero = math.pi - zero if mirrored and link.parent == GROUND else zero
        travel = self._travels.get(link.name)
        if travel and mirrored:
            travel = -travel[1], -travel[0]
        if travel and prismatic:
            travel = self._machine.scale * travel[0], self._machine.scale * travel[1]
        x, y = self._place(side, link.parent, self._frames[link.parent][link.joint])
        called = self._machine.joints[prefix + link.name]
        # The link's position at a published value of zero.
        back = -called.sign * called.offset
        if prismatic:
            x, y = x + side * back * math.cos(zero), y + side * back * math.sin(zero)
        else:
            zero += back
        if travel:
            travel = called.travel(travel)
        axis = (called.sign * side, 0.0, 0.0) if prismatic else (0.0, 0.0, called.sign)
        joint = Joint(called.name, link.kind, axis, travel)
        return Body(self._name(prefix, link.name), self._name(prefix, link.parent),
                    (x, y, 0.0, 0.0, 0.0, zero), joint)

    def _bars(self, side: float, name: str) -> Iterator[Piece]:
        """Yield the bars of a link as rods."""
        for bar in self._machine.linkage.bars:
            if self._frames[name].keys() >= {*bar}:
                start, end = (self._place(side, name, self._frames[name][point]) for point in bar)
                yield Piece(ROD, self._colour(name), BAR * self._thickness, start, end)

    def _colour(self, name: str) -> str:
        return 'driven' if name in self._machine.inputs else 'bar'

    def _sliding(self, side: float, name: str) -> Iterator[Piece]:
        """Yield the guides, blocks, barrels and rods in them on a link."""
        for shape in self._shapes:
            if shape.start.link == name:
                start, end = (self._place(side, name, spot[1:]) for spot in shape[2:])
                drawn, thickness, colour = {
                    shapes.GUIDE: (BOX, GUIDE, 'slot'), shapes.ROD: (ROD, BAR, 'bar'),
                    shapes.BLOCK: (BOX, BLOCK, self._colour(shape.slide.name)),
                    shapes.BARREL: (ROD, BARREL, self._colour(shape.slide.name))}[shape.kind]
                if start != end:
                    yield Piece(drawn, colour, thickness * self._thickness, start, end)

    def _points(self, prefix: str, side: float, name: str, ends: Counter[str], but: str = ''
                ) -> Iterator[Point]:
        """Yield joints of a link, including those that it was cut off."""
        for point, place in self._frames[name].items():
            if point != but:
                met = f'{self._machine.name}_{prefix}{point}'
                ends[point] += 1
                cut = f'_cut{ends[point] - 1 if ends[point] > 2 else ""}' * (ends[point] > 1)
                yield Point(met + cut, self._place(side, name, place), met if cut else '',
                            JOINT * self._thickness)

    def _with_hub(self, body: Body) -> Body:
        """Return a body; one without joints has a visible hub with a weight."""
        if not body.points:
            origin = (0.0, 0.0)
            body.pieces.append(Piece(BALL, 'joint', JOINT * self._thickness, origin, origin))
        return body

    def _name(self, prefix: str, name: str) -> str:
        return f'{self._machine.name}_{"" if name == GROUND else prefix}{name}_link'

    def _place(self, side: float, name: str, place: Sequence[float]) -> Place:
        """Return a place on a link [m]; a mirrored ground is so in y, a link in its bar."""
        x, y = (self._machine.scale * value for value in place)
        return (side * x, y) if name == GROUND else (x, side * y)


def _input_travels(machine: SceneMechanism, assembly: Assembly) -> Dict[str, Optional[Travel]]:
    """Return the outermost ends of each input's reach, unscaled; None: full rotation."""
    found: Dict[str, Optional[Travel]] = {}
    for input_ in machine.linkage.inputs:
        single = len(machine.inputs) == 1
        arcs = common_reach(assembly) if single else [(input_.low, input_.high)]
        if not arcs or input_.is_whole(arcs):
            found[input_.name] = None
            continue
        low, high = min(lo for lo, _ in arcs), max(hi for _, hi in arcs)
        sweep = machine.inputs[input_.name].sweep if input_.turns else None
        # A crank's angle is in the turn of its sweep.
        turns = math.tau * math.floor((sweep[1] - low) / math.tau) if sweep else 0.0
        found[input_.name] = low + turns, high + turns
    return found


def numbers(*values: float) -> str:
    """Return numbers with all their digits; adding zero makes -0.0 plain."""
    return ' '.join(repr(float(value) + 0.0) for value in values)


def pose(x: float, y: float, z: float, roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Return a pose as a matrix (4, 4), by its place [m] and its angles about fixed axes [rad]."""
    (cr, cp, cy), (sr, sp, sy) = np.cos((roll, pitch, yaw)), np.sin((roll, pitch, yaw))
    about_z, about_y, about_x = np.array([
        [[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]], [[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]],
        [[1, 0, 0], [0, cr, -sr], [0, sr, cr]]])
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = about_z @ about_y @ about_x, (x, y, z)
    return made


def coordinates(matrix: np.ndarray) -> Tuple[float, ...]:
    """Return x, y, z [m], roll, pitch and yaw [rad] of a pose (4, 4)."""
    a, b = matrix[:2, 0]
    yaw = math.atan2(b, a) if math.hypot(a, b) > 1e-9 else 0.0
    sin, cos = math.sin(yaw), math.cos(yaw)
    ahead, aside = matrix[:2, 2], matrix[:2, 1]
    return (*matrix[:3, 3].tolist(),
            math.atan2(sin * ahead[0] - cos * ahead[1], cos * aside[1] - sin * aside[0]),
            math.atan2(-matrix[2, 0], cos * a + sin * b), yaw)


def add(parent: Element, tag: str, *values: Any, **attributes: str) -> Element:
    """Add an element to a robot model in XML; its text is a word or numbers."""
    made = SubElement(parent, tag, attributes)
    if values:
        made.text = values[0] if isinstance(values[0], str) else numbers(*values)
    return made
