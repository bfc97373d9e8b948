# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Tables from the results."""

import statistics

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
CPU = 1.15


def in_short(result):
    """Return what a scene costs, and what else a user wants to know of it, as Markdown."""
    if 'rows' not in result:
        return ''
    rows = result['rows']
    columns, scenes = rates(rows), list(dict.fromkeys(row['scene'] for row in rows))
    cpu = {(row['scene'], row['subject'], row['rate']): row['cpu'] for row in rows}
    shown = [(scene, scene, 'kinematics', 'floor') for scene in scenes]
    shown += [(f'{WALKER}, {what}', WALKER, subject, other) for what, subject, other in (
        ('joint states alone', 'joints', None), ('nobody listens', 'unheard', 'deaf'))]
    lines = [[name, *(_share(cpu, (scene, subject, rate), (scene, other, rate))
                      for rate in columns)] for name, scene, subject, other in shown
             if any((scene, subject, rate) in cpu for rate in columns)]
    delays = [row['p50'] for row in rows if row['subject'] == 'kinematics' and row['p50']]
    told = [table(['part of one core [%]', *(f'{rate:.0f} Hz' for rate in columns)], lines), '',
            "- **From an encoder's message to the last joint** pass "
            f'{1e-3 * min(delays):.1f} to {1e-3 * max(delays):.1f} ms (medians), both ways '
            'through the middleware included.']
    if 'soak' in result:
        soak = result['soak']
        told.append(f'- **Memory**: {soak["resident_mib"]:.0f} MiB for 12 legs with machine code; '
                    f'it grew by {soak["growth_mib"]:.1f} MiB over {soak["messages"]:,} messages.')
    if 'processes' in result:
        three, one = ([row for row in result['processes'] if row['kind'] == kind]
                      for kind in ('apart', 'together'))
        cpus, sizes = (statistics.median(in_turn(a[what], b[what]) for a, b in zip(one, three))
                       for what in ('cpu', 'memory'))
        told.append(f'- **Run `scene`**, all nodes in one process: {cpus:.2f} of the CPU of three '
                    f'processes and {sizes:.2f} of their memory.')
    if 'yardstick' in result:
        told.append('- **On another processor** take the time of `python -m timeit '
                    f'"{YARDSTICK}"`; here it is {result["yardstick"]:.0f} us.')
    return '\n'.join(told)


def _share(cpu, own, other):
    """Return parts of one core [%], the own and in brackets the other's; nothing where not run."""
    parts = [f'{1e-4 * cpu[key] * key[-1]:.2g}' for key in (own, other) if key in cpu]
    return parts[0] + (f' ({parts[1]})' if parts[1:] else '') if own in cpu else ''


def document(result):
    """Return all tables as Markdown."""
    parts = []
    if 'rows' in result:
        machine = result['machine']
        packages = ', '.join(f'{name} {number}' for name, number in machine['packages'].items())
        parts += [
            f'{machine["date"]}, {machine["cpu"]}, {result["cores"]} cores, load '
            f'{result["load"]:.1f}; Python {machine["python"]}, {packages}; commit '
            f'{machine["commit"]}. The run took {result["seconds"]} s.',
            '### Targets', beside_the_floor(result), targets(result),
            '### CPU time and latency', costs(result['rows']),
            '### Executors', executors(result['rows']),
            '### Where the time goes', layers(result),
            '### Body of the tick', bodies(result),
            '### Service', services(result['services'])]
    if 'processes' in result:
        parts += ['### One process or three', processes(result['processes'])]
    if 'drivers' in result:
        parts += ['### The driver alone', drivers(result['drivers'])]
    if 'stream' in result:
        parts += ['### Commands', stream(result['stream'])]
    if 'changes' in result:
        parts += ['### Changes', changes(result['changes'])]
    if 'growth' in result:
        parts += ['### Growth', growth(result['growth'])]
    if {'soak', 'hold', 'trouble'} & result.keys():
        parts += ['### At length', long(result)]
    return '\n\n'.join(parts) + '\n'


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
    rows, lines = result['rows'], []
    ticks = {(body['scene'], body['subject']): body['ticks'] for body in result['bodies']}
    columns = rates(rows)
    for scene in dict.fromkeys(row['scene'] for row in rows):
        body = in_turn(ticks[scene, 'kinematics'], ticks[scene, 'floor'])
        measured = {row['rate'] for row in rows if row['scene'] == scene}
        lines.append([scene, f'<= {BODIES[scene]}', within(body, BODIES[scene]), *(
            within(ratio(rows, scene, rate, 'kinematics', 'floor'), CPU) if rate in measured
            else beyond(rows, scene, rate) for rate in columns)])
    return table(['x floor (a)', 'body of the tick: target', 'measured', *(
        f'CPU a message, {rate:.0f} Hz: <= {CPU}' for rate in columns)], lines)


