# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Symbolic expressions of real and complex numbers.

A construction of `linkage.geometry` is written once, with ordinary operators on `Real` and
`Complex` values. Its result is an expression graph: `program` generates code from it for single
poses, arrays and machine code, and `derivative` differentiates it. The order of operations is
exactly as written, because numerical stability depends on it.
"""

from __future__ import annotations

from functools import reduce
import operator
from typing import (
    Any,
    Callable,
    Iterable,
    Iterator,
    Mapping,
    NamedTuple,
    Sequence,
)

from .operations import OPERATIONS, WITHOUT_RATE


class Real:
    """
    One operation on real numbers, or a leaf: a constant, a dimension or an argument.

    `varies`: the value depends on an argument, such as a crank angle; other values are computed
    once for each change of dimensions. `operands` are the operation's arguments; a leaf has none.
    `positive`: the value is known to be above zero. `rate` is a geometric formula of the rate, if
    it needs fewer operations than the derivative of the expression.
    """

    __slots__ = ('op', 'args', 'operands', 'varies', 'positive', 'rate')

    def __init__(self, op: str, args: tuple, varies: bool | None = None,
                 positive: bool = False, rate: Rate | None = None):
        self.op = op
        self.args = args
        self.operands = () if op in _LEAVES else args
        self.varies = True in [a.varies for a in args] if varies is None else varies
        self.positive = positive
        self.rate = rate

    @property
    def value(self) -> float | None:
        """Return the number of a constant leaf, None for anything else."""
        return self.args[0] if self.op == 'constant' else None

    def __add__(self, other: Number) -> Real:
        other = real(other)
        if self.value == 0.0:
            return other
        if other.value == 0.0:
            return self
        if other.op == 'negative':
            return self - other.args[0]
        return operation('add', self, other)

    def __sub__(self, other: Number) -> Real:
        other = real(other)
        if other.value == 0.0:
            return self
        if self is other and not self.varies:  # NaN - NaN is NaN, too
            return real(0.0)
        if self.value == 0.0:
            return -other
        if other.op == 'negative':
            return self + other.args[0]
        return operation('subtract', self, other)

    def __mul__(self, other: Number) -> Real:
        other = real(other)
        for factor, rest in ((self, other), (other, self)):
            if factor.value == 0.0:
                return factor
            if factor.value == 1.0:
                return rest
            if factor.value is not None and factor.value < 0.0 and rest.value is None:
                return -(real(-factor.value) * rest)
        for factor, rest in ((self, other), (other, self)):
            if factor.op == 'negative':
                return -(factor.args[0] * rest)
        return operation('multiply', self, other)

    def __truediv__(self, other: Number) -> Real:
        other = real(other)
        if self.value == 0.0 or other.value == 1.0:
            return self
        if self is other:
            return real(1.0)
        if self.op == 'negative':
            return -(self.args[0] / other)
        return operation('divide', self, other)

    def __neg__(self) -> Real:
        if self.op == 'negative':
            return self.args[0]
        return operation('negative', self)

    def __abs__(self) -> Real:
        if self.positive:
            return self
        if self.op == 'negative':
            return abs(self.args[0])
        return operation('absolute', self)

    def __lt__(self, other: Number) -> Real:
        return operation('less', self, real(other))

    def __le__(self, other: Number) -> Real:
        return operation('less_equal', self, real(other))

    def __gt__(self, other: Number) -> Real:
        return real(other) < self

    def __ge__(self, other: Number) -> Real:
        return real(other) <= self

    def __radd__(self, other: Number) -> Real:
        return real(other) + self

    def __rsub__(self, other: Number) -> Real:
        return real(other) - self

    def __rmul__(self, other: Number) -> Real:
        return real(other) * self

    def __rtruediv__(self, other: Number) -> Real:
        return real(other) / self


Number = Real | float | int

# Of this many terms an exact sum takes some thousand operations, which grow with their square.
MAX_SUMMANDS = 32
_LEAVES = frozenset({'constant', 'dimension', 'argument'})


def operation(name: str, *operands: Real) -> Real:
    """Return an operation of `operations` on operands, evaluated at once if possible."""
    row = OPERATIONS[name]
    if row.folded and (folded := row.folded(*operands)) is not None:
        return real(folded)
    return Real(name, operands, positive=bool(row.positive) and False not in [
        operands[i].positive for i in row.positive])


def real(value: Number) -> Real:
    """Return value as a Real; plain numbers become constants."""
    if isinstance(value, Real):
        return value
    return Real('constant', (float(value),), varies=False, positive=value > 0)


def dimension(name: str, positive: bool = True) -> Real:
    """Return the leaf for a named dimension."""
    return Real('dimension', (name,), varies=False, positive=positive)


def argument(index: int) -> Real:
    """Return the leaf for an argument of each pose: an input, or a lever's angle."""
    return Real('argument', (index,), varies=True)


