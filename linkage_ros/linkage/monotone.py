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
Values of the only input at which any output has a given value.

The output is cut into branches on which it is monotone: at its extremes, at the ends of the reach,
and where the linkage passes a dead point. On a branch Newton's method inside a bracket finds the
input to the last digit.
"""

from __future__ import annotations

import math
from typing import Any, Callable, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from .curves import LEAST, refined, sampled, TURN_SAMPLES, turns
from .inputs import Arc, Input

# Solutions no farther apart than this [rad] are one.
CLOSE = 1e-13
# A larger step than this part of the output's range to the outermost sample of an arc is a break.
BROKEN = 1e-6
# Steps of the bracketed search at most: bisection alone needs one per bit of a float.
STEPS = 200
# A larger change than this part of half a turn, or of the output's range, between neighbouring
# floats of the input is a jump.
JUMP = 0.05
# A change by no more than this multiple of its rounding leaves an output constant.
STILL = 64.0
# Samples at the ends of an arc with more than this multiple of an output's rounding are noise.
NOISE = 1e9
# A larger error than this part of the output's range is a jump across the value, not a solution.
MISSED = 1e-9


def in_order(answers: np.ndarray, input_: Input) -> np.ndarray:
    """
    Return values of an input, shape (candidates, n), as shape (n, answers).

    Each row ascends without duplicates and is padded with NaN; angles are in [-pi, pi).
    """
    rows = np.sort(input_.wrapped(np.where(np.abs(answers) < LEAST, 0.0, answers)), axis=0)
    if len(rows) > 1:
        rows[1:][np.diff(rows, axis=0) <= CLOSE] = np.nan
        last = np.nanmax(rows, axis=0, initial=-np.inf)
        again = input_.wraps & (rows == last) & (last - rows[0] >= input_.turn - CLOSE)
        rows = np.sort(np.where(again, np.nan, rows), axis=0)
    most = int(np.isfinite(rows).sum(axis=0).max(initial=0))
    rows = rows[:max(most, 1)] if len(rows) else np.full((1, answers.shape[1]), np.nan)
    return np.moveaxis(rows, 0, -1)


def distinct(theta: Iterable[float], input_: Input) -> List[float]:
    """Return values of an input in order, one of those that differ by rounding."""
    found = np.array(list(theta), float)
    return [x for x in in_order(found[:, None], input_)[0].tolist() if x == x]


_Run = Tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


class _Branch(NamedTuple):
    """Samples of an arc on which an output rises, or falls if the sign is -1."""

    theta: np.ndarray
    value: np.ndarray
    sign: float


class MonotoneBranches:
    """
    An output over the reach, in branches on which it is monotone.

    Parameters
    ----------
    curve : callable
        From values of the input, shape (n,), to the output and its rate, shape (2, n).
    arcs : sequence of (float, float)
        The reach; no arc extends to both sides of -pi or pi.
    marks : sequence of float
        Values of the input next to which the output may change quickly or jump.
    angular : bool
        Whether the output is an angle, compared modulo a turn.
    rounding : float
        Least rounding of the output; a value beyond an extreme by no more counts as the extreme.

    """

    def __init__(self, curve: Callable, arcs: Iterable[Arc], marks: Sequence[float],
                 angular: bool, rounding: float):
        self._curve = curve
        self._angular = angular
        self._rounding = rounding
        arcs = list(arcs)
        self.jumps = [at for arc in cut(arcs, marks) for at in self._jumps(*arc)]
        if len(self.jumps) > TURN_SAMPLES:
            # The linkage is singular nearly everywhere, and all changes are rounding.
            arcs, self.jumps = [], []
        runs = [run for arc in cut(arcs, sorted({*marks, *self.jumps}))
                for run in self._runs(*arc)]
        self._range = max((np.ptp(value) for _, value, *_ in runs), default=0.0)
        self._branches = [branch for run in runs for branch in self._branched(*run)] \
            if self._moves(runs) else []

    def answers(self, values: np.ndarray) -> np.ndarray:
        """Return the values of the input for an output's, shape (n,), as (candidates, n)."""
        targets = [(branch, place, target[place]) for branch in self._branches
                   for target in self._targets(branch, values)
                   if len(place := np.flatnonzero(np.isfinite(target)))]
        found = np.full((max(len(targets), 1), *values.shape), np.nan)
        if targets:
            theta = self._solved(*map(np.concatenate, zip(*(
                _bracketed(branch, target) for branch, _, target in targets))))
            ends = np.cumsum([len(place) for _, place, _ in targets])[:-1]
            near = 0.25 * self._rounding
            for row, (branch, place, target), part in zip(found, targets, np.split(theta, ends)):
                part = np.where(target <= branch.value[0] + near, branch.theta[0], part)
                row[place] = np.where(target >= branch.value[-1] - near, branch.theta[-1], part)
        return found

    @property
    def arcs(self) -> List[Arc]:
        """Return the reach without jumps, cut at them."""
        joined: List[Arc] = []
        for low, high in sorted((float(branch.theta[0]), float(branch.theta[-1]))
                                for branch in self._branches):
            joined.append((joined.pop()[0], high) if joined and low == joined[-1][1] else (
                low, high))
        return joined

    def pieces(self, most: float) -> List[Tuple[float, float, float, float]]:
        """Return pieces of the branches, each two inputs and outputs at most `most` apart."""
        cut = []
        for theta, value, sign in self._branches:
            places = [0]
            for i in range(1, len(theta)):
                if i + 1 == len(theta) or value[i + 1] - value[places[-1]] > most:
                    places.append(i)
            cut += [(float(theta[i]), float(theta[k]), float(sign * value[i]),
                     float(sign * value[k])) for i, k in zip(places, places[1:])]
        return cut

    def follow(self, pose: Callable, size: float, value: float, near: float,
               turn: float) -> Tuple[float, float]:
        """
        Return the input at which the output has a value on the branch of `near`, and the rate.

        The output goes straight there, an angle the shorter way. `pose` is the curve for a float,
        with inputs in rad or m, `size` of them in a unit of the curve. A branch that ends where a
        `turn` does goes on at the other end. NaN if the value is outside the branch.
        """
        now, at = pose(near)[0], near / size
        gap = math.remainder(value - now, math.tau) if self._angular and math.isfinite(
            value - now) else value - now
        for branch in self._branches:
            if branch.theta[0] <= at <= branch.theta[-1]:
                start = float(np.interp(at, branch.theta, branch.value))
                start += float(self._difference(branch.sign * now - start))
                found = self._reached(pose, size, branch, start + branch.sign * gap, turn)
                if found:
                    return found
        return math.nan, math.nan

    def _reached(self, pose: Callable, size: float, branch: _Branch, target: float, turn: float
                 ) -> Optional[Tuple[float, float]]:
        """Return input and rate at a value of a branch or of those that continue it."""
        passed, slack = 0.0, self._rounding
        broken = BROKEN * (math.pi if self._angular else self._range)
        while not branch.value[0] - slack <= target <= branch.value[-1] + slack:
            end, start, step = (-1, 0, turn) if target > branch.value[-1] else (0, -1, -turn)
            following = [
                each for each in self._branches if each.sign == branch.sign
                and abs(each.theta[start] + step - branch.theta[end]) <= CLOSE
                and abs(self._difference(each.value[start] - branch.value[end])) <= broken]
            if not following or abs(passed) > turn:
                return None
            # The same value, or whole turns from it.
            target += float(following[0].value[start] - branch.value[end])
            branch, passed = following[0], passed + step
        i = min(max(int(branch.value.searchsorted(target)), 1), len(branch.theta) - 1)
        theta, rate = self._refined(
            pose, branch.sign, float(branch.theta[i - 1]), float(branch.theta[i]), target, size)
        return theta + passed * size, rate

    def _refined(self, pose: Callable, sign: float, lo: float, hi: float, target: float,
                 size: float) -> Tuple[float, float]:
        """Return what `_solved` does, for one float: arrays would cost more than the search."""
        lo, hi = lo * size, hi * size
        theta, last = 0.5 * (lo + hi), math.inf
        best = theta, math.nan
        for _ in range(STEPS):
            now, rate = pose(theta)
            gap = sign * now - target
            if self._angular:
                gap = math.remainder(gap, math.tau)
            if abs(gap) >= last and last < self._rounding:
                return best
            last, best = abs(gap), (theta, rate)
            lo, hi = (theta, hi) if gap < 0.0 else (lo, theta)
            guess = theta - sign * gap / rate if rate else math.nan
            if guess == theta or hi - lo <= math.ulp(max(-lo, hi)):
                break
            theta = guess if lo < guess < hi else 0.5 * (lo + hi)
        return best

    def _jumps(self, lo: float, hi: float) -> List[float]:
        """Return where the output jumps, as an angle does by pi where its ends meet."""
        theta = sampled(lo, hi)
        value, rate = self._curve(theta)
        with np.errstate(invalid='ignore'):
            size = math.pi if self._angular else float(
                np.nanmax(value, initial=-np.inf) - np.nanmin(value, initial=np.inf))
            # The change of the value that the rates at both samples do not explain.
            places = np.flatnonzero(np.abs(self._difference(np.diff(value)) - np.diff(theta)
                                           * 0.5 * (rate[1:] + rate[:-1])) > JUMP * size)
        before, after = theta[places], theta[places + 1]
        for _ in range(STEPS if len(places) else 0):
            middle = 0.5 * (before + after)
            if ((middle <= before) | (middle >= after)).all():
                break
            low, mid, high = self._curve(np.concatenate([before, middle, after]))[0].reshape(3, -1)
            first = np.abs(self._difference(mid - low)) > np.abs(self._difference(high - mid))
            before, after = np.where(first, before, middle), np.where(first, middle, after)
        low, high = self._curve(np.concatenate([before, after]))[0].reshape(2, -1)
        return before[np.abs(self._difference(high - low)) > JUMP * size].tolist()

    def _runs(self, lo: float, hi: float) -> Iterator[_Run]:
        """Yield samples as angles, values, rates and rounding, cut where there is no value."""
        theta = sampled(lo, hi)
        theta[[0, -1]] = self._unbroken(theta[[0, -1]], theta[[1, -2]], theta[len(theta) // 2])
        digit = 4.0 * np.spacing(np.abs(theta).clip(1e-3))
        around = (theta + digit * np.array([[0.0], [1.0], [-1.0]])).clip(theta[0], theta[-1])
        value, rate = self._curve(around.ravel()).reshape(2, *around.shape)
        with np.errstate(all='ignore'):
            # The change over an ulp of the input that the rate does not explain is rounding.
            noise = np.abs(self._difference(value[1:] - value[0])
                           - rate[0] * (around[1:] - theta)).max(axis=0)
        noise[~np.isfinite(noise)] = 0.0
        known = np.isfinite(value[0])
        # The direction of two joints is noise next to where they meet.
        clear = known & (noise <= NOISE * self._rounding)
        for run in np.split(np.arange(len(theta)), np.flatnonzero(~known)):
            within = np.flatnonzero(clear[run])
            if len(within) > 1:
                run = run[within[0]:within[-1] + 1]
                values = np.unwrap(value[0, run]) if self._angular else value[0, run]
                yield theta[run], values, rate[0, run], noise[run]

    def _unbroken(self, ends: np.ndarray, beside: np.ndarray, middle: float) -> np.ndarray:
        """Return the ends of an arc, or the last values before a break next to them."""
        values = self._curve(np.array([*ends, *beside, middle]))[0]
        start, size = values[2:4], BROKEN * (math.pi if self._angular else np.ptp(values[2:]))
        with np.errstate(invalid='ignore'):
            return refined(lambda x: ~(np.abs(self._difference(
                self._curve(x.ravel())[0].reshape(x.shape) - start[:, None])) > size),
                beside, np.nextafter(ends, 2.0 * ends - beside))[0]

    def _moves(self, runs: Sequence[_Run]) -> bool:
        """Return whether the output changes by more than rounding."""
        if not runs:
            return False
        _, values, _, noise = (np.concatenate(part) for part in zip(*runs))
        noise = STILL * (noise + np.median(noise)) + self._rounding
        return bool(np.any(np.abs(self._difference(values - np.median(values))) > noise))

    def _branched(self, theta: np.ndarray, value: np.ndarray, rate: np.ndarray,
                  noise: np.ndarray) -> Iterator[_Branch]:
        least = 4.0 * (noise + self._rounding)
        with np.errstate(invalid='ignore'):
            places = turns(value, rate, least)
            rising = rate[places] >= 0.0
            ends, _ = refined(lambda x: (self._curve(x.ravel())[1] >= 0.0).reshape(
                x.shape) == rising[:, None], theta[places], theta[places + 1])
        reached = self._curve(ends)[0] if len(ends) else ends
        # An extreme may be the one angle at which an arm has no length and no direction.
        known = np.isfinite(reached)
        ends = np.where(known, ends, theta[places])
        reached = value[places] + self._difference(np.where(known, reached - value[places], 0.0))
        theta = np.insert(theta, places + 1, ends)
        value = np.insert(value, places + 1, reached)
        cuts = [0, *(places + 1 + np.arange(len(places))).tolist(), len(theta) - 1]
        for first, last in zip(cuts, cuts[1:]):
            part = slice(first, last + 1)
            sign = 1.0 if value[last] >= value[first] else -1.0
            yield _Branch(theta[part], np.maximum.accumulate(sign * value[part]), sign)

    def _difference(self, gap: Any) -> Any:
        return gap - math.tau * np.round(gap / math.tau) if self._angular else gap

    def _targets(self, branch: _Branch, values: np.ndarray) -> Iterator[np.ndarray]:
        """Yield the values in turns of the branch; NaN for values outside it."""
        lo, hi = branch.value[0], branch.value[-1]
        values, slack = branch.sign * values, self._rounding
        turn, count = math.tau, int((hi - lo + 2.0 * slack) // math.tau) + 1
        if not self._angular:
            turn, count = 0.0, 1
        else:
            with np.errstate(invalid='ignore'):
                # Sine and cosine remove any number of whole turns without loss.
                within = np.arctan2(np.sin(values), np.cos(values))
            values = np.where(np.abs(values) > math.tau, within, values)
            values = values + math.tau * np.ceil((lo - slack - values) / math.tau)
        for i in range(count):
            target = values + i * turn
            inside = (target >= lo - slack) & (target <= hi + slack)
            yield np.where(inside, np.clip(target, lo, hi), np.nan)

    def _solved(self, lo: np.ndarray, hi: np.ndarray, target: np.ndarray,
                sign: np.ndarray) -> np.ndarray:
        """Return the inputs of some targets, by Newton's method inside brackets."""
        theta, step = 0.5 * (lo + hi), hi - lo
        best, least, steepest = theta, np.full(theta.shape, np.inf), np.zeros(theta.shape)
        done = np.zeros(theta.shape, bool)
        for _ in range(STEPS):
            value, rate = self._curve(theta)
            gap = self._difference(sign * value - target)
            closer = np.abs(gap) < least
            best, least = np.where(closer, theta, best), np.where(closer, np.abs(gap), least)
            steepest = np.where(closer, np.abs(rate), steepest)
            lo, hi = np.where(gap < 0.0, theta, lo), np.where(gap < 0.0, hi, theta)
            with np.errstate(all='ignore'):
                guess = theta - gap / (sign * rate)
            digit = np.spacing(np.maximum(np.abs(lo), np.abs(hi)))
            done |= (least == 0.0) | (hi - lo <= digit) | (np.abs(guess - theta) <= digit)
            if done.all():
                break
            good = (lo < guess) & (guess < hi) & (np.abs(guess - theta) < 0.5 * step)
            following = np.where(good, guess, 0.5 * (lo + hi))
            theta, step = following, np.abs(following - theta)
        # At a jump both sides enclose values that the output never has.
        far = STILL * np.spacing(math.pi) * steepest + MISSED * self._range + self._rounding
        return np.where(least <= far, best, np.nan)


def cut(arcs: Iterable[Arc], marks: Sequence[float]) -> Iterator[Arc]:
    """Yield arcs, cut at marks, which may be dead points."""
    for start, end in arcs:
        inside = [mark for mark in marks if start < mark < end]
        yield from zip([start, *inside], [*inside, end])


def _bracketed(branch: _Branch, target: np.ndarray) -> tuple:
    """Return the samples on both sides of targets, the targets, and the sign of the branch."""
    index = np.clip(np.searchsorted(branch.value, target), 1, len(branch.theta) - 1)
    return (branch.theta[index - 1], branch.theta[index], target,
            np.full(target.shape, branch.sign))
