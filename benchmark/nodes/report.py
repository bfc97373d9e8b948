# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Tables from the results."""

import statistics

WALKER = '12 legs'
# The nodes that grow.
KINEMATICS, BARE = 'kinematics', 'bare'
NAMES = {
    'kinematics': 'kinematics', 'floor': 'floor (a): as many ready bytes',
    'fresh': 'ordinary messages (b)', 'relay': 'numerical relay (c), one leg, joint states',
    'unheard': 'kinematics, no subscriber (d)', 'deaf': 'subscriber that does nothing',
    'raw': 'the same, message left as bytes', 'kinematics_plain': 'kinematics',
    'floor_plain': 'floor (a)'}
SERVICES = {
    'trigger': 'std_srvs/Trigger', 'echo 1': 'ServoInverse, 1 angle, echoed',
    'servo 1': 'servo_inverse, 1 angle', 'echo 1000': 'ServoInverse, 1000, echoed',
    'servo 1000': 'servo_inverse, 1000 angles'}
LAYERS = ('read', 'ask who listens', 'solve', 'patch', 'publish')


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
            '### Targets', targets(result), '### CPU time and latency', costs(result['rows']),
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


def rates(rows):
    """Return the rates that were measured."""
    return sorted({row['rate'] for row in rows})


def targets(result):
    """Return what was aimed at and what came of it."""
    rows, lines = result['rows'], []
    tick = {(body['scene'], body['subject']): body for body in result['bodies']}
    for rate in rates(rows):
        whole = ratio(rows, WALKER, rate, 'kinematics', 'floor')
        nobody = ratio(rows, WALKER, rate, 'unheard', 'deaf')
        lines += [
            [f'CPU a message / floor (a), {rate:.0f} Hz', '<= 1.3', f'{whole:.2f}',
             met(whole, 1.3)],
            [f'no subscriber (d) / does nothing, {rate:.0f} Hz', '<= 1.1', f'{nobody:.2f}',
             met(nobody, 1.1)]]
    body = tick[WALKER, 'kinematics']['tick']
    times = in_turn(tick[WALKER, 'fresh']['ticks'], tick[WALKER, 'kinematics']['ticks'])
    a_leg = 12 * tick['one leg', 'relay']['tick'] / body
    lines += [['body of the tick', '<= 80 us', f'{body:.0f} us', met(body, 80.0)],
              ['body with ordinary messages (b) / body', '>= 10', f'{times:.1f}',
               met(times, -10.0)],
              ['body of the relay (c) / body a leg', '>= 20', f'{a_leg:.0f}', met(a_leg, -20.0)]]
    lines += service_targets(result['services'])
    lines += process_targets(result['processes']) if 'processes' in result else []
    lines += driver_targets(result['drivers']) if 'drivers' in result else []
    starts = result['starts']
    start = statistics.median(starts['kinematics'])
    lines += [['start to first joint states', '< 1.5 s',
               f'{_seconds(starts["kinematics"])} (floor: {_seconds(starts["floor"])}; '
               f'to make the node and end: {_seconds(starts["made"])})', met(start, 1.5)]]
    for soak in [result['soak']] if 'soak' in result else []:
        lines += [[f'growth over {soak["messages"]:,} messages', '<= 2 MiB',
                   f'{soak["span_mib"]:.2f} MiB', met(soak['span_mib'], 2.0)]]
    for hold in [result['hold']] if 'hold' in result else []:
        lines += [[f'{hold["rate"]:.0f} Hz for {hold["seconds"]:.0f} s, messages lost', '0',
                   hold['lost'], met(hold['lost'], 0)]]
    return table(['12 legs, all topics subscribed', 'target', 'measured', 'met'], lines)


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
        base = 'deaf' if row['subject'] in ('unheard', 'raw', 'deaf') else 'floor'
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
    for rate in rates(rows):
        found = {r['subject']: r for r in rows if (r['scene'], r['rate']) == (WALKER, rate)}
        for subject in ('kinematics', 'floor'):
            events, plain = found[subject], found[f'{subject}_plain']
            lines.append([f'{NAMES[f"{subject}_plain"]}, {rate:.0f} Hz',
                          f'{events["cpu"]:.0f}', f'{plain["cpu"]:.0f}',
                          f'{ratio(rows, WALKER, rate, f"{subject}_plain", subject):.2f}',
                          *_latency(events), *_latency(plain)])
    return table(['12 legs', 'Events CPU', 'Single CPU', 'ratio', 'Events p50', 'p99',
                  'Single p50', 'p99'], lines)


