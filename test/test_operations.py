# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Every row of the table of operations, by every back end, against multiprecision."""

import ctypes
from functools import lru_cache
import inspect
import math
import operator

from c_libraries import loaded
import gmpy2
from linkage_ros.c_code import header
from linkage_ros.formula import expression, program
from linkage_ros.formula.operations import OPERATIONS, WITHOUT_RATE
import numpy as np
import pytest
from scenes import alone

NAN = gmpy2.nan()
# What each comes to, in as many digits as are asked for.
TRUTH = {
    'add': operator.add, 'subtract': operator.sub, 'multiply': operator.mul,
    'divide': operator.truediv, 'negative': operator.neg, 'absolute': abs, 'sqrt': gmpy2.sqrt,
    'sin': gmpy2.sin, 'cos': gmpy2.cos, 'atan2': gmpy2.atan2,
    'sum_error': lambda x, y: x + y - gmpy2.mpfr(float(x) + float(y)),
    'rint': lambda x: gmpy2.mpfr(round(gmpy2.mpq(x))),
    'less': lambda x, y: gmpy2.mpfr(x < y), 'less_equal': lambda x, y: gmpy2.mpfr(x <= y),
    'where': lambda c, x, y: x if c < 0 else y,
    'root': lambda x, t: gmpy2.sqrt(x) if x > 0 else gmpy2.mpfr(0) if x >= -abs(t) else NAN,
    'valid_where': lambda x, margin, t: x if margin >= -abs(t) else NAN}
# Ulps: of the C library, of numpy over arrays, of `elementary`; all else is rounded correctly.
ELEMENTARY = {'sin': (1.0, 4.0, 1.0), 'cos': (1.0, 4.0, 1.0), 'atan2': (1.0, 4.0, 2.0)}
SPECIAL = [0.0, -0.0, 1.0, -1.5, 2.5, math.inf, -math.inf, math.nan, 5e-324, 1e308]
NAMES = sorted(OPERATIONS)


def arity(name):
    """Return how many operands an operation has."""
    return len(inspect.signature(OPERATIONS[name].llvm).parameters) - 1


def applied(name, operands):
    """Return an operation on operands as a number; what it asks of them is seen to."""
    if name == 'where':
        operands = [operands[0] < 0.0, *operands[1:]]
    elif name in ('root', 'valid_where'):
        operands = [*operands[:-1], abs(operands[-1])]
    done = expression.operation(name, *operands)
    return expression.where(done, 1.0, 0.0) if name.startswith('less') else done


def numbers(name, special=False):
    """Return operands, an array for each."""
    rng = np.random.default_rng(NAMES.index(name))
    if special:
        return [each.ravel() for each in np.meshgrid(*arity(name) * [SPECIAL])]
    values = [rng.choice([-1.0, 1.0], 300) * 10.0 ** rng.uniform(-3.0, 3.0, 300)
              for _ in range(arity(name))]
    values[0][:40] = np.arange(-10.0, 10.0, 0.5)
    values[-1][40:60] = -values[0][40:60]
    return [np.abs(values[0])] if name == 'sqrt' else values


@lru_cache(None)
def bound(name, accelerate=False):
    arguments = [expression.argument(i) for i in range(arity(name))]
    return program.Program([applied(name, arguments)], len(arguments)).bind({}, {}, accelerate)


def by_floats(name, values):
    return np.array([bound(name).at(*row)[0] for row in zip(*(v.tolist() for v in values))])


def by_arrays(name, values):
    return bound(name).searched(*values)[0]


def by_dimensions(name, values):
    """Return what is worked out when dimensions are set: all at once, and one by one alike."""
    keys = 'abc'[:arity(name)]
    node = applied(name, [expression.dimension(key, positive=False) for key in keys])
    with np.errstate(all='ignore'):
        results = program.evaluate(node, dict(zip(keys, values)), {})
        alone = [program.evaluate(node, dict(zip(keys, row)), {}) for row in zip(*values)]
    assert np.array_equal(results, alone, equal_nan=True) or name in ELEMENTARY
    return np.asarray(alone)


