# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A running scene with a viewer, and what looks at it: a browser, or the other end of a socket."""

import contextlib
import itertools
import json
from pathlib import Path
import resource
import threading

import aiohttp
import browser
from browser import run, until
from linkage_ros import scene
from linkage_ros.nodes import messages
from linkage_ros.nodes.crank_driver import CrankDriver
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.nodes.servo_inverse import ServoInverse
from linkage_ros.web.viewer import Viewer
import numpy as np
import pytest
import rclpy
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.task import Future
from ros_harness import InvalidHandle
from scenes import ROOT
from visualization_msgs.msg import MarkerArray

PAGE = ROOT / 'linkage_ros' / 'web' / 'page'
NODES = (CrankDriver, Kinematics, ServoInverse)
RATE = {'rate': 40.0}
LEVER = {**RATE, 'mechanisms': ['lever', 'drop'], 'lever.type': 'slotted_lever',
         'drop.type': 'water_drop'}
LEG = {**RATE, 'mechanisms': ['leg'], 'leg.type': 'jansen', 'leg.crank.speed': 0.0,
       'leg.crank.start': 1.0}
CLOSED = aiohttp.WSMsgType.CLOSE, aiohttp.WSMsgType.CLOSING, aiohttp.WSMsgType.CLOSED

needs_browser = pytest.mark.skipif(
    not browser.executable(), reason=f'none of {", ".join(browser.NAMES)} is installed')


class Show(contextlib.ExitStack):
    """The nodes of a scene and a viewer, at work in a thread of their own."""

    def __init__(self, graph, parameters, kinds=NODES, **kwargs):
        super().__init__()
        self.graph = graph
        self.names = scene.read(parameters).mechanisms if parameters else ()
        self.viewer = graph.start(Viewer, {'port': 0})
        self.nodes = [graph.start(kind, parameters, **kwargs) for kind in kinds]
        self._over = Future()
        thread = threading.Thread(target=self._work, daemon=True)
        thread.start()
        self.callback(thread.join)
        self.callback(self._over.set_result, None)

    def _work(self):
        while not self._over.done():
            # Another thread ends a node while this one waits for it.
            with contextlib.suppress(InvalidHandle):
                self.graph.executor.spin_until_future_complete(self._over)

    @property
    def url(self):
        """Return the address of the page."""
        return self.viewer.url

    def page(self, **kwargs):
        """Return a page that knows the scene, and is closed at the end."""
        page = self.enter_context(Page(self.url, **kwargs))
        page.mechanisms(*(f'/{name}' for name in self.names))
        return page

    def values(self, name):
        """Return the value of a parameter on each node that has it."""
        return [node.get_parameter(name).value for node in self.nodes if node.has_parameter(name)]

    def value(self, name):
        """Return the value of a parameter on the node that has it."""
        value, = self.values(name)
        return value

    def set(self, name, value):
        """Set a parameter where it is, as somebody else does."""
        for node in self.nodes:
            if node.has_parameter(name):
                node.set_parameters([type(node.get_parameter(name))(name, value=value)])

    def entities(self):
        """Return how many subscriptions and clients the viewer has."""
        return len(list(self.viewer.subscriptions)), len(list(self.viewer.clients))


