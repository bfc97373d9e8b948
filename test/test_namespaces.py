# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0


"""Formulas as functions of arrays of other packages: the same values, NaN, finite gradients."""

from functools import cache
import math

from linkage_ros import mechanisms, scene
import numpy as np
import pytest
from scenes import custom, ROOT
from truth.cases import CASES

# Outputs with an inverse in closed form.
INVERSES = {'five_bar': ('P.x', 'P.y'), 'ankle': ('pitch', 'roll'), 'four_bar': ('QB',),
            'slotted_lever': ('lever',), 'slider_crank': ('block',),
            'excavator': ('OB', 'AD', 'EG')}
KINDS = [*mechanisms.TYPES, 'excavator', 'ankle']
FEW, MANY = 300, 10_000
# The largest error of values in the size of each output, and of rates in 99.9 % of poses.
EXACT, RATED = 1e-13, 1e-12


@cache
def linkage(kind):
    """Return a linkage of the catalogue, of an example or of a scene."""
    files = {'ankle': ROOT / 'examples' / 'ankle.yaml',
             'excavator': ROOT / 'config' / 'excavator.yaml'}
    if kind == 'geared':
        return custom('O ground 0 0', 'Q ground 2 0', 'A crank O 1',
                      'C crank Q 0.5 geared crank -2 0.3', 'B dyad A C 2 2 left')
    if kind in files:
        return scene.load(files[kind]).mechanisms[kind].linkage
    if kind in CASES:
        return CASES[kind].linkage()
    return mechanisms.create(kind)


def inputs(kind, count):
    """Return values of the inputs, most of them in reach, as an array for each."""
    rng, ends = np.random.default_rng(0), [(max(each.low, -3.1), min(each.high, 3.1))
                                           for each in linkage(kind).inputs]
    part = 0.35 if kind == 'ankle' else 1.05
    return [0.5 * (low + high) + 0.5 * part * (high - low) * rng.uniform(-1.0, 1.0, count)
            for low, high in ends]


def requested(kind):
    """Return points, joints and rates of all kinds."""
    mechanism = linkage(kind)
    return mechanism.points, mechanism.joints, mechanism.joints


def expected(kind, inputs_):
    """Return the library's values, and the size of each output."""
    rows = linkage(kind).compiled_pose(*requested(kind)).searched(*inputs_)
    # Some rates vanish, and are differences of others.
    return rows, np.fmax(np.nanmax(np.abs(rows), axis=1, keepdims=True),
                         min(linkage(kind).longest, 1.0))


def errors(results, rows, sizes):
    """Return errors in sizes; fail where one is NaN and the other is not."""
    results = np.array([np.asarray(row) for row in results])
    assert np.array_equal(np.isnan(results), np.isnan(rows))
    return np.nan_to_num(np.abs(results - rows) / np.maximum(sizes, np.abs(rows)))


@pytest.fixture(scope='module')
def strict():
    """Return what has nothing but the standard, and a device that numpy's arrays are not on."""
    return pytest.importorskip('array_api_strict', reason='array_api_strict is not installed')


def other_device(strict):
    """Return a device that numpy's arrays are not on; with numpy 1 strict has no way there."""
    return strict.Device('device1' if int(np.__version__[0]) > 1 else 'CPU_DEVICE')


@pytest.mark.nightly(all_but=5)
@pytest.mark.parametrize('kind', KINDS)
def test_the_standard_is_enough_and_gives_the_bits_of_numpy(kind, strict):
    inputs_, device = inputs(kind, FEW), other_device(strict)
    rows, _ = expected(kind, inputs_)
    function = linkage(kind).function(*requested(kind), xp=strict)
    results = function(*(strict.asarray(x, device=device) for x in inputs_))
    assert {(each.dtype, each.device, each.shape) for each in results} == {
        (strict.float64, device, (FEW,))}
    home = [np.asarray(each.to_device(strict.Device('CPU_DEVICE'))) for each in results]
    assert np.array_equal(home, rows, equal_nan=True) and np.isfinite(rows).any()


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('kind', KINDS)
def test_nothing_on_the_way_is_nan(kind):
    inputs_ = inputs(kind, FEW)
    inputs_[0][::7] = np.nan
    inputs_[-1][::11] = np.inf
    function = linkage(kind).function(*requested(kind), xp=np)
    with np.errstate(divide='raise', invalid='raise', over='raise'):
        results = function(*inputs_)
    with np.errstate(invalid='ignore'):
        rows, _ = expected(kind, inputs_)
    known = ~np.isinf(inputs_[-1])
    assert np.array_equal(np.array(results)[:, known], rows[:, known], equal_nan=True)
    # Of an infinite input all that moves is NaN, the input itself, too.
    assert np.isnan(results)[~np.isfinite(rows)].all()


