# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Formulas as functions of arrays of other packages: any namespace of Python's array API standard.

The code is that of `program` for arrays, with functions of the namespace; derivatives, devices and
compilation are the package's own.

There is no NaN on the way, for gradients that are finite where a value is NaN. Automatic
differentiation multiplies what `where` does not choose by zero, and zero times NaN is NaN, in the
gradient of everything that the value came from. So all that can be NaN is computed with another
number there, and each value has the conditions under which it is right. Outputs become NaN at the
end.
"""

from __future__ import annotations

from functools import reduce
import math
from operator import or_
from typing import Any, Callable, Mapping, Sequence

from .expression import argument, operation, Real, substituted, unknown, where
from .listing import Dialect
from .program import ARRAYS, in_order, Program, tolerant
from ..words import join_names, short_repr


def array_function(outputs: Sequence[Real], arguments: int, xp: Any, dimensions: Mapping,
                   single: dict[float, float]) -> Callable:
    """
    Return outputs as a function of arrays of a namespace, which returns a tuple of arrays.

    `single` are the numbers that take the place of others in single precision.
    """
    if not hasattr(xp, 'float64'):
        raise ValueError(f"xp must be a package with Python's array API, got {short_repr(xp)}")

    def code(dtype: Any, numbers: dict[float, float]) -> Callable:
        names = {name: _of_floats_too(name, xp, dtype) for name in (
            'sin', 'cos', 'sqrt', 'absolute', 'rint', 'where', 'atan2')}
        dialect = Dialect(ARRAYS.templates, {**ARRAYS.names, **names}, lambda value: repr(
            numbers.get(value, value)))
        program = Program(Finite().outputs(
            substituted(tolerant(outputs, numbers), {})), arguments)
        known = {x: numbers[x.value] for x in in_order(outputs) if x.value in numbers}
        return program.bind(dimensions, known).on(dialect)

    codes = (xp.float64, code(xp.float64, {})), (xp.float32, code(xp.float32, single))
    broadcast = getattr(xp, 'broadcast_arrays', None) or xp.broadcast_tensors

    def function(*arrays: Any) -> tuple[Any, ...]:
        for dtype, pose in codes:
            if [getattr(x, 'dtype', None) == dtype for x in arrays] == arguments * [True]:
                return pose(*broadcast(*arrays))
        raise ValueError(
            f'needed: {arguments} arrays of {xp.__name__}, all float64 or all float32; '
            f'got {join_names([str(getattr(x, "dtype", type(x))) for x in arrays])}')

    return function


def _of_floats_too(name: str, xp: Any, dtype: Any) -> Callable:
    """Return a function of arrays, by its name in array code, that allows floats beside them."""
    names = {'absolute': ('abs',), 'rint': ('round',), 'atan2': ('atan2', 'arctan2')}
    function = next(getattr(xp, known) for known in names.get(name, (name,)) if hasattr(xp, known))

    def applied(*operands: Any) -> Any:
        arrays = [x for x in operands if type(x) is not float]
        # `where` itself allows one float beside two arrays.
        return function(*operands) if len(arrays) > 1 else function(*[
            xp.full_like(arrays[0], x, dtype=dtype) if type(x) is float else x for x in operands])

    return applied


class Finite:
    """Expressions without NaN, each with the conditions of its validity."""

    def __init__(self) -> None:
        self._known: dict[Real, tuple[Real, int]] = {}
        self._bits: dict[Real, int] = {}
        # Of no conditions all hold, for arrays of any kind.
        self._combined = {0: abs(_finite(argument(0))) < math.inf}

    def outputs(self, expressions: Sequence[Real]) -> list[Real]:
        """Return expressions with the same values, which become NaN at the end only."""
        for x in unknown(expressions, lambda x: x.operands if x.varies else (), self._known):
            self._known[x] = self._value(
                x, [self._known[y] for y in x.operands]) if x.varies else (x, 0)
        return [where(self._all(needs), value, math.nan)
                for value, needs in map(self._known.__getitem__, expressions)]

    def _value(self, x: Real, operands: Sequence[tuple[Real, int]]) -> tuple[Real, int]:
        values = [value for value, _ in operands]
        needs = reduce(or_, [conditions for _, conditions in operands], 0)
        if x.op == 'argument':
            return _finite(x), self._bit(abs(x) < math.inf)
        if x.op in ('root', 'valid_where'):
            *_, margin, tolerance = values
            value, reached = _root(margin) if x.op == 'root' else values[0], -tolerance <= margin
            return (value, needs | self._bit(reached)) if reached.varies else (
                where(reached, value, math.nan), needs)
        if x.op in ('less', 'less_equal'):
            # NaN is neither less nor equal.
            return where(self._all(needs), Real(x.op, tuple(values)), self._all(needs)), 0
        if x.op == 'where':
            chosen, otherwise = (self._all(conditions) for _, conditions in operands[1:])
            if chosen is not otherwise:
                needs = self._bit(where(values[0], chosen, otherwise))
        elif x.op in ('divide', 'atan2', 'sqrt') and values[-1].varies:
            # Where they have no rate.
            values[-1] = where(self._all(needs), values[-1], 1.0)
        return Real(x.op, tuple(values)), needs

    def _bit(self, condition: Real) -> int:
        return self._bits.setdefault(condition, 1 << len(self._bits))

    def _all(self, needs: int) -> Real:
        """Return whether some conditions hold."""
        if needs not in self._combined:
            last = needs.bit_length() - 1
            rest, condition = needs ^ 1 << last, list(self._bits)[last]
            self._combined[needs] = where(
                self._all(rest), condition, self._all(rest)) if rest else condition
        return self._combined[needs]


def _finite(x: Real) -> Real:
    return where(abs(x) < math.inf, x, 0.0)


def _root(x: Real) -> Real:
    """Return the root of a positive number, else 0; both branches have finite rates."""
    positive = 0.0 < x
    return where(positive, operation('sqrt', where(positive, x, 1.0)), 0.0)
