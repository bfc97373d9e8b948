# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What every method answers to."""

import numpy as np


class Method:
    """
    One way to solve a linkage, at one setting of its knob.

    `prepare` does what is done once for a set of dimensions (tables, compilation) and is not
    timed. `solve` takes an array of crank angles [rad], `solve_one` a float; both return what the
    method naturally has, and `poses` names it, also untimed: {point: array (n, 2)}. Where the
    linkage cannot be assembled an answer is NaN or an exception.
    """

    name = ''
    knob = ''
    kind = 'peer'         # 'ours', 'part' (of a pose), 'peer' or 'limit'
    package = None        # the distribution whose version the results name
    mechanisms = ('water_drop', 'jansen', 'peaucellier', 'slotted_lever')
    follows = False       # True: each pose is found from the one before
    batches = (1, 12, 1000, 100_000)

    def prepare(self, kind, dimensions):
        """Get ready for a linkage; what is done here is done once and not timed."""
        raise NotImplementedError

    def solve(self, theta):
        """Return the poses at an array of crank angles [rad]."""
        raise NotImplementedError

    def solve_one(self, theta):
        """Return the pose at one crank angle [rad]."""
        raise NotImplementedError

    def poses(self, answer):
        """Return an answer of `solve` or `solve_one` as {point: array (n, 2)}."""
        return answer


class Follower(Method):
    """
    A method that finds a pose from the one before.

    It is set down on the true pose at one angle by `start` (untimed) and then asked for angles in
    order.
    """

    follows = True

    def start(self, theta, pose):
        """Set the method down at a crank angle on a pose {point: complex}."""
        raise NotImplementedError

    def solve(self, theta):
        """Follow the angles one by one, None where the method gives up."""
        found = []
        for angle in theta.tolist():
            try:
                found.append(self.solve_one(angle))
            except Exception:  # a package may raise what it likes
                found.append(None)
        return found


def columns(names, rows):
    """Return one or more rows, x and y of each point in turn, as {point: array (n, 2)}."""
    rows = np.asarray(rows, float).reshape(-1, len(names), 2)
    return {name: rows[:, i] for i, name in enumerate(names)}
