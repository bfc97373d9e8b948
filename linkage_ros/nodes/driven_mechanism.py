# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""One mechanism of `kinematics`: the state of its inputs, its pose, and its topics."""

from __future__ import annotations

import math
import time
from typing import AbstractSet, Any, Callable, Iterator, Optional, Sequence, Tuple

import numpy as np
from rclpy.duration import Duration
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from visualization_msgs.msg import Marker, MarkerArray

from . import messages
from .log import Throttle
from .mechanism_model import MechanismModel, Pose
from .publishers import LATCHED, PatchedPublisher, TrackedPublisher
from .. import scene
from ..linkage.walker import Solution


class DrivenMechanism:
    """
    The state and the topics of one mechanism; `changed` is called when subscribers come or go.

    Attributes
    ----------
    inputs : float array (2, inputs)
        The last value of each input [rad or m], and its speed [per second].
    known : bool array (2, inputs)
        Which of them have been received.
    stamp : int64 array (1,)
        The stamp of the last message that named an input, as it is in a message.
    pose : Pose, optional
        What the numbers of the last solution are good for; None: nothing is solved.

    """

    def __init__(self, node: Any, machine: scene.SceneMechanism, changed: Callable[[], None]):
        name = self.name = machine.name
        self._joint_states = TrackedPublisher(
            node, JointState, f'{name}/joint_states', 10, changed)
        self._markers = TrackedPublisher(node, MarkerArray, f'{name}/markers', 1, changed)
        self._locus = node.create_publisher(Marker, f'{name}/locus', LATCHED)
        self._description = node.create_publisher(String, f'{name}/robot_description', LATCHED)
        self._logger = node.get_logger().get_child(name)
        self._throttle = Throttle(self._logger)
        self._model: Optional[MechanismModel] = None
        self.inputs = np.zeros((2, len(machine.inputs)))
        self.known = np.zeros((2, len(machine.inputs)), bool)
        self.stamp = np.zeros(1, np.int64)
        self.pose: Optional[Pose] = None
        # Markers that are displayed, whether the locus is, and the last robot model.
        self._displayed: AbstractSet[int] = frozenset()
        self._has_locus, self._described = False, ''

    @property
    def model(self) -> MechanismModel:
        """What it is made of; it is adopted before the first message comes."""
        assert self._model
        return self._model

    @property
    def is_complete(self) -> bool:
        """Whether every input has been received."""
        return bool(self.known[0].all())

    @property
    def has_subscribers(self) -> bool:
        """Whether its joint states or its markers have subscribers."""
        return any(self._subscribed())

    def solution(self, in_scene: bool) -> Solution:
        """Return the solver for its subscribers, and for those to the scene's joint states."""
        return self._solution(self.model, in_scene, self._subscribed())

    def _solution(self, model: MechanismModel, in_scene: bool, subscribed: Sequence[bool]
                  ) -> Solution:
        joints, markers = subscribed
        return model.solution(joints or in_scene, markers, bool(self.known[1].all()))

    def _subscribed(self) -> Tuple[bool, bool]:
        """Return whether its joint states and its markers have subscribers."""
        return self._joint_states.has_subscribers, self._markers.has_subscribers

    def conversion(self, i: int) -> Tuple[float, float]:
        """Return the factor of a source's position, and what is added: the input."""
        source = self.model.inputs[i]
        # Of all numbers only -0.0 leaves every other as it is.
        return source.ratio, -0.0 if source.is_plain else source.offset

    def receive(self, i: int, value: float, speed: Optional[float]) -> None:
        """Set an input [rad or m], and its speed [per second] if it is known."""
        self.inputs[:, i] = value, 0.0 if speed is None else speed

    def measure(self, i: int, position: float, speed: Optional[float]) -> bool:
        """Set an input by what a sensor reads [rad or m]; return False if that cannot be."""
        source = self.model.inputs[i]
        near = float(self.inputs[0, i]) if self.known[0, i] else None
        value, speed = self.model.machine.from_source(source, position, speed, near)
        if not math.isfinite(value):
            self._throttle.warn(source.source, lambda: (
                f'{source.measures} cannot be where {source.source} is {position:.6g}: it is '
                'ignored'))
            return False
        self.receive(i, value, speed)
        return True

    def solve(self, solution: Solution) -> None:
        """Solve at the inputs."""
        solution.solve(*self.inputs.tolist())

    def assess(self, solution: Solution, is_regular: bool) -> bool:
        """Set the pose that was solved, before its conversion; return whether it is another."""
        layout, before = solution.layout, self.pose
        if layout.efforts:
            layout.effort(solution.values)[:] = self.model.machine.efforts(self.inputs[0].tolist())
        self.pose = self.model.regular(solution) if is_regular and not layout.efforts else (
            self.model.pose(solution, self.inputs))
        if self.pose.assembled is not None:
            self._throttle.warn('reach', self._out_of_reach)
        if self.pose != before:
            self._display(self.pose)
        return self.pose != before

    def _display(self, pose: Pose) -> None:
        """Take note of the markers that a pose displays, or delete them where it has none."""
        if not pose.exists:
            self._delete(self._displayed)
        elif self._markers.has_subscribers:
            self._displayed = self.model.marker_array.ids

    def convert(self, solution: Solution) -> None:
        """Convert what was solved to the robot's joints: their signs, offsets and turns."""
        if conversion := self.model.conversion(solution.layout):
            factors, offsets, wrapped = conversion
            values = solution.values
            values *= factors
            values += offsets
            values[wrapped] -= math.tau * np.round(values[wrapped] / math.tau)

    def refresh(self, solution: Solution) -> None:
        """Solve for other subscribers than before, at the inputs as they were."""
        if self.pose is None or self.pose.solution is not solution:
            self.solve(solution)
            self.assess(solution, False)
            self.convert(solution)

    def publishers(self) -> Iterator[PatchedPublisher]:
        """Yield what publishes the pose to the subscribers of the mechanism's own topics."""
        if self.pose and self.pose.exists:
            yield from self._publishers(self.model, self.pose, self._subscribed())

    def _publishers(self, model: MechanismModel, pose: Pose, subscribed: Sequence[bool]
                    ) -> Iterator[PatchedPublisher]:
        for is_subscribed, topic, build in zip(
                subscribed, (self._joint_states, self._markers),
                (model.joint_message, model.marker_message)):
            if is_subscribed:
                yield model.publisher(topic.publisher, build, pose, self._logger)

    def prepared(self, machine: scene.SceneMechanism, frame_id: str, prefix: str,
                 in_scene: bool) -> MechanismModel:
        """Return the model of a mechanism, with what its subscribers need; the same if it is."""
        before = self._model
        if before and before.made_of == (machine, frame_id, prefix):
            return before
        model = MechanismModel(machine, frame_id, prefix)
        # In the worker's thread: subscribers may come and go meanwhile.
        subscribed = self._subscribed()
        if before and self.is_complete and (in_scene or any(subscribed)):
            solution = self._solution(model, in_scene, subscribed)
            solution.finish()
            solution.solve(*self.inputs.tolist())
            list(self._publishers(model, model.regular(solution), subscribed))
        return model

    def adopt(self, model: MechanismModel) -> None:
        """Be another model from now on; what is displayed of the old one is deleted."""
        self._model, self.pose = model, None
        self._delete(self._displayed - model.marker_array.ids)

    def publish_latched(self, latched: Tuple[str, Optional[Marker]]) -> None:
        """Publish the robot model, if it is another, and the locus, or delete it."""
        description, locus = latched
        if description != self._described:
            self._described = description
            self._description.publish(String(data=description))
        self._set_locus(locus)

    def clear(self) -> None:
        """Delete the markers and the locus."""
        self._delete(self._displayed)
        self._set_locus(None)

    def wait_for_deletions(self, deadline: float) -> None:
        """Wait until the deletions have arrived, or until a time on the steady clock [s]."""
        for publisher in (self._markers.publisher, self._locus):
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, deadline - time.monotonic())))

    def _set_locus(self, locus: Optional[Marker]) -> None:
        if locus or self._has_locus:
            self._locus.publish(locus or messages.deleted(self.name, messages.LOCUS_ID))
        self._has_locus = bool(locus)

    def _delete(self, ids: AbstractSet[int]) -> None:
        if ids:
            self._displayed = self._displayed - ids
            self._markers.publish(MarkerArray(
                markers=[messages.deleted(self.name, id_) for id_ in sorted(ids)]))

    def _out_of_reach(self) -> str:
        assembled = [*self.pose.legs()] if self.pose else []
        legs = ', '.join(f'{self.name}_{prefix}'.rstrip('_') for leg, prefix in enumerate(
            self.model.assembly.legs) if leg not in assembled)
        inputs = self.model.inputs
        at = ', '.join(f'{one.input.quantity} {value:.6g} {one.input.unit}'
                       for one, value in zip(inputs, self.inputs[0]))
        reach = ', '.join(f'{scene.in_words(one.reach)} {one.input.unit}' for one in inputs)
        return f'{legs} cannot be assembled at {at}; the reach is {reach}'
