# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Linkages of the user's own: the catalogue written out, change points, two cranks, sweeps."""

import doctest
import math
from pathlib import Path

from linkage_ros import mechanisms
import numpy as np
import pytest
from truth import hard_cases
from truth.accuracy_rule import broken, case_of, judge, summary
from truth.exact_poses import MOVING

TURN = [(-math.pi, math.pi)]
PAGE = Path(__file__).parents[1] / 'docs' / 'which-word.md'
LENGTHS = {'a': 1.0, 'b': 3.0, 'c': 2.5, 'd': 3.2, 'e': 1.5, 'f': 2.0, 'g': 3.5, 'h': 4.0}
FOUR_BAR = ('O ground 0 0', 'Q ground g 0', 'A crank O m', 'B dyad A Q b c left')


def four_bar(m, b, c, g, side=1):
    """Return a four-bar of crank m, coupler b, rocker c and ground g."""
    return mechanisms.create('custom', joints=FOUR_BAR, branches={'B': side}, m=m, b=b, c=c, g=g)


def angles(linkage):
    """Return crank angles over a turn, as many rows as there are cranks."""
    theta = np.linspace(-math.pi, math.pi, 73)
    return [theta * speed for speed in (1.0, 0.5)] if len(linkage.inputs) > 1 else theta


@pytest.mark.nightly(all_but=5)
@pytest.mark.parametrize('kind', list(mechanisms.TYPES))
def test_the_catalogue_written_out_gives_the_same_bits(kind):
    design, own = mechanisms.design(kind), mechanisms.create(kind)
    written = mechanisms.create('custom', joints=design.joints, tracer=design.tracer,
                                **own.dimensions)
    theta = angles(own)
    for ask in ('solve', 'velocity', 'joint_angles', 'joint_rates', 'transmission_angles'):
        mine, theirs = getattr(written, ask)(theta), getattr(own, ask)(theta)
        assert mine.keys() == theirs.keys()
        for name in mine:
            np.testing.assert_array_equal(mine[name], theirs[name], f'{ask} {name}')
    held = (0.7,) * (len(own.inputs) - 1)
    assert written.reach(*held) == own.reach(*held)
    assert (written.bars, written.points, written.links) == (own.bars, own.points, own.links)


def test_every_construction_is_right_to_the_last_digits_where_it_moves():
    rng, rows = np.random.default_rng(3), []
    for _ in range(12):
        lengths = {name: length * hard_cases.log_uniform(rng, 0.6, 1.6)
                   for name, length in LENGTHS.items()}
        branches = {name: int(rng.choice((-1, 1))) for name in 'BSL'}
        try:
            linkage = mechanisms.create('custom', joints=MOVING, branches=branches, **lengths)
        except ValueError as error:
            assert 'no triangle has these sides' in str(error)
            continue
        ends = [end for arc in linkage.reach() for end in arc]
        rows += measured(linkage, hard_cases.angles(rng, 6, ends))
    assert len(rows) > 300 and not broken(rows), summary(rows)


def measured(linkage, thetas):
    """Measure the joints and the angles of a linkage's links."""
    case = case_of(linkage, thetas)
    turning = [link for link in linkage.links if link.kind == 'revolute']
    found = dict(linkage.solve(case.thetas))
    values = linkage.joint_angles(case.thetas, [link.name for link in turning])
    found.update((f'angle {name}', value) for name, value in values.items())
    return judge(case, found, turning)


@pytest.mark.parametrize('m, g', [(1.0, 3.0), (0.1, 0.3), (3.0, 0.7)])
def test_a_parallelogram_stays_one(m, g):
    linkage = four_bar(m, g, m, g)
    place = linkage.solve(np.linspace(-9.0, 9.0, 721))
    np.testing.assert_allclose(place['B'] - place['A'], np.full((721, 2), (g, 0.0)),
                               atol=1e-15 * (m + g))
    assert linkage.reach() == TURN
    assert linkage.dead_points() == pytest.approx([-math.pi, 0.0], abs=1e-15)


