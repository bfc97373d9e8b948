# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Machine code says what plain Python says, of arrays to an ulp, and is done without."""

import importlib
import math
import os
import subprocess
import sys
import threading
import warnings

from linkage_ros import mechanisms
from linkage_ros.formula import elementary, expression, program
from linkage_ros.scene.legs import LegGroup
import numpy as np
import pytest
from test_operations import by_lanes, off

native = pytest.importorskip('linkage_ros.formula.llvm_code')


class Code(native.Loop):
    """Machine code that counts how often it is made and run; it is made when it may be."""

    made, ran, allowed = 0, 0, threading.Event()

    def __init__(self, *operations):
        Code.allowed.wait(20.0)
        super().__init__(*operations)
        Code.made += 1
        self._run, self.run = self.run, self._counted

    def _counted(self, *arguments):
        Code.ran += 1
        self._run(*arguments)


@pytest.fixture
def code(monkeypatch):
    """Return the class of all machine code that is made in a test."""
    monkeypatch.setattr(native, 'Loop', Code)
    Code.made = Code.ran = 0
    Code.allowed.set()
    return Code


def fresh(name):
    """Return a linkage whose code nobody has asked for, as no other joint is called so."""
    return mechanisms.create('custom', joints=[
        'O ground 0 0', 'Q ground 3 0', 'A crank O 1', f'{name} dyad A Q 2.5 2.5 left'])


def wait_for_compilers():
    """Wait for the threads that compile."""
    for thread in threading.enumerate():
        if thread.name.startswith('linkage_ros compiler'):
            thread.join()


def test_nobody_waits_for_the_compiler(code):
    linkage = fresh('Waited')
    code.allowed.clear()
    solution = LegGroup(linkage, 2).solution(('Waited',))
    solution.solve([0.3])
    expected = solution.rows.copy()
    assert expected[0] == pytest.approx(linkage.solve(0.3)['Waited']) and not code.made
    code.allowed.set()
    wait_for_compilers()
    solution.rows[:] = 0.0
    solution.solve([0.3])
    assert np.array_equal(solution.rows, expected) and code.ran == 1


def test_what_cannot_be_compiled_is_done_in_plain_python(monkeypatch):
    def refuse(*_):
        raise RuntimeError('no such processor')

    monkeypatch.setattr(native, 'Loop', refuse)
    linkage = fresh('Refused')
    solution = LegGroup(linkage, 2).solution(('Refused',))
    wait_for_compilers()
    with pytest.warns(UserWarning, match='no machine code.*no such processor'):
        solution.solve([0.2])
    # It is told once, not for each message.
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        solution.solve([0.3])
    assert solution.rows[0] == pytest.approx(linkage.solve(0.3)['Refused'])


def test_an_llvmlite_that_is_too_old_is_named(monkeypatch):
    monkeypatch.delattr('llvmlite.binding.create_pass_builder')
    monkeypatch.setattr('llvmlite.__version__', '0.41.1')
    with pytest.raises(ImportError, match='llvmlite 0.44 or newer is needed, this is 0.41.1'):
        importlib.reload(native)


