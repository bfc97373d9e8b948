# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The words in which linkages are written, and what is said about a slip of the pen."""

from fractions import Fraction
import math
import random
import re

from effort import few_calls
from linkage_ros import mechanisms, scene
import numpy as np
import pytest
from scenes import custom
from truth.hostile_texts import mutations, NUMBERS, TEXTS

FOUR_BAR = ('O ground 0 0', 'Q ground g 0', 'A crank O m', 'B dyad A Q b c left')
# More digits than Python writes.
HUGE = pytest.param(10 ** 5000, id='huge')
LENGTHS = {'g': 4.0, 'm': 1.0, 'b': 3.0, 'c': 2.5}


def made(*more, lines=FOUR_BAR, branches=None, **dimensions):
    """Return a four-bar with more lines."""
    return custom(*lines, *more, branches=branches, **{**LENGTHS, **dimensions})


@pytest.mark.parametrize('line, problem', [
    ('B dyad A Q 1 1 left', 'joint B is placed already'),
    ('P dyad A X 1 1 left', 'joint X is not placed before; there are: O, Q, A, B'),
    ('P dyad A A 1 1 left', 'the joints that it is placed from must differ'),
    ('P dyad A Q 1 1', 'expected "NAME dyad FIRST SECOND LENGTH LENGTH left|right"'),
    ('P dyad A Q 1 1 up', "'up' must be left or right"),
    ('P dyad A Q 0 1 left', 'a bar must be longer than zero, got 0'),
    ('P rigid A B 1 0.5 left', 'no triangle has these sides'),
    ('P rigid A Q 1 1 left', 'A and Q are not joints of one moving link'),
    ('P line A B 0', 'the bar A-P must be longer than zero'),
    ('P line A B b-b', 'the bar A-P must be longer than zero'),
    ('P mirror B O Q', 'O and B are not joints of one moving link'),
    ('P parallelogram O B Q', 'O and B are not joints of one moving link'),
    ('P crank A 1', 'must be on the ground unless the line has zero and a joint of its link'),
    ('P slider B 3 A 0 out', 'joint A must be on the ground'),
    ('P slider B 3 O 0 up', "'up' must be out or in"),
    ('P crank O 1 down', 'expected "NAME crank CENTRE LENGTH [up] [zero JOINT] [geared'),
    ('P crank O 1 zero B', 'O and B are not joints of one moving link'),
    ('P crank O 1 geared gear 2 0', 'it cannot be geared to gear; allowed: crank'),
    ('P crank O 1 geared crank 2deg 0', "'2deg' is in degrees, but RATIO is not an angle"),
    ('P cylinder O A 1 left geared crank 2 0', 'cannot be geared to crank; allowed: none in m'),
    ('P carriage O Q 0 1', 'expected "NAME carriage ORIGIN along TOWARDS DISTANCE DISTANCE'),
    ('P carriage O along B 0 1', 'O and B are not joints of one moving link'),
    ('P carriage O along A 1 1', 'the lower end of the carriage must be less than its upper'),
    ('P block A 1 1', 'A is not a joint of a block'),
    ('P slider A 1 O along A out', 'the joints that it is placed from must differ'),
    ('P inversor Q A 3 1', 'expected "NAME NAME NAME inversor POLE PIN LENGTH LENGTH"'),
    ('P teleport 0 0', 'expected NAME and one of the constructions ground, crank, cylinder, '),
    ('', 'expected NAME and one of the constructions'),
    ('9 ground 0 0', "'9' cannot name a joint"),
    ('line ground 0 0', "'line' cannot name a joint"),
    ('P ground 0 zz', 'dimension zz has no value; given: g, m, b, c'),
    ('P ground 0 g*', "'g*' is not a number, dimension or arithmetic on them"),
    ('P ground 0 max(g)', "'max(g)' is not a number"),
    ('P ground 0 1/0', "'1/0' must be 0 or between 1e-70 and 1e70"),
    ('P ground 0', 'expected "NAME ground X Y"'),
    ('P P S inversor Q A 3 1', 'joint P is placed already'),
    ('P S T inversor P A 3 1', 'joint P is not placed before'),
    ('P ground 0, 0', 'numbers are separated by spaces, without commas'),
    ('P ground 2 * m 0', 'arithmetic has no spaces: 2*r, not 2 * r'),
    ('P ground 0 sqrt(m-g', "'sqrt(m-g' is not a number"),
    ('P ground 0 max(1,sqrt(1-2))', "'max(1,sqrt(1-2))' must be 0 or between 1e-70 and 1e70"),
    ('P ground 0 1/(1/(b-b))', "'1/(1/(b-b))' must be 0 or between 1e-70 and 1e70"),
    ('P ground 0 1e-71*m', "'1e-71*m' must be 0 or between 1e-70 and 1e70"),
    ('P ground 0 ' + '9' * 310, 'must be 0 or between 1e-70 and 1e70'),
    ('P ground g*g*1e70 0', "'g*g*1e70' must be 0 or between 1e-70 and 1e70"),
    ('P ground 0 30deg', "'30deg' is in degrees, but Y is not an angle"),
    ('P slider A b Q 90 out', '90 is more than a turn; in degrees it is written 90deg'),
    ('P slider A b Q 45*2 out', 'in degrees it is written (45*2)deg'),
    ('P slider A b Q 90 deg out', 'an angle is in rad, or in degrees: 30deg'),
    ('P dyad A Q 1 1 left R ground 0 0', 'one line per joint'),
    ('P ground __import__("os") 0', 'is not a number, dimension or arithmetic on them'),
    ('R ground 0 0; P crank R 1 zero O', 'R and O are at the same place'),
    ('R ground 0 0; P carriage R along O 0 1', 'R and O are at the same place'),
    ('R ground 0 0; P slider A 1 R along O out', 'R and O are at the same place'),
    ('R ground 0 0; P dyad R O 1 1 left', 'R and O are at the same place'),
    ('R ground 1 0; S image O R Q; P dyad S O 1 1 left', 'S and O are at the same place'),
    ('P line A O 1; S dyad P O 2 1 left', 'P and O are at the same place'),
    ('m mirrored O A', 'joint A must be on the ground'),
    ('m mirrored O O', 'the joints that it is placed from must differ'),
    ('9 mirrored O Q', "'9' cannot name a joint"),
    ('m mirrored O X', 'joint X is not placed before'),
    ('m mirrored O', 'expected "NAME mirrored FIRST SECOND"'),
    ('A_B line A B 1; C dyad A_B Q 3 3 left; B_C dyad A Q 3 3 left',
     'its link A_B_C would have the name of another'),
    ('P' * 65 + ' ground 0 0', 'a letter, then up to 63 letters, digits and underscores')])
