# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The parameters of the scene's nodes for the page's sliders."""

import math
import sys
from typing import Any

from ..nodes.parameters import typed
from ..scene import Parameter, SceneError

NUMBERS = 'double', 'integer', 'bool'


def described(parameter: Parameter) -> dict[str, Any]:
    """
    Describe a parameter for the page.

    The page has a control for it in a `group`, or none if that is empty.
    """
    field = parameter.field
    has_control = not field.read_only and field.kind in NUMBERS
    return {'name': name_in_mechanism(parameter), 'value': parameter.value,
            'kind': field.kind, 'meaning': field.meaning, 'allowed': field.allowed,
            'unit': field.unit, 'group': (field.group or 'more') if has_control else ''}


def name_in_mechanism(parameter: Parameter) -> str:
    """Return the name of a parameter without its mechanism."""
    return parameter.name.partition('.')[2]


def message(parameter: Parameter, value: Any, node: str) -> Any:
    """
    Return a message that sets a parameter, of a node, to a value from JSON.

    Raises SceneError if the value is not allowed.
    """
    name, field = parameter.name, parameter.field
    if field.kind not in NUMBERS:
        raise SceneError(f'{name} is no number, and the page sets numbers only: use ros2 '
                         f'param set {node} {name}')
    return typed(parameter._replace(value=field.checked(name, value))).to_parameter_msg()


def is_number(value: Any) -> bool:
    """Return whether a value from JSON is a finite number in the range of a double."""
    return type(value) in (int, float) and abs(value) <= sys.float_info.max


def shown(value: Any) -> Any:
    """Return a value for JSON: None for a number that is not finite."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
