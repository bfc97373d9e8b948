# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""The servo service: right answers, or the reason why there is none."""

import math
import re
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('linkage_interfaces')

from linkage_interfaces.srv import ServoInverse as Service  # noqa: E402
from linkage_ros import mechanisms  # noqa: E402
from linkage_ros.servo_inverse import ServoInverse  # noqa: E402

TWO = {'mechanisms': ['left', 'right', 'drop'], 'left.type': 'slotted_lever',
       'right.type': 'slotted_lever', 'right.dimensions.a': 200.0, 'drop.type': 'water_drop'}
LIMIT = math.asin(80.0 / 150.0)


@pytest.fixture
def call(graph):
    """Return a function that starts the node, calls its service and returns the response."""
    def ask(parameters=None, **request):
        node = graph.start(ServoInverse, parameters)
        client = graph.node.create_client(Service, 'servo_inverse')
        graph.until(client.service_is_ready)
        future = client.call_async(Service.Request(**request))
        graph.until(future.done)
        assert node.scene
        return future.result()

    return ask


def lever_of(servo, a=80.0, b=150.0):
    """Return the lever angle from the pin's place: the loop closure, written out."""
    return math.atan2(a * math.sin(servo), b + a * math.cos(servo))


def test_each_servo_angle_puts_the_lever_where_it_is_wanted(call):
    wanted = [0.0, 0.1, -0.3, 0.5, LIMIT * (1.0 - 1e-9)]
    response = call(lever_angle=wanted)
    assert response.success and response.message == '' and all(response.reachable)
    for phi, servo, reduction in zip(wanted, response.servo_angle, response.reduction):
        assert lever_of(servo) == pytest.approx(phi, abs=1e-15)
        slope = (lever_of(servo + 1e-6) - lever_of(servo - 1e-6)) / 2e-6
        assert reduction == pytest.approx(slope, abs=1e-9)


def test_of_two_answers_the_one_near_the_servo_is_taken(call):
    working, other = call(lever_angle=[0.3]).servo_angle[0], 2.5
    response = call(lever_angle=[0.3, 0.3, 0.3], servo_near=[working + 0.1, other, 9.0])
    assert response.success
    assert response.servo_angle[0] == working
    assert abs(response.servo_angle[1] - other) < 0.5
    assert lever_of(response.servo_angle[1]) == pytest.approx(0.3)
    assert abs(response.servo_angle[2] - 9.0) < math.pi
    assert lever_of(response.servo_angle[2]) == pytest.approx(0.3)


def test_a_lever_that_turns_all_round_reaches_every_angle(call):
    wanted = np.linspace(-3.0, 3.0, 13)
    response = call(TWO, mechanism='right', lever_angle=wanted.tolist())
    assert response.success
    for phi, servo in zip(wanted, response.servo_angle):
        assert lever_of(servo, a=200.0) == pytest.approx(phi)


def test_one_angle_out_of_reach_does_not_spoil_the_others(call):
    response = call(lever_angle=[0.1, 0.6, 0.2, math.nan, -math.inf])
    assert not response.success
    assert list(response.reachable) == [True, False, True, False, False]
    assert list(np.isnan(response.servo_angle)) == [False, True, False, True, True]
    assert list(np.isnan(response.reduction)) == [False, True, False, True, True]
    assert lever_of(response.servo_angle[2]) == pytest.approx(0.2)
    assert 'lever angles 0.6, nan, -inf cannot be reached' in response.message
    assert '[-0.562536, 0.562536] rad' in response.message


def test_many_angles_out_of_reach_are_not_all_named(call):
    response = call(lever_angle=[1.0] * 100)
    assert 'and 95 more' in response.message and len(response.servo_angle) == 100


