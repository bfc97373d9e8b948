# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The robot model on its topic: an unchanged robot_state_publisher sees what the markers show."""

import math
from xml.etree import ElementTree

from linkage_ros import scene
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.nodes.publishers import LATCHED
from linkage_ros.nodes.urdf_cli import main
from linkage_ros.robot_model import urdf
import numpy as np
import pytest
from robots import in_frame, Pinocchio
from scenes import ROOT
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

CATALOGUE = ROOT / 'config' / 'all.yaml'
POSE = [0.3, -0.2, 0.92, math.pi / 2.0, 0.4, -1.1]
ROBOT = {'mechanisms': ['hand', 'arm', 'foot'], 'frame_id': 'torso', 'arm.type': 'four_bar',
         'hand.type': 'slider_crank', 'foot.type': 'four_bar', 'foot.only_named': True,
         'foot.frame_id': 'shin', 'arm.pose': POSE, 'hand.pose': [0.1, 0.2, 0.3, 0.4, 0.5, 0.6],
         'hand.frame_id': 'arm_AB_link', 'hand.joint_names': ['block=-hand_rod+2']}


def test_one_robot_state_publisher_sees_all_loops_of_the_scene_closed(graph):
    node = graph.start(Kinematics, ROBOT)
    descriptions = graph.listen(String, 'robot_description', LATCHED)
    states = graph.listen(JointState, 'joint_states')
    drawn = graph.listen(MarkerArray, 'hand/markers')
    text = graph.until(lambda: descriptions)[0].data
    robot = Pinocchio(text)
    assert '<robot name="linkages">' in text
    points = [f'hand_{point}' for point in node.scene.mechanisms['hand'].points]
    ends = [link.get('name') for link in ElementTree.fromstring(text).iter('link')]
    cuts = [end for end in ends if end.endswith('_cut')]
    assert {cut[:4] for cut in cuts} == {'arm_', 'hand'} and 'foot' not in text
    turn = graph.crank(['hand_crank', 'arm_crank'])
    for theta in (-1.0, 0.3, 2.9):
        state = turn([theta, 0.5 - theta], states)
        places = robot.places(dict(zip(state.name, state.position)), [*ends, 'arm_AB_link'])
        for cut in cuts:
            assert np.abs(places[cut] - places[cut[:-4]]).max() < 1e-11
        # The markers are in a frame that moves: among each other and from its origin they are
        # where the robot's are.
        spheres = turn([theta, 0.5 - theta], drawn).markers[1]
        assert spheres.header.frame_id == 'arm_AB_link'
        for point, sphere in zip(points, spheres.points):
            far = np.linalg.norm(places[point] - places['arm_AB_link'])
            assert np.linalg.norm(in_frame(spheres.pose, sphere)) == pytest.approx(far)


def test_frames_of_another_robot_make_no_robot_of_the_scene(graph):
    texts = graph.log()
    graph.until(lambda: graph.node.count_publishers('/rosout'))
    graph.start(Kinematics, {**ROBOT, 'foot.only_named': False})
    whole = graph.listen(String, 'robot_description', LATCHED)
    message = graph.until(lambda: [m.msg for m in texts if 'robot_description' in m.msg])[0]
    assert 'frame_id must be the same for all' in message and 'torso, shin' in message
    assert not whole


def test_whoever_comes_late_hears_the_description_once(graph):
    node = graph.start(Kinematics, {'mechanisms': ['jansen'], 'frame_id': 'base'})
    messages, whole = (graph.listen(String, topic, LATCHED)
                       for topic in ('jansen/robot_description', 'robot_description'))
    robot = ElementTree.fromstring(graph.until(lambda: messages and whole and messages)[0].data)
    assert robot.get('name') == 'jansen' and robot.find('link').get('name') == 'base'
    crank = graph.crank(['jansen_crank'])
    crank([0.5], graph.listen(JointState, 'jansen/joint_states'))
    assert graph.set(node, jansen__points=['G']).successful
    assert graph.set(node, jansen__pose=[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]).successful
    graph.until(lambda: len(messages) > 1 < len(whole))
    assert len(messages) == len(whole) == 2
    assert all('xyz="1.0 0.0 0.0"' in texts[1].data for texts in (messages, whole))

    def publishers():
        return [str(info.endpoint_gid)
                for info in graph.node.get_publishers_info_by_topic('robot_description')]

    # Of a scene that has no robot any more, nobody hears the last one.
    before = publishers()
    assert graph.set(node, jansen__only_named=True).successful
    graph.until(lambda: publishers() not in ([], before))
    late = graph.listen(String, 'robot_description', LATCHED)
    assert graph.set(node, jansen__only_named=False).successful
    graph.until(lambda: late and len(whole) == 3)
    assert len(late) == 1


FILES = {'rate.yaml': 'rate: 5.0\n', 'empty.yaml': '',
         'foreign.yaml': '/another_node:\n  ros__parameters:\n    rate: 5.0\n',
         'date.yaml': 'a: 2020-13-45\n', 'itself.yaml': '/**: {ros__parameters: &a {b: *a}}\n',
         'deep.yaml': '[' * 5000, 'bytes.yaml': '\x00'}


def test_arguments_of_the_process_may_be_beside_those_for_ros(capsys, monkeypatch):
    own, other = ['--mechanism', 'jansen'], ['--ros-args', '--params-file', str(CATALOGUE)]
    for argv in ([*own, *other], [*other, '-p', 'jansen.scale:=0.005', '--', *own]):
        monkeypatch.setattr('sys.argv', ['urdf', *argv])
        assert main() == 0
        assert capsys.readouterr().out == urdf.describe(
            [scene.load(str(CATALOGUE)).mechanisms['jansen']], 'world') + '\n'


@pytest.mark.parametrize('arguments, complaint', [
    *(([name], name) for name in ('nowhere.yaml', *FILES, '.')),
    *((['--ros-args', '--params-file', name], "must have '/**:'" if name in (
        'empty.yaml', 'foreign.yaml') else name) for name in ('nowhere.yaml', *FILES, '.')),
    # As of a variable that is not set.
    ([''], 'No such file'), (['', '--ros-args', '-p', 'rate:=1.0'], 'either as SCENE or'),
    ([str(CATALOGUE), 'b.yaml'], 'unrecognized arguments: b.yaml'),
    ([str(CATALOGUE), '--mechanism', 'leg'], "there is no mechanism 'leg'; allowed: water_drop, "),
    ([str(CATALOGUE), '--ros-args', '-p', 'rate:=1.0'], 'either as SCENE or with --ros-args'),
    (['--ros-args', '--bogus'], '--bogus'),
    (['--ros-args', '-p', 'x'], "'-p x'"),
    (['--ros-args', '--params-file'], 'No file path provided'),
    (['--ros-args', '-p', 'rate:=1.0', '--', '--bogus'], 'unrecognized arguments: --bogus')],
    ids=str)
def test_what_is_not_understood_is_refused_in_one_line(
        tmp_path, monkeypatch, capsys, arguments, complaint):
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 1
    printed = capsys.readouterr()
    assert printed.out == '' and printed.err.count('\n') == 1 and complaint in printed.err
    assert printed.err.startswith('urdf: ')
