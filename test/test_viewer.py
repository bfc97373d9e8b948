# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The viewer: what its page is sent, what its sliders do, and who may look."""

import asyncio
import cmath
import contextlib
import csv
import dataclasses
import gc
import io
import itertools
import json
import math
import os
from pathlib import Path
import re
import resource
import signal
import socket
import struct
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import yaml

aiohttp = pytest.importorskip('aiohttp')
pytest.importorskip('rclpy')
pytest.importorskip('linkage_interfaces')

import browser  # noqa: E402
from linkage_ros import mechanisms, palette, scene  # noqa: E402
from linkage_ros.c_code import header  # noqa: E402
from linkage_ros.nodes import messages, ownership  # noqa: E402
from linkage_ros.nodes.crank_driver import CrankDriver  # noqa: E402
from linkage_ros.nodes.kinematics import Kinematics  # noqa: E402
from linkage_ros.nodes.servo_inverse import ServoInverse  # noqa: E402
from linkage_ros.robot_model import urdf  # noqa: E402
from linkage_ros.scene import slider  # noqa: E402
from linkage_ros.scene.writing import without_defaults  # noqa: E402
from linkage_ros.web import (  # noqa: E402
    bridge,
    curves,
    poses,
    scene_view,
    server,
)
from linkage_ros.web.feed import Feed  # noqa: E402
from linkage_ros.web.scene_view import LATCHED  # noqa: E402
from linkage_ros.web.viewer import Viewer  # noqa: E402
from PIL import Image  # noqa: E402
from rcl_interfaces.msg import (  # noqa: E402
    Parameter as ParameterMessage,  # noqa: E402
    ParameterEvent,
    ParameterValue,
)
import rclpy  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from rclpy.serialization import deserialize_message, serialize_message  # noqa: E402
from ros_harness import Graph, Process  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from visualization_msgs.msg import Marker, MarkerArray  # noqa: E402

ROOT = Path(__file__).parents[1]
PAGE = ROOT / 'linkage_ros' / 'web' / 'page'
NODES = (CrankDriver, Kinematics, ServoInverse)
RATE = {'rate': 40.0}
LEVER = {**RATE, 'mechanisms': ['lever', 'drop'], 'lever.type': 'slotted_lever',
         'drop.type': 'water_drop'}
LEG = {**RATE, 'mechanisms': ['leg'], 'leg.type': 'jansen', 'leg.crank.speed': 0.0,
       'leg.crank.start': 1.0}

ENDS = aiohttp.WSMsgType.CLOSE, aiohttp.WSMsgType.CLOSING, aiohttp.WSMsgType.CLOSED

needs_browser = pytest.mark.skipif(
    not browser.found(), reason=f'none of {", ".join(browser.NAMES)} is installed')


def lever_of(servo, a=80.0, b=150.0):
    """Return the lever angle from the pin's place: the loop closure, written out."""
    return math.atan2(a * math.sin(servo), b + a * math.cos(servo))


# An excavator twice as large, in the middle of its strokes.
DOUBLE = {'scale': 2.0, **{
    f'{name}.{key}': value for name, ends in (
        ('boom', [1.6, 2.4]), ('arm', [1.88, 3.0]), ('bucket', [1.72, 2.6]))
    for key, value in (('sweep', ends), ('start', sum(ends) / 2.0))}}


def machine_of(name, **changed):
    """Return a mechanism of the examples with its values at the start, some changed."""
    given = without_defaults(scene.load(str(ROOT / 'config' / f'{name}.yaml')))
    key, = given['mechanisms']
    machine = scene.read({**given, **{f'{key}.{one}': value for one, value in changed.items()}})
    machine, = machine.machines.values()
    return machine, [drive.start for drive in machine.inputs.values()]


