# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""
Plans of how to process crank messages, each made once for a sender, a scene and its subscribers.

All plans have the same steps: read the inputs, solve, check which legs are assembled, convert to
published joint values, write them into the messages, publish. Two backends run the steps on the
same arrays: `plan_python`, and `plan_llvm` once its machine code is compiled.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import AbstractSet, Any, Callable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from .driven_mechanism import DrivenMechanism
from .joint_state_reader import Reader, Sender
from .plan_python import PythonBackend
from .publishers import PatchedPublisher
from .scene_joint_states import SceneJointStates
from ..cache import Cache
from ..linkage.walker import Solution
from ..optional import needs

try:
    with needs('llvmlite'):
        from . import plan_llvm
except ImportError:
    # `kinematics` logs the reason.
    plan_llvm = None  # type: ignore[assignment]

# Maximum number of cached plans, and of cached outputs of a plan.
PLANS = 64
# Runs after which a plan tries to use machine code; then it tries every TRIED[-1] runs.
TRIED = 2, 4, 8, 16, 32, 64


class Route(NamedTuple):
    """An input, and the index of its source joint in a sender's messages."""

    mechanism: DrivenMechanism
    input: int
    source_index: int

    @property
    def is_measured(self) -> bool:
        """Whether the source joint is a sensor of an output, not the input itself."""
        return bool(self.mechanism.model.inputs[self.input].measures)


class Message(NamedTuple):
    """A message to publish: publisher, arrays of its values, packed stamp as int64 (1,)."""

    publisher: PatchedPublisher
    values: List[np.ndarray]
    stamp: np.ndarray


@dataclass(eq=False)
class Output:
    """What a plan publishes; regular if all its solutions are and none has efforts."""

    messages: List[Message]
    is_regular: bool
    # The address tables of the machine-code backend.
    compiled: Any = None


class Plan:
    """
    How to process the messages of one sender.

    If `sender` is None, it publishes the mechanisms at their present inputs.

    Attributes
    ----------
    mechanisms : sequence of DrivenMechanism
        Those that the sender moves.
    has_velocities : bool
        Whether the sender's messages have velocities.
    readings : list of Route
        Inputs to read, apart from those that a sensor measures: the planner sets these before.
    solved : list of (DrivenMechanism, Solution)
        Mechanisms to solve, with their solvers.

    """

    def __init__(self, sender: Optional[Sender], routes: Sequence[Route],
                 mechanisms: Sequence[DrivenMechanism], planner: Planner):
        self.sender, self.mechanisms, self._planner = sender, mechanisms, planner
        self.has_velocities = sender is not None and sender.meaning[1]
        self.readings = [route for route in routes if not route.is_measured]
        self.stamp, self.now = planner.stamp, planner.now
        joints = planner.scene_joint_states
        in_scene = joints.has_subscribers
        self.solved: List[Tuple[DrivenMechanism, Solution]] = [
            (one, one.solution(in_scene)) for one in mechanisms
            if one.is_complete and (in_scene or one.has_subscribers)]
        self._in_scene = [one for one in planner.mechanisms if one.is_complete] if in_scene else []
        moved = {one for one, _ in self.solved}
        for one in mechanisms:
            if one not in moved:
                # Its last solution will be that of earlier inputs.
                one.validity = None
        for one in self._in_scene:
            if one not in moved:
                one.refresh(one.solution(in_scene))
        self._outputs = Cache(size=PLANS)
        self._output: Optional[Output] = None
        self._version, self._runs, self._is_interpreted = -1, 0, True
        self._backend: Any = PythonBackend(self)

    def run(self, data: bytes) -> bool:
        """Process a serialised message; return False, without effect, if the sender is another."""
        is_current = self._version == self._planner.version
        output = self._output if is_current else None
        result = self._backend.run(data, output if output and output.is_regular else None)
        if isinstance(result, bool):
            return result
        self._conclude(result)
        return True

    def _conclude(self, unchecked: AbstractSet[DrivenMechanism]) -> None:
        """Check and publish the solutions; only those of `unchecked` may be irregular."""
        changed = [one.assess(solution, one not in unchecked) for one, solution in self.solved]
        if True in changed:
            self._planner.version += 1
        if self._version != self._planner.version:
            self._version, self._output = self._planner.version, self._present_output()
        self._backend.publish(self._output)
        if self._is_interpreted and plan_llvm:
            self._runs += 1
            # Not at once: while subscribers come one by one, plans are short-lived.
            if self._runs in TRIED or self._runs % TRIED[-1] == 0:
                backend = plan_llvm.backend(self)
                self._backend, self._is_interpreted = backend or self._backend, not backend

    def _present_output(self) -> Output:
        key = tuple(one.validity for one in (*(one for one, _ in self.solved), *self._in_scene))
        return self._outputs.get_or_make(key, self._made_output)

    def _made_output(self) -> Output:
        """Return the output for the present validities."""
        messages = [Message(publisher, [solution.values], one.stamp)
                    for one, solution in self.solved for publisher in one.publishers()]
        if found := self._planner.scene_joint_states.message(self._in_scene):
            messages.append(Message(*found, self.stamp))
        return Output(messages, all(
            one.validity == one.model.regular(solution) and not solution.layout.efforts
            for one, solution in self.solved))


