# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Formulas as C functions."""

from __future__ import annotations

import math
import re
from typing import Callable, Dict, Iterable, List, NamedTuple, Sequence

import numpy as np

from .names import comment
from ..formula.expression import Real, unknown
from ..formula.operations import OPERATIONS
from ..formula.program import Dialect, evaluate, in_order, Pose
from ..linkage import IN_SINGLE, Mechanism

# Expressions that are true or false.
_CONDITIONS = ('less', 'less_equal')
# Names of constants, arguments and values.
_NAMED = re.compile(r'\b[kxv]\d+\b')
# Longest formula of a constant in a comment, and longest line of code.
FORMULA, LINE = 60, 100
# A constant's formula is written as in Python, with the names of dimensions.
_WRITTEN = {name: row.python for name, row in OPERATIONS.items()}


class Block(NamedTuple):
    """A part of a function: its comment, its number of outputs, and what is done with them."""

    about: str
    size: int
    ending: Callable[[List[str]], List[str]]


class Code:
    """
    Writes C for one linkage.

    Parameters
    ----------
    linkage : Mechanism
        The linkage.
    single : bool
        Whether it computes with float instead of double.

    """

    def __init__(self, linkage: Mechanism, single: bool = False):
        self.linkage = linkage
        self.number, self.suffix = ('float', 'f') if single else ('double', '')
        self.literal = _literal(single)
        templates = {operation: row.c.replace('{f}', self.suffix).replace('{name}', 'lkr')
                     for operation, row in OPERATIONS.items()}
        self._dialect = Dialect(
            {**templates, 'atan2': 'lkr_angle({}, {})'}, {},
            lambda value: self.literal(IN_SINGLE.get(value, value) if single else value))

    def row(self, row: Iterable[float]) -> str:
        """Return numbers as an initializer."""
        return '{ %s }' % ', '.join(map(self.literal, row))

    def times(self, code: str, factor: float) -> str:
        """Return code times a number."""
        return code if factor == 1.0 else f'{self.literal(factor)} * {code}'

    def function(self, head: str, pose: Pose, arguments: Sequence[str],
                 blocks: Sequence[Block]) -> str:
        """Return a C function with the operations of a Pose, from the code of its arguments."""
        constants, statements, outputs = pose.statements(self._dialect)
        nodes = dict(zip(constants, map(self._decided, pose.variant.constants)))
        # A value is computed in the first block that needs it.
        numbers, reached, body = pose.variant.listing.outputs, -1, []
        left, done = list(statements), 0
        for block in blocks:
            end = done + block.size
            reached = max([reached, *numbers[done:end]])
            own = [line for line in left if int(line[0][1:]) <= reached]
            left = left[len(own):]
            body.append((block.about, own, block.ending(outputs[done:end])))
            done = end
        # Compilers warn of what is computed and not used, such as a coordinate with a load.
        used = {name for *_, ends in body for name in _NAMED.findall('\n'.join(ends))}
        for name, code in reversed(statements):
            if name in used:
                used.update(_NAMED.findall(code))
        lines = []
        for about, own, ends in body:
            made = [f'const {self.number} {name} = {_bare(code)};'
                    for name, code in own if name in used]
            if made or ends:
                lines += [f'/* {comment(about)} */'] * bool(about) + made + ends
        given = [f'const {self.number} x{i} = {code};' for i, code in enumerate(arguments)
                 if f'x{i}' in used]
        given += [f'(void){code};' for i, code in enumerate(arguments)
                  if f'x{i}' not in used and code.isidentifier()]
        # Coordinates of points on links are dimensions, too.
        named = {name: f'length_{node.args[0]}' if node.op == 'dimension' and
                 node.args[0].isidentifier() else name for name, node in nodes.items()}
        # A length may have several nodes. Lengths by name come first.
        declared = sorted({self._constant(named[name], nodes[name], value): None
                           for name, value in constants.items() if name in used},
                          key=lambda line: ' length_' not in line)
        text = _NAMED.sub(lambda found: named.get(found[0], found[0]), '\n'.join(lines))
        return '\n'.join([head, '{', *indented([*declared, *given, *text.split('\n')]), '}', ''])

    def _decided(self, node: Real) -> Real:
        """Return an expression of dimensions without its conditions."""
        while node.op == 'where':
            node = node.args[1 if evaluate(node.args[0], self.linkage.dimensions, {}) else 2]
        return node

    def _constant(self, name: str, node: Real, value: float) -> str:
        """Return the declaration of an expression of dimensions."""
        kind = 'int' if node.op in _CONDITIONS else self.number
        number = self.literal(self._in_float(node, value) if self.suffix else value)
        formula = '' if node.op == 'dimension' else self._formula(node)
        return f'const {kind} {name} = {number};' + (
            f' /* {comment(formula)} */' if 0 < len(formula) <= FORMULA else '')

    def _formula(self, node: Real) -> str:
        """Return an expression of dimensions as text, '' where it is long or has no dimension."""
        node, has_dimension = self._decided(node), False
        text: Dict[Real, str] = {}
        for x in unknown([node], lambda x: [*map(self._decided, x.operands)], text):
            if x.operands:
                parts = [text[self._decided(part)] for part in x.operands]
                text[x] = _WRITTEN[x.op].format(*parts) if all(parts) else ''
                text[x] = text[x] if len(text[x]) <= FORMULA else ''
            else:
                has_dimension = has_dimension or x.op == 'dimension'
                text[x] = x.args[0] if x.op == 'dimension' else f'{x.args[0]:.6g}'
        return _bare(text[node]) if has_dimension else ''

    def _in_float(self, node: Real, value: float) -> float:
        """Return the value of an expression of dimensions with the rounding of float."""
        known = {x: IN_SINGLE[x.value] for x in in_order([node]) if x.value in IN_SINGLE}
        return float(evaluate(node, self.linkage.dimensions, known)) if known else value


def indented(lines: Iterable[str]) -> List[str]:
    """Return lines of a function's body, broken after operators if they are long."""
    made = []
    for line in lines:
        line = f'    {line}'
        while len(line) > LINE:
            cut = max(line.rfind(sign, 12, LINE) for sign in (' + ', ' - ', ' * ', ' / ', ', '))
            if cut < 0 or '/*' in line:
                break
            # A comma ends its line, an operator begins the next.
            cut += line[cut] == ','
            made.append(line[:cut])
            line = f'        {line[cut + 1:]}'
        made.append(line)
    return made


def _bare(code: str) -> str:
    """Return code without parentheses around all of it."""
    if not code.startswith('('):
        return code
    depth = 0
    for i, letter in enumerate(code):
        depth += (letter == '(') - (letter == ')')
        if depth == 0:
            return code[1:-1] if i == len(code) - 1 else code
    return code


def _literal(single: bool) -> Callable[[float], str]:
    """Return the function that writes a number in C."""
    def literal(value: float) -> str:
        if math.isnan(value):
            return 'LKR_NAN'
        if single:
            value = float(np.float32(value)) if abs(value) <= 3.4e38 else math.copysign(
                math.inf, value)
            value = value if abs(value) > 1.2e-38 else 0.0
        if math.isinf(value):
            return f'({"-" * (value < 0.0)}INFINITY)'
        return f'{_shortest(value)}f' if single else repr(float(value))

    return literal


def _shortest(value: float) -> str:
    """Return the shortest text of a float32, as Python writes it: versions of numpy differ."""
    return repr(float(str(np.float32(value))))
