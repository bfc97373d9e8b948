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
Words and tables from the rows of a run.

    python -m benchmark.report    runs nothing, writes docs/accuracy.md from benchmark/results/
"""

import json
from pathlib import Path
from typing import Dict, List, NamedTuple

from . import document as pages
from .errors import ENDLESS
from .timing import BATCHES

RESULTS = Path(__file__).with_name('results')
# Outputs whose errors may be twice as large.
RATES = 'rate', 'acceleration'
TITLES = {'water_drop': 'Water drop', 'jansen': 'Jansen leg', 'peaucellier': 'Peaucellier cell',
          'slotted_lever': 'Slotted lever'}
FAILURES = ('nan', 'raised', 'astray', 'made_up')

# What was tried and is not among the methods.
OMISSIONS = (
    ('compas 2.15.1', 'geometry, data structures and a scene; nothing that closes a loop of bars'),
    ('linkage_ros in float32', 'not offered'),
    ('a slot beside the lever, e other than 0', 'no peer was asked for it'),
    ('velocities and joint angles', 'points alone are compared'),
)


def document(result):
    """Return the whole report as Markdown."""
    machine = result['machine']
    packages = ', '.join(f'{name} {number}' for name, number in machine['packages'].items())
    parts = [
        '# Run time against error',
        f'{machine["date"]}, {machine["cpu"]}, one core; {machine["system"]}; Python '
        f'{machine["python"]}, {machine["compiler"]}; {packages}. Commit {machine["commit"]}. '
        f'The run took {result["seconds"]} s.',
        LEGEND,
    ]
    parts += [CHOICE]
    for kind, title in TITLES.items():
        parts += [f'## {title}', f'![{title}: run time against error]({kind}.png)',
                  table(result, kind)]
    parts += ['## Targets', targets(result), '## Omissions', omissions(result)]
    return '\n\n'.join(parts) + '\n'


LEGEND = """\
Times are medians [us per pose, all points], with the 95th percentile of single poses. Errors are
those of the worst point of a pose, in uL = 2^-53 x the longest bar, over the poses that did not
fail: the median and the largest within a turn, awkward angles included, then the largest over all
angles, some of them 1e9 turns out. *x sens* is the largest error within a turn, less one ulp of
the result, in units of the change that half an ulp of every input makes. Failures are counted
over all angles: NaN, an exception, astray (off by more than 5 % of the longest bar: another
assembly, or no convergence), and made up (a pose where none exists). *>* marks methods that start
from the preceding pose, at most two degrees away."""


CHOICE = """\
Each picture shows linkage_ros in its forms (single poses by `function()`), the fastest C, and one
method for each kind of peer: formulas, compilers, tables, root finders, programs for linkages and
sketches, robot libraries and simulators. Of each kind, the fastest at 1000 poses is shown whose
result agrees, but for the last three digits, at 99 % of the angles or more; if none does, the one
with the fewest failures. A curve in the lower panel is one method over its setting: nodes,
iterations, tolerance. A share of wrong poses is given after the method's name."""


def table(result, kind):
    """Return the rows of a linkage as a Markdown table."""
    lines = ['| method | knob | 1 | p95 | 12 | 1000 | 100000 | median uL | max uL | x sens '
             '| max uL, all angles | failures |', '|---|---' + '|--:' * 9 + '|---|']
    for rows in methods(result, kind).values():
        one, many = rows.get(1), rows.get(1000) or any_of(rows)
        lines.append('| ' + ' | '.join((
            ('> ' if many['follows'] else '') + many['method'], many['knob'],
            _time(one), _number(one and one['p95_us']),
            *(_time(rows.get(batch)) for batch in BATCHES[1:]),
            *(_number(many[name]) for name in ('median_uL', 'max_uL', 'max_sensitivity',
                                               'max_uL_all')),
            failures(many))) + ' |')
    return '\n'.join(lines)


def methods(result, kind):
    """Return {(method, knob): {batch: row}} of a linkage, in the order they were run."""
    found = {}
    for row in result['rows']:
        if row['mechanism'] == kind:
            found.setdefault((row['method'], row['knob']), {})[row['batch']] = row
    return found


def any_of(rows):
    """Return one of the rows by batch of a method: of single poses where there is one."""
    return next(iter(rows.values()))


class Curve(NamedTuple):
    """A method in a picture: its name, a row by batch, and the rows of all its settings."""

    name: str
    batches: Dict[int, dict]
    knobs: List[Dict[int, dict]]

    def settings(self, batch):
        """Return the timed rows of all its settings at a batch."""
        return [rows[batch] for rows in self.knobs
                if batch in rows and _timed(rows[batch]) and rows[batch]['max_scaled'] is not None]


