# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Tables from the results: of each column, with machine code and without llvmlite, its pieces."""

import statistics

NATIVE, PLAIN = COLUMNS = 'machine code', 'plain Python'
WITHOUT = 'without llvmlite'
WALKER = '12 legs'
# What tells how fast Python runs.
YARDSTICK = 'sum(range(100000))'
# The nodes that grow.
KINEMATICS, BARE = 'kinematics', 'bare'
NAMES = {
    'kinematics': 'kinematics', 'floor': 'floor (a): as many ready bytes',
    'fresh': 'ordinary messages (b)', 'relay': 'numerical relay (c), one leg, joint states',
    'joints': 'kinematics, joint states alone',
    'unheard': 'kinematics, no subscriber (d)', 'deaf': 'subscriber that does nothing'}
SERVICES = {
    'trigger': 'std_srvs/Trigger', 'echo 1': 'ServoInverse, 1 angle, echoed',
    'servo 1': 'servo_inverse, 1 angle', 'echo 1000': 'ServoInverse, 1000, echoed',
    'servo 1000': 'servo_inverse, 1000 angles'}
# What is aimed at as a multiple of the floor: the body of a tick by scene, and CPU a message.
BODIES = {'one leg': 1.5, '12 legs': 1.5, 'four mechanisms': 1.3, 'sixty mechanisms': 1.3}
CPU = 1.0
# The longest gap around a change, the answer to a request of a hundred sets [ms], and the start of
# 64 mechanisms by that of a bare node: a fifth more than it was.
GAP, HUNDRED, START = 15.0, 30.0, 1.24
# What a change may take of the executor [ms], by its kind.
CHANGED = {'dimension': 3.0, 'points': 1.0, 'pose': 1.0, 'frame_id': 1.0}


def found(result, column, name):
    """Return what a piece of a column has found, nothing if it was not run."""
    return result.get(column, {}).get(name, {}).get('found', [])


def of_scenes(result, column, what):
    """Return the rows or the bodies of all scenes."""
    return [row for scene in BODIES for row in dict(found(result, column, scene)).get(what, ())]


def of_processes(result, what):
    """Return the rows of all scenes that were run in one process and in three."""
    return [row for name, piece in result.get(NATIVE, {}).items()
            if name.startswith('processes') for row in piece['found'][what]]


def in_short(result):
    """Return what a scene costs, and what else a user wants to know of it, as Markdown."""
    rows, plain = (of_scenes(result, column, 'rows') for column in COLUMNS)
    if not rows:
        return ''
    columns, scenes = rates(rows), list(dict.fromkeys(row['scene'] for row in rows))
    cpu, slow = ({(row['scene'], row['subject'], row['rate']): row['cpu'] for row in each}
                 for each in (rows, plain))
    shown = [(f'{scene}{more}', each, scene, 'kinematics', 'floor') for more, each in (
        ('', cpu), (f', {WITHOUT}', slow)) for scene in scenes]
    shown += [(f'{WALKER}, {what}', cpu, WALKER, subject, other) for what, subject, other in (
        ('joint states alone', 'joints', None), ('nobody listens', 'unheard', 'deaf'))]
    lines = [[name, *(_share(each, (scene, subject, rate), (scene, other, rate))
                      for rate in columns)] for name, each, scene, subject, other in shown
             if any((scene, subject, rate) in each for rate in columns)]
    delays = [row['p50'] for row in rows if row['subject'] == 'kinematics' and row['p50']]
    told = [table(['part of one core [%]', *(f'{rate:.0f} Hz' for rate in columns)], lines), '',
            "- **From an encoder's message to the last joint** pass "
            f'{1e-3 * min(delays):.1f} to {1e-3 * max(delays):.1f} ms (medians), both ways '
            'through the middleware included.']
    for what, soak in (('with machine code', found(result, NATIVE, 'soak')),
                       (WITHOUT, found(result, PLAIN, 'soak'))):
        if soak:
            told.append(f'- **Memory**: {soak["resident_mib"]:.0f} MiB for 12 legs {what}; it '
                        f'grew by {soak["growth_mib"]:.1f} MiB over {soak["messages"]:,} '
                        'messages.')
    if compared := of_processes(result, 'processes'):
        three, one = ([row for row in compared if row['kind'] == kind]
                      for kind in ('apart', 'together'))
        cpus, sizes = (statistics.median(in_turn(a[what], b[what]) for a, b in zip(one, three))
                       for what in ('cpu', 'memory'))
        told.append(f'- **Run `scene`**, all nodes in one process: {cpus:.2f} of the CPU of three '
                    f'processes and {sizes:.2f} of their memory.')
    yardstick = min(piece['yardstick'] for piece in result[NATIVE].values())
    told.append('- **On another processor** take the time of `python -m timeit '
                f'"{YARDSTICK}"`; here it is {yardstick:.0f} us.')
    return '\n'.join(told)


