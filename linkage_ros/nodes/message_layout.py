# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Where the numbers lie in the bytes of a message, to read and write them without the rest.

From one message of a publisher to its next only numbers change: its stamps, and the float64 in its
sequences. Where they lie follows from the lengths that stand between them (CDR, as it is on the
wire). Whoever uses a layout tries it first: what it reads or writes has to be what an ordinary
message says.
"""

from __future__ import annotations

import struct
from typing import Any, Callable, List, Tuple

from builtin_interfaces.msg import Time
import numpy as np
from rclpy.serialization import deserialize_message, serialize_message

# The bytes that say how a message is encoded; what follows is aligned from its end.
HEADER = 4
LEAD = bytes(8 - HEADER)
LITTLE_ENDIAN = b'\0\1'
# Of fewer bytes no message is made. A middleware that takes the sender's word for how many of them
# are padding looks beyond the end, and may end the process.
SHORTEST = 8
# The stamp of a message that has none.
NEVER = bytes(8)

_STAMP, _COUNT = struct.Struct('<iI'), struct.Struct('<I')
_SIZES = {'boolean': 1, 'octet': 1, 'uint8': 1, 'int8': 1, 'uint16': 2, 'int16': 2, 'uint32': 4,
          'int32': 4, 'float': 4, 'uint64': 8, 'int64': 8, 'double': 8}
# What is made of float64 alone, and of how many.
_DOUBLES = {'double': 1, 'geometry_msgs/Point': 3}


def pack(stamp: Time) -> bytes:
    """Return a stamp as it is in a message."""
    return _STAMP.pack(stamp.sec, stamp.nanosec)


def pack_time(nanoseconds: int) -> bytes:
    """Return a time [ns] as the stamp of a message has it."""
    return _STAMP.pack(*divmod(nanoseconds, 10 ** 9))


def unpack(stamp: bytes) -> Time:
    """Return the stamp that some bytes of a message are."""
    sec, nanosec = _STAMP.unpack(stamp)
    return Time(sec=sec, nanosec=nanosec)


class Unreadable(ValueError):
    """A message that cannot be deserialised; the text says why."""


def deserialized(text: bytes, kind: type) -> Any:
    """Return a message from its bytes; raise Unreadable if they are none of its kind."""
    if len(text) < SHORTEST:
        raise Unreadable(f'there must be {SHORTEST} at least')
    try:
        return deserialize_message(text, kind)
    except Exception as error:
        # Each middleware has errors of its own.
        raise Unreadable(' '.join(str(error).split())[:200]) from None


class NoLayout(Exception):
    """A message whose numbers cannot be read or written in place; the text says why."""


class MessageLayout:
    """
    Where the numbers lie in a message, and which other bytes count.

    The message is given serialised and as it is; it is of a type without arrays of fixed size and
    without wide strings. Raises NoLayout if it is encoded otherwise.

    Attributes
    ----------
    stamps : list of int
        Where the stamps are.
    numbers : list of (int, int)
        For each sequence of float64 or points where its numbers begin, and how many they are.
    fixed : uint8 array
        A mask of the bytes that are neither number nor padding.

    """

    def __init__(self, text: bytes, message: Any):
        if text[:len(LITTLE_ENDIAN)] != LITTLE_ENDIAN:
            raise NoLayout('its encoding is another')
        self.stamps: List[int] = []
        self.numbers: List[Tuple[int, int]] = []
        self._fixed, self._text, self._place = bytearray(len(text)), text, 0
        self._pass(1, HEADER)
        self._walk(message)
        self._bytes, self.fixed = (np.frombuffer(each, np.uint8) for each in (text, self._fixed))

    def fits(self, text: bytes) -> bool:
        """Return whether a message differs in nothing but stamps, numbers and padding."""
        return len(text) == len(self._text) and not (
            (np.frombuffer(text, np.uint8) ^ self._bytes) & self.fixed).any()

    def is_same(self, text: bytes, other: bytes) -> bool:
        """Return whether two messages fit and differ in nothing but padding."""
        places = [(place, _STAMP.size) for place in self.stamps] + [
            (place, 8 * count) for place, count in self.numbers]
        return self.fits(text) and self.fits(other) and all(
            text[place:place + size] == other[place:place + size] for place, size in places)

    def read(self, text: bytes) -> List[np.ndarray]:
        """Return the numbers of a message that fits, an array for each sequence."""
        return [np.frombuffer(text, '<f8', count, place) for place, count in self.numbers]

    def _walk(self, message: Any) -> None:
        for name, kind in message.get_fields_and_field_types().items():
            self._field(kind, getattr(message, name))

    def _field(self, kind: str, value: Any) -> None:
        if kind == 'string':
            self._pass(1, self._count())
        elif kind in _SIZES:
            self._pass(_SIZES[kind], _SIZES[kind])
        elif kind == 'builtin_interfaces/Time':
            self.stamps.append(self._pass(4, _STAMP.size, b'\0'))
        elif kind.startswith('sequence<'):
            self._sequence(kind[len('sequence<'):-1], value)
        else:
            self._walk(value)

    def _sequence(self, kind: str, values: Any) -> None:
        count = self._count()
        if count != len(values):
            raise NoLayout('its bytes are another message')
        if kind in _DOUBLES:
            count *= _DOUBLES[kind]
            self.numbers.append((self._pass(8 if count else 1, 8 * count, b'\0'), count))
        elif kind in _SIZES:
            self._pass(_SIZES[kind], count * _SIZES[kind])
        else:
            for value in values:
                self._field(kind, value)

    def _count(self) -> int:
        return _COUNT.unpack_from(self._text, self._pass(4, 4))[0]

    def _pass(self, alignment: int, size: int, mask: bytes = b'\xff') -> int:
        """Go on by some bytes; return where they begin, at a multiple after the header."""
        place = self._place + (HEADER - self._place) % alignment
        self._place = end = place + size
        if end > len(self._text):
            raise NoLayout('it ends too early')
        self._fixed[place:end] = mask * size
        return place


class Template:
    """
    The bytes of a message whose stamp and float64 values change; `message` as last patched.

    `build` makes, from a stamp and an array of `count` floats, a message that shows some of them,
    and else no numbers in its sequences but zero. Raises NoLayout if a patched message reads
    differently from one that is built.
    """

    def __init__(self, build: Callable, count: int):
        # Made of 1, 2, 3 and so on, a message says itself which of its numbers is which value.
        message = build(Time(sec=1), np.arange(1.0, count + 1.0))
        text = serialize_message(message)
        layout = MessageLayout(text, message)
        # Numbers lie at multiples of 8 after the header; in memory too they are quicker there.
        self._bytes = bytearray(LEAD + text + bytes(-(len(text) - HEADER) % 8))
        self.message = memoryview(self._bytes)[len(LEAD):len(LEAD) + len(text)]
        self._stamps = [slice(len(LEAD) + place, len(LEAD) + place + _STAMP.size)
                        for place in layout.stamps if any(text[place:place + _STAMP.size])]
        self._numbers = np.frombuffer(self._bytes, float, offset=len(LEAD) + HEADER)
        # Every number comes from one table: zero, the values, then what the message says besides.
        self._table = np.concatenate([np.zeros(count + 1), self._numbers])
        self._values = self._table[1:count + 1]
        self._sources = np.arange(count + 1, len(self._table))
        for place, size in layout.numbers:
            start = (place - HEADER) // 8
            self._sources[start:start + size] = self._numbers[start:start + size]
        self._check(build, layout, count)

    def patched(self, stamp: bytes, values: Any) -> bytes:
        """Return the message with this stamp, packed, and these values, serialised."""
        self._values[:] = values
        self._table.take(self._sources, out=self._numbers, mode='clip')
        for place in self._stamps:
            self._bytes[place] = stamp
        return bytes(self.message)

    def places(self) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return where in `message` values lie, which value each is, and where the stamps lie."""
        own = np.flatnonzero((self._sources > 0) & (self._sources <= len(self._values)))
        return HEADER + 8 * own, self._sources[own] - 1, np.array(
            [place.start - len(LEAD) for place in self._stamps], int)

    def _check(self, build: Callable, layout: MessageLayout, count: int) -> None:
        stamp, values = Time(sec=12, nanosec=345), np.linspace(-1.5, 7.25, count)
        if not layout.is_same(self.patched(pack(stamp), values),
                              serialize_message(build(stamp, values))):
            raise NoLayout('a patched message does not read back as it was written')
