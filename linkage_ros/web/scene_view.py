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
    Iterable,
    Mapping,
    Optional,
    Protocol,
    Sequence,
    TypeVar,
)

from rcl_interfaces.msg import ParameterEvent
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.node import NodeNameNonExistentError
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from visualization_msgs.msg import Marker, MarkerArray

from . import curves, poses
from .bridge import Bridge, NoAnswer
from .feed import Feed
from .poses import Refused
from .settings import Setting
from .. import scene
from ..nodes import ownership
from ..scene import slider, writing
from ..words import quoted

MARKERS, LOCUS = '/markers', '/locus'
MARKERS_TYPE, LOCUS_TYPE = 'visualization_msgs/msg/MarkerArray', 'visualization_msgs/msg/Marker'
INPUTS_TYPE = 'sensor_msgs/msg/JointState'
SECONDS_BETWEEN_LOOKS = 1.0
SECONDS_TO_LINGER = 1.0
SECONDS_TO_ANNOUNCE = 1.0
SECONDS_TO_ARRIVE, ARRIVED = 1.0, 1e-6
# Parameters that define a scene, which a saved file always has.
DEFINES = re.compile(r'mechanisms|[^.]+\.(type|scale|dimensions\..+)')
SCENE = 'scene'

Answer = dict[str, Any]
Result = TypeVar('Result')
# Nodes and ids of publishers, by their topic.
Published = tuple[tuple[str, tuple[tuple[str, bytes], ...]], ...]
# Marker topics, topics of announced parameters, and the input topics of each node.
Graph = tuple[Published, Published, dict[str, list[str]]]

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
    A mechanism on the page: the prefix of its topics, its node, settings, and inputs' sources.

    An input that was moved is `pending` at its new value `until` a time, or until messages confirm
    it: earlier messages may have the old value.
    """

    key: str
    owner: str
    settings: dict[str, Setting]
    sources: tuple[str, ...]
    pending: dict[str, float] = field(default_factory=dict)
    until: float = 0.0

    @property
    def name(self) -> str:
        """Its name in its scene."""
        return self.key.rsplit('/', 1)[1]

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
        # The values that each node announces, by full name; the scenes that were read from them.
        self._announced: dict[str, dict[str, Any]] = {}
        self._scenes: dict[str, scene.Scene] = {}
        self._news = asyncio.Event()
        self._watching: Optional[asyncio.Task[None]] = None
        self._stopping: Optional[asyncio.TimerHandle] = None
        # The following attributes are changed in the executor's thread alone.
        self._setters: dict[str, Any] = {}
        self._announcements: dict[str, Any] = {}
        self._sources: dict[str, Any] = {}
        self._received: dict[str, dict[str, float]] = {}
        self._feeds: dict[str, tuple[Feed, Any]] = {}
        self._numbers: dict[tuple[str, int], int] = {}

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
        self._seen, self._mechanisms, self._announced, self._scenes = None, {}, {}, {}
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
                    parameter = setting.asked(value)
                except ValueError as error:
                    raise Refused(str(error)) from None
                asked.setdefault(setting.node, []).append(parameter)
            for node, parameters in asked.items():
                await self._set(node, parameters)

    async def _set(self, node: str, parameters: list[Any]) -> None:
        if node not in self._announced:
            raise Refused(f'{node} is gone')
        try:
            response = await self._bridge.call(
                await self._bridge.ask(self._setter, node),
                SetParametersAtomically.Request(parameters=parameters))
        except NoAnswer as error:
            raise Refused(str(error)) from None
        if not response.result.successful:
            raise Refused(response.result.reason or f'{node} gives no reason')

    def _setter(self, node: str) -> Any:
        """Return the client that sets parameters of a node."""
        if node not in self._setters:
            self._setters[node] = self._bridge.node.create_client(
                SetParametersAtomically, f'{node}/set_parameters_atomically')
        return self._setters[node]

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
        whole = self._scene(mechanism)
        return await self._aside(lambda: poses.tunable(whole, mechanism.name))

    async def curve(self, key: str, **about: Any) -> Answer:
        """Return the result of `curves.curve`."""
        machine, inputs = self._state(self._find(key))
        return await self._aside(lambda: curves.curve(machine, inputs, **about))

    async def export(self, key: str, form: str) -> Answer:
        """Return the result of `curves.exported`."""
        mechanism = self._find(key)
        whole = self._scene(mechanism)
        machine, inputs = (whole.machines[mechanism.name], []) if form == 'c' else self._state(
            mechanism)
        return {'text': await self._aside(
            lambda: curves.exported(machine, inputs, form, whole.frame_id))}

    async def save(self, key: str, values: Any = ()) -> Answer:
        """Return a parameter file of a mechanism's scene: its definition and changed values."""
        mechanism = self._find(key)
        before, changed = self._scene(mechanism), {
            f'{mechanism.name}.{name}': value for name, value in dict(values).items()}
        return {'text': await self._aside(lambda: writing.in_yaml(writing.without_defaults(
            scene.changed(before, changed, strict=False), DEFINES)))}

    async def _aside(self, work: Callable[[], Result]) -> Result:
        """Run slow work in another thread; return its result."""
        try:
            found: Result = await self._bridge.loop.run_in_executor(None, work)
            return found
        except scene.SceneError as error:
            raise Refused(str(error)) from None

    def _state(self, mechanism: ShownMechanism) -> tuple[scene.SceneMechanism, list[float]]:
        """Return a mechanism and its last received inputs [rad or m], or their starts."""
        machine, inputs = self._scene(mechanism).machines[mechanism.name], []
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
            {**mechanism.described(), **self._drawn(mechanism)}
            for mechanism in self._mechanisms.values()]})
        for feed in self.feeds():
            client.offer(feed)

    def _drawn(self, mechanism: ShownMechanism) -> dict[str, Any]:
        """Describe what the page needs beside the parameters; {} until these are announced."""
        with suppress(Refused):
            machine = self._scene(mechanism).machines[mechanism.name]
            return {**poses.drawn(machine), 'curves': curves.plots(machine)}
        return {}

    async def _watch(self) -> None:
        while True:
            try:
                await self._look()
            except Exception as error:
                # Other nodes may publish anything; the next look may succeed.
                self._seen = None
                self._bridge.warn(f'the scene cannot be read: {error!r}')
            with suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._news.wait(), SECONDS_BETWEEN_LOOKS)

    async def _look(self) -> None:
        self._news.clear()
        seen = await self._bridge.ask(self._graph)
        if seen != self._seen:
            self._seen = seen
            await self._change(*seen)

    def _graph(self) -> Graph:
        """Return the graph's topics of markers and parameters, and the owners' input topics."""
        topics = dict(self._bridge.node.get_topic_names_and_types())
        keys = sorted(name[:-len(MARKERS)] for name, types in topics.items()
                      if name.endswith(MARKERS) and MARKERS_TYPE in types)
        marked = self._published((f'{key}{MARKERS}' for key in keys
                                  if LOCUS_TYPE in topics.get(f'{key}{LOCUS}', ())))
        owners = {owner for _, publishers in marked for owner, _ in publishers}
        announced = self._published(f'{space}/{ownership.TOPIC}'
                                    for space in sorted(set(map(_space, owners))))
        return marked, announced, {owner: self._subscriptions_of(owner) for owner in owners}

    def _published(self, topics: Iterable[str]) -> Published:
        """Return the topics that are published, with their publishers."""
        found = ((topic, tuple(sorted(
            (_joined(info.node_namespace, info.node_name), bytes(info.endpoint_gid))
            for info in self._bridge.node.get_publishers_info_by_topic(topic)
            # Of a node that starts, the name is unknown at first.
            if info.node_namespace.startswith('/')))) for topic in topics)
        return tuple(each for each in found if each[1])

    def _subscriptions_of(self, name: str) -> list[str]:
        """Return the topics from which a node receives its inputs."""
        space, own = name.rsplit('/', 1)
        with suppress(NodeNameNonExistentError):
            return [topic for topic, types in
                    self._bridge.node.get_subscriber_names_and_types_by_node(own, space or '/')
                    if INPUTS_TYPE in types]
        return []

    async def _change(self, marked: Published, announced: Published,
                      input_topics: dict[str, list[str]]) -> None:
        nodes = {node for _, publishers in announced for node, _ in publishers}
        for gone in self._announced.keys() - nodes:
            del self._announced[gone]
        owners = {topic[:-len(MARKERS)]: [node for node, _ in own] for topic, own in marked}
        await self._bridge.ask(
            self._open, list(owners), nodes, [topic for topic, _ in announced],
            {topic for topics in input_topics.values() for topic in topics})
        with suppress(asyncio.TimeoutError):
            await asyncio.wait_for(self._wait_for_announcements(nodes), SECONDS_TO_ANNOUNCE)
        self._seen = marked, announced, input_topics
        mechanisms = {}
        for key, own in owners.items():
            # Others may publish on its topics, too.
            own.sort(key=lambda node: not self._announced.get(node, {}).get('mechanisms'))
            mechanism = mechanisms[key] = ShownMechanism(key, own[0], {}, tuple(
                topic for node in own for topic in input_topics[node]))
            # A node that starts has not announced its parameters.
            with suppress(Refused):
                mechanism.settings = await self._aside(partial(
                    self._settings, mechanism, self._scene(mechanism)))
        self._mechanisms = mechanisms
        for client in self.clients:
            self._show(client)

    async def _wait_for_announcements(self, nodes: Collection[str]) -> None:
        """Wait until some nodes have announced their parameters."""
        while not self._announced.keys() >= set(nodes):
            self._news.clear()
            await self._news.wait()

    def _values(self, owner: str) -> dict[str, tuple[str, Any]]:
        """Return node and value of each parameter of an owner's scene, by full name."""
        own, whole = self._announced.get(owner, {}), self._scenes.get(owner)
        values = {name: (owner, value) for name, value in own.items()}
        others = {parameter.name: parameter.field for parameter in (
            whole.parameters if whole else ()) if parameter.name not in own}
        for node in self._announced.keys() - {owner}:
            for name in self._announced[node].keys() & others.keys():
                # Any node may announce anything.
                if _space(node) == _space(owner):
                    with suppress(scene.SceneError):
                        values[name] = node, others[name].checked(
                            name, self._announced[node][name])
        return values

    def _scene(self, mechanism: ShownMechanism) -> scene.Scene:
        """Return the scene of a mechanism; raise Refused if its parameters are not announced."""
        owner = mechanism.owner
        if mechanism.name not in self._announced.get(owner, {}).get('mechanisms', ()):
            raise Refused(f'the parameters of {mechanism.name} are not known yet')
        try:
            # First that of the owner, which knows the names of others' parameters.
            for _ in range(1 if owner in self._scenes else 2):
                values = {name: value for name, (_, value) in self._values(owner).items()}
                self._scenes[owner] = scene.read(values, self._scenes.get(owner), strict=False)
        except scene.SceneError as error:
            raise Refused(str(error)) from None
        return self._scenes[owner]

    def _settings(self, mechanism: ShownMechanism, whole: scene.Scene) -> dict[str, Setting]:
        """Return the announced parameters of a mechanism; the ends of sliders take long."""
        values = self._values(mechanism.owner)
        found = [Setting(one.name, one.field, slider.ends(whole, one), node, self._announced[node])
                 for one in whole.machines[mechanism.name].parameters if one.name in values
                 for node, _ in [values[one.name]]]
        return {setting.name: setting for setting in found}

    def _open(self, keys: Collection[str], nodes: Collection[str], announced: Collection[str],
              sources: Collection[str]) -> None:
        """Create missing subscriptions for these, and destroy all others."""
        topics: dict[str, Any] = {
            f'{key}{ending}': (key, type_, qos) for key in keys for ending, type_, qos in (
                (MARKERS, MarkerArray, NEWEST), (LOCUS, Marker, LATCHED))}
        self._drop_others(nodes, announced, sources, topics)
        for topic in set(announced) - set(self._announcements):
            self._announcements[topic] = self._bridge.node.create_subscription(
                ParameterEvent, topic, partial(self._bridge.hand_over, self._notice),
                ownership.LATCHED)
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

    def _drop_others(self, nodes: Collection[str], announced: Collection[str],
                     sources: Collection[str], topics: Collection[str]) -> None:
        """Destroy all but these."""
        node = self._bridge.node
        for name in set(self._setters) - set(nodes):
            node.destroy_client(self._setters.pop(name))
        for topic in set(self._announcements) - set(announced):
            node.destroy_subscription(self._announcements.pop(topic))
        for topic in set(self._sources) - set(sources):
            node.destroy_subscription(self._sources.pop(topic))
            del self._received[topic]
        for name in set(self._feeds) - set(topics):
            node.destroy_subscription(self._feeds.pop(name)[1])

    def _close(self) -> None:
        self._drop_others((), (), (), ())
        self._numbers = {}

    def _receive(self, feed: Feed, raw: bytes) -> None:
        feed.newest = raw
        self._bridge.hand_over(self._offer, feed)

    def _offer(self, feed: Feed) -> None:
        for client in self.clients:
            client.offer(feed)

    def _notice(self, event: ParameterEvent) -> None:
        """Adopt announced values, and forward those that have changed to the pages."""
        if event.new_parameters:
            self._announced[event.node] = {}
            self._scenes.pop(event.node, None)
        values, changed = self._announced.setdefault(event.node, {}), set()
        for parameter in (*event.new_parameters, *event.changed_parameters):
            # Any node may announce values of unknown types.
            with suppress(RuntimeError):
                value = scene.plain(parameter_value_to_python(parameter.value))
                if parameter.name not in values:
                    self._seen = None
                    self._news.set()
                if value != values.get(parameter.name):
                    changed.add(parameter.name)
                    values[parameter.name] = value
        for mechanism in self._mechanisms.values():
            settings = [setting for setting in mechanism.settings.values()
                        if setting.node == event.node and setting.full_name in changed]
            drawn = self._drawn(mechanism) if settings else {}
            for setting in settings:
                message = {'op': 'value', 'mechanism': mechanism.key, 'name': setting.name,
                           'value': setting.value, 'drawn': drawn}
                for client in self.clients:
                    client.tell((mechanism.key, setting.name), message)


def _store(positions: dict[str, float], message: JointState) -> None:
    """Store the finite positions of a message by name."""
    positions.update((name, position) for name, position in zip(message.name, message.position)
                     if math.isfinite(position))


def _joined(space: str, name: str) -> str:
    return f'{space.rstrip("/")}/{name}'


def _space(name: str) -> str:
    return name.rsplit('/', 1)[0]
