# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Wanted outputs come in as a stream or a trajectory; what their actuators have to do goes out."""

import itertools
import math
import re

from builtin_interfaces.msg import Duration
from linkage_ros import mechanisms
from linkage_ros.nodes import log
from linkage_ros.nodes.servo_inverse import ServoInverse
import numpy as np
import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from truth.cases import CASES
from truth.working_modes import excavator, five_bar, lever_of

# A hobby servo with a gear of 2 turns a crank of 80, 150 from the pivot of a lever.
LEVER = {'mechanisms': ['lever', 'bar'], 'lever.type': 'slotted_lever',
         'lever.crank.source': 'servo', 'lever.crank.ratio': 0.5, 'lever.crank.offset': 0.25,
         'lever.crank.sweep': [-1.5, 1.5], 'lever.joint_names': ['lever=-flap+0.1'],
         'bar.type': 'four_bar', 'bar.crank.start': 0.5}
# A leg of two geared motors, and an excavator's arm told by the strokes of its pistons.
DIGGER, LEG = CASES['excavator'], mechanisms.create('five_bar').dimensions
SEVERAL = {
    'mechanisms': ['leg', 'digger'], 'leg.type': 'five_bar', 'leg.crank.start': 1.9,
    'leg.crank2.start': 1.24, 'leg.crank2.source': 'motor', 'leg.crank2.ratio': -0.5,
    'leg.crank2.offset': 0.2, 'leg.crank2.sweep': [-1.0, 2.0],
    'digger.type': 'custom', 'digger.joints': DIGGER.joints, 'digger.cylinder.start': 108.0,
    'digger.cylinder.offset': 80.0, 'digger.cylinder2.start': 132.0,
    'digger.cylinder3.start': 119.0,
    **{f'digger.dimensions.{name}': value for name, value in DIGGER.dimensions.items()}}
FOOT = ['leg_P.x', 'leg_P.y']
BUCKET = [f'digger_{output}' for output in ('H.x', 'H.y', 'angle(H,J)')]


class Stream:
    """What is wanted goes to a node, and its commands are gathered."""

    def __init__(self, graph, parameters):
        self.node = graph.start(ServoInverse, parameters)
        self._wanted = graph.crank([], 'wanted_states')
        self.commands = graph.listen(JointState, 'servo_commands')

    def want(self, names, positions, velocities=()):
        """Return the command that a message brings; each is sent until it has been answered."""
        self._wanted.names = names
        command = self._wanted(positions, self.commands, velocities)
        return {name: (position, *rest) for name, position, *rest in zip(
            command.name, command.position, *([command.velocity] if command.velocity else []))}


@pytest.fixture
def stream(graph, request):
    """Start the node with a lever and a four-bar, or with what a test asks for."""
    return Stream(graph, getattr(request, 'param', LEVER))


def flap(servo):
    """Return where the flap is, from the textbook: the pin of the crank turns the slot."""
    return 0.1 - lever_of(0.5 * servo + 0.25)


def slope(function, at):
    """Return a derivative."""
    return (function(at + 1e-5) - function(at - 1e-5)) / 2e-5


def test_outputs_of_several_mechanisms_in_one_message(stream):
    four_bar = mechanisms.create('four_bar')
    for crank, servo in ((0.6, -3.0), (1.1, -1.0), (1.6, 2.4), (1.3, 0.7)):
        for name in ('bar_B.x', 'bar_QB'):
            def output(crank, name=name[4:]):
                return float(four_bar.joint_angles(crank, [name])[name])

            # Of a name that comes twice the last counts, as in crank_states.
            assert stream.want(['old_lever_A.x', 'flap', name, 'flap'], [
                    9.0, 0.1, output(crank), flap(servo)], [9.0, 9.0, 0.2, 0.3]) == {
                'bar_crank': (pytest.approx(crank, abs=1e-12),
                              pytest.approx(0.2 / slope(output, crank), rel=1e-7)),
                'servo': (pytest.approx(servo, abs=1e-13),
                          pytest.approx(0.3 / slope(flap, servo), rel=1e-8))}


