# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What the kinematics node does and what it leaves undone, counted."""

from collections import Counter
import dis

from linkage_ros import mechanisms
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.nodes.publishers import LATCHED
from linkage_ros.scene.legs import LegGroup
import pytest
from sensor_msgs.msg import JointState
from visualization_msgs.msg import Marker, MarkerArray

CRANKS = ['water_drop_crank', 'jansen_crank', 'peaucellier_crank', 'slotted_lever_crank']
WALKER = {'mechanisms': ['walker'], 'walker.type': 'jansen', 'walker.leg_pairs': 3}


@pytest.fixture
def work(monkeypatch):
    """Count solutions by mechanism and by how many points, joints and rates were wanted."""
    done = Counter()
    make = LegGroup.solution

    def counted(assembly, *names):
        solution = make(assembly, *names)
        solve = solution.solve

        def run(*inputs):
            done[(assembly.linkage.type, *(len(part or ()) for part in names[:3]))] += 1
            return solve(*inputs)

        solution.solve = run
        return solution

    monkeypatch.setattr(LegGroup, 'solution', counted)
    return done


def test_for_markers_alone_no_joint_angle_is_computed_and_the_reverse(graph, work):
    graph.start(Kinematics)
    turn = graph.crank(CRANKS)
    turn([0.1, 0.2, 0.3, 0.4], graph.listen(MarkerArray, 'jansen/markers'), [1.0] * 4)
    turn([0.1, 0.2, 0.3, 0.4], graph.listen(JointState, 'peaucellier/joint_states'), [1.0] * 4)
    turn([0.1, 0.2, 0.3, 0.4], graph.listen(JointState, 'water_drop/joint_states'))
    assert {key for key in work if key[0] == 'jansen'} == {('jansen', 12, 0, 0)}
    assert {key for key in work if key[0] == 'peaucellier'} == {
        ('peaucellier', 0, 6, 6), ('peaucellier', 0, 6, 0)}
    # A message of the turn before, with velocities, may have come late.
    assert {key[:3] for key in work if key[0] == 'water_drop'} == {('water_drop', 0, 2)}
    assert ('water_drop', 0, 2, 0) in work


def test_the_nodes_own_ears_on_joint_states_are_nobody_who_listens(graph, work):
    graph.start(Kinematics, cli_args=['--ros-args', '-r', 'crank_states:=joint_states'])
    turn = graph.crank(CRANKS, 'joint_states')
    turn([0.1] * 4, graph.listen(MarkerArray, 'jansen/markers'))
    assert {key[0] for key in work} == {'jansen'}
    states = graph.listen(JointState, 'joint_states')
    graph.until(lambda: turn([0.2] * 4, states) and len({key[0] for key in work}) == 4)


def test_only_what_the_wanted_points_stand_on_is_computed():
    leg = mechanisms.create('jansen')
    operations = {point: len(_operations(leg, point)) for point in leg.points}
    assert operations['O'] == operations['B'] == 0
    assert operations['A'] < operations['C'] < operations['D'] < operations['F']
    assert operations['E'] < operations['F'] < operations['G']
    assert operations['G'] < len(_operations(leg, *leg.points))


def _operations(linkage, *points):
    """Return the sums and products behind some points at a crank angle."""
    return [operation for operation in dis.get_instructions(linkage.function(points))
            if operation.opname.startswith('BINARY')]


def test_the_locus_is_sent_once_and_a_late_subscriber_gets_it(graph):
    node = graph.start(Kinematics)
    early, other = (graph.listen(Marker, f'{name}/locus', LATCHED)
                    for name in ('jansen', 'slotted_lever'))
    turn, messages = graph.crank(CRANKS), graph.listen(MarkerArray, 'jansen/markers')
    for theta in (0.1, 0.2, 0.3):
        turn([theta] * 4, messages)
    late = graph.listen(Marker, 'jansen/locus', LATCHED)
    graph.until(lambda: late and other)
    assert graph.set(node, slotted_lever__dimensions__a=81.0).successful
    graph.until(lambda: len(other) == 2)
    assert len(early) == len(late) == 1


def test_all_legs_of_a_walker_are_solved_in_one_call(graph, work):
    graph.start(Kinematics, WALKER)
    turn = graph.crank(['walker_crank'])
    markers = graph.listen(MarkerArray, 'walker/markers')
    assert len(turn([0.1], markers).markers[1].points) == 6 * 8
    # What was repeated until the first answer is done with at the second.
    turn([0.2], markers)
    work.clear()
    turn([0.3], markers)
    # Even if a message came twice: one by one there would be six.
    assert 0 < sum(work.values()) < 6
