# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Comparison of a mechanism with its robot, whose loops are closed in space."""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Dict, List, Mapping, NamedTuple, Sequence, Tuple

import numpy as np

from .robot import Robot, SLIDE
from .spatial import CLOSED, Component, components, DEAD, Poses
from .. import scene

# Number of paths of several motors, of poses on all paths, and of poses that a check needs.
PATHS, POSES, FEWEST = 12, 240, 200
# Allowed difference [rad, or of the size] for exact axes in the file.
EXACT = 1e-9
# Stiffness next to a change point, as a part of the largest.
CHANGE = 0.25
# A measured input within this of an end of its reach [rad, or of its size] turns back there.
TURN = 0.1
# The first step, as a part of the others.
LITTLE = 1e-3
# A step that turns joints by more [rad] is halved, at most so many times.
LEAP, HALVINGS = 0.35, 6


class Difference(ValueError):
    """How a mechanism differs from its robot, or why it could not be compared."""


class Track(NamedTuple):
    """
    Poses along paths: positions of motors and joints, which are closed, and their stiffness.

    `last` are the last poses of the paths that are closed to their ends.
    """

    motors: np.ndarray
    joints: Dict[str, np.ndarray]
    alive: np.ndarray
    margin: np.ndarray
    volume: np.ndarray
    last: Poses


def compared(robot: Robot, machine: scene.SceneMechanism, driven: Sequence[str],
             ends: Mapping[str, Tuple[float, float]], slack: float) -> str:
    """
    Compare what a mechanism publishes with the joints of its robot, and report on it.

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
        What the file leaves open for good, of the size.

    Raises
    ------
    Difference
        If they differ, or if fewer than FEWEST poses could be compared.

    """
    component = next(each for each in components(replace(robot, driven=[*driven]))
                     if {*driven} & {joint.name for joint in each.joints})
    start = np.array([robot.positions[source] for source in ends])
    targets = np.array([*ends.values()]).T
    inside, near = np.clip(start, *targets), machine.first.start
    if len(ends) > 1:
        low, high = targets
        targets = np.random.default_rng(1).uniform(low, high, (PATHS, len(ends)))
    tracker, sources = _Tracker(robot, component, driven, [*ends], slack), [*ends]
    if (inside != start).any():
        track = tracker.track(start, inside[None])
        apart, names, inputs = _differences(machine, component, sources, track, near)
        if track.alive.all() and (apart <= _allowed(track, slack)).all():
            start, near, tracker.poses = inside, float(inputs[0, -1]), track.last
    good, beyond = np.zeros((0, 1), bool), ''
    for _ in range(3):
        targets = targets[np.max(np.abs(targets - start), axis=1) > 1e-9]
        if not len(targets):
            break
        track = tracker.track(start, targets)
        apart, names, inputs = _differences(machine, component, sources, track, near)
        good = np.logical_and.accumulate(
            track.alive & (apart <= _allowed(track, slack)), axis=1)
        turned = [i for i, count in enumerate(good.sum(axis=1)) if not good[i].all()
                  and _turns_back(machine.first, *[near, *inputs[i]][count:count + 2])]
        _check_ends(track, sources, apart, names, good, turned)
        if not good.all():
            beyond = '; not beyond ' + (
                'where its input turns back' if turned else
                'a change point' if (track.alive & ~good).any() else 'where its loops end')
        if good.sum() >= FEWEST:
            worst = np.unravel_index(np.argmax(np.where(good, apart, -1.0)), good.shape)
            moved = ', '.join(
                f'{source} from {min(*values, first):.4g} to {max(*values, first):.4g}'
                for source, first, values in zip(sources, start, track.motors[good].T))
            return (f'Checked: {machine.name}: in {good.sum()} poses of the robot, its loops '
                    f'closed in space, {moved}, the worst difference is {apart[worst]:.0e}, of '
                    f'{names[worst]}{beyond}.')
        targets = start + (targets - start) * good.mean(axis=1)[:, None]
    raise Difference(f'it could not be checked in more than {good.sum()} poses')


def _allowed(track: Track, slack: float) -> np.ndarray:
    """Return the allowed difference in each pose [rad, or of the size]."""
    return (EXACT + 30.0 * slack) / np.maximum(track.margin, 1e-4)


def _turns_back(drive: scene.InputSettings, last: float, following: float) -> bool:
    """
    Return whether a measured input does not continue after its last pose, at an end of its reach.

    The motor that measures it is between two moving links, and can move on from there.
    """
    near = TURN * drive.input.size
    return bool(drive.measures) and not drive.input.apart(last, following) < near and any(
        drive.input.apart(last, end) < near for arc in drive.reach for end in arc)


def _check_ends(track: Track, sources: List[str], apart: np.ndarray, names: np.ndarray,
                good: np.ndarray, turned: Sequence[int]) -> None:
    """
    Raise Difference for a path with good poses up to a wrong one, unless it branches there.

    Paths that `turned` end.
    """
    largest = np.max(track.volume, where=track.alive, initial=0.0)
    for i in {*np.flatnonzero(~good.all(axis=1)).tolist()}.difference(turned):
        at = i, good[i].sum()
        # Past a change point a robot can continue in two ways.
        if not track.alive[at] or np.min(track.volume[i, :at[1] + 1]) < CHANGE * largest:
            continue
        if np.max(track.margin, where=track.alive, initial=0.0) < DEAD:
            raise Difference('it could not be checked: its loops are at a dead point wherever '
                             'its motors are')
        where = ', '.join(f'{source} at {value:.4g}'
                          for source, value in zip(sources, track.motors[at]))
        raise Difference(f'with {where} ' + (
            'it has no pose, where the loops of the robot are closed' if math.isnan(apart[at])
            else f'{names[at]} is off by {apart[at]:.2g}'))


