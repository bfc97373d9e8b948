# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Read the numbers of joint states from serialised messages, faster than by deserialising them.

The messages of one sender have the same joint names and differ only in numbers. The first message
is deserialised; its layout gives the places of the numbers in all others.
"""

from __future__ import annotations

from contextlib import suppress
from struct import error as StructError, Struct
from typing import Any, Callable, List, NamedTuple, Optional, Tuple

from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from .log import Throttle
from .message_layout import (
    deserialized,
    HEADER,
    NEVER,
    pack,
    pack_time,
    Unreadable,
)

# Best effort matches publishers of any reliability. At 1000 Hz, the queue holds 100 ms.
ANY = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)

# Maximum number of known senders; when it is reached, they are learnt anew.
MAX_SENDERS = 256

COUNT = Struct('<I')

# A packed stamp (bytes), then floats.
Numbers = Tuple[Any, ...]


def subscribe(node: Any, topic: str, interpret: Callable[[JointState], Any],
              receive: Callable[[Any, bytes, Numbers], None]) -> Reader:
    """
    Subscribe a SceneNode to joint states; return the reader, see there for `interpret`.

    `receive` is called with the routes, the packed stamp (now, if the message has none) and the
    numbers of each message. A message that is unreadable is ignored with a throttled warning. Any
    other exception is reported.
    """
    reader, clock, throttle = Reader(interpret), node.get_clock(), Throttle(node.get_logger())

    def receive_or_ignore(data: bytes) -> None:
        try:
            routes, numbers = reader.read(data)
            stamp = numbers[0]
            receive(routes, pack_time(clock.now().nanoseconds) if stamp == NEVER else stamp,
                    numbers)
        except Unreadable as error:
            reason = str(error)
            throttle.warn(topic, lambda: (f'{topic}: a message of {len(data)} bytes is ignored, '
                                          f'since it is no JointState: {reason}'))
        except Exception as error:
            node.report(topic, error)

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
        self._senders: List[Sender] = []
        self._last: Optional[Sender] = None

    def forget(self) -> None:
        """Forget all senders, so that their messages are interpreted anew."""
        self._senders, self._last = [], None

    def read(self, data: bytes) -> Tuple[Any, Numbers]:
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

    def _learn(self, data: bytes) -> Tuple[Any, Numbers]:
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


def _layout(data: bytes) -> Tuple[int, Callable[[bytes], Numbers]]:
    """
    Return where the constant bytes and the numbers of a serialised JointState are.

    That is a mask, 0 at stamp, numbers and padding, and the function that unpacks stamp, positions
    and velocities, as little-endian CDR has them. Raises StructError if that is shorter.
    """
    mask, place = bytearray(len(data)), HEADER + 8
    mask[:HEADER] = HEADER * b'\xff'

    def count() -> int:
        return int(COUNT.unpack_from(data, constant(COUNT.size, COUNT.size))[0])

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
