# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The running scene for the page: discovery in the ROS graph, drawing, and changes by services."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from functools import partial
import math
import re
from typing import (
    Any,
    Callable,
    Collection,
    Mapping,
    Optional,
    Protocol,
    Sequence,
    TypeVar,
)

from rcl_interfaces.msg import ParameterEvent
from rclpy.node import NodeNameNonExistentError
from rclpy.qos import (
    DurabilityPolicy,
    qos_profile_parameter_events,
    QoSProfile,
    ReliabilityPolicy,
)
from sensor_msgs.msg import JointState
from visualization_msgs.msg import Marker, MarkerArray

from . import curves, poses
from .bridge import Bridge, NoAnswer
from .feed import Feed
from .poses import Refused
from .settings import Described, RemoteNode, Setting
from .. import scene
from ..scene import writing
from ..words import quoted

MARKERS, LOCUS, LIST = '/markers', '/locus', '/list_parameters'
MARKERS_TYPE, LOCUS_TYPE = 'visualization_msgs/msg/MarkerArray', 'visualization_msgs/msg/Marker'
LIST_TYPE = 'rcl_interfaces/srv/ListParameters'
INPUTS_TYPE = 'sensor_msgs/msg/JointState'
SECONDS_BETWEEN_LOOKS = 1.0
SECONDS_TO_LINGER = 1.0
SECONDS_TO_ARRIVE, ARRIVED = 1.0, 1e-6
# Parameters that define a scene, which a saved file always has.
DEFINES = re.compile(r'mechanisms|[^.]+\.(type|scale|dimensions\..+)')
GENERAL = 'mechanisms', 'frame_id', 'frame_prefix', 'rate'
SCENE = 'scene'

Answer = dict[str, Any]
Result = TypeVar('Result')
# Marker topics with their publishers, nodes with parameters, and each node's input topics.
Marked = tuple[tuple[str, tuple[tuple[str, bytes], ...]], ...]
Graph = tuple[Marked, tuple[str, ...], dict[str, list[str]]]

NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class OpenPage(Protocol):
    """A page that displays the scene."""

    def tell(self, key: Any, message: dict[str, Any]) -> None:
        """Send a message; it replaces waiting ones with the same key."""

    def offer(self, feed: Feed) -> None:
        """Send a feed's newest message, when the page is ready to draw it."""


@dataclass
class ShownMechanism:
    """
    A mechanism on the page: the prefix of its topics, its settings, and its inputs' sources.

    An input that was moved is `pending` at its new value `until` a time, or until messages confirm
    it: earlier messages may have the old value.
    """

    key: str
    settings: dict[str, Setting]
    sources: tuple[str, ...] = ()
    machine: Optional[scene.SceneMechanism] = None
    pending: dict[str, float] = field(default_factory=dict)
    until: float = 0.0

    @property
    def name(self) -> str:
        """Its name in its scene."""
        return self.key.rsplit('/', 1)[1]

    def values(self) -> dict[str, Any]:
        """Return its parameters by full name."""
        return {f'{self.name}.{name}': setting.value for name, setting in self.settings.items()}

    def scene(self) -> scene.Scene:
        """Return the scene of it alone; raise Refused if its parameters are incomplete."""
        if 'type' not in self.settings:
            raise Refused(f'the parameters of {self.name} are not known yet')
        return _read({'mechanisms': [self.name], **self.values()})

    def described(self) -> dict[str, Any]:
        """Describe it for the page."""
        return {'key': self.key, 'name': self.name,
                'settings': [setting.described() for setting in self.settings.values()]}


