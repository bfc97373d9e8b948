# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Robot models, read and moved by libraries that know nothing of this package. No ROS."""

import math
import re
from xml.etree import ElementTree

from linkage_ros import mechanisms
from linkage_ros.robot_model import urdf
import numpy as np
import pytest
from robots import FIRST, Pinocchio, rotation, Yourdfpy
from scenes import alone, BOOM, ENGINE
from truth.cases import CASES

TOLERANCE = 1e-12
POSE = [0.3, -0.2, 0.92, math.pi / 2.0, 0.4, -1.1]
GRIPPER = ['O ground 0 0', 'Q ground 0.08 0', 'A crank O 0.03', 'B dyad A Q 0.07 0.05 left',
           'P rigid A B 0.04 0.06 right', 'T rigid B Q 0.07 0.09 left']
FIVE_BAR = ['O ground 0 0', 'Q ground 0.118 0', 'A crank O 0.09', 'C crank Q 0.08 up',
            'P dyad A C 0.1 0.09 left', 'G ground 0 0.2', 'S slider P 0.3 G 0.2 out']
GEARED = ['O ground 0 0', 'Q ground 0.3 0', 'A crank O 0.1', 'B crank Q 0.08', 'D ground 0.3 0.2',
          'E crank D 0.05 geared crank2 -0.5 0.2', 'P dyad A B 0.25 0.22 left']
ON_BOOM = [*BOOM, 'C line O B 1.6', 'E rigid O B 0.6 0.7 left', 'F cylinder E B 0.4 left']
SWINGING_BLOCK = ['O ground 0 0', 'Q ground 2 0', 'A crank O 1', 'P slot A Q 0 out 4',
                  'B slider A 3 Q along O out']


def tilted(linkage, **settings):
    """Return a mechanism `m` of a scene in a tilted pose."""
    return alone(linkage, **{'pose': POSE, 'scale': 0.01, **settings})


MECHANISMS = {
    **{name: lambda name=name: tilted(name) for name in mechanisms.TYPES},
    'slotted_lever with offset': lambda: tilted('slotted_lever', dimensions__e=20.0),
    'walker of 3 pairs': lambda: tilted('jansen', leg_pairs=3),
    'one-sided walker': lambda: tilted('klann', leg_pairs=2, mirrored=False),
    'gripper': lambda: tilted(GRIPPER, scale=1.0),
    'engine': lambda: tilted(ENGINE),
    'boxer engine': lambda: tilted(ENGINE, leg_pairs=2),
    'five-bar with a block': lambda: tilted(FIVE_BAR, scale=1.0),
    'engine with zeros elsewhere': lambda: tilted(ENGINE, leg_pairs=2, joint_names=[
        'crank=-m_crank+0.3', 'left0_block=-m_left0_block+0.7', 'right1_block=m_right1_block-2',
        'right0_AB=-m_right0_AB', 'left1_AB=m_left1_AB+2.5']),
    'swinging block on the ground': lambda: tilted(SWINGING_BLOCK),
    'boom': lambda: tilted(ON_BOOM[:4], scale=2.0),
    'boom and arm': lambda: tilted(ON_BOOM, scale=2.0),
    'five-bar with a gear': lambda: tilted(
        GEARED, scale=1.0, crank2__sweep=[-6.0, 1.0],
        joint_names=['crank2=-m_crank2+1.0', 'crank3=-m_crank3-0.4'])}
FROM_CASES = {name: lambda case=case, pairs=2 if name == 'Cardan gears' else 1: tilted(
    case.joints, leg_pairs=pairs,
    **{f'dimensions__{key}': value for key, value in case.dimensions.items()})
    for name, case in CASES.items()}


def input_rows(mechanism, count=41):
    """Return inputs [rad or m] all through the reach, a row for each pose."""
    if len(mechanism.inputs) == 1:
        return np.concatenate([np.linspace(*arc, count) for arc in mechanism.first.reach])[:, None]
    inputs = [settings.input for settings in mechanism.inputs.values()]
    ends = np.transpose([(input_.low, input_.high) for input_ in inputs])
    rows = np.random.default_rng(0).uniform(*ends, (5 * count, len(mechanism.inputs)))
    sizes = [1.0 if input_.is_angle else mechanism.scale for input_ in inputs]
    places = [*mechanism.linkage.solve((rows / sizes).T).values()]
    is_assembled = np.isfinite(places).all(axis=(0, 2))
    return rows[is_assembled]


def joints_and_places(mechanism, thetas):
    """Return joint positions as they are published, and where each joint is [m], by name."""
    assembly, points = mechanism.assembly(), mechanism.linkage.points
    solution = assembly.solution(points, assembly.joints)
    solution.solve(thetas.tolist())
    positions, places = dict(zip(mechanism.inputs, thetas)), {}
    for prefix, row in zip(assembly.legs, solution.rows):
        start = f'm_{prefix}'
        places.update(zip([start + point for point in points],
                          row[:2 * len(points)].reshape(-1, 2)))
        positions.update(zip([prefix + joint for joint in assembly.joints], row[2 * len(points):]))
    return {called.name: called.of(positions[joint])
            for joint, called in mechanism.joints.items()}, places


def in_space(pose, places):
    """Return places in the plane [m] turned by roll, pitch and yaw in turn, and shifted."""
    return np.asarray(places) @ rotation(pose[3:])[:, :2].T + pose[:3]


