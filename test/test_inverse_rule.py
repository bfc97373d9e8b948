# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The rule of the inverse: no solution is lost, invented or doubled; poses alone judge."""

import math

from linkage_ros import mechanisms
import numpy as np
import pytest
from truth import inverse_judge, linkage_checks


def counts(found, *kinds):
    """Return what is wrong at some kinds of values."""
    return {key: number for key, number in found.items()
            if key[1] not in ('questions', 'duplicates') and key[0] in kinds}


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('kind', [kind for kind in mechanisms.TYPES if kind != 'five_bar'])
def test_of_the_catalogue_nothing_is_lost_or_invented(kind):
    linkage, rng = mechanisms.create(kind), np.random.default_rng(5)
    names = [name for name in (*linkage.joints, *(
        f'{point}.{axis}' for point in linkage.points for axis in 'xy'))
        if linkage.moves(name) and name != linkage.inputs[0].name]
    for name in (*names[:2], *map(str, rng.choice(names, 2))):
        found, worst = inverse_judge.judge(linkage, name, rng)
        assert found and not counts(found, *inverse_judge.KINDS), (name, found)
        assert worst <= inverse_judge.MOST


@pytest.mark.parametrize('seeds', [
    range(2, 8), pytest.param(range(8, 60), marks=pytest.mark.nightly)])
def test_of_random_linkages_no_ordinary_solution_is_lost_or_invented(seeds):
    asked = 0
    for seed, linkage, rng in linkage_checks.assembled(seeds):
        names = [name for name in linkage.joints if linkage.moves(name)
                 and name not in [input_.name for input_ in linkage.inputs]]
        if not names:
            continue
        others = tuple(float(rng.uniform(x.low, x.high)) for x in linkage.inputs[1:])
        found, _ = inverse_judge.judge(linkage, str(rng.choice(names)), rng, 6, others)
        assert not counts(found, 'ordinary'), (seed, found)
        asked += found['ordinary', 'questions']
    assert asked > len(seeds)


@pytest.mark.nightly(all_but=1)
@pytest.mark.parametrize('outputs', [('P.x', 'P.y'), ('P.x', 'crank'), ('crank2', 'P.y')])
def test_of_two_inputs_no_ordinary_solution_is_lost_or_invented(outputs):
    found, _ = inverse_judge.judge_several(
        mechanisms.create('five_bar'), outputs, np.random.default_rng(1), 60)
    assert found['ordinary', 'questions'] > 15 and not counts(found, 'ordinary')


def test_two_extremes_closer_than_a_sample_hide_nothing():
    linkage = mechanisms.create('custom', joints=[
        'A ground 0 0', 'B ground -1.622359 2.712', 'C cylinder A B 2.895026 left',
        'D block C 0.878408 0.781386'])
    for at in np.linspace(0.3574, 0.3701, 50).tolist():
        value = float(linkage.solve(at)['D'][0])
        found = linkage.input_for('D.x', value)
        assert np.nanmin(np.abs(found - at)) < 1e-6, at
        assert len(found) == 3 or min(at - 0.3574, 0.3701 - at) < 2e-4


def test_a_value_at_a_special_input_is_answered_by_that_input_once():
    drop = mechanisms.create('water_drop')
    assert [answer.inputs for answer in drop.inputs_for(('B.y',), [0.0])] == [(-math.pi,), (0.0,)]
    cell = mechanisms.create('peaucellier')
    for low, high in cell.reach():
        for end in (low, high):
            for output in ('B.y', 'DC', 'C.y'):
                value = cell.joint_angles(end, (output,))[output] if output == 'DC' else \
                    cell.solve(end)[output[0]][1]
                found = cell.input_for(output, float(value))
                assert np.nanmin(np.abs(found - end)) < 1e-12, (output, end)


@pytest.mark.parametrize('away, answers', [(-1e-3, 2), (-1e-9, 2), (-1e-14, 1), (1e-10, 1),
                                           (1e-8, 0), (1e-3, 0)])
def test_next_to_an_extreme_values_have_two_solutions_or_its_own_or_none(away, answers):
    crank = mechanisms.create('slider_crank', a=40.0, b=120.0, c=0.0)
    found = crank.inverse('block').all(160.0 + away * crank.longest)
    assert len(found) == answers
    if answers == 1:
        assert found[0].inputs == (0.0,)


def test_a_distance_at_an_end_of_the_reach_is_answered():
    for seed in range(12):
        rng = np.random.default_rng(seed)
        bars = rng.uniform(0.5, 2.0, 4)
        linkage = mechanisms.create('custom', joints=[
            'O ground 0 0', f'Q ground {bars[0]} 0', f'A crank O {bars[1]}',
            f'B dyad A Q {bars[2]} {bars[3]} left'])
        for end in (end for arc in linkage.reach() for end in arc):
            value = float(linkage.joint_angles(end, ('distance(O,B)',))['distance(O,B)'])
            found = linkage.input_for('distance(O,B)', value)
            assert np.nanmin(linkage.inputs[0].apart(found, end)) < 1e-6, (seed, end)


def test_the_jacobian_has_a_row_for_each_output():
    arm, pose, step = mechanisms.create('five_bar'), (1.9, 1.24), 1e-6
    answer, = [each for each in arm.inputs_for(('P.x', 'P.y'), arm.solve(pose)['P'])
               if math.dist(each.inputs, pose) < 1e-9]
    slopes = [np.subtract(*(arm.solve(np.add(pose, side * step * e))['P'] for side in (1, -1)))
              / (2.0 * step) for e in np.eye(2)]
    np.testing.assert_allclose(answer.jacobian, np.transpose(slopes), rtol=1e-6)
