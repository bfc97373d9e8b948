# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The closed pose of a robot that is nearest to the pose in its file."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
import math
import shlex
from typing import Iterable, Mapping, NamedTuple, Sequence

import numpy as np

from .spatial import ASKEW, Component, components, DEAD_POINT, is_free
from ..robot_model.robot import FIXED, NotDriven, Robot, with_positions
from ..words import join_names

# A smaller opening, of the size of its loops, is rounding: files have angles such as 1.5708.
# Such loops are closed without a search, as far as they can be.
NEAR = 1e-3
# Loops with a larger opening, of their size, are open: files have rounded numbers.
OPEN = 1e-4
# Number of random starts of a search for closed poses, less where that many screws take long.
STARTS, SCREWS = 96, 1400
# Two poses are equally near if their distances differ by less than this factor and this [rad];
# they are different if a joint differs by this [rad].
ALIKE, ALIKE_LENGTH, DISTINCT = 1.2, 1e-3, 1e-3
# How much hinges of balls count in the distance of two poses, to choose one of a ball's positions.
NEARLY = 1e-6
# A pose is the nearest around it if the next step to the file's is smaller [rad, or of the size].
RESTING = 1e-6
# A step of motors away from a dead point [rad, or of the size].
ASIDE = 0.1
# Loops stop a motion that they resist less, of their size, only because their axes lean.
LEANING = 3.0 * ASKEW
# How far inside its limits a joint starts, as a part of its range.
INSIDE = 0.1


def held(robot: Robot, values: Mapping[str, float]) -> Robot:
    """Return a robot with some joints, and those that follow them, fixed at given positions."""
    values = {**values, **{
        name: ratio * values[source] + offset for name in robot.follows.keys() & robot.positions
        for source, ratio, offset in reversed(robot.sources(name))
        if source in values and name not in values}}
    made = with_positions(robot, values)
    return replace(made, joints=[
        replace(joint, kind=FIXED, position=None) if joint.name in values else joint
        for joint in made.joints])


class Closed(NamedTuple):
    """
    A robot with its loops closed, and a report on what had to move.

    `faults` has for joints why their loops cannot be closed or cannot move; or, as NotDriven, why
    the motors do not determine them.
    """

    robot: Robot
    report: list[str]
    faults: dict[str, ValueError]


# Two closed poses of which one has to be chosen: a text, and what to type for each joint.
Question = tuple[str, Mapping[str, str], Mapping[str, str]]


def closed(robot: Robot, seed: int = 0) -> Closed:
    """
    Close the loops of a robot; its motors keep their positions if possible.

    If that does not determine a pose, joints outside their limits start inside them. The `seed`
    is that of the starts of a search, on which no answer may depend.
    """
    inside = {}
    for joint in robot.joints:
        low, high = joint.range
        if joint.position is not None and not low <= joint.position <= high:
            margin = INSIDE * min(high - low, 1.0)
            inside[joint.name] = low + margin if joint.position < low else high - margin
    made = _closed(robot, seed)
    other = _closed(with_positions(robot, inside), seed) if made.faults and inside else made
    if len(other.faults) >= len(made.faults):
        return made
    where = ', '.join(f'{name} at {value:.4g}' for name, value in inside.items())
    return other._replace(report=[
        f'Started inside the limits of the file: {where}.', *other.report])


def _closed(robot: Robot, seed: int) -> Closed:
    # Dependent joints are where the others say.
    robot = with_positions(robot, {name: ratio * robot.positions[source] + offset
                                   for name in robot.positions.keys() & robot.follows
                                   for source, ratio, offset in [robot.source(name)]})
    made = Closed(robot, [], {})
    moves: dict[str, np.ndarray] = {}
    positions: dict[str, float] = {}
    for component in components(robot):
        motors = [name for name in component.named if name in robot.driven]
        followers = robot.followers(component.named)
        try:
            pose, report = nearest(component, motors, followers, seed)
            made.report.extend([report] * bool(report))
            moves.update(component.moves(pose))
            positions.update((name, float(at)) for name, at in component.read(pose).items())
            opening = np.linalg.norm(component.errors(pose[None])[0].reshape(-1, 3), axis=1).max()
            if opening > LEANING * component.size:
                raise ValueError(f'its loops cannot be closed: they stay open by {opening:.3g} m, '
                                 f'more than {OPEN:g} of their size')
            _check_driven(component, pose, motors, followers)
        except ValueError as error:
            made.faults.update((joint.name, error) for joint in component.joints)
    return made._replace(robot=with_positions(robot, positions, moves))


