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
What a linkage in C takes on an ATmega328P: code, stack and cycles.

    python -m benchmark.c_code [--document]

It needs gcc-avr, avr-libc and simavr (apt install). With --document the table goes into
docs/c-code.md.
"""

import argparse
from pathlib import Path
import re
import shutil
import subprocess
import tempfile

from linkage_ros import scene
from linkage_ros.c_code import header
import numpy as np

from . import document

CASES = {'slotted_lever': 'lever', 'four_bar': 'QB', 'jansen': 'BC'}
# Poses at which cycles are taken.
POSES = 16
USES = {
    'pose': '{name}_pose p; {name}_solve(given[k], &p); out = p.angle_{output};',
    # Next to the other end of the reach, so that each assembly mode is chosen somewhere.
    'inverse': 'float x = given[{last} - k]; {name}_crank_for_angle_{output}(found[k], x, &x); '
               'out = x;',
    'actuators to joints': 'side.position[0] = given[k]; out = side.velocity[0] = 1.0f; '
                           '{name}_actuators_to_joints(&memory, &side, &other); '
                           'out = other.effort[0];',
    'joints to actuators': 'side.position[0] = found[k]; out = side.velocity[0] = 1.0f; '
                           '{name}_joints_to_actuators(&memory, &side, &other); '
                           'out = other.effort[0];'}
MAIN = """
static const float given[] = {{ {given} }}, found[] = {{ {found} }};
static {name}_memory memory;
static {name}_side side, other;
volatile float out;
volatile int from;
int main(void) {{ int k = from; {begin} {body} return (int)(given[k] + found[k]); }}
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
static const float given[] = {{ {given} }}, found[] = {{ {found} }};
static {name}_memory memory;
static {name}_side side, other;
volatile float out;
volatile int from;
int main(void)
{{
    UCSR0B = 1 << TXEN0; TCCR1B = 1; TIMSK1 = 1; sei();
    {name}_begin(&memory);
    for (int k = from; k < {count}; k++) {{
        side.position[0] = given[k];
        {name}_actuators_to_joints(&memory, &side, &other);
        unsigned long start = now();
        {{ {body} }}
        unsigned long end = now();
        say(end - start); put('\\n');
    }}
    cli(); sleep_enable(); sleep_cpu();
}}
"""


def main():
    """Compile, run and print."""
    parser = argparse.ArgumentParser(description=__doc__.strip().split('\n\n')[0])
    parser.add_argument('--document', action='store_true', help='write the table to docs/')
    options = parser.parse_args()
    if not shutil.which('avr-gcc'):
        parser.exit(1, 'avr-gcc is not installed.\n')
    text = document.table(
        ['linkage', 'code [bytes]', 'of it the C library', 'stack [bytes]', 'cycles, median',
         'at most'], [[f'{name}, {use}', *measured(name, output, use)]
                      for name, output in CASES.items() for use in USES])
    text += '\n\n' + document.machine()
    print(text)
    if options.document:
        document.write('c-code.md', text)


def measured(name, output, use):
    """Return code, that of the C library, the stack of the linkage's own code, and cycles."""
    machine, values = prepared(name, output, use)
    body = values['body']
    begin = f'{name}_begin(&memory);' if 'memory' in body else ''
    text = header.written(machine, (output,), True, [f'{name}_{output}'])
    with tempfile.TemporaryDirectory() as folder:
        sizes = [built(Path(folder), extra, text + MAIN.format(
            **{**values, 'body': each}, begin=each and begin)) for extra in ((), ('-c',))
            for each in ('', body)]
        (idle, _), (linked, _), (empty, _), (own, stack) = sizes
        return [linked - idle, linked - idle - (own - empty), stack,
                *cycles(Path(folder), text + CYCLES.format(**values))]


def prepared(name, output, use):
    """Return a mechanism, and what the programs that call its C are filled with."""
    machine = scene.read({'mechanisms': [name], f'{name}.type': name}).machines[name]
    given = np.linspace(*machine.first.reach[0], POSES + 2)[1:-1]
    found = machine.linkage.joint_angles(given, [output])[output]
    return machine, {
        'name': name, 'count': POSES,
        'body': USES[use].format(name=name, output=output, last=POSES - 1),
        **{key: ', '.join(f'{value:.7g}f' for value in each)
           for key, each in (('given', given + 1e-7), ('found', found))}}


def cycles(folder, text):
    """Return the median and the most cycles of a call, where there is a simulator."""
    if not shutil.which('simavr'):
        return ['not measured'] * 2
    built(folder, (), text)
    printed = subprocess.run(['timeout', '60', 'simavr', '-m', 'atmega328p', '-f', '16000000',
                              folder / 'main.o'], text=True, capture_output=True)
    taken = [int(number) for number in re.findall(r'(\d{3,})\.', printed.stdout + printed.stderr)]
    assert len(taken) == POSES, printed
    return [int(np.median(taken)), max(taken)]


def built(folder, extra, text):
    """Return the size of the code and the largest frame."""
    source, made = folder / 'main.c', folder / 'main.o'
    source.write_text(text)
    for usage in folder.glob('*.su'):
        usage.unlink()
    subprocess.run(['avr-gcc', '-mmcu=atmega328p', '-std=gnu99', '-Os', '-Wall', '-Wextra',
                    '-Wno-unused', '-fstack-usage', *extra, str(source), '-o', str(made), '-lm'],
                   check=True, cwd=folder)
    size = subprocess.run(['avr-size', str(made)], check=True, text=True,
                          capture_output=True).stdout.splitlines()[1].split()
    frames = [int(number) for usage in folder.glob('*.su')
              for number in re.findall(r'\t(\d+)\t', usage.read_text())]
    return int(size[0]) + int(size[1]), max(frames)


if __name__ == '__main__':
    main()