def test_a_wrong_line_is_refused_with_the_line_and_what_is_allowed(line, problem):
    *more, line = line.split('; ')
    shown = line if len(line) <= 60 else line[:57] + '...'
    with pytest.raises(ValueError, match=re.escape(f'joint line "{shown}": ') + '.*'
                       + re.escape(problem)):
        made(*more, line)


CHAIN = ('O ground 0 0', 'Q ground 4 0', 'A crank O 1', 'P dyad A Q 3 2.5 left',
         'R dyad P Q 2 2 left', 'S dyad R P 3 3 left', 'T dyad S R 2 2.5 right')


@pytest.mark.parametrize('lines, problem', [
    ([CHAIN[i] for i in (0, 1, 2, 4, 3, 5, 6)], 'joint P is placed later, in line 5: move it up'),
    ([CHAIN[i] for i in (0, 1, 2, 3, 4, 6, 5)], 'joint S is placed later, in line 7: move it up'),
    ((*CHAIN[:3], 'P dyad A R 2 2 left', 'R dyad Q P 2 2 left'),
     'in line 5: move it up; if it depends on P, they cannot be solved: only dyads'),
    ((*CHAIN[:3], 'P dyad A S 2 2 left', 'R dyad Q P 2 2 left', 'S rigid P R 1 1 left'),
     'joint S is placed later, in line 6: move it up; if it depends on P, they cannot be solved'),
    ((CHAIN[0], 'A crank O 1', 'M mirrored O Q'), 'M mirrored O Q": joint Q is not placed before'),
    ((*CHAIN[:3], 'P crank O 1 geared crank 2'), r'called NAME\]"$')])
