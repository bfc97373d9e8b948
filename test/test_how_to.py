# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The pages to follow: their files are saved, their commands run, and what they say is so."""

import doctest
import math
import os
from pathlib import Path
from pkgutil import resolve_name
import re
import shlex
import subprocess
import sys
import textwrap
from xml.etree import ElementTree

from linkage_ros import mechanisms, scene
import pytest
from ros_harness import Process
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from truth.working_modes import lever_of
import yaml

ROOT = Path(__file__).parents[1]
DOCS = ROOT / 'docs'
# Pages that are followed step by step.
FOLLOWED = ['first-ten-minutes', 'tutorial', 'commands', 'robot-files', 'rods', *(
    f'how-to/{page.stem}' for page in (DOCS / 'how-to').glob('*.md') if page.stem != 'index')]
BLOCK = re.compile(r'(?:`([\w.]+)`:\n\n)?^```(\w+)\n(.*?)^```', re.MULTILINE | re.DOTALL)
NODES = {name: f'linkage_ros.nodes.{name}:{name.title().replace("_", "")}'
         for name in ('kinematics', 'crank_driver', 'servo_inverse')}
COMMANDS = {'from_robot': 'robot_files.cli', 'transmission': 'c_code.transmission', **{
    f'linkage_ros.{name}': f'{name}.cli' for name in ('robot_model', 'c_code', 'render')}}


class Reader:
    """Somebody who types what a page says."""

    def __init__(self, graph, capsys):
        self._graph, self._capsys = graph, capsys
        self._nodes, self._python = {}, {}
        self.received = []

    def follow(self, page):
        """Save the files of a page, run its commands; return the result of the last one."""
        result = None
        for file, language, text in BLOCK.findall((DOCS / f'{page}.md').read_text()):
            if file:
                Path(file).write_text(text)
            if language == 'console':
                text = re.sub(r'\\\n *', '', text)
                for line, printed in re.findall(r'^\$ (.*)\n((?:[^$].*\n)*)', text, re.MULTILINE):
                    result = self._type(line, printed)
            elif language == 'python' and '>>>' in text:
                test = doctest.DocTestParser().get_doctest(text, self._python, page, page, 0)
                assert not doctest.DocTestRunner().run(test, clear_globs=False).failed
                self._python = test.globs
            elif language == 'python':
                exec(compile(text, page, 'exec'), {})
        return result

    def _type(self, line, printed):
        line, _, file = line.replace('$PWD', str(Path.cwd())).partition(' > ')
        words = shlex.split(re.sub(r'timeout 5 | --once| -r \d+| &$', '', line))
        match words:
            case ['make' | 'rviz2', *_] | ['ros2', 'launch', *_]:
                return None  # whether there is such a thing is known to test_docs.py
            case ['ros2', 'topic', 'echo', topic]:
                return self._echo(topic, wait=not line.endswith('&'))
            case ['ros2', 'topic', 'pub', topic, type_, text]:
                publisher = self._graph.node.create_publisher(message_type(type_), topic, 10)
                message = message_type(type_)(**yaml.safe_load(text))
                return self._graph.until(lambda: self.received or publisher.publish(message))[0]
            case ['ros2', 'param', 'set', node, name, value]:
                result = self._graph.set(self._nodes[node], **{name: yaml.safe_load(value)})
                assert result.successful, result.reason
                return result
            case ['ros2', 'service', 'call', name, type_, text]:
                service = message_type(type_)
                client = self._graph.node.create_client(service, name)
                return self._graph.call(client, service.Request(**yaml.safe_load(text)))
            case ['ros2', 'run', 'linkage_ros', name, *args] if name in NODES:
                node = self._graph.start(resolve_name(NODES[name]), cli_args=args)
                self._nodes[node.get_fully_qualified_name()] = node
                return node
            case ['ros2', 'run', 'linkage_ros', name, *args] | ['python', '-m', name, *args]:
                assert resolve_name(f'linkage_ros.{COMMANDS[name]}:main')(args) == 0
                output = self._capsys.readouterr().out
                if file:
                    Path(file).write_text(output)
                assert printed in ('', output)
                return output
        assert subprocess.run(
            words, check=True, timeout=60, text=True, stdout=subprocess.PIPE).stdout == printed

    def _echo(self, topic, wait):
        types = self._graph.until(
            lambda: dict(self._graph.node.get_topic_names_and_types()).get(topic))
        self.received = self._graph.listen(message_type(types[0]), topic)
        return self._graph.until(lambda: self.received)[0] if wait else None


def message_type(type_):
    """Return a type of messages or services by its name."""
    package, kind, name = type_.split('/')
    return resolve_name(f'{package}.{kind}:{name}')


@pytest.fixture
def reader(graph, capsys, monkeypatch, tmp_path):
    """Return a reader in a folder with `examples/` in it."""
    pytest.importorskip('linkage_interfaces')
    (tmp_path / 'examples').symlink_to(ROOT / 'examples')
    monkeypatch.chdir(tmp_path)
    return Reader(graph, capsys)


