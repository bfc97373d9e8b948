# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Linkages written by users as joint lines."""

from collections.abc import Mapping, Set
from itertools import islice
from typing import Any, Iterable

from ..cache import cached
from ..linkage import Design, joint_lines, rod_lines
from ..words import did_you_mean, join_names, plain_text, short_repr, suggestion

# The modules that read joint lines, by the type of the linkage.
WORDS = {'custom': joint_lines, 'rods': rod_lines}


@cached(64, shared=True)
def design(type_: str, joints: tuple[str, ...], tracer: str | None,
           names: tuple[str, ...]) -> Design:
    """
    Return the design of joint lines.

    Raises
    ------
    ValueError
        For an invalid line; the text has the line and what is allowed.

    """
    words = WORDS[type_]
    lines = words.parse(joints)
    if not any(line.drives for line in lines):
        raise ValueError('a linkage needs a line that drives it: '
                         f'{" or ".join(words.INPUTS)}')
    for line in lines:
        for name in joint_lines.lengths([line]):
            joint_lines.check_name(name)
            if name not in names:
                raise line.error(f'dimension {name} has no value; given: {join_names(names)}'
                                 f'{did_you_mean(name, names)}')
    used = joint_lines.lengths(lines)
    placed = words.points(lines)
    if tracer is not None and tracer not in placed:
        raise ValueError(f'tracer {short_repr(tracer)} is not a joint{suggestion(tracer, placed)}')
    signed = frozenset(name for name, length in used.items() if not length)
    return Design(type_, dict.fromkeys(used, 1.0), joints, tracer or placed[-1], signed,
                  words is rod_lines, is_written=True)


def checked_design(type_: str, joints: Iterable[str] | None, tracer: str | None,
                   dimensions: Iterable[str]) -> Design:
    """Return the design of a user's arguments; raise ValueError if they are invalid."""
    if tracer is not None and not isinstance(tracer, str):
        raise ValueError(f'tracer must be the name of a joint, got {short_repr(tracer)}')
    lines = checked_lines(joints)
    try:
        names = tuple(map(plain_text, dimensions))
    except TypeError:
        raise ValueError('dimensions must be a list of names, '
                         f'got {short_repr(dimensions)}') from None
    for name in names:
        joint_lines.check_name(name)
    return design(type_, lines, plain_text(tracer), names)


def checked_lines(joints: Any) -> tuple[str, ...]:
    """Return the joints as a tuple of lines; raise ValueError if they are not lines."""
    try:
        # A set has no order, and of a mapping only the keys would be read.
        unfit = isinstance(joints, (str, bytes, Mapping, Set))
        lines = () if unfit else tuple(islice(joints, joint_lines.MAX_LINES + 1))
    except TypeError:
        lines = ()
    if not lines:
        raise ValueError(
            f'joints must be a list of lines, one per joint, got {short_repr(joints)}')
    if len(lines) > joint_lines.MAX_LINES:
        raise ValueError(f'joints must be up to {joint_lines.MAX_LINES} lines, got more')
    for number, line in enumerate(lines, 1):
        if not isinstance(line, str):
            raise ValueError(
                f'joints must be lines of text, but line {number} is {short_repr(line)}')
    return tuple(map(plain_text, lines))
