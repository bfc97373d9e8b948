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

NUMBERS = (Parameter.Type.INTEGER, Parameter.Type.DOUBLE)
SCENES = [
    {},
    {'mechanisms': ['walker', 'lever'], 'walker.type': 'jansen', 'walker.leg_pairs': 6,
     'walker.scale': 0.01, 'walker.dimensions.m': 12.34, 'lever.type': 'slotted_lever',
     'lever.dimensions.a': 0.37, 'lever.dimensions.b': 0.7, 'lever.dimensions.e': -0.01},
]
CANNOT_BE = re.compile(r'dimensions must let the \w+ be assembled|crank\.start must be inside the')


def stops(low, high, whole):
    """Return the values that the slider can send (rqt_reconfigure, param_editors.py)."""
    if whole:
        return list(range(low, high + 1))
    scale = 100 / (high - low)
    return [place / scale for place in range(round(low * scale), round(high * scale) + 1)]


def some(values):
    """Return the ends and every tenth between: to build a linkage anew takes its time."""
    return sorted({*values[:2], *values[::10], *values[-2:]})


def numbers(node):
    """Return parameter, descriptor and range of every number, None where it has no range."""
    for parameter in node.get_parameters_by_prefix('').values():
        if parameter.type_ in NUMBERS:
            about = node.describe_parameter(parameter.name)
            ranges = [*about.floating_point_range, *about.integer_range]
            yield parameter, about, ranges[0] if len(ranges) == 1 else None


@pytest.fixture(params=[(kind, i) for kind in (CrankDriver, Kinematics)
                        for i in range(len(SCENES))],
                ids=lambda param: f'{param[0].__name__}-{param[1]}')
def node(request, graph):
    """Start each node with each scene."""
    kind, scene = request.param
    return graph.start(kind, SCENES[scene])


@pytest.mark.nightly
def test_every_stop_is_accepted_or_the_linkage_forbids_it(node):
    accepted = 0
    for parameter, about, range_ in numbers(node):
        if about.read_only or range_ is None:
            continue
        values = stops(range_.from_value, range_.to_value,
                       parameter.type_ == Parameter.Type.INTEGER)
        for value in values if '.crank.' in about.name else some(values):
            result, = node.set_parameters([Parameter(about.name, parameter.type_, value)])
            assert result.successful or CANNOT_BE.search(result.reason), (value, result.reason)
            accepted += result.successful
        assert node.set_parameters([parameter])[0].successful
    assert accepted > 15
