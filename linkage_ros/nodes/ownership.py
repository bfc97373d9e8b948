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
Parameters that several nodes use have one owner: types, dimensions, branches, scale, sweep.

The owner is `kinematics`. It announces its values on `scene_parameters`, and the other nodes adopt
them while it runs; without it, each node uses its own values. A full announcement has all values,
among them `mechanisms`; the following ones have only what has changed. A late subscriber receives
the last full announcement and those after it.
"""

from __future__ import annotations

from typing import Any, Callable, Dict, Iterable, List, Mapping, Optional, Sequence, Set, Tuple

from rcl_interfaces.msg import ParameterEvent
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import DurabilityPolicy, QoSProfile

from .parameters import SceneParameters
from .. import scene
from ..words import elided, listed, quoted

TOPIC = 'scene_parameters'
DEPTH = 500
LATCHED = QoSProfile(depth=DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Announcer:
    """Publishes the owner's values of parameters that several nodes use."""

    def __init__(self, node: Any):
        self._node = node
        self._publisher = node.create_publisher(ParameterEvent, TOPIC, LATCHED)
        # Number of announcements since the last full one, including that.
        self._announced = 0

    def first(self) -> Callable[[], None]:
        """Return a function that makes the first announcement, with all values."""
        read, values = self._node.scene, _messages(self._node.scene.parameters)

        def publish() -> None:
            if not self._announced:
                self._announced = 1
                self._publish(new_parameters=values if read is self._node.scene else _messages(
                    self._node.scene.parameters))
        return publish

    def announce(self, changed: Iterable[scene.Parameter]) -> None:
        """Publish those changed values that several nodes use; nothing before the first."""
        values = _messages(changed)
        if self._announced and values:
            # A late subscriber receives DEPTH messages, and needs the full one among them.
            self._announced = 1 if self._announced == DEPTH else self._announced + 1
            self._publish(changed_parameters=values if self._announced > 1 else _messages(
                self._node.scene.parameters))

    def _publish(self, **values: Any) -> None:
        self._publisher.publish(ParameterEvent(
            stamp=self._node.get_clock().now().to_msg(),
            node=self._node.get_fully_qualified_name(), **values))


class Follower:
    """Sets a node's parameters to the values that their owner announces."""

    def __init__(self, node: Any, parameters: SceneParameters):
        self._node, self._parameters = node, parameters
        self._owner = ''
        self._owned: Set[str] = set()
        self._warned: Dict[str, Sequence[str]] = {}
        self._refused: Dict[str, Any] = {}
        self._subscription = node.create_subscription(
            ParameterEvent, TOPIC, node.guarded(TOPIC, self._receive), LATCHED)

    def owner_of(self, name: str) -> Optional[str]:
        """Return the full name of the running node that owns a parameter; None if none does."""
        owned = name in self._owned and self._node.count_publishers(self._subscription.topic_name)
        return self._owner if owned else None

    def _receive(self, event: ParameterEvent) -> None:
        fields = self._parameters.fields
        values, wrong = _read((*event.new_parameters, *event.changed_parameters), fields)
        if 'mechanisms' in values or event.node != self._owner:
            self._compare(event, values)
        # Values that this node has refused may be valid together with the new ones.
        changed = {name: value for name, value in {**self._refused, **values}.items()
                   if name in self._owned and not fields[name].read_only
                   and value != self._present(name)}
        refused = self._parameters.follow(dict(sorted(changed.items())))
        self._refused = {name: changed[name] for name in refused}
        self._warn('refused', wrong + [*refused.values()], 'values that cannot be followed')

    def _present(self, name: str) -> Any:
        return scene.plain(self._node.get_parameter_or(name).value)

    def _compare(self, event: ParameterEvent, values: Mapping[str, Any]) -> None:
        """Compare a full announcement with this node's mechanisms: equal ones are followed."""
        fields, machines = self._parameters.fields, self._parameters.scene.machines
        started = event.node != self._owner or event.new_parameters
        self._owner, self._refused = event.node, {}
        here = {name: self._present(name) for name in values}
        fixed = {name for name in here if fields[name].read_only and name != 'mechanisms'}
        unlike = {name.partition('.')[0]: name for name in fixed if here[name] != values[name]}
        missing = set(machines) ^ set(values.get('mechanisms') or ())
        followed = machines.keys() - missing - unlike.keys()
        self._owned = {name for name in here if '.' in name and name.partition('.')[0] in followed}
        self._warn('unlike', [f'{name} is {quoted(here[name])} here and '
                              f'{quoted(values[name])} there' for name in unlike.values()],
                   'another mechanism, which is not followed')
        self._warn('missing', sorted(missing), 'other mechanisms; only one of the nodes has')
        if started:
            self._warned.pop('values', None)
            self._warn('values', [
                f'{name} was {quoted(here[name])} and is now {quoted(values[name])}'
                for name in sorted(self._owned - fixed) if here[name] != values[name]],
                'other values, which are followed')

    def _warn(self, kind: str, particulars: Sequence[str], what: str) -> None:
        """Warn that the owner has `what`; repeat it only when the particulars have changed."""
        if particulars and particulars != self._warned.get(kind):
            self._node.get_logger().warning(
                f'{elided(self._owner)} has {what}: {listed(particulars, 1000)}')
        self._warned[kind] = particulars


def _messages(parameters: Iterable[scene.Parameter]) -> List:
    return [Parameter(p.name, Parameter.Type[p.field.kind.upper()], p.value).to_parameter_msg()
            for p in parameters if p.field.shared]


def _read(messages: Iterable, fields: Mapping[str, Any]) -> Tuple[Dict[str, Any], List[str]]:
    """Return the valid values of known parameters by name, and the errors of invalid ones."""
    values: Dict[str, Any] = {}
    wrong: List[str] = []
    for message in messages:
        name = message.name
        if name in fields:
            try:
                values[name] = fields[name].checked(name, parameter_value_to_python(message.value))
            except scene.SceneError as error:
                wrong.append(str(error))
            except RuntimeError:
                wrong.append(f'{name} has an unknown type')
    return values, wrong
