# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The kinematics node: what arrives on its topics is the linkage, whatever messages say."""

import math
import struct
from types import SimpleNamespace

from geometry_msgs.msg import Point
from linkage_ros import mechanisms, palette
from linkage_ros.nodes import kinematics, log
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.nodes.publishers import LATCHED
import pytest
from rclpy.logging import LoggingSeverity
from rclpy.serialization import serialize_message
from robots import in_frame, rotation
from ros_harness import hastened
from scenes import BOOM, example
from sensor_msgs.msg import JointState
from visualization_msgs.msg import Marker, MarkerArray

WALKER = {'mechanisms': ['walker'], 'walker.type': 'jansen', 'walker.scale': 0.01,
          'walker.leg_pairs': 3}
ANKLE = {name.removeprefix('ankle.'): value for name, value in example('ankle').items()
         if name.startswith('ankle.')}
# A mechanism, where its inputs are, and what is said of it, called {m}.
UNASSEMBLED = [
    # Later pairs lag behind; a right leg is the image of a left one at pi minus the angle.
    ({'type': 'jansen', 'leg_pairs': 3, 'dimensions.a': 10.0, 'dimensions.m': 22.0}, [1.5],
     '{m}_right1, {m}_left2 cannot be assembled at crank angle 1.5 rad: no place for "E dyad B A '
     'c k right"'),
    ({'type': 'five_bar'}, [-2.04, 1.59], 'angle 1.59 rad: no place for "P dyad A C b c left"'),
    ({'type': 'custom', 'scale': 10.0, 'joints': [
        'O ground 0 0', 'P ground 1 0', 'B cylinder P O 1 left', 'Q crank B 1 zero O',
        'D cylinder O Q 1 left']}, [9.0, 0.3, 25.0],
     ' 9 m, crank angle 0.3 rad, cylinder2 length 25 m: no place for "D cylinder O Q 1 left"'),
    ({**ANKLE, 'joints': [line.replace(' within', '\twithin') for line in ANKLE['joints']]},
     [0.3, 0.3], '"pitch hinge ground at 0 0 0 axis 0 1 0\twithin -50deg 30deg", '
     '"roll hinge pitch at 0 0 -0.0176 axis 1 0 0\twithin -15deg 15deg"'),
    ({'type': 'custom', 'joints': BOOM, 'scale': 2.0}, [9.0],
     '{m} cannot be assembled at cylinder length 9 m; the reach is [1.12297, 3.27703] m'),
    ({'type': 'four_bar'}, [math.nan], '{m} cannot be assembled: {m}_crank is at nan'),
    # A crank alone, which nothing needs to be assembled with.
    ({'type': 'custom', 'joints': ['O ground 0 0', 'A crank O 1']}, [math.nan], 'crank is at nan'),
    ({'type': 'five_bar'}, [0.3, -math.inf], '{m} cannot be assembled: {m}_crank2 is at -inf'),
    ({'type': 'peaucellier'}, [2.0], ' crank angle 2 rad; the reach is [-1.17137, 1.17137] rad'),
    ({'type': 'four_bar', 'crank.measures': 'distance(O,B)'}, [1000.0],
     '{m}_distance(O,B) is at 1000, out of reach of distance(O,B)'),
    # In the reach as far as so large an angle can tell.
    ({'type': 'peaucellier'}, [1e300],
     '{m} cannot be assembled at crank angle 1e+300 rad: no place for "B C D inversor P A a b"')]


def test_what_cannot_be_assembled_is_said_with_the_reason(graph):
    logged = graph.log()
    node = graph.start(Kinematics, {'mechanisms': [f'm{i}' for i in range(len(UNASSEMBLED))], **{
        f'm{i}.{key}': value for i, (parameters, *_) in enumerate(UNASSEMBLED)
        for key, value in parameters.items()}})
    # Of the first mechanism some legs are assembled.
    first, *_ = [graph.listen(JointState, f'{name}/joint_states')
                 for name in node.scene.mechanisms]
    graph.crank([settings.source for mechanism in node.scene.mechanisms.values()
                 for settings in mechanism.inputs.values()])(
        [position for _, positions, _ in UNASSEMBLED for position in positions], first)
    graph.until(lambda: len({m.name for m in logged if 'cannot be' in m.msg}) == len(UNASSEMBLED))
    for name, (*_, reason) in zip(node.scene.mechanisms, UNASSEMBLED):
        text, = {m.msg for m in logged if m.name == f'kinematics.{name}'}
        assert text.endswith(reason.format(m=name))


