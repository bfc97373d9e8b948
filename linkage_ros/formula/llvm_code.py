# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Compile expressions to machine code, by llvmlite: a loop over poses.

One pose at a time, the operations and their order are those of the plain Python code, so the
results have the same bits. Eight at a time, on all cores, sine, cosine and arctangent are those of
`elementary`; the result of a pose depends neither on the other poses nor on the number of cores.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
import ctypes
from functools import partial
import os
from typing import Callable, Iterator, Sequence

import llvmlite
from llvmlite import binding as llvm, ir
import numpy as np

from .elementary import arctangent, sine_and_cosine
from .expression import argument
from .listing import Listing
from .operations import OPERATIONS
from ..cache import cached

if not hasattr(llvm, 'create_pass_builder'):
    raise ImportError(f'llvmlite 0.44 or newer is needed, this is {llvmlite.__version__}')

NUMBER, COUNT = ir.DoubleType(), ir.IntType(64)
# One register of AVX-512; eight are also about the fastest with AVX2 and SSE2.
LANES = 8
VECTOR = ir.VectorType(NUMBER, LANES)
# Number of operations that justify another thread: some 0.15 ms.
SHARE = 3 * 2 ** 19
# First pose, the one after the last, number of all poses; then three addresses: of the table of
# the arguments' addresses, of the constants and of the results.
SIGNATURE = ctypes.CFUNCTYPE(None, *3 * (ctypes.c_int64,), *3 * (ctypes.c_void_p,))

llvm.initialize_native_target()
llvm.initialize_native_asmprinter()


def compiled(module: ir.Module) -> llvm.ExecutionEngine:
    """Compile a module; its machine code lives as long as the returned engine."""
    target = llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=llvm.get_host_cpu_features().flatten(), opt=3)
    code = llvm.parse_assembly(str(module))
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = options.slp_vectorization = True
    passes = llvm.create_pass_builder(target, options)
    passes.getModulePassManager().run(code, passes)
    engine = llvm.create_mcjit_compiler(code, target)
    engine.finalize_object()
    return engine


class Builder(ir.IRBuilder):
    """Appends operations on numbers, or on vectors of them, to the code of a function."""

    def operations(self) -> dict[str, Callable]:
        """Return the code generators of operations, by name."""
        return {name: partial(row.llvm, self) for name, row in OPERATIONS.items()}

    def call_by_name(self, name: str, *operands: ir.Value) -> ir.Value:
        """Append a call of a function of LLVM or the C library, all numbers of one kind."""
        kind = operands[0].type
        if name.startswith('llvm.'):
            name += '.f64' if kind == NUMBER else f'.v{kind.count}f64'
        function = self.module.globals.get(name) or ir.Function(
            self.module, ir.FunctionType(kind, len(operands) * [kind]), name)
        return self.call(function, operands)

    @contextmanager
    def loop(self, last: ir.Value, first: ir.Value, step: int) -> Iterator[ir.Value]:
        """Write a loop over the integers from `first` to `last`, exclusive; yield the integer."""
        before = self.block
        head, body, end = (self.function.append_basic_block() for _ in range(3))
        self.branch(head)
        self.position_at_end(head)
        i = self.phi(COUNT)
        self.cbranch(self.icmp_signed('<', i, last), body, end)
        self.position_at_end(body)
        yield i
        i.add_incoming(first, before)
        i.add_incoming(self.add(i, _count(step)), self.block)
        self.branch(head)
        self.position_at_end(end)


class Loop:
    """
    A loop over poses in machine code, which lives as long as this object.

    An operation is a number, a name and operands: numbers of other operations or of an argument,
    or a value. `constants` and `outputs` are the numbers of each call's constants and results.
    """

    kind: ir.Type = NUMBER

    def __init__(self, operations: Sequence, constants: Sequence[int], outputs: Sequence[int]):
        self._engine = compiled(_module(self.kind, operations, constants, outputs))
        self.run = SIGNATURE(self._engine.get_function_address('poses'))

    def bound(self, arguments: Sequence[np.ndarray], constants: np.ndarray, out: np.ndarray
              ) -> Callable:
        """
        Return the function that solves from a first pose to another, as long as the arrays live.

        `arguments` are arrays (poses,); the results are written to `out` (outputs, poses).
        """
        places = (ctypes.c_int64 * len(arguments))(*map(_address, arguments))
        rest = arguments[0].size, places, _address(constants), _address(out)
        return lambda first, last: self.run(first, last, *rest)


