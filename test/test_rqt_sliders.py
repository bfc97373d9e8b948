# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The parameters in rqt_reconfigure: each limited number has a slider, and no stop is a trap.

Its slider for floats has 100 steps between the ends of the range, counted from zero, so that an
end that is no whole step is not met. What may refuse a stop is the linkage alone, never the range.
"""

import re

import pytest

pytest.importorskip('rclpy')

from linkage_ros.nodes.crank_driver import CrankDriver  # noqa: E402
from linkage_ros.nodes.kinematics import Kinematics  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402

SCENES = [
    {},
    {'mechanisms': ['walker', 'lever'], 'walker.type': 'jansen', 'walker.leg_pairs': 6,
     'walker.scale': 0.01, 'walker.dimensions.m': 12.34, 'lever.type': 'slotted_lever',
     'lever.dimensions.a': 0.37, 'lever.dimensions.b': 0.7, 'lever.dimensions.e': -0.01},
]
CANNOT_BE = re.compile(r'dimensions must let the \w+ be assembled')


@pytest.mark.nightly
@pytest.mark.parametrize('scene', SCENES, ids=range(len(SCENES)))
@pytest.mark.parametrize('kind', [CrankDriver, Kinematics])
def test_every_stop_is_accepted_or_the_linkage_forbids_it(graph, kind, scene):
    node, accepted = graph.start(kind, scene), 0
    for parameter in node.get_parameters_by_prefix('').values():
        about = node.describe_parameter(parameter.name)
        for ends in (*about.floating_point_range, *about.integer_range):
            low, high = ends.from_value, ends.to_value
            assert low <= parameter.value <= high and about.additional_constraints, about.name
            # What the slider can send (rqt_reconfigure, param_editors.py).
            scale = 100 / (high - low) if isinstance(low, float) else 1
            values = [place / scale if isinstance(low, float) else place
                      for place in range(round(low * scale), round(high * scale) + 1)]
            # To build a linkage anew takes its time.
            few = sorted({*values[:2], *values[::10], *values[-2:]})
            for value in values if '.crank.' in about.name else few if not about.read_only else ():
                result, = node.set_parameters([Parameter(about.name, parameter.type_, value)])
                assert result.successful or CANNOT_BE.search(result.reason), (value, result.reason)
                accepted += result.successful
            assert about.read_only or node.set_parameters([parameter])[0].successful
    assert accepted > 15
