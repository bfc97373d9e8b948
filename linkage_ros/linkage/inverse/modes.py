# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The assembly modes of the inverse linkage: candidates in closed form, for floats and arrays."""

from __future__ import annotations

from itertools import product
import math
from typing import Iterator, Sequence, Tuple

import numpy as np

from .linkage import InverseLinkage
from .problem import InverseProblem
from ...formula.program import Program


class Modes:
    """The inputs in each assembly mode of an inverse linkage, and in each of its turns."""

    def __init__(self, problem: InverseProblem, closed: InverseLinkage):
        self._problem = problem
        rows = [value + turn for mode in closed.modes for turns in product(*closed.turns)
                for value, turn in zip(mode.inputs, turns)]
        self._pose = problem.linkage.bind(Program(rows, problem.n, closed.arguments))
        self._shape = len(rows) // problem.n, problem.n

    def candidates(self, values: Sequence[float]) -> Iterator[Tuple[Tuple[float, ...], None]]:
        """Yield the inputs of each mode that can be assembled."""
        flat, n = self._pose.at(*values), self._problem.n
        for start in range(0, len(flat), n):
            inputs = flat[start:start + n]
            if math.isfinite(sum(inputs)):
                yield inputs, None

    def candidate_arrays(self, values: np.ndarray) -> np.ndarray:
        """Return the inputs of each mode for values (outputs, m), shape (modes, inputs, m)."""
        pose = self._pose
        over = pose.over if self._problem.linkage.is_accelerated else pose.searched
        return over(*values).reshape(*self._shape, values.shape[1])
