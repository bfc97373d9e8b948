# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The inverse: values of the inputs that give as many outputs the values that are asked for.

Where the inverse linkage comes apart into dyads, each of its assembly modes is a closed form.
Which of them the linkage has itself, its forward formula tells: an answer gives the outputs their
values but for rounding, with every dyad on its side, inside the reach. What does not come apart is
searched: one input between the extremes of the output, several by steps on the exact Jacobian.
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
from .inverse_linkage import InverseLinkage, Mode, taken_apart
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

# Rounding of an output on its way through both formulas, as a part of its size.
ROUNDING = 32 * 2.0 ** -53
# An answer is tried so far beside where it was found [rad, sizes], as the reach may end there.
BESIDE = 16 * 2.0 ** -52 * math.pi
# At an end of the reach, where rates have no bound, what that makes of an output, as a part; and
# from where on that end is near enough for both of its sides to give the same inputs.
ENDED, STEEP = 1e-7, 1e4
# What misses by more than this part of the output's size is the answer of another assembly.
OTHER = 1e-2
# What is below zero by so many tolerances, a thousandth of its size, is no end of the reach.
FAR = 1e-3 / TOLERANCE
# Newton steps that may take a closed form's rounding away; each doubles the digits.
POLISHING = 5
# Where rates are smaller than this, outputs tell inputs worse than a step of Newton's can mend.
SOUND = 0.1
# Answers that are no further apart than this [rad, sizes], or than what rounding of the outputs
# makes of it where that is no more than the second, are one.
SAME, NEIGHBOURS = 1e-13, 1e-4
# Outputs go on in steps of this part of their size, and what is nearer than the second is where
# the inputs are [rad, sizes].
STEP, ALIKE = 0.3, 1e-5
# An input is at an end of its sweep if the outputs do not tell by rounding, or by this, and by
# this part of the end.
CLOSE, ULPS = 1e-7, 4 * 2.0 ** -52
# More than any input.
LARGE = 1e300
# So many values of a path are looked at together.
BLOCK = 1024

Found = Tuple[Tuple[float, ...], Tuple[float, ...]]
Ends = Optional[Sequence[Optional[Tuple[float, float]]]]


