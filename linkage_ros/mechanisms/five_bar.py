# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The five-bar: two cranks that put one point anywhere in an area.

Cranks OA = a and QC = d turn independently, the rods AP = b and CP = c meet in P; ground OQ = f
along x. Angles are given for both cranks, in this order. Branch P is the side of A -> C, +1 left.
The defaults are those of a double SCARA robot with four equal arms.

Source: Norton, "Design of Machinery", sec. 4.9 (the geared five-bar, whose letters these are).
"""

from ..linkage import Design

DESIGN = Design('five_bar', {'a': 0.09, 'b': 0.09, 'c': 0.09, 'd': 0.09, 'f': 0.118}, tracer='P',
                joints=(
    'O ground 0 0',
    'Q ground f 0',
    'A crank O a',
    'C crank Q d',
    'P dyad A C b c left'))
