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
from dataclasses import replace
from itertools import product
import math
from typing import Any, Iterable, Iterator, Sequence
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from . import shapes
from .robot import FREE, HINGE, Robot, SLIDE, with_positions
from .shapes import BALL, BOX, CYLINDER, Piece, Place, weight
from .. import palette
from ..linkage import Arc, extremes, GROUND, Leg, Link, MAX_LENGTH, MIN_LENGTH
from ..scene import SceneError, SceneMechanism
from ..scene.motion import Motion
from ..words import join_names

# The colours of the markers, red, green, blue and opacity: bars, driven bodies, guides, joints.
COLOURS = {name: (*palette.rgb(code), 1.0) for name, code in (
    ('bar', palette.BAR), ('driven', palette.DRIVEN), ('slot', palette.SLOT),
    ('joint', palette.JOINT))}
# Of each kind of piece: shape, radius (of a box its thickness) as a fraction of the longest bar,
# and colour; none: that of the link that moves it.
STYLES = {'bar': (CYLINDER, 1 / 80, ''), shapes.ROD: (CYLINDER, 1 / 80, 'bar'),
          shapes.BARREL: (CYLINDER, 1 / 32, ''), shapes.GUIDE: (BOX, 1 / 80, 'slot'),
          shapes.BLOCK: (BOX, 1 / 20, ''), 'joint': (BALL, 1 / 40, 'joint')}
# Thickness of bars as a fraction of the longest.
WIDTH = 1 / 40
# Density of aluminium [kg/m^3].
DENSITY = 2700.0
# Margin at each end of a travel: [rad], for a slide as a fraction of the longest bar.
SLACK = 1e-6


def robot(mechanisms: Iterable[SceneMechanism], frame_id: str,
          width: float | None = None, density: float = 0.0) -> Robot:
    """
    Return mechanisms as one robot.

    Parameters
    ----------
    mechanisms : iterable of SceneMechanism
        Mechanisms of the model; a model of one mechanism has its name.
    frame_id : str
        The root link: the frame of the poses of mechanisms without their own frame.
    width : float, optional
        Thickness of bars [m], with all else in proportion; None: 1/40 of the longest bar.
    density : float, optional
        That of a robot for simulators [kg/m^3], with closed loops, masses, gears and motors. All
        inputs are at their starts, so that loops are closed at the beginning of a simulation.

    Raises
    ------
    SceneError
        If the links would not form a tree, the longest bar is out of range, or a robot for
        simulators has no pose.

    """
    trees = [_Tree(mechanism, mechanism.frame_id or frame_id, width, density)
             for mechanism in mechanisms]
    return replace(merged([tree.robot for tree in trees]), density=density)


def merged(robots: Sequence[Robot]) -> Robot:
    """
    Return robots of mechanisms as one; raise SceneError if they do not form a tree.

    They must have the same root link, or the root of one must be a link of another.
    """
    joints = [joint for robot in robots for joint in robot.joints]
    links = [joint.bodies[1] for joint in joints]
    roots = dict.fromkeys(robot.root for robot in robots)
    root, *more = [name for name in roots if name not in links] or roots
    made = Robot(root, {root: np.eye(4)}, joints,
                 name='linkages' if len(robots) > 1 else robots[0].name)
    for robot in robots:
        made.frames.update({link: frame for link, frame in robot.frames.items()
                            if link != robot.root})
        made.driven += robot.driven
        for key in ('follows', 'pieces', 'meets', 'servos', 'stands'):
            getattr(made, key).update(getattr(robot, key))
    # What hangs on itself, joined to the rest by nothing, is free in the tree.
    if more or root in links or FREE in [
            joint.kind for _, joint in made.spanning_tree()[0].values()]:
        raise SceneError('frame_id must be the same for all mechanisms of one robot model, or a '
                         f'link of another one of them, not {join_names(roots, 120)}')
    for tag, names in (('link', [root, *links]), ('joint', [joint.name for joint in joints])):
        (name, count), = Counter(names).most_common(1)
        if count > 1:
            raise SceneError(f'{join_names(f"{robot.name}.joints" for robot in robots)} must have '
                             f'other names: the robot model would have two {tag}s {name}')
    return made


def size(mechanism: SceneMechanism) -> float:
    """Return the length of the longest bar [m]; raise SceneError if it or a place is too far."""
    name, length = mechanism.name, mechanism.scale * float(mechanism.linkage.longest)
    if not MIN_LENGTH <= length <= MAX_LENGTH:
        raise SceneError(f'{name}.scale and {name}.dimensions must make the longest bar from '
                         f'{MIN_LENGTH:g} to {MAX_LENGTH:g} m long, not {length:g}')
    if max(map(abs, mechanism.pose)) > MAX_LENGTH:
        raise SceneError(f'{name}.pose must be within {MAX_LENGTH:g} m, not {mechanism.pose}')
    return length


