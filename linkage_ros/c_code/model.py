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
from typing import Iterator, List, Sequence, Tuple

import numpy as np

from .axes import Axis, gears, loads, pieces, start
from .code import Block, Code, indented
from .formulas import Formulas
from .names import comment, literal
from ..formula.program import Program
from ..linkage import InverseLinkage, Mode
from ..scene import SceneMechanism

# Poses of an inverse: from a start of a closed form, and in a piece; as in `linkage.h`.
CLOSED, SEARCHED = 4, 64
# Samples of each part of the reach, for the assembly modes that are there.
SAMPLES = 256
# Inputs that are no further apart are the same [rad, sizes].
ALIKE = 1e-6


class Model:
    """
    Writes the tables and the inverses of actuators and joints.

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

    """

    def __init__(self, machine: SceneMechanism, code: Code, formulas: Formulas,
                 sides: Tuple[Sequence[Axis], Sequence[Axis]], tag: str = ''):
        self.machine, self.linkage, self._code, self._formulas = (
            machine, machine.linkage, code, formulas)
        self.sides, self._tag = sides, tag
        self._name = f'{machine.name}_model{tag}'
        self._sizes = [input_.size for input_ in machine.linkage.inputs]
        self.poses = 0
        first, *others = machine.linkage.inputs
        # Whether the reach is known: of very long periods only a part is computed.
        self._is_known = not others and not first.is_part
        self._arcs = machine.linkage.reach() if self._is_known else []
        if first.is_whole(self._arcs):
            self._arcs = []

    def text(self) -> str:
        """Return the function for a pose, the tables, and the inverses."""
        inverses = [self._inverse(side, axes) for side, axes in enumerate(self.sides) if axes]
        return '\n'.join([self._at(), self._table(), *inverses])

    # --- a pose ---

    def _at(self) -> str:
        """Return the function for a pose: positions, rates by each input, and loads."""
        code, formulas, name = self._code, self._formulas, self.machine.name
        called, units = self._call()
        lines = [f'{name}_pose s, {", ".join(formulas.by)};', f'if (!{called}) {{',
                 '    return 0;', '}']
        rates: List[str] = []
        places: List[str] = []
        for side, axes in enumerate(self.sides):
            for i, each in enumerate(axes):
                places.append(f'p->position[{side}][{i}]')
                lines += self._position(places[-1], each)
                rates += self._rates(f'p->rate[{side}][{i}]', each, units)
        powers = [] if self._tag else [
            (load / formulas.unit(output), formulas.fields[output])
            for output, load in loads(self.machine)]
        for j, (by, unit) in enumerate(zip(formulas.by, units)):
            rates.append(f'p->load[{j}] = ' + (' + '.join(
                code.times(f'{by}.{field}', -load * unit) for load, field in powers)
                or code.literal(0.0)) + ';')
        lines += ['if (is_rated) {', *(f'    {line}' for line in rates), '}',
                  f'return isfinite({" + ".join(places)});']
        return '\n'.join([
            '/* Positions and rates at inputs, each in rad or in its size; 0 if it cannot be '
            'assembled. */',
            f'static inline int {name}_at{self._tag}(const {code.number} *q, int is_rated, '
            'lkr_point *p)',
            '{',
            *indented(lines), '}', ''])

    def _position(self, place: str, each: Axis) -> Iterator[str]:
        """Yield the statements for the position of an axis."""
        code, unit = self._code, self._formulas.unit(each.output)
        field = f's.{self._formulas.fields[each.output]}'
        yield f'{place} = {code.times(field, each.factor / unit)}' + (
            f' + {code.literal(each.offset)};' if each.offset else ';')
        if each.wraps:
            turn = code.literal(math.tau)
            yield f'{place} -= {turn} * lkr_floor({place} / {turn} + LKR_HALF);'

    def _rates(self, place: str, each: Axis, units: Sequence[float]) -> Iterator[str]:
        """Yield the statements for the rates of an axis by each input."""
        factor = each.factor / self._formulas.unit(each.output)
        field = self._formulas.fields[each.output]
        for j, (by, unit) in enumerate(zip(self._formulas.by, units)):
            yield f'{place}[{j}] = {self._code.times(f"{by}.{field}", factor * unit)};'

    def passive(self, axes: Sequence[Axis]) -> str:
        """Return the function for joints that are not commanded."""
        called, units = self._call()
        lines = [f'{self.machine.name}_pose s, {", ".join(self._formulas.by)};',
                 f'(void){called};', '(void)position;', '(void)rate;']
        for i, each in enumerate(axes):
            lines += [*self._position(f'position[{i}]', each),
                      *self._rates(f'rate[{i}]', each, units)]
        return '\n'.join([
            '/* The joints that are not commanded, at inputs: positions, and rates by each. */',
            f'static inline void {self.machine.name}_passive(const {self._code.number} *q, '
            f'{self._code.number} *position,',
            f'    {self._code.number} (*rate)[LKR_MAX_INPUTS])', '{', *indented(lines), '}',
            ''])

    def _call(self) -> Tuple[str, List[float]]:
        """Return a call of the formulas at inputs q, and the units of these."""
        formulas = self._formulas
        units = [size * formulas.unit(input_) for size, input_ in zip(
            self._sizes, formulas.inputs)]
        return formulas.called([self._code.times(f'q[{i}]', unit)
                                for i, unit in enumerate(units)],
                               '&s', [f'&{by}' for by in formulas.by]), units

    # --- tables ---

    def _table(self) -> str:
        code, number = self._code, self._code.number
        none = '{ 0, %s, %s, 0, %s, %s }' % (4 * (code.literal(0.0),))
        sides = [',\n          '.join(self._axis(axes, k) for k in range(len(axes))) or none
                 for axes in self.sides]
        inputs = ',\n      '.join(
            '{ %s, { %s } }' % (', '.join(map(code.literal, row)), ', '.join(ends))
            for *row, ends in self._inputs())
        turns = [code.row(self._turns(axes)) for axes in self.sides]
        arcs = ''
        if self._arcs:
            size = self.linkage.inputs[0].size
            rows = ', '.join(code.row((0.5 * (low + high) / size, 0.5 * (high - low) / size))
                             for low, high in self._arcs)
            arcs = (f'static const {number} {self._name}_arc[{len(self._arcs)}][2] = '
                    f'{{ {rows} }};\n')
        about = 'Tables of the inverse' if self._tag else 'Tables of the actuators and joints'
        return (f'/* {about}, see lkr_model. */\n{arcs}'
                f'static const lkr_model {self._name} = {{\n'
                f'    {len(self._sizes)}, {int(not self._tag)}, '
                f'{self.machine.name}_at{self._tag},\n'
                f'    {{ {{ {sides[0]} }},\n      {{ {sides[1]} }} }},\n'
                f'    {{ {inputs} }},\n    {{ {turns[0]}, {turns[1]} }},\n'
                f'    {len(self._arcs)}, {f"{self._name}_arc" if arcs else 0}\n}};\n')

    def _axis(self, axes: Sequence[Axis], k: int) -> str:
        each, code = axes[k], self._code
        i, ratio, offset = next(((i, ratio, offset) for place, i, ratio, offset in gears(
            self.linkage, axes) if place == k), (0, 0.0, 0.0))
        return '{ %s }' % ', '.join([
            literal(each.name), *map(code.literal, (1.0 / each.size, each.turn)), str(i),
            *map(code.literal, (each.factor * ratio * self._sizes[i],
                                each.factor * offset + each.offset if ratio else 0.0))])

    def _inputs(self) -> Iterator[tuple]:
        """Yield turn, start, range of samples, their step, and sweep of each input."""
        starts = start(self.machine)
        for i, (drive, input_) in enumerate(zip(self.machine.inputs.values(),
                                                self.linkage.inputs)):
            unit = input_.size * self.machine.scale_of(input_.name)
            low, high = (end / unit for end in drive.ends or max(
                drive.reach, key=lambda arc: arc[1] - arc[0]))
            ends = [self._code.literal(end / unit) for end in drive.ends
                    ] if drive.ends and not self._tag else ['-LKR_FAR', 'LKR_FAR']
            yield (input_.turn if input_.wraps else 0.0, starts[i] / input_.size, low, high - low,
                   math.sqrt((i + 1) ** 2 + 1.0) % 1.0, ends)

    def _turns(self, axes: Sequence[Axis]) -> List[float]:
        """Return after how much of each input the positions of axes are the same, or 0."""
        inputs, counted = self.linkage.inputs, list(gears(self.linkage, axes))
        if axes and len(counted) < len(axes):
            # Outputs may repeat earlier than the linkage.
            inputs = self.linkage.inverse(tuple(each.output for each in axes)).inputs
        made = [input_.turn if input_.wraps else 0.0 for input_ in inputs]
        for _, i, _, _ in counted:
            made[i] = 0.0
        return made

    # --- inverses ---

    def _inverse(self, side: int, axes: Sequence[Axis]) -> str:
        """Return the function from positions of axes to the inputs."""
        name, number = self.machine.name, self._code.number
        outputs, modes, count = tuple(each.output for each in axes), '', 1
        tag = self._tag or ('_actuators', '_joints')[side]
        how = 'By their gears'
        closed = None
        if len(list(gears(self.linkage, axes))) < len(axes):
            closed, how = self.linkage.inverse(outputs).closed, 'In closed form'
            if closed:
                modes, count = self._modes(tag, closed, self._own_modes(outputs, closed), axes)
            else:
                return self._search(side, tag, axes)
        # A pose beyond an end of the reach is taken again inside, one without rates with them.
        poses = (count + 1) * (CLOSED + bool(self._arcs) + bool(self._tag))
        self.poses = max(self.poses, poses)
        return modes + '\n'.join([
            f'/* From positions to the inputs nearest to q. {how}, {poses} poses at most. */',
            f'static inline int {name}_from{tag}(const {number} *position, {number} *q, '
            'lkr_point *p)', '{', '    lkr_goal goal;',
            f'    lkr_start start[{count + 1}];',
            f'    if (!lkr_aim(&{self._name}, {side}, position, q, &goal)) {{',
            '        return 0;', '    }',
            *([f'    {name}_modes{tag}(goal.to, start);'] if modes else []),
            f'    return lkr_choose(&{self._name}, {side}, &goal, {count}, start, q, p);',
            '}', ''])

    def _search(self, side: int, tag: str, axes: Sequence[Axis]) -> str:
        """Return the function for the one axis whose inverse has no closed form."""
        (axis,), size, number = axes, self._sizes[0], self._code.number
        rows = [self._code.row((low / size, high / size)) + ', ' + self._code.row(
            axis.factor * value + axis.offset for value in ends)
            for low, high, *ends in pieces(self.machine, axis)]
        poses = len(rows) * SEARCHED
        self.poses = max(self.poses, poses)
        table = ',\n'.join(f'        {{ {row} }}' for row in rows)
        return '\n'.join([
            '/* From a position to the input nearest to q. By a search, '
            f'{poses} poses at most. */',
            f'static inline int {self.machine.name}_from{tag}(const {number} *position, '
            f'{number} *q, lkr_point *p)', '{',
            f'    static const lkr_piece piece[{len(rows)}] = {{\n{table}\n    }};',
            f'    return lkr_search(&{self._name}, {side}, {len(rows)}, piece, position, q, '
            'p);', '}', ''])

    def _modes(self, tag: str, closed: InverseLinkage, modes: Sequence[Mode],
               axes: Sequence[Axis]) -> Tuple[str, int]:
        """Return the function for the inputs in assembly modes, and the number of its answers."""
        code, n = self._code, len(self._sizes)
        # If an input has a period of several turns, each turn has its own pose.
        turns = list(product(*closed.turns))

        def block(number: int, mode: Mode) -> Block:
            def ending(codes: List[str]) -> List[str]:
                return [f'start[{number * len(turns) + k}].q[{i}] = ' + code.times(
                    f'({codes[i]} + {code.literal(turn)})' if turn else codes[i], 1.0 / size) + ';'
                    for k, turned in enumerate(turns)
                    for i, (turn, size) in enumerate(zip(turned, self._sizes))]

            sides = mode.linkage.branches
            return Block(', '.join(f'{joint} {"left" if sides[joint] > 0 else "right"}'
                                   for joint in closed.branches), n, ending)

        values = [code.times(f'(position[{i}] - {code.literal(each.offset)})' if each.offset
                             else f'position[{i}]', 1.0 / each.factor)
                  for i, each in enumerate(axes)]
        lines = ''.join(f'     {comment(line)}\n' for line in closed.lines)
        return code.function(
            f'/* The inputs in each assembly mode of the inverse linkage, NAN where there is '
            f'none:\n{lines}*/\n'
            f'static inline void {self.machine.name}_modes{tag}(const {code.number} *position, '
            'lkr_start *start)', self.linkage.bind(Program(
                [value for mode in modes for value in mode.inputs], len(values),
                closed.arguments)), values, [block(*each) for each in enumerate(modes)]
            ) + '\n', len(modes) * len(turns)

    def _own_modes(self, outputs: Tuple[str, ...], closed: InverseLinkage) -> Sequence[Mode]:
        """Return the assembly modes in which the linkage is anywhere in its reach, if known."""
        linkage, modes, first = self.linkage, closed.modes, self.linkage.inputs[0]
        parts, _ = linkage.monotone(outputs[0], math.inf) if self._is_known else ((), ())
        if not parts:
            return modes
        # Where the inverse linkage has a dead point of its own, the mode changes.
        steps = (np.arange(SAMPLES) + 0.382) / SAMPLES
        inputs = np.concatenate([low + steps * (high - low) for low, high, *_ in parts])
        values = linkage.posed((), outputs).over(inputs)[0]
        starts = linkage.bind(Program(
            [mode.inputs[0] for mode in modes], 1, closed.arguments)).over(values)
        apart = np.nan_to_num(first.apart(np.add.outer(closed.turns[0], starts), inputs),
                              nan=math.inf).min(axis=0)
        is_own = apart <= np.maximum(apart.min(axis=0), ALIKE * first.size)
        own = (is_own & (apart < math.inf)).any(axis=1)
        return [mode for mode, is_there in zip(modes, own) if is_there] or modes
