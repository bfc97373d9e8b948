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
The search for inputs that give outputs their values, where the inverse has no closed form.

One input is searched on the branches on which its output is monotone (`BranchSearch`), several by
steps on the exact Jacobian (`StepSearch`); both have the same methods. Of several, outputs that
depend on few inputs are solved first, for those alone. Levenberg-Marquardt steps lead down from a
grid over the ranges of the inputs, then from both sides of each solution, as solutions next to a
fold come in pairs.

Sources: Nocedal and Wright, "Numerical Optimization", sec. 10.3 (the steps); Gosselin and Angeles,
"Singularity analysis of closed-loop kinematic chains", IEEE Trans. Robotics and Automation 6
(1990).
"""

from __future__ import annotations

from itertools import chain, combinations
import math
from typing import Callable, Iterator, List, Optional, Sequence, Set, Tuple, TYPE_CHECKING

import numpy as np

from .analysis import Analysis
from .curves import LEAST
from .inputs import Input
from .inverse_problem import Found, InverseProblem
from .quantities import Names
from ..words import listed

if TYPE_CHECKING:
    from .mechanism import Mechanism

# Grid points of a search at first and at most, and the least number that can be assembled.
STARTS, MOST_STARTS, ASSEMBLED = 1024, 1 << 16, 250
# Steps from a start (few need many: where outputs hardly differ), the longest one, and their
# damping: initial, least, and that of giving up.
STEPS, LONGEST_STEP = 100, 0.7
DAMPING, LEAST_DAMPING, HOPELESS, TINY = 1e-3, 1e-14, 1e4, 1e-300
# Newton steps that polish a solution; halvings of the distance at which a twin is searched.
POLISHING, HALVINGS = 3, 24
# Below the first margin a pose is singular; outputs are dependent if nine of ten poses are below
# the second.
SINGULAR, DEPENDENT = 1e-6, 1e-10
# Rounding of an output, and of an input where the Jacobian is the identity.
ROUNDED, CLOSE = 32 * 2.0 ** -53, 1e-13
# Steps of a motion that is followed, the shortest of them, and Newton steps to the end of each.
PIECES, SHORTEST, REFINED = 40, 1e-10, 30

_Pair = Tuple[np.ndarray, np.ndarray]


def blocks(linkage: Mechanism, outputs: Names) -> List[Tuple[List[int], List[int]]]:
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


class Search:
    """The solutions of a problem without a closed form; the methods are those of `ClosedForm`."""

    has_kite = False

    def __init__(self, problem: InverseProblem):
        self._problem, linkage, outputs = problem, problem.linkage, problem.outputs
        self._search = StepSearch(linkage, outputs, problem.periods) if len(outputs) > 1 else (
            BranchSearch(linkage, outputs[0], problem.inputs[0]))

    def solutions(self, values: Tuple[float, ...]) -> Iterator[Found]:
        """Yield the solutions for finite values, those that differ by rounding included."""
        inputs, rates = self.over(np.array(values)[:, None])
        for row, rate in zip(inputs[:, :, 0].tolist(), rates[:, :, 0].tolist()):
            if row[0] == row[0]:
                yield tuple(row), tuple(rate)

    def over(self, values: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return the solutions for values (outputs, n), NaN where there are fewer."""
        inputs = self._search.answers(values)
        rates = self._problem.rated.over(*inputs.swapaxes(0, 1))[len(values):].swapaxes(0, 1)
        return inputs, rates

    def follow(self, values: Tuple[float, ...], near: Tuple[float, ...]) -> Found:
        """Return what `Inverse.follow` does."""
        return self._search.follow(values, near)


class BranchSearch:
    """One output as a function of the first input, in monotone branches; `others` are fixed."""

    def __init__(self, linkage: Mechanism, output: str, input_: Input,
                 others: Sequence[float] = ()):
        self._input, self._linkage, self._others = input_, linkage, others
        self._branches = Analysis(linkage, others).branches(output)
        self._pose = linkage.posed((), (output,), (output,))

    def answers(self, values: np.ndarray) -> np.ndarray:
        """Return all inputs (answers, 1, n) for values (1, n), NaN where there are fewer."""
        inputs = self._branches.answers(values[0])[:, None] * self._input.step
        return np.asarray(self._input.wrapped(
            np.where(np.abs(inputs) < LEAST * self._input.step, 0.0, inputs)))

    def follow(self, values: Sequence[float], near: Sequence[float]) -> Found:
        """Return the solution that is continuous from given inputs, and the rates."""
        input_ = self._input
        turns = input_.turns_of(near[0])
        turn = input_.turn / input_.step if input_.wraps else math.inf
        found, rate = self._branches.follow(self._pose.at, input_.step, values[0],
                                            near[0] - turns, turn)
        return (found + turns,), (rate,)


