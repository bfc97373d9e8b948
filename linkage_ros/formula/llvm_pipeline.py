# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""
Process a message in one native call, from its bytes to the bytes of other messages.

The numbers of a message with a known layout are copied to the arguments of loops over poses, the
loops run, and their results are copied into other messages. Tables of addresses describe all
copies, so that one piece of code serves all scenes.
"""

from __future__ import annotations

from concurrent.futures import Future
from contextlib import contextmanager
import ctypes
from functools import partial
from typing import Any, Callable, Dict, Iterator, Optional, Sequence, Tuple

from llvmlite import ir
import numpy as np

from .llvm_code import address, Builder, compiled, COUNT, count, NUMBER
from .program import compile_in_background
from ..cache import cached

BYTE = ir.IntType(8)
FIELD_TYPES = {'i': COUNT, 'f': NUMBER}
# Rows of tables: integers and addresses ('i8') or floats ('f8').
# A number of the message: factor * number + plus is written to an address.
TAKE = np.dtype([('offset', 'i8'), ('to', 'i8'), ('factor', 'f8'), ('plus', 'f8')])
# A loop, its arguments, and the count of numbers from `out` on that must be finite.
LOOP = np.dtype([('code', 'i8'), ('poses', 'i8'), ('given', 'i8'), ('constants', 'i8'),
                 ('out', 'i8'), ('by_pose', 'i8'), ('by_output', 'i8'), ('size', 'i8')])
# Limits of a loop's argument: factor * argument + plus must be near a middle, up to whole turns.
LIMIT = np.dtype([('loop', 'i8'), ('at', 'i8'), ('factor', 'f8'), ('plus', 'f8'),
                  ('middle', 'f8'), ('half', 'f8'), ('turn', 'f8')])
# A number to scale and shift in place, then to wrap by whole turns.
CHANGE = np.dtype([('at', 'i8'), ('factor', 'f8'), ('plus', 'f8'), ('turn', 'f8')])
# Eight bytes to copy.
PUT = np.dtype([('from', 'i8'), ('to', 'i8')])
# The tables of a pipeline, and those of its ending.
TABLES = {'takes': TAKE, 'copies': PUT, 'loops': LOOP, 'limits': LIMIT}
ENDING = {'changes': CHANGE, 'puts': PUT}
# The code's arguments: length, bytes and mask of the known message; the stamp; which loops failed;
# then the size and the address of each table.
HEAD = ('length', 'same', 'mask', 'stamp', 'failed')

# Return values other than the number of failed loops.
OTHER_MESSAGE, UNSTAMPED = -1, -2
# Offset of a message's stamp, after the encapsulation header.
STAMP = 4
# Relative margin at a limit, within which Python decides.
LIMIT_MARGIN = 1e-9
INFINITE = 0x7FF << 52


class Pipeline:
    """
    The processing of messages with one layout.

    `same` is such a message, `mask` has the bits that all share. `stamp`, int64 (2,), receives a
    message's stamp, for an ending to copy; its second number replaces a missing stamp, or is zero.
    The other arrays have the types in TABLES; `owner` keeps their memory alive. `failed` marks the
    loops without finite numbers within their limits in the last call.
    """

    def __init__(self, same: bytes, mask: bytes, stamp: np.ndarray, owner: Any, takes: Any,
                 copies: Any, loops: Any, limits: Any):
        self.failed = np.zeros(len(loops), np.int64)
        known = [np.frombuffer(text, np.uint8) for text in (same, mask)]
        tables = _Tables(TABLES, (takes, copies, loops, limits))
        self._table = np.array([
            len(same), *map(address, (*known, stamp, self.failed)), *tables.head])
        run, _, engine = code().result()
        self._run = partial(run, address(self._table))
        self._used = owner, stamp, known, tables, engine

    def run(self, message: bytes, ending: Optional[Ending]) -> int:
        """
        Read the message, run the loops and, if none failed, the ending.

        Return the number of failed loops; OTHER_MESSAGE or UNSTAMPED without any effect.
        """
        return self._run(message, len(message), ending.address if ending else 0)


class Ending:
    """The use of a pipeline's results: tables of the types in ENDING."""

    def __init__(self, owner: Any, changes: Any, puts: Any):
        tables = _Tables(ENDING, (changes, puts))
        self._head = np.array(tables.head)
        self.address = address(self._head)
        _, run, engine = code().result()
        self.run = partial(run, self.address)
        self._used = owner, tables, engine


