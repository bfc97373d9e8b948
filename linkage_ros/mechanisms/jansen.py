# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Theo Jansen's leg: six constructions from a crank to a foot that walks.

The defaults are Jansen's holy numbers. A = m e^(i theta) turns about O, B = (-a, -l) is fixed;
C = dyad on B, A (b, j); D on the rigid triangle BC (d, e); E = dyad on B, A (c, k) on the other
side; F = dyad on E, D (g, f); the foot G on the rigid triangle EF (i, h).

Source: Jansen, "The Great Pretender"; lengths named as in Wikipedia, "Jansen's linkage".
"""

from ..mechanism import Design
from ..planar import LEFT

HOLY_NUMBERS = {
    'a': 38.0, 'b': 41.5, 'c': 39.3, 'd': 40.1, 'e': 55.8, 'f': 39.4, 'g': 36.7,
    'h': 65.7, 'i': 49.0, 'j': 50.0, 'k': 61.9, 'l': 7.8, 'm': 15.0,
}


def _draw(sketch, size, side):
    sketch.ground('O', 0.0, 0.0)
    sketch.ground('B', -size.a, -size.l)
    sketch.crank('A', 'O', size.m)
    sketch.dyad('C', 'B', 'A', size.b, size.j, side.C)
    sketch.rigid('D', 'B', 'C', size.d, size.e, LEFT)
    sketch.dyad('E', 'B', 'A', size.c, size.k, side.E)
    sketch.dyad('F', 'E', 'D', size.g, size.f, side.F)
    sketch.rigid('G', 'E', 'F', size.i, size.h, LEFT)


DESIGN = Design('jansen', HOLY_NUMBERS, _draw, tracer='G', branches={'C': 1, 'E': -1, 'F': 1})
