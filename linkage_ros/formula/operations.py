# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Operations on real numbers: a table with the code for all back ends, and the derivatives.

All back ends have the same results in float64. Elementary functions are those of the C library, of
numpy for arrays, and of `elementary` for arrays in machine code.
"""

from __future__ import annotations

import math
import operator
from typing import Any, Callable, NamedTuple

import numpy as np


class Operation(NamedTuple):
    """
    An operation, by the name that it has in expressions and in code over arrays.

    `python` is its code on floats, with its operands in braces, which may raise where IEEE 754 has
    inf or nan; `numpy` does the same on arrays. `llvm` appends it to a function, from a
    `llvm_code.Builder` and its operands, numbers or vectors. `c` is C99 with the functions of
    `c_code`: {f} is the suffix of functions for a type of numbers; if it equals `python`, it is an
    operator, for arrays too. `rate` returns the derivative, from `expression.operation`, the
    expression and the rates of its operands; None: piecewise constant. `folded` returns the
    result if it needs no evaluation, else None. The result is positive if the operands with the
    indices `positive` are.
    """

    name: str
    python: str
    numpy: Callable
    llvm: Callable
    c: str
    rate: Any = None
    folded: Callable | None = None
    positive: tuple[int, ...] = ()

    @property
    def array(self) -> str:
        """Code on arrays, as `python`; numpy's operators reuse the memory of temporary arrays."""
        operands = ', '.join(self.c.count('{}') * ['{}'])
        return self.python if self.c == self.python else f'{self.name}({operands})'


# The rounding error of x + y: that of x's part of the sum, plus that of y's part.
SUM_ERROR = '(({0} - (({0} + {1}) - (({0} + {1}) - {0}))) + ({1} - (({0} + {1}) - {0})))'


def _root(x: Any, tolerance: Any) -> Any:
    # The root of a negative zero is zero, as elsewhere.
    return np.where((x > 0.0) | (x >= -tolerance), np.sqrt(np.maximum(x, 0.0)) + 0.0, np.nan)


def _valid_where(x: Any, margin: Any, tolerance: Any) -> Any:
    return np.where(margin >= -tolerance, x, np.nan)


def _sum_error(x: Any, y: Any) -> Any:
    total = x + y
    added = total - x
    return (x - (total - added)) + (y - added)


def _sum_error_in_llvm(b: Any, x: Any, y: Any) -> Any:
    total = b.fadd(x, y)
    added = b.fsub(total, x)
    return b.fadd(b.fsub(x, b.fsub(total, added)), b.fsub(y, added))


def _root_in_llvm(b: Any, x: Any, tolerance: Any) -> Any:
    reached = _valid_where_in_llvm(b, x.type(0.0), x, tolerance)
    return b.select(b.fcmp_ordered('>', x, x.type(0.0)), b.call_by_name('llvm.sqrt', x), reached)


def _valid_where_in_llvm(b: Any, x: Any, margin: Any, tolerance: Any) -> Any:
    return b.select(b.fcmp_ordered('>=', margin, b.fneg(tolerance)), x, x.type(math.nan))


def _constants(function: Callable) -> Callable:
    """Return a folding rule that evaluates a function of constants."""
    def folded(*operands: Any) -> float | None:
        for x in operands:
            if x.op != 'constant':
                return None
        return function(*(x.value for x in operands))

    return folded


def _product_rule(do: Callable, n: Any, dx: Any, dy: Any) -> Any:
    x, y = n.args
    return 2.0 * (dx * x) if x is y else dx * y + x * dy


def _angle_rule(do: Callable, n: Any, dy: Any, dx: Any) -> Any:
    y, x = n.args
    return (x * dy - y * dx) / (x * x + y * y)


