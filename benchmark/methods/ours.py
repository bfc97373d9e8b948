# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""linkage_ros itself: numpy alone, and with the optional accelerator."""

from linkage_ros import mechanisms

from .method import columns, Method


class Ours(Method):
    """`solve` as users call it: every point, the ground's too, as a mapping of arrays."""

    name = 'linkage_ros'
    knob = 'numpy'
    kind = 'ours'
    package = 'numpy'

    def prepare(self, kind, dimensions):
        """Create the mechanism."""
        self._mechanism = mechanisms.create(kind, **dimensions)

    def solve(self, theta):
        """Return {point: array (n, 2)}."""
        return self._mechanism.solve(theta)

    def solve_one(self, theta):
        """Return {point: array (2,)}."""
        return self._mechanism.solve(theta)

    def poses(self, answer):
        """Give single poses a first axis."""
        return {name: place.reshape(-1, 2) for name, place in answer.items()}


class Accelerated(Ours):
    """The same formulas as machine code."""

    knob = 'machine code'
    package = 'llvmlite'

    def prepare(self, kind, dimensions):
        """Create the mechanism; judging its errors has it compiled before the clock starts."""
        super().prepare(kind, dimensions)
        self._mechanism = self._mechanism.accelerated()


class Floats(Ours):
    """`function`: one pose after the other as plain floats, what most peers return too."""

    knob = 'function()'
    batches = (1,)
    points = None

    def prepare(self, kind, dimensions):
        """Ask for the function."""
        super().prepare(kind, dimensions)
        self._names = self.points or self._mechanism.points
        self.solve_one = self._mechanism.function(self.points)

    def poses(self, answer):
        """Name the columns."""
        return columns(self._names, answer)


class Part(Floats):
    """One wanted point of a Jansen leg: floats for single poses, arrays for batches."""

    kind = 'part'
    mechanisms = ('jansen',)
    batches = Method.batches

    def __init__(self, point):
        self.points = (point,)
        self.knob = f'{point} alone'

    def solve(self, theta):
        """Return {point: array (n, 2)}."""
        return self._mechanism.solve(theta, self.points)

    def poses(self, answer):
        """Name the columns of floats, and leave arrays as they are."""
        return answer if isinstance(answer, dict) else super().poses(answer)


METHODS = [Ours(), Accelerated(), Floats(), Part('G'), Part('C')]
