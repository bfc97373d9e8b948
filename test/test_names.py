# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Names of any class of text are names, whoever asks first."""

from enum import Enum

from linkage_ros import mechanisms, scene
from linkage_ros.c_code import header
import numpy as np
import pytest


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
ASKED = {
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
    'scene': lambda made: scene.read({
        made(name): value for name, value in GIVEN.items()}).parameters,
    'changed scene': lambda made: [each.name for each in scene.changed(
        LEVER, {made('lever.dimensions.e'): 1.5}).changed_from(LEVER)]}


@pytest.mark.parametrize('made', [np.str_, member])
@pytest.mark.parametrize('what', ASKED)
def test_what_is_asked_by_names_of_any_class_is_the_same(made, what):
    found, later = ASKED[what](made), ASKED[what](str)
    assert found == later and len(found) > 0
    # Nor are later callers given names of that class.
    assert all(type(each) is str for each in (*found, *later) if isinstance(each, str))
