# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What `kinematics` costs beside a floor and a relay, and how long changes hold it up.

    python -m benchmark.nodes --missing     what is not measured of these sources yet, in minutes
    python -m benchmark.nodes --quick       a look at all, in a few minutes
    python -m benchmark.nodes changes       this piece alone, in full or --quick
    python -m benchmark.nodes --tables      the tables of the last results

Pieces are the scenes and `changes`; --plain measures them where llvmlite cannot be imported.
`--missing` stops before ten minutes are over and ends with 3 while something is left: call it
again. Results go to benchmark/results/nodes.json, those of a look to benchmark/.cache/; the tables
are printed, and written into docs/design/performance.md by --document.
"""

import json
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time

from domains import Domain

from . import report
from .. import document

HERE = Path(__file__).parents[1]
# About how long a piece takes [minutes], and what is measured without llvmlite, too.
PIECES = {'one leg': 2.0, '12 legs': 3.0, 'four mechanisms': 1.5, 'sixty mechanisms': 2.0,
          'changes': 3.0}
PLAIN = '12 legs', 'changes'
# One call of `--missing` takes no longer than this [minutes], if no piece does.
LONGEST, LEFT = 9.8, 3
ROUNDS, QUICK_ROUNDS = 7, 2
# What a Python imports at its start, so that it finds no llvmlite.
WITHOUT = "import sys\nsys.modules['llvmlite'] = None\n"


def main():
    """Run, write and print; return the exit code."""
    options = arguments()
    result = json.loads(options.output.read_text()) if options.output.exists() else {}
    options.output.parent.mkdir(parents=True, exist_ok=True)
    is_left = False if options.tables else run(options, result)
    tables = report.document(result)
    document.show(options, 'design/performance.md', tables)
    return LEFT if is_left else 0


def arguments():
    """Return what the command line asks for."""
    parser = document.parser(__doc__)
    parser.add_argument('pieces', nargs='*', metavar='PIECE', help=', '.join(PIECES))
    mode = parser.add_mutually_exclusive_group()
    mode.add_argument('--missing', action='store_true', help='what is not measured yet')
    mode.add_argument('--quick', action='store_true', help='one rate and fewer rounds')
    mode.add_argument('--tables', action='store_true', help='run nothing, show the last results')
    parser.add_argument('--plain', action='store_true', help='without llvmlite')
    parser.add_argument('--rounds', type=int, help='bursts of each subject')
    parser.add_argument('--output', type=Path, metavar='JSON')
    options = parser.parse_args()
    if unknown := set(options.pieces) - set(PIECES):
        parser.error(f'no piece {unknown}: {", ".join(PIECES)}')
    if not (options.pieces or options.missing or options.quick or options.tables):
        parser.error('name some pieces, or --missing, --quick or --tables')
    options.output = options.output or (
        HERE / ('.cache' if options.quick else 'results') / 'nodes.json')
    return options


def run(options, result):
    """Measure what was asked for, and write each piece at once; return whether some is left."""
    # The processes find each other here and nobody else.
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    domain = Domain()
    os.environ.setdefault('ROS_DOMAIN_ID', str(domain.id))
    started, sources = time.time(), _sources()
    chosen = [(name, options.plain) for name in options.pieces or PIECES]
    if options.missing:
        chosen = [(name, plain) for plain in (False, True) for name in (PLAIN if plain else PIECES)
                  if result.get(report.titled(name, plain), {}).get('sources') != sources]
    for i, (name, plain) in enumerate(chosen):
        if i and options.missing and (time.time() - started) / 60 + PIECES[name] > LONGEST:
            return True
        result[report.titled(name, plain)] = {**_measured(name, plain, options),
                                              'sources': sources}
        options.output.write_text(json.dumps(result, indent=1) + '\n')
        print(f'{report.titled(name, plain)}: {time.time() - started:.0f} s', file=sys.stderr)
    return False


def _measured(name, plain, options):
    """Return what a process measures."""
    with tempfile.TemporaryDirectory() as folder:
        env, path = dict(os.environ), Path(folder) / 'found.json'
        if plain:
            (Path(folder) / 'sitecustomize.py').write_text(WITHOUT)
            env['PYTHONPATH'] = os.pathsep.join([folder, env.get('PYTHONPATH', '')])
        rounds = options.rounds or (QUICK_ROUNDS if options.quick else ROUNDS)
        subprocess.run([sys.executable, '-m', 'benchmark.nodes.piece', name, str(path),
                        str(rounds), *['--quick'] * options.quick], env=env, check=True)
        return json.loads(path.read_text())


def _sources():
    """Return what tells these sources of the package from any others."""
    return subprocess.run(['git', 'rev-parse', '--short', 'HEAD:linkage_ros'],
                          capture_output=True, text=True, cwd=HERE).stdout.strip()


if __name__ == '__main__':
    sys.exit(main())