def sine(x: Real) -> Real:
    """Return sin x."""
    return -sine(x.args[0]) if x.op == 'negative' else operation('sin', x)


def cosine(x: Real) -> Real:
    """Return cos x."""
    return operation('cos', x.args[0] if x.op == 'negative' else x)


def square(x: Real) -> Real:
    """Return x * x."""
    return x * x


def square_root(x: Number) -> Real:
    """Return the root of a value that cannot be negative."""
    x = real(x)
    if x.op == 'multiply' and x.args[0] is x.args[1]:
        return abs(x.args[0])
    return operation('sqrt', x)


def root(x: Real, tolerance: Real) -> Real:
    """
    Return the root of a radicand that is negative if a linkage cannot be assembled.

    Zero within the tolerance (a limit that is reached within rounding), NaN below.
    """
    return operation('root', x, real(tolerance))


def valid_where(x: Real, margin: Real, tolerance: Number = 0.0) -> Real:
    """Return x where the margin is not below zero by more than the tolerance, else NaN."""
    return operation('valid_where', x, margin, real(tolerance))


def arctangent(y: Real, x: Real) -> Real:
    """Return the angle of (x, y) in rad, in (-pi, pi]."""
    return operation('atan2', y, x)


def nearest_integer(x: Real) -> Real:
    """Return x rounded to an integer, halves to the even one."""
    return operation('rint', x)


def exact_sum(*terms: Number) -> Real:
    """
    Return an accurate sum under any cancellation.

    Terms that are sums are expanded into up to MAX_SUMMANDS. Source: Ogita, Rump and Oishi,
    "Accurate sum and dot product", SIAM J. Sci. Comput. 26 (2005), algorithm SumK.
    """
    parts = [t for term in terms for t in _summands(real(term)) if t.value != 0.0]
    if len(parts) > MAX_SUMMANDS:
        parts = list(map(real, terms))
    for _ in parts[2:]:
        parts = _distilled(parts)
    return reduce(operator.add, parts, real(0.0))


def sum_and_error(first: Real, second: Real) -> tuple[Real, Real]:
    """Return the rounded sum of two terms, and its exact rounding error."""
    return first + second, operation('sum_error', first, second)


def _distilled(terms: list[Real]) -> list[Real]:
    """Return the rounding error of each addition of a sum, and last the sum."""
    total, *rest = terms
    errors = []
    for term in rest:
        errors.append(operation('sum_error', total, term))
        total += term
    return [*errors, total]


def _summands(x: Real) -> list:
    """Return the terms of a sum or difference."""
    terms, waiting = [], [(x, False)]
    while waiting:
        x, minus = waiting.pop()
        if x.op == 'negative':
            waiting.append((x.args[0], not minus))
        elif x.op in ('add', 'subtract'):
            first, second = x.args
            waiting += [(second, minus != (x.op == 'subtract')), (first, minus)]
        else:
            terms.append(-x if minus else x)
    return terms


def where(condition: Real, chosen: Number, otherwise: Number) -> Real:
    """Return chosen where the condition holds, else otherwise."""
    return operation('where', condition, real(chosen), real(otherwise))


def greater(x: Real, y: Real) -> Real:
    """Return the greater of two numbers, the first if one is NaN."""
    return where(x < y, y, x)


