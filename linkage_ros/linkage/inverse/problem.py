# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The problem that an inverse solves: outputs as many as inputs, their periods and units.

All of the inverse works on it: what yields candidates (`segments`, `modes`, `grid`), what refines
them (`refine`), and what chooses one (`choice`) or continues one (`follow`).
"""

from __future__ import annotations

from functools import cached_property, reduce
from itertools import combinations
import math
from typing import NamedTuple, Sequence

import numpy as np

from ..formulas import LinkageFormulas
from ..inputs import Input
from ..kinematics import Kinematics
from ..motion.reach import reach_of
from ..tolerances import MIN_ANGLE, SINGULAR
from ...cache import cached
from ...formula.expression import argument, dimension, greater, nearest_integer, Real, real, where
from ...formula.program import CompiledFunction, Program

# The largest error of a solution, relative to rounding of outputs, and of inputs times rates.
ACCEPTED = 64.0 * 2.0 ** -53

# The dimension of this name is the unit of lengths [m]; those of inputs' names are their units.
UNIT_LENGTH = '[longest bar]'

# The inputs of a solution, then the rates of all outputs by the first input, by the second etc.
Row = tuple[float, ...]


class Candidate(NamedTuple):
    """
    An estimate of a solution's inputs [rad or m].

    Of one unknown input two others may be known between which an output has its value once, or a
    special one, with `low` and `high` equal. That it is a solution is then known, too.
    """

    inputs: Row
    low: float = -math.inf
    high: float = math.inf


class InverseProblem:
    """
    A linkage and the names of outputs that determine its inputs.

    Attributes
    ----------
    n : int
        The number of outputs, and of inputs.
    inputs : tuple of Input
        Those of the linkage. The period of one that repeats only after very many turns is one
        turn if the outputs repeat after that.
    scales, sizes : list of float
        The unit of each output and of each input in which they are compared [rad or m].
    periods, turns : list of float
        For each output and for each input after how much it is the same [rad], or inf.

    """

    def __init__(self, linkage: Kinematics, outputs: tuple[str, ...]):
        self.linkage, self.outputs, self.n = linkage, outputs, len(outputs)
        if linkage.shape:
            raise ValueError('the inverse is for one set of dimensions, not for arrays')
        self.scales = [1.0 if linkage.is_angle(name) else linkage.longest for name in outputs]
        self.sizes = [input_.size for input_ in linkage.inputs]
        self.inputs = tuple(map(self._with_period, range(self.n), linkage.inputs))
        self.turns = [input_.turn if input_.wraps else math.inf for input_ in self.inputs]
        # An output that is an input has its period.
        turn_of = {input_.name: turn for input_, turn in zip(self.inputs, self.turns)}
        self.periods = [turn_of.get(name, math.tau) if linkage.is_angle(name) else math.inf
                        for name in outputs]

    def _with_period(self, by: int, input_: Input) -> Input:
        """Return an input, with one turn as its period if the outputs repeat after that."""
        if not input_.is_part:
            return input_
        ends = np.ravel(reach_of(self.linkage)) if self.n == 1 else np.empty(0)
        # A value repeats only where the linkage can be assembled again.
        repeats = self.linkage.repeats(by, 1, 'checked', self.outputs, input_.high,
                                       0.5 * (ends[1:] + ends[:-1]))
        return Input(input_.name, speed=input_.speed) if repeats else input_

    @cached_property
    def newton(self) -> CompiledFunction:
        """Return the code for a step of Newton's method; see `newton`."""
        linkage = self.linkage
        program = newton(linkage.formulas, self.outputs, tuple(self.periods), tuple(self.turns))
        return program.bind({**linkage.dimensions, UNIT_LENGTH: linkage.longest, **{
            f'[{input_.name}]': size for input_, size in zip(self.inputs, self.sizes)}}, {},
            linkage.is_accelerated)

    def reduced(self, values: Row) -> Row:
        """Return values with large angles reduced to one period, exactly."""
        if all(abs(x) <= turn for x, turn in zip(values, self.periods)):
            return values
        return tuple(self.reduced_arrays(np.array(values)).tolist())

    def reduced_arrays(self, values: np.ndarray) -> np.ndarray:
        """Return values (outputs, ...) with large angles reduced to one period, exactly."""
        values = np.array(values)
        for by, turn in enumerate(self.periods):
            if turn < math.inf:
                row, count = values[by], turn / math.tau
                # Sine and cosine remove any number of whole turns without loss.
                with np.errstate(invalid='ignore'):
                    values[by] = np.where(np.abs(row) <= turn, row, count * np.arctan2(
                        np.sin(row / count), np.cos(row / count)))
        return values

    def nearest_equivalent(self, inputs: Sequence[float], seed: Sequence[float]) -> Row:
        """Return inputs plus the whole periods that bring them closest to others."""
        return tuple([input_.nearest_equivalent(x, y)
                      for input_, x, y in zip(self.inputs, inputs, seed)])

    def scaled(self, jacobian: np.ndarray) -> np.ndarray:
        """Return a Jacobian in units of outputs and inputs."""
        return jacobian * self.sizes / np.reshape(self.scales, (-1, 1))


