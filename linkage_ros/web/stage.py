# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""The running scene as the page sees it: found in the graph, drawn, and set by services."""

import asyncio
from dataclasses import dataclass
import math

from rcl_interfaces.msg import ParameterEvent
from rclpy.qos import (
    DurabilityPolicy,
    qos_profile_parameter_events,
    QoSProfile,
    ReliabilityPolicy,
)
from visualization_msgs.msg import Marker, MarkerArray

from .bridge import NoAnswer
from .feed import Feed
from .settings import RemoteNode, Setting

try:
    from linkage_interfaces.srv import ServoInverse
except ImportError:
    # Without the service's type there is a picture, but no lever to drag.
    ServoInverse = None

MARKERS, LOCUS, LIST = '/markers', '/locus', '/list_parameters'
MARKERS_TYPE, LOCUS_TYPE = 'visualization_msgs/msg/MarkerArray', 'visualization_msgs/msg/Marker'
LIST_TYPE = 'rcl_interfaces/srv/ListParameters'
LEVER_TYPE = 'linkage_interfaces/srv/ServoInverse'
SECONDS_BETWEEN_LOOKS = 1.0
SECONDS_TO_LINGER = 1.0

NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Refused(Exception):
    """What cannot be done, with the reason."""


@dataclass
class Cast:
    """A mechanism on the stage: its topics' beginning, its settings and its lever's service."""

    key: str
    settings: dict
    lever: object = None

    @property
    def name(self):
        """Its name in its scene."""
        return self.key.rsplit('/', 1)[1]

    def described(self) -> dict:
        """Return what the page needs to draw it."""
        return {'key': self.key, 'name': self.name, 'lever': self.lever is not None,
                'settings': [setting.described() for setting in self.settings.values()]}


