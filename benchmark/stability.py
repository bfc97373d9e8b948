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
Measure how many digits the linkages keep, against the truth in 80 digits.

    python -m benchmark.stability --samples 100000

Three questions are asked of every mechanism of the catalogue: do the bars keep their length and is
NaN given exactly where nothing can be assembled (all samples, in float64); how large is the error
in units of the input's own uncertainty (a part of them, against multiprecision, on the catalogue's
dimensions and on random and degenerate ones); is the reach what brute force finds. The formulas of
the original documents go through the same check. The measure and the hard cases are those of
the tests: test/truth/accuracy_rule.py, test/truth/hard_cases.py.

A fourth is asked of random linkages of every word: does all hold that
test/truth/linkage_checks.py checks, poses, velocities, reach, dead points and inverse among it,
and how large is the error where joints hang on each other in chains
(test/truth/drawing_accuracy.py). Exits with 1 if the library breaks a rule.
"""

import argparse
import json
import math
import multiprocessing
import os
from pathlib import Path
import pickle
import platform
import sys

from linkage_ros import mechanisms
import numpy as np
from tqdm import tqdm
from truth import (
    accuracy_rule,
    brute_force_reach,
    exact_poses,
    hard_cases,
    linkage_checks,
    original_formulas,
    random_linkages,
)

# One in so many samples is compared with the multiprecision truth, once on the catalogue's
# dimensions and once on random ones; one in four of these with its velocities and rates. A leg
# costs more than the others, so that it is asked less often.
EXACT, RATES, LEG = 25, 4, 4
CHUNK = 50
# Random linkages of a task, and how many of them also run in machine code, which is slow to make.
LINKAGES, ACCELERATED = 20, 1
UNIT = 2.0 ** -53
# Last letters of an example of a problem: a hundred arcs may come before the linkage.
EXAMPLE = 1000


def main(args=None):
    """Run all tasks on all cores, print the tables and write them as JSON."""
    options = parse(args)
    tasks = [task for kind in options.mechanisms for task in plan(kind, options)]
    tasks += [('linkages', options.grid, (options.seed, 5, i), LINKAGES, False)
              for i in range(options.linkages // LINKAGES)]
    known = recorded(options.journal)
    left = [task for task in tasks if task not in known]
    with multiprocessing.get_context('spawn').Pool(options.jobs) as pool, \
            open(options.journal, 'ab') as journal:
        for task, result in tqdm(pool.imap_unordered(run, left), total=len(left), unit='chunk'):
            known[task] = result
            pickle.dump((task, result), journal)
            journal.flush()
    done = [known[task] for task in tasks]
    report = {
        'seed': options.seed, 'samples': options.samples, 'python': platform.python_version(),
        'numpy': np.__version__, 'machine': platform.machine(),
        'accuracy': accuracy_table([result for name, result in done if name == 'accuracy']),
        'closure': closure_table([result for name, result in done if name == 'closure']),
        'reach': reach_table([result for name, result in done if name == 'reach']),
        'linkages': linkages_table([result for name, result in done if name == 'linkages']),
    }
    options.output.parent.mkdir(parents=True, exist_ok=True)
    options.output.write_text(json.dumps(report, indent=1) + '\n')
    show(report)
    return int(any(row['broken'] for row in report['accuracy'] if row['method'] == 'library')
               or any(row['wrong'] for row in report['closure'] + report['reach'])
               or bool(report['linkages']['problems']))


def parse(args):
    """Return the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--samples', type=int, default=100_000, help='angles a mechanism')
    parser.add_argument('--designs', type=int, default=10_000, help='reaches a mechanism')
    parser.add_argument('--linkages', type=int, default=1000, help='random linkages')
    parser.add_argument('--grid', type=int, default=8000,
                        help='angles at which a random linkage is searched by brute force')
    parser.add_argument('--mechanisms', nargs='*', default=list(hard_cases.CATALOGUE),
                        choices=list(hard_cases.CATALOGUE))
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--journal', type=Path, default=os.devnull,
                        help='notes what is done, so that a run that was ended goes on there')
    parser.add_argument('--output', type=Path, metavar='JSON',
                        default=Path(__file__).with_name('results') / 'stability.json')
    return parser.parse_args(args)


def recorded(journal):
    """Return what an earlier run has noted, {task: result}: it is not done again."""
    known = {}
    try:
        with open(journal, 'rb') as file:
            while True:
                known.update([pickle.load(file)])
    except (FileNotFoundError, EOFError):
        return known


