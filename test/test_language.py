# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""The words in which linkages are written, and what is said about a slip of the pen."""

import math
import re

from linkage_ros import language, mechanisms
import numpy as np
import pytest

FOUR_BAR = ('O ground 0 0', 'Q ground g 0', 'A crank O m', 'B dyad A Q b c left')
LENGTHS = {'g': 4.0, 'm': 1.0, 'b': 3.0, 'c': 2.5}


def made(*more, lines=FOUR_BAR, branches=None, **dimensions):
    """Return a four-bar with more lines."""
    return mechanisms.create('custom', joints=(*lines, *more), branches=branches,
                             **{**LENGTHS, **dimensions})


@pytest.mark.parametrize('line, problem', [
    ('B dyad A Q 1 1 left', 'joint B is placed already'),
    ('P dyad A X 1 1 left', 'joint X is not placed before; there are: O, Q, A, B'),
    ('P dyad A P 1 1 left', 'joint P is not placed before'),
    ('P dyad A A 1 1 left', 'the joints it stands on must differ'),
    ('P dyad A Q 1 1', 'expected "NAME dyad FIRST SECOND LENGTH LENGTH left|right"'),
    ('P dyad A Q 1 1 up', "'up' must be left or right"),
    ('P dyad A Q 0 1 left', 'a bar must be longer than zero, got 0'),
    ('P dyad A Q -1 1 left', 'a bar must be longer than zero, got -1'),
    ('P rigid A B 3 0.5e0 left', None),
    ('P rigid A B 1 0.5 left', 'no triangle has these sides'),
    ('P rigid A Q 1 1 left', 'A and Q are not joints of one moving link'),
    ('P line A B 0', 'the bar A-P must be longer than zero, got 0'),
    ('P line A B b-b', 'the bar A-P must be longer than zero, got 0'),
    ('P mirror B O Q', 'O and B are not joints of one moving link'),
    ('P parallelogram O B Q', 'O and B are not joints of one moving link'),
    ('P slot A B 0 out 1', 'joint A must be on the ground'),
    ('P slider B 3 A 0 out', 'joint A must be on the ground'),
    ('P slider B 3 O 0 up', "'up' must be out or in"),
    ('P crank A 1', 'joint A must be on the ground'),
    ('P crank O 1 down', "'down' must be up"),
    ('P inversor Q A 3 1', 'expected "NAME NAME NAME inversor POLE PIN LENGTH LENGTH"'),
    ('P R dyad A Q 1 1 left', 'expected "NAME dyad'),
    ('P teleport 0 0', 'expected NAME and one of the constructions ground, crank, dyad'),
    ('', 'expected NAME and one of the constructions'),
    ('9 ground 0 0', "'9' is no name for a joint"),
    ('P.x ground 0 0', "'P.x' is no name for a joint"),
    ('line ground 0 0', "'line' is no name for a joint"),
    ('P ground 0 zz', 'dimension zz has no value; given: g, m, b, c'),
    ('P ground 0 g*', "'g*' is no number, dimension or arithmetic on them"),
    ('P ground 0 g.real', "'g.real' is no number, dimension or arithmetic on them"),
    ('P ground 0 g**2', "'g**2' is no number"),
    ('P ground 0 max(g)', "'max(g)' is no number"),
    ('P ground 0 True', 'dimension True has no value; given: g, m, b, c'),
    ('P ground 0 1/0', 'divides by zero'),
    ('P ground 0 1e999', 'too large'),
    ('P ground 0', 'expected "NAME ground X Y"'),
])
def test_a_wrong_line_is_refused_with_the_line_and_what_is_allowed(line, problem):
    if problem is None:
        assert made(line).reach()
        return
    with pytest.raises(ValueError, match=re.escape(f'joint line "{line}": ') + '.*'
                       + re.escape(problem)):
        made(line)


def test_a_name_that_calls_python_is_only_a_name():
    with pytest.raises(ValueError, match='is no number, dimension or arithmetic on them'):
        made('P ground __import__("os") 0')
    with pytest.raises(ValueError, match='dimension exit has no value'):
        made('P ground exit 0')


