# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The calls that users type: what they accept, names too, what they return, and what they cost."""

from enum import Enum
import math
import sys

from effort import calls
from linkage_ros import mechanisms, scene
from linkage_ros.c_code import header
from linkage_ros.linkage import Answer, Solution
import numpy as np
import pytest
from test_language import made
from truth.cases import CASES

RODS = mechanisms.create('rods', joints=(
    'O motor ground at 0 0 0 axis 0 0 1', 'S slide ground at 1 0 0 axis 1 0 0',
    'R rod O 0 0.5 0 S 1.5 0 0.1'))
WRONG = 'x', ['x'], None, {}, object(), b'3', 10 ** 400, 1j, [[1.0], 'x']


@pytest.fixture(scope='module')
def bars():
    return mechanisms.create('four_bar')


@pytest.fixture(scope='module')
def arm():
    return mechanisms.create('five_bar')


# --- one number may be of any type ---

@pytest.mark.parametrize('number', [float, np.float64, np.float32, np.array, lambda x: np.array(
    [x])[0]])
def test_one_value_of_any_type_gives_floats(bars, number):
    value, near = 1.0, 0.5
    inverse = bars.inverse('QB')
    for expected, result in (
            (bars.servo_for('QB', value), bars.servo_for('QB', number(value))),
            (bars.servo_for('QB', value, near), bars.servo_for('QB', number(value), number(near))),
            (bars.follow('QB', value, near), bars.follow('QB', number(value), number(near))),
            ((bars.input_for('QB', value, near),), (bars.input_for(
                'QB', number(value), number(near)),)),
            (inverse.nearest(value)[0], inverse.nearest([number(value)])[0]),
            (inverse.nearest((value,), near)[1], inverse.nearest(number(value), number(near))[1])):
        assert result == expected and {*map(type, result)} == {float}


def test_integers_are_numbers(bars, arm):
    assert bars.servo_for('QB', 1) == bars.servo_for('QB', 1.0)
    assert bars.input_for('P.x', 50, near=1) == bars.input_for('P.x', 50.0, near=1.0)
    assert arm.reach(2) == arm.reach(2.0) and arm.dead_points(np.int64(2)) == arm.dead_points(2.0)
    values = {'jansen.leg_pairs': np.int64(2), 'jansen.pose': np.zeros(6), 'rate': np.float32(1.0)}
    assert scene.read(values) == scene.read({'jansen.leg_pairs': 2, 'rate': 1.0})


@pytest.mark.parametrize('shape', [(), (1,), (3, 2), (0,)])
def test_results_have_the_shape_of_value_and_near(bars, shape):
    value, near = np.full(shape, 1.0), np.full(shape, 0.5)
    assert np.shape(bars.input_for('QB', value)) == (*shape, 2 if value.size else 1)
    for result in (bars.input_for('QB', value, 0.5), bars.input_for('QB', 1.0, near),
                   *bars.servo_for('QB', value, near), *bars.servo_for('QB', value)):
        assert np.shape(result) == shape
        np.testing.assert_array_equal(result, np.full(shape, result.flat[0] if shape and value.size
                                                      else result))
    assert bars.acceleration(value, 2.0, 0.0, ('B',))['B'].shape == (*shape, 2)
    assert bars.joint_accelerations(value, 2.0, 0.0)['QB'].shape == shape


# --- values that are wrong are named ---

@pytest.mark.parametrize('wrong', WRONG)
def test_what_is_no_number_is_refused_with_its_name(bars, arm, wrong):
    one, two = bars.inverse('QB'), arm.inverse(('P.x', 'P.y'))
    for call, name in (
            (lambda: one.all(wrong), 'values'), (lambda: two.all([0.1, wrong]), 'values'),
            (lambda: one.over(wrong), 'values'), (lambda: two.over(0.1, wrong), 'values'),
            (lambda: one.nearest(wrong), 'values'), (lambda: two.nearest([0.1, wrong]), 'values'),
            (lambda: two.nearest([0.1, 0.1], [0.1, wrong]), 'near'),
            (lambda: one.path(wrong), 'values'), (lambda: two.path([[0.1], wrong]), 'values'),
            (lambda: two.path([[0.1], [0.1]], [0.1, wrong]), 'near'),
            (lambda: one.follow(wrong, 0.1), 'values'), (lambda: two.follow(
                [0.1, 0.1], [0.1, wrong]), 'near'),
            (lambda: arm.reach(wrong), 'others'), (lambda: arm.dead_points(wrong), 'others'),
            (lambda: arm.distance_to_dead_point(0.1, wrong), 'others'),
            (lambda: arm.input_for('P.x', 0.1, others=[wrong]), 'others'),
            (lambda: arm.extremes('P.x', others=[wrong]), 'others'),
            *((lambda call=call: getattr(arm, call)([0.1, wrong]), 'theta') for call in (
                'solve', 'velocity', 'joint_angles', 'joint_rates', 'transmission_angles')),
            *((lambda x=x: bars.solve(x), 'theta') for x in (wrong, bytearray(b'3'))),
            (lambda: bars.servo_for('QB', wrong), 'values'),
            (lambda: bars.input_for('QB', wrong), 'value')):
        with pytest.raises(ValueError, match=name):
            call()


