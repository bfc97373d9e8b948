# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Compile expressions to machine code, by llvmlite.

The operations and their order are those of the plain Python code, so the results have the same
bits.
"""

from __future__ import annotations

from contextlib import contextmanager
import ctypes
from functools import partial
from typing import Callable, Dict, Iterator, Sequence

import llvmlite
from llvmlite import binding as llvm, ir
import numpy as np

from .operations import OPERATIONS

if not hasattr(llvm, 'create_pass_builder'):
    raise ImportError(f'llvmlite 0.44 or newer is needed, this is {llvmlite.__version__}')

NUMBER, COUNT = ir.DoubleType(), ir.IntType(64)
# Poses, addresses of arguments, constants and results, then the strides of results in numbers.
LOOP_SIGNATURE = ctypes.CFUNCTYPE(None, ctypes.c_int64, *3 * (ctypes.c_void_p,),
                                  *2 * (ctypes.c_int64,))

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

    def operations(self) -> Dict[str, Callable]:
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
    def each(self, last: ir.Value, first: ir.Value, step: int = 1) -> Iterator[ir.Value]:
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
        i.add_incoming(self.add(i, count(step)), self.block)
        self.branch(head)
        self.position_at_end(end)


class Loop:
    """
    A loop over poses in machine code, which lives as long as this object.

    An operation is a number, a name and operands: numbers of other operations or of an argument,
    or a value. `constants` and `outputs` are the numbers of each call's constants and results.
    """

    def __init__(self, operations: Sequence, constants: Sequence[int], outputs: Sequence[int]):
        self._engine = compiled(_module(operations, constants, outputs))
        self.run = LOOP_SIGNATURE(self._engine.get_function_address('loop'))

    @staticmethod
    def arguments(given: np.ndarray, constants: np.ndarray, out: np.ndarray) -> tuple:
        """
        Return the arguments of `run`, valid as long as the arrays live.

        `given` (arguments, poses) is C-contiguous; the results are written to `out` (outputs,
        poses).
        """
        by_output, by_pose = (stride // out.itemsize for stride in out.strides)
        return given.shape[1], *map(address, (given, constants, out)), by_pose, by_output


def address(array: np.ndarray) -> int:
    """Return the address of an array's numbers."""
    return array.__array_interface__['data'][0]


def _module(operations: Sequence, constants: Sequence[int],
            outputs: Sequence[int]) -> ir.Module:
    module = ir.Module()
    pointer = NUMBER.as_pointer()
    loop = ir.Function(module, ir.FunctionType(
        ir.VoidType(), [COUNT, pointer, pointer, pointer, COUNT, COUNT]), 'loop')
    poses, arguments, given, out, by_pose, by_output = loop.args
    for array in (arguments, given, out):
        array.add_attribute('noalias')
    builder = Builder(loop.append_basic_block())
    known = {number: load(builder, given, count(i)) for i, number in enumerate(constants)}
    with builder.each(poses, count(0)) as i:
        append(operations, known, builder.operations(), NUMBER, lambda index: load(
            builder, arguments, builder.add(builder.mul(count(index), poses), i)))
        for column, number in enumerate(outputs):
            place = builder.add(builder.mul(i, by_pose),
                                builder.mul(count(column), by_output))
            builder.store(known[number], builder.gep(out, [place]))
    builder.ret_void()
    return module


def append(operations: Sequence, known: dict, spell: dict, kind: ir.Type,
           argument: Callable[[int], ir.Value]) -> None:
    """Append operations on a type of numbers to the code; `known` receives their values."""
    for number, name, operands in operations:
        if name == 'constant':
            known[number] = ir.Constant(kind, operands[0])
        elif name == 'argument':
            known[number] = argument(operands[0])
        else:
            known[number] = spell[name](*(known[operand] for operand in operands))


def count(value: int) -> ir.Constant:
    return ir.Constant(COUNT, value)


def load(builder: ir.IRBuilder, array: ir.Value, place: ir.Value) -> ir.Value:
    return builder.load(builder.gep(array, [place]))
