# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Read ROS parameter files without ROS. Needs PyYAML.

The types of values, the matching of node names and the precedence of sections are those of
rcl_yaml_param_parser (https://github.com/ros2/rcl). What it reads in a surprising way is refused.
"""

from __future__ import annotations

import re
from typing import Any, Iterator, Sequence

from .parameters import SceneError
from ..optional import needs
from ..words import short_repr

KEY = 'ros__parameters'
_TOKEN = re.compile(r'\*\*?|[A-Za-z_]\w*', re.ASCII)

# The values in a file, by the names of the nodes of each section.
Sections = dict[str, dict[str, Any]]


# Patterns of unquoted text, and how ROS reads it; any other is a string. What is unclear ROS reads
# as a number, too.
_READERS = [(re.compile(pattern), reader) for pattern, reader in (
    (r'y|Y|yes|Yes|YES|on|On|ON|true|True|TRUE|n|N|no|No|NO|off|Off|OFF|false|False|FALSE',
     lambda text: text.lower() in ('y', 'yes', 'on', 'true')),
    (r'[+-]?(0|[1-9][0-9]*|0[xX][0-9a-fA-F]+)', lambda text: int(text, 0)),
    (r'[+-]?(?!0[0-9]+\Z)([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?'
     r'|[+-]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)',
     lambda text: float(re.sub(r'\.(?=[IiNn])', '', text))),
    (r'(?ai:[+-]?(0[0-9]+|inf(inity)?|nan(\(\w*\))?'
     r'|0x([0-9a-f]+\.?[0-9a-f]*|\.[0-9a-f]+)(p[+-]?[0-9]+)?))', lambda _: None))]


def sections(path: str) -> Sections:
    """Return the sections of a parameter file; raise SceneError, with the line, if it is none."""
    with needs('yaml'):
        import yaml

        loader = getattr(yaml, 'CBaseLoader', yaml.BaseLoader)
    try:
        with open(path, 'rb') as file:
            text = file.read()
        for event in yaml.parse(text, Loader=loader):
            if isinstance(event, yaml.AliasEvent) or getattr(event, 'tag', None):
                raise ValueError(f'ROS does not support aliases and tags{_line(event)}')
        root = yaml.compose(text, Loader=loader)
        return _distinct(_sections(root, ())) if root is not None and root.value else {}
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        reason = ' '.join(str(error).split())
        raise SceneError(f'{path} is not a valid ROS parameter file: {reason}') from None


def overrides(sections_: Sections, node: str) -> dict[str, Any]:
    """
    Return the values for a node, by parameter name; later sections override earlier ones.

    `node` is its full name, such as '/kinematics'.
    """
    return {name: value for section, values in sections_.items()
            if _pattern(section).fullmatch(node) for name, value in values.items()}


def is_text(text: str) -> bool:
    """Return whether unquoted text is a string."""
    return not any(pattern.fullmatch(text) for pattern, _ in _READERS)


def _distinct(entries: Iterator[tuple[str, Any, Any]]) -> dict[str, Any]:
    """Return values by name, from names, nodes and values; ValueError if a name is repeated."""
    values: dict[str, Any] = {}
    for name, node, value in entries:
        if name in values:
            raise ValueError(f'{short_repr(name)} is given twice{_line(node)}')
        values[name] = value
    return values


def _sections(node: Any, names: tuple[str, ...]) -> Iterator[tuple[str, Any, Any]]:
    """Yield the sections below the names of namespaces and nodes."""
    for key, value in _items(node, f'{KEY} below the name of a node, such as /**, is expected'):
        if key == KEY:
            yield _checked(names), value, _distinct(_values(value, ''))
        else:
            yield from _sections(value, (*names, key))


def _values(node: Any, prefix: str) -> Iterator[tuple[str, Any, Any]]:
    """Yield the values below the prefix of their names."""
    for key, value in _items(node, 'names with values are expected'):
        if value.id != 'mapping':
            yield prefix + key, value, _value(value)
            continue
        if prefix and '.' in key:
            raise ValueError(f'ROS loses track of names below {short_repr(key)}, which has a point'
                             f'{_line(value)}')
        yield from _values(value, f'{prefix}{key}.')


def _items(node: Any, reason: str) -> Iterator[tuple[str, Any]]:
    """Yield the entries of a mapping; raise ValueError with a reason if it has none."""
    if node.id != 'mapping' or not node.value:
        raise ValueError(f'{reason}{_line(node)}')
    for key, value in node.value:
        if key.id != 'scalar' or not key.value:
            raise ValueError(f'a name is expected{_line(key)}')
        yield key.value, value


def _value(node: Any) -> Any:
    """Return the value of a node; None for an empty list, which has no type for ROS."""
    if node.id == 'scalar':
        return _scalar(node)
    values = [_scalar(child) for child in node.value]
    if len(set(map(type, values))) > 1:
        raise ValueError(f'a list must have values of one type{_line(node)}')
    return values or None


def _scalar(node: Any) -> Any:
    text = node.value
    if node.id != 'scalar':
        raise ValueError(f'a list must have no lists or names in it{_line(node)}')
    if node.style in ('"', "'"):
        return text
    if not text:
        raise ValueError(f'a value is missing{_line(node)}')
    reader = next((reader for pattern, reader in _READERS if pattern.fullmatch(text)), str)
    value = None if node.style else reader(text)
    if value is None:
        raise ValueError(f'{short_repr(text)} is unclear or out of range{_line(node)}: write a '
                         'decimal number, .inf, .nan, or text in quotes')
    return value


def _line(node: Any) -> str:
    return f' in line {node.start_mark.line + 1}'


def _checked(names: Sequence[str]) -> str:
    """Return the name of a section; raise ValueError if nodes cannot have it."""
    name = '/'.join([*(space.removesuffix('/') for space in names[:-1]), *names[-1:]])
    if not all(map(_TOKEN.fullmatch, name.removeprefix('/').split('/'))):
        raise ValueError(f'{KEY} must be below the name of a node, such as /**, not '
                         f'{short_repr(name)}')
    return name


def _pattern(name: str) -> 're.Pattern[str]':
    """Return the pattern that matches the full names of a section's nodes."""
    parts = name.removeprefix('/').split('/')
    return re.compile(''.join(r'(/\w+)*' if part == '**' else '/' + part.replace('*', r'\w+')
                              for part in parts))
