# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The problem that an inverse solves: outputs as many as inputs, their periods and units.

All of the inverse works on it: what yields candidates (`segments`, `modes`, `grid`), what refines
them (`refine`), and what chooses one (`choice`) or continues one (`follow`).
"""

from __future__ import annotations

from functools import cached_property, partial
import math
from typing import Any, Sequence, Tuple

import numpy as np

from ..inputs import Input, is_periodic, spread
from ..kinematics import Kinematics
from ..motion.curves import LEAST
from ...formula.program import Pose

# The inputs of a solution, then the rates of all outputs by the first input, by the second etc.
Row = Tuple[float, ...]


class InverseProblem:
    """
    A linkage and the names of outputs that determine its inputs.

    Attributes
    ----------
    n : int
        The number of outputs, and of inputs.
    inputs : tuple of Input
        Those of the linkage. If one repeats only after very many turns, its period is that of the
        outputs, if they repeat earlier.
    angular : list of bool
        For each output, whether it is an angle.
    scales, sizes : list of float
        The unit of each output and of each input in which they are compared [rad or m].
    periods, turns : list of float
        For each output and for each input after how much it is the same [rad], or inf.
    forward : Pose
        The code for the outputs and for their rates by each input.

    """

    def __init__(self, linkage: Kinematics, outputs: Tuple[str, ...]):
        self.linkage, self.outputs, self.n = linkage, outputs, len(outputs)
        # Of one input, candidates are inside the reach.
        self.forward: Pose = linkage.checked(outputs) if self.n > 1 else self.rated
        if self.forward.shape:
            raise ValueError('the inverse is for one set of dimensions, not for arrays')
        self.angular = [linkage.is_angle(name) for name in outputs]
        self.scales = [1.0 if angular else linkage.longest for angular in self.angular]
        self.sizes = [input_.size for input_ in linkage.inputs]
        self.inputs = tuple(map(self._with_period, range(self.n), linkage.inputs))
        self.turns = [input_.turn if input_.wraps else math.inf for input_ in self.inputs]
        # An output that is an input has its period.
        own = {input_.name: turn for input_, turn in zip(self.inputs, self.turns)}
        self.periods = [own.get(name, math.tau) if angular else math.inf
                        for name, angular in zip(outputs, self.angular)]

    def _with_period(self, by: int, input_: Input) -> Input:
        """Return an input with the period of the outputs if its own has too many turns."""
        if not input_.is_part:
            return input_
        rates = [self.linkage.gear(name, by)[0] for name in self.linkage.geared_to(by)]
        periods = (1.0, *(1.0 / abs(rate) for rate in rates if rate))
        return next((each for each in (input_._replace(
            period=period, low=-math.pi * period, high=math.pi * period) for period in periods)
                     if each.wraps and is_periodic(partial(self._outputs_over, by), each)), input_)

    def _outputs_over(self, by: int, values: np.ndarray) -> np.ndarray:
        """Return the outputs, angles as directions, over one input; the others are spread."""
        inputs = spread(self.linkage.inputs, len(values))
        inputs[by] = values
        # A value repeats only where the linkage can be assembled again.
        rows = zip(self.linkage.checked(self.outputs).over(*inputs), self.angular, self.scales)
        return np.concatenate([[np.cos(row), np.sin(row)] if angular else [row / scale]
                               for row, angular, scale in rows])

    @cached_property
    def rated(self) -> Pose:
        """Return the code for outputs and rates, wherever these have values."""
        return self.linkage.posed((), self.outputs, self.outputs)

    @cached_property
    def over(self) -> Any:
        """Return the function from arrays of inputs to outputs and rates, as arrays."""
        return self.forward.over if self.linkage.is_accelerated else self.forward.searched

    def reduced(self, values: Sequence[float]) -> Sequence[float]:
        """Return values with large angles reduced to one period, exactly."""
        return [x if -turn <= x <= turn else float(_within_period(x, turn))
                for x, turn in zip(values, self.periods)]

    def reduced_arrays(self, values: np.ndarray) -> np.ndarray:
        """Return what `reduced` does for values (outputs, m); NaN for those not finite."""
        values = np.where(np.isfinite(values), values, math.nan)
        for row, turn in zip(values, self.periods):
            far = np.abs(row) > turn
            row[far] = _within_period(row[far], turn)
        return values

    def wrapped(self, inputs: Sequence[float]) -> Row:
        """Return inputs, angles within one period around zero, zero without sign."""
        return tuple([(x if 2.0 * abs(x) < turn else x - turn * math.floor(x / turn + 0.5))
                      if abs(x) > LEAST * size else 0.0
                      for x, turn, size in zip(inputs, self.turns, self.sizes)])

    def wrapped_arrays(self, inputs: np.ndarray) -> np.ndarray:
        """Return what `wrapped` does for inputs (inputs, m)."""
        return np.stack([np.asarray(input_.wrapped(np.where(np.abs(x) < LEAST * size, 0.0, x)))
                         for input_, x, size in zip(self.inputs, inputs, self.sizes)])

    def distance(self, by: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the distances of values of an input, without whole periods, in its size."""
        gap, turn = x - y, self.turns[by]
        return np.abs(gap - turn * np.rint(gap / turn) if turn < math.inf
                      else gap / self.sizes[by])

    def nearest_equivalent(self, inputs: Sequence[float], others: Sequence[float]
                           ) -> Row:
        """Return inputs plus the whole periods that bring them closest to others."""
        return tuple([x if turn == math.inf else x + turn * round((y - x) / turn)
                      for x, y, turn in zip(inputs, others, self.turns)])

    def scaled(self, jacobian: np.ndarray) -> np.ndarray:
        """Return a Jacobian in units of outputs and inputs."""
        return jacobian * self.sizes / np.reshape(self.scales, (-1, 1))


def _within_period(value: Any, turn: float) -> Any:
    # Sine and cosine remove any number of whole turns without loss.
    count = turn / math.tau
    return count * np.arctan2(np.sin(value / count), np.cos(value / count))
