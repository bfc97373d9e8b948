# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Parameters that are set while nodes run: answered one by one, prepared aside, then adopted."""

from importlib.metadata import version
import json
import math
import threading

from linkage_ros import scene
from linkage_ros.nodes import ownership, scene_node as nodes
from linkage_ros.nodes.crank_driver import CrankDriver
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.nodes.servo_inverse import ServoInverse
import pytest
from rcl_interfaces import msg
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from ros_harness import Graph
from sensor_msgs.msg import JointState

LEG = {'mechanisms': ['leg'], 'leg.type': 'jansen'}
EVERYTHING = {
    'mechanisms': ['leg', 'lever', 'own'], 'leg.type': 'jansen', 'lever.type': 'slotted_lever',
    'own.type': 'custom', 'own.dimensions.h': -0.1, 'own.tracer': 'B',
    'own.joints': ['O ground 0 0', 'Q ground 4.0 h', 'A crank O 1', 'B dyad A Q 3 3 left']}
KINDS = (CrankDriver, Kinematics, ServoInverse)

_long = 'x' * 10 ** 6
HOSTILE = [
    Parameter('', Parameter.Type.NOT_SET, None),
    *[Parameter('', value=value) for value in (
        True, False, 0, -1, 7, 2 ** 63 - 1, -2 ** 63, 0.0, -0.0, -1.0, 7.5, 5e-324, 1e308, -1e308,
        math.nan, math.inf, -math.inf, '', ' ', 'no', '\0', 'a\nb', '/world', _long,
        [b'\0', b'\xff'], [True, False], [1, 2, 3], [1.0, math.nan], [2.0, 1.0], [math.inf] * 6,
        [1e308] * 6, [0.0] * 10 ** 5, ['no'], ['', ''], [_long], ['a'] * 10 ** 5)],
    *[Parameter('', type_, []) for type_ in Parameter.Type if 'ARRAY' in type_.name]]


class Client:
    """The parameter services of a node, called from outside."""

    def __init__(self, graph, node):
        self._graph, self.node, self.services = graph, node, graph.parameters(node)

    def call(self, service, given):
        """Return the response of a service."""
        return self._graph.answer(lambda: getattr(self.services, service)(given))

    def set(self, *values):
        """Set name after name to a value in one request; return the results."""
        return self.call('set_parameters', [_message(*one) for one in values]).results

    def about(self, names):
        """Return descriptor and type of each parameter."""
        return (self.call('describe_parameters', names).descriptors,
                self.call('get_parameter_types', names).types)


def _message(name, value):
    if isinstance(value, msg.Parameter):
        return msg.Parameter(name=name, value=value.value)
    return Parameter(name, value=value).to_parameter_msg()


def values_of(node):
    """Return the values of all parameters by name."""
    return {name: scene.plain(node.get_parameter(name).value) for name in node.fields}


@pytest.mark.nightly
@pytest.mark.parametrize('kind, least', [(CrankDriver, 80), (Kinematics, 1000)])
def test_no_value_of_any_kind_spoils_any_parameter(graph, kind, least):
    node = graph.start(kind, EVERYTHING)
    client = Client(graph, node)
    names = list(node.fields)
    before, about = values_of(node), client.about(names)
    hostile = [parameter.to_parameter_msg() for parameter in HOSTILE]
    for name in names:
        for result in client.set(*[(name, value) for value in hostile]):
            if not result.successful:
                assert 20 < len(result.reason) < 600
                assert all(part in result.reason for part in name.split('.')), result.reason
        assert type(scene.plain(node.get_parameter(name).value)) is type(before[name])
        back = Parameter(name, Parameter.Type[node.fields[name].kind.upper()], before[name])
        assert node.fields[name].read_only or node.set_parameters([back])[0].successful
        # A value that follows from others stays what it was set to.
        assert values_of(node) == before, name
    assert client.about(names) == about
    assert len(names) * len(hostile) > least


@pytest.mark.parametrize('kind', KINDS)
def test_every_parameter_is_described_as_the_scene_has_it(graph, kind):
    whole, node = scene.read(EVERYTHING), graph.start(kind, EVERYTHING)
    own = [one for one in whole.parameters if node.get_name() == one.field.owner]
    names = [one.name for one in own]
    assert sorted(names) == sorted(node.fields) == sorted(
        name for name in node.get_parameters_by_prefix('') if name != 'use_sim_time'
        and not name.startswith(('start_type', 'qos_overrides')))
    abouts, types = Client(graph, node).about(names)
    assert len(abouts) == len(types) == len(own)
    for one, about, type_ in zip(own, abouts, types):
        kind, ends = Parameter.Type[one.field.kind.upper()].value, one.field.ends
        assert scene.plain(node.get_parameter(one.name).value) == one.value
        assert type_ == kind
        assert about == msg.ParameterDescriptor(
            name=one.name, type=kind, description=one.field.meaning, dynamic_typing=True,
            additional_constraints=one.field.allowed, read_only=one.field.read_only,
            integer_range=[msg.IntegerRange(from_value=ends[0], to_value=ends[1], step=1)]
            if ends and one.field.kind == 'integer' else [],
            floating_point_range=[msg.FloatingPointRange(from_value=ends[0], to_value=ends[1])]
            if ends and one.field.kind == 'double' else [])


