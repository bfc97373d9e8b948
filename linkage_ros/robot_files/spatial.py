# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Loops of a robot closed in space, by Newton's method: many poses at a time.

Nothing here knows of planes or dyads. A pose is a displacement of each body from where the file
has it: a product of screws along a tree of joints; joints that are not in the tree are equations
(R. Murray, Z. Li, S. Sastry: A Mathematical Introduction to Robotic Manipulation, 1994, ch. 3).
Poses are arrays of the screws' positions, relative to the file, a row a pose [rad or m].
"""

from __future__ import annotations

from typing import Any, Iterator, Mapping, NamedTuple, Sequence

import numpy as np

from ..cli import RequestError
from ..linkage import wrapped
from ..robot_model.robot import BALL, exponentials, FIXED, FREE, HINGE, Joint, Robot, screws, SLIDE

# Each body's parent and joint.
Tree = dict[str, tuple[str, Joint]]
# The largest step of an iteration [rad, or of the size].
MAX_STEP = 0.5
# The last step [rad, or of the size]: steps square, so that the next would be rounding.
LAST_STEP = 1e-8
MAX_BODIES = 150
# Axes that differ by less [rad] are parallel: files have rounded numbers, and mirrored legs that
# somebody aligned by hand.
ASKEW = 1e-3
# Hinges nearer to each other [m] cross in a point.
CROSSING = 1e-6
# Loops open by less, of their size, are closed.
CLOSED = 1e-10
# Loops open by more, of their size, are so in the file or by a mistake, not by rounding.
EXACT = 1e-9
# Loops that are less stiff, of their size, are at a dead point.
DEAD_POINT = 3e-4


def inclination(joint: Joint, normal: np.ndarray) -> float:
    """Return the inclination of a joint's axes against those of a plane [rad]."""
    if joint.kind == SLIDE:
        return float(abs(joint.axes[0] @ normal))
    return float(max(np.linalg.norm(np.cross(axis, normal)) for axis in joint.axes)) \
        if joint.kind == HINGE else 0.0


class Screw(NamedTuple):
    """A rotation or a translation of a joint: of a ball three, of a free body six."""

    joint: Joint
    kind: str
    place: np.ndarray
    axis: np.ndarray
    parent: int
    body: str


def loops_of(robot: Robot) -> tuple[Tree, list[tuple[set[str], list[Joint], list[Joint]]]]:
    """Return a tree, and bodies, joints and cuts of its loops; those that share joints are one."""
    tree, cuts = robot.spanning_tree()
    groups: list[tuple[set[str], list[Joint]]] = []
    for cut in cuts:
        cycle: set[str] = set()
        for body in cut.bodies:
            while body in tree:
                cycle ^= {body}
                body = tree[body][0]
        shared = [group for group in groups if group[0] & cycle]
        groups = [group for group in groups if group not in shared]
        groups.append((cycle.union(*(bodies for bodies, _ in shared)),
                       [joint for _, joints in shared for joint in joints] + [cut]))
    return tree, [(bodies, [joint for joint in robot.joints if joint in edges], closures)
                  for bodies, closures in groups
                  for edges in [{tree[body][1] for body in bodies}.union(closures)]]


def components(robot: Robot) -> Iterator['Component']:
    """Yield the loops of a robot; those that share joints are one component."""
    tree, loops = loops_of(robot)
    for bodies, joints, cuts in loops:
        if len(bodies) > MAX_BODIES:
            raise RequestError(f'{len(bodies)} bodies are in loops that share joints: no more '
                               f'than {MAX_BODIES} are closed at once')
        yield Component(robot.root, tree, bodies, joints, cuts)


