# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The servo service: right answers, or the reason why there is none."""

import math
import threading
from types import SimpleNamespace

from linkage_interfaces.srv import InputsFor, ServoInverse as Service
from linkage_ros import mechanisms, scene
from linkage_ros.nodes.servo_inverse import ServoInverse
import numpy as np
import pytest
from truth.working_modes import five_bar

TWO = {'mechanisms': ['left', 'right', 'drop'], 'left.type': 'slotted_lever',
       'right.type': 'slotted_lever', 'right.dimensions.a': 200.0, 'drop.type': 'water_drop'}
SWEPT = {'mechanisms': ['slotted_lever'], 'slotted_lever.crank.sweep': [-1.3, 0.8]}
KINDS = [kind for kind in mechanisms.TYPES if len(mechanisms.create(kind).inputs) == 1]


def lever_of(servo, a=80.0, b=150.0):
    """Return the lever angle from the pin's place: the loop closure, written out."""
    return math.atan2(a * math.sin(servo), b + a * math.cos(servo))


def test_each_servo_angle_puts_the_lever_where_it_is_wanted(graph):
    wanted = [0.0, 0.1, -0.3, 0.5, math.asin(80.0 / 150.0) * (1.0 - 1e-9)]
    graph.start(ServoInverse)
    client = graph.node.create_client(Service, 'servo_inverse')
    response = graph.call(client, Service.Request(lever_angle=wanted))
    assert response.success and response.message == '' and all(response.reachable)
    for phi, servo, reduction in zip(wanted, response.servo_angle, response.reduction):
        assert lever_of(servo) == pytest.approx(phi, abs=1e-15)
        slope = (lever_of(servo + 1e-6) - lever_of(servo - 1e-6)) / 2e-6
        assert reduction == pytest.approx(slope, abs=1e-9)


MECHANISMS = 'water_drop, jansen, peaucellier, slotted_lever'
OUTPUTS = ('; allowed: distance(A,B) and angle(A,B) of two joints, crank, BC, AC, BE, AE, EF, DF, '
           'O.x, O.y, B.x, B.y, A.x, A.y, ... (23)')
FAR = 'servo_near must be finite and within 1e+06 rad of zero'
ONE = 'mechanism may be empty only if the scene has a single'


def cut(letter):
    """Return a long name as it is shortened."""
    return f"'{27 * letter}...{28 * letter}'"


@pytest.mark.parametrize('parameters, refused', [
    (None, [
        ({'lever_angle': []}, 'lever_angle is empty; give at least one value'),
        ({'lever_angle': [0.1] * 10_001},
         'lever_angle has 10001 values; give up to 10000 at once'),
        ({'servo_near': [0.1, 0.2]}, 'servo_near must be empty, have one angle, or one for each '
         'of the 1 in lever_angle, not 2'),
        *(({'servo_near': [bad]}, FAR) for bad in (math.nan, 1e308, -1.1 * scene.FARTHEST)),
        *(({'mechanism': name}, f'there is no mechanism {shown}; allowed: {MECHANISMS}')
          for name, shown in (('arm', "'arm'"), ('x' * 10 ** 6, cut('x')))),
        ({'mechanism': 'slotted_levr'}, "there is no mechanism 'slotted_levr'; allowed: "
         f'{MECHANISMS}; did you mean slotted_lever?'),
        ({'mechanism': 'jansen'}, f"jansen has no output 'lever'{OUTPUTS}"),
        ({'output': 'C.y'}, f'{ONE} mechanism; allowed: {MECHANISMS}'),
        ({'mechanism': 'arm', 'output': 'C.y'},
         f"there is no mechanism 'arm'; allowed: {MECHANISMS}"),
        *(({'mechanism': 'jansen', 'output': name}, f'jansen has no output {shown}{OUTPUTS}{hint}')
          for name, shown, hint in (
            ('Z.y', "'Z.y'", ''), ('y' * 10 ** 6, cut('y'), ''),
            ('G.x.x', "'G.x.x'", '; did you mean G.x?'))),
        ({'mechanism': 'jansen', 'output': 'O.x'}, 'O.x of jansen does not move with the crank'),
        ({'mechanism': 'peaucellier', 'output': 'C.x'},
         'C.x of peaucellier does not move with the crank')]),
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
    ({'lever_angle': [0.1, 0.6, 0.1, math.nan, -math.inf]},
     'lever angles 0.6, nan, -inf cannot be reached; the lever reaches [-0.562536, 0.562536] rad'),
    ({'lever_angle': [0.1] + [1.0] * 9}, 'lever angles 1, 1, 1, 1, 1 and 4 more cannot be reached'
     '; the lever reaches [-0.562536, 0.562536] rad'),
    ({'lever_angle': [1e308], 'output': 'G.x', 'mechanism': 'jansen'},
     'values of G.x 1e+308 cannot be reached; G.x reaches [-0.357608, -0.0180657] m'),
    ({'lever_angle': [-math.inf], 'output': 'BC', 'mechanism': 'jansen'},
     'values of BC -inf cannot be reached; a value must be finite')])
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


