# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Linkages as C: compiled without a warning, and solved to the same numbers as in Python."""

import ctypes
from functools import cache
import math
import re
import shutil
import subprocess

from c_libraries import COMPILER, inverters, loaded, shared, STRICT
from linkage_ros import mechanisms, scene
from linkage_ros.c_code import cli, header, series
import numpy as np
import pytest
from scenes import alone, BOOM, ROOT

pytestmark = pytest.mark.skipif(not COMPILER, reason='there is no C compiler')

# What there is, each at a size of its own, and what a word drives, carries or ties.
SCENE = {
    'mechanisms': [*mechanisms.TYPES, 'boom', 'rack', 'bent', 'cam'],
    **{f'{name}.type': name for name in mechanisms.TYPES}, 'jansen.scale': 0.01,
    'slotted_lever.scale': 1e-3, 'boom.type': 'custom', 'boom.scale': 2.0,
    'boom.joints': [*BOOM, 'C rigid O B 2 1.4 left'],
    'rack.type': 'custom', 'rack.joints': [
        'O ground 0 0', 'R ground 1 0', 'A carriage O along R 0 2', 'Q ground 0 1',
        'B dyad A Q 0.9 0.6 left'],
    'bent.type': 'custom', 'bent.joints': [
        'O ground 0 0', 'A crank O 0.4', 'B crank A 0.3 zero O', 'C rigid A B 0.2 0.4 left'],
    # It has a reach in two parts.
    'cam.type': 'custom', 'cam.joints': [
        'O ground 0 0', 'Q ground 2 0', 'A crank O 1.0', 'B dyad A Q 0.4 1.8 left']}
# Outputs with an inverse, and linkages that have them in the library of poses, too.
OUTPUTS = {'slotted_lever': ('lever', 'A.x'), 'four_bar': ('QB', 'distance(O,B)'),
           'jansen': ('G.x', 'angle(A,G)'), 'whitworth': ('lever', 'block'),
           'peaucellier': ('PB',), 'slider_crank': ('block',),
           'boom': ('B.x', 'angle(O,B)')}
POSED = {name: OUTPUTS[name] for name in ('slotted_lever', 'four_bar', 'boom')}
CALLER = """
int {name}_posed(const {number} *q, {name}_pose *p)
{{
    return {name}_solve({given}, 1, p, p + 1);
}}
"""


def fields(mechanism):
    """Return the outputs that are the fields of a mechanism's pose in C."""
    linkage = mechanism.linkage
    return list(dict.fromkeys([*(f'{joint}.{axis}' for joint in linkage.points for axis in 'xy'),
                               *linkage.joints, *POSED.get(mechanism.name, ())]))


def compiled(folder, mechanisms, single=False):
    """Return a library with the poses and rates of mechanisms."""
    text = header.printed([header.Request(mechanism, POSED.get(mechanism.name, ()))
                           for mechanism in mechanisms], single)
    for mechanism in mechanisms:
        text += CALLER.format(
            name=mechanism.name, number='float' if single else 'double',
            given=', '.join(f'q[{k}]' for k in range(len(mechanism.inputs))))
    return loaded(folder, text)


def solved(library, mechanism, inputs, kind=np.float64):
    """Return what C makes of inputs (poses, n): pose and rates, and whether all is assembled."""
    arguments = np.ascontiguousarray(inputs, kind)
    out = np.zeros((len(inputs), len(fields(mechanism)) * (inputs.shape[1] + 1)), kind)
    return out, [library[f'{mechanism.name}_posed'](*(ctypes.c_void_p(x.ctypes.data) for x in row))
                 for row in zip(arguments, out)]


def expected(mechanism, inputs):
    """Return the same from Python, one pose after the other."""
    linkage, names = mechanism.linkage, fields(mechanism)
    solve = linkage.function(linkage.points, names[2 * len(linkage.points):], names)
    units = [mechanism.scale_of(input_.name) for input_ in linkage.inputs]
    sizes = np.array([mechanism.scale_of(name) for name in names])
    rows = np.array([solve(*(np.array(row) / units).tolist()) for row in inputs])
    return rows * np.concatenate([sizes, *(sizes / unit for unit in units)])