def chosen(result, kind):
    """Return the curves of a linkage's picture, as CHOICE says."""
    found = methods(result, kind)
    curves = []
    for key in (OURS, FAST):
        if key in found:
            rows = {**found[key], **(found.get(FLOATS, {}) if key == OURS else {})}
            curves.append(_curve(', '.join(key), rows, [found[key]]))
    limits = {key: rows for key, rows in found.items() if _most(rows)['kind'] == 'limit'}
    if limits:
        best = min(limits, key=lambda key: _merit(_most(limits[key])))
        flags = best[1].removeprefix('gcc -O3, ')
        curves.append(_curve(f'C ({flags})', limits[best], [limits[best]]))
    for names in PEERS.values():
        knobs = {key: rows for key, rows in found.items() if key[0] in names}
        if knobs:
            best = min(knobs, key=lambda key: _merit(_most(knobs[key])))
            curves.append(_curve(best[0], knobs[best],
                                 [rows for key, rows in knobs.items() if key[0] == best[0]]))
    return curves


def _curve(name, rows, knobs):
    """Return a curve; its name says at how many angles it fails."""
    row = _most(rows)
    share = failed(row) / row['angles']
    told = f'{name.replace(", pose before", "")}' + (
        f' ({100 * share:.0f} % wrong)' if share >= RARE else '')
    return Curve(told, {batch: row for batch, row in rows.items() if _timed(row)}, knobs)


def _most(rows):
    """Return the row by which a setting is judged."""
    return rows.get(1000) or any_of(rows)


def _timed(row):
    return row['median_us'] is not None


def _merit(row):
    """Return what is the least for the best setting."""
    share, error = failed(row) / row['angles'], row['max_scaled_all']
    if not _timed(row):
        return 2, share, error
    if _right(row):
        return 0, row['median_us'], error
    return 1, share if share >= RARE else 0.0, error


def _right(row):
    """Return whether a method is right at all but a few angles, to the last three digits."""
    return (failed(row) < RARE * row['angles'] and row['max_scaled_all'] is not None
            and row['max_scaled_all'] < ACCURATE)


def failures(row):
    """Return the failures of a row in words."""
    told = [f'{row[f"failed_{name}"]} {name.replace("_", " ")}' for name in FAILURES
            if row[f'failed_{name}']]
    return f'{", ".join(told)} of {row["angles"]}' if told else 'none'


def failed(row):
    """Return the number of all failures of a row."""
    return sum(row[f'failed_{name}'] for name in FAILURES)


def _time(row):
    if row is None:
        return ''
    return 'over budget' if row['median_us'] is None else _number(row['median_us'])


def _number(value):
    if value is None:
        return ''
    if value == 0:
        return '0'
    if value >= ENDLESS:
        return 'inf'
    if 1e-3 <= value < 1e5:
        digits = max(0, 2 - len(str(int(value))) + (value < 1)) + (value < 0.1)
        return f'{value:.{digits + (value < 10)}f}'
    return f'{value:.0e}'.replace('e-0', 'e-').replace('e+0', 'e+')


def omissions(result):
    """Return what is not among the methods, and why."""
    lines = ['| what | why |', '|---|---|']
    lines += [f'| {what} | {why} |' for what, why in OMISSIONS]
    lines += [f'| {family} | not installed here: {why} |'
              for family, why in result['absent'].items()]
    return '\n'.join(lines)


def targets(result):
    """Return the ratios that are aimed at, from the medians of this run."""
    lines = ['| ratio of CPU times | target | measured |', '|---|---|---|']
    jansen = methods(result, 'jansen')
    step = jansen.get(('pylinkage', 'step()'))
    for ours in (FLOATS, OURS):
        if ours in jansen and step:
            lines.append(_aim(f"Jansen leg, one pose, all joints: {ours[1]} / pylinkage's step",
                              jansen[ours][1], step[1], 0.2))
    for point in 'GC':
        part = jansen.get((OURS[0], f'{point} alone'))
        for batch, ours in ((1, FLOATS), (BATCHES[-1], OURS)):
            if part:
                lines.append(_aim(f'Jansen leg, {_poses(batch)}: joint {point} only / all joints',
                                  part[batch], jansen[ours][batch], 1.0))
    for kind, title in TITLES.items():
        found = methods(result, kind)
        for limit in [key for key in found if key[0] == 'C through ctypes']:
            for method, wanted in AIMS[limit[1]].items():
                if method in found:
                    lines.append(_aim(
                        f'{title}, {_poses(BATCHES[-1])}: {method[1]} / C ({limit[1]})',
                        found[method][BATCHES[-1]], found[limit][BATCHES[-1]], wanted))
    return '\n'.join([*lines, '', *_against_peers(result)])


