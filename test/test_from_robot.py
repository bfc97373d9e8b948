# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Facts of a robot's file, each as it is read, printed or refused."""

import ast
from dataclasses import replace
import math
from pathlib import Path
import re
import shlex

from linkage_ros import mechanisms, scene
from linkage_ros.cli import RequestError
from linkage_ros.robot_files import cli, closing, readers
from linkage_ros.robot_model.cli import main as robot_model
from linkage_ros.robot_model.robot import posed
import numpy as np
import pytest
from test_robot_files import (
    compared,
    CUT,
    DIALECTS,
    euler,
    fixed,
    published,
    random_robot,
    refused,
    robot_of,
    ROBOTS,
    rotation,
    words,
    written,
)

TREE = ('<robot name="r">{}<joint name="j" type="revolute"><parent link="a"/><child link="b"/>{}'
        '</joint>{}</robot>').format
AB, ABC = '<link name="a"/><link name="b"/>', '<link name="a"/><link name="b"/><link name="c"/>'


def hinge(name, parent, child, more=''):
    return (f'<joint name="{name}" type="revolute"><parent link="{parent}"/>'
            f'<child link="{child}"/>{more}</joint>')


def sdf(*parts):
    return ('<sdf version="1.9"><model name="m"><link name="a"/><link name="b"/>'
            f'{pin("j", "a", "b")}{"".join(parts)}</model></sdf>')


def pin(name, parent, child, kind='revolute', more=''):
    return (f'<joint name="{name}" type="{kind}"><parent>{parent}</parent><child>{child}</child>'
            f'{more}</joint>')


FAULTS = {
    TREE(ABC, '', hinge('j', 'b', 'c')): ": two joints are called 'j'",
    TREE(ABC, '', hinge('k', 'b', 'c') + hinge('l', 'c', 'b')):
        ": there are two of <joint> for 'b', which may have one",
    TREE(ABC + '<link name="d"/>', '', hinge('k', 'c', 'd') + hinge('l', 'd', 'c')):
        ' has links or frames that hang on themselves',
    TREE(AB + '<link name="b"/>', '', ''): ": there are two of <link> for 'b', which may have one",
    TREE(AB, '', hinge('k', 'b', 'c')): " names 'c', which is not there",
    TREE(AB, '<origin xyz="1e9 0 0"/>', ''):
        " cannot be read: '1e9 0 0 0 0 0' must be 6 numbers within 1e+09",
    TREE(ABC, '<origin xyz="6e8 0 0"/>', hinge('k', 'b', 'c', '<origin xyz="6e8 0 0"/>')):
        ': joint k must be within 1e+09 m',
    TREE(AB, '<axis xyz="0 0 0"/>', ''): ': the axis of joint j has no length',
    TREE(AB, '', '<loop_joint name="w" type="revolute"><link1 link="a"/><link2 link="x"/>'
         '</loop_joint>'): " names 'x', which is not there",
    sdf(pin('k', 'a', 'f'), '<frame name="f" attached_to="g"/><frame name="g" attached_to="f"/>'):
        ' has links or frames that hang on themselves',
    sdf(pin('k', 'a', 'x')): ": k names 'x', which is not there",
    sdf('<link name="c"><pose relative_to="y"/></link>'): ": c names 'y', which is not there",
    sdf('<link name="a"/>'): ": there are two of <link> for 'a', which may have one",
    sdf('<model name="n">', pin('k', 'q', 'q'), '</model>'):
        ": n::k names 'q', which is not there",
    sdf('<include><uri>arm</uri></include>'):
        ": the model includes 'arm', which is not read: write it in its place",
    sdf('<model name="n" placement_frame="c"><link name="c"/></model>'):
        ': the model n has a placement_frame, which is not read: give it a pose of its own'}


@pytest.mark.parametrize('text', FAULTS, ids=range(len(FAULTS)))
def test_a_fault_of_a_file_is_named(capsys, tmp_path, text):
    file = tmp_path / 'robot.xml'
    file.write_text(text)
    assert refused(capsys, file) == f'from_robot: {file}{FAULTS[text]}\n'


POSES = ' must be JOINT=VALUE, its value in rad or m'


@pytest.mark.parametrize('file, args, why', [
    ('four_bar.sdf', ['--loops', 'a'], f'{ROBOTS}/four_bar.sdf has its own loops; --loops is for '
     'a URDF'),
    ('four_bar.urdf', ['--pose', 'motor'], f"'motor'{POSES}"),
    ('four_bar.urdf', ['--pose', 'elbow=0', 'motor=a'], f"'motor=a'{POSES}"),
    ('four_bar.urdf', ['--hold', '=1'], f"'=1'{POSES}"),
    ('four_bar.urdf', ['--hold', 'motor=1e9'], f"'motor=1e9'{POSES}"),
    ('four_bar.urdf', ['--hold', 'motr=1'], "there is no joint 'motr'; allowed: motor, elbow, "
     'shoulder; did you mean motor?'),
    ('four_bar.sdf', ['--driven', 'joint_a'], "there is no joint 'joint_a'; allowed: joint_A, "
     'joint_B, joint_C, joint_D; did you mean joint_A?'),
    ('five_bar.urdf', [], 'no joint of this robot closes a loop'),
    ('four_bar.sdf', ['--pose', 'joint_D=1'], 'joint_D closes a loop: its position follows '
     'from other joints')])
