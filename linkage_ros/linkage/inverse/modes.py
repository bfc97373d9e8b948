# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

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

    def candidates(self, values: Sequence[float]) -> Iterator[Tuple[float, ...]]:
        """Yield the inputs of each mode that can be assembled."""
        flat, n = self._pose.at(*values), self._problem.n
        for start in range(0, len(flat), n):
            inputs = flat[start:start + n]
            if math.isfinite(sum(inputs)):
                yield inputs

    def candidate_arrays(self, values: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return numbers of modes, of values (outputs, m) that they have, and the inputs there."""
        modes = self._pose.over(*values).reshape(-1, *values.shape)
        numbers, places = np.nonzero(np.isfinite(modes).all(axis=1))
        return numbers, places, modes[numbers, :, places].T
