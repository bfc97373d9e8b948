# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What the kinematics node has to publish after any history, worked out by the library alone.

`Model` is the specification, `history` draws a random one, `Bench` lets a real node live it.

- A message sets the inputs whose source it names, of a name that comes twice the last; a name
  without a position is not said. Bytes that are no joint states are dropped.
- A source says `ratio * position + offset`, of the input or of what it measures. At a measured
  value that cannot be no leg is assembled; the next one continues from the last that could be.
  What a change makes of that counts for the last position that was said, too.
- A speed is known while the last message of its input had a velocity for every name.
- After a message each mechanism that it names is published, once all its inputs are known; then
  the joints of the scene, if any input was named. Nobody gets what he did not subscribe to before.
- A leg is assembled if its input is in reach and all its joints and angles are finite; others are
  left out. This does not depend on who listens. If none is assembled, the mechanism is not in any
  joint states, and its markers are deleted.
- Velocities are published if all speeds are known and all velocities finite, in the scene's joint
  states of all mechanisms; efforts likewise, where there are loads.
- The stamp is that of the last message which named an input of the mechanism, of the scene's
  joints that of the last which named any; of a message without a stamp the time of its arrival.
- A change that the library accepts is accepted, any other refused. What it changes is published
  anew, with the stamp that it had.
"""

from dataclasses import dataclass, field
from itertools import combinations
import math
import threading
import time
from typing import NamedTuple

from linkage_ros import scene
from linkage_ros.linkage import LinkPoint
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.nodes.publishers import LATCHED
from linkage_ros.robot_model import bodies, shapes, urdf
import numpy as np
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import TimeoutException
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message, serialize_message
from ros_harness import DEADLINE
from scenes import example, G1
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from test_reading import big_endian
from visualization_msgs.msg import Marker, MarkerArray

# Of fewer bytes no message is made.
SHORTEST = 8
# The id of the marker of what is on the ground.
GROUND = 8


# --- the specification ---------------------------------------------------------------------


class Leg(NamedTuple):
    """An assembled leg: its prefix, its number, joint angles and velocities."""

    prefix: str
    number: int
    places: list
    angles: list
    rates: list


class Pose(NamedTuple):
    """The assembled legs of a mechanism, and whether all velocities are known and finite."""

    legs: list
    moving: bool


class Solver:
    """A mechanism of a scene, solved by the library's public functions."""

    def __init__(self, mechanism):
        self.mechanism, self.assembly = mechanism, mechanism.assembly()
        linkage, self._joints = mechanism.linkage, self.assembly.joints
        # At an end of the reach rates divide by zero, and then all that comes with them is worked
        # out by arrays, whose last digits differ.
        self._places, self._angles, self._rates = (linkage.function(*names) for names in (
            (linkage.points,), ((), self._joints), ((), (), self._joints)))
        slides = {link.name for link in linkage.links if link.kind == 'prismatic'}
        self._sizes = [mechanism.scale if name in slides else 1.0 for name in self._joints]
        self.shown = _shown(mechanism)
        spots = [spot for pieces in self.shown.values() for piece in pieces for spot in piece
                 if isinstance(spot, LinkPoint)]
        self._spots = tuple(dict.fromkeys(spots))

    def pose(self, values, speeds):
        """Return the pose at inputs and, if they are known, their speeds; None if it is none."""
        within, legs = True, []
        if self.assembly.is_limited:
            within = self.assembly.within_reach(values[0])
        moving = speeds is not None and bool(np.isfinite(speeds).all())
        for number, (prefix, leg) in enumerate(self.assembly.legs.items()):
            places, angles, rates = self._leg(leg, values, speeds if moving else None)
            if (np.isfinite([*values, *angles]).all() and np.isfinite(places).all()
                    and np.broadcast_to(within, len(self.assembly.legs))[number]):
                legs.append(Leg(prefix, number, places, angles, rates))
        moving = moving and all(math.isfinite(rate) for leg in legs for rate in leg.rates)
        return Pose(legs, moving) if legs else None

    def _leg(self, leg, values, speeds):
        inputs = self.mechanism.linkage.inputs
        inputs_ = [leg.start + leg.side * (value - leg.lag) if input_.is_angle
                   else value / leg.size
                   for value, input_ in zip(values, inputs)]
        axes = len(self.mechanism.linkage.axes)
        coordinates = self._places(*inputs_)
        places = [(x * (leg.side * leg.size), *(part * leg.size for part in others))
                  for x, *others in zip(*(coordinates[i::axes] for i in range(axes)))]
        angles = [leg.side * angle * size
                  for angle, size in zip(self._angles(*inputs_), self._sizes)]
        if speeds is None:
            return places, angles, []
        rates = self._rates(*inputs_)
        inputs_ = [speed if input_.is_angle else speed / leg.size
                   for speed, input_ in zip(speeds, inputs)]
        by = [rates[i * len(angles):(i + 1) * len(angles)] for i in range(len(inputs))]
        return places, angles, [
            sum((row[j] * speed for row, speed in zip(by, inputs_)), 0.0) * self._sizes[j]
            for j in range(len(angles))]

    def points(self, pose, values):
        """Return the points of each marker by its id, leg by leg."""
        link_points = self._placed(values)
        points = {}
        for id_, pieces in self.shown.items():
            # Each side's legs stand on one ground.
            legs = {leg.prefix[:1] if id_ == GROUND else leg.number: leg
                    for leg in reversed(pose.legs)}
            points[id_] = [
                link_points[leg.number][point] if isinstance(point, LinkPoint)
                else leg.places[self.mechanism.linkage.points.index(point)]
                for leg in reversed(legs.values()) for piece in pieces for point in piece]
        return points

    def _placed(self, values):
        """Return where the spots are, by leg; no other public function places them."""
        place, at_rest = self.mechanism.linkage.legs(self._spots, (), ()), [0.0] * len(values)
        rows = [place.at(*values, *at_rest, *leg) for leg in self.assembly.legs.values()]
        return [dict(zip(self._spots, zip(row[::2], row[1::2]))) for row in rows]


