# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The closed pose of a robot that is nearest to the pose in its file."""

from __future__ import annotations

from dataclasses import replace
import math
import shlex
from typing import Any, Collection, Dict, List, Mapping, NamedTuple, Sequence, Tuple

import numpy as np

from .spatial import CLOSED, Component, components, DEAD, Poses
from ..robot_model.robot import displaced, FIXED, posed, Robot, trees
from ..words import listed

# A gap that is smaller, of the size of its loops, is rounding: files have angles such as 1.5708.
# Such loops are closed without a search, as far as they can be.
NEAR = 1e-3
# Number of random starts of a search for closed poses.
STARTS = 24
# Two poses are equally near if their distances differ by less than this factor and this [rad];
# they are different if a joint differs by this [rad].
ALIKE, ALIKE_LENGTH, DISTINCT = 1.2, 1e-3, 1e-3
# A step of motors away from a dead point [rad, or of the size].
ASIDE = 0.1
# How far inside its limits a joint starts, as a part of its range.
INSIDE = 0.1


def held(robot: Robot, values: Mapping[str, float]) -> Robot:
    """Return a robot with some joints, and those that follow them, fixed at given positions."""
    values = {**values, **{name: ratio * values[source] + offset for name in robot.follows
                           for source, ratio, offset in reversed(robot.sources(name))
                           if source in values and name not in values}}
    made = posed(robot, values)
    return replace(made, joints=[
        replace(joint, kind=FIXED, position=None) if joint.name in values else joint
        for joint in made.joints])


def _with_followers(robot: Robot) -> Robot:
    """Return a robot with dependent joints at the positions that follow from the others."""
    late, positions = {}, robot.positions
    for _, joint in trees(robot)[0].values():
        if joint.name in robot.follows and joint.position is not None:
            source, ratio, offset = robot.source(joint.name)
            late[joint.name] = ratio * positions[source] + offset
    return posed(robot, late)


class Closed(NamedTuple):
    """
    A robot with its loops closed.

    Attributes
    ----------
    report : list of str
        Which motors had to move.
    open_loops : dict
        For each joint whose loops cannot be closed, or cannot move, the reason.
    immobile : list of str
        Joints that cannot move.
    faults : dict
        For each joint whose loops the motors do not determine, the reason.

    """

    robot: Robot
    report: List[str]
    open_loops: Dict[str, str]
    immobile: List[str]
    faults: Dict[str, str]


class Question(NamedTuple):
    """Two closed poses of which one has to be chosen: a joint in both, and what to type."""

    text: str
    choices: Sequence[Mapping[str, str]]


def closed(robot: Robot, given: Collection[str] = ()) -> Closed:
    """
    Close the loops of a robot; its motors keep their positions if possible.

    If that does not determine a pose, joints outside their limits start inside them, but for those
    whose positions are given.
    """
    made, outside = _closed(robot)
    outside = {name: value for name, value in outside.items() if name not in given}
    if outside:
        other, _ = _closed(posed(robot, outside))
        if len(other.open_loops) + len(other.faults) < len(made.open_loops) + len(made.faults):
            where = ', '.join(f'{name} at {value:.4g}' for name, value in outside.items())
            return other._replace(report=[
                f'Started inside the limits of the file: {where}.', *other.report])
    return made


def _closed(robot: Robot) -> Tuple[Closed, Dict[str, float]]:
    """Return a robot with its loops closed, and starts inside limits where that failed."""
    robot = _with_followers(robot)
    made = Closed(robot, [], {}, [], {})
    moves: Dict[str, np.ndarray] = {}
    positions: Dict[str, float] = {}
    outside: Dict[str, float] = {}
    for component in components(robot):
        names, followers = ([name for name in component.positions if name in several]
                            for several in (robot.driven, robot.follows))
        try:
            poses, report = nearest(component, names, followers)
        except ValueError as error:
            made.open_loops.update((joint.name, str(error)) for joint in component.joints)
            outside.update(component.outside(INSIDE))
            continue
        if component.gap(poses)[0] < CLOSED:
            still = component.immobile(poses)
            made.immobile.extend(still)
            is_rigid = {*component.positions} <= {*still}
            if fault := _rigid(component) if is_rigid else _fault(
                    component, poses, names, followers):
                (made.open_loops if is_rigid else made.faults).update(
                    (joint.name, fault) for joint in component.joints)
                outside.update(component.outside(INSIDE))
        moves.update(component.moves(poses))
        positions.update((name, float(value[0])) for name, value in component.read(poses).items())
        made.report.extend([report] * bool(report))
    return made._replace(robot=displaced(robot, moves, positions)), outside


