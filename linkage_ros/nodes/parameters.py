# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Scene parameters of a node, declared and validated by rclpy's public hooks."""

from __future__ import annotations

from contextlib import suppress
from copy import copy
from shlex import quote
from typing import Any, Callable, Mapping, Optional, Sequence

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    Parameter as ParameterMessage,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.parameter import Parameter

from .. import scene as scenes
from ..scene import slider
from ..words import elided, quoted


class Undeclared(ParameterNotDeclaredException):
    """A parameter is unknown; unlike that of rclpy, this exception has any text."""

    __init__ = Exception.__init__


class SceneParameters:
    """
    Declares the parameters that a node uses, and validates every change.

    The `node` is created with `automatically_declare_parameters_from_overrides`. `role`, one of
    scenes.ALL, selects its parameters. `check(scene)` raises SceneError for a scene that the node
    does not support. `changed(parameters)` is called with the changed ones, after `scene` is
    replaced. Raises SceneError if the node's initial values are invalid.

    Attributes
    ----------
    scene : Scene
        The scene of the present values.
    fields : dict
        The Field of each declared parameter, by name.
    is_given : bool
        Whether the node was started with any parameter of a scene.

    """

    def __init__(self, node: Any, role: str, check: Callable[[scenes.Scene], None],
                 changed: Callable[[list[scenes.Parameter]], None]):
        self._node, self._role, self._check, self._changed = node, role, check, changed
        # Full name of the node that owns a parameter, or None.
        self.owner_of: Callable[[str], Optional[str]] = lambda name: None
        # Whether values from their owner are being set, and whether changed defaults are.
        self._from_owner = self._is_derived = False
        # An empty list in a parameter file has neither type nor value.
        given = {name: () if one.value is None else scenes.plain(one.value)
                 for name, one in node.get_parameters_by_prefix('').items()}
        self.scene = scenes.read(given)
        own = [one for one in self.scene.parameters if role in one.field.readers]
        self.fields = {one.name: one.field for one in own}
        of_scene = given.keys() & {one.name for one in self.scene.parameters}
        self.is_given = bool(of_scene)
        # Parameters of other nodes only are not declared here.
        for name in of_scene:
            node.undeclare_parameter(name)
        self._declare(own)
        self._candidate = self.scene
        # Requested slider ranges by name: mechanism, value, and the range computed from them.
        self._ends: dict[str, tuple[Any, Any, Any]] = {}
        node.add_pre_set_parameters_callback(self._typed_alike)
        node.add_on_set_parameters_callback(self._validate)
        node.add_post_set_parameters_callback(self._adopt)

    def set_valid(self, messages: Sequence[ParameterMessage]) -> dict[int, SetParametersResult]:
        """Set together those parameters that are valid by themselves; return results by index."""
        valid = {}
        for i, one in enumerate(messages):
            with suppress(scenes.SceneError, KeyError, ValueError):
                parameter = Parameter.from_parameter_msg(one)
                if not self.fields[one.name].read_only:
                    self._value(parameter)
                    valid[i] = parameter
        return dict(zip(valid, self._set_together([*valid.values()])))

    def follow(self, values: Mapping[str, Any]) -> dict[str, str]:
        """Set parameters to their owner's values; return the reasons of refusals by name."""
        self._from_owner = True
        try:
            results = self._set_together([
                Parameter(name, value=value) for name, value in values.items()])
        finally:
            self._from_owner = False
        return {name: result.reason for name, result in zip(values, results)
                if not result.successful}

    def _set_together(self, parameters: list[Parameter]) -> list[SetParametersResult]:
        """
        Set parameters atomically; if that is refused, each half of them. Return a result for each.

        One by one would fail: a leg with some old and some new dimensions may not be assembled. If
        a name is repeated, only its last value is validated and set.
        """
        if not parameters:
            return []
        result = self._node.set_parameters_atomically(
            [*{one.name: one for one in parameters}.values()])
        if result.successful or len(parameters) == 1:
            return [result] * len(parameters)
        half = len(parameters) // 2
        return self._set_together(parameters[:half]) + self._set_together(parameters[half:])

    def ranged(self, name: str, descriptor: ParameterDescriptor) -> ParameterDescriptor:
        """Return a parameter's descriptor with a slider range around its value."""
        if name not in self.fields:
            return descriptor
        descriptor, ends = copy(descriptor), self._slider_ends(name)
        # rclpy changes the descriptor's type to that of a refused value.
        descriptor.type = _kind(self.fields[name]).value
        if ends and self.fields[name].kind == 'integer':
            descriptor.integer_range = [IntegerRange(from_value=ends[0], to_value=ends[1], step=1)]
        elif ends:
            # With a step other than 0, rclpy would refuse rounded values.
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=ends[0], to_value=ends[1], step=0.0)]
        return descriptor

    def renew_ranges(self) -> None:
        """Recompute the requested slider ranges; this may run in another thread."""
        for name in list(self._ends):
            self._slider_ends(name)

    def _slider_ends(self, name: str) -> Any:
        value = scenes.plain(self._node.get_parameter(name).value)
        machine, made_of, ends = self._ends.get(name, (None, None, None))
        present = self.scene.machines.get(name.partition('.')[0])
        if name not in self._ends or machine is not present or made_of != value:
            ends = slider.ends(self.scene, scenes.Parameter(name, self.fields[name], value))
            self._ends[name] = present, value, ends
        return ends

    def _declare(self, own: Sequence[scenes.Parameter]) -> None:
        descriptors = {field: _descriptor(field, field.read_only)
                       for field in {one.field for one in own}}
        # The value of an empty list does not imply its type.
        empty = [one for one in own if one.value == ()]
        self._node.declare_parameters('', [
            (one.name, one.value, copy(descriptors[one.field])) if one.value != () else
            (one.name, None, _descriptor(one.field, read_only=False)) for one in own],
            ignore_override=True)
        self._node.set_parameters_atomically([_parameter(one) for one in empty])
        for one in empty:
            if one.field.read_only:
                self._node.set_descriptor(one.name, descriptors[one.field])

    def _typed_alike(self, parameters: list[Parameter]) -> list[Parameter]:
        """Convert parameters to their declared types: 3 to 3.0, an empty list to a typed one."""
        for one in parameters:
            if not self._node.has_parameter(one.name):
                raise Undeclared(f'{elided(one.name)} is not a parameter of '
                                 f'{self._node.get_fully_qualified_name()}')
        return [self._typed(one) for one in parameters]

    def _typed(self, parameter: Parameter) -> Parameter:
        field = self.fields.get(parameter.name)
        try:
            return parameter if not field or parameter.type_ == Parameter.Type.NOT_SET else (
                Parameter(parameter.name, _kind(field), field.checked(
                    parameter.name, parameter.value)))
        except scenes.SceneError:
            # `_validate` refuses it with an explanation.
            return parameter

    def _validate(self, parameters: list[Parameter]) -> SetParametersResult:
        if self._is_derived:
            return SetParametersResult(successful=True)
        try:
            values = {one.name: self._value(one) for one in parameters
                      if one.name in self.fields}
            strict = not self._from_owner and self._role in scenes.START.readers
            candidate = scenes.changed(self.scene, values, strict) if values else self.scene
            self._check(candidate)
        except scenes.SceneError as error:
            return SetParametersResult(successful=False, reason=str(error))
        except Exception as error:
            self._node.report('a changed parameter', error)
            return SetParametersResult(
                successful=False, reason=elided(f'internal error: {error!r}', 299))
        self._candidate = candidate
        return SetParametersResult(successful=True)

    def _value(self, parameter: Parameter) -> Any:
        name, field = parameter.name, self.fields[parameter.name]
        if parameter.type_ == Parameter.Type.NOT_SET:
            raise scenes.SceneError(f'{name} cannot be removed; it must be {field.allowed}')
        value = field.checked(name, parameter.value)
        owner = None if self._from_owner else self.owner_of(name)
        if owner:
            raise scenes.SceneError(
                f'{name} belongs to {owner} while it runs: ros2 param set {owner} {name} '
                + quote(quoted(list(value) if isinstance(value, tuple) else value)))
        return value

    def _adopt(self, parameters: list[Parameter]) -> None:
        if self._is_derived or self._candidate is self.scene:
            return
        changed = self._candidate.changed_from(self.scene)
        if not changed:
            return
        self.scene = self._candidate
        given = {one.name for one in parameters}
        # The defaults of some parameters depend on the values of others.
        derived = [_parameter(one) for one in changed if one.name in self.fields
                   and one.name not in given and not one.field.read_only]
        if derived:
            self._is_derived = True
            try:
                self._node.set_parameters_atomically(derived)
            finally:
                self._is_derived = False
        self._changed(changed)


def _kind(field: Any) -> Parameter.Type:
    return Parameter.Type[field.kind.upper()]


def _parameter(parameter: scenes.Parameter) -> Parameter:
    """Return a ROS parameter with the type of its field."""
    return Parameter(parameter.name, _kind(parameter.field), parameter.value)


def _descriptor(field: Any, read_only: bool) -> ParameterDescriptor:
    """Return the descriptor of a field, without its name."""
    # Dynamic typing lets the field refuse a wrong type with its own message.
    return ParameterDescriptor(
        description=field.meaning, read_only=read_only, type=_kind(field).value,
        additional_constraints=field.allowed, dynamic_typing=True)
