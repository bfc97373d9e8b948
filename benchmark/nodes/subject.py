# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
A node that is measured, as a process of its own.

    python -m benchmark.nodes.subject KIND [--ready FILE] --ros-args ...

KIND is one of KINDS below.
"""

import argparse
from pathlib import Path
import pickle
import sys

from linkage_ros import scene
from linkage_ros.nodes import scene_node
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.nodes.message_layout import ANY
from rclpy.node import Node
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import JointState
from visualization_msgs.msg import MarkerArray

from .relay import Loops


class Floor(Node):
    """Publishes ready bytes at each crank message."""

    ready = {}

    def __init__(self, **kwargs):
        super().__init__('floor', **kwargs)
        self._out = [(self.create_publisher(type_, topic, depth), text)
                     for topic, (type_, depth, text) in self.ready.items()]
        self.create_subscription(JointState, 'crank_states', self._turn, ANY)

    def _turn(self, _):
        for publisher, text in self._out:
            publisher.publish(text)


class Deaf(Node):
    """Does nothing at each crank message."""

    def __init__(self):
        super().__init__('deaf')
        self.create_subscription(JointState, 'crank_states', self._turn, ANY)

    def _turn(self, _):
        pass


class Relay(Node):
    """Finds the joint angles of one leg numerically."""

    def __init__(self, **kwargs):
        super().__init__('relay', **kwargs)
        mechanism = scene.read({'mechanisms': ['leg'], 'leg.type': 'jansen'}).mechanisms['leg']
        self._loops = Loops(mechanism.linkage)
        self._names = [f'leg_{link.name}' for link in mechanism.linkage.links]
        self._publisher = self.create_publisher(JointState, 'leg/joint_states', 10)
        self.create_subscription(JointState, 'crank_states', self._turn, ANY)

    def _turn(self, cranks):
        angles = self._loops.joint_angles(cranks.position[0])
        message = JointState(name=self._names, position=angles.tolist())
        message.header.stamp = cranks.header.stamp
        self._publisher.publish(message)


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


KINDS = {'kinematics': Kinematics, 'floor': Floor, 'relay': Relay, 'deaf': Deaf, 'ear': Ear}


def ready(topics):
    """Return {topic: (type, depth, bytes)} of topics and the bytes that were heard on them."""
    return {topic.name: (JointState if topic.joints else MarkerArray, 10 if topic.joints else 1,
                         text) for topic, text in topics.items()}


def main():
    """Run the node; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('kind', choices=KINDS)
    parser.add_argument('--ready', type=Path, help='what was heard on the topics')
    own = remove_ros_args()
    options = parser.parse_args(own[1:])
    if options.ready:
        Floor.ready = Ear.ready = ready(pickle.loads(options.ready.read_bytes()))
    return scene_node.run(
        [KINDS[options.kind]], options.kind, sys.argv[:1] + sys.argv[len(own):])


if __name__ == '__main__':
    sys.exit(main())
