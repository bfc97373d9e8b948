# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Plans in plain Python and numpy: the executor without optional packages."""

from __future__ import annotations

from typing import AbstractSet, Any, Optional

import numpy as np

from .message_layout import NEVER


class PythonExecutor:
    """Runs the steps of a plan one by one."""

    def __init__(self, plan: Any):
        self._plan, self._solved = plan, frozenset(mechanism for mechanism, _ in plan.solved)
        self._readings = [(one.mechanism, one.input, one.place,
                           *one.mechanism.conversion(one.input))
                          for one in plan.readings]

    def run(self, text: bytes, _: Any) -> Optional[AbstractSet]:
        """
        Read a message and solve.

        Return the mechanisms whose numbers may be irregular; None if the message is from another
        source; True if the executor has published the output, too.
        """
        plan = self._plan
        if plan.source:
            if not plan.source.is_of(text):
                return None
            self._read(text)
        for mechanism, solution in plan.solved:
            mechanism.solve(solution)
        return self._solved

    def _read(self, text: bytes) -> None:
        stamp, positions, velocities = self._plan.source.read(text)
        stamp = np.frombuffer(self._plan.now() if stamp == NEVER else stamp, np.int64)
        self._plan.stamp[:] = stamp
        for mechanism in self._plan.mechanisms:
            mechanism.stamp[:] = stamp
        for mechanism, i, place, factor, plus in self._readings:
            mechanism.receive(i, factor * positions[place] + plus,
                              factor * velocities[place] if self._plan.is_moving else None)

    def publish(self, output: Any) -> None:
        """Convert the solutions and publish the messages."""
        for mechanism, solution in self._plan.solved:
            mechanism.convert(solution)
        for publisher, values, stamp in output.messages:
            publisher.publish(stamp.tobytes(), values)
