# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The topics of one mechanism: what it publishes, as far as anybody listens."""

from dataclasses import dataclass
import math
import time
from typing import Any, List, Optional, Sequence, Tuple

import numpy as np
from rclpy.duration import Duration
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from visualization_msgs.msg import Marker, MarkerArray

from . import messages
from .heard import Topic
from .mechanism_model import InputState, Model, Pose
from .message_layout import NEVER, unpack, Wire
from .ticks import MOST, Ticks
from .whole_scene import LATCHED, WholeScene
from .. import scene
from ..linkage.walker import Assembly, Solution

SECONDS_BETWEEN_WARNINGS = 5.0


@dataclass(eq=False)
class Moved:
    """
    A mechanism that a source moves; the same one as long as nothing about it changes.

    Attributes
    ----------
    shown : MechanismPublisher
        What shows it, also where it cannot be assembled.
    places : sequence of (Drive, int, int)
        The inputs that the source tells of, their places, and the places in the message.
    told : float array (2, inputs)
        Where the inputs are kept, and their speeds.
    moving : bool
        Whether the source tells of speeds.
    assembly : Assembly
        Its legs.
    solution : Solution, optional
        What is solved for those who listen; None: nobody does.
    changes : sequence of float arrays, optional
        Factors of the values, what is added, and which come without whole turns.
    wires : list of Wire
        What is sent.
    made : (Source, dict), optional
        What was made of it for a source, to be used again.

    """

    shown: Any
    places: Sequence[Tuple[scene.Drive, int, int]]
    told: np.ndarray
    moving: bool
    assembly: Assembly
    solution: Optional[Solution]
    changes: Optional[Sequence[np.ndarray]]
    wires: List[Wire]
    made: Optional[Tuple[Any, dict]] = None


