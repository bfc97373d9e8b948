# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Every answer is right to the last digits, and NaN is given exactly where there is no answer."""

import math

from linkage_ros import mechanisms
import numpy as np
import pytest
from truth import hard_cases, original_formulas
from truth.drawing_accuracy import broken, judge, measured, strict, summary

KINDS = list(hard_cases.CATALOGUE)
BRANCHES = {
    'water_drop': [{}],
    'jansen': [{}, {'C': -1}, {'E': 1}, {'F': -1}],
    'peaucellier': [{}],
    'slotted_lever': [{}, {'L': -1}],
}
CATALOGUE = [(kind, dimensions, branches) for kind in KINDS
             for dimensions in hard_cases.CATALOGUE[kind] for branches in BRANCHES[kind]]


# A leg costs the reference ten times what the others cost.
SHARE = {'water_drop': 1.0, 'jansen': 0.25, 'peaucellier': 1.0, 'slotted_lever': 1.0}


def ends(mechanism):
    """Return the limits of the reach, a few at most."""
    return [end for arc in mechanism.reach() for end in arc if abs(end) < math.pi][:4]


def awkward(mechanism, rng, count, near=40):
    """Return random angles and some, at decades of distance, near dead points and limits."""
    spots = [0.0, math.pi, *ends(mechanism)]
    chosen = rng.choice(spots, 2, replace=False)
    close = np.concatenate([hard_cases.approach(spot) for spot in chosen])
    close = rng.choice(close, math.ceil(near * SHARE[mechanism.type]), replace=False)
    return np.concatenate([hard_cases.angles(rng, count, spots), close])


def check(mechanism, thetas, rates=False):
    """Fail with the numbers that reproduce the worst row."""
    rows = measured(mechanism, thetas, rates)
    assert rows and not broken(rows), summary(mechanism, rows)


@pytest.mark.nightly(all_but=8)
@pytest.mark.parametrize('near', [12, pytest.param(40, marks=pytest.mark.nightly)])
@pytest.mark.parametrize('kind, dimensions, branches', CATALOGUE)
def test_the_catalogue_is_right_to_the_last_digits(kind, dimensions, branches, near):
    mechanism = mechanisms.create(kind, branches=branches, **dimensions)
    check(mechanism, awkward(mechanism, np.random.default_rng(1), 3, near))


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize('rates, seed, count', [
    (False, 1, 3), *(pytest.param(*each, marks=pytest.mark.nightly)
                     for each in ((False, 2, 24), (True, 3, 4)))])
def test_random_and_degenerate_dimensions_are_right_too(kind, rates, seed, count):
    for mechanism, rng in hard_cases.linkages(kind, seed, math.ceil(count * SHARE[kind])):
        thetas = hard_cases.angles(rng, 3, ends(mechanism))
        try:
            mechanisms.create('custom', joints=mechanism.design.joints, **mechanism.dimensions)
        except ValueError as error:
            # What is written is refused, in the catalogue it has no place.
            assert 'no triangle has these sides' in str(error)
            assert np.isnan(mechanism.solve(thetas)[mechanism.tracer]).all(), mechanism
            continue
        check(mechanism, thetas, rates)


@pytest.mark.nightly(all_but=4)
@pytest.mark.parametrize('kind, dimensions, branches', [
    case for case in CATALOGUE if case[1] is hard_cases.CATALOGUE[case[0]][0]])
def test_velocities_and_joint_rates_of_the_catalogue_are_right(kind, dimensions, branches):
    mechanism = mechanisms.create(kind, branches=branches, **dimensions)
    check(mechanism, awkward(mechanism, np.random.default_rng(4), 6)[::8], rates=True)


@pytest.mark.parametrize('kind', KINDS)
def test_an_angle_after_a_billion_turns_is_taken_as_it_is_given(kind):
    mechanism = mechanisms.create(kind)
    rng = np.random.default_rng(8)
    turns = np.array([1.0, 1e3, 1e6, 1e9, -1e9])
    check(mechanism, 2 * math.pi * turns + rng.uniform(-1.0, 1.0, turns.size))


@pytest.mark.parametrize('kind, dimensions, theta, output, low, high', [
    # Half its digits at 180 degrees; the wrong branch past a turn.
    ('water_drop', {'a': 0.7}, math.pi - 1e-8, 'B', 1e-9, 1e-6),
    ('water_drop', {'a': 1.0}, math.radians(400.0), 'B', 1.0, 9.0)])
def test_the_original_formulas_break_the_rule(kind, dimensions, theta, output, low, high):
    measure, given = strict(mechanisms.create(kind, **dimensions)), np.array([[theta]])
    places = original_formulas.solve(kind, dimensions, given[:, 0])
    row, = judge(measure, given, {out: places[output] for out in measure.poses
                                  if (out.what, out.name) == ('point', output)})
    assert row.problem == 'rule' and low < row.error < high
