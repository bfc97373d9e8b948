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

"""Node that publishes joint angles, markers and loci of a scene's mechanisms."""

import math
import sys

import numpy as np
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from visualization_msgs.msg import Marker, MarkerArray

from . import messages, node, scene

ANY = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SECONDS_BETWEEN_WARNINGS = 5.0


class Kinematics(node.SceneNode):
    """Solves the mechanisms at the angles on `crank_states`, as far as anyone listens."""

    def __init__(self, **kwargs):
        super().__init__(scene.KINEMATICS, **kwargs)
        self._outlets = {name: Outlet(self, name) for name in self.scene.machines}
        self._names = []
        self._places = {}
        self.follow(self.scene)
        self.create_subscription(JointState, 'crank_states', self._turn, ANY)

    def follow(self, new):
        """Make anew what has changed."""
        for name, machine in new.machines.items():
            self._outlets[name].follow(machine, new.frame_id)

    def _turn(self, cranks):
        if cranks.name != self._names:
            self._names = list(cranks.name)
            self._places = {name: i for i, name in enumerate(self._names)}
        for outlet in self._outlets.values():
            place = self._places.get(outlet.crank)
            if place is not None and place < len(cranks.position):
                known = len(cranks.velocity) == len(cranks.name)
                outlet.turn(cranks.header.stamp, cranks.position[place],
                            cranks.velocity[place] if known else math.nan)


class Outlet:
    """The topics of one mechanism."""

    def __init__(self, node_, name: str):
        self.crank = f'{name}_crank'
        self._joint_states = node_.create_publisher(JointState, f'{name}/joint_states', 10)
        self._markers = node_.create_publisher(MarkerArray, f'{name}/markers', 1)
        self._locus = node_.create_publisher(Marker, f'{name}/locus', LATCHED)
        # A logger of its own: what is throttled is the warnings of this mechanism alone.
        self._logger = node_.get_logger().get_child(name)
        self._made_for = None

    def follow(self, machine: scene.Machine, frame_id: str):
        """Make assembly and messages for a mechanism, if it is another, and send its locus."""
        if self._made_for == (machine, frame_id):
            return
        self._made_for = machine, frame_id
        self._name, self._points = machine.name, machine.points
        self._assembly = machine.assembly()
        self._joint_names = np.array([
            [f'{machine.name}_{leg.prefix}{joint}' for joint in self._assembly.joints]
            for leg in self._assembly.legs])
        drawn = machine.name, frame_id, machine.pose
        place = {point: i for i, point in enumerate(machine.points)}
        bars = [(place[p], place[q]) for p, q in machine.linkage.bars
                if p in place and q in place]
        size = machine.scale * float(machine.linkage.longest)
        self._marker_array = messages.Markers(*drawn, bars, size)
        self._joint_state = messages.JointStates()
        curve = self._assembly.locus(machine.tracer)
        if len(curve) > 1:
            self._locus.publish(messages.locus(*drawn, curve, size))

    def turn(self, stamp, theta: float, speed: float):
        """Publish what is listened to at a crank angle [rad]; speed [rad/s] or NaN if unknown."""
        joints = self._joint_states.get_subscription_count()
        markers = self._markers.get_subscription_count()
        if not joints and not markers:
            return
        angles = self._assembly.angles(theta)
        reached = self._assembly.within_reach(angles)
        if joints and reached.any():
            reached &= self._send_joints(stamp, theta, speed, angles, reached)
        if markers and reached.any():
            reached &= self._send_markers(stamp, angles, reached)
        if not reached.all():
            self._warn(theta, reached)

    def _warn(self, theta, reached):
        legs = [f'{self._name}_{leg.prefix}'.rstrip('_')
                for leg, held in zip(self._assembly.legs, reached) if not held]
        self._logger.warning(
            f'{", ".join(legs)} cannot be assembled at crank angle {theta:.6g} rad; the reach is '
            f'{scene.in_words(self._assembly.reach)} rad',
            throttle_duration_sec=SECONDS_BETWEEN_WARNINGS)

    def _send_joints(self, stamp, theta, speed, angles, reached):
        positions = self._assembly.joint_angles(angles)
        legs = reached & np.isfinite(positions).all(axis=1)
        if legs.any():
            names = [self.crank, *self._joint_names[legs].ravel().tolist()]
            velocities = ()
            if math.isfinite(speed):
                rates = self._assembly.joint_rates(angles)[legs] * speed
                velocities = [speed, *rates.flat] if np.isfinite(rates).all() else ()
            self._joint_states.publish(self._joint_state.message(
                stamp, names, [theta, *positions[legs].flat], velocities))
        return legs

    def _send_markers(self, stamp, angles, reached):
        places = self._assembly.points(angles, self._points)
        legs = reached & np.isfinite(places).all(axis=(1, 2))
        if legs.any():
            self._markers.publish(self._marker_array.message(stamp, places[legs]))
        return legs


def main(args=None):
    """Run the node; return the exit code."""
    return node.run(Kinematics, scene.KINEMATICS, args)


if __name__ == '__main__':
    sys.exit(main())