def _shown(mechanism):
    """Return what each marker shows, by its id: joints, ends of lines or corners."""
    linkage, names = mechanism.linkage, mechanism.points
    if mechanism.in_space:
        arms = [bar for bar in linkage.bars if bar[0].removesuffix('_origin') in mechanism.inputs]
        return {0: [bar for bar in linkage.bars if bar not in arms],
                1: [(name,) for name in names], 5: arms}
    cranks, plates = shapes.cranks(linkage), shapes.plates(linkage, names)
    edges = {frozenset(edge) for plate in plates for edge in combinations(plate, 2)}
    bars = [bar for bar in linkage.bars if bar not in cranks and frozenset(bar) not in edges]
    pieces = {0: [*bars, *linkage.cylinders], 1: [(name,) for name in names], 3: [], 4: [],
              5: cranks, 6: [], 7: plates, 8: shapes.marks(linkage, names)}
    for shape in shapes.drawn(mechanism, names):
        id_ = 3 if shape.kind == shapes.GUIDE else 6 if shape.slide.name in mechanism.inputs else 4
        pieces[id_].append((shape.start, shape.end))
    drawn = {id_: [piece for piece in several if all(
        isinstance(point, LinkPoint) or point in names for point in piece)]
        for id_, several in pieces.items()}
    return {id_: several for id_, several in drawn.items() if several}


@dataclass
class State:
    """What is known of a mechanism: its inputs, which of their speeds, and its last stamp."""

    values: list
    speeds: list
    stamp: tuple = (0, 0)
    # The last input that a measured value gave; the last position and speed of each source.
    seed: float = None
    received: dict = field(default_factory=dict)


