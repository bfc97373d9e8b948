# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Generate code from expressions.

One list of operations serves every use: plain Python on floats for a single pose, numpy for
arrays, and machine code on request. The list has each operation that the outputs need once. Values
and conditions that depend on dimensions alone are evaluated when dimensions are set, so that the
code for a pose has no branches for them.
"""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from functools import cached_property
from itertools import chain
import math
from operator import attrgetter
import re
from typing import Any, Callable, Iterable, Mapping, Sequence
import warnings

import numpy as np

from .expression import Real, real, substituted, unknown
from .listing import Dialect, Listing
from .operations import OPERATIONS
from ..cache import Cache
from ..optional import needs

# A block of this many poses stays in the second-level cache; measured in benchmark/.
BLOCK_OF_POSES = 4096
# How much coarser single precision is.
COARSER = 2.0 ** 29
# Below this many poses the float code in a loop beats numpy's cost per call.
FEW_POSES = 32
_NAMED, _OPERANDS = re.compile(r'\bv\d+'), attrgetter('operands')

FLOATS = Dialect({name: row.python for name, row in OPERATIONS.items()}, {
    name: value for name, value in vars(math).items() if not name.startswith('_')})
ARRAYS = Dialect({name: row.array for name, row in OPERATIONS.items()}, {
    **{name: row.numpy for name, row in OPERATIONS.items()}, 'nan': np.nan, 'inf': np.inf})


def _of_c(function: Callable) -> Callable:
    """Return a function of the C library for numpy's scalars; it is NaN where that raises."""
    def applied(*operands: float) -> np.float64:
        try:
            return np.float64(function(*operands))
        except ValueError:
            return np.float64(np.nan)

    return applied


# Code on arrays, for numpy's scalars. On many processors numpy's own functions have other bits.
QUIET = Dialect(ARRAYS.templates, {**ARRAYS.names, **{
    name: _of_c(getattr(math, name)) for name in ('sin', 'cos', 'atan2')}})


def evaluate(node: Real, dimensions: Mapping, known: dict) -> Any:
    """Evaluate an expression of dimensions alone; `known` is shared between calls."""
    evaluate_in_order(unknown([node], _OPERANDS, known), dimensions, known)
    return known[node]


def evaluate_in_order(nodes: Iterable[Real], dimensions: Mapping, known: dict) -> None:
    """Add the values of expressions of dimensions alone to those known, operands first."""
    with np.errstate(all='ignore'):
        for node in nodes:
            if node in known:
                continue
            if node.operands:
                known[node] = OPERATIONS[node.op].numpy(*[known[x] for x in node.operands])[()]
            else:
                value, = node.args
                known[node] = np.asarray(
                    dimensions[value] if node.op == 'dimension' else value, float)[()]


def in_order(nodes: Iterable[Real], needed: Callable = _OPERANDS) -> list[Real]:
    """Return expressions and what they need, each once, in an order of evaluation."""
    known: dict[Real, None] = {}
    for x in unknown(nodes, needed, known):
        known[x] = None
    return list(known)


def tolerant(outputs: Sequence[Real], single: Mapping[float, float]) -> Sequence[Real]:
    """
    Return outputs for single precision, with its tolerances in the place of plain numbers.

    `single` are the numbers that take the place of others; without any, precision is double. A
    tolerance that follows from dimensions is computed with them.
    """
    tolerances = {x.args[-1] for x in in_order(outputs) if x.op in ('root', 'valid_where')}
    return substituted(outputs, {x: real(COARSER * x.value) for x in tolerances
                                 if x.value and x.value not in single}) if single else outputs


def _with_releases(lines: Sequence[tuple[str, str]], outputs: Sequence[str]) -> list[str]:
    """Drop each array after its last use, so that the next one reuses its cached memory."""
    reads = [set(_NAMED.findall(code)) for _, code in lines]
    last = {name: index for index, names in enumerate(reads) for name in names}
    returned = set(_NAMED.findall(' '.join(outputs)))
    done = [sorted(n for n in names - returned if last[n] == i) for i, names in enumerate(reads)]
    return [text for (name, code), rest in zip(lines, done)
            for text in (f'{name} = {code}', *([f'del {", ".join(rest)}'] if rest else []))]


