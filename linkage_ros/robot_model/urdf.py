# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Robot models: the mechanisms of a scene as URDF.

A URDF is a tree, so each closed loop is cut open at a joint. A link's own frame is on the joint
that it hangs on, x along its bar; the joints that it carries are frames fixed to it. A link that
was cut off a joint has a frame for it too, which coincides with the joint's as long as the loop
is closed::

    <frame_id>
      <mechanism>_ground_link             at the mechanism's pose; its plane is x-y
        <mechanism>_<link>_link           moved by <mechanism>_<link>, or by its joint_names
          <mechanism>_<point>             fixed, one for each joint of the linkage
          <mechanism>_<point>_cut         fixed, on the link that has to meet that joint

Legs of a walker have their prefix before link and point, and one crank for all of them. There are
no inertias: a scene says nothing about masses. Limits have effort and velocity 0: not known.

Format: the URDF XML specification of ROS (wiki.ros.org/urdf/XML).
"""

from __future__ import annotations

from collections import Counter
import math
import re
from typing import Dict, Iterable, Optional, Sequence, Set, Tuple
from xml.etree import ElementTree

from . import shapes
from .. import palette
from ..linkage.builder import GROUND
from ..linkage.output_range import common_reach, ground_frame, Travel, travels
from ..scene import Machine, SceneError
from ..words import listed

COLOURS = {'orange': palette.ORANGE, 'blue': palette.BLUE, 'green': palette.GREEN,
           'vermilion': palette.VERMILION, 'sky': palette.SKY, 'purple': palette.PURPLE,
           'grey': palette.DARK}
*BARS, JOINTS = COLOURS

# As parts of the longest bar: radii of bars, joints and barrels, thickness of guides and blocks.
BAR, JOINT, BARREL, GUIDE, BLOCK = 1 / 80, 1 / 40, 1 / 32, 1 / 80, 1 / 20

# The links and joints of a model as it is written here, and its root.
_NAMED = re.compile(r'^  <(link|joint) name="([^"]*)"', re.MULTILINE)
_ROOT = '  <link name="{}" />\n'

# Sizes [m] between which nothing that is drawn is lost in single precision, as displays have it.
SMALLEST, LARGEST = 1e-30, 1e30


def describe(machines: Iterable[Machine], frame_id: str) -> str:
    """
    Return mechanisms as one robot model.

    Parameters
    ----------
    machines : iterable of Machine
        What is in it; the model of a single one bears its name.
    frame_id : str
        The root link: the frame of the poses of those that have none of their own.

    Returns
    -------
    str
        URDF.

    Raises
    ------
    SceneError
        If two links or two joints would have the same name, the whole would be no tree, or
        something is too large or small.

    """
    return together([_described(machine, machine.frame_id or frame_id) for machine in machines])


def together(models: Sequence[str]) -> str:
    """
    Return robot models of mechanisms as one; raise SceneError if they make no tree.

    All have the same root link, or that of one is a link of another.
    """
    if len(models) == 1:
        return models[0]
    named = [_NAMED.findall(model) for model in models]
    root = _root(named)
    twice = [key for key, count in Counter(key for keys in named for key in keys[1:]).items()
             if count > 1]
    if twice:
        raise SceneError(_doubled('mechanisms', *twice[0]))
    parts = [model.partition(_ROOT.format(keys[0][1])) for model, keys in zip(models, named)]
    materials = parts[0][0].partition('\n')[2]
    bodies = [body.removesuffix('</robot>') for *_, body in parts]
    return f'<robot name="linkages">\n{materials}{_ROOT.format(root)}{"".join(bodies)}</robot>'


def _root(named) -> str:
    """Return the link that all models hang on, by the names in each, its root's first."""
    frames = [keys[0][1] for keys in named]
    above = {name: keys[0][1] for keys in named for tag, name in keys[1:] if tag == 'link'}
    for _ in named:
        frames = [above.get(frame, frame) for frame in frames]
    tops = dict.fromkeys(frames)
    if len(tops) > 1 or frames[0] in above:
        raise SceneError('frame_id must be the same for all mechanisms of one robot model, or a '
                         f'link of another one of them, not {listed(tops, 120)}')
    return frames[0]


def _described(machine: Machine, frame_id: str) -> str:
    robot = _Robot(machine.name, frame_id)
    try:
        _Model(robot, machine).add_to(frame_id)
    except OverflowError as error:
        raise SceneError(f'{machine.name}.pose, {machine.name}.scale and {machine.name}'
                         f'.dimensions must keep everything within {LARGEST:g} m, not at '
                         f'{error}') from None
    return robot.text()


def size(machine: Machine) -> float:
    """Return the longest bar [m]; raise SceneError where it cannot be drawn."""
    length = machine.scale * float(machine.linkage.longest)
    if not SMALLEST <= length <= LARGEST:
        raise SceneError(
            f'{machine.name}.scale and {machine.name}.dimensions must make the longest bar from '
            f'{SMALLEST:g} to {LARGEST:g} m long, not {length:g}')
    return length


