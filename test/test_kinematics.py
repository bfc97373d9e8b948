# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The kinematics node: what arrives on its topics is the linkage."""

import math
from pathlib import Path
import re

import numpy as np
import pytest

pytest.importorskip('rclpy')

from linkage_ros import mechanisms, palette, scene  # noqa: E402
from linkage_ros.nodes.crank_driver import CrankDriver  # noqa: E402
from linkage_ros.nodes.kinematics import Kinematics  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile  # noqa: E402
from ros_harness import Graph  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from visualization_msgs.msg import Marker, MarkerArray  # noqa: E402

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
HOLY = {'a': 38.0, 'b': 41.5, 'c': 39.3, 'd': 40.1, 'e': 55.8, 'f': 39.4, 'g': 36.7, 'h': 65.7,
        'i': 49.0, 'j': 50.0, 'k': 61.9, 'l': 7.8, 'm': 15.0}
# The links of each type with their lengths, and the points in their order, from the catalogue.
LENGTHS = {
    'water_drop': {'OA': 1.0, 'AB': 1.0, 'OC': 2.0, 'CB': 2.0, 'AP': 3.0, 'BP': 4.0},
    'jansen': {**{bar: HOLY[name] for bar, name in zip(
        'BC AC BD CD BE AE EF DF EG FG OA'.split(), 'bjdeckgfihm')}, 'OB': math.hypot(38.0, 7.8)},
    'peaucellier': {'OP': 3.0, 'OA': 3.0, 'PB': 9.0, 'PD': 9.0, 'AB': 4.0, 'BC': 4.0, 'CD': 4.0,
                    'AD': 4.0},
    'slotted_lever': {'OA': 80.0, 'OQ': 150.0, 'QL': 270.0},
}
ANGLES = [0.0, 0.5, math.pi / 2, 3.0, math.pi, 4.0, -1.0, 6.2, 2.0 * math.pi, 7.0, 100.0]
WALKER = {'mechanisms': ['walker'], 'walker.type': 'jansen', 'walker.scale': 0.01,
          'walker.leg_pairs': 3}
CELL = {'mechanisms': ['cell'], 'cell.type': 'peaucellier'}
REACH = 2.0 * math.acos(5.0 / 6.0)


class Bench:
    """A kinematics node, a hand on one of its cranks, and ears on its topics."""

    def __init__(self, graph, name, parameters=None, joints=True, markers=True):
        # Of a scene that names no mechanisms too, in the catalogue's own size.
        self.node = graph.start(Kinematics, {f'{name}.scale': 1.0, **(parameters or {})})
        self._graph = graph
        self._name = name
        self.hand = graph.crank([f'{name}_crank'])
        self.joints = graph.listen(JointState, f'{name}/joint_states') if joints else []
        self.markers = graph.listen(MarkerArray, f'{name}/markers') if markers else []

    def joints_at(self, theta, *speed):
        """Return the joint states at a crank angle."""
        return self.hand([theta], self.joints, list(speed))

    def markers_at(self, theta):
        """Return all markers at a crank angle."""
        return self.hand([theta], self.markers).markers

    def links_and_joints_at(self, theta):
        """Return both markers of links and joints at a crank angle."""
        return [marker for marker in self.markers_at(theta) if marker.id < 2]

    def legs_at(self, theta):
        """Return the joints' places at a crank angle, of each leg by name."""
        points = self.node.scene.machines[self._name].points
        rows = places(self.links_and_joints_at(theta)[-1]).reshape(-1, len(points), 2)
        return [dict(zip(points, row)) for row in rows]

    def set(self, **values):
        """Set parameters; return the result."""
        return self._graph.set(self.node, **values)


def places(marker):
    assert all(point.z == 0.0 for point in marker.points)
    return np.array([[point.x, point.y] for point in marker.points])


def distance(leg, bar):
    return math.dist(leg[bar[0]], leg[bar[1]])


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('name', LENGTHS)
def test_links_keep_their_lengths_at_every_angle(graph, name):
    bench = Bench(graph, name, joints=False)
    longest = max(LENGTHS[name].values())
    for theta in ANGLES if name != 'peaucellier' else [-1.17, -0.5, 0.0, 0.5, 1.17, 6.0]:
        leg, = bench.legs_at(theta)
        for bar, length in LENGTHS[name].items():
            assert distance(leg, bar) == pytest.approx(length, abs=1e-12 * longest, rel=0.0)


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('name', LENGTHS)
def test_markers_are_one_list_of_links_and_one_of_joints(graph, name):
    links, joints = Bench(graph, name).links_and_joints_at(0.3)
    assert (links.type, joints.type) == (Marker.LINE_LIST, Marker.SPHERE_LIST)
    assert (links.id, joints.id) == (0, 1)
    for marker in links, joints:
        assert (marker.ns, marker.header.frame_id, marker.action) == (name, 'world', Marker.ADD)
        assert marker.color.a == 1.0 and marker.scale.x > 0.0
        assert marker.pose.orientation.w == 1.0
    spheres = {tuple(place) for place in places(joints)}
    ends = places(links).reshape(-1, 2, 2)
    assert {tuple(end) for pair in ends for end in pair} <= spheres
    lengths = sorted(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))
    assert all(any(length == pytest.approx(known) for known in LENGTHS[name].values())
               for length in lengths)


def test_cranks_plates_and_the_ground_are_markers_of_their_own(graph):
    bench = Bench(graph, 'walker', {**WALKER, 'walker.scale': 1.0})
    links, joints, cranks, plates, ground = bench.markers_at(0.3)
    assert [m.id for m in (links, joints, cranks, plates, ground)] == [0, 1, 5, 7, 8]
    pins = places(cranks).reshape(-1, 2, 2)
    assert not pins[:, 0].any()
    assert np.linalg.norm(pins[:, 1], axis=1) == pytest.approx([HOLY['m']] * 6)
    # What is no crank is drawn once, as a bar or as an edge of a plate of the same colour.
    ends, corners = places(links).reshape(-1, 2, 2), places(plates).reshape(-1, 3, 2)
    edges = np.concatenate([ends[:, 0] - ends[:, 1], *(corners - np.roll(corners, 1, axis=1))])
    assert np.sort(np.linalg.norm(edges, axis=1)) == pytest.approx(
        sorted(6 * [length for name, length in HOLY.items() if name not in 'alm']))
    assert plates.color == links.color != cranks.color and len(plates.colors) == 12
    assert len(ground.colors) == 4
    # Each side stands on its own ground, upright.
    standing = places(ground).reshape(-1, 3, 2)
    x, y = HOLY['a'], -HOLY['l']
    assert {tuple(top) for top in standing[:, 0]} == {(0.0, 0.0), (-x, y), (x, y)}
    assert (standing[:, 1:, 1] < standing[:, :1, 1]).all()


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('theta', [0.0, math.pi, -math.pi / 2, 2.5 * math.pi, 400.0, -7.0])
def test_the_drops_joint_b_mirrors_o_in_line_ac(graph, theta):
    drop, = Bench(graph, 'water_drop').legs_at(theta)
    along = (drop['A'] - drop['C']) / np.linalg.norm(drop['A'] - drop['C'])
    image = drop['C'] + 2.0 * along * (along @ (drop['O'] - drop['C'])) - (drop['O'] - drop['C'])
    assert drop['A'] == pytest.approx([-math.sin(theta), math.cos(theta)], abs=1e-15)
    assert drop['B'] == pytest.approx(image, abs=4e-15)


