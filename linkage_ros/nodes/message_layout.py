# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Serialised messages, read and written at the places of their numbers.

Consecutive messages of a publisher differ only in stamps and in the float64 of sequences. Of each
sender of joint states the first message is deserialised; its layout gives the places of the
numbers in all others. In own messages, these places are seen in one with a stamp and values that
no other has. Both are faster than to deserialise and serialise each message.
"""

from __future__ import annotations

from contextlib import suppress
import re
from struct import error as StructError, Struct
from typing import Any, Callable, NamedTuple, Sequence

from builtin_interfaces.msg import Time
import numpy as np
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from .log import Throttle

# Length of the encapsulation header [bytes]; alignment counts from its end.
HEADER = 4
LEAD = bytes(8 - HEADER)
# Shorter messages [bytes] are refused: a middleware that trusts the padding length in the header
# reads beyond their end, and may crash.
MIN_BYTES = 8
# The packed stamp of a message whose publisher has not set it: time zero.
NEVER = bytes(8)
# Stamp and first value that mark their places in a template: as integers, values are this and the
# next. A field beside padding, which has any bytes, is not half of one.
MARKED_STAMP, MARKED_VALUE = Time(sec=0x2C83A6F1, nanosec=0x1E94B7D5), 0x01708A3D5A1C3E77

# Best effort matches publishers of any reliability. At 1000 Hz, the queue holds 100 ms.
ANY = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
# Maximum number of known senders; when it is reached, they are learnt anew.
MAX_SENDERS = 256

_STAMP, _COUNT = Struct('<iI'), Struct('<I')

# A packed stamp (bytes), then floats.
Numbers = tuple[Any, ...]
# A function of a publisher, and the serialised message that it publishes.
Outgoing = tuple[Callable[[bytes], None], bytes]


def pack(stamp: Time) -> bytes:
    """Return a Time as eight bytes, little-endian: int32 seconds, uint32 nanoseconds."""
    return _STAMP.pack(stamp.sec, stamp.nanosec)


def pack_time(nanoseconds: int) -> bytes:
    """Return a time [ns] as `pack` does."""
    return _STAMP.pack(*divmod(nanoseconds, 10 ** 9))


def unpack(stamp: bytes) -> Time:
    """Return the Time that `pack` has packed."""
    sec, nanosec = _STAMP.unpack(stamp)
    return Time(sec=sec, nanosec=nanosec)


class Unreadable(ValueError):
    """A message that cannot be deserialised; the exception's text has the reason."""


def deserialized(data: bytes, kind: type) -> Any:
    """Deserialise a message of type `kind`; raise Unreadable if `data` is none."""
    if len(data) < MIN_BYTES:
        raise Unreadable(f'it must have at least {MIN_BYTES} bytes')
    try:
        return deserialize_message(data, kind)
    except Exception as error:
        # Each middleware has its own error types.
        raise Unreadable(' '.join(str(error).split())[:200]) from None


def subscribe(node: Any, topic: str, interpret: Callable[[JointState], Any],
              receive: Callable[[Any, bytes, Numbers], None]) -> Reader:
    """
    Subscribe a SceneNode to joint states; return the reader, see there for `interpret`.

    `receive` is called with the routes, the packed stamp (now, if the message has none) and the
    numbers of each message. A message that is unreadable is ignored with a throttled warning. Any
    other exception is reported.
    """
    reader, clock, throttle = Reader(interpret), node.get_clock(), Throttle(node.get_logger())
    name = node.resolve_topic_name(topic)

    def receive_or_ignore(data: bytes) -> None:
        try:
            routes, numbers = reader.read(data)
            stamp = numbers[0]
            receive(routes, pack_time(clock.now().nanoseconds) if stamp == NEVER else stamp,
                    numbers)
        except Unreadable as error:
            reason = str(error)
            throttle.warn(name, lambda: (f'{name}: a message of {len(data)} bytes is ignored, '
                                         f'since it is no JointState: {reason}'))
        except Exception as error:
            node.report(name, error)

    node.create_subscription(JointState, topic, receive_or_ignore, ANY, raw=True)
    return reader


class Sender(NamedTuple):
    """The constant bytes of a sender's messages, and the places of their numbers."""

    # What `interpret` returned for its first message.
    routes: Any
    # Length of its messages [bytes], their constant bytes as an integer, and 0 where they vary:
    # integers are the fastest to compare for messages this short.
    size: int
    constant: int
    mask: int
    unpack: Callable[[bytes], Numbers]

    def has_sent(self, data: bytes) -> bool:
        """Return whether a serialised message has this sender's length and constant bytes."""
        return (len(data) == self.size
                and int.from_bytes(data, 'little') & self.mask == self.constant)


