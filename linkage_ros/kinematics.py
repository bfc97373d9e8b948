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

"""Node that publishes joint angles, markers, loci and robot models of a scene's mechanisms."""

import math
import sys
from typing import NamedTuple, Optional, Sequence

import numpy as np
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from visualization_msgs.msg import Marker, MarkerArray

from . import messages, node, reading, scene, urdf
from .solution import Layout
from .wire import unpack, Wire
from .words import listed

# Any source will do; what comes while the node is kept waiting, 50 ms at 1000 Hz, is not lost.
ANY = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SECONDS_BETWEEN_WARNINGS = 5.0


class Kinematics(node.SceneNode):
    """Solves the mechanisms at the angles on `crank_states`, as far as anyone listens."""

    def __init__(self, **kwargs):
        super().__init__(scene.KINEMATICS, **kwargs)
        self._outlets = {name: Outlet(self, name) for name in self.scene.machines}
        self._names, self._routes = None, ()
        self._reader = reading.Reader()
        self.begin()
        self.create_subscription(JointState, 'crank_states', self._turn, ANY, raw=True)

    def serves(self):
        """Say which mechanisms it moves."""
        return f'moves {listed(self.scene.machines, 200)} by crank_states'

    def adopt(self, new):
        """Make anew what has changed."""
        for name, machine in new.machines.items():
            self._outlets[name].follow(machine, new.frame_id)

    @node.until_the_end
    def _turn(self, text):
        stamp, names, positions, speeds = self._reader.read(text)
        if names is not self._names:
            self._names, self._routes = names, self._routed(names, len(positions))
        known = len(speeds) == len(names)
        for outlet, places in self._routes:
            outlet.turn(stamp, [positions[i] for i in places],
                        [speeds[i] for i in places] if known else [])

    def _routed(self, names, positions):
        """Return the mechanisms that a message turns, and where it says how far."""
        places = {name: i for i, name in enumerate(names[:positions])}
        return [(outlet, [places[crank] for crank in outlet.cranks])
                for outlet in self._outlets.values() if places.keys() >= set(outlet.cranks)]


class Drive(NamedTuple):
    """What a pose is made from: crank angles [rad], speeds [rad/s] if known, and who listens."""

    thetas: Sequence[float]
    speeds: Sequence[float]
    joints: bool
    markers: bool


class Pose(NamedTuple):
    """
    What is shown of a mechanism.

    `held` tells which legs can be assembled, None that all can; `moving` whether all velocities
    are known.
    """

    layout: Layout
    values: np.ndarray
    held: Optional[np.ndarray]
    moving: bool

    def rows(self) -> np.ndarray:
        """Return the rows of the legs that can be assembled."""
        rows = self.layout.rows(self.values)
        return rows if self.held is None else rows[self.held]


