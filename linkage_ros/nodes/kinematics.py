# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Node that publishes joint angles, markers, loci and robot models of a scene's mechanisms."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
import time
from typing import Any, Callable, Iterable, NamedTuple, Sequence

from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import JointState

from . import scene_node, shutdown
from .log import InvalidHandle, MAX_NAMES, Once, RCLError
from .mechanism_model import MechanismModel
from .mechanism_topics import MechanismTopics
from .message_layout import NEVER, subscribe
from .scene_joint_states import SceneJointStates
from .. import scene
from ..robot_model import bodies, urdf
from ..words import join_names

# Time from the start to a warning about inputs that were not received [s].
MISSING_AFTER_S = 5.0
# Longest wait for subscribers to delete markers when the node ends [s].
DELETION_TIMEOUT_S = 0.1


class InputSource(NamedTuple):
    """An input, and the indices of its source joint's numbers in a sender's messages."""

    mechanism: MechanismTopics
    input: int
    position: int
    # 0: the messages have no velocities.
    velocity: int


# The inputs that a sender's messages set, and the mechanisms that they move.
Routes = tuple[list[InputSource], list[MechanismTopics]]


class Kinematics(scene_node.SceneNode):
    """Solves mechanisms at the inputs from `crank_states`, only for topics with subscribers."""

    task = 'moves {mechanisms}'

    def __init__(self, **kwargs: Any):
        self._mechanisms: dict[str, MechanismTopics] = {}
        self._models: dict[str, MechanismModel] = {}
        super().__init__(scene.KINEMATICS, **kwargs)
        self._inputs = self.scene.sources
        self._scene_joint_states = SceneJointStates(self, self._inputs)
        self._mechanisms.update((name, MechanismTopics(self, mechanism))
                                for name, mechanism in self.scene.mechanisms.items())
        # That of the last message that set an input.
        self._stamp = NEVER
        self._joint_names: frozenset = frozenset()
        self._unknown = Once(MAX_NAMES)
        self._missing_timer = self.create_timer(
            MISSING_AFTER_S, self.guarded('the check for missing inputs', self._warn_of_missing),
            clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.begin()
        self._log_machine_code()
        subscribe(self, 'crank_states', self._interpret, self._receive)

    def _log_machine_code(self) -> None:
        """Log why there is no machine code for the legs of walkers, if there is none."""
        walkers = [model for model in self._models.values() if len(model.assembly.legs) > 1]
        try:
            for model in walkers[:1]:
                model.mechanism.linkage.accelerated()
        except ImportError as error:
            # Whoever has not installed it knows; whoever has, does not know that it is broken.
            is_missing = isinstance(error, ModuleNotFoundError)
            log = self.get_logger().info if is_missing else self.get_logger().warning
            log(f'plain Python is used instead of machine code, with the same results: {error}')

    def check(self, new: scene.Scene) -> None:
        """Raise SceneError if no robot model can be made of a planar mechanism."""
        for name, mechanism in new.mechanisms.items():
            before, frame_id = self.scene.mechanisms[name], mechanism.frame_id or new.frame_id
            if mechanism.in_space:
                continue
            if mechanism is not before:
                bodies.size(mechanism)
            # Only a name can invalidate the rest of a robot model, whose limits take long.
            if mechanism.joints != before.joints or frame_id.startswith(f'{name}_'):
                bodies.robot([mechanism], frame_id)

    def prepare(self, new: scene.Scene) -> Any:
        """Return a model of each mechanism by name; unchanged mechanisms keep their models."""
        in_scene = self._scene_joint_states.joint_states.has_subscribers
        return {name: self._mechanisms[name].prepared(
            mechanism, mechanism.frame_id or new.frame_id, new.frame_prefix, in_scene)
            for name, mechanism in new.mechanisms.items()}

    def adopt(self, models: dict[str, MechanismModel]) -> None:
        """Replace the models of the mechanisms, and publish those that have changed."""
        changed = [self._mechanisms[name] for name, model in models.items()
                   if model is not self._models.get(name)]
        self._models = models
        self._joint_names = frozenset(joint.name for model in models.values()
                                      for joint in model.mechanism.joints.values())
        for topics in changed:
            topics.adopt(models[topics.name])
        self._publish(changed)
        for topics in changed:
            self.worker.queue(f'latched messages of {topics.name}',
                              partial(self._latched, topics, models[topics.name]))
        self.worker.queue('the robot_description of the scene', partial(self._robot, models))

    def _latched(self, topics: MechanismTopics, model: MechanismModel) -> Callable[[], None]:
        """Build a mechanism's latched messages; return a function to publish them."""
        return partial(topics.publish_latched, *model.latched())

    def _robot(self, models: dict[str, MechanismModel]) -> Callable[[], None]:
        """Build the scene's robot model; return a function to publish it."""
        # With `only_named`, the joints belong to a robot model that is published elsewhere.
        robots = [model.robot for model in models.values()
                  if model.robot and not model.mechanism.only_named]
        text = ''
        try:
            text = urdf.write(bodies.merged(robots)) if robots else ''
        except scene.SceneError as error:
            self.get_logger().info(f'the whole scene has no robot_description: {error}', once=True)
        return partial(self._scene_joint_states.description.publish, text)

    def destroy_node(self) -> None:
        """Delete all markers and loci, then end."""
        deadline = time.monotonic() + DELETION_TIMEOUT_S
        with suppress(RCLError, InvalidHandle):
            for topics in self._mechanisms.values():
                topics.clear(deadline)
        super().destroy_node()

    def _receive(self, routes: Routes, stamp: bytes, numbers: Sequence[Any]) -> None:
        """Set the inputs by a message, and publish the mechanisms that it moves."""
        sources, moved = routes
        if not moved:
            return
        for mechanism, i, position, velocity in sources:
            mechanism.receive(i, numbers[position], numbers[velocity] if velocity else None)
            mechanism.stamp = stamp
        self._stamp = stamp
        self._publish(moved)

    def _publish(self, moved: Iterable[MechanismTopics]) -> None:
        """Publish mechanisms at their present inputs, and the joint states of the scene."""
        in_scene = self._scene_joint_states.joint_states.has_subscribers
        # Solving all before publishing any takes less time: the caches of the CPU are small.
        outgoing = [message for mechanism in moved
                    for message in self._alone(mechanism.outgoing, in_scene) or ()]
        if in_scene:
            outgoing += self._scene_joint_states.outgoing(self._stamp, tuple(
                (mechanism.model, state) for mechanism in self._mechanisms.values()
                if (state := self._alone(mechanism.solved, in_scene))))
        for publish, data in outgoing:
            self._alone(publish, data)

    def _alone(self, function: Callable[[Any], Any], argument: Any) -> Any:
        """Call a function; report an internal error, which leaves other mechanisms alone."""
        try:
            return function(argument)
        except Exception as error:
            self.report('crank_states', error)
            return None

    def _interpret(self, message: JointState) -> Routes:
        """Return the inputs that a sender's messages set, and the mechanisms that they move."""
        count, moving = len(message.position), len(message.velocity) == len(message.name)
        # Index 0 of a message's numbers is its stamp.
        indices = dict(zip(message.name, range(1, 1 + count)))
        sources = [InputSource(self._mechanisms[mechanism], i, index, moving and count + index)
                   for name, index in indices.items()
                   for mechanism, i in self._inputs.get(name, ())]
        self._check_names(message.name)
        return sources, [*dict.fromkeys(source.mechanism for source in sources)]

    def _check_names(self, names: Iterable[str]) -> None:
        """Warn once of each unknown name."""
        unknown = self._unknown.new(name for name in names if name not in self._inputs
                                    and name not in self._joint_names)
        if unknown:
            self.get_logger().warning(
                f'{self.resolve_topic_name("crank_states")}: no input is called '
                f'{join_names(unknown, 150)}; the inputs are {join_names(self._inputs, 150)}'
                f'{self._unknown.ending}')

    def _warn_of_missing(self) -> None:
        """Warn of source joints that have not been received."""
        self._missing_timer.cancel()
        waiting = {name: mechanism for name, inputs in self._inputs.items()
                   for mechanism, i in inputs if self._mechanisms[mechanism].inputs[i] is None}
        if waiting:
            self.get_logger().warning(
                f'{self.resolve_topic_name("crank_states")}: no position of '
                f'{join_names(waiting, 150)} was received, without which '
                f'{join_names(dict.fromkeys(waiting.values()), 150)} cannot move')


def main(args: Any = None) -> int:
    """Run the node with command-line arguments `args`; return the exit code."""
    return scene_node.run([Kinematics], scene.KINEMATICS, args)


if __name__ == '__main__':
    shutdown.run(main)
