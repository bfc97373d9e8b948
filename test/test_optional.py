# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Optional packages that are missing, or broken in any way: a sentence, or the plain way."""

from contextlib import suppress
from importlib import import_module
import re
import signal
import sys

from linkage_ros import mechanisms, optional
from linkage_ros.scene.legs import LegGroup
import numpy as np
import pytest
from scenes import ROOT

CONFIG = ROOT / 'config'
ROBOTS = ROOT / 'test' / 'robot_files'
# What a package does that is imported; an empty one has none of its names.
WAYS = {
    'missing': "raise ModuleNotFoundError('No module named NAME', name='NAME')",
    'AttributeError': 'import sys; sys.version_infos',
    'empty': '',
    'OSError': "raise OSError('libNAME.so: cannot open shared object file')"}
SCENE = str(CONFIG / 'jansen.yaml')
# Commands that cannot do without a package.
COMMANDS = {
    'render': (('matplotlib', 'PIL', 'yaml'), 'render', (
        SCENE, '--out', 'a.svg', '--size', '128x128', '--hide', 'axes,title')),
    'urdf': (('yaml',), 'robot_model', (SCENE,)),
    'c_code': (('yaml',), 'c_code', (SCENE,)),
    'from_robot': (('mujoco',), 'robot_files', (str(ROBOTS / 'four_bar.xml'),)),
    'from_robot, loops': (('yaml',), 'robot_files', (
        str(ROBOTS / 'five_bar.urdf'), '--loops', str(ROBOTS / 'five_bar_loops.yaml'))),
    'from_robot, scene': (('yaml',), 'robot_files', (str(ROBOTS / 'four_bar.sdf'),))}
# Modules that import optional packages; `test_rooms.py` holds that these are all.
MODULES = tuple(f'linkage_ros.{name}' for name in (
    'formula.llvm_code', 'render.files', 'render.layers',
    'render.picture', 'robot_files.mjcf', 'web.server'))


def write(folder, package, way):
    """Write a package that is broken in a way."""
    (folder / package).mkdir()
    (folder / package / '__init__.py').write_text(WAYS[way].replace('NAME', package) + '\n')


@pytest.fixture
def broken(tmp_path, monkeypatch):
    """Return a function that breaks a package in this process, as if nothing had imported it."""
    packages = []

    def breaks(package, way):
        write(tmp_path, package, way)
        packages.append(package)
        # What is imported comes back; machine code can be imported only once.
        with suppress(ImportError):
            import_module(package)
        for name in [*sys.modules]:
            if name.partition('.')[0] == package or name in MODULES:
                monkeypatch.delitem(sys.modules, name)
        for name in MODULES:
            parent, _, child = name.rpartition('.')
            if parent in sys.modules:
                monkeypatch.delattr(sys.modules[parent], child, raising=False)
        monkeypatch.syspath_prepend(tmp_path)
        monkeypatch.chdir(tmp_path)
    before = {*sys.modules}
    yield breaks
    for name in {*sys.modules} - before:
        if name in MODULES or name.partition('.')[0] in packages:
            del sys.modules[name]


@pytest.mark.nightly(all_but=18)
@pytest.mark.parametrize('way', WAYS)
@pytest.mark.parametrize('package, command', [
    (package, command) for command, (packages, *_) in COMMANDS.items() for package in packages])
def test_a_command_says_in_one_sentence_what_to_install(broken, capsys, package, command, way):
    room, args = COMMANDS[command][1:]
    main = import_module(f'linkage_ros.{room}.cli').main
    broken(package, way)
    assert main([*args]) == 1
    printed, error = capsys.readouterr()
    assert not printed and error.count('\n') == 1
    trouble = 'is not installed: ' if way == 'missing' else r'is installed but cannot be used \(.*'
    assert re.match(rf'{command.partition(",")[0]}: {package} {trouble}', error), error
    assert error.endswith(optional.INSTALL[package] + '\n')


