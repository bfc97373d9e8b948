# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A linkage with its dimensions: poses, velocities, joint angles and reach."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from itertools import chain, cycle
from types import MappingProxyType
from typing import Any, Callable, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from . import joint_lines
from .arguments import checked_dimensions, numbers
from .builder import in_metres, Sketch, UNIT
from .input_range import arcs
from ..formula.expression import argument, derivative, gated, Real, real, spin
from ..formula.program import Batch, evaluate, keep, Pose, Program
from ..words import listed, quoted

# Lengths beyond these are counted in a power of two of their own, which changes no bit of a
# result and keeps squares and products of lengths inside the range of float64.
SMALL, LARGE = 1e-30, 1e30


def check_bars(linkage: Mechanism):
    """Raise ValueError, with its line, for a bar that has no length."""
    for (first, second), length in linkage.bar_lengths.items():
        size = np.asarray(length)
        if not np.all((size > 0.0) & np.isfinite(size)):
            raise linkage.line_of(first, second).error(
                f'the bar {first}-{second} must be longer than zero, got {length:g}'
                if not size.ndim else f'the bar {first}-{second} must be longer than zero')


@dataclass(frozen=True, eq=False)
class Design:
    """
    What a type of mechanism is.

    Parameters
    ----------
    name : str
        The name that users type.
    dimensions : mapping
        Defaults [m].
    joints : tuple of str
        One line a joint, as `joint_lines` reads them.
    tracer : str
        The joint whose curve is the locus.
    signed : frozenset
        Dimensions that may be zero or negative.
    check : callable
        From a mechanism of this type; raises ValueError for dimensions that cannot be.

    """

    name: str
    dimensions: Mapping[str, float]
    joints: Tuple[str, ...]
    tracer: str
    signed: frozenset = frozenset()
    check: Callable = check_bars

    @cached_property
    def lines(self) -> list:
        """The joints as constructions."""
        return joint_lines.parse(self.joints)

    @cached_property
    def has_literal_lengths(self) -> bool:
        """Whether a length is written as a number, so that all count in metres."""
        return joint_lines.has_literal_lengths(self.lines)

    @property
    def branches(self) -> dict:
        """The assembly sign, +1 or -1, of each joint that has two."""
        return joint_lines.branches(self.lines)


class Leg(NamedTuple):
    """
    What tells one leg on the inputs from another.

    Its own crank has turned by start + side (angle - lag) [rad]; its side is 1, or -1 if it is
    mirrored; its size is a factor of every length.
    """

    lag: Any
    start: Any
    side: Any
    size: Any