ARM = {'mechanisms': ['boom'], 'boom.type': 'custom', 'boom.scale': 2.0, 'boom.joints': [
    *BOOM, 'C line O B 1.6', 'D rigid O B 0.6 0.7 left', 'E cylinder D B 0.4 left']}
# Type, colour, width as a part of the longest bar, and layer above the plane, by the marker's id.
LOOKS = {
    0: (Marker.LINE_LIST, 'BAR', 40, 0), 1: (Marker.SPHERE_LIST, 'JOINT', 20, 0),
    2: (Marker.LINE_STRIP, 'LOCUS', 100, -3), 3: (Marker.LINE_LIST, 'SLOT', 14, 1),
    4: (Marker.LINE_LIST, 'BAR', 22, 3), 5: (Marker.LINE_LIST, 'DRIVEN', 40, 2),
    6: (Marker.LINE_LIST, 'DRIVEN', 22, 4), 7: (Marker.TRIANGLE_LIST, 'BAR', None, -1),
    8: (Marker.TRIANGLE_LIST, 'EARTH', None, -2)}


@pytest.mark.parametrize('name, scene, size, ids', [
    ('walker', WALKER, 0.01 * 65.7, {0, 1, 2, 5, 7, 8}),
    ('lever', {'mechanisms': ['lever'], 'lever.type': 'slotted_lever'}, 270.0,
     {0, 1, 2, 3, 4, 5, 8}), ('boom', ARM, 3.2, {0, 1, 6, 7, 8})])
