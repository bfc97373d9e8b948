# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A mechanism as it is shown: what is solved for whom, and the messages made of it."""

from functools import cached_property
from itertools import combinations
import math
from typing import NamedTuple, Optional, Tuple

import numpy as np
from sensor_msgs.msg import JointState
from visualization_msgs.msg import MarkerArray

from . import messages
from .message_layout import Wire
from .. import scene
from ..linkage.quantities import Spot
from ..linkage.walker import Layout
from ..robot_model import bodies, shapes, urdf


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

    @property
    def is_entire(self) -> bool:
        """Whether all legs can be assembled, and all velocities are known that are wanted."""
        return self.held is None and self.moving == (self.layout.speeds > 0)

    def is_like(self, other: 'Pose') -> bool:
        """Return whether it differs from another in nothing but values."""
        return self.values is other.values and self.is_entire == other.is_entire

    def rows(self) -> np.ndarray:
        """Return the rows of the legs that can be assembled."""
        rows = self.layout.rows(self.values)
        return rows if self.held is None else rows[self.held]


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
