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
        self.solutions: dict[tuple[str, ...], tuple[str, int, str]] = {}

    def text(self, name: str, about: str, sides: tuple[Sequence[Axis], Sequence[Axis]],
             passive: Sequence[Axis] = ()) -> str:
        """
        Return the function for a pose, and the table of a name, with a line about it.

        `sides` are the actuators and the commanded joints; an inverse alone has no actuators.
        `passive` are joints that are not commanded.
        """
        row, rows, n = self._code.row, (sides[0], [*sides[1], *passive]), len(sides[1])
        solutions = ', '.join(map(self._solutions, sides))
        return filled(template('model.h.in'), {
            'name': self.mechanism.name, 'model': name, 'about': comment(about), 'n': n,
            'counts': ', '.join(str(len(axes)) for axes in rows), 'solutions': solutions,
            'inputs': ', '.join(f'p->q[{i}]' for i in range(n)),
            'values': indented(self._values(rows)),
            'sum': ' + '.join(f'p->position[{side}][{i}]' for side, axes in enumerate(sides)
                              for i in range(len(axes))),
            'axes': row(row((1.0 / x.factor, x.offset, 1.0 / x.size, x.turn or math.inf)
                            for x in axes) if axes else '{ { 0, 0, 0, 0 } }' for axes in rows),
            'rows': row(self._inputs(sides)),
            'start': row(start(self.mechanism))})

    def _values(self, sides: Sequence[Sequence[Axis]]) -> Iterator[str]:
        """Yield the statements for positions, rates by each input, and loads."""
        code, fields, scale_of = self._code, self._formulas.fields, self.mechanism.scale_of
        inputs = range(len(self.mechanism.scales))
        for side, axes in enumerate(sides):
            for i, axis in enumerate(axes):
                field, factor = fields[axis.output], axis.factor / scale_of(axis.output)
                position = code.times(f's.{field}', factor)
                if axis.offset:
                    position += f' + {code.literal(axis.offset)}'
                middle = sides[0] and i in inputs and limits.middle(self.mechanism, axis) or 0.0
                if axis.wraps or middle:
                    position = f'lkr_wrapped({position}, {code.literal(middle)}, ' \
                               f'{code.literal(axis.turn)})'
                yield f'p->position[{side}][{i}] = {position};'
                for j in inputs:
                    yield f'p->rate[{side}][{i}][{j}] = {code.times(f"by[{j}].{field}", factor)};'
        # An inverse alone needs no efforts.
        for j in inputs if sides[0] else ():
            terms = [code.times(f'by[{j}].{fields[output]}', -load / scale_of(output))
                     for output, load in loads(self.mechanism)]
            yield f'p->load[{j}] = {" + ".join(terms) or code.literal(0.0)};'

    # --- tables ---

    def _inputs(self, sides: Sequence[Sequence[Axis]]) -> Iterator[tuple]:
        """Yield the rows of the inputs, as `lkr_input` has them."""
        indices = [{axis.input for axis in axes} for axes in sides]
        for i, settings in enumerate(self.mechanism.inputs.values()):
            input_, sweep = self.linkage.inputs[i], sides[0] and settings.ends
            turns = [input_.turn if input_.wraps and i not in inputs else math.inf
                     for inputs in indices]
            size = self.mechanism.scales[i] * input_.size
            yield size, 1.0 / size, *(sweep or ('-LKR_UNLIMITED', 'LKR_UNLIMITED')), turns

    # --- inverses ---

    def _solutions(self, axes: Sequence[Axis]) -> str:
        """Return the name of the function for all inputs of outputs, and note it; 0: none."""
        outputs = tuple(axis.output for axis in axes)
        if not axes:
            return '0'
        if outputs not in self.solutions:
            name = '_'.join([f'{self.mechanism.name}_solutions', *(
                self._formulas.fields[output] for output in outputs)])
            *_, name = distinct([*(other for other, *_ in self.solutions.values()), name])
            head = (f'static inline int {name}(const lkr_real *value,\n'
                    '    lkr_real (*q)[LKR_MAX_INPUTS])')
            known_inputs = {axis.input: (argument(i) - shift) / ratio
                            for i, axis in enumerate(axes) if axis.input is not None
                            for ratio, shift in [self.linkage.gear(axis.output, axis.input)]}
            if len(known_inputs) == len(axes):
                made = self._function(f'/* The inputs. */\n{head}', [('', known_inputs)])
            elif closed := self.linkage.inverse(outputs).closed:
                made = self._closed(head, outputs, known_inputs, closed)
            else:
                made = self._series(head, outputs[0])
            self.solutions[outputs] = name, *made
        return self.solutions[outputs][0]

    def _series(self, head: str, output: str) -> tuple[int, str]:
        """Return the most inputs of an output, and the function for them by series."""
        row, linkage = self._code.row, self.linkage
        monotone = linkage.monotone(output)
        pieces = series(linkage, output, monotone, self._code.single, *self.mechanism.scales)
        is_angle, n = linkage.is_angle(output), len(pieces)
        return min(n, 2 * len(monotone)), '\n'.join([
            # Where two pieces of a monotone part meet, both have the input.
            f'/* The inputs of an output, in each of {n} pieces of the reach. */',
            head, '{', f'    static const lkr_piece piece[{n}] LKR_IN_FLASH = {{',
            indented(f'    {row([*x[:7], x[7:]])},' for x in pieces.tolist()), '    };',
            f'    return lkr_series({n}, piece, '
            f'{self._code.literal(1.0 if is_angle else linkage.longest)}, '
            f'{self._code.literal(math.tau if is_angle else math.inf)}, *value, q);', '}'])

    def _closed(self, head: str, outputs: Sequence[str], known_inputs: Mapping[int, Real],
                closed: InverseLinkage) -> tuple[int, str]:
        """Return the number of solutions of an inverse linkage, and the function for them."""
        candidates, solutions = closed.solutions(), []
        for (signs, turns), inputs in zip(
                product(closed.modes, product(*closed.turns)), candidates):
            # If an input has a period of several turns, each turn has its own pose.
            if not any(turns[i] for i in known_inputs):
                sides = ', '.join(f'{joint} {"left" if sign > 0.0 else "right"}'
                                  for joint, sign in zip(closed.branches, signs))
                solutions.append((f'/* {sides} */' if sides and not any(turns) else '', {
                    i: known_inputs.get(i, value) for i, value in enumerate(inputs)}))
        if len(outputs) == 1:
            solutions = [solutions[k] for k in self._in_reach(outputs[0], candidates)] or solutions
        lines = '\n     '.join(map(comment, closed.lines))
        return self._function('/* The inputs in each assembly mode of the inverse linkage, NAN '
                              f'where there is none:\n     {lines}\n */\n{head}', solutions)

    def _function(self, head: str, solutions: Sequence[tuple[str, Mapping[int, Real]]]
                  ) -> tuple[int, str]:
        """Return the number of solutions, each a line above it and inputs, and the function."""
        scales = self.mechanism.scales
        return len(solutions), self._code.function(
            head, [f'value[{i}]' for i in range(len(scales))],
            [(above, {f'q[{k}][{i}]': value * scales[i] for i, value in inputs.items()})
             for k, (above, inputs) in enumerate(solutions)], f'return {len(solutions)};')

    def _in_reach(self, output: str, solutions: list[list[Real]]) -> list[int]:
        """Return which solutions of a closed form the linkage has anywhere in its reach."""
        # A solution of one part may go on in another, where it has a dead point of its own.
        steps, linkage = (np.arange(SAMPLES) + 0.382) / SAMPLES, self.linkage
        low, high = linkage.monotone(output).T[:2, :, None]
        inputs = (low + steps * (high - low)).ravel()
        solved = linkage.bind(Program([x for x, in solutions])).over(
            *linkage.compiled_pose((), (output,)).over(inputs))
        error = linkage.inputs[0].distance(solved, inputs)
        return sorted({*np.where(np.isfinite(error), error, math.inf).argmin(axis=0).tolist()})