def _added(*options: tuple[str, Iterable[str]]) -> str:
    """Return which option to paste, by word and values; a word follows each, and no stop."""
    return 'add ' + ' or '.join(
        f'--{word} {shlex.join(values)}' for word, values in options) + ' to the command'


def _check_driven(component: Component, pose: np.ndarray, motors: list[str], followers: list[str]
                  ) -> None:
    """Raise ValueError if loops cannot move; NotDriven if their motors do not determine a pose."""
    if not component.undriven(pose, [], LEANING)[0]:
        fixed = [joint.name for joint in component.joints
                 if joint.kind == FIXED and joint.is_cut and joint.name]
        raise ValueError('it cannot move, as its joints hold each other' + bool(fixed) * (
            f': {join_names(fixed)} makes one body of two, where a pin has the type 3d'))
    motions = component.free_ways(pose, component.is_of([]), LEANING)
    count = len(chosen := component.chosen(motions, motors))
    if count < len(motors):
        # Motors that nothing lets move are replaced.
        chosen = chosen or component.chosen(motions, [*component.named])
        raise ValueError(
            f'{join_names(motors)} drive it, and hold each other, as {count} of them tell where '
            f'all is: replace them by --driven {shlex.join(chosen)} in the command')
    undriven, motions = component.undriven(pose, motors + followers)
    if not undriven:
        return
    _check_unfolded(component, pose, motors, DEAD_POINT)
    stiff = [joint.name for joint in component.joints if joint.name in undriven
             and joint.no_limits.endswith('no range')]
    more = component.chosen(motions, sorted(undriven, key=lambda name: name not in stiff))
    # Held, they must not stop all others.
    holds = [('hold', component.texts(pose, component.is_of(more)).values())] * bool(
        component.undriven(pose, more)[0])
    raise NotDriven(
        f'not driven: {len(more)} of {join_names(undriven)} must be moved'
        f'{" or held" * len(holds)}: ' + _added(('driven', [*motors, *more]), *holds)
        + f'; the limits of {join_names(stiff)} leave no range' * bool(stiff))


def _choice(questions: Sequence[Question], why: str) -> ValueError:
    """Return the error of all that has to be chosen, with what to type."""
    texts, *sides = zip(*questions)
    poses = [{name: value for side in choices for name, value in side.items()}
             for choices in sides]
    return ValueError(f'{why} {", and ".join(texts)}: ' + _added(*(
        ('pose', pose.values()) for pose in poses)))


def _question(component: Component, poses: np.ndarray, which: np.ndarray,
              motors: Sequence[str] = ()) -> list[Question]:
    """Return the choice of two poses by the joint that differs most, if they are different."""
    # Of joints that differ alike the first.
    differences = np.round(np.abs(component.displacement(poses[0] - poses[1])) * which, 4)
    name = max(component.named, key=lambda name: differences[component.named[name]], default='')
    if not name or differences[component.named[name]] < DISTINCT:
        return []
    poses = poses[np.argsort(component.read(poses)[name])]
    side, other = (component.texts(pose, which) for pose in poses)
    where = ' '.join(side[motor] for motor in (*motors, name))
    return [(f'with {where} as with {other[name]}', side, other)]


