# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Solve outputs for the positions of actuators, and explain why values are unreachable."""

from __future__ import annotations

from concurrent.futures import Future
import math
from typing import Any, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from .input_settings import in_words, InputSettings
from .scene_mechanism import SceneMechanism
from ..formula.program import compile_in_background
from ..linkage import Input, Solution
from ..words import listed

LEVER = 'lever'
# A request with this many values starts the compilation of machine code for later requests.
MANY = 256


class Command(NamedTuple):
    """
    A command to the actuators, one number for each input.

    Attributes
    ----------
    inputs : sequence of float
        The inputs [rad or m]; NaN if the reach and sweeps have none for the outputs' values.
    positions : sequence of float
        The actuators' positions.
    speeds : sequence of float
        The actuators' speeds, if known; infinite where an output that moves would turn back.

    """

    inputs: Sequence[float]
    positions: Sequence[float]
    speeds: Sequence[float]

    @property
    def is_valid(self) -> bool:
        """Whether there is an answer."""
        return all(map(math.isfinite, self.inputs))


class SceneAnswer(NamedTuple):
    """Inputs [rad or m] that give outputs their values, and the working mode; see `Solution`."""

    inputs: Tuple[float, ...]
    mode: str
    is_singular: bool


def present_inputs(mechanism: SceneMechanism, positions: Mapping[str, float]) -> List[float]:
    """Return the inputs [rad or m] at the last position of each source; inf if unknown."""
    known = [mechanism.from_source(settings, positions[settings.source], None, None)[0]
             if settings.source in positions else math.inf
             for settings in mechanism.inputs.values()]
    return [value if math.isfinite(value) else math.inf for value in known]