@pytest.mark.parametrize('turn', [-2, 0, 1])
def test_of_several_inputs_one_in_a_sweep_of_another_turn_is_answered_there(graph, turn):
    sweep = [turn * math.tau + end for end in (1.0, 3.0)]
    node = graph.start(ServoInverse, {
        'mechanisms': ['leg'], 'leg.type': 'five_bar', 'leg.crank.sweep': sweep,
        'leg.crank.start': sweep[0] + 0.9, 'leg.crank2.start': 1.24})
    response = node.answer_inputs_for(
        InputsFor.Request(outputs=['P.x', 'P.y'], values=[0.06, 0.15], near=[1.9, 1.24]),
        InputsFor.Response())
    expected = [inputs for inputs, _ in five_bar(mechanisms.create('five_bar').dimensions,
                                                 0.06 + 0.15j) if 1.0 <= inputs[0] <= 3.0]
    answers = np.reshape(response.positions, (-1, 2))
    assert len(expected) == len(answers) == 2
    assert sorted(answers[:, 0] - turn * math.tau) == pytest.approx(
        sorted(inputs[0] for inputs in expected), abs=1e-12)


INPUTS_REFUSED = [
    ({'values': [0.12]}, 'values must have 2 numbers and near as many or none, not 1 and 0'),
    ({'near': [0.0]}, 'values must have 2 numbers and near as many or none, not 2 and 1'),
    *(({'near': [0.0, bad]}, 'near must be finite and within 1e+06 of zero')
      for bad in (1e9, -1e9, math.nan)),
    ({'outputs': ['P.x']}, 'leg has 2 inputs: as many outputs are needed, not 1'),
    ({'outputs': ['P.x', 'Z.y']}, "five_bar has no output 'Z.y'; allowed: distance(A,B) and "
     'angle(A,B) of two joints, crank, crank2, AP, CP, O.x, O.y, Q.x, Q.y, A.x, A.y, C.x, '
     '... (14)'),
    ({'outputs': ['A.x', 'A.y']},
     'A.x, A.y do not determine all inputs: too few of them move A.x, A.y'),
    ({'mechanism': 'boom'}, "there is no mechanism 'boom'; allowed: leg, drop"),
    ({'mechanism': 'drop'}, 'drop has 1 inputs: as many outputs are needed, not 2')]


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


def ask(node, wanted, near=(), output='', mechanism=''):
    """Return what a node answers, asked without the way over the wire."""
    request = Service.Request(mechanism=mechanism, output=output, lever_angle=wanted,
                              servo_near=near)
    return node.answer(request, Service.Response())


def test_many_angles_at_once_are_answered_like_each_alone(graph):
    node = graph.start(ServoInverse, SWEPT)
    wanted = np.linspace(-0.5, 0.5, 600).tolist()
    alone = [ask(node, [each]) for each in wanted]

    def check():
        many = ask(node, wanted)
        assert not many.success and many.message
        assert many.reachable == [one.success for one in alone]
        for field in ('servo_angle', 'reduction'):
            np.testing.assert_allclose(
                getattr(many, field), [getattr(one, field)[0] for one in alone], rtol=1e-12)

    check()
    # Machine code is made meanwhile, where llvmlite is, and answers then.
    graph.until(lambda: 'linkage_ros compiler' not in {t.name for t in threading.enumerate()})
    check()


@pytest.mark.parametrize('bad', [
    {'slotted_lever.crank.sweep': [1e16, 1e16 + 8.0]}, {'slotted_lever.scale': 1e308},
    {'slotted_lever.scale': 1e-308}])
def test_what_would_cost_an_answer_its_digits_is_refused(graph, bad):
    with pytest.raises(scene.SceneError):
        graph.start(ServoInverse, {**SWEPT, **bad})


