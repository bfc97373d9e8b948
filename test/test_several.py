# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Several outputs are wanted of several inputs: all answers, and nothing else, by circles."""

import math

from effort import few_calls
from linkage_ros import mechanisms
from linkage_ros.linkage import Solution
from linkage_ros.scene.inverse_request import InverseRequest
import numpy as np
import pytest
from scenes import alone, custom
from truth.cases import CASES
from truth.working_modes import arm, excavator

BUCKET = 'H.x', 'H.y', 'angle(H,J)'


def agree(linkage, outputs, values, expected, sure=1e-3):
    """Check that the answers are those expected; return the greatest difference [sizes]."""
    solutions, expected, worst = linkage.inputs_for(outputs, values), list(expected), 0.0
    assert len(solutions) == len(expected), (linkage, values, solutions, expected)
    for inputs, bends in expected:
        distance, answer = min((max(input_.distance(x, y) / input_.size for input_, x, y in zip(
            linkage.inputs, answer.inputs, inputs)), answer) for answer in solutions)
        assert distance * answer.margin < 1e-12, (linkage, values, inputs, answer)
        assert answer.margin < sure or bends.items() <= answer.signs.items()
        worst = max(worst, distance)
    return worst


@pytest.mark.parametrize('name, outputs, truth', [
    pytest.param('excavator', BUCKET, excavator, marks=pytest.mark.nightly),
    ('parallelogram arm', ('W.x', 'W.y'), arm)])
def test_an_arm_has_both_elbows(name, outputs, truth):
    rng, linkage, numbers = np.random.default_rng(3), CASES[name].linkage(), CASES[name].dimensions
    for _ in range(5):
        pose = [rng.uniform(input_.low, input_.high) for input_ in linkage.inputs]
        values = list(map(float, linkage.joint_angles(pose, outputs).values()))
        if np.isfinite(values).all():
            agree(linkage, outputs, values, truth(numbers, complex(*values[:2]), *values[2:]))


def test_whole_turns_are_kept_and_a_singular_pose_is_not_passed():
    linkage = mechanisms.create('five_bar', a=1.0, b=1.0, c=1.0, d=1.0, f=1.2)
    outputs, near = ('P.x', 'P.y'), np.array([1.7 + 4.0 * math.pi, 1.4 - 2.0 * math.pi])
    foot = linkage.solve(near, ('P',))['P']
    for angle in np.linspace(0.0, 4.0 * math.pi, 33):
        inputs, _ = linkage.inverse(outputs).follow(foot + 0.1 * np.array(
            [math.cos(angle) - 1.0, math.sin(angle)]), near)
        assert np.abs(inputs - near).max() < 0.3
    nearest = linkage.inputs_for(outputs, foot, near)[0].inputs
    np.testing.assert_allclose(nearest, near, atol=1e-12)
    # Stretched legs: on the rim of what the foot can reach, and beyond.
    rim = math.sqrt(4.0 - 0.36)
    answer, = linkage.inputs_for(outputs, (0.6, rim))
    assert answer.is_singular and set(answer.signs.values()) == {0}
    # Where rounding of the foot is all that is between them, they are one.
    assert [len(linkage.inputs_for(outputs, (0.6, rim - below))) for below in (3e-15, 1e-9)] == [
        1, 4]
    inputs, rates = linkage.inverse(outputs).follow((0.6, rim - 1e-9), near)
    assert np.isfinite(inputs).all()
    for beyond in (rim + 1e-9, 5.0, math.inf, math.nan):
        assert np.isnan(linkage.inverse(outputs).follow((0.6, beyond), inputs)[0]).all()
        assert linkage.inputs_for(outputs, (0.6, beyond)) == []
    back, _ = linkage.inverse(outputs).follow(foot, inputs)
    np.testing.assert_allclose(back, near, atol=1e-9)


def test_a_mode_is_followed_where_that_beyond_the_fold_is_nearer():
    linkage = mechanisms.create('five_bar', a=0.7705062351115836, b=1.5616011513598087,
                                c=0.7534721238980263, d=1.4852815970909945, f=1.514771842943107)
    inverse, near = linkage.inverse(('P.x', 'P.y')), (-0.7667284128232743, -0.7015517149803334)
    values = 2.040979962430155, -0.5094493998914134
    nearer, expected = inverse.all(values, near)[:2]
    assert (nearer.mode, expected.mode) == ('AP+ CP- det-', 'AP+ CP+ det+')
    with few_calls(3000):
        inputs, _ = inverse.follow(values, near)
    assert inputs == pytest.approx(expected.inputs, abs=1e-9)