@pytest.mark.parametrize('parameters, request_, message', [
    (None, {'lever_angle': []}, 'lever_angle is empty'),
    (None, {'lever_angle': [0.1], 'servo_near': [0.1, 0.2]}, 'servo_near .* 1 .* not 2'),
    (None, {'lever_angle': [0.1], 'servo_near': [math.nan]}, 'servo_near must be finite'),
    (None, {'lever_angle': [0.1], 'mechanism': 'arm'},
     "no mechanism 'arm'; allowed: slotted_lever"),
    (None, {'lever_angle': [0.1], 'mechanism': 'jansen'},
     'jansen is a jansen, not a slotted lever; name an output, or take one of: slotted_lever'),
    (TWO, {'lever_angle': [0.1]}, 'may be empty only .* allowed: left, right'),
    ({'mechanisms': ['jansen']}, {'lever_angle': [0.1]}, 'no slotted_lever'),
])
def test_a_request_that_cannot_be_answered_gets_the_reason(call, parameters, request_, message):
    response = call(parameters, **request_)
    assert not response.success and re.search(message, response.message)
    assert not response.servo_angle and not response.reduction and not response.reachable


def test_any_output_of_any_mechanism_is_put_where_it_is_wanted(call):
    cell = {'mechanisms': ['cell'], 'cell.type': 'peaucellier', 'cell.scale': 0.1}
    response = call(cell, output='C.y', lever_angle=[0.2, -0.5, 5.0])
    assert response.reachable == [True, True, False] and not response.success
    for y, servo, slope in zip([0.2, -0.5], response.servo_angle, response.reduction):
        assert 0.1 * 65.0 / 6.0 * math.tan(servo / 2.0) == pytest.approx(y, abs=1e-15)
        assert slope == pytest.approx(0.1 * 65.0 / 12.0 / math.cos(servo / 2.0) ** 2)
    assert response.message == (
        'values of C.y 5 cannot be reached: C.y lies within [-0.718602, 0.718602] m, its '
        'greatest at the crank angle 1.17137 rad, the upper end of the reach')


def test_a_link_is_turned_to_an_angle_by_the_answer_nearest_to_a_servo(call):
    response = call(mechanism='jansen', output='BE', lever_angle=[-2.2, -2.2],
                    servo_near=[0.0, 3.0])
    assert response.success and response.servo_angle[0] != response.servo_angle[1]
    for servo in response.servo_angle:
        angle = mechanisms.create('jansen').joint_angles(servo)['BE']
        assert angle == pytest.approx(-2.2, abs=1e-14)


@pytest.mark.parametrize('parameters, request_, message', [
    (None, {'output': 'C.y', 'lever_angle': [0.1]}, 'may be empty only where there is one;'),
    (None, {'mechanism': 'arm', 'output': 'C.y', 'lever_angle': [0.1]}, "no mechanism 'arm'"),
    (None, {'mechanism': 'jansen', 'output': 'Z.y', 'lever_angle': [0.1]}, 'Z'),
    (None, {'mechanism': 'jansen', 'output': 'O.x', 'lever_angle': [0.1]}, 'O.x'),
    ({'mechanisms': ['five_bar']}, {'output': 'P.y', 'lever_angle': [0.1]}, 'several cranks'),
])
def test_an_output_that_cannot_be_asked_for_gets_the_reason(
        call, parameters, request_, message):
    response = call(parameters, **request_)
    assert not response.success and message in response.message


def test_dimensions_change_while_the_node_runs(graph):
    node = graph.start(ServoInverse)
    request = SimpleNamespace(mechanism='', lever_angle=[0.8], servo_near=[], output='')
    assert not node.answer(request, Service.Response()).success
    assert graph.set(node, slotted_lever__dimensions__a=140.0).successful
    response = node.answer(request, Service.Response())
    assert lever_of(response.servo_angle[0], a=140.0) == pytest.approx(0.8)
    assert not graph.set(node, slotted_lever__dimensions__a=-1.0).successful
    assert node.answer(request, Service.Response()).success


def test_the_handler_never_raises(graph):
    node = graph.start(ServoInverse)
    broken = SimpleNamespace(mechanism='', lever_angle=None, servo_near='x')
    response = node.answer(broken, Service.Response())
    assert not response.success and response.message