class InverseRequest:
    """
    The inverse of a scene's mechanism for some outputs, as many as it has inputs.

    Outputs are joint angles, slides, coordinates, distances and angles, named as in
    `Mechanism.has_output`; an empty name is the lever. All values are those of the scene: lengths
    [m] include its scale, positions are those of the actuators. Every answer lies inside the
    sweeps and the reach, on the linkage's assembly.

    - `positions(values)`: positions and rates for arrays of values. Without `seed` the first
      value is solved on the working branch, independently of the present inputs; with one `seed`,
      next to it. Each further value continues from the one before. With a `seed` for each value,
      each is solved next to its own.
    - `answers(values, seed)`: all answers to one value of each output, the nearest first.
    - `command(values, speeds, seed)`: the answer that continues from the last without a jump.
    - `reason(values)`: why values are unreachable; expensive, and only for messages.

    Raises
    ------
    ValueError
        If these outputs do not determine the inputs.

    """

    def __init__(self, mechanism: SceneMechanism, outputs: Sequence[str]):
        self._mechanism, self._settings = mechanism, list(mechanism.inputs.values())
        self.outputs = [output or LEVER for output in outputs]
        self._inverse = mechanism.linkage.inverse(tuple(self.outputs))
        self.quantity = 'lever angles' if self.outputs == [LEVER] else \
            f'values of {listed(self.outputs)}'
        self.sources = [settings.source for settings in self._settings]
        self.units = [settings.input.unit for settings in self._settings]
        self._units = [mechanism.scale_of(name) for name in self.outputs]
        self._scales = [mechanism.scale_of(name) for name in mechanism.inputs]
        self._actuators = [settings.actuator for settings in self._settings]
        # Factors of the linkage's rates: of each output by the first actuator, by the second, ...
        self._rate_units = [unit / scale * ratio
                            for scale, (ratio, _) in zip(self._scales, self._actuators)
                            for unit in self._units]
        # The ends of the sweeps, without the scale.
        self._ends = [settings.ends and (settings.ends[0] / scale, settings.ends[1] / scale)
                      for settings, scale in zip(self._settings, self._scales)]
        self._compilation: Optional[Future] = None

    @property
    def is_closed(self) -> bool:
        """Whether the answers are closed forms, so that none is searched."""
        return self._inverse.is_quick

    def inputs_of(self, positions: Sequence[Any]) -> List[Any]:
        """Return the inputs [rad or m] at their actuators' positions."""
        return [ratio * position + offset
                for (ratio, offset), position in zip(self._actuators, positions)]

    def positions_of(self, inputs: Sequence[Any]) -> List[Any]:
        """Return the actuators' positions at inputs [rad or m]."""
        return [(input_ - offset) / ratio if offset or ratio != 1.0 else input_
                for (ratio, offset), input_ in zip(self._actuators, inputs)]

    def positions(self, values: Sequence[Any], seed: Optional[Sequence[Any]] = None
                  ) -> Tuple[List[Any], List[Any]]:
        """
        Return actuators' positions for values of the outputs, and the rates there.

        Parameters
        ----------
        values : sequence of float or array (n,)
            For each output its values.
        seed : sequence of float or array (n,), optional
            For each actuator a position next to the first answer, or one for each value.

        Returns
        -------
        (list of float or array, list of float or array)
            For each actuator its positions; the rates of each output by the first actuator, then
            by the second and so on; NaN where a value is unreachable.

        """
        inverse, many = self._inverse, isinstance(values[0], np.ndarray)
        has_seeds = seed is not None and np.size(seed[0]) == np.size(values[0])
        values = [value / unit for value, unit in zip(values, self._units)]
        if seed is not None:
            seed = [input_ / scale for input_, scale in zip(self.inputs_of(seed), self._scales)]
        if many and np.size(values[0]) >= MANY:
            inverse = self._accelerated()
        inputs, rates = (inverse.path if many and not has_seeds else inverse.nearest)(
            values, seed, self._ends)
        return self.positions_of(_times(inputs, self._scales)), _times(rates, self._rate_units)

    def _accelerated(self) -> Any:
        """Return the inverse in machine code once it is compiled; until then in Python."""
        if self._compilation is None:
            def make() -> Any:
                inverse = self._mechanism.linkage.accelerated().inverse(tuple(self.outputs))
                inverse.path([np.zeros(MANY)] * len(self.outputs))
                return inverse

            self._compilation = compile_in_background(make)
        done = self._compilation.done() and not self._compilation.exception()
        return self._compilation.result() if done else self._inverse

    def command(self, values: Sequence[float], speeds: Optional[Sequence[float]],
                seed: Sequence[float], jumps: bool = False) -> Command:
        """
        Return the command for values of the outputs and their speeds.

        Parameters
        ----------
        values, speeds : sequence of float
            For each output [rad or m, per second]; speeds only if known.
        seed : sequence of float
            The last inputs [rad or m], from which the answer continues without a jump.
        jumps : bool
            Whether several inputs may jump to the nearest answer if none continues from the last;
            a single input always may.

        """
        unscaled = [value / unit for value, unit in zip(values, self._units)]
        start = [input_ / scale for input_, scale in zip(seed, self._scales)]
        solution, rates = self._inverse.follow(unscaled, start)
        if not self._are_inside(solution):
            solution, rates = self._inverse.nearest(unscaled, start, self._ends) \
                if jumps or len(start) == 1 else ((math.nan,) * len(start), rates)
        inputs = [input_ * scale for input_, scale in zip(solution, self._scales)]
        return Command(inputs, self.positions_of(inputs),
                       self._speeds(speeds, rates) if speeds else ())

    def _are_inside(self, inputs: Sequence[float]) -> bool:
        return all(end[0] <= value <= end[1] if end else value == value
                   for end, value in zip(self._ends, inputs))

    def _speeds(self, speeds: Sequence[float], rates: Sequence[float]) -> List[float]:
        """Return the actuators' speeds for speeds of the outputs, at the linkage's rates."""
        n = len(speeds)
        if n == 1:
            rate = rates[0] * (self._units[0] / self._scales[0]) * self._actuators[0][0]
            return [speeds[0] / rate if rate else math.copysign(math.inf, speeds[0])
                    if speeds[0] else 0.0]
        jacobian = np.reshape(rates, (n, n)).T * np.divide.outer(self._units, self._scales)
        try:
            inputs = np.linalg.solve(jacobian, speeds)
            return (inputs / [ratio for ratio, _ in self._actuators]).tolist()
        except np.linalg.LinAlgError:
            return n * [math.inf if any(speeds) else 0.0]

    def answers(self, values: Sequence[float], seed: Optional[Sequence[float]] = None
                ) -> List[SceneAnswer]:
        """
        Return all answers to one value of each output, as inputs [rad or m] of the scene.

        They are sorted by their distance from the inputs `seed` [rad or m], by default the start.
        """
        seed = [settings.start for settings in self._settings] if seed is None else seed
        answers = self._inside(self._inverse.all(np.divide(values, self._units),
                                                 np.divide(seed, self._scales)))
        sizes = [settings.input.size for settings in self._settings]
        return sorted(answers, key=lambda answer: math.dist(
            np.divide(answer.inputs, sizes), np.divide(seed, sizes)))

    def _inside(self, answers: Sequence[Solution]) -> List[SceneAnswer]:
        """Return those of the linkage's answers that lie inside the sweeps."""
        inside = []
        for answer in answers:
            inputs = [_between_ends(settings, input_, value * scale)
                      for settings, input_, value, scale in zip(
                          self._settings, self._inverse.inputs, answer.inputs, self._scales)]
            if not any(map(math.isnan, inputs)):
                inside.append(SceneAnswer(tuple(inputs), answer.mode, answer.is_singular))
        return inside

    def reason(self, *values: float) -> str:
        """Return in words why values are unreachable."""
        if not all(map(math.isfinite, values)):
            return 'a value must be finite'
        answers = self._inverse.all([value / unit for value, unit in zip(values, self._units)])
        if len(values) == 1:
            return self._reason(values[0], answers)
        what = f'{listed(self.outputs)} at {listed(f"{value:.6g}" for value in values)}'
        if self._inside(answers):
            return f'the way to {what} leads through a singular pose, out of the reach or a sweep'
        if not answers or not any(settings.ends for settings in self._settings):
            return f'{what} is outside the reach'
        sweeps = (f'{settings.input.name}.sweep {in_words([settings.ends])}'
                  for settings in self._settings if settings.ends)
        return f'{what} needs inputs outside {listed(sweeps)}'

    def _reason(self, value: float, answers: Sequence[Solution]) -> str:
        """Return why a value of a single output is unreachable; `answers` are out of the sweep."""
        settings, output, scale = self._settings[0], self.outputs[0], self._scales[0]
        arcs, where = settings.reach, ''
        if settings.ends:
            low, high = settings.ends
            where = f'{settings.input.name}.sweep {in_words([settings.ends])}'
            if answers:
                middle = 0.5 * (low + high)
                nearest = min((settings.input.beside(answer.inputs[0] * scale, middle)
                               for answer in answers), key=lambda input_: abs(input_ - middle))
                return (f'{value:.6g} needs the {settings.input.name} at {nearest:.6g} '
                        f'{self.units[0]}, outside {where}')
            arcs = ((low, min(high, low + settings.input.turn) if settings.input.wraps else high),)
        spans = self._mechanism.linkage.extremes(output, [
            (low / scale, high / scale) for low, high in arcs])
        reached = in_words((low * self._units[0], high * self._units[0])
                           for (low, _), (high, _) in spans)
        unit = 'rad' if self._mechanism.linkage.is_angle(output) else 'm'
        return (f'{"the lever" if output == LEVER else output} reaches {reached} {unit}'
                f'{where and " in "}{where}')


def _times(values: Sequence[Any], factors: Sequence[float]) -> List[Any]:
    return [value if factor == 1.0 else value * factor for value, factor in zip(values, factors)]


def _between_ends(settings: InputSettings, input_: Input, value: float) -> float:
    """Return an input between its ends, a crank after whole periods if needed; else NaN."""
    low, high = settings.ends or (value, value)
    if input_.wraps and not low <= value <= high:
        turn = input_.turn
        value += turn * (math.ceil((low - value) / turn) if value < low else
                         math.floor((high - value) / turn))
    return value if low <= value <= high else math.nan
