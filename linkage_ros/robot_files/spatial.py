# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Loops of a robot closed in space, by Newton's method: many poses at a time.

Nothing here knows of planes or dyads. A pose is a displacement of each body from where the file
has it: a product of screws along a tree of joints; joints that are not in the tree are equations
(R. Murray, Z. Li, S. Sastry: A Mathematical Introduction to Robotic Manipulation, 1994, ch. 3).
"""

from __future__ import annotations

import math
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Sequence, Set, Tuple

import numpy as np

from ..command import RequestError
from ..robot_model.places import displacements, screws
from ..robot_model.robot import BALL, FIXED, FREE, HINGE, Joint, Robot, SLIDE, trees

# The largest step of an iteration [rad, or of the size].
STRIDE = 0.5
# The last step [rad, or of the size]: steps square, so that the next would be rounding.
STILL = 1e-8
# The most bodies of one component.
MOST = 150
# Hinges nearer to each other [m] cross in a point.
TOGETHER = 1e-6
# Loops open by less, of their size, are closed.
CLOSED = 1e-10
# Loops open by more, of their size, are so in the file or by a mistake, not by rounding.
EXACT = 1e-9
# Loops that are less stiff, of their size, are at a dead point.
DEAD = 1e-6


class Element(NamedTuple):
    """A joint: rotation about an axis, motion along it, or the three rotations of a ball."""

    joint: Joint
    kind: str
    place: np.ndarray
    axis: np.ndarray
    parent: int
    body: str


class Poses(NamedTuple):
    """Positions of the elements [rad or m], a row a pose, and the displacement by each."""

    positions: np.ndarray
    moved: np.ndarray

    def some(self, which: Any) -> 'Poses':
        """Return some of the poses."""
        return Poses(self.positions[which], self.moved[which])


def blocks(found: Mapping[str, Tuple[str, Joint]], cuts: Sequence[Joint]
           ) -> List[Tuple[Set[str], List[Joint]]]:
    """Return bodies and cuts of the loops of a tree; loops that share joints are together."""
    lots: List[Tuple[Set[str], List[Joint]]] = []
    for cut in cuts:
        ways: List[Set[str]] = []
        for body in cut.bodies:
            ways.append(set())
            while body in found:
                ways[-1].add(body)
                body = found[body][0]
        cycle = ways[0] ^ ways[1]
        shared = [lot for lot in lots if lot[0] & cycle]
        lots = [lot for lot in lots if lot not in shared]
        lots.append((cycle.union(*(lot[0] for lot in shared)),
                     [each for lot in shared for each in lot[1]] + [cut]))
    return lots


def components(robot: Robot) -> Iterator['Component']:
    """Yield the loops of a robot; those that share joints are one component."""
    found, cuts = trees(robot)
    for bodies, own in blocks(found, cuts):
        if len(bodies) > MOST:
            raise RequestError(f'{len(bodies)} bodies are in loops that share joints: no more '
                               f'than {MOST} are closed at once')
        yield Component(robot, found, bodies, own)


class Component:
    """
    Loops that share joints, and poses of them.

    Attributes
    ----------
    joints : list of Joint
        All joints of the loops.
    size : float
        The greatest distance of two joints in the file's pose [m].

    """

    def __init__(self, robot: Robot, found: Dict[str, Tuple[str, Joint]], bodies: Set[str],
                 cuts: Sequence[Joint]):
        self._elements: List[Element] = []
        self._cuts = cuts
        # The last element that moves each body.
        self._on: Dict[str, int] = {}
        for body in found:
            if body in bodies:
                self._add(found, body)
        own = {found[body][1] for body in bodies} | {*cuts}
        self.joints = [joint for joint in robot.joints if joint in own]
        places = np.array([place for joint in self.joints for place in joint.places])
        self.size = float(np.max(np.linalg.norm(places - places[0], axis=1))) or 1.0
        self._above = np.zeros((len(self._elements) + 1, len(self._elements)), bool)
        for i, each in enumerate(self._elements):
            self._above[i] = self._above[each.parent]
            self._above[i, i] = True
        joints = [each.joint for each in self._elements]
        self._names = [joint.name for joint in joints]
        self._named = np.array([joint.position is not None for joint in joints], bool)
        self._starts = np.array([joint.start for joint in joints])
        self._is_ball, self._slides = (np.array(
            [each.kind == kind for each in self._elements], bool) for kind in (BALL, SLIDE))
        counts = np.where(self._is_ball, 3, 1)
        self._column = np.repeat(np.arange(len(counts)), counts)
        self._first = np.cumsum([0, *counts])[:-1]
        self._balls = self._first[self._is_ball, None] + np.arange(3)
        self._are_balls = np.array([each.kind == BALL or any(
            np.linalg.norm(each.place - other.place) < TOGETHER
            and np.linalg.norm(np.cross(each.axis, other.axis)) > 0.1
            for other in self._elements if HINGE == each.kind == other.kind)
            for each in self._elements], bool)
        self._places = np.array([each.place for each in self._elements]).reshape(-1, 3)
        axes = np.array([self._elements[i].axis for i in self._column]).reshape(-1, 3)
        axes[self._balls] = np.eye(3)
        slides = self._slides[self._column]
        self._screws = screws(axes, self._places[self._column], slides)
        self._parents = np.array([self._elements[i].parent for i in self._column], int)
        self.unit = np.where(slides, self.size, 1.0)
        self._cut_ends = [[self._last(found, body) for body in cut.bodies] for cut in self._cuts]
        self._equations()

    def _last(self, found: Dict[str, Tuple[str, Joint]], body: str) -> int:
        """Return the last element that moves a body."""
        while body in found and body not in self._on:
            body = found[body][0]
        return self._on.get(body, -1)

    def _add(self, found: Dict[str, Tuple[str, Joint]], body: str) -> None:
        """Add the elements that move a body; those of its base are there."""
        base, joint = found[body]
        parent, place, axis = self._last(found, base), joint.place(base), joint.motion(body)
        parts = {kind: [(kind, axis)] for kind in (HINGE, SLIDE, BALL)}
        parts[FREE] = [*((SLIDE, each) for each in np.eye(3)), (BALL, axis)]
        for kind, way in parts.get(joint.kind, ()):
            self._elements.append(Element(joint, kind, place, way, parent, body))
            parent = len(self._elements) - 1
        self._on[body] = parent

    def _equations(self) -> None:
        """Set the points that coincide on both ends of each cut."""
        ends, points = [], []
        for end, cut in zip(self._cut_ends, self._cuts):
            ways = [np.zeros((2, 3))]
            if cut.kind == HINGE:
                one, other = cut.axes
                ways.append(np.array([one, other if one @ other > 0.0 else -other]))
            if cut.kind == FIXED:
                ways += [np.array([turn[:, k] for turn in cut.turns]) for k in range(3)]
            points += [np.array(cut.places) + self.size * way for way in ways]
            ends += [end] * len(ways)
        self._ends = np.array(ends, int).reshape(-1, 2)
        self._points = np.concatenate([points, np.ones((len(ends), 2, 1))], axis=2)
        above = self._above[self._ends][..., self._column]
        self._signed = above * np.array([[1.0], [-1.0]])

    @property
    def positions(self) -> Dict[str, float]:
        """Positions in the file of named joints with one degree of freedom."""
        return {joint.name: joint.position for joint in self.joints
                if joint.position is not None}

    @property
    def cut_names(self) -> Set[str]:
        """Names of the hinges that close its loops, whose angles `read` returns."""
        return {cut.name for cut in self._cuts if cut.position is not None and cut.kind == HINGE}

    @property
    def names(self) -> Set[str]:
        """Names of the joints whose positions `read` returns."""
        return self.cut_names | {self._names[i] for i in np.flatnonzero(self._named)}

    def at_start(self, count: int = 1) -> Poses:
        """Return the pose of the file, `count` times."""
        return Poses(np.zeros((count, len(self._elements))),
                     np.tile(np.eye(4), (count, len(self._elements), 1, 1)))

    def columns_of(self, names: Sequence[str]) -> np.ndarray:
        """Return which columns are of the joints that are named."""
        return np.array([self._names[i] in names for i in self._column], bool)

    def most_moved(self, ways: np.ndarray) -> List[str]:
        """Return the joint with a name that moves the most in some directions."""
        sizes = np.linalg.norm(ways, axis=0) * self._named[self._column]
        return [self._names[self._column[int(np.argmax(sizes))]]]

    def towards_limits(self, names: Sequence[str], part: float) -> np.ndarray:
        """Return a step of joints by some part [rad, or of the size], within their limits."""
        step = np.zeros(len(self._column))
        for i in map(self._names.index, names):
            low, high = self._elements[i].joint.range
            column, start = self._first[i], self._starts[i]
            change = part * self.unit[column]
            if not low <= start + change <= high:
                change = abs(change) if start < low else -abs(change) if start > high else -change
            step[column] = change
        return step

    def aimed(self, poses: Poses, step: np.ndarray, positions: Mapping[str, np.ndarray]
              ) -> np.ndarray:
        """Return a step of poses that leads some joints to positions."""
        step = step.copy()
        for name, values in positions.items():
            i = self._names.index(name)
            step[:, self._first[i]] = values - self._starts[i] - poses.positions[:, i]
        return step

    def step_between(self, one: Poses, other: Poses) -> np.ndarray:
        """Return the difference of two poses in each column; balls have none."""
        return (other.positions - one.positions)[:, self._column]

    def stiffness(self, poses: Poses, fixed: np.ndarray) -> np.ndarray:
        """Return the product of singular values of the loops in each pose: 0 at a dead point."""
        slope = self.errors(poses, True)[1][:, :, ~fixed] / self.size
        count = np.sum(~fixed) - self.nullity(fixed)
        return np.prod(np.linalg.svd(slope, compute_uv=False)[:, :count], axis=1)

    def nullity(self, fixed: np.ndarray) -> int:
        """Return the degrees of freedom that the loops leave, in a random open pose."""
        step = np.random.default_rng(2).uniform(-0.3, 0.3, (1, len(fixed)))
        return len(self.free_ways(self.stepped(self.at_start(), step * self.unit), fixed))

    def _frames(self, poses: Poses) -> np.ndarray:
        """Return the displacement after each element; the last is that of the root."""
        frames = np.empty((len(poses.positions), len(self._elements) + 1, 4, 4))
        frames[:, -1] = np.eye(4)
        for i, each in enumerate(self._elements):
            np.matmul(frames[:, each.parent], poses.moved[:, i], out=frames[:, i])
        return frames

    def stepped(self, poses: Poses, step: np.ndarray) -> Poses:
        """Return poses with a step of the columns [rad or m] more."""
        positions = poses.positions + np.where(self._is_ball, 0.0, step[:, self._first])
        moved = displacements(self._screws[self._first], positions, self._slides)
        if len(self._balls):
            turn = step[:, self._balls]
            angle = np.linalg.norm(turn, axis=-1)
            axes = turn / np.where(angle, angle, 1.0)[..., None]
            moved[:, self._is_ball] = displacements(
                screws(axes, self._places[self._is_ball]), angle) @ poses.moved[:, self._is_ball]
        return Poses(positions, moved)

    def errors(self, poses: Poses, slopes: bool = False) -> Tuple[np.ndarray, np.ndarray]:
        """Return the residuals of the loops in each pose [m], and their derivatives by columns."""
        frames = self._frames(poses)
        seen = (frames[:, self._ends] @ self._points[..., None])[..., 0]
        error = (seen[:, :, 0] - seen[:, :, 1])[..., :3].reshape(len(frames), -1)
        if not slopes:
            return error, np.zeros(0)
        inverse = np.linalg.inv(frames)
        twists = frames[:, self._parents] @ self._screws @ inverse[:, self._parents]
        rates = np.einsum('pcij,prsj->prsci', twists[..., :3, :], seen)
        slope = np.einsum('prsci,rsc->pric', rates, self._signed)
        return error, slope.reshape(*error.shape, -1) * self.unit

    def closed(self, poses: Poses, fixed: np.ndarray, count: int = 12, pull: float = 0.0,
               soft: float = 1e-14) -> Poses:
        """
        Return poses after so many steps of Newton's method, or fewer if they are closed.

        The columns that are `fixed` do not move. `pull` draws poses to that of the file, by half
        as much in each step. `soft` damps motions that the loops hardly resist. Both are parts of
        the loops' stiffness.
        """
        free = ~fixed
        for i in range(count):
            error, slope = self.errors(poses, True)
            slope = slope[:, :, free]
            down = slope.swapaxes(1, 2)
            square, force = down @ slope, (down @ error[:, :, None])[..., 0]
            weight = soft * np.einsum('pii->p', square)[:, None]
            if pull:
                weight *= 1.0 + max(pull * 0.5 ** i, 1e-13) / soft
                force += weight * (poses.positions[:, self._column] / self.unit)[:, free]
            square += (weight[:, :, None] + 1e-300) * np.eye(free.sum())
            step = np.zeros((len(error), len(fixed)))
            step[:, free] = -np.linalg.solve(square, force[..., None])[..., 0]
            far = np.max(np.abs(step), axis=1, initial=0.0)[:, None]
            step *= np.minimum(1.0, STRIDE / np.maximum(far, STRIDE)) * self.unit
            poses = self.stepped(poses, step)
            if np.all(far < STILL):
                break
        return poses

    def gap(self, poses: Poses, rows: Any = slice(None)) -> np.ndarray:
        """Return the largest residual in each pose, of all or of some rows, as a part of size."""
        return np.max(np.abs(self.errors(poses)[0][:, rows]), axis=1, initial=0.0) / self.size

    def lots(self, fixed: np.ndarray) -> List[Tuple[np.ndarray, np.ndarray]]:
        """Return columns and residuals of loops that share no joint but those that are fixed."""
        moved = np.any(self._signed.sum(axis=1, keepdims=True), axis=1) & ~fixed
        near = (moved @ moved.T) | np.all(self._ends[:, None] == self._ends, axis=2)
        while np.any((more := near @ near) != near):
            near = more
        return [(np.any(moved[rows], axis=0), np.repeat(rows, 3))
                for rows in np.unique(near, axis=0)]

    def elements_of(self, columns: np.ndarray) -> np.ndarray:
        """Return which elements have some of the columns."""
        return np.logical_or.reduceat(columns, self._first)

    def outside(self, part: float) -> Dict[str, float]:
        """Return positions inside their limits, by a part of the range, of joints outside."""
        found = {}
        for each in (each.joint for each in self._elements if each.joint.position is not None):
            low, high = each.range
            if not low <= each.start <= high:
                aside = part * min(high - low, 1.0)
                found[each.name] = low + aside if each.start < low else high - aside
        return found

    def within(self, poses: Poses, elements: Any) -> np.ndarray:
        """Return in which poses elements with names are inside the limits of their joints."""
        found, at = np.ones(len(poses.positions), bool), self.read(poses)
        for i in np.flatnonzero(self._named & elements):
            low, high = self._elements[i].joint.range
            found &= (low <= at[self._names[i]]) & (at[self._names[i]] <= high)
        return found

    def chosen(self, ways: np.ndarray, names: Sequence[str], first: Sequence[str] = ()
               ) -> List[str]:
        """Return joints that tell where all is, by their columns of the ways to move."""
        own = [self._names[i] for i in self._column[self.columns_of(names)]]
        found: List[int] = []
        for i in sorted(range(len(own)), key=lambda i: own[i] not in first):
            if np.linalg.matrix_rank(ways[:, [*found, i]], 1e-6) > len(found):
                found.append(i)
        return [own[i] for i in found]

    def written(self, poses: Poses, elements: Any) -> Dict[str, str]:
        """Return the positions of elements with names in the first pose."""
        found = self.read(poses.some(np.arange(1)))
        return {self._names[i]: f'{found[self._names[i]][0]:.6g}'
                for i in np.flatnonzero(self._named & elements)}

    def moves(self, poses: Poses) -> Dict[str, np.ndarray]:
        """Return the displacement of each body on its parent in the first pose."""
        moved: Dict[str, np.ndarray] = {}
        for i, each in enumerate(self._elements):
            moved[each.body] = moved.get(each.body, np.eye(4)) @ poses.moved[0, i]
        return moved

    def away(self, positions: np.ndarray) -> np.ndarray:
        """
        Return how far joints are from where the file has them, each a column [rad, or of size].

        Hinges that cross in a point, as a ball does, do not count: a rod's pose in a file is any.
        """
        turned = positions - math.tau * np.round(positions / math.tau)
        return np.where(self._slides, positions / self.size, turned) * ~self._are_balls

    def free_ways(self, poses: Poses, fixed: np.ndarray, least: float = 3e-4) -> np.ndarray:
        """
        Return in which ways joints of the first pose can move, a row each, at least at first.

        Loops that are less stiff than `least`, of their size, do not count.
        """
        slope = self.errors(poses.some(np.arange(1)), True)[1][0][:, ~fixed]
        _, values, ways = np.linalg.svd(slope)
        found = np.zeros((len(ways) - np.sum(values > least * self.size), len(fixed)))
        found[:, ~fixed] = ways[len(ways) - len(found):]
        return found

    def free(self, ways: np.ndarray) -> np.ndarray:
        """Return which elements move in some directions."""
        return np.maximum.reduceat(np.linalg.norm(ways, axis=0), self._first) > 1e-6

    def loose(self, poses: Poses, motors: Sequence[str]) -> Tuple[List[str], int]:
        """Return the joints that move while motors do not, and their degrees of freedom."""
        ways = self.free_ways(poses, self.columns_of(motors))
        # The spin of a rod on balls does not count.
        ways = ways * ~self._are_balls[self._column]
        names = [self._names[i] for i in np.flatnonzero(self.free(ways) & self._named)]
        return names, int(np.linalg.matrix_rank(ways, 1e-6)) if names else 0

    def farthest_apart(self, two: Poses, determined: Any) -> Tuple[str, float, float]:
        """Return the joint with the largest difference between two poses, and both positions."""
        apart = np.abs(self.away(two.positions[:1] - two.positions[1:]))[0]
        apart = apart * determined * self._named
        if not apart.any():
            return '', 0.0, 0.0
        name = self._names[int(np.argmax(apart))]
        first, second = self.read(two)[name]
        return name, float(first), float(second)

    def immobile(self, poses: Poses) -> List[str]:
        """Return the joints with a name that cannot move near the first pose, closed."""
        fixed = self.columns_of([])
        rng = np.random.default_rng(3)
        moved = np.zeros(len(self._elements), bool)
        for _ in range(3):
            ways = self.free_ways(poses, fixed)
            moved |= self.free(ways)
            step = ways.T @ rng.normal(size=len(ways))
            step *= 0.1 / max(np.max(np.abs(step), initial=0.0), 0.1)
            poses = self.closed(self.stepped(poses, step[None] * self.unit), fixed)
        return [self._names[i] for i in np.flatnonzero(self._named & ~moved)]

    def read(self, poses: Poses) -> Dict[str, np.ndarray]:
        """Return the positions of named joints [rad or m], within half a turn of the file's."""
        turns = math.tau * np.round(poses.positions / math.tau)
        positions = self._starts + poses.positions - np.where(self._slides, 0.0, turns)
        found = {self._names[i]: positions[:, i] for i in np.flatnonzero(self._named)}
        frames = self._frames(poses)
        for cut, (first, second) in zip(self._cuts, self._cut_ends):
            if cut.position is not None and cut.kind == HINGE:
                turned = frames[:, first, :3, :3].swapaxes(1, 2) @ frames[:, second, :3, :3]
                across = np.cross(cut.axis, np.eye(3)[np.argmin(np.abs(cut.axis))])
                ahead = turned @ across
                found[cut.name] = cut.position + np.arctan2(
                    np.cross(across, ahead) @ cut.axis, ahead @ across)
        return found
