# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Where a machine is, counted in turns of its first crank; no picture is drawn here.

A turn is a whole turn of the crank or, if the crank swings, one swing to and fro.
"""

import math
from typing import NamedTuple, Tuple

import numpy as np

from ..scene import Crank, in_words, Machine, SceneError
from ..scene.crank_motion import Motion

SAMPLES = 720  # of a turn
MOST_TURNS = 24  # after which several cranks need not be where they started


class Pose(NamedTuple):
    """Turns since the start, crank angles [rad], and all joints [m], (legs, joints, 2)."""

    turns: float
    thetas: Tuple[float, ...]
    places: np.ndarray


class Wheel:
    """
    A crank, from its start through one turn, again and again.

    Attributes
    ----------
    period : float
        Seconds of a turn; infinite for a crank that stands still.

    """

    def __init__(self, crank: Crank):
        self._sweep = crank.sweep
        self._sign = math.copysign(1.0, crank.speed)
        self._start, _ = Motion(crank.speed, crank.sweep, crank.start).at(0)
        self._turn = math.tau if crank.sweep is None else 2.0 * (crank.sweep[1] - crank.sweep[0])
        self.period = self._turn / abs(crank.speed) if crank.speed else math.inf

    def angle(self, turns: float) -> float:
        """Return the angle [rad], in [0, 2 pi) or in the sweep."""
        travelled = self._sign * self._turn * (turns % 1.0)
        if self._sweep is None:
            return (self._start + travelled) % math.tau
        low = self._sweep[0]
        place = (self._start - low + travelled) % self._turn
        return low + min(place, self._turn - place)

    def turns_to(self, angle: float) -> float:
        """Return when it is first at an angle [rad]; SceneError if it never is."""
        ends = [angle]
        if self._sweep is not None:
            low, high = self._sweep
            angle = low + (angle - low) % math.tau
            if angle > high:
                raise SceneError(f'the crank never is at {angle:.6g} rad: it swings inside '
                                 f'{in_words([self._sweep])} rad')
            ends = [angle, 2.0 * low - angle]
        return min(self._sign * (end - self._start) % self._turn for end in ends) / self._turn


class Cycle:
    """
    A machine from its start until it is there again.

    Attributes
    ----------
    first : Wheel
        The first crank.
    turns : int
        Turns of the first crank until all are where they started, or MOST_TURNS.
    prefixes : tuple of str
        What the names of each leg's joints begin with.
    course : float array (turns * SAMPLES + 1, legs, joints, 2)
        All joints in that time, both ends included [m]; NaN where they cannot be assembled.

    """

    def __init__(self, machine: Machine):
        assembly = machine.assembly()
        self._solution = assembly.solution(points=machine.linkage.points)
        self._wheels = [Wheel(crank) for crank in machine.cranks.values()]
        self.first = self._wheels[0]
        self._ratios = [1.0, *(at_once(self.first.period, wheel.period)
                               for wheel in self._wheels[1:])]
        self.turns = next((n for n in range(1, MOST_TURNS) if all(
            math.isclose(n * ratio, round(n * ratio)) for ratio in self._ratios)), MOST_TURNS)
        self.prefixes = tuple(leg.prefix for leg in assembly.legs)
        self.course = np.stack([self.pose(k / SAMPLES).places
                                for k in range(self.turns * SAMPLES + 1)])
        self._locus = assembly.locus

    def pose(self, turns: float) -> Pose:
        """Return where everything is; NaN where it cannot be assembled."""
        thetas = tuple(wheel.angle(turns * ratio)
                       for wheel, ratio in zip(self._wheels, self._ratios))
        self._solution.solve(thetas)
        rows = self._solution.rows.copy()
        return Pose(turns, thetas, rows.reshape(len(rows), -1, 2))

    def curve(self, joint: int, start: float, end: float) -> np.ndarray:
        """Return where a joint is between two times [turns], shape (n, legs, 2) [m]."""
        samples = np.arange(math.ceil(start * SAMPLES), math.ceil(end * SAMPLES))
        before = self.course[samples % (len(self.course) - 1), :, joint]
        return np.concatenate([before, self.pose(end).places[None, :, joint]])

    def locus(self, machine: Machine) -> np.ndarray:
        """Return the whole curve of the first leg's tracer [m], shape (n, 2)."""
        curve = self._locus(machine.tracer)
        if len(curve):
            return curve
        return self.course[:, 0, machine.linkage.points.index(machine.tracer)]


def at_once(period: float, other: float) -> float:
    """Return the turns of another crank in one turn of the first, from their periods [s]."""
    if not math.isfinite(other):
        return 0.0
    return period / other if math.isfinite(period) else 1.0
