# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Whitworth's quick return: a slotted lever that turns all round and drives a ram.

The pin A = i a e^(i theta) turns evenly about O, the lever about Q = (0, -b) inside the pin's
circle, b < a, since the pin runs in its slot; the lever's arm QL = c moves the ram R along the
horizontal through Q by a rod d. The ram goes one way while the crank turns 2 pi - beta, and back
while it turns beta, with cos(beta/2) = b/a. With b > a it is the crank and slotted lever of a
shaper, with the same ratio for sin(beta/2 - pi/2) = a/b.

Source: Norton, "Design of Machinery", sec. 3.7; the defaults a, b from an exercise in Khurmi and
Gupta, "Theory of Machines", ch. 5.
"""

from ..linkage import Design

DESIGN = Design('whitworth', {'a': 150.0, 'b': 100.0, 'c': 120.0, 'd': 400.0}, tracer='R',
                joints=(
    'O ground 0 0',
    'Q ground 0 -b',
    'A crank O a up',
    'L slot Q A 0 out c',
    'R slider L d Q 0 out'))
