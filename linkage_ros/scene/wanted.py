# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What is wanted of an output: where the input has to be, its actuator, and why it cannot be."""

from __future__ import annotations

from functools import cached_property
import math
from typing import Any, List, Optional, Sequence, Tuple

import numpy as np

from .drive import in_words
from .machine import Machine
from ..linkage.inputs import Arc
from ..linkage.servo import CLOSE

LEVER = 'lever'


class Wanted:
    """
    An output of a mechanism with one input, and the values of that that may be taken.

    That is a link's joint angle or slide, or a joint's coordinate; empty: the lever.

    Raises
    ------
    ValueError
        If there are several inputs.

    """

    def __init__(self, machine: Machine, output: str):
        self._machine, self._linkage, self._name = machine, machine.linkage, output or LEVER
        if len(machine.inputs) > 1:
            raise ValueError(f'{machine.name} has several inputs; only a linkage with one can be '
                             'solved for an output')
        self._drive = machine.first
        self.source, self.unit = self._drive.source, self._drive.input.unit
        self.what = 'lever angles' if self._name == LEVER else f'values of {self._name}'
        self._linkage.check_output(self._name)
        self._turns = self._linkage.is_angle(self._name)
        self._scale = machine.scale_of(self._name)
        self._input_scale = machine.scale_of(self._drive.input.name)
        self._ratio, self._offset = self._drive.actuator

    def input_of(self, position: Any) -> Any:
        """Return the input [rad or m] of its source's position."""
        return self._ratio * position + self._offset

    def present(self, heard: Optional[float]) -> float:
        """Return where the input is, from what was heard last; infinite if that is not known."""
        if heard is None:
            return math.inf
        found, _ = self._machine.understood(self._drive, heard, None, None)
        return found if math.isfinite(found) else math.inf

    def servo(self, wanted: Any, near: Any) -> Tuple[Any, Any]:
        """Return for each value where the source has to be, and d output / d source there."""
        unit, ends = self._input_scale, self._drive.ends
        value, rate = self._linkage.servo_for(
            self._name, wanted / self._scale, near if near is None else near / unit,
            ends and (ends[0] / unit, ends[1] / unit))
        return ((value * unit - self._offset) / self._ratio,
                rate * (self._scale / unit * self._ratio))

    def commanded(self, value: float, speed: Optional[float],
                  near: float) -> Tuple[float, float, Optional[float]]:
        """
        Return the input for a value and its speed, and what its actuator is to do for it.

        Parameters
        ----------
        value : float
            Of the output [rad or m].
        speed : float or None
            Of the output [rad/s or m/s], if that is known.
        near : float
            Where the input was [rad or m], from which it goes on without a jump where it can.

        Returns
        -------
        (float, float, float or None)
            The input, NaN if there is none inside the reach and the sweep; position and speed of
            its actuator. The speed is infinite where an output that moves would turn back.

        """
        input_, rate = self._machine.measured(self._name, value, near)
        if speed:
            speed = speed / (rate * self._ratio) if rate else math.copysign(math.inf, speed)
        return input_, (input_ - self._offset) / self._ratio, speed

    def reason(self, value: float) -> str:
        """Return in words why a value cannot be had: which end of the sweep or reach forbids."""
        if not math.isfinite(value):
            return 'a value must be finite'
        inputs, _ = self._linkage.servos(self._name, value / self._scale)
        inputs = inputs[np.isfinite(inputs)] * self._input_scale
        if inputs.size and self._drive.ends:
            beyond = min((self._beyond(end, input_, name) for input_ in inputs.tolist()
                          for end, name in zip(self._drive.ends, ('lower', 'upper'))))
            return (f'{value:.6g} needs the {self._drive.input.name} at {beyond[1]:.6g} '
                    f'{self.unit}, outside {self._where}: beyond its {beyond[2]} end')
        return self._out_of_range(value)

    def _beyond(self, end: float, input_: float, name: str) -> Tuple[float, float, str]:
        """Return how far beyond an end an input is, where that is, and the end's name."""
        sign = 1.0 if name == 'upper' else -1.0
        gap = sign * (input_ - end)
        gap = gap % math.tau if self._drive.input.turns else gap if gap > 0.0 else math.inf
        return gap, end + sign * gap, name

    @property
    def _where(self) -> str:
        ends = self._drive.ends
        return f'{self._drive.input.name}.sweep {in_words([ends])}' if ends else 'the reach'

    def _out_of_range(self, value: float) -> str:
        gaps = [gap for (low, _), (high, _) in self._spans for gap in (low - value, value - high)]
        nearest = int(np.argmin([gap % math.tau if self._turns else gap if gap > 0.0 else math.inf
                                 for gap in gaps]))
        (_, at), arc = self._spans[nearest // 2][nearest % 2], self._arcs[nearest // 2]
        input_ = self._drive.input
        ends = [end for end, limit in zip(('lower', 'upper'), arc)
                if abs(limit - at) < CLOSE * input_.size and not input_.is_whole([arc])]
        end = f', the {ends[0]} end of {self._where}' if ends else ''
        spans = in_words((low, high) for (low, _), (high, _) in self._spans)
        what = 'the lever' if self._name == LEVER else self._name
        return (f'{what} reaches {spans} {"rad" if self._turns else "m"}, its '
                f'{("least", "greatest")[nearest % 2]} at the {input_.quantity} {at:.6g} '
                f'{self.unit}{end}')

    @property
    def _arcs(self) -> Sequence[Arc]:
        """Where the input may be, no more than a turn."""
        if not self._drive.ends:
            return self._drive.reach
        low, high = self._drive.ends
        return [(low, min(high, low + math.tau) if self._drive.input.turns else high)]

    @cached_property
    def _spans(self) -> List[List[Tuple[float, float]]]:
        """The least and the greatest value on each arc, with the input there."""
        unit = self._input_scale
        found = self._linkage.extremes(self._name, [(low / unit, high / unit)
                                                    for low, high in self._arcs])
        return [[(value * self._scale, at * unit) for value, at in span] for span in found]