class _Model:
    """A mechanism as links and joints of a robot."""

    def __init__(self, robot, machine: Machine):
        self._size = size(machine)
        self._robot, self._machine, self._assembly = robot, machine, machine.assembly()
        self._links = machine.linkage.links
        self._bars = machine.linkage.bars
        self._shapes = shapes.shapes(machine)
        self._frames = {GROUND: ground_frame(machine.linkage), **machine.linkage.frames}
        self._travels = {**travels(machine.linkage, machine.reach),
                         **_input_travels(machine, self._assembly)}
        self._shared = len(self._assembly.legs) > 1 and self._links[0]

    def add_to(self, root: str):
        """Add ground, crank and legs."""
        ground = self._robot.fix(root, self._link('', GROUND), self._machine.pose)
        for side in dict.fromkeys(leg.side for leg in self._assembly.legs.values()):
            self._draw_shapes(side, GROUND, ground, JOINTS)
        if self._shared:
            self._hang('', 1.0, self._shared)
        for prefix, leg in self._assembly.legs.items():
            self._add(prefix, leg)

    def _add(self, prefix, leg):
        ends: Counter[str] = Counter()
        self._add_points(prefix, leg.side, GROUND, self._frames[GROUND], ends)
        for i, link in enumerate(self._links):
            element = (self._lag(prefix, leg, link) if link is self._shared
                       else self._hang(prefix, leg.side, link))
            self._draw(leg.side, link, element, BARS[i % len(BARS)])
            carried = [point for point in self._frames[link.name] if point != link.joint]
            self._add_points(prefix, leg.side, link.name, carried, ends)

    def _lag(self, prefix, leg, crank):
        """Fix a leg's pins to the crank of all legs."""
        return self._robot.fix(self._link('', crank.name), self._link(prefix, crank.name),
                               (0.0, 0.0, 0.0, 0.0, 0.0, -leg.lag))

    def _hang(self, prefix, side, link):
        """Add a link that moves on its parent; in a mirrored leg the other way round."""
        prismatic, mirrored = link.kind == 'prismatic', side < 0.0
        zero = math.pi - link.zero if mirrored and link.parent == GROUND else link.zero
        axis = (side, 0.0, 0.0) if prismatic else (0.0, 0.0, 1.0)
        travel = self._travels.get(link.name)
        if travel and mirrored:
            travel = -travel[1], -travel[0]
        if travel and prismatic:
            travel = self._machine.scale * travel[0], self._machine.scale * travel[1]
        x, y = self._place(side, link.parent, link.joint)
        called = self._machine.joints[prefix + link.name]
        # Where the link is when what is published is zero.
        back = -called.sign * called.offset
        if prismatic:
            x, y = x + side * back * math.cos(zero), y + side * back * math.sin(zero)
        else:
            zero += back
        if travel:
            travel = min(ends := [*map(called.of, travel)]), max(ends)
        return self._robot.move(
            called.name, link.kind, self._link(prefix, link.parent),
            self._link(prefix, link.name), (x, y, 0.0, 0.0, 0.0, zero),
            [called.sign * part for part in axis], travel)

    def _draw(self, side, link, element, colour):
        """Add bars as rods, and what slides on a link or is the slide."""
        frame = self._frames[link.name]
        for first, second in self._bars:
            if first in frame and second in frame:
                _draw_rod(element, colour, BAR * self._size, self._place(side, link.name, first),
                          self._place(side, link.name, second))
        self._draw_shapes(side, link.name, element, colour)

    def _draw_shapes(self, side, link, element, colour):
        """Add guides, blocks, barrels and the rods in them."""
        for shape in self._shapes:
            if shape.start.link == link:
                start, end = (self._seen(side, link, spot[1:]) for spot in shape[2:])
                draw, thickness = {
                    shapes.GUIDE: (_draw_box, GUIDE), shapes.BLOCK: (_draw_box, BLOCK),
                    shapes.BARREL: (_draw_rod, BARREL), shapes.ROD: (_draw_rod, BAR)}[shape.kind]
                draw(element, colour, thickness * self._size, start, end)

    def _add_points(self, prefix, side, link, points, ends):
        """Add joints of a link as links of their own, those that it was cut off as well."""
        for point in points:
            name = f'{self._machine.name}_{prefix}{point}'
            ends[point] += 1
            if ends[point] > 1:
                name += f'_cut{ends[point] - 1 if ends[point] > 2 else ""}'
            element = self._robot.fix(self._link(prefix, link), name,
                                      (*self._place(side, link, point), *[0.0] * 4))
            _draw(element, JOINTS, [0.0] * 6, 'sphere', radius=_numbers(JOINT * self._size))

    def _link(self, prefix, name):
        return f'{self._machine.name}_{"" if name == GROUND else prefix}{name}_link'

    def _place(self, side, link, point):
        """Return x, y [m] of a point of a link; the ground is mirrored in y, a link in its bar."""
        return self._seen(side, link, self._frames[link][point])

    def _seen(self, side, link, place):
        """Return x, y [m] of a place on a link."""
        x, y = (self._machine.scale * value for value in place)
        return (side * x, y) if link == GROUND else (x, side * y)


