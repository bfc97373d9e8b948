# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The wider catalogue does what each linkage is known for, and is right to the last digits."""

from fractions import Fraction
from functools import partial
from importlib.util import module_from_spec, spec_from_file_location
import math
from pathlib import Path
import sys

from linkage_ros import mechanisms
from linkage_ros.mechanisms.four_bar import grashof
from linkage_ros.scene.legs import Assembly
import numpy as np
import pytest
from truth import exact_poses, hard_cases, linkage_checks as checks
from truth.accuracy_rule import broken, case_of, judge, summary
from truth.exact_poses import HELD
from truth.random_linkages import Design

# Those with a reference of their own, beside the one that draws every joint line.
WIDER = [kind for kind in exact_poses.KINDS
         if kind in mechanisms.TYPES and kind not in hard_cases.CATALOGUE]


def held(linkage):
    """Return the angle of a second crank, if there is one."""
    return (HELD,) * (len(linkage.inputs) - 1)


def rows_of(linkage, thetas):
    """Measure the joints and the angles of the links."""
    case = case_of(linkage, thetas)
    theta = [case.thetas, *(np.full_like(case.thetas, other) for other in held(linkage))]
    theta = theta if held(linkage) else theta[0]
    turning = [link for link in linkage.links
               if link.kind == 'revolute' and 'crank2' not in (link.name, link.parent)]
    found = dict(linkage.solve(theta))
    values = linkage.joint_angles(theta, [link.name for link in turning])
    found.update((f'angle {name}', value) for name, value in values.items())
    return judge(case, found, turning)


def ends(linkage):
    """Return the limits of the reach, a few at most."""
    return [end for arc in linkage.reach(*held(linkage)) for end in arc][:4]


def test_the_catalogue_is_what_is_in_its_folder_the_first_four_in_front():
    files = sorted(Path(mechanisms.__file__).parent.glob('[a-z]*.py'))
    others = [file.stem for file in files if file.stem not in ('custom', *mechanisms.CATALOGUE)]
    assert list(mechanisms.TYPES) == [*mechanisms.CATALOGUE, *others]


# Tracer, dimensions in the order of the page, and those that may be negative: from the sources.
DESIGNS = {
    'water_drop': ('P', 'a=1', ''),
    'jansen': ('G', 'a=38 b=41.5 c=39.3 d=40.1 e=55.8 f=39.4 g=36.7 h=65.7 i=49 j=50 k=61.9 l=7.8 '
               'm=15', ''),
    'peaucellier': ('C', 'r=3 a=9 b=4', ''), 'slotted_lever': ('L', 'a=80 b=150 e=0', 'e'),
    'chebyshev_lambda': ('P', 'a=1', ''), 'five_bar': ('P', 'a=.09 b=.09 c=.09 d=.09 f=.118', ''),
    'four_bar': ('P', 'a=40 b=120 c=80 d=100 p=60', 'p'), 'hoeken': ('P', 'a=1 b=2.5 d=2', ''),
    'klann': ('G', 'm=.268 a=.59 b=.3206 c=.5221 d=1.1051 e=.5177 f=.8966 g=.8966 h=1.732 i=.59 '
              'j=.176 k=.233 l=.616', ''),
    'pantograph': ('T', 'a=1 b=2.5 c=2.5 d=5 g=3', ''),
    'slider_crank': ('B', 'a=40 b=120 c=-20', 'c'),
    'watt': ('P', 'a=3 c=2', ''), 'whitworth': ('R', 'a=150 b=100 c=120 d=400', '')}


@pytest.mark.parametrize('kind', DESIGNS)
def test_the_defaults_are_those_of_the_sources_and_only_offsets_may_be_negative(kind):
    tracer, lengths, signed = DESIGNS[kind]
    lengths = {name: float(length) for name, _, length in (
        each.partition('=') for each in lengths.split())}
    linkage = mechanisms.create(kind)
    assert (linkage.type, linkage.tracer) == (kind, tracer)
    assert mechanisms.defaults(kind) == linkage.dimensions == lengths
    assert [*mechanisms.defaults(kind)] == [*lengths] and set(DESIGNS) == set(mechanisms.TYPES)
    for name, length in lengths.items():
        if name in signed:
            assert mechanisms.create(kind, **{name: -0.1}).dimensions[name] == -0.1
            continue
        for wrong in (-length, 0.0):
            with pytest.raises(ValueError, match=(
                    f'^{kind}: dimension {name} must be positive, got {wrong}$')):
                mechanisms.create(kind, **{name: wrong})