@pytest.mark.parametrize('wrong', [
    'x', None, {}, object(), [[1.0], 'x'], True, math.nan, 'distance(A,A)', 'distance(A,Z)',
    'angle(A)', 'angle(A,B,C)', 'distance(A, B)', 'A.z', '', 'distance', '(A,B)', 7, 1, -1, 1.0,
    np.array(['QB', 'AB'])])
def test_what_is_no_output_joint_or_package_is_refused_with_its_name(bars, wrong):
    assert not bars.has_output(wrong) and not bars.moves(wrong)
    for call, text in (
            (lambda: bars.is_angle(wrong), 'has no output'),
            (lambda: bars.input_for(wrong, 1.0), 'four_bar has no'),
            (lambda: bars.extremes(wrong), 'has no output'),
            (lambda: bars.monotone(wrong), 'has no output'),
            (lambda: bars.extremes('QB', [wrong]), 'arcs must be'),
            (lambda: bars.function(xp='x' if wrong is None else wrong), 'xp must be a package'),
            (lambda: bars.inverse('QB').function(wrong), 'xp must be a package'),
            *((lambda by=by: by(0.1, by=wrong), 'by must be the number of an input, from 0')
              for by in (bars.velocity, bars.joint_rates)),
            (lambda: RODS.is_angle(wrong), 'allowed: O, S, O_origin.x'),
            (lambda: LEVER.mechanisms['lever'].assembly().solution((), (wrong,)), 'joint'),
            (lambda: bars.driven_by(wrong), 'can be driven by 1 of none in a plane, not by'),
            (lambda: RODS.driven_by(wrong), 'can be driven by 1 of O, S, not by')):
        with pytest.raises(ValueError, match=text):
            call()


def test_sides_of_rods_are_checked_whatever_drives():
    assert RODS.driven_by('S', branches={'R': -1}).branches == {'R': -1}
    for wrong, text in (({'R': 5}, 'branch R must be'), ({'X': 1}, "has no branch 'X'"),
                        ('R', 'branches must be a mapping')):
        with pytest.raises(ValueError, match=text):
            RODS.driven_by('S', branches=wrong)


def test_pieces_of_the_first_of_several_inputs_are_for_others_that_are_given(arm):
    (low, *_), *_, (_, high, *_) = arm.monotone('P.x', [1.0])
    # An angle turns by half a turn at most in each.
    assert np.abs(np.diff(mechanisms.create('whitworth').monotone('lever'))[:, 2]).max() <= math.pi
    np.testing.assert_allclose([[low, high]], arm.reach(1.0))
    with pytest.raises(ValueError, match='the values of all except the first'):
        arm.monotone('P.x')


def test_there_are_as_many_numbers_as_inputs(bars, arm):
    one, two = bars.inverse('QB'), arm.inverse(('P.x', 'P.y'))
    for linkage, name, asks in (
            (bars, 'values', (one.nearest, one.all, one.path, lambda x: one.over(*x))),
            (bars, 'near', (lambda x: one.nearest(0.7, x), lambda x: one.all(0.7, x),
                            lambda x: one.path([[0.7]], x))),
            (arm, 'values', (two.nearest, two.all, two.path, lambda x: two.over(*x),
                             lambda x: two.follow(x, [0.1, 0.1]))),
            (arm, 'near', (lambda x: two.nearest([0.1, 0.1], x), lambda x: two.path(
                [[0.1], [0.1]], x), lambda x: two.follow([0.1, 0.1], x)))):
        for call in asks:
            with pytest.raises(ValueError, match=f'{linkage.type} has . inputs?: {name} must be'):
                call([0.1, 0.2, 0.3])
    for others in ((), (0.1, 0.2), [[0.1]], 0.1):
        with pytest.raises(ValueError, match='five_bar has 2 inputs: the values of all except'):
            arm.input_for('P.x', 0.1, others=others)
    with pytest.raises(ValueError, match='four_bar has 1 input: the values of all except'):
        bars.reach(0.1)
    assert bars.input_for('QB', 1.0, others=np.empty(0)).tolist() == [*bars.input_for('QB', 1.0)]
    with pytest.raises(ValueError, match='theta must be a sequence of as many values'):
        arm.solve(0.5)


