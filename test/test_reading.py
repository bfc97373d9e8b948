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

from linkage_ros import reading, wire  # noqa: E402
from linkage_ros.kinematics import Kinematics  # noqa: E402
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


@pytest.fixture
def check(graph, reader):
    """Return a function that sends a message, reads what arrives, and compares."""
    publisher = graph.node.create_publisher(JointState, 'sent', 10)
    arrived = []
    graph.node.create_subscription(JointState, 'sent', arrived.append, 10, raw=True)
    graph.until(publisher.get_subscription_count)

    def check(sent):
        arrived.clear()
        publisher.publish(sent)
        graph.until(lambda: arrived)
        return compare(reader, arrived[0], sent)
    return check


def compare(reader, text, sent):
    """Read what arrived and compare it with what was sent."""
    turned = reader.read(text)
    assert wire.unpack(turned.stamp) == sent.header.stamp and turned.names == sent.name
    assert turned.positions == tuple(sent.position)
    assert turned.velocities == tuple(sent.velocity)
    return turned


@pytest.mark.parametrize('names', [[], ['a'], ['a', 'bc'], ['leg_crank'] * 7])
@pytest.mark.parametrize('velocities', [True, False])
@pytest.mark.parametrize('effort', [True, False])
def test_a_source_is_hardly_ever_deserialised(reader, check, names, velocities, effort):
    for seed in range(30):
        check(message(names, velocities, effort, seed=seed))
    # What pads its strings is left as it was in memory, and may take a few looks to tell.
    assert reader.looked <= 5


def test_what_differs_in_more_than_numbers_is_deserialised(reader, check):
    first = check(message(['a', 'b']))
    assert check(message(['a', 'c'])).names is not first.names
    check(message(['a', 'b'], frame='x'))
    check(message(['a', 'b'], velocities=False))
    check(message(['a', 'b', 'c']))
    assert reader.looked == 5


def test_sources_that_take_turns_are_hardly_ever_deserialised(reader, check):
    for seed in range(20):
        for name in ('a', 'b', 'c'):
            check(message([name], seed=seed))
    assert reader.looked <= 15


def test_bytes_of_another_order_are_deserialised(reader):
    sent = message(['a', 'b'])
    text = bytearray(serialize_message(sent))
    read = reading.Layout(['a', 'b'], message(['a', 'b']), len(text))
    assert not read.admit(bytes(text), reading.Turned(
        wire.pack(sent.header.stamp), sent.name, tuple(-x for x in sent.position),
        tuple(sent.velocity)))


def test_numbers_that_are_none_are_handed_on(reader):
    for _ in range(2):
        turned = reader.read(serialize_message(JointState(name=['a'], position=[math.nan])))
        assert math.isnan(turned.positions[0])


def test_more_names_than_positions_are_read_as_they_are(reader):
    for _ in range(2):
        turned = reader.read(serialize_message(JointState(name=['a', 'b'], position=[1.0])))
        assert turned.names == ['a', 'b'] and turned.positions == (1.0,)


def test_what_is_encoded_otherwise_is_always_deserialised(reader):
    sent = message(['a', 'b'])
    longer = serialize_message(sent) + bytes(8)
    for count in (1, 2, 3):
        assert reader.read(longer).positions == tuple(sent.position)
        assert reader.looked == count


def test_the_node_hardly_ever_deserialises_a_message_of_a_source(graph, reader):
    graph.start(Kinematics)
    turn = graph.crank(['jansen_crank'])
    heard = graph.listen(JointState, 'jansen/joint_states')
    for theta in range(20):
        assert turn([float(theta)], heard, [1.0]).position[0] == theta
    assert reader.looked <= 5
