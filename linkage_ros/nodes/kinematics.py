# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Node that publishes joint angles, markers, loci and robot models of a scene's mechanisms."""

from functools import cached_property, partial
from itertools import combinations
import math
import sys
from threading import Lock
import time
from typing import Any, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from visualization_msgs.msg import Marker, MarkerArray

from . import joint_state_reader, messages, scene_node
from .heard import Topic
from .message_layout import NEVER, pack, unpack, Unreadable, Wire
from .whole_scene import LATCHED, WholeScene
from .. import scene
from ..linkage.quantities import Spot
from ..linkage.walker import Assembly, Layout, Solution
from ..robot_model import bodies, shapes, urdf
from ..words import listed

SECONDS_BETWEEN_WARNINGS = 5.0
# How long inputs that nobody sends are waited for [s], and how many names that are no input's are
# remembered so that each is said once.
PATIENCE = 5.0
STRANGERS = 1000
# How long nothing is prepared for machine code after something was, in times of what that took.
REST = 20
# How long the end may wait for what takes the mechanisms out of the picture [s].
FAREWELL = 0.1


class Kinematics(scene_node.SceneNode):
    """Solves the mechanisms at the inputs on `crank_states`, as far as anyone listens."""

    def __init__(self, **kwargs):
        # A scene that cannot be read ends the node before there is anything to show.
        self._mechanisms, self._models = {}, {}
        self._drawing, self._ended = Lock(), False
        super().__init__(scene.KINEMATICS, **kwargs)
        # Each input that a source tells of, by the source's name.
        self._inputs = {drive.source: [] for machine in self.scene.machines.values()
                        for drive in machine.inputs.values()}
        # What a source sets off, once it is known and until something changes.
        self._ticks, self._tick, self._rested = {}, None, 0.0
        self._stamp = np.zeros(2, np.int64)
        changed, self._own = self._forget_ticks, frozenset()
        self._whole = WholeScene(self, self._inputs, changed)
        self._mechanisms = {name: MechanismPublisher(self, machine, self._whole, changed)
                            for name, machine in self.scene.machines.items()}
        for name, machine in self.scene.machines.items():
            for i, drive in enumerate(machine.inputs.values()):
                self._inputs[drive.source].append((self._mechanisms[name], i))
        self._unheard, self._strangers = set(self._inputs), set()
        self._reader = joint_state_reader.Reader(self._routed)
        self._patience = self.create_timer(
            PATIENCE, self._miss, clock=Clock(clock_type=ClockType.STEADY_TIME), autostart=False)
        self.begin()
        self._later += [*(partial(self._first_picture, shown)
                          for shown in self._mechanisms.values()), self._first_robot]
        try:
            next(iter(self.scene.machines.values())).linkage.accelerated()
        except ImportError as error:
            self.get_logger().info(f'{error}; plain Python moves the legs, to the same places')
        self.create_subscription(
            JointState, 'crank_states', self._turn, joint_state_reader.ANY, raw=True)

    def serves(self):
        """Say which mechanisms it moves."""
        return f'moves {listed(self.scene.machines, 200)} by crank_states'

    def prepare(self, new):
        """Return what shows each mechanism, another for each that has changed; the whole robot."""
        models = {name: self._mechanisms[name].prepared(
            machine, machine.frame_id or new.frame_id, new.frame_prefix)
            for name, machine in new.machines.items()}
        return models, self._robot(models) if self._models else ''

    def _robot(self, models):
        """Return the robot model of the whole scene, if there is one."""
        # Where only named joints are published, they are in a robot model of somebody else's.
        robots = [model.robot for model in models.values() if not model.machine.only_named]
        try:
            return urdf.write(bodies.together(robots)) if robots else ''
        except scene.SceneError as error:
            self.get_logger().info(f'no robot_description of the whole scene: {error}', once=True)
            return ''

    def _first_picture(self, shown):
        """Make what is shown but once of a mechanism; return what publishes it."""
        shown.finish()
        return partial(self._while_drawing, shown.picture)

    def _first_robot(self):
        """Make the robot model of the scene; return what publishes it, if it is that still."""
        models = self._models
        robot = self._robot(models)
        return partial(self._while_drawing, lambda: models is self._models and
                       self._whole.describe(robot))

    def _while_drawing(self, act):
        with self._drawing:
            if not self._ended:
                act()

    def adopt(self, prepared):
        """Show the mechanisms so from now on."""
        models, robot = prepared
        with self._drawing:
            if self._ended:
                return
            self._forget_ticks()
            self._own = frozenset(called.name for model in models.values()
                                  for called in model.machine.joints.values())
            self._models = models
            for name, model in models.items():
                self._mechanisms[name].adopt(model)
            self._whole.describe(robot)
            self._send_whole(self._stamp[:1].tobytes())

    def say_goodbye(self):
        """Take what is drawn out of the picture, for good."""
        with self._drawing:
            self._ended = True
            for shown in self._mechanisms.values():
                shown.clear()
        # What has not arrived when a process ends is lost.
        until = time.monotonic() + FAREWELL
        for shown in self._mechanisms.values():
            shown.let_arrive(until)

    def destroy_node(self):
        """Say goodbye where that is still possible, and end."""
        if self.context.ok() and not self._ended:
            self.say_goodbye()
        super().destroy_node()

    @scene_node.until_the_end
    def _turn(self, text):
        with self._drawing:
            if not self._ended:
                self._draw(text)

    def _draw(self, text):
        if self._tick and self._tick.run(text):
            return
        if self._ticks:
            self._tick = self._ticks.get(self._reader.source(text))
            if self._tick and self._tick.run(text):
                return
        try:
            stamp, routes, positions, speeds = self._reader.read(text)
        except Unreadable as error:
            self.get_logger().warning(
                f'crank_states: {len(text)} bytes that are no joint states are passed over: '
                f'{error}', throttle_duration_sec=SECONDS_BETWEEN_WARNINGS)
            return
        if stamp == NEVER:
            stamp = self._now()
        self._catch_up()
        self._stamp[0] = np.frombuffer(stamp, np.int64)[0]
        for shown, places, known in routes:
            shown.turn(stamp, places, positions, speeds if known else ())
        if routes:
            self._send_whole(stamp)
            self._learn(text, routes)

    def _poses(self, moved):
        """Return models and poses of all mechanisms that are known; None: one lacks legs."""
        known = [(shown, *it) for shown in self._mechanisms.values() if (it := shown.known())]
        return [(model, pose.entire()) if shown in moved or pose.held is None else None
                for shown, model, pose in known]

    def _now(self):
        return pack(self.get_clock().now().to_msg())

    def _send_whole(self, stamp):
        self._whole.send(self._mechanisms.values(), stamp)

    def _send_anew(self, stamp):
        self._catch_up()
        self._send_whole(stamp)

    def _catch_up(self):
        """Let the mechanisms take note of what ticks have done."""
        for tick in self._ticks.values():
            for part in tick.moved:
                part.shown.forget(self._stamp[:1].tobytes())

    def _forget_ticks(self):
        self._catch_up()
        self._ticks, self._tick = {}, None

    def _learn(self, text, routes):
        """Let machine code do what this source sets off from now on, where it can."""
        source, started = self._reader.source(text), time.monotonic()
        # While the listeners of a large scene come one by one, little time goes into each state.
        if source is None or source in self._ticks or started < self._rested:
            return
        moved = [shown.moved(*where) for shown, *where in routes]
        if None not in moved and (made := self._tick_of(source, moved)):
            self._ticks[source] = self._tick = made
            ended = time.monotonic()
            self._rested = ended + REST * (ended - started)

    def _tick_of(self, source, moved):
        poses = self._poses({part.shown for part in moved}) if self._whole.is_heard else []
        # It needs llvmlite, which is there where there is machine code.
        from . import tick

        if None in poses or not tick.is_ready():
            return None
        if len(self._ticks) == tick.TICKS:
            self._forget_ticks()
        whole = tick.Whole(self._whole.wire(poses), [pose.values for _, pose in poses],
                           self._send_anew) if poses else None
        return tick.Tick(source, moved, whole, self._now, self._stamp)

    def _routed(self, message):
        """Return the mechanisms that a message turns, where it says how far, and if how fast."""
        known = len(message.velocity) == len(message.name)
        routes = {}
        for name, place in dict(zip(message.name, range(len(message.position)))).items():
            for shown, i in self._inputs.get(name, ()):
                routes.setdefault(shown, []).append((i, place))
            if name in self._inputs:
                self._hear(name)
        self._meet(message.name)
        return [(shown, places, known) for shown, places in routes.items()]

    def _hear(self, name):
        if len(self._unheard) == len(self._inputs):
            self._patience.reset()
        self._unheard.discard(name)

    def _meet(self, names):
        """Say once which names are no input's."""
        room = STRANGERS - len(self._strangers)
        new = room and [name for name in dict.fromkeys(names) if name not in self._inputs
                        and name not in self._own and hash(name) not in self._strangers][:room]
        if new:
            # Names may be long, and many.
            self._strangers.update(map(hash, new))
            self.get_logger().warning(
                f'crank_states: nothing is called {listed(new, 150)}; the inputs are '
                f'{listed(self._inputs, 150)}'
                f'{"; no more will be named" if len(new) == room else ""}')

    def _miss(self):
        """Say once which inputs nobody sends."""
        self._patience.cancel()
        if self._unheard:
            waiting = [name for name in self._inputs if name in self._unheard]
            self.get_logger().warning(
                f'crank_states: nothing was heard of {listed(waiting, 150)}, without which '
                f'{listed(dict.fromkeys(self._inputs[name][0][0].name for name in waiting), 150)} '
                'cannot move')