# In rules n is the expression that is differentiated, dx, dy, ... are the rates of its operands.
OPERATIONS = {row.name: row for row in (
    Operation('add', '({} + {})', operator.add, lambda b, x, y: b.fadd(x, y), '({} + {})',
              lambda do, n, dx, dy: dx + dy, _constants(operator.add), (0, 1)),
    Operation('subtract', '({} - {})', operator.sub, lambda b, x, y: b.fsub(x, y), '({} - {})',
              lambda do, n, dx, dy: dx - dy, _constants(operator.sub)),
    Operation('multiply', '({} * {})', operator.mul, lambda b, x, y: b.fmul(x, y), '({} * {})',
              _product_rule, _constants(operator.mul), (0, 1)),
    # The exact rounding error of a sum. Source: Knuth, TAOCP 2, sec. 4.2.2, theorem B.
    Operation('sum_error', SUM_ERROR, _sum_error, _sum_error_in_llvm, SUM_ERROR,
              folded=_constants(_sum_error)),
    Operation('divide', '({} / {})', operator.truediv, lambda b, x, y: b.fdiv(x, y), '({} / {})',
              lambda do, n, dx, dy: (dx - n * dy) / n.args[1], None, (0, 1)),
    Operation('negative', '(-{})', operator.neg, lambda b, x: b.fneg(x), '(-{})',
              lambda do, n, dx: -dx, _constants(operator.neg)),
    Operation('absolute', 'abs({})', np.absolute, lambda b, x: b.call_by_name('llvm.fabs', x),
              'fabs{f}({})', lambda do, n, dx: do('where', n.args[0] < 0.0, -dx, dx),
              _constants(abs)),
    Operation('sqrt', 'sqrt({})', np.sqrt, lambda b, x: b.call_by_name('llvm.sqrt', x),
              'sqrt{f}({})', lambda do, n, dx: dx / (2.0 * n),
              _constants(lambda x: math.sqrt(x) if x >= 0.0 else math.nan), (0,)),
    Operation('sin', 'sin({})', np.sin, lambda b, x: b.call_by_name('llvm.sin', x), 'sin{f}({})',
              lambda do, n, dx: do('cos', *n.args) * dx, _constants(math.sin)),
    Operation('cos', 'cos({})', np.cos, lambda b, x: b.call_by_name('llvm.cos', x), 'cos{f}({})',
              lambda do, n, dx: -(do('sin', *n.args) * dx), _constants(math.cos)),
    Operation('atan2', 'atan2({}, {})', np.arctan2, lambda b, y, x: b.call_by_name('atan2', y, x),
              'lkr_angle({}, {})', _angle_rule),
    # To the nearest integer, halves to the even one.
    Operation('rint', 'copysign({0} - remainder({0}, 1.0), {0})', np.rint,
              lambda b, x: b.call_by_name('llvm.rint', x), 'rint{f}({})'),
    Operation('less', '({} < {})', operator.lt, lambda b, x, y: b.fcmp_ordered('<', x, y),
              '({} < {})'),
    Operation('less_equal', '({} <= {})', operator.le,
              lambda b, x, y: b.fcmp_ordered('<=', x, y), '({} <= {})'),
    # One value where a condition holds, else another.
    Operation('where', '({1} if {0} else {2})', np.where, lambda b, c, x, y: b.select(c, x, y),
              '({} ? {} : {})', lambda do, n, _, dx, dy: do('where', n.args[0], dx, dy),
              lambda c, x, y: x if x is y or x.value is not None and x.value == y.value else None,
              (1, 2)),
    # The root of x; zero for x from -tolerance to 0, NaN below.
    Operation('root', '(sqrt({0}) if {0} > 0.0 else 0.0 if {0} >= -{1} else nan)', _root,
              _root_in_llvm, 'lkr_root({}, {})', lambda do, n, dx, _: dx / (2.0 * n)),
    # A value where a margin is at least -tolerance, else NaN.
    Operation('valid_where', '({0} if {1} >= -{2} else nan)', _valid_where, _valid_where_in_llvm,
              'lkr_valid_where({}, {}, {})',
              lambda do, n, dx, *_: do('valid_where', dx, *n.args[1:])),
)}
# Piecewise constant operations.
WITHOUT_RATE = frozenset(row.name for row in OPERATIONS.values() if row.rate is None)