class Component:
    """
    Loops that share joints, and poses of them.

    Attributes
    ----------
    joints : list of Joint
        All joints of the loops.
    size : float
        The greatest distance of two joints in the file's pose [m].
    unit : array
        A radian, or the size, for each screw.
    named : dict
        The screw of each joint that has a position.
    start : array
        The pose of the file.
    near : float
        Loops open by less, of the size, are closed: by rounding, or by axes that lean.

    """

    def __init__(self, root: str, tree: Tree, bodies: set[str], joints: Sequence[Joint],
                 cuts: Sequence[Joint]):
        self.joints = joints
        places = np.array([place for joint in self.joints for place in joint.places])
        self.size = float(np.max(np.linalg.norm(places - places[0], axis=1))) or 1.0
        self._up = next((joint.axes[0] for joint in self.joints if joint.kind == HINGE),
                        np.zeros(3))
        self._screws: list[Screw] = []
        # The last screw that moves each body.
        last = {root: -1}
        for body, (base, joint) in tree.items():
            last[body] = last[base]
            if body in bodies:
                for kind, axis in self._motions(joint, body):
                    self._screws.append(Screw(joint, kind, joint.place(base), axis,
                                              last[body], body))
                    last[body] = len(self._screws) - 1
        self._parents = np.array([screw.parent for screw in self._screws], int)
        above = np.zeros((len(self._screws) + 1, len(self._screws)), bool)
        for i, parent in enumerate(self._parents):
            above[i] = above[parent]
            above[i, i] = True
        self.named = {screw.joint.name: i for i, screw in enumerate(self._screws)
                      if screw.joint.position is not None}
        self._starts = np.array([screw.joint.start for screw in self._screws])
        self._slides = np.array([screw.kind == SLIDE for screw in self._screws], bool)
        axes, places = (np.array([getattr(screw, key) for screw in self._screws]).reshape(-1, 3)
                        for key in ('axis', 'place'))
        is_crossed = (np.linalg.norm(places[:, None] - places, axis=2) < CROSSING) & (
            np.linalg.norm(np.cross(axes[:, None], axes), axis=2) > 0.1)
        self._in_balls = ~self._slides & np.any(is_crossed[:, ~self._slides], axis=1)
        self._twists = screws(axes, places, self._slides)
        self.unit = np.where(self._slides, self.size, 1.0)
        self.start = np.zeros((1, len(self._screws)))
        self._set_equations(cuts, last, above)

    def _motions(self, joint: Joint, body: str) -> list[tuple[str, np.ndarray]]:
        """Return kind and axis of the screws of a joint; far from a ball's singular poses."""
        if joint.kind in (HINGE, SLIDE):
            return [(joint.kind, joint.motion(body))]
        turns = [(HINGE, way) for way in np.linalg.svd(self._up[None])[2]]
        return {BALL: turns, FREE: [*((SLIDE, way) for way in np.eye(3)), *turns]}.get(
            joint.kind, [])

    def _set_equations(self, cuts: Sequence[Joint], last: Mapping[str, int], above: np.ndarray
                       ) -> None:
        """Set the points that coincide on both ends of each cut."""
        ends, points = [], []
        leans = max(inclination(joint, self._up) for joint in self.joints)
        is_flat = leans < ASKEW and all(joint in cuts or joint.kind in (HINGE, SLIDE)
                                        for joint in self.joints)
        self.near = CLOSED + 2.0 * leans * is_flat
        for cut in cuts:
            end = [last[body] for body in cut.bodies]
            places = np.array(cut.places)
            # Nothing moves along the axes of a planar loop, and an opening there changes no angle.
            places[1] += self._up * (self._up @ (places[0] - places[1])) * is_flat
            offsets = [np.zeros((2, 3))]
            if cut.kind == HINGE:
                first, second = cut.axes
                offsets.append(np.array([first, second if first @ second > 0.0 else -second]))
            if cut.kind == FIXED:
                offsets += [np.array(axes) for axes in zip(*(turn.T for turn in cut.axes))]
            points += [places + self.size * offset for offset in offsets]
            ends += [end] * len(offsets)
        self._ends = np.array(ends, int).reshape(-1, 2)
        self._points = np.concatenate([points, np.ones((len(ends), 2, 1))], axis=2)
        self._signs = above[self._ends] * np.array([[1.0], [-1.0]])

    def is_of(self, names: Sequence[str]) -> np.ndarray:
        """Return which screws are of the joints that are named."""
        return np.array([screw.joint.name in names for screw in self._screws], bool)

    def moved_to(self, poses: np.ndarray, positions: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return poses with some joints at positions."""
        poses = poses.copy()
        for name in positions.keys() & self.named.keys():
            poses[:, self.named[name]] = positions[name] - self._starts[self.named[name]]
        return poses

    def _frames(self, poses: np.ndarray) -> np.ndarray:
        """Return the displacement after each screw; the last is that of the root."""
        moved = exponentials(self._twists, poses, self._slides)
        frames = np.empty((len(poses), len(self._screws) + 1, 4, 4))
        frames[:, -1] = np.eye(4)
        for i, parent in enumerate(self._parents):
            np.matmul(frames[:, parent], moved[:, i], out=frames[:, i])
        return frames

    def errors(self, poses: np.ndarray, slopes: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Return the residuals of the loops in each pose [m], and their derivatives by screws."""
        frames = self._frames(poses)
        seen = (frames[:, self._ends] @ self._points[..., None])[..., 0]
        error = (seen[:, :, 0] - seen[:, :, 1])[..., :3].reshape(len(frames), -1)
        if not slopes:
            return error, np.zeros(0)
        parents = frames[:, self._parents]
        turns, places = parents[..., :3, :3], parents[..., :3, 3:]
        spins = turns @ self._twists[:, :3, :3] @ turns.swapaxes(2, 3)
        twists = np.concatenate([spins, turns @ self._twists[:, :3, 3:] - spins @ places], axis=3)
        rates = seen.reshape(len(seen), -1, 4) @ twists.reshape(len(seen), -1, 4).swapaxes(1, 2)
        rates = rates.reshape(len(seen), *self._signs.shape, 3) * self._signs[..., None]
        slope = rates.sum(axis=2).swapaxes(2, 3)
        return error, slope.reshape(*error.shape, -1) * self.unit

    def closed(self, poses: np.ndarray, fixed: np.ndarray, count: int = 12, spring: float = 0.0,
               soft: float = 1e-14) -> np.ndarray:
        """
        Return poses after so many steps of Newton's method, or fewer if they are closed.

        The screws that are `fixed` do not move. `spring` draws poses to that of the file, by half
        as much in each step. `soft` damps motions that the loops hardly resist. Both are parts of
        the loops' stiffness.
        """
        free, poses = ~fixed, poses.copy()
        moving = np.arange(len(poses))
        for i in range(count):
            error, slope = self.errors(poses[moving], True)
            slope = slope[:, :, free]
            down = slope.swapaxes(1, 2)
            square, force = down @ slope, (down @ error[:, :, None])[..., 0]
            weight = soft * np.einsum('pii->p', square)[:, None]
            if spring:
                weight *= 1.0 + max(spring * 0.5 ** i, 1e-13) / soft
                force += weight * (poses[moving] / self.unit)[:, free]
            square += (weight[:, :, None] + 1e-300) * np.eye(free.sum())
            step = np.linalg.solve(square, force[..., None])[..., 0]
            far = np.max(np.abs(step), axis=1, initial=0.0)[:, None]
            step *= np.minimum(1.0, MAX_STEP / np.maximum(far, MAX_STEP))
            poses[np.ix_(moving, free)] -= step * self.unit[free]
            moving = moving[far[:, 0] >= LAST_STEP]
            if not len(moving):
                break
        return poses

    def residual(self, poses: np.ndarray, rows: Any = slice(None)) -> np.ndarray:
        """Return the largest residual in each pose, of all or of some rows, as a part of size."""
        return np.max(np.abs(self.errors(poses)[0][:, rows]), axis=1, initial=0.0) / self.size

    def independent(self, fixed: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return screws and residuals of loops that share no joint but those that are fixed."""
        moved = np.any(self._signs.sum(axis=1, keepdims=True), axis=1) & ~fixed
        linked = (moved @ moved.T) | np.all(self._ends[:, None] == self._ends, axis=2)
        while np.any((more := linked @ linked) != linked):
            linked = more
        return [(np.any(moved[rows], axis=0), np.repeat(rows, 3))
                for rows in np.unique(linked, axis=0)]

    def within(self, poses: np.ndarray, which: np.ndarray) -> np.ndarray:
        """Return in which poses joints are inside their limits, of some screws."""
        positions, inside = self.read(poses), np.ones(len(poses), bool)
        for name, i in self.named.items():
            low, high = self._screws[i].joint.range
            inside &= ~which[i] | (low <= positions[name]) & (positions[name] <= high)
        return inside

    def chosen(self, motions: np.ndarray, names: Sequence[str]) -> list[str]:
        """Return joints that tell where all is; ways to move have a column for each screw."""
        basis: list[str] = []
        for name in names:
            if np.linalg.matrix_rank(motions[:, self.is_of([*basis, name])], 1e-6) > len(basis):
                basis.append(name)
        return basis

    def texts(self, pose: np.ndarray, which: Any) -> dict[str, str]:
        """Return the positions of some screws with names in a pose, each as NAME=VALUE."""
        return {name: f'{name}={round(float(at), 6) + 0.0:.5g}'
                for name, at in self.read(pose).items() if which[self.named[name]]}

    def moves(self, pose: np.ndarray) -> dict[str, np.ndarray]:
        """Return the displacement of each body on its parent in a pose."""
        moved: dict[str, np.ndarray] = {}
        for screw, step in zip(self._screws, exponentials(self._twists, pose, self._slides)):
            moved[screw.body] = moved.get(screw.body, np.eye(4)) @ step
        return moved

    def displacement(self, poses: np.ndarray) -> np.ndarray:
        """
        Return how far screws are from where the file has them [rad, or of the size].

        Hinges that cross in a point, as a ball does, do not count: a rod's pose in a file is any.
        """
        return np.where(self._slides, poses / self.size, wrapped(poses)) * ~self._in_balls

    def free_ways(self, pose: np.ndarray, fixed: np.ndarray, stiffness: float = DEAD_POINT
                  ) -> np.ndarray:
        """
        Return in which ways screws can move in a pose, a row each, at least at first.

        Loops that are less stiff than `least`, of their size, do not count.
        """
        slope = self.errors(pose[None], True)[1][0][:, ~fixed]
        _, values, motions = np.linalg.svd(slope)
        basis = np.zeros((len(motions) - np.sum(values > stiffness * self.size), len(fixed)))
        basis[:, ~fixed] = motions[len(motions) - len(basis):]
        return basis

    def nullity(self, fixed: np.ndarray) -> int:
        """Return the degrees of freedom that the loops leave, in a random open pose."""
        pose = np.random.default_rng(2).uniform(-0.3, 0.3, len(fixed)) * self.unit
        return len(self.free_ways(pose, fixed))

    def undriven(self, pose: np.ndarray, motors: Sequence[str], stiffness: float = DEAD_POINT
              ) -> tuple[list[str], np.ndarray]:
        """Return the joints that move while motors do not, and the ways in which they do."""
        # The spin of a rod on balls does not count.
        motions = self.free_ways(pose, self.is_of(motors), stiffness) * ~self._in_balls
        return [name for name, i in self.named.items() if is_free(motions)[i]], motions

    def read(self, poses: np.ndarray) -> dict[str, np.ndarray]:
        """Return positions of named joints [rad or m], within half a turn of the file's."""
        positions = self._starts + np.where(self._slides, poses, wrapped(poses))
        return {name: positions[..., i] for name, i in self.named.items()}


def is_free(motions: np.ndarray) -> np.ndarray:
    """Return which screws move in some of the ways."""
    return np.linalg.norm(motions, axis=0) > 1e-6
