# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What a linkage in C takes: code, stack and cycles on microcontrollers, and time in a controller.

    python -m benchmark.c_code [--document]

Compilers that are not installed are left out (apt install gcc-avr avr-libc simavr
gcc-arm-none-eabi libnewlib-arm-none-eabi). With --document the tables go into docs/c-code.md.
"""

from itertools import chain
from pathlib import Path
import re
import shutil
import subprocess
import tempfile

from linkage_ros import scene
from linkage_ros.c_code import header
from linkage_ros.c_code.names import field
from linkage_ros.c_code.package import ranges
import numpy as np

from . import document

TARGETS = {
    'ATmega328P, avr-gcc': ('avr', ['-mmcu=atmega328p']),
    'Cortex-M4F, arm-none-eabi-gcc': ('arm-none-eabi', [
        '-mcpu=cortex-m4', '-mthumb', '-mfloat-abi=hard', '-mfpu=fpv4-sp-d16',
        '--specs=nosys.specs'])}
# Mechanisms and outputs: what a joint follows, and what the inverse is asked for.
CASES = (('slotted_lever', ('lever',)), ('four_bar', ('QB',)), ('jansen', ('BC',)),
         ('jansen', ('EF',)), ('five_bar', ('P.x', 'P.y')), ('klann', ('CF',)))
SCENES = ('config/slotted_lever', 'config/jansen', 'config/excavator', 'examples/leg')
# Poses at which cycles and times are taken.
POSES, CALLS = 16, 20_000
SIDE = ' '.join(f'side.{what}[{{i}}] = {value};' for what, value in (
    ('position', '{from}[k][{i}]'), ('velocity', '1.0f'), ('effort', '0.0f')))
USES = {
    'pose': '{name}_pose p; {name}_solve({given}, &p); out = p.{field};',
    # Next to the other end of the reach, so that each assembly mode is chosen somewhere.
    'inverse': '{number} x[2] = {{ given[{last} - k][0], given[{last} - k][{other}] }}; '
               '{inverse} out = x[0];',
    'actuators to joints': '{measured} {name}_actuators_to_joints(&memory, &side, &to); '
                           'out = to.effort[0];',
    'joints to actuators': '{commanded} {name}_joints_to_actuators(&memory, &side, &to); '
                           'out = to.effort[0];'}
MAIN = """
static const float given[][{n}] = {{ {given_rows} }}, found[][{n}] = {{ {found_rows} }};
static lkr_memory memory;
static lkr_side side, to;
volatile float out;
volatile int from;
int main(void)
{{
    int k = from; {begin} {body} (void)&memory; (void)&side; (void)&to;
    return (int)(given[k][0] + found[k][0]);
}}
"""
# The cycles of each call on the serial line, which simavr prints.
CYCLES = """
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
static volatile unsigned int turns;
ISR(TIMER1_OVF_vect) {{ turns++; }}
static unsigned long now(void)
{{
    cli();
    unsigned long t = TCNT1;
    if (TIFR1 & 1)
        t = 65536ul + TCNT1;
    t += 65536ul * turns;
    sei();
    return t;
}}
static void put(char c) {{ while (!(UCSR0A & (1 << UDRE0))) ; UDR0 = c; }}
static void say(unsigned long n) {{ if (n > 9) say(n / 10); put('0' + n % 10); }}
static const float given[][{n}] = {{ {given_rows} }}, found[][{n}] = {{ {found_rows} }};
static lkr_memory memory;
static lkr_side side, to;
volatile float out;
volatile int from;
int main(void)
{{
    UCSR0B = 1 << TXEN0; TCCR1B = 1; TIMSK1 = 1; sei();
    {name}_begin(&memory);
    for (int k = from; k < {count}; k++) {{
        {before}
        {name}_actuators_to_joints(&memory, &side, &to);
        unsigned long start = now();
        {{ {body} }}
        unsigned long end = now();
        say(end - start); put('\\n');
    }}
    cli(); sleep_enable(); sleep_cpu();
}}
"""
NOW = """
#include <stdio.h>
#include <time.h>
static double now(void) {{ struct timespec t; clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec; }}
"""
# Nanoseconds of a call at each pose, by repeating it, the least of some tries.
PACE = NOW + """
static {number} given[][{n}] = {{ {given_rows} }}, found[][{n}] = {{ {found_rows} }};
static volatile {number} out;
int main(void)
{{
    for (int k = 0; k < {count}; k++) {{
        double best = 1e30;
        for (int tries = 0; tries < 50; tries++) {{
            double start = now();
            for (int i = 0; i < 1000; i++) {{
                __asm__ volatile ("" ::: "memory");
                {body}
            }}
            double taken = (now() - start) / 1000;
            best = taken < best ? taken : best;
        }}
        printf("%.2f\\n", best);
    }}
    return 0;
}}
"""
# Nanoseconds of each call, the least of some tries, in a controller's double precision.
TIMES = NOW + """
#include "{root}/test/ros2_control/sample.h"
int main(void)
{{
    static const double ranges[{n}][2] = {ranges};
    static {name}_memory m;
    lkr_side last = {{ {{ 0 }}, {{ 0 }}, {{ 0 }} }}, b;
    {name}_begin(&m);
    for (long k = 1; k <= {count}; k++) {{
        double q[{n}], best[2] = {{ 1e30, 1e30 }};
        lkr_point p;
        lkr_side a = {{ {{ 0 }}, {{ 0 }}, {{ 0 }} }}, j = a;
        sample({n}, ranges, k, q);
        if (!{name}_at(q, 1, &p)) continue;
        for (int i = 0; i < {n}; i++) {{
            a.position[i] = p.position[0][i];
            a.velocity[i] = a.effort[i] = 1;
        }}
        for (int tries = 0; tries < 5; tries++) {{
            // Measured at another pose before each call.
            {name}_actuators_to_joints(&m, &last, &b);
            double t0 = now(); {name}_actuators_to_joints(&m, &a, &j);
            double t1 = now(); {name}_actuators_to_joints(&m, &last, &b);
            double t2 = now(); {name}_joints_to_actuators(&m, &j, &b);
            double t3 = now();
            best[0] = t1 - t0 < best[0] ? t1 - t0 : best[0];
            best[1] = t3 - t2 < best[1] ? t3 - t2 : best[1];
        }}
        last = a;
        printf("%.0f %.0f\\n", best[0], best[1]);
    }}
    return 0;
}}
"""


def main():
    """Compile, run and print."""
    options = document.parser(__doc__).parse_args()
    rows = [[f'{name} {", ".join(outputs)}, {use}', target, *measured(
                compiler, flags, name, outputs, use)]
            for target, (compiler, flags) in TARGETS.items() if shutil.which(f'{compiler}-gcc')
            for name, outputs in CASES for use in USES]
    text = document.table(['linkage and output', 'target', 'flash [bytes]', 'of it the C library',
                  'RAM [bytes]', 'stack [bytes]', 'cycles, median', 'at most'], rows)
    text += '\n\n' + document.table(
        ['linkage', 'actuators to joints [us], median', 'at most', 'joints to actuators [us], '
         'median', 'at most'], [[name, *times] for name, times in timed()])
    text += '\n\n' + document.table(
        ['linkage and output', 'number', 'pose [ns], median', 'at most', 'inverse [ns], median',
         'at most'],
        [[f'{name} {", ".join(outputs)}', number, *chain.from_iterable(
            paced(name, outputs, number, use) for use in ('pose', 'inverse'))]
         for name, outputs in CASES for number in ('float', 'double')])
    document.show(options, 'c-code.md', text)


def measured(compiler, flags, name, outputs, use):
    """Return flash, that of the C library, RAM, the stack of the linkage's code, and cycles."""
    text, values = prepared(name, outputs, 'float', use)
    body = values['body']
    begin = f'{name}_begin(&memory);' if 'memory' in body else ''
    with tempfile.TemporaryDirectory() as folder:
        sizes = [built(Path(folder), compiler, [*flags, *extra], text + MAIN.format(
            **{**values, 'body': each}, begin=each and begin)) for extra in ((), ('-c',))
            for each in ('', body)]
        (idle, unused, _), (linked, used, _), (empty, *_), (own, _, stack) = sizes
        return [linked - idle, linked - idle - (own - empty), used - unused, stack,
                *cycles(Path(folder), compiler, flags, text + CYCLES.format(**values))]