@pytest.mark.nightly
@pytest.mark.parametrize('legs', [1, 2])
def test_a_single_leg_is_solved_without_llvmlite_in_memory(legs):
    done = subprocess.run([sys.executable, '-c', f"""
import sys, threading
from linkage_ros import mechanisms
from linkage_ros.scene.legs import LegGroup
LegGroup(mechanisms.create('jansen'), {legs}).solution(('G',), ('BC',)).solve([0.3])
for thread in threading.enumerate():
    if thread is not threading.main_thread():
        thread.join()
print('llvmlite' in sys.modules)"""], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [str(legs > 1)]


def test_it_is_compiled_once_for_all_mechanisms_of_a_type(code):
    for _ in range(3):
        solution = LegGroup(fresh('Shared'), 2).solution(('Shared',))
        wait_for_compilers()
        solution.solve([0.3])
    assert (code.made, code.ran) == (1, 3)


def test_a_chain_of_operations_may_be_as_long_as_one_likes():
    # Each is used once, so that the code would nest them all, and Python stops at 200 parentheses.
    end, value = expression.argument(0), 0.3
    for _ in range(1000):
        end, value = 1.5 * expression.sine(end) + 0.25, 1.5 * math.sin(value) + 0.25
    pose = program.Program((end,)).bind({}, {})
    assert pose.at(0.3) == (value,)
    assert pose.over(np.full(100, 0.3)).ravel().tolist() == pytest.approx([value] * 100)


# --- arrays ---

# More than one thread takes.
MANY = 200_000


def angles(rng):
    """Return angles of every size, many of them next to multiples of a quarter turn."""
    powers = 2.0 ** np.arange(-1074.0, 1024.0)
    multiples = np.pi / 2 * np.concatenate([np.arange(200), rng.integers(200, 2 ** 15, 800)])
    edge = elementary.MAX_ANGLE
    close = [np.nextafter(multiples, sign * np.inf) for sign in (-1, 1)]
    sizes = np.concatenate([powers * rng.uniform(1.0, 2.0, powers.size), multiples, *close,
                            np.pi / 4 * np.arange(1, 400, 2), rng.uniform(0.0, 4.0, 800),
                            rng.uniform(0.0, edge, 800), np.nextafter(edge, [0.0, 1e9]), [edge]])
    sizes = sizes[np.isfinite(sizes)]
    return [sizes * rng.choice([-1.0, 1.0], sizes.size)]


def sides(rng):
    """Return y and x of every size and ratio."""
    sizes = 10.0 ** rng.uniform(-280.0, 280.0, 2000)
    ratios = np.concatenate([10.0 ** rng.uniform(-20.0, 20.0, 2000), rng.uniform(0.4, 2.5, 2000)])
    y = np.concatenate([sizes, sizes]) * rng.choice([-1.0, 1.0], ratios.size)
    return [y, y * ratios * rng.choice([-1.0, 1.0], ratios.size)]


@pytest.mark.parametrize('name, values, most', [
    ('sin', angles, 1.0), ('cos', angles, 1.0), ('atan2', sides, 2.0)])
def test_elementary_functions_are_off_by_less_than_an_ulp_or_two(name, values, most):
    numbers = values(np.random.default_rng(0))
    assert off(name, numbers, by_lanes(name, numbers)) < most


def quantities_of(linkage, thetas):
    """Return places and angles as one array, a row for each theta."""
    quantities = {**linkage.solve(thetas), **linkage.joint_angles(thetas)}
    return np.column_stack([values.reshape(thetas.size, -1) for values in quantities.values()])


@pytest.mark.parametrize('kind', ['jansen', 'slotted_lever'])
def test_a_pose_is_the_same_in_any_array(kind):
    linkage = mechanisms.create(kind).accelerated()
    thetas = np.random.default_rng(2).uniform(-9.0, 9.0, 43)
    thetas[::7] = [1e300, math.nan, -1e9, math.inf, -0.0, 6e4, 0.0]
    whole = quantities_of(linkage, thetas)
    assert np.isfinite(whole).all(axis=1).sum() == thetas.size - 2
    for part in (slice(0, 1), slice(3, 10), slice(5, 13), slice(None, None, -1), slice(1, 40, 3)):
        assert np.array_equal(quantities_of(linkage, thetas[part]), whole[part], equal_nan=True)
    assert linkage.solve(thetas[:0])['A'].shape == (0, 2)


@pytest.mark.skipif(not hasattr(os, 'sched_setaffinity'), reason='cores cannot be chosen')
def test_a_pose_is_the_same_on_any_number_of_cores():
    linkage = mechanisms.create('jansen').accelerated()
    thetas, cores = np.random.default_rng(3).uniform(-9.0, 9.0, MANY), os.sched_getaffinity(0)
    on_all = quantities_of(linkage, thetas)
    os.sched_setaffinity(0, {min(cores)})
    try:
        assert np.array_equal(quantities_of(linkage, thetas), on_all)
    finally:
        os.sched_setaffinity(0, cores)


@pytest.mark.nightly
def test_a_process_that_is_forked_has_threads_of_its_own():
    code = f"""
import os
from linkage_ros import mechanisms
import numpy as np

linkage, thetas = mechanisms.create('jansen').accelerated(), np.zeros({MANY})
before = linkage.solve(thetas, ['G'])['G']
if child := os.fork():
    exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
os._exit(not np.array_equal(linkage.solve(thetas, ['G'])['G'], before))
"""
    subprocess.run([sys.executable, '-W', 'ignore', '-c', code], check=True, timeout=60.0)


def test_what_is_compiled_serves_all_dimensions():
    linkage = mechanisms.create('jansen').accelerated()
    grown = linkage.with_dimensions(m=16.0)
    assert linkage.compiled_pose().variant.arrays is grown.compiled_pose().variant.arrays
