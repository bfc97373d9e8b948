# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Parameters: what each may be, checked one by one, in words that name it. No ROS is needed."""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from dataclasses import dataclass, replace
import math
import re
from typing import Any, Iterable, List, Optional, Tuple, Type

from ..cache import cached
from ..words import elided, listed, meant, MESSAGE, quoted

# Which nodes act on a parameter, and whose value counts where several do.
DRIVER, KINEMATICS, INVERSE = ALL = 'crank_driver', 'kinematics', 'servo_inverse'
OWNER = KINEMATICS

# What the client library declares for itself.
_ROS = re.compile(r'(use_sim_time|start_type_description_service)$')

KINDS = {
    'bool': (bool, 'true or false'),
    'integer': (int, 'a whole number'),
    'double': (float, 'a finite number'),
    'string': (str, 'a text of up to 1000 letters'),
    'double_array': (float, 'a list of finite numbers'),
    'string_array': (str, 'a list of texts of up to 1000 letters'),
}

# How far, relatively, a value may be beyond an end of its range; the client library allows it.
ROUNDED = 1e-6

TEXT = re.compile(r'.{0,1000}', re.DOTALL)
LONGEST_LIST = 10000


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
        The ends of its range.
    positive : bool
        Whether it must be above zero.
    rule : str
        What else is asked of it.
    pattern : re.Pattern
        What a text must match.
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
    pattern: re.Pattern = TEXT
    readers: Tuple[str, ...] = ()
    read_only: bool = False

    def about(self, *words: str, **other: Any) -> Field:
        """Return the same with these words in its meaning, and what else is other."""
        return _with(self, ('meaning', self.meaning.format(*words)), *other.items())

    @property
    def shared(self) -> bool:
        """Whether more than one node acts on it."""
        return len(self.readers) > 1

    @property
    def allowed(self) -> str:
        """Return what it may be, in words."""
        words = [KINDS[self.kind][1]]
        if self.positive:
            words.append('above 0')
        if self.high is not None:
            words.append(f'from {self.low:g} to {self.high:g}')
        return ' '.join(words) + (self.rule and f', {self.rule}')

    def checked(self, name: str, value: Any) -> Any:
        """
        Return a value, a list as a tuple; raise SceneError if it cannot be.

        A whole number is taken for the number that it is; an empty list may be of any kind.
        """
        several = self.kind.endswith('_array')
        # The client library hands over an empty list as nothing at all.
        value = () if several and value is None else plain(value)
        if isinstance(value, tuple) != several:
            raise self.error(name, value)
        taken = [self._taken(one) for one in (value if several else [value])]
        if len(taken) > LONGEST_LIST or not all(map(self._holds, taken)):
            raise self.error(name, value)
        return tuple(taken) if several else taken[0]

    def error(self, name: str, value: Any) -> SceneError:
        """Return the error that says what the parameter must be, and what it is."""
        shown = list(value) if isinstance(value, tuple) else value
        return SceneError(f'{elided(name, 100)} must be {self.allowed}, not {quoted(shown)}')

    def _taken(self, value: Any) -> Any:
        try:
            return float(value) if type(value) is int and self._type is float else value
        except OverflowError:
            return value

    @property
    def _type(self) -> Type[Any]:
        return KINDS[self.kind][0]

    def _holds(self, value: Any) -> bool:
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
    """Return a field in which something is other; the same one for all mechanisms of a type."""
    return replace(field, **dict(other))


@dataclass(frozen=True)
class Parameter:
    """A parameter as a node declares it: its full name, what it is, and its value."""

    name: str
    field: Field
    value: Any


class Values:
    """The values that are given, by full parameter name, to be taken one by one."""

    def __init__(self, given: Mapping[str, Any]):
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


def refuse_unknown(names: Iterable[str], known: List[str]) -> None:
    """Raise SceneError for a name that neither is a parameter nor the client library's own."""
    for name in names:
        known = [f'{name}.type', *known] if f'{name}.*' in known else known
        if not _ROS.match(name):
            raise SceneError(f'{elided(name)} is not a parameter of the scene; allowed: '
                             f'{listed(known, 120)}{meant(name, known)}')


def plain(value: Any) -> Any:
    """Return a value, any kind of list as a tuple."""
    return tuple(value) if isinstance(value, (list, tuple, array)) else value