class Planner:
    """
    The plans of a scene, and their common state.

    Attributes
    ----------
    now : callable
        Returns the node's time as a packed stamp, for messages whose stamp is zero.
    stamp : int64 array (1,)
        The eight bytes of the stamp of the last message that set an input.
    version : int
        Number of times that the validity of any solution has changed.

    """

    def __init__(self, mechanisms: Sequence[DrivenMechanism], scene_joint_states: SceneJointStates,
                 reader: Reader, now: Callable[[], bytes]):
        self.mechanisms, self.scene_joint_states = mechanisms, scene_joint_states
        self.now, self._reader = now, reader
        self.stamp, self.version = np.zeros(1, np.int64), 0
        self._plans = Cache(size=PLANS)
        # The last plan, if the next message of its sender needs the same.
        self._last: Optional[Plan] = None

    def process(self, data: bytes) -> None:
        """Process a serialised message; raise Unreadable if it is no JointState."""
        if self._last is None or not self._last.run(data):
            plan = self._plan(self._reader.sender(data), data)
            if plan:
                plan.run(data)

    def invalidate(self) -> None:
        """Drop all plans, because the scene or its subscribers have changed."""
        self._plans.clear()
        self._last = None

    def discard(self) -> None:
        """Drop all plans and validities, because processing has failed halfway."""
        self.invalidate()
        for one in self.mechanisms:
            one.validity = None

    def publish(self, mechanisms: Sequence[DrivenMechanism]) -> None:
        """Publish mechanisms at their present inputs, and the joint states of the scene."""
        Plan(None, (), mechanisms, self).run(b'')

    def _plan(self, sender: Sender, data: bytes) -> Optional[Plan]:
        """Return the plan for a message, None if it moves nothing; mark its inputs as known."""
        routes, moving = sender.meaning
        measured = [route for route in routes if route.is_measured]
        if measured:
            self._measure(sender, measured, moving, data)
        before = [one.known.tobytes() for one in self.mechanisms]
        for route in routes:
            route.mechanism.known[:, route.input] = True, moving
        after = [one.known.tobytes() for one in self.mechanisms]
        moved = tuple(dict.fromkeys(route.mechanism for route in routes))
        plan = None
        if moved and sender.size:
            plan = self._plans.get_or_make(
                (sender, tuple(after)), lambda: Plan(sender, routes, moved, self))
        elif moved:
            plan = Plan(sender, routes, moved, self)
        self._last = plan if plan and not measured and before == after and sender.size else None
        return plan

    def _measure(self, sender: Sender, routes: Sequence[Route], moving: bool,
                 data: bytes) -> None:
        """Set the inputs that sensors measure."""
        _, positions, velocities = sender.read(data)
        for route in routes:
            route.mechanism.measure(route.input, positions[route.source_index],
                                    velocities[route.source_index] if moving else None)