def test_an_option_that_cannot_be_is_named(capsys, file, args, why):
    assert refused(capsys, ROBOTS / file, *args) == f'from_robot: {why}\n'


def test_a_loop_of_a_joint_that_is_no_hinge_slide_or_ball_is_left_out(capsys, tmp_path):
    file = written(tmp_path, 'four_bar.urdf', ('"wrist" type="revolute"', '"wrist" type="screw"'))
    assert refused(capsys, file) == (
        'from_robot: Left out: base_link, crank, coupler, rocker: not planar: wrist is a joint of '
        'type screw; as rods in space: wrist close loops that have more than rods in them.\n')
    file = written(tmp_path, 'four_bar.urdf', ('type="continuous"', 'type="spherical"'), (
        'type="revolute"', 'type="spherical"'))
    assert 'not planar: no hinge says in which plane; ' in refused(capsys, file)
    file.write_text(re.sub('xyz="0(.3)? 0 0(.2)?"', 'xyz="0 0 0"', (
        ROBOTS / 'four_bar.urdf').read_text()))
    assert 'all its joints are at one place' in refused(capsys, file)


SCENES = {
    # The cylinder is as long as its pins are apart, plus the position of its joint.
    'boom.urdf': (['--pose', 'boom_cylinder=0.1', '--hold', 'swing=0.25'], ' hold:=swing=0.25', """
# Checked: boom_cylinder: in 240 poses of the robot, boom_cylinder from -0.3 to 0.3, its loops \
stand open by 0 m at most.
/**:
  ros__parameters:
    mechanisms:
    - boom_cylinder
    boom_cylinder.type: custom
    boom_cylinder.joints:
    - A ground 0 0
    - B ground 0.3 0.3964
    - C cylinder B A 1.04858 left
    boom_cylinder.frame_id: turret
    boom_cylinder.pose: [0.0, 0.0, 0.0, -1.5707963, 0.0, 0.0]
    boom_cylinder.cylinder.source: boom_cylinder
    boom_cylinder.cylinder.ratio: 1.0
    boom_cylinder.cylinder.offset: 0.98779
    boom_cylinder.cylinder.start: 1.08779
    boom_cylinder.joint_names:
    - AC=boom_joint+0.9
    - barrel=barrel_joint+1.3
    boom_cylinder.only_named: true
    boom_cylinder.cylinder.sweep: [0.68779, 1.28779]
"""),
    # By its keyframe, the crank is 0.7 rad from upright.
    'four_bar.xml': ([], '', """
# Checked: motor: in 240 poses of the robot, motor from -2.442 to 3.842, its loops stand open by \
0 m at most.
/**:
  ros__parameters:
    mechanisms:
    - motor
    motor.type: custom
    motor.joints:
    - A ground 0 0
    - B ground 0.3 0
    - C crank A 0.2
    - D parallelogram A C B
    motor.frame_id: world
    motor.pose: [0.0, 0.0, 0.0, -1.5707963, 0.0, 0.0]
    motor.crank.source: motor
    motor.crank.ratio: 1.0
    motor.crank.offset: -1.5707963
    motor.crank.start: -0.8707963
    motor.joint_names:
    - CD=elbow-1.5707963
    - BD=-shoulder-1.5707963
    motor.only_named: true
""")}


@pytest.mark.parametrize('file', SCENES)
def test_all_that_is_printed_of_a_robot(capsys, file):
    if file.endswith('xml'):
        pytest.importorskip('mujoco')
    args, more, text = SCENES[file]
    assert cli.main([str(ROBOTS / file), *args]) == 0
    out, err = (re.sub(r'-?\d+\.\d+', lambda found: repr(round(float(found[0]), 7) + 0.0),
                       re.sub(r'\b\de-1\d m', '0 m', each)) for each in capsys.readouterr())
    assert out == (
        f'# From {ROBOTS}/{file}. Its joints on /joint_states, and its model:\n# ros2 launch '
        f'linkage_ros robot.launch.py robot:={ROBOTS}/{file} scene:=SCENE.yaml{more}\n'
        f'# joint_names: QB=-knee+0.6 is to be read as knee = 0.6 - angle of QB.{text}')
    assert err == ''.join(f'from_robot: {line[2:]}\n' for line in text.splitlines()
                          if line.startswith('# '))