class InputState(NamedTuple):
    """What a pose is made from: inputs [rad or m], speeds if known, and who listens."""

    values: Tuple[float, ...]
    speeds: Tuple[float, ...]
    joints: bool
    markers: bool
    whole: bool

    @property
    def wanted(self):
        """Whether joint states, markers and velocities are."""
        return self.joints or self.whole, self.markers, len(self.speeds) > 0


class Pose(NamedTuple):
    """
    What is shown of a mechanism.

    `held` tells which legs can be assembled, None that all can; `moving` whether all velocities
    are known.
    """

    layout: Layout
    values: np.ndarray
    held: Optional[np.ndarray]
    moving: bool

    @property
    def can_be(self) -> bool:
        """Whether any leg can be assembled."""
        return self.held is None or bool(self.held.any())

    def entire(self) -> 'Pose':
        """Return the same as if all legs could be assembled, and all velocities were known."""
        return self._replace(held=None, moving=self.layout.speeds > 0)

    def is_like(self, other: 'Pose') -> bool:
        """Return whether it differs from another in nothing but values."""
        return self.values is other.values and (self.held is None) == (other.held is None)

    def rows(self) -> np.ndarray:
        """Return the rows of the legs that can be assembled."""
        rows = self.layout.rows(self.values)
        return rows if self.held is None else rows[self.held]


