# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The running scene for the page: found in the ROS graph, drawn, and changed by services."""

import asyncio
from contextlib import suppress
from dataclasses import dataclass
import math

from linkage_interfaces.srv import ServoInverse
import numpy as np
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
from .settings import is_number, RemoteNode, Setting
from ..words import quoted

MARKERS, LOCUS, LIST = '/markers', '/locus', '/list_parameters'
MARKERS_TYPE, LOCUS_TYPE = 'visualization_msgs/msg/MarkerArray', 'visualization_msgs/msg/Marker'
LIST_TYPE = 'rcl_interfaces/srv/ListParameters'
LEVER_TYPE = 'linkage_interfaces/srv/ServoInverse'
SECONDS_BETWEEN_LOOKS = 1.0
SECONDS_TO_LINGER = 1.0
# How finely, and how often, it is looked for the end of a lever's reach.
SAMPLES, CLOSER_LOOKS = 2001, 4
SCENE = 'scene'

NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Refused(Exception):
    """What cannot be done, with the reason."""


@dataclass
class ShownMechanism:
    """A mechanism on the page: the start of its topics, its settings, its lever's service."""

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


class SceneView:
    """
    All mechanisms of the graph, while a page is open; without one nothing is subscribed to.

    Everything but what is handed to the bridge runs in the web's thread.

    Parameters
    ----------
    bridge : Bridge
        The way to the node.

    Attributes
    ----------
    clients : list
        Open pages: `tell(key, message)` hears what is new, `offer(feed)` what can be drawn.

    """

    def __init__(self, bridge):
        self.clients = []
        self._bridge = bridge
        self._setting = asyncio.Lock()
        self._seen = None
        self._mechanisms = {}
        self._watching = None
        self._stopping = None
        # What follows is changed in the executor's thread alone.
        self._nodes = {}
        self._levers = {}
        self._feeds = {}
        self._numbers = {}
        self._events = None

    def add(self, client):
        """Show a client the scene, which is watched from the first client on."""
        self.clients.append(client)
        if self._stopping:
            self._stopping.cancel()
        if self._watching is None:
            self._watching = asyncio.ensure_future(self._watch())
            return
        self._show(client)

    def remove(self, client):
        """Forget a client; after the last one watching ends, unless it was only a reload."""
        self.clients.remove(client)
        if not self.clients:
            # A node that is still to answer would wait for a client that is gone.
            self._stopping = self._bridge.loop.call_later(SECONDS_TO_LINGER, self._stop)

    def _stop(self):
        self._watching.cancel()
        self._watching = self._stopping = None
        self._seen, self._mechanisms = None, {}
        self._bridge.ask(self._close)

    def feeds(self):
        """Return the feeds that have something to draw."""
        return [feed for feed, _ in list(self._feeds.values()) if feed.newest is not None]

    async def set(self, key: str, values: dict):
        """
        Set parameters of a mechanism, those of one node all or none.

        Raises
        ------
        Refused
            With the node's reason.

        """
        async with self._setting:
            mechanism = self._find(key)
            asked = {}
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

    async def _set(self, node, parameters):
        if node not in self._nodes:
            raise Refused(f'{node} is gone')
        try:
            reason = await self._nodes[node].set(parameters)
        except NoAnswer as error:
            reason = str(error)
        if reason:
            raise Refused(reason)

    async def drag(self, key: str, angle: float) -> dict:
        """
        Put a lever at an angle [rad], or as near as it gets, by its crank, and hold it there.

        Returns
        -------
        dict
            The service's answer, and why the lever is not at the angle, if it is not.

        """
        mechanism = self._find(key)
        if mechanism.lever is None:
            raise Refused(f'{mechanism.name} has no lever that a servo_inverse node knows')
        if not is_number(angle):
            raise ValueError(f'angle must be a finite number, not {quoted(angle)}')
        answer = await self._asked(mechanism, [angle])
        reason = answer.message
        if not answer.success:
            angle = await self._nearest(mechanism, angle)
            answer = await self._asked(mechanism, [angle])
        if not answer.success:
            raise Refused(reason)
        servo, reduction = answer.servo_angle[0], answer.reduction[0]
        await self.set(key, {'crank.speed': 0.0, 'crank.start': servo})
        return {'value': angle, 'servo': servo, 'reason': reason,
                'reduction': reduction if math.isfinite(reduction) else None}

    def _find(self, key):
        if key not in self._mechanisms:
            raise Refused(f'there is no mechanism {quoted(key)}; '
                          f'there are: {", ".join(self._mechanisms)}')
        return self._mechanisms[key]

    async def _asked(self, mechanism, angles):
        try:
            return await self._bridge.call(mechanism.lever, ServoInverse.Request(
                mechanism=mechanism.name, lever_angle=angles))
        except NoAnswer as error:
            raise Refused(str(error)) from None

    async def _nearest(self, mechanism, angle):
        """Return the nearest angle that a lever reaches, seen ever closer on a finer scale."""
        low, high, nearest = -math.pi, math.pi, 0.0
        for _ in range(CLOSER_LOOKS):
            away = np.linspace(low, high, SAMPLES)
            reached = away[(await self._asked(mechanism, (angle + away).tolist())).reachable]
            if not len(reached):
                break
            nearest = float(min(reached, key=abs))
            low, high = nearest, nearest - math.copysign((high - low) / (SAMPLES - 1), nearest)
        return angle + nearest

    def _show(self, client):
        client.tell(SCENE, {'op': 'scene', 'mechanisms': [
            mechanism.described() for mechanism in self._mechanisms.values()]})
        for feed in self.feeds():
            client.offer(feed)

    async def _watch(self):
        await self._bridge.ask(self._listen)
        while True:
            try:
                await self._look()
            except Exception as error:
                # What other nodes say of themselves is anything; the next look may find it well.
                self._seen = None
                self._bridge.warn(f'the scene cannot be read: {error!r}')
            await asyncio.sleep(SECONDS_BETWEEN_LOOKS)

    async def _look(self):
        seen = await self._bridge.ask(self._graph)
        if seen != self._seen:
            self._seen = seen
            await self._change(*seen)

    def _graph(self):
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
        owners = {key: [name for name, _ in publishers] for key, publishers in marked}
        spaces = {_space(node) for names in owners.values() for node in names}
        nodes = [node for node in nodes if _space(node) in spaces]
        levers = [name for name in levers if _space(name) in spaces]
        await self._bridge.ask(self._open, list(owners), nodes, levers)
        names = sorted({key.rsplit('/', 1)[1] for key in owners})
        found = dict(zip(nodes, await asyncio.gather(
            *(self._parameters(node, names) for node in nodes))))
        self._mechanisms = {key: self._mechanism(key, own_nodes, found)
                            for key, own_nodes in owners.items()}
        for client in self.clients:
            self._show(client)

    async def _parameters(self, node, prefixes):
        try:
            return await self._nodes[node].parameters(prefixes)
        except NoAnswer:
            # It may be on its way up or down: look again.
            self._seen = None
            return {}

    def _mechanism(self, key, own_nodes, found) -> ShownMechanism:
        """Return a mechanism with what the nodes of its namespace say of it, its own first."""
        mechanism = ShownMechanism(key, {})
        spaces = {_space(node) for node in own_nodes}
        prefix = f'{mechanism.name}.'
        near = [node for node in found if _space(node) in spaces]
        for node in sorted(near, key=lambda node: node not in own_nodes):
            for full, (descriptor, value) in found[node].items():
                name = full[len(prefix):]
                if full.startswith(prefix) and name not in mechanism.settings:
                    with suppress(ValueError):
                        mechanism.settings[name] = Setting(name, node, descriptor, value)
        type_ = mechanism.settings.get('type')
        if type_ and type_.value == 'slotted_lever':
            mechanism.lever = next((client for name, client in self._levers.items()
                                    if _space(name) in spaces), None)
        return mechanism

    def _listen(self):
        self._events = self._bridge.node.create_subscription(
            ParameterEvent, '/parameter_events',
            lambda event: self._bridge.hand_over(self._notice, event),
            qos_profile_parameter_events)

    def _open(self, keys, nodes, levers):
        """Make what these need that is not there yet, and destroy what nobody needs."""
        topics = {f'{key}{ending}': (key, type_, qos) for key in keys for ending, type_, qos in (
            (MARKERS, MarkerArray, NEWEST), (LOCUS, Marker, LATCHED))}
        self._drop_others(nodes, levers, topics)
        for name in set(nodes) - set(self._nodes):
            self._nodes[name] = RemoteNode(self._bridge, name)
        for name in set(levers) - set(self._levers):
            self._levers[name] = self._bridge.node.create_client(ServoInverse, name)
        for name in set(topics) - set(self._feeds):
            self._feeds[name] = self._feed(name, *topics[name])

    def _feed(self, name, key, type_, qos):
        def number(i):
            return self._numbers.setdefault((name, i), len(self._numbers))

        # A logger of its own: what is throttled is the warnings of this topic alone.
        logger = self._bridge.node.get_logger().get_child(name.strip('/'))
        feed = Feed(name, key, type_, number, logger)
        return feed, self._bridge.node.create_subscription(
            type_, name, lambda raw: self._receive(feed, raw), qos, raw=True)

    def _drop_others(self, nodes, levers, topics):
        """Destroy all but these."""
        node = self._bridge.node
        for name in set(self._nodes) - set(nodes):
            self._nodes.pop(name).close()
        for name in set(self._levers) - set(levers):
            node.destroy_client(self._levers.pop(name))
        for name in set(self._feeds) - set(topics):
            node.destroy_subscription(self._feeds.pop(name)[1])

    def _close(self):
        self._drop_others((), (), ())
        self._numbers = {}
        if self._events is not None:
            self._bridge.node.destroy_subscription(self._events)
            self._events = None

    def _receive(self, feed, raw):
        feed.newest = raw
        self._bridge.hand_over(self._offer, feed)

    def _offer(self, feed):
        for client in self.clients:
            client.offer(feed)

    def _notice(self, event):
        """Pass on a change that anybody made."""
        for mechanism in self._mechanisms.values():
            prefix = f'{mechanism.name}.'
            for parameter in (*event.new_parameters, *event.changed_parameters):
                name = parameter.name[len(prefix):]
                if parameter.name.startswith(prefix):
                    self._notice_one(mechanism, event.node, name, parameter)

    def _notice_one(self, mechanism, node, name, parameter):
        setting = mechanism.settings.get(name)
        if setting is None or parameter.value.type != setting.message.type:
            if node in self._nodes:
                self._seen = None
            return
        if node != setting.node:
            return
        setting.message = parameter.value
        for client in self.clients:
            client.tell((mechanism.key, name), {'op': 'value', 'mechanism': mechanism.key,
                                            'name': name, 'value': setting.value})


def _joined(space, name):
    return f'{space.rstrip("/")}/{name}'


def _space(name):
    return name.rsplit('/', 1)[0]
