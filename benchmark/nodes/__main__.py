# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What `kinematics` costs beside a floor and a relay, and how long changes hold it up.

    python -m benchmark.nodes --missing     what is not measured of these sources yet
    python -m benchmark.nodes --quick       a look at all, in a few minutes
    python -m benchmark.nodes changes       this piece alone, in full or --quick
    python -m benchmark.nodes --tables      the tables of the last results

Pieces are the scenes and `changes`; --plain measures them where llvmlite cannot be imported.
Results are kept piece by piece in benchmark/results/nodes.json, those of a look in
benchmark/.cache/; the tables are printed, and written into docs/design/performance.md by
--document.
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
# What is measured, and what of it without llvmlite, too.
PIECES = 'one leg', '12 legs', 'four mechanisms', 'sixty mechanisms', 'changes'
PLAIN = ('12 legs',)
# What a Python imports at its start, so that it finds no llvmlite.
WITHOUT = "import sys\nsys.modules['llvmlite'] = None\n"


def main():
    """Run, write and print."""
    options = arguments()
    output = HERE / ('.cache' if options.quick else 'results') / 'nodes.json'
    result = json.loads(output.read_text()) if output.exists() else {}
    if not options.tables:
        output.parent.mkdir(exist_ok=True)
        run(options, result, output)
    document.show(options, 'design/performance.md', report.document(result))


def arguments():
    """Return what the command line asks for."""
    parser = document.parser(__doc__)
    parser.add_argument('pieces', nargs='*', metavar='PIECE', help=', '.join(PIECES))
    mode = parser.add_mutually_exclusive_group()
    mode.add_argument('--missing', action='store_true', help='what is not measured yet')
    mode.add_argument('--quick', action='store_true', help='one rate and fewer rounds')
    mode.add_argument('--tables', action='store_true', help='run nothing, show the last results')
    parser.add_argument('--plain', action='store_true', help='without llvmlite')
    options = parser.parse_args()
    if unknown := set(options.pieces) - set(PIECES):
        parser.error(f'no piece {unknown}: {", ".join(PIECES)}')
    if not (options.pieces or options.missing or options.quick or options.tables):
        parser.error('name some pieces, or --missing, --quick or --tables')
    return options


def run(options, result, output):
    """Measure what was asked for; add each piece to the result, and write it at once."""
    # The processes find each other here and nobody else.
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    domain = Domain()
    os.environ.setdefault('ROS_DOMAIN_ID', str(domain.id))
    started, sources = time.time(), _sources()
    chosen = [(name, options.plain) for name in options.pieces or PIECES]
    if options.missing:
        chosen = [(name, plain) for plain in (False, True) for name in (PLAIN if plain else PIECES)
                  if result.get(report.titled(name, plain), {}).get('sources') != sources]
    for name, plain in chosen:
        result[report.titled(name, plain)] = {**_measured(name, plain, options),
                                              'sources': sources}
        output.write_text(json.dumps(result, indent=1) + '\n')
        print(f'{report.titled(name, plain)}: {time.time() - started:.0f} s', file=sys.stderr)


def _measured(name, plain, options):
    """Return what a process measures."""
    with tempfile.TemporaryDirectory() as folder:
        env, path = dict(os.environ), Path(folder) / 'found.json'
        if plain:
            (Path(folder) / 'sitecustomize.py').write_text(WITHOUT)
            env['PYTHONPATH'] = os.pathsep.join([folder, env.get('PYTHONPATH', '')])
        subprocess.run([sys.executable, '-m', 'benchmark.nodes.piece', name, str(path),
                        *['--quick'] * options.quick], env=env, check=True)
        return json.loads(path.read_text())


def _sources():
    """Return what tells these sources of the package from any others."""
    return subprocess.run(['git', 'rev-parse', '--short', 'HEAD:linkage_ros'],
                          capture_output=True, text=True, cwd=HERE).stdout.strip()


if __name__ == '__main__':
    main()
