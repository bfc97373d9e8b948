# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The legs that share their inputs.

Pair j of N has its left leg at theta - 2 pi j/N and its right leg, the mirror image x -> -x of a
leg at pi - (theta - 2 pi j/N), on the same crank pin.
"""

from contextlib import suppress
import math
from struct import Struct
from typing import Any, Sequence

import numpy as np

from ..formula.program import Batch, CompiledFunction
from ..linkage import Leg, LinkPoint, Mechanism, sampled

# Even samples of a locus: no corner is seen, unless bars fold flat but for some 1e-5 of them.
LOCUS_SAMPLES = 721


class LegSolution:
    """
    A solver of all legs, and the numbers of its last solution: `values`, or `parts` of them.

    `function` is the result of `Mechanism.legs`. Several legs are solved by machine code, where
    llvmlite works and as soon as the code is compiled; otherwise by plain Python, which
    returns the same bits.

    Attributes
    ----------
    layout : numpy.dtype
        The parts: for each leg a row of coordinates, joint angles and joint velocities; then the
        inputs, their speeds if velocities are requested, and room for their efforts.

    """

    def __init__(self, legs: Sequence[Leg], function: CompiledFunction, inputs: int,
                 sizes: Sequence[int], speeds: int, efforts: int):
        parts = [(part, float, (size,)) for part, size in zip(
            ('coordinates', 'angles', 'rates'), sizes)]
        self.layout = np.dtype([
            ('rows', parts, (len(legs),)), ('inputs', float, (inputs,)),
            ('speeds', float, (speeds,)), ('efforts', float, (efforts,))])
        self.values = np.zeros(self.layout.itemsize // 8)
        self.parts: Any = self.values.view(self.layout)[0]
        self.rows = self.values[:len(legs) * sum(sizes)].reshape(len(legs), -1)
        self._function, self._has_speeds = function.at, speeds > 0
        self._at_rest = inputs * (0.0,)
        # Packing is faster than assignment to an array.
        driven: Any = Struct(f'{inputs + speeds}d')
        solved: Any = Struct(f'{self.rows.size + inputs + speeds}d')
        self._pack_driven, self._pack_solved = driven.pack_into, solved.pack_into
        self._legs = legs
        self._batch: Batch | None = None
        if len(legs) > 1:
            with suppress(ImportError):
                self._batch = function.batch(self.rows)
                self._batch.arguments[2 * inputs:].T[:] = legs

    def solve(self, inputs: Sequence[float], speeds: Sequence[Any] = ()) -> bool:
        """
        Solve at inputs [rad or m] and, for velocities, their speeds [per second].

        Return True if all numbers are finite; if they are huge, it may return False, too.
        """
        driven = (*inputs, *speeds) if self._has_speeds else (*inputs,)
        arguments = driven if self._has_speeds else (*inputs, *self._at_rest)
        if self._batch and self._batch.solve(arguments):
            self._pack_driven(self.values, self.rows.nbytes, *driven)
            # `vdot` overflows without the warning of `dot`.
            return math.isfinite(sum(driven)) and math.isfinite(np.vdot(self.rows, self.rows))
        numbers: list[float] = []
        for leg in self._legs:
            numbers += self._function(*arguments, *leg)
        numbers += driven
        self._pack_solved(self.values, 0, *numbers)
        return math.isfinite(sum(numbers))


class LegGroup:
    """
    The legs of one mechanism.

    Left legs of pairs are evenly spread over a turn of the crank; each has a right leg if
    `mirrored`. Several legs need a single crank. `scale` is a factor of every length. The keys
    of `legs` are the prefixes of their joints' names; `joints` are the moving links except the
    inputs.
    """

    def __init__(self, linkage: Mechanism, leg_pairs: int = 1, mirrored: bool = False,
                 scale: float = 1.0):
        sides = [('left', 0.0, 1.0), ('right', math.pi, -1.0)][:1 + mirrored]
        self.legs = {f'{side}{j}_': Leg(math.tau * j / leg_pairs, start, sign, scale)
                     for j in range(leg_pairs) for side, start, sign in sides}
        if len(self.legs) == 1:
            self.legs = {'': Leg(0.0, 0.0, 1.0, scale)}
        self.linkage = linkage
        first, *others = linkage.inputs
        names = {input_.name for input_ in linkage.inputs}
        self.joints = tuple(name for name in linkage.joints if name not in names)
        # The reach of one of several inputs depends on the others.
        self.reach = [] if others else linkage.reach()
        self.is_limited = not others and not first.is_whole(self.reach)
        self._scale = scale

    def solution(self, points: Sequence[str | LinkPoint] = (), joints: Sequence[str] = (),
                 rates: Sequence[str] | None = None, efforts: int = 0) -> LegSolution:
        """
        Return a solver of all legs for points, joint angles and rates.

        Its values have room for `efforts` efforts.
        """
        inputs, speeds = len(self.linkage.inputs), 0 if rates is None else len(self.linkage.inputs)
        rates = tuple(rates or ())
        sizes = len(self.linkage.axes) * len(points), len(joints), len(rates)
        return LegSolution([*self.legs.values()], self.linkage.legs(
            tuple(points), tuple(joints), rates), inputs, sizes, speeds, efforts)

    def within_reach(self, value: float) -> list[bool]:
        """Return which legs can be assembled at a value [rad or m] of the input, by its reach."""
        first = self.linkage.inputs[0]
        value = value if first.is_angle else value / self._scale
        return [first.on(self.reach, leg.start + leg.side * (value - leg.lag))
                for leg in self.legs.values()]

    def locus(self, name: str) -> np.ndarray:
        """
        Return the curve of a joint of the first leg, over its widest reach [m]: (n, 2).

        With several inputs it is empty.
        """
        if not self.reach:
            return np.empty((0, 2))
        low, high = max(self.reach, key=lambda arc: arc[1] - arc[0])
        places = self.linkage.solve(sampled(low, high, LOCUS_SAMPLES), (name,))[name]
        return self._scale * places[np.isfinite(places).all(axis=1)]
