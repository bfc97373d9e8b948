# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Each parameter has one owner, which announces it; the other nodes that use it follow."""


from linkage_ros import scene
from linkage_ros.nodes import log, scene_node
from linkage_ros.nodes.crank_driver import CrankDriver
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.nodes.ownership import LATCHED, TOPIC
from linkage_ros.nodes.servo_inverse import ServoInverse
import pytest
from rcl_interfaces.msg import Parameter as ParameterMessage, ParameterEvent, ParameterValue
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.parameter import Parameter
from ros_harness import hastened

LEVER = {'mechanisms': ['lever'], 'lever.type': 'slotted_lever'}
A = 'lever.dimensions.a'


@pytest.fixture
def warned(monkeypatch):
    """Gather the warnings of all nodes."""
    warnings = []
    monkeypatch.setattr(RcutilsLogger, 'warning', lambda _, text: warnings.append(text))
    return warnings


def of(node, name=A):
    """Return a parameter's value, as the scene has it."""
    parameter, = [p for p in node.scene.parameters if p.name == name]
    assert node.has_parameter(name) == (parameter.field.owner == node.get_name())
    assert not node.has_parameter(name) or scene.plain(
        node.get_parameter(name).value) == parameter.value
    return parameter.value


@pytest.mark.parametrize('namespace', ['', '/left'])
def test_an_owner_announces_all_its_values_and_then_each_change(graph, monkeypatch, namespace):
    monkeypatch.setattr(LATCHED, 'depth', 3)
    events = graph.listen(ParameterEvent, f'{namespace}/{TOPIC}', LATCHED)
    before = graph.node.get_clock().now().nanoseconds
    owner, follower = (graph.start(kind, LEVER, namespace=namespace)
                       for kind in (Kinematics, CrankDriver))
    graph.until(lambda: events)
    for a in (90.0, 91.0, 92.0, 93.0):
        assert graph.set(owner, lever__dimensions__a=a, lever__scale=2.0).successful
    graph.until(lambda: len(events) == 6 and of(follower) == 93.0)
    events = [event for event in events if event.node == f'{namespace}/kinematics']

    def owned(**values):
        return {parameter.name: (Parameter.Type[parameter.field.kind.upper()], parameter.value)
                for parameter in scene.read({**LEVER, **values}).parameters
                if parameter.field.owner == scene.KINEMATICS}

    def values_of(messages):
        return {parameter.name: (parameter.type_, scene.plain(parameter.value))
                for parameter in map(Parameter.from_parameter_msg, messages)}

    double = Parameter.Type.DOUBLE
    assert [[values_of(event.new_parameters), values_of(event.changed_parameters)]
            for event in events] == [
        [owned(), {}], [{}, {A: (double, 90.0), 'lever.scale': (double, 2.0)}],
        [{}, {A: (double, 91.0)}], [owned(**{A: 92.0, 'lever.scale': 2.0}), {}],
        [{}, {A: (double, 93.0)}]]
    times = [event.stamp.sec * 10 ** 9 + event.stamp.nanosec for event in events]
    assert before < times[0] and times == sorted(times)
    assert not any(event.deleted_parameters for event in events)


def test_a_set_on_a_follower_is_refused_with_the_node_where_it_works(graph):
    service = graph.start(ServoInverse, LEVER, namespace='left')
    refused = graph.set(service, lever__dimensions__a=90.0)
    assert not refused.successful and refused.reason == (
        f'{A} is not a parameter of /left/servo_inverse; set it on kinematics')
    assert graph.set(service, lever__pose=[0.0] * 6).reason == (
        'lever.pose is not a parameter of /left/servo_inverse')


def test_other_values_at_the_start_of_either_are_said_once_and_followed(
        graph, warned, monkeypatch):
    monkeypatch.setattr(log.Throttle, 'seconds', 0.0)
    service = graph.start(ServoInverse, {**LEVER, A: 81.0})
    owner = graph.start(Kinematics, {**LEVER, A: 82.0})
    graph.until(lambda: of(service) == 82.0)
    warning = f'/kinematics has other values, which are followed: {A} was 81.0 and is now 82.0'
    assert warned == [warning]
    late = graph.start(CrankDriver, {**LEVER, A: 83.0})
    graph.until(lambda: of(late) == 82.0)
    assert warned == [warning, warning.replace('81.0', '83.0')]
    # A change while all run is no news.
    assert graph.set(owner, lever__dimensions__a=84.0).successful
    graph.until(lambda: of(service) == of(late) == 84.0)
    assert len(warned) == 2
    graph.end(owner)
    # The crank driver announces, too.
    graph.until(lambda: graph.node.count_publishers(TOPIC) == 1)
    graph.start(Kinematics, {**LEVER, A: 82.0})
    graph.until(lambda: of(service) == of(late) == 82.0)
    assert warned[2:] == [warning.replace('81.0', '84.0')] * 2