def by_loop(name, values):
    pytest.importorskip('llvmlite')
    rows, pose = np.empty((values[0].size, 1)), bound(name)
    batch = pose.batch(rows)
    batch.arguments[:] = values
    pose.variant.loop.result()
    assert batch.solve()
    return rows[:, 0]


def by_lanes(name, values):
    pytest.importorskip('llvmlite')
    return bound(name, True).over(*values)[0]


@pytest.fixture(scope='module')
def c_library(tmp_path_factory):
    """Return a function that does an operation in C, for double or float."""
    libraries = {}
    lever = alone('slotted_lever')
    for kind, f in (('double', ''), ('float', 'f')):
        text = [header.written(lever, (), bool(f))]
        for name, row in OPERATIONS.items():
            operands = [f'x[{i}][n]' for i in range(arity(name))]
            if name == 'where':
                operands[0] = f'({operands[0]} < 0)'
            elif name in ('root', 'valid_where'):
                operands[-1] = f'fabs{f}({operands[-1]})'
            code = row.c.replace('{f}', f).format(*operands)
            text.append(f'void do_{name}(long size, const {kind} **x, {kind} *out) '
                        f'{{ long n; for (n = 0; n < size; n++) out[n] = {code}; }}')
        libraries[kind] = loaded(tmp_path_factory.mktemp('operations'), '\n'.join(text))

    def done(name, values, kind):
        values = [np.ascontiguousarray(each, kind) for each in values]
        out = np.empty(values[0].size, kind)
        places = (ctypes.c_void_p * len(values))(*(each.ctypes.data for each in values))
        libraries[{8: 'double', 4: 'float'}[out.itemsize]][f'do_{name}'](
            ctypes.c_long(out.size), places, ctypes.c_void_p(out.ctypes.data))
        return out

    return done


@lru_cache(len(NAMES))
def truths(name, values):
    """Return what an operation comes to."""
    return [TRUTH[name](*map(gmpy2.mpfr, map(float, row))) for row in zip(*values)]


def off(name, values, results):
    """Return by how many ulps of its own kind of number an operation is off at most."""
    with gmpy2.context(precision=300):
        true = truths(name, tuple(map(tuple, values)))
        gone = np.array([gmpy2.is_nan(x) for x in true])
        assert np.array_equal(np.isnan(results), gone) and not gone.all()
        return max(float(abs(gmpy2.mpfr(float(value)) - x))
                   / float(np.spacing(np.abs(results.dtype.type(x))))
                   for value, x in zip(results, true) if not gmpy2.is_nan(x))


def test_there_is_a_truth_for_each():
    assert TRUTH.keys() == OPERATIONS.keys()
    assert all(name == row.name for name, row in OPERATIONS.items())


@pytest.mark.nightly(all_but=45)
@pytest.mark.parametrize('back_end, column', [
    (by_floats, 0), (by_dimensions, 1), (by_arrays, 1), (by_loop, 0), (by_lanes, 2)],
    ids=lambda x: getattr(x, '__name__', ''))
@pytest.mark.parametrize('name', NAMES)
def test_each_is_right_to_the_last_digit(name, back_end, column):
    values = numbers(name)
    most = ELEMENTARY[name][column] if name in ELEMENTARY else 0.5
    assert off(name, values, back_end(name, values)) <= most


@pytest.mark.parametrize('kind', [np.float64, np.float32], ids=['double', 'float'])
@pytest.mark.parametrize('name', NAMES)
def test_so_it_is_in_c(name, kind, c_library):
    values = [each.astype(kind) for each in numbers(name)]
    if name == 'sum_error' and kind is np.float32:
        sums = values[0] + values[1]
        exact = (values[0].astype(float) + values[1]) - sums
        assert np.array_equal(c_library(name, values, kind), exact)
        return
    most = ELEMENTARY[name][0] if name in ELEMENTARY else 0.5
    assert off(name, values, c_library(name, values, kind)) <= most


