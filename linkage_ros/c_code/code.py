# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Formulas as C functions."""

from __future__ import annotations

import re
import sys
from textwrap import wrap
from typing import Any, Iterable, Mapping, Sequence

import numpy as np

from .names import comment
from ..formula.expression import Real
from ..formula.operations import OPERATIONS
from ..formula.program import Dialect, Program, tolerant
from ..linkage import IN_SINGLE
from ..scene import SceneMechanism

# Names of constants, arguments and values.
_NAMED = re.compile(r'\b[kx]\d+\b')
# Expressions that are true or false.
_CONDITIONS = ('less', 'less_equal')
# Longest line of code, and longest formula of a constant in its comment.
LINE, MAX_FORMULA = 100, 50


class _Call(str):
    """The template of a call, whose arguments need no parentheses."""

    def format(self, *args: Any, **kwargs: Any) -> str:
        return super().format(*map(bare, args), **kwargs)


class Code:
    """
    Writes C for one mechanism.

    Parameters
    ----------
    mechanism : SceneMechanism
        The mechanism.
    single : bool
        Whether it computes with float instead of double.

    """

    def __init__(self, mechanism: SceneMechanism, single: bool = False):
        self.name, self.linkage, self.single = mechanism.name, mechanism.linkage, single
        self.number, suffix = ('float', 'f') if single else ('double', '')
        # Tolerances have the rounding of the type.
        self._rounding: Mapping[Any, float] = IN_SINGLE if single else {}
        self._dialect = Dialect({
            operation: row.c if row.c.startswith('(') else _Call(row.c.replace('{f}', suffix))
            for operation, row in OPERATIONS.items()}, {}, lambda value:
                self.literal(self._rounding.get(value, value)))

    def literal(self, value: float) -> str:
        """Return a number in C; raise ValueError if a length makes it NaN, at any input."""
        if value != value:
            raise ValueError(f'{self.name} cannot be assembled with its lengths')
        if abs(value) > (3.4e38 if self.single else sys.float_info.max):
            return '-INFINITY' if value < 0.0 else 'INFINITY'
        if not self.single:
            return repr(float(value))
        # The shortest text of a float32, as Python writes it: versions of numpy differ.
        return f'{float(str(np.float32(value)))!r}f' if abs(value) > 1.2e-38 else '0.0f'

    def row(self, values: Iterable[Any]) -> str:
        """Return numbers, texts and rows of them as an initializer."""
        return '{ %s }' % ', '.join(
            value if isinstance(value, str) else self.literal(value)
            if isinstance(value, (int, float)) else self.row(value) for value in values)

    def times(self, code: str, factor: float) -> str:
        """Return code times a number."""
        return bare(code) if factor == 1.0 else f'{self.literal(factor)} * {code}'

    def function(self, head: str, arguments: Sequence[str],
                 blocks: Sequence[tuple[str, Mapping[str, Real]]], last: str) -> str:
        """
        Return a C function, from the code of its arguments; see `Program`.

        Each of its `blocks` is a line above it and the values that it assigns, by their places.
        `last` is its last statement.
        """
        results = tolerant(
            [x for _, assigned in blocks for x in assigned.values()], self._rounding)
        program = Program(results, len(arguments))
        exact: dict[Real, Any] = {}
        program.bind(self.linkage.dimensions, exact)
        # What lengths decide, such as which bars are equal, is decided in double precision.
        known = {x: self._rounding.get(x.value, value) for x, value in exact.items()
                 if x.op in _CONDITIONS or x.value in self._rounding}
        pose = program.bind(self.linkage.dimensions, known)
        constants, statements, codes = pose.statements(self._dialect)
        # A value is computed in the first block that needs it.
        numbers, reached, body = pose.variant.listing.outputs, -1, []
        for above, assigned in blocks:
            n = len(assigned)
            reached = max([reached, *numbers[:n]])
            ready = [line for line in statements if int(line[0][1:]) <= reached]
            body += [above] * bool(above)
            body += [f'const {self.number} {name} = {bare(code)};' for name, code in ready]
            body += [f'{place} = {bare(code)};' for place, code in zip(assigned, codes)]
            statements, numbers, codes = statements[len(ready):], numbers[n:], codes[n:]
        # How constants follow from lengths, as text where that is short.
        formulas: dict[Real, str] = {}
        for x in pose.variant.steps:
            parts = [formulas[y] for y in x.operands]
            formula = OPERATIONS[x.op].python.format(*parts) if parts else str(x.args[0])
            formulas[x] = formula if all(parts) and len(formula) <= MAX_FORMULA else ''
        # Lengths have names and come first; coordinates of points on links are dimensions, too.
        names, declared = {}, {}
        for (name, value), node in zip(constants.items(), pose.variant.constants):
            if node.op == 'dimension' and node.args[0].isidentifier():
                names[name] = f'length_{node.args[0]}'
            about = f' /* {comment(bare(formulas[node]))} */' * ('(' in formulas[node])
            declared[names.get(name, name)] = f'{self.literal(value)};{about}'
        text = _NAMED.sub(lambda name: names.get(name[0], name[0]), '\n'.join([*body, last]))
        used = {*_NAMED.findall(text)}
        lines = [f'const {self.number} {name} = {declared[name]}'
                 for name in sorted(declared, key=lambda name: name.startswith('k'))]
        lines += [f'const {self.number} x{i} = {code};' if f'x{i}' in used else f'(void){code};'
                  for i, code in enumerate(arguments) if f'x{i}' in used or code.isidentifier()]
        return '\n'.join([head, '{', indented(lines + text.split('\n')), '}', ''])


def bare(code: str) -> str:
    """Return code of an operation without the parentheses around it."""
    return code[1:-1] if code.startswith('(') else code


def indented(lines: Iterable[str]) -> str:
    """Return the lines of a function's body, broken if they are long."""
    return '\n'.join(part for line in lines for part in wrap(
        f'    {line}', LINE - 1, subsequent_indent='        ', break_long_words=False,
        break_on_hyphens=False))