def test_a_line_that_comes_too_early_or_is_too_short_says_what_to_do(lines, problem):
    assert mechanisms.create('custom', joints=CHAIN).reach()
    with pytest.raises(ValueError, match=problem):
        mechanisms.create('custom', joints=lines)


# What takes it, what is said of it, and values of other kinds.
OTHER_KINDS = [
    (lambda value: mechanisms.create('custom', joints=value),
     'joints must be a list of lines, one per joint', [
         None, [], (), '', 'O ground 0 0', 'O ground 0 0\nA crank O 1', b'O ground 0 0', 5, 0.5,
         True, {'O ground 0 0'}, frozenset(FOUR_BAR), dict.fromkeys(FOUR_BAR), len, str, object(),
         iter(()), np.array('O ground 0 0'), np.array([])]),
    (made, 'joints must be lines of text, but line 5 is', [
        None, 5, b'P ground 0 0', ['P ground 0 0'], {}, 1j, math.nan,
        np.array(['P', 'ground', '0', '0']), 10 ** 5000]),
    (lambda value: mechanisms.create('custom', joints=FOUR_BAR, tracer=value, **LENGTHS),
     'tracer must be the name of a joint, got', [
         3, [], ['B'], {}, b'B', 0.5, True, False, object(), ('B',)]),
    (lambda value: mechanisms.design('custom', FOUR_BAR, None, value),
     'dimensions must be a list|cannot name a dimension', [
         5, None, [None], [5], [['g']], [b'g'], 'g h'])]


@pytest.mark.parametrize('ask, problem, values', OTHER_KINDS, ids=range(4))
def test_what_is_of_another_kind_is_refused(ask, problem, values):
    for value in values:
        with pytest.raises(ValueError, match=problem):
            ask(value)


@pytest.mark.parametrize('kind', [list, tuple, iter, np.array, lambda lines: map(str, lines)])
def test_lines_may_come_in_any_order_keeping_kind(kind):
    assert mechanisms.create('custom', joints=kind(FOUR_BAR), **LENGTHS).points == tuple('OQAB')


def test_the_last_joint_is_traced_unless_another_is_named():
    assert made().tracer == 'B'
    assert mechanisms.create('custom', joints=FOUR_BAR, tracer='A', **LENGTHS).tracer == 'A'


@pytest.mark.parametrize('number, value', [
    ('g', 4.0), ('2*m', 2.0), ('g-m/2', 3.5), ('-(g+m)*2', -10.0), ('max(m,b)', 3.0),
    ('1.5e-2', 0.015), ('g/m/2', 2.0), ('--m', 1.0), ('pi', math.pi),
    ('m-pi/2', 1.0 - math.pi / 2), ('sqrt(2)', math.sqrt(2)), ('sqrt(g*g+b*b)', 5.0),
    ('sqrt(max(m,g))', 2.0), ('.5', 0.5),
    ('max(max(m,g),-max(b,c))', 4.0), ('2.*m', 2.0), ('1E2', 100.0), ('2*-m', -2.0), ('-0', 0.0),
    ('b-b', 0.0), ('(((g)))', 4.0), ('+'.join(['m', 'g'] * 250), 1250.0),
    ('(' * 4000 + 'g' + ')' * 4000, 4.0), ('1e-70*1e70', 1.0)])
def test_a_number_is_arithmetic_on_dimensions(number, value):
    assert made(f'P ground {number} 0').solve(0.0, ('P',))['P'].tolist() == [value, 0.0]


