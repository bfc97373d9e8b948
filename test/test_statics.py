# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Efforts that balance loads on every joint and link, against virtual work in 96 digits."""

import gmpy2
from gmpy2 import mpfr
from linkage_ros import mechanisms
import numpy as np
import pytest
from truth.drawing import DIGITS, draw, precisely
from truth.linkage_checks import Subject
from truth.random_linkages import Design, design

# A small motion: its square is below the last of 96 digits.
SMALL = mpfr(2) ** -160
# Of what all loads together do: a link that hardly turns does so by rounding.
ROUNDING = 1e-12

# Every word of the joint lines moves, on the ground and on moving links.
LINKAGES = {
    'crank': ('O ground 0 0', 'A crank O 1', 'B crank A 0.7 zero O', 'C rigid A B 0.5 0.4 left'),
    'cylinder': ('O ground 0 0', 'P ground 0.5 -0.2', 'B cylinder P O 1.1 right',
                 'C rigid O B 0.6 0.8 left', 'D block B 0.3 0.1'),
    'cylinder on a link': ('O ground 0 0', 'Q ground 2 0', 'A crank O 1',
                           'B cylinder A Q 1.4 left', 'C rigid Q B 0.6 1.2 left'),
    'two cylinders': ('O ground 0 0', 'P ground 0.6 -0.3', 'B cylinder P O 1.2 right',
                      'C rigid O B 0.5 1.1 left', 'D cylinder C B 1 right'),
    'carriage': ('O ground 0 0', 'H ground 4 1', 'S carriage O along H 0.1 2',
                 'T dyad S H 2 2.5 left', 'U carriage S along T 0.2 1.5', 'V block U 0.3 -0.4'),
    'slot': ('O ground 0 0', 'Q ground 2 0', 'A crank O 0.5', 'B slot Q A 0.3 out 3',
             'C dyad B O 1.7 3.1 left', 'D slot C A 0.2 in 1'),
    'slider': ('O ground 0 0', 'G ground 0 0.1', 'A crank O 0.5', 'B slider A 1.2 G 0.2 out',
               'C block B 0.2 0.3', 'D slider C 1.5 O along A in'),
    'yoke': ('O ground 0 0', 'G ground 0 0.4', 'H ground 1 0.4', 'A crank O 0.3',
             'Y yoke A G along H', 'T block Y 0.1 0.2', 'B dyad A H 0.9 0.8 left',
             'Z yoke T H along B'),
    'dyads': ('O ground 0 0', 'Q ground 3 0.5', 'A crank O 0.6', 'B dyad A Q 2.5 1.5 left',
              'E rigid A B 1 1.8 left', 'F line A B -0.7', 'G mirror B A Q',
              'C parallelogram B A Q', 'D antiparallelogram B A Q'),
    'inversor': ('O ground 0 0', 'P ground -3 0', 'A crank O 3', 'B C D inversor P A 9 4'),
    'gears': ('O ground 0 0', 'Q ground 3 0', 'A crank O 1', 'C crank Q 1 geared crank -0.5 0.3',
              'B dyad A C 2 2 left', 'D crank B 0.4 zero A geared crank 2 0.1',
              'R ground 1 5', 'E cylinder R B 2 left', 'S ground 8 3', 'T ground 9 5',
              'F carriage S along T 0 4 geared cylinder 0.5 0.2'),
}
# Two hinges in a row, one rod on a crank, one on a cylinder.
ANKLE = (
    'pitch hinge ground at 0 0 0 axis 0 1 0 within -30deg 30deg',
    'roll hinge pitch at 0 0 -0.02 axis 1 0 0 within -15deg 15deg',
    'right motor ground at 0.022 0 0.2159 axis 1 0 0',
    'R rod right 0.0395 -0.0164 0.2112 roll 0.022 -0.015 -0.0096',
    'left cylinder ground 0.035 0.0165 0.1469 roll 0.022 0.015 -0.0096')