def test_a_parallelogram_is_a_line_of_its_own():
    linkage = mechanisms.create('custom', g=0.3, m=0.1, joints=(
        'O ground 0 0', 'Q ground 0 g', 'A crank O m', 'B parallelogram O A Q'))
    theta = np.linspace(-9.0, 9.0, 181)
    place = linkage.solve(theta)
    np.testing.assert_allclose(place['B'] - place['A'], np.full((181, 2), (0.0, 0.3)), atol=1e-16)
    np.testing.assert_allclose(linkage.joint_angles(theta)['QB'],
                               np.arctan2(np.sin(theta), np.cos(theta)), atol=2e-15)
    assert linkage.bar_lengths == {('O', 'A'): 0.1, ('A', 'B'): 0.3, ('Q', 'B'): 0.1}
    assert linkage.dead_points() == pytest.approx([-math.pi / 2, math.pi / 2])


def test_an_antiparallelogram_stays_one():
    linkage = four_bar(1.0, 3.0, 1.0, 3.0, side=-1)
    theta = np.linspace(-3.0, 3.0, 61)
    place = linkage.solve(theta)
    diagonals = [np.linalg.norm(place[p] - place[q], axis=1) for p, q in ('AQ', 'OB')]
    slope = (place['Q'] - place['A']) * (place['B'] - place['O'])[:, ::-1]
    np.testing.assert_allclose(slope[:, 0], slope[:, 1], atol=1e-14)  # AQ is parallel to OB
    assert np.ptp(diagonals[0]) > 0.5


@pytest.mark.parametrize('size', [1.0, 0.01, 0.3, 7e-3])
def test_the_smooth_branch_is_followed_through_a_change_point(size):
    linkage = four_bar(1.0 * size, 2.0 * size, 3.0 * size, 4.0 * size)
    theta = math.pi + np.linspace(-0.02, 0.02, 81)
    speed = linkage.velocity(theta, ('B',))['B']
    assert np.isfinite(speed).all()
    assert np.abs(np.diff(speed, axis=0)).max() < 0.02 * size
    assert np.sign(side_of(linkage, [math.pi - 0.01, math.pi + 0.01])).tolist() == [1.0, -1.0]
    assert linkage.reach() == [(-math.tau, math.tau)]
    assert linkage.dead_points() == pytest.approx([-math.pi, math.pi], abs=1e-15)


def test_the_linkage_with_one_change_point_is_itself_again_after_two_turns():
    linkage = four_bar(1.0, 2.0, 3.0, 4.0)
    theta = np.linspace(-1.0, 1.0, 11)
    here, once, twice = (linkage.solve(theta + 2 * math.pi * turn)['B'] for turn in range(3))
    np.testing.assert_allclose(twice, here, atol=1e-14)
    assert np.abs(once - here).max() > 1.0


def side_of(linkage, theta):
    """Return how far B is on the left of A -> Q."""
    place = linkage.solve(np.asarray(theta, float))
    along, across = place['Q'] - place['A'], place['B'] - place['A']
    return along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]


@pytest.mark.parametrize('side', [1, -1])
@pytest.mark.parametrize('lengths', [
    (1.0, 3.0, 1.0, 3.0), (1.0, 1.0, 3.0, 3.0), (1.0, 2.0, 3.0, 4.0), (3.0, 4.0, 3.0, 2.0)])
def test_the_side_written_is_the_one_at_a_quarter_turn(lengths, side):
    assert np.sign(side_of(four_bar(*lengths, side=side), [math.pi / 2])).tolist() == [side]


def test_a_gap_beyond_rounding_is_no_change_point():
    linkage = four_bar(1.0, 2.0 + 1e-12, 3.0, 4.0)
    assert (side_of(linkage, np.linspace(-6.0, 6.0, 401)) > 0.0).all()


@pytest.mark.parametrize('a', [1.0, 0.1, 0.03])
def test_the_block_of_an_isosceles_slider_crank_swings_through_the_centre(a):
    linkage = mechanisms.create('slider_crank', a=a, b=a, c=0.0)
    theta = np.linspace(-7.0, 7.0, 281)
    np.testing.assert_allclose(linkage.solve(theta)['B'][:, 0], 2 * a * np.cos(theta),
                               atol=2e-15 * a)
    assert linkage.dead_points() == pytest.approx([-math.pi / 2, math.pi / 2], rel=1e-15)


