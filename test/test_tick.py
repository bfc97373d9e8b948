# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What machine code makes of crank messages is what plain Python makes of them, in all bits."""

from collections import Counter
import math
import sys

import numpy as np
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('llvmlite')

from linkage_ros.nodes import tick  # noqa: E402
from linkage_ros.nodes.kinematics import Kinematics  # noqa: E402
from rclpy.time import Time  # noqa: E402
from ros_harness import Graph  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from visualization_msgs.msg import MarkerArray  # noqa: E402

CRANKED = {'m.type': 'custom', 'm.joints': [
    'O ground 0 0', 'Q ground 2 0', 'A crank O 1', 'B dyad A Q 2 1.5 left']}
SCENES = {
    'the catalogue': {},
    'a walker': {'mechanisms': ['m'], 'm.type': 'jansen', 'm.leg_pairs': 3, 'm.scale': 0.01},
    'a mirrored leg of another size': {
        'mechanisms': ['m'], 'm.type': 'klann', 'm.mirrored': True, 'm.scale': 1e-3},
    'out of reach now and then': {'mechanisms': ['m', 'jansen'], 'jansen.type': 'jansen',
                                  **CRANKED},
    'legs that are left out now and then': {'mechanisms': ['m'], 'm.leg_pairs': 2, **CRANKED},
    "the robot's names, signs and zeros": {
        'mechanisms': ['m'], 'm.type': 'jansen',
        'm.joint_names': ['BC=left_shin', 'EF=-left_ankle+0.35', 'crank=-motor-7.5']},
    'geared motors': {'mechanisms': ['m', 'klann'], 'm.type': 'jansen', 'klann.type': 'klann',
                      'm.crank.ratio': -2.5, 'm.crank.offset': 0.125, 'klann.crank.ratio': 0.3},
    'several inputs': {'mechanisms': ['m', 'five_bar'], 'm.type': 'five_bar', 'm.scale': 2.0,
                       'five_bar.type': 'five_bar'},
    'a cylinder': {'mechanisms': ['m'], 'm.type': 'custom', 'm.scale': 2.0, 'm.joints': [
        'O ground 0 0', 'Q ground 3 0', 'A cylinder O Q 1.5 left']},
    'dimensions that are tiny, and huge': {
        'mechanisms': ['m', 'n'], 'm.type': 'jansen', 'm.scale': 1e-30, 'n.type': 'jansen',
        'n.scale': 1e27},
}

QUICK = ["the robot's names, signs and zeros", 'several inputs']
# Stamps [s] of what counts are beyond this.
BEGUN = 1000


@pytest.fixture
def runs(monkeypatch):
    """Count what ticks answered."""
    counted, run = Counter(), tick.Tick.run

    def counting(self, text):
        done = run(self, text)
        counted[done] += 1
        return done

    monkeypatch.setattr(tick.Tick, 'run', counting)
    return counted


def taken(runs):
    """Return what has been counted, and begin anew."""
    counted = Counter(runs)
    runs.clear()
    return counted


class Shown:
    """A node, and what it publishes on each topic."""

    def __init__(self, graph, parameters):
        self._graph, self._stamp = graph, 0
        self.node = graph.start(Kinematics, parameters)
        self.heard = {topic: self._listen(topic, type_) for topic, type_ in self._topics()}
        self._publisher = graph.node.create_publisher(JointState, 'crank_states', 1000)
        graph.until(lambda: self._publisher.get_subscription_count()
                    and all(self.node.count_subscribers(topic) for topic in self.heard))

    def _topics(self):
        yield 'joint_states', JointState
        for name in self.node.scene.machines:
            yield f'{name}/joint_states', JointState
            yield f'{name}/markers', MarkerArray

    def _listen(self, topic, type_):
        heard = []
        self._graph.node.create_subscription(type_, topic, heard.append, 1000)
        return heard

    def send(self, drives, positions, velocities=()):
        """Publish a message."""
        self._stamp += 1
        message = JointState(name=[drive.source for drive in drives], position=positions,
                             velocity=velocities)
        message.header.stamp.sec = self._stamp
        self._publisher.publish(message)

    def until_heard(self):
        """Wait until the joints of the scene, which come last, have been told of."""
        self._graph.until(lambda: any(
            message.header.stamp.sec == self._stamp for message in self.heard['joint_states']))

    def prepare(self, messages, ready):
        """Send messages that everything is shown of until something holds; forget them."""
        def prepared():
            for message in messages:
                self.send(*message)
                self.until_heard()
            return ready()

        self._forget()
        self._stamp = 0
        self._graph.until(prepared)
        self._stamp = BEGUN

    def _forget(self):
        for heard in self.heard.values():
            heard.clear()

    def answers(self, messages):
        """Return what is said on each topic of messages, the last of which is shown."""
        self._forget()
        for message in messages:
            self.send(*message)
        self.until_heard()
        return {topic: [words for words in map(said, heard) if words[0] > BEGUN]
                for topic, heard in self.heard.items()}


def said(message):
    """Return what a message says, numbers in all their bits."""
    if isinstance(message, JointState):
        return (message.header.stamp.sec, message.header.stamp.nanosec, message.name, *(
            [x.hex() for x in numbers]
            for numbers in (message.position, message.velocity, message.effort)))
    return (max(marker.header.stamp.sec for marker in message.markers), [
        (marker.id, marker.action, [(p.x.hex(), p.y.hex(), p.z) for p in marker.points])
        for marker in message.markers])


