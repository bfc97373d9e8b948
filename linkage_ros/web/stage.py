# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The running scene as the page sees it: found in the graph, drawn, and set by services."""

import asyncio
from contextlib import suppress
from dataclasses import dataclass
import math

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
from .settings import is_number, RemoteNode, Setting, shortened

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
# How finely, and how often, it is looked for the end of a lever's reach.
SAMPLES, CLOSER_LOOKS = 2001, 4
SCENE = 'scene'

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
        self._show(visitor)

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
        Set parameters of a mechanism, those of one node all or none.

        Raises
        ------
        Refused
            With the node's reason.

        """
        async with self._setting:
            cast = self._find(key)
            asked = {}
            for name, value in values.items():
                if name not in cast.settings:
                    raise Refused(f'{cast.name} has no parameter {shortened(name)}')
                setting = cast.settings[name]
                try:
                    parameter = setting.asked(f'{cast.name}.{name}', value)
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
        cast = self._find(key)
        if cast.lever is None:
            raise Refused(f'{cast.name} has no lever that a servo_inverse node knows')
        if not is_number(angle):
            raise ValueError(f'angle must be a finite number, not {shortened(angle)}')
        answer = await self._asked(cast, [angle])
        reason = answer.message
        if not answer.success:
            angle = await self._nearest(cast, angle)
            answer = await self._asked(cast, [angle])
        if not answer.success:
            raise Refused(reason)
        servo, reduction = answer.servo_angle[0], answer.reduction[0]
        await self.set(key, {'crank.speed': 0.0, 'crank.start': servo})
        return {'value': angle, 'servo': servo, 'reason': reason,
                'reduction': reduction if math.isfinite(reduction) else None}

    def _find(self, key):
        if key not in self._cast:
            raise Refused(f'there is no mechanism {shortened(key)}; '
                          f'there are: {", ".join(self._cast)}')
        return self._cast[key]

    async def _asked(self, cast, angles):
        try:
            return await self._bridge.call(cast.lever, ServoInverse.Request(
                mechanism=cast.name, lever_angle=angles))
        except NoAnswer as error:
            raise Refused(str(error)) from None

    async def _nearest(self, cast, angle):
        """Return the nearest angle that a lever reaches, seen ever closer on a finer scale."""
        low, high, nearest = -math.pi, math.pi, 0.0
        for _ in range(CLOSER_LOOKS):
            away = np.linspace(low, high, SAMPLES)
            reached = away[(await self._asked(cast, (angle + away).tolist())).reachable]
            if not len(reached):
                break
            nearest = float(min(reached, key=abs))
            low, high = nearest, nearest - math.copysign((high - low) / (SAMPLES - 1), nearest)
        return angle + nearest

    def _show(self, visitor):
        visitor.tell(SCENE, {'op': 'scene', 'mechanisms': [
            cast.described() for cast in self._cast.values()]})
        for feed in self.feeds():
            visitor.offer(feed)

    async def _look(self):
        await self._bridge.ask(self._listen)
        while True:
            try:
                await self._look_once()
            except Exception as error:
                # What other nodes say of themselves is anything; the next look may find it well.
                self._seen = None
                self._bridge.warn(f'the scene cannot be read: {error!r}')
            await asyncio.sleep(SECONDS_BETWEEN_LOOKS)

    async def _look_once(self):
        seen = await self._bridge.ask(self._survey)
        if seen != self._seen:
            self._seen = seen
            await self._change(*seen)

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
        for visitor in self.audience:
            self._show(visitor)

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
                name = full[len(prefix):]
                if full.startswith(prefix) and name not in cast.settings:
                    with suppress(ValueError):
                        cast.settings[name] = Setting(name, node, descriptor, value)
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
        def number(i):
            return self._numbers.setdefault((name, i), len(self._numbers))

        # A logger of its own: what is throttled is the warnings of this topic alone.
        logger = self._bridge.node.get_logger().get_child(name.strip('/'))
        feed = Feed(name, key, type_, number, logger)
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
        if setting is None or parameter.value.type != setting.message.type:
            if node in self._nodes:
                self._seen = None
            return
        if node != setting.node:
            return
        setting.message = parameter.value
        for visitor in self.audience:
            visitor.tell((cast.key, name), {'op': 'value', 'mechanism': cast.key,
                                            'name': name, 'value': setting.value})


def _joined(space, name):
    return f'{space.rstrip("/")}/{name}'


def _space(name):
    return name.rsplit('/', 1)[0]
