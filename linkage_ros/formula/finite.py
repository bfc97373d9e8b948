# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The same values without NaN on the way, for gradients that are finite where a value is NaN.

Automatic differentiation multiplies what `where` does not choose by zero, and zero times NaN is
NaN, in the gradient of everything that the value came from. So all that can be NaN is computed
with another number there, and each value has the conditions under which it is right. Outputs
become NaN at the end.
"""

from __future__ import annotations

import math
from typing import Dict, FrozenSet, List, NamedTuple, Sequence

from .expression import operation, Real, unknown, where

# Conditions that all have to hold.
Conditions = FrozenSet[Real]
NONE: Conditions = frozenset()


class _Value(NamedTuple):
    """An expression without NaN, and the conditions under which it is right."""

    value: Real
    needs: Conditions


class Finite:
    """Expressions without NaN."""

    def __init__(self) -> None:
        self._known: Dict[Real, _Value] = {}
        # Each condition by its number, so that those that come together are combined once.
        self._numbers: Dict[Real, int] = {}
        self._combined: Dict[Conditions, Real] = {}

    def outputs(self, expressions: Sequence[Real]) -> List[Real]:
        """Return expressions with the same values, which become NaN at the end only."""
        for x in (x for each in expressions for x in unknown(
                each, lambda x: x.operands if x.varies else (), self._known)):
            self._known[x] = self._value(
                x, [self._known[y] for y in x.operands]) if x.varies else _Value(x, NONE)
        return [self._chosen(value, needs, math.nan) for value, needs in map(
            self._known.__getitem__, expressions)]

    def _value(self, x: Real, operands: Sequence[_Value]) -> _Value:
        values = [operand.value for operand in operands]
        needs = NONE.union(*(operand.needs for operand in operands))
        if x.op == 'argument':
            known = abs(x) < math.inf
            value = where(known, x, 0.0)
            # Of no conditions all hold, for arrays of any kind.
            self._combined.setdefault(NONE, abs(value) < math.inf)
            return self._needing(known, value, NONE)
        if x.op == 'rated':
            return operands[0]
        if x.op == 'where':
            return self._either(*operands)
        if x.op in ('less', 'less_equal'):
            # NaN is neither less nor equal.
            known = Real(x.op, tuple(values))
            return _Value(_both(self._all(needs), known) if needs else known, NONE)
        if x.op in ('root', 'gated'):
            *_, value, tolerance = values
            found = _root(value) if x.op == 'root' else values[0]
            return self._needing(-tolerance <= value, found, needs)
        if x.op in ('divide', 'atan2', 'sqrt'):
            # Where they have no rate.
            values[-1] = self._chosen(values[-1], needs, 1.0)
        return _Value(Real(x.op, tuple(values), positive=x.positive), needs)

    def _needing(self, condition: Real, value: Real, needs: Conditions) -> _Value:
        """Return a value that needs one more condition."""
        if not condition.varies:
            return _Value(where(condition, value, math.nan), needs)
        self._numbers.setdefault(condition, len(self._numbers))
        return _Value(value, needs | {condition})

    def _either(self, condition: _Value, chosen: _Value, otherwise: _Value) -> _Value:
        """Return one of two values, with the conditions of that one."""
        value = where(condition.value, chosen.value, otherwise.value)
        common = chosen.needs & otherwise.needs
        if chosen.needs == otherwise.needs:
            return _Value(value, common)
        own = (self._all(each.needs - common) for each in (chosen, otherwise))
        return self._needing(where(condition.value, *own), value, common)

    def _chosen(self, value: Real, needs: Conditions, otherwise: float) -> Real:
        return where(self._all(needs), value, otherwise) if needs else value

    def _all(self, needs: Conditions) -> Real:
        """Return whether all of some conditions hold."""
        if needs not in self._combined:
            last = max(needs, key=self._numbers.__getitem__)
            others = needs - {last}
            self._combined[needs] = _both(self._all(others), last) if others else last
        return self._combined[needs]


def _both(one: Real, other: Real) -> Real:
    return where(one, other, one)


def _root(x: Real) -> Real:
    """Return the root of a positive number, else 0; both branches have finite rates."""
    positive = 0.0 < x
    return where(positive, operation('sqrt', where(positive, x, 1.0)), 0.0)
