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
The inverse: values of the inputs at which as many outputs have given values.

If the inverse linkage decomposes into dyads, each of its assembly modes is a closed form; see
`closed_form`. Otherwise the inputs are searched; see `search`.
"""

from __future__ import annotations

from functools import partial
from itertools import chain, combinations, takewhile
import math
from typing import (
    Any,
    cast,
    Dict,
    Iterable,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Sequence,
    Tuple,
    TYPE_CHECKING,
    Union,
)

import numpy as np
from numpy.typing import ArrayLike

from .arguments import numbers
from .choice import choice
from .closed_form import ClosedForm
from .inverse_linkage import InverseLinkage, taken_apart
from .inverse_problem import Found, InverseProblem, LARGE, NEIGHBOURS, rounded, SAME
from .inverse_rods import taken_apart as rods_taken_apart
from .search import blocks, Search, SINGULAR
from ..cache import Cache
from ..formula.expression import argument, real
from ..formula.program import Pose, Program
from ..words import listed, quoted

if TYPE_CHECKING:
    from .mechanism import Mechanism

# Number of values of a path that are processed together, and of solutions that are compared.
BLOCK, GROUP = 1024, 32

Ends = Optional[Sequence[Optional[Tuple[float, float]]]]


class Answer(NamedTuple):
    """
    Values of all inputs at which the outputs have the given values.

    Attributes
    ----------
    inputs : tuple of float
        In the order of `Mechanism.inputs` [rad or m].
    inverse : Inverse
        The inverse that it solves.

    """

    inputs: Tuple[float, ...]
    inverse: Inverse

    @property
    def signs(self) -> Mapping[str, int]:
        """
        Return the working mode.

        For each link at the tip of an input crank, by its name, the side to which it turns off
        from the line between the crank's joints, +1 left; and 'det', the sign of the determinant
        of d outputs / d inputs. 0 where rounding hides the sign.
        """
        return self.inverse.signs(self.inputs)

    @property
    def margin(self) -> float:
        """
        Return the least singular value of d outputs / d inputs, divided by the greatest or 1.

        It is 0 where the inputs cannot move the outputs in some direction, or cannot resist a load
        in some direction. Units are rad, the longest bar for outputs, about the stroke for inputs.
        """
        return self.inverse.margin(self.inputs)

    @property
    def is_singular(self) -> bool:
        """Whether the pose is singular, so that at most half of the digits are right."""
        return self.margin < SINGULAR

    @property
    def mode(self) -> str:
        """Return the signs as text: 'AP+ CP- det-'."""
        return ' '.join(f'{name}{"0+-"[sign]}' for name, sign in self.signs.items())

    def __repr__(self) -> str:
        return f'Answer(inputs={self.inputs}, mode={self.mode!r}, margin={self.margin:.3g})'


class Inverse:
    """
    The inverse of as many outputs as a linkage has inputs; make one with `Mechanism.inverse`.

    `print` shows the joint lines of the inverse linkage.

    Attributes
    ----------
    outputs : tuple of str
        Names of the outputs; see `Mechanism.has_output`.
    closed : InverseLinkage or None
        Joint lines and assembly modes of the inverse linkage; None if the inverse is searched.
    inputs : tuple of Input
        The inputs of the linkage; see `InverseProblem`. One that `is_part` has the solutions of
        the turns around zero, or around given inputs.

    """

    def __init__(self, linkage: Mechanism, outputs: Tuple[str, ...]):
        self.linkage, self.outputs, self._programs = linkage, outputs, Cache()
        blocks(linkage, outputs)
        self._problem = problem = InverseProblem(linkage, outputs)
        self.inputs, self._n = problem.inputs, len(outputs)
        self._is_open = any(each.is_part for each in self.inputs)
        # An inverse linkage has each input in one period, or else in one turn.
        self.closed: Optional[InverseLinkage] = None if self._is_open else (
            taken_apart if linkage.axes == 'xy' else rods_taken_apart)(linkage, outputs)
        self._solver: Union[ClosedForm, Search] = ClosedForm(
            problem, self.closed) if self.closed else Search(problem)

    def __reduce__(self) -> Tuple[Any, ...]:
        """Pickle the linkage and the outputs only."""
        return self.linkage.inverse, (self.outputs,)

    def __repr__(self) -> str:
        return f'<inverse of {self.linkage.type} for {listed(self.outputs)}>'

    def __str__(self) -> str:
        what = listed(self.outputs)
        if not self.closed:
            return f'the inverse of {self.linkage.type} for {what} is searched'
        return f'# {self.linkage.type} driven by {what}\n{self.closed}'

    # --- all solutions ---

    def all(self, values: ArrayLike, near: Optional[ArrayLike] = None) -> List[Answer]:
        """
        Return all solutions for one value of each output.

        Parameters
        ----------
        values : float or array-like (outputs,)
            Values of the outputs [rad or m]; angles are equal up to whole turns, and an output
            that is an input up to whole periods of it.
        near : array-like (inputs,), optional
            Values of the inputs [rad or m]. Whole turns are added to the solutions to bring them
            nearest to it, and the nearest comes first; the unit of a length is about its stroke.

        Returns
        -------
        list of Answer
            The solutions of the linkage's own assembly, its `branches`, inside its reach; [] if
            there are none. Without `near` crank angles are in [-pi, pi), and the first input
            ascends. Solutions that differ by rounding only are one.

        Raises
        ------
        ValueError
            If there is not one value for each output, and one finite `near` for each input.

        """
        if near is not None and (there := self._elsewhere(self._one_each(near, 'near'))):
            inverse, start, own = there
            return [Answer(tuple(np.add(each, start).tolist()), self) for each, _ in inverse.all(
                np.subtract(self._one_each(values), own), np.subtract(
                    self._one_each(near), start))]
        found = [inputs for inputs, _ in self._all(self._one_each(values))]
        if near is not None:
            beside = self._finite(near, 'near')
            found = sorted((self._problem.next_to(inputs, beside) for inputs in found),
                           key=lambda x: sum(((a - b) / size) ** 2 for a, b, size in zip(
                               x, beside, self._problem.sizes)))
        return [Answer(inputs, self) for inputs in found]

    def _elsewhere(self, near: Sequence[float]
                   ) -> Optional[Tuple[Inverse, Sequence[float], Sequence[float]]]:
        """
        Return the inverse in the turns of some inputs, if it is not this one, and these turns.

        These are the angles [rad] of each input, and of each output that is an input.
        """
        turns = [float(input_.whole_turns(x)) if math.isfinite(x) else 0.0
                 for input_, x in zip(self.inputs, near)]
        if not any(turns):
            return None
        start = {input_.name: math.tau * count for input_, count in zip(self.inputs, turns)}
        return (self.linkage.turned(*turns).inverse(self.outputs), list(start.values()),
                [start.get(name, 0.0) for name in self.outputs])

    def over(self, *values: ArrayLike) -> Tuple[np.ndarray, np.ndarray]:
        """
        Return all solutions for arrays of values [rad or m], one array for each output.

        Returns
        -------
        (array (inputs, *shape, answers), array (outputs * inputs, *shape, answers))
            The inputs [rad or m], the first ascending, padded with NaN; and the rate of each
            output by the first input, by the second and so on.

        """
        rows = _broadcast(self._each(values))
        inputs, rates = self._found(np.stack([row.ravel() for row in rows]))
        self._single(inputs, rates)
        order = np.lexsort(np.nan_to_num(inputs, nan=np.inf).swapaxes(0, 1)[::-1], axis=0)
        most = max(int(np.isfinite(inputs[:, 0]).sum(axis=0).max(initial=0)), 1)
        parts = (np.moveaxis(np.take_along_axis(part, order[:, None], 0)[:most], 0, -1)
                 for part in (inputs, rates))
        inputs, rates = (part.reshape(len(part), *rows[0].shape, most) for part in parts)
        return inputs, rates

    def _all(self, values: Tuple[float, ...]) -> List[Found]:
        """Return all solutions, in order, one of those that differ by rounding."""
        return self._distinct(self._solutions(values))

    def _solutions(self, values: Tuple[float, ...]) -> List[Found]:
        """Return the solutions for finite values, none for others."""
        return list(self._solver.solutions(self._problem.reduced(values))) if all(
            map(math.isfinite, values)) else []

    def _found(self, values: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return what the solver's `over` does, for values of any size."""
        values = self._problem.within_turns(values)
        inputs, rates = self._solver.over(values)
        if self._solver.has_kite:
            for place in np.flatnonzero(np.isnan(inputs[:, 0]).all(axis=0)):
                for k, answer in enumerate(self._all(tuple(values[:, place].tolist()))):
                    inputs[k, :, place], rates[k, :, place] = answer
        return inputs, rates

    def _distinct(self, found: Sequence[Found]) -> List[Found]:
        """Return solutions in order, one of those that differ by rounding."""
        distinct: List[Found] = []
        near, turn = NEIGHBOURS * self._problem.sizes[0], self._problem.turned[0][1]
        for answer in sorted(found):
            below, turned = answer[0][0] - near, answer[0][0] - (turn - near)
            # Those just below, and those that are nearly a turn below.
            beside = (*takewhile(partial(_is_above, below), reversed(distinct)),
                      *takewhile(partial(_is_below, turned), distinct))
            if not any(self._are_one(answer, other) for other in beside):
                distinct.append(answer)
        return distinct

    def _are_one(self, answer: Found, other: Found) -> bool:
        apart, problem = 0.0, self._problem
        for x, y, size, (_, turn, _) in zip(answer[0], other[0], problem.sizes, problem.turned):
            gap = abs(x - y)
            if NEIGHBOURS * size < gap < turn - NEIGHBOURS * size:
                return False
            apart = max(apart, min(gap, abs(turn - gap)) / size)
        if apart <= SAME:
            return True
        jacobian = problem.jacobian(answer[1])
        if not np.isfinite(jacobian).all():  # at an end of the reach an output tells all digits
            return False
        values = np.linalg.svd(jacobian, compute_uv=False)
        rounding = 8 * 2.0 ** -53 if self.closed or self._n == 1 else SAME
        return bool(apart <= rounding * (1.0 + values[0]) / max(values[-1], SAME))

    def _single(self, inputs: np.ndarray, rates: np.ndarray) -> None:
        """Make NaN all but one of the solutions that differ by rounding."""
        doubtful = np.zeros(inputs.shape[2], bool)
        pairs: Iterable[Tuple[np.ndarray, np.ndarray]] = combinations(inputs, 2)
        if self._n == 1:
            ordered = np.sort(inputs, axis=0)
            last = np.isfinite(ordered).sum(axis=0, keepdims=True).clip(1) - 1
            ends = ordered[0], np.take_along_axis(ordered, last, 0)[0]
            pairs = [*zip(ordered[:-1], ordered[1:]), *[ends] * (len(ordered) > 2)]
        for one, two in pairs:
            away = self._problem.away(one, two)
            with np.errstate(invalid='ignore'):
                doubtful |= away <= self._n * NEIGHBOURS ** 2
        for place in np.flatnonzero(doubtful):
            here = inputs[:, :, place], rates[:, :, place]
            distinct = self._distinct([(tuple(x), tuple(r)) for x, r in zip(
                *(part.tolist() for part in here)) if x[0] == x[0]])
            for part, each in zip(here, zip(*distinct)):
                part[:] = np.nan
                part[:len(distinct)] = each

    def _one_each(self, values: Any, name: str = 'values') -> Tuple[float, ...]:
        """Return one number for each output; raise ValueError if there are not as many."""
        found = self._each(values, name)
        if any(np.size(each) != 1 for each in found):
            raise self._miscounted(values, name)
        return tuple(each if type(each) is float else each.item() for each in found)

    def _finite(self, values: Any, name: str) -> Tuple[float, ...]:
        """Return what `_one_each` does; raise ValueError also if one is not finite."""
        found = self._one_each(values, name)
        if not all(map(math.isfinite, found)):
            raise ValueError(f'{name} must be finite, got {quoted(list(found))}')
        return found

    def _each(self, values: Any, name: str = 'values') -> Tuple[Any, ...]:
        """Return a float or an array for each output; raise ValueError if they are not that."""
        if not isinstance(values, (list, tuple)):
            values = np.atleast_1d(numbers(name, values))
        if len(values) != self._n:
            raise self._miscounted(values, name)
        if set(map(type, values)) == {float}:
            return tuple(values)
        found = [numbers(name, each) for each in values]
        return tuple(each if each.ndim else float(each) for each in found)

    def _miscounted(self, values: Any, name: str) -> ValueError:
        return ValueError(f'{self.linkage.type} has {self._n} inputs: {name} must be as many '
                          f'numbers, got {quoted(values)}')

    def _limits(self, ends: Ends) -> Tuple[Tuple[float, ...], ...]:
        """Return the ends of each input as floats, () if it has none."""
        if ends is None:
            return ((),) * self._n
        try:
            limits = tuple(
                () if pair is None else tuple(map(float, pair)) for pair in ends)
            if len(limits) == self._n and all(
                    len(pair) == 2 and -LARGE < pair[0] <= pair[1] < LARGE
                    for pair in limits if pair):
                return limits
        except (TypeError, ValueError):
            pass
        raise ValueError('ends must be two finite numbers in order, or None, for each input, got '
                         + quoted(ends))

    # --- one of the solutions ---

    def nearest(self, values: Sequence[Any], near: Optional[Sequence[Any]] = None,
                ends: Ends = None) -> Tuple[Any, Any]:
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
        limits, values = self._limits(ends), self._each(values)
        near = None if near is None else self._each(near, 'near')
        given = (*values, *(near or ()), *chain(*limits))
        if near and self._is_open:
            return self._nearest_in_turns(values, near, limits)
        if set(map(type, given)) == {float}:
            return self._chosen(self._solutions(values), near, limits)[1:]
        if not self.closed:
            inputs, rates = self.over(*values)
            return self._chosen([(inputs[..., k], rates[..., k])
                                 for k in range(inputs.shape[-1])], near, limits)[1:]
        arrays = _broadcast(given)
        flat = np.stack([each.ravel() for each in arrays])
        flat[:self._n] = self._problem.within_turns(flat[:self._n])
        rows = self._choice(0, near is not None, tuple(map(bool, limits))).over(*flat)
        for place in np.flatnonzero(np.isnan(rows[:1 + self._solver.has_kite]).any(axis=0)):
            one = flat[:2 * self._n, place].tolist()
            rows[1:, place] = [*chain(*self._chosen(self._solutions(
                tuple(one[:self._n])), near and one[self._n:], limits)[1:])]
        found = [row.reshape(arrays[0].shape) for row in rows[1:]]
        return tuple(found[:self._n]), tuple(found[self._n:])

    def _nearest_in_turns(self, values: Sequence[Any], near: Sequence[Any], limits: Sequence
                          ) -> Tuple[Any, Any]:
        """Return what `nearest` does, each value by the inverse in the turns of its inputs."""
        arrays = np.broadcast_arrays(*values, *near)
        found = np.full((self._n + self._n ** 2, *arrays[0].shape), np.nan)
        for place in np.ndindex(arrays[0].shape):
            one = [float(each[place]) for each in arrays]
            inverse, start, own = self._elsewhere(one[self._n:]) or (
                self, [0.0] * self._n, [0.0] * self._n)
            inputs, rates = inverse._chosen(
                inverse._solutions(tuple(np.subtract(one[:self._n], own).tolist())),
                np.subtract(one[self._n:], start).tolist(),
                [tuple(np.subtract(pair, turn).tolist()) for pair, turn in zip(limits, start)])[1:]
            found[(slice(None), *place)] = [*np.add(inputs, start), *rates]
        rows = found.tolist() if {*map(type, (*values, *near))} == {float} else found
        return tuple(rows[:self._n]), tuple(rows[self._n:])

    def path(self, values: Sequence[np.ndarray], near: Optional[Sequence[float]] = None,
             ends: Ends = None) -> Tuple[Any, Any]:
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
        rows = np.stack([np.atleast_1d(row) for row in _broadcast(self._each(values))])
        if rows.ndim > 2:
            raise self._miscounted(values, 'values')
        inputs, rates = self._found(rows)
        limits, beside = self._limits(ends), None if near is None else self._finite(near, 'near')
        if beside and (there := self._elsewhere(beside)):
            inverse, start, own = there
            inputs, rates = inverse.path(
                [row - turn for row, turn in zip(rows, own)],
                np.subtract(beside, start).tolist(), [
                    (pair[0] - turn, pair[1] - turn) if pair else None
                    for pair, turn in zip(limits, start)])
            return tuple(row + turn for row, turn in zip(inputs, start)), rates
        found = np.full((self._n + self._n ** 2, inputs.shape[2]), np.nan)
        breaks: Dict[int, np.ndarray] = {}
        at, known = 0, np.flatnonzero(self._may_be_inside(inputs, limits))
        while (k := int(known.searchsorted(at))) < len(known):
            at = int(known[k])
            answers = [(tuple(x), tuple(r)) for x, r in zip(inputs[:, :, at].tolist(), rates[
                :, :, at].tolist())]
            rank, place, _ = self._chosen(answers, beside, limits)
            mode = int(rank)
            if place[0] != place[0]:
                at += 1
                continue
            if mode not in breaks:
                breaks[mode] = self._breaks(inputs, mode)
            stop = min(int(breaks[mode][breaks[mode].searchsorted(at)]) + 1, at + BLOCK)
            places = self._continued(inputs[mode, :, at:stop], place, limits)
            stop = at + places.shape[1]
            found[:self._n, at:stop], found[self._n:, at:stop] = places, rates[mode, :, at:stop]
            at, beside = stop, tuple(places[:, -1].tolist())
        return tuple(found[:self._n]), tuple(found[self._n:])

    def _may_be_inside(self, inputs: np.ndarray, limits: Sequence) -> np.ndarray:
        """Return for each value whether a solution may lie between the ends."""
        may, problem = inputs[:, 0] == inputs[:, 0], self._problem
        for by, (pair, (_, turn, _), size) in enumerate(zip(
                limits, problem.turned, problem.sizes)):
            if pair:
                # Rounding of an output moves an input to its end from no farther away.
                low, high = (end + side * NEIGHBOURS * (size + abs(end))
                             for end, side in zip(pair, (-1.0, 1.0)))
                first = inputs[:, by] + (turn * np.ceil((low - inputs[:, by]) / turn)
                                         if math.isfinite(turn) else 0.0)
                may &= (low <= first) & (first <= high)
        return may.any(axis=0)

    def _breaks(self, inputs: np.ndarray, mode: int) -> np.ndarray:
        """Return after which values a solution of another mode is nearer than the next one."""
        away = self._problem.away(inputs.swapaxes(0, 1)[:, :, 1:], inputs[mode, :, None, :-1])
        own = away[mode].copy()
        away[mode] = np.inf
        return np.append(np.flatnonzero(~(own < np.fmin.reduce(away))), inputs.shape[2] - 1)

    def _continued(self, inputs: np.ndarray, start: Sequence[float], limits: Sequence
                   ) -> np.ndarray:
        """Return inputs that continue from a start, whole turns included, up to the ends."""
        places = inputs.copy()
        for row, begin, pair, (_, turn, _) in zip(places, start, limits, self._problem.turned):
            if math.isfinite(turn):
                turns = rounded((row[:-1] - row[1:]) / turn)
                turns[:1] += round((begin - float(row[0])) / turn)
                if turns.any():
                    row[1:] += turn * np.cumsum(turns)
            row[0] = begin
            if pair and len(beyond := np.flatnonzero((row < pair[0]) | (pair[1] < row))):
                places = places[:, :beyond[0]]
        return places

    def _chosen(self, answers: Sequence[Any], near: Optional[Sequence[Any]],
                limits: Sequence) -> Tuple[Any, Any, Any]:
        """Return the number, inputs and rates of the chosen one of some solutions."""
        n = self._n
        if not answers:
            return 0.0, (math.nan,) * n, (math.nan,) * (n * n)
        if len(answers) > GROUP:
            groups = [self._chosen(answers[k:k + GROUP], near, limits)
                      for k in range(0, len(answers), GROUP)]
            rank, *chosen = self._chosen([(x, rates) for _, x, rates in groups], near, limits)
            ranks = np.stack(np.broadcast_arrays(*(
                k * GROUP + group[0] for k, group in enumerate(groups))))
            return (np.take_along_axis(ranks, np.asarray(rank, int)[None], 0)[0], *chosen)
        choose = self._choice(len(answers), near is not None, tuple(map(bool, limits)))
        rank, *found = choose(*chain.from_iterable(chain(*answer) for answer in answers),
                              *(near or ()), *chain(*limits))
        return rank, tuple(found[:n]), tuple(found[n:])

    def _choice(self, count: int, *way: Any) -> Pose:
        """Return the code of `choice` for `count` solutions or, if it is 0, for all modes."""
        def make() -> Pose:
            n, size = self._n, self._n + self._n ** 2
            rows = [[real(1.0), *map(argument, range(start, start + size))] for start in range(
                0, count * size, size)] or cast(ClosedForm, self._solver).checked_rows
            outputs, total = choice(self._problem, rows, count * size or n, *way)
            return self.linkage.bind(Program(
                outputs, total, self.closed.arguments if self.closed and not count else {}))

        return self._programs.get_or_make((count, *way), make)

    def follow(self, values: ArrayLike, near: ArrayLike) -> Found:
        """
        Return the solution that is continuous from given inputs.

        Parameters
        ----------
        values : array-like (outputs,)
            The values of the outputs [rad or m].
        near : array-like (inputs,)
            The present inputs [rad or m]; whole turns of a crank are preserved.

        Returns
        -------
        (tuple of float, tuple of float)
            The inputs [rad or m] at the end of a motion in which the outputs go straight from
            their present values to `values`, angles the shorter way; and the rate of each output
            by the first input, by the second and so on. NaN if the motion passes a dead point or
            leaves the reach.

        """
        values, near = self._one_each(values), self._one_each(near, 'near')
        if not all(map(math.isfinite, (*values, *near))):
            return (math.nan,) * self._n, (math.nan,) * self._n ** 2
        if there := self._elsewhere(near):
            inverse, start, own = there
            inputs, rates = inverse.follow(np.subtract(values, own), np.subtract(near, start))
            return tuple(np.add(inputs, start).tolist()), rates
        return self._solver.follow(self._problem.reduced(values), near)

    # --- the working mode ---

    def margin(self, inputs: Sequence[float]) -> float:
        """Return the distance of a pose from a singular one; see `Answer.margin`."""
        jacobian = self._problem.jacobian(self._problem.rated.at(
            *self._one_each(inputs, 'inputs'))[self._n:])
        if not np.isfinite(jacobian).all():
            return 0.0
        values = np.linalg.svd(jacobian, compute_uv=False)
        return float(values[-1] / max(1.0, values[0]))

    def signs(self, inputs: Sequence[float]) -> Mapping[str, int]:
        """Return the working mode of a pose; see `Answer.signs`."""
        linkage, inputs = self.linkage, self._one_each(inputs, 'inputs')
        cranks = {link.name: link for link in linkage.links
                  if any(input_.turns and link.name == input_.name for input_ in linkage.inputs)}
        places, signs = linkage.solve(inputs if self._n > 1 else inputs[0]), {}
        for link in linkage.links if linkage.axes == 'xy' else ():
            crank = cranks.get(link.parent)
            if crank and link.kind == 'revolute' and link.joint != crank.joint:
                (a, b), (c, d) = (places[end] - places[start] for start, end in (
                    (crank.joint, link.joint), (link.joint, link.tip)))
                signs[link.name] = _sign(a * d - b * c, math.hypot(a, b) * math.hypot(c, d))
        signs['det'] = 0 if self.margin(inputs) < SINGULAR else _sign(float(np.linalg.det(
            self._problem.jacobian(self._problem.rated.at(*inputs)[self._n:]))), 0.0)
        return signs


def _broadcast(values: Sequence[Any]) -> Sequence[np.ndarray]:
    """Return arrays of one shape; raise ValueError with their shapes if they have none."""
    try:
        return np.broadcast_arrays(*values)
    except ValueError:
        shapes = ', '.join(str(np.shape(each)) for each in values)
        raise ValueError(f'arrays must have shapes that broadcast, got {shapes}') from None


def _sign(value: float, size: float) -> int:
    return int(np.sign(value)) if abs(value) > SINGULAR * size else 0


def _is_above(least: float, answer: Found) -> bool:
    return answer[0][0] >= least


def _is_below(most: float, answer: Found) -> bool:
    return answer[0][0] <= most
