# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Validation of mechanisms' arguments; errors name the argument and the allowed values."""

from collections.abc import Mapping, Sequence
import math
from numbers import Real
from typing import Any

import numpy as np

from .design import Design
from ...words import join_names, short_repr, suggestion

# For each input of a linkage the lower and the upper end [rad or m], or None.
Ends = Sequence[tuple[float, float] | None] | None
# The eighth power of a length is a normal number, and displays have it in single precision.
MIN_LENGTH, MAX_LENGTH = 1e-30, 1e30


def checked_dimensions(design: Design, values: Mapping[str, Any]) -> dict:
    """Return all dimensions of a design with defaults; raise ValueError if one is invalid."""
    for name in values:
        if name not in design.dimensions:
            raise ValueError(f'{design.name} has no dimension {short_repr(name)}'
                             f'{suggestion(name, design.dimensions)}')
    lengths = {name: _checked(design, name, values.get(name, default))
               for name, default in design.dimensions.items()}
    try:
        np.broadcast_shapes(*map(np.shape, lengths.values()))
    except ValueError:
        shapes = [f'{name} {np.shape(length)}' for name, length in lengths.items()]
        raise ValueError(f'{design.name}: arrays of dimensions must have shapes that broadcast, '
                         f'got {join_names(shapes)}') from None
    return lengths


def _checked(design: Design, name: str, value: Any) -> Any:
    if type(value) is float and MIN_LENGTH <= value <= MAX_LENGTH:
        return value

    def error(rule: str) -> ValueError:
        return ValueError(f'{design.name}: dimension {name} must {rule}, got {short_repr(value)}')

    try:
        length = numbers(name, value)
    except ValueError:
        raise error('be a number or an array of numbers') from None
    if not length.size or np.asarray(value).dtype == bool:
        raise error('be a number or an array of numbers')
    if not np.all(np.isfinite(length)):
        raise error('be finite')
    if name not in design.signed and not np.all(length > 0.0):
        raise error('be positive')
    size = np.abs(length[length != 0.0])
    if np.any((size < MIN_LENGTH) | (size > MAX_LENGTH)):
        raise error(f'lie between {MIN_LENGTH:g} and {MAX_LENGTH:g}')
    return length.copy() if length.ndim else float(length)


# What numpy takes for numbers.
NOT_NUMBERS = (str, bytes, bytearray, memoryview, type(None))


def numbers(name: str, value: Any) -> np.ndarray:
    """Return a number or an array as float64; raise ValueError, with the name, if invalid."""
    try:
        array = np.asarray(value)
        kind = array.dtype.kind
        if isinstance(value, NOT_NUMBERS) or kind not in 'fbiuO' or kind == 'O' and any(
                isinstance(item, NOT_NUMBERS) for item in array.flat):
            raise TypeError
        return array.astype(float, copy=False)
    except (TypeError, ValueError, OverflowError, RecursionError):
        raise ValueError(f'{name} must be a number or an array of numbers, '
                         f'got {short_repr(value)}') from None


def checked_branches(
        design: Design, branches: Mapping[str, int] | None, others: Any = None) -> dict:
    """
    Return all assembly signs of a design; raise ValueError if one is invalid.

    `others` are those that are not given, by default those of the design.
    """
    if branches is not None and not isinstance(branches, Mapping):
        raise ValueError(f'{design.name}: branches must be a mapping from joint to +1 or -1, '
                         f'got {short_repr(branches)}')
    signs = dict(others or design.branches)
    for name, sign in (branches or {}).items():
        if name not in signs:
            raise ValueError(f'{design.name} has no branch {short_repr(name)}'
                             f'{suggestion(name, signs)}')
        if not isinstance(sign, Real) or isinstance(sign, bool) or sign not in (1, -1):
            raise ValueError(f'{design.name}: branch {name} must be +1 or -1, '
                             f'got {short_repr(sign)}')
        signs[name] = int(sign)
    return signs


def checked_ends(count: int, ends: Ends) -> tuple[tuple[float, ...], ...]:
    """Return the ends of each input as floats, () without any; raise ValueError if invalid."""
    try:
        checked = tuple(() if pair is None else tuple(numbers('ends', pair).tolist())
                        for pair in ([None] * count if ends is None else ends))
        if len(checked) == count and all(
                -math.inf < low <= high < math.inf for low, high in filter(None, checked)):
            return checked
    except (TypeError, ValueError):
        pass
    raise ValueError('ends must be two finite numbers in order, or None, for each input, '
                     'got ' + short_repr(ends))