class Page:
    """What a browser knows, without the browser: the other end of the WebSocket."""

    def __init__(self, url, lazy=False, **kwargs):
        self._url, self._lazy, self._kwargs = url.replace('http', 'ws') + 'socket', lazy, kwargs
        self._ids = itertools.count(1)
        self.messages, self.frames, self.pictures, self.end = [], {}, 0, None

    def __enter__(self):
        run(self._open())
        return self

    def __exit__(self, *_):
        run(self._close())

    async def _open(self):
        self._session = aiohttp.ClientSession()
        try:
            self._socket = await self._session.ws_connect(self._url, **self._kwargs)
        except BaseException:
            await self._session.close()
            raise
        self._reading = browser.task(self._read())

    async def _close(self):
        await self._socket.close()
        await self._reading
        await self._session.close()

    async def _read(self):
        while (message := await self._socket.receive()).type not in CLOSED:
            if message.type == aiohttp.WSMsgType.TEXT:
                self.messages.append(message.json())
                continue
            for head, points in framed(message.data):
                self.frames[head['key'], head['topic']] = head['markers'], points
            self.pictures += 1
            if not self._lazy:
                await self._socket.send_json('drawn')
        self.end = message.data, message.extra

    def send(self, data, kind=aiohttp.WSMsgType.TEXT):
        """Send a text or bytes as a WebSocket frame."""
        run(self._socket.send_frame(data if isinstance(data, bytes) else data.encode(), kind))

    def message(self, op, **fields):
        """Return the first message with these fields."""
        return until(lambda: [message for message in self.messages if {
            **message, 'op': op, **fields} == message], (op, fields))[0]

    def setting(self, key, name, value):
        """Return the first description of a mechanism in which a parameter has a value."""
        return until(lambda: [about for about in self.messages if about['op'] == 'mechanism'
                              and about['key'] == key and any(
                                  (one['name'], one['value']) == (name, value)
                                  for one in about['settings'])], (key, name, value))[0]

    def mechanisms(self, *keys):
        """Return the mechanisms by key, when these are all there are, with settings."""
        def known():
            scenes = [message for message in self.messages if message['op'] == 'scene']
            shown = {about['key']: about for about in scenes[-1]['mechanisms']} if scenes else {}
            return (scenes and shown.keys() == set(keys) and all(
                about['settings'] for about in shown.values())) and (shown or {None: None})

        return until(known, keys)

    def ask(self, op, **fields):
        """Return the answer to a request."""
        number = next(self._ids)
        self.send(json.dumps({'op': op, 'id': number, **fields}))
        return self.message('answer', id=number)

    def pose(self, key, **want):
        """Return the answer to a request for a pose: by output and value, or joint and place."""
        return self.ask('pose', key=key, **({'want': want} if want else {}))

    def set(self, key, **values):
        """Set parameters, __ for a point; return the reason of a refusal, or nothing."""
        return self.ask('set', key=key, values={
            name.replace('__', '.'): value for name, value in values.items()})['reason']

    def drawn(self, key, kind):
        """Return the points of a mechanism's markers of a kind."""
        return np.concatenate([np.empty((0, 3)), *(
            part for (name, _), (markers, points) in [*self.frames.items()] if name == key
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


# Those that are lit are pointed at.
COLOURS = {'joints': (138, 138, 138), 'bars': (0, 129, 201), 'locus': (0, 158, 115),
           'lit bars': (204, 121, 167)}


def coloured(picture, what):
    """Return the rows and columns of the pixels that have the colour of something."""
    return np.argwhere((abs(picture - COLOURS[what]) < 12).all(axis=2))


class Seen(browser.Browser):
    """What a browser shows of the page."""

    def visit(self, url):
        """Load the page of a viewer, as one who has not seen it."""
        self.complaints.clear()
        self.requests.clear()
        self._url = url
        self.resize()
        self.open(url)
        self.becomes('!!document.querySelector("section")')

    def leave(self):
        """Check that nothing went wrong, and nothing came from elsewhere."""
        complaints, requests = [*self.complaints], [*self.requests]
        self.value('sessionStorage.clear()')
        self.open('about:blank')
        assert complaints == [], str(complaints)[:3000]
        assert all(url.startswith((self._url, 'ws://127.0.0.1:', 'blob:', 'about:'))
                   for url in requests)

    def becomes(self, expression):
        """Wait until an expression of the page is true; return it."""
        return until(lambda: self.value(expression), expression)

    def section(self, name):
        """Return the expression for a mechanism's part of the panel."""
        return f'document.querySelector(`section[data-key="/{name}"]`)'

    def row(self, name, label):
        """Return the expression for a slider's row."""
        return (f'[...{self.section(name)}.querySelectorAll(".row")].find('
                f'row => row.querySelector("label")?.textContent === "{label}")')

    def button(self, text, within='document'):
        """Return the expression for a button by its text."""
        return (f'[...{within}.querySelectorAll("button")].find('
                f'button => button.textContent === "{text}")')

    def slide(self, name, label, part):
        """Drag a slider from where it is to a part of its way."""
        slider = f'{self.row(name, label)}.querySelector("input")'
        self.becomes(f'!{slider}.disabled')
        x, y, width = self.middle(slider)
        at = self.value(f'(({slider}).value - ({slider}).min) / (({slider}).max - ({slider}).min)')
        left, inner = x - 0.5 * width + 8.0, width - 16.0
        self.drag((left + at * inner, y), (left + part * inner, y))

    def reason(self, name, label):
        """Return the reason that is shown at a slider, or nothing."""
        return self.value(f'(line => line.hidden ? "" : line.textContent)'
                          f'({self.row(name, label)}.querySelector(".reason"))')

    def number(self, name, label):
        """Return the number that a slider shows."""
        return float(self.value(
            f'{self.row(name, label)}.querySelector("input[type=text]").value'))

    def output(self, name, label):
        """Return the value that is shown of an output, when it is shown."""
        return float(self.becomes(
            f'{self.section(name)}.querySelector(`td input[aria-label="{label}"]`)?.value'))

    def type(self, name, label, text):
        """Write a number beside a slider."""
        self.write(f'{self.row(name, label)}.querySelector("input[type=text]")', text)

    def choose(self, name, label, value):
        """Choose an option of a select by its label."""
        self.value(f"""(select => {{
            if (select.value === '{value}') return;
            select.value = '{value}';
            select.dispatchEvent(new Event('change'));
        }})({name}.querySelector('select[aria-label={label}]'))""")

    def view(self, name):
        """Show one mechanism."""
        def shown():
            self.click(self.button(name, 'document.getElementById("views")'))
            return self.value('document.querySelectorAll("section").length === 1 && '
                              f'!!{self.section(name)}?.querySelector("tbody tr")')

        until(shown)

    @property
    def top(self):
        """Return where the picture begins on the page."""
        return self.value('picture.getBoundingClientRect().y')

    def canvas(self):
        """Return what is seen of the picture."""
        return self.picture()[int(self.top):, :int(self.value('picture.clientWidth'))]

    def is_still(self):
        """Return whether the picture is drawn and stands still."""
        before = self.canvas()
        return len(coloured(before, 'locus')) > 100 and (self.canvas() == before).all()

    def upright_lever(self):
        """Return where the tip and the pivot of a lever that stands upright are on the page."""
        self.value('names.checked && names.click()')
        until(self.is_still)
        # The numbers of the grid are left out: they are grey too.
        rows, columns = coloured(self.canvas()[:-40, 80:], 'joints').T + [[0], [80]]
        return ((float(columns[rows < rows.min() + 10].mean()), self.top + int(rows.min()) + 8),
                (float(columns[rows > rows.max() - 10].mean()), self.top + int(rows.max()) - 8))


def walker(step, legs=2, frame='world', width=1.0):
    """Return a message as kinematics sends it."""
    made = messages.Markers('leg', frame, (0.0, 1.0, 2.0, 0.5, 0.0, 0.0), width,
                            {0: [(0, 1), (1, 2)], 1: range(3)})
    places = np.random.default_rng(step).normal(size=(legs, 3, 2))
    stamp = rclpy.time.Time(nanoseconds=1 + 10 ** 9 * step).to_msg()
    return serialize_message(made.message(stamp, places))


def parts(numbers):
    """Return the numbers of a message such as a Point, in order."""
    return [getattr(numbers, name) for name in numbers.get_fields_and_field_types()]


def spoilt(part, number):
    """Return a message that cannot be drawn for one number in it."""
    message = deserialize_message(walker(1), MarkerArray)
    marker = message.markers[0]
    parts = marker.points[0], marker.pose.position, marker.pose.orientation, marker.scale
    parts[part].x = number
    return serialize_message(message)


def resident():
    """Return the memory that this process holds [MB]."""
    return int(Path('/proc/self/statm').read_text().split()[1]) * resource.getpagesize() / 1e6
