# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
How much code and stack a linkage takes on microcontrollers.

    python -m benchmark.c_code [--document]

Compilers that are not installed are left out (apt install gcc-avr avr-libc gcc-arm-none-eabi
libnewlib-arm-none-eabi). With --document the table goes into docs/c-code.md.
"""

import argparse
from pathlib import Path
import re
import shutil
import subprocess
import tempfile

from linkage_ros import scene
from linkage_ros.c_code import header

from . import document
from .nodes.report import table

TARGETS = {
    'ATmega328P, avr-gcc': ('avr', ['-mmcu=atmega328p']),
    'Cortex-M4F, arm-none-eabi-gcc': ('arm-none-eabi', [
        '-mcpu=cortex-m4', '-mthumb', '-mfloat-abi=hard', '-mfpu=fpv4-sp-d16',
        '--specs=nosys.specs'])}
CASES = {'slotted_lever': 'lever', 'four_bar': 'QB', 'jansen': 'EF'}
EMPTY = 'volatile float in, out; int main(void) { out = in; return 0; }\n'
USES = {
    'pose': '{name}_pose p; {name}_solve(in, &p); out = p.{field};',
    'inverse': 'float x = in; {name}_crank_for_{field}(in, x, &x); out = x;'}


def main():
    """Compile and print."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--document', action='store_true', help='write the table to docs/')
    rows = [[f'{name}, {use}', target, *measured(compiler, flags, name, output, use)]
            for target, (compiler, flags) in TARGETS.items() if shutil.which(f'{compiler}-gcc')
            for name, output in CASES.items() for use in USES]
    text = table(['linkage', 'target', 'code [bytes]', 'of it the C library', 'stack [bytes]'],
                 rows)
    print(text)
    if parser.parse_args().document:
        document.write('c-code.md', text)


def measured(compiler, flags, name, output, use):
    """Return code in bytes, that of the C library, and the stack of the linkage's own code."""
    machine = scene.read({'mechanisms': [name], f'{name}.type': name}).machines[name]
    text = header.written(machine, (output,), single=True)
    body = USES[use].format(name=name, field=f'angle_{output}')
    with tempfile.TemporaryDirectory() as folder:
        linked, _ = built(Path(folder), compiler, flags, text + EMPTY.replace('out = in;', body))
        empty, _ = built(Path(folder), compiler, flags, EMPTY)
        own, stack = built(Path(folder), compiler, [*flags, '-c'],
                           text + EMPTY.replace('out = in;', body))
        idle, _ = built(Path(folder), compiler, [*flags, '-c'], EMPTY)
    return linked - empty, linked - empty - (own - idle), stack


def built(folder, compiler, flags, text):
    """Return the size of the code and the largest frame."""
    source, made = folder / 'main.c', folder / 'main.o'
    source.write_text(text)
    subprocess.run([f'{compiler}-gcc', '-std=c99', '-Os', '-Wall', '-Wextra', '-Werror',
                    '-fstack-usage', *flags, str(source), '-o', str(made), '-lm'],
                   check=True, cwd=folder)
    size = subprocess.run([f'{compiler}-size', str(made)], check=True, text=True,
                          capture_output=True).stdout.splitlines()[1].split()
    frames = [int(number) for usage in folder.glob('*.su')
              for number in re.findall(r'\t(\d+)\t', usage.read_text())]
    return int(size[0]) + int(size[1]), max(frames)


if __name__ == '__main__':
    main()
