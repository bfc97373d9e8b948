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
Solve an inverse in closed form: each assembly mode of the inverse linkage, checked.

The forward formula selects the modes of the linkage itself: at a solution the outputs have the
given values up to rounding, each dyad is on its side, and the inputs are inside the reach. For a
single value only the modes that can be assembled are checked; for arrays one program has all.
"""

from __future__ import annotations

from functools import cached_property, reduce
from itertools import chain, product
import math
import operator
from typing import Iterator, List, Optional, Sequence, Tuple

import numpy as np

from .inverse_linkage import InverseLinkage
from .inverse_problem import Found, InverseProblem, LARGE, NEIGHBOURS
from .planar import TOLERANCE
from ..cache import Cache
from ..formula.expression import (
    argument,
    greater,
    nearest_integer,
    Real,
    real,
    substituted,
    where,
)
from ..formula.program import Pose, Program

# Bound of an output's rounding error through both formulas, as a part of the output's size.
ROUNDING = 32 * 2.0 ** -53
# Where the forward formula has no value, the reach may end: it is evaluated this far to each side
# of a solution [rad, sizes], the farther the less an output tells about the input.
BESIDE = 16 * 2.0 ** -52 * math.pi, 1024 * 2.0 ** -52 * math.pi
# Next to an end of the reach rates are unbounded: the error allowed for an output there, as a part
# of its size, and the rate from which on that error is allowed.
ENDED, STEEP = 1e-7, 1e4
# Rate from which on the forward formula's have lost a tenth of their value.
STEEPEST = 1e7
# Below this rate by the outputs the inputs are at an end, where rounding decides about the side.
END = 1e-13
# A larger error than this part of the output's size belongs to another assembly.
OTHER = 1e-2
# A margin below minus this many tolerances, a thousandth of its size, is outside the reach.
FAR = 1e-3 / TOLERANCE
# Distance of neighbouring values where a mode's equal bars lie on each other [rad, sizes].
KITE = 1e-9
# Newton steps at most that remove a closed form's rounding; each doubles the number of digits.
POLISHING = 5
# A longer step leads to another solution [rad, sizes].
LONGEST = 0.1
# An error up to this multiple of the noise of an output is rounding, and this part of its size.
NOISY, MOST_NOISE = 16.0, 1e-9
# Below this rate the inputs are ill-conditioned, and a Newton step does not improve them.
SOUND = 0.1
# Largest step of an output while it is followed, as a part of its size; and the distance below
# which a mode is the one that the inputs are in [rad, sizes], or the part of its rates.
STEP, ALIKE = 0.3, 1e-5


class ClosedForm:
    """The solutions of a problem whose inverse linkage decomposes into dyads."""

    def __init__(self, problem: InverseProblem, inverse: InverseLinkage):
        self._problem, self._inverse, self._linkage = problem, inverse, problem.linkage
        self._n, self._programs = len(problem.outputs), Cache()
        # Where all modes are the linkage's own nothing is checked, and nothing else has the rates.
        self._is_own = inverse.is_own and self._n == 2
        self._row = self._n * (1 + self._n if self._is_own or self._n == 1 else 1)
        # Two equal bars may lie on each other, in a direction that only neighbouring values have.
        lines = map(str.split, inverse.lines)
        self.has_kite = self._n == 1 and any(
            word == 'dyad' and args[2] == args[3] for _, word, *args in lines)

    def solutions(self, values: Tuple[float, ...]) -> Iterator[Found]:
        """Yield the solutions for finite values, those that differ by rounding included."""
        n = 1 + self._n
        rows = list(self._assembled(values))
        for mode, row in rows or self.has_kite and self._next_to_kite(values) or ():
            verdict = (1.0, *row) if self._is_own else self._check.at(*values, *row)
            if verdict[0] == 1.0:
                yield verdict[1:n], verdict[n:]
            elif verdict[0] != verdict[0] and (own := self._confirmed(mode, verdict[1:n], values)):
                yield own

    def over(self, values: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """
        Return the solutions for values (outputs, n), NaN where there are fewer.

        Their shapes are (modes, inputs, n) and (modes, inputs * outputs, n).
        """
        n, count = self._n, values.shape[1]
        found = self._checked_modes.over(*values).reshape(len(self._rows), 1 + n + n * n, count)
        for mode, place in zip(*np.nonzero(np.isnan(found[:, 0]))):
            own = self._confirmed(int(mode), tuple(found[mode, 1:n + 1, place].tolist()),
                                  tuple(values[:, place].tolist()))
            found[mode, 1:, place] = [*own[0], *own[1]] if own else math.nan
        return found[:, 1:n + 1], found[:, n + 1:]

    def follow(self, values: Tuple[float, ...], near: Tuple[float, ...]) -> Found:
        """Return the end of the motion in the mode of the present inputs."""
        problem, nothing = self._problem, ((math.nan,) * self._n, (math.nan,) * self._n ** 2)
        start = problem.forward.at(*near)[:self._n]
        if any(x != x for x in start):
            return nothing
        gaps = [math.remainder(value - now, turn)
                for value, now, turn in zip(values, start, problem.periods)]
        steps = math.ceil(min(LARGE, max(abs(gap) / scale for gap, scale in zip(
            gaps, problem.scales))) / STEP)
        # In all turns of its inputs a mode is the same; which of them goes on is the nearest.
        turns = math.prod(map(len, self._inverse.turns))
        at = {mode // turns: near for mode, place in self._modes_near(start, near)
              if max(abs(x - y) / size for x, y, size in zip(place, near, problem.sizes)) < ALIKE}
        found: List[Found] = []
        for k in range(1, max(steps, 1) + 1):
            if not at:
                return nothing
            aim = values if k == max(steps, 1) else tuple(
                now + k / steps * gap for now, gap in zip(start, gaps))
            going, found = at, []
            places = list(self._modes_near(aim, near))
            at = {}
            for own, last in going.items():
                beside = [(problem.next_to(place, last), mode) for mode, place in places
                          if mode // turns == own]
                place, mode = min(beside, key=lambda x: math.dist(x[0], last), default=(None, 0))
                if place and (answer := self._confirmed(mode, place, aim, False)):
                    at[own] = answer[0]
                    found.append(answer)
        return min(found, key=lambda own: math.dist(own[0], near)) if found else nothing

    def _modes_near(self, values: Sequence[float], near: Sequence[float]
                    ) -> Iterator[Tuple[int, Tuple[float, ...]]]:
        """Yield number and inputs of each mode that can be assembled, nearest to others."""
        for mode, row in self._assembled(values):
            yield mode, self._problem.next_to(row[:self._n], near)

    def _assembled(self, values: Sequence[float]) -> Iterator[Tuple[int, Tuple[float, ...]]]:
        """Yield number and row of each assembly mode that has inputs; see `_rows`."""
        flat, size = self._modes.at(*values), self._row
        for mode, start in enumerate(range(0, len(flat), size)):
            row = flat[start:start + size]
            if -LARGE < sum(row[:self._n]) < LARGE:
                yield mode, row

    def _next_to_kite(self, values: Sequence[float]) -> List[Tuple[int, Tuple[float, ...]]]:
        """Return the modes at neighbouring values, from where Newton's method leads to these."""
        step = KITE * self._problem.scales[0]
        return [*self._assembled((values[0] + step,)), *self._assembled((values[0] - step,))]

    @cached_property
    def _rows(self) -> List[List[Real]]:
        """
        Return a row of expressions of the outputs for each assembly mode, in each of its turns.

        It has the inputs and, of one input or where all modes are solutions, the rates of the
        mode: those of one input are exact next to a dead point, too.
        """
        closed = self._inverse
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

        It is 1 if the row is a solution, 0 if not, NaN if `_confirmed` has to decide; then the
        inputs, more exact, and the rates: NaN if it is none.
        """
        n, structure = self._n, self._linkage.structure
        row = [argument(n + i) for i in range(self._row)]
        inputs = row[:n]
        if self._is_own:
            return [real(1.0), *row]
        limits = [limit for limit in structure.built.limits if limit.margin.varies]
        forward = substituted([*structure.checked(self._problem.outputs), *(
            limit.margin + FAR * limit.tolerance for limit in limits)], inputs)
        rates = forward[n:n + n * n]
        verdict, *answer = self._judged(inputs, forward[:n], rates, forward[n + n * n:])
        # Another mode may pass through the same inputs, at another rate.
        rates = [where(abs(own - rate) <= ALIKE * abs(rate), own, rate)
                 for own, rate in zip(row[n:], rates)] or rates
        return [verdict, *(where(verdict <= 0.5, math.nan, each) for each in (*answer, *rates))]

    def _program(self, outputs: Sequence[Real], arguments: int) -> Pose:
        """Return the code for expressions of the outputs and of further arguments."""
        return self._linkage.bind(Program(outputs, arguments, self._inverse.arguments))

    @cached_property
    def _modes(self) -> Pose:
        """Return the code from the outputs to the rows of all modes."""
        return self._program([*chain(*self._rows)], self._n)

    @cached_property
    def _check(self) -> Pose:
        """Return the code from the outputs and a row to its verdict."""
        return self._program(self._verdict, self._n + self._row)

    @cached_property
    def checked_rows(self) -> List[List[Real]]:
        """Return the verdict of each mode, as expressions of the outputs."""
        values = list(map(argument, range(self._n)))
        return [substituted(self._verdict, [*values, *row]) for row in self._rows]

    @cached_property
    def _checked_modes(self) -> Pose:
        """Return the code from the outputs to the verdicts of all modes, for arrays."""
        return self._program([*chain(*self.checked_rows)], self._n)

    def _judged(self, inputs: Sequence[Real], reached: Sequence[Real], rates: Sequence[Real],
                margins: Sequence[Real]) -> List[Real]:
        """Return whether inputs are a solution, and the inputs after one Newton step."""
        n, gaps, det = self._n, [], self._determinant(rates)
        size = math.prod(self._problem.scales) / math.prod(self._problem.sizes)
        verdict = real(1.0) if det is None else where(
            NEIGHBOURS * size < abs(det), 1.0, math.nan)
        # Outputs may be NaN at an end of the reach, but not far outside it.
        other = reduce(lambda unknown, margin: where(margin < 0.0, 0.0, unknown), margins, where(
            abs(inputs[0]) < LARGE, math.nan, 0.0))
        for i, (turn, scale) in enumerate(zip(self._problem.periods, self._problem.scales)):
            gap = reached[i] - argument(i)
            if math.isfinite(turn):
                gap = gap - turn * nearest_integer(gap / turn)
            gaps.append(gap)
            other = where(NEIGHBOURS * scale < abs(gap), 0.0, where(
                abs(gap) <= NEIGHBOURS * scale, math.nan, other))
        for i, (gap, scale) in enumerate(zip(gaps, self._problem.scales)):
            speeds = [abs(rate) for rate in rates[i::n]]
            allowed = ROUNDING * (scale + sum((
                speed * where(abs(x) < size, size, abs(x))
                for speed, x, size in zip(speeds, inputs, self._problem.sizes)), real(0.0)))
            steepest = reduce(greater, map(operator.mul, speeds, self._problem.sizes))
            verdict = where(abs(gap) <= allowed, where(
                steepest <= STEEP * scale, verdict, math.nan), other)
        # Without an error, as beyond an end of the reach, there is no step.
        polished = [self._counted(by, x - where(abs(step) < LARGE, step, 0.0))
                    for by, (x, step) in enumerate(zip(inputs, self._steps(gaps, rates)))]
        return [verdict, *polished]

    def _counted(self, by: int, x: Real) -> Real:
        """Return an input, an angle within one period around zero, zero without sign."""
        half, turn, least = self._problem.turned[by]
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
        sound = SOUND * math.prod(self._problem.scales) / math.prod(self._problem.sizes) < abs(det)
        det = where(sound, det, math.inf)
        if self._n == 1:
            return [gaps[0] / det]
        return [(gaps[0] * rates[3] - gaps[1] * rates[2]) / det,
                (gaps[1] * rates[0] - gaps[0] * rates[1]) / det]

    def _confirmed(self, mode: int, inputs: Tuple[float, ...], values: Sequence[float],
                   within: bool = True) -> Optional[Found]:
        """Return the inputs of a mode and the rates if they are a solution, else None."""
        n, at, slack = self._n, self._problem.forward.at, ROUNDING
        row = at(*inputs)
        if any(x != x for x in row) and not self._missed(row, inputs, values, slack)[1]:
            # This is an end of the reach, up to rounding; it may have values and no rates.
            for far, beside in self._beside(inputs):
                other = at(*beside)
                if not any(x != x for x in other):
                    slack = far
                    row, inputs = (other, beside) if any(x != x for x in row[:n]) else (
                        (*row[:n], *other[n:]), inputs)
                    break
            else:
                return None
        last = math.inf
        for _ in range(POLISHING):
            gaps, sure, away = self._missed(row, inputs, values, slack)
            if sure or away > 0.5 * last and self._are_noise(gaps, inputs, row):
                rates = self._rates_at_end(mode, inputs, values, row[n:])
                return None if rates is None else (
                    self._within(inputs) if within else inputs, rates)
            if not away <= OTHER:
                break
            last = away
            before, inputs = inputs, self._stepped(inputs, row[n:], gaps)
            if not all(abs(x - y) <= LONGEST * size for x, y, size in zip(
                    inputs, before, self._problem.sizes)):
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
        n, closed, problem = self._n, self._inverse, self._problem
        is_steep = not all(abs(rate) * size < STEEP * scale for rate, (size, scale) in zip(
            rates, product(problem.sizes, problem.scales)))
        if n > 1 and not is_steep:
            return rates
        mode //= math.prod(map(len, closed.turns))
        pose = self._programs.get_or_make(('rates', mode), lambda: self._program(
            [*chain(*closed.modes[mode].rates)], n))
        rows = pose.at(*values)
        if not is_steep:
            return (1.0 / rows[0],) if abs(rows[0] * rates[0] - 1.0) <= ALIKE else rates
        turning = np.reshape(rows, (n, n))
        is_exact = bool(np.abs(problem.jacobian(rates)).max() < STEEPEST)
        if not np.isfinite(rates).all():
            others = (problem.forward.at(*beside) for _, beside in self._beside(inputs))
            rates = next((row[n:] for row in others if np.isfinite(row).all()), rates)
        with np.errstate(invalid='ignore'):
            # The identity up to rounding; a dyad on its other side turns a sign.
            both = turning @ np.reshape(rates, (n, n)).T
            if np.linalg.det(both) < 0.0 or (np.diag(both) < 0.0).any():
                sizes = np.divide.outer(problem.scales, problem.sizes).T
                return rates if np.linalg.svd(turning * sizes, compute_uv=False)[
                    -1] <= END else None
            if is_exact and not np.allclose(both, np.eye(n), atol=0.1):
                return rates  # another mode passes here
        try:
            with np.errstate(all='ignore'):
                found = 1.0 / turning if n == 1 else np.linalg.inv(turning)
        except np.linalg.LinAlgError:
            return rates
        return tuple(found.T.ravel().tolist())

    def _beside(self, inputs: Tuple[float, ...]) -> Iterator[Tuple[float, Tuple[float, ...]]]:
        """Yield how far, and inputs of which one differs by little more than rounding."""
        for far in BESIDE:
            for i, size in enumerate(self._problem.sizes):
                for step in (far * size, -far * size):
                    yield far, (*inputs[:i], inputs[i] + step, *inputs[i + 1:])

    def _missed(self, row: Sequence[float], inputs: Sequence[float], values: Sequence[float],
                slack: float) -> Tuple[List[float], bool, float]:
        """Return the outputs' errors, whether they are rounding, and the greatest by its size."""
        n, problem, gaps, sure, most = self._n, self._problem, [], True, 0.0
        for i, (value, turn, scale) in enumerate(zip(values, problem.periods, problem.scales)):
            gap = row[i] - value
            if gap - gap == 0.0:
                gap = math.remainder(gap, turn)
            gaps.append(gap)
            away, allowed, own = abs(gap), ROUNDING * scale, 0.0
            if not away <= allowed:
                for rate, x, size in zip(row[n + i::n], inputs, problem.sizes):
                    allowed += slack * abs(rate) * max(size, abs(x))
                    # Next to a dead point an ulp of an input may move the output by more.
                    own += 2.0 ** -52 * abs(rate) * abs(x)
                own = min(own, OTHER * scale) if own < math.inf else 0.0
                sure = sure and away <= max(min(allowed, ENDED * scale), own)
            if not away / scale <= most:
                most = away / scale
        return gaps, sure, most

    def _are_noise(self, gaps: Sequence[float], inputs: Tuple[float, ...],
                   row: Sequence[float]) -> bool:
        """Return whether errors are no larger than changes of the outputs next to the inputs."""
        n, periods, noise = self._n, self._problem.periods, [0.0] * self._n
        for k, (_, beside) in enumerate(self._beside(inputs)):
            by, other = k // 2 % n, self._problem.forward.at(*beside)
            for i, rate in enumerate(row[n + n * by:][:n]):
                # What the rate does not explain is rounding, as of the direction of a short arm.
                change = math.remainder(other[i] - row[i], periods[i]) if other[
                    i] == other[i] else 0.0
                noise[i] = max(noise[i], abs(change - rate * (beside[by] - inputs[by])))
        return all(abs(gap) <= min(NOISY * most, MOST_NOISE * scale)
                   for gap, most, scale in zip(gaps, noise, self._problem.scales))

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
        for x, (half, turn, least) in zip(inputs, self._problem.turned):
            if not -half <= x < half:
                x -= turn * math.floor(x / turn + 0.5)
            found.append(0.0 if -least < x < least else x)
        return tuple(found)


def _inverted(rates: Sequence[Sequence[Real]]) -> Sequence[Real]:
    """Return rates of outputs from those of inputs, of one or two."""
    if len(rates) == 1:
        return [1.0 / rates[0][0]]
    (a, b), (c, d) = rates
    det = a * d - b * c
    return [d / det, -c / det, -b / det, a / det]