def beyond(rows, scene, rate):
    """Return what part of one core the floor alone would take at a rate that is too high."""
    most = max((row for row in rows if row['scene'] == scene and row['subject'] == 'floor'),
               key=lambda row: row['rate'])
    if rate < most['rate']:
        return ''
    return f'not run: the floor alone takes {1e-4 * most["cpu"] * rate:.0f} % of a core'


def within(value, limit):
    """Return a ratio, and mark it where it is above its limit."""
    return f'{value:.2f}' if value <= limit else f'**{value:.2f}**'


def targets(result):
    """Return what else was aimed at, and what came of it."""
    rows, lines = result['rows'], []
    tick = {(body['scene'], body['subject']): body for body in result['bodies']}
    for rate in rates(rows, WALKER):
        nobody = ratio(rows, WALKER, rate, 'unheard', 'deaf')
        lines.append([f'12 legs, no subscriber (d) / does nothing, {rate:.0f} Hz', '<= 1.1',
                      f'{nobody:.2f}', met(nobody, 1.1)])
    body = tick[WALKER, 'kinematics']['ticks']
    times = in_turn(tick[WALKER, 'fresh']['ticks'], body)
    a_leg = 12 * statistics.median(tick['one leg', 'relay']['ticks']) / statistics.median(body)
    lines += [['12 legs, body with ordinary messages (b) / body', '>= 10', f'{times:.1f}',
               met(times, -10.0)],
              ['body of the relay (c) / body a leg of 12', '>= 20', f'{a_leg:.0f}',
               met(a_leg, -20.0)]]
    lines += service_targets(result['services'])
    lines += process_targets(result['processes']) if 'processes' in result else []
    lines += driver_targets(result['drivers']) if 'drivers' in result else []
    starts = result['starts']
    start = statistics.median(starts['kinematics'])
    lines += [['12 legs, start to first joint states', '< 1.5 s',
               f'{_seconds(starts["kinematics"])} (floor: {_seconds(starts["floor"])}; '
               f'to make the node and end: {_seconds(starts["made"])})', met(start, 1.5)]]
    for soak in [result['soak']] if 'soak' in result else []:
        lines += [[f'12 legs, growth over {soak["messages"]:,} messages', '<= 2 MiB',
                   f'{soak["span_mib"]:.2f} MiB', met(soak['span_mib'], 2.0)],
                  ['the same, messages lost', '0', soak['lost'], met(soak['lost'], 0)]]
    for hold in result.get('hold', ()):
        lines += [[f'{hold["scene"]}, {hold["rate"]:.0f} Hz for {hold["seconds"]:.0f} s, messages '
                   'lost', '0', hold['lost'], met(hold['lost'], 0)]]
    return table(['all topics subscribed', 'target', 'measured', 'met'], lines)


def service_targets(rows):
    """Return what was aimed at for the service, and what came of it."""
    found, lines = {row['subject']: row for row in rows}, []
    for subject, other, limit in (('servo 1', 'trigger', 1.15), ('servo 1000', 'echo 1000', 1.3)):
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


def costs(rows):
    """Return CPU time a message and latencies of every subject."""
    lines = []
    for row in rows:
        if row['subject'].endswith('_plain'):
            continue
        base = 'deaf' if row['subject'] in ('unheard', 'deaf') else 'floor'
        times = ratio(rows, row['scene'], row['rate'], row['subject'], base)
        lines.append([
            row['scene'], f'{row["rate"]:.0f}', NAMES[row['subject']], f'{row["cpu"]:.0f}',
            f'{times:.2f}', *_latency(row), row['lost']])
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
    lines = []
    for part in result['parts']:
        whole = next(row['cpu'] for row in result['rows'] if row['subject'] == part['subject']
                     and (row['scene'], row['rate']) == (part['scene'], part['rate']))
        lines.append([f'{part["rate"]:.0f}', NAMES[part['subject']], *(f'{time:.0f}' for time in (
            whole, part['tick'], part['publish'], part['tick'] - part['publish']))])
    return ('CPU time [us a message]; the tick is the callback, the rest of a message is the '
            'middleware, wake-up and what is shared by all.\n\n' + table(
                ['12 legs, Hz', 'node', 'all', 'tick', 'of it publishing', 'the rest of it'],
                lines))


