# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Processing of crank messages by plans, each made once for a source, a scene and its subscribers.

All plans have the same steps: read the inputs, solve, assess which legs are assembled, convert
to the robot's joints, write the numbers into the messages, publish. Two executors run them on the
same arrays: `plan_python`, and `plan_llvm` once its code is compiled.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import AbstractSet, Any, Callable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from .driven_mechanism import DrivenMechanism
from .joint_state_reader import Reader, Source
from .plan_python import PythonExecutor
from .publishers import PatchedPublisher
from .scene_joint_states import SceneJointStates
from ..cache import Cache
from ..linkage.walker import Solution

try:
    from . import plan_llvm
except ImportError:
    # Without llvmlite there is no machine code.
    plan_llvm = None  # type: ignore[assignment]

# Plans that are cached.
PLANS = 64
# Runs after which a plan looks for its machine code; later it looks every TRIED[-1] runs.
TRIED = 2, 4, 8, 16, 32, 64


class Route(NamedTuple):
    """An input of a mechanism, and its index in a source's messages."""

    mechanism: DrivenMechanism
    input: int
    place: int

    @property
    def is_measured(self) -> bool:
        """Whether the source measures an output instead of the input."""
        return bool(self.mechanism.model.inputs[self.input].measures)


class Message(NamedTuple):
    """A message of a plan: its publisher, the arrays of its values, and its stamp."""

    publisher: PatchedPublisher
    values: List[np.ndarray]
    stamp: np.ndarray


@dataclass(eq=False)
class Output:
    """Messages for the present poses; `is_regular`: every solved pose is regular."""

    messages: List[Message]
    is_regular: bool
    # The machine-code executor's form of it.
    compiled: Any = None


class Plan:
    """
    The processing of one source's messages.

    Without a source, it publishes the mechanisms at their present inputs.

    Attributes
    ----------
    is_moving : bool
        Whether the source's messages have velocities.
    readings : list of Route
        Inputs to read; measured inputs are set before a plan runs.
    solved : list of (DrivenMechanism, Solution)
        Mechanisms to solve, with their solvers.

    """

    def __init__(self, source: Optional[Source], routes: Sequence[Route],
                 mechanisms: Sequence[DrivenMechanism], planner: Planner):
        self.source, self.mechanisms, self._planner = source, mechanisms, planner
        self.is_moving = source is not None and source.meaning[1]
        self.readings = [route for route in routes if not route.is_measured]
        self.stamp, self.now = planner.stamp, planner.now
        joints = planner.scene_joint_states
        in_scene = joints.has_subscribers
        self.solved: List[Tuple[DrivenMechanism, Solution]] = [
            (one, one.solution(in_scene)) for one in mechanisms
            if one.is_complete and (in_scene or one.has_subscribers)]
        self._members = [one for one in planner.mechanisms if one.is_complete] if in_scene else []
        moved = {one for one, _ in self.solved}
        for one in self._members:
            if one not in moved:
                one.refresh(one.solution(in_scene))
        self._outputs = Cache(size=PLANS)
        self._output: Optional[Output] = None
        self._version, self._runs, self._is_interpreted = -1, 0, True
        self._executor: Any = PythonExecutor(self)

    def run(self, text: bytes) -> bool:
        """Process a message; return False if it is from another source."""
        is_settled = self._version == self._planner.version
        output = self._output if is_settled else None
        irregular = self._executor.run(text, output if output and output.is_regular else None)
        if irregular is None:
            return False
        if irregular is not True:
            self._conclude(irregular)
        return True

    def _conclude(self, irregular: AbstractSet[DrivenMechanism]) -> None:
        """Assess and publish the solutions, of which some may be irregular."""
        changed = [one.assess(solution, one not in irregular) for one, solution in self.solved]
        if True in changed:
            self._planner.version += 1
        if self._version != self._planner.version:
            self._version, self._output = self._planner.version, self._find_output()
        self._executor.publish(self._output)
        if self._is_interpreted and plan_llvm:
            self._runs += 1
            # Not at once: while subscribers come one by one, plans are short-lived.
            if self._runs in TRIED or self._runs % TRIED[-1] == 0:
                executor = plan_llvm.executor(self)
                self._executor, self._is_interpreted = executor or self._executor, not executor

    def _find_output(self) -> Output:
        poses = tuple(one.pose for one in (*(one for one, _ in self.solved), *self._members))
        return self._outputs.get_or_make(poses, self._made_output)

    def _made_output(self) -> Output:
        """Return the output for the present poses."""
        messages = [Message(publisher, [solution.values], one.stamp)
                    for one, solution in self.solved for publisher in one.publishers()]
        if found := self._planner.scene_joint_states.message(self._members):
            messages.append(Message(*found, self.stamp))
        return Output(messages, all(
            one.pose == one.model.regular(solution) and not solution.layout.efforts
            for one, solution in self.solved))


class Planner:
    """
    The cached plans of a scene, and their common state.

    Attributes
    ----------
    now : callable
        Returns the packed time, for messages without a stamp.
    stamp : int64 array (1,)
        Stamp of the last message that set an input.
    version : int
        Number of changes of poses other than in numbers.

    """

    def __init__(self, mechanisms: Sequence[DrivenMechanism], scene_joint_states: SceneJointStates,
                 reader: Reader, now: Callable[[], bytes]):
        self.mechanisms, self.scene_joint_states = mechanisms, scene_joint_states
        self.now, self._reader = now, reader
        self.stamp, self.version = np.zeros(1, np.int64), 0
        self._plans = Cache(size=PLANS)
        # The last plan, if the next message of its source uses it again.
        self._last: Optional[Plan] = None

    def process(self, text: bytes) -> None:
        """Process a serialised message; raise Unreadable if it is not a joint state."""
        if self._last is None or not self._last.run(text):
            source = self._reader.source(text)
            plan = self._plan(source, text)
            if plan:
                plan.run(text)

    def invalidate(self) -> None:
        """Drop all plans: the scene or its subscribers have changed."""
        self._plans.clear()
        self._last = None

    def discard(self) -> None:
        """Drop all poses after a failure in the middle of a message."""
        self.invalidate()
        for one in self.mechanisms:
            one.pose = None

    def publish(self, mechanisms: Sequence[DrivenMechanism]) -> None:
        """Publish mechanisms at their present inputs, and the joints of the scene."""
        Plan(None, (), mechanisms, self).run(b'')

    def _plan(self, source: Source, text: bytes) -> Optional[Plan]:
        """Return the plan for a message, after its inputs are marked as known."""
        routes, moving = source.meaning
        measured = [route for route in routes if route.is_measured]
        failed = self._measure(source, measured, moving, text) if measured else frozenset()
        received = [route for route in routes if route not in failed]
        before = [one.known.tobytes() for one in self.mechanisms]
        for route in received:
            route.mechanism.known[:, route.input] = True, moving
        after = [one.known.tobytes() for one in self.mechanisms]
        moved = tuple(dict.fromkeys(route.mechanism for route in routes))
        plan = None
        if moved and source.size:
            plan = self._plans.get_or_make(
                (source, tuple(after), failed), lambda: Plan(source, routes, moved, self))
        elif moved:
            plan = Plan(source, routes, moved, self)
        self._last = plan if plan and not measured and before == after and source.size else None
        return plan

    def _measure(self, source: Source, routes: Sequence[Route], moving: bool,
                 text: bytes) -> frozenset:
        """Set the inputs that sensors measure; return those whose values have no solution."""
        _, positions, velocities = source.read(text)
        return frozenset(route for route in routes if not route.mechanism.measure(
            route.input, positions[route.place], velocities[route.place] if moving else None))
