# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Inputs of a linkage: angles of cranks, lengths of cylinders and carriages.

This module alone handles the periodicity of angles.
"""

from __future__ import annotations

import math
from typing import Any, Iterable, Iterator, NamedTuple, Sequence

import numpy as np

from .tolerances import MIN_ANGLE, ONE, ROUNDING

Arc = tuple[float, float]

ANGLE, LENGTH = 'angle', 'length'

# The longest period that is computed as a whole, and the part of a longer one, a multiple of 4
# [turns; fewer where a geared link is fast]. Of several inputs they are the product, the cost.
MAX_PERIOD, PART = 100, 8
# Greatest denominator of a gear ratio with a period, and greatest ratio.
MAX_DENOMINATOR, MAX_GEAR_RATIO = 10 ** 6, 1000


class Input(NamedTuple):
    """
    An input, by its name: an ANGLE [rad] or a LENGTH [m].

    All poses lie between `low` and `high`: one period of an angle, or the longest stroke.
    `period` is the number of turns after which poses repeat: above one if it drives cranks by
    fractional gears or passes one change point per turn, infinite for irrational ratios. Of a
    very long period, `low` to `high` is a part, around zero. `speed` is that of the fastest link
    that it drives by gears, in turns per turn.
    """

    name: str
    kind: str = ANGLE
    low: Any = -math.pi
    high: Any = math.pi
    period: float = 1
    speed: float = 1

    @property
    def turn(self) -> float:
        """Return the angle [rad] after which poses repeat."""
        return math.tau * self.period

    @property
    def is_angle(self) -> bool:
        """Whether it is an angle."""
        return self.kind == ANGLE

    @property
    def wraps(self) -> bool:
        """Whether it is an angle whose whole period lies between `low` and `high`."""
        return self.kind == ANGLE and self.turn <= self.high - self.low

    @property
    def quantity(self) -> str:
        """Return its description for messages: 'crank angle'."""
        return f'{self.name} {self.kind}'

    @property
    def unit(self) -> str:
        """Return its unit for messages."""
        return 'rad' if self.kind == ANGLE else 'm'

    @property
    def size(self) -> float:
        """Return a unit, a power of two [m], in which a stroke is about as long as a turn."""
        return 1.0 if self.kind == ANGLE else 2.0 ** (math.frexp(self.high - self.low)[1] - 2)

    @property
    def is_part(self) -> bool:
        """Whether it is an angle of which only a part of the period is computed."""
        return self.is_angle and not self.wraps

    def whole_turns(self, near: float) -> float:
        """Return the turns around which values are computed, if not those around zero."""
        if not (self.is_part and math.isfinite(near)):
            return 0.0
        # Half of what is computed lies on both sides of a value by at least a quarter of it.
        half = math.floor((self.high - self.low) / (2.0 * math.tau))
        return float(half * round(near / (half * math.tau)))

    @property
    def step(self) -> float:
        """Return a unit, a power of two [rad or m], in which all of it moves a turn at most."""
        return self.size if self.kind == LENGTH else 2.0 ** min(0, 3 - math.frexp(self.speed)[1])

    def normalized(self) -> Input:
        """Return the same input in units of its step."""
        step = self.step
        return self._replace(low=self.low / step, high=self.high / step,
                             period=self.period / step, speed=1)

    def wrapped(self, value: Any) -> Any:
        """Return angles wrapped to [low, high), and lengths unchanged."""
        return wrapped(value, self.turn) if self.wraps else value

    def turns_of(self, value: float) -> float:
        """Return the whole periods [rad] by which a value is out of [low, high)."""
        return self.turn * math.floor(value / self.turn + 0.5) if self.wraps else 0.0

    def nearest_equivalent(self, value: float, seed: float) -> float:
        """Return a value plus the whole turns that bring it closest to another one."""
        return value + self.turn * round((seed - value) / self.turn) if self.wraps else value

    def distance(self, value: Any, other: Any) -> Any:
        """Return the differences of values and others, without whole turns."""
        return abs(self.wrapped(value - other))

    def is_whole(self, arcs: Sequence[Arc]) -> bool:
        """Return whether some arcs are a full rotation, or all that is computed of one."""
        return self.is_angle and len(arcs) == 1 and arcs[0][1] - arcs[0][0] >= min(
            self.turn, self.high - self.low)

    def is_cut(self, value: float) -> bool:
        """Return whether the input is cut off at a value: a turn at pi, a stroke at its end."""
        return value in (self.low, self.high)

    def on(self, arcs: Sequence[Arc], value: float) -> bool:
        """
        Return whether a value lies on one of the arcs, up to whole turns and rounding.

        Arcs of a part of a period say nothing of values outside it: these count as on them.
        """
        if self.is_part and (value < self.low or self.high < value):
            return True
        slack = ROUNDING * self.size
        for low, high in arcs:
            ahead = value - low + slack
            if 0.0 <= (ahead % self.turn if self.wraps else ahead) <= high - low + 2.0 * slack:
                return True
        return False

    def holds(self, arc: Arc, low: float, high: float) -> bool:
        """Return whether an arc contains another, up to whole turns."""
        turns = self.turn * math.floor((high - arc[0]) / self.turn) if self.wraps else 0.0
        return arc[0] <= low - turns and high - turns <= arc[1]

    def within(self, low: float, high: float) -> Iterator[Arc]:
        """Yield an arc, in two where it crosses the upper end of a period."""
        if not self.wraps:
            yield low, high
            return
        for turn in (0.0, self.turn):
            start, end = max(low - turn, self.low), min(high - turn, self.high)
            if start < end:
                yield start, end

    def distinct(self, values: Iterable[float]) -> list[float]:
        """Return values in order, wrapped, one of those that differ by rounding."""
        distinct: list[float] = []
        for x in sorted(float(self.wrapped(0.0 if abs(x) < MIN_ANGLE else x)) for x in values):
            if not distinct or x - distinct[-1] > ONE:
                distinct.append(x)
        if self.wraps and len(distinct) > 1 and distinct[0] + self.turn - distinct[-1] <= ONE:
            distinct.pop()
        return distinct

    def between(self, ends: Iterable[float]) -> list[Arc]:
        """Return the arcs between values, in order; the last of a turn ends where it began."""
        marks = self.distinct(ends if self.wraps else (
            end for end in (self.low, *ends, self.high) if self.low <= end <= self.high))
        if not marks:
            return [(self.low, self.high)]
        return list(zip(marks, marks[1:] + [marks[0] + self.turn] * self.wraps))


CRANK = Input('crank')


def theta_of(values: Any) -> Any:
    """Return inputs as an argument of a linkage: a sequence only if there are several."""
    return values if len(values) > 1 else values[0]


def spread(inputs: Sequence[Input], count: int) -> list[np.ndarray]:
    """Return values of each input (count,): poses that fill their ranges evenly."""
    # Multiples of square roots of primes, without their whole parts.
    parts = np.outer(np.sqrt([2, 3, 5, 7, 11, 13, 17, 19][:len(inputs)]),
                     np.arange(1, count + 1)) % 1.0
    return [input_.low + part * (input_.high - input_.low)
            for input_, part in zip(inputs, parts)]


def wrapped(theta: Any, turn: float = math.tau) -> Any:
    """Return angles [rad] in [-turn/2, turn/2)."""
    half = 0.5 * turn
    turned = theta - turn * np.floor((theta + half) / turn)
    turned = np.where((turned < -half) | (turned >= half), -half, turned)
    return np.where((theta >= -half) & (theta < half), theta, turned)