def test_a_motor_that_had_to_move_is_named(capsys):
    # The cylinder is longer than its pins can be apart.
    assert cli.main([str(ROBOTS / 'boom.urdf'), '--pose', 'boom_cylinder=5']) == 0
    assert capsys.readouterr().err.startswith(
        'from_robot: boom_cylinder moved: their loops cannot be closed where the file has them.\n'
        'from_robot: Checked: boom_cylinder: in 240 poses of the robot, boom_cylinder from -0.3')


def test_a_motor_never_closes_a_loop_of_the_tree(capsys):
    # Of hinges the last closes it, as joint_D does where it does not drive.
    assert cli.main([str(ROBOTS / 'four_bar.sdf'), '--driven', 'joint_D', '--pose',
                     'joint_D=0.1']) == 0
    assert 'Checked: joint_D: in 240 poses' in capsys.readouterr().err


@pytest.mark.parametrize('word', ['parallelogram', 'antiparallelogram', 'mirror'])
@pytest.mark.parametrize('base', ['0.6 0', '0.5 -0.3'])
def test_bars_that_mirror_others_have_a_word_of_their_own(word, base):
    linkage = mechanisms.create('custom', joints=[
        'A ground 0 0', f'B ground {base}', 'C crank A 0.2', f'D {word} A C B'])
    given, reports, still = cli.described(robot_of(linkage, 0.7))
    ground, _, crank, line = given['crank.joints']
    assert (ground, crank, line) == ('A ground 0 0', 'C crank A 0.2', f'D {word} A C B')
    assert [line[:9] for line in reports] == ['Checked: '] and not still


# What a dialect says of a loop: its kind, and in whose frame its place and axis are.
SAID = {'joint of Gazebo': ('hinge', 'child'), 'universal joint of Gazebo': ('hinge', 'child'),
        'ball_constraint of Drake': ('ball', ''), 'linear_bushing_rpy of Drake': ('ball', ''),
        'frames of onshape-to-robot': ('ball', ''), 'links of example-parallel-robots': (
            'ball', ''), 'joints of example-parallel-robots': ('ball', ''),
        'balls of Robonex': ('ball', ''), 'a rod that detaches': ('fixed', 'parent'),
        'closures of solidworks_urdf_exporter2': ('hinge', 'world')}


@pytest.mark.parametrize('dialect', [*DIALECTS, 'frames with axes', 'a stiff bushing'])
def test_a_loop_is_where_a_dialect_says(tmp_path, dialect):
    # The ends stand apart, as the links of the file are turned at random.
    pytest.importorskip('yaml')
    rng = np.random.default_rng(len(dialect))
    inside, loops = DIALECTS.get(dialect) or DIALECTS['frames of onshape-to-robot']
    tilted = rotation((1.0, 2.0, 3.0)) @ [0.0, 1.0, 0.0]
    if dialect == 'frames with axes':
        inside += fixed('coupler', 'closing_w_1_z', [0.3, 0.0, 0.0] + 2.0 * tilted) + fixed(
            'rocker', 'closing_w_2_z', (0.0, 2.0, 0.2))
    if dialect == 'a stiff bushing':
        inside = DIALECTS['linear_bushing_rpy of Drake'][0].replace('1e4 0 1e4', '1e4 1 1e4')
    (one, on_one), (two, on_two) = euler(rng), euler(rng)
    text = CUT.sub(inside, (ROBOTS / 'four_bar.urdf').read_text())
    for old, angles in (('"0 0 0.2"/><axis xyz="0 1 0"/>\n', one), ('"0.3 0 0"/><axis', two)):
        assert text.count(old) == 1
        text = text.replace(old, old.replace('/>', f' rpy="{words(angles)}"/>', 1))
    file, more = tmp_path / 'robot.urdf', tmp_path / 'loops.yaml'
    file.write_text(text)
    more.write_text(loops)
    robot = readers.read(str(file), loops and str(more))
    tree = {*'motor elbow shoulder pin_joint'.split(), ''}
    cut = [joint for joint in robot.joints if joint.name not in tree and joint.kind != 'fixed'
           or '=' in joint.name][0]
    kind, where = SAID.get(dialect, ('hinge', ''))
    kind = {'frames with axes': 'hinge', 'a stiff bushing': 'fixed'}.get(dialect, kind)
    assert cut.kind == kind and cut.bodies[0] in ('coupler', 'wrist_a', 'closing_w_1')
    ends = {'': (np.array([0.0, 0.0, 0.2]) + on_one @ [0.3, 0.0, 0.0],
                 np.array([0.3, 0.0, 0.0]) + on_two @ [0.0, 0.0, 0.2])}
    ends['child'], ends['parent'] = ends[''][1:] * 2, (np.array([0.0, 0.0, 0.2]),) * 2
    ends['world'] = (np.array([0.3, 0.0, 0.2]),) * 2
    assert cut.places == (pytest.approx(ends[where][0]), pytest.approx(ends[where][1]))
    assert cut.is_cut == (where in ('', 'world'))
    if kind == 'hinge':
        axes = {'': (on_one, on_two), 'child': (on_two, on_two), 'world': (np.eye(3),) * 2}[where]
        axes = [turned @ [0.0, 1.0, 0.0] for turned in axes]
        if dialect == 'frames with axes':
            axes[0] = on_one @ tilted
        assert cut.axes == (pytest.approx(axes[0]), pytest.approx(axes[1]))
    assert robot.driven == (['motor'] if 'motor' in loops else [])