def test_the_first_command_is_next_to_where_the_crank_is(stream, graph):
    cranks = graph.publisher(JointState, 'crank_states')
    # As before a controller knows a position.
    for position in (-2.0, -2.0, math.nan):
        cranks.publish(JointState(name=['bar_crank'], position=[position]))
    for servo in (0.0, 0.1, 0.2):
        stream.want(['flap'], [flap(servo)])
    four_bar = mechanisms.create('four_bar')
    rocker = float(four_bar.joint_angles(-1.9)['QB'])
    # Velocities without names are none.
    assert stream.want(['bar_QB'], [rocker], [0.1, 0.2]) == {
        'bar_crank': (pytest.approx(-1.9, abs=1e-9),)}


def test_what_cannot_be_had_is_held_and_said(stream, capfd):
    good = stream.want(['flap'], [flap(1.0)], [0.1])['servo']
    reasons = ((-2.0, 'lever reaches'), (math.nan, 'a value must be finite'),
               (flap(2.6), r'outside crank.sweep \[-1.5, 1.5\]'), (math.inf, ''), (-1e300, ''))
    for value, _ in reasons:
        assert stream.want(['flap'], [value], [0.1])['servo'] == (good[0], 0.0)
    assert 'flap cannot be -2 (lever at 2.1): lever reaches' in capfd.readouterr().err
    assert stream.want(['flap'], [flap(0.9)])['servo'] == (pytest.approx(0.9, abs=1e-13),)


def test_before_the_first_good_command_there_is_none(stream, graph):
    publisher = graph.publisher(JointState, 'wanted_states')
    for _ in range(5):
        publisher.publish(JointState(name=['flap', 'bar_QB'], position=[5.0, 9.0]))
    assert 'bar_crank' in stream.want(['flap', 'bar_QB'], [5.0, 1.2])
    assert {name for command in stream.commands for name in command.name} == {'bar_crank'}


def test_two_outputs_of_one_input_or_motor_and_a_name_of_nobody_are_said(graph, capfd):
    stream = Stream(graph, {**LEVER, 'bar.crank.source': 'servo'})
    assert stream.want(['flap', 'lever_A.x', 'bar_QB', 'boom'], [flap(0.7), 100.0, 1.2, 1.0]) == {
        'servo': (pytest.approx(0.7, abs=1e-13),)}
    log = capfd.readouterr().err
    for other in ('lever_A.x', 'bar_QB'):
        assert f'flap and {other} are moved by one actuator, servo: name one of them' in log
    assert 'no output is called boom' in log


@pytest.mark.parametrize('parameters, output, named, sign', [
    # The robot's name of a joint may be that of the linkage.
    ({'type': 'slotted_lever', 'joint_names': ['lever=lever']}, 'lever', 'lever', 1.0),
    ({'type': 'jansen', 'leg_pairs': 3}, 'BC', 'm_left0_BC', 1.0),
    ({'type': 'jansen', 'leg_pairs': 3, 'joint_names': ['left0_BC=-shin']}, 'BC', 'shin', -1.0)])
def test_an_output_is_called_as_it_is_published(graph, parameters, output, named, sign):
    stream = Stream(graph, {'mechanisms': ['m'], 'm.crank.start': 0.7,
                            **{f'm.{key}': value for key, value in parameters.items()}})
    angle = float(mechanisms.create(parameters['type']).joint_angles(0.7)[output])
    assert stream.want([named], [sign * angle]) == {'m_crank': (pytest.approx(0.7),)}


def test_names_that_somebody_makes_up_do_not_fill_the_log(stream, capfd):
    for number in range(log.MAX_NAMES + 5):
        stream.want(['flap', f'wing{number}'], [flap(0.2), 1.0])
    lines = capfd.readouterr().err.splitlines()
    warnings = [line for line in lines if 'no output is called' in line]
    assert 'called wing0;' in warnings[0] and len(warnings) == log.MAX_NAMES
    assert 'no more will be named' in warnings[-1]