def test_the_scene_without_names_is_of_the_size_of_a_table():
    assert mechanisms.CATALOGUE == {
        'water_drop': 0.1, 'jansen': 0.005, 'peaucellier': 0.1, 'slotted_lever': 0.002}


@pytest.mark.parametrize('call, reason', [
    (lambda: mechanisms.design('jansn'), "unknown mechanism type 'jansn'; allowed: water_drop, .*"
     r'whitworth, custom, rods; did you mean jansen\?$'),
    (lambda: mechanisms.create(None), 'unknown mechanism type None; allowed: .*, rods$'),
    (lambda: mechanisms.create('watt', joints=['O ground 0 0']),
     'joints and tracer are for type custom or rods, not for watt$'),
    (lambda: mechanisms.create('watt', tracer='A'), 'joints and tracer are for type .* watt$'),
    (lambda: mechanisms.defaults('custom'),
     "no defaults for type 'custom'; allowed: water_drop, .*, whitworth$"),
    (lambda: mechanisms.defaults(['watt']), 'no defaults for type '),
    (lambda: mechanisms.design('custom', ['A ground 0 0'], dimensions=3),
     'dimensions must be a list of names, got 3$'),
    (lambda: mechanisms.create('custom', joints=['O ground 0 0', 'A crank O 1'], tracer=3),
     'tracer must be the name of a joint, got 3$'),
    (lambda: mechanisms.create('custom', joints=['O ground 0 0', 'A crank O 1'], tracer='a'),
     r"tracer 'a' is not a joint; allowed: O, A; did you mean A\?$"),
    (lambda: mechanisms.create('custom', joints=['O ground 0 0', 'A crank O q'], r=1.0, Q=2.0),
     r'.*"A crank O q": dimension q has no value; given: r, Q; did you mean Q\?$'),
    (lambda: mechanisms.design('custom', ['O ground 0 0', 'A crank O 1'], None, ['a b']),
     "'a b' cannot name a dimension"),
    (lambda: mechanisms.create('custom', joints=['O ground 0 0']),
     'a linkage needs a line that drives it: crank or cylinder or carriage$'),
    *((lambda wrong=wrong: mechanisms.create('custom', joints=wrong),
       'joints must be a list of lines, one per joint, got ')
      for wrong in (None, 'A crank O 1', b'A', [], {'A': 1}, {'A'}, 7)),
    (lambda: mechanisms.create('custom', joints=['O ground 0 0', 7]),
     'joints must be lines of text, but line 2 is 7$'),
    (lambda: mechanisms.create('custom', joints=['O ground 0 0'] * 2001),
     'joints must be up to 2000 lines, got more$'),
])
def test_what_is_no_mechanism_is_refused_with_what_is_allowed(call, reason):
    with pytest.raises(ValueError, match='^' + reason):
        call()


@pytest.mark.parametrize('text, said', [
    ('', "module 'linkage_ros.other.broken' has no attribute 'DESIGN'"),
    ('DESIGN = Design()', "name 'Design' is not defined"),
    ('DESIGN = ', 'invalid syntax'),
    (Path(mechanisms.TYPES['watt'].__file__).read_text(),
     "must have the name of its design, 'watt'")])
def test_a_file_that_is_no_mechanism_is_named(tmp_path, monkeypatch, text, said):
    (tmp_path / 'broken.py').write_text(text)
    folders = [*mechanisms.__path__, str(tmp_path)]
    spec = spec_from_file_location('linkage_ros.other', mechanisms.__file__,
                                   submodule_search_locations=folders)
    other = module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, other)
    try:
        with pytest.raises(ImportError) as refused:
            spec.loader.exec_module(other)
    finally:
        for name in [name for name in sys.modules if name.startswith(f'{spec.name}.')]:
            del sys.modules[name]
    assert str(refused.value).startswith('linkage_ros.other.broken ')
    assert said in str(refused.value)


