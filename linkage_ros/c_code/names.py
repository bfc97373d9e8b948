# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Names of a scene, with any characters, as C identifiers, comments and texts."""

from importlib.resources import files
from itertools import chain, count
import json
import re
from typing import Iterable, Mapping

from ..linkage import Mechanism

_PLACE = re.compile(r'@(\w+)@')


def template(name: str) -> str:
    """Return a template of this room."""
    return files(__package__).joinpath('templates', name).read_text()


def filled(template: str, values: Mapping[str, object]) -> str:
    """Return a template with @name@ replaced by values; lines that become empty are dropped."""
    lines = []
    for line in template.splitlines():
        text = _PLACE.sub(lambda place: str(values[place[1]]), line)
        if text.strip() or not line.strip():
            lines.append(text)
    return '\n'.join(lines) + '\n'


def distinct(names: Iterable[str]) -> list[str]:
    """Return names, with a number after those that are there already."""
    made: dict[str, None] = {}
    for name in names:
        texts = chain([name], (f'{name}_{i}' for i in count(2)))
        made[next(text for text in texts if text not in made)] = None
    return [*made]


def field(linkage: Mechanism, output: str) -> str:
    """Return the name of an output in C."""
    plain = re.sub(r'\W+', '_', output).strip('_')
    if '.' in output or '(' in output:
        return plain
    return ('angle_' if linkage.is_angle(output) else 'slide_') + plain


def comment(text: str) -> str:
    """Return a text without anything that would end a comment or a line."""
    return re.sub(r'[^ -~]', '?', text).replace('*/', '* /').replace('/*', '/ *').replace(
        '\\', '/').replace('??', '? ?')


def literal(text: str) -> str:
    """Return a text as a string literal of C++: JSON's, without trigraphs."""
    valid = text.encode('utf-8', 'replace').decode()
    return json.dumps(valid, ensure_ascii=False).replace('?', r'\?')