def test_other_mechanisms_are_said_and_the_rest_is_followed(graph, warned):
    service = graph.start(ServoInverse, {
        **LEVER, 'mechanisms': ['lever', 'leg', 'mine'], 'leg.type': 'jansen',
        'mine.type': 'water_drop'})
    owner = graph.start(Kinematics, {
        **LEVER, 'mechanisms': ['lever', 'leg', 'yours'], 'leg.type': 'klann',
        'yours.type': 'jansen', A: 90.0, 'leg.dimensions.a': 0.6})
    graph.until(lambda: of(service) == 90.0)
    assert of(service, 'leg.dimensions.a') == 38.0
    assert warned[:2] == [
        "/kinematics has another mechanism, which is not followed: leg.type is 'jansen' here and "
        "'klann' there", '/kinematics has other mechanisms; only one of the nodes has: '
        'mine, yours']
    assert graph.set(owner, lever__dimensions__a=91.0).successful
    graph.until(lambda: of(service) == 91.0)
    assert len(warned) == 3
    # What the service cannot follow keeps nothing else from being followed.
    assert graph.set(owner, leg__dimensions__a=0.61, lever__dimensions__a=92.0).successful
    graph.until(lambda: of(service) == 92.0)
    assert of(service, 'leg.dimensions.a') == 38.0 and len(warned) == 3


def test_of_values_that_change_and_change_back_the_last_holds(graph):
    service = graph.start(ServoInverse, LEVER)
    announce, other, scale = graph.announcer(), graph.announcer('/other'), 'lever.scale'
    # What can be set only at the start is not followed.
    for values in ({'mechanisms': ['lever'], A: 80.0, scale: 1.0}, {A: 90.0}, {A: 80.0},
                   {scale: 2.0, 'lever.type': 'jansen'}):
        # Those of another node are none of its business.
        other({A: 95.0})
        announce(values)
    graph.until(lambda: of(service, scale) == 2.0)
    assert of(service) == 80.0


def test_an_announcement_with_a_value_that_makes_no_sense_is_passed_over(graph, capfd):
    service = graph.start(ServoInverse, LEVER)
    publisher = graph.node.create_publisher(ParameterEvent, TOPIC, LATCHED)
    events = graph.listen(ParameterEvent, TOPIC, LATCHED)
    good = [Parameter('mechanisms', value=['lever']), Parameter(A, value=90.0),
            Parameter('', value=1.0), Parameter('x' * 10 ** 5, value=1.0)]
    nonsense = [[Parameter('mechanisms', value=value)]
                for value in (5, 0.5, True, 'lever', [1.0], [b'l'])]
    nonsense += [[*good, Parameter(name, value=value)] for name, value in (
        (A, 'long'), ('lever.scale', -1.0), ('lever.dimensions.b', float('nan')),
        ('lever.type', 3))]
    messages = [[value.to_parameter_msg() for value in values] for values in (*nonsense, good)]
    messages.insert(0, [ParameterMessage(name=A, value=ParameterValue(type=200))])
    for number, values in enumerate(messages):
        publisher.publish(ParameterEvent(node=f'/odd{number}', changed_parameters=values))
        graph.until(lambda number=number: len(events) > number)
        assert number == len(messages) - 1 or of(service) == 80.0
    graph.until(lambda: of(service) == 90.0)
    log = capfd.readouterr().err
    assert 'internal error in scene_parameters' in log and len(log) < 2000


def test_what_a_follower_refused_is_followed_with_the_value_that_it_waits_for(graph, warned):
    service = graph.start(ServoInverse, LEVER)
    announce = graph.announcer()
    first = {one.name: one.value for one in service.scene.parameters
             if scene.INVERSE in one.field.readers and one.value != ()}
    announce({**first, 'mechanisms': ['lever']})
    # The pin cannot reach this slot before its crank has grown, which is announced later.
    e, b = 'lever.dimensions.e', 'lever.dimensions.b'
    announce({e: 700.0, b: 170.0})
    graph.until(lambda: [text for text in warned if 'values that cannot be followed' in text])
    assert (of(service, e), of(service, b)) == (first[e], first[b])
    announce({A: 900.0})
    graph.until(lambda: of(service) == 900.0)
    assert (of(service, e), of(service, b)) == (700.0, 170.0)


@pytest.mark.parametrize('pairs, allowing, allowed', [
    (2, {'leg__leg_pairs': 1, 'leg__mirrored': False}, {'leg__loads': ['G=0 -9.81']}),
    (1, {'leg__only_named': True}, {'drop__joint_names': ['AB=leg_BC']})])
def test_what_another_value_has_made_valid_is_followed(graph, pairs, allowing, allowed):
    legs = {'mechanisms': ['leg', 'drop'], 'leg.type': 'jansen', 'leg.leg_pairs': pairs,
            'drop.type': 'water_drop'}
    service, owner = (graph.start(kind, legs) for kind in (ServoInverse, Kinematics))
    assert not graph.set(owner, **allowed).successful
    for values in allowing, allowed, {'leg__scale': 0.5}:
        assert graph.set(owner, **values).successful
    graph.until(lambda: of(service, 'leg.scale') == 0.5)


def test_a_second_node_of_the_same_name_is_noticed_once(graph, warned):
    timers = [hastened(graph.start(CrankDriver, LEVER, namespace=namespace),
                       scene_node.NAMESAKE_CHECK_PERIOD_S) for namespace in ('', 'other', '')]
    graph.until(lambda: len(warned) == 2)
    assert all('there is another node /crank_driver' in text for text in warned)
    assert [timer.is_canceled() for timer in timers] == [True, False, True]