class Moved(NamedTuple):
    """
    A mechanism that a source moves.

    Attributes
    ----------
    shown : MechanismPublisher
        What shows it, also where it cannot be assembled.
    places : sequence of (Drive, int, int)
        The inputs that the source tells of, their places, and the places in the message.
    told : float array (2, inputs)
        Where the inputs are kept, and their speeds.
    moving : bool
        Whether the source tells of speeds.
    assembly : Assembly
        Its legs.
    solution : Solution, optional
        What is solved for those who listen; None: nobody does.
    changes : sequence of float arrays, optional
        Factors of the values, what is added, and which come without whole turns.
    wires : list of Wire
        What is sent.

    """

    shown: Any
    places: Sequence[Tuple[scene.Drive, int, int]]
    told: np.ndarray
    moving: bool
    assembly: Assembly
    solution: Optional[Solution]
    changes: Optional[Sequence[np.ndarray]]
    wires: List[Wire]


class Model:
    """
    A mechanism as it is shown: solutions, messages, locus and robot model.

    Raises
    ------
    SceneError
        If that cannot be published.

    """

    def __init__(self, machine: scene.Machine, frame_id: str, prefix: str):
        self.machine, self.made_for = machine, (machine, frame_id, prefix)
        self.drives = list(machine.inputs.values())
        self.robot = bodies.robot([machine], frame_id)
        self.assembly = machine.assembly()
        self._names, self._signs, self._offsets, self._published, self._taken = map(
            np.array, zip(*machine.joints.values()))
        self._is_plain = bool((self._signs > 0.0).all()) and not self._offsets.any()
        drawn = machine.name, prefix + frame_id, machine.pose
        size = bodies.size(machine)
        self._points, shown = _shown(machine)
        self.drawn = *drawn, size, shown, 1 + machine.mirrored
        self.joint_state = messages.JointStates()
        self._solutions, self._changes, self._wires, self.once = {}, {}, {}, None

    @cached_property
    def marker_array(self):
        """The markers' message."""
        return messages.Markers(*self.drawn)

    def finish(self):
        """Return what is shown but once, the robot model and the locus, and keep it till then."""
        if not self.once:
            *drawn, size = self.drawn[:4]
            curve = self.assembly.locus(self.machine.tracer)
            self.once = (urdf.write(self.robot),
                         messages.locus(*drawn, curve, size) if len(curve) > 1 else None)
        return self.once

    def solution(self, joints: bool, markers: bool, moving: bool):
        """Return what solves the legs for those who listen."""
        wanted = joints, markers, moving
        if wanted not in self._solutions:
            names = self.assembly.joints if joints else ()
            self._solutions[wanted] = self.assembly.solution(
                self._points if markers else (), names, names if joints and moving else None)
        return self._solutions[wanted]

    def solve(self, driven: InputState) -> Pose:
        """Solve the legs."""
        solution = self.solution(*driven.wanted)
        solution.solve(driven.values, driven.speeds)
        layout, values = solution.layout, solution.values
        held, moving = None, layout.speeds > 0
        if self.assembly.is_limited:
            held = self.assembly.within_reach(driven.values[0])
        # One sum, of squares, tells whether all values are finite; it is rarely asked which are.
        # It may overflow: unlike `dot`, `vdot` says nothing then.
        if not math.isfinite(np.vdot(values, values)):
            finite = np.isfinite(solution.rows[:, :layout.posed]).all(axis=1)
            finite &= bool(np.isfinite(driven.values).all())
            held = finite if held is None else held & finite
            moving = moving and bool(np.isfinite(solution.rows[held, layout.posed:]).all()
                                     and np.isfinite(driven.speeds).all())
        if held is not None and held.all():
            held = None
        if change := self.change(layout):
            signs, offsets, taken = change
            values *= signs
            values += offsets
            values[taken] -= math.tau * np.round(values[taken] / math.tau)
        return Pose(layout, values, held, moving)

    def change(self, layout: Layout):
        """Return factors of values, what is added, and which lose turns; None: all is as is."""
        if self._is_plain:
            return None
        if layout not in self._changes:
            self._changes[layout] = (
                _arranged(layout, 1.0, self._signs, self._signs),
                _arranged(layout, 0.0, self._offsets, 0.0 * self._offsets),
                np.flatnonzero(_arranged(layout, 0.0, self._taken, 0.0 * self._offsets)))
        return self._changes[layout]

    def wire(self, publisher, build, pose: Pose, logger) -> Wire:
        """Return a publisher of messages of all legs that patches one that is built once."""
        kind = build, pose.moving, pose.layout
        if kind not in self._wires:
            self._wires[kind] = Wire(
                publisher, lambda stamp, values: build(pose._replace(values=values), stamp),
                pose.layout.size, logger)
        return self._wires[kind]

    def is_patched(self, build) -> bool:
        """Return whether a kind of message changes in nothing but what is solved for."""
        return build != self.joint_message or not self.machine.loads

    def joint_message(self, pose: Pose, stamp) -> JointState:
        """Return the joint states of the legs that can be assembled."""
        names, positions, velocities, efforts = self.joints(pose)
        known = self.machine.loads and not np.isnan(efforts).any()
        return self.joint_state.message(stamp, names.tolist(), positions, velocities,
                                        efforts if known else ())

    def joints(self, pose: Pose):
        """
        Return names, positions, velocities and efforts of what is published of a pose.

        There are no velocities where they are not known; what is no input has no effort.
        """
        layout, n, chosen = pose.layout, pose.layout.inputs, self._published
        if pose.held is not None:
            chosen = chosen & np.append([True] * n, pose.held.repeat(layout.joints))
        rows, driven = layout.rows(pose.values), layout.driven(pose.values)
        positions = np.append(driven[:n], rows[:, layout.coordinates:layout.posed])
        velocities = np.append(driven[n:], rows[:, layout.posed:])
        efforts = np.zeros(len(positions))
        if self.machine.loads:
            inputs = (driven[:n] - self._offsets[:n]) * self._signs[:n]
            efforts[:n] = self._signs[:n] * self.machine.efforts(inputs)
        return (self._names[chosen], positions[chosen],
                velocities[chosen] if pose.moving else velocities[:0], efforts[chosen])

    def marker_message(self, pose: Pose, stamp) -> MarkerArray:
        """Return the markers of the legs that can be assembled."""
        places = pose.rows()[:, :pose.layout.coordinates]
        return self.marker_array.message(stamp, places.reshape(len(places), -1, 2))


