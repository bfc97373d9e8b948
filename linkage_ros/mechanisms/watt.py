# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Watt's linkage: two equal arms and a short coupler whose middle runs nearly straight up and down.

Arms OA = QB = a point towards each other along x, the coupler AB = c hangs between their tips:
Q = (2a, -c). Its middle P writes a lemniscate that is flat about the middle of the stroke.

Sources: Watt's letter to Boulton of 1784; Weisstein, "Watt's Curve", MathWorld.
"""

from ..linkage import Design

DESIGN = Design('watt', {'a': 3.0, 'c': 2.0}, tracer='P', joints=(
    'O ground 0 0',
    'Q ground 2*a -c',
    'A crank O a',
    'B dyad A Q c a right',
    'P line A B c/2'))
