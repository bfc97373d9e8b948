# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Markers for the page: the newest message of a topic, as a frame that the page reads."""

import json
from typing import Any, Callable

import numpy as np
from visualization_msgs.msg import Marker

from ..nodes import messages
from ..nodes.message_layout import deserialized

# How the page draws a marker, and how many points are a piece of it, all if 0: by its type; for
# some of kinematics' markers by type and id.
KINDS = {Marker.LINE_LIST: ('lines', 2), Marker.LINE_STRIP: ('locus', 0),
         Marker.SPHERE_LIST: ('joints', 1), Marker.TRIANGLE_LIST: ('triangles', 3)}
KINDS_BY_ID = {(Marker.LINE_LIST, messages.GUIDES_ID): ('slots', 2),
               (Marker.LINE_LIST, messages.LOCUS_ID): ('locus', 2),
               (Marker.TRIANGLE_LIST, messages.PLATES_ID): ('plates', 3)}


class Feed:
    """
    The newest message of a marker topic.

    Messages arrive serialised, and are converted only to be drawn. Invalid ones are dropped, and
    the last valid one stays.

    Parameters
    ----------
    key : str
        Mechanism of the markers.
    topic : str
        Topic of the messages, which begins with the mechanism.
    type_ : type
        Marker or MarkerArray.
    warn : callable
        Logs a text, a dropped message, about a subject, its topic.

    """

    def __init__(self, key: str, topic: str, type_: type,
                 warn: Callable[[str, str], None]) -> None:
        self.newest: bytes | None = None
        self._key, self._topic, self._type, self._warn = key, topic, type_, warn
        self._converted: bytes | None = None
        self._frame = b''

    def frame(self) -> bytes:
        """
        Return the markers of the newest message for the page.

        A frame has the length of a header [bytes], uint32; the header, JSON: key, topic and,
        for each of its `markers`, kind, points a piece, frame, pose (x, y, z, qx, qy, qz, qw),
        width [m], colour and number of points; then all points, float32 x, y, z. Numbers are
        little-endian.
        """
        if self.newest is not None and self.newest is not self._converted:
            self._converted = self.newest
            try:
                self._frame = self._framed(deserialized(self.newest, self._type))
            except Exception as error:
                # Bytes of any publisher, and any exception of the middleware.
                self._warn(f'a message on {self._topic} is dropped: {error}', self._topic)
        return self._frame

    @np.errstate(over='ignore')
    def _framed(self, message: Any) -> bytes:
        markers = [marker for marker in getattr(message, 'markers', [message])
                   if marker.type in KINDS and marker.action == Marker.ADD]
        points = np.array([(point.x, point.y, point.z) for marker in markers
                           for point in marker.points]).astype('<f4')
        if not np.isfinite(points).all():
            raise ValueError('a number in it is not finite, or too large to be drawn')
        header = json.dumps({
            'key': self._key, 'topic': self._topic[len(self._key) + 1:],
            'markers': list(map(_described, markers))}, allow_nan=False).encode()
        # The points are aligned.
        header += b' ' * (-len(header) % points.itemsize)
        return np.array(len(header), '<u4').tobytes() + header + points.tobytes()


def _described(marker: Marker) -> dict[str, Any]:
    place, turn, colour = marker.pose.position, marker.pose.orientation, marker.color
    kind, piece = KINDS_BY_ID.get((marker.type, marker.id), KINDS[marker.type])
    return {'kind': kind, 'piece': piece or len(marker.points), 'points': len(marker.points),
            'frame': marker.header.frame_id, 'width': marker.scale.x,
            'pose': [place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w],
            'colour': [colour.r, colour.g, colour.b, colour.a]}