class MechanismPublisher:
    """The topics of one mechanism, and the last that was heard of each of its inputs."""

    def __init__(self, node_, machine: scene.Machine, whole: WholeScene, ticks: Ticks):
        self.name, self._whole, self._ticks = machine.name, whole, ticks
        name, changed = machine.name, ticks.renew_soon
        self._joint_states = Topic(node_, JointState, f'{name}/joint_states', 10, changed)
        self._markers = Topic(node_, MarkerArray, f'{name}/markers', 1, changed)
        self._locus = node_.create_publisher(Marker, f'{name}/locus', LATCHED)
        self._description = node_.create_publisher(String, f'{name}/robot_description', LATCHED)
        # A logger of its own: what is throttled is the warnings of this mechanism alone.
        self._logger = node_.get_logger().get_child(name)
        self._model, self._pose, self._driven = None, None, None
        self._pictured = self._described = None
        self._stamp = NEVER
        # Values and speeds of the inputs, and which of them are known.
        self._told = np.zeros((2, len(machine.inputs)))
        self._known = np.zeros((2, len(machine.inputs)), bool)
        # The markers in the picture, and whether the locus is.
        self._drawn, self._curved = frozenset(), False
        self._moves = {}

    def prepared(self, *wanted) -> Model:
        """Return what shows a mechanism, ready for who listens now; the same where it is."""
        if self._model and self._model.made_for == wanted:
            return self._model
        model = Model(*wanted)
        if self._model:
            model.finish()
        if driven := self._state():
            model.solution(*driven.wanted).finish()
            pose = model.solve(driven)
            for topic, build in self._listening(model, driven):
                if model.is_patched(build):
                    model.wire(topic.publisher, build, pose.entire(), self._logger)
        return model

    def adopt(self, model: Model):
        """Show a mechanism so, where it was last."""
        before, self._model = self._model, model
        if model is before:
            return
        if before:
            self.picture()
            self._delete(self._drawn - model.marker_array.ids)
        self._driven = None
        self.show()

    def finish(self):
        """Make what is shown but once, if it is not shown yet."""
        if self._model is not self._pictured:
            self._model.finish()

    def picture(self):
        """Publish what is shown but once, if it is not yet."""
        model = self._model
        if model is self._pictured:
            return
        description, locus = model.finish()
        self._pictured, model.once = model, None
        if hash(description) != self._described:
            self._described = hash(description)
            self._description.publish(String(data=description))
        if locus:
            self._locus.publish(locus)
        elif self._curved:
            self._locus.publish(messages.deleted(self.name, messages.LOCUS_ID))
        self._curved = bool(locus)

    def clear(self):
        """Take the markers and the locus out of the picture."""
        self._delete(self._drawn)
        if self._curved:
            self._curved = False
            self._locus.publish(messages.deleted(self.name, messages.LOCUS_ID))

    def let_arrive(self, until: float):
        """Wait until a time on the steady clock [s] for the picture's topics to be heard."""
        for publisher in (self._markers.publisher, self._locus):
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, until - time.monotonic())))

    def _delete(self, ids):
        if ids:
            self._drawn -= ids
            self._markers.publish(MarkerArray(
                markers=[messages.deleted(self.name, id_) for id_ in sorted(ids)]))

    def turn(self, stamp: bytes, places: Sequence[Tuple[int, int]], positions: Sequence[float],
             speeds: Sequence[float]):
        """
        Take over what a message says of the inputs, and show them as soon as all are known.

        Parameters
        ----------
        stamp : bytes
            Its time, packed.
        places : sequence of (int, int)
            For each input that it tells of, the input's place and the place in the message.
        positions, speeds : sequence of float
            The message's positions [rad or m] and speeds, or no speeds.

        """
        for i, place in places:
            value, speed = positions[place], speeds[place] if speeds else None
            if not (drive := self._model.drives[i]).is_plain:
                near = float(self._told[0, i]) if self._known[0, i] else None
                value, speed = self._understood(drive, value, speed, near)
            if value is not None:
                self._told[:, i] = value, 0.0 if speed is None else speed
                self._known[:, i] = True, speed is not None
        self._stamp = stamp
        self.show()

    def _understood(self, drive, position, speed, near):
        """Return an input and its speed as its source tells; None if they cannot be."""
        value, speed = self._model.machine.understood(drive, position, speed, near)
        if drive.measures and not math.isfinite(value):
            self._logger.warning(
                f'{drive.measures} cannot be where {drive.source} is {position:.6g}: it is passed '
                'over', throttle_duration_sec=SECONDS_BETWEEN_WARNINGS)
            return None, None
        return value, speed

    def known(self) -> Optional[Tuple[Model, Pose]]:
        """Return how the mechanism is now, for the whole scene; None if that is not known."""
        return (self._model, self._pose) if self._solve() else None

    def moved(self, places: Tuple[Tuple[int, int], ...], known: bool) -> Optional[Moved]:
        """Return what a source moves; None if not by machine code alone."""
        driven = self._state()
        now = self._model, driven and driven.wanted, known
        then, moved = self._moves.get(places, (None, None))
        if now != then and (moved := self._moved(driven, places, known)):
            self._moves = {**dict([*self._moves.items()][1 - MOST:]), places: (now, moved)}
        return moved

    def _moved(self, driven, places, known):
        model = self._model
        if model.machine.loads or any(model.drives[i].measures for i, _ in places):
            return None
        solution, wires = driven and model.solution(*driven.wanted), []
        if solution:
            self._solve()
            if not solution.batch.code:
                return None
            pose = self._pose.entire()
            wires = [model.wire(topic.publisher, build, pose, self._logger)
                     for topic, build in self._listening(model, driven)]
            if not all(wire.template for wire in wires):
                return None
        return Moved(self, [(model.drives[i], i, place) for i, place in places], self._told,
                     known, model.assembly, solution,
                     solution and model.change(solution.layout), wires)

    def forget(self, stamp: bytes):
        """Solve again before anything is shown: the inputs were moved, at a time, by others."""
        self._driven, self._stamp = None, stamp

    def show(self):
        """Publish what is listened to."""
        driven = self._solve()
        if not driven:
            return
        if self._pose.held is not None:
            self._warn(driven.values, self._pose.held)
        if self._pose.can_be:
            for topic, build in self._listening(self._model, driven):
                self._send(topic.publisher, build, self._stamp)
            if driven.markers:
                self._drawn = self._model.marker_array.ids
        else:
            self._delete(self._drawn)

    def _state(self) -> Optional[InputState]:
        """Return what a pose is made from; None if nobody listens or not all is known."""
        listened = self._joint_states.is_heard, self._markers.is_heard, self._whole.is_heard
        if True not in listened or not self._known[0].all():
            return None
        values, speeds = self._told.tolist()
        return InputState(tuple(values), tuple(speeds) if self._known[1].all() else (), *listened)

    def _solve(self) -> Optional[InputState]:
        """Solve for those who listen; return for what, None if for nobody or nothing is known."""
        driven = self._state()
        if driven and driven != self._driven:
            # What is said again is not solved again.
            before, self._driven = self._pose, driven
            self._pose = self._model.solve(driven)
            if not before or not self._pose.is_like(before):
                self._ticks.forget()
        return driven

    def _listening(self, model, driven):
        if driven.joints:
            yield self._joint_states, model.joint_message
        if driven.markers:
            yield self._markers, model.marker_message

    def _warn(self, values, held):
        legs = [f'{self.name}_{prefix}'.rstrip('_')
                for prefix, placed in zip(self._model.assembly.legs, held) if not placed]
        drives = self._model.machine.inputs.values()
        at = ', '.join(f'{drive.input.quantity} {value:.6g} {drive.input.unit}'
                       for drive, value in zip(drives, values))
        reach = ', '.join(f'{scene.in_words(drive.reach)} {drive.input.unit}' for drive in drives)
        self._logger.warning(
            f'{", ".join(legs)} cannot be assembled at {at}; the reach is {reach}',
            throttle_duration_sec=SECONDS_BETWEEN_WARNINGS)

    def _send(self, publisher, build, stamp):
        """Publish all legs by patching one message; where that is not alike, build another."""
        pose = self._pose
        if pose.held is not None or not self._model.is_patched(build):
            publisher.publish(build(pose, unpack(stamp)))
        else:
            self._model.wire(publisher, build, pose, self._logger).send(stamp, pose.values)
