# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Arithmetic in joint lines: expressions of numbers and dimensions, without spaces.

    2*drive     -base/2     (a+b)*1.5e-3     max(rod,finger)     sqrt(a*a+b*b)     pi/2     -30deg
"""

from __future__ import annotations

from functools import reduce
import math
import operator
import re
from typing import Any, Callable, Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from ...formula.expression import dimension, Real, real, square_root, where
from ...formula.program import evaluate
from ...words import short_repr

# A number, or the name of a dimension or an operation.
Step = float | str

# The largest number; the smallest is its inverse.
MAX_NUMBER = 1e70
IN_RANGE = '0 or between 1e-70 and 1e70'

_TOKEN = re.compile(r'(?:0|[1-9][0-9]*|(?=\.[0-9]))(?:\.[0-9]*)?(?:[eE][+-]?[0-9]+)?'
                    r'|(?:max|sqrt)?\(|[A-Za-z][A-Za-z0-9_]*|[-+*/,)]')
_OPERANDS: Mapping[Step, int] = {
    '+': 2, '-': 2, '*': 2, '/': 2, 'max': 2, 'sqrt': 1, 'deg': 1, 'negative ': 1}
_BINDS = {'+': 1, '-': 1, '*': 2, '/': 2, 'negative ': 3}
# What an open parenthesis and the next comma or parenthesis become, and whether that is applied.
_CLOSED = {('(', ')'): '', ('sqrt(', ')'): 'sqrt', ('max(', ','): 'max,', ('max,', ')'): 'max'}
ARITHMETIC_WORDS = 'pi', 'deg', 'max', 'sqrt'

_EXPRESSIONS: Mapping[Step, Callable] = {
    '+': operator.add, '-': operator.sub, '*': operator.mul, '/': operator.truediv,
    'negative ': operator.neg, 'max': lambda x, y: where(x < y, y, x), 'sqrt': square_root,
    'deg': lambda x: x * (math.pi / 180.0)}


def in_range(number: ArrayLike) -> Any:
    """Return whether a number, or each of an array, satisfies IN_RANGE."""
    size = np.abs(number)
    return (number == 0.0) | (size >= 1.0 / MAX_NUMBER) & (size <= MAX_NUMBER)


class Formula:
    """
    An expression in postfix order, with constant parts evaluated.

    Raises ValueError if the text is invalid, or a constant part violates IN_RANGE.
    """

    def __init__(self, text: str):
        self.text = text
        self._steps: list[Step] = []
        tokens = _TOKEN.findall(text)
        self.words = {token: True for token in tokens if token[0].isalpha() and token[-1] != '('}
        self.names = tuple(word for word in self.words if word not in ARITHMETIC_WORDS)
        try:
            if ''.join(tokens) != text:
                raise LookupError
            self._parse(tokens)
        except LookupError:
            raise ValueError(
                f'{short_repr(text)} is not a number, dimension or arithmetic on them; '
                'allowed: + - * / ( ) max(a,b) sqrt(a) pi 30deg') from None

    @property
    def is_angle(self) -> bool:
        """Whether it has deg or pi, and so is an angle [rad]."""
        return not {'deg', 'pi'}.isdisjoint(self.words)

    def expression(self, symbols: Mapping[str, Real]) -> Real:
        """Return it as an expression of dimensions."""
        stack: list[Real] = []
        for step in self._steps:
            count = _OPERANDS.get(step, 0)
            operands = stack[len(stack) - count:]
            del stack[len(stack) - count:]
            stack.append(_EXPRESSIONS[step](*operands) if count else
                         symbols[step] if isinstance(step, str) else real(step))
        return stack.pop()

    def value(self, dimensions: Mapping[str, Any]) -> Any:
        """Return its value for dimensions, numbers or arrays; NaN where a part is not finite."""
        symbols = {name: dimension(name, positive=False) for name in self.names}
        parts: dict[Real, Any] = {}
        value = evaluate(self.expression(symbols), dimensions, parts)
        is_finite = reduce(np.logical_and, map(np.isfinite, parts.values()))
        return np.where(is_finite, value, np.nan)[()]

    def _parse(self, tokens: Iterable[str]) -> None:
        """Fill the steps; operators and parentheses wait until what they bind is complete."""
        waiting: list[str] = []
        begins = True
        for token in tokens:
            if begins:
                if begins := token == '-' or token[-1] == '(':
                    waiting.append('negative ' if token == '-' else token)
                elif token in self.names:
                    self._steps.append(token)
                elif token != 'pi' and token[0] not in '.0123456789':
                    raise LookupError
                else:
                    self._add_constant(math.pi if token == 'pi' else float(token))
            elif token == 'deg':
                self._apply(token)
            elif token not in _BINDS and token not in ',)':
                raise LookupError
            else:
                while waiting and _BINDS.get(waiting[-1], -1) >= _BINDS.get(token, 0):
                    self._apply(waiting.pop())
                if token not in _BINDS:
                    closed = _CLOSED[waiting.pop(), token]
                    token = closed if closed == 'max,' else ')'
                    if closed in _OPERANDS:
                        self._apply(closed)
                if begins := token != ')':
                    waiting.append(token)
        if begins:
            raise LookupError
        while waiting:
            self._apply(waiting.pop())

    def _apply(self, step: str) -> None:
        operands: list[Any] = self._steps[-_OPERANDS[step]:]
        if step == '/' and operands[1] == 0.0:
            self._add_constant(math.inf)
        if not all(isinstance(operand, float) for operand in operands):
            self._steps.append(step)
            return
        del self._steps[-len(operands):]
        self._add_constant(float(evaluate(_EXPRESSIONS[step](*map(real, operands)), {}, {})))

    def _add_constant(self, number: float) -> None:
        if not in_range(number):
            raise ValueError(f'{short_repr(self.text)} must be {IN_RANGE}')
        self._steps.append(number)
