# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What is written of a robot model is read again: read(write(x)) = x in URDF, SDF and MJCF."""

from contextlib import suppress
from functools import cache

from linkage_ros import scene
from linkage_ros.linkage import theta_of
from linkage_ros.robot_files import readers
from linkage_ros.robot_model import bodies, mjcf, sdf, urdf
from linkage_ros.robot_model.robot import with_positions
import numpy as np
import pytest
from robots import FIRST, of_text, ROBOTS, turned
from scenes import alone, EXAMPLES
from test_robot_files import moves, random_linkage
from test_urdf import ARM

FORMATS = {'urdf': urdf.write, 'sdf': sdf.write, 'mjcf': mjcf.write}


def check_read(robot, form, folder):
    """Write a robot and compare all that is read of it: the same bodies, joints, motors, gears."""
    file = of_text(folder / 'robot.xml', FORMATS[form](robot))
    read, root = readers.read(str(file)), {'urdf': robot.root}.get(form, 'world')
    if form == 'urdf':
        # A library's parser sees the same joints; an MJCF is read by MuJoCo.
        assert {*FIRST(file.read_text()).joints} == robot.positions.keys()
        robot = with_positions(robot, dict.fromkeys(robot.positions, 0.0))
    # The pose of the ground that carries each body.
    frames, stands = ({robot.root: np.eye(4)} for _ in range(2))
    for body, (base, _) in robot.spanning_tree()[0].items():
        stands[body] = stands[base] if body not in robot.stands else \
            frames[base] @ turned(*robot.stands[body])
        frames[body] = stands[body] @ robot.frames[body]
    assert read.root == root and {*frames} - {robot.root} <= read.frames.keys()
    size = max(1e-3, *(np.abs(frame[:3, 3]).max() for frame in frames.values()))
    for name, frame in read.frames.items():
        if name in frames:
            assert name == read.root or frame[:3, :3] == pytest.approx(
                frames[name][:3, :3], abs=1e-12)
            assert frame[:3, 3] == pytest.approx(frames[name][:3, 3], abs=1e-12 * size)
    joints = {joint.name: joint for joint in read.joints}
    check_joints(robot, stands, form, read, joints, (robot.root, root), size)
    if form != 'urdf':
        check_loops(robot, form, joints, frames, size)
    assert {joint.kind for joint in joints.values()} <= {'fixed'}
    assert read.driven == (robot.driven if form != 'urdf' else [])
    assert read.follows.keys() == (robot.follows.keys() if form != 'urdf' else set())


def check_joints(robot, stands, form, read, joints, roots, size):
    """Check the joints that move, on grounds that stand in poses."""
    # In an SDF all positions are 0 where it starts.
    starts = robot.positions
    zeros = {name: 0.0 if form == 'sdf' else start for name, start in starts.items()}
    for joint in robot.joints:
        if joint.position is None:
            continue
        joint_ = joints.pop(joint.name)
        assert joint_.kind == joint.kind
        assert joint_.bodies == tuple(roots[1] if body == roots[0] else body
                                      for body in joint.bodies)
        ground = stands[joint.bodies[1]]
        for place, way in zip(joint_.places, joint_.axes):
            assert place == pytest.approx((ground @ [*joint.places[1], 1.0])[:3], abs=1e-12 * size)
            assert way == pytest.approx(ground[:3, :3] @ joint.axes[0], abs=1e-12)
        assert joint_.position == pytest.approx(zeros[joint_.name], abs=1e-15)
        shift = zeros[joint_.name] - starts[joint_.name]
        limits = joint.limits
        if form == 'urdf' and not limits and joint.kind == 'slide':
            limits = (-1e3, 1e3)
        assert joint_.limits == (pytest.approx(tuple(end + shift for end in limits), rel=1e-12)
                                 if limits else None)
    for name, (other, ratio, offset) in robot.follows.items() if form != 'urdf' else ():
        offset += ratio * (starts[other] - zeros[other]) - (starts[name] - zeros[name])
        assert read.follows[name] == (other, pytest.approx(ratio), pytest.approx(
            offset, abs=1e-12))


