# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""
A node that is measured, as a process of its own.

    python -m benchmark.nodes.subject KIND [options] --ros-args ...

KIND is one of KINDS below. With --times FILE it says at its end how long its parts took.
"""

import argparse
from functools import partial
import json
from pathlib import Path
import pickle
import statistics
import sys
import time

from linkage_interfaces.srv import ServoInverse
from linkage_ros import scene
from linkage_ros.nodes import mechanism_topics, messages, scene_node
from linkage_ros.nodes.joint_state_reader import ANY
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.nodes.mechanism_model import MechanismModel
from linkage_ros.nodes.message_layout import unpack
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from .quiet import until_the_end
from .relay import Loops


class Floor(Node):
    """Publishes ready bytes at each crank message."""

    ready = {}

    def __init__(self, **kwargs):
        super().__init__('floor', **kwargs)
        self._out = [(self.create_publisher(type_, topic, depth), text)
                     for topic, (type_, depth, text) in self.ready.items()]
        self.create_subscription(JointState, 'crank_states', self._turn, ANY)

    @until_the_end
    def _turn(self, _):
        for publisher, text in self._out:
            publisher.publish(text)


class Timed(Node):
    """Publishes ready bytes at a rate."""

    ready = {}

    def __init__(self):
        super().__init__('timed', automatically_declare_parameters_from_overrides=True)
        self._out = [(self.create_publisher(type_, topic, depth), text)
                     for topic, (type_, depth, text) in self.ready.items()]
        self.create_timer(1.0 / self.get_parameter('rate').value, self._tick)

    @until_the_end
    def _tick(self):
        for publisher, text in self._out:
            publisher.publish(text)


class Deaf(Node):
    """Does nothing at each crank message."""

    def __init__(self):
        super().__init__('deaf')
        self.create_subscription(JointState, 'crank_states', self._turn, ANY)

    def _turn(self, _):
        pass


class Unpatched:
    """Publishes messages that are built anew each time."""

    def __init__(self, parts):
        self._parts = parts

    def publish(self, stamp, values):
        """Publish them with a packed stamp and values."""
        for publisher, build in self._parts:
            publisher.publish(build(unpack(stamp), values))


class FreshModel(MechanismModel):
    """Builds ordinary messages, as one writes it: new ones each time."""

    def _publisher(self, key):
        state, topics = key
        return Unpatched([(topic, partial(build, state)) for topic, build in zip(
            topics, (self.joint_message, self.marker_message)) if topic])

    def marker_message(self, *args):
        """Return new markers."""
        self.marker_array = messages.Markers(*self._drawn)
        return super().marker_message(*args)


class Relay(Node):
    """Finds the joint angles of one leg numerically."""

    def __init__(self, **kwargs):
        super().__init__('relay', **kwargs)
        machine = scene.read({'mechanisms': ['leg'], 'leg.type': 'jansen'}).machines['leg']
        self._loops = Loops(machine.linkage)
        self._names = [f'leg_{link.name}' for link in machine.linkage.links]
        self._publisher = self.create_publisher(JointState, 'leg/joint_states', 10)
        self.create_subscription(JointState, 'crank_states', self._turn, ANY)

    @until_the_end
    def _turn(self, cranks):
        angles = self._loops.joint_angles(cranks.position[0])
        message = JointState(name=self._names, position=angles.tolist())
        message.header.stamp = cranks.header.stamp
        self._publisher.publish(message)


class Triggered(Node):
    """Answers a service without a question."""

    def __init__(self):
        super().__init__('triggered')
        self.create_service(Trigger, 'trigger', self.answer)

    def answer(self, _, response):
        """Answer."""
        response.success = True
        return response


class Echoed(Node):
    """Answers the type of `servo_inverse` with what it was asked."""

    def __init__(self):
        super().__init__('echoed')
        self.create_service(ServoInverse, 'servo_inverse', self.answer)

    def answer(self, request, response):
        """Answer."""
        response.success = True
        response.servo_angle = response.reduction = request.lever_angle
        response.reachable = [True] * len(request.lever_angle)
        return response


class Ear(Node):
    """Subscribes to every topic of a scene, and never takes what arrives."""

    ready = {}

    def __init__(self):
        super().__init__('ear')
        # No executor knows of this one.
        self._idle = Node('idle')
        for topic, (type_, depth, _) in self.ready.items():
            self._idle.create_subscription(type_, topic, self._hear, depth, raw=True)

    def _hear(self, _):
        pass


class Fresh(Kinematics):
    """The same node with ordinary messages."""

    def __init__(self, **kwargs):
        # Other nodes in this process patch theirs.
        mechanism_topics.MechanismModel = FreshModel
        try:
            super().__init__(**kwargs)
        finally:
            mechanism_topics.MechanismModel = MechanismModel


KINDS = {'kinematics': Kinematics, 'fresh': Fresh, 'floor': Floor, 'relay': Relay,
         'timed': Timed, 'deaf': Deaf, 'trigger': Triggered, 'echo': Echoed, 'ear': Ear}


class Times:
    """What a tick takes, and publishing of it: CPU time of their thread [us], per tick."""

    def __init__(self):
        self._taken, self._ticks = {'tick': 0, 'publish': 0}, {'tick': [], 'publish': []}
        Publisher.publish = self._timed('publish', Publisher.publish)
        Node.create_subscription = self._with_ticks_timed(Node.create_subscription)

    def _with_ticks_timed(self, subscribe):
        def subscribe_timed(node, type_, topic, callback, *args, **kwargs):
            if topic == 'crank_states':
                callback = self._timed('tick', callback)
            return subscribe(node, type_, topic, callback, *args, **kwargs)
        return subscribe_timed

    def _timed(self, part, function):
        taken, whole = self._taken, part == 'tick'

        def timed(*args):
            start = time.thread_time_ns()
            try:
                return function(*args)
            finally:
                taken[part] += time.thread_time_ns() - start
                if whole:
                    self._end()
        return timed

    def _end(self):
        for part, times in self._ticks.items():
            times.append(1e-3 * self._taken[part])
            self._taken[part] = 0

    def medians(self):
        """Return the median of each part."""
        return {part: statistics.median(times[len(times) // 10:] or [0.0])
                for part, times in self._ticks.items()}


def ready(topics):
    """Return {topic: (type, depth, bytes)} of topics and the bytes that were heard on them."""
    return {topic.name: (JointState if topic.joints else MarkerArray, 10 if topic.joints else 1,
                         text) for topic, text in topics.items()}


def main():
    """Run the node; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('kind', choices=KINDS)
    parser.add_argument('--single', action='store_true', help='on the SingleThreadedExecutor')
    parser.add_argument('--ready', type=Path, help='what was heard on the topics')
    parser.add_argument('--times', type=Path, help='where to write how long its parts took')
    options = parser.parse_args(remove_ros_args()[1:])
    if options.ready:
        Floor.ready = Timed.ready = Ear.ready = ready(pickle.loads(options.ready.read_bytes()))
    times = Times() if options.times else None
    executor = SingleThreadedExecutor if options.single else scene_node.Executor
    own = len(remove_ros_args())
    args = sys.argv[:1] + sys.argv[own:]
    code = scene_node.run(KINDS[options.kind], options.kind, args, executor)
    if times:
        options.times.write_text(json.dumps(times.medians()))
    return code


if __name__ == '__main__':
    sys.exit(main())
