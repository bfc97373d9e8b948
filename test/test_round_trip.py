# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is written of a robot model is read again: read(write(x)) = x in URDF, SDF and MJCF."""

from contextlib import suppress
import math
from pathlib import Path

from linkage_ros import mechanisms, scene
from linkage_ros.robot_files import model, readers
from linkage_ros.robot_model import bodies, mjcf, sdf, urdf
from linkage_ros.robot_model.assembled import assembled
import numpy as np
import pytest
from sweeps import EXHAUSTIVE
from test_robot_files import random_urdf, ROBOTS
from truth import random_linkages

CONFIGS = sorted(Path(__file__).parents[1].glob('config/*.yaml'))
FORMATS = {'urdf': urdf.write, 'sdf': sdf.write, 'mjcf': mjcf.write}


def matrix(numbers):
    """Return a pose as a matrix: about the fixed axes x, y and z in turn."""
    made = np.eye(4)
    for angle, (i, j) in zip(numbers[3:], ((1, 2), (2, 0), (0, 1))):
        turn = np.eye(4)
        turn[i, i] = turn[j, j] = math.cos(angle)
        turn[j, i], turn[i, j] = math.sin(angle), -math.sin(angle)
        made = turn @ made
    made[:3, 3] = numbers[:3]
    return made


def motion(joint, position):
    """Return the displacement of a body by its joint: Rodrigues' formula."""
    made, axis = np.eye(4), np.array(joint.axis) / np.linalg.norm(joint.axis)
    if joint.kind == 'prismatic':
        made[:3, 3] = position * axis
        return made
    for k, unit in enumerate(np.eye(3)):
        made[:3, k] = (unit * math.cos(position) + np.cross(axis, unit) * math.sin(position)
                       + axis * (axis @ unit) * (1.0 - math.cos(position)))
    return made


def check_read(robot, form, folder):
    """Write a robot model and compare all that is read of it."""
    file = folder / 'robot.xml'
    file.write_text(FORMATS[form](robot), encoding='utf-8')
    read = readers.read(str(file))
    frames, homes = {robot.root: np.eye(4)}, {}
    root = {'urdf': robot.root}.get(form, 'world')
    frames[root] = np.eye(4)
    for body in robot.bodies:
        frames[body.name] = frames[body.parent] @ matrix(body.pose) @ (
            motion(body.joint, body.position) if body.joint else np.eye(4))
        for point in body.points:
            homes[point.name] = body.name
            frames[point.name] = frames[body.name] @ matrix([*point.place, *[0.0] * 4])
    size = max(1e-3, *(np.abs(frame[:3, 3]).max() for frame in frames.values()))
    for name, frame in read.frames.items():
        if name in frames:
            assert name == read.root or frame[:3, :3] == pytest.approx(
                frames[name][:3, :3], abs=1e-12)
            assert frame[:3, 3] == pytest.approx(frames[name][:3, 3], abs=1e-12 * size)
    assert read.root == root and {body.name for body in robot.bodies} <= read.frames.keys()
    # In an SDF all positions are 0 where it starts.
    zeros = {body.joint.name: 0.0 if form == 'sdf' else body.position
             for body in robot.bodies if body.joint}
    starts = {body.joint.name: body.position for body in robot.bodies if body.joint}
    sweeps = {motor.joint: motor.sweep for motor in robot.motors}
    joints = {joint.name: joint for joint in read.joints}
    for body in robot.bodies:
        if body.joint is None:
            continue
        found, frame = joints.pop(body.joint.name), frames[body.name]
        parent = root if body.parent == robot.root else body.parent
        assert found.kind == {'revolute': 'hinge', 'prismatic': 'slide'}[body.joint.kind]
        assert found.bodies == (parent, body.name)
        axis = frame[:3, :3] @ body.joint.axis / np.linalg.norm(body.joint.axis)
        for place, way in zip(found.places, found.axes):
            assert place == pytest.approx(frame[:3, 3], abs=1e-12 * size)
            assert way == pytest.approx(axis, abs=1e-12)
        assert found.position == pytest.approx(zeros[found.name], abs=1e-15)
        ends = body.joint.travel if form == 'urdf' else sweeps.get(found.name)
        shift = zeros[found.name] - starts[found.name]
        assert found.limits == (pytest.approx(tuple(end + shift for end in ends), rel=1e-12)
                                if ends else None)
    if form == 'urdf':
        assert {joint.kind for joint in joints.values()} <= {'fixed'}
        return
    assert read.driven == [motor.joint for motor in robot.motors]
    assert read.follows.keys() == robot.gears.keys()
    for name, (other, ratio) in robot.gears.items():
        assert read.follows[name] == (other, pytest.approx(ratio), pytest.approx(
            zeros[name] - ratio * zeros[other], abs=1e-12))
    check_loops(robot, form, joints, frames, homes, size)


