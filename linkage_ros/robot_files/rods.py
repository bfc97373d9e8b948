# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Loops of a robot that are not planar, as linkages of rods: ankles, waists, Achilles rods.

A body that hangs on two balls is a rod; two bodies with a ball each and a driven slide between
them are a cylinder; the others are links on a tree of hinges and slides. All angles count from the
pose that the robot has.
"""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Mapping, Sequence

import numpy as np

from . import check
from .planar import chain, Group
from .. import mechanisms, scene
from ..linkage import FORMS, short, theta_of, WindowError
from ..robot_model.robot import BALL, HINGE, Joint, NotDriven, plain, Robot, SLIDE
from ..words import join_names

# A hinge with wider limits [rad] has none.
_ANY = 0.999 * math.pi
# The least sine of an angle that places a hinge of a universal joint.
_SQUARE = 0.1
# Number of poses along each side of the motors' ranges, and how these are made smaller.
_SIDE, _SMALLER, _TRIES = 13, 0.85, 40


class Rods:
    """
    The lines of a group of joints.

    Raises
    ------
    ValueError
        If they are no tree of hinges and slides with rods between its links.

    """

    def __init__(self, robot: Robot, group: Group):
        ground = group.ground
        self._seen = np.linalg.inv(robot.frames[ground])
        self._driven = {*robot.driven}
        # The joint of each link, and the end of its line: its parent, its place and its axis.
        self.links: dict[str, tuple[Joint, str]] = {}
        self.rods: list[str] = []
        self.drives: list[check.Source] = []
        self._names: set[str] = {*FORMS, 'ground', 'at', 'axis', 'within', 'length'}
        rods = {body: ends for body, ends in _on_bodies(group.joints).items()
                if body != ground and [joint.kind for joint in ends] == [BALL, BALL]}
        joints = [hinge for joint in group.joints for hinge in (
            [joint] if {*joint.bodies} & rods.keys() else joint.hinges)]
        held_by = _on_bodies(joints)
        halves = [joint for joint in joints if joint.kind == SLIDE and joint.name in self._driven
                  and all(len(held_by[body]) == 2 and body != ground for body in joint.bodies)]
        self._bodies = {ground: 'ground'}
        separate = {*rods, *(body for half in halves for body in half.bodies)}
        links = [joint for joint in joints if not separate & {*joint.bodies} and (
            joint.kind == HINGE or joint.kind == SLIDE and joint.name not in self._driven)]
        while reached := [joint for joint in links
                          if len({*joint.bodies} & self._bodies.keys()) == 1]:
            self._add(reached[0])
        # All others are between a link and a rod or a cylinder.
        known = [*halves, *(joint for joint, _ in self.links.values())]
        if wrong := [joint.name for joint in joints if joint not in known and not (
                separate & {*joint.bodies} and self._bodies.keys() & {*joint.bodies})]:
            raise ValueError('links on hinges and undriven slides can be joined by rods '
                             f'and cylinders, not by {join_names(wrong)}')
        for body, (first, second) in rods.items():
            self._rod(first.name, self._end(first, body), self._end(second, body),
                      first.place(body) - second.place(body))
            self._universal(body, (first, second))
        for half in halves:
            self._cylinder(half, [next(joint for joint in held_by[body] if joint is not half)
                                  for body in half.bodies])

    def _named(self, name: str) -> str:
        name = plain(name, 50)
        while name in self._names:
            name += '_'
        self._names.add(name)
        return name

    def _text(self, vector: np.ndarray, is_place: bool = True) -> str:
        seen = self._seen[:3, :3] @ vector + self._seen[:3, 3] * is_place
        return ' '.join(short(float(x)) for x in seen)

    def _add(self, joint: Joint) -> None:
        """Add a link, and its joint with a link that is there."""
        base, body = sorted(joint.bodies, key=self._bodies.__contains__, reverse=True)
        name = self._bodies[body] = self._link(
            joint, self._bodies[base], joint.place(base), joint.motion(body))
        if joint.name in self._driven:
            self.drives.append(check.Source(name, joint.name, 1.0, 0.0 - joint.start, 0.0))

    def _end(self, joint: Joint, body: str) -> str:
        """Return the other end of a ball of a rod: its link and place."""
        other = joint.other(body)
        return f'{self._bodies[other]} {self._text(joint.place(other))}'

    def _link(self, joint: Joint, base: str, place: np.ndarray, axis: np.ndarray) -> str:
        """Add a link on a joint with another one, and return its name."""
        name = self._named(joint.name)
        self.links[name] = joint, f'{base} at {self._text(place)} axis {self._text(axis, False)}'
        return name

    def _rod(self, name: str, first: str, second: str, way: np.ndarray) -> None:
        """Add a rod between two ends."""
        length = short(float(np.linalg.norm(way)))
        self.rods.append(f'{self._named(name)} rod {first} {second} length {length}')

    def _universal(self, body: str, balls: Sequence[Joint]) -> None:
        """Add two hinges of a ball at an end of a rod, if it has some; a third one stays."""
        for ball, other in balls, balls[::-1]:
            base, place = ball.other(body), ball.place(body)
            hinges, axes = zip(*((hinge, sign * hinge.axes[0])
                                 for hinge, sign in chain(ball, base)))
            way = other.place(body) - place
            # A third hinge stays, unless the other end needs it.
            if not 2 <= len(hinges) <= 2 + (len(other.hinges) != 2) or None in [
                    hinge.position for hinge in hinges]:
                continue
            # Along the second axis, and a quarter turn about it: no dead point is near.
            marks = axes[1] * np.linalg.norm(way), np.cross(axes[1], way)
            if min(abs(axis @ np.cross(mark, way)) for mark, axis in zip(marks, axes)
                   ) < _SQUARE * way @ way:
                continue
            link = self._bodies[base]
            for hinge, axis, mark in zip(hinges, axes, marks):
                # The limits of a rod's hinges do not count.
                link = self._link(replace(hinge, limits=None), link, place, axis)
                self._rod(f'{hinge.name}_mark', self._end(other, body),
                          f'{link} {self._text(place + mark)}', way - mark)
            return

    def _cylinder(self, half: Joint, balls: Sequence[Joint]) -> None:
        ends = [ball.place(body) for ball, body in zip(balls, half.bodies)]
        way = ends[1] - ends[0]
        if np.linalg.norm(np.cross(half.axes[0], way)) > 1e-6 * np.linalg.norm(way):
            raise ValueError(f'{half.name} does not slide along the line of its balls')
        name = self._named(half.name)
        self.rods.append(f'{name} cylinder ' + ' '.join(
            self._end(ball, body) for ball, body in zip(balls, half.bodies)))
        length, sign = float(np.linalg.norm(way)), float(np.sign(half.axes[0] @ way))
        self.drives.append(check.Source(name, half.name, sign, length - sign * half.start, length))

    def lines(self, limits: Mapping[str, tuple[float, float]] = {}) -> list[str]:
        """Return the lines, with limits for some other than the file's."""
        lines, motors = [], {drive.name for drive in self.drives}
        for name, (joint, end) in self.links.items():
            # Relative to the pose of the robot.
            low, high = limits.get(name) or np.subtract(joint.range, joint.start)
            widest = math.inf if joint.kind == SLIDE else _ANY
            is_limited = name not in motors and -widest < low < high < widest
            within = f' within {short(low)} {short(high)}' if is_limited else ''
            word = 'motor' if name in motors else joint.kind
            lines.append(f'{name} {word} {end}{within}')
        return lines + self.rods


