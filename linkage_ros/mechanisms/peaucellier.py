# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The Peaucellier-Lipkin cell: a straight line from circles.

The pole P = (-r, 0) lies on the crank circle OA = r; PB = PD = a, rhombus A-B-C-D of b. The
corner C runs on x = (a - b)(a + b)/2r - r, with y = (a - b)(a + b)/2r tan(theta/2). The crank
reaches |a - b| <= 2 r |cos(theta/2)| <= a + b.

Source: Hartenberg and Denavit, "Kinematic Synthesis of Linkages", ch. 5.
"""

from ..linkage import Design

DESIGN = Design('peaucellier', {'r': 3.0, 'a': 9.0, 'b': 4.0}, tracer='C', joints=(
    'O ground 0 0',
    'P ground -r 0',
    'A crank O r',
    'B C D inversor P A a b'))