def check_loops(robot, form, joints, frames, homes, size):
    """Check that loops are closed where points meet, and nothing else is."""
    cuts = [point for body in robot.bodies for point in body.points if point.meets]
    for point in cuts:
        ends, places = (homes[point.meets], homes[point.name]), None
        if form == 'mjcf':
            cut = joints.pop(point.name)
            assert (cut.kind, cut.bodies, cut.is_cut) == ('ball', ends, True)
            places = cut.places
        else:
            pin = f'{point.name}_pin'
            hinge, closed = (joints.pop(f'{point.name}_{end}') for end in ('hinge', 'closed'))
            assert (hinge.kind, hinge.bodies) == ('hinge', (ends[1], pin))
            assert (closed.kind, closed.bodies) == ('fixed', (ends[0], pin))
            assert joints.pop(f'{ends[0]}={pin}').kind == 'fixed'
            assert hinge.axes[0] == pytest.approx(frames[ends[1]][:3, 2], abs=1e-12)
            places = closed.places[0], hinge.places[0]
        for place, name in zip(places, (point.meets, point.name)):
            assert place == pytest.approx(frames[name][:3, 3], abs=1e-9 * size)
    assert {joint.kind for joint in joints.values()} <= {'fixed'}


def prepared(machines, form, frame_id='world'):
    robot = bodies.robot(machines, frame_id)
    return robot if form == 'urdf' else assembled(robot)


@pytest.mark.parametrize('form', FORMATS)
@pytest.mark.parametrize('config', CONFIGS, ids=lambda config: config.stem)
def test_robots_of_the_shipped_scenes_come_back(tmp_path, config, form):
    if form == 'mjcf':
        pytest.importorskip('mujoco')
    given = scene.load(str(config))
    for machine in given.machines.values():
        if not machine.in_space:
            check_read(prepared([machine], form, given.frame_id), form, tmp_path)


def random_machine(seed):
    """Return a random linkage as a mechanism in a random pose, at a start where it has a pose."""
    rng = np.random.default_rng(seed)
    design = random_linkages.design(rng)
    try:
        linkage = mechanisms.create('custom', joints=design.joints, branches=design.branches,
                                    **design.dimensions)
    except ValueError:
        return None
    for _ in range(30 if 1e-3 < linkage.longest < 1e3 else 0):
        values = [rng.uniform(max(each.low, -12.0), min(each.high, 12.0))
                  for each in linkage.inputs]
        if not any(np.isnan(place).any() for place in linkage.solve(
                values if len(values) > 1 else values[0]).values()):
            given = {
                'mechanisms': ['m'], 'm.type': 'custom', 'm.joints': design.joints,
                'm.pose': rng.normal(size=6).tolist(),
                **{f'm.branches.{key}': side for key, side in (design.branches or {}).items()},
                **{f'm.dimensions.{key}': value for key, value in design.dimensions.items()},
                **{f'm.{each.name}.start': value for each, value in zip(linkage.inputs, values)}}
            with suppress(scene.SceneError):
                # Not all of it need be in the reach.
                return scene.read({**given, **{
                    f'm.{each.name}.sweep': [value - 0.01 * each.size, value + 0.01 * each.size]
                    for each, value in zip(linkage.inputs, values)}}).machines['m']
            return scene.read(given).machines['m']
    return None


@pytest.mark.parametrize('form', FORMATS)
@pytest.mark.parametrize('seeds', [range(2, 9), pytest.param(range(9, 200), marks=EXHAUSTIVE)])
def test_random_robots_come_back(tmp_path, seeds, form):
    if form == 'mjcf':
        pytest.importorskip('mujoco')
    machines = [*filter(None, map(random_machine, seeds))]
    assert len(machines) > len(seeds) // 2
    for machine in machines:
        check_read(prepared([machine], form), form, tmp_path)


@pytest.mark.parametrize('form', FORMATS)
@pytest.mark.parametrize('seed', range(8))
def test_random_trees_of_a_file_come_back_in_each_format(tmp_path, seed, form):
    if form == 'mjcf':
        pytest.importorskip('mujoco')
    file = tmp_path / 'tree.urdf'
    file.write_text(random_urdf(np.random.default_rng(seed))[0])
    robot = model.drawn(readers.read(str(file)))
    for body in robot.bodies:
        # What moves in MuJoCo weighs something.
        body.pieces.append(bodies.Piece(bodies.BALL, 'joint', 0.1, (0.0, 0.0), (0.1, 0.0)))
    robot.density = 1000.0
    check_read(robot, form, tmp_path)


@pytest.mark.parametrize('file', ['four_bar.urdf', 'boom.urdf', 'palletiser.urdf',
                                  'wheel_leg.urdf'])
def test_a_file_is_the_same_tree_when_it_is_written_again(tmp_path, file):
    check_read(model.drawn(readers.read(str(ROBOTS / file))), 'urdf', tmp_path)
