# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Joint states read from their bytes say what they say when they are deserialised."""

import math

import numpy as np
import pytest

pytest.importorskip('rclpy')

from linkage_ros import reading  # noqa: E402
from rclpy.serialization import deserialize_message, serialize_message  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402


def message(names, velocities=True, effort=False, frame='', seed=0):
    """Return joint states with random numbers."""
    random = np.random.default_rng(seed)
    made = JointState(name=names, position=random.normal(size=len(names)).tolist())
    made.velocity = random.normal(size=len(names) if velocities else 0).tolist()
    made.effort = random.normal(size=len(names) if effort else 0).tolist()
    made.header.frame_id = frame
    made.header.stamp.sec = int(random.integers(2 ** 31))
    made.header.stamp.nanosec = int(random.integers(10 ** 9))
    return made


@pytest.fixture
def reader(monkeypatch):
    """Return a reader whose `looked` counts the messages that it had to deserialise."""
    made = reading.Reader()
    made.looked = 0

    def counted(*args):
        made.looked += 1
        return deserialize_message(*args)

    monkeypatch.setattr(reading, 'deserialize_message', counted)
    return made


def check(reader, sent):
    """Read a message and compare."""
    turned = reader.read(serialize_message(sent))
    assert turned.stamp == sent.header.stamp and turned.names == sent.name
    assert turned.positions == tuple(sent.position)
    assert turned.velocities == tuple(sent.velocity)
    return turned


@pytest.mark.parametrize('names', [[], ['a'], ['a', 'bc'], ['leg_crank'] * 7])
@pytest.mark.parametrize('velocities', [True, False])
@pytest.mark.parametrize('effort', [True, False])
def test_a_source_is_deserialised_once(reader, names, velocities, effort):
    for seed in range(5):
        check(reader, message(names, velocities, effort, seed=seed))
    assert reader.looked == 1


def test_what_differs_in_more_than_numbers_is_deserialised(reader):
    first = check(reader, message(['a', 'b']))
    assert check(reader, message(['a', 'c'])).names is not first.names
    check(reader, message(['a', 'b'], frame='x'))
    check(reader, message(['a', 'b'], velocities=False))
    check(reader, message(['a', 'b', 'c']))
    assert reader.looked == 5


def test_sources_that_take_turns_are_each_deserialised_once(reader):
    for seed in range(5):
        for name in ('a', 'b', 'c'):
            check(reader, message([name], seed=seed))
    assert reader.looked == 3


def test_numbers_that_are_none_are_handed_on(reader):
    for _ in range(2):
        turned = reader.read(serialize_message(JointState(name=['a'], position=[math.nan])))
        assert math.isnan(turned.positions[0])
    assert reader.looked == 1


def test_more_names_than_positions_are_read_as_they_are(reader):
    for _ in range(2):
        turned = reader.read(serialize_message(JointState(name=['a', 'b'], position=[1.0])))
        assert turned.names == ['a', 'b'] and turned.positions == (1.0,)


def test_what_is_encoded_otherwise_is_always_deserialised(reader):
    sent = message(['a', 'b'])
    padded = serialize_message(sent) + bytes(4)
    for count in (1, 2, 3):
        assert reader.read(padded).positions == tuple(sent.position)
        assert reader.looked == count
