# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What a scene may be, what it says about one that cannot be, and how its cranks move. No ROS."""

import itertools
import math
import re
from xml.etree import ElementTree

from effort import few_calls
from linkage_ros import mechanisms, scene
from linkage_ros.robot_model import urdf
from linkage_ros.scene import slider, writing
from linkage_ros.scene.joint_names import quoted_name
from linkage_ros.scene.legs import LegGroup
from linkage_ros.scene.motion import Motion
import numpy as np
import pytest
from pytest import approx
from scenes import alone, BOOM, custom, EXAMPLES, G1, ROOT, scene_file

OWN = {'mechanisms': ['own'], 'own.type': 'custom'}
YEAR = 365 * 86400 * 10 ** 9


def test_without_parameters_the_scene_is_the_catalogue():
    shown = scene.read({}).mechanisms
    assert [(name, mechanism.scale) for name, mechanism in shown.items()] == [
        ('water_drop', 0.1), ('jansen', 0.005), ('peaucellier', 0.1), ('slotted_lever', 0.002)]
    for name, mechanism in shown.items():
        assert mechanism.linkage.type == name
        assert mechanism.linkage.dimensions == mechanisms.defaults(name)
        assert mechanism.first.speed == 1.0 and mechanism.first.start == 0.0
    assert scene.read({}).rate == 50.0
    # A parameter of the client library is none of the scene's business.
    assert scene.read({'use_sim_time': True}).parameters == scene.read({}).parameters


def rewritten(before, folder):
    """Return the values with which a scene is written, and the scene that is read of them."""
    values = writing.without_defaults(before)
    return values, scene.load(str(scene_file(folder, values)))


@pytest.mark.nightly(all_but=4)
@pytest.mark.parametrize('file', EXAMPLES)
def test_a_scene_is_written_as_the_few_values_that_tell_it(file, tmp_path):
    before = scene.load(str(file))
    values, again = rewritten(before, tmp_path)
    assert again.parameters == before.parameters
    usual = [p.name for p in before.parameters if p.name in values and p.value == p.default]
    assert all('.dimensions.' in name or name.rpartition('.')[2] in ('mechanisms', 'type', 'scale')
               for name in usual)


def test_names_that_ros_takes_for_values_are_written_as_texts_and_empty_lists_not(tmp_path):
    before = scene.read({'mechanisms': ['y', 'nan', 'Inf', 'on'], 'frame_id': '1e5', **{
        f'{name}.type': 'klann' for name in ('y', 'nan', 'Inf', 'on')},
        'y.frame_id': '08', 'nan.frame_id': '0x1F', 'nan.crank.source': '1_0'})
    assert 'loads' not in writing.in_yaml({'y.joint_names': [], 'y.loads': (), 'rate': 1.0})
    assert rewritten(before, tmp_path)[1].parameters == before.parameters


@pytest.mark.parametrize('name', ['my thigh', 'Hüfte', 'toe 1/2 "left" <a&b>', "o'k: #3", '大腿',
                                  100 * 'w'])
def test_a_frame_is_called_as_links_of_robots_are(tmp_path, name):
    before = scene.read({'mechanisms': ['jansen'], 'frame_id': name, 'jansen.frame_id': name})
    _, again = rewritten(before, tmp_path)
    assert (again.frame_id, again.mechanisms['jansen'].frame_id) == (name, name)
    root = ElementTree.fromstring(urdf.describe(again.mechanisms.values(), name))
    assert root.find('joint/parent').get('link') == root.find('link').get('name') == name


def test_a_branch_is_an_assembly_sign_and_0_the_usual_one():
    assert alone('jansen', branches__E=0, branches__F=-1).linkage.branches == {
        'C': 1, 'E': -1, 'F': -1}


def test_only_more_than_one_pair_is_mirrored_by_default():
    for settings, mirrored in (({}, False), ({'leg_pairs': 2}, True), ({'mirrored': True}, True),
                               ({'leg_pairs': 3, 'mirrored': False}, False)):
        assert alone('jansen', **settings).mirrored == mirrored


