# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Each parameter of a scene has one owner: `crank_driver` those of motions, `kinematics` all others.

An owner announces its values on `scene_parameters`. Nodes that use them follow: they adopt them,
and keep the last ones when the owner ends. Until an announcement they have the values of their own
file. A full announcement has all values of its owner; the following ones have only what has
changed. A late subscriber receives the last full announcement and those after it.
"""

from __future__ import annotations

from typing import Any, Iterable, Mapping, Sequence

from rcl_interfaces.msg import ParameterEvent
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import DurabilityPolicy, QoSProfile

from .log import Throttle
from .parameters import SceneParameters, typed
from .. import scene
from ..words import join_names, short_repr, truncated

TOPIC = 'scene_parameters'
LATCHED = QoSProfile(depth=500, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Announcer:
    """Publishes the values of the parameters that a node owns: first all, then changed ones."""

    def __init__(self, node: Any):
        self._node, self._count = node, 0
        self._publisher = node.create_publisher(ParameterEvent, TOPIC, LATCHED)

    def announce(self, changed: Iterable[scene.Parameter] = ()) -> None:
        """Publish those changed values that the node owns; the first time all values."""
        # A late subscriber receives the last `depth` messages, and needs a full one among them.
        is_full = self._count % LATCHED.depth == 0
        values = [typed(parameter).to_parameter_msg()
                  for parameter in (self._node.scene.parameters if is_full else changed)
                  if parameter.name in self._node.fields]
        if values:
            self._publisher.publish(ParameterEvent(
                stamp=self._node.get_clock().now().to_msg(),
                node=self._node.get_fully_qualified_name(),
                **{'new_parameters' if is_full else 'changed_parameters': values}))
            self._count += 1


class Follower:
    """Adopts the values of the parameters that a node uses and does not own."""

    def __init__(self, node: Any, parameters: SceneParameters):
        self._parameters, self._owner = parameters, ''
        self._throttle = Throttle(node.get_logger())
        # The mechanisms whose values are adopted, and values that are not adopted yet.
        self._mechanisms: set[str] = set()
        self._waiting: dict[str, Any] = {}
        node.create_subscription(
            ParameterEvent, TOPIC, node.guarded(TOPIC, self._receive), LATCHED)

    def _receive(self, event: ParameterEvent) -> None:
        fields = self._parameters.followed
        # An invalid value raises: its announcement is reported, and not followed at all.
        values = {message.name: fields[message.name].checked(
            message.name, parameter_value_to_python(message.value))
            for message in (*event.new_parameters, *event.changed_parameters)
            if message.name in fields}
        mechanisms = values.pop('mechanisms', None)
        if mechanisms is not None:
            self._compare(event, mechanisms, values)
        elif event.node != self._owner:
            # Those of an owner of other parameters, or one whose full announcement follows.
            return
        # Values that were refused may be valid together with the new ones.
        self._waiting.update((name, value) for name, value in values.items()
                             if name.partition('.')[0] in self._mechanisms
                             and not fields[name].read_only)
        if refusal := self._parameters.follow(self._waiting):
            self._warn('values that cannot be followed', [refusal])
        else:
            self._waiting = {}

    def _compare(self, event: ParameterEvent, mechanisms: Iterable[str],
                 announced: Mapping[str, Any]) -> None:
        """Compare a full announcement with this node's mechanisms: equal ones are followed."""
        fields, present = self._parameters.followed, self._parameters.scene.mechanisms
        values = {parameter.name: parameter.value
                  for name in {name.partition('.')[0] for name in announced} & present.keys()
                  for parameter in present[name].parameters}
        self._owner, self._waiting = event.node, {}
        unlike = {name.partition('.')[0]: name for name in announced
                  if fields[name].read_only and values[name] != announced[name]}
        missing = present.keys() ^ set(mechanisms)
        self._mechanisms = present.keys() - missing - unlike.keys()
        self._warn('another mechanism, which is not followed', [
            f'{name} is {short_repr(values[name])} here and {short_repr(announced[name])} there'
            for name in unlike.values()])
        self._warn('other mechanisms; only one of the nodes has', sorted(missing))
        if event.new_parameters:
            self._warn('other values, which are followed', [
                f'{name} was {short_repr(values[name])} and is now {short_repr(announced[name])}'
                for name in sorted(announced) if name.partition('.')[0] in self._mechanisms
                and values[name] != announced[name]])

    def _warn(self, what: str, particulars: Sequence[str]) -> None:
        """Warn that the owner has `what`, if it has any; throttled."""
        if particulars:
            self._throttle.warn(what, lambda: (
                f'{truncated(self._owner)} has {what}: {join_names(particulars, 1000)}'))
