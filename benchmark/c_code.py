# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What a linkage in C takes: code, stack and time, on microcontrollers and on this machine.

    python -m benchmark.c_code [--document]

Compilers that are not installed are left out (apt install gcc-avr avr-libc simavr
gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm). With --document the tables go into
docs/design/c-code.md.
"""

from pathlib import Path
import re
import shutil
import subprocess
import tempfile
from typing import NamedTuple

from linkage_ros import scene
from linkage_ros.c_code import header
from linkage_ros.c_code.names import field
import numpy as np

from . import document

# Mechanisms and outputs: what a joint follows, and what the inverse is asked for.
CASES = (('slotted_lever', ('lever',)), ('four_bar', ('QB',)), ('jansen', ('EF',)),
         ('five_bar', ('P.x', 'P.y')), ('klann', ('CF',)))
# Poses at which times are taken.
POSES = 16
SIDE = ' '.join(f'side.{what}[{{i}}] = {value};' for what, value in (
    ('position', '{from}[k][{i}]'), ('velocity', '1.0f'), ('effort', '0.0f')))
USES = {
    'pose': '{name}_pose p; {name}_solve({given}, 0, &p, NULL); out = p.{field};',
    # Next to the other end of the reach, so that each assembly mode is chosen somewhere.
    'inverse': '{number} x[2] = {{ given[{last} - k][0], given[{last} - k][{other}] }}; '
               '{inverse} out = x[0];',
    'actuators to joints': '{measured} lkr_actuators_to_joints(&{name}_model, &memory, '
                           '&side, &to); out = to.effort[0];',
    'joints to actuators': '{commanded} lkr_joints_to_actuators(&{name}_model, &memory, '
                           '&side, &to); out = to.effort[0];'}
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
# The time of each call on what is printed. Measured is another pose before each call.
TIMED = """
static {number} given[][{n}] = {{ {given_rows} }}, found[][{n}] = {{ {found_rows} }};
static lkr_memory memory;
static lkr_side side, to;
volatile {number} out;
volatile int from;
int main(void)
{{
    begin();
    lkr_begin(&{name}_model, &memory);
    for (int k = from; k < {count}; k++) {{
        unsigned long best = -1ul, idle = -1ul;
        for (int i = 0; i < TRIES; i++) {{
            {before}
            lkr_actuators_to_joints(&{name}_model, &memory, &side, &to);
            unsigned long start = now();
            // What follows is not computed before.
            __asm__ volatile ("" ::: "memory");
            {{ {body} }}
            unsigned long end = now(), after = now();
            best = end - start < best ? end - start : best;
            idle = after - end < idle ? after - end : idle;
        }}
        say(best - idle);
    }}
    return done();
}}
"""
# Cycles, by eights, on the serial line that simavr prints.
AVR = """
#include <avr/io.h>
#include <avr/sleep.h>
#define TRIES 1
static void begin(void) {{ UCSR0B = 1 << TXEN0; TCCR1B = 2; }}
static unsigned long now(void) {{ return TCNT1; }}
static void put(char c) {{ while (!(UCSR0A & (1 << UDRE0))) ; UDR0 = c; }}
static void digits(unsigned long n) {{ if (n > 9) digits(n / 10); put('0' + n % 10); }}
static void say(unsigned long n) {{ digits(8 * (n & 0xFFFF)); put('\\n'); }}
static int done(void) {{ sleep_enable(); sleep_cpu(); return 0; }}
"""
# Instructions: with -icount shift=10 each lasts 1024 ns, a tick of the timer 40 ns.
CORTEX = """
#include <stdio.h>
#define TRIES 1
#define TIMER ((volatile unsigned *)0xE000E010)
extern void _start(void);
static void reset(void)
{{
    *(volatile unsigned *)0xE000ED88 = 0xFu << 20;  /* the floating-point unit */
    __asm__ volatile ("dsb; isb");
    _start();
}}
__attribute__((section(".vectors"), used))
static void *const vectors[] = {{ (void *)0x20400000, (void *)reset }};
static void begin(void) {{ TIMER[1] = 0xFFFFFF; TIMER[0] = 5; }}
static unsigned long now(void) {{ return 0xFFFFFF - TIMER[2]; }}
static void say(unsigned long n) {{ printf("%lu.\\n", ((n & 0xFFFFFF) * 40 + 512) / 1024); }}
static int done(void) {{ return 0; }}
"""
# Nanoseconds, the least of some tries.
HERE = """
#include <stdio.h>
#include <time.h>
#define TRIES 100000
static void begin(void) {{ }}
static unsigned long now(void) {{ struct timespec t; clock_gettime(CLOCK_MONOTONIC, &t);
    return 1000000000ul * (unsigned long)t.tv_sec + (unsigned long)t.tv_nsec; }}