@precisely
def balance(subject, values, loads):
    """Return the efforts that balance loads, by small motions, and the sizes of what they add."""
    linkage, way = subject.linkage, subject.ways[0]
    rows, turns = linkage.prepared(linkage.numbers), linkage.turns(linkage.numbers, way)
    bars = {pose.name: pose.parts[0] for pose in subject.poses if pose.what != 'point'}

    def drawn(by, step):
        given = [mpfr(value) + step * (i == by) for i, value in enumerate(values)]
        return draw(DIGITS, linkage, rows, given, way, turns)

    def direction(drawing, name):
        bar = bars[name]
        return drawing.lines[bar[0]] if len(bar) == 1 else (
            drawing.points[bar[1]] - drawing.points[bar[0]])

    efforts, sizes = [], []
    for by, line in enumerate(linkage.inputs):
        step = SMALL if line.turns else SMALL * linkage.longest
        before, after = drawn(by, -step), drawn(by, step)
        work = []
        for name, load in loads.items():
            if name in before.points:
                moved = after.points[name] - before.points[name]
                work += [load[0] * moved.real, load[1] * moved.imag]
            else:
                bar = direction(before, name)
                turned = direction(after, name) * bar.conjugate()
                work.append(load * turned.imag / gmpy2.norm(bar))
        efforts.append(-float(sum(work) / (2 * step)))
        sizes.append(float(sum(map(abs, work)) / (2 * step)))
    return efforts, sizes


def loaded(mechanism, rng):
    """Return a force on each joint, and a moment on each link."""
    return {**{name: rng.uniform(-9.0, 9.0, len(mechanism.axes)) for name in mechanism.points},
            **{name: rng.uniform(-9.0, 9.0) for name in mechanism.joints}}


def check(subject, rng, poses, tolerance=1e-9):
    """Hold the efforts against each load alone, and against all together, at some poses."""
    mechanism, compared = subject.mechanism, 0
    while compared < poses:
        values = [float(rng.uniform(x.low, x.high)) for x in mechanism.inputs]
        theta = values if len(values) > 1 else values[0]
        if not np.isfinite([*mechanism.joint_angles(theta).values()]).all():
            continue
        compared += 1
        loads = loaded(mechanism, rng)
        all_sizes = np.zeros(len(values))
        for some in (loads, *({name: load} for name, load in loads.items())):
            wanted, sizes = balance(subject, values, some)
            all_sizes = np.maximum(all_sizes, sizes)
            error = np.abs(mechanism.effort(theta, some) - wanted)
            assert (error <= tolerance * np.array(sizes) + ROUNDING * all_sizes).all(), (
                str(subject), values, [*some])


@pytest.mark.parametrize('name', LINKAGES)
def test_efforts_balance_a_force_on_each_joint_and_a_moment_on_each_link(name):
    rng = np.random.default_rng(2)
    check(Subject(Design(LINKAGES[name], {}, {}), rng), rng, 3)


@pytest.mark.parametrize('name', mechanisms.TYPES)
def test_efforts_of_the_catalogue_balance_all_loads(name):
    mechanism, rng = mechanisms.create(name), np.random.default_rng(3)
    subject = Subject(Design(mechanism.design.joints, mechanism.dimensions, mechanism.branches),
                      rng)
    check(subject, rng, 2)


@pytest.mark.nightly
def test_efforts_of_random_linkages_balance_all_loads():
    rng, checked = np.random.default_rng(4), 0
    while checked < 12:
        try:
            subject = Subject(design(rng), rng)
        except ValueError:  # it cannot be made with these numbers
            continue
        checked += 1
        if subject.mechanism.reach(*subject.held):
            check(subject, rng, 1, 1e-6)


def test_efforts_of_rods_in_space_balance_all_loads():
    ankle = mechanisms.create('rods', joints=ANKLE)
    rng, step, motors = np.random.default_rng(5), 2.0 ** -17, np.array([0.07, 0.158])
    for name, load in loaded(ankle, rng).items():
        of = ankle.solve if name in ankle.points else ankle.joint_angles
        for by, effort in enumerate(ankle.effort(motors, {name: load})):
            before, after = (of(motors + side * step * (np.arange(2) == by), (name,))[name]
                             for side in (-1.0, 1.0))
            assert effort == pytest.approx(
                -np.sum(load * (after - before)) / (2.0 * step), rel=1e-7, abs=1e-7)


