# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What the page is told of poses and curves: the functions behind its requests, without a node."""

import csv
import dataclasses
from functools import partial
import io
import itertools
import json
import math

from linkage_ros import mechanisms, scene
from linkage_ros.web import curves, poses
from linkage_ros.web.nearest_pose import nearest_inputs, theta_of
import numpy as np
import pytest
from scenes import alone, example, EXAMPLES

# An excavator twice as large, in the middle of its strokes.
DOUBLE = {'scale': 2.0, **{
    f'{name}.{key}': value for name, ends in (
        ('boom', [1.6, 2.4]), ('arm', [1.88, 3.0]), ('bucket', [1.72, 2.6]))
    for key, value in (('sweep', ends), ('start', sum(ends) / 2.0))}}


def mechanism_of(name, **changed):
    """Return the mechanism of an example with some values changed, and its inputs at the start."""
    values = example(name)
    key, = values['mechanisms']
    mechanism, = scene.read({**values, **{
        f'{key}.{name}': value for name, value in changed.items()}}).mechanisms.values()
    return mechanism, [settings.start for settings in mechanism.inputs.values()]


@pytest.mark.parametrize('path', EXAMPLES, ids=lambda path: path.stem)
def test_the_page_is_told_what_it_draws_and_moves(path):
    for mechanism in scene.load(str(path)).mechanisms.values():
        drawn = json.loads(json.dumps(poses.drawn(
            mechanism, dict.fromkeys(mechanism.inputs, 2.5)), allow_nan=False))
        legs = mechanism.assembly().legs
        assert len(drawn['legs']) == len(legs) and drawn['legs'][-1] + 1 == sum(
            leg.side > 0 for leg in legs.values())
        assert drawn['space'] == (mechanism.linkage.type == 'rods')
        assert drawn['points'] == list(mechanism.points)
        assert drawn['sides'].keys() == mechanism.linkage.branches.keys()
        assert drawn['inputs'].keys() == mechanism.inputs.keys()
        start = [settings.start for settings in mechanism.inputs.values()]
        for i, (key, settings) in enumerate(mechanism.inputs.items()):
            about = drawn['inputs'][key]
            assert (about['speed'], about['unit']) == (2.5, settings.input.unit)
            assert about['ends'] == [settings.arcs[0][0], settings.arcs[-1][1]]
            assert (about['turn'] is not None) == settings.input.is_angle
            other = [value + (about['turn'] or 0.0) * (j == i) for j, value in enumerate(start)]
            after = mechanism.linkage.solve(theta_of(other))
            for joint, place in mechanism.linkage.solve(theta_of(start)).items():
                np.testing.assert_allclose(after[joint], place, atol=1e-9)


@pytest.mark.parametrize('text, value, is_angle', [
    ('90deg', math.pi / 2.0, True), ('pi/2', math.pi / 2.0, True), ('2*(3+4)', 14.0, False),
    ('80,5', 80.5, False)])
def test_arithmetic_is_read_by_the_library(text, value, is_angle):
    assert poses.number(text) == {'value': value, 'turns': is_angle}


@pytest.mark.parametrize('text, reason', [
    ('1/0', 'must be 0 or between'), ('a+1', 'a is unknown'), ('__import__', 'not a number'),
    ('', 'not a number'), ('1,234.5', 'not a number'), ('0x50', 'not a number'),
    ('Infinity', 'not a number'), (400 * '9', 'must be 0 or between')])
def test_what_is_no_arithmetic_is_refused(text, reason):
    with pytest.raises(ValueError, match=reason):
        poses.number(text)


def test_no_joint_of_a_linkage_in_space_is_dragged():
    ankle, _ = mechanism_of('ankle')
    assert poses.tunable(ankle)['fixed'] == ankle.points


def test_a_bar_follows_a_dimension_that_can_only_become_shorter():
    # Longer, A, B and C are no triangle.
    bar = alone(['O ground 0 0', 'Q ground 4 0', 'A crank O 1', 'B dyad A Q 3 3 left',
                 'C rigid A B p 1 left'], dimensions__p=4.0)
    assert poses.tunable(bar)['bars'] == {'dimensions.p': [('A', 'C')]}


