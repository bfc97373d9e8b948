# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""pylinkage: simulation step by step, each joint on the intersection nearest to where it was."""

import cmath

import numpy as np
from pylinkage import Crank, FixedDyad, Ground, Linkage, RRRDyad

from .method import columns, Follower
from .. import problems
from ..assembly import assembly, Dyad, Ray, Rigid


class Step(Follower):
    """`Linkage.step()`: one pose at a time, the crank moved on by what is asked."""

    name = 'pylinkage'
    knob = 'step()'
    package = 'pylinkage'

    def prepare(self, kind, dimensions):
        """Build the linkage."""
        self._plan = assembly(kind, dimensions)
        self._points = problems.POINTS[kind]

    def start(self, theta, pose):
        """Build the linkage on a pose, and open its generator of steps."""
        self._theta = theta
        parts = {n: Ground(z.real, z.imag, name=n) for n, z in self._plan.ground.items()}
        self._crank = Crank(parts['O'], self._plan.crank, 1.0, cmath.phase(pose['A']), name='A')
        parts['A'] = self._crank
        for step in self._plan.steps:
            parts[step.name] = _part(step, parts, pose[step.name])
        self._linkage = Linkage(parts.values())
        self._columns = [list(parts).index(name) for name in self._points]
        self._open()

    def _open(self):
        self._steps = self._linkage.step(iterations=10 ** 9)

    def solve_one(self, theta):
        """Return the places of all parts after a step."""
        self._crank.angular_velocity = theta - self._theta
        self._theta = theta
        try:
            return next(self._steps)
        except Exception:
            self._open()
            raise

    def poses(self, answer):
        """Pick the joints that move."""
        rows = np.asarray(answer, float).reshape(-1, len(self._linkage.components), 2)
        return columns(self._points, rows[:, self._columns])


class StepFast(Step):
    """`Linkage.step_fast()`: the compiled loop over a constant step, for batches."""

    knob = 'step_fast()'

    def start(self, theta, pose):
        """Build the linkage on a pose and compile it."""
        super().start(theta, pose)
        self._crank.angular_velocity = 1.0
        self._linkage.compile()

    def solve(self, theta):
        """Return the places of all parts; steps of different size are asked for one by one."""
        moves = np.diff(theta, prepend=self._theta)
        self._theta = theta[-1]
        if np.ptp(moves) < 1e-9:
            return self._linkage.step_fast(theta.size, moves.mean())
        return np.concatenate([self._linkage.step_fast(1, move) for move in moves])

    def solve_one(self, theta):
        """Return the places of all parts after a step."""
        move, self._theta = theta - self._theta, theta
        return self._linkage.step_fast(1, move)


def _part(step, parts, place):
    if isinstance(step, Dyad):
        return RRRDyad(parts[step.first], parts[step.second], step.first_bar, step.second_bar,
                       place.real, place.imag, name=step.name)
    if isinstance(step, Rigid):
        bar = abs(complex(*parts[step.end].position) - complex(*parts[step.base].position))
        return FixedDyad(parts[step.base], parts[step.end], bar * abs(step.factor),
                         cmath.phase(step.factor), name=step.name)
    if isinstance(step, Ray):
        return FixedDyad(parts[step.pivot], parts[step.pin], step.length, 0.0, name=step.name)
    raise TypeError(step)


METHODS = [Step(), StepFast()]
