# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Actuators to joints and back, in C and as transmissions of ros2_control.

ros2_control is not on the Python package index: what is generated is compiled against a stand-in
of its interface, `test/ros2_control`, written for these tests. No controller manager is run.
"""

import math
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
from xml.etree import ElementTree

from c_libraries import counted, expected, loaded, outputs, prove, shared, STAND_IN
from c_memories import compiled, memories, Memory, UNWRITTEN
from linkage_ros import mechanisms, scene
from linkage_ros.c_code import header, transmission
from linkage_ros.c_code.axes import joints
from linkage_ros.c_code.package import package
import numpy as np
import pytest
from scenes import alone, BOOM, custom, DRAG, G1, LIFT, ROOT, scene_file, SLOT

COMPILERS = [pytest.param(name, marks=pytest.mark.skipif(
    not shutil.which(name), reason=f'{name} is not installed')) for name in ('g++', 'clang++')]
SCENES = [*sorted((ROOT / 'config').glob('*.yaml')), ROOT / 'examples' / 'leg.yaml']

# All that a scene may say of actuators and joints.
SCENE = {
    'mechanisms': ['lever', 'leg', 'boom', 'lift', 'rocker', 'beast', 'rack', 'int', 'foot',
                   'sled', 'hip'],
    'lever.type': 'slotted_lever', 'lever.scale': 1e-3, 'lever.crank.source': 'servo',
    'lever.crank.ratio': -0.5, 'lever.crank.offset': 0.3, 'lever.crank.sweep': [-0.4, 0.4],
    'lever.joint_names': ['lever=-flap+0.1'],
    'lever.loads': ['L=0 -9.81', 'lever=0.02', 'slide=0.03'],
    'leg.type': 'five_bar', 'leg.crank.start': 1.9, 'leg.crank2.start': 1.24,
    'leg.crank.ratio': 0.1, 'leg.crank2.offset': -0.2,
    'leg.loads': ['P=3 -20', 'AP=0.5', 'CP=-0.7'],
    # A joint that does not depend on the first input.
    'hip.type': 'five_bar', 'hip.crank.start': 1.9, 'hip.crank2.start': 1.24,
    'hip.joint_names': ['crank2=hip_motor', 'CP=hip_knee'],
    'boom.type': 'custom', 'boom.scale': 2.0,
    'boom.joints': [*BOOM, 'C rigid O B 2 1.4 left'],
    'boom.cylinder.ratio': 0.001, 'boom.loads': ['C=0 -100'],
    'lift.type': 'custom', 'lift.joints': LIFT,
    'lift.crank.measures': 'QB', 'lift.crank.ratio': -2.0, 'lift.crank.start': 0.5,
    'lift.crank.sweep': [0.2, 2.2],
    'rocker.type': 'four_bar', 'rocker.crank.start': 1.0, 'rocker.loads': ['P=1 2'],
    'beast.type': 'jansen', 'beast.leg_pairs': 3,
    'rack.type': 'custom', 'rack.scale': 0.5, 'rack.carriage.ratio': -0.25, 'rack.joints': [
        'O ground 0 0', 'R ground 1 0', 'A carriage O along R 0.1 0.7', 'Q ground 0 1',
        'B dyad A Q 0.9 0.6 left'], 'rack.loads': ['B=2 -5'],
    'foot.type': 'rods', 'foot.right.sweep': [-0.25, 0.25], 'foot.left.sweep': [-0.2, 0.2],
    'foot.joints': G1,
    'foot.loads': ['L_roll=1 2 -30', 'roll=2.0'],
    # One joint counts an input that has another size than 1, and the other depends on both.
    'sled.type': 'custom', 'sled.only_named': True,
    'sled.joint_names': ['carriage=sledge', 'DB=arm+0.2'], 'sled.joints': [
        'O ground 0 0', 'R ground 1 0', 'D carriage O along R 3 9', 'Q ground 5 4',
        'E crank Q 2', 'B dyad D E 6 5 left'],
    'int.type': 'four_bar', 'int.crank.source': 'a*/ "b"\\ ??/\n%s é',
    'int.joint_names': ['QB=while/1:x']}
GEARED = ['O ground 0 0', 'Q ground 1.49 -0.6', 'A crank O 0.427',
          'D crank Q 0.27 geared crank -2 0', 'B dyad A D 2.661 2.4 left']


def states(mechanism, count, seed=1):
    """Return values of all inputs in the scene's units that can be assembled, not at the ends."""
    rng, states_ = np.random.default_rng(seed), []
    while len(states_) < count:
        own = []
        for settings in mechanism.inputs.values():
            low, high = settings.ends or settings.reach[0]
            own.append(rng.uniform(low + 0.02 * (high - low), high - 0.02 * (high - low)))
        values = outputs(mechanism, own, [each.output for each in joints(mechanism)])
        if np.isfinite(values).all():
            states_.append(own)
    return states_