def _python(listing: Listing, dialect: Dialect, arguments: int) -> Callable:
    """
    Return a factory from constants and a fallback `instead` to the function of the arguments.

    That function returns the outputs as a tuple. Where Python's floats raise, it calls `instead`.
    """
    lines, outputs = listing.statements(dialect)
    ending = f'return ({"".join(code + ", " for code in outputs)})'
    parameters = ', '.join(f'x{i}' for i in range(arguments))
    if dialect.templates is ARRAYS.templates:
        body = [*_with_releases(lines, outputs), ending]
    else:
        body = ['try:', *(f'    {line}' for line in [
            *(f'{name} = {code}' for name, code in lines), ending]),
            'except (ArithmeticError, ValueError):', f'    return instead({parameters})']
    source = '\n'.join([
        f'def bind({"".join(f"k{n}, " for n in listing.constants)}instead=None):',
        f'    def pose({parameters}):', *(f'        {line}' for line in body), '    return pose'])
    scope = dict(dialect.names)
    exec(compile(source, '<linkage_ros formula>', 'exec'), scope)
    return scope['bind']


class _Variant:
    """The code for one combination of the conditions on dimensions."""

    def __init__(self, outputs: Sequence[Real], decided: Mapping[Real, bool], arguments: int):
        self.listing = Listing(outputs, decided)
        self.arguments, self.outputs = arguments, len(outputs)
        self.constants = [self.listing.entries[n][0] for n in self.listing.constants]
        self.steps = in_order(self.constants)

    @cached_property
    def float(self) -> Callable:
        return _python(self.listing, FLOATS, self.arguments)

    @cached_property
    def array(self) -> Callable:
        return _python(self.listing, ARRAYS, self.arguments)

    @cached_property
    def quiet(self) -> Callable:
        return _python(self.listing, QUIET, self.arguments)

    @cached_property
    def loop(self) -> Future:
        """Return the machine code for many poses, compiled in the background."""
        def make() -> Any:
            with needs('llvmlite'):
                from .llvm_code import Loop
            return Loop(*self.listing.operations())

        thread = ThreadPoolExecutor(1, 'linkage_ros compiler')
        made = thread.submit(make)
        thread.shutdown(wait=False)
        return made

    @cached_property
    def arrays(self) -> Any:
        """Return the machine code for arrays of poses."""
        with needs('llvmlite'):
            from .llvm_code import Arrays
        return Arrays(*self.listing.operations())


class Program:
    """
    Outputs of a linkage as functions of arguments, to be bound to dimensions.

    Arguments in the outputs may be `replaced` by expressions.
    """

    def __init__(self, outputs: Sequence[Real], arguments: int = 1,
                 replaced: Mapping[Real, Real] | None = None):
        self._outputs = tuple(substituted(outputs, replaced) if replaced else outputs)
        self._arguments = arguments
        self._conditions = _conditions(self._outputs)
        self._deciding = in_order(self._conditions)
        self._variants = Cache()

    def bind(self, dimensions: Mapping, known: dict, accelerate: bool = False) -> CompiledFunction:
        """Return the outputs as functions of the arguments; dimensions are floats or arrays."""
        shape = np.broadcast_shapes(*map(np.shape, dimensions.values()))
        if not shape:
            evaluate_in_order(self._deciding, dimensions, known)
        decisions = () if shape else tuple(bool(known[c]) for c in self._conditions)
        variant = self._variants.get_or_make(decisions, lambda: _Variant(
            self._outputs, dict(zip(self._conditions, decisions)), self._arguments))
        evaluate_in_order(variant.steps, dimensions, known)
        constants = [known[c] for c in variant.constants]
        if not shape:
            constants = list(map(float, constants))
        return CompiledFunction(variant, constants, shape, accelerate)


def _conditions(outputs: Iterable[Real]) -> list:
    """Return the conditions on dimensions alone that varying operations use."""
    nodes = in_order(outputs, lambda x: [a for a in x.operands if a.varies])
    return list(dict.fromkeys(node.args[0] for node in nodes if node.varies
                              and node.op == 'where' and not node.args[0].varies))


