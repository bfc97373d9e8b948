# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Read ROS parameter files without ROS. Needs PyYAML.

The types of values, the matching of node names and the precedence of sections are those of
rcl_yaml_param_parser (https://github.com/ros2/rcl). What it reads in a surprising way is refused.
"""

from __future__ import annotations

from functools import reduce
import math
import re
import sys
from typing import Any, Dict, Iterator, Optional, Sequence, Tuple

from .parameters import SceneError
from ..cache import cached
from ..optional import needs
from ..words import elided, quoted

KEY = 'ros__parameters'
TEXT = 'tag:yaml.org,2002:str'
BOOL, INTEGER, DOUBLE, UNCLEAR = '!bool', '!integer', '!double', '!unclear'
# What unquoted text is; any other is a string. ROS reads what is unclear as a number, too.
TYPES = {
    BOOL: r'(y|Y|yes|Yes|YES|on|On|ON|true|True|TRUE'
          r'|n|N|no|No|NO|off|Off|OFF|false|False|FALSE)\Z',
    INTEGER: r'[+-]?(0|[1-9][0-9]*|0[xX][0-9a-fA-F]+)\Z',
    DOUBLE: r'([+-]?(?!0[0-9]+\Z)([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?'
            r'|[+-]?\.(inf|Inf|INF)|\.(nan|NaN|NAN))\Z',
    UNCLEAR: r'(?ai:[+-]?(0[0-9]+|inf(inity)?|nan(\(\w*\))?'
             r'|0x([0-9a-f]+\.?[0-9a-f]*|\.[0-9a-f]+)(p[+-]?[0-9]+)?))\Z'}
_TOKEN = re.compile(r'\*\*?|[A-Za-z_]\w*', re.ASCII)

# The values in a file, by the names of the nodes of each section.
Sections = Dict[str, Dict[str, Any]]


def sections(path: str) -> Sections:
    """Return the sections of a parameter file; raise SceneError, with the line, if it is none."""
    with needs('yaml'):
        import yaml

        loader = _loader(yaml)
    found: Sections = {}
    try:
        with open(path, 'rb') as file:
            text = file.read()
        for event in yaml.parse(text, Loader=loader):
            if isinstance(event, yaml.AliasEvent):
                raise ValueError(f'ROS does not support aliases{_line(event)}')
        root = yaml.compose(text, Loader=loader)
        if root is not None and root.value:
            _add_sections(found, root, ())
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        mark = getattr(error, 'problem_mark', None)
        problem = f'{getattr(error, "problem", "")}, line {mark.line + 1}' if mark else str(error)
        reason = elided(problem, 300)
        raise SceneError(f'{path} is not a valid ROS parameter file: {reason}') from None
    return found


def overrides(found: Sections, node: str) -> Optional[Dict[str, Any]]:
    """
    Return the values for a node, by parameter name; later sections override earlier ones.

    `node` is its full name, such as '/kinematics'. None means that no section matches it.
    """
    matching = [values for name, values in found.items() if _pattern(name).fullmatch(node)]
    return {name: value for values in matching
            for name, value in values.items()} if matching else None


def is_text(text: str) -> bool:
    """Return whether unquoted text is a string."""
    return not any(re.match(pattern, text) for pattern in TYPES.values())


@cached(1)
def _loader(yaml: Any) -> Any:
    """Return a parser of YAML that marks each value with its type for ROS."""
    class Loader(getattr(yaml, 'CBaseLoader', yaml.BaseLoader)):  # type: ignore[misc]
        pass

    for tag, pattern in TYPES.items():
        Loader.add_implicit_resolver(tag, re.compile(pattern), None)
    return Loader


def _add_sections(found: Sections, node: Any, names: Tuple[str, ...]) -> None:
    """Add the sections below the names of namespaces and nodes."""
    for key, value in _items(node, f'{KEY} below the name of a node, such as /**, is expected'):
        if key == KEY:
            _add_values(found.setdefault(_checked(names), {}), value, '')
        else:
            _add_sections(found, value, (*names, key))


def _add_values(values: Dict[str, Any], node: Any, prefix: str) -> None:
    for key, value in _items(node, 'names with values are expected'):
        name, is_mapping = prefix + key, value.id == 'mapping'
        if is_mapping and prefix and '.' in key:
            raise ValueError(f'ROS loses track of names below {quoted(key)}, which has a point'
                             f'{_line(value)}')
        if is_mapping and name not in values:
            _add_values(values, value, f'{name}.')
            continue
        new = None if is_mapping else _value(value)
        if is_mapping or name in values and _kind(values[name]) != _kind(new):
            raise ValueError(f'{quoted(name)} is given twice, with different types{_line(value)}')
        values[name] = new


def _items(node: Any, reason: str) -> Iterator[Tuple[str, Any]]:
    """Yield the entries of a mapping; raise ValueError with a reason if it has none."""
    if node.id != 'mapping' or not node.value:
        raise ValueError(f'{reason}{_line(node)}')
    for key, value in node.value:
        if key.id != 'scalar' or not key.value:
            raise ValueError(f'a name is expected{_line(key)}')
        yield key.value, value


def _kind(value: Any) -> Any:
    return (list, type(value[0])) if isinstance(value, list) else type(value)


def _value(node: Any) -> Any:
    """Return the value of a node; None for an empty list, which has no type for ROS."""
    if node.id == 'scalar':
        return _scalar(node)
    values = [_scalar(child) for child in node.value]
    if len(set(map(type, values))) > 1:
        raise ValueError(f'a list must have values of one type{_line(node)}')
    return values or None


def _scalar(node: Any) -> Any:
    text, low = node.value, str(node.value).lower()
    if node.id != 'scalar':
        raise ValueError(f'a list must have no lists or names in it{_line(node)}')
    if node.style in ('"', "'"):
        return text
    if not text:
        raise ValueError(f'a value is missing{_line(node)}')
    if node.tag == BOOL:
        return low in ('y', 'yes', 'on', 'true')
    if node.tag == INTEGER:
        number = int(text, 16 if 'x' in low else 10)
        if -sys.maxsize - 1 <= number <= sys.maxsize:
            return number
    elif node.tag == DOUBLE:
        real = float(low.replace('.inf', 'inf').replace('.nan', 'nan'))
        is_tiny = abs(real) < sys.float_info.min and re.search('[1-9]', low.partition('e')[0])
        if math.isinf(real) == ('inf' in low) and not is_tiny:
            return real
    elif node.tag == TEXT and (node.style not in ('|', '>') or is_text(text.strip())):
        return text
    raise ValueError(f'{quoted(text)} is unclear or out of range{_line(node)}: write a decimal '
                     'number, .inf, .nan, or text in quotes')


def _line(node: Any) -> str:
    return f' in line {node.start_mark.line + 1}'


def _checked(names: Sequence[str]) -> str:
    """Return the name of a section; raise ValueError if nodes cannot have it."""
    name = reduce(lambda space, own: f'{space.removesuffix("/")}/{own}', names) if names else ''
    if not all(map(_TOKEN.fullmatch, name.removeprefix('/').split('/'))):
        raise ValueError(f'{KEY} must be below the name of a node, such as /**, not '
                         f'{quoted(name)}')
    return name


def _pattern(name: str) -> 're.Pattern[str]':
    """Return the pattern that matches the full names of a section's nodes."""
    parts = name.removeprefix('/').split('/')
    return re.compile(''.join(r'(/\w+)*' if part == '**' else '/' + part.replace('*', r'\w+')
                              for part in parts))
