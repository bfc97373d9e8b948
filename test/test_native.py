# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Machine code says what plain Python says, and is done without where there is none."""

import importlib
import math
import subprocess
import sys
import threading
import warnings

from linkage_ros import mechanisms
from linkage_ros.formula import expression, program
from linkage_ros.scene.legs import Assembly
import numpy as np
import pytest

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


def by_batch(linkage, thetas):
    """Return the points that machine code finds, a row for each column of inputs."""
    thetas = np.atleast_2d(thetas)
    rows = np.empty((thetas.shape[1], 2 * len(linkage.points)))
    batch = linkage.posed().batch(rows)
    batch.arguments[:] = thetas
    wait_for_compilers()
    assert batch.solve()
    return rows


def test_nobody_waits_for_the_compiler(code):
    linkage = fresh('Waited')
    code.allowed.clear()
    solution = Assembly(linkage, 2).solution(('Waited',))
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
    solution = Assembly(linkage, 2).solution(('Refused',))
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
from linkage_ros.scene.legs import Assembly
Assembly(mechanisms.create('jansen'), {legs}).solution(('G',), ('BC',)).solve([0.3])
for thread in threading.enumerate():
    if thread is not threading.main_thread():
        thread.join()
print('llvmlite' in sys.modules)"""], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [str(legs > 1)]


def test_it_is_compiled_once_for_all_mechanisms_of_a_type(code):
    for _ in range(3):
        by_batch(fresh('Shared'), 0.3)
    assert (code.made, code.ran) == (1, 3)


def test_a_chain_of_operations_may_be_as_long_as_one_likes():
    # Each is used once, so that the code would nest them all, and Python stops at 200 parentheses.
    end, value = expression.argument(0), 0.3
    for _ in range(1000):
        end, value = 1.5 * expression.sine(end) + 0.25, 1.5 * math.sin(value) + 0.25
    pose = program.Program((end,)).bind({}, {})
    assert pose.at(0.3) == (value,)
    assert pose.over(np.full(100, 0.3)).ravel().tolist() == pytest.approx([value] * 100)
