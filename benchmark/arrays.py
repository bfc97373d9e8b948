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
Arrays of poses by machine code, on one core and on all, beside C on one.

    python -m benchmark.arrays               prints the table, within half a minute
    python -m benchmark.arrays --document    writes it to docs/accuracy.md, too

Besides what the library needs, it takes llvmlite and gcc. What runs on one core is judged by its
CPU time; all cores against one by a clock on the wall, on a machine that has little else to do.
"""

import argparse
import os
import time

import numpy as np

from . import document, problems
from .machine import machine
from .methods import compiled_c, ours
from .report import TITLES

SIZES = 10_000, 100_000, 1_000_000
ROUNDS = 8
# How long each method runs in a round [s].
SLICE = 0.03


def main():
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__.strip().split('\n\n')[0])
    parser.add_argument('--document', action='store_true', help='write the table to docs/')
    options = parser.parse_args()
    found = table([row for kind in TITLES for row in measured(kind)])
    if options.document:
        document.write('accuracy.md', found)
    print(found)


def measured(kind):
    """Yield (linkage, poses, ns a pose in C without and with vectors, ours, speed-up)."""
    cores = os.sched_getaffinity(0)
    reach = 0.99 * problems.REACH[kind]
    fast, *others = chosen = ours.Accelerated(), *compiled_c.METHODS[1:]
    for method in chosen:
        method.prepare(kind, problems.DIMENSIONS[kind])
    for size in SIZES:
        theta = np.random.default_rng(1).uniform(-reach, reach, size)
        alone, together = {method: [] for method in chosen}, []
        for _ in range(ROUNDS):
            os.sched_setaffinity(0, {max(cores)})
            for method in chosen:
                alone[method] += timed(method, theta)
            os.sched_setaffinity(0, cores)
            together += timed(fast, theta)
        cpu = {method: np.median([cpu for cpu, _ in alone[method]]) for method in chosen}
        # The quick ones: a core that another program takes is none.
        walls = (np.quantile([wall for _, wall in found], 0.1)
                 for found in (alone[fast], together))
        yield (TITLES[kind], size, *(1e9 / size * cpu[method] for method in (*others, fast)),
               np.divide(*walls))


def timed(method, theta):
    """Return (CPU time, time on the wall) [s] of each call for a while."""
    method.solve(theta)
    found, end = [], time.perf_counter() + SLICE
    while time.perf_counter() < end:
        cpu, wall = time.process_time(), time.perf_counter()
        method.solve(theta)
        found.append((time.process_time() - cpu, time.perf_counter() - wall))
    return found


def table(rows):
    """Return rows as Markdown."""
    about, cores = machine([ours.Accelerated()]), len(os.sched_getaffinity(0))
    lines = ['| linkage | poses | C [ns per pose] | C, vector sine | machine code | / C '
             f'| / C, vector sine | speed-up on {cores} cores |', '|---|' + '--:|' * 7]
    lines += [f'| {title} | {size} | {scalar:.1f} | {vector:.1f} | {fast:.1f} '
              f'| {fast / scalar:.2f} | {fast / vector:.2f} | {gain:.2f} x |'
              for title, size, scalar, vector, fast, gain in rows]
    packages = ', '.join(f'{name} {number}' for name, number in about['packages'].items())
    return '\n'.join([*lines, '', f'{about["date"]}, {about["cpu"]}; {about["compiler"]} -O3 '
                      f'-march=native; {packages}; commit {about["commit"]}.'])


if __name__ == '__main__':
    main()