class Structure:
    """A design drawn with its branches: what all mechanisms of that kind share."""

    def __init__(self, design: Design, branches: Mapping[str, int]):
        self.sketch = Sketch()
        joint_lines.draw(self.sketch, design.lines, joint_lines.symbols_of(
            design.dimensions, design.signed), branches)
        self.branches = dict(branches)
        self._programs: dict = {}
        self._outputs: Mapping[str, Callable] = {
            'points': self._points, 'velocities': self._velocities, 'angles': self._angles,
            'rates': self._rates, 'parts': self._parts, 'margins': self._margins,
            'transmissions': self._transmissions, 'closures': self._closures,
            'output': self._output}

    def program(self, kind: str, names: Tuple[str, ...], *by: int) -> Program:
        """Return the code for outputs of one kind; what they do not depend on is left out."""
        key = (kind, names, *by)
        if key not in self._programs:
            outputs = self._outputs[kind](names, *by)
            keep(self._programs, key, Program(outputs, len(self.sketch.inputs)))
        return self._programs[key]

    def legs(self, points: Tuple[str, ...], joints: Tuple[str, ...],
             moving: Tuple[str, ...]) -> Program:
        """Return the code for a leg of several; see `Mechanism.legs`."""
        key = points, joints, moving
        if key not in self._programs:
            keep(self._programs, key, self._legs(*key))
        return self._programs[key]

    def _points(self, names):
        places = [self.sketch.points[n].place for n in names]
        return [in_metres(part) for place in places for part in (place.x, place.y)]

    def _velocities(self, names, by=0):
        known = {}
        return [self._due(derivative(part, {by: 1.0}, known), part)
                for part in self._points(names)]

    def _due(self, rate, value):
        """Return a rate by one input, NaN where other inputs leave no value to have it."""
        alone = len(self.sketch.inputs) == 1 and rate.value is None
        return rate if alone or not value.varies else gated(rate, abs(value), real(0.0))

    def _angles(self, names):
        values = self.sketch.joint_values
        return [in_metres(values[n]) if self._slides(n) else values[n] for n in names]

    def _parts(self, wanted):
        points, joints, rates = wanted
        turning = [self._rates(rates, by) for by in range(len(self.sketch.inputs))]
        return [*self._points(points), *self._angles(joints), *chain.from_iterable(turning)]

    def _legs(self, points, joints, moving):
        inputs = self.sketch.inputs
        given = [argument(i) for i in range(2 * len(inputs) + len(Leg._fields))]
        values, speeds, leg = (given[:len(inputs)], given[len(inputs):2 * len(inputs)],
                               Leg(*given[2 * len(inputs):]))
        across = leg.side * leg.size
        own = {own: leg.start + leg.side * (value - leg.lag) if input_.turns else value / leg.size
               for own, value, input_ in zip(self.sketch.arguments, values, inputs)}
        turning = [sum((rate * (speed if input_.turns else speed / leg.size)
                        for rate, speed, input_ in zip(rates, speeds, inputs)), real(0.0))
                   for rates in zip(*(self._rates(moving, by) for by in range(len(inputs))))]
        # A mirrored leg's own crank turns backwards, which mirrors its rates once more.
        outputs = [*(part * factor for part, factor in zip(self._points(points),
                                                           cycle((across, leg.size)))),
                   *(value * (across if self._slides(name) else leg.side)
                     for name, value in zip(joints, self._angles(joints))),
                   *(value * leg.size if self._slides(name) else value
                     for name, value in zip(moving, turning))]
        return Program(outputs, len(given), own)

    def _slides(self, name):
        return any(x.name == name and x.kind == 'prismatic' for x in self.sketch.links)

    def _rates(self, names, by=0):
        known = {}
        inputs = {x.name for x in self.sketch.inputs}

        def d(expression):
            return derivative(expression, {by: 1.0}, known)

        def turning(name):
            bar = self.sketch.directions.get(name)
            if bar is None:
                return real(0.0)
            turned = spin(bar)
            return turned.formula(*map(d, turned.of))

        def rate(link):
            if link.kind == 'prismatic' or link.name in inputs:
                return d(self._angles([link.name])[0])
            return turning(link.name) - turning(link.parent)

        links = {link.name: link for link in self.sketch.links}
        return [self._due(rate(links[n]), self.sketch.joint_values[n]) for n in names]

    def _margins(self, _):
        """Return each limit's margin, so much above its tolerance that a reached one is >= 0."""
        return [limit.margin + limit.tolerance for limit in self.sketch.limits]

    def _transmissions(self, names):
        return [self.sketch.transmissions[n] for n in names]

    @property
    def closures(self) -> list:
        """What vanishes where a dyad, a slot, a slider or a kite stretches or folds."""
        return [limit for limit in (*self.sketch.limits, *self.sketch.folds)
                if limit.margin.varies]

    def _closures(self, _):
        """Return each closure and its rate by the first input."""
        known = {}
        return [part for limit in self.closures
                for part in (limit.margin, derivative(limit.margin, {0: 1.0}, known))]

    def _output(self, name):
        """Return an output, as `input_for` names it, and its rate by the first input."""
        joint, _, axis = name.rpartition('.')
        if not joint:
            return self._angles([name]) + self._rates([name])
        i = 'xy'.index(axis)
        return [self._points([joint])[i], self._velocities([joint])[i]]

    def turns(self, output: str) -> bool:
        """Return whether an output is an angle, not a length."""
        return '.' not in output and not self._slides(output)

    def moves(self, output: str) -> bool:
        """Return whether an output depends on the first input."""
        rate = self._output(output)[1]
        return (rate.args[0] if rate.op == 'gated' else rate).value != 0.0


def _hashable(names):
    """Return names as a tuple, None or one name as it is; raise ValueError if they are none."""
    try:
        names = names if names is None or isinstance(names, (str, tuple)) else tuple(names)
        hash(names)
        return names
    except TypeError:
        raise ValueError('points and joints must be a name or a list of names, '
                         f'got {quoted(names)}') from None


