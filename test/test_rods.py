# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Linkages of rods in space: against 90 digits, a polynomial of degree eight and brute force."""

import math
import random
import re

import gmpy2
from linkage_ros import mechanisms, scene
from linkage_ros.c_code import header
from linkage_ros.linkage import FORMS, WindowError
from linkage_ros.linkage.geometry import window as proof
import numpy as np
import pytest
from scenes import alone, G1
from truth import rods
from truth.hostile_texts import NUMBERS

RULE, RATE_RULE = 4.0, 8.0
DEGREE = math.pi / 180.0
ONE_ROD = (
    'out hinge ground at ox oy oz axis hx hy hz', 'crank motor ground at mx my mz axis ax ay az',
    'R rod crank px py pz out ex ey ez length l')
LETTERS = dict(zip('maphe', ('motor', 'motor_axis', 'pivot', 'hinge_axis', 'end')), o='hinge')


def made(lines, **dimensions):
    """Return a linkage of rods."""
    return mechanisms.create('rods', joints=lines, **dimensions)


def swept(cases):
    """Return the linkages of random rods as one with arrays of dimensions."""
    parts = {f'{letter}{axis}': cases[name][:, i] for letter, name in LETTERS.items()
             for i, axis in enumerate('xyz')}
    return made(ONE_ROD, l=cases['length'], **parts)


@pytest.mark.parametrize('seed, count', [
    (1, 10), pytest.param(101, 20000, marks=pytest.mark.nightly)])
def test_a_rod_on_a_hinge_is_right_to_the_last_digits(seed, count):
    cases = rods.random_rods(np.random.default_rng(seed), count)
    linkage, values = swept(cases), cases['angle']
    angles = linkage.joint_angles(values, ['out'])['out']
    rates = linkage.joint_rates(values, ['out'])['out']
    assembled = 0
    for i in range(len(values)):
        with rods.exactly():
            case = rods.Rod(*([gmpy2.mpfr(x) for x in np.atleast_1d(cases[name][i])]
                              for name in cases))
            angle, rate = rods.measured(case)
            if angle is None:
                assert math.isnan(angles[i]) or rods.beyond(case) < 16.0
                continue
            assembled += 1
            error = rods.apart(angle[0], gmpy2.mpfr(angles[i]))
            assert error <= RULE * angle[1] + np.spacing(math.pi), (seed, i)
            if rate:
                error = abs(rate[0] - gmpy2.mpfr(rates[i]))
                assert error <= RATE_RULE * rate[1] + np.spacing(abs(rates[i])), (seed, i)
    assert assembled > 0.4 * count


def offers(error):
    """Return the window [rad] that a refusal says to paste; None if it says none."""
    limits = re.findall(r'within (\S+)deg (\S+)deg(?=[,;]|$)', str(error))
    return np.array(limits, float).T * DEGREE if limits else None


def offered(lines):
    """Return the window that is offered where there are no limits."""
    with pytest.raises(ValueError, match='line "roll .*both hinges need limits') as error:
        made(lines)
    return offers(error.value)


def ankles(seed, count):
    """Yield random ankles with the window that is offered for each."""
    rng = np.random.default_rng(seed)
    while count:
        ankle = rods.random_ankle(rng, plausible=count % 3 > 0)
        window = offered(ankle.lines)
        if window is not None:
            count -= 1
            yield ankle, window, rng


def driven(ankle, window):
    """Return an ankle's linkage, and its inputs for arrays of poses, on the sides drawn."""
    linkage = made(ankle.within(*window))
    inverse = linkage.driven_by('pitch', 'roll')

    def motors(poses):
        angles = inverse.joint_angles(poses, ['l', 'r'])
        return np.stack([angles['l'], angles['r']])
    return linkage, motors


def pose(linkage, motors):
    """Return pitch and roll."""
    return np.stack(list(linkage.joint_angles(motors, ['pitch', 'roll']).values()))


