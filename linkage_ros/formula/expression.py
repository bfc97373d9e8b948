# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Numbers that remember how they were made.

A construction of `linkage.planar` is written once, in ordinary operators, on `Real` and `Complex`
values. What it leaves behind is an expression: a graph that `program` turns into code for one
pose, for arrays and for an accelerator, and that `derivative` differentiates. The order of the
operations is kept exactly as written, because the accuracy of a stable form lives in it.
"""

from __future__ import annotations

from functools import reduce
from math import cos, sin
from typing import (
    Any,
    Callable,
    Iterable,
    Iterator,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Sequence,
    Tuple,
    Union,
)


class Real:
    """
    One operation on real numbers, or a leaf: a constant, a dimension or an argument.

    `varies` tells whether the value depends on an argument, such as a crank angle; what does not
    is computed once for each change of dimensions. `positive` marks what is known to be above
    zero. `rate` is the rate where geometry knows it in fewer operations than differentiating the
    expression takes.
    """

    __slots__ = ('op', 'args', 'varies', 'positive', 'rate')

    def __init__(self, op: str, args: tuple, varies: Optional[bool] = None,
                 positive: bool = False, rate: Optional[Rate] = None):
        self.op = op
        self.args = args
        self.varies = any(a.varies for a in args) if varies is None else varies
        self.positive = positive
        self.rate = rate

    @property
    def operands(self) -> tuple:
        """The expressions that the operation is done on."""
        return () if self.op in _LEAVES else self.args

    @property
    def value(self) -> Optional[float]:
        """The number of a constant leaf, None for anything else."""
        return self.args[0] if self.op == 'constant' else None

    def __add__(self, other: Number) -> Real:
        other = real(other)
        if self.value == 0.0:
            return other
        if other.value == 0.0:
            return self
        if other.op == 'negative':
            return self - other.args[0]
        return _node('add', self, other, positive=self.positive and other.positive)

    def __sub__(self, other: Number) -> Real:
        other = real(other)
        if other.value == 0.0:
            return self
        if self is other and not self.varies:  # what has no value has no difference either
            return real(0.0)
        if self.value == 0.0:
            return -other
        if other.op == 'negative':
            return self + other.args[0]
        return _node('subtract', self, other)

    def __mul__(self, other: Number) -> Real:
        other = real(other)
        for one, rest in ((self, other), (other, self)):
            if one.value == 0.0:
                return one
            if one.value == 1.0:
                return rest
            if one.value is not None and one.value < 0.0 and rest.value is None:
                return -(real(-one.value) * rest)
        for one, rest in ((self, other), (other, self)):
            if one.op == 'negative':
                return -(one.args[0] * rest)
        return _node('multiply', self, other, positive=self.positive and other.positive)

    def __truediv__(self, other: Number) -> Real:
        other = real(other)
        if self.value == 0.0 or other.value == 1.0:
            return self
        if self is other:
            return real(1.0)
        if self.op == 'negative':
            return -(self.args[0] / other)
        return _node('divide', self, other, positive=self.positive and other.positive)

    def __neg__(self) -> Real:
        if self.op == 'negative':
            return self.args[0]
        return _node('negative', self)

    def __abs__(self) -> Real:
        if self.positive:
            return self
        if self.op == 'negative':
            return abs(self.args[0])
        return _node('absolute', self)

    def __lt__(self, other: Number) -> Real:
        return _node('less', self, real(other))

    def __le__(self, other: Number) -> Real:
        return _node('less_equal', self, real(other))

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


Number = Union[Real, float, int]

_LEAVES = frozenset({'constant', 'dimension', 'argument'})

_FOLDED: Mapping[str, Callable] = {
    'add': lambda x, y: x + y,
    'subtract': lambda x, y: x - y,
    'multiply': lambda x, y: x * y,
    'negative': lambda x: -x,
    'absolute': abs,
    'sin': sin,
    'cos': cos,
}


def _node(op: str, *args: Real, positive: bool = False) -> Real:
    """Join an operation to its operands; arithmetic on constants is done at once."""
    if op in _FOLDED and all(a.op == 'constant' for a in args):
        return real(_FOLDED[op](*(a.value for a in args)))
    return Real(op, args, positive=positive)


def real(value: Number) -> Real:
    """Return value as a Real; plain numbers become constants."""
    if isinstance(value, Real):
        return value
    return Real('constant', (float(value),), varies=False, positive=value > 0)


def dimension(name: str, positive: bool = True) -> Real:
    """Return the leaf for a named dimension."""
    return Real('dimension', (name,), varies=False, positive=positive)


def argument(index: int) -> Real:
    """Return the leaf for what is given with each pose: an input, or a lever's angle."""
    return Real('argument', (index,), varies=True)


