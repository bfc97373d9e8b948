# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
A mechanism as a C99 header: pose, rates, reach, and the inverse of some outputs.

The operations and their order are those of the Python code, so the results are equal up to the C
library's sine, cosine and arctangent.
"""

from __future__ import annotations

import math
from typing import Callable, List, Sequence, Tuple

import numpy as np

from .names import field
from .sides import Sides
from ..formula.program import Pose
from ..linkage.inputs import Input
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
        sides.code.helpers(), sides.code.struct(), sides.code.setter(list(sides.checks())), text])


def guarded(sides: Sides, about: Sequence[str], parts: Sequence[str]) -> str:
    """Join the parts of a header, with comments, includes and a guard."""
    name, single = sides.machine.name, sides.code.number == 'float'
    guard = f'{name.upper()}_LINKAGE_H'
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
        self.machine, self.name = machine, machine.name
        self.linkage = machine.linkage
        # Points in space are of no use on a board.
        self.points = () if machine.in_space else machine.linkage.points
        self.inputs = [input_.name for input_ in self.linkage.inputs]
        for output in outputs:
            self.linkage.check_output(output)
        if outputs and len(self.inputs) > 1 and len(outputs) != len(self.inputs):
            raise ValueError(f'{self.name} has {len(self.inputs)} inputs: as many outputs are '
                             f'needed, got {listed(outputs)}')
        single_input = len(self.inputs) == 1
        self.outputs = [(output,) for output in outputs] if single_input else [
            tuple(outputs)] * bool(outputs)
        self.sides = Sides(machine, joints, single, outputs=self.outputs)
        self.code = self.sides.code
        self.number, self.literal, self._times = (
            self.code.number, self.code.literal, self.code.times)

    def text(self) -> str:
        """Return the whole header."""
        text = self.sides.text()
        return guarded(self.sides, self._about(), [
            self.code.helpers(), self._struct(), self._solve(), self._rates(), self._reach(), text,
            *map(self._inverse, self.outputs)])

    def _about(self) -> List[str]:
        linkage = self.linkage
        lengths = ', '.join(f'{name} = {length:.9g}'
                            for name, length in linkage.dimensions.items())
        inputs = ', '.join(f'{input_.name} [{input_.unit}]' for input_ in linkage.inputs)
        scale = f', times {self.machine.scale:.9g}' if self.machine.scale != 1.0 else ''
        lines = [f'Lengths [m]{scale}: {lengths}.',
                 f'Input: {inputs}. Angles [rad] count counterclockwise.']
        return lines + [self._error()] if self.number == 'float' else lines

    @property
    def _fields(self) -> List[str]:
        linkage = self.linkage
        return [*(f'{joint}_{axis}' for joint in self.points for axis in 'xy'),
                *(field(linkage, link) for link in linkage.joints)]

    @property
    def _outputs(self) -> List[str]:
        return [*(f'{joint}.{axis}' for joint in self.points for axis in 'xy'),
                *self.linkage.joints]

    def _struct(self) -> str:
        links = {link.name: link for link in self.linkage.links}
        lines = []
        for joint in self.points:
            lines.append(f'    {self.number} {joint}_x, {joint}_y;'.ljust(34) + '/* [m] */')
        for name in self.linkage.joints:
            turns = self.linkage.is_angle(name)
            what = f'/* to {links[name].parent} [rad] */' if turns else '/* [m] */'
            lines.append(f'    {self.number} {field(self.linkage, name)};'.ljust(34) + what)
        return '\n'.join(['/* Where the joints are, and each link to its parent. */',
                          'typedef struct {', *lines, f'}} {self.name}_pose;', ''])

    def _function(self, head: str, pose: Pose, ending: Callable[[List[str]], List[str]],
                  scaled: bool = True) -> str:
        """Return a C function of the inputs with the operations of a Pose."""
        return self.code.function(head, pose, [
            self._times(name, 1.0 / self.machine.scale_of(name) if scaled else 1.0)
            for name in self.inputs], ending)

    def _arguments(self) -> str:
        return ', '.join(f'{self.number} {name}' for name in self.inputs)

    def _solve(self) -> str:
        linkage, n = self.linkage, self.name
        pose = linkage.posed(self.points, linkage.joints)

        def ending(outputs: List[str]) -> List[str]:
            filled = [f'    p->{field} = {self._times(code, self.machine.scale_of(output))};'
                      for field, output, code in zip(self._fields, self._outputs, outputs)]
            return [*filled, '    return ' + '\n        && '.join(
                f'isfinite(p->{field})' for field in self._fields) + ';']

        return self._function(
            '/* Place the joints. Return 0 if not all can be assembled: NaN is what cannot. */\n'
            f'static inline int {n}_solve({self._arguments()}, {n}_pose *p)', pose, ending)

    def _rates(self) -> str:
        linkage, names = self.linkage, self._outputs
        places = ', '.join(f'{self.name}_pose *by_{name}' for name in self.inputs)

        def ending(outputs: List[str]) -> List[str]:
            return [f'    by_{name}->{field} = {self._times(outputs.pop(0), size / unit)};'
                    for name in self.inputs for unit in [self.machine.scale_of(name)]
                    for field, output in zip(self._fields, names)
                    for size in [self.machine.scale_of(output)]]

        return self._function(
            f'/* Differentiate all of it by {" and by ".join(self.inputs)}. */\n'
            f'static inline void {self.name}_rates({self._arguments()}, {places})',
            linkage.posed((), (), names), ending)

    def _reach(self) -> str:
        if len(self.inputs) > 1:
            return ''
        first: Input = self.linkage.inputs[0]
        arcs, name = self.machine.first.reach, first.name
        said = ' or '.join(f'[{low:.6g}, {high:.6g}]' for low, high in arcs)
        tests = []
        for low, high in arcs:
            if first.is_whole(arcs):
                tests = ['isfinite(' + name + ')']
            elif first.turns:
                tau, f = self.literal(math.tau * first.period), self.code.suffix
                ahead = f'({name} - {self.literal(low)})'
                tests.append(f'{ahead} - {tau} * floor{f}({ahead} / {tau}) <= '
                             f'{self.literal(high - low)}')
            else:
                tests.append(f'({name} >= {self.literal(low)} && {name} <= {self.literal(high)})')
        return '\n'.join([f'/* Whether it can be assembled: {said} {first.unit}. */',
                          f'static inline int {self.name}_reaches({self.number} {name})', '{',
                          f'    return {" || ".join(tests)};', '}', ''])

    def _inverse(self, outputs: Tuple[str, ...]) -> str:
        """Return the users' inverse: from outputs and near inputs, in scene units, to inputs."""
        linkage, number = self.linkage, self.number
        n, tag = len(outputs), '_'.join(field(linkage, output) for output in outputs)
        said = ', '.join(f'{output} [{"rad" if linkage.is_angle(output) else "m"}]'
                         for output in outputs)
        units = [size * self.machine.scale_of(name)
                 for name, size in zip(self.inputs, self.sides.sizes)]
        what = self.inputs[0] if n == 1 else 'inputs'
        value, near, put = ((f'{number} value', f'{number} near', f'{number} *{what}') if n == 1
                            else (f'const {number} value[{n}]', f'const {number} near[{n}]',
                                  f'{number} inputs[{n}]'))
        given, beside, made = ('&value', ['near'], [f'*{what}']) if n == 1 else (
            'value', [f'near[{i}]' for i in range(n)], [f'inputs[{i}]' for i in range(n)])
        known = ' && '.join(f'isfinite({given.lstrip("&")}{place})' for place in (
            [''] if n == 1 else [f'[{i}]' for i in range(n)]))
        return '\n'.join([
            f'/* The {what} for {said}, nearest to `near`, whole turns included. Returns 0, and',
            f'   leaves {what} alone, where there is none. */',
            f'static inline int {self.name}_{what}_for_{tag}({value}, {near}, {put})', '{',
            f'    {number} q[{n}];', f'    {self.name}_point p;',
            *(f'    q[{i}] = {self._times(code, 1.0 / units[i])};'
              for i, code in enumerate(beside)),
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