def nearest(x: Real, seed: Real, turn: float) -> Real:
    """Return a number that is periodic by a turn, next to a seed."""
    return x if turn == math.inf else x + turn * nearest_integer((seed - x) / turn)


@cached(64, shared=True)
def newton(formulas: LinkageFormulas, outputs: tuple[str, ...], periods: Sequence[float],
           turns: Sequence[float]) -> Program:
    """
    Return the code for a step of Newton's method, from the inputs and values of the outputs.

    It returns the error of the outputs in their units, the largest one relative to rounding, and
    that of each output; the inputs after a step; the inputs within one period around zero, zero
    without sign; and the rates of all outputs by the first input, by the second and so on.
    """
    n, inputs = len(outputs), [argument(by) for by in range(len(outputs))]
    # Of one input, candidates are inside the reach.
    rows = formulas.checked(outputs) if n > 1 else formulas.parts(((), outputs, outputs))
    scales = [real(1.0) if formulas.is_angle(name) else dimension(UNIT_LENGTH)
              for name in outputs]
    sizes = [real(1.0) if input_.is_angle else dimension(f'[{input_.name}]')
             for input_ in formulas.built.inputs]
    errors = [nearest(row - argument(n + by), real(0.0), turn) / scale
              for by, (row, turn, scale) in enumerate(zip(rows, periods, scales))]
    # A row for each output, in units of outputs and inputs.
    jacobian = [[rate * size / scale for rate, size in zip(rows[n + by::n], sizes)]
                for by, scale in enumerate(scales)]
    weights = [greater(abs(x) / size, real(1.0)) for x, size in zip(inputs, sizes)]
    largest = real(SINGULAR / ACCEPTED)
    ratios = []
    for error, rates in zip(errors, jacobian):
        rounding = sum((abs(rate) * weight for rate, weight in zip(rates, weights)), real(1.0))
        # Where a pose has no rates, they explain nothing.
        ratios.append(abs(error) / where(
            rounding < largest, rounding, where(largest <= rounding, largest, 1.0)))
    determinant, wrapped = _determinant(jacobian), []
    steps = [_determinant([[*rates[:by], error, *rates[by + 1:]]
                           for error, rates in zip(errors, jacobian)]) for by in range(n)]
    for x, size, turn in zip(inputs, sizes, turns):
        x = nearest(where(abs(x) > MIN_ANGLE * size, x, 0.0), real(0.0), turn)
        wrapped.append(x if turn == math.inf else where(x < 0.5 * turn, x, -0.5 * turn))
    return Program([
        sum(map(abs, errors), real(0.0)), reduce(greater, ratios), *errors,
        *(x - step * size / determinant for x, step, size in zip(inputs, steps, sizes)),
        *wrapped, *rows[n:]], 2 * n)


def _determinant(rows: Sequence[Sequence[Real]]) -> Real:
    """Return a determinant, expanded by rows from below; each minor is computed once."""
    minors: dict[tuple[int, ...], Real] = {(): real(1.0)}
    for size, row in enumerate(reversed(rows), 1):
        minors = {columns: sum((
            (-1.0) ** place * row[column] * minors[columns[:place] + columns[place + 1:]]
            for place, column in enumerate(columns)), real(0.0))
            for columns in combinations(range(len(rows)), size)}
    determinant, = minors.values()
    return determinant