@pytest.mark.parametrize('degrees', [0, 30, 90, 135, 180, -45, -90, -170])
@pytest.mark.parametrize('zero', [0.0, math.pi / 2])
def test_the_block_is_ahead_where_the_pin_is_farthest_along_its_line(degrees, zero):
    linkage = mechanisms.create('custom', a=1.0, p=math.radians(degrees), joints=(
        'O ground 0 0', 'G ground 0 0', f'A crank O a {"up" if zero else ""}',
        'B slider A a G p out'))
    theta = np.linspace(-3.0, 3.0, 31)
    slide = linkage.joint_angles(theta, ('block',))['block']
    np.testing.assert_allclose(slide, 2.0 * np.cos(theta + zero - math.radians(degrees)),
                               atol=2e-15)


def test_a_ground_joint_may_lie_on_the_crank_s_centre():
    linkage = four_bar(1.0, 2.0, 1.5, 0.0)
    place = linkage.solve(np.linspace(-3.0, 3.0, 13))
    np.testing.assert_allclose(np.linalg.norm(place['B'], axis=1), 1.5, rtol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(place['B'] - place['A'], axis=1), 2.0, rtol=1e-15)


CHAIN = (
    'O ground 0 0', 'Q ground 4 0', 'R ground 7 1', 'A crank O m', 'B dyad A Q 4 3 left',
    'P rigid A B 3 2 left', 'C dyad P R 4 2.5 left', 'D line C R -1', 'E dyad D Q 5 4 left',
    'F mirror E D Q', 'G parallelogram E D Q', 'S slider F 6 O 0 out')


@pytest.mark.parametrize('m', [0.8, 1.3, 1.9, 2.6])
def test_the_reach_of_any_linkage_is_where_it_can_be_assembled(m):
    linkage = mechanisms.create('custom', joints=CHAIN, m=m)
    arcs = linkage.reach()
    theta = np.linspace(-math.pi, math.pi, 3601)
    held = np.zeros(theta.shape, bool)
    for lo, hi in arcs:
        held |= np.mod(theta - lo, 2 * math.pi) <= hi - lo
    np.testing.assert_array_equal(held, np.isfinite(linkage.solve(theta)['S']).all(-1))
    for end in [end for arc in arcs for end in arc] if arcs != TURN else []:
        inside = np.isfinite(linkage.solve(np.array([end - 1e-9, end + 1e-9]))['S']).all(-1)
        assert inside.sum() == 1
        assert linkage.distance_to_dead_point(end) < 1e-12


def test_the_chain_has_a_partial_reach():
    assert any(mechanisms.create('custom', joints=CHAIN, m=m).reach() not in ([], TURN)
               for m in (0.8, 1.3, 1.9, 2.6))


def test_two_cranks_turn_on_their_own():
    linkage = mechanisms.create('five_bar')
    assert [input_.name for input_ in linkage.inputs] == ['crank', 'crank2']
    first, second = np.meshgrid(np.linspace(0.5, 2.0, 4), np.linspace(1.0, 2.5, 3))
    place = linkage.solve([first, second])
    assert place['P'].shape == (3, 4, 2)
    np.testing.assert_array_equal(place['A'][0], place['A'][2])
    np.testing.assert_array_equal(place['C'][:, 0], place['C'][:, 3])
    assert linkage.joint_angles([0.5, 1.5])['crank2'] == 1.5
    alone = linkage.solve([0.5, 1.0])
    np.testing.assert_allclose(alone['P'], place['P'][0, 0], rtol=1e-15)


@pytest.mark.parametrize('crank', [0, 1])
def test_velocities_are_by_one_crank_at_a_time(crank):
    linkage, step = mechanisms.create('five_bar'), 1e-6
    at = np.array([1.9, 1.1])
    moved = np.eye(2)[crank] * step
    before, after = (linkage.solve(at + sign * moved)['P'] for sign in (-1, 1))
    np.testing.assert_allclose(linkage.velocity(at, ('P',), crank)['P'],
                               (after - before) / (2 * step), atol=1e-9)
    before, after = (linkage.joint_angles(at + sign * moved)['AP'] for sign in (-1, 1))
    np.testing.assert_allclose(linkage.joint_rates(at, ('AP',), crank)['AP'],
                               (after - before) / (2 * step), atol=1e-8)