def arithmetic(rng, depth):
    """Return arithmetic at random, that Python's own grammar reads as well."""
    if not depth or rng.random() < 0.15:
        return rng.choice(('g', 'm', 'b', 'c', 'pi', '2', '0.5', '1e-3', '.25', '3.'))
    one, two = (arithmetic(rng, depth - 1) for _ in range(2))
    return rng.choice((f'{one}+{two}', f'{one}-{two}', f'{one}*{two}', f'{one}/{two}', f'-{one}',
                       f'({one})', f'({one}-{two})', f'max({one},{two})', f'sqrt({one})'))


@pytest.mark.parametrize('count', [
    10, pytest.param(40, marks=pytest.mark.nightly), pytest.param(400, marks=pytest.mark.nightly)])
def test_arithmetic_is_what_python_makes_of_the_same_letters(count):
    rng, tried = random.Random(5), 0
    known = {**LENGTHS, 'pi': math.pi, 'sqrt': math.sqrt, 'max': max}
    for _ in range(count):
        number = arithmetic(rng, 5)
        try:
            value = eval(number, known)
        except (ValueError, ZeroDivisionError):
            with pytest.raises(ValueError, match='joint line "P ground'):
                made(f'P ground {number} 0')
            continue
        place = made(f'P ground {number} 0').solve(0.0, ('P',))['P'][0]
        assert place == pytest.approx(value, rel=1e-13, abs=1e-13), number
        tried += 1
    assert 0.5 * count < tried < count


@pytest.mark.parametrize('angle, rad', [
    ('30deg', math.radians(30)), ('-12.5deg', math.radians(-12.5)), ('90deg', math.pi / 2),
    ('pi/2', math.pi / 2), ('-pi', -math.pi), ('2*pi', 2 * math.pi), ('450deg', math.pi / 2),
    ('(m+29)deg', math.radians(30)), ('pi/2-30deg', math.radians(60)), ('6.2832', 6.2832),
    ('p', 0.7), ('(p)deg', math.radians(0.7)), ('p*pi/180', math.radians(0.7)), ('p/2-m', -0.65)])
def test_an_angle_is_in_rad_or_in_degrees(angle, rad):
    linkage = made(f'P slider A b+c Q {angle} out', 'S line A B p', p=0.7)
    place = linkage.solve(0.4)
    along = place['P'] - place['Q']
    assert math.sin(math.atan2(along[1], along[0]) - rad) == pytest.approx(0.0, abs=1e-14)
    assert np.dot(place['P'] - place['A'], (math.cos(rad), math.sin(rad))) > 0.0


def test_a_dimension_that_is_an_angle_is_not_more_than_a_turn_either():
    linkage = made('P slider A b Q p out', p=6.0)
    for angle in (90.0, -7.0, np.array([0.0, 7.0])):
        with pytest.raises(ValueError, match=re.escape('in degrees it is written (p)deg')):
            linkage.with_dimensions(p=angle)


@pytest.mark.parametrize('unit', [2.0 ** -90, 2.0 ** 90])
def test_lengths_that_grow_with_the_dimensions_are_right_at_any_size(unit):
    lines = ('P ground g*b/c sqrt(m*g)', 'R slider A sqrt(b*b+c*c) Q m/g out',
             'S line A B max(0,b-c)/2', 'T slider A b+c Q pi/2*(m/g) in')
    place, scaled = (made(*lines, **{name: length * size for name, length in LENGTHS.items()})
                     .solve(0.7) for size in (1.0, unit))
    for joint, where in place.items():
        np.testing.assert_array_equal(scaled[joint], where * unit, joint)


@pytest.mark.parametrize('name', ['pi', 'max', 'sqrt', 'deg', '', ' ', 'g ', 'a.b', '_a', '2a',
                                  '\u03bb', '\uff47', 'a' * 65, 'a\n', 'a-b', '[m]'])
def test_some_names_are_not_for_dimensions(name):
    with pytest.raises(ValueError, match='cannot name a dimension'):
        made(**{name: 1.0})
    with pytest.raises(ValueError, match='cannot name a dimension'):
        scene.read(four_bar_scene(**{f'f.dimensions.{name}': 1.0}))


