# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""casadi: its Newton root finder on the bars' equations, with exact Jacobians."""

import casadi as ca
import numpy as np

from .method import columns, Follower
from .scipy_solvers import Equations
from .. import problems


class RootFinder(Follower):
    """One of casadi's root finders, from the pose before."""

    package = 'casadi'

    def __init__(self, plugin):
        self._plugin = plugin
        self.name = 'casadi rootfinder, pose before'
        self.knob = plugin

    def prepare(self, kind, dimensions):
        """Build the function from (guess, crank pin) to all points."""
        self._equations = Equations(kind, dimensions)
        self._points = problems.POINTS[kind]
        count = 2 * len(self._equations.unknown)
        x, pin = ca.SX.sym('x', count), ca.SX.sym('pin', 2)
        unknowns, at = ca.vertsplit(x), tuple(ca.vertsplit(pin))
        places = self._equations.places(unknowns, at)
        outputs = ca.vertcat(*(part for name in self._points for part in places[name]))
        left = ca.vertcat(*self._equations.residuals(unknowns, at))
        equations = ca.Function('equations', [x, pin], [left, outputs])
        # casadi's own way round the cost of its matrices: memory that both sides know.
        self._buffer, self._solve = ca.rootfinder('pose', self._plugin, equations).buffer()
        self._x, self._found, self._pin, self._row = (
            np.zeros(size) for size in (count, count, 2, 2 * len(self._points)))
        self._buffer.set_arg(0, memoryview(self._x))
        self._buffer.set_arg(1, memoryview(self._pin))
        self._buffer.set_res(0, memoryview(self._found))
        self._buffer.set_res(1, memoryview(self._row))

    def start(self, theta, pose):
        """Take a pose as the one before."""
        self._x[:] = [part for name in self._equations.unknown
                      for part in (pose[name].real, pose[name].imag)]

    def solve_one(self, theta):
        """Return one row of points."""
        self._pin[:] = self._equations.pin(theta)
        self._solve()
        if self._buffer.ret():
            raise ArithmeticError('no convergence')
        self._x[:] = self._found
        return self._row.tolist()

    def poses(self, answer):
        """Name the columns."""
        return columns(self._points, answer)


METHODS = [RootFinder('newton'), RootFinder('fast_newton')]