static void say(unsigned long n) {{ printf("%lu.\\n", n); }}
static int done(void) {{ return 0; }}
"""


class Target(NamedTuple):
    """A compiler with its flags, those of a program that is run, what runs it, and its clock."""

    compiler: str
    flags: list
    run_flags: list
    simulator: list
    clock: str


HERE_ = Target('', ['-O2', '-w'], [], [], HERE)
TARGETS = {
    'ATmega328P': Target('avr-', ['-mmcu=atmega328p'], [], [
        'simavr', '-m', 'atmega328p', '-f', '16000000'], AVR),
    'Cortex-M4F': Target('arm-none-eabi-', [
        '-mcpu=cortex-m4', '-mthumb', '-mfloat-abi=hard', '-mfpu=fpv4-sp-d16'],
        ['--specs=rdimon.specs', '-Wl,--section-start=.vectors=0'], [
            'qemu-system-arm', '-M', 'mps2-an386', '-icount', 'shift=10', '-nographic',
            '-semihosting', '-kernel'], CORTEX)}


def main():
    """Compile, run and print."""
    options = document.parser(__doc__).parse_args()
    rows = [[f'{name} {", ".join(outputs)}, {use}', which, *measured(
                target, *prepared(name, outputs, 'float', use))]
            for which, target in TARGETS.items() if shutil.which(f'{target.compiler}gcc')
            for name, outputs in CASES for use in USES]
    text = document.table(['linkage and output', 'target', 'flash [bytes]', 'of it the C library',
                  'RAM [bytes]', 'stack [bytes]', 'cycles or instructions, median', 'at most'],
                          rows)
    text += '\n\n' + document.table(
        ['linkage and output', *(f'{use} [ns]' for use in USES)],
        [[f'{name} {", ".join(outputs)}', *(
            times(HERE_, *prepared(name, outputs, 'double', use))[1] for use in USES)]
         for name, outputs in CASES])
    document.show(options, 'design/c-code.md', f'{text}\n\n{document.machine()}')


def measured(target, text, values):
    """Return flash, that of the C library, RAM, the stack of the linkage's code, and times."""
    body = values['body']
    begin = 'lkr_begin(&{name}_model, &memory);'.format(**values) if 'memory' in body else ''
    sizes = [built(target, ['--specs=nosys.specs'] * ('arm' in target.compiler) + [*extra],
                   text + MAIN.format(**{**values, 'body': each}, begin=each and begin))
             for extra in ((), ('-c',)) for each in ('', body)]
    (idle, unused, _), (linked, used, _), (empty, *_), (own, _, stack) = sizes
    return [linked - idle, linked - idle - (own - empty), used - unused, stack,
            *times(target, text, values)]


def prepared(name, outputs, number, use):
    """Return the header of a mechanism, and what the programs that call its C are filled with."""
    given = {'mechanisms': [name], f'{name}.type': name}
    if name == 'five_bar':
        given |= {f'{name}.{input_}.sweep': ends for input_, ends in (
            ('crank', [1.5, 1.9]), ('crank2', [1.24, 1.6]))}
    mechanism = scene.read(given).mechanisms[name]
    n, linkage = len(mechanism.inputs), mechanism.linkage
    rows = np.stack([np.linspace(*(drive.ends or drive.reach[0]), POSES + 2)[1:-1]
                     for drive in mechanism.inputs.values()])
    rows[1:] = np.roll(rows[1:], POSES // 3, axis=1)
    values = linkage.joint_angles(rows if n > 1 else rows[0], outputs)
    found = np.stack([values[output] for output in outputs])
    joints = [f'{name}_{output}' for output in outputs]
    fields = [field(linkage, output) for output in outputs]
    inverse = f'lkr_inverse(&{name}_for_{"_".join(fields)}, found[k], x, x);'
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
    return header.written(mechanism, outputs, number == 'float', joints), named


def times(target, text, values):
    """Return the median and the longest time of a call."""
    with tempfile.TemporaryDirectory() as folder:
        program = compiled(Path(folder), target, target.run_flags,
                           text + (target.clock + TIMED).format(**values))
        printed = subprocess.run(['timeout', '60', *target.simulator, program], text=True,
                                 capture_output=True)
    taken = [int(number) for number in re.findall(r'(\d{2,})\.', printed.stdout + printed.stderr)]
    assert len(taken) == POSES, printed
    return [int(np.median(taken)), max(taken)]


def built(target, flags, text):
    """Return the sizes of flash and RAM, and the largest frame."""
    with tempfile.TemporaryDirectory() as folder:
        program = compiled(Path(folder), target, ['-fstack-usage', *flags], text)
        size = subprocess.run([f'{target.compiler}size', program], check=True, text=True,
                              capture_output=True).stdout.splitlines()[1].split()
        frames = [int(number) for usage in Path(folder).glob('*.su')
                  for number in re.findall(r'\t(\d+)\t', usage.read_text())]
    return int(size[0]) + int(size[1]), int(size[1]) + int(size[2]), max(frames)


def compiled(folder, target, flags, text):
    """Return the program of a text."""
    source, program = folder / 'main.c', folder / 'main.o'
    source.write_text(text)
    subprocess.run([f'{target.compiler}gcc', '-std=gnu99', '-Os', '-Wall', '-Wextra',
                    '-Wno-unused', *target.flags, *flags, source, '-o', program, '-lm'],
                   check=True, cwd=folder)
    return program


if __name__ == '__main__':
    main()