def layers(result):
    """Return a message's way through the node of 12 legs, layer by layer."""
    rows, lines = result['rows'], []
    columns = rates(rows)
    for rate in columns:
        cpu = {r['subject']: r['cpu'] for r in rows if (r['scene'], r['rate']) == (WALKER, rate)}
        part = next(p for p in result['parts'] if (p['scene'], p['rate'], p['subject'])
                    == (WALKER, rate, 'kinematics'))
        rest = part['tick'] - sum(part[layer] for layer in LAYERS)
        lines.append([
            cpu['raw'], *(part[layer] for layer in LAYERS), rest,
            cpu['kinematics'] - cpu['raw'] - part['tick'], cpu['kinematics']])
    names = ('middleware, wake-up and taking the bytes', *(f'tick: {layer}' for layer in LAYERS),
             'tick: the rest', 'what is left to all', 'all')
    return table(['CPU [us a message]', *(f'{rate:.0f} Hz' for rate in columns)],
                 [[name, *(f'{v:.0f}' for v in values)]
                  for name, values in zip(names, zip(*lines))])


def bodies(result):
    """Return what the callbacks take."""
    hot = table(['in a loop', 'node', 'tick [us]', 'x floor'], [
        [body['scene'], NAMES[body['subject']], f'{body["tick"]:.0f}',
         f'{in_turn(body["ticks"], floor["ticks"]):.1f}']
        for body in result['bodies'] for floor in result['bodies']
        if floor['subject'] == 'floor' and floor['scene'] == body['scene']])
    cold = table(['12 legs, Hz', 'node', 'tick', *LAYERS], [
        [f'{p["rate"]:.0f}', NAMES[p['subject']],
         *(f'{p[layer]:.0f}' for layer in ('tick', *LAYERS))] for p in result['parts']])
    return ("CPU time of the callback's thread, medians: one tick after the other in one process, "
            'and in processes that are driven at a rate, where each tick finds caches that others '
            f'have filled [us].\n\n{hot}\n\n{cold}')


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
    lines = []
    if 'soak' in result:
        soak = result['soak']
        lines.append(['soak', f'{soak["messages"]:,} messages: {soak["resident_mib"]:.0f} MiB, '
                      f'first to last {soak["growth_mib"]:+.2f} MiB, '
                      f'span {soak["span_mib"]:.2f} MiB'])
    if 'hold' in result:
        hold = result['hold']
        lines.append(['hold', f'{hold["rate"]:.0f} Hz for {hold["seconds"]:.0f} s (took '
                      f'{hold["took"]:.1f} s): {hold["lost"]} lost, CPU {hold["cpu"]:.0f} us a '
                      f'message, latency p50 {hold["p50"]:.0f}, p99 {hold["p99"]:.0f}, longest '
                      f'{hold["max"]:.0f} us; load {hold["load"]:.1f}'])
    if 'trouble' in result:
        one = result['trouble']
        lines.append(['trouble', f'{one["seconds"]} s with a change, bad bytes and listeners that '
                      f'stall: {one["resident_mib"]:.0f} MiB, first to last '
                      f'{one["growth_mib"]:+.2f} MiB, span {one["span_mib"]:.2f} MiB; a change is '
                      f'answered after {one["answered_ms"]:.0f} ms, at most '
                      f'{one["longest_answer_ms"]:.0f} ms'])
    return table(['run', 'result'], lines)
