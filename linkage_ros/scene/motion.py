# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Inputs as functions of time.

Angles are integers in units of 2^-160 rad, lengths in units of 2^-160 m, and times in nanoseconds.
Only the result is rounded, so that errors do not accumulate.
"""

from __future__ import annotations

from copy import copy
import math

from . import InputSettings
from ..linkage import Arc

# Turns after which an input that never repeats is counted from zero again.
MAX_PERIOD = 1e12
STEPS, STEP = 1 << 160, 2.0 ** -160
TURN = 62831853071795864769252867665590057683943387987502116 * STEPS // 10 ** 52


def _steps(value: float, unit: int = STEPS, per: int = 1) -> int:
    """Return the steps of a value in some units of `unit` steps."""
    numerator, denominator = float(value).as_integer_ratio()
    return numerator * unit // (denominator * per)


class Motion:
    """
    An input that rotates, or oscillates as a triangle wave, at a constant speed.

    Its phase covers one period, or the sweep from its low end to its high end and back.

    Parameters
    ----------
    speed : float
        Speed [rad/s or m/s]; for a sweep, its sign is the initial direction.
    sweep : (float, float), optional
        Ends of the oscillation [rad or m]; None: full rotation.
    start : float
        Value at the time `since` [rad or m]; outside the sweep, the nearer end is used.
    since : int
        Time of the start [ns].
    turns : bool
        Whether the input is an angle, so that `start` may be off by whole turns.
    period : float
        Turns after which the value of a full rotation returns to 0, at most MAX_PERIOD.

    """

    def __init__(self, speed: float, sweep: Arc | None = None, start: float = 0.0,
                 since: int = 0, turns: bool = True, period: float = 1):
        self._speed = speed
        self._rate, self._forward = _steps(speed, per=10 ** 9), -1 if speed < 0 else 1
        self._sweep = sweep
        self._turns, self._round = turns, int(min(period, MAX_PERIOD)) * TURN
        self._low, high = (0, self._round) if sweep is None else map(_steps, sweep)
        self._width, self._end = high - self._low, high / STEPS
        self._period = self._round if sweep is None else 2 * self._width or 1
        self._phase = self._place(_steps(start))
        self._since = since
        # A turn of a rotation, or once there and back.
        self._turn = TURN if sweep is None else self._period

    @property
    def turn(self) -> float:
        """Return the time [s] of a turn, or of once there and back; inf if it stands still."""
        return self._turn * STEP / abs(self._speed) if self._speed else math.inf

    def at(self, now: int) -> tuple[float, float]:
        """Return value and speed at a time [ns]; a rotation's value is in [0, 2 pi period)."""
        return self._value(self._phase_at(now))

    def after(self, turns: float) -> float:
        """Return the value some turns after the start, also if the speed is 0."""
        return self._value(self._phase + self._forward * _steps(turns, self._turn))[0]

    def is_repeated(self, turns: float) -> bool:
        """Return whether it is at its start again after some turns."""
        periods = turns * self._turn / self._period
        return math.isclose(periods, round(periods))

    def _value(self, phase: int) -> tuple[float, float]:
        travelled, ahead = self._fold(phase % self._period)
        # Multiplication by a power of two is exact.
        angle = float(self._low + travelled) * STEP
        if self._sweep is None and angle >= self._end:
            # A value just below the period may round up to it.
            angle = 0.0
        return angle, self._speed if ahead else -self._speed or 0.0

    @classmethod
    def of(cls, settings: InputSettings, since: int = 0) -> Motion:
        """Return the motion of an input, which is at its `start` at the time `since` [ns]."""
        return cls(settings.speed, settings.sweep, settings.start, since, settings.input.is_angle,
                   settings.input.period)

    def changed(self, speed: float, sweep: Arc | None, period: float, now: int) -> Motion:
        """Return a motion with other settings from this one's value at `now` [ns]."""
        motion = Motion(speed, sweep, since=now, turns=self._turns, period=period)
        travelled, ahead = self._fold(self._phase_at(now))
        place = motion._place(self._low + travelled)
        motion._phase = place if ahead or sweep is None else -place
        return motion

    def moved(self, before: int, now: int) -> Motion:
        """Return this motion shifted in time: its value at `before` [ns] becomes that at `now`."""
        motion = copy(self)
        motion._since += now - before
        return motion

    def _phase_at(self, now: int) -> int:
        return (self._phase + self._rate * (now - self._since)) % self._period

    def _fold(self, phase: int) -> tuple[int, bool]:
        """Return how far the value at a phase is above the low end, and whether it rises there."""
        ahead = phase < self._width
        return (phase, ahead) if ahead else (2 * self._width - phase, ahead)

    def _place(self, angle: int) -> int:
        """Return the phase at which the rising value is `angle`, or nearest to it."""
        place, turn = angle - self._low, self._round
        if self._sweep is None:
            return place % turn
        if self._turns and not 0 <= place <= self._width:
            # In the turn nearest to the sweep.
            ahead = (turn - self._width) // 2
            place = (place + ahead) % turn - ahead
        return min(max(place, 0), self._width)