def _differences(machine: scene.SceneMechanism, component: Component, sources: List[str],
                 track: Track, first: float) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """
    Return the largest difference in each pose [rad, or of the size], its joint, and the input.

    A measured input continues from `first`.
    """
    values = [drive.ratio * track.motors[..., sources.index(drive.source)] + drive.offset
              for drive in machine.inputs.values()]
    if output := machine.first.measures:
        for path in values[0]:
            near = first
            for i, value in enumerate(path):
                path[i] = machine.measured(output, value, near)[0]
                near = near if math.isnan(path[i]) else path[i]
    angles = machine.linkage.joint_angles(values if len(values) > 1 else values[0])
    slides = {joint.name for joint in component.joints if joint.kind == SLIDE}
    apart = {}
    for link, called in machine.joints.items():
        if called.published and called.name in track.joints:
            off = called.of(angles[link]) - track.joints[called.name]
            apart[called.name] = np.abs(off) / component.size if called.name in slides else np.abs(
                off - math.tau * np.round(off / math.tau))
    apart = apart or {'': np.full(track.alive.shape, math.nan)}
    every = np.array([*apart.values()])
    worst = np.argmax(np.where(np.isnan(every), math.inf, every), axis=0)
    return (np.take_along_axis(every, worst[None], axis=0)[0], np.array([*apart])[worst],
            values[0])


class _Tracker:
    """Moves the motors of a component along paths, and closes its loops."""

    def __init__(self, robot: Robot, component: Component, driven: Sequence[str],
                 sources: List[str], slack: float):
        self._component, self._slack = component, slack
        self._fixed = component.columns_of(driven)
        # Where paths start: the pose of the file.
        self.poses = component.at_start()
        # For each driven joint its source, ratio and offset.
        self._movers = {name: (sources.index(source), ratio, offset) for name in driven
                        for source, ratio, offset in [robot.source(name)]}

    def track(self, start: np.ndarray, targets: np.ndarray) -> Track:
        """Return poses on straight paths of the motors, each closed from the one before."""
        component, fixed, count = self._component, self._fixed, len(targets)
        steps = -(-POSES // count)
        poses = component.closed(self.poses.some(np.zeros(count, int)), fixed)
        self._base = component.errors(poses)[0][0]
        nullity = component.nullity(fixed)
        motors = start + (targets - start)[:, None] * (np.arange(steps + 1) / steps)[:, None]
        alive = np.zeros((count, steps), bool)
        margin, volume = np.ones((2, count, steps))
        joints: Dict[str, np.ndarray] = {}
        drift, going = np.zeros((count, len(fixed))), np.arange(count)
        # A small step gives the directions of joints, which keep the first step on its branch.
        little = motors[:, 0] + LITTLE * (motors[:, 1] - motors[:, 0])
        ahead, fine = self._advanced(poses, motors[:, 0], little, drift, 0)
        drift[fine] = component.step_between(poses, ahead)[fine] / LITTLE
        last = drift
        for k in range(steps):
            before = poses
            poses, fine = self._advanced(
                poses, motors[going, k], motors[going, k + 1], drift, HALVINGS)
            moved = component.step_between(before, poses)[fine]
            # The path is extrapolated by a parabola.
            drift, last = 2.0 * moved - last[fine], moved
            poses, going = poses.some(fine), going[fine]
            if not len(going):
                break
            alive[going, k] = True
            margin[going, k], volume[going, k] = component.stiffness(poses, fixed, nullity)
            for name, values in component.read(poses).items():
                joints.setdefault(name, np.full(alive.shape, math.nan))[going, k] = values
        return Track(motors[:, 1:], joints, alive, margin, volume, poses)

    def _advanced(self, poses: Poses, before: np.ndarray, after: np.ndarray, drift: np.ndarray,
                  halvings: int) -> Tuple[Poses, np.ndarray]:
        """Return poses with the motors moved, and which of them are closed."""
        component = self._component
        step = component.aimed(poses, drift, {
            name: ratio * after[:, i] + offset
            for name, (i, ratio, offset) in self._movers.items()})
        new = component.closed(component.stepped(poses, step), self._fixed, 8)
        fine = (np.max(np.abs(component.errors(new)[0] - self._base), axis=1)
                < (CLOSED + 10.0 * self._slack) * component.size) & (
            np.max(np.abs(component.step_between(poses, new)) / component.unit, axis=1) < LEAP)
        if fine.all() or not halvings:
            return new, fine
        some, middle = np.flatnonzero(~fine), 0.5 * (before + after)
        half, reached = self._advanced(poses.some(some), before[some], middle[some],
                                       0.5 * drift[some], halvings - 1)
        left = some[reached]
        if len(left):
            rest, fine[left] = self._advanced(
                half.some(np.flatnonzero(reached)), middle[left], after[left], 0.5 * drift[left],
                halvings - 1)
            for old, one in zip(new, rest):
                old[left] = one
        return new, fine
