# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0


"""
Formulas as functions of arrays of other packages: any namespace of Python's array API standard.

The code is that of `program` for arrays, with functions of the namespace; derivatives, devices and
compilation are the package's own.
"""

from __future__ import annotations

from typing import Any, Callable, Mapping, Sequence, Tuple

from .expression import Real
from .finite import Finite
from .listing import Dialect
from .operations import Operation, OPERATIONS
from .program import ARRAYS, Program
from ..words import listed


def array_function(outputs: Sequence[Real], arguments: int, xp: Any, dimensions: Mapping,
                   single: Mapping[float, float]) -> Callable:
    """
    Return outputs as a function of arrays of a namespace, which returns a tuple of arrays.

    `single` are the numbers that take the place of others in single precision.
    """
    program = Program(Finite().outputs(outputs), arguments)

    def code(dtype: Any, numbers: Mapping[float, float]) -> Callable:
        dialect = Dialect(ARRAYS.templates, _names(xp, dtype), lambda value: repr(
            numbers.get(value, value)))
        return program.bind(dimensions, {}, numbers=numbers).on(dialect)

    codes = (xp.float64, code(xp.float64, {})), (xp.float32, code(xp.float32, single))
    broadcast = getattr(xp, 'broadcast_arrays', None) or xp.broadcast_tensors

    def function(*given: Any) -> Tuple[Any, ...]:
        if len(given) != arguments:
            raise ValueError(f'{arguments} arguments are needed, got {len(given)}')
        arrays = [x for x in given if type(x) not in (int, float)]
        for dtype, pose in codes:
            if arrays and all(getattr(x, 'dtype', None) == dtype for x in arrays):
                arrays = broadcast(*[xp.full_like(arrays[0], x) if type(x) in (int, float) else x
                                     for x in given])
                return tuple([xp.full_like(arrays[0], x) if type(x) is float else x
                              for x in pose(*arrays)])
        kinds = listed([str(getattr(x, 'dtype', type(x).__name__)) for x in given])
        raise ValueError(f'arguments must be arrays of {xp.__name__}, all float64 or all float32, '
                         f'or numbers beside arrays, got {kinds}')

    return function


def _names(xp: Any, dtype: Any) -> Mapping[str, Any]:
    """Return the functions of array code by their names in it."""
    functions = {'sin': xp.sin, 'cos': xp.cos, 'sqrt': xp.sqrt, 'absolute': xp.abs,
                 'rint': xp.round, 'where': xp.where,
                 'atan2': getattr(xp, 'atan2', None) or xp.arctan2}
    return {**ARRAYS.names, **{name: _of_floats_too(function, OPERATIONS[name], xp, dtype)
                               for name, function in functions.items()}}


def _of_floats_too(function: Callable, row: Operation, xp: Any, dtype: Any) -> Callable:
    """Return a function of arrays that allows floats beside them."""
    def applied(*operands: Any) -> Any:
        arrays = [x for x in operands if type(x) is not float]
        if not arrays:
            return float(row.numpy(*operands))
        # `where` itself allows one float beside two arrays.
        return function(*operands) if len(arrays) > 1 else function(*[
            xp.full_like(arrays[0], x, dtype=dtype) if type(x) is float else x for x in operands])

    return applied
