# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Mechanisms, and those of scenes, are copied and pickled, and answer the same."""

from copy import copy, deepcopy
import pickle

from linkage_ros import mechanisms, scene
import numpy as np
import pytest
from scenes import BOOM, EXAMPLES

FIVE = np.array([-3.0, 0.0, 0.4, 1.3, 1e6])
CRANK = mechanisms.create('custom', tracer='A', r=1.2, joints=(
    'O ground 0 0', 'Q ground 3 0', 'A crank O r', 'B dyad A Q 2.5 2.5 left'))
LINKAGES = {
    **{kind: mechanisms.create(kind) for kind in mechanisms.TYPES}, 'custom': CRANK,
    'other dimensions': CRANK.with_dimensions(r=0.1 + 0.2),
    'another branch': mechanisms.create('water_drop', branches=dict.fromkeys(
        mechanisms.design('water_drop').branches, -1)),
    'many at once': mechanisms.create('four_bar', a=np.linspace(0.5, 1.0, 5)),
    'a cylinder': mechanisms.create('custom', joints=BOOM)}
WAYS = {'copy': copy, 'deepcopy': deepcopy, **{
    f'protocol {protocol}': lambda linkage, protocol=protocol: pickle.loads(
        pickle.dumps(linkage, protocol)) for protocol in range(pickle.HIGHEST_PROTOCOL + 1)}}


def bits(value):
    """Return the bits of numbers, those of NaN aside: it may have either sign."""
    value = np.asarray(value, float)
    return np.where(np.isnan(value), np.nan, value).tobytes()


def answers(linkage):
    """Return bits of what a linkage is asked for."""
    several = [FIVE + shift for shift in range(len(linkage.inputs))]
    theta = several if len(several) > 1 else FIVE
    values = [*linkage.solve(theta).values(), *linkage.joint_angles(theta).values(),
              *linkage.joint_rates(theta).values(), *linkage.velocity(theta).values()]
    if len(linkage.inputs) == 1 and not any(map(np.ndim, linkage.dimensions.values())):
        values += [linkage.reach(), linkage.dead_points(), linkage.function()(0.4)]
    return b''.join(map(bits, values))


@pytest.mark.nightly(all_but=10)
@pytest.mark.parametrize('way', WAYS)
@pytest.mark.parametrize('name', LINKAGES)
def test_a_copy_answers_the_same(name, way):
    linkage = LINKAGES[name]
    other = WAYS[way](linkage)
    assert other is not linkage and type(other) is type(linkage) and repr(other) == repr(linkage)
    assert (other.branches, other.tracer) == (linkage.branches, linkage.tracer)
    assert answers(other) == answers(linkage)


@pytest.mark.parametrize('way', WAYS.values(), ids=WAYS)
def test_answers_go_to_other_processes(way):
    solutions = mechanisms.create('five_bar').inputs_for(('P.x', 'P.y'), (0.05, 0.15))
    assert [(each.inputs, each.mode) for each in map(way, solutions)] == [
        (each.inputs, each.mode) for each in solutions]


@pytest.mark.parametrize('name', LINKAGES)
def test_a_copy_has_the_code_of_what_it_was_copied_from(name):
    linkage = LINKAGES[name]
    other = pickle.loads(pickle.dumps(linkage))
    assert other.compiled_pose().variant is linkage.compiled_pose().variant


def test_a_copy_of_an_accelerated_one_is_accelerated():
    pytest.importorskip('llvmlite')
    quick = mechanisms.create('jansen').accelerated()
    theta = np.linspace(-3.0, 3.0, 1000)
    assert np.array_equal(pickle.loads(pickle.dumps(quick)).solve(theta)['G'],
                          quick.solve(theta)['G'])


@pytest.mark.nightly(all_but=4)
@pytest.mark.parametrize('file', EXAMPLES, ids=lambda file: file.stem)
def test_scenes_and_what_is_in_them_can_be_sent(file):
    sent = scene.load(str(file))
    for way in WAYS.values():
        got = way(sent)
        assert got.parameters == sent.parameters and list(got.mechanisms) == list(sent.mechanisms)
        for mechanism, other in zip(sent.mechanisms.values(), got.mechanisms.values()):
            assert answers(other.linkage) == answers(mechanism.linkage)
            assert (other.inputs, other.joints) == (mechanism.inputs, mechanism.joints)