def test_a_change_of_the_geometry_is_minded(stream, graph):
    for a in (80.0, 90.0):
        graph.change(stream.node, LEVER, lever__dimensions__a=a)
        servo, = stream.want(['lever_A.y'], [40.0])['servo']
        assert a * math.cos(0.5 * servo + 0.25) == pytest.approx(40.0, abs=1e-12)


def test_a_command_says_what_its_actuator_has_to_hold(graph):
    stream = Stream(graph, {**LEVER, 'lever.loads': ['lever=-3.0']})
    stream.want(['flap'], [flap(0.7)])
    command = stream.commands[-1]
    # Power in is power out: the moment of the lever, at the rate at which the servo turns it.
    assert command.effort.tolist() == pytest.approx([-3.0 * slope(flap, 0.7)], rel=1e-7)
    stream.want(['flap', 'bar_QB'], [flap(0.7), 1.2])
    assert stream.commands[-1].effort[1] == 0.0


@pytest.mark.parametrize('stroke, effort', [(1.0, [1.0 / math.sqrt(0.75)]), (2.0, []), (0.0, [])])
def test_an_effort_without_bound_is_no_effort(graph, stroke, effort):
    # Two equal bars and the cylinder between their ends: its force is endless where they lie in
    # one line, and unknown where it has no length.
    stream = Stream(graph, {
        'mechanisms': ['boom'], 'boom.type': 'custom', 'boom.loads': ['OB=-1.0'],
        'boom.joints': ['O ground 0 0', 'P ground 1 0', 'B cylinder P O 1 left']})
    stream.want(['boom_cylinder'], [stroke])
    assert [abs(x) for x in stream.commands[-1].effort] == pytest.approx(effort, rel=1e-12)


# --- several inputs ---

def actuators(foot, bucket):
    """Return where the motors and pistons are in the mode that the scene starts in."""
    (left, right), _ = min(five_bar(LEG, complex(*foot)), key=lambda row: abs(row[0][0] - 1.9)
                           + abs(row[0][1] - 1.24))
    (boom, arm, tip), _ = min(excavator(DIGGER.dimensions, complex(*bucket[:2]), bucket[2]),
                              key=lambda row: row[0][1])
    return np.array([left, (right - 0.2) / -0.5, boom - 80.0, arm, tip])


NAMES = ['leg_crank', 'motor', 'digger_cylinder', 'digger_cylinder2', 'digger_cylinder3']
# The foot and the bucket at the start of a straight line, and how fast they run along it.
LINE = np.array([0.059, 0.16, 160.0, -150.0, -1.6])
SPEED = np.array([-0.03, -0.03, -40.0, 20.0, -0.5])


def actuators_at(part):
    """Return where actuators are on the line."""
    place = LINE + part * SPEED
    return actuators(place[:2], place[2:])


def test_a_foot_and_a_bucket_go_in_along_a_line_and_back_out(graph):
    stream = Stream(graph, SEVERAL)
    arrays = [graph.listen(Float64MultiArray, f'{name}/commands') for name in ('leg', 'digger')]
    for part, way in ((0.0, 1.0), (0.3, 1.0), (0.7, 1.0), (1.0, -1.0), (0.4, -1.0), (0.0, -1.0)):
        commands = stream.want(FOOT + BUCKET, (LINE + part * SPEED).tolist(),
                               (way * SPEED).tolist())
        assert list(commands) == NAMES
        positions, speeds = np.transpose(list(commands.values()))
        np.testing.assert_allclose(positions, actuators_at(part), rtol=1e-11)
        np.testing.assert_allclose(speeds, way * slope(actuators_at, part), rtol=1e-6)
    graph.until(lambda: all(arrays) and np.allclose(
        [place for array in arrays for place in array[-1].data], actuators_at(0.0), rtol=1e-11))