@pytest.mark.parametrize('parameters, named', [
    ({'mechanisms': []}, 'mechanisms must be'),
    ({'mechanisms': ['jansen', 'jansen']}, 'mechanisms must be .* each once'),
    ({'mechanisms': ['two words']}, 'mechanisms must be .* letters'),
    ({'mechanisms': ['a__b'], 'a__b.type': 'jansen'}, 'mechanisms must be'),
    ({'mechanisms': 'jansen'}, 'mechanisms must be a list'),
    ({'mechanisms': ['leg'], 'leg.type': 'camel'}, "leg.type must be .* one of .*, not 'camel'"),
    ({'jansen.dimensions.m': -1.0}, r'jansen.dimensions.m must be .* above 0 \[m\], not -1.0'),
    ({'jansen.dimensions.m': True}, 'jansen.dimensions.m must be'),
    ({'jansen.dimensions.m': math.nan}, 'jansen.dimensions.m must be a finite'),
    ({'jansen.dimensions.m': 500.0}, 'jansen.dimensions must let the jansen be assembled'),
    ({**OWN, 'own.joints': ['O ground 0 0', 'Q ground 4 0', 'A crank O 1', 'B dyad A Q 1 2 left']},
     'own.joints must let the custom be assembled at some angle$'),
    ({'jansen.dimensions.q': 1.0}, 'jansen.dimensions.q is not a .* jansen.dimensions.a, '),
    ({'jansen.dimension.a': 1.0}, 'jansen.dimension.a is not a parameter .* jansen.dimensions.a'),
    ({'jansen': None}, 'jansen is not a parameter .* jansen.type'),
    ({'leg.type': 'jansen'}, r'leg.type is not a parameter .* mechanisms, .* jansen\.\*'),
    ({'jansen.branches.C': 2}, 'jansen.branches.C must be .* -1 to 1, not 2'),
    ({'jansen.branches.C': 1.0}, 'jansen.branches.C must be a whole number'),
    ({'jansen.leg_pairs': 0}, 'jansen.leg_pairs must be a whole number from 1 to 50,'),
    ({'jansen.leg_pairs': 10 ** 400}, 'jansen.leg_pairs must be a whole number from 1 to'),
    ({'jansen.crank.start': 13.0}, r'jansen.crank.start must be .* to 12.5664 \[rad\],'),
    ({'water_drop.leg_pairs': 2}, 'water_drop.leg_pairs must be 1 and mirrored false: only'),
    ({'water_drop.mirrored': True}, 'water_drop.leg_pairs must be 1 and mirrored false: only'),
    ({'jansen.points': ['G', 'Z']}, 'jansen.points must be .* some of O, .* G'),
    ({'jansen.points': ['G', 'G']}, 'jansen.points must be .* each once'),
    ({'jansen.pose': [0.0] * 5}, 'jansen.pose must be .* six'),
    ({'jansen.pose': [math.nan] * 6}, 'jansen.pose must be .* finite'),
    ({'jansen.crank.speed': 101.0}, 'jansen.crank.speed must be .* from -100 to 100'),
    ({'jansen.crank.sweep': [1.0]}, 'jansen.crank.sweep must be .* lower end and the higher end'),
    ({'jansen.crank.sweep': [1e16, 1e16 + 8.0]}, r'jansen.crank.sweep must be .* within 1e\+06'),
    *[({'peaucellier.crank.sweep': sweep},
       r'peaucellier.crank.sweep must be inside the reach \[-1.17137, 1.17137\] rad')
      for sweep in ([-1.2, 1.0], [-1.0, 1.2])],
    ({'rate': -1.0}, 'rate must be .* from 0 to 1000'),
    ({'rate': 10 ** 5000}, 'rate must be .* from 0 to 1000'),
    ({'qos_overrides./crank_states.publisher.depth': 5}, 'qos_overrides.* is not a parameter'),
    ({'frame_id': 3}, 'frame_id must be a text'),
    *[({'frame_id': text}, 'frame_id must be a text .* 1 to 100 characters') for text in (
        '', ' ', '/world', ' world', 'world\n', 'w\0', '\t', '-x', 'w' * 101, 'w' * 10 ** 6,
        '<world/>', 'w\u200bw', '\u2028', 'w\u2028', 'w\x85', 'w\ud800')],
    ({'frame_prefix': '/left'}, 'frame_prefix must be a text .* up to 100 characters'),
    ({'jansen.frame_id': 'my\nthigh'}, 'jansen.frame_id must be a text .* up to 100 characters'),
    *[({'jansen.joint_names': [text]}, 'jansen.joint_names must be .* one of crank') for text in (
        '', 'BC', 'BC=', '=shin', 'BC=3', 'BC=left shin', 'ZZ=shin', 'left0_BC=shin', 'BC=shin+',
        'BC=""', 'BC="', 'BC="shin', 'BC="sh"in"', r'BC="\x"',
        'BC=shin+x', 'BC=shin+1+1', 'BC==shin', 'BC=--shin', 'BC=' + 'x' * 900 + '!')],
    ({'jansen.joint_names': ['BC=a', 'BC=b']},
     "jansen.joint_names must be .* different one .*'BC=b'"),
    ({'jansen.joint_names': ['BC=knee', 'EF=-knee']}, '.* jansen.EF are both knee'),
    ({'jansen.joint_names': ['BC=water_drop_CB']}, '.* water_drop.CB and jansen.BC are both '),
    ({'mechanisms': ['leg', 'leg_left0'], 'leg.type': 'jansen', 'leg.leg_pairs': 2,
      'leg_left0.type': 'jansen'}, 'leg_left0.joint_names must give .* both leg_left0_BC'),
    ({'jansen.only_named': 1}, 'jansen.only_named must be true or false'),
    ({'mechanisms': ['j' * 65]}, 'mechanisms must be .* up to 64 letters'),
    ({'jansen.' + 'q' * 10 ** 6: 1.0}, 'jansen.qqq.* is not a parameter of the scene'),
    ({'mechanisms': ['custom']}, 'custom.joints: joints must be a list of lines'),
    ({**OWN, 'own.joints': ['A crunk O 1']},
     r".* unknown construction 'crunk'; did you mean crank\?$"),
    ({'jansen.Crank.speed': 1.0}, r'.*; did you mean jansen.crank.speed\?$'),
    ({'jansen.joint_names': ['BCC=left_shin']}, r'.*; did you mean BC\?$'),
    ({'jansen.loads': ['EFF=2.5']}, r'.*; did you mean EF\?$'),
    ({'mechanisms': ['own'], 'own.type': 'rods', 'own.joints': [
        'pitch hinge ground at 0 0 0 axis 0 1 0', 'roll hinge pich at 0 0 0 axis 1 0 0']},
     r'.*; did you mean pitch\?.*'),
    ({'mechanisms': ['own'], 'own.type': 'rods', 'own.joints': G1, 'own.loads': ['R_roll=1 -2']},
     "own.loads: the load of R_roll must have the components x, y, z, not 'R_roll=1 -2'"),
    ({**OWN, 'own.joints': ['Base ground 0 0', 'A crank base 1']}, r'.*; did you mean Base\?$'),
    *[({**OWN, 'own.joints': [*joints, 'A crank O 1'], 'own.mirrored': True},
       'own.leg_pairs must be 1 and mirrored false: only')
      for joints in (['O ground 0 0', 'B crank O 1'], ['O ground 1 0'])],
    ({'jansen.joints': ['O ground 0 0']}, 'jansen.joints is not a parameter')])
