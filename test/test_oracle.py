# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""After any history the kinematics node publishes what the library says, on every topic."""

import math
import os
from pathlib import Path
import subprocess
import sys

import numpy as np
from oracle import Bench, everything, history, message, Mismatch, SCENES
import pytest
from ros_harness import Graph

# Of each scene: 13 histories in all, 143 and 624; nightly all of them without llvmlite, too.
SEEDS = [pytest.param(range(1), id='few'),
         pytest.param(range(1, 12), id='some', marks=pytest.mark.nightly),
         pytest.param(range(12, 60), id='many', marks=pytest.mark.nightly)]


@pytest.mark.parametrize('name', SCENES)
@pytest.mark.parametrize('seeds', SEEDS)
def test_whatever_happens_the_node_publishes_what_the_library_says(name, seeds):
    with Graph() as graph:
        bench = Bench(graph, SCENES[name])
        for seed in seeds:
            try:
                bench.run(history(SCENES[name], seed))
            except Mismatch as error:
                pytest.fail(f'history {seed}, after those from {seeds[0]} on: {error}')


FIVE_BAR = {'mechanisms': ['m'], 'm.type': 'five_bar'}
LEG = {'mechanisms': ['m'], 'm.type': 'jansen'}
BOTH = {'mechanisms': ['a', 'b'], 'a.type': 'jansen', 'b.type': 'slotted_lever'}
ANKLE = SCENES['rods in space']
SHORT = {
    'two rods in space': (ANKLE, [*everything(ANKLE), *(
        message({'ankle_right': right, 'ankle_left': left}, [1.0, 2.0])
        for right, left in ((0.0, 0.0), (0.1, -0.05), (2.0, 0.0), (-0.2, 0.1)))]),
    'markers that a change leaves nothing of': (LEG, [
        *everything(LEG), message({'m_crank': 0.5}), ('set', {'m.points': ['O', 'G']})]),
    'a scene that nobody listens to': (LEG, [message({'m_crank': 0.5})] * 3),
    'a listener that leaves': (LEG, [
        ('listen', 'm/joint_states', True), message({'m_crank': 0.5}),
        ('listen', 'm/joint_states', False), message({'m_crank': 0.6}),
        ('listen', 'm/joint_states', True), message({'m_crank': 0.7})]),
    'a mechanism of two that moves unheard': (BOTH, [
        ('listen', 'joint_states', True), message({'a_crank': 0.2, 'b_crank': 0.1}),
        ('listen', 'joint_states', False), message({'b_crank': 0.5}),
        ('listen', 'joint_states', True), message({'a_crank': 0.3})]),
    'an input of two': (FIVE_BAR, [
        *everything(FIVE_BAR), message({'m_crank': 0.5}), message({'m_crank': 0.6}),
        message({'m_crank2': 0.1})])}


@pytest.mark.parametrize('parameters, steps', SHORT.values(), ids=SHORT)
def test_a_short_history_is_published_as_the_library_says(graph, parameters, steps):
    Bench(graph, parameters).run(steps)


LOADED = {
    'a lever': {'mechanisms': ['a', 'b'], 'a.type': 'slotted_lever', 'b.type': 'jansen',
                'a.loads': ['L=0 -9.81']},
    'a cylinder': {'mechanisms': ['a', 'b'], 'b.type': 'jansen', 'a.type': 'custom', 'a.joints': [
        'O ground 0 0', 'Q ground 3 0', 'A cylinder O Q 1.5 left'], 'a.loads': ['A=1 -2'],
        'a.cylinder.source': 'a_crank'},
    # Where its two bars lie in one line, no force of the cylinder is large enough.
    'one of two without bound': {
        'mechanisms': ['a', 'b'], 'b.type': 'slotted_lever', 'b.loads': ['L=0 -9.81'],
        'a.type': 'custom', 'a.joints': ['O ground 0 0', 'P ground 1 0', 'B cylinder P O 1 left'],
        'a.loads': ['OB=-1.0'], 'a.cylinder.source': 'a_crank'}}


@pytest.mark.parametrize('parameters', LOADED.values(), ids=LOADED)
def test_efforts_are_there_whoever_sets_the_message_off(graph, parameters):
    Bench(graph, parameters).run([
        *everything(parameters), message({'a_crank': 2.0}), ('compiled',),
        *(step for i in range(10) for step in (
            message({'b_crank': 0.1 * i}, [1.0]), message({'a_crank': 2.0 + 0.01 * i}, [1.0])))])


