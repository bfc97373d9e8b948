# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A robot in the closed pose nearest to that of its file."""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Dict, Iterable, List, Mapping, NamedTuple, Tuple

import numpy as np

from .robot import FIXED, HINGE, Robot
from .spatial import Component, components, displaced, Poses, trees, turned
from ..command import RequestError
from ..words import listed, meant

# What is open by less, of the size of its loops, is rounding, and closed from where it is: files
# have angles such as 1.5708.
NEAR = 1e-4
# Other poses are looked for from so many starts; what is open by less is closed [of the size].
STARTS, CLOSED = 24, 1e-10
# A pose that is farther by less than this factor, and this [rad], is as near.
ALIKE, ALIKE_LENGTH, DISTINCT = 1.2, 1e-3, 1e-3
# Loops that are less stiff, of their size, are at a dead point, from which motors step aside by
# this [rad, or of the size].
FOLDED, ASIDE = 1e-6, 0.1


def check_names(robot: Robot, names: Iterable[str]) -> None:
    """Raise RequestError for a name without a joint of one degree of freedom."""
    for name in names:
        if name not in robot.positions:
            raise RequestError(f'there is no joint {name!r}; allowed: '
                               f'{listed(robot.positions, 200)}{meant(name, robot.positions)}')


def posed(robot: Robot, values: Mapping[str, float]) -> Robot:
    """Return a robot with some joints moved; raise RequestError for an unknown joint."""
    positions, moves = robot.positions, {}
    check_names(robot, values)
    for body, (_, joint) in trees(robot)[0].items():
        if joint.name in values and joint.position is not None:
            change = (values[joint.name] - joint.position) * (
                1.0 if joint.bodies[1] == body else -1.0) * joint.axis
            moves[body] = turned(change[None], joint.places[0])[0] if joint.kind == HINGE \
                else np.eye(4)
            if joint.kind != HINGE:
                moves[body][:3, 3] = change
            del positions[joint.name]
    for name in values:
        if name in positions:
            raise RequestError(f'{name} closes a loop, so that other joints say where it is')
    return robot.displaced(displaced(robot, moves), values)


def held(robot: Robot, values: Mapping[str, float]) -> Robot:
    """Return a robot with some joints fixed at given positions."""
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
    return posed(robot, late) if any(
        abs(value - positions[name]) > 0.0 for name, value in late.items()) else robot


class Closed(NamedTuple):
    """
    A robot with its loops closed.

    Attributes
    ----------
    said : list of str
        What is to be said of it.
    open_ones : dict
        Why joints stay open, by their names.
    stiff : list of str
        Joints that cannot move.
    faults : dict
        What is wrong with the motors of joints' loops, by the joints' names.

    """

    robot: Robot
    said: List[str]
    open_ones: Dict[str, str]
    stiff: List[str]
    faults: Dict[str, str]


def closed(robot: Robot) -> Closed:
    """Return a robot with closed loops; motors stay at their positions if possible."""
    robot = _with_followers(robot)
    moves: Dict[str, np.ndarray] = {}
    positions: Dict[str, float] = {}
    said: List[str] = []
    why: Dict[str, str] = {}
    stiff: List[str] = []
    faults: Dict[str, str] = {}
    for component in components(robot):
        names = [name for name in component.positions if name in robot.driven]
        try:
            poses, moved = nearest(component, names, [
                name for name in component.positions if name in robot.follows])
        except ValueError as error:
            why.update((joint.name, str(error)) for joint in component.joints)
            continue
        if component.gap(poses)[0] < CLOSED:
            stiff += component.immobile(poses)
            fault = _fault(component, poses, names, stiff)
            faults.update((joint.name, fault) for joint in component.joints if fault)
        moves.update(component.moves(poses))
        positions.update((name, float(value[0])) for name, value in component.read(poses).items())
        if moved:
            said.append(moved)
    return Closed(robot.displaced(displaced(robot, moves), positions), said, why, stiff, faults)


def _fault(component: Component, poses: Poses, motors: List[str], stiff: List[str]) -> str:
    """Return why motors do not tell a pose, if they do not."""
    if {*component.positions} <= {*stiff}:
        return 'it cannot move, as its joints hold each other'
    ways = component.free_ways(poses, component.held([]))[:, component.held(motors)]
    count = int(np.linalg.matrix_rank(ways, 1e-6)) if ways.size else 0
    if count < len(motors):
        return (f'{listed(motors)} drive it, and hold each other, as {count} of them tell where '
                'all is: name these by --driven')
    loose, count = component.loose(poses, motors) if motors else ([], 0)
    return f'not driven: {count} of {listed(loose)} must be moved, named by --driven, or held, ' \
        'named by --hold' if count else ''