def test_a_lever_follows_a_pin_that_goes_round_its_pivot(graph):
    bench = Bench(graph, 'slotted_lever', {
        'slotted_lever.dimensions.a': 150.0, 'slotted_lever.dimensions.b': 80.0})
    before = None
    for theta in np.linspace(0.0, 4.0 * math.pi, 49):
        lever, = bench.legs_at(theta)
        along, pin = lever['L'] - lever['Q'], lever['A'] - lever['Q']
        assert abs(along[0] * pin[1] - along[1] * pin[0]) < 1e-12 * 150.0 * np.linalg.norm(along)
        assert along @ pin > 0.0
        angle = math.atan2(-along[0], along[1])
        assert bench.joints_at(theta).position[1] == pytest.approx(angle, abs=1e-14)
        if before is not None:
            assert 0.0 < (angle - before) % math.tau < 0.6
        before = angle


def test_the_cells_corner_draws_a_straight_line(graph):
    bench = Bench(graph, 'peaucellier')
    x = [bench.legs_at(theta)[0]['C'][0] for theta in np.linspace(-1.17, 1.17, 41)]
    assert max(x) - min(x) <= np.spacing(max(x))
    assert x[0] == pytest.approx(65.0 / 6.0 - 3.0, rel=1e-15)


def test_right_legs_share_their_pin_with_left_legs(graph):
    legs = Bench(graph, 'walker', WALKER).legs_at(0.7)
    assert len(legs) == 6
    for j, (left, right) in enumerate(zip(legs[0::2], legs[1::2])):
        angle = 0.7 - math.tau * j / 3.0
        pin = 0.15 * np.array([math.cos(angle), math.sin(angle)])
        assert left['A'] == pytest.approx(pin, abs=1e-15)
        assert right['A'] == pytest.approx(pin, abs=1e-15)
        assert left['B'] * [-1.0, 1.0] == pytest.approx(right['B'])
        for bar, length in LENGTHS['jansen'].items():
            assert distance(right, bar) == pytest.approx(0.01 * length, abs=1e-12 * 0.657, rel=0.0)


def walk(links, frames, angles, turn, side, ground):
    """Return where the joints of a leg are, from joint to joint along its spanning tree."""
    found = dict(ground)
    directions = {}
    for link in links:
        if link.parent == 'ground':
            zero = link.zero if side > 0.0 or link.name == 'crank' else math.pi - link.zero
        else:
            zero = directions[link.parent] + side * link.zero
        if link.kind == 'prismatic':
            directions[link.name] = zero
            slid = found[link.joint] + angles[link.name] * np.array(
                [math.cos(zero), math.sin(zero)])
            assert slid == pytest.approx(found.setdefault(link.tip, slid), abs=1e-10)
            continue
        along = zero + (angles['crank'] - turn if link.name == 'crank' else angles[link.name])
        directions[link.name] = along
        rotation = np.array([[math.cos(along), -math.sin(along)],
                             [math.sin(along), math.cos(along)]])
        for name, (x, y) in frames[link.name].items():
            found[name] = found[link.joint] + rotation @ [x, side * y]
    return found


@pytest.mark.nightly(all_but=4)
@pytest.mark.parametrize('name', [*(name for name in mechanisms.TYPES if len(
    mechanisms.create(name).inputs) == 1), 'walker'])
def test_joint_angles_along_the_tree_lead_to_the_joints(graph, name):
    bench = Bench(graph, name, WALKER if name == 'walker' else {'mechanisms': [name]})
    machine = bench.node.scene.machines[name]
    linkage = machine.linkage
    frames = {link: {joint: (machine.scale * float(x), machine.scale * float(y))
                     for joint, (x, y) in frame.items()}
              for link, frame in linkage.frames.items()}
    low, high = machine.first.sweep or (-math.pi, math.pi)
    fixed = {link.joint for link in linkage.links if link.parent == 'ground'}
    for theta in np.linspace(low, high, 5).tolist():
        state = bench.joints_at(theta)
        angles = dict(zip(state.name, state.position))
        assert len(angles) == len(state.name) == len(state.position)
        for index, leg in enumerate(bench.legs_at(theta)):
            pair, right = divmod(index, 2)
            prefix = f'{("left", "right")[right]}{pair}_' if name == 'walker' else ''
            own = {link.name: angles[f'{name}_{"" if link.name == "crank" else prefix}{link.name}']
                   for link in linkage.links}
            reached = walk(linkage.links, frames, own, math.tau * pair / 3, -1.0 if right else 1.0,
                           {joint: leg[joint] for joint in fixed})
            size = machine.scale * float(linkage.longest)
            assert set(reached) | fixed == set(leg) and len(reached) > len(fixed)
            for joint, place in reached.items():
                assert place == pytest.approx(leg[joint], abs=1e-13 * size)


def test_velocities_are_the_slopes_of_positions(graph):
    bench = Bench(graph, 'walker', WALKER)
    step = 1e-6
    before, after = (bench.joints_at(0.7 + sign * step).position for sign in (-1.0, 1.0))
    slopes = (np.array(after) - np.array(before)) / (2.0 * step)
    moving = bench.joints_at(0.7, 3.0)
    assert list(moving.velocity) == pytest.approx(list(3.0 * slopes), abs=1e-6)


def test_velocities_are_left_out_where_the_cranks_is_unknown(graph):
    bench = Bench(graph, 'jansen')
    assert not bench.joints_at(0.3).velocity
    assert not bench.joints_at(0.3, math.nan).velocity
    assert len(bench.joints_at(0.3, 1.0).velocity) == 7