def test_a_wrong_parameter_is_named_with_what_is_allowed(parameters, named):
    with pytest.raises(scene.SceneError, match='^' + named) as refused:
        scene.read(parameters)
    assert '\n' not in str(refused.value) and len(str(refused.value)) < 600


def test_joints_bear_a_robots_own_names_signs_and_zeros():
    lines = ['crank=hip', 'left0_BC=-left-knee', 'right1_EF=-ankle.2-1.5e-1']
    joints = alone('jansen', 'jansen', leg_pairs=2, only_named=True, joint_names=lines).joints
    named = {joint: called for joint, called in joints.items() if called.published}
    assert named == {'crank': ('hip', 1.0, 0.0, True, False),
                     'left0_BC': ('left-knee', -1.0, 0.0, True, False),
                     'right1_EF': ('ankle.2', -1.0, -0.15, True, True)}
    assert joints['left1_BC'].name == 'jansen_left1_BC' and len(joints) == 1 + 4 * 6
    # A length is not wrapped.
    piston = alone('slider_crank', joint_names=['block=-piston+9']).joints['block']
    assert piston.of(3.5) == 5.5


@pytest.mark.parametrize('name', [
    'finger-1', '3', 'left knee', 'a"b', "a'b", 'a\\', 'jy\n/crank_driver: {}', 'Hüfte', '-a+1',
    ' ', '\u2028', 'a=b', '#'])
