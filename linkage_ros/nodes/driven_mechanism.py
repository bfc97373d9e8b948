# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A mechanism of `kinematics`: the state of its inputs, its solution and its topics."""

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
from .mechanism_model import MechanismModel, Validity
from .publishers import LATCHED, PatchedPublisher, TrackedPublisher
from .. import scene
from ..linkage.walker import Solution


class DrivenMechanism:
    """
    The state and the topics of a mechanism.

    `changed` is called when a topic gets its first subscriber and when it loses its last one.

    Attributes
    ----------
    inputs : float array (2, inputs)
        Last positions [rad or m] of the inputs, and their speeds [rad/s or m/s].
    known : bool array (2, inputs)
        Which of these numbers have been received.
    stamp : int64 array (1,)
        The eight bytes of the stamp of the last message that set an input.
    validity : Validity, optional
        Which numbers of the last solution are valid; None: not solved yet.

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
        self.validity: Optional[Validity] = None
        # A sensor's last reading, and the last input that one has given.
        self._measured = math.nan
        self._near: Optional[float] = None
        # Ids of the displayed markers, whether the locus is displayed, and the last robot model.
        self._displayed: AbstractSet[int] = frozenset()
        self._has_locus, self._described = False, ''

    @property
    def model(self) -> MechanismModel:
        """Return the adopted model; it exists before the first message arrives."""
        assert self._model
        return self._model

    @property
    def is_complete(self) -> bool:
        """Whether a position of every input has been received."""
        return bool(self.known[0].all())

    @property
    def has_subscribers(self) -> bool:
        """Whether its joint states or its markers have subscribers."""
        return any(self._subscribed())

    def solution(self, in_scene: bool) -> Solution:
        """Return a solver for its own subscribers and, if `in_scene`, for the scene's joints."""
        return self._solution(self.model, in_scene, self._subscribed())

    def _solution(self, model: MechanismModel, in_scene: bool, subscribed: Sequence[bool]
                  ) -> Solution:
        joints, markers = subscribed
        return model.solution(joints or in_scene, markers, bool(self.known[1].all()))

    def _subscribed(self) -> Tuple[bool, bool]:
        """Return whether the joint states have subscribers, and whether the markers have."""
        return self._joint_states.has_subscribers, self._markers.has_subscribers

    def conversion(self, i: int) -> Tuple[float, float]:
        """Return the factor and the offset from the position of source joint `i` to input `i`."""
        drive = self.model.inputs[i]
        # Adding -0.0 changes no number; adding 0.0 would change -0.0.
        return drive.ratio, -0.0 if drive.is_plain else drive.offset

    def receive(self, i: int, value: float, speed: Optional[float]) -> None:
        """Set input `i` [rad or m] and its speed [rad/s or m/s]; None sets a speed of 0."""
        self.inputs[:, i] = value, 0.0 if speed is None else speed

    def measure(self, i: int, position: float, speed: Optional[float]) -> None:
        """Set input `i` by a sensor's position and speed; NaN if these are out of reach."""
        value, speed = self.model.machine.from_source(
            self.model.inputs[i], position, speed, self._near)
        if math.isfinite(value):
            self._near = value
        self._measured = position
        self.receive(i, value, speed)

    def solve(self, solution: Solution) -> None:
        """Solve at the present inputs."""
        solution.solve(*self.inputs.tolist())

    def assess(self, solution: Solution, is_regular: bool) -> bool:
        """Update `validity`, with a check unless `is_regular`; return whether it has changed."""
        layout, before = solution.layout, self.validity
        if layout.efforts:
            layout.effort(solution.values)[:] = self.model.machine.efforts(self.inputs[0].tolist())
        self.validity = self.model.regular(solution) if is_regular and not layout.efforts else (
            self.model.validity(solution, self.inputs))
        if self.validity.assembled is not None:
            self._throttle.warn('reach', self._out_of_reach)
        if self.validity != before:
            self._display(self.validity.any_assembled)
        return self.validity != before

    def _display(self, any_assembled: bool) -> None:
        """Record the displayed markers, or delete them if no leg is assembled."""
        if not any_assembled:
            self._delete(self._displayed)
        elif self._markers.has_subscribers:
            self._displayed = self.model.marker_array.ids

    def convert(self, solution: Solution) -> None:
        """Convert solved joint values, in place, to their published signs, offsets and turns."""
        if conversion := self.model.conversion(solution.layout):
            factors, offsets, wrapped = conversion
            values = solution.values
            values *= factors
            values += offsets
            values[wrapped] -= math.tau * np.round(values[wrapped] / math.tau)

    def refresh(self, solution: Solution) -> None:
        """Solve at the present inputs and convert, unless this was the last solution."""
        if self.validity is None or self.validity.solution is not solution:
            self.solve(solution)
            self.assess(solution, False)
            self.convert(solution)

    def publishers(self) -> Iterator[PatchedPublisher]:
        """Yield a publisher for each topic with subscribers; none if no leg is assembled."""
        if self.validity and self.validity.any_assembled:
            yield from self._publishers(self.model, self.validity, self._subscribed())

    def _publishers(self, model: MechanismModel, validity: Validity, subscribed: Sequence[bool]
                    ) -> Iterator[PatchedPublisher]:
        for is_subscribed, topic, build in zip(
                subscribed, (self._joint_states, self._markers),
                (model.joint_message, model.marker_message)):
            if is_subscribed:
                yield model.publisher(topic.publisher, build, validity, self._logger)

    def prepared(self, machine: scene.SceneMechanism, frame_id: str, prefix: str,
                 in_scene: bool) -> MechanismModel:
        """Return a model of `machine`, compiled for its subscribers, or an equal present model."""
        before = self._model
        if before and before.made_of == (machine, frame_id, prefix):
            return before
        model = MechanismModel(machine, frame_id, prefix)
        # This runs in the worker's thread, while subscribers may change.
        subscribed = self._subscribed()
        if before and self.is_complete and (in_scene or any(subscribed)):
            solution = self._solution(model, in_scene, subscribed)
            solution.finish()
            solution.solve(*self.inputs.tolist())
            list(self._publishers(model, model.regular(solution), subscribed))
        return model

    def adopt(self, model: MechanismModel) -> None:
        """Replace the model, and delete those markers that the new model does not have."""
        self._model, self.validity = model, None
        self._delete(self._displayed - model.marker_array.ids)

    def publish_latched(self, latched: Tuple[str, Optional[Marker]]) -> None:
        """Publish the robot model if it has changed; publish the locus, or delete it if None."""
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
        """Wait for subscribers to acknowledge deletions, up to a monotonic time [s]."""
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
        assembled = [*self.validity.legs()] if self.validity else []
        missing = {leg: f'{self.name}_{prefix}'.rstrip('_') for leg, prefix in enumerate(
            self.model.assembly.legs) if leg not in assembled}
        legs, inputs = ', '.join(missing.values()), self.model.inputs
        if inputs[0].measures and math.isnan(self.inputs[0, 0]):
            return (f'{legs} cannot be assembled: {inputs[0].source} is at {self._measured:.6g}, '
                    f'out of reach of {inputs[0].measures}')
        at = ', '.join(f'{one.input.quantity} {value:.6g} {one.input.unit}'
                       for one, value in zip(inputs, self.inputs[0]))
        first, *others = missing
        if len(inputs) > 1:
            return f'{legs} cannot be assembled at {at}: no place for "{self._unplaced()}"'
        of = f' of {missing[first]}' if others else ''
        return (f'{legs} cannot be assembled at {at}; the reach{of} is '
                f'{scene.in_words(self._reach(inputs[0], first))} {inputs[0].input.unit}')

    def _unplaced(self) -> str:
        """Return the first joint line that has no place at the present inputs."""
        machine = self.model.machine
        own = [value / machine.scale_of(name)
               for name, value in zip(machine.inputs, self.inputs[0])]
        found = {**machine.linkage.solve(own), **machine.linkage.joint_angles(own)}
        return next((line.text for line in machine.linkage.design.lines
                     if any(np.isnan(found.get(name, 0.0)).any() for name in line.names)), '')

    def _reach(self, drive: scene.InputSettings, leg: int) -> Sequence[Tuple[float, float]]:
        """Return the reach of a leg, by the crank that all legs have in common."""
        if len(self.model.assembly.legs) == 1:
            return drive.reach
        side, plus = self.model.assembly.own_inputs()[leg]
        arcs = [sorted(side * (end - plus) for end in arc) for arc in drive.reach]
        turns = [drive.input.turn * math.floor(low / drive.input.turn + 0.5) for low, _ in arcs]
        return sorted((low - turn, high - turn) for (low, high), turn in zip(arcs, turns))
