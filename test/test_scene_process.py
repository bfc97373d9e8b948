# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A scene's three nodes in one process: nobody can tell them from three processes."""

import math

from linkage_interfaces.srv import ServoInverse as ServoInverseType
from linkage_ros.nodes import scene_process
from linkage_ros.nodes.crank_driver import CrankDriver
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.nodes.servo_inverse import ServoInverse
import pytest
from sensor_msgs.msg import JointState

LEVER = {'mechanisms': ['lever'], 'lever.type': 'slotted_lever', 'lever.crank.speed': 2.0}


@pytest.fixture
def nodes(graph):
    """Start them as the process does."""
    return [graph.start(kind, LEVER) for kind in (Kinematics, ServoInverse, CrankDriver)]


def told(message):
    """Return what a message says, and when."""
    stamp = message.header.stamp
    return (stamp.sec, stamp.nanosec), dict(zip(message.name, message.position))


def lever_at(crank):
    """Return the angle of the lever: a crank of 80 stands 150 from its pivot."""
    return math.atan2(80.0 * math.sin(crank), 150.0 + 80.0 * math.cos(crank))


def is_true(message):
    """Tell whether the lever is where the crank in the same message puts it."""
    _, at = told(message)
    return at['lever_lever'] == pytest.approx(lever_at(at['lever_crank']), abs=1e-14)


def test_a_lever_moves_with_cranks_that_nobody_else_hears(graph, nodes):
    heard = graph.listen(JointState, 'lever/joint_states')
    graph.until(lambda: len(heard) > 20)
    assert all(map(is_true, heard))
    times = [told(message)[0] for message in heard]
    assert times == sorted(set(times))


def test_who_listens_to_the_cranks_hears_what_the_lever_was_moved_by(graph, nodes):
    moved, cranks = (graph.listen(JointState, topic)
                     for topic in ('lever/joint_states', 'crank_states'))
    graph.until(lambda: len(cranks) > 20 and told(moved[-1])[0] >= told(cranks[-1])[0])
    times = [told(message)[0] for message in moved]
    assert len(times) == len(set(times))
    said, then = dict(map(told, cranks)), dict(map(told, moved))
    both = said.keys() & then.keys()
    assert len(both) > 15
    assert all(then[time]['lever_crank'] == said[time]['lever_crank'] for time in both)


def test_the_service_answers_on_the_working_branch_wherever_the_crank_is(graph, nodes):
    *_, driver = nodes
    client = graph.node.create_client(ServoInverseType, 'servo_inverse')
    cranks = graph.listen(JointState, 'crank_states')
    for start in (0.4, 2.9):
        graph.set(driver, lever__crank__start=start, lever__crank__speed=0.0)
        graph.until(lambda start=start: cranks and cranks[-1].position[0] == start)
        found = graph.call(client, ServoInverseType.Request(lever_angle=[lever_at(0.4)]))
        assert found.success and found.servo_angle[0] == pytest.approx(0.4, abs=1e-9)


def test_a_bad_scene_ends_them_all_in_one_sentence(capfd):
    assert scene_process.main(['scene', '--ros-args', '-p', 'mechanisms:=[leg]']) == 1
    printed = capfd.readouterr().err
    assert printed.count('[FATAL]') == 1 and 'leg.type must be a text' in printed
