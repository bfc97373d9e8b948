# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Every answer is right to the last digits, and NaN is given exactly where there is no answer."""

import math

from hypothesis import given, settings, strategies as st
from linkage_ros import mechanisms
import numpy as np
import pytest
from truth import hard_cases, original_formulas
from truth.accuracy_rule import answers, broken, Case, judge, measure, measure_servo, summary

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


def some(kind, seed, count):
    """Yield random mechanisms of a kind with a generator for their angles."""
    rng = np.random.default_rng(seed)
    for _ in range(math.ceil(count * SHARE[kind])):
        branches = BRANCHES[kind][rng.integers(len(BRANCHES[kind]))]
        yield mechanisms.create(kind, branches=branches, **hard_cases.dimensions(kind, rng)), rng


def check(rows):
    """Fail with the numbers that reproduce the worst row."""
    assert rows
    assert not broken(rows), summary(rows)


@pytest.mark.nightly(all_but=8)
@pytest.mark.parametrize('near', [12, pytest.param(40, marks=pytest.mark.nightly)])
@pytest.mark.parametrize('kind, dimensions, branches', CATALOGUE)
def test_the_catalogue_is_right_to_the_last_digits(kind, dimensions, branches, near):
    mechanism = mechanisms.create(kind, branches=branches, **dimensions)
    check(measure(mechanism, awkward(mechanism, np.random.default_rng(1), 3, near)))


@pytest.mark.nightly
@pytest.mark.parametrize('kind', KINDS)
def test_random_and_degenerate_dimensions_are_right_too(kind):
    rows = []
    for mechanism, rng in some(kind, seed=2, count=24):
        rows += measure(mechanism, hard_cases.angles(rng, 3, ends(mechanism)))
    check(rows)


@pytest.mark.nightly
@pytest.mark.parametrize('kind', KINDS)
def test_velocities_and_joint_rates_are_right(kind):
    rows = []
    for mechanism, rng in some(kind, seed=3, count=4):
        rows += measure(mechanism, hard_cases.angles(rng, 2, ends(mechanism)), rates=True)
    check(rows)


@pytest.mark.nightly(all_but=4)
@pytest.mark.parametrize('kind, dimensions, branches', [
    case for case in CATALOGUE if case[1] is hard_cases.CATALOGUE[case[0]][0]])
def test_velocities_and_joint_rates_of_the_catalogue_are_right(kind, dimensions, branches):
    mechanism = mechanisms.create(kind, branches=branches, **dimensions)
    check(measure(mechanism, awkward(mechanism, np.random.default_rng(4), 6)[::8], rates=True))


@pytest.mark.nightly
@pytest.mark.parametrize('half', [1, -1])
def test_the_inverse_of_the_lever_is_right_on_both_branches(half):
    rows = []
    for mechanism, rng in some('slotted_lever', seed=5, count=12):
        lever = mechanisms.create('slotted_lever', branches={'L': half}, **mechanism.dimensions)
        limits = [end for arc in lever.lever_reach() for end in arc]
        rows += measure_servo(lever, hard_cases.angles(rng, 4, limits, turns=1.0))
    for dimensions in hard_cases.CATALOGUE['slotted_lever'][::2]:
        lever = mechanisms.create('slotted_lever', branches={'L': half}, **dimensions)
        for limit in [end for arc in lever.lever_reach() for end in arc][:2]:
            rows += measure_servo(lever, hard_cases.approach(limit))
    check(rows)


@given(theta=st.floats(-1e10, 1e10), a=st.floats(0.01, 100.0), b=st.floats(0.01, 100.0),
       e=st.floats(-100.0, 100.0).filter(lambda e: e == 0.0 or abs(e) > 1e-6))
@settings(max_examples=25, derandomize=True)
def test_any_lever_at_any_angle_is_right(theta, a, b, e):
    check(measure(mechanisms.create('slotted_lever', a=a, b=b, e=e), [theta]))


@given(theta=st.floats(-4.0, 4.0), r=st.floats(0.1, 10.0), a=st.floats(0.1, 10.0),
       b=st.floats(0.1, 10.0))
