# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Solve outputs for the positions of actuators, and explain why values cannot be had."""

from __future__ import annotations

from concurrent.futures import Future
from functools import cached_property
import math
from typing import Any, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from .input_settings import in_words, InputSettings
from .scene_mechanism import SceneMechanism
from ..formula.program import compile_in_background
from ..linkage.inputs import Arc, Input
from ..linkage.inverse import CLOSE
from ..words import listed

LEVER = 'lever'
# From so many values at once on it is worth to have machine code made for the next ones.
MANY = 256


class Command(NamedTuple):
    """
    What actuators are to do, one number for each input.

    Attributes
    ----------
    inputs : sequence of float
        Where the inputs are then [rad or m]; NaN where there are none in the reach and sweeps.
    positions : sequence of float
        What their sources tell then.
    speeds : sequence of float, optional
        Of the sources, if they are known; infinite where an output that moves would turn back.

    """

    inputs: Sequence[float]
    positions: Sequence[float]
    speeds: Optional[Sequence[float]]


class SceneAnswer(NamedTuple):
    """Inputs [rad or m] that give outputs their values, and the working mode; see `Answer`."""

    inputs: Tuple[float, ...]
    mode: str
    is_singular: bool


def present(machine: SceneMechanism, positions: Mapping[str, float]) -> List[float]:
    """Return where the inputs are [rad or m], from the last position of each source, else inf."""
    known = [machine.from_source(drive, positions[drive.source], None, None)[0]
             if drive.source in positions else math.inf for drive in machine.inputs.values()]
    return [value if math.isfinite(value) else math.inf for value in known]


