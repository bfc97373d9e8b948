# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The pantograph: a copy T of the crank pin's circle, d/b times as large.

The pole F, the pin A and the copy T are on one line: bars FBD and DCT with FB = b, FD = d, and the
parallelogram ABDC with AB = DC = c, so that T = F + (A - F) d/b. The crank OA = a turns at a
distance g to the right of the pole; d > b.

Source: Scheiner, "Pantographice", 1631; Hartenberg and Denavit, "Kinematic Synthesis of Linkages".
"""

from ..linkage import Design

DESIGN = Design('pantograph', {'a': 1.0, 'b': 2.5, 'c': 2.5, 'd': 5.0, 'g': 3.0}, tracer='T',
                joints=(
    'O ground 0 0',
    'F ground -g 0',
    'A crank O a',
    'B dyad F A b c left',
    'D line F B d',
    'C parallelogram B A D',
    'T line D C c*d/b'))
