# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What a type of mechanism is: its joint lines, and the dimensions that it usually has."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Callable, FrozenSet, List, Mapping, Optional, Tuple

from . import joint_lines, rod_lines


@dataclass(frozen=True)
class Design:
    """
    What a type of mechanism is: the name that users type, its defaults [m] and joint lines.

    The `tracer` is the joint whose curve is the locus; `signed` dimensions may be zero or
    negative. `check` takes the lines and a mechanism of this type and raises ValueError for
    dimensions that cannot be; by default every bar must have a length. Lines `in_space` are those
    of `rod_lines`, and `inputs` there the joints that are given, by default what is driven.
    """

    name: str
    dimensions: Mapping[str, float] = field(hash=False)
    joints: Tuple[str, ...]
    tracer: str
    signed: FrozenSet[str] = frozenset()
    check: Optional[Callable] = None
    in_space: bool = False
    inputs: Tuple[str, ...] = ()

    @property
    def words(self) -> Any:
        """The module that reads and draws the lines."""
        return rod_lines if self.in_space else joint_lines

    @cached_property
    def lines(self) -> List[joint_lines.Line]:
        """The joints as constructions."""
        return self.words.parse(self.joints)

    @cached_property
    def has_literal_lengths(self) -> bool:
        """Whether a length is written as a number, so that all count in metres."""
        return joint_lines.has_literal_lengths(self.lines)

    @cached_property
    def branches(self) -> dict:
        """The assembly sign, +1 or -1, of each joint that has two."""
        return self.words.branches(self.lines)
