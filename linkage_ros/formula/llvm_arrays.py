# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Machine code for arrays of poses: eight poses at a time, on all cores.

Sine, cosine and arctangent are those of `elementary`, other operations those of `llvm_code`. The
result of a pose depends neither on the other poses nor on the number of cores.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
import ctypes
from functools import partial
import os
from typing import Callable, Dict, List, Sequence, Tuple

from llvmlite import ir
import numpy as np

from .elementary import arctangent, sine_and_cosine
from .expression import argument
from .listing import Listing
from .llvm_code import address, append, Builder, compiled, COUNT, count, load, NUMBER
from ..cache import cached

# One register of AVX-512; eight are also about the fastest with AVX2 and SSE2.
LANES = 8
VECTOR = ir.VectorType(NUMBER, LANES)
# Number of operations that justify another thread: some 0.15 ms.
SHARE = 3 * 2 ** 19
# First pose, the one after the last, number of all poses; then three addresses: of the table of
# the arguments' addresses, of the constants and of the results.
ARRAYS_SIGNATURE = ctypes.CFUNCTYPE(None, *3 * (ctypes.c_int64,), *3 * (ctypes.c_void_p,))


class Arrays:
    """Poses in arrays of any size, solved by machine code; the parameters are those of `Loop`."""

    def __init__(self, operations: Sequence, constants: Sequence[int], outputs: Sequence[int]):
        self._engine = compiled(_module(operations, constants, outputs))
        self._run = ARRAYS_SIGNATURE(self._engine.get_function_address('poses'))
        self._outputs = len(outputs)
        self._share = SHARE // (1 + len(operations))

    def solve(self, given: Sequence[np.ndarray], constants: np.ndarray) -> np.ndarray:
        """Return the outputs, shape (outputs, poses), at arguments that are arrays (poses,)."""
        size = given[0].size
        if size < LANES:
            return self.solve([np.resize(each, LANES) for each in given], constants)[:, :size]
        out = np.empty((self._outputs, size))
        cores = _cores() if size > self._share else 1
        share = max(self._share, -(-size // cores))

        def solve_from(first: int) -> None:
            # These references keep the arrays alive while threads use them.
            places = (ctypes.c_int64 * len(given))(*map(address, given))
            self._run(first, min(first + share, size), size, places,
                      address(constants), address(out))

        others = [_threads(os.getpid(), cores).submit(solve_from, first)
                  for first in range(share, size, share)]
        solve_from(0)
        for other in others:
            other.result()
        return out


def _cores() -> int:
    """Return the number of cores that this process may use."""
    own = getattr(os, 'sched_getaffinity', None)
    return len(own(0)) if own else os.cpu_count() or 1


@cached(1)
def _threads(_: int, cores: int) -> ThreadPoolExecutor:
    """Return the thread pool of a process; a forked process needs its own."""
    return ThreadPoolExecutor(cores, 'linkage_ros arrays')


def _module(operations: Sequence, constants: Sequence[int],
            outputs: Sequence[int]) -> ir.Module:
    module = ir.Module()
    pointer = NUMBER.as_pointer()
    poses = ir.Function(module, ir.FunctionType(
        ir.VoidType(), [*3 * (COUNT,), pointer.as_pointer(), pointer, pointer]), 'poses')
    first, last, size, arguments, given, out = poses.args
    builder = Builder(poses.append_basic_block())
    known = {number: _in_all_lanes(builder, load(builder, given, count(i)))
             for i, number in enumerate(constants)}

    def lanes(array: ir.Value, offset: ir.Value) -> ir.Value:
        return builder.bitcast(builder.gep(array, [offset]), VECTOR.as_pointer())

    with builder.each(last, first, LANES) as i:
        # The last eight poses may overlap those before.
        latest = builder.sub(size, count(LANES))
        at = builder.select(builder.icmp_signed('<', i, latest), i, latest)
        append(operations, known, _operators(builder), VECTOR, lambda index: builder.load(
            lanes(load(builder, arguments, count(index)), at), align=1))
        for column, number in enumerate(outputs):
            place = builder.add(builder.mul(count(column), size), at)
            builder.store(known[number], lanes(out, place), align=1)
    builder.ret_void()
    return module


def _in_all_lanes(builder: Builder, number: ir.Value) -> ir.Value:
    none = ir.Constant(VECTOR, ir.Undefined)
    return builder.shuffle_vector(
        builder.insert_element(none, number, count(0)), none,
        ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES))


def _operators(builder: Builder) -> Dict[str, Callable]:
    """Return the code generators of operations on eight poses."""
    spell = builder.operations()
    turned = _approximated(builder, spell, sine_and_cosine, (spell['sin'], spell['cos']))
    angle = _approximated(builder, spell, arctangent, (partial(_by_lane, builder, 'atan2'),))
    return {**spell, 'sin': lambda x: turned(x)[0], 'cos': lambda x: turned(x)[1],
            'atan2': lambda y, x: angle(y, x)[0]}


def _by_lane(builder: Builder, name: str, *operands: ir.Value) -> ir.Value:
    """Append a call of a function of numbers for each lane."""
    result = ir.Constant(VECTOR, ir.Undefined)
    for lane in map(count, range(LANES)):
        value = builder.call_by_name(name, *(builder.extract_element(x, lane) for x in operands))
        result = builder.insert_element(result, value, lane)
    return result


def _approximated(builder: Builder, spell: Dict[str, Callable], approximation: Callable,
                  library: Sequence[Callable]) -> Callable:
    """Return a code generator: `elementary`, or the C library where that is not valid."""
    @cached()
    def appended(*operands: ir.Value) -> List[ir.Value]:
        operations, outputs = _listed(approximation, len(operands))
        known: Dict[int, ir.Value] = {}
        append(operations, known, spell, VECTOR, lambda index: operands[index])
        *near, holds = (known[number] for number in outputs)
        whole, before = builder.bitcast(holds, ir.IntType(LANES)), builder.block
        with builder.if_then(builder.icmp_unsigned('!=', whole, whole.type(-1)), likely=False):
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
def _listed(approximation: Callable, arguments: int) -> Tuple[Sequence, Sequence[int]]:
    outputs = approximation(*map(argument, range(arguments)))
    operations, _, numbers = Listing(outputs, {}).operations()
    return operations, numbers
