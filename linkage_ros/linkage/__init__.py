# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Linkages in the plane and in space: what other rooms import; `__all__` lists it. No ROS."""

from .dyads import bar_name, Dyads, Hinge, Motor, Pin, short, Slide
from .formulas import Leg, LinkPoint
from .geometry.builder import GROUND, Link
from .geometry.spatial import IN_SINGLE
from .inputs import Arc, Input, spread
from .inverse import Answer, Inverse, InverseLinkage, Mode, Solution
from .kinematics import check_bars
from .mechanism import Mechanism
from .motion.curves import ascending, extremes, sampled
from .motion.reach import reachable_arcs
from .text import joint_lines, rod_lines
from .text.arguments import checked_branches, checked_dimensions
from .text.arithmetic import Formula
from .text.design import Design
from .text.rod_lines import FORMS, WindowError
from .tolerances import CLOSE, ROUNDING, TOLERANCE

__all__ = ['Answer', 'Arc', 'ascending', 'bar_name', 'check_bars', 'checked_branches',
           'checked_dimensions', 'CLOSE', 'Design', 'Dyads', 'extremes', 'FORMS', 'Formula',
           'GROUND', 'Hinge', 'IN_SINGLE', 'Input', 'Inverse', 'InverseLinkage', 'joint_lines',
           'Leg', 'Link', 'LinkPoint', 'Mechanism', 'Mode', 'Motor', 'Pin', 'reachable_arcs',
           'rod_lines', 'ROUNDING', 'sampled', 'short', 'Slide', 'Solution', 'spread',
           'TOLERANCE', 'WindowError']
