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


GIVEN = {'mechanisms': ['lever'], 'lever.type': 'slotted_lever'}
LEVER = scene.read(GIVEN)
FIVE_BAR = mechanisms.create('five_bar')
# What is asked with names, which a function makes of texts.
ASKED = {
    'dimensions': lambda made: mechanisms.create(made('jansen'), **{made('m'): 14.0}).dimensions,
    'changed dimensions': lambda made: mechanisms.create('jansen').with_dimensions(
        **{made('m'): 14.0}).dimensions,
    'type': lambda made: mechanisms.create(made('jansen')).type,
    'header': lambda made: header.written(LEVER.mechanisms['lever'], [made('lever')]),
    'several outputs': lambda made: FIVE_BAR.inputs_for(
        [made('P.x'), made('P.y')], FIVE_BAR.solve((0.5, 2.0), 'P')['P']),
    'scene': lambda made: scene.read({
        made(name): value for name, value in GIVEN.items()}).parameters,
    'changed scene': lambda made: [each.name for each in scene.changed(
        LEVER, {made('lever.dimensions.e'): 1.5}).changed_from(LEVER)]}


@pytest.mark.parametrize('made', [np.str_, member])
@pytest.mark.parametrize('what', ASKED)
def test_what_is_asked_by_names_of_any_class_is_the_same(made, what):
    found, expected = ASKED[what](made), ASKED[what](str)
    assert found == expected and len(found) > 0
    assert {*map(type, found)} == {*map(type, expected)}