@pytest.mark.nightly(all_but=3)
@pytest.mark.parametrize('seeds', [1, pytest.param(5, marks=pytest.mark.nightly)])
@pytest.mark.parametrize('kind', list(mechanisms.TYPES))
def test_every_mechanism_holds_what_any_linkage_must(kind, seeds):
    design = Design(mechanisms.design(kind).joints, mechanisms.create(kind).dimensions, {})
    found = [problem for seed in range(seeds)
             for problem in checks.problems(design, np.random.default_rng(seed))[0]]
    assert not found, found[0]


@pytest.mark.nightly(all_but=4)
@pytest.mark.parametrize('kind', WIDER)
def test_the_wider_catalogue_is_right_to_the_last_digits(kind):
    linkage = mechanisms.create(kind)
    near = [hard_cases.approach(end)[::5] for end in ends(linkage)[:2]]
    anywhere = hard_cases.angles(np.random.default_rng(1), 12, ends(linkage))
    thetas = np.concatenate([anywhere, *near])
    rows = rows_of(linkage, thetas)
    assert rows and not broken(rows), summary(rows)


@pytest.mark.nightly(all_but=4)
@pytest.mark.parametrize('count', [4, pytest.param(12, marks=pytest.mark.nightly)])
@pytest.mark.parametrize('kind', WIDER)
def test_other_dimensions_and_branches_are_right_too(kind, count):
    rng, rows = np.random.default_rng(3), []
    for _ in range(count):
        lengths = {name: value * hard_cases.log_uniform(rng, 0.7, 1.4)
                   for name, value in mechanisms.defaults(kind).items()}
        if kind == 'chebyshev_lambda':  # any other size would round its proportions
            lengths = {'a': 2.0 ** int(rng.integers(-9, 9))}
        branches = {name: int(rng.choice((-1, 1))) for name in exact_poses.KINDS[kind].branches}
        linkage = mechanisms.create(kind, branches=branches, **lengths)
        rows += rows_of(linkage, hard_cases.angles(rng, 3, ends(linkage)))
    assert rows and not broken(rows), summary(rows)


# Lengths crank, coupler, rocker, ground; Norton, "Design of Machinery", sec. 2.13.
@pytest.mark.parametrize('lengths, name', [
    ((2, 7, 6, 5), 'crank-rocker'), ((7, 2, 6, 5), 'double-rocker'),
    ((6, 7, 2, 5), 'rocker-crank'), ((5, 7, 6, 2), 'double-crank'),
    ((2, 9, 5, 4), 'triple-rocker'), ((0.01, 0.04, 0.03, 0.02), 'change point'),
    ((1, 3, 1, 3), 'change point'), ((1, 1, 3, 3), 'change point'),
    ((0.1, 0.4, 0.3, 0.2 + 1e-12), 'crank-rocker')])
def test_a_four_bar_is_of_the_class_that_grashof_s_condition_gives_it(lengths, name):
    assert grashof(*lengths) == name
    linkage = mechanisms.create('four_bar', **dict(zip('abcd', lengths)))
    assert linkage.grashof() == name
    turns = linkage.inputs[0].is_whole(linkage.reach())
    assert turns == (name in ('crank-rocker', 'double-crank', 'change point'))


def test_grashof_s_condition_tells_which_cranks_turn_all_round():
    rng = np.random.default_rng(5)
    for _ in range(200):
        a, b, c, d = (Fraction(int(rng.integers(1, 9))) for _ in range(4))
        linkage = mechanisms.create('four_bar', a=float(a), b=float(b), c=float(c), d=float(d))
        possible = 2 * max(a, b, c, d) <= a + b + c + d
        turns = linkage.inputs[0].is_whole(linkage.reach())
        assert turns == (possible and abs(b - c) <= abs(d - a) and a + d <= b + c)
        if possible and turns:
            assert linkage.grashof() in ('crank-rocker', 'double-crank', 'change point')
        elif possible:
            assert linkage.grashof() not in ('crank-rocker', 'double-crank')


