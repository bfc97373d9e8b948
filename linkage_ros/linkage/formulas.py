# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Quantities of a linkage as formulas: places, joint angles, rates, limits, closures.

They hold for any dimensions. Code is generated from them for the requested quantities only.
"""

from __future__ import annotations

from functools import cached_property
from itertools import chain, cycle
import re
from typing import Any, Callable, Mapping, NamedTuple

from .geometry.builder import Builder
from .geometry.planar import Arm, Limit, valid_within
from .geometry.spatial import Vector
from .text.design import Design
from ..cache import Cache, cached
from ..formula.expression import (
    arctangent,
    argument,
    Complex,
    derivative,
    dimension,
    Number,
    Real,
    real,
    spin,
    square_root,
    unknown,
    valid_where,
)
from ..formula.program import in_order, Program

Names = tuple[str, ...]
# Outputs of two joints: their distance, and the direction from the first to the second.
PAIR = re.compile(r'(?:distance|angle)\(([A-Za-z]\w*),([A-Za-z]\w*)\)')


class Leg(NamedTuple):
    """
    Parameters of one of several legs.

    Its own crank angle is start + side (angle - lag) [rad]; side is -1 for a mirrored leg, else 1;
    size is a factor of every length.
    """

    lag: Any
    start: Any
    side: Any
    size: Any


class LinkPoint(NamedTuple):
    """A point other than a joint: its link, and its coordinates on the link [m]."""

    link: str
    x: Any
    y: Any


# Joints by name, and points of links.
Points = tuple[str | LinkPoint, ...]


class LinkageFormulas:
    """Formulas of a design with its branches, which all its mechanisms share."""

    def __init__(self, design: Design, branches: Mapping[str, Any]):
        self.built = Builder(dict(design.turned))
        symbols = {name: dimension(name, positive=name not in design.signed)
                   for name in design.dimensions}
        options = {'inputs': design.inputs} if design.inputs else {}
        design.words.draw(self.built, design.lines, symbols, branches, **options)
        self.branches = dict(branches)
        self._programs, self._moving = Cache(), Cache()
        # Derivatives by each input, which several programs need.
        self._derivatives: dict[int, dict[Real, Real]] = {}
        self._outputs: Mapping[str, Callable] = {
            'points': self._points, 'velocities': self._velocities, 'angles': self._angles,
            'rates': self._rates, 'parts': self.parts, 'closures': self._closures,
            # At least 0 where the limit is satisfied.
            'margins': lambda _: [x.margin + x.tolerance for x in self.built.limits],
            'transmissions': lambda names: [self.built.transmissions[name] for name in names],
            'output': self._output, 'checked': self.checked,
            'point accelerations': self._point_accelerations,
            'joint accelerations': self._joint_accelerations}

    @cached_property
    def constants(self) -> list[Real]:
        """Return what any mechanism needs of its dimensions, in an order of evaluation."""
        return in_order([
            *(part for limit in self.built.limits if limit.ends
              for part in (limit.tolerance, *limit.ends[:3])),
            *(amount for _, amount, _ in self.built.demands),
            *(link.zero for link in self.built.links)])

    def program(self, kind: str, names: Any, *by: int) -> Program:
        """Return the code for outputs of one kind, without operations that they do not need."""
        # An acceleration also depends on the inputs' speeds, and on how these change.
        arguments = (3 if kind.endswith('accelerations') else 1) * len(self.built.inputs)
        return self._programs.get_or_make(
            (kind, names, *by), lambda: Program(self._outputs[kind](names, *by), arguments))

    def legs(self, points: Points, joints: Names, moving: Names) -> Program:
        """Return the code for one of several legs; see `Mechanism.legs`."""
        return self._programs.get_or_make(
            (points, joints, moving), lambda: self._legs(points, joints, moving))

    def _points(self, names: Points) -> list[Real]:
        return [part for place in map(self._place, names)
                for part in (place if isinstance(place, Vector) else (place.x, place.y))]

    def _place(self, point: str | LinkPoint) -> Complex | Vector:
        """Return the place of a joint, or of a link's point whose coordinates are dimensions."""
        if isinstance(point, str):
            return self.built.points[point].place
        return self.built.spot(point.link, Complex(*(
            dimension(name, positive=False) for name in point[1:])))

    def _velocities(self, names: Names, by: int = 0) -> list[Real]:
        known: dict[Real, Real] = {}
        return [self._rate_where_valid(derivative(part, {by: 1.0}, known), part)
                for part in self._points(names)]

    def _rate_where_valid(self, rate: Real, value: Real) -> Real:
        """Return a rate by one input, NaN where the value is NaN because of other inputs."""
        alone = len(self.built.inputs) == 1 and rate.value is None
        return rate if alone or not value.varies else valid_where(rate, abs(value))

    def _angles(self, names: Names) -> list[Real]:
        return [self.output(name) for name in names]

    def output(self, name: str) -> Real:
        """Return a joint angle, a slide, or another output by its name."""
        if name in self.built.joint_values:
            return self.built.joint_values[name]
        if (arm := self._arm(name)) is None:
            joint, _, axis = name.rpartition('.')
            return self._points((joint,))[self.built.axes.index(axis)]
        if self.is_angle(name):
            return arctangent(arm.vector.y, arm.vector.x)
        return square_root(arm.square)

    def _arm(self, name: str) -> Arm | None:
        """Return the arm of a distance or an angle; None for another name."""
        pair = PAIR.fullmatch(name)
        return self.built.arm(*pair.groups()) if pair else None

    def parts(self, names: tuple[Names, ...]) -> list[Real]:
        """Return coordinates of points, joint angles, and joint rates by each input."""
        points, joints, rates = names
        rates_by_input = [self._rates(rates, by) for by in range(len(self.built.inputs))]
        return [*self._points(points), *self._angles(joints), *chain.from_iterable(rates_by_input)]

    def checked(self, names: Names) -> list[Real]:
        """Return outputs and their rates by each input, NaN unless all joints are assembled."""
        return [*map(self.where_assembled, self._angles(names)), *self.parts(((), (), names))]

    def where_assembled(self, value: Real) -> Real:
        """Return a value where all joints are assembled, NaN elsewhere."""
        return valid_within(value, [
            limit for limit in self.built.limits if limit.margin.varies])

    def _legs(self, points: Points, joints: Names, moving: Names) -> Program:
        inputs = self.built.inputs
        arguments = [argument(i) for i in range(2 * len(inputs) + len(Leg._fields))]
        values, speeds, leg = (arguments[:len(inputs)], arguments[len(inputs):2 * len(inputs)],
                               Leg(*arguments[2 * len(inputs):]))
        across = leg.side * leg.size
        factors = (across, leg.size, leg.size)[:len(self.built.axes)]
        replaced = {
            old: leg.start + leg.side * (value - leg.lag) if input_.is_angle else value / leg.size
            for old, value, input_ in zip(self.built.arguments, values, inputs)}
        joint_rates = [sum((rate * (speed if input_.is_angle else speed / leg.size)
                            for rate, speed, input_ in zip(rates, speeds, inputs)), real(0.0))
                       for rates in zip(*(self._rates(moving, by) for by in range(len(inputs))))]
        # A mirrored leg's own crank turns backwards, which changes the sign of its rates.
        outputs = [*(part * factor for part, factor in zip(self._points(points),
                                                           cycle(factors))),
                   *(value * (across if self._slides(name) else leg.side)
                     for name, value in zip(joints, self._angles(joints))),
                   *(value * leg.size if self._slides(name) else value
                     for name, value in zip(moving, joint_rates))]
        return Program(outputs, len(arguments), replaced)

    def _slides(self, name: str) -> bool:
        return any(x.name == name and x.kind == 'prismatic' for x in self.built.links)

    def _rates(self, names: Names, by: int = 0) -> list[Real]:
        known = self._derivatives.setdefault(by, {})
        return [self._rate_where_valid(rate, self.output(name))
                for name, rate in zip(names, self._turning(names, {by: 1.0}, known))]

    def _point_accelerations(self, names: Names) -> list[Real]:
        known: dict[Real, Real] = {}
        speeds = self._speeds()
        return self._changing([derivative(part, speeds, known) for part in self._points(names)])

    def _joint_accelerations(self, names: Names) -> list[Real]:
        return self._changing(self._turning(names, self._speeds(), {}))

    def _speeds(self) -> dict[int, Number]:
        n = len(self.built.inputs)
        return {i: argument(n + i) for i in range(n)}

    def _changing(self, rates: list[Real]) -> list[Real]:
        """Differentiate rates by time; speeds are arguments that change, too."""
        n = len(self.built.inputs)
        known: dict[Real, Real] = {}
        moving: dict[int, Number] = {i: argument(n + i) for i in range(2 * n)}
        return [derivative(rate, moving, known) for rate in rates]

    def _turning(self, names: Names, speeds: dict[int, Number], known: dict[Real, Real]
                 ) -> list[Real]:
        """Return the speeds of outputs at speeds of the inputs; `known` are other derivatives."""
        def d(expression: Real) -> Real:
            return derivative(expression, speeds, known)

        def turning(bar: Complex) -> Real:
            rate = spin(bar)
            return rate.formula(*map(d, rate.of))

        def rate(name: str) -> Real:
            # In space a joint turns about its own axis: there is no direction in a plane.
            if not self.is_angle(name) or name in self.built.driven or self.built.axes != 'xy':
                return d(self.output(name))
            if arm := self._arm(name):
                return turning(arm.vector)
            child, parent = (turning(directions[link].vector) if link in directions else real(0.0)
                             for link in (name, parents[name]))
            return child - parent

        directions = self.built.directions
        parents = {link.name: link.parent for link in self.built.links}
        return [rate(name) for name in names]

    @property
    def closures(self) -> list[Limit]:
        """Return quantities that vanish where a dyad, slot, slider or kite stretches or folds."""
        return [limit for limit in (*self.built.limits, *self.built.folds)
                if limit.margin.varies and limit not in self.built.ways]

    def _closures(self, _: Names) -> list[Real]:
        """Return each closure and its rate by the first input."""
        known = self._derivatives.setdefault(0, {})
        return [part for limit in self.closures
                for part in (limit.margin, derivative(limit.margin, {0: 1.0}, known))]

    def _output(self, name: str) -> list[Real]:
        """Return an output, as `input_for` names it, and its rate by the first input."""
        return [self.output(name), *self._rates((name,))]

    def has(self, output: str) -> bool:
        """Return whether there is an output of this name."""
        joint, _, axis = output.rpartition('.')
        pair = PAIR.fullmatch(output) if self.built.axes == 'xy' else None
        ends = pair.groups() if pair else (joint,) if axis in [*self.built.axes] else ()
        return output in self.built.joint_values or bool(ends) and len(set(ends)) == len(
            ends) and set(ends) <= self.built.points.keys()

    def is_angle(self, output: str) -> bool:
        """Return whether an output is an angle, not a length."""
        if output in self.built.joint_values:
            return not self._slides(output)
        return output.startswith('angle(')

    def moves(self, output: str, by: int = 0) -> bool:
        """Return whether there is an output of this name and it depends on one of the inputs."""
        return self._moving.get_or_make((output, by), lambda: self.has(output) and not _vanishes(
            self._rates((output,), by)[0]))


def _vanishes(rate: Real) -> bool:
    """Return whether an expression is zero wherever it has a value."""
    zero: dict[Real, bool] = {}
    some = {'multiply': any, 'add': all, 'subtract': all}
    for x in unknown([rate], lambda x: x.operands, zero):
        parts = [zero[part] for part in x.operands]
        if x.op in some:
            zero[x] = some[x.op](parts)
        elif x.op == 'where':
            zero[x] = parts[1] and parts[2]
        else:
            zero[x] = x.value == 0.0 or x.op in ('valid_where', 'negative', 'divide') and parts[0]
    return zero[rate]


@cached(32, shared=True)
def formulas_of(design: Design, branches: tuple[tuple[str, int], ...]) -> LinkageFormulas:
    """Return the cached formulas of a design with its branches."""
    return LinkageFormulas(design, dict(branches))
