# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What many mechanisms share, and what a change to one of them leaves alone, counted."""

import gc
from itertools import combinations, islice, permutations
import math
import weakref

from effort import few_calls
from hypothesis import given, settings, strategies as st
from linkage_ros import mechanisms, scene
from linkage_ros.cache import SIZE
from linkage_ros.formula.expression import Real
from linkage_ros.robot_model import bodies
import pytest

PAIR = {'mechanisms': ['m3', 'm4'], 'm3.type': 'four_bar', 'm4.type': 'slider_crank'}


def jansens(a):
    """Return jansens with a dimension, of three sizes."""
    parameters = {f'{name}.{key}': value for i, name in enumerate('xyz') for key, value in (
        ('type', 'jansen'), ('scale', 1.0 + i), ('dimensions.a', a))}
    shown = scene.read({'mechanisms': [*'xyz'], **parameters})
    return [*shown.mechanisms.values()]


def test_equal_linkages_are_one_and_their_travels_are_found_once():
    first, *others = jansens(38.0625)
    assert all(other.linkage is first.linkage for other in others)
    travels = bodies.travels(first)
    with few_calls(500):
        assert bodies.travels(others[0]) == travels
    assert jansens(38.125)[0].linkage is not first.linkage


def test_a_linkage_that_nobody_holds_is_gone_after_some_others():
    gone = weakref.ref(jansens(38.25)[0].linkage)
    for i in range(20):
        jansens(39.0 + i / 64)
    gc.collect()
    assert gone() is None


@pytest.mark.nightly
def test_other_outputs_leave_nothing_behind_in_a_linkage():
    linkage = mechanisms.create('four_bar')
    outputs = [f'distance({a},{b})' for a, b in permutations(linkage.points[:5], 2)][:17]

    def expressions():
        # More pairs than a linkage caches.
        for pair in islice(combinations(outputs, 2), SIZE + 5):
            linkage.joint_angles(0.3, pair)
        gc.collect()
        return sum(isinstance(part, Real) for part in gc.get_objects())

    assert expressions() == expressions()


# Of some parameters of the scene, values that are allowed and values that are not.
CHANGES = {
    **{f'm{i}.{key}': values for i in (3, 4) for key, values in {
        'scale': (2.0, 1, 5e-324, 0.0, -1.0, math.nan, '2'),
        'dimensions.a': (1.01, 30.0, 1e9, 0.0),
        'pose': ([1.0] * 6, [0.0] * 5, [math.inf] * 6),
        'joint_names': ([], ['crank=wheel'], ['crank=-wheel+1'], ['wheel=crank'], 'crank=wheel'),
        'crank.start': (0.1, 3.0, 100.0), 'crank.speed': (-1.0, 1e3),
        'type': ('slider_crank', 'four_bar', 'fourbar'), 'nonsense': (1.0,)}.items()},
    'frame_id': ('map', '', 1), 'rate': (0.0, 20.0, -1.0), 'nobody.scale': (1.0,),
    'mechanisms': (['m4', 'm3'], ['m3', 'm3'], [])}


def outcome(read, *args):
    """Return a scene's parameters, or why there is none, and the scene."""
    try:
        made = read(*args)
    except scene.SceneError as error:
        return str(error), None
    return made.parameters, made


VALUE = st.sampled_from(sorted(CHANGES)).flatmap(
    lambda name: st.tuples(st.just(name), st.sampled_from(CHANGES[name])))


@settings(max_examples=20)
@given(st.lists(st.lists(VALUE, min_size=1, max_size=3).map(dict), max_size=6))
def test_a_scene_with_any_history_is_what_its_values_read_anew_make(history):
    made = scene.read(PAIR)
    for change in history:
        before = made.parameters
        result, new = outcome(scene.changed, made, change)
        # All that was not changed keeps its value, defaults, too.
        values = {parameter.name: parameter.value for parameter in before}
        assert result == outcome(scene.read, {**values, **change})[0]
        assert made.parameters == before
        made = new or made


def test_a_change_to_one_mechanism_leaves_the_messages_of_all_others(graph):
    from linkage_ros.nodes.kinematics import Kinematics

    node = graph.start(Kinematics, PAIR)
    before, after = map(node.prepare, (
        node.scene, scene.changed(node.scene, {'m4.scale': 2.5, 'm3.scale': 1.0})))
    assert {name for name in after if after[name] is not before[name]} == {'m4'}