def test_arrays_of_shapes_that_do_not_broadcast_are_refused_with_their_shapes(bars, arm):
    for call in (lambda: bars.servo_for('QB', [0.1, 0.2], [1.0, 1.0, 1.0]),
                 lambda: arm.inverse(('P.x', 'P.y')).over([0.1, 0.2], [0.1, 0.2, 0.3]),
                 lambda: arm.inverse(('P.x', 'P.y')).path([[0.1, 0.2], [0.1, 0.2, 0.3]])):
        with pytest.raises(ValueError, match=r'broadcast.*\(2,\).*\(3,\)'):
            call()


def test_a_path_starts_next_to_an_input_of_zero(bars):
    inverse = bars.inverse('P.x')
    value = bars.solve(0.0)['P'][0]
    crank, = inverse.path([np.array([value])], 0.0)[0]
    assert crank == pytest.approx([0.0], abs=1e-9)
    for near in (math.nan, math.inf):
        with pytest.raises(ValueError, match='near must be finite'):
            inverse.path([np.array([value])], near)


@pytest.mark.filterwarnings('error')
def test_nothing_leads_to_a_value_whose_distance_is_infinite():
    drop = mechanisms.create('water_drop')
    assert math.isnan(drop.inverse('P.x').follow([sys.float_info.max], [0.3])[0][0])
    assert math.isnan(mechanisms.create('peaucellier').distance_to_dead_point(math.inf))


# --- what is printed ---

def test_an_answer_prints_its_inputs_its_mode_and_its_margin(arm):
    inverse = arm.inverse(('P.x', 'P.y'))
    answer = inverse.all((0.05, 0.15))[0]
    assert repr(answer) == (
        f'Solution(inputs={answer.inputs}, mode={answer.mode!r}, margin={answer.margin:.3g})')
    assert repr(inverse) == '<inverse of five_bar for P.x, P.y>'
    assert isinstance(answer, Solution) and ' at 0x' not in str([answer])
    assert Answer is Solution  # as it was called
    # A motor on a crank turns off to the left of that, then to the right.
    assert [answer.mode for answer in CASES['elbow motor'].linkage().inputs_for(
        ('B.x', 'B.y'), (0.4, 0.3))] == ['crank2+ det+', 'crank2- det-']


# --- what they cost beside the inverse below them ---

@pytest.mark.parametrize('near', [None, 0.5])
def test_a_call_by_name_adds_a_few_calls_to_the_inverse_below_it(bars, near):
    given = [1.0] if near is None else [1.0, near]
    inverse = bars.inverse('QB')
    for below, call, most in (
            (lambda: inverse.nearest(*([x] for x in given)),
             lambda: bars.servo_for('QB', *given), 5),
            (lambda: inverse.nearest(*([x] for x in given)) if near else inverse.all(1.0),
             lambda: bars.input_for('QB', *given), 5),
            (lambda: inverse.follow([1.0], [0.5]), lambda: bars.follow('QB', 1.0, 0.5), 5),
            (lambda: bars.joint_rates(0.5, ('QB',)),
             lambda: bars.output_effort('QB', 0.5, 2.0), 10)):
        below(), call()
        assert calls(call) - calls(below) <= most


# --- values near an end ---

@pytest.mark.parametrize('cranks', [
    (-0.870126, -1.881109), (0.86055566, -1.44647274), (-0.85956347, -1.93895148)])
def test_outputs_that_hardly_differ_are_answered_with_their_pose(arm, cranks):
    outputs = 'angle(O,P)', 'P.y'
    values = [float(value) for value in arm.joint_angles(cranks, outputs).values()]
    solutions = arm.inverse(outputs).all(values)
    assert any(np.allclose(answer.inputs, cranks, atol=1e-6) for answer in solutions)
    for answer in solutions:
        np.testing.assert_allclose([*arm.joint_angles(answer.inputs, outputs).values()], values,
                                   rtol=0.0, atol=1e-15)