def test_joints_that_no_mechanism_publishes_are_one_of_cranks(tmp_path):
    # What is held stays where it is held, what follows another goes with it.
    file = tmp_path / 'robot.urdf'
    file.write_text(TREE(
        ABC + '<link name="d"/>', '', hinge('k 2', 'b', 'c', (
            '<mimic joint="j" multiplier="-0.5" offset="0.1"/>')) + hinge('l', 'c', 'd')))
    robot = readers.read(str(file))
    given, lost = cli.others(robot, {}, {'l': 0.25, 'nobody': 1.0})
    assert not lost and given == {
        'mechanisms': ['others'], 'others.type': 'custom', 'others.only_named': True,
        'others.joints': [
            'A ground 0 0', 'B1 crank A 1', 'B2 crank A 1', 'B3 crank A 1'],
        'others.joint_names': ['crank2="k 2"'], **{
            f'others.{crank}.{key}': value for crank, source, ratio, offset, start in (
                ('crank', 'j', 1.0, 0.0, 0.0), ('crank2', 'j', -0.5, 0.1, 0.1),
                ('crank3', 'l', 1.0, 0.0, 0.25)) for key, value in (
                    ('source', source), ('ratio', ratio), ('offset', offset), ('start', start),
                    ('speed', 0.0))}}
    assert cli.others(readers.read(str(ROBOTS / 'four_bar.sdf')), scene.read(cli.described(
        readers.read(str(ROBOTS / 'four_bar.sdf')))[0]).mechanisms, {}) == ({}, [])


LEG = """<link name="coupler{0}"/><link name="rocker{0}"/>
  <joint name="elbow{0}" type="revolute"><parent link="crank"/><child link="coupler{0}"/>
    <origin xyz="{1} 0 0.2" rpy="0 {4} 0"/><axis xyz="0 1 0"/>{2}</joint>
  <joint name="shoulder{0}" type="continuous"><parent link="base"/><child link="rocker{0}"/>
    <origin xyz="{3} 0 0" rpy="0 {5} 0"/><axis xyz="0 1 0"/></joint>
  <loop_joint name="wrist{0}" type="revolute"><link1 link="coupler{0}" xyz="0.25 0 0"/>
    <link2 link="rocker{0}" xyz="0.22 0 0"/><axis xyz="0 1 0"/></loop_joint>"""
MOTOR = """<robot name="r"><link name="base"/><link name="crank"/><joint name="motor"
  type="{}"><parent link="base"/><child link="crank"/><axis xyz="0 1 0"/></joint>{}
  <transmission name="t"><joint name="motor"/></transmission></robot>"""


def legs(count, ends=''):
    """Return legs on one crank, each on the line of its pivots, so that both sides are as near."""
    return MOTOR.format('continuous', ''.join(LEG.format(
        i, x, ends, far, math.atan2(0.2, far - x), math.atan2(-0.2, x - far))
        for i in range(count) for x, far in [(0.01 * i, 0.3 - 0.01 * i)]))


def choices(line):
    """Return the options that a refusal offers to be pasted."""
    # As they stand between blanks: no stop or comma belongs to them.
    return [shlex.split(each) for each in re.findall(
        r'(--(?:pose|driven|hold) \S.*?) (?:or (?=--)|to the command)', line)]


@pytest.mark.parametrize('count', [1, pytest.param(12, marks=pytest.mark.nightly)])
def test_all_legs_that_are_undecided_are_asked_in_one_run(capsys, tmp_path, count):
    file = tmp_path / 'legs.urdf'
    file.write_text(legs(count))
    line = refused(capsys, file)
    sides = choices(line)
    assert line.count(' as with ') == count and len(sides) == 2
    found = []
    for side in sides:
        assert cli.main([str(file), *side]) == 0
        out, err = capsys.readouterr()
        assert 'loops stand open by' in err and 'Left out' not in err
        found.append(out)
    assert found[0] != found[1]


@pytest.mark.parametrize('low', [-0.1, 0.2])
def test_of_two_poses_the_one_inside_the_limits_is_no_question(capsys, tmp_path, low):
    # The file's pose is inside of the first, and outside of the second.
    file = tmp_path / 'legs.urdf'
    file.write_text(legs(2, f'<limit lower="{low}" upper="3"/>'))
    assert cli.main([str(file)]) == 0
    assert '--pose' not in capsys.readouterr().err