def sine(x: Real) -> Real:
    """Return sin x."""
    return _node('sin', x)


def cosine(x: Real) -> Real:
    """Return cos x."""
    return _node('cos', x)


def square(x: Real) -> Real:
    """Return x * x."""
    return x * x


def square_root(x: Number) -> Real:
    """Return the root of a value that cannot be negative."""
    x = real(x)
    if x.op == 'multiply' and x.args[0] is x.args[1]:
        return abs(x.args[0])
    return _node('sqrt', x, positive=x.positive)


def root(x: Real, tolerance: Real) -> Real:
    """
    Return the root of a radicand that decides whether a linkage can be assembled.

    Zero within the tolerance (a limit that is hit up to rounding counts as reached), NaN below.
    """
    return _node('root', x, real(tolerance))


def gated(x: Real, margin: Real, tolerance: Number) -> Real:
    """Return x where the margin is not below zero by more than the tolerance, else NaN."""
    return _node('gated', x, margin, real(tolerance))


def arctangent(y: Real, x: Real) -> Real:
    """Return the angle of (x, y) in rad, in (-pi, pi]."""
    return _node('atan2', y, x)


def nearest_integer(x: Real) -> Real:
    """Return x rounded to an integer, halves to the even one."""
    return _node('rint', x)


def exact_sum(*terms: Number) -> Real:
    """Return the exactly rounded sum of dimensions and sums of them, however much cancels."""
    kept = [t for term in terms for t in _summands(real(term)) if t.value != 0.0]
    if len(kept) < 3:
        return reduce(lambda x, y: x + y, kept, real(0.0))
    return _node('fsum', *kept)


def _summands(x: Real) -> list:
    """Return the terms that a sum or difference is made of."""
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
    chosen, otherwise = real(chosen), real(otherwise)
    if chosen is otherwise or (chosen.value is not None and chosen.value == otherwise.value):
        return chosen
    return _node('where', condition, chosen, otherwise,
                 positive=chosen.positive and otherwise.positive)


class Complex:
    """A vector or a rotation in the plane, as a pair of Reals."""

    __slots__ = ('x', 'y', 'spin')

    def __init__(self, x: Number, y: Number):
        self.x = real(x)
        self.y = real(y)
        self.spin: Optional[Rate] = None

    def __add__(self, other: Complex) -> Complex:
        return Complex(self.x + other.x, self.y + other.y)

    def __sub__(self, other: Complex) -> Complex:
        return Complex(self.x - other.x, self.y - other.y)

    def __neg__(self) -> Complex:
        opposite = Complex(-self.x, -self.y)
        opposite.spin = self.spin
        return opposite

    def __mul__(self, other: Union[Complex, Number]) -> Complex:
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
        if self.y.value == 0.0:
            return abs(self.x)
        if self.x.value == 0.0:
            return abs(self.y)
        return square_root(self.squared())

    def direction(self) -> Complex:
        """Return the unit vector along this one; along x where dimensions leave it no length."""
        if self.y.value == 0.0 and self.x.op == 'negative' and self.x.args[0].positive:
            return Complex(-1.0, 0.0)
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


def in_order(outputs: Iterable[Real], needed: Callable) -> Iterator[Real]:
    """Yield expressions and all that they need, a sequence for each, every one after its own."""
    done, waiting = set(), list(reversed(list(outputs)))
    while waiting:
        node = waiting[-1]
        if node in done:
            waiting.pop()
            continue
        missing = [x for x in needed(node) if x not in done]
        if missing:
            waiting += reversed(missing)
        else:
            done.add(waiting.pop())
            yield node