def description(mechanism):
    return urdf.describe([mechanism], 'world')


def limits(mechanism):
    """Return the ends of each joint by the link's name, None where it has none."""
    moving = [joint for joint in ElementTree.fromstring(description(mechanism)).iter('joint')
              if joint.get('type') != 'fixed']
    ends = {joint.get('name')[2:]: joint.find('limit') for joint in moving}
    return {name: end if end is None else (float(end.get('lower')), float(end.get('upper')))
            for name, end in ends.items()}


@pytest.mark.nightly(all_but=8)
@pytest.mark.parametrize('name, library, count', [
    *((name, FIRST, 6) for name in (*MECHANISMS, *FROM_CASES)),
    *(pytest.param(name, library, 41, marks=pytest.mark.nightly)
      for name in MECHANISMS for library in (Pinocchio, Yourdfpy))])
def test_every_joint_is_met_and_every_loop_is_closed(name, library, count):
    mechanism = {**MECHANISMS, **FROM_CASES}[name]()
    text = description(mechanism)
    robot = library(text)
    frames = [name for link in ElementTree.fromstring(text).iter('link')
              if not re.search('_link$|^world$', name := link.get('name'))]
    near = TOLERANCE * mechanism.scale * mechanism.linkage.longest
    for thetas in input_rows(mechanism, count):
        positions, places = joints_and_places(mechanism, thetas)
        assert sorted(robot.joints) == sorted(positions)
        assert {re.sub(r'_cut\d*$', '', frame) for frame in frames} == set(places)
        for frame, place in robot.places(positions, frames).items():
            expected = in_space(mechanism.pose, places[re.sub(r'_cut\d*$', '', frame)])
            assert np.abs(place - expected).max() < near, (frame, thetas)


# Those of mirrored legs are the other way round, and so are those of joints with a sign.
MIRRORED = 'boxer engine', 'engine with zeros elsewhere', 'walker of 3 pairs'


@pytest.mark.parametrize('name', [
    pytest.param(name, marks=() if name in MIRRORED else pytest.mark.nightly)
    for name in MECHANISMS if not re.match('five.bar|boom and', name)])
def test_limits_hold_every_position_and_hardly_more(name):
    mechanism = MECHANISMS[name]()
    at = [joints_and_places(mechanism, np.array([theta]))[0] for arc in mechanism.first.reach
          for theta in np.linspace(*arc, 721)]
    for joint, ends in limits(mechanism).items():
        values = np.array([positions[f'm_{joint}'] for positions in at])
        if ends:
            slides = re.search('slide|block|cylinder', joint)
            more = 1e-4 * (mechanism.scale * mechanism.linkage.longest if slides else 1.0)
            assert ends[0] <= values.min() <= ends[0] + more
            assert ends[1] >= values.max() >= ends[1] - more
        elif joint != mechanism.first.input.name:
            assert np.ptp(values) > math.tau - 0.1


def test_no_joint_has_ends_of_its_own_where_there_are_two_cranks():
    ends = limits(MECHANISMS['five-bar with a block']())
    # A URDF cannot have a slide without.
    assert ends.pop('block') == (-1000.0, 1000.0) and not any(ends.values())


def spare(low, high, length=1.0):
    """Return ends that leave a millionth, of a slide's longest bar [m] or of a radian."""
    return pytest.approx((low - 1e-6 * length, high + 1e-6 * length), abs=1e-9 * length)


def test_limits_are_what_textbooks_give_and_a_millionth():
    lever = limits(tilted('slotted_lever'))
    swing = math.asin(80.0 / 150.0)
    assert lever['crank'] is None
    assert lever['lever'] == spare(-swing, swing) and lever['slide'] == spare(0.7, 2.3, 2.7)
    # What is wrapped is within half a turn, or has none.
    for zero, ends in (8.5, spare(8.5 - math.tau - swing, 8.5 - math.tau + swing)), (3.0, None):
        wrapped = tilted('slotted_lever', joint_names=[f'lever=-m_lever+{zero}'])
        assert limits(wrapped)['lever'] == ends
    engine = limits(tilted('slider_crank'))
    assert engine['AB'] is None
    assert engine['block'] == spare(*(
        0.01 * math.sqrt(end ** 2 - 20.0 ** 2) for end in (80.0, 160.0)), 1.2)
    assert limits(tilted('water_drop'))['CB'] == spare(math.pi / 6.0, math.pi * 5.0 / 6.0)


def test_a_crank_that_cannot_turn_ends_with_its_reach():
    end = 2.0 * math.acos(5.0 / 6.0)
    assert limits(tilted('peaucellier'))['crank'] == pytest.approx((-end, end), abs=1e-15)
    # Of two arcs no joint can have both.
    assert limits(tilted('peaucellier', dimensions__r=10.0))['crank'] == pytest.approx(
        (-2.0 * math.acos(0.25), 2.0 * math.acos(0.25)), abs=1e-15)
    later = limits(tilted('peaucellier', crank__sweep=[math.tau - 1.0, math.tau + 1.0]))
    assert later['crank'] == pytest.approx((math.tau - end, math.tau + end), abs=4e-15)
    # Nor has one of several legs.
    assert limits(tilted('peaucellier', mirrored=True))['crank'] is None


ARM = {'mechanisms': ['hand', 'arm'], 'arm.type': 'four_bar', 'hand.type': 'four_bar',
       'arm.pose': POSE, 'hand.pose': [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]}
