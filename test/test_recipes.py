# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The recipes of docs/design/architecture.md, followed to the letter in a copy of it all."""

from pathlib import Path
import re
import shlex
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[1]
PAGE = ROOT / 'docs' / 'design' / 'architecture.md'


def steps(title):
    """Return the numbered steps of a recipe, each with the code under it."""
    recipe = PAGE.read_text().partition(f'### {title}\n')[2].partition('\n##')[0]
    found = []
    for step in re.split(r'^\d+\. ', recipe, flags=re.MULTILINE)[1:]:
        text, _, rest = step.partition('```')
        indent = len(text) - len(text.rstrip(' '))
        language, _, code = rest.partition('```')[0].partition('\n')
        lines = [line[indent:] for line in code.rstrip(' ').splitlines()]
        found.append((' '.join(text.split()), language, '\n'.join(lines) + '\n'))
    return found


def follow(folder, text, language, code):
    """Do a step: run its commands, or put its code into its file."""
    if language == 'console':
        for command in code.splitlines():
            run(folder, shlex.split(command.removeprefix('$ ')))
        return
    file, lines, at = place(folder, text)
    space = '\n\n' if code.startswith('def ') else '\n' if 'def ' in code else ''
    lines.insert(at, f'\n\n{code}' if lines and at == len(lines) else code + space)
    file.write_text(''.join(lines))


def place(folder, text):
    """Return the file of a step, its lines, and before which of them the code belongs."""
    file = folder / re.match('`(.*?)`', text)[1]
    lines = file.read_text().splitlines(keepends=True) if file.exists() else []
    where = re.search('(before|after) `(.*?)`', text, re.IGNORECASE)
    if not where:
        assert not lines or 'at the end' in text, f'{text}: where in it does the code belong?'
        return file, lines, len(lines)
    at, = [i for i, line in enumerate(lines) if where[2] in line]
    return file, lines, at + (where[1].lower() == 'after')


def run(folder, command):
    """Run a command line with this Python, which must end well."""
    assert command[0] == 'python'
    ended = subprocess.run([sys.executable, *command[1:]], cwd=folder, text=True, timeout=300,
                           stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert ended.returncode == 0, f'{" ".join(command)}\n{ended.stdout[-5000:]}'
    return ended.stdout


@pytest.mark.nightly
@pytest.mark.parametrize('title', ['A mechanism', 'A construction'])
def test_a_recipe_can_be_followed_to_the_letter(copy, title):
    for step in steps(title):
        follow(copy, *step)