class StepSearch:
    """Outputs as functions of several inputs, all of them counted in their sizes inside."""

    def __init__(self, linkage: Mechanism, outputs: Names, turns: Sequence[float]):
        self._linkage = linkage
        self.outputs, self.inputs = outputs, [input_.counted() for input_ in linkage.inputs]
        self.sizes = np.array([input_.step for input_ in linkage.inputs])
        # The period of each output; outputs that are inputs, by their numbers in both.
        self._turns = np.array(turns)
        self._given = {outputs.index(input_.name): by for by, input_ in enumerate(self.inputs)
                       if input_.name in outputs}
        self.scale = np.where(list(map(linkage.is_angle, outputs)), 1.0, linkage.longest)
        self._pose, self._margins = linkage.posed((), outputs, outputs), linkage.margins
        self.blocks = blocks(linkage, outputs)
        self._check_independent()

    def answers(self, values: np.ndarray) -> np.ndarray:
        """Return all inputs (answers, inputs, n) for values (outputs, n), NaN where fewer."""
        found = [self._answers(column) for column in values.T]
        inputs = np.full((max(map(len, found), default=0) or 1, *values.shape), np.nan)
        for column, each in enumerate(found):
            inputs[:len(each), :, column] = each
        return inputs

    def _answers(self, values: np.ndarray) -> np.ndarray:
        """Return all inputs that give outputs their values, in rows."""
        start = [0.5 * (input_.low + input_.high) for input_ in self.inputs]
        for place, by in self._given.items():
            start[by] = values[place] / self.sizes[by]
        found = np.array([start] if np.isfinite(values).all() else []).reshape(-1, len(start))
        for rows, columns in self.blocks:
            if not self._given.keys() >= {*rows}:
                # With all others fixed, the first input is searched as if it were the only one.
                solutions = self._on_branches if columns == [0] and len(self._given) + 1 == len(
                    values) else self.solutions
                found = np.concatenate([found[:0], *(
                    solutions(q, values, rows, columns) for q in found)])
        inputs = found * self.sizes
        return np.asarray(inputs[self._are_assembled(inputs)])

    def _are_assembled(self, inputs: np.ndarray) -> np.ndarray:
        """Return for rows of inputs whether all of the linkage can be assembled there."""
        with np.errstate(invalid='ignore'):
            return np.asarray((self._margins(*inputs.T) >= 0.0).all(axis=0))

    def over(self, q: np.ndarray, target: np.ndarray) -> _Pair:
        """Return the errors of the outputs from their target, and the Jacobian, per row of q."""
        return self._missed(self._pose.searched(*(q * self.sizes).T), target)

    def _at(self, q: np.ndarray, target: np.ndarray) -> _Pair:
        """Return the same for one pose, by code for one."""
        missed, jacobian = self._missed(
            np.array(self._pose.at(*(q * self.sizes).tolist()))[:, None], target)
        return missed[0], jacobian[0]

    def _missed(self, rows: np.ndarray, target: np.ndarray) -> _Pair:
        n = len(target)
        missed = rows[:n].T - target
        whole = np.isfinite(self._turns)
        missed[:, whole] -= self._turns[whole] * np.round(missed[:, whole] / self._turns[whole])
        jacobian = rows[n:].reshape(n, n, rows.shape[1]).transpose(2, 1, 0)
        return missed / self.scale, jacobian * self.sizes / self.scale[:, None]

    def _on_branches(self, q: np.ndarray, target: np.ndarray, rows: List[int], _: List[int]
                     ) -> np.ndarray:
        """Return what `solutions` does if the first input alone is unknown."""
        search = BranchSearch(self._linkage, self.outputs[rows[0]], self._linkage.inputs[0],
                              (q * self.sizes)[1:].tolist())
        first = search.answers(target[rows][None]).ravel() / self.sizes[0]
        first = first[np.isfinite(first)]
        return np.column_stack([first, np.tile(q[1:], (len(first), 1))])

    def solutions(self, q: np.ndarray, target: np.ndarray, rows: List[int],
                  columns: List[int]) -> np.ndarray:
        """Return the poses at which some outputs have their values; other inputs are fixed."""
        def missed(q: np.ndarray) -> Tuple[np.ndarray, ...]:
            """Return errors, their norm (inf where there is none), the Jacobian, and rounding."""
            gap, jacobian = self.over(q, target)
            gap, jacobian = gap[:, rows], jacobian[:, rows][:, :, columns]
            known = np.isfinite(gap).all(axis=1) & np.isfinite(jacobian).all(axis=(1, 2))
            size = np.where(known, np.linalg.norm(gap, axis=1), np.inf)
            return gap, size, jacobian, _rounding(q[:, columns], jacobian)

        def moved(q: np.ndarray, step: np.ndarray) -> np.ndarray:
            """Return inputs after a step, within one turn and their strokes."""
            q = q.copy()
            for by, x in zip(columns, (q[:, columns] + step).T):
                input_ = self.inputs[by]
                q[:, by] = input_.wrapped(x) if input_.wraps else x.clip(input_.low, input_.high)
            return q

        def beyond(q: np.ndarray) -> np.ndarray:
            """Return poses on both sides of solutions: a twin may lie behind a fold."""
            weakest = np.linalg.svd(missed(q)[2])[2][:, -1]
            away = LONGEST_STEP * np.outer([1.0, -1.0], 0.5 ** np.arange(HALVINGS)).ravel()
            return known(moved(np.repeat(q, len(away), axis=0),
                               np.kron(weakest, away[:, None])))

        def known(q: np.ndarray) -> np.ndarray:
            return q[np.isfinite(missed(q)[1])]

        starts = self._starts(q, columns, known)
        found = starts[:0]
        while len(starts):
            before = len(found)
            ends = np.concatenate([found, _descended(starts, missed, moved)])
            found = self._distinct(_polished(ends, missed, moved), missed)
            starts = beyond(found) if len(found) > before else found[:0]
        return found

    def _starts(self, q: np.ndarray, columns: List[int], known: Callable) -> np.ndarray:
        """Return a grid of assembled poses over some inputs, finer where few are assembled."""
        starts, many = np.empty((0, len(q))), STARTS
        while len(starts) < ASSEMBLED and many <= MOST_STARTS:
            n = math.ceil(many ** (1.0 / len(columns)) if len(columns) > 1 else many / 4)
            axes = [np.linspace(input_.low, input_.high, n + 2)[1:-1]
                    for input_ in (self.inputs[column] for column in columns)]
            starts = np.tile(q, (n ** len(columns), 1))
            starts[:, columns] = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, len(columns))
            starts, many = known(starts), 4 * many
        return starts

    def _check_independent(self) -> None:
        """Raise ValueError if the outputs do not determine the inputs in nearly all poses."""
        n = len(self.inputs)
        q = self._starts(np.zeros(n), list(range(n)), lambda q: q[np.isfinite(
            self.over(q, np.zeros(n))[1]).all(axis=(1, 2))])
        values = np.linalg.svd(self.over(q, np.zeros(n))[1], compute_uv=False)
        # An output may stand still in a part of the poses.
        if len(q) and np.quantile(values[:, -1] / np.fmax(values[:, 0], TINY), 0.9) <= DEPENDENT:
            raise dependent(self.outputs, range(n))

    def _distinct(self, q: np.ndarray, missed: Callable) -> np.ndarray:
        """Return each solution once, the farthest from singular first."""
        values = np.linalg.svd(missed(q)[2], compute_uv=False)
        distinct: List[Tuple[np.ndarray, float]] = []
        for i in np.argsort(-values[:, -1]):
            if all(max(input_.apart(x, y) for input_, x, y in zip(self.inputs, q[i], other)) > near
                   for other, near in distinct):
                distinct.append((q[i], CLOSE * (1.0 + values[i, 0]) / max(values[i, -1], CLOSE)))
        return np.array([each for each, _ in distinct]).reshape(-1, q.shape[1])

    def follow(self, values: Sequence[float], near: Sequence[float]) -> Found:
        """Return the solution that is continuous from given inputs, and the rates."""
        inputs, jacobian = self._followed(near / self.sizes, np.array(values))
        inputs, rates = inputs * self.sizes, (jacobian * self.scale[:, None] / self.sizes).T
        if not self._are_assembled(inputs[None])[0]:
            inputs, rates = inputs * np.nan, rates * np.nan
        return tuple(inputs.tolist()), tuple(rates.ravel().tolist())

    def _followed(self, q: np.ndarray, target: np.ndarray) -> _Pair:
        start, jacobian = self._at(q, target)
        side = np.linalg.det(jacobian) if np.isfinite(jacobian).all() else 0.0
        left = piece = 1.0
        for _ in range(PIECES if side and np.isfinite(start).all() else 0):
            if found := self._corrected(q, target, start * max(left - piece, 0.0), side):
                (q, jacobian), left = found, left - piece
                if left <= 0.0:
                    return q, jacobian
                piece = min(4.0 * piece, left)
            elif (piece := 0.25 * piece) < SHORTEST:
                break
        return np.full(q.shape, np.nan), np.full(jacobian.shape, np.nan)

    def _corrected(self, start: np.ndarray, target: np.ndarray, aim: np.ndarray,
                   side: float) -> Optional[_Pair]:
        """Return the pose near a start whose errors are `aim`, without passing a fold."""
        q, last = start, LONGEST_STEP
        for _ in range(REFINED):
            gap, jacobian = self._at(q, target)
            gap = gap - aim
            if not (np.isfinite([*gap, *jacobian.ravel()]).all()
                    and np.linalg.det(jacobian) * side > 0.0):
                return None
            if (np.abs(gap) <= _rounding(q, jacobian)).all():
                return q, jacobian
            step = np.linalg.solve(jacobian, gap)
            longest = float(np.abs(step).max())
            q = q - step
            if not longest <= last or np.abs(q - start).max() > LONGEST_STEP:
                return None
            last = 0.6 * longest
        return None


