# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The inverse of a linkage of rods: the same linkage, driven by its outputs.

What were motors are then hinges that a rod places, on either side of its crank: there is an
assembly mode for each choice of sides, the first as drawn.
"""

from __future__ import annotations

from itertools import product
from typing import Dict, List, Optional, Tuple, TYPE_CHECKING

from .inverse_linkage import Mode, MOST_SIDES
from .quantities import Names, Structure
from .rod_lines import turning_rods
from ..formula.expression import argument, derivative, Real, real, substituted

if TYPE_CHECKING:
    from .mechanism import Mechanism


class InverseRods:
    """
    The assembly modes of a linkage driven by its outputs; see `InverseLinkage`.

    Raises ValueError if what is left cannot be solved, or is drawn at a dead point.
    """

    def __init__(self, linkage: Mechanism, outputs: Names):
        self.design = linkage.driven_by(*outputs).design
        self.outputs, self.lines, n = outputs, self.design.joints, len(outputs)
        rods = turning_rods(self.design.lines, outputs)
        if len(rods) > MOST_SIDES:
            raise ValueError(f'more than {2 ** MOST_SIDES} assembly modes')
        self.branches = dict.fromkeys(rods, 1)
        self.turns = ((0.0,),) * n
        self.given: Dict[Real, Real] = {}
        # Whether the linkage itself has no other side: then all modes are its own.
        self.is_own = not turning_rods(linkage.design.lines, ())
        # Drawn once: sides are arguments, too, until each mode has its own.
        structure = Structure(self.design, {**linkage.branches, **{
            rod: argument(n + i) for i, rod in enumerate(rods)}})
        values = [structure.output(input_.name) for input_ in linkage.inputs]
        known: List[Dict[Real, Real]] = [{} for _ in outputs]
        rates = [derivative(value, {by: 1.0}, each)
                 for value in values for by, each in enumerate(known)]
        self.modes = tuple(self._mode(structure, values + rates, sides)
                           for sides in product((1.0, -1.0), repeat=len(rods)))

    def _mode(self, structure: Structure, row: List[Real], sides: Tuple[float, ...]) -> Mode:
        n = len(self.outputs)
        row = substituted(row, [*map(argument, range(n)), *map(real, sides)])
        return Mode(structure, tuple(row[:n]), tuple(
            tuple(row[at:at + n]) for at in range(n, n + n * n, n)))

    def __str__(self) -> str:
        return '\n'.join(f'{line}    # at {name}' if name in self.outputs else line
                         for line in self.lines for name in [line.split()[0]])


def taken_apart(linkage: Mechanism, outputs: Names) -> Optional[InverseRods]:
    """Return the inverse of rods for outputs, None where no closed form is known."""
    try:
        return InverseRods(linkage, outputs)
    except ValueError:
        return None