def option(word: str, values: Mapping[str, str]) -> str:
    """Return an option of a command line, to be pasted."""
    return f'--{word} ' + ' '.join(shlex.quote(f'{name}={value}')
                                   for name, value in values.items())


def _rigid(component: Component) -> str:
    """Return that loops cannot move, and what joint may be wrong."""
    fixed = [joint.name for joint in component.joints if joint.kind == FIXED and joint.is_cut]
    return 'it cannot move, as its joints hold each other' + (
        f': {listed(fixed)} makes one body of two, where a pin has the type 3d' if fixed else '')


def _fault(component: Component, poses: Poses, motors: List[str], followers: List[str]) -> str:
    """Return why motors and their followers do not determine a pose; empty if they do."""
    ways = component.free_ways(poses, component.columns_of([]))[:, component.columns_of(motors)]
    count = int(np.linalg.matrix_rank(ways, 1e-6)) if ways.size else 0
    if count < len(motors):
        return (f'{listed(motors)} drive it, and hold each other, as {count} of them tell where '
                f'all is: name these by --driven, as in --driven '
                f'{shlex.join(component.chosen(ways, motors))}')
    fixed = component.columns_of(motors + followers)
    loose, count = component.loose(poses, motors + followers)
    if not count:
        return ''
    if len(component.free_ways(poses, fixed)) > component.nullity(fixed):
        return (f'bars lie in line where the file has them, which leaves {listed(loose)} free'
                + _elsewhere(component, motors))
    found = component.free_ways(poses, fixed)[:, component.columns_of(loose)]
    stiff = [joint.name for joint in component.joints if joint.name in loose
             and joint.no_limits.endswith('no range')]
    more = component.chosen(found, loose, stiff)
    why = f'; the limits of {listed(stiff)} leave no range' if stiff else ''
    at = component.read(poses)
    return (f'not driven: {count} of {listed(loose)} must be moved, named by --driven, or held, '
            f'named by --hold, as in --driven {shlex.join([*motors, *more])} or '
            + option('hold', {name: f'{at[name][0]:.6g}' for name in more}) + why)


def _elsewhere(component: Component, motors: List[str]) -> str:
    """Return the option of the stiffest of other closed poses, inside limits if there are any."""
    poses = _searched(component, component.columns_of([]), 0.0)
    other = np.max(np.abs(component.away(poses.positions)), axis=1) > DISTINCT
    stiff = component.stiffness(poses, component.columns_of(motors)) * other * (
        component.gap(poses) < CLOSED) * np.where(component.within(poses, True), 1.0, 1e-6)
    best = poses.some(np.array([int(np.argmax(stiff))]))
    return f': choose another pose by {option("pose", component.written(best, True))}' \
        if stiff.any() else ', and no other pose is found: lengths or places in the file are wrong'


def _choice(questions: Sequence[Question], why: str) -> ValueError:
    """Return the error of all that has to be chosen, with what to type."""
    sides = [{name: value for each in questions for name, value in each.choices[side].items()}
             for side in (0, 1)]
    return ValueError(f'{why} {", and ".join(each.text for each in questions)}: choose by ' + (
        ', or by '.join(option('pose', side) for side in sides)))


def _check_unfolded(component: Component, poses: Poses, motors: List[str], least: float) -> None:
    """Raise ValueError at a dead point, which a linkage can leave in two ways."""
    if not motors:
        # Without motors, drive a joint that this pose does not stop.
        ways = component.free_ways(poses, component.columns_of([]), least)
        if len(ways) <= component.nullity(component.columns_of([])):
            return
        motors = component.most_moved(ways)
    fixed = component.columns_of(motors)
    questions = []
    for columns, rows in component.lots(fixed):
        ways = component.free_ways(poses, fixed | ~columns, least)
        for way in ways if len(ways) > component.nullity(fixed | ~columns) else ():
            aside = ASIDE * component.unit * way[None]
            back = component.closed(component.stepped(poses, aside), fixed, 40)
            if np.max(np.abs(component.away(back.positions - poses.positions))) < 0.3 * ASIDE:
                questions += _folded(component, poses, motors, 3.0 * aside, rows)
    if questions:
        raise _choice(questions, 'bars lie in line where the file has them, and')