class Reader:
    """
    Cache of the senders of serialised joint states.

    `interpret` is called with the first message of each sender. Its result are the `routes` of all
    messages of this sender, so it must not depend on the numbers in the message.
    """

    def __init__(self, interpret: Callable[[JointState], Any]):
        self._interpret = interpret
        self._senders: list[Sender] = []
        self._last: Sender | None = None

    def forget(self) -> None:
        """Forget all senders, so that their messages are interpreted anew."""
        self._senders, self._last = [], None

    def read(self, data: bytes) -> tuple[Any, Numbers]:
        """
        Return the routes and the numbers of a serialised message.

        The numbers are the stamp (see `pack`), the positions [rad or m], then the velocities [per
        second] if there are any. Raises Unreadable if the message is no JointState.
        """
        last = self._last
        if last is None or not last.has_sent(data):
            last = self._last = next(
                (sender for sender in self._senders if sender.has_sent(data)), None)
        return (last.routes, last.unpack(data)) if last else self._learn(data)

    def _learn(self, data: bytes) -> tuple[Any, Numbers]:
        message = deserialized(data, JointState)
        routes = self._interpret(message)
        numbers = pack(message.header.stamp), *message.position, *message.velocity
        with suppress(StructError):
            mask, unpack = _layout(data)
            # As text, because as a number, NaN is unequal to itself.
            if repr(unpack(data)) == repr(numbers):
                if len(self._senders) == MAX_SENDERS:
                    self._senders.clear()
                self._last = Sender(
                    routes, len(data), int.from_bytes(data, 'little') & mask, mask, unpack)
                self._senders.append(self._last)
        return routes, numbers


def _layout(data: bytes) -> tuple[int, Callable[[bytes], Numbers]]:
    """
    Return where the constant bytes and the numbers of a serialised JointState are.

    That is a mask, 0 at stamp, numbers and padding, and the function that unpacks stamp, positions
    and velocities, as little-endian CDR has them. Raises StructError if that is shorter.
    """
    mask, place = bytearray(len(data)), HEADER + 8
    mask[:HEADER] = HEADER * b'\xff'

    def count() -> int:
        return int(_COUNT.unpack_from(data, constant(_COUNT.size, _COUNT.size))[0])

    def constant(size: int, alignment: int = 1) -> int:
        nonlocal place
        start = place + (HEADER - place) % alignment
        place = start + size
        if place > len(data):
            raise StructError
        mask[start:place] = size * b'\xff'
        return start

    # The frame, and the names.
    constant(count())
    for _ in range(count()):
        constant(count())
    places, end = f'<{HEADER}x8s', HEADER + 8
    for code, width in (('d', 1), ('d', 1), ('x', 8)):
        number = count()
        start = place + (HEADER - place) % 8 if number else place
        places += f'{start - end}x{width * number}{code}'
        place = end = start + 8 * number
    return int.from_bytes(mask, 'little'), Struct(places).unpack_from


class PatchedMessages:
    """
    Serialised messages whose stamps and float64 values are patched in place.

    `parts` are, for each message, the function that publishes it, and one that builds it of a Time
    and an array (count,), whose values it only copies.
    """

    def __init__(self, parts: Sequence[tuple[Callable, Callable]], count: int):
        # In messages of a stamp and values that no others have, these mark their places.
        marks = (MARKED_VALUE + np.arange(count)).view(float)
        self._bytes, places = bytearray(), []
        for _, build in parts:
            data = serialize_message(build(MARKED_STAMP, marks))
            # Numbers are aligned to 8 bytes after the header; LEAD aligns them in memory, too.
            start = len(self._bytes) + len(LEAD)
            self._bytes += LEAD + data + bytes(-(len(data) - HEADER) % 8)
            places.append(slice(start, start + len(data)))
        self._stamps = [slice(*match.span()) for match in re.finditer(
            re.escape(pack(MARKED_STAMP)), self._bytes)]
        if len(self._stamps) < len(parts):
            raise RuntimeError('the middleware does not serialise to little-endian CDR')
        self._messages = [(publish, memoryview(self._bytes)[place])
                          for (publish, _), place in zip(parts, places)]
        self._numbers = np.frombuffer(self._bytes, float)
        # The values, then all eight-byte words of the messages.
        self._table = np.concatenate([marks, self._numbers])
        self._values = self._table[:count]
        indices = self._numbers.view(np.int64) - MARKED_VALUE
        self._sources = np.where((0 <= indices) & (indices < count), indices,
                                 np.arange(count, len(self._table)))

    def patched(self, stamp: bytes, values: Any) -> list[Outgoing]:
        """Return the messages with a packed stamp and values (count,), and what publishes each."""
        self._values[:] = values
        self._table.take(self._sources, None, self._numbers, 'clip')
        data = self._bytes
        for place in self._stamps:
            data[place] = stamp
        return [(publish, bytes(message)) for publish, message in self._messages]