def test_velocities_are_left_out_where_they_are_infinite(graph):
    bench = Bench(graph, 'own', {
        'mechanisms': ['own'], 'own.type': 'custom', 'own.joints': [
            'O ground 0 0', 'Q ground 4 0', 'A crank O 3', 'B dyad A Q 2.5 2.5 left']})
    (_, high), = bench.node.scene.machines['own'].reach
    states = [bench.joints_at(high + k * math.ulp(high), 1.0) for k in range(-2, 2)]
    assert all(np.isfinite(state.velocity).all() for state in states)
    assert any(not state.velocity for state in states)
    assert len(bench.joints_at(0.9 * high, 1.0).velocity) == 3


def test_of_a_walkers_leg_the_line_without_a_place_is_named(graph):
    heard = graph.log()
    parameters = {'leg.type': 'jansen', 'leg.mirrored': True, 'mechanisms': ['leg'],
                  'leg.dimensions.a': 10.0, 'leg.dimensions.m': 22.0}
    bench = Bench(graph, 'leg', parameters, markers=False)
    graph.until(lambda: bench.node.count_subscribers('/rosout'))
    bench.joints_at(0.1)
    message, = (m.msg for m in graph.all_logged(bench.node, heard) if 'cannot be' in m.msg)
    linkage = bench.node.scene.machines['leg'].linkage
    # The right leg is the mirror image of a left one at pi minus the angle.
    first = next(name for name, place in linkage.solve(math.pi - 0.1).items()
                 if np.isnan(place).any())
    line, = (line.text for line in linkage.design.lines if first in line.names)
    assert message == (f'leg_right0 cannot be assembled at crank angle 0.1 rad: no place for '
                       f'"{line}"')


ANKLE = Path(__file__).parents[1] / 'examples' / 'ankle.yaml'


@pytest.mark.parametrize('parameters, positions, line', [
    ({'mechanisms': ['leg'], 'leg.type': 'five_bar'}, [-2.04, 1.59], 'P dyad A C b c left'),
    ({'mechanisms': ['leg'], 'leg.type': 'five_bar', 'leg.scale': 2.0}, [-2.04, 1.59],
     'P dyad A C b c left'),
    ({'mechanisms': ['leg'], 'leg.type': 'custom', 'leg.scale': 10.0, 'leg.joints': [
        'O ground 0 0', 'P ground 1 0', 'B cylinder P O 1 left', 'Q crank B 1 zero O',
        'D cylinder O Q 1 left']}, [9.0, 0.3, 25.0], 'D cylinder O Q 1 left'),
    ({}, [0.3, 0.3], 'pitch hinge ground at 0 0 0 axis 0 1 0 within -50deg 30deg')])
def test_of_several_inputs_the_line_without_a_place_is_named(graph, parameters, positions, line):
    heard = graph.log()
    node = graph.start(Kinematics, parameters or {
        one.name: one.value for one in scene.load(str(ANKLE)).parameters if one.value != ()})
    machine, = node.scene.machines.values()
    graph.listen(JointState, f'{machine.name}/joint_states')
    graph.until(lambda: node.count_subscribers('/rosout'))
    push = graph.crank([drive.source for drive in machine.inputs.values()])
    graph.until(lambda: push.send(positions) and [
        m for m in heard if 'cannot be assembled' in m.msg])
    assert {m.msg.partition(': ')[2] for m in heard if 'cannot be assembled' in m.msg} == {
        f'no place for "{line}"'}


@pytest.mark.parametrize('type_, positions, said', [
    ('four_bar', [math.nan], ': m_crank is at nan'),
    ('custom', [math.nan], ': m_crank is at nan'),
    ('peaucellier', [math.inf], ': m_crank is at inf'),
    ('five_bar', [0.3, -math.inf], ': m_crank2 is at -inf'),
    ('peaucellier', [2.0], ' at crank angle 2 rad; the reach is [-1.17137, 1.17137] rad'),
    # In the reach as far as so large an angle can tell.
    ('peaucellier', [1e300], ' at crank angle 1e+300 rad: no place for "B C D inversor P A a b"')])
def test_a_limit_is_named_only_if_it_was_left(graph, type_, positions, said):
    heard = graph.log()
    # A crank alone, which nothing needs to be assembled with.
    joints = {'m.joints': ['O ground 0 0', 'A crank O 1']} if type_ == 'custom' else {}
    node = graph.start(Kinematics, {'mechanisms': ['m'], 'm.type': type_, **joints})
    graph.listen(JointState, 'm/joint_states')
    graph.until(lambda: node.count_subscribers('/rosout'))
    push = graph.crank([settings.source for settings in node.scene.machines['m'].inputs.values()])
    graph.until(lambda: push.send(positions) and [
        m for m in heard if 'cannot be assembled' in m.msg])
    assert {m.msg for m in heard if 'cannot be assembled' in m.msg} == {
        f'm cannot be assembled{said}'}


def test_an_angle_out_of_reach_is_passed_over_with_a_warning(graph):
    logged = graph.log()
    bench = Bench(graph, 'cell', CELL)
    graph.until(lambda: bench.node.count_subscribers('/rosout'))
    bench.joints_at(1.0)
    for unreachable in (2.0, math.nan, math.inf, REACH + 1e-9):
        bench.hand.send([unreachable])
    bench.joints_at(1.0)
    assert all(np.isfinite(m.position).all() and m.position[0] == 1.0 for m in bench.joints)
    message, = (m.msg for m in graph.all_logged(bench.node, logged)
                if 'cell' in m.name and 'cannot be assembled' in m.msg)
    assert message == ('cell cannot be assembled at crank angle 2 rad; the reach is '
                       '[-1.17137, 1.17137] rad')
    assert bench.set(cell__points=['A']).successful
    del bench.markers[:]
    bench.hand.send([2.0])
    bench.legs_at(1.0)
    assert all(math.atan2(*places(m.markers[0])[0][::-1]) == pytest.approx(1.0)
               for m in bench.markers if m.markers[0].action == Marker.ADD)


def test_a_joint_that_has_a_place_is_not_shown_where_the_linkage_cannot_be_assembled(graph):
    bench = Bench(graph, 'cell', {**CELL, 'cell.points': ['A']}, joints=False)
    assert places(bench.links_and_joints_at(1.0)[-1])[0] == pytest.approx(
        [3.0 * math.cos(1.0), 3.0 * math.sin(1.0)])
    del bench.markers[:]
    bench.hand.send([2.0])
    message, = graph.until(lambda: bench.markers)
    assert {marker.action for marker in message.markers} == {Marker.DELETE}