def bodies(result):
    """Return what the callbacks take."""
    return ("CPU time of the callback's thread, medians: one tick after the other in one process, "
            'nothing between them [us].\n\n' + table(['in a loop', 'node', 'tick', 'x floor'], [
                [body['scene'], NAMES[body['subject']], f'{body["tick"]:.0f}',
                 f'{in_turn(body["ticks"], floor["ticks"]):.2f}']
                for body in result['bodies'] for floor in result['bodies']
                if floor['subject'] == 'floor' and floor['scene'] == body['scene']]))


def services(rows):
    """Return round trips."""
    found = {row['subject']: row for row in rows}
    lines = []
    for subject, row in found.items():
        echo = found[f'echo {subject.split()[-1]}' if ' ' in subject else subject]
        lines.append([SERVICES[subject], f'{row["p50"]:.0f}', f'{row["p99"]:.0f}', *(
            f'{in_turn(row["round_trips"], base["round_trips"]):.2f}'
            for base in (found['trigger'], echo)), f'{row["cpu"]:.0f}', *(
            f'{in_turn(row["cpus"], base["cpus"]):.2f}' for base in (found['trigger'], echo))])
    return table(['service', 'p50 [us]', 'p99 [us]', 'x Trigger', 'x its echo',
                  'CPU of the server [us]', 'x Trigger', 'x its echo'], lines)


def processes(rows):
    """Return what a scene costs in one process, in three, and what any process costs."""
    lines = []
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


def drivers(rows):
    """Return what the driver of a scene costs."""
    lines = [[own['scene'], f'{own["rate"]:.0f}', *(
        f'{statistics.median(row["cpu"]):.0f}' for row in (own, timed)),
        f'{in_turn(own["cpu"], timed["cpu"]):.2f}'] for own, timed in zip(rows[::2], rows[1::2])]
    return ('`crank_driver` beside a bare timer that publishes ready bytes, both heard: CPU time '
            'of the process [us a message].\n\n' + table(
                ['scene', 'Hz', 'crank_driver', 'timer', 'ratio'], lines))


def stream(rows):
    """Return what commands cost."""
    lines = [[own['wanted'], f'{own["rate"]:.0f}', f'{statistics.median(own["cpus"]):.0f}',
              f'{in_turn(own["cpus"], floor["cpus"]):.2f}']
             for own, floor in zip(rows[::2], rows[1::2])]
    return ('`servo_inverse` turns `wanted_states` into `servo_commands`: CPU time of the process '
            '[us a command], and as a ratio to a bare node that sends as many ready bytes.\n\n'
            + table(['wanted', 'Hz', 'CPU', 'x floor'], lines))


def changes(rows):
    """Return how long poses are held up by a change."""
    return ('12 legs at 500 Hz: the longest time between two poses around a change, its median '
            'and the longest, and when the change was answered [ms].\n\n' + table(
                ['change', 'gap', 'longest', 'answered after'],
                [[row['kind'], *(f'{row[name]:.1f}' for name in ('gap', 'longest', 'answered'))]
                 for row in rows]))


def grown(rows):
    """Return the rows of both nodes that grow, scene by scene."""
    found = {(row['scene'], row['subject']): row for row in rows}
    return [(row, found[row['scene'], BARE]) for row in rows if row['subject'] == KINEMATICS]


def growth(rows):
    """Return what a scene costs as it grows."""
    lines = []
    for own, bare in grown(rows):
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
    if 'hold' in result:
        parts.append(table(
            ['hold', 'Hz', 'seconds', 'changes', 'lost', 'CPU [us a message]', 'p50', 'p99',
             'longest', 'load'],
            [[hold['scene'], f'{hold["rate"]:.0f}', f'{hold["took"]:.0f}', hold['changes'],
              hold['lost'], f'{hold["cpu"]:.0f}', *_latency(hold),
              f'{hold["longest"]:.0f}' if hold['longest'] else '', f'{hold["load"]:.1f}']
             for hold in result['hold']]))
    runs = []
    if 'soak' in result:
        soak = result['soak']
        runs.append([f'soak: {soak["messages"]:,} messages, as fast as they are answered',
                     f'{soak["took"]:.0f}', soak['changes'], soak['lost'], *_memory(soak)])
    if 'trouble' in result:
        one = result['trouble']
        runs.append(['500 Hz, bad bytes each second, listeners that stall', one['seconds'],
                     one['seconds'], '', *_memory(one)])
    if runs:
        parts.append(table(['12 legs', 'seconds', 'changes', 'lost', 'MiB', 'first to last',
                            'span'], runs))
    return '\n\n'.join(parts)


def _memory(run):
    return (f'{run["resident_mib"]:.0f}',
            *(f'{run[name]:+.2f}' for name in ('growth_mib', 'span_mib')))
