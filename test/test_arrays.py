# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Arrays by machine code: functions good to an ulp, and a pose that is the same in any array."""

import math
import os
import subprocess
import sys

import gmpy2
from linkage_ros import mechanisms
from linkage_ros.formula import elementary, expression, program
import numpy as np
import pytest

pytest.importorskip('linkage_ros.formula.llvm_code')

X, Y = expression.argument(0), expression.argument(1)
# More than one thread takes.
MANY = 200_000


def over_arrays(outputs, *arguments):
    """Return expressions over arrays, by machine code."""
    return program.Program(outputs, len(arguments)).bind({}, {}, True).over(*arguments)


def worst(found, exact, *arguments):
    """Return the largest error of a function, in ulps of the true result."""
    with gmpy2.context(precision=150):
        true = [exact(*map(gmpy2.mpfr, row)) for row in zip(*(a.tolist() for a in arguments))]
        return max(abs(value - x) / np.spacing(abs(float(x)))
                   for value, x in zip(found.tolist(), true))


def angles(rng):
    """Return angles of every size, many of them next to multiples of a quarter turn."""
    powers = 2.0 ** np.repeat(np.arange(-1074.0, 1024.0), 2)
    multiples = np.pi / 2 * np.concatenate([np.arange(200), rng.integers(200, 2 ** 15, 2000)])
    edge = elementary.LARGEST_ANGLE
    close = [np.nextafter(multiples, sign * np.inf) for sign in (-1, 1)]
    sizes = np.concatenate([powers * rng.uniform(1.0, 2.0, powers.size), multiples, *close,
                            np.pi / 4 * np.arange(1, 400, 2), rng.uniform(0.0, 4.0, 2000),
                            rng.uniform(0.0, edge, 2000), np.nextafter(edge, [0.0, 1e9]), [edge]])
    sizes = sizes[np.isfinite(sizes)]
    return sizes * rng.choice([-1.0, 1.0], sizes.size)


@pytest.mark.parametrize('made, exact', [(expression.sine, gmpy2.sin),
                                         (expression.cosine, gmpy2.cos)])
def test_sine_and_cosine_are_off_by_less_than_an_ulp(made, exact):
    thetas = angles(np.random.default_rng(0))
    assert worst(over_arrays([made(X)], thetas)[0], exact, thetas) < 1.0


def test_the_arctangent_is_off_by_less_than_two():
    rng = np.random.default_rng(1)
    sizes = 10.0 ** rng.uniform(-280.0, 280.0, 4000)
    ratios = np.concatenate([10.0 ** rng.uniform(-20.0, 20.0, 4000), rng.uniform(0.4, 2.5, 4000)])
    y = np.concatenate([sizes, sizes]) * rng.choice([-1.0, 1.0], ratios.size)
    x = y * ratios * rng.choice([-1.0, 1.0], ratios.size)
    found = over_arrays([expression.arctangent(Y, X)], x, y)[0]
    assert worst(found, gmpy2.atan2, y, x) < 2.0


def test_the_arctangent_of_zeros_and_infinities_is_that_of_the_c_library():
    some = -math.inf, -2.0, -0.0, 0.0, 2.0, math.inf, math.nan
    y, x = map(np.ravel, np.meshgrid(some, some))
    found, expected = over_arrays([expression.arctangent(Y, X)], x, y)[0], np.arctan2(y, x)
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(np.signbit(found), np.signbit(expected))


def asked(linkage, thetas):
    """Return places and angles as one array, a row for each theta."""
    found = {**linkage.solve(thetas), **linkage.joint_angles(thetas)}
    return np.column_stack([values.reshape(thetas.size, -1) for values in found.values()])


@pytest.mark.parametrize('kind', ['jansen', 'slotted_lever'])
def test_a_pose_is_the_same_in_any_array(kind):
    linkage = mechanisms.create(kind).accelerated()
    thetas = np.random.default_rng(2).uniform(-9.0, 9.0, 43)
    thetas[::7] = [1e300, math.nan, -1e9, math.inf, -0.0, 6e4, 0.0]
    whole = asked(linkage, thetas)
    assert np.isfinite(whole).all(axis=1).sum() == thetas.size - 2
    for part in (slice(0, 1), slice(3, 10), slice(5, 13), slice(None, None, -1), slice(1, 40, 3)):
        assert np.array_equal(asked(linkage, thetas[part]), whole[part], equal_nan=True)
    assert linkage.solve(thetas[:0])['A'].shape == (0, 2)


@pytest.mark.skipif(not hasattr(os, 'sched_setaffinity'), reason='cores cannot be chosen')
def test_a_pose_is_the_same_on_any_number_of_cores():
    linkage = mechanisms.create('jansen').accelerated()
    thetas, cores = np.random.default_rng(3).uniform(-9.0, 9.0, MANY), os.sched_getaffinity(0)
    on_all = asked(linkage, thetas)
    os.sched_setaffinity(0, {min(cores)})
    try:
        assert np.array_equal(asked(linkage, thetas), on_all)
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
    assert linkage.posed().variant.arrays is grown.posed().variant.arrays