def _share(cpu, own, other):
    """Return parts of one core [%], the own and in brackets the other's; nothing where not run."""
    parts = [f'{1e-4 * cpu[key] * key[-1]:.2g}' for key in (own, other) if key in cpu]
    return parts[0] + (f' ({parts[1]})' if parts[1:] else '') if own in cpu else ''


def document(result):
    """Return all tables as Markdown."""
    parts = []
    if rows := of_scenes(result, NATIVE, 'rows'):
        parts = [_measured_on(result), '### Targets', beside_the_floor(result), targets(result),
                 '### CPU time and latency', costs(result), '### Executors', executors(rows)]
        if found(result, NATIVE, 'layers'):
            parts += ['### Where the time goes', layers(result)]
        parts += ['### Body of the tick', bodies(result)]
    for title, make, is_there in (
            ('Service', services, found(result, NATIVE, 'services')),
            ('Starts', starts, found(result, NATIVE, 'starts')),
            ('One process or three', processes, of_processes(result, 'processes')),
            ('The driver alone', drivers, of_processes(result, 'drivers')),
            ('Commands', stream, found(result, NATIVE, 'stream')),
            ('Changes', changes, found(result, NATIVE, 'changes')),
            ('Growth', growth, found(result, NATIVE, 'growth')),
            ('At length', long, any(found(result, NATIVE, name)
                                    for name in ('soak', 'hold', 'trouble')))):
        if is_there:
            parts += [f'### {title}', make(result)]
    return '\n\n'.join(parts) + '\n'


def _measured_on(result):
    pieces = [piece for column in COLUMNS for piece in result.get(column, {}).values()]
    machine, loads = pieces[-1]['machine'], [piece['load'] for piece in pieces]
    packages = ', '.join(f'{name} {number}' for name, number in machine['packages'].items())
    commits, dates = (', '.join(sorted({piece['machine'][key] for piece in pieces}))
                      for key in ('commit', 'date'))
    return (f'{dates}, {machine["cpu"]}, {pieces[-1]["cores"]} cores, load {min(loads):.1f} to '
            f'{max(loads):.1f}; Python {machine["python"]}, {packages}; commit {commits}.\n\n'
            'Times are medians over the rounds. A ratio is the median over the rounds of the '
            'ratio within a round, so it may differ from the quotient of the two times beside it. '
            'Rows without llvmlite are of runs of their own, and their ratios are to the floor of '
            'these. The pieces ran at different times, so the time of one thing differs from '
            'table to table.')


def table(head, rows):
    """Return a table."""
    lines = [head, ['---'] + ['---:'] * (len(head) - 1), *rows]
    return '\n'.join('| ' + ' | '.join(map(str, line)) + ' |' for line in lines)


def ratio(rows, scene, rate, subject, other):
    """Return the median over the rounds of the ratio of two subjects' CPU times."""
    found = {row['subject']: row['cpus'] for row in rows
             if (row['scene'], row['rate']) == (scene, rate)}
    return in_turn(found[subject], found[other])


def in_turn(values, others):
    """Return the median over the rounds of the ratio within a round."""
    return statistics.median(a / b for a, b in zip(values, others))


def rates(rows, scene=None):
    """Return the rates that were measured, of one scene or of all."""
    return sorted({row['rate'] for row in rows if scene in (None, row['scene'])})