def test_of_several_inputs_no_command_outlives_a_change_of_the_geometry(graph, capfd):
    parameters = {
        'mechanisms': ['leg', 'other', 'bar'], 'leg.type': 'five_bar', 'leg.crank.start': 1.9,
        'leg.crank2.start': 1.24, 'other.type': 'five_bar', 'other.crank.start': 1.9,
        'other.crank2.start': 1.24, 'bar.type': 'four_bar'}
    stream = Stream(graph, parameters)
    names, far = [*FOOT, 'other_P.x', 'other_P.y', 'bar_QB'], [9.0, 9.0]
    good = stream.want(names, [*LINE[:2], *LINE[:2], 1.2])
    assert stream.want(names, [*far, *far, 1.2]) == good
    graph.change(stream.node, parameters, leg__dimensions__a=0.085)
    commands = stream.want(names, [*far, *far, 1.2])
    assert commands == {name: at for name, at in good.items() if not name.startswith('leg')}
    graph.change(stream.node, parameters, other__scale=1.1)
    assert stream.want(names, [*far, *far, 1.2]).keys() == {'bar_crank'}
    assert stream.want([FOOT[0], 'bar_QB'], [9.0, 1.2]).keys() == {'bar_crank'}
    assert f'leg has 2 inputs: name 2 of its outputs, not {FOOT[0]}' in capfd.readouterr().err


# --- trajectories ---

SEARCHED = ['digger_H.x', 'digger_J.y', 'digger_distance(P,J)']


def test_a_new_name_or_load_leaves_the_turns_that_were_commanded(graph):
    cranks = {'mechanisms': ['m'], 'm.type': 'custom', 'm.joints': [
        'O ground 0 0', 'Q ground 5 0', 'A crank O 1', 'B crank Q 1']}
    stream = Stream(graph, cranks)
    both = ['m_crank', 'm_crank2']
    for turned in (2.0, 4.0, 6.0, 8.0):
        commands = stream.want(both, [turned, 0.5])
    assert commands == {'m_crank': (pytest.approx(8.0),), 'm_crank2': (0.5,)}
    graph.change(stream.node, cranks, m__loads=['A=0 -9.81'], m__joint_names=['crank=left'])
    assert stream.want(['left', 'm_crank2'], [8.1, 0.5])['m_crank'] == (pytest.approx(8.1),)


def test_without_a_closed_form_a_first_command_does_not_jump_and_no_message_waits_for_a_search(
        graph, capfd):
    stream = Stream(graph, SEVERAL)
    linkage = stream.node.scene.mechanisms['digger'].linkage
    outputs = linkage.function((), tuple(name.split('_')[1] for name in SEARCHED))
    near, far = [108.1, 132.1, 119.1], [56.8, 137.9, 133.8]
    for inputs, moved in ((far, {}), (near, {'digger_cylinder': near[0] - 80.0})):
        commands = stream.want(FOOT + SEARCHED, [*LINE[:2], *outputs(*inputs)])
        assert {name: at for name, (at,) in commands.items() if name == 'digger_cylinder'} == (
            pytest.approx(moved, rel=1e-9))
    assert 'no motion leads there from the last inputs' in capfd.readouterr().err


@pytest.fixture
def plan(graph, stream):
    """Return a function that sends a trajectory and returns what finds the actuators'."""
    publisher = graph.publisher(JointTrajectory, 'wanted_trajectory')
    planned = graph.listen(JointTrajectory, 'servo_trajectory')
    ids = itertools.count(1)

    def send(names, *points):
        message = JointTrajectory(joint_names=names, points=[
            JointTrajectoryPoint(positions=positions, velocities=velocities,
                                 time_from_start=Duration(sec=sec, nanosec=nanosec))
            for second, (positions, velocities, *time) in enumerate(points)
            for sec, nanosec in (time or [(second, 0)])])
        message.header.frame_id = mark = str(next(ids))
        publisher.publish(message)
        return lambda: [one for one in planned if one.header.frame_id == mark]

    return send


