# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Description and validation of parameters. Errors name the parameter. No ROS is needed."""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from dataclasses import dataclass, replace
import math
import re
from typing import Any, Iterable, List, Optional, Tuple, Type

from ..cache import cached
from ..words import elided, listed, meant, MESSAGE, quoted

# The nodes that use parameters; OWNER owns each that it uses.
DRIVER, KINEMATICS, INVERSE = ALL = 'crank_driver', 'kinematics', 'servo_inverse'
OWNER = KINEMATICS

GROUPS = DIMENSIONS, BRANCHES, SPEEDS, STARTS = 'dimensions', 'branches', 'speeds', 'starts'

# Parameters that rclpy declares.
_ROS = re.compile(r'(use_sim_time|start_type_description_service)$')

# Python type of a value or of the items of a list, and its description, by kind.
KINDS = {
    'bool': (bool, 'true or false'),
    'integer': (int, 'a whole number'),
    'double': (float, 'a finite number'),
    'string': (str, 'a text of up to 1000 letters'),
    'double_array': (float, 'a list of finite numbers'),
    'string_array': (str, 'a list of texts of up to 1000 letters'),
}

# Relative tolerance at the ends of a range, as in rclpy.
ROUNDED = 1e-6

TEXT = re.compile(r'.{0,1000}', re.DOTALL)
LONGEST_LIST = 10000


class SceneError(ValueError):
    """A parameter is invalid; the text names it and says what is allowed."""

    def __init__(self, text: str):
        super().__init__(elided(text, MESSAGE))


@dataclass(frozen=True)
class Field:
    """
    Description and allowed values of a parameter.

    Attributes
    ----------
    kind : str
        One of KINDS.
    meaning : str
        Description, with the unit in brackets, as {unit}.
    low, high : float, optional
        Ends of the allowed range; None: no range.
    positive : bool
        Whether the value must be above zero.
    rule : str
        Further requirement, in words.
    pattern : re.Pattern
        Pattern that the whole of a text must match.
    readers : tuple of str
        Nodes that use the parameter.
    read_only : bool
        Whether a change needs a restart.
    unit : str
        Unit of its numbers; empty: none.
    group : str
        Kind of the parameter where there are many of one kind: one of GROUPS, or empty.

    """

    kind: str
    meaning: str
    low: Optional[float] = None
    high: Optional[float] = None
    positive: bool = False
    rule: str = ''
    pattern: re.Pattern = TEXT
    readers: Tuple[str, ...] = ()
    read_only: bool = False
    unit: str = ''
    group: str = ''

    def about(self, *words: str, **other: Any) -> Field:
        """Return a copy with `words` for {0}, {1}, ... in meaning and unit, `other` attributes."""
        unit = self.unit.format(*words)
        return _with(self, ('meaning', self.meaning.format(*words, unit=unit)), ('unit', unit),
                     *other.items())

    @property
    def owner(self) -> str:
        """Return the node that declares the parameter and announces its value to the others."""
        return OWNER if OWNER in self.readers else self.readers[0]

    @property
    def allowed(self) -> str:
        """Return the allowed values, in words."""
        words = [KINDS[self.kind][1]]
        if self.positive:
            words.append('above 0')
        if self.high is not None:
            words.append(f'from {self.low:g} to {self.high:g}')
        return ' '.join(words) + (self.rule and f', {self.rule}')

    def checked(self, name: str, value: Any) -> Any:
        """
        Return an allowed value, a list as a tuple; raise SceneError if it is not allowed.

        `name` is the parameter's. An integer becomes a float where the kind requires it.
        """
        several = self.kind.endswith('_array')
        # rclpy represents an empty list as None.
        value = () if several and value is None else plain(value)
        if isinstance(value, tuple) != several:
            raise self.error(name, value)
        items = [self._converted(one) for one in (value if several else [value])]
        if len(items) > LONGEST_LIST or not all(map(self._allows, items)):
            raise self.error(name, value)
        return tuple(items) if several else items[0]

    def error(self, name: str, value: Any) -> SceneError:
        """Return the error that parameter `name` must have an allowed value, not this one."""
        shown = list(value) if isinstance(value, tuple) else value
        return SceneError(f'{elided(name, 100)} must be {self.allowed}, not {quoted(shown)}')

    def _converted(self, value: Any) -> Any:
        try:
            return float(value) if type(value) is int and self._type is float else value
        except OverflowError:
            return value

    @property
    def _type(self) -> Type[Any]:
        return KINDS[self.kind][0]

    def _allows(self, value: Any) -> bool:
        if type(value) is not self._type:
            return False
        if isinstance(value, str):
            return bool(self.pattern.fullmatch(value))
        if isinstance(value, float) and not math.isfinite(value) or self.positive and value <= 0:
            return False
        if self.low is None or self.high is None:
            return True
        return self.low <= value <= self.high or any(
            math.isclose(value, end, rel_tol=ROUNDED) for end in (self.low, self.high))


@cached(2048)
def _with(field: Field, *other: Tuple[str, Any]) -> Field:
    """Return a cached copy with attributes replaced, which mechanisms of one type share."""
    return replace(field, **dict(other))


@dataclass(frozen=True)
class Parameter:
    """A parameter to declare: its full name, the Field that describes it, and its value."""

    name: str
    field: Field
    value: Any


class Values:
    """Values by full parameter name; `take` validates one and adds it to `parameters`."""

    def __init__(self, values: Mapping[str, Any]):
        self._unused = dict(values)
        self.parameters: List[Parameter] = []

    def unused(self, prefix: str = '') -> List[str]:
        """Return the sorted names that begin with `prefix` and have not been taken."""
        return sorted(name for name in self._unused if name.startswith(prefix))

    def take(self, name: str, field: Field, default: Any) -> Any:
        """Return a valid value, `default` if there is none; raise SceneError if it is invalid."""
        value = field.checked(name, self._unused.pop(name)) if name in self._unused else default
        self.parameters.append(Parameter(name, field, value))
        return value


def refuse_unknown(names: Iterable[str], known: List[str]) -> None:
    """Raise SceneError unless all names are parameters of the scene or of rclpy."""
    for name in names:
        known = [f'{name}.type', *known] if f'{name}.*' in known else known
        if not _ROS.match(name):
            raise SceneError(f'{elided(name)} is not a parameter of the scene; allowed: '
                             f'{listed(known, 120)}{meant(name, known)}')


def plain(value: Any) -> Any:
    """Return a value, with any kind of list as a tuple."""
    return tuple(value) if isinstance(value, (list, tuple, array)) else value
