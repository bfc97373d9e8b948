# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The kinematics node: what arrives on its topics is the linkage."""

from functools import partial
import math
from pathlib import Path
import re

import numpy as np
import pytest

pytest.importorskip('rclpy')

from linkage_ros import mechanisms, palette, scene  # noqa: E402
from linkage_ros.nodes.crank_driver import CrankDriver  # noqa: E402
from linkage_ros.nodes.kinematics import Kinematics  # noqa: E402
from linkage_ros.nodes.publishers import TrackedPublisher  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from visualization_msgs.msg import Marker, MarkerArray  # noqa: E402

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
HOLY = {'a': 38.0, 'b': 41.5, 'c': 39.3, 'd': 40.1, 'e': 55.8, 'f': 39.4, 'g': 36.7, 'h': 65.7,
        'i': 49.0, 'j': 50.0, 'k': 61.9, 'l': 7.8, 'm': 15.0}
LENGTHS = {**{bar: HOLY[name] for bar, name in zip(
    'BC AC BD CD BE AE EF DF EG FG OA'.split(), 'bjdeckgfihm')}, 'OB': math.hypot(38.0, 7.8)}
WALKER = {'mechanisms': ['walker'], 'walker.type': 'jansen', 'walker.scale': 0.01,
          'walker.leg_pairs': 3}


class Bench:
    """A kinematics node, a hand on one of its cranks, and an ear on its markers."""

    def __init__(self, graph, name, parameters=None):
        # Of a scene that names no mechanisms too, in the catalogue's own size.
        self.node = graph.start(Kinematics, {f'{name}.scale': 1.0, **(parameters or {})})
        self._name, self._hand = name, graph.crank([f'{name}_crank'])
        self._markers = graph.listen(MarkerArray, f'{name}/markers')

    def markers_at(self, theta):
        """Return all markers at a crank angle."""
        return self._hand([theta], self._markers).markers

    def legs_at(self, theta):
        """Return the joints' places at a crank angle, of each leg by name."""
        points = self.node.scene.mechanisms[self._name].points
        rows = places(self.markers_at(theta)[1]).reshape(-1, len(points), 2)
        return [dict(zip(points, row)) for row in rows]


def places(marker):
    assert all(point.z == 0.0 for point in marker.points)
    return np.array([[point.x, point.y] for point in marker.points])


def distance(leg, bar):
    return math.dist(leg[bar[0]], leg[bar[1]])


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


def test_right_legs_share_their_pin_with_left_legs(graph):
    legs = Bench(graph, 'walker', WALKER).legs_at(0.7)
    assert len(legs) == 6
    for j, (left, right) in enumerate(zip(legs[0::2], legs[1::2])):
        angle = 0.7 - math.tau * j / 3.0
        pin = 0.15 * np.array([math.cos(angle), math.sin(angle)])
        assert left['A'] == pytest.approx(pin, abs=1e-15)
        assert right['A'] == pytest.approx(pin, abs=1e-15)
        assert left['B'] * [-1.0, 1.0] == pytest.approx(right['B'])
        for bar, length in LENGTHS.items():
            assert distance(right, bar) == pytest.approx(0.01 * length, abs=1e-12 * 0.657, rel=0.0)


ANKLE = scene.load(str(Path(__file__).parents[1] / 'examples' / 'ankle.yaml'))
LIFT = ['O ground 0 0', 'P ground 0.5 -0.2', 'B cylinder P O 1.1 right', 'C line O B 1.6']


@pytest.mark.parametrize('parameters, positions, said', [
    # The right leg is the mirror image of a left one at pi minus the angle.
    ({'type': 'jansen', 'mirrored': True, 'dimensions.a': 10.0, 'dimensions.m': 22.0}, [0.1],
     'm_right0 cannot be assembled at crank angle 0.1 rad: no place for "E dyad B A c k right"'),
    ({'type': 'five_bar'}, [-2.04, 1.59], 'm cannot be assembled at crank angle -2.04 rad, '
     'crank2 angle 1.59 rad: no place for "P dyad A C b c left"'),
    ({'type': 'custom', 'scale': 10.0, 'joints': [
        'O ground 0 0', 'P ground 1 0', 'B cylinder P O 1 left', 'Q crank B 1 zero O',
        'D cylinder O Q 1 left']}, [9.0, 0.3, 25.0],
     'm cannot be assembled at cylinder length 9 m, crank angle 0.3 rad, cylinder2 length 25 m: '
     'no place for "D cylinder O Q 1 left"'),
    (None, [0.3, 0.3], 'no place for "pitch hinge ground at 0 0 0 axis 0 1 0 within -50deg '
     '30deg"'),
    ({'type': 'custom', 'joints': LIFT, 'scale': 2.0}, [9.0],
     'm cannot be assembled at cylinder length 9 m; the reach is [1.12297, 3.27703] m'),
    ({'type': 'four_bar'}, [math.nan], 'm cannot be assembled: m_crank is at nan'),
    # A crank alone, which nothing needs to be assembled with.
    ({'type': 'custom', 'joints': ['O ground 0 0', 'A crank O 1']}, [math.nan],
     'm cannot be assembled: m_crank is at nan'),
    ({'type': 'peaucellier'}, [math.inf], 'm cannot be assembled: m_crank is at inf'),
    ({'type': 'five_bar'}, [0.3, -math.inf], 'm cannot be assembled: m_crank2 is at -inf'),
    ({'type': 'peaucellier'}, [2.0],
     'm cannot be assembled at crank angle 2 rad; the reach is [-1.17137, 1.17137] rad'),
    # In the reach as far as so large an angle can tell.
    ({'type': 'peaucellier'}, [1e300],
     'm cannot be assembled at crank angle 1e+300 rad: no place for "B C D inversor P A a b"')])