def plan(kind, options):
    """Return the tasks of a mechanism as (function name, kind, seed, count, ...)."""
    share = LEG if kind == 'jansen' else 1
    exact = max(1, options.samples // EXACT // share // CHUNK)
    tasks = [('closure', kind, (options.seed, 0, i), max(1, options.samples // 20), False)
             for i in range(20)]
    for i in range(exact):
        rates = i % RATES == 0
        tasks += [('catalogue', kind, (options.seed, 1, i), CHUNK, rates),
                  ('random', kind, (options.seed, 2, i), CHUNK, rates)]
        if kind == 'slotted_lever':
            tasks.append(('servo', kind, (options.seed, 3, i), CHUNK, False))
    designs = options.designs // share
    tasks += [('reach', kind, (options.seed, 4, i), max(1, designs // 20), False)
              for i in range(20)]
    return tasks


def run(task):
    """Run one task with a generator of its own; returns the task and its (table, rows)."""
    name, kind, seed, count, rates = task
    return task, TASKS[name](kind, np.random.default_rng(seed), count, rates)


# --- tasks --------------------------------------------------------------------------------------

def closure(kind, rng, count, _):
    """Check bars and NaN of many angles in float64, on the catalogue's dimensions."""
    mechanism = catalogued(kind, rng)
    theta = hard_cases.angles(rng, count, ends(mechanism.reach()))
    gap = brute_force_reach.gap(kind, mechanism.dimensions, theta, mechanism.branches)
    points = mechanism.solve(theta)
    placed = np.all([np.isfinite(place).all(-1) for place in points.values()], axis=0)
    clear = np.abs(gap) > brute_force_reach.DOUBT
    wrong = clear & (placed != (gap > 0.0))
    whole = clear & placed
    stretch = max(
        np.max(np.abs(np.hypot(*(points[p] - points[q])[whole].T) - length), initial=0.0)
        for (p, q), length in mechanism.bar_lengths.items())
    return 'closure', (kind, count, int((~placed).sum()), int(wrong.sum()),
                       float(stretch / mechanism.longest / UNIT))


def catalogue(kind, rng, count, rates):
    """Measure one of the catalogue's dimensions, on random branches."""
    return 'accuracy', measured(catalogued(kind, rng), rng, count, rates, 'catalogue')


def random(kind, rng, count, rates):
    """Measure random and nearly degenerate dimensions, a few angles each."""
    rows = []
    for _ in range(count // 5):
        branches = branched(kind, rng)
        mechanism = mechanisms.create(kind, branches=branches, **hard_cases.dimensions(kind, rng))
        rows += measured(mechanism, rng, 5, rates, 'random')
    return 'accuracy', rows


def servo(kind, rng, count, _):
    """Measure the inverse of the slotted lever on random dimensions."""
    rows = []
    for _ in range(count // 5):
        lever = mechanisms.create(kind, branches=branched(kind, rng),
                                  **hard_cases.dimensions(kind, rng))
        angles = hard_cases.angles(rng, 5, ends(lever.lever_reach()), turns=1.0)
        rows += with_method('library', accuracy_rule.measure_servo(lever, angles, 'random'))
        rows += with_method('original', original_servo(lever, angles))
    return 'accuracy', rows


def reach(kind, rng, count, _):
    """Compare the reach of random dimensions with brute force."""
    theta = np.linspace(-math.pi, math.pi, 721)
    wrong, full, partial = [], 0, 0
    for _ in range(count):
        mechanism = mechanisms.create(kind, branches=branched(kind, rng),
                                      **hard_cases.dimensions(kind, rng))
        arcs = mechanism.reach()
        full += arcs == [(-math.pi, math.pi)]
        partial += len(arcs) > 0 and arcs != [(-math.pi, math.pi)]
        gap = brute_force_reach.gap(kind, mechanism.dimensions, theta, mechanism.branches)
        held = brute_force_reach.inside(arcs, theta)
        if np.any((np.abs(gap) > brute_force_reach.DOUBT) & (held != (gap > 0.0))):
            wrong.append((mechanism.dimensions, mechanism.branches))
    return 'reach', (kind, count, full, partial, wrong)


def linkages(grid, rng, count, _):
    """Check random linkages of every word; returns counts, ratios, problems, inverse's times."""
    made, ratios, found, seconds = 0, {}, [], []
    for i in range(count):
        design = random_linkages.design(rng)
        checks = linkage_checks.CHECKS
        if i < ACCELERATED:
            checks = *checks, linkage_checks.accelerated
        told = linkage_checks.problems(design, rng, checks, grid)
        if told:
            made += 1
            found += [tuple(problem) for problem in told[0]]
            seconds += told[2]
            for row in told[1]:
                output = row.output.what + ('', ' rate', ' acceleration')[row.output.order]
                if row.sensitivity and math.isfinite(row.ratio):
                    ratios.setdefault(output, []).append(row.ratio)
    return 'linkages', (count, made, ratios, found, seconds)


TASKS = {'closure': closure, 'catalogue': catalogue, 'random': random, 'servo': servo,
         'reach': reach, 'linkages': linkages}


def measured(mechanism, rng, count, rates, label):
    """Measure the library and, where they know the design, the original formulas."""
    theta = hard_cases.angles(rng, count, ends(mechanism.reach()))
    case = accuracy_rule.case_of(mechanism, theta, label)
    links = mechanism.links
    exact = [accuracy_rule.truth(case, theta, links, rates) for theta in case.thetas]
    found = accuracy_rule.answers(mechanism, case.thetas, rates)
    rows = with_method('library', accuracy_rule.judge(case, found, links, rates, exact))
    usual = mechanism.branches == exact_poses.KINDS[mechanism.type].branches
    if usual and not (case.kind == 'slotted_lever' and case.dimensions['e']):
        found = original_formulas.solve(case.kind, case.dimensions, case.thetas)
        if case.kind == 'slotted_lever':
            found['angle lever'] = original_formulas.lever_angle(
                case.thetas, case.dimensions['a'], case.dimensions['b'])
        rows += with_method('original', accuracy_rule.judge(case, found, links, False, exact))
    return rows


def original_servo(lever, angles):
    """Measure the second sketch's asin, which knows one of the two branches."""
    a, b, e = (lever.dimensions[name] for name in 'abe')
    if e or lever.branches['L'] < 0:
        return []
    case = accuracy_rule.case_of(lever, angles, 'random')
    rows = []
    for angle, found in zip(angles, original_formulas.servo_angle(angles, a, b)):
        exact = accuracy_rule.servo_truth(lever.dimensions, 1, angle, 1)
        rows.append(accuracy_rule.verdict(case, angle, 'angle servo', found, exact))
    return rows


def with_method(method, rows):
    """Return rows as (method, row) without what is fixed to the ground."""
    return [(method, row) for row in rows if row.sensitivity or row.ratio]


def catalogued(kind, rng):
    """Return one of the catalogue's linkages on random branches."""
    designs = hard_cases.CATALOGUE[kind]
    return mechanisms.create(kind, branches=branched(kind, rng),
                             **designs[rng.integers(len(designs))])


def branched(kind, rng):
    """Return random assembly signs, the usual ones half of the time."""
    usual = exact_poses.KINDS[kind].branches
    if rng.random() < 0.5:
        return dict(usual)
    return {name: int(rng.choice((-1, 1))) for name in usual}


def ends(arcs):
    """Return the limits of a reach, none for a full turn."""
    return [] if arcs == [(-math.pi, math.pi)] else [end for arc in arcs for end in arc]


# --- tables -------------------------------------------------------------------------------------

def accuracy_table(chunks):
    """Return one row a mechanism, set, output and method: ratios, wrong NaN, worst case."""
    groups = {}
    for method, row in (entry for chunk in chunks for entry in chunk):
        groups.setdefault((row.kind, row.label, row.output, method), []).append(row)
    table = []
    for (kind, label, output, method), rows in sorted(groups.items()):
        ratios = np.array([row.ratio for row in rows if math.isfinite(row.ratio)] or [math.nan])
        worst = max(rows, key=lambda row: (bool(row.problem), row.ratio))
        problems = [row.problem for row in rows]
        table.append({
            'mechanism': kind, 'set': label, 'output': output, 'method': method,
            **quantiles(ratios), 'samples': len(rows),
            'nan': problems.count('NaN'), 'missed_nan': problems.count('missed NaN'),
            'broken': sum(map(bool, problems)),
            'worst': {'theta': worst.theta, 'dimensions': worst.dimensions,
                      'branches': worst.branches, 'error': worst.error,
                      'sensitivity': worst.sensitivity, 'problem': worst.problem}})
    return table


def closure_table(results):
    """Return one row a mechanism: angles, NaN, wrong NaN, largest error of a bar in u L."""
    return [{'mechanism': kind, 'samples': sum(r[1] for r in rows), 'nan': sum(r[2] for r in rows),
             'wrong': sum(r[3] for r in rows), 'bar_error': max(r[4] for r in rows)}
            for kind, rows in grouped(results)]


def reach_table(results):
    """Return one row a mechanism: designs, full turns, partial ones, disagreements."""
    return [{'mechanism': kind, 'designs': sum(r[1] for r in rows),
             'full': sum(r[2] for r in rows), 'partial': sum(r[3] for r in rows),
             'wrong': sum(len(r[4]) for r in rows),
             'examples': [example for r in rows for example in r[4]][:5]}
            for kind, rows in grouped(results)]


def linkages_table(results):
    """Return counts of random linkages, a row an output, and a row a kind of problem."""
    ratios, problems = {}, {}
    for _, _, by_output, found, _ in results:
        for output, values in by_output.items():
            ratios.setdefault(output, []).extend(values)
        for kind, text in found:
            problems.setdefault(kind, []).append(text)
    return {
        'designs': sum(result[0] for result in results),
        'linkages': sum(result[1] for result in results),
        'inverse': quantiles([x for result in results for x in result[4]]),
        'outputs': [{'output': output, **quantiles(values)}
                    for output, values in sorted(ratios.items())],
        'problems': [{'kind': kind, 'count': len(texts),
                      'examples': [text[-EXAMPLE:] for text in texts[:3]]}
                     for kind, texts in sorted(problems.items(), key=lambda item: -len(item[1]))]}


def quantiles(values):
    """Return how many values there are, the largest, and two quantiles."""
    return {'samples': len(values), 'max': float(np.max(values)),
            'p99.9': float(np.quantile(values, 0.999)), 'median': float(np.median(values))}


def grouped(results):
    """Return results by their first entry, the mechanism."""
    groups = {}
    for result in results:
        groups.setdefault(result[0], []).append(result)
    return sorted(groups.items())


def show(report):
    """Print the tables."""
    print('\nerror / sensitivity (rule: <= 4, after 1 ulp of the result); NaN wrong / missed')
    print(f'{"mechanism":14}{"set":10}{"output":18}{"method":9}{"samples":>8}{"max":>9}'
          f'{"99.9 %":>9}{"median":>9}{"NaN":>6}{"missed":>7}{"broken":>7}')
    for row in report['accuracy']:
        print(f'{row["mechanism"]:14}{row["set"]:10}{row["output"]:18}{row["method"]:9}'
              f'{row["samples"]:8}{row["max"]:9.2g}{row["p99.9"]:9.2g}{row["median"]:9.2g}'
              f'{row["nan"]:6}{row["missed_nan"]:7}{row["broken"]:7}')
    print('\nworst output of the library')
    for kind, rows in grouped([(row['mechanism'], row) for row in report['accuracy']
                               if row['method'] == 'library']):
        worst = max((row for _, row in rows), key=lambda row: (row['broken'], row['max']))
        print(f'{kind:14}{worst["output"]} ({worst["set"]}): {worst["max"]:.3g}, '
              f'{worst["worst"]}')
    print('\nbars in float64: largest error in u x longest bar; NaN given, NaN wrong or missed')
    for row in report['closure']:
        print(f'{row["mechanism"]:14}{row["samples"]:8} angles  {row["bar_error"]:.3g} uL  '
              f'{row["nan"]} NaN  {row["wrong"]} wrong')
    print('\nreach against brute force')
    for row in report['reach']:
        print(f'{row["mechanism"]:14}{row["designs"]:8} designs  {row["full"]} full turns  '
              f'{row["partial"]} partial  {row["wrong"]} disagreements')
        for example in row['examples']:
            print(' ' * 14, *example)
    table = report['linkages']
    print(f'\n{table["linkages"]} random linkages of {table["designs"]} designs: '
          'error / sensitivity (rule: <= 4, after 1 ulp of the result)')
    for row in table['outputs']:
        print(f'{row["output"]:14}{row["samples"]:8}{row["max"]:9.2g}{row["p99.9"]:9.2g}'
              f'{row["median"]:9.2g}')
    print('CPU time of a question to the inverse [s]', table['inverse'])
    for row in table['problems']:
        print(f'{row["count"]} x {row["kind"]}: {row["examples"][0]}')


if __name__ == '__main__':
    sys.exit(main())