class _Tree:
    """The bodies of a mechanism: ground, the root, crank and legs, in `robot`."""

    def __init__(self, mechanism: SceneMechanism, base: str, width: float | None, density: float):
        mechanism.check_planar()
        length = size(mechanism)
        self._length = length if width is None else width / WIDTH
        self._ball = self._piece('joint', (0.0, 0.0), (0.0, 0.0))
        self._mechanism, legs = mechanism, mechanism.assembly().legs
        self._shapes = shapes.shapes(mechanism)
        self._frames = {GROUND: shapes.ground_frame(mechanism.linkage), **mechanism.linkage.frames}
        self._travels = {name: settings.sweep for name, settings in mechanism.inputs.items()
                         if settings.sweep} if density else travels(mechanism)
        ground = self._body('', GROUND)
        self.robot = Robot(base, {base: np.eye(4)}, pieces={ground: []},
                           stands={ground: mechanism.pose}, name=mechanism.name)
        self.robot.add_body(ground, base, 6 * (0.0,))
        self._shared = mechanism.linkage.links[0] if len(legs) > 1 else None
        if self._shared:
            self._add_link('', 1.0, self._shared)
            self.robot.pieces[self._body('', self._shared.name)] = [self._ball]
        for prefix, leg in legs.items():
            self._add_leg(prefix, leg)
        if density:
            self.robot = _started(mechanism, self.robot, density)

    def _add_leg(self, prefix: str, leg: Leg) -> None:
        robot, ends = self.robot, Counter[str]()
        links = {link.name: link for link in self._mechanism.linkage.links}
        for name, frame in self._frames.items():
            body, link = self._body(prefix, name), links.get(name)
            if link and link is self._shared:
                # The pins of a leg are fixed to the crank of all legs.
                robot.add_body(body, self._body('', name), (0.0, 0.0, 0.0, 0.0, 0.0, -leg.lag))
            elif link:
                self._add_link(prefix, leg.side, link)
            pieces = robot.pieces.setdefault(body, [])
            pieces += [piece for piece in self._pieces(leg.side, name) if piece not in pieces]
            if link and not pieces:
                pieces.append(self._ball)
            for point, place in frame.items():
                if not link or point != link.joint:
                    ends[point] += 1
                    met = f'{self._mechanism.name}_{prefix}{point}'
                    cut = f'_cut{ends[point] - 1 if ends[point] > 2 else ""}' * (ends[point] > 1)
                    place = *self._place(leg.side, name, place), 0.0, 0.0, 0.0, 0.0
                    robot.add_body(met + cut, body, place)
                    robot.pieces[met + cut] = [self._ball]
                    if cut:
                        robot.meets[met + cut] = met

    def _add_link(self, prefix: str, side: float, link: Link) -> None:
        """Add a body that moves on its parent; in a mirrored leg the other way round."""
        slides, zero = link.kind == 'prismatic', side * float(np.asarray(link.zero))
        if side < 0.0 and link.parent == GROUND:
            zero += math.pi
        x, y = self._place(side, link.parent, self._frames[link.parent][link.joint])
        called = self._mechanism.joints[prefix + link.name]
        travel = self._travels.get(link.name)
        limits = travel and called.travel((side * travel[0], side * travel[1]))
        self.robot.add_body(
            self._body(prefix, link.name), self._body(prefix, link.parent),
            (x, y, 0.0, 0.0, 0.0, zero), SLIDE if slides else HINGE,
            (called.sign * side, 0.0, 0.0) if slides else (0.0, 0.0, called.sign),
            limits, called.name, called.offset)

    def _pieces(self, side: float, name: str) -> Iterator[Piece]:
        """Yield the bars of a link, and the guides, blocks, barrels and rods on it."""
        frame, bars = self._frames[name], self._mechanism.linkage.bars if name != GROUND else ()
        drawn = [('bar', name, frame[start], frame[end]) for start, end in bars
                 if start in frame and end in frame]
        drawn += [(shape.kind, shape.slide.name, shape.start[1:], shape.end[1:])
                  for shape in self._shapes if shape.start.link == name]
        for kind, mover, *ends in drawn:
            start, end = (self._place(side, name, place) for place in ends)
            if start != end:
                yield self._piece(kind, start, end, mover in self._mechanism.inputs)

    def _piece(self, kind: str, start: Place, end: Place, is_driven: bool = False) -> Piece:
        form, thickness, colour = STYLES[kind]
        return Piece(form, colour or ('driven' if is_driven else 'bar'), thickness * self._length,
                     start, end)

    def _body(self, prefix: str, name: str) -> str:
        return f'{self._mechanism.name}_{"" if name == GROUND else prefix}{name}_link'

    def _place(self, side: float, name: str, place: Sequence[float]) -> Place:
        """Return a place on a link [m]; a mirrored ground is so in y, a link in its bar."""
        x, y = (self._mechanism.scale * value for value in place)
        return (side * x, y) if name == GROUND else (x, side * y)


