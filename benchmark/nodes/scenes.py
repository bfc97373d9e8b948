# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The scenes that are measured, and the crank messages that turn them."""

from pathlib import Path
from typing import NamedTuple

from linkage_ros import scene
from linkage_ros.scene.motion import Motion
from sensor_msgs.msg import JointState
import yaml

KINDS = ('water_drop', 'jansen', 'peaucellier', 'slotted_lever')


def many(count: int) -> dict:
    """Return the parameters of so many mechanisms, each with a crank of its own."""
    kinds = {f'{KINDS[i % len(KINDS)]}_{i}': KINDS[i % len(KINDS)] for i in range(count)}
    return {'mechanisms': list(kinds), **{f'{name}.type': kind for name, kind in kinds.items()}}


SCENES = {
    'one leg': {'mechanisms': ['leg'], 'leg.type': 'jansen', 'leg.scale': 0.01},
    '12 legs': {'mechanisms': ['walker'], 'walker.type': 'jansen', 'walker.scale': 0.01,
                'walker.leg_pairs': 6},
    'four mechanisms': many(4),
    'sixty mechanisms': many(60),
}
# Of the motion, between two messages [ns]: a hundredth of a second or so, but never the same.
STEP = 10_000_019


class Topic(NamedTuple):
    """A topic that `kinematics` answers on."""

    name: str
    joints: bool


def topics(name: str) -> tuple[Topic, ...]:
    """Return the topics of a scene."""
    return tuple(Topic(f'{mechanism}/{what}', what == 'joint_states')
                 for mechanism in SCENES[name]['mechanisms']
                 for what in ('joint_states', 'markers'))


def write(name: str, folder: Path) -> Path:
    """Write the parameter file of a scene."""
    path = folder / f'{name.replace(" ", "_")}.yaml'
    path.write_text(yaml.safe_dump({'/**': {'ros__parameters': SCENES[name]}}))
    return path


class Cranks:
    """One crank message after the other."""

    def __init__(self, name: str):
        mechanisms = scene.read(SCENES[name]).mechanisms
        self._motions = [Motion.of(mechanism.first) for mechanism in mechanisms.values()]
        self._message = JointState(name=[f'{mechanism}_crank' for mechanism in mechanisms])
        self._count = 0

    def __next__(self) -> JointState:
        self._count += 1
        angles, speeds = zip(*(m.at(self._count * STEP) for m in self._motions))
        self._message.position, self._message.velocity = angles, speeds
        self._message.header.stamp.nanosec = self._count % 10 ** 9
        return self._message
