# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What each call of the library costs that README.md and docs/tutorial.md show.

    python -m benchmark.calls [--document]

The calls are read from the pages. Each is timed in turn with the call below it: the compiled code
of a pose, or the inverse. With --document the table goes into docs/design/performance.md.
"""

import ast
from functools import partial
import os
from pathlib import Path
import re
import tempfile
import time

from linkage_ros.linkage import Mechanism
import numpy as np

from . import document

ROOT = document.ROOT
ROUNDS, SAMPLE = 100, 1e-3
KINDS = {'solve': ('points', lambda x: x.points), 'velocity': ('velocities', lambda x: x.points),
         'joint_angles': ('angles', lambda x: x.joints),
         'transmission_angles': ('transmissions', lambda x: x.formulas.built.transmissions)}
# These and the methods of linkages are timed.
MODULES = 'mechanisms.create', 'scene.load'


def code_of_pages():
    """Return the code of README.md, and that of the tutorial; write its scene where this runs."""
    Path('gripper.yaml').write_text(re.search(
        r'```yaml\n(.*?)```', (document.DOCS / 'tutorial.md').read_text(), re.S)[1])
    readme = re.search(r'(?:^    .*\n)+', (ROOT / 'README.md').read_text().partition(
        '## The library')[2], re.M)[0]
    lines = re.findall(r'^>>> (.*)', (document.DOCS / 'tutorial.md').read_text(), re.M)
    return {'README': re.sub('^    ', '', readme, flags=re.M), 'tutorial': '\n'.join(lines)}


def calls(code):
    """Run code; yield the text of each call of the library, and the names that are known there."""
    known = {}
    for statement in ast.parse(code).body:
        exec(ast.unparse(statement), known)
        for call in ast.walk(statement):
            if not isinstance(call, ast.Call) or not isinstance(call.func, ast.Attribute):
                continue
            owner = known.get(getattr(call.func.value, 'id', None))
            if isinstance(owner, Mechanism) or ast.unparse(call.func) in MODULES:
                yield ast.unparse(call), dict(known)


def below(call, known):
    """Return what a call of a linkage stands on, as text and as a function; None for others."""
    call = ast.parse(call, mode='eval').body
    linkage, method = known.get(call.func.value.id), call.func.attr
    given = [eval(ast.unparse(x), known) for x in call.args]
    named = {x.arg: eval(ast.unparse(x.value), known) for x in call.keywords}
    if method in KINDS:
        kind, all_names = KINDS[method]
        names = [*given[1:], *named.values(), all_names(linkage)][0]
        pose, inputs = linkage.compiled(kind, tuple(names)), linkage.each_input(given[0])
        if not any(map(np.ndim, inputs)) and not pose.shape:
            return 'code of a pose', partial(pose.at, *map(float, inputs))
        return 'code of an array', partial(pose.over, *inputs)
    if method in ('servo_angle', 'servo_for'):
        output, value = ['lever', *given][-2:]
        return 'inverse.nearest', partial(linkage.inverse(output).nearest, [value])
    if method in ('input_for', 'inputs_for'):
        return 'inverse.all', partial(linkage.inverse(given[0]).all, given[1])
    return '', None


def short(call):
    """Return the text of a call, long ones without what is given."""
    return call if len(call) < 60 else call[:call.index('(')] + '(...)'


def times(functions):
    """Return the least CPU time of a call [us] of each function, all timed in turn."""
    counts = []
    for do in functions:
        start = time.process_time()
        do()
        do()
        counts.append(max(1, int(SAMPLE / max(0.5 * (time.process_time() - start), 1e-7))))
    least = [float('inf')] * len(functions)
    start = time.process_time()
    for _ in range(ROUNDS):
        for i, (do, count) in enumerate(zip(functions, counts)):
            begin = time.process_time()
            for _ in range(count):
                do()
            least[i] = min(least[i], 1e6 * (time.process_time() - begin) / count)
        if time.process_time() - start > 2.0:
            break
    return least


def rows():
    """Yield a row of the table for each call."""
    for page, code in code_of_pages().items():
        for call, known in calls(code):
            name, under = below(call, known)
            made = eval(f'lambda: {call}', known)
            own, *rest = times([made, *([under] if under else [])])
            yield page, f'`{short(call)}`', f'{own:.1f}', name, f'{rest[0]:.1f}' if rest else ''


def main():
    """Print the table."""
    options = document.parser(__doc__).parse_args()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        text = document.table(('page', 'call', '[us]', 'below it', '[us]'), rows())
    text += '\n\n' + document.machine()
    document.show(options, 'design/performance.md', text, 'measured: calls')


if __name__ == '__main__':
    main()
