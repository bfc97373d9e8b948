# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What follows from a mechanism's parameters: solvers, messages, locus and robot model."""

from __future__ import annotations

from functools import cached_property, partial
from itertools import combinations
import math
from typing import Any, NamedTuple, Sequence

import numpy as np
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from visualization_msgs.msg import MarkerArray

from . import messages
from .message_layout import PatchedMessages
from .. import scene
from ..cache import Cache
from ..linkage import LinkPoint
from ..robot_model import bodies, shapes, urdf
from ..scene.legs import LegSolution

# Cached messages of a mechanism, and of a scene: legs of walkers may leave their reach one by one,
# each with another message.
MAX_MESSAGES = 32


class AssemblyState(NamedTuple):
    """
    Which numbers of a solution are valid, so that they are published.

    A solution of which all are valid is regular: all legs are assembled, all numbers finite.
    """

    solution: LegSolution
    # A byte for each leg, 1 if it is assembled; None if all legs are.
    assembled: bytes | None
    # Whether there are velocities, and efforts, and all of them are finite.
    has_velocities: bool
    has_efforts: bool

    @property
    def any_assembled(self) -> bool:
        """Whether any leg is assembled."""
        return self.assembled is None or 1 in self.assembled

    def legs(self) -> np.ndarray:
        """Return the indices of the assembled legs."""
        count = len(self.solution.rows)
        return np.arange(count) if self.assembled is None else np.flatnonzero(
            np.frombuffer(self.assembled, bool))


