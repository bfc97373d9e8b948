# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What a crank message sets off: one plan, made once for its source, the scene and its subscribers.

The steps of a plan are always the same: read the inputs, solve, assess which legs are assembled,
convert to the robot's joints, write the numbers into the messages, publish them. One of two
executors takes them on the same arrays: `plan_python`, or `plan_llvm` once its code is compiled.
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
# After how many runs a plan looks for its machine code; then each time that many more are done.
TRIED = 2, 4, 8, 16, 32, 64


class Route(NamedTuple):
    """An input of a mechanism that a source sets, and its place in the source's messages."""

    mechanism: DrivenMechanism
    input: int
    place: int

    @property
    def is_measured(self) -> bool:
        """Whether the source measures something from which the input follows."""
        return bool(self.mechanism.model.inputs[self.input].measures)


class Message(NamedTuple):
    """A message of a plan: its publisher, where its values are, and its stamp."""

    publisher: PatchedPublisher
    values: List[np.ndarray]
    stamp: np.ndarray


@dataclass(eq=False)
class Output:
    """What poses are published as; `is_regular` tells whether all that a plan solves are."""

    messages: List[Message]
    is_regular: bool
    # What the executor in machine code makes of it.
    compiled: Any = None


class Plan:
    """
    What the messages of one source set off.

    Without a source nothing is read, and the mechanisms are published as they are.

    Attributes
    ----------
    is_moving : bool
        Whether the source says how fast its inputs move.
    readings : list of Route
        The inputs that are read; measured ones are set before a plan runs.
    solved : list of (DrivenMechanism, Solution)
        What is solved, and how.

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
        """Do all that a message sets off; return False if it is of another source."""
        is_settled = self._version == self._planner.version
        output = self._output if is_settled else None
        irregular = self._executor.run(text, output if output and output.is_regular else None)
        if irregular is None:
            return False
        if irregular is not True:
            self._conclude(irregular)
        return True

    def _conclude(self, irregular: AbstractSet[DrivenMechanism]) -> None:
        """Assess what was solved, of which some may be irregular, and publish it."""
        changed = [one.assess(solution, one not in irregular) for one, solution in self.solved]
        if True in changed:
            self._planner.version += 1
        if self._version != self._planner.version:
            self._version, self._output = self._planner.version, self._find_output()
        self._executor.publish(self._output)
        if self._is_interpreted and plan_llvm:
            self._runs += 1
            # Tried now and then: while subscribers come one by one no plan lasts.
            if self._runs in TRIED or self._runs % TRIED[-1] == 0:
                executor = plan_llvm.executor(self)
                self._executor, self._is_interpreted = executor or self._executor, not executor

    def _find_output(self) -> Output:
        poses = tuple(one.pose for one in (*(one for one, _ in self.solved), *self._members))
        return self._outputs.get_or_make(poses, self._made_output)

    def _made_output(self) -> Output:
        """Return what publishes the present poses."""
        messages = [Message(publisher, [solution.values], one.stamp)
                    for one, solution in self.solved for publisher in one.publishers()]
        if found := self._planner.scene_joint_states.message(self._members):
            messages.append(Message(*found, self.stamp))
        return Output(messages, all(
            one.pose == one.model.regular(solution) and not solution.layout.efforts
            for one, solution in self.solved))


class Planner:
    """
    The plans of a scene, by what selects them, and the state that they share.

    Attributes
    ----------
    now : callable
        Returns the time, packed, for messages that have no stamp.
    stamp : int64 array (1,)
        The stamp of the last message that set an input.
    version : int
        Counts the changes of poses in anything but numbers.

    """

    def __init__(self, mechanisms: Sequence[DrivenMechanism], scene_joint_states: SceneJointStates,
                 reader: Reader, now: Callable[[], bytes]):
        self.mechanisms, self.scene_joint_states = mechanisms, scene_joint_states
        self.now, self._reader = now, reader
        self.stamp, self.version = np.zeros(1, np.int64), 0
        self._plans = Cache(size=PLANS)
        # The last plan, if the next message of its source selects it again.
        self._last: Optional[Plan] = None

    def process(self, text: bytes) -> None:
        """Do all that a message sets off; raise Unreadable if the bytes are none."""
        if self._last is None or not self._last.run(text):
            source = self._reader.source(text)
            plan = self._plan(source, text)
            if plan:
                plan.run(text)

    def invalidate(self) -> None:
        """Make new plans from the next message on: the scene or its subscribers are others."""
        self._plans.clear()
        self._last = None

    def discard(self) -> None:
        """Drop all poses: what was being done has failed half way."""
        self.invalidate()
        for one in self.mechanisms:
            one.pose = None

    def publish(self, mechanisms: Sequence[DrivenMechanism]) -> None:
        """Publish mechanisms as they are, and the joints of the scene."""
        Plan(None, (), mechanisms, self).run(b'')

    def _plan(self, source: Source, text: bytes) -> Optional[Plan]:
        """Return the plan for a message of a source, in which its inputs are known."""
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
        """Set the inputs that sensors measure; return those that cannot be where they say."""
        _, positions, velocities = source.read(text)
        return frozenset(route for route in routes if not route.mechanism.measure(
            route.input, positions[route.place], velocities[route.place] if moving else None))
