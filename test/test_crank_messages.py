# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What the kinematics node makes of crank messages, however they come and whatever they say."""

import math
import struct
from types import SimpleNamespace
import warnings

from linkage_ros.nodes import kinematics, log
from linkage_ros.nodes.kinematics import Kinematics
import numpy as np
import pytest
from rclpy.logging import LoggingSeverity
from rclpy.serialization import serialize_message
from ros_harness import hastened
from sensor_msgs.msg import JointState
from visualization_msgs.msg import MarkerArray

FIVE_BAR = {'mechanisms': ['five_bar']}


class Hand:
    """A kinematics node, what it publishes and says, and a publisher of crank messages."""

    def __init__(self, graph, mechanism='jansen', parameters=None):
        self._graph = graph
        self.said = graph.log()
        self.joints = graph.listen(JointState, f'{mechanism}/joint_states', 100)
        self.markers = graph.listen(MarkerArray, f'{mechanism}/markers', 100)
        self.node = graph.start(Kinematics, parameters or {'mechanisms': [mechanism]})
        self._publisher = graph.publisher(JointState, 'crank_states', 100)
        graph.until(lambda: self.node.count_subscribers(f'{mechanism}/joint_states')
                    and self.node.count_subscribers(f'{mechanism}/markers'))

    def send(self, names=(), positions=(), velocities=(), stamp=None, text=None):
        """Publish a crank message, or bytes instead of one."""
        message = JointState(name=list(names), position=positions, velocity=velocities)
        message.header.stamp.sec = 1 if stamp is None else stamp
        self._publisher.publish(text or message)

    def warnings(self, words):
        """Return the warnings with some words in them."""
        return [m.msg for m in self.said if m.level == LoggingSeverity.WARN and words in m.msg]

    def moved(self, names, positions, velocities=()):
        """Return the joint states after a message: the first that have its first position."""
        seen = len(self.joints)
        self.send(names, positions, velocities)
        return self._graph.until(lambda: [
            m for m in self.joints[seen:] if positions[0] in m.position])[0]


BAD = {
    'a header alone': b'\0\1\0\0',
    'padding that is not there': b'\0\1\0\3',
    'one byte': b'\0',
    'noise': np.random.default_rng(1).bytes(200),
    'cut off': serialize_message(JointState(name=['jansen_crank'], position=[1.0]))[:30],
    'an unknown encoding': b'\7\7' + serialize_message(JointState(name=['jansen_crank']))[2:],
    'names without end': b'\0\1\0\0' + bytes(8) + struct.pack('<IxxxxI', 1, 2 ** 32 - 1) * 4,
    'a name without end': (b'\0\1\0\0' + bytes(8)
                           + struct.pack('<IxxxxII', 1, 1, 2 ** 32 - 9) + bytes(40)),
}


@pytest.mark.nightly(all_but=3)
@pytest.mark.parametrize('text', BAD.values(), ids=BAD)
def test_bytes_that_are_no_joint_states_are_passed_over_with_one_warning(graph, text):
    hand = Hand(graph)
    for _ in range(5):
        hand.send(text=text)
    said = graph.until(lambda: hand.warnings('no JointState'))
    assert len(said[0]) < 400 and said[0].startswith(
        f'/crank_states: a message of {len(text)} bytes is ignored, since it is no JointState: ')
    assert hand.moved(['jansen_crank'], [0.5], [1.0]).velocity[0] == 1.0
    assert len(hand.warnings('no JointState')) == 1


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('speed', [1e200, 1e308, math.inf, math.nan, 5e-324])
def test_any_speed_is_handled_without_a_warning_of_numpy(graph, speed):
    hand = Hand(graph, 'm', {'mechanisms': ['m'], 'm.type': 'jansen', 'm.scale': 1e6,
                             'm.leg_pairs': 2})
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        for theta in (0.5, 0.6, 1e200):
            state = hand.moved(['m_crank'], [theta], [speed])
            assert np.isfinite(state.velocity).all() and np.isfinite(state.position).all()


def test_a_warning_is_repeated_when_its_time_is_over():
    said = []
    throttle = log.Throttle(SimpleNamespace(warning=said.append))
    for throttle.seconds, count in ((60.0, 1), (0.0, 4), (60.0, 4)):
        for _ in range(3):
            throttle.warn('a', lambda: 'a')
        assert len(said) == count


def test_what_was_logged_is_forgotten_when_it_is_too_much():
    said = []
    throttle = log.Throttle(SimpleNamespace(warning=said.append))
    for subject in (*range(log.MAX_SUBJECTS), 0, 'one more', 0):
        throttle.warn(subject, lambda subject=subject: subject)
    assert said == [*range(log.MAX_SUBJECTS), 'one more', 0]


def test_a_stream_of_new_names_is_said_within_bounds(graph):
    hand = Hand(graph)
    for i in range(60):
        hand.send([f'{i}' * 1000, '\n', f'w{i}'], [0.0] * 3)
        if i % 10 == 0:
            hand.moved(['jansen_crank'], [0.001 * i])
    hand.moved(['jansen_crank'], [0.7])
    said = hand.warnings('no input is called')
    assert len(said) <= 20 and 'no more will be named' in said[-1]
    assert all(len(text) < 500 and '\n' not in text for text in said)
    hand.send(['another'], [0.0])
    hand.moved(['jansen_crank'], [0.8])
    assert hand.warnings('no input is called') == said


@pytest.mark.parametrize('sent, missing', [
    ([], 'five_bar_crank, five_bar_crank2'), (['five_bar_crank'], 'five_bar_crank2'),
    (['five_bar_crank', 'five_bar_crank2'], '')])
def test_inputs_that_nobody_sends_are_said_once(graph, sent, missing):
    hand = Hand(graph, 'five_bar', FIVE_BAR)
    if sent:
        hand.send([*sent, 'nobody'], [0.1, 0.2, 0.3][:len(sent) + 1])
        graph.until(lambda: hand.warnings('called nobody'))
    timer = hastened(hand.node, kinematics.MISSING_AFTER_S)
    graph.until(timer.is_canceled)
    hand.moved(['five_bar_crank', 'five_bar_crank2'], [0.4, 0.5])
    graph.all_logged(hand.node, hand.said)
    assert timer.is_canceled() and hand.warnings('was received, without') == [
        f'/crank_states: no position of {missing} was received, without which '
        'five_bar cannot move'] * bool(missing)