class Model:
    """What a node with these parameters has to publish."""

    def __init__(self, parameters):
        self.stamp = (0, 0)
        self._adopt(scene.read(parameters))
        # A default is that of the start.
        self._values = {parameter.name: parameter.value for parameter in self.scene.parameters}
        self.states = {name: State([None] * len(mechanism.inputs), [None] * len(mechanism.inputs))
                       for name, mechanism in self.scene.mechanisms.items()}

    def _adopt(self, new):
        frames = {name: mechanism.frame_id or new.frame_id
                  for name, mechanism in new.mechanisms.items()}
        robots = {name: bodies.robot([mechanism], frames[name])
                  for name, mechanism in new.mechanisms.items() if not mechanism.in_space}
        self.descriptions = {name: urdf.write(robots[name]) if name in robots else ''
                             for name in new.mechanisms}
        robots_ = [robot for name, robot in robots.items() if not new.mechanisms[name].only_named]
        try:
            description = urdf.write(bodies.merged(robots_)) if robots_ else ''
        except scene.SceneError:
            description = ''
        # What is latched stays where a change leaves no robot of one root.
        self.description = description or getattr(self, 'description', '')
        self.scene, self.frames = new, {name: new.frame_prefix + f for name, f in frames.items()}
        self.solvers = {name: Solver(mechanism) for name, mechanism in new.mechanisms.items()}
        for name in new.mechanisms:
            bodies.size(new.mechanisms[name])

    def receive(self, message, now):
        """Receive joint states that came at a time (low, high) [ns]; return what they move."""
        indices = dict(zip(message.name, range(len(message.position))))
        moving = len(message.velocity) == len(message.name)
        stamp = message.header.stamp
        at = (stamp.sec * 10 ** 9 + stamp.nanosec,) * 2 if stamp.sec or stamp.nanosec else now
        moved = []
        for name, mechanism in self.scene.mechanisms.items():
            for i, settings in enumerate(mechanism.inputs.values()):
                if settings.source in indices:
                    index = indices[settings.source]
                    speed = message.velocity[index] if moving else None
                    self._source(self.states[name], mechanism, i, settings,
                                 message.position[index], speed)
                    moved.append(name)
        for name in moved:
            self.states[name].stamp = at
        if moved:
            self.stamp = at
        return set(moved)

    def _source(self, state, mechanism, i, settings, position, speed):
        state.received[i] = position, speed
        value, state.speeds[i] = mechanism.from_source(settings, position, speed, state.seed)
        state.values[i] = value
        if math.isfinite(value):
            state.seed = value

    def change(self, values):
        """Return the reason to refuse a change, '' if it is accepted, and what it changes."""
        declared = {p.name: p.field for p in self.scene.parameters
                    if scene.KINEMATICS in p.field.readers}
        for name in values:
            if name not in declared:
                return 'unknown', set()
            if declared[name].read_only:
                return 'read-only', set()
        values_ = {**self._values, **{name: scene.plain(v) for name, v in values.items()}}
        before = self._signatures()
        try:
            self._adopt(scene.read(values_))
        except scene.SceneError as error:
            return str(error), set()
        self._values = values_
        changed = {name for name, signature in self._signatures().items()
                   if signature != before[name]}
        for name in changed:
            mechanism, state = self.scene.mechanisms[name], self.states[name]
            for i, received in state.received.items():
                self._source(state, mechanism, i, [*mechanism.inputs.values()][i], *received)
        return '', changed

    def _signatures(self):
        return {name: ([(p.name, p.value) for p in mechanism.parameters], self.frames[name])
                for name, mechanism in self.scene.mechanisms.items()}

    def _pose(self, name):
        state = self.states[name]
        if None in state.values:
            return None
        return self.solvers[name].pose(state.values,
                                       None if None in state.speeds else state.speeds)

    def joints(self, stamp, names):
        """
        Return the joint states of mechanisms, None if there are none to be published.

        They are a stamp (low, high) [ns], names, and as many numbers or none.
        """
        poses = {name: pose for name in names if (pose := self._pose(name))}
        rows = [row for name, pose in poses.items() for row in self._rows(name, pose)]
        if not rows:
            return None
        names, positions, velocities, efforts = map(list, zip(*rows))
        moving = all(pose.moving for pose in poses.values())
        loaded = any(self.scene.mechanisms[name].loads for name in poses) and all(
            effort is None or math.isfinite(effort)
            for name, pose in poses.items() for effort in self._efforts(name))
        return stamp, (names, positions, velocities if moving else [], efforts if loaded else [])

    def _efforts(self, name):
        mechanism, state = self.scene.mechanisms[name], self.states[name]
        return mechanism.efforts(state.values) if mechanism.loads else [0.0] * len(state.values)

    def _rows(self, name, pose):
        """Yield name, position, velocity and effort of each joint that is published."""
        mechanism, state = self.scene.mechanisms[name], self.states[name]
        n, names = len(mechanism.inputs), list(mechanism.joints)
        each = [*zip(names[:n], state.values, state.speeds, self._efforts(name))]
        per_leg = len(self.solvers[name].assembly.joints)
        for leg in pose.legs:
            first = n + leg.number * per_leg
            each += zip(names[first:first + per_leg], leg.angles, leg.rates or [0.0] * per_leg,
                        [0.0] * per_leg)
        for joint, position, velocity, effort in each:
            called = mechanism.joints[joint]
            if called.published:
                yield (called.name, float(called.of(position)), called.sign * (velocity or 0.0),
                       called.sign * effort)

    def drawing(self, name):
        """Return a stamp (low, high) [ns], the points of each marker and where they are."""
        pose, state = self._pose(name), self.states[name]
        return pose and (state.stamp, self.solvers[name].points(pose, state.values),
                         self.frames[name], self.scene.mechanisms[name].pose)

    def locus(self, name):
        """Return the points of a mechanism's curve; with its mirror image, the ends of lines."""
        mechanism = self.scene.mechanisms[name]
        curve = mechanism.assembly().locus(mechanism.tracer).tolist()
        if mechanism.mirrored:
            lines = [end for line in zip(curve, curve[1:]) for end in line]
            curve = [*lines, *([-x, y] for x, y in lines)]
        return curve if len(curve) > 1 else []

    def seen(self, before, stamp):
        """Take note of the time [ns] that a node took for that of a message without a stamp."""
        for state in (self, *self.states.values()):
            if state.stamp == before:
                state.stamp = (stamp, stamp)


