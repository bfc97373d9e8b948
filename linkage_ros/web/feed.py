# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Markers as the page draws them: looks, which seldom change, and points, which often do."""

import struct

import numpy as np
from rclpy.serialization import serialize_message
from visualization_msgs.msg import Marker

from ..nodes import message_layout

KINDS = {Marker.LINE_LIST: 'lines', Marker.LINE_STRIP: 'strip', Marker.SPHERE_LIST: 'joints'}
SECONDS_BETWEEN_WARNINGS = 5.0


class Feed:
    """
    The newest message of a topic with markers, made ready to be drawn when somebody asks.

    Messages come in serialised, and those that nobody draws are never unpacked. One that cannot be
    drawn is dropped: what was drawn before stays.

    Parameters
    ----------
    topic : str
        Where the messages come from.
    mechanism : str
        What the markers belong to.
    type_ : type
        Marker or MarkerArray.
    number : callable
        Returns a number for the first marker of a message, the second and so on; always the same.
    logger : rclpy logger
        Told of messages that are dropped.

    """

    def __init__(self, topic: str, mechanism: str, type_, number, logger):
        self.newest = None
        self.topic = topic
        self._mechanism = mechanism
        self._type = type_
        self._number = number
        self._logger = logger
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
        if self.newest is not self._drawn:
            self._drawn = self.newest
            try:
                self._draw(self._drawn)
            except Exception as error:
                # What the middleware raises is its own affair, and the bytes are anybody's.
                self._logger.warning(f'a message on {self.topic} is dropped: {error}',
                                     throttle_duration_sec=SECONDS_BETWEEN_WARNINGS)
        return self._looks, self._records

    def _draw(self, text):
        places = self._layout.read(text) if self._layout else None
        if places is None:
            self._unpack(text)
        else:
            self._records = _recorded(self._counts, _shown(places))

    def _unpack(self, text):
        message = message_layout.deserialized(text, self._type)
        markers = [marker for marker in _markers(message)
                   if marker.type in KINDS and marker.action == Marker.ADD]
        numbers = [self._number(i) for i in range(len(markers))]
        looks = {number: _look(self._mechanism, marker)
                 for number, marker in zip(numbers, markers)}
        # What is no longer sent is drawn without points.
        counts = {**dict.fromkeys(self._counts, 0),
                  **{number: len(marker.points) for number, marker in zip(numbers, markers)}}
        places = _places(markers)
        records = _recorded(counts, _shown(places))
        if (looks, counts) == (self._looks, self._counts) and self._layout and (
                self._layout.alike(text)):
            self._layout.ignore_what_differs(text)
        else:
            self._layout = Layout(text, message) if len(places) == len(
                _places(_markers(message))) else None
        self._looks, self._counts, self._records = looks, counts, records


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
        places = _places(_markers(message))
        points = [point for marker in _markers(message) for point in marker.points]
        unused = message_layout.distinct(3 * len(points))
        for point, place in zip(points, unused.reshape(-1, 3).tolist()):
            point.x, point.y, point.z = place
        for marker in _markers(message):
            marker.header.stamp = message_layout.SENTINEL
        marked = serialize_message(message)
        # On its way a message may have been filled up at its end.
        marked = np.frombuffer(marked.ljust(len(text), b'\0'), np.uint8)
        numbers = self._numbers(marked)
        self._slots = np.flatnonzero(np.isin(numbers, unused))
        self._found = len(marked) == len(text) and np.array_equal(numbers[self._slots], unused)
        self._fixed = np.ones(len(marked), bool)
        numbers = message_layout.HEADER + 8 * self._slots[:, None] + np.arange(8)
        self._fixed[numbers.ravel()] = False
        stamp = message_layout.pack(message_layout.SENTINEL)
        for place in message_layout.places(marked.tobytes(), stamp):
            self._fixed[place:place + len(stamp)] = False
        # In another encoding the numbers stand elsewhere, or the other way round.
        self._found = self._found and np.array_equal(self.read(text), places)

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
        whole = len(text) - (len(text) - message_layout.HEADER) % 8
        return np.frombuffer(text[message_layout.HEADER:whole].tobytes(), float)


def _markers(message):
    return getattr(message, 'markers', [message])


def _places(markers):
    return np.array([(point.x, point.y, point.z) for marker in markers
                     for point in marker.points]).reshape(-1, 3)


def _shown(numbers):
    """Return numbers as they are drawn; raise ValueError if that cannot be."""
    with np.errstate(over='ignore'):
        shown = np.asarray(numbers).astype('<f4')
    if not np.isfinite(shown).all():
        raise ValueError('a number in it is not finite, or too large to be drawn')
    return shown


def _recorded(counts, places):
    records, start = [], 0
    for number, count in counts.items():
        records += [struct.pack('<II', number, count), places[start:start + count].tobytes()]
        start += count
    return b''.join(records)


def _look(mechanism, marker):
    place, turn, colour = marker.pose.position, marker.pose.orientation, marker.color
    pose = [place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w]
    colours = [colour.r, colour.g, colour.b, colour.a]
    _shown([*pose, *colours, marker.scale.x])
    return {'mechanism': mechanism, 'kind': KINDS[marker.type], 'pose': pose,
            'width': marker.scale.x, 'colour': colours}