class Answer(NamedTuple):
    """
    Values of all inputs that give outputs the values that are wanted.

    Attributes
    ----------
    inputs : tuple of float
        In the order of `Mechanism.inputs` [rad or m].
    inverse : Inverse
        Whose answer it is.

    """

    inputs: Tuple[float, ...]
    inverse: Inverse

    @property
    def signs(self) -> Mapping[str, int]:
        """
        Return the working mode.

        For each link that hangs on an input crank, by its name, the side to which it turns off
        from the line between the crank's joints, +1 left; and 'det', the sign of the determinant
        of d outputs / d inputs. 0 where that cannot be told.
        """
        return self.inverse.signs(self.inputs)

    @property
    def margin(self) -> float:
        """
        Return the least singular value of d outputs / d inputs by the greatest or 1.

        0 where the inputs cannot move the outputs some way, or not hold them. Lengths are counted
        in parts of the longest bar or about the stroke, angles in rad.
        """
        return self.inverse.margin(self.inputs)

    @property
    def is_singular(self) -> bool:
        """Whether it is at a singular pose, where no more than half of the digits are right."""
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
        What is asked for, named as `Mechanism.has_output` says.
    closed : InverseLinkage or None
        Its joint lines, assembly modes and their program; None where the inverse is searched.
    inputs : tuple of Input
        Those of the linkage. One whose gears come round after very many turns has the period of
        the outputs; where they have none, it is infinite, and one turn is answered alone.

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
        self._check, self._programs = linkage.checked(outputs), Cache()
        self.inputs = tuple(map(self._coming_round, range(self._n), linkage.inputs))
        # After how much an output is the same: a turn, of an input that is held its period.
        held = {input_.name: input_ for input_ in self.inputs}
        self._rounds = [math.inf if not angular or name in held and not held[name].turns else
                        held[name].turn if name in held else math.tau
                        for name, angular in zip(outputs, self._angular)]
        # Of each input half a period, the period, and below what it is zero.
        self._turned = [(0.5 * input_.turn, input_.turn, LEAST) if input_.turns else
                        (math.inf, math.inf, LEAST * input_.size) for input_ in self.inputs]
        self.closed: Optional[InverseLinkage] = (
            taken_apart if linkage.axes == 'xy' else rods_taken_apart)(linkage, outputs)
        if self.closed:
            # For each mode: 1 if it is an answer, 0 if not, NaN if that is to be looked at closer;
            # the inputs and rates.
            self._rows = self._judged_modes(self.closed)
            self._row = 1 + self._n * (self._n + 1)
            self._solve = linkage.bind(Program(self._rows, self._n, self.closed.given))
        else:
            self._search = search_for(linkage, outputs, self.inputs, self._rounds)

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
        """Return an input with the period of the outputs, where its own has too many turns."""
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
        rows = zip(self._check.over(*inputs), self._angular, self._scales)
        return np.concatenate([[np.cos(row), np.sin(row)] if angular else [row / scale]
                               for row, angular, scale in rows])

    # All answers.

    def all(self, values: ArrayLike, near: Optional[ArrayLike] = None) -> List[Answer]:
        """
        Return all answers for one value of each output.

        Parameters
        ----------
        values : float or array-like (outputs,)
            What the outputs are to be [rad or m], angles with whole turns aside, an input that is
            held with whole periods.
        near : array-like (inputs,), optional
            Values of the inputs [rad or m] to which the answers are brought by whole turns, the
            nearest first, a length being counted in parts of about its stroke.

        Returns
        -------
        list of Answer
            Those of the linkage's own assembly, its `branches`, inside its reach; without `near`
            crank angles in [-pi, pi), the first input's ascending; [] where the outputs cannot be
            had. Of answers that rounding does not tell apart one is given.

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
        Return all answers for arrays of values, one array for each output.

        Returns
        -------
        (array (inputs, *shape, answers), array (outputs * inputs, *shape, answers))
            The inputs, the first ascending, filled up with NaN; and the rate of each output by the
            first input, by the second and so on.

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
        """Return inputs in order, each with d output / d input row by row, for one question."""
        if not all(map(math.isfinite, values)):
            return []
        values = self._reduced(values)
        if not self.closed:
            return self._distinct(_columns(*self._searched(np.array(values)[:, None])))
        found, n = [], 1 + self._n
        for mode, row in enumerate(self._at(values)):
            if row[0] == 1.0:
                found.append((row[1:n], row[n:]))
            elif row[0] != row[0] and (own := self._own(mode, row[1:n], values)):
                found.append(own)
        return self._distinct(found) if len(found) > 1 else found

    def _at(self, values: Sequence[float]) -> List[Tuple[float, ...]]:
        """Return what each assembly mode has to say of values; see `_judged`."""
        flat, size = self._solve.at(*values), self._row
        return [flat[start:start + size] for start in range(0, len(flat), size)]

    def _judged_modes(self, closed: InverseLinkage) -> List[Real]:
        """Return what all modes answer, held to the forward formula and polished by it."""
        n, structure, parts = self._n, self.linkage.structure, []
        if n == 2 and closed.is_own:
            return [part for mode in closed.modes for part in self._own_mode(mode)]
        limits = [limit for limit in structure.built.limits if limit.margin.varies]
        forward = [*structure.checked(self.outputs), *(limit.margin for limit in limits)]
        for mode in closed.modes:
            for turns in product(*closed.turns):
                inputs = [value + turn for value, turn in zip(mode.inputs, turns)]
                # What outputs say of a linkage's inputs the inverse's say by their place.
                row = substituted(forward, inputs)
                answer = self._judged(inputs, row[:n], row[n:n + n * n], [
                    margin + FAR * limit.tolerance
                    for margin, limit in zip(row[n + n * n:], limits)])
                parts += [*answer, *(_inverse(mode.rates) if n < 3 else row[n:n + n * n])]
        return parts

    def _own_mode(self, mode: Mode) -> List[Real]:
        """Return the inputs of a mode that need not be held to the forward formula, and rates."""
        return [where(abs(sum(mode.inputs, real(0.0))) < LARGE, 1.0, 0.0),
                *map(self._counted, range(self._n), mode.inputs), *_inverse(mode.rates)]

    def _judged(self, inputs: Sequence[Real], reached: Sequence[Real], rates: Sequence[Real],
                margins: Sequence[Real]) -> List[Real]:
        """Return whether inputs are an answer, and these after a step of Newton's method."""
        n, gaps, det = self._n, [], self._determinant(rates)
        size = math.prod(self._scales) / math.prod(self._sizes)
        verdict = real(1.0) if det is None else where(
            NEIGHBOURS * size < abs(det), 1.0, math.nan)
        # At an end of the reach outputs may be NaN, not where a limit is missed by far.
        other = reduce(lambda unknown, margin: where(margin < 0.0, 0.0, unknown), margins, where(
            abs(inputs[0]) < LARGE, math.nan, 0.0))
        for i, (turn, scale) in enumerate(zip(self._rounds, self._scales)):
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
        """Return an input as it is counted: an angle in the turns from -pi, zero without sign."""
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
        """Return the steps of Newton's method where outputs tell inputs well, elsewhere 0."""
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
        """Return values with angles beyond a turn within one: sine and cosine lose no digit."""
        return tuple(float(_within_turn(x, turn)) if abs(x) > turn else x
                     for x, turn in zip(values, self._rounds))

    def _own(self, mode: int, inputs: Tuple[float, ...], values: Sequence[float],
             within: bool = True) -> Optional[Found]:
        """Return inputs that a mode gives, and rates, if the linkage has its outputs there."""
        n, at, slack = self._n, self._check.at, ROUNDING
        row = at(*inputs)
        if row[0] != row[0] or n > 1 and any(x != x for x in row[1:n]):
            # The reach ends here, but for rounding.
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
        Return rates, next to an end of the reach those of the mode, None beyond it.

        There rounding of the inputs moves outputs by far more than rounding. Beyond it the mode
        has its dyads on other sides than the linkage: the inputs turn back, and their rates have
        the other sign.
        """
        n, closed = self._n, cast(InverseLinkage, self.closed)
        if np.abs(self._jacobian(rates)).max() < (STEEP if n > 1 else 1.0):
            return rates
        if not np.isfinite(rates).all():
            rows = (self._check.at(*beside) for beside in self._beside(inputs))
            rates = next((row[n:] for row in rows if np.isfinite(row).all()), rates)
        mode //= math.prod(map(len, closed.turns))
        pose = self._programs.get_or_make(('rates', mode), lambda: self.linkage.bind(Program(
            [*chain(*closed.modes[mode].rates)], n, closed.given)))
        turning = np.reshape(pose.at(*values), (n, n))
        with np.errstate(invalid='ignore'):
            # The identity but for rounding; each dyad on its other side turns a sign.
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
        """Yield inputs that differ by rounding, one a little."""
        for i, size in enumerate(self._sizes):
            for step in (BESIDE * size, -BESIDE * size):
                yield (*inputs[:i], inputs[i] + step, *inputs[i + 1:])

    def _missed(self, row: Sequence[float], inputs: Sequence[float], values: Sequence[float],
                slack: float) -> Tuple[List[float], bool, float]:
        """Return what outputs miss, whether that is rounding, and the most, in their sizes."""
        n, gaps, sure, most = self._n, [], True, 0.0
        for i, (value, turn, scale) in enumerate(zip(values, self._rounds, self._scales)):
            gap = row[i] - value
            if gap - gap == 0.0:
                gap = math.remainder(gap, turn)
            gaps.append(gap)
            away, allowed, own = abs(gap), ROUNDING * scale, 0.0
            if not away <= allowed:
                for rate, x, size in zip(row[n + i::n], inputs, self._sizes):
                    allowed += slack * abs(rate) * max(size, abs(x))
                    # Next to a dead point the last digit of an input may be worth more than that.
                    own += 2.0 ** -52 * abs(rate) * abs(x)
                own = min(own, OTHER * scale) if own < math.inf else 0.0
                sure = sure and away <= max(min(allowed, ENDED * scale), own)
            if not away / scale <= most:
                most = away / scale
        return gaps, sure, most

    def _stepped(self, inputs: Tuple[float, ...], rates: Sequence[float],
                 gaps: Sequence[float]) -> Tuple[float, ...]:
        """Return inputs after a step of Newton's method; NaN where there is none."""
        if self._n == 1:
            return (inputs[0] - gaps[0] / rates[0] if rates[0] else math.nan,)
        try:
            steps = np.linalg.solve(np.reshape(rates, (self._n, self._n)).T, gaps)
        except np.linalg.LinAlgError:
            return (math.nan,)
        return tuple(x - step for x, step in zip(inputs, steps.tolist()))

    def _within(self, inputs: Sequence[float]) -> Tuple[float, ...]:
        """Return inputs as they are counted: angles in the turns from -pi."""
        found = []
        for x, (half, turn, least) in zip(inputs, self._turned):
            if not -half <= x < half:
                x -= turn * math.floor(x / turn + 0.5)
            found.append(0.0 if -least < x < least else x)
        return tuple(found)

    def _distinct(self, found: Sequence[Found]) -> List[Found]:
        """Return answers in order, without those that rounding does not tell from another."""
        kept: List[Found] = []
        for answer in sorted(found):
            if not any(self._are_one(answer, other) for other in kept):
                kept.append(answer)
        return kept

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
        """Return d outputs / d inputs, both in their sizes, from rates by each input."""
        return (np.reshape(rates, (self._n, self._n)).T * self._sizes
                / np.reshape(self._scales, (-1, 1)))

    def _found(self, values: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """
        Return all answers for values (outputs, questions), in no order, NaN where there is none.

        Their shapes are (answers, inputs, questions) and (answers, inputs * outputs, questions).
        Answers that rounding does not tell from one another are all given.
        """
        values = self._within_turns(values)
        if not self.closed:
            return self._searched(values)
        n, count = self._n, values.shape[1]
        rows = self._solve.over(*values).reshape(-1, self._row, count) if count else np.empty(
            (1, self._row, 0))
        if not (rows[:, 0] == 1.0).all():
            for mode, place in zip(*np.nonzero(np.isnan(rows[:, 0]))):
                own = self._own(mode, tuple(rows[mode, 1:n + 1, place].tolist()),
                                tuple(values[:, place].tolist()))
                rows[mode, :, place] = (1.0, *own[0], *own[1]) if own else 0.0
            rows.swapaxes(0, 1)[:, rows[:, 0] == 0.0] = np.nan
        return rows[:, 1:n + 1], rows[:, n + 1:]

    def _within_turns(self, values: np.ndarray) -> np.ndarray:
        """Return values (outputs, questions) as `_reduced` does; NaN what is not finite."""
        near = np.abs(values) <= math.tau
        if near.all():
            return values
        values = np.where(np.isfinite(values), values, np.nan)
        for row, turn in zip(values, self._rounds):
            far = np.abs(row) > turn
            row[far] = _within_turn(row[far], turn)
        return values

    def _single(self, inputs: np.ndarray, rates: np.ndarray) -> None:
        """Make NaN what rounding does not tell from another answer."""
        doubtful = np.zeros(inputs.shape[2], bool)
        for one, two in combinations(inputs, 2):
            away = self._away(one, two)
            with np.errstate(invalid='ignore'):
                doubtful |= away <= self._n * NEIGHBOURS ** 2
        for place in np.flatnonzero(doubtful):
            here = inputs[:, :, place], rates[:, :, place]
            kept = self._distinct([(tuple(x), tuple(r)) for x, r in zip(
                *(part.tolist() for part in here)) if x[0] == x[0]])
            for part, each in zip(here, zip(*kept)):
                part[:] = np.nan
                part[:len(kept)] = each

    def _away(self, inputs: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Return the squares of how far inputs (inputs, ...) are from others, in their sizes."""
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
        found = numbers(name, values)
        if found.shape != (self._n,) and not (self._n == 1 and found.shape == ()):
            raise ValueError(f'{self.linkage.type} has {self._n} inputs: {name} must be as many '
                             f'numbers, got {quoted(found.tolist())}')
        return tuple(found.ravel().tolist())

    # One of the answers.

    def nearest(self, values: Sequence[Any], near: Optional[Sequence[Any]] = None,
                ends: Ends = None) -> Tuple[Any, Any]:
        """
        Return one answer.

        Parameters
        ----------
        values : sequence of float or array
            What each output is to be [rad or m].
        near : sequence of float or array, optional
            The answer nearest to these inputs is taken, whole turns included, a length being
            counted in parts of about its stroke. Default: of one input the least with which the
            output grows, else the least: that is the working branch of a lever, on which lever
            and crank turn the same way. Of several inputs the one whose first is the least.
        ends : sequence of (float, float) or None, optional
            For each input the lowest and the highest value [rad or m] that may be taken.

        Returns
        -------
        (tuple of float or array, tuple of float or array)
            The inputs, and the rate of each output by the first input, by the second and so on;
            NaN where there is none.

        """
        limits = tuple(ends or (None,) * self._n)
        near = None if near is None else tuple(near)
        given = (*values, *(near or ()), *(float(end) for pair in limits if pair for end in pair))
        if not self.closed:
            return self._chosen(self._each(values), near, limits)[1:]
        choose = self._choice(0, near is not None, tuple(map(bool, limits)))
        if set(map(type, given)) == {float}:
            rank, *found = choose.at(*given)
            if rank != rank:
                return self._chosen(self._all(tuple(values)), near, limits)[1:]
            return tuple(found[:self._n]), tuple(found[self._n:])
        arrays = np.broadcast_arrays(*given)
        flat = np.stack([each.ravel() for each in arrays])
        flat[:self._n] = self._within_turns(flat[:self._n])
        rows = choose.over(*flat)
        for place in np.flatnonzero(np.isnan(rows[0])):
            one = flat[:2 * self._n, place].tolist()
            rows[1:, place] = [*chain(*self._chosen(
                self._all(tuple(one[:self._n])), near and one[self._n:], limits)[1:])]
        found = [row.reshape(arrays[0].shape) for row in rows[1:]]
        return tuple(found[:self._n]), tuple(found[self._n:])

    def path(self, values: Sequence[np.ndarray], near: Optional[Sequence[float]] = None,
             ends: Ends = None) -> Tuple[Any, Any]:
        """
        Return the answers that go on from value to value: each is the nearest to the last.

        Parameters
        ----------
        values : sequence of array (n,)
            What each output is to be, one after the other [rad or m].
        near, ends
            As for `nearest`, for the first value; a value that cannot be had is passed over.

        Returns
        -------
        (tuple of array (n,), tuple of array (n,))
            As `nearest` does.

        """
        inputs, rates = self._found(np.array(values, float))
        limits, beside = tuple(ends or (None,) * self._n), near and tuple(np.ravel(near).tolist())
        found = np.full((self._n + self._n ** 2, inputs.shape[2]), np.nan)
        breaks: Dict[int, np.ndarray] = {}
        at, known = 0, np.flatnonzero(self._may_be_taken(inputs, limits))
        while (k := int(known.searchsorted(at))) < len(known):
            at = int(known[k])
            answers = [(tuple(x), tuple(r)) for x, r in zip(inputs[:, :, at].tolist(), rates[
                :, :, at].tolist())]
            rank, place, rate = self._chosen(answers, beside, limits)
            if place[0] != place[0]:
                at += 1
                continue
            mode = int(rank)
            if mode not in breaks:
                breaks[mode] = self._breaks(inputs, mode)
            stop = min(int(breaks[mode][breaks[mode].searchsorted(at)]) + 1, at + BLOCK)
            places = self._going_on(inputs[mode, :, at:stop], place, limits)
            stop = at + places.shape[1]
            found[:self._n, at:stop], found[self._n:, at:stop] = places, rates[mode, :, at:stop]
            at, beside = stop, tuple(places[:, -1].tolist())
        return tuple(found[:self._n]), tuple(found[self._n:])

    def _may_be_taken(self, inputs: np.ndarray, limits: Sequence) -> np.ndarray:
        """Return for each question whether an answer may lie between the ends."""
        may = inputs[:, 0] == inputs[:, 0]
        for by, (pair, (_, turn, _), size) in enumerate(zip(limits, self._turned, self._sizes)):
            if pair:
                # What is beyond by more than this no rounding of an output takes to the end.
                low, high = (end + side * NEIGHBOURS * (size + abs(end))
                             for end, side in zip(pair, (-1.0, 1.0)))
                first = inputs[:, by] + (turn * np.ceil((low - inputs[:, by]) / turn)
                                         if math.isfinite(turn) else 0.0)
                may &= (low <= first) & (first <= high)
        return may.any(axis=0)

    def _breaks(self, inputs: np.ndarray, mode: int) -> np.ndarray:
        """Return after which questions another answer is nearer than that of the same mode."""
        away = self._away(inputs.swapaxes(0, 1)[:, :, 1:], inputs[mode, :, None, :-1])
        own = away[mode].copy()
        away[mode] = np.inf
        return np.append(np.flatnonzero(~(own < np.fmin.reduce(away))), inputs.shape[2] - 1)

    def _going_on(self, inputs: np.ndarray, start: Sequence[float], limits: Sequence
                  ) -> np.ndarray:
        """Return inputs that go on from a start, whole turns included, as far as they may."""
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

    def _each(self, values: Sequence[Any]) -> Sequence[Any]:
        """Return all answers, floats for floats and arrays for arrays."""
        if set(map(type, values)) == {float}:
            return self._all(tuple(values))
        inputs, rates = self.over(*values)
        return [(inputs[..., k], rates[..., k]) for k in range(inputs.shape[-1])]

    def _chosen(self, answers: Sequence[Any], near: Optional[Sequence[Any]],
                limits: Sequence) -> Tuple[Any, Any, Any]:
        """Return which of some answers is chosen, its inputs and its rates."""
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
        Return the code that chooses one of some answers, or for 0 that of the modes.

        Given are the answers, each its inputs and rates, or the values; then, if so, the inputs
        that the answer is to be nearest to, and for each that is to lie between ends, these. What
        is beyond an end by so little that the outputs do not tell is at the end. Before the answer
        its number is returned, NaN where a mode is to be looked at closer.
        """
        n, size = self._n, self._n + self._n ** 2
        total = (count * size or n) + n * follows + 2 * sum(ended)
        given = list(map(argument, range(total)))
        values, given = given[:count * size or n], given[count * size or n:]
        near, ends = given[:n] if follows else [], iter(given[n * follows:])
        limits = [(next(ends), next(ends)) if each else () for each in ended]
        rows = [[where(values[i] <= values[i], 1.0, 0.0), *values[i:i + size]] for i in range(
            0, count * size, size)] or [self._rows[i:i + size + 1] for i in range(
                0, len(self._rows), size + 1)]
        unknown = reduce(lambda found, row: where(row[0] <= 1.0, found, math.nan), rows, real(0.0))
        for value, turn in zip(values, () if count else self._rounds):
            if math.isfinite(turn):
                unknown = unknown + where(abs(value) <= turn, 0.0, math.nan)
        choices = []
        for rank, (verdict, *row) in enumerate(rows):
            places, misses = zip(*(self._place(by, row, near, limit)
                                   for by, limit in enumerate(limits)))
            if follows:
                order = [square_root(sum((square((x - y) / size) for x, y, size in zip(
                    places, near, self._sizes)), real(0.0)))]
            else:
                order = [where(row[1] < 0.0, 1.0, 0.0) if n == 1 else real(0.0), *row[:n]]
            order[0] = reduce(lambda far, miss: where(miss, math.inf, far), chain(*misses),
                              where(0.5 < verdict, order[0], math.inf))
            choices.append([*order, real(float(rank)), *places, *row[n:]])
        many = len(choices[0]) - 1 - size
        best = reduce(lambda best, other: [where(
            _before(other[:many], best[:many]), mine, its) for mine, its in zip(
                other, best)], choices)
        return self.linkage.bind(Program([best[many] + unknown, *(
            gated(part, LARGE - best[0], 0.0) for part in best[many + 1:])], total,
            self.closed.given if self.closed and not count else {}))

    def _place(self, by: int, row: Sequence[Real], near: Sequence[Real],
               ends: Sequence[Real]) -> Tuple[Real, List[Real]]:
        """Return where an input is chosen, whole turns aside, and what tells that it is not."""
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
        Return the answer that goes on from where the inputs were without a jump.

        Parameters
        ----------
        values : array-like (outputs,)
            What the outputs are to be [rad or m].
        near : array-like (inputs,)
            Where the inputs were [rad or m]; whole turns of a crank are kept.

        Returns
        -------
        (tuple of float, tuple of float)
            The inputs that outputs lead to which go straight from what they were to what is asked
            for, angles the shorter way; and the rate of each output by the first input, by the
            second and so on. NaN where that would pass a dead point, or leave the reach.

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
        """Return what the mode that the inputs are in leads to."""
        start = self._check.at(*near)[:self._n]
        if any(x != x for x in start):
            return None
        gaps = [math.remainder(value - now, turn)
                for value, now, turn in zip(values, start, self._rounds)]
        steps = math.ceil(max(abs(gap) / scale for gap, scale in zip(gaps, self._scales)) / STEP)
        at = {mode: near for mode, place in self._modes(start, near)
              if max(abs(x - y) / size for x, y, size in zip(place, near, self._sizes)) < ALIKE}
        found: List[Found] = []
        for k in range(1, max(steps, 1) + 1):
            aim = values if k == max(steps, 1) else tuple(
                now + k / steps * gap for now, gap in zip(start, gaps))
            going, found = at, []
            places = dict(self._modes(aim, near))
            at = {}
            for mode, last in going.items():
                if (place := places.get(mode)) and (own := self._own(
                        mode, self._next_to(place, last), aim, False)):
                    at[mode] = own[0]
                    found.append(own)
        return min(found, key=lambda own: math.dist(own[0], near)) if found else None

    def _modes(self, values: Sequence[float], near: Sequence[float]
               ) -> Iterator[Tuple[int, Tuple[float, ...]]]:
        """Yield what each assembly mode answers that has an answer, next to other inputs."""
        for mode, row in enumerate(self._at(values)):
            inputs = row[1:self._n + 1]
            if not any(x != x for x in inputs):
                yield mode, self._next_to(inputs, near)

    def _next_to(self, inputs: Sequence[float], near: Sequence[float]) -> Tuple[float, ...]:
        return tuple(x + input_.turn * round((y - x) / input_.turn) if input_.turns else x
                     for input_, x, y in zip(self.inputs, inputs, near))

    # The search for what does not come apart.

    def _searched(self, values: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return all answers as `_found` does."""
        inputs = self._search.answers(values)
        rates = self._rated.over(*inputs.swapaxes(0, 1))[self._n:].swapaxes(0, 1)
        return inputs, rates

    # The working mode.

    def margin(self, inputs: Sequence[float]) -> float:
        """Return how far from singular a pose is; see `Answer.margin`."""
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
    """Return the answers to one question, of arrays."""
    found = [(tuple(row), tuple(rate)) for row, rate in zip(
        inputs[:, :, 0].tolist(), rates[:, :, 0].tolist()) if row[0] == row[0]]
    return sorted(found)


def _inverse(rates: Sequence[Sequence[Real]]) -> List[Real]:
    """Return d output / d input, by each input, of the rates of up to two inputs by outputs."""
    if len(rates) == 1:
        return [1.0 / rates[0][0]]
    (a, b), (c, d) = rates
    det = a * d - b * c
    return [d / det, -c / det, -b / det, a / det]


def _greater(x: Real, y: Real) -> Real:
    return where(x < y, y, x)


def _rounded(values: np.ndarray) -> np.ndarray:
    """Round an array that is used no more in place: to the nearest integers."""
    return cast(np.ndarray, np.rint(values, out=values))


def _before(one: Sequence[Real], other: Sequence[Real]) -> Real:
    """Return whether numbers come before others, the first that differ telling."""
    (x, *rest), (y, *others) = one, other
    return 0.5 < where(x < y, 1.0, where(y < x, 0.0, where(_before(rest, others), 1.0, 0.0))) \
        if rest else x < y
