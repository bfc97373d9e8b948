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
from typing import Dict, List, Mapping, Sequence, Tuple

import numpy as np

from .axes import Axis
from .code import Code
from .names import filled, template
from ..formula.program import Program
from ..linkage.inputs import MOST_COUNTED
from ..linkage.inverse_linkage import InverseLinkage, Mode
from ..linkage.mechanism import Mechanism

# Newton steps, the first pose included, from a closed form and of a search.
CLOSED, SEARCHED = 4, 64
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

    """

    def __init__(self, linkage: Mechanism, code: Code, values: Mapping[str, object]):
        self._linkage, self._code, self._values = linkage, code, values
        self._sizes = [input_.size for input_ in linkage.inputs]
        self.poses = 0
        first, *others = linkage.inputs
        # Whether the reach is known: of longer periods only one turn is computed.
        self._is_known = not others and first.period <= MOST_COUNTED
        self._arcs = linkage.reach() if self._is_known else []
        if first.is_whole(self._arcs):
            self._arcs = []

    def within(self) -> Dict[str, object]:
        """Return the function that keeps the input in its reach, and its call, if it has ends."""
        first, code = self._linkage.inputs[0], self._code
        turn, inside = first.turn if first.turns else 0.0, INSIDE[code.number]
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
        given = {name: (i, value) for name, value in zip(outputs, values)
                 for i, input_ in enumerate(inputs) if input_.name == name}
        modes, way = '', {'count': 1, 'steps': CLOSED, 'poses': CLOSED, 'how': 'By its gear',
                          'starts': '', 'strict': '0', 'moved': '', 'stop': 'break;'}
        if len(given) < len(outputs):
            closed = self._linkage.inverse(outputs).closed
            modes, changed = self._closed(tag, outputs, closed, values) if closed else (
                '', self._searched(outputs))
            way.update(changed)
            way['inside'] = '' if side else f' && {code.name}_inside(start[next])'
        self.poses = max(self.poses, int(str(way['poses'])))
        return modes + filled(template('inverse.h.in'), {
            'inside': '', **self._values, **way, 'tag': tag, 'side': side,
            'at': f'{code.name}_at' + (f'_{tag}' if side > 1 else ''),
            'given_inputs': '\n'.join(
                f'        start[k][{i}] = {code.times(value, 1.0 / sizes[i])};'
                for i, value in given.values()),
            'turns': code.rows((input_.turn, 1.0 / input_.turn) if input_.turns and
                               input_.name not in given else (0.0, 0.0) for input_ in inputs)})

    def _searched(self, outputs: Tuple[str, ...]) -> Dict[str, object]:
        """Return how a search goes: from the inputs, and for one of them from any piece."""
        code, middles = self._code, []
        if len(outputs) == 1 and not code.is_open:
            pieces, _ = self._linkage.monotone(outputs[0], math.inf)
            middles = [0.5 * (low + high) / self._sizes[0] for low, high, *_ in pieces]
        way = {'count': 1 + len(middles), 'steps': SEARCHED, 'how': 'By a search',
               'poses': (1 + len(middles)) * (SEARCHED + 1)}
        return {**way, 'stop': '', 'moved': f'far = {code.name}_away(start[next], near);',
                'starts': '\n'.join(f'    start[{k}][0] = {code.literal(value)};'
                                    for k, value in enumerate(middles, 1))} if middles else way

    def _closed(self, tag: str, outputs: Tuple[str, ...], closed: InverseLinkage,
                values: Sequence[str]) -> Tuple[str, Dict[str, object]]:
        """Return the function for the inputs in all assembly modes, and how it is used."""
        code = self._code
        modes, count = self._modes(tag, self._own_modes(outputs, closed), closed, values)
        call = f'{code.name}_modes_{tag}(position, start);'
        strict = f'far < {self._values["last"]}'
        # Each start may be tried twice, at an end of the reach with one more pose.
        poses = count * (CLOSED + 2 + bool(self._arcs))
        if not code.is_open or not self._linkage.dimensions:
            return modes, {'count': count, 'how': 'In closed form', 'starts': f'    {call}',
                           'strict': strict, 'poses': poses}
        return modes, {
            'count': count, 'how': 'In closed form; with other dimensions by a search',
            'starts': f'    if (c->is_own)\n        {call}\n    else\n        for (k = 1; k < '
                      f'{count}; k++)\n            for (i = 0; i < {len(self._sizes)}; i++)\n'
                      f'                start[k][i] = {code.literal(math.nan)};',
            'strict': f'c->is_own && {strict}', 'poses': max(poses, SEARCHED + 1),
            'steps': f'c->is_own ? {CLOSED} : {SEARCHED}'}

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
        if not self._is_known:
            return modes
        # Between extremes of the output the mode is the same; in the middle two may meet.
        pieces, _ = linkage.monotone(outputs[0], math.inf)
        inputs = np.array([low + 0.382 * (high - low) for low, high, *_ in pieces])
        values = linkage.posed((), outputs).over(inputs)[0]
        starts = linkage.bind(Program(
            [mode.inputs[0] for mode in modes], 1, closed.arguments)).over(values)
        is_own = first.apart(np.add.outer(closed.turns[0], starts), inputs).min(
            axis=0) < ALIKE * first.size
        return [mode for mode, own in zip(modes, is_own.any(axis=1)) if own] if is_own.any(
            axis=0).all() else modes