def derivative(node: Real, rates: dict[int, Number], known: dict) -> Real:
    """
    Differentiate an expression with respect to time.

    Parameters
    ----------
    node : Real
        What is differentiated.
    rates : dict
        Rate of each argument, by its index; what is left out stands still.
    known : dict
        Derivatives found so far, shared between calls.

    """
    def needed(x: Real) -> Iterable[Real]:
        if x in known or not x.varies or x.op in _STEPS:
            return ()
        return x.rate.of if x.rate else x.operands

    for x in in_order([node], needed):
        if x in known:
            continue
        if not x.varies or x.op in _STEPS:
            known[x] = real(0.0)
        elif x.rate:
            known[x] = x.rate.formula(*map(known.get, x.rate.of))
        else:
            known[x] = _RULES[x.op](x, rates, *map(known.get, x.operands))
    return known[node]


def substituted(outputs: Sequence[Real], arguments: Sequence[Real]) -> List[Real]:
    """Return expressions whose arguments are other expressions; rates of their own are lost."""
    known: dict = {}
    for x in in_order(outputs, lambda x: x.operands if x.varies else ()):
        if x.op == 'argument':
            known[x] = arguments[x.args[0]]
        elif not x.varies:
            known[x] = x
        else:
            known[x] = known[x.args[0]] if x.op == 'rated' else Real(
                x.op, tuple(known[arg] for arg in x.args), positive=x.positive)
    return [known[x] for x in outputs]


class Rate(NamedTuple):
    """A rate that geometry knows: a formula of the rates of some expressions."""

    of: Tuple[Real, ...]
    formula: Callable


def with_rate(x: Real, *of: Real, formula: Callable) -> Real:
    """Return the expression with a rate of its own, a formula of the rates of others."""
    if not x.varies:
        return x
    if x.op == 'negative':
        return -with_rate(x.args[0], *of, formula=lambda *rates: -formula(*rates))
    # A node of its own: what it stands for may be part of another expression, or of the formula.
    return Real('rated', (x,), positive=x.positive, rate=Rate(of, formula))


def with_spin(vector: Complex, spin: Rate) -> Complex:
    """Return a vector of constant length with the angular velocity that is given."""
    x, y = vector.x, vector.y
    turned = Complex(with_rate(x, *spin.of, formula=lambda *d: -(spin.formula(*d) * y)),
                     with_rate(y, *spin.of, formula=lambda *d: spin.formula(*d) * x))
    turned.spin = spin
    return turned


def spin(vector: Complex) -> Rate:
    """Return the angular velocity of a vector."""
    return vector.spin or Rate((vector.x, vector.y), lambda dx, dy: cross(
        vector, Complex(dx, dy)) / vector.squared())


def _sqrt_rule(node: Real, _: Any, dx: Real, *__: Any) -> Real:
    return dx / (2.0 * node)


def _product_rule(node: Real, _: Any, dx: Real, dy: Real) -> Real:
    x, y = node.args
    return 2.0 * (dx * x) if x is y else dx * y + x * dy


_RULES: Mapping[str, Callable] = {
    'argument': lambda n, rates: real(rates.get(n.args[0], 0.0)),
    'sin': lambda n, _, dx: cosine(n.args[0]) * dx,
    'cos': lambda n, _, dx: -(sine(n.args[0]) * dx),
    'add': lambda n, _, dx, dy: dx + dy,
    'subtract': lambda n, _, dx, dy: dx - dy,
    'multiply': _product_rule,
    'divide': lambda n, _, dx, dy: (dx - n * dy) / n.args[1],
    'negative': lambda n, _, dx: -dx,
    'absolute': lambda n, _, dx: where(n.args[0] < 0.0, -dx, dx),
    'sqrt': _sqrt_rule,
    'root': _sqrt_rule,
    'where': lambda n, _, dc, dx, dy: where(n.args[0], dx, dy),
    'gated': lambda n, _, dx, *__: gated(dx, *n.args[1:]),
}
_STEPS = frozenset({'less', 'less_equal'})
