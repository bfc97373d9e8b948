# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Messages that are serialised once and patched in place.

Where the values of a message lie among its bytes is found by serialising values that occur nowhere
else, so nothing here knows a message type or the wire format. What was found is tried before it is
used: a patched message has to read back equal to one that is built.
"""

import struct
from typing import Callable

from builtin_interfaces.msg import Time
import numpy as np
from rclpy.serialization import deserialize_message, serialize_message

# The bytes that say how a message is encoded; what follows is aligned from its end.
HEADER = 4
LEAD = bytes(8 - HEADER)
# Of fewer bytes no message is made. A middleware that takes the sender's word for how many of them
# are padding looks beyond the end, and may end the process.
SHORTEST = 8

_STAMP = struct.Struct('=iI')
SENTINEL = Time(sec=0x5EC0_1234, nanosec=0x2A0C_4321)


def pack(stamp: Time) -> bytes:
    """Return a stamp as it is in a message."""
    return _STAMP.pack(stamp.sec, stamp.nanosec)


def unpack(stamp: bytes) -> Time:
    """Return the stamp that some bytes of a message are."""
    sec, nanosec = _STAMP.unpack(stamp)
    return Time(sec=sec, nanosec=nanosec)


class Unreadable(ValueError):
    """A message that cannot be deserialised; the text says why."""


def deserialized(text: bytes, kind: type):
    """Return a message from its bytes; raise Unreadable if they are none of its kind."""
    if len(text) < SHORTEST:
        raise Unreadable(f'there must be {SHORTEST} at least')
    try:
        return deserialize_message(text, kind)
    except Exception as error:
        # Each middleware has errors of its own.
        raise Unreadable(' '.join(str(error).split())[:200]) from None


class NoTemplate(Exception):
    """A message that cannot be patched in place."""


class Template:
    """
    The bytes of a message whose stamp and float64 values change.

    Parameters
    ----------
    build : callable
        From a stamp and `count` floats, an array, to a message that shows some of them.
    count : int
        How many values the message is made from.

    Raises
    ------
    NoTemplate
        If a patched message reads differently from one that is built.

    """

    def __init__(self, build: Callable, count: int):
        values = distinct(count)
        message = build(SENTINEL, values)
        text = serialize_message(message)
        # Numbers lie at multiples of 8 after the header; in memory too they are quicker there.
        self._bytes = bytearray(LEAD + text + bytes(-(len(text) - HEADER) % 8))
        self._stamps = [slice(place, place + _STAMP.size)
                        for place in places(self._bytes, pack(SENTINEL))]
        self._message = memoryview(self._bytes)[len(LEAD):len(LEAD) + len(text)]
        self._numbers = np.frombuffer(self._bytes, float, offset=len(LEAD) + HEADER)
        # Every number comes from one table: the values, then what the message has said so far.
        self._table = np.concatenate([values, self._numbers])
        self._values = self._table[:count]
        found = {value: i for i, value in enumerate(values.tolist())}
        self._sources = np.array([found.get(number, count + slot)
                                  for slot, number in enumerate(self._numbers.tolist())], int)
        self._check(build, type(message), count)

    def patched(self, stamp: bytes, values: np.ndarray) -> bytes:
        """Return the message with this stamp, packed, and these values, serialised."""
        self._values[:] = values
        self._table.take(self._sources, out=self._numbers, mode='clip')
        for place in self._stamps:
            self._bytes[place] = stamp
        return bytes(self._message)

    def _check(self, build, kind, count):
        stamp, values = Time(sec=12, nanosec=345), np.linspace(-1.5, 7.25, count)
        built = serialize_message(build(stamp, values))
        if deserialize_message(self.patched(pack(stamp), values), kind) != deserialize_message(
                built, kind):
            raise NoTemplate('a patched message does not read back as it was written')


class Wire:
    """
    A publisher of one message that is sent again and again with other values.

    Parameters
    ----------
    publisher : rclpy.publisher.Publisher
        Where it goes.
    build, count
        As for Template.
    logger : rclpy logger
        Told once if messages have to be built one by one.

    """

    def __init__(self, publisher, build: Callable, count: int, logger):
        self._publisher = publisher
        self._build = build
        try:
            self._template = Template(build, count)
        except NoTemplate as reason:
            self._template = None
            logger.warning(f'{publisher.topic_name}: {reason}; publishing ordinary messages',
                           once=True)

    def send(self, stamp: bytes, values: np.ndarray):
        """Publish the message with this stamp, packed, and these values."""
        if self._template:
            self._publisher.publish(self._template.patched(stamp, values))
        else:
            self._publisher.publish(self._build(unpack(stamp), values))


def distinct(count: int) -> np.ndarray:
    """Return numbers of which no other bytes of a message are made."""
    return -1.2345678901234567e+201 * (1.0 + np.arange(count) / (count + 1.0))


def places(text: bytearray, wanted: bytes) -> list:
    """Return where some bytes stand."""
    found, place = [], text.find(wanted)
    while place >= 0:
        found.append(place)
        place = text.find(wanted, place + 1)
    return found
