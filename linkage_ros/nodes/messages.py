# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Build joint states and markers from solved positions and points."""

from __future__ import annotations

from array import array
import math
from typing import Any, Mapping, Sequence

from geometry_msgs.msg import Point, Pose, Quaternion
import numpy as np
from sensor_msgs.msg import JointState
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from .. import palette

(LINKS_ID, JOINTS_ID, LOCUS_ID, GUIDES_ID, BODIES_ID, CRANKS_ID, DRIVEN_ID, PLATES_ID,
 GROUND_ID) = range(9)
# Type, colour, width as a fraction of the longest bar, and layer of each marker, by its id. Layers
# have different heights above the linkage's plane, so that markers do not flicker in RViz.
LOOKS = (
    (Marker.LINE_LIST, palette.BAR, 1 / 40, 0),
    (Marker.SPHERE_LIST, palette.JOINT, 1 / 20, 0),
    (Marker.LINE_STRIP, palette.LOCUS, 1 / 100, -3),
    (Marker.LINE_LIST, palette.SLOT, 1 / 14, 1),
    (Marker.LINE_LIST, palette.BAR, 1 / 22, 3),
    (Marker.LINE_LIST, palette.DRIVEN, 1 / 40, 2),
    (Marker.LINE_LIST, palette.DRIVEN, 1 / 22, 4),
    (Marker.TRIANGLE_LIST, palette.BAR, None, -1),
    (Marker.TRIANGLE_LIST, palette.EARTH, None, -2))
# Distance between layers, as a fraction of the longest bar.
STEP = 1 / 250


def _rgba(colour: str) -> ColorRGBA:
    return ColorRGBA(**dict(zip('rgb', palette.rgb(colour))), a=1.0)


# Colour of the faces of plates, which is another than that of their marker.
FACE = _rgba(palette.PLATE)


def joint_states(stamp: Any, names: Sequence[str], positions: Any, velocities: Any = (),
                 efforts: Any = ()) -> JointState:
    """Build joint states: positions [rad or m], velocities [rad/s or m/s], efforts [N m or N]."""
    message = JointState(name=names, position=array('d', positions),
                         velocity=array('d', velocities), effort=array('d', efforts))
    message.header.stamp = stamp
    return message


class Markers:
    """
    The markers of a mechanism: links, joints, guides and so on.

    Parameters
    ----------
    name : str
        Name of the mechanism, which is the namespace of its markers.
    frame_id, pose, size
        Frame of the pose; the pose x, y, z [m], roll, pitch, yaw [rad]; longest bar [m].
    shown : mapping
        By marker id, the point indices of each joint, line or triangle.

    """

    def __init__(self, name: str, frame_id: str, pose: Sequence[float], size: float,
                 shown: Mapping[int, Sequence]):
        self._shown = [(_marker(name, id_, frame_id, pose, size), np.array(points, int).ravel())
                       for id_, points in shown.items() if points]

    def message(self, stamp: Any, places: np.ndarray, grounded: Sequence[int] = (0,)
                ) -> MarkerArray:
        """
        Return the markers with the points of all legs; they are the same objects at each call.

        `places` are the points' coordinates [m], (legs, points, 2 or 3). `grounded` are the legs
        whose ground is drawn.
        """
        for marker, points in self._shown:
            marker.header.stamp = stamp
            legs = places[grounded] if marker.id == GROUND_ID else places
            marker.points = [Point(**dict(zip('xyz', place))) for place in legs[:, points].reshape(
                -1, places.shape[-1]).tolist()]
            if marker.type == Marker.TRIANGLE_LIST:
                # RViz draws both sides of faces alike only with per-vertex colours.
                face = FACE if marker.id == PLATES_ID else marker.color
                marker.colors = [face] * (len(marker.points) // 3)
        return MarkerArray(markers=[marker for marker, _ in self._shown])


def locus(name: str, frame_id: str, pose: Sequence[float], places: np.ndarray,
          size: float, mirrored: bool) -> Marker:
    """
    Build the marker of the curve through points [m], (n, 2); see Markers.

    With its mirror image, it is a list of lines instead of one strip.
    """
    # Its stamp is zero: RViz uses the latest pose of the frame.
    marker = _marker(name, LOCUS_ID, frame_id, pose, size)
    if mirrored:
        marker.type = Marker.LINE_LIST
        lines = np.repeat(places, 2, axis=0)[1:-1]
        places = np.concatenate([lines, lines * (-1.0, 1.0)])
    marker.points = [Point(**dict(zip('xyz', place))) for place in places.tolist()]
    return marker


def deleted(name: str, id_: int) -> Marker:
    """Build the marker that deletes marker `id_` of the namespace `name`."""
    return Marker(ns=name, id=id_, action=Marker.DELETE)


def quaternion(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation by roll, pitch and yaw [rad] about the fixed axes x, y, z in turn."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(0.5 * x), math.cos(0.5 * x))
                                    for x in (roll, pitch, yaw))
    return Quaternion(x=sr * cp * cy - cr * sp * sy, y=cr * sp * cy + sr * cp * sy,
                      z=cr * cp * sy - sr * sp * cy, w=cr * cp * cy + sr * sp * sy)


def _marker(name: str, id_: int, frame_id: str, pose: Sequence[float], size: float) -> Marker:
    type_, colour, width, layer = LOOKS[id_]
    marker = Marker(ns=name, id=id_, type=type_, action=Marker.ADD)
    marker.header.frame_id = frame_id
    turn, height = quaternion(*pose[3:]), STEP * size * layer
    upright = (2.0 * (turn.x * turn.z + turn.w * turn.y),
               2.0 * (turn.y * turn.z - turn.w * turn.x),
               1.0 - 2.0 * (turn.x * turn.x + turn.y * turn.y))
    x, y, z = (place + height * part for place, part in zip(pose, upright))
    marker.pose = Pose(position=Point(x=x, y=y, z=z), orientation=turn)
    marker.scale.x = width * size if width else 1.0
    if type_ in (Marker.SPHERE_LIST, Marker.TRIANGLE_LIST):
        marker.scale.y = marker.scale.z = marker.scale.x
    marker.color = _rgba(colour)
    return marker