def _shown(machine: scene.Machine):
    """Return the points of the markers, joints and others, and which of them each marker shows."""
    linkage, wanted = machine.linkage, machine.points
    cranks, plates = shapes.cranks(linkage), shapes.plates(linkage, wanted)
    # A plate is drawn instead of its bars: the message is the smaller for it.
    edges = {frozenset(edge) for plate in plates for edge in combinations(plate, 2)}
    bars = [bar for bar in linkage.bars if bar not in cranks and frozenset(bar) not in edges]
    pieces = {messages.LINKS_ID: [*bars, *linkage.cylinders],
              messages.JOINTS_ID: [(name,) for name in wanted],
              messages.GUIDES_ID: [], messages.BODIES_ID: [], messages.CRANKS_ID: cranks,
              messages.DRIVEN_ID: [], messages.PLATES_ID: plates,
              messages.GROUND_ID: shapes.marks(linkage, wanted)}
    for shape in shapes.drawn(machine, wanted):
        id_ = (messages.GUIDES_ID if shape.kind == shapes.GUIDE else messages.DRIVEN_ID
               if shape.slide.name in machine.inputs else messages.BODIES_ID)
        pieces[id_].append((shape.start, shape.end))
    spots = [point for several in pieces.values() for piece in several for point in piece
             if isinstance(point, Spot)]
    place = {point: i for i, point in enumerate((*wanted, *spots))}
    return (*wanted, *spots), {
        id_: [[place[point] for point in piece] for piece in several if place.keys() >= set(piece)]
        for id_, several in pieces.items()}


