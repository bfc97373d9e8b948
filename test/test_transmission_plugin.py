# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0


"""
Transmissions as a hardware component has them: loaded from a library, configured and called.

The component is `test/ros2_control/component.cpp`, compiled into the library of the plugins, and
at night used with those of another package, too. ros2_control itself is a stand-in; the log is
that of ROS.
"""

from contextlib import nullcontext
import ctypes
import math
import re
import shutil
import subprocess
import weakref

from c_libraries import expected, PLUGIN, shared, STAND_IN, UNWRITTEN
from linkage_ros import scene
from linkage_ros.c_code.package import package
import numpy as np
import pytest
from scenes import DRAG
import test_transmission

pytestmark = pytest.mark.skipif(not shutil.which('g++'), reason='g++ is not installed')

ROCKER = {'rocker.type': 'four_bar', 'rocker.crank.start': 1.0}
# A motor with a gear, one that turns on, and of others: one in a sweep, a five-bar, and one that
# measures what it moves.
SCENE = {
    'mechanisms': ['knee', 'lever', 'leg', 'lift', 'drag', 'rocker'],
    'knee.type': 'custom', 'knee.crank.source': 'knee_motor', 'knee.crank.ratio': -0.1,
    'knee.crank.sweep': [-0.45, 0.7],
    'knee.joints': ['O ground 0 0', 'Q ground 0 -0.25', 'A crank O 0.045',
                    'B dyad A Q 0.25 0.036 left'],
    'drag.type': 'custom', 'drag.joints': DRAG, **ROCKER,
    **{key: value for key, value in test_transmission.SCENE.items()
       if key.partition('.')[0] in ('lever', 'leg', 'lift') and key != 'lever.loads'}}
AXES = {**test_transmission.AXES, 'knee': ({'knee_motor': 'crank'}, {'knee_QB': 'QB'}),
        **{name: ({f'{name}_crank': 'crank'}, {f'{name}_{joint}': joint})
           for name, joint in (('lift', 'crank'), ('rocker', 'QB'), ('drag', 'QB'))}}
ACTUATORS, JOINTS = ({name: axes[side] for name, axes in AXES.items()} for side in (0, 1))
KINDS = 'position', 'velocity', 'effort'
NAN = math.nan
OK, OUT_OF_REACH, SINGULAR, NOT_KNOWN = 0, 1, 2, 4


class Refused(Exception):
    """A transmission that cannot be configured."""


class Plugins:
    """The compiled packages of scenes; the first has the component that loads all of them."""

    def __init__(self, folder, scenes, compiler='g++', *flags):
        self.mechanisms, self.libraries, self.host = {}, {}, None
        for name, parameters in scenes.items():
            mechanisms = scene.read(parameters).mechanisms
            more = () if self.host else ('-include', STAND_IN / 'component.cpp', '-ldl')
            library = folder / f'lib{name}.so'
            for path, text in package(name, 'robot.yaml', [
                    (mechanism, [*JOINTS[each]])
                    for each, mechanism in mechanisms.items()]).items():
                (folder / name / path).parent.mkdir(parents=True, exist_ok=True)
                (folder / name / path).write_text(text, encoding='utf-8')
            if not library.exists():
                subprocess.run([
                    compiler, *PLUGIN, *flags, '-shared', '-fPIC',
                    folder / name / 'src' / 'plugins.cpp', '-o', library, *more], check=True)
            self.mechanisms.update(mechanisms)
            self.libraries.update(dict.fromkeys(mechanisms, (library, f'{name}_plugins')))
            self.host = self.host or ctypes.CDLL(str(library))
        self.host.component_made.restype = ctypes.c_void_p
        self.host.component_problem.restype = ctypes.c_char_p

    def component(self, name, *lines, kinds=KINDS, actuators=None, joints=None, extra=()):
        """
        Return a component with one transmission; `lines` are added to what describes it.

        Values of `extra` come after those of actuators and joints in its memory.
        """
        return Component(self, name, lines, kinds, ACTUATORS[name] if actuators is None
                         else actuators, JOINTS[name] if joints is None else joints, extra)


