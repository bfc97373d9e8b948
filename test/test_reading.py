# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Joint states read from their bytes say what they say when they are deserialised."""

import gc
import math
import struct
from types import FunctionType, ModuleType

from linkage_ros.nodes import message_layout
from linkage_ros.nodes.message_layout import MIN_BYTES, Unreadable
import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState


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
def reader():
    """Return a reader whose `looked` counts the messages that it had to deserialise."""
    def interpret(message):
        made.looked += 1
        return message.name

    made = message_layout.Reader(interpret)
    made.looked = 0
    return made


def compare(reader, text, sent):
    """Read what arrived and compare it with what was sent."""
    routes, (stamp, *numbers) = reader.read(text)
    assert routes == sent.name
    assert message_layout.unpack(stamp) == sent.header.stamp
    assert numbers == [*sent.position, *sent.velocity]


@pytest.mark.nightly(all_but=6)
@pytest.mark.parametrize('names', [[], ['a'], ['a', 'bc'], ['leg_crank'] * 7])
@pytest.mark.parametrize('velocities', [True, False])
@pytest.mark.parametrize('effort', [True, False])
def test_a_sender_is_hardly_ever_deserialised(graph, reader, names, velocities, effort):
    arrived = []
    graph.node.create_subscription(JointState, 'sent', arrived.append, 10, raw=True)
    publisher = graph.publisher(JointState, 'sent')
    for seed in range(30):
        sent = message(names, velocities, effort, seed=seed)
        publisher.publish(sent)
        compare(reader, graph.until(lambda: arrived).pop(), sent)
    assert reader.looked == 1


def big_endian(made):
    """Return joint states as a machine of the other byte order writes them."""
    text = bytearray(b'\0\0\0\0')

    def put(size, code, *values):
        text.extend(bytes(-(len(text) - 4) % size) + struct.pack(f'>{len(values)}{code}', *values))

    put(4, 'I', made.header.stamp.sec, made.header.stamp.nanosec)
    for names in ([made.header.frame_id], made.name):
        if names is made.name:
            put(4, 'I', len(names))
        for name in names:
            put(4, 'I', len(name) + 1)
            text.extend(name.encode() + b'\0')
    for numbers in (made.position, made.velocity, made.effort):
        put(4, 'I', len(numbers))
        if len(numbers):
            put(8, 'd', *numbers)
    return bytes(text)


@pytest.mark.parametrize('names', [['a', 'bc'], []])
def test_bytes_of_another_order_are_always_deserialised(reader, names):
    for seed in range(4):
        sent = message(names, effort=True, frame='x', seed=seed)
        compare(reader, big_endian(sent), sent)
    assert reader.looked == 4


def test_a_sender_whose_first_number_is_none_is_learnt(reader):
    for numbers in ([math.nan, -0.0], [1.0, math.inf]):
        sent = JointState(name=['a', 'b'], position=numbers)
        assert repr(reader.read(serialize_message(sent))[1][1:]) == repr((*numbers,))
    assert reader.looked == 1


def held(owner):
    """Return how many objects an object holds, itself and by way of others."""
    objects, waiting = {}, [owner]
    while waiting:
        one = waiting.pop()
        if id(one) not in objects and not isinstance(one, (type, FunctionType, ModuleType)):
            objects[id(one)] = one
            waiting.extend(gc.get_referents(one))
    return len(objects)


def test_what_is_remembered_is_bounded_whatever_comes(reader):
    def after(senders):
        for i in senders:
            text = serialize_message(message([f'{i:09}']))
            reader.read(text)
            reader.read(text)
        assert reader.looked == senders[-1] + 1
        return held(reader)

    first = held(reader)
    full = after(range(message_layout.MAX_SENDERS))
    assert first + message_layout.MAX_SENDERS < full
    assert after(range(message_layout.MAX_SENDERS, 1000)) <= full


def outcome(errors, *args):
    """Return what some bytes say, as text in which what is no number equals itself, or 'bad'."""
    try:
        return repr(errors(*args))
    except Unreadable:
        return 'bad'


def plainly(text):
    """Return what `read` is to return."""
    if len(text) < MIN_BYTES:
        raise Unreadable
    try:
        made = deserialize_message(text, JointState)
    except Exception:
        raise Unreadable from None
    return made.name, (message_layout.pack(made.header.stamp), *made.position, *made.velocity)


def mutated(random, text):
    """Return a message of which something is otherwise."""
    text = bytearray(text)
    for _ in range(random.integers(1, 4)):
        place = int(random.integers(len(text)))
        kind = random.integers(6)
        if kind == 0:
            text[place] = random.integers(256)
        elif kind == 1:
            del text[place:]
        elif kind == 2:
            text[place:place + 4] = struct.pack('<I', random.choice(
                [0, 1, 2, 3, 255, 2 ** 16, 2 ** 31, 2 ** 32 - 1, random.integers(2 ** 32)]))
        elif kind == 3:
            text[place:place] = random.bytes(int(random.integers(1, 9)))
        elif kind == 4:
            text[place:place + 8] = struct.pack('<d', random.choice(
                [math.nan, math.inf, -math.inf, 1e308, -0.0, 5e-324]))
        else:
            text[place] = 0
        text = text or bytearray(1)
    return bytes(text)


SEEDS = {
    'short': message(['a']), 'two': message(['a_crank', 'b'], frame='world'),
    'efforts': message(['leg_crank'] * 3, effort=True), 'none': message([]),
    'no velocities': message(['ab', 'abc', 'abcd'], velocities=False),
    'nameless': JointState(position=[1.0, 2.0]), 'names': JointState(name=['a', 'b', 'c'])}


@pytest.mark.nightly(all_but=3)
@pytest.mark.parametrize('seed', SEEDS)
def test_mutated_messages_read_as_they_do_when_they_are_deserialised(reader, seed):
    random = np.random.default_rng(len(seed))
    base = serialize_message(SEEDS[seed])
    for _ in range(300):
        text = mutated(random, base)
        # What is learnt from one is tried on the next, which differs in a little.
        for tried in (text, text, mutated(random, text), text, base):
            assert outcome(reader.read, tried) == outcome(plainly, tried)
    assert reader.looked < 300 * 5 - 400


def test_no_claim_of_padding_makes_a_short_message_dangerous(reader):
    whole = serialize_message(JointState())
    for options in range(256):
        for size in range(MIN_BYTES):
            with pytest.raises(Unreadable):
                reader.read((b'\0\1\0' + bytes([options]) + whole[4:])[:size])
    for options in range(0, 256, 5):
        for size in range(MIN_BYTES, len(whole)):
            text = (b'\0\1\0' + bytes([options]) + whole[4:])[:size]
            assert outcome(reader.read, text) == outcome(plainly, text)


@pytest.mark.parametrize('name', [b'a\0b\0', b'ab\0\0', b'abcd', b'\0\0\0\0', b'\xc3(\xff\0'])
def test_a_name_with_odd_ends_stands_for_no_other(reader, name):
    base = serialize_message(message(['abc']))
    text = base.replace(b'abc\0', name)
    for tried in (text, text, text, base, base, base, text.replace(b'\4\0\0\0', b'\2\0\0\0')):
        assert outcome(reader.read, tried) == outcome(plainly, tried)
