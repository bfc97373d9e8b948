# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The slider-crank: crank OA = a, rod AB = b, and a block B that slides along y = c.

Branch B is the block ahead (+1) of the pin or behind it. The defaults are Norton's example of an
offset slider-crank; c = 0 is the piston engine. With b = a and c = 0 the linkage has change
points where the crank stands upright.

Source: Norton, "Design of Machinery", sec. 4.6.
"""

from ..linkage import Design

DESIGN = Design('slider_crank', {'a': 40.0, 'b': 120.0, 'c': -20.0}, tracer='B',
                signed=frozenset('c'), joints=(
    'O ground 0 0',
    'G ground 0 c',
    'A crank O a',
    'B slider A b G 0 out'))
