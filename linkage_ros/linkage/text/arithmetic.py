# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Arithmetic in joint lines: expressions of numbers and dimensions, without spaces.

    2*drive     -base/2     (a+b)*1.5e-3     max(rod,finger)     sqrt(a*a+b*b)     pi/2     -30deg
"""

from __future__ import annotations

import math
import operator
import re
from typing import Any, Callable, Dict, Iterator, List, Mapping, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike

from ...formula.expression import Real, real, square_root, where
from ...words import quoted

# A number, or the name of a dimension or an operation.
Step = Union[float, str]
# Power of a length in a result; None for zero, which has any power, NaN for mixed powers.
Degree = Optional[float]

# The largest number; the smallest is its inverse.
LARGEST_NUMBER = 1e70
IN_RANGE = '0 or between 1e-70 and 1e70'

_TOKEN = re.compile(r'(?P<number>(?:0|[1-9][0-9]*|(?=\.[0-9]))(?:\.[0-9]*)?(?:[eE][+-]?[0-9]+)?)'
                    r'|(?P<opened>(?:max|sqrt)?\()|(?P<name>[A-Za-z][A-Za-z0-9_]*)'
                    r'|(?P<sign>[-+*/,)])')
_TAKES: Mapping[Step, int] = {
    '+': 2, '-': 2, '*': 2, '/': 2, 'max': 2, 'sqrt': 1, 'deg': 1, 'negative ': 1}
_BINDS = {'+': 1, '-': 1, '*': 2, '/': 2, 'negative ': 3}
ARITHMETIC_WORDS = 'pi', 'deg', 'max', 'sqrt'

_EXPRESSIONS: Mapping[Step, Callable] = {
    '+': operator.add, '-': operator.sub, '*': operator.mul, '/': operator.truediv,
    'negative ': operator.neg, 'max': lambda x, y: where(x < y, y, x), 'sqrt': square_root,
    'deg': lambda x: x * (math.pi / 180.0)}
_VALUES: Mapping[Step, Callable] = {
    **_EXPRESSIONS, '/': np.divide, 'max': np.maximum, 'sqrt': np.sqrt}


def _alike(x: Degree, y: Degree) -> Degree:
    return y if x is None else x if y is None or x == y else math.nan


_DEGREES: Mapping[Step, Callable] = {
    '+': _alike, '-': _alike, 'max': _alike, 'negative ': lambda x: x, 'deg': lambda x: x,
    '*': lambda x, y: None if x is None or y is None else x + y,
    '/': lambda x, y: x if x is None else math.nan if y is None else x - y,
    'sqrt': lambda x: x and x / 2}


def in_range(number: ArrayLike) -> Any:
    """Return whether a number, or each of an array, satisfies IN_RANGE."""
    size = np.abs(number)
    return (number == 0.0) | (size >= 1.0 / LARGEST_NUMBER) & (size <= LARGEST_NUMBER)


class Formula:
    """
    An expression in postfix order, with constant parts evaluated.

    Raises ValueError if the text is invalid, or a number in it violates IN_RANGE.
    """

    def __init__(self, text: str):
        self.text = text
        self._steps: List[Step] = []
        self.words: Dict[str, bool] = {}
        self._parse()
        self.names = tuple(word for word in self.words if word not in ARITHMETIC_WORDS)

    @property
    def degree(self) -> Degree:
        """Return its power of a length: 0, 1, ...; None if zero, NaN if mixed."""
        return self._worked_out(lambda leaf: 1 if leaf in self.names else 0 if leaf else None,
                                _DEGREES)

    def expression(self, symbols: Mapping[str, Real]) -> Real:
        """Return it as an expression of dimensions."""
        return self._worked_out(lambda leaf: symbols[leaf] if leaf in symbols else real(leaf),
                                _EXPRESSIONS)

    def value(self, dimensions: Mapping[str, Any]) -> Any:
        """Return its value for dimensions, numbers or arrays; not finite where undefined."""
        with np.errstate(all='ignore'):
            return self._worked_out(
                lambda leaf: np.float64(leaf) if isinstance(leaf, float) else dimensions[leaf],
                _VALUES)

    def _worked_out(self, leaf: Callable, operations: Mapping[Step, Callable]) -> Any:
        stack: List[Any] = []
        for step in self._steps:
            taken = _TAKES.get(step, 0)
            operands = stack[len(stack) - taken:]
            del stack[len(stack) - taken:]
            stack.append(operations[step](*operands) if taken else leaf(step))
        return stack.pop()

    def _parse(self) -> None:
        """Fill the steps; operators and parentheses wait until what they bind is complete."""
        waiting: List[str] = []
        begins = True
        for kind, word in self._tokens():
            begins = (self._operand if begins else self._operator)(kind, word, waiting)
        if begins:
            raise self._error()
        self._complete(waiting)
        if waiting:
            raise self._error()

    def _tokens(self) -> Iterator[Tuple[Optional[str], str]]:
        at = 0
        while at < len(self.text):
            token = _TOKEN.match(self.text, at)
            if not token:
                raise self._error()
            if token.lastgroup == 'name':
                self.words[token[0]] = True
            yield token.lastgroup, token[0]
            at = token.end()

    def _operand(self, kind: Optional[str], word: str, waiting: List[str]) -> bool:
        """Process a word in an operand's place; return whether an operand is still expected."""
        if word == '-' or kind == 'opened':
            waiting.append('negative ' if word == '-' else word)
            return True
        if kind == 'sign' or word in ARITHMETIC_WORDS and word != 'pi':
            raise self._error()
        self._steps.append(math.pi if word == 'pi' else word if kind == 'name' else
                           self._number(word))
        return False

    def _operator(self, kind: Optional[str], word: str, waiting: List[str]) -> bool:
        """Process a word after an operand; return whether another operand is expected."""
        if word == 'deg':
            self._work_out(word)
            return False
        if kind != 'sign':
            raise self._error()
        self._complete(waiting, _BINDS.get(word, 0))
        if word in _BINDS:
            waiting.append(word)
            return True
        opened = waiting.pop() if waiting else ''
        if (opened == 'max(') != (word == ',') or not opened:
            raise self._error()
        if word == ',':
            waiting.append('max,')
        elif opened != '(':
            self._work_out(opened[:-1])
        return word == ','

    def _complete(self, waiting: List[str], binding: int = 0) -> None:
        """Apply waiting operators from the last, down to a parenthesis or a looser one."""
        while waiting and _BINDS.get(waiting[-1], -1) >= binding:
            self._work_out(waiting.pop())

    def _work_out(self, step: str) -> None:
        operands = self._steps[-_TAKES[step]:]
        if step == '/' and operands[1] == 0.0:
            raise ValueError(f'{quoted(self.text)} divides by zero')
        if not all(isinstance(operand, float) for operand in operands):
            self._steps.append(step)
            return
        with np.errstate(all='ignore'):
            self._steps[-_TAKES[step]:] = [self._ranged(float(_VALUES[step](*operands)))]

    def _number(self, word: str) -> float:
        number = float(word)
        if not number and word.lower().split('e')[0].strip('0.'):
            raise self._out_of_range(word, 'too small')
        return self._ranged(number, word)

    def _ranged(self, number: float, word: Optional[str] = None) -> float:
        if in_range(number):
            return number
        size = abs(number)
        raise self._out_of_range(word or self.text, 'too large' if size > LARGEST_NUMBER else
                                 'too small' if size < 1.0 else 'not real')

    def _out_of_range(self, word: str, wrong: str) -> ValueError:
        return ValueError(f'{quoted(word)} is {wrong}: a number is {IN_RANGE}')

    def _error(self) -> ValueError:
        return ValueError(f'{quoted(self.text)} is not a number, dimension or arithmetic on them; '
                          'allowed: + - * / ( ) max(a,b) sqrt(a) pi 30deg')