def test_every_page_of_this_kind_is_tried():
    text = Path(__file__).read_text()
    assert not [page for page in FOLLOWED if f"'{page}')" not in text]


def test_the_first_ten_minutes(reader):
    pytest.importorskip('matplotlib')
    answer = reader.follow('first-ten-minutes')
    assert answer.success and len(answer.servo_angle) == 1
    assert Path('walker.png').stat().st_size > 10_000


@pytest.mark.nightly
def test_the_gripper_of_the_tutorial(reader):
    pytest.importorskip('matplotlib')
    page, header = (DOCS / 'tutorial.md').read_text(), reader.follow('tutorial')
    declared, call = re.findall(r'`(float .*?;)`.*`(lkr_inverse\(.*?\))`', page)[0]
    Path('try.c').write_text(f'#include <stdio.h>\n{header}int main(void) {{ {declared} return '
                             f'!({call} && printf("%.4f", drive)); }}')
    subprocess.run(['cc', 'try.c', '-o', 'try', '-lm'], check=True)
    assert subprocess.check_output('./try', text=True) == '-0.4855' and ' -0.4855 rad' in page
    assert Path('gripper.png').stat().st_size > 10_000
    # The picture at its head is of what it ends with.
    written, drawn = (yaml.safe_load(file.read_text())
                      for file in (Path('gripper.yaml'), ROOT / 'pictures/gripper.yaml'))
    assert written == drawn


def test_an_encoder_behind_a_belt(graph, reader):
    states = graph.listen(JointState, 'joint_states', 100)
    reader.follow('how-to/encoder')

    graph.until(lambda: {name for state in states for name in state.name} >= {
        'belt_encoder', 'press_QB'})
    crank = [dict(zip(state.name, state.position)).get('press_crank', 1.0) for state in states]
    assert 0.6 <= min(crank) <= max(crank) <= 2.6


def test_the_transmission_of_a_knee_is_pasted_as_it_was_printed(reader):
    reader.follow('how-to/transmission')
    printed = Path('leg_transmissions/urdf/transmissions.xml').read_text().partition('-->\n')[2]
    assert textwrap.indent(printed, '  ') in Path('control.urdf').read_text()


def test_a_flap_is_put_where_a_planner_wants_it(reader):
    reader.follow('commands')
    command = reader.received[0]
    assert command.name == ['servo']
    assert 0.1 - lever_of(0.5 * command.position[0]) == pytest.approx(0.2, abs=1e-12)


@pytest.mark.nightly
def test_an_ankle_on_two_rods(graph, reader):
    states = graph.listen(JointState, 'joint_states', 100)
    assert 'lkr_model ankle_model' in reader.follow('rods')
    graph.until(lambda: {name for state in states for name in state.name} >= {
        'ankle_pitch', 'ankle_roll', 'motor_left', 'motor_right'})


@pytest.mark.nightly
def test_an_ankle_in_a_training_loop(reader):
    pytest.importorskip('torch', reason='torch is not installed')
    reader.follow('how-to/training')  # it asserts what it computes


def test_a_boom_on_a_cylinder(graph, reader):
    states = graph.listen(JointState, 'joint_states', 100)
    command = reader.follow('how-to/cylinder')
    assert command.name == ['boom_stroke'] and 0.0 <= command.position[0] <= 0.6

    # Sensor and boom, by their common stamp: the law of cosines has the boom's angle to O -> P.
    def pairs():
        strokes, booms = ({state.header.stamp.nanosec: state.position[state.name.index(name)]
                           for state in states if name in state.name}
                          for name in ('boom_stroke', 'boom_OB'))
        return [(strokes[stamp], booms[stamp]) for stamp in strokes.keys() & booms.keys()]

    graph.until(lambda: len(pairs()) > 9)
    base = math.hypot(0.5, 0.2)
    for stroke, angle in pairs():
        corner = math.acos((base**2 + 1.1**2 - (stroke + 0.9)**2) / (2.0 * base * 1.1))
        assert angle == pytest.approx(math.atan2(-0.2, 0.5) + corner, abs=1e-12)


def test_two_robots_of_one_kind(graph, reader):
    from visualization_msgs.msg import MarkerArray

    sides = 'left', 'right'
    marked = {side: graph.listen(MarkerArray, f'/{side}/arm/markers') for side in sides}
    reader.follow('how-to/several-robots')
    graph.until(lambda: all(marked.values()))
    assert all(marked[side][0].markers[0].header.frame_id == f'{side}/base' for side in sides)


def test_robots_of_each_format(reader):
    pytest.importorskip('mujoco')
    reader.follow('robot-files')
    lid = scene.load('lid.yaml').mechanisms['motor']
    # The lid is closed in the pose of its file, in which all joints are at zero.
    angles = lid.linkage.joint_angles(lid.first.offset)
    names = {called.name: called.of(angles[link]) for link, called in lid.joints.items()
             if called.published}
    assert names == pytest.approx({'pin': 0.0, 'eye': 0.0, 'hinge': 0.0}, abs=1e-12)
    # A scene says how to start its whole robot.
    line = Path('leg_found.yaml').read_text().splitlines()[1]
    assert line.startswith('# ros2 launch linkage_ros robot.launch.py robot:=examples/leg.urdf')


