# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A node goes on after any exception, and ends at a signal, whatever it is doing."""

from collections import Counter
import os
from pathlib import Path
import resource
import signal

from linkage_interfaces.srv import InputsFor, ServoInverse as Service
from linkage_ros.nodes import shutdown
from linkage_ros.nodes.crank_driver import CrankDriver
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.nodes.servo_inverse import ServoInverse
import pytest
from rclpy.logging import LoggingSeverity
from rclpy.publisher import Publisher
from ros_harness import Graph, Process
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from visualization_msgs.msg import MarkerArray

CONFIG = Path(__file__).parents[1] / 'config'
LEVER = {'mechanisms': ['lever'], 'lever.type': 'slotted_lever'}


@pytest.fixture
def slips(monkeypatch):
    """Return how often publishing on a topic is still to raise, by the topic."""
    left, publish = Counter(), Publisher.publish

    def slipping(self, message):
        topic = self.topic_name.lstrip('/')
        if left[topic]:
            left[topic] -= 1
            raise ZeroDivisionError(f'slip on {topic}')
        publish(self, message)

    monkeypatch.setattr(Publisher, 'publish', slipping)
    return left


@pytest.fixture
def log(graph):
    """Return what was logged."""
    return graph.log()


def errors(log):
    """Return the errors that were logged."""
    return [m.msg for m in log if m.level >= LoggingSeverity.ERROR]


def logged_once(graph, node, log, *words):
    """See that a node has logged one error, with some words."""
    one, = errors(graph.all_logged(node, log))
    assert all(word in one for word in ('slip', *words)), one


@pytest.mark.parametrize('topic', ['m/joint_states', 'm/markers', 'joint_states'])
def test_after_a_slip_the_next_crank_message_is_answered(graph, slips, log, topic):
    node = graph.start(Kinematics, {'mechanisms': ['m'], 'm.type': 'jansen'})
    turn = graph.crank(['m_crank'])
    answers = graph.listen(MarkerArray if topic == 'm/markers' else JointState, topic, 100)
    last = graph.listen(JointState, 'joint_states', 100)
    for each in (answers, last):
        turn([0.1], each)
    slips[topic] = 1
    stamp = turn.send([0.2])
    # Other topics have the message.
    graph.until(lambda: not slips[topic] and (
        topic == 'joint_states' or last[-1].header.stamp.sec == stamp))
    turn([0.3], answers)
    logged_once(graph, node, log, 'crank_states')


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('topic', ['m/locus', 'm/robot_description', 'robot_description',
                                   'scene_parameters'])
def test_after_a_slip_of_the_worker_messages_are_answered(graph, slips, log, topic):
    graph.until(lambda: graph.node.count_publishers('/rosout'))
    slips[topic] = 1
    node = graph.start(Kinematics, {'mechanisms': ['m'], 'm.type': 'jansen'})
    graph.until(lambda: not slips[topic])
    graph.crank(['m_crank'])([0.3], graph.listen(JointState, 'm/joint_states'))
    assert graph.set(node, m__dimensions__m=16.0).successful
    logged_once(graph, node, log)


def test_after_a_slip_the_timer_goes_on(graph, slips, log):
    messages = graph.listen(JointState, 'crank_states', 100)
    node = graph.start(CrankDriver, LEVER)
    graph.until(lambda: messages)
    slips['crank_states'] = 1
    graph.until(lambda: not slips['crank_states'])
    messages.clear()
    graph.until(lambda: len(messages) > 3)
    logged_once(graph, node, log)


def slip(*_, **__):
    raise ZeroDivisionError('slip')


def slipping(kind):
    """Return a kind of node that, while it `slips`, raises when it checks a scene."""
    class Slipping(kind):
        slips = False

        def check(self, new):
            return slip() if self.slips else super().check(new)

    return Slipping


def test_a_slip_in_one_mechanism_leaves_the_others_alone(graph, log):
    class Slipping(Kinematics):
        def prepare(self, new):
            models = super().prepare(new)
            models['a'].solve = slip
            return models

    node = graph.start(Slipping, {
        'mechanisms': ['a', 'b'], 'a.type': 'jansen', 'b.type': 'four_bar'})
    turn = graph.crank(['a_crank', 'b_crank'])
    own, other, all_ = (graph.listen(JointState, topic) for topic in (
        'a/joint_states', 'b/joint_states', 'joint_states'))
    for answers in (other, all_):
        assert set(turn([0.1, 0.2], answers).name) == {'b_crank', 'b_AB', 'b_QB'}
    assert not own
    logged_once(graph, node, log, 'crank_states')