def check_loops(robot, form, joints, frames, size):
    """Check that loops are closed where points meet, and nothing else is."""
    homes = {joint.bodies[1]: joint.bodies[0] for joint in robot.joints}
    for cut, met in robot.meets.items():
        if form == 'mjcf':
            ball = joints.pop(cut)
            assert (ball.kind, ball.bodies, ball.is_cut) == (
                'ball', (homes[met], homes[cut]), True)
            places = ball.places
        else:
            hinge, closed = (joints.pop(f'{cut}_{end}') for end in ('hinge', 'closed'))
            assert (hinge.kind, hinge.bodies) == ('hinge', (homes[cut], cut))
            assert (closed.kind, closed.bodies) == ('fixed', (homes[met], cut))
            assert joints.pop(f'{homes[met]}={cut}').kind == 'fixed'
            assert hinge.axes[0] == pytest.approx(frames[cut][:3, 2], abs=1e-12)
            places = closed.places[0], hinge.places[0]
        for place, name in zip(places, (met, cut)):
            assert place == pytest.approx(frames[name][:3, 3], abs=1e-9 * size)


def prepared(mechanisms, form, frame_id='world'):
    return bodies.robot(mechanisms, frame_id, density=0.0 if form == 'urdf' else bodies.DENSITY)


@pytest.mark.nightly(all_but=6)
@pytest.mark.parametrize('form', FORMATS)
@pytest.mark.parametrize('config', EXAMPLES, ids=lambda config: config.stem)
def test_robots_of_the_shipped_scenes_come_back(tmp_path, config, form):
    shipped = scene.load(str(config))
    for mechanism in shipped.mechanisms.values():
        if not mechanism.in_space:
            check_read(prepared([mechanism], form, shipped.frame_id), form, tmp_path)


@pytest.mark.parametrize('form', FORMATS)
@pytest.mark.parametrize('link', ['AB_link', 'B', 'B_cut'])
def test_a_hand_on_an_arm_comes_back(tmp_path, link, form):
    mechanisms = scene.read({
        **ARM, 'hand.frame_id': f'arm_{link}', 'arm.frame_id': """x<y> & "it's" é""",
        'hand.joint_names': ['AB="a<b>& c\'d"']}).mechanisms.values()
    check_read(prepared(mechanisms, form), form, tmp_path)


@cache
def random_mechanism(seed):
    """Return a random linkage as a mechanism in a random pose, at a start where it has a pose."""
    if not (made := random_linkage(seed)):
        return None
    design, linkage, values, rng = made
    settings = {
        'pose': rng.normal(size=6).tolist(),
        **{f'branches.{key}': side for key, side in (design.branches or {}).items()},
        **{f'dimensions.{key}': value for key, value in design.dimensions.items()},
        **{f'{each.name}.start': value for each, value in zip(linkage.inputs, values)}}
    with suppress(scene.SceneError):
        # Not all of it need be in the reach.
        return alone(design.joints, **settings, **{
            f'{each.name}.sweep': [value - 0.01 * each.size, value + 0.01 * each.size]
            for each, value in zip(linkage.inputs, values)})
    return alone(design.joints, **settings)


@pytest.mark.parametrize('form', FORMATS)
@pytest.mark.parametrize('seeds', [
    range(2, 3), pytest.param(range(3, 40), marks=pytest.mark.nightly)])
def test_random_robots_come_back(tmp_path, seeds, form):
    mechanisms = [*filter(None, map(random_mechanism, seeds))]
    assert len(mechanisms) > len(seeds) // 2
    for mechanism in mechanisms:
        check_read(prepared([mechanism], form), form, tmp_path)


@pytest.mark.parametrize('form', ['sdf', 'mjcf'])
@pytest.mark.parametrize('seeds', [
    [7015], pytest.param(range(7000, 7040), marks=pytest.mark.nightly)])
def test_what_is_written_and_imported_moves_as_the_linkage(tmp_path, seeds, form):
    # In that of 7015 several bodies turn about each pin.
    moved = 0
    for mechanism in filter(None, map(random_mechanism, seeds)):
        file = of_text(tmp_path / 'robot.xml', FORMATS[form](prepared([mechanism], form)))
        values = [each.start for each in mechanism.inputs.values()]
        steps = 0.01 * np.random.default_rng(0).normal(size=(5, len(values)))
        moved += moves(mechanism.linkage, theta_of(values), readers.read(str(file)), steps,
                       before_names='m_')
    assert moved > len(seeds) // 2


@pytest.mark.parametrize('file', ['four_bar.urdf', 'boom.urdf', 'palletiser.urdf',
                                  'wheel_leg.urdf'])
def test_a_file_is_the_same_tree_when_it_is_written_again(tmp_path, file):
    check_read(readers.read(str(ROBOTS / file)), 'urdf', tmp_path)
