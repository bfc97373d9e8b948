# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

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
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
import math
from typing import Any, Dict, Iterable, Iterator, List, Optional, Sequence
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from . import shapes
from .output_range import common_reach, ground_frame, Travel, travels
from .pieces import BALL, BOX, Piece, Place, Point, ROD
from .robot import Body, HINGE, Robot, SLIDE
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


@dataclass(eq=False)
class Part:
    """The robot of one mechanism, whose root stands on a link of another; or that of a file."""

    robot: Robot
    base: str = ''
    pose: Sequence[float] = ()
    machine: Optional[SceneMechanism] = None

    def bodies(self) -> Iterator[Body]:
        """Yield its bodies, parents first, with the root if it stands on a link."""
        if self.base:
            yield Body(self.robot.root, self.base, self.pose)
        yield from self.robot.bodies()

    @cached_property
    def joints(self) -> List[str]:
        """Return the names of all joints, including fixed ones."""
        robot = self.robot
        return [f'{robot.root}_fixed', *(f'{point.name}_fixed' for point in robot.points),
                *(joint.name for joint in robot.joints)]

    @cached_property
    def links(self) -> List[str]:
        """Return the names of the bodies and their points."""
        return [*self.robot.frames, *(point.name for point in self.robot.points)]


@dataclass
class Model:
    """
    Robots below a root link: what all formats are written from.

    Attributes
    ----------
    parts : list of Part
        The robot of each mechanism.
    density : float
        Of all bodies [kg/m^3], for a simulation.

    """

    name: str
    root: str
    parts: List[Part]
    density: float = 0.0

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
          width: Optional[float] = None) -> Model:
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


def together(robots: Sequence[Model]) -> Model:
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
    made = Model('linkages', root, [part for robot in sorted(
        robots, key=lambda robot: len(lines[robot.root])) for part in robot.parts])
    made.check_names('mechanisms')
    return made


def _robot(machine: SceneMechanism, frame_id: str, width: Optional[float]) -> Model:
    part = Part(_Tree(machine, width).robot(), frame_id, machine.pose, machine)
    made = Model(machine.name, frame_id, [part])
    made.check_names(f'{machine.name}.joints')
    _check_places(machine, _numbers(part))
    return made


def _numbers(part: Part) -> Iterator[float]:
    yield from part.pose
    for frame in part.robot.frames.values():
        yield from frame[:3, 3]
    for joint in part.robot.joints:
        yield from joint.limits or ()
    for point in part.robot.points:
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

    def robot(self) -> Robot:
        """Return ground, crank and legs; the ground is the root."""
        ground = self._name('', GROUND)
        self._robot = Robot(ground, {ground: np.eye(4)})
        legs = self._assembly.legs
        self._robot.pieces[ground] = [
            piece for side in dict.fromkeys(leg.side for leg in legs.values())
            for piece in self._sliding(side, GROUND)]
        if self._shared:
            self._with_hub(self._move('', 1.0, self._shared))
        for prefix, leg in legs.items():
            ends: Counter[str] = Counter()
            self._robot.points += self._points(prefix, leg.side, GROUND, ground, ends)
            for link in self._links:
                name = self._name(prefix, link.name)
                if link is self._shared:
                    # The pins of a leg are fixed to the crank of all legs.
                    self._robot.hang(name, self._name('', link.name),
                                     (0.0, 0.0, 0.0, 0.0, 0.0, -leg.lag))
                else:
                    self._move(prefix, leg.side, link)
                self._robot.pieces[name] = [*self._bars(leg.side, link.name),
                                            *self._sliding(leg.side, link.name)]
                points = [*self._points(prefix, leg.side, link.name, name, ends, link.joint)]
                self._robot.points += points
                if not points:
                    self._with_hub(name)
        return self._robot

    def _move(self, prefix: str, side: float, link: Link) -> str:
        """Add a body that moves on its parent; in a mirrored leg the other way round."""
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
        name = self._name(prefix, link.name)
        self._robot.hang(
            name, self._name(prefix, link.parent), (x, y, 0.0, 0.0, 0.0, zero),
            SLIDE if prismatic else HINGE,
            (called.sign * side, 0.0, 0.0) if prismatic else (0.0, 0.0, called.sign),
            called.travel(travel) if travel else None, called.name)
        return name

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

    def _points(self, prefix: str, side: float, name: str, body: str, ends: Counter[str],
                but: str = '') -> Iterator[Point]:
        """Yield joints of a link, including those that it was cut off."""
        for point, place in self._frames[name].items():
            if point != but:
                met = f'{self._machine.name}_{prefix}{point}'
                ends[point] += 1
                cut = f'_cut{ends[point] - 1 if ends[point] > 2 else ""}' * (ends[point] > 1)
                yield Point(met + cut, body, self._place(side, name, place), met if cut else '',
                            JOINT * self._thickness)

    def _with_hub(self, body: str) -> None:
        """Add a visible hub with a weight to a body without joints."""
        origin = (0.0, 0.0)
        self._robot.pieces.setdefault(body, []).append(
            Piece(BALL, 'joint', JOINT * self._thickness, origin, origin))

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


def add(parent: Element, tag: str, *values: Any, **attributes: str) -> Element:
    """Add an element to a robot model in XML; its text is a word or numbers."""
    made = SubElement(parent, tag, attributes)
    if values:
        made.text = values[0] if isinstance(values[0], str) else numbers(*values)
    return made