@pytest.mark.parametrize('kind', ['five_bar', 'four_bar', 'ankle'])
def test_single_precision_stays_single(kind, strict):
    inputs_ = [x.astype('f4') for x in inputs(kind, FEW)]
    rows, sizes = expected(kind, [x.astype(float) for x in inputs_])
    for xp, function in ((each, linkage(kind).function(*requested(kind), xp=each))
                         for each in (strict, np)):
        results = function(*map(xp.asarray, inputs_))
        assert all(each.dtype == xp.float32 for each in results)
        results = np.array([np.asarray(each) for each in results])
        # Next to the ends of its reach a pose may be there in one precision only.
        there = np.isfinite(results) & np.isfinite(rows)
        assert (np.isnan(results) == np.isnan(rows)).mean() > 0.99
        assert np.quantile((np.abs(results - rows) / sizes)[there], 0.99) < 1e-4


@pytest.mark.parametrize('shapes', [[(), (3, 2)], [(1,), (0,)], [(3, 1), (1, 2)], [(), ()]])
def test_shapes_broadcast(shapes, strict):
    function = linkage('five_bar').function(xp=strict)
    results = function(*(strict.full(shape, 1.0 + i) for i, shape in enumerate(shapes)))
    pose = linkage('five_bar').function()(1.0, 2.0)
    for each, value in zip(results, pose):
        assert each.shape == np.broadcast_shapes(*shapes)
        assert np.array_equal(np.asarray(each), np.full(each.shape, value))


@pytest.mark.filterwarnings('ignore:You are comparing')
def test_what_cannot_be_is_refused_in_a_sentence(strict):
    arm, leg = linkage('five_bar'), linkage('jansen')
    function, whole = arm.function(xp=strict), strict.asarray([1, 2])
    good, single = strict.asarray([1.0]), strict.asarray([1.0], dtype=strict.float32)
    half = np.array([1.0], 'f2')
    for inputs_ in ((whole, whole), (good, single), (good, np.array([1.0])), (1.0, 2.0),
                    (good, whole), (good, 2.0)):
        with pytest.raises(ValueError, match='all float64 or all float32'):
            function(*inputs_)
    with pytest.raises(ValueError, match='got float16'):
        leg.function(xp=np)(half)
    with pytest.raises(ValueError, match='needed: 2 arrays .* got array_api_strict.float64$'):
        function(good)
    with pytest.raises(ValueError, match='not for arrays'):
        leg.with_dimensions(m=np.array([14.0, 15.0])).function(xp=strict)
    with pytest.raises(ValueError, match='no closed form'):
        leg.inverse('G.x').function(strict)
    with pytest.raises(ValueError, match='no closed form'):
        leg.inverse('G.x').modes(strict)


def questions(kind, count):
    """Return values of the outputs and inputs beside those that they are from."""
    inputs_, outputs = inputs(kind, count), INVERSES[kind]
    rng = np.random.default_rng(1)
    values = linkage(kind).compiled('checked', outputs).searched(*inputs_)
    near = [x + 0.2 * each.size * rng.uniform(-1.0, 1.0, count)
            for x, each in zip(inputs_, linkage(kind).inputs)]
    return list(values[:len(outputs)]), near


def answers(kind, values, near):
    """Return the library's choice, and the sizes of the inputs."""
    inverse = linkage(kind).inverse(INVERSES[kind])
    results = np.array(inverse.nearest(tuple(values), None if near is None else tuple(near))[0])
    return results, np.reshape([each.size for each in inverse.inputs], (-1, 1))


@pytest.mark.nightly(all_but=4)
@pytest.mark.parametrize('kind', INVERSES)
@pytest.mark.parametrize('follows', [True, False])
def test_the_inverse_chooses_as_the_library_does(kind, follows, strict):
    values, near = questions(kind, FEW)
    rows, sizes = answers(kind, values, near if follows else None)
    device = other_device(strict)
    results = linkage(kind).inverse(INVERSES[kind]).function(strict, follows)(*(
        strict.asarray(x, device=device) for x in (*values, *(near if follows else ()))))
    assert {(each.dtype, each.device) for each in results} == {(strict.float64, device)}
    off = errors([each.to_device(strict.Device('CPU_DEVICE')) for each in results], rows, sizes)
    # What is next to a dead point of the inverse loses digits; no other answer does.
    assert np.quantile(off, 0.99) < EXACT and off.max() < 1e-8
    assert np.isfinite(rows).any()


