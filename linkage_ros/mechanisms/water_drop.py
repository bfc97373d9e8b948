# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The water drop: a kite O-A-B-C whose bar AB, drawn on beyond A, writes a drop.

Lengths 1:1:2:2:3, OA = AB = a, OC = CB = 2a, AP = 3a; crank angle from +y. B is the mirror image
of O in line AC at every angle, so there is no root and no branch. P's curve has a cusp at the top,
since AP/AB = (2a + a)/(2a - a), and the area 8 pi a^2. Idea of the linkage: Keishiro Ueki.
"""

from ..linkage import Design

DESIGN = Design('water_drop', {'a': 1.0}, tracer='P', joints=(
    'O ground 0 0',
    'C ground 0 -2*a',
    'A crank O a up',
    'B mirror O A C',
    'P line A B -3*a'))