class CompiledFunction:
    """The outputs of a program as a function of the arguments, for given dimensions."""

    def __init__(self, variant: _Variant, constants: Sequence, shape: tuple, accelerate: bool):
        self.variant = variant
        self.constants = constants
        self._accelerate = accelerate
        self.shape = shape

    @cached_property
    def at(self) -> Callable:
        """Return the function from floats to the outputs of one set of dimensions."""
        return self.variant.float(*self.constants, self._quietly)

    @cached_property
    def _constant_array(self) -> np.ndarray:
        return np.array(self.constants)

    def _quietly(self, *arguments: float) -> tuple:
        """Return the outputs at one pose with inf or nan where Python's floats raise."""
        with np.errstate(all='ignore'):
            return tuple(map(float, self.variant.quiet(*self.constants)(
                *map(np.float64, arguments))))

    def on(self, dialect: Dialect) -> Callable:
        """Return the function of arrays in a dialect of `ARRAYS`, which returns a tuple."""
        return _python(self.variant.listing, dialect, self.variant.arguments)(*self.constants)

    def statements(self, dialect: Dialect) -> tuple[dict[str, float], list[tuple[str, str]],
                                                    list[str]]:
        """Return constants by name, assignments (name, code) and the code of each output."""
        listing = self.variant.listing
        constants = dict(zip((f'k{n}' for n in listing.constants), self.constants))
        return constants, *listing.statements(dialect)

    def over(self, *arguments: Any) -> np.ndarray:
        """Return the outputs over broadcast arrays, shape (outputs, *shape)."""
        arrays = [np.asarray(a, float) for a in arguments]
        return self._swept(arrays) if self.shape else self._flat(
            self._in_machine_code if self._accelerate else self._in_python, arrays)

    def searched(self, *arguments: Any) -> np.ndarray:
        """
        Return the same as `over` for one set of dimensions, without code for single poses.

        Arguments of single precision are processed in it.
        """
        return self._flat(self._blocks, arguments)

    def _flat(self, solve: Callable, arrays: Sequence[np.ndarray]) -> np.ndarray:
        first, *others = np.broadcast_arrays(*arrays) if len(arrays) > 1 else arrays
        flat = [a.ravel() for a in (first, *others)]
        return solve(flat, first.size).reshape(self.variant.outputs, *first.shape)

    def _in_machine_code(self, arguments: Sequence[np.ndarray], _: int) -> np.ndarray:
        return self.variant.arrays.solve(arguments, self._constant_array)

    def batch(self, rows: np.ndarray) -> Batch:
        """
        Return poses to solve repeatedly by machine code, into rows (poses, outputs).

        Raises ImportError without an llvmlite that works.
        """
        with needs('llvmlite'):
            from . import llvm_code  # noqa: F401
        return Batch(self.variant.loop, self._constant_array, self.variant.arguments, rows)

    def _in_python(self, arguments: Sequence[np.ndarray], size: int) -> np.ndarray:
        if size >= FEW_POSES:
            return self._blocks(arguments, size)
        poses = map(self.at, *(a.tolist() for a in arguments))
        outputs = self.variant.outputs
        return np.fromiter(chain.from_iterable(poses), float, size * outputs).reshape(
            size, outputs).T

    def _blocks(self, arguments: Sequence[np.ndarray], size: int) -> np.ndarray:
        pose = self.variant.array(*self.constants)
        out = np.empty((self.variant.outputs, size))
        with np.errstate(all='ignore'):
            for start in range(0, size, BLOCK_OF_POSES):
                block = slice(start, start + BLOCK_OF_POSES)
                for row, values in zip(out, pose(*(a[block] for a in arguments))):
                    row[block] = values
        return out

    def _swept(self, arguments: Sequence[np.ndarray]) -> np.ndarray:
        shape = np.broadcast_shapes(self.shape, *map(np.shape, arguments))
        with np.errstate(all='ignore'):
            rows = self.variant.array(*self.constants)(*arguments)
        return np.array([np.broadcast_to(row, shape) for row in rows], float)


class Batch:
    """
    Poses that are solved repeatedly by machine code, in arrays at fixed addresses.

    Parameters
    ----------
    loop : Future of Loop
        The machine code; if it fails, a warning has the reason.
    constants : float array
        The values of dimensions that it uses.
    arguments : int
        Number of arguments of a pose, whose values the user writes to the array `arguments`
        (arguments, poses).
    rows : float array (poses, outputs)
        Where the outputs are written.

    """

    def __init__(self, loop: Future, constants: np.ndarray, arguments: int, rows: np.ndarray):
        self.arguments = np.zeros((arguments, len(rows)))
        self._loop: Future | None = loop
        self._run: Callable | None = None
        self._constants, self._rows = constants, rows
        self._solved = np.empty(rows.shape[::-1])

    def solve(self, shared: Sequence[Any] = ()) -> bool:
        """
        Fill the rows; return False, without effect, as long as there is no machine code.

        `shared` are the values of the first arguments if all poses have the same.
        """
        if self._loop and self._loop.done():
            loop, self._loop = self._loop, None
            if error := loop.exception():
                warnings.warn(f'no machine code, plain Python is used: {error}', stacklevel=3)
                return False
            self._run = loop.result().bound(self.arguments, self._constants, self._solved)
        if self._run is None:
            return False
        for row, value in zip(self.arguments, shared):
            row.fill(value)
        self._run(0, len(self._rows))
        self._rows[:] = self._solved.T
        return True