@pytest.mark.parametrize('name', ['tracer', 'joints', 'branches'])
def test_what_create_takes_is_no_dimension(name):
    given = four_bar_scene(**{f'f.dimensions.{name}': 1.0})
    with pytest.raises(scene.SceneError, match=f"'{name}' cannot name a dimension"):
        scene.read({**given, 'f.joints': [*FOUR_BAR, f'P ground {name} 0']})
    with pytest.raises(ValueError, match=f"'{name}' cannot name a dimension"):
        made(f'P ground {name} 0')


def test_any_other_name_is_for_a_dimension():
    for name in ('lambda', 'type_', 'inf', 'nan', 'e', 'x', 'None', 'a' * 64, 'maximum', 'pi2'):
        assert made(f'P ground {name} 0', **{name: 2.5}).solve(0.0)['P'][0] == 2.5


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


@pytest.mark.parametrize('value', [
    None, '1', b'1', bytearray(b'3'), True, 1j,
    [1j], ['1', '2'], [None, 1.0], [True, False], {}, {1.0}, {'a': 1.0}, [[1.0], [1.0, 2.0]], [],
    [[]], object(), len, np.array([1.0, 'a'], object), iter([1.0]),
    np.datetime64('2026-01-01'), np.array(1j), [[[]]] * 3, slice(1), 10 ** 400, [10 ** 400],
    HUGE, math.nan, math.inf, -math.inf, [1.0, math.nan], -1.0, 0, [1.0, 0.0], 1e301, 1e-301])
def test_a_dimension_is_a_number_or_an_array_of_numbers(value):
    for create in (lambda: made(b=value), lambda: mechanisms.create('four_bar', b=value)):
        with pytest.raises(ValueError, match='dimension b must .*, got ') as said:
            create()
        assert len(str(said.value)) < 600


@pytest.mark.parametrize('value', [3, 3.0, Fraction(3), np.float32(3), np.int8(3), np.array(3),
                                   np.float64(3)])
def test_any_number_is_a_dimension(value):
    np.testing.assert_array_equal(made(b=value).solve(0.5)['B'], made(b=3.0).solve(0.5)['B'])


@pytest.mark.parametrize('branches', [
    'B', ['B'], [('B', 1)], 5, {'B'}, ('B', 1), True, object(), b'B', {'B': 'x'}, {'B': '1'},
    {'B': None}, {'B': 0}, {'B': 2}, {'B': 0.5}, {'B': math.nan}, {'B': 1j}, {'B': [1]}, {'B': {}},
    {'B': True}, {'B': np.array([1, 1])}, {'B': np.array(['x'])}, {'B': 10 ** 5000}, {5: 1},
    {None: 1}, {('B',): 1}, {'b': 1}, {'A': 1}, {'B ': 1}])
@pytest.mark.parametrize('kind', ['custom', 'four_bar'])
def test_branches_are_a_sign_for_some_joints(kind, branches):
    own = {'joints': FOUR_BAR, **LENGTHS} if kind == 'custom' else {}
    with pytest.raises(ValueError, match=r'must be \+1 or -1|has no branch|must be a mapping'):
        mechanisms.create(kind, branches=branches, **own)


@pytest.mark.parametrize('sign', [-1, -1.0, np.int64(-1), np.float32(-1)])
def test_any_minus_one_is_the_other_sign(sign):
    assert made(branches={'B': sign}).branches == {'B': -1}


@pytest.mark.parametrize('kind', [None, 5, [], {}, set(), ['custom'], b'custom', True, 1j,
                                  object(), np.array(['custom', 'jansen']), HUGE, 'Jansen', ''])
def test_a_type_is_one_of_the_catalogue_or_custom(kind):
    for ask in (mechanisms.create, mechanisms.design, mechanisms.defaults):
        with pytest.raises(ValueError, match='type .*; allowed: water_drop, jansen') as said:
            ask(kind)
        assert len(str(said.value)) < 600


