# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Read the numbers of joint states from serialised messages, faster than by deserialising them.

The messages of one sender have the same joint names and differ only in numbers. The first message
is deserialised; its layout gives the places of the numbers in all others.
"""

from __future__ import annotations

from array import array
from contextlib import suppress
from struct import error as StructError, Struct
from typing import Any, Callable, List, Optional, Tuple

from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from .log import Throttle
from .message_layout import deserialized, HEADER, LITTLE_ENDIAN, pack, Unreadable

# Best effort matches publishers of any reliability. At 1000 Hz, the queue holds 100 ms.
ANY = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)

# Maximum number of known senders; when it is reached, they are learnt anew.
MAX_SENDERS = 256
# Messages longer than this [bytes] are always deserialised.
MAX_LAYOUT_BYTES = 1 << 16

COUNT = Struct('<I')

# A packed stamp (bytes), then floats.
Numbers = Tuple[Any, ...]


def subscribe(node: Any, topic: str, receive: Callable[[bytes], None]) -> None:
    """
    Subscribe a SceneNode to joint states; `receive` is called with each serialised message.

    If it raises Unreadable, a throttled warning is logged. Any other exception is reported.
    """
    throttle = Throttle(node.get_logger())

    def receive_or_ignore(data: bytes) -> None:
        try:
            receive(data)
        except Unreadable as error:
            reason = str(error)
            throttle.warn(topic, lambda: (f'{topic}: a message of {len(data)} bytes is ignored, '
                                          f'since it is no JointState: {reason}'))
        except Exception as error:
            node.report(topic, error)

    node.create_subscription(JointState, topic, receive_or_ignore, ANY, raw=True)


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

    def sender(self, data: bytes) -> Sender:
        """Return the sender of a serialised message; raise Unreadable if it is no JointState."""
        if self._last is None or not self._last.has_sent(data):
            known = (sender for sender in self._senders if sender.has_sent(data))
            self._last = next(known, None) or self._new(data)
        return self._last

    def _new(self, data: bytes) -> Sender:
        message = deserialized(data, JointState)
        sender = Sender(data, message, self._interpret(message))
        if sender.size:
            if len(self._senders) == MAX_SENDERS:
                self._senders.clear()
            self._senders.append(sender)
        return sender


class Sender:
    """
    The constant bytes of a sender's messages, and the places of their numbers.

    Attributes
    ----------
    routes : object
        What `interpret` returned for its first message.
    size : int
        Length of its messages [bytes]; 0: places are unknown, so that it reads its first message
        only.

    """

    def __init__(self, data: bytes, message: JointState, routes: Any):
        self.routes, self.size = routes, 0
        self._numbers: Optional[Numbers] = (
            pack(message.header.stamp), *message.position, *message.velocity)
        if len(data) <= MAX_LAYOUT_BYTES:
            with suppress(StructError):
                mask, places = _layout(data)
                unpack = Struct(places).unpack_from
                if _bits(unpack(data)) == _bits(self._numbers):
                    # Integers are the fastest to compare for messages this short.
                    self.size, self._mask = len(data), int.from_bytes(mask, 'little')
                    self._same = int.from_bytes(data, 'little') & self._mask
                    self._numbers, self._unpack = None, unpack

    def has_sent(self, data: bytes) -> bool:
        """Return whether a serialised message has this sender's known length and bytes."""
        return (len(data) == self.size > 0
                and int.from_bytes(data, 'little') & self._mask == self._same)

    def read(self, data: bytes) -> Numbers:
        """
        Return the numbers of one of this sender's messages.

        They are the stamp (see `pack`), the positions [rad or m], then the velocities [per second]
        if there are any.
        """
        return self._numbers or self._unpack(data)


def _bits(numbers: Any) -> tuple:
    """Return the numbers as bytes, because as a float, NaN is unequal to itself."""
    return numbers[0], array('d', numbers[1:]).tobytes()


def _layout(data: bytes) -> Tuple[bytearray, str]:
    """
    Return where the constant bytes and the numbers of a serialised JointState are.

    That is a mask, 0 at stamp, numbers and padding, and the format of stamp, positions and
    velocities. Raises StructError if the message is not in little-endian CDR.
    """
    if not data.startswith(LITTLE_ENDIAN):
        raise StructError
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
    return mask, places