@pytest.mark.nightly(all_but=1)
@pytest.mark.parametrize('kind', ['geared', 'Scotch yoke', 'Oldham coupling', *(
    kind for kind in mechanisms.TYPES if kind not in ('jansen', 'five_bar'))])
def test_every_output_has_the_library_s_choice(kind):
    mechanism, (inputs_,) = linkage(kind), inputs(kind, FEW)
    rng, tried = np.random.default_rng(3), 0
    near = inputs_ + rng.uniform(-0.2, 0.2, FEW)
    first, *_, last = mechanism.points
    pairs = *mechanism.bars, (first, last), (last, first)
    for output in (*mechanism.joints, *(f'{p}.{axis}' for p in mechanism.points for axis in 'xy'),
                   *(f'angle({p},{q})' for p, q in pairs)):
        try:
            inverse = mechanism.inverse(output)
        except ValueError:
            continue  # it does not move
        if not inverse.closed:
            continue
        values = mechanism.compiled_pose((), (output,)).searched(inputs_)[0]
        values += math.tau * rng.integers(-2, 3, FEW) * mechanism.is_angle(output)
        follows, tried = tried % 2 > 0, tried + 1
        with np.errstate(divide='raise', invalid='raise', over='raise'):
            results, = inverse.function(np, follows)(values, *[near] * follows)
        expected_, = inverse.nearest((values,), (near,) if follows else None)[0]
        np.testing.assert_allclose(results, expected_, 0.0, 1e-6, err_msg=output)
    assert tried > 2


def test_in_single_precision_solutions_next_to_a_dead_point_are_there():
    large = custom('A ground 0 -4.7e5', 'C ground 1.8e6 0', 'D crank C 1.2e6',
                   'E antiparallelogram C D A')
    inverse = large.inverse('E.y')
    cranks = next(place for place in large.dead_points() if place > 0.0) + np.linspace(-0.01, 0.01)
    results, = inverse.function(np, follows=True)(*(x.astype('f4') for x in (
        large.joint_angles(cranks, ['E.y'])['E.y'], cranks)))
    np.testing.assert_allclose(results, cranks, atol=1e-3)


@pytest.mark.nightly(all_but=4)
@pytest.mark.parametrize('kind', INVERSES)
def test_all_modes_are_all_solutions(kind, strict):
    values, _ = questions(kind, 40)
    inverse = linkage(kind).inverse(INVERSES[kind])
    modes = inverse.modes(strict)(*map(strict.asarray, values))
    modes = np.array([[np.asarray(x) for x in mode] for mode in modes])
    for k, value in enumerate(zip(*values)):
        known = [mode for mode in modes[..., k] if np.isfinite(mode).all()]
        for solution in inverse.all(value) if np.isfinite(value).all() else ():
            assert min(np.abs(np.subtract(mode, solution.inputs)).max() for mode in known) < 1e-8
        for mode in known:
            assert any(np.allclose(mode, each.inputs, 0.0, 1e-8) for each in inverse.all(value))


# What differentiates and compiles, at night.


@pytest.fixture(scope='module')
def torch():
    """Return torch."""
    return pytest.importorskip('torch', reason='torch is not installed')


@pytest.fixture(scope='module')
def jax():
    """Return JAX in double precision."""
    package = pytest.importorskip('jax', reason='jax is not installed')
    package.config.update('jax_enable_x64', True)
    return package


def slopes(package, xp, kind, function, inputs_):
    """Return the derivatives (outputs, inputs, poses) of a function of arrays."""
    if package == 'jax':
        results = xp.vmap(xp.jacfwd(lambda *x: xp.numpy.stack(function(*x)), tuple(
            range(len(inputs_)))))
        # One vectorized function, compiled unless it is long.
        results = results if kind == 'ankle' else xp.jit(results)
        return np.array(results(*map(xp.numpy.asarray, inputs_))).transpose(2, 0, 1)
    inputs_ = [xp.tensor(x, requires_grad=True) for x in inputs_]
    return np.array([[np.zeros(len(x)) if slope is None else slope.numpy() for x, slope in zip(
        inputs_, xp.autograd.grad(each.nansum(), inputs_, retain_graph=True, allow_unused=True))]
        for each in function(*inputs_)])


