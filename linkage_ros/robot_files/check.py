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
Check by substitution: what is published, put into the robot's own joints, closes its loops.

Joints without a published position, such as the balls of rods, close the loops as well as they
can. So a mechanism is wrong where the loops stand open, or where it has no pose and the robot has.
"""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Any, Dict, List, Mapping, NamedTuple, Sequence, Set, Tuple

import numpy as np

from .robot import Robot, SLIDE
from .spatial import Component, components, EXACT, Poses
from .. import scene

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

# Parts of the motors' ranges that a check of the whole robot tries.
PARTS = 1.0, 0.3, 0.1
# The report on loops of a whole robot that stand open.
OPEN = 'Open:'

Ranges = Dict[str, Tuple[float, float]]


class Difference(ValueError):
    """How a mechanism differs from its robot, or why it could not be compared."""


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


class Track(NamedTuple):
    """
    Positions along paths (paths, steps), how far loops stand open there [m], and their poses.

    It is NaN where there is no pose. `joints` has the motors, too; `inputs` are those of the
    mechanism.
    """

    joints: Dict[str, np.ndarray]
    inputs: np.ndarray
    gaps: np.ndarray
    poses: List[Poses]


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
    loops = _Loops(robot, machine, driven, [*ends], slack)
    start = np.array([robot.positions[source] for source in ends])
    targets = np.array([*ends.values()]).T
    inside = np.clip(start, *targets)
    if len(ends) > 1:
        low, high = targets
        targets = np.random.default_rng(1).uniform(low, high, (PATHS, len(ends)))
    loops.check_start(start)
    if (inside != start).any() and (track := loops.track(start, inside[None])) and (
            loops.closed(track).all()):
        start, loops.near, loops.poses = inside, float(track.inputs[0, -1]), track.poses[-1]
    good, beyond = np.zeros((0, 1), bool), ''
    for _ in range(3):
        targets = targets[np.max(np.abs(targets - start), axis=1) > 1e-9]
        if not len(targets):
            break
        track = loops.track(start, targets)
        good = np.logical_and.accumulate(loops.closed(track), axis=1)
        ended = [loops.end(track, i, count) for i, count in enumerate(good.sum(axis=1))
                 if not good[i].all()]
        beyond = f'; not beyond where its {ended[0]}' if ended else beyond
        if good.sum() >= FEWEST:
            ranges = {source: (min(track.joints[source][good].min(), first),
                               max(track.joints[source][good].max(), first))
                      for source, first in zip(ends, start)}
            moved = ', '.join(f'{source} from {low:.4g} to {high:.4g}'
                              for source, (low, high) in ranges.items())
            return (f'Checked: {machine.name}: in {good.sum()} poses of the robot, {moved}, its '
                    f'loops stand open by {track.gaps[good].max():.0e} m at most{beyond}.', ranges,
                    (float(min(track.inputs[good].min(), loops.near)),
                     float(max(track.inputs[good].max(), loops.near))))
        targets = start + (targets - start) * good.mean(axis=1)[:, None]
    raise Difference(f'it could not be checked in more than {good.sum()} poses')


def positions(machine: scene.SceneMechanism, motors: Mapping[str, np.ndarray], near: float
              ) -> Tuple[Dict[str, np.ndarray], np.ndarray]:
    """
    Return what a mechanism publishes along paths of its sources, and its first input.

    A measured input continues from `near`.
    """
    values = [drive.ratio * motors[drive.source] + drive.offset
              for drive in machine.inputs.values()]
    if output := machine.first.measures:
        for path in values[0]:
            last = near
            for i, value in enumerate(path):
                path[i] = machine.measured(output, value, last)[0]
                last = last if math.isnan(path[i]) else path[i]
    angles = machine.linkage.joint_angles(values if len(values) > 1 else values[0])
    return {called.name: called.of(angles[link]) for link, called in machine.joints.items()
            if called.published}, values[0]


def published(machines: Mapping[str, scene.SceneMechanism]) -> Set[str]:
    """Return the joints that a scene publishes or reads."""
    return {drive.source for machine in machines.values() for drive in machine.inputs.values()} | {
        called.name for machine in machines.values() for called in machine.joints.values()
        if called.published}


def opened(component: Component, joints: Mapping[str, np.ndarray], start: Poses
           ) -> Tuple[np.ndarray, List[Poses]]:
    """
    Put positions of joints (paths, steps) into loops; return how far they stand open [m].

    By how much the file's own misfit opens them does not count. A joint that closes a loop opens
    it by its error in angle times the loops' size. The poses are those of each step.
    """
    shape = next(iter(joints.values())).shape
    fixed = component.columns_of([*joints])
    isnan = np.any([np.isnan(values) for values in joints.values()], axis=0)
    poses, gaps, each = start.some(np.zeros(shape[0], int)), np.empty(shape), []
    free, misfit = np.zeros((shape[0], len(fixed))), component.errors(component.at_start())[0]
    for k in range(shape[1]):
        here = {name: np.where(isnan[:, k], component.positions[name], values[:, k])
                for name, values in joints.items()}
        poses = component.stepped(poses, component.aimed(poses, free, {
            name: values for name, values in here.items() if name not in component.cut_names}))
        poses = poses if fixed.all() else component.closed(poses, fixed)
        gaps[:, k] = np.max(np.abs(component.errors(poses)[0] - misfit), axis=1)
        read = component.read(poses)
        for name in here.keys() & component.cut_names:
            off = here[name] - read[name]
            gaps[:, k] = np.maximum(gaps[:, k], component.size * np.abs(
                off - math.tau * np.round(off / math.tau)))
        each.append(poses)
    return np.where(isnan, math.nan, gaps), each


def _is_wrong(component: Component, joints: Mapping[str, np.ndarray], motors: Mapping[str, float],
              path: Sequence[Poses], gap: float, allowed: float) -> bool:
    """
    Return whether joints are wrong at the end of a path, rather than loops that end there.

    They are if they are all that closes the loops, or if the motors alone close them, by a step
    from the last pose on the path. Past a change point a robot can continue in two ways.
    """
    if not math.isnan(gap) and component.columns_of([*joints]).all():
        return True
    last, fixed = path[-1], component.columns_of([*motors])
    new = component.closed(component.stepped(last, component.aimed(last, np.zeros(
        (1, len(fixed))), {name: np.array([value]) for name, value in motors.items()})), fixed, 40)
    error = component.errors(new)[0] - component.errors(component.at_start())[0]
    leap = component.step_between(last, new) / component.unit
    stiffness = component.stiffness(Poses(*map(np.concatenate, zip(*path, new))), fixed)
    return bool(np.max(np.abs(error)) < allowed and np.max(np.abs(leap)) < LEAP
                and np.min(stiffness) > CHANGE * np.max(stiffness))


def whole(robot: Robot, machines: Mapping[str, scene.SceneMechanism], imported: Sequence[Imported]
          ) -> List[str]:
    """
    Put what all mechanisms of a scene publish into all loops of a robot, and report on them.

    All motors move at once towards both ends of the ranges in which their mechanisms were checked,
    less far where a loop that is left out ends.
    """
    worst, least = 0.0, POSES // 2
    reports: List[str] = []
    movers = {*robot.driven, *(source for each in imported for source in each.ranges)}
    for component in components(robot):
        slack = max((each.slack for each in imported if each.ranges.keys() & component.names),
                    default=0.0)
        allowed, count = (EXACT + MISFIT * slack) * component.size, POSES // 2
        for part in PARTS:
            found = _moved(robot, machines, imported, part)
            found = {name: found[name] for name in component.names & found.keys()}
            motors = [name for name in found if robot.source(name)[0] in movers]
            if len(motors) == len(found):
                break
            gaps, poses = opened(component, found, component.at_start())
            good = np.logical_and.accumulate(gaps <= allowed, axis=1)
            worst = max(worst, float(np.max(gaps, where=good, initial=0.0)))
            count = int(good.sum())
            wrong = [gaps[path, step] for path, step in enumerate(good.sum(axis=1))
                     if not good[path].all() and gaps[path, step] > allowed and _is_wrong(
                         component, found, {name: found[name][path, step] for name in motors},
                         [component.at_start(), *(each.some([path]) for each in poses[:step])],
                         gaps[path, step], allowed)]
            if wrong:
                reports.append(f'{OPEN} the loops of {", ".join(sorted(found))}, by '
                               f'{max(wrong):.2g} m.')
            if wrong or 2 * count > good.size:
                break
        least = min(least, count)
    return [f'Checked: the whole robot: in {least} poses, its loops stand open by {worst:.0e} m '
            'at most.', *reports]


def _moved(robot: Robot, machines: Mapping[str, scene.SceneMechanism],
           imported: Sequence[Imported], part: float) -> Dict[str, np.ndarray]:
    """Return what a scene publishes and reads on two paths, a part of the ranges of its motors."""
    steps = np.arange(1, POSES // 4 + 1) / (POSES // 4) * part
    found = {drive.source: np.full((2, len(steps)), (drive.start - drive.offset) / drive.ratio)
             for machine in machines.values() for drive in machine.inputs.values()}
    for source in {source for each in imported for source in each.ranges}:
        every = np.array([each.ranges[source] for each in imported if source in each.ranges])
        ends = max(every[:, 0]), min(every[:, 1])
        start = min(max(robot.positions[source], ends[0]), ends[1])
        found[source] = start + (np.array([ends]).T - start) * steps
    for machine in machines.values():
        found.update(positions(machine, found, machine.first.start)[0])
    return found


class _Loops:
    """The loops of a mechanism in its robot."""

    def __init__(self, robot: Robot, machine: scene.SceneMechanism, driven: Sequence[str],
                 sources: List[str], slack: float):
        self._component = next(each for each in components(replace(robot, driven=[*driven]))
                               if {*driven} & {joint.name for joint in each.joints})
        self._machine, self._sources = machine, sources
        # For each driven joint its source, ratio and offset.
        self._movers = {name: robot.source(name) for name in driven}
        self._slack = MISFIT * slack
        self._allowed = (EXACT + self._slack) * self._component.size
        # Where paths start: the pose of the file.
        self.poses, self.near = self._component.at_start(), machine.first.start

    def track(self, start: np.ndarray, targets: np.ndarray) -> Track:
        """Return what is published on straight paths of the motors."""
        steps = -(-POSES // len(targets))
        motors = start + (targets - start)[:, None] * (np.arange(1, steps + 1) / steps)[:, None]
        sources = {name: motors[..., i] for i, name in enumerate(self._sources)}
        found, inputs = positions(self._machine, sources, self.near)
        found = {**{name: ratio * sources[source] + offset
                    for name, (source, ratio, offset) in self._movers.items()}, **found}
        if self._machine.first.measures:
            before = np.column_stack([np.full(len(inputs), self.near), inputs[:, :-1]])
            size = self._machine.first.input.size
            jumps = ~(self._machine.first.input.apart(before, inputs) < TURN * size)
            found = {name: np.where(jumps, math.nan, values) for name, values in found.items()}
        names = self._component.names
        gaps, poses = opened(self._component, {
            name: values for name, values in found.items() if name in names}, self.poses)
        return Track({**sources, **found}, inputs, gaps, poses)

    def closed(self, track: Track) -> np.ndarray:
        """Return in which poses the loops are closed."""
        return track.gaps <= self._allowed

    def check_start(self, start: np.ndarray) -> None:
        """Raise Difference if a joint is not where the file has it."""
        found, _ = positions(self._machine, {
            name: np.full((1, 1), value) for name, value in zip(self._sources, start)}, self.near)
        for joint in self._component.joints:
            if joint.name in found and joint.position is not None:
                off = float(found[joint.name][0, 0]) - joint.position
                off = off / self._component.size if joint.kind == SLIDE else math.remainder(
                    off, math.tau)
                if abs(off) > OTHER + self._slack:
                    raise Difference(f'{self._at(start)} {joint.name} is off by {abs(off):.2g}')

    def end(self, track: Track, path: int, step: int) -> str:
        """Return why a path ends at a step; raise Difference if the robot can move on."""
        drive, component = self._machine.first, self._component
        at = float(track.inputs[path, step - 1]) if step else self.near
        if drive.measures and any(drive.input.apart(at, end) < TURN * drive.input.size
                                  for arc in drive.reach for end in arc):
            return 'input turns back'
        gap = float(track.gaps[path, step])
        if not _is_wrong(component, track.joints, {
                name: ratio * track.joints[source][path, step] + offset
                for name, (source, ratio, offset) in self._movers.items()},
                [self.poses, *(each.some([path]) for each in track.poses[:step])], gap,
                self._allowed):
            return 'loops end'
        where = self._at(np.array([track.joints[source][path, step] for source in self._sources]))
        raise Difference(where + (
            ' it has no pose, where the loops of the robot are closed' if math.isnan(gap) else
            f' its loops stand open by {gap:.2g} m'))

    def _at(self, values: np.ndarray) -> str:
        return 'with ' + ', '.join(
            f'{source} at {value:.4g}' for source, value in zip(self._sources, values))