@pytest.mark.parametrize('name', ['excavator', 'jansen', 'peaucellier', 'scissor_lift'])
def test_a_table_has_every_quantity_of_every_output_in_its_unit(name):
    mechanism, present = mechanism_of(name, **{
        'excavator': DOUBLE, 'scissor_lift': {'scale': 2.0, 'carriage.start': 2.4}}.get(name, {}))
    present = [1.02 * value for value in present]
    heads, *rows = csv.reader(io.StringIO(curves.table(mechanism, present)))
    # Rounded, an end is outside the reach.
    columns, linkage = dict(zip(heads, np.array(rows, float).T[:, 1:-1])), mechanism.linkage
    unit_in = linkage.inputs[0].unit
    x = columns[f'{linkage.inputs[0].name} [{unit_in}]']
    theta = theta_of([value / scale for value, scale in zip([x, *present[1:]], mechanism.scales)])
    outputs = [*(joint for joint in linkage.joints if joint not in mechanism.inputs), *(
        f'{point}.{axis}' for point in linkage.points if point not in linkage.grounded
        for axis in 'xy')]
    angles = linkage.transmission_angles(theta)
    assert len(heads) == 1 + 4 * len(outputs) + len(angles)
    for joint, angle in angles.items():
        np.testing.assert_allclose(columns[f'transmission angle {joint} [rad]'], angle,
                                   rtol=1e-9, atol=1e-9)
    ratio = {'mm': '1', 'radrad': '1', 'radm': 'N·m/N', 'mrad': 'N/(N·m)'}
    for output, truth in linkage.joint_angles(theta, outputs).items():
        unit, size = 'rad' if linkage.is_angle(output) else 'm', mechanism.scale_of(output)
        position, speed, change, force = (columns[f'{kind} {output} [{form}]'] for kind, form in (
            ('position', unit), ('velocity', f'{unit}/s'), ('acceleration', f'{unit}/s²'),
            ('force ratio', ratio[unit + unit_in])))
        np.testing.assert_allclose(position, size * truth, rtol=1e-9, atol=1e-9 * size)
        inner = slice(60, -60)
        for slope, values in ((speed, np.unwrap(position) if unit == 'rad' else position),
                              (change, speed)):
            np.testing.assert_allclose(np.gradient(values, x)[inner], slope[inner],
                                       rtol=1e-2, atol=1e-9 * max(1.0, np.abs(position).max())
                                       + 1e-2 * np.abs(slope[inner]).max())
        known = np.isfinite(speed) & (np.abs(speed) > 1e-9 * np.abs(position).max())
        np.testing.assert_allclose(force[known] * speed[known], 1.0, rtol=1e-9)


@pytest.mark.parametrize('kind', ['velocity', 'acceleration'])
@pytest.mark.parametrize('name', ['excavator', 'jansen', 'scissor_lift'])
def test_arrows_are_how_the_joints_move_in_the_picture(name, kind):
    mechanism, starts = mechanism_of(name)
    speeds = {name: 0.1 * (2 + i) for i, name in enumerate(mechanism.inputs)}

    def places(time):
        own = [(start + time * speed) / mechanism.scale_of(name)
               for start, (name, speed) in zip(starts, speeds.items())]
        solved = mechanism.linkage.solve(theta_of(own))
        return {joint: mechanism.scale * place for joint, place in solved.items()}

    arrows, h = poses.arrows(mechanism, starts, kind, speeds), 1e-4
    before, now, after = map(places, (-h, 0.0, h))
    assert arrows.keys() == {'unit', 'at'}
    assert arrows['unit'] == {'velocity': 'm/s', 'acceleration': 'm/s²'}[kind]
    assert set(arrows['at']) == set(mechanism.linkage.points) - set(mechanism.linkage.grounded)
    for joint, arrow in arrows['at'].items():
        slope = ((after[joint] - before[joint]) / (2.0 * h) if kind == 'velocity' else
                 (after[joint] - 2.0 * now[joint] + before[joint]) / h ** 2)
        assert arrow == pytest.approx(slope, rel=1e-4, abs=1e-6)


@pytest.mark.parametrize('name, input_, value, expected, reach', [
    ('excavator', 'arm', 1.1, 1.1, None), ('twice', 'arm', 2.2, 2.2, None),
    ('excavator', 'arm', 2.0, 1.5, (0.94, 1.5)),
    ('excavator', 'boom', -2.0, 0.8, (0.8, 1.2)),
    ('jansen', 'crank', 7.0, 7.0 - math.tau, None), ('jansen', 'crank', -3.0, -3.0, None),
    ('peaucellier', 'crank', 1.0 - math.tau, 1.0, None),
    ('peaucellier', 'crank', 2.0, 1.171371086914302, (-1.171371086914302, 1.171371086914302)),
    ('scissor_lift', 'carriage', 0.1, 0.6, (0.6, 1.7))])