def test_names_and_types_that_there_are_not_are_refused(graph):
    client = Client(graph, graph.start(Kinematics, LEG))
    odd = msg.Parameter(name='leg.scale', value=msg.ParameterValue(type=200))
    results = client.call('set_parameters', [
        odd, *[_message(name, 1.0) for name in ('', 'leg', 'leg.', '.', 'nobody', 'x' * 10 ** 6)],
        _message('leg.crank.speed', 2.0), _message('leg.scale', 3.0)]).results
    assert [r.successful for r in results] == [False] * 8 + [True]
    assert all(0 < len(r.reason) < 600 for r in results[:8])
    together = client.call('set_parameters_atomically', [
        _message('leg.scale', 4.0), _message('nobody', 1.0)]).result
    assert not together.successful
    assert 'nobody is not a parameter of /kinematics' in together.reason
    assert client.call('describe_parameters', ['leg.scale', 'nobody']).descriptors == []


# Every list that may be empty.
EMPTY = 'leg.loads', 'leg.joint_names', 'leg.crank.sweep'


@pytest.mark.parametrize('by_file', [True, False])
def test_an_empty_list_in_a_parameter_file_or_argument_is_one_of_its_type(
        graph, tmp_path, by_file):
    values = {**LEG, **dict.fromkeys(EMPTY, [])}
    path = tmp_path / 'scene.yaml'
    path.write_text(json.dumps({'/**': {'ros__parameters': values}}))
    given = ['--params-file', str(path)] if by_file else [
        word for name, value in values.items() for word in ('-p', f'{name}:={json.dumps(value)}')]
    for kind in (CrankDriver, ServoInverse):
        follower = graph.start(kind, cli_args=['--ros-args', *given])
        assert not any(map(follower.has_parameter, EMPTY))
        assert {p.value for p in follower.scene.parameters if p.name in EMPTY} == {()}
    node = graph.start(Kinematics, cli_args=['--ros-args', *given])
    for name in EMPTY:
        parameter = node.get_parameter(name)
        assert parameter.type_ == Parameter.Type[node.fields[name].kind.upper()], name
        assert scene.plain(parameter.value) == ()
    client = Client(graph, node)
    assert [*client.about(EMPTY)[1]] == [node.get_parameter(name).type_.value for name in EMPTY]
    assert client.set(('leg.crank.sweep', [0.0, 1.0]))[0].successful
    assert client.set(('leg.crank.sweep', []))[0].successful


@pytest.mark.parametrize('name, allowed', [
    ('mechanisms', 'a list of texts'), ('leg.points', 'some of'), ('leg.pose', 'six of them'),
    ('leg.scale', 'a finite number'), ('leg.type', 'one of water_drop'), ('leg.own', 'allowed')])
def test_where_no_list_may_be_empty_one_is_refused_in_words(graph, name, allowed):
    values = {'mechanisms': '[leg]', 'leg.type': 'jansen', name: '[]'}
    arguments = [word for key, value in values.items() for word in ('-p', f'{key}:={value}')]
    with pytest.raises(scene.SceneError, match=f'^{name} .*{allowed}'):
        graph.start(Kinematics, cli_args=['--ros-args', *arguments])


def test_the_parameters_of_another_scene_can_be_loaded_in_one_request(graph):
    """One by one most of these cannot be: a leg of mixed sizes cannot be assembled."""
    node = graph.start(Kinematics, LEG)
    values = [(name, 100.0 * parameter.value) for name, parameter in
              node.get_parameters_by_prefix('').items() if '.dimensions.' in name]
    alone = node.set_parameters([Parameter(values[0][0], value=values[0][1])])[0]
    assert not alone.successful
    results = Client(graph, node).set(*values, ('leg.crank.speed', 1.0), ('leg.scale', 0.01))
    assert [r.successful for r in results] == [True] * 13 + [False, True]
    assert node.scene.mechanisms['leg'].linkage.dimensions['m'] == 1500.0


