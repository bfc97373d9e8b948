# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The viewer: what its page is sent, and what requests of the page do to the nodes."""

import gc
import itertools
import json
import math

from browser import until
from linkage_ros import mechanisms, scene
from linkage_ros.c_code import header
from linkage_ros.nodes import ownership
from linkage_ros.nodes.crank_driver import CrankDriver
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.robot_model import urdf
from linkage_ros.scene import slider
from linkage_ros.web import curves, scene_view
from linkage_ros.web.feed import Feed
from linkage_ros.web.scene_view import LATCHED
import numpy as np
import pytest
from rcl_interfaces.msg import Parameter as ParameterMessage, ParameterEvent, ParameterValue
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState
from test_reading import held
from truth.working_modes import lever_of
from viewer_harness import framed, LEG, LEVER, NODES, Page, parts, RATE, resident, spoilt, walker
from visualization_msgs.msg import Marker, MarkerArray
import yaml


def markers_of(text):
    """Return the markers of a message."""
    return deserialize_message(text, MarkerArray).markers


def test_every_setting_is_described_as_the_scene_has_it(page):
    shown, whole = page.mechanisms('/lever', '/drop'), scene.read(LEVER)
    groups = {'crank.speed': 'speeds', 'crank.start': 'starts', 'branches.L': 'branches',
              **{f'dimensions.{key}': 'dimensions' for key in 'abe'},
              **dict.fromkeys(('scale', 'crank.ratio', 'crank.offset', 'only_named'), 'more')}
    assert {key: (about['key'], about['name']) for key, about in shown.items()} == {
        '/lever': ('/lever', 'lever'), '/drop': ('/drop', 'drop')}
    settings = {f'{about["name"]}.{setting["name"]}': setting
                for about in shown.values() for setting in about['settings']}
    assert settings == {parameter.name: {
        'name': name, 'value': list(value) if isinstance(value, tuple) else value,
        'kind': field.kind, 'meaning': field.meaning, 'allowed': field.allowed,
        'unit': field.unit, 'group': groups.get(name, '')}
        for parameter in whole.parameters if '.' in parameter.name
        for name, field, value in [(
            parameter.name.partition('.')[2], parameter.field, parameter.value)]}


def test_a_slider_sets_the_node_that_owns_the_parameter_and_others_changes_are_shown(show):
    running = show(LEG)
    page = running.page()
    first = page.mechanisms('/leg')['/leg']
    assert page.set('/leg', leg_pairs=3) == page.set('/leg', crank__speed=-2.5) == ''
    more = page.setting('/leg', 'leg_pairs', 3)
    page.setting('/leg', 'crank.speed', -2.5)
    assert (running.value('leg.leg_pairs'), running.value('leg.crank.speed')) == (3, -2.5)
    assert page.set('/leg', crank__speed=0.0) == ''
    # It plays as fast as before, from a file too.
    assert running.page().mechanisms('/leg')['/leg']['inputs']['crank']['speed'] == -2.5
    saved = page.ask('export', key='/leg', form='yaml')['text']
    assert 'leg.crank.speed: -2.5\n' in saved and 'leg.leg_pairs: 3\n' in saved
    assert 'leg_left2_' in page.ask('export', key='/leg', form='urdf')['text']
    running.set('leg.mirrored', True)
    both = page.setting('/leg', 'mirrored', True)
    assert [told['legs'] for told in (first, more, both)] == [[0], [0, 1, 2], [0, 0, 1, 1, 2, 2]]