def test_an_input_goes_where_it_is_wanted_or_as_near_as_it_gets(
        name, input_, value, expected, reach):
    mechanism, present = (mechanism_of('excavator', **DOUBLE) if name == 'twice'
                          else mechanism_of(name))
    inputs, missed = poses.reached(mechanism, present, {'output': input_, 'value': value})
    assert dict(zip(mechanism.inputs, inputs)) == pytest.approx(
        {**dict(zip(mechanism.inputs, present)), input_: expected}, rel=1e-15)
    assert missed == (reach and {'name': input_, 'arcs': (reach,),
                                 'unit': mechanism.inputs[input_].input.unit})


def test_an_input_goes_to_the_nearest_of_two_arcs_and_not_where_nothing_can_be_assembled():
    bar = alone('four_bar', crank__start=1.0, **{
        f'dimensions.{name}': length for name, length in zip('abcd', (3.0, 2.0, 2.5, 3.0))})
    (low, beside), (beyond, high) = bar.first.reach
    for value, expected in ((3.0, high), (-3.0, low), (3.5, low), (0.01, beyond), (-0.01, beside)):
        (crank,), reach = poses.reached(bar, [1.0], {'output': 'crank', 'value': value})
        assert crank == pytest.approx(expected, abs=1e-12) and reach['arcs'] == bar.first.reach
    inside = 0.5 * (beyond + high)
    assert poses.reached(bar, [1.0], {'output': 'crank', 'value': inside}) == ([inside], None)
    five = alone('five_bar')
    with pytest.raises(scene.SceneError, match='^m cannot be assembled there$'):
        poses.reached(five, [1.9, 1.24], {'output': 'crank2', 'value': -1.9})


@pytest.mark.parametrize('name, changed, output, unit', [
    ('jansen', {'scale': 0.01}, 'G.x', 'm'), ('jansen', {}, 'EF', 'rad'),
    ('peaucellier', {'scale': 3.0}, 'C.y', 'm'), ('peaucellier', {}, 'PB', 'rad'),
    ('scissor_lift', {'scale': 2.0, 'carriage.start': 2.4}, 'P.y', 'm')])
def test_an_output_goes_where_it_is_wanted_or_to_the_end_of_its_reach(name, changed, output, unit):
    mechanism, present = mechanism_of(name, **changed)
    own, size = mechanism.scale_of(mechanism.first.input.name), mechanism.scale_of(output)

    def at(inputs):
        return size * mechanism.linkage.joint_angles(np.divide(inputs, own), [output])[output]

    (low, high), = mechanism.first.reach
    values = at(0.5 * (low + high - (high - low) * np.cos(np.linspace(0.0, math.pi, 20003)[1:-1])))
    values = np.unwrap(values) if unit == 'rad' else values
    ends = np.array([values.min(), values.max()])
    for part in (0.2, 0.5, 0.9):
        value = float(ends @ (1.0 - part, part))
        reached, reach = poses.reached(mechanism, present, {'output': output, 'value': value})
        assert reach is None
        assert math.remainder(at(reached)[0] - value, math.tau if unit == 'rad' else math.inf) == (
            pytest.approx(0.0, abs=1e-9))
    for end, beyond in zip(ends.tolist(), (np.ptp(ends) * np.array([-0.2, 0.2])).tolist()):
        value = end + beyond
        reached, reach = poses.reached(mechanism, present, {'output': output, 'value': value})
        assert (reach['name'], reach['unit']) == (output, unit)
        # Next to a dead point the last of the values is a little away from the end.
        np.testing.assert_allclose(np.ravel(reach['arcs']), ends, atol=3e-4 * np.ptp(ends))
        assert math.remainder(at(reached)[0] - end, math.tau if unit == 'rad' else math.inf) == (
            pytest.approx(0.0, abs=3e-4 * np.ptp(ends)))