class SceneView:
    """
    All mechanisms of the graph, while a page is open; otherwise there are no subscriptions.

    All methods run in the web's thread, except functions passed to the bridge.

    Parameters
    ----------
    bridge : Bridge
        Calls to the node.

    Attributes
    ----------
    clients : list
        Open pages, which receive messages by `tell(key, message)`, markers by `offer(feed)`.

    """

    def __init__(self, bridge: Bridge) -> None:
        self.clients: list[OpenPage] = []
        self._bridge = bridge
        self._setting = asyncio.Lock()
        self._seen: Optional[Graph] = None
        self._mechanisms: dict[str, ShownMechanism] = {}
        self._general: dict[str, dict[str, Any]] = {}
        self._found: dict[str, Optional[Described]] = {}
        self._watching: Optional[asyncio.Task[None]] = None
        self._stopping: Optional[asyncio.TimerHandle] = None
        # The following attributes are changed in the executor's thread alone.
        self._nodes: dict[str, RemoteNode] = {}
        self._sources: dict[str, Any] = {}
        self._received: dict[str, dict[str, float]] = {}
        self._feeds: dict[str, tuple[Feed, Any]] = {}
        self._numbers: dict[tuple[str, int], int] = {}
        self._events: Any = None

    def add(self, client: OpenPage) -> None:
        """Add a client; the first one starts the observation of the graph."""
        self.clients.append(client)
        if self._stopping:
            self._stopping.cancel()
        if self._watching is None:
            self._watching = asyncio.create_task(self._watch())
            return
        self._show(client)

    def remove(self, client: OpenPage) -> None:
        """Remove a client; after the last one the observation ends, unless it was a reload."""
        self.clients.remove(client)
        if not self.clients:
            # Requests in progress would wait for a client that has left.
            self._stopping = self._bridge.loop.call_later(SECONDS_TO_LINGER, self._stop)

    def _stop(self) -> None:
        if self._watching:
            self._watching.cancel()
        self._watching = self._stopping = None
        self._seen, self._mechanisms, self._found = None, {}, {}
        self._bridge.ask(self._close)

    def feeds(self) -> list[Feed]:
        """Return the feeds with messages to draw."""
        return [feed for feed, _ in list(self._feeds.values()) if feed.newest is not None]

    async def set(self, key: str, values: Mapping[str, Any]) -> None:
        """
        Set parameters of a mechanism, those of one node all or none.

        Raises
        ------
        Refused
            With the node's reason.

        """
        async with self._setting:
            mechanism = self._find(key)
            asked: dict[str, list[Any]] = {}
            for name, value in values.items():
                if name not in mechanism.settings:
                    raise Refused(f'{mechanism.name} has no parameter {quoted(name)}')
                setting = mechanism.settings[name]
                try:
                    parameter = setting.asked(f'{mechanism.name}.{name}', value)
                except ValueError as error:
                    raise Refused(str(error)) from None
                asked.setdefault(setting.node, []).append(parameter)
            for node, parameters in asked.items():
                await self._set(node, parameters)

    async def _set(self, node: str, parameters: list[Any]) -> None:
        if node not in self._nodes:
            raise Refused(f'{node} is gone')
        try:
            reason = await self._nodes[node].set(parameters)
        except NoAnswer as error:
            reason = str(error)
        if reason:
            raise Refused(reason)

    async def pose(self, key: str, want: Optional[Mapping[str, Any]] = None, arrows: str = '',
                   speeds: Any = ()) -> Answer:
        """
        Describe a mechanism's pose; with a request, move it there first and hold it.

        Arguments are those of `poses.reached` and `poses.arrows`. The result is that of
        `poses.described`, with requested arrows, and the reason, and what is reached, if the
        request is not met exactly.
        """
        mechanism = self._find(key)
        (machine, inputs), reach = self._state(mechanism), None
        if want is None:
            self._check_known(mechanism, machine)
        else:
            inputs, reach = poses.reached(machine, inputs, dict(want))
            await self._hold(mechanism, machine, inputs)
        found = {**poses.described(machine, inputs), 'reason': str(reach or '')}
        if reach:
            found['reach'] = asdict(reach)
        if arrows:
            found['arrows'] = poses.arrows(machine, inputs, arrows, dict(speeds))
        return found

    async def _hold(self, mechanism: ShownMechanism, machine: scene.SceneMechanism,
                    inputs: Sequence[float]) -> None:
        """Stop the inputs at requested values."""
        values = {}
        for (name, drive), value in zip(machine.inputs.items(), inputs):
            start = mechanism.settings.get(f'{name}.start')
            if start is None:
                raise Refused(f'the {name} cannot be moved: no crank_driver is running')
            if value == start.value:
                # An input moves only to a start that differs from the last one.
                value = math.nextafter(value, sum(poses.arcs(drive)[0]) / 2.0)
            values.update({f'{name}.start': value, f'{name}.speed': 0.0})
        await self.set(mechanism.key, values)
        mechanism.pending = dict(zip(machine.inputs, inputs))
        mechanism.until = self._bridge.loop.time() + SECONDS_TO_ARRIVE

    async def tune(self, key: str) -> Answer:
        """Return the result of `poses.tunable`."""
        mechanism = self._find(key)
        return await self._aside(lambda: poses.tunable(mechanism.scene(), mechanism.name))

    async def curve(self, key: str, **about: Any) -> Answer:
        """Return the result of `curves.curve`."""
        machine, inputs = self._state(self._find(key))
        return await self._aside(lambda: curves.curve(machine, inputs, **about))

    async def export(self, key: str, form: str) -> Answer:
        """Return the result of `curves.exported`."""
        mechanism = self._find(key)
        machine, inputs = (_machine(mechanism), []) if form == 'c' else self._state(mechanism)
        frame_id = self._general.get(_space(key), {}).get('frame_id', 'world')
        return {'text': await self._aside(
            lambda: curves.exported(machine, inputs, form, frame_id))}

    async def save(self, key: str, values: Any = ()) -> Answer:
        """Return a parameter file of a mechanism's scene: its definition and changed values."""
        mechanism, space = self._find(key), _space(key)
        whole = dict(self._general.get(space, {}))
        for other in self._mechanisms.values():
            if _space(other.key) == space:
                whole.update(other.values())
        whole.update((f'{mechanism.name}.{name}', value) for name, value in dict(values).items())
        return {'text': await self._aside(
            lambda: writing.in_yaml(writing.without_defaults(_read(whole), DEFINES)))}

    async def _aside(self, work: Callable[[], Result]) -> Result:
        """Run slow work in another thread; return its result."""
        try:
            found: Result = await self._bridge.loop.run_in_executor(None, work)
            return found
        except scene.SceneError as error:
            raise Refused(str(error)) from None

    def _state(self, mechanism: ShownMechanism) -> tuple[scene.SceneMechanism, list[float]]:
        """Return a mechanism and its last received inputs [rad or m], or their starts."""
        machine, inputs = _machine(mechanism), []
        if machine.in_space:
            raise Refused(f'{machine.name} is a linkage in space: the page draws and tunes it, '
                          'and moves, plots and describes linkages in a plane')
        if self._bridge.loop.time() > mechanism.until:
            mechanism.pending = {}
        for name, drive in machine.inputs.items():
            position = self._position_of(mechanism, drive.source)
            now = drive.start if position is None else machine.from_source(
                drive, position, None, None)[0]
            now = now if math.isfinite(now) else drive.start
            pending = mechanism.pending.get(name, now)
            if drive.input.apart(pending, now) < ARRIVED * drive.input.size:
                mechanism.pending.pop(name, None)
            inputs.append(mechanism.pending.get(name, now))
        return machine, inputs

    def _position_of(self, mechanism: ShownMechanism, source: str) -> Optional[float]:
        """Return the last position of an input's source, or None."""
        return next((self._received[topic][source] for topic in mechanism.sources
                     if source in self._received.get(topic, ())), None)

    def _check_known(self, mechanism: ShownMechanism, machine: scene.SceneMechanism) -> None:
        """Raise Refused if an input has neither been received nor a start."""
        for name, drive in machine.inputs.items():
            if f'{name}.start' not in mechanism.settings and self._position_of(
                    mechanism, drive.source) is None:
                raise Refused(f'the {name} is not known yet: no message names {drive.source}')

    def _find(self, key: str) -> ShownMechanism:
        if key not in self._mechanisms:
            raise Refused(f'there is no mechanism {quoted(key)}; '
                          f'there are: {", ".join(self._mechanisms)}')
        return self._mechanisms[key]

    def _show(self, client: OpenPage) -> None:
        client.tell(SCENE, {'op': 'scene', 'mechanisms': [
            mechanism.described() for mechanism in self._mechanisms.values()]})
        for feed in self.feeds():
            client.offer(feed)

    async def _watch(self) -> None:
        await self._bridge.ask(self._listen)
        while True:
            try:
                await self._look()
            except Exception as error:
                # Other nodes may publish anything; the next look may succeed.
                self._seen = None
                self._bridge.warn(f'the scene cannot be read: {error!r}')
            await asyncio.sleep(SECONDS_BETWEEN_LOOKS)

    async def _look(self) -> None:
        seen = await self._bridge.ask(self._graph)
        if seen != self._seen:
            self._seen = seen
            await self._change(*seen)

    def _graph(self) -> Graph:
        """Return the graph's marker topics, nodes with parameters, and services."""
        node = self._bridge.node
        topics = dict(node.get_topic_names_and_types())
        services = node.get_service_names_and_types()
        keys = sorted(name[:-len(MARKERS)] for name, types in topics.items()
                      if name.endswith(MARKERS) and MARKERS_TYPE in types)
        keys = [key for key in keys if LOCUS_TYPE in topics.get(f'{key}{LOCUS}', ())]
        marked = tuple((key, tuple(sorted(
            (_joined(info.node_namespace, info.node_name), bytes(info.endpoint_gid))
            for info in node.get_publishers_info_by_topic(f'{key}{MARKERS}')
            # Of a node that starts, the name is unknown at first.
            if info.node_namespace.startswith('/')))) for key in keys)
        topics = {owner: self._subscriptions_of(owner)
                  for _, owners in marked for owner, _ in owners}
        nodes = tuple(sorted(name[:-len(LIST)] for name, types in services
                             if name.endswith(LIST) and LIST_TYPE in types))
        return tuple(shown for shown in marked if shown[1]), nodes, topics

    def _subscriptions_of(self, name: str) -> list[str]:
        """Return the topics from which a node receives its inputs."""
        space, own = name.rsplit('/', 1)
        with suppress(NodeNameNonExistentError):
            return [topic for topic, types in
                    self._bridge.node.get_subscriber_names_and_types_by_node(own, space or '/')
                    if INPUTS_TYPE in types]
        return []

    async def _change(self, marked: Marked, nodes: Sequence[str],
                      input_topics: Mapping[str, Sequence[str]]) -> None:
        owners = {key: [name for name, _ in publishers] for key, publishers in marked}
        spaces = {_space(node) for names in owners.values() for node in names}
        nodes = [node for node in nodes if _space(node) in spaces]
        sources = {topic for topics in input_topics.values() for topic in topics}
        await self._bridge.ask(self._open, list(owners), nodes, sources)
        names = sorted({*GENERAL, *(key.rsplit('/', 1)[1] for key in owners)})
        # Parameters that drawing nodes describe are read from them only. A parameter without a
        # description is an override of a node that does not use it.
        found: dict[str, Optional[Described]] = {}
        for part in ([node for node in nodes if node in input_topics],
                     [node for node in nodes if node not in input_topics]):
            known = {space: {name for node, own in found.items() if _space(node) == space
                             for name, (about, _) in (own or {}).items() if about.description}
                     for space in spaces}
            found.update(zip(part, await asyncio.gather(
                *(self._parameters(node, names, known[_space(node)]) for node in part))))
        self._found = found
        self._mechanisms = {key: self._mechanism(key, own_nodes, found, input_topics)
                            for key, own_nodes in owners.items()}
        self._general = {}
        general = [(node, name, *own[name]) for node, described in found.items()
                   for own in [described or {}] for name in GENERAL if name in own]
        for node, name, about, value in sorted(general, key=lambda one: not one[2].description):
            with suppress(ValueError):
                self._general.setdefault(_space(node), {}).setdefault(
                    name, Setting(name, node, about, value).value)
        for client in self.clients:
            self._show(client)

    async def _parameters(self, node: str, prefixes: list[str],
                          known: Collection[str]) -> Optional[Described]:
        try:
            return await self._nodes[node].parameters(prefixes, known)
        except NoAnswer:
            # It may be starting or ending: look again, and use its last answer until then.
            self._seen = None
            return self._found.get(node)

    def _mechanism(self, key: str, own_nodes: Sequence[str],
                   found: Mapping[str, Optional[Described]],
                   input_topics: Mapping[str, Sequence[str]]) -> ShownMechanism:
        """Return a mechanism with the parameters of its namespace's nodes, its own node first."""
        mechanism = ShownMechanism(key, {}, tuple(
            topic for node in own_nodes for topic in input_topics.get(node, ())))
        spaces = {_space(node) for node in own_nodes}
        prefix = f'{mechanism.name}.'
        silent = any(found.get(node, {}) is None for node in own_nodes)
        near = [] if silent else [node for node in found if _space(node) in spaces]
        for node in sorted(near, key=lambda node: node not in own_nodes):
            for full, (descriptor, value) in (found[node] or {}).items():
                name = full[len(prefix):]
                before = mechanism.settings.get(name)
                if full.startswith(prefix) and (not before or not before.descriptor.description
                                                and descriptor.description):
                    with suppress(ValueError):
                        mechanism.settings[name] = Setting(name, node, descriptor, value)
        return mechanism

    def _listen(self) -> None:
        self._events = self._bridge.node.create_subscription(
            ParameterEvent, '/parameter_events',
            lambda event: self._bridge.hand_over(self._notice, event),
            qos_profile_parameter_events)

    def _open(self, keys: Collection[str], nodes: Collection[str],
              sources: Collection[str]) -> None:
        """Create missing clients and subscriptions for these, and destroy all others."""
        topics: dict[str, Any] = {
            f'{key}{ending}': (key, type_, qos) for key in keys for ending, type_, qos in (
                (MARKERS, MarkerArray, NEWEST), (LOCUS, Marker, LATCHED))}
        self._drop_others(nodes, sources, topics)
        for name in set(nodes) - set(self._nodes):
            self._nodes[name] = RemoteNode(self._bridge, name)
        for topic in set(sources) - set(self._sources):
            self._received[topic] = {}
            self._sources[topic] = self._bridge.node.create_subscription(
                JointState, topic, partial(_store, self._received[topic]), NEWEST)
        for name in set(topics) - set(self._feeds):
            self._feeds[name] = self._feed(name, *topics[name])

    def _feed(self, name: str, key: str, type_: type, qos: QoSProfile) -> tuple[Feed, Any]:
        def number(i: int) -> int:
            return self._numbers.setdefault((name, i), len(self._numbers))

        feed = Feed(name, key, type_, number, self._bridge.warn)
        return feed, self._bridge.node.create_subscription(
            type_, name, lambda raw: self._receive(feed, raw), qos, raw=True)

    def _drop_others(self, nodes: Collection[str], sources: Collection[str],
                     topics: Collection[str]) -> None:
        """Destroy all but these."""
        node = self._bridge.node
        for name in set(self._nodes) - set(nodes):
            self._nodes.pop(name).close()
        for topic in set(self._sources) - set(sources):
            node.destroy_subscription(self._sources.pop(topic))
            del self._received[topic]
        for name in set(self._feeds) - set(topics):
            node.destroy_subscription(self._feeds.pop(name)[1])

    def _close(self) -> None:
        self._drop_others((), (), ())
        self._numbers = {}
        if self._events is not None:
            self._bridge.node.destroy_subscription(self._events)
            self._events = None

    def _receive(self, feed: Feed, raw: bytes) -> None:
        feed.newest = raw
        self._bridge.hand_over(self._offer, feed)

    def _offer(self, feed: Feed) -> None:
        for client in self.clients:
            client.offer(feed)

    def _notice(self, event: ParameterEvent) -> None:
        """Forward a change of parameters to the pages."""
        for mechanism in self._mechanisms.values():
            prefix = f'{mechanism.name}.'
            for parameter in (*event.new_parameters, *event.changed_parameters):
                name = parameter.name[len(prefix):]
                if parameter.name.startswith(prefix):
                    self._notice_one(mechanism, event.node, name, parameter)

    def _notice_one(self, mechanism: ShownMechanism, node: str, name: str,
                    parameter: Any) -> None:
        setting = mechanism.settings.get(name)
        if setting is None or parameter.value.type != setting.message.type:
            if node in self._nodes:
                self._seen = None
            return
        if node != setting.node:
            return
        setting.message = parameter.value
        mechanism.machine = None
        for client in self.clients:
            client.tell((mechanism.key, name), {'op': 'value', 'mechanism': mechanism.key,
                                                'name': name, 'value': setting.value})


def _machine(mechanism: ShownMechanism) -> scene.SceneMechanism:
    """Return a mechanism as its scene has it, read once."""
    if mechanism.machine is None:
        mechanism.machine = mechanism.scene().machines[mechanism.name]
    return mechanism.machine


def _read(given: Mapping[str, Any]) -> scene.Scene:
    """Read a scene from other nodes' parameters; raise Refused if they are invalid."""
    try:
        return scene.read(given, strict=False)
    except scene.SceneError as error:
        raise Refused(str(error)) from None


def _store(positions: dict[str, float], message: JointState) -> None:
    """Store the finite positions of a message by name."""
    positions.update((name, position) for name, position in zip(message.name, message.position)
                     if math.isfinite(position))


def _joined(space: str, name: str) -> str:
    return f'{space.rstrip("/")}/{name}'


def _space(name: str) -> str:
    return name.rsplit('/', 1)[0]