def test_any_name_of_a_joint_can_be_quoted(name):
    line = f'BC=-{quoted_name(name)}+1'
    joints = scene.read({'jansen.joint_names': [line]}).mechanisms['jansen'].joints
    assert joints['BC'] == (name, -1.0, 1.0, True, True)


def test_of_a_thousand_mechanisms_only_one_that_changes_is_read_again():
    names = [f'leg{i}' for i in range(1000)]
    before = scene.read({'mechanisms': names, **{f'{name}.type': 'jansen' for name in names}})
    values = {'leg7.dimensions.m': 14.9, 'leg8.scale': 1.0, 'rate': 9.0}
    with few_calls(100_000):
        after = scene.changed(before, values)
    assert {name for name in names
            if after.mechanisms[name] is not before.mechanisms[name]} == {'leg7'}
    assert [p.name for p in after.changed_from(before)] == ['rate', 'leg7.dimensions.m']


def test_a_crank_swings_in_the_arc_that_its_start_is_in():
    stiff = alone('peaucellier', dimensions__r=10.0)
    first, second = stiff.first.reach
    middle = 0.5 * (second[0] + second[1])
    assert stiff.first.sweep[1] < first[1]
    crank = alone('peaucellier', dimensions__r=10.0, crank__start=middle - math.tau).first
    assert second[0] < crank.sweep[0] < middle < crank.sweep[1] < second[1]


@pytest.mark.parametrize('text, reason', [
    ('', 'scene.yaml must be YAML with'), ('{}', 'scene.yaml must be YAML with'),
    ('mechanisms: [jansen]', 'ros__parameters below the name of a node, .* is expected in line 1'),
    ('/**: 3', 'ros__parameters below the name of a node, .* is expected in line 1'),
    ('ros__parameters: {rate: 5.0}', 'ros__parameters must be below the name of a node'),
    ('/**:\n  ros__parameters: {rate: }', 'a value is missing in line 2'),
    ('/**: {', 'not a valid ROS parameter file: .*did not find expected .*line 2, '),
    ('[1]', 'ros__parameters below the name of a node, .* is expected in line 1'),
    ('/**:\n  ros__parameters:\n    rate: 1.0\n    rate: fast',
     "'?rate'? is given twice in line 4"),
    ('/**:\n  ros__parameters:\n    jansen.scale: 1.0\n    jansen: {scale: 1.0}',
     "'?jansen.scale'? is given twice in line 4"),
    ('/**:\n  ros__parameters:\n    rate: 1.0\n    rate: {of: 1}',
     'rate.of is not a parameter of the scene')])
def test_a_file_that_is_no_scene_says_so(tmp_path, text, reason):
    pytest.importorskip('yaml')
    path = tmp_path / 'scene.yaml'
    path.write_text(text)
    with pytest.raises(scene.SceneError, match=reason):
        scene.load(path)


