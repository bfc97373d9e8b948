# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Defects of the nodes that were found from outside, each as what it has to be instead."""

import math

import numpy as np
import pytest

pytest.importorskip('rclpy')

from linkage_ros.nodes.kinematics import Kinematics  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from visualization_msgs.msg import Marker, MarkerArray  # noqa: E402

TWO = {'mechanisms': ['a', 'b'], 'a.type': 'four_bar', 'b.type': 'jansen'}
LOADED = {'mechanisms': ['a', 'b'], 'a.type': 'slotted_lever', 'a.loads': ['L=0 -9.81'],
          'b.type': 'jansen'}


class Scene:
    """A node, and what is published on each topic that somebody subscribes to."""

    def __init__(self, graph, parameters, topics):
        self._graph, self._stamp = graph, 0
        self.node = graph.start(Kinematics, parameters)
        self.received = {topic: graph.listen(MarkerArray if topic.endswith('markers') else
                                             JointState, topic, 1000) for topic in topics}
        self._publisher = graph.node.create_publisher(JointState, 'crank_states', 1000)
        graph.until(lambda: self._publisher.get_subscription_count() and all(
            self.node.count_subscribers(topic) for topic in topics))

    def send(self, **message):
        """Publish a message with a stamp of its own."""
        self._stamp += 1
        message = JointState(**message)
        message.header.stamp.sec = self._stamp
        self._publisher.publish(message)

    def settle(self, topic, **message):
        """Publish a message and wait until it is answered on a topic."""
        self.send(**message)
        self.until_answered(topic)

    def until_answered(self, topic):
        """Wait for what the last message set off."""
        self._graph.until(lambda: self.received[topic] and (
            self.received[topic][-1].header.stamp.sec == self._stamp))


def test_loads_beside_another_mechanism_come_with_every_message(graph):
    scene = Scene(graph, LOADED, ['joint_states'])
    for message in ({'name': ['a_crank'], 'position': [0.3]},
                    {'name': ['b_crank'], 'position': [0.4]}):
        scene.settle('joint_states', **message)
    scene.received['joint_states'].clear()
    for k in range(60):
        scene.send(name=['ab'[k % 2] + '_crank'], position=[0.01 * k])
    scene.until_answered('joint_states')
    received = scene.received['joint_states']
    assert len(received) == 60
    assert all(len(state.effort) == len(state.name) for state in received)


@pytest.mark.sample(3)
@pytest.mark.parametrize('wrong', [math.nan, math.inf, 1e308])
def test_a_speed_that_is_no_number_is_in_no_message(graph, wrong):
    scene = Scene(graph, TWO, ['joint_states'])
    for _ in range(3):
        for name in ('a_crank', 'b_crank'):
            scene.settle('joint_states', name=[name], position=[0.3], velocity=[1.0])
    scene.received['joint_states'].clear()
    for k in range(60):
        name = 'ab'[k % 2] + '_crank'
        scene.send(name=[name], position=[0.01 * k],
                   velocity=[wrong if name == 'a_crank' and k % 4 == 0 else 1.0])
    scene.until_answered('joint_states')
    assert len(scene.received['joint_states']) == 60
    for state in scene.received['joint_states']:
        assert np.isfinite([*state.position, *state.velocity]).all()


def displayed(messages):
    """Return the markers that a viewer displays after some messages."""
    ids = set()
    for marker in (marker for message in messages for marker in message.markers):
        (ids.discard if marker.action == Marker.DELETE else ids.add)(marker.id)
    return ids


@pytest.mark.slow
@pytest.mark.parametrize('times', [6, pytest.param(30, marks=pytest.mark.long)])
def test_markers_are_gone_wherever_noise_about_the_end_of_the_reach_was(graph, times):
    scene = Scene(graph, {'mechanisms': ['m', 'b'], 'm.type': 'peaucellier', 'b.type': 'jansen'},
                  ['m/markers', 'm/joint_states', 'b/joint_states'])
    end = scene.node.scene.machines['m'].reach[0][1]
    random = np.random.default_rng(3)
    for _ in range(times):
        scene.settle('m/joint_states', name=['m_crank'], position=[end - 0.1])
        graph.until(lambda: displayed(scene.received['m/markers']))
        for angle in (*(end + random.normal(0.0, 2e-3, 20)).tolist(), *5 * [end + 0.3]):
            scene.send(name=['m_crank'], position=[angle])
        # The messages are processed in order.
        scene.settle('b/joint_states', name=['b_crank'], position=[0.5])
        graph.until(lambda: not displayed(scene.received['m/markers']))