def test_announcements_that_make_no_sense_change_nothing(graph, show):
    page = show(LEVER).page()
    publisher = graph.node.create_publisher(ParameterEvent, ownership.TOPIC, ownership.LATCHED)
    odd = [ParameterMessage(name='lever.scale', value=ParameterValue(type=200)), *(
        Parameter(name, value=value).to_parameter_msg() for name, value in (
            ('lever.scale', 'wide'), ('mechanisms', [b'l']), ('', 1.0), ('lever.crank.speed', 3),
            ('lever.list', [1.0, math.inf]), ('lever.nan', math.nan), ('lever.bytes', [b'a'])))]
    for node in ('', '/nobody', 'x' * 1000, '/tester'):
        for values in (odd, *([value] for value in odd)):
            publisher.publish(ParameterEvent(node=node, new_parameters=values))
    publisher.publish(ParameterEvent(node='/crank_driver', changed_parameters=[
        Parameter('lever.crank.speed', value=3.25).to_parameter_msg()]))
    page.setting('/lever', 'crank.speed', 3.25)
    assert page.set('/lever', dimensions__b=152.0) == ''
    page.setting('/lever', 'dimensions.b', 152.0)
    json.dumps(page.messages, allow_nan=False)
    answer = page.pose('/lever')
    assert answer['reason'] == '' and 'crank' in answer['inputs']


TWO_ARCS = {**RATE, 'mechanisms': ['bar'], 'bar.type': 'four_bar', 'bar.crank.start': 1.0,
            **{f'bar.dimensions.{name}': length
               for name, length in zip('abcd', (3.0, 2.0, 2.5, 3.0))}}


def test_an_input_goes_again_to_where_it_started_though_that_is_a_middle_or_an_end(graph, show):
    cranks, page = graph.listen(JointState, 'crank_states'), show(TWO_ARCS).page()
    arcs = scene.read(TWO_ARCS).mechanisms['bar'].first.arcs

    def away(value):
        states = dict(zip(cranks[-1].name, cranks[-1].position)) if cranks else {}
        return abs(math.remainder(states.get('bar_crank', math.nan) - value, math.tau))

    for value in (sum(arc) / 2.0 for arc in arcs for _ in range(2)):
        assert page.pose('/bar', output='crank', value=value)['reason'] == ''
        until(lambda value=value: away(value) < 1e-9, value)
        assert page.set('/bar', crank__speed=1.0) == ''
        until(lambda value=value: away(value) > 0.01)
    for value in (end for arc in arcs for end in arc for _ in range(2)):
        assert page.pose('/bar', output='crank', value=value)['reason'] == ''


def test_an_input_at_its_end_stays_there_though_its_source_rounds_beyond_it(show):
    low = 1.6
    page = show({**RATE, 'mechanisms': ['bar'], 'bar.type': 'five_bar', 'bar.crank.start': low,
                 'bar.crank.sweep': [low, 2.2], 'bar.crank.speed': 0.0, 'bar.crank.ratio': 0.7,
                 'bar.crank.offset': 10.0, 'bar.crank2.start': 1.24}).page()
    until(lambda: page.pose('/bar')['inputs']['crank'] < low)
    for value in (1.25, 1.26, 1.27):
        assert page.pose('/bar', output='crank2', value=value)['reason'] == ''


def test_the_page_learns_how_far_dimensions_go_and_which_bars_follow(page):
    whole = scene.read(LEVER)
    for name, fixed, bars in (
            ('lever', 'OQ', {'a': ['OA'], 'b': ['OQ', 'QL'], 'e': []}),
            ('drop', 'OC', {'a': 'OC OA AB AP BP CB'.split()})):
        answer = page.ask('tune', key=f'/{name}')
        mechanism = whole.mechanisms[name]
        ends = {parameter.name.partition('.')[2]: slider.ends(mechanism, parameter)
                for parameter in mechanism.parameters}
        assert {**answer, 'id': 0} == {
            'op': 'answer', 'id': 0, 'reason': '', 'fixed': list(fixed),
            'bars': {f'dimensions.{key}': [list(pair) for pair in pairs]
                     for key, pairs in bars.items()},
            'travel': {key: pair and list(pair) for key, pair in ends.items()}}


def test_what_is_saved_or_exported_is_the_mechanism_as_it_is(page):
    defined = {'lever.scale': 1.0, 'drop.scale': 1.0, **{
        parameter.name: parameter.value for parameter in scene.read(LEVER).parameters
        if '.dimensions.' in parameter.name}}
    saved = yaml.safe_load(page.ask('export', key='/drop', form='yaml')['text'])
    assert saved == {'/**': {'ros__parameters': {**LEVER, **defined}}}
    mechanism = scene.read(LEVER).mechanisms['lever']
    assert [page.ask('export', key='/lever', form=form)['text']
            for form in ('csv', 'urdf', 'h')] == [
        curves.table(mechanism, [0.0]), urdf.describe([mechanism], 'world'),
        header.written(mechanism)]