class MechanismModel:
    """
    Everything needed to publish a mechanism; immutable except for its caches.

    `frame_id` is the frame of its pose; in markers, this name has the prefix `prefix`. Raises
    SceneError if no robot model can be made of a planar mechanism.

    Attributes
    ----------
    regular : Cache
        The regular state of a solution, by what this contains: joints, markers, velocities (bool).
    patched_messages : Cache
        The messages of a state, by the state and the topics of joint states and of markers; a
        topic is an rclpy publisher, or None if its message is left out.

    """

    def __init__(self, mechanism: scene.SceneMechanism, frame_id: str, prefix: str):
        self.mechanism, self.made_of = mechanism, (mechanism, frame_id, prefix)
        self.inputs = list(mechanism.inputs.values())
        self.robot = None if mechanism.in_space else bodies.robot([mechanism], frame_id)
        self.assembly = mechanism.assembly()
        self._names, self._signs, self._offsets, self._published, self._wrapped = map(
            np.array, zip(*mechanism.joints.values()))
        self._is_plain = bool((self._signs > 0.0).all()) and not self._offsets.any()
        drawn = mechanism.name, prefix + frame_id, mechanism.pose
        self._points, shown = _shown(mechanism)
        self._drawn = *drawn, bodies.size(mechanism), shown
        self.marker_ids = frozenset(id_ for id_, pieces in shown.items() if pieces)
        self._conversions = Cache(self._conversion)
        self.regular = Cache(self._regular)
        self.patched_messages = Cache(self._patched_messages, MAX_MESSAGES)

    @cached_property
    def marker_array(self) -> messages.Markers:
        """Return the builder of its marker messages."""
        return messages.Markers(*self._drawn)

    def latched(self) -> tuple[str, bytes | None]:
        """Return the URDF, '' for a spatial linkage; the serialised locus, None without one."""
        drawn, size = self._drawn[:3], self._drawn[3]
        curve = self.assembly.locus(self.mechanism.tracer)
        return (urdf.write(self.robot) if self.robot else '',
                serialize_message(messages.locus(*drawn, curve, size, self.mechanism.mirrored))
                if len(curve) > 1 else None)

    def _regular(self, parts: tuple[bool, bool, bool]) -> AssemblyState:
        joints, markers, moving = parts
        # With several inputs, only the joint angles show whether the linkage is assembled.
        joints = joints or len(self.inputs) > 1
        names = self.assembly.joints if joints else ()
        solution = self.assembly.solution(
            self._points if markers else (), names, names if joints and moving else None,
            len(self.inputs) if self.mechanism.loads else 0)
        return AssemblyState(solution, None, solution.parts['speeds'].size > 0,
                             solution.parts['efforts'].size > 0)

    def solve(self, regular: AssemblyState, inputs: Sequence[float],
              speeds: Sequence[float | None]) -> AssemblyState:
        """
        Fill the solution of a regular state with published values; return their state.

        `inputs` are positions [rad or m]; the speeds [per second] may be None without velocities.
        """
        solution = regular.solution
        is_finite = solution.solve(inputs, speeds)
        if regular.has_efforts:
            efforts = self.mechanism.efforts(inputs)
            solution.parts['efforts'] = efforts
            is_finite = is_finite and all(map(math.isfinite, efforts))
        if not self._is_plain:
            values, (factors, offsets, wrapped) = (
                solution.values, self._conversions[solution.layout])
            values *= factors
            values += offsets
            values[wrapped] -= math.tau * np.round(values[wrapped] / math.tau)
        within = self.assembly.within_reach(inputs[0]) if self.assembly.is_limited else ()
        return regular if is_finite and all(within) else self._check_assembly(regular, within)

    def _check_assembly(self, regular: AssemblyState, within: Sequence[bool]) -> AssemblyState:
        """Return the state of solved values; `within` are the legs in reach, () if all are."""
        solution, parts = regular.solution, regular.solution.parts
        rows = parts['rows']
        assembled = np.isfinite(np.hstack([rows['coordinates'], rows['angles']])).all(axis=1)
        assembled &= bool(np.isfinite(parts['inputs']).all())
        if within:
            assembled &= within
        rates = np.append(rows['rates'][assembled], parts['speeds'])
        return AssemblyState(
            solution, None if assembled.all() else assembled.tobytes(),
            regular.has_velocities and bool(np.isfinite(rates).all()),
            regular.has_efforts and bool(np.isfinite(parts['efforts']).all()))

    def _conversion(self, layout: np.dtype) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return factors and offsets of published values, and the indices of angles to wrap."""
        places = positions, *_ = self._places(layout)
        factors, offsets = np.ones(layout.itemsize // 8), np.zeros(layout.itemsize // 8)
        for indices in places:
            factors[indices] = self._signs[:len(indices)]
        offsets[positions] = self._offsets[:len(positions)]
        return factors, offsets, positions[self._wrapped[:len(positions)]]

    def _places(self, layout: np.dtype) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the indices of the joints' positions, velocities and efforts in a solution."""
        parts: Any = np.arange(layout.itemsize // 8, dtype=float).view(layout)[0]
        places = (np.append(parts['inputs'], parts['rows']['angles']),
                  np.append(parts['speeds'], parts['rows']['rates']), parts['efforts'])
        positions, velocities, efforts = (part.astype(int) for part in places)
        return positions, velocities, efforts

    def _patched_messages(self, key: tuple[AssemblyState, tuple[Any, Any]]) -> PatchedMessages:
        state, topics = key
        builders = self.joint_message, self.marker_message
        return PatchedMessages(
            [(topic.publish, partial(build, state)) for topic, build in zip(topics, builders)
             if topic], state.solution.values.size)

    def joint_message(self, state: AssemblyState, stamp: Any, values: np.ndarray) -> JointState:
        """Build the joint states of the assembled legs from a solution's values."""
        names, positions, velocities, efforts = self.joints(state, values)
        return messages.joint_states(
            stamp, names.tolist(), positions, velocities if state.has_velocities else (),
            efforts if state.has_efforts else ())

    def joints(self, state: AssemblyState, values: np.ndarray) -> list[np.ndarray]:
        """Return published joints: names, positions, velocities (empty if unsolved), efforts."""
        n, count, legs = len(self.inputs), len(state.solution.rows), state.legs()
        chosen = self._published.copy()
        chosen[n:].reshape(count, -1)[np.isin(np.arange(count), legs, invert=True)] = 0
        positions, velocities, efforts = self._places(state.solution.layout)
        balanced = np.append(values[efforts], np.zeros(len(positions) - len(efforts)))
        return [self._names[chosen], values[positions[chosen]],
                values[velocities[chosen] if velocities.size else velocities], balanced[chosen]]

    def marker_message(self, state: AssemblyState, stamp: Any, values: np.ndarray) -> MarkerArray:
        """Build the markers of the assembled legs from a solution's values."""
        parts: Any = values.view(state.solution.layout)[0]
        legs = state.legs()
        places = parts['rows']['coordinates'][legs].reshape(
            len(legs), -1, len(self.mechanism.linkage.axes))
        # Left and right legs alternate. The first leg of each side draws the ground of that side.
        _, grounded = np.unique(legs % (1 + self.mechanism.mirrored), return_index=True)
        return self.marker_array.message(stamp, places, sorted(grounded))


def _shown(mechanism: scene.SceneMechanism) -> tuple[Sequence, dict[int, list]]:
    """Return the markers' points and, by marker id, the point indices of each line or plate."""
    linkage, names = mechanism.linkage, mechanism.points
    cranks = shapes.cranks(linkage)
    plates, marks, drawn = ([], [], []) if mechanism.in_space else (
        shapes.plates(linkage, names), shapes.marks(linkage, names),
        shapes.drawn(mechanism, names))
    # The edges of a plate are not drawn as bars, too: the message is smaller.
    edges = {frozenset(edge) for plate in plates for edge in combinations(plate, 2)}
    bars = [bar for bar in linkage.bars if bar not in cranks and frozenset(bar) not in edges]
    pieces: dict[int, list] = {
        messages.LINKS_ID: [*bars, *linkage.cylinders],
        messages.JOINTS_ID: [(name,) for name in names],
        messages.GUIDES_ID: [], messages.BODIES_ID: [], messages.CRANKS_ID: cranks,
        messages.DRIVEN_ID: [], messages.PLATES_ID: plates,
        messages.GROUND_ID: marks}
    for shape in drawn:
        id_ = (messages.GUIDES_ID if shape.kind == shapes.GUIDE else messages.DRIVEN_ID
               if shape.slide.name in mechanism.inputs else messages.BODIES_ID)
        pieces[id_].append((shape.start, shape.end))
    points = (*names, *(point for several in pieces.values() for line in several
                        for point in line if isinstance(point, LinkPoint)))
    index = {point: i for i, point in enumerate(points)}
    return points, {
        id_: [[index[point] for point in line] for line in several if index.keys() >= set(line)]
        for id_, several in pieces.items()}
