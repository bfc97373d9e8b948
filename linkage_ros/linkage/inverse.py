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

from functools import reduce
from itertools import chain, combinations, islice, product
import math
from typing import (
    Any,
    Iterator,
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

from .analysis import Analysis
from .arguments import numbers
from .curves import LEAST
from .inverse_linkage import InverseLinkage, taken_apart
from .inverse_rods import InverseRods, taken_apart as rods_taken_apart
from .planar import TOLERANCE
from .search import blocks, Search, SINGULAR
from ..cache import cached
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
# At an end of the reach, where rates have no bound, what that makes of an output, as a part.
ENDED = 1e-7
# What misses by more than this part of the output's size is the answer of another assembly.
OTHER = 1e-2
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
        The working mode.

        For each link that hangs on an input crank, by its name, the side to which it turns off
        from the line between the crank's joints, +1 left; and 'det', the sign of the determinant
        of d outputs / d inputs. 0 where that cannot be told.
        """
        return self.inverse.signs(self.inputs)

    @property
    def margin(self) -> float:
        """
        The least singular value of d outputs / d inputs by the greatest or 1.

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
        """The signs as text: 'AP+ CP- det-'."""
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

    """

    def __init__(self, linkage: Mechanism, outputs: Tuple[str, ...]):
        self.linkage, self.outputs = linkage, outputs
        if linkage.checked(outputs).shape:
            raise ValueError('the inverse is for one set of dimensions, not for arrays')
        blocks(linkage, outputs)
        self._n, self._inputs = len(outputs), linkage.inputs
        self._angular = [linkage.is_angle(name) for name in outputs]
        self._scales = [1.0 if angular else linkage.longest for angular in self._angular]
        self._sizes = [input_.size for input_ in linkage.inputs]
        # Of each input half a period, the period, and below what it is zero.
        self._turned = [(0.5 * input_.turn, input_.turn, LEAST) if input_.turns else
                        (math.inf, math.inf, LEAST * input_.size) for input_ in linkage.inputs]
        self._check = linkage.checked(outputs)
        self._rated = linkage.posed((), outputs, outputs)
        self.closed: Union[InverseLinkage, InverseRods, None] = (
            taken_apart if linkage.axes == 'xy' else rods_taken_apart)(linkage, outputs)
        if self.closed:
            # For each mode: 1 if it is an answer, 0 if not, between if that is to be looked at
            # closer; the inputs and rates.
            self._solve, self._row = linkage.bind(self._program(self.closed)), 1 + self._n * (
                self._n + 1)
        else:
            self._search: Any = Analysis(linkage).branches(*outputs) if self._n == 1 else Search(
                linkage, outputs)

    def __str__(self) -> str:
        what = listed(self.outputs)
        if not self.closed:
            return f'the inverse of {self.linkage.type} for {what} is searched'
        return f'# {self.linkage.type} driven by {what}\n{self.closed}'

    # All answers.

    def all(self, values: ArrayLike, near: Optional[ArrayLike] = None) -> List[Answer]:
        """
        Return all answers for one value of each output.

        Parameters
        ----------
        values : float or array-like (outputs,)
            What the outputs are to be [rad or m], angles with whole turns aside.
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
            return _columns(*self._searched(np.array(values)[:, None]))
        found, n = [], 1 + self._n
        for row in self._rows(values):
            if row[0] == 1.0:
                found.append((self._within(row[1:n]), row[n:]))
            elif row[0] > 0.0 and (own := self._own(row[1:n], values)):
                found.append(own)
        return self._distinct(found) if len(found) > 1 else found

    def _rows(self, values: Sequence[float]) -> List[Tuple[float, ...]]:
        """Return what each assembly mode has to say of values; see `_program`."""
        flat, size = self._solve.at(*values), self._row
        return [flat[start:start + size] for start in range(0, len(flat), size)]

    def _program(self, closed: Union[InverseLinkage, InverseRods]) -> Program:
        """Return the code for all modes, held to the forward formula and polished by it."""
        n, check, parts = self._n, self.linkage.structure.checked(self.outputs), []
        for mode in closed.modes:
            for turns in product(*closed.turns):
                inputs = [value + turn for value, turn in zip(mode.inputs, turns)]
                # What is wanted of a linkage's inputs is told of the inverse's by their place.
                row = substituted(check, inputs)
                parts += self._judged(inputs, row[:n], row[n:])
        return Program(parts, n, closed.given)

    def _judged(self, inputs: Sequence[Real], reached: Sequence[Real],
                rates: Sequence[Real]) -> List[Real]:
        """Return whether inputs are an answer, these after a step of Newton's, and their rates."""
        n, verdict, gaps, close = self._n, real(1.0), [], real(1.0)
        for i, (angular, scale) in enumerate(zip(self._angular, self._scales)):
            gap = reached[i] - argument(i)
            if angular and self.outputs[i] in self.linkage.structure.built.driven:
                # What is given is what is had, in whatever turn.
                gap = 0.0 * gap
            elif angular:
                gap = where(math.pi < gap, gap - math.tau, where(gap < -math.pi, gap + math.tau,
                                                                 gap))
            gaps.append(gap)
            allowed = ROUNDING * (scale + sum((
                abs(rate) * where(abs(x) < size, size, abs(x))
                for rate, x, size in zip(rates[i::n], inputs, self._sizes)), real(0.0)))
            verdict = where(abs(gaps[-1]) <= allowed, where(
                abs(gaps[-1]) <= ENDED * scale, verdict, 0.5), 0.5)
            close = where(OTHER * scale < abs(gaps[-1]), 0.0, close)
        return [verdict * gated(close, abs(inputs[0]), 0.0),
                *(x - step for x, step in zip(inputs, self._steps(gaps, rates))), *rates]

    def _steps(self, gaps: Sequence[Real], rates: Sequence[Real]) -> Sequence[Real]:
        """Return the steps of Newton's method where outputs tell inputs well, elsewhere 0."""
        if self._n > 2:
            return [real(0.0)] * self._n
        det = rates[0] if self._n == 1 else rates[0] * rates[3] - rates[1] * rates[2]
        sound = SOUND * math.prod(self._scales) / math.prod(self._sizes) < abs(det)
        det = where(sound, det, math.inf)
        if self._n == 1:
            return [gaps[0] / det]
        return [(gaps[0] * rates[3] - gaps[1] * rates[2]) / det,
                (gaps[1] * rates[0] - gaps[0] * rates[1]) / det]

    def _reduced(self, values: Tuple[float, ...]) -> Tuple[float, ...]:
        """Return values with angles beyond a turn within one: sine and cosine lose no digit."""
        return tuple(math.atan2(math.sin(x), math.cos(x)) if angular and abs(x) > math.tau else x
                     for x, angular in zip(values, self._angular))

    def _own(self, inputs: Tuple[float, ...], values: Sequence[float],
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
                return self._within(inputs) if within else inputs, row[n:]
            if not away <= OTHER:
                break
            inputs = self._stepped(inputs, row[n:], gaps)
            if any(x != x for x in inputs):
                break
            row = at(*inputs)
        return None

    def _beside(self, inputs: Tuple[float, ...]) -> Iterator[Tuple[float, ...]]:
        """Yield inputs that differ by rounding, one a little."""
        for i, size in enumerate(self._sizes):
            for step in (BESIDE * size, -BESIDE * size):
                yield (*inputs[:i], inputs[i] + step, *inputs[i + 1:])

    def _missed(self, row: Sequence[float], inputs: Sequence[float], values: Sequence[float],
                slack: float) -> Tuple[List[float], bool, float]:
        """Return what outputs miss, whether that is rounding, and the most, in their sizes."""
        n, gaps, sure, most = self._n, [], True, 0.0
        for i, (value, angular, scale) in enumerate(zip(values, self._angular, self._scales)):
            gap = row[i] - value
            if angular and gap - gap == 0.0:
                gap = math.remainder(gap, math.tau)
            gaps.append(gap)
            away, allowed = abs(gap), ROUNDING * scale
            if not away <= allowed:
                for rate, x, size in zip(row[n + i::n], inputs, self._sizes):
                    allowed += slack * abs(rate) * max(size, abs(x))
                sure = sure and away <= min(allowed, ENDED * scale)
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
        Return all answers for values (outputs, questions), in no order, filled up with NaN.

        Their shapes are (answers, inputs, questions) and (answers, inputs * outputs, questions).
        """
        values = np.where(np.isfinite(values), values, np.nan)
        if any(self._angular) and np.any(np.abs(values) > math.tau):
            values[self._angular] = np.arctan2(np.sin(values), np.cos(values))[self._angular]
        if not self.closed:
            return self._searched(values)
        n, count = self._n, values.shape[1]
        rows = self._solve.over(*values).reshape(-1, self._row, count) if count else np.empty(
            (1, self._row, 0))
        verdict, inputs, rates = rows[:, 0], rows[:, 1:n + 1].copy(), rows[:, n + 1:].copy()
        with np.errstate(invalid='ignore'):
            closer = (verdict > 0.0) & (verdict < 1.0)
        for mode, place in zip(*np.nonzero(closer & self._may_be(inputs, rows))):
            if own := self._own(tuple(inputs[mode, :, place].tolist()),
                                tuple(values[:, place].tolist())):
                inputs[mode, :, place], rates[mode, :, place] = own
                closer[mode, place] = False
        none = closer | ~(verdict > 0.0)
        return self._single(np.where(none[:, None], np.nan, inputs),
                            np.where(none[:, None], np.nan, rates))

    def _may_be(self, inputs: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Return what may be an answer: what can be assembled, or a little beside."""
        found = np.isfinite(rows[:, self._n + 1:]).all(axis=1)
        places = np.nonzero(~found & np.isfinite(inputs).all(axis=1))
        for beside in self._beside(tuple(inputs.swapaxes(0, 1)[:, places[0], places[1]])):
            found[places] |= np.isfinite(self._check.over(*beside)[:self._n]).all(axis=0)
        return found

    def _single(self, inputs: np.ndarray, rates: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return answers as they are counted, NaN what rounding does not tell from another."""
        for i, input_ in enumerate(self._inputs):
            inputs[:, i] = input_.wrapped(np.where(
                np.abs(inputs[:, i]) < LEAST * self._sizes[i], 0.0, inputs[:, i]))
        for one, two in combinations(range(len(inputs)), 2):
            with np.errstate(invalid='ignore'):
                apart = np.max([input_.apart(x, y) / size for input_, size, x, y in zip(
                    self._inputs, self._sizes, inputs[one], inputs[two])], axis=0)
                places = np.flatnonzero(apart <= NEIGHBOURS)
            for place in places:
                if self._are_one(*((tuple(inputs[k, :, place]), tuple(rates[k, :, place]))
                                   for k in (one, two))):
                    inputs[two, :, place] = rates[two, :, place] = np.nan
        return inputs, rates

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
        if set(map(type, (*values, *(near or ())))) == {float}:
            answers: Sequence[Any] = self._all(tuple(values))
        else:
            inputs, rates = self.over(*values)
            answers = [(inputs[..., k], rates[..., k]) for k in range(inputs.shape[-1])]
        return self._chosen(answers, near, ends)

    def _chosen(self, answers: Sequence[Any], near: Optional[Sequence[Any]],
                ends: Ends) -> Tuple[Any, Any]:
        n, sizes = self._n, self._sizes
        if not answers:
            return (math.nan,) * n, (math.nan,) * (n * n)
        limits = ends or (None,) * n
        choice = _choice(len(answers), tuple(input_.period * input_.turns for input_ in
                                             self._inputs), near is not None,
                         tuple(map(bool, limits)))
        found = choice(*chain.from_iterable(
            (*(x / size for x, size in zip(inputs, sizes)),
             *(rate * sizes[i // n] for i, rate in enumerate(rates)))
            for inputs, rates in answers),
            *(TOLERANCE * (math.pi if angular else scale)
              for angular, scale in zip(self._angular, self._scales)),
            *(x / size for x, size in zip(near or (), sizes)),
            *(end / size for pair, size in zip(limits, sizes) if pair for end in pair))
        return (tuple(x * size for x, size in zip(found[:n], sizes)),
                tuple(rate / sizes[i // n] for i, rate in enumerate(found[n:])))

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
        inputs, rates = self.over(*values)
        rows = np.concatenate([inputs, rates]).transpose(1, 2, 0)
        near = None if near is None else tuple(np.ravel(near).tolist())
        n, found = self._n, []
        for row in rows.tolist():
            answers = [(each[:n], each[n:]) for each in row if each[0] == each[0]]
            taken = self._chosen(answers, near, ends)
            if taken[0][0] == taken[0][0]:
                near = taken[0]
            found.append((*taken[0], *taken[1]))
        columns = np.reshape(found, (len(values[0]), n + n * n)).T
        return tuple(columns[:n]), tuple(columns[n:])

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
        if self._n > 1:
            inputs, jacobian = self._search.followed(np.array(near), np.array(values))
            return tuple(inputs.tolist()), tuple(jacobian.T.ravel().tolist())
        first = self._inputs[0]
        turns, size = first.turns_of(near[0]), self._sizes[0]
        found, rate = self._search.follow(self._rated.at, size, values[0], near[0] - turns)
        if self._search.is_one and first.is_whole(self.linkage.reach()):
            # The output turns all round with the crank: beyond pi they go on together.
            turns = float(first.beside(found, near[0])) - found
        return (found + turns,), (rate,)

    def _along(self, values: Tuple[float, ...], near: Tuple[float, ...]) -> Optional[Found]:
        """Return what the mode that the inputs are in leads to."""
        start = self._check.at(*near)[:self._n]
        if any(x != x for x in start):
            return None
        gaps = [math.remainder(value - now, math.tau) if angular else value - now
                for value, now, angular in zip(values, start, self._angular)]
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
                        self._next_to(place, last), aim, False)):
                    at[mode] = own[0]
                    found.append(own)
        return min(found, key=lambda own: math.dist(own[0], near)) if found else None

    def _modes(self, values: Sequence[float], near: Sequence[float]
               ) -> Iterator[Tuple[int, Tuple[float, ...]]]:
        """Yield what each assembly mode answers that has an answer, next to other inputs."""
        for mode, row in enumerate(self._rows(values)):
            inputs = row[1:self._n + 1]
            if not any(x != x for x in inputs):
                yield mode, self._next_to(inputs, near)

    def _next_to(self, inputs: Sequence[float], near: Sequence[float]) -> Tuple[float, ...]:
        return tuple(x + input_.turn * round((y - x) / input_.turn) if input_.turns else x
                     for input_, x, y in zip(self._inputs, inputs, near))

    # The search for what does not come apart.

    def _searched(self, values: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return all answers as `_found` does."""
        if self._n == 1:
            inputs = self._search.answers(values[0])[:, None] * self._sizes[0]
            rates = self._rated.over(inputs.ravel())[1].reshape(inputs.shape)
            return self._single(inputs, np.where(np.isnan(inputs), np.nan, rates))
        found = [self._search.answers(column) for column in values.T]
        most = max((len(each) for each in found), default=0)
        inputs = np.full((max(most, 1), self._n, len(found)), np.nan)
        for column, each in enumerate(found):
            inputs[:len(each), :, column] = each
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
                  if any(input_.turns and link.name == input_.name for input_ in self._inputs)}
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


def _sign(value: float, size: float) -> int:
    return int(np.sign(value)) if abs(value) > SINGULAR * size else 0


def _columns(inputs: np.ndarray, rates: np.ndarray) -> List[Found]:
    """Return the answers to one question, of arrays."""
    found = [(tuple(row), tuple(rate)) for row, rate in zip(
        inputs[:, :, 0].tolist(), rates[:, :, 0].tolist()) if row[0] == row[0]]
    return sorted(found)


@cached(256)
def _choice(count: int, periods: Tuple[int, ...], follows: bool, ended: Tuple[bool, ...]) -> Pose:
    """
    Return the code that takes one of some answers.

    Given are the answers, each its inputs and rates, the rounding of each output, then, if so, the
    inputs that the answer is to be nearest to, and for each that is to lie between ends, these.
    What is beyond an end by so little that the outputs do not tell is at the end. Inputs that turn
    are the same after so many turns.
    """
    n = len(periods)
    given = iter(map(argument, range(count * (n + n * n) + n + n * follows + 2 * sum(ended))))
    answers = [([*islice(given, n)], [*islice(given, n * n)]) for _ in range(count)]
    rounding, near = [*islice(given, n)], [*islice(given, n * follows)]
    ends = [(next(given), next(given)) if each else () for each in ended]
    choices = []
    for rank, (inputs, rates) in enumerate(answers):
        places, away = [], real(rank)
        if n == 1 and not follows:
            away = away + where(rates[0] < 0.0, float(count), 0.0)
        misses: List[Real] = []
        for j, (x, period) in enumerate(zip(inputs, periods)):
            speed = reduce(_greater, (abs(rate) / each for rate, each in zip(
                rates[n * j:n * j + n], rounding)))
            place, missed = _place(x, period * math.tau, near[j] if follows else None, ends[j],
                                   where(1.0 < CLOSE * speed, 1.0 / speed, CLOSE))
            places.append(place)
            misses += missed
        if follows:
            away = square_root(sum((square(x - y) for x, y in zip(places, near)), real(0.0)))
        away = reduce(lambda far, miss: where(miss, math.inf, far), misses, away)
        choices.append([where(inputs[0] <= inputs[0], away, math.inf), *places, *rates])
    away, *taken = reduce(lambda best, other: [
        where(other[0] < best[0], mine, its) for mine, its in zip(other, best)], choices)
    total = count * (n + n * n) + n + n * follows + 2 * sum(ended)
    return Program([gated(part, LARGE - away, 0.0) for part in taken], total).bind({}, {})


def _greater(x: Real, y: Real) -> Real:
    return where(x < y, y, x)


def _place(x: Real, turn: float, near: Optional[Real], ends: Sequence[Real],
           slack: Real) -> Tuple[Real, List[Real]]:
    """Return where an input is taken, whole turns aside, and what tells that it is not."""
    def beside(value: Real, other: Real) -> Real:
        return value + turn * nearest_integer((other - value) / turn) if turn else value

    place = x if near is None else beside(x, near)
    if not ends:
        return place, []
    slack = slack + ULPS * (4.0 + abs(ends[0]) + abs(ends[1]))
    low, high = ends[0] - slack, ends[1] + slack
    first, last = (beside(x, end) for end in ends)
    if turn:
        first = where(first < low, first + turn, first)
        last = where(high < last, last - turn, last)
    place = first if near is None else where(place < low, first, where(high < place, last, place))
    inside = where(place < ends[0], ends[0], where(ends[1] < place, ends[1], place))
    return inside, [place < low, high < place]
