# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Motion of a mechanism in pictures: its joints over turns of its first input.

A turn is a full rotation of a crank, or one period of an oscillating input.
"""

import math
from typing import NamedTuple

import numpy as np

from ..robot_model.shapes import drawn
from ..scene import SceneMechanism
from ..scene.motion import Motion

SAMPLES = 720  # of a turn
MAX_TURNS = 24  # limit of the turns in which several inputs return to their starts


class Configuration(NamedTuple):
    """Turns since the start, inputs [rad or m], and joints [m] (legs, joints, 2)."""

    turns: float
    inputs: tuple[float, ...]
    places: np.ndarray


class Cycle:
    """
    The motion of a mechanism from its start until it repeats.

    Attributes
    ----------
    period : float
        Time [s] of a turn of the first input; infinite if it stands still.
    turns : int
        Turns of the first input until all inputs are at their starts, or MAX_TURNS.
    slides : list of (Shape, list of int)
        The sliding parts, and the indices of their ends after those of the joints.
    prefixes : tuple of str
        Prefixes of the names of each leg's joints.
    course : float array (turns * SAMPLES + 1, legs, joints, 2)
        All joints in that time, both ends included [m], then the ends of slides;
        NaN where they cannot be assembled.

    """

    def __init__(self, mechanism: SceneMechanism):
        assembly = mechanism.assembly()
        sliding, joints = drawn(mechanism, mechanism.points), mechanism.linkage.points
        self.slides = [(shape, [len(joints) + 2 * k, len(joints) + 2 * k + 1])
                       for k, shape in enumerate(sliding)]
        self._solution = assembly.solution((*joints, *(
            end for shape in sliding for end in (shape.start, shape.end))))
        motions = [Motion.of(settings) for settings in mechanism.inputs.values()]
        self.period = motions[0].turn
        # Each input, and its turns in one of the first.
        is_moving = math.isfinite(self.period)
        self._inputs = [*zip(motions, [1.0, *(
            self.period / motion.turn if is_moving else 0.0 for motion in motions[1:])])]
        self.turns = next((n for n in range(1, MAX_TURNS) if all(
            motion.is_repeated(n * ratio) for motion, ratio in self._inputs)), MAX_TURNS)
        self.prefixes = tuple(assembly.legs)
        self.course = np.stack([self.pose(k / SAMPLES).places
                                for k in range(self.turns * SAMPLES + 1)])
        self._locus = assembly.locus

    def pose(self, turns: float) -> Configuration:
        """Return the configuration at a time [turns]; NaN where it cannot be assembled."""
        inputs = tuple(motion.after(turns * ratio) for motion, ratio in self._inputs)
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
        if len(curve) or self.turns == MAX_TURNS:
            return curve
        return self.course[:, 0, mechanism.linkage.points.index(mechanism.tracer)]