def value(random, drive):
    """Return a value for an input's source: usual ones, and now and then another."""
    kind = random.integers(12)
    if kind == 0:
        return float(random.choice([math.nan, math.inf, -math.inf, 1e300, -0.0, 5e-324]))
    if kind == 1:
        return float(random.normal() * 10.0 ** random.integers(-300, 6))
    low, high = drive.reach[0]
    wide = 0.2 * (high - low)
    return (random.uniform(low - wide, high + wide) - drive.offset) / drive.ratio


def middle(drive):
    """Return where a source is at the start of its input or, of a length, in its middle."""
    low, high = drive.reach[0]
    value = drive.start if drive.input.turns else 0.5 * (low + high)
    return (value - drive.offset) / drive.ratio


def usual(drives, moving):
    """Return a message's contents that every mechanism can be shown at."""
    return drives, [middle(drive) for drive in drives], [1.0] * len(drives) * moving


def hard(random, drives, moving):
    """Return contents that are anything."""
    return (drives, [value(random, drive) for drive in drives],
            random.choice([0.0, -0.0, 3.5, math.inf], len(drives) * moving).tolist())


@pytest.mark.parametrize('name', [
    *QUICK, *(pytest.param(name, marks=pytest.mark.long) for name in SCENES if name not in QUICK)])
def test_machine_code_publishes_what_plain_python_does(monkeypatch, runs, name):
    with monkeypatch.context() as context:
        context.setitem(sys.modules, 'llvmlite', None)
        by_python = answers(SCENES[name], runs, is_quick=False)
    assert not runs[True]
    by_code = answers(SCENES[name], runs, is_quick=True)
    assert by_code.keys() == by_python.keys()
    for topic, expected in by_python.items():
        assert len(by_code[topic]) == len(expected) > 4
        for own, other in zip(by_code[topic], expected):
            assert own == other


def answers(parameters, runs, is_quick):
    """Return what a node says on each topic of anything that its inputs' sources say."""
    found = {}
    with Graph() as graph:
        shown = Shown(graph, parameters)
        drives = [drive for machine in shown.node.scene.machines.values()
                  for drive in machine.inputs.values()]
        # Where there are several inputs, each has a source of its own.
        together = len(drives) == len(shown.node.scene.machines)
        parts = [drives] if together else [[drive] for drive in drives]
        random = np.random.default_rng(7)
        for moving in (True, False):
            shown.prepare([usual(drives, moving)], lambda: True)
            shown.prepare([usual(part, moving) for part in parts],
                          lambda: taken(runs)[True] == is_quick * len(parts))
            taken(runs)
            heard = shown.answers([
                *(hard(random, parts[i % len(parts)], moving) for i in range(24)),
                usual(drives, moving)])
            assert (runs[True] > 0) == is_quick
            for topic, words in heard.items():
                found.setdefault(topic, []).extend(words)
    return found


def test_a_change_and_a_new_listener_count_from_the_next_message_on(graph, runs):
    shown = Shown(graph, {'mechanisms': ['m'], 'm.type': 'jansen'})
    drive = shown.node.scene.machines['m'].first
    message = [drive], [0.5], [2.0]

    def last():
        shown.prepare([message], lambda: taken(runs)[True] == 1)
        shown.send(*message)
        graph.until(lambda: runs[True])
        return graph.until(lambda: [m for m in shown.heard['m/joint_states']
                                    if m.header.stamp.sec > BEGUN])[0]

    def angles():
        linkage = shown.node.scene.machines['m'].linkage
        return list(linkage.joint_angles(0.5).values())

    before = angles()
    state = last()
    assert list(state.position) == pytest.approx(before, abs=1e-15)
    shown.heard['m/joint_states'].clear()
    assert graph.set(shown.node, m__dimensions__b=40.0).successful
    changed = graph.until(lambda: shown.heard['m/joint_states'])[0]
    assert changed.header.stamp == state.header.stamp
    assert list(changed.position) == pytest.approx(angles(), abs=1e-15)
    assert list(last().position) == pytest.approx(angles(), abs=1e-15) != before
    late = graph.listen(MarkerArray, 'm/markers')
    last()
    graph.until(lambda: late and late[-1].markers[0].header.stamp.sec > BEGUN)


def test_messages_without_a_stamp_are_answered_with_the_time(graph, runs):
    shown = Shown(graph, {'mechanisms': ['m'], 'm.type': 'jansen'})
    drives = [shown.node.scene.machines['m'].first]
    shown.prepare([usual(drives, True)], lambda: taken(runs)[True] == 1)
    heard, publisher = shown.heard['m/joint_states'], graph.node.create_publisher(
        JointState, 'crank_states', 10)
    graph.until(publisher.get_subscription_count)
    before = graph.node.get_clock().now()
    publisher.publish(JointState(name=[drives[0].source], position=[0.25], velocity=[1.0]))
    answer = graph.until(lambda: [m for m in heard if m.position[0] == 0.25])[0]
    assert before <= Time.from_msg(answer.header.stamp) <= graph.node.get_clock().now()
    assert runs[True] == 1
