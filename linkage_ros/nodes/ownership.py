# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
One owner of what several nodes act on: types, dimensions, branches, scale and sweep.

`kinematics` announces its values on `scene_parameters`; the other nodes follow them while it is
there. Without it, or after it, each goes by its own. An announcement with the names of the
mechanisms has all values, any other those that have changed since the one before. Whoever comes
late gets the last with all, and those after it.
"""

from typing import Iterable, Optional

from rcl_interfaces.msg import ParameterEvent
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import DurabilityPolicy, QoSProfile

from .parameter_server import Asked, Change
from .. import scene
from ..words import elided, listed, quoted

TOPIC = 'scene_parameters'
DEPTH = 500
LATCHED = QoSProfile(depth=DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Announcer:
    """Publishes the values of all parameters that several nodes act on."""

    def __init__(self, node):
        self._node = node
        self._publisher = node.create_publisher(ParameterEvent, TOPIC, LATCHED)
        self._kept = 0

    def first(self):
        """Return what publishes all values for the first time, if nothing else has till then."""
        of, values = self._node.scene, _messages(self._node.scene.parameters)

        def publish():
            if not self._kept:
                self._kept = 1
                self._publish(new_parameters=values if of is self._node.scene else _messages(
                    self._node.scene.parameters))
        return publish

    def announce(self, changed: Iterable[scene.Parameter]):
        """Publish the values that several nodes act on of those that have changed."""
        values = _messages(changed)
        if self._kept and values:
            # What has all values must not be the one that the next one pushes out.
            self._kept = 1 if self._kept == DEPTH else self._kept + 1
            self._publish(changed_parameters=values if self._kept > 1 else _messages(
                self._node.scene.parameters))

    def _publish(self, **values):
        self._publisher.publish(ParameterEvent(
            stamp=self._node.get_clock().now().to_msg(),
            node=self._node.get_fully_qualified_name(), **values))


class Follower:
    """Hears the owner's values, and asks for the changes that they make."""

    def __init__(self, node, ask):
        self._node, self._ask = node, ask
        self._owner, self._owned, self._said, self._refused = None, set(), {}, {}
        self._subscription = node.create_subscription(
            ParameterEvent, TOPIC, self._hear, LATCHED)

    def owner_of(self, name: str) -> Optional[str]:
        """Return the full name of the node that a parameter belongs to, while it is there."""
        there = name in self._owned and self._node.count_publishers(self._subscription.topic_name)
        return self._owner if there else None

    def _hear(self, event):
        values, wrong = _read((*event.new_parameters, *event.changed_parameters),
                              self._node.fields)
        if 'mechanisms' in values or event.node != self._owner:
            self._meet(event, values)
        # What could not be may be now.
        values = {name: value for name, value in {**self._refused, **values}.items()
                  if name in self._owned and not self._node.fields[name].read_only}
        changes = [Change([Parameter(name, value=values[name])], followed=True)
                   for name in sorted(values)]
        self._ask(Asked(changes, lambda: self._complain(changes, wrong), []))

    def _meet(self, event, values):
        """Find out what is followed of an owner that says all."""
        fields, machines = self._node.fields, self._node.scene.machines
        started = event.node != self._owner or event.new_parameters
        self._owner, self._refused = event.node, {}
        here = {name: scene.plain(self._node.get_parameter_or(name).value) for name in values}
        fixed = {name for name in here if fields[name].read_only and name != 'mechanisms'}
        unlike = {name.partition('.')[0]: name for name in fixed if here[name] != values[name]}
        missing = set(machines) ^ set(values.get('mechanisms') or ())
        followed = machines.keys() - missing - unlike.keys()
        self._owned = {name for name in here if '.' in name and name.partition('.')[0] in followed}
        self._say('unlike', [f'{name} is {quoted(here[name])} here and '
                             f'{quoted(values[name])} there' for name in unlike.values()],
                  'another mechanism, which is not followed')
        self._say('missing', sorted(missing), 'other mechanisms')
        if started:
            self._said.pop('values', None)
            self._say('values', [
                f'{name} was {quoted(here[name])} and is now {quoted(values[name])}'
                for name in sorted(self._owned - fixed) if here[name] != values[name]],
                'other values, which are followed')

    def _complain(self, changes, wrong):
        refused = [change for change in changes if not change.result.successful]
        self._refused = {p.name: p.value for change in refused for p in change.parameters}
        self._say('refused', wrong + [change.result.reason for change in refused],
                  'values that cannot be followed')

    def _say(self, kind, particulars, what):
        """Warn of something once, and again when it is another thing."""
        if particulars and particulars != self._said.get(kind):
            self._node.get_logger().warning(
                f'{elided(self._owner)} has {what}: {listed(particulars, 1000)}')
        self._said[kind] = particulars


def _messages(parameters):
    return [Parameter(p.name, Parameter.Type[p.field.kind.upper()], p.value).to_parameter_msg()
            for p in parameters if p.field.shared]


def _read(messages, fields):
    """Return the values of the fields that there are, and what is wrong with the others."""
    values, wrong = {}, []
    for message in messages:
        name = message.name
        if name in fields:
            try:
                values[name] = fields[name].checked(name, parameter_value_to_python(message.value))
            except scene.SceneError as error:
                wrong.append(str(error))
            except RuntimeError:
                wrong.append(f'{name} has a type that there is not')
    return values, wrong
