# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Tables of the results, {piece: what it found, on which machine}."""

import statistics

from ..document import table

WITHOUT = ', without llvmlite'
NAMES = {
    'kinematics': 'kinematics', 'floor': 'floor: as many ready bytes',
    'relay': 'relay: Gauss-Newton, one leg, joint states',
    'joints': 'kinematics, joint states alone', 'unheard': 'kinematics, nobody listens',
    'deaf': 'subscriber that does nothing'}
# What a node that publishes nothing is compared with.
BASE = {'unheard': 'deaf', 'deaf': 'deaf'}


def titled(name, plain):
    """Return the name of a piece, with llvmlite or without."""
    return name + WITHOUT * plain


def document(result):
    """Return all tables as Markdown."""
    scenes = {name: piece['found'] for name, piece in result.items()
              if not name.startswith('changes')}
    changes = {name: piece['found'] for name, piece in result.items()
               if name.startswith('changes')}
    parts = []
    if scenes:
        parts += ['### CPU time and latency', costs(scenes), '### Body of the callback',
                  bodies(scenes)]
    if changes:
        parts += ['### Changes of parameters', change(changes)]
    where = {}
    for name, piece in result.items():
        where.setdefault(piece['machine'], {})[name] = piece['load']
    return '\n\n'.join([*parts, *(
        f'{", ".join(loads)}: {machine} Load {min(loads.values()):.1f} to '
        f'{max(loads.values()):.1f}.' for machine, loads in where.items())])


def ratio(values, others):
    """Return the median over the rounds of the ratio within a round."""
    return statistics.median(a / b for a, b in zip(values, others))


def costs(scenes):
    """Return CPU time a message and latencies of every subject."""
    lines = []
    for name, found in scenes.items():
        cpus = {(row['rate'], row['subject']): row['cpus'] for row in found['rows']}
        for row in found['rows']:
            rate, subject = row['rate'], row['subject']
            base = cpus[rate, BASE.get(subject, 'floor')]
            lines.append([
                f'{name}, {rate:.0f} Hz: {NAMES[subject]}', f'{row["cpu"]:.0f}',
                f'{1e-4 * row["cpu"] * rate:.2g}', f'{ratio(row["cpus"], base):.2f}',
                *(f'{row[x]:.0f}' if row[x] else '' for x in ('p50', 'p99')), row['lost']])
    return ('CPU time of the whole process, and the time from before a crank message is published '
            'until its last joint states are received. Ratios are medians over the rounds, to the '
            'floor; those of nodes that publish nothing to the subscriber that does nothing.\n\n'
            + table(['all topics subscribed', 'CPU a message [us]', 'of one core [%]', 'x floor',
                     'p50 [us]', 'p99 [us]', 'lost'], lines))


def bodies(scenes):
    """Return what a callback takes."""
    lines = []
    for name, found in scenes.items():
        ticks = {row['subject']: row['ticks'] for row in found['bodies']}
        lines += [[f'{name}: {NAMES[row["subject"]]}', f'{row["tick"]:.0f}',
                   f'{ratio(row["ticks"], ticks["floor"]):.2f}'] for row in found['bodies']]
    return ('CPU time of its thread, one message after the other in one process.\n\n'
            + table(['in a loop', 'callback [us]', 'x floor'], lines))


def change(pieces):
    """Return how long poses are held up by a change, and what it takes of the executor."""
    lines = [[f'{row["kind"]}{WITHOUT * name.endswith(WITHOUT)}',
              *(f'{row[x]:.1f}' if x in row else '' for x in (
                  'gap', 'longest', 'answered', 'validated', 'executor', 'delay')),
              row.get('lost', '')] for name, found in pieces.items() for row in found]
    return ('12 legs at 500 Hz: the longest time between two poses around a change, its median '
            'and the longest, when the change was answered, the CPU time of the executor until '
            'then and until all is published [ms]. At 200 Hz: the longest delay of a message, its '
            'median [ms], and how many were lost.\n\n' + table(
                ['change', 'gap', 'longest', 'answered after', 'validated', 'published',
                 'delay', 'lost'], lines))
