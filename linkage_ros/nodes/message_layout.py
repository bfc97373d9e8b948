# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

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
# Shorter messages [bytes] are refused: a middleware that trusts the padding length in the header
# reads beyond their end, and may crash.
MIN_BYTES = 8
# The packed stamp of a message whose publisher has not set it: time zero.
NEVER = bytes(8)
# Stamp and first value that mark their places in a template: as integers, values are this and the
# next. A field beside padding, which has any bytes, is not half of one.
MARKED_STAMP, MARKED_VALUE = Time(sec=0x2C83A6F1, nanosec=0x1E94B7D5), 0x01708A3D5A1C3E77

_STAMP = struct.Struct('<iI')

# A function of a publisher, and the serialised message that it publishes.
Outgoing = Tuple[Callable[[bytes], None], bytes]


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


class PatchedMessages:
    """
    Serialised messages whose stamps and float64 values are patched in place.

    `parts` are, for each message, the function that publishes it, and one that builds it of a Time
    and an array (count,), whose values it only copies.
    """

    def __init__(self, parts: Sequence[Tuple[Callable, Callable]], count: int):
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

    def patched(self, stamp: bytes, values: Any) -> List[Outgoing]:
        """Return the messages with a packed stamp and values (count,), and what publishes each."""
        self._values[:] = values
        self._table.take(self._sources, None, self._numbers, 'clip')
        data = self._bytes
        for place in self._stamps:
            data[place] = stamp
        return [(publish, bytes(message)) for publish, message in self._messages]
