# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Barrels, rods, guides and blocks are where the joints say, in every pose and in every leg."""

from itertools import combinations

from linkage_ros import mechanisms, scene
from linkage_ros.linkage import GROUND, LinkPoint
from linkage_ros.robot_model import shapes
from linkage_ros.robot_model.shapes import BARREL, BLOCK, GUIDE, ROD
import numpy as np
import pytest
from scenes import alone, BOOM, CASSIE, ENGINE

MOVING = ('O ground 0 0', 'Q ground 1.6 0', 'A crank O 0.5', 'B dyad A Q 1.8 1 left',
          'D ground 0.8 1.2', 'S slider D 0.7 A along B out', 'T block S 0.1 0.2')
FLAT = 'O ground 0 0', 'A crank O 1', 'P rigid O A 0.5 0.5 left'
RACK = ('O ground 0 0', 'H ground 1 0.5', 'S carriage O along H 0.1 0.9', 'A ground 0.2 0.7',
        'B dyad S A 0.6 0.5 left', 'm mirrored O H')


MACHINES = {
    'excavator': lambda: scene.load('config/excavator.yaml').mechanisms['excavator'],
    'boxer engine': lambda: alone(ENGINE, leg_pairs=2, scale=0.01),
    'guide on a coupler': lambda: alone(MOVING, crank__sweep=[0.8, 1.6], scale=3.0),
    'rack and its image': lambda: alone(RACK),
    'slotted_lever': lambda: alone('slotted_lever', dimensions__e=20.0, scale=1e-3),
    'slider_crank': lambda: alone('slider_crank'),
}


def poses(one, count=40):
    """Yield joints by name, lengths of slides, and the ends of each shape, as complex numbers."""
    found = shapes.shapes(one)
    ends = [end for shape in found for end in (shape.start, shape.end)]
    slides = tuple(link.name for link in one.linkage.links if link.kind == 'prismatic')
    inputs = [name for name in slides if name in one.inputs]
    solution = one.assembly().solution(
        (*one.linkage.points, *ends), [name for name in slides if name not in inputs])
    random, points = np.random.default_rng(0), one.linkage.points
    for _ in range(count):
        values = [random.uniform(*(drive.ends or drive.reach[0])) for drive in one.inputs.values()]
        solution.solve(values)
        for row in solution.rows[np.isfinite(solution.rows).all(axis=1)]:
            places = row[:2 * (len(points) + len(ends))].reshape(-1, 2) @ (1, 1j)
            yield (dict(zip(points, places)), dict(zip(one.inputs, values)),
                   list(zip(found, places[len(points):].reshape(-1, 2))))


@pytest.mark.parametrize('name', MACHINES)
def test_what_slides_is_where_its_joints_say(name):
    one, count, ends = MACHINES[name](), 0, {}
    size = one.scale * one.linkage.longest
    near = pytest.approx(0.0, abs=1e-13 * max(size, 1.0))
    for place, lengths, drawn in poses(one):
        for shape, (start, end) in drawn:
            link, count = shape.slide, count + 1
            along = (end - start) / abs(end - start)
            ends.setdefault(shape, []).append((start, end))
            tip = (place[link.tip] - start) / along
            if shape.kind in (GUIDE, BLOCK):
                assert tip.imag == near and 0.0 < tip.real < abs(end - start)
            if shape.kind == GUIDE and 'slide' not in link.name:
                assert ((place[link.joint] - start) / along).imag == near
            if shape.kind == BLOCK:
                assert tip.real - abs(end - start) / 2 == near
            if shape.kind == BARREL:
                assert start - place[link.joint] == near and tip.imag == near
                assert abs(end - start) < tip.real == pytest.approx(lengths[link.name])
            if shape.kind == ROD:
                assert end - place[link.tip] == near
                assert ((place[link.joint] - start) / along).imag == near
    assert count >= 40 * len(shapes.shapes(one))
    if len(one.assembly().legs) == 1:
        for shape, moved in ends.items():
            assert (shape.start.link == GROUND) == (np.ptp(moved, axis=0).max() < 1e-9 * size)


