# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Check by substitution: what is published, put into the robot's own joints, closes its loops.

Joints without a published position, such as the balls of rods, close the loops as well as they
can. So mechanisms are wrong where the loops stand open, or where they have no pose and the robot
has. Loops that share joints are checked together, with all that the scene publishes of them.
"""

from __future__ import annotations

import math
from typing import Any, Mapping, NamedTuple, Sequence

import numpy as np

from .spatial import Component, components, EXACT
from .. import scene
from ..linkage import short, theta_of
from ..robot_model.robot import plain, Robot
from ..scene.joint_names import quoted_name

# Number of paths of several motors, of poses on all paths, and of poses that a check needs.
PATHS, POSES, MIN_POSES = 12, 240, 200
# A misfit of the file opens its loops by less than this factor times it.
MISFIT = 10.0
# A mechanism whose joints are farther off in the file's pose [rad, or of the size] is another.
OTHER = 1e-3
# Loops that are less stiff, of their size, are next to a change point.
CHANGE = 0.03


class Difference(ValueError):
    """How mechanisms differ from their robot, or why they could not be compared."""


class Imported(NamedTuple):
    """
    A mechanism's name, its parameters and its report.

    Also the joints that move it, its sources or what follows them, and the misfit of the file, of
    the size.
    """

    name: str
    parameters: dict[str, Any]
    reports: list[str]
    driven: Sequence[str]
    slack: float = 0.0


class Source(NamedTuple):
    """An input: ratio * position + offset of its source."""

    name: str
    source: str
    ratio: float
    offset: float
    value: float


def parameters(mechanism: str, kind: str, lines: Sequence[str], drives: Sequence[Source],
               joints: Sequence[tuple[str, float, str, float]], **more: Any) -> dict[str, Any]:
    """Return a mechanism's; of joints the link, the sign, the robot's name and the position."""
    values = {'type': kind, 'joints': [*lines], **more}
    for drive in drives:
        values.update({f'{drive.name}.source': drive.source, f'{drive.name}.ratio': drive.ratio,
                       f'{drive.name}.offset': float(short(drive.offset)),
                       f'{drive.name}.start': float(short(drive.value, 1e-15))})
    values['joint_names'] = [
        f'{link}={"-" * (sign < 0.0)}{quoted_name(name)}' + (
            f'{zero:+}' if (zero := float(short(position))) else '')
        for link, sign, name, position in joints]
    values['only_named'] = True
    return {f'{mechanism}.{key}': value for key, value in values.items()}


def mechanism(others: Sequence[Imported], name: str, *args: Any, **more: Any
              ) -> tuple[str, dict[str, Any], scene.SceneMechanism]:
    """Return a mechanism beside others: its name, which none of them has, `parameters`, itself."""
    name = plain(name, 60)
    name = f'{name}_{len(others)}' if name in [made.name for made in others] else name
    values = parameters(name, *args, **more)
    return name, values, scene.read({'mechanisms': [name], **values}).mechanisms[name]


class Walk(NamedTuple):
    """
    Positions along paths (paths, steps), and how far loops stand open there [m].

    An opening is NaN without a pose. `joints` has the sources, too; `poses` are those of each
    step. `good` tells where the loops are closed on all of the way.
    """

    joints: dict[str, np.ndarray]
    openings: np.ndarray
    poses: list[np.ndarray]
    good: np.ndarray


def compared(robot: Robot, mechanisms: Mapping[str, scene.SceneMechanism],
             imported: Sequence[Imported]) -> tuple[list[str], dict[str, str]]:
    """
    Put what a scene publishes into the loops of its robot, which is in a closed pose.

    Return the report on loops that stay closed, and for each mechanism of others the reason.
    """
    reports: list[str] = []
    wrong: dict[str, str] = {}
    for component in components(robot):
        parts = [made for made in imported if {*made.driven} & component.named.keys()]
        if parts:
            try:
                reports.append(_Loops(robot, component, mechanisms, parts).report())
            except Difference as error:
                wrong.update((made.name, str(error)) for made in parts)
    return reports, wrong


def published(mechanisms: Mapping[str, scene.SceneMechanism]) -> set[str]:
    """Return the joints that a scene publishes or reads."""
    every = mechanisms.values()
    return {drive.source for mechanism in every for drive in mechanism.inputs.values()} | {
        called.name for mechanism in every for called in mechanism.joints.values()
        if called.published}


class _Loops:
    """Loops that share joints, and what mechanisms publish of them."""

    def __init__(self, robot: Robot, component: Component,
                 mechanisms: Mapping[str, scene.SceneMechanism], parts: Sequence[Imported]):
        self._component, self._parts = component, parts
        self._mechanisms = [mechanism for name, mechanism in mechanisms.items()
                            if published({name: mechanism}) & component.named.keys()]
        self._motors = {name: robot.source(name) for made in parts for name in made.driven}
        # Where each source starts, and between which positions it moves.
        self._start = {drive.source: robot.positions[drive.source]
                       for mechanism in self._mechanisms for drive in mechanism.inputs.values()}
        self._ends: dict[str, tuple[float, float]] = {}
        for drive in (drive for made in parts for drive in mechanisms[made.name].inputs.values()):
            around = math.pi if drive.input.is_angle else 0.5 * component.size
            around = 2.0 * around if drive.ends else around
            ends = sorted((end - drive.offset) / drive.ratio for end in np.clip(
                drive.ends or (-math.inf, math.inf), drive.start - around, drive.start + around))
            low, high = self._ends.get(drive.source, ends)
            self._ends[drive.source] = max(low, ends[0]), min(high, ends[1])
        self._slack = MISFIT * max(made.slack for made in parts)
        self._allowed = (EXACT + self._slack) * component.size
        self._misfit = component.errors(component.start)[0]

    def report(self) -> str:
        """
        Return the report.

        Raise Difference as `_walk_to` does, or if a joint is not where the file has it.
        """
        component = self._component
        start = self._positions({name: np.array([value]) for name, value in self._start.items()})
        seen, drawn = map(component.read, (
            component.moved_to(component.start, start), component.start))
        for name in start:
            off = abs(seen[name] - drawn[name])[0] / component.unit[component.named[name]]
            if off > OTHER + self._slack:
                raise Difference(f'{self._at(self._start)} {name} is off by {off:.2g}')
        low, high = corners = np.array([
            self._ends.get(source, (value,) * 2) for source, value in self._start.items()]).T
        walk, beyond = self._walk_to(corners if len(self._ends) == 1 else np.random.default_rng(
            1).uniform(low, high, (PATHS, len(low))))
        moved = ', '.join(
            f'{source} from {min(values):.4g} to {max(values):.4g}' for source in self._ends
            for values in [[self._start[source], *walk.joints[source][walk.good]]])
        names, openings = ', '.join(made.name for made in self._parts), walk.openings[walk.good]
        return (f'Checked: {names}: in {openings.size} poses of the robot, {moved}, its loops '
                f'stand open by {openings.max():.0e} m at most{beyond}.')

    def _walk_to(self, targets: np.ndarray) -> tuple[Walk, str]:
        """
        Return a walk of the sources to targets, a row each, and why it ends before, if it does.

        The way is shorter where too few of its poses are closed. Raises Difference if the loops
        stand open, have no pose where the robot has one, or are closed in fewer than MIN_POSES.
        """
        start, beyond, count = np.array([*self._start.values()]), '', 0
        for _ in range(3):
            targets = targets[np.max(np.abs(targets - start), axis=1) > 1e-9]
            if not len(targets):
                break
            walk = self._walk(targets, -(-POSES // len(targets)))
            for path, step in enumerate(walk.good.sum(axis=1)):
                if not walk.good[path].all():
                    self._check_end(walk, path, step)
                    beyond = '; not beyond where its loops end'
            if (count := walk.good.sum()) >= MIN_POSES:
                return walk, beyond
            targets = start + (targets - start) * walk.good.mean(axis=1)[:, None]
        raise Difference(f'it could not be checked in more than {count} poses')

    def _walk(self, targets: np.ndarray, steps: int) -> Walk:
        """
        Put what is published on straight paths of the sources into the loops.

        By how much the file's own misfit opens them does not count.
        """
        component, start = self._component, np.array([*self._start.values()])
        parts = np.arange(1, steps + 1) / steps
        sources = dict(zip(self._start, np.moveaxis(
            start + (targets - start)[:, None] * parts[:, None], -1, 0)))
        joints = self._positions(sources)
        fixed = component.is_of([*joints])
        isnan = np.any([np.isnan(values) for values in joints.values()], axis=0)
        pose = np.repeat(component.start, len(targets), axis=0)
        poses = []
        for k in range(steps):
            pose = component.moved_to(pose, {name: at[:, k] for name, at in joints.items()})
            pose[isnan[:, k]] = component.start
            pose = pose if fixed.all() else component.closed(pose, fixed)
            poses.append(pose)
        errors = np.abs(component.errors(np.concatenate(poses))[0] - self._misfit)
        openings = np.column_stack(np.split(errors.max(axis=1), steps))
        openings[isnan] = math.nan
        return Walk({**sources, **joints}, openings, poses,
                    np.logical_and.accumulate(openings <= self._allowed, axis=1))

    def _positions(self, sources: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return positions of the loops' joints along paths."""
        positions = {**sources, **{name: ratio * sources[source] + offset
                                   for name, (source, ratio, offset) in self._motors.items()}}
        for mechanism in self._mechanisms:
            values = [drive.ratio * positions[drive.source] + drive.offset
                      for drive in mechanism.inputs.values()]
            angles = mechanism.linkage.joint_angles(theta_of(values))
            positions.update((called.name, called.of(angles[link]))
                             for link, called in mechanism.joints.items() if called.published)
        return {name: at for name, at in positions.items() if name in self._component.named}

    def _check_end(self, walk: Walk, path: int, step: int) -> None:
        """
        Raise Difference if joints are wrong at the end of a path: its loops do not end there.

        They are wrong if they are all that closes the loops, or if the motors alone close them, by
        a step from the last pose on the path. Past a change point a robot can continue in two
        ways.
        """
        component, opening = self._component, float(walk.openings[path, step])
        poses = [component.start, *(pose[[path]] for pose in walk.poses[:step])]
        if math.isnan(opening) or not component.is_of([*walk.joints]).all():
            motors = {name: walk.joints[name][path, [step]] for name in self._motors}
            fixed = component.is_of([*motors])
            new = component.closed(component.moved_to(poses[-1], motors), fixed, 40)
            ways = max(len(component.free_ways(pose[0], fixed, CHANGE)) for pose in (*poses, new))
            if ways > component.nullity(fixed) or not np.max(
                    np.abs(component.errors(new)[0] - self._misfit)) < self._allowed:
                return
        raise Difference(self._at({name: values[path, step] for name, values in
                                   walk.joints.items()}) + (
            ' it has no pose, where the loops of the robot are closed' if math.isnan(opening) else
            f' its loops stand open by {opening:.2g} m'))

    def _at(self, values: Mapping[str, float]) -> str:
        return 'with ' + ', '.join(f'{source} at {values[source]:.4g}' for source in self._ends)
