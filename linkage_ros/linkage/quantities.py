# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What can be asked of a linkage, as formulas: places, joint angles, rates, limits, closures.

They hold for any dimensions; from them comes the code, with nothing in it that is not asked for.
"""

from __future__ import annotations

from itertools import chain, cycle
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Tuple

from . import joint_lines
from .builder import Builder, in_metres, Link
from .design import Design
from .planar import Limit
from ..formula.expression import argument, derivative, gated, Real, real, spin
from ..formula.program import keep, Program

Names = Tuple[str, ...]


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
        self.built = Builder()
        joint_lines.draw(self.built, design.lines, joint_lines.symbols_of(
            design.dimensions, design.signed), branches)
        self.branches = dict(branches)
        self._programs: Dict[tuple, Program] = {}
        self._outputs: Mapping[str, Callable] = {
            'points': self._points, 'velocities': self._velocities, 'angles': self._angles,
            'rates': self._rates, 'parts': self._parts, 'margins': self._margins,
            'transmissions': self._transmissions, 'closures': self._closures,
            'output': self._output}

    def program(self, kind: str, names: Any, *by: int) -> Program:
        """Return the code for outputs of one kind; what they do not depend on is left out."""
        key = (kind, names, *by)
        if key not in self._programs:
            outputs = self._outputs[kind](names, *by)
            keep(self._programs, key, Program(outputs, len(self.built.inputs)))
        return self._programs[key]

    def legs(self, points: Names, joints: Names, moving: Names) -> Program:
        """Return the code for a leg of several; see `Mechanism.legs`."""
        key = points, joints, moving
        if key not in self._programs:
            keep(self._programs, key, self._legs(points, joints, moving))
        return self._programs[key]

    def _points(self, names: Names) -> List[Real]:
        places = [self.built.points[n].place for n in names]
        return [in_metres(part) for place in places for part in (place.x, place.y)]

    def _velocities(self, names: Names, by: int = 0) -> List[Real]:
        known: Dict[Real, Real] = {}
        return [self._due(derivative(part, {by: 1.0}, known), part)
                for part in self._points(names)]

    def _due(self, rate: Real, value: Real) -> Real:
        """Return a rate by one input, NaN where other inputs leave no value to have it."""
        alone = len(self.built.inputs) == 1 and rate.value is None
        return rate if alone or not value.varies else gated(rate, abs(value), real(0.0))

    def _angles(self, names: Names) -> List[Real]:
        values = self.built.joint_values
        return [in_metres(values[n]) if self._slides(n) else values[n] for n in names]

    def _parts(self, wanted: Tuple[Names, Names, Names]) -> List[Real]:
        points, joints, rates = wanted
        turning = [self._rates(rates, by) for by in range(len(self.built.inputs))]
        return [*self._points(points), *self._angles(joints), *chain.from_iterable(turning)]

    def _legs(self, points: Names, joints: Names, moving: Names) -> Program:
        inputs = self.built.inputs
        given = [argument(i) for i in range(2 * len(inputs) + len(Leg._fields))]
        values, speeds, leg = (given[:len(inputs)], given[len(inputs):2 * len(inputs)],
                               Leg(*given[2 * len(inputs):]))
        across = leg.side * leg.size
        own = {own: leg.start + leg.side * (value - leg.lag) if input_.turns else value / leg.size
               for own, value, input_ in zip(self.built.arguments, values, inputs)}
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

    def _slides(self, name: str) -> bool:
        return any(x.name == name and x.kind == 'prismatic' for x in self.built.links)

    def _rates(self, names: Names, by: int = 0) -> List[Real]:
        known: Dict[Real, Real] = {}
        inputs = {x.name for x in self.built.inputs}

        def d(expression: Real) -> Real:
            return derivative(expression, {by: 1.0}, known)

        def turning(name: str) -> Real:
            bar = self.built.directions.get(name)
            if bar is None:
                return real(0.0)
            turned = spin(bar)
            return turned.formula(*map(d, turned.of))

        def rate(link: Link) -> Real:
            if link.kind == 'prismatic' or link.name in inputs:
                return d(self._angles((link.name,))[0])
            return turning(link.name) - turning(link.parent)

        links = {link.name: link for link in self.built.links}
        return [self._due(rate(links[n]), self.built.joint_values[n]) for n in names]

    def _margins(self, _: Names) -> List[Real]:
        """Return each limit's margin, so much above its tolerance that a reached one is >= 0."""
        return [limit.margin + limit.tolerance for limit in self.built.limits]

    def _transmissions(self, names: Names) -> List[Real]:
        return [self.built.transmissions[n] for n in names]

    @property
    def closures(self) -> List[Limit]:
        """What vanishes where a dyad, a slot, a slider or a kite stretches or folds."""
        return [limit for limit in (*self.built.limits, *self.built.folds)
                if limit.margin.varies]

    def _closures(self, _: Names) -> List[Real]:
        """Return each closure and its rate by the first input."""
        known: Dict[Real, Real] = {}
        return [part for limit in self.closures
                for part in (limit.margin, derivative(limit.margin, {0: 1.0}, known))]

    def _output(self, name: str) -> List[Real]:
        """Return an output, as `input_for` names it, and its rate by the first input."""
        joint, _, axis = name.rpartition('.')
        if not joint:
            return self._angles((name,)) + self._rates((name,))
        i = 'xy'.index(axis)
        return [self._points((joint,))[i], self._velocities((joint,))[i]]

    def turns(self, output: str) -> bool:
        """Return whether an output is an angle, not a length."""
        return '.' not in output and not self._slides(output)

    def moves(self, output: str) -> bool:
        """Return whether an output depends on the first input."""
        rate = self._output(output)[1]
        bare: Real = rate.args[0] if rate.op == 'gated' else rate
        return bare.value != 0.0