def _check_unfolded(component: Component, poses: Poses, motors: List[str], least: float) -> None:
    """Raise ValueError if bars lie in line, so that a pose can be left in two ways."""
    if not motors:
        # Some joint shall move it, but not one that just this pose stops.
        ways = component.free_ways(poses, component.held([]), least)
        if len(ways) <= component.nullity(component.held([])):
            return
        motors = component.most_moved(ways)
    still = component.held(motors)
    ways = component.free_ways(poses, still, least)
    for way in ways if len(ways) > component.nullity(still) else ():
        aside = ASIDE * component.unit * way[None]
        back = component.closed(component.stepped(poses, aside), still, 40)
        if np.max(np.abs(component.away(back.positions - poses.positions))) < 0.3 * ASIDE:
            _refuse_fold(component, poses, motors, 3.0 * aside)


def _refuse_fold(component: Component, poses: Poses, motors: List[str], aside: np.ndarray) -> None:
    """Raise ValueError with both poses if a pose with bars in line has two neighbours."""
    still, ends = component.held(motors), True
    for ahead in (ASIDE, -ASIDE):
        step = component.towards_limits(motors, ahead)
        both = Poses(*map(np.concatenate, zip(*(component.closed(
            component.stepped(poses, step + side), still, 40) for side in (aside, -aside)))))
        name, first, second = component.farthest_apart(both, 1.0)
        is_closed = np.max(component.gap(both)) < CLOSED
        ends = ends and not is_closed
        if is_closed and abs(first - second) > DISTINCT:
            where = ' '.join(f'{motor}={float(component.read(both)[motor][0]):.3g}'
                             for motor in motors)
            raise ValueError(f'bars lie in line where the file has them, and with {where} {name} '
                             f'is at {first:.3g} as well as at {second:.3g}: choose by --pose '
                             f'{where} {name}=...')
    if ends:
        raise ValueError(f'its loops end where the file has {listed(motors)}: choose another '
                         f'pose by --pose {motors[0]}=...')


def nearest(component: Component, names: List[str], followers: List[str]) -> Tuple[Poses, str]:
    """
    Return the closed pose that is nearest to the file's, and what is to be said of it.

    Motors that are named stay where they are, if the loops can be closed so, and so do joints
    that follow others. Raises ValueError if two poses are as near.
    """
    start, still = component.at_start(), component.held(names)
    gap = float(component.gap(start)[0])
    # Axes that lean a little are no reason to go far where nothing drives.
    poses = component.closed(start, still, soft=1e-7)
    if gap < NEAR and component.gap(poses)[0] <= max(CLOSED, gap) \
            and np.linalg.norm(component.away(poses.positions)) < 1e3 * max(gap, CLOSED):
        _check_unfolded(component, poses, names, max(FOLDED, 3.0 * math.sqrt(gap)))
        return poses, ''
    # Where they must, joints that follow others move as well, and then motors.
    found, held_now = start, names
    open_by = math.inf
    for kept in [names + followers] * bool(followers) + [names] + [[]] * bool(names):
        other, less = _closed_ones(component, component.held(kept))
        if less < 0.9 * open_by:
            found, open_by, held_now = other, less, kept
        if open_by < CLOSED:
            break
    said = '' if held_now or not names else \
        f'{", ".join(names)} moved: their loops cannot be closed where the file has them.'
    determined = ~component.free(component.free_ways(found, component.held(held_now))) \
        if held_now else 1.0
    away = np.linalg.norm(component.away(found.positions) * determined, axis=1)
    nearest_one = int(np.argmin(away))
    for i in np.flatnonzero(away < ALIKE * away[nearest_one] + ALIKE_LENGTH):
        two = found.some(np.array([nearest_one, i]))
        name, first, second = component.farthest_apart(two, determined)
        if abs(first - second) > DISTINCT:
            # Where motors had to move, they are part of the choice.
            chosen = [name, *(motor for motor in names if not held_now and motor != name)]
            ends = [' '.join(f'{each}={component.read(two)[each][k]:.3g}' for each in chosen)
                    for k in (0, 1)]
            raise ValueError(f'the file has them open, and they close as well with {ends[0]} as '
                             f'with {ends[1]}: choose by --pose {name}=...')
    return found.some(np.array([nearest_one])), said


def _closed_ones(component: Component, still: np.ndarray) -> Tuple[Poses, float]:
    """Return poses that are closed as far as can be, and how far they are open, of the size."""
    columns = len(still)
    count = max(2, min(STARTS, 400_000 // max(columns, 1) ** 2))
    rng = np.random.default_rng(0)
    spread = np.linspace(0.0, 2.0, count)[:, None] * ~still
    home = np.zeros(columns)
    poses = component.stepped(component.at_start(count), component.unit * spread * rng.uniform(
        -1.0, 1.0, (count, columns)))
    poses = component.closed(poses, still, 40, home, 1e-2)
    poses = component.closed(poses, still, 12)
    poses = component.wrapped(poses)
    gaps = component.gap(poses)
    return poses.some(np.flatnonzero(gaps <= 1.001 * gaps.min() + CLOSED)), float(gaps.min())
