# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Actuators to joints and joints to actuators, as tables for `linkage.h`.

Both are outputs of the linkage. Positions are converted through the inputs, velocities by the
exact Jacobians, efforts by their transposes, so that power is conserved.
"""

from __future__ import annotations

from itertools import product
import math
from typing import Iterator, Mapping, Sequence

import numpy as np

from . import limits
from .axes import Axis, loads, start
from .code import Code, indented
from .formulas import Formulas
from .names import comment, distinct, filled, template
from .series import series
from ..formula.expression import argument, Real
from ..formula.program import Program
from ..linkage import InverseLinkage
from ..scene import SceneMechanism

# Samples of each part of the reach, for the solutions that are there.
SAMPLES = 256


class Tables:
    """
    Writes the poses, the tables and the solutions of actuators and joints.

    Parameters
    ----------
    mechanism : SceneMechanism
        Its first leg is used.
    code, formulas
        Write its C.

    Attributes
    ----------
    solutions : dict
        The functions for the solutions of inverses: name, most solutions, text.

    """

    def __init__(self, mechanism: SceneMechanism, code: Code, formulas: Formulas):
        self.mechanism, self.linkage, self._code, self._formulas = (
            mechanism, mechanism.linkage, code, formulas)
        self.solutions: dict[tuple, tuple[str, int, str]] = {}

    def text(self, sides: tuple[Sequence[Axis], Sequence[Axis]], tag: str = '',
             passive: Sequence[Axis] = ()) -> str:
        """
        Return the function for a pose, and the table.

        `sides` are the actuators and the commanded joints; an inverse alone has no actuators, and
        a `tag` at the end of its names. `passive` are joints that are not commanded.
        """
        row, rows = self._code.row, (sides[0], [*sides[1], *passive])
        return filled(template('model.h.in'), {
            **self._formulas.names, 'tag': tag,
            'about': 'the inverse' if tag else 'the actuators and joints',
            'n': len(self.mechanism.scales), 'counts': ', '.join(str(len(axes)) for axes in rows),
            'names': ', '.join(map(self._solutions, sides)),
            'at': indented(self._at(rows, len(sides[1]))),
            'axes': row(row((1.0 / axis.size, axis.turn or math.inf)
                            for axis in axes) if axes else '{ { 0, 0 } }'
                        for axes in rows),
            'inputs': row(self._inputs(sides, has_sweeps=not tag)),
            'start': row(start(self.mechanism))})

    def _at(self, sides: tuple[Sequence[Axis], Sequence[Axis]], commanded: int) -> Iterator[str]:
        """Yield the statements for values, rates by each input, and loads."""
        code, formulas, scale_of = self._code, self._formulas, self.mechanism.scale_of
        needed = []
        for side, axes in enumerate(sides):
            for i, axis in enumerate(axes):
                field, factor = formulas.fields[axis.output], axis.factor / scale_of(axis.output)
                position, *rates = [code.times(f'{struct}.{field}', factor)
                                    for struct in ('s', *formulas.by)]
                if axis.offset:
                    position += f' + {code.literal(axis.offset)}'
                middle = limits.middle(self.mechanism, axis) if i < commanded and sides[0] else 0.0
                if axis.wraps or middle:
                    position = (f'lkr_near({position}, {code.literal(middle)}, '
                                f'{code.literal(axis.turn)})')
                yield f'p->position[{side}][{i}] = {position};'
                yield from (f'p->rate[{side}][{i}][{j}] = {rate};' for j, rate in enumerate(rates))
                needed += [f'p->position[{side}][{i}]'] * (i < commanded)
        # An inverse alone needs no efforts.
        for j, by in enumerate(formulas.by if sides[0] else ()):
            terms = [code.times(f'{by}.{formulas.fields[output]}', -load / scale_of(output))
                     for output, load in loads(self.mechanism)]
            yield f'p->load[{j}] = {" + ".join(terms) or code.literal(0.0)};'
        yield f'return isfinite({" + ".join(needed)});'

    # --- tables ---

    def _inputs(self, sides: Sequence[Sequence[Axis]], has_sweeps: bool) -> Iterator[tuple]:
        """Yield the rows of the inputs, as `lkr_input` has them."""
        counted = [{axis.input for axis in axes} for axes in sides]
        for i, settings in enumerate(self.mechanism.inputs.values()):
            input_, sweep = self.linkage.inputs[i], has_sweeps and settings.ends
            turns = [input_.turn if input_.wraps and i not in inputs else math.inf
                     for inputs in counted]
            size = self.mechanism.scales[i] * input_.size
            yield size, 1.0 / size, *(sweep or ('-LKR_ENDLESS', 'LKR_ENDLESS')), turns

    # --- inverses ---

    def _solutions(self, axes: Sequence[Axis]) -> str:
        """Return the name of the function for all inputs of outputs, and note it; 0: none."""
        outputs = tuple(axis.output for axis in axes)
        if not axes:
            return '0'
        # Axes of the same outputs may have other signs and offsets.
        key = tuple((axis.output, axis.factor, axis.offset) for axis in axes)
        if key not in self.solutions:
            name = '_'.join([f'{self.mechanism.name}_solutions', *(
                self._formulas.fields[output] for output in outputs)])
            *_, name = distinct([*(known for known, *_ in self.solutions.values()), name])
            counted = {axis.input: (argument(i) - shift) / ratio
                       for i, axis in enumerate(axes) if axis.input is not None
                       for ratio, shift in [self.linkage.gear(axis.output, axis.input)]}
            if len(counted) == len(axes):
                generated = self._function(name, axes, 'The inputs.', [('', counted)])
            elif closed := self.linkage.inverse(outputs).closed:
                generated = self._closed(name, axes, counted, closed)
            else:
                generated = self._series(name, *axes)
            self.solutions[key] = name, *generated
        return self.solutions[key][0]

    def _value(self, i: int, axis: Axis) -> str:
        """Return the output, in its own units, of an axis at position i."""
        code, literal = f'position[{i}]', self._code.literal
        if axis.offset:
            code = f'({code} - {literal(axis.offset)})'
        return code if axis.factor == 1.0 else f'{code} / {literal(axis.factor)}'

    def _series(self, name: str, axis: Axis) -> tuple[int, str]:
        """Return the most inputs of an output, and the function for them by series."""
        code, monotone = self._code, self.linkage.monotone(axis.output)
        pieces = series(self.linkage, axis.output, monotone, code.single, *self.mechanism.scales)
        rows = [f'    {code.row([*row[:7], row[7:]])},' for row in pieces.tolist()]
        arguments = ', '.join([*(code.literal(value / abs(axis.factor)) for value in (
            axis.size, axis.turn or math.inf)), self._value(0, axis)])
        # Where two pieces of a monotone part meet, both have the input.
        return min(len(rows), 2 * len(monotone)), '\n'.join([
            f'/* The inputs of an output, in each of {len(rows)} pieces of the reach. */',
            f'static inline int {name}(const {code.number} *position,',
            f'    {code.number} (*q)[LKR_MAX_INPUTS])', '{',
            f'    static const lkr_piece piece[{len(rows)}] LKR_IN_FLASH = {{',
            indented(rows), '    };',
            f'    return lkr_series({len(rows)}, piece, {arguments}, q);', '}'])

    def _closed(self, name: str, axes: Sequence[Axis], counted: Mapping[int, Real],
                closed: InverseLinkage) -> tuple[int, str]:
        """Return the number of solutions of an inverse linkage, and the function for them."""
        candidates, solutions = closed.solutions(), []
        for (signs, turns), inputs in zip(
                product(closed.modes, product(*closed.turns)), candidates):
            # If an input has a period of several turns, each turn has its own pose.
            if not any(turns[i] for i in counted):
                sides = ', '.join(f'{joint} {"left" if sign > 0.0 else "right"}'
                                  for joint, sign in zip(closed.branches, signs))
                solutions.append((f'/* {sides} */' if sides and not any(turns) else '', {
                    i: counted.get(i, value) for i, value in enumerate(inputs)}))
        if len(axes) == 1:
            solutions = [solutions[k] for k in self._in_reach(
                axes[0].output, candidates)] or solutions
        lines = ''.join(f'\n     {comment(line)}' for line in closed.lines)
        return self._function(
            name, axes, 'The inputs in each assembly mode of the inverse linkage, NAN where there '
            f'is none:{lines}\n', solutions)

    def _function(self, name: str, axes: Sequence[Axis], about: str,
                  solutions: Sequence[tuple[str, Mapping[int, Real]]]) -> tuple[int, str]:
        """Return the number of solutions, each a line above it and inputs, and the function."""
        number, scales = self._code.number, self.mechanism.scales
        return len(solutions), self._code.function(
            f'/* {about} */\nstatic inline int {name}(const {number} *position,\n'
            f'    {number} (*q)[LKR_MAX_INPUTS])',
            [self._value(i, each) for i, each in enumerate(axes)],
            [(above, {f'q[{k}][{i}]': value * scales[i] for i, value in inputs.items()})
             for k, (above, inputs) in enumerate(solutions)],
            f'return {len(solutions)};')

    def _in_reach(self, output: str, solutions: list[list[Real]]) -> list[int]:
        """Return which solutions of a closed form the linkage has anywhere in its reach."""
        # A solution of one part may go on in another, where it has a dead point of its own.
        steps, linkage = (np.arange(SAMPLES) + 0.382) / SAMPLES, self.linkage
        low, high = linkage.monotone(output).T[:2, :, None]
        inputs = (low + steps * (high - low)).ravel()
        found = linkage.bind(Program([x for x, in solutions])).over(
            *linkage.compiled_pose((), (output,)).over(inputs))
        apart = linkage.inputs[0].distance(found, inputs)
        return sorted({*np.where(np.isfinite(apart), apart, math.inf).argmin(axis=0).tolist()})
