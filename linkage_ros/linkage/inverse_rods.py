# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The inverse of a linkage of rods: the same linkage, driven by its outputs.

What had been motors are then hinges that a rod tells, on either side of its crank: there is an
assembly mode for each choice of sides, the first as drawn.
"""

from __future__ import annotations

from itertools import product
from typing import Dict, List, Optional, TYPE_CHECKING

from .inverse_linkage import Mode, MOST_SIDES
from .quantities import Names, Structure
from .rod_lines import turning_rods
from ..formula.expression import derivative, Real

if TYPE_CHECKING:
    from .mechanism import Mechanism


class InverseRods:
    """
    The assembly modes of a linkage driven by its outputs; see `InverseLinkage`.

    Raises ValueError if what is left cannot be solved, or is drawn at a dead point.
    """

    def __init__(self, linkage: Mechanism, outputs: Names):
        driven = linkage.driven_by(*outputs)
        self.outputs, self.design = outputs, driven.design
        self.lines = self.design.joints
        rods = turning_rods(self.design.lines, outputs)
        if len(rods) > MOST_SIDES:
            raise ValueError(f'more than {2 ** MOST_SIDES} assembly modes')
        self.branches = dict.fromkeys(rods, 1)
        self.turns = ((0.0,),) * len(outputs)
        self.given: Dict[Real, Real] = {}
        names = [input_.name for input_ in linkage.inputs]
        self.modes = tuple(self._mode({**linkage.branches, **dict(zip(rods, sides))}, names)
                           for sides in product((1, -1), repeat=len(rods)))

    def _mode(self, sides: Dict[str, int], names: List[str]) -> Mode:
        structure = Structure(self.design, sides)
        rows = [structure.output(name) for name in names]
        known: List[Dict[Real, Real]] = [{} for _ in self.outputs]
        return Mode(structure, tuple(rows), tuple(
            tuple(derivative(value, {by: 1.0}, each) for by, each in enumerate(known))
            for value in rows))

    def __str__(self) -> str:
        return '\n'.join(f'{line}    # at {name}' if name in self.outputs else line
                         for line in self.lines for name in [line.split()[0]])


def taken_apart(linkage: Mechanism, outputs: Names) -> Optional[InverseRods]:
    """Return the inverse of rods for outputs, None where no closed form is known."""
    try:
        return InverseRods(linkage, outputs)
    except ValueError:
        return None