def check_values(kind, results, inputs_):
    """Fail unless points and angles are those of the library, and rates but in few poses."""
    off = errors(results, *expected(kind, inputs_))
    points, joints, _ = requested(kind)
    values = len(linkage(kind).axes) * len(points) + len(joints)
    assert off[:values].max() <= EXACT and np.quantile(off[values:].max(axis=0), 0.999) <= RATED


def check_slopes(slopes, rates):
    """Fail unless derivatives are finite, and those of the library but in a pose of a thousand."""
    assert np.isfinite(slopes).all()
    off = np.abs(slopes - rates) / np.maximum(1.0, np.abs(rates))
    off = np.where(np.isfinite(rates), off, 0.0).max(axis=(0, 1))
    worst = np.flatnonzero(off > RATED)
    assert len(worst) <= 1e-3 * len(off), [(int(k), float(off[k])) for k in worst]


def moving(kind):
    """Return the joints whose rates are compared, and the library's (outputs, inputs, poses)."""
    mechanism, inputs_ = linkage(kind), inputs(kind, MANY)
    joints = ('pitch', 'roll') if kind == 'ankle' else mechanism.joints
    rates = mechanism.compiled_pose((), (), joints).searched(*inputs_)
    return joints, inputs_, rates.reshape(len(inputs_), len(joints), MANY).swapaxes(0, 1)


@pytest.mark.nightly
@pytest.mark.parametrize('package', ['torch', 'jax'])
@pytest.mark.parametrize('kind', KINDS)
def test_both_have_the_values_and_the_rates(kind, package, request):
    xp, inputs_ = request.getfixturevalue(package), inputs(kind, MANY)
    names = xp if package == 'torch' else xp.numpy
    function = linkage(kind).function(*requested(kind), xp=names)
    for each in (function, xp.vmap(function)):
        each = each if package == 'torch' else xp.jit(each)
        check_values(kind, [np.asarray(x) for x in each(*map(names.asarray, inputs_))], inputs_)
    joints, inputs_, rates = moving(kind)
    check_slopes(slopes(package, xp, kind, linkage(kind).function((), joints, xp=names), inputs_),
                 rates)


@pytest.mark.nightly
@pytest.mark.parametrize('package', ['torch', 'jax'])
@pytest.mark.parametrize('kind', INVERSES)
def test_both_have_the_inverse_and_its_rates(kind, package, request):
    values, near = questions(kind, MANY)
    rows, sizes = answers(kind, values, near)
    xp, inputs_ = request.getfixturevalue(package), [*values, *near]
    names = xp if package == 'torch' else xp.numpy
    function = linkage(kind).inverse(INVERSES[kind]).function(names, follows=True)
    off = errors([np.asarray(x) for x in function(*map(names.asarray, inputs_))], rows, sizes)
    # What is next to a dead point of the inverse loses digits; no other answer does.
    assert np.quantile(off, 0.99) < EXACT and off.max() < 1e-8
    results, n = slopes(package, xp, kind, function, inputs_), len(rows)
    assert not results[:, n:].any() and np.isfinite(results).all()
    rates = linkage(kind).compiled_pose((), INVERSES[kind], INVERSES[kind]).searched(*rows)[n:]
    # The derivatives of an inverse are the inverse of the derivatives, by input and output.
    product = np.einsum('ijk,ljk->lik', rates.reshape(n, n, -1), results[:, :n])
    off = abs(product - np.eye(n)[..., None]).max(axis=(0, 1))
    known = np.isfinite(off)
    assert known.mean() > 0.3 and np.quantile(off[known], 0.99) < RATED


@pytest.mark.nightly
def test_torch_compiles_and_exports(torch):
    inputs_ = [torch.tensor(x) for x in inputs('five_bar', FEW)]
    function = linkage('five_bar').function(*requested('five_bar'), xp=torch)

    class Module(torch.nn.Module):
        def forward(self, one, other):
            return function(one, other)

    exported = torch.export.export(Module(), tuple(inputs_)).module()
    for each in (torch.compile(function, fullgraph=True), exported):
        check_values('five_bar', [x.numpy() for x in each(*inputs_)], [x.numpy() for x in inputs_])