class Stage:
    """
    All mechanisms of the graph, while somebody looks; empty and silent while nobody does.

    Everything but what is handed to the bridge runs in the web's thread.

    Parameters
    ----------
    bridge : Bridge
        The way to the node.

    Attributes
    ----------
    audience : list
        Whoever looks: `tell(key, message)` hears what is new, `offer(feed)` what can be drawn.

    """

    def __init__(self, bridge):
        self.audience = []
        self._bridge = bridge
        self._setting = asyncio.Lock()
        self._seen = None
        self._cast = {}
        self._looking = None
        self._lowering = None
        # What follows is changed in the executor's thread alone.
        self._nodes = {}
        self._levers = {}
        self._feeds = {}
        self._numbers = {}
        self._events = None

    def enter(self, visitor):
        """Let somebody look; the first one raises the curtain."""
        self.audience.append(visitor)
        if self._lowering:
            self._lowering.cancel()
        if self._looking is None:
            self._looking = asyncio.ensure_future(self._look())
            return
        visitor.tell('scene', self._scene())
        for feed in self.feeds():
            visitor.offer(feed)

    def leave(self, visitor):
        """Let somebody go; after the last one the curtain falls, unless it was only a reload."""
        self.audience.remove(visitor)
        if not self.audience:
            # A node that is still to answer would wait for a client that is gone.
            self._lowering = self._bridge.loop.call_later(SECONDS_TO_LINGER, self._lower)

    def _lower(self):
        self._looking.cancel()
        self._looking = self._lowering = None
        self._seen, self._cast = None, {}
        self._bridge.ask(self._close)

    def feeds(self):
        """Return the feeds that have something to draw."""
        return [feed for feed, _ in list(self._feeds.values()) if feed.newest is not None]

    async def set(self, key: str, values: dict):
        """
        Set parameters of a mechanism on every node that has them, or on none.

        Raises
        ------
        Refused
            With the node's reason.

        """
        async with self._setting:
            cast = self._find(key)
            new, old = {}, {}
            for name, value in values.items():
                if name not in cast.settings:
                    raise Refused(f'{cast.name} has no parameter {name!r}')
                setting = cast.settings[name]
                full = f'{cast.name}.{name}'
                try:
                    message = setting.message(full, value)
                except ValueError as error:
                    raise Refused(str(error)) from None
                for node, present in setting.messages.items():
                    new.setdefault(node, []).append(message)
                    old.setdefault(node, []).append(type(message)(name=full, value=present))
            await self._set_all(new, old)

    async def drag(self, key: str, angle: float) -> dict:
        """Put a lever at an angle [rad] by its crank, and hold it; return the service's answer."""
        cast = self._find(key)
        if cast.lever is None:
            raise Refused(f'{cast.name} has no lever that a servo_inverse node knows')
        try:
            answer = await self._bridge.call(cast.lever, ServoInverse.Request(
                mechanism=cast.name, lever_angle=[float(angle)]))
        except (NoAnswer, TypeError, ValueError) as error:
            raise Refused(str(error)) from None
        if not answer.success:
            raise Refused(answer.message)
        servo, reduction = answer.servo_angle[0], answer.reduction[0]
        await self.set(key, {'crank.speed': 0.0, 'crank.start': servo})
        return {'servo': servo, 'reduction': reduction if math.isfinite(reduction) else None}

    def _find(self, key):
        if key not in self._cast:
            raise Refused(f'there is no mechanism {key!r}; there are: {", ".join(self._cast)}')
        return self._cast[key]

    async def _set_all(self, new, old):
        done = []
        for node, parameters in new.items():
            reason = await self._set_one(node, parameters)
            if reason:
                for other in done:
                    await self._set_one(other, old[other])
                raise Refused(reason)
            done.append(node)

    async def _set_one(self, node, parameters):
        try:
            return await self._nodes[node].set(parameters)
        except (NoAnswer, KeyError) as error:
            return str(error)

    def _scene(self):
        return {'op': 'scene', 'mechanisms': [cast.described() for cast in self._cast.values()]}

    def _tell(self, key, message):
        for visitor in self.audience:
            visitor.tell(key, message)

    async def _look(self):
        await self._bridge.ask(self._listen)
        while True:
            seen = await self._bridge.ask(self._survey)
            if seen != self._seen:
                self._seen = seen
                await self._change(*seen)
            await asyncio.sleep(SECONDS_BETWEEN_LOOKS)

    def _survey(self):
        """Return what there is in the graph: marker topics, nodes with parameters, services."""
        node = self._bridge.node
        topics = dict(node.get_topic_names_and_types())
        services = node.get_service_names_and_types()
        keys = sorted(name[:-len(MARKERS)] for name, types in topics.items()
                      if name.endswith(MARKERS) and MARKERS_TYPE in types)
        keys = [key for key in keys if LOCUS_TYPE in topics.get(f'{key}{LOCUS}', ())]
        marked = tuple((key, tuple(sorted(
            (_joined(info.node_namespace, info.node_name), bytes(info.endpoint_gid))
            for info in node.get_publishers_info_by_topic(f'{key}{MARKERS}')))) for key in keys)
        nodes = tuple(sorted(name[:-len(LIST)] for name, types in services
                             if name.endswith(LIST) and LIST_TYPE in types))
        levers = tuple(sorted(name for name, types in services if LEVER_TYPE in types))
        return tuple(shown for shown in marked if shown[1]), nodes, levers

    async def _change(self, marked, nodes, levers):
        homes = {key: [name for name, _ in publishers] for key, publishers in marked}
        spaces = {_space(node) for names in homes.values() for node in names}
        nodes = [node for node in nodes if _space(node) in spaces]
        levers = [name for name in levers if _space(name) in spaces and ServoInverse]
        await self._bridge.ask(self._open, list(homes), nodes, levers)
        names = sorted({key.rsplit('/', 1)[1] for key in homes})
        found = dict(zip(nodes, await asyncio.gather(
            *(self._parameters(node, names) for node in nodes))))
        self._cast = {key: self._found(key, home, found) for key, home in homes.items()}
        self._tell('scene', self._scene())

    async def _parameters(self, node, prefixes):
        try:
            return await self._nodes[node].parameters(prefixes)
        except NoAnswer:
            # It may be on its way up or down: look again.
            self._seen = None
            return {}

    def _found(self, key, home, found) -> Cast:
        """Return a mechanism with what the nodes of its namespace say of it, its own first."""
        cast = Cast(key, {})
        spaces = {_space(node) for node in home}
        prefix = f'{cast.name}.'
        near = [node for node in found if _space(node) in spaces]
        for node in sorted(near, key=lambda node: node not in home):
            for full, (descriptor, value) in found[node].items():
                if full.startswith(prefix):
                    name = full[len(prefix):]
                    setting = cast.settings.setdefault(name, Setting(name, descriptor, {}))
                    setting.messages[node] = value
        type_ = cast.settings.get('type')
        if type_ and type_.value == 'slotted_lever':
            cast.lever = next((client for name, client in self._levers.items()
                               if _space(name) in spaces), None)
        return cast

    def _listen(self):
        self._events = self._bridge.node.create_subscription(
            ParameterEvent, '/parameter_events',
            lambda event: self._bridge.hand_over(self._notice, event),
            qos_profile_parameter_events)

    def _open(self, keys, nodes, levers):
        """Make what these need that is not there yet, and destroy what nobody needs."""
        topics = {f'{key}{ending}': (key, type_, qos) for key in keys for ending, type_, qos in (
            (MARKERS, MarkerArray, NEWEST), (LOCUS, Marker, LATCHED))}
        self._keep(nodes, levers, topics)
        for name in set(nodes) - set(self._nodes):
            self._nodes[name] = RemoteNode(self._bridge, name)
        for name in set(levers) - set(self._levers):
            self._levers[name] = self._bridge.node.create_client(ServoInverse, name)
        for name in set(topics) - set(self._feeds):
            self._feeds[name] = self._fed(name, *topics[name])

    def _fed(self, name, key, type_, qos):
        feed = Feed(key, type_, lambda *marker: self._numbers.setdefault(
            (name, *marker), len(self._numbers)))
        return feed, self._bridge.node.create_subscription(
            type_, name, lambda raw: self._take(feed, raw), qos, raw=True)

    def _keep(self, nodes, levers, topics):
        """Destroy all but these."""
        node = self._bridge.node
        for name in set(self._nodes) - set(nodes):
            self._nodes.pop(name).close()
        for name in set(self._levers) - set(levers):
            node.destroy_client(self._levers.pop(name))
        for name in set(self._feeds) - set(topics):
            node.destroy_subscription(self._feeds.pop(name)[1])

    def _close(self):
        self._keep((), (), ())
        self._numbers = {}
        if self._events is not None:
            self._bridge.node.destroy_subscription(self._events)
            self._events = None

    def _take(self, feed, raw):
        feed.newest = raw
        self._bridge.hand_over(self._offer, feed)

    def _offer(self, feed):
        for visitor in self.audience:
            visitor.offer(feed)

    def _notice(self, event):
        """Pass on a change that anybody made."""
        for cast in self._cast.values():
            prefix = f'{cast.name}.'
            for parameter in (*event.new_parameters, *event.changed_parameters):
                if parameter.name.startswith(prefix):
                    self._notice_one(cast, event.node, parameter.name[len(prefix):], parameter)

    def _notice_one(self, cast, node, name, parameter):
        setting = cast.settings.get(name)
        if setting is None or node not in setting.messages:
            if node in self._nodes:
                self._seen = None
            return
        setting.messages[node] = parameter.value
        if node == setting.nodes[0]:
            self._tell(('value', cast.key, name), {
                'op': 'value', 'mechanism': cast.key, 'name': name, 'value': setting.value})


def _joined(space, name):
    return f'{space.rstrip("/")}/{name}'


def _space(name):
    return name.rsplit('/', 1)[0]
