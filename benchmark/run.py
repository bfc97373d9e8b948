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
Run time against error: every method on every linkage at several batch sizes.

    python -m benchmark.run                      everything, in some two minutes
    python -m benchmark.run --quick              a look, within a minute
    python -m benchmark.run --compare old.json   ratios to an earlier run, nothing is run

Rows go to benchmark/results/latest.json, those of a look to benchmark/.cache/, with a table and
pictures beside it. What it needs is in benchmark/requirements.txt; a method whose package is not
installed is named and left out.
"""

import argparse
import json
import os
from pathlib import Path
import sys
import time

# One core for every method: the numbers are per core.
for library in ('OMP', 'OPENBLAS', 'MKL', 'NUMEXPR'):
    os.environ.setdefault(f'{library}_NUM_THREADS', '1')
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})

import numpy as np  # noqa: E402

from . import methods, plots, problems, report, timing  # noqa: E402
from .errors import judge  # noqa: E402
from .machine import machine  # noqa: E402

QUICK = ('ours', 'compiled_c', 'original', 'sympy_expression', 'table', 'newton', 'pylinkage_step')


def main():
    """Run, write and print."""
    options = arguments()
    if options.compare:
        old, new = (json.loads(path.read_text()) for path in (options.compare, options.output))
        print(report.comparison(old, new))
        return
    result = run(options)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    options.output.write_text(json.dumps(result, indent=1) + '\n')
    options.output.with_suffix('.md').write_text(report.document(result))
    plots.draw(result, options.output.parent)
    print(report.targets(result))


def arguments():
    """Return what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--quick', action='store_true', help='fewer methods, less time each')
    parser.add_argument('--families', nargs='+', choices=methods.FAMILIES, metavar='FAMILY',
                        help=f'only these: {", ".join(methods.FAMILIES)}')
    parser.add_argument('--output', type=Path, metavar='JSON')
    parser.add_argument('--compare', type=Path, metavar='JSON',
                        help='print the ratios of the output to an earlier one')
    options = parser.parse_args()
    options.output = options.output or (
        problems.CACHE if options.quick else report.RESULTS) / 'latest.json'
    return options


def run(options):
    """Return {machine, absent, rows}."""
    started = time.time()
    families = options.families or (QUICK if options.quick else methods.FAMILIES)
    chosen, absent = methods.load(families)
    # Once for all: nobody pays for it in what is timed.
    np.seterr(all='ignore')
    for family, reason in absent.items():
        print(f'left out: {family}: {reason}', file=sys.stderr)
    rows = []
    for kind in problems.DIMENSIONS:
        rows += solve(kind, [m for m in chosen if kind in m.mechanisms],
                      0.03 if options.quick else 0.12)
        print(f'{kind}: {time.time() - started:.0f} s', file=sys.stderr)
    return {'machine': machine(chosen), 'seconds': round(time.time() - started),
            'absent': absent, 'rows': rows}


def solve(kind, chosen, budget):
    """Return the rows of one linkage."""
    problem = problems.problem(kind)
    wrong = {}
    for method in chosen:
        method.prepare(kind, problem.dimensions)
        wrong[method, True] = judge(method, problem, True)
        # What follows goes one by one whatever is asked.
        one_by_one = method.follows or method.batches == (1,)
        wrong[method, False] = (wrong[method, True] if one_by_one
                                else judge(method, problem, False))
    rows = []
    for batch in timing.BATCHES:
        able = [method for method in chosen if batch in method.batches]
        samples = timing.measure(able, kind, batch, budget)
        rows += [{'mechanism': kind, 'method': method.name, 'knob': method.knob,
                  'kind': method.kind, 'follows': method.follows, 'batch': batch,
                  **times(samples[method]), **wrong[method, batch == 1]} for method in able]
    return rows


def times(samples):
    """Return the columns of a row that tell about time."""
    if samples is None:
        return {'status': 'not run: over budget', 'samples': 0, 'median_us': None, 'p95_us': None}
    return {'status': 'ok', 'samples': len(samples), 'median_us': float(np.median(samples)),
            'p95_us': float(np.percentile(samples, 95))}


if __name__ == '__main__':
    main()
