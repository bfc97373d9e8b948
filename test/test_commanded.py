# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What was just measured can be commanded, in C, over the catalogue and random linkages.

Each question measures a pose, then commands the joints to be where they are, or where they are
beside it: at inputs that differ by 1e-3 rad or sizes. Counted are questions, those that are
refused, and answers with another pose: not the one asked for, and farther away.
"""

from contextlib import suppress
import ctypes
import subprocess

from c_libraries import COMPILER, loaded, SAMPLE, SANITIZED
from linkage_ros import mechanisms, scene
from linkage_ros.c_code import header
from linkage_ros.c_code.axes import joints
from linkage_ros.c_code.package import ranges
import numpy as np
import pytest
from truth import random_linkages

pytestmark = pytest.mark.skipif(not COMPILER, reason='there is no C compiler')
NUMBERS = pytest.mark.parametrize('number', ['double', 'float'])
# Linkages for which a fault was found: a closed form was missing an assembly mode.
FAULTS = [('DE', ['A ground 0 0', 'B ground 0 1.4', 'C cylinder B A 1.0157 right',
                  'D E F inversor B C 1.2375 0.3369'])]
QUESTIONS = """
void {name}_counts(long poses, long *counts)
{{
    static const {number} slack = {slack};
    static const double ranges[{n}][2] = {ranges};
    static {name}_memory m;
    long i;
    int k, side;
    if (!{name}_begin(&m))
        return;
    for (i = 1; i <= poses; i++) {{
        {number} q[{n}], beside[{n}], gap[{n}], least;
        lkr_point p, goal;
        lkr_side measured = {{ {{ 0 }}, {{ 0 }}, {{ 0 }} }};
        lkr_side asked = measured, found = measured;
        sample({n}, ranges, i, q);
        if (!{name}_at(q, &p))
            continue;
        for (k = 0; k < {n}; k++)
            beside[k] = q[k] + (i & 1 << k ? 1 : -1) * ({number})1e-3;
        for (side = 0; side < 2; side++) {{
            goal = p;
            if (side && !{name}_at(beside, &goal))
                continue;
            for (k = 0; k < {n}; k++)
                measured.position[k] = p.position[0][k];
            if ({name}_actuators_to_joints(&m, &measured, &asked) & 1)
                continue;
            counts[0]++;
            for (k = 0; side && k < {n}; k++)
                asked.position[k] = goal.position[1][k];
            if ({name}_joints_to_actuators(&m, &asked, &found) & 1) {{
                counts[1]++;
                continue;
            }}
            least = lkr_gap(&{name}_model, 0, found.position, &goal, gap);
            if (least > slack && lkr_gap(&{name}_model, 0, found.position, &p, gap)
                > slack + 2 * lkr_gap(&{name}_model, 0, goal.position[0], &p, beside))
                counts[2]++;
        }}
    }}
}}
"""


def read(name, joint_lines, names=(), **given):
    """Return a mechanism of joint lines, with the names of its commanded joints."""
    mechanism, = scene.read({
        'mechanisms': [name], f'{name}.type': 'custom', f'{name}.joints': list(joint_lines),
        **{f'{name}.{key}': value for key, value in given.items()}}).mechanisms.values()
    joints(mechanism, names)
    return header.Request(mechanism, (), tuple(names))


def drawn(seeds):
    """Yield random linkages, each with its default joints and with other outputs."""
    for seed in seeds:
        rng = np.random.default_rng(seed)
        design = random_linkages.design(rng)
        given = {f'dimensions.{key}': float(value) for key, value in design.dimensions.items()}
        names = [()]
        for i in range(3):
            name = f'm{seed}_{i}'
            with suppress(scene.SceneError, ValueError):  # no pose, or not these outputs
                case = read(name, design.joints, names[i] if i < len(names) else (), **given)
                yield case
                if not i:
                    linkage = case.mechanism.linkage
                    others = [*linkage.joints, *(f'{point}.{axis}' for point in linkage.points
                                                 for axis in 'xy')]
                    names += [[f'm{seed}_{k}_{output}' for output in rng.choice(
                        others, len(linkage.inputs), replace=False)] for k in (1, 2)]


def code(cases, number='double'):
    """Return the C of cases, with functions that put questions."""
    return header.printed(cases, number == 'float') + SAMPLE + ''.join(
        QUESTIONS.format(name=case.mechanism.name, number=number, n=len(case.mechanism.inputs),
                         slack='1e-2f' if number == 'float' else '1e-6',
                         ranges=ranges(case.mechanism)) for case in cases)


def questions(folder, cases, number):
    """Return how many questions were put to each case, and raise if there were misses."""
    folder.mkdir(parents=True, exist_ok=True)
    library, counts = loaded(folder, code(cases, number), '-O1'), {}
    for case in cases:
        counts[case.mechanism.name] = (ctypes.c_long * 3)()
        library[f'{case.mechanism.name}_counts'](ctypes.c_long(300), counts[case.mechanism.name])
    assert {name: each[:] for name, each in counts.items() if any(each[1:])} == {}
    return [each[0] for each in counts.values()]


def test_sanitizers_find_nothing(tmp_path):
    def ran(name, text):
        (tmp_path / f'{name}.c').write_text(text)
        for command_line in ([COMPILER, '-std=c99', *SANITIZED, tmp_path / f'{name}.c', '-o',
                              tmp_path / name, '-lm'], [tmp_path / name]):
            ended = subprocess.run(command_line, capture_output=True, text=True)
            if ended.returncode:
                return ended.stderr[:2000]
        return ended.stdout

    if ran('none', 'int main(void) { return 0; }\n'):
        pytest.skip('no program with sanitizers is linked or runs here')
    cases = [read('lever', FAULTS[0][1]), *map(header.Request, scene.read({
        'mechanisms': ['leg'], 'leg.type': 'five_bar', 'leg.loads': ['P=3 -20']}
        ).mechanisms.values())]
    printed = ran('asked', '#include <stdio.h>\n' + code(cases) + 'int main(void)\n{\n' + ''.join(
        f"""long {name}[3] = {{ 0, 0, 0 }};
{name}_counts(2000, {name});
printf("%d", {name}[0] > 1000 && !{name}[1] && !{name}[2]);
""" for name in ('lever', 'leg')) + '}\n')
    assert printed == '11'


@pytest.mark.nightly
@NUMBERS
def test_the_catalogue_and_what_was_refused(tmp_path, number):
    catalogue = scene.read({'mechanisms': [*mechanisms.TYPES], **{
        f'{name}.type': name for name in mechanisms.TYPES}}).mechanisms.values()
    faults = [read(f'fault{i}', joint_lines, [f'fault{i}_{output}'])
              for i, (output, joint_lines) in enumerate(FAULTS)]
    assert min(questions(tmp_path, [*map(header.Request, catalogue), *faults], number)) > 200


@pytest.mark.nightly
@pytest.mark.parametrize('seeds', [range(12), range(12, 200)], ids=['few', 'many'])
@NUMBERS
def test_random_linkages(tmp_path, number, seeds):
    cases = [*drawn(seeds)]
    assert sum(sum(questions(tmp_path / f'{i}', cases[i:i + 25], number))
               for i in range(0, len(cases), 25)) > 400 * len(seeds)