# A parallelogram that lies on its base where the file has it.
FOLDED = MOTOR.format('{}', """<link name="coupler"/><link name="rocker"/>
  <joint name="elbow" type="continuous"><parent link="crank"/><child link="coupler"/>
    <origin xyz="0.2 0 0"/><axis xyz="0 1 0"/></joint>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="rocker"/>
    <origin xyz="0.3 0 0"/><axis xyz="0 1 0"/></joint>
  <loop_joint name="wrist" type="revolute"><link1 link="coupler" xyz="0.3 0 0"/>
    <link2 link="rocker" xyz="0.2 0 0"/><axis xyz="0 1 0"/></loop_joint>""")


def test_a_fold_is_left_by_a_line_that_is_printed(capsys, tmp_path):
    file = tmp_path / 'folded.urdf'
    file.write_text(FOLDED.format('continuous'))
    sides, found = choices(refused(capsys, file)), set()
    for side in sides:
        assert cli.main([str(file), *side]) == 0
        found |= {*re.findall('parallelogram|dyad', capsys.readouterr().out)}
    assert len(sides) == 2 and 'parallelogram' in found


def test_a_pose_next_to_a_fold_is_one(capsys, tmp_path):
    file = tmp_path / 'folded.urdf'
    file.write_text(FOLDED.format('revolute').replace(
        '</joint>', '<limit lower="-0.1" upper="0.7"/></joint>', 1))
    robot = posed(readers.read(str(file)), {'motor': 1e-4, 'shoulder': 1e-4, 'elbow': -1e-4})
    why = str(closing.closed(robot).faults['motor'])
    sides = choices(why)
    assert 'bars lie in line where the file has them' in why and len(sides) == 2
    for side in sides:
        motor, = (float(value.partition('=')[2]) for value in side if value.startswith('motor='))
        assert -0.1 < motor < 0.7
        assert cli.main([str(file), *side]) == 0
        assert 'Left out' not in capsys.readouterr().err


def foot():
    """Return a foot as of digit_like_2legs: on a cross, with two cranks and rods on balls."""
    joints = [('pitch', 'shin', 'cross', '-0.326 -0.0387 0', '0 0 1.86', '0 0 1'),
              ('roll', 'cross', 'foot', '0 0.009 0', '-1.5708 -0.0068 3.14159', '0 0 1')]
    eyes = []
    for i, side, turn in ((0, 1, '3.14159 0 0.707'), (1, -1, '0 0 -2.4347')):
        joints += [
            (f'motor_{i}', 'shin', f'crank_{i}', f'-0.0888 -0.0261 {side * 0.03}', turn, '0 0 1'),
            (f'x_{i}', f'crank_{i}', f'x_{i}', '0 0.057 0.0025', '-1.5708 -0.028 -1.5708',
             '1 0 0'),
            (f'y_{i}', f'x_{i}', f'y_{i}', '0 0 0', '0 0 0', '0 1 0'),
            (f'z_{i}', f'y_{i}', f'rod_{i}', '0 0 0', '0 0 0', '0 0 1')]
        eyes.append(f"""<loop_joint name="eye_{i}" type="spherical">
            <link1 link="rod_{i}" xyz="0 0 -0.2399"/>
            <link2 link="foot" xyz="-0.00913 {-side * 0.014276} -0.03465"/></loop_joint>
            <transmission name="t_{i}"><joint name="motor_{i}"/></transmission>""")
    return '<robot name="r"><link name="shin"/>' + ''.join([f"""
        <joint name="{name}" type="continuous"><parent link="{base}"/><child link="{body}"/>
          <origin xyz="{place}" rpy="{turn}"/><axis xyz="{axis}"/></joint><link name="{body}"/>"""
        for name, base, body, place, turn, axis in joints] + eyes) + '</robot>'


OPEN = {
    'a foot in two poses': (foot(), {}, 'pitch=-2.77 as with pitch=2.38'),
    'a foot in one': (foot(), {'pitch': 2.0}, ''),
    'legs in two poses each': (legs(2), {}, 'as with'),
    'a motor that moves': ((ROBOTS / 'boom.urdf').read_text(), {'boom_cylinder': 5.0}, ''),
    'bars in line': (FOLDED.format('continuous'), {'elbow': 0.2, 'shoulder': 0.1}, 'as with')}


@pytest.mark.parametrize('seeds', [
    range(1, 5), pytest.param(range(5, 20), marks=pytest.mark.nightly)], ids=['', 'more'])
