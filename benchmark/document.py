# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Tables, what they were measured on, and their place in the pages."""

import argparse
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
import platform
import subprocess
import sys

ROOT = Path(__file__).parents[1]
DOCS = ROOT / 'docs'
END = '<!-- end of what is measured -->'
# What a measurement itself writes.
WRITTEN = ':!docs', ':!benchmark/results'


def parser(description):
    """Return a parser with --document, which has `show` write to docs/."""
    made = argparse.ArgumentParser(description=description.strip().split('\n\n')[0])
    made.add_argument('--document', action='store_true', help='write the tables to docs/')
    return made


def show(options, page, text, part='measured'):
    """Print a text and, if the options say so, write it."""
    print(text)
    if options.document:
        write(page, text, part)


def table(head, rows):
    """Return a table as Markdown, all columns but the first to the right."""
    lines = [head, ['---'] + ['---:'] * (len(head) - 1), *rows]
    return '\n'.join('| ' + ' | '.join(map(str, line)) + ' |' for line in lines)


def machine(*packages):
    """Return the date, the processor, the versions and the commit, as a sentence."""
    numbers = ', '.join(f'{name} {_version(name)}' for name in ('numpy', *packages))
    return (f'{datetime.now(timezone.utc):%Y-%m-%d}, {_processor()}; Python '
            f'{platform.python_version()}, {numbers}; commit {commit()}.')


def commit():
    """Return the commit of the sources, with `-dirty` where they differ from it."""
    names = _git('rev-parse', '--short', 'HEAD').strip() or 'unknown'
    return names + '-dirty' * bool(_git('status', '--porcelain', '-uno', '--', '.', *WRITTEN))


def write(page, text, part='measured'):
    """Replace what a page of docs/ says between the marks of a part, of a commit alone."""
    if commit().endswith('-dirty'):
        sys.exit('Nothing is written: commit first, so that the page can name what was measured.')
    before, begin, rest = _split(page, part)
    if not begin:
        sys.exit(f'docs/{page} has no part {part!r}.')
    after = rest.partition(END)[2]
    (DOCS / page).write_text(f'{before}{begin}\n\n{text.rstrip()}\n\n{END}{after}')


def written(page, part='measured'):
    """Return what a page of docs/ says between the marks of a part."""
    return _split(page, part)[2].partition(END)[0].strip()


def _split(page, part):
    return (DOCS / page).read_text().partition(f'<!-- {part} -->')


def _git(*command):
    return subprocess.run(['git', *command], capture_output=True, text=True, cwd=ROOT).stdout


def _processor():
    try:
        with open('/proc/cpuinfo') as lines:
            fields = {name.strip(): value.strip() for name, _, value in (
                line.partition(':') for line in lines)}
        return f'{fields["model name"]}, family {fields["cpu family"]} model {fields["model"]}'
    except (OSError, KeyError):
        return platform.processor() or platform.machine()


def _version(package):
    try:
        return version(package)
    except PackageNotFoundError:
        return 'missing'
