# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Poses of a linkage as C functions, for constant or changeable dimensions."""

from __future__ import annotations

import math
import re
from typing import Any, Callable, Dict, Iterable, Iterator, List, Sequence, Tuple

import numpy as np

from .names import literal as text_literal
from ..formula.expression import Real, real, unknown
from ..formula.operations import OPERATIONS
from ..formula.program import Dialect, evaluate, Pose
from ..linkage import IN_SINGLE, Mechanism

# Expressions that are true or false.
_CONDITIONS = ('less', 'less_equal')
# Names of constants, arguments and values.
_NAMED = re.compile(r'\b[kxv]\d+\b')


class Code:
    """
    Writes C for one linkage.

    Parameters
    ----------
    name : str
        Prefix of its functions.
    linkage : Mechanism
        The linkage; with changeable dimensions it is that of `open_linkage`.
    single : bool
        Whether it computes with float instead of double.
    is_open : bool
        Whether the constants are in a struct, for changeable dimensions.

    """

    def __init__(self, name: str, linkage: Mechanism, single: bool = False,
                 is_open: bool = False):
        self.name, self.linkage, self.is_open = name, linkage, is_open
        self.number, self.suffix = ('float', 'f') if single else ('double', '')
        self.literal = _literal(single)
        self.dialect = Dialect(
            {operation: row.c.replace('{f}', self.suffix).replace('{name}', name)
             for operation, row in OPERATIONS.items()}, {},
            lambda value: self.literal(IN_SINGLE.get(value, value) if single else value))
        self._constants: Dict[Real, int] = {}

    def rows(self, rows: Iterable[Iterable[float]]) -> str:
        """Return rows of numbers as initializers."""
        return ', '.join('{ %s }' % ', '.join(map(self.literal, row)) for row in rows)

    def times(self, code: str, factor: float) -> str:
        """Return code times a number."""
        return code if factor == 1.0 else f'{self.literal(factor)} * ({code})'

    def function(self, head: str, pose: Pose, arguments: Sequence[str],
                 ending: Callable[[List[str]], List[str]]) -> str:
        """Return a C function with the operations of a Pose, from the code of its arguments."""
        constants, listed, outputs = pose.statements(self.dialect)
        ends = ending(outputs)
        lines: List[Tuple[str, str]] = []
        used = set(_NAMED.findall('\n'.join(ends)))
        # Compilers warn of what is computed and not used, such as a coordinate with a load.
        for name, code in reversed(listed):
            if name in used:
                lines.insert(0, (name, code))
                used.update(_NAMED.findall(code))
        nodes = dict(zip(constants, pose.variant.constants))
        body = [f'    const {_kind(nodes[name], self.number)} {name} = '
                f'{self.constant(nodes[name], value)};'
                for name, value in constants.items() if name in used]
        body += [f'    const {self.number} x{i} = {code};' for i, code in enumerate(arguments)
                 if f'x{i}' in used]
        body += [f'    const {self.number} {name} = {code};' for name, code in lines]
        body += [f'    (void){code};' for i, code in enumerate(arguments)
                 if f'x{i}' not in used and code.isidentifier()]
        if self.is_open and not any('c->' in line for line in (*body, *ends)):
            body.append('    (void)c;')
        return '\n'.join([head, '{', *body, *ends, '}', ''])

    def constant(self, node: Real, value: float) -> str:
        """Return the code of an expression of dimensions, and its value as a constant."""
        if not self.is_open:
            return self.literal(self._in_float(node, value) if self.suffix else value)
        code = f'c->k[{self._constants.setdefault(node, len(self._constants))}]'
        return f'{code} > 0.5' if node.op in _CONDITIONS else code

    def _in_float(self, node: Real, value: float) -> float:
        """Return the value of an expression of dimensions with the rounding of float."""
        known: Dict[Real, Any] = {}
        for x in unknown(node, lambda x: x.operands, known):
            known[x] = None if x.value is None else IN_SINGLE.get(x.value)
        known = {x: rounding for x, rounding in known.items() if rounding is not None}
        return float(evaluate(node, self.linkage.lengths, known)) if known else value

    def helpers(self) -> str:
        """Return the helper functions for roots and gates, which are NaN out of reach."""
        n, number, f, zero = self.name, self.number, self.suffix, self.literal(0.0)
        return '\n'.join([
            '/* A limit that is missed by rounding counts as reached. */',
            f'static inline {number} {n}_root({number} x, {number} tolerance)', '{',
            f'    return x > {zero} ? sqrt{f}(x) : x >= -tolerance ? {zero} : ({number})NAN;', '}',
            '',
            f'static inline {number} {n}_gated({number} x, {number} margin, {number} tolerance)',
            '{', f'    return margin >= -tolerance ? x : ({number})NAN;', '}', ''])

    def struct(self) -> str:
        """Return the struct of constants; it is complete once all functions are written."""
        return '\n'.join(['/* Constants that depend on the dimensions. */', 'typedef struct {',
                          f'    double k[{max(len(self._constants), 1)}];', '    int is_own;',
                          f'}} {self.name}_linkage;', ''])

    def setter(self) -> str:
        """Return the function that fills the struct of constants from dimensions."""
        places = {name: i for i, name in enumerate(self.linkage.dimensions)}
        demands = list(self._demands())
        number: Dict[Real, int] = {}
        for root in (*self._constants, *(node for node, _ in demands)):
            for node in unknown(root, lambda node: node.operands, number):
                number[node] = len(number)

        def value(node: Real) -> str:
            if node.op == 'constant':
                return self.literal(node.args[0])
            if node.op == 'dimension':
                return f'dimension[{places[node.args[0]]}]' if node.args[0] in places else '1.0'
            args = [f'd{number[x]}' for x in node.operands]
            return self.dialect.templates[node.op].format(*args)

        given = [node for node in number if node.op == 'dimension' and node.args[0] in places]
        tests = [(node, node.positive, f'{node.args[0]} must be a {"positive " * node.positive}'
                                       'number [m]') for node in reversed(given)]
        tests += [(node, True, text) for node, text in demands]
        own = ' && '.join(f'dimension[{i}] == {self.literal(float(np.ravel(value)[0]))}'
                          for i, value in enumerate(self.linkage.dimensions.values())) or '1'
        return '\n'.join([
            '/* Set dimensions; returns 0, or what is wrong with them. */',
            f'static inline const char *{self.name}_set({self.name}_linkage *c, '
            'const double *dimension)', '{',
            *(f'    const {_kind(node, "double")} d{i} = {value(node)};'
              for node, i in number.items()),
            *(f'    if (!({f"d{number[node]} > 0.0 && " * positive}isfinite(d{number[node]})))\n'
              f'        return {text_literal(text)};' for node, positive, text in tests),
            *(f'    c->k[{i}] = d{number[node]};' for node, i in self._constants.items()),
            f'    c->is_own = {own};', *([] if places else ['    (void)dimension;']),
            '    return 0;', '}', ''])

    def _demands(self) -> Iterator[Tuple[Real, str]]:
        """Yield expressions of dimensions that must be positive, with their error messages."""
        built = self.linkage.structure.built
        for bar in built.bars:
            yield bar.length, f'the bar {bar.first}-{bar.second} must be longer than zero'
        for name, height in built.triangles.items():
            yield (abs(height) + real(1.0),
                   f'no triangle has the sides at {name}: each must be shorter than the others')
        for input_ in built.inputs:
            if not input_.turns:
                yield real(input_.high) - input_.low, f'the {input_.name} must have a way to go'


def open_linkage(linkage: Mechanism) -> Mechanism:
    """Return a linkage whose code is valid for all dimensions."""
    return linkage.with_dimensions(**{
        name: np.array([value]) for name, value in linkage.dimensions.items()})


def _kind(node: Real, number: str) -> str:
    return 'int' if node.op in _CONDITIONS else number


def _literal(single: bool) -> Callable[[float], str]:
    """Return the function that writes a number in C."""
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
        text = _shortest(value) if single else repr(float(value))
        return text + f

    return literal


def _shortest(value: float) -> str:
    """Return the shortest text of a float32, as Python writes it: versions of numpy differ."""
    return repr(float(str(np.float32(value))))