def test_after_a_slip_parameters_can_be_set(graph, log):
    node, name = graph.start(slipping(Kinematics), LEVER), 'lever.dimensions.a'
    node.slips = True
    result = graph.set(node, meanwhile=lambda: setattr(node, 'slips', False), **{name: 81.0})
    assert not result.successful and 'slip' in result.reason
    assert graph.set(node, **{name: 82.0}).successful
    assert node.get_parameter(name).value == 82.0
    logged_once(graph, node, log)


def test_after_a_slip_the_owner_is_followed_and_nothing_is_lost(graph, log):
    node = graph.start(slipping(CrankDriver), LEVER)
    announce = graph.announcer()
    node.slips = True
    announce({**LEVER, 'lever.dimensions.a': 81.0})
    graph.until(lambda: errors(log))
    node.slips = False
    announce({'lever.scale': 2.0})
    lever = graph.until(lambda: node.scene.mechanisms['lever'].scale == 2.0
                        and node.scene.mechanisms['lever'])
    assert lever.linkage.dimensions['a'] == 81.0
    logged_once(graph, node, log)


@pytest.mark.parametrize('service, kind, request_', [
    ('servo_inverse', Service, Service.Request(lever_angle=[0.1])),
    ('inputs_for', InputsFor, InputsFor.Request(outputs=['P.x', 'P.y'], values=[0.5, 0.9]))],
    ids=['servo_inverse', 'inputs_for'])
def test_after_a_slip_a_service_answers(graph, log, service, kind, request_):
    class Slipping(ServoInverse):
        slips = False
        scene = property(lambda self: slip() if self.slips else super(Slipping, self).scene)

    node = graph.start(Slipping, {
        'mechanisms': ['lever', 'five'], 'five.type': 'five_bar', 'lever.type': 'slotted_lever'})
    client = graph.node.create_client(kind, service)
    node.slips = True
    answer = graph.call(client, request_)
    node.slips = False
    assert not answer.success and 'slip' in answer.message
    assert 'slip' not in graph.call(client, request_).message
    logged_once(graph, node, log)


@pytest.mark.parametrize('topic, kind, answer, message', [
    ('wanted_states', JointState, 'servo_commands',
     JointState(name=['lever_lever'], position=[0.1])),
    ('wanted_trajectory', JointTrajectory, 'servo_trajectory', JointTrajectory(
        joint_names=['lever_lever'], points=[JointTrajectoryPoint(positions=[0.1])]))],
    ids=['wanted_states', 'wanted_trajectory'])
def test_after_a_slip_the_next_command_is_given(graph, slips, log, topic, kind, answer, message):
    node = graph.start(ServoInverse, LEVER)
    publisher, answers = graph.publisher(kind, topic), graph.listen(kind, answer)
    graph.until(lambda: node.count_subscribers(answer))
    slips[answer] = 1
    publisher.publish(message)
    graph.until(lambda: not slips[answer])
    publisher.publish(message)
    graph.until(lambda: answers)
    logged_once(graph, node, log, topic)


# --- signals ---------------------------------------------------------------------------------

def cpu(process):
    """Return the time that a process has computed [s]."""
    fields = Path(f'/proc/{process.id}/stat').read_text().rpartition(')')[2].split()
    return sum(map(int, fields[11:13])) / os.sysconf('SC_CLK_TCK')


def ends_quietly(process, number):
    """
    Let a process end by a signal.

    It may go on with what it was busy with for the promised time; beyond that it computes less
    than before the signal, when it did little more than its imports. Left alone, it would compute
    for seconds.
    """
    def of_ended():
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime

    others, before = of_ended(), cpu(process)
    process.interrupt(number)
    code, printed = process.end()
    assert code == 0 and 'Traceback' not in printed and 'rror' not in printed, printed
    assert of_ended() - others - before < before + shutdown.TIMEOUT_S


@pytest.mark.nightly
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize('name, publishers', [
    ('crank_driver', 0), ('servo_inverse', 0), ('kinematics', 0), ('kinematics', 100),
    ('scene', 0), ('scene', 100)])
def test_a_signal_ends_the_start_of_a_thousand_mechanisms(tmp_path, name, publishers, number):
    path = tmp_path / 'many.yaml'
    names = [f'm{i}' for i in range(1000)]
    path.write_text(f'/**:\n  ros__parameters:\n    mechanisms: [{", ".join(names)}]\n' + ''.join(
        f'    {each}.type: {"slotted_lever" if i % 2 else "jansen"}\n'
        for i, each in enumerate(names)))
    node = 'kinematics' if name == 'scene' else name

    def begun():
        return process.has_ended or node in graph.node.get_node_names() and publishers <= len(
            graph.node.get_publisher_names_and_types_by_node(node, '/'))

    with Process(name, path) as process, Graph(process.domain) as graph:
        graph.until(begun)
        assert not process.has_ended
        ends_quietly(process, number)


