# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A linkage with its dimensions: poses, rates and outputs, and the code that computes them."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import cached_property, reduce
import math
from types import MappingProxyType
from typing import Any, Callable, Mapping, Sequence, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .formulas import formulas_of, LinkPoint, Points
from .geometry.spatial import IN_SINGLE
from .inputs import Input, MAX_DENOMINATOR, MAX_GEAR_RATIO, MAX_PERIOD, PART, spread
from .text import joint_lines
from .text.arguments import checked_branches, checked_dimensions, numbers
from .text.design import Design
from .tolerances import SINGULAR
from ..cache import Cache
from ..formula.expression import derivative, Real, real
from ..formula.namespace import array_function
from ..formula.program import CompiledFunction, evaluate, evaluate_in_order, Program
from ..optional import needs
from ..words import did_you_mean, join_names, n_inputs, plain_text, short_repr, suggestion

# Quantities of joints; all others are of links.
OF_POINTS = 'points', 'velocities', 'point accelerations'
# Poses that are compared with those a period later. One more is a prime: of a range of whole turns
# each is at another angle.
COMPARED = 66

Same = TypeVar('Same', bound='Kinematics')
# One input, or a sequence of several; each a number or an array [rad or m].
Inputs = ArrayLike | Sequence[ArrayLike]
Names = Sequence[str] | None


def _hashable(names: Any) -> Any:
    """Return names as a tuple, but None or one name unchanged; raise ValueError if invalid."""
    try:
        names = names if names is None or isinstance(names, (str, tuple)) else tuple(names)
        hash(names)
        return names
    except TypeError:
        raise ValueError('points and joints must be a name or a list of names, '
                         f'got {short_repr(names)}') from None


