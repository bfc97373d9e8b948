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
from typing import Dict, Iterator, List, Sequence, Tuple

import numpy as np

from .axes import Axis, gears, loads, pieces, start
from .code import Code, indented
from .formulas import Formulas
from .names import comment, filled, template
from .series import series
from ..formula.program import Program
from ..linkage import InverseLinkage, Mode
from ..scene import SceneMechanism

# Samples of each part of the reach, for the assembly modes that are there.
SAMPLES = 256
# Inputs that are no further apart are the same [rad, sizes].
ALIKE = 1e-6


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
    functions : dict
        The functions for the solutions of inverses, by their names.
    solutions : int
        The most solutions of an inverse.

    """

    def __init__(self, mechanism: SceneMechanism, code: Code, formulas: Formulas):
        self.mechanism, self.linkage, self._code, self._formulas = (
            mechanism, mechanism.linkage, code, formulas)
        self.functions: Dict[str, str] = {}
        self.solutions = 1

    def text(self, sides: Tuple[Sequence[Axis], Sequence[Axis]], tag: str = '',
             passive: Sequence[Axis] = ()) -> str:
        """
        Return the function for a pose, and the table.

        `sides` are the actuators and the commanded joints; an inverse alone has no actuators, and
        a `tag` at the end of its names. `passive` are joints that are not commanded.
        """
        row, everywhere = self._code.row, (-math.inf, math.inf)
        sweeps = [row(not tag and settings.ends or everywhere)
                  for settings in self.mechanism.inputs.values()]
        all_axes = sides[0], [*sides[1], *passive]
        return filled(template('model.h.in'), {
            'name': self.mechanism.name, 'tag': tag, 'number': self._code.number,
            'about': 'the inverse' if tag else 'the actuators and joints',
            'n': len(self.mechanism.scales), 'counts': ', '.join(f'{len(axes)}' for axes in all_axes),
            'names': ', '.join(map(self._solutions, sides)),
            'at': '\n'.join(indented(self._at(all_axes, len(sides[1])))),
            'actuators': self._rows(all_axes[0]), 'joints': self._rows(all_axes[1]),
            'turns': ', '.join(row(self._turns(axes)) for axes in sides),
            'sizes': row(scale * input_.size for scale, input_ in zip(
                self.mechanism.scales, self.linkage.inputs)),
            'start': row(start(self.mechanism)),
            'sweeps': ', '.join(sweeps)})

    def _at(self, sides: Tuple[Sequence[Axis], Sequence[Axis]], commanded: int) -> Iterator[str]:
        """Yield the statements for values, rates by each input, and loads."""
        code, formulas, scale_of = self._code, self._formulas, self.mechanism.scale_of
        yield f'{self.mechanism.name}_pose s, {", ".join(formulas.by)};'
        yield from (f'if (!{formulas.call()}) {{', '    return 0;', '}')
        for side, axes in enumerate(sides):
            for i, each in enumerate(axes):
                field, unit = formulas.fields[each.output], 1.0 / scale_of(each.output)
                yield f'p->value[{side}][{i}] = {code.times(f"s.{field}", unit)};'
                for j, by in enumerate(formulas.by):
                    yield f'p->rate[{side}][{i}][{j}] = {code.times(f"{by}.{field}", unit)};'
        # An inverse alone needs no efforts.
        powers = [*loads(self.mechanism)] if sides[0] else []
        for j, by in enumerate(formulas.by):
            terms = [code.times(f'{by}.{formulas.fields[output]}', -load / scale_of(output))
                     for output, load in powers]
            yield f'p->load[{j}] = {" + ".join(terms) or code.literal(0.0)};'
        needed = [f'p->value[{side}][{i}]' for side, axes in enumerate(sides)
                  for i in range(min(len(axes), commanded))]
        yield f'return isfinite({" + ".join(needed)});'

    # --- tables ---

    def _rows(self, axes: Sequence[Axis]) -> str:
        """Return the rows of a side's axes."""
        rows, counted = [], gears(self.linkage, axes)
        for k, each in enumerate(axes):
            i, ratio, shift = counted.get(k, (-1, 0.0, 0.0))
            numbers = self._code.row((ratio / self.mechanism.scales[i], shift, 1.0 / each.size,
                                      each.turn, each.factor, each.offset))
            rows.append(f'{{ {i}, {numbers[2:-2]}, {int(each.wraps)} }}')
        return ', '.join(rows) or '{ -1, 0, 0, 0, 0, 0, 0, 0 }'

    def _turns(self, axes: Sequence[Axis]) -> List[float]:
        """Return after how much of each input the positions of axes are the same, or 0."""
        counted = {i for i, _, _ in gears(self.linkage, axes).values()}
        return [input_.turn if input_.wraps and i not in counted else 0.0
                for i, input_ in enumerate(self.linkage.inputs)]

    # --- inverses ---

    def _solutions(self, axes: Sequence[Axis]) -> str:
        """Return the name of the function for all inputs of outputs, and note it; 0: none."""
        outputs = tuple(each.output for each in axes)
        if len(gears(self.linkage, axes)) == len(axes):
            return '0'
        name = '_'.join([f'{self.mechanism.name}_solutions', *(
            self._formulas.fields[output] for output in outputs)])
        closed = self.linkage.inverse(outputs).closed
        count, self.functions[name] = self._closed(
            name, closed, outputs) if closed else self._series(name, *axes)
        self.solutions = max(self.solutions, count)
        return name

    def _series(self, name: str, axis: Axis) -> Tuple[int, str]:
        """Return the most inputs of an output, and the function for them by series."""
        code, monotone = self._code, pieces(self.linkage, axis.output)
        found = series(self.linkage, axis.output, monotone, code.single, *self.mechanism.scales)
        rows = [f'    {{ {", ".join(map(code.literal, row[:7]))}, {code.row(row[7:])} }},'
                for row in found.tolist()]
        sizes = map(code.literal, (axis.size, axis.turn))
        # Where two pieces of a monotone part meet, both have the input.
        return min(len(rows), 2 * len(monotone)), '\n'.join([
            f'/* The inputs of an output, in each of {len(rows)} pieces of the reach. */',
            f'static inline int {name}(const {code.number} *value,',
            f'    {code.number} (*q)[LKR_MAX_INPUTS])', '{',
            f'    static const lkr_piece piece[{len(rows)}] LKR_IN_FLASH = {{',
            *indented(rows), '    };',
            f'    return lkr_series({len(rows)}, piece, {", ".join(sizes)}, value[0], q);', '}'])

    def _closed(self, name: str, closed: InverseLinkage, outputs: Sequence[str]
                ) -> Tuple[int, str]:
        """Return the number of solutions of an inverse linkage, and the function for them."""
        code = self._code
        modes = self._modes_in_reach(outputs[0], closed)
        # If an input has a period of several turns, each turn has its own pose.
        turns = [*product(*closed.turns)]
        blocks = [(', '.join(
            f'{joint} {"left" if mode.linkage.branches[joint] > 0 else "right"}'
            for joint in closed.branches), {
                f'q[{k * len(turns) + j}][{i}]': (value + turn) * scale
                for j, turned in enumerate(turns)
                for i, (value, turn, scale) in enumerate(zip(
                    mode.inputs, turned, self.mechanism.scales))})
            for k, mode in enumerate(modes)]
        count = len(modes) * len(turns)
        lines = '\n'.join(f'     {comment(line)}' for line in closed.lines)
        return count, code.function(
            f'/* The inputs in each assembly mode of the inverse linkage, NAN where there is '
            f'none:\n{lines}\n*/\nstatic inline int {name}(const {code.number} *value,\n'
            f'    {code.number} (*q)[LKR_MAX_INPUTS])',
            [f'value[{i}]' for i in range(len(outputs))],
            blocks, f'return {count};', closed.arguments)

    def _modes_in_reach(self, output: str, closed: InverseLinkage) -> Sequence[Mode]:
        """Return the assembly modes in which the linkage is anywhere in its reach, if known."""
        linkage, modes, (first, *others) = self.linkage, closed.modes, self.linkage.inputs
        if others:
            return modes
        parts, _ = linkage.monotone(output, math.inf)
        # Where the inverse linkage has a dead point of its own, the mode changes.
        steps = (np.arange(SAMPLES) + 0.382) / SAMPLES
        inputs = np.ravel([low + steps * (high - low) for low, high, *_ in parts])
        starts = linkage.bind(Program([mode.inputs[0] for mode in modes], 1, closed.arguments)
                              ).over(linkage.posed((), (output,)).over(inputs)[0])
        apart = first.apart(np.add.outer(closed.turns[0], starts), inputs)
        is_there = (apart <= ALIKE * first.size).any(axis=(0, 2))
        return [mode for mode, any_ in zip(modes, is_there) if any_] or modes
