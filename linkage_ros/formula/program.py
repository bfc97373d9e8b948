# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Expressions turned into code.

One list of operations serves every use: plain Python on floats for a single pose, numpy for
arrays, and machine code where it is asked for. Only what the outputs depend on is in the list,
each value once; what depends on dimensions alone is worked out when they are set, and so is every
condition on dimensions: the code for a pose has no branch for it.
"""

from __future__ import annotations

from concurrent.futures import Future, wait
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import chain, count
import linecache
import math
from struct import Struct
from threading import Thread
from typing import (
    Any,
    Callable,
    Dict,
    Iterable,
    Iterator,
    List,
    Mapping,
    Optional,
    Sequence,
    Set,
    Tuple,
)
import warnings
from weakref import finalize

import numpy as np

from .expression import in_order, Real
from ..cache import Cache

# A block of this many poses stays in the second-level cache; measured in benchmark/.
BLOCK = 4096
# Below this many poses the float code in a loop beats numpy's cost per call.
FEW = 32
# Python's parser bounds how deep parentheses may nest.
DEEPEST = 16
_NUMBERS = count()


def beside(make: Callable[[], Any]) -> Future:
    """Let something be made in a thread of its own; return where it will be."""
    made: Future = Future()

    def run() -> None:
        try:
            made.set_result(make())
        except Exception as error:
            made.set_exception(error)

    Thread(target=run, name='linkage_ros compiler').start()
    return made


def grazed(x: float, tolerance: float) -> float:
    """Return the root of a radicand that is not above zero."""
    return 0.0 if x >= -tolerance else math.nan


def _root(x: Any, tolerance: Any) -> Any:
    if _all_at_least(x, 0.0):
        return np.sqrt(x)
    return np.sqrt(_gated(np.maximum(x, 0.0), x, tolerance))


def _gated(x: Any, margin: Any, tolerance: Any) -> Any:
    """Return x where the margin is not below zero by more than the tolerance, else NaN."""
    if _all_at_least(margin, -tolerance):
        return x
    return np.where(margin >= -tolerance, x, np.nan)


def _all_at_least(x: Any, bound: Any) -> np.bool_:
    """Return whether nothing is below a bound, or no number; for one bound in one quick pass."""
    if isinstance(bound, float) and np.size(x):
        return np.minimum.reduce(x, axis=None) >= bound
    return np.all(x >= bound)


@np.vectorize
def _fsum(*terms: float) -> float:
    try:
        return math.fsum(terms)
    except OverflowError:
        return math.nan


OPERATORS = {
    'add': '({} + {})', 'subtract': '({} - {})', 'multiply': '({} * {})', 'divide': '({} / {})',
    'negative': '(-{})', 'less': '({} < {})', 'less_equal': '({} <= {})',
    'sin': 'sin({})', 'cos': 'cos({})', 'sqrt': 'sqrt({})', 'atan2': 'atan2({}, {})',
    'absolute': 'abs({})',
}


@dataclass(frozen=True)
class Dialect:
    """How operations are spelt, which of them repeat their first operand, and their names."""

    templates: Mapping[str, str]
    repeating: frozenset
    names: Mapping[str, Any]
    frees: bool = False
    number: Callable[[float], str] = repr


FLOAT = Dialect(
    {**OPERATORS, 'where': '({1} if {0} else {2})',
     'rint': 'round({})',
     'root': '(sqrt({0}) if {0} > 0.0 else grazed({0}, {1}))',
     'gated': '({0} if {1} >= -{2} else nan)'},
    frozenset({'root'}),
    {'sin': math.sin, 'cos': math.cos, 'sqrt': math.sqrt, 'atan2': math.atan2,
     'grazed': grazed, 'nan': math.nan, 'inf': math.inf})

_ARRAY = Dialect(
    {**OPERATORS, 'where': 'where({}, {}, {})', 'root': 'root({}, {})',
     'gated': 'gated({}, {}, {})', 'rint': 'rint({})'},
    frozenset(),
    {'sin': np.sin, 'cos': np.cos, 'sqrt': np.sqrt, 'atan2': np.arctan2, 'where': np.where,
     'root': _root, 'gated': _gated, 'rint': np.rint, 'nan': np.nan,
     'inf': np.inf}, frees=True)

_EVALUATED: Mapping[str, Callable] = {
    'add': np.add, 'subtract': np.subtract, 'multiply': np.multiply, 'divide': np.divide,
    'negative': np.negative, 'absolute': np.absolute, 'less': np.less,
    'less_equal': np.less_equal, 'sin': np.sin, 'cos': np.cos, 'sqrt': np.sqrt,
    'atan2': np.arctan2, 'where': np.where, 'root': _root, 'gated': _gated, 'fsum': _fsum,
}


def evaluate(node: Real, dimensions: Mapping, known: dict) -> Any:
    """Return the value of an expression of dimensions alone; known is shared between calls."""
    for x in in_order([node], lambda x: () if x in known else x.operands):
        if x in known:
            continue
        if x.op == 'constant':
            known[x] = np.float64(x.value)
        elif x.op == 'dimension':
            known[x] = np.asarray(dimensions[x.args[0]], float)[()]
        else:
            known[x] = _EVALUATED[x.op](*map(known.get, x.operands))[()]
    return known[node]


class _Listing:
    """The operations behind some outputs, in an order they can be done in, each once."""

    def __init__(self, outputs: Sequence[Real], decided: Mapping[Real, bool],
                 replaced: Mapping[Real, Real]):
        self.entries: List[Tuple[Real, tuple]] = []
        self._decided = decided
        self._numbers: Dict[tuple, int] = {}
        self._known: Dict[Real, int] = {}
        for leaf, expression in replaced.items():
            self._known[leaf] = self._number(expression)
        self.outputs = [self._number(node) for node in outputs]
        self.constants = self._boundary()
        self._uses = self._count_uses()

    def _number(self, node: Real) -> int:
        for x in in_order([node], self._needed):
            if x not in self._known:
                self._known[x] = self._enter(x)
        return self._known[node]

    def _needed(self, node: Real) -> tuple:
        if node in self._known:
            return ()
        if node.op == 'where' and node.args[0] in self._decided:
            return (node.args[1 if self._decided[node.args[0]] else 2],)
        return node.operands

    def _enter(self, node: Real) -> int:
        needed = self._needed(node)
        if len(needed) == 1 and node.op in ('where', 'rated'):
            return self._known[needed[0]]
        args = tuple(self._known[a] for a in needed) or node.args
        key = (node.op, tuple(sorted(args)) if node.op in ('add', 'multiply') else args)
        if key not in self._numbers:
            self._numbers[key] = len(self.entries)
            self.entries.append((node, args))
        return self._numbers[key]

    def _operands(self, number: int) -> tuple:
        node, args = self.entries[number]
        return args if node.varies and node.op != 'argument' else ()

    def _live(self) -> list:
        live, waiting = set(), list(self.outputs)
        while waiting:
            number = waiting.pop()
            if number not in live:
                live.add(number)
                waiting.extend(self._operands(number))
        return sorted(live)

    def _boundary(self) -> list:
        """Return the values of dimensions alone that the varying operations start from."""
        return [n for n in self._live()
                if not self.entries[n][0].varies and self.entries[n][0].op != 'constant']

    def _count_uses(self) -> dict:
        uses = dict.fromkeys(self._live(), 0)
        for number in list(uses):
            for operand in self._operands(number):
                uses[operand] += 1
        for number in self.outputs:
            uses[number] += 1
        return uses

    def operations(self) -> tuple:
        """Return the operations as (number, name, operands), the constants and the outputs."""
        needed = [(number, *self.entries[number])
                  for number in self._uses if number not in self.constants]
        return [(number, node.op, (float(node.value),) if node.op == 'constant' else args)
                for number, node, args in needed], self.constants, self.outputs

    def statements(self, dialect: Dialect) -> tuple:
        """Return the assignments as (name, code, names used) and the code of each output."""
        text, depth, lines = {}, {}, []
        reads: Dict[int, Set[str]] = {}
        repeated = {args[0] for node, args in map(self.entries.__getitem__, self._uses)
                    if node.op in dialect.repeating}
        for number, uses in self._uses.items():
            node, args = self.entries[number]
            if number in self.constants:
                text[number], depth[number], reads[number] = f'k{number}', 0, set()
            elif node.op == 'constant':
                text[number], depth[number], reads[number] = (
                    dialect.number(node.value), 0, set())
            elif node.op == 'argument':
                text[number], depth[number], reads[number] = f'x{args[0]}', 0, set()
            else:
                text[number] = dialect.templates[node.op].format(*(text[a] for a in args))
                depth[number] = 1 + max(depth[a] for a in args)
                reads[number] = set().union(*(reads[a] for a in args))
                if uses > 1 or number in repeated or depth[number] > DEEPEST:
                    name = f'v{number}'
                    lines.append((name, text[number], reads[number]))
                    text[number], depth[number], reads[number] = name, 0, {name}
        kept = set().union(*(reads[n] for n in self.outputs))
        return lines, [text[n] for n in self.outputs], kept


def _with_releases(lines: Sequence[Tuple[str, str, Set[str]]], kept: Set[str]) -> Iterator[str]:
    """Drop each array after its last use, so that the next one takes over its warm memory."""
    last = {}
    for index, (_, _, reads) in enumerate(lines):
        last.update(dict.fromkeys(reads, index))
    for index, (name, code, reads) in enumerate(lines):
        yield f'{name} = {code}'
        done = sorted(n for n in reads if last[n] == index and n not in kept)
        if done:
            yield 'del ' + ', '.join(done)


def _python(listing: _Listing, dialect: Dialect, arguments: int,
            names: Tuple[str, ...] = ()) -> Callable:
    """
    Return a function of constants, and of what to do instead, to the function of the arguments.

    That returns the outputs as a tuple or, where there are names, in pairs: an array (2,) each.
    What Python's floats raise for is left to `instead`.
    """
    lines, outputs, kept = listing.statements(dialect)
    body = (list(_with_releases(lines, kept)) if dialect.frees
            else [f'{name} = {code}' for name, code, _ in lines])
    # Text of any class, an enum's or numpy's, is written as plain text is.
    rows = ', '.join(f'{str.__repr__(name)}: pairs[{i}]' for i, name in enumerate(names))
    # Packing floats as bytes takes a quarter of the time numpy needs to convert them.
    ending = [
        f'pairs = empty(({len(names)}, 2))',
        f'pack(pairs, 0, {", ".join(outputs)})',
        f'return {{{rows}}}',
    ] if names else [f'return ({"".join(code + ", " for code in outputs)})']
    given = ', '.join(f'x{i}' for i in range(arguments))
    source = '\n'.join([
        f'def bind({"".join(f"k{n}, " for n in listing.constants)}instead=None):',
        f'    def pose({given}):',
        '        try:',
        *(f'            {line}' for line in [*body, *ending]),
        '        except (ArithmeticError, ValueError):',
        f'            return instead({given})',
        '    return pose'])
    scope: Dict[str, Any] = {
        **dialect.names, 'empty': np.empty, 'pack': Struct(f'{len(outputs)}d').pack_into}
    file = f'<linkage_ros formula {next(_NUMBERS)}>'
    exec(compile(source, file, 'exec'), scope)
    # For tracebacks and debuggers, as long as the code lives.
    linecache.cache[file] = len(source), None, source.splitlines(True), file
    finalize(scope['bind'], linecache.cache.pop, file, None).atexit = False
    return scope['bind']


class _Variant:
    """The code for one outcome of the conditions on dimensions."""

    def __init__(self, outputs: Sequence[Real], decided: Mapping[Real, bool],
                 replaced: Mapping[Real, Real], arguments: int):
        self.listing = _Listing(outputs, decided, replaced)
        self.arguments, self.outputs = arguments, len(outputs)
        self.constants = [self.listing.entries[n][0] for n in self.listing.constants]
        # The code for one pose that returns the outputs in pairs, by name.
        self.placing = Cache(partial(_python, self.listing, FLOAT, arguments))

    @cached_property
    def float(self) -> Callable:
        return _python(self.listing, FLOAT, self.arguments)

    @cached_property
    def array(self) -> Callable:
        return _python(self.listing, _ARRAY, self.arguments)

    @cached_property
    def loop(self) -> Future:
        """The code for many poses as machine code, which is made beside what goes on."""
        def make() -> Any:
            from .llvm_code import Loop

            return Loop(*self.listing.operations())

        return beside(make)

    @cached_property
    def arrays(self) -> Any:
        """The code for arrays of poses as machine code."""
        from .llvm_arrays import Arrays

        return Arrays(*self.listing.operations())


class Program:
    """
    Some outputs of a linkage, ready to be bound to dimensions.

    Parameters
    ----------
    outputs : sequence of Real
        What is computed.
    arguments : int
        How many arguments are given.
    replaced : mapping, optional
        What stands for some arguments in the outputs.

    """

    def __init__(self, outputs: Sequence[Real], arguments: int = 1,
                 replaced: Optional[Mapping[Real, Real]] = None):
        self._outputs = tuple(outputs)
        self._arguments = arguments
        self._replaced = replaced or {}
        self._conditions = _conditions(self._outputs)
        self._variants = Cache()

    def bind(self, dimensions: Mapping, known: dict, accelerate: bool = False) -> Pose:
        """Return the outputs as functions of the arguments; dimensions are floats or arrays."""
        swept = any(np.ndim(v) for v in dimensions.values())
        with np.errstate(all='ignore'):
            decisions = () if swept else tuple(
                bool(evaluate(c, dimensions, known)) for c in self._conditions)
            variant = self._variants.get_or_make(
                decisions, lambda: self._variant(decisions))
            constants = [evaluate(c, dimensions, known) for c in variant.constants]
        if not swept:
            constants = list(map(float, constants))
        shape = np.broadcast_shapes(*map(np.shape, constants)) if swept else ()
        return Pose(variant, constants, shape, accelerate)

    def _variant(self, decisions: tuple) -> _Variant:
        decided = dict(zip(self._conditions, decisions))
        return _Variant(self._outputs, decided, self._replaced, self._arguments)


def _conditions(outputs: Iterable[Real]) -> list:
    """Return the conditions on dimensions alone that varying operations choose by."""
    found, seen, waiting = [], set(), list(outputs)
    while waiting:
        node = waiting.pop()
        if node in seen or not node.varies:
            continue
        seen.add(node)
        if node.op == 'where' and not node.args[0].varies and node.args[0] not in found:
            found.append(node.args[0])
        waiting.extend(a for a in node.args if isinstance(a, Real))
    return found


class Pose:
    """The outputs of a program as a function of the arguments, for dimensions that are set."""

    def __init__(self, variant: _Variant, constants: Sequence, shape: tuple, accelerate: bool):
        self.variant = variant
        self.constants = constants
        self._accelerate = accelerate
        self.shape = shape

    @cached_property
    def at(self) -> Callable:
        """The function from the arguments, floats, to the outputs of one set of dimensions."""
        return self.variant.float(*self.constants, self._by_arrays)

    @cached_property
    def _given(self) -> np.ndarray:
        return np.array(self.constants)

    def _by_arrays(self, *arguments: float) -> tuple:
        """Return the outputs at one pose with inf or nan where Python's floats raise."""
        return tuple(self._blocks([np.array([a]) for a in arguments], 1)[:, 0].tolist())

    def rounded(self, argument: np.ndarray) -> np.ndarray:
        """Return the outputs over one argument, worked out in the precision of that array."""
        with np.errstate(all='ignore'):
            rows = self.variant.array(*self.constants)(argument)
        return np.array([np.broadcast_to(row, argument.shape) for row in rows])

    def statements(self, dialect: Dialect) -> Tuple[Dict[str, float], List[Tuple[str, str]],
                                                    List[str]]:
        """Return constants by name, assignments (name, code) and the code of each output."""
        listing = self.variant.listing
        lines, outputs, _ = listing.statements(dialect)
        return (dict(zip((f'k{n}' for n in listing.constants), self.constants)),
                [(name, code) for name, code, _ in lines], outputs)

    def placer(self, names: tuple) -> Callable:
        """Return the function from one argument, a float, to an array (2,) for each name."""
        def by_arrays(theta: float) -> Dict[str, np.ndarray]:
            return dict(zip(names, np.reshape(self._by_arrays(theta), (-1, 2))))

        return self.variant.placing[names](*self.constants, by_arrays)

    def __call__(self, *arguments: Any) -> Any:
        """Return the outputs at floats, as floats, or over arrays that are broadcast together."""
        if not self.shape and set(map(type, arguments)) == {float}:
            return self.at(*arguments)
        return self.over(*arguments)

    def over(self, *arguments: Any) -> np.ndarray:
        """Return the outputs over arrays that are broadcast together, shape (outputs, *shape)."""
        arrays: Sequence[np.ndarray] = [np.asarray(a, float) for a in arguments]
        if self.shape:
            return self._swept(arrays)
        if len(arrays) > 1:
            arrays = np.broadcast_arrays(*arrays)
        shape, size = arrays[0].shape, arrays[0].size
        flat = [a.ravel() for a in arrays]
        if self._accelerate:
            out = self.variant.arrays.solve(flat, self._given)
        else:
            out = self._plainly(flat, size)
        return out.reshape(self.variant.outputs, *shape)

    def searched(self, *arguments: Any) -> np.ndarray:
        """Return what `over` does for one set of dimensions, without code for single poses."""
        arguments = np.broadcast_arrays(*arguments)
        flat = [a.ravel() for a in arguments]
        return self._blocks(flat, arguments[0].size).reshape(
            self.variant.outputs, *arguments[0].shape)

    def batch(self, rows: np.ndarray) -> Batch:
        """Return poses to be solved again and again, into rows (poses, outputs)."""
        return Batch(self._plainly, self.variant.loop if self._accelerate else None,
                     self._given, self.variant.arguments, rows)

    def _plainly(self, given: Sequence[np.ndarray], size: int) -> np.ndarray:
        return self._one_by_one(given, size) if size < FEW else self._blocks(given, size)

    def _one_by_one(self, given: Sequence[np.ndarray], size: int) -> np.ndarray:
        poses = map(self.at, *(a.tolist() for a in given))
        outputs = self.variant.outputs
        return np.fromiter(chain.from_iterable(poses), float, size * outputs).reshape(
            size, outputs).T

    def _blocks(self, given: Sequence[np.ndarray], size: int) -> np.ndarray:
        pose = self.variant.array(*self.constants)
        out = np.empty((self.variant.outputs, size))
        with np.errstate(all='ignore'):
            for start in range(0, size, BLOCK):
                block = slice(start, start + BLOCK)
                for row, values in zip(out, pose(*(a[block] for a in given))):
                    row[block] = values
        return out

    def _swept(self, arguments: Sequence[np.ndarray]) -> np.ndarray:
        shape = np.broadcast_shapes(self.shape, *map(np.shape, arguments))
        with np.errstate(all='ignore'):
            rows = self.variant.array(*self.constants)(*arguments)
        return np.array([np.broadcast_to(row, shape) for row in rows], float)


