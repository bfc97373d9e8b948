# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The pose of a mechanism in C: all joints, links and rates, computed in one function."""

from __future__ import annotations

from itertools import product
from typing import Iterable, Iterator, Mapping, Sequence

from .code import Code
from .names import comment, distinct, field
from ..formula.expression import argument, Real, real
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
    fields : dict
        The fields of a pose, by output.

    """

    def __init__(self, mechanism: SceneMechanism, code: Code, outputs: Sequence[str]):
        self._mechanism, self._code = mechanism, code
        self._linkage = linkage = mechanism.linkage
        # Points in space are of no use on a board.
        points = () if mechanism.in_space else linkage.points
        named = dict.fromkeys((
            *(f'{point}.{axis}' for point in points for axis in 'xy'), *linkage.joints, *outputs))
        self.fields = dict(zip(named, distinct(field(linkage, output) for output in named)))

    def struct(self) -> str:
        """Return the fields of a pose."""
        linkage, rows = self._linkage, []
        parents = {link.name: f'to {link.parent} ' for link in linkage.links}
        for output, name in self.fields.items():
            unit = parents.get(output, '') + '[rad]' if linkage.is_angle(output) else '[m]'
            rows.append(f'    {self._code.number} {name};'.ljust(34) + f'/* {unit} */')
        return '\n'.join(rows)

    def function(self) -> str:
        """Return the function for all fields and their rates."""
        formulas, groups = self._linkage.formulas, [*self._groups()]
        name, scales, number = self._mechanism.name, self._mechanism.scales, self._code.number
        # No word of C and no macro ends so.
        inputs = [f'{name}_' for name in self._mechanism.inputs]
        poses = [(f'/* {comment(about)} */', self._assigned(
            outputs, {'p->': 1.0}, map(formulas.output, outputs))) for about, outputs in groups]
        rates = [(f'/* Rates of {comment(about)} */', self._assigned(
            outputs, {f'by[{i}].': scale for i, scale in enumerate(scales)},
            formulas.parts(((), (), tuple(outputs))))) for about, outputs in groups]
        # An input without a value has no pose.
        valid = sum(map(argument, range(len(inputs))), real(0.0))
        # If it can be assembled at any input, rounding does not matter.
        if len(inputs) > 1 or not self._linkage.inputs[0].is_whole(self._linkage.reach()):
            valid = formulas.where_assembled(valid)
        parameters = ', '.join(f'{number} {x}' for x in inputs)
        return self._code.function(
            '/* The pose and, with has_rates, its rates by each input; returns 0 if there is none.'
            f' */\nLKR_FORMULA int {name}_solve({parameters}, int has_rates,\n'
            f'    {name}_pose *p, {name}_pose *by)',
            [self._code.times(x, 1.0 / scale) for x, scale in zip(inputs, scales)],
            [*poses, ('', {f'const {number} valid': valid}),
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
        return {f'{struct}{self.fields[output]}': value * (scale_of(output) / unit)
                for ((struct, unit), output), value in zip(
                    product(structs.items(), outputs), values)}
