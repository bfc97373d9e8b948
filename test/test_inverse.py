# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Every crank angle that gives an output its value is found, and nothing else is."""

import math

import gmpy2
from linkage_ros import mechanisms
import numpy as np
import pytest
from truth import linkage_checks
from truth.drawing import DIGITS, precisely
from truth.drawing_accuracy import strict

# Types with one input.
KINDS = [kind for kind in mechanisms.TYPES if kind != 'five_bar']


def inside(linkage, rng, count):
    """Return crank angles inside the reach."""
    arcs = linkage.reach()
    return np.array([rng.uniform(*arcs[rng.integers(len(arcs))]) for _ in range(count)])


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize('values', [2, 40], ids=['floats', 'arrays'])
def test_every_answer_is_right_to_the_last_digits(kind, values):
    linkage, rng = mechanisms.create(kind), np.random.default_rng(1)
    measure, count = strict(linkage), 0
    for output in linkage_checks.moved(linkage):
        expected = linkage.joint_angles(inside(linkage, rng, values), (output,))[output]
        for value, answers in [*zip(expected.tolist(), linkage.input_for(output, expected))][:6]:
            answers = answers[np.isfinite(answers)]
            assert (np.diff(answers) > 0.0).all() and (np.abs(answers) <= math.pi).all()
            for theta in answers.tolist():
                miss, sensitivity = _miss(measure, theta, output, value)
                assert miss <= 4 * sensitivity + np.spacing(abs(value)), (output, value, theta)
                count += 1
    assert count > 10


@precisely
def _miss(measure, theta, output, value):
    """Return how far a true output is from a value, and what half an ulp of all inputs does."""
    name, _, axis = output.rpartition('.')
    truth = measure.at([theta])
    i, out = next((i, out) for i, out in enumerate(measure.poses)
                  if out.name == (name or output) and (out.what == 'point') == bool(name))
    exact = truth.values[i]
    if out.what == 'angle':
        error = DIGITS.direction(exact * DIGITS.turned(-gmpy2.mpfr(value)))
    else:
        error = (getattr(exact, {'x': 'real', 'y': 'imag'}[axis]) if name else exact) - value
    return abs(float(error)), truth.sensitivity[i] + 0.5 * np.spacing(abs(value))


@pytest.mark.parametrize('pole, still', [
    ('-r 0', 'x'), ('r 0', 'x'), ('0 r', 'y'), ('0 -r', 'y'), ('-0.7 0', 'x'), ('0 0.7', 'y')])
def test_a_guide_that_is_straight_up_to_rounding_stands_still_across_its_line(pole, still):
    guide = mechanisms.create('custom', r=0.7, joints=(
        f'P ground {pole}', 'O ground 0 0', 'A crank O r', 'B C D inversor P A 2.1 0.9'))
    values = guide.solve(np.linspace(*guide.reach()[0], 50)[1:-1])['C'][:, 'xy'.index(still)]
    assert np.ptp(values) <= 1e-14
    assert np.isnan(guide.input_for(f'C.{still}', values)).all()


@pytest.mark.parametrize('output, value', [
    ('QB', 3.0), ('B.y', 90.0), ('P.x', -200.0), ('A.x', 40.1), ('QB', math.nan)])
def test_where_nothing_is_found_there_is_one_nan(output, value):
    linkage = mechanisms.create('four_bar')
    assert np.isnan(linkage.input_for(output, value)).tolist() == [True]
    assert math.isnan(linkage.input_for(output, value, near=1.0))


# --- transmission angles and dead points --------------------------------------------------------

def test_the_transmission_angle_of_a_slider_is_its_rod_s_to_the_normal():
    linkage = mechanisms.create('slider_crank')
    theta = np.linspace(-math.pi, math.pi, 73)
    expected = np.arccos((40.0 * np.sin(theta) + 20.0) / 120.0)
    np.testing.assert_allclose(linkage.transmission_angles(theta)['B'], expected, atol=1e-14)


