# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The inverse as expressions of the outputs: all modes in closed form, and the choice of one.

They are what `modes`, `refine` and `choice` compute, for one formula without loops: a mode is a
solution if the forward formula says so, and is not refined.
"""

from __future__ import annotations

from itertools import product
import math
from typing import List, Mapping, Sequence

from .linkage import InverseLinkage
from .problem import InverseProblem
from ..geometry.spatial import IN_SINGLE
from ..tolerances import CLOSE
from ...formula.expression import (
    argument,
    derivative,
    gated,
    nearest_integer,
    Real,
    real,
    square,
    square_root,
    substituted,
    where,
)

# A mode whose outputs are off by more than this [sizes] is no solution.
OFF = 2.0 ** -20
# What these constants are in single precision.
SINGLE: Mapping[float, float] = {**IN_SINGLE, OFF: 2.0 ** -10, CLOSE: 2.0 ** -12}

Inputs = List[Real]


def modes_of(problem: InverseProblem, closed: InverseLinkage) -> List[Inputs]:
    """Return the inputs in each assembly mode and its turns, NaN where it is no solution."""
    values = [argument(i) for i in range(problem.n)]
    forward = problem.linkage.structure.checked(problem.outputs)[:problem.n]
    found = []
    for mode, turns in product(closed.modes, product(*closed.turns)):
        inputs = substituted([x + turn for x, turn in zip(mode.inputs, turns)], closed.arguments)
        outputs = substituted(forward, dict(enumerate(inputs)))
        for output, value, turn, scale in zip(outputs, values, problem.periods, problem.scales):
            room = OFF * scale - abs(_nearest(output - value, turn))
            inputs = [gated(x, room, 0.0) for x in inputs]
        found.append([_nearest(x, turn) for x, turn in zip(inputs, problem.turns)])
    return found


def chosen_of(problem: InverseProblem, modes: Sequence[Inputs], follows: bool) -> Inputs:
    """Return the inputs of one mode; see `choice.choose`. To follow, next to more arguments."""
    (best, places), *others = [_ranked(problem, inputs, follows) for inputs in modes]
    for order, found in others:
        better = _precedes(order, best)
        best, places = ([where(better, x, y) for x, y in zip(*pair)]
                        for pair in ((order, best), (found, places)))
    return places


def _ranked(problem: InverseProblem, inputs: Inputs, follows: bool) -> Sequence[Inputs]:
    """Return by what a mode is compared with others, and its inputs."""
    n, order = problem.n, [x / size for x, size in zip(inputs, problem.sizes)]
    if follows:
        near = [argument(n + by) for by in range(n)]
        steps = [_nearest(x - y, turn) for x, y, turn in zip(inputs, near, problem.turns)]
        far = square_root(sum((square(step / size) for step, size in zip(
            steps, problem.sizes)), real(0.0)))
        return [far, *order], [x + step for x, step in zip(near, steps)]
    if n == 1:
        falls = derivative(inputs[0], {0: 1.0}, {}) < 0.0
        order.insert(0, where(falls, 1.0, 0.0))
    return order, inputs


def _precedes(order: Inputs, best: Inputs) -> Real:
    """Return whether one of two modes is the better one, and is there."""
    *_, (first, second) = pairs = [*zip(order, best)]
    is_there, was_there = (abs(x) < math.inf for x in (first, second))
    precedes = first < second - CLOSE
    for first, second in pairs[-2::-1]:
        precedes = where(abs(first - second) <= CLOSE, precedes, first < second - CLOSE)
    return where(was_there, where(is_there, precedes, is_there), is_there)


def _nearest(gap: Real, turn: float) -> Real:
    """Return a difference without whole turns."""
    return gap - turn * nearest_integer(gap / turn) if turn < math.inf else gap