def test_next_to_a_fold_both_searched_solutions_are_found_and_at_it_one():
    numbers = {'a': 1.218914599520411, 'b': 1.9207419141214968, 'c': 0.630655380351414,
               'd': 1.9178391154195902, 'f': 0.8989303232167768}
    linkage = mechanisms.create('five_bar', **numbers)
    inverse, first = linkage.inverse(('P.y', 'angle(O,P)')), -0.5884821153872412
    for second in (-1.7514567660906157, -1.7716184764128091):
        values = [*map(float, linkage.joint_angles((first, second), inverse.outputs).values())]
        assert min(math.dist(answer.inputs, (first, second)) for answer in inverse.all(
            values)) < 1e-9
    assert {type(x) for answer in inverse.all(values) for x in answer.inputs} == {float}
    # Where the height is greatest, at a given direction.
    low, high = -1.7716184764128091, -1.7514567660906157
    for _ in range(60):
        middle = 0.5 * (low + high)
        rates = Solution((first, middle), inverse).jacobian
        low, high = (middle, high) if np.linalg.det(rates) * np.linalg.det(
            Solution((first, low), inverse).jacobian) > 0.0 else (low, middle)
    values = [*map(float, linkage.joint_angles((first, low), inverse.outputs).values())]
    assert sum(math.dist(answer.inputs, (first, low)) < 1e-5
               for answer in inverse.all(values)) == 1


@pytest.mark.nightly(all_but=1)
@pytest.mark.parametrize('seed', [0, *(
    pytest.param(seed, marks=pytest.mark.nightly) for seed in range(1, 40))])
@pytest.mark.parametrize('hung', ['zero O geared', 'zero Q geared', 'beside'])
def test_an_input_that_is_held_is_held_in_its_own_turn(hung, seed):
    # A second crank is geared to the one that is held: a turn later it is elsewhere.
    rng = np.random.default_rng(seed)
    long, short = rng.uniform(1.6, 2.0, 4).round(3), rng.uniform(0.4, 0.8, 4).round(3)
    ratio = rng.choice(['1/2', '1/3', '3/2', '-1/2', '0.4', '5/61', '2', '0.3183', '65/64'])
    where = {'zero Q geared': 'F'}.get(hung, 'Q')
    linkage = mechanisms.create('custom', joints=(
        'O ground 0 0', 'Q ground 0.7 0', f'E crank O {short[0]}',
        f'F crank Q {short[1]} called drive',
        f'G crank {where} {short[2]} {hung.replace("beside", "geared")} drive {ratio} 0.3',
        *((f'M dyad E F {long[0]} {long[1]} left', f'N dyad G Q {short[3]} {short[2]} left')
          if hung == 'beside' else (f'M dyad E G {long[0]} {long[1]} left',))))
    poses = rng.uniform((-3.0, -25.0), (3.0, 25.0), (100, 2))
    assembled = np.isfinite(np.concatenate([*linkage.solve(poses.T).values()], axis=1)).all(axis=1)
    poses = iter(poses[assembled].tolist())
    for output in ('M.x', 'M.y', 'distance(O,M)', 'angle(E,M)') * 2:
        theta, held = next(poses)
        value = float(linkage.joint_angles((theta, held), (output,))[output])
        answers = linkage.input_for(output, value, others=(held,))
        there = linkage.joint_angles((answers, np.full_like(answers, held)), (output,))[output]
        np.testing.assert_allclose(np.exp(1j * there), np.exp(1j * value), atol=1e-9)
        assert np.abs(np.exp(1j * answers) - np.exp(1j * theta)).min() < 1e-6
        nearest = linkage.input_for(output, value, theta, (held,))
        assert nearest == pytest.approx(theta, abs=1e-6)


@pytest.mark.parametrize('outputs, values, reason', [
    (('P.x',), [0.1], '2 inputs: as many outputs are needed, got P.x'),
    (('P.x', 'P.z'), [0.1, 0.1], "no output 'P.z'; allowed: "),
    ('P.x', [0.1, 0.1], '2 inputs: as many outputs are needed, got P.x'),
    ('P', [0.1, 0.1], "no output 'P'; allowed: .* did you mean P.x, P.y?"),
    (None, [0.1, 0.1], 'outputs must be a list of names, got None'),
    (('P.x', 7), [0.1, 0.1], 'five_bar has no output 7; allowed: '),
    (({}, 'P.x'), [0.1, 0.1], 'five_bar has no output {}; allowed: '),
    (('P.x', 'P.x'), [0.1, 0.1], 'outputs must differ, got P.x, P.x'),
    (('A.x', 'crank'), [0.1, 0.1], 'inputs: too few of them move A.x, crank'),
    (('P.x', 'O.x'), [0.1, 0.1], 'P.x, O.x do not determine all inputs: too few of them move O.')])