def _input_travels(machine, assembly) -> Dict[str, Optional[Travel]]:
    """Return the outermost ends of each input's reach, unscaled; None: it turns all round."""
    found: Dict[str, Optional[Travel]] = {}
    for input_ in machine.linkage.inputs:
        single = len(machine.inputs) == 1
        arcs = common_reach(assembly) if single else [(input_.low, input_.high)]
        if not arcs or input_.is_whole(arcs):
            found[input_.name] = None
            continue
        low, high = min(lo for lo, _ in arcs), max(hi for _, hi in arcs)
        sweep = machine.inputs[input_.name].sweep if input_.turns else None
        # A crank is in the turn that it is driven in.
        turns = math.tau * math.floor((sweep[1] - low) / math.tau) if sweep else 0.0
        found[input_.name] = low + turns, high + turns
    return found


class _Robot:
    """The elements of a URDF."""

    def __init__(self, name: str, root: str):
        self._element = ElementTree.Element('robot', name=name)
        self._name, self._root = name, root
        self._names: Set[Tuple[str, str]] = set()
        for colour, code in COLOURS.items():
            material = ElementTree.SubElement(self._element, 'material', name=colour)
            ElementTree.SubElement(material, 'color', rgba=_numbers(*palette.rgb(code), 1.0))
        self._named('link', root)

    def fix(self, parent: str, child: str, pose: Sequence[float]) -> ElementTree.Element:
        """Return a new link that is fixed to another at x, y, z [m], roll, pitch, yaw [rad]."""
        self._joint(f'{child}_fixed', 'fixed', parent, child, pose)
        return self._named('link', child)

    def move(self, joint: str, kind: str, parent: str, child: str, pose: Sequence[float],
             axis: Sequence[float], travel: Optional[Travel]) -> ElementTree.Element:
        """Return a new link that turns about an axis of its own or slides along it."""
        endless = kind == 'revolute' and not travel
        element = self._joint(joint, 'continuous' if endless else kind, parent, child, pose)
        ElementTree.SubElement(element, 'axis', xyz=_numbers(*axis))
        if travel:
            lower, upper = map(_numbers, travel)
            ElementTree.SubElement(element, 'limit', lower=lower, upper=upper,
                                   effort='0', velocity='0')
        return self._named('link', child)

    def text(self) -> str:
        """Return the whole."""
        ElementTree.indent(self._element)
        return ElementTree.tostring(self._element, encoding='unicode')

    def _joint(self, name, kind, parent, child, pose):
        element = self._named('joint', name, type=kind)
        ElementTree.SubElement(element, 'parent', link=parent)
        ElementTree.SubElement(element, 'child', link=child)
        _origin(element, pose)
        return element

    def _named(self, tag, name, **attributes):
        if (tag, name) == ('link', self._root) and self._names:
            raise SceneError(f'frame_id must be no link of the robot model, not {name!r}')
        if (tag, name) in self._names:
            raise SceneError(_doubled(f'{self._name}.joints', tag, name))
        self._names.add((tag, name))
        return ElementTree.SubElement(self._element, tag, name=name, **attributes)


def _doubled(whose, tag, name) -> str:
    return f'{whose} must be other names: the robot model would have two {tag}s {name}'


def _draw_rod(element, colour, radius, start, end):
    x, y, length, angle = _between(start, end)
    # A cylinder's axis is z: it is laid down along x, then turned.
    _draw(element, colour, (x, y, 0.0, 0.0, 0.5 * math.pi, angle), 'cylinder',
          radius=_numbers(radius), length=_numbers(length))


def _draw_box(element, colour, thickness, start, end):
    x, y, length, angle = _between(start, end)
    _draw(element, colour, (x, y, 0.0, 0.0, 0.0, angle), 'box',
          size=_numbers(length, thickness, thickness))


def _between(start, end):
    """Return the middle x, y of two places, how far apart they are, and the angle between."""
    along = end[0] - start[0], end[1] - start[1]
    return (0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1]), math.hypot(*along),
            math.atan2(along[1], along[0]))


def _draw(element, colour, pose, shape, **sizes):
    visual = ElementTree.SubElement(element, 'visual')
    _origin(visual, pose)
    ElementTree.SubElement(ElementTree.SubElement(visual, 'geometry'), shape, sizes)
    ElementTree.SubElement(visual, 'material', name=colour)


def _origin(element, pose):
    if any(pose):
        ElementTree.SubElement(element, 'origin', xyz=_numbers(*pose[:3]),
                               rpy=_numbers(*pose[3:]))


def _numbers(*values: float) -> str:
    """Return numbers with all their digits; adding zero makes -0.0 plain."""
    for value in values:
        if not abs(value) <= LARGEST:
            raise OverflowError(f'{value:g}')
    return ' '.join(repr(float(value) + 0.0) for value in values)