TYPES = {type_: {'mechanisms': [type_]} for type_ in mechanisms.TYPES}
SMALL = {'mechanisms': ['leg'], 'leg.type': 'jansen',
         **{f'leg.dimensions.{key}': 1e-3 * value
            for key, value in mechanisms.defaults('jansen').items()}}
SIGNED = {**OWN, 'own.joints': ['O ground 0 0', 'Q ground 4.0 h', 'A crank O 1', 'P line O A v',
                                'B dyad A Q r 3 left'],
          'own.dimensions.h': 0.0, 'own.dimensions.r': 2.5, 'own.dimensions.v': -0.3}
SWEPT = {**SIGNED, 'own.dimensions.r': 3.0, 'own.crank.sweep': [-0.5, 0.5]}


@pytest.mark.nightly(all_but=3)
@pytest.mark.parametrize('parameters', [
    *TYPES.values(), SMALL, SIGNED, SWEPT, {'jansen.scale': 5e-324}, {'jansen.scale': 1e308}],
                         ids=[*TYPES, 'small', 'signed', 'swept', 'least', 'most'])
def test_every_slider_has_its_value_between_finite_ends(parameters):
    numbers = [(mechanism, p) for mechanism in scene.read(parameters).mechanisms.values()
               for p in mechanism.parameters if p.field.kind == 'double']
    for mechanism, parameter in numbers:
        low, high = slider.ends(mechanism, parameter)
        assert low < high and low <= parameter.value <= high or 'scale' in parameter.name
        assert math.isfinite(low) and math.isfinite(high)
    assert len(numbers) > 3


@pytest.mark.parametrize('name, parameters, ends', [
    *((name, {'crank.ratio': ratio}, approx(ends, abs=close)) for ratio in (-2.0, 1.0)
      for name, ends, close in (('crank.ratio', sorted((0.1 * ratio, 10.1 * ratio)), 0.2),
                                ('crank.offset', (-math.pi, math.pi), 0.1))),
    # A stroke of 8 m is about two turns.
    ('cylinder.offset', {'joints': [*SIGNED['own.joints'], 'E cylinder Q O 8 left']},
     approx((-4.0 * math.pi, 4.0 * math.pi))),
    # Grashof: with bars 1, r, 3 and a base of 4 the crank turns where r is from 2 to 6.
    ('dimensions.r', {'dimensions.r': 3.0}, approx((2.1, 5.9), abs=0.1)),
    # In this sweep a tenth of it will do.
    ('dimensions.r', {'dimensions.r': 3.0, 'crank.sweep': [-0.5, 0.5]}, approx((0.3, 6), abs=0.2)),
    # What nothing limits is changed by nine times itself.
    ('dimensions.v', {}, approx((-3.0, 2.4), abs=0.06)),
    # Beyond 1 the length is no number.
    ('dimensions.v', {'dimensions.v': 0.5, 'joints': [
        line.replace('line O A v', 'line O A sqrt(1-v)') for line in SIGNED['own.joints']]},
     (approx(-4.0), approx(0.95, abs=0.05)))])
def test_a_slider_goes_as_far_as_makes_sense(name, parameters, ends):
    mechanism, = scene.read({**SIGNED, **{
        f'own.{key}': value for key, value in parameters.items()}}).mechanisms.values()
    parameter, = (p for p in mechanism.parameters if p.name == f'own.{name}')
    assert slider.ends(mechanism, parameter) == ends


ACTUATED = {**OWN, 'own.dimensions.h': 0.0, 'own.dimensions.c': 2.0, 'own.joints': [
    'O ground 0 0', 'P ground 1 h', 'B cylinder P O 1.5 left', 'C crank O c called tilt']}


