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
What every method is asked, and what is true.

The angles are fixed: a turn in even steps, and named sets of awkward ones. The truth is that of
test/truth/exact_poses.py, kept as a pair of float64 numbers, so that errors below an ulp show.
"""

import hashlib
import math
from pathlib import Path
from typing import Dict, NamedTuple

import numpy as np
from truth import accuracy_rule, exact_poses

CACHE = Path(__file__).with_name('.cache')
UNIT = 2.0 ** -53
STEP = math.radians(2)

DIMENSIONS = {
    'water_drop': {'a': 1.0},
    'jansen': {'a': 38.0, 'b': 41.5, 'c': 39.3, 'd': 40.1, 'e': 55.8, 'f': 39.4, 'g': 36.7,
               'h': 65.7, 'i': 49.0, 'j': 50.0, 'k': 61.9, 'l': 7.8, 'm': 15.0},
    'peaucellier': {'r': 3.0, 'a': 9.0, 'b': 4.0},
    'slotted_lever': {'a': 80.0, 'b': 150.0, 'e': 0.0},
}
POINTS = {
    'water_drop': ('A', 'B', 'P'),
    'jansen': ('A', 'C', 'D', 'E', 'F', 'G'),
    'peaucellier': ('A', 'B', 'C', 'D'),
    'slotted_lever': ('A', 'L'),
}
# Half the crank's reach: half a turn, or up to where a Peaucellier cell folds.
REACH = {kind: math.pi for kind in DIMENSIONS}
REACH['peaucellier'] = 2 * math.acos(5 / 6)
# Where a linkage is closest to a dead point or its lever turns back.
TURNING = {
    'water_drop': 2 * math.pi / 3,
    'jansen': 3.3440,
    'peaucellier': None,
    'slotted_lever': math.acos(-80 / 150),
}


class Problem(NamedTuple):
    """
    A linkage, the crank angles it is asked for [rad] and the true poses.

    `high` + `low` are the true places and `sensitivity` what half an ulp of every input does
    to them, (angles, points[, 2]); `due` is +1 where a pose is due, -1 where NaN is, and 0 where
    the angle is a limit but for rounding and either will do.
    """

    kind: str
    dimensions: Dict[str, float]
    points: tuple
    longest: float
    theta: np.ndarray
    group: np.ndarray
    high: np.ndarray
    low: np.ndarray
    sensitivity: np.ndarray
    due: np.ndarray

    def walks(self):
        """
        Yield (start, path, asked): how a method that follows is led past the angles.

        A full-turn linkage is led upwards, one with limits from the middle of its reach outwards,
        a whole turn of them after the other. `start` is where it is set down, `path` the crank
        angles in order, no more than `STEP` apart within reach, and `asked` are the indices of
        those that are measured, -1 for the steps between.
        """
        turn = np.round(self.theta / (2 * math.pi))
        limited = REACH[self.kind] < math.pi
        clusters = turn if limited else np.where(np.abs(turn) < 10, 0, turn)
        for cluster in np.unique(clusters):
            inside = np.flatnonzero(clusters == cluster)
            if limited:
                middle = cluster * 2 * math.pi
                away = self.theta[inside] - middle
                for half in (inside[away >= 0], inside[away < 0]):
                    yield self._walk(middle, half[np.argsort(np.abs(self.theta[half] - middle))])
            else:
                order = inside[np.argsort(self.theta[inside], kind='stable')]
                yield self._walk(self.theta[order[0]] - STEP, order)

    def _walk(self, start, order):
        path, asked, at = [], [], start
        for index in order:
            theta = self.theta[index]
            if (self.due[index] > 0).all():
                between = np.linspace(at, theta, math.ceil(abs(theta - at) / STEP) + 1)[1:-1]
                path.extend(between)
                asked.extend([-1] * between.size)
            path.append(theta)
            asked.append(index)
            at = theta
        return start, np.array(path), np.array(asked)

    def error(self, found, columns):
        """Return the distances from the truth of places (angles, columns of points, 2)."""
        return np.linalg.norm((found - self.high[:, columns]) - self.low[:, columns], axis=-1)


def angles(kind):
    """Return {name of the set: crank angles [rad]}."""
    reach = REACH[kind]
    tiny = 10.0 ** -np.arange(1, 16)
    both = np.concatenate((-tiny, [0.0], tiny[::-1]))
    sets = {'one turn': (np.arange(180) + 0.5) / 90 * reach - reach, 'near 0': both}
    if reach < math.pi:
        sets['near a limit'] = np.concatenate((tiny - reach, reach - tiny))
        sets['out of reach'] = np.concatenate((reach + tiny[:12], -reach - tiny[:12], [math.pi]))
        turns = np.linspace(-0.9, 0.9, 8) * reach
        past = np.concatenate((turns + 2 * math.pi, turns - 2 * math.pi, turns + 4 * math.pi))
    else:
        sets['near pi'] = np.concatenate((both + math.pi, both - math.pi))
        sets['near turning'] = TURNING[kind] + both[::2]
        turns = np.linspace(-0.9, 0.9, 8) * reach
        past = np.concatenate((np.arange(16) / 8 * math.pi + math.pi + 0.1,
                               np.arange(8) / 8 * math.pi - 2 * math.pi + 0.1))
    sets['past a turn'] = past
    sets['huge'] = np.concatenate([turns + 2 * math.pi * n for n in (1e3, 1e6, 1e9)])
    return sets


def problem(kind):
    """Return the Problem of a linkage, from the cache where nothing has changed."""
    sets = angles(kind)
    theta = np.concatenate(list(sets.values()))
    group = np.repeat(list(sets), [len(values) for values in sets.values()])
    dimensions = DIMENSIONS[kind]
    found = _cached(kind, dimensions, theta)
    lengths = exact_poses.bars(kind, dimensions).values()
    return Problem(kind, dimensions, POINTS[kind], float(max(lengths)), theta, group,
                   found['high'], found['low'], found['sensitivity'], found['due'])


def pose(kind, theta):
    """Return the true pose nearest to a crank angle, {joint: complex}, the ground's with it."""
    length = exact_poses.exact(DIMENSIONS[kind])
    found = exact_poses.place(kind, length, exact_poses.mp.mpf(theta))
    return {name: complex(place) for name, place in found.points.items()}


