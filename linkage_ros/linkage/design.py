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
    What a type of mechanism is.

    Parameters
    ----------
    name : str
        The name that users type.
    dimensions : mapping
        Defaults [m].
    joints : tuple of str
        One line a joint, as `joint_lines` or `rod_lines` read them.
    tracer : str
        The joint whose curve is the locus.
    signed : frozenset
        Dimensions that may be zero or negative.
    check : callable, optional
        From the lines and a mechanism of this type; raises ValueError for dimensions that cannot
        be. Default: every bar must have a length.
    in_space : bool
        Whether the lines are those of `rod_lines`.
    inputs : tuple of str
        In space, the joints that are given. Default: what is driven.

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