class Complex:
    """A vector or a rotation in the plane, as a pair of Reals."""

    __slots__ = ('x', 'y', 'spin')

    def __init__(self, x: Number, y: Number):
        self.x = real(x)
        self.y = real(y)
        self.spin: Rate | None = None

    def __add__(self, other: Complex) -> Complex:
        return Complex(self.x + other.x, self.y + other.y)

    def __sub__(self, other: Complex) -> Complex:
        return Complex(self.x - other.x, self.y - other.y)

    def __neg__(self) -> Complex:
        opposite = Complex(-self.x, -self.y)
        opposite.spin = self.spin
        return opposite

    def __mul__(self, other: Complex | Number) -> Complex:
        if isinstance(other, Complex):
            return Complex(self.x * other.x - self.y * other.y,
                           self.x * other.y + self.y * other.x)
        return Complex(self.x * other, self.y * other)

    def __truediv__(self, other: Number) -> Complex:
        return Complex(self.x / other, self.y / other)

    def conjugate(self) -> Complex:
        """Return the mirror image in the x axis."""
        return Complex(self.x, -self.y)

    def turned(self) -> Complex:
        """Return the vector a quarter turn to the left."""
        return Complex(-self.y, self.x)

    def squared(self) -> Real:
        """Return the square of the length."""
        return square(self.x) + square(self.y)

    def length(self) -> Real:
        """Return the length."""
        return square_root(self.squared())

    def direction(self) -> Complex:
        """Return the unit vector along this one; along x if dimensions make its length zero."""
        length = self.length()
        if length.positive or length.varies:
            return self / length
        none = length <= 0.0
        return Complex(where(none, 1.0, self.x / length), where(none, 0.0, self.y / length))


def cross(p: Complex, q: Complex) -> Real:
    """Return the signed area spanned by p and q."""
    return p.x * q.y - p.y * q.x


def dot(p: Complex, q: Complex) -> Real:
    """Return the inner product of p and q."""
    return p.x * q.x + p.y * q.y


def unknown(nodes: Iterable[Real], needed: Callable, known: dict) -> Iterator[Real]:
    """Yield unknown operands of expressions before their users, which become known meanwhile."""
    waiting = [*nodes][::-1]
    while waiting:
        if waiting[-1] in known:
            waiting.pop()
        elif missing := [x for x in needed(waiting[-1]) if x not in known]:
            waiting += reversed(missing)
        else:
            yield waiting.pop()


def derivative(node: Real, rates: dict[int, Number], known: dict) -> Real:
    """
    Differentiate an expression with respect to time.

    `rates` are those of the arguments, by index; missing ones are zero. `known` are the
    derivatives found so far, shared between calls.
    """
    def needed(x: Real) -> Iterable[Real]:
        if not x.varies or x.op in WITHOUT_RATE:
            return ()
        return x.rate.of if x.rate else x.operands

    for x in unknown([node], needed, known):
        if not x.varies or x.op in WITHOUT_RATE:
            known[x] = real(0.0)
        elif x.op == 'argument':
            known[x] = real(rates.get(x.args[0], 0.0))
        elif x.rate:
            known[x] = x.rate.formula(*map(known.get, x.rate.of))
        else:
            known[x] = OPERATIONS[x.op].rate(operation, x, *map(known.get, x.operands))
    return known[node]


def substituted(outputs: Sequence[Real], replaced: Mapping[Any, Real]) -> list[Real]:
    """
    Return expressions with expressions for their arguments, and without geometric rates.

    Arguments are replaced by their leaves or by their indices.
    """
    known: dict = dict(replaced)
    for x in unknown(outputs, lambda x: x.operands if x.varies else (), known):
        if x.op == 'rated':
            known[x] = known[x.args[0]]
        elif x.varies and x.operands:
            known[x] = Real(x.op, tuple(map(known.get, x.args)), positive=x.positive)
        else:
            known[x] = replaced.get(x.args[0], x) if x.varies else x
    return [known[x] for x in outputs]


class Rate(NamedTuple):
    """A geometric rate: a formula of the rates of some expressions."""

    of: tuple[Real, ...]
    formula: Callable


def with_rate(x: Real, *of: Real, formula: Callable) -> Real:
    """Return the expression with a rate of its own, a formula of the rates of others."""
    if not x.varies:
        return x
    if x.op == 'negative':
        return -with_rate(x.args[0], *of, formula=lambda *rates: -formula(*rates))
    # A separate node, since x may be part of another expression, or of the formula.
    return Real('rated', (x,), positive=x.positive, rate=Rate(of, formula))


def with_spin(vector: Complex, spin: Rate) -> Complex:
    """Return a vector of constant length with a given angular velocity."""
    # The rate of each part uses the other part with its own rate.
    turned = Complex(
        with_rate(vector.x, *spin.of, formula=lambda *d: -(spin.formula(*d) * turned.y)),
        with_rate(vector.y, *spin.of, formula=lambda *d: spin.formula(*d) * turned.x))
    turned.spin = spin
    return turned


def spin(vector: Complex) -> Rate:
    """Return the angular velocity of a vector."""
    return vector.spin or Rate((vector.x, vector.y), lambda dx, dy: cross(
        vector, Complex(dx, dy)) / vector.squared())
