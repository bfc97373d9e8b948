# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Drake: inverse kinematics as an optimization, the loops as position constraints."""

import cmath

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, PrismaticJoint, RevoluteJoint, SpatialInertia
from pydrake.solvers import SnoptSolver, SolverOptions

from .method import columns, Follower
from .. import problems
from ..tree import tree


class Optimization(Follower):
    """SNOPT, as near the pose before as the loops allow, at a tolerance."""

    name = 'Drake SNOPT, pose before'
    package = 'drake'

    def __init__(self, tolerance):
        self._tolerance = tolerance
        self.knob = f'tol {tolerance:.0e}'

    def prepare(self, kind, dimensions):
        """Build the plant; its unit of length is the longest bar, which suits the tolerance."""
        self._tree = tree(kind, dimensions)
        self._points = problems.POINTS[kind]
        self._size = problems.problem(kind).longest
        self._slides = np.array([body.slides for body in self._tree.bodies])
        plant = self._plant = MultibodyPlant(0.0)
        frames = {'ground': plant.world_frame()}
        joints = []
        for body in self._tree.bodies:
            new = plant.AddRigidBody(body.name, SpatialInertia.SolidSphereWithMass(1.0, 0.1))
            place = self._frame(body.name + ' joint', frames[body.parent], body.place)
            joint = (PrismaticJoint(body.name, place, new.body_frame(), [1, 0, 0])
                     if body.slides else
                     RevoluteJoint(body.name, place, new.body_frame(), [0, 0, 1]))
            joints.append(plant.AddJoint(joint))
            frames[body.name] = new.body_frame()
        self._marks = [self._mark(frames, mark) for name, mark in self._tree.marks.items()
                       if name in self._points]
        self._order = [name for name in self._tree.marks if name in self._points]
        loops = [[self._mark(frames, mark) for mark in loop] for loop in self._tree.loops]
        plant.Finalize()
        # Drake has its own order of the joints' positions.
        self._places = [joint.position_start() for joint in joints]
        self._context = plant.CreateDefaultContext()
        self._ik = InverseKinematics(plant, self._context, False)
        for (one, place), (other, there) in loops:
            # Nothing leaves the plane, so the gap across it needs no constraint.
            self._ik.AddPositionConstraint(one, place, other, RigidTransform(there),
                                           [0, 0, -1], [0, 0, 1])
        self._q = self._ik.q()
        self._crank = self._ik.prog().AddBoundingBoxConstraint(
            0.0, 0.0, self._q[self._places[0]]).evaluator()
        self._near = self._ik.prog().AddQuadraticErrorCost(
            np.eye(len(self._q)), np.zeros(len(self._q)), self._q).evaluator()
        self._program, self._twice = self._ik.prog(), 2 * np.eye(len(self._q))
        self._solver, self._options = SnoptSolver(), SolverOptions()
        for option in ('Major feasibility tolerance', 'Major optimality tolerance'):
            self._options.SetOption(SnoptSolver.id(), option, self._tolerance)

    def _frame(self, name, frame, place):
        shift = RigidTransform(self._point(place))
        return self._plant.AddFrame(FixedOffsetFrame(name, frame, shift))

    def _mark(self, frames, mark):
        body, place = mark
        return frames[body], self._point(place)

    def _point(self, place):
        return np.array([place.real, place.imag, 0.0]) / self._size

    def start(self, theta, pose):
        """Take the joint angles of a pose as the ones before."""
        coordinates = np.array(self._tree.coordinates(pose))
        coordinates[self._slides] /= self._size
        self._before = np.empty(coordinates.size)
        self._before[self._places] = coordinates
        self._offset = cmath.phase(pose['A']) - theta

    def solve_one(self, theta):
        """Return the points."""
        crank = theta + self._offset
        self._crank.set_bounds([crank], [crank])
        self._before[self._places[0]] = crank
        before = self._before
        self._near.UpdateCoefficients(self._twice, -2 * before, before @ before)
        result = self._solver.Solve(self._program, self._before, self._options)
        if not result.is_success():
            raise ArithmeticError(str(result.get_solution_result()))
        self._before = result.GetSolution(self._q)
        self._plant.SetPositions(self._context, self._before)
        world = self._plant.world_frame()
        return [self._plant.CalcPointsPositions(self._context, frame, place, world)[:2, 0]
                * self._size for frame, place in self._marks]

    def poses(self, answer):
        """Name the columns."""
        found = columns(self._order, answer)
        return {name: found[name] for name in self._points}


METHODS = [Optimization(tolerance) for tolerance in (1e-5, 1e-9)]
