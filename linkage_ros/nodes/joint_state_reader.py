# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Read joint states from their bytes, at a tenth of the cost of deserialising them.

The messages of a source differ only in numbers. Its first message is deserialised, and the layout
of that message gives the positions of the numbers in all others.
"""

from __future__ import annotations

from array import array
from collections import OrderedDict
from contextlib import suppress
from struct import Struct
from typing import Any, Callable, Dict, NamedTuple, Optional, Set, Tuple

from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from .log import Throttle
from .message_layout import deserialized, HEADER, MessageLayout, NoLayout, pack, Unreadable

# Best effort matches every publisher; 100 messages arrive in 100 ms at 1000 Hz.
ANY = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)

# Cached sources; longest message of a cached source [bytes]; arrangements of names per length.
# Beyond that, one message in SAMPLED is analysed.
SOURCES, LONGEST, ARRANGEMENTS, SAMPLED = 256, 1 << 16, 4, 256


class Numbers(NamedTuple):
    """Content of a message: packed stamp, positions and velocities."""

    stamp: bytes
    positions: Tuple[float, ...]
    velocities: Tuple[float, ...]


def subscribe(node: Any, topic: str, receive: Callable[[bytes], None],
              failed: Callable[[], None] = lambda: None) -> None:
    """
    Subscribe a SceneNode to joint states as bytes.

    If `receive` raises Unreadable, the message is ignored with a throttled warning. Any other
    exception is reported, then `failed` is called.
    """
    throttle = Throttle(node.get_logger())

    def receive_or_ignore(text: bytes) -> None:
        try:
            receive(text)
        except Unreadable as error:
            reason = str(error)
            throttle.warn(topic, lambda: (f'{topic}: {len(text)} bytes that are no joint states '
                                          f'are ignored: {reason}'))
        except Exception as error:
            node.report(topic, error)
            failed()

    node.create_subscription(JointState, topic, receive_or_ignore, ANY, raw=True)


class Reader:
    """
    Identifies the sources of serialised joint states.

    `interpret` returns the `meaning` of a message, which all messages of its source share.
    """

    def __init__(self, interpret: Callable[[JointState], Any]):
        self._interpret = interpret
        # Masks of the significant bytes by message length; sources by masked bytes, least recently
        # used first.
        self._masks: Dict[int, Set[int]] = {}
        self._sources: OrderedDict[Tuple[int, int, int], Source] = OrderedDict()
        self._missed = 0

    def source(self, text: bytes) -> Source:
        """Return the source of a message; raise Unreadable if the bytes are no joint states."""
        size, masks = len(text), self._masks.get(len(text), set())
        number = int.from_bytes(text, 'little') if masks else 0
        for mask in masks:
            if source := self._sources.get((size, mask, number & mask)):
                self._sources.move_to_end((size, mask, number & mask))
                return source
        message = deserialized(text, JointState)
        self._missed += 1
        is_full = len(self._sources) == SOURCES or len(masks) == ARRANGEMENTS
        source = Source(text, message, self._interpret(message),
                        size <= LONGEST and not (is_full and self._missed % SAMPLED))
        if source.size and (source.mask in masks or len(masks) < ARRANGEMENTS):
            if len(self._sources) == SOURCES:
                self._drop_oldest()
            self._masks.setdefault(size, set()).add(source.mask)
            self._sources[size, source.mask, source.same] = source
        return source

    def _drop_oldest(self) -> None:
        (size, mask, _), _ = self._sources.popitem(last=False)
        if not any(key[:2] == (size, mask) for key in self._sources):
            self._masks[size].remove(mask)
            if not self._masks[size]:
                del self._masks[size]


class Source:
    """
    Identification of a source's messages, and the places of their numbers.

    Attributes
    ----------
    size, same, mask : int
        Length of its messages, 0 if each is deserialised; the bytes that they share and the mask
        of these bytes, as integers.
    positions, velocities : int
        Offsets in a message.

    """

    def __init__(self, text: bytes, message: JointState, meaning: Any, is_lasting: bool):
        self.meaning, self.size = meaning, 0
        numbers = Numbers(pack(message.header.stamp), tuple(message.position),
                          tuple(message.velocity))
        self._only: Tuple[bytes, Optional[Numbers]] = text, numbers
        if is_lasting:
            with suppress(NoLayout):
                self._lay_out(text, MessageLayout(text, message), numbers)

    def _lay_out(self, text: bytes, layout: MessageLayout, numbers: Numbers) -> None:
        (self.positions, self._first), (self.velocities, count) = layout.numbers[:2]
        end = self.positions + 8 * self._first
        self._unpack = Struct(f'<{HEADER}x8s{self.positions - HEADER - 8}x{self._first}d'
                              f'{self.velocities - end}x{count}d').unpack_from
        # Integers are the fastest to compare and look up for messages this short.
        self.mask = int.from_bytes(layout.fixed, 'little')
        self.same = int.from_bytes(text, 'little') & self.mask
        if _bits(self._unpacked(text)) == _bits(numbers):
            self.size, self._only = len(text), (b'', None)

    def is_of(self, text: bytes) -> bool:
        """Return whether a message is of this source."""
        if not self.size:
            return text is self._only[0]
        return len(text) == self.size and int.from_bytes(text, 'little') & self.mask == self.same

    def read(self, text: bytes) -> Numbers:
        """Read a message of this source."""
        return self._only[1] or self._unpacked(text)

    def _unpacked(self, text: bytes) -> Numbers:
        numbers, end = self._unpack(text), 1 + self._first
        return Numbers(numbers[0], numbers[1:end], numbers[end:])


def _bits(numbers: Numbers) -> tuple:
    """Return the numbers as bytes, in which NaN is equal to itself."""
    return numbers.stamp, *(array('d', each).tobytes()
                            for each in (numbers.positions, numbers.velocities))