def test_every_parameter_says_what_it_is_of_with_its_unit():
    for each in (*scene.read(ACTUATED).parameters, *scene.read({}).parameters):
        field, (name, _, key) = each.field, each.name[4:].partition('.')
        assert field.meaning.endswith('.') and '{' not in field.meaning + field.unit
        if field.kind == 'double':
            units = ''.join(re.findall(r'\[(.*?)\]', field.meaning))
            assert field.unit == units.replace('1', ''), each.name
        if name in ('cylinder', 'tilt'):
            unit = {'cylinder': 'm', 'tilt': 'rad'}[name] + '/s' * (key == 'speed')
            assert name in field.meaning and field.unit in (unit, '')
        assert key not in ('h', 'c', 'B') or f' {key} of the custom' in field.meaning


def test_the_nodes_that_use_a_parameter_are_those_of_the_page():
    page = (ROOT / 'docs' / 'nodes-and-topics.md').read_text()
    rows = re.findall(r'^\| (`.*) \| (.*) \| (.*) \|$', page.partition(
        '### Who owns a value')[2].partition('\n## ')[0], re.M)
    every = ('crank_driver', 'kinematics', 'servo_inverse')
    written = {name: (set(every if nodes == 'all nodes' else re.findall(
        r'`(\w+)`', nodes.partition('(')[0])), change.startswith('restart'))
        for names, nodes, change in rows for name in re.findall(r'`(\w+)`', names)}
    declared = {}
    for each in (*scene.read(ACTUATED).parameters, *scene.read({}).parameters):
        name = each.name.split('.')
        key = name[1] if name[1:2] in (['dimensions'], ['branches']) else name[-1]
        # A walker of one leg at most is no other while a node runs.
        still = key in ('leg_pairs', 'mirrored') and name[0] not in ('jansen', 'peaucellier')
        declared.setdefault(key, (set(each.field.readers), each.field.read_only and not still))
        assert each.field.owner in each.field.readers
        assert each.field.owner == scene.KINEMATICS or scene.KINEMATICS not in each.field.readers
        assert each.field.read_only == (written[key][1] or still), each.name
    assert declared == written


def test_scenes_of_the_same_values_are_equal_however_they_are_written():
    few, all_ = scene.read({}), scene.read({'frame_id': 'world', 'jansen.scale': 0.005,
                                            'jansen.leg_pairs': 1, 'jansen.dimensions.m': 15})
    for name in few.mechanisms:
        one, other = few.mechanisms[name], all_.mechanisms[name]
        assert one == other and repr(one) == repr(other) and 'Parameter(' not in repr(one)
    assert few.mechanisms['jansen'] != scene.read({'jansen.scale': 0.1}).mechanisms['jansen']


@pytest.mark.parametrize('parameters, reason', [
    ({'own.tilt.ratio': 0.0}, 'of a size from 1e-30 to 1e30, not 0.0'),
    # With this, positions of the source were infinite.
    ({'own.tilt.ratio': -1e-310}, 'of a size from 1e-30 to 1e30, not -1e-310'),
    ({'own.tilt.ratio': 1e31}, 'of a size from 1e-30 to 1e30, not 1e+31'),
    ({'own.tilt.measures': 'OC'}, 'own.tilt.measures: only a linkage with one input '),
    ({'own.cylinder.sweep': [0.4, 1.0]}, 'inside the reach [0.5, 2.5] m, not [0.4, 1.0]'),
    ({'own.cylinder.sweep': [1.0, 1.0]}, 'the lower end and the higher end, '),
    ({'own.loads': ['c=1']}, "OB, barrel, cylinder, tilt, not 'c=1'; did you mean C?"),
    ({'own.loads': ['C=1 2', 'C=1 2']}, "not 'C=1 2'"),
    ({'own.loads': ['OB=1 2']}, "own.loads: the load of OB must have one number, not 'OB=1 2'"),
    *[({'own.loads': [line]}, 'must have the components x, y, ') for line in ('C=1', 'C=1 2 3')],
    ({'mechanisms': ['klann'], 'klann.crank.measures': 'ZZ'}, "has no output 'ZZ'"),
    ({'mechanisms': ['klann'], 'klann.crank.measures': 'crank.x'}, 'klann.crank.measures: '),
    ({'mechanisms': ['klann'], 'klann.crank.measures': 'distance(O,B)'}, 'does not move'),
    *[({'jansen.loads': ['BC=1'], **more}, 'jansen.loads must be empty for more than one leg')
      for more in ({'jansen.leg_pairs': 2}, {'jansen.mirrored': True})]])