def test_the_page_is_sent_what_an_output_does_over_a_turn(page):
    units = [page.ask('curve', key='/lever', kind=kind)['units'] for kind in curves.KINDS]
    assert units == [['rad', unit] for unit in ('rad', 'rad/s', 'rad/s²', 'rad', '')]
    lever = page.ask('curve', key='/lever')
    assert len(lever['x']) == 361 and lever['ends'] == lever['dead'] == []
    np.testing.assert_allclose(lever['y'], list(map(lever_of, lever['x'])), atol=1e-12)
    # A kite lies flat at 0 and at pi: there it may be assembled in two ways.
    drop = page.ask('curve', key='/drop', kind='transmission angle')
    assert drop['dead'] == [-math.pi, 0.0] and drop['output'] == 'B'
    assert drop['y'][180] in (0.0, math.pi)


def test_nodes_that_come_later_or_in_a_namespace_are_waited_for_and_not_guessed(
        graph, show, monkeypatch):
    monkeypatch.setattr(scene_view, 'POLL_S', 0.1)
    monkeypatch.setattr(scene_view, 'MAX_ANNOUNCE_S', 0.4)
    # Whoever will announce its parameters there has not done so.
    graph.node.create_publisher(MarkerArray, 'leg/markers', 1)
    graph.node.create_publisher(Marker, 'leg/locus', LATCHED)
    graph.node.create_publisher(ParameterEvent, ownership.TOPIC, ownership.LATCHED)
    running = show({}, kinds=())
    page = running.page()
    assert [page.ask(op, key='/leg')['reason'] for op in ('pose', 'tune', 'curve')] == [
        "there is no mechanism '/leg'"] * 3
    parameters = {**LEG, 'leg.scale': 0.5, 'leg.frame_id': 'bench'}
    running.nodes.extend(graph.start(kind, parameters, namespace=space)
                         for kind in NODES for space in ('', 'robots/left'))
    page.mechanisms('/leg', '/robots/left/leg')
    g_x = 0.5 * mechanisms.create('jansen').solve(1.0, ('G',))['G'][0]
    for key in ('/leg', '/robots/left/leg'):
        assert page.pose(key)['outputs']['G.x']['value'] == pytest.approx(g_x)
        until(lambda key=key: len(page.drawn(key, 'joints')) and len(page.drawn(key, 'locus')))
    assert '<link name="bench" />' in page.ask('export', key='/leg', form='urdf')['text']
    assert page.set('/robots/left/leg', crank__speed=2.0) == ''
    assert sorted(running.values('leg.crank.speed')) == [0.0, 2.0]


def test_where_an_input_is_that_nobody_has_named_is_not_guessed(graph, show):
    page = show(LEG, kinds=(Kinematics,)).page()
    crank_states = graph.node.create_publisher(JointState, 'crank_states', 10)
    assert [page.ask(op, key='/leg', **more)['reason'] for op, more in (
        ('pose', {}), ('curve', {}), ('export', {'form': 'csv'}))] == [
        'the crank is not known yet: no message names leg_crank'] * 3
    assert page.ask('export', key='/leg', form='h')['reason'] == ''

    def inputs():
        crank_states.publish(JointState(name=['leg_crank'], position=[2.0]))
        return page.pose('/leg').get('inputs')

    assert until(inputs)['crank'] == pytest.approx(2.0)


