# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""After any history the kinematics node publishes what the library says, on every topic."""

import math
import os
from pathlib import Path
import subprocess
import sys

from oracle import Bench, everything, history, message, SCENES
import pytest
from ros_harness import Graph

# Of each scene a short history, 11 and 48; nightly all of them without llvmlite, too.
SEEDS = [pytest.param(range(1), 20, id='few'),
         pytest.param(range(1, 12), 60, id='some', marks=pytest.mark.nightly),
         pytest.param(range(12, 60), 60, id='many', marks=pytest.mark.nightly)]


# Nor does numpy warn, whatever the numbers are.
@pytest.mark.filterwarnings('error::RuntimeWarning')
@pytest.mark.parametrize('name', SCENES)
@pytest.mark.parametrize('seeds, length', SEEDS)
def test_whatever_happens_the_node_publishes_what_the_library_says(name, seeds, length):
    with Graph() as graph:
        bench = Bench(graph, SCENES[name])
        for seed in seeds:
            try:
                bench.run(history(SCENES[name], seed, length))
            except AssertionError as error:
                pytest.fail(f'history {seed}, after those from {seeds[0]} on: {error}')


FIVE_BAR = {'mechanisms': ['m'], 'm.type': 'five_bar'}
LEG = {'mechanisms': ['m'], 'm.type': 'jansen'}
WALKER = {**LEG, 'm.leg_pairs': 3, 'm.dimensions.a': 10.0, 'm.dimensions.m': 22.0}
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
ANKLE = SCENES['rods in space']
MEASURED = {'mechanisms': ['a', 'b'], 'a.type': 'four_bar', 'a.crank.measures': 'QB',
            'a.crank.ratio': 2.0, 'a.crank.offset': 0.1, 'a.crank.start': 0.5,
            'b.type': 'slotted_lever'}
GOOD, OTHER = message({'a_QB': 0.43}, [0.5]), message({'b_crank': 0.3}, [1.0])
SHORT = {
    'two rods in space': (ANKLE, [*everything(ANKLE), *(
        message({'ankle_right': right, 'ankle_left': left}, [1.0, 2.0])
        for right, left in ((0.0, 0.0), (0.1, -0.05), (2.0, 0.0), (-0.2, 0.1)))]),
    'markers that a change leaves nothing of': (LEG, [
        *everything(LEG), message({'m_crank': 0.5}), ('set', {'m.points': ['O', 'G']})]),
    'an input of two': (FIVE_BAR, [
        *everything(FIVE_BAR), message({'m_crank': 0.5}), message({'m_crank': 0.6}, [1.0]),
        message({'m_crank2': 0.1}, [1.0, 2.0]), ('set', {'frame_id': 'map'}),
        ('set', {'frame_prefix': 'left/'})]),
    'legs that are left out': (WALKER, [*everything(WALKER), message({'m_crank': 1.5}, [1.0])]),
    # What was received is read anew.
    **{f'what was received of a {source} before a change': (MEASURED, [
        *everything(MEASURED), GOOD, OTHER, ('set', change)]) for source, change in (
            ('motor', {'b.crank.ratio': 2.0, 'b.crank.offset': 0.1}),
            ('sensor', {'a.crank.ratio': -2.0}))},
    # What a sensor cannot say is no pose.
    **{f'a sensor at {bad}': (MEASURED, [
        *everything(MEASURED), odd, GOOD, odd, unmoved, GOOD, OTHER, odd, OTHER, ('compiled',),
        GOOD, GOOD, odd, unmoved, OTHER, GOOD, message({'a_QB': 0.44}, [0.5], 4)])
       for bad in (9.0, math.nan, math.inf) for odd, unmoved in [(
           message({'a_QB': bad}, [0.7], 2), message({'a_QB': bad}, [math.nan], 3))]},
    # Efforts are there whoever sets the message off.
    **{f'loads of {name}': (given, [
        *everything(given), message({'a_crank': 2.0}), ('compiled',), *(
            step for i in range(10) for step in (
                message({'b_crank': 0.1 * i}, [1.0]),
                message({'a_crank': 2.0 + 0.01 * i}, [1.0])))])
       for name, given in LOADED.items()}}


@pytest.mark.parametrize('parameters, steps', SHORT.values(), ids=SHORT)
def test_a_short_history_is_published_as_the_library_says(graph, parameters, steps):
    Bench(graph, parameters).run(steps)


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
