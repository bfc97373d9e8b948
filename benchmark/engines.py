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
The formula engine beside what could stand in its place, on Jansen's leg, all points.

    python -m benchmark.engines              prints the table
    python -m benchmark.engines --document   writes it to docs/architecture.md, too

Numbers are kept in benchmark/results/engines.json. Besides what the library needs, it takes
numba, casadi, llvmlite and mpmath, as in benchmark/requirements.txt, and gcc.
"""

import argparse
import json
import os
from pathlib import Path
import time

# One core for every method: the numbers are per core.
for library in ('OMP', 'OPENBLAS', 'MKL', 'NUMEXPR'):
    os.environ.setdefault(f'{library}_NUM_THREADS', '1')

import numpy as np  # noqa: E402

from . import document, problems, timing  # noqa: E402
from .errors import judge  # noqa: E402
from .machine import machine  # noqa: E402

KIND = 'jansen'
BATCHES = 1, 1000, 100_000
RESULTS = Path(__file__).with_name('results') / 'engines.json'


def main():
    """Run, write and print."""
    parser = argparse.ArgumentParser(description=__doc__.strip().split('\n\n')[0])
    parser.add_argument('--document', action='store_true', help='write the table to docs/')
    parser.add_argument('--budget', type=float, default=1.5, metavar='SECONDS',
                        help='for each engine at each number of poses')
    parser.add_argument('--tables', action='store_true',
                        help='run nothing, show the last results')
    options = parser.parse_args()
    if not options.tables:
        RESULTS.write_text(json.dumps(run(options.budget), indent=1) + '\n')
    result = json.loads(RESULTS.read_text())
    if options.document:
        document.write('architecture.md', table(result))
    print(table(result))


def run(budget):
    """Return {machine, seconds, rows}."""
    from .methods import engines

    started = time.time()
    np.seterr(all='ignore')
    problem, rows = problems.problem(KIND), {}
    for method in engines.METHODS:
        rows[method] = {'engine': f'{method.name}, {method.knob}', 'make_s': engines.make_time(
            method, problem.dimensions, 5), **judge(method, problem, False)}
    for batch in BATCHES:
        able = [method for method in rows if batch in method.batches]
        for method, samples in timing.measure(able, KIND, batch, budget).items():
            rows[method][f'us_{batch}'] = min(samples)
    return {'machine': machine(rows), 'seconds': round(time.time() - started),
            'rows': list(rows.values())}


def table(result):
    """Return the run as Markdown."""
    lines = ['| engine | 1 | 1000 | 100000 | make [ms] | median uL | max uL | failures |',
             '|---|' + '--:|' * 7]
    for row in result['rows']:
        times = [f'{row[f"us_{batch}"]:#.2g}' if f'us_{batch}' in row else ''
                 for batch in BATCHES]
        make = 1e3 * row['make_s']
        failed = sum(count for name, count in row.items() if name.startswith('failed_'))
        lines.append('| ' + ' | '.join((
            row['engine'], *times, f'{make:.0f}' if make > 1 else f'{make:.1g}',
            f'{row["median_uL"]:.2g}', f'{row["max_uL"]:.2g}', f'{failed}')) + ' |')
    about = result['machine']
    packages = ', '.join(f'{name} {number}' for name, number in about['packages'].items())
    return '\n'.join([*lines, '', f'{about["date"]}, {about["cpu"]}, one core; Python '
                      f'{about["python"]}, {about["compiler"]}; {packages}; commit '
                      f'{about["commit"]}.'])


if __name__ == '__main__':
    main()
