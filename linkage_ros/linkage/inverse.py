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

If the inverse linkage decomposes into dyads, each of its assembly modes is a closed form. The
forward formula selects the modes of the linkage itself: at a solution the outputs have the given
values up to rounding, each dyad is on its side, and the inputs are inside the reach. Otherwise the
inputs are searched; see `search`.
"""

from __future__ import annotations

from functools import cached_property, partial, reduce
from itertools import chain, combinations, product
import math
import operator
from typing import (
    Any,
    cast,
    Dict,
    Iterator,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Sequence,
    Tuple,
    TYPE_CHECKING,
)

import numpy as np
from numpy.typing import ArrayLike

from .arguments import numbers
from .curves import LEAST
from .input_range import is_periodic
from .inputs import Input, spread
from .inverse_linkage import InverseLinkage, taken_apart
from .inverse_rods import taken_apart as rods_taken_apart
from .planar import TOLERANCE
from .search import blocks, search_for, SINGULAR
from ..cache import Cache
from ..formula.expression import (
    argument,
    gated,
    nearest_integer,
    Real,
    real,
    square,
    square_root,
    substituted,
    where,
)
from ..formula.program import Pose, Program
from ..words import listed, quoted

if TYPE_CHECKING:
    from .mechanism import Mechanism

# Bound of an output's rounding error through both formulas, as a part of the output's size.
ROUNDING = 32 * 2.0 ** -53
# Where the forward formula has no value, the reach may end: it is evaluated this far to each side
# of a solution [rad, sizes].
BESIDE = 16 * 2.0 ** -52 * math.pi
# Next to an end of the reach rates are unbounded: the error allowed for an output there, as a part
# of its size, and the rate from which on that error is allowed.
ENDED, STEEP = 1e-7, 1e4
# A larger error than this part of the output's size belongs to another assembly.
OTHER = 1e-2
# A margin below minus this many tolerances, a thousandth of its size, is outside the reach.
FAR = 1e-3 / TOLERANCE
# Newton steps at most that remove a closed form's rounding; each doubles the number of digits.
POLISHING = 5
# Below this rate the inputs are ill-conditioned, and a Newton step does not improve them.
SOUND = 0.1
# Two solutions are one if they differ by less than the first [rad, sizes], or by less than the
# outputs' rounding explains, which is considered up to the second.
SAME, NEIGHBOURS = 1e-13, 1e-4
# Largest step of an output while it is followed, as a part of its size; and the distance below
# which a mode is the one that the inputs are in [rad, sizes].
STEP, ALIKE = 0.3, 1e-5
# Distance to an end of a sweep that counts as that end, in sizes and as a part of the end.
CLOSE, ULPS = 1e-7, 4 * 2.0 ** -52
# Greater than any input.
LARGE = 1e300
# Number of values of a path that are processed together.
BLOCK = 1024

Found = Tuple[Tuple[float, ...], Tuple[float, ...]]
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
        The inputs of the linkage. If the gears of one repeat only after very many turns, its
        period is that of the outputs, or infinite if they have none: then solutions are those of
        one turn.

    """

    def __init__(self, linkage: Mechanism, outputs: Tuple[str, ...]):
        self.linkage, self.outputs = linkage, outputs
        if linkage.checked(outputs).shape:
            raise ValueError('the inverse is for one set of dimensions, not for arrays')
        blocks(linkage, outputs)
        self._n = len(outputs)
        self._angular = [linkage.is_angle(name) for name in outputs]
        self._scales = [1.0 if angular else linkage.longest for angular in self._angular]
        self._sizes = [input_.size for input_ in linkage.inputs]
        self._forward, self._programs = linkage.checked(outputs), Cache()
        self.inputs = tuple(map(self._coming_round, range(self._n), linkage.inputs))
        # The period of each output: a turn, or that of the input that it is.
        fixed = {input_.name: input_ for input_ in self.inputs}
        self._periods = [math.inf if not angular or name in fixed and not fixed[name].turns else
                         fixed[name].turn if name in fixed else math.tau
                         for name, angular in zip(outputs, self._angular)]
        # Half a period of each input, the period, and the value below which it is zero.
        self._turned = [(0.5 * input_.turn, input_.turn, LEAST) if input_.turns else
                        (math.inf, math.inf, LEAST * input_.size) for input_ in self.inputs]
        self.closed: Optional[InverseLinkage] = (
            taken_apart if linkage.axes == 'xy' else rods_taken_apart)(linkage, outputs)
        # Where all modes are the linkage's own nothing is checked, and nothing else has the rates.
        self._is_own = bool(self.closed and self.closed.is_own and self._n == 2)
        self._row = self._n * (1 + self._n if self._is_own or self._n == 1 else 1)
        if not self.closed:
            self._search = search_for(linkage, outputs, self.inputs, self._periods)

    @cached_property
    def _rated(self) -> Pose:
        """Return the code for the outputs with their rates."""
        return self.linkage.posed((), self.outputs, self.outputs)

    def __str__(self) -> str:
        what = listed(self.outputs)
        if not self.closed:
            return f'the inverse of {self.linkage.type} for {what} is searched'
        return f'# {self.linkage.type} driven by {what}\n{self.closed}'

    def _coming_round(self, by: int, input_: Input) -> Input:
        """Return an input with the period of the outputs if its own has too many turns."""
        if not input_.turns or self.linkage.period(by) == input_.period:
            return input_
        rates = [self.linkage.gear(name, by)[0] for name in self.linkage.geared_to(by)]
        periods = (1.0, *(1.0 / abs(rate) for rate in rates if abs(rate) > 1.0), math.inf)
        return next(each for each in (input_._replace(period=period) for period in periods)
                    if not each.turns or is_periodic(partial(self._outputs_over, by), each))

    def _outputs_over(self, by: int, values: np.ndarray) -> np.ndarray:
        """Return the outputs, angles as directions, over one input; the others are spread."""
        inputs = spread(self.linkage.inputs, len(values))
        inputs[by] = values
        rows = zip(self._forward.over(*inputs), self._angular, self._scales)
        return np.concatenate([[np.cos(row), np.sin(row)] if angular else [row / scale]
                               for row, angular, scale in rows])

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
        found = [inputs for inputs, _ in self._all(self._one_each(values))]
        if near is not None:
            beside = self._one_each(near, 'near')
            if not all(map(math.isfinite, beside)):
                raise ValueError(f'near must be finite, got {quoted(list(beside))}')
            found = sorted((self._next_to(inputs, beside) for inputs in found), key=lambda x: sum(
                ((a - b) / size) ** 2 for a, b, size in zip(x, beside, self._sizes)))
        return [Answer(inputs, self) for inputs in found]

    def over(self, *values: ArrayLike) -> Tuple[np.ndarray, np.ndarray]:
        """
        Return all solutions for arrays of values [rad or m], one array for each output.

        Returns
        -------
        (array (inputs, *shape, answers), array (outputs * inputs, *shape, answers))
            The inputs [rad or m], the first ascending, padded with NaN; and the rate of each
            output by the first input, by the second and so on.

        """
        rows = np.broadcast_arrays(*(numbers('values', each) for each in values))
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
        return self._distinct(list(self._solutions(values)))

    def _solutions(self, values: Tuple[float, ...]) -> Iterator[Found]:
        """Yield the solutions for finite values; none for others."""
        if not all(map(math.isfinite, values)):
            return
        values = self._reduced(values)
        if not self.closed:
            yield from _columns(*self._searched(np.array(values)[:, None]))
            return
        n = 1 + self._n
        for mode, row in self._assembled(values):
            verdict = (1.0, *row) if self._is_own else self._check.at(*values, *row)
            if verdict[0] == 1.0:
                yield verdict[1:n], verdict[n:]
            elif verdict[0] != verdict[0] and (own := self._own(mode, verdict[1:n], values)):
                yield own

    def _assembled(self, values: Sequence[float]) -> Iterator[Tuple[int, Tuple[float, ...]]]:
        """Yield number and row of each assembly mode that has inputs; see `_rows`."""
        flat, size = self._modes.at(*values), self._row
        for mode, start in enumerate(range(0, len(flat), size)):
            row = flat[start:start + size]
            if -LARGE < sum(row[:self._n]) < LARGE:
                yield mode, row

    @cached_property
    def _rows(self) -> List[List[Real]]:
        """
        Return a row of expressions of the outputs for each assembly mode, in each of its turns.

        It has the inputs and, of one input or where all modes are solutions, the rates of the
        mode: those of one input are exact next to a dead point, too.
        """
        closed = cast(InverseLinkage, self.closed)
        if self._is_own:
            return [[*map(self._counted, range(self._n), mode.inputs), *_inverted(mode.rates)]
                    for mode in closed.modes]
        return [[*(value + turn for value, turn in zip(mode.inputs, turns)),
                 *(_inverted(mode.rates) if self._n == 1 else ())]
                for mode in closed.modes for turns in product(*closed.turns)]

    @cached_property
    def _verdict(self) -> List[Real]:
        """
        Return what decides about a mode, as expressions of the outputs and of its row.

        It is 1 if the row is a solution, 0 if not, NaN if `_own` has to decide; then the inputs,
        more exact, and the rates: NaN if it is none.
        """
        n, structure = self._n, self.linkage.structure
        row = [argument(n + i) for i in range(self._row)]
        inputs = row[:n]
        if self._is_own:
            return [real(1.0), *row]
        limits = [limit for limit in structure.built.limits if limit.margin.varies]
        forward = substituted([*structure.checked(self.outputs), *(
            limit.margin + FAR * limit.tolerance for limit in limits)], inputs)
        rates = forward[n:n + n * n]
        verdict, *answer = self._judged(inputs, forward[:n], rates, forward[n + n * n:])
        return [verdict, *(where(verdict <= 0.5, math.nan, each)
                           for each in (*answer, *(row[n:] or rates)))]

    def _program(self, outputs: Sequence[Real], arguments: int) -> Pose:
        replaced = self.closed.arguments if self.closed else {}
        return self.linkage.bind(Program(outputs, arguments, replaced))

    @cached_property
    def _modes(self) -> Pose:
        """Return the code from the outputs to the rows of all modes."""
        return self._program([*chain(*self._rows)], self._n)

    @cached_property
    def _check(self) -> Pose:
        """Return the code from the outputs and a row to its verdict."""
        return self._program(self._verdict, self._n + self._row)

    @cached_property
    def _checked_rows(self) -> List[List[Real]]:
        """Return the verdict of each mode, as expressions of the outputs."""
        values = list(map(argument, range(self._n)))
        return [substituted(self._verdict, [*values, *row]) for row in self._rows]

    @cached_property
    def _checked_modes(self) -> Pose:
        """Return the code from the outputs to the verdicts of all modes, for arrays."""
        return self._program([*chain(*self._checked_rows)], self._n)

    def _judged(self, inputs: Sequence[Real], reached: Sequence[Real], rates: Sequence[Real],
                margins: Sequence[Real]) -> List[Real]:
        """Return whether inputs are a solution, and the inputs after one Newton step."""
        n, gaps, det = self._n, [], self._determinant(rates)
        size = math.prod(self._scales) / math.prod(self._sizes)
        verdict = real(1.0) if det is None else where(
            NEIGHBOURS * size < abs(det), 1.0, math.nan)
        # Outputs may be NaN at an end of the reach, but not far outside it.
        other = reduce(lambda unknown, margin: where(margin < 0.0, 0.0, unknown), margins, where(
            abs(inputs[0]) < LARGE, math.nan, 0.0))
        for i, (turn, scale) in enumerate(zip(self._periods, self._scales)):
            gap = reached[i] - argument(i)
            if math.isfinite(turn):
                gap = gap - turn * nearest_integer(gap / turn)
            gaps.append(gap)
            other = where(NEIGHBOURS * scale < abs(gap), 0.0, where(
                abs(gap) <= NEIGHBOURS * scale, math.nan, other))
        for i, (gap, scale) in enumerate(zip(gaps, self._scales)):
            speeds = [abs(rate) for rate in rates[i::n]]
            allowed = ROUNDING * (scale + sum((
                speed * where(abs(x) < size, size, abs(x))
                for speed, x, size in zip(speeds, inputs, self._sizes)), real(0.0)))
            steepest = reduce(_greater, map(operator.mul, speeds, self._sizes))
            verdict = where(abs(gap) <= allowed, where(
                steepest <= STEEP * scale, verdict, math.nan), other)
        polished = [self._counted(by, x - step)
                    for by, (x, step) in enumerate(zip(inputs, self._steps(gaps, rates)))]
        return [verdict, *polished]

    def _counted(self, by: int, x: Real) -> Real:
        """Return an input, an angle within one period around zero, zero without sign."""
        half, turn, least = self._turned[by]
        if math.isfinite(turn):
            x = x - turn * nearest_integer(x / turn)
            x = where(half <= x, x - turn, x)
        return where(abs(x) < least, 0.0, x)

    def _determinant(self, rates: Sequence[Real]) -> Optional[Real]:
        """Return the determinant of d outputs / d inputs of up to two, None of more."""
        return None if self._n > 2 else rates[0] if self._n == 1 else (
            rates[0] * rates[3] - rates[1] * rates[2])

    def _steps(self, gaps: Sequence[Real], rates: Sequence[Real]) -> Sequence[Real]:
        """Return the steps of Newton's method, 0 where the inputs are ill-conditioned."""
        det = self._determinant(rates)
        if det is None:
            return [real(0.0)] * self._n
        sound = SOUND * math.prod(self._scales) / math.prod(self._sizes) < abs(det)
        det = where(sound, det, math.inf)
        if self._n == 1:
            return [gaps[0] / det]
        return [(gaps[0] * rates[3] - gaps[1] * rates[2]) / det,
                (gaps[1] * rates[0] - gaps[0] * rates[1]) / det]

    def _reduced(self, values: Tuple[float, ...]) -> Tuple[float, ...]:
        """Return values with large angles reduced to one turn, by sine and cosine, exactly."""
        return tuple(float(_within_turn(x, turn)) if abs(x) > turn else x
                     for x, turn in zip(values, self._periods))

    def _own(self, mode: int, inputs: Tuple[float, ...], values: Sequence[float],
             within: bool = True) -> Optional[Found]:
        """Return the inputs of a mode and the rates if they are a solution, else None."""
        n, at, slack = self._n, self._forward.at, ROUNDING
        row = at(*inputs)
        if row[0] != row[0] or n > 1 and any(x != x for x in row[1:n]):
            # This is an end of the reach, up to rounding.
            for beside in self._beside(inputs):
                row, slack = at(*beside), BESIDE
                if not any(x != x for x in row[:n]):
                    inputs = beside
                    break
            else:
                return None
        for _ in range(POLISHING):
            gaps, sure, away = self._missed(row, inputs, values, slack)
            if sure:
                rates = self._rates_at_end(mode, inputs, values, row[n:])
                return None if rates is None else (
                    self._within(inputs) if within else inputs, rates)
            if not away <= OTHER:
                break
            inputs = self._stepped(inputs, row[n:], gaps)
            if any(x != x for x in inputs):
                break
            row = at(*inputs)
        return None

    def _rates_at_end(self, mode: int, inputs: Tuple[float, ...], values: Sequence[float],
                      rates: Tuple[float, ...]) -> Optional[Tuple[float, ...]]:
        """
        Return the rates at a solution, or None if it is beyond an end of the reach.

        Next to an end of the reach rounding of the inputs spoils the rates of the forward formula,
        and those of the mode replace them. Beyond the end the mode has its dyads on other sides
        than the linkage: the inputs turn back, and their rates have the other sign.
        """
        n, closed = self._n, cast(InverseLinkage, self.closed)
        if np.abs(self._jacobian(rates)).max() < (STEEP if n > 1 else 1.0):
            return rates
        if not np.isfinite(rates).all():
            rows = (self._forward.at(*beside) for beside in self._beside(inputs))
            rates = next((row[n:] for row in rows if np.isfinite(row).all()), rates)
        mode //= math.prod(map(len, closed.turns))
        pose = self._programs.get_or_make(('rates', mode), lambda: self._program(
            [*chain(*closed.modes[mode].rates)], n))
        turning = np.reshape(pose.at(*values), (n, n))
        with np.errstate(invalid='ignore'):
            # The identity up to rounding; a dyad on its other side turns a sign.
            both = turning @ np.reshape(rates, (n, n)).T
            if np.linalg.det(both) < 0.0 or (np.diag(both) < 0.0).any():
                return None
        try:
            with np.errstate(all='ignore'):
                found = 1.0 / turning if n == 1 else np.linalg.inv(turning)
        except np.linalg.LinAlgError:
            return rates
        return tuple(found.T.ravel().tolist())

    def _beside(self, inputs: Tuple[float, ...]) -> Iterator[Tuple[float, ...]]:
        """Yield inputs of which one differs by little more than rounding."""
        for i, size in enumerate(self._sizes):
            for step in (BESIDE * size, -BESIDE * size):
                yield (*inputs[:i], inputs[i] + step, *inputs[i + 1:])

    def _missed(self, row: Sequence[float], inputs: Sequence[float], values: Sequence[float],
                slack: float) -> Tuple[List[float], bool, float]:
        """Return the outputs' errors, whether they are rounding, and the greatest by its size."""
        n, gaps, sure, most = self._n, [], True, 0.0
        for i, (value, turn, scale) in enumerate(zip(values, self._periods, self._scales)):
            gap = row[i] - value
            if gap - gap == 0.0:
                gap = math.remainder(gap, turn)
            gaps.append(gap)
            away, allowed, own = abs(gap), ROUNDING * scale, 0.0
            if not away <= allowed:
                for rate, x, size in zip(row[n + i::n], inputs, self._sizes):
                    allowed += slack * abs(rate) * max(size, abs(x))
                    # Next to a dead point an ulp of an input may move the output by more.
                    own += 2.0 ** -52 * abs(rate) * abs(x)
                own = min(own, OTHER * scale) if own < math.inf else 0.0
                sure = sure and away <= max(min(allowed, ENDED * scale), own)
            if not away / scale <= most:
                most = away / scale
        return gaps, sure, most

    def _stepped(self, inputs: Tuple[float, ...], rates: Sequence[float],
                 gaps: Sequence[float]) -> Tuple[float, ...]:
        """Return inputs after a step of Newton's method; NaN if the Jacobian is singular."""
        if self._n == 1:
            return (inputs[0] - gaps[0] / rates[0] if rates[0] else math.nan,)
        try:
            steps = np.linalg.solve(np.reshape(rates, (self._n, self._n)).T, gaps)
        except np.linalg.LinAlgError:
            return (math.nan,)
        return tuple(x - step for x, step in zip(inputs, steps.tolist()))

    def _within(self, inputs: Sequence[float]) -> Tuple[float, ...]:
        """Return inputs, angles within one period around zero."""
        found = []
        for x, (half, turn, least) in zip(inputs, self._turned):
            if not -half <= x < half:
                x -= turn * math.floor(x / turn + 0.5)
            found.append(0.0 if -least < x < least else x)
        return tuple(found)

    def _distinct(self, found: Sequence[Found]) -> List[Found]:
        """Return solutions in order, one of those that differ by rounding."""
        distinct: List[Found] = []
        for answer in sorted(found):
            if not any(self._are_one(answer, other) for other in distinct):
                distinct.append(answer)
        return distinct

    def _are_one(self, answer: Found, other: Found) -> bool:
        apart = 0.0
        for x, y, size, (_, turn, _) in zip(answer[0], other[0], self._sizes, self._turned):
            gap = abs(x - y)
            if NEIGHBOURS * size < gap < turn - NEIGHBOURS * size:
                return False
            apart = max(apart, min(gap, abs(turn - gap)) / size)
        if apart <= SAME:
            return True
        values = np.linalg.svd(self._jacobian(answer[1]), compute_uv=False)
        rounding = 8 * 2.0 ** -53 if self.closed or self._n == 1 else SAME
        return bool(apart <= rounding * (1.0 + values[0]) / max(values[-1], SAME))

    def _jacobian(self, rates: Sequence[float]) -> np.ndarray:
        """Return d outputs / d inputs, both in units of their sizes, from rates by each input."""
        return (np.reshape(rates, (self._n, self._n)).T * self._sizes
                / np.reshape(self._scales, (-1, 1)))

    def _found(self, values: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """
        Return all solutions for values (outputs, n), in no order, NaN where there are fewer.

        Their shapes are (answers, inputs, n) and (answers, inputs * outputs, n). Solutions that
        differ by rounding are not merged.
        """
        values = self._within_turns(values)
        if not self.closed:
            return self._searched(values)
        n, count = self._n, values.shape[1]
        found = self._checked_modes.over(*values).reshape(len(self._rows), -1, count)
        for mode, place in zip(*np.nonzero(np.isnan(found[:, 0]))):
            own = self._own(int(mode), tuple(found[mode, 1:n + 1, place].tolist()),
                            tuple(values[:, place].tolist()))
            found[mode, 1:, place] = [*own[0], *own[1]] if own else math.nan
        return found[:, 1:n + 1], found[:, n + 1:]

    def _within_turns(self, values: np.ndarray) -> np.ndarray:
        """Return values (outputs, n) as `_reduced` does; NaN for those that are not finite."""
        near = np.abs(values) <= math.tau
        if near.all():
            return values
        values = np.where(np.isfinite(values), values, np.nan)
        for row, turn in zip(values, self._periods):
            far = np.abs(row) > turn
            row[far] = _within_turn(row[far], turn)
        return values

    def _single(self, inputs: np.ndarray, rates: np.ndarray) -> None:
        """Make NaN all but one of the solutions that differ by rounding."""
        doubtful = np.zeros(inputs.shape[2], bool)
        for one, two in combinations(inputs, 2):
            away = self._away(one, two)
            with np.errstate(invalid='ignore'):
                doubtful |= away <= self._n * NEIGHBOURS ** 2
        for place in np.flatnonzero(doubtful):
            here = inputs[:, :, place], rates[:, :, place]
            distinct = self._distinct([(tuple(x), tuple(r)) for x, r in zip(
                *(part.tolist() for part in here)) if x[0] == x[0]])
            for part, each in zip(here, zip(*distinct)):
                part[:] = np.nan
                part[:len(distinct)] = each

    def _away(self, inputs: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Return the squared distances of inputs (inputs, ...) from others, in their sizes."""
        total = []
        for x, y, (_, turn, _), size in zip(inputs, others, self._turned, self._sizes):
            gap = x - y
            if math.isfinite(turn):
                gap -= turn * _rounded(gap / turn)
            else:
                gap /= size
            gap *= gap
            total.append(gap)
        return reduce(operator.iadd, total)

    def _one_each(self, values: Any, name: str = 'values') -> Tuple[float, ...]:
        """Return one number for each output; raise ValueError if there are not as many."""
        if type(values) is list and len(values) == self._n and set(map(type, values)) == {float}:
            return tuple(values)
        found = numbers(name, values)
        if found.shape != (self._n,) and not (self._n == 1 and found.shape == ()):
            raise ValueError(f'{self.linkage.type} has {self._n} inputs: {name} must be as many '
                             f'numbers, got {quoted(found.tolist())}')
        return tuple(found.ravel().tolist())

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
            and crank turn the same way); with several, the one whose first input is the least.
        ends : sequence of (float, float) or None, optional
            For each input the range [rad or m] that the solution has to lie in, or None.

        Returns
        -------
        (tuple of float or array, tuple of float or array)
            The inputs [rad or m], and the rate of each output by the first input, by the second
            and so on; NaN where there is no solution.

        """
        limits = tuple(ends or (None,) * self._n)
        near = None if near is None else tuple(near)
        given = (*values, *(near or ()), *(float(end) for pair in limits if pair for end in pair))
        if set(map(type, given)) == {float}:
            return self._chosen(list(self._solutions(tuple(values))), near, limits)[1:]
        if not self.closed:
            inputs, rates = self.over(*values)
            return self._chosen([(inputs[..., k], rates[..., k])
                                 for k in range(inputs.shape[-1])], near, limits)[1:]
        arrays = np.broadcast_arrays(*given)
        flat = np.stack([each.ravel() for each in arrays])
        flat[:self._n] = self._within_turns(flat[:self._n])
        rows = self._choice(0, near is not None, tuple(map(bool, limits))).over(*flat)
        for place in np.flatnonzero(np.isnan(rows[0])):
            one = flat[:2 * self._n, place].tolist()
            rows[1:, place] = [*chain(*self._chosen(list(self._solutions(
                tuple(one[:self._n]))), near and one[self._n:], limits)[1:])]
        found = [row.reshape(arrays[0].shape) for row in rows[1:]]
        return tuple(found[:self._n]), tuple(found[self._n:])

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
        inputs, rates = self._found(np.array(values, float))
        limits, beside = tuple(ends or (None,) * self._n), near and tuple(np.ravel(near).tolist())
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
        may = inputs[:, 0] == inputs[:, 0]
        for by, (pair, (_, turn, _), size) in enumerate(zip(limits, self._turned, self._sizes)):
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
        away = self._away(inputs.swapaxes(0, 1)[:, :, 1:], inputs[mode, :, None, :-1])
        own = away[mode].copy()
        away[mode] = np.inf
        return np.append(np.flatnonzero(~(own < np.fmin.reduce(away))), inputs.shape[2] - 1)

    def _continued(self, inputs: np.ndarray, start: Sequence[float], limits: Sequence
                   ) -> np.ndarray:
        """Return inputs that continue from a start, whole turns included, up to the ends."""
        places = inputs.copy()
        for row, begin, pair, (_, turn, _) in zip(places, start, limits, self._turned):
            if math.isfinite(turn):
                turns = _rounded((row[:-1] - row[1:]) / turn)
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
        choose = self._choice(len(answers), near is not None, tuple(map(bool, limits)))
        rank, *found = choose(*chain.from_iterable(chain(*answer) for answer in answers),
                              *(near or ()), *(end for pair in limits if pair for end in pair))
        return rank, tuple(found[:n]), tuple(found[n:])

    def _choice(self, *what: Any) -> Pose:
        """Return the code that `_make_choice` makes."""
        return self._programs.get_or_make(what, lambda: self._make_choice(*what))

    def _make_choice(self, count: int, follows: bool, ended: Tuple[bool, ...]) -> Pose:
        """
        Return the code that chooses one of `count` solutions, or, if it is 0, one of the modes.

        Its arguments are the inputs and rates of each solution, or the values; then, if it
        `follows`, the inputs that the solution has to be nearest to; then the two ends of each
        input that is `ended`. An input beyond an end by rounding of the outputs is at the end. The
        code returns the number of the chosen one, NaN if `_own` has to decide, inputs and rates.
        """
        n, size = self._n, self._n + self._n ** 2
        total = (count * size or n) + n * follows + 2 * sum(ended)
        given = list(map(argument, range(total)))
        values, given = given[:count * size or n], given[count * size or n:]
        near, ends = given[:n] if follows else [], iter(given[n * follows:])
        limits = [(next(ends), next(ends)) if each else () for each in ended]
        rows = [[real(1.0), *values[i:i + size]] for i in range(
            0, count * size, size)] or self._checked_rows
        unknown = reduce(lambda found, row: where(row[0] <= 1.0, found, math.nan), rows, real(0.0))
        solutions = [row for _, *row in rows]
        choices = []
        for rank, row in enumerate(solutions):
            places, misses = zip(*(self._place(by, row, near, limit)
                                   for by, limit in enumerate(limits)))
            if follows:
                order = [square_root(sum((square((x - y) / size) for x, y, size in zip(
                    places, near, self._sizes)), real(0.0)))]
            else:
                order = [where(row[1] < 0.0, 1.0, 0.0) if n == 1 else real(0.0), *row[:n]]
            order[0] = reduce(lambda far, miss: where(miss, math.inf, far), chain(*misses),
                              where(row[0] <= row[0], order[0], math.inf))
            choices.append([*order, real(float(rank)), *places, *row[n:]])
        many = len(choices[0]) - 1 - size
        best = reduce(lambda best, other: [where(
            _before(other[:many], best[:many]), mine, its) for mine, its in zip(
                other, best)], choices)
        return self._program([best[many] + unknown, *(
            gated(part, LARGE - best[0], 0.0) for part in best[many + 1:])], total)

    def _place(self, by: int, row: Sequence[Real], near: Sequence[Real],
               ends: Sequence[Real]) -> Tuple[Real, List[Real]]:
        """Return an input with whole turns added, and the conditions under which it is out."""
        x, size, turn = row[by], self._sizes[by], self._turned[by][1]

        def beside(value: Real, other: Real) -> Real:
            return value if math.isinf(turn) else value + turn * nearest_integer(
                (other - value) / turn)

        place = beside(x, near[by]) if near else x
        if not ends:
            return place, []
        speed = reduce(_greater, (
            abs(rate) * (size / (TOLERANCE * (math.pi if angular else scale)))
            for rate, angular, scale in zip(
                row[self._n * (by + 1):], self._angular, self._scales)))
        slack = size * where(1.0 < CLOSE * speed, 1.0 / speed, CLOSE) + ULPS * (
            4.0 * size + abs(ends[0]) + abs(ends[1]))
        low, high = ends[0] - slack, ends[1] + slack
        first, last = (beside(x, end) for end in ends)
        if math.isfinite(turn):
            first = where(first < low, first + turn, first)
            last = where(high < last, last - turn, last)
        place = where(place < low, first, where(high < place, last, place)) if near else first
        inside = where(place < ends[0], ends[0], where(ends[1] < place, ends[1], place))
        return inside, [place < low, high < place]

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
        nothing = (math.nan,) * self._n, (math.nan,) * self._n ** 2
        if not all(map(math.isfinite, (*values, *near))):
            return nothing
        values = self._reduced(values)
        if self.closed:
            return self._along(values, near) or nothing
        return self._search.follow(values, near)

    def _along(self, values: Tuple[float, ...], near: Tuple[float, ...]) -> Optional[Found]:
        """Return the end of the motion in the mode of the present inputs."""
        start = self._forward.at(*near)[:self._n]
        if any(x != x for x in start):
            return None
        gaps = [math.remainder(value - now, turn)
                for value, now, turn in zip(values, start, self._periods)]
        steps = math.ceil(max(abs(gap) / scale for gap, scale in zip(gaps, self._scales)) / STEP)
        at = {mode: near for mode, place in self._modes_near(start, near)
              if max(abs(x - y) / size for x, y, size in zip(place, near, self._sizes)) < ALIKE}
        found: List[Found] = []
        for k in range(1, max(steps, 1) + 1):
            aim = values if k == max(steps, 1) else tuple(
                now + k / steps * gap for now, gap in zip(start, gaps))
            going, found = at, []
            places = dict(self._modes_near(aim, near))
            at = {}
            for mode, last in going.items():
                if (place := places.get(mode)) and (own := self._own(
                        mode, self._next_to(place, last), aim, False)):
                    at[mode] = own[0]
                    found.append(own)
        return min(found, key=lambda own: math.dist(own[0], near)) if found else None

    def _modes_near(self, values: Sequence[float], near: Sequence[float]
                    ) -> Iterator[Tuple[int, Tuple[float, ...]]]:
        """Yield number and inputs of each mode that can be assembled, nearest to others."""
        for mode, row in self._assembled(values):
            yield mode, self._next_to(row[:self._n], near)

    def _next_to(self, inputs: Sequence[float], near: Sequence[float]) -> Tuple[float, ...]:
        return tuple(x + input_.turn * round((y - x) / input_.turn) if input_.turns else x
                     for input_, x, y in zip(self.inputs, inputs, near))

    # --- the search, where there is no closed form ---

    def _searched(self, values: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return all solutions as `_found` does."""
        inputs = self._search.answers(values)
        rates = self._rated.over(*inputs.swapaxes(0, 1))[self._n:].swapaxes(0, 1)
        return inputs, rates

    # --- the working mode ---

    def margin(self, inputs: Sequence[float]) -> float:
        """Return the distance of a pose from a singular one; see `Answer.margin`."""
        jacobian = self._jacobian(self._rated.at(*inputs)[self._n:])
        if not np.isfinite(jacobian).all():
            return 0.0
        values = np.linalg.svd(jacobian, compute_uv=False)
        return float(values[-1] / max(1.0, values[0]))

    def signs(self, inputs: Sequence[float]) -> Mapping[str, int]:
        """Return the working mode of a pose; see `Answer.signs`."""
        linkage = self.linkage
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
            self._jacobian(self._rated.at(*inputs)[self._n:]))), 0.0)
        return signs


def _within_turn(value: Any, turn: float) -> Any:
    count = turn / math.tau
    return count * np.arctan2(np.sin(value / count), np.cos(value / count))


def _sign(value: float, size: float) -> int:
    return int(np.sign(value)) if abs(value) > SINGULAR * size else 0


def _columns(inputs: np.ndarray, rates: np.ndarray) -> List[Found]:
    """Return the solutions of the first value in arrays, in order."""
    found = [(tuple(row), tuple(rate)) for row, rate in zip(
        inputs[:, :, 0].tolist(), rates[:, :, 0].tolist()) if row[0] == row[0]]
    return sorted(found)


def _inverted(rates: Sequence[Sequence[Real]]) -> Sequence[Real]:
    """Return rates of outputs from those of inputs, of one or two."""
    if len(rates) == 1:
        return [1.0 / rates[0][0]]
    (a, b), (c, d) = rates
    det = a * d - b * c
    return [d / det, -c / det, -b / det, a / det]


def _greater(x: Real, y: Real) -> Real:
    return where(x < y, y, x)


def _rounded(values: np.ndarray) -> np.ndarray:
    """Round an array in place to the nearest integers."""
    return cast(np.ndarray, np.rint(values, out=values))


def _before(one: Sequence[Real], other: Sequence[Real]) -> Real:
    """Return whether numbers precede others in lexicographic order."""
    (x, *rest), (y, *others) = one, other
    return 0.5 < where(x < y, 1.0, where(y < x, 0.0, where(_before(rest, others), 1.0, 0.0))) \
        if rest else x < y