class Component:
    """
    A hardware component with one transmission.

    Its values are arrays `actuator` and `joint` of shape (kinds, axes); `end` deletes it.
    """

    def __init__(self, plugins, name, lines, kinds, actuators, joints, extra):
        self._host = plugins.host
        n = len(actuators)
        self._memory = np.concatenate([np.full(6 * n, NAN), np.ravel(extra), [NAN]])
        self.actuator, self.joint = self._memory[:6 * n].reshape(2, 3, n)
        self.extra = self._memory[6 * n:-1].reshape(np.shape(extra))
        described = [*lines, f'joint_handle\ttested\tstatus\t{len(self._memory) - 1}']
        for side, (what, axes) in enumerate((('actuator', actuators), ('joint', joints))):
            described += [f'{what}\t{each}\t{role}\t1\t0' for each, role in axes.items()
                          if role is not None]
            described += [
                f'{what}_handle\t{each}\t{kind}\t{(3 * side + KINDS.index(kind)) * n + i}'
                for i, each in enumerate(axes) for kind in kinds]
        library, namespace = plugins.libraries[name]
        self._made = ctypes.c_void_p(self._host.component_made(
            str(library).encode(), f'{namespace}::{name}_loader'.encode(),
            '\n'.join(described).encode(), ctypes.c_void_p(self._memory.ctypes.data)))
        if not self._made:
            raise Refused(self._host.component_problem().decode())
        self.end = weakref.finalize(self, self._host.component_ended, self._made)

    def read(self, position, velocity=0.0, effort=0.0):
        """Measure actuators; return the status and the joints' positions, velocities, efforts."""
        self.actuator[:] = np.stack(np.broadcast_arrays(position, velocity, effort)).reshape(3, -1)
        self.joint[:] = UNWRITTEN
        return self.transmit('read'), self.joint.copy()

    def write(self, position=NAN, velocity=NAN, effort=NAN):
        """Command joints; return the status and the actuators' positions, velocities, efforts."""
        self.joint[:] = [np.broadcast_to(each, self.joint.shape[1]) for each in (
            position, velocity, effort)]
        self.actuator[:] = UNWRITTEN
        return self.transmit('write'), self.actuator.copy()

    def transmit(self, how):
        """Read or write what is in the memory; return the status."""
        getattr(self._host, f'component_{how}')(self._made)
        return int(self._memory[-1])


@pytest.fixture(scope='session')
def plugins(tmp_path_factory):
    """Return the compiled packages."""
    with shared(tmp_path_factory, 'plugins') as folder:
        return Plugins(folder, {'robot_transmissions': SCENE})


def poses(mechanism, *inputs):
    """Return the actuators' and the joints' positions at inputs, from Python."""
    return expected(mechanism, inputs, JOINTS[mechanism.name].values())[::2]


INPUTS = {'knee': [(0.3,), (-0.4,)], 'lever': [(0.1,), (-0.3,)], 'leg': [(1.9, 1.24), (1.8, 1.4)],
          'lift': [(0.5,), (1.2,)], 'rocker': [(1.0,), (2.5,)]}
# A turn from what is in the sweep of an input is not in it.
UNREACHABLE = {'knee': 9.0, 'lever': 1.5, 'leg': [1.9, -0.2], 'lift': 0.5 + math.tau,
               'rocker': 9.0}


def test_an_effort_that_would_be_infinite_is_zero(plugins):
    mechanism, component = plugins.mechanisms['lift'], plugins.component('lift')
    (_, dead), *_ = mechanism.linkage.extremes('QB')[0]
    for crank, status_ in ((0.5, OK), (dead, SINGULAR)):
        component.read(poses(mechanism, crank)[0])
        status, (*_, effort) = component.write(effort=5.0)
        assert status & SINGULAR == status_ and (effort == 0.0) == bool(status_)


