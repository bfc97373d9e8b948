# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
A mechanism as a C99 header: pose, rates, reach, and the inverse of some outputs.

It does the operations of the Python code in the same order, so the results are the same up to the
C library's sine, cosine and arctangent.
"""

from __future__ import annotations

from dataclasses import replace
import math
import re
from typing import Callable, List, Sequence

import numpy as np

from ..formula.operations import OPERATIONS
from ..formula.program import Dialect, Pose
from ..linkage.inputs import Input
from ..scene import Machine
from ..words import plain_text

# The largest change of an output [rad] or part of its range in one piece of its inverse.
PIECE = 1.0
PIECES = 8
# What an output may be beyond an extreme to count as the extreme, as a part of its size.
SLACK = {False: 2.0 ** -46, True: 2.0 ** -18}
# How many values of the input the error of `float` is measured at.
SAMPLED = 2001

INVERSE = """
/* The {input} for {output} = value [{unit}], the one nearest to `near`{turns}.
   Returns 0, and leaves *{input} alone, where there is none. */
static inline int {name}_{input}_for_{field}({number} value, {number} near, {number} *{input})
{{
    /* Where {output} rises or falls all along: {input} and {output} at both ends of each piece. */
    static const {number} piece[{count}][4] = {{
{table}
    }};
    {number} best = {infinity};
    int i, step;
    for (i = 0; i < {count}; i++) {{
        const {number} *p = piece[i];
        {number} least = p[2] < p[3] ? p[2] : p[3], most = p[2] < p[3] ? p[3] : p[2];
        {number} low = p[0], high = p[1], x = {half} * (low + high), target = {value};
{reduced}
        if (!(target >= least - {slack} && target <= most + {slack}))
            continue;
        for (step = 0; step < 60; step++) {{
            {number} now, rate, next, gap;
            {name}_{field}_of(x, &now, &rate);
            gap = {gap};
            if ((gap < {zero}) == (p[2] < p[3]))
                low = x;
            else
                high = x;
            next = x - gap / rate;
            if (!(next > low && next < high))
                next = {half} * (low + high);
            if (next == x)
                break;
            x = next;
        }}
{turned}
        if ({fabs}(x - near) < best) {{
            best = {fabs}(x - near);
            *{input} = x;
        }}
    }}
    return best < {infinity};
}}
"""


def written(machine: Machine, outputs: Sequence[str] = (), single: bool = False) -> str:
    """
    Return the header of a mechanism.

    Parameters
    ----------
    machine : Machine
        Of a scene; its scale is applied, of several legs the first is written.
    outputs : sequence of str
        What `input_for` takes: an inverse is written for each.
    single : bool
        Whether it computes with float instead of double.

    Raises
    ------
    ValueError
        If an output does not exist, or there are several inputs to invert.

    """
    return _Header(machine, single).text([plain_text(output) for output in outputs])


class _Header:
    def __init__(self, machine: Machine, single: bool):
        self.machine, self.single, self.name = machine, single, machine.name
        self.linkage = machine.linkage
        self.number = 'float' if single else 'double'
        self.inputs = [input_.name for input_ in self.linkage.inputs]
        # In space nobody on a small board asks where points are.
        self.points = () if machine.in_space else self.linkage.points
        self.dialect = _dialect(single, self.name)
        self.literal = self.dialect.number

    def text(self, outputs: Sequence[str]) -> str:
        """Return all of it."""
        guard = f'{self.name.upper()}_LINKAGE_H'
        in_space = self.machine.in_space
        for output in () if in_space else outputs:
            self.linkage.check_output(output)
        if outputs and len(self.inputs) > 1 and not in_space:
            raise ValueError(f'{self.name} has several inputs; an inverse is there for one')
        parts = [self._about(), f'#ifndef {guard}\n#define {guard}\n\n#include <math.h>\n',
                 self._helpers(), self._struct(), self._solve(),
                 self._rates(), self._reach(),
                 *([self._driven(outputs)] if in_space and outputs else
                   map(self._inverse, outputs)),
                 f'#endif /* {guard} */\n']
        return '\n'.join(part for part in parts if part)

    def _driven(self, outputs: Sequence[str]) -> str:
        """Return the same for the linkage driven by outputs: its closed inverse, with rates."""
        header = _Header(replace(self.machine, linkage=self.linkage.driven_by(*outputs),
                                 name=f'{self.name}_by_{"_".join(outputs)}'), self.single)
        return '\n'.join([header._helpers(), header._struct(), header._solve(), header._rates()])

    def _about(self) -> str:
        linkage = self.linkage
        lengths = ', '.join(f'{name} = {length:.9g}'
                            for name, length in linkage.dimensions.items())
        inputs = ', '.join(f'{input_.name} [{input_.unit}]' for input_ in linkage.inputs)
        scale = f', times {self.machine.scale:.9g}' if self.machine.scale != 1.0 else ''
        lines = [f'{self.name}: {linkage.type}, written by linkage_ros.',
                 f'Lengths [m]{scale}: {lengths}.',
                 f'Input: {inputs}. Angles [rad] count counterclockwise.',
                 'C99 without heap; compile without -ffast-math, which drops the checks.']
        if self.single:
            lines.append(self._error())
        return '\n'.join(['/*', *(f' * {line}' for line in lines), ' */'])

    def _helpers(self) -> str:
        n, number, f = self.name, self.number, 'f' if self.single else ''
        zero = self.literal(0.0)
        return '\n'.join([
            '/* A limit that is missed by rounding counts as reached. */',
            f'static inline {number} {n}_root({number} x, {number} tolerance)', '{',
            f'    return x > {zero} ? sqrt{f}(x) : x >= -tolerance ? {zero} : ({number})NAN;', '}',
            '',
            f'static inline {number} {n}_gated({number} x, {number} margin, {number} tolerance)',
            '{', f'    return margin >= -tolerance ? x : ({number})NAN;', '}', ''])

    @property
    def _fields(self) -> List[str]:
        linkage = self.linkage
        return [*(f'{joint}_{axis}' for joint in self.points for axis in 'xy'),
                *(_field(link, linkage.is_angle(link)) for link in linkage.joints)]

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
            what = f'to {links[name].parent} [rad]' if turns else '[m]'
            lines.append(f'    {self.number} {_field(name, turns)};'.ljust(34) + f'/* {what} */')
        return '\n'.join(['/* Where the joints are, and each link to its parent. */',
                          'typedef struct {', *lines, f'}} {self.name}_pose;', ''])

    def _function(self, head: str, pose: Pose,
                  ending: Callable[[List[str]], List[str]], scaled: bool = True) -> str:
        """Return a C function of the inputs that does what some Python code does."""
        sizes = [self.machine.scale_of(name) if scaled else 1.0 for name in self.inputs]
        constants, lines, outputs = pose.statements(self.dialect)
        text = '\n'.join([code for _, code in lines] + outputs)
        used = set(re.findall(r'\b[kx]\d+\b', text))
        body = [f'    const {self.number} {name} = {self.literal(value)};'
                for name, value in constants.items() if name in used]
        body += [f'    const {self.number} x{i} = {self._times(name, 1.0 / sizes[i])};'
                 for i, name in enumerate(self.inputs) if f'x{i}' in used]
        body += [f'    const {self.number} {name} = {code};' for name, code in lines]
        body += [f'    (void){name};' for i, name in enumerate(self.inputs) if f'x{i}' not in used]
        return '\n'.join([head, '{', *body, *ending(outputs), '}', ''])

    def _times(self, code: str, factor: float) -> str:
        return code if factor == 1.0 else f'{self.literal(factor)} * ({code})'

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
                tau, f = self.literal(math.tau), 'f' if self.single else ''
                ahead = f'({name} - {self.literal(low)})'
                tests.append(f'{ahead} - {tau} * floor{f}({ahead} / {tau}) <= '
                             f'{self.literal(high - low)}')
            else:
                tests.append(f'({name} >= {self.literal(low)} && {name} <= {self.literal(high)})')
        return '\n'.join([f'/* Whether it can be assembled: {said} {first.unit}. */',
                          f'static inline int {self.name}_reaches({self.number} {name})', '{',
                          f'    return {" || ".join(tests)};', '}', ''])

    def _inverse(self, output: str) -> str:
        linkage, number, f = self.linkage, self.number, 'f' if self.single else ''
        angular, first = linkage.is_angle(output), linkage.inputs[0]
        field = _field(output, angular)
        spans = [value for _, value in linkage.extremes(output)[0]]
        pieces, pose = linkage.monotone(
            output, PIECE if angular else abs(spans[1] - spans[0]) / PIECES or PIECE)
        of = self._function(
            f'/* {output} and its rate. */\nstatic inline void {self.name}_{field}_of'
            f'({number} {first.name}, {number} *value, {number} *rate)',
            pose, lambda outputs: [f'    *value = {outputs[0]};', f'    *rate = {outputs[1]};'],
            scaled=False)
        tau, half, zero, slack = map(self.literal, (
            math.tau, 0.5, 0.0, SLACK[self.single] * (math.pi if angular else linkage.longest)))

        def turns(angle: str) -> str:
            return f'{tau} * floor{f}(({angle}) / {tau} + {half})'

        table = ',\n'.join('        {' + ', '.join(map(self.literal, piece)) + '}'
                           for piece in pieces)
        return of + INVERSE.format(
            name=self.name, input=first.name, output=output, field=field, number=number,
            unit='rad' if angular else 'm', count=len(pieces), table=table, half=half, zero=zero,
            slack=slack, fabs=f'fabs{f}', infinity=f'({number})INFINITY',
            turns=', whole turns included' if first.turns else '',
            value=self._times('value', 1.0 / self.machine.scale_of(output)),
            reduced=f'        target += {tau} * ceil{f}((least - {slack} - target) / {tau});'
            if angular else '',
            gap='now - target' + (f' - {turns("now - target")}' if angular else ''),
            turned=f'        x += {turns("near - x")};' if first.turns
            else f'        x = {self._times("x", self.machine.scale)};')

    def _error(self) -> str:
        """Return in words how far single precision is off, over the reach."""
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


def _field(output: str, angular: bool) -> str:
    """Return what an output is called in C."""
    plain = re.sub(r'\W+', '_', output).strip('_')
    if '.' in output or '(' in output:
        return plain
    return ('angle_' if angular else 'slide_') + plain


def _dialect(single: bool, name: str) -> Dialect:
    f = 'f' if single else ''

    def literal(value: float) -> str:
        if math.isnan(value):
            return f'({"float" if single else "double"})NAN'
        if single:
            value = float(np.float32(value)) if abs(value) <= 3.4e38 else math.copysign(
                math.inf, value)
            value = value if abs(value) > 1.2e-38 else 0.0
        if math.isinf(value):
            return f'({"-" * (value < 0.0)}INFINITY)'
        text = _shortest(value) if single else repr(value)
        return f'({text}{f})' if value < 0.0 else text + f

    return Dialect({operation: row.c.replace('{f}', f).replace('{name}', name)
                    for operation, row in OPERATIONS.items()}, {}, literal)


def _shortest(value: float) -> str:
    """Return the shortest text of a float32."""
    text = str(np.float32(value))
    return text if re.search(r'[.e]', text) else text + '.0'