# --- a real node -----------------------------------------------------------------------------


class NotExecuted(MutuallyExclusiveCallbackGroup):
    """Entities that an executor passes over."""

    def can_execute(self, entity):
        """Return that it cannot."""
        return False


@dataclass
class Listener:
    """A subscription, and the ids of the markers that are in its picture."""

    subscription: object
    kind: type
    drawn: set = field(default_factory=set)
    deleted: set = field(default_factory=set)
    arrived: list = field(default_factory=list)

    def take(self):
        """Gather what has arrived."""
        while True:
            with self.subscription.handle:
                message = self.subscription.handle.take_message(self.kind, False)
            if message is None:
                return
            self.arrived.append(message[0])
            for marker in getattr(message[0], 'markers', ()):
                if marker.action != Marker.DELETE:
                    self.deleted.discard(marker.id)
                else:
                    assert marker.id not in self.deleted
                    self.deleted.add(marker.id)


class Bench:
    """
    A kinematics node that lives histories, compared with the model after every step.

    Parameters
    ----------
    graph : Graph
        Where it lives.
    parameters : dict
        What it is started with.

    """

    def __init__(self, graph, parameters):
        self._graph, self.model = graph, Model(parameters)
        self.node = graph.start(Kinematics, parameters)
        self._executor, self._handled = graph.executor, 0
        self._crank = graph.node.create_publisher(JointState, 'crank_states', 100)
        self.listeners = {}
        self._latched = {topic: self._subscribe(topic, kind, LATCHED) for topic, kind in [
            ('robot_description', String), *((f'{name}/{topic}', kind)
                                             for name in self.model.scene.mechanisms
                                             for topic, kind in [('locus', Marker),
                                                                 ('robot_description', String)])]}
        self._said = dict.fromkeys(self._latched)
        (subscription,) = [s for s in self.node.subscriptions
                           if s.topic_name == self._crank.topic_name]
        callback = subscription.callback

        def counted(message):
            try:
                callback(message)
            finally:
                self._handled += 1

        subscription.callback = counted
        graph.until(self._crank.get_subscription_count)
        self._check_latched()

    def run(self, steps):
        """Live a history; raise AssertionError, with the step, where it is otherwise."""
        for number, (act, *arguments) in enumerate(steps):
            try:
                getattr(self, act)(*arguments)
            except Exception as error:
                # A node that raises ends.
                raise AssertionError(f'{type(error).__name__}: {error}; at step {number}, {act} '
                                     f'{arguments!r:.600}') from error

    def _subscribe(self, topic, kind, qos):
        return Listener(self._graph.node.create_subscription(
            kind, topic, lambda _: None, qos, callback_group=NotExecuted()), kind)

    def _drain(self):
        """Let the nodes work until there is nothing left to do."""
        while True:
            try:
                handler, *_ = self._executor.wait_for_ready_callbacks(timeout_sec=0.0)
            except TimeoutException:
                return
            handler()
            if handler.exception() is not None:
                raise handler.exception()

    def _until(self, predicate):
        """Let the nodes work until something holds."""
        # To look for what is ready costs more than anything that the nodes do.
        if predicate():
            return True
        self._drain()
        deadline = time.monotonic() + DEADLINE
        while not predicate():
            if time.monotonic() > deadline:
                return False
            self._executor.spin_once(timeout_sec=0.005)
        return True

    def listen(self, topic, subscribed):
        """Begin or end to listen to a topic."""
        if (topic in self.listeners) == subscribed:
            return
        if subscribed:
            kind = MarkerArray if topic.endswith('/markers') else JointState
            self.listeners[topic] = self._subscribe(topic, kind, 1000)
        else:
            self._graph.node.destroy_subscription(self.listeners.pop(topic).subscription)
        publisher = next(p for p in self.node.publishers
                         if p.topic_name == self._graph.node.resolve_topic_name(topic))
        assert self._until(lambda: publisher.get_subscription_count() == int(subscribed))
        self._drain()

    def compiled(self):
        """Wait until what is being compiled is there."""
        assert self._until(lambda: not any(thread.name.startswith('linkage_ros compiler')
                                           for thread in threading.enumerate()))
        self._drain()

    def send(self, text):
        """Publish a crank message, or bytes that are none."""
        before, handled = self._now(), self._handled
        self._crank.publish(text)
        assert self._until(lambda: self._handled > handled)
        self._drain()
        try:
            message = deserialize_message(text, JointState) if len(text) >= SHORTEST else None
        except Exception:
            # Each middleware has errors of its own.
            message = None
        moved = self.model.receive(message, (before, self._now())) if message else set()
        self._check(moved, bool(moved))

    def _now(self):
        return self.node.get_clock().now().nanoseconds

    def set(self, values, *listening):
        """Set parameters together; before they act, begin or end to listen to a topic."""
        before = self._contents()
        reason, changed = self.model.change(values)
        result = self._graph.set(
            self.node, (lambda: self.listen(*listening)) if listening else lambda: None,
            **{name: Parameter(name, value=value) for name, value in values.items()})
        assert bool(result.reason) == (not result.successful) == bool(reason), (result, reason)
        # It is accepted at once, and acts when it is prepared.
        assert self._until(lambda: self.node.is_settled)
        self._drain()
        if reason:
            self._check(set(), False)
        else:
            after = self._contents()
            self._check_changed({topic for topic in after if after[topic] != before.get(topic)}
                                & before.keys(), changed)
        self._check_latched()

    def _contents(self):
        return {topic: self._content(topic) for topic in self.listeners}

    def _content(self, topic):
        model, (name, _, kind) = self.model, topic.partition('/')
        if not kind:
            return model.joints(model.stamp, model.scene.mechanisms)
        return model.drawing(name) if kind == 'markers' else model.joints(
            model.states[name].stamp, [name])

    def _check(self, moved, any_moved):
        """Compare what arrived after a message with what has to be there."""
        for topic, listener in self.listeners.items():
            concerned = any_moved if topic == 'joint_states' else topic.partition('/')[0] in moved
            content = self._content(topic) if concerned else None
            self._compare(topic, listener, content, int(content is not None), concerned)

    def _check_changed(self, required, changed):
        """Compare what arrived after a change: what is there, once or more often, if required."""
        for topic, listener in self.listeners.items():
            content = self._content(topic)
            self._compare(topic, listener, content, None if content else 0,
                          topic == 'joint_states' or topic.partition('/')[0] in changed,
                          topic in required)

    def _compare(self, topic, listener, content, count, concerned, required=True):
        drawing = listener.kind is MarkerArray
        goal = {*content[1]} if drawing and content else set()

        def complete():
            listener.take()
            shown = self._shown(topic, listener, content)
            # After a change that moves nothing, a new listener's picture may still be empty.
            is_old = content is not None and not shown
            return (shown >= (count if count is not None else int(required))
                    and (not concerned or not drawing or is_old or listener.drawn == goal))

        met = self._until(complete)
        shown, listener.arrived[:] = self._shown(topic, listener, content), []
        assert met, (f'{topic}: {shown} messages arrived, drawn are {sorted(listener.drawn)}, '
                     f'instead of {content!r:.600}')
        assert count in (None, shown), topic

    def _shown(self, topic, listener, content):
        """Compare each message with what has to be said; return how many there are of those."""
        shown, name = 0, topic.partition('/')[0]
        for message in listener.arrived:
            if listener.kind is JointState:
                if message.name:
                    shown += 1
                    self._same_joints(topic, message, content)
                continue
            added = [m for m in message.markers if m.action == Marker.ADD]
            for marker in message.markers:
                assert marker.ns == name
                if marker.action == Marker.DELETEALL:
                    listener.drawn.clear()
                elif marker.action == Marker.DELETE:
                    listener.drawn.discard(marker.id)
                else:
                    listener.drawn.add(marker.id)
            if added:
                shown += 1
                self._same_drawing(topic, added, content)
        return shown

    def _same_joints(self, topic, message, content):
        published = map(list, (message.name, message.position, message.velocity, message.effort))
        assert content and (*published,) == content[1], topic
        self._same_stamp(topic, message.header.stamp, content[0])

    def _same_stamp(self, topic, stamp, expected):
        at = stamp.sec * 10 ** 9 + stamp.nanosec
        if expected[0] < expected[1] and expected[0] <= at <= expected[1]:
            self.model.seen(expected, at)
        elif not expected[0] <= at <= expected[1]:
            # A time that was seen on another topic of the same message is that of all.
            assert at in (
                self.model.stamp[0], *(s.stamp[0] for s in self.model.states.values())), topic

    def _same_drawing(self, topic, markers, content):
        assert content, f'{topic}: drawn where it cannot be assembled'
        mechanism = self.model.scene.mechanisms[topic.partition('/')[0]]
        axes = mechanism.linkage.axes
        drawn = {marker.id: [tuple(getattr(p, axis) for axis in axes) for p in marker.points]
                 for marker in markers}
        expected = {id_: [tuple(point) for point in points] for id_, points in content[1].items()}
        for id_ in {*drawn} | {*expected}:
            own, other = drawn.get(id_), expected.get(id_)
            if own and other and id_ == GROUND:
                own, other = ({*zip(*[iter(points)] * 3)} for points in (own, other))
            assert own == other, f'{topic}: marker {id_}'
        for marker in markers:
            self._same_look(topic, marker, mechanism)
            self._same_stamp(topic, marker.header.stamp, content[0])

    def _same_look(self, topic, marker, mechanism):
        frame = self.model.frames[mechanism.name]
        assert marker.header.frame_id == frame, topic
        assert mechanism.in_space or not any(p.z for p in marker.points), topic
        # Its type, in which layer it is, and how it is turned, test_kinematics.py tests.
        at, place = marker.pose.position, mechanism.pose[:3]
        assert math.dist((at.x, at.y, at.z), place) <= 0.02 * bodies.size(mechanism) + 1e-9 * max(
            map(abs, place)), topic

    def _check_latched(self):
        """Compare loci and robot models with what has to be there."""
        for topic, listener in self._latched.items():
            def complete(topic=topic, listener=listener):
                listener.take()
                for message in listener.arrived:
                    self._said[topic] = message
                listener.arrived.clear()
                return self._is_latched(topic, self._said[topic])

            assert self._until(complete), f'{topic}: {self._said[topic]!r:.600}'

    def _is_latched(self, topic, message):
        name, _, kind = topic.rpartition('/')
        if kind == 'robot_description':
            text = self.model.descriptions[name] if name else self.model.description
            return (message.data if message else '') == text
        curve = self.model.locus(name)
        if message is None or not curve:
            return bool(message) and message.action == Marker.DELETE
        mirrored = self.model.scene.mechanisms[name].mirrored
        return ([[p.x, p.y] for p in message.points] == curve
                and message.type == (Marker.LINE_LIST if mirrored else Marker.LINE_STRIP)
                and message.header.frame_id == self.model.frames[name])