def _check_unfolded(component: Component, pose: np.ndarray, motors: list[str], stiffness: float
                    ) -> None:
    """Raise ValueError at a dead point, which a linkage can leave in two ways."""
    if not motors:
        # Without motors, drive a joint that this pose does not stop.
        sizes = np.linalg.norm(component.free_ways(pose, component.is_of([]), stiffness), axis=0)
        motors = [max(component.named, key=lambda name: sizes[component.named[name]], default='')]
    fixed = component.is_of(motors)
    questions: list[Question] = []
    steps = sorted((pose + ahead * component.unit * fixed for ahead in (ASIDE, -ASIDE)),
                   key=lambda step: not component.within(step[None], fixed)[0])
    for which, rows in component.independent(fixed):
        still = fixed | ~which
        motions = component.free_ways(pose, still, stiffness)
        for way in motions if len(motions) > component.nullity(still) else ():
            # Where branches are near, both sides of one distance may end on the same.
            aside = ASIDE * component.unit * np.outer((3.0, -3.0, 1.0, -1.0), way)
            tried = [component.closed(step + aside, fixed, 40) for step in steps]
            pairs = [np.array(pair) for poses in tried for pair in combinations(
                poses[component.residual(poses, rows) < component.near], 2)]
            if not pairs:
                raise ValueError(f'its loops end where the file has {join_names(motors)}: choose '
                                 'another pose by --pose, or mend lengths or places in the file')
            # What moves as freely beside it, such as a ring on two pins, is no dead point.
            if min(len(component.free_ways(perturbed, still, stiffness))
                   for poses in pairs for perturbed in poses) == len(motions):
                continue
            choices = [question for poses in pairs for question in _question(
                component, poses, (way != 0.0) | fixed, motors)]
            questions += choices[:1]
    if questions:
        raise _choice(questions, 'bars lie in line where the file has them, and it moves on')


def nearest(component: Component, motors: list[str], followers: list[str], seed: int
            ) -> tuple[np.ndarray, str]:
    """
    Return the closed pose that is nearest to the file's, and a report if motors had to move.

    Motors and followers keep their positions if the loops can be closed so. Loops that share no
    joint but these are closed on their own. Raises ValueError with all loops of which two poses
    are equally near.
    """
    start, fixed = component.start, component.is_of(motors)
    residual = float(component.residual(start)[0])
    # Slightly inclined axes must not move undriven joints far.
    poses = component.closed(start, fixed, soft=1e-7)
    if residual < NEAR and component.residual(poses)[0] <= max(component.near, residual) \
            and np.linalg.norm(component.displacement(poses)) < 1e3 * max(
                residual, component.near):
        _check_unfolded(component, poses[0], motors,
                        max(DEAD_POINT, 3.0 * math.sqrt(min(residual, 1e-4))))
        return poses[0], ''
    # If the loops cannot be closed otherwise, followers move, and then motors.
    candidates, still, open_by = start, motors, math.inf
    for names in [motors + followers] * bool(followers) + [motors] + [[]] * bool(motors):
        others = _searched(component, component.is_of(names), seed)
        smallest = max(component.residual(others, rows).min()
                       for _, rows in component.independent(component.is_of(names)))
        if smallest < 0.9 * open_by:
            candidates, still, open_by = others, names, smallest
        if open_by < component.near:
            break
    report = '' if still or not motors else \
        f'{", ".join(motors)} moved: their loops cannot be closed where the file has them.'
    fixed, pose, questions = component.is_of(still), candidates[0].copy(), []
    for which, rows in component.independent(fixed):
        # Those with the smallest residual, inside limits if there are any; the nearest first.
        residuals = component.residual(candidates, rows)
        some = candidates[residuals <= 1.001 * residuals.min() + component.near]
        inside = component.within(some, which)
        some = some[inside] if inside.any() else some
        determined = which & ~is_free(component.free_ways(some[0], fixed | ~which)) \
            if still else which
        distances = np.linalg.norm(component.displacement(some) * determined, axis=1)
        first, *more = np.argsort(distances + NEARLY * np.linalg.norm(some, axis=1))
        pose[which] = some[first, which]
        choices = (_question(component, some[[first, i]], determined) for i in more
                   if distances[i] < ALIKE * distances[first] + ALIKE_LENGTH)
        questions += next(filter(None, choices), [])
    if questions:
        raise _choice(questions, 'the file has them open, and they close as well')
    return pose, report


def _searched(component: Component, fixed: np.ndarray, seed: int) -> np.ndarray:
    """
    Return poses of random starts, closed as far as they can be.

    Where motors move there are nearer poses beside most of these; they do not count.
    """
    count = min(STARTS, SCREWS // max(len(fixed), 1))
    spread = np.linspace(0.0, math.pi, count)[:, None] * ~fixed * component.unit
    poses = spread * np.random.default_rng(seed).uniform(-1.0, 1.0, (count, len(fixed)))
    poses = component.closed(component.closed(poses, fixed, 40, 1e-2), fixed, 12)
    steps = component.displacement(component.closed(poses, fixed, 1, 1e-12) - poses)
    at_rest = np.max(np.abs(steps), axis=1, initial=0.0) < RESTING
    return poses[at_rest] if at_rest.any() else poses