@pytest.mark.parametrize('name', SCENE['mechanisms'])
def test_both_ways_are_those_of_the_scene(library, mechanisms, name):
    mechanism = mechanisms[name]
    n, memory = len(mechanism.inputs), Memory(library, mechanism)
    for inputs in states(mechanism, 20):
        actuator, by, joint, turning = expected(mechanism, inputs)
        speeds, torques = np.arange(1.0, n + 1.0), np.arange(2.0, n + 2.0)
        loads = np.array(mechanism.efforts(inputs)) if mechanism.loads else np.zeros(n)
        if np.linalg.cond(by) > 1e3 or np.linalg.cond(turning) > 1e3:
            continue
        status, (position, velocity, effort) = memory.send(0, actuator, by @ speeds, torques)
        assert status == 0
        # Joints that pass half a turn from zero are reported in one range.
        joint = joint + math.tau * np.round((position - joint) / math.tau)
        np.testing.assert_allclose(position, joint, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(velocity, turning @ speeds, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(
            effort, np.linalg.solve(turning.T, by.T @ torques - loads), rtol=1e-9)
        status, (position, velocity, held) = memory.send(1, joint, turning @ speeds)
        assert status == 0
        np.testing.assert_allclose(position, actuator, rtol=1e-9, atol=1e-11)
        np.testing.assert_allclose(velocity, by @ speeds, rtol=1e-9)
        np.testing.assert_allclose(held, np.linalg.solve(by.T, loads), rtol=1e-9, atol=1e-12)


def test_what_is_not_assembled_is_out_of_reach_whatever_is_commanded(tmp_path):
    mechanism = alone([
        'O ground 0 0', 'A crank O 1', 'Q ground 2 0', 'B dyad A Q 1.1 1 left',
        'R ground 1 1.7', 'C dyad A R 1 1 left', 'S ground 1.9 0.3', 'D dyad A S 0.7 0.6 left'])
    memory = Memory(compiled(tmp_path, [mechanism], 'm_QB'), mechanism)
    angles = np.linspace(-1.5, 2.5, 81)
    assembled = [np.isfinite(list(mechanism.linkage.solve(angle).values())).all()
                 for angle in angles]
    assert [memory.send(0, [angle])[0] & 1 == 0 for angle in angles] == assembled
    # The joint of the first bars is farther in reach, on both sides.
    (low, high), = mechanism.first.reach
    own = angles[np.isfinite(mechanism.linkage.joint_angles(angles, ['B.x'])['B.x'])]
    assert own[0] < low - 0.1 and own[-1] > high + 0.1


READING, TOP = custom(*LIFT).joint_angles([0.5, -2.5])['QB'] - (0.1, 0.0)
CHOICES = [
    # A geared joint counts turns both ways, and so does an encoder on it.
    (GEARED, {}, [], 1, [(value, -0.5 * value) for value in (1.0, -6.4, -7.0, -20.0)]),
    (GEARED, {}, [], 0, [(40.0, -80.0)]),
    (GEARED, {'crank.measures': 'crank2'}, ['crank'], 0, [(-20.0, 10.0), (1e4, -5e3)]),
    # An offset of its own changes nothing of that.
    (GEARED, {'joint_names': ['crank2=wheel+0.5']}, ['wheel'], 1, [(1.0, -0.25), (-30, 15.25)]),
    (GEARED, {'joint_names': ['crank2=wheel+0.5']}, ['wheel'], 0, [(-2.0, 4.5)]),
    ([*GEARED[:3], 'D crank Q 0.27 geared crank -2 -1.4', GEARED[4]], {}, [], 1,
     [(-2.0 * crank - 1.4, crank) for crank in (0.4, -6.4)]),
    # What does not count turns is within one with its offset.
    (LIFT, {'joint_names': ['QB=wheel+3.0']}, ['wheel'], 0,
     [(0.5, math.remainder(READING + 3.1, math.tau))]),
    # If it passes half a turn, it goes on there.
    *((LIFT, {'joint_names': [f'QB={sign}0.8']}, ['wheel'], 0, [(-2.5, side * (TOP + 0.8))])
      for sign, side in (('wheel+', 1.0), ('-wheel-', -1.0))),
    # A sensor repeats after a turn of what it measures; a geared one counts turns.
    *((LIFT, {'crank.measures': 'QB', 'crank.ratio': ratio, 'crank.offset': 0.1,
              'crank.start': 0.5}, ['crank'], 0,
       [((READING + turns * math.tau) / ratio, 0.5) for turns in (0, 1, -1, 3, -100)])
      for ratio in (-2.0, 0.25)),
    *((GEARED, {'crank.measures': 'crank2', 'crank.ratio': ratio}, ['crank'], side,
       [((-2.0 * crank / ratio, crank), (crank, -2.0 * crank / ratio))[side]
        for crank in (0.4, 7.0, -300.0)]) for ratio in (-2.0, 0.25) for side in (0, 1)),
    # A command is answered within the sweep, though another answer is nearer.
    (SLOT, {'crank.start': -0.2, 'crank.sweep': [-0.3, 2.0]}, ['A.y'], 1,
     [(0.02 * math.cos(0.9), 0.9)]),
    (SLOT, {'crank.start': 7.0, 'crank.sweep': [6.5, 8.0]}, ['A.y'], 1,
     [(0.02 * math.cos(0.9), math.tau + 0.9)]),
    # A measured link may be beyond it.
    (SLOT, {'crank.measures': 'A.y', 'crank.start': 0.5, 'crank.sweep': [0.2, 0.8]},
     ['crank'], 0, [(0.02 * math.cos(0.9), 0.9)]),
    # It cannot be commanded there, but at its ends, where Newton's method does not leave it.
    (SLOT, {'crank.start': 0.5, 'crank.sweep': [0.2, 0.8]}, ['A.y'], 1,
     [(0.02 * math.cos(0.9), None), (0.02 * math.cos(0.8), 0.8), (0.02 * math.cos(0.2), 0.2),
      (0.02 * math.cos(0.8 + 1e-14), 0.8), (0.02 * math.cos(0.8 + 1e-11), None)]),
    *((SLOT, {'crank.start': 0.5, 'crank.sweep': [0.2, end]}, ['A.y'], 1,
       [(0.02 * math.cos(end), end)]) for end in (0.6, 0.7, 0.9, 1.0, 1.1)),
    # A turn from what is nearest may be in it.
    *((DRAG, {'crank.start': 0.0, 'crank.sweep': sorted((0.0, side * 5.0))}, ['QB'], 1,
       [(custom(*DRAG).joint_angles(side * 4.5)['QB'], side * 4.5)])
      for side in (1.0, -1.0)),
    # What is beyond it by more weighs ten times.
    (SLOT, {'crank.measures': 'A.y', 'crank.start': 0.2, 'crank.sweep': [-1.0, 0.2]},
     ['crank'], 0, [(0.02 * math.cos(0.3), -0.3)])]


@pytest.fixture(scope='module')
def choosing(tmp_path_factory):
    """Return the mechanisms of CHOICES, and their library."""
    made = [alone(lines, f'm{i}', **settings) for i, (lines, settings, *_) in enumerate(CHOICES)]
    text = memories([header.Request(mechanism, (), [
        each if each == 'wheel' else f'{mechanism.name}_{each}' for each in names])
        for mechanism, (_, _, names, *_) in zip(made, CHOICES)])
    with shared(tmp_path_factory, 'choosing') as folder:
        return made, loaded(folder, text)


@pytest.mark.parametrize('i', range(len(CHOICES)))
def test_the_right_one_of_several_inputs_is_chosen(choosing, i):
    (*_, side, pairs), (made, library) = CHOICES[i], choosing
    for position, expected_ in pairs:
        status, (position_, *_) = Memory(library, made[i]).send(side, [position])
        assert status & 1 == (expected_ is None)
        assert status or position_[0] == pytest.approx(expected_, rel=1e-12, abs=1e-10)


def test_single_precision_reads_a_sensor_that_has_turned_for_long(tmp_path):
    """What is left is the rounding of what the sensor says."""
    mechanism = alone(LIFT, **{'crank.measures': 'QB', 'crank.offset': 0.1, 'crank.start': 0.5})
    memory = Memory(compiled(tmp_path, [mechanism], single=True), mechanism, np.float32)
    for angle in mechanism.linkage.joint_angles(np.linspace(0.3, 2.5, 40), ['QB'])['QB']:
        assert [memory.send(0, [angle - 0.1 + turns * math.tau])[0] & 1
                for turns in (0, -100, -3000)] == [0, 0, 0]


def test_a_motor_on_a_link_that_turns_goes_on_in_its_turn(tmp_path):
    mechanism = alone(DRAG, **{'crank.measures': 'QB'})
    memory = Memory(compiled(tmp_path, [mechanism], 'm_crank'), mechanism)
    for angle in np.linspace(13.0, -13.0, 200):
        _, (crank, *_) = memory.send(0, [angle])
        assert memory.send(1, crank + 0.01)[1][0] == pytest.approx(angle, abs=0.5)


def test_a_command_leads_back_into_the_sweep(tmp_path):
    mechanism = alone(SLOT, **{'crank.start': 0.5, 'crank.sweep': [0.2, 0.8]})
    memory = Memory(compiled(tmp_path, [mechanism], 'm_A.y'), mechanism)
    for measured in (3.0, 20.0, -300.0):
        assert memory.send(0, [measured])[0] == 0
        # It is where it may not be commanded to be, not even to stay.
        assert memory.send(1, [0.02 * math.cos(measured)])[0] == 1
        status, (crank, *_) = memory.send(1, [0.02 * math.cos(0.6)])
        assert (status, crank) == (0, pytest.approx(0.6, abs=1e-10))


def test_a_new_position_takes_one_pose(mechanisms, tmp_path):
    """Actuators count inputs, and these joints have closed forms."""
    chosen = [mechanisms[name] for name in ('leg', 'boom', 'beast', 'rocker', 'sled')]
    library = loaded(tmp_path, counted(memories([*map(header.Request, chosen)])))
    for mechanism in chosen:
        memory = Memory(library, mechanism)
        first, second, *_ = states(mechanism, 4)
        for inputs in (first, second, first):
            actuator, _, joint, _ = expected(mechanism, inputs)
            library.poses_taken()
            assert memory.send(0, actuator)[0] & 1 == 0 and library.poses_taken() == 1
            memory.send(0, expected(mechanism, second if inputs is first else first)[0])
            library.poses_taken()
            assert memory.send(1, joint)[0] & 1 == 0 and library.poses_taken() == 1


@pytest.mark.parametrize('single, step, beyond', [(False, 1e-12, 1e-11), (True, 2e-5, 5e-5)])
def test_small_steps_up_to_an_extreme_are_not_lost(tmp_path, single, step, beyond):
    linkage = mechanisms.create('slotted_lever')
    mechanism = alone('slotted_lever')
    library, kind = compiled(tmp_path, [mechanism], single=single), np.float32 if single else float

    def command(memory, value):
        status, (crank, *_) = memory.send(1, [value])
        return status & 1, crank

    memory, cranks = Memory(library, mechanism, kind), 0.3 + np.arange(1000) * step
    for crank, value in zip(cranks, linkage.joint_angles(cranks, ['lever'])['lever']):
        assert command(memory, value) == (0, pytest.approx(crank, abs=step))
    # What is hardly beyond is out of reach, there, too, where it is at the extreme already.
    for (least, _), (greatest, _) in linkage.extremes('lever'):
        for extreme, out in ((least, -beyond), (greatest, beyond)):
            for before in (0.5 * extreme, extreme - 0.1 * out):
                for part, is_out in zip((-10.0, 1000.0, 10.0, 1.0), (0, 1, 1, 1)):
                    memory = Memory(library, mechanism, kind)
                    assert command(memory, before)[0] == 0
                    assert command(memory, extreme + part * out)[0] == is_out


def test_joints_that_move_with_no_input_are_refused():
    # Two bars to joints of one link: D does not move on it.
    mechanism = alone([*LIFT, 'C rigid A B 0.6 0.6 left', 'D dyad C B 0.5 0.4 left'])
    assert [each.name for each in joints(mechanism, ['m_QB'])] == ['m_QB']
    with pytest.raises(ValueError, match='CD of m moves nowhere'):
        joints(mechanism, ['m_CD'])
    foot = scene.read({**SCENE, 'foot.joints': [line.replace('-50deg', '20deg') for line in G1]})
    with pytest.raises(ValueError, match='foot cannot be assembled in its sweep'):
        header.written(foot.mechanisms['foot'])


def test_a_joint_with_an_offset_has_the_inverse_of_its_output(mechanisms):
    text = header.written(mechanisms['lever'], ['lever'])
    assert re.findall(r'int (\w+_solutions_angle_lever\w*)\(', text) == [
        'lever_solutions_angle_lever']


def test_a_singular_pose_is_said(library, mechanisms):
    mechanism, memory = mechanisms['rocker'], Memory(library, mechanisms['rocker'])
    dead = mechanism.linkage.extremes('QB')[0][0][1]
    assert memory.send(0, [1.0], [1.0], [1.0])[0] == 0
    status, (_, velocity, effort) = memory.send(0, [dead], [1.0], [2.0])
    assert status == 2 and abs(velocity) < 1e-6 and effort == 0.0
    status, (position, velocity, _) = memory.send(1, expected(mechanism, [dead])[2], [1.0], [1.0])
    # Where it is already it stays, whatever rounding says.
    assert status == 2 and velocity == 0.0 and position == pytest.approx(dead, abs=1e-12)
    # Out of reach its velocity is zero, and none would be infinite.
    assert memory.send(1, expected(mechanism, [dead])[2] - 0.1, [1.0])[0] == 1
    # Beside it nothing is infinite yet.
    assert memory.send(0, [dead + 1e-4], [1.0], [2.0])[0] == 0
    # So is a velocity that is more than a number can be.
    boom = Memory(library, mechanisms['boom'])
    own = expected(mechanisms['boom'], states(mechanisms['boom'], 1)[0])[2]
    assert boom.send(1, own, [1.0])[0] == 0
    status, (_, velocity, _) = boom.send(1, own, [1e308])
    assert status == 2 and velocity == 0.0
    # And so is an effort.
    assert boom.send(1, own, [1.0], [1e308])[0] == 2


@pytest.mark.parametrize('side, position, code', [(1, math.nan, 4), (1, 4.0, 5), (0, 1e9, 5)])
def test_before_a_position_is_known_none_is_written(library, mechanisms, side, position, code):
    status, values = Memory(library, mechanisms['boom']).send(side, [position], [1.0], [1.0])
    assert status == code and (values[:3 if side else 1] == UNWRITTEN).all()


@pytest.mark.nightly(all_but=5)
@pytest.mark.parametrize('name', SCENE['mechanisms'])
def test_nothing_that_comes_in_gets_out_as_no_number(library, mechanisms, name):
    mechanism, rng = mechanisms[name], np.random.default_rng(4)
    n, memory = len(mechanism.inputs), Memory(library, mechanism)
    assert memory.send(0, expected(mechanism, states(mechanism, 1)[0])[0])[0] == 0
    values = [math.nan, math.inf, -math.inf, 1e308, -1e300, 5e-324, 0.0, 1.0, 1e-3, 3.0]
    for _ in range(400):
        side, given = int(rng.integers(2)), rng.choice(values, (3, n))
        status, written_ = memory.send(side, *given)
        assert 0 <= status < 8 and np.isfinite(written_).all()
        # What is not commanded is not written, and all else is.
        is_missing = ~np.isfinite(given).all(axis=1) & bool(side)
        assert ((written_ == UNWRITTEN) == is_missing[:, None]).all()


@pytest.mark.parametrize('linkage, parameters, chosen', [
    # A chain of links from the ground, each of which tells more than those before, wherever it is.
    ('five_bar', {}, ['m_crank', 'm_AP']), ('slider_crank', {}, ['m_block']),
    ('klann', {}, ['m_BD']),
    (['O ground 0 0', 'Q ground 4 0', 'A crank O 1', 'B dyad A Q 3 2.5 left', 'C crank Q 1',
      'D dyad C O 3 2.5 left'], {}, ['m_QB', 'm_CD']),
    # The barrel of a cylinder comes last.
    (['O ground 0 0', 'Q ground 1 0', 'A crank O 0.3', 'B cylinder Q A 1 left'], {},
     ['m_crank', 'm_AB']),
    ('five_bar', {'dimensions.b': 0.05, 'crank.start': 3.1, 'crank2.start': 0.0},
     ['m_crank', 'm_AP']),
    # With preference for those that have a name, on the links before them.
    ('klann', {'joint_names': ['CF=knee']}, ['knee']),
    ('klann', {'joint_names': ['AD=knee']}, ['m_BD']),
    ('klann', {'joint_names': ['EF=knee', 'CF=toe']}, ['toe']),
    ('five_bar', {'joint_names': ['crank2=hip', 'CP=knee']}, ['hip', 'knee']),
    ('five_bar', {'joint_names': ['CP=knee']}, ['m_crank', 'm_AP']),
    ('five_bar', {'joint_names': ['AP=knee', 'CP=other']}, ['m_crank', 'knee']),
    # What is published comes first.
    ('klann', {'joint_names': ['EF=knee'], 'only_named': True}, ['knee']),
    ('klann', {'joint_names': ['crank=motor'], 'only_named': True}, ['motor'])])
def test_joints_by_default(linkage, parameters, chosen):
    assert [each.name for each in joints(alone(linkage, **parameters))] == chosen


def test_the_joints_are_chosen_by_their_names(mechanisms):
    leg = mechanisms['leg']
    assert [each.output for each in joints(leg, ['leg_P.x', 'leg_P.y'])] == ['P.x', 'P.y']
    for names in (['knee'], ['P.x', 'P.y'], ['leg_AP'], ['leg_AP', 'leg_AP']):
        with pytest.raises(ValueError, match='leg has 2 inputs: as many of its joints are needed'):
            joints(leg, names)


@pytest.mark.skipif(not shutil.which('avr-gcc'), reason='avr-gcc is not installed')
def test_where_a_double_is_a_float_it_says_so(mechanisms, tmp_path):
    for single, reason in ((False, 'print the header again with --float'), (True, '')):
        file = tmp_path / 'lever.c'
        file.write_text(header.written(mechanisms['lever'], (), single) + 'int main(void) { }\n')
        ended = subprocess.run(['avr-gcc', '-mmcu=atmega328p', '-std=c99', '-c', file, '-o',
                                tmp_path / 'lever.o'], capture_output=True, text=True)
        assert (ended.returncode != 0) == bool(reason) and reason in ended.stderr


def written(folder, path, *arguments):
    """Return the folder of a package for a scene."""
    made = folder / f'{path.stem}_transmissions'
    assert transmission.main([str(path), '--out', str(made), *arguments]) == 0
    return made


@pytest.mark.parametrize('compiler', COMPILERS)
@pytest.mark.nightly
@pytest.mark.parametrize('path', SCENES, ids=lambda path: path.stem)
def test_every_scene_is_proved_at_a_hundred_thousand_states(tmp_path, path, compiler):
    package = written(tmp_path, path)
    for mechanism in scene.load(path).mechanisms.values():
        prove(package, mechanism, compiler)


@pytest.mark.nightly
@pytest.mark.skipif('ROS2_CONTROL' not in os.environ, reason='ROS2_CONTROL names no checkout')
def test_packages_are_proved_with_the_headers_of_ros2_control(tmp_path):
    ended = subprocess.run([ROOT / '.ci' / 'ros2_control', 'headers', tmp_path,
                            os.environ['ROS2_CONTROL']], capture_output=True, text=True)
    assert ended.returncode == 0 and ended.stdout.count(': proved') == 5, ended.stderr[:2000]


@pytest.mark.nightly
@pytest.mark.skipif(not shutil.which('cmake'), reason='cmake is not installed')
def test_a_package_is_built_and_installed(tmp_path):
    if not (Path(sys.prefix) / 'share' / 'ament_cmake').is_dir():
        pytest.skip('ament_cmake is not installed')
    package = written(tmp_path, ROOT / 'examples' / 'leg.yaml', '--mechanism', 'knee', 'hip')
    installed = tmp_path / 'install'
    for command in (['-S', package, '-B', tmp_path / 'build',
                     f'-DPython3_EXECUTABLE={sys.executable}',
                     f'-DCMAKE_INSTALL_PREFIX={installed}',
                     f'-DCMAKE_PREFIX_PATH={STAND_IN / "cmake"};{sys.prefix}'],
                    ['--build', tmp_path / 'build', '--target', 'install']):
        ended = subprocess.run(['cmake', *command], capture_output=True, text=True)
        assert ended.returncode == 0, ended.stdout + ended.stderr
    assert (installed / 'lib' / 'libleg_transmissions.so').is_file()


# The actuators and joints of some mechanisms: names, and roles.
AXES = {'leg': ({'leg_crank': 'crank', 'leg_crank2': 'crank2'},
                {'leg_crank': 'crank', 'leg_AP': 'AP'}),
        'int': ({SCENE['int.crank.source']: 'crank'}, {'while/1:x': 'QB'}),
        'boom': ({'boom_cylinder': 'cylinder'}, {'boom_OB': 'OB'}),
        'lever': ({'servo': 'crank'}, {'flap': 'lever'})}


def test_a_package_names_what_the_scene_names(mechanisms):
    files = {str(path): text for path, text in package(
        'robot_1', 'a<b>*/.yaml', [(mechanisms[name], []) for name in AXES]).items()}
    assert not any(re.search(r'@\w+@', text) for text in files.values())
    described, pasted, plugins = map(ElementTree.fromstring, (
        files['package.xml'], f'<all>{files["urdf/transmissions.xml"]}</all>',
        files['plugins.xml']))
    assert 'Linkages of a<b>* /.yaml as' in described.findtext('description')
    assert {each.text for each in described.iter('depend')} == set(re.findall(
        r'find_package\((?!ament)(\w+)', files['CMakeLists.txt']))
    assert [(own.get('name'), own.findtext('plugin'), *({
        each.get('name'): each.get('role') for each in own.iter(side)}
        for side in ('actuator', 'joint'))) for own in pasted] == [
            (name, f'robot_1/{name}', *axes) for name, axes in AXES.items()]
    assert [(each.get('name'), each.get('type')) for each in plugins] == [
        (f'robot_1/{name}', f'robot_1_plugins::{name}_loader') for name in AXES]


@pytest.mark.parametrize('arguments, reason', [
    *((['--out', '{0}/' + name], f"single underscores, a letter first, not '{name}'")
      for name in ('My-Package', 'a', '1a', 'a__b', 'a_', 'a' * 65)),
    *((['--out', folder], 'or one written by this command, but') for folder in ('{0}', '{0}/cpp')),
    ([], 'one of the arguments --out --limits is required'),
    (['--out', '{0}/legs', '--joints', 'elbow'], "no mechanism has a joint 'elbow'"),
    (['--out', '{0}/legs', '--joints', 'kneee'], 'did you mean knee?')])
def test_what_cannot_be_written_is_one_sentence(tmp_path, capsys, arguments, reason):
    folder = tmp_path / 'mine'
    (folder / 'cpp').mkdir(parents=True)
    (folder / 'cpp' / 'CMakeLists.txt').touch()
    (folder / 'notes.txt').write_text('keep')
    (folder / 'package.xml').write_bytes(b'<package>\xff')
    assert transmission.main([str(ROOT / 'examples' / 'leg.yaml'),
                              *(text.format(folder) for text in arguments)]) == 1
    printed = capsys.readouterr().err
    assert printed.startswith('transmission: ') and printed.count('\n') == 1 and reason in printed
    assert (folder / 'notes.txt').read_text() == 'keep'


def limits_of(capsys, path, *arguments):
    """Return the limits that the command prints, by joint; None for one that turns."""
    assert transmission.main([str(path), '--limits', *arguments]) == 0
    limits = {}
    for joint in ElementTree.fromstring(f'<robot>{capsys.readouterr().out}</robot>'):
        limit = joint.find('limit')
        limits[joint.get('name')] = limit is not None and tuple(
            float(limit.get(end)) for end in ('lower', 'upper'))
    return limits


@pytest.mark.parametrize('path', ['examples/leg.yaml', 'config/excavator.yaml',
                                  'examples/ankle.yaml', 'config/slotted_lever.yaml'])
def test_joint_limits_are_those_of_all_poses(capsys, path):
    limits, rng = limits_of(capsys, ROOT / path), np.random.default_rng(9)
    for mechanism in scene.load(ROOT / path).mechanisms.values():
        # What the joints are at poses of the sweeps, by another way than that of the limits.
        inputs = [rng.uniform(*(settings.ends or settings.reach[0]), 3000) / mechanism.scale_of(
            name) for name, settings in mechanism.inputs.items()]
        for axis in joints(mechanism):
            values = axis.factor * mechanism.linkage.joint_angles(
                inputs if len(inputs) > 1 else inputs[0], [axis.output])[axis.output] + axis.offset
            low, high = limits[axis.name]
            slack = 0.05 * (high - low)
            assert low - 1e-9 <= np.nanmin(values) <= low + slack
            assert high - slack <= np.nanmax(values) <= high + 1e-9


def test_joint_limits_can_be_commanded_and_measured(capsys, tmp_path):
    limits, mechanisms = {}, []
    # A joint beyond half a turn, and one that passes it.
    file = scene_file(tmp_path, {'mechanisms': ['four', 'watt'], 'watt.type': 'watt',
                                 'four.type': 'four_bar', 'four.joint_names': ['QB=four-6.0']})
    for path in (ROOT / 'examples' / 'leg.yaml', ROOT / 'config' / 'slotted_lever.yaml', file):
        limits |= limits_of(capsys, path)
        mechanisms += scene.load(path).mechanisms.values()
    library = compiled(tmp_path, mechanisms)
    for mechanism in mechanisms:
        joint, = joints(mechanism)
        low, high = limits[joint.name]
        assert [Memory(library, mechanism).send(1, [end])[0] & 1 for end in (low, high)] == [0, 0]
        for inputs in states(mechanism, 30):
            assert low < Memory(library, mechanism).send(
                0, expected(mechanism, inputs)[0])[1][0] < high


def test_joint_limits_of_an_input_are_those_of_its_poses(capsys, tmp_path):
    file = scene_file(tmp_path, {'mechanisms': ['five'], 'five.type': 'custom', 'five.joints': [
        'O ground 0 0', 'Q ground 1 0', 'A crank O 0.5', 'B crank Q 0.2',
        'C dyad A B 0.6 0.3 left']})
    # A is no farther from Q than B and both bars, 1.1 m.
    limits = limits_of(capsys, file, '--joints', 'five_crank', 'five_crank2')['five_crank']
    np.testing.assert_allclose(limits, [-math.acos(0.04), math.acos(0.04)], atol=0.02)


@pytest.mark.parametrize('name, sweep, limits', [
    ('QB', [], False), ('crank', [], False), ('crank2', [], False),
    ('crank2', [-1.0, 20.0], (-40.0, 2.0)), ('crank', [0.0, 9.0], (0.0, 9.0))])
def test_a_joint_that_turns_has_no_limits(capsys, tmp_path, name, sweep, limits):
    file = scene_file(tmp_path, {
        'mechanisms': ['drag'], 'drag.type': 'custom', 'drag.crank.sweep': sweep,
        'drag.joints': [*DRAG, 'D crank Q 0.3 geared crank -2 0']})
    assert limits_of(capsys, file, '--joints', f'drag_{name}') == {f'drag_{name}': limits}


def test_a_package_is_written_again(tmp_path, capsys):
    path, chosen = ROOT / 'examples' / 'leg.yaml', ['knee', 'hip']
    files = package('leg_transmissions', 'leg.yaml', [
        (mechanism, ['knee'] * (name == 'knee')) for name in chosen
        for mechanism in [scene.load(path).mechanisms[name]]])
    written(tmp_path, path)
    capsys.readouterr()
    for _ in range(2):
        made = written(tmp_path, path, '--mechanism', *chosen, 'hip', '--joints', 'knee')
        assert capsys.readouterr().out == f'{made}: knee, hip; see urdf/transmissions.xml\n'
        assert {file.relative_to(made): file.read_text() for file in made.rglob('*')
                if file.is_file()} == files
