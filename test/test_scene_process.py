# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A scene's three nodes in one process: nobody can tell them from three processes."""


from linkage_interfaces.srv import ServoInverse as ServoInverseType
from linkage_ros.nodes import scene_process
from linkage_ros.nodes.crank_driver import CrankDriver
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.nodes.servo_inverse import ServoInverse
import pytest
from sensor_msgs.msg import JointState
from truth.working_modes import lever_of

LEVER = {'mechanisms': ['lever'], 'lever.type': 'slotted_lever', 'lever.crank.speed': 2.0}


@pytest.fixture
def nodes(graph):
    """Start them as the process does."""
    return [graph.start(kind, LEVER) for kind in (Kinematics, ServoInverse, CrankDriver)]


def test_the_service_answers_on_the_working_branch_wherever_the_crank_is(graph, nodes):
    *_, driver = nodes
    client = graph.node.create_client(ServoInverseType, 'servo_inverse')
    cranks = graph.listen(JointState, 'crank_states')
    for start in (0.4, 2.9):
        graph.set(driver, lever__crank__start=start, lever__crank__speed=0.0)
        graph.until(lambda start=start: cranks and cranks[-1].position[0] == start)
        found = graph.call(client, ServoInverseType.Request(lever_angle=[lever_of(0.4)]))
        assert found.success and found.servo_angle[0] == pytest.approx(0.4, abs=1e-9)


def test_a_bad_scene_ends_them_all_in_one_sentence(capfd):
    assert scene_process.main(['scene', '--ros-args', '-p', 'mechanisms:=[leg]']) == 1
    printed = capfd.readouterr().err
    assert printed.count('[FATAL]') == 1 and 'leg.type must be a text' in printed
