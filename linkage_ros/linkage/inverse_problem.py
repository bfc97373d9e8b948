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
The problem that an inverse solves: outputs as many as inputs, their periods and sizes.

Both ways to solve it use this: the closed forms (`closed_form`) and the searches (`search`).
"""

from __future__ import annotations

from functools import cached_property, partial, reduce
import math
import operator
from typing import Any, cast, Sequence, Tuple, TYPE_CHECKING

import numpy as np

from .curves import LEAST
from .input_range import is_periodic
from .inputs import Input, spread
from ..formula.program import Pose

if TYPE_CHECKING:
    from .mechanism import Mechanism

# Two solutions are one if they differ by less than the first [rad, sizes], or by less than the
# outputs' rounding explains, which is considered up to the second.
SAME, NEIGHBOURS = 1e-13, 1e-4
# Greater than any input.
LARGE = 1e300

# Inputs and rates of a solution.
Found = Tuple[Tuple[float, ...], Tuple[float, ...]]


class InverseProblem:
    """
    A linkage and the names of outputs that determine its inputs.

    Attributes
    ----------
    inputs : tuple of Input
        Those of the linkage. If one repeats only after very many turns, its period is that of the
        outputs, if they repeat earlier.
    angular : list of bool
        For each output, whether it is an angle.
    scales, sizes : list of float
        The unit of each output and of each input in which they are compared [rad or m].
    periods : list of float
        For each output after how much it is the same [rad], or inf.
    turned : list of (float, float, float)
        For each input half a period, the period, and the value below which it is zero.
    forward : Pose
        The code for the outputs, for their rates, and for whether all can be assembled.

    """

    def __init__(self, linkage: Mechanism, outputs: Tuple[str, ...]):
        self.linkage, self.outputs, self.forward = linkage, outputs, linkage.checked(outputs)
        if self.forward.shape:
            raise ValueError('the inverse is for one set of dimensions, not for arrays')
        self.angular = [linkage.is_angle(name) for name in outputs]
        self.scales = [1.0 if angular else linkage.longest for angular in self.angular]
        self.sizes = [input_.size for input_ in linkage.inputs]
        self.inputs = tuple(map(self._coming_round, range(len(outputs)), linkage.inputs))
        # An output that is an input has its period.
        fixed = {input_.name: input_ for input_ in self.inputs}
        self.periods = [math.inf if not angular or name in fixed and not fixed[name].wraps else
                        fixed[name].turn if name in fixed else math.tau
                        for name, angular in zip(outputs, self.angular)]
        self.turned = [(0.5 * input_.turn, input_.turn, LEAST) if input_.wraps else
                       (math.inf, math.inf, LEAST * input_.size) for input_ in self.inputs]

    def _coming_round(self, by: int, input_: Input) -> Input:
        """Return an input with the period of the outputs if its own has too many turns."""
        if not input_.is_part:
            return input_
        rates = [self.linkage.gear(name, by)[0] for name in self.linkage.geared_to(by)]
        periods = (1.0, *(1.0 / abs(rate) for rate in rates if rate))
        return next((each for each in (input_._replace(period=period) for period in periods)
                     if each.wraps and is_periodic(partial(self._outputs_over, by), each)), input_)

    def _outputs_over(self, by: int, values: np.ndarray) -> np.ndarray:
        """Return the outputs, angles as directions, over one input; the others are spread."""
        inputs = spread(self.linkage.inputs, len(values))
        inputs[by] = values
        rows = zip(self.forward.over(*inputs), self.angular, self.scales)
        return np.concatenate([[np.cos(row), np.sin(row)] if angular else [row / scale]
                               for row, angular, scale in rows])

    @cached_property
    def rated(self) -> Pose:
        """Return the code for the outputs with their rates."""
        return self.linkage.posed((), self.outputs, self.outputs)

    def reduced(self, values: Tuple[float, ...]) -> Tuple[float, ...]:
        """Return values with large angles reduced to one turn, by sine and cosine, exactly."""
        return tuple(float(_within_turn(x, turn)) if abs(x) > turn else x
                     for x, turn in zip(values, self.periods))

    def within_turns(self, values: np.ndarray) -> np.ndarray:
        """Return values (outputs, n) as `reduced` does; NaN for those that are not finite."""
        near = np.abs(values) <= math.tau
        if near.all():
            return values
        values = np.where(np.isfinite(values), values, np.nan)
        for row, turn in zip(values, self.periods):
            far = np.abs(row) > turn
            row[far] = _within_turn(row[far], turn)
        return values

    def next_to(self, inputs: Sequence[float], near: Sequence[float]) -> Tuple[float, ...]:
        """Return inputs plus the whole turns that bring them closest to others."""
        return tuple(x + input_.turn * round((y - x) / input_.turn) if input_.wraps else x
                     for input_, x, y in zip(self.inputs, inputs, near))

    def jacobian(self, rates: Sequence[float]) -> np.ndarray:
        """Return d outputs / d inputs, both in units of their sizes, from rates by each input."""
        return (np.reshape(rates, (len(self.outputs), -1)).T * self.sizes
                / np.reshape(self.scales, (-1, 1)))

    def away(self, inputs: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Return the squared distances of inputs (inputs, ...) from others, in their sizes."""
        total = []
        for x, y, (_, turn, _), size in zip(inputs, others, self.turned, self.sizes):
            gap = x - y
            if math.isfinite(turn):
                gap -= turn * rounded(gap / turn)
            else:
                gap /= size
            gap *= gap
            total.append(gap)
        return reduce(operator.iadd, total)


def _within_turn(value: Any, turn: float) -> Any:
    count = turn / math.tau
    return count * np.arctan2(np.sin(value / count), np.cos(value / count))


def rounded(values: np.ndarray) -> np.ndarray:
    """Round an array in place to the nearest integers."""
    return cast(np.ndarray, np.rint(values, out=values))
