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

import sys
from typing import NamedTuple, Sequence

import numpy as np
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from visualization_msgs.msg import Marker, MarkerArray

from . import messages, node, scene
from .wire import Wire

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
        positions, speeds = cranks.position, cranks.velocity
        known = len(speeds) == len(cranks.name)
        for outlet in self._outlets.values():
            places = [self._places.get(name, len(positions)) for name in outlet.cranks]
            if max(places) < len(positions):
                outlet.turn(cranks.header.stamp, [positions[i] for i in places],
                            [speeds[i] for i in places] if known else [])


class Drive(NamedTuple):
    """What a pose is made from: crank angles [rad], speeds [rad/s] if known, and who listens."""

    thetas: Sequence[float]
    speeds: Sequence[float]
    joints: bool
    markers: bool


class Outlet:
    """The topics of one mechanism."""

    def __init__(self, node_, name: str):
        self._name = name
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
        self._points = machine.points
        self._assembly = machine.assembly()
        self.cranks = [f'{self._name}_{crank}' for crank in machine.linkage.cranks]
        self._joint_names = np.array([
            [f'{self._name}_{leg.prefix}{joint}' for joint in self._assembly.joints]
            for leg in self._assembly.legs])
        drawn = self._name, frame_id, machine.pose
        place = {point: i for i, point in enumerate(machine.points)}
        bars = [(place[p], place[q]) for p, q in machine.linkage.bars
                if p in place and q in place]
        size = machine.scale * float(machine.linkage.longest)
        self._marker_array = messages.Markers(*drawn, bars, size)
        self._joint_state = messages.JointStates()
        self._drive, self._solvers, self._wires = None, {}, {}
        curve = self._assembly.locus(machine.tracer)
        if len(curve) > 1:
            self._locus.publish(messages.locus(*drawn, curve, size))

    def turn(self, stamp, thetas: Sequence[float], speeds: Sequence[float]):
        """Publish what is listened to at crank angles [rad]; speeds [rad/s], or none."""
        drive = Drive(thetas, speeds, self._joint_states.get_subscription_count() > 0,
                      self._markers.get_subscription_count() > 0)
        if not (drive.joints or drive.markers):
            return
        if drive != self._drive:
            self._drive = drive
            self._solve(drive)
        if not self._whole:
            self._warn(thetas)
        if drive.joints:
            self._send_joints(stamp, drive)
        if drive.markers:
            self._send_markers(stamp)

    def _solve(self, drive):
        """Solve the legs, once for each drive, for those who listen."""
        points = self._points if drive.markers else ()
        joints = self._assembly.joints if drive.joints else ()
        rates = joints if drive.speeds else ()
        wanted = points, joints, rates
        if wanted not in self._solvers:
            self._solvers[wanted] = self._assembly.solver(*wanted)
        solved = self._solvers[wanted](*drive.thetas)
        self._places = solved[:, :2 * len(points)]
        self._angles = solved[:, 2 * len(points):2 * len(points) + len(joints)]
        turning = solved[:, 2 * len(points) + len(joints):]
        self._rates = sum(speed * turning[:, i * len(rates):(i + 1) * len(rates)]
                          for i, speed in enumerate(drive.speeds))
        posed = solved[:, :2 * len(points) + len(joints)]
        self._legs = self._assembly.within_reach(drive.thetas) & np.isfinite(posed).all(axis=1)
        self._whole = bool(self._legs.all())

    def _warn(self, thetas):
        legs = [f'{self._name}_{leg.prefix}'.rstrip('_')
                for leg, held in zip(self._assembly.legs, self._legs) if not held]
        angles = ', '.join(f'{theta:.6g}' for theta in thetas)
        self._logger.warning(
            f'{", ".join(legs)} cannot be assembled at crank angle {angles} rad; the reach is '
            f'{scene.in_words(self._assembly.reach)} rad',
            throttle_duration_sec=SECONDS_BETWEEN_WARNINGS)

    def _send_joints(self, stamp, drive):
        moving = bool(drive.speeds) and np.isfinite(self._rates[self._legs]).all()
        parts = [[drive.thetas], self._angles[self._legs]]
        if moving:
            parts += [[drive.speeds], self._rates[self._legs]]
        values = np.concatenate([np.ravel(part) for part in parts])
        self._send('joints', moving, self._joint_states, self._joint_message, stamp, values)

    def _joint_message(self, stamp, values, legs, moving):
        names = [*self.cranks, *self._joint_names[legs].ravel().tolist()]
        return self._joint_state.message(stamp, names, values[:len(names)],
                                         values[len(names):] if moving else ())

    def _send_markers(self, stamp):
        values = self._places[self._legs].ravel()
        self._send('markers', False, self._markers, self._marker_message, stamp, values)

    def _marker_message(self, stamp, values, legs, _):
        return self._marker_array.message(stamp, values.reshape(-1, len(self._points), 2))

    def _send(self, what, moving, publisher, build, stamp, values):
        """Publish all legs by patching one message; where some are left out, build another."""
        if not self._legs.any():
            return
        if not self._whole:
            publisher.publish(build(stamp, values, self._legs, moving))
            return
        if (what, moving) not in self._wires:
            legs = self._legs
            self._wires[what, moving] = Wire(
                publisher, lambda stamp, values: build(stamp, values, legs, moving),
                len(values), self._logger)
        self._wires[what, moving].send(stamp, values)


def main(args=None):
    """Run the node; return the exit code."""
    return node.run(Kinematics, scene.KINEMATICS, args)


if __name__ == '__main__':
    sys.exit(main())
