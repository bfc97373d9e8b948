# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.


"""The messages of one mechanism, as arrays and as a motion that `render` draws."""

from linkage_ros.nodes.messages import BODIES_ID, GUIDES_ID, JOINTS_ID
from linkage_ros.render.cycle import Configuration, Wheel
import numpy as np
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from visualization_msgs.msg import Marker, MarkerArray

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Received:
    """
    The messages of a mechanism, gathered by a `ros_harness.Graph`.

    It replaces the Cycle of a Picture: `period`, `prefixes`, `course`, `pose` and `locus` are
    those of a Cycle, but of the messages. Turns are counted from the time `start` [s].
    """

    def __init__(self, mechanism, graph):
        self.mechanism, self.start = mechanism, 0.0
        self._states, self._markers, self._loci = (
            graph.listen(type_, f'{mechanism.name}/{topic}', qos) for type_, topic, qos in (
                (JointState, 'joint_states', 10), (MarkerArray, 'markers', 10),
                (Marker, 'locus', LATCHED)))
        self.prefixes = tuple(mechanism.assembly().legs)
        self.period = Wheel(mechanism.first).period

    @property
    def is_complete(self) -> bool:
        """Whether a message of each topic has been received."""
        return bool(self._states and self._markers and self._loci)

    def read(self) -> float:
        """Convert the messages to arrays; return the first stamp [s]."""
        states = {_seconds(state): dict(zip(state.name, state.position))
                  for state in self._states}
        arrays = {_seconds(array.markers[0]): array.markers for array in self._markers}
        self.times = np.array(sorted(states.keys() & arrays.keys()))
        self._inputs = [tuple(states[time][f'{self.mechanism.name}_{name}']
                              for name in self.mechanism.inputs) for time in self.times]
        # As in a Cycle: joints, guides and bodies.
        self.course = np.concatenate([
            np.array([_points(marker) for marker in markers]).reshape(
                len(markers), len(self.prefixes), -1, 2)
            for markers in zip(*(arrays[time] for time in self.times))
            if markers[0].id in (JOINTS_ID, GUIDES_ID, BODIES_ID)], axis=2)
        return self.times[0]

    @property
    def rate(self) -> float:
        """Messages in a second [Hz]."""
        return (len(self.times) - 1) / (self.times[-1] - self.times[0])

    @property
    def extent(self) -> np.ndarray:
        """Width and height of the traced curve [m]."""
        return np.ptp(self.locus(), axis=0)

    def length_error(self) -> float:
        """Return the largest error of a bar's length, as a part of the longest bar."""
        linkage, scale = self.mechanism.linkage, self.mechanism.scale
        lengths = scale * np.array([linkage.bar_lengths[bar] for bar in linkage.bars])
        first, last = (self.course[:, :, [self.mechanism.points.index(name) for name in names]]
                       for names in zip(*linkage.bars))
        received = np.hypot(*np.moveaxis(last - first, -1, 0))
        return float(np.max(np.abs(received - lengths)) / (scale * linkage.longest))

    def pose(self, turns: float) -> Configuration:
        """Return the configuration at a time [turns]: that of the latest message."""
        # A time may be rounded.
        time = self.start + turns * self.period + 1e-6
        latest = max(int(np.searchsorted(self.times, time, side='right')) - 1, 0)
        return Configuration(turns, self._inputs[latest], self.course[latest])

    def locus(self, *_) -> np.ndarray:
        """Return the traced curve [m], shape (n, 2)."""
        return _points(self._loci[-1])


def _points(marker) -> np.ndarray:
    """Return the points of a marker in its plane [m], shape (n, 2)."""
    return np.array([(point.x, point.y) for point in marker.points])


def _seconds(message) -> float:
    """Return the stamp of a message [s]."""
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
