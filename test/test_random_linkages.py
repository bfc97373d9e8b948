# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Linkages of every word: right to the last digits, and no exception, lost or false answer.

The linkages come from `random_linkages`, the truth from `drawing`, the rule and the
measure from `drawing_accuracy`, what is asked from `linkage_checks`.
"""

from collections import Counter
import math

from linkage_ros import mechanisms
import numpy as np
import pytest
from truth import drawing_accuracy, hard_cases, linkage_checks as checks, random_linkages
from truth.cases import CASES

LONG, BATCH = 1000, 25
# Joint lines that use every construction where it moves.
MOVING = (
    'O ground 0 0', 'Q ground 3.2 0', 'N ground 3.2 -4', 'A crank O 1', 'B dyad A Q 3 2.5 left',
    'P rigid A B 1.5 2 left', 'M mirror A B P', 'S slider P 3.5 Q 0.3 out', 'L slot N P 0 out 4')
FOUR_BAR = 'O ground 0 0', 'Q ground 4 0', 'A crank O 1', 'B dyad A Q 3.5 3 left'
OTHERS = {
    'one number for both bars': (*FOUR_BAR, 'C dyad B O 3 3 left'),
    'one product for both bars': (*FOUR_BAR, 'C dyad B O 2*1.5 1.5*2 left'),
    'equal bars on two moving joints': (*FOUR_BAR, 'C dyad A B 3 3 left', 'D dyad C B 2 2 right'),
    'equal bars in a five-bar': ('O ground 0 0', 'Q ground 2 0', 'A crank O 1', 'C crank Q 0.8',
                                 'P dyad A C 2 2 left'),
    'a slot through the pivot on a rocker': (*FOUR_BAR, 'R ground 5 4', 'L slot R B 0 out 5'),
    'a slot through the crank centre': (*FOUR_BAR, 'L slot O A 0 out 5'),
    'an inversor of equal bars': (*FOUR_BAR, 'C D E inversor O B 4 4'),
    'an inversor on a rocker': (*FOUR_BAR, 'C D E inversor O B 5 3'),
    'a kite on a coupler': (*FOUR_BAR, 'P rigid A B 2 2 left', 'E dyad P Q 3 4 left',
                            'C mirror B P A'),
    'a rhombus of a kite': ('O ground 0 0', 'C ground -0.3 0', 'A crank O 0.3', 'B mirror O C A',
                            'D rigid B A 0.3 0.3 left'),
    'arms that are bars, far from the origin': (
        'O ground 1e6 1e6', 'Q ground 1000004 1e6', 'A crank O 1', 'B dyad A Q 3.5 3 left',
        'C rigid A B 2 2 left', 'L slot O A 0.6 out 3', 'D dyad A B 3 2 left',
        'E dyad C B 2.5 2 right'),
    'a limit that is only touched at half a turn': (
        'O ground 0 0', 'Q ground 4 0', 'A crank O 1', 'B dyad A Q 4 1 left', 'R ground -2 0',
        'C dyad A R 1.5 0.6 left'),
    'a limit on one side of a change point': (
        'O ground 0 0', 'Q ground 4 0', 'A crank O 1', 'B dyad A Q 2 3 left', 'R ground 4 -4',
        'C dyad B R 3 2.5 left'),
    'a short stroke far from its zero': (
        'G ground 0 0', 'H ground 1 0', 'S carriage G along H 150e-9 153e-9',
        'F ground 151.5e-9 1e-9', 'D dyad F S 1.5e-9 0.2e-9 left'),
    'no pose in the middle of the reach': (
        'A ground 0 0', 'B ground 3 0', 'C crank A 0.3', 'E mirror A C B', 'H mirror B A E',
        'K slider H 7 B 90deg in'),
    'gears on what moves': (
        'O ground 0 0', 'Q ground 3 0', 'A crank O 1', 'C crank Q 1 geared crank -0.5 0.3',
        'B dyad A C 2 2 left', 'D crank B 0.4 zero A geared crank 2 0.1', 'R ground 1 5',
        'E cylinder R B 2 left', 'S ground 8 3', 'T ground 9 5',
        'F carriage S along T 0 4 geared cylinder 0.5 0.2')}
LISTED = {
    **{kind: random_linkages.Design(mechanisms.design(kind).joints, mechanisms.defaults(kind), {})
       for kind in mechanisms.TYPES},
    **{f'{kind} of {lengths}': random_linkages.Design(mechanisms.design(kind).joints, lengths, {})
       for kind, several in hard_cases.CATALOGUE.items() for lengths in several},
    **CASES,
    **{name: random_linkages.Design(lines, {}, {}) for name, lines in OTHERS.items()}}


def problems(seeds, design_of):
    """Return what does not hold for random linkages, with the seed of each."""
    problems_ = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        found_ = checks.problems(random_linkages.design(rng), rng, design_of(seed))
        problems_ += [(seed, *problem) for problem in (found_[0] if found_ else ())]
    return problems_


def report(problems_):
    """Return problems as text: how many of each kind, and one of each."""
    kinds = Counter(kind for _, kind, _ in problems_)
    first = {kind: f'seed {seed}: {text}' for seed, kind, text in reversed(problems_)}
    return '\n'.join(f'{count} x {kind}, {first[kind]}' for kind, count in kinds.most_common())


def a_few(seed):
    """Return poses and, in turn, one of the other checks."""
    others = checks.CHECKS[1:]
    return lambda subject: checks.poses(subject, 1), others[seed % len(others)]


def all_of_them(seed):
    """Return all checks; machine code takes a while to make and is asked for now and then."""
    return (*checks.CHECKS, *((checks.accelerated,) if seed % 10 == 0 else ()))


def test_random_linkages_hold():
    problems_ = problems(range(4), a_few)
    assert not problems_, report(problems_)


@pytest.mark.nightly
@pytest.mark.parametrize('batch', range(LONG // BATCH))
def test_a_thousand_random_linkages_hold(batch):
    first = 1000 + batch * BATCH
    problems_ = problems(range(first, first + BATCH), all_of_them)
    assert not problems_, report(problems_)


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('name', LISTED)
def test_a_listed_linkage_holds_what_any_must(name):
    problems_, _ = checks.problems(LISTED[name], np.random.default_rng(0))
    assert not problems_, problems_[0]


@pytest.mark.parametrize('kind', hard_cases.CATALOGUE)
@pytest.mark.parametrize('seed, count', [
    (1, 1), *(pytest.param(seed, 15, marks=pytest.mark.nightly) for seed in (2, 3, 4))])
def test_the_catalogue_with_hard_dimensions_holds(kind, seed, count):
    for mechanism, rng in hard_cases.linkages(kind, seed, count):
        told = checks.problems(random_linkages.Design(
            mechanism.design.joints, mechanism.dimensions, mechanism.branches), rng)
        # What is written is refused, in the catalogue it has no place.
        found = told[0] if told else mechanism.reach()
        assert not found, found[0]


# Linkages that broke the rule once, and where.
STEPS = [side * 10.0 ** power for side in (-1.0, 1.0) for power in range(-15, 0, 2)]
MENDED = {
    **{f'a dyad past the change points of {bars}': ((
        'O ground 0 0', f'Q ground {ground} 0', 'A crank O 1', f'B dyad A Q {bars} {side}'),
        (-8.0, -3.2, -3.1, -0.01, 0.01, 3.1, 3.2, 4.0, 10.0))
       for ground, bars, side in ((4, '2 3', 'left'), (3, '3 1', 'right'), (3, '1 3', 'left'))},
    'a block past a change point': ((
        'O ground 0 0', 'A crank O 1 up', 'B slider A 1 O 30deg out'),
        (-9.0, -2.2, -2.0, 1.0, 1.1, 4.1, 4.3, 7.0)),
    'crossed bars next to the flat pose': ((
        'A ground 0 0', 'C ground 0 -0.4', 'D crank A 1.9', 'H antiparallelogram A D C'),
        [0.5 * math.pi + step for step in STEPS]),
    'crossed bars of which one is short beside the crank': ((
        'A ground 0 0', 'B ground 0 0.158', 'C crank A 0.776', 'D antiparallelogram A B C'),
        [0.5 * math.pi + step for step in STEPS]),
    'a kite on a ground line that is short beside the crank': ((
        'O ground 0 0', 'Q ground -0.072 0', 'A crank O 1.871 up', 'B mirror O Q A'),
        np.linspace(0.5, 0.7, 10)),
    'a cell of bars that differ by rounding': ((
        'O ground 0 0', 'P ground -1.2 0', 'A crank O 1.2', 'B C D inversor P A 0.5 0.5-1.7e-15'),
        [math.pi + step for step in STEPS]),
    'crossed bars on a cylinder': ((
        'A ground 0 0', 'C ground 0 -0.4', 'B cylinder C A 1.9 left', 'H antiparallelogram A B C'),
        [2.3 + step for step in STEPS]),
    'a block on a short bar of a kite': ((
        'A ground 0 0', 'B ground -0.098 0', 'C ground -0.295 0', 'D crank C 1.796 up',
        'E dyad D B 1.202 0.926 left', 'F mirror B C E', 'H slider D 0.7 F along C in'),
        np.linspace(2.6, 2.7, 10)),
    'an antiparallelogram on a short diagonal of another': ((
        'A ground 0 0', 'C ground 0 -0.44801715381715446', 'D crank A 0.5078326030776525',
        'E antiparallelogram A D C', 'F antiparallelogram D A E'), (-0.3768893363289174,)),
    'a cylinder that is nearly nothing beside its bar': ((
        'P ground 0 0', 'O ground 1 0', 'B cylinder P O 1 left', 'K block B 0.1 0.2'), (1e-6,)),
    'a carriage just beyond its way along an axis': ((
        'A ground 0 0', 'B ground 1.4 0', 'C carriage B along A -3.5 0.6'), (-3.5000001,)),
    'a yoke of a pin that has no place': ((
        'A ground 0 0', 'B ground 1 0', 'D crank A 1', 'E dyad D B 0.2 0.3 left',
        'F yoke E A along B'), (2.0,)),
    'a slider beyond its rod, far from where coordinates begin': ((
        'A ground 0.932167114186647 0', 'B ground -2.7064166904829103 2.1812321403010912',
        'C crank B 0.4972591685950622 up', 'D slider C 0.35718299684870136 B along A out'),
        (1.8321253200577161,)),
    'a slot on an arm of nothing but rounding': ((
        'A ground 0 0', 'C ground 0 0.4692682948918445', 'D crank A 0.3838513370796755',
        'E antiparallelogram A C D', 'F yoke E A along D', 'H slot D F 0 out 0.37'),
        (1.7703773345200866,)),
    'a cell on a cylinder that is long beside its base': ((
        'A ground 0 0', 'B ground -5.46641130381081e-23 0',
        'D cylinder A B 1.1595959378308743e-20 left',
        'H J K inversor A D 2.685253038322849e-20 2.982014311130956e-20'),
        (1.1643742128158774e-20,)),
    'a rocker that hardly moves while its coupler does': ((
        'A ground 0 0', 'C ground -1.198753553 0', 'D crank A 0.354772347866',
        'E dyad D C 0.37805917181 0.37805917181+1.198753553-0.354772347866 right',
        'F slider E 3.166 A along C out'), (-2.2665130987562727,)),
    'an image of a joint of the ground': ((
        'A ground 0 0', 'C ground 0.170347395 0', 'D ground 0.03191923 1.50131151692',
        'E crank A 1', 'K image A D C'), (0.3,))}


@pytest.mark.nightly(all_but=4)
@pytest.mark.parametrize('name', MENDED)
def test_what_once_broke_the_rule_keeps_it(name):
    joints, values = MENDED[name]
    design = random_linkages.Design(joints, {}, {})
    subject = checks.Subject(design, np.random.default_rng(0), 400)
    motion = drawing_accuracy.Motion((1.0,), (0.3,))
    given = np.array(values)[:, None]
    assert not drawing_accuracy.broken(subject.fitted(given, True, motion=motion))


# A narrow arc of the reach beside an arm that nearly vanishes; a fold that is zero all along.
MISSED = [
    (('A ground 0 0', 'B ground 0.161354324102 0.864', 'C ground -1.93 -2.19',
      'D ground 1.4238273633 0.214076', 'E crank B 0.721712659013 up',
      'F crank E 1.02744928 zero B', 'G carriage D along C 0.91221252 1.6306136047425',
      'J dyad D F 1.466538287779 1.466538287779 right', 'K slider J 0.13066 B 90deg out',
      'L slot B E -0.4467165546 out 0.711892042',
      'N dyad B F 0.89583423993673 0.8958342399456883 right', 'P antiparallelogram B D L'),
     (1.8838612882358543, 1.1251129669997362)),
    (('A ground 0 1.54449086340883', 'B ground -1.0743670939267291 0',
      'C cylinder A B 1.8814134791868369 right', 'D antiparallelogram B A C',
      'E cylinder A B 1.8814134791868367 right geared cylinder 2.0 -1.9242333724251734',
      'F parallelogram C D B', 'G mirror D F A'), ())]


@pytest.mark.parametrize('joints, held', MISSED)
def test_reach_and_dead_points_that_were_missed_once(joints, held):
    subject = checks.Subject(random_linkages.Design(joints, {}, {}), np.random.default_rng(0))
    subject.held = held
    assert [*checks.reach(subject), *checks.dead_points(subject)] == []


# --- that the check is a check ------------------------------------------------------------------

def test_the_measure_sees_a_flaw_in_the_last_digits_and_a_wrong_nan():
    subject = checks.Subject(random_linkages.Design(MOVING, {}, {}), np.random.default_rng(9))
    theta = np.array([[0.7, *subject.held]])
    results = drawing_accuracy.answers(subject.mechanism, theta, subject.poses, True)
    measure = subject.measure()
    assert not drawing_accuracy.broken(drawing_accuracy.judge(measure, theta, results, True))
    truth = measure.at(theta[0], True)
    moving = [output for output in results if measure.due(output, truth.states) == 'number'
              and output.name not in (*subject.linkage.fixed, *(
                  input_.name for input_ in subject.mechanism.inputs))]
    assert len(moving) > 10
    for output, value in ((output, results[output]) for output in moving):
        for flawed in (value * (1.0 + 1e-12) + 1e-12, np.full_like(value, np.nan)):
            wrong = {**results, output: flawed}
            rows = drawing_accuracy.judge(measure, theta, wrong, True, [truth])
            assert {row.output for row in drawing_accuracy.broken(rows)} == {output}