def test_what_cannot_be_assembled_is_said_with_the_reason(graph, parameters, positions, said):
    heard = graph.log()
    node = graph.start(Kinematics, {'mechanisms': ['m'], **{
        f'm.{key}': value for key, value in parameters.items()}} if parameters else {
            one.name: one.value for one in ANKLE.parameters if one.value != ()})
    mechanism, = node.scene.mechanisms.values()
    graph.listen(JointState, f'{mechanism.name}/joint_states')
    graph.until(lambda: node.count_subscribers('/rosout'))
    push = graph.crank([settings.source for settings in mechanism.inputs.values()])
    graph.until(lambda: push.send(positions) and [
        m for m in heard if 'cannot be assembled' in m.msg])
    text, = {m.msg for m in heard if 'cannot be assembled' in m.msg}
    assert text.endswith(said)


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
    mechanism, = node.scene.mechanisms.values()
    push = graph.crank([drive.source for drive in mechanism.inputs.values()])
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


REFUSED = [
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
    ({'jansen.type': 'water_drop'}, 'read-only.* jansen.type')]


def test_a_bad_value_is_refused_with_a_reason_and_the_node_runs_on(graph):
    bench = Bench(graph, 'jansen')
    before = bench.legs_at(0.3)[0]
    for values, reason in REFUSED:
        refused = graph.set(bench.node, **values)
        assert not refused.successful and re.search(reason, refused.reason)
    after = bench.legs_at(0.3)[0]
    assert all((before[name] == after[name]).all() for name in before)


def test_driver_and_kinematics_go_together_in_a_namespace(graph):
    for node_class in (CrankDriver, Kinematics):
        graph.start(node_class, WALKER, namespace='/left/side')
    heard = graph.listen(MarkerArray, '/left/side/walker/markers')
    graph.until(lambda: len(heard) > 5)
    assert len(heard[-1].markers[1].points) == 6 * 8


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
    crank = driver.scene.mechanisms['bars'].first
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


def test_a_joint_is_within_half_a_turn_of_its_zero_and_turns_by_its_sign(graph):
    graph.start(Kinematics, {**KNEE, 'left.joint_names': ['QB=-left_ankle+7', 'crank=motor+9']})
    states, turn = graph.listen(JointState, 'left/joint_states'), graph.crank(['left_knee_motor'])
    linkage = mechanisms.create('four_bar')
    for theta in (0.4, 3.0, 5.0):
        state = turn([theta], states, [2.0])
        angle, rate = (float(numbers(theta)['QB']) for numbers in (
            linkage.joint_angles, linkage.joint_rates))
        assert by_name(state.velocity, state) == pytest.approx(
            {'left_ankle': -2.0 * rate, 'motor': 2.0})
        assert by_name(state.position, state) == {
            'left_ankle': pytest.approx(math.remainder(7.0 - angle, math.tau)),
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


def test_the_subscription_of_the_node_itself_does_not_count(graph):
    hear = partial(graph.node.create_subscription, JointState, 'joint_states', print, 1)
    hear()
    tracked = TrackedPublisher(graph.node, JointState, 'joint_states', 10, ignored=1)
    other = hear()
    graph.until(lambda: tracked.has_subscribers)
    graph.node.destroy_subscription(other)
    graph.until(lambda: not tracked.has_subscribers)
    assert tracked.publisher.get_subscription_count() == 1


def test_what_was_heard_before_anybody_listened_is_in_the_scenes_message(graph):
    graph.start(Kinematics, {'mechanisms': ['water_drop', 'jansen']})
    turn = graph.crank(['water_drop_crank'])
    turn([0.3], graph.listen(MarkerArray, 'water_drop/markers'))
    states = graph.listen(JointState, 'joint_states')
    state = graph.crank(['jansen_crank'])([0.5], states)
    crank = by_name(state.position, state)
    assert (crank['water_drop_crank'], crank['jansen_crank']) == (0.3, 0.5)