def test_the_reach_of_one_crank_depends_on_the_other():
    linkage = mechanisms.create('five_bar')
    theta = np.linspace(-math.pi, math.pi, 721)
    for other in (-2.0, 0.3, 1.25):
        held = np.zeros(theta.shape, bool)
        for lo, hi in linkage.reach(other):
            held |= np.mod(theta - lo, 2 * math.pi) <= hi - lo
        place = linkage.solve([theta, np.full_like(theta, other)])['P']
        np.testing.assert_array_equal(held, np.isfinite(place).all(-1))


def test_every_crank_is_asked_for():
    linkage = mechanisms.create('five_bar')
    with pytest.raises(ValueError, match='five_bar has 2 inputs: the values of all except'):
        linkage.reach()
    with pytest.raises(ValueError, match='theta must be a sequence of as many values'):
        linkage.solve(0.5)


@pytest.mark.parametrize('shape', [(), (1,), (3,), (3, 2)])
@pytest.mark.parametrize('turned', [(), (2,), (1, 2)])
def test_an_array_of_dimensions_is_broadcast_against_the_angle(shape, turned):
    swept = np.linspace(2.6, 3.4, int(np.prod(shape))).reshape(shape)
    theta = np.linspace(0.1, 0.9, int(np.prod(turned))).reshape(turned)
    try:
        expected = np.broadcast_shapes(shape, turned)
    except ValueError:
        pytest.skip('not broadcast')
    linkage = four_bar(1.0, swept, 2.5, 4.0)
    place = linkage.solve(theta)
    assert place['B'].shape == (*expected, 2) and place['O'].shape == (*expected, 2)
    lengths, thetas = np.broadcast_arrays(swept, theta)
    for index in np.ndindex(expected):
        one = four_bar(1.0, float(lengths[index]), 2.5, 4.0)
        np.testing.assert_allclose(place['B'][index], one.solve(float(thetas[index]))['B'],
                                   rtol=1e-14)
        np.testing.assert_allclose(linkage.transmission_angles(theta)['B'][index],
                                   one.transmission_angles(float(thetas[index]))['B'], rtol=1e-14)


def test_questions_about_the_reach_are_for_one_set_of_dimensions():
    linkage = four_bar(1.0, np.array([3.0, 3.1]), 2.5, 4.0)
    for ask in (linkage.reach, linkage.dead_points, lambda: linkage.input_for('QB', 1.0)):
        with pytest.raises(ValueError, match='for one set of dimensions, not for arrays'):
            ask()


def test_arrays_of_dimensions_are_checked_too():
    with pytest.raises(ValueError, match='dimension b must be positive'):
        four_bar(1.0, np.array([3.0, -3.0]), 2.5, 4.0)
    for line, wrong in (('P line A B b-c', 'the bar A-P must be longer'),
                        ('P rigid A B 2 0.7 left', 'no triangle has these sides'),
                        ('P carriage O along Q 2.75 b', 'the lower end of the carriage must be')):
        with pytest.raises(ValueError, match=f'line "{line}": {wrong}'):
            mechanisms.create('custom', joints=(*FOUR_BAR, line), m=1.0, g=4.0, c=2.5,
                              b=np.array([3.0, 2.5]))


def test_the_page_of_words_says_what_is_refused():
    failed, tried = doctest.testfile(str(PAGE), module_relative=False)
    assert tried == 3 and not failed


def test_a_joint_of_a_carriage_stands_still_while_that_is_held():
    linkage = mechanisms.create('custom', joints=(
        'A ground 0 0', 'B ground 2 0', 'C ground 0 1', 'D cylinder B A 1.5 right',
        'E carriage C along B -1 1'))
    with pytest.raises(ValueError, match='E.x of custom does not move with the cylinder'):
        linkage.input_for('E.x', 0.5, others=(0.3,))