@pytest.mark.parametrize('name', OPEN)
def test_no_answer_depends_on_the_starts_of_a_search(tmp_path, name, seeds):
    (text, pose, question), file = OPEN[name], tmp_path / 'robot.urdf'
    file.write_text(text)
    robot = posed(readers.read(str(file)), pose)

    def answer(seed):
        made = closing.closed(robot, seed)
        # A pose at a dead point has half of the digits.
        faults = {re.sub(r'-?\d+\.\d+', lambda found: f'{float(found[0]):.2f}', str(why))
                  for why in made.faults.values()}
        # A rod on balls spins freely.
        return faults, made.report, {} if faults else {
            name: value for name, value in made.robot.positions.items() if name[1] != '_'}

    faults, report, positions = answer(0)
    assert all(question in why for why in faults) and bool(faults) == bool(question)
    for seed in seeds:
        assert answer(seed) == (faults, report, pytest.approx(positions, abs=1e-6))


def test_a_loop_that_closes_in_one_pose_alone_is_named(capsys, tmp_path):
    # Its three bars are just as long as the ground.
    file = tmp_path / 'line.urdf'
    file.write_text(FOLDED.format('continuous').replace(
        '<origin xyz="0.3 0 0"/>', '<origin xyz="0.7 0 0"/>').replace(
        'link="rocker" xyz="0.2', 'link="rocker" xyz="-0.2'))
    assert ('its loops end where the file has motor: choose another pose by --pose, or mend '
            'lengths or places in the file.\n') in refused(capsys, file)


def test_a_joint_without_a_range_is_the_one_to_hold(capsys, tmp_path):
    file, loops = tmp_path / 'five_bar.urdf', tmp_path / 'loops.yaml'
    knee = '"front_knee" type="continuous">'
    text = (ROBOTS / 'five_bar.urdf').read_text()
    assert knee in text
    file.write_text(text.replace(
        knee, '"front_knee" type="revolute"><limit lower="0" upper="0"/>'))
    loops.write_text('{closed_loop: [[front_foot, back_foot]], type: [3d], name_mot: [mot_front]}')
    line = refused(capsys, file, '--loops', loops)
    assert re.search('or --hold front_knee=.*; the limits of front_knee leave no range', line)


def test_a_fold_outside_the_limits_starts_inside_them(capsys, tmp_path):
    file = tmp_path / 'folded.urdf'
    file.write_text(FOLDED.format('revolute').replace(
        '</joint>', '<limit lower="0.5" upper="2"/></joint>', 1))
    assert cli.main([str(file)]) == 0
    assert 'Started inside the limits of the file: motor at 0.6' in capsys.readouterr().err


def test_what_is_not_driven_is_imported_with_the_line_that_is_printed(capsys, tmp_path):
    file = tmp_path / 'five_bar.urdf'
    loops = tmp_path / 'loops.yaml'
    file.write_text((ROBOTS / 'five_bar.urdf').read_text())
    loops.write_text('{closed_loop: [[front_foot, back_foot]], type: [3d], name_mot: [mot_front]}')
    line = refused(capsys, file, '--loops', loops)
    assert 'not driven: 1 of ' in line
    for more in choices(line):
        assert cli.main([str(file), '--loops', str(loops), *more]) == 0
        assert 'Checked: mot_front' in capsys.readouterr().err
    assert len(choices(line)) == 2


def answer(robot, *lines):
    """Return what is said of a robot with lines that were pasted, as the command reads them."""
    more = {'--driven': robot.driven, '--pose': [], '--hold': []}
    for option, *values in lines:
        more[option] = values if option == '--driven' else more[option] + values
    robot = posed(replace(robot, driven=more['--driven']), cli.positions(more['--pose']))
    try:
        return '', *cli.described(closing.held(robot, cli.positions(more['--hold'])))[1]
    except RequestError as error:
        return str(error),


def undecided(seed):
    """Return a random robot with a motor too few or too many, or with its loops open, or None."""
    made, rng = random_robot(seed), np.random.default_rng(seed)
    if made is None:
        return None
    robot, kind = made[2], rng.integers(3)
    if kind == 0:
        robot.driven = robot.driven[1:] + [*robot.positions][:not robot.driven[1:]]
    if kind == 1:
        robot.driven = [*dict.fromkeys([*robot.driven, *rng.permutation([*robot.positions])[:1]])]
    return posed(robot, {name: float(rng.uniform(-0.5, 0.5)) for name in robot.tree_joints
                         if kind == 2 and name in robot.positions})


@pytest.mark.parametrize('seeds', [
    range(12), pytest.param(range(12, 120), marks=pytest.mark.nightly)], ids=['', 'more'])