def _arranged(layout: Layout, rest: float, joints: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Return numbers for joints, inputs first, for their velocities and for the rest."""
    values, n = np.full(layout.size, rest), layout.inputs
    rows, driven = layout.rows(values), layout.driven(values)
    driven[:n], rows[:, layout.coordinates:layout.posed].flat = np.split(joints, [n])
    if layout.speeds:
        driven[n:], rows[:, layout.posed:].flat = np.split(rates, [n])
    return values


class MechanismPublisher:
    """The topics of one mechanism, and the last that was heard of each of its inputs."""

    def __init__(self, node_, machine: scene.Machine, whole: WholeScene, changed):
        self.name, self._whole, self._changed = machine.name, whole, changed
        name = machine.name
        self._joint_states = Topic(node_, JointState, f'{name}/joint_states', 10, changed)
        self._markers = Topic(node_, MarkerArray, f'{name}/markers', 1, changed)
        self._locus = node_.create_publisher(Marker, f'{name}/locus', LATCHED)
        self._description = node_.create_publisher(String, f'{name}/robot_description', LATCHED)
        # A logger of its own: what is throttled is the warnings of this mechanism alone.
        self._logger = node_.get_logger().get_child(name)
        self._model, self._pose, self._driven = None, None, None
        self._pictured = self._described = None
        self._stamp = NEVER
        # Values and speeds of the inputs, and which of them are known.
        self._told = np.zeros((2, len(machine.inputs)))
        self._known = np.zeros((2, len(machine.inputs)), bool)
        # The markers in the picture, and whether the locus is.
        self._drawn, self._curved = frozenset(), False

    def prepared(self, *wanted) -> Model:
        """Return what shows a mechanism, ready for who listens now; the same where it is."""
        if self._model and self._model.made_for == wanted:
            return self._model
        model = Model(*wanted)
        if self._model:
            model.finish()
        if driven := self._state():
            model.solution(*driven.wanted).finish()
            pose = model.solve(driven)
            for topic, build in self._listening(model, driven):
                if model.is_patched(build):
                    model.wire(topic.publisher, build, pose.entire(), self._logger)
        return model

    def adopt(self, model: Model):
        """Show a mechanism so, where it was last."""
        before, self._model = self._model, model
        if model is before:
            return
        if before:
            self.picture()
            self._delete(self._drawn - model.marker_array.ids)
        self._driven = None
        self.show()

    def finish(self):
        """Make what is shown but once, if it is not shown yet."""
        if self._model is not self._pictured:
            self._model.finish()

    def picture(self):
        """Publish what is shown but once, if it is not yet."""
        model = self._model
        if model is self._pictured:
            return
        description, locus = model.finish()
        self._pictured, model.once = model, None
        if hash(description) != self._described:
            self._described = hash(description)
            self._description.publish(String(data=description))
        if locus:
            self._locus.publish(locus)
        elif self._curved:
            self._locus.publish(messages.deleted(self.name, messages.LOCUS_ID))
        self._curved = bool(locus)

    def clear(self):
        """Take the markers and the locus out of the picture."""
        self._delete(self._drawn)
        if self._curved:
            self._curved = False
            self._locus.publish(messages.deleted(self.name, messages.LOCUS_ID))

    def let_arrive(self, until: float):
        """Wait until a time on the steady clock [s] for the picture's topics to be heard."""
        for publisher in (self._markers.publisher, self._locus):
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, until - time.monotonic())))

    def _delete(self, ids):
        if ids:
            self._drawn -= ids
            self._markers.publish(MarkerArray(
                markers=[messages.deleted(self.name, id_) for id_ in sorted(ids)]))

    def turn(self, stamp: bytes, places: Sequence[Tuple[int, int]], positions: Sequence[float],
             speeds: Sequence[float]):
        """
        Take over what a message says of the inputs, and show them as soon as all are known.

        Parameters
        ----------
        stamp : bytes
            Its time, packed.
        places : sequence of (int, int)
            For each input that it tells of, the input's place and the place in the message.
        positions, speeds : sequence of float
            The message's positions [rad or m] and speeds, or no speeds.

        """
        for i, place in places:
            value, speed = positions[place], speeds[place] if speeds else None
            if not (drive := self._model.drives[i]).is_plain:
                near = float(self._told[0, i]) if self._known[0, i] else None
                value, speed = self._understood(drive, value, speed, near)
            if value is not None:
                self._told[:, i] = value, 0.0 if speed is None else speed
                self._known[:, i] = True, speed is not None
        self._stamp = stamp
        self.show()

    def _understood(self, drive, position, speed, near):
        """Return an input and its speed as its source tells; None if they cannot be."""
        value, speed = self._model.machine.understood(drive, position, speed, near)
        if drive.measures and not math.isfinite(value):
            self._logger.warning(
                f'{drive.measures} cannot be where {drive.source} is {position:.6g}: it is passed '
                'over', throttle_duration_sec=SECONDS_BETWEEN_WARNINGS)
            return None, None
        return value, speed

    def known(self) -> Optional[Tuple[Model, Pose]]:
        """Return how the mechanism is now, for the whole scene; None if that is not known."""
        return (self._model, self._pose) if self._solve() else None

    def moved(self, places, known) -> Optional[Moved]:
        """Return what a source moves; None if not by machine code alone."""
        model, driven = self._model, self._state()
        if model.machine.loads or any(model.drives[i].measures for i, _ in places):
            return None
        solution, wires = driven and model.solution(*driven.wanted), []
        if solution:
            if not solution.batch.code:
                return None
            pose = self._pose.entire()
            wires = [model.wire(topic.publisher, build, pose, self._logger)
                     for topic, build in self._listening(model, driven)]
            if not all(wire.template for wire in wires):
                return None
        return Moved(self, [(model.drives[i], i, place) for i, place in places], self._told,
                     known, model.assembly, solution,
                     solution and model.change(solution.layout), wires)

    def forget(self, stamp: bytes):
        """Solve again before anything is shown: the inputs were moved, at a time, by others."""
        self._driven, self._stamp = None, stamp

    def show(self):
        """Publish what is listened to."""
        driven = self._solve()
        if not driven:
            return
        if self._pose.held is not None:
            self._warn(driven.values, self._pose.held)
        if self._pose.can_be:
            for topic, build in self._listening(self._model, driven):
                self._send(topic.publisher, build, self._stamp)
            if driven.markers:
                self._drawn = self._model.marker_array.ids
        else:
            self._delete(self._drawn)

    def _state(self) -> Optional[InputState]:
        """Return what a pose is made from; None if nobody listens or not all is known."""
        listened = self._joint_states.is_heard, self._markers.is_heard, self._whole.is_heard
        if True not in listened or not self._known[0].all():
            return None
        values, speeds = self._told.tolist()
        return InputState(tuple(values), tuple(speeds) if self._known[1].all() else (), *listened)

    def _solve(self) -> Optional[InputState]:
        """Solve for those who listen; return for what, None if for nobody or nothing is known."""
        driven = self._state()
        if driven and driven != self._driven:
            # What is said again is not solved again.
            before, self._driven = self._pose, driven
            self._pose = self._model.solve(driven)
            if not before or not self._pose.is_like(before):
                self._changed()
        return driven

    def _listening(self, model, driven):
        if driven.joints:
            yield self._joint_states, model.joint_message
        if driven.markers:
            yield self._markers, model.marker_message

    def _warn(self, values, held):
        legs = [f'{self.name}_{prefix}'.rstrip('_')
                for prefix, placed in zip(self._model.assembly.legs, held) if not placed]
        drives = self._model.machine.inputs.values()
        at = ', '.join(f'{drive.input.quantity} {value:.6g} {drive.input.unit}'
                       for drive, value in zip(drives, values))
        reach = ', '.join(f'{scene.in_words(drive.reach)} {drive.input.unit}' for drive in drives)
        self._logger.warning(
            f'{", ".join(legs)} cannot be assembled at {at}; the reach is {reach}',
            throttle_duration_sec=SECONDS_BETWEEN_WARNINGS)

    def _send(self, publisher, build, stamp):
        """Publish all legs by patching one message; where that is not alike, build another."""
        pose = self._pose
        if pose.held is not None or not self._model.is_patched(build):
            publisher.publish(build(pose, unpack(stamp)))
        else:
            self._model.wire(publisher, build, pose, self._logger).send(stamp, pose.values)


def main(args=None):
    """Run the node; return the exit code."""
    return scene_node.run(Kinematics, scene.KINEMATICS, args)


if __name__ == '__main__':
    sys.exit(main())
