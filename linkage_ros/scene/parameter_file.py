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
Read ROS parameter files without ROS. Needs PyYAML.

Syntax of numbers, matching of node names, precedence of sections and error messages are those of
rcl_yaml_param_parser (https://github.com/ros2/rcl).
"""

from __future__ import annotations

from fractions import Fraction
from functools import reduce
import re
import sys
from typing import Any, Dict, Iterable, List, Optional, Tuple

from .parameters import SceneError
from ..optional import needs
from ..words import quoted

KEY = 'ros__parameters'
# Kinds of values. If a parameter is given values of several kinds, the first of these wins.
KINDS = {bool: 'bool', int: 'integer', float: 'double', str: 'string'}
TRUE = {'Y', 'y', *(word for low in ('yes', 'true', 'on')
                    for word in (low, low.title(), low.upper()))}
FALSE = {'N', 'n', *(word for low in ('no', 'false', 'off')
                     for word in (low, low.title(), low.upper()))}
TEXT = 'tag:yaml.org,2002:str'
_WHOLE = re.compile(r'\s*[+-]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)', re.ASCII)
_DECIMAL = re.compile(r'\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?', re.ASCII)
_HEXADECIMAL = re.compile(r'\s*[+-]?0[xX]([\da-f]+\.?[\da-f]*|\.[\da-f]+)([pP][+-]?\d+)?',
                          re.ASCII | re.IGNORECASE)
_SPECIAL = re.compile(r'\s*[+-]?(inf(inity)?|nan(\(\w*\))?)', re.ASCII | re.IGNORECASE)
_DOTTED = re.compile(r'[+-]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)')
_TOKEN = re.compile(r'\*\*?|[A-Za-z_]\w*', re.ASCII)


def overrides(path: str, node: str) -> Optional[Dict[str, Any]]:
    """
    Return the parameter values in a file for a node, by parameter name.

    `node` is its full name, such as '/kinematics'. None means that no section matches it. Raises
    SceneError with the reason of rcl if rcl would refuse the file.
    """
    with needs('yaml'):
        import yaml

        loader = getattr(yaml, 'CLoader', yaml.Loader)
    reader = _Reader()
    try:
        with open(path, 'rb') as file:
            reader.read(yaml.parse(file, Loader=loader))
    except (yaml.YAMLError, UnicodeError, RecursionError):
        reason = f'Error parsing a event near line {reader.line}'
    except ValueError as error:
        reason = str(error)
    else:
        return reader.values_of(node)
    raise SceneError(f'{path} is not a valid ROS parameter file: {reason}')


class _Reader:
    """State of the parser: the parameters so far, and where it is in the nested names."""

    def __init__(self) -> None:
        # Parameters by section: the name of each, and its values by kind.
        self.nodes: Dict[str, List[Tuple[str, Dict[Any, Any]]]] = {}
        self.line = 0
        self._at_key, self._in_list = True, False
        self._list_kind: Optional[type] = None
        self._in_parameters, self._depth, self._is_new = False, 0, False
        self._node_names: List[str] = []
        self._space, self._spaces = '', 0
        self._own: List[Tuple[str, Dict[Any, Any]]] = []
        self._place = 0

    def values_of(self, node: str) -> Optional[Dict[str, Any]]:
        """Return the values in all sections that match a node, of which later ones win."""
        found = [own for name, own in self.nodes.items() if _pattern(name).fullmatch(node)]
        if not found:
            return None
        return {name: next((values[kind] for kind in (*KINDS, *map(_list_of, KINDS))
                            if kind in values), None)
                for own in found for name, values in own}

    def read(self, events: Iterable[Any]) -> None:
        """Process all YAML events; raise ValueError where rcl would refuse one."""
        for event in events:
            self.line = event.start_mark.line + 1
            handler = getattr(self, f'_{type(event).__name__[:-5]}', None)
            if handler:
                handler(event)

    def _Scalar(self, event: Any) -> None:
        if self._at_key:
            self._key(event.value)
            self._at_key = False
            return
        if not self._in_parameters or not self._own:
            raise ValueError(f'Cannot have a value before {KEY} at line {self.line}')
        self._value(_read(event, self.line))
        self._at_key = not self._in_list

    def _Alias(self, event: Any) -> None:
        raise ValueError(f'Will not support aliasing at line {self.line}')

    def _SequenceStart(self, event: Any) -> None:
        if self._at_key:
            raise ValueError(f'Sequences cannot be key at line {self.line}')
        if not self._in_parameters:
            raise ValueError('Sequences can only be values and not keys in params. '
                             f'Error at line {self.line}')
        self._in_list, self._list_kind = True, None

    def _SequenceEnd(self, event: Any) -> None:
        self._in_list, self._at_key = False, True

    def _MappingStart(self, event: Any) -> None:
        self._depth += 1
        self._at_key = True
        self._is_new = not self._in_parameters or self._depth - len(self._node_names) != 2

    def _MappingEnd(self, event: Any) -> None:
        if self._in_parameters:
            if self._spaces:
                self._spaces -= 1
                self._space = self._space.rpartition('.')[0] if self._spaces else ''
            else:
                self._in_parameters = False
        elif self._depth == len(self._node_names) + 1 and self._node_names:
            self._node_names.pop()
        self._depth -= 1

    def _key(self, key: str) -> None:
        if not key:
            raise ValueError(f'No key at line {self.line}')
        if self._in_parameters:
            self._parameter(key)
        elif not key.startswith(KEY):
            self._node_names.append(key)
        else:
            if not self._node_names:
                raise ValueError(f'There are no node names before {KEY} at line {self.line}')
            name = _checked(reduce(lambda space, own: f'{space.removesuffix("/")}/{own}',
                                   self._node_names))
            self._own = self.nodes.setdefault(name, [])
            self._in_parameters = True

    def _parameter(self, key: str) -> None:
        """Begin a parameter; one whose value is a mapping becomes the first in this mapping."""
        if self._is_new:
            self._space, self._is_new = self._own[self._place][0], False
            self._spaces += 1
        name = self._space or key
        self._place = next((i for i, (other, _) in enumerate(self._own) if other == name),
                           len(self._own))
        if self._place == len(self._own):
            self._own.append((name, {}))
        if self._space:
            self._own[self._place] = f'{name}.{key}', self._own[self._place][1]

    def _value(self, value: Any) -> None:
        values, kind = self._own[self._place][1], type(value)
        if not self._in_list:
            values[kind] = value
        elif self._list_kind is None:
            self._list_kind, values[_list_of(kind)] = kind, [value]
        elif self._list_kind is kind:
            values[_list_of(kind)].append(value)
        else:
            raise ValueError(f"Sequence should be of same type. Value type '{KINDS[kind]}' do "
                             f'not belong at line_num {self.line}')


def _list_of(kind: type) -> str:
    return f'list of {kind.__name__}'


def _read(event: Any, line: int) -> Any:
    """Return the value of a YAML scalar event; raise ValueError if it is empty."""
    text = event.value
    is_quoted = event.style in ('"', "'")
    if not text and not is_quoted:
        raise ValueError(f'No value at line {line}')
    return text if is_quoted or event.tag == TEXT else plain(text)


def plain(text: str) -> Any:
    """Return the value that rcl reads from unquoted text: bool, int, float or str."""
    if text in TRUE or text in FALSE:
        return text in TRUE
    if _WHOLE.fullmatch(text):
        base = 16 if 'x' in text.lower() else 8 if text.strip().lstrip('+-')[0] == '0' else 10
        number = int(text, base) if len(text) < 100 else sys.maxsize + 1
        if -sys.maxsize - 1 <= number <= sys.maxsize:
            return number
    found = _number(text)
    return text if found is None else found


def _number(text: str) -> Optional[float]:
    """Parse a number as C's strtod does; return None if it is invalid or out of range."""
    if _DOTTED.fullmatch(text):
        return float(text.replace('.', ''))
    if _SPECIAL.fullmatch(text):
        return float(text.partition('(')[0])
    if _HEXADECIMAL.fullmatch(text):
        try:
            return float.fromhex(text)
        except OverflowError:
            return None
    if not _DECIMAL.fullmatch(text):
        return None
    number, digits = float(text), text.lower().partition('e')[0]
    if abs(number) >= sys.float_info.min:
        return number if abs(number) <= sys.float_info.max else None
    is_zero = not digits.strip(' +-0.')
    return number if is_zero or number and Fraction(text) == Fraction(number) else None


def _checked(name: str) -> str:
    """Return a section's name; raise ValueError if it is not a valid node name."""
    if not all(map(_TOKEN.fullmatch, name.removeprefix('/').split('/'))):
        raise ValueError("node name must not contain characters other than alphanumerics or '_', "
                         f'got {quoted(name)}')
    return name


def _pattern(name: str) -> 're.Pattern[str]':
    """Return the pattern that matches the full names of a section's nodes."""
    parts = name.removeprefix('/').split('/')
    return re.compile(''.join(r'(/\w+)*' if part == '**' else '/' + part.replace('*', r'\w+')
                              for part in parts))
