# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The pose of a mechanism in C: all joints, links and rates, computed in one function."""

from __future__ import annotations

from itertools import product
from typing import Iterable, Iterator, Mapping, Sequence

from .code import Code
from .names import comment, distinct, field
from ..formula.expression import Real, real
from ..scene import SceneMechanism


class Formulas:
    """
    Writes the struct of a pose, and the function that fills it.

    Parameters
    ----------
    mechanism : SceneMechanism
        Its first leg is written.
    code : Code
        Writes its C.
    outputs : sequence of str
        Outputs that a pose has in addition to its joints and links.

    Attributes
    ----------
    by : list of str
        The names of the rates by the inputs.
    fields : dict
        The fields of a pose, by output.
    names : dict
        Names of the mechanism, its inputs and their rates, for templates.

    """

    def __init__(self, mechanism: SceneMechanism, code: Code, outputs: Sequence[str]):
        self._mechanism, self._code = mechanism, code
        self._linkage = linkage = mechanism.linkage
        self.by = [f'by_{name}' for name in mechanism.inputs]
        # No word of C and no macro ends so.
        self._parameters = [f'{name}_' for name in mechanism.inputs]
        self.names = {
            'name': mechanism.name, 'number': code.number, 'by': ', '.join(self.by),
            'by_zero': ', '.join(f'{by} = LKR_ZERO' for by in self.by),
            'by_places': ', '.join(f'&{by}' for by in self.by),
            'by_pointers': ', '.join(f'{mechanism.name}_pose *{by}' for by in self.by),
            'arguments': ', '.join(self._parameters),
            'parameters': ', '.join(f'{code.number} {name}' for name in self._parameters),
            'inputs_named': ' and by '.join(mechanism.inputs),
            'elements': ', '.join(f'q[{i}]' for i in range(len(self.by)))}
        # Points in space are of no use on a board.
        self._points = () if mechanism.in_space else linkage.points
        named = dict.fromkeys((
            *(f'{point}.{axis}' for point in self._points for axis in 'xy'), *linkage.joints,
            *outputs))
        self.fields = dict(zip(named, distinct(field(linkage, output) for output in named)))

    def struct(self) -> str:
        """Return the fields of a pose."""
        parents = {link.name: link.parent for link in self._linkage.links}
        rows = [(f'{point}_x, {point}_y', '[m]') for point in self._points]
        for output, name in [*self.fields.items()][2 * len(self._points):]:
            is_angle = self._linkage.is_angle(output)
            to = f'to {parents[output]} ' if is_angle and output in parents else ''
            rows.append((name, to + ('[rad]' if is_angle else '[m]')))
        return '\n'.join(f'    {self._code.number} {names};'.ljust(34) + f'/* {about} */'
                         for names, about in rows)

    def function(self) -> str:
        """Return the function for all fields and their rates."""
        structure, groups = self._linkage.formulas, [*self._groups()]
        by = dict(zip(self.by, self._mechanism.scales))
        poses = [(f'/* {comment(about)} */', self._assigned(
            outputs, {'p': 1.0}, map(structure.output, outputs))) for about, outputs in groups]
        rates = [(f'/* Rates of {comment(about)} */', self._assigned(
            outputs, by, structure.parts(((), (), tuple(outputs))))) for about, outputs in groups]
        valid = real(0.0)
        # If it can be assembled at any input, rounding does not matter.
        if len(self.by) > 1 or not self._linkage.inputs[0].is_whole(self._linkage.reach()):
            valid = structure.where_assembled(valid)
        return self._code.function(
            '/* The pose; with has_rates, rates by {inputs_named}. Returns 0 beyond a limit. */\n'
            'LKR_FORMULA int {name}_formulas({parameters}, int has_rates, {name}_pose *p,\n'
            '    {by_pointers})'.format(**self.names),
            [self._code.times(parameter, 1.0 / scale)
             for parameter, scale in zip(self._parameters, self._mechanism.scales)],
            [*poses, ('', {f'const {self._code.number} valid': valid}),
             ('if (!has_rates) {\n    return isfinite(valid);\n}', {}), *rates],
            'return isfinite(valid);')

    def _groups(self) -> Iterator[tuple[str, list[str]]]:
        """Yield the joint lines, with the outputs that each adds."""
        lines = [line.text for line in self._linkage.design.lines]
        if self._mechanism.in_space:
            # The joints follow from all rods together.
            yield '; '.join(lines), [*self.fields]
            return
        order = {name: i for i, line in enumerate(self._linkage.design.lines)
                 for name in line.names}
        for link in self._linkage.links:
            order[link.name] = max(order.get(name, 0) for name in (
                link.joint, link.tip, link.parent))
        for i, about in enumerate([*lines, 'Other outputs']):
            outputs = [output for output in self.fields if i == order.get(
                output.removesuffix('.x').removesuffix('.y'), len(lines))]
            if outputs:
                yield about, outputs

    def _assigned(self, outputs: Sequence[str], structs: Mapping[str, float],
                  values: Iterable[Real]) -> dict[str, Real]:
        """Return values of outputs in structs, each by a unit, by their places in C."""
        scale_of = self._mechanism.scale_of
        return {f'{struct}->{self.fields[output]}': value * (scale_of(output) / unit)
                for ((struct, unit), output), value in zip(
                    product(structs.items(), outputs), values)}
