# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The inverse as C functions: from the positions of axes to the inputs."""

from itertools import product
import math
from typing import Dict, Iterator, List, Mapping, Sequence, Tuple

import numpy as np

from .axes import Axis
from .code import Code
from .names import filled, template
from ..formula.program import Program
from ..linkage import InverseLinkage, Mechanism, Mode

# Newton steps, the first pose included, from a closed form and of a search.
CLOSED, SEARCHED = 4, 64
# Samples of each part of the reach, for the assembly modes that are there.
SAMPLES = 256
# Inputs that are no further apart are the same [rad, sizes].
ALIKE = 1e-6
# An end of the reach is taken further inside by this [rad, sizes]: it is rounded, too.
INSIDE = {'double': 1e-14, 'float': 2e-6}


class Inverses:
    """
    Writes the inverses of a linkage.

    Parameters
    ----------
    linkage : Mechanism
        The linkage, with the dimensions of the scene.
    code : Code
        Writes its C, for these or for changeable dimensions.
    values : mapping
        Values of the templates.
    sides : sequence of (sequence of Axis)
        The actuators and the joints.

    """

    def __init__(self, linkage: Mechanism, code: Code, values: Mapping[str, object],
                 sides: Sequence[Sequence[Axis]]):
        self._linkage, self._code, self._values, self._sides = linkage, code, values, sides
        self._sizes = [input_.size for input_ in linkage.inputs]
        self.poses = 0
        first, *others = linkage.inputs
        # Whether the reach is known: of very long periods only a part is computed.
        self._is_known = not others and not first.is_part
        self._arcs = linkage.reach() if self._is_known else []
        if first.is_whole(self._arcs):
            self._arcs = []

    def within(self) -> Dict[str, object]:
        """Return the function that keeps the input in its reach, and its call, if it has ends."""
        first, code = self._linkage.inputs[0], self._code
        turn, inside = first.turn if first.wraps else 0.0, INSIDE[code.number]
        if not self._arcs:
            return {'within': '', 'clamped': ''}
        arcs = ((0.5 * (low + high) / first.size, 0.5 * (high - low) / first.size - inside)
                for low, high in self._arcs)
        within = filled(template('within.h.in'), {
            **self._values, 'arc_count': len(self._arcs), 'turn': code.literal(turn),
            'by_turn': code.literal(turn and 1.0 / turn), 'arcs': code.rows(arcs)})
        return {'within': within, 'clamped': (
            f' && !(is_strict && {code.name}_within(q, 1)\n            && at('
            f'{self._values["pass"]}q, side < 2, p))')}

    def function(self, side: int, tag: str, axes: Sequence[Axis]) -> str:
        """Return the function from positions of axes, in the table at `side`, to the inputs."""
        code, inputs, sizes = self._code, self._linkage.inputs, self._sizes
        outputs = tuple(each.output for each in axes)
        values = [code.times(
            f'position[{i}]' + (f' - {code.literal(each.offset)}' if each.offset else ''),
            1.0 / each.factor) for i, each in enumerate(axes)]
        given, counted, gears = {}, [], [*self._gears(axes)]
        # Outputs may repeat earlier than the linkage.
        turns = [(each.turn, 1.0 / each.turn) if each.wraps else (0.0, 0.0)
                 for each in (inputs if len(gears) == len(outputs) else
                              self._linkage.inverse(outputs).inputs)]
        for k, i, ratio, offset in gears:
            value = values[k] + (f' - {code.literal(offset)}' if offset else '')
            value = code.times(value, 1.0 / (ratio * sizes[i]))
            given[i] = f'near[{i}] - whole[{i}]'
            counted += [f'    near[{i}] = {value};']
            if inputs[i].wraps:
                turn, over = map(code.literal, turns[i])
                counted += [
                    f'    whole[{i}] = {turn} * floor{code.suffix}(near[{i}] * {over} + '
                    f'{code.literal(0.5)});',
                    f'    to[{k}] -= {code.times(f"whole[{i}]", axes[k].factor * ratio)};']
                turns[i] = 0.0, 0.0
        modes, way = '', {'count': 1, 'steps': CLOSED, 'poses': CLOSED, 'how': 'By its gear',
                          'starts': '', 'strict': '0', 'fallback': ''}
        kind = 'inverse.h.in'
        if len(given) < len(outputs):
            if closed := self._linkage.inverse(outputs).closed:
                modes, changed = self._closed(tag, outputs, closed, values)
            elif pieces := self._pieces(axes):
                kind, changed = 'search.h.in', pieces
            else:
                changed = self._searched(outputs)
            way.update(changed)
        self.poses = max(self.poses, int(str(way['poses'])))
        return modes + filled(template(kind), {
            **self._values, **way, 'tag': tag, 'side': side, 'at_side': int(side > 0),
            'at': f'{code.name}_at' + (f'_{tag}' if side > 1 else ''),
            'counted': '\n'.join(counted), 'recounted': '' if side > 1 else self._recounted(
                'x' if kind == 'search.h.in' else 'start[next]'),
            'given_inputs': '\n'.join(f'        start[k][{i}] = {value};'
                                      for i, value in given.items()), 'turns': code.rows(turns)})

    def _gears(self, axes: Sequence[Axis]) -> Iterator[Tuple[int, int, float, float]]:
        """Yield the axes that count an input, maybe geared: number, input, ratio and offset."""
        linkage = self._linkage
        for k, each in enumerate(axes):
            for i, input_ in enumerate(linkage.inputs):
                if each.output == input_.name:
                    yield k, i, 1.0, 0.0
                elif each.output in linkage.geared_to(i) and not each.wraps and (
                        input_.turns or not self._code.is_open):
                    yield k, i, *linkage.gear(each.output, i)

    def _recounted(self, given: str) -> str:
        """Return the code that gives positions the whole turns of q beyond given inputs."""
        return '\n'.join(
            f'            p->position[{side}][{k}] += '
            f'{self._code.times(f"q[{i}] - {given}[{i}]", axes[k].factor * ratio)};'
            for side, axes in enumerate(self._sides) for k, i, ratio, _ in self._gears(axes)
            if self._linkage.inputs[i].wraps)

    def _pieces(self, axes: Sequence[Axis]) -> Dict[str, object]:
        """Return the pieces of the reach for a search in them; nothing if they are not known."""
        if not self._is_known or self._code.is_open:
            return {}
        # In a piece an angle changes by half a turn at most, so that its gaps are known.
        axis, = axes
        pieces, _ = self._linkage.monotone(axis.output, math.pi if axis.turn else math.inf)
        rows = [(low / self._sizes[0], high / self._sizes[0], axis.factor * first + axis.offset,
                 axis.factor * last + axis.offset) for low, high, first, last in pieces]
        return {'count': len(rows), 'pieces': self._code.rows(rows), 'steps': SEARCHED,
                'poses': len(rows) * SEARCHED} if rows else {}

    def _searched(self, outputs: Tuple[str, ...]) -> Dict[str, object]:
        """Return how a search goes: from the inputs, and for one of them from any piece."""
        code, middles = self._code, []
        if len(outputs) == 1 and not code.is_open:
            pieces, _ = self._linkage.monotone(outputs[0], math.inf)
            middles = [0.5 * (low + high) / self._sizes[0] for low, high, *_ in pieces]
        return {'count': 1 + len(middles), 'steps': SEARCHED, 'how': 'By a search from q',
                'poses': (1 + len(middles)) * (SEARCHED + 1),
                'starts': '\n'.join([f'    {self._begin()}', *(
                    f'    start[{k}][0] = {code.literal(value)};'
                    for k, value in enumerate(middles, 1))])}

    def _begin(self, k: int = 0) -> str:
        """Return the code that starts from the inputs, without their turns, which cost digits."""
        half = self._code.literal(0.5)
        return (f'for (i = 0; i < {len(self._sizes)}; i++) start[{k}][i] = q[i] - turn[i][0] * '
                f'floor{self._code.suffix}(q[i] * turn[i][1] + {half});')

    def _closed(self, tag: str, outputs: Tuple[str, ...], closed: InverseLinkage,
                values: Sequence[str]) -> Tuple[str, Dict[str, object]]:
        """Return the function for the inputs in all assembly modes, and how it is used."""
        code = self._code
        modes, count = self._modes(tag, self._own_modes(outputs, closed), closed, values)
        starts, how = f'    {code.name}_modes_{tag}(to, start);', 'In closed form'
        steps = f'{CLOSED}'
        # Each start may be tried twice, at an end of the reach with one more pose.
        poses = (count + 1) * (CLOSED + 2 + bool(self._arcs))
        if code.is_open and self._linkage.dimensions:
            how += '; with other dimensions by a search from q'
            steps, poses = f'c->is_own ? {CLOSED} : {SEARCHED}', max(poses, SEARCHED + 1)
            starts = (f'    if (c->is_own)\n    {starts}\n    else\n'
                      f'        for (k = 0; k < {count}; k++)\n'
                      f'            for (i = 0; i < {len(self._sizes)}; i++)\n'
                      f'                start[k][i] = {code.literal(math.nan)};')
        last = self._values['last']
        return modes, {
            'count': count + 1, 'how': how, 'poses': poses, 'steps': steps,
            'strict': f'far < {last}', 'starts': f'{starts}\n    {self._begin(count)}',
            # Where no mode has an answer, that nearest to q may be found from q.
            'fallback': f'    away[{count}] = {last};'}

    def _modes(self, tag: str, modes: Sequence[Mode], closed: InverseLinkage,
               values: Sequence[str]) -> Tuple[str, int]:
        """Return the function for the inputs in assembly modes, and the number of its answers."""
        n, number, name = len(self._sizes), self._code.number, self._code.name
        # If an input has a period of several turns, each turn has its own pose.
        turns = list(product(*closed.turns))
        count, code = len(modes) * len(turns), Code(name, self._linkage, number == 'float')

        def ending(codes: List[str]) -> List[str]:
            body = []
            for k, (mode, turned) in enumerate(product(range(len(modes)), turns)):
                for i, (turn, size) in enumerate(zip(turned, self._sizes)):
                    value = codes[mode * n + i] + (f' + {code.literal(turn)}' if turn else '')
                    body.append(f'    start[{k}][{i}] = {code.times(value, 1.0 / size)};')
                if self._arcs:
                    body += [f'    if (!{name}_within(start[{k}], 0))',
                             f'        start[{k}][0] = {code.literal(math.nan)};']
            return body

        return code.function(
            '/* The inputs in each assembly mode, NAN where there is none. */\n'
            f'static inline void {name}_modes_{tag}(const {number} position[{n}],\n'
            f'    {number} start[{count}][{n}])', self._linkage.bind(Program(
                [value for mode in modes for value in mode.inputs], len(values),
                closed.arguments)), values, ending), count

    def _own_modes(self, outputs: Tuple[str, ...], closed: InverseLinkage) -> Sequence[Mode]:
        """Return the assembly modes in which the linkage is anywhere in its reach, if known."""
        linkage, modes, first = self._linkage, closed.modes, self._linkage.inputs[0]
        pieces, _ = linkage.monotone(outputs[0], math.inf) if self._is_known else ((), ())
        if not pieces:
            return modes
        # Where the inverse linkage has a dead point of its own, the mode changes.
        parts = (np.arange(SAMPLES) + 0.382) / SAMPLES
        inputs = np.concatenate([low + parts * (high - low) for low, high, *_ in pieces])
        values = linkage.posed((), outputs).over(inputs)[0]
        starts = linkage.bind(Program(
            [mode.inputs[0] for mode in modes], 1, closed.arguments)).over(values)
        apart = np.nan_to_num(first.apart(np.add.outer(closed.turns[0], starts), inputs),
                              nan=math.inf).min(axis=0)
        is_own = apart <= np.maximum(apart.min(axis=0), ALIKE * first.size)
        own = (is_own & (apart < math.inf)).any(axis=1)
        return [mode for mode, is_there in zip(modes, own) if is_there] or modes
