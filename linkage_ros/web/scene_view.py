# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The running scene for the page: what nodes announce, its markers, and changes by services."""

from __future__ import annotations

import asyncio
from collections import ChainMap, defaultdict
from contextlib import suppress
from functools import partial
from itertools import starmap
import math
from typing import Any, Callable, Mapping, NamedTuple, Sequence

from rcl_interfaces.msg import ParameterEvent
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.client import Client
from rclpy.node import Node, NodeNameNonExistentError
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from visualization_msgs.msg import Marker, MarkerArray

from . import curves, poses
from .feed import Feed
from .. import scene
from ..c_code import header
from ..nodes import ownership
from ..nodes.log import Throttle
from ..nodes.parameters import typed
from ..nodes.publishers import LATCHED
from ..robot_model import urdf
from ..scene import SceneError, SceneMechanism, writing
from ..scene.inverse_request import present_inputs
from ..words import short_repr

EVENTS_TYPE, INPUTS_TYPE = 'rcl_interfaces/msg/ParameterEvent', 'sensor_msgs/msg/JointState'
SETTER = 'set_parameters_atomically'
# Between two looks at the graph; from the last page that is closed to the end of observation.
POLL_S, LINGER_S = 1.0, 1.0
# For the first announcement of a node, and a response; between two looks for one of these.
MAX_ANNOUNCE_S, MAX_ANSWER_S, RETRY_S = 1.0, 3.0, 0.005

# Downloads: ending, name and description. The last two are of linkages in a plane only; the page
# itself draws the picture.
FORMS = (
    ('yaml', 'scene file', 'The scene as it is now'), ('png', 'PNG', 'The present view'),
    ('h', 'C', 'A C99 header for a microcontroller'),
    ('csv', 'CSV', 'All outputs over a turn or a stroke, in radians and metres, the input at '
     '1 rad/s or 1 m/s'), ('urdf', 'URDF', 'The robot model'))

JsonObject = dict[str, Any]

NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


class ShownMechanism(NamedTuple):
    """
    A mechanism on the page: prefix of its topics, name, node, and topics of its inputs.

    `nodes` has the node that announces a parameter, by full name.
    """

    key: str
    name: str
    owner: str
    sources: Sequence[str]
    nodes: Mapping[str, str]


