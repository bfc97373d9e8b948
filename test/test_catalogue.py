# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The wider catalogue does what each linkage is known for, and is right to the last digits."""

import math
from pathlib import Path

from linkage_ros import mechanisms, scene
from linkage_ros.mechanisms.four_bar import grashof
from linkage_ros.scene.legs import LegGroup
import numpy as np
import pytest


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


def test_nobody_changes_what_others_use():
    linkage = mechanisms.create('jansen')
    for shared in (linkage.design.dimensions, linkage.design.branches,
                   linkage.frames['BC'], linkage.yokes, mechanisms.CATALOGUE):
        with pytest.raises(TypeError):
            shared['m'] = 1.0
    assert isinstance(linkage.design.lines, tuple)
    scene.read({}).mechanisms['jansen'].joints.clear()
    assert scene.read({}).mechanisms['jansen'].joints


@pytest.mark.parametrize('call, reason', [
    (lambda: mechanisms.design('jansn'), r'.* whitworth, custom, rods; did you mean jansen\?$'),
    (lambda: mechanisms.create('watt', joints=[]), 'joints and tracer are for .*, not for watt$'),
    (lambda: mechanisms.defaults('custom'), "no defaults for type 'custom'; allowed: "),
    (lambda: mechanisms.create('custom', joints=['O ground 0 0', 'A crank O 1'], tracer='a'),
     r"tracer 'a' is not a joint; allowed: O, A; did you mean A\?$"),
    (lambda: mechanisms.create('custom', joints=['O ground 0 0', 'A crank O q'], r=1.0, Q=2.0),
     r'.*"A crank O q": dimension q has no value; given: r, Q; did you mean Q\?$'),
    (lambda: mechanisms.create('custom', joints=['O ground 0 0']),
     'a linkage needs a line that drives it: crank or cylinder or carriage$'),
    (lambda: mechanisms.create('custom', joints=['O ground 0 0'] * 2001), 'joints must be up to'),
    (lambda: mechanisms.create('custom', joints=['O ground 0 0', 'H ground 1 0', 'A crank O 1', *(
        f'm{number} mirrored O H' for number in range(40))]),
     'joint line "m10 mirrored O H": a linkage has up to 2000 lines, images included$')])
def test_what_is_no_mechanism_is_refused_with_what_is_allowed(call, reason):
    with pytest.raises(ValueError, match='^' + reason):
        call()


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


def test_chebyshev_s_lambda_is_as_straight_as_can_be_over_half_a_turn():
    theta = math.pi + np.linspace(-0.5, 0.5, 4001) * math.pi
    height = mechanisms.create('chebyshev_lambda').solve(theta, ('P',))['P'][:, 1]
    middle = 0.5 * (height.min() + height.max())
    swing = 0.5 * np.ptp(height)
    turning = np.flatnonzero(np.diff(np.sign(np.diff(height)))) + 1
    extremes = (height[[0, *turning, -1]] - middle) / swing
    np.testing.assert_allclose(extremes, [1, -1, 1, -1, 1, -1, 1], atol=1e-5)


def test_klann_s_leg_stands_as_in_the_patent():
    # US patent 6,260,862, the leg stretched forward: joints 27, 35, 37 and the foot 33 are at
    # these places seen from the foot's; the crank shaft 15 is at (1.599, 0.750).
    place = mechanisms.create('klann').solve(math.pi)
    expected = {'A': (1.331, 0.750), 'D': (0.741, 0.750), 'E': (0.232, 0.866),
                'F': (0.866, 1.500), 'G': (0.0, 0.0), 'B': (1.009, 0.574), 'C': (1.366, 1.366)}
    for name, where in expected.items():
        np.testing.assert_allclose(place[name] + (1.599, 0.750), where, atol=6e-4)


def _from_line(points, line):
    """Return how far points are from the pieces of a line, all complex."""
    start, along = line[:-1], np.diff(line)
    from_start = points[:, None] - start
    part = (from_start * along.conj()).real / np.maximum(abs(along) ** 2, 1e-300)
    return abs(from_start - part.clip(0.0, 1.0) * along).min(axis=1)


@pytest.mark.nightly(all_but=4)
@pytest.mark.parametrize('kind, lengths', [
    *((kind, {}) for kind in mechanisms.TYPES if kind != 'five_bar'),
    ('jansen', {'a': 10.0, 'm': 22.0}),
    # They fold flat but for a little.
    *(('four_bar', {'a': 0.7, 'b': 1.5, 'c': 1.4 + away, 'd': 0.8, 'p': 1.0})
      for away in (1e-9, -1e-6, 1e-3))])
def test_a_drawn_curve_has_no_visible_corners(kind, lengths):
    linkage = mechanisms.create(kind, **lengths)
    assembly = LegGroup(linkage, scale=0.01)
    low, high = max(assembly.reach, key=lambda arc: arc[1] - arc[0])
    drawn = assembly.locus(linkage.tracer) @ (1, 1j)
    true = linkage.solve(np.linspace(low, high, 801), (linkage.tracer,))[linkage.tracer] @ (1, 1j)
    true = 0.01 * true[np.isfinite(true)]
    size = max(np.ptp(true.real), np.ptp(true.imag))
    # Where bars fold flat but for a billionth of them, a corner may be cut.
    part = 60 if linkage.type == 'four_bar' else 400
    assert len(drawn) < 900 and _from_line(true, drawn).max() < size / part
