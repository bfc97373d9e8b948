# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Scene parameters of a node, declared and validated by rclpy's public hooks."""

from __future__ import annotations

from contextlib import suppress
from copy import copy
from typing import Any, Callable, Mapping, Sequence

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
from ..words import truncated


class Undeclared(ParameterNotDeclaredException):
    """A parameter is unknown; unlike that of rclpy, this exception has any text."""

    __init__ = Exception.__init__


class SceneParameters:
    """
    Reads a scene from a node's parameters; declares those that it owns, and validates changes.

    The `node` is created with `automatically_declare_parameters_from_overrides`. `role`, its name
    in `Field.readers`, selects its parameters. `check(scene)` raises SceneError for a scene that
    the node does not support. `changed()` is called after `scene` is replaced. Raises SceneError
    if the node's initial values are invalid.

    Attributes
    ----------
    scene : Scene
        The scene of the present values.
    fields, followed : dict
        By name, the Field of each parameter that the node owns, and of each that it uses and
        another node owns.
    is_given : bool
        Whether the node was started with any parameter of a scene.

    """

    def __init__(self, node: Any, role: str, check: Callable[[scenes.Scene], None],
                 changed: Callable[[], None]):
        self._node, self._check, self._changed = node, check, changed
        # An empty list in a parameter file has neither type nor value.
        values = {name: () if parameter.value is None else scenes.plain(parameter.value)
                  for name, parameter in node.get_parameters_by_prefix('').items()}
        self.scene = scenes.read(values)
        owned = [parameter for parameter in self.scene.parameters
                 if role == parameter.field.owner]
        self.fields = {parameter.name: parameter.field for parameter in owned}
        self.followed = {parameter.name: parameter.field for parameter in self.scene.parameters
                         if role in parameter.field.readers and parameter.name not in self.fields}
        of_scene = values.keys() & {parameter.name for parameter in self.scene.parameters}
        self.is_given = bool(of_scene)
        # A parameter is declared by its owner alone.
        for name in of_scene:
            node.undeclare_parameter(name)
        self._declare(owned)
        # The scene that a change leads to, and why it is refused.
        self._next, self._refusal = self.scene, ''
        node.add_pre_set_parameters_callback(self._read)
        node.add_on_set_parameters_callback(self._answer)
        node.add_post_set_parameters_callback(self._accept)

    def set_together(self, messages: Sequence[ParameterMessage]) -> dict[int, SetParametersResult]:
        """
        Set the parameters that are valid by themselves in one change; return results by index.

        One by one would fail: a leg with some old and some new dimensions may not be assembled.
        """
        valid = {}
        for i, message in enumerate(messages):
            with suppress(scenes.SceneError, KeyError, ValueError):
                parameter = Parameter.from_parameter_msg(message)
                self._checked(parameter)
                valid[i] = parameter
        # Of a repeated name the last value counts.
        last = {parameter.name: parameter for parameter in valid.values()}
        return dict.fromkeys(valid, self._node.set_parameters_atomically([*last.values()]))

    def follow(self, values: Mapping[str, Any]) -> str:
        """Adopt values of parameters of another node; return the reason of a refusal, or ''."""
        try:
            self._adopt(self._changed_scene(values))
        except scenes.SceneError as error:
            return str(error)
        return ''

    def ranged(self, name: str, descriptor: ParameterDescriptor) -> ParameterDescriptor:
        """Return a parameter's descriptor with its type and the range of allowed values."""
        field = self.fields.get(name)
        if field is None:
            return descriptor
        descriptor = copy(descriptor)
        # rclpy changes the descriptor's type to that of a refused value.
        descriptor.type = _kind(field).value
        if field.ends:
            # rclpy would refuse values that differ from an end by rounding.
            is_integer = field.kind == 'integer'
            ends = dict(zip(('from_value', 'to_value'), field.ends))
            descriptor.integer_range = [IntegerRange(step=1, **ends)] if is_integer else []
            descriptor.floating_point_range = [] if is_integer else [FloatingPointRange(**ends)]
        return descriptor

    def _declare(self, owned: Sequence[scenes.Parameter]) -> None:
        descriptors = {parameter.field: _descriptor(parameter.field) for parameter in owned}
        # The value of an empty list does not imply its type.
        empty = [typed(parameter) for parameter in owned if parameter.value == ()]
        self._node.declare_parameters('', [(
            parameter.name, None if parameter.value == () else parameter.value,
            copy(descriptors[parameter.field])) for parameter in owned], ignore_override=True)
        self._node.set_parameters_atomically(empty)

    def _read(self, parameters: list[Parameter]) -> list[Parameter]:
        """Read the changed scene; return the parameters in their declared types."""
        self._refusal = ''
        for parameter in parameters:
            if not self._node.has_parameter(parameter.name):
                raise Undeclared(self._unknown(parameter.name))
        try:
            values = {parameter.name: self._checked(parameter) for parameter in parameters
                      if parameter.name in self.fields}
            self._next = self._changed_scene(values)
        except scenes.SceneError as error:
            self._refusal = str(error)
            return parameters
        return [typed(scenes.Parameter(
            parameter.name, self.fields[parameter.name], values[parameter.name]))
            if parameter.name in values else parameter for parameter in parameters]

    def _unknown(self, name: str) -> str:
        field = self.followed.get(name)
        owner = f'; set it on {field.owner}' if field else ''
        node = self._node.get_fully_qualified_name()
        return f'{truncated(name)} is not a parameter of {node}{owner}'

    def _changed_scene(self, values: Mapping[str, Any]) -> scenes.Scene:
        """Return the scene with changed values; raise SceneError if it is refused."""
        if not values:
            return self.scene
        changed = scenes.changed(self.scene, values)
        self._check(changed)
        return changed

    def _checked(self, parameter: Parameter) -> Any:
        """Return the value of a parameter of the scene, valid by itself; raise SceneError."""
        name, field = parameter.name, self.fields[parameter.name]
        if field.read_only:
            raise scenes.SceneError(f'{name} can be set only when the node is started')
        if parameter.type_ == Parameter.Type.NOT_SET:
            raise scenes.SceneError(f'{name} cannot be removed; it must be {field.allowed}')
        return field.checked(name, parameter.value)

    def _answer(self, parameters: list[Parameter]) -> SetParametersResult:
        reason = self._refusal if self._has_any(parameters) else ''
        return SetParametersResult(successful=not reason, reason=reason)

    def _accept(self, parameters: list[Parameter]) -> None:
        if self._has_any(parameters):
            self._adopt(self._next)

    def _has_any(self, parameters: list[Parameter]) -> bool:
        """Return whether any is of the scene; rclpy calls back for those declared later, too."""
        return any(parameter.name in self.fields for parameter in parameters)

    def _adopt(self, changed: scenes.Scene) -> None:
        if changed is not self.scene:
            self.scene = changed
            self._changed()


def _kind(field: Any) -> Parameter.Type:
    return Parameter.Type[field.kind.upper()]


def typed(parameter: scenes.Parameter) -> Parameter:
    """Return a scene's parameter as one of ROS, with the type of its field."""
    return Parameter(parameter.name, _kind(parameter.field), parameter.value)


def _descriptor(field: Any) -> ParameterDescriptor:
    """Return the descriptor of a field, without its name."""
    # Dynamic typing lets the field refuse a wrong type with its own message.
    return ParameterDescriptor(
        description=field.meaning, read_only=field.read_only, type=_kind(field).value,
        additional_constraints=field.allowed, dynamic_typing=True)
