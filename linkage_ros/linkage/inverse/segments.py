# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The segments of the reach on which an output is monotone: candidates of one unknown input.

Special inputs cut the reach: ends, dead points, extremes of the output and its jumps. Between two
of them the output has each value of its range once. The rule for its ends is in
docs/design/accuracy.md.
"""

from __future__ import annotations

from bisect import bisect_right
import math
from typing import Any, Iterator, NamedTuple, Sequence

import numpy as np

from .problem import Candidate
from ..inputs import Arc, Input
from ..kinematics import Kinematics
from ..motion.curves import CUTS, refined, sampled, turning_points
from ..motion.singularities import Analysis, NEAR
from ..tolerances import CLOSE, MIN_ANGLE, ONE, ROUNDING, SINGULAR, TOLERANCE

# Rounding of a pose, which that of all joints may explain: so many ulps of an input, or multiples
# of the rounding of one sum.
ULPS = 64.0
# The least jump of the output [parts of its range].
JUMP = 0.05
# More additional samples of an arc are those of a linkage that is singular nearly everywhere.
MAX_SAMPLES = 10000


class Segment(NamedTuple):
    """
    Samples of a part of the reach on which an output is monotone.

    Attributes
    ----------
    theta, value : sequence of float
        The input, and the output times the sign of its rate. Both ascend.
    sign : float
        1.0 where the output rises, -1.0 where it falls.

    """

    theta: Any
    value: Any
    sign: float

    def candidate(self, target: float) -> Candidate:
        """Return the candidate of a value of the range, times the sign."""
        i = bisect_right(self.value, target, 1, len(self.value) - 1)
        (low, high), (first, last) = self.theta[i - 1:i + 1], self.value[i - 1:i + 1]
        part = (target - first) / (last - first) if last > first else 0.5
        return Candidate((low + part * (high - low),), low, high)


class Segments:
    """
    An output over the first input's reach, in segments on which it is monotone.

    In all samples the input is in its step.
    """

    def __init__(self, linkage: Kinematics, output: str, others: Sequence[float], first: Input):
        analysis, self._input = Analysis(linkage, others, first), first
        self._curve, arcs = analysis.curve('output', output), analysis.reach()
        self._ends = np.ravel(arcs)
        is_angle, turn = linkage.is_angle(output), first.turn if first.wraps else math.inf
        self._period = (turn if output == first.name else math.tau) if is_angle else math.inf
        self._size = 1.0 if is_angle else linkage.longest
        self._rounding, self._unit = TOLERANCE * self._size, first.step
        normalized = first.normalized()
        # Where a dyad is at a dead point, or nearly is.
        marks = normalized.distinct(
            x.value for x in analysis.near_zeros() if x.distance <= NEAR * x.size)
        # Next to an end of the reach there is a pose also when turns are added, and behind gears.
        farthest = math.pi if first.is_part else normalized.high
        offset = math.tau * abs(dict(linkage.design.turned).get(first.name, 0.0)) / self._unit
        ulps = 2.0 if first.period == 1 else 4.0

        def inside(end: float, side: float) -> float:
            return end if normalized.is_cut(end) else end + side * ulps * math.ulp(
                max(abs(end) + offset, farthest))

        arcs = [(inside(low, 1.0), inside(high, -1.0)) for low, high in arcs]
        runs = [run for arc in _cut(arcs, marks) for run in self._runs(*arc)]
        if not runs or not self._moves(runs):
            runs = []
        self.all = [segment for run in runs for segment in self._monotone(*run)]
        self.all.sort(key=lambda segment: float(segment.theta[0]))
        self._answers = [*map(self._answered, range(len(self.all)))]

    def _answered(self, number: int) -> Segment:
        """
        Return the input and all values that a segment answers.

        The values of the outer cells, in which the input does not change, are those of its ends.
        """
        theta, value, sign = self.all[number]
        slack = self._slack(number, 0), self._slack(number, -1)
        margin = np.minimum(slack, ONE * self._size)
        inner = value.clip(value[0] + margin[0], value[-1] - margin[1])
        return Segment((np.pad(theta, 1, 'edge') * self._unit).tolist(), [
            float(value[0] - slack[0]), *inner.tolist(), float(value[-1] + slack[1])], sign)

    # --- candidates ---

    def candidates(self, values: Sequence[float]) -> list[Candidate]:
        """Return a candidate for each input that has the value."""
        candidates, period = [], self._period
        for segment in self._answers:
            low, target = segment.value[0], segment.sign * values[0]
            if period < math.inf and not low <= target < low + period:
                target += period * math.ceil((low - target) / period)
            while low <= target <= segment.value[-1]:
                candidates.append(segment.candidate(target))
                target += period
        return candidates

    def candidate_arrays(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return numbers of brackets of a value, of values (1, m) that have them, and brackets."""
        parts: list[tuple[np.ndarray, ...]] = []
        period, none = self._period, np.empty(0, int)
        for *samples, sign in self._answers:
            theta, value = map(np.array, samples)
            target = sign * values[0]
            if period < math.inf:
                target = target + period * np.ceil((value[0] - target) / period)
            while len(inside := np.flatnonzero((value[0] <= target) & (target <= value[-1]))):
                goal = target[inside]
                i = value[1:-1].searchsorted(goal, 'right')
                parts.append((np.full(len(i), len(parts)), inside, np.stack([
                    theta[i], theta[i + 1], np.interp(goal, value, theta)])))
                target = target + period
        numbers, places, brackets = zip((none, none, np.empty((3, 0))), *parts)
        return np.concatenate(numbers), np.concatenate(places), np.hstack(brackets)

    def follow(self, value: float, residual: float, seed: float
               ) -> tuple[Candidate, tuple[float]] | None:
        """
        Return the candidate of a value on the segment of a seed or those that continue it.

        The output goes straight there, from `residual` above it; also returned is the input that
        is estimated there, with its whole turns.
        """
        turns = self._input.turns_of(seed)
        place = (seed - turns) / self._unit
        number = next((i for i, segment in enumerate(self.all)
                       if segment.theta[0] <= place <= segment.theta[-1]), None)
        if number is None:
            return None
        theta, values, sign = self.all[number]
        target = float(np.interp(place, theta, values))
        target += math.remainder(sign * (value + residual) - target, self._period)
        target -= sign * residual
        for _ in range(2 * len(self.all)):
            answers = self._answers[number]
            if answers.value[0] <= target <= answers.value[-1]:
                candidate = answers.candidate(target)
                return candidate, (turns + candidate.inputs[0],)
            end = -1 if target > answers.value[-1] else 0
            if (beyond := self._beyond(number, end)) is None:
                break
            current, following, number = self.all[number], self.all[beyond], beyond
            # The same value, or whole periods from it.
            target += float(following.value[-1 - end] - current.value[end])
            turns += self._input.turns_of(
                float(current.theta[end] - following.theta[-1 - end]) * self._unit)
        return None

    # --- monotone pieces ---

    def pieces(self) -> np.ndarray:
        """Return pieces of the segments: two inputs, and two outputs within half a period."""
        cut = []
        for theta, value, sign in self.all:
            places = [0]
            while (last := places[-1]) < len(theta) - 1:
                farthest = int(value.searchsorted(value[last] + 0.5 * self._period, 'right')) - 1
                places.append(max(farthest, last + 1))
            cut += [(theta[i], theta[k], sign * value[i], sign * value[k])
                    for i, k in zip(places, places[1:])]
        theta, value = np.reshape(cut, (-1, 2, 2)).swapaxes(0, 1)
        # At an end of the reach there may be a pose, too.
        end = self._ends[np.abs(np.subtract.outer(theta, self._ends)).argmin(axis=-1)]
        outer = value + self._difference(self._curve(end.ravel())[0].reshape(end.shape) - value)
        is_end = (np.abs(end - theta) <= ROUNDING) & np.isfinite(outer)
        pieces = np.hstack([np.where(is_end, end, theta) * self._unit,
                            np.where(is_end, outer, value)])
        return pieces[pieces[:, 2] != pieces[:, 3]]

    # --- how they are found ---

    def _difference(self, difference: Any) -> Any:
        return difference if self._period == math.inf else difference - self._period * np.round(
            difference / self._period)

    def _runs(self, lo: float, hi: float) -> Iterator[tuple]:
        """Yield samples as inputs, values and rates, cut where the output jumps."""
        theta = sampled(lo, hi)
        limit = MAX_SAMPLES + 4 * len(theta)
        theta, jumped = self._divided(theta, limit)
        if len(theta) > limit:
            return
        ulps = ULPS * np.spacing(np.abs(theta).clip(1e-3))
        around = (theta + ulps * np.array([[0.0], [1.0], [-1.0]])).clip(lo, hi)
        value, rate = self._curve(around.ravel()).reshape(2, *around.shape)
        with np.errstate(invalid='ignore'):
            noise = np.abs(self._difference(value[1:] - value[0])).max(axis=0)
        known = np.isfinite(value[0])
        cuts = sorted({*np.flatnonzero(~known).tolist(), *(jumped + 1).tolist()})
        for run in np.split(np.arange(len(theta)), cuts):
            clear = np.flatnonzero((known & ~(noise > SINGULAR * self._size))[run])
            if len(clear) > 1 and theta[run[-1]] - theta[run[0]] > ROUNDING:
                run = run[clear[0]:clear[-1] + 1]
                yield (theta[run], np.unwrap(value[0, run], period=self._period) if self._period
                       < math.inf else value[0, run], rate[0, run])

    def _divided(self, theta: np.ndarray, limit: int) -> tuple[np.ndarray, np.ndarray]:
        """Return samples that explain the output, and after which of them it jumps."""
        jumped = np.empty(0, int)
        value, rate = self._curve(theta)
        while True:
            width, change = np.diff(theta), self._difference(np.diff(value))
            with np.errstate(all='ignore'):
                size = 0.5 * self._period if self._period < math.inf else max(
                    float(np.nanmax(value) - np.nanmin(value)), CLOSE * self._size)
                slopes = np.stack([rate[1:], rate[:-1]])
                mean = 0.5 * width * slopes.sum(axis=0)
                residual = np.abs(change - np.where(np.isfinite(mean), mean, 0.0))
                wide = (width > SINGULAR) & (residual > ULPS * self._rounding)
                # Two extremes may hide where the change is less than half of what rates say.
                hidden = (slopes[0] * slopes[1] > 0.0) & (residual > 0.5 * np.abs(mean))
                place = np.flatnonzero((residual > JUMP * size) | wide & hidden)
            narrow = width[place] <= ROUNDING
            jumped = place[narrow & (np.abs(change[place]) > JUMP * size)]
            place = place[~narrow]
            if not len(place) or len(theta) > limit:
                return theta, jumped
            new = (theta[place, None] + width[place, None] * CUTS).ravel()
            new_value, new_rate = self._curve(new)
            order = np.argsort(np.concatenate([theta, new]))
            theta, value, rate = (np.concatenate(parts)[order] for parts in (
                (theta, new), (value, new_value), (rate, new_rate)))

    def _moves(self, runs: Sequence[tuple]) -> bool:
        """Return whether the output differs from its median, over a tenth of the reach."""
        values = np.concatenate([value for _, value, _ in runs])
        widths = np.concatenate([np.gradient(theta) for theta, _, _ in runs])
        order, length = np.argsort(values), widths.sum()
        median = values[order[np.searchsorted(widths[order].cumsum(), 0.5 * length)]]
        differs = np.abs(self._difference(values - median)) > ULPS * self._rounding
        return bool(widths[differs].sum() > 0.1 * length)

    def _monotone(self, theta: np.ndarray, value: np.ndarray, rate: np.ndarray
                  ) -> Iterator[Segment]:
        """Yield the segments of a run, cut at its extremes."""
        with np.errstate(invalid='ignore'):
            places = turning_points(value, rate, 8.0 * self._rounding)
            rising = rate[places] >= 0.0
            at, _ = refined(lambda x: (self._curve(x.ravel())[1] >= 0.0).reshape(
                x.shape) == rising[:, None], theta[places], theta[places + 1])
        extremes = self._curve(at)[0] if len(at) else at
        at[abs(at) < MIN_ANGLE] = 0.0
        # An extreme may be the one input at which an arm has no length and no direction.
        extremes = value[places] + self._difference(
            np.where(np.isfinite(extremes), extremes, value[places]) - value[places])
        theta, value = np.insert(theta, places + 1, at), np.insert(value, places + 1, extremes)
        cuts = [0, *(places + 1 + np.arange(len(places))).tolist(), len(theta) - 1]
        for first, last in zip(cuts, cuts[1:]):
            part = slice(first, last + 1)
            sign = 1.0 if value[last] >= value[first] else -1.0
            yield Segment(theta[part], np.maximum.accumulate(sign * value[part]), sign)

    def _slack(self, number: int, end: int) -> float:
        """Return how far beyond an end of a segment, 0 or -1, values are those of the end."""
        theta, value, sign = self.all[number]
        if (beyond := self._beyond(number, end)) is not None:
            value_beyond = self.all[beyond].value[-1 - end] - value[end]
            return self._rounding + abs(self._difference(value_beyond))
        # An end is a float, too: next to it the output may change quickly.
        ulps = ULPS * np.spacing(max(abs(theta[end]), 1.0))
        perturbed = theta[end:end + 1 or None] + math.copysign(ulps, theta[-1 - end] - theta[end])
        change = abs(self._difference(self._curve(perturbed)[0, 0] - sign * value[end]))
        return float(np.fmin(np.fmax(change, CLOSE * self._size), SINGULAR * self._size))

    def _beyond(self, number: int, end: int) -> int | None:
        """Return the number of the segment on which the output goes on beyond an end, 0 or -1."""
        beyond = (number + (1 if end else -1)) % len(self.all)
        segment, after = self.all[number], self.all[beyond]
        step = float(after.theta[-1 - end] - segment.theta[end]) * self._unit
        goes_on = after.sign == segment.sign and abs(
            step - self._input.turns_of(step)) <= ONE * self._unit and abs(
                self._difference(after.value[-1 - end] - segment.value[end])) <= CLOSE * self._size
        return beyond if goes_on else None


def segments_of(linkage: Kinematics, output: str, others: Sequence[float] = (),
                first: Input | None = None) -> Segments:
    """Return the segments of an output over the first input; see `Analysis`."""
    first = first or linkage.inputs[0]
    return linkage.cache.get_or_make(('segments', output, first.period, *others),
                                     lambda: Segments(linkage, output, others, first))


def _cut(arcs: Sequence[Arc], marks: Any) -> Iterator[Arc]:
    """Yield arcs, cut at marks; a mark next to an end is that end."""
    for start, end in arcs:
        inside = sorted(mark for mark in marks if start + ROUNDING < mark < end - ROUNDING)
        yield from zip([start, *inside], [*inside, end])