def beside_the_floor(result):
    """Return what a tick and a message cost as multiples of the floor, and what was aimed at."""
    lines = []
    columns = rates(of_scenes(result, NATIVE, 'rows'))
    for column in COLUMNS:
        rows = of_scenes(result, column, 'rows')
        ticks = {(body['scene'], body['subject']): body['ticks']
                 for body in of_scenes(result, column, 'bodies')}
        for scene in dict.fromkeys(row['scene'] for row in rows):
            measured, cpu = rates(rows, scene), CPU if scene != 'sixty mechanisms' else None
            if column == PLAIN:
                body, cpu = None, None
            else:
                body = BODIES[scene]
            lines.append([
                f'{scene}, {WITHOUT}' if column == PLAIN else scene, f'<= {body}' if body else '',
                within(in_turn(ticks[scene, 'kinematics'], ticks[scene, 'floor']), body),
                f'<= {cpu}' if cpu else '', *(
                    within(ratio(rows, scene, rate, 'kinematics', 'floor'), cpu)
                    if rate in measured else beyond(rows, scene, rate) for rate in columns)])
    return table(['x floor (a)', 'body of the tick: target', 'measured',
                  'CPU a message: target', *(f'{rate:.0f} Hz' for rate in columns)], lines)


def beyond(rows, scene, rate):
    """Return what part of one core the floor alone would take at a rate that is too high."""
    most = max((row for row in rows if row['scene'] == scene and row['subject'] == 'floor'),
               key=lambda row: row['rate'])
    if rate < most['rate']:
        return ''
    return f'not run: the floor alone takes {1e-4 * most["cpu"] * rate:.0f} % of a core'


def within(value, limit):
    """Return a ratio, and mark it where it is above its limit."""
    return f'{value:.2f}' if limit is None or value <= limit else f'**{value:.2f}**'


def targets(result):
    """Return what else was aimed at, and what came of it."""
    rows, lines = of_scenes(result, NATIVE, 'rows'), []
    tick = {(body['scene'], body['subject']): body['ticks']
            for body in of_scenes(result, NATIVE, 'bodies')}
    for rate in rates(rows, WALKER):
        nobody = ratio(rows, WALKER, rate, 'unheard', 'deaf')
        lines.append([f'12 legs, no subscriber (d) / does nothing, {rate:.0f} Hz', '<= 1.1',
                      f'{nobody:.2f}', met(nobody, 1.1)])
    if {(WALKER, 'fresh'), ('one leg', 'relay')} <= tick.keys():
        body = tick[WALKER, 'kinematics']
        times = in_turn(tick[WALKER, 'fresh'], body)
        a_leg = 12 * statistics.median(tick['one leg', 'relay']) / statistics.median(body)
        lines += [['12 legs, body with ordinary messages (b) / body', '>= 10', f'{times:.1f}',
                   met(times, -10.0)],
                  ['body of the relay (c) / body a leg of 12', '>= 20', f'{a_leg:.0f}',
                   met(a_leg, -20.0)]]
    for make, part in ((process_targets, of_processes(result, 'processes')),
                       (driver_targets, of_processes(result, 'drivers')),
                       (growth_targets, found(result, NATIVE, 'growth'))):
        lines += make(part) if part else []
    for column in COLUMNS:
        more = f', {WITHOUT}' if column == PLAIN else ''
        for make, name in ((service_targets, 'services'), (change_targets, 'changes'),
                           (start_targets, 'starts'), (soak_targets, 'soak'),
                           (hold_targets, 'hold')):
            part = found(result, column, name)
            lines += [[f'{what}{more}', *line] for what, *line in (make(part) if part else ())]
    return table(['all topics subscribed', 'target', 'measured', 'met'], lines)


