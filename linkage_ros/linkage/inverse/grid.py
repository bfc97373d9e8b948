# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Candidates of several inputs without a closed form: a search from a grid.

Outputs that depend on few inputs are solved first, for those alone. Levenberg-Marquardt steps lead
down from a grid over the ranges of the inputs, then from both sides of each solution, as solutions
next to a fold come in pairs. The search may miss solutions.

Source: Nocedal and Wright, "Numerical Optimization", sec. 10.3.
"""

from __future__ import annotations

from itertools import chain, combinations
import math
from typing import Callable, Iterator, List, Sequence, Set, Tuple, Union

import numpy as np

from .follow import LONGEST
from .problem import InverseProblem, Row
from .segments import Bracket, segments_of
from ..formulas import Names
from ..kinematics import Kinematics
from ..motion.curves import HALVINGS
from ..tolerances import CLOSE, ROUNDING
from ...words import listed

# Grid points at first and at most, and the least number of them that can be assembled.
STARTS, MAX_STARTS, ASSEMBLED = 1024, 1 << 16, 250
# Damping of steps: initial, and of giving up.
DAMPING, HOPELESS = 1e-3, 1e4
# Halvings of the distance at which a twin behind a fold is searched.
TWINS = 24


def blocks(linkage: Kinematics, outputs: Names) -> List[Tuple[List[int], List[int]]]:
    """
    Return groups of outputs that are solved in turn, and the inputs that each group determines.

    Both are numbers in their order. Raises ValueError if the outputs cannot determine all inputs.
    """
    needs = [{by for by in range(len(outputs)) if linkage.moves(name, by)} for name in outputs]
    left: Set[int] = set(range(len(needs)))
    known: Set[int] = set()
    found = []
    while left:
        for rows in chain(*(combinations(sorted(left), n + 1) for n in range(len(left)))):
            columns = set().union(*(needs[row] for row in rows)) - known
            if len(columns) < len(rows):
                raise dependent(outputs, rows)
            if len(columns) == len(rows):
                found.append((list(rows), sorted(columns)))
                left, known = left - set(rows), known | columns
                break
    return found


def dependent(outputs: Names, rows: Sequence[int]) -> ValueError:
    """Return the error for outputs of which some depend on too few inputs."""
    return ValueError(f'{listed(outputs)} do not determine all inputs: '
                      f'{listed(outputs[row] for row in rows)} depends on too few')


class Grid:
    """Outputs as functions of several inputs, all of them counted in their sizes inside."""

    def __init__(self, problem: InverseProblem):
        self._problem = problem
        self._sizes = np.array([input_.step for input_ in problem.linkage.inputs])
        self._inputs = [input_.counted() for input_ in problem.linkage.inputs]
        # Outputs that are inputs, by their numbers in both.
        self._held = {problem.outputs.index(input_.name): by
                      for by, input_ in enumerate(self._inputs) if input_.name in problem.outputs}
        self._blocks = blocks(problem.linkage, problem.outputs)
        # With all others known, the first input is searched as if it were the only one.
        self.is_held = {*self._held} == {*self._held.values()} == {*range(1, problem.n)}
        if not self.is_held:
            self._check_independent()

    def candidates(self, values: Sequence[float]) -> Iterator[Union[Bracket, Row]]:
        """Yield inputs, or brackets of the first, at which the outputs may have some values."""
        held = {by: values[place] for place, by in self._held.items()}
        if self.is_held:
            (place,), others = {*range(len(values))} - self._held.keys(), tuple(
                held[by] for by in range(1, len(values)))
            for bracket in segments_of(self._problem.linkage, self._problem.outputs[place],
                                       others).candidates(values[place:place + 1]):
                yield bracket._replace(place=place, others=others)
            return
        found = np.array([[held.get(by, 0.5 * (input_.low + input_.high)) / size for by, (
            input_, size) in enumerate(zip(self._problem.linkage.inputs, self._sizes))]])
        for rows, columns in self._blocks:
            if not self._held.keys() >= {*rows}:
                found = np.concatenate([found[:0], *(
                    self._solutions(q, np.array(values), rows, columns) for q in found)])
        for q in found * self._sizes:
            yield tuple(q.tolist())

    def _errors(self, q: np.ndarray, target: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return the errors of the outputs from their target, and the Jacobian, per row of q."""
        problem, n, count = self._problem, len(target), len(q)
        rows = problem.over(*(q * self._sizes).T, *target)
        jacobian = rows[-n * n:].reshape(n, n, count).transpose(2, 1, 0)
        return rows[2:2 + n].T, jacobian * self._sizes / np.reshape(problem.scales, (-1, 1))

    def _solutions(self, q: np.ndarray, target: np.ndarray, rows: List[int],
                   columns: List[int]) -> np.ndarray:
        """Return the poses at which some outputs have their values; other inputs are fixed."""
        def errors(q: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
            """Return errors, their norm (inf where there is none), and the Jacobian."""
            gap, jacobian = self._errors(q, target)
            gap, jacobian = gap[:, rows], jacobian[:, rows][:, :, columns]
            known = np.isfinite(gap).all(axis=1) & np.isfinite(jacobian).all(axis=(1, 2))
            return gap, np.where(known, np.linalg.norm(gap, axis=1), np.inf), jacobian

        def moved(q: np.ndarray, step: np.ndarray) -> np.ndarray:
            """Return inputs after a step, within one turn and their strokes."""
            q = q.copy()
            for by, x in zip(columns, (q[:, columns] + step).T):
                input_ = self._inputs[by]
                q[:, by] = input_.wrapped(x) if input_.wraps else x.clip(input_.low, input_.high)
            return q

        def known(q: np.ndarray) -> np.ndarray:
            return q[np.isfinite(errors(q)[1])]

        def twins(q: np.ndarray) -> np.ndarray:
            """Return poses on both sides of solutions: a twin may lie behind a fold."""
            weakest = np.linalg.svd(errors(q)[2])[2][:, -1]
            away = LONGEST * np.outer([1.0, -1.0], 0.5 ** np.arange(TWINS)).ravel()
            return known(moved(np.repeat(q, len(away), axis=0),
                               np.kron(weakest, away[:, None])))

        starts = self._starts(q, columns, known)
        found = starts[:0]
        while len(starts):
            before = len(found)
            found = self._distinct(np.concatenate([found, _descended(starts, errors, moved)]),
                                   errors)
            starts = twins(found) if len(found) > before else found[:0]
        return found

    def _starts(self, q: np.ndarray, columns: List[int], known: Callable) -> np.ndarray:
        """Return a grid of assembled poses over some inputs, finer where few are assembled."""
        starts, many = np.empty((0, len(q))), STARTS
        while len(starts) < ASSEMBLED and many <= MAX_STARTS:
            n = math.ceil(many ** (1.0 / len(columns)))
            axes = [np.linspace(input_.low, input_.high, n + 2)[1:-1]
                    for input_ in (self._inputs[column] for column in columns)]
            starts = np.tile(q, (n ** len(columns), 1))
            starts[:, columns] = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, len(columns))
            starts, many = known(starts), 4 * many
        return starts

    def _check_independent(self) -> None:
        """Raise ValueError if the outputs do not determine the inputs in nearly all poses."""
        n = len(self._inputs)
        q = self._starts(np.zeros(n), list(range(n)), lambda q: q[np.isfinite(
            self._errors(q, np.zeros(n))[1]).all(axis=(1, 2))])
        values = np.linalg.svd(self._errors(q, np.zeros(n))[1], compute_uv=False)
        # An output may stand still in a tenth of the poses.
        if len(q) and np.quantile(values[:, -1] / np.fmax(values[:, 0], 1e-300),
                                  0.9) <= CLOSE:
            raise dependent(self._problem.outputs, range(n))

    def _distinct(self, q: np.ndarray, errors: Callable) -> np.ndarray:
        """Return each solution once, the farthest from singular first."""
        weakest = np.linalg.svd(errors(q)[2], compute_uv=False)[:, -1]
        distinct: List[Tuple[np.ndarray, float]] = []
        for i in np.argsort(-weakest):
            if all(max(input_.apart(x, y) for input_, x, y in zip(self._inputs, q[i], other)) > far
                   for other, far in distinct):
                distinct.append((q[i], 4.0 * ROUNDING / max(weakest[i], ROUNDING)))
        return np.array([each for each, _ in distinct]).reshape(-1, q.shape[1])