OURS = ('linkage_ros', 'numpy')
FAST = ('linkage_ros', 'machine code')
FLOATS = ('linkage_ros', 'function()')
# What 100 000 poses may take, in units of what C takes.
AIMS = {'gcc -O3': {OURS: 4.0, FAST: 0.5}, 'gcc -O3, this CPU': {OURS: 4.0, FAST: 0.5},
        'gcc -O3, this CPU, vector sine': {FAST: 1.5}}
PEERS = {
    'formulas': ('original formulas', 'sympy, lambdified'),
    'compilers': ('the same operations',),
    'tables': ('table, cubic spline',),
    'root finders': ('Newton, 72 stored poses', 'Newton, pose before', 'scipy fsolve, pose before',
                     'scipy least_squares, pose before', 'casadi rootfinder, pose before'),
    'programs for linkages and sketches': (
        'pylinkage', 'planegcs, pose before', 'SolveSpace, pose before'),
    'robot libraries and simulators': (
        'pinocchio, pose before', 'Drake SNOPT, pose before', 'MuJoCo, simulated'),
}
# Right: all but one in a hundred poses, and these to the last three digits, whatever the angle.
ACCURATE = 1e3
RARE = 0.01


def _against_peers(result):
    """Compare with the fastest peer, and with the fastest that is right at every angle."""
    yield ('| us per pose | function() | numpy | machine code | fastest peer that is right '
           '| fastest peer of all |')
    yield '|---|--:|--:|--:|---|---|'
    for kind, title in TITLES.items():
        found = methods(result, kind)
        for batch in BATCHES:
            timed = [rows[batch] for rows in found.values() if batch in rows
                     and rows[batch]['kind'] == 'peer' and rows[batch]['median_us'] is not None]
            right = [row for row in timed if _right(row)]
            ours = (found.get(key, {}).get(batch) for key in (FLOATS, OURS, FAST))
            yield '| ' + ' | '.join((
                f'{title}, {_poses(batch)}', *map(_time, ours),
                *(_fastest(rows) for rows in (right, timed)))) + ' |'


def _fastest(rows):
    if not rows:
        return 'none'
    row = min(rows, key=lambda row: row['median_us'])
    return (f'{_number(row["median_us"])}: {row["method"]}, {row["knob"]} '
            f'(max {_number(row["max_uL_all"])} uL, failures: {failures(row)})')


def _poses(batch):
    return 'one pose' if batch == 1 else f'{batch} poses'


def _aim(what, row, other, wanted):
    if row['median_us'] is None or other['median_us'] is None:
        return f'| {what} | <= {wanted:g} | not run |'
    ratio = row['median_us'] / other['median_us']
    missed = '' if ratio <= wanted else ' **missed**'
    return (f'| {what} | <= {wanted:g} | {ratio:.2f}{missed} '
            f'({_number(row["median_us"])} / {_number(other["median_us"])} us) |')


def in_short(result):
    """Return what a pose takes of the largest and of the smallest linkage."""
    lines = ['| CPU time per pose [us], on one core | ' + ' | '.join(map(_poses, BATCHES)) + ' |',
             '|---' + '|--:' * len(BATCHES) + '|']
    for kind in ('jansen', 'slotted_lever'):
        found = methods(result, kind)
        for name, rows in (('Python and numpy', {**found[OURS], **found[FLOATS]}),
                           ('machine code', found.get(FAST, {}))):
            lines.append(f'| {TITLES[kind]}, {name} | '
                         + ' | '.join(_time(rows.get(batch)) for batch in BATCHES) + ' |')
    return '\n'.join(lines)


def elsewhere(result):
    """Return who takes less time, as parts of ours, and is right."""
    lines = ['| poses at once | faster than Python and numpy | faster than machine code |',
             '|---|---|---|']
    for batch in BATCHES:
        lines.append(f'| {batch} | {_ahead(result, batch, OURS, FLOATS)} '
                     f'| {_ahead(result, batch, FAST, FLOATS)} |')
    return '\n'.join(lines)