def test_a_leg_that_cannot_be_assembled_is_left_out_and_the_others_stay(graph):
    bench = Bench(graph, 'walker', {**WALKER, 'walker.dimensions.m': 24.0})
    state = bench.joints_at(0.2)
    there = dict.fromkeys(name.split('_')[1] for name in state.name if 'crank' not in name)
    assert list(there) == ['left1', 'right1', 'left2', 'right2']
    assert len(state.name) == 1 + 6 * 4 and np.isfinite(state.position).all()
    legs = bench.legs_at(0.2)
    assert len(legs) == 4 and np.isfinite([list(leg.values()) for leg in legs]).all()


def test_only_wanted_joints_are_drawn_in_the_order_they_are_wanted(graph):
    bench = Bench(graph, 'jansen', {'jansen.points': ['G', 'E', 'A']})
    links, joints = bench.links_and_joints_at(0.3)
    foot, knee, pin = places(joints)
    assert math.dist(foot, knee) == pytest.approx(HOLY['i'])
    assert math.dist(knee, pin) == pytest.approx(HOLY['k'])
    assert len(links.points) == 4
    assert bench.set(jansen__points=['G']).successful
    assert [marker.type for marker in bench.links_and_joints_at(0.4)] == [Marker.SPHERE_LIST]


# Type, colour, width as a part of the longest bar, and layer above the plane, by the marker's id.
LOOKS = {
    0: (Marker.LINE_LIST, 'BAR', 40, 0), 1: (Marker.SPHERE_LIST, 'JOINT', 20, 0),
    2: (Marker.LINE_STRIP, 'LOCUS', 100, -3), 3: (Marker.LINE_LIST, 'SLOT', 14, 1),
    4: (Marker.LINE_LIST, 'BAR', 22, 3), 5: (Marker.LINE_LIST, 'DRIVEN', 40, 2),
    6: (Marker.LINE_LIST, 'DRIVEN', 22, 4), 7: (Marker.TRIANGLE_LIST, 'BAR', None, -1),
    8: (Marker.TRIANGLE_LIST, 'EARTH', None, -2)}


@pytest.mark.parametrize('name, given, size, ids', [
    ('walker', WALKER, 0.01 * 65.7, {0, 1, 2, 5, 7, 8}),
    ('lever', {'mechanisms': ['lever'], 'lever.type': 'slotted_lever'}, 270.0,
     {0, 1, 2, 3, 4, 5, 8}), ('boom', None, 3.2, {0, 1, 6, 7, 8})])
def test_every_marker_looks_as_the_table_says_and_is_in_its_layer(graph, name, given, size, ids):
    pose, given = [1.0, -2.0, 3.0, 0.4, -0.3, 2.5], given or BOOM
    node = graph.start(Kinematics, {
        **given, f'{name}.pose': pose, f'{name}.frame_id': 'floor', 'frame_prefix': 'robot/'})
    drawn, locus = graph.listen(MarkerArray, f'{name}/markers'), graph.listen(
        Marker, f'{name}/locus', LATCHED)
    machine, = node.scene.machines.values()
    push = graph.crank([drive.source for drive in machine.inputs.values()])
    markers = push([0.3] if len(ids) > 5 else [2.0, 1.1], drawn).markers
    (cr, cp, cy), (sr, sp, sy) = np.cos(pose[3:]), np.sin(pose[3:])
    # The third column of the rotation about x, then y, then z.
    up = np.array([cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr])
    if 2 in ids:
        markers = [*markers, graph.until(locus.copy)[-1]]
    assert {marker.id for marker in markers} == ids and len(markers) == len(ids)
    for marker in markers:
        type_, colour, part, layer = LOOKS[marker.id]
        if (name, marker.id) == ('walker', 2):
            # Both curves of mirrored legs, as a list of lines.
            type_ = Marker.LINE_LIST
        p, q, scale, rgba = (marker.pose.position, marker.pose.orientation, marker.scale,
                             marker.color)
        whole = part in (None, 20)
        width = size / part if part else 1.0
        assert (marker.ns, marker.type, marker.action, marker.header.frame_id) == (
            name, type_, Marker.ADD, 'robot/floor')
        assert [p.x, p.y, p.z] == pytest.approx(list(pose[:3] + layer * size / 250.0 * up))
        assert [scale.x, scale.y, scale.z] == pytest.approx([width] + [width * whole] * 2)
        assert [rgba.r, rgba.g, rgba.b, rgba.a] == pytest.approx(
            [*palette.rgb(getattr(palette, colour)), 1.0], abs=1e-7)
        assert 2.0 * np.array([q.x * q.z + q.w * q.y, q.y * q.z - q.w * q.x]) == pytest.approx(
            up[:2])
        face = palette.rgb(palette.PLATE if marker.id == 7 else getattr(palette, colour))
        assert [pytest.approx([*face, 1.0], abs=1e-7)] * len(marker.colors) == [
            [one.r, one.g, one.b, one.a] for one in marker.colors]
        assert len(marker.colors) == (len(marker.points) // 3 if marker.id > 6 else 0)


def test_roll_pitch_and_yaw_turn_about_fixed_axes():
    from linkage_ros.nodes.messages import quaternion

    def about(axis, angle):
        turn = np.eye(3)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn[[i, j], [i, j]] = math.cos(angle)
        turn[i, j], turn[j, i] = -math.sin(angle), math.sin(angle)
        return turn

    q = quaternion(0.3, -1.2, 2.5)
    w, v = q.w, np.array([q.x, q.y, q.z])
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    matrix = np.eye(3) + 2 * w * cross + 2 * cross @ cross
    assert matrix == pytest.approx(about(2, 2.5) @ about(1, -1.2) @ about(0, 0.3))


def test_stamps_are_those_of_the_crank(graph):
    bench = Bench(graph, 'jansen')
    stamp = bench.joints_at(0.3).header.stamp.sec
    links, joints = bench.links_and_joints_at(0.3)
    assert links.header.stamp == joints.header.stamp
    assert joints.header.stamp.sec > stamp > 0


def test_cranks_are_found_by_name_whoever_else_is_in_the_message(graph):
    graph.start(Kinematics)
    heard = graph.listen(JointState, 'jansen/joint_states')
    turn = graph.crank(['wheel', 'jansen_crank', 'slotted_lever_crank'])
    state = turn([9.0, 0.3, 0.1], heard, [9.0, 2.0, 1.0])
    assert (state.name[0], state.position[0], state.velocity[0]) == ('jansen_crank', 0.3, 2.0)


def test_a_message_without_positions_is_passed_over(graph):
    bench = Bench(graph, 'jansen')
    bench.joints_at(0.3)
    bench.hand.send([], [1.0])
    bench.joints_at(0.4)
    assert {m.position[0] for m in bench.joints} == {0.3, 0.4}


def test_a_late_subscriber_gets_the_curve(graph):
    node = graph.start(Kinematics, {f'{name}.scale': 1.0 for name in LENGTHS})
    curves = {}
    for name in LENGTHS:
        heard = graph.listen(Marker, f'{name}/locus', LATCHED)
        curves[name], = graph.until(heard.copy)
        assert curves[name].type == Marker.LINE_STRIP and curves[name].ns == name
        assert len(curves[name].points) > 100 and curves[name].scale.x > 0.0
    drop = places(curves['water_drop'])
    assert drop[0] == pytest.approx(drop[-1], abs=1e-14)
    x, y = drop.T
    area = abs(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])) / 2.0
    assert area == pytest.approx(8.0 * math.pi, rel=1e-3)
    cell = places(curves['peaucellier'])
    assert np.ptp(cell[:, 0]) <= np.spacing(8.0)
    assert cell[-1, 1] == pytest.approx(65.0 / 6.0 * math.tan(0.5 * REACH))
    assert node.count_publishers('/jansen/locus') == 1