class Kinematics:
    """What all else of a linkage builds on; `Mechanism` lists its attributes."""

    def __init__(self, design: Design, dimensions: Mapping, branches: Mapping[str, int],
                 accelerate: bool = False):
        self.type, self.design, self.tracer = design.name, design, design.tracer
        # Others may have the same linkage, and its constants are computed once.
        self.dimensions, self.branches = map(MappingProxyType, (dict(dimensions), dict(branches)))
        # Of arrays of dimensions, and so of all results.
        self.shape = np.broadcast_shapes(*map(np.shape, self.dimensions.values()))
        self.is_accelerated = accelerate
        # Equal linkages share it, including unpickled ones.
        self.formulas = formulas_of(design, tuple(self.branches.items()))
        built = self.formulas.built
        self.points, self.joints = tuple(built.points), tuple(built.joint_values)
        self.grounded, self.axes = built.grounded, built.axes
        self.bars = tuple((bar.first, bar.second) for bar in built.bars)
        self.cylinders, self.yokes = tuple(built.cylinders), MappingProxyType(built.yokes)
        self._evaluated: dict = {}
        evaluate_in_order(self.formulas.constants, self.dimensions, self._evaluated)
        self._poses, self.cache = Cache(), Cache()
        self.inputs = tuple(map(self._with_limits, range(len(built.inputs)), built.inputs))
        input_names = {input_.name for input_ in self.inputs}
        self.geared = tuple(name for name in built.driven if name not in input_names)
        self.links = tuple(link._replace(zero=np.asarray(self.value(link.zero)).tolist())
                           for link in built.links)

    def __reduce__(self) -> tuple:
        values = dict(self.dimensions), dict(self.branches)
        return type(self), (self.design, *values, self.is_accelerated)

    def __repr__(self) -> str:
        lengths = ', '.join(f'{k}={v}' for k, v in self.dimensions.items())
        return f'<{self.type} {lengths}>'

    # --- its dimensions ---

    @cached_property
    def bar_lengths(self) -> Mapping:
        """Return the length [m] of each bar."""
        return MappingProxyType({(bar.first, bar.second): self._number(bar.length)
                                 for bar in self.formulas.built.bars})

    @cached_property
    def frames(self) -> Mapping:
        """Coordinates of each link's joints [m] in the link's frame, x along its bar."""
        return MappingProxyType({
            link: MappingProxyType({name: tuple(map(self._number, (place.x, place.y)))
                                    for name, place in frame.items()})
            for link, frame in self.formulas.built.frames.items()})

    @property
    def longest(self) -> Any:
        """Return the longest bar [m], or without bars the longest stroke of an input."""
        longest = reduce(np.maximum, self.bar_lengths.values() or [
            input_.high - input_.low for input_ in self.inputs])
        return longest if self.shape else float(longest)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Return the outputs that are coordinates of joints, such as 'A.x'."""
        return tuple(f'{name}.{axis}' for name in self.points for axis in self.axes)

    def line_of(self, *joints: str) -> joint_lines.Line:
        """Return the last line that places one of some joints."""
        return [line for line in self.design.lines if set(joints) & set(line.names)][-1]

    def constants(self, expressions: Any) -> Any:
        """Return tuples of expressions of dimensions as tuples of their values."""
        if isinstance(expressions, Real):
            return self.value(expressions)
        if not isinstance(expressions, tuple):
            return expressions
        return getattr(expressions, '_make', tuple)(map(self.constants, expressions))

    def windows(self) -> list:
        """Return the links on two hinges in a row with two rods, and their limits."""
        return [self.constants(window) for window in self.formulas.built.windows]

    def value(self, length: Real) -> Any:
        """Return the value of an expression of dimensions alone."""
        if length not in self._evaluated:
            evaluate(length, self.dimensions, self._evaluated)
        return self._evaluated[length]

    def _number(self, length: Real) -> Any:
        """Return the value of an expression of dimensions alone: a float, or an array."""
        value = self.value(real(length))
        return value if np.ndim(value) else float(value)

    def check(self) -> None:
        """Raise ValueError, with the joint line, if its dimensions are not allowed."""
        if self.design.is_written:
            joint_lines.check_numbers(self.design, self.dimensions)
        for line, amount, problem in self.formulas.built.demands:
            size = self.value(amount)
            # A triangle that does not exist is NaN; a type of the catalogue then has no pose.
            allowed = (size > 0.0) & (size < math.inf) | (
                np.isnan(size) & (not self.design.is_written))
            if not allowed.all():
                raise line.error(problem)
        for window in self.windows():
            window.check()
        for by, input_ in enumerate(self.inputs):
            for name in self.geared if input_.speed > MAX_GEAR_RATIO else ():
                if (ratio := np.max(np.abs(self.gear(name, by)[0]))) > MAX_GEAR_RATIO:
                    raise ValueError(f'{self.type}: {name} turns {ratio:g} times as fast as '
                                     f'the {input_.name}; allowed: {MAX_GEAR_RATIO} times')

    def with_dimensions(self: Same, /, **changed: ArrayLike) -> Same:
        """Return a copy with other dimensions [m]; raises ValueError as `create` does."""
        made = type(self)(
            self.design, checked_dimensions(self.design, {**self.dimensions, **changed}),
            self.branches, self.is_accelerated)
        made.check()
        return made

    def driven_by(self: Same, *outputs: str, branches: Mapping[str, int] | None = None) -> Same:
        """
        Return a linkage in space with other joints as its inputs.

        `outputs` are as many joints as it has inputs, which they replace; `branches` is the side
        of the crank for each rod, 1 as drawn or -1, by default its own. Raises ValueError if a
        joint or rod does not exist, or the linkage cannot be solved from these.
        """
        unknown = [x for x in outputs if not isinstance(x, str) or x not in self.joints]
        if self.axes != 'xyz' or unknown or len({*outputs}) != len(self.inputs):
            allowed = self.joints if self.axes == 'xyz' else ('none in a plane',)
            raise ValueError(f'{self.type} can be driven by {len(self.inputs)} of '
                             f'{join_names(allowed)}, not by {short_repr(list(outputs))}')
        sides = checked_branches(self.design, branches, self.branches)
        made = self.cache.get_or_make(('driven by', outputs, *sides.values()), lambda: type(self)(
            replace(self.design, inputs=outputs), self.dimensions, sides, self.is_accelerated))
        made.check()
        return made

    def turned(self: Same, *turns: float) -> Same:
        """
        Return the same linkage, each input counted from so many whole turns on.

        Gears make it another one, and so does an odd number for an input that passes one change
        point a turn. Of an input whose period is very long, reach, dead points and
        inverse are those of the turns around zero, and so of any others.
        """
        counts = tuple((input_.name, float(count)) for input_, count in zip(self.inputs, turns))
        return self.cache.get_or_make(('turned', counts), lambda: type(self)(
            replace(self.design, turned=counts), self.dimensions, self.branches,
            self.is_accelerated))

    def accelerated(self: Same) -> Same:
        """
        Return a copy that solves arrays by compiled code, large ones on all cores.

        The first call for a set of points compiles for about 0.1 s. Sine, cosine and arctangent
        are its own and satisfy the rule for errors. A pose is the same in any array, on any number
        of cores, but its last digits may differ from those of a single pose. Raises ImportError
        without an llvmlite that works.
        """
        with needs('llvmlite'):
            from ..formula import llvm_code  # noqa: F401
        return self.cache.get_or_make('accelerated', lambda: type(self)(
            self.design, self.dimensions, self.branches, True))

    def period(self, by: int = 0) -> float:
        """
        Return the number of turns of an input after which the pose repeats: `inputs[by].period`.

        It is above one if the input drives cranks by fractional gears, or if it passes one change
        point per turn, and infinite if a gear ratio is no fraction with a denominator up to a
        million. With arrays of dimensions, change points are ignored.
        """
        return self.inputs[self._checked_by(by)].period

    def _ratios(self, by: int) -> list[float]:
        """Return the turns of each driven link per turn of an input."""
        rates = [np.ravel(self.value(derivative(value, {by: 1.0}, {})))
                 for _, value in self.formulas.built.driven.values()]
        return [float(ratio) for rate in rates for ratio in rate if math.isfinite(ratio)]

    def _period(self, by: int, ratios: Sequence[float], limit: float) -> float:
        fractions = [Fraction(ratio).limit_denominator(MAX_DENOMINATOR) for ratio in ratios]
        if any(abs(float(fraction) - ratio) > 4.0 * math.ulp(ratio)
               for fraction, ratio in zip(fractions, ratios)):
            return math.inf
        turns = math.lcm(*(fraction.denominator for fraction in fractions))
        if turns > limit or not self._passes_change_point(by) or self.repeats(
                by, turns, 'angles', self.coordinates, math.pi * turns):
            return turns
        return 2 * turns

    def _passes_change_point(self, by: int) -> bool:
        """Return whether a dyad of a crank has a margin of nothing but rounding."""
        margins = [(limit.tolerance, *limit.ends[:2]) for limit in self.formulas.built.limits
                   if limit.ends and limit.ends.theta.args[0] == by]
        values = [tuple(map(self.value, margin)) for margin in margins]
        return not self.shape and any(min(abs(start), abs(end)) <= tolerance
                                      for tolerance, start, end in values)

    def repeats(self, by: int, turns: float, kind: str, outputs: tuple[str, ...], high: float,
                middles: ArrayLike = ()) -> bool:
        """
        Return whether outputs are the same so many turns of an input later, from -high to high.

        They are asked in the `middles` of arcs and gaps, too: samples alone miss narrow ones.
        """
        now = np.append(high * np.linspace(-1.0, 1.0, COMPARED + 2)[1:-1], middles)
        later = now + math.tau * turns
        inputs = spread([self._with_stroke(x) for x in self.formulas.built.inputs], len(now))
        pose, rows = self.compiled(kind, outputs), []
        for inputs[by] in (now, later):
            # As directions: angles are the same up to whole turns.
            rows.append(np.exp([1j * row / (1.0 if self.is_angle(name) else self.longest)
                                for name, row in zip(outputs, pose.searched(*inputs))]))
        return np.allclose(rows[1], rows[0], 0.0, SINGULAR, equal_nan=True)

    def _with_limits(self, by: int, input_: Input) -> Input:
        """Return an input with the limits [rad or m] of all poses."""
        if not input_.is_angle:
            return self._with_stroke(input_)
        ratios = self._ratios(by)
        input_ = input_._replace(speed=max(1.0, *map(abs, ratios)))
        limit, part = (input_.step * turns ** (1.0 / len(self.formulas.built.inputs))
                       for turns in (MAX_PERIOD, PART))
        period = self._period(by, ratios, limit)
        # After an odd number of turns a branch is another one past a change point; half of a part,
        # the distance of two, is an even number.
        turns = period if period <= max(limit, 1.0) else max(4.0, 4.0 * round(0.25 * part))
        return input_._replace(low=-math.pi * turns, high=math.pi * turns, period=period)

    def _with_stroke(self, input_: Input) -> Input:
        """Return an input with its stroke [m]; an angle is unchanged."""
        return input_ if input_.is_angle else input_._replace(
            low=self._number(input_.low), high=self._number(input_.high))

    # --- poses and how they change ---

    def solve(self, theta: Inputs, points: Names = None) -> dict:
        """Return the coordinates of each joint [m]: theta's shape and a last axis for x and y."""
        if isinstance(theta, float) and len(self.inputs) == 1:
            names, pose = self._ready('points', points)
            if not pose.shape:
                return dict(zip(names, np.reshape(pose.at(theta), (-1, len(self.axes)))))
        return self._vectors('points', theta, points)

    def velocity(self, theta: Inputs, points: Names = None, by: int = 0) -> dict:
        """Differentiate `solve` by an input [m/rad, m/m]; infinite or NaN at a dead point."""
        return self._vectors('velocities', theta, points, self._checked_by(by))

    def acceleration(self, theta: Inputs, rate: Inputs, rate_rate: Inputs,
                     points: Names = None) -> dict:
        """
        Return the acceleration of each joint [m/s^2], in the form of `solve`.

        `rate` and `rate_rate` are the first and second time derivatives of each input, with shapes
        that broadcast with theta's. Infinite or NaN at a dead point.
        """
        names, pose = self._ready('point accelerations', points)
        return self._by_point(names, pose.over(*self._motion(theta, rate, rate_rate)))

    def joint_angles(self, theta: Inputs, joints: Names = None) -> dict:
        """
        Return the angle of each moving link to its parent, or other outputs; see `has_output`.

        Angles [rad] are in (-pi, pi], relative to the link's `zero`; inputs are unchanged, slides
        in m.
        """
        return self._scalars('angles', theta, joints)

    def joint_rates(self, theta: Inputs, joints: Names = None, by: int = 0) -> dict:
        """Differentiate the joint angles by one of the inputs; see `joint_angles`."""
        return self._scalars('rates', theta, joints, self._checked_by(by))

    def joint_accelerations(self, theta: Inputs, rate: Inputs, rate_rate: Inputs,
                            joints: Names = None) -> dict:
        """Return the joints' accelerations [rad/s^2 or m/s^2]; see `acceleration`."""
        names, pose = self._ready('joint accelerations', joints)
        return dict(zip(names, pose.over(*self._motion(theta, rate, rate_rate))))

    def _motion(self, *derivatives: Inputs) -> Sequence[np.ndarray]:
        return [values for name, inputs in zip(('theta', 'rate', 'rate_rate'), derivatives)
                for values in self.each_input(inputs, name)]

    def transmission_angles(self, theta: Inputs, joints: Names = None) -> dict:
        """
        Return the transmission angle of each joint [rad] in [0, pi]; the best is pi/2.

        The joints are the first ones of dyad, cylinder, mirror, parallelogram, antiparallelogram,
        inversor, slot and slider lines; 0 and pi are dead points. For a dyad it is the angle
        between its bars (a cylinder is a bar); for a slider between its rod and the normal of its
        line; for a slot between its line and the normal of the radius from pivot to pin. Sources:
        Norton, "Design of Machinery", sec. 3.3; Balli and Chand, "Transmission angle in
        mechanisms", Mechanism and Machine Theory 37 (2002).
        """
        return self._scalars('transmissions', theta, joints)

    def function(self, points: Names = None, joints: Sequence[str] = (),
                 rates: Sequence[str] = (), xp: Any = None) -> Callable:
        """
        Return the fastest function for single poses, or one for arrays of another package.

        Its arguments are the inputs, floats. It returns a tuple of floats: x, y of each point,
        then the joint angles, then the joint rates by each input.

        `xp` is a package with Python's array API, such as torch or jax.numpy: then inputs are its
        arrays, float64 or float32, which broadcast, and so are the results, with dtype and device
        of the inputs. The package's own differentiation, vectorization and compilation apply.
        Where a pose cannot be assembled, values are NaN and their gradients finite.
        """
        if self.shape:
            raise ValueError('a function is for one set of dimensions, not for arrays')
        if xp is None:
            return self.compiled_pose(points, joints, rates).at
        outputs = self.formulas.parts(self._requested(points, joints, rates))
        return array_function(outputs, len(self.inputs), xp, self.dimensions, IN_SINGLE)

    def compiled_pose(self, points: Names = None, joints: Sequence[str] = (),
                      rates: Sequence[str] = ()) -> CompiledFunction:
        """Return the code behind `function`."""
        return self.compiled('parts', self._requested(points, joints, rates))

    def _requested(self, *names: Any) -> tuple[tuple[str, ...], ...]:
        """Return names of points, joints and rates."""
        return tuple(self._names(kind, _hashable(requested))
                     for kind, requested in zip(('points', 'angles', 'rates'), names))

    def legs(self, points: Points, joints: tuple[str, ...], moving: tuple[str, ...]
             ) -> CompiledFunction:
        """
        Return the function that solves a leg like this one.

        Its arguments are floats: the value of each input [rad or m], its speed [rad/s or m/s], and
        the numbers of the `Leg`. It returns x, y of each point (a joint, or a `LinkPoint` on a
        link), the angles of `joints` [rad; a slide: m], and the velocities of the links in
        `moving`.
        """
        _, joints, moving = self._requested(
            [point for point in points if not isinstance(point, LinkPoint)], joints, moving)
        named = tuple(LinkPoint(point.link, f'[x{i}]', f'[y{i}]')
                      if isinstance(point, LinkPoint) else point for i, point in enumerate(points))
        places = {name: value for point, names in zip(points, named)
                  if isinstance(point, LinkPoint) for name, value in zip(names[1:], point[1:])}
        return self.cache.get_or_make(('legs', points, joints, moving), lambda: (
            self.formulas.legs(named, joints, moving).bind(
                {**self.dimensions, **places}, dict(self._evaluated), self.is_accelerated)))

    # --- outputs ---

    def has_output(self, name: Any) -> bool:
        """
        Return whether there is an output of this name.

        Outputs are a link's name, for its joint angle [rad] or slide [m]; a joint's coordinate
        such as 'C.x' [m]; and, in a plane, 'distance(A,C)' [m] of two joints and 'angle(A,C)'
        [rad] from +x to A -> C.
        """
        return isinstance(name, str) and self.formulas.has(name)

    def is_angle(self, output: str) -> bool:
        """Return whether an output is an angle [rad], not a length [m]."""
        self.check_there(output)
        return self.formulas.is_angle(output)

    def moves(self, output: str, by: int = 0) -> bool:
        """Return whether an output depends on one of the inputs."""
        return isinstance(output, str) and self.formulas.moves(output, self._checked_by(by))

    def check_output(self, output: str) -> None:
        """Raise ValueError if an output does not exist or does not move."""
        if not isinstance(output, str) or not self.moves(output):
            self.check_there(output)
            raise ValueError(f'{plain_text(output)} of {self.type} does not move with the '
                             f'{self.inputs[0].name}')

    def check_there(self, output: str) -> None:
        """Raise ValueError if an output does not exist."""
        if not self.has_output(output):
            named = (*self.joints, *self.coordinates)
            xy = [x for x in self.coordinates if isinstance(output, str) and output == x[:-2]]
            pairs = 'distance(A,B) and angle(A,B) of two joints, ' * (self.axes == 'xy')
            raise ValueError(
                f'{self.type} has no output {short_repr(output)}; allowed: {pairs}'
                + join_names(named) + (
                    f'; did you mean {join_names(xy)}?' if xy else did_you_mean(output, named)))

    def gear(self, name: str, by: int = 0) -> tuple[float, float]:
        """Return ratio and offset [rad or m] by which an input drives a link, anywhere."""
        _, value = self.formulas.built.driven[name]
        program = Program([derivative(value, {by: 1.0}, {}), value], len(self.inputs))
        ratio, offset = self.bind(program).at(*[0.0] * len(self.inputs))
        return ratio, offset

    def geared_to(self, by: int) -> list[str]:
        """Return the links that one of the inputs drives by gears."""
        return [name for name in self.geared if self.moves(name, by)]

    # --- its code ---

    def bind(self, program: Program) -> CompiledFunction:
        """Return a program of its formulas as a function of its arguments."""
        # A copy, since what a program needs beside the constants goes with the program.
        return program.bind(self.dimensions, dict(self._evaluated), self.is_accelerated)

    def compiled(self, kind: str, names: Any, *by: int) -> CompiledFunction:
        """Return the code for quantities of one kind; see `LinkageFormulas.program`."""
        return self.bind(self.formulas.program(kind, names, *by))

    def _vectors(self, kind: str, theta: Inputs, points: Any, *by: int) -> dict:
        names, pose = self._ready(kind, points, *by)
        return self._by_point(names, pose.over(*self.each_input(theta)))

    def _by_point(self, names: Sequence[str], values: np.ndarray) -> dict:
        """Return coordinates (coordinates of all names, *shape) as {name: (*shape, axes)}."""
        places = values.reshape(len(names), len(self.axes), *values.shape[1:])
        return dict(zip(names, np.moveaxis(places, 1, -1)))

    def _scalars(self, kind: str, theta: Inputs, joints: Any, *by: int) -> dict:
        names, pose = self._ready(kind, joints, *by)
        return dict(zip(names, pose.over(*self.each_input(theta))))

    def each_input(self, theta: Any, name: str = 'theta') -> Sequence[np.ndarray]:
        """Return each input's values as an array; raise ValueError if they are not numbers."""
        if len(self.inputs) == 1:
            return (numbers(name, theta),)
        if not hasattr(theta, '__len__') or len(theta) != len(self.inputs):
            raise ValueError(f'{self.type} has {n_inputs(len(self.inputs))}: '
                             f'{name} must be a sequence of as many values')
        return [numbers(name, values) for values in theta]

    def _checked_by(self, by: Any) -> int:
        """Return the index of an input; raise ValueError if it is invalid."""
        if isinstance(by, (bool, np.bool_, np.ndarray)) or not hasattr(by, '__index__') \
                or not 0 <= by.__index__() < len(self.inputs):
            raise ValueError(f'by must be the number of an input, from 0 to '
                             f'{len(self.inputs) - 1}, got {short_repr(by)}')
        return int(by)

    def _ready(self, kind: str, requested: Any, *by: int
               ) -> tuple[tuple[str, ...], CompiledFunction]:
        """Return the requested names and the function that computes them."""
        def make() -> tuple[tuple[str, ...], CompiledFunction]:
            names = self._names(kind, requested)
            return names, self.compiled(kind, names, *by)

        requested = _hashable(requested)
        return self._poses.get_or_make((kind, requested, *by), make)

    def _names(self, kind: str, requested: Any) -> tuple[str, ...]:
        what, allowed = ('point', self.points) if kind in OF_POINTS else ('joint', self.joints)
        if kind == 'transmissions':
            what, allowed = 'transmission angle at', tuple(self.formulas.built.transmissions)
        if requested is None:
            return allowed
        # A subclass of str may print, or change, in its own way.
        names = tuple(map(plain_text, (requested,) if isinstance(requested, str) else requested))
        for name in names:
            if name not in allowed and not (what == 'joint' and self.has_output(name)):
                raise ValueError(f'{self.type} has no {what} {short_repr(name)}'
                                 f'{suggestion(name, allowed)}')
        return names
