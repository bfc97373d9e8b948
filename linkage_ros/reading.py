# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Joint states read from their bytes.

From one message of a source to its next only numbers change. Where they lie is found once, by
serialising the same message with values that occur nowhere else; from then on they alone are
taken from the bytes. A message that differs in anything else is deserialised.
"""

from array import array
from operator import itemgetter
import struct
from typing import NamedTuple, Optional, Sequence, Tuple

from builtin_interfaces.msg import Time
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from .wire import distinct, places, SENTINEL, STAMP

# Of so many sources the layouts are kept.
SOURCES = 8


class Turned(NamedTuple):
    """Cranks by name, their positions and, where they are known, their velocities."""

    stamp: Time
    names: Sequence[str]
    positions: Tuple[float, ...]
    velocities: Tuple[float, ...]


class Reader:
    """Reads serialised joint states; the names of one source are the same object each time."""

    def __init__(self):
        self._layouts = []
        self._learning = True

    def read(self, text: bytes) -> Turned:
        """Return what a message says."""
        for layout in self._layouts:
            if turned := layout.take(text):
                return turned
        message = deserialize_message(text, JointState)
        turned = Turned(message.header.stamp, list(message.name), tuple(message.position),
                        tuple(message.velocity))
        if self._learning:
            layout = Layout(turned.names, message)
            self._layouts = [layout, *self._layouts[:SOURCES - 1]]
            # What comes from afar may be encoded otherwise than here.
            self._learning = layout.take(text) is not None
        return turned


class Layout:
    """Where the numbers are in a message with some names; that message's own are overwritten."""

    def __init__(self, names: Sequence[str], message: JointState):
        counts = [len(part) for part in (message.position, message.velocity, message.effort)]
        values = distinct(sum(counts)).tolist()
        first, last = counts[0], counts[0] + counts[1]
        message.position = array('d', values[:first])
        message.velocity = array('d', values[first:last])
        message.effort = array('d', values[last:])
        message.header.stamp = SENTINEL
        text = serialize_message(message)
        self._struct = _fields(text, values)
        fields = self._struct.unpack(text)
        self._fixed = itemgetter(*(i for i, x in enumerate(fields) if isinstance(x, bytes)))
        self._same = self._fixed(fields)
        self._names = names
        self._stamp = Time()
        self._time = fields.index(SENTINEL.sec)
        self._positions, self._velocities = (
            slice(start, start + count) for start, count in (
                (fields.index(values[0]) if counts[0] else 0, counts[0]),
                (fields.index(values[first]) if counts[1] else 0, counts[1])))

    def take(self, text: bytes) -> Optional[Turned]:
        """Return what a message says, None where it differs in more than numbers."""
        if len(text) != self._struct.size:
            return None
        fields = self._struct.unpack(text)
        if self._fixed(fields) != self._same:
            return None
        self._stamp.sec, self._stamp.nanosec = fields[self._time:self._time + 2]
        return Turned(self._stamp, self._names, fields[self._positions],
                      fields[self._velocities])


def _fields(text: bytes, values: Sequence[float]) -> struct.Struct:
    """Return a message as the stamp, the numbers, and the bytes between them."""
    codes = dict.fromkeys(places(text, STAMP.pack(SENTINEL.sec, SENTINEL.nanosec)), 'iI')
    for value in values:
        codes.update(dict.fromkeys(places(text, struct.pack('=d', value)), 'd'))
    spelt, end = ['='], 0
    for place, code in sorted(codes.items()):
        spelt += [f'{place - end}s', code] if place > end else [code]
        end = place + 8
    return struct.Struct(''.join(spelt) + f'{len(text) - end}s')
