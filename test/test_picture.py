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
from oracle import Bench, everything, message
import pytest
from ros_harness import Graph, Process
from visualization_msgs.msg import Marker, MarkerArray

# The markers of a leg and its locus, by id.
LEG_IDS = set(range(9)) - {3, 4, 6}


def picture(graph):
    """Return a function that returns the ids of a leg's markers that are there; now all are."""
    arrays = graph.listen(MarkerArray, 'jansen/markers', 100)
    loci = graph.listen(Marker, 'jansen/locus', LATCHED)

    def ids():
        shown = set()
        for marker in [*(m for array in arrays for m in array.markers), *loci]:
            assert marker.ns == 'jansen'
            (shown.discard if marker.action == Marker.DELETE else shown.add)(marker.id)
        return shown

    graph.crank(['jansen_crank'])([0.3], arrays)
    graph.until(lambda: ids() == LEG_IDS)
    return ids


def test_nothing_is_left_of_a_node_that_is_destroyed(graph):
    node = graph.start(Kinematics)
    shown = picture(graph)
    node.destroy_node()
    graph.until(lambda: not shown())


@pytest.mark.nightly
def test_nothing_is_left_of_a_process_that_is_told_to_end(tmp_path):
    path = tmp_path / 'scene.yaml'
    path.write_text('/**:\n  ros__parameters:\n    mechanisms: [jansen]\n')
    process = Process('kinematics', path)
    with Graph(process.domain) as graph:
        shown = picture(graph)
        process.interrupt(signal.SIGINT)
        graph.until(lambda: not shown())
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
    leg, turn = {'mechanisms': ['jansen']}, message({'jansen_crank': 0.5})
    Bench(graph, leg).run([*everything(leg), turn, *(
        ('set', {**bad, **more}) for bad, _ in UNPUBLISHABLE
        for more in ({}, {'jansen.dimensions.m': 14.0})), turn])
    for bad, named in UNPUBLISHABLE:
        with pytest.raises(scene.SceneError, match=re.escape(named)):
            graph.start(Kinematics, {**leg, **bad})