def test_a_line_that_is_pasted_leads_on(seeds):
    pasted = 0
    for robot in filter(None, map(undecided, seeds)):
        lines, said = [], [answer(robot)]
        while offered := choices('\n'.join([*said[-1], ''])):
            lines.append(offered[-1])
            said.append(answer(robot, *lines))
            assert said[-1] not in said[:-1], said
            pasted += 1
    # Some robots are decided at once, and some refused for good.
    assert pasted >= max(3, len(seeds) // 10)


def test_two_hinges_that_cross_between_two_bodies_hold_them(capsys, tmp_path):
    file = tmp_path / 'robot.urdf'
    file.write_text(TREE(AB, '', '<loop_joint name="k" type="revolute"><link1 link="a"/>'
                         '<link2 link="b"/><axis xyz="0 1 0"/></loop_joint>'))
    assert 'it cannot move, as its joints hold each other' in refused(capsys, file)


def test_what_has_no_one_position_is_named(capsys):
    pytest.importorskip('mujoco')
    assert cli.main([str(ROBOTS / 'toe_rod.xml')]) == 0
    assert re.search('Not published: .*: a ball or a free joint has no one position',
                     capsys.readouterr().err)


def refusals():
    """Return the texts of all errors and reasons for which a loop is left out."""
    for name in ('closing', 'planar', 'loops', 'rods', 'check'):
        tree = ast.parse(Path(cli.__file__).with_name(f'{name}.py').read_text())
        for node in ast.walk(tree):
            is_reason = isinstance(node, ast.FunctionDef) and node.name in (
                '_why',)
            for part in ast.walk(node) if is_reason else [node]:
                if isinstance(part, (ast.Raise, ast.Return) if is_reason else ast.Raise):
                    yield from (each.value.strip(' :;,') for each in ast.walk(part)
                                if isinstance(each, ast.Constant) and isinstance(each.value, str)
                                and len(each.value) > 12)


def test_the_table_of_messages_has_all_refusals_and_no_others():
    text = (ROBOTS.parents[1] / 'docs' / 'robot-files.md').read_text()
    section = text.partition('## When it refuses')[2].partition('\n## ')[0]
    rows = [row.split('|')[1] for row in section.splitlines() if row.startswith('| ')][1:]
    said, known = ' '.join(refusals()), '\n'.join(rows)
    assert not [each for each in refusals() if each not in known]
    quotes = [quote.strip(' :') for row in rows for quote in re.findall('`(.*?)`', row)]
    assert len(quotes) > 30
    others = {'add', 'to the command', 'not driven'}
    assert not [quote for quote in quotes if quote not in said and quote not in others
                and not quote.startswith('m, more')]


def test_what_cannot_move_is_said_to_be_so_without_motors_too(capsys, tmp_path):
    # A body on three bars: of four bodies and six hinges none moves.
    rods, places = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.3)], [(0.1, 1.0), (0.6, 1.1), (1.1, 1.5)]
    links = '<link name="base"/><link name="top"/>'
    for i, ((x, z), (u, w)) in enumerate(zip(rods, places)):
        links += (f'<link name="r{i}"/><joint name="a{i}" type="continuous"><parent link="base"/>'
                  f'<child link="r{i}"/><origin xyz="{x} 0 {z}"/><axis xyz="0 1 0"/></joint>')
        links += (
            f'<loop_joint name="b{i}" type="continuous"><link1 link="r{i}" xyz="{u - x} 0 {w - z}"'
            f'/><link2 link="top" xyz="{u - 0.1} 0 {w - 1.0}"/><axis xyz="0 1 0"/></loop_joint>'
            if i else '<joint name="b0" type="continuous"><parent link="r0"/><child link="top"/>'
            '<origin xyz="0.1 0 1"/><axis xyz="0 1 0"/></joint>')
    file = tmp_path / 'platform.urdf'
    file.write_text(f'<robot name="p">{links}</robot>')
    assert 'it cannot move, as its joints hold each other' in refused(capsys, file)


@pytest.mark.nightly
def test_the_twelve_legs_of_a_strandbeest_come_back_from_its_sdf(tmp_path, capsys):
    config, file = ROBOTS.parents[1] / 'config' / 'strandbeest.yaml', tmp_path / 'legs.sdf'
    assert robot_model(['--format', 'sdf', str(config)]) == 0
    file.write_text(capsys.readouterr().out)
    assert cli.main([str(file)]) == 0
    assert 'Checked: strandbeest_crank: in 240 poses' in capsys.readouterr().err


def test_a_mechanism_that_cannot_move_is_not_checked():
    robot = closing.closed(readers.read(str(ROBOTS / 'four_bar.urdf'))).robot
    assert compared(robot, cli.described(robot)[0], motor=(0.0, 0.0)) == (
        'it could not be checked in more than 0 poses')


CYLINDER = """<mujoco><compiler angle="radian"/><worldbody><body name="shin">
  <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
  <body name="foot" pos="0 0 0.1"><joint name="pitch" axis="0 1 0" range="{ends}"/>{mass}
    <site name="eye" pos="{eye}"/></body>
  <body name="barrel" pos="{base}"><joint name="ball" type="ball"/>{mass}
    <body name="rod"><joint name="ram" type="slide" ref="0.3" axis="{way}"/>{mass}
      <site name="end" pos="{way}"/></body></body></body></worldbody>
  <equality><connect site1="end" site2="eye"/></equality>
  <actuator><motor joint="ram"/></actuator></mujoco>"""


