# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Joint states read from their bytes, which costs a tenth of deserialising them.

Of each source, whose messages differ in numbers alone, the first message is deserialised; the
numbers of the others are taken from where the layout of that one says that they lie.
"""

from array import array
from collections import OrderedDict
from struct import Struct
from typing import Any, Callable, NamedTuple, Optional, Tuple

from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from .message_layout import deserialized, HEADER, MessageLayout, NoLayout, pack

# Any source will do; what comes while the node is kept waiting, 100 ms at 1000 Hz, is not lost.
ANY = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)

# So many sources are remembered, of messages that are no longer [bytes]; of those that are of one
# length, so many arrangements of names. Where there are more, one in so many messages is learnt:
# that costs more than it saves if the source is soon forgotten.
SOURCES, LONGEST, ARRANGEMENTS, SAMPLED = 256, 1 << 16, 4, 256


class JointStateNumbers(NamedTuple):
    """What a source was understood as, positions and, where they are known, velocities."""

    stamp: bytes
    source: Any
    positions: Tuple[float, ...]
    velocities: Tuple[float, ...]


class Reader:
    """
    Reads serialised joint states.

    Parameters
    ----------
    understand : callable
        From a message to what is handed on with it and with all that differ in numbers alone.

    """

    def __init__(self, understand: Callable[[JointState], Any]):
        self._understand = understand
        # By length, then by the bytes that count: a mask, and the sources by those bytes.
        self._sources = {}
        # The same ones, the latest used last.
        self._used = OrderedDict()
        self._missed = 0

    def source(self, text: bytes) -> Optional['Source']:
        """Return the source of a message, if it is remembered."""
        alike = self._sources.get(len(text))
        number = alike and int.from_bytes(text, 'little')
        for mask, sources in (alike or {}).items():
            if source := sources.get(number & mask):
                self._used.move_to_end(source)
                return source
        return None

    def read(self, text: bytes) -> JointStateNumbers:
        """Return what a message says; raise Unreadable if that cannot be told."""
        if source := self.source(text):
            return source.take(text)
        alike = self._sources.get(len(text), {})
        message = deserialized(text, JointState)
        said = JointStateNumbers(pack(message.header.stamp), self._understand(message),
                                 tuple(message.position), tuple(message.velocity))
        self._missed += 1
        crowded = len(self._used) == SOURCES or len(alike) == ARRANGEMENTS
        if len(text) <= LONGEST and not (crowded and self._missed % SAMPLED):
            self._learn(text, message, said)
        return said

    def _learn(self, text, message, said):
        try:
            source = Source(text, message, said)
        except NoLayout:
            return
        alike = self._sources.get(source.size, {})
        if source.mask not in alike and len(alike) == ARRANGEMENTS:
            return
        if len(self._used) == SOURCES:
            self._forget(self._used.popitem(last=False)[0])
        self._sources.setdefault(source.size, {}).setdefault(source.mask, {})[source.same] = source
        self._used[source] = True

    def _forget(self, source):
        alike = self._sources[source.size]
        del alike[source.mask][source.same]
        if not alike[source.mask]:
            del alike[source.mask]
        if not alike:
            del self._sources[source.size]


class Source:
    """
    How messages of a source are told from others, and how their numbers are taken.

    Attributes
    ----------
    size, same, mask : int
        How long they are; which bytes they have, as a number, where a mask has ones.
    positions, velocities : int
        Where in a message these begin.
    understood
        What is handed on with them.

    """

    def __init__(self, text: bytes, message: JointState, said: JointStateNumbers):
        layout = MessageLayout(text, message)
        (place, self._first), (then, count) = layout.numbers[:2]
        self.positions, self.velocities = place, then
        end = place + 8 * self._first
        self._unpack = Struct(f'<{HEADER}x8s{place - HEADER - 8}x{self._first}d'
                              f'{then - end}x{count}d').unpack_from
        self.understood = said.source
        if _bits(self.take(text)) != _bits(said):
            raise NoLayout('its numbers are others')
        # As numbers: with messages as short as these that is the quickest to compare and look up.
        self.size, self.mask = len(text), int.from_bytes(layout.fixed, 'little')
        self.same = int.from_bytes(text, 'little') & self.mask

    def take(self, text: bytes) -> JointStateNumbers:
        """Return what a message says that has the same bytes where they count."""
        numbers, end = self._unpack(text), 1 + self._first
        return JointStateNumbers(numbers[0], self.understood, numbers[1:end], numbers[end:])


def _bits(said):
    """Return the numbers as bytes, in which what is no number is equal to itself."""
    return said.stamp, *(array('d', numbers).tobytes()
                           for numbers in (said.positions, said.velocities))