class Slow(nodes.SceneNode):
    """A node whose scenes take their time, and that counts what it does."""

    def __init__(self, **kwargs):
        super().__init__(scene.KINEMATICS, **kwargs)
        self.begun, self.prepared, self.adopted = [], [], []
        self.free = threading.Event()
        self.free.set()
        self.begin()

    def check(self, new):
        """Refuse a scale of 1300."""
        if new.mechanisms['leg'].scale == 1300.0:
            raise scene.SceneError('leg.scale must not be 1300')

    def prepare(self, new):
        """Wait until it may go on; with a negative offset that is a mistake."""
        1 // (new.mechanisms['leg'].first.offset >= 0.0)
        self.begun.append(new)
        self.free.wait(60.0)
        self.prepared.append((threading.current_thread(), new.mechanisms['leg'].scale))
        return new

    def adopt(self, new):
        """Note what is adopted."""
        self.adopted.append((threading.current_thread(), new.mechanisms['leg'].scale))


def held_up(graph, client):
    """Let the worker of a node be busy with a scene."""
    client.about(['leg.scale'])
    node = client.node
    node.free.clear()
    begun = len(node.begun)
    assert client.set(('leg.scale', 1.5))[0].successful
    graph.until(lambda: len(node.begun) > begun)


def test_a_change_is_answered_and_messages_are_handled_while_a_worker_prepares_it(graph):
    node = graph.start(Slow, LEG)
    client, ticks = Client(graph, node), []
    node.create_timer(0.01, lambda: ticks.append(0))
    held_up(graph, client)
    seen = len(ticks)
    graph.until(lambda: len(ticks) > seen + 20)
    assert node.get_parameter('leg.scale').value == 1.5
    assert not node.is_settled and node.adopted[-1][1] == 1.0
    node.free.set()
    graph.until(lambda: node.is_settled)
    assert node.prepared[-1][0] is not threading.main_thread()
    assert node.adopted[-1] == (threading.main_thread(), 1.5)


def test_of_a_hundred_changes_each_is_answered_and_the_newest_prepared_and_announced(graph):
    announced = graph.listen(msg.ParameterEvent, ownership.TOPIC, ownership.LATCHED)
    node = graph.start(Slow, LEG)
    client = Client(graph, node)
    held_up(graph, client)
    begun = len(node.begun)
    for number in range(50):
        assert client.set(('leg.scale', 2.0 + number))[0].successful
        assert node.get_parameter('leg.scale').value == 2.0 + number
    results = client.set(*[('leg.scale', 52.0 + number) for number in range(50)])
    assert [result.successful for result in results] == [True] * 50
    node.free.set()
    graph.until(lambda: node.is_settled)
    assert node.adopted[-1][1] == 101.0 and len(node.begun) == begun + 1
    # First all parameters, then the scale that held up the worker, and the last one.
    graph.until(lambda: len(announced) > 2)
    assert [one.value.double_value for event in announced for one in event.changed_parameters] == [
        1.5, 101.0]


def test_a_changed_scene_is_prepared_before_what_else_is_queued(graph):
    node = graph.start(Slow, LEG)
    client, begun = Client(graph, node), []
    held_up(graph, client)
    node.worker.queue('a locus', lambda: begun.append(len(node.begun)))
    assert client.set(('leg.scale', 2.0))[0].successful
    node.free.set()
    graph.until(lambda: begun)
    assert begun == [len(node.begun)] and node.begun[-1].mechanisms['leg'].scale == 2.0


def test_each_of_many_sets_gets_its_own_answer(graph):
    node = graph.start(Slow, LEG)
    changes = [('leg.scale', 2), ('leg.scale', -1.0), ('leg.scale', 'wide'),
               ('leg.branches.C', 7), ('frame_id', 'map'), ('leg.type', 'klann'),
               ('leg.pose', None)]
    client = Client(graph, node)
    results = client.set(*changes)
    # Each value is valid by itself or not; the valid ones are set together or not at all.
    assert [r.successful for r in results] == [True, False, False, False, True, False, False]
    for (name, _), result in zip(changes[:-2], results):
        assert result.successful or result.reason.startswith(f'{name} must')
    assert 'read-only parameter: leg.type' in results[-2].reason
    assert results[-1].reason.startswith('leg.pose cannot be removed; it must be a list of')
    before, scale = node.scene, node.get_parameter('leg.scale')
    assert (scale.type_, scale.value) == (Parameter.Type.DOUBLE, 2.0)
    assert (before.mechanisms['leg'].scale, before.frame_id) == (2.0, 'map')
    for other in ('leg.loads', ['Z=1 2']), ('leg.scale', 1300.0):
        results = client.set(('frame_id', 'odom'), ('leg.scale', -1.0), other)
        assert [r.successful for r in results] == [False] * 3 and node.scene is before
        assert [r.reason.partition(' must')[0] for r in results] == [
            other[0], 'leg.scale', other[0]]


