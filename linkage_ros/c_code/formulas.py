# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The pose of a mechanism in C: all joints, links and rates, computed in one function."""

from __future__ import annotations

from functools import partial
from typing import Iterable, Iterator, List, Sequence, Tuple

from .code import Block, Code, indented
from .names import distinct, field, parameter
from ..formula.program import Program
from ..scene import SceneMechanism


class Formulas:
    """
    Writes the struct of a pose, and the functions that fill it.

    Parameters
    ----------
    machine : SceneMechanism
        Its first leg is written.
    code : Code
        Writes its C.
    outputs : sequence of str
        Outputs that a pose has in addition to its joints and links.

    Attributes
    ----------
    fields : dict
        The fields of a pose, by output.

    """

    def __init__(self, machine: SceneMechanism, code: Code, outputs: Sequence[str]):
        self.name, self._machine, self._code = machine.name, machine, code
        self._linkage = linkage = machine.linkage
        self.inputs = [input_.name for input_ in linkage.inputs]
        # The inputs as parameters, and the rates by them.
        self.given = [*map(parameter, self.inputs)]
        self.by = [f'by_{name}' for name in self.inputs]
        # Points in space are of no use on a board.
        self._points = () if machine.in_space else linkage.points
        named = list(dict.fromkeys((
            *(f'{point}.{axis}' for point in self._points for axis in 'xy'), *linkage.joints,
            *outputs)))
        self.fields = dict(zip(named, distinct(field(linkage, each) for each in named)))

    def unit(self, output: str) -> float:
        """Return the unit of a field: the scene's, in the linkage's own."""
        return self._machine.scale_of(output)

    def text(self) -> str:
        """Return the struct and the functions."""
        return '\n'.join([self._struct(), self._formulas(), self._solve(), self._rates()])

    def _struct(self) -> str:
        parents = {link.name: link.parent for link in self._linkage.links}
        number, places = self._code.number, {f'{point}.{axis}' for point in self._points
                                             for axis in 'xy'}
        lines = [f'    {number} {point}_x, {point}_y;'.ljust(34) + '/* [m] */'
                 for point in self._points]
        for output, name in self.fields.items():
            if output not in places:
                unit = '[rad]' if self._linkage.is_angle(output) else '[m]'
                to = f'to {parents[output]} ' if output in parents and unit == '[rad]' else ''
                lines.append(f'    {number} {name};'.ljust(34) + f'/* {to}{unit} */')
        return '\n'.join(['/* Where the joints are, and each link to its parent. */',
                          'typedef struct {', *lines, f'}} {self.name}_pose;', ''])

    def _parameters(self) -> str:
        return ', '.join(f'{self._code.number} {name}' for name in self.given)

    def _formulas(self) -> str:
        """Return the function for all fields and their rates."""
        structure, code = self._linkage.structure, self._code
        blocks, outputs = [], []
        for about, own in self._groups():
            count = len(own)
            rates = structure.checked(tuple(own))[count:]
            outputs += [*map(structure.output, own), *rates]
            blocks.append(Block(about, count + len(rates), partial(self._filled, own)))
        limits = [limit for limit in structure.built.limits if limit.margin.varies]
        inputs = self._linkage.inputs
        if len(inputs) == 1 and inputs[0].is_whole(self._linkage.reach()):
            # It can be assembled at any input: no limit needs to be checked.
            limits = []
        outputs += [part for limit in limits for part in (limit.margin, limit.tolerance)]
        blocks.append(Block('', 2 * len(limits), lambda codes: ['return ' + (' && '.join(
            f'{margin} >= -{tolerance}' for margin, tolerance in zip(codes[::2], codes[1::2]))
            or '1') + ';']))
        return code.function(
            f'/* The pose, and its rates by {" and by ".join(self.inputs)}. Returns 0 if a limit '
            'is exceeded. */\n'
            f'LKR_FORMULA int {self.name}_formulas({self._parameters()}, {self.name}_pose *p, '
            + ', '.join(f'{self.name}_pose *{by}' for by in self.by) + ')',
            self._linkage.bind(Program(outputs, len(inputs))),
            [code.times(given, 1.0 / self.unit(name))
             for given, name in zip(self.given, self.inputs)], blocks)

    def _groups(self) -> Iterator[Tuple[str, List[str]]]:
        """Yield the joint lines, with the outputs that each adds."""
        linkage, left = self._linkage, list(self.fields)
        lines = linkage.design.lines
        if self._machine.in_space:
            # The joints follow from all rods together.
            yield '; '.join(line.text for line in lines), left
            return
        order = {name: i for i, line in enumerate(lines) for name in line.names}
        for link in linkage.links:
            order[link.name] = max(order.get(name, 0) for name in (
                link.joint, link.tip, link.parent))
        for i, line in enumerate(lines):
            own = [output for output in left if order.get(
                output[:-2] if output[-2:] in ('.x', '.y') else output) == i]
            left = [output for output in left if output not in own]
            if own:
                yield line.text, own
        if left:
            yield 'Other outputs', left

    def _filled(self, outputs: Sequence[str], codes: Sequence[str]) -> List[str]:
        """Return the assignments of outputs and of their rates."""
        lines = self._assigned('p', outputs, codes[:len(outputs)])
        for i, (by, name) in enumerate(zip(self.by, self.inputs), 1):
            lines += self._assigned(by, outputs, codes[i * len(outputs):], self.unit(name))
        return lines

    def _assigned(self, pose: str, outputs: Iterable[str], codes: Iterable[str],
                  unit: float = 1.0) -> List[str]:
        """Return the assignments of a pose, whose fields are divided by a unit."""
        return [f'{pose}->{self.fields[output]} = '
                f'{self._code.times(value, self.unit(output) / unit)};'
                for output, value in zip(outputs, codes)]

    def called(self, given: Sequence[str], pose: str, by: Sequence[str]) -> str:
        """Return a call of the formulas."""
        return f'{self.name}_formulas({", ".join([*given, pose, *by])})'

    def _solve(self) -> str:
        rates = [f'&{by}' for by in self.by]
        return '\n'.join([
            '/* Place the joints. Return 0 if not all can be assembled: NaN is what cannot. */',
            f'static inline int {self.name}_solve({self._parameters()}, {self.name}_pose *p)', '{',
            *indented([f'{self.name}_pose {", ".join(self.by)};',
                       f'(void){self.called(self.given, "p", rates)};',
                       f'return isfinite({" + ".join(f"p->{x}" for x in self.fields.values())});'
                       ]), '}', ''])

    def _rates(self) -> str:
        poses = ', '.join(f'{self.name}_pose *{by}' for by in self.by)
        return '\n'.join([
            f'/* Differentiate all of it by {" and by ".join(self.inputs)}. */',
            f'static inline void {self.name}_rates({self._parameters()}, {poses})', '{',
            *indented([f'{self.name}_pose p;',
                       f'(void){self.called(self.given, "&p", self.by)};']), '}', ''])
