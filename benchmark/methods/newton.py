# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Newton on the loop equations |X - P| = p, |X - Q| = q, dyad after dyad, a fixed number of times.

Either from the nearest of 72 stored poses, any angle in any order, or from the pose before, as a
relay between the crank and the viewer does it.
"""

import math

import numpy as np

from .method import Follower, Method
from .. import problems
from ..assembly import assembly, Dyad, Ray, Rigid

STORED = 72


class Chain:
    """The steps of an assembly with Newton in place of square roots, on floats or arrays."""

    def __init__(self, kind, dimensions, iterations):
        self._assembly = assembly(kind, dimensions)
        self._ground = {n: (z.real, z.imag) for n, z in self._assembly.ground.items()}
        self._steps = [_MAKERS[type(step)](iterations, *step) for step in self._assembly.steps]

    def solve(self, cosine, sine, guess):
        """Return {point: (x, y)} from a guess of the same form."""
        found = {**self._ground, 'A': self._assembly.pin(cosine, sine)}
        for place in self._steps:
            place(found, guess)
        return found


def _dyad(iterations, name, first, second, p, q, _):
    p_square, q_square, turns = p * p, q * q, range(iterations)

    def place(found, guess):
        (px, py), (qx, qy), (x, y) = found[first], found[second], guess[name]
        for _ in turns:
            ax, ay, bx, by = x - px, y - py, x - qx, y - qy
            f = ax * ax + ay * ay - p_square
            g = bx * bx + by * by - q_square
            twice = 2 * (ax * by - ay * bx)
            x, y = x + (ay * g - by * f) / twice, y + (bx * f - ax * g) / twice
        found[name] = x, y
    return place


def _rigid(_, name, base, end, factor):
    u, v = factor.real, factor.imag

    def place(found, guess):
        (px, py), (qx, qy) = found[base], found[end]
        x, y = qx - px, qy - py
        found[name] = px + x * u - y * v, py + x * v + y * u
    return place


def _ray(iterations, name, pivot, pin, length):
    """Place the tip: along the slot, and at its distance from the pivot."""
    square, turns = length * length, range(iterations)

    def place(found, guess):
        (px, py), (qx, qy), (x, y) = found[pivot], found[pin], guess[name]
        wx, wy = qx - px, qy - py
        for _ in turns:
            ax, ay = x - px, y - py
            f = wx * ay - wy * ax
            g = 0.5 * (ax * ax + ay * ay - square)
            area = wx * ax + wy * ay
            x, y = x + (ay * f - wx * g) / area, y - (ax * f + wy * g) / area
        found[name] = x, y
    return place


_MAKERS = {Dyad: _dyad, Rigid: _rigid, Ray: _ray}


class StoredPoses(Method):
    """Newton from the nearest stored pose."""

    name = 'Newton, 72 stored poses'

    def __init__(self, iterations):
        self._iterations = iterations
        self.knob = f'{iterations} iteration' + 's' * (iterations > 1)

    def prepare(self, kind, dimensions):
        """Store the true poses in the middle of equal arcs."""
        self._chain = Chain(kind, dimensions, self._iterations)
        self._points = problems.POINTS[kind]
        self._start = -problems.REACH[kind]
        self._arc = 2 * problems.REACH[kind] / STORED
        middle = self._start + (np.arange(STORED) + 0.5) * self._arc
        poses = [problems.pose(kind, angle) for angle in middle.tolist()]
        self._single = [{n: (z.real, z.imag) for n, z in pose.items()} for pose in poses]
        self._table = {name: np.array([(p[name].real, p[name].imag) for p in poses]).T
                       for name in self._points}

    def solve(self, theta):
        """Return {point: (x, y)}."""
        with np.errstate(all='ignore'):
            turned = np.mod(theta - self._start, 2 * math.pi)
            index = np.minimum((turned / self._arc).astype(int), STORED - 1)
            guess = {name: (x[index], y[index]) for name, (x, y) in self._table.items()}
            return self._chain.solve(np.cos(theta), np.sin(theta), guess)

    def solve_one(self, theta):
        """Return {point: (x, y)}, floats."""
        index = min(int((theta - self._start) % (2 * math.pi) / self._arc), STORED - 1)
        return self._chain.solve(math.cos(theta), math.sin(theta), self._single[index])

    def poses(self, answer):
        """Stack x and y."""
        return {name: np.stack(answer[name], -1).reshape(-1, 2) for name in self._points}


class PoseBefore(Follower):
    """Newton from the pose before."""

    name = 'Newton, pose before'

    def __init__(self, iterations):
        self._iterations = iterations
        self.knob = f'{iterations} iteration' + 's' * (iterations > 1)

    def prepare(self, kind, dimensions):
        """Set up the chain."""
        self._chain = Chain(kind, dimensions, self._iterations)
        self._points = problems.POINTS[kind]

    def start(self, theta, pose):
        """Take a pose as the one before."""
        self._before = {name: (z.real, z.imag) for name, z in pose.items()}

    def solve_one(self, theta):
        """Return {point: (x, y)}, floats."""
        found = self._chain.solve(math.cos(theta), math.sin(theta), self._before)
        if math.isfinite(sum(map(sum, found.values()))):
            self._before = found
        return found

    def poses(self, answer):
        """Stack x and y."""
        answers = answer if isinstance(answer, list) else [answer]
        return {name: np.array([found[name] for found in answers]) for name in self._points}


METHODS = [StoredPoses(n) for n in (1, 2, 3, 4, 5)] + [PoseBefore(n) for n in (1, 2, 3)]