@pytest.mark.parametrize('ends, within', [('-0.4 0.5', ' within -0.4 0.5'), ('-4 4', '')])
def test_a_cylinder_in_space_turns_a_foot(tmp_path, capsys, ends, within):
    pytest.importorskip('mujoco')
    file = tmp_path / 'robot.xml'
    pivot, base, eye = np.array([[0.0, 0.0, 0.1], [-0.6, 0.3, -0.8], [-0.5, -0.1, 0.2]])
    way = pivot + eye - base
    file.write_text(CYLINDER.format(
        ends=ends, base=words(base), eye=words(eye), way=words(way),
        mass='<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'))
    assert cli.main([str(file)]) == 0
    out, err = capsys.readouterr()
    assert 'in 240 poses of the robot, ram from ' in err and 'Left out' not in err
    file.with_suffix('.yaml').write_text(out)
    (name, mechanism), = scene.load(str(file.with_suffix('.yaml'))).mechanisms.items()
    drive, = mechanism.inputs.values()
    assert (name, drive.source, mechanism.frame_id) == ('ram_rods', 'ram', 'shin')
    assert drive.start == pytest.approx(np.linalg.norm(way))
    assert f'- pitch hinge ground at 0 0 0.1 axis 0 1 0{within} - ram' in ' '.join(out.split())
    for angle in np.linspace(-0.39, 0.49, 9):
        length = np.linalg.norm(pivot + rotation((0.0, angle, 0.0)) @ eye - base)
        ram = 0.3 + length - np.linalg.norm(way)
        assert published(mechanism, ram=ram) == pytest.approx(
            {'pitch': angle, 'ram': ram}, abs=1e-9)


@pytest.mark.parametrize('old, new, why', [
    (' axis="0.1 -0.4 1.0"', ' axis="0.1 -0.4 0.9"', 'ram does not slide along the line of its '
     'balls'),
    ('joint="ram"', 'joint="pitch"', 'ball is a joint of type ball and no end of a rod'),
    ('name="pitch" axis="0 1 0" range="-1 1"', 'name="pitch" type="ball"',
     'equality0 holds foot to rod, which hangs on rods alone')])
def test_what_rods_cannot_be_is_named(capsys, tmp_path, old, new, why):
    pytest.importorskip('mujoco')
    file, text = tmp_path / 'robot.xml', CYLINDER.format(
        base='-0.6 0.3 -0.8', eye='-0.5 -0.1 0.1', way='0.1 -0.4 1.0', ends='-1 1',
        mass='<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>')
    assert old in text
    file.write_text(text.replace(old, new))
    assert refused(capsys, file).endswith(f'; as rods in space: {why}.\n')


def test_a_file_of_mujoco_needs_no_meshes_and_no_names(tmp_path):
    pytest.importorskip('mujoco')
    file = tmp_path / 'robot.xml'
    file.write_text("""<mujoco><asset><mesh name="m" file="none.obj"/><hfield name="h"
      file="none.png" size="1 1 1 1"/><texture name="t" type="2d" file="none.png"/>
      <material name="c" texture="t"/></asset><worldbody><geom type="hfield" hfield="h"/>
      <body pos="1 2 3"><joint type="slide" axis="0 2 0" ref="0.5" range="0.1 0.7"/>
      <joint axis="1 0 0"/><geom type="mesh" mesh="m" material="c"/></body>
      <body name="free"><freejoint/></body><body name="fixed"><geom size="1"/>
      </body></worldbody><equality><weld body1="free" body2="fixed" active="false"/></equality>
      </mujoco>""")
    robot = readers.read(str(file))
    assert robot.root == 'world' and robot.frames['body1'][:3, 3].tolist() == [1.0, 2.0, 3.0]
    assert [(joint.name, joint.kind, joint.bodies, joint.position, joint.limits)
            for joint in robot.joints] == [
        ('joint0', 'slide', ('world', 'body1/joint0'), 0.5, (0.1, 0.7)),
        ('joint1', 'hinge', ('body1/joint0', 'body1'), 0.0, None),
        ('joint2', 'free', ('world', 'free'), None, None),
        ('fixed', 'fixed', ('world', 'fixed'), None, None)]
    assert robot.joints[0].axes[0].tolist() == [0.0, 1.0, 0.0] and not robot.driven


@pytest.mark.parametrize('said', ['', ' canonical_link="d"'])
def test_a_model_of_an_sdf_stands_for_its_link(tmp_path, said):
    file = tmp_path / 'model.sdf'
    file.write_text(sdf(
        f'<model name="n"{said}><model name="o"><link name="c"/></model><link name="d"/></model>',
        pin('k', 'b', 'n'), pin('l', 'n', 'a')))
    ends = [joint.bodies for joint in readers.read(str(file)).joints]
    there = 'n::d' if said else 'n::o::c'
    assert ends == [('a', 'b'), ('b', there), (there, 'a')]