class InverseRequest:
    """
    Outputs of a mechanism in a scene, as many as inputs, and what these have to be for them.

    Outputs are links by their joint angle or slide, coordinates, distances and angles, as
    `Mechanism.has_output` names them; an empty name is the lever. All values are those of the
    scene: lengths [m] times its scale, positions as their sources tell them. Whatever is answered
    lies inside the sweeps and the reach, on the linkage's own assembly.

    - `positions(values)`: for arrays of values positions and rates. Without `near` the first
      value is answered on the working branch, whatever the inputs do; with one `near` next to
      that. Then the answers go on from value to value. With a `near` for each value each is
      answered next to its own.
    - `answers(values, near)`: all answers to one value of each output, the nearest first.
    - `command(values, speeds, near)`: the answer that goes on from the last without a jump.
    - `reason(values)`: why a value cannot be had; that costs much, and is asked only to be said.

    Raises
    ------
    ValueError
        If these outputs do not tell the inputs.

    """

    def __init__(self, machine: SceneMechanism, outputs: Sequence[str]):
        self._machine, self._drives = machine, list(machine.inputs.values())
        self.outputs = [output or LEVER for output in outputs]
        self._inverse = machine.linkage.inverse(tuple(self.outputs))
        self.what = 'lever angles' if self.outputs == [LEVER] else \
            f'values of {listed(self.outputs)}'
        self.sources = [drive.source for drive in self._drives]
        self.units = [drive.input.unit for drive in self._drives]
        self._units = [machine.scale_of(name) for name in self.outputs]
        self._scales = [machine.scale_of(name) for name in machine.inputs]
        self._actuators = [drive.actuator for drive in self._drives]
        # The rate of each output by the first actuator, by the second and so on, of its own.
        self._rate_units = [unit / scale * ratio
                            for scale, (ratio, _) in zip(self._scales, self._actuators)
                            for unit in self._units]
        # The ends of the sweeps as the linkage counts them.
        self._ends = [drive.ends and (drive.ends[0] / scale, drive.ends[1] / scale)
                      for drive, scale in zip(self._drives, self._scales)]
        self._compilation: Optional[Future] = None

    def inputs_of(self, positions: Sequence[Any]) -> List[Any]:
        """Return the inputs [rad or m] of their actuators' positions."""
        return [ratio * position + offset
                for (ratio, offset), position in zip(self._actuators, positions)]

    def positions_of(self, inputs: Sequence[Any]) -> List[Any]:
        """Return the positions of the actuators of inputs [rad or m]."""
        return [(input_ - offset) / ratio if offset or ratio != 1.0 else input_
                for (ratio, offset), input_ in zip(self._actuators, inputs)]

    def positions(self, values: Sequence[Any], near: Optional[Sequence[Any]] = None
                  ) -> Tuple[List[Any], List[Any]]:
        """
        Return actuators' positions for values of the outputs, and the rates there.

        Parameters
        ----------
        values : sequence of float or array (n,)
            For each output what it is to be.
        near : sequence of float or array (n,), optional
            For each actuator a position that the first answer is to be next to, or one for each.

        Returns
        -------
        (list of float or array, list of float or array)
            For each actuator its positions; the rate of each output by the first actuator, by the
            second and so on; NaN where a value cannot be had.

        """
        inverse, many = self._inverse, isinstance(values[0], np.ndarray)
        each = near is not None and np.size(near[0]) == np.size(values[0])
        values = [value / unit for value, unit in zip(values, self._units)]
        if near is not None:
            near = [input_ / scale for input_, scale in zip(self.inputs_of(near), self._scales)]
        if many and np.size(values[0]) >= MANY:
            inverse = self._accelerated()
        found, rates = (inverse.path if many and not each else inverse.nearest)(
            values, near, self._ends)
        return self.positions_of(_times(found, self._scales)), _times(rates, self._rate_units)

    def _accelerated(self) -> Any:
        """Return the inverse in machine code once it is compiled; until then in Python."""
        if self._compilation is None:
            def make() -> Any:
                inverse = self._machine.linkage.accelerated().inverse(tuple(self.outputs))
                inverse.path([np.zeros(MANY)] * len(self.outputs))
                return inverse

            self._compilation = compile_in_background(make)
        done = self._compilation.done() and not self._compilation.exception()
        return self._compilation.result() if done else self._inverse

    def command(self, values: Sequence[float], speeds: Optional[Sequence[float]],
                near: Sequence[float], jumps: bool = False) -> Command:
        """
        Return what actuators are to do for values of the outputs and their speeds.

        Parameters
        ----------
        values, speeds : sequence of float
            Of each output [rad or m, per second]; the speeds if they are known.
        near : sequence of float
            Where the inputs were [rad or m], from which they go on without a jump.
        jumps : bool
            Whether several inputs may jump to the nearest answer if they cannot go on from there;
            one always may.

        """
        own = [value / unit for value, unit in zip(values, self._units)]
        start = [input_ / scale for input_, scale in zip(near, self._scales)]
        found, rates = self._inverse.follow(own, start)
        if not self._are_inside(found):
            found, rates = self._inverse.nearest(own, start, self._ends) \
                if jumps or len(start) == 1 else ((math.nan,) * len(start), rates)
        inputs = [x * scale for x, scale in zip(found, self._scales)]
        return Command(inputs, self.positions_of(inputs), speeds and self._speeds(speeds, rates))

    def _are_inside(self, inputs: Sequence[float]) -> bool:
        return all(end[0] <= value <= end[1] if end else value == value
                   for end, value in zip(self._ends, inputs))

    def _speeds(self, speeds: Sequence[float], rates: Sequence[float]) -> List[float]:
        """Return the actuators' speeds for those of the outputs, at rates of the linkage."""
        n = len(speeds)
        if n == 1:
            rate = rates[0] * (self._units[0] / self._scales[0]) * self._actuators[0][0]
            return [speeds[0] / rate if rate else math.copysign(math.inf, speeds[0])
                    if speeds[0] else 0.0]
        jacobian = np.reshape(rates, (n, n)).T * np.divide.outer(self._units, self._scales)
        try:
            found = np.linalg.solve(jacobian, speeds) / [ratio for ratio, _ in self._actuators]
        except np.linalg.LinAlgError:
            found = np.full(n, math.inf if any(speeds) else 0.0)
        return found.tolist()

    def answers(self, values: Sequence[float], near: Optional[Sequence[float]] = None
                ) -> List[SceneAnswer]:
        """
        Return all answers to one value of each output, inputs [rad or m] as the scene has them.

        The nearest to the inputs `near` [rad or m] is the first; by default to their start.
        """
        near = [drive.start for drive in self._drives] if near is None else near
        found = []
        for answer in self._inverse.all(np.divide(values, self._units),
                                        np.divide(near, self._scales)):
            inputs = [_inside(drive, input_, value * scale) for drive, input_, value, scale in zip(
                self._drives, self._inverse.inputs, answer.inputs, self._scales)]
            if not any(map(math.isnan, inputs)):
                found.append(SceneAnswer(tuple(inputs), answer.mode, answer.is_singular))
        sizes = [drive.input.size for drive in self._drives]
        return sorted(found, key=lambda answer: math.dist(
            np.divide(answer.inputs, sizes), np.divide(near, sizes)))

    # Why not.

    def reason(self, *values: float) -> str:
        """Return in words why values cannot be had."""
        if not all(map(math.isfinite, values)):
            return 'a value must be finite'
        own = [value / unit for value, unit in zip(values, self._units)]
        answers = self._inverse.all(own)
        if len(values) == 1:
            return self._reason(values[0], [answer.inputs[0] * self._scales[0]
                                            for answer in answers])
        what = f'{listed(self.outputs)} at {listed(f"{value:.6g}" for value in values)}'
        if self.answers(values):
            return f'the way to {what} leads through a singular pose, out of the reach or a sweep'
        if not answers or not any(drive.ends for drive in self._drives):
            return f'{what} is nowhere in the reach'
        sweeps = (f'{drive.input.name}.sweep {in_words([drive.ends])}'
                  for drive in self._drives if drive.ends)
        return f'{what} takes inputs outside {listed(sweeps)}'

    def _reason(self, value: float, inputs: Sequence[float]) -> str:
        drive = self._drives[0]
        if inputs and drive.ends:
            beyond = min((self._beyond(end, input_, name) for input_ in inputs
                          for end, name in zip(drive.ends, ('lower', 'upper'))))
            return (f'{value:.6g} needs the {drive.input.name} at {beyond[1]:.6g} '
                    f'{self.units[0]}, outside {self._where}: beyond its {beyond[2]} end')
        return self._out_of_range(value)

    def _beyond(self, end: float, input_: float, name: str) -> Tuple[float, float, str]:
        """Return how far beyond an end an input is, where that is, and the end's name."""
        sign, own = 1.0 if name == 'upper' else -1.0, self._inverse.inputs[0]
        gap = sign * (input_ - end)
        gap = gap % own.turn if own.turns else gap if gap > 0.0 else math.inf
        return gap, end + sign * gap, name

    @property
    def _where(self) -> str:
        drive = self._drives[0]
        return f'{drive.input.name}.sweep {in_words([drive.ends])}' if drive.ends else 'the reach'

    def _out_of_range(self, value: float) -> str:
        name, input_ = self.outputs[0], self._drives[0].input
        turns = self._machine.linkage.is_angle(name)
        gaps = [gap for (low, _), (high, _) in self._spans for gap in (low - value, value - high)]
        nearest = int(np.argmin([gap % math.tau if turns else gap if gap > 0.0 else math.inf
                                 for gap in gaps]))
        (_, at), arc = self._spans[nearest // 2][nearest % 2], self._arcs[nearest // 2]
        ends = [end for end, limit in zip(('lower', 'upper'), arc)
                if abs(limit - at) < CLOSE * input_.size and not input_.is_whole([arc])]
        end = f', the {ends[0]} end of {self._where}' if ends else ''
        spans = in_words((low, high) for (low, _), (high, _) in self._spans)
        what = 'the lever' if name == LEVER else name
        return (f'{what} reaches {spans} {"rad" if turns else "m"}, its '
                f'{("least", "greatest")[nearest % 2]} at the {input_.quantity} {at:.6g} '
                f'{self.units[0]}{end}')

    @property
    def _arcs(self) -> Sequence[Arc]:
        """Where the input may be, no more than a period."""
        drive = self._drives[0]
        if not drive.ends:
            return drive.reach
        low, high = drive.ends
        return [(low, min(high, low + drive.input.turn) if drive.input.turns else high)]

    @cached_property
    def _spans(self) -> List[List[Tuple[float, float]]]:
        """Return the least and the greatest value on each arc, with the input there."""
        scale = self._scales[0]
        found = self._machine.linkage.extremes(self.outputs[0], [
            (low / scale, high / scale) for low, high in self._arcs])
        return [[(value * self._units[0], at * scale) for value, at in span] for span in found]


def _times(values: Sequence[Any], factors: Sequence[float]) -> List[Any]:
    return [value if factor == 1.0 else value * factor for value, factor in zip(values, factors)]


def _inside(drive: InputSettings, input_: Input, value: float) -> float:
    """Return an input between its ends, where a crank's whole periods are one; else NaN."""
    low, high = drive.ends or (value, value)
    if input_.turns and not low <= value <= high:
        turn = input_.turn
        value += turn * (math.ceil((low - value) / turn) if value < low else
                         math.floor((high - value) / turn))
    return value if low <= value <= high else math.nan