def test_the_margin_of_a_pose_without_rates_is_zero():
    stretched = mechanisms.create('custom', joints=(
        'O ground 0 0', 'Q ground 1 2', 'A crank O 1', 'B dyad A Q 1 1 left'))
    for output in ('distance(O,B)', 'B.y', 'AB'):
        inverse, value = stretched.inverse(output), float(stretched.joint_angles(
            0.0, (output,))[output])
        solutions = inverse.all(value)
        assert any(abs(answer.inputs[0]) < 1e-9 for answer in solutions)
        assert Solution((0.0,), inverse).margin == 0.0
        assert all(0.0 <= answer.margin <= 1.0 and repr(answer) for answer in solutions)


# --- what a linkage is created with ---

@pytest.mark.parametrize('arguments, problem', [
    ({'c': math.nan}, 'dimension c must be finite, got nan'),
    ({'c': 1e-31}, 'dimension c must lie between 1e-30 and 1e\\+30'),
    ({'b': 1e31}, 'dimension b must lie between'),
    ({'a': [1.0, 2.0], 'b': [1.0, 2.0, 3.0]}, r'shapes that broadcast, got a \(2,\), b \(3,\)'),
    ({'tracer': 'A'}, 'joints and tracer are for type custom or rods, not for slider_crank')])
def test_wrong_dimensions_branches_and_tracers_are_named(arguments, problem):
    with pytest.raises(ValueError, match=problem):
        mechanisms.create('slider_crank', **arguments)


# --- names of any class of text ---

def member(text):
    """Return a text as a member of an enum."""
    return Enum('Joint', {'ONE': text}, type=str).ONE


GIVEN = {'mechanisms': ['lever'], 'lever.type': 'slotted_lever'}
LEVER = scene.read(GIVEN)
LEG = mechanisms.create('jansen')
FIVE_BAR = mechanisms.create('five_bar')


def custom(made):
    """Return a four-bar, all texts of which are of a class."""
    return mechanisms.create('custom', tracer=made('A'), branches={made('B'): -1}, joints=[*map(
        made, ('O ground 0 0', 'Q ground 3 0', 'A crank O 1', 'B dyad A Q 2.5 2.5 left'))])


# What is asked with names, which a function makes of texts.
CALLS = {
    'dimensions': lambda made: mechanisms.create(made('jansen'), **{made('m'): 14.0}).dimensions,
    'changed dimensions': lambda made: mechanisms.create('jansen').with_dimensions(
        **{made('m'): 14.0}).dimensions,
    'type': lambda made: mechanisms.create(made('jansen')).type,
    'points': lambda made: [*LEG.solve(0.5, [made('G'), made('F')]), *LEG.velocity(
        [0.5, 0.6], (made('C'),)), *LEG.acceleration(0.5, 1.0, 0.0, made('D'))],
    'joints': lambda made: [*LEG.joint_angles([0.5], [made('BC'), made('G.y')]), *LEG.joint_rates(
        0.5, (made('EF'),)), *LEG.transmission_angles(0.5, made('E'))],
    'function': lambda made: LEG.function([made('G')], (made('BC'),), (made('BC'),))(0.5),
    'inverse': lambda made: [*LEG.input_for(made('BC'), 1.3), *LEG.extremes(made('EF'))],
    'loads': lambda made: [*LEG.effort(0.5, {made('G'): (1.0, 2.0), made('BC'): 3.0}),
                           LEG.output_effort(made('G.x'), 0.5, 1.0)],
    'lines': lambda made: [custom(made).tracer, *custom(made).branches, *custom(made).points],
    'header': lambda made: header.written(LEVER.mechanisms['lever'], [made('lever')]),
    'several outputs': lambda made: FIVE_BAR.inputs_for(
        [made('P.x'), made('P.y')], FIVE_BAR.solve((0.5, 2.0), 'P')['P']),
    'scene': lambda made: scene.read({made('mechanisms'): [made('lever')], made(
        'lever.type'): made('slotted_lever')}).parameters,
    'changed scene': lambda made: [each.name for each in scene.changed(
        LEVER, {made('lever.dimensions.e'): 1.5}).changed_from(LEVER)]}


@pytest.mark.parametrize('made', [np.str_, member])
@pytest.mark.parametrize('what', CALLS)
def test_what_is_asked_by_names_of_any_class_is_the_same(made, what):
    first, later = CALLS[what](made), CALLS[what](str)
    assert first == later and len(first) > 0
    # Nor are later callers given names of that class.
    assert all(type(each) is str for each in (*first, *later) if isinstance(each, str))


# --- linkages of the user's own: two cranks, arrays of dimensions ---