def values(mechanism, count):
    """Return inputs all over and beyond the reach, next to its ends, and no number."""
    rng, rows = np.random.default_rng(1), []
    for settings in mechanism.inputs.values():
        input_, reach = settings.input, np.ravel(settings.reach)
        low, high = (-9.0, 9.0) if input_.is_angle else (input_.low, min(input_.high, 4.0))
        ends = np.add.outer([0.0, 1e-9, 1e-6, -1e-9, -1e-6], np.concatenate([
            reach, reach + 3 * input_.is_angle * input_.turn])).ravel()[:count]
        rows.append([*ends, *rng.uniform(low - 0.1, high + 0.1, count - len(ends) - 1), math.nan])
    return np.column_stack(rows)


@pytest.mark.parametrize('name, count', [*((name, 50) for name in SCENE['mechanisms']), *(
    pytest.param(name, 100_000, marks=pytest.mark.nightly)
    for name in ('jansen', 'slotted_lever'))])
def test_poses_and_rates_are_those_of_python(library, mechanisms, name, count):
    mechanism = mechanisms[name]
    inputs = values(mechanism, count)
    (results, whole), poses = solved(library, mechanism, inputs), expected(mechanism, inputs)
    assert whole == np.isfinite(poses[:, :len(fields(mechanism))]).all(axis=1).tolist()
    np.testing.assert_allclose(results, poses, rtol=1e-15, atol=0.0)


@pytest.mark.parametrize('name, single, lines', [
    ('boom', True, [
        'boom: custom, written by linkage_ros.', 'Input: cylinder [m]. Angles [rad] count',
        'Lengths [m], times 2: those of the joint lines.', 'const float x0 = 0.5f * cylinder_;',
        'It can be assembled in [1.12297, 3.27703] m.']),
    ('cam', False, [
        'It can be assembled in [-1.53079, -0.707483] or [0.707483, 1.53079] rad.',
        '/* Actuators: cam_crank [rad]; joints: cam_QB [rad], see ']),
    # Its inverse has two assembly modes, of which the reach has one.
    ('whitworth', False, ['A call takes at most 3 poses.']),
    ('five_bar', False, [
        'Lengths [m]: a = 0.09, b = 0.09, c = 0.09, d = 0.09, f = 0.118.',
        '/* Actuators: five_bar_crank [rad], five_bar_crank2 [rad]; '
        'joints: five_bar_crank [rad], five_bar_AP [rad], see '])])
def test_a_header_says_what_it_has(mechanisms, name, single, lines):
    text = header.written(mechanisms[name], OUTPUTS.get(name, ())[:1], single)
    assert [line for line in lines if line not in text] == []
    # Without a reach, which several inputs do not have, it says nothing of it.
    assert ('It can be assembled' in text) == (name != 'five_bar')


ENDING = ['O ground 0 0', 'Q ground 2 0', 'A crank O 1.5', 'B dyad A Q 1 1 left',
          'C rigid A B 0.6 0.8 left']