class Mechanism:
    """
    A linkage whose dimensions are set.

    A pose depends on the inputs alone: any value, in any order, gives the same numbers. Joint
    angles in arrays may differ by an ulp from those asked for one by one.
    Make one with `linkage_ros.mechanisms.create`.

    Attributes
    ----------
    inputs : tuple of Input
        What drives it: cranks by their angles [rad], cylinders by their lengths [m].
    points, joints : tuple of str
        The linkage's joints, and its moving links, whose joint angles there are.
    bars : tuple of (str, str)
        The joints at the ends of each bar.
    lines : tuple of (str, str)
        What is drawn as a line: the bars, and the cylinders.

    """

    def __init__(self, design: Design, structure: Structure, dimensions: Mapping,
                 branches: Mapping[str, int], accelerate: bool = False):
        self.type = design.name
        self.dimensions = dict(dimensions)
        self.branches = dict(branches)
        self.tracer = design.tracer
        sketch = structure.sketch
        self.points = tuple(sketch.points)
        self.joints = tuple(sketch.joint_values)
        self.bars = tuple((bar.first, bar.second) for bar in sketch.bars)
        self.lines = (*self.bars, *sketch.cylinders)
        self._design = design
        self._structure = structure
        self._accelerate = accelerate
        self._lengths = _in_own_unit(self.dimensions, design.has_literal_lengths)
        self._evaluated: dict = {}
        self._poses: dict = {}
        self._placers: dict = {}
        self._found: dict = {}
        self.inputs = tuple(input_._replace(low=self._metres(input_.low),
                                            high=self._metres(input_.high))
                            if not input_.turns else input_ for input_ in sketch.inputs)
        self.links = tuple(link._replace(zero=np.asarray(self._value(link.zero)).tolist())
                           for link in sketch.links)

    def __repr__(self):
        lengths = ', '.join(f'{k}={v}' for k, v in self.dimensions.items())
        return f'<{self.type} {lengths}>'

    @cached_property
    def bar_lengths(self) -> Mapping:
        """The length [m] of each bar."""
        return MappingProxyType({(bar.first, bar.second): self._metres(bar.length)
                                 for bar in self._structure.sketch.bars})

    def line_of(self, *joints: str) -> joint_lines.Line:
        """Return the line that places one of some joints, the last that does."""
        return [line for line in self._design.lines if set(joints) & set(line.names)][-1]

    def triangles(self) -> dict:
        """Return for each line of a rigid triangle whether the dimensions allow it."""
        return {self.line_of(name): np.isfinite(self._value(height))
                for name, height in self._structure.sketch.triangles.items()}

    @cached_property
    def frames(self) -> Mapping:
        """Where each link's joints lie [m], seen from the link: x along its bar."""
        return MappingProxyType({
            link: {name: tuple(map(self._metres, (place.x, place.y)))
                   for name, place in frame.items()}
            for link, frame in self._structure.sketch.frames.items()})

    def _metres(self, length: Real):
        """Return the value [m] of a length of dimensions alone: a float, or an array."""
        value = self._value(in_metres(length))
        return value if np.ndim(value) else float(value)

    def _value(self, expression: Real):
        with np.errstate(all='ignore'):
            return evaluate(expression, self._lengths, self._evaluated)

    @property
    def longest(self) -> float:
        """The longest bar [m]."""
        return max(self.bar_lengths.values())

    def with_dimensions(self, /, **changed) -> Mechanism:
        """Return the same mechanism with other dimensions [m]; raises ValueError like create."""
        made = type(self)(self._design, self._structure,
                          checked_dimensions(self._design, {**self.dimensions, **changed}),
                          self.branches, self._accelerate)
        self._design.check(made)
        return made

    def accelerated(self) -> Mechanism:
        """
        Return the same mechanism with arrays solved by compiled code.

        The first call for a set of points compiles for about a tenth of a second.

        Raises
        ------
        ImportError
            If llvmlite is not installed (`pip install llvmlite`).

        """
        if not find_spec('llvmlite'):
            raise ImportError('accelerated() needs llvmlite: pip install llvmlite')
        return type(self)(self._design, self._structure, self.dimensions, self.branches, True)

    def solve(self, theta, points: Optional[Sequence[str]] = None) -> dict:
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
            For each joint an array of shape (*theta.shape, 2) [m], NaN where it cannot be
            assembled.

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

    def _placer(self, wanted) -> Callable:
        """Return what places joints at one value of the input, a float."""
        names, pose = self._ready('points', wanted)
        if pose.shape:
            return lambda theta: self._vectors('points', theta, wanted)
        return keep(self._placers, wanted, pose.placer(names))

    def velocity(self, theta, points: Optional[Sequence[str]] = None, by: int = 0) -> dict:
        """
        Differentiate the joints' places by one of the inputs [m/rad, m/m].

        Takes, returns and raises what `solve` does; infinite or NaN at a dead point.
        """
        return self._vectors('velocities', theta, points, by)

    def joint_angles(self, theta, joints: Optional[Sequence[str]] = None) -> dict:
        """
        Return the angle of each moving link to its parent.

        Parameters
        ----------
        theta : float or array-like
            What `solve` takes.
        joints : sequence of str, optional
            The links wanted, by name. Default: all.

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

    def joint_rates(self, theta, joints: Optional[Sequence[str]] = None, by: int = 0) -> dict:
        """Differentiate the joint angles by one of the inputs; see `joint_angles`."""
        return self._scalars('rates', theta, joints, by)

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
        return list(self._remembered('reach', others, lambda: self._arcs(others)))

    def _arcs(self, others):
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
            self._structure.sketch.limits, self._value)]

    def _remembered(self, what: str, about: tuple, find: Callable):
        """Return what was found before, or find it."""
        key = what, *about
        return self._found[key] if key in self._found else keep(self._found, key, find())

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
        wanted = tuple(self._names(kind, _hashable(names))
                       for kind, names in (('points', points), ('angles', joints),
                                           ('rates', rates)))
        return self._bound('parts', wanted).at

    def legs(self, points: Tuple[str, ...], joints: Tuple[str, ...], moving: Tuple[str, ...],
             rows: np.ndarray) -> Batch:
        """
        Return legs like this one on the same inputs, to be solved again and again.

        An accelerated mechanism's are solved by machine code as soon as that is there, without
        waiting for it; the numbers are the same.

        Parameters
        ----------
        points, joints, moving : tuple of str
            The joints whose places, angles and velocities are wanted.
        rows : float array (legs, n)
            Where they go: x, y [m] of each point, joint angles [rad; a slide: m], velocities.

        Returns
        -------
        Batch
            For each leg is given: the value of each input [rad or m], the speed of each input
            [rad/s or m/s], and the numbers of its `Leg`.

        """
        program = self._structure.legs(points, joints, moving)
        return program.bind(self._lengths, self._evaluated, self._accelerate).batch(rows)

    def _vectors(self, kind, theta, points, *by):
        names, pose = self._ready(kind, points, *by)
        values = pose.over(*self._each_input(theta))
        pairs = np.moveaxis(values.reshape(len(names), 2, *values.shape[1:]), 1, -1)
        return dict(zip(names, pairs))

    def _scalars(self, kind, theta, joints, *by):
        names, pose = self._ready(kind, joints, *by)
        return dict(zip(names, pose.over(*self._each_input(theta))))

    def _each_input(self, theta):
        if len(self.inputs) == 1:
            return (numbers('theta', theta),)
        if not hasattr(theta, '__len__') or len(theta) != len(self.inputs):
            raise ValueError(f'{self.type} has {len(self.inputs)} inputs: '
                             'theta must be a sequence of as many values')
        return [numbers('theta', each) for each in theta]

    def _ready(self, kind: str, wanted, *by: int) -> Tuple[Tuple[str, ...], Pose]:
        """Return the names that are wanted and the function that computes them."""
        key = kind, _hashable(wanted), *by
        if key not in self._poses:
            names = self._names(kind, key[1])
            keep(self._poses, key, (names, self._bound(kind, names, *by)))
        return self._poses[key]

    def _bound(self, kind: str, names, *by: int) -> Pose:
        program = self._structure.program(kind, names, *by)
        return program.bind(self._lengths, self._evaluated, self._accelerate)

    def _names(self, kind, wanted) -> Tuple[str, ...]:
        what, allowed = {
            'points': ('point', self.points), 'velocities': ('point', self.points),
            'transmissions': ('transmission angle at', tuple(
                self._structure.sketch.transmissions)),
        }.get(kind, ('joint', self.joints))
        if wanted is None:
            return allowed
        names = (wanted,) if isinstance(wanted, str) else wanted
        for name in names:
            if name not in allowed:
                raise ValueError(f'{self.type} has no {what} {quoted(name)}; '
                                 f'allowed: {listed(allowed)}')
        return names


def _in_own_unit(dimensions: Mapping, fixed: bool) -> dict:
    """Return dimensions counted in a unit that is a power of two, and that unit in metres."""
    longest = max((np.max(np.abs(length)) for length in dimensions.values()), default=1.0)
    if fixed or SMALL < longest < LARGE:
        return {**dimensions, UNIT.args[0]: 1.0}
    unit = 2.0 ** np.frexp(longest)[1]
    return {UNIT.args[0]: unit, **{name: length / unit for name, length in dimensions.items()}}
