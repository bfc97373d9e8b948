# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The reach is what brute force finds, to the last digits of its ends."""

import math

from linkage_ros import mechanisms
import pytest
from truth import drawing_accuracy, hard_cases

TURN = [(-math.pi, math.pi)]


def told(mechanism, *more):
    """Return what reproduces a failure."""
    return f'{mechanism.type} {mechanism.dimensions} {mechanism.branches} {more}'


@pytest.mark.nightly
@pytest.mark.parametrize('kind, count', [
    ('jansen', 25), ('peaucellier', 60), ('slotted_lever', 100)])
def test_every_end_of_the_reach_is_a_limit_to_the_last_digits(kind, count):
    ends = 0
    for mechanism, _ in hard_cases.linkages(kind, 3, count):
        measure = drawing_accuracy.strict(mechanism)
        for end in (end for arc in mechanism.reach() if [arc] != TURN for end in arc):
            ends += 1
            states = measure.at([end]).states
            assert {'grazes', 'slips'} & {*states.values()}, told(mechanism, end, states)
    assert ends > 20


@pytest.mark.parametrize('kind', ['peaucellier', 'slotted_lever'])
def test_a_joint_that_never_ends_the_reach_moves_no_end_of_it(kind):
    for mechanism, _ in hard_cases.linkages(kind, 8, 8):
        ground, rod = mechanism.grounded[0], 100.0 * sum(map(abs, mechanism.dimensions.values()))
        larger = mechanisms.create('custom', branches=mechanism.branches, joints=(
            *map(str, mechanism.design.joints), f'ZZ slider {mechanism.tracer} {rod!r} {ground} 0'
            ' out'), **mechanism.dimensions)
        assert larger.reach() == mechanism.reach(), told(mechanism)


@pytest.mark.parametrize('a, e', [(80.0, 0.0), (math.nextafter(80.0, 90.0), 0.0), (80.0, 1e-9)])
def test_a_lever_that_swings_a_half_turn_does_so_up_to_rounding(a, e):
    (lo, hi), = mechanisms.create('slotted_lever', a=a, b=80.0, e=e).lever_reach()
    assert hi == pytest.approx(-lo, abs=1e-5) == pytest.approx(0.5 * math.pi, abs=1e-5)


@pytest.mark.parametrize('ground, crank, line', [
    (0.3, 0.2, 'B dyad A Q 0.2 0.7 left'), (0.2, 0.7, 'B dyad A Q 0.3 0.2 left'),
    (0.6, 0.4, 'B dyad A Q 0.1 0.1 left'), (0.4, 0.2, 'B slot Q A 0.6 out 0.1')])
def test_a_linkage_that_fits_in_one_pose_alone_has_no_reach(ground, crank, line):
    # In floats the lengths differ by rounding from those that just fit, to either side.
    single = mechanisms.create('custom', joints=(
        'O ground 0 0', f'Q ground {ground} 0', f'A crank O {crank}', line))
    assert single.reach() == []
