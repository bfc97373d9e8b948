# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The inverse: values of the inputs at which as many outputs have given values.

One algorithm: candidates are refined to solutions by the forward formula, those that are one are
merged, and one is chosen. Only the candidates differ: brackets on `segments` for one input, the
assembly `modes` of the inverse linkage for several, or a `grid` if it has no closed form.
"""

from __future__ import annotations

from functools import cached_property
import math
from operator import add, sub
from typing import Any, Callable, Mapping, NamedTuple, Sequence

import numpy as np
from numpy.typing import ArrayLike

from . import rods
from .choice import Choice
from .follow import follow
from .grid import Grid
from .linkage import decompose, InverseLinkage
from .modes import chosen_of, Modes, modes_of, SINGLE
from .problem import InverseProblem, Row
from .refine import distinct, refine, solve_arrays
from .segments import Segments, segments_of
from ..inputs import theta_of
from ..kinematics import Kinematics
from ..text.arguments import checked_ends, Ends, numbers
from ..tolerances import SINGULAR
from ...formula.namespace import array_function
from ...formula.program import FEW_POSES
from ...words import join_names, n_inputs, plain_text, short_repr


class Solution(NamedTuple):
    """
    Values of all inputs at which the outputs have the given values.

    Attributes
    ----------
    inputs : tuple of float
        In the order of `Mechanism.inputs` [rad or m].
    inverse : Inverse
        The inverse that it solves.

    """

    inputs: tuple[float, ...]
    inverse: Inverse

    def __repr__(self) -> str:
        return f'Solution(inputs={self.inputs}, mode={self.mode!r}, margin={self.margin:.3g})'

    @property
    def signs(self) -> Mapping[str, int]:
        """
        Return the working mode.

        For each link at the tip of an input crank, by its name, the side to which it turns off
        from the line between the crank's joints, +1 left; and 'det', the sign of the determinant
        of d outputs / d inputs. 0 where rounding hides the sign.
        """
        linkage, signs = self.inverse.linkage, {}
        cranks = [input_.name for input_ in linkage.inputs if input_.is_angle]
        angles = linkage.joint_angles(theta_of(self.inputs))
        for link in linkage.links if linkage.axes == 'xy' else ():
            if link.parent in cranks and link.kind == 'revolute' and any(
                    place := linkage.frames[link.parent][link.joint]):
                sine = math.sin(angles[link.name] + link.zero - math.atan2(*place[::-1]))
                signs[link.name] = int(np.sign(sine)) if abs(sine) > SINGULAR else 0
        signs['det'] = 0 if self.is_singular else int(np.sign(np.linalg.det(
            self.inverse.problem.scaled(self.jacobian))))
        return signs

    @property
    def margin(self) -> float:
        """
        Return the least singular value of d outputs / d inputs, divided by the greatest or 1.

        It is 0 where the inputs cannot move the outputs in some direction, or cannot resist a load
        in some direction. Units are rad, the longest bar for outputs, about the stroke for inputs.
        """
        jacobian = self.inverse.problem.scaled(self.jacobian)
        if not np.isfinite(jacobian).all():
            return 0.0
        values = np.linalg.svd(jacobian, compute_uv=False)
        return float(values[-1] / max(1.0, values[0]))

    @property
    def jacobian(self) -> np.ndarray:
        """Return d outputs / d inputs [rad or m, per rad or m], shape (outputs, inputs)."""
        n = len(self.inputs)
        rates = self.inverse.problem.newton.at(*self.inputs, *[0.0] * n)[-n * n:]
        return np.reshape(rates, (n, n)).T

    @property
    def is_singular(self) -> bool:
        """Whether the pose is singular, so that at most half of the digits are right."""
        return self.margin < SINGULAR

    @property
    def mode(self) -> str:
        """Return the signs of the working mode as text, such as 'AP+ CP- det-'."""
        return ' '.join(f'{name}{"0+-"[sign]}' for name, sign in self.signs.items())


class Inverse:
    """
    The inverse of as many outputs as a linkage has inputs; make one with `Mechanism.inverse`.

    `print` shows the joint lines of the inverse linkage.

    Attributes
    ----------
    outputs : tuple of str
        Names of the outputs; see `Mechanism.has_output`.
    inputs : tuple of Input
        The inputs of the linkage; see `InverseProblem`. One that `is_part` has the solutions of
        the turns around zero, or around given inputs.

    """

    def __init__(self, linkage: Kinematics, outputs: tuple[str, ...]):
        self.linkage, self.outputs, self._n = linkage, outputs, len(outputs)
        if len({*outputs}) < len(outputs):
            raise ValueError(f'outputs must differ, got {join_names(outputs)}')
        if len(outputs) != len(linkage.inputs):
            raise ValueError(f'{linkage.type} has {n_inputs(len(linkage.inputs))}: as many '
                             f'outputs are needed, got {join_names(outputs)}')
        if self._n == 1:
            linkage.check_output(outputs[0])
        self.problem = InverseProblem(linkage, outputs)
        self._choice = Choice(self.problem)
        self.inputs = self.problem.inputs
        self._is_part = any(input_.is_part for input_ in self.inputs)
        if not self.is_quick:
            assert self._source  # raises ValueError for dependent outputs

    @cached_property
    def closed(self) -> InverseLinkage | None:
        """Joint lines and assembly modes of the inverse linkage; None if there is none."""
        # An inverse linkage has each input in one period, or else in one turn.
        make = decompose if self.linkage.axes == 'xy' else rods.decompose
        return None if self._is_part else make(self.linkage, self.outputs)

    @property
    def is_quick(self) -> bool:
        """Whether arrays of values cost little more than poses: no grid is searched."""
        return self._n == 1 or self.closed is not None

    @cached_property
    def _source(self) -> Segments | Modes | Grid:
        """Return what yields candidates."""
        if self._n == 1:
            return segments_of(self.linkage, self.outputs[0], (), self.inputs[0])
        return Modes(self.problem, self.closed) if self.closed else Grid(self.problem)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the linkage and the outputs only."""
        return inverse_of, (self.linkage, self.outputs)

    def __repr__(self) -> str:
        return f'<inverse of {self.linkage.type} for {join_names(self.outputs)}>'

    def __str__(self) -> str:
        what = join_names(self.outputs)
        if not self.closed:
            return f'the inverse of {self.linkage.type} for {what} is searched'
        return f'# {self.linkage.type} driven by {what}\n{self.closed}'

    # --- all solutions ---

    def all(self, values: ArrayLike, near: ArrayLike | None = None, ends: Ends = None
            ) -> list[Solution]:
        """
        Return all solutions for one value of each output.

        Parameters
        ----------
        values : array-like (outputs,)
            Values of the outputs [rad or m]; angles are equal up to whole turns, and an output
            that is an input up to whole periods of it.
        near : array-like (inputs,), optional
            Values of the inputs [rad or m]. Whole turns are added to the solutions to bring them
            nearest to it, and the nearest comes first; the unit of a length is about its stroke.
        ends : sequence of (float, float) or None, optional
            For each input the range [rad or m] that the solutions have to lie in, or None.

        Returns
        -------
        list of Solution
            The solutions of the linkage's own assembly, its `branches`, inside its reach; [] if
            there are none. Without `near` crank angles are in [-pi, pi), and the first input
            ascends. Solutions that differ by rounding only are one.

        Raises
        ------
        ValueError
            If there is not one value for each output, and one finite `near` for each input, or
            ends are not finite and in order.

        """
        seed = () if near is None else self._numbers(near, 'near', finite=True)
        limits, sizes = checked_ends(self._n, ends), self.problem.sizes
        placed = [self._choice.of([row], seed, limits)
                  for row in self._all(self._numbers(values), seed)]
        solutions = [tuple(row[:self._n]) for row in placed if row[0] == row[0]]
        if seed:
            solutions.sort(key=lambda inputs: math.dist(
                np.divide(inputs, sizes), np.divide(seed, sizes)))
        return [Solution(inputs, self) for inputs in solutions]

    def over(self, *values: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """
        Return all solutions for arrays of values [rad or m], one array for each output.

        Returns
        -------
        (array (inputs, *shape, answers), array (outputs * inputs, *shape, answers))
            The inputs [rad or m], the first ascending, padded with NaN; and the rate of each
            output by the first input, by the second and so on.

        """
        rows = np.broadcast_arrays(*self._per_output(values))
        solutions = self._all_arrays(np.stack([row.ravel() for row in rows]))
        solutions = np.moveaxis(solutions, 0, -1).reshape(
            solutions.shape[1], *rows[0].shape, len(solutions))
        return solutions[:self._n], solutions[self._n:]

    def _solved(self, values: Row, _: Row = ()) -> list[Row]:
        """Return all solutions in order, none for values that are not finite."""
        if not all(map(math.isfinite, values)):
            return []
        problem = self.problem
        values = problem.reduced(values)
        return distinct(problem, [row for candidate in self._source.candidates(values)
                                  if (row := refine(problem, values, candidate))])

    def _continued(self, values: Row, seed: Row) -> list[Row]:
        """Return the solution that is continuous from a seed, if there is one."""
        row = follow(self.problem, self.problem.reduced(values), seed, self._source)
        return [row] if row else []

    def _all(self, values: Row, seed: Row = (), solve: Callable = _solved) -> list[Row]:
        """
        Return all solutions in order, or the one continuous from `seed` with `_continued`.

        Of an input with very many turns, an inverse has those in the turns around `seed`.
        """
        turns = [input_.whole_turns(x) for input_, x in zip(self.inputs, seed)]
        if not any(turns):
            return solve(self, values, seed)
        offsets = {input_.name: math.tau * count for input_, count in zip(self.inputs, turns)}
        rows = solve(
            inverse_of(self.linkage.turned(*turns), self.outputs),
            tuple([x - offsets.get(name, 0.0) for name, x in zip(self.outputs, values)]),
            tuple(map(sub, seed, offsets.values())))
        return [(*map(add, row, offsets.values()), *row[self._n:]) for row in rows]

    def _all_arrays(self, values: np.ndarray, seed: Any = ()) -> np.ndarray:
        """
        Return all solutions for values (outputs, m) in order, padded with NaN.

        Each has the solutions of the turns around its `seed` (inputs, m), if these are many.
        Their shape is (solutions, inputs and rates, m), with one solution at least.
        """
        n, count, source = self._n, values.shape[1], self._source
        solutions, alone = np.empty((0, n + n * n, count)), np.arange(count)
        if not (count <= FEW_POSES or isinstance(source, Grid) or self._is_part and len(seed)):
            solutions, alone = solve_arrays(self.problem, values, source.candidate_arrays)
        rows = [self._all(column[:n], column[n:])
                for column in map(tuple, np.vstack([values, *seed]).T[alone].tolist())]
        size = max([1, len(solutions), *map(len, rows)])
        solutions = np.pad(solutions, ((0, size - len(solutions)), (0, 0), (0, 0)),
                           constant_values=math.nan)
        for k, row in zip(alone.tolist(), rows):
            solutions[:, :, k] = math.nan
            solutions[:len(row), :, k] = row or math.nan
        return solutions[:max(int(np.isfinite(solutions[:, 0]).any(axis=1).sum()), 1)]

    # --- arguments ---

    def _numbers(self, values: Any, name: str = 'values', finite: bool = False) -> Row:
        """Return one number for each output; raise ValueError if there are not as many."""
        parts = self._per_output(values, name)
        try:
            row = tuple([x if type(x) is float else x.item() for x in parts])
        except ValueError:
            raise self._miscounted(values, name) from None
        if finite and not all(map(math.isfinite, row)):
            raise ValueError(f'{name} must be finite, got {short_repr([*row])}')
        return row

    def _per_output(self, values: Any, name: str = 'values') -> tuple[Any, ...]:
        """Return a float or an array for each output; raise ValueError if they are not that."""
        if not isinstance(values, (list, tuple)):
            values = [values] if type(values) is float else np.atleast_1d(numbers(name, values))
        if len(values) != self._n:
            raise self._miscounted(values, name)
        parts: list[Any] = [x if type(x) is float else numbers(name, x) for x in values]
        return tuple([x if type(x) is float or x.ndim else x.item() for x in parts])

    def _miscounted(self, values: Any, name: str) -> ValueError:
        return ValueError(f'{self.linkage.type} has {n_inputs(self._n)}: {name} must be as many '
                          f'numbers, got {short_repr(values)}')

    # --- one of the solutions ---

    def nearest(self, values: Sequence[Any], near: Sequence[Any] | None = None,
                ends: Ends = None) -> tuple[Any, Any]:
        """
        Return one solution.

        Parameters
        ----------
        values : sequence of float or array
            The value of each output [rad or m].
        near : sequence of float or array, optional
            Values of the inputs [rad or m]: the solution is the nearest to them, whole turns
            included; the unit of a length is about its stroke. Default: with one input, the least
            at which the output increases, else the least (on this working branch of a lever, lever
            and crank turn the same way); with several, the one with the least first input; where
            that is equal up to 1e-9 [rad, strokes], the least next one.
        ends : sequence of (float, float) or None, optional
            For each input the range [rad or m] that the solution has to lie in, or None.

        Returns
        -------
        (tuple of float or array, tuple of float or array)
            The inputs [rad or m], and the rate of each output by the first input, by the second
            and so on; NaN where there is no solution.

        Raises
        ------
        ValueError
            If there is not one value for each output, or ends are not finite and in order.

        """
        n, limits, values = self._n, checked_ends(self._n, ends), self._per_output(values)
        seed = () if near is None else self._per_output(near, 'near')
        if {float} == {*map(type, values), *map(type, seed)}:
            row = self._choice.of(self._all(values, seed), seed, limits)
            return tuple(row[:n]), tuple(row[n:])
        rows = np.broadcast_arrays(*(*values, *seed))
        flat = np.stack([row.ravel() for row in rows])
        chosen = [row.reshape(rows[0].shape) for row in self._choice.of(
            self._all_arrays(flat[:n], flat[n:]), flat[n:], limits)]
        return tuple(chosen[:n]), tuple(chosen[n:])

    def path(self, values: Sequence[ArrayLike], near: ArrayLike | None = None,
             ends: Ends = None) -> tuple[Any, Any]:
        """
        Return solutions for successive values: each is the nearest to the one before.

        Parameters
        ----------
        values : sequence of array (n,)
            The successive values of each output [rad or m].
        near, ends
            As for `nearest`, for the first value. Values without a solution are left out, and the
            next one continues from the solution before them.

        Returns
        -------
        (tuple of array (n,), tuple of array (n,))
            As `nearest` does.

        """
        limits = checked_ends(self._n, ends)
        seed: Row = () if near is None else self._numbers(near, 'near', finite=True)
        rows = [np.atleast_1d(row) for row in np.broadcast_arrays(*self._per_output(values))]
        if rows[0].ndim > 1:
            raise self._miscounted(values, 'values')
        solutions = self._all_arrays(np.stack(rows), np.repeat(
            np.reshape(seed, (-1, 1)), len(rows[0]), axis=1))
        chosen = self._choice.along(solutions, seed, limits)
        return tuple(chosen[:self._n]), tuple(chosen[self._n:])

    def follow(self, values: ArrayLike, near: ArrayLike, ends: Ends = None) -> tuple[Row, Row]:
        """
        Return the solution that is continuous from given inputs.

        Parameters
        ----------
        values : array-like (outputs,)
            The values of the outputs [rad or m].
        near : array-like (inputs,)
            The present inputs [rad or m]; whole turns of a crank are preserved.
        ends : sequence of (float, float) or None, optional
            For each input the range [rad or m] that the solution has to lie in, or None.

        Returns
        -------
        (tuple of float, tuple of float)
            The inputs [rad or m] at the end of a motion in which the outputs go straight from
            their present values to `values`, angles the shorter way; and the rate of each output
            by the first input, by the second and so on. NaN if the motion passes a dead point,
            leaves the reach or goes beyond an end.

        """
        none, limits = (math.nan,) * (self._n + self._n ** 2), checked_ends(self._n, ends)
        row, = self._all(
            self._numbers(values), self._numbers(near, 'near'), Inverse._continued) or [none]
        if any(limits):
            inputs, row = row[:self._n], self._choice.of([row], row[:self._n], limits)
            # A motion does not jump by a whole turn.
            if any(abs(x - y) > input_.size for x, y, input_ in zip(row, inputs, self.inputs)):
                row = none
        return tuple(row[:self._n]), tuple(row[self._n:])

    # --- arrays of other packages ---

    def function(self, xp: Any, follows: bool = False) -> Callable:
        """
        Return a function of arrays from values of the outputs to one solution.

        Parameters
        ----------
        xp : module
            A package with Python's array API, such as torch; see `Mechanism.function`.
        follows : bool
            Whether the function takes values of the inputs, too, after those of the outputs, and
            returns the solution nearest to them. Otherwise it chooses as `nearest` does.

        Returns
        -------
        callable
            It returns a tuple with an array for each input [rad or m], NaN where there is no
            solution. These are closed forms, without refinement: next to a singular pose up to
            half of the digits are lost.

        Raises
        ------
        ValueError
            If there is no closed form.

        """
        outputs = chosen_of(self.problem, self.closed, follows)
        return array_function(
            outputs, (1 + follows) * self._n, xp, self.linkage.dimensions, SINGLE)

    def modes(self, xp: Any) -> Callable:
        """
        Return a function of arrays from values of the outputs to all solutions.

        It returns a tuple with a tuple for each assembly mode, in one order everywhere: an array
        for each input, NaN where the mode is no solution. See `function`.
        """
        outputs = [x for inputs, _ in modes_of(self.problem, self.closed) for x in inputs]
        flat = array_function(outputs, self._n, xp, self.linkage.dimensions, SINGLE)
        return lambda *values: tuple(zip(*self._n * [iter(flat(*values))]))


def inverse_of(linkage: Kinematics, outputs: str | Sequence[str]) -> Inverse:
    """Implement `Mechanism.inverse`."""
    try:
        inverse: Inverse = linkage.cache['inverse', outputs]
        return inverse
    except (KeyError, TypeError):  # the first time, and for a list
        names = (outputs,) if isinstance(outputs, str) else outputs
    if not isinstance(names, (list, tuple)):
        raise ValueError(f'outputs must be a list of names, got {short_repr(outputs)}')
    for name in names:
        linkage.check_there(name)
    plain = tuple(map(plain_text, names))
    key = plain[0] if isinstance(outputs, str) else plain
    return linkage.cache.get_or_make(('inverse', key), lambda: Inverse(linkage, plain))