class SceneView:
    """
    All mechanisms that nodes announce, while a page is open; otherwise it subscribes to nothing.

    All methods run in the web's thread, and callbacks of subscriptions in that of the executor.

    Parameters
    ----------
    node : rclpy.node.Node
        A node that some executor spins.

    Attributes
    ----------
    clients : list
        Open pages, of class Client: they receive messages by `tell`, markers by `offer`.
    loop : asyncio.AbstractEventLoop
        The web's event loop, which its server sets.

    """

    def __init__(self, node: Node) -> None:
        self.clients: list[Any] = []
        self.loop: asyncio.AbstractEventLoop
        self._node = node
        self._throttle = Throttle(node.get_logger())
        # The topic on which a node announces its parameters, and those of its inputs.
        self._graph: dict[str, tuple[str, list[str]]] = {}
        self._is_stale = True
        self._mechanisms: dict[str, ShownMechanism] = {}
        # By node: the values that it announces by full name, the scene that was read from them,
        # and the last speeds of that other than zero.
        self._announced: dict[str, dict[str, Any]] = {}
        self._scenes: dict[str, scene.Scene] = {}
        self._speeds: dict[str, dict[str, float]] = defaultdict(dict)
        self._news = asyncio.Event()
        self._watching: asyncio.Task[None] | None = None
        # Subscriptions and clients of services by name, feeds of markers by topic.
        self._entities: dict[str, Any] = {}
        self._feeds: dict[str, Feed] = {}
        # The source joints of all mechanisms; the last position by topic, then by source joint,
        # from the executor's thread.
        self._sources: set[str] = set()
        self._positions: dict[str, dict[str, float]] = defaultdict(dict)

    def add(self, client: Any) -> None:
        """Add a client; the first one starts the observation of the graph."""
        self.clients.append(client)
        if self._watching:
            self._show(client)
        else:
            self._watching = asyncio.create_task(self._watch())

    def remove(self, client: Any) -> None:
        """Remove a client; after the last one the observation ends, unless it was a reload."""
        self.clients.remove(client)
        self._news.set()

    async def set(self, key: str, values: Mapping[str, Any]) -> JsonObject:
        """
        Set parameters of a mechanism, those of one node all or none.

        Raises
        ------
        SceneError
            With the node's reason.

        """
        shown = self._find(key)
        parameters, requests = self._settings(shown), defaultdict(list)
        for name, value in values.items():
            parameter = parameters[name]
            checked = parameter.field.checked(parameter.name, value)
            requests[shown.nodes[parameter.name]].append(
                typed(parameter._replace(value=checked)).to_parameter_msg())
        for node, messages in requests.items():
            response = await self._call(
                self._entities[f'{node}/{SETTER}'],
                SetParametersAtomically.Request(parameters=messages))
            if not response.result.successful:
                raise SceneError(response.result.reason or f'{node} gives no reason')
        return {}

    async def pose(self, key: str, want: Mapping[str, Any] | None = None,
                   arrows: str = '') -> JsonObject:
        """
        Describe a mechanism's pose; with a request, move it there first and hold it.

        Arguments are those of `poses.reached`, and a kind of arrows, at the speeds when it plays.
        The result is that of `poses.described`, with requested arrows, and what is reached if the
        request is not met exactly.
        """
        shown = self._find(key)
        (mechanism, inputs), reach = self._state(shown), None
        if want is not None:
            inputs, reach = poses.reached(mechanism, inputs, dict(want))
            await self._hold(shown, mechanism, inputs)
        answer = {**poses.described(mechanism, inputs), 'reach': reach}
        if arrows:
            answer['arrows'] = poses.arrows(mechanism, inputs, arrows, self._playing(shown))
        return answer

    async def _hold(self, shown: ShownMechanism, mechanism: SceneMechanism,
                    inputs: list[float]) -> None:
        """Stop the inputs at requested values."""
        values = {}
        for (name, settings), received in zip(mechanism.inputs.items(), inputs):
            value = poses.inside(settings, received)
            if f'{mechanism.name}.{name}.start' not in shown.nodes:
                raise SceneError(f'the {name} cannot be moved: no crank_driver is running')
            # An input moves only to a start that differs from the last one.
            values[f'{name}.start'] = next(
                start for way in (value, -math.inf, math.inf) if settings.start != (
                    start := poses.inside(settings, math.nextafter(value, way))))
            values[f'{name}.speed'] = 0.0
        await self.set(shown.key, values)

    async def tune(self, key: str) -> JsonObject:
        """Return the result of `poses.tunable`."""
        return await asyncio.to_thread(poses.tunable, self._mechanism(self._find(key)))

    async def curve(self, key: str, **about: Any) -> JsonObject:
        """Return the result of `curves.curve`."""
        return await asyncio.to_thread(curves.curve, *self._state(self._find(key)), **about)

    async def export(self, key: str, form: str) -> JsonObject:
        """Return a file's text: 'yaml', the scene; 'csv', all outputs; 'urdf'; or 'h', of C."""
        shown = self._find(key)
        mechanism = self._mechanism(shown)
        write = {'yaml': lambda: self._saved(shown.owner),
                 'csv': lambda: curves.table(*self._state(shown)),
                 'urdf': lambda: urdf.describe([mechanism], self._scenes[shown.owner].frame_id),
                 'h': lambda: header.written(mechanism)}[form]
        return {'text': await asyncio.to_thread(write)}

    def _saved(self, owner: str) -> str:
        """Return a parameter file of a node's scene: its definition and changed values."""
        current = self._scenes[owner]
        names = {parameter.name for parameter in current.parameters}
        # An input that was stopped is saved with the speed that it had.
        speeds = {name: speed for name, speed in self._speeds[owner].items() if name in names}
        return writing.in_yaml(writing.without_defaults(scene.changed(current, speeds)))

    async def read(self, text: str) -> JsonObject:
        """Return the result of `poses.number`."""
        return poses.number(str(text))

    def warn(self, text: str, subject: str = '') -> None:
        """Log a throttled warning about a subject."""
        self._throttle.warn(subject, lambda: text)

    async def _call(self, client: Any, request: Any) -> Any:
        """Return a service's response; raise SceneError if there is none in time."""
        if await self._until(client.service_is_ready, MAX_ANSWER_S):
            response = client.call_async(request)
            if await self._until(response.done, MAX_ANSWER_S):
                return response.result()
            client.remove_pending_request(response)
        raise SceneError(f'{client.srv_name} does not answer')

    async def _until(self, holds: Callable[[], bool], seconds: float) -> bool:
        """Wait until something holds, at most some time; return whether it does."""
        end = self.loop.time() + seconds
        while not holds() and self.loop.time() < end:
            await asyncio.sleep(RETRY_S)
        return holds()

    def _hand_over(self, function: Callable[..., Any], *args: Any) -> None:
        """Run a function in the web's thread, if that is still running."""
        with suppress(RuntimeError):
            self.loop.call_soon_threadsafe(function, *args)

    def _state(self, shown: ShownMechanism) -> tuple[SceneMechanism, list[float]]:
        """Return a mechanism and its last received inputs [rad or m], or their starts."""
        mechanism = self._mechanism(shown)
        positions = ChainMap(*(self._positions[topic] for topic in shown.sources))
        for name, settings in mechanism.inputs.items():
            if settings.source not in positions and (
                    f'{shown.name}.{name}.start' not in shown.nodes):
                raise SceneError(
                    f'the {name} is not known yet: no message names {settings.source}')
        return mechanism, present_inputs(mechanism, positions)

    def _mechanism(self, shown: ShownMechanism) -> SceneMechanism:
        return self._scenes[shown.owner].mechanisms[shown.name]

    def _find(self, key: str) -> ShownMechanism:
        if key not in self._mechanisms:
            raise SceneError(f'there is no mechanism {short_repr(key)}')
        return self._mechanisms[key]

    def _show(self, client: Any) -> None:
        client.tell('scene', {'op': 'scene', 'mechanisms': list(
            map(self._described, self._mechanisms.values()))})
        for feed in [*self._feeds.values()]:
            client.offer(feed)

    def _settings(self, shown: ShownMechanism) -> dict[str, scene.Parameter]:
        """Return the announced parameters of a mechanism, by their names in it."""
        return {parameter.name.partition('.')[2]: parameter
                for parameter in self._mechanism(shown).parameters
                if parameter.name in shown.nodes}

    def _described(self, shown: ShownMechanism) -> JsonObject:
        """Describe what the page needs of a mechanism beside its markers."""
        mechanism = self._mechanism(shown)
        forms, kinds = (FORMS[:3], {}) if mechanism.in_space else (FORMS, curves.KINDS)
        return {'key': shown.key, 'name': shown.name, 'forms': forms, 'curves': kinds,
                'settings': list(starmap(poses.setting, self._settings(shown).items())),
                **poses.drawn(mechanism, self._playing(shown))}

    def _playing(self, shown: ShownMechanism) -> dict[str, float]:
        """Return the speeds of a mechanism when it plays: the last ones that were not zero."""
        speeds = self._speeds[shown.owner]
        return {parameter.name.split('.')[1]: speeds.get(parameter.name, parameter.default)
                for parameter in self._mechanism(shown).parameters
                if parameter.field.group == 'speeds'}

    async def _watch(self) -> None:
        """Observe the graph until the last page is closed."""
        while self.clients or await self._until(lambda: bool(self.clients), LINGER_S):
            try:
                graph = self._find_announcers()
                if graph != self._graph or self._is_stale:
                    await self._change(graph)
            except Exception as error:
                # Other nodes may publish anything; the next look may succeed.
                self._is_stale = True
                self.warn(f'the scene cannot be read: {error!r}')
            with suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._news.wait(), POLL_S)
            self._news.clear()
        self._graph, self._mechanisms, self._announced, self._scenes = {}, {}, {}, {}
        self._is_stale, self._watching = True, None
        self._keep({})

    def _find_announcers(self) -> dict[str, tuple[str, list[str]]]:
        """Return, by node that announces parameters, that topic and the topics of its inputs."""
        return {name: (topic, self._input_topics(name))
                for topic, types in self._node.get_topic_names_and_types()
                if topic.endswith(f'/{ownership.TOPIC}') and EVENTS_TYPE in types
                for info in self._node.get_publishers_info_by_topic(topic)
                # Of a node that starts, the name is unknown at first.
                if info.node_namespace.startswith('/')
                for name in [f'{info.node_namespace.rstrip("/")}/{info.node_name}']}

    def _input_topics(self, name: str) -> list[str]:
        """Return the topics from which a node receives its inputs."""
        space, node = name.rsplit('/', 1)
        with suppress(NodeNameNonExistentError):
            return [topic for topic, types in
                    self._node.get_subscriber_names_and_types_by_node(node, space or '/')
                    if INPUTS_TYPE in types]
        return []

    async def _change(self, graph: dict[str, tuple[str, list[str]]]) -> None:
        """Follow what the nodes of a graph announce, and forget others."""
        for node in self._graph.keys() - graph.keys():
            self._announced.pop(node, None)
        self._graph, self._is_stale = graph, False
        entities: dict[str, Callable[[str], Any]] = {
            **dict.fromkeys((topic for topic, _ in graph.values()), self._listen),
            **dict.fromkeys((f'{node}/{SETTER}' for node in graph),
                            partial(self._node.create_client, SetParametersAtomically))}
        self._keep({**dict.fromkeys(self._entities, self._listen), **entities})
        await self._until(lambda: self._announced.keys() >= graph.keys(), MAX_ANNOUNCE_S)
        self._scenes, self._mechanisms = {}, {}
        for owner, (_, sources) in sorted(graph.items()):
            # What a node announces may be no scene.
            with suppress(SceneError):
                nodes = self._read(owner)
                self._sources.update(self._scenes[owner].sources)
                for name in self._scenes[owner].mechanisms:
                    key = f'{_space(owner)}/{name}'
                    self._mechanisms[key] = ShownMechanism(key, name, owner, sources, nodes)
                    entities.update(dict.fromkeys(sources, self._follow))
                    entities[f'{key}/markers'] = partial(self._draw, key, MarkerArray, NEWEST)
                    entities[f'{key}/locus'] = partial(self._draw, key, Marker, LATCHED)
        self._keep(entities)
        for client in self.clients:
            self._show(client)

    def _read(self, owner: str) -> dict[str, str]:
        """
        Read the scene of a node, with what the others of its namespace announce.

        Return the node that announces each of its parameters. Raises SceneError if there is none.
        """
        values = self._announced.get(owner, {})
        if 'mechanisms' not in values:
            raise SceneError(f'{owner} announces no mechanisms')
        before = self._scenes.get(owner) or scene.read(values)
        nodes = {parameter.name: node for node in (*self._announced, owner)
                 if node in self._graph and _space(node) == _space(owner)
                 for parameter in before.parameters if parameter.name in self._announced[node]}
        merged = self._scenes[owner] = scene.changed(
            before, {name: self._announced[node][name] for name, node in nodes.items()})
        self._speeds[owner].update(
            (parameter.name, parameter.value) for parameter in merged.parameters
            if parameter.field.group == 'speeds' and parameter.value)
        return nodes

    def _keep(self, entities: Mapping[str, Callable[[str], Any]]) -> None:
        """Have these subscriptions and clients, each by a function of its name, and no others."""
        for name in self._entities.keys() - entities.keys():
            entity = self._entities.pop(name)
            self._feeds.pop(name, None)
            if isinstance(entity, Client):
                self._node.destroy_client(entity)
            else:
                self._node.destroy_subscription(entity)
        for name in entities.keys() - self._entities.keys():
            self._entities[name] = entities[name](name)

    def _listen(self, topic: str) -> Any:
        return self._node.create_subscription(
            ParameterEvent, topic, partial(self._hand_over, self._notice),
            ownership.LATCHED)

    def _follow(self, topic: str) -> Any:
        def store(message: JointState) -> None:
            self._positions[topic].update(
                (name, position) for name, position in zip(message.name, message.position)
                if name in self._sources and math.isfinite(position))

        return self._node.create_subscription(JointState, topic, store, NEWEST)

    def _draw(self, key: str, type_: type, qos: QoSProfile, topic: str) -> Any:
        feed = self._feeds[topic] = Feed(key, topic, type_, self.warn)

        def receive(raw: bytes) -> None:
            feed.newest = raw
            for client in [*self.clients]:
                self._hand_over(client.offer, feed)

        return self._node.create_subscription(type_, topic, receive, qos, raw=True)

    def _notice(self, event: ParameterEvent) -> None:
        """Adopt announced values, and forward those that have changed to the pages."""
        before = self._announced.get(event.node, {})
        values = {} if event.new_parameters else dict(before)
        for parameter in (*event.new_parameters, *event.changed_parameters):
            # Any node may announce values of unknown types.
            with suppress(RuntimeError):
                values[parameter.name] = parameter_value_to_python(parameter.value)
        self._announced[event.node] = values
        if values.keys() != before.keys():
            self._is_stale = True
            self._news.set()
            return
        for owner in [*self._scenes] if event.node in self._graph else ():
            old = self._scenes[owner]
            with suppress(SceneError):
                self._read(owner)
            for shown in self._mechanisms.values():
                if shown.owner == owner and (self._scenes[owner].mechanisms[shown.name]
                                             is not old.mechanisms[shown.name]):
                    for client in self.clients:
                        client.tell(shown.key, {'op': 'mechanism', **self._described(shown)})


def _space(name: str) -> str:
    return name.rsplit('/', 1)[0]
