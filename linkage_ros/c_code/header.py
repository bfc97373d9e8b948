# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""
A mechanism as a C99 header: pose, rates, reach, and the inverse of some outputs.

The operations and their order are those of the Python code, so the results are equal up to the C
library's sine, cosine and arctangent.
"""

from __future__ import annotations

from itertools import islice
from typing import Callable, Iterable, List, Sequence

import numpy as np

from .names import distinct, field, parameter, prefix
from .sides import Sides
from ..formula.program import Pose
from ..scene import SceneMechanism
from ..words import listed, plain_text

# Number of inputs at which the error of `float` is measured.
SAMPLED = 2001


def written(machine: SceneMechanism, outputs: Sequence[str] = (), single: bool = False,
            joints: Sequence[str] = ()) -> str:
    """
    Return the header of a mechanism.

    Parameters
    ----------
    machine : SceneMechanism
        Mechanism of a scene; lengths include its scale, and only its first leg is written.
    outputs : sequence of str
        Outputs, as for `input_for`, with an inverse each.
    single : bool
        Whether it computes with float instead of double.
    joints : sequence of str
        Commanded joints, see `axes.joints`.

    Raises
    ------
    ValueError
        If an output or a joint does not exist, or there are too few of them.

    """
    return _Header(machine, single, joints, [plain_text(output) for output in outputs]).text()


def opened(machine: SceneMechanism, joints: Sequence[str] = ()) -> str:
    """Return a header of actuators and joints alone, for changeable dimensions."""
    sides = Sides(machine, joints, is_open=True)
    text = sides.text()
    names = ', '.join(sides.linkage.dimensions) or 'none'
    return guarded(sides, [f'Dimensions [m] that may be given: {names}.'], [
        sides.code.helpers(), sides.code.struct(), sides.code.setter(), text])


def guarded(sides: Sides, about: Sequence[str], parts: Sequence[str]) -> str:
    """Join the parts of a header, with comments, includes and a guard."""
    name, single = sides.machine.name, sides.code.number == 'float'
    guard = f'{prefix(name)}_LINKAGE_H'
    lines = [f'{name}: {sides.linkage.type}, written by linkage_ros.', *about,
             'C99 and C++17 without heap, lock or recursion; compile without -ffast-math, which '
             'drops the checks.', f'A call of the transmission takes at most {sides.poses} poses.']
    check = '' if single else (
        '\n#if DBL_MANT_DIG < 53\n#error "double is a float on this machine: print the header '
        'again with --float"\n#endif\n')
    return '\n'.join([
        '/*', *(f' * {line}' for line in lines), ' */',
        f'#ifndef {guard}\n#define {guard}\n\n#include <float.h>\n#include <math.h>\n{check}',
        *filter(None, parts), f'#endif /* {guard} */\n'])


class _Header:
    def __init__(self, machine: SceneMechanism, single: bool, joints: Sequence[str],
                 outputs: Sequence[str]):
        self.machine, self.name, self.linkage = machine, machine.name, machine.linkage
        self.inputs = [input_.name for input_ in self.linkage.inputs]
        for output in outputs:
            self.linkage.check_output(output)
        if outputs and len(self.inputs) > 1 and len(outputs) != len(self.inputs):
            raise ValueError(f'{self.name} has {len(self.inputs)} inputs: as many outputs are '
                             f'needed, got {listed(outputs)}')
        self.outputs = [(output,) for output in outputs] if len(self.inputs) == 1 else [
            tuple(outputs)] * bool(outputs)
        self.sides = Sides(machine, joints, single, outputs=self.outputs)
        self.code = self.sides.code
        self.number, self._times = self.code.number, self.code.times
        # Points in space are of no use on a board.
        self.points = () if machine.in_space else self.linkage.points
        # The fields of a pose: their names in C, and as outputs.
        outputs = [*(f'{point}.{axis}' for point in self.points for axis in 'xy'),
                   *self.linkage.joints]
        self.fields = dict(zip(distinct(field(self.linkage, each) for each in outputs), outputs))
        # The inputs as parameters.
        self.given = [*map(parameter, self.inputs)]

    def text(self) -> str:
        """Return the whole header."""
        text = self.sides.text()
        return guarded(self.sides, self._about(), [
            self.code.helpers(), self._struct(), self._solve(), self._rates(), self._reach(), text,
            *(self._inverse(tag[1:], [each.output for each in own])
              for tag, (_, own) in self.sides.pairs.items() if tag)])

    def _about(self) -> List[str]:
        linkage = self.linkage
        lengths = ', '.join(f'{name} = {length:.9g}'
                            for name, length in linkage.dimensions.items())
        inputs = ', '.join(f'{input_.name} [{input_.unit}]' for input_ in linkage.inputs)
        scale = f', times {self.machine.scale:.9g}' if self.machine.scale != 1.0 else ''
        lines = [f'Lengths [m]{scale}: {lengths}.',
                 f'Input: {inputs}. Angles [rad] count counterclockwise.']
        return lines + [self._error()] if self.number == 'float' else lines

    def _struct(self) -> str:
        parents = {link.name: link.parent for link in self.linkage.links}
        lines = [f'    {self.number} {point}_x, {point}_y;'.ljust(34) + '/* [m] */'
                 for point in self.points]
        lines += [f'    {self.number} {field_};'.ljust(34) + (
            f'/* to {parents[name]} [rad] */' if self.linkage.is_angle(name) else '/* [m] */')
            for field_, name in self.fields.items() if name in parents]
        return '\n'.join(['/* Where the joints are, and each link to its parent. */',
                          'typedef struct {', *lines, f'}} {self.name}_pose;', ''])

    def _function(self, head: str, pose: Pose, ending: Callable[[List[str]], List[str]]) -> str:
        """Return a C function of the inputs with the operations of a Pose."""
        return self.code.function(head, pose, [
            self._times(given, 1.0 / self.machine.scale_of(name))
            for given, name in zip(self.given, self.inputs)], ending)

    def _filled(self, pose: str, codes: Iterable[str], unit: float = 1.0) -> List[str]:
        """Return the assignments of a pose, whose fields are divided by a unit."""
        return [f'    {pose}->{name} = {self._times(code, self.machine.scale_of(output) / unit)};'
                for (name, output), code in zip(self.fields.items(), codes)]

    def _solve(self) -> str:
        arguments = ', '.join(f'{self.number} {name}' for name in self.given)
        tests = '\n        && '.join(f'isfinite(p->{name})' for name in self.fields)
        return self._function(
            '/* Place the joints. Return 0 if not all can be assembled: NaN is what cannot. */\n'
            f'static inline int {self.name}_solve({arguments}, {self.name}_pose *p)',
            self.linkage.posed(self.points, self.linkage.joints),
            lambda codes: [*self._filled('p', codes), f'    return {tests};'])

    def _rates(self) -> str:
        arguments = ', '.join([*(f'{self.number} {name}' for name in self.given),
                               *(f'{self.name}_pose *by_{name}' for name in self.inputs)])

        def ending(codes: List[str]) -> List[str]:
            rates = iter(codes)
            return [line for name in self.inputs for line in self._filled(
                f'by_{name}', islice(rates, len(self.fields)), self.machine.scale_of(name))]

        return self._function(
            f'/* Differentiate all of it by {" and by ".join(self.inputs)}. */\n'
            f'static inline void {self.name}_rates({arguments})',
            self.linkage.posed((), (), [*self.fields.values()]), ending)

    def _reach(self) -> str:
        if len(self.inputs) > 1 or self.linkage.inputs[0].is_part:
            return ''
        first, arcs, literal = self.linkage.inputs[0], self.machine.first.reach, self.code.literal
        ranges = ' or '.join(f'[{low:.6g}, {high:.6g}]' for low, high in arcs)
        turn, f, name = literal(first.turn), self.code.suffix, self.given[0]
        tests = [f'isfinite({name})'] if first.is_whole(arcs) else [
            f'({name} - {low}) - {turn} * floor{f}(({name} - {low}) / {turn}) <= {width}'
            if first.turns else f'({name} >= {low} && {name} <= {high})'
            for low, high, width in ((literal(low), literal(high), literal(high - low))
                                     for low, high in arcs)]
        return '\n'.join([f'/* Whether it can be assembled: {ranges} {first.unit}. */',
                          f'static inline int {self.name}_reaches({self.number} {name})', '{',
                          f'    return {" || ".join(tests)};', '}', ''])

    def _inverse(self, tag: str, outputs: Sequence[str]) -> str:
        """Return the users' inverse: from outputs and near inputs, in scene units, to inputs."""
        linkage, number, n = self.linkage, self.number, len(outputs)
        names = ', '.join(f'{output} [{"rad" if linkage.is_angle(output) else "m"}]'
                          for output in outputs)
        units = [size * self.machine.scale_of(name)
                 for name, size in zip(self.inputs, self.sides.sizes)]
        if n == 1:
            what, out, near, values = self.inputs[0], self.given[0], ['near'], ['value']
            head, given, made = (f'{number} value, {number} near, {number} *{out}', '&value',
                                 [f'*{out}'])
        else:
            what, given = 'inputs', 'value'
            near, values, made = ([f'{name}[{i}]' for i in range(n)]
                                  for name in ('near', 'value', 'inputs'))
            head = f'const {number} value[{n}], const {number} near[{n}], {number} inputs[{n}]'
        known = ' && '.join(f'isfinite({value})' for value in values)
        lack = 'is none' if n == 1 or linkage.inverse(outputs).closed else 'are none near'
        return '\n'.join([
            f'/* The {what} for {names}, nearest to `near`, whole turns included. Returns 0, and',
            f'   leaves {what} alone, where there {lack}. */',
            f'static inline int {self.name}_{what}_for_{tag}({head})', '{',
            f'    {number} q[{n}];', f'    {self.name}_point p;',
            *(f'    q[{i}] = {self._times(code, 1.0 / units[i])};'
              for i, code in enumerate(near)),
            f'    if (!({known}) || !{self.name}_from_{tag}({given}, q, &p))', '        return 0;',
            *(f'    {code} = {self._times(f"q[{i}]", units[i])};'
              for i, code in enumerate(made)), '    return 1;', '}', ''])

    def _error(self) -> str:
        """Describe the error of single precision over the reach."""
        linkage = self.linkage
        if len(self.inputs) > 1:
            return 'float: how far joints are off was not measured, as there are several inputs.'
        (low, high), *_ = linkage.reach()
        edge = 0.0 if linkage.inputs[0].is_whole([(low, high)]) else 0.01 * (high - low)
        theta = np.linspace(low + edge, high - edge, SAMPLED).astype(np.float32)
        pose = linkage.posed(linkage.points, ())
        exact = pose.over(theta.astype(float))
        worst = np.nanmax(np.abs(pose.searched(theta) - exact)) / linkage.longest
        return (f'float: joints are off by up to {worst:.1g} of the longest bar at {SAMPLED} '
                'poses over the reach, without its outermost hundredth.')
