# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The backend of plans in Python and numpy, which needs no optional package."""

from __future__ import annotations

from typing import AbstractSet, Any, Union

import numpy as np

from .message_layout import NEVER


class PythonBackend:
    """Runs the steps of a plan one by one."""

    def __init__(self, plan: Any):
        self._plan, self._solved = plan, frozenset(mechanism for mechanism, _ in plan.solved)
        self._readings = [(one.mechanism, one.input, one.source_index,
                           *one.mechanism.conversion(one.input))
                          for one in plan.readings]

    def run(self, data: bytes, output: Any) -> Union[bool, AbstractSet]:
        """
        Read a serialised message and solve; this backend leaves `output` to `publish`.

        Return False, without any effect, if the message is from another sender. Return True if all
        solutions are regular (see `Validity`) and `output` has been published. Otherwise return
        the mechanisms whose solutions may be irregular.
        """
        plan = self._plan
        if plan.sender:
            if not plan.sender.has_sent(data):
                return False
            self._read(data)
        for mechanism, solution in plan.solved:
            mechanism.solve(solution)
        return self._solved

    def _read(self, data: bytes) -> None:
        stamp, positions, velocities = self._plan.sender.read(data)
        stamp = np.frombuffer(self._plan.now() if stamp == NEVER else stamp, np.int64)
        self._plan.stamp[:] = stamp
        for mechanism in self._plan.mechanisms:
            mechanism.stamp[:] = stamp
        for mechanism, i, index, factor, plus in self._readings:
            mechanism.receive(i, factor * positions[index] + plus,
                              factor * velocities[index] if self._plan.has_velocities else None)

    def publish(self, output: Any) -> None:
        """Convert the solutions, and publish the messages of an Output."""
        for mechanism, solution in self._plan.solved:
            mechanism.convert(solution)
        for publisher, values, stamp in output.messages:
            publisher.publish(stamp.tobytes(), values)