def test_an_input_is_where_the_last_message_says(graph, show):
    running = show({**LEG, 'rate': 0.0})
    publisher = graph.node.create_publisher(JointState, 'crank_states', 10)
    page = running.page()

    def crank(**want):
        return page.pose('/leg', **want)['inputs']['crank']

    def after(angle):
        publisher.publish(JointState(name=['leg_crank'], position=[angle]))
        return crank()

    assert crank() == 1.0
    until(lambda: after(1.5) == 1.5)
    after(math.nan)
    assert after(math.inf) == 1.5
    before, others = held(running.viewer), [f'joint{number}' for number in range(500)]
    publisher.publish(JointState(name=['leg_crank', *others], position=[1.6] * 501))
    until(lambda: crank() == 1.6)
    assert held(running.viewer) < before + len(others)
    # A start moves an input only if it is another than before.
    for start in (2.0, math.nextafter(2.0, 0.0)):
        assert crank(output='crank', value=2.0) == 2.0
        page.setting('/leg', 'crank.start', start)
        assert running.value('leg.crank.start') == start
        assert running.value('leg.crank.speed') == 0.0


def test_a_node_that_does_not_answer_is_named(graph, show, monkeypatch):
    running = show(LEG)
    page = running.page()
    monkeypatch.setattr(scene_view, 'MAX_ANSWER_S', 0.1)
    graph.executor.remove_node(running.nodes[NODES.index(Kinematics)])
    # What the executor waits for already is answered once more.
    reason = '/kinematics/set_parameters_atomically does not answer'
    until(lambda: page.set('/leg', scale=2.0) == reason)
    assert page.set('/leg', scale=3.0) == reason and running.value('leg.scale') < 3.0


def test_a_browser_that_has_not_drawn_is_sent_no_more(show):
    running = show({**LEG, 'leg.crank.speed': 1.0, 'rate': 200.0})
    markers = running.graph.listen(MarkerArray, 'leg/markers')
    page = running.page(lazy=True)
    until(lambda: page.pictures)
    before = len(markers)
    until(lambda: len(markers) > before + 20)
    assert page.set('/leg', crank__speed=0.0) == ''
    assert page.pictures == 1
    page.send('"drawn"')
    until(lambda: page.pictures == 2)


def test_messages_that_cannot_be_read_are_dropped_and_said_once(show, capfd):
    # Without a crank, `kinematics` itself publishes no markers.
    running = show(LEG, kinds=(Kinematics,))
    markers, locus, events = (running.graph.node.create_publisher(*about) for about in (
        (MarkerArray, 'leg/markers', 1), (Marker, 'leg/locus', LATCHED),
        (ParameterEvent, '/parameter_events', 10)))
    pages = running.page(), running.page()

    def is_drawn(text):
        markers.publish(text)
        points = np.array(parts(markers_of(text)[-1].points[-1]), '<f4')
        return all((page.drawn('/leg', 'joints')[-1:] == points).any() for page in pages)

    for step, text in enumerate((b'', b'\0\1\0\0', walker(1)[:99], spoilt(1, math.nan))):
        until(lambda step=step: is_drawn(walker(step)))
        before = [page.pictures for page in pages]
        for publisher in (markers, locus, events):
            publisher.publish(text)
        until(lambda before=before: all(
            page.pictures > count for page, count in zip(pages, before)))
    until(lambda: is_drawn(walker(9)))
    log = capfd.readouterr().err
    assert log.count('a message on /leg/markers is dropped: ') == 1
    assert log.count('a message on /leg/locus is dropped: ') == 1
    assert 'Traceback' not in log


@pytest.mark.nightly
def test_nodes_that_end_and_come_again_are_drawn_again(graph, show):
    page = show({}, kinds=(CrankDriver,)).page()
    for parameters in (LEG, LEG, {**RATE, 'mechanisms': ['drop'], 'drop.type': 'water_drop'}):
        kinematics = graph.start(Kinematics, parameters)
        key = f'/{parameters["mechanisms"][0]}'
        until(lambda key=key: len(page.drawn(key, 'locus')))
        page.frames.clear()
        graph.end(kinematics)
        page.mechanisms()


@pytest.mark.nightly
def test_pages_that_come_and_go_leave_nothing_and_nobody_is_listened_to(show, monkeypatch):
    monkeypatch.setattr(scene_view, 'LINGER_S', 0.2)
    running = show(LEG)
    before, at_rest, node = 0.0, running.entities(), running.graph.node
    for turn in range(4):
        for _ in range(60):
            with Page(running.url) as page, Page(running.url) as other:
                until(lambda pages=(page, other): all(
                    len(one.drawn('/leg', 'joints')) for one in pages))
                assert running.entities()[0] >= at_rest[0] + 4
                assert node.count_subscribers('/leg/markers') == 1
        until(lambda: running.entities() == at_rest)
        until(lambda: node.count_subscribers('/leg/markers') == 0)
        # The tests collect garbage less often than a viewer does.
        gc.collect()
        before = resident() if turn == 1 else before
    assert resident() - before < 10.0


