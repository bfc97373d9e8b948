# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Solve outputs for the positions of actuators, and explain why values are unreachable."""

from __future__ import annotations

import math
import operator
from typing import Any, Iterable, Mapping, NamedTuple, Sequence

import numpy as np

from .input_settings import in_words
from .scene_mechanism import divided, SceneMechanism
from ..linkage import Solution
from ..words import join_names

LEVER = 'lever'


class ActuatorCommand(NamedTuple):
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


def present_inputs(mechanism: SceneMechanism, positions: Mapping[str, float]) -> list[float]:
    """Return the inputs [rad or m] at the last position of each source; starts if unknown."""
    known = [(settings.start, mechanism.from_source(
        settings, positions.get(settings.source, math.nan), None, None)[0])
        for settings in mechanism.inputs.values()]
    return [value if math.isfinite(value) else start for start, value in known]


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
        self.inverse = mechanism.linkage.inverse(tuple(self.outputs))
        self._units, self._scales = [*map(mechanism.scale_of, self.outputs)], mechanism.scales
        self._actuators = [settings.actuator for settings in self._settings]
        # Factors of the linkage's rates: of each output by the first actuator, by the second, ...
        self._rate_units = [unit / scale * ratio
                            for scale, (ratio, _) in zip(self._scales, self._actuators)
                            for unit in self._units]

    def inputs_of(self, positions: Sequence[Any]) -> list[Any]:
        """Return the inputs [rad or m] at their actuators' positions."""
        return [ratio * position + offset
                for (ratio, offset), position in zip(self._actuators, positions)]

    def positions_of(self, inputs: Iterable[Any]) -> list[Any]:
        """Return the actuators' positions at inputs [rad or m]."""
        return [(value - offset) / ratio
                for (ratio, offset), value in zip(self._actuators, inputs)]

    def positions(self, values: Sequence[Any], seed: Sequence[Any] | None = None
                  ) -> tuple[list[Any], list[Any]]:
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
        is_path = isinstance(values[0], np.ndarray) and (
            seed is None or np.size(seed[0]) != np.size(values[0]))
        solve = self.inverse.path if is_path else self.inverse.nearest
        inputs, rates = solve(
            divided(values, self._units),
            None if seed is None else divided(self.inputs_of(seed), self._scales),
            self._mechanism.ends)
        return (self.positions_of(map(operator.mul, inputs, self._scales)),
                [*map(operator.mul, rates, self._rate_units)])

    def command(self, values: Sequence[float], speeds: Sequence[float] | None,
                seed: Sequence[float], jumps: bool = False) -> ActuatorCommand:
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
        inputs, rates = self._mechanism.follow(
            self.outputs, values, seed, jumps or len(seed) == 1)
        return ActuatorCommand(
            inputs, self.positions_of(inputs), self._speeds(speeds, rates) if speeds else ())

    def _speeds(self, speeds: Sequence[float], rates: Sequence[float]) -> list[float]:
        """Return the actuators' speeds for speeds of the outputs, at rates by the inputs."""
        n = len(speeds)
        try:
            inputs = np.linalg.solve(np.reshape(rates, (n, n)).T, speeds)
            return (inputs / [ratio for ratio, _ in self._actuators]).tolist()
        except np.linalg.LinAlgError:
            return n * [math.inf if any(speeds) else 0.0]

    def answers(self, values: Sequence[float], seed: Sequence[float] | None = None
                ) -> list[tuple[list[float], Solution]]:
        """
        Return all answers to one value of each output: inputs [rad or m], and the linkage's own.

        They are sorted by their distance from the inputs `seed` [rad or m], by default the start.
        """
        seed = [settings.start for settings in self._settings] if seed is None else seed
        return [([*map(operator.mul, solution.inputs, self._scales)], solution)
                for solution in self.inverse.all(divided(values, self._units), divided(
                    seed, self._scales), self._mechanism.ends)]

    def reason(self, *values: float) -> str:
        """Return in words why values are unreachable."""
        if not all(map(math.isfinite, values)):
            return 'a value must be finite'
        middles = [0.5 * sum(settings.ends or (2.0 * settings.start,))
                   for settings in self._settings]
        what = f'{join_names(self.outputs)} at ' * (len(values) > 1) + join_names(
            f'{value:.6g}' for value in values)
        if self.answers(values, middles):
            return f'the way to {what} leads through a singular pose, out of the reach or a sweep'
        limited = [settings for settings in self._settings if settings.ends]
        sweeps = ', '.join(f'{settings.input.name}.sweep {in_words(settings.arcs)}'
                           for settings in limited)
        answers = limited and self.inverse.all(
            divided(values, self._units), divided(middles, self._scales))
        if answers:
            needed = ', '.join(
                f'{settings.input.name} at {value * scale:.6g} {settings.input.unit}'
                for settings, value, scale in zip(self._settings, answers[0].inputs, self._scales))
            return f'{what} needs the {needed}, outside {sweeps}'
        if len(values) > 1:
            return f'{what} is outside the reach'
        output, = self.outputs
        if not len(self._mechanism.linkage.monotone(output)):
            return f'{output} stands still, so that no value of it determines the input'
        reached = in_words((low, high) for (low, _), (high, _) in self._mechanism.extremes(output))
        unit = 'rad' if self._mechanism.linkage.is_angle(output) else 'm'
        return f'{output} reaches {reached} {unit}' + f' in {sweeps}' * bool(limited)