def travels(mechanism: SceneMechanism) -> dict[str, Arc]:
    """
    Return the travel of each joint: lower and upper end of its value [rad or m].

    That of an input is its reach; a full rotation and the crank of several legs, which all of them
    limit, have none. That of another joint is wider by SLACK; one that turns past +-pi has none.
    With several inputs, whose reach depends on each other, no other joint has one.
    """
    linkage, scale = mechanism.linkage, mechanism.scale_of
    ends: dict[str, Arc] = {}
    has_one_leg = mechanism.leg_pairs == 1 and not mechanism.mirrored
    for name, settings in mechanism.inputs.items():
        if has_one_leg and settings.sweep and not settings.input.is_whole(settings.reach):
            low, high = np.min(settings.reach), np.max(settings.reach)
            # A crank's angle is in the turn of its sweep.
            turns = math.tau * ((settings.sweep[1] - low) // math.tau) * settings.input.is_angle
            ends[name] = float(low + turns), float(high + turns)
    others = [name for name in linkage.joints if name not in mechanism.inputs]
    if len(mechanism.inputs) == 1 and others:
        ranges = linkage.cache.get_or_make('travels', lambda: np.array([[extremes(
            lambda theta, name=name: linkage.joint_angles(theta, [name])[name], low, high,
            linkage.is_angle(name)) for low, high in linkage.reach()] for name in others]))
        for name, lows, highs in zip(others, *ranges[..., 0].transpose(2, 0, 1)):
            slack = SLACK if linkage.is_angle(name) else SLACK * float(linkage.longest)
            low, high = float(lows.min()) - slack, float(highs.max()) + slack
            if not linkage.is_angle(name) or -math.pi < low < high <= math.pi:
                ends[name] = scale(name) * low, scale(name) * high
    return ends


def _started(mechanism: SceneMechanism, part: Robot, density: float) -> Robot:
    """Return the robot of a mechanism at the start of its inputs, with motors and gears."""
    joints = mechanism.joints
    assembly, linkage, inputs = mechanism.assembly(), mechanism.linkage, mechanism.inputs
    values = {name: Motion.of(settings).at(0)[0] for name, settings in inputs.items()}
    starts, solution = [*values.values()], assembly.solution((), assembly.joints)
    solution.solve(starts)
    for prefix, row in zip(assembly.legs, solution.rows.tolist()):
        values.update((prefix + name, value) for name, value in zip(assembly.joints, row))
    if not np.isfinite([*values.values()]).all():
        keys = ' and '.join(f'{mechanism.name}.{name}.start' for name in inputs)
        raise SceneError(f'{keys} must be where {mechanism.name} can be assembled, not at '
                         f'{", ".join(f"{start:g}" for start in starts)}')
    positions = {joints[name].name: joints[name].of(value) for name, value in values.items()}
    robot = with_positions(part, {name: positions[name] for name in part.positions})
    _add_slots(mechanism, robot)
    mass = sum(weight(pieces, density)[0] for pieces in robot.pieces.values() if pieces)
    tips = {link.name: link.tip for link in linkage.links}
    for name in inputs:
        joint, arm = joints[name], mechanism.scale * math.hypot(*linkage.frames[name][tips[name]])
        robot.driven.append(joint.name)
        robot.servos[joint.name] = mass, arm or size(mechanism)
    for by, driving in enumerate(inputs):
        for prefix, name in product(assembly.legs, linkage.geared_to(by)):
            geared, other = joints[prefix + name], joints[driving]
            ratio = geared.sign * linkage.gear(name, by)[0] * other.sign
            robot.follow(geared.name, other.name, ratio,
                         positions[geared.name] - ratio * positions[other.name])
    return robot


def _add_slots(mechanism: SceneMechanism, robot: Robot) -> None:
    """Add the bodies in slots of yokes, which have no joint in the tree."""
    for prefix in mechanism.assembly().legs:
        for link, pin in mechanism.linkage.yokes.items():
            name, point = (f'{mechanism.name}_{prefix}{end}' for end in (link, pin))
            slot, end = f'{name}_slot_link', f'{name}_pin'
            x, y, *_ = np.linalg.solve(robot.frames[f'{name}_link'], robot.frames[point])[:, 3]
            robot.add_body(slot, f'{name}_link', (x, y, 0.0, 0.0, 0.0, 0.5 * math.pi),
                           SLIDE, (1.0, 0.0, 0.0), None, f'{name}_slot')
            robot.add_body(end, slot, 6 * (0.0,))
            robot.pieces[slot] = robot.pieces[end] = robot.pieces[point]
            robot.meets[end] = point


def add(parent: Element, tag: str, text: Any = None, **attributes: Any) -> Element:
    """
    Add an element to a robot model in XML; its text and attributes are words or numbers.

    Those that are None are omitted.
    """
    made = SubElement(parent, tag, {
        key: _text(value) for key, value in attributes.items() if value is not None})
    if text is not None:
        made.text = _text(text)
    return made


def _text(value: Any) -> str:
    """Return a word, or numbers with all their digits; adding zero makes -0.0 plain."""
    return value if isinstance(value, str) else ' '.join(
        repr(number + 0.0) for number in np.ravel(value).astype(float).tolist())