# --- frames: the markers that the page draws, from the bytes of any publisher ---

def frame_of(markers):
    """Return the frame of some markers, part by part, as the page reads it."""
    return [({'key': '/leg', 'topic': 'markers', 'markers': [
        {'kind': {Marker.LINE_LIST: 'lines', Marker.LINE_STRIP: 'locus', Marker.SPHERE_LIST:
                  'joints', Marker.TRIANGLE_LIST: 'triangles'}[marker.type],
         'piece': {Marker.LINE_LIST: 2, Marker.SPHERE_LIST: 1, Marker.TRIANGLE_LIST: 3}.get(
             marker.type, len(marker.points)), 'frame': marker.header.frame_id,
         'width': marker.scale.x, 'points': len(marker.points),
         'pose': [*parts(marker.pose.position), *parts(marker.pose.orientation)],
         'colour': parts(marker.color)} for marker in markers]}, [
             [list(map(np.float32, parts(point))) for point in marker.points]
             for marker in markers])]


def read(feed_):
    """Return the frame of a feed's newest message, part by part, as lists."""
    return [(head, [part.tolist() for part in points]) for head, points in framed(feed_.frame())]


@pytest.fixture
def topic():
    """Return the feed of a leg's markers, which logs nothing."""
    return Feed('/leg', '/leg/markers', MarkerArray, lambda text, subject: None)


def test_a_frame_has_the_markers_of_the_newest_message(topic):
    assert topic.frame() == b''
    for text in (walker(1), walker(2), walker(4, legs=1), walker(6, width=2.0),
                 walker(7, frame='\N{BLACK STAR}'), *2 * [walker(9) + bytes(3)]):
        topic.newest = text
        assert read(topic) == frame_of(markers_of(text))
        assert topic.frame() is topic.frame()


def test_of_a_message_what_is_deleted_or_no_line_joint_or_triangle_is_not_drawn(topic):
    message = deserialize_message(walker(1), MarkerArray)
    bars, joints = message.markers
    message.markers = [
        Marker(type=Marker.LINE_LIST, action=Marker.DELETE), joints, Marker(type=Marker.CUBE),
        bars, Marker(type=Marker.TRIANGLE_LIST),
        Marker(type=Marker.LINE_STRIP, points=bars.points)]
    topic.newest = serialize_message(message)
    assert read(topic) == frame_of([joints, bars, *message.markers[4:]])


@pytest.mark.parametrize('type_, id_, kind', [
    (Marker.LINE_LIST, 0, 'lines'), (Marker.LINE_LIST, 2, 'locus'), (Marker.LINE_LIST, 3, 'slots'),
    (Marker.TRIANGLE_LIST, 7, 'plates'), (Marker.TRIANGLE_LIST, 8, 'triangles')])
def test_lines_and_triangles_are_told_apart_by_their_ids(topic, type_, id_, kind):
    topic.newest = serialize_message(MarkerArray(markers=[Marker(type=type_, id=id_)]))
    (head, _), = read(topic)
    assert head['markers'][0]['kind'] == kind


@pytest.mark.parametrize('text', [
    b'', b'\0\1\0\0', b'\xff' * 64, walker(1)[:99], walker(1)[:4] + b'\xff' * 500, *(
        spoilt(part, number) for part in range(4) for number in (math.nan, -1e300))],
    ids=itertools.count())  # padding between fields is whatever was in memory
def test_of_what_cannot_be_drawn_nothing_stays(topic, text):
    for topic.newest in (walker(0), text, walker(2)):
        for head, points in framed(topic.frame()):
            json.dumps(head, allow_nan=False)
            assert all(np.isfinite(part).all() for part in points)
    assert read(topic) == frame_of(markers_of(walker(2)))