def test_the_curve_is_sent_once_for_each_change_of_dimensions(graph):
    node = graph.start(Kinematics)
    loci = {name: graph.listen(Marker, f'{name}/locus', LATCHED) for name in LENGTHS}
    graph.until(lambda: all(loci.values()))
    turn = graph.crank(['water_drop_crank'])
    heard = graph.listen(MarkerArray, 'water_drop/markers')
    for theta in (0.0, 1.0, 2.0):
        turn([theta], heard)
    assert graph.set(node, water_drop__dimensions__a=2.0).successful
    graph.until(lambda: len(loci['water_drop']) == 2)
    turn([3.0], heard)
    assert {name: len(curves) for name, curves in loci.items()} == {
        'water_drop': 2, 'jansen': 1, 'peaucellier': 1, 'slotted_lever': 1}
    assert places(loci['water_drop'][1]) == pytest.approx(2.0 * places(loci['water_drop'][0]))


def test_a_dimension_changes_while_the_node_runs(graph):
    bench = Bench(graph, 'jansen')
    assert distance(bench.legs_at(0.3)[0], 'OA') == pytest.approx(15.0)
    assert bench.set(jansen__dimensions__m=14.0).successful
    assert distance(bench.legs_at(0.3)[0], 'OA') == pytest.approx(14.0)
    assert bench.set(jansen__scale=0.5, jansen__branches__F=-1).successful
    leg, = bench.legs_at(0.3)
    assert distance(leg, 'OA') == pytest.approx(7.0)
    assert distance(leg, 'DF') == pytest.approx(0.5 * HOLY['f'])


def test_only_the_mechanism_that_is_changed_is_made_anew(graph):
    node = graph.start(Kinematics)
    before = dict(node.scene.machines)
    assert graph.set(node, jansen__dimensions__m=14.0).successful
    assert {name for name, machine in node.scene.machines.items()
            if machine != before[name]} == {'jansen'}


@pytest.fixture(scope='module')
def bench():
    """Return a bench that no test changes."""
    with Graph() as graph:
        yield Bench(graph, 'jansen')


@pytest.mark.parametrize('values, reason', [
    ({'jansen.dimensions.m': -1.0}, 'jansen.dimensions.m must be .* above 0'),
    ({'jansen.dimensions.m': True}, 'jansen.dimensions.m must be'),
    ({'jansen.dimensions.m': 'long'}, "jansen.dimensions.m must be .* not 'long'"),
    ({'jansen.dimensions.b': 4.2}, 'jansen.dimensions must let the jansen be assembled'),
    ({'jansen.dimensions.m': 14.0, 'jansen.dimensions.b': 4.2}, 'jansen.dimensions must let'),
    ({'jansen.points': ['Z']}, 'jansen.points must be .* some of O, B'),
    ({'jansen.pose': [1.0]}, 'jansen.pose must be .* six'),
    ({'jansen.branches.C': 2}, 'jansen.branches.C must be .* from -1 to 1'),
    ({'jansen.leg_pairs': 0}, 'jansen.leg_pairs must be .* from 1 to 50'),
    ({'jansen.scale': 0.0}, 'jansen.scale must be .* above 0'),
    ({'water_drop.leg_pairs': 2}, 'read-only.* water_drop.leg_pairs'),
    ({'jansen.type': 'water_drop'}, 'read-only.* jansen.type'),
])
def test_a_bad_value_is_refused_with_a_reason_and_the_node_runs_on(bench, values, reason):
    before = bench.legs_at(0.3)[0]
    refused = bench.set(**values)
    assert not refused.successful
    assert re.search(reason, refused.reason)
    after = bench.legs_at(0.3)[0]
    assert all((before[name] == after[name]).all() for name in before)


def test_legs_are_added_while_the_node_runs(graph):
    bench = Bench(graph, 'jansen')
    assert len(bench.joints_at(0.3).name) == 7
    assert bench.set(jansen__leg_pairs=2).successful
    assert len(bench.legs_at(0.3)) == 2
    # What nobody sets keeps its value, though another would be the default of two pairs.
    assert bench.node.get_parameter('jansen.mirrored').value is False
    assert bench.set(jansen__mirrored=True).successful
    assert len(bench.legs_at(0.3)) == 4
    assert len(bench.joints_at(0.3).name) == 1 + 4 * 6


def test_a_linkage_with_two_cranks_follows_both(graph):
    graph.start(CrankDriver, {'mechanisms': ['five_bar'], 'five_bar.crank.speed': 0.4,
                              'five_bar.crank2.speed': -0.3, 'five_bar.crank2.start': 1.0})
    graph.start(Kinematics, {'mechanisms': ['five_bar']})
    states = graph.listen(JointState, 'five_bar/joint_states')
    drawn = graph.listen(MarkerArray, 'five_bar/markers')
    pairs = graph.until(lambda: [(s, m) for s in states for m in drawn
                                 if s.header.stamp == m.markers[0].header.stamp][:20])
    linkage = mechanisms.create('five_bar')
    for state, message in pairs:
        angles = dict(zip(state.name, state.position))
        speeds = dict(zip(state.name, state.velocity))
        thetas = angles['five_bar_crank'], angles['five_bar_crank2']
        turning = speeds['five_bar_crank'], speeds['five_bar_crank2']
        assert turning == (0.4, -0.3)
        placed = linkage.solve(thetas)
        assert places(message.markers[1]) == pytest.approx(np.array([*placed.values()]))
        step = 1e-6
        before, after = (linkage.joint_angles([t + sign * step * w for t, w in zip(
            thetas, turning)]) for sign in (-1.0, 1.0))
        for joint in linkage.joints:
            assert speeds[f'five_bar_{joint}'] == pytest.approx(
                (after[joint] - before[joint]) / (2.0 * step), abs=1e-7)


