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
MuJoCo: the physics engine, the loops closed by its (soft) connect constraints.

The crank is moved at 1 rad/s, in a number of time steps from one pose to the next; all other
bodies follow as their masses will.
"""

import cmath

import mujoco
import numpy as np

from .method import columns, Follower
from .. import problems
from ..tree import tree

SPEED = 1.0           # of the crank [rad/s]
LEAST_STEP = 1e-12    # [s]

# Where the simulation blows up the pose is astray and counted as that; no log file is wanted.
mujoco.set_mju_user_warning(lambda message: None)


class Simulation(Follower):
    """A number of time steps a pose."""

    name = 'MuJoCo, simulated'
    package = 'mujoco'

    def __init__(self, steps):
        self._steps = steps
        self.knob = f'{steps} time steps'

    def prepare(self, kind, dimensions):
        """Write the model; its unit of length is the longest bar, which suits the engine."""
        self._tree = tree(kind, dimensions)
        self._points = problems.POINTS[kind]
        self._size = problems.problem(kind).longest
        self._model = mujoco.MjModel.from_xml_string(self._document())
        self._joints = [self._model.joint(body.name).qposadr[0] for body in self._tree.bodies]
        self._marks = [self._model.site(name).id for name in self._points]
        self._slides = np.array([body.slides for body in self._tree.bodies])

    def _document(self):
        marks = list(self._tree.marks.items())
        connects = []
        for n, loop in enumerate(self._tree.loops):
            marks += [(f'{n} {end}', mark) for end, mark in enumerate(loop)]
            connects.append(f'<connect site1="{n} 0" site2="{n} 1" solref="1e-9 1" '
                            'solimp="0.999 0.9999 0.0001"/>')
        return ('<mujoco><option gravity="0 0 0" integrator="implicitfast"/><worldbody>'
                + self._inside('ground', marks)
                + f'</worldbody><equality>{"".join(connects)}</equality></mujoco>')

    def _inside(self, name, marks):
        """Return the marks and children of a body."""
        sites = (f'<site name="{mark}" pos="{self._pos(place)}"/>'
                 for mark, (body, place) in marks if body == name)
        children = (self._body(body, marks) for body in self._tree.bodies if body.parent == name)
        return ''.join((*sites, *children))

    def _body(self, body, marks):
        joint = 'type="slide" axis="1 0 0"' if body.slides else 'type="hinge" axis="0 0 1"'
        heavy = 'armature="1e6"' if body.name == 'crank' else 'damping="0.1"'
        return (f'<body name="{body.name}" pos="{self._pos(body.place)}">'
                f'<joint name="{body.name}" {joint} {heavy}/>'
                '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
                + self._inside(body.name, marks) + '</body>')

    def _pos(self, place):
        return f'{place.real / self._size:.17g} {place.imag / self._size:.17g} 0'

    def start(self, theta, pose):
        """Set the bodies down on a pose, at rest relative to the crank's motion."""
        self._data = mujoco.MjData(self._model)
        coordinates = np.array(self._tree.coordinates(pose))
        coordinates[self._slides] /= self._size
        self._data.qpos[self._joints] = coordinates
        self._theta, self._offset = theta, cmath.phase(pose['A']) - theta

    def solve_one(self, theta):
        """Return the points."""
        model, data = self._model, self._data
        move = theta - self._theta
        model.opt.timestep = max(abs(move) / (SPEED * self._steps), LEAST_STEP)
        for n in range(1, self._steps + 1):
            data.qvel[0] = SPEED if move >= 0 else -SPEED
            mujoco.mj_step(model, data)
            data.qpos[0] = self._theta + self._offset + n / self._steps * move
        mujoco.mj_kinematics(model, data)
        self._theta = theta
        return data.site_xpos[self._marks, :2] * self._size

    def poses(self, answer):
        """Name the columns."""
        return columns(self._points, answer)


METHODS = [Simulation(n) for n in (1, 10, 100)]