def test_every_marker_looks_as_the_table_says_and_is_in_its_layer(graph, name, scene, size, ids):
    pose = [1.0, -2.0, 3.0, 0.4, -0.3, 2.5]
    node = graph.start(Kinematics, {
        **scene, f'{name}.pose': pose, f'{name}.frame_id': 'floor', 'frame_prefix': 'robot/'})
    drawn, locus = graph.listen(MarkerArray, f'{name}/markers'), graph.listen(
        Marker, f'{name}/locus', LATCHED)
    mechanism, = node.scene.mechanisms.values()
    push = graph.crank([settings.source for settings in mechanism.inputs.values()])
    markers = push([0.3] if len(ids) > 5 else [2.0, 1.1], drawn).markers
    ahead, _, up = rotation(pose[3:]).T
    if 2 in ids:
        markers = [*markers, graph.until(locus.copy)[-1]]
    assert {marker.id for marker in markers} == ids and len(markers) == len(ids)
    for marker in markers:
        type_, colour, part, layer = LOOKS[marker.id]
        if (name, marker.id) == ('walker', 2):
            # Both curves of mirrored legs, as a list of lines.
            type_ = Marker.LINE_LIST
        p, scale, rgba = marker.pose.position, marker.scale, marker.color
        whole = part in (None, 20)
        width = size / part if part else 1.0
        assert (marker.ns, marker.type, marker.action, marker.header.frame_id) == (
            name, type_, Marker.ADD, 'robot/floor')
        place = pose[:3] + layer * size / 250.0 * up
        assert [p.x, p.y, p.z] == pytest.approx(list(place))
        for point, way in ((Point(x=1.0), ahead), (Point(z=1.0), up)):
            assert in_frame(marker.pose, point) == pytest.approx(place + way)
        assert [scale.x, scale.y, scale.z] == pytest.approx([width] + [width * whole] * 2)
        assert [rgba.r, rgba.g, rgba.b, rgba.a] == pytest.approx(
            [*palette.rgb(getattr(palette, colour)), 1.0], abs=1e-7)
        face = palette.rgb(palette.PLATE if marker.id == 7 else getattr(palette, colour))
        assert [pytest.approx([*face, 1.0], abs=1e-7)] * len(marker.colors) == [
            [one.r, one.g, one.b, one.a] for one in marker.colors]
        assert len(marker.colors) == (len(marker.points) // 3 if marker.id > 6 else 0)


def test_what_comes_while_the_node_is_kept_waiting_is_not_lost(graph):
    # 100 ms of a source at 1000 Hz, and not much more: old angles are of no use to anybody.
    graph.start(Kinematics, {'mechanisms': ['water_drop']})
    answers = graph.listen(JointState, 'water_drop/joint_states', 200)
    crank = graph.crank(['water_drop_crank'])
    crank([0.0], answers)
    source = graph.publisher(JointState, 'crank_states', 200)
    for number in range(1, 151):
        message = JointState(name=['water_drop_crank'], position=[0.01 * number])
        message.header.stamp.sec = 1000 + number
        source.publish(message)
    graph.until(lambda: answers and answers[-1].header.stamp.sec == 1150)
    stamps = [message.header.stamp.sec for message in answers if message.header.stamp.sec > 1000]
    assert stamps == list(range(1051, 1151))


KNEE = {'mechanisms': ['left', 'right'], 'left.type': 'four_bar', 'right.type': 'slotted_lever',
        'left.crank.source': 'left_knee_motor', 'right.crank.source': 'right_hip_motor',
        'left.joint_names': ['AB=left_shin', 'QB=-left_ankle+7'], 'left.only_named': True,
        'right.joint_names': ['crank=right_hip_motor', 'slide=-right_slide']}
SHARED = ['--ros-args', '-r', 'crank_states:=joint_states']


def test_motors_and_passive_joints_share_a_topic_and_nobody_hears_himself(graph):
    logged = graph.log()
    node = graph.start(Kinematics, KNEE, cli_args=SHARED)
    others, answers = [], []

    def sort(message):
        (answers if 'right_slide' in message.name else others).append(message)

    graph.node.create_subscription(JointState, 'joint_states', sort, 100)
    graph.crank(['right_hip_motor'], 'joint_states')([0.2], answers)
    state = graph.crank(['left_knee_motor', 'wheel'], 'joint_states')([0.9, 7.0], answers)
    bars, lever = (mechanisms.create(name) for name in ('four_bar', 'slotted_lever'))
    angles, slid = bars.joint_angles(0.9), lever.joint_angles(0.2)
    assert dict(zip(state.name, state.position, strict=True)) == pytest.approx({
        'left_shin': angles['AB'], 'left_ankle': math.remainder(7.0 - angles['QB'], math.tau),
        'right_lever': slid['lever'], 'right_slide': -slid['slide']})
    unknown = 'no input is called wheel; the inputs are left_knee_motor, right_hip_motor'
    graph.until(lambda: [m for m in logged if unknown in m.msg])
    graph.crank(['left_knee_motor'], 'joint_states')([1.0], answers)
    assert len(answers) <= len(others)
    # The names of joints may change.
    assert graph.set(node, left__joint_names=['AB=left_tibia']).successful
    graph.crank(['left_knee_motor', 'left_tibia'], 'joint_states')([1.0, 2.0], answers)
    assert len([m for m in logged if 'no input is called' in m.msg]) == 1


# --- crank messages, however they come and whatever they say ---

class Hand:
    """A kinematics node, what it publishes and says, and a publisher of crank messages."""

    def __init__(self, graph, mechanism='jansen'):
        self._graph = graph
        self.log = graph.log()
        self.joints = graph.listen(JointState, f'{mechanism}/joint_states', 100)
        self.node = graph.start(Kinematics, {'mechanisms': [mechanism]})
        self.publisher = graph.publisher(JointState, 'crank_states', 100)
        graph.until(lambda: self.node.count_subscribers(f'{mechanism}/joint_states'))

    def send(self, names, positions, velocities=()):
        """Publish a crank message."""
        self.publisher.publish(JointState(name=names, position=positions, velocity=velocities))

    def warnings(self, words):
        """Return the warnings with some words in them."""
        return [m.msg for m in self.log if m.level == LoggingSeverity.WARN and words in m.msg]

    def moved(self, names, positions, velocities=()):
        """Return the joint states after a message: the first that have its first position."""
        count = len(self.joints)
        self.send(names, positions, velocities)
        return self._graph.until(lambda: [
            m for m in self.joints[count:] if positions[0] in m.position])[0]


BAD = {
    'cut off': serialize_message(JointState(name=['jansen_crank'], position=[1.0]))[:30],
    'a name without end': (b'\0\1\0\0' + bytes(8)
                           + struct.pack('<IxxxxII', 1, 1, 2 ** 32 - 9) + bytes(40))}


@pytest.mark.parametrize('text', BAD.values(), ids=BAD)
def test_bytes_that_are_no_joint_states_are_passed_over_with_one_warning(graph, text):
    hand = Hand(graph)
    for _ in range(5):
        hand.publisher.publish(text)
    warnings = graph.until(lambda: hand.warnings('no JointState'))
    assert len(warnings[0]) < 400 and warnings[0].startswith(
        f'/crank_states: a message of {len(text)} bytes is ignored, since it is no JointState: ')
    assert hand.moved(['jansen_crank'], [0.5], [1.0]).velocity[0] == 1.0
    assert len(hand.warnings('no JointState')) == 1


def test_a_warning_is_repeated_when_its_time_is_over():
    warnings = []
    throttle = log.Throttle(SimpleNamespace(warning=warnings.append))
    for throttle.seconds, count in ((60.0, 1), (0.0, 4), (60.0, 4)):
        for _ in range(3):
            throttle.warn('a', lambda: 'a')
        assert len(warnings) == count


def test_what_was_logged_is_forgotten_when_it_is_too_much():
    warnings = []
    throttle = log.Throttle(SimpleNamespace(warning=warnings.append))
    for subject in (*range(log.MAX_SUBJECTS), 0, 'one more', 0):
        throttle.warn(subject, lambda subject=subject: subject)
    assert warnings == [*range(log.MAX_SUBJECTS), 'one more', 0]


def test_a_stream_of_new_names_is_said_within_bounds(graph):
    hand = Hand(graph)
    for i in range(60):
        hand.send([f'{i}' * 1000, '\n', f'w{i}'], [0.0] * 3)
        if i % 10 == 0:
            hand.moved(['jansen_crank'], [0.001 * i])
    hand.moved(['jansen_crank'], [0.7])
    warnings = hand.warnings('no input is called')
    assert len(warnings) <= 20 and 'no more will be named' in warnings[-1]
    assert all(len(text) < 500 and '\n' not in text for text in warnings)
    hand.send(['another'], [0.0])
    hand.moved(['jansen_crank'], [0.8])
    assert hand.warnings('no input is called') == warnings


@pytest.mark.parametrize('sent, missing', [
    ([], 'five_bar_crank, five_bar_crank2'), (['five_bar_crank'], 'five_bar_crank2'),
    (['five_bar_crank', 'five_bar_crank2'], '')])
def test_inputs_that_nobody_sends_are_said_once(graph, sent, missing):
    hand = Hand(graph, 'five_bar')
    if sent:
        hand.send([*sent, 'nobody'], [0.1, 0.2, 0.3][:len(sent) + 1])
        graph.until(lambda: hand.warnings('called nobody'))
    timer = hastened(hand.node, kinematics.MISSING_AFTER_S)
    graph.until(timer.is_canceled)
    hand.moved(['five_bar_crank', 'five_bar_crank2'], [0.4, 0.5])
    graph.all_logged(hand.node, hand.log)
    assert timer.is_canceled() and hand.warnings('was received, without') == [
        f'/crank_states: no position of {missing} was received, without which five_bar cannot move'
        ] * bool(missing)