@pytest.mark.parametrize('leg', range(6))
def test_a_joint_of_any_leg_goes_where_it_is_wanted_or_as_near_as_it_gets(leg):
    walker = alone('jansen', leg_pairs=3, scale=0.01)

    def foot(crank):
        # A pair is behind the one before, and its right leg is the mirror image.
        own = crank - leg // 2 * math.tau / 3
        x, y = 0.01 * mechanisms.create('jansen').solve(
            math.pi - own if leg % 2 else own, ('G',))['G'].T
        return np.stack([-x if leg % 2 else x, y], -1)

    for crank in (0.4, 2.0, -1.7):
        want = {'joint': 'G', 'leg': leg, 'place': foot(np.array([crank]))[0].tolist()}
        (crank_,), reach = poses.reached(walker, [crank + 0.2], want)
        assert math.remainder(crank_ - crank, math.tau) == pytest.approx(0.0, abs=1e-6)
        assert reach is None


def tip_of(digger, inputs):
    """Return where the tip of a digger of twice the size is."""
    return 2.0 * digger.linkage.solve(np.divide(inputs, 2.0), ('T',))['T']


def test_a_joint_moved_by_several_inputs_goes_where_it_is_wanted_within_their_ends():
    digger, present = mechanism_of('excavator', **DOUBLE)
    within, tip = [settings.ends for settings in digger.inputs.values()], partial(tip_of, digger)
    place = tip([2.1, 2.5, 2.0]).tolist()
    inputs, reach = poses.reached(digger, present, {'joint': 'T', 'place': place})
    assert tip(inputs).tolist() == pytest.approx(place, abs=1e-6) and reach is None
    far = poses.reached(digger, present, {'joint': 'T', 'place': [99.0, 0.0]})[0]
    assert all(low <= value <= high for value, (low, high) in zip(far, within))
    assert tip(far)[0] > max(tip(corner)[0] for corner in itertools.product(*within)) - 1e-6


