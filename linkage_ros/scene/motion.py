# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
An input as a function of the clock.

Angles are counted in whole steps of 2^-160 rad, lengths of 2^-160 m, and time in whole
nanoseconds, so nothing is lost however long an input moves: the only rounding is of the answer.
"""

from __future__ import annotations

from typing import Optional, Tuple

from . import InputSettings
from ..linkage.inputs import Arc

STEPS, STEP = 1 << 160, 2.0 ** -160
TURN = 62831853071795864769252867665590057683943387987502116 * STEPS // 10 ** 52


def _steps(value: float, per: int = 1) -> int:
    numerator, denominator = float(value).as_integer_ratio()
    return numerator * STEPS // (denominator * per)


class Motion:
    """
    An input that turns, or moves to and fro as a triangle wave, at a constant speed.

    Its phase runs through one turn, or from the low end of the sweep to the high end and back.

    Parameters
    ----------
    speed : float
        Speed [rad/s or m/s]; to and fro, its sign is the direction from the start.
    sweep : (float, float), optional
        Ends between which it moves to and fro [rad or m]; None: it turns all round.
    start : float
        Where it is at the time `since` [rad or m]; outside the sweep it is at the nearer end.
    since : int
        Time [ns].
    turns : bool
        Whether it is the same a turn later.
    period : int
        After how many turns it begins again, where it turns all round.

    """

    def __init__(self, speed: float, sweep: Optional[Arc] = None, start: float = 0.0,
                 since: int = 0, turns: bool = True, period: int = 1):
        self._speed = speed
        self._rate = _steps(speed, per=10 ** 9)
        self._sweep = sweep
        self._turns, self._round = turns, period * TURN
        self._low, high = (0, self._round) if sweep is None else map(_steps, sweep)
        self._width, self._end = high - self._low, high / STEPS
        self._period = self._round if sweep is None else 2 * self._width
        self._phase = self._place(_steps(start))
        self._since = since

    def at(self, now: int) -> Tuple[float, float]:
        """Return the value, an angle from 0 to its period or in the sweep, and its speed."""
        travelled, ahead = self._fold((self._phase + self._rate * (now - self._since))
                                      % self._period)
        # To multiply by a power of two rounds nothing.
        angle = float(self._low + travelled) * STEP
        if self._sweep is None and angle >= self._end:
            # What is just below the period may round up to it.
            angle = 0.0
        return angle, self._speed if ahead else -self._speed or 0.0

    @classmethod
    def of(cls, drive: InputSettings, since: int = 0) -> Motion:
        """Return how an input moves from its start."""
        return cls(drive.speed, drive.sweep, drive.start, since, drive.input.turns, drive.period)

    def changed(self, speed: float, sweep: Optional[Arc], now: int) -> Motion:
        """Return the motion that takes over from this one at a time [ns], without a jump."""
        taken = Motion(speed, sweep, since=now, turns=self._turns, period=self._round // TURN)
        phase = self._phase_at(now)
        if sweep == self._sweep:
            taken._phase = phase
            return taken
        travelled, ahead = self._fold(phase)
        place = taken._place(self._low + travelled)
        taken._phase = place if ahead or sweep is None else -place
        return taken

    def moved(self, before: int, now: int) -> Motion:
        """Return the motion that is at `now` [ns] where this one is at `before` [ns]."""
        motion = self.changed(self._speed, self._sweep, before)
        motion._since = now
        return motion

    def _phase_at(self, now: int) -> int:
        return (self._phase + self._rate * (now - self._since)) % self._period

    def _fold(self, phase: int) -> Tuple[int, bool]:
        """Return how far from the low end a phase is, and whether it is on the way up."""
        ahead = phase < self._width
        return (phase, ahead) if ahead else (2 * self._width - phase, ahead)

    def _place(self, angle: int) -> int:
        """Return the phase of an angle, on the way up."""
        if self._sweep is None:
            return angle % self._round
        half = self._width // 2
        if self._turns and not 0 <= angle - self._low <= self._width:
            angle = (angle - self._low - half + TURN // 2) % TURN - TURN // 2 + self._low + half
        return min(max(angle - self._low, 0), self._width)
