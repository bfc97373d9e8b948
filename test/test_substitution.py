# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Random faults in the scenes of random robots: the check by substitution finds each of them."""

from contextlib import suppress
import math
import re
from unittest.mock import patch

from linkage_ros import scene
from linkage_ros.cli import RequestError
from linkage_ros.linkage import theta_of
from linkage_ros.robot_files import check, readers
from linkage_ros.robot_files.cli import described
import numpy as np
import pytest
from robots import of_text
from test_robot_files import random_robot

FAULTS = 10
SIDES = {'left': 'right', 'right': 'left', 'out': 'in', 'in': 'out'}


def some(rng, values):
    """Return one of some values; raise IndexError if there are none."""
    return values[rng.integers(max(len(values), 1))]


def with_sign(parameters, rng):
    """Turn the sign of a published joint."""
    line = parameters['joint_names'][at := some(rng, range(len(parameters['joint_names'])))]
    link, _, name = line.partition('=')
    parameters['joint_names'][at] = f'{link}={name[1:] if name[0] == "-" else f"-{name}"}'


def with_offset(parameters, rng):
    """Move the zero of a published joint by 1e-6 rad or m."""
    at = some(rng, range(len(parameters['joint_names'])))
    match = re.fullmatch(r'(.*?)([+-][\d.e+-]+)?', parameters['joint_names'][at])
    parameters['joint_names'][at] = f'{match[1]}{float(match[2] or 0.0) + 1e-6:+}'


def with_side(parameters, rng):
    """Take the other side of a dyad."""
    at = some(rng, [i for i, line in enumerate(parameters['joints']) if line.split()[-1] in SIDES])
    *words, side = parameters['joints'][at].split()
    parameters['joints'][at] = ' '.join([*words, SIDES[side]])


def with_length(parameters, rng):
    """Make a number of a line wrong by 1e-5 of the largest one."""
    numbers = [(i, k) for i, line in enumerate(parameters['joints'])
               for k, word in enumerate(line.split()) if k > 1 and re.match(r'-?\d', word)]
    size = max(abs(float(parameters['joints'][i].split()[k])) for i, k in numbers)
    i, k = some(rng, numbers[2:])
    words = parameters['joints'][i].split()
    words[k] = repr(float(words[k]) + 1e-5 * size * rng.choice([-1.0, 1.0]))
    parameters['joints'][i] = ' '.join(words)


KINDS = with_sign, with_offset, with_side, with_length


def is_found(robot, mechanism, values, made):
    """Tell whether the check finds a fault; what changes no position is none."""
    name = mechanism.name
    try:
        wrong = scene.read({'mechanisms': [name], **{
            f'{name}.{key}': value for key, value in values.items()}}).mechanisms[name]
        if check.compared(robot, {name: wrong}, [made])[1]:
            return True
    except scene.SceneError:
        return True
    values = theta_of([
        np.linspace(*settings.ends or settings.start + np.array([-0.1, 0.1]), 9)
        for settings in mechanism.inputs.values()])
    one, other = (each.linkage.joint_angles(values) for each in (mechanism, wrong))
    off = [mechanism.joints[link].of(one[link]) - wrong.joints[link].of(other[link])
           for link in mechanism.joints if mechanism.joints[link].published]
    return np.nanmax(np.abs(off - math.tau * np.round(np.divide(off, math.tau)))) < 1e-9


def planar(seed):
    """Return a random planar robot, or None."""
    made = random_robot(seed)
    return made and made[2]


def ankle(seed, folder):
    """Return a random ankle on rods, with limits close to its pose."""
    from test_rods_of_robots import mjcf, turning
    return readers.read(str(of_text(
        folder / 'robot.xml', mjcf(turning(seed), [[-0.1, -0.1], [0.1, 0.1]]))))


def faults(robot, seed):
    """Yield each fault of a robot's scene, and whether it is found."""
    rng, parameters = np.random.default_rng(seed), {}
    with patch.object(check, 'compared', wraps=check.compared) as spy, suppress(RequestError):
        parameters = described(robot)[0] if robot else {}
    for robot, mechanisms, made in (
            (*call.args[:2], made) for call in spy.call_args_list
            for made in call.args[2] if made.name in parameters['mechanisms']):
        mechanism = mechanisms[made.name]
        own = {key.partition('.')[2]: value for key, value in parameters.items()
               if key.startswith(f'{mechanism.name}.')}
        for _ in range(FAULTS):
            values = {key: value[:] if isinstance(value, list) else value
                      for key, value in own.items()}
            kind = KINDS[rng.integers(len(KINDS))]
            with suppress(IndexError):
                kind(values, rng)
                yield (seed, kind.__name__, values['joints'], values['joint_names']), is_found(
                    robot, mechanism, values, made)


@pytest.mark.parametrize('seeds', [[7], pytest.param(range(100), marks=pytest.mark.nightly)])
def test_every_fault_of_a_scene_is_found(seeds):
    tried = [fault for seed in seeds for fault in faults(planar(seed), seed)]
    assert not [fault for fault, found in tried if not found]
    assert len(tried) > 5 * len(seeds)


@pytest.mark.nightly
def test_every_fault_of_an_ankle_on_rods_is_found(tmp_path):
    tried = [fault for seed in range(12) for fault in faults(ankle(seed, tmp_path), seed)]
    assert not [fault for fault, found in tried if not found]
    assert len(tried) > 36
