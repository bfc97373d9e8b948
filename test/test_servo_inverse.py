# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The servo service: right answers, or the reason why there is none."""

import math

from linkage_interfaces.srv import InputsFor, ServoInverse as Service
from linkage_ros import mechanisms, scene
from linkage_ros.nodes.crank_driver import CrankDriver
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.nodes.servo_inverse import ServoInverse
import numpy as np
import pytest
from sensor_msgs.msg import JointState
from truth.working_modes import five_bar, lever_of

TWO = {'mechanisms': ['left', 'right', 'drop'], 'left.type': 'slotted_lever',
       'right.type': 'slotted_lever', 'right.dimensions.a': 200.0, 'drop.type': 'water_drop'}
def test_each_servo_angle_puts_the_lever_where_it_is_wanted(graph):
    levers = [0.0, 0.1, -0.3, 0.5, math.asin(80.0 / 150.0) * (1.0 - 1e-9)]
    graph.start(ServoInverse)
    client = graph.node.create_client(Service, 'servo_inverse')
    near = [math.tau * turns for turns in range(len(levers))]
    response = graph.call(client, Service.Request(lever_angle=levers, servo_near=near))
    assert response.success and response.message == '' and all(response.reachable)
    assert [round(servo / math.tau) for servo in response.servo_angle] == [0, 1, 2, 3, 4]
    for phi, servo, reduction in zip(levers, response.servo_angle, response.reduction):
        assert lever_of(servo) == pytest.approx(phi, abs=1e-15)
        slope = (lever_of(servo + 1e-6) - lever_of(servo - 1e-6)) / 2e-6
        assert reduction == pytest.approx(slope, abs=1e-9)


MECHANISMS = 'water_drop, jansen, peaucellier, slotted_lever'
OUTPUTS = ('; allowed: distance(A,B) and angle(A,B) of two joints, crank, BC, AC, BE, AE, EF, DF, '
           'O.x, O.y, B.x, B.y, A.x, A.y, ... (23)')
FAR = 'servo_near must be finite and within 1e+06 rad of zero'
ONE = 'mechanism may be empty only if the scene has a single'


@pytest.mark.parametrize('parameters, refused', [
    (None, [
        ({'lever_angle': []}, 'lever_angle is empty; give at least one value'),
        ({'lever_angle': [0.1] * 10_001},
         'lever_angle has 10001 values; give up to 10000 at once'),
        ({'servo_near': [0.1, 0.2]}, 'servo_near must be empty, have one angle, or one for each '
         'of the 1 in lever_angle, not 2'),
        *(({'servo_near': [bad]}, FAR) for bad in (math.nan, 1e308, -1.1 * scene.MAX_POSITION)),
        ({'mechanism': 10 ** 6 * 'x'},
         f"there is no mechanism '{27 * 'x'}...{28 * 'x'}'; allowed: {MECHANISMS}"),
        ({'mechanism': 'slotted_levr'}, "there is no mechanism 'slotted_levr'; allowed: "
         f'{MECHANISMS}; did you mean slotted_lever?'),
        ({'mechanism': 'jansen'}, f"jansen has no output 'lever'{OUTPUTS}"),
        ({'output': 'C.y'}, f'{ONE} mechanism; allowed: {MECHANISMS}'),
        ({'mechanism': 'jansen', 'output': 'G.x.x'},
         f"jansen has no output 'G.x.x'{OUTPUTS}; did you mean G.x?"),
        ({'mechanism': 'jansen', 'output': 'O.x'}, 'O.x of jansen does not move with the crank')]),
    (TWO, [({'output': output}, f'{ONE} slotted lever; allowed: left, right, drop')
           for output in ('', 'lever')]),
    ({'mechanisms': ['jansen']}, [
        ({}, f"jansen has no output 'lever'{OUTPUTS}")]),
    ({'mechanisms': ['five_bar']}, [
        ({'output': 'P.y'}, 'five_bar has several inputs, which one output does not determine; '
         'call the service inputs_for')])])
def test_a_request_that_cannot_be_answered_gets_the_reason_alone(graph, parameters, refused):
    node = graph.start(ServoInverse, parameters)
    for fields, message in refused:
        request = Service.Request(**{'lever_angle': [0.1], **fields})
        assert node.answer(request, Service.Response()) == Service.Response(message=message)


@pytest.mark.parametrize('fields, message', [
    ({'lever_angle': [0.1, math.nan, 0.6, 0.1, -math.inf]},
     'lever cannot be nan, 0.6, -inf; lever reaches [-0.562536, 0.562536] rad'),
    ({'lever_angle': [0.1] + [1.0] * 9999}, 'lever cannot be 1, 1, 1, 1, 1 and 9994 more'
     '; lever reaches [-0.562536, 0.562536] rad'),
    ({'lever_angle': [1e308], 'output': 'G.x', 'mechanism': 'jansen'},
     'G.x cannot be 1e+308; G.x reaches [-0.357608, -0.0180657] m'),
    ({'lever_angle': [-math.inf], 'output': 'BC', 'mechanism': 'jansen'},
     'BC cannot be -inf; a value must be finite')])
