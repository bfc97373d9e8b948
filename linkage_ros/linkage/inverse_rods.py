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

from .inverse_linkage import InverseLinkage, Mode, MOST_SIDES
from .quantities import Names, Structure
from .rod_lines import turning_rods
from ..formula.expression import derivative, Real

if TYPE_CHECKING:
    from .mechanism import Mechanism


def taken_apart(linkage: Mechanism, outputs: Names) -> Optional[InverseLinkage]:
    """Return the inverse of rods for outputs, None where no closed form is known."""
    try:
        design = linkage.driven_by(*outputs).design
        rods = tuple(turning_rods(design.lines, outputs))
        if len(rods) > MOST_SIDES:
            return None
        names = [input_.name for input_ in linkage.inputs]
        modes = tuple(_mode(
            Structure(design, {**linkage.branches, **dict(zip(rods, sides))}), names, outputs)
            for sides in product((1, -1), repeat=len(rods)))
        return InverseLinkage(design.joints, {name: (name, 1.0, 0.0) for name in outputs}, rods,
                              modes, ((0.0,),) * len(outputs), {})
    except ValueError:
        return None


def _mode(structure: Structure, names: List[str], outputs: Names) -> Mode:
    rows = tuple(structure.output(name) for name in names)
    known: List[Dict[Real, Real]] = [{} for _ in outputs]
    return Mode(structure, rows, tuple(
        tuple(derivative(value, {by: 1.0}, each) for by, each in enumerate(known))
        for value in rows))