@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('shape', [(), (1,), (3,), (3, 2)])
@pytest.mark.parametrize('turned', [(), (2,), (1, 2)])
def test_an_array_of_dimensions_is_broadcast_against_the_angle(shape, turned):
    # Some cannot be assembled.
    swept = np.linspace(2.6, 9.4, int(np.prod(shape))).reshape(shape)
    theta = np.linspace(0.1, 0.9, int(np.prod(turned))).reshape(turned)
    try:
        expected = np.broadcast_shapes(shape, turned)
    except ValueError:
        pytest.skip('not broadcast')
    linkage = made(b=swept)
    place = linkage.solve(theta)
    for result in (linkage.solve(theta, 'O')['O'][..., 0], linkage.effort(theta, {})[..., 0]):
        assert result.shape == expected
    assert place['B'].shape == (*expected, 2) and place['O'].shape == (*expected, 2)
    lengths, thetas = np.broadcast_arrays(swept, theta)
    for index in np.ndindex(expected):
        single, crank = made(b=float(lengths[index])), float(thetas[index])
        np.testing.assert_allclose(place['B'][index], single.solve(crank)['B'], rtol=1e-14)
        np.testing.assert_allclose(linkage.transmission_angles(theta)['B'][index],
                                   single.transmission_angles(crank)['B'], rtol=1e-14)


@pytest.mark.filterwarnings('error')
def test_of_arrays_of_dimensions_one_may_have_no_rate():
    linkage = mechanisms.create('custom', b=np.array([1.0, 1.5]), joints=(
        'O ground 0 0', 'Q ground 1 2', 'A crank O 1', 'B dyad A Q b 1 left'))
    assert np.isfinite(linkage.velocity(0.0)['B']).all(axis=-1).tolist() == [False, True]


def test_of_no_arcs_there_are_no_extremes(bars):
    assert bars.extremes('QB', []) == []
    with pytest.raises(ValueError, match='arcs must be pairs of two finite numbers'):
        bars.extremes('QB', [(0.0, math.nan)])


def test_of_arrays_of_dimensions_change_points_are_ignored():
    kite = mechanisms.create('four_bar', a=40.0, b=100.0, c=40.0, d=100.0, p=[60.0, 70.0])
    assert kite.period() == 1 and kite.solve(0.3)['P'].shape == (2, 2)
    assert made(b=[2.0, 9.0]).longest.tolist() == [made(b=b).longest for b in (2.0, 9.0)]


def test_a_linkage_stays_what_it_was_created_as():
    swept = np.array([3.0, 3.1])
    linkage = made(b=swept)
    swept[:] = 2.0
    assert np.array_equal(linkage.velocity(0.3)['B'], made(b=[3.0, 3.1]).velocity(0.3)['B'])
    for own in linkage.dimensions, linkage.branches:
        with pytest.raises(TypeError, match='does not support item assignment'):
            own['B'] = 1


def test_questions_about_the_reach_and_functions_are_for_one_set_of_dimensions():
    linkage = made(b=np.array([3.0, 3.1]))
    boom = mechanisms.create('custom', r=[1.0, 1.1], joints=(
        'O ground 0 0', 'P ground 0.5 -0.2', 'B cylinder P O r right'))
    for call in (linkage.function, linkage.reach, linkage.dead_points,
                 lambda: linkage.input_for('QB', 1.0), boom.dead_points,
                 lambda: boom.extremes('B.x', [(0.8, 0.9)])):
        with pytest.raises(ValueError, match='for one set of dimensions, not for arrays'):
            call()


def test_arrays_of_dimensions_are_checked_too():
    with pytest.raises(ValueError, match='dimension b must be positive'):
        made(b=np.array([3.0, -3.0]))
    for line, wrong in (('P line A B b-c', 'the bar A-P must be longer'),
                        ('P rigid A B 2 0.7 left', 'no triangle has these sides'),
                        ('P carriage O along Q 2.75 b', 'the lower end of the carriage must be'),
                        ('P crank Q 1 geared crank b*500 0', 'crank2 turns 1500 times as fast')):
        with pytest.raises(ValueError, match=f'line "{line}": {wrong}|custom: {wrong}'):
            made(line, b=np.array([3.0, 2.5]))


def test_a_joint_of_a_carriage_stands_still_while_that_is_held():
    linkage = mechanisms.create('custom', joints=(
        'A ground 0 0', 'B ground 2 0', 'C ground 0 1', 'D cylinder B A 1.5 right',
        'E carriage C along B -1 1'))
    with pytest.raises(ValueError, match='E.x of custom does not move with the cylinder'):
        linkage.input_for('E.x', 0.5, others=(0.3,))