def _cached(kind, dimensions, theta):
    files = (__file__, exact_poses.__file__, accuracy_rule.__file__)
    sources = b''.join(Path(file).read_bytes() for file in files)
    asked = hashlib.sha256(sources + repr(dimensions).encode() + theta.tobytes()).hexdigest()
    path = CACHE / f'{kind}-{asked[:16]}.npz'
    if not path.exists():
        CACHE.mkdir(exist_ok=True)
        np.savez(path, **_truth(kind, dimensions, theta))
    return np.load(path)


def _truth(kind, dimensions, theta):
    case = accuracy_rule.Case(kind, dimensions, theta)
    points = POINTS[kind]
    shape = len(theta), len(points)
    table = {'high': np.empty((*shape, 2)), 'low': np.empty((*shape, 2)),
             'sensitivity': np.empty(shape), 'due': np.empty(shape, int)}
    for row, angle in enumerate(theta):
        found = accuracy_rule.truth(case, angle, ())
        for column, name in enumerate(points):
            for axis, part in enumerate((found.values[name].real, found.values[name].imag)):
                high = float(part)
                table['high'][row, column, axis] = high
                table['low'][row, column, axis] = float(part - high)
            table['sensitivity'][row, column] = float(found.sensitivity[name])
            needs = exact_poses.KINDS[kind].needs.get(name, '')
            table['due'][row, column] = _due({found.closures[joint] for joint in needs})
    return table


def _due(states):
    """Return +1 where every closure meets, -1 where one fails; whatever lies between is open."""
    if states <= {'meets'}:
        return 1
    return -1 if states <= {'meets', 'fails'} else 0