def test_settings_of_inputs_and_loads_that_cannot_be_are_refused(parameters, reason):
    base = ACTUATED if any(key.startswith('own') for key in parameters) else {}
    with pytest.raises(scene.SceneError) as refused:
        scene.read({**base, **parameters})
    assert reason in str(refused.value)


def test_a_stroke_takes_three_seconds_by_default_and_its_lengths_are_scaled():
    for scale, speed in ((1.0, 0.67), (0.25, 0.17), (1000.0, 100.0)):
        made = scene.read({**ACTUATED, 'own.scale': scale}).mechanisms['own'].inputs
        stroke = made['cylinder']
        assert (stroke.speed, made['tilt'].speed) == (speed, 1.0)
        assert (stroke.input.low, stroke.input.high) == pytest.approx((0.5 * scale, 2.5 * scale))
        assert stroke.reach == ((stroke.input.low, stroke.input.high),)
        assert stroke.sweep == pytest.approx((0.52 * scale, 2.48 * scale))
        assert made['tilt'].sweep is None and stroke.ends is None
        assert made['tilt'].source == 'own_tilt' and stroke.actuator == (1.0, 0.0)
    swept = scene.read({**ACTUATED, 'own.cylinder.sweep': [1, 2], 'own.cylinder.ratio': 2.0})
    settings = swept.mechanisms['own'].inputs['cylinder']
    assert settings.sweep == settings.ends == (1.0, 2.0) and settings.actuator == (2.0, 0.0)


def test_loads_are_forces_of_joints_and_moments_of_links():
    lines = ['C=-1.5e1 +.5', 'OB=-2', 'B=0  3']
    assert scene.read({**ACTUATED, 'own.loads': lines}).mechanisms['own'].loads == {
        'C': (-15.0, 0.5), 'OB': -2.0, 'B': (0.0, 3.0)}


def test_of_many_intervals_the_first_are_named():
    assert scene.in_words([(0.0, 0.5), (1.0, 4 / 3)]) == '[0, 0.5] or [1, 1.33333]'
    many = scene.in_words((i, i + 1) for i in range(100))
    assert len(many) == 200 and many.startswith('[0, 1] or ') and many.endswith('...')


def test_a_year_of_motion_loses_nothing():
    mpmath = pytest.importorskip('mpmath')
    low, high = -0.7, 1.1
    with mpmath.workdps(60):
        width = mpmath.mpf(high) - low
        for speed, elapsed in itertools.product((1.0, 2.3, 99.9, 1e-9, -2.0 / 3.0), (
                1, 10 ** 9 + 7, YEAR + 123456789, 50 * YEAR + 987654321)):
            way = mpmath.mpf(speed) * elapsed / 10 ** 9
            angle, velocity = Motion(speed, None, 0.3, 5).at(5 + elapsed)
            assert abs(angle - (mpmath.mpf(0.3) + way) % (2 * mpmath.pi)) < 1e-15
            assert velocity == speed
            phase = (-low + way) % (2 * width)
            angle, velocity = Motion(speed, (low, high), 0.0).at(elapsed)
            assert abs(angle - (low + width - abs(width - phase))) < 1e-15
            assert velocity == (speed if phase < width else -speed)


@pytest.mark.parametrize('start', [0.0, math.tau, -1e-17, 7.0])
def test_an_angle_is_in_a_turn(start):
    motion = Motion(1e-9, None, start)
    for now in (0, *map(int, np.random.default_rng(0).integers(0, 10 ** 15, 500))):
        assert 0.0 <= motion.at(now)[0] < math.tau


