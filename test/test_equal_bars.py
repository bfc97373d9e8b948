# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Poses where equal bars lie on each other: the limit from both sides, or none; never infinite."""

import itertools

from linkage_ros import mechanisms
import numpy as np
import pytest
from truth import equal_bars, linkage_checks, random_linkages
from truth.random_linkages import Design

# A crank as long as the ground, and what can stand on its arm: the language's words.
FOLDED = {
    'dyad': 'C dyad A Q r r left', 'dyad, backwards': 'C dyad Q A r r right',
    'mirror': 'C mirror O A Q', 'kite': 'B mirror O A Q,C line A B -r',
    'antiparallelogram': 'C antiparallelogram O A Q', 'long dyad': 'C dyad A Q 3*r 3*r left',
    'chain': 'B dyad A Q r r left,C dyad B O 2*r 2*r right',
    'inversor': 'B C D inversor Q A r r'}
SIZES = 1.0, 0.3, 1e-28, 1e28


def folded(word, size):
    """Return a linkage whose arm Q -> A has no length at zero."""
    return Design(('O ground 0 0', 'Q ground r 0', 'A crank O r', *FOLDED[word].split(',')),
                  {'r': size}, {})


def hold(design):
    """Hold a linkage, if it is one, next to the special values of its first input."""
    problems = linkage_checks.problems(design, np.random.default_rng(0), [equal_bars.limited])
    assert not problems or not problems[0], problems[0][0]


@pytest.mark.nightly(all_but=4)
@pytest.mark.parametrize('word, size', [*itertools.product(FOLDED, SIZES)])
def test_what_stands_on_an_arm_of_no_length_has_the_limit(word, size):
    hold(folded(word, size))


@pytest.mark.parametrize('word', FOLDED)
def test_a_ground_line_that_rounding_makes_longer_than_the_crank_is_as_long(word):
    found, theta = folded(word, 0.3).linkage(), np.linspace(-13.0, 13.0, 999)
    # 0.4 - 0.1 is 0.30000000000000004.
    moved = mechanisms.create('custom', r=0.3, joints=[
        'O ground 0.1 0', 'Q ground 0.4 0', *found.design.joints[2:]])
    assert moved.period() == found.period()
    for name, place in found.solve(theta).items():
        np.testing.assert_allclose(moved.solve(theta)[name] - (0.1, 0.0), place, atol=1e-12)


@pytest.mark.nightly(all_but=1)
@pytest.mark.parametrize('seeds', [(0, 299), *(range(k, k + 25) for k in range(0, 300, 25))])
def test_random_linkages_of_equal_bars_have_limits_and_nothing_infinite(seeds):
    for seed in seeds:
        hold(random_linkages.equal_bars(np.random.default_rng(seed)))


@pytest.mark.nightly(all_but=1)
@pytest.mark.parametrize('kind', mechanisms.TYPES)
def test_the_catalogue_with_pairwise_equal_bars_has_limits_and_nothing_infinite(kind):
    own = mechanisms.create(kind)
    hold(Design(own.design.joints, own.dimensions, own.branches))
    for one, other in [*itertools.combinations(own.dimensions, 2)][:11]:
        hold(Design(own.design.joints, {**own.dimensions, one: own.dimensions[other]},
                    own.branches))


@pytest.mark.parametrize('lines, where', [
    # A lever whose pin comes to its pivot turns by half a turn there.
    (('Q ground 1 0', 'A crank O 1', 'L slot Q A 0 out 2'), 0.0),
    # The joint of a dyad on a carriage that comes to the ground joint changes sides.
    (('Q ground 1 0', 'S carriage O along Q -1 1', 'C dyad O S 2 2 left'), 0.0)])
def test_a_joint_that_would_jump_has_no_place_there(lines, where):
    linkage = mechanisms.create('custom', joints=['O ground 0 0', *lines])
    for theta in (where, where + 5e-324, where - 1e-200):
        assert np.isnan(linkage.solve(theta, linkage.points[-1:])[linkage.points[-1]]).all()
        assert np.isnan(linkage.solve(np.array([theta]))[linkage.points[-1]]).all()
    sides = [linkage.solve(where + step)[linkage.points[-1]] for step in (1e-12, -1e-12)]
    assert np.linalg.norm(np.subtract(*sides)) > 1.9
