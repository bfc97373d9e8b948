# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Actuators to joints and joints to actuators, as tables for `linkage.h`.

Both are outputs of the linkage. Positions are converted through the inputs, velocities by the
exact Jacobians, efforts by their transposes, so that power is conserved.
"""

from __future__ import annotations

from functools import partial
from itertools import product
import math
from typing import Iterator, List, Sequence, Tuple

import numpy as np

from .axes import Axis, gears, loads, pieces, start
from .code import Block, Code, indented
from .formulas import Formulas
from .names import comment, filled
from .series import series
from ..formula.program import Program
from ..linkage import InverseLinkage, Mode
from ..scene import SceneMechanism

# Samples of each part of the reach, for the assembly modes that are there.
SAMPLES = 256
# Inputs that are no further apart are the same [rad, sizes].
ALIKE = 1e-6
AT = """\
/* Positions and rates at inputs, each in rad or in its size; 0 if it cannot be assembled. */
static inline int @name@_at@tag@(const @number@ *q, int is_rated, lkr_point *p)
{
@body@
}
"""
TABLE = """\
/* @about@, see lkr_model. */
static const lkr_model @name@_model@tag@ = {
    @n@, @is_rated@, @name@_at@tag@, { @solutions@ },
    { { @actuators@ },
      { @joints@ } },
    { @turns@ },
    @start@, { @sweeps@ },
    { @ranges@ }
};
"""


class Tables:
    """
    Writes the pose, the tables and the solutions of actuators and joints.

    Parameters
    ----------
    machine : SceneMechanism
        Its first leg is used.
    code, formulas
        Write its C.
    sides : pair of (sequence of Axis)
        The actuators and the joints; no actuators for an inverse alone.
    tag : str
        End of the names of an inverse alone.

    Attributes
    ----------
    solutions : int
        The most solutions of an inverse.

    """

    def __init__(self, machine: SceneMechanism, code: Code, formulas: Formulas,
                 sides: Tuple[Sequence[Axis], Sequence[Axis]], tag: str = ''):
        self.machine, self.linkage, self._code, self._formulas = (
            machine, machine.linkage, code, formulas)
        self._sides, self._tag = sides, tag
        self._sizes = [input_.size for input_ in machine.linkage.inputs]
        self.solutions = 1

    def text(self) -> str:
        """Return the functions for solutions and for a pose, and the table."""
        names, functions = zip(*map(self._solutions, ('_actuators', '_joints'), self._sides))
        code, drives = self._code, [*self.machine.inputs.values()]
        sweeps = ['{ -LKR_FAR, LKR_FAR }' if self._tag or not drive.ends else
                  code.row(np.divide(drive.ends, unit))
                  for drive, unit in zip(drives, self._units())]
        ranges = [drive.ends or max(drive.reach, key=lambda arc: arc[1] - arc[0])
                  for drive in drives]
        values = {
            'name': self.machine.name, 'tag': self._tag, 'number': code.number,
            'about': 'Tables of the inverse' if self._tag else
                     'Tables of the actuators and joints',
            'n': len(self._sizes), 'is_rated': int(not self._tag), 'solutions': ', '.join(names),
            'body': '\n'.join(indented(self._at())),
            'turns': ', '.join(code.row(self._turns(axes)) for axes in self._sides),
            'start': code.row(np.divide(start(self.machine), self._sizes)),
            'sweeps': ', '.join(sweeps),
            'ranges': ', '.join(map(code.row, np.divide(ranges, np.c_[self._units()]))),
            **{side: ', '.join(self._rows(axes)) or '{ 0, 0, 0, 0, 0 }'
               for side, axes in zip(('actuators', 'joints'), self._sides)}}
        return '\n'.join([*filter(None, functions), filled(AT, values), filled(TABLE, values)])

    def passive(self, axes: Sequence[Axis]) -> str:
        """Return the function for joints that are not commanded."""
        name, number = self.machine.name, self._code.number
        lines = [f'{name}_pose s, {", ".join(self._formulas.by)};',
                 f'(void){self._formulas.call()};']
        for i, each in enumerate(axes):
            lines += [*self._position(f'position[{i}]', each),
                      *self._rates(f'rate[{i}]', each)]
        return '\n'.join([
            '/* The joints that are not commanded, at inputs: positions, and rates by each. */',
            f'static inline void {name}_passive(const {number} *q, {number} *position,',
            f'    {number} (*rate)[LKR_MAX_INPUTS])', '{', *indented(lines), '}', ''])

    # --- a pose ---

    def _at(self) -> Iterator[str]:
        """Yield the statements for positions, rates by each input, and loads."""
        code, formulas = self._code, self._formulas
        places = [(f'[{side}][{i}]', each) for side, axes in enumerate(self._sides)
                  for i, each in enumerate(axes)]
        yield f'{self.machine.name}_pose s, {", ".join(formulas.by)};'
        yield from (f'if (!{formulas.call()}) {{', '    return 0;', '}')
        for place, each in places:
            yield from self._position(f'p->position{place}', each)
        yield 'if (is_rated) {'
        for place, each in places:
            yield from (f'    {line}' for line in self._rates(f'p->rate{place}', each))
        powers = [] if self._tag else [*loads(self.machine)]
        for j, (by, unit) in enumerate(zip(formulas.by, self._units())):
            terms = [code.times(f'{by}.{formulas.fields[output]}',
                                -load * unit / self.machine.scale_of(output))
                     for output, load in powers]
            yield f'    p->load[{j}] = {" + ".join(terms) or code.literal(0.0)};'
        yield '}'
        yield f'return isfinite({" + ".join(f"p->position{place}" for place, _ in places)});'

    def _units(self) -> List[float]:
        """Return the sizes of the inputs in the scene's units."""
        return [size * self.machine.scale_of(name)
                for name, size in zip(self.machine.inputs, self._sizes)]

    def _position(self, place: str, each: Axis) -> Iterator[str]:
        """Yield the statements for the position of an axis."""
        code, field = self._code, f's.{self._formulas.fields[each.output]}'
        factor = each.factor / self.machine.scale_of(each.output)
        yield f'{place} = {code.times(field, factor)}' + (
            f' + {code.literal(each.offset)};' if each.offset else ';')
        if each.wraps:
            yield f'{place} -= lkr_turns({place}, {code.literal(math.tau)});'

    def _rates(self, place: str, each: Axis) -> Iterator[str]:
        """Yield the statements for the rates of an axis by each input."""
        factor = each.factor / self.machine.scale_of(each.output)
        field = self._formulas.fields[each.output]
        for j, (by, unit) in enumerate(zip(self._formulas.by, self._units())):
            yield f'{place}[{j}] = {self._code.times(f"{by}.{field}", factor * unit)};'

    # --- tables ---

    def _rows(self, axes: Sequence[Axis]) -> Iterator[str]:
        """Yield the rows of a side's axes."""
        counted = {k: (i, ratio, offset) for k, i, ratio, offset in gears(self.linkage, axes)}
        for k, each in enumerate(axes):
            i, ratio, offset = counted.get(k, (0, 0.0, 0.0))
            scale, turn, rate, zero = map(self._code.literal, (
                1.0 / each.size, each.turn, each.factor * ratio * self._sizes[i],
                each.factor * offset + each.offset if ratio else 0.0))
            yield f'{{ {scale}, {turn}, {i}, {rate}, {zero} }}'

    def _turns(self, axes: Sequence[Axis]) -> List[float]:
        """Return after how much of each input the positions of axes are the same, or 0."""
        inputs, counted = self.linkage.inputs, [*gears(self.linkage, axes)]
        if len(counted) < len(axes):
            # Outputs may repeat earlier than the linkage.
            inputs = self.linkage.inverse(tuple(each.output for each in axes)).inputs
        turns = [input_.turn if input_.wraps else 0.0 for input_ in inputs]
        for _, i, _, _ in counted:
            turns[i] = 0.0
        return turns

    # --- inverses ---

    def _solutions(self, side: str, axes: Sequence[Axis]) -> Tuple[str, str]:
        """Return the name of the function for all inputs of positions, and the function."""
        if not axes:
            return '0', ''
        outputs = tuple(each.output for each in axes)
        if len([*gears(self.linkage, axes)]) == len(axes):
            return 'lkr_counted', ''
        name = f'{self.machine.name}_solutions{self._tag or side}'
        closed = self.linkage.inverse(outputs).closed
        count, function = self._closed(name, outputs, closed, axes) if closed else (
            self._series(name, *axes))
        self.solutions = max(self.solutions, count)
        return name, function

    def _series(self, name: str, axis: Axis) -> Tuple[int, str]:
        """Return the number of pieces of the reach, and the function for a search in them."""
        size, row = self._sizes[0], self._code.row
        rows = []
        monotone = pieces(self.machine, axis)
        for piece in monotone:
            for middle, half, low, high, terms in series(self.linkage, axis.output, *piece):
                numbers = row((axis.factor * middle + axis.offset, axis.factor * half,
                               low / size, high / size))
                rows.append(f'    {{ {numbers[2:-2]}, {row(np.round(terms / size, 17))} }}')
        table = ',\n'.join('\n'.join(indented([each])) for each in rows)
        # Where two pieces of a monotone part meet, both have the input.
        return min(len(rows), 2 * len(monotone)), '\n'.join([
            f'/* The inputs of a position, in each of {len(rows)} pieces of the reach. */',
            f'static inline int {name}(const {self._code.number} *position,',
            f'    {self._code.number} (*q)[LKR_MAX_INPUTS])', '{',
            f'    static const lkr_piece piece[{len(rows)}] LKR_IN_FLASH = {{', table, '    };',
            f'    return lkr_series({len(rows)}, piece, {self._code.literal(axis.size)}, '
            f'{self._code.literal(axis.turn)}, position[0], q);', '}', ''])

    def _closed(self, name: str, outputs: Tuple[str, ...], closed: InverseLinkage,
                axes: Sequence[Axis]) -> Tuple[int, str]:
        """Return the number of solutions of an inverse linkage, and the function for them."""
        code, number = self._code, self._code.number
        modes = self._modes_in_reach(outputs, closed)
        # If an input has a period of several turns, each turn has its own pose.
        turns = [*product(*closed.turns)]

        def assigned(k: int, codes: List[str]) -> List[str]:
            lines = []
            for j, turned in enumerate(turns):
                for i, (value, turn, size) in enumerate(zip(codes, turned, self._sizes)):
                    value = f'({value} + {code.literal(turn)})' if turn else value
                    lines.append(
                        f'q[{k * len(turns) + j}][{i}] = {code.times(value, 1.0 / size)};')
            return lines

        count, blocks = len(modes) * len(turns), []
        for k, mode in enumerate(modes):
            sides = mode.linkage.branches
            about = ', '.join(f'{joint} {"left" if sides[joint] > 0 else "right"}'
                              for joint in closed.branches)
            blocks.append(Block(about, mode.inputs, partial(assigned, k)))
        blocks.append(Block('', (), lambda _: [f'return {count};']))
        values = [code.times(f'(position[{i}] - {code.literal(each.offset)})' if each.offset
                             else f'position[{i}]', 1.0 / each.factor)
                  for i, each in enumerate(axes)]
        lines = '\n'.join(f'     {comment(line)}' for line in closed.lines)
        return count, code.function(
            f'/* The inputs in each assembly mode of the inverse linkage, NAN where there is '
            f'none:\n{lines}\n*/\nstatic inline int {name}(const {number} *position,\n'
            f'    {number} (*q)[LKR_MAX_INPUTS])', values, blocks, closed.arguments)

    def _modes_in_reach(self, outputs: Tuple[str, ...], closed: InverseLinkage
                        ) -> Sequence[Mode]:
        """Return the assembly modes in which the linkage is anywhere in its reach, if known."""
        linkage, modes, (first, *others) = self.linkage, closed.modes, self.linkage.inputs
        # Of very long periods only a part is computed.
        if others or first.is_part:
            return modes
        parts, _ = linkage.monotone(outputs[0], math.inf)
        # Where the inverse linkage has a dead point of its own, the mode changes.
        steps = (np.arange(SAMPLES) + 0.382) / SAMPLES
        inputs = np.ravel([low + steps * (high - low) for low, high, *_ in parts])
        values = linkage.posed((), outputs).over(inputs)[0]
        starts = linkage.bind(Program(
            [mode.inputs[0] for mode in modes], 1, closed.arguments)).over(values)
        apart = np.nan_to_num(first.apart(np.add.outer(closed.turns[0], starts), inputs),
                              nan=math.inf).min(axis=0)
        is_there = (apart <= np.maximum(apart.min(axis=0), ALIKE * first.size)) & (
            apart < math.inf)
        return [mode for mode, any_ in zip(modes, is_there.any(axis=1)) if any_] or modes
