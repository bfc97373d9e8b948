# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Tables of the results, {piece: what it found, on which machine}."""

import statistics

from ..document import table

WITHOUT = ', without llvmlite'
# What stands beside `kinematics` with all topics subscribed.
NAMES = {'kinematics': '', 'relay': ', relay', 'joints': ', joint states alone',
         'unheard': ', nobody listens'}
# What a node that publishes nothing is compared with.
BASE = {'unheard': 'deaf'}


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
        rows = {(row['rate'], row['subject']): row for row in found['rows']}
        for (rate, subject), row in rows.items():
            if subject in NAMES:
                base = rows[rate, BASE.get(subject, 'floor')]
                lines.append([
                    f'{name}, {rate:.0f} Hz{NAMES[subject]}', f'{row["cpu"]:.0f}',
                    f'{base["cpu"]:.0f}', f'{ratio(row["cpus"], base["cpus"]):.2f}',
                    *(f'{each[x]:.0f}' if each[x] else '' for x in ('p50', 'p99')
                      for each in (row, base)), row['lost'], base['lost']])
    return ('CPU time of the whole process, and the time from before a crank message is published '
            'until its last joint states are received; beside each the floor, where nobody '
            'listens the subscriber that does nothing. Ratios are medians over the rounds.\n\n'
            + table(['all topics subscribed', 'CPU a message [us]', 'floor', 'x floor', 'p50 [us]',
                     'floor', 'p99 [us]', 'floor', 'lost', 'floor'], lines))


def bodies(scenes):
    """Return what a callback takes."""
    lines = []
    for name, found in scenes.items():
        rows = {row['subject']: row for row in found['bodies']}
        floor = rows.pop('floor')
        lines += [[f'{name}{NAMES[subject]}', f'{row["tick"]:.0f}', f'{floor["tick"]:.0f}',
                   f'{ratio(row["ticks"], floor["ticks"]):.2f}'] for subject, row in rows.items()]
    return ('CPU time of its thread, one message after the other in one process.\n\n'
            + table(['in a loop', 'callback [us]', 'floor', 'x floor'], lines))


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
