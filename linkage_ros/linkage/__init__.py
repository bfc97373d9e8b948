# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Linkages in the plane and in space: what other rooms import; `__all__` lists it. No ROS."""

from .dyads import bar_name, Dyads, Hinge, Pin, short, Slide
from .formulas import Leg, LinkPoint
from .geometry.builder import GROUND, Link
from .geometry.spatial import IN_SINGLE
from .inputs import Arc, Input, spread, theta_of, wrapped
from .inverse import Answer, Inverse, InverseLinkage, Solution
from .mechanism import Mechanism
from .motion.curves import ascending, extremes, sampled
from .motion.reach import reachable_arcs
from .statics import loaded_links
from .text import joint_lines, rod_lines
from .text.arguments import checked_branches, checked_dimensions, MAX_LENGTH, MIN_LENGTH
from .text.arithmetic import Formula
from .text.design import Design
from .text.rod_lines import FORMS, WindowError
from .tolerances import CLOSE, ROUNDING, TOLERANCE

__all__ = ['Answer', 'Arc', 'ascending', 'bar_name', 'checked_branches', 'checked_dimensions',
           'CLOSE', 'Design', 'Dyads', 'extremes', 'FORMS', 'Formula',
           'GROUND', 'Hinge', 'IN_SINGLE', 'Input', 'Inverse', 'InverseLinkage', 'joint_lines',
           'Leg', 'Link', 'LinkPoint', 'loaded_links', 'MAX_LENGTH', 'Mechanism', 'MIN_LENGTH',
           'Pin', 'reachable_arcs', 'rod_lines', 'ROUNDING', 'sampled', 'short', 'Slide',
           'Solution', 'spread', 'theta_of', 'TOLERANCE', 'WindowError', 'wrapped']
