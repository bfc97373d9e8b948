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
pinocchio: the linkage as a tree of bodies that is closed by Newton.

pinocchio has the kinematics and the Jacobians of trees; loops are closed by a few lines on top,
which is how closed chains are usually animated with it.
"""

import cmath

import numpy as np
import pinocchio as pin

from .method import columns, Follower
from .. import problems
from ..tree import tree


class Loops(Follower):
    """Newton on the loops' gaps, from the pose before, a fixed number of times."""

    name = 'pinocchio, pose before'
    package = 'pin'

    def __init__(self, iterations):
        self._iterations = iterations
        self.knob = f'{iterations} iteration' + 's' * (iterations > 1)

    def prepare(self, kind, dimensions):
        """Build the model: every body's x axis runs along its bar, all angles are relative."""
        self._tree = tree(kind, dimensions)
        self._points = problems.POINTS[kind]
        self._model = model = pin.Model()
        joints = {'ground': 0}
        for body in self._tree.bodies:
            axis = pin.JointModelPX() if body.slides else pin.JointModelRZ()
            joints[body.name] = model.addJoint(joints[body.parent], axis, _shift(body.place),
                                               body.name)
        self._marks = {name: self._frame(name, joints[body], place)
                       for name, (body, place) in self._tree.marks.items()}
        self._loops = [
            tuple(self._frame(f'loop {n} {end}', joints[body], place)
                  for end, (body, place) in enumerate(ends))
            for n, ends in enumerate(self._tree.loops)]
        self._data = model.createData()

    def _frame(self, name, joint, place):
        return self._model.addFrame(
            pin.Frame(name, joint, _shift(place), pin.FrameType.OP_FRAME))

    def start(self, theta, pose):
        """Take the joint angles of a pose as the ones before."""
        self._q = np.array(self._tree.coordinates(pose))
        self._offset = cmath.phase(pose['A']) - theta

    def solve_one(self, theta):
        """Return the points."""
        model, data, q = self._model, self._data, self._q.copy()
        q[0] = theta + self._offset
        for _ in range(self._iterations):
            pin.computeJointJacobians(model, data, q)
            pin.updateFramePlacements(model, data)
            gaps, slopes = [], []
            for one, other in self._loops:
                gaps.append((data.oMf[one].translation - data.oMf[other].translation)[:2])
                slopes.append((self._slope(one) - self._slope(other))[:2, 1:])
            q[1:] -= _solved(np.concatenate(slopes), np.concatenate(gaps))
        pin.framesForwardKinematics(model, data, q)
        if np.isfinite(q).all():
            self._q = q
        return [data.oMf[self._marks[name]].translation[:2].copy() for name in self._points]

    def _slope(self, frame):
        return pin.getFrameJacobian(self._model, self._data, frame,
                                    pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)

    def poses(self, answer):
        """Name the columns."""
        return columns(self._points, answer)


def _solved(slopes, gaps):
    """Solve a square system; at a dead point, where it is singular, as well as can be."""
    try:
        return np.linalg.solve(slopes, gaps)
    except np.linalg.LinAlgError:
        return np.linalg.lstsq(slopes, gaps, rcond=None)[0]


def _shift(place):
    return pin.SE3(np.eye(3), np.array([place.real, place.imag, 0.0]))


METHODS = [Loops(n) for n in (1, 2, 3)]