def change_targets(rows):
    """Return what was aimed at for changes, and what came of it."""
    # Not of the requests that come in a heap: each of them is a change.
    longest = max((row for row in rows if row['kind'] not in ('none', '100 requests')),
                  key=lambda row: row['gap'])
    lines = [[f'longest gap around one request, median ({longest["kind"]})', f'<= {GAP:.0f} ms',
              f'{longest["gap"]:.1f} ms', met(longest['gap'], GAP)]]
    for row in rows:
        if row['kind'] == '100 in one request':
            lines += [['a hundred sets in one request', f'<= {HUNDRED:.0f} ms',
                       f'{row["answered"]:.1f} ms', met(row['answered'], HUNDRED)]]
        if row['kind'] in CHANGED and 'validated' in row:
            lines += [[f'CPU time of the executor until a {row["kind"]} is answered',
                       f'<= {CHANGED[row["kind"]]:.0f} ms', f'{row["validated"]:.2f} ms',
                       met(row['validated'], CHANGED[row['kind']])]]
    delays = {row['kind']: row for row in rows if 'delay' in row}
    if delays:
        none, hundred = delays['none'], delays['100 requests']
        lines += [['longest delay of a message at 200 Hz by 100 requests at once, median',
                   f'<= {HUNDRED:.0f} ms', f'{hundred["delay"]:.1f} ms (without any: '
                   f'{none["delay"]:.1f} ms)', met(hundred['delay'], HUNDRED)],
                  ['the same, messages lost', '0', hundred['lost'], met(hundred['lost'], 0)]]
    return lines


def growth_targets(rows):
    """Return what was aimed at for the start of many mechanisms, and what came of it."""
    return [[f'{own["scene"]}, start / bare node', f'<= {START}' if '64' in own['scene'] else '',
             f'{value:.2f}', met(value, START) if '64' in own['scene'] else '']
            for own, bare in grown(rows) if own['scene'].startswith(('64 ', '1000 '))
            for value in [in_turn(own['start'], bare['start'])]]


def start_targets(scenes):
    """Return what was aimed at for a start, and what came of it."""
    return [[f'{scene}, start to first joint states', '< 1.5 s' if scene == WALKER else '',
             f'{_seconds(found["kinematics"])} (floor: {_seconds(found["floor"])}; to make the '
             f'node and end: {_seconds(found["made"])})',
             met(statistics.median(found['kinematics']), 1.5) if scene == WALKER else '']
            for scene, found in scenes.items()]


def soak_targets(soak):
    """Return what was aimed at over many messages, and what came of it."""
    return [[f'12 legs, growth over {soak["messages"]:,} messages', '<= 2 MiB',
             f'{soak["span_mib"]:.2f} MiB', met(soak['span_mib'], 2.0)],
            ['the same, messages lost', '0', soak['lost'], met(soak['lost'], 0)]]


def hold_targets(holds):
    """Return what was aimed at for a minute with changes, and what came of it."""
    return [[f'{hold["scene"]}, {hold["rate"]:.0f} Hz for {hold["seconds"]:.0f} s, messages lost',
             '0', hold['lost'], met(hold['lost'], 0)] for hold in holds]


def service_targets(rows):
    """Return what was aimed at for the service, and what came of it."""
    found, lines = {row['subject']: row for row in rows}, []
    for subject, other, limit in (('servo 1', 'echo 1', 1.15), ('servo 1000', 'echo 1000', 1.3)):
        times, cpu = (in_turn(found[subject][what], found[other][what])
                      for what in ('round_trips', 'cpus'))
        words = f'{SERVICES[subject]} / {SERVICES[other]}'
        lines += [[f'{words}, p50', f'<= {limit}', f'{times:.2f}', met(times, limit)],
                  [f'{words}, CPU of the server', f'<= {limit}', f'{cpu:.2f}', met(cpu, limit)]]
    return lines


def process_targets(rows):
    """Return what was aimed at for one process, and what came of it at worst."""
    lines, starts = [], [[start for row in rows if row['kind'] == kind for start in row['start']]
                         for kind in ('together', 'floor')]
    for what, words, limit in (('cpu', 'CPU', 0.55), ('memory', 'memory', 0.6)):
        most = max(in_turn(together[what], apart[what])
                   for apart, together, _ in zip(*3 * [iter(rows)]))
        lines.append([f'one process / three, {words}, at most', f'<= {limit}', f'{most:.2f}',
                      met(most, limit)])
    later = statistics.median(starts[0]) / statistics.median(starts[1])
    return [*lines, ['start of one process / floor', '<= 1', f'{later:.2f}', met(later, 1.0)]]


