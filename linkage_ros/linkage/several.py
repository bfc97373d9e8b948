# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The inverse of as many outputs as there are inputs: the foot of a five-bar, a bucket's pose.

Outputs that depend on few inputs are solved first, for those alone. Where several belong together
Levenberg-Marquardt steps on the exact Jacobian lead down from a grid over all that the inputs can
be, then from both sides of each solution, as those next to a fold come in pairs.

Sources: Nocedal and Wright, "Numerical Optimization", sec. 10.3 (the steps); Gosselin and Angeles,
"Singularity analysis of closed-loop kinematic chains", IEEE Trans. Robotics and Automation 6
(1990).
"""

from __future__ import annotations

from itertools import chain, combinations
import math
from typing import (
    Any,
    Callable,
    Iterator,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Sequence,
    Set,
    Tuple,
)

import numpy as np
from numpy.typing import ArrayLike

from .analysis import Analysed
from .arguments import numbers
from .inputs import Input
from .quantities import Names
from ..formula.program import Pose
from ..words import listed, quoted

# Starts of a search at first and at most, and those of them that can be assembled at least.
STARTS, MOST_STARTS, ASSEMBLED = 1024, 1 << 16, 250
# Steps from a start, how far one goes at most, and their damping: at first, at least, and in vain.
STEPS, LONGEST_STEP = 40, 0.7
DAMPING, LEAST_DAMPING, HOPELESS, TINY = 1e-3, 1e-14, 1e4, 1e-300
# Newton steps that polish a solution; halvings of the way to what may lie beside it.
POLISHING, HALVINGS = 3, 24
# Below this margin a pose is singular; below it wherever one looks, outputs tell too little.
SINGULAR, DEPENDENT = 1e-6, 1e-10
# Rounding of an output, and of an input where the Jacobian is one.
ROUNDED, CLOSE = 32 * 2.0 ** -53, 1e-13
# Pieces of a way from pose to pose, the shortest of them, and Newton steps to the end of each.
PIECES, SHORTEST, REFINED = 40, 1e-10, 30

_Pair = Tuple[np.ndarray, np.ndarray]


class Answer(NamedTuple):
    """
    Values of all inputs that give outputs the values that are wanted.

    Attributes
    ----------
    inputs : tuple of float
        In the order of `Mechanism.inputs` [rad or m].
    signs : mapping from str to int
        The working mode: for each link that hangs on an input crank, by its name, the side to
        which it turns off from the line between the crank's joints, +1 left; and 'det', the sign
        of the determinant of d outputs / d inputs. 0 where that cannot be told.
    margin : float
        The least singular value of d outputs / d inputs by the greatest or 1: 0 where the inputs
        cannot move the outputs some way, or not hold them. Lengths are counted in parts of the
        longest bar or about the stroke, angles in rad.

    """

    inputs: Tuple[float, ...]
    signs: Mapping[str, int]
    margin: float

    @property
    def is_singular(self) -> bool:
        """Whether it is at a singular pose, where no more than half of the digits are right."""
        return self.margin < SINGULAR

    @property
    def mode(self) -> str:
        """The signs as text: 'AP+ CP- det-'."""
        return ' '.join(f'{name}{"0+-"[sign]}' for name, sign in self.signs.items())


class Several(Analysed):
    """A mechanism that is asked for several inputs at a time."""

    def inputs_for(self, outputs: Sequence[str], values: ArrayLike,
                   near: Optional[ArrayLike] = None) -> List[Answer]:
        """
        Return all values of the inputs that give as many outputs the values that are wanted.

        Parameters
        ----------
        outputs : sequence of str
            As many outputs as there are inputs, named as for `input_for`.
        values : array-like (outputs,)
            What they are to be [rad or m], angles with whole turns aside.
        near : array-like (inputs,), optional
            Values of the inputs [rad or m] to which the answers are brought by whole turns, the
            nearest first, a length being counted in parts of about its stroke.

        Returns
        -------
        list of Answer
            Those of the linkage's own assembly, its `branches`; without `near` crank angles in
            [-pi, pi), the first input's ascending; [] where the outputs cannot be had. Of answers
            that rounding does not tell apart, as on a curve of singular poses, one is given.

        Raises
        ------
        ValueError
            If there is no such output, there are not as many as inputs, they do not tell all
            inputs, or a dimension is an array.

        Notes
        -----
        Outputs that belong together are searched for from some 1000 poses all over what their
        inputs can be. An answer in a part of the reach that none of these is in may be missed.

        """
        target, equations = self._asked(outputs, values)
        middle = [0.5 * (input_.low + input_.high) for input_ in equations.inputs]
        found = np.array([middle] if np.isfinite(target).all() else []).reshape(-1, len(middle))
        for block in equations.blocks:
            found = np.concatenate([found[:0], *(
                equations.solutions(q, target, *block) for q in found)])
        found = found[self._held(found * equations.sizes)]
        found = found[np.lexsort(found.T[::-1])]
        if near is not None:
            beside = self._each('near', near) / equations.sizes
            if not np.isfinite(beside).all():
                raise ValueError(f'near must be finite, got {quoted(beside.tolist())}')
            found = np.stack([input_.beside(x, y) for input_, x, y in zip(
                equations.inputs, found.T, beside)], axis=-1)
            found = found[np.argsort(np.linalg.norm(found - beside, axis=1))]
        return [self._answer(q, equations) for q in found]

    def follow_inputs(self, outputs: Sequence[str], values: ArrayLike, near: ArrayLike) -> _Pair:
        """
        Return the inputs that give outputs their values, going on from others without a jump.

        Parameters
        ----------
        outputs, values
            As for `inputs_for`.
        near : array-like (inputs,)
            Where the inputs were [rad or m]; whole turns of a crank are kept.

        Returns
        -------
        (array (inputs,), array (outputs, inputs))
            The inputs [rad or m] that outputs lead to which go straight from what they were to
            what is wanted, angles the shorter way, and d outputs / d inputs there; NaN where that
            would pass a singular pose or leave the reach.

        """
        target, equations = self._asked(outputs, values)
        q, jacobian = equations.followed(self._each('near', near) / equations.sizes, target)
        inputs = q * equations.sizes
        if not self._held(inputs[None])[0]:
            inputs, jacobian = inputs * np.nan, jacobian * np.nan
        return inputs, jacobian * equations.scale[:, None] / equations.sizes

    def _held(self, inputs: np.ndarray) -> np.ndarray:
        """Return for rows of inputs whether all of the linkage can be assembled there."""
        with np.errstate(invalid='ignore'):
            margins = self._bound('margins', ()).searched(*inputs.T)
            return (margins >= 0.0).all(axis=0) & np.all([
                input_.turns | (input_.low <= x) & (x <= input_.high)
                for input_, x in zip(self.inputs, inputs.T)], axis=0)

    def _each(self, name: str, values: ArrayLike) -> np.ndarray:
        found = numbers(name, values)
        if found.shape != (len(self.inputs),):
            raise ValueError(f'{self.type} has {len(self.inputs)} inputs: {name} must be as many '
                             f'numbers, got {quoted(found.tolist())}')
        return found

    def _asked(self, outputs: Any, values: ArrayLike) -> Tuple[np.ndarray, _Equations]:
        """Return what is wanted and the equations; raise ValueError for what cannot be asked."""
        if not isinstance(outputs, (list, tuple)) or not all(isinstance(x, str) for x in outputs):
            raise ValueError(f'outputs must be a list of names, got {quoted(outputs)}')
        if len(outputs) != len(self.inputs):
            raise ValueError(f'{self.type} has {len(self.inputs)} inputs: as many outputs are '
                             f'needed, got {listed(outputs)}')
        names = tuple(outputs)
        return self._each('values', values), self.cache.get_or_make(
            ('equations', *names), lambda: self._equations(names))

    def _equations(self, names: Names) -> _Equations:
        for name in names:
            self.check_there(name)
        pose = self._bound('parts', ((), names, names))
        if pose.shape:
            raise ValueError('the inverse is for one set of dimensions, not for arrays')
        needs = [{by for by in range(len(names)) if self._structure.moves(name, by)}
                 for name in names]
        return _Equations(names, self.inputs, pose, needs,
                          np.array(list(map(self.is_angle, names))), self.longest)

    def _answer(self, q: np.ndarray, equations: _Equations) -> Answer:
        """Return inputs with the names of their working mode."""
        inputs = tuple((q * equations.sizes).tolist())
        (jacobian,) = equations.over(q[None], np.zeros(len(q)))[1]
        values = np.linalg.svd(jacobian, compute_uv=False)
        margin = float(values[-1] / max(1.0, values[0]))
        cranks = {link.name: link for link in self.links
                  if any(input_.turns and link.name == input_.name for input_ in self.inputs)}
        places, signs = self.solve(inputs), {}
        for link in self.links:
            crank = cranks.get(link.parent)
            if crank and link.kind == 'revolute' and link.joint != crank.joint:
                (a, b), (c, d) = (places[end] - places[start] for start, end in (
                    (crank.joint, link.joint), (link.joint, link.tip)))
                signs[link.name] = _sign(a * d - b * c, math.hypot(a, b) * math.hypot(c, d))
        signs['det'] = _sign(np.linalg.det(jacobian), 0.0) if margin >= SINGULAR else 0
        return Answer(inputs, signs, margin)


class _Equations:
    """Outputs as functions of the inputs, all of them counted in their sizes."""

    def __init__(self, outputs: Names, inputs: Sequence[Input], pose: Pose,
                 needs: Sequence[Set[int]], angular: np.ndarray, longest: float):
        self.outputs, self.inputs = outputs, [input_.counted() for input_ in inputs]
        self.sizes = np.array([input_.size for input_ in inputs])
        self.scale = np.where(angular, 1.0, longest)
        self._pose, self._angular = pose, angular
        self.blocks = list(self._sorted_out(needs))
        self._check_told()

    def _sorted_out(self, needs: Sequence[Set[int]]) -> Iterator[Tuple[List[int], List[int]]]:
        """Yield outputs that are solved one after the other, and the inputs that they tell."""
        left = set(range(len(needs)))
        known: Set[int] = set()
        while left:
            for rows in chain(*(combinations(sorted(left), n + 1) for n in range(len(left)))):
                columns = set().union(*(needs[row] for row in rows)) - known
                if len(columns) < len(rows):
                    raise self._dependent(rows)
                if len(columns) == len(rows):
                    yield list(rows), sorted(columns)
                    left, known = left - set(rows), known | columns
                    break

    def _dependent(self, rows: Sequence[int]) -> ValueError:
        return ValueError(f'{listed(self.outputs)} do not tell all inputs: '
                          f'{listed(self.outputs[row] for row in rows)} depends on too few')

    def over(self, q: np.ndarray, target: np.ndarray) -> _Pair:
        """Return what outputs miss of their target, and the Jacobian, for each row of q."""
        return self._missed(self._pose.searched(*(q * self.sizes).T), target)

    def _at(self, q: np.ndarray, target: np.ndarray) -> _Pair:
        """Return the same for one pose, by code for one."""
        missed, jacobian = self._missed(
            np.array(self._pose.at(*(q * self.sizes).tolist()))[:, None], target)
        return missed[0], jacobian[0]

    def _missed(self, rows: np.ndarray, target: np.ndarray) -> _Pair:
        n = len(target)
        missed = rows[:n].T - target
        missed -= np.where(self._angular, math.tau * np.round(missed / math.tau), 0.0)
        jacobian = rows[n:].reshape(n, n, rows.shape[1]).transpose(2, 1, 0)
        return missed / self.scale, jacobian * self.sizes / self.scale[:, None]

    def solutions(self, q: np.ndarray, target: np.ndarray, rows: List[int],
                  columns: List[int]) -> np.ndarray:
        """Return where some outputs are what they should be; other inputs are those of q."""
        def missed(q: np.ndarray) -> Tuple[np.ndarray, ...]:
            """Return what outputs miss, how much (inf where unknown), the Jacobian, rounding."""
            gap, jacobian = self.over(q, target)
            gap, jacobian = gap[:, rows], jacobian[:, rows][:, :, columns]
            known = np.isfinite(gap).all(axis=1) & np.isfinite(jacobian).all(axis=(1, 2))
            size = np.where(known, np.linalg.norm(gap, axis=1), np.inf)
            return gap, size, jacobian, _rounding(q[:, columns], jacobian)

        def moved(q: np.ndarray, step: np.ndarray) -> np.ndarray:
            """Return inputs after a step, within one turn and their strokes."""
            q = q.copy()
            q[:, columns] += step
            return np.stack([input_.wrapped(x) if input_.turns else x.clip(input_.low, input_.high)
                             for input_, x in zip(self.inputs, q.T)], axis=-1)

        def beyond(q: np.ndarray) -> np.ndarray:
            """Return poses on both sides of solutions, where others may lie behind a fold."""
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
        """Return poses over all that some inputs can be, more of them where few can be had."""
        starts, many = np.empty((0, len(q))), STARTS
        while len(starts) < ASSEMBLED and many <= MOST_STARTS:
            n = math.ceil(many ** (1.0 / len(columns)) if len(columns) > 1 else many / 4)
            axes = [np.linspace(input_.low, input_.high, n + 2)[1:-1]
                    for input_ in (self.inputs[column] for column in columns)]
            starts = np.tile(q, (n ** len(columns), 1))
            starts[:, columns] = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, len(columns))
            starts, many = known(starts), 4 * many
        return starts

    def _check_told(self) -> None:
        """Raise ValueError if the outputs do not tell the inputs in most poses."""
        n = len(self.inputs)
        q = self._starts(np.zeros(n), list(range(n)), lambda q: q[np.isfinite(
            self.over(q, np.zeros(n))[1]).all(axis=(1, 2))])
        values = np.linalg.svd(self.over(q, np.zeros(n))[1], compute_uv=False)
        if len(q) and np.median(values[:, -1] / np.fmax(values[:, 0], TINY)) <= DEPENDENT:
            raise self._dependent(range(n))

    def _distinct(self, q: np.ndarray, missed: Callable) -> np.ndarray:
        """Return each solution once, those that are farthest from singular first."""
        values = np.linalg.svd(missed(q)[2], compute_uv=False)
        kept: List[Tuple[np.ndarray, float]] = []
        for i in np.argsort(-values[:, -1]):
            if all(max(input_.apart(x, y) for input_, x, y in zip(self.inputs, q[i], other)) > near
                   for other, near in kept):
                kept.append((q[i], CLOSE * (1.0 + values[i, 0]) / max(values[i, -1], CLOSE)))
        return np.array([each for each, _ in kept]).reshape(-1, q.shape[1])

    def followed(self, q: np.ndarray, target: np.ndarray) -> _Pair:
        """Return what `Several.follow_inputs` does, counted in sizes."""
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
        """Return where outputs miss their target by an aim, near a start on one side of folds."""
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
    """Return what rounding makes outputs miss: their own, and that of the inputs."""
    return ROUNDED * (1.0 + (np.abs(jacobian) @ np.maximum(1.0, np.abs(q))[..., None])[..., 0])


def _descended(q: np.ndarray, missed: Callable, moved: Callable) -> np.ndarray:
    """Return the solutions that Levenberg-Marquardt steps from some poses lead to."""
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
    """Return solutions after some steps of Newton's method, where these are better."""
    for _ in range(POLISHING):
        gap, size, jacobian, _ = missed(q)
        trial = moved(q, -(np.linalg.pinv(jacobian) @ gap[..., None])[..., 0])
        q = np.where((missed(trial)[1] < size)[:, None], trial, q)
    return q


def _sign(value: float, size: float) -> int:
    return int(np.sign(value)) if abs(value) > SINGULAR * size else 0