def four_bar_scene(**more):
    """Return the parameters of a scene with a four-bar."""
    return {'mechanisms': ['f'], 'f.type': 'custom', 'f.joints': list(FOUR_BAR),
            **{f'f.dimensions.{name}': length for name, length in LENGTHS.items()}, **more}


# What a text may be taken for; the names of Python's own arguments are no dimensions of the last.
ROLES = {
    'line': made,
    'first line': lambda text: made(lines=(text,)),
    'joint': lambda text: made(f'{text} ground 0 0'),
    'joint before': lambda text: made(f'P dyad A {text} 3 3 left'),
    'number': lambda text: made(f'P ground {text} 0'),
    'length': lambda text: made(f'P crank O {text}'),
    'angle': lambda text: made(f'P slider A 3 Q {text} out'),
    'side': lambda text: made(f'P dyad A Q 3 3 {text}'),
    'joints': lambda text: mechanisms.create('custom', joints=text, **LENGTHS),
    'dimension': lambda text: mechanisms.design('custom', (*FOUR_BAR, f'P ground {text} 0'), None,
                                                (*LENGTHS, text)),
    'value': lambda text: made(b=text),
    'tracer': lambda text: mechanisms.create('custom', joints=FOUR_BAR, tracer=text, **LENGTHS),
    'branch': lambda text: made(branches={text: 1}),
    'sign': lambda text: made(branches={'B': text}),
    'type': mechanisms.create, 'design': mechanisms.design, 'defaults': mechanisms.defaults,
    'scene': lambda text: scene.read({'mechanisms': [text]}),
    'parameter': lambda text: scene.read(four_bar_scene(**{f'f.{text}': 1.0})),
    'type in a scene': lambda text: scene.read({'mechanisms': ['f'], 'f.type': text}),
    'line in a scene': lambda text: scene.read(four_bar_scene(**{'f.joints': [*FOUR_BAR, text]})),
    'points in a scene': lambda text: scene.read(four_bar_scene(**{'f.points': [text]}))}


OUTPUTS = {
    'solve': lambda text: BAR.solve(0.5, (text,)), 'one point': lambda text: BAR.solve(0.5, text),
    'of an array': lambda text: BAR.solve([0.5], [text]),
    'velocity': lambda text: BAR.velocity(0.5, (text,)),
    'angle of a joint': lambda text: BAR.joint_angles(0.5, (text,)),
    'rate': lambda text: BAR.joint_rates(0.5, (text,)),
    'transmission': lambda text: BAR.transmission_angles(0.5, (text,)),
    'function': lambda text: BAR.function((text,)),
    'crank angle': lambda text: BAR.input_for(text, 0.5),
    'changed dimension': lambda text: BAR.with_dimensions(**{text: 1.0}),
    'changed value': lambda text: BAR.with_dimensions(b=text)}
BAR = made()
# Where texts are read letter by letter.
PARSED = ('line', 'number', 'length', 'angle')


def refused(ask, text) -> bool:
    """Return whether a text is refused, as it has to be: soon, and in a short sentence."""
    try:
        with few_calls(500_000, text[:60]):
            ask(text)
        return False
    except ValueError as error:
        said, kind = str(error), type(error)
    assert kind in (ValueError, scene.SceneError), (kind, text[:60])
    assert 10 < len(said) < 600 and said.isprintable(), (text[:60], said)
    return True


@pytest.mark.filterwarnings('error')
@pytest.mark.nightly(all_but=4)
@pytest.mark.parametrize('role, every', [
    *((role, 2 if role in PARSED else 10) for role in (*ROLES, *OUTPUTS)),
    *(pytest.param(role, 1, marks=pytest.mark.nightly) for role in (*ROLES, *OUTPUTS))])