@pytest.mark.nightly
def test_hardly_any_pose_of_a_grid_is_nearer_to_where_several_inputs_move_a_joint():
    digger, _ = mechanism_of('excavator', **DOUBLE)
    within = [settings.ends for settings in digger.inputs.values()]
    (low, high), rng = np.transpose(within), np.random.default_rng(1)
    grid = np.stack(np.meshgrid(*np.linspace(low, high, 41).T)).reshape(3, -1)
    reached = tip_of(digger, [*grid])
    worse = 0
    for want in np.nanmean(reached, axis=0) + rng.normal(size=(60, 2)) * 8.0:
        start = rng.uniform(low, high).tolist()
        inputs, _ = poses.reached(digger, start, {'joint': 'T', 'place': want.tolist()})
        nearest = np.nanmin(np.hypot(*(reached - want).T))
        worse += math.dist(tip_of(digger, inputs), want) > nearest + 0.02
    assert worse < 8


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('type_, joint, arcs', [
    ('jansen', 'G', [(-math.pi, math.pi)]), ('jansen', 'C', [(0.5, 2.0)]),
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
        distances = np.hypot(*(linkage.solve(float(theta), (joint,))[joint] - place))
        assert any(low <= theta <= high for low, high in arcs)
        assert distances <= np.hypot(*(path - place).T).min() + 0.1 * width


def test_a_rocker_that_is_dragged_stays_at_the_angle_of_its_crank_of_two_that_it_has():
    bar = mechanisms.create('four_bar')
    for crank in np.linspace(-3.0, 3.0, 13):
        place = bar.solve(crank + 0.03, ('B',))['B']
        crank_, = nearest_inputs(bar, 'B', place, [crank], [[(-math.pi, math.pi)]])
        assert abs(crank_ - crank) < 0.1


def test_what_cannot_be_assembled_is_not_dragged():
    linkage = mechanisms.create('peaucellier')
    with pytest.raises(ValueError, match='cannot be assembled'):
        nearest_inputs(linkage, 'C', [0.0, 0.0], [3.0], [[(3.0, 3.1)]])


def test_a_pose_of_several_inputs_is_described_whole():
    digger, present = mechanism_of('excavator', **DOUBLE)
    described, linkage = poses.described(digger, present), digger.linkage

    def at(inputs):
        angles = linkage.joint_angles(np.divide(inputs, 2.0), list(described['outputs']))
        return {name: value * (1.0 if linkage.is_angle(name) else 2.0)
                for name, value in angles.items()}

    assert described.keys() == {'inputs', 'outputs'}
    assert described['inputs'] == dict(zip(digger.inputs, present))
    assert list(described['outputs']) == [
        *(joint for joint in linkage.joints if joint not in digger.inputs), 'T.x', 'T.y']
    truth, h = at(present), 1e-6
    slopes = [[(at(np.add(present, step))[name] - at(np.subtract(present, step))[name]) / (2 * h)
               for step in h * np.eye(3)] for name in truth]
    for (name, about), slope in zip(described['outputs'].items(), slopes):
        assert about == {'value': pytest.approx(float(truth[name])),
                         'unit': 'rad' if linkage.is_angle(name) else 'm',
                         'rates': pytest.approx(slope, rel=1e-6, abs=1e-8)}


@pytest.mark.parametrize('scale', [1e-12, 1.0, 1e12])
def test_an_output_is_what_it_is_however_small_and_rounding_is_zero(scale):
    lift = example('scissor_lift')
    del lift['lift.carriage.start']
    mechanism = scene.read({**lift, 'lift.scale': scale}).mechanisms['lift']
    at = 1.2
    outputs = poses.described(mechanism, [at * scale])['outputs']
    truth = mechanism.linkage.solve(at, ('P',))['P'] * scale
    assert [outputs[name]['value'] for name in ('P.x', 'P.y')] == pytest.approx(list(truth))
    assert outputs['P.x']['rates'] == [0.0] and abs(outputs['P.y']['rates'][0]) > 0.1


def test_arrows_of_force_are_the_loads_and_what_holds_them():
    mechanism = alone('slotted_lever', loads=['L=3 -4', 'lever=2'])
    drawn = poses.arrows(mechanism, [0.5], 'force', {'crank': 1.0})
    effort, = mechanism.efforts([0.5])
    assert drawn == {'unit': 'N', 'at': {'L': (3.0, -4.0)}, 'efforts': {'crank': [effort, 'N·m']}}
    digger, present = mechanism_of('excavator')
    assert poses.arrows(digger, present, 'force', {}) == {'unit': 'N', 'at': {}, 'efforts': {}}
    loaded = dataclasses.replace(digger, loads={'T': (0.0, -9.0)})
    assert poses.arrows(loaded, present, 'force', {}) == {
        'unit': 'N', 'at': {'T': (0.0, -9.0)}, 'efforts': {
            name: [effort, 'N'] for name, effort in zip(digger.inputs, loaded.efforts(present))}}


@pytest.mark.parametrize('name, output', [
    ('excavator', 'T.y'), ('jansen', 'G.x'), ('peaucellier', 'PB'), ('peaucellier', 'C.y')])
def test_a_position_is_drawn_as_it_bends_even_next_to_a_dead_point(name, output):
    mechanism, present = mechanism_of(name)
    curve = curves.curve(mechanism, present, 'position', output)
    x, y = np.array(curve['x']), np.array(curve['y'], float)
    middle = 0.5 * (x[:-1] + x[1:])
    sizes = [mechanism.scale_of(key) for key in mechanism.inputs]
    inputs = [middle / sizes[0], *(value / size for value, size in zip(present[1:], sizes[1:]))]
    truth = mechanism.scale_of(output) * mechanism.linkage.joint_angles(
        inputs if len(inputs) > 1 else inputs[0], [output])[output]
    assert abs(truth - 0.5 * (y[:-1] + y[1:])).max() < np.ptp(y) / 500.0


def test_no_line_goes_through_a_pole():
    curve = curves.curve(alone('slotted_lever'), [0.3], 'force ratio', 'lever')
    x, y = np.array(curve['x']), np.array(curve['y'], float)
    turns = math.pi - math.acos(80.0 / 150.0)
    gaps = x[np.isnan(y)].reshape(2, 2)
    assert (gaps[:, 0] < [-turns, turns]).all() and ([-turns, turns] < gaps[:, 1]).all()
    assert np.ptp(gaps, axis=1).max() < 0.02
    assert (np.diff(x) >= 0.0).all()
    # Wherever two neighbours are joined, the ratio is of one sign.
    assert (y[:-1] * y[1:] < 0.0).sum() == 0


@pytest.mark.parametrize('kind, power', [
    ('position', 0), ('velocity', 1), ('acceleration', 2), ('transmission angle', 0)])
def test_a_curve_says_how_it_grows_with_the_speed(kind, power):
    assert curves.curve(*mechanism_of('jansen'), kind, None)['power'] == power
    ended = curves.curve(*mechanism_of('peaucellier'), kind, None)
    # An end of the reach is a dead point, and is not named twice.
    assert len(ended['ends']) == 2 and not ended['dead']
