# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Types of mechanisms: joint lines and default dimensions."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
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

    @property
    def words(self) -> Any:
        """Return the module that reads and draws the lines."""
        return rod_lines if self.in_space else joint_lines

    @cached_property
    def lines(self) -> list[joint_lines.Line]:
        """Return the joints as constructions."""
        return self.words.parse(self.joints)

    @cached_property
    def branches(self) -> dict:
        """Return the assembly sign, +1 or -1, of each joint that has two."""
        return self.words.branches(self.lines)
