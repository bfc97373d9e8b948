# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A linkage with its dimensions: poses, velocities, joint angles and reach."""

from __future__ import annotations

from fractions import Fraction
from functools import cached_property
from importlib.util import find_spec
import math
from types import MappingProxyType
from typing import Any, Callable, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike

from . import joint_lines
from .arguments import checked_dimensions, numbers
from .builder import in_metres, UNIT
from .design import Design
from .input_range import arcs
from .inputs import Arc
from .quantities import Points, Spot, structure_of
from ..cache import Cache
from ..formula.expression import Real
from ..formula.program import Batch, evaluate, Pose
from ..words import listed, meant, plain_text, quoted

# Lengths beyond these are counted in a power of two of their own, which changes no bit of a
# result and keeps squares and products of lengths inside the range of float64.
SMALL, LARGE = 1e-30, 1e30
MOST_TURNS = 1000
# Values of expressions of dimensions that are held: some twenty times those of Jansen's leg.
MOST_VALUES = 10000

# One input, or a sequence of several; each a number or an array [rad or m].
Inputs = Union[ArrayLike, Sequence[ArrayLike]]


def check_bars(linkage: Mechanism) -> None:
    """Raise ValueError, with its line, for a bar that has no length."""
    for (first, second), length in linkage.bar_lengths.items():
        size = np.asarray(length)
        if not np.all((size > 0.0) & np.isfinite(size)):
            raise linkage.line_of(first, second).error(
                f'the bar {first}-{second} must be longer than zero, got {length:g}'
                if not size.ndim else f'the bar {first}-{second} must be longer than zero')


def _hashable(names: Any) -> Any:
    """Return names as a tuple, None or one name as it is; raise ValueError if they are none."""
    try:
        names = names if names is None or isinstance(names, (str, tuple)) else tuple(names)
        hash(names)
        return names
    except TypeError:
        raise ValueError('points and joints must be a name or a list of names, '
                         f'got {quoted(names)}') from None


def _plain(names: Any) -> Any:
    """Return names that are hashable as plain text, as they are to be held for others."""
    return tuple(map(plain_text, names)) if isinstance(names, tuple) else plain_text(names)