class Batch:
    """
    Poses that are solved again and again, in arrays that stay where they are.

    Attributes
    ----------
    given : float array (arguments, poses)
        Where the arguments are put.
    rows : float array (poses, outputs)
        What `solve` makes of them.

    """

    def __init__(self, plainly: Callable, loop: Optional[Future], constants: np.ndarray,
                 arguments: int, rows: np.ndarray):
        self.given, self.rows = np.zeros((arguments, len(rows))), rows
        self._plainly = plainly
        self._loop, self._constants = loop, constants
        self._run: Optional[Callable] = None

    @property
    def code(self) -> Optional[tuple]:
        """Where the machine code is and what it is called with, see `Loop`, once there is any."""
        self._look()
        return (self._code.address, *self._arguments) if self._run else None

    def finish(self) -> None:
        """Wait for the machine code, if there is to be any."""
        if self._loop:
            wait([self._loop])

    def solve(self) -> None:
        """Fill the rows: plainly until there is machine code, for which nobody waits."""
        self._look()
        if self._run:
            self._run(*self._arguments)
        else:
            self.rows[:] = self._plainly(self.given, len(self.rows)).T

    def _look(self) -> None:
        if not self._loop or not self._loop.done():
            return
        loop, self._loop = self._loop, None
        if error := loop.exception():
            warnings.warn(f'no machine code, so plain Python goes on: {error}', stacklevel=4)
            return
        self._code = loop.result()
        self._arguments = self._code.arguments(self.given, self._constants, self.rows.T)
        self._run = self._code.run