def prepared(name, outputs, number, use):
    """Return the header of a mechanism, and what the programs that call its C are filled with."""
    given = {'mechanisms': [name], f'{name}.type': name}
    if name == 'five_bar':
        given |= {f'{name}.{input_}.sweep': ends for input_, ends in (
            ('crank', [1.5, 1.9]), ('crank2', [1.24, 1.6]))}
    machine = scene.read(given).machines[name]
    n, linkage = len(machine.inputs), machine.linkage
    rows = np.stack([np.linspace(*(drive.ends or drive.reach[0]), POSES + 2)[1:-1]
                     for drive in machine.inputs.values()])
    rows[1:] = np.roll(rows[1:], POSES // 3, axis=1)
    values = linkage.joint_angles(rows if n > 1 else rows[0], outputs)
    found = np.stack([values[output] for output in outputs])
    joints = [f'{name}_{output}' for output in outputs]
    fields = [field(linkage, output) for output in outputs]
    inverse = (f'{name}_inputs_for_{"_".join(fields)}(found[k], x, x);' if n > 1 else
               f'{name}_crank_for_{fields[0]}(found[k][0], x[0], x);')
    named = {'name': name, 'n': n, 'count': POSES, 'number': number, 'last': POSES - 1,
             'other': n - 1, 'inverse': inverse, 'field': fields[0],
             'given': ', '.join(f'given[k][{i}]' for i in range(n)),
             **{what: ' '.join(SIDE.replace('{from}', table_).replace('{i}', str(i))
                               for i in range(n))
                for what, table_ in (('measured', 'given'), ('commanded', 'found'))}}
    # Measured at another pose before each call.
    named['before'] = named['measured'].replace('[k]', f'[{POSES - 1} - k]')
    named['body'] = USES[use].format(**named)
    for key, each in (('given', rows + 1e-7), ('found', found)):
        named[f'{key}_rows'] = ', '.join('{ %s }' % ', '.join(
            f'{value:.7g}f' if number == 'float' else repr(float(value)) for value in row)
            for row in each.T)
    return header.written(machine, outputs, number == 'float', joints), named


def paced(name, outputs, number, use):
    """Return the time of a call on this machine: median and most [ns]."""
    text, values = prepared(name, outputs, number, use)
    with tempfile.TemporaryDirectory() as folder:
        taken = run(folder, text + PACE.format(**values))
    return [f'{value:.0f}' for value in (np.median(taken), max(taken))]


def run(folder, text):
    """Compile a program for this machine, and return the numbers that it prints."""
    source, program = Path(folder) / 'main.c', Path(folder) / 'main'
    source.write_text(text)
    subprocess.run(['cc', '-O2', '-w', source, '-o', program, '-lm'], check=True)
    return np.array(subprocess.run([program], capture_output=True, text=True, check=True)
                    .stdout.split(), float)


def cycles(folder, compiler, flags, text):
    """Return the median and the most cycles of a call, where there is a simulator."""
    if compiler != 'avr' or not shutil.which('simavr'):
        return ['not measured'] * 2
    built(folder, compiler, flags, text)
    printed = subprocess.run(['timeout', '60', 'simavr', '-m', 'atmega328p', '-f', '16000000',
                              folder / 'main.o'], text=True, capture_output=True)
    taken = [int(number) for number in re.findall(r'(\d{3,})\.', printed.stdout + printed.stderr)]
    assert len(taken) == POSES, printed
    return [int(np.median(taken)), max(taken)]


def timed():
    """Yield the time both ways of each mechanism: median and most [us]."""
    root = Path(__file__).parents[1]
    for path in SCENES:
        for name, machine in scene.load(str(root / f'{path}.yaml')).machines.items():
            with tempfile.TemporaryDirectory() as folder:
                rows = run(folder, header.written(machine) + TIMES.format(
                    name=name, n=len(machine.inputs), count=CALLS,
                    root=root.absolute(), ranges=ranges(machine))).reshape(-1, 2) / 1000.0
            yield name, [f'{value:.2f}' for row in rows.T
                         for value in (np.median(row), row.max())]


def built(folder, compiler, flags, text):
    """Return the sizes of flash and RAM, and the largest frame."""
    source, made = folder / 'main.c', folder / 'main.o'
    source.write_text(text)
    for usage in folder.glob('*.su'):
        usage.unlink()
    subprocess.run([f'{compiler}-gcc', '-std=gnu99', '-Os', '-Wall', '-Wextra', '-Wno-unused',
                    '-fstack-usage', *flags, str(source), '-o', str(made), '-lm'],
                   check=True, cwd=folder)
    size = subprocess.run([f'{compiler}-size', str(made)], check=True, text=True,
                          capture_output=True).stdout.splitlines()[1].split()
    frames = [int(number) for usage in folder.glob('*.su')
              for number in re.findall(r'\t(\d+)\t', usage.read_text())]
    return int(size[0]) + int(size[1]), int(size[1]) + int(size[2]), max(frames)


if __name__ == '__main__':
    main()
