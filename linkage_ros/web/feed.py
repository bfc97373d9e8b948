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

"""Markers as the page draws them: looks, which seldom change, and points, which often do."""

import struct

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message
from visualization_msgs.msg import Marker

from .. import wire

KINDS = {Marker.LINE_LIST: 'lines', Marker.LINE_STRIP: 'strip', Marker.SPHERE_LIST: 'joints'}


class Feed:
    """
    The newest message of a topic with markers, made ready to be drawn when somebody asks.

    Messages come in serialised, and those that nobody draws are never unpacked.

    Parameters
    ----------
    mechanism : str
        What the markers belong to.
    type_ : type
        Marker or MarkerArray.
    number : callable
        Returns a number for a marker of this feed, the same for the same marker.

    """

    def __init__(self, mechanism: str, type_, number):
        self.newest = None
        self._mechanism = mechanism
        self._type = type_
        self._number = number
        self._drawn = None
        self._layout = None
        self._looks = {}
        self._counts = {}
        self._records = b''

    def drawn(self):
        """
        Return what the newest message looks like and where it is.

        Returns
        -------
        looks : dict
            By number: mechanism, kind, pose (x, y, z, qx, qy, qz, qw), width [m] and colour.
        records : bytes
            For each marker its number and its points' count, uint32, and the points, float32
            x, y, z; all little-endian.

        """
        newest = self.newest
        if newest is not self._drawn:
            places = self._layout.read(newest) if self._layout else None
            self._records = self._recorded(self._unpack(newest) if places is None else places)
            self._drawn = newest
        return self._looks, self._records

    def _unpack(self, text):
        message = deserialize_message(text, self._type)
        # What is no longer sent is drawn without points.
        looks, counts, places, skipped = dict(self._looks), dict.fromkeys(self._looks, 0), [], 0
        for marker in _markers(message):
            number = self._number(marker.ns, marker.id)
            if marker.type not in KINDS or marker.action != Marker.ADD or counts.get(number):
                skipped += len(marker.points)
                continue
            looks[number] = _look(self._mechanism, marker)
            # In the order of the message.
            counts.pop(number, None)
            counts[number] = len(marker.points)
            places += [(p.x, p.y, p.z) for p in marker.points]
        same = looks == self._looks and list(counts.items()) == list(self._counts.items())
        if same and self._layout and self._layout.alike(text):
            self._layout.ignore_what_differs(text)
        else:
            self._layout = None if skipped else Layout(text, message)
        self._looks, self._counts = looks, counts
        return np.array(places).reshape(-1, 3)

    def _recorded(self, places):
        records, start = [], 0
        for number, count in self._counts.items():
            part = places[start:start + count].astype('<f4')
            records += [struct.pack('<II', number, count), part.tobytes()]
            start += count
        return b''.join(records)


class Layout:
    """
    Where the points are among a message's bytes, which saves unpacking the next ones.

    Found by serialising numbers that occur nowhere else, so that nothing here knows the format.

    Parameters
    ----------
    text : bytes
        A message, serialised.
    message : Marker or MarkerArray
        The same; its points and stamps are overwritten.

    """

    def __init__(self, text: bytes, message):
        self._text = np.frombuffer(text, np.uint8)
        points = [point for marker in _markers(message) for point in marker.points]
        unused = wire.distinct(3 * len(points))
        for point, place in zip(points, unused.reshape(-1, 3).tolist()):
            point.x, point.y, point.z = place
        for marker in _markers(message):
            marker.header.stamp = wire.SENTINEL
        marked = serialize_message(message)
        # On its way a message may have been filled up at its end.
        marked = np.frombuffer(marked.ljust(len(text), b'\0'), np.uint8)
        numbers = self._numbers(marked)
        self._slots = np.flatnonzero(np.isin(numbers, unused))
        self._found = len(marked) == len(text) and np.array_equal(numbers[self._slots], unused)
        self._fixed = np.ones(len(marked), bool)
        self._fixed[(wire.HEADER + 8 * self._slots[:, None] + np.arange(8)).ravel()] = False
        stamp = wire.pack(wire.SENTINEL)
        for place in wire.places(marked.tobytes(), stamp):
            self._fixed[place:place + len(stamp)] = False

    def alike(self, text: bytes) -> bool:
        """Return whether a message can have the same layout."""
        return self._found and len(text) == len(self._text)

    def read(self, text: bytes):
        """Return the points, shape (n, 3), of a message that differs in nothing else, or None."""
        if not self.alike(text) or self._differs(text)[self._fixed].any():
            return None
        return self._numbers(np.frombuffer(text, np.uint8))[self._slots].reshape(-1, 3)

    def ignore_what_differs(self, text: bytes):
        """Learn from a message that looks the same which bytes mean nothing, such as padding."""
        self._fixed &= ~self._differs(text)

    def _differs(self, text):
        return np.frombuffer(text, np.uint8) != self._text

    @staticmethod
    def _numbers(text):
        whole = len(text) - (len(text) - wire.HEADER) % 8
        return np.frombuffer(text[wire.HEADER:whole].tobytes(), float)


def _markers(message):
    return getattr(message, 'markers', [message])


def _look(mechanism, marker):
    place, turn, colour = marker.pose.position, marker.pose.orientation, marker.color
    return {
        'mechanism': mechanism, 'kind': KINDS[marker.type],
        'pose': [place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w],
        'width': marker.scale.x, 'colour': [colour.r, colour.g, colour.b, colour.a]}