def test_a_mirrored_half_that_is_loaded_alike_asks_for_the_same_again():
    half = 'O ground 0 0', 'Q ground 2 0', 'A crank O 0.5', 'B dyad A Q 2.2 1.1 left'
    one = mechanisms.create('custom', joints=half)
    both = mechanisms.create('custom', joints=(*half, 'H ground 0 1', 'M mirrored O H'))
    wanted = one.effort(0.4, {'B': (3.0, -2.0), 'AB': 5.0})
    assert both.effort(0.4, {'BM': (-3.0, -2.0), 'AM_BM': -5.0}) == pytest.approx(wanted)
    assert both.effort(0.4, {'B': (3.0, -2.0), 'AB': 5.0, 'BM': (-3.0, -2.0), 'AM_BM': -5.0}) == (
        pytest.approx(2.0 * wanted))


@pytest.mark.parametrize('shape', [(), (1,), (3, 2), (0,)])
def test_loads_may_differ_from_pose_to_pose(shape):
    arm, rng = mechanisms.create('five_bar'), np.random.default_rng(6)
    theta = rng.uniform(1.5, 2.0, shape), rng.uniform(0.5, 1.0, shape)
    loads = {'P': rng.uniform(-1.0, 1.0, (*shape, 2)), 'AP': rng.uniform(-1.0, 1.0, shape)}
    found = arm.effort(theta, loads)
    assert found.shape == (*shape, 2)
    for place in np.ndindex(shape):
        own = arm.effort([x[place] for x in theta], {name: x[place] for name, x in loads.items()})
        np.testing.assert_allclose(found[place], own, rtol=1e-12)


def test_what_is_not_loaded_needs_no_effort_even_at_a_dead_point():
    stretched = mechanisms.create('custom', joints=(
        'O ground 0 0', 'Q ground 1 2', 'A crank O 1', 'B dyad A Q 1 1 left'))
    assert not np.isfinite(stretched.effort(0.0, {'B': (1.0, 0.0)}))
    assert not np.isfinite(stretched.effort(0.0, {'AB': 1.0}))
    assert stretched.effort(0.0, {'B': (0.0, 0.0), 'AB': 0.0, 'A': (0.0, 4.0)}) == -4.0
    assert stretched.effort(0.0, {}) == 0.0


def test_without_loads_the_efforts_have_the_shape_of_the_inputs():
    assert mechanisms.create('four_bar').effort(np.zeros((3, 2)), {}).shape == (3, 2, 1)
    assert mechanisms.create('five_bar').effort([np.full(3, 1.9), 0.4], {}).shape == (3, 2)


def test_the_effort_of_an_output_asks_for_one_input_and_an_output_that_moves():
    with pytest.raises(ValueError, match='five_bar has several inputs'):
        mechanisms.create('five_bar').output_effort('P.x', (1.9, 0.4), 1.0)
    for output, problem in (('Q.x', 'does not move'), ('Z.x', 'has no output'),
                            (7, 'has no output')):
        with pytest.raises(ValueError, match=problem):
            mechanisms.create('four_bar').output_effort(output, 0.4, 1.0)


def test_the_names_of_loads_are_texts_of_any_class():
    bars = mechanisms.create('four_bar')
    assert bars.effort(0.4, {np.str_('B'): (0.0, 1.0), np.str_('QB'): 2.0}) == bars.effort(
        0.4, {'B': (0.0, 1.0), 'QB': 2.0})


@pytest.mark.parametrize('output', ['QB', 'P.x', 'B.y', 'distance(O,B)', 'angle(O,B)'])
@pytest.mark.parametrize('theta', [0.4, [[0.4, 1.0], [2.2, -1.0]]])
def test_the_effort_of_an_output_has_the_power_of_the_input(output, theta):
    bars, step = mechanisms.create('four_bar'), 2.0 ** -17
    before, after = (bars.joint_angles(np.array(theta) + side * step, (output,))[output]
                     for side in (-1.0, 1.0))
    found = bars.output_effort(output, theta, 6.0)
    assert np.shape(found) == np.shape(theta)
    np.testing.assert_allclose(found * (after - before) / (2.0 * step), 6.0, rtol=1e-7)
