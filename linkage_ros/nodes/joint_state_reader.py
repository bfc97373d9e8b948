# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Joint states read from their bytes.

From one message of a source to its next only numbers change. Where they lie follows from the
lengths that stand between them (CDR, as it is on the wire); from a source's second message on they
alone are taken from the bytes. What is neither a number nor padding has to be the same, else the
message is deserialised.
"""

from array import array
from collections import OrderedDict
from struct import error as TooShort, Struct
from typing import Any, Callable, NamedTuple, Tuple

from sensor_msgs.msg import JointState

from .message_layout import deserialized, HEADER, pack

# So many sources are remembered, of messages that are no longer [bytes]; of those that are of one
# length, so many arrangements of names. Where there are more sources, one in so many messages is
# looked at to learn it, as that costs more than it saves if the source is soon forgotten.
SOURCES, LONGEST, ARRANGEMENTS, SAMPLED = 256, 1 << 16, 4, 64
LITTLE_ENDIAN = b'\0\1'

_COUNT = Struct('<I')


class Turned(NamedTuple):
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
        # By length, then by the bytes that count: a mask, and the layouts by those bytes.
        self._layouts = {}
        # The layouts, and the sources that were met and whether they are worth learning: the
        # latest last.
        self._used, self._met = OrderedDict(), OrderedDict()
        self._missed = 0

    def read(self, text: bytes) -> Turned:
        """Return what a message says; raise Unreadable if that cannot be told."""
        if alike := self._layouts.get(len(text)):
            number = int.from_bytes(text, 'little')
            for mask, layouts in alike.items():
                if layout := layouts.get(number & mask):
                    self._used.move_to_end(layout)
                    return layout.take(text)
        message = deserialized(text, JointState)
        turned = Turned(pack(message.header.stamp), self._understand(message),
                        tuple(message.position), tuple(message.velocity))
        self._missed += 1
        crowded = len(self._used) == SOURCES or len(self._met) == 2 * SOURCES
        if len(text) <= LONGEST and not (crowded and self._missed % SAMPLED):
            self._meet(text, message, turned)
        return turned

    def _meet(self, text, message, turned):
        """Learn a source that is met again."""
        source = hash((len(text), text[:HEADER], message.header.frame_id, *message.name,
                       len(turned.positions), len(turned.velocities), len(message.effort)))
        worth_it = self._met.pop(source, None)
        if worth_it and self._learn(text, turned):
            return
        self._met[source] = worth_it is None
        if len(self._met) > 2 * SOURCES:
            self._met.popitem(last=False)

    def _learn(self, text, turned) -> bool:
        layout = _layout(text, turned)
        alike = self._layouts.get(len(text), {})
        if not layout or layout.mask not in alike and len(alike) == ARRANGEMENTS:
            return False
        if len(self._used) == SOURCES:
            self._forget(self._used.popitem(last=False)[0])
        self._layouts.setdefault(layout.size, {}).setdefault(layout.mask, {})[layout.same] = layout
        self._used[layout] = True
        return True

    def _forget(self, layout):
        alike = self._layouts[layout.size]
        del alike[layout.mask][layout.same]
        if not alike[layout.mask]:
            del alike[layout.mask]
        if not alike:
            del self._layouts[layout.size]


class Layout:
    """Where the numbers are in a message of a source, and which other bytes count."""

    def __init__(self, text: bytes, source: Any):
        walk = _Walk(text)
        self.size, self.mask = len(text), int.from_bytes(walk.fixed, 'little')
        self.same = int.from_bytes(text, 'little') & self.mask
        self._source = source
        (place, self._first), (then, count) = walk.numbers[:2]
        end = place + 8 * self._first
        self._unpack = Struct(f'<{HEADER}x8s{place - HEADER - 8}x{self._first}d'
                              f'{then - end}x{count}d').unpack_from

    def take(self, text: bytes) -> Turned:
        """Return what a message says that has the same bytes where they count."""
        numbers, end = self._unpack(text), 1 + self._first
        return Turned(numbers[0], self._source, numbers[1:end], numbers[end:])


def _layout(text, turned):
    """Return the layout of a message that was read, or None if it is encoded otherwise."""
    try:
        layout = Layout(text, turned.source)
    except TooShort:
        return None
    same = _bits(layout.take(text)) == _bits(turned)
    return layout if same and text[:2] == LITTLE_ENDIAN else None


def _bits(turned):
    """Return the numbers as bytes, in which what is no number is equal to itself."""
    return turned.stamp, *(array('d', numbers).tobytes()
                           for numbers in (turned.positions, turned.velocities))


class _Walk:
    """
    A way through the bytes of joint states.

    Attributes
    ----------
    fixed : bytearray
        A mask of the bytes that are neither numbers nor padding.
    numbers : list of (int, int)
        Where the positions, the velocities and the efforts begin, and how many they are.

    """

    def __init__(self, text):
        self._text, self._place = text, HEADER + 8
        self.fixed = bytearray(len(text))
        self._fix(0, HEADER)
        self._strings(1)
        self._strings(self._count())
        self.numbers = [self._doubles() for _ in ('position', 'velocity', 'effort')]

    def _strings(self, count):
        for _ in range(count):
            size = self._count()
            self._place = self._fix(self._place, self._place + size)

    def _count(self):
        # Numbers lie at multiples of their size after the header.
        place = self._place + (HEADER - self._place) % 4
        self._place = self._fix(place, place + 4)
        return _COUNT.unpack_from(self._text, place)[0]

    def _fix(self, place, end):
        if end > len(self.fixed):
            raise TooShort
        self.fixed[place:end] = b'\xff' * (end - place)
        return end

    def _doubles(self):
        count = self._count()
        if count:
            self._place += (HEADER - self._place) % 8
        place = self._place
        self._place += 8 * count
        if self._place > len(self._text):
            raise TooShort
        return place, count
