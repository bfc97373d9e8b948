# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""python-solvespace: SolveSpace's solver, the linkage as a sketch of points and distances."""

import math

from python_solvespace import Entity, ResultFlag, SolverSystem

from .method import columns, Follower
from .. import problems
from ..assembly import assembly, Dyad, Ray, Rigid

GIVEN, SOUGHT = 1, 2


class SketchMoves(Follower):
    """The sketch is solved from the pose before, with the crank pin moved on."""

    name = 'SolveSpace, pose before'
    knob = 'as it comes'
    package = 'python-solvespace'

    def prepare(self, kind, dimensions):
        """Remember what to draw."""
        self._plan = assembly(kind, dimensions)
        self._points = problems.POINTS[kind]

    def start(self, theta, pose):
        """Draw the sketch on a pose: ground and crank pin are given, the rest is sought."""
        self._system = system = SolverSystem()
        system.set_group(GIVEN)
        plane = system.create_2d_base()
        given = {**self._plan.ground, 'A': pose['A']}
        at = {n: system.add_point_2d(z.real, z.imag, plane) for n, z in given.items()}
        system.set_group(SOUGHT)
        for step in self._plan.steps:
            place = pose[step.name]
            point = at[step.name] = system.add_point_2d(place.real, place.imag, plane)
            if isinstance(step, Dyad):
                system.distance(point, at[step.first], step.first_bar, plane)
                system.distance(point, at[step.second], step.second_bar, plane)
            elif isinstance(step, Rigid):
                bar = abs(pose[step.end] - pose[step.base])
                system.distance(point, at[step.base], bar * abs(step.factor), plane)
                if step.factor.imag:
                    system.distance(point, at[step.end], bar * abs(step.factor - 1), plane)
                else:
                    system.coincident(point, self._line(at, step.base, step.end, plane), plane)
            elif isinstance(step, Ray):
                system.distance(point, at[step.pivot], step.length, plane)
                system.coincident(point, self._line(at, step.pivot, step.pin, plane), plane)
        self._pin = at['A'].params
        self._places = [at[name].params for name in self._points]

    def _line(self, at, base, end, plane) -> Entity:
        return self._system.add_line_2d(at[base], at[end], plane)

    def solve_one(self, theta):
        """Return the points as [x, y]."""
        system = self._system
        system.set_params(self._pin, self._plan.pin(math.cos(theta), math.sin(theta)))
        flag = system.solve()
        if flag != ResultFlag.OKAY:
            raise ArithmeticError(flag.name)
        return [system.params(place) for place in self._places]

    def poses(self, answer):
        """Name the columns."""
        return columns(self._points, answer)


METHODS = [SketchMoves()]