@pytest.mark.parametrize('name', NAMES)
def test_infinity_zeros_and_nan_are_the_same_to_all(name, c_library):
    values = numbers(name, special=True)
    expected = by_arrays(name, values)
    zero = expected == 0.0
    for results in (by_floats(name, values), by_dimensions(name, values), by_loop(name, values),
                    by_lanes(name, values), c_library(name, values, np.float64)):
        np.testing.assert_allclose(results, expected, rtol=1e-15, atol=0.0)
        assert np.array_equal(np.signbit(results)[zero], np.signbit(expected)[zero])


def test_a_constant_is_known_to_be_positive_if_it_is():
    for value in (*SPECIAL, -0.5, -5e-324):
        assert bool(expression.real(value).positive) == (value > 0.0)


@pytest.mark.parametrize('name', NAMES)
def test_constants_come_to_what_floats_do(name):
    values = numbers(name)
    results = by_floats(name, values)
    for row, value in zip(zip(*values), results.tolist()):
        folded = applied(name, list(map(expression.real, row)))
        if folded.value is not None:
            assert folded.value == value
    assert OPERATIONS[name].folded is None or name == 'where' or folded.value is not None


@pytest.mark.parametrize('name', NAMES)
def test_the_derivative_is_what_differences_tend_to(name):
    rng = np.random.default_rng(1)
    count, h = arity(name), gmpy2.mpfr(2) ** -80
    arguments = [expression.argument(i) for i in range(count)]
    rates = dict(enumerate(rng.uniform(-2.0, 2.0, count).tolist()))
    if name in ('root', 'valid_where'):  # a tolerance is a constant
        rates[count - 1] = 0.0
    made = expression.derivative(applied(name, arguments), rates, {})
    if name in WITHOUT_RATE:
        assert made.value == 0.0
        return
    pose = program.Program([made], count).bind({}, {})
    for row in rng.uniform(-3.0, 3.0, (100, count)).tolist():
        # Where a root is zero within its tolerance, its rate has no bound.
        row[0] = abs(row[0]) if name == 'root' else row[0]
        with gmpy2.context(precision=400):
            exact = list(map(gmpy2.mpfr, row))
            ahead, behind = (TRUTH[name](*(x + sign * h * gmpy2.mpfr(rates[i])
                                           for i, x in enumerate(exact))) for sign in (1, -1))
            true = float((ahead - behind) / (2 * h))
        if math.isfinite(true):
            assert pose.at(*row)[0] == pytest.approx(true, rel=1e-12, abs=1e-14)


@pytest.mark.parametrize('name', [name for name in NAMES if OPERATIONS[name].positive])
def test_what_is_known_of_signs_holds(name):
    values = numbers(name)
    for i in OPERATIONS[name].positive:
        values[i] = np.abs(values[i]) + 1e-9
    assert np.all(by_floats(name, values) > 0.0)


def test_a_sum_keeps_every_digit_however_much_cancels():
    rng = np.random.default_rng(5)
    for count in (3, 4, 6):
        names = 'abcdef'[:count]
        first, second, *rest = map(expression.dimension, names)
        # Terms that are sums or differences are expanded.
        node = expression.exact_sum(first - second, *rest[:-2], sum(rest[-2:]))
        for _ in range(300):
            terms = rng.uniform(-1.0, 1.0, count) * 2.0 ** rng.integers(-30, 30, count)
            terms[-1] = -math.fsum(terms[:-1]) * (1.0 + rng.integers(-2, 3) * 2.0 ** -52)
            values = dict(zip(names, terms.tolist()))
            results = program.evaluate(node, {**values, 'b': -values['b']}, {})
            assert results == math.fsum(terms)


def test_a_sum_of_many_terms_costs_no_more_than_adding_them_up():
    a, b = map(expression.dimension, 'ab')
    node = expression.exact_sum(sum([a] * 500), -b, a)
    assert len(program.in_order([node])) < 520
    assert program.evaluate(node, {'a': 0.25, 'b': 125.0}, {}) == 0.25


def test_a_sum_of_two_terms_costs_one_operation_and_zeros_cost_none():
    a, b = map(expression.dimension, 'ab')
    for terms in ((a, b), (a, 0.0, b)):
        listed = program.in_order([expression.exact_sum(*terms)])
        assert [x.op for x in listed if x.operands] == ['add']
