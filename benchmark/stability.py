# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Measure how many digits linkages keep, against the truth in 96 digits.

    python -m benchmark.stability [--samples 2000] [--linkages 200] [--jobs 2] [--document]

Four linkages and the original formulas are held to the rule on the catalogue's dimensions and on
random and degenerate ones (test/truth/drawing_accuracy.py, hard_cases.py); random linkages to all
that test/truth/linkage_checks.py checks. Exits with 1 if the library breaks a rule; with
--document the table goes into docs/design/accuracy.md.
"""

from collections import Counter
import math
import multiprocessing
import sys

from linkage_ros import mechanisms
import numpy as np
from truth import (
    drawing_accuracy,
    hard_cases,
    linkage_checks,
    original_formulas,
    random_linkages,
)

from . import document
from .peers import POINTS

# Samples and random linkages of a task; angles of a random design; one task in four has rates.
CHUNK, LINKAGES, ANGLES, RATES = 50, 10, 5, 4
# Angles at which a random linkage is searched by brute force.
GRID = 8000


def catalogue(kind, rng, rates):
    """Measure one of the catalogue's dimensions on random branches."""
    designs = hard_cases.CATALOGUE[kind]
    return measured(kind, designs[rng.integers(len(designs))], rng, CHUNK, rates, 'catalogue')


def random(kind, rng, rates):
    """Measure random and nearly degenerate dimensions, a few angles each."""
    return [row for _ in range(CHUNK // ANGLES) for row in measured(
        kind, hard_cases.dimensions(kind, rng), rng, ANGLES, rates, 'random dimensions')]


def measured(kind, dimensions, rng, count, rates, label):
    """Return rows of the library and, where they know the design, of the original formulas."""
    usual = mechanisms.design(kind).branches
    branches = usual if rng.random() < 0.5 else {
        name: int(rng.choice((-1, 1))) for name in usual}
    mechanism = mechanisms.create(kind, branches=branches, **dimensions)
    arcs = mechanism.reach()
    # A triangle may not exist, of which the drawing says nothing.
    if not arcs and kind == 'jansen':
        return []
    ends = [] if arcs == [(-math.pi, math.pi)] else [end for arc in arcs for end in arc]
    measure = drawing_accuracy.strict(mechanism)
    given = random_linkages.given(rng, count, ends, mechanism.inputs)
    exact = [measure.at(row, rates) for row in given]
    found = {label: (drawing_accuracy.answers(mechanism, given, measure.poses, rates), rates)}
    if branches == usual and not (kind == 'slotted_lever' and dimensions['e']):
        with np.errstate(all='ignore'):
            numbers = original_formulas.written(
                original_formulas.ARRAYS, kind, dimensions)(given[:, 0])
        places = dict(zip(POINTS[kind], np.reshape(numbers, (-1, 2, count)).swapaxes(1, 2)))
        found['original formulas'] = {out: places[out.name] for out in measure.poses
                                      if out.what == 'point' and out.name in places}, False
    return [(kind, title, str(row.output), row.ratio, row.problem)
            for title, (each, has_rates) in found.items()
            for row in drawing_accuracy.judge(measure, given, each, has_rates, exact)
            if row.sensitivity or row.ratio]


def linkages(_, rng, accelerated):
    """Return rows of random linkages, and all that does not hold."""
    rows = []
    for i in range(LINKAGES):
        checks = linkage_checks.CHECKS + (linkage_checks.accelerated,) * (accelerated and not i)
        problems, measures = linkage_checks.problems(
            random_linkages.design(rng), rng, checks, GRID) or ((), ())
        rows += [('random linkages', kind, '', math.nan, text) for kind, text in problems]
        for row in measures:
            if row.sensitivity and math.isfinite(row.ratio):
                order = ('', ' rate', ' acceleration')[row.output.order]
                rows.append(('random linkages', row.output.what + order, '', row.ratio, ''))
    return rows


TASKS = {'catalogue': catalogue, 'random': random, 'linkages': linkages}


def run(task):
    """Run one task with a generator of its own."""
    name, kind, seed, rates = task
    return TASKS[name](kind, np.random.default_rng(seed), rates)


def tasks(options):
    """Yield what there is to do."""
    for i in range(max(1, options.samples // CHUNK)):
        for n, kind in enumerate(hard_cases.CATALOGUE):
            for m, name in enumerate(('catalogue', 'random')):
                yield name, kind, (options.seed, m, n, i), not i % RATES
    for i in range(options.linkages // LINKAGES):
        yield 'linkages', '', (options.seed, 5, i), not i % 2


def main():
    """Run all tasks, print the table; return the exit code."""
    parser = document.parser(__doc__)
    parser.add_argument('--samples', type=int, default=2000, help='angles a linkage and set')
    parser.add_argument('--linkages', type=int, default=200, help='random linkages')
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--seed', type=int, default=1)
    options = parser.parse_args()
    ratios, problems = {}, Counter()
    with multiprocessing.get_context('spawn').Pool(options.jobs) as pool:
        for rows in pool.imap_unordered(run, tasks(options)):
            for kind, title, output, ratio, problem in rows:
                found = ratios.setdefault((kind, title), [])
                if math.isfinite(ratio):
                    found.append((ratio, output))
                if problem:
                    problems[kind, title] += 1
                    if title != 'original formulas':
                        print(kind, title, output, problem, file=sys.stderr)
    lines = [[f'{kind}, {title}', len(found), ' '.join((f'{max(found)[0]:.2g}', max(found)[1])),
              f'{np.quantile([ratio for ratio, _ in found], 0.999):.2g}', problems[kind, title]]
             if found else [f'{kind}, {title}', '', '', '', problems[kind, title]]
             for (kind, title), found in sorted(ratios.items())]
    text = document.table(['error / sensitivity', 'results', 'largest', '99.9 % are below',
                           'beyond the rule'], lines)
    text += '\n\n' + document.machine('gmpy2')
    document.show(options, 'design/accuracy.md', text, 'measured: stability')
    return int(any(number for (_, title), number in problems.items()
                   if title != 'original formulas'))


if __name__ == '__main__':
    sys.exit(main())
