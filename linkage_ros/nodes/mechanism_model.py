# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The solvers, messages, locus and robot model of a mechanism."""

from __future__ import annotations

from functools import cached_property
from itertools import combinations
import math
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from sensor_msgs.msg import JointState
from visualization_msgs.msg import MarkerArray

from . import messages
from .publishers import PatchedPublisher
from .. import scene
from ..cache import Cache
from ..linkage.mechanism import Mechanism
from ..linkage.quantities import LinkPoint
from ..linkage.walker import Layout, Solution
from ..robot_model import bodies, shapes, urdf

# Cached arrangements of messages: the legs of a walker may leave their reach one by one.
ARRANGEMENTS = 128


class Pose(NamedTuple):
    """Validity of a solution's numbers, which selects its messages."""

    solution: Solution
    # A byte for each leg; None if all are assembled.
    assembled: Optional[bytes]
    # Whether all velocities are finite, and all efforts.
    moving: bool
    loaded: bool

    @property
    def exists(self) -> bool:
        """Whether any leg is assembled."""
        return self.assembled is None or 1 in self.assembled

    def legs(self) -> np.ndarray:
        """Return the indices of the assembled legs."""
        count = self.solution.layout.legs
        return np.arange(count) if self.assembled is None else np.flatnonzero(
            np.frombuffer(self.assembled, bool))


