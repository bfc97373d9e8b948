# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The inverse of a linkage of rods: the same linkage, driven by its outputs.

A rod then places each former motor, now a hinge, on either side of its crank, or on the drawn one
alone if it is one of two that place two hinges. Each choice of sides is an assembly mode; the
first is the one that is drawn.
"""

from __future__ import annotations

from itertools import product

from .linkage import InverseLinkage, MAX_MODES
from ..formulas import LinkageFormulas, Names
from ..kinematics import Kinematics
from ..text.rod_lines import turning_rods
from ...formula.expression import argument, real, substituted


def decompose(linkage: Kinematics, outputs: Names) -> InverseLinkage | None:
    """Return the inverse of rods for outputs, None where no closed form is known."""
    try:
        design, n = linkage.driven_by(*outputs).design, len(outputs)
        rods = tuple(turning_rods(design.lines, outputs))
        if 2 ** len(rods) > MAX_MODES:
            return None
        # Solved once for all modes: the sides are arguments here, and constants in each mode.
        leaves = {rod: argument(n + i) for i, rod in enumerate(rods)}
        formulas = LinkageFormulas(design, {**linkage.branches, **leaves})
        values = [formulas.output(input_.name) for input_ in linkage.inputs]
        modes = {sides: tuple(substituted(values, dict(zip(leaves.values(), map(real, sides)))))
                 for sides in product((1.0, -1.0), repeat=len(rods))}
        return InverseLinkage(design.joints, {name: (name, 1.0, 0.0) for name in outputs}, rods,
                              modes, ((0.0,),) * n)
    except ValueError:
        return None
