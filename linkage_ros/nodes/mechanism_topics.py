# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A mechanism of `kinematics`: the state of its inputs, its solution and its topics."""

from __future__ import annotations

import math
import time
from typing import AbstractSet, Any, Sequence

import numpy as np
from rclpy.duration import Duration
from sensor_msgs.msg import JointState
from visualization_msgs.msg import Marker, MarkerArray

from . import messages
from .log import Throttle
from .mechanism_model import AssemblyState, MechanismModel
from .message_layout import NEVER, Outgoing
from .publishers import LATCHED, TextPublisher, TrackedPublisher
from .. import scene


class MechanismTopics:
    """
    The state and the topics of a mechanism.

    Attributes
    ----------
    inputs : list
        Last positions [rad or m] of the inputs; None: not received yet.
    speeds : list
        Their speeds [rad/s or m/s]; None: not in the last message of the input.
    stamp : bytes
        The packed stamp of the last message that set an input.
    model : MechanismModel
        The adopted model; there is one before the first message arrives.
    state : AssemblyState, optional
        That of the solution at the present inputs; None: not solved yet.

    """

    model: MechanismModel

    def __init__(self, node: Any, mechanism: scene.SceneMechanism):
        name = self.name = mechanism.name
        self._joint_states = TrackedPublisher(node, JointState, f'{name}/joint_states', 10)
        self._markers = TrackedPublisher(node, MarkerArray, f'{name}/markers', 1)
        self._locus = node.create_publisher(Marker, f'{name}/locus', LATCHED)
        self._description = TextPublisher(node, f'{name}/robot_description')
        self._throttle = Throttle(node.get_logger().get_child(name))
        self.inputs: list[Any] = [None] * len(mechanism.inputs)
        self.speeds: list[float | None] = [None] * len(mechanism.inputs)
        self.stamp = NEVER
        self.state: AssemblyState | None = None
        # The last position and speed of each input's source joint; the last finite input.
        self._received: dict[int, tuple[float, float | None]] = {}
        self._seed: float | None = None
        # Ids of the displayed markers.
        self._displayed: AbstractSet[int] = frozenset()

    def receive(self, i: int, position: float, speed: float | None) -> None:
        """Set input `i` by the position of its source joint and, if known, its speed."""
        model = self.model
        value, self.speeds[i] = model.mechanism.from_source(
            model.inputs[i], position, speed, self._seed)
        self.inputs[i], self._received[i] = value, (position, speed)
        self.state = None
        if math.isfinite(value):
            self._seed = value

    def outgoing(self, in_scene: bool) -> Sequence[Outgoing]:
        """Solve for the subscribers; return the messages to publish."""
        topics = self._subscribed()
        if any(topics) and (state := self.solved(in_scene)):
            return self.model.patched_messages[state, topics].patched(
                self.stamp, state.solution.values)
        return ()

    def solved(self, in_scene: bool) -> AssemblyState | None:
        """
        Return the state at the present inputs; None without assembled legs.

        It is solved for the subscribers, and for the scene's joint states if `in_scene`.
        """
        if None in self.inputs:
            return None
        regular, state = self._regular(self.model, self._subscribed(), in_scene), self.state
        if state is None or state.solution is not regular.solution:
            state = self._solve(regular)
        return state if state.any_assembled else None

    def _subscribed(self) -> tuple[Any, Any]:
        """Return the publishers of joint states and markers, None where nobody subscribes."""
        return self._joint_states.subscribed, self._markers.subscribed

    def _regular(self, model: MechanismModel, topics: Sequence[Any], in_scene: bool
                 ) -> AssemblyState:
        joint_states, markers = topics
        return model.regular[in_scene or joint_states is not None, markers is not None,
                             None not in self.speeds]

    def _solve(self, regular: AssemblyState) -> AssemblyState:
        """Solve at the present inputs; note or delete the displayed markers."""
        state = self.state = self.model.solve(regular, self.inputs, self.speeds)
        if state.assembled is not None:
            self._throttle.warn('reach', self._out_of_reach)
        if not state.any_assembled:
            self._delete(self._displayed)
        elif self._markers.subscribed:
            self._displayed = self.model.marker_ids
        return state

    def prepared(self, mechanism: scene.SceneMechanism, frame_id: str, prefix: str,
                 in_scene: bool) -> MechanismModel:
        """Return a model, with messages for the present subscribers, or the equal present one."""
        before, inputs = getattr(self, 'model', None), [*self.inputs]
        if before and before.made_of == (mechanism, frame_id, prefix):
            return before
        model = MechanismModel(mechanism, frame_id, prefix)
        # This runs in the worker's thread, while subscribers may change.
        topics = self._subscribed()
        if before and None not in inputs and (in_scene or any(topics)):
            regular = self._regular(model, topics, in_scene)
            regular.solution.solve(inputs, [0.0] * len(inputs))
            if any(topics):
                # Building its messages takes longest.
                model.patched_messages[regular, topics]
        return model

    def adopt(self, model: MechanismModel) -> None:
        """Replace the model, read the inputs anew, and delete markers that it does not have."""
        self.model, self.state = model, None
        for i, received in self._received.items():
            self.receive(i, *received)
        self._delete(self._displayed - model.marker_ids)

    def publish_latched(self, description: str, locus: bytes | None) -> None:
        """Publish the robot model if it has changed; publish the locus, or delete it if None."""
        self._description.publish(description)
        self._locus.publish(locus or messages.deleted(self.name, messages.LOCUS_ID))

    def clear(self, deadline: float) -> None:
        """Delete markers and locus; wait for acknowledgements, up to a monotonic time [s]."""
        self._delete(self._displayed)
        self._locus.publish(messages.deleted(self.name, messages.LOCUS_ID))
        # The end of a process would drop messages that are still on their way.
        for publisher in (self._markers.publisher, self._locus):
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, deadline - time.monotonic())))

    def _delete(self, ids: AbstractSet[int]) -> None:
        if ids:
            self._displayed = self._displayed - ids
            self._markers.publish(MarkerArray(
                markers=[messages.deleted(self.name, id_) for id_ in sorted(ids)]))

    def _out_of_reach(self) -> str:
        assembled = [*self.state.legs()] if self.state else []
        missing = {leg: f'{self.name}_{prefix}'.rstrip('_') for leg, prefix in enumerate(
            self.model.assembly.legs) if leg not in assembled}
        inputs, failure = self.model.inputs, f'{", ".join(missing.values())} cannot be assembled'
        for settings, value in zip(inputs, self.inputs):
            if not math.isfinite(value):
                measured = settings.measures and (
                    f'{self._received[0][0]:.6g}, out of reach of {settings.measures}')
                return f'{failure}: {settings.source} is at {measured or value}'
        failure += ' at ' + ', '.join(
            f'{settings.input.quantity} {value:.6g} {settings.input.unit}'
            for settings, value in zip(inputs, self.inputs))
        first, input_ = next(iter(missing)), inputs[0].input
        is_inside = any(input_.holds(arc, self.inputs[0], self.inputs[0])
                        for arc in inputs[0].reach)
        if len(inputs) > 1 or len(self.model.assembly.legs) > 1 or is_inside:
            lines = ', '.join(f'"{line}"' for line in self._unplaced(first))
            return f'{failure}: no place for {lines}'
        return f'{failure}; the reach is {scene.in_words(inputs[0].reach)} {input_.unit}'

    def _unplaced(self, leg: int) -> list[str]:
        """Return the first joint line of a leg that has no place, and further ones with limits."""
        mechanism, (lag, start, side, _) = self.model.mechanism, [
            *self.model.assembly.legs.values()][leg]
        inputs = [(start + side * (value - lag)) / mechanism.scale_of(name)
                  for name, value in zip(mechanism.inputs, self.inputs)]
        linkage = mechanism.linkage
        quantities = {**linkage.solve(inputs), **linkage.joint_angles(inputs)}
        lines = [line for line in linkage.design.lines if any(
            np.isnan(quantities.get(name, 0.0)).any() for name in line.names)]
        return [line.text for line in lines if line is lines[0] or any(
            argument.option == 'within' for argument in line.arguments)]