def test_driver_and_kinematics_go_together_in_a_namespace(graph):
    for node_class in (CrankDriver, Kinematics):
        graph.start(node_class, WALKER, namespace='/left/side')
    heard = graph.listen(MarkerArray, '/left/side/walker/markers')
    graph.until(lambda: len(heard) > 5)
    assert len(heard[-1].markers[1].points) == 6 * 8


def test_a_linkage_of_ones_own_is_shown_like_any_other(graph):
    bench = Bench(graph, 'rocker', {
        'mechanisms': ['rocker'], 'rocker.type': 'custom', 'rocker.dimensions.g': 0.8,
        'rocker.joints': ['O ground 0 0', 'Q ground g 0', 'A crank O 0.3',
                          'B dyad A Q 0.7 0.6 left']})
    leg, = bench.legs_at(0.3)
    assert distance(leg, 'AB') == pytest.approx(0.7) and distance(leg, 'QB') == pytest.approx(0.6)
    assert bench.set(rocker__dimensions__g=0.9).successful
    assert distance(bench.legs_at(0.3)[0], 'OQ') == pytest.approx(0.9)


def test_what_comes_while_the_node_is_kept_waiting_is_not_lost(graph):
    # 100 ms of a source at 1000 Hz, and not much more: old angles are of no use to anybody.
    graph.start(Kinematics, {'mechanisms': ['water_drop']})
    answers = graph.listen(JointState, 'water_drop/joint_states', 200)
    crank = graph.crank(['water_drop_crank'])
    crank([0.0], answers)
    source = graph.node.create_publisher(JointState, 'crank_states', 200)
    graph.until(lambda: source.get_subscription_count() == 1)
    for number in range(1, 151):
        message = JointState(name=['water_drop_crank'], position=[0.01 * number])
        message.header.stamp.sec = 1000 + number
        source.publish(message)
    graph.until(lambda: answers and answers[-1].header.stamp.sec == 1150)
    stamps = [message.header.stamp.sec for message in answers if message.header.stamp.sec > 1000]
    assert stamps == list(range(1051, 1151))


BOOM = {'mechanisms': ['boom'], 'boom.type': 'custom', 'boom.scale': 2.0, 'boom.joints': [
    'O ground 0 0', 'P ground 0.5 -0.2', 'B cylinder P O 1.1 right', 'C line O B 1.6',
    'D rigid O B 0.6 0.7 left', 'E cylinder D B 0.4 left']}


def test_a_linkage_with_two_cylinders_follows_both_lengths(graph):
    graph.start(CrankDriver, {**BOOM, 'boom.cylinder.speed': 0.3, 'boom.cylinder2.speed': -0.1,
                              'boom.cylinder2.start': 1.1})
    graph.start(Kinematics, BOOM)
    states = graph.listen(JointState, 'boom/joint_states')
    drawn = graph.listen(MarkerArray, 'boom/markers')
    pairs = graph.until(lambda: [(s, m) for s in states for m in drawn
                                 if s.header.stamp == m.markers[0].header.stamp][:20])
    for state, message in pairs:
        lengths = dict(zip(state.name, state.position))
        speeds = dict(zip(state.name, state.velocity))
        place = dict(zip('OPBCDE', places(message.markers[1])))
        for name, ends in (('cylinder', 'PB'), ('cylinder2', 'DE')):
            assert math.dist(*map(place.get, ends)) == pytest.approx(lengths[f'boom_{name}'])
        assert (speeds['boom_cylinder'], abs(speeds['boom_cylinder2'])) == (0.3, 0.1)
        assert math.dist(place['O'], place['B']) == pytest.approx(2.2)
        # The law of cosines in the triangle of base, boom and cylinder, differentiated.
        area = abs(place['P'][0] * place['B'][1] - place['P'][1] * place['B'][0])
        assert abs(speeds['boom_OB']) == pytest.approx(0.3 * lengths['boom_cylinder'] / area)
        lines = places(message.markers[0]).reshape(-1, 2, 2)
        assert any((line == [place['P'], place['B']]).all() for line in lines)
        assert [marker.id for marker in message.markers] == [0, 1, 6, 7, 8]
        for barrel, (base, rod) in zip(places(message.markers[2]).reshape(-1, 2, 2), ('PB', 'DE')):
            length, cylinder = math.dist(*barrel), math.dist(place[base], place[rod])
            assert barrel[0] == pytest.approx(place[base]) and 0.0 < length < cylinder
            along = (place[rod] - place[base]) / cylinder
            assert barrel[1] == pytest.approx(place[base] + length * along)


def test_a_pin_in_a_slot_is_a_block_on_a_guide_that_turns_with_the_lever(graph):
    bench = Bench(graph, 'slotted_lever')
    for theta in (0.3, -2.0):
        _, joints, guides, blocks, *_ = bench.markers_at(theta)
        assert (guides.id, blocks.id) == (3, 4) and guides.scale.x > blocks.scale.x
        place = dict(zip('OQAL', places(joints)))
        along = (place['L'] - place['Q']) / math.dist(place['L'], place['Q'])
        (start, end), (back, front) = places(guides), places(blocks)
        assert (end - start) / math.dist(start, end) == pytest.approx(along)
        assert (front - back) / math.dist(back, front) == pytest.approx(along)
        assert 0.5 * (back + front) == pytest.approx(place['A'])
        assert 0.0 < (place['A'] - start) @ along < math.dist(start, end)


def test_a_length_that_cannot_be_is_said_in_metres(graph):
    heard = graph.log()
    node = graph.start(Kinematics, {
        'mechanisms': ['lift'], 'lift.type': 'custom', 'lift.scale': 2.0,
        'lift.joints': BOOM['boom.joints'][:4]})
    drawn = graph.listen(MarkerArray, 'lift/markers')
    push = graph.crank(['lift_cylinder'])
    graph.until(lambda: node.count_subscribers('/rosout'))
    push([2.0], drawn)
    push.send([9.0])
    graph.until(lambda: [m for m in heard if 'lift cannot be assembled at cylinder length 9 m; '
                         'the reach is [1.12297, 3.27703] m' in m.msg])


def test_an_encoder_on_the_rocker_drives_as_the_crank_does(graph):
    graph.start(Kinematics, {'mechanisms': ['bars'], 'bars.type': 'four_bar',
                             'bars.crank.measures': 'QB', 'bars.crank.start': 0.7})
    linkage, states = mechanisms.create('four_bar'), graph.listen(JointState, 'bars/joint_states')
    measure = graph.crank(['bars_QB'])
    for theta in (0.7, 1.0, 1.8, 2.4):
        rocker = float(linkage.joint_angles(theta)['QB'])
        state = measure([rocker], states, [0.5])
        found = dict(zip(state.name, state.position))
        assert found['bars_crank'] == pytest.approx(theta)
        assert found['bars_QB'] == pytest.approx(rocker)
        assert dict(zip(state.name, state.velocity))['bars_QB'] == pytest.approx(0.5)


