# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""planegcs: FreeCAD's sketcher, the linkage as a sketch of points and distances."""

import math

from planegcs import Algorithm, Sketch, SolveStatus

from .method import columns, Follower
from .. import problems
from ..assembly import assembly, Dyad, Ray, Rigid


class SketchMoves(Follower):
    """The sketch is solved from the pose before, with the crank pin moved on."""

    name = 'planegcs, pose before'
    package = 'planegcs'

    def __init__(self, algorithm):
        self._algorithm = algorithm
        self.knob = algorithm.name

    def prepare(self, kind, dimensions):
        """Remember what to draw."""
        self._plan = assembly(kind, dimensions)
        self._points = problems.POINTS[kind]

    def start(self, theta, pose):
        """Draw the sketch on a pose."""
        self._sketch = sketch = Sketch()
        self._at, self._pin = {}, ()
        for name, place in (*self._plan.ground.items(), ('A', pose['A'])):
            self._at[name], self._pin = self._fixed(place)
        for step in self._plan.steps:
            place = pose[step.name]
            at = self._at[step.name] = sketch.add_point(place.real, place.imag)
            if isinstance(step, Dyad):
                for other, bar in ((step.first, step.first_bar), (step.second, step.second_bar)):
                    sketch.p2p_distance(at, self._at[other], sketch.add_param(bar))
            elif isinstance(step, Rigid):
                self._triangle(step, pose)
            elif isinstance(step, Ray):
                sketch.p2p_distance(at, self._at[step.pivot], sketch.add_param(step.length))
                slot = sketch.add_line(self._at[step.pivot], self._at[step.pin])
                sketch.point_on_line(at, slot)

    def _fixed(self, place):
        point = self._sketch.add_point(place.real, place.imag)
        x, y = (self._sketch.add_param(part) for part in (place.real, place.imag))
        self._sketch.solver.coordinate_x(point, x, True)
        self._sketch.solver.coordinate_y(point, y, True)
        return point, (x, y)

    def _triangle(self, step, pose):
        """Fix a point to a bar: by two distances, or on the bar's line where it is straight."""
        sketch, at = self._sketch, self._at[step.name]
        bar = abs(pose[step.end] - pose[step.base])
        sketch.p2p_distance(at, self._at[step.base], sketch.add_param(bar * abs(step.factor)))
        if step.factor.imag:
            other = sketch.add_param(bar * abs(step.factor - 1))
            sketch.p2p_distance(at, self._at[step.end], other)
        else:
            line = sketch.add_line(self._at[step.base], self._at[step.end])
            sketch.point_on_line(at, line)

    def solve_one(self, theta):
        """Return the points as (x, y)."""
        sketch = self._sketch
        x, y = self._plan.pin(math.cos(theta), math.sin(theta))
        sketch.set_param(self._pin[0], x)
        sketch.set_param(self._pin[1], y)
        status = sketch.solver.solve(self._algorithm)
        if status not in (SolveStatus.Success, SolveStatus.Converged):
            raise ArithmeticError(status.name)
        return [sketch.get_point(self._at[name]) for name in self._points]

    def poses(self, answer):
        """Name the columns."""
        return columns(self._points, answer)


METHODS = [SketchMoves(Algorithm.DogLeg), SketchMoves(Algorithm.LevenbergMarquardt),
           SketchMoves(Algorithm.BFGS)]