def straight_part(linkage, degrees, samples=4001):
    """Return P and its speed while the crank is within so many degrees about pi."""
    theta = math.pi + np.linspace(-0.5, 0.5, samples) * math.radians(degrees)
    return linkage.solve(theta, ('P',))['P'], linkage.velocity(theta, ('P',))['P']


def test_chebyshev_s_lambda_is_as_straight_as_can_be_over_half_a_turn():
    height = straight_part(mechanisms.create('chebyshev_lambda'), 180)[0][:, 1]
    middle = 0.5 * (height.min() + height.max())
    swing = 0.5 * np.ptp(height)
    turning = np.flatnonzero(np.diff(np.sign(np.diff(height)))) + 1
    extremes = (height[[0, *turning, -1]] - middle) / swing
    np.testing.assert_allclose(extremes, [1, -1, 1, -1, 1, -1, 1], atol=1e-5)


def test_watt_s_curve_is_the_sextic_of_the_books():
    # MathWorld, "Watt's Curve": wheels of radius b, centres 2a apart, rod 2c:
    # r^2 = b^2 - (a sin(phi) +- sqrt(c^2 - a^2 cos^2(phi)))^2.
    linkage = mechanisms.create('watt', a=3.0, c=2.0)
    (lo, hi), = linkage.reach()
    place = linkage.solve(np.linspace(lo + 1e-9, hi - 1e-9, 41))
    centres = place['Q'][0]
    a, b, c = 0.5 * np.hypot(*centres), 3.0, 1.0
    axis = centres / np.hypot(*centres)
    from_middle = place['P'] - 0.5 * centres
    x = from_middle @ axis
    y = from_middle @ (-axis[1], axis[0])
    r2 = x * x + y * y
    np.testing.assert_allclose(
        r2 * (r2 - a * a - b * b + c * c) ** 2 + 4 * a * a * y * y * (r2 - b * b), 0.0,
        atol=1e-11)


def test_watt_s_middle_runs_nearly_straight():
    linkage = mechanisms.create('watt')
    middle = linkage.solve(np.linspace(-0.25, 0.25, 51), ('P',))['P']
    assert np.ptp(middle[:, 1]) > 1.4 and np.abs(middle[:, 0] - 3.0).max() < 0.012


def test_watt_s_linkage_with_a_square_proportion_writes_bernoulli_s_lemniscate():
    linkage = mechanisms.create('custom', joints=(
        'O ground -a 0', 'Q ground a 0', 'A crank O a*1.4142135623730951',
        'B dyad A Q 2*a a*1.4142135623730951 right', 'P line A B a'), a=1.0)
    (lo, hi), = linkage.reach()
    x, y = linkage.solve(np.linspace(lo + 0.2, hi - 0.2, 41), ('P',))['P'].T
    distances = np.hypot(x - 1.0, y) * np.hypot(x + 1.0, y)
    assert np.hypot(x, y).max() > 0.5
    np.testing.assert_allclose(distances, 1.0, atol=1e-14)


def test_klann_s_leg_stands_as_in_the_patent():
    # US patent 6,260,862, the leg stretched forward: joints 27, 35, 37 and the foot 33 are at
    # these places seen from the foot's; the crank shaft 15 is at (1.599, 0.750).
    place = mechanisms.create('klann').solve(math.pi)
    expected = {'A': (1.331, 0.750), 'D': (0.741, 0.750), 'E': (0.232, 0.866),
                'F': (0.866, 1.500), 'G': (0.0, 0.0), 'B': (1.009, 0.574), 'C': (1.366, 1.366)}
    for name, where in expected.items():
        np.testing.assert_allclose(place[name] + (1.599, 0.750), where, atol=6e-4)


def test_klann_s_foot_walks_and_steps():
    foot = mechanisms.create('klann').solve(np.linspace(-math.pi, math.pi, 721), ('G',))['G']
    on_ground = foot[:, 1] < foot[:, 1].min() + 0.05
    assert 0.4 < on_ground.mean() < 0.7
    assert np.ptp(foot[:, 1]) > 0.4