def test_a_draw_wire_that_says_what_cannot_be_moves_nothing_and_is_said(graph):
    heard = graph.log()
    node = graph.start(Kinematics, {
        'mechanisms': ['wired'], 'wired.type': 'four_bar',
        'wired.crank.measures': 'distance(O,B)', 'wired.crank.start': 0.7})
    linkage, states = mechanisms.create('four_bar'), graph.listen(JointState, 'wired/joint_states')
    graph.until(lambda: node.count_subscribers('/rosout'))
    measure = graph.crank(['wired_distance(O,B)'])
    length = float(linkage.joint_angles(0.9, ['distance(O,B)'])['distance(O,B)'])
    assert measure([length], states).position[0] == pytest.approx(0.9)
    bad = {measure.send([value]) for value in (1e3, math.nan, math.inf)}
    assert measure([length], states).position[0] == pytest.approx(0.9)
    said, = (m.msg for m in graph.all_logged(node, heard) if 'wired cannot be' in m.msg)
    assert 'wired_distance(O,B) is at 1000, out of reach of distance(O,B)' in said
    assert not bad & {state.header.stamp.sec for state in states}


MOTORS = {'mechanisms': ['left', 'right'], 'left.type': 'four_bar', 'right.type': 'four_bar',
          'left.crank.source': 'hip_motor', 'left.crank.ratio': 0.5, 'left.crank.offset': 0.2,
          'right.crank.source': 'hip_motor', 'right.crank.ratio': -2.0}


def test_a_motor_of_any_name_drives_by_ratio_and_offset(graph):
    node = graph.start(Kinematics, MOTORS)
    left, right = (graph.listen(JointState, f'{name}/joint_states') for name in ('left', 'right'))
    turn = graph.crank(['hip_motor', 'left_crank'])
    state = turn([0.6, 9.0], left, [1.0, 0.0])
    assert state.position[0] == pytest.approx(0.5) and state.velocity[0] == pytest.approx(0.5)
    other = graph.until(lambda: [m for m in right if m.header.stamp == state.header.stamp])[0]
    assert other.position[0] == pytest.approx(-1.2) and other.velocity[0] == pytest.approx(-2.0)
    assert graph.set(node, left__crank__offset=0.0).successful
    assert turn([0.6, 9.0], left, [1.0, 0.0]).position[0] == pytest.approx(0.3)
    refused = graph.set(node, left__crank__ratio=0.0)
    assert not refused.successful and 'left.crank.ratio must be' in refused.reason


@pytest.mark.parametrize('told', [
    {'bars.crank.source': 'motor', 'bars.crank.ratio': -0.25, 'bars.crank.offset': 1.0},
    {'bars.crank.measures': 'QB', 'bars.crank.ratio': 2.0, 'bars.crank.sweep': [0.5, 1.4]}])
def test_the_driver_tells_what_the_motor_would(graph, told):
    scene = {'mechanisms': ['bars'], 'bars.type': 'four_bar', **told}
    graph.start(Kinematics, scene)
    driver = graph.start(CrankDriver, scene)
    states, sent = (graph.listen(JointState, topic)
                    for topic in ('bars/joint_states', 'crank_states'))
    graph.until(lambda: len(states) > 5 and len(sent) > 5)
    assert set(sent[-1].name) == {told.get('bars.crank.source', 'bars_QB')}
    crank = driver.scene.machines['bars'].first
    low, high = crank.sweep or (-math.inf, math.inf)
    assert all(low <= state.position[0] <= high for state in states)
    assert all(abs(state.velocity[0]) == pytest.approx(1.0) for state in states)


KNEE = {'mechanisms': ['left', 'right'], 'left.type': 'four_bar', 'right.type': 'slotted_lever',
        'left.crank.source': 'left_knee_motor', 'right.crank.source': 'right_hip_motor',
        'left.joint_names': ['AB=left_shin', 'QB=-left_ankle+0.35'], 'left.only_named': True,
        'right.joint_names': ['crank=right_hip_motor', 'slide=-right_slide']}
SHARED = ['--ros-args', '-r', 'crank_states:=joint_states']


def by_name(numbers, state):
    return dict(zip(state.name, numbers, strict=True))


def test_joints_are_published_under_the_robots_own_names_signs_and_zeros(graph):
    graph.start(Kinematics, {**KNEE, 'left.only_named': False})
    states = graph.listen(JointState, 'left/joint_states')
    graph.listen(MarkerArray, 'left/markers')
    linkage, turn = mechanisms.create('four_bar'), graph.crank(['left_knee_motor'])
    for theta in (0.4, 0.9):
        state = turn([theta], states, [2.0])
        angles, rates = linkage.joint_angles(theta), linkage.joint_rates(theta)
        assert by_name(state.position, state) == pytest.approx({
            'left_crank': theta, 'left_shin': angles['AB'], 'left_ankle': 0.35 - angles['QB']})
        assert by_name(state.velocity, state) == pytest.approx({
            'left_crank': 2.0, 'left_shin': 2.0 * rates['AB'], 'left_ankle': -2.0 * rates['QB']})


def test_a_joint_with_a_zero_of_its_own_is_within_half_a_turn_of_it(graph):
    graph.start(Kinematics, {**KNEE, 'left.joint_names': ['QB=-left_ankle+7', 'crank=motor+9']})
    states, turn = graph.listen(JointState, 'left/joint_states'), graph.crank(['left_knee_motor'])
    linkage = mechanisms.create('four_bar')
    for theta in (0.4, 3.0, 5.0):
        at = by_name((state := turn([theta], states)).position, state)
        angle = float(linkage.joint_angles(theta)['QB'])
        assert at == {'left_ankle': pytest.approx(math.remainder(7.0 - angle, math.tau)),
                      'motor': theta + 9.0}


