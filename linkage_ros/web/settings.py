# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The parameters of the scene's nodes for the page's sliders."""

from dataclasses import dataclass
import math
import sys
from typing import Any, Mapping, Optional, Union

from .. import scene
from ..nodes.parameters import typed

Ends = Optional[tuple[Union[int, float], Union[int, float]]]


@dataclass
class Setting:
    """
    A parameter on the page: its field, and the ends of its slider, if it has one.

    `full_name` begins with the mechanism; `node` owns it, and `values` are its values by full
    name.
    """

    full_name: str
    field: scene.Field
    ends: Ends
    node: str
    values: Mapping[str, Any]

    @property
    def name(self) -> str:
        """Return its name in the mechanism."""
        return self.full_name.partition('.')[2]

    @property
    def value(self) -> Any:
        """Return its value for JSON."""
        value = self.values[self.full_name]
        return list(map(shown, value)) if isinstance(value, tuple) else shown(value)

    def described(self) -> dict[str, Any]:
        """Return its description for the page, which has a control for it in a group, or none."""
        low, high = self.ends or (None, None)
        has_control = not self.field.read_only and (
            self.field.kind == 'bool' or self.ends is not None and self.ends[0] < self.ends[1])
        return {'name': self.name, 'value': self.value, 'kind': self.field.kind,
                'meaning': self.field.meaning, 'allowed': self.field.allowed,
                'unit': self.field.unit, 'low': low, 'high': high,
                'group': (self.field.group or 'more') if has_control else ''}

    def parameter(self, value: Any) -> Any:
        """Return a parameter message with a value from JSON; ValueError if it is not allowed."""
        name = self.full_name
        if self.field.kind not in ('double', 'integer', 'bool'):
            raise ValueError(f'{name} is no number, and the page sets numbers only: use ros2 '
                             f'param set {self.node} {name}')
        return typed(scene.Parameter(
            name, self.field, self.field.checked(name, value))).to_parameter_msg()


def is_number(value: Any) -> bool:
    """Return whether a value from JSON is a finite number in the range of a double."""
    return type(value) in (int, float) and abs(value) <= sys.float_info.max


def shown(value: Any) -> Any:
    """Return a value for JSON: None for a number that is not finite."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