def _folded(component: Component, poses: Poses, motors: List[str], aside: np.ndarray, rows: Any
            ) -> List[Question]:
    """Return the choice of neighbouring poses of a dead point, if there are two."""
    fixed, ends = component.columns_of(motors), True
    for ahead in (ASIDE, -ASIDE):
        step = component.towards_limits(motors, ahead)
        both = Poses(*map(np.concatenate, zip(*(component.closed(
            component.stepped(poses, step + side), fixed, 40) for side in (aside, -aside)))))
        mask = component.elements_of(np.any(aside, axis=0) | fixed)
        name, first, second = component.farthest_apart(both, mask)
        is_closed = np.max(component.gap(both, rows)) < CLOSED
        ends = ends and not is_closed
        if is_closed and abs(first - second) > DISTINCT:
            where = ' '.join(f'{motor}={float(component.read(both)[motor][0]):.3g}'
                             for motor in motors)
            return [Question(
                f'with {where} {name} is at {first:.3g} as well as at {second:.3g}',
                [component.written(both.some([k]), mask) for k in (0, 1)])]
    if ends:
        raise ValueError(f'its loops end where the file has {listed(motors)}'
                         + _elsewhere(component, motors))
    return []


def nearest(component: Component, names: List[str], followers: List[str]) -> Tuple[Poses, str]:
    """
    Return the closed pose that is nearest to the file's, and a report if motors had to move.

    Motors and followers keep their positions if the loops can be closed so. Loops that share no
    joint but these are closed on their own. Raises ValueError with all loops of which two poses
    are equally near.
    """
    start, fixed = component.at_start(), component.columns_of(names)
    gap = float(component.gap(start)[0])
    # Slightly inclined axes must not move undriven joints far.
    poses = component.closed(start, fixed, soft=1e-7)
    if gap < NEAR and component.gap(poses)[0] <= max(CLOSED, gap) \
            and np.linalg.norm(component.away(poses.positions)) < 1e3 * max(gap, CLOSED):
        _check_unfolded(component, poses, names, max(DEAD, 3.0 * math.sqrt(min(gap, 1e-4))))
        return poses, ''
    # If the loops cannot be closed otherwise, followers move, and then motors.
    found, held_ones, open_by = start, names, math.inf
    for tried in [names + followers] * bool(followers) + [names] + [[]] * bool(names):
        others = _searched(component, component.columns_of(tried))
        smallest = max(component.gap(others, rows).min()
                       for _, rows in component.lots(component.columns_of(tried)))
        if smallest < 0.9 * open_by:
            found, held_ones, open_by = others, tried, smallest
        if open_by < CLOSED:
            break
    report = '' if held_ones or not names else \
        f'{", ".join(names)} moved: their loops cannot be closed where the file has them.'
    fixed, poses, questions = component.columns_of(held_ones), found.some(np.arange(1)), []
    for columns, rows in component.lots(fixed):
        # Those with the smallest gap, inside limits if there are any; the nearest first.
        gaps, mask = component.gap(found, rows), component.elements_of(columns)
        some = found.some(np.flatnonzero(gaps <= 1.001 * gaps.min() + CLOSED))
        inside = component.within(some, mask)
        some = some.some(inside) if inside.any() else some
        determined = mask * (~component.free(component.free_ways(some, fixed | ~columns))
                             if held_ones else 1.0)
        away = np.linalg.norm(component.away(some.positions) * determined, axis=1)
        first, *more = np.argsort(away, kind='stable')
        for each, other in zip(poses, some):
            each[0, mask] = other[first, mask]
        for i in more:
            two = some.some([first, i])
            name, *ends = component.farthest_apart(two, determined)
            if away[i] < ALIKE * away[first] + ALIKE_LENGTH and abs(ends[0] - ends[1]) > DISTINCT:
                questions.append(Question(
                    f'with {name}={ends[0]:.3g} as with {name}={ends[1]:.3g}',
                    [component.written(two.some([k]), mask) for k in (0, 1)]))
                break
    if questions:
        raise _choice(questions, 'the file has them open, and they close as well')
    return poses, report


def _searched(component: Component, fixed: np.ndarray, pull: float = 1e-2) -> Poses:
    """Return poses of random starts, the first that of the file, closed as far as they can be."""
    columns = len(fixed)
    count = max(2, min(STARTS, 400_000 // max(columns, 1) ** 2))
    rng = np.random.default_rng(0)
    spread = np.linspace(0.0, 2.0, count)[:, None] * ~fixed
    poses = component.stepped(component.at_start(count), component.unit * spread * rng.uniform(
        -1.0, 1.0, (count, columns)))
    return component.closed(component.closed(poses, fixed, 40, pull), fixed, 12)