# --- histories -------------------------------------------------------------------------------

SPECIAL = [math.nan, math.inf, -math.inf, 1e300, -1e300, 0.0, 5e-324, 1e17]


class Generator:
    """Draws histories of a scene."""

    def __init__(self, parameters, random):
        self._random, self._scene = random, scene.read(parameters)
        self._settings = [(mechanism, settings) for mechanism in self._scene.mechanisms.values()
                          for settings in mechanism.inputs.values()]
        self.topics = ['joint_states', *(f'{name}/{kind}' for name in self._scene.mechanisms
                                         for kind in ('joint_states', 'markers'))]
        self._settable = [p for p in self._scene.parameters if scene.KINEMATICS in p.field.readers]

    def history(self, length):
        """Return some steps."""
        sources = [self._arrangement() for _ in range(self._random.integers(1, 4))]
        moving = self._random.random() < 0.7
        steps = [('listen', topic, bool(self._random.random() < 0.6)) for topic in self.topics]
        while len(steps) < length:
            kind = self._random.random()
            if kind < 0.06:
                steps.append(('listen', self._pick(self.topics), self._random.random() < 0.5))
            elif kind < 0.12:
                count = self._pick([1, 1, 1, 2, 2, 5])
                values = dict(self._change() for _ in range(count))
                listening = (self._pick(self.topics), self._random.random() < 0.5)
                steps.append(('set', values, *listening[:2 * self._random.integers(2)]))
            elif kind < 0.15:
                steps.append(('compiled',))
            elif kind < 0.25:
                steps.append(('send', self._odd()))
            elif kind < 0.32:
                steps += self._along_an_end(self._pick(sources), moving)
            else:
                for _ in range(self._random.integers(1, 6)):
                    steps.append(('send', self._message(self._pick(sources), moving)))
        return steps

    def _along_an_end(self, sources, moving):
        """Yield messages of inputs that go in and out of their reach, and then stay outside."""
        by_name = {settings.source: settings for _, settings in sources}
        inside = self._random.integers(1, 12)
        for i in range(inside + 3):
            positions = [
                (settings.reach[0][1] + (2e-3 * self._random.normal() if i < inside else 4e-3)
                 - settings.offset) / settings.ratio for settings in by_name.values()]
            yield 'send', self._text([*by_name], positions, [1.0] * len(by_name) * moving)

    def _pick(self, several):
        return several[self._random.integers(len(several))]

    def _arrangement(self):
        """Return the inputs that a source tells of."""
        share = self._pick([0.0, 0.6, 1.0])
        chosen = [settings for settings in self._settings if self._random.random() < share]
        return chosen or [self._pick(self._settings)]

    def _message(self, sources, moving):
        by_name = {settings.source: (mechanism, settings) for mechanism, settings in sources}
        positions = [self._position(*each) for each in by_name.values()]
        # Now and then the other way round.
        moving ^= self._random.random() < 0.05
        return self._text([*by_name], positions, [self._speed() for _ in by_name if moving])

    def _text(self, names, positions, velocities):
        message = JointState(name=names, position=positions, velocity=velocities)
        random = self._random.random()
        if random > 0.1:
            message.header.stamp.sec = int(self._random.integers(2 ** 31))
            message.header.stamp.nanosec = int(self._random.integers(10 ** 9))
        elif random > 0.08:
            message.header.stamp.sec = -5
            message.header.stamp.nanosec = 2 ** 32 - 1
        return serialize_message(message)

    def _speed(self):
        random = self._random.random()
        if random < 0.06:
            return float(self._pick([*SPECIAL, 1e308]))
        return float(self._random.normal())

    def _position(self, mechanism, settings):
        if self._random.random() < 0.05:
            return float(self._pick(SPECIAL))
        value = self._input(settings)
        if settings.measures:
            value = float(mechanism.to_source(settings, value, 0.0)[0])
            return value if math.isfinite(value) else float(self._random.normal())
        return (value - settings.offset) / settings.ratio

    def _input(self, settings):
        low, high = settings.arcs[self._random.integers(len(settings.arcs))]
        kind = self._random.random()
        if kind < 0.2:
            # Next to an end, where a sensor's noise goes in and out.
            size = self._pick([0.0, 1e-15, 1e-9, 2e-3])
            return float(self._pick([low, high]) + size * self._random.normal())
        if kind < 0.35:
            wide = 0.3 * (high - low)
            return float(self._random.uniform(low - wide, high + wide))
        turns = math.tau * self._random.integers(-2, 3) if settings.input.is_angle else 0.0
        return float(self._random.uniform(low, high) + turns)

    def _odd(self):
        """Return bytes that are another message than usual, or none."""
        names = [self._pick(self._settings)[1].source for _ in range(self._random.integers(1, 4))]
        positions = [self._position(*next((m, d) for m, d in self._settings if d.source == name))
                     for name in names]
        velocities = [self._speed() for _ in names]
        kind = self._random.integers(10)
        if kind == 0:
            names.insert(0, 'wheel')
            positions.insert(0, 7.0)
        elif kind == 1:
            positions = positions[:-1]
        elif kind == 2:
            velocities = velocities[:-1]
        elif kind == 3:
            positions, velocities = [*positions, 1.0], [*velocities, 2.0]
        elif kind == 4:
            names.append('x' * 70000)
        elif kind == 5:
            names, positions = (['nobody'], [1.0]) if self._random.random() < 0.5 else ([], [3.0])
        text = self._text(names, positions, velocities)
        if kind == 6:
            return text[:self._random.integers(1, len(text))]
        if kind == 7:
            message = deserialize_message(text, JointState)
            message.header.stamp.sec = abs(message.header.stamp.sec)
            return big_endian(message)
        if kind == 8:
            return self._pick([b'\0', b'\7\7' + text[2:], self._random.bytes(200)])
        return text

    def _change(self):
        parameter = self._pick(self._settable)
        name, value, kind = parameter.name, parameter.value, parameter.field.kind
        mechanism = self._scene.mechanisms.get(name.partition('.')[0])
        what = name.rpartition('.')[2]
        if self._random.random() < 0.15:
            return name, self._pick([-1.0, 'nonsense', 1e308, 77, ['Zed=1'], [1.0], True, 0])
        if self._random.random() < 0.1:
            return name, list(value) if isinstance(value, tuple) else value
        if what in ('points', 'joint_names', 'loads'):
            return name, self._lines(what, mechanism)
        if what == 'sweep':
            low, high = sorted(map(float, self._random.uniform(*mechanism.first.reach[0], 2)))
            return name, self._pick([[], [low, high]])
        if what == 'pose':
            return name, self._random.normal(size=6).tolist()
        if 'frame' in what:
            return name, self._pick(['world', 'base', 'left/', ''])
        if kind == 'bool':
            return name, bool(self._random.integers(2))
        if kind == 'integer':
            return name, int(self._random.integers(-1, 4))
        if what in ('ratio', 'offset'):
            return name, float(self._random.normal())
        if kind == 'double':
            return name, float(value * self._random.uniform(0.8, 1.25))
        return name, value

    def _lines(self, what, mechanism):
        linkage = mechanism.linkage
        if what == 'points':
            chosen = [name for name in linkage.points if self._random.random() < 0.6]
            self._random.shuffle(chosen)
            return chosen or list(linkage.points)
        if what == 'joint_names':
            sign, offset = self._pick(['', '-']), self._pick(['', '+0.35', '-7.5'])
            return [f'{joint}={sign}{mechanism.name}_my_{joint}{offset}'
                    for joint in mechanism.joints if self._random.random() < 0.4]
        return [*(f'{name}={self._random.normal():.4f} -9.81' for name in linkage.points
                  if self._random.random() < 0.3),
                *(f'{name}=2.5' for name in linkage.joints if self._random.random() < 0.1)]