def test_inputs_are_nearest_to_the_newest_position_and_efforts_at_the_measured_one(plugins):
    # The motor turns on by commands alone: none of them goes back by a turn.
    mechanism, component = plugins.mechanisms['drag'], plugins.component('drag')
    component.read(0.0)
    for crank in np.arange(0.0, 20.0, 0.25):
        assert component.write(poses(mechanism, crank)[1])[1][0] == pytest.approx(crank, abs=1e-9)
    mechanism, component = plugins.mechanisms['lever'], plugins.component('lever')
    component.read(poses(mechanism, 0.2)[0])
    # A velocity or an effort without a position is at the newest pose.
    for crank in (0.1, -0.2):
        actuator, joint = poses(mechanism, crank)
        rate = float(mechanism.linkage.joint_rates(crank, ['lever'])['lever'])
        component.write(joint)
        _, (_, velocity, effort) = component.write(NAN, 1.0, 3.0)
        assert velocity == pytest.approx(1.0 / -rate / -0.5, rel=1e-9)
        assert effort == pytest.approx(3.0 * rate * 0.5, rel=1e-9)
    # With a position, too, an effort is at the measured pose.
    there = poses(mechanism, 0.1)
    component.write(there[1])
    component.read(actuator)
    _, (position, _, effort) = component.write(there[1], effort=3.0)
    assert position == pytest.approx(there[0]) and effort == pytest.approx(3.0 * rate * 0.5)


def test_a_motor_in_one_memory_for_states_and_commands_stays(plugins):
    mechanism, component = plugins.mechanisms['leg'], plugins.component('leg', kinds=('position',))
    actuator, _ = poses(mechanism, 1.9, 1.24)
    component.actuator[0] = actuator
    for _ in range(100):
        component.transmit('read')
        component.transmit('write')
    assert component.actuator[0] == pytest.approx(actuator, abs=1e-12)


@pytest.mark.parametrize('name', INPUTS)
def test_any_history_of_values_moves_a_motor_to_what_was_commanded(plugins, name):
    """Random calls, against a model: a motor gets nothing, a solution, or where it stays."""
    component, rng = plugins.component(name), np.random.default_rng(3)
    mechanism, (low, high) = plugins.mechanisms[name], np.array(INPUTS[name])
    # Where motors were last commanded or measured, and joints last measured.
    held, measured = np.full(len(low), NAN), np.full(len(low), UNWRITTEN)
    for _ in range(300):
        inputs = low + rng.uniform(0.0, 1.0, len(low)) * (high - low)
        actuator, joint = poses(mechanism, *inputs)
        is_missing = np.arange(len(low)) == rng.integers(len(low))
        kind = rng.integers(6)
        if kind == 0:
            status, (position, *_) = component.read(actuator)
            assert status == OK and position == pytest.approx(joint, abs=1e-12)
            held, measured = actuator, position
        elif kind == 1:
            # A state is never a command; motors that are measured hold without the others.
            held = np.where(is_missing, held, actuator)
            status, (position, velocity, _) = component.read(np.where(is_missing, NAN, actuator))
            assert status & NOT_KNOWN and (position == measured).all()
            assert (velocity == (UNWRITTEN if measured[0] == UNWRITTEN else 0.0)).all()
        elif kind == 2:
            status, (position, *_) = component.write(joint)
            assert status & OUT_OF_REACH == 0
            assert position == pytest.approx(actuator, abs=1e-9)
            held = position
        elif kind == 3:
            partial = np.where(is_missing, rng.choice([NAN, math.inf]), joint)
            status, written = component.write(partial, effort=partial)
            assert status & NOT_KNOWN and (written == UNWRITTEN).all()
        elif kind == 4:
            # Of one quantity alone.
            values = np.full((3, len(low)), NAN)
            row = rng.integers(3)
            values[row] = joint
            status, written = component.write(*values)
            assert status & NOT_KNOWN and (np.delete(written, row, 0) == UNWRITTEN).all()
            held = held if row else written[0]
        else:
            status, (position, velocity, _) = component.write(UNREACHABLE[name], 1.0)
            assert status & OUT_OF_REACH and not velocity[np.isfinite(held)].any()
            assert (position == np.where(np.isfinite(held), held, UNWRITTEN)).all()