def driver_targets(rows):
    """Return what was aimed at for `crank_driver`, and what came of it at worst."""
    most = max(in_turn(own['cpu'], timed['cpu']) for own, timed in zip(rows[::2], rows[1::2]))
    return [['crank_driver / timer that publishes ready bytes, CPU, at most', '<= 1.15',
             f'{most:.2f}', met(most, 1.15)]]


def met(value, limit):
    """Return whether a value is below its limit, or above one that is given as negative."""
    return 'yes' if (value >= -limit if limit < 0.0 else value <= limit) else '**no**'


def costs(result):
    """Return CPU time a message and latencies of every subject."""
    lines = []
    for column in COLUMNS:
        rows = of_scenes(result, column, 'rows')
        for row in rows:
            if row['subject'].endswith('_plain') or (
                    column == PLAIN and row['subject'] != KINEMATICS):
                continue
            base = 'deaf' if row['subject'] in ('unheard', 'deaf') else 'floor'
            times = ratio(rows, row['scene'], row['rate'], row['subject'], base)
            lines.append([
                row['scene'], f'{row["rate"]:.0f}',
                NAMES[row['subject']] + (f', {WITHOUT}' if column == PLAIN else ''),
                f'{row["cpu"]:.0f}', f'{times:.2f}', *_latency(row), row['lost']])
    return ('CPU time of the whole process [us a message], as a ratio to the floor (for those '
            'that do not publish: to the subscriber that does nothing), and the time from sending '
            'a crank message to having its last joint states [us].\n\n' + table(
                ['scene', 'Hz', 'node', 'CPU', 'ratio', 'p50', 'p99', 'lost'], lines))


def _seconds(times):
    return f'{statistics.median(times):.2f} s, at best {min(times):.2f} s'


def _latency(row):
    return [f'{row[p]:.0f}' if row[p] is not None else '' for p in ('p50', 'p99')]


def executors(rows):
    """Return what the plain executor costs next to the one that waits for events."""
    lines = []
    for rate in rates(rows, WALKER):
        found = {r['subject']: r for r in rows if (r['scene'], r['rate']) == (WALKER, rate)}
        events, plain = found['kinematics'], found['kinematics_plain']
        lines.append([f'{rate:.0f}', f'{events["cpu"]:.0f}', f'{plain["cpu"]:.0f}',
                      f'{ratio(rows, WALKER, rate, "kinematics_plain", "kinematics"):.2f}',
                      *_latency(events), *_latency(plain)])
    return table(['12 legs, Hz', 'Events CPU', 'Single CPU', 'ratio', 'Events p50', 'p99',
                  'Single p50', 'p99'], lines)


def layers(result):
    """Return what publishing is of a tick, and a tick of a message, at each rate."""
    lines, rows = [], of_scenes(result, NATIVE, 'rows')
    for part in found(result, NATIVE, 'layers'):
        whole = next(row['cpu'] for row in rows if row['subject'] == part['subject']
                     and (row['scene'], row['rate']) == (part['scene'], part['rate']))
        lines.append([f'{part["rate"]:.0f}', NAMES[part['subject']], *(f'{time:.0f}' for time in (
            whole, part['tick'], part['publish'], part['tick'] - part['publish']))])
    return ('CPU time [us a message]; the tick is the callback, the rest of a message is the '
            'middleware, wake-up and what is shared by all.\n\n' + table(
                ['12 legs, Hz', 'node', 'all', 'tick', 'of it publishing', 'the rest of it'],
                lines))


def bodies(result):
    """Return what the callbacks take."""
    lines = []
    for column in COLUMNS:
        measured = of_scenes(result, column, 'bodies')
        floors = {body['scene']: body for body in measured if body['subject'] == 'floor'}
        lines += [[body['scene'], NAMES[body['subject']] + (
            f', {WITHOUT}' if column == PLAIN else ''), f'{body["tick"]:.0f}',
            f'{in_turn(body["ticks"], floors[body["scene"]]["ticks"]):.2f}'] for body in measured
            if column == NATIVE or body['subject'] == KINEMATICS]
    return ("CPU time of the callback's thread, medians: one tick after the other in one process, "
            'nothing between them [us].\n\n' + table(
                ['in a loop', 'node', 'tick', 'x floor'], lines))


