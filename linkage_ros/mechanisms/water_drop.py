# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

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