@pytest.mark.parametrize('executor', [SingleThreadedExecutor, nodes.Executor])
def test_messages_are_handled_between_requests_that_come_at_once(executor):
    with Graph(executor=executor) as graph:
        node, handled = graph.start(Slow, LEG), []

        def again(_):
            """Note that a message is handled, and publish the next one."""
            handled.append(None)
            crank.publish(JointState(name=['leg_crank']))

        node.create_subscription(JointState, 'crank_states', again, 1)
        client, crank = Client(graph, node), graph.publisher(JointState, 'crank_states', 1)
        assert client.set(('leg.scale', 0.5))[0].successful
        node.add_post_set_parameters_callback(lambda changed: handled.append(changed[0].value))
        # The last one is refused.
        expected = [1.0 + 0.01 * i for i in range(50)]
        for value in [*expected, -1.0]:
            client.services.set_parameters([_message('leg.scale', value)])
        crank.publish(JointState(name=['leg_crank']))
        graph.until(lambda: expected[-1] in handled and node.is_settled)
    assert [value for value in handled if value is not None] == expected
    between = handled[handled.index(expected[0]):handled.index(expected[-1])]
    # Jazzy's EventsExecutor awaits no service.
    if executor is SingleThreadedExecutor or not version('rclpy').startswith('7.'):
        assert between.count(None) > 10
        # The start, the first request, and the last: as long as others wait, nothing is prepared.
        # The plain executor takes a request only after it has answered the one before.
        assert executor is SingleThreadedExecutor or len(node.begun) < 6


def test_a_mistake_while_a_scene_is_prepared_leaves_the_one_before(graph):
    logged = graph.log()
    node = graph.start(Slow, LEG)
    client = Client(graph, node)
    for scale in (-2.0, -3.0):
        assert client.set(('leg.crank.offset', scale))[0].successful
        graph.until(lambda: any('ZeroDivisionError' in one.msg for one in logged))
    assert node.adopted[-1][1] == 1.0
    assert client.set(('leg.crank.offset', 0.0))[0].successful
    assert client.set(('leg.scale', 4.0))[0].successful
    graph.until(lambda: node.is_settled)
    assert node.adopted[-1][1] == 4.0


@pytest.mark.parametrize('refused', [
    ('leg.type', 'klann'), ('leg.crank.source', 'shaft'), ('leg.scale', -1.0),
    ('leg.dimensions.m', 900.0), ('leg.nobody', 1.0), ('use_sim_time', 3)])
def test_what_was_refused_keeps_nothing_from_being_accepted(graph, refused):
    node = graph.start(Kinematics, LEG)
    client = Client(graph, node)
    for scale in (2.0, 3.0):
        bad = client.set(refused)[0]
        assert not bad.successful and bad.reason
        # A parameter that somebody declares later is none of the scene's business.
        node.declare_parameter(f'own{scale:g}', 1.0)
        assert client.set(('leg.scale', scale))[0].successful
        assert node.scene.mechanisms['leg'].scale == scale
    # The same objects once more, though others were set meanwhile.
    both = [Parameter('use_sim_time', value=False), Parameter('leg.scale', value=5.0)]
    for scale in (5.0, 3.0):
        assert node.set_parameters_atomically(both).successful
        assert node.scene.mechanisms['leg'].scale == 5.0
        assert client.set(('leg.scale', scale))[0].successful
    together = client.call('set_parameters_atomically', [
        _message('leg.scale', 4.0), _message(*refused)]).result
    node.declare_parameter('own', 1.0)
    assert not together.successful and node.scene.mechanisms['leg'].scale == 3.0


def test_what_others_have_to_say_about_a_parameter_counts(graph):
    node = graph.start(Slow, LEG)
    node.add_on_set_parameters_callback(lambda parameters: msg.SetParametersResult(
        successful=not any(p.name == 'leg.scale' for p in parameters), reason='not by me'))
    results = Client(graph, node).set(('leg.scale', 2.0), ('leg.points', ['G']))
    assert [(r.successful, r.reason) for r in results] == [(False, 'not by me')] * 2
    assert node.scene.mechanisms['leg'].scale == 1.0


def test_a_node_ends_while_its_worker_is_busy(graph):
    threads = {*threading.enumerate()}
    node = graph.start(Slow, LEG)
    held_up(graph, Client(graph, node))
    prepared, adopted, turned = len(node.prepared), [*node.adopted], []
    node.destroy_node()
    assert len(node.prepared) == prepared
    node.free.set()
    graph.until(lambda: {*threading.enumerate()} <= threads)
    # What the worker gave to the executor comes before this, and is dropped.
    graph.executor.create_task(turned.append, 0)
    graph.until(lambda: turned)
    assert len(node.prepared) > prepared and node.adopted == adopted
