# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The rule of the inverse: no solution is lost, invented or doubled; poses alone judge."""

import math

from linkage_ros import mechanisms
import numpy as np
import pytest
from scenes import custom
from truth import inverse_judge, linkage_checks

FOUR_BAR = 'P.x', 'P.y', 'B.x', 'B.y', 'QB', 'AB'
EVERYWHERE = np.linspace(-3.1, 3.1, 24)
TIGHT = math.atan2(-0.8, 0.6)
# Linkages for which a solution was lost or invented, by what is special: their type or joint
# lines, numbers, outputs and inputs.
SPECIAL = {
    'a change point': ('four_bar', {'a': 1.0, 'b': 2.0, 'c': 3.0, 'd': 4.0, 'p': 1.0},
                       FOUR_BAR, EVERYWHERE),
    'one more': ('four_bar', {'a': 1.0, 'b': 4.0, 'c': 2.0, 'd': 3.0}, FOUR_BAR, EVERYWHERE),
    'another one': ('four_bar', {'a': 3.0, 'b': 1.0, 'c': 2.0, 'd': 4.0}, FOUR_BAR, EVERYWHERE),
    'equal bars': ('four_bar', {'a': 2.0, 'b': 2.0, 'c': 2.0, 'd': 2.0}, FOUR_BAR, EVERYWHERE),
    'a double crank': ('four_bar', {'a': 5.0, 'b': 7.0, 'c': 6.0, 'd': 2.0, 'p': 1.0},
                       ['QB', 'AB'], EVERYWHERE),
    'a pin that passes the pivot': ('whitworth', {'a': 100.0, 'b': 100.0, 'c': 60.0, 'd': 400.0},
                                    ['LR', 'R.x', 'L.x', 'lever', 'slide', 'block'], EVERYWHERE),
    'half a turn of the lever in 1e-6 of the crank': (
        ['O ground 0 0', 'Q ground 0.6 -0.8', 'A crank O 1.000001', 'L slot Q A 0 out 1',
         'T rigid Q L 1 1 left'], {}, ['T.y'], TIGHT + np.array([-3e-6, -5e-7, 4e-7, 2e-6])),
    'two extremes closer than samples': (
        ['A ground 0 0', 'B ground -1.622359 2.712', 'C cylinder A B 2.895026 left',
         'D block C 0.878408 0.781386'], {}, ['D.x'], np.linspace(0.3574, 0.3701, 50)),
    'an angle that jumps': (
        ['O ground 0 0', 'Q ground 2 0', 'A crank O 1', 'L slot Q A 0 out 2.2'], {},
        ['angle(A,L)'], EVERYWHERE),
    'joints that meet': (
        ['O ground -0.2 -0.22', 'Q ground 2.03 -0.4', 'A crank O 0.05', 'B dyad A Q 1 1.65 left',
         'S slider O 1 A along B out'], {}, ['angle(S,B)'], EVERYWHERE),
    'a line without a direction': (
        ['A ground 0 0', 'B ground -2.1604150371152997 -1.8587897168211125',
         'C ground 0 0.378002153336404', 'D crank A 0.29639043443440444',
         'E antiparallelogram A D C', 'F image C A B', 'G mirror C A E', 'H mirror A F G',
         'J yoke D H along G'], {}, ['J.x'], EVERYWHERE),
    'a period of two turns': (
        ['O ground 0 0', 'Q ground 4 0', 'A crank O 1', 'D crank Q 2 geared crank 1/2 0',
         'B dyad A D 2.2 2 left'], {}, ['B.x', 'crank2', 'AB'], np.linspace(4.31, 8.26, 40)),
    'an arm of rounding next to a dead point': (
        ['A ground 0 0', 'B ground 1.834745 0', 'E ground 0 -1.834745',
         'C crank A 1.834745000000002', 'D mirror A C B', 'G parallelogram B A D',
         'H image B A E', 'M line G A 2*1.834745', 'P mirror A M H'],
        {}, ['MP'], np.array([-1.2, -0.4, -0.05, 0.3])),
    'the last floats of a reach': (
        ['A ground 0.829145187382171 -2.2156474128625305',
         'B ground -2.2125892959295577 0.6633161499057368', 'C crank A 0.436499480176793',
         'D mirror A C B', 'E Eb Ec inversor D A 0.7495014557578443 0.7495014557578443*1.8'], {},
        ['Ec.x'], np.array([-1.5866750307266744])),
    'a reach of a few narrow arcs in many turns': (
        ['A ground 0 -0.69', 'B ground -0.206 -0.233', 'C crank B 1.964',
         'D dyad C B 1.067 1.992 left',
         'E crank A 0.65 geared crank -1.4142135623730951 0 called drive',
         'F Fb Fc inversor B E 1.518 0.433', 'G mirror D C B', 'H dyad C F 2.147 0.208 right'],
        {}, ['Fb.y', 'F.x'], np.array([-8.47, -8.43])),
    'a gear without a place where the input is zero': (
        ['A ground 0 0', 'B ground 0.4 0', 'C cylinder A B 0.3 left',
         'D carriage B along A -0.7 -0.2 geared cylinder -1.5 0.2 called drive',
         'E dyad D A 0.6 0.5 left'], {}, ['AE'], np.linspace(0.28, 0.58, 7))}