END = mechanisms.create('custom', joints=ENDING).reach()[0][1]
MOTOR = ['O ground 0 0', 'M crank O 0.01']
NEAR_ENDS = np.array([0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.1])
# A linkage, an output, inputs or parts of the reach, values next to which C is asked for them, or
# parts of the reach from them, and the error that an end allows.
INVERSES = [
    *(({key.removeprefix(f'{name}.'): value for key, value in SCENE.items()
        if key.startswith(f'{name}.')}, output, {})
      for name, outputs in OUTPUTS.items() for output in outputs),
    ('slotted_lever', 'lever', {'nears': [math.tau * 100, math.tau * 10_000]}),
    # A sweep is for the actuator alone.
    ({'type': 'slotted_lever', 'crank.sweep': [-0.4, 0.4]}, 'lever',
     {'inputs': [1.0], 'nears': [0.5, 1.5]}),
    # At an end of the reach an output changes infinitely fast, which is no excuse for an error.
    (ENDING, 'C.y', {'inputs': [END, END - 1e-12, END - 1e-9, END - 1e-6],
                     'nears': [END, END - 1e-3, END + 1.0], 'close': 2e-8}),
    # An angle that turns by more than half a turn from one extreme to the other, where it changes
    # eleven times as fast as the input.
    (['O ground 0 0', 'Q ground 0.5 0.25', 'A crank O 0.8',
      'D crank Q 0.288 geared crank 0.5 0.96', 'B dyad A D 2.05 2.54 left'], 'angle(A,B)',
     {'inputs': [6.151306541], 'nears': [6.52, 6.2, 6.15, 5.0], 'close': 3e-14}),
    # Halfway it hardly changes.
    ('watt', 'P.x', {'inputs': [0.0273, -0.0464, 0.0642], 'nears': [0.5, -0.4]}),
    # A series of a length, in a scene of another scale.
    ({'type': 'custom', 'scale': 2.0, 'joints': [
        'O ground 0 0', 'Q ground 0 1.4', 'C cylinder Q O 1.0157 right', 'R ground 2 0.3',
        'D dyad C R 1.5 1.1 left', 'E rigid C D 0.7 0.8 left']}, 'E.y', {'close': 1e-13}),
    # It has modes that no single pose shows.
    (['A ground 0 0', 'B ground 0 1.4', 'C cylinder B A 1.0157 right',
      'D E F inversor B C 1.2375 0.3369'], 'DE', {'parts': np.linspace(0.02, 0.98, 41)}),
    # The motor of a slow and of a fast gear goes on in its turn.
    *(([*MOTOR, f'A crank O 1 geared crank {ratio} 0'], 'A.x', {
        'inputs': [0.4, 83.0, 83.0 + 320.0 * math.pi], 'beside': [1e-3], 'close': 1e-10})
      for ratio in ('1/80', '40')),
    *(({'type': kind, f'dimensions.{key}': factor * mechanisms.create(kind).dimensions[key]},
       output, {'parts': [*NEAR_ENDS, *(1.0 - NEAR_ENDS)], 'beside': [0.0, 0.1], 'close': 1e-7})
      for kind, key, factor, output in (('jansen', 'k', 0.8, 'G.x'), ('klann', 'i', 0.8, 'CF')))]


@pytest.fixture(scope='module')
def inverses(tmp_path_factory):
    """Return the mechanisms of INVERSES, each with its inverse in C, and that of a five-bar."""
    made = [alone(linkage, f'm{i}') for i, (linkage, *_) in enumerate(INVERSES)]
    asked = [(mechanism, [output]) for mechanism, (_, output, _) in zip(made, INVERSES)]
    five_bar = alone('five_bar')
    with shared(tmp_path_factory, 'inverses') as folder:
        *found, several = inverters(folder, [*asked, (five_bar, ['P.x', 'P.y'])])
    return [*zip(made, found)], (five_bar, several)


@pytest.mark.parametrize('i', range(len(INVERSES)))
def test_the_inverse_finds_the_nearest_input(inverses, i):
    _, output, given = INVERSES[i]
    check_nearest(*inverses[0][i], output, **given)


def check_nearest(mechanism, invert, output, inputs=None, nears=None, beside=None, close=2e-14,
                  parts=None):
    """Check that C finds inputs of an output, and none that is farther away than Python's."""
    linkage, settings, rng = mechanism.linkage, mechanism.first, np.random.default_rng(2)
    unit, size = mechanism.scale_of(settings.input.name), mechanism.scale_of(output)
    low, high = settings.ends or settings.reach[0]
    inputs = inputs or np.clip(low + (high - low) * np.array(
        rng.uniform(size=12) if parts is None else parts), low, high)
    turn = settings.input.is_angle * math.tau
    beside = beside or rng.uniform(-0.3, 0.3, 2) * (high - low) + turn * rng.integers(-3, 4, 2)
    counts = []

    def out(inputs):
        return linkage.joint_angles(np.divide(inputs, unit), [output])[output]

    for theta in inputs:
        # Between two floats there may be no input that has the value exactly.
        value = out([theta, np.nextafter(theta, 0.5 * (low + high))]).mean()
        for near in nears or theta + np.array(beside):
            answer, poses = invert(value * size, near)
            counts.append(poses)
            best = linkage.input_for(output, value, near / unit) * unit
            assert abs(answer - near) == pytest.approx(abs(best - near), abs=1e-6)
            errors = out(answer * (1.0 + 2e-16 * np.arange(-4, 5))) - value
            errors -= linkage.is_angle(output) * math.tau * np.round(errors / math.tau)
            assert size * np.nanmin(np.abs(errors)) <= close * max(1.0, size * linkage.longest)
    # Away from ends a closed form is checked, and so is a series: neither is corrected.
    assert parts is not None or close > 2e-14 or max(counts) == 1
    for value in (1e3, -1e3, math.nan, math.inf):
        assert linkage.is_angle(output) and math.isfinite(value) or not invert(value, 0.0)[0]


