# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Motion of a mechanism in pictures: its joints over turns of its first input.

A turn is a full rotation of a crank, or one period of an oscillating input.
"""

import math
from typing import NamedTuple, Tuple

import numpy as np

from ..robot_model.shapes import drawn
from ..scene import in_words, InputSettings, SceneError, SceneMechanism
from ..scene.motion import Motion

SAMPLES = 720  # of a turn
MOST_TURNS = 24  # limit of the turns in which several inputs return to their starts


class Configuration(NamedTuple):
    """Turns since the start, inputs [rad or m], and joints [m] (legs, joints, 2)."""

    turns: float
    inputs: Tuple[float, ...]
    places: np.ndarray


class Wheel:
    """
    An input as a periodic function of turns from its start.

    Attributes
    ----------
    period : float
        Period [s]; infinite for an input that stands still.

    """

    def __init__(self, drive: InputSettings):
        self.input = drive.input
        self._sweep = sweep = drive.sweep
        self._sign = math.copysign(1.0, drive.speed)
        self._start, _ = Motion.of(drive).at(0)
        self._turn = math.tau if sweep is None else 2.0 * (sweep[1] - sweep[0])
        self.period = self._turn / abs(drive.speed) if drive.speed else math.inf

    def value(self, turns: float) -> float:
        """Return the input, in [0, 2 pi) or in the sweep."""
        travelled = self._sign * self._turn * (turns % 1.0)
        if self._sweep is None:
            return (self._start + travelled) % math.tau
        low = self._sweep[0]
        place = (self._start - low + travelled) % self._turn
        return low + min(place, self._turn - place)

    def turns_to(self, value: float) -> float:
        """Return the first turns at which it has a value [rad or m]; SceneError if never."""
        ends = [value]
        if self._sweep is not None:
            low, high = self._sweep
            value = low + (value - low) % math.tau if self.input.turns else value
            if not low <= value <= high:
                unit = self.input.unit
                raise SceneError(f'the {self.input.quantity} never reaches {value:.6g} {unit}: '
                                 f'it stays inside {in_words([self._sweep])} {unit}')
            ends = [value, 2.0 * low - value]
        return min(self._sign * (end - self._start) % self._turn for end in ends) / self._turn


class Cycle:
    """
    The motion of a mechanism from its start until it repeats.

    Attributes
    ----------
    first : Wheel
        The first input.
    period : float
        Its period [s].
    turns : int
        Turns of the first input until all inputs are at their starts, or MOST_TURNS.
    prefixes : tuple of str
        Prefixes of the names of each leg's joints.
    course : float array (turns * SAMPLES + 1, legs, joints, 2)
        All joints in that time, both ends included [m], then the ends of slides;
        NaN where they cannot be assembled.

    """

    def __init__(self, mechanism: SceneMechanism):
        assembly = mechanism.assembly()
        sliding = drawn(mechanism, mechanism.points)
        self._solution = assembly.solution((*mechanism.linkage.points, *(
            end for shape in sliding for end in (shape.start, shape.end))))
        self._wheels = [Wheel(drive) for drive in mechanism.inputs.values()]
        self.first = self._wheels[0]
        self.period = self.first.period
        self._ratios = [1.0, *(turn_ratio(self.period, wheel.period)
                               for wheel in self._wheels[1:])]
        self.turns = next((n for n in range(1, MOST_TURNS) if all(
            math.isclose(n * ratio, round(n * ratio)) for ratio in self._ratios)), MOST_TURNS)
        self.prefixes = tuple(assembly.legs)
        self.course = np.stack([self.pose(k / SAMPLES).places
                                for k in range(self.turns * SAMPLES + 1)])
        self._locus = assembly.locus

    def pose(self, turns: float) -> Configuration:
        """Return the configuration at a time [turns]; NaN where it cannot be assembled."""
        inputs = tuple(wheel.value(turns * ratio)
                       for wheel, ratio in zip(self._wheels, self._ratios))
        self._solution.solve(inputs)
        rows = self._solution.rows.copy()
        return Configuration(turns, inputs, rows.reshape(len(rows), -1, 2))

    def curve(self, joint: int, start: float, end: float) -> np.ndarray:
        """Return the curve of a joint between two times [turns], shape (n, legs, 2) [m]."""
        samples = np.arange(math.ceil(start * SAMPLES), math.ceil(end * SAMPLES))
        before = self.course[samples % (len(self.course) - 1), :, joint]
        return np.concatenate([before, self.pose(end).places[None, :, joint]])

    def locus(self, mechanism: SceneMechanism) -> np.ndarray:
        """
        Return the whole curve of the first leg's tracer [m], shape (n, 2).

        It is empty if several inputs never return to their starts together.
        """
        curve = self._locus(mechanism.tracer)
        if len(curve) or self.turns == MOST_TURNS:
            return curve
        return self.course[:, 0, mechanism.linkage.points.index(mechanism.tracer)]


def turn_ratio(period: float, other: float) -> float:
    """Return the turns of another input in one turn of the first, from their periods [s]."""
    if not math.isfinite(other):
        return 0.0
    return period / other if math.isfinite(period) else 1.0
