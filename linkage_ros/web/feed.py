# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Markers for the page: conversion of messages to looks, which rarely change, and points."""

import struct
from typing import Any, Callable, Mapping, Optional, Sequence

import numpy as np
from numpy.typing import ArrayLike
from visualization_msgs.msg import Marker

from ..nodes import messages
from ..nodes.message_layout import deserialized, MessageLayout, NoLayout

# How the page draws a marker, by its type; for some of kinematics' markers, by type and id.
KINDS = {Marker.LINE_LIST: 'lines', Marker.LINE_STRIP: 'locus', Marker.SPHERE_LIST: 'joints',
         Marker.TRIANGLE_LIST: 'triangles'}
OWN_KINDS = {(Marker.LINE_LIST, messages.GUIDES_ID): 'slots',
             (Marker.LINE_LIST, messages.LOCUS_ID): 'loci',
             (Marker.TRIANGLE_LIST, messages.PLATES_ID): 'plates'}
NO_POINTS = np.empty(0)


class Feed:
    """
    The newest message of a marker topic, converted for the page on request.

    Messages arrive serialised; a message is deserialised only to be drawn. Invalid messages are
    dropped, and the last valid one stays.

    Parameters
    ----------
    topic : str
        Topic of the messages.
    mechanism : str
        Mechanism of the markers.
    type_ : type
        Marker or MarkerArray.
    number : callable
        Returns a constant number for each index of a marker in a message.
    warn : callable
        Logs a text, a dropped message, about a subject, its topic.

    """

    def __init__(self, topic: str, mechanism: str, type_: type, number: Callable[[int], int],
                 warn: Callable[[str, str], None]) -> None:
        self.newest: Optional[bytes] = None
        self.topic = topic
        self._mechanism = mechanism
        self._type = type_
        self._number = number
        self._warn = warn
        self._drawn: Optional[bytes] = None
        self._layout: Optional[MessageLayout] = None
        # By the markers' numbers; places are indices of markers in the message.
        self._looks: dict[int, dict[str, Any]] = {}
        self._places: dict[int, Optional[int]] = {}
        self._records = b''

    def drawn(self) -> tuple[dict[int, dict[str, Any]], bytes]:
        """
        Return the looks and points of the newest message.

        Returns
        -------
        looks : dict
            By number: mechanism, kind, frame, pose (x, y, z, qx, qy, qz, qw), width [m], colour.
        records : bytes
            For each marker its number and its points' count, uint32, and the points, float32
            x, y, z; all little-endian.

        """
        if self.newest is not None and self.newest is not self._drawn:
            self._drawn = self.newest
            try:
                self._draw(self.newest)
            except Exception as error:
                # Bytes of any publisher, and any exception of the middleware.
                self._warn(f'a message on {self.topic} is dropped: {error}', self.topic)
        return self._looks, self._records

    @np.errstate(over='ignore')
    def _draw(self, text: bytes) -> None:
        if self._layout and self._layout.fits(text):
            self._records = _records(self._places, self._layout.read(text))
            return
        message = deserialized(text, self._type)
        markers = getattr(message, 'markers', [message])
        shown = [place for place, marker in enumerate(markers)
                 if marker.type in KINDS and marker.action == Marker.ADD]
        numbers = {self._number(i): place for i, place in enumerate(shown)}
        looks = {number: _look(self._mechanism, markers[place])
                 for number, place in numbers.items()}
        # Markers that are missing now are drawn without points.
        places = {**dict.fromkeys(self._places), **numbers}
        records = _records(places, [np.array([(point.x, point.y, point.z)
                                              for point in marker.points]) for marker in markers])
        self._layout = _layout(text, message, places, records)
        self._looks, self._places, self._records = looks, places, records


def _layout(text: bytes, message: Any, places: Mapping[int, Optional[int]],
            records: bytes) -> Optional[MessageLayout]:
    """Return the layout of a message that was drawn, or None if it has none."""
    try:
        layout = MessageLayout(text, message)
    except NoLayout:
        return None
    return layout if _records(places, layout.read(text)) == records else None


def _records(places: Mapping[int, Optional[int]], points: Sequence[np.ndarray]) -> bytes:
    """Return the page's records of markers' points, by the markers' numbers and places."""
    records = []
    for number, place in places.items():
        shown = _shown(NO_POINTS if place is None else points[place])
        records += [struct.pack('<II', number, shown.size // 3), shown.tobytes()]
    return b''.join(records)


def _shown(numbers: ArrayLike) -> np.ndarray:
    """Return numbers as float32; raise ValueError if one is not finite or too large."""
    shown = np.asarray(numbers).astype('<f4')
    if not np.isfinite(shown).all():
        raise ValueError('a number in it is not finite, or too large to be drawn')
    return shown


def _look(mechanism: str, marker: Marker) -> dict[str, Any]:
    place, turn, colour = marker.pose.position, marker.pose.orientation, marker.color
    pose = [place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w]
    colours = [colour.r, colour.g, colour.b, colour.a]
    _shown([*pose, *colours, marker.scale.x])
    kind = OWN_KINDS.get((marker.type, marker.id), KINDS[marker.type])
    return {'mechanism': mechanism, 'kind': kind, 'pose': pose, 'frame': marker.header.frame_id,
            'width': marker.scale.x, 'colour': colours}
