# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""An outside subscriber and client: it knows the names of the topics, and nothing of the nodes."""

import time

from linkage_interfaces.srv import ServoInverse
from nodes import DemoError
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from visualization_msgs.msg import Marker, MarkerArray

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SECONDS_TO_APPEAR = 20.0
SECONDS_TO_ANSWER, TRIES = 4.0, 5


class Listener:
    """
    Subscribes to the topics of a scene's mechanisms, on a domain of its own.

    Parameters
    ----------
    names : iterable of str
        The mechanisms.
    domain : int
        ROS_DOMAIN_ID.
    watch : callable
        Called again and again while waiting; raises if waiting is vain.

    """

    def __init__(self, names, domain: int, watch):
        self.joint_states = {name: [] for name in names}
        self.markers = {name: [] for name in names}
        self.locus = {name: [] for name in names}
        self._watch = watch
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=domain,
                   signal_handler_options=SignalHandlerOptions.NO)
        self._node = rclpy.create_node('demo', context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        for name in names:
            for type_, topic, gathered, qos in (
                    (JointState, 'joint_states', self.joint_states, 10),
                    (MarkerArray, 'markers', self.markers, 10),
                    (Marker, 'locus', self.locus, LATCHED)):
                self._node.create_subscription(
                    type_, f'{name}/{topic}', gathered[name].append, qos)
        self._inverse = self._node.create_client(ServoInverse, 'servo_inverse')

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.try_shutdown(context=self._context)

    def discover(self):
        """Wait until every topic has spoken and the service is there; raise DemoError if not."""
        self._until(lambda: not self._silent(), self._silent)
        self._until(self._inverse.service_is_ready, lambda: ['the service servo_inverse'])

    def listen(self, seconds: float):
        """Gather the messages of so many seconds from now on."""
        for gathered in (self.joint_states, self.markers):
            for messages in gathered.values():
                messages.clear()
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._turn()

    def servo_angles(self, lever_angles) -> ServoInverse.Response:
        """Call the service for lever angles [rad]."""
        request = ServoInverse.Request(lever_angle=lever_angles)
        for _ in range(TRIES):
            # A response may get lost on its way.
            future = self._inverse.call_async(request)
            if self._within(SECONDS_TO_ANSWER, future.done):
                return future.result()
        raise DemoError('servo_inverse did not answer')

    def _silent(self):
        topics = {'joint_states': self.joint_states, 'markers': self.markers, 'locus': self.locus}
        return [f'{name}/{topic}' for topic, gathered in topics.items()
                for name, messages in gathered.items() if not messages]

    def _until(self, held, missing):
        if not self._within(SECONDS_TO_APPEAR, held):
            raise DemoError(f'nothing was heard of {", ".join(missing())} '
                            f'within {SECONDS_TO_APPEAR:g} s')

    def _within(self, seconds, held) -> bool:
        end = time.monotonic() + seconds
        while not held() and time.monotonic() < end:
            self._turn()
        return held()

    def _turn(self):
        self._watch()
        self._executor.spin_once(timeout_sec=0.1)