def test_a_singular_pose_of_positions_alone_is_not_told(plugins):
    mechanism = plugins.mechanisms['rocker']
    dead = mechanism.linkage.extremes('QB')[0][0][1]
    for kinds, status_ in ((('position',), OK), (KINDS, SINGULAR)):
        component = plugins.component('rocker', kinds=kinds)
        assert component.read(poses(mechanism, dead)[0])[0] == status_


JOINT, MOTOR = 'joint_handle\tknee_QB', 'actuator_handle\tknee_motor'


@pytest.mark.parametrize('name, lines, given, reason', [
    # Roles are the names of the linkage; without one, the scene's name counts.
    ('knee', [], {'actuators': {'left_motor': 'crank'}, 'joints': {'left_knee': 'QB'}}, ''),
    ('knee', [], {'actuators': {'knee_motor': ''}, 'joints': {'knee_QB': ''}}, ''),
    ('knee', [], {'joints': {'left_knee': 'AB'}}, "joint 'knee_QB' is missing"),
    ('knee', [], {'joints': {'knee_QB': 'banana'}}, "role 'banana', is none of"),
    ('leg', [], {'actuators': {'a': 'crank2', 'b': 'crank'}}, ''),
    ('leg', [], {'actuators': {'a': 'crank', 'b': 'crank'}}, "'b', role 'crank', is"),
    ('knee', ['joint\tother\tQB\t1\t0'], {}, "'knee_QB', role 'QB', is none of"),
    # What ros2_control adds to hardware of type "actuator".
    ('knee', ['actuator_handle\tactuator1\tposition\t0'],
     {'actuators': {'knee_motor': 'crank', 'actuator1': 'actuator1'}}, ''),
    ('leg', [], {'actuators': {'leg_crank': 'crank', 'actuator1': 'actuator1'}}, 'is missing'),
    # Handles of others.
    ('knee', ['actuator_handle\telbow\tposition\t0'], {}, ''),
    # Each interface: one handle, on all axes or on none.
    ('knee', [f'{JOINT}\tposition\t5'], {}, "joint 'knee_QB' has several handles for position"),
    ('knee', [f'{JOINT}\ttorque\t5'], {}, ''),
    ('knee', [f'{JOINT}\tvelocity\t0'], {}, 'need a handle for velocity'),
    ('knee', [f'{MOTOR}\teffort\t0'], {'kinds': ['position']}, 'need a handle for effort'),
    ('knee', [], {'kinds': ['effort']}, 'need a handle for position'),
    # A handle without a value is none.
    ('knee', [f'{JOINT}\tvelocity\t', f'{MOTOR}\tvelocity\t0'], {}, 'a handle for velocity'),
    # A reduction that cannot be, and other lengths.
    *(('knee', [f'joint\tknee_QB\tQB\t{numbers}'], {'joints': {}},
       "joint 'knee_QB' needs a finite offset")
      for numbers in ('0\t0', 'nan\t0', 'inf\t0', '1\tnan')),
    ('lever', ['parameter\ta\t90'], {}, 'it has no parameters: write the package again')])
def test_axes_and_handles_are_checked(plugins, name, lines, given, reason):
    with pytest.raises(Refused, match=re.escape(reason)) if reason else nullcontext():
        plugins.component(name, *lines, **{'kinds': ('position', 'effort'), **given})


