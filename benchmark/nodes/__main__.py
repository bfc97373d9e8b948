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
What the nodes cost, next to what any node costs, in the same run.

    python -m benchmark.nodes --missing          what is not measured of these sources yet
    python -m benchmark.nodes --quick            a look, within two or three minutes
    python -m benchmark.nodes services changes   these pieces alone, in full or --quick
    python -m benchmark.nodes --tables           the tables of the last results

Everything takes 100 minutes at most, first with machine code, then without llvmlite. `--missing`
stops before ten minutes are over and ends with 3 while something is left: call it again. The
pieces are those of `piece.py`. Results go to benchmark/results/nodes.json, those of a look to
benchmark/.cache/; the tables are printed, and written into docs/performance.md by --document.
"""

import argparse
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
# One call of `--missing` takes no longer than this [minutes], if no piece does.
LONGEST = 9.8
LEFT = 3
QUICK = 'one leg', '12 legs', 'four mechanisms', 'layers', 'services'
# What a Python imports at its start, so that it finds no llvmlite.
WITHOUT = "import sys\nsys.modules['llvmlite'] = None\n"


def main():
    """Run, write and print; return the exit code."""
    options = arguments()
    result = json.loads(options.output.read_text()) if options.output.exists() else {}
    options.output.parent.mkdir(parents=True, exist_ok=True)
    is_left = False
    if not options.tables:
        is_left = run(options, result)
    tables = report.document(result)
    if options.document:
        document.write('performance.md', report.in_short(result), 'measured: in short')
        document.write('performance.md', tables)
        if 'growth' in result.get(report.NATIVE, {}):
            from . import growth_plot

            growth_plot.draw(result[report.NATIVE]['growth']['found'],
                             document.DOCS / 'images' / 'growth.png')
    print(report.in_short(result), tables, sep='\n\n')
    return LEFT if is_left else 0


def arguments():
    """Return what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('pieces', nargs='*', help='which pieces, by their names in piece.py')
    mode = parser.add_mutually_exclusive_group()
    mode.add_argument('--missing', action='store_true', help='what is not measured yet')
    mode.add_argument('--quick', action='store_true', help='one rate and fewer rounds')
    mode.add_argument('--tables', action='store_true', help='run nothing, show the last results')
    parser.add_argument('--plain', action='store_true', help='without llvmlite')
    parser.add_argument('--document', action='store_true', help='write the tables to docs/')
    parser.add_argument('--rounds', type=int, help='bursts of each subject')
    parser.add_argument('--output', type=Path, metavar='JSON')
    options = parser.parse_args()
    options.output = options.output or (
        HERE / ('.cache' if options.quick else 'results') / 'nodes.json')
    if not (options.pieces or options.missing or options.quick or options.tables):
        parser.error('name some pieces, or --missing, --quick or --tables')
    return options


def run(options, result):
    """Measure what was asked for, and write each piece at once; return whether some is left."""
    from .piece import PIECES

    # The processes find each other here and nobody else.
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    domain = Domain()
    os.environ.setdefault('ROS_DOMAIN_ID', str(domain.id))
    started, sources = time.time(), _sources()
    if options.missing:
        columns = [(report.NATIVE, name) for name in PIECES] + [
            (report.PLAIN, name) for name, piece in PIECES.items() if piece.is_plain]
        chosen = [(column, name) for column, name in columns
                  if result.get(column, {}).get(name, {}).get('sources') != sources]
    else:
        column = report.PLAIN if options.plain else report.NATIVE
        chosen = [(column, name) for name in options.pieces or QUICK]
    for i, (column, name) in enumerate(chosen):
        minutes = (time.time() - started) / 60 + PIECES[name].minutes
        if i and options.missing and minutes > LONGEST:
            return True
        measured = {**_measured(column, name, options), 'sources': sources}
        result.setdefault(column, {})[name] = measured
        options.output.write_text(json.dumps(result, indent=1) + '\n')
        print(f'{column}, {name}: {measured["seconds"]} s', file=sys.stderr)
    return False


def _measured(column, name, options):
    """Return what a process measures."""
    with tempfile.TemporaryDirectory() as folder:
        env, path = dict(os.environ), Path(folder) / 'found.json'
        if column == report.PLAIN:
            (Path(folder) / 'sitecustomize.py').write_text(WITHOUT)
            env['PYTHONPATH'] = os.pathsep.join([folder, env.get('PYTHONPATH', '')])
        more = ['--quick'] * options.quick
        if options.rounds:
            more += ['--rounds', str(options.rounds)]
        subprocess.run([sys.executable, '-m', 'benchmark.nodes.piece', name, str(path), *more],
                       env=env, check=True)
        return json.loads(path.read_text())


def _sources():
    """Return what tells these sources of the package from any others."""
    return subprocess.run(['git', 'rev-parse', '--short', 'HEAD:linkage_ros'],
                          capture_output=True, text=True, cwd=HERE).stdout.strip()


if __name__ == '__main__':
    sys.exit(main())
