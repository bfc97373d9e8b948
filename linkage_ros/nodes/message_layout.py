# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""
Serialised messages: stamps, and messages whose numbers are patched in place.

Consecutive messages of a publisher differ only in stamps and in the float64 of sequences. Where
these are in the bytes is seen in a message of a stamp and values that no other has.
"""

from __future__ import annotations

import re
import struct
from typing import Any, Callable, List, Sequence, Tuple

from builtin_interfaces.msg import Time
import numpy as np
from rclpy.serialization import deserialize_message, serialize_message

# Length of the encapsulation header [bytes]; alignment counts from its end.
HEADER = 4
LEAD = bytes(8 - HEADER)
LITTLE_ENDIAN = b'\0\1'
# Shorter messages [bytes] are refused: a middleware that trusts the padding length in the header
# reads beyond their end, and may crash.
MIN_BYTES = 8
# The packed stamp of a message whose publisher has not set it: time zero.
NEVER = bytes(8)
# Stamp and first value that mark their places in a template: as integers, values are this and the
# next. A field beside padding, which has any bytes, is not half of one.
MARKED_STAMP, MARKED_VALUE = Time(sec=0x2C83A6F1, nanosec=0x1E94B7D5), 0x01708A3D5A1C3E77

_STAMP, _COUNT = struct.Struct('<iI'), struct.Struct('<I')
_SIZES = {'boolean': 1, 'octet': 1, 'uint8': 1, 'int8': 1, 'uint16': 2, 'int16': 2, 'uint32': 4,
          'int32': 4, 'float': 4, 'uint64': 8, 'int64': 8, 'double': 8}
# Types that consist of float64 only, and of how many.
_DOUBLES = {'double': 1, 'geometry_msgs/Point': 3}


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


class NoLayout(Exception):
    """A message whose numbers cannot be accessed in place; the exception's text has the reason."""


class MessageLayout:
    """
    Places of the numbers in a serialised message, and a mask of its constant bytes.

    `data` is the serialised `message`. Fixed-size arrays and wide strings are not supported.
    Raises NoLayout if the encoding is not little-endian CDR.

    Attributes
    ----------
    stamps : list of int
        Offsets of the stamps [bytes].
    numbers : list of (int, int)
        Offset [bytes] and count of the float64 numbers of each sequence of numbers or points.
    fixed : uint8 array (bytes,)
        Mask of the constant bytes: 0 at stamps, numbers and padding, 255 elsewhere.

    """

    def __init__(self, data: bytes, message: Any):
        if data[:len(LITTLE_ENDIAN)] != LITTLE_ENDIAN:
            raise NoLayout('its encoding is not little-endian CDR')
        self.stamps: List[int] = []
        self.numbers: List[Tuple[int, int]] = []
        self._fixed, self._data, self._place = bytearray(len(data)), data, 0
        self._advance(1, HEADER)
        self._walk(message)
        self._bytes, self.fixed = (
            np.frombuffer(part, np.uint8) for part in (data, self._fixed))

    def fits(self, data: bytes) -> bool:
        """Return whether a serialised message has this layout and the same constant bytes."""
        return len(data) == len(self._data) and not (
            (np.frombuffer(data, np.uint8) ^ self._bytes) & self.fixed).any()

    def read(self, data: bytes) -> List[np.ndarray]:
        """Return the numbers of a serialised message that fits, one array per sequence."""
        return [np.frombuffer(data, '<f8', count, place) for place, count in self.numbers]

    def _walk(self, message: Any) -> None:
        for name, kind in message.get_fields_and_field_types().items():
            self._field(kind, getattr(message, name))

    def _field(self, kind: str, value: Any) -> None:
        if kind == 'string':
            self._advance(1, self._count())
        elif kind in _SIZES:
            self._advance(_SIZES[kind], _SIZES[kind])
        elif kind == 'builtin_interfaces/Time':
            self.stamps.append(self._advance(4, _STAMP.size, b'\0'))
        elif kind.startswith('sequence<'):
            self._sequence(kind[len('sequence<'):-1], value)
        else:
            self._walk(value)

    def _sequence(self, kind: str, values: Any) -> None:
        count = self._count()
        if count != len(values):
            raise NoLayout('its bytes are not those of the message')
        if kind in _DOUBLES:
            count *= _DOUBLES[kind]
            self.numbers.append((self._advance(8 if count else 1, 8 * count, b'\0'), count))
        elif kind in _SIZES:
            self._advance(_SIZES[kind], count * _SIZES[kind])
        else:
            for value in values:
                self._field(kind, value)

    def _count(self) -> int:
        return _COUNT.unpack_from(self._data, self._advance(4, 4))[0]

    def _advance(self, alignment: int, size: int, mask: bytes = b'\xff') -> int:
        """Mask the next `size` bytes, advance to their end, and return their aligned offset."""
        place = self._place + (HEADER - self._place) % alignment
        self._place = end = place + size
        if end > len(self._data):
            raise NoLayout('it ends too early')
        self._fixed[place:end] = mask * size
        return place


class Template:
    """
    Serialised messages whose stamps and float64 values are patched in place.

    Each of `builds` makes a message of a Time and an array (count,), whose values it only copies.
    """

    def __init__(self, builds: Sequence[Callable], count: int):
        # In messages of a stamp and values that no others have, these mark their places.
        marks = (MARKED_VALUE + np.arange(count)).view(float)
        self._bytes, places = bytearray(), []
        for build in builds:
            data = serialize_message(build(MARKED_STAMP, marks))
            # Numbers are aligned to 8 bytes after the header; LEAD aligns them in memory, too.
            start = len(self._bytes) + len(LEAD)
            self._bytes += LEAD + data + bytes(-(len(data) - HEADER) % 8)
            places.append(slice(start, start + len(data)))
        self._stamps = [slice(*match.span()) for match in re.finditer(
            re.escape(pack(MARKED_STAMP)), self._bytes)]
        if len(self._stamps) < len(builds):
            raise NoLayout('the middleware does not serialise to little-endian CDR')
        self._messages = [memoryview(self._bytes)[place] for place in places]
        self._numbers = np.frombuffer(self._bytes, float)
        # The values, then all eight-byte words of the messages.
        self._table = np.concatenate([marks, self._numbers])
        self._values = self._table[:count]
        indices = self._numbers.view(np.int64) - MARKED_VALUE
        self._sources = np.where((0 <= indices) & (indices < count), indices,
                                 np.arange(count, len(self._table)))

    def patched(self, stamp: bytes, values: Any) -> List[bytes]:
        """Return the serialised messages with a packed stamp and values (count,)."""
        self._values[:] = values
        self._table.take(self._sources, None, self._numbers, 'clip')
        data = self._bytes
        for place in self._stamps:
            data[place] = stamp
        return [bytes(message) for message in self._messages]