def test_a_value_that_cannot_be_had_is_nan_with_the_reason(graph, fields, message):
    node = graph.start(ServoInverse)
    response = node.answer(Service.Request(**fields), Service.Response())
    had = [value == 0.1 for value in fields['lever_angle']]
    assert (response.success, response.message) == (False, message)
    assert response.reachable == had
    for numbers in response.servo_angle, response.reduction:
        assert [math.isfinite(number) for number in numbers] == had


FIVE_BAR = {'mechanisms': ['leg', 'drop'], 'leg.type': 'five_bar', 'leg.scale': 2.0,
            'leg.crank2.source': 'motor', 'leg.crank2.ratio': 0.5, 'drop.type': 'water_drop'}
FOOT = {'outputs': ['P.x', 'P.y'], 'values': [0.12, 0.3]}


def test_all_working_modes_of_a_foot_are_told_and_the_nearest_comes_first(graph):
    node = graph.start(ServoInverse, FIVE_BAR)
    client = graph.node.create_client(InputsFor, 'inputs_for')
    response = graph.call(client, InputsFor.Request(**FOOT))
    assert response.success and response.message == ''
    assert response.names == ['leg_crank', 'motor']
    lengths = mechanisms.create('five_bar').dimensions
    expected = {f'AP{"+-"[bends["AP"] < 0]} CP{"+-"[bends["CP"] < 0]}': inputs
                for inputs, bends in five_bar(lengths, 0.06 + 0.15j)}
    answers = np.reshape(response.positions, (-1, 2))
    assert len(expected) == len(answers) == len(response.modes) and not any(response.singular)
    for mode, (left, motor) in zip(response.modes, answers):
        assert np.exp(1j * np.array([left, motor / 2])) == pytest.approx(
            np.exp(1j * np.array(expected[mode.rpartition(' ')[0]])), abs=1e-12)
    for answer, mode in zip(answers, response.modes):
        near = (answer + [2 * math.pi, -8 * math.pi]).tolist()
        again = node.answer_inputs_for(InputsFor.Request(near=near, **FOOT), InputsFor.Response())
        assert again.positions[:2].tolist() == pytest.approx(near) and again.modes[0] == mode


INPUTS_REFUSED = [
    ({'values': [0.12]}, 'values must have 2 numbers and near as many or none, not 1 and 0'),
    ({'near': [0.0]}, 'values must have 2 numbers and near as many or none, not 2 and 1'),
    *(({'near': [0.0, bad]}, 'near must be finite and within 1e+06 of zero')
      for bad in (1e9, -1e9, math.nan)),
    ({'outputs': ['P.x']}, 'leg has 2 inputs: as many outputs are needed, not 1'),
    ({'outputs': ['P.x', 'P.x']}, 'outputs must differ, got P.x, P.x'),
    ({'mechanism': 'drop'}, 'drop has 1 input: as many outputs are needed, not 2')]


def test_what_cannot_be_asked_of_several_inputs_gets_the_reason(graph):
    node = graph.start(ServoInverse, FIVE_BAR)
    for fields, message in INPUTS_REFUSED:
        request = InputsFor.Request(**{**FOOT, **fields})
        assert node.answer_inputs_for(request, InputsFor.Response()) == InputsFor.Response(
            message=message)
    for values, message in (([0.12, 3.0], 'P.x, P.y at 0.12, 3 is outside the reach'),
                            ([math.nan, 0.3], 'a value must be finite')):
        request = InputsFor.Request(outputs=FOOT['outputs'], values=values, mechanism='leg')
        assert node.answer_inputs_for(request, InputsFor.Response()) == InputsFor.Response(
            message=message, names=['leg_crank', 'motor'])


def test_dimensions_change_while_the_node_runs(graph):
    node, request = graph.start(ServoInverse), Service.Request(lever_angle=[0.8])
    assert not node.answer(request, Service.Response()).success
    graph.change(node, {}, slotted_lever__dimensions__a=140.0)
    response = node.answer(request, Service.Response())
    assert lever_of(response.servo_angle[0], a=140.0) == pytest.approx(0.8)


# --- beside the other nodes in one process ---

LEVER = {'mechanisms': ['lever'], 'lever.type': 'slotted_lever', 'lever.crank.speed': 2.0}


def test_the_service_answers_on_the_working_branch_wherever_the_crank_is(graph):
    *_, driver = [graph.start(kind, LEVER) for kind in (Kinematics, ServoInverse, CrankDriver)]
    client = graph.node.create_client(Service, 'servo_inverse')
    cranks = graph.listen(JointState, 'crank_states')
    for start in (0.4, 2.9):
        graph.set(driver, lever__crank__start=start, lever__crank__speed=0.0)
        graph.until(lambda start=start: cranks and cranks[-1].position[0] == start)
        response = graph.call(client, Service.Request(lever_angle=[lever_of(0.4)]))
        assert response.success and response.servo_angle[0] == pytest.approx(0.4, abs=1e-9)
