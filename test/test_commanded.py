# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What was just measured can be commanded, in C, over the catalogue and random linkages.

Each question measures a pose, then commands the joints to be where they are, or where they are
beside it: at inputs that differ by 1e-3 rad or sizes. Python says where they are.
"""

from contextlib import suppress
from itertools import product
import math
import subprocess

from c_libraries import COMPILER, loaded, SANITIZED
from c_memories import memories, Memory
from linkage_ros import mechanisms, scene
from linkage_ros.c_code import header
from linkage_ros.c_code.axes import actuators, joints
import numpy as np
import pytest
from scenes import alone, LIFT, ROOT, SLOT
from truth import random_linkages

pytestmark = pytest.mark.skipif(not COMPILER, reason='there is no C compiler')
NUMBERS = pytest.mark.parametrize('number', ['double', 'float'])
# Linkages for which a closed form was missing an assembly mode; in float, one beside a limit.
FAULTS = [(['A ground 0 0', 'B ground 0 1.4', 'C cylinder B A 1.0157 right',
            'D E F inversor B C 1.2375 0.3369'], 'DE', 200),
          (['A ground 0 -466877.40017928416', 'C ground 1817220.0129748432 0',
            'D crank C 1186290.2285410194', 'E antiparallelogram C D A'], 'E.y', 500)]
# Linkages with extremes of an output, and how far that may be from a command at its rounding.
NEXT_TO_EXTREMES = (SLOT, 'lever'), (LIFT, 'B.y')
CLOSE = {'double': 1e-12, 'float': 1e-6}
# Poses of a linkage, and how far joints and actuators may be from those of Python [rad, sizes].
POSES, NEAR, SLACK = 300, {'double': 1e-9, 'float': 1e-6}, {'double': 1e-6, 'float': 1e-2}


def read(name, joint_lines, names=(), **parameters):
    """Return a mechanism of joint lines, with the names of its commanded joints."""
    return header.Request(alone(joint_lines, name, **parameters), (), tuple(names))


def drawn(seeds):
    """Yield random linkages, each with its default joints and with other outputs."""
    for seed in seeds:
        rng = np.random.default_rng(seed)
        design = random_linkages.design(rng)
        lengths = {f'dimensions.{key}': float(value) for key, value in design.dimensions.items()}
        names = [()]
        for i in range(3):
            name = f'm{seed}_{i}'
            with suppress(scene.SceneError, ValueError):  # no pose, or not these outputs
                case = read(name, design.joints, names[i] if i < len(names) else (), **lengths)
                header.printed([case])
                yield case
                if not i:
                    linkage = case.mechanism.linkage
                    others = [*linkage.joints, *(f'{point}.{axis}' for point in linkage.points
                                                 for axis in 'xy')]
                    names += [[f'm{seed}_{k}_{output}' for output in rng.choice(
                        others, len(linkage.inputs), replace=False)] for k in (1, 2)]


def placed(mechanism, axes, inputs):
    """Return the positions of axes at inputs (poses, n) of the linkage; NaN: not assembled."""
    linkage = mechanism.linkage
    names = [each.output for each in axes], [
        f'{point}.{axis}' for point in linkage.points for axis in linkage.axes]
    columns = [*inputs.T] if inputs.shape[1] > 1 else inputs[:, 0]
    values, points = (np.transpose([linkage.joint_angles(columns, each)[name] for name in each])
                      for each in names)
    factor, offset = np.transpose([(each.factor, each.offset) for each in axes])
    values[~np.isfinite(points).all(axis=1)] = np.nan
    return values * factor + offset


def error(axes, positions, others):
    """Return how far positions are from others, in sizes, the shorter way round."""
    size, turn = np.transpose([(each.size, each.turn) for each in axes])
    gap = positions - others
    gap -= turn * np.round(gap / np.where(turn, turn, np.inf))
    return np.abs(gap / size).max(axis=-1)


def check_commands(library, case, number):
    """Return how many questions are put to a linkage, and what is wrong with the answers."""
    mechanism, rng, slack = case.mechanism, np.random.default_rng(1), SLACK[number]
    memory = Memory(library, mechanism, np.float32 if number == 'float' else float)
    sides = actuators(mechanism), joints(mechanism, case.joints)
    sizes = np.array([input_.size for input_ in mechanism.linkage.inputs])
    low, high = np.transpose([
        np.divide(max(settings.arcs, key=np.ptp), mechanism.scale_of(name))
        for name, settings in mechanism.inputs.items()])
    here = rng.uniform(low, high, (POSES, len(low)))
    beside = (here + 1e-3 * sizes * rng.choice([-1.0, 1.0], here.shape)).clip(*np.transpose([
        ends or (-np.inf, np.inf) for ends in mechanism.ends]))
    (actuator, joint), (goal, commanded) = ([placed(mechanism, axes, inputs) for axes in sides]
                                            for inputs in (here, beside))
    count, wrong = 0, []

    def measured(actuator, joint):
        """Return the joints that C measures, or None if they are not those of Python."""
        status, (solved, *_) = memory.send(0, actuator)
        is_there = not status & (3 if number == 'float' else 1)
        return solved if is_there and error(sides[1], solved, joint) <= NEAR[number] else None

    for i in np.flatnonzero(np.isfinite(joint + actuator + commanded + goal).all(axis=1)):
        poses = measured(goal[i], commanded[i]), measured(actuator[i], joint[i])
        if any(pose is None for pose in poses):
            # In single precision it may be singular, or next to a dead point or an end.
            wrong += [f'measured {i}'] * (number == 'double')
            continue
        status, (solved, *_) = memory.send(1, poses[1])
        if status & 1 or error(sides[0], solved, actuator[i]) > slack:
            wrong.append(f'pose {i}')
        memory.send(0, actuator[i])
        status, (solved, *_) = memory.send(1, poses[0])
        # Another pose that is as near is an answer, too.
        if status & 1 or error(sides[0], solved, goal[i]) > slack and error(
                sides[0], solved, actuator[i]) > slack + 2 * error(sides[0], goal[i], actuator[i]):
            wrong.append(f'beside {i}')
        count += 2
    return count, wrong


def questions(folder, cases, number):
    """Return how many questions were put to each case, and raise if an answer was wrong."""
    folder.mkdir(parents=True, exist_ok=True)
    library = loaded(folder, memories(cases, number == 'float'), '-O1')
    answers = {case.mechanism.name: check_commands(library, case, number) for case in cases}
    assert {name: wrong for name, (_, wrong) in answers.items() if wrong} == {}
    return [count for count, _ in answers.values()]


def cranks(memory, case, output, value):
    """Return the crank within its sweep for a command, from its middle: C's and Python's."""
    (low, high), = case.mechanism.ends
    memory.send(0, [(low + high) / 2])
    status, ((crank,), *_) = memory.send(1, [value])
    python, = case.mechanism.linkage.inverse(output).nearest(
        (value,), ((low + high) / 2,), [(low, high)])[0]
    return [math.nan if status & 1 else float(crank), python]


@pytest.mark.nightly(all_but=1)
@NUMBERS
def test_the_ends_of_sweeps_can_be_commanded(tmp_path, number):
    """Next to an extreme of an output, its rounding moves the input far."""
    ends, cases = [], []
    for joint_lines, output in NEXT_TO_EXTREMES:
        (_, extreme), *_ = alone(joint_lines).linkage.extremes(output)[0]
        for distance, inwards in product((0.0, 1e-6, 1e-4, 0.1), (-1.0, 1.0)):
            name, end = f'm{len(ends)}', extreme + inwards * distance
            sweep = sorted((end, end + 0.3 * inwards))
            ends.append((output, end, inwards, distance))
            cases.append(read(name, joint_lines, [f'{name}_{output}'], **{
                'crank.sweep': sweep, 'crank.start': sum(sweep) / 2}))
    library, kind = loaded(tmp_path, memories(cases, number == 'float')), (
        np.float32 if number == 'float' else float)
    for (output, end, inwards, distance), case in zip(ends, cases):
        memory = Memory(library, case.mechanism, kind)
        places = np.array([end, end - 1e-3 * inwards])
        at_end, beyond = case.mechanism.linkage.joint_angles(places, [output])[output]
        inputs = np.array(cranks(memory, case, output, at_end))
        (low, high), = np.array(case.mechanism.ends, kind)
        assert ((low <= inputs.astype(kind)) & (inputs.astype(kind) <= high)).all()
        off = case.mechanism.linkage.joint_angles(inputs, [output])[output] - at_end
        assert (np.abs(off) < (CLOSE[number], CLOSE['double'])).all()
        if distance == 0.1:
            assert np.isnan(cranks(memory, case, output, beyond)).all()


@pytest.mark.nightly(all_but=2)
@NUMBERS
@pytest.mark.parametrize('fault, output, count', FAULTS)
def test_linkages_that_had_a_fault(tmp_path, number, fault, output, count):
    assert questions(tmp_path, [read('fault', fault, [f'fault_{output}'])], number) > [count]


@pytest.mark.nightly
@NUMBERS
def test_the_catalogue_and_an_ankle(tmp_path, number):
    ankle = scene.load(str(ROOT / 'examples' / 'ankle.yaml')).mechanisms.values()
    requests = [*map(header.Request, (*map(alone, mechanisms.TYPES, mechanisms.TYPES), *ankle))]
    assert min(questions(tmp_path, requests, number)) > 200


@pytest.mark.nightly
@pytest.mark.parametrize('seeds', [range(12), range(12, 200)], ids=['few', 'many'])
@NUMBERS
def test_random_linkages(tmp_path, number, seeds):
    cases = [*drawn(seeds)]
    assert sum(sum(questions(tmp_path / f'{i}', cases[i:i + 25], number))
               for i in range(0, len(cases), 25)) > 400 * len(seeds)


def test_sanitizers_find_nothing(tmp_path):
    def ran(text):
        (tmp_path / 'code.c').write_text(text)
        for command_line in ([COMPILER, '-std=c99', *SANITIZED, tmp_path / 'code.c', '-o',
                              tmp_path / 'code', '-lm'], [tmp_path / 'code']):
            ended = subprocess.run(command_line, capture_output=True, text=True)
            if ended.returncode:
                return ended.stderr[:2000]
        return ended.stdout

    if ran('int main(void) { return 0; }\n'):
        pytest.skip('no program with sanitizers is linked or runs here')
    cases = [header.Request(alone('slotted_lever', 'lever', **{'crank.sweep': [-1.0, 2.0]})),
             header.Request(alone('five_bar', 'leg', loads=['P=1 2']))]
    printed = ran(f"""{memories(cases)}
#include <stdio.h>
int main(void)
{{
    static const double values[] = {{ NAN, INFINITY, 1e300, 0, 1, 0.3, 2, -1, 0.5, -0.1, 1.5 }};
    lkr_side given = {{ {{ 0 }}, {{ 0 }}, {{ 0 }} }}, found = given;
    unsigned i, status = 0;
    lever_started();
    leg_started();
    for (i = 0; i < 5000; i++) {{
        given.position[i / 2 % 2] = values[i / 3 % 11];
        given.velocity[i / 2 % 2] = values[i / 5 % 11];
        given.effort[i / 2 % 2] = values[i / 7 % 11];
        status |= 1u << lever_sent((int)(i % 2), &given, &found);
        status |= 1u << leg_sent((int)(i % 2), &given, &found);
    }}
    printf("%u", status);
}}
""")
    # It was all right, out of reach, and not known.
    assert int(printed) & 0b10011 == 0b10011