class Outlet:
    """The topics of one mechanism."""

    def __init__(self, node_, name: str):
        self._name = name
        self._joint_states = node_.create_publisher(JointState, f'{name}/joint_states', 10)
        self._markers = node_.create_publisher(MarkerArray, f'{name}/markers', 1)
        self._locus = node_.create_publisher(Marker, f'{name}/locus', LATCHED)
        self._description = node_.create_publisher(String, f'{name}/robot_description', LATCHED)
        self._described = None
        # A logger of its own: what is throttled is the warnings of this mechanism alone.
        self._logger = node_.get_logger().get_child(name)
        self._made_for = None

    def follow(self, machine: scene.Machine, frame_id: str):
        """Make what a mechanism needs, if it is another, and send its locus and robot model."""
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
        self._drive, self._solutions, self._wires = None, {}, {}
        curve = self._assembly.locus(machine.tracer)
        if len(curve) > 1:
            self._locus.publish(messages.locus(*drawn, curve, size))
        self._describe(urdf.describe([machine], frame_id))

    def _describe(self, robot):
        if robot != self._described:
            self._described = robot
            self._description.publish(String(data=robot))

    def turn(self, stamp: bytes, thetas: Sequence[float], speeds: Sequence[float]):
        """Publish what is listened to at crank angles [rad]; speeds [rad/s], or none."""
        drive = Drive(thetas, speeds, self._joint_states.get_subscription_count() > 0,
                      self._markers.get_subscription_count() > 0)
        if not (drive.joints or drive.markers):
            return
        if drive != self._drive:
            self._drive = drive
            self._solve(drive)
        held = self._pose.held
        if held is not None:
            self._warn(thetas, held)
        if held is None or held.any():
            if drive.joints:
                self._send('joints', self._joint_states, self._joint_message, stamp)
            if drive.markers:
                self._send('markers', self._markers, self._marker_message, stamp)

    def _solve(self, drive):
        """Solve the legs, once for each drive, for those who listen."""
        wanted = drive.joints, drive.markers, len(drive.speeds)
        if wanted not in self._solutions:
            self._solutions[wanted] = self._solution(*wanted)
        solution = self._solutions[wanted]
        solution.solve(drive.thetas, drive.speeds)
        layout, values = solution.layout, solution.values
        held, moving = None, layout.velocities > 0
        if self._assembly.is_limited:
            held = self._assembly.within_reach(drive.thetas[0])
        # One sum, of squares, tells whether all values are finite; it is rarely asked which are.
        if not math.isfinite(values.dot(values)):
            finite = np.isfinite(solution.rows[:, :layout.posed]).all(axis=1)
            held = finite if held is None else held & finite
            moving = moving and bool(np.isfinite(solution.rows[held, layout.posed:]).all())
        if held is not None and held.all():
            held = None
        self._pose = Pose(layout, values, held, moving)

    def _solution(self, joints, markers, moving):
        names = self._assembly.joints if joints else ()
        return self._assembly.solution(
            self._points if markers else (), names, names if moving else ())

    def _warn(self, thetas, held):
        legs = [f'{self._name}_{leg.prefix}'.rstrip('_')
                for leg, placed in zip(self._assembly.legs, held) if not placed]
        angles = ', '.join(f'{theta:.6g}' for theta in thetas)
        self._logger.warning(
            f'{", ".join(legs)} cannot be assembled at crank angle {angles} rad; the reach is '
            f'{scene.in_words(self._assembly.reach)} rad',
            throttle_duration_sec=SECONDS_BETWEEN_WARNINGS)

    def _send(self, what, publisher, build, stamp):
        """Publish all legs by patching one message; where some are left out, build another."""
        pose = self._pose
        if pose.held is not None:
            publisher.publish(build(pose, unpack(stamp)))
            return
        kind = what, pose.moving, pose.layout
        if kind not in self._wires:
            self._wires[kind] = Wire(
                publisher, lambda stamp, values: build(pose._replace(values=values), stamp),
                pose.layout.size, self._logger)
        self._wires[kind].send(stamp, pose.values)

    def _joint_message(self, pose, stamp):
        legs = slice(None) if pose.held is None else pose.held
        names = [*self.cranks, *self._joint_names[legs].ravel().tolist()]
        layout, rows, drive = pose.layout, pose.rows(), pose.layout.drive(pose.values)
        thetas, speeds = drive[:layout.cranks], drive[layout.cranks:]
        return self._joint_state.message(
            stamp, names, [*thetas, *rows[:, layout.coordinates:layout.posed].flat],
            [*speeds, *rows[:, layout.posed:].flat] if pose.moving else ())

    def _marker_message(self, pose, stamp):
        places = pose.rows()[:, :pose.layout.coordinates]
        return self._marker_array.message(stamp, places.reshape(len(places), -1, 2))


def main(args=None):
    """Run the node; return the exit code."""
    return node.run(Kinematics, scene.KINEMATICS, args)


if __name__ == '__main__':
    sys.exit(main())
