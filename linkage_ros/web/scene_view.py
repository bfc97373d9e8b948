# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The running scene for the page: what nodes announce, its markers, and changes by services."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import partial
import math
import re
from typing import (
    Any,
    Callable,
    Collection,
    Mapping,
    Optional,
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

EVENTS_TYPE, INPUTS_TYPE = 'rcl_interfaces/msg/ParameterEvent', 'sensor_msgs/msg/JointState'
SECONDS_BETWEEN_POLLS = 1.0
SECONDS_TO_LINGER = 1.0
SECONDS_TO_ANNOUNCE = 1.0
SECONDS_TO_ARRIVE, ARRIVED = 1.0, 1e-6
# Parameters that define a scene, which a saved file always has.
DEFINES = re.compile(r'mechanisms|[^.]+\.(type|scale|dimensions\..+)')
SCENE = 'scene'

Answer = dict[str, Any]
Result = TypeVar('Result')

NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@dataclass
class ShownMechanism:
    """A mechanism on the page: prefix of its topics, node, settings, and topics of its inputs."""

    key: str
    owner: str
    settings: dict[str, Setting]
    sources: Sequence[str]

    @property
    def name(self) -> str:
        """Its name in its scene."""
        return self.key.rsplit('/', 1)[1]


class SceneView:
    """
    All mechanisms that nodes announce, while a page is open; otherwise it subscribes to nothing.

    All methods run in the web's thread, except functions passed to the bridge.

    Parameters
    ----------
    bridge : Bridge
        Calls to the node.

    Attributes
    ----------
    clients : list
        Open pages, of class Client: they receive messages by `tell`, markers by `offer`.

    """

    def __init__(self, bridge: Bridge) -> None:
        self.clients: list[Any] = []
        self._bridge = bridge
        self._setting = asyncio.Lock()
        # The nodes that announce parameters, by topic, and the topics of owners' inputs.
        self._graph: tuple[dict[str, list[str]], dict[str, list[str]]] = {}, {}
        self._is_stale = True
        self._mechanisms: dict[str, ShownMechanism] = {}
        # The values that each node announces, by full name; the scenes that were read from them.
        self._announced: dict[str, dict[str, Any]] = {}
        self._scenes: dict[str, scene.Scene] = {}
        # By mechanism and input: the last speed other than zero, and where it was moved to. It is
        # there until a time, or until messages confirm it: earlier ones may have the old value.
        self._speeds: dict[tuple[str, str], float] = {}
        self._moved: dict[tuple[str, str], tuple[float, float]] = {}
        self._news = asyncio.Event()
        self._watching: Optional[asyncio.Task[None]] = None
        self._stopping: Optional[asyncio.TimerHandle] = None
        # The following attributes are changed in the executor's thread alone.
        self._setters: dict[str, Any] = {}
        self._subscriptions: dict[str, Any] = {}
        self._positions: dict[str, dict[str, float]] = {}
        self._feeds: dict[str, Feed] = {}

    def add(self, client: Any) -> None:
        """Add a client; the first one starts the observation of the graph."""
        self.clients.append(client)
        if self._stopping:
            self._stopping.cancel()
        if self._watching is None:
            self._watching = asyncio.create_task(self._watch())
            return
        self._show(client)

    def remove(self, client: Any) -> None:
        """Remove a client; after the last one the observation ends, unless it was a reload."""
        self.clients.remove(client)
        if not self.clients:
            # Requests in progress would wait for a client that has left.
            self._stopping = self._bridge.loop.call_later(SECONDS_TO_LINGER, self._stop)

    def _stop(self) -> None:
        if self._watching:
            self._watching.cancel()
        self._watching = self._stopping = None
        self._graph, self._is_stale = ({}, {}), True
        self._mechanisms, self._announced, self._scenes = {}, {}, {}
        self._bridge.ask(self._drop_others, (), ())

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
            requests: dict[str, list[Any]] = {}
            for name, value in values.items():
                if name not in mechanism.settings:
                    raise Refused(f'{mechanism.name} has no parameter {quoted(name)}')
                setting = mechanism.settings[name]
                try:
                    parameter = setting.parameter(value)
                except ValueError as error:
                    raise Refused(str(error)) from None
                requests.setdefault(setting.node, []).append(parameter)
            for node, parameters in requests.items():
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

    async def pose(self, key: str, want: Optional[Mapping[str, Any]] = None, arrows: str = ''
                   ) -> Answer:
        """
        Describe a mechanism's pose; with a request, move it there first and hold it.

        Arguments are those of `poses.reached`, and a kind of arrows, at the speeds when it plays.
        The result is that of `poses.described`, with requested arrows, and the reason, and what is
        reached, if the request is not met exactly.
        """
        mechanism = self._find(key)
        (machine, inputs), reach = self._state(mechanism), None
        if want is None:
            self._check_known(mechanism, machine)
        else:
            inputs, reach = poses.reached(machine, inputs, dict(want))
            await self._hold(mechanism, machine, inputs)
        answer = {**poses.described(machine, inputs), 'reason': str(reach or '')}
        if reach:
            answer['reach'] = asdict(reach)
        if arrows:
            answer['arrows'] = poses.arrows(machine, inputs, arrows, {
                name: self._playing(mechanism, name, drive)
                for name, drive in machine.inputs.items()})
        return answer

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
                value = poses.next_to(drive, value)
            values.update({f'{name}.start': value, f'{name}.speed': 0.0})
        await self.set(mechanism.key, values)
        until = self._bridge.loop.time() + SECONDS_TO_ARRIVE
        for name, value in zip(machine.inputs, inputs):
            self._moved[mechanism.key, name] = value, until

    async def tune(self, key: str) -> Answer:
        """Return the result of `poses.tunable`."""
        mechanism = self._find(key)
        whole = self._scene(mechanism.owner)
        return await self._aside(lambda: poses.tunable(whole, mechanism.name))

    async def curve(self, key: str, **about: Any) -> Answer:
        """Return the result of `curves.curve`."""
        machine, inputs = self._state(self._find(key))
        return await self._aside(lambda: curves.curve(machine, inputs, **about))

    async def export(self, key: str, form: str) -> Answer:
        """Return the result of `curves.exported`."""
        mechanism = self._find(key)
        whole = self._scene(mechanism.owner)
        machine, inputs = (whole.machines[mechanism.name], []) if form == 'c' else self._state(
            mechanism)
        return {'text': await self._aside(
            lambda: curves.exported(machine, inputs, form, whole.frame_id))}

    async def save(self, key: str) -> Answer:
        """Return a parameter file of a mechanism's scene: its definition and changed values."""
        owner = self._find(key).owner
        whole = self._scene(owner)
        # An input that was stopped is saved with the speed that it had.
        speeds = {f'{name}.{input_}.speed': self._speeds[f'{_space(owner)}/{name}', input_]
                  for name, machine in whole.machines.items() for input_ in machine.inputs
                  if (f'{_space(owner)}/{name}', input_) in self._speeds}
        return {'text': await self._aside(lambda: writing.in_yaml(writing.without_defaults(
            scene.changed(whole, speeds, strict=False), DEFINES)))}

    async def _aside(self, work: Callable[[], Result]) -> Result:
        """Run slow work in another thread; return its result."""
        try:
            result: Result = await self._bridge.loop.run_in_executor(None, work)
            return result
        except scene.SceneError as error:
            raise Refused(str(error)) from None

    def _state(self, mechanism: ShownMechanism) -> tuple[scene.SceneMechanism, list[float]]:
        """Return a mechanism and its last received inputs [rad or m], or their starts."""
        machine, inputs = self._scene(mechanism.owner).machines[mechanism.name], []
        if machine.in_space:
            raise Refused(f'{machine.name} is a linkage in space: the page draws and tunes it, '
                          'and moves, plots and describes linkages in a plane')
        for name, drive in machine.inputs.items():
            position = self._position_of(mechanism, drive.source)
            now = drive.start if position is None else machine.from_source(
                drive, position, None, None)[0]
            now = now if math.isfinite(now) else drive.start
            value, until = self._moved.get((mechanism.key, name), (now, math.inf))
            if self._bridge.loop.time() > until or (
                    drive.input.apart(value, now) < ARRIVED * drive.input.size):
                self._moved.pop((mechanism.key, name), None)
                value = now
            inputs.append(value)
        return machine, inputs

    def _position_of(self, mechanism: ShownMechanism, source: str) -> Optional[float]:
        """Return the last position of an input's source, or None."""
        return next((self._positions[topic][source] for topic in mechanism.sources
                     if source in self._positions.get(topic, ())), None)

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

    def _show(self, client: Any) -> None:
        mechanisms = []
        for mechanism in self._mechanisms.values():
            # What a node announces may be no scene any more.
            with suppress(Refused):
                mechanisms.append({
                    'key': mechanism.key, 'name': mechanism.name, **self._described(mechanism),
                    'settings': [setting.described() for setting in mechanism.settings.values()]})
        client.tell(SCENE, {'op': 'scene', 'mechanisms': mechanisms})
        for feed in [*self._feeds.values()]:
            client.offer(feed)

    def _described(self, mechanism: ShownMechanism) -> dict[str, Any]:
        """Describe what the page needs of a mechanism beside its parameters and markers."""
        machine = self._scene(mechanism.owner).machines[mechanism.name]
        description = {**poses.drawn(machine), 'curves': curves.plots(machine)}
        for name, drive in machine.inputs.items():
            if drive.speed:
                self._speeds[mechanism.key, name] = drive.speed
            description['inputs'][name]['speed'] = self._playing(mechanism, name, drive)
        return description

    def _playing(self, mechanism: ShownMechanism, name: str, drive: scene.InputSettings) -> float:
        """Return the speed of an input when it plays: the last one that was not zero."""
        return self._speeds.get((mechanism.key, name), drive.default_speed)

    async def _watch(self) -> None:
        while True:
            try:
                await self._poll()
            except Exception as error:
                # Other nodes may publish anything; the next poll may succeed.
                self._is_stale = True
                self._bridge.warn(f'the scene cannot be read: {error!r}')
            with suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._news.wait(), SECONDS_BETWEEN_POLLS)

    async def _poll(self) -> None:
        self._news.clear()
        graph = await self._bridge.ask(self._find_announcers)
        if graph != self._graph or self._is_stale:
            gone = self._graph[1].keys() - graph[1].keys()
            self._graph, self._is_stale = graph, False
            await self._change(graph[0], graph[1], gone)

    def _find_announcers(self) -> tuple[dict[str, list[str]], dict[str, list[str]]]:
        """Return the nodes that announce parameters, by topic, and the topics of their inputs."""
        node = self._bridge.node
        announcers = {topic: sorted({
            _joined(info.node_namespace, info.node_name)
            for info in node.get_publishers_info_by_topic(topic)
            # Of a node that starts, the name is unknown at first.
            if info.node_namespace.startswith('/')})
            for topic, types in node.get_topic_names_and_types()
            if topic.endswith(f'/{ownership.TOPIC}') and EVENTS_TYPE in types}
        return announcers, {name: self._input_topics(name)
                            for names in announcers.values() for name in names}

    def _input_topics(self, name: str) -> list[str]:
        """Return the topics from which a node receives its inputs."""
        space, node = name.rsplit('/', 1)
        with suppress(NodeNameNonExistentError):
            return [topic for topic, types in
                    self._bridge.node.get_subscriber_names_and_types_by_node(node, space or '/')
                    if INPUTS_TYPE in types]
        return []

    async def _change(self, announcers: Collection[str], inputs: Mapping[str, list[str]],
                      gone: Collection[str]) -> None:
        """Follow what the nodes with these topics of inputs announce, and forget others."""
        topics: dict[str, Callable[[str], Any]] = dict.fromkeys(announcers, self._listen)
        await self._bridge.ask(self._subscribe, topics)
        with suppress(asyncio.TimeoutError):
            await asyncio.wait_for(self._wait_for_announcements(inputs), SECONDS_TO_ANNOUNCE)
        owners = {f'{_space(owner)}/{name}': owner for owner in sorted(inputs)
                  for name in self._names(owner)}
        mechanisms = {key: ShownMechanism(
            key, owner, await self._aside(partial(self._settings, key, owner)), inputs[owner])
            for key, owner in sorted(owners.items())}
        for key, owner in owners.items():
            topics.update(dict.fromkeys(inputs[owner], self._follow))
            topics[f'{key}/markers'] = partial(self._draw, key, MarkerArray, NEWEST)
            topics[f'{key}/locus'] = partial(self._draw, key, Marker, LATCHED)
        await self._bridge.ask(self._drop_others, inputs, topics)
        await self._bridge.ask(self._subscribe, topics)
        self._mechanisms = mechanisms
        for node in gone:
            self._announced.pop(node, None)
        for client in self.clients:
            self._show(client)

    async def _wait_for_announcements(self, nodes: Collection[str]) -> None:
        """Wait until some nodes have announced their parameters."""
        while not self._announced.keys() >= set(nodes):
            self._news.clear()
            await self._news.wait()

    def _names(self, owner: str) -> Collection[str]:
        """Return the mechanisms that a node announces."""
        with suppress(Refused):
            return self._scene(owner).machines.keys()
        return ()

    def _scene(self, owner: str) -> scene.Scene:
        """Return the scene of a node that announces one; raise Refused if it does not."""
        values = self._announced.get(owner, {})
        if 'mechanisms' not in values:
            raise Refused(f'{owner} announces no mechanisms')
        try:
            if owner not in self._scenes:
                self._scenes[owner] = scene.read(values, strict=False)
            self._scenes[owner] = scene.read({
                name: value for name, (_, value) in self._values(owner).items()},
                self._scenes[owner], strict=False)
        except scene.SceneError as error:
            raise Refused(str(error)) from None
        return self._scenes[owner]

    def _values(self, owner: str) -> dict[str, tuple[str, Any]]:
        """Return node and value of each announced parameter of an owner's scene, by full name."""
        values = {name: (owner, value) for name, value in self._announced[owner].items()}
        others = {parameter.name: parameter.field for parameter in self._scenes[owner].parameters
                  if parameter.name not in values}
        for node in self._announced.keys() - {owner}:
            for name in self._announced[node].keys() & others.keys():
                # Any node may announce anything.
                if _space(node) == _space(owner):
                    with suppress(scene.SceneError):
                        values[name] = node, others[name].checked(
                            name, self._announced[node][name])
        return values

    def _settings(self, key: str, owner: str) -> dict[str, Setting]:
        """Return the announced parameters of a mechanism; the ends of sliders take long."""
        whole, values = self._scene(owner), self._values(owner)
        settings = [
            Setting(parameter.name, parameter.field, slider.ends(whole, parameter), node,
                    self._announced[node])
            for parameter in whole.machines[key.rsplit('/', 1)[1]].parameters
            if parameter.name in values for node, _ in [values[parameter.name]]]
        return {setting.name: setting for setting in settings}

    def _drop_others(self, nodes: Collection[str], topics: Collection[str]) -> None:
        """Destroy the clients and subscriptions of all other nodes and topics."""
        for name in set(self._setters) - set(nodes):
            self._bridge.node.destroy_client(self._setters.pop(name))
        for topic in set(self._subscriptions) - set(topics):
            self._bridge.node.destroy_subscription(self._subscriptions.pop(topic))
            self._feeds.pop(topic, None)
            self._positions.pop(topic, None)

    def _subscribe(self, topics: Mapping[str, Callable[[str], Any]]) -> None:
        """Subscribe to topics, each by a function of its name, unless it is done."""
        for topic in set(topics) - set(self._subscriptions):
            self._subscriptions[topic] = topics[topic](topic)

    def _listen(self, topic: str) -> Any:
        return self._bridge.node.create_subscription(
            ParameterEvent, topic, partial(self._bridge.hand_over, self._notice),
            ownership.LATCHED)

    def _follow(self, topic: str) -> Any:
        positions = self._positions[topic] = {}

        def store(message: JointState) -> None:
            positions.update((name, position) for name, position in zip(
                message.name, message.position) if math.isfinite(position))

        return self._bridge.node.create_subscription(JointState, topic, store, NEWEST)

    def _draw(self, key: str, type_: type, qos: QoSProfile, topic: str) -> Any:
        feed = self._feeds[topic] = Feed(key, topic, type_, self._bridge.warn)

        def receive(raw: bytes) -> None:
            feed.newest = raw
            self._bridge.hand_over(self._offer, feed)

        return self._bridge.node.create_subscription(type_, topic, receive, qos, raw=True)

    def _offer(self, feed: Feed) -> None:
        for client in self.clients:
            client.offer(feed)

    def _notice(self, event: ParameterEvent) -> None:
        """Adopt announced values, and forward those that have changed to the pages."""
        values = self._announced.setdefault(event.node, {})
        before = dict(values)
        if event.new_parameters:
            values.clear()
        for parameter in (*event.new_parameters, *event.changed_parameters):
            # Any node may announce values of unknown types.
            with suppress(RuntimeError):
                values[parameter.name] = scene.plain(parameter_value_to_python(parameter.value))
        changed = {name for name, value in values.items() if value != before.get(name)}
        if values.keys() != before.keys():
            self._scenes.pop(event.node, None)
            self._is_stale = True
            self._news.set()
        for mechanism in self._mechanisms.values():
            settings = [setting for setting in mechanism.settings.values()
                        if setting.node == event.node and setting.full_name in changed]
            with suppress(Refused):
                description = self._described(mechanism) if settings else {}
                for setting in settings:
                    message = {'op': 'value', 'mechanism': mechanism.key, 'name': setting.name,
                               'value': setting.value, 'drawn': description}
                    for client in self.clients:
                        client.tell((mechanism.key, setting.name), message)


def _joined(space: str, name: str) -> str:
    return f'{space.rstrip("/")}/{name}'


def _space(name: str) -> str:
    return name.rsplit('/', 1)[0]