def test_what_the_inputs_hold_against_loads_is_their_effort(graph):
    node = graph.start(Kinematics, {
        **KNEE, 'left.scale': 2.0, 'left.joint_names': ['crank=-motor'], 'left.only_named': False,
        'left.loads': ['B=3 -9.81', 'QB=0.5']})
    one, all_ = (graph.listen(JointState, topic)
                 for topic in ('left/joint_states', 'joint_states'))
    graph.listen(MarkerArray, 'left/markers')
    linkage = mechanisms.create('four_bar')
    turn = graph.crank(['left_knee_motor', 'right_hip_motor'])
    for theta in (0.4, 1.7):
        velocity = 2.0 * linkage.velocity(theta)['B'] @ [3.0, -9.81]
        torque = -(velocity + 0.5 * float(linkage.joint_rates(theta)['QB']))
        for states in (one, all_):
            state = turn([theta, 0.3], states)
            efforts = by_name(state.effort, state)
            assert efforts.pop('motor') == pytest.approx(-torque)
            assert set(efforts.values()) == {0.0}
    assert graph.set(node, left__loads=[]).successful
    assert not turn([0.5, 0.3], one).effort
    for wrong, reason in (
            ('Z=1 2', 'must be texts such as'), ('B=nan 0', 'must be texts such as'),
            ('B=3', 'components x, y'), ('B=1 2 3', 'components x, y'), ('QB=1 2', 'one number')):
        result = graph.set(node, left__loads=[wrong])
        assert not result.successful and reason in result.reason


def test_a_sign_and_a_zero_hold_where_some_legs_are_left_out(graph):
    bench = Bench(graph, 'walker', {**WALKER, 'walker.dimensions.m': 24.0})
    plain = bench.joints_at(0.2)
    assert bench.set(walker__joint_names=['right1_EF=-ankle+0.5', 'left0_EF=gone'],
                     walker__only_named=True).successful
    named = bench.joints_at(0.2)
    assert named.name == ['ankle']
    assert named.position[0] == 0.5 - by_name(plain.position, plain)['walker_right1_EF']
    assert bench.set(walker__joint_names=['crank=-shaft+1'], walker__only_named=True).successful
    assert by_name((state := bench.joints_at(0.2)).position, state) == {'shaft': 0.8}


def test_a_gear_alone_has_its_ratio_sign_zero_and_speed(graph):
    graph.start(Kinematics, {
        'mechanisms': ['hip'], 'hip.type': 'custom', 'hip.joints': ['O ground 0 0', 'K crank O 1'],
        'hip.crank.ratio': 0.125, 'hip.joint_names': ['crank=-thigh+0.5'], 'hip.only_named': True})
    graph.listen(MarkerArray, 'hip/markers')
    for topic in ('hip/joint_states', 'joint_states'):
        states = graph.listen(JointState, topic)
        state = graph.crank(['hip_crank'])([8.0], states, [16.0])
        assert (state.name, list(state.position), list(state.velocity)) == (
            ['thigh'], [-0.5], [-2.0])


def test_motors_and_passive_joints_share_a_topic_and_nobody_hears_himself(graph):
    heard = graph.log()
    graph.start(Kinematics, KNEE, cli_args=SHARED)
    said, answers = [], []

    def sort(message):
        (answers if 'right_slide' in message.name else said).append(message)

    graph.node.create_subscription(JointState, 'joint_states', sort, 100)
    graph.crank(['right_hip_motor'], 'joint_states')([0.2], answers)
    state = graph.crank(['left_knee_motor', 'wheel'], 'joint_states')([0.9, 7.0], answers)
    bars, lever = (mechanisms.create(name) for name in ('four_bar', 'slotted_lever'))
    own, slid = bars.joint_angles(0.9), lever.joint_angles(0.2)
    assert by_name(state.position, state) == pytest.approx({
        'left_shin': own['AB'], 'left_ankle': 0.35 - own['QB'],
        'right_lever': slid['lever'], 'right_slide': -slid['slide']})
    graph.until(lambda: [m for m in heard if 'no input is called wheel;' in m.msg])
    graph.crank(['left_knee_motor'], 'joint_states')([1.0], answers)
    assert len(answers) <= len(said)
    assert len([m for m in heard if 'no input is called' in m.msg]) == 1


def test_all_joints_of_the_scene_come_in_one_message(graph):
    node = graph.start(Kinematics)
    states = graph.listen(JointState, 'joint_states')
    own = {name: graph.listen(JointState, f'{name}/joint_states') for name in LENGTHS}
    turn = graph.crank([f'{name}_crank' for name in LENGTHS])
    for heard in own.values():
        turn([0.2] * 4, heard)
    for theta, speeds in ((0.3, [1.0, 2.0, 3.0, 4.0]), (0.4, []), (0.5, [1.0] * 4)):
        state = turn([theta] * 4, states, speeds)
        parts = [graph.until(lambda name=name, at=state.header.stamp: [
            m for m in own[name] if m.header.stamp == at])[0] for name in LENGTHS]
        assert state.name == [name for part in parts for name in part.name]
        assert list(state.position) == [x for part in parts for x in part.position]
        assert list(state.velocity) == [x for part in parts for x in part.velocity]
    # Out of reach the cell is left out, and comes again.
    gone = turn([0.6, 0.6, 2.0, 0.6], states)
    assert not [name for name in gone.name if 'peaucellier' in name] and len(gone.name) > 10
    assert turn([0.7] * 4, states).name == state.name
    states.clear()
    assert graph.set(node, jansen__joint_names=['EF=toe+1']).successful
    changed = graph.until(lambda: [one for one in states if 'toe' in one.name])[0]
    assert changed.header.stamp.sec > state.header.stamp.sec


def test_what_was_heard_before_anybody_listened_is_in_the_scenes_message(graph):
    graph.start(Kinematics, {'mechanisms': ['water_drop', 'jansen']})
    turn = graph.crank(['water_drop_crank'])
    turn([0.3], graph.listen(MarkerArray, 'water_drop/markers'))
    states = graph.listen(JointState, 'joint_states')
    state = graph.crank(['jansen_crank'])([0.5], states)
    crank = by_name(state.position, state)
    assert (crank['water_drop_crank'], crank['jansen_crank']) == (0.3, 0.5)


def test_each_mechanism_has_a_frame_and_all_a_prefix(graph):
    node = graph.start(Kinematics, {
        'mechanisms': ['jansen', 'klann'], 'frame_prefix': 'left/', 'frame_id': 'base',
        'klann.frame_id': 'thigh'})
    turn = graph.crank(['jansen_crank', 'klann_crank'])
    for name, frame in (('jansen', 'left/base'), ('klann', 'left/thigh')):
        locus = graph.until(graph.listen(Marker, f'{name}/locus', LATCHED).copy)[0]
        shown = turn([0.3, 0.3], graph.listen(MarkerArray, f'{name}/markers')).markers
        assert {marker.header.frame_id for marker in (locus, *shown)} == {frame}
    again = graph.listen(MarkerArray, 'klann/markers')
    assert graph.set(node, klann__frame_id='').successful
    assert turn([0.4, 0.4], again).markers[0].header.frame_id == 'left/base'