def _rounding(q: np.ndarray, jacobian: np.ndarray) -> np.ndarray:
    """Return the errors that rounding of the outputs and of the inputs makes."""
    return ROUNDED * (1.0 + (np.abs(jacobian) @ np.maximum(1.0, np.abs(q))[..., None])[..., 0])


def _descended(q: np.ndarray, missed: Callable, moved: Callable) -> np.ndarray:
    """Return the solutions that Levenberg-Marquardt steps reach from some poses."""
    (gap, size, jacobian, rounding), damping, found = missed(q), np.full(len(q), DAMPING), []
    for _ in range(STEPS):
        there = (np.abs(gap) <= rounding).all(axis=1)
        found.append(q[there])
        going = ~there & (damping < HOPELESS)
        if not going.any():
            break
        q, size, damping = q[going], size[going], damping[going]
        turned = jacobian[going].swapaxes(1, 2)
        square = turned @ jacobian[going]
        weight = damping * np.trace(square, axis1=1, axis2=2) + TINY
        step = np.linalg.solve(square + weight[:, None, None] * np.eye(gap.shape[1]),
                               turned @ gap[going, :, None])[..., 0]
        longest = np.abs(step).max(axis=1, keepdims=True)
        trial = moved(q, -step * (LONGEST_STEP / np.maximum(longest, LONGEST_STEP)))
        better = missed(trial)[1] < size
        damping = np.where(better, 0.1 * damping, 10.0 * damping).clip(LEAST_DAMPING)
        q = np.where(better[:, None], trial, q)
        gap, size, jacobian, rounding = missed(q)
    return np.concatenate(found)


def _polished(q: np.ndarray, missed: Callable, moved: Callable) -> np.ndarray:
    """Return solutions after those steps of Newton's method that reduce their errors."""
    for _ in range(POLISHING):
        gap, size, jacobian, _ = missed(q)
        trial = moved(q, -(np.linalg.pinv(jacobian) @ gap[..., None])[..., 0])
        q = np.where((missed(trial)[1] < size)[:, None], trial, q)
    return q
