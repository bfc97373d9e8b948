# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Hoeken's linkage: a four-bar that draws a nearly straight line at a nearly constant speed.

Crank OA = a, ground OQ = d along x, AB = QB = b, and the tracer P on the coupler drawn on as far
beyond B. P is on the straight part of its curve, parallel to the ground, while the crank is in
the half turn about pi. The defaults are the common proportions 1 : 2.5 : 2.

Source: Norton, "Design of Machinery", sec. 3.8, whose table 3-1 lists the proportions b/a and d/a
that are straightest over 20 to 180 degrees of the crank.
"""

from ..linkage import Design

DESIGN = Design('hoeken', {'a': 1.0, 'b': 2.5, 'd': 2.0}, tracer='P', joints=(
    'O ground 0 0',
    'Q ground d 0',
    'A crank O a',
    'B dyad A Q b b left',
    'P line A B 2*b'))