def everything(parameters):
    """Return the steps after which every topic of a scene is listened to."""
    return [('listen', topic, True) for topic in Generator(parameters, None).topics]


def message(positions, velocities=(), sec=1):
    """Return the step that sends values by the names of their sources."""
    sent = JointState(name=list(positions), position=list(positions.values()), velocity=velocities)
    sent.header.stamp.sec = sec
    return 'send', serialize_message(sent)


def history(parameters, seed, length):
    """Return a random history of a scene: steps as `Bench.run` takes them."""
    return Generator(parameters, np.random.default_rng(seed)).history(length)


FOUR_BAR = ['O ground 0 0', 'Q ground 2 0', 'A crank O 1', 'B dyad A Q 2 1.5 left']
SCENES = {
    'the catalogue': {},
    'a walker': {'mechanisms': ['m'], 'm.type': 'jansen', 'm.leg_pairs': 3, 'm.scale': 0.01},
    'legs that are left out now and then': {
        'mechanisms': ['m'], 'm.type': 'custom', 'm.joints': FOUR_BAR, 'm.leg_pairs': 2},
    'a reach that ends': {
        'mechanisms': ['cell', 'leg'], 'cell.type': 'peaucellier', 'leg.type': 'klann',
        'leg.mirrored': True, 'leg.scale': 1e-3},
    'loads beside others': {
        'mechanisms': ['lever', 'leg'], 'lever.type': 'slotted_lever',
        'lever.loads': ['L=0 -9.81'], 'leg.type': 'jansen'},
    'a cylinder with loads': {
        'mechanisms': ['m', 'n'], 'm.type': 'custom', 'm.scale': 2.0, 'm.joints': [
            'O ground 0 0', 'Q ground 3 0', 'A cylinder O Q 1.5 left'], 'm.loads': ['A=1 -2'],
        'n.type': 'slider_crank', 'n.loads': ['AB=2']},
    'several inputs': {
        'mechanisms': ['five_bar', 'm'], 'm.type': 'five_bar', 'm.scale': 2.0,
        'm.loads': ['C=0 -1'], 'm.crank.source': 'motor', 'five_bar.crank2.source': 'motor'},
    'an excavator': example('excavator'),
    'sensors': {
        'mechanisms': ['lever', 'bars'], 'lever.type': 'slotted_lever',
        'lever.crank.measures': 'lever', 'lever.crank.ratio': 0.5, 'lever.crank.offset': 0.05,
        'bars.type': 'four_bar', 'bars.crank.measures': 'QB', 'bars.crank.ratio': -1.0,
        'bars.scale': 3.0},
    'geared motors, names and signs': {
        'mechanisms': ['m', 'klann', 'gears'], 'm.type': 'jansen', 'm.crank.ratio': -2.5,
        'm.crank.offset': 0.125, 'klann.type': 'klann', 'klann.crank.ratio': 0.3,
        'm.joint_names': ['BC=left_shin', 'EF=-left_ankle+0.35', 'crank=-shaft-7.5'],
        'klann.only_named': True, 'klann.joint_names': ['crank=hip'], 'gears.type': 'custom',
        'gears.joints': ['O ground 0 0', 'Q ground 4 0', 'A crank O 1',
                         'D crank Q 2 geared crank -2 0.1', 'B dyad A D 3 4 left']},
    'one source for two': {
        'mechanisms': ['a', 'b'], 'a.type': 'water_drop', 'a.crank.source': 'shaft',
        'b.type': 'four_bar', 'b.crank.source': 'shaft', 'b.crank.ratio': 2.0,
        'b.points': ['O', 'Q'], 'b.loads': ['B=0 -1']},
    'one foot of ten': {
        'mechanisms': ['m'], 'm.type': 'jansen', 'm.leg_pairs': 5,
        'm.points': ['G'], 'm.joint_names': ['left3_EF=ankle'], 'm.only_named': True},
    'rods in space': {
        'mechanisms': ['ankle'], 'ankle.type': 'rods',
        'ankle.joints': list(G1), 'ankle.right.sweep': [-0.25, 0.25],
        'ankle.left.sweep': [-0.2, 0.2],
        'ankle.joint_names': ['pitch=left_ankle_pitch', 'roll=-left_ankle_roll+0.1'],
        'ankle.loads': ['pitch=12.0', 'roll=-3.0']},
    'tiny and huge': {
        'mechanisms': ['m', 'n'], 'm.type': 'jansen', 'm.scale': 1e-30, 'n.type': 'peaucellier',
        'n.scale': 1e27}}
