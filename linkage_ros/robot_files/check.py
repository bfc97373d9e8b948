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

from .spatial import Component, components, EXACT, Poses
from .. import scene
from ..robot_model.robot import Robot, SLIDE

# Number of paths of several motors, of poses on all paths, and of poses that a check needs.
PATHS, POSES, FEWEST = 12, 240, 200
# A misfit of the file opens its loops by less than this factor times it.
MISFIT = 10.0
# A mechanism whose joints are farther off in the file's pose [rad, or of the size] is another.
OTHER = 1e-3
# A measured input turns back where it makes a larger step than this [rad, or of its size].
TURN = 0.1
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

    A gap is NaN where there is no pose. `joints` has the sources, too; `inputs` has the first
    input of each mechanism. `good` tells where the loops are closed on all of the way.
    """

    joints: Dict[str, np.ndarray]
    inputs: Dict[str, np.ndarray]
    gaps: np.ndarray
    poses: List[Poses]
    good: np.ndarray


def compared(robot: Robot, machine: scene.SceneMechanism, driven: Sequence[str], ends: Ranges,
             slack: float) -> Tuple[str, Ranges, Tuple[float, float]]:
    """
    Put what a mechanism publishes into the loops of its robot; report on it.

    Also return the ranges of its sources and of its first input in the poses that were checked.

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
        If the loops stand open, or if they are closed in fewer than FEWEST poses.

    """
    component = next(each for each in components(replace(robot, driven=[*driven]))
                     if {*driven} & {joint.name for joint in each.joints})
    loops = _Loops(component, [machine], {name: robot.source(name) for name in driven},
                   {source: robot.positions[source] for source in ends}, slack)
    loops.check_start()
    low, high = corners = np.array([*ends.values()]).T
    loops.enter(low, high)
    walk, beyond = loops.walk_to(corners if len(ends) == 1 else np.random.default_rng(1).uniform(
        low, high, (PATHS, len(ends))), POSES, FEWEST)
    if (count := walk.good.sum()) < FEWEST:
        raise Difference(f'it could not be checked in more than {count} poses')
    ranges = {source: loops.range_of(walk.joints[source][walk.good], first)
              for source, first in loops.start.items()}
    moved = ', '.join(f'{source} from {low:.4g} to {high:.4g}'
                      for source, (low, high) in ranges.items())
    return (f'Checked: {machine.name}: in {count} poses of the robot, {moved}, its loops stand '
            f'open by {walk.gaps[walk.good].max():.0e} m at most{beyond}.', ranges,
            loops.range_of(walk.inputs[machine.name][walk.good], loops.near[machine.name]))


def whole(robot: Robot, machines: Mapping[str, scene.SceneMechanism], imported: Sequence[Imported]
          ) -> List[str]:
    """
    Put what all mechanisms of a scene publish into all loops of a robot, and report on them.

    All motors move at once towards both ends of the ranges in which their mechanisms were checked,
    less far where a loop that is left out ends.
    """
    worst, count = 0.0, POSES // 2
    reports: List[str] = []
    start = {drive.source: (drive.start - drive.offset) / drive.ratio
             for machine in machines.values() for drive in machine.inputs.values()}
    corners = {name: (value, value) for name, value in start.items()}
    for source in {source for each in imported for source in each.ranges}:
        every = np.array([each.ranges[source] for each in imported if source in each.ranges])
        low, high = corners[source] = max(every[:, 0]), min(every[:, 1])
        start[source] = min(max(robot.positions[source], low), high)
    known = published(machines)
    movers = {*robot.driven, *(source for each in imported for source in each.ranges)}
    for component in components(robot):
        sources = {name: robot.source(name) for name in component.names & known}
        motors = {name: way for name, way in sources.items() if way[0] in movers}
        if len(motors) == len(sources):
            continue
        loops = _Loops(component, [*machines.values()], {
            name: way for name, way in motors.items() if way[0] in start}, start, max(
            (each.slack for each in imported if each.ranges.keys() & component.names),
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

    Attributes
    ----------
    start : dict
        The position of each source where walks start [rad or m].
    near : dict
        The first input of each mechanism there.

    """

    def __init__(self, component: Component, machines: Sequence[scene.SceneMechanism],
                 motors: Mapping[str, Tuple[str, float, float]], start: Mapping[str, float],
                 slack: float):
        self._component, self._machines, self._motors = component, machines, motors
        self.start, self._slack = dict(start), MISFIT * slack
        self._allowed = (EXACT + self._slack) * component.size
        self._poses, self._misfit = component.at_start(), component.errors(component.at_start())[0]
        self.near = {machine.name: machine.first.start for machine in machines}
        self.near.update((machine.name, float(machine.measured(
            drive.measures, drive.ratio * start[drive.source] + drive.offset, drive.start)[0]))
            for machine in machines if (drive := machine.first).measures)

    @staticmethod
    def range_of(values: np.ndarray, first: float) -> Tuple[float, float]:
        """Return the smallest and the largest of values and a first one."""
        return float(min(values.min(), first)), float(max(values.max(), first))

    def check_start(self) -> None:
        """Raise Difference if a joint is not where the file has it."""
        found, _ = self._positions({
            name: np.full((1, 1), value) for name, value in self.start.items()})
        for joint in self._component.joints:
            if joint.name in found and joint.position is not None:
                off = float(found[joint.name][0, 0]) - joint.position
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
                self.start = dict(zip(self.start, inside.tolist()))
                self.near = {name: float(values[0, -1]) for name, values in walk.inputs.items()}
                self._poses = walk.poses[-1]

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
            ended = [self._end(walk, path, step) for path, step in enumerate(
                walk.good.sum(axis=1)) if not walk.good[path].all()]
            beyond = f'; not beyond where its {ended[0]}' if ended else beyond
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
        found, inputs = self._positions(sources)
        gaps, poses = self._opened(found, (len(targets), steps))
        return Walk({**sources, **found}, inputs, gaps, poses,
                    np.logical_and.accumulate(gaps <= self._allowed, axis=1))

    def _positions(self, sources: Mapping[str, np.ndarray]
                   ) -> Tuple[Dict[str, np.ndarray], Dict[str, np.ndarray]]:
        """
        Return positions of the loops' joints along paths, and the first input of each mechanism.

        A measured input continues from `near`; beyond a jump of it there is no pose.
        """
        found = {**sources, **{name: ratio * sources[source] + offset
                               for name, (source, ratio, offset) in self._motors.items()}}
        inputs = {}
        for machine in self._machines:
            values = [drive.ratio * found[drive.source] + drive.offset
                      for drive in machine.inputs.values()]
            drive, near = machine.first, self.near[machine.name]
            jumps = np.zeros_like(values[0], bool)
            if drive.measures:
                for path in values[0]:
                    last = near
                    for i, value in enumerate(path):
                        path[i] = machine.measured(drive.measures, value, last)[0]
                        last = last if math.isnan(path[i]) else path[i]
                before = np.column_stack([np.full(len(values[0]), near), values[0][:, :-1]])
                jumps = ~(drive.input.apart(before, values[0]) < TURN * drive.input.size)
            inputs[machine.name] = values[0]
            angles = machine.linkage.joint_angles(values if len(values) > 1 else values[0])
            found.update((called.name, np.where(jumps, math.nan, called.of(angles[link])))
                         for link, called in machine.joints.items() if called.published)
        return {name: values for name, values in found.items()
                if name in self._component.names}, inputs

    def _opened(self, joints: Mapping[str, np.ndarray], shape: Tuple[int, int]
                ) -> Tuple[np.ndarray, List[Poses]]:
        """
        Put positions of joints into the loops; return how far they stand open [m].

        By how much the file's own misfit opens them does not count. A joint that closes a loop
        opens it by its error in angle times the loops' size. The poses are those of each step.
        """
        component = self._component
        fixed = component.columns_of([*joints])
        isnan = np.any([np.isnan(values) for values in joints.values()], axis=0)
        poses, gaps, each = self._poses.some(np.zeros(shape[0], int)), np.empty(shape), []
        free = np.zeros((shape[0], len(fixed)))
        for k in range(shape[1]):
            here = {name: np.where(isnan[:, k], component.positions[name], values[:, k])
                    for name, values in joints.items()}
            poses = component.stepped(poses, component.aimed(poses, free, {
                name: values for name, values in here.items()
                if name not in component.cut_names}))
            poses = poses if fixed.all() else component.closed(poses, fixed)
            gaps[:, k] = np.max(np.abs(component.errors(poses)[0] - self._misfit), axis=1)
            read = component.read(poses)
            for name in here.keys() & component.cut_names:
                off = here[name] - read[name]
                gaps[:, k] = np.maximum(gaps[:, k], component.size * np.abs(
                    off - math.tau * np.round(off / math.tau)))
            each.append(poses)
        return np.where(isnan, math.nan, gaps), each

    def _end(self, walk: Walk, path: int, step: int) -> str:
        """Return why a path ends at a step; raise Difference if the robot can move on."""
        for machine in self._machines:
            drive, values = machine.first, walk.inputs[machine.name]
            at = float(values[path, step - 1]) if step else self.near[machine.name]
            if drive.measures and any(drive.input.apart(at, end) < TURN * drive.input.size
                                      for arc in drive.reach for end in arc):
                return 'input turns back'
        gap = float(walk.gaps[path, step])
        if not self._is_wrong(walk, path, step):
            return 'loops end'
        raise Difference(self._at({
            source: walk.joints[source][path, step] for source in self.start
            if source in self._component.names or len(self._machines) == 1}) + (
            ' it has no pose, where the loops of the robot are closed' if math.isnan(gap) else
            f' its loops stand open by {gap:.2g} m'))

    def _is_wrong(self, walk: Walk, path: int, step: int) -> bool:
        """
        Return whether joints are wrong at the end of a path, rather than loops that end there.

        They are if they are all that closes the loops, or if the motors alone close them, by a
        step from the last pose on the path. Past a change point a robot can continue in two ways.
        """
        component = self._component
        here = [self._poses, *(each.some([path]) for each in walk.poses[:step])]
        if not math.isnan(walk.gaps[path, step]) and component.columns_of(
                [*component.names & walk.joints.keys()]).all():
            return True
        motors = {name: walk.joints[name][path, [step]] for name in self._motors}
        last, fixed = here[-1], component.columns_of([*motors])
        new = component.closed(component.stepped(last, component.aimed(
            last, np.zeros((1, len(fixed))), motors)), fixed, 40)
        leap = component.step_between(last, new) / component.unit
        stiffness = component.stiffness(Poses(*map(np.concatenate, zip(*here, new))), fixed)
        return bool(np.max(np.abs(component.errors(new)[0] - self._misfit)) < self._allowed
                    and np.max(np.abs(leap)) < LEAP
                    and np.min(stiffness) > CHANGE * np.max(stiffness))

    @staticmethod
    def _at(values: Mapping[str, float]) -> str:
        return 'with ' + ', '.join(
            f'{source} at {value:.4g}' for source, value in values.items())
