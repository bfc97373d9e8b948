# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The backend of plans in machine code: one call reads a message, solves and patches messages."""

from __future__ import annotations

import math
from typing import AbstractSet, Any, Iterator, Union

import numpy as np

from ..formula import llvm_pipeline as native
from ..linkage.walker import Solution


def backend(plan: Any) -> Any:
    """Return a plan's LlvmBackend, or None as long as code is being compiled."""
    ready = plan.sender and plan.sender.size and native.code().done() and all(
        solution.batch.code for _, solution in plan.solved)
    return LlvmBackend(plan) if ready else None


class LlvmBackend:
    """Runs a plan in one native call, with precomputed tables of addresses."""

    def __init__(self, plan: Any):
        self._plan = plan
        sender = plan.sender
        self._stamp = np.zeros(2, np.int64)
        copies = [row for moved in plan.solved for row in _copies(*moved)]
        loops = [(*solution.batch.code, solution.values.size - solution.layout.efforts)
                 for _, solution in plan.solved]
        limits = [row for i, (mechanism, solution) in enumerate(plan.solved)
                  for row in _limits(i, mechanism, solution)]
        same, mask = (number.to_bytes(sender.size, 'little')
                      for number in (sender.same, sender.mask))
        self._pipeline = native.Pipeline(
            same, mask, self._stamp, plan, [*_readings(plan)], copies, loops, limits)
        self._solved = [mechanism for mechanism, _ in plan.solved]
        at = native.address(self._stamp)
        self._stamps = np.array([(at, native.address(one)) for one in (
            plan.stamp, *(mechanism.stamp for mechanism in plan.mechanisms))], native.PUT)
        conversions = [_conversion(mechanism, solution) for mechanism, solution in plan.solved]
        self._changes = np.concatenate([np.zeros(0, native.CHANGE), *conversions])

    def run(self, data: bytes, output: Any) -> Union[bool, AbstractSet]:
        """Read a serialised message, solve, and publish `output`; see `PythonBackend.run`."""
        ending = output and (output.compiled or self._ending(output))
        failed = self._pipeline.run(data, ending)
        if failed == native.UNSTAMPED:
            self._stamp[1:] = np.frombuffer(self._plan.now(), np.int64)
            failed = self._pipeline.run(data, ending)
            self._stamp[1] = 0
        if failed < 0:
            return False
        if not failed and ending:
            ending.publish()
            return True
        return {mechanism for mechanism, wrong in zip(self._solved, self._pipeline.failed)
                if wrong} if failed else frozenset()

    def publish(self, output: Any) -> None:
        """Convert the solutions, and publish the messages of an Output."""
        ending = output.compiled or self._ending(output)
        ending.run()
        ending.publish()

    def _ending(self, output: Any) -> _Ending:
        output.compiled = _Ending(self._plan, output, self._stamps, self._changes)
        return output.compiled


class _Ending(native.Ending):
    """The native call that converts the solutions and writes them into an output's messages."""

    def __init__(self, plan: Any, output: Any, stamps: np.ndarray, changes: np.ndarray):
        puts = [_puts(message) for message in output.messages if message.publisher.template]
        super().__init__((plan, output), changes, np.concatenate([stamps, *puts]))
        self._patched = [(one.publisher.publisher.publish, one.publisher.template.message)
                         for one in output.messages if one.publisher.template]
        self._built = [one for one in output.messages if not one.publisher.template]

    def publish(self) -> None:
        """Publish the patched messages, and build those that cannot be patched."""
        for publish, message in self._patched:
            publish(message.tobytes())
        for publisher, values, stamp in self._built:
            publisher.publish(stamp.tobytes(), values)


def _readings(plan: Any) -> Iterator[tuple]:
    """Yield rows of numbers to read: byte offset in the message, address, factor, addend."""
    for mechanism, i, index in plan.readings:
        state, (factor, plus) = native.addresses(mechanism.inputs), mechanism.conversion(i)
        yield plan.sender.positions + 8 * index, state[0, i], factor, plus
        if plan.has_velocities:
            yield plan.sender.velocities + 8 * index, state[1, i], factor, -0.0


def _copies(mechanism: Any, solution: Solution) -> Iterator[tuple]:
    """Yield pairs of addresses, from and to, that copy inputs and speeds to every leg."""
    driven = native.addresses(solution.layout.driven(solution.values))
    state = native.addresses(mechanism.inputs).ravel()
    for start, given, own in zip(state, native.addresses(solution.batch.arguments), driven):
        for end in (*given, own):
            yield start, end


def _limits(loop: int, mechanism: Any, solution: Solution) -> Iterator[tuple]:
    """Yield a row for each leg: its input must be in the widest interval of the reach."""
    assembly = mechanism.model.assembly
    if not assembly.is_limited:
        return
    first, (low, high) = assembly.linkage.inputs[0], max(
        assembly.reach, key=lambda arc: arc[1] - arc[0])
    for at, (factor, plus) in zip(native.addresses(solution.batch.arguments)[0],
                                  assembly.own_inputs()):
        yield (loop, at, factor, plus, 0.5 * (low + high), 0.5 * (high - low),
               first.turn if first.wraps else 0.0)


def _conversion(mechanism: Any, solution: Solution) -> np.ndarray:
    """Return the table of a solution's conversions; see `MechanismModel.conversion`."""
    conversion = mechanism.model.conversion(solution.layout)
    rows = np.zeros(solution.values.size if conversion else 0, native.CHANGE)
    if conversion:
        rows['at'] = native.addresses(solution.values)
        rows['factor'], rows['plus'], wrapped = conversion
        rows['turn'][wrapped] = math.tau
    return rows


def _puts(message: Any) -> np.ndarray:
    """Return the table of values and stamps to write into a message, as pairs of addresses."""
    template = message.publisher.template
    numbers, sources, stamps = template.places()
    start = native.address(np.frombuffer(template.message, np.uint8))
    values = np.concatenate([native.addresses(values) for values in message.values])
    rows = np.empty(len(numbers) + len(stamps), native.PUT)
    rows['from'] = np.append(values[sources], np.full(len(stamps), native.address(message.stamp)))
    rows['to'] = start + np.append(numbers, stamps)
    return rows