@settings(max_examples=25, derandomize=True)
def test_any_inversor_at_any_angle_is_right(theta, r, a, b):
    check(measure(mechanisms.create('peaucellier', r=r, a=a, b=b), [theta]))


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize('power', [-80, 80])
def test_lengths_times_a_power_of_two_give_the_same_bits(kind, power):
    scale = 2.0 ** power
    for mechanism, rng in some(kind, seed=7, count=5):
        grown = {name: value * scale for name, value in mechanism.dimensions.items()}
        grown = mechanisms.create(kind, branches=mechanism.branches, **grown)
        theta = hard_cases.angles(rng, 10, ends(mechanism))
        ours, theirs = answers(mechanism, theta, rates=True), answers(grown, theta, rates=True)
        for name in ours:
            turns = name.startswith(('angle', 'rate')) and name != 'rate slide'
            np.testing.assert_array_equal(theirs[name], ours[name] * (1.0 if turns else scale),
                                          err_msg=f'{name} of {mechanism!r}')
        assert grown.reach() == mechanism.reach()


@pytest.mark.parametrize('kind', KINDS)
def test_an_angle_after_a_billion_turns_is_taken_as_it_is_given(kind):
    mechanism = mechanisms.create(kind)
    rng = np.random.default_rng(8)
    turns = np.array([1.0, 1e3, 1e6, 1e9, -1e9])
    check(measure(mechanism, 2 * math.pi * turns + rng.uniform(-1.0, 1.0, turns.size)))


@pytest.mark.parametrize('kind, output, flaw', [
    ('water_drop', 'P', 4e-15), ('jansen', 'G', 2e-12), ('slotted_lever', 'angle lever', 4e-15)])
def test_the_measure_sees_a_flaw_in_the_last_digits(kind, output, flaw):
    mechanism = mechanisms.create(kind)
    theta = np.array([0.3, 1.1, 2.9])
    found = answers(mechanism, theta)
    case = Case(kind, mechanism.dimensions, theta)
    assert not broken(judge(case, found, mechanism.links))
    found[output] = found[output] + flaw
    assert {row.output for row in broken(judge(case, found, mechanism.links))} == {output}


def test_the_measure_sees_a_wrong_nan_and_a_missing_one():
    mechanism = mechanisms.create('peaucellier')
    theta = np.array([0.3, 3.0])
    found = answers(mechanism, theta)
    found['B'] = found['B'][::-1]
    rows = broken(judge(Case('peaucellier', mechanism.dimensions, theta), found, mechanism.links))
    assert [(row.output, row.theta, row.problem) for row in rows] == [
        ('B', 0.3, 'NaN'), ('B', 3.0, 'missed NaN')]


def original(kind, dimensions, theta):
    """Measure the formulas of the original documents; returns {joint: worst row}."""
    mechanism = mechanisms.create(kind, **dimensions)
    theta = np.array(theta)
    found = original_formulas.solve(kind, dimensions, theta)
    if kind == 'slotted_lever':
        found['angle lever'] = original_formulas.lever_angle(theta, dimensions['a'],
                                                             dimensions['b'])
    rows = judge(Case(kind, dimensions, theta), found, mechanism.links)
    return {row.output: row for row in sorted(rows, key=lambda row: row.ratio)}


def test_the_original_water_drop_loses_half_its_digits_at_180_degrees():
    row = original('water_drop', {'a': 0.7}, [math.pi - 1e-8, math.pi + 1e-8])['B']
    assert row.problem == 'rule' and 1e-9 < row.error < 1e-6


def test_the_original_water_drop_is_on_the_wrong_branch_past_a_turn():
    row = original('water_drop', {'a': 1.0}, [math.radians(400.0)])['B']
    assert row.problem == 'rule' and row.error > 1.0


def test_the_original_lever_is_wrong_by_half_a_turn_where_the_crank_is_longer():
    row = original('slotted_lever', {'a': 150.0, 'b': 80.0, 'e': 0.0}, [3.0])['angle lever']
    assert row.problem == 'rule' and abs(row.error - math.pi) < 1e-12