PAIR = {'mechanisms': ['a', 'b'], 'a.type': 'jansen', 'b.type': 'peaucellier'}
# Where the cell's reach ends.
END = 2.0 * math.acos(5.0 / 6.0)


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('by', [
    message({'a_crank': 0.3}, [math.nan]), message({'a_crank': 0.3}, [math.inf]),
    message({'a_crank': 0.3}, [1e308]), message({'b_crank': END}, [1.0])],
    ids=['nan', 'inf', 'overflow', 'an end of the reach'])
def test_a_velocity_that_is_no_number_leaves_all_velocities_out(graph, by):
    Bench(graph, PAIR).run([
        *everything(PAIR), message({'a_crank': 0.2, 'b_crank': 0.1}, [1.0, 1.0]), ('compiled',),
        *(step for i in range(5) for step in (
            by, message({'a_crank': 0.2, 'b_crank': 0.1}, [1.0, 1.0]), by,
            message({'a_crank': 0.2 + 0.01 * i} if i % 2 else {'b_crank': 0.01 * i}, [1.0])))])


MEASURED = {'mechanisms': ['a', 'b'], 'a.type': 'four_bar', 'a.crank.measures': 'QB',
            'a.crank.ratio': 2.0, 'a.crank.offset': 0.1, 'a.crank.start': 0.5,
            'b.type': 'slotted_lever'}


@pytest.mark.parametrize('bad', [9.0, math.nan, math.inf])
def test_what_a_sensor_cannot_say_is_no_pose(graph, bad):
    bench = Bench(graph, MEASURED)
    good, other = message({'a_QB': 0.43}, [0.5]), message({'b_crank': 0.3}, [1.0])
    odd = message({'a_QB': bad}, [0.7], 2), message({'a_QB': bad}, [math.nan], 3)
    bench.run([*everything(MEASURED), odd[0], good, *odd, good, other, odd[0], other,
               ('compiled',), good, good, *odd, other, good, message({'a_QB': 0.44}, [0.5], 4)])
    assert bench.model.states['a'].values == [pytest.approx(0.54, abs=0.1)]


@pytest.mark.nightly(all_but=1)
@pytest.mark.parametrize('name', ['an excavator', 'a reach that ends',
                                  'more legs than are solved one by one'])
def test_numbers_are_the_same_at_the_ends_of_the_reach_and_in_many_legs(graph, name):
    bench = Bench(graph, SCENES[name])
    drives = [drive for mechanism in bench.model.scene.mechanisms.values()
              for drive in mechanism.inputs.values()]
    middle = {drive.source: 0.5 * sum(drive.reach[0]) for drive in drives}
    speeds = [1.0] * len(drives)
    bench.run([*everything(SCENES[name]), message(middle, speeds), ('compiled',), *(
        message({**middle, drive.source: drive.reach[0][0] + part * (
            drive.reach[0][1] - drive.reach[0][0])}, speeds)
        for drive in drives for part in (0.0, 1.0, 1e-9, -1e-9, *np.linspace(0.1, 0.9, 9)))])


WITHOUT = 'LINKAGE_ROS_WITHOUT_LLVMLITE'
# What replaces llvmlite: nothing, and a package whose library cannot be loaded.
REPLACED = {'missing': ('sitecustomize.py', "import sys\nsys.modules['llvmlite'] = None\n"),
            'broken': ('llvmlite.py', "raise OSError('libllvmlite.so cannot be loaded')\n")}


@pytest.mark.nightly
@pytest.mark.skipif(WITHOUT in os.environ, reason='this is without')
@pytest.mark.parametrize('replaced', REPLACED)
def test_all_this_holds_without_llvmlite(tmp_path, replaced):
    name, text = REPLACED[replaced]
    (tmp_path / name).write_text(text)
    paths = os.pathsep.join([str(tmp_path), os.environ.get('PYTHONPATH', '')])
    done = subprocess.run(
        [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider',
         '-W', 'ignore:no machine code', __file__],
        env={**os.environ, 'PYTHONPATH': paths, WITHOUT: '1'}, cwd=Path(__file__).parents[1],
        capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-5000:]
