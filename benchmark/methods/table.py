# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A table of poses over the crank's reach with cubic interpolation between its nodes."""

import math

import numpy as np
from scipy.interpolate import CubicSpline

from .compiled_c import CompiledC
from .method import columns, Method
from .. import problems


class Table(Method):
    """Periodic cubic splines over a full turn; not-a-knot splines over a reach with two ends."""

    name = 'table, cubic spline'
    package = 'scipy'

    def __init__(self, nodes):
        self._nodes = nodes
        self.knob = f'{nodes} nodes'

    def prepare(self, kind, dimensions):
        """Fill the table from the C version and turn it into cubics, one row an interval."""
        self._points = problems.POINTS[kind]
        reach = problems.REACH[kind]
        full = reach == math.pi
        # The outermost nodes stand an ulp inside, where there still is a pose.
        nodes = np.linspace(-reach, reach, self._nodes + 1) * (1.0 if full else 1 - 2e-16)
        closed_form = CompiledC('', '-O3')
        closed_form.prepare(kind, dimensions)
        values = closed_form.solve(nodes)
        if full:
            values[-1] = values[0]
        spline = CubicSpline(nodes, values, bc_type='periodic' if full else 'not-a-knot')
        self._cubics = np.ascontiguousarray(np.moveaxis(spline.c, 0, 1))
        self._lists = [list(zip(*cubic)) for cubic in self._cubics.tolist()]
        self._start, self._reach = nodes[0], 2 * reach
        self._step = self._reach / self._nodes

    def solve(self, theta):
        """Return rows of points."""
        turned = np.mod(theta - self._start, 2 * math.pi)
        index = np.minimum((turned / self._step).astype(int), self._nodes - 1)
        t = (turned - index * self._step)[:, None]
        c = self._cubics.take(index, axis=0)
        rows = c[:, 0] * t
        for power in (1, 2):
            rows += c[:, power]
            rows *= t
        rows += c[:, 3]
        if self._reach < 2 * math.pi:
            rows[turned > self._reach] = np.nan
        return rows

    def solve_one(self, theta):
        """Return one row of points, from lists: numpy would be slower here."""
        turned = (theta - self._start) % (2 * math.pi)
        if turned > self._reach:
            raise ValueError('out of reach')
        index = min(int(turned / self._step), self._nodes - 1)
        t = turned - index * self._step
        return [((a * t + b) * t + c) * t + d for a, b, c, d in self._lists[index]]

    def poses(self, answer):
        """Name the columns."""
        return columns(self._points, answer)


METHODS = [Table(4 ** k) for k in range(3, 9)]