@pytest.mark.parametrize('special', SPECIAL)
def test_special_linkages_have_each_pose_and_no_other(special):
    lines, numbers, outputs, inputs = SPECIAL[special]
    linkage = mechanisms.create(lines, **numbers) if isinstance(lines, str) else custom(*lines)
    first, = linkage.inputs
    for output in outputs:
        pose, size = linkage.compiled('checked', (output,)), (
            1.0 if linkage.is_angle(output) else linkage.longest)
        values, rates = pose.over(inputs)
        # An output that stands still tells no input.
        tells = ~(np.abs(rates) < 1e-6 * size)
        # So many values are solved as arrays.
        for at, value, tell, row in zip(inputs, values.tolist(), tells, linkage.input_for(
                output, values)):
            alone = linkage.input_for(output, value)
            np.testing.assert_allclose(row[:len(alone)], alone, atol=1e-6)
            assert np.isnan(row[len(alone):]).all()
            errors = pose.over(alone)[0] - value
            errors = np.sin(errors) if linkage.is_angle(output) else errors
            assert (np.abs(errors) <= 1e-9 * size)[np.isfinite(alone)].all(), (output, at, alone)
            if tell and value == value:
                assert np.nanmin(first.distance(alone, at)) < 1e-6, (output, at, alone)
                assert linkage.input_for(output, value, at) == pytest.approx(at, abs=1e-6)


def counts(counter, *kinds):
    """Return what is wrong at some kinds of values."""
    return {key: number for key, number in counter.items()
            if key[1] not in ('questions', 'duplicates') and key[0] in kinds}


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('kind', [kind for kind in mechanisms.TYPES if kind != 'five_bar'])
def test_of_the_catalogue_nothing_is_lost_or_invented(kind):
    linkage, rng = mechanisms.create(kind), np.random.default_rng(5)
    names = linkage_checks.moved(linkage)
    for name in (*names[:2], *map(str, rng.choice(names, 2))):
        counter, worst = inverse_judge.judge(linkage, name, rng)
        assert counter and not counts(counter, *inverse_judge.KINDS), (name, counter)
        assert worst <= inverse_judge.MOST


@pytest.mark.nightly(all_but=1)
@pytest.mark.parametrize('outputs', [
    ('P.x', 'P.y'), ('P.x', 'crank'), ('crank2', 'P.y'), ('angle(P,Q)', 'crank')])
def test_of_two_inputs_no_ordinary_solution_is_lost_or_invented(outputs):
    counter, _ = inverse_judge.judge_several(
        mechanisms.create('five_bar'), outputs, np.random.default_rng(1), 60)
    assert counter['ordinary', 'questions'] > 15 and not counts(counter, 'ordinary')


def test_with_the_other_inputs_held_a_search_loses_nothing_next_to_an_extreme():
    (_, linkage, rng), = linkage_checks.assembled([7])
    assert not linkage.inverse(('K.x', 'drive', 'crank')).closed
    counter, _ = inverse_judge.judge(linkage, 'K.x', rng, others=(2.7, -2.8))
    assert counter['next to ends', 'questions'] and not counts(counter, 'ordinary', 'next to ends')


def test_another_assembly_mode_leads_to_no_solution():
    linkage = custom('A ground 0 0', 'B ground -2.19 0', 'C crank A 2.189999999999781',
                     'D dyad C B 2.19 2.189999999999781 right', 'E cylinder A D 2.19 right')
    for theta in np.linspace(2.8, 3.1, 20).tolist():
        value = float(linkage.joint_angles((theta, 3.0), ['D.x'])['D.x'])
        cranks = [solution.inputs[0] for solution in linkage.inverse(
            ('D.x', 'cylinder')).all((value, 3.0))]
        assert cranks == pytest.approx([-theta, theta], abs=1e-12)


