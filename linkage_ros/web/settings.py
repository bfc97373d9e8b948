# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The parameters of the scene's nodes for the page's sliders."""

import asyncio
from dataclasses import dataclass
import math
import sys
from typing import Any, Collection

from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    ListParameters,
    SetParametersAtomically,
)
from rclpy.parameter import Parameter, parameter_value_to_python

from .bridge import Bridge
from ..words import quoted

# Descriptor and value message by name.
Described = dict[str, tuple[Any, Any]]

SERVICES = {'list_parameters': ListParameters, 'describe_parameters': DescribeParameters,
            'get_parameters': GetParameters, 'set_parameters_atomically': SetParametersAtomically}
# Number of names in one request: a node needs some 20 ms for the range of each dimension.
NAMES_AT_ONCE = 20


class RemoteNode:
    """The parameter services of one node; made and closed in the executor's thread."""

    def __init__(self, bridge: Bridge, name: str) -> None:
        self.name = name
        self._bridge = bridge
        self._clients = {service: bridge.node.create_client(type_, f'{name}/{service}')
                         for service, type_ in SERVICES.items()}

    def close(self) -> None:
        """Destroy the clients."""
        for client in self._clients.values():
            self._bridge.node.destroy_client(client)

    async def parameters(self, prefixes: list[str], known: Collection[str] = ()) -> Described:
        """
        Return descriptor and value message by name, except for known names.

        Raises
        ------
        NoAnswer
            If the node does not answer.

        """
        found: Described = {}
        listed = await self._call('list_parameters', prefixes=prefixes)
        names = [name for name in listed.result.names if name not in known]
        for start in range(0, len(names), NAMES_AT_ONCE):
            part = names[start:start + NAMES_AT_ONCE]
            described, got = await asyncio.gather(
                self._call('describe_parameters', names=part),
                self._call('get_parameters', names=part))
            found.update(zip(part, zip(described.descriptors, got.values)))
        return found

    async def set(self, parameters: list[Any]) -> str:
        """Set all parameters or none; return the reason of a refusal, or an empty text."""
        response = await self._call('set_parameters_atomically', parameters=parameters)
        result = response.result
        return '' if result.successful else result.reason or f'{self.name} gives no reason'

    async def _call(self, service: str, **request: Any) -> Any:
        return await self._bridge.call(
            self._clients[service], SERVICES[service].Request(**request))


@dataclass
class Setting:
    """
    A parameter on the page, with the node on which it is set.

    Raises
    ------
    ValueError
        If its type is unknown.

    """

    name: str
    node: str
    descriptor: Any
    message: Any

    def __post_init__(self) -> None:
        self._type = Parameter.Type(self.message.type)

    @property
    def value(self) -> Any:
        """Its value for JSON."""
        value = parameter_value_to_python(self.message)
        return list(map(shown, value)) if isinstance(value, list) else shown(value)

    def described(self) -> dict[str, Any]:
        """Return its description for the page."""
        about = self.descriptor
        ranges = [*about.floating_point_range, *about.integer_range]
        low, high, step = (ranges[0].from_value, ranges[0].to_value,
                           ranges[0].step) if ranges else (None, None, None)
        return {'name': self.name, 'value': self.value, 'kind': self._type.name.lower(),
                'meaning': about.description, 'allowed': about.additional_constraints,
                'fixed': about.read_only, 'low': shown(low), 'high': shown(high),
                'step': shown(step)}

    def asked(self, full_name: str, value: Any) -> Any:
        """Return a parameter message with a value from JSON; ValueError if it is not allowed."""
        if self._type not in ALLOWS:
            raise ValueError(f'{full_name} is no number, and the page sets numbers only: use ros2 '
                             f'param set {self.node} {full_name}')
        if not ALLOWS[self._type](value):
            allowed = self.descriptor.additional_constraints or f'a {self._type.name.lower()}'
            raise ValueError(f'{full_name} must be {allowed}, not {quoted(value)}')
        if self._type == Parameter.Type.DOUBLE:
            value = float(value)
        return Parameter(full_name, self._type, value).to_parameter_msg()


def is_number(value: Any) -> bool:
    """Return whether a value from JSON is a finite number in the range of a double."""
    return type(value) in (int, float) and abs(value) <= sys.float_info.max


ALLOWS = {
    Parameter.Type.DOUBLE: is_number,
    Parameter.Type.INTEGER: lambda value: type(value) is int and -1 << 63 <= value < 1 << 63,
    Parameter.Type.BOOL: lambda value: type(value) is bool,
}


def shown(value: Any) -> Any:
    """Return a value for JSON: None for a number that is not finite."""
    if isinstance(value, bytes):
        return value[0]
    return None if isinstance(value, float) and not math.isfinite(value) else value
