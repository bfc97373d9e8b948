# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""The formulas of the original documents in numpy, in double and in single precision."""

import numpy as np

from .method import Method
from .. import original_formulas, problems


class Original(Method):
    """One precision; single poses go through arrays of one element, as numpy users have them."""

    name = 'original formulas'
    kind = 'peer'

    def __init__(self, precision):
        self._precision = precision
        self.knob = precision.__name__

    def prepare(self, kind, dimensions):
        """Keep the dimensions."""
        self._kind, self._dimensions = kind, dimensions
        self._points = problems.POINTS[kind]

    def solve(self, theta):
        """Return {point: array (n, 2)}."""
        return original_formulas.solve(self._kind, self._dimensions,
                                       theta.astype(self._precision))

    def solve_one(self, theta):
        """Return {point: array (2,)}."""
        return original_formulas.solve(self._kind, self._dimensions, self._precision(theta))

    def poses(self, answer):
        """Leave the ground out."""
        return {name: answer[name].reshape(-1, 2) for name in self._points}


METHODS = [Original(np.float64), Original(np.float32)]
