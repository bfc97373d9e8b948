# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Names of any class of text are names, whoever asks first."""

from enum import Enum
from itertools import count

from linkage_ros import mechanisms, scene
from linkage_ros.c_code import header
from linkage_ros.scene.legs import Assembly
import numpy as np
import pytest

NUMBERS = count()
THETA = np.linspace(-3.0, 3.0, 40)


def member(text):
    """Return a text as a member of an enum."""
    return Enum('Joint', {'ONE': text}, type=str).ONE


of_any_class = pytest.mark.parametrize('made', [np.str_, member])


def fresh(kind=str):
    """Return a lever nobody has asked for anything, its texts of a class, and its last joint."""
    last = f'Z{next(NUMBERS)}'
    lines = ('O ground 0 0', 'Q ground 3 0', 'A crank O r', 'B dyad A Q 2.5 2.5 left',
             f'{last} line A B 1.1')
    return mechanisms.create(kind('custom'), r=1.0, joints=tuple(map(kind, lines)),
                             tracer=kind(last), branches={kind('B'): -1}), last


def answers(kind, linkage, last):
    """Yield what a linkage is asked by names of a class, in every way it can be."""
    points, links, output = [kind('B'), kind(last)], (kind('QB'), kind('AB')), kind(f'{last}.x')
    near = linkage.joint_angles(0.7)['QB']
    yield linkage.solve(0.5, points)
    yield linkage.solve(0.5, tuple(points))
    yield linkage.solve(0.5, points[0])
    yield linkage.solve(THETA, points)
    yield linkage.velocity(THETA, points)
    yield linkage.acceleration(THETA, THETA, THETA, points)
    yield linkage.joint_angles(0.5, links)
    yield linkage.joint_angles(THETA, [*links, output])
    yield linkage.joint_rates(THETA, links)
    yield linkage.joint_accelerations(THETA, THETA, THETA, links)
    yield linkage.transmission_angles(THETA, points[:1])
    yield {'function': linkage.function(points, links, links)(0.5)}
    yield {'input_for': linkage.input_for(links[0], near)}
    yield {'output': linkage.input_for(output, linkage.joint_angles(0.7, [output])[output])}
    yield {'extremes': linkage.extremes(links[0])}
    yield {'is_angle': linkage.is_angle(output), 'has_output': linkage.has_output(output)}
    yield {'effort': linkage.effort(0.5, {points[0]: (1.0, 2.0), links[0]: 3.0})}
    yield {'output_effort': linkage.output_effort(links[0], 0.5, 1.0)}
    solution = Assembly(linkage).solution(points, links, links)
    solution.solve([0.5], [1.0])
    yield {'walker': solution.values}


@pytest.mark.nightly(all_but=3)
@pytest.mark.parametrize('texts', [str, np.str_, member])
@pytest.mark.parametrize('names', [np.str_, member])
def test_text_of_any_class_is_a_name_and_later_callers_are_not_harmed(texts, names):
    linkage, last = fresh(texts)
    assert type(linkage.tracer) is type(linkage.type) is str
    assert (linkage.type, linkage.tracer, linkage.branches) == ('custom', last, {'B': -1})
    for found, later, expected in zip(answers(names, linkage, last), answers(str, linkage, last),
                                      answers(str, *fresh()), strict=True):
        assert [*found] == [*later] and {*map(type, found)} == {str}
        for values in zip(found.values(), later.values(), expected.values(), strict=True):
            assert all(np.array_equal(value, values[0], equal_nan=True) for value in values)


@of_any_class
def test_dimensions_and_types_have_such_names_too(made):
    leg = mechanisms.create(made('jansen'), **{made('m'): 14.0})
    assert type(leg.type) is str and set(map(type, leg.dimensions)) == {str}
    other = mechanisms.create('jansen').with_dimensions(**{made('m'): 14.0})
    assert leg.dimensions == other.dimensions == {**mechanisms.defaults(made('jansen')), 'm': 14.0}


@of_any_class
def test_a_header_is_the_same_for_outputs_of_any_class(made):
    given = {'mechanisms': ['lever'], 'lever.type': 'slotted_lever'}
    mechanism = scene.read(given).mechanisms['lever']
    assert header.written(mechanism, [made('lever')]) == header.written(mechanism, ['lever'])


@of_any_class
def test_what_is_no_name_is_refused_as_ever(made):
    linkage, _ = fresh()
    for ask in (linkage.solve, linkage.joint_angles, linkage.velocity):
        with pytest.raises(ValueError, match='custom has no (point|joint).*; allowed: '):
            ask(0.5, (made('none'),))
    with pytest.raises(ValueError, match='has no output .*; allowed: '):
        linkage.input_for(made('none'), 0.5)
    with pytest.raises(ValueError, match='^O.x of custom does not move with the crank$'):
        linkage.input_for(made('O.x'), 0.5)
    with pytest.raises(ValueError, match='the load on the joint B must be a force'):
        linkage.effort(0.4, {made('B'): 3.0})


@of_any_class
def test_several_outputs_have_such_names_too(made):
    linkage, outputs = mechanisms.create('five_bar'), ('P.x', 'P.y')
    wanted = [linkage.solve((0.5, 2.0), 'P')['P'][axis] for axis in (0, 1)]
    odd = list(map(made, outputs))
    assert linkage.inputs_for(odd, wanted) == linkage.inputs_for(outputs, wanted) != []
    with pytest.raises(ValueError, match='five_bar has no output'):
        linkage.inputs_for([made('none'), 'C.x'], wanted)


@of_any_class
def test_parameters_have_such_names_too(made):
    given = {'mechanisms': ['leg'], 'leg.type': 'jansen', 'leg.dimensions.m': 14.0}
    read = scene.read({made(name): value for name, value in given.items()})
    assert read.parameters == scene.read(given).parameters
    changed = scene.changed(read, {made('leg.dimensions.m'): 14.5})
    assert [each.name for each in changed.changed_from(read)] == ['leg.dimensions.m']
    with pytest.raises(scene.SceneError, match=r'^leg\.colour is not a parameter of the scene'):
        scene.changed(read, {made('leg.colour'): 1.0})


def test_an_error_names_the_argument_that_is_wrong():
    five_bar = mechanisms.create('five_bar')
    with pytest.raises(ValueError, match='rate must be a sequence of as many values'):
        five_bar.acceleration((0.3, 0.4), 1.0, 0.0)
    with pytest.raises(ValueError, match=r'no output .*; allowed: distance\(A,B\)'):
        mechanisms.create('jansen').extremes('distance(O, G)')