class Arrays(Loop):
    """Poses in arrays of any size, eight at a time."""

    kind = VECTOR

    def __init__(self, operations: Sequence, constants: Sequence[int], outputs: Sequence[int]):
        super().__init__(operations, constants, outputs)
        self._outputs = len(outputs)
        self._share = SHARE // (1 + len(operations))

    def solve(self, arguments: Sequence[np.ndarray], constants: np.ndarray) -> np.ndarray:
        """Return the outputs, shape (outputs, poses), at arguments that are arrays (poses,)."""
        size = arguments[0].size
        if size < LANES:
            return self.solve(
                [np.resize(array, LANES) for array in arguments], constants)[:, :size]
        out = np.empty((self._outputs, size))
        cores = _cores() if size > self._share else 1
        share = max(self._share, -(-size // cores))

        def solve_from(first: int) -> None:
            # These references keep the arrays alive while threads use them.
            self.bound(arguments, constants, out)(first, min(first + share, size))

        others = [_threads(os.getpid(), cores).submit(solve_from, first)
                  for first in range(share, size, share)]
        solve_from(0)
        for other in others:
            other.result()
        return out


def _address(array: np.ndarray) -> int:
    """Return the address of an array's numbers."""
    return array.__array_interface__['data'][0]


def _cores() -> int:
    """Return the number of cores that this process may use."""
    affinity = getattr(os, 'sched_getaffinity', None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


@cached(1)
def _threads(_: int, cores: int) -> ThreadPoolExecutor:
    """Return the thread pool of a process; a forked process needs its own."""
    return ThreadPoolExecutor(cores, 'linkage_ros arrays')


def _module(kind: ir.Type, operations: Sequence, constants: Sequence[int],
            outputs: Sequence[int]) -> ir.Module:
    """Return the code that solves poses on numbers of one kind: one, or several in a vector."""
    module, pointer, lanes = ir.Module(), NUMBER.as_pointer(), getattr(kind, 'count', 1)
    poses = ir.Function(module, ir.FunctionType(
        ir.VoidType(), [*3 * (COUNT,), pointer.as_pointer(), pointer, pointer]), 'poses')
    first, last, size, arguments, constant_array, out = poses.args
    builder = Builder(poses.append_basic_block())
    spell = builder.operations() if kind == NUMBER else _operators(builder)
    known = {number: _in_all_lanes(builder, kind, _load(builder, constant_array, _count(i)))
             for i, number in enumerate(constants)}

    def numbers(array: ir.Value, offset: ir.Value) -> ir.Value:
        return builder.bitcast(builder.gep(array, [offset]), kind.as_pointer())

    with builder.loop(last, first, lanes) as i:
        # The last vector may overlap the one before.
        latest = builder.sub(size, _count(lanes))
        at = builder.select(builder.icmp_signed('<', i, latest), i, latest)
        _append(operations, known, spell, kind, lambda index: builder.load(
            numbers(_load(builder, arguments, _count(index)), at), align=1))
        for column, number in enumerate(outputs):
            place = builder.add(builder.mul(_count(column), size), at)
            builder.store(known[number], numbers(out, place), align=1)
    builder.ret_void()
    return module


def _in_all_lanes(builder: Builder, kind: ir.Type, number: ir.Value) -> ir.Value:
    if kind == NUMBER:
        return number
    none = ir.Constant(kind, ir.Undefined)
    return builder.shuffle_vector(
        builder.insert_element(none, number, _count(0)), none,
        ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES))


def _operators(builder: Builder) -> dict[str, Callable]:
    """Return the code generators of operations on eight poses."""
    spell = builder.operations()
    turned = _approximated(builder, spell, sine_and_cosine, (spell['sin'], spell['cos']))
    angle = _approximated(builder, spell, arctangent, (partial(_by_lane, builder, 'atan2'),))
    return {**spell, 'sin': lambda x: turned(x)[0], 'cos': lambda x: turned(x)[1],
            'atan2': lambda y, x: angle(y, x)[0]}


def _by_lane(builder: Builder, name: str, *operands: ir.Value) -> ir.Value:
    """Append a call of a function of numbers for each lane."""
    result = ir.Constant(VECTOR, ir.Undefined)
    for lane in map(_count, range(LANES)):
        value = builder.call_by_name(name, *(builder.extract_element(x, lane) for x in operands))
        result = builder.insert_element(result, value, lane)
    return result


def _approximated(builder: Builder, spell: dict[str, Callable], approximation: Callable,
                  library: Sequence[Callable]) -> Callable:
    """Return a code generator: `elementary`, or the C library where that is not valid."""
    @cached()
    def appended(*operands: ir.Value) -> list[ir.Value]:
        operations, outputs = _listed(approximation, len(operands))
        known: dict[int, ir.Value] = {}
        _append(operations, known, spell, VECTOR, lambda index: operands[index])
        *near, holds = (known[number] for number in outputs)
        bits, before = builder.bitcast(holds, ir.IntType(LANES)), builder.block
        with builder.if_then(builder.icmp_unsigned('!=', bits, bits.type(-1)), likely=False):
            far = [builder.select(holds, value, exact(*operands))
                   for value, exact in zip(near, library)]
            beyond = builder.block
        either = [builder.phi(VECTOR) for _ in far]
        for phi, value, other in zip(either, near, far):
            phi.add_incoming(value, before)
            phi.add_incoming(other, beyond)
        return either

    return appended


@cached()
def _listed(approximation: Callable, arguments: int) -> tuple[Sequence, Sequence[int]]:
    outputs = approximation(*map(argument, range(arguments)))
    operations, _, numbers = Listing(outputs, {}).operations()
    return operations, numbers


def _append(operations: Sequence, known: dict, spell: dict, kind: ir.Type,
           argument: Callable[[int], ir.Value]) -> None:
    """Append operations on a type of numbers to the code; `known` receives their values."""
    for number, name, operands in operations:
        if name == 'constant':
            known[number] = ir.Constant(kind, operands[0])
        elif name == 'argument':
            known[number] = argument(operands[0])
        else:
            known[number] = spell[name](*(known[operand] for operand in operands))


def _count(value: int) -> ir.Constant:
    return ir.Constant(COUNT, value)


def _load(builder: ir.IRBuilder, array: ir.Value, place: ir.Value) -> ir.Value:
    return builder.load(builder.gep(array, [place]))