@pytest.mark.parametrize('low, high', [(0.0, 5e-324), (1e-200, 2e-200), (0.5, 0.5)])
def test_a_sweep_shorter_than_a_step_stands_still(low, high):
    motion = Motion(1.0, (low, high), 0.3)
    for now in (0, 1, 10 ** 18):
        assert low <= motion.at(now)[0] <= high or motion.at(now)[0] == 0.0
        assert motion.changed(-1.0, (low, high), 1, now).at(now)[0] == motion.at(now)[0]


@pytest.mark.parametrize('sweep', [None, (-0.5, 0.25)])
@pytest.mark.parametrize('speed', [2.0, -3.0, 0.0])
def test_a_change_of_speed_makes_no_jump(sweep, speed):
    motion = Motion(1.0, sweep, 0.1)
    for now in range(0, 10 ** 10, 10 ** 9 // 3):
        angle, velocity = motion.at(now)
        after, turned = motion.changed(speed, sweep, 1, now).at(now)
        assert after == angle and turned == velocity * speed


def test_a_change_of_sweep_goes_on_the_same_way():
    motion = Motion(1.0, (-0.5, 0.25), 0.1)
    assert [motion.is_repeated(turns) for turns in (0.5, 1.0, 2.0)] == [False, True, True]
    for now in range(10 ** 8, 10 ** 10, 10 ** 9 // 3):
        wider = motion.changed(1.0, (-0.75, 0.5), 1, now)
        assert wider.at(now) == pytest.approx(motion.at(now), abs=1e-15)
        assert motion.changed(1.0, None, 1, now).at(now)[0] == pytest.approx(
            motion.at(now)[0] % math.tau)


def test_an_end_of_the_reach_is_within_it_any_turn_and_nothing_beyond_is():
    legs = LegGroup(mechanisms.create('jansen', m=30.0), 3, True)
    assert legs.is_limited
    # What wrapping rounds is some 1e-15 rad; what a leg is asked for is not.
    for turn in (-math.tau, 0.0, math.tau):
        for i, leg in enumerate(legs.legs.values()):
            for low, high in legs.reach:
                for end, outwards in ((low, -1.0), (high, 1.0)):
                    crank = leg.lag + leg.side * (end - leg.start) + turn
                    beyond = leg.side * outwards * 2e-12
                    assert legs.within_reach(crank)[i]
                    assert not legs.within_reach(crank + beyond)[i]
    boom = LegGroup(custom(*BOOM), scale=2.0)
    assert [boom.within_reach(2.0 * (end + step)) for end in boom.reach[0] for step in (
        -1e-6, 1e-6)] == [[False], [True], [True], [False]]


def test_the_locus_is_that_of_the_tracer_or_last_point_on_the_widest_arc():
    assert [alone('jansen', points=[*names]).tracer for names in ('GA', 'BA')] == ['G', 'A']
    legs = LegGroup(custom('O ground 0 0', 'Q ground 1.2 0', 'F ground 0.7 1.4', 'A crank O 0.6',
                           'B dyad A Q 1.9 0.9 left', 'C dyad B F 0.4 1.2 left'))
    _, widest = legs.reach
    assert np.angle(legs.locus('A')[[0, -1]] @ (1.0, 1j)) == approx(widest)


@pytest.mark.parametrize('turns', [True, False])
def test_a_start_is_put_where_it_is_in_the_sweep_or_at_the_nearer_end(turns):
    """An angle may be off by whole periods, a length by nothing."""
    rng, insides = np.random.default_rng(6), 0
    for _ in range(200):
        period, low, width = int(rng.integers(1, 4)), rng.uniform(-30.0, 30.0), rng.uniform(0.1, 5)
        start, high = rng.uniform(-60.0, 60.0), low + width
        same = start + math.tau * period * np.arange(-30, 31) * turns
        inside = same[(low <= same) & (same <= high)]
        ends = min((abs(each - end), end) for each in same for end in (low, high))[1]
        expected = inside if len(inside) else [ends]
        value, speed = Motion(0.5, (low, high), start, 9, turns, period).at(9)
        assert min(abs(value - each) for each in expected) < 1e-12
        insides += len(inside) > 0
    assert 1 < insides < 180
