# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The closed pose of a robot that is nearest to the pose in its file."""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Dict, List, Mapping, NamedTuple, Tuple

import numpy as np

from .robot import FIXED, Robot
from .spatial import CLOSED, Component, components, DEAD, displaced, posed, Poses, trees
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
        For each joint whose loops cannot be closed, the reason.
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


def closed(robot: Robot) -> Closed:
    """Close the loops of a robot; its motors keep their positions if possible."""
    robot = _with_followers(robot)
    made = Closed(robot, [], {}, [], {})
    moves: Dict[str, np.ndarray] = {}
    positions: Dict[str, float] = {}
    for component in components(robot):
        names, followers = ([name for name in component.positions if name in several]
                            for several in (robot.driven, robot.follows))
        try:
            poses, report = nearest(component, names, followers)
        except ValueError as error:
            made.open_loops.update((joint.name, str(error)) for joint in component.joints)
            continue
        if component.gap(poses)[0] < CLOSED:
            made.immobile.extend(component.immobile(poses))
            if fault := _fault(component, poses, names, followers, made.immobile):
                made.faults.update((joint.name, fault) for joint in component.joints)
        moves.update(component.moves(poses))
        positions.update((name, float(value[0])) for name, value in component.read(poses).items())
        made.report.extend([report] * bool(report))
    return made._replace(robot=displaced(robot, moves, positions))


def _fault(component: Component, poses: Poses, motors: List[str], followers: List[str],
           immobile: List[str]) -> str:
    """Return why motors and their followers do not determine a pose; empty if they do."""
    if {*component.positions} <= {*immobile}:
        return 'it cannot move, as its joints hold each other'
    ways = component.free_ways(poses, component.columns_of([]))[:, component.columns_of(motors)]
    count = int(np.linalg.matrix_rank(ways, 1e-6)) if ways.size else 0
    if count < len(motors):
        return (f'{listed(motors)} drive it, and hold each other, as {count} of them tell where '
                'all is: name these by --driven')
    loose, count = component.loose(poses, motors + followers) if motors else ([], 0)
    return f'not driven: {count} of {listed(loose)} must be moved, named by --driven, or held, ' \
        'named by --hold' if count else ''


def _check_unfolded(component: Component, poses: Poses, motors: List[str], least: float) -> None:
    """Raise ValueError at a dead point, which a linkage can leave in two ways."""
    if not motors:
        # Without motors, drive a joint that this pose does not stop.
        ways = component.free_ways(poses, component.columns_of([]), least)
        if len(ways) <= component.nullity(component.columns_of([])):
            return
        motors = component.most_moved(ways)
    fixed = component.columns_of(motors)
    ways = component.free_ways(poses, fixed, least)
    for way in ways if len(ways) > component.nullity(fixed) else ():
        aside = ASIDE * component.unit * way[None]
        back = component.closed(component.stepped(poses, aside), fixed, 40)
        if np.max(np.abs(component.away(back.positions - poses.positions))) < 0.3 * ASIDE:
            _refuse_fold(component, poses, motors, 3.0 * aside)


def _refuse_fold(component: Component, poses: Poses, motors: List[str], aside: np.ndarray) -> None:
    """Raise ValueError with both neighbouring poses of a dead point, if there are two."""
    fixed, ends = component.columns_of(motors), True
    for ahead in (ASIDE, -ASIDE):
        step = component.towards_limits(motors, ahead)
        both = Poses(*map(np.concatenate, zip(*(component.closed(
            component.stepped(poses, step + side), fixed, 40) for side in (aside, -aside)))))
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
    Return the closed pose that is nearest to the file's, and a report if motors had to move.

    Motors and followers keep their positions if the loops can be closed so. Raises ValueError if
    two poses are equally near.
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
        others, smallest = _closed_ones(component, component.columns_of(tried))
        if smallest < 0.9 * open_by:
            found, held_ones, open_by = others, tried, smallest
        if open_by < CLOSED:
            break
    report = '' if held_ones or not names else \
        f'{", ".join(names)} moved: their loops cannot be closed where the file has them.'
    determined = ~component.free(component.free_ways(found, component.columns_of(held_ones))) \
        if held_ones else 1.0
    away = np.linalg.norm(component.away(found.positions) * determined, axis=1)
    nearest_one = int(np.argmin(away))
    for i in np.flatnonzero(away < ALIKE * away[nearest_one] + ALIKE_LENGTH):
        two = found.some(np.array([nearest_one, i]))
        name, first, second = component.farthest_apart(two, determined)
        if abs(first - second) > DISTINCT:
            # Motors that had to move are part of the choice.
            chosen = [name, *(motor for motor in names if not held_ones and motor != name)]
            ends = [' '.join(f'{each}={component.read(two)[each][k]:.3g}' for each in chosen)
                    for k in (0, 1)]
            raise ValueError(f'the file has them open, and they close as well with {ends[0]} as '
                             f'with {ends[1]}: choose by --pose {name}=...')
    return found.some(np.array([nearest_one])), report


def _closed_ones(component: Component, fixed: np.ndarray) -> Tuple[Poses, float]:
    """Return the poses with the smallest gap, and this gap as a part of the size."""
    columns = len(fixed)
    count = max(2, min(STARTS, 400_000 // max(columns, 1) ** 2))
    rng = np.random.default_rng(0)
    spread = np.linspace(0.0, 2.0, count)[:, None] * ~fixed
    poses = component.stepped(component.at_start(count), component.unit * spread * rng.uniform(
        -1.0, 1.0, (count, columns)))
    poses = component.closed(poses, fixed, 40, 1e-2)
    poses = component.closed(poses, fixed, 12)
    gaps = component.gap(poses)
    return poses.some(np.flatnonzero(gaps <= 1.001 * gaps.min() + CLOSED)), float(gaps.min())