class _Tables:
    """Tables of rows, and the size and address of each."""

    def __init__(self, kinds: Dict[str, np.dtype], rows: Sequence[Any]):
        self._rows = [np.array(each, kind) for each, kind in zip(rows, kinds.values())]
        self.head = [part for table in self._rows for part in (len(table), address(table))]


def addresses(array: np.ndarray) -> np.ndarray:
    """Return the address of each number of an array."""
    return address(array) + np.add.reduce(
        [index * stride for index, stride in zip(np.indices(array.shape), array.strides)])


@cached(1)
def code() -> Future:
    """Return the machine code, compiled once in the background."""
    return compile_in_background(_compiled)


def _compiled() -> Tuple[Callable[[int, bytes, int, int], int], Callable[[int], None], Any]:
    """Return the functions that run a pipeline and an ending, and the owner of their code."""
    engine = compiled(_module())
    # A call takes microseconds, so it does not release Python's lock.
    run = ctypes.PYFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int64,
                            ctypes.c_int64)(engine.get_function_address('run'))
    end = ctypes.PYFUNCTYPE(None, ctypes.c_int64)(engine.get_function_address('end'))
    return run, end, engine


def _module() -> ir.Module:
    module = ir.Module()
    write = _Writer(module, 'end', ir.VoidType(), COUNT)
    end = write.function
    tables = _read(write, write.place(end.args[0], COUNT), (), ENDING)[1]
    _change(write, tables['changes'])
    _copy(write, tables['puts'])
    write.ret_void()

    write = _Writer(module, 'run', COUNT, COUNT.as_pointer(), BYTE.as_pointer(), COUNT, COUNT)
    table, text, length, ending = write.function.args
    known, tables = _read(write, table, HEAD, TABLES)
    write.leave(write.icmp_signed('!=', length, known['length']), OTHER_MESSAGE)
    write.leave(_differs(write, known, text), OTHER_MESSAGE)
    write.leave(_stamp(write, known, text), UNSTAMPED)
    _take(write, tables['takes'], text)
    _copy(write, tables['copies'])
    _run_loops(write, tables['loops'], known['failed'])
    _check_limits(write, tables['limits'], known['failed'])
    failed = _total(write, tables['loops'][0], known['failed'])
    ends = write.and_(write.icmp_signed('==', failed, count(0)),
                      write.icmp_signed('!=', ending, count(0)))
    with write.if_then(ends):
        write.call(end, [ending])
    write.ret(failed)
    return module


def _read(write: _Writer, table: ir.Value, head: Sequence[str], kinds: Dict[str, np.dtype]
          ) -> Tuple[Dict[str, ir.Value], Dict[str, Tuple[ir.Value, ir.Value]]]:
    """Load a head: its first fields by name, then the size and the address of each table."""
    values = [write.read(write.step(table, i)) for i in range(len(head) + 2 * len(kinds))]
    sizes, places = values[len(head)::2], values[len(head) + 1::2]
    return dict(zip(head, values)), dict(zip(kinds, zip(sizes, places)))


class _Writer(Builder):
    """Appends to a new function: reads and writes at any address, loops over tables."""

    def __init__(self, module: ir.Module, name: str, result: ir.Type, *arguments: ir.Type):
        function = ir.Function(module, ir.FunctionType(result, arguments), name)
        super().__init__(function.append_basic_block())

    def place(self, at: ir.Value, kind: ir.Type) -> ir.Value:
        return self.inttoptr(at, kind.as_pointer())

    def step(self, pointer: ir.Value, i: Any) -> ir.Value:
        return self.gep(pointer, [count(i) if isinstance(i, int) else i])

    def read(self, pointer: ir.Value) -> ir.Value:
        # Numbers in a message are aligned to 4 bytes only.
        return self.load(pointer, align=1)

    def put(self, value: ir.Value, pointer: ir.Value) -> None:
        self.store(value, pointer, align=1)

    def leave(self, condition: ir.Value, code: int) -> None:
        """Return a code where a condition holds."""
        with self.if_then(condition, likely=False):
            self.ret(count(code))

    @contextmanager
    def rows(self, table: Tuple[ir.Value, ir.Value], kind: np.dtype) -> Iterator[Dict]:
        """Write a loop over a table's rows, {field: value}; '' is the row's number."""
        size, start = table
        with self.each(size) as turn:
            at = self.add(start, self.mul(turn.i, count(kind.itemsize)))
            fields = {name: self.read(self.place(
                self.add(at, count(field[1])), FIELD_TYPES[field[0].kind]))
                for name, field in (kind.fields or {}).items()}
            yield {'': turn.i, **fields}


