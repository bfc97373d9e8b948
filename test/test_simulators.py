# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Linkages with masses and closed loops, as MuJoCo has them, and read back from SDF and MJCF."""

import math
from xml.etree import ElementTree

from linkage_ros import scene
from linkage_ros.robot_files import cli as from_robot, readers
from linkage_ros.robot_model import bodies, mjcf, sdf
import numpy as np
import pytest
from robots import MuJoCo, of_text, published
from scenes import EXAMPLES, ROOT
from test_urdf import FROM_CASES, in_space, input_rows, joints_and_places, MECHANISMS

# On the way to a change point: the side seen at the start is not the one behind it.
FOLDS = {'water_drop'}
CONFIGS = [path.stem for path in EXAMPLES if path.parent.name == 'config']


def simulated(name):
    """Return a mechanism of half a metre that starts in the middle of its reach."""
    mechanism = {**MECHANISMS, **FROM_CASES}[name]()
    parameters = {**{each.name: each.value for each in mechanism.parameters if each.value != ()},
                  'm.scale': 0.5 * mechanism.scale / bodies.size(mechanism)}
    mechanism = scene.read({'mechanisms': ['m'], **parameters}).mechanisms['m']
    rows = input_rows(mechanism)
    parameters.update((f'm.{key}.start', value) for key, value in zip(
        mechanism.inputs, rows[len(rows) // 2].tolist()))
    return scene.read({'mechanisms': ['m'], **parameters}).mechanisms['m']


def some_quick(names, quick):
    return [pytest.param(name, marks=() if name in quick else pytest.mark.nightly)
            for name in names]


def mechanisms(config):
    return scene.load(str(ROOT / 'config' / f'{config}.yaml')).mechanisms


def model(mechanisms, density=bodies.DENSITY):
    return bodies.robot(mechanisms, 'world', density=density)


class Simulation(MuJoCo):
    """A model in MuJoCo that moves."""

    def places(self, names):
        return {name: self.data.body(name).xpos.copy() for name in names}

    def run(self, seconds, inputs=None):
        """Yield from time to time, with inputs at what a function of time says."""
        for step in range(round(seconds / self.model.opt.timestep)):
            if inputs:
                self.data.ctrl[:] = inputs(self.data.time)
            self.library.mj_step(self.model, self.data)
            if step % 20 == 0:
                self.library.mj_kinematics(self.model, self.data)
                yield self.data.time
        assert not self.data.warning.number.any()


@pytest.mark.parametrize('config', some_quick(CONFIGS, ('all', 'excavator')))
def test_gravity_tears_no_scene(config):
    mechanisms_ = mechanisms(config).values()
    robot, bar = Simulation(mjcf.write(model(mechanisms_))), min(map(bodies.size, mechanisms_))
    assert max(robot.open() for _ in robot.run(1.0)) < 1e-5 * bar


def follow(mechanism, robot, seconds):
    """Drive inputs through their sweeps, or a turn; return how far points are from `solve`."""
    solution = mechanism.assembly().solution(mechanism.linkage.points)
    names = [f'{mechanism.name}_{prefix}{point}' for prefix in mechanism.assembly().legs
             for point in mechanism.linkage.points]
    starts = robot.data.ctrl.copy()

    def inputs(time):
        turned = 0.5 - 0.5 * math.cos(math.pi * time / seconds)
        for start, settings in zip(starts, mechanism.inputs.values()):
            low, high = settings.sweep or (start, start + 2.0 * math.tau)
            phase = math.acos(1.0 - 2.0 * (start - low) / (high - low))
            yield low + (high - low) * (0.5 - 0.5 * math.cos(phase + math.pi * turned))

    for _ in robot.run(seconds, lambda time: [*inputs(time)]):
        solution.solve([float(robot.data.joint(mechanism.joints[name].name).qpos[0])
                        for name in mechanism.inputs])
        places = in_space(mechanism.pose, solution.rows.reshape(-1, 2))
        yield np.abs(np.array(places) - [*robot.places(names).values()]).max()


@pytest.mark.parametrize('config', some_quick(CONFIGS, ('jansen', 'rack_steering')))
def test_servos_drive_the_linkage_through_the_poses_of_solve(config):
    for mechanism in mechanisms(config).values():
        robot = Simulation(mjcf.write(model([mechanism])))
        assert max(follow(mechanism, robot, 2.0)) < 2e-3 * bodies.size(mechanism)


@pytest.mark.nightly(all_but=2)
@pytest.mark.parametrize('form', [sdf, mjcf], ids=['sdf', 'mjcf'])
@pytest.mark.parametrize('name', some_quick(
    sorted({*MECHANISMS, 'excavator', 'parallelogram arm', 'scissor lift', 'rack steering',
            'Scotch yoke', 'trammel of Archimedes', 'geared five-bar'} - FOLDS),
    ('jansen', 'boom and arm', 'boxer engine', 'Scotch yoke', 'five-bar with a gear')))
def test_a_linkage_comes_back_from_its_simulator_s_file(tmp_path, form, name):
    mechanism = simulated(name)
    built = model([mechanism])
    file = of_text(tmp_path / 'robot.xml', form.write(built))
    robot = readers.read(str(file))
    parameters, reports, still = from_robot.described(robot)
    assert not any(line.startswith('Left out') for line in reports)
    # An SDF has its zeros where it starts.
    zeros = {joint.name: joint.start if form is sdf else 0.0 for joint in built.joints}
    turns = {joint.name: joint.kind == 'hinge' for joint in built.joints}
    # Open chains, too, are joints of the whole robot.
    rest, _ = from_robot.others(robot, scene.read(parameters).mechanisms, still)
    mechanisms = scene.read({**parameters, **rest}).mechanisms.values()
    # A file has 15 digits: exactly at an end of the reach its linkage may not be assembled.
    ends = np.ravel(mechanism.first.reach) if len(mechanism.inputs) == 1 else ()
    for thetas in input_rows(mechanism, 9):
        if thetas[0] in ends:
            continue
        positions, _ = joints_and_places(mechanism, thetas)
        expected, imported = {name: positions[name] - zeros[name] for name in positions}, {}
        for each in mechanisms:
            imported.update(published(each, **{
                settings.source: expected[settings.source] for settings in each.inputs.values()}))
        for joint, value in expected.items():
            error = imported[joint] - value
            error = math.remainder(error, math.tau) if turns[joint] else error
            # At a dead point half of the digits of an angle are in its sine.
            assert error == pytest.approx(0.0, abs=1e-7), (joint, thetas)


@pytest.mark.parametrize('name', ['engine', 'boom and arm'])
def test_bodies_weigh_in_an_sdf_what_mujoco_finds_their_shapes_to_weigh(name):
    built = model([simulated(name)], density=1000.0)
    robot = Simulation(mjcf.write(built))
    links = {link.get('name'): link.find('inertial')
             for link in ElementTree.fromstring(sdf.write(built)).iter('link')}
    for body in built.bodies():
        there, link = robot.model.body(body.name), links[body.name]
        if link is None:
            # Nothing is seen of it.
            assert there.mass == 0.0
            continue
        xx, yy, zz, xy = (float(link.findtext(f'inertia/i{way}'))
                          for way in ('xx', 'yy', 'zz', 'xy'))
        assert there.mass == pytest.approx(float(link.findtext('mass')))
        assert [*there.ipos, 0.0, 0.0, 0.0] == pytest.approx(
            np.array(link.findtext('pose').split(), float), abs=1e-12)
        axes = np.zeros(9)
        robot.library.mju_quat2Mat(axes, there.iquat)
        axes = axes.reshape(3, 3)
        assert axes @ np.diag(there.inertia) @ axes.T == pytest.approx(
            np.array([[xx, xy, 0.0], [xy, yy, 0.0], [0.0, 0.0, zz]]), abs=1e-9 * zz)


def test_a_start_out_of_reach_is_refused():
    with pytest.raises(scene.SceneError, match='m.cylinder.start and .* must be where m can be'):
        model([FROM_CASES['excavator']()])