def test_what_cannot_be_asked_is_refused_with_the_reason(outputs, values, reason):
    linkage = mechanisms.create('five_bar')
    for call in (linkage.inputs_for, lambda names, given: linkage.inverse(
            names).follow(given, (1.9, 1.2))):
        with pytest.raises(ValueError, match=reason):
            call(outputs, values)


def test_a_place_to_start_from_may_be_anything():
    linkage = mechanisms.create('five_bar')
    for near in ((math.nan, 0.0), (math.inf, 0.0), (1e300, 0.0), (2.6, 0.3)):
        inputs, rates = linkage.inverse(('P.x', 'P.y')).follow((0.059, 0.16), near)
        assert np.isnan(inputs).all() and np.isnan(rates).all()
    # Whose square is no float any more.
    assert linkage.inputs_for(('P.x', 'P.y'), (0.059, 0.16), (0.0, 1e200))
    with pytest.raises(ValueError, match='near must be finite'):
        linkage.inputs_for(('P.x', 'P.y'), (0.059, 0.16), (math.inf, 0.0))


def test_answers_lie_in_the_sweeps_or_the_reason_says_so():
    request = InverseRequest(alone('five_bar', crank__sweep=[6.0, 9.0]), ('P.x', 'P.y'))
    answers = request.answers((0.05, 0.15), (0.0, 0.0))
    assert answers and all(6.0 <= inputs[0] <= 9.0 for inputs, _ in answers)
    assert answers[0][0][0] == pytest.approx(min(inputs[0] for inputs, _ in answers))
    nearest, _, _ = request.command((0.05, 0.15), None, (0.0, 0.0), jumps=True)
    assert nearest == pytest.approx(answers[0][0])
    request = InverseRequest(alone('five_bar', crank__sweep=[3.0, 3.5]), ('P.x', 'P.y'))
    assert request.answers((0.05, 0.15), (3.2, 0.0)) == []
    assert request.reason(0.05, 0.15) == (
        'P.x, P.y at 0.05, 0.15 needs the crank at 1.74732 rad, crank2 at 1.58104 rad, outside '
        'crank.sweep [3, 3.5]')
    # The nearest comes first: a length counts in parts of its stroke, 91 m.
    boom = alone(['O ground 0 0', 'Q ground 40 0', 'A crank O 1', 'B cylinder Q A 50 left'])
    values = boom.linkage.function((), ('B.x', 'A.x'))(0.9, 48.0)
    cranks = [x[0] for x, _ in InverseRequest(boom, ('B.x', 'A.x')).answers(values, (-0.3, 48.0))]
    assert cranks == pytest.approx([-0.9, 0.9])


def test_an_output_that_stands_still_in_most_poses_is_answered_where_it_moves():
    # Nearly equal bars: the block stays at the crank's centre in one half of the turn.
    linkage = custom('A ground 0 0', 'B ground 0.432105123617702 0', 'C ground d1 0',
                     'D crank C d2', 'E cylinder B A 2.189315412 left called drive',
                     'F slider D d3 A along B out', 'G dyad A F d4 d4 right', 'H line F G d6',
                     'J K L inversor A F d7 2.0073', d1=2.2362640741019026, d2=0.8931826658923526,
                     d3=0.8931826658923615, d4=2.6947387147872717, d6=5.557896960568358,
                     d7=0.8324685908048884)
    length = 2.403985938284456
    for crank in (1.45, 2.5):
        value = float(linkage.solve((crank, length))['J'][1])
        moves = abs(float(linkage.velocity((crank, length))['J'][1])) > 1e-9
        inputs = linkage.input_for('J.y', value, others=(length,))
        assert moves == (crank == 1.45) == (np.nanmin(abs(inputs - crank), initial=9.0) < 1e-9)


@pytest.mark.parametrize('unit', [1.0, 1e-26, 1e20])
def test_what_is_searched_is_found_in_any_unit(unit):
    linkage = custom('A ground 0 0', 'B ground 0 c', 'E crank B e', 'F cylinder A E f right',
                     c=3.6 * unit, e=0.42 * unit, f=4.0 * unit)
    pose, outputs = (0.04, 1.4 * unit), ('F.x', 'barrel')
    values = [float(linkage.solve(pose)['F'][0]), float(linkage.joint_angles(pose)['barrel'])]
    solutions = linkage.inverse(outputs).all(values)
    assert any(solution.inputs == pytest.approx(pose, rel=1e-9) for solution in solutions)
