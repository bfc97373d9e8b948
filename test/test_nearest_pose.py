# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A joint that is dragged: no other pose that the inputs allow brings it nearer."""

import math
from pathlib import Path

from linkage_ros import mechanisms, scene
from linkage_ros.web.nearest_pose import nearest_inputs
import numpy as np
import pytest

CONFIG = Path(__file__).parents[1] / 'config'
TURN = (-math.pi, math.pi)


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('type_, joint, arcs', [
    ('jansen', 'G', [TURN]), ('jansen', 'C', [(0.5, 2.0)]), ('slotted_lever', 'L', [TURN]),
    ('peaucellier', 'C', None), ('water_drop', 'P', [(-1.0, 0.25)])])
def test_no_pose_of_a_fine_scale_is_nearer_by_more_than_the_leash(type_, joint, arcs):
    linkage = mechanisms.create(type_)
    arcs = arcs or linkage.reach()
    samples = np.concatenate([np.linspace(*arc, 20001) for arc in arcs])
    path = linkage.solve(samples, (joint,))[joint]
    width = np.ptp(path, axis=0).max()
    rng = np.random.default_rng(16)
    for place in path.mean(axis=0) + rng.normal(size=(40, 2)) * width:
        theta, = nearest_inputs(linkage, joint, place, [arcs[0][0]], [arcs])
        away = np.hypot(*(linkage.solve(float(theta), (joint,))[joint] - place))
        assert any(low <= theta <= high for low, high in arcs)
        assert away <= np.hypot(*(path - place).T).min() + 0.1 * width


def test_a_joint_comes_to_where_it_was_in_another_pose_near_by():
    linkage = mechanisms.create('jansen')
    for theta in np.linspace(-3.0, 3.0, 25):
        place = linkage.solve(theta + 0.2, ('G',))['G']
        found = nearest_inputs(linkage, 'G', place, [theta], [[TURN]])
        assert math.remainder(found[0] - theta - 0.2, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_several_inputs_share_the_work_and_each_stops_at_its_end():
    machine = scene.load(str(CONFIG / 'excavator.yaml')).machines['excavator']
    linkage, arcs = machine.linkage, [[drive.ends] for drive in machine.inputs.values()]
    present, other = [1.0, 1.1, 1.0], [1.1, 1.3, 0.9]
    place = linkage.solve(other, ('T',))['T']
    found = nearest_inputs(linkage, 'T', place, present, arcs)
    assert linkage.solve(found, ('T',))['T'] == pytest.approx(place, abs=1e-9)
    far = nearest_inputs(linkage, 'T', [50.0, 0.0], present, arcs)
    assert all(arc[0][0] <= value <= arc[0][1] for value, arc in zip(far, arcs))
    assert far[1] == arcs[1][0][0]


def test_what_cannot_be_assembled_is_not_dragged():
    linkage = mechanisms.create('peaucellier')
    with pytest.raises(ValueError, match='cannot be assembled'):
        nearest_inputs(linkage, 'C', [0.0, 0.0], [3.0], [[(3.0, 3.1)]])