def _differs(write: _Writer, known: Dict[str, ir.Value], text: ir.Value) -> ir.Value:
    """Return whether a message differs in the shared bits."""
    same, mask = (write.place(known[name], BYTE) for name in ('same', 'mask'))
    with write.each(known['length'], BYTE(0)) as turn:
        other, own, counts = (write.read(write.step(each, turn.i)) for each in (text, same, mask))
        turn.then = write.or_(turn.total, write.and_(write.xor(other, own), counts))
    return write.icmp_unsigned('!=', turn.total, BYTE(0))


def _stamp(write: _Writer, known: Dict[str, ir.Value], text: ir.Value) -> ir.Value:
    """Copy the message's stamp, if it has one; return whether no stamp is available."""
    place = write.place(known['stamp'], COUNT)
    own = write.read(write.bitcast(write.step(text, STAMP), COUNT.as_pointer()))
    stamp = write.select(write.icmp_unsigned('==', own, count(0)),
                         write.read(write.step(place, 1)), own)
    write.put(stamp, place)
    return write.icmp_unsigned('==', stamp, count(0))


def _take(write: _Writer, takes: Any, text: ir.Value) -> None:
    with write.rows(takes, TAKE) as row:
        number = write.read(write.bitcast(write.step(text, row['offset']), NUMBER.as_pointer()))
        number = write.fadd(write.fmul(row['factor'], number), row['plus'])
        write.put(number, write.place(row['to'], NUMBER))


def _copy(write: _Writer, puts: Any) -> None:
    with write.rows(puts, PUT) as row:
        write.put(write.read(write.place(row['from'], COUNT)), write.place(row['to'], COUNT))


def _run_loops(write: _Writer, loops: Any, failed: ir.Value) -> None:
    kind = ir.FunctionType(ir.VoidType(), [
        COUNT, *3 * (NUMBER.as_pointer(),), COUNT, COUNT])
    with write.rows(loops, LOOP) as row:
        pointers = [write.place(row[name], NUMBER) for name in ('given', 'constants', 'out')]
        write.call(write.place(row['code'], kind), [
            row['poses'], *pointers, row['by_pose'], row['by_output']])
        numbers, infinite = write.place(row['out'], COUNT), count(INFINITE)
        with write.each(row['size'], count(0)) as turn:
            bits = write.and_(write.read(write.step(numbers, turn.i)), infinite)
            wrong = write.zext(write.icmp_unsigned('==', bits, infinite), COUNT)
            turn.then = write.or_(turn.total, wrong)
        write.put(turn.total, write.step(write.place(failed, COUNT), row['']))


def _check_limits(write: _Writer, limits: Any, failed: ir.Value) -> None:
    size = partial(write.call_by_name, 'llvm.fabs')
    with write.rows(limits, LIMIT) as row:
        value = write.fadd(write.fmul(row['factor'], write.read(
            write.place(row['at'], NUMBER))), row['plus'])
        away = size(_folded(write, write.fsub(value, row['middle']), row['turn']))
        slack = write.fmul(NUMBER(LIMIT_MARGIN), write.fadd(size(value), row['half']))
        near = write.fcmp_ordered('<=', away, write.fsub(row['half'], slack))
        place = write.step(write.place(failed, COUNT), row['loop'])
        write.put(write.select(near, write.read(place), count(1)), place)


def _change(write: _Writer, changes: Any) -> None:
    with write.rows(changes, CHANGE) as row:
        place = write.place(row['at'], NUMBER)
        value = write.fadd(write.fmul(write.read(place), row['factor']), row['plus'])
        write.put(_folded(write, value, row['turn']), place)


def _folded(write: _Writer, value: ir.Value, turn: ir.Value) -> ir.Value:
    """Return a value without its whole turns, if it turns."""
    whole = partial(write.call_by_name, 'llvm.rint')
    turns = whole(write.fdiv(value, turn))
    return write.select(write.fcmp_ordered('>', turn, NUMBER(0.0)),
                        write.fsub(value, write.fmul(turn, turns)), value)


def _total(write: _Writer, size: ir.Value, numbers: ir.Value) -> ir.Value:
    place = write.place(numbers, COUNT)
    with write.each(size, count(0)) as turn:
        turn.then = write.add(turn.total, write.read(write.step(place, turn.i)))
    return turn.total