class MechanismModel:
    """
    Everything needed to publish a mechanism; immutable but for its caches.

    `frame_id` is the frame of its pose; `prefix` precedes it in markers. Raises SceneError if the
    mechanism has no robot model.
    """

    def __init__(self, machine: scene.SceneMechanism, frame_id: str, prefix: str):
        self.machine, self.made_of = machine, (machine, frame_id, prefix)
        self.inputs = list(machine.inputs.values())
        self.robot = None if machine.in_space else bodies.robot([machine], frame_id)
        self.assembly = machine.assembly()
        self._names, self._signs, self._offsets, self._published, self._wrapped = map(
            np.array, zip(*machine.joints.values()))
        self._is_plain = bool((self._signs > 0.0).all()) and not self._offsets.any()
        drawn = machine.name, prefix + frame_id, machine.pose
        self._points, shown = _shown(machine)
        self._drawn = *drawn, bodies.size(machine), shown
        self._solutions, self._conversions = Cache(), Cache(self._conversion)
        self._publishers = Cache(size=ARRANGEMENTS)

    @cached_property
    def marker_array(self) -> messages.Markers:
        """The builder of marker messages."""
        return messages.Markers(*self._drawn)

    def latched(self) -> Tuple[str, Optional[Any]]:
        """Return the latched messages: the robot model and, if any, the locus."""
        drawn, size = self._drawn[:3], self._drawn[3]
        curve = self.assembly.locus(self.machine.tracer)
        return (urdf.write(self.robot) if self.robot else '',
                messages.locus(*drawn, curve, size) if len(curve) > 1 else None)

    def solution(self, joints: bool, markers: bool, moving: bool) -> Solution:
        """Return the solver of all legs for the subscribed topics."""
        # The reach of several inputs shows only in the solved angles.
        joints = joints or len(self.inputs) > 1
        names = self.assembly.joints if joints else ()
        return self._solutions.get_or_make((joints, markers, moving), lambda: (
            self.assembly.solution(
                self._points if markers else (), names, names if joints and moving else None,
                len(self.inputs) if self.machine.loads else 0)))

    def regular(self, solution: Solution) -> Pose:
        """Return the pose of a solution whose numbers are finite and within reach."""
        return Pose(solution, None, solution.layout.speeds > 0, solution.layout.efforts > 0)

    def pose(self, solution: Solution, inputs: np.ndarray) -> Pose:
        """Assess a solution at inputs and speeds of shape (2, inputs)."""
        layout, values, pose = solution.layout, solution.values, self.regular(solution)
        assembled = None
        if self.assembly.is_limited:
            assembled = self.assembly.within_reach(inputs[0, 0])
        # One sum of squares tests whether all are finite; `vdot` overflows without the warning of
        # `dot`.
        if not math.isfinite(np.vdot(values, values)):
            finite = np.isfinite(solution.rows[:, :layout.posed]).all(axis=1)
            finite &= bool(np.isfinite(inputs[0]).all())
            assembled = finite if assembled is None else assembled & finite
            rates = solution.rows[assembled, layout.posed:]
            pose = pose._replace(
                moving=pose.moving and bool(np.isfinite(rates).all()
                                            and np.isfinite(inputs[1]).all()),
                loaded=pose.loaded and bool(np.isfinite(layout.effort(values)).all()))
        if assembled is None or assembled.all():
            return pose
        return pose._replace(assembled=assembled.tobytes())

    def conversion(self, layout: Layout) -> Optional[Tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Return factors, offsets and wrapped joints of the robot's joints; None if trivial."""
        return None if self._is_plain else self._conversions[layout]

    def _conversion(self, layout: Layout) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        none = np.zeros(len(self._signs))
        return (_arranged(layout, 1.0, self._signs, self._signs),
                _arranged(layout, 0.0, self._offsets, none),
                np.flatnonzero(_arranged(layout, 0.0, self._wrapped, none)))

    def publisher(self, publisher: Any, build: Callable, pose: Pose, logger: Any
                  ) -> PatchedPublisher:
        """Return the publisher of the message that `build` makes from a pose's values."""
        return self._publishers.get_or_make((publisher, pose), lambda: PatchedPublisher(
            publisher, lambda stamp, values: build(pose, values, stamp),
            pose.solution.layout.size, logger))

    def joint_message(self, pose: Pose, values: np.ndarray, stamp: Any) -> JointState:
        """Build the joint states of the assembled legs."""
        names, positions, velocities, efforts = self.joints(pose, values)
        return messages.joint_states(
            stamp, names.tolist(), positions, velocities if pose.moving else (),
            efforts if pose.loaded else ())

    def joints(self, pose: Pose, values: np.ndarray) -> List[np.ndarray]:
        """Return names, positions and, if solved, velocities and efforts of published joints."""
        layout, n, legs = pose.solution.layout, len(self.inputs), pose.legs()
        chosen = self._published.copy()
        chosen[n:].reshape(layout.legs, -1)[np.isin(np.arange(layout.legs), legs, invert=True)] = 0
        rows, driven = layout.rows(values), layout.driven(values)
        positions = np.append(driven[:n], rows[:, layout.coordinates:layout.posed])
        velocities = np.append(driven[n:], rows[:, layout.posed:])
        efforts = np.append(layout.effort(values), np.zeros(len(positions) - layout.efforts))
        return [self._names[chosen], positions[chosen],
                velocities[chosen] if layout.speeds else velocities[:0], efforts[chosen]]

    def marker_message(self, pose: Pose, values: np.ndarray, stamp: Any) -> MarkerArray:
        """Build the markers of the assembled legs."""
        layout, legs = pose.solution.layout, pose.legs()
        places = layout.rows(values)[legs, :layout.coordinates].reshape(
            len(legs), -1, len(self.machine.linkage.axes))
        # Left and right legs alternate; each side has its own ground.
        _, grounded = np.unique(legs % (1 + self.machine.mirrored), return_index=True)
        return self.marker_array.message(stamp, places, sorted(grounded))


def _shown(machine: scene.SceneMechanism) -> Tuple[Sequence, Dict[int, list]]:
    """Return the points of the markers, and the indices of each marker's points."""
    linkage, wanted = machine.linkage, machine.points
    if machine.in_space:
        return _in_space(linkage, wanted)
    cranks, plates = shapes.cranks(linkage), shapes.plates(linkage, wanted)
    # A plate replaces its bars, which makes the message smaller.
    edges = {frozenset(edge) for plate in plates for edge in combinations(plate, 2)}
    bars = [bar for bar in linkage.bars if bar not in cranks and frozenset(bar) not in edges]
    pieces: Dict[int, list] = {
        messages.LINKS_ID: [*bars, *linkage.cylinders],
        messages.JOINTS_ID: [(name,) for name in wanted],
        messages.GUIDES_ID: [], messages.BODIES_ID: [], messages.CRANKS_ID: cranks,
        messages.DRIVEN_ID: [], messages.PLATES_ID: plates,
        messages.GROUND_ID: shapes.marks(linkage, wanted)}
    for shape in shapes.drawn(machine, wanted):
        id_ = (messages.GUIDES_ID if shape.kind == shapes.GUIDE else messages.DRIVEN_ID
               if shape.slide.name in machine.inputs else messages.BODIES_ID)
        pieces[id_].append((shape.start, shape.end))
    spots = [point for several in pieces.values() for piece in several for point in piece
             if isinstance(point, LinkPoint)]
    place = {point: i for i, point in enumerate((*wanted, *spots))}
    return (*wanted, *spots), {
        id_: [[place[point] for point in piece] for piece in several if place.keys() >= set(piece)]
        for id_, several in pieces.items()}


def _in_space(linkage: Mechanism, wanted: Sequence[str]) -> Tuple[Sequence, Dict[int, list]]:
    """Return the same as `_shown` for a linkage of rods, drawn as lines."""
    place = {point: i for i, point in enumerate(wanted)}
    return wanted, {messages.LINKS_ID: [
        [place[end] for end in line] for line in (*linkage.bars, *linkage.cylinders)
        if place.keys() >= {*line}], messages.JOINTS_ID: [[i] for i in place.values()]}


def _arranged(layout: Layout, rest: float, joints: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Arrange values: joints with inputs first, then velocities, efforts and the rest."""
    values, n = np.full(layout.size, rest), layout.inputs
    rows, driven = layout.rows(values), layout.driven(values)
    driven[:n] = joints[:n]
    if layout.joints:
        rows[:, layout.coordinates:layout.posed] = joints[n:].reshape(layout.legs, -1)
    layout.effort(values)[:] = rates[:layout.efforts]
    if layout.speeds:
        driven[n:] = rates[:n]
    if layout.velocities:
        rows[:, layout.posed:] = rates[n:].reshape(layout.legs, -1)
    return values
