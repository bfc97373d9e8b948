# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Joint states and markers of a mechanism as messages, from the numbers that were solved."""

from array import array
import math
from typing import Mapping, Sequence

from geometry_msgs.msg import Point, Pose, Quaternion
import numpy as np
from sensor_msgs.msg import JointState
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from .. import palette

# How each marker is drawn, by its id: type, colour and width as a part of the longest bar.
LINKS_ID, JOINTS_ID, LOCUS_ID, GUIDES_ID, BODIES_ID = range(5)
LOOKS = ((Marker.LINE_LIST, palette.LINK, 1 / 40), (Marker.SPHERE_LIST, palette.JOINT, 1 / 20),
         (Marker.LINE_STRIP, palette.LOCUS, 1 / 100), (Marker.LINE_LIST, palette.TRACK, 1 / 60),
         (Marker.LINE_LIST, palette.DARK, 1 / 20))


class JointStates:
    """The joint states of one mechanism, or of several cranks."""

    def __init__(self):
        self._message = JointState()

    def message(self, stamp, names: Sequence[str], positions, velocities=(),
                efforts=()) -> JointState:
        """Return joints [rad or m], their velocities and efforts, where they are known."""
        self._message.header.stamp = stamp
        self._message.name = names
        self._message.position = array('d', positions)
        self._message.velocity = array('d', velocities)
        self._message.effort = array('d', efforts)
        return self._message


class Markers:
    """
    The links, joints, guides and bodies (barrels and blocks) of one mechanism, a marker each.

    Parameters
    ----------
    name : str
        The mechanism: the markers' namespace.
    frame_id : str
        Frame of the pose.
    pose : sequence of float
        Of the linkage's plane: x, y, z [m], roll, pitch, yaw [rad].
    size : float
        The longest bar [m].
    shown : mapping
        What each marker shows, by its id: joints or ends of lines, by their place among the
        points.

    Attributes
    ----------
    ids : frozenset of int
        Of the markers that there are.

    """

    def __init__(self, name: str, frame_id: str, pose, size: float,
                 shown: Mapping[int, Sequence]):
        self._shown = [(_marker(name, id_, frame_id, pose, size), np.array(points, int).ravel())
                       for id_, points in shown.items() if points]
        self._message = MarkerArray(markers=[marker for marker, _ in self._shown])
        self.ids = frozenset(marker.id for marker, _ in self._shown)
        self._points = {}

    def message(self, stamp, places: np.ndarray) -> MarkerArray:
        """Return the markers of places [m], shape (legs, points, 2)."""
        for marker, points in self._shown:
            marker.header.stamp = stamp
            marker.points = self._filled(marker.id, places[:, points].reshape(-1, 2).tolist())
        return self._message

    def _filled(self, id_, pairs):
        """Return points at x, y pairs; for as many as before, the same ones."""
        points = self._points.get((id_, len(pairs)))
        if points is None:
            points = self._points[id_, len(pairs)] = [Point() for _ in pairs]
        for point, (x, y) in zip(points, pairs):
            point.x, point.y = x, y
        return points


def locus(name: str, frame_id: str, pose, places: np.ndarray, size: float) -> Marker:
    """Return the curve through places [m], shape (n, 2); without a stamp it holds at any time."""
    marker = _marker(name, LOCUS_ID, frame_id, pose, size)
    marker.points = [Point(x=x, y=y) for x, y in places.tolist()]
    return marker


def deleted(name: str, id_: int) -> Marker:
    """Return the marker that takes another out of the picture."""
    return Marker(ns=name, id=id_, action=Marker.DELETE)


def quaternion(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation by roll, pitch and yaw [rad] about the fixed axes x, y, z in turn."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(0.5 * x), math.cos(0.5 * x))
                                    for x in (roll, pitch, yaw))
    return Quaternion(x=sr * cp * cy - cr * sp * sy, y=cr * sp * cy + sr * cp * sy,
                      z=cr * cp * sy - sr * sp * cy, w=cr * cp * cy + sr * sp * sy)


def _marker(name, id_, frame_id, pose, size) -> Marker:
    type_, colour, width = LOOKS[id_]
    marker = Marker(ns=name, id=id_, type=type_, action=Marker.ADD)
    marker.header.frame_id = frame_id
    x, y, z, *angles = pose
    marker.pose = Pose(position=Point(x=x, y=y, z=z), orientation=quaternion(*angles))
    marker.scale.x = width * size
    if type_ == Marker.SPHERE_LIST:
        marker.scale.y = marker.scale.z = width * size
    marker.color = ColorRGBA(**dict(zip('rgb', palette.rgb(colour))), a=1.0)
    return marker