@pytest.mark.parametrize('joints', [None, [], 'O ground 0 0'])
def test_joints_are_a_list_of_lines(joints):
    with pytest.raises(ValueError, match='joints must be a list of lines, one a joint'):
        mechanisms.create('custom', joints=joints)


def test_a_linkage_needs_a_crank():
    with pytest.raises(ValueError, match='at least one crank line'):
        mechanisms.create('custom', joints=('O ground 0 0',))


def test_a_tracer_must_be_a_joint():
    with pytest.raises(ValueError, match="tracer 'X' is no joint; allowed: O, Q, A, B"):
        mechanisms.create('custom', joints=FOUR_BAR, tracer='X', **LENGTHS)


def test_lines_of_a_catalogue_type_are_its_own():
    with pytest.raises(ValueError, match='joints and tracer are for type custom, not for jansen'):
        mechanisms.create('jansen', joints=FOUR_BAR)


def test_the_last_joint_is_traced_unless_another_is_named():
    assert made().tracer == 'B'
    assert mechanisms.create('custom', joints=FOUR_BAR, tracer='A', **LENGTHS).tracer == 'A'


@pytest.mark.parametrize('number, value', [
    ('g', 4.0), ('2*m', 2.0), ('g-m/2', 3.5), ('-(g+m)*2', -10.0), ('max(m,b)', 3.0),
    ('1.5e-2', 0.015), ('g/m/2', 2.0), ('--m', 1.0)])
def test_a_number_is_arithmetic_on_dimensions(number, value):
    assert made(f'P ground {number} 0').solve(0.0, ('P',))['P'].tolist() == [value, 0.0]


def test_every_construction_says_what_follows_it_in_the_module_s_text():
    for word in language._FORMS:
        assert re.search(rf'^    [A-Z][A-Z ]* {word} ', language.__doc__, re.MULTILINE), word


def test_a_dimension_is_positive_only_where_it_is_the_length_of_a_bar():
    assert made(g=-4.0).solve(math.pi)['B'] is not None
    with pytest.raises(ValueError, match='dimension b must be positive, got -3.0'):
        made(b=-3.0)


def test_a_change_of_dimensions_is_checked_like_the_first():
    linkage = made('P line A B p', p=1.0)
    assert linkage.with_dimensions(p=-1.0).bar_lengths['A', 'P'] == 1.0
    with pytest.raises(ValueError, match='line "P line A B p": the bar A-P must be longer'):
        linkage.with_dimensions(p=0.0)
    with pytest.raises(ValueError, match='dimension c must be positive'):
        linkage.with_dimensions(c=0.0)
    with pytest.raises(ValueError, match="no dimension 'q'; allowed: g, m, b, c, p"):
        linkage.with_dimensions(q=1.0)


def test_the_assembly_is_a_word_and_can_be_changed_by_its_joint():
    left, right = made(), made(branches={'B': -1})
    assert left.branches == {'B': 1} and right.branches == {'B': -1}
    mirrored = left.solve(-0.7)['B'] * (1.0, -1.0)
    np.testing.assert_array_equal(right.solve(0.7)['B'], mirrored)
    with pytest.raises(ValueError, match="no branch 'A'; allowed: B"):
        made(branches={'A': 1})


def test_any_two_joints_of_a_link_carry_a_triangle_or_a_line():
    linkage = made('P rigid A B 2 2 left', 'R rigid A B 1.5 2 right', 'S rigid P R 3 3 left',
                   'T line R P -1')
    theta = np.linspace(0.0, 6.0, 7)
    place = linkage.solve(theta)
    distance = np.linalg.norm(place['T'] - place['B'], axis=1)
    np.testing.assert_allclose(distance, distance[0], rtol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(place['S'] - place['P'], axis=1), 3.0, rtol=1e-14)


def test_links_have_names_of_their_own():
    with pytest.raises(ValueError, match='its link A_B_C would have the name of another'):
        made('A_B line A B 1', 'C dyad A_B Q 3 3 left', 'B_C dyad A Q 3 3 left')
