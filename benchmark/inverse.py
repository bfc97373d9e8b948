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
What closed inverses of the catalogue cost: CPU time beside that of a pose.

    python -m benchmark.inverse [--document]

All answers to one question in plain Python, beside `function()` for all points; arrays of
100000 questions by machine code, beside as many poses, of some (needs llvmlite); and the first
question in a process of its own. `python -m benchmark.c_code` has the inverses in C. With
--document the table goes into docs/performance.md.
"""

import argparse
from importlib.util import find_spec
from multiprocessing import get_context
import time

from linkage_ros import mechanisms
import numpy as np

from . import document
from .nodes.report import table

MANY, ROUNDS, SAMPLE = 100_000, 5, 0.02
# Those that are compiled for arrays.
COMPILED = {('slotted_lever', 'lever'), ('four_bar', 'QB'), ('jansen', 'BC'), ('five_bar', 'P.x')}
TOGETHER = {'five_bar': [('P.x', 'P.y')]}


def inverses():
    """Yield the type and outputs of each closed inverse."""
    for kind in mechanisms.TYPES:
        linkage = mechanisms.create(kind)
        driven = {input_.name for input_ in linkage.inputs}
        for outputs in TOGETHER.get(kind, []) or [
                (name,) for name in linkage.joints if name not in driven]:
            try:
                if linkage.inverse(outputs).closed:
                    yield kind, outputs
            except ValueError:
                pass  # stands still, or does not tell all inputs


def time_of(do):
    """Return the least CPU time of a call [us]."""
    times, count = [], 1
    while len(times) < ROUNDS:
        start = time.process_time()
        for _ in range(count):
            do()
        taken = time.process_time() - start
        if taken < SAMPLE:
            count *= 2
        else:
            times.append(1e6 * taken / count)
    return min(times)


def question(linkage, outputs, count=None):
    """Return inputs that can be had, one or many, and outputs there."""
    rng = np.random.default_rng(3)
    while True:
        inputs = [rng.uniform(x.low, x.high, count) for x in linkage.inputs]
        values = list(linkage.joint_angles(inputs if len(inputs) > 1 else inputs[0],
                                           outputs).values())
        if count or np.isfinite(values).all():
            return ([*map(float, inputs)], [*map(float, values)]) if not count else (
                inputs, values)


def first(kind, outputs):
    """Return the CPU time of the first question [ms], where nothing is known yet."""
    linkage = mechanisms.create(kind)
    linkage.function()
    _, values = question(linkage, outputs)
    start = time.process_time()
    linkage.inverse(outputs).all(values)
    return 1e3 * (time.process_time() - start)


def measure(kind, outputs):
    """Return a row of the table."""
    linkage = mechanisms.create(kind)
    inverse, pose = linkage.inverse(outputs), linkage.function()
    inputs, values = question(linkage, outputs)
    one, all_ = time_of(lambda: pose(*inputs)), time_of(lambda: inverse.all(values))
    ratio = ''
    if find_spec('llvmlite') and (kind, outputs[0]) in COMPILED:
        quick = linkage.accelerated()
        inputs, values = question(linkage, outputs, MANY)
        theta, many = inputs if len(inputs) > 1 else inputs[0], quick.inverse(outputs)
        taken = time_of(lambda: many.nearest(values, inputs)), time_of(lambda: quick.solve(theta))
        ratio = f'{taken[0] / taken[1]:.1f}'
    with get_context('spawn').Pool(1) as process:
        begin = process.apply(first, (kind, outputs))
    return (kind, ', '.join(outputs), str(len(inverse.closed.modes)), f'{all_:.1f}',
            f'{all_ / one:.0f}', ratio, f'{begin:.0f}')


def main():
    """Print the table, worst ratio last."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--document', action='store_true', help='write it to docs/performance.md')
    options = parser.parse_args()
    rows = sorted((measure(*each) for each in inverses()), key=lambda row: float(row[4]))
    text = table(('mechanism', 'outputs', 'modes', 'all answers [us]', 'x a pose',
                  '100000 x poses', 'first question [ms]'), rows)
    print(text)
    if options.document:
        document.write('performance.md', text, 'measured: inverse')


if __name__ == '__main__':
    main()