@pytest.mark.parametrize('way', WAYS)
def test_the_library_computes_without_machine_code(broken, way):
    leg = mechanisms.create('jansen')
    broken('llvmlite', way)
    with pytest.raises(ImportError, match='llvmlite is .*: pip install') as caught:
        leg.accelerated()
    assert isinstance(caught.value, ModuleNotFoundError) == (way == 'missing')
    solution = LegGroup(leg, 2).solution(('G',))
    solution.solve([0.3])
    np.testing.assert_allclose(solution.rows[0], leg.solve(0.3)['G'], rtol=1e-12)


def test_a_mistake_in_a_module_is_not_hidden_behind_its_package():
    with pytest.raises(ImportError, match=r'aiohttp .* \(NameError: .*this_name') as caught, \
            optional.needs('aiohttp'):
        exec('this_name')
    assert isinstance(caught.value.__cause__, NameError)


# --- nodes, as processes -------------------------------------------------------------------------


@pytest.fixture
def harness():
    """Return the module that starts processes."""
    pytest.importorskip('rclpy')
    import ros_harness
    return ros_harness


@pytest.mark.nightly(all_but=1)
@pytest.mark.parametrize('way', WAYS)
@pytest.mark.parametrize('name', ['kinematics', 'scene'])
def test_a_node_moves_without_machine_code_and_says_why_once(harness, tmp_path, name, way):
    from sensor_msgs.msg import JointState

    write(tmp_path, 'llvmlite', way)
    # Only the legs of a walker use machine code.
    walker = tmp_path / 'walker.yaml'
    walker.write_text('/**: {ros__parameters: {mechanisms: [jansen], jansen.leg_pairs: 2}}')
    process = harness.Process(name, walker, first=tmp_path)
    try:
        with harness.Graph(process.domain) as graph:
            # One message before anybody listens.
            publisher = graph.node.create_publisher(JointState, 'crank_states', 10)
            graph.until(lambda: process.has_ended or publisher.get_subscription_count())
            publisher.publish(JointState(name=['jansen_crank'], position=[0.1]))
            answers = graph.listen(JointState, 'jansen/joint_states')
            graph.until(lambda: process.has_ended or graph.node.count_publishers(
                'jansen/joint_states'))
            assert not process.has_ended, process.end()[1]
            state = graph.crank(['jansen_crank'])([0.3], answers)
        positions = dict(zip(state.name, state.position))
        for joint, value in mechanisms.create('jansen').joint_angles(0.3).items():
            leg = '' if joint == 'crank' else 'left0_'
            assert positions[f'jansen_{leg}{joint}'] == pytest.approx(float(value))
    finally:
        process.interrupt(signal.SIGINT)
        code, printed = process.end()
    assert code == 0 and 'Traceback' not in printed
    line, = [line for line in printed.splitlines() if 'llvmlite' in line]
    level = 'INFO' if way == 'missing' else 'WARN'
    assert f'[{level}]' in line and optional.INSTALL['llvmlite'] in line


@pytest.mark.nightly(all_but=1)
@pytest.mark.parametrize('way', ['missing', 'OSError', 'empty'])
@pytest.mark.parametrize('package, name', [
    ('aiohttp', 'viewer'), ('linkage_interfaces', 'servo_inverse'),
    ('linkage_interfaces', 'scene')])
def test_a_node_that_cannot_do_without_ends_in_one_sentence(harness, tmp_path, package, name, way):
    write(tmp_path, package, way)
    process = harness.Process(name, SCENE, first=tmp_path)
    code, printed = process.end()
    lines = [line for line in printed.splitlines() if '[FATAL]' in line]
    assert code == 1 and 'Traceback' not in printed, printed
    assert len(lines) == 1 and lines[0].endswith(optional.INSTALL[package])


@pytest.mark.nightly
@pytest.mark.parametrize('name', ['crank_driver', 'kinematics'])
def test_other_nodes_start_without_the_interfaces(harness, tmp_path, name):
    write(tmp_path, 'linkage_interfaces', 'missing')
    process = harness.Process(name, SCENE, first=tmp_path)
    assert 'ready: ' in process.line()
    process.interrupt(signal.SIGINT)
    assert process.end()[0] == 0