def services(result):
    """Return round trips."""
    lines = []
    for column in COLUMNS:
        rows = {row['subject']: row for row in found(result, column, 'services')}
        for subject, row in rows.items():
            if column == PLAIN and not subject.startswith('servo'):
                continue
            echo = rows[f'echo {subject.split()[-1]}' if ' ' in subject else subject]
            lines.append([
                SERVICES[subject] + (f', {WITHOUT}' if column == PLAIN else ''),
                f'{row["p50"]:.0f}', f'{row["p99"]:.0f}', *(
                    f'{in_turn(row["round_trips"], base["round_trips"]):.2f}'
                    for base in (rows['trigger'], echo)), f'{row["cpu"]:.0f}', *(
                    f'{in_turn(row["cpus"], base["cpus"]):.2f}'
                    for base in (rows['trigger'], echo))])
    return table(['service', 'p50 [us]', 'p99 [us]', 'x Trigger', 'x its echo',
                  'CPU of the server [us]', 'x Trigger', 'x its echo'], lines)


def starts(result):
    """Return what starts take."""
    return ('From the start of a process to its first joint states, median and best [s]; made: '
            'to make the node and end.\n\n' + table(
                ['scene', 'node', 'kinematics', 'best', 'floor', 'best', 'ratio', 'made'],
                [[scene, column, *(f'{value:.2f}' for value in (
                    *(part(own[kind]) for kind in ('kinematics', 'floor')
                      for part in (statistics.median, min)),
                    in_turn(own['kinematics'], own['floor']), statistics.median(own['made'])))]
                 for column in COLUMNS
                 for scene, own in dict(found(result, column, 'starts')).items()]))


def processes(result):
    """Return what a scene costs in one process, in three, and what any process costs."""
    lines, rows = [], of_processes(result, 'processes')
    for apart, together, floor in zip(*3 * [iter(rows)]):
        line = [apart['scene'], f'{apart["rate"]:.0f}']
        for what, digits in (('cpu', 0), ('memory', 0), ('start', 2)):
            line += [f'{statistics.median(row[what]):.{digits}f}'
                     for row in (floor, apart, together)]
            line.append(f'{in_turn(together[what], apart[what]):.2f}')
        lines.append(line)
    return ('`scene` beside `crank_driver`, `kinematics` and `servo_inverse`, and beside a floor, '
            'a timer that publishes ready joint states; joint states heard: CPU time of all '
            'processes [us a tick], their proportional memory [MiB], seconds from the start to '
            'the first joint states of all; ratios of one to three.\n\n' + table(
                ['scene', 'Hz', 'CPU of floor', 'of three', 'of one', 'ratio', 'memory of floor',
                 'of three', 'of one', 'ratio', 'start of floor', 'of three', 'of one', 'ratio'],
                lines))


def drivers(result):
    """Return what the driver of a scene costs."""
    rows = of_processes(result, 'drivers')
    lines = [[own['scene'], f'{own["rate"]:.0f}', *(
        f'{statistics.median(row["cpu"]):.0f}' for row in (own, timed)),
        f'{in_turn(own["cpu"], timed["cpu"]):.2f}'] for own, timed in zip(rows[::2], rows[1::2])]
    return ('`crank_driver` beside a bare timer that publishes ready bytes, both heard: CPU time '
            'of the process [us a message].\n\n' + table(
                ['scene', 'Hz', 'crank_driver', 'timer', 'ratio'], lines))


