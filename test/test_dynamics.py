# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Accelerations beside a drawing in many digits, and what efforts say at dead points."""

import math

from linkage_ros import mechanisms
import numpy as np
import pytest
from truth.drawing_accuracy import broken, Motion
from truth.linkage_checks import Subject
from truth.random_linkages import Design

BOOM = {'joints': ('O ground 0 0', 'P ground 0.5 -0.2', 'B cylinder P O 1.1 left')}
ELBOW = {'joints': ('O ground 0 0', 'A crank O 1', 'B crank A 0.7 zero O')}
OSCILLATING = {'joints': ('O ground 0 0', 'Q ground 2 0', 'A crank O 0.5', 'B slot Q A 0.3 out 3')}


def made(name):
    """Return a mechanism of the catalogue, or one of those above."""
    own = {'boom': BOOM, 'elbow': ELBOW, 'oscillating': OSCILLATING}
    return mechanisms.create('custom', **own[name]) if name in own else mechanisms.create(name)


def one(values):
    """Return the value of the only input, or all."""
    return values[0] if len(values) == 1 else values


# --- accelerations ---

@pytest.mark.nightly(all_but=5)
@pytest.mark.parametrize('name', [*mechanisms.TYPES, 'boom', 'elbow'])
def test_accelerations_keep_the_rule_of_accuracy(name):
    mechanism, rng = made(name), np.random.default_rng(4)
    design = mechanism.design
    subject = Subject(Design(design.joints, mechanism.dimensions, mechanism.branches), rng)
    low, high = max(mechanism.reach(*subject.held), key=lambda arc: arc[1] - arc[0])
    given = [[value, *subject.held] for value in rng.uniform(low, high, 4)]
    motion = Motion(*map(tuple, rng.uniform(-2.0, 2.0, (2, len(mechanism.inputs)))))
    rows = subject.fitted(np.array(given), motion=motion)
    assert any(row.output.order == 2 and row.sensitivity for row in rows)
    assert not broken(rows)


@pytest.mark.parametrize('shape', [(), (1,), (3, 2), (0,)])
def test_accelerations_have_the_shape_of_what_is_given(shape):
    mechanism = mechanisms.create('four_bar')
    found = mechanism.acceleration(np.full(shape, 0.5), 2.0, 0.0, ('B',))
    assert found['B'].shape == (*shape, 2)
    assert mechanism.joint_accelerations(np.full(shape, 0.5), 2.0, 0.0)['QB'].shape == shape


# --- efforts ---


def test_a_rocker_and_its_crank_share_the_power():
    bars = mechanisms.create('four_bar')
    for theta in (0.4, 1.0, 2.2):
        torque = bars.effort(theta, {'QB': -3.0})[0]
        assert bars.output_effort('QB', theta, torque) == pytest.approx(3.0)
    push = mechanisms.create('slider_crank')
    assert push.output_effort('block', 0.7, push.effort(0.7, {'B': (-8.0, 0.0)})[0]) == (
        pytest.approx(8.0))


def test_next_to_a_dead_point_it_grows_without_bound():
    cell = mechanisms.create('peaucellier')
    end = cell.reach()[0][1]
    efforts = [abs(cell.effort(end - gap, {'B': (1.0, 0.3)})[0]) for gap in (1e-2, 1e-6, 1e-10)]
    assert efforts[1] / efforts[0] == pytest.approx(1e2, rel=0.1)
    assert efforts[2] / efforts[1] == pytest.approx(1e2, rel=0.1)
    assert not abs(cell.effort(end, {'B': (1.0, 0.3)})[0]) < 1e6
    assert math.isinf(mechanisms.create('slider_crank', c=0.0).output_effort(
        'block', 0.0, 1.0))


@pytest.mark.parametrize('loads, said', [
    ({'Z': (1.0, 2.0)}, "no joint or link 'Z' to load; allowed: O, Q, A"),
    ({'B': 3.0}, 'the load on the joint B must be a force x, y'),
    ({'B': (1.0, 2.0, 3.0)}, 'the load on the joint B must be a force x, y'),
    ({'QB': 'much'}, 'the load on QB')])
def test_a_load_that_cannot_be_is_refused(loads, said):
    with pytest.raises(ValueError, match=said):
        mechanisms.create('four_bar').effort(0.4, loads)


def test_loads_and_outputs_that_are_none_are_refused():
    linkage = mechanisms.create('four_bar')
    for loads in ([1.0, 2.0], 'B', 3.0, None):
        with pytest.raises(ValueError, match='loads must be a mapping'):
            linkage.effort(0.5, loads)
    with pytest.raises(ValueError, match='O.x of four_bar does not move with the crank'):
        linkage.output_effort('O.x', 0.5, 1.0)
