# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Accelerations beside a drawing in many digits, and efforts beside forces in bars."""

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


@pytest.mark.parametrize('name', [*mechanisms.TYPES, 'boom', 'elbow', 'oscillating'])
def test_joint_accelerations_are_the_change_of_the_joint_rates(name):
    mechanism, h = made(name), 2.0 ** -17
    n = len(mechanism.inputs)
    theta, rate, change = (np.array(row[:n]) for row in ((0.8, 1.0), (1.5, -0.5), (0.3, 0.9)))
    if name == 'watt':
        theta = np.array([0.4 * sum(mechanism.reach()[0])])

    def rates(time):
        now, speeds = theta + rate * time + 0.5 * change * time ** 2, rate + change * time
        by = [mechanism.joint_rates(one(now.tolist()), None, i) for i in range(n)]
        return {name: sum(own[name] * s for own, s in zip(by, speeds)) for name in by[0]}

    found = mechanism.joint_accelerations(*(one(x.tolist()) for x in (theta, rate, change)))
    before, after = rates(-h), rates(h)
    for link, value in found.items():
        wanted = (after[link] - before[link]) / (2.0 * h)
        assert float(value) == pytest.approx(float(wanted), rel=1e-7, abs=1e-7), link


@pytest.mark.parametrize('shape', [(), (1,), (3, 2), (0,)])
def test_accelerations_have_the_shape_of_what_is_given(shape):
    mechanism = mechanisms.create('four_bar')
    found = mechanism.acceleration(np.full(shape, 0.5), 2.0, 0.0, ('B',))
    assert found['B'].shape == (*shape, 2)
    assert mechanism.joint_accelerations(np.full(shape, 0.5), 2.0, 0.0)['QB'].shape == shape


# --- efforts ---

def bar_forces(mechanism, place, loads, moving):
    """
    Return the efforts that the joints' own balance asks for, the bars' forces unknown as well.

    A crank pushes its pin across its arm, a cylinder along itself; each moving joint is at rest.
    """
    lines = {line.name: line for line in mechanism.links}
    columns = []
    for joints in (*mechanism.bars, *mechanism.cylinders):
        first, second = (place[joint] for joint in joints)
        along = (second - first) / np.hypot(*(second - first))
        columns.append({joints[0]: -along, joints[1]: along})
    efforts = columns[len(mechanism.bars):]
    del columns[len(mechanism.bars):]
    for input_ in mechanism.inputs:
        if input_.turns:
            link = lines[input_.name]
            arm = place[link.tip] - place[link.joint]
            efforts.append({link.tip: np.array([-arm[1], arm[0]]) / (arm @ arm)})
    matrix = np.array([np.concatenate([column.get(joint, np.zeros(2)) for joint in moving])
                       for column in columns + efforts]).T
    right = -np.concatenate([np.asarray(loads.get(joint, (0.0, 0.0)), float) for joint in moving])
    assert matrix.shape[0] == matrix.shape[1]
    return np.linalg.solve(matrix, right)[len(columns):]


@pytest.mark.parametrize('name', ['jansen', 'peaucellier', 'klann', 'five_bar', 'boom'])
def test_efforts_balance_the_forces_in_the_bars(name):
    mechanism, rng = made(name), np.random.default_rng(5)
    n = len(mechanism.inputs)
    for value in (0.3, 0.5, 0.75):
        theta = one([value + 0.4 * i for i in range(n)]) if name != 'boom' else 0.7 + value
        place = mechanism.solve(theta)
        moving = [joint for joint, at in place.items()
                  if np.abs(at - mechanism.solve(one([0.61] * n))[joint]).max() > 1e-9]
        loads = {joint: rng.uniform(-10.0, 10.0, 2) for joint in moving}
        wanted = bar_forces(mechanism, place, loads, moving)
        assert mechanism.effort(theta, loads) == pytest.approx(wanted, rel=1e-9)


def test_a_moment_is_a_couple_of_forces():
    leg, theta = mechanisms.create('jansen'), np.linspace(-3.0, 3.0, 13)
    place = leg.solve(theta)
    arm = place['G'] - place['E']
    across = np.stack([-arm[..., 1], arm[..., 0]], -1) / (arm * arm).sum(-1)[..., None]
    moment = leg.effort(theta, {'EF': 5.0})
    couple = leg.effort(theta, {'G': 5.0 * across, 'E': -5.0 * across})
    assert moment.shape == (13, 1) and moment == pytest.approx(couple, rel=1e-9)


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