class Show:
    """The nodes of a scene and a viewer, at work in a thread of their own."""

    def __init__(self, graph, parameters, kinds=NODES, **kwargs):
        self.graph = graph
        self.viewer = graph.start(Viewer, {'port': 0})
        self.nodes = [graph.start(kind, parameters, **kwargs) for kind in kinds]
        self._over = threading.Event()
        self._thread = threading.Thread(
            target=graph.until, args=(self._over.is_set, math.inf), daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        self._thread.join()

    def values(self, name):
        """Return the value of a parameter on each node that has it."""
        return [node.get_parameter(name).value for node in self.nodes if node.has_parameter(name)]

    def value(self, kind, name):
        """Return the value of a parameter on the node of a kind."""
        node, = (node for node in self.nodes if isinstance(node, kind))
        return node.get_parameter(name).value

    def entities(self):
        """Return how many subscriptions and clients the viewer has."""
        return len(list(self.viewer.subscriptions)), len(list(self.viewer.clients))


@pytest.fixture
def show(graph):
    """Return a function that starts a scene with a viewer."""
    shows = []

    def start(parameters, kinds=NODES, before=lambda: None, **kwargs):
        before()
        shows.append(Show(graph, parameters, kinds, **kwargs).__enter__())
        return shows[-1]

    yield start
    for one in shows:
        one.__exit__()


@pytest.fixture(scope='module')
def lever():
    """Yield a show that no test changes."""
    with Graph() as graph, Show(graph, LEVER) as running:
        yield running


class Page:
    """What a browser knows, without the browser: the other end of the WebSocket."""

    def __init__(self, url, lazy=False, **kwargs):
        self._url = url.replace('http', 'ws') + 'socket'
        self._kwargs = kwargs
        self._lazy = lazy
        self._ids = itertools.count(1)
        self.said, self.frames, self.pictures = [], {}, 0
        self.end = None

    async def __aenter__(self):
        self._session = aiohttp.ClientSession()
        try:
            self.socket = await self._session.ws_connect(self._url, **self._kwargs)
        except BaseException:
            await self._session.close()
            raise
        self._reading = asyncio.ensure_future(self._read())
        return self

    async def __aexit__(self, *_):
        await self.socket.close()
        await self._reading
        await self._session.close()

    async def _read(self):
        while (message := await self.socket.receive()).type not in ENDS:
            if message.type == aiohttp.WSMsgType.TEXT:
                self.said.append(message.json())
            else:
                self._draw(message.data)
                if not self._lazy:
                    await self.socket.send_json({'op': 'drawn'})
        self.end = message.data, message.extra

    def _draw(self, data):
        self.pictures += 1
        for head, points in framed(data):
            self.frames[head['mechanism'], head['topic']] = head['markers'], points

    async def heard(self, op, **fields):
        """Return the first message that says this."""
        def said():
            return [m for m in self.said if {**m, 'op': op, **fields} == m]

        return (await browser.until(said, (op, fields)))[0]

    async def cast(self, *keys):
        """Return the mechanisms by key, when these are all there are, with settings."""
        def known():
            for said in reversed(self.said):
                if said['op'] == 'scene':
                    cast = {one['key']: one for one in said['mechanisms']}
                    return cast if set(cast) == set(keys) and all(
                        one['settings'] for one in cast.values()) else None

        return await browser.until(known, keys)

    async def shown(self, mechanism, name, value):
        """Wait until a parameter is shown with a value."""
        def known():
            for said in reversed(self.said):
                if said['op'] == 'scene':
                    return any(one['key'] == mechanism and setting['name'] == name
                               and setting['value'] == value
                               for one in said['mechanisms'] for setting in one['settings'])

        await browser.until(known, (mechanism, name, value))

    async def ask(self, op, mechanism, **fields):
        """Return the answer to a request."""
        number = next(self._ids)
        await self.socket.send_json({'op': op, 'mechanism': mechanism, 'id': number, **fields})
        return await self.heard('answer', id=number)

    async def set(self, mechanism, **values):
        """Set parameters, __ for a point; return the reason of a refusal, or nothing."""
        return (await self.ask('set', mechanism, values={
            name.replace('__', '.'): value for name, value in values.items()}))['reason']

    def forget(self):
        """Forget what was drawn."""
        self.frames, self.said = {}, []

    def drawn(self, mechanism, kind):
        """Return the points of a mechanism's markers of a kind."""
        return np.concatenate([np.empty((0, 3)), *(
            part for (key, _), (markers, points) in self.frames.items() if key == mechanism
            for marker, part in zip(markers, points) if marker['kind'] == kind)])


def framed(data):
    """Return header and points of each frame that the page is sent."""
    frames = []
    while data:
        end = 4 + int.from_bytes(data[:4], 'little')
        head = json.loads(data[4:end])
        counts = np.array([marker['points'] for marker in head['markers']], int)
        size = 12 * counts.sum()
        points = np.frombuffer(data[end:end + size], '<f4').reshape(-1, 3)
        frames.append((head, np.split(points, np.cumsum(counts)[:-1])))
        data = data[end + size:]
    return frames


def test_what_is_drawn_is_where_the_catalogue_says(show):
    async def look(url):
        async with Page(url) as page:
            await browser.until(lambda: len(page.drawn('/leg', 'joints')) and len(
                page.drawn('/leg', 'locus')))
            return page

    page = asyncio.run(look(show(LEG).viewer.url))
    leg = mechanisms.create('jansen')
    solved = leg.solve(1.0)
    joints = page.drawn('/leg', 'joints')
    np.testing.assert_allclose(
        joints[:, :2], [solved[point] for point in leg.points], rtol=1e-6, atol=1e-5)
    assert not joints[:, 2].any()
    # Bars, the crank among them, and two plates instead of the bars around them.
    ends = page.drawn('/leg', 'lines').reshape(-1, 2, 3)
    plates = page.drawn('/leg', 'plates').reshape(-1, 3, 3)
    lengths = np.concatenate([ends[:, 0] - ends[:, 1], *(plates - np.roll(plates, 1, axis=1))])
    np.testing.assert_allclose(np.sort(np.linalg.norm(lengths, axis=1)),
                               sorted(leg.bar_lengths[bar] for bar in leg.bars), rtol=1e-6)
    feet = leg.solve(np.linspace(0.0, math.tau, 721), ('G',))['G']
    curve = page.drawn('/leg', 'locus')[:, :2]
    away = np.linalg.norm(curve[:, None] - feet, axis=2).min(axis=1)
    assert len(curve) > 100 and away.max() < 0.01 * np.ptp(feet[:, 0])


def test_every_setting_is_described_as_the_scene_has_it(lever):
    async def look(url):
        async with Page(url) as page:
            return await page.cast('/lever', '/drop')

    cast, whole = asyncio.run(look(lever.viewer.url)), scene.read(LEVER)
    groups = {'crank.speed': 'speeds', 'crank.start': 'starts', 'branches.L': 'branches',
              **{f'dimensions.{key}': 'dimensions' for key in 'abe'},
              **dict.fromkeys(('scale', 'crank.ratio', 'crank.offset', 'only_named'), 'more')}
    assert {key: (one['key'], one['name']) for key, one in cast.items()} == {
        '/lever': ('/lever', 'lever'), '/drop': ('/drop', 'drop')}
    shown = {f'{one["name"]}.{setting["name"]}': setting
             for one in cast.values() for setting in one['settings']}
    assert shown == {one.name: {
        'name': one.name.partition('.')[2], 'value': value, 'kind': one.field.kind,
        'meaning': one.field.meaning, 'allowed': one.field.allowed, 'unit': one.field.unit,
        'low': low, 'high': high, 'group': groups.get(one.name.partition('.')[2], '')}
        for one in whole.parameters if '.' in one.name
        for value in [list(one.value) if isinstance(one.value, tuple) else one.value]
        for low, high in [slider.ends(whole, one) or (None, None)]}


EXAMPLES = [*sorted((ROOT / 'config').glob('*.yaml')), *sorted((ROOT / 'examples').glob('*.yaml'))]


@pytest.mark.parametrize('path', EXAMPLES, ids=lambda path: path.stem)
def test_the_page_is_told_what_it_draws_and_moves(path):
    for name, machine in scene.load(str(path)).machines.items():
        told = json.loads(json.dumps(poses.drawn(machine), allow_nan=False))
        legs = machine.assembly().legs
        assert told['legs'] == len(legs) and told['pairs'] == sum(
            leg.side > 0 for leg in legs.values())
        assert told['space'] == (machine.linkage.type == 'rods')
        assert told['points'] == list(machine.points)
        assert told['sides'].keys() == machine.linkage.branches.keys()
        default = scene.read({'mechanisms': [name], **{
            key: value for key, value in machine.values.items() if not key.endswith('.speed')}})
        assert told['inputs'].keys() == machine.inputs.keys()
        for key, drive in default.machines[name].inputs.items():
            assert told['inputs'][key]['speed'] == drive.speed != 0.0
            assert told['inputs'][key]['unit'] == ('rad' if drive.input.turns else 'm')
            turn = told['inputs'][key]['turn']
            assert (turn is not None) == drive.input.turns
            start = [one.start for one in machine.inputs.values()]
            other = [value + (turn or 0.0) * (one == key)
                     for one, value in zip(machine.inputs, start)]
            for joint, place in machine.linkage.solve(poses.theta_of(start)).items():
                np.testing.assert_allclose(
                    machine.linkage.solve(poses.theta_of(other))[joint], place, atol=1e-9)


@pytest.mark.parametrize('path', EXAMPLES, ids=lambda path: path.stem)
def test_the_unit_of_a_parameter_is_that_of_its_description(path):
    for one in scene.load(str(path)).parameters:
        said = re.findall(r'\[(.*?)\]', one.field.meaning)
        assert '{' not in one.field.meaning + one.field.unit
        if one.field.kind == 'double':
            assert one.field.unit == ''.join(said).replace('1', ''), one.name


def test_a_page_is_told_of_legs_that_are_added(show):
    async def use(url):
        async with Page(url) as page:
            first = (await page.cast('/leg'))['/leg']
            assert await page.set('/leg', leg_pairs=3) == ''
            said = await page.heard('value', name='leg_pairs', value=3)
            assert await page.set('/leg', mirrored=True) == ''
            return first, said['drawn'], (await page.heard(
                'value', name='mirrored', value=True))['drawn']

    first, more, both = asyncio.run(use(show(LEG).viewer.url))
    assert [(one['legs'], one['pairs']) for one in (first, more, both)] == [
        (1, 1), (3, 3), (6, 3)]


def test_a_slider_sets_the_node_that_owns_the_parameter(show):
    running = show(LEVER)

    async def use(url):
        async with Page(url) as page:
            await page.cast('/lever', '/drop')
            assert await page.set('/lever', dimensions__b=160) == ''
            assert await page.set('/lever', crank__speed=-2.5) == ''
            await page.heard('value', mechanism='/lever', name='dimensions.b', value=160.0)
            await page.heard('value', mechanism='/lever', name='crank.speed', value=-2.5)

    asyncio.run(use(running.viewer.url))
    assert running.value(Kinematics, 'lever.dimensions.b') == 160.0
    assert running.values('lever.crank.speed') == [-2.5]


@pytest.mark.parametrize('values, reason', [
    ({'dimensions__b': -150.0}, r'lever\.dimensions\.b .*-150'),
    ({'dimensions__b': 'long'}, 'lever.dimensions.b must be a finite number'),
    ({'dimensions__b': True}, 'lever.dimensions.b must be a finite number'),
    ({'dimensions__q': 1.0}, "lever has no parameter 'dimensions.q'"),
    ({'type': 'jansen'}, 'lever.type is no number, .*: use ros2 param set .*lever.type'),
    ({'points': ['L']}, 'lever.points is no number'),
    ({'dimensions__a': 10.0, 'dimensions__e': 700.0}, 'be assembled'),
    ({'branches__L': 5}, r'lever\.branches\.L'),
])
def test_a_refusal_says_why_and_changes_nothing(lever, values, reason):
    async def use(url):
        async with Page(url) as page:
            await page.cast('/lever', '/drop')
            return await page.set('/lever', **values)

    assert re.search(reason, asyncio.run(use(lever.viewer.url)))
    assert lever.values('lever.dimensions.a') == [80.0]
    assert lever.values('lever.dimensions.b') == [150.0]


def test_what_nobody_announces_is_not_on_the_page(graph, show):
    def other(**kwargs):
        node = rclpy.create_node('a_node', **kwargs)
        node.declare_parameter('lever.dimensions.b', 1.0)
        node.declare_parameter('lever.spring', 1.0)
        return node

    running = show(LEVER, before=lambda: graph.start(other))

    async def use(url):
        async with Page(url) as page:
            cast = await page.cast('/lever', '/drop')
            assert await page.set('/lever', dimensions__b=152.0) == ''
            return {one['name'] for one in cast['/lever']['settings']}

    assert 'spring' not in asyncio.run(use(running.viewer.url))
    assert running.value(Kinematics, 'lever.dimensions.b') == 152.0


def test_announcements_that_make_no_sense_change_nothing(graph, show):
    running = show(LEVER)
    publisher = graph.node.create_publisher(
        ParameterEvent, ownership.TOPIC, ownership.LATCHED)
    odd = [ParameterMessage(name='lever.scale', value=ParameterValue(type=200)), *(
        Parameter(name, value=value).to_parameter_msg() for name, value in (
            ('lever.scale', 'wide'), ('mechanisms', [b'l']), ('', 1.0), ('lever.crank.speed', 3),
            ('lever.list', [1.0, math.inf]), ('lever.nan', math.nan), ('lever.bytes', [b'a'])))]

    async def use(url):
        async with Page(url) as page:
            await page.cast('/lever', '/drop')
            for node in ('', '/nobody', 'x' * 1000):
                for part in (odd, *([one] for one in odd)):
                    publisher.publish(ParameterEvent(node=node, new_parameters=part))
            publisher.publish(ParameterEvent(node='/crank_driver', changed_parameters=[
                Parameter('lever.crank.speed', value=3.25).to_parameter_msg()]))
            await page.heard('value', mechanism='/lever', name='crank.speed', value=3.25)
            assert await page.set('/lever', dimensions__b=152.0) == ''
            await page.heard('value', mechanism='/lever', name='dimensions.b', value=152.0)
            json.dumps(page.said, allow_nan=False)
            return await page.ask('pose', '/lever')

    answer = asyncio.run(use(running.viewer.url))
    assert answer['reason'] == '' and 'crank' in answer['inputs']


@pytest.mark.slow
def test_what_every_node_is_given_is_of_the_node_that_reads_it(show):
    running = show({**LEG, 'leg.crank.speed': 1.0, 'rate': 30.0})
    driver, = (node for node in running.nodes if isinstance(node, CrankDriver))
    driver.set_parameters([Parameter('rate', value=20.0)])

    async def use(url):
        async with Page(url) as page:
            cast = await page.cast('/leg')
            assert await page.set('/leg', crank__speed=-2.5) == ''
            return cast['/leg']['settings'], (await page.ask('save', '/leg'))['text']

    settings_, saved = asyncio.run(use(running.viewer.url))
    speed, = (one for one in settings_ if one['name'] == 'crank.speed')
    assert (speed['low'], speed['high']) == (-100.0, 100.0) and '[rad/s]' in speed['meaning']
    assert running.value(CrankDriver, 'leg.crank.speed') == -2.5
    assert 'rate: 20.0' in saved


def test_a_change_that_somebody_else_makes_is_shown(show):
    running = show(LEVER)

    async def use(url):
        async with Page(url) as page:
            await page.cast('/lever', '/drop')
            for node in running.nodes:
                if node.has_parameter('drop.crank.speed'):
                    node.set_parameters([Parameter('drop.crank.speed', value=3.25)])
            await page.heard('value', mechanism='/drop', name='crank.speed', value=3.25)

    asyncio.run(use(running.viewer.url))


def test_a_dragged_lever_is_where_it_was_dragged_to_and_stays_there(show):
    running = show(LEVER)

    async def use(url):
        async with Page(url) as page:
            await page.cast('/lever', '/drop')
            answer = await page.ask('pose', '/lever', want={'output': 'lever', 'value': 0.4})
            assert answer['reason'] == ''

            def lever():
                joints = page.drawn('/lever', 'joints')
                return len(joints) and abs(math.atan2(
                    joints[1, 0] - joints[3, 0], joints[3, 1] - joints[1, 1]) - 0.4) < 1e-6

            await browser.until(lever)
            return answer

    answer = asyncio.run(use(running.viewer.url))
    servo, lever = answer['inputs']['crank'], answer['outputs']['lever']
    assert lever_of(servo) == pytest.approx(0.4, abs=1e-12)
    slope = (lever_of(servo + 1e-6) - lever_of(servo - 1e-6)) / 2e-6
    assert lever['rates'] == [pytest.approx(slope, abs=1e-8)]
    assert running.values('lever.crank.speed') == [0.0]
    assert running.values('lever.crank.start') == [servo]


TWO_ARCS = {**RATE, 'mechanisms': ['bar'], 'bar.type': 'four_bar', 'bar.crank.start': 1.0,
            **{f'bar.dimensions.{name}': length
               for name, length in zip('abcd', (3.0, 2.0, 2.5, 3.0))}}


@pytest.mark.parametrize('parameters', [LEVER, TWO_ARCS], ids=['whole', 'two arcs'])
def test_an_input_goes_again_to_where_it_started_though_that_is_a_middle_or_an_end(
        graph, show, parameters):
    cranks = graph.listen(JointState, 'crank_states')
    name, running = parameters['mechanisms'][0], show(parameters)
    arcs = poses.arcs(scene.read(parameters).machines[name].first)

    def away(value):
        states = dict(zip(cranks[-1].name, cranks[-1].position)) if cranks else {}
        return abs(math.remainder(states.get(f'{name}_crank', math.nan) - value, math.tau))

    async def use(url):
        async with Page(url) as page:
            async def hold(value):
                want = {'output': 'crank', 'value': value}
                assert (await page.ask('pose', f'/{name}', want=want))['reason'] == ''

            async def come_and_go(value):
                await hold(value)
                await browser.until(lambda: away(value) < 1e-9, value)
                assert await page.set(f'/{name}', crank__speed=1.0) == ''
                await browser.until(lambda: away(value) > 0.01)

            await browser.until(lambda: any(
                said['op'] == 'scene' and said['mechanisms'] for said in page.said))
            for arc in arcs:
                await come_and_go(sum(arc) / 2.0)
                await come_and_go(sum(arc) / 2.0)
            for end in (end for arc in arcs for end in arc):
                await hold(end)
                await hold(end)

    asyncio.run(use(running.viewer.url))


@pytest.mark.sample(1)
@pytest.mark.parametrize('lengths, sign', [
    ((80.0, 150.0, 0.0), 1.0), ((80.0, 150.0, 25.0), -1.0), ((1.0, 150.0, 0.0), 1.0)])
def test_a_lever_that_is_dragged_beyond_its_reach_goes_to_its_end(show, lengths, sign):
    running = show({**LEVER, **{f'lever.dimensions.{name}': length
                                for name, length in zip('abe', lengths)}})
    a, b, e = lengths
    end = sign * math.asin((a - sign * e) / b)

    async def use(url):
        async with Page(url) as page:
            await page.cast('/lever', '/drop')
            return [await page.ask(
                'pose', '/lever', want={'output': 'lever', 'value': sign * beyond})
                    for beyond in (2.0, 1.0)]

    for answer in asyncio.run(use(running.viewer.url)):
        assert answer['reason'].startswith('lever reaches [')
        assert answer['outputs']['lever']['value'] == pytest.approx(end, abs=1e-9)
        servo = running.values('lever.crank.start')[0]
        pin = 1j * a * cmath.exp(1j * servo) + 1j * b
        slot = cmath.phase(pin / 1j) - math.asin(e / abs(pin))
        assert slot == pytest.approx(end, abs=1e-9)


@pytest.mark.parametrize('mechanism, want, reason', [
    ('/gone', None, "no mechanism '/gone'; there are: /drop, /lever"),
    ('/drop', {'output': 'lever', 'value': 0.1}, "no output 'lever'"),
    ('/drop', {'joint': 'X', 'place': [0.0, 0.0]}, "joint must be one of .*, not 'X'"),
    ('/drop', {'joint': 'P', 'place': [0.0, 0.0], 'leg': 1}, 'leg must be a whole number below 1'),
    ('/drop', {'joint': 'P', 'place': [0.0]}, 'place must be two finite numbers'),
])
def test_what_cannot_be_brought_about_says_why(lever, mechanism, want, reason):
    async def use(url):
        async with Page(url) as page:
            await page.cast('/lever', '/drop')
            return (await page.ask('pose', mechanism, want=want))['reason']

    assert re.search(reason, asyncio.run(use(lever.viewer.url)))
    assert lever.values('lever.crank.speed') == [1.0]


@pytest.mark.slow
def test_any_joint_of_any_leg_is_brought_where_it_can_be(show):
    running = show({**RATE, 'mechanisms': ['walker'], 'walker.type': 'jansen',
                    'walker.leg_pairs': 3, 'walker.scale': 0.01})
    leg = mechanisms.create('jansen')
    # The second pair's right leg, and what its foot is asked to do.
    lag, theta = math.tau / 3, 2.0
    x, y = leg.solve(math.pi - (theta - lag), ('G',))['G'] * 0.01

    async def use(url):
        async with Page(url) as page:
            await page.cast('/walker')
            want = {'joint': 'G', 'leg': 3, 'place': [-x, y]}
            answer = await page.ask('pose', '/walker', want=want)

            def there():
                joints = page.drawn('/walker', 'joints')
                return len(joints) and abs(joints[4 * 8 - 1] - (-x, y, 0.0)).max() < 1e-6

            await browser.until(there)
            return answer

    crank = asyncio.run(use(running.viewer.url))['inputs']['crank']
    assert math.remainder(crank - theta, math.tau) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.slow
def test_what_is_saved_starts_the_tuned_scene_again(show, tmp_path):
    running = show({**LEVER, 'drop.pose': [0.0, 0.0, 0.5, 1.5, 0.0, 0.0]})

    async def use(url):
        async with Page(url) as page:
            await page.cast('/lever', '/drop')
            assert await page.set('/lever', **{'dimensions.a': 81.25, 'scale': 0.01}) == ''
            await page.heard('value', mechanism='/lever', name='scale', value=0.01)
            assert await page.set('/lever', crank__speed=2.0) == ''
            await page.heard('value', mechanism='/lever', name='crank.speed', value=2.0)
            await page.ask('pose', '/lever', want={'output': 'crank', 'value': 0.75})
            said = await page.heard('value', mechanism='/lever', name='crank.speed', value=0.0)
            assert said['drawn']['inputs']['crank']['speed'] == 2.0
            await page.heard('value', mechanism='/lever', name='crank.start', value=0.75)
        # Whoever opens the page again finds it stopped, and what it had before.
        async with Page(url) as page:
            lever = (await page.cast('/lever', '/drop'))['/lever']
            assert lever['inputs']['crank']['speed'] == 2.0
            return await page.ask('save', '/lever')

    file = tmp_path / 'tuned.yaml'
    file.write_text(asyncio.run(use(running.viewer.url))['text'])
    lever, drop = scene.load(str(file)).machines.values()
    assert (lever.linkage.dimensions['a'], lever.scale) == (81.25, 0.01)
    assert (lever.first.start, lever.first.speed) == (0.75, 2.0)
    assert drop.pose == (0.0, 0.0, 0.5, 1.5, 0.0, 0.0)
    assert scene.load(str(file)).rate == RATE['rate']
    # What defines a mechanism is there, what is as usual besides is not.
    assert 'lever.dimensions.b: 150.0' in file.read_text() and 'leg_pairs' not in file.read_text()


def test_the_page_learns_how_far_dimensions_go_and_which_bars_follow(lever):
    async def use(url):
        async with Page(url) as page:
            await page.cast('/lever', '/drop')
            return await page.ask('tune', '/lever'), await page.ask('tune', '/drop')

    whole = scene.read(LEVER)
    for found, name, fixed, bars in zip(
            asyncio.run(use(lever.viewer.url)), ('lever', 'drop'), ('OQ', 'OC'),
            ({'a': ['OA'], 'b': ['OQ', 'QL'], 'e': []}, {'a': 'OC OA AB AP BP CB'.split()})):
        assert {**found, 'id': 0} == {
            'op': 'answer', 'id': 0, 'reason': '', 'fixed': list(fixed),
            'bars': {f'dimensions.{key}': [list(pair) for pair in pairs]
                     for key, pairs in bars.items()},
            'travel': {one.name.partition('.')[2]: list(slider.ends(whole, one))
                       for one in whole.parameters
                       if one.name.startswith(f'{name}.dimensions.')}}


def test_a_bar_follows_a_dimension_that_can_only_become_shorter():
    # Longer, A, B and C are no triangle.
    bar = scene.read({'mechanisms': ['bar'], 'bar.type': 'custom', 'bar.dimensions.p': 4.0,
                      'bar.joints': ['O ground 0 0', 'Q ground 4 0', 'A crank O 1',
                                     'B dyad A Q 3 3 left', 'C rigid A B p 1 left']})
    assert poses.tunable(bar, 'bar')['bars'] == {'dimensions.p': [('A', 'C')]}


def test_a_saved_file_has_what_defines_the_scene_and_what_is_changed(lever):
    async def use(url):
        async with Page(url) as page:
            await page.cast('/lever', '/drop')
            return (await page.ask('save', '/drop'))['text']

    defined = {'lever.scale': 1.0, 'drop.scale': 1.0, **{
        one.name: one.value for one in scene.read(LEVER).parameters if '.dimensions.' in one.name}}
    assert yaml.safe_load(asyncio.run(use(lever.viewer.url))) == {'/**': {'ros__parameters': {
        **LEVER, **defined}}}


def test_what_is_exported_is_the_mechanism_as_it_is(lever):
    async def use(url):
        async with Page(url) as page:
            await page.cast('/lever', '/drop')
            return [(await page.ask('export', '/lever', form=form))['text']
                    for form in ('csv', 'urdf', 'c')]

    machine = scene.read(LEVER).machines['lever']
    table, *others = asyncio.run(use(lever.viewer.url))
    assert table == curves.exported(machine, [0.0], 'csv', '')
    assert others == [urdf.describe([machine], 'world'), header.written(machine)]


@pytest.mark.parametrize('name', ['excavator', 'jansen', 'peaucellier', 'scissor_lift'])
def test_a_table_has_every_quantity_of_every_output_in_its_unit(name):
    machine, present = machine_of(name, **{
        'excavator': DOUBLE, 'scissor_lift': {'scale': 2.0, 'carriage.start': 2.4}}.get(name, {}))
    present = [1.02 * value for value in present]
    heads, *rows = csv.reader(io.StringIO(curves.exported(machine, present, 'csv', 'world')))
    table, linkage = np.array(rows, float).T, machine.linkage
    input_, *others = linkage.inputs
    outputs = {joint: 'rad' if linkage.is_angle(joint) else 'm' for joint in linkage.joints
               if joint not in machine.inputs}
    outputs.update((f'{point}.{axis}', 'm') for point in linkage.points
                   if point not in linkage.grounded for axis in 'xy')
    ratio = {'mm': '1', 'radrad': '1', 'radm': 'N·m/N', 'mrad': 'N/(N·m)'}
    angles = {head.split()[2] for head in heads if head.startswith('transmission')}
    assert heads == [f'{input_.name} [{input_.unit}]', *(
        f'{kind} {output} [{unit}{per}]'
        for kind, per in (('position', ''), ('velocity', '/s'), ('acceleration', '/s²'))
        for output, unit in outputs.items()), *(
        f'transmission angle {joint} [rad]' for joint in linkage.transmission_angles(
            poses.theta_of([drive.start / machine.scale_of(key)
                            for key, drive in machine.inputs.items()]))), *(
        f'force ratio {output} [{ratio[unit + input_.unit]}]'
        for output, unit in outputs.items())]
    # Rounded, an end is outside the reach.
    x = table[0, 1:-1]
    own = [x / machine.scale_of(input_.name), *(
        value / machine.scale_of(other.name) for other, value in zip(others, present[1:]))]
    columns = dict(zip(heads, table[:, 1:-1]))
    truth = linkage.joint_angles(poses.theta_of(own), list(outputs))
    sharp = linkage.transmission_angles(poses.theta_of(own))
    for joint in angles:
        np.testing.assert_allclose(columns[f'transmission angle {joint} [rad]'], sharp[joint],
                                   rtol=1e-9, atol=1e-9)
    for output, unit in outputs.items():
        position, speed, change = (columns[f'{kind} {output} [{unit}{per}]'] for kind, per in (
            ('position', ''), ('velocity', '/s'), ('acceleration', '/s²')))
        size = machine.scale_of(output)
        np.testing.assert_allclose(position, size * truth[output], rtol=1e-9, atol=1e-9 * size)
        inner = slice(60, -60)
        for slope, values in ((speed, np.unwrap(position) if unit == 'rad' else position),
                              (change, speed)):
            np.testing.assert_allclose(np.gradient(values, x)[inner], slope[inner],
                                       rtol=1e-2, atol=1e-9 * max(1.0, np.abs(position).max())
                                       + 1e-2 * np.abs(slope[inner]).max())
        known = np.isfinite(speed) & (np.abs(speed) > 1e-9 * np.abs(position).max())
        force = columns[f'force ratio {output} [{ratio[unit + input_.unit]}]']
        np.testing.assert_allclose(force[known] * speed[known], 1.0, rtol=1e-9)


def test_the_page_is_sent_what_an_output_does_over_a_turn(lever):
    async def use(url):
        async with Page(url) as page:
            await page.cast('/lever', '/drop')
            return [await page.ask('curve', '/lever', kind=kind) for kind in curves.KINDS], [
                await page.ask('curve', '/drop', kind=kind) for kind in curves.KINDS[3:]]

    about_lever, about_drop = asyncio.run(use(lever.viewer.url))
    x, step = np.array(about_lever[0]['x']), 1e-4
    phi, before, after = (np.array([lever_of(theta + shift) for theta in x])
                          for shift in (0.0, -step, step))
    speed = (after - before) / (2.0 * step)
    slope = (after - 2.0 * phi + before) / step ** 2
    truth = phi, speed, slope, 0.5 * math.pi + 0.0 * x, 1.0 / speed
    for said, values in zip(about_lever, truth):
        y = np.array(said['y'], float)
        known = np.isfinite(y)
        assert known.sum() >= 357 and set(np.array(said['x'])[known]) <= set(x)
        np.testing.assert_allclose(y[known], values[np.isin(x, np.array(said['x'])[known])],
                                   rtol=2e-5, atol=2e-7)
    assert [said['units'][1] for said in about_lever] == ['rad', 'rad/s', 'rad/s²', 'rad', '']
    assert about_lever[0]['ends'] == about_lever[0]['dead'] == []
    # A kite lies flat at 0 and at pi: there it may be assembled in two ways.
    assert about_drop[0]['dead'] == [-math.pi, 0.0] and about_drop[0]['output'] == 'B'
    assert about_drop[0]['y'][180] in (0.0, math.pi)


def test_a_node_that_is_silent_at_first_is_waited_for_and_not_guessed(graph, show):
    # Whoever will announce its parameters there has not done so.
    graph.node.create_publisher(MarkerArray, 'leg/markers', 1)
    graph.node.create_publisher(Marker, 'leg/locus', LATCHED)
    graph.node.create_publisher(ParameterEvent, ownership.TOPIC, ownership.LATCHED)
    running = show({}, kinds=())

    async def use(url):
        async with Page(url) as page:
            await page.heard('scene', mechanisms=[])
            reasons = [(await page.ask(op, '/leg'))['reason'] for op in ('pose', 'tune', 'curve')]
            running.nodes.extend(graph.start(kind, {**LEG, 'leg.scale': 0.5}) for kind in NODES)
            await page.cast('/leg')
            return reasons, await page.ask('pose', '/leg')

    reasons, answer = asyncio.run(use(running.viewer.url))
    assert reasons == ["there is no mechanism '/leg'; there are: "] * 3
    g_x = 0.5 * mechanisms.create('jansen').solve(1.0, ('G',))['G'][0]
    assert answer['outputs']['G.x']['value'] == pytest.approx(g_x)


@pytest.mark.slow
def test_what_a_sensor_cannot_be_at_is_nowhere_on_the_page(show):
    lift = scene.load(str(ROOT / 'config' / 'scissor_lift.yaml'))
    running = show({**without_defaults(lift), 'rate': 0.0})
    crank_states = running.graph.node.create_publisher(JointState, 'crank_states', 10)

    async def use(url):
        async with Page(url) as page:
            async def carriage(told):
                crank_states.publish(JointState(name=['lift_cylinder'], position=[told]))
                value = (await page.ask('pose', '/lift'))['inputs']['carriage']
                assert math.isfinite(value)
                return value

            async def is_at(told, value):
                return abs(await carriage(told) - value) < 1e-9

            await page.cast('/lift')
            told, _ = lift.machines['lift'].to_source(lift.machines['lift'].first, 1.0, 0.0)
            await browser.until(lambda: is_at(told, 1.0))
            await browser.until(lambda: is_at(99.0, 1.2))

    asyncio.run(use(running.viewer.url))


@pytest.mark.parametrize('kind', ['velocity', 'acceleration'])
@pytest.mark.parametrize('name', ['excavator', 'jansen', 'scissor_lift'])
def test_arrows_are_how_the_joints_move_in_the_picture(name, kind):
    machine, = scene.load(str(ROOT / 'config' / f'{name}.yaml')).machines.values()
    starts = [drive.start for drive in machine.inputs.values()]
    speeds = {name: 0.1 * (2 + i) for i, name in enumerate(machine.inputs)}

    def places(time):
        own = [(start + time * speed) / machine.scale_of(name)
               for start, (name, speed) in zip(starts, speeds.items())]
        solved = machine.linkage.solve(poses.theta_of(own))
        return {joint: machine.scale * place for joint, place in solved.items()}

    found, h = poses.arrows(machine, starts, kind, speeds), 1e-4
    before, now, after = map(places, (-h, 0.0, h))
    assert found.keys() == {'unit', 'at'}
    assert found['unit'] == {'velocity': 'm/s', 'acceleration': 'm/s²'}[kind]
    assert set(found['at']) == set(machine.linkage.points) - set(machine.linkage.grounded)
    for joint, arrow in found['at'].items():
        slope = ((after[joint] - before[joint]) / (2.0 * h) if kind == 'velocity' else
                 (after[joint] - 2.0 * now[joint] + before[joint]) / h ** 2)
        assert arrow == pytest.approx(slope, rel=1e-4, abs=1e-6)


@pytest.mark.parametrize('name, input_, value, expected, reach', [
    ('excavator', 'arm', 1.1, 1.1, ''), ('twice', 'arm', 2.2, 2.2, ''),
    ('excavator', 'arm', 2.0, 1.5, 'arm reaches [0.94, 1.5] m'),
    ('excavator', 'boom', -2.0, 0.8, 'boom reaches [0.8, 1.2] m'),
    ('jansen', 'crank', 7.0, 7.0 - math.tau, ''), ('jansen', 'crank', -3.0, -3.0, ''),
    ('peaucellier', 'crank', 1.0 - math.tau, 1.0, ''),
    ('peaucellier', 'crank', 2.0, 1.171371086914302, 'crank reaches [-1.17137, 1.17137] rad'),
    ('scissor_lift', 'carriage', 0.1, 0.6, 'carriage reaches [0.6, 1.7] m')])
def test_an_input_goes_where_it_is_wanted_or_as_near_as_it_gets(
        name, input_, value, expected, reach):
    machine, present = (machine_of('excavator', **DOUBLE) if name == 'twice'
                        else machine_of(name))
    found, missed = poses.reached(machine, present, {'output': input_, 'value': value})
    assert dict(zip(machine.inputs, found)) == pytest.approx(
        {**dict(zip(machine.inputs, present)), input_: expected}, rel=1e-15)
    assert str(missed or '') == reach
    if missed:
        assert missed == poses.Reach(input_, tuple(poses.arcs(machine.inputs[input_])),
                                     machine.inputs[input_].input.unit)


GEARED = {'mechanisms': ['gear'], 'gear.type': 'custom', 'gear.joints': [
    'O ground 0 0', 'M crank O 0.01', 'A crank O 1 geared crank 1/5 0']}


@pytest.mark.parametrize('value', [4.0, -15.7, 12.6])
def test_a_geared_input_goes_where_it_is_wanted_in_all_of_its_period(value):
    gear = scene.read(GEARED).machines['gear']
    inputs, missed = poses.reached(gear, [0.0], {'output': 'crank', 'value': value})
    assert (inputs, missed) == ([value], None)
    # It can be set to start there.
    assert scene.read({**GEARED, 'gear.crank.start': value}).machines['gear'].first.start == value
    again, _ = poses.reached(gear, [0.0], {'output': 'crank', 'value': value + 10.0 * math.pi})
    assert again == pytest.approx([value], abs=1e-12)


def test_an_input_goes_to_the_nearest_of_two_arcs_and_not_where_nothing_can_be_assembled():
    bar = scene.read({'mechanisms': ['bar'], 'bar.type': 'four_bar', 'bar.crank.start': 1.0, **{
        f'bar.dimensions.{name}': length for name, length in zip('abcd', (3.0, 2.0, 2.5, 3.0))}})
    bar = bar.machines['bar']
    (low, _), (_, high) = bar.first.reach
    for value, expected in ((3.0, high), (-3.0, low), (3.5, low), (-0.5, None), (0.01, None)):
        (found,), reach = poses.reached(bar, [1.0], {'output': 'crank', 'value': value})
        ends = [abs(math.remainder(end - value, math.tau)) for arc in bar.first.reach
                for end in arc]
        inside = any(one <= value <= other for one, other in bar.first.reach)
        assert (reach is None) == inside
        assert abs(math.remainder(found - value, math.tau)) == pytest.approx(
            0.0 if inside else min(ends), abs=1e-12)
        assert expected is None or found == expected
    five, = scene.read({'mechanisms': ['five_bar']}).machines.values()
    with pytest.raises(poses.Refused, match='^five_bar cannot be assembled there$'):
        poses.reached(five, [1.9, 1.24], {'output': 'crank2', 'value': -1.9})


@pytest.mark.parametrize('name, changed, output, unit', [
    ('jansen', {'scale': 0.01}, 'G.x', 'm'), ('jansen', {}, 'EF', 'rad'),
    ('peaucellier', {'scale': 3.0}, 'C.y', 'm'), ('peaucellier', {}, 'PB', 'rad'),
    ('scissor_lift', {'scale': 2.0, 'carriage.start': 2.4}, 'P.y', 'm')])
def test_an_output_goes_where_it_is_wanted_or_to_the_end_of_its_reach(name, changed, output, unit):
    machine, present = machine_of(name, **changed)
    own, size = machine.scale_of(machine.first.input.name), machine.scale_of(output)

    def at(inputs):
        return size * machine.linkage.joint_angles(np.divide(inputs, own), [output])[output]

    (low, high), = machine.first.reach
    values = at(0.5 * (low + high - (high - low) * np.cos(np.linspace(0.0, math.pi, 20003)[1:-1])))
    values = np.unwrap(values) if unit == 'rad' else values
    ends = np.array([values.min(), values.max()])
    for part in (0.2, 0.5, 0.9):
        value = float(ends @ (1.0 - part, part))
        found, reach = poses.reached(machine, present, {'output': output, 'value': value})
        assert reach is None
        assert math.remainder(at(found)[0] - value, math.tau if unit == 'rad' else math.inf) == (
            pytest.approx(0.0, abs=1e-9))
    for end, beyond in zip(ends.tolist(), (np.ptp(ends) * np.array([-0.2, 0.2])).tolist()):
        found, reach = poses.reached(machine, present, {'output': output, 'value': end + beyond})
        assert (reach.name, reach.unit) == (output, unit)
        # Next to a dead point the last of the values is a little away from the end.
        np.testing.assert_allclose(np.ravel(reach.arcs), ends, atol=3e-4 * np.ptp(ends))
        assert math.remainder(at(found)[0] - end, math.tau if unit == 'rad' else math.inf) == (
            pytest.approx(0.0, abs=3e-4 * np.ptp(ends)))


@pytest.mark.parametrize('leg', range(6))
def test_a_joint_of_any_leg_goes_where_it_is_wanted_or_as_near_as_it_gets(leg):
    walker = scene.read({'mechanisms': ['walker'], 'walker.type': 'jansen', 'walker.leg_pairs': 3,
                         'walker.scale': 0.01}).machines['walker']

    def foot(crank):
        # A pair is behind the one before, and its right leg is the mirror image.
        own = crank - leg // 2 * math.tau / 3
        x, y = 0.01 * mechanisms.create('jansen').solve(
            math.pi - own if leg % 2 else own, ('G',))['G'].T
        return np.stack([-x if leg % 2 else x, y], -1)

    for crank in (0.4, 2.0, -1.7):
        want = {'joint': 'G', 'leg': leg, 'place': foot(np.array([crank]))[0].tolist()}
        (found,), reach = poses.reached(walker, [crank + 0.2], want)
        assert math.remainder(found - crank, math.tau) == pytest.approx(0.0, abs=1e-6)
        assert reach is None
    everywhere = foot(np.linspace(-math.pi, math.pi, 20001))
    for place in ([0.1, -1.5], [-0.9, -0.2]):
        (found,), _ = poses.reached(walker, [0.3], {'joint': 'G', 'leg': leg, 'place': place})
        assert math.dist(foot(np.array([found]))[0], place) == pytest.approx(
            np.linalg.norm(everywhere - place, axis=1).min(), rel=1e-6)


def test_a_joint_moved_by_several_inputs_goes_where_it_is_wanted_within_their_ends():
    digger, present = machine_of('excavator', **DOUBLE)
    within = [drive.ends for drive in digger.inputs.values()]

    def tip(inputs):
        return 2.0 * digger.linkage.solve(np.divide(inputs, 2.0), ('T',))['T']

    place = tip([2.1, 2.5, 2.0]).tolist()
    found, reach = poses.reached(digger, present, {'joint': 'T', 'place': place})
    assert tip(found).tolist() == pytest.approx(place, abs=1e-6) and reach is None
    far = poses.reached(digger, present, {'joint': 'T', 'place': [99.0, 0.0]})[0]
    assert all(low <= value <= high for value, (low, high) in zip(far, within))
    assert tip(far)[0] > max(tip(corner)[0] for corner in itertools.product(*within)) - 1e-6


def test_a_pose_of_several_inputs_is_described_whole():
    digger, present = machine_of('excavator', **DOUBLE)
    found, linkage = poses.described(digger, present), digger.linkage

    def at(inputs):
        angles = linkage.joint_angles(np.divide(inputs, 2.0), list(found['outputs']))
        return {name: value * (1.0 if linkage.is_angle(name) else 2.0)
                for name, value in angles.items()}

    assert found.keys() == {'inputs', 'outputs'}
    assert found['inputs'] == dict(zip(digger.inputs, present))
    assert list(found['outputs']) == [
        *(joint for joint in linkage.joints if joint not in digger.inputs), 'T.x', 'T.y']
    truth, h = at(present), 1e-6
    slopes = [[(at(np.add(present, step))[name] - at(np.subtract(present, step))[name]) / (2 * h)
               for step in h * np.eye(3)] for name in truth]
    for (name, about), slope in zip(found['outputs'].items(), slopes):
        assert about == {'value': pytest.approx(float(truth[name])),
                         'unit': 'rad' if linkage.is_angle(name) else 'm',
                         'rates': pytest.approx(slope, rel=1e-6, abs=1e-8)}


@pytest.mark.parametrize('scale', [1e-12, 1.0, 1e12])
def test_an_output_is_what_it_is_however_small_and_rounding_is_zero(scale):
    lift = without_defaults(scene.load(str(ROOT / 'config' / 'scissor_lift.yaml')))
    del lift['lift.carriage.start']
    machine = scene.read({**lift, 'lift.scale': scale}).machines['lift']
    at = 1.2
    outputs = poses.described(machine, [at * scale])['outputs']
    truth = machine.linkage.solve(at, ('P',))['P'] * scale
    assert [outputs[name]['value'] for name in ('P.x', 'P.y')] == pytest.approx(list(truth))
    assert outputs['P.x']['rates'] == [0.0] and abs(outputs['P.y']['rates'][0]) > 0.1


def test_arrows_of_force_are_the_loads_and_what_holds_them():
    machine = scene.read({'mechanisms': ['lever'], 'lever.type': 'slotted_lever',
                          'lever.loads': ['L=3 -4', 'lever=2']}).machines['lever']
    found = poses.arrows(machine, [0.5], 'force', {'crank': 1.0})
    effort, = machine.efforts([0.5])
    assert found == {'unit': 'N', 'at': {'L': (3.0, -4.0)}, 'efforts': {'crank': [effort, 'N·m']}}
    digger, = scene.load(str(ROOT / 'config' / 'excavator.yaml')).machines.values()
    present = [drive.start for drive in digger.inputs.values()]
    assert poses.arrows(digger, present, 'force', {}) == {'unit': 'N', 'at': {}, 'efforts': {}}
    loaded = dataclasses.replace(digger, loads={'T': (0.0, -9.0)})
    assert poses.arrows(loaded, present, 'force', {}) == {
        'unit': 'N', 'at': {'T': (0.0, -9.0)}, 'efforts': {
            name: [effort, 'N'] for name, effort in zip(digger.inputs, loaded.efforts(present))}}


@pytest.mark.parametrize('name, output', [
    ('excavator', 'T.y'), ('jansen', 'G.x'), ('peaucellier', 'PB'), ('peaucellier', 'C.y')])
def test_a_position_is_drawn_as_it_bends_even_next_to_a_dead_point(name, output):
    machine, = scene.load(str(ROOT / 'config' / f'{name}.yaml')).machines.values()
    present = [drive.start for drive in machine.inputs.values()]
    curve = curves.curve(machine, present, 'position', output)
    x, y = np.array(curve['x']), np.array(curve['y'], float)
    middle = 0.5 * (x[:-1] + x[1:])
    sizes = [machine.scale_of(key) for key in machine.inputs]
    inputs = [middle / sizes[0], *(value / size for value, size in zip(present[1:], sizes[1:]))]
    truth = machine.scale_of(output) * machine.linkage.joint_angles(
        inputs if len(inputs) > 1 else inputs[0], [output])[output]
    assert abs(truth - 0.5 * (y[:-1] + y[1:])).max() < np.ptp(y) / 500.0


def test_no_line_goes_through_a_pole():
    machine = scene.read({'mechanisms': ['slotted_lever']}).machines['slotted_lever']
    curve = curves.curve(machine, [0.3], 'force ratio', 'lever')
    x, y = np.array(curve['x']), np.array(curve['y'], float)
    turns = math.pi - math.acos(80.0 / 150.0)
    gaps = x[np.isnan(y)].reshape(2, 3)
    np.testing.assert_allclose(gaps[:, 1], [-turns, turns], atol=1e-3)
    assert np.ptp(gaps, axis=1).max() < 0.02
    assert (np.diff(x) >= 0.0).all()
    # Wherever two neighbours are joined, the ratio is of one sign.
    assert (y[:-1] * y[1:] < 0.0).sum() == 0


@pytest.mark.long
@pytest.mark.parametrize('path', sorted((ROOT / 'config').glob('*.yaml')), ids=lambda p: p.stem)
def test_a_saved_scene_names_all_that_defines_it_and_is_the_running_one(show, path, tmp_path):
    before = scene.load(str(path))
    running = show(without_defaults(before), kinds=(CrankDriver, Kinematics))

    async def use(url):
        async with Page(url) as page:
            await page.cast(*(f'/{name}' for name in before.machines))
            return (await page.ask('save', f'/{next(iter(before.machines))}'))['text']

    saved = tmp_path / 'saved.yaml'
    saved.write_text(asyncio.run(use(running.viewer.url)))
    assert scene.load(str(saved)).parameters == before.parameters
    given = set(yaml.safe_load(saved.read_text())['/**']['ros__parameters'])
    for name, machine in before.machines.items():
        assert {'mechanisms', f'{name}.type', f'{name}.scale', *(
            f'{name}.dimensions.{key}' for key in machine.linkage.dimensions)} <= given
    assert len(given) < len(before.parameters)


@pytest.mark.parametrize('text, answer', [
    ('90deg', {'value': math.pi / 2.0, 'turns': True}),
    ('pi/2', {'value': math.pi / 2.0, 'turns': True}),
    ('2*(3+4)', {'value': 14.0, 'turns': False}),
    ('1/0', 'must be 0 or between'), ('a+1', 'a is unknown'), ('__import__', 'not a number'),
    ('', 'not a number')])
def test_arithmetic_is_read_by_the_library(lever, text, answer):
    async def use(url):
        async with Page(url) as page:
            return await page.ask('read', '/lever', text=text)

    said = asyncio.run(use(lever.viewer.url))
    if isinstance(answer, str):
        assert answer in said['reason'] and 'value' not in said
    else:
        assert {**said, **answer} == said and said['reason'] == ''


@pytest.mark.slow
def test_nobody_is_listened_to_while_nobody_looks(show, monkeypatch):
    monkeypatch.setattr(scene_view, 'SECONDS_TO_LINGER', 0.2)
    running = show(LEG)
    at_rest = running.entities()

    async def use(url):
        assert running.graph.node.count_subscribers('/leg/markers') == 0
        async with Page(url) as first:
            await first.cast('/leg')
            async with Page(url) as second:
                await second.cast('/leg')
                await browser.until(lambda: first.pictures > 2 and second.pictures)
                assert running.graph.node.count_subscribers('/leg/markers') == 1
        await browser.until(lambda: running.entities() == at_rest)
        await browser.until(
            lambda: running.graph.node.count_subscribers('/leg/markers') == 0)
        async with Page(url) as again:
            await browser.until(lambda: again.pictures)

    asyncio.run(use(running.viewer.url))


@pytest.mark.slow
def test_a_browser_that_has_not_drawn_is_sent_no_more(show):
    running = show({**LEG, 'leg.crank.speed': 1.0, 'rate': 200.0})
    heard = running.graph.listen(MarkerArray, 'leg/markers')

    async def use(url):
        async with Page(url, lazy=True) as page:
            await page.cast('/leg')
            await browser.until(lambda: page.pictures)
            before = len(heard)
            await browser.until(lambda: len(heard) > before + 20)
            assert await page.set('/leg', crank__speed=0.0) == ''
            assert page.pictures == 1
            await page.socket.send_json({'op': 'drawn'})
            await browser.until(lambda: page.pictures == 2)

    asyncio.run(use(running.viewer.url))


def test_nodes_that_come_later_or_in_a_namespace_are_found(graph, show):
    running = show(LEG, kinds=())

    async def use(url):
        async with Page(url) as page:
            assert (await page.heard('scene'))['mechanisms'] == []
            running.nodes.extend(graph.start(kind, LEG, namespace='robots/left')
                                 for kind in (CrankDriver, Kinematics))
            await page.cast('/robots/left/leg')
            await browser.until(lambda: len(page.drawn('/robots/left/leg', 'joints')))
            await browser.until(lambda: 'crank.speed' in {
                one['name'] for m in page.said if m['op'] == 'scene'
                for cast in m['mechanisms'] for one in cast['settings']})
            assert await page.set('/robots/left/leg', crank__speed=2.0) == ''

    asyncio.run(use(running.viewer.url))
    assert running.values('leg.crank.speed') == [2.0]


NONSENSE = [
    '', '[]', 'null', '\x00', '{"op": 1}', '{"op": {}}', '["op"]', '[' * 60000, '{"a":' * 10000,
    '9' * 60000, '{"op": "drag", "angle": ' + '[' * 3000 + ']' * 3000 + '}', b'\xff\xfe', b'{}']


@pytest.mark.parametrize('text', NONSENSE, ids=range(len(NONSENSE)))
def test_nonsense_is_answered(lever, text):
    async def use(url):
        async with Page(url) as page:
            await (page.socket.send_bytes if isinstance(text, bytes) else page.socket.send_str)(
                text)
            answer = await page.heard('answer', id=None)
            assert 'the request is not understood: ' in answer['reason']
            assert 'unknown request' in (await page.ask('fly', '/lever'))['reason']

    asyncio.run(use(lever.viewer.url))


REQUESTS = [
    *(('set', {'values': {name: value}}, f'lever.{name} must be .*, not {shown}')
      for name, value, shown in (
        ('leg_pairs', '1e20', r'1e\+20'), ('leg_pairs', '1' + 20 * '0', r'1e\+20'),
        ('leg_pairs', 19 * '9', r'1e\+19'), ('leg_pairs', '-1e400', '-inf'),
        ('leg_pairs', 'true', 'True'), ('leg_pairs', '2.5', '2.5'),
        ('dimensions.a', 400 * '9', 'inf'), ('dimensions.a', 5000 * '9', 'inf'),
        ('dimensions.a', '1e400', 'inf'), ('dimensions.a', 'NaN', 'nan'),
        ('dimensions.a', '-Infinity', '-inf'), ('dimensions.a', '[[[1]]]', r'\[\[\[1\]\]\]'),
        ('dimensions.a', '{"a": NaN}', '{.*}'), ('dimensions.a', 'null', 'None'),
        ('dimensions.a', f'"{50000 * "x"}"', "'x*[.]{3}x*'$"))),
    ('set', {'values': {'points': '["O"]'}}, 'lever.points is no number'),
    ('set', {'values': {'crank.speed': '1e300'}}, '100'),
    ('set', {'values': {'crank.start': 17 * '9'}}, '12.566'),
    ('set', {'values': {50000 * 'x': '1'}}, "lever has no parameter 'x*[.]{3}x*'$"),
    ('set', {'values': {'\\ud800': '1'}}, 'lever has no parameter'),
    ('set', {'values': '3'}, 'not understood'), ('set', {'values': '[[[], 1]]'}, 'not understood'),
    ('set', {'values': '{}', 'mechanism': '{}'}, 'not understood'),
    ('set', {}, "not understood: it lacks 'values'"),
    *(('pose', {'want': {'output': '"crank"', 'value': value}}, 'value must be a finite number')
      for value in ('1e400', '-1e400', 'NaN', 400 * '9', 'true', '[1]', '"1"')),
    ('pose', {'want': '{}'}, "it lacks 'output'"), ('pose', {'want': '3'}, 'not understood'),
    ('pose', {'want': {'output': '[]', 'value': '1'}}, 'not understood'),
    ('pose', {'want': {'joint': '[]', 'place': '[1, 2]'}}, 'joint must be'),
    ('pose', {'want': {'joint': '"A"', 'up': '2'}}, 'not understood'),
    ('pose', {'mechanism': '[]'}, 'not understood'), ('tune', {'mechanism': '""'}, 'there is no'),
    ('save', {'values': '7'}, 'not understood'),
    ('curve', {'kind': '"speed"'}, "kind must be one of position, .* not 'speed'"),
    ('curve', {'output': '"Z.x"'}, "there is no position of 'Z.x'; there is of lever, "),
    ('curve', {'colour': '1'}, 'not understood'),
    ('export', {'form': '"pdf"'}, "form must be csv, urdf or c, not 'pdf'"),
    ('export', {}, "not understood: .* 'form'"),
    (50000 * 'x', {}, "unknown request 'x*[.]{3}x*'$"),
    ('pose', {'arrows': '"torque"'},
     '^pose is not understood: arrows must be one of velocity, acceleration, force, not '
     "'torque'$"),
    ('pose', {'arrows': '"velocity"', 'speeds': '{"crank": 1}'}, '^pose is not understood: '),
    ('set', {'values': {'crank.source': '"x"'}}, '^lever.crank.source is no number, and the page '
     'sets numbers only: use ros2 param set /[a-z_]+ lever.crank.source$'),
    ('set', {'values': {'mirrored': '1'}}, '^lever.mirrored must be true or false, not 1$'),
    ('read', {}, "^read is not understood: it lacks 'text'$"),
]


def test_a_request_is_answered_whatever_it_holds(lever):
    def text(value):
        return value if isinstance(value, str) else '{%s}' % ', '.join(
            f'"{name}": {text(inner)}' for name, inner in value.items())

    async def use(url):
        async with Page(url) as page:
            await page.cast('/lever', '/drop')
            answers = []
            for number, (op, fields, _) in enumerate(REQUESTS):
                members = {'op': f'"{op}"', 'id': f'"{number}"', 'mechanism': '"/lever"', **fields}
                await page.socket.send_str('{%s}' % ', '.join(
                    f'"{name}": {text(value)}' for name, value in members.items()))
                answers.append(await page.heard('answer', id=str(number)))
            return answers

    for answer, (op, _, reason) in zip(asyncio.run(use(lever.viewer.url)), REQUESTS):
        assert re.search(reason, answer['reason']), (op[:20], reason)
        assert len(answer['reason']) < 300 and answer.keys() == {'op', 'id', 'reason'}
    assert (lever.values('lever.crank.speed'), lever.values('lever.leg_pairs')) == ([1.0], [1])


def test_a_request_that_fails_is_answered(lever, monkeypatch):
    async def use(url):
        async with Page(url) as page:
            return await page.ask('read', '/lever', text='1')

    monkeypatch.setattr(server, 'number', lambda text: 1 // 0)
    assert asyncio.run(use(lever.viewer.url))['reason'].startswith('internal error: ZeroDivision')


def test_of_many_requests_at_once_each_is_answered(lever):
    async def use(url):
        async with Page(url) as page:
            await page.cast('/lever', '/drop')
            answers = await asyncio.gather(*(page.ask('set', '/lever', values={}) for _ in range(
                500)))
            return [answer['reason'] for answer in answers]

    reasons = asyncio.run(use(lever.viewer.url))
    assert reasons[0] == '' and set(reasons) <= {'', '64 requests wait already'}


@pytest.mark.parametrize('kind, data, code, reason', [
    (aiohttp.WSMsgType.TEXT, b'[' * 100000, 1009, 'a message may have 65536 bytes'),
    (aiohttp.WSMsgType.TEXT, b'\xff\xfe', 1007, 'a text must be UTF-8'),
    (aiohttp.WSMsgType.CONTINUATION, b'', 1002, 'this is not a WebSocket frame'),
    (3, b'', 1002, 'this is not a WebSocket frame'),
])
def test_what_is_no_message_closes_the_connection_with_a_reason(address, kind, data, code, reason):
    async def use():
        async with Page(address) as page:
            await page.heard('scene')
            await page.socket.send_frame(data, kind)
            await browser.until(lambda: page.end)
            return page.end

    assert asyncio.run(use()) == (code, reason)


class Deaf:
    """A client that asks, and reads nothing."""

    def __init__(self, url):
        host, port = url[len('http://'):-1].split(':')
        self._socket = socket.socket()
        # So that little is read on its behalf.
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        self._socket.connect((host, int(port)))
        self._host = f'Host: {host}:{port}\r\n'

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._socket.close()

    def request(self, path):
        """Return the bytes of a request for a file."""
        return f'GET {path} HTTP/1.1\r\n{self._host}\r\n'.encode()

    def upgrade(self):
        """Make the connection a WebSocket."""
        self._socket.sendall(self.request('/socket').replace(
            b'\r\n\r\n', b'\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n'
            b'Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n'))
        assert b' 101 ' in self._socket.recv(64)

    @staticmethod
    def frame(data, kind=1):
        """Return the bytes of a WebSocket frame."""
        size = len(data)
        head = bytes([0x80 | kind, 0x80 | min(size, 126)])
        return head + (struct.pack('>H', size) if size > 125 else b'') + bytes(4) + data

    def flood(self, data, goes_on):
        """Send something as long as that holds; return whether it was let to the end."""
        self._socket.settimeout(0.2)
        left = data
        while goes_on():
            try:
                left = left[self._socket.send(left):] or data
            except TimeoutError:
                pass
            except OSError:
                return False
        return True


def resident():
    """Return the memory that this process holds [MB]."""
    return int(Path('/proc/self/statm').read_text().split()[1]) * resource.getpagesize() / 1e6


FLOODS = {
    'answers': Deaf.frame(b'{"op": "fly", "id": "' + b'x' * 60000 + b'"}'),
    'refusals': Deaf.frame(b'[]') * 1000,
    'settings': Deaf.frame(b'{"op": "set", "mechanism": "/leg", "values": '
                           b'{"crank.speed": 1}, "id": 1}') * 100,
    'pings': Deaf.frame(b'x' * 125, kind=9) * 500,
    'drawn': Deaf.frame(b'{"op": "drawn"}') * 1000,
    'files': None,
}


@pytest.mark.skipif(not Path('/proc/self/statm').exists(), reason='memory is read from /proc')
@pytest.mark.parametrize('what, seconds', [
    pytest.param('answers', 0.5, marks=pytest.mark.slow),
    *(pytest.param(what, 15.0, marks=pytest.mark.long) for what in FLOODS)])
def test_a_client_that_does_not_read_costs_little_and_harms_nobody(show, what, seconds):
    running = show({**LEG, 'leg.crank.speed': 1.0})
    url = running.viewer.url

    async def use():
        async with Page(url) as page:
            await page.cast('/leg')
            await browser.until(lambda: page.pictures)
            before, pictures = resident(), page.pictures
            with Deaf(url) as deaf:
                data = FLOODS[what] or deaf.request('/panel.js') * 100
                if FLOODS[what]:
                    deaf.upgrade()
                over = threading.Event()
                flooding = asyncio.create_task(
                    asyncio.to_thread(deaf.flood, data, lambda: not over.is_set()))
                try:
                    await asyncio.sleep(seconds)
                    await browser.until(lambda: page.pictures > pictures + 5)
                    assert await page.set('/leg', crank__speed=2.0) == ''
                finally:
                    over.set()
                await flooding
                return resident() - before

    assert asyncio.run(use()) < 30.0


@pytest.mark.sample(1)
@pytest.mark.parametrize('half', [
    b'', b'GET / HT', b'GET / HTTP/1.1\r\nHost: ',
    b'POST / HTTP/1.1\r\nContent-Length: 9\r\n\r\nx'])
def test_half_a_request_is_not_waited_for_and_a_page_stays(show, monkeypatch, half):
    monkeypatch.setattr(server, 'SECONDS_TO_READ', 0.2)
    monkeypatch.setattr(server, 'SECONDS_TO_CLOSE', 0.1)
    url = show(LEG).viewer.url

    async def use():
        async with Page(url) as page:
            await page.cast('/leg')
            host, port = url[len('http://'):-1].split(':')
            reader, writer = await asyncio.open_connection(host, port)
            writer.write(half)
            await asyncio.wait_for(reader.read(), 10.0)
            writer.close()
            assert await page.set('/leg', crank__speed=2.0) == ''

    asyncio.run(use())


def test_what_fails_in_the_server_is_logged_in_one_line(show, monkeypatch, tmp_path, capfd):
    (tmp_path / 'broken.js').write_bytes(b'\xff')
    monkeypatch.setitem(server.FOLDERS, '', tmp_path)
    assert asyncio.run(status(show(LEG).viewer.url + 'broken.js')) == 500
    said = capfd.readouterr().err
    line, = (line for line in said.splitlines() if 'Error handling request' in line)
    assert re.search(r"\[WARN\] .*: UnicodeDecodeError\('utf-8', b", line)
    assert 'Traceback' not in said


@pytest.mark.slow
@pytest.mark.parametrize('last', [b'', b'nonsense'])
def test_a_client_that_does_not_read_is_sent_home(show, monkeypatch, last):
    monkeypatch.setattr(server, 'SECONDS_TO_READ', 0.3)
    with Deaf(show(LEG).viewer.url) as deaf:
        deaf.upgrade()
        end = time.monotonic() + browser.DEADLINE
        assert not deaf.flood(FLOODS['answers'] + last, lambda: time.monotonic() < end)


@pytest.mark.long
def test_a_client_that_does_not_read_does_not_keep_the_viewer_from_ending(show):
    running = show(LEG)
    with Deaf(running.viewer.url) as deaf:
        deaf.upgrade()
        some = iter(range(20))
        assert deaf.flood(FLOODS['answers'], lambda: next(some, None) is not None)
        ending = threading.Thread(target=running.viewer.destroy_node, daemon=True)
        ending.start()
        ending.join(browser.DEADLINE)
        assert not ending.is_alive()


@pytest.fixture
def address(lever):
    """Return the address of the page."""
    return lever.viewer.url


async def answer(url, **headers):
    """Return the status, the headers and the text of an answer."""
    async with aiohttp.ClientSession() as session:
        async with session.get(url, headers=headers) as response:
            return response.status, response.headers, await response.text()


async def status(url, **headers):
    """Return the status of an answer."""
    return (await answer(url, **headers))[0]


@pytest.mark.parametrize('name', ['', *sorted(
    path.relative_to(PAGE).as_posix() for path in PAGE.rglob('*') if path.is_file())])
def test_the_page_is_served_with_nothing_from_outside(address, name):
    code, headers, served = asyncio.run(answer(address + name))
    assert code == 200
    assert {key: value for key, value in headers.items()
            if key not in ('Date', 'Server', 'Content-Length')} == {
        'Content-Security-Policy':
            "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
        'Cross-Origin-Resource-Policy': 'same-origin', 'Cache-Control': 'no-cache',
        'Referrer-Policy': 'no-referrer', 'X-Content-Type-Options': 'nosniff',
        'Connection': 'close', 'Content-Type': {
            'html': 'text/html', 'css': 'text/css', 'js': 'text/javascript', 'svg':
            'image/svg+xml'}.get((name or '.html').rpartition('.')[2], 'text/plain')
        + '; charset=utf-8'}
    text = (PAGE / (name or 'index.html')).read_text()
    for colour, code in vars(palette).items():
        text = re.sub(rf'\${colour.lower()}\b', code, text) if colour.isupper() else text
    assert served == text
    named = re.findall(r"""(?:src|href|from|url\()\s*=?\s*["']([^"']+)["']""", text)
    assert all((PAGE / one).is_file() for one in named)
    addresses = set(re.findall(r'https?://[^\s"\'`]+', text))
    assert addresses <= {'http://www.apache.org/licenses/LICENSE-2.0',
                         'http://www.w3.org/2000/svg', 'https://github.com/leeoniya/uPlot'}


def test_the_page_is_as_small_as_the_docs_say():
    said = re.search(r'\| ([0-9]+) kB, and ([0-9]+) kB with the first plot',
                     (ROOT / 'docs' / 'design' / 'page.md').read_text())
    for folder, kilobytes in zip((PAGE, PAGE / 'vendor'), said.groups()):
        size = sum(file.stat().st_size for file in folder.iterdir()
                   if file.suffix in ('.html', '.css', '.js', '.svg'))
        assert size == pytest.approx(1000.0 * float(kilobytes), rel=0.1)


@pytest.mark.parametrize('name', ['%2e%2e%2fserver.py', 'server.py', 'none.html', 'page/main.js'])
def test_only_the_page_is_served(address, name):
    assert asyncio.run(status(address + name)) == 404


@pytest.mark.parametrize('host, own', [
    ('localhost:{port}', True), ('127.0.0.1:{port}', True), ('[::1]:{port}', True),
    ('localhost', True), ('evil.example', False), ('evil.example:{port}', False),
    ('localhost.evil.example', False), ('10.1.2.3:{port}', False), ('[', False), ('', False),
])
def test_a_foreign_host_is_refused(address, host, own):
    host = host.format(port=address.split(':')[2].strip('/'))
    assert asyncio.run(status(address, Host=host)) == (200 if own else 403)


@pytest.mark.parametrize('origin', [
    'http://evil.example', 'https://127.0.0.1', 'http://127.0.0.1:1', 'null', 'file://',
    'http://localhost:{port}', 'http://127.0.0.1:{port}.evil.example', ''])
def test_a_foreign_origin_is_refused(address, origin):
    async def use():
        port = address.split(':')[2].strip('/')
        async with Page(address, headers={'Origin': origin.format(port=port)}):
            pass

    with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
        asyncio.run(use())
    assert refused.value.status == 403


def test_its_own_origin_is_let_in(address):
    async def use():
        async with Page(address, headers={'Origin': address[:-1]}) as page:
            await page.heard('scene')

    asyncio.run(use())


def test_the_viewer_describes_its_parameters(graph):
    def known(viewer, *names):
        abouts = [viewer.describe_parameter(name) for name in names]
        return {name: (viewer.get_parameter(name).value, about.read_only, about.description, [
            (ends.from_value, ends.to_value, ends.step) for ends in about.integer_range])
            for name, about in zip(names, abouts)}

    viewer = graph.start(Viewer, {'or_any_port': True})
    assert known(viewer, 'host', 'port', 'or_any_port') == {
        'host': ('127.0.0.1', True, 'Address to listen at; 127.0.0.1: for browsers on this '
                 'machine alone. Whoever reaches it can move the scene.', []),
        'port': (8020, True, 'Port to listen at; 0: any that is free.', [(0, 65535, 1)]),
        'or_any_port': (True, True, 'Whether to listen at any free port where that one is taken.',
                        [])}
    graph.end(viewer)
    assert graph.start(Viewer, {'port': 0}).get_parameter('or_any_port').value is False


def test_where_a_port_is_taken_another_is_used_or_the_viewer_says_how(graph):
    with socket.socket() as taken:
        taken.bind(('127.0.0.1', 0))
        taken.listen()
        port = taken.getsockname()[1]
        other = graph.start(Viewer, {'port': port, 'or_any_port': True})
        assert asyncio.run(status(other.url)) == 200
        # Ports below are for the administrator.
        assert port != int(re.search(r':(\d+)/', other.url)[1]) >= 1024
        with pytest.raises(scene.SceneError, match=(
                '^the viewer cannot be started: .*in use; for another port use -p port:=8021, '
                'with ros2 launch port:=8021, with make view PORT=8021; port 0 is any free one$')):
            graph.start(Viewer, {'port': port})
    with pytest.raises(scene.SceneError, match='^the viewer cannot be started: .*[^e]$'):
        graph.start(Viewer, {'port': 0, 'host': '192.0.2.1', 'or_any_port': True})
    graph.end(other)


@pytest.mark.parametrize('host, shown, numbers', [
    ('0.0.0.0', '127.0.0.1', True), ('', '127.0.0.1', True), ('localhost', 'localhost', False)])
def test_a_viewer_answers_by_the_names_and_numbers_of_its_machine(graph, host, shown, numbers):
    viewer = graph.start(Viewer, {'port': 0, 'host': host})
    url = re.fullmatch(rf'http://{shown}:\d+/', viewer.url)[0]

    async def use():
        return [await status(url, Host=name) == 200 for name in (
            'evil.example', '10.1.2.3', socket.gethostname().upper(), 'LOCALHOST', '127.0.0.2')]

    assert asyncio.run(use()) == [False, numbers, True, True, True]
    graph.end(viewer)


def test_a_refused_address_says_what_was_asked(address):
    async def use():
        return [(await answer(address + name, **headers))[2] for name, headers in (
            ('none.html', {}), ('', {'Host': 'evil.example'}), ('', {'Origin': 'null'}))]

    assert asyncio.run(use()) == [
        "There is no 'none.html'.\n", "'evil.example' is not a name of this server.\n",
        "'null' is a foreign origin.\n"]


def test_a_viewer_that_ends_says_so_to_its_pages(show):
    running = show(LEG, kinds=())

    async def use(url):
        async with Page(url) as page:
            await page.heard('scene')
            await asyncio.to_thread(running.graph.end, running.viewer)
            await browser.until(lambda: page.end)
            return page.end

    assert asyncio.run(use(running.viewer.url)) == (1001, 'the viewer ended')


def test_a_node_that_does_not_answer_is_named(graph, show, monkeypatch):
    running = show(LEG)

    async def use(url):
        async with Page(url) as page:
            await page.cast('/leg')
            monkeypatch.setattr(bridge, 'SECONDS_TO_ANSWER', 0.1)
            graph.executor.remove_node(running.nodes[NODES.index(Kinematics)])
            return await page.set('/leg', scale=2.0)

    assert asyncio.run(use(running.viewer.url)) == (
        '/kinematics/set_parameters_atomically does not answer')
    assert running.values('leg.scale') == [1.0]


def test_an_input_that_is_moved_is_there_until_messages_say_otherwise(graph, show, monkeypatch):
    running = show({**LEG, 'rate': 0.0})
    publisher = graph.node.create_publisher(JointState, 'crank_states', 10)

    async def use(url):
        async with Page(url) as page:
            async def crank(value=None):
                want = {} if value is None else {'want': {'output': 'crank', 'value': value}}
                return (await page.ask('pose', '/leg', **want))['inputs']['crank']

            async def after(*angles):
                for angle in angles:
                    publisher.publish(JointState(name=['leg_crank'], position=[angle]))
                    value = await crank()
                return value

            async def is_after(value, *angles):
                return await after(*angles) == value

            await page.cast('/leg')
            assert await crank() == 1.0
            await browser.until(lambda: is_after(1.5, 1.5))
            monkeypatch.setattr(scene_view, 'SECONDS_TO_ARRIVE', 60.0)
            assert [await crank(2.0), await after(1.5, 1.6, 1.5)] == [2.0, 2.0]
            await browser.until(lambda: is_after(1.75, 2.0, 1.75))
            assert await after(math.nan, math.inf) == 1.75
            monkeypatch.setattr(scene_view, 'SECONDS_TO_ARRIVE', 0.0)
            assert [await crank(2.5), await crank()] == [2.5, 1.75]
            # A start moves an input only if it is another than before.
            assert await crank(2.5) == 2.5

    asyncio.run(use(running.viewer.url))
    assert running.values('leg.crank.start') == [math.nextafter(2.5, 0.0)]
    assert running.values('leg.crank.speed') == [0.0]


def free_port():
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]


@pytest.mark.long
@pytest.mark.parametrize('stop', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_viewer_while_somebody_looks(tmp_path, stop):
    port = free_port()
    scene = tmp_path / 'scene.yaml'
    scene.write_text(json.dumps({'/**': {'ros__parameters': {'port': port}}}))
    process = Process('viewer', scene)
    url = f'http://127.0.0.1:{port}/'

    async def use():
        async def up():
            try:
                return await status(url) == 200
            except aiohttp.ClientConnectionError:
                return False

        await browser.until(up)
        async with Page(url) as page:
            await page.heard('scene')
            process.interrupt(stop)
            await browser.until(lambda: page.socket.closed)

    asyncio.run(use())
    code, printed = process.end()
    assert code == 0 and f'Look at {url}' in printed
    assert 'Traceback' not in printed and 'rror' not in printed


@pytest.mark.long
@pytest.mark.parametrize('stop', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_make_view_says_where_to_look_and_ends_all_that_it_started(stop):
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)}
    environment.pop('ROS_DOMAIN_ID', None)
    process = subprocess.Popen(
        [sys.executable, ROOT / 'demo' / 'view.py', ROOT / 'config' / 'jansen.yaml', '0'],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment)
    try:
        address, = re.findall(r'Look at (http:\S+)', next(
            line for line in process.stdout if 'Look at' in line))

        async def look():
            async with Page(address) as page:
                await page.cast('/jansen')

        asyncio.run(look())
        process.send_signal(stop)
        # The output ends when the last of those who have it does.
        printed, _ = process.communicate(timeout=browser.DEADLINE)
        assert process.returncode == 0 and 'Traceback' not in printed
    finally:
        process.terminate()
        process.wait(browser.DEADLINE)


@pytest.mark.slow
@pytest.mark.parametrize('arguments', [
    ('view.py', ROOT / 'config' / 'jansen.yaml', '0'), ('demo.py',)], ids=lambda some: some[0])
def test_make_view_and_make_demo_end_quietly_when_nobody_reads_what_they_print(arguments):
    name, *others = arguments
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)}
    process = subprocess.Popen(
        [sys.executable, ROOT / 'demo' / name, *others], env=environment,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    process.stdout.close()
    said = process.stderr.read()
    assert process.wait(browser.DEADLINE) == 0
    assert [line for line in said.splitlines() if '[INFO]' not in line] == []


@pytest.mark.long
@pytest.mark.parametrize('parameters, named', [
    ({'port': 'taken'}, 'address already in use'), ({'port': 'taken'}, 'make view PORT=8021'),
    ({'port': 70000}, 'port'),
    ({'port': 'eighty'}, 'port'), ({'host': '192.0.2.1'}, '192.0.2.1'),
])
def test_a_viewer_that_cannot_listen_ends_in_one_sentence(tmp_path, parameters, named):
    with socket.socket() as taken:
        taken.bind(('127.0.0.1', 0))
        taken.listen()
        given = {'port': 0, **parameters}
        if given['port'] == 'taken':
            given['port'] = taken.getsockname()[1]
        scene = tmp_path / 'scene.yaml'
        scene.write_text(json.dumps({'/**': {'ros__parameters': given}}))
        code, printed = Process('viewer', scene).end()
    said = [line for line in printed.splitlines() if '[FATAL]' in line]
    assert code == 1 and 'Traceback' not in printed
    assert len(said) == 1 and named in said[0]


@pytest.mark.long
def test_a_port_that_is_no_parameter_is_refused(tmp_path):
    scene = tmp_path / 'scene.yaml'
    scene.write_text(json.dumps({'/**': {'ros__parameters': {'port': 0}}}))
    code, printed = Process('viewer', scene, '--port', '8050').end()
    said = [line for line in printed.splitlines() if '[FATAL]' in line]
    assert code == 1 and len(said) == 1 and "'--port'" in said[0]


def walker(step, legs=2, frame='world', width=1.0):
    """Return a message as kinematics sends it."""
    made = messages.Markers('leg', frame, (0.0, 1.0, 2.0, 0.5, 0.0, 0.0), width,
                            {0: [(0, 1), (1, 2)], 1: range(3)})
    places = np.random.default_rng(step).normal(size=(legs, 3, 2))
    stamp = rclpy.time.Time(nanoseconds=1 + 10 ** 9 * step).to_msg()
    return serialize_message(made.message(stamp, places))


# As the middleware hands it over.
FILLED = walker(9) + bytes(3)


def frame_of(markers):
    """Return the frame of some markers, part by part, as the page reads it."""
    return [({'mechanism': '/leg', 'topic': 'markers', 'markers': [
        {'kind': {Marker.LINE_LIST: 'lines', Marker.LINE_STRIP: 'locus', Marker.SPHERE_LIST:
                  'joints', Marker.TRIANGLE_LIST: 'triangles'}[marker.type],
         'frame': marker.header.frame_id, 'width': marker.scale.x, 'points': len(marker.points),
         'pose': [*parts(marker.pose.position), *parts(marker.pose.orientation)],
         'colour': parts(marker.color)} for marker in markers]}, [
             [list(map(np.float32, parts(point))) for point in marker.points]
             for marker in markers])]


def parts(numbers):
    """Return the numbers of a message such as a Point, in order."""
    return [getattr(numbers, name) for name in numbers.get_fields_and_field_types()]


def read(feed_):
    """Return the frame of a feed's newest message, part by part, as lists."""
    return [(head, [part.tolist() for part in points]) for head, points in framed(feed_.frame())]


def markers_of(text):
    return deserialize_message(text, MarkerArray).markers


def feed_of_a_leg():
    """Return the feed of a leg's markers, which logs nothing."""
    return Feed('/leg', '/leg/markers', MarkerArray, lambda text, subject: None)


def test_a_frame_has_the_markers_of_the_newest_message():
    topic = feed_of_a_leg()
    assert topic.frame() == b''
    for text in (walker(1), walker(2), walker(4, legs=1), walker(6, width=2.0),
                 walker(7, frame='\N{BLACK STAR}'), FILLED, FILLED):
        topic.newest = text
        assert read(topic) == frame_of(markers_of(text))
        assert topic.frame() is topic.frame()


def test_of_a_message_what_is_deleted_or_no_line_joint_or_triangle_is_not_drawn():
    topic = feed_of_a_leg()
    message = deserialize_message(walker(1), MarkerArray)
    bars, joints = message.markers
    message.markers = [
        Marker(type=Marker.LINE_LIST, action=Marker.DELETE), joints, Marker(type=Marker.CUBE),
        bars, Marker(type=Marker.TRIANGLE_LIST),
        Marker(type=Marker.LINE_STRIP, points=bars.points)]
    topic.newest = serialize_message(message)
    assert read(topic) == frame_of([joints, bars, *message.markers[4:]])
    (head, _), = read(topic)
    assert [marker['kind'] for marker in head['markers']] == [
        'joints', 'lines', 'triangles', 'locus']


def swapped(message):
    """Return a message as a machine of the other byte order writes it."""
    text, size = bytearray(b'\0\0\0\0'), {'boolean': 1, 'uint8': 1, 'int32': 4,
                                          'uint32': 4, 'float': 4, 'double': 8}
    form = {'boolean': '?', 'uint8': 'B', 'int32': 'i', 'uint32': 'I', 'float': 'f',
            'double': 'd'}

    def number(kind, value):
        text.extend(bytes(-(len(text) - 4) % size[kind]))
        text.extend(struct.pack('>' + form[kind], value))

    def write(kind, value):
        if kind.startswith('sequence<'):
            number('uint32', len(value))
            for one in value:
                write(kind[len('sequence<'):-1], one)
        elif kind == 'string':
            number('uint32', len(value) + 1)
            text.extend(value.encode() + b'\0')
        elif kind in size:
            number(kind, value)
        else:
            for name, inner in value.get_fields_and_field_types().items():
                write(inner, getattr(value, name))

    write('', message)
    return bytes(text)


def test_markers_in_the_other_byte_order_are_drawn_alike():
    topic = feed_of_a_leg()
    for text in (walker(1), walker(2)):
        topic.newest = swapped(deserialize_message(text, MarkerArray))
        assert topic.newest[4:] != text[4:]
        assert read(topic) == frame_of(markers_of(text))


def spoilt(part, number):
    """Return a message that cannot be drawn for one number in it."""
    message = deserialize_message(walker(1), MarkerArray)
    marker = message.markers[0]
    parts = marker.points[0], marker.pose.position, marker.pose.orientation, marker.scale
    parts[part].x = number
    return serialize_message(message)


def hostile(rng, text):
    """Yield bytes that are no message, or one with other numbers than were written."""
    yield from (b'', b'\0', b'\0\1\0', b'\0\1\0\0', b'\xff' * 64, text[:4] + b'\xff' * 500)
    yield from (text[:size] for size in rng.integers(0, len(text) - 8, 20))
    yield from (rng.bytes(size) for size in rng.integers(0, 2000, 20))
    yield from (text[:4] + rng.bytes(size) for size in rng.integers(0, 2000, 20))
    yield from (rng.bytes(4) + text[4:] for _ in range(20))
    for _ in range(200):
        places = bytearray(text)
        for place in rng.integers(0, len(text), 3):
            places[place] = rng.integers(256)
        yield bytes(places)
    for number in (math.nan, math.inf, -1e300):
        yield from (spoilt(part, number) for part in range(4))


@pytest.mark.slow
def test_of_what_cannot_be_drawn_nothing_stays():
    rng = np.random.default_rng(5)
    topic = feed_of_a_leg()
    for step, text in enumerate(hostile(rng, walker(0))):
        for topic.newest in (text, walker(step)):
            for head, points in framed(topic.frame()):
                json.dumps(head, allow_nan=False)
                assert all(np.isfinite(part).all() for part in points)
        assert read(topic) == frame_of(markers_of(walker(step)))


def test_messages_that_cannot_be_read_are_dropped_and_said_once(show, capfd):
    # Without a crank, `kinematics` itself publishes no markers.
    running = show(LEG, kinds=(Kinematics,))
    node = running.graph.node
    markers = node.create_publisher(MarkerArray, 'leg/markers', 1)
    locus = node.create_publisher(Marker, 'leg/locus', LATCHED)
    events = node.create_publisher(ParameterEvent, '/parameter_events', 10)

    async def use(url):
        async with Page(url) as first, Page(url) as second:
            async def good(step):
                wanted = walker(step)
                points = np.array(parts(markers_of(wanted)[-1].points[-1]), '<f4')

                def seen():
                    markers.publish(wanted)
                    return all((page.drawn('/leg', 'joints')[-1:] == points).any()
                               for page in (first, second))

                await browser.until(seen)

            async def bad(text):
                before = [(page, page.pictures) for page in (first, second)]
                for publisher in (markers, locus, events):
                    publisher.publish(text)
                await browser.until(lambda: all(page.pictures > had for page, had in before))

            await good(0)
            for step, text in enumerate((b'', b'\0\1\0\0', walker(1)[:99], spoilt(
                    1, math.nan))):
                await bad(text)
                await good(step + 1)

    asyncio.run(use(running.viewer.url))
    said = capfd.readouterr().err
    assert said.count('a message on /leg/markers is dropped: ') == 1
    assert said.count('a message on /leg/locus is dropped: ') == 1
    assert 'Traceback' not in said


@pytest.mark.long
def test_nodes_that_end_and_come_again_are_drawn_again(graph, show):
    running = show(LEG, kinds=(CrankDriver,))

    async def come_and_go(page, scene):
        kinematics = graph.start(Kinematics, scene)
        await browser.until(lambda: len(page.drawn(f'/{scene["mechanisms"][0]}', 'locus')))
        page.forget()
        graph.end(kinematics)
        await page.heard('scene', mechanisms=[])

    async def use(url):
        async with Page(url) as page:
            for given in (LEG, LEG, {**RATE, 'mechanisms': ['drop'], 'drop.type': 'water_drop'}):
                await come_and_go(page, given)

    asyncio.run(use(running.viewer.url))


def served():
    """Return the tasks that go on in other threads than this: those of servers."""
    here = asyncio.get_running_loop()
    return [task for task in gc.get_objects() if isinstance(task, asyncio.Task)
            and not task.done() and task.get_loop() is not here]


def test_what_a_page_looked_at_is_not_subscribed_to_when_it_is_gone(graph, show):
    running = show(LEG)
    at_rest = running.entities()

    async def use(url):
        tasks = len(served())
        async with Page(url) as page:
            await page.cast('/leg')
            await browser.until(lambda: len(page.drawn('/leg', 'joints')))
            assert running.entities()[0] >= at_rest[0] + 4
        await browser.until(lambda: running.entities() == at_rest)
        await browser.until(lambda: len(served()) <= tasks)

    asyncio.run(use(running.viewer.url))


@pytest.mark.long
def test_pages_that_come_and_go_leave_nothing(show):
    running = show(LEG)

    async def visit(url):
        async with Page(url) as page:
            await browser.until(lambda: len(page.drawn('/leg', 'joints')))

    async def use(url):
        before, at_rest, tasks = 0.0, running.entities(), len(served())
        for turn in range(6):
            await asyncio.gather(*(visit(url) for _ in range(200)))
            for _ in range(30):
                await visit(url)
            # The tests collect garbage less often than a viewer does.
            gc.collect()
            if turn == 1:
                before = resident()
        await browser.until(lambda: running.entities() == at_rest)
        assert resident() - before < 10.0
        await browser.until(lambda: len(served()) == tasks)

    asyncio.run(use(running.viewer.url))


class Seen:
    """A browser that looks at a show."""

    def __init__(self, page):
        self.page = page

    def section(self, name):
        """Return the expression for a mechanism's part of the panel."""
        return f'document.querySelector(`section[data-key="/{name}"]`)'

    def row(self, name, label):
        """Return the expression for a slider's row."""
        return (f'[...{self.section(name)}.querySelectorAll(".row")].find('
                f'row => row.querySelector("label").textContent === "{label}")')

    async def slide(self, name, label, part):
        """Drag a slider from where it is to a part of its way."""
        slider = f'{self.row(name, label)}.querySelector("input")'
        x, y, width = await self.page.middle(slider)
        at = await self.page.value(f'(({slider}).value - ({slider}).min) / '
                                   f'(({slider}).max - ({slider}).min)')
        left, inner = x - 0.5 * width + 8.0, width - 16.0
        await self.page.drag((left + at * inner, y), (left + part * inner, y))

    async def reason(self, name, label):
        """Return the reason that is shown at a slider, or nothing."""
        return await self.page.value(
            f'(row => row.hidden ? "" : row.textContent)'
            f'({self.row(name, label)}.querySelector(".reason"))')

    async def number(self, name, label):
        """Return the number that a slider shows."""
        return float(await self.page.value(
            f'{self.row(name, label)}.querySelector("input[type=text]").value'))

    async def output(self, name, label):
        """Return the value that is shown of an output, when it is shown."""
        return float(await browser.until(lambda: self.page.value(
            f'{self.section(name)}.querySelector(`td input[aria-label="{label}"]`)?.value')))

    async def write(self, name, label, text):
        """Write a number beside a slider."""
        await self.page.write(
            f'{self.row(name, label)}.querySelector("input[type=text]")', text)

    async def red(self, name, label):
        """Return whether a row is marked as refused."""
        return await self.page.value(f'{self.row(name, label)}.classList.contains("refused")')

    async def view(self, name):
        """Show one mechanism."""
        button = ('[...document.querySelectorAll("#views button")].find('
                  f'button => button.textContent === "{name}")')

        async def shown():
            await self.page.click(button)
            return await self.page.value(
                'document.querySelectorAll("section").length === 1 && '
                f'!!{self.section(name)}?.querySelector("tbody tr")')

        await browser.until(shown)

    async def canvas(self):
        """Return what is seen of the picture."""
        width = await self.page.value('document.getElementById("picture").clientWidth')
        top = await self.page.value('document.getElementById("picture").getBoundingClientRect().y')
        return (await self.page.picture())[int(top):, :int(width)]


# Of joints, of bars, of the locus, and of the bars that are pointed at.
GREY, BLUE, GREEN, PURPLE = (138, 138, 138), (0, 129, 201), (0, 158, 115), (204, 121, 167)


def coloured(picture, red, green, blue):
    """Return the rows and columns of the pixels of a colour."""
    return np.argwhere((abs(picture - (red, green, blue)) < 12).all(axis=2))


@pytest.fixture
def looked_at(tmp_path):
    """Return a function that looks at a show with a browser and does something there."""
    def run(running, doing):
        async def look():
            async with browser.Browser(tmp_path) as page:
                await page.open(running.viewer.url)
                seen = Seen(page)
                await browser.until(
                    lambda: page.value('document.querySelectorAll("section").length'))
                await doing(seen)
                assert page.complaints == []
                assert all(url.startswith((running.viewer.url, 'ws://127.0.0.1:', 'blob:'))
                           for url in page.requests)

        asyncio.run(look())

    return run


@pytest.mark.long
@needs_browser
def test_the_picture_moves_and_a_click_stops_it(show, looked_at):
    running = show({**LEVER, 'drop.crank.speed': 0.0, 'lever.crank.speed': 3.0})

    async def doing(seen):
        await seen.view('lever')

        async def drawn():
            return len(coloured(await seen.canvas(), *BLUE)) > 1000

        await browser.until(drawn)
        first = await seen.canvas()

        async def moved():
            return (await seen.canvas() != first).any(axis=2).sum() > 1000

        await browser.until(moved)
        await seen.page.click(f'{seen.section("lever")}.querySelector("button")')
        await browser.until(lambda: running.values('lever.crank.speed') == [0.0])

        async def still():
            before = await seen.canvas()
            return (await seen.canvas() == before).all()

        await browser.until(still)

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_a_dragged_slider_sets_the_nodes_and_a_refused_one_springs_back(show, looked_at):
    running = show(LEVER)

    async def doing(seen):
        await seen.view('lever')
        await seen.slide('lever', 'b', 0.7)
        await browser.until(lambda: running.value(Kinematics, 'lever.dimensions.b') > 200.0)

        async def agreed():
            return running.value(Kinematics, 'lever.dimensions.b') == await seen.number(
                'lever', 'b')

        await browser.until(agreed)
        assert await seen.reason('lever', 'b') == ''

        await seen.write('lever', 'e', '7000')
        await browser.until(lambda: seen.reason('lever', 'e'))
        kept = running.value(Kinematics, 'lever.dimensions.e')

        async def sprung():
            return abs(await seen.number('lever', 'e') - kept) < 1e-5 * abs(kept) + 1e-9

        await browser.until(sprung)
        # The number as it was typed, in its unit, and the range.
        assert re.match(r'Refused: 7000 m; the slider goes from \S+ to \S+ m\. lever.dimensions',
                        await seen.reason('lever', 'e'))
        assert abs(kept) < 1500.0

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_what_was_mistyped_is_said_though_an_earlier_number_is_granted_later(show, looked_at):
    running = show(LEVER)

    async def doing(seen):
        await seen.view('lever')
        field = f'{seen.row("lever", "a")}.querySelector("input[type=text]")'
        await seen.page.value(f"""for (const text of ['80.5', '8x']) {{
            ({field}).value = text;
            ({field}).dispatchEvent(new Event('change'));
        }}""")
        await browser.until(lambda: running.value(Kinematics, 'lever.dimensions.a') == 80.5)
        await browser.until(lambda: seen.page.value(f'({field}).value === "80.5"'))
        assert (await seen.reason('lever', 'a')).startswith("Refused: '8x' is not a number")

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_a_number_can_be_written_with_a_point_or_a_comma(show, looked_at):
    running = show(LEVER)

    async def doing(seen):
        await seen.view('lever')
        for text, value in (('80,5', 80.5), ('81.25', 81.25), (',5e2', 50.0),
                            ('2*(40+5)', 90.0)):
            await seen.write('lever', 'a', text)
            await browser.until(
                lambda wanted=value: running.value(Kinematics, 'lever.dimensions.a') == wanted)
            assert await seen.reason('lever', 'a') == ''
        for text in ('1,234.5', '8x', '0x50', '8--', 'b/2', 'Infinity', '1e400', 400 * '9'):
            await seen.write('lever', 'a', text)
            await browser.until(lambda: seen.reason('lever', 'a'))
            said, start = await seen.reason('lever', 'a'), text[:20].replace(',', '.')
            assert said.startswith(f"Refused: '{start}")
            assert 'is not a number' in said or 'must be 0 or' in said
            assert await seen.number('lever', 'a') == 90.0
        await seen.write('lever', 'a', '')
        assert await seen.number('lever', 'a') == 90.0
        await seen.page.click('document.getElementById("workshop")')
        for text, angle in (('90deg', 0.5 * math.pi), ('pi/3', math.pi / 3.0), ('30', math.pi / 6),
                            ('2*30', math.pi / 3.0)):
            await seen.write('lever', 'crank', text)
            await browser.until(lambda wanted=angle: running.values('lever.crank.start')[0]
                                == pytest.approx(wanted, abs=1e-12))
        await seen.page.click('document.getElementById("workshop")')
        inward = ('[...document.querySelectorAll(".choice button")].find('
                  'button => button.textContent === "in")')
        await seen.page.value(f'{inward}.scrollIntoView()')
        await seen.page.click(inward)
        await browser.until(lambda: running.value(Kinematics, 'lever.branches.L') == -1)
        await browser.until(lambda: seen.page.value(f'{inward}.ariaPressed === "true"'))
        await seen.write('lever', 'a', '91')
        await browser.until(lambda: running.value(Kinematics, 'lever.dimensions.a') == 91.0)

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_a_refusal_is_forgotten_when_the_good_value_is_back(show, looked_at):
    running = show(LEVER)

    async def doing(seen):
        await seen.view('lever')

        async def refused():
            await seen.write('lever', 'b', '-150')
            await browser.until(lambda: seen.reason('lever', 'b'))
            assert await seen.number('lever', 'b') == running.value(
                Kinematics, 'lever.dimensions.b')
            assert not await seen.red('lever', 'b')

        async def forgotten():
            return await seen.reason('lever', 'b') == ''

        await refused()
        await seen.write('lever', 'b', '150')
        await browser.until(forgotten)
        await refused()
        await seen.write('lever', 'b', '151')
        await browser.until(forgotten)
        await refused()

        async def set_elsewhere():
            # By somebody who comes later.
            for node in running.nodes:
                if isinstance(node, Kinematics):
                    value = node.get_parameter('lever.dimensions.b').value
                    node.set_parameters([Parameter('lever.dimensions.b', value=value + 1.0)])
            await asyncio.sleep(0.2)
            return await forgotten()

        await browser.until(set_elsewhere)

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_a_picture_of_what_is_far_off_is_drawn_and_left(show, looked_at):
    # Its locus is as large as these markers.
    running = show({**LEG, 'leg.scale': 0.01}, kinds=(Kinematics,))
    markers = running.graph.node.create_publisher(MarkerArray, 'leg/markers', 1)

    async def doing(seen):
        def published(text):
            async def drawn():
                markers.publish(text)
                return len(coloured(await seen.canvas(), *BLUE)) > 100
            return drawn

        await browser.until(published(walker(1)))
        for far in (1e9, 1e17, 1e30, 3e38):
            for part in range(4):
                for _ in range(3):
                    markers.publish(spoilt(part, far))
                    await asyncio.sleep(0.02)
                await browser.until(published(walker(1)))

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_the_picture_is_zoomed_shifted_and_turned_by_keys_and_mouse(show, looked_at):
    running = show({**LEVER, 'lever.crank.speed': 0.0, 'lever.crank.start': 1.0})

    async def doing(seen):
        await seen.view('lever')

        async def locus(middle=None, size=None):
            """Return the middle and the size of the locus, at rest and as it is wanted."""
            first, second = [coloured(await seen.canvas(), *GREEN) for _ in range(2)]
            if len(first) < 100 or not np.array_equal(first, second):
                return None
            found = first.mean(axis=0), np.ptp(first, axis=0)
            far = [abs(one - wanted).max() for one, wanted in zip(found, (middle, size))
                   if wanted is not None]
            return found if max(far, default=0.0) < 6.0 else None

        middle, size = await browser.until(locus)
        await seen.page.value('document.getElementById("picture").focus()')
        await seen.page.press('-')
        await browser.until(lambda: locus(size=size / 1.2), 'zoomed')
        await seen.page.press('0')
        await browser.until(lambda: locus(middle, size), 'whole')
        top = await seen.page.value('document.getElementById("picture").getBoundingClientRect().y')
        await seen.page.drag((100.0, top + 100.0), (160.0, top + 70.0))
        await browser.until(lambda: locus(middle + (-30.0, 60.0), size), 'shifted')
        # Seen nearly from its edge, the plane is narrow and as high as before.
        await seen.page.press('0')
        for _ in range(7):
            await seen.page.press('ArrowRight', shift=True)
        await browser.until(lambda: locus(size=size * (1.0, math.cos(1.4))), 'turned')
        await seen.page.click('document.getElementById("whole")')
        await browser.until(lambda: locus(middle, size), 'whole again')
        assert await seen.page.value('document.getElementById("whole").hidden')

    looked_at(running, doing)


async def settled(seen):
    """Return whether the picture is drawn and stands still."""
    before = await seen.canvas()
    return len(coloured(before, *GREEN)) > 100 and (await seen.canvas() == before).all()


async def upright_lever(seen):
    """Return where the tip and the pivot of a lever that stands upright are on the page."""
    await browser.until(lambda: settled(seen))
    await seen.page.click('document.getElementById("names")')
    # The numbers of the grid are left out: they are grey too.
    rows, columns = coloured((await seen.canvas())[:-40, 80:], *GREY).T + [[0], [80]]
    top = await seen.page.value('document.getElementById("picture").getBoundingClientRect().y')
    return ((float(columns[rows < rows.min() + 10].mean()), top + int(rows.min()) + 8),
            (float(columns[rows > rows.max() - 10].mean()), top + int(rows.max()) - 8))


@pytest.mark.long
@needs_browser
def test_a_second_finger_neither_moves_the_joint_of_the_first_nor_takes_one(show, looked_at):
    running = show({**LEVER, 'lever.crank.speed': 0.0})

    def crank():
        return running.values('lever.crank.start')[0]

    async def doing(seen):
        page = seen.page
        await seen.view('lever')
        await seen.output('lever', 'lever')
        x, y = (await upright_lever(seen))[0]
        aside = x - 200.0, y + 100.0
        await page.touch((x, y))
        await page.touch((x - 30.0, y))
        await browser.until(lambda: crank() > 0.1)
        await page.touch((x - 30.0, y), aside)
        before = crank()
        for step in (20.0, 40.0, 60.0):
            await page.touch((x - 30.0, y), (aside[0] - step, aside[1] + step))
        # It follows the first finger still, from where it was.
        await page.touch((x - 31.0, y), (aside[0] - 60.0, aside[1] + 60.0))
        await browser.until(lambda: crank() != before)
        assert crank() == pytest.approx(before, abs=0.05)
        await page.touch((x - 31.0, y))
        await page.touch()
        before = crank()
        # Two fingers zoom, though the second is put on a joint.
        await page.touch(aside)
        await page.touch(aside, (x - 31.0, y))
        await page.touch(aside, (x + 60.0, y - 30.0))
        await page.touch()
        await browser.until(lambda: page.value('!document.getElementById("whole").hidden'))
        assert crank() == before

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_what_is_refused_is_said_where_one_looks_and_leaves_the_picture_free(show, looked_at):
    running = show({'mechanisms': ['lever'], 'lever.type': 'slotted_lever'}, kinds=(Kinematics,))
    crank_states = running.graph.node.create_publisher(JointState, 'crank_states', 10)

    async def doing(seen):
        page, notice = seen.page, 'document.getElementById("notice")'

        async def moved():
            crank_states.publish(JointState(name=['lever_crank'], position=[0.0]))
            return await page.value(f'!!{seen.section("lever")}.querySelector("tbody tr")')

        def reason():
            return page.value(f'[...{seen.section("lever")}.querySelectorAll(".reason")].filter('
                              'one => !one.hidden).map(one => one.textContent).join()')

        await browser.until(moved)
        (x, y), _ = await upright_lever(seen)
        await page.drag((x, y), (x + 30.0, y))
        why = 'the crank cannot be moved: no crank_driver is running'
        await browser.until(lambda: page.value(f'{notice}.textContent === "{why}"'))
        assert await reason() == why
        await browser.until(lambda: page.value(f'{notice}.hidden'))
        assert await reason() == why
        await page.write(f'{seen.section("lever")}.querySelector("td input")', 'foo')

        async def refused():
            return await reason() == "Refused: 'foo' is not a number: foo is unknown"

        await browser.until(refused)

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_a_click_on_a_bar_goes_to_its_slider_and_a_drag_from_it_does_not(show, looked_at):
    running = show({**LEVER, 'lever.crank.speed': 0.0})

    async def doing(seen):
        page = seen.page
        await seen.view('lever')
        await seen.output('lever', 'lever')
        tip, pivot = await upright_lever(seen)
        bar = tip[0], 0.8 * pivot[1] + 0.2 * tip[1]
        focus = 'document.activeElement.type'
        await page.drag(bar, (bar[0] + 80.0, bar[1]))
        await browser.until(lambda: page.value('!document.getElementById("whole").hidden'))
        assert await page.value(focus) != 'range'
        await page.click('document.getElementById("whole")')

        async def gone():
            await page.drag(bar, bar)
            return await page.value(focus) == 'range'

        await browser.until(gone)

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_a_joint_follows_the_mouse_and_stops_at_its_reach(show, looked_at):
    running = show({**LEVER, 'lever.crank.speed': 0.0})

    async def doing(seen):
        await seen.view('lever')

        await seen.output('lever', 'lever')
        tip, pivot = await upright_lever(seen)
        length = pivot[1] - tip[1]

        def at(phi):
            return pivot[0] - length * math.sin(phi), pivot[1] - length * math.cos(phi)

        def lever():
            return lever_of(running.values('lever.crank.start')[0])

        async def dragged(predicate, *places):
            """Drag as a person would: again if the page, laid out anew, missed the press."""
            for _ in range(3):
                await browser.until(lambda: settled(seen))
                await seen.page.drag(*places)
                with contextlib.suppress(asyncio.TimeoutError):
                    return await asyncio.wait_for(browser.until(predicate), 10.0)
                # What misses a joint shifts the picture.
                await seen.page.value('document.getElementById("picture").dispatchEvent('
                                      'new MouseEvent("dblclick"))')
            raise AssertionError('the lever cannot be dragged')

        async def shown():
            return abs(await seen.output('lever', 'lever') - lever()) < 0.001

        await dragged(lambda: abs(lever() - 0.4) < 0.02, tip, at(0.2), at(0.4))
        await browser.until(shown)
        end = math.asin(80.0 / 150.0)
        await dragged(lambda: abs(lever() - end) < 1e-4, at(0.4), at(0.5), at(1.2))
        await browser.until(shown)
        assert running.values('lever.crank.speed') == [0.0]

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_an_input_is_moved_with_the_keys_by_steps_and_in_degrees(show, looked_at):
    running = show({**LEVER, 'lever.crank.speed': 1.5})

    async def doing(seen):
        await seen.view('lever')
        await seen.output('lever', 'lever')

        def servo():
            return running.values('lever.crank.start')[0]

        async def follows():
            return abs(await seen.number('lever', 'crank') - math.degrees(servo())) < 0.001

        await seen.page.click('document.getElementById("workshop")')
        await seen.write('lever', 'crank', '30')
        await browser.until(lambda: servo() == pytest.approx(math.radians(30.0), abs=1e-12))
        assert running.values('lever.crank.speed') == [0.0]
        await browser.until(follows)
        await seen.page.click(f'{seen.row("lever", "crank")}.querySelectorAll("button")[1]')
        await browser.until(lambda: servo() == pytest.approx(math.radians(31.0), abs=1e-4))
        await browser.until(follows)
        await seen.page.value(f'{seen.row("lever", "crank")}.querySelector("input").focus()')
        before = servo()
        await seen.page.press('ArrowLeft')
        await browser.until(lambda: before - 0.02 < servo() < before)
        await seen.page.write(f'{seen.section("lever")}.querySelector("td input")', '80')
        end = math.degrees(math.asin(80.0 / 150.0))
        await browser.until(lambda: seen.page.value(
            f'{seen.section("lever")}.innerText.includes('
            f'"lever reaches [-{end:.3f}, {end:.3f}] \N{DEGREE SIGN}")'))
        await seen.page.click(f'{seen.section("lever")}.querySelector("button")')
        await browser.until(lambda: running.values('lever.crank.speed') == [1.5])

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_a_bar_and_its_slider_light_up_and_changes_are_undone_and_saved(show, looked_at, tmp_path):
    running = show({**LEG, 'leg.crank.speed': 0.0})

    def value(name):
        return running.value(Kinematics, f'leg.dimensions.{name}')

    async def doing(seen):
        def lit(label):
            return seen.page.value(f'{seen.row("leg", label)}.classList.contains("lit")')

        def button(text):
            return (f'[...{seen.section("leg")}.querySelectorAll("button")].find('
                    f'button => button.textContent === "{text}")')

        async def where_lit():
            """Point at the slider of h until its bar is lit; return the middle of that."""
            await seen.page.hover(f'{seen.row("leg", "h")}.querySelector("label")')
            places = coloured(await seen.canvas(), *PURPLE)
            return tuple(places.mean(axis=0)) if len(places) > 300 else None

        await seen.output('leg', 'BC')
        row, column = await browser.until(where_lit)
        assert await lit('h') and not await lit('g')
        top = await seen.page.value('document.getElementById("picture").getBoundingClientRect().y')
        await seen.page.move(5.0, top + 5.0)
        await browser.until(lambda: seen.page.value('!document.querySelector(".lit")'))
        await seen.page.move(column, top + row)
        await browser.until(lambda: lit('h'))

        await seen.write('leg', 'h', '60.5')
        await browser.until(lambda: value('h') == 60.5)
        await seen.write('leg', 'g', '37.25')
        await browser.until(lambda: value('g') == 37.25)
        await seen.page.downloads(tmp_path)
        await seen.page.click(button('Save as scene file'))
        saved = tmp_path / 'leg.yaml'
        await browser.until(saved.exists)
        dimensions = scene.load(str(saved)).machines['leg'].linkage.dimensions
        assert (dimensions['g'], dimensions['h'], dimensions['i']) == (37.25, 60.5, 49.0)
        await seen.page.click(button('Undo'))
        await browser.until(lambda: value('g') == 36.7)
        assert value('h') == 60.5
        await seen.page.click(button('Reset'))
        await browser.until(lambda: value('h') == 65.7)
        await browser.until(lambda: seen.page.value(f'{button("Reset")}.disabled'))

    looked_at(running, doing)


# Titles of mechanisms wherever they are; at a quarter of all heights (y + 18) - y < 18.
TITLES = """
import('/picture.js').then(({ Picture }) => {
  let seed = 1;
  const random = () => (seed = seed * 16807 % 2147483647) / 2147483647;
  return Array.from({ length: 2000 }, () => {
    const picture = new Picture(document.getElementById('picture')), written = [];
    picture.mechanisms = Array.from({ length: 16 }, (_, i) => (
      { key: i, title: 'linkage'.slice(i % 5) }));
    Object.assign(picture, {
      scale: 1, middle: [0, 0], centre: [0, 0], canvas: CANVAS });
    const y = 4 ** (5 * random()), x = 4 ** (5 * random());
    for (const { key } of picture.mechanisms) {
      const [left, top] = [x * random(), -y * (random() < 0.5 || random())];
      picture.boxes.set(key, { low: [left, top], high: [left, top] });
    }
    picture.text = (name, x, y) => written.push([x, y, picture.context.measureText(name).width]);
    picture.titles();
    return written;
  });
})"""


@pytest.mark.slow
@needs_browser
@pytest.mark.parametrize('width, height, fewest', [(1e5, 1e5, 16), (390, 380, 0)])
def test_titles_are_written_beside_or_below_each_other_wherever_they_are(
        address, tmp_path, width, height, fewest):
    canvas = f'{{ clientWidth: {width}, clientHeight: {height} }}'

    async def look():
        async with browser.Browser(tmp_path) as page:
            await page.open(address)
            return await page.value(TITLES.replace('CANVAS', canvas))

    pictures = asyncio.run(look())
    assert min(map(len, pictures)) >= fewest
    for written in filter(None, pictures):
        x, y, wide = np.transpose(written)
        seen = (x >= 0.0) & (x <= width)
        assert (x - 0.5 * wide)[seen].min(initial=width) > 0.0
        assert (x + 0.5 * wide)[seen].max(initial=0.0) < width
        assert y.max() + 18.0 < height
        apart = np.maximum(abs(y[:, None] - y) / 18.0,
                           2.0 * abs(x[:, None] - x) / (wide[:, None] + wide))
        assert apart[~np.eye(len(x), dtype=bool)].min(initial=1.0) > 1.0 - 1e-9


@pytest.mark.long
@needs_browser
@pytest.mark.parametrize('path', sorted((ROOT / 'config').glob('*.yaml')), ids=lambda p: p.stem)
def test_the_page_is_for_everybody(show, looked_at, path):
    checker = pytest.importorskip('axe_core_python')
    axe = (Path(checker.__file__).parent / 'axe.min.js').read_text('utf-8')
    # A picture now and then leaves the browser time to look through the page.
    running = show({**without_defaults(scene.load(str(path))), 'rate': 5.0})

    async def doing(seen):
        for width, height, scheme in ((1200, 900, 'light'), (390, 844, 'dark')):
            await seen.page.resize(width, height, scheme)
            await browser.until(lambda most=width: seen.page.value(
                '[...document.querySelectorAll(".plot")].every(plot =>'
                ' (plot.closest("details").open = true) && /^Position of /.test(plot.ariaLabel) &&'
                f' plot.querySelector("canvas").clientWidth < {most}) &&'
                ' !!document.querySelector("section tbody tr")'))
            assert await seen.page.value('document.documentElement.scrollWidth') <= width
            found = json.loads(await seen.page.value(
                f'(() => {{ {axe} }})(), axe.run().then(found => JSON.stringify('
                'found.violations.map(v => [v.id, ...v.nodes.map(node => node.html)])))'))
            assert found == []

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_a_plot_follows_what_is_tuned_and_all_can_be_downloaded(show, looked_at, tmp_path):
    walker = {**LEG, 'leg.scale': 0.01, 'leg.leg_pairs': 2, 'leg.crank.speed': -2.0}
    running = show(walker)

    async def doing(seen):
        page, section = seen.page, seen.section('leg')
        plot = f'{section}.querySelector(".plot")'

        async def plotted(m):
            leg = mechanisms.create('jansen', m=m)
            rates = leg.joint_rates(np.radians(np.arange(-180.0, 181.0)), ['G.x'])['G.x']
            low, high = sorted((f'{-20.0 * rate:.4g}' for rate in (rates.min(), rates.max())),
                               key=float)
            await browser.until(lambda: page.value(f"""(() => {{
                ({plot}).closest('details').open = true;
                for (const [what, value] of [['Quantity', 'velocity'], ['Output', 'G.x']]) {{
                    const select = {section}.querySelector(`select[aria-label=${{what}}]`);
                    if (select.value === value) continue;
                    select.value = value;
                    select.dispatchEvent(new Event('change'));
                }}
                return {plot}.ariaLabel?.startsWith(
                    'Velocity of G.x with the crank at -114.6 °/s: from {low} to {high} mm/s.');
            }})()"""))

        await seen.output('leg', 'BC')
        await page.value('document.getElementById("workshop").click()')
        await plotted(15.0)

        async def feet_on_both_sides():
            columns = coloured(picture := await seen.canvas(), *GREEN)[:, 1]
            middle = picture.shape[1] / 2
            return (columns < middle - 20).sum() > 50 and (columns > middle + 20).sum() > 50

        await browser.until(feet_on_both_sides)
        await seen.write('leg', 'm', '160')
        await plotted(16.0)

        async def known():
            # The viewer is told of what was set a moment later, and downloads are what it knows.
            async with Page(running.viewer.url) as other:
                settings = (await other.cast('/leg'))['/leg']['settings']
            start, = (each['value'] for each in settings if each['name'] == 'crank.start')
            return [start] == running.values('leg.crank.start') and abs(
                start - 0.5 * math.pi) < 0.1

        await page.value(f'{plot}.scrollIntoView()')
        x, y, width = await page.middle(f'{plot}.querySelector(".u-over")')
        await page.drag((x, y), (x + width / 4, y))
        await browser.until(known)
        await page.downloads(tmp_path)
        for form in ('CSV', 'PNG', 'URDF', 'C'):
            await page.value(f"""[...{section}.querySelectorAll('button')].find(
                button => button.textContent === '{form}').click()""")
        files = [tmp_path / f'leg.{ending}' for ending in ('csv', 'png', 'urdf', 'h')]
        await browser.until(lambda: all(file.exists() for file in files))
        size = await page.value('[picture.width, picture.height]')
        assert list(Image.open(files[1]).size) == size

    looked_at(running, doing)
    start, = set(running.values('leg.crank.start'))
    machine = scene.read({**walker, 'leg.dimensions.m': 16.0,
                          'leg.crank.start': start}).machines['leg']
    table = np.genfromtxt(tmp_path / 'leg.csv', delimiter=',', names=True, deletechars='"')
    theta = np.linspace(-math.pi, math.pi, 361)
    np.testing.assert_allclose(table['crank_[rad]'], theta, atol=1e-11)
    np.testing.assert_allclose(table['position_G.x_[m]'], 0.01 * machine.linkage.solve(
        theta, ['G'])['G'][:, 0], rtol=1e-9, atol=1e-12)
    assert (tmp_path / 'leg.urdf').read_text() == urdf.describe([machine], 'world')
    assert (tmp_path / 'leg.h').read_text() == header.written(machine)


@pytest.mark.long
@needs_browser
def test_a_reload_and_another_viewer_keep_what_is_seen_and_a_lost_connection_is_said(
        show, looked_at):
    running = show({**LEVER, 'drop.scale': 0.1})

    async def doing(seen):
        page = seen.page
        await seen.view('drop')
        assert await seen.output('drop', 'P.y') != 0.0
        await page.value('(workshop.click(), arrows.value = "velocity",'
                         ' arrows.dispatchEvent(new Event("change")))')
        # A bar of 1, scale 0.1, is 100 mm long in the picture.
        await browser.until(lambda: seen.number('drop', 'a'))
        assert await seen.number('drop', 'a') == 100.0
        await seen.write('drop', 'speed', '100')
        await browser.until(lambda: running.values('drop.crank.speed')[0] == pytest.approx(
            math.radians(100.0)))
        play = f'{seen.section("drop")}.querySelector("button")'
        await page.value(f'{play}.click()')
        await browser.until(lambda: running.values('drop.crank.speed') == [0.0])
        await page.value('document.getElementById("picture").focus()')
        for _ in range(3):
            await page.press('+')
        await page.open(running.viewer.url)
        await browser.until(lambda: page.value(
            'document.querySelectorAll("section").length === 1 && '
            f'!!{seen.section("drop")}?.querySelector("tbody tr")'))
        assert await page.value('document.getElementById("workshop").checked')
        assert await page.value('document.getElementById("arrows").value') == 'velocity'
        assert await page.value('document.getElementById("notice").hidden')
        await page.value(f'{play}.click()')
        await browser.until(lambda: running.values('drop.crank.speed')[0] == pytest.approx(
            math.radians(100.0)))
        url = running.viewer.url
        running.graph.end(running.viewer)
        await browser.until(lambda: page.value(
            '/^Connection lost/.test(document.getElementById("notice").textContent)'))
        running.viewer = running.graph.start(Viewer, {'port': int(re.search(r'(\d+)/$', url)[1])})
        await browser.until(lambda: page.value('document.getElementById("notice").hidden'))
        await browser.until(lambda: page.value(
            f'document.querySelectorAll("section").length === 1 && !!{seen.section("drop")}'))
        # It is zoomed still: there is a way back to the whole picture.
        await seen.page.click('document.getElementById("whole")')
        await browser.until(lambda: page.value('document.getElementById("whole").hidden'))
        page.complaints.clear()

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_a_phone_may_reload_the_page_as_often_as_it_likes(show, looked_at):
    given = without_defaults(scene.load(str(ROOT / 'config' / 'all.yaml')))
    running = show({**given, 'rate': 20.0})

    async def doing(seen):
        await seen.page.resize(390, 844, 'light')
        for _ in range(180):
            await seen.page.open(running.viewer.url)
            await browser.until(lambda: seen.page.value(
                'document.querySelectorAll("section").length === 4 && '
                'document.querySelectorAll("section tbody tr").length > 3'))

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_mechanisms_of_one_name_in_two_namespaces_are_told_apart(graph, show, looked_at):
    for space in ('left', 'right'):
        for kind in (CrankDriver, Kinematics):
            graph.start(kind, {'mechanisms': ['arm'], 'arm.type': 'four_bar',
                               'frame_prefix': f'{space}/'}, namespace=space)
    running = show({}, kinds=())

    async def doing(seen):
        await browser.until(lambda: seen.page.value(
            '[...document.querySelectorAll("#views button, section h2")].map('
            'one => one.textContent).join()'
            ' === "all,left/arm,right/arm,left/arm,right/arm"'))

        async def beside():
            """Return whether two loci are seen beside each other: the frames are two."""
            columns = np.unique(coloured(await seen.canvas(), *GREEN)[:, 1])
            return len(columns) and (np.diff(columns) > 30).sum() == 1

        await browser.until(beside)

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_mechanisms_are_in_their_natural_order(show, looked_at):
    running = show({**RATE, 'mechanisms': ['m10', 'm1', 'm2'], **{
        f'm{number}.type': 'four_bar' for number in (1, 2, 10)}})

    async def doing(seen):
        await browser.until(lambda: seen.page.value(
            '[...document.querySelectorAll("#views button, section h2")].map('
            'one => one.textContent).join() === "all,m1,m2,m10,m1,m2,m10"'))

    looked_at(running, doing)


# A crank and a rocker whose names are as long as names may be.
LONG = {'mechanisms': ['m' * 64], **{f'{"m" * 64}.{name}': value for name, value in {
    'type': 'custom', 'crank' + 'k' * 59 + '.speed': 1.0, 'dimensions.r': 1.234567,
    'loads': ['D=100 20', f'B{"y" * 63}=-4 200'],
    'joints': [
        'O ground 0 0', 'Q ground 3 0', f'A{"x" * 63} crank O r called crank{"k" * 59}',
        f'B{"y" * 63} dyad A{"x" * 63} Q 2.5 2 left', f'D line O A{"x" * 63} 2'],
}.items()}}


@pytest.mark.long
@needs_browser
@pytest.mark.parametrize('scale', [1e-6, 1.0, 1e6])
def test_nothing_is_cut_in_a_narrow_window_however_long(show, looked_at, scale):
    name, = LONG['mechanisms']
    running = show({**RATE, **LONG, f'{name}.scale': scale})

    async def doing(seen):
        page = seen.page
        await page.value('document.getElementById("arrows").value = "force",'
                         'document.getElementById("arrows").onchange()')
        for width, click in ((320, False), (1200, False), (320, True)):
            await page.resize(width, 568, 'light')
            if click:
                await page.value('document.getElementById("workshop").click()')
            await seen.output(name, 'D.x')
            assert await page.value('document.documentElement.scrollWidth') <= width
            assert await page.value(
                '[...document.querySelectorAll("button, th, td, h2, input[type=text], .row > *")]'
                '.filter(one => one.offsetParent && one.scrollWidth > one.clientWidth + 1 &&'
                ' getComputedStyle(one).display !== "inline").map(one => one.outerHTML)') == []

    looked_at(running, doing)


@pytest.mark.slow
@needs_browser
def test_a_number_has_room_in_its_field_and_all_the_digits_that_have(address, tmp_path):
    given = [sign * value * 10.0 ** power for sign in (1.0, -1.0)
             for value in (1.0, 1.234567891, 9.99999999) for power in range(-300, 300)]

    async def look():
        async with browser.Browser(tmp_path) as page:
            await page.open(address)
            return await page.value('import("/units.js").then(({ figures }) =>'
                                    f' {given}.map(value => figures(value, 6)))')

    for value, text in zip(given, asyncio.run(look())):
        assert len(text) <= 9
        digits = 3 if abs(math.log10(abs(value))) > 99.0 else 4
        assert float(text) == pytest.approx(value, rel=10.0 ** (1 - digits))
        if 1.0 <= abs(value) < 1e5:
            assert float(text) == float(f'{value:.6g}')


@pytest.mark.long
@needs_browser
def test_a_linkage_in_space_is_drawn_whole_and_says_what_the_page_does_not(
        show, looked_at, tmp_path):
    ankle = scene.load(str(ROOT / 'examples' / 'ankle.yaml'))
    running = show({**without_defaults(ankle), 'rate': 20.0})

    async def doing(seen):
        async def whole():
            picture = await seen.canvas()
            places = coloured(picture, *BLUE)
            if not len(places):
                return False
            height, width, _ = picture.shape
            low, high = places.min(axis=0), places.max(axis=0)
            return (low > 20).all() and (high < (height - 20, width - 20)).all() \
                and high[0] - low[0] > 0.5 * height

        await browser.until(whole)
        text = await seen.page.value(f'{seen.section("ankle")}.innerText')
        assert 'ankle is a linkage in space' in text
        assert '+1' in text and '\N{MINUS SIGN}1' in text and 'Plot' not in text
        await seen.page.downloads(tmp_path)
        await seen.page.value(f"""[...{seen.section('ankle')}.querySelectorAll('button')].find(
            button => button.textContent === 'C').click()""")
        await browser.until((tmp_path / 'ankle.h').exists)

    looked_at(running, doing)
    assert (tmp_path / 'ankle.h').read_text() == header.written(ankle.machines['ankle'])


@pytest.mark.long
@needs_browser
def test_an_enlarged_plot_fits_any_window(show, looked_at):
    running = show(LEG)

    async def doing(seen):
        page, plot = seen.page, f'{seen.section("leg")}.querySelector(".plot")'
        await page.value(f'({plot}).closest("details").open = true')
        await browser.until(lambda: page.value(f'/^Position/.test({plot}.ariaLabel)'))
        enlarge = ('[...document.querySelectorAll("button")].find('
                   'button => button.textContent === "Enlarge")')
        await page.value(f'{enlarge}.scrollIntoView()')
        await page.click(enlarge)
        await browser.until(lambda: page.value('!!document.fullscreenElement'))
        for width, height in ((1400, 900), (390, 844), (844, 390)):
            await page.resize(width, height, 'light')

            async def fits(width=width):
                wide = await page.value(f'{plot}.querySelector("canvas").clientWidth')
                return 0.8 * width < wide < width

            await browser.until(fits)
            assert await page.value('document.fullscreenElement.scrollWidth') <= width

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_a_curve_is_not_drawn_through_a_pole_however_small_the_plot(show, looked_at):
    running = show(LEG)

    async def doing(seen):
        page, plot = seen.page, f'{seen.section("leg")}.querySelector(".plot")'
        await page.resize(390, 844, 'light')
        await browser.until(lambda: page.value(f"""(() => {{
            ({plot}).closest('details').open = true;
            const select = {seen.section('leg')}.querySelector('select[aria-label=Quantity]');
            if (select.value !== 'force ratio') {{
                select.value = 'force ratio';
                select.dispatchEvent(new Event('change'));
            }}
            return /^Force ratio of BC: .* and beyond/.test({plot}.ariaLabel);
        }})()"""))
        # In each column, the part of the plot's height that is blue, however pale.
        blue = await page.value(f"""(() => {{
            const canvas = {plot}.querySelector('canvas'), {{ width, height }} = canvas;
            const {{ data }} = canvas.getContext('2d').getImageData(0, 0, width, height);
            return Array.from({{ length: width }}, (_, x) => Array.from({{ length: height }},
                (_, y) => data.subarray(4 * (x + y * width), 4 * (x + y * width) + 4)).filter(
                ([red, , blue, seen]) => seen && blue > red + 8).length / height);
        }})()""")
        assert max(blue) < 0.6 and sum(part > 0.0 for part in blue) > 200

    looked_at(running, doing)


# Names of joints, none on another, cut, or nearer to another's joint.
NAMES = """
import('/picture.js').then(({ Picture }) => {
  let seed = 7;
  const random = () => (seed = seed * 16807 % 2147483647) / 2147483647;
  return Array.from({ length: 300 }, () => {
    const picture = new Picture(document.getElementById('picture')), written = [];
    const places = [];
    while (places.length < 8) {
      const [x, y] = [390 * random(), 380 * random()];
      if (places.every(([a, b]) => Math.hypot(x - a, y - b) > 70)) places.push([x, y]);
    }
    const points = places.map((_, i) => 'joint'.slice(i % 4));
    Object.assign(picture, { scale: 1, middle: [0, 0], centre: [0, 0],
      canvas: { clientWidth: 390, clientHeight: 380 } });
    picture.at = (x, y) => [x, y];
    picture.text = (name, x, y) => written.push([x, y, picture.context.measureText(name).width]);
    picture.names([{ mechanism: { points }, kind: 'joints', width: 6,
      places: Float64Array.from(places.flat()) }]);
    return [places, written];
  });
})"""


@pytest.mark.slow
@needs_browser
def test_names_of_joints_are_whole_apart_and_beside_their_own(address, tmp_path):
    async def look():
        async with browser.Browser(tmp_path) as page:
            await page.open(address)
            return await page.value(NAMES)

    for joints, written in asyncio.run(look()):
        x, y, width = np.transpose(written)
        assert (x - 0.5 * width).min() > 0.0 and (x + 0.5 * width).max() < 390.0
        assert y.min() > 8.0 and y.max() < 372.0
        apart = np.maximum(abs(y[:, None] - y) / 16.0,
                           2.0 * abs(x[:, None] - x) / (width[:, None] + width))
        assert apart[~np.eye(len(x), dtype=bool)].min() > 1.0 - 1e-9
        away = np.hypot(*(np.maximum(abs(own[:, None] - of) - half, 0.0) for own, of, half in zip(
            (x, y), np.transpose(joints), (0.5 * width[:, None], 8.0))))
        assert (away.argmin(axis=1) == np.arange(len(x))).all()


@pytest.mark.long
@needs_browser
def test_arrows_are_asked_for_wherever_their_mechanism_s_part_of_the_panel_is(show, looked_at):
    running = show(LEVER)

    async def doing(seen):
        page = seen.page
        await page.resize(1200, 200, 'light')
        await page.value("""(() => {
            const { send } = WebSocket.prototype;
            window.asked = new Set();
            WebSocket.prototype.send = function (text) {
                const { mechanism, arrows } = JSON.parse(text);
                if (arrows) window.asked.add(mechanism);
                send.call(this, text);
            };
            document.getElementById('arrows').value = 'velocity';
            document.getElementById('arrows').onchange();
        })()""")
        await browser.until(lambda: page.value('window.asked.size === 2'))

    looked_at(running, doing)


@pytest.mark.long
@needs_browser
def test_a_picture_that_cannot_be_drawn_does_not_keep_the_next_one_from_being_drawn(
        show, looked_at):
    running = show(LEVER)

    async def doing(seen):
        page = seen.page
        await page.value("""(() => {
            const context = document.getElementById('picture').getContext('2d');
            const { clearRect } = context;
            window.drawn = 0;
            context.clearRect = function (...where) {
                window.drawn += 1;
                if (window.drawn === 3) throw new Error('nothing can be drawn');
                clearRect.apply(context, where);
            };
        })()""")
        await browser.until(lambda: page.value('window.drawn > 10'))
        assert len(page.complaints) == 1
        page.complaints.clear()

    looked_at(running, doing)


def test_where_an_input_is_that_nobody_has_named_is_not_guessed(graph, show):
    running = show(LEG, kinds=(Kinematics,))
    crank_states = graph.node.create_publisher(JointState, 'crank_states', 10)

    async def use(url):
        async with Page(url) as page:
            await page.cast('/leg')
            reason = (await page.ask('pose', '/leg'))['reason']

            async def heard():
                crank_states.publish(JointState(name=['leg_crank'], position=[2.0]))
                return (await page.ask('pose', '/leg')).get('inputs')

            return reason, (await browser.until(heard))['crank']

    reason, value = asyncio.run(use(running.viewer.url))
    assert reason == 'the crank is not known yet: no message names leg_crank'
    assert value == pytest.approx(2.0)


@pytest.mark.slow
@needs_browser
def test_a_foreign_page_is_not_let_in(address, tmp_path):
    async def look():
        async with browser.Browser(tmp_path) as page:
            await page.open('about:blank')
            return await page.value(
                'new Promise(done => {'
                f'  const socket = new WebSocket("{address.replace("http", "ws")}socket");'
                '  socket.onopen = () => done("open");'
                '  socket.onerror = () => done("refused");'
                '})')

    assert asyncio.run(look()) == 'refused'