def stream(result):
    """Return what commands cost."""
    rows = found(result, NATIVE, 'stream')
    lines = [[own['wanted'], f'{own["rate"]:.0f}', f'{statistics.median(own["cpus"]):.0f}',
              f'{in_turn(own["cpus"], floor["cpus"]):.2f}']
             for own, floor in zip(rows[::2], rows[1::2])]
    return ('`servo_inverse` turns `wanted_states` into `servo_commands`: CPU time of the process '
            '[us a command], and as a ratio to a bare node that sends as many ready bytes.\n\n'
            + table(['wanted', 'Hz', 'CPU', 'x floor'], lines))


def changes(result):
    """Return how long poses are held up by a change."""
    return ('12 legs at 500 Hz: the longest time between two poses around a change, its median '
            'and the longest, when the change was answered, and the CPU time of the executor '
            'until then and until all is published [ms]. A hundred requests are a hundred '
            'changes.\n\n' + table(
                ['change', 'node', 'gap', 'longest', 'answered after', 'validated', 'published'],
                [[row['kind'], column, *(f'{row[name]:.1f}' if name in row else '' for name in (
                    'gap', 'longest', 'answered', 'validated', 'executor'))]
                 for column in COLUMNS for row in found(result, column, 'changes')]))


def grown(rows):
    """Return the rows of both nodes that grow, scene by scene."""
    found = {(row['scene'], row['subject']): row for row in rows}
    return [(row, found[row['scene'], BARE]) for row in rows if row['subject'] == KINEMATICS]


def growth(result):
    """Return what a scene costs as it grows."""
    lines = []
    for own, bare in grown(found(result, NATIVE, 'growth')):
        line = [own['scene'], own['parameters']]
        for what, digits in (('ticks', 0), ('cpu', 0), ('memory', 0), ('begun', 2), ('start', 2)):
            line += [f'{statistics.median(own[what]):.{digits}f}',
                     f'{in_turn(own[what], bare[what]):.2f}']
        lines.append([*line, *(f'{statistics.median(own[what]):.1f}'
                               for what in ('changed', 'held'))])
    return ('![CPU time, memory, start and a change over mechanisms](images/growth.png)\n\n'
            'Joint states of all mechanisms are heard. Body of a tick in a loop and CPU time of '
            'the process [us a message], proportional memory [MiB], CPU time and time of a start '
            'to the first joint states of all [s], each with its ratio to a bare node of as many '
            'publishers, parameters and bytes; the time until a change of a scale is answered, '
            'and how long of that the executor is busy [ms].\n\n' + table(
                ['scene', 'parameters', 'body', 'x bare', 'CPU', 'x bare', 'memory', 'x bare',
                 'CPU of the start', 'x bare', 'start', 'x bare', 'change', 'executor'], lines))


def long(result):
    """Return the long runs."""
    parts = ['A parameter changes each second all the while; a message without an answer is lost.']
    holds = [(column, hold) for column in COLUMNS for hold in found(result, column, 'hold')]
    if holds:
        parts.append(table(
            ['hold', 'node', 'Hz', 'seconds', 'changes', 'lost', 'CPU [us a message]', 'p50',
             'p99', 'longest', 'load'],
            [[hold['scene'], column, f'{hold["rate"]:.0f}', f'{hold["took"]:.0f}',
              hold['changes'], hold['lost'], f'{hold["cpu"]:.0f}', *_latency(hold),
              f'{hold["longest"]:.0f}' if hold['longest'] else '', f'{hold["load"]:.1f}']
             for column, hold in holds]))
    runs = [[f'soak: {soak["messages"]:,} messages, as fast as they are answered', column,
             f'{soak["took"]:.0f}', soak['changes'], soak['lost'], *_memory(soak)]
            for column in COLUMNS if (soak := found(result, column, 'soak'))]
    if one := found(result, NATIVE, 'trouble'):
        runs.append(['500 Hz, bad bytes each second, listeners that stall', NATIVE,
                     one['seconds'], one['seconds'], '', *_memory(one)])
    if runs:
        parts.append(table(['12 legs', 'node', 'seconds', 'changes', 'lost', 'MiB',
                            'first to last', 'span'], runs))
    return '\n\n'.join(parts)


def _memory(run):
    return (f'{run["resident_mib"]:.0f}',
            *(f'{run[name]:+.2f}' for name in ('growth_mib', 'span_mib')))
