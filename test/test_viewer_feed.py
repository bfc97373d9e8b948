# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Frames: the markers that the page draws, from the bytes of any publisher."""

import itertools
import json
import math

from linkage_ros.web.feed import Feed
import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from viewer_harness import framed, markers_of, parts, spoilt, walker
from visualization_msgs.msg import Marker, MarkerArray


def frame_of(markers):
    """Return the frame of some markers, part by part, as the page reads it."""
    return [({'key': '/leg', 'topic': 'markers', 'markers': [
        {'kind': {Marker.LINE_LIST: 'lines', Marker.LINE_STRIP: 'locus', Marker.SPHERE_LIST:
                  'joints', Marker.TRIANGLE_LIST: 'triangles'}[marker.type],
         'piece': {Marker.LINE_LIST: 2, Marker.SPHERE_LIST: 1, Marker.TRIANGLE_LIST: 3}.get(
             marker.type, len(marker.points)), 'frame': marker.header.frame_id,
         'width': marker.scale.x, 'points': len(marker.points),
         'pose': [*parts(marker.pose.position), *parts(marker.pose.orientation)],
         'colour': parts(marker.color)} for marker in markers]}, [
             [list(map(np.float32, parts(point))) for point in marker.points]
             for marker in markers])]


def read(feed_):
    """Return the frame of a feed's newest message, part by part, as lists."""
    return [(head, [part.tolist() for part in points]) for head, points in framed(feed_.frame())]


def feed_of_a_leg():
    """Return the feed of a leg's markers, which logs nothing."""
    return Feed('/leg', '/leg/markers', MarkerArray, lambda text, subject: None)


def test_a_frame_has_the_markers_of_the_newest_message():
    topic = feed_of_a_leg()
    assert topic.frame() == b''
    for text in (walker(1), walker(2), walker(4, legs=1), walker(6, width=2.0),
                 walker(7, frame='\N{BLACK STAR}'), *2 * [walker(9) + bytes(3)]):
        topic.newest = text
        assert read(topic) == frame_of(markers_of(text))
        assert topic.frame() is topic.frame()


def test_of_a_message_what_is_deleted_or_no_line_joint_or_triangle_is_not_drawn():
    topic = feed_of_a_leg()
    message = deserialize_message(walker(1), MarkerArray)
    bars, joints = message.markers
    message.markers = [
        Marker(type=Marker.LINE_LIST, action=Marker.DELETE), joints, Marker(type=Marker.CUBE),
        bars, Marker(type=Marker.TRIANGLE_LIST),
        Marker(type=Marker.LINE_STRIP, points=bars.points)]
    topic.newest = serialize_message(message)
    assert read(topic) == frame_of([joints, bars, *message.markers[4:]])
    (head, _), = read(topic)
    assert [marker['kind'] for marker in head['markers']] == [
        'joints', 'lines', 'triangles', 'locus']


@pytest.mark.parametrize('type_, id_, kind', [
    (Marker.LINE_LIST, 0, 'lines'), (Marker.LINE_LIST, 2, 'locus'), (Marker.LINE_LIST, 3, 'slots'),
    (Marker.TRIANGLE_LIST, 7, 'plates'), (Marker.TRIANGLE_LIST, 8, 'triangles')])
def test_lines_and_triangles_are_told_apart_by_their_ids(type_, id_, kind):
    topic = feed_of_a_leg()
    topic.newest = serialize_message(MarkerArray(markers=[Marker(type=type_, id=id_)]))
    (head, _), = read(topic)
    assert head['markers'][0]['kind'] == kind


@pytest.mark.parametrize('text', [
    b'', b'\0\1\0\0', b'\xff' * 64, walker(1)[:99], walker(1)[:4] + b'\xff' * 500, *(
        spoilt(part, number) for part in range(4) for number in (math.nan, -1e300))],
    ids=itertools.count())  # padding between fields is whatever was in memory
def test_of_what_cannot_be_drawn_nothing_stays(text):
    topic = feed_of_a_leg()
    for topic.newest in (walker(0), text, walker(2)):
        for head, points in framed(topic.frame()):
            json.dumps(head, allow_nan=False)
            assert all(np.isfinite(part).all() for part in points)
    assert read(topic) == frame_of(markers_of(walker(2)))
