# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What is no longer shown is taken out of the picture, and what cannot be shown is refused."""

import re
import signal

from linkage_ros import palette, scene
from linkage_ros.nodes import messages
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.nodes.publishers import LATCHED
import numpy as np
import pytest
from ros_harness import Graph, Process
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from visualization_msgs.msg import Marker, MarkerArray

# The markers of a leg and its locus, by id.
LEG_IDS = set(range(9)) - {3, 4, 6}


class Picture:
    """What somebody sees who draws every marker and deletes what he is told to."""

    def __init__(self, graph, mechanism):
        self._arrays = graph.listen(MarkerArray, f'{mechanism}/markers', 100)
        self._loci = graph.listen(Marker, f'{mechanism}/locus', LATCHED)
        self._mechanism = mechanism

    def __call__(self):
        """Return the ids of the markers that are there."""
        shown = set()
        for marker in [*(m for array in self._arrays for m in array.markers), *self._loci]:
            assert marker.ns == self._mechanism
            (shown.discard if marker.action == Marker.DELETE else shown.add)(marker.id)
        return shown


def test_nothing_is_left_of_a_node_that_is_destroyed(graph):
    node = graph.start(Kinematics)
    picture = Picture(graph, 'jansen')
    graph.crank(['jansen_crank'])([0.3], graph.listen(MarkerArray, 'jansen/markers'))
    graph.until(lambda: picture() == LEG_IDS)
    node.destroy_node()
    graph.until(lambda: not picture())


@pytest.mark.nightly
def test_nothing_is_left_of_a_process_that_is_told_to_end(tmp_path):
    path = tmp_path / 'scene.yaml'
    path.write_text('/**:\n  ros__parameters:\n    mechanisms: [jansen]\n')
    process = Process('kinematics', path)
    with Graph(process.domain) as graph:
        picture = Picture(graph, 'jansen')
        graph.crank(['jansen_crank'])([0.3], graph.listen(MarkerArray, 'jansen/markers'))
        graph.until(lambda: picture() == LEG_IDS)
        process.interrupt(signal.SIGINT)
        graph.until(lambda: not picture())
        code, printed = process.end()
    assert code == 0 and 'Traceback' not in printed


def luminance(colour):
    """Return the relative luminance of a colour, as WCAG 2 defines it."""
    parts = [int(colour[i:i + 2], 16) / 255 for i in (1, 3, 5)]
    return np.dot((0.2126, 0.7152, 0.0722), [
        part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts])


@pytest.mark.parametrize('background', [
    'white', palette.SHADE, palette.NIGHT, palette.DARK, '#303030'])
def test_every_marker_is_seen_on_the_page_and_on_the_grey_of_rviz(background):
    behind = luminance('#ffffff' if background == 'white' else background)
    for colour in {palette.PLATE, *(look[1] for look in messages.LOOKS)}:
        darker, lighter = sorted((behind, luminance(colour)))
        assert (lighter + 0.05) / (darker + 0.05) >= 3.0, colour


UNPUBLISHABLE = [
    # A frame or a joint of the model has the name.
    ({'frame_id': 'jansen_C_cut'}, 'frame_id'),
    ({'jansen.joint_names': ['EF=jansen_ground_link_fixed']}, 'two joints'),
    ({'jansen.scale': 1e308}, 'jansen.scale'), ({'jansen.scale': 5e-324}, 'jansen.scale'),
    ({'jansen.pose': [-1e31, 0.0, 0.0, 0.0, 0.0, 0.0]}, 'jansen.pose')]


def test_what_cannot_be_published_is_refused_and_what_was_there_goes_on(graph):
    node = graph.start(Kinematics, {'mechanisms': ['jansen']})
    states = graph.listen(JointState, 'jansen/joint_states')
    loci = graph.listen(Marker, 'jansen/locus', LATCHED)
    models = graph.listen(String, 'jansen/robot_description', LATCHED)
    turn = graph.crank(['jansen_crank'])
    before = turn([0.5], states)
    graph.until(lambda: loci and models)
    for bad, named in UNPUBLISHABLE:
        for values in (bad, {**bad, 'jansen.dimensions.m': 14.0}):
            refused = graph.set(node, **values)
            assert not refused.successful and named in refused.reason
            assert len(refused.reason) < 300
        assert all(node.get_parameter(name).value != bad[name] for name in bad)
        with pytest.raises(scene.SceneError, match=re.escape(named)):
            graph.start(Kinematics, {'mechanisms': ['jansen'], **bad})
    assert turn([0.5], states).position == before.position
    assert len(loci) == len(models) == 1
