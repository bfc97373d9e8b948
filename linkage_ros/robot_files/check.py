# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Check by substitution: what is published, put into the robot's own joints, closes its loops.

Joints without a published position, such as the balls of rods, close the loops as well as they
can. So mechanisms are wrong where the loops stand open, or where they have no pose and the robot
has. One mechanism and the scene of a whole robot are checked in the same way.
"""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Any, Dict, List, Mapping, NamedTuple, Sequence, Set, Tuple

import numpy as np

from .spatial import Component, components, EXACT
from .. import scene
from ..robot_model.robot import Robot, SLIDE

# Number of paths of several motors, of poses on all paths, and of poses that a check needs.
PATHS, POSES, MIN_POSES = 12, 240, 200
# A misfit of the file opens its loops by less than this factor times it.
MISFIT = 10.0
# A mechanism whose joints are farther off in the file's pose [rad, or of the size] is another.
OTHER = 1e-3
# A loop that closes with a larger step of a joint [rad, or of the size] than this is another pose.
LEAP = 0.35
# Stiffness next to a change point, as a part of the largest.
CHANGE = 0.25
# The report on loops of a whole robot that stand open.
OPEN = 'Open:'

Ranges = Dict[str, Tuple[float, float]]


class Difference(ValueError):
    """How mechanisms differ from their robot, or why they could not be compared."""


class Imported(NamedTuple):
    """
    A mechanism's name, its parameters and its report.

    Also the ranges of sources in which it was checked, the misfit of the file, of the size, and
    hinges of balls that may stay where they are.
    """

    name: str
    parameters: Dict[str, Any]
    reports: List[str]
    ranges: Ranges
    slack: float = 0.0
    still: Sequence[str] = ()


class Walk(NamedTuple):
    """
    Positions along paths (paths, steps), and how far loops stand open there [m].

    A gap is NaN where there is no pose. `joints` has the sources, too; `poses` are those of each
    step. `good` tells where the loops are closed on all of the way.
    """

    joints: Dict[str, np.ndarray]
    gaps: np.ndarray
    poses: List[np.ndarray]
    good: np.ndarray


def compared(robot: Robot, machine: scene.SceneMechanism, driven: Sequence[str], ends: Ranges,
             slack: float) -> Tuple[str, Ranges]:
    """
    Put what a mechanism publishes into the loops of its robot; report on it.

    Also return the ranges of its sources in the poses that were checked.

    Parameters
    ----------
    robot : Robot
        In a pose in which its loops are closed.
    machine : SceneMechanism
        The mechanism.
    driven : sequence of str
        The joints that move it, its sources or what follows them.
    ends : dict
        Between which positions each source moves [rad or m].
    slack : float
        The misfit of the file, of the size.

    Raises
    ------
    Difference
        If the loops stand open, or if they are closed in fewer than MIN_POSES poses.

    """
    component = next(each for each in components(replace(robot, driven=[*driven]))
                     if {*driven} & {joint.name for joint in each.joints})
    loops = _Loops(component, [machine], {name: robot.source(name) for name in driven},
                   {source: robot.positions[source] for source in ends}, slack)
    loops.check_start()
    low, high = corners = np.array([*ends.values()]).T
    loops.enter(low, high)
    walk, beyond = loops.walk_to(corners if len(ends) == 1 else np.random.default_rng(1).uniform(
        low, high, (PATHS, len(ends))), POSES, MIN_POSES)
    if (count := walk.good.sum()) < MIN_POSES:
        raise Difference(f'it could not be checked in more than {count} poses')
    ranges = {source: (float(min(values.min(), first)), float(max(values.max(), first)))
              for source, first in loops.start.items()
              for values in [walk.joints[source][walk.good]]}
    moved = ', '.join(f'{source} from {low:.4g} to {high:.4g}'
                      for source, (low, high) in ranges.items())
    return (f'Checked: {machine.name}: in {count} poses of the robot, {moved}, its loops stand '
            f'open by {walk.gaps[walk.good].max():.0e} m at most{beyond}.'), ranges


def whole(robot: Robot, machines: Mapping[str, scene.SceneMechanism], imported: Sequence[Imported]
          ) -> List[str]:
    """
    Put what all mechanisms of a scene publish into all loops of a robot, and report on them.

    All motors move at once towards both ends of the ranges in which their mechanisms were checked,
    less far where a loop that is left out ends.
    """
    worst, count, reports = 0.0, POSES // 2, []
    start = {drive.source: (drive.start - drive.offset) / drive.ratio
             for machine in machines.values() for drive in machine.inputs.values()}
    corners = {name: (value, value) for name, value in start.items()}
    for source in {source for each in imported for source in each.ranges}:
        lows, highs = zip(*(each.ranges[source] for each in imported if source in each.ranges))
        low, high = corners[source] = max(lows), min(highs)
        start[source] = min(max(robot.positions[source], low), high)
    movers = {*robot.driven, *(source for each in imported for source in each.ranges)}
    for component in components(robot):
        sources = {name: robot.source(name)
                   for name in component.positions.keys() & published(machines)}
        motors = {name: way for name, way in sources.items() if way[0] in movers}
        if len(motors) == len(sources):
            continue
        loops = _Loops(component, [*machines.values()], {
            name: way for name, way in motors.items() if way[0] in start}, start, max(
            (each.slack for each in imported if each.ranges.keys() & component.positions),
            default=0.0))
        try:
            walk, _ = loops.walk_to(np.array([corners[name] for name in start]).T, POSES // 2,
                                    POSES // 4)
        except Difference as error:
            reports.append(f'{OPEN} the loops of {", ".join(sorted(sources))}: {error}.')
            continue
        worst = max(worst, float(np.max(walk.gaps, where=walk.good, initial=0.0)))
        count = min(count, int(walk.good.sum()))
    return [f'Checked: the whole robot: in {count} poses, its loops stand open by {worst:.0e} m '
            'at most.', *reports]


def published(machines: Mapping[str, scene.SceneMechanism]) -> Set[str]:
    """Return the joints that a scene publishes or reads."""
    return {drive.source for machine in machines.values() for drive in machine.inputs.values()} | {
        called.name for machine in machines.values() for called in machine.joints.values()
        if called.published}


class _Loops:
    """
    Loops that share joints, and what mechanisms publish of them.

    `start` has the position of each source where walks start [rad or m].
    """

    def __init__(self, component: Component, machines: Sequence[scene.SceneMechanism],
                 motors: Mapping[str, Tuple[str, float, float]], start: Mapping[str, float],
                 slack: float):
        self._component, self._machines, self._motors = component, machines, motors
        self.start, self._slack = dict(start), MISFIT * slack
        self._allowed = (EXACT + self._slack) * component.size
        self._pose = component.at_start()
        self._misfit = component.errors(self._pose)[0]

    def check_start(self) -> None:
        """Raise Difference if a joint is not where the file has it."""
        positions = self._positions({
            name: np.full((1, 1), value) for name, value in self.start.items()})
        for joint in self._component.joints:
            if joint.name in positions and joint.position is not None:
                off = float(positions[joint.name][0, 0]) - joint.position
                off = off / self._component.size if joint.kind == SLIDE else math.remainder(
                    off, math.tau)
                if abs(off) > OTHER + self._slack:
                    raise Difference(f'{self._at(self.start)} {joint.name} is off by '
                                     f'{abs(off):.2g}')

    def enter(self, low: np.ndarray, high: np.ndarray) -> None:
        """Let walks start inside ranges of the sources, if there is a way from the file's pose."""
        inside = np.clip([*self.start.values()], low, high)
        if (inside != [*self.start.values()]).any():
            walk = self._walk(inside[None], POSES)
            if walk.good.all():
                self.start, self._pose = dict(zip(self.start, inside.tolist())), walk.poses[-1]

    def walk_to(self, targets: np.ndarray, count: int, fewest: int) -> Tuple[Walk, str]:
        """
        Return a walk of the sources to targets, a row each, and why it ends before, if it does.

        The way is shorter where too few of its poses are closed. Raises Difference if the loops
        stand open, or have no pose where the robot has one.
        """
        start, beyond = np.array([*self.start.values()]), ''
        walk = self._walk(start[None], 0)
        for _ in range(3):
            targets = targets[np.max(np.abs(targets - start), axis=1) > 1e-9]
            if not len(targets):
                break
            walk = self._walk(targets, -(-count // len(targets)))
            for path, step in enumerate(walk.good.sum(axis=1)):
                if not walk.good[path].all():
                    self._check_end(walk, path, step)
                    beyond = '; not beyond where its loops end'
            if walk.good.sum() >= fewest:
                break
            targets = start + (targets - start) * walk.good.mean(axis=1)[:, None]
        return walk, beyond

    def _walk(self, targets: np.ndarray, steps: int) -> Walk:
        """Return what is published on straight paths of the sources, and how it opens loops."""
        start = np.array([*self.start.values()])
        way = np.arange(1, steps + 1) / max(steps, 1)
        sources = dict(zip(self.start, np.moveaxis(
            start + (targets - start)[:, None] * way[:, None], -1, 0)))
        joints = self._positions(sources)
        gaps, poses = self._opened(joints, (len(targets), steps))
        return Walk({**sources, **joints}, gaps, poses,
                    np.logical_and.accumulate(gaps <= self._allowed, axis=1))

    def _positions(self, sources: Mapping[str, np.ndarray]) -> Dict[str, np.ndarray]:
        """Return positions of the loops' joints along paths."""
        positions = {**sources, **{name: ratio * sources[source] + offset
                                   for name, (source, ratio, offset) in self._motors.items()}}
        for machine in self._machines:
            values = [drive.ratio * positions[drive.source] + drive.offset
                      for drive in machine.inputs.values()]
            angles = machine.linkage.joint_angles(values if len(values) > 1 else values[0])
            positions.update((called.name, called.of(angles[link]))
                             for link, called in machine.joints.items() if called.published)
        return {name: values for name, values in positions.items()
                if name in self._component.named.keys() | self._component.cut_names}

    def _opened(self, joints: Mapping[str, np.ndarray], shape: Tuple[int, int]
                ) -> Tuple[np.ndarray, List[np.ndarray]]:
        """
        Put positions of joints into the loops; return how far they stand open [m].

        By how much the file's own misfit opens them does not count. A joint that closes a loop
        opens it by its error in angle times the loops' size. The poses are those of each step.
        """
        component = self._component
        fixed = component.is_of([*joints])
        isnan = np.any([np.isnan(values) for values in joints.values()], axis=0)
        pose, gaps, poses = np.repeat(self._pose, shape[0], axis=0), np.empty(shape), []
        for k in range(shape[1]):
            here = {name: np.where(isnan[:, k], component.positions[name], values[:, k])
                    for name, values in joints.items()}
            pose = component.moved_to(pose, here)
            pose = pose if fixed.all() else component.closed(pose, fixed)
            gaps[:, k] = np.max(np.abs(component.errors(pose)[0] - self._misfit), axis=1)
            read = component.read(pose)
            for name in here.keys() & component.cut_names:
                off = here[name] - read[name]
                gaps[:, k] = np.maximum(gaps[:, k], component.size * np.abs(
                    off - math.tau * np.round(off / math.tau)))
            poses.append(pose)
        return np.where(isnan, math.nan, gaps), poses

    def _check_end(self, walk: Walk, path: int, step: int) -> None:
        """
        Raise Difference if joints are wrong at the end of a path: its loops do not end there.

        They are wrong if they are all that closes the loops, or if the motors alone close them, by
        a step from the last pose on the path. Past a change point a robot can continue in two
        ways.
        """
        component, gap = self._component, float(walk.gaps[path, step])
        poses = [self._pose, *(each[[path]] for each in walk.poses[:step])]
        if math.isnan(gap) or not component.is_of([*walk.joints]).all():
            motors = {name: walk.joints[name][path, [step]] for name in self._motors}
            fixed = component.is_of([*motors])
            new = component.closed(component.moved_to(poses[-1], motors), fixed, 40)
            stiffness = component.stiffness(np.concatenate([*poses, new]), fixed)
            if not (np.max(np.abs(component.errors(new)[0] - self._misfit)) < self._allowed
                    and np.max(np.abs(component.away(new - poses[-1]))) < LEAP
                    and np.min(stiffness) > CHANGE * np.max(stiffness)):
                return
        raise Difference(self._at({
            source: walk.joints[source][path, step] for source in self.start
            if source in component.positions or len(self._machines) == 1}) + (
            ' it has no pose, where the loops of the robot are closed' if math.isnan(gap) else
            f' its loops stand open by {gap:.2g} m'))

    @staticmethod
    def _at(values: Mapping[str, float]) -> str:
        return 'with ' + ', '.join(
            f'{source} at {value:.4g}' for source, value in values.items())
