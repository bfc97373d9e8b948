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
numba on the very operations of `linkage_ros.formula`, with the dimensions as constants.

`OnOurs` is what other engines share that are handed these operations.
"""

from linkage_ros import mechanisms
from linkage_ros.formula import program
from linkage_ros.linkage import formulas
import numba
import numpy as np

from .method import columns
from .ours import Ours
from .. import problems


class Plain(Ours):
    """Python for one pose, numpy for arrays."""

    knob = 'Python and numpy'

    def prepare(self, kind, dimensions):
        """Read the joint lines and make the code, nothing of which is kept from before."""
        formulas.structure_of.cache.clear()
        vars(mechanisms.design(kind)).pop('lines', None)
        super().prepare(kind, dimensions)
        self.points = problems.POINTS[kind]
        self.solve_one = self._mechanism.function(self.points)

    def solve(self, theta):
        """Return {point: array (n, 2)}."""
        return self._mechanism.solve(theta, self.points)

    def poses(self, answer):
        """Name the floats, and leave arrays as they are."""
        return answer if isinstance(answer, dict) else columns(self.points, answer)


class OnOurs(Plain):
    """Another engine on the operations of this one."""

    name = 'the same operations'

    def prepare(self, kind, dimensions):
        """Make the function of the other engine."""
        super().prepare(kind, dimensions)
        design, made = mechanisms.design(kind), self._mechanism
        structure = formulas.structure_of(design, tuple(made.branches.items()))
        pose = structure.program('points', self.points).bind({**made.dimensions, '[m]': 1.0}, {})
        self.make(pose.variant.listing, pose.constants)

    def make(self, listing, constants):
        """Make the function of a list of operations and its constants."""
        raise NotImplementedError

    def poses(self, answer):
        """Name the columns."""
        return columns(self.points, answer)


class Numba(OnOurs):
    """A function of a float, and one that loops over an array."""

    knob = 'numba'
    kind = 'peer'
    package = 'numba'

    def make(self, listing, constants):
        """Compile the text of the Python code."""
        lines, outputs = listing.statements(program.FLOATS)
        body = [f'{name} = {code}' for name, code in lines]
        source = '\n'.join([
            'def pose(x0):', *(f'    {line}' for line in body),
            f'    return ({", ".join(outputs)})',
            'def loop(theta, rows):', '    for n in range(theta.size):', '        x0 = theta[n]',
            *(f'        {line}' for line in body),
            *(f'        rows[n, {k}] = {code}' for k, code in enumerate(outputs))])
        # With the constants as globals they are part of the machine code.
        scope = {**program.FLOATS.names,
                 **{f'k{number}': value for number, value in zip(listing.constants, constants)}}
        exec(compile(source, '<linkage>', 'exec'), scope)
        # Without numba's check of every division, which raises.
        self.solve_one, self._loop = (
            numba.njit(scope[name], error_model='numpy') for name in ('pose', 'loop'))
        self.solve(np.zeros(2))

    def solve(self, theta):
        """Return rows of points."""
        rows = np.empty((theta.size, 2 * len(self.points)))
        self._loop(theta, rows)
        return rows


METHODS = [Numba()]