def test_transmission_angles_are_asked_for_by_joint():
    both = mechanisms.create('peaucellier').transmission_angles(0.5)
    assert list(both) == ['B', 'D'] and both['B'] == both['D']
    linkage = mechanisms.create('jansen')
    assert list(linkage.transmission_angles(0.3, ('E',))) == ['E']
    with pytest.raises(ValueError, match="no transmission angle at 'G'; allowed: C, E, F"):
        linkage.transmission_angles(0.3, ('G',))


def test_a_slot_through_the_pivot_always_passes_on_the_whole_force():
    lever = mechanisms.create('slotted_lever')
    assert (lever.transmission_angles(np.linspace(-3, 3, 7))['L'] == math.pi / 2).all()
    offset = mechanisms.create('slotted_lever', e=30.0)
    slide = offset.joint_angles(1.0)['slide']
    assert offset.transmission_angles(1.0)['L'] == pytest.approx(math.atan2(slide, 30.0))


@pytest.mark.nightly(all_but=1)
@pytest.mark.parametrize('kind', KINDS)
def test_every_joint_that_closes_a_loop_has_a_transmission_angle_between_its_bars(kind):
    linkage = mechanisms.create(kind)
    theta = inside(linkage, np.random.default_rng(6), 9)
    place, angles = linkage.solve(theta), linkage.transmission_angles(theta)
    assert angles
    for joint, angle in angles.items():
        assert ((angle >= 0) & (angle <= math.pi)).all()
        line = next(line for line in mechanisms.design(kind).lines if joint in line.names)
        if line.word in ('dyad', 'mirror', 'parallelogram'):
            p, q = (place[name] - place[joint]
                    for name in (line.args[:2] if line.word == 'dyad' else line.args[-2:]))
            lengths = np.linalg.norm(p, axis=1) * np.linalg.norm(q, axis=1)
            np.testing.assert_allclose(np.cos(angle), (p * q).sum(1) / lengths, atol=1e-13)


# Norton, "Design of Machinery", sec. 4.11: toggle positions of a non-Grashof four-bar.
TOGGLE = math.acos((2.0 ** 2 + 4.0 ** 2 - (9.0 - 5.0) ** 2) / (2 * 2.0 * 4.0))
# The slider's rod stands upright.
UPRIGHT = math.asin(30.0 / 40.0)


@pytest.mark.parametrize('kind, numbers, expected', [
    ('water_drop', {}, [-math.pi, 0.0]), ('jansen', {}, []), ('slotted_lever', {}, []),
    ('four_bar', {}, []), ('slider_crank', {}, []), ('klann', {}, []), ('whitworth', {}, []),
    ('peaucellier', {}, [-2 * math.acos(5 / 6), 2 * math.acos(5 / 6)]),
    ('four_bar', {'a': 2.0, 'b': 9.0, 'c': 5.0, 'd': 4.0, 'p': 1.0}, [-TOGGLE, TOGGLE]),
    ('slider_crank', {'a': 40.0, 'b': 30.0, 'c': 0.0},
     [UPRIGHT - math.pi, -UPRIGHT, UPRIGHT, math.pi - UPRIGHT]),
    # Where it lies flat; the next turn begins on the other side: all comes round after two.
    ('pantograph', {'a': 1.0, 'b': 2.0, 'c': 2.0, 'g': 3.0}, [-2.0 * math.pi, 0.0])])
def test_dead_points_are_where_a_dyad_stretches_or_folds(kind, numbers, expected):
    linkage = mechanisms.create(kind, **numbers)
    dead = linkage.dead_points()
    assert dead == pytest.approx(expected, rel=1e-14, abs=1e-8 if kind == 'pantograph' else 1e-15)
    if kind == 'four_bar' and dead:
        assert linkage.transmission_angles(dead[1])['B'] == pytest.approx(0.0, abs=1e-7)