def test_rates_where_a_pose_has_none_are_those_of_the_nearest_float_that_has_them():
    linkage = custom('A ground 0 0', 'B ground 2.1 -0.0714483557885009',
                     'C crank A 1.100977588441', 'D slider C 2.3782075834 A along B out',
                     'E dyad D A 1.5 0.5971384475097938 right',
                     'G slider D 0.4768848 C along A in')
    start, _ = linkage.reach()[0]
    (theta,), (rate,) = linkage.inverse('DG').nearest(
        (float(linkage.joint_angles(start, ['DG'])['DG']),), (start,))
    inside = theta + math.ulp(theta) * np.arange(9)
    rates = linkage.joint_rates(inside, ['DG'])['DG']
    assert not math.isfinite(rates[0]) and theta == pytest.approx(start, abs=1e-14)
    assert rate == pytest.approx(rates[np.isfinite(rates)][0])


def test_an_extreme_as_the_library_says_it_has_an_answer():
    leg = mechanisms.create('jansen')
    for output in ('distance(O,G)', 'G.x', 'G.y', 'BC'):
        for value, at in (extreme for arc in leg.extremes(output) for extreme in arc):
            assert np.nanmin(abs(leg.input_for(output, value) - at), initial=9.0) < 1e-6


@pytest.mark.parametrize('ratio', ['1/2', '1/3', '3/4'])
def test_the_end_of_a_long_period_has_a_pose_a_period_away_too(ratio):
    linkage = custom('O ground 0 0', 'Q ground 4 0', 'A crank O 1',
                     f'D crank Q 2 geared crank {ratio} 0', 'B dyad A D 2.2 2 left')
    pose, (first,) = linkage.compiled('checked', ('B.x',)), linkage.inputs
    for end in (end for arc in linkage.reach() for end in arc):
        for answer in linkage.input_for('B.x', pose.at(end)[0]).tolist():
            assert all(math.isfinite(pose.at(answer + turn)[0]) for turn in (
                -first.turn, first.turn)), (end, answer)


@pytest.mark.parametrize('distance, answers', [(-1e-3, 2), (-1e-9, 2), (-1e-14, 1), (1e-10, 1),
                                               (1e-8, 0), (1e-3, 0)])
def test_next_to_an_extreme_values_have_two_solutions_or_its_own_or_none(distance, answers):
    engine = mechanisms.create('slider_crank', a=40.0, b=120.0, c=0.0)
    crank = custom('O ground -1 0', 'A crank O 1')
    for linkage, output, extreme in (engine, 'block', 160.0), (crank, 'A.x', 0.0):
        solutions = linkage.inverse(output).all(extreme + distance * linkage.longest)
        assert len(solutions) == answers
        assert answers != 1 or solutions[0].inputs == (0.0,)


def test_the_jacobian_has_a_row_for_each_output():
    arm, pose, step = mechanisms.create('five_bar'), (1.9, 1.24), 1e-6
    answer, = [each for each in arm.inputs_for(('P.x', 'P.y'), arm.solve(pose)['P'])
               if math.dist(each.inputs, pose) < 1e-9]
    slopes = [np.subtract(*(arm.solve(np.add(pose, side * step * e))['P'] for side in (1, -1)))
              / (2.0 * step) for e in np.eye(2)]
    np.testing.assert_allclose(answer.jacobian, np.transpose(slopes), rtol=1e-6)


@pytest.mark.parametrize('output, held, at, lines', [
    # The extreme is 1e-9 rad away, and the closed form leads there.
    ('M.x', 0.25, 1.5708057357023772, [
        'A ground 0 0', 'E ground 0 1.3553388288843333', 'F crank A 0.7488443055072416',
        'G dyad E F 0.8982826140105455 1.5047771372371597 right',
        'H crank F 1.6646414933875167 zero A called drive', 'M line G E -0.8779779844163468']),
    # The output moves so little with the crank that its rounding leads 100 ulps out of the reach.
    ('G.x', 0.6125269407665871, None, [
        'B ground 0 0.45', 'C ground -0.03624 2.66982656119', 'D ground -1.64594 -0.4492922',
        'E crank C 0.8 up', 'F cylinder B D 1.267 right called drive', 'G yoke E C along B',
        'K dyad E G 2.23494351 2.306645367473 left'])])
def test_next_to_an_extreme_and_at_an_end_a_pose_is_found_with_another_input_held_too(
        output, held, at, lines):
    linkage = custom(*lines)
    for theta in [at] if at else np.ravel(linkage.reach(held)).tolist():
        value = float(linkage.joint_angles((theta, held), [output])[output])
        solutions = linkage.inverse((output, 'drive')).all((value, held))
        distance = min((abs(each.inputs[0] - theta) for each in solutions), default=1.0)
        assert distance < (1e-10 if at else 1e-12)
