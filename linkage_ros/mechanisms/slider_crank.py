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
