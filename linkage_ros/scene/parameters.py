# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Description and validation of parameters. Errors name the parameter. No ROS is needed."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, replace
import math
import re
import sys
from typing import Any, Callable, Collection, Iterable, Mapping, NamedTuple, Sequence

import numpy as np

from ..cache import cached
from ..words import brief, did_you_mean, join_names, plain_text, short_repr, suggestion, truncated

# The nodes that use parameters; KINEMATICS owns each that it uses.
DRIVER, INVERSE, KINEMATICS = ALL = 'crank_driver', 'servo_inverse', 'kinematics'

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
RANGE_TOLERANCE = 1e-6

TEXT = re.compile(r'.{0,1000}', re.DOTALL)
MAX_ITEMS = 10000


class SceneError(ValueError):
    """A parameter is invalid; the text names it and says what is allowed."""

    def __init__(self, text: str):
        super().__init__(brief(text))


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
    ends : (float, float), optional
        Ends of the allowed range; None: no range.
    default : object
        Value if none is given, unless that depends on other parameters.
    positive : bool
        Whether the value must be above zero.
    rule : str
        Further requirement, in words.
    holds : callable, optional
        Whether a value fulfils the rule.
    choices : tuple of str
        The only allowed texts; empty: any.
    pattern : re.Pattern
        Pattern that the whole of a text must match.
    readers : tuple of str
        Nodes that use the parameter.
    read_only : bool
        Whether a change needs a restart.
    unit : str
        Unit of its numbers; empty: none.
    group : str
        Kind of the parameter where there are many of one kind: 'dimensions', 'branches', 'speeds',
        'starts', or empty.

    """

    kind: str
    meaning: str
    ends: tuple[float, float] | None = None
    default: Any = None
    positive: bool = False
    rule: str = ''
    holds: Callable[[Any], bool] | None = None
    choices: tuple[str, ...] = ()
    pattern: re.Pattern = TEXT
    readers: tuple[str, ...] = ALL
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
        return KINEMATICS if KINEMATICS in self.readers else self.readers[0]

    @property
    def allowed(self) -> str:
        """Return the allowed values, in words."""
        words = [KINDS[self.kind][1]]
        if self.positive:
            words.append('above 0')
        if self.ends:
            words.append('from {:g} to {:g}'.format(*self.ends))
        if self.unit:
            words.append(f'[{self.unit}]')
        return ' '.join(words) + (self.rule and f', {self.rule}')

    def checked(self, name: str, value: Any) -> Any:
        """
        Return an allowed value, a list as a tuple; raise SceneError if it is not allowed.

        `name` is the parameter's. An integer becomes a float where the kind requires it.
        """
        is_list = self.kind.endswith('_array')
        # rclpy represents an empty list as None.
        value = () if is_list and value is None else plain(value)
        if isinstance(value, tuple) == is_list:
            items = tuple(map(self._converted, value if is_list else (value,)))
            result = items if is_list else items[0]
            if len(items) <= MAX_ITEMS and all(map(self._allows, items)) and (
                    self.holds is None or self.holds(result)):
                return result
        shown = list(value) if isinstance(value, tuple) else value
        raise SceneError(f'{truncated(name, 100)} must be {self.allowed}, not {short_repr(shown)}'
                         f'{did_you_mean(value, self.choices)}')

    def _converted(self, value: Any) -> Any:
        is_whole = type(value) is int and KINDS[self.kind][0] is float
        return float(value) if is_whole and abs(value) <= sys.float_info.max else value

    def _allows(self, value: Any) -> bool:
        type_: type[Any] = KINDS[self.kind][0]
        if type(value) is not type_:
            return False
        if isinstance(value, str):
            return bool(self.pattern.fullmatch(value)) and (
                not self.choices or value in self.choices)
        if isinstance(value, float) and not math.isfinite(value) or self.positive and value <= 0:
            return False
        low, high = self.ends or (value, value)
        return low <= value <= high or isinstance(value, float) and any(
            math.isclose(value, end, rel_tol=RANGE_TOLERANCE) for end in (low, high))


@cached(2048)
def _with(field: Field, *other: tuple[str, Any]) -> Field:
    """Return a cached copy with attributes replaced, which mechanisms of one type share."""
    return replace(field, **dict(other))


class Parameter(NamedTuple):
    """A parameter to declare: full name, Field, value, and the value if none were given."""

    name: str
    field: Field
    value: Any
    default: Any = None


class Values:
    """
    Values by full parameter name; `take` validates one and adds it to `parameters`.

    A parameter's full name is `prefix` and its key. A parameter without a value keeps that of the
    `known` one.
    """

    def __init__(self, values: Mapping[str, Any], prefix: str = '',
                 known: Iterable[Parameter] = ()):
        self._unused, self._prefix = dict(values), prefix
        self._known = {parameter.name: parameter for parameter in known}
        self.parameters: list[Parameter] = []

    def keys(self, prefix: str) -> list[str]:
        """Return what follows a prefix in the sorted keys of values and known parameters."""
        start = self._prefix + prefix
        return sorted(name[len(start):] for name in {*self._unused, *self._known}
                      if name.startswith(start))

    def take(self, key: str, field: Field, default: Any = None) -> Any:
        """Return a valid value, `default` if there is none; raise SceneError if it is invalid."""
        name, default = self._prefix + key, field.default if default is None else default
        known = self._known.get(name)
        value = self._unused.pop(name, known.value if known else default)
        if not known or known.value is not value or known.field is not field:
            value = field.checked(name, value)
        self.parameters.append(Parameter(name, field, value, default))
        return value

    def refuse_unknown(self, known: Sequence[str] = ()) -> None:
        """Raise SceneError if a value is left that is no parameter of the scene or of rclpy."""
        known = known or [parameter.name for parameter in self.parameters]
        for name in sorted(self._unused):
            if not _ROS.match(name):
                names = [f'{name}.type'] * (f'{name}.*' in known) + [*known]
                raise SceneError(f'{truncated(name)} is not a parameter of the scene'
                                 f'{suggestion(name, names, 120)}')


def read_lines(name: str, lines: Iterable[str], pattern: re.Pattern, names: Collection[str],
               examples: str) -> dict[str, re.Match]:
    """
    Return the matches of lines KEY=... of a parameter, by key: one of `names`, each once.

    SceneError quotes `examples` of lines for a line that is none.
    """
    matches: dict[str, re.Match] = {}
    for line in lines:
        match = pattern.fullmatch(line)
        if not match or match[1] not in names or match[1] in matches:
            raise SceneError(
                f'{name} must be texts such as {examples}, each for a different one of '
                f'{join_names(names, 90)}, not {truncated(line)!r}'
                f'{did_you_mean(match and match[1], {*names} - {*matches})}')
        matches[match[1]] = match
    return matches


def plain(value: Any) -> Any:
    """Return a value of numpy or a text of any class as a plain one, any list as a tuple."""
    value = value.tolist() if isinstance(value, (np.ndarray, np.generic)) else plain_text(value)
    return value if not isinstance(value, (list, tuple, array)) else tuple([
        x.tolist() if isinstance(x, np.generic) else plain_text(x) for x in value])