def test_a_robot_has_its_own_gears_and_encoder_zeros(plugins):
    """Of the built-in transmissions: joint = actuator / reduction + offset, both ways."""
    plain, rng = plugins.component('leg'), np.random.default_rng(8)
    reductions, offsets = rng.uniform(-3.0, 3.0, (2, 2)), rng.uniform(-1.0, 1.0, (2, 2))
    names = {'actuator': {'a': 'crank', 'b': 'crank2'}, 'joint': {'c': 'crank', 'd': 'AP'}}
    geared = plugins.component('leg', *(
        f'{kind}\t{name}\t{role}\t{reduction!r}\t{offset!r}'
        for (kind, axes), *numbers in zip(names.items(), reductions.tolist(), offsets.tolist())
        for (name, role), reduction, offset in zip(axes.items(), *numbers)),
        actuators=dict.fromkeys('ab'), joints=dict.fromkeys('cd'))

    def of_robot(values, side):
        """Return what the robot has for values of the scene."""
        factor = reductions[side] if side == 0 else 1.0 / reductions[side]
        position, velocity, effort = values
        return np.array([position * factor + offsets[side], velocity * factor, effort / factor])

    for side, (call, position) in enumerate(zip(('read', 'write'), poses(
            plugins.mechanisms['leg'], 1.9, 1.24))):
        values = np.array([position, [0.3, -0.2], [2.0, 5.0]])
        _, seen = getattr(plain, call)(*values)
        status, written = getattr(geared, call)(*of_robot(values, side))
        assert status == OK
        np.testing.assert_allclose(written, of_robot(seen, 1 - side), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize('name', ['knee', 'leg', 'lever'])
@pytest.mark.parametrize('renamed', [False, True])
def test_passive_joints_have_states_where_there_are_handles(plugins, name, renamed):
    mechanism, inputs = plugins.mechanisms[name], INPUTS[name][1]
    passive = [link.name for link in mechanism.linkage.links
               if link.name not in JOINTS[name].values()]
    actuator, by, positions, rates = expected(mechanism, inputs, passive)
    called = [f'{name}_{link}' for link in passive]
    n, count, (factor, offset) = len(inputs), len(passive), (-2.0, 0.3) if renamed else (1.0, 0.0)
    lines = [f'joint\t{own}\t{link}\t{factor}\t{offset}'
             for own, link in zip(called, passive)] if renamed else []
    component = plugins.component(
        name, *lines, *(f'joint_handle\t{own}\t{kind}\t{6 * n + row * count + i}'
                        for i, own in enumerate(called)
                        for row, kind in enumerate(('position', 'velocity'))),
        extra=np.full((2, count), UNWRITTEN))
    speeds = np.arange(1.0, n + 1.0)
    status, _ = component.read(actuator, by @ speeds, 0.0)
    assert status == OK
    np.testing.assert_allclose(component.extra, [
        positions / factor + offset, rates @ speeds / factor], atol=1e-9)
    # What cannot be measured is held, and stands still; a command is no state.
    before = component.extra.copy()
    component.write(poses(mechanism, *INPUTS[name][0])[1], 1.0)
    assert np.array_equal(component.extra, before)
    status, _ = component.read(NAN, NAN)
    assert status & NOT_KNOWN and np.array_equal(component.extra[0], before[0])
    assert not component.extra[1].any()
    component.read(actuator, by @ speeds)
    assert np.array_equal(component.extra, before)


def test_a_passive_joint_faster_than_a_number_can_be_stands_still(plugins):
    """All that is commanded can be had."""
    actuator, by, _, turning = expected(plugins.mechanisms['leg'], INPUTS['leg'][1])
    component = plugins.component('leg', 'joint_handle\tleg_CP\tvelocity\t12', extra=[UNWRITTEN])
    for speeds in ([0.3, 0.2], [0.0, 1.2e308]):
        status, (_, velocity, _) = component.read(actuator, by @ speeds)
        assert status == OK and velocity == pytest.approx(turning @ speeds)
        assert (component.extra[0] == 0.0) == (speeds[1] > 1.0)


@pytest.mark.nightly
@pytest.mark.parametrize('compiler', test_transmission.COMPILERS)
def test_packages_are_beside_each_other(tmp_path, compiler):
    # Optimized, as a user compiles it, gcc warns of more.
    plugins = Plugins(tmp_path, {'robot_transmissions': SCENE, 'other_transmissions': {
        'mechanisms': ['rocker'], **ROCKER}}, compiler, '-O2', '-fvisibility=hidden')
    for name in ('knee', 'rocker'):
        component = plugins.component(name)
        assert component.read(poses(plugins.mechanisms[name], *INPUTS[name][0])[0])[0] == OK
        assert component.write(9.0)[0] & OUT_OF_REACH