def test_several_inputs_are_found_for_as_many_outputs(mechanisms, inverses):
    five_bar, invert = inverses[1]
    linkage, rng = five_bar.linkage, np.random.default_rng(5)
    for _ in range(100):
        near, place = rng.uniform(-2.0, 2.0, 2), rng.uniform(-0.1, 0.2, 2)
        answers, (pose, _) = linkage.inverse(['P.x', 'P.y']).all(place, near), invert(place, near)
        assert (pose is not None) == bool(answers)
        if answers:
            distances = [np.abs(np.array(answer.inputs) - near).sum() for answer in answers]
            assert np.abs(pose - near).sum() == pytest.approx(min(distances), abs=1e-8)
            np.testing.assert_allclose(linkage.solve(pose, ['P'])['P'], place, atol=1e-14)
    # Without a closed form a search may miss.
    with pytest.raises(ValueError, match='bent have no inverse in closed form'):
        header.written(mechanisms['bent'], ('C.x', 'angle(O,C)'))


@pytest.mark.nightly
def test_a_part_of_neighbouring_values_is_a_series_of_numbers():
    linkage = mechanisms.create('jansen')
    value = linkage.solve(1.0)['G'][0]
    part = [1.0, 1.0 + 1e-9, value, np.nextafter(value, math.inf)]
    assert np.isfinite(series.series(linkage, 'G.x', np.array([part]), False)).all()


@pytest.mark.parametrize('line, outputs, problem', [
    # It goes up and down a thousand times.
    ('A crank O 1 geared crank 1000 0', ['A.x'], 'no inverse: .* a series of more than 10000 '),
    # A dyad on the ground that is too short, which with one input has no reach.
    ('A crank O 1; Q ground 9 0; B dyad O Q 1 2 left', (), 'm cannot be assembled')])
def test_what_has_no_c_is_refused(line, outputs, problem):
    with pytest.raises(ValueError, match=problem):
        header.written(alone([*MOTOR, *line.split('; ')]), outputs, single=True)


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('name', ['slotted_lever', 'boom', *(
    name for name in mechanisms.TYPES if name not in ('slotted_lever', 'five_bar'))])
def test_single_precision_is_as_good_as_the_page_says(mechanisms, tmp_path, name):
    mechanism, rng = mechanisms[name], np.random.default_rng(3)
    (low, high), = mechanism.first.reach
    edge, points = 0.01 * (high - low), 2 * len(mechanism.linkage.points)
    inputs = rng.uniform(low + edge, high - edge, (300, 1)).astype(np.float32)
    rows, _ = solved(compiled(tmp_path, [mechanism], single=True), mechanism, inputs, np.float32)
    exact, size = expected(mechanism, inputs.astype(float)), mechanism.scale
    assert np.abs(rows[:, :points] - exact[:, :points]).max() < (
        1e-6 * size * mechanism.linkage.longest)
    # So are angles and rates.
    np.testing.assert_allclose(rows[:, points:], exact[:, points:], rtol=1e-3, atol=1e-3)


def test_the_sketch_has_the_header_of_its_scene():
    sketch = ROOT / 'examples' / 'hobby_servo'
    text = (sketch / 'lever.h').read_text()
    called = set(re.findall(r'\b(?:lever|lkr)_\w+', (sketch / 'hobby_servo.ino').read_text()))
    assert called and called <= set(re.findall(r'\w+', text))
    mechanism, = scene.load(str(sketch / 'lever.yaml')).mechanisms.values()
    assert text == header.written(mechanism, ['lever'], single=True) + '\n'


def test_a_scene_file_is_printed_as_c(capsys):
    path = ROOT / 'config' / 'all.yaml'
    mechanisms, both = scene.load(path).mechanisms, ['--mechanism', 'peaucellier', 'slotted_lever']
    assert cli.main([str(path), *both, '--output', 'crank', '--float', '--joints',
                     'peaucellier_PB', 'slotted_lever_lever']) == 0
    printed = capsys.readouterr().out
    assert printed == header.printed([header.Request(mechanisms[name], ['crank'], [joint])
                                      for name, joint in (
        ('peaucellier', 'peaucellier_PB'), ('slotted_lever', 'slotted_lever_lever'))], True) + '\n'
    assert printed.count('\n#define LINKAGE_ROS_LINKAGE_H\n') == 1