def test_a_trajectory_becomes_that_of_the_actuators(graph, plan):
    four_bar = mechanisms.create('four_bar')
    cranks, servos = [0.6, 0.9, 1.3], [0.1, 0.5, -0.4]

    def rocker(crank):
        return float(four_bar.joint_angles(crank)['QB'])

    trajectory = graph.until(plan(['bar_QB', 'flap'], *(
        ([rocker(crank), flap(servo)], [0.2, -0.1]) for crank, servo in zip(cranks, servos))))[0]
    assert trajectory.joint_names == ['bar_crank', 'servo']
    for second, (point, crank, servo) in enumerate(zip(trajectory.points, cranks, servos)):
        assert point.time_from_start.sec == second
        assert point.positions.tolist() == pytest.approx([crank, servo], abs=1e-12)
        assert point.velocities.tolist() == pytest.approx(
            [0.2 / slope(rocker, crank), -0.1 / slope(flap, servo)], rel=1e-7)


REFUSED = [
    (['flap'], [([0.0], []), ([4.0], [])], r'point 1: flap cannot be 4 \(lever at -3.9\): .*'),
    (['flap'], [([0.0, 1.0], [])], 'point 0 must have 1 positions, .*, not 2 and 0'),
    (['flap', 'wing'], [([0.0, 0.0], [])], 'no output is called wing; an output .*'),
    (['flap', 'flap'], [([0.0, 0.0], [])], 'joint_names has a name twice'),
    ([], [([], [])], 'joint_names is empty: name at least one output'),
    (['flap'], [([0.0], [math.nan])], 'point 0: a velocity must be finite'),
    (['flap'], [([0.1 - math.asin(80.0 / 150.0)], [0.0]), ([0.1], [])] * 2,
     'point 0: flap cannot be .*'),
    (['bar_A.x'], [([40.0], [0.1])], 'point 0: the motion of bar_A.x reverses there; .*'),
    (['flap'], [([0.1], [])] * 10_001, 'it has 10001 points; send up to 10000'),
    *((['flap'], [([0.1], [], time) for time in times], reason) for times, reason in (
        ([(-1, 0)], 'point 0 is at -1 s, before 0 s: time_from_start must not decrease'),
        ([(0, 0), (3, 0), (2, 999_999_999)], 'point 2 is at 3 s, before 3 s: .*')))]


def test_a_trajectory_that_cannot_be_is_refused_as_a_whole(graph, plan, capfd):
    logged = []

    def reasons():
        logged.append(capfd.readouterr().err)
        return re.findall('wanted_trajectory is refused: (.*)', ''.join(logged))

    refused = []
    for names, points, _ in REFUSED:
        refused.append(plan(names, *points))
        graph.until(lambda: len(reasons()) == len(refused))
    for text, (_, _, reason) in zip(reasons(), REFUSED):
        assert re.fullmatch(reason, text), (text, reason)
    times = [(0, 5), (0, 5), (1, 0), (0, 2 * 10 ** 9)]
    good, = graph.until(plan(['flap'], *(([flap(0.3)], [], time) for time in times)))
    assert [point.positions.tolist() for point in good.points] == [
        [pytest.approx(0.3, abs=1e-12)]] * 4
    assert [point.time_from_start for point in good.points] == [
        Duration(sec=sec, nanosec=nanosec) for sec, nanosec in times]
    assert not any(point.velocities for point in good.points)
    assert not any(one() for one in refused)
    # Where an output turns back it may stand still.
    extreme, = graph.until(plan(['bar_A.x'], ([40.0], [0.0])))
    assert extreme.points[0].velocities.tolist() == [0.0]


@pytest.mark.parametrize('stream', [SEVERAL], indirect=True)
def test_a_newer_trajectory_ends_the_older_one_and_no_later_point_jumps(graph, plan, capfd):
    # Alone, the older one takes seconds, however late the newer one comes.
    older = plan(FOOT + BUCKET, *[(LINE.tolist(), [])] * 10_000)
    newer = plan(FOOT, (LINE[:2].tolist(), []))
    assert graph.until(newer) and not older()
    # Only another assembly mode comes to this side of the ground bar.
    plan(FOOT, (LINE[:2].tolist(), []), ([0.01, 0.04], []))
    graph.until(lambda: 'the way to P.x, P.y at 0.01, 0.04 leads' in capfd.readouterr().err)