def random_scene(rng):
    """Return a random scene of one mechanism with one crank, often with a sweep; None if none."""
    kind = str(rng.choice(KINDS))
    given = {'mechanisms': ['m'], 'm.type': kind, 'm.scale': float(rng.choice([1.0, 0.01])),
             **{f'm.dimensions.{name}': length * math.exp(rng.uniform(-0.1, 0.1))
                for name, length in mechanisms.defaults(kind).items() if length}}
    try:
        reach = scene.read(given).mechanisms['m'].reach
    except scene.SceneError:
        return None
    if rng.random() < 0.7:
        low, high = np.sort(rng.uniform(*reach[0], 2))
        if reach[0] == (-math.pi, math.pi):
            high += rng.choice([0.0, 5.0, 15.0])
        turns = 2 * math.pi * int(rng.integers(-2, 3))
        given['m.crank.sweep'] = [float(low + turns), float(max(high, low + 1e-3) + turns)]
    try:
        scene.read(given)
    except scene.SceneError:
        return None
    return given


def check_random_scene(graph, rng):
    """Ask for values of a random output; compare with what a fine search finds."""
    given = random_scene(rng)
    if given is None:
        return 0
    node = graph.start(ServoInverse, given)
    mechanism = node.scene.mechanisms['m']
    linkage, sweep = mechanism.linkage, given.get('m.crank.sweep')
    output = str(rng.choice([*linkage.joints, *(f'{joint}.{axis}' for joint in linkage.points
                                                for axis in 'xy')]))
    joint, _, axis = output.rpartition('.')
    slides = [link.name for link in linkage.links if link.kind == 'prismatic']
    turns = not joint and output not in slides

    def value(theta):
        found = (linkage.solve(theta, (joint,))[joint][..., 'xy'.index(axis)] if joint
                 else linkage.joint_angles(theta, (output,))[output])
        return found if turns else found * mechanism.scale

    arcs = [sweep] if sweep else mechanism.reach
    theta = np.concatenate([[*np.linspace(*arc, 40001), math.nan] for arc in arcs])
    curve = value(theta)
    if np.nanmax(curve) - np.nanmin(curve) <= 1e-12 * mechanism.scale * linkage.longest:
        return 0  # it never moves, but for rounding
    wanted = value(np.concatenate([rng.uniform(*arcs[0], 2), rng.uniform(*mechanism.reach[0], 2)]))
    near = rng.uniform(-12.0, 12.0, 4) if rng.random() < 0.7 else np.zeros(0)
    response = ask(node, wanted.tolist(), near.tolist(), output, 'm')
    assert all(response.reachable[:2]), (given, output, wanted, response)
    for i, servo in enumerate(response.servo_angle):
        gap = curve - wanted[i]
        gap = gap - 2 * math.pi * np.round(gap / (2 * math.pi)) if turns else gap
        crossed = (gap[:-1] * gap[1:] <= 0.0) & (np.abs(np.diff(gap)) < 1.0 + 9.0 * (not turns))
        roots = theta[:-1][crossed]
        case = given, output, wanted[i], near, servo, roots, response.message
        assert math.isfinite(servo) or not roots.size, case
        if math.isfinite(servo):
            miss = float(value(servo)) - wanted[i]
            miss -= 2 * math.pi * round(miss / (2 * math.pi)) if turns else 0.0
            size = math.pi if turns else np.nanmax(np.abs(curve))
            assert abs(miss) < 1e-12 * size + 4e-15 * abs(response.reduction[i]), case
            assert not sweep or sweep[0] <= servo <= sweep[1], case
            if near.size and roots.size:
                roots = roots if sweep else roots + 2 * math.pi * np.round(
                    (near[i] - roots) / (2 * math.pi))
                assert abs(servo - near[i]) < np.abs(roots - near[i]).min() + 1e-3, case
    return 1


def test_random_outputs_in_random_sweeps_are_had_or_cannot_be(graph, scenes=12, seed=1):
    rng = np.random.default_rng(seed)
    assert sum(check_random_scene(graph, rng) for _ in range(scenes)) > scenes // 4


@pytest.mark.nightly
@pytest.mark.parametrize('seed', range(2, 8))
def test_many_random_outputs_in_random_sweeps_are_had_or_cannot_be(graph, seed):
    test_random_outputs_in_random_sweeps_are_had_or_cannot_be(graph, 80, seed)


def test_dimensions_change_while_the_node_runs(graph):
    node = graph.start(ServoInverse)
    request = SimpleNamespace(mechanism='', lever_angle=[0.8], servo_near=[], output='')
    assert not node.answer(request, Service.Response()).success
    graph.change(node, {}, slotted_lever__dimensions__a=140.0)
    response = node.answer(request, Service.Response())
    assert lever_of(response.servo_angle[0], a=140.0) == pytest.approx(0.8)
