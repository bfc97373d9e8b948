# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Parameters: what each may be, checked one by one, in words that name it. No ROS is needed."""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from dataclasses import dataclass
import math
from typing import Any, List, Optional, Tuple

from .words import elided, MESSAGE, quoted

KINDS = {
    'bool': (bool, 'true or false'),
    'integer': (int, 'a whole number'),
    'double': (float, 'a finite number with a decimal point'),
    'string': (str, 'a text'),
    'double_array': (float, 'a list of finite numbers with a decimal point'),
    'string_array': (str, 'a list of texts'),
}

# How far, relatively, a value may be beyond an end of its range; the client library allows it.
ROUNDED = 1e-6


class SceneError(ValueError):
    """A parameter that cannot be; the text names it and says what is allowed."""

    def __init__(self, text: str):
        super().__init__(elided(text, MESSAGE))


@dataclass(frozen=True)
class Field:
    """
    What a parameter means and what it may be.

    Attributes
    ----------
    kind : str
        One of KINDS.
    meaning : str
        In words, with the unit.
    low, high : float, optional
        The ends of its range, for a slider too.
    positive : bool
        Whether it must be above zero.
    rule : str
        What else is asked of it.
    readers : tuple of str
        The nodes that act on it.
    read_only : bool
        Whether a change needs a restart.

    """

    kind: str
    meaning: str
    low: Optional[float] = None
    high: Optional[float] = None
    positive: bool = False
    rule: str = ''
    readers: Tuple[str, ...] = ()
    read_only: bool = False

    @property
    def allowed(self) -> str:
        """What it may be, in words."""
        words = [KINDS[self.kind][1]]
        if self.positive:
            words.append('above 0')
        if self.high is not None:
            words.append(f'up to {self.high:g}' if self.positive
                         else f'from {self.low:g} to {self.high:g}')
        return ' '.join(words) + (self.rule and f', {self.rule}')

    def checked(self, name: str, value: Any) -> Any:
        """Return a value, a list as a tuple; raise SceneError if it cannot be."""
        several = self.kind.endswith('_array')
        # The client library hands over an empty list as nothing at all.
        value = () if several and value is None else plain(value)
        if isinstance(value, tuple) != several or not all(
                map(self._holds, value if several else [value])):
            raise self.error(name, value)
        return value

    def error(self, name: str, value: Any) -> SceneError:
        """Return the error that says what the parameter must be, and what it is."""
        shown = list(value) if isinstance(value, tuple) else value
        return SceneError(f'{elided(name)} must be {self.allowed}, not {quoted(shown)}')

    def _holds(self, value) -> bool:
        if type(value) is not KINDS[self.kind][0]:
            return False
        if isinstance(value, float) and not math.isfinite(value) or self.positive and value <= 0:
            return False
        return self.high is None or self.low <= value <= self.high or any(
            math.isclose(value, end, rel_tol=ROUNDED) for end in (self.low, self.high))


@dataclass(frozen=True)
class Parameter:
    """A parameter as a node declares it: its full name, what it is, and its value."""

    name: str
    field: Field
    value: Any

    @property
    def range(self) -> Optional[Tuple[float, float]]:
        """
        The least and greatest value it can be changed to while a node runs.

        A slider has a hundred stops, counted from zero: the ends are whole stops.
        """
        if self.field.high is not None:
            return self.field.low, self.field.high
        if self.field.positive:
            return 0.1 * self.value, 10.1 * self.value
        return None


class Values:
    """The values that are given, by full parameter name, to be taken one by one."""

    def __init__(self, given: Mapping[str, Any]):
        if not isinstance(given, Mapping) or not all(isinstance(name, str) for name in given):
            raise SceneError(f'a scene is values by the names of parameters, not {quoted(given)}')
        self._left = dict(given)
        self.parameters: List[Parameter] = []

    def left(self, prefix: str = '') -> List[str]:
        """Return the names that begin with a prefix, of the values not taken yet."""
        return sorted(name for name in self._left if name.startswith(prefix))

    def take(self, name: str, field: Field, default: Any) -> Any:
        """Return the value of a parameter, and remember it as one that there is."""
        value = field.checked(name, self._left.pop(name)) if name in self._left else default
        self.parameters.append(Parameter(name, field, value))
        return value


def plain(value: Any) -> Any:
    """Return a value, any kind of list as a tuple."""
    return tuple(value) if isinstance(value, (list, tuple, array)) else value