def _on_bodies(joints: Sequence[Joint]) -> dict[str, list[Joint]]:
    return {body: [joint for joint in joints if body in joint.bodies]
            for joint in joints for body in joint.bodies}


def described(robot: Robot, group: Group, others: Sequence[check.Imported]) -> check.Imported:
    """Return a mechanism; raise ValueError for loops that rods cannot be."""
    made = Rods(robot, group)
    if not made.drives:
        raise NotDriven('not driven: --driven must name its motors')
    sources = [drive.source for drive in made.drives]
    limits, reports = robot.limits(joint for joint in robot.joints if joint.name in sources)
    lines = made.lines()
    try:
        mechanisms.create('rods', joints=lines)
    except WindowError as error:
        if not error.limits:
            raise
        lines = made.lines(error.limits)
        ranges = ', '.join(f'{name} from {low + zero:.4g} to {high + zero:.4g}'
                           for name, (low, high) in error.limits.items()
                           for zero in [made.links[name][0].start])
        angles = ' (angles from the pose of the file)' * (' at ' in error.problem)
        reports.append(f'Limits: {error.problem}{angles}; these are the largest proved to have '
                       f'one pose at most: {ranges}.')
    name, parameters, mechanism = check.mechanism(
        others, f'{made.drives[0].name}_rods', 'rods', lines, made.drives, [
            (link, 1.0, joint.name, joint.start) for link, (joint, _) in made.links.items()
            if joint.name not in sources and joint.position is not None], frame_id=group.ground)
    for drive, (low, high) in zip(mechanism.inputs.values(), _sweeps(mechanism, limits)):
        parameters[f'{name}.{drive.input.name}.sweep'] = [float(short(low)), float(short(high))]
    return check.Imported(name, parameters, reports, sources)


def _sweeps(mechanism: scene.SceneMechanism, limits: Mapping[str, tuple[float, float]]
            ) -> list[list[float]]:
    """Return the ends of the inputs: limits, made smaller until every pose in them exists."""
    drives = mechanism.inputs.values()
    low, high = np.sort([np.multiply(limits.get(drive.source, (-math.inf, math.inf)), drive.ratio)
                         + drive.offset for drive in drives]).T
    start = np.clip([drive.start for drive in drives], low, high)
    size = np.array([2.5 if drive.input.is_angle else 0.5 * drive.start for drive in drives])
    for share in _SMALLER ** np.arange(_TRIES):
        ends = np.clip([start - share * size, start + share * size], low, high)
        values = np.meshgrid(*np.linspace(ends[0], ends[1], _SIDE).T)
        angles = mechanism.linkage.joint_angles(theta_of(values))
        if np.isfinite(list(angles.values())).all():
            break
    return ends.T.tolist()