def test_a_pantograph_copies_to_scale_even_when_it_lies_flat():
    for b, d in ((2.5, 5.0), (2.0, 5.0), (2.5, 1.25), (2.0, 7.0)):
        linkage = mechanisms.create('pantograph', a=1.0, b=b, c=4.0 - b, d=d, g=3.0)
        place = linkage.solve(np.linspace(-math.pi, math.pi, 361))
        # The parallelogram is flat where the pin is 4 from the pole, at theta = 0.
        np.testing.assert_allclose(place['T'] - place['F'], (place['A'] - place['F']) * d / b,
                                   atol=4e-15 * d)
        for p, q, length in (('F', 'D', d), ('D', 'C', 4.0 - b), ('A', 'C', abs(d - b))):
            np.testing.assert_allclose(np.linalg.norm(place[p] - place[q], axis=1), length,
                                       rtol=1e-14)


def test_the_five_bar_puts_its_point_anywhere():
    linkage = mechanisms.create('five_bar')
    for target in ((0.059, 0.12), (0.0, 0.11), (0.1, 0.14)):
        angles = [_reached((0.0, 0.0), target, 1), _reached((0.118, 0.0), target, -1)]
        np.testing.assert_allclose(linkage.solve(angles)['P'], target, atol=1e-15)


def _reached(base, target, elbow):
    """Return the angle of an arm of two bars of 0.09 whose end is at the target."""
    way = complex(target[0] - base[0], target[1] - base[1])
    return math.atan2(way.imag, way.real) + elbow * math.acos(abs(way) / 0.18)


def _near_a_change_point(seed):
    """Return a four-bar that folds flat but for a little, or a leg with other bars."""
    rng = np.random.default_rng(seed)
    make = _leg_of_other_bars if seed % 2 else _four_bar_that_nearly_folds
    return next(linkage for linkage in iter(partial(make, rng), None) if linkage.reach())


def _leg_of_other_bars(rng):
    return mechanisms.create('jansen', **{
        name: length * rng.uniform(0.7, 1.3)
        for name, length in mechanisms.defaults('jansen').items()})


def _four_bar_that_nearly_folds(rng):
    a, d, b = *rng.uniform(0.3, 1.0, 2), rng.uniform(1.0, 2.0)
    nearly = a + b - d + rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-9.0, -1.0)
    return mechanisms.create('four_bar', a=a, b=b, c=nearly, d=d, p=rng.uniform(0.1, 2.0))


def _from_line(points, line):
    """Return how far points are from the pieces of a line, all complex."""
    start, along = line[:-1], np.diff(line)
    from_start = points[:, None] - start
    part = (from_start * along.conj()).real / np.maximum(abs(along) ** 2, 1e-300)
    return abs(from_start - part.clip(0.0, 1.0) * along).min(axis=1)


def _curves():
    """Return linkages by what makes them, to be made when they are tested."""
    for type_ in mechanisms.TYPES:
        if type_ != 'five_bar':
            yield pytest.param(partial(mechanisms.create, type_), id=type_)
    yield pytest.param(partial(mechanisms.create, 'jansen', a=10.0, m=22.0), id='another leg')
    for seed in range(60):
        yield pytest.param(partial(_near_a_change_point, seed), id=f'near a change point {seed}')


@pytest.mark.nightly(all_but=5)
@pytest.mark.parametrize('make', [*_curves()])
def test_a_drawn_curve_has_no_visible_corners(make):
    linkage = make()
    assembly = Assembly(linkage, scale=0.01)
    low, high = max(assembly.reach, key=lambda arc: arc[1] - arc[0])
    drawn = assembly.locus(linkage.tracer) @ (1, 1j)
    true = linkage.solve(np.linspace(low, high, 4001), (linkage.tracer,))[linkage.tracer] @ (1, 1j)
    true = 0.01 * true[np.isfinite(true)]
    size = max(np.ptp(true.real), np.ptp(true.imag))
    # Where bars fold flat but for a billionth of them, a corner may be cut.
    part = 60 if linkage.type == 'four_bar' else 400
    assert len(drawn) < 900 and _from_line(true, drawn).max() < size / part
