# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0


"""What was just measured can be commanded, in C and through the transmission; see `commanded`."""

import ctypes
import re
import shutil

from c_libraries import COMPILER, loaded, ROS
import commanded
from linkage_ros.c_code import header
import numpy as np
import pytest

pytestmark = pytest.mark.skipif(not COMPILER, reason='there is no C compiler')
NEEDS = pytest.mark.skipif(not shutil.which('g++') or not ROS,
                           reason='g++ or rcutils is not installed')
KINDS = ['double', 'float', pytest.param('transmission', marks=[NEEDS, pytest.mark.nightly])]
MISSES = [1, 2, 4, 5]


@pytest.mark.parametrize('kind', KINDS)
def test_linkages_that_refused_what_they_measured(tmp_path, kind):
    cases = [*commanded.found()]
    counts = commanded.asked(tmp_path, cases, kind, 300)
    assert (counts[:, [0, 3]] > 280).all() and not counts[:, MISSES].any()


@pytest.mark.parametrize('number, output, joint_lines', [
    (number, *each) for number, each in enumerate(commanded.FOUND)])
def test_a_closed_form_knows_every_assembly_mode(tmp_path, number, output, joint_lines):
    machine = commanded.read(f'found{number}', joint_lines).machine
    linkage, text = machine.linkage, header.written(machine, [output])
    called, = re.findall(r'int (\w+_for_\w+)', text)
    invert = loaded(tmp_path, f"""{text}
int inverted(double value, double near, double *input) {{ return {called}(value, near, input); }}
""").inverted
    (low, high), = linkage.reach()
    for given in np.linspace(low, high, 41)[1:-1]:
        value = float(linkage.joint_angles(given, [output])[output])
        for near in (low, 0.5 * (low + high), high, given):
            found, best = ctypes.c_double(), linkage.input_for(output, value, near)
            assert invert(*map(ctypes.c_double, (value, near)), ctypes.byref(found)) == 1
            assert abs(found.value - near) == pytest.approx(abs(best - near), abs=1e-6)
            assert float(linkage.joint_angles(found.value, [output])[output]) == pytest.approx(
                value, abs=1e-12)


@pytest.mark.nightly
@pytest.mark.parametrize('kind', KINDS)
def test_the_catalogue(tmp_path, kind):
    cases = [*commanded.catalogue()]
    counts = commanded.asked(tmp_path, cases, kind, 300)
    assert (counts[:, 0] > 100).all() and not counts[:, MISSES].any()


# Of single precision 1 in 10 000 may miss, next to a pose that two inputs share.
@pytest.mark.nightly
@pytest.mark.parametrize('seeds', [range(12), range(12, 200)], ids=['few', 'many'])
@pytest.mark.parametrize('kind, most', [('double', 0.0), ('float', 1e-4), pytest.param(
    'transmission', 0.0, marks=NEEDS)])
def test_random_linkages(tmp_path, kind, most, seeds):
    cases = [*commanded.drawn(seeds)]
    counts = sum(commanded.asked(tmp_path / f'{i}', cases[i:i + 25], kind, 300).sum(axis=0)
                 for i in range(0, len(cases), 25))
    assert counts[0] > 20 * len(seeds) and counts[MISSES].sum() <= most * counts[[0, 3]].sum()
