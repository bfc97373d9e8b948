# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Random faults in the scenes of random robots: the check by substitution finds each of them."""

import re

from linkage_ros import command, scene
from linkage_ros.robot_files import check, closing
from linkage_ros.robot_files.command import described
import numpy as np
import pytest
from test_robot_files import random_robot

FAULTS = 10
SIDES = {'left': 'right', 'right': 'left', 'out': 'in', 'in': 'out'}


def with_sign(given, rng):
    """Turn the sign of a published joint."""
    line = given['joint_names'][at := rng.integers(len(given['joint_names']))]
    link, _, name = line.partition('=')
    given['joint_names'][at] = f'{link}={name[1:] if name[0] == "-" else f"-{name}"}'


def with_offset(given, rng):
    """Move the zero of a published joint by 1e-6 rad or m."""
    at = rng.integers(len(given['joint_names']))
    found = re.fullmatch(r'(.*?)([+-][\d.e+-]+)?', given['joint_names'][at])
    given['joint_names'][at] = f'{found[1]}{float(found[2] or 0.0) + 1e-6:+}'


def with_side(given, rng):
    """Take the other side of a dyad."""
    at = rng.choice([i for i, line in enumerate(given['joints']) if line.split()[-1] in SIDES])
    *words, side = given['joints'][at].split()
    given['joints'][at] = ' '.join([*words, SIDES[side]])


def with_length(given, rng):
    """Make a number of a line wrong by 1e-5 of the largest one."""
    numbers = [(i, k) for i, line in enumerate(given['joints'])
               for k, word in enumerate(line.split()) if k > 1 and re.match(r'-?\d', word)]
    size = max(abs(float(given['joints'][i].split()[k])) for i, k in numbers)
    i, k = numbers[rng.integers(2, len(numbers))]
    words = given['joints'][i].split()
    words[k] = repr(float(words[k]) + 1e-5 * size * rng.choice([-1.0, 1.0]))
    given['joints'][i] = ' '.join(words)


def faults_found(seed):
    """Return how many faults of a random robot's scene are found, and the others."""
    rng, missed, count = np.random.default_rng(seed), [], 0
    if not (made := random_robot(seed)):
        return 0, []
    try:
        given, said, _ = described(made[2])
    except command.RequestError:
        return 0, []
    robot = closing.closed(made[2]).robot
    for machine in scene.read(given).machines.values():
        sources = {drive.source: (-np.inf, np.inf) for drive in machine.inputs.values()}
        driven = [name for name in robot.positions if robot.source(name)[0] in sources
                  and name in {*robot.driven, *robot.follows, *sources}]
        line, = (line for line in said if line.startswith(f'Checked: {machine.name}:'))
        ends = {name: tuple(map(float, re.search(
            rf'[ ,]{name} from (\S+) to (\S+?),', line).groups())) for name in sources}
        check.compared(robot, machine, driven, ends, 0.0)
        for _ in range(FAULTS):
            values = {key: list(value) if isinstance(value, list) else value for key, value in (
                (key.partition('.')[2], value) for key, value in given.items())}
            try:
                kind = rng.choice([with_sign, with_offset, with_side, with_length])
                kind(values, rng)
            except (ValueError, IndexError):
                continue
            count += 1
            try:
                wrong = scene.read({'mechanisms': [machine.name], **{
                    f'{machine.name}.{key}': value for key, value in values.items() if key}})
                check.compared(robot, wrong.machines[machine.name], driven, ends, 0.0)
                missed.append((kind.__name__, values['joints'], values['joint_names'],
                               given[f'{machine.name}.joints'], given[f'{machine.name}.joint_names']))
            except (check.Difference, scene.SceneError):
                pass
    return count, missed
