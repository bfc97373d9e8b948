# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Positions of numbers in serialised messages, to read and write them in place.

Consecutive messages of a publisher differ only in stamps and in the float64 of sequences. Their
positions follow from the lengths of strings and sequences (CDR encoding). A layout is verified
before use: its numbers must equal those of an ordinary message.
"""

from __future__ import annotations

import struct
from typing import Any, Callable, List, Tuple

from builtin_interfaces.msg import Time
import numpy as np
from rclpy.serialization import deserialize_message, serialize_message

# Length of the encapsulation header; alignment counts from its end.
HEADER = 4
LEAD = bytes(8 - HEADER)
LITTLE_ENDIAN = b'\0\1'
# Shorter texts are refused. A middleware that trusts the padding length in the header reads beyond
# their end, and may crash.
SHORTEST = 8
# The stamp of a message without one.
NEVER = bytes(8)

_STAMP, _COUNT = struct.Struct('<iI'), struct.Struct('<I')
_SIZES = {'boolean': 1, 'octet': 1, 'uint8': 1, 'int8': 1, 'uint16': 2, 'int16': 2, 'uint32': 4,
          'int32': 4, 'float': 4, 'uint64': 8, 'int64': 8, 'double': 8}
# Types made of float64 alone, with their number.
_DOUBLES = {'double': 1, 'geometry_msgs/Point': 3}


def pack(stamp: Time) -> bytes:
    """Serialise a stamp."""
    return _STAMP.pack(stamp.sec, stamp.nanosec)


def pack_time(nanoseconds: int) -> bytes:
    """Serialise a time [ns] as a stamp."""
    return _STAMP.pack(*divmod(nanoseconds, 10 ** 9))


def unpack(stamp: bytes) -> Time:
    """Deserialise a stamp."""
    sec, nanosec = _STAMP.unpack(stamp)
    return Time(sec=sec, nanosec=nanosec)


class Unreadable(ValueError):
    """A message that cannot be deserialised; the text has the reason."""


def deserialized(text: bytes, kind: type) -> Any:
    """Deserialise a message; raise Unreadable if the bytes are not of its type."""
    if len(text) < SHORTEST:
        raise Unreadable(f'there must be {SHORTEST} at least')
    try:
        return deserialize_message(text, kind)
    except Exception as error:
        # Each middleware has its own error types.
        raise Unreadable(' '.join(str(error).split())[:200]) from None


class NoLayout(Exception):
    """A message whose numbers cannot be accessed in place; the text has the reason."""


class MessageLayout:
    """
    Positions of the numbers in a message, and a mask of its constant bytes.

    Its arguments are the message, serialised and not. Its type has no fixed-size arrays and no
    wide strings. Raises NoLayout for another encoding.

    Attributes
    ----------
    stamps : list of int
        Offsets of the stamps.
    numbers : list of (int, int)
        Offset and count of the numbers of each sequence of float64 or points.
    fixed : uint8 array
        Mask of the bytes that are neither numbers nor padding.

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
        """Return whether a message differs only in stamps, numbers and padding."""
        return len(text) == len(self._text) and not (
            (np.frombuffer(text, np.uint8) ^ self._bytes) & self.fixed).any()

    def is_same(self, text: bytes, other: bytes) -> bool:
        """Return whether two messages fit and differ only in padding."""
        places = [(place, _STAMP.size) for place in self.stamps] + [
            (place, 8 * count) for place, count in self.numbers]
        return self.fits(text) and self.fits(other) and all(
            text[place:place + size] == other[place:place + size] for place, size in places)

    def read(self, text: bytes) -> List[np.ndarray]:
        """Read the numbers of a message that fits, one array per sequence."""
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
        """Advance by some aligned bytes; return their offset."""
        place = self._place + (HEADER - self._place) % alignment
        self._place = end = place + size
        if end > len(self._text):
            raise NoLayout('it ends too early')
        self._fixed[place:end] = mask * size
        return place


class Template:
    """
    A serialised message whose stamp and float64 values are patched in place.

    `build` makes a message from a stamp and an array of `count` floats. Numbers in its sequences
    are these values or zero. Raises NoLayout if a patched message differs from a built one.
    """

    def __init__(self, build: Callable, count: int):
        # In a message built from 1, 2, 3, ... each number is the index of its value.
        message = build(Time(sec=1), np.arange(1.0, count + 1.0))
        text = serialize_message(message)
        layout = MessageLayout(text, message)
        # Numbers are aligned to 8 bytes after the header; LEAD aligns them in memory, too.
        self._bytes = bytearray(LEAD + text + bytes(-(len(text) - HEADER) % 8))
        self.message = memoryview(self._bytes)[len(LEAD):len(LEAD) + len(text)]
        self._stamps = [slice(len(LEAD) + place, len(LEAD) + place + _STAMP.size)
                        for place in layout.stamps if any(text[place:place + _STAMP.size])]
        self._numbers = np.frombuffer(self._bytes, float, offset=len(LEAD) + HEADER)
        # All numbers come from one table: zero, the values, then the message's constants.
        self._table = np.concatenate([np.zeros(count + 1), self._numbers])
        self._values = self._table[1:count + 1]
        self._sources = np.arange(count + 1, len(self._table))
        for place, size in layout.numbers:
            start = (place - HEADER) // 8
            self._sources[start:start + size] = self._numbers[start:start + size]
        self._check(build, layout, count)

    def patched(self, stamp: bytes, values: Any) -> bytes:
        """Return the serialised message with a packed stamp and values."""
        self._values[:] = values
        self._table.take(self._sources, out=self._numbers, mode='clip')
        for place in self._stamps:
            self._bytes[place] = stamp
        return bytes(self.message)

    def places(self) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the offsets of values in `message`, their indices, and the stamps' offsets."""
        own = np.flatnonzero((self._sources > 0) & (self._sources <= len(self._values)))
        return HEADER + 8 * own, self._sources[own] - 1, np.array(
            [place.start - len(LEAD) for place in self._stamps], int)

    def _check(self, build: Callable, layout: MessageLayout, count: int) -> None:
        stamp, values = Time(sec=12, nanosec=345), np.linspace(-1.5, 7.25, count)
        if not layout.is_same(self.patched(pack(stamp), values),
                              serialize_message(build(stamp, values))):
            raise NoLayout('a patched message does not read back as it was written')
