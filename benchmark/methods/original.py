# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The formulas of the original documents: by `math` for one pose, by numpy for many."""

import numpy as np
from truth import original_formulas

from .method import columns, Method
from .. import problems


class Original(Method):
    """Double precision."""

    name = 'original formulas'
    knob = 'float64'
    precision = np.float64

    def prepare(self, kind, dimensions):
        """Keep the dimensions, and what they alone decide."""
        self._kind, self._dimensions = kind, dimensions
        self._points = problems.POINTS[kind]
        self.solve_one = original_formulas.one_pose(kind, dimensions)

    def solve(self, theta):
        """Return {point: array (n, 2)}."""
        return original_formulas.solve(self._kind, self._dimensions, theta.astype(self.precision))

    def poses(self, answer):
        """Name the floats, and leave the ground out of arrays."""
        if isinstance(answer, tuple):
            return columns(self._points, answer)
        return {name: answer[name] for name in self._points}


class Single(Original):
    """Single precision, for arrays: Python's floats have another."""

    knob = 'float32'
    precision = np.float32
    batches = Method.batches[1:]


METHODS = [Original(), Single()]