def _descended(q: np.ndarray, errors: Callable, moved: Callable) -> np.ndarray:
    """Return the solutions that Levenberg-Marquardt steps reach from some poses."""
    (gap, size, jacobian), damping, found = errors(q), np.full(len(q), DAMPING), []
    for _ in range(2 * HALVINGS):
        there = size <= ROUNDING * (1.0 + np.abs(jacobian).max(axis=(1, 2)))
        found.append(q[there])
        going = ~there & (damping < HOPELESS)
        if not going.any():
            break
        q, size, damping = q[going], size[going], damping[going]
        turned = jacobian[going].swapaxes(1, 2)
        square = turned @ jacobian[going]
        weight = damping * np.trace(square, axis1=1, axis2=2) + 1e-300
        step = np.linalg.solve(square + weight[:, None, None] * np.eye(gap.shape[1]),
                               turned @ gap[going, :, None])[..., 0]
        longest = np.abs(step).max(axis=1, keepdims=True)
        trial = moved(q, -step * (LONGEST / np.maximum(longest, LONGEST)))
        better = errors(trial)[1] < size
        damping = np.where(better, 0.1 * damping, 10.0 * damping).clip(1e-14)
        q = np.where(better[:, None], trial, q)
        gap, size, jacobian = errors(q)
    return np.concatenate(found)