class Mechanism:
    """A linkage whose dimensions are set: its poses, velocities, joint angles and reach."""

    def __init__(self, design: Design, dimensions: Mapping, branches: Mapping[str, int],
                 accelerate: bool = False):
        self.type = design.name
        self.dimensions = dict(dimensions)
        self.branches = dict(branches)
        self.tracer = design.tracer
        # Equal linkages share it, those that were pickled too.
        self._structure = structure_of(design, tuple(self.branches.items()))
        built = self._structure.built
        self.points = tuple(built.points)
        self.grounded = built.grounded
        self.joints = tuple(built.joint_values)
        self.bars = tuple((bar.first, bar.second) for bar in built.bars)
        self.cylinders = tuple(built.cylinders)
        self.yokes = dict(built.yokes)
        self._design = design
        self._accelerate = accelerate
        self._lengths = _in_own_unit(self.dimensions, design.has_literal_lengths)
        self._evaluated: dict = {}
        self._poses, self._placers = Cache(), Cache()
        # What was worked out of it: reach, inverses, travels.
        self.cache = Cache()
        self.inputs = tuple(input_._replace(low=self._metres(input_.low),
                                            high=self._metres(input_.high))
                            if not input_.turns else input_ for input_ in built.inputs)
        self.geared = tuple(built.driven.keys() - {input_.name for input_ in self.inputs})
        self.links = tuple(link._replace(zero=np.asarray(self._value(link.zero)).tolist())
                           for link in built.links)

    def __reduce__(self) -> tuple:
        return type(self), (self._design, self.dimensions, self.branches, self._accelerate)

    def __repr__(self) -> str:
        lengths = ', '.join(f'{k}={v}' for k, v in self.dimensions.items())
        return f'<{self.type} {lengths}>'

    @cached_property
    def bar_lengths(self) -> Mapping:
        """The length [m] of each bar."""
        return MappingProxyType({(bar.first, bar.second): self._metres(bar.length)
                                 for bar in self._structure.built.bars})

    def line_of(self, *joints: str) -> joint_lines.Line:
        """Return the line that places one of some joints, the last that does."""
        return [line for line in self._design.lines if set(joints) & set(line.names)][-1]

    def triangles(self) -> dict:
        """Return for each line of a rigid triangle whether the dimensions allow it."""
        return {self.line_of(name): np.isfinite(self._value(height))
                for name, height in self._structure.built.triangles.items()}

    @cached_property
    def frames(self) -> Mapping:
        """Where each link's joints lie [m] as seen from the link, x along its bar."""
        return MappingProxyType({
            link: {name: tuple(map(self._metres, (place.x, place.y)))
                   for name, place in frame.items()}
            for link, frame in self._structure.built.frames.items()})

    def _metres(self, length: Real) -> Any:
        """Return the value [m] of a length of dimensions alone: a float, or an array."""
        value = self._value(in_metres(length))
        return value if np.ndim(value) else float(value)

    def _value(self, expression: Real) -> Any:
        with np.errstate(all='ignore'):
            return evaluate(expression, self._lengths, self._evaluated)

    @property
    def longest(self) -> float:
        """The longest bar [m]; where there is none, the longest way of an input."""
        return max(self.bar_lengths.values(),
                   default=max(input_.high - input_.low for input_ in self.inputs))

    def with_dimensions(self, /, **changed: ArrayLike) -> Mechanism:
        """Return the same mechanism with other dimensions [m]; raises ValueError like create."""
        made = type(self)(
            self._design, checked_dimensions(self._design, {**self.dimensions, **changed}),
            self.branches, self._accelerate)
        made.check()
        return made

    def check(self) -> None:
        """Raise ValueError, with the line, if its dimensions cannot be."""
        if check := self._design.check:
            check(self._design.lines, self)
        else:
            check_bars(self)

    def accelerated(self) -> Mechanism:
        """
        Return the same mechanism with arrays solved by compiled code, large ones on all cores.

        The first call for a set of points compiles for about a tenth of a second. Sine, cosine and
        arctangent are not the C library's but as good as the rule for errors wants: a pose is the
        same in any array, on any number of cores, but its last digits may differ from those that
        it has alone.

        Raises
        ------
        ImportError
            If llvmlite is not installed (`pip install llvmlite`).

        """
        if not find_spec('llvmlite'):
            raise ImportError('accelerated() needs llvmlite: pip install llvmlite')
        return self.cache.get_or_make('accelerated', lambda: type(self)(
            self._design, self.dimensions, self.branches, True))

    def solve(self, theta: Inputs, points: Optional[Sequence[str]] = None) -> dict:
        """
        Place the joints.

        Parameters
        ----------
        theta : float or array-like
            The input: a crank's angle [rad] or a cylinder's length [m]; for a linkage with several
            inputs a sequence of as many.
        points : sequence of str, optional
            The joints wanted; only what they depend on is computed. Default: all.

        Returns
        -------
        dict
            For each joint an array [m] of theta's shape and a last axis for x and y, NaN where it
            cannot be assembled.

        Raises
        ------
        ValueError
            If a joint does not exist.

        """
        if isinstance(theta, float) and len(self.inputs) == 1:
            wanted = _hashable(points)
            place = self._placers.get(wanted) or self._placer(wanted)
            return place(theta)
        return self._vectors('points', theta, points)

    def _placer(self, wanted: Any) -> Callable:
        """Return what places joints at one value of the input, a float."""
        names, pose = self._ready('points', wanted)
        if pose.shape:
            return lambda theta: self._vectors('points', theta, wanted)
        return self._placers.get_or_make(_plain(wanted), lambda: pose.placer(names))

    def velocity(self, theta: Inputs, points: Optional[Sequence[str]] = None, by: int = 0) -> dict:
        """
        Differentiate the joints' places by one of the inputs [m/rad, m/m].

        Takes, returns and raises what `solve` does; infinite or NaN at a dead point.
        """
        return self._vectors('velocities', theta, points, by)

    def joint_angles(self, theta: Inputs, joints: Optional[Sequence[str]] = None) -> dict:
        """
        Return the angle of each moving link to its parent.

        Parameters
        ----------
        theta : float or array-like
            What `solve` takes.
        joints : sequence of str, optional
            The links wanted, by name, or other outputs; see `has_output`. Default: all links.

        Returns
        -------
        dict
            For each link an array of theta's shape: rad in (-pi, pi] counted from its `zero`,
            an input as given, a slide [m]. NaN where it cannot be assembled.

        Raises
        ------
        ValueError
            If a link does not exist.

        """
        return self._scalars('angles', theta, joints)

    def has_output(self, name: Any) -> bool:
        """
        Return whether there is an output of this name.

        That is a link's name, for its joint angle [rad] or slide [m]; a joint's coordinate such as
        'C.x' [m]; 'distance(A,C)' [m] of two joints; 'angle(A,C)' [rad] from +x to A -> C.
        """
        return isinstance(name, str) and self._structure.has(name)

    def is_angle(self, output: str) -> bool:
        """Return whether an output is an angle [rad], not a length [m]."""
        return self._structure.turns(output)

    def joint_rates(self, theta: Inputs, joints: Optional[Sequence[str]] = None,
                    by: int = 0) -> dict:
        """Differentiate the joint angles by one of the inputs; see `joint_angles`."""
        return self._scalars('rates', theta, joints, by)

    def period(self, by: int = 0) -> int:
        """
        Return after how many turns of an input the pose is the same.

        That is more than one where the input drives others by gears of fractions; a ratio that is
        none with a denominator up to MOST_TURNS is taken for the nearest that is.
        """
        if not self.geared or not self.inputs[by].turns:
            return 1
        rates = self.joint_rates([0.0] * len(self.inputs) if len(self.inputs) > 1 else 0.0,
                                 self.geared, by)
        return math.lcm(*(Fraction(float(rate)).limit_denominator(MOST_TURNS).denominator
                          for rate in rates.values() if rate == rate))

    def reach(self, *others: float) -> list:
        """
        Return the values of the first input with which the linkage can be assembled.

        Parameters
        ----------
        *others : float
            The values [rad or m] at which further inputs are held, if there are any.

        Returns
        -------
        list of (float, float)
            Arcs (lo, hi) of a crank [rad] with lo in [-pi, pi) and hi > lo; a full turn is
            [(-pi, pi)]. Strokes (lo, hi) of a cylinder [m]. [] if it never can be assembled.

        Raises
        ------
        ValueError
            If not every other input is given, or a dimension is an array.

        """
        return list(self.cache.get_or_make(
            ('reach', *others), lambda: self._arcs(others)))

    def _arcs(self, others: Tuple[float, ...]) -> List[Arc]:
        _, margins = self._ready('margins', ())
        if margins.shape:
            raise ValueError('the reach, dead points and inverse are for one set of dimensions, '
                             'not for arrays')
        if len(others) != len(self.inputs) - 1:
            raise ValueError(f'{self.type} has {len(self.inputs)} inputs: the value of each but '
                             f'the first is needed, got {len(others)}')
        first = self.inputs[0]
        return [(lo * first.size, hi * first.size) for lo, hi in arcs(
            lambda value: margins.searched(value * first.size, *others), first.counted(),
            self._structure.built.limits, self._value,
            lambda theta: self._ready('points', None)[1].searched(theta, *others))]

    def function(self, points: Optional[Sequence[str]] = None, joints: Sequence[str] = (),
                 rates: Sequence[str] = ()) -> Callable:
        """
        Return the quickest way to one pose after the other.

        Returns
        -------
        callable
            From the input, a float [rad or m] (or as many as there are inputs), to a tuple of
            floats: x, y [m] of each point wanted, then the joint angles wanted, then the joint
            rates by each input, from one list of operations; NaN where it cannot be assembled.

        Raises
        ------
        ValueError
            If a joint does not exist.

        """
        return self.posed(points, joints, rates).at

    def posed(self, points: Optional[Sequence[str]] = None, joints: Sequence[str] = (),
              rates: Sequence[str] = ()) -> Pose:
        """Return the code behind `function`."""
        wanted = tuple(self._names(kind, _plain(_hashable(names)))
                       for kind, names in (('points', points), ('angles', joints),
                                           ('rates', rates)))
        return self._bound('parts', wanted)

    def legs(self, points: Points, joints: Tuple[str, ...], moving: Tuple[str, ...],
             rows: np.ndarray) -> Batch:
        """
        Return legs like this one on the same inputs, to be solved again and again.

        An accelerated mechanism's are solved by machine code as soon as that is there, without
        waiting for it; the numbers are the same.

        Parameters
        ----------
        points : tuple of str or Spot
            The joints, and points that are none, whose places are wanted.
        joints, moving : tuple of str
            The links whose joint angles and velocities are wanted.
        rows : float array (legs, n)
            Where they go: x, y [m] of each point, joint angles [rad; a slide: m], velocities.

        Returns
        -------
        Batch
            For each leg is given: the value of each input [rad or m], the speed of each input
            [rad/s or m/s], and the numbers of its `Leg`.

        """
        pose = self.cache.get_or_make(('legs', points, joints, moving), lambda: self._legs(
            points, joints, moving))
        return pose.batch(rows)

    def _legs(self, points: Points, joints: Tuple[str, ...], moving: Tuple[str, ...]) -> Pose:
        lengths, unit = dict(self._lengths), self._lengths[UNIT.args[0]]
        named: List[Union[str, Spot]] = []
        for i, point in enumerate(points):
            if isinstance(point, Spot):
                names = f'[x{i}]', f'[y{i}]'
                lengths.update(zip(names, (point.x / unit, point.y / unit)))
                point = Spot(point.link, *names)
            named.append(point)
        program = self._structure.legs(tuple(named), joints, moving)
        return program.bind(lengths, dict(self._evaluated), self._accelerate)

    def _vectors(self, kind: str, theta: Inputs, points: Any, *by: int) -> dict:
        names, pose = self._ready(kind, points, *by)
        values = pose.over(*self._each_input(theta))
        pairs = np.moveaxis(values.reshape(len(names), 2, *values.shape[1:]), 1, -1)
        return dict(zip(names, pairs))

    def _scalars(self, kind: str, theta: Inputs, joints: Any, *by: int) -> dict:
        names, pose = self._ready(kind, joints, *by)
        return dict(zip(names, pose.over(*self._each_input(theta))))

    def _each_input(self, theta: Any) -> Sequence[np.ndarray]:
        if len(self.inputs) == 1:
            return (numbers('theta', theta),)
        if not hasattr(theta, '__len__') or len(theta) != len(self.inputs):
            raise ValueError(f'{self.type} has {len(self.inputs)} inputs: '
                             'theta must be a sequence of as many values')
        return [numbers('theta', each) for each in theta]

    def _ready(self, kind: str, wanted: Any, *by: int) -> Tuple[Tuple[str, ...], Pose]:
        """Return the names that are wanted and the function that computes them."""
        key = kind, _hashable(wanted), *by
        return self._poses.get(key) or self._pose(kind, _plain(key[1]), *by)

    def _pose(self, kind: str, wanted: Any, *by: int) -> Tuple[Tuple[str, ...], Pose]:
        names = self._names(kind, wanted)
        return self._poses.get_or_make(
            (kind, wanted, *by), lambda: (names, self._bound(kind, names, *by)))

    def _bound(self, kind: str, names: Any, *by: int) -> Pose:
        program = self._structure.program(kind, names, *by)
        if len(self._evaluated) > MOST_VALUES:
            # Another dictionary: a thread may be reading this one.
            self._evaluated = {}
        return program.bind(self._lengths, self._evaluated, self._accelerate)

    def _names(self, kind: str, wanted: Any) -> Tuple[str, ...]:
        what, allowed = {
            'points': ('point', self.points), 'velocities': ('point', self.points),
            'point accelerations': ('point', self.points),
            'transmissions': ('transmission angle at', tuple(
                self._structure.built.transmissions)),
        }.get(kind, ('joint', self.joints))
        if wanted is None:
            return allowed
        names = (wanted,) if isinstance(wanted, str) else wanted
        for name in names:
            if name not in allowed and not (what == 'joint' and self.has_output(name)):
                raise ValueError(f'{self.type} has no {what} {quoted(name)}; '
                                 f'allowed: {listed(allowed)}{meant(name, allowed)}')
        return names


def _in_own_unit(dimensions: Mapping, fixed: bool) -> dict:
    """Return dimensions counted in a unit that is a power of two, and that unit in metres."""
    longest = max((np.max(np.abs(length)) for length in dimensions.values()), default=1.0)
    if fixed or SMALL < longest < LARGE:
        return {**dimensions, UNIT.args[0]: 1.0}
    unit = 2.0 ** np.frexp(longest)[1]
    return {UNIT.args[0]: unit, **{name: length / unit for name, length in dimensions.items()}}