def _ahead(result, batch, *forms):
    """Return the methods of others that take less time than the best of some forms of ours."""
    told = {}
    for kind, title in TITLES.items():
        found = methods(result, kind)
        own = min((found[form][batch]['median_us'] for form in forms
                   if batch in found.get(form, {})), default=0.0)
        best = {}
        for rows in found.values():
            row = rows.get(batch)
            if row and row['kind'] in ('peer', 'limit') and _timed(row) and _right(row):
                best[row['method']] = min(row['median_us'], best.get(row['method'], own))
        for method, time in best.items():
            if time < own:
                name = method.partition(' through')[0].partition(',')[0]
                told.setdefault(name, []).append(f'{title} {time / own:.2f}')
    return '; '.join(f'{name}: {", ".join(where)}' for name, where in told.items()) or 'none'


def stability(found):
    """Return what benchmark.stability found, as Markdown."""
    lines = ["| largest error / sensitivity (and its output) | catalogue's dimensions "
             '| random dimensions | original formulas |', '|---|--:|--:|--:|']
    for kind, title in TITLES.items():
        lines.append(f'| {title} | ' + ' | '.join(
            _worst([row for row in found['accuracy'] if row['mechanism'] == kind
                    and row['method'] == method and row['set'] in sets])
            for method, sets in (('library', ('catalogue',)), ('library', ('random',)),
                                 ('original', ('catalogue', 'random')))) + ' |')
    own = [row for row in found['accuracy'] if row['method'] == 'library']
    closed, reached = found['closure'], found['reach']
    lines += ['', f'Of {_sum(own, "samples")} results of these four linkages '
              f'{_sum(own, "broken")} break the rule, {_sum(own, "nan")} are NaN instead of a '
              f'number, and {_sum(own, "missed_nan")} are a number instead of NaN. At '
              f'{_sum(closed, "wrong")} of {_sum(closed, "samples")} angles the library and the '
              f'reference disagree whether the linkage can be assembled. At '
              f'{_sum(reached, "wrong")} of {_sum(reached, "designs")} random designs the reach '
              f'differs from brute force.', '']
    several = found['linkages']
    lines += [f'| {several["linkages"]} random linkages: error / sensitivity of | results | rule '
              '| largest | 99.9 % are below |', '|---|--:|--:|--:|--:|']
    lines += [f'| {row["output"]} | {row["samples"]} '
              f'| {8 if row["output"].endswith(RATES) else 4} | {row["max"]:.2g} '
              f'| {row["p99.9"]:.2g} |' for row in several['outputs']]
    problems = ', '.join(f'{row["count"]} x {row["kind"].replace(" rule", " beyond the rule")}'
                         for row in several['problems'])
    lines += ['', 'Problems with these random linkages, in the library or in the check: '
              f'{problems or "none"}.']
    return '\n'.join(lines)


def _sum(rows, column):
    return sum(row[column] for row in rows)


def _worst(rows):
    worst = max(rows, key=lambda row: row['max'])
    return f'{worst["max"]:.2g} ({worst["output"]})'


def main():
    """Write what docs/accuracy.md shows of the last runs."""
    for part, text in page(*(json.loads((RESULTS / f'{name}.json').read_text())
                             for name in ('latest', 'stability'))).items():
        pages.write('accuracy.md', text, part)


def page(result, found):
    """Return the measured parts of docs/accuracy.md."""
    machine, aims = result['machine'], targets(result).partition('\n\n')[0]
    return {
        'measured: in short': in_short(result), 'measured: elsewhere': elsewhere(result),
        'measured: choice': CHOICE, 'measured: stability': stability(found),
        'measured: comparison': f'{aims}\n\n{machine["date"]}, {machine["cpu"]}, one core; '
                                f'commit {machine["commit"]}.'}


def comparison(old, new):
    """Return the ratios new / old of median times and largest errors, for rows in both."""
    before = {_key(row): row for row in old['rows']}
    lines = [f'{old["machine"]["date"]} {old["machine"]["commit"]} -> '
             f'{new["machine"]["date"]} {new["machine"]["commit"]}', '',
             '| linkage | method | knob | batch | time | max error |', '|---|---|---|--:|--:|--:|']
    for row in new['rows']:
        was = before.get(_key(row))
        if was:
            time, error = (_ratio(row[name], was[name]) for name in ('median_us', 'max_scaled'))
            lines.append(f'| {row["mechanism"]} | {row["method"]} | {row["knob"]} '
                         f'| {row["batch"]} | {time} | {error} |')
    return '\n'.join(lines)


def _key(row):
    return row['mechanism'], row['method'], row['knob'], row['batch']


def _ratio(new, old):
    return f'{new / old:.2f}' if new is not None and old else '-'


if __name__ == '__main__':
    main()