def test_coordinates_of_a_drawing(reader):
    reader.follow('how-to/cad-export')


def test_ros2_control_moves_the_motors_of_the_scene(graph, reader):
    mechanisms = reader.follow('how-to/ros2-control').scene.mechanisms
    sources = {name: [mechanism.first.source] for name, mechanism in mechanisms.items()}
    motors = [motor for listed in sources.values() for motor in listed]
    controllers = yaml.safe_load(Path('controllers.yaml').read_text())
    control, robot = map(ElementTree.parse, ('control.urdf', 'examples/leg.urdf'))
    assert {name: controllers[name]['ros__parameters']['joints'] for name in mechanisms} == sources
    assert [joint.get('name') for joint in control.iter('joint')] == motors
    assert {*motors} < {joint.get('name') for joint in robot.iter('joint')}

    # What is wanted of the knee becomes a command, which puts the knee there.
    commands, answers = graph.listen(Float64MultiArray, 'knee/commands'), []
    graph.node.create_subscription(
        JointState, 'joint_states', lambda m: 'knee' in m.name and answers.append(m), 10)
    publisher = graph.node.create_publisher(JointState, 'wanted_states', 10)
    graph.until(lambda: commands or publisher.publish(JointState(name=['knee'], position=[0.9])))
    state = graph.crank(['knee_motor'], 'joint_states')(commands[0].data, answers)
    assert state.position[state.name.index('knee')] == pytest.approx(0.9, abs=1e-12)


@pytest.mark.nightly
def test_the_example_without_the_ros2_command_line_works():
    with Process('scene', ROOT / 'config' / 'all.yaml') as running:
        done = subprocess.run(
            [sys.executable, ROOT / 'examples' / 'without_ros2.py'], text=True,
            capture_output=True, timeout=60.0,
            env={**os.environ, 'ROS_DOMAIN_ID': str(running.domain)})
    assert done.returncode == 0, done.stderr
    names, changed, angle = done.stdout.splitlines()
    assert "'jansen_BC'" in names and 'successful=True' in changed
    lever = mechanisms.create('slotted_lever').servo_angle(0.2)
    assert float(re.search(r'\[([0-9.]+)\]', angle)[1]) == pytest.approx(lever, abs=1e-12)


# --- the recipes of docs/design/architecture.md, in a copy of it all ---

def steps(title):
    """Return the numbered steps of a recipe, each with the code under it."""
    page = (DOCS / 'design' / 'architecture.md').read_text()
    recipe = page.partition(f'### {title}\n')[2].partition('\n##')[0]
    blocks_ = []
    for step in re.split(r'^\d+\. ', recipe, flags=re.MULTILINE)[1:]:
        text, _, rest = step.partition('```')
        indent = len(text) - len(text.rstrip(' '))
        language, _, code = rest.partition('```')[0].partition('\n')
        lines = [line[indent:] for line in code.rstrip(' ').splitlines()]
        blocks_.append((' '.join(text.split()), language, '\n'.join(lines) + '\n'))
    return blocks_


def follow(folder, text, language, code):
    """Do a step: run its commands, or put its code into its file."""
    if language == 'console':
        for command in code.splitlines():
            run(folder, shlex.split(command.removeprefix('$ ')))
        return
    file, lines, at = place(folder, text)
    space = '\n\n' if code.startswith('def ') else '\n' if 'def ' in code else ''
    lines.insert(at, f'\n\n{code}' if lines and at == len(lines) else code + space)
    file.write_text(''.join(lines))


def place(folder, text):
    """Return the file of a step, its lines, and before which of them the code belongs."""
    file = folder / re.match('`(.*?)`', text)[1]
    lines = file.read_text().splitlines(keepends=True) if file.exists() else []
    where = re.search('(before|after) `(.*?)`', text, re.IGNORECASE)
    if not where:
        assert not lines or 'at the end' in text, f'{text}: where in it does the code belong?'
        return file, lines, len(lines)
    at, = [i for i, line in enumerate(lines) if where[2] in line]
    return file, lines, at + (where[1].lower() == 'after')


def run(folder, command):
    """Run a command line with this Python, which must end well."""
    assert command[0] == 'python'
    ended = subprocess.run([sys.executable, *command[1:]], cwd=folder, text=True, timeout=300,
                           stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert ended.returncode == 0, f'{" ".join(command)}\n{ended.stdout[-5000:]}'
    return ended.stdout


@pytest.mark.nightly
@pytest.mark.parametrize('title', ['A mechanism', 'A construction'])
def test_a_recipe_can_be_followed_to_the_letter(copy, title):
    for step in steps(title):
        follow(copy, *step)
