# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Types of mechanisms: joint lines and default dimensions."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from types import MappingProxyType
from typing import Any, Mapping

from . import joint_lines, rod_lines


@dataclass(frozen=True)
class Design:
    """
    A type of mechanism: its name, default dimensions [m] and joint lines.

    The `tracer` is the joint of the locus; `signed` dimensions may be zero or
    negative. Lines `in_space` are those of `rod_lines`, with `inputs` as the given joints, by
    default the driven ones; `is_written` says that all lines are a user's, in which a triangle
    must exist. `turned` are whole turns, by input, from which its inputs are counted; see
    `Mechanism.turned`.
    """

    name: str
    dimensions: Mapping[str, float] = field(hash=False)
    joints: tuple[str, ...]
    tracer: str
    signed: frozenset[str] = frozenset()
    in_space: bool = False
    is_written: bool = False
    inputs: tuple[str, ...] = ()
    turned: tuple[tuple[str, float], ...] = ()

    # All its mechanisms share a design, so nobody can change it.
    def __post_init__(self) -> None:
        object.__setattr__(self, 'dimensions', MappingProxyType(dict(self.dimensions)))

    def __reduce__(self) -> tuple:
        name, dimensions, *others = (getattr(self, part.name) for part in fields(self))
        return Design, (name, dict(dimensions), *others)

    @property
    def words(self) -> Any:
        """Return the module that reads and draws the lines."""
        return rod_lines if self.in_space else joint_lines

    @cached_property
    def lines(self) -> tuple[joint_lines.Line, ...]:
        """Return the joints as constructions."""
        return tuple(self.words.parse(self.joints))

    @cached_property
    def branches(self) -> Mapping[str, int]:
        """Return the assembly sign, +1 or -1, of each joint that has two."""
        return MappingProxyType(self.words.branches(self.lines))
