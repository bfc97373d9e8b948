# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What is wanted of outputs: where the inputs have to be, their actuators, and why not."""

from __future__ import annotations

from functools import cached_property
import math
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from .drive import Drive, in_words
from .machine import Machine
from ..formula.program import compile_in_background
from ..linkage.inputs import Arc
from ..linkage.servo import CLOSE
from ..linkage.several import Answer
from ..words import listed

LEVER = 'lever'
# From so many values at once on it is worth to have machine code made for the next ones.
MANY = 256
# Of several inputs, their actuators' positions and, where they are known, speeds.
Command = Tuple[Sequence[float], Sequence[float], Optional[Sequence[float]]]


def wanted_of(machine: Machine, outputs: Sequence[str]) -> Any:
    """Return as many outputs as there are inputs; raise ValueError if they cannot be solved."""
    if len(machine.inputs) == len(outputs) == 1:
        return Wanted(machine, *outputs)
    return WantedTogether(machine, outputs)


def present(machine: Machine, heard: Mapping[str, float]) -> List[float]:
    """Return where the inputs are, from what was heard last by source; inf where unknown."""
    known = [machine.understood(drive, heard[drive.source], None, None)[0]
             if drive.source in heard else math.inf for drive in machine.inputs.values()]
    return [value if math.isfinite(value) else math.inf for value in known]


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
            raise ValueError(f'{machine.name} has several inputs; one output does not tell them: '
                             'ask inputs_for')
        self._drive = machine.first
        self.source, self.unit = self._drive.source, self._drive.input.unit
        self.what = 'lever angles' if self._name == LEVER else f'values of {self._name}'
        self._linkage.check_output(self._name)
        self._turns = self._linkage.is_angle(self._name)
        self._scale = machine.scale_of(self._name)
        self._input_scale = machine.scale_of(self._drive.input.name)
        self._ratio, self._offset = self._drive.actuator
        # The ends of the sweep as the linkage counts them.
        self._ends = tuple(end / self._input_scale for end in self._drive.ends or ())
        self._is_plain = not self._offset and (
            self._scale == self._input_scale == self._ratio == 1.0)
        self._solvers: Dict[Tuple[bool, bool], Callable] = {}

    def input_of(self, position: Any) -> Any:
        """Return the input [rad or m] of its source's position."""
        return self._ratio * position + self._offset

    def present(self, heard: Mapping[str, float]) -> float:
        """Return where the input is, from what was heard last by source; inf where unknown."""
        return present(self._machine, heard)[0] if self.source in heard else math.inf

    def servo(self, wanted: Any, near: Any) -> Tuple[Any, Any]:
        """Return for each value where the source has to be, and d output / d source there."""
        kind = isinstance(wanted, np.ndarray) and wanted.size >= MANY, near is not None
        solve = self._solvers.get(kind) or self._solver(*kind)
        limits = self._ends if near is None else (near / self._input_scale, *self._ends)
        if self._is_plain:
            return solve(wanted, *limits)
        value, rate = solve(wanted / self._scale, *limits)
        unit = self._input_scale
        return ((value * unit - self._offset) / self._ratio,
                rate * (self._scale / unit * self._ratio))

    def _solver(self, many: bool, follows: bool) -> Callable:
        """Return what solves; for many values machine code follows it, where llvmlite is."""
        def made_of(linkage: Any) -> Callable:
            return linkage.servo_solver(self._name, follows, bool(self._ends))

        def hasten() -> None:
            quick = made_of(self._linkage.accelerated())
            quick(np.zeros(1), *(0.0,) * follows, *self._ends)
            self._solvers[many, follows] = quick

        solver = self._solvers[many, follows] = made_of(self._linkage)
        if many:
            compile_in_background(hasten)
        return solver

    def commanded(self, values: Sequence[float], speeds: Optional[Sequence[float]],
                  near: Sequence[float], jumps: bool = False) -> Command:
        """
        Return the inputs for values and their speeds, and what their actuators are to do.

        Parameters
        ----------
        values : sequence of float
            Of each output [rad or m].
        speeds : sequence of float, optional
            Of each output [rad/s or m/s], if they are known.
        near : sequence of float
            Where the inputs were [rad or m], from which they go on without a jump.
        jumps : bool
            Whether several inputs may jump to the nearest answer if they cannot go on from there.

        Returns
        -------
        (sequence of float, sequence of float, sequence of float or None)
            The inputs, NaN if there are none inside the reach and the sweeps; positions and speeds
            of their actuators. A speed is infinite where an output that moves would turn back.

        """
        input_, rate = self._machine.measured(self._name, *values, *near)
        if speeds and speeds[0]:
            speeds = (speeds[0] / (rate * self._ratio) if rate else
                      math.copysign(math.inf, speeds[0]),)
        return (input_,), ((input_ - self._offset) / self._ratio,), speeds

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