@cache
def named(number):
    """Return the headers of linkages with any names and loads."""
    base, bars = ['O ground 0 0', 'Q ground 1 0'], [
        'A crank O 0.3', 'B dyad A Q 1 0.6 left', 'C rigid A B 0.6 0.6 left']
    lines = {
        **dict.fromkeys(('Arm', 'arm', 'ARM', 'linkage', 'LKR', 'Lkr'), [
            'Arm crank O 0.3', 'Tip dyad Arm Q 1 0.6 left']),
        'rail': ['slide carriage O along Q 0 2 called x', 'P ground 0 1',
                 'B dyad slide P 0.9 0.6 left'],
        **{f'm{i}': [f'A crank O 0.3 called {name}'] for i, name in enumerate((
            'q', 'p', 'near', 'value', 'x0', 'new', 'for', 'sin', 'double', 'NAN', 'linux'))}}
    loads = {'l0': ['B=0 -9.81'], 'l1': ['B=3 0', 'A=0 1', 'QB=0'],
             'l2': ['C=1 2', 'AB=-0.0', 'B=0 0']}
    parameters = {'mechanisms': [*lines, *loads]}
    for name in parameters['mechanisms']:
        parameters |= {f'{name}.type': 'custom', f'{name}.joints': [*base, *lines.get(name, bars)],
                       f'{name}.loads': loads.get(name, [])}
    outputs = {'Arm': ['Arm_Tip', 'angle(Arm,Tip)', 'Arm_Tip'], 'm0': ['q'], 'm1': ['A.x'],
               'l0': ['QB'], 'l1': ['B.y'], 'l2': ['C.x']}
    text = header.printed([header.Request(mechanism, outputs.get(name, ())) for name, mechanism
                           in scene.read(parameters).mechanisms.items()], number == 'float')
    assert ' Arm_for_angle_Arm_Tip_2 =' in text and 'slide_x_2;' in text
    return text


@pytest.mark.parametrize('number', ['double', pytest.param('float', marks=pytest.mark.nightly)])
@pytest.mark.parametrize('compiler, language', [pytest.param(
    compiler, language, marks=pytest.mark.skipif(
        not shutil.which(compiler), reason=f'{compiler} is not installed'))
    for compiler, language in (('gcc', 'c99'), ('g++', 'c++17'), ('clang', 'c99'),
                               ('clang++', 'c++17'), ('tcc', 'c99'))])
def test_names_and_loads_compile_without_a_warning(tmp_path, number, compiler, language):
    # A compiler does not warn of what a header that is included does not use.
    (tmp_path / 'names.h').write_text(named(number))
    (tmp_path / 'code.c').write_text('#include "names.h"\nint main(void) { return 0; }\n')
    ended = subprocess.run([
        compiler, *(['-c', '-o', tmp_path / 'code.o'] if compiler == 'tcc' else [
            '-fsyntax-only', '-x', language.rstrip('179')]),
        f'-std={language}', *STRICT, tmp_path / 'code.c'], capture_output=True, text=True)
    assert not ended.returncode, ended.stderr[:2000]


@pytest.mark.nightly
@pytest.mark.skipif(not shutil.which('clang-tidy') or not shutil.which('cppcheck'),
                    reason='clang-tidy or cppcheck is not installed')
def test_linters_find_nothing():
    ended = subprocess.run([ROOT / '.ci' / 'ctidy'], capture_output=True, text=True)
    assert ended.returncode == 0, ended.stdout + ended.stderr


@pytest.mark.parametrize('arguments, reason', [
    (['all', '--mechanism', 'arm'], "there is no mechanism 'arm'; allowed: water_drop"),
    (['all', '--mechanism', 'jansen', '--output', 'arm'], 'jansen has no'),
    (['excavator', '--output', 'C.x'], 'excavator has 3 inputs: as many outputs are needed, '),
    (['nowhere'], 'No such file'),
    ([], 'the following arguments are required: SCENE')])
def test_what_cannot_be_is_one_sentence(capsys, arguments, reason):
    scenes = [str(ROOT / 'config' / f'{arguments[0]}.yaml')] if arguments else []
    assert cli.main(scenes + arguments[1:]) == 1
    printed = capsys.readouterr().err
    assert printed.startswith('c_code: ') and printed.count('\n') == 1 and reason in printed