@pytest.mark.parametrize('name, kinds', [
    ('excavator', [BARREL, ROD] * 3), ('boxer engine', [GUIDE, BLOCK]),
    ('guide on a coupler', [GUIDE, BLOCK]), ('rack and its image', [GUIDE, BLOCK])])
def test_a_cylinder_is_barrel_and_rod_and_a_block_has_a_guide(name, kinds):
    one = MACHINES[name]()
    found = shapes.shapes(one)
    assert [shape.kind for shape in found] == kinds
    assert shapes.drawn(one, one.linkage.points) == [shape for shape in found if shape.kind != ROD]
    for end in 'joint', 'tip':
        hidden = {getattr(shape.slide, end) for shape in found}
        assert shapes.drawn(one, set(one.linkage.points) - hidden) == []


@pytest.mark.parametrize('sweep, barrel', [
    ([0.8, 0.9], 0.4), ([0.8, 1.4], 0.6), ([0.6, 1.4], 0.54), ([0.8, 1.2], 0.4)])
def test_a_barrel_is_as_long_as_the_stroke_from_half_to_nine_tenths(sweep, barrel):
    one = alone(BOOM, scale=3.0, cylinder__sweep=[3.0 * end for end in sweep])
    outer, rod = shapes.shapes(one)
    assert (outer.start, outer.end.x, outer.end.y) == (
        LinkPoint('barrel', 0.0, 0.0), pytest.approx(barrel), 0.0)
    assert (rod.start.x, rod.start.y, rod.end) == (
        pytest.approx(barrel - sweep[1]), 0.0, LinkPoint('cylinder', 0.0, 0.0))
    assert GROUND not in (outer.start.link, rod.start.link)


@pytest.mark.parametrize('name', ['jansen', 'gripper', 'Cassie', 'flat'])
def test_plates_are_triangles_of_bars_that_are_not_flat(name):
    linkage = mechanisms.create(name) if name == 'jansen' else mechanisms.create('custom', joints={
        'gripper': ENGINE, 'Cassie': CASSIE, 'flat': FLAT}[name])
    places = linkage.solve([0.3] * len(linkage.inputs) if len(linkage.inputs) > 1 else 0.3)
    names, bars = linkage.points, {frozenset(bar) for bar in linkage.bars}

    def area(*corners):
        (a, b), (c, d) = (np.subtract(places[corner], places[corners[0]])
                          for corner in corners[1:])
        return abs(a * d - b * c)

    wanted = {frozenset(corners) for corners in combinations(names, 3)
              if bars.issuperset(map(frozenset, combinations(corners, 2)))
              and area(*corners) > 1e-6 * linkage.longest ** 2}
    found = shapes.plates(linkage, names)
    assert {*map(frozenset, found)} == wanted and len(found) == len(wanted)
    assert len(wanted) == {'jansen': 2, 'gripper': 1, 'Cassie': 1, 'flat': 0}[name]
    some = [point for point in names if point not in next(iter(wanted), 'A')]
    assert {*map(frozenset, shapes.plates(linkage, some))} == {
        plate for plate in wanted if plate <= {*some}}


def test_cranks_are_bars_that_inputs_turn_and_marks_are_below_the_ground():
    toe = mechanisms.create('custom', joints=CASSIE)
    assert shapes.cranks(toe) == [('O', 'F'), ('K', 'A')]
    assert shapes.cranks(MACHINES['rack and its image']().linkage) == []
    engine = alone(ENGINE).linkage
    height = engine.longest / 15.0
    assert shapes.marks(engine, ['G', 'A']) == [(
        'G', *(LinkPoint('ground', pytest.approx(side * 0.6 * height),
                         pytest.approx(-20.0 - height)) for side in (-1.0, 1.0)))]
    assert [mark[0] for mark in shapes.marks(engine, engine.points)] == ['O', 'G']


def test_a_guide_stays_on_the_link_that_it_is_on():
    one = MACHINES['guide on a coupler']()
    seen = [[(end - place['A']) / (place['B'] - place['A']) for end in ends]
            for place, _, drawn in poses(one) for shape, ends in drawn if shape.kind == GUIDE]
    assert len(seen) == 40 and np.ptp(seen, axis=0) == pytest.approx(0.0, abs=1e-12)