class WantedTogether:
    """
    As many outputs of a mechanism as it has inputs, and the values of these that may be taken.

    Raises
    ------
    ValueError
        If these outputs do not tell the inputs.

    """

    def __init__(self, machine: Machine, outputs: Sequence[str]):
        self._linkage, self._outputs = machine.linkage, list(outputs)
        self._drives = list(machine.inputs.values())
        # Nothing has these values; what cannot be asked is refused.
        self._linkage.inputs_for(self._outputs, [math.nan] * len(self._outputs))
        self._units = np.array([machine.scale_of(name) for name in outputs])
        self._scales = np.array([machine.scale_of(name) for name in machine.inputs])
        self._ratios, self._offsets = np.transpose([drive.actuator for drive in self._drives])

    def inputs_of(self, positions: Sequence[float]) -> np.ndarray:
        """Return the inputs [rad or m] of their sources' positions."""
        return self._ratios * positions + self._offsets

    def commanded(self, values: Sequence[float], speeds: Optional[Sequence[float]],
                  near: Sequence[float], jumps: bool = False) -> Command:
        """Return what `Wanted.commanded` does."""
        inputs, rates = self._linkage.follow_inputs(
            self._outputs, np.divide(values, self._units), np.divide(near, self._scales))
        inputs = inputs * self._scales
        if not all(drive.ends is None or drive.ends[0] <= value <= drive.ends[1]
                   for drive, value in zip(self._drives, inputs.tolist())):
            inputs = inputs * math.nan
        if jumps and np.isnan(inputs).any():
            for answer in self.answers(values, near)[:1]:
                return self.commanded(values, speeds, answer.inputs)
        return inputs.tolist(), self.told(inputs), (
            speeds and self._speeds(speeds, rates * np.divide.outer(self._units, self._scales)))

    def _speeds(self, speeds: Sequence[float], rates: np.ndarray) -> Sequence[float]:
        try:
            found = np.linalg.solve(rates, speeds) / self._ratios
        except np.linalg.LinAlgError:
            found = np.full(len(speeds), math.inf if any(speeds) else 0.0)
        return found.tolist()

    def answers(self, values: Sequence[float], near: Sequence[float]) -> List[Answer]:
        """Return answers inside the sweeps, the nearest first, inputs as the scene has them."""
        found = []
        for answer in self._linkage.inputs_for(
                self._outputs, np.divide(values, self._units), np.divide(near, self._scales)):
            inputs = [_inside(drive, value) for drive, value in zip(
                self._drives, np.multiply(answer.inputs, self._scales).tolist())]
            if np.isfinite(inputs).all():
                found.append(answer._replace(inputs=tuple(inputs)))
        sizes = [drive.input.size for drive in self._drives]
        return sorted(found, key=lambda answer: math.dist(
            np.divide(answer.inputs, sizes), np.divide(near, sizes)))

    def told(self, inputs: Sequence[float]) -> List[float]:
        """Return the positions of the sources of inputs."""
        return ((np.array(inputs) - self._offsets) / self._ratios).tolist()

    def reason(self, *values: float) -> str:
        """Return in words why values cannot be had."""
        if not all(map(math.isfinite, values)):
            return 'a value must be finite'
        what = f'{listed(self._outputs)} at {listed(f"{value:.6g}" for value in values)}'
        if self.answers(values, [drive.start for drive in self._drives]):
            return f'the way to {what} leads through a singular pose, out of the reach or a sweep'
        limited = any(drive.ends for drive in self._drives)
        if not limited or not self._linkage.inputs_for(
                self._outputs, np.divide(values, self._units)):
            return f'{what} is nowhere in the reach'
        sweeps = (f'{drive.input.name}.sweep {in_words([drive.ends])}'
                  for drive in self._drives if drive.ends)
        return f'{what} takes inputs outside {listed(sweeps)}'


def _inside(drive: Drive, value: float) -> float:
    """Return an input between its ends, where a crank's whole turns are one; else NaN."""
    low, high = drive.ends or (value, value)
    if drive.input.turns and not low <= value <= high:
        value += math.tau * (math.ceil((low - value) / math.tau) if value < low else
                             math.floor((high - value) / math.tau))
    return value if low <= value <= high else math.nan
