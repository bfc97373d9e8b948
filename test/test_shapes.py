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


MECHANISMS = {
    'excavator': lambda: scene.load('config/excavator.yaml').mechanisms['excavator'],
    'boxer engine': lambda: alone(ENGINE, leg_pairs=2, scale=0.01),
    'guide on a coupler': lambda: alone(MOVING, crank__sweep=[0.8, 1.6], scale=3.0),
    'rack and its image': lambda: alone(RACK),
    'slotted_lever': lambda: alone('slotted_lever', dimensions__e=20.0, scale=1e-3),
    'slider_crank': lambda: alone('slider_crank')}


def poses(mechanism, count=40):
    """Yield joints by name, lengths of slides, and the ends of each shape, as complex numbers."""
    shapes_ = shapes.shapes(mechanism)
    ends = [end for shape in shapes_ for end in (shape.start, shape.end)]
    slides = tuple(link.name for link in mechanism.linkage.links if link.kind == 'prismatic')
    inputs = [name for name in slides if name in mechanism.inputs]
    solution = mechanism.assembly().solution(
        (*mechanism.linkage.points, *ends), [name for name in slides if name not in inputs])
    random, points = np.random.default_rng(0), mechanism.linkage.points
    for _ in range(count):
        values = [random.uniform(*(settings.ends or settings.reach[0]))
                  for settings in mechanism.inputs.values()]
        solution.solve(values)
        for row in solution.rows[np.isfinite(solution.rows).all(axis=1)]:
            places = row[:2 * (len(points) + len(ends))].reshape(-1, 2) @ (1, 1j)
            yield (dict(zip(points, places)), dict(zip(mechanism.inputs, values)),
                   list(zip(shapes_, places[len(points):].reshape(-1, 2))))


@pytest.mark.parametrize('name', MECHANISMS)
def test_what_slides_is_where_its_joints_say(name):
    mechanism, count, ends = MECHANISMS[name](), 0, {}
    size = mechanism.scale * mechanism.linkage.longest
    zero = pytest.approx(0.0, abs=1e-13 * max(size, 1.0))
    for place, lengths, drawn in poses(mechanism):
        for shape, (start, end) in drawn:
            link, count = shape.slide, count + 1
            along = (end - start) / abs(end - start)
            ends.setdefault(shape, []).append((start, end))
            tip = (place[link.tip] - start) / along
            if shape.kind in (GUIDE, BLOCK):
                assert tip.imag == zero and 0.0 < tip.real < abs(end - start)
            if shape.kind == GUIDE and 'slide' not in link.name:
                assert ((place[link.joint] - start) / along).imag == zero
            if shape.kind == BLOCK:
                assert tip.real - abs(end - start) / 2 == zero
            if shape.kind == BARREL:
                assert start - place[link.joint] == zero and tip.imag == zero
                assert abs(end - start) < tip.real == pytest.approx(lengths[link.name])
            if shape.kind == ROD:
                assert end - place[link.tip] == zero
                assert ((place[link.joint] - start) / along).imag == zero
    assert count >= 40 * len(shapes.shapes(mechanism))
    if len(mechanism.assembly().legs) == 1:
        for shape, moved in ends.items():
            assert (shape.start.link == GROUND) == (np.ptp(moved, axis=0).max() < 1e-9 * size)


@pytest.mark.parametrize('name, kinds', [
    ('excavator', [BARREL, ROD] * 3), ('boxer engine', [GUIDE, BLOCK]),
    ('guide on a coupler', [GUIDE, BLOCK]), ('rack and its image', [GUIDE, BLOCK])])
def test_a_cylinder_is_barrel_and_rod_and_a_block_has_a_guide(name, kinds):
    mechanism = MECHANISMS[name]()
    shapes_ = shapes.shapes(mechanism)
    assert [shape.kind for shape in shapes_] == kinds
    points = mechanism.linkage.points
    assert shapes.drawn(mechanism, points) == [shape for shape in shapes_ if shape.kind != ROD]
    for end in 'joint', 'tip':
        hidden = {getattr(shape.slide, end) for shape in shapes_}
        assert shapes.drawn(mechanism, {*points} - hidden) == []


@pytest.mark.parametrize('sweep, barrel', [
    ([0.8, 0.9], 0.4), ([0.8, 1.4], 0.6), ([0.6, 1.4], 0.54), ([0.8, 1.2], 0.4)])
def test_a_barrel_is_as_long_as_the_stroke_from_half_to_nine_tenths(sweep, barrel):
    mechanism = alone(BOOM, scale=3.0, cylinder__sweep=[3.0 * end for end in sweep])
    outer, rod = shapes.shapes(mechanism)
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

    expected = {frozenset(corners) for corners in combinations(names, 3)
                if bars.issuperset(map(frozenset, combinations(corners, 2)))
                and area(*corners) > 1e-6 * linkage.longest ** 2}
    plates = shapes.plates(linkage, names)
    small = linkage.with_dimensions(**{key: 1e-12 * x for key, x in linkage.dimensions.items()})
    assert shapes.plates(small, names) == plates
    assert {*map(frozenset, plates)} == expected and len(plates) == len(expected)
    assert len(expected) == {'jansen': 2, 'gripper': 1, 'Cassie': 1, 'flat': 0}[name]
    some = [point for point in names if point not in next(iter(expected), 'A')]
    assert {*map(frozenset, shapes.plates(linkage, some))} == {
        plate for plate in expected if plate <= {*some}}


def test_cranks_are_bars_that_inputs_turn_and_marks_are_below_the_ground():
    toe = mechanisms.create('custom', joints=CASSIE)
    assert shapes.cranks(toe) == [('O', 'F'), ('K', 'A')]
    assert shapes.cranks(MECHANISMS['rack and its image']().linkage) == []
    engine = alone(ENGINE).linkage
    height = engine.longest / 15.0
    assert shapes.marks(engine, ['G', 'A']) == [(
        'G', *(LinkPoint('ground', pytest.approx(side * 0.6 * height),
                         pytest.approx(-20.0 - height)) for side in (-1.0, 1.0)))]
    assert [mark[0] for mark in shapes.marks(engine, engine.points)] == ['O', 'G']


def test_a_guide_stays_on_the_link_that_it_is_on():
    mechanism = MECHANISMS['guide on a coupler']()
    guides = [[(end - place['A']) / (place['B'] - place['A']) for end in ends]
              for place, _, drawn in poses(mechanism) for shape, ends in drawn
              if shape.kind == GUIDE]
    assert len(guides) == 40 and np.ptp(guides, axis=0) == pytest.approx(0.0, abs=1e-12)
