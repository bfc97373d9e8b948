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
import struct
from typing import NamedTuple, Optional, Sequence, Tuple

from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from .wire import distinct, pack, places, SENTINEL

# Of so many sources the layouts are kept.
SOURCES = 8


class Turned(NamedTuple):
    """Cranks by name, their positions and, where they are known, their velocities."""

    stamp: bytes
    names: Sequence[str]
    positions: Tuple[float, ...]
    velocities: Tuple[float, ...]


class Reader:
    """Reads serialised joint states; the names of one source are the same object each time."""

    def __init__(self):
        self._layouts = {}
        self._learning = True

    def read(self, text: bytes) -> Turned:
        """Return what a message says."""
        for layout in self._layouts.values():
            if turned := layout.take(text):
                return turned
        message = deserialize_message(text, JointState)
        turned = Turned(pack(message.header.stamp), list(message.name), tuple(message.position),
                        tuple(message.velocity))
        if self._learning:
            self._learn(text, message, turned)
        return turned

    def _learn(self, text, message, turned):
        source = (message.header.frame_id, *turned.names, len(turned.positions),
                  len(turned.velocities), len(message.effort))
        layout = self._layouts.get(source) or Layout(turned.names, message, len(text))
        # What comes from afar may be encoded otherwise than here.
        self._learning = layout.admit(text, turned)
        if self._learning:
            self._layouts[source] = layout
        if len(self._layouts) > SOURCES:
            del self._layouts[next(iter(self._layouts))]


class Layout:
    """
    Where the numbers are in a message with some names; that message's own are overwritten.

    What comes over the wire ends at `size`; what is serialised here may have a tail.
    """

    def __init__(self, names: Sequence[str], message: JointState, size: int):
        counts = [len(part) for part in (message.position, message.velocity, message.effort)]
        values = distinct(sum(counts)).tolist()
        self._first, self._last = counts[0], counts[0] + counts[1]
        message.position = array('d', values[:self._first])
        message.velocity = array('d', values[self._first:self._last])
        message.effort = array('d', values[self._last:])
        message.header.stamp = SENTINEL
        text = serialize_message(message)[:size]
        self._names = names
        self._struct, fixed = _fields(text, values)
        self._mask = int.from_bytes(fixed, 'little')
        self._same = int.from_bytes(text, 'little') & self._mask

    def take(self, text: bytes) -> Optional[Turned]:
        """Return what a message says, None where it differs in more than numbers."""
        if (len(text) == self._struct.size
                and int.from_bytes(text, 'little') & self._mask == self._same):
            return self._taken(text)
        return None

    def admit(self, text: bytes, turned: Turned) -> bool:
        """Ignore what is padding, as it differs in a message that says the same with numbers."""
        if len(text) != self._struct.size or repr(self._taken(text)) != repr(turned):
            return False
        self._mask &= ~(int.from_bytes(text, 'little') ^ self._same)
        self._same &= self._mask
        return True

    def _taken(self, text):
        stamp, *numbers = self._struct.unpack(text)
        return Turned(stamp, self._names, tuple(numbers[:self._first]),
                      tuple(numbers[self._first:self._last]))


def _fields(text: bytes, values: Sequence[float]) -> Tuple[struct.Struct, bytes]:
    """Return a message as stamp and numbers, and a mask of the bytes between them."""
    codes = dict.fromkeys(places(text, pack(SENTINEL)), '8s')
    for value in values:
        codes.update(dict.fromkeys(places(text, struct.pack('=d', value)), 'd'))
    spelt, fixed, end = ['='], bytearray(b'\xff' * len(text)), 0
    for place, code in sorted(codes.items()):
        spelt += [f'{place - end}x', code]
        end = place + 8
        fixed[place:end] = bytes(8)
    return struct.Struct(''.join(spelt) + f'{len(text) - end}x'), bytes(fixed)