def test_a_hostile_text_is_refused_in_a_short_sentence(role, every):
    texts = TEXTS[::every]
    assert len(texts) >= 600 // every
    kept = [text for text in texts if not refused({**ROLES, **OUTPUTS}[role], text)]
    assert len(kept) < 0.1 * len(texts) and all(len(text) < 20000 for text in kept)
    if role in PARSED:
        assert len(kept) < 10, kept


@pytest.mark.parametrize('role, legal', [
    ('number', ['1e-400']), ('angle', ['1e-400', '30deg']), ('length', [])])
def test_of_odd_numbers_hardly_one_is_a_number(role, legal):
    assert [text for text in NUMBERS if not refused(ROLES[role], text)] == legal


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('count, seed', [
    (200, 1), pytest.param(60000, 2, marks=pytest.mark.nightly),
    pytest.param(60000, 3, marks=pytest.mark.nightly)])
def test_a_line_with_slips_is_refused_or_makes_a_linkage(count, seed):
    outcomes = [refused(made, text) for text in mutations(count, seed)]
    assert 0.5 < sum(outcomes) / count < 0.98


@pytest.mark.parametrize('names', [5, 0.5, True, object(), len, [5], [['A']], ({},), {'a': 'A'},
                                   HUGE, [None], (None,), [b'A'], b'A'])
def test_points_and_joints_are_names(names):
    for ask in (BAR.solve, BAR.velocity, BAR.joint_angles, BAR.joint_rates,
                BAR.transmission_angles, lambda _, names: BAR.function(names),
                lambda _, names: BAR.input_for(names, 0.5)):
        with pytest.raises(ValueError, match='must be a name or a list|custom has no') as e:
            ask(0.5, names)
        assert len(str(e.value)) < 600


def test_one_point_is_one_name_to_a_function_as_well():
    linkage = made('AB line A B 1')
    assert linkage.function('AB')(0.5) == linkage.function(('AB',))(0.5)


def test_an_input_has_the_name_that_its_line_gives_it():
    lines = ('O ground 0 0', 'Q ground 3 0', 'A crank O 1 called motor', 'B dyad A Q 3 2.5 left',
             'C line Q B 4', 'D crank Q 1 up geared motor -2 0.5 called fan', 'E crank O 0.5')
    linkage = mechanisms.create('custom', joints=lines)
    assert [input_.name for input_ in linkage.inputs] == ['motor', 'crank']
    angles = linkage.joint_angles([0.3, 0.7])
    assert (angles['motor'], angles['crank']) == (0.3, 0.7)
    assert angles['fan'] == pytest.approx(-0.1)
    usual = mechanisms.create('custom', joints=[
        line.replace(' called motor', '').replace(' called fan', '').replace('geared motor', (
            'geared crank')) for line in lines])
    for name, place in linkage.solve([0.3, 0.7]).items():
        assert (place == usual.solve([0.3, 0.7])[name]).all()
    mirrored = custom('O ground 0 0', 'H ground 0 1', 'P ground 1 0',
                      'B cylinder P O 1 left called ram', 'X mirrored O H')
    assert [input_.name for input_ in mirrored.inputs] == ['ram']
    place = mirrored.solve(1.2)
    assert place['BX'] == pytest.approx(place['B'] * (-1.0, 1.0))


@pytest.mark.parametrize('line, reason', [
    ('A crank O 1 called', 'expected'), ('A crank O 1 called 1st', 'cannot name an input'),
    ('A crank O 1 called dimensions', 'but not ground, dimensions, branches'),
    ('A crank O 1 called QB', 'its link QB would have the name of another'),
    ('P dyad O Q 2 2 left; A cylinder Q O 4 left called QP', 'its link QP would have the name'),
    ('A dyad O Q 3 3 left called x', 'expected')])
def test_an_input_cannot_have_any_name(line, reason):
    with pytest.raises(ValueError, match=reason):
        custom('O ground 0 0', 'Q ground 3 0', *line.split('; '), 'B dyad A Q 3 2.5 left',
               'C crank O 2')


# --- images in a mirror line: every joint is where the mirror shows it ---