def check_ankle(ankle, window, rng, poses, exact):
    """Hold an ankle to the rule: no pose missed, none but the right one."""
    linkage, motors = driven(ankle, window)
    expected = rng.uniform(*window, (poses, 2)).T
    # The edges of the window belong to it.
    expected[0, ::10], expected[1, 5::10] = window[1][0], window[0][1]
    inputs = motors(expected)
    reached = ~np.isnan(inputs).any(axis=0)
    angles = pose(linkage, inputs)
    np.testing.assert_allclose(angles[:, reached], expected[:, reached], atol=1e-11)
    assert np.isnan(angles[:, ~reached]).all()
    with rods.exactly():
        for i in rng.choice(np.flatnonzero(reached), exact):
            errors, sensitivity = rods.pose_error(ankle, inputs[:, i], *angles[:, i])
            for error, given, value in zip(errors, sensitivity, angles[:, i]):
                assert error <= RULE * given + np.spacing(abs(value))


@pytest.mark.parametrize('seed, count, poses', [(2, 3, 500), (1000, 10, 10000)])
@pytest.mark.nightly
def test_two_rods_find_every_pose_inside_the_limits(seed, count, poses):
    for ankle, window, rng in ankles(seed, count):
        check_ankle(ankle, window, rng, poses, exact=poses // 100)


# Numbers of no robot: axes that lean from all others, far from the points that turn about them.
@pytest.mark.nightly
@pytest.mark.parametrize('parts', [
    ([-0.92, -0.12, 0.56], [0.16, 0.5, 0.5], [0.72, -1.36, 1.26], [1.84, 2.15, 1.2],
     [[-1.45, -0.16, 0.21], [0.32, 0.85, -1.76]], [[-0.77, 1.42, -0.42], [-0.68, 0.64, 0.69]],
     [[0.17, -1.41, 0.67], [0.37, 0.04, 0.88]], [[1.34, 1.15, -1.79], [0.4, -0.7, 0.38]]),
    ([-0.97, 0.57, 0.28], [-0.1, -0.88, 0.36], [2.17, -0.56, -2.61], [0.26, 0.26, -0.38],
     [None, None], [None, None],
     [[1.29, 0.25, -0.5], [0.05, -0.46, -1.17]], [[-0.55, 0.26, -0.2], [-0.41, -1.34, 1.71]])])
def test_two_rods_keep_the_rule_where_axes_round_badly(parts):
    window = np.array([(-0.04, -0.04), (0.04, 0.04)])
    check_ankle(rods.drawn(*parts), window, np.random.default_rng(1), poses=300, exact=150)


def check_assemblies(ankle, window, rng, count):
    """Hold numbers and NaN to all real assemblies; return how many poses are in the window."""
    linkage, motors = driven(ankle, window)
    inputs = rng.uniform(-math.pi, math.pi, (2, count))
    if ankle.motor_axes[0] is None:
        inputs = motors(rng.uniform(*window, (count, 2)).T) * rng.uniform(0.8, 1.2, (2, count))
    angles = pose(linkage, inputs)
    all_ = np.stack(rods.assemblies(ankle, inputs), axis=-1)
    inside = ((all_ > window[0]) & (all_ < window[1])).all(axis=-1)
    # Where a root is on the edge but for the rounding of the judge either will do.
    edge = np.abs(np.minimum(all_ - window[0], window[1] - all_)).min(axis=-1) < 1e-6
    inside &= rods.are_drawn(ankle, inputs[..., None], all_[..., 0], all_[..., 1])
    clear = ~edge.any(axis=1)
    assert inside.sum(axis=1).max() <= 1
    assert (np.isnan(angles[0]) == ~inside.any(axis=1))[clear].all()
    there = inside.any(axis=1) & clear
    right = all_[there][inside[there]]
    np.testing.assert_allclose(angles[:, there].T, right, atol=1e-5)
    return there.sum()


@pytest.mark.parametrize('seed, count, poses', [(3, 2, 500), (2000, 5, 10000)])
@pytest.mark.nightly
def test_no_pose_is_of_another_assembly(seed, count, poses):
    counts = [check_assemblies(*each, poses) for each in ankles(seed, count)]
    assert sum(counts) > 0.02 * count * poses


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('turned', [1, -1])
@pytest.mark.parametrize('robot', rods.REAL)
def test_the_ranges_of_real_ankles_are_proved_whatever_their_signs(robot, turned):
    # With both axes the other way, the limits are, too.
    parts, window = rods.REAL[robot]
    ankle = rods.drawn(*(np.multiply(part, turned) if i in (1, 3) else part
                         for i, part in enumerate(parts)))
    window = np.sort(np.multiply(window, turned), axis=0)
    count = check_assemblies(ankle, window, np.random.default_rng(1), 400)
    assert count > 3


@pytest.mark.parametrize('seed, count', [
    (4, 3), pytest.param(3000, 75, marks=pytest.mark.nightly)])
def test_limits_with_a_second_or_a_singular_pose_are_refused(seed, count):
    rng, ambiguous = np.random.default_rng(seed), 0
    for i in range(count):
        ankle = rods.random_ankle(rng, plausible=i % 3 > 0)
        if i % 4 == 1:  # a cylinder and a crank
            ankle = ankle._replace(motor_axes=[None, ankle.motor_axes[1]])
        half = rng.uniform(0.2, 1.4, 2)
        middle = rng.uniform(-0.3, 0.3, 2)
        try:
            made(ankle.within(middle - half, middle + half))
        except WindowError as error:
            assert re.match('joint line "roll .*there (is|may be) a second pose', str(error))
            ambiguous += rods.is_ambiguous(ankle, middle - half, middle + half)
            # The largest that is offered instead is as near to a second pose as the proof goes.
            if error.limits:
                low, high = offers(error)
                alone('rods', joints=ankle.within(low, high))
                assert not rods.is_ambiguous(ankle, low, high), (seed, i)
        else:
            assert not rods.is_ambiguous(ankle, middle - half, middle + half), (seed, i)
    assert ambiguous > 0.3 * count


@pytest.mark.nightly(all_but=1)
@pytest.mark.parametrize('seed', [2, 1, 3, 4, 5, 8])
def test_the_two_poses_of_refused_limits_are_two_poses(seed):
    ankle = rods.random_ankle(np.random.default_rng(seed))
    lines = ankle.within([-1.6, -1.4], [1.6, 1.4])
    with pytest.raises(WindowError) as error:
        made(lines)
    with pytest.raises(scene.SceneError, match=re.escape(error.value.problem[-99:])):
        scene.read({'mechanisms': ['ankle'], 'ankle.type': 'rods', 'ankle.joints': lines})
    left, right, *poses = map(float, re.search(
        r'[lr] at ([^,]+), [lr] at ([^,]+), pitch at (\S+), roll at (\S+) '
        r'as well as pitch at (\S+), roll at ([^;]+)$', error.value.problem).groups())
    # With six digits they are next to poses of these motors.
    for pitch, roll in (poses[:2], poses[2:]):
        every = np.stack(rods.assemblies(ankle, [[left], [right]]), axis=-1)[0]
        assert np.nanmin(np.abs(every - (pitch, roll)).max(axis=-1)) < 1e-3
        assert rods.are_drawn(ankle, [left, right], pitch, roll)
    assert max(abs(np.subtract(poses[:2], poses[2:]))) > 1e-2


def test_in_boxes_of_poses_motors_and_gradients_are_inside_the_bounds_of_the_proof():
    rng = np.random.default_rng(5)

    def holds(boxes, values, turn=math.tau):
        gaps = values - boxes.middle
        return np.all(abs(gaps - turn * np.round(gaps / turn)) <= boxes.half + 1e-9)

    for _ in range(20):
        (a, u, v), (k, e, f) = paths = [
            [3.0 * x, *rng.uniform(0.2, 2.0) * np.linalg.qr(rng.normal(size=(3, 2)))[0].T]
            for x in rng.normal(size=(2, 3))]
        pivot, end = (proof.Circle(*(proof.Vector(*x) for x in path)) for path in paths)
        half, middle = 10.0 ** rng.uniform(-2.0, -0.3, (3, 400)), rng.uniform(-3, 3, (3, 400))
        # Many of them at corners.
        theta, p, r = (middle + half * (1.5 * rng.uniform(-1, 1, half.shape)).clip(-1, 1))
        q, ahead = (np.outer(x, np.cos(r)) + np.outer(y, np.sin(r)) for x, y in ((e, f), (f, -e)))
        turn = np.array([[np.cos(p), -np.sin(p), 0 * p], [np.sin(p), np.cos(p), 0 * p],
                         [0 * p, 0 * p, 1 + 0 * p]])
        b, by_r = (np.einsum('ijn,jn->in', turn, x) for x in (q + k[:, None], ahead))
        off = a[:, None] + np.outer(u, np.cos(theta)) + np.outer(v, np.sin(theta)) - b
        moved = np.outer(v, np.cos(theta)) - np.outer(u, np.sin(theta))
        rod = proof.WindowRod(pivot, end, np.linalg.norm(off, axis=0),
                               np.sign((off * moved).sum(axis=0)))
        poses = proof.Boxes(middle[1:], half[1:])
        assert holds(rod.ranges(poses), theta)
        wide = rng.uniform(0.0, math.pi, theta.shape)
        others = proof.Boxes(theta + wide * rng.uniform(-1, 1, theta.shape), wide)
        assert holds(rod.shared(rod.ranges(poses), others), theta)
        gradient = off[0] * b[1] - off[1] * b[0] - 1j * (off * by_r).sum(axis=0)
        assert holds(rod.directions(proof.Boxes(middle[0], half[0]), poses), np.angle(gradient))
        rod = proof.WindowRod(pivot._replace(u=3 * (0.0,), v=3 * (0.0,)), end, None, 0.0)
        assert holds(rod.ranges(poses), np.linalg.norm(a[:, None] - b, axis=0), 1e9)


@pytest.fixture(scope='module')
def g1():
    return made(G1)


def test_a_pose_is_that_of_the_motors_alone(g1):
    motors = np.random.default_rng(6).uniform(-1.0, 1.0, (2, 500))
    alone = np.array([g1.function((), ('pitch', 'roll'))(*each) for each in motors.T.tolist()]).T
    angles = pose(g1, motors)
    np.testing.assert_allclose(angles, alone, atol=1e-15)
    np.testing.assert_allclose(pose(g1, motors + 2.0 * math.pi), angles, atol=1e-13)


def test_machine_code_finds_the_same_poses(g1):
    pytest.importorskip('llvmlite')
    motors = np.random.default_rng(7).uniform(-1.0, 1.0, (2, 20000))
    np.testing.assert_allclose(pose(g1.accelerated(), motors), pose(g1, motors), atol=2e-15)


def test_the_motors_of_a_pose_are_those_on_the_drawn_sides(g1):
    folded, expected = made(G1, branches={'R': -1}), (-0.1, 0.05)
    for linkage, other in ((g1, folded), (folded, g1)):
        answer, = linkage.inputs_for(('pitch', 'roll'), expected)
        np.testing.assert_allclose(pose(linkage, answer.inputs), expected, atol=1e-14)
        # A branch has its crank on the other side, and no pose in common.
        assert np.isnan(pose(other, answer.inputs)).all()
        drawn = linkage.driven_by('pitch', 'roll').joint_angles(expected, ('right', 'left'))
        assert np.allclose(answer.inputs, list(drawn.values()), atol=1e-15)
        assert linkage.inputs_for(('pitch', 'roll'), (1.0, 0.05)) == []


def test_accelerations_are_those_of_the_motion(g1):
    step, at, speed, change = 1e-4, (0.1, -0.05), (1.0, 2.0), (3.0, -1.0)
    inputs = [[x + v * t + 0.5 * a * t * t for x, v, a in zip(at, speed, change)]
              for t in (-step, 0.0, step)]
    for values, results in (
            ([pose(g1, each) for each in inputs],
             list(g1.joint_accelerations(at, speed, change, ['pitch', 'roll']).values())),
            ([g1.solve(each, ('R_roll',))['R_roll'] for each in inputs],
             g1.acceleration(at, speed, change, ('R_roll',))['R_roll'])):
        np.testing.assert_allclose(
            results, (values[0] - 2.0 * values[1] + values[2]) / step ** 2, rtol=1e-5, atol=1e-6)


def test_the_reach_of_one_rod_ends_where_it_is_stretched():
    # A crank of 1 under a hinge of 1, both about z, a rod between them that is a little too short.
    linkage = made(('out hinge ground at 3 0 0 axis 0 0 1',
                    'crank motor ground at 0 0 0 axis 0 0 1',
                    'R rod crank 1 0 0 out 3 1 0 length 2.5'))
    (low, high), = linkage.reach()
    # Then hinge and crank pin are 3.5 apart.
    stretched = math.acos((1 + 9 - 3.5 ** 2) / 6)
    assert np.allclose((low, high), (-stretched, stretched), atol=1e-15)
    assert not math.isnan(linkage.joint_angles(low, ['out'])['out'])
    assert math.isnan(linkage.joint_angles(low - 1e-6, ['out'])['out'])
    assert np.allclose(linkage.dead_points(), (low, high))


@pytest.mark.parametrize('lines, problem', [
    ((*G1, 'S rod pitch 0.1 0 0 left 0.1 0 0.2'), 'between its ends are placed already'),
    (G1[:5], 'roll, pitch between its ends are unplaced: one rod places one hinge or slide'),
    (G1[:4], 'no rod places (pitch|roll)'),
    # A platform on more rods.
    (('x hinge ground at 0 0 0 axis 1 0 0', 'y hinge x at 0 0 0 axis 0 1 0',
      'z hinge y at 0 0 0 axis 0 0 1', *(f'C{i} cylinder ground {i} {i} -1 z {i} {-i} 0'
                                         for i in range(3))),
     'z, y, x between its ends are unplaced, as for C1, C2: one rod places one hinge or slide'),
    (('a hinge ground at 0 0 0 axis 0 0 0', *G1[2:5]), 'link roll is not placed before'),
    ((G1[0].replace('0 1 0', '0 0 0'), *G1[1:]), 'its axis has no direction'),
    ((G1[0].replace('-50deg', '50deg'), *G1[1:]), 'the first end of within must be less than'),
    ((G1[0].replace('-50deg', '-190deg'), *G1[1:]), 'inside -180deg and 180deg'),
    ((G1[0], G1[1].replace('1 0 0 within', '1e-5 1 0 within'), *G1[2:]), 'nearly parallel'),
    ((G1[1], G1[0], *G1[2:]), 'link pitch is placed later, in line 2: move it up'),
    ((*G1, G1[5]), 'link L is placed already'),
    ((*G1[:4], 'toe motor roll at 0 0 -0.02 axis 0 1 0', G1[4].replace('roll', 'toe'),
      G1[5].replace('roll', 'toe')), 'toe moves between roll and its end'),
    ((*G1[:5], 'L rod left 0 0 0 left 1 0 0'), 'the links that it is placed from must differ'),
    ((*G1[:5], 'L rod leg 0 0 0 roll 1 0 0'), 'link leg is not placed before; there are: gr'),
    ((*G1[:5], G1[5] + ' length -1'), 'a bar must be longer than zero'),
    ((*G1[:5], 'L rod left 0 0 roll 1 0 0'), 'expected "NAME rod LINK X Y Z LINK X Y Z'),
    ((*G1[:5], 'L bar left 0 0 0 roll 1 0 0'), 'expected NAME and one of the constructions hinge'),
    (('a hinge ground at 0 0 0 axis 0 0 1', 'm motor ground at 2 0 0 axis 0 0 1',
      'R rod m 3 0 0 a 1 0 0'), 'as drawn it is at a dead point of a'),
    (('a hinge ground at 0 0 0 axis 0 0 1', 'R rod ground 3 0 0 a 1 1 0'), 'line that drives it')])
def test_what_cannot_be_solved_is_refused_in_words(lines, problem):
    with pytest.raises(ValueError, match=problem):
        made(lines)


def test_lines_of_any_text_are_read_or_refused_in_a_line():
    rng = random.Random(1)
    words = [*FORMS, 'at', 'axis', 'within', 'length', 'ground', 'pitch', 'roll', 'R', '0', '1e70',
             '1e-70', '30deg', '@', *NUMBERS[:60]]
    for _ in range(40):
        lines = [line.split() for line in G1]
        for _ in range(rng.choice((1, 1, 2))):
            line = rng.choice(lines)
            place = rng.randrange(len(line))
            line[place:place + rng.randrange(2)] = [rng.choice(words)] * rng.randrange(2)
            if rng.random() < 0.1:
                rng.shuffle(lines)
        try:
            made(list(map(' '.join, lines)))
        except ValueError as error:
            assert len(str(error)) <= 240


def test_a_rod_on_a_slide_and_a_hinge_on_a_moving_link_are_solved():
    linkage = made((
        'crank motor ground at 0 0 0 axis 0 0 1', 'block slide ground at 2 0 0 axis 1 0.1 0.2',
        'R rod crank 0.5 0 0 block 2 0 0.1', 'arm hinge block at 2 0 1 axis 0 1 0',
        'S rod crank 0.3 0.1 0 arm 2.5 0 1', 'tip fixed arm'))
    theta = np.linspace(-0.3, 0.3, 50)
    place = linkage.solve(theta)
    for ends in ('R_crank', 'R_block'), ('S_crank', 'S_arm'):
        length = np.linalg.norm(place[ends[0]] - place[ends[1]], axis=-1)
        np.testing.assert_allclose(length, linkage.bar_lengths[ends], atol=2e-15)
    rate = linkage.joint_rates(theta, ['block', 'arm'])
    later, before = (linkage.joint_angles(theta + step, ['block', 'arm'])
                     for step in (1e-6, -1e-6))
    for name in rate:
        np.testing.assert_allclose(rate[name], (later[name] - before[name]) / 2e-6, atol=1e-8)


def test_a_cylinder_turns_a_lever():
    lever = made(('lever hinge ground at 0 0 0 axis 0 1 0',
                  'C cylinder ground -1 0.2 0.1 lever 0 0 1 within 1.1 1.6'))
    assert (lever.inputs[0].low, lever.inputs[0].high) == (1.1, 1.6)
    length = np.linspace(1.1, 1.6, 40)
    place = lever.solve(length)
    np.testing.assert_allclose(
        np.linalg.norm(place['C_ground'] - place['C_lever'], axis=-1), length, atol=1e-15)
    back = lever.driven_by('lever').joint_angles(
        lever.joint_angles(length, ['lever'])['lever'], ['C'])['C']
    np.testing.assert_allclose(back, length, atol=1e-15)


def test_a_cylinder_is_as_long_as_drawn_however_near_to_the_origin_its_first_end_is():
    lever = made(('lever hinge ground at 1 0 0 axis 0 1 0',
                  'C cylinder ground 0 0 0 lever -1 0 1'))
    ends = math.sqrt(5.0) - 1.0, math.sqrt(5.0) + 1.0
    np.testing.assert_allclose(lever.reach(), [ends], rtol=1e-12)
    assert lever.input_for('lever', 0.0)[0] == pytest.approx(math.sqrt(2.0))


@pytest.mark.parametrize('joint', ['hinge', 'slide'])
def test_there_is_no_pose_beyond_the_limits_of_lengths_whatever_drives(joint):
    def ends(of, name):
        return np.isnan(of.joint_angles([-1.2, -1.05, 1.05, 1.2])[name]).tolist()

    line = f'x {joint} ground at 0 0 0 axis 0 1 0'
    free, bound = (made((line, f'C cylinder ground -0.5 0.2 0.1 x 0 0.3 1{limits}'))
                   for limits in ('', ' within 1 1.1'))
    assert ends(free, 'x') == [True, True, False, False]
    assert ends(bound, 'x') == [True, True, False, True]
    values = free.joint_angles([1.05, 1.2])['x']
    assert np.isnan(bound.driven_by('x').joint_angles(values)['C']).tolist() == [False, True]
    low, high = sorted(values)
    line += f' within {low - 0.01} {0.5 * (low + high)}'
    back = made((line, 'C cylinder ground -0.5 0.2 0.1 x 0 0.3 1')).driven_by('x')
    assert np.isnan(back.joint_angles([low, high])['C']).tolist() == [False, True]


def test_limits_of_hinges_are_ends_of_the_reach_once_among_dead_points(g1):
    reach, = g1.reach(0.1)
    assert g1.dead_points(0.1) == [*reach]


def test_dimensions_may_be_names_and_are_checked_again():
    lines = [line.replace('0.2112', 'high') for line in G1]
    linkage = made(lines, high=0.2112)
    assert linkage.dimensions == {'high': 0.2112}
    with pytest.raises(ValueError, match='a second pose|singular'):
        linkage.with_dimensions(high=0.02)
    with pytest.raises(ValueError, match='one set of dimensions, not arrays'):
        linkage.with_dimensions(high=[0.2112, 0.2113])


def test_a_linkage_a_million_times_the_size_has_the_same_angles(g1):
    def larger(match):
        return str(float(match[0]) * 2.0 ** 40)

    lines = [re.sub(r'-?\d\.\d+', larger, line) for line in G1]
    np.testing.assert_array_equal(pose(made(lines), (0.1, 0.2)), pose(g1, (0.1, 0.2)))


def test_the_pose_in_c_has_no_loop_and_no_heap():
    text = header.written(alone('rods', 'ankle', joints=G1))
    pose_ = text[text.index('#endif /* LINKAGE'):text.index('ankle_solutions')]
    assert 'ankle_solve' in pose_ and not re.search(
        r'\b(for|while|do|goto|malloc)\b(?! it)', re.sub(r'/\*.*?\*/', '', pose_, flags=re.S))
