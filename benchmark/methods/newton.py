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
Newton on the loop equations |X - P| = p, |X - Q| = q, dyad after dyad, a fixed number of times.

Either from the nearest of 72 stored poses, any angle in any order, or from the pose before, as a
relay between the crank and the viewer does it.
"""

import math

import numpy as np

from .method import columns, Follower, Method
from .. import problems
from ..assembly import assembly, Dyad, Ray, Rigid

STORED = 72


def chain(kind, dimensions, iterations):
    """
    Return a function of cosine, sine and a guess that returns x and y of each point in turn.

    It is straight-line code for floats or arrays: Newton, where the exact way takes roots.
    """
    plan = assembly(kind, dimensions)
    at = {name: (repr(z.real), repr(z.imag)) for name, z in plan.ground.items()}
    at.update({name: (f'{name}_x', f'{name}_y') for name in plan.points})
    everything = ', '.join(', '.join(at[name]) for name in problems.POINTS[kind])
    across, up = f'{plan.crank!r} * cosine', f'{plan.crank!r} * sine'
    lines = [f'{everything} = guess',
             'A_x, A_y = ' + (f'-{up}, {across}' if plan.upright else f'{across}, {up}')]
    for step in plan.steps:
        lines += _WRITERS[type(step)](at, iterations, *step)
    made = {}
    exec('\n    '.join(['def solve(cosine, sine, guess):', *lines, f'return {everything}']), made)
    return made['solve']


def _dyad(at, iterations, name, first, second, p, q, _):
    (x, y), (px, py), (qx, qy) = at[name], at[first], at[second]
    return iterations * [
        f'ax, ay, bx, by = {x} - {px}, {y} - {py}, {x} - {qx}, {y} - {qy}',
        f'f = ax * ax + ay * ay - {p * p!r}',
        f'g = bx * bx + by * by - {q * q!r}',
        'half = 0.5 / (ax * by - ay * bx)',
        f'{x} += (ay * g - by * f) * half',
        f'{y} += (bx * f - ax * g) * half']


def _rigid(at, _, name, base, end, factor):
    (x, y), (px, py), (qx, qy) = at[name], at[base], at[end]
    u, v = factor.real, factor.imag
    return [f'ax, ay = {qx} - {px}, {qy} - {py}',
            f'{x}, {y} = {px} + ax * {u!r} - ay * {v!r}, {py} + ax * {v!r} + ay * {u!r}']


def _ray(at, iterations, name, pivot, pin, length):
    """Place the tip: along the slot, and at its distance from the pivot."""
    (x, y), (px, py), (qx, qy) = at[name], at[pivot], at[pin]
    return [f'wx, wy = {qx} - {px}, {qy} - {py}', *iterations * [
        f'ax, ay = {x} - {px}, {y} - {py}',
        'f = wx * ay - wy * ax',
        f'g = 0.5 * (ax * ax + ay * ay - {length * length!r})',
        'area = wx * ax + wy * ay',
        f'{x} += (ay * f - wx * g) / area',
        f'{y} -= (ax * f + wy * g) / area']]


_WRITERS = {Dyad: _dyad, Rigid: _rigid, Ray: _ray}


def _flat(pose, points):
    return tuple(part for name in points for part in (pose[name].real, pose[name].imag))


class StoredPoses(Method):
    """Newton from the nearest stored pose."""

    name = 'Newton, 72 stored poses'

    def __init__(self, iterations):
        self._iterations = iterations
        self.knob = f'{iterations} iteration' + 's' * (iterations > 1)

    def prepare(self, kind, dimensions):
        """Store the true poses in the middle of equal arcs."""
        self._solve = chain(kind, dimensions, self._iterations)
        self._points = problems.POINTS[kind]
        self._start = -problems.REACH[kind]
        self._arc = 2 * problems.REACH[kind] / STORED
        middle = self._start + (np.arange(STORED) + 0.5) * self._arc
        self._stored = [_flat(problems.pose(kind, angle), self._points)
                        for angle in middle.tolist()]
        self._table = np.array(self._stored).T

    def solve(self, theta):
        """Return the columns."""
        turned = np.mod(theta - self._start, 2 * math.pi)
        index = np.minimum((turned / self._arc).astype(int), STORED - 1)
        return self._solve(np.cos(theta), np.sin(theta), self._table.take(index, axis=1))

    def solve_one(self, theta):
        """Return one row of points."""
        index = min(int((theta - self._start) % math.tau / self._arc), STORED - 1)
        return self._solve(math.cos(theta), math.sin(theta), self._stored[index])

    def poses(self, answer):
        """Name the columns."""
        return columns(self._points, np.stack(answer, -1))


class PoseBefore(Follower):
    """Newton from the pose before."""

    name = 'Newton, pose before'

    def __init__(self, iterations):
        self._iterations = iterations
        self.knob = f'{iterations} iteration' + 's' * (iterations > 1)

    def prepare(self, kind, dimensions):
        """Write the chain."""
        self._solve = chain(kind, dimensions, self._iterations)
        self._points = problems.POINTS[kind]

    def start(self, theta, pose):
        """Take a pose as the one before."""
        self._before = _flat(pose, self._points)

    def solve_one(self, theta):
        """Return one row of points."""
        found = self._solve(math.cos(theta), math.sin(theta), self._before)
        if math.isfinite(sum(found)):
            self._before = found
        return found

    def poses(self, answer):
        """Name the columns."""
        return columns(self._points, answer)


METHODS = [StoredPoses(n) for n in (1, 2, 3, 4, 5)] + [PoseBefore(n) for n in (1, 2, 3)]