# One of every construction, by two inputs; the mirror line O-H is askew and joints lie on it.
ALL = ('O ground 0 0', 'H ground 1 2', 'C carriage O along H 0.1 0.6', 'K ground 1 0',
       'Q ground 1.5 -0.3', 'A crank K 0.2', 'B dyad A Q 0.7 0.6 left',
       'T rigid B Q 0.5 0.6 right', 'I line Q B 0.9', 'S slider B 0.9 Q 0.3 out',
       'U block S 0.1 0.2', 'L slot Q A 0.05 out 1.0', 'E crank A 0.1 zero K', 'M mirror K A Q',
       'P parallelogram Q B T', 'N antiparallelogram Q B I', 'R V W inversor Q A 1.5 0.6',
       'G line K Q 0.3', 'F cylinder K G 0.4 left geared carriage 1 0', 'm mirrored O H')


def seen(places, first='O', second='H'):
    """Return each place as it is seen in the mirror line, as complex numbers."""
    at = {name: complex(*place) for name, place in places.items()}
    along = (at[second] - at[first]) / abs(at[second] - at[first])
    return at, {name: at[first] + along ** 2 * (place - at[first]).conjugate()
                for name, place in at.items()}


@pytest.mark.parametrize('up, others', [('', ''), (' up', ''), ('', 'BSLF')])
def test_every_construction_has_its_image(up, others):
    lines = [line + up if line == 'A crank K 0.2' else line for line in ALL]
    drawn = mechanisms.design('custom', lines).branches
    assert [*drawn] == ['B', 'S', 'L', 'F']
    linkage = custom(*lines, branches={name: -drawn[name] for name in others})
    assert [input_.name for input_ in linkage.inputs] == ['carriage', 'crank', 'crank2']
    count = 0
    for values in np.random.default_rng(3).uniform((0.15, -3.0, -3.0), (0.55, 3.0, 3.0), (40, 3)):
        places, images = seen(linkage.solve(values.tolist()))
        for name, image in images.items():
            if f'{name}m' in places:
                assert np.isnan(image) == np.isnan(places[f'{name}m'])
                assert np.isnan(image) or abs(image - places[f'{name}m']) < 1e-13
                count += not np.isnan(image)
    assert count > 400 and 'Om' not in linkage.points and 'Cm' not in linkage.points


def test_an_image_may_be_mirrored_again():
    linkage = custom('O ground 0 0', 'H ground 1 0', 'V ground 0 1', 'K ground 2 1',
                     'A crank K 0.5 up', 'x mirrored O H', 'y mirrored O V')
    place = {name: complex(*at) for name, at in linkage.solve(0.4).items()}
    assert place['Ax'] == pytest.approx(place['A'].conjugate())
    assert place['Ay'] == pytest.approx(-place['A'].conjugate())
    assert place['Axy'] == pytest.approx(-place['A'])


@pytest.mark.nightly(all_but=8)
@pytest.mark.parametrize('zero', ['', ' up', ' zero Z'])
@pytest.mark.parametrize('ground', ['0.6 0', '0 0.6', '-0.48 0.36', '0.36 -0.48', '-0.6 0'])
@pytest.mark.parametrize('line', ['B dyad A Q 0.6 0.2 left', 'B dyad A Q 0.9 0.5 right',
                                  'B slider A 0.2 O 0.4 out', 'B slider A 0.2 O 90deg in'])
def test_an_image_passes_change_points_as_what_it_shows_does(line, ground, zero):
    linkage = custom('O ground 0 0', 'Z ground 0.1 -0.2', f'Q ground {ground}',
                     f'A crank O 0.2{zero}', line, 'y1 ground 0.3 0.1', 'y2 ground 0.5 0.9',
                     'm mirrored y1 y2')
    for crank in np.linspace(-3.1, 3.1, 13):
        places, images = seen(linkage.solve(crank), 'y1', 'y2')
        near = 1e-14 * max(map(abs, places.values()))
        assert all(abs(images[name[:-1]] - place) < near for name, place in places.items()
                   if name.endswith('m'))
