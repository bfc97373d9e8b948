# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Facts of a robot's file, each as it is read, printed or refused."""

import ast
from dataclasses import replace
import math
from pathlib import Path
import re
import shlex

from linkage_ros import scene
from linkage_ros.cli import RequestError
from linkage_ros.robot_files import cli, closing, readers
from linkage_ros.robot_model.cli import main as robot_model
from linkage_ros.robot_model.robot import with_positions
import numpy as np
import pytest
from robots import (
    imported,
    of_text,
    printed,
    published,
    refused,
    ROBOTS,
    rotation,
    said,
    words,
    written,
)
from scenes import custom
from test_robot_files import CUT, loops_of, random_robot, robot_of
import yaml

FAULTS = yaml.safe_load((ROBOTS / 'faults.yaml').read_text())


@pytest.mark.parametrize('fault', FAULTS, ids=range(len(FAULTS)))
def test_a_fault_of_a_file_is_named(tmp_path, fault):
    file = of_text(tmp_path / 'robot.urdf', fault['text'])
    assert refused(file).startswith(f'from_robot: {file}{fault["says"]}')


POSES = ' must be JOINT=VALUE, its value in rad or m\n'
PIN = '{pin_loops: [{parent: coupler, child: rocker, %s: [0.3, 0, 0]}], independent: [motor]}'


@pytest.mark.parametrize('file, args, why', [
    ('nowhere.urdf', [], f'{ROBOTS}/nowhere.urdf: No such file or directory\n'),
    ('four_bar.sdf', ['--loops', 'a'], f'{ROBOTS}/four_bar.sdf: only a URDF has its loops '),
    ('four_bar.urdf', ['--pose', 'motor'], f"'motor'{POSES}"),
    ('four_bar.urdf', ['--pose', 'elbow=0', 'motor=a'], f"'motor=a'{POSES}"),
    ('four_bar.urdf', ['--hold', 'motor=1e9'], f"'motor=1e9'{POSES}"),
    ('four_bar.urdf', ['--hold', 'motr=1'], "there is no hinge or slide 'motr'; allowed: motor, "),
    ('four_bar.sdf', ['--driven', 'joint_a'], "there is no hinge or slide 'joint_a'; allowed: "),
    ('five_bar.urdf', [], 'no joint of this robot closes a loop: an MJCF needs a connect or '),
    *(('four_bar.urdf', ['--loops', text], why) for text, why in (
        ('{closed_loop: [{link_a: front', '/loops.yaml cannot be read: while parsing a flow'),
        (PIN % 'parent_xzy', "/loops.yaml names 'parent_xyz', which is not there\n"),
        (PIN.replace('independent', 'indepndent') % 'parent_xyz',
         "/loops.yaml: there is no key 'indepndent'; allowed: closures, closed_loop, pin_lo"),
        ('{closures: [{link_a: x, link_b: rocker, point: [0, 0, 0], axis: [0, 1, 0]}]}',
         "/loops.yaml: joint closures[0] is on 'x', which is no link\n"),
        ('{closures: [{link_a: coupler, link_b: rocker, 7: 8}]}', "/loops.yaml names 'point'"),
        ('{name_mot: [motr]}', "/loops.yaml: there is no hinge or slide 'motr'; allowed: motor, "),
        ('{name_mot: [7]}', "/loops.yaml: there is no hinge or slide '7'; allowed: motor, elbow"),
        ('{closed_loop: [coupler, rocker]}', '/loops.yaml: closed_loop must have pairs of '),
        ('{closed_loop: [[coupler, rocker]], type: [3d, 3d]}', '/loops.yaml: type must have an '),
        ('{joint_name: [elbow]}', '/loops.yaml: type must have an entry for each of closed_loop'),
        ('{name_mot: motor}', "/loops.yaml: name_mot must be a list, not 'motor'"),
        ('[]', '/loops.yaml: there is no key []; allowed: ')))])
def test_an_option_that_cannot_be_is_named(tmp_path, file, args, why):
    args = [of_text(tmp_path / 'loops.yaml', arg) if arg[0] in '{[' else arg for arg in args]
    assert refused(file, *args).replace(str(tmp_path), '').startswith(f'from_robot: {why}')


def within(low, high):
    """Return the changes of a file that give limits to its motor."""
    return [('"motor" type="continuous">', '"motor" type="revolute">'
             f'<limit lower="{low}" upper="{high}"/>')]


SPHERES = ('type="continuous"', 'type="spherical"'), ('type="revolute"', 'type="spherical"')
HELD = 'it cannot move, as its joints hold each other'
REFUSED = [
    ('four_bar.urdf', [('0 -1 0', '0 -1 0.2')], 'axes of motor and shoulder are 11.3 degrees '),
    ('four_bar.urdf', [('link="rocker" xyz="0 0 0.2"', 'link="rocker" xyz="0 0 2.2"')],
     'its loops cannot be closed: they stay open by'),
    ('four_bar.urdf', [('name="wrist" type="revolute"', 'name="wrist" type="universal"')],
     'joint wrist is universal and must have two axes'),
    ('four_bar.urdf', [('"wrist" type="revolute"', '"wrist" type="screw"')],
     'from_robot: Left out: base_link, crank, coupler, rocker: not planar: wrist is a joint of '
     'type screw; as rods in space: links on hinges and undriven slides can be joined by rods '
     'and cylinders, not by wrist.\n'),
    ('four_bar.urdf', [('"wrist" type="revolute"', '"wrist"')], 'wrist is a joint of type none'),
    ('four_bar.urdf', SPHERES, 'not planar: no hinge says in which plane; '),
    ('four_bar.urdf', [('xyz="0.3 0 0"', 'xyz="0 0 0"'), ('xyz="0 0 0.2"', 'xyz="0 0 0"')],
     'all its joints are at one place'),
    ('four_bar.xml', [('<connect name="wrist" body1="coupler" body2="rocker" anchor="0.3 0 0"/>',
                       '<weld name="wrist" body1="coupler" body2="rocker"/>')], HELD),
    ('four_bar.xml', [('<worldbody>', '<include file="floor.xml"/><worldbody>')],
     "four_bar.xml cannot be read: XML Error: Error opening file 'floor.xml'"),
    ('four_bar.urdf', [], 'replace them by --driven motor in the', '--driven', 'motor', 'elbow'),
    # Where it is open by rounding, too.
    ('four_bar.urdf', [('"coupler" xyz="0.3 0 0"', '"coupler" xyz="0.30001 0 0"')],
     'replace them by --driven motor in the', '--driven', 'motor', 'shoulder'),
    ('four_bar.sdf', [], f'{HELD}.\n', '--hold', 'joint_A=0'),
    *(('four_bar.sdf', [], why, '--hold', 'joint_A=0', 'joint_B=0', 'joint_C=0', f'joint_D={at}')
      for at, why in ((0, f': {HELD}\n'), (0.1, ': its loops cannot be closed: they stay open'))),
    ('four_bar.sdf', [], 'stay open by 0.121 m', '--hold', 'joint_A=0.31', 'joint_D=-0.61'),
    ('foot.urdf', [], 'they stay open by ', '--hold', 'z_1=-0.27', 'x_0=1.23'),
    *(('whitworth.xml', [], f'{names} drive it, and hold each other, as 1 of them tell where all '
       'is: replace them by --driven ', '--driven', *names.split(', ')) for names in (
           'lever_joint, crank_joint', 'crank_joint, rod_joint')),
    # It cannot move, but others can.
    ('four_bar.xml', [(' axis="0 -1 0"', '')],
     'motor drive it, and hold each other, as 0 of them tell where all is: replace them by '),
    ('four_bar.sdf', [('<child>AB</child><axis>', '<child>AB</child><axis><mimic joint="joint_B">'
                       '<multiplier>inf</multiplier></mimic>')],
     "cannot be read: ['inf', '0', '0'] must be 3 numbers within 1e+09\n"),
    ('four_bar.xml', [('anchor="0.3 0 0"', 'anchor=""')], 'four_bar.xml cannot be read: '),
    # What follows a joint that is held is held.
    ('four_bar.urdf', [('<limit', '<mimic joint="elbow"/><limit')], HELD, '--hold', 'elbow=0'),
    # A fold, without motors.
    ('folded.urdf', [('<transmission name="t"><joint name="motor"/></transmission>', '')],
     'bars lie in line where the file has them, and it moves on with '),
    # Bars that are just as long as the ground.
    ('folded.urdf', [('<origin xyz="0.3 0 0"/>', '<origin xyz="0.7 0 0"/>'),
                     ('link="rocker" xyz="0.2', 'link="rocker" xyz="-0.2')],
     'its loops end where the file has motor: choose another pose by --pose, or mend lengths or'),
    ('platform.sdf', [], 'not of dyads: r0, r1, r2, top hold each other'),
    # Without motors, too.
    ('four_bar.urdf', [('"coupler" xyz="0.3 0 0"', '"base_link" xyz="0 0 0.2"'), (
        '<link2 link="rocker"', '<link2 link="crank"')], HELD),
    ('cylinder.xml', [(' axis="0.1 -0.4 1.1"', ' axis="0.1 -0.4 0.9"')],
     '; as rods in space: ram does not slide along the line of its balls.\n'),
    ('cylinder.xml', [('joint="ram"', 'joint="pitch"')],
     'by rods and cylinders, not by ball, ram, equality0.\n'),
    ('cylinder.xml', [('name="pitch" axis="0 1 0" range="-0.4 0.5"', 'name="pitch" type="ball"')],
     'by rods and cylinders, not by equality0.\n')]


@pytest.mark.parametrize('file, changes, why, args', [
    (*row[:3], row[3:]) for row in REFUSED], ids=range(len(REFUSED)))
def test_what_makes_no_scene_is_said(tmp_path, file, changes, why, args):
    assert why in refused(written(tmp_path, file, *changes), *args)


PLUGIN = '<plugin name="c" filename="c"><joint_name>joint_D</joint_name></plugin>'
SAID = [
    # The cylinder is longer than its pins can be apart.
    ('boom.urdf', [], ['--pose', 'boom_cylinder=5'],
     'from_robot: boom_cylinder moved: their loops cannot be closed where the file has them.\n'
     'from_robot: Checked: boom_cylinder: in 240 poses of the robot, boom_cylinder from -0.3'),
    # Of hinges the last closes a loop.
    ('four_bar.sdf', [], ['--pose', 'joint_D=0.1'], 'Checked: joint_A: in 240 poses'),
    ('four_bar.sdf', [], ['--driven', 'joint_D', '--pose', 'joint_D=0.1'], 'Checked: joint_D'),
    # Three bodies on a pin, of which a motor turns two against each other.
    ('four_bar.sdf', [('      <pose>0 0 -0.2 0 0 0</pose>\n', '')], [], 'Checked: joint_C: '),
    # Held, it could not move.
    ('rack.sdf', [('<joint_name>tip_motor</joint_name>', '')], [],
     ' must be moved: add --driven tip_motor to '),
    # Loops of which no motor is named keep those of the file.
    ('rack.sdf', [], ['--driven', 'rack_slide'], 'Checked: tip_motor: in 240 poses'),
    # A part that nothing drives says so, beside the mechanism that is imported.
    ('wheel_leg.urdf', [], ['--driven', 'crank_motor'],
     'thigh, shin, tendon: not driven: 1 of hip, bell_joint, knee, tendon_joint must be moved'),
    ('toe_rod.xml', [], [], ': only a hinge or a slide has one position'),
    ('folded.urdf', within(0.5, 2.0), [], 'Started inside the limits of the file: motor at 0.6'),
    ('four_bar.urdf', [('</robot>', '<transmission name="t"><joint name="motr"/><joint '
                        'name="motor"/></transmission></robot>')], [],
     'Not driven: motr: no joint of the file has this name; allowed: motor, elbow, shoulder; did'),
    ('four_bar.urdf', [('</robot>', '<gazebo>' + PLUGIN.replace('joint_D', 'shoulder')
                        + '</gazebo></robot>')], [], 'Checked: shoulder: in 240 poses'),
    # A plugin's names are those of its model.
    ('four_bar.sdf', [('<model name="four_bar">', f'<model name="m">{PLUGIN}<model name="n">'),
                      ('<link name="AB"/>', f'{PLUGIN}<link name="AB"/>'),
                      ('</model>', '</model></model>')], [],
     'n::joint_C, n::joint_D; did you mean n::joint_D?\nfrom_robot: Checked: n_joint_D: in')]


@pytest.mark.parametrize('file, changes, args, line', SAID, ids=range(len(SAID)))
def test_what_was_decided_is_said(tmp_path, file, changes, args, line):
    assert line in said(written(tmp_path, file, *changes), *args)


def test_all_that_is_printed_of_a_robot():
    # By its keyframe, the crank is 0.7 rad from upright.
    _, out, err = (each if isinstance(each, int) else re.sub(
        r'-?\d+\.\d+', lambda match: repr(round(float(match[0]), 7) + 0.0),
        re.sub(r'\b\de-1\d m', '0 m', each)) for each in printed('four_bar.xml'))
    assert out == (ROBOTS / 'four_bar_scene.yaml').read_text().format(file=ROBOTS / 'four_bar.xml')
    assert err == f'from_robot: {out.splitlines()[3][2:]}\n'
    _, out, _ = printed('boom.urdf', '--hold', 'swing=0.25')
    assert out.splitlines()[1].endswith(' scene:=SCENE.yaml hold:=swing=0.25')


@pytest.mark.parametrize('word', ['parallelogram', 'antiparallelogram', 'mirror'])
@pytest.mark.parametrize('base', ['0.6 0', '0.5 -0.3'])
def test_bars_that_mirror_others_have_a_word_of_their_own(word, base):
    linkage = custom('A ground 0 0', f'B ground {base}', 'C crank A 0.2', f'D {word} A C B')
    parameters, reports, still = cli.described(robot_of(linkage, 0.7))
    ground, _, crank, line, *_ = parameters['crank.joints']
    assert (ground, crank, line) == ('A ground 0 0', 'C crank A 0.2', f'D {word} A C B')
    assert [line[:9] for line in reports] == ['Checked: '] and not still


@pytest.mark.parametrize('more, word', [(1e-13, 'parallelogram'), (1e-10, 'dyad')])
def test_bars_that_differ_by_more_than_rounding_are_no_parallelogram(more, word):
    linkage = custom('A ground 0 0', 'B ground 0.6 0', 'C crank A 0.2',
                     f'D dyad B C {0.2 + more!r} 0.6 right')
    assert cli.described(robot_of(linkage, 0.7))[0]['crank.joints'][3].split()[1] == word


TILTED = rotation((1.0, 2.0, 3.0)) @ [0.0, 1.0, 0.0]
DIALECTS = yaml.safe_load((ROBOTS / 'dialects.yaml').read_text())


@pytest.mark.parametrize('dialect', DIALECTS)
def test_a_loop_is_where_a_dialect_says(tmp_path, dialect):
    # The ends stand apart, as the links of the file are turned at random.
    text, kind, where = (DIALECTS[dialect].get(key, '') for key in ('text', 'kind', 'frame'))
    is_file, base = text.startswith('{'), (ROBOTS / 'four_bar.urdf').read_text()
    base = CUT.sub('' if is_file else text, base)
    angles = np.random.default_rng(len(dialect)).uniform(-1.5, 1.5, (2, 3))
    on_one, on_two = map(rotation, angles)
    for old, turned in zip(('"0 0 0.2"/><axis xyz="0 1 0"/>\n', '"0.3 0 0"/><axis'), angles):
        assert base.count(old) == 1
        base = base.replace(old, old.replace('/>', f' rpy="{words(turned)}"/>', 1))
    robot = readers.read(str(of_text(tmp_path / 'robot.urdf', base)), is_file and str(
        of_text(tmp_path / 'loops.yaml', text)))
    tree = {*'motor elbow shoulder pin_joint'.split(), ''}
    cut = [joint for joint in robot.joints if joint.name not in tree and joint.kind != 'fixed'
           or '=' in joint.name][0]
    assert cut.kind == kind and cut.bodies[0] in ('coupler', 'wrist_a', 'closing_w_1')
    ends = (np.array([0.0, 0.0, 0.2]) + on_one @ [0.3, 0.0, 0.0],
            np.array([0.3, 0.0, 0.0]) + on_two @ [0.0, 0.0, 0.2])
    ends = {'child': ends[1:] * 2, 'model': ends[1:] * 2, 'parent': [(0.0, 0.0, 0.2)] * 2,
            'world': [(0.3, 0.0, 0.2)] * 2}.get(where, ends)
    assert cut.places == (pytest.approx(ends[0]), pytest.approx(ends[1]))
    assert [joint for joint in robot.joints if joint.is_cut]
    if kind == 'hinge':
        turns = {'': (on_one, on_two), 'child': (on_two, on_two)}.get(where, (np.eye(3),) * 2)
        axes = [turned @ [0.0, 1.0, 0.0] for turned in turns]
        if dialect == 'frames with axes':
            axes[0] = on_one @ TILTED
        assert cut.axes == (pytest.approx(axes[0]), pytest.approx(axes[1]))
    assert robot.driven == (['motor'] if is_file and 'motor' in text else [])


def test_joints_that_no_mechanism_publishes_are_one_of_cranks_where_they_are(tmp_path):
    # What is held stays where it is held, what follows another goes with it; after many turns and
    # far along a rail, too.
    robot = readers.read(str(of_text(tmp_path / 'robot.urdf', """<robot name="r">
      <link name="a"/><link name="b"/><link name="c"/><link name="d"/><link name="e"/>
      <joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>
      <joint name="k 2" type="continuous"><parent link="b"/><child link="c"/>
        <mimic joint="j" multiplier="-0.5" offset="0.1"/></joint>
      <joint name="l" type="revolute"><parent link="c"/><child link="d"/></joint>
      <joint name="rail" type="prismatic"><parent link="d"/><child link="e"/></joint></robot>""")))
    parameters, lost = cli.others(with_positions(robot, {'rail': -15.0, 'j': 200.0}), {}, {
        'l': 0.25, 'nobody': 1.0})
    assert not lost and parameters == {
        'mechanisms': ['others'], 'others.type': 'custom', 'others.only_named': True,
        'others.joints': ['A ground 0 0', *(f'B{i} crank A 1' for i in (1, 2, 3, 4))],
        'others.joint_names': ['crank2="k 2"-99.9'], **{
            f'others.{crank}.{key}': value for crank, source, ratio, offset in (
                ('crank', 'j', 1.0, -200.0), ('crank2', 'j', -0.5, 100.0),
                ('crank3', 'l', 1.0, -0.25), ('crank4', 'rail', 1.0, 15.0))
            for key, value in (('source', source), ('ratio', ratio), ('offset', offset),
                               ('start', 0.0), ('speed', 0.0))}}
    robot = readers.read(str(ROBOTS / 'four_bar.sdf'))
    assert cli.others(robot, scene.read(cli.described(robot)[0]).mechanisms, {}) == ({}, [])


MOTOR = """<robot name="r"><link name="base"/><link name="crank"/>
  <joint name="motor" type="continuous"><parent link="base"/><child link="crank"/>
    <axis xyz="0 1 0"/></joint>{}
  <transmission name="t"><joint name="motor"/></transmission></robot>"""
LEG = """<link name="coupler{0}"/><link name="rocker{0}"/>
  <joint name="elbow{0}" type="revolute"><parent link="crank"/><child link="coupler{0}"/>
    <origin xyz="{1} 0 0.2" rpy="0 {4} 0"/><axis xyz="0 1 0"/>{2}</joint>
  <joint name="shoulder{0}" type="continuous"><parent link="base"/><child link="rocker{0}"/>
    <origin xyz="{3} 0 0" rpy="0 {5} 0"/><axis xyz="0 1 0"/></joint>
  <loop_joint name="wrist{0}" type="revolute"><link1 link="coupler{0}" xyz="0.25 0 0"/>
    <link2 link="rocker{0}" xyz="0.22 0 0"/><axis xyz="0 1 0"/></loop_joint>"""


def legs(count, ends=''):
    """Return legs on one crank, each on the line of its pivots, so that both sides are as near."""
    return MOTOR.format(''.join(LEG.format(
        i, x, ends, far, math.atan2(0.2, far - x), math.atan2(-0.2, x - far))
        for i in range(count) for x, far in [(0.01 * i, 0.3 - 0.01 * i)]))


def choices(line):
    """Return the options that a refusal offers to be pasted."""
    # As they stand between blanks: no stop or comma belongs to them.
    return [shlex.split(each) for each in re.findall(
        r'(--(?:pose|driven|hold) \S.*?) (?:or (?=--)|(?:to|in) the command)', line)]


@pytest.mark.parametrize('count', [1, pytest.param(12, marks=pytest.mark.nightly)])
def test_all_legs_that_are_undecided_are_asked_in_one_run(tmp_path, count):
    file = of_text(tmp_path / 'legs.urdf', legs(count).replace('elbow', f'elbow_{"long" * 30}'))
    line = refused(file)
    sides = choices(line)
    assert line.count(' as with ') == count and len(sides) == 2
    runs = []
    for side in sides:
        code, out, err = printed(file, *side)
        assert code == 0 and 'loops stand open by' in err and 'Left out' not in err
        runs.append(out)
    assert runs[0] != runs[1]


@pytest.mark.parametrize('low', [-0.1, 0.2])
def test_of_two_poses_the_one_inside_the_limits_is_no_question(tmp_path, low):
    # The file's pose is inside of the first, and outside of the second.
    assert '--pose' not in said(of_text(
        tmp_path / 'legs.urdf', legs(2, f'<limit lower="{low}" upper="3"/>')))


@pytest.mark.parametrize('changes, args', [
    # At it, and next to it.
    ([], []), (within(-0.1, 0.7), ['--pose', 'motor=1e-4', 'shoulder=1e-4', 'elbow=-1e-4'])])
def test_a_fold_is_left_by_a_line_that_is_printed(tmp_path, changes, args):
    file = written(tmp_path, 'folded.urdf', *changes)
    line = refused(file, *args)
    assert 'bars lie in line where the file has them' in line and len(choices(line)) == 2
    for side in choices(line):
        motor, = (float(value.partition('=')[2]) for value in side if value.startswith('motor='))
        assert -0.1 < motor < 0.7 or not args
        assert 'Left out' not in said(file, *args, *side)


@pytest.mark.parametrize('knee, why', [
    ('', 'not driven: 1 of .* or --hold .* to the command'),
    ('<limit lower="0" upper="0"/>', '--hold front_knee=.*; the limits of front_knee ')])
def test_what_is_not_driven_is_imported_with_the_line_that_is_printed(tmp_path, knee, why):
    joint = '"front_knee" type="continuous">'
    file = written(tmp_path, 'five_bar.urdf', (joint, joint.replace(
        'continuous', 'revolute' if knee else 'continuous') + knee))
    loops = loops_of(tmp_path, 'name_mot: [mot_front]')
    line = refused(file, *loops)
    assert re.search(why, line) and len(choices(line)) == 2
    for more in choices(line):
        assert 'Checked: mot_front' in said(file, *loops, *more)


NAMED = re.compile(r'(name|link|joint)="(?!base|hip")(\w+)"')


def doubled(folder, text, root):
    """Return the file of a robot that has its loops twice, on one root link."""
    head, link, loops = text.replace('</robot>', '').partition(root)
    return of_text(folder / 'two.urdf', ''.join(
        [head, link, loops, NAMED.sub(r'\1="\2_b"', loops), '</robot>']))


def test_lines_that_are_printed_of_two_loops_are_pasted_one_after_the_other(tmp_path):
    file = doubled(tmp_path, legs(1), '<link name="base"/>')
    # Each on a line of its own.
    (one, _), (two, _) = map(choices, refused(file).splitlines())
    assert 'Left out' not in said(file, *one, *two)
    file = doubled(tmp_path, (ROBOTS / 'five_bar.urdf').read_text(), '<link name="hip"/>')
    loops = loops_of(tmp_path, 'name_mot: [mot_front, mot_front_b]',
                     'front_foot, back_foot], [front_foot_b, back_foot_b', '3d, 3d')
    for lines in zip(*zip(*[iter(choices(refused(file, *loops)))] * 2)):
        assert 'Left out' not in said(file, *loops, *sum(lines, []))


OPEN = {
    'a foot in two poses': ('foot.urdf', {}, 'pitch=-2.77 as with pitch=2.38'),
    'a foot in one': ('foot.urdf', {'pitch': 2.0}, ''),
    'legs in two poses each': (legs(2), {}, 'as with'),
    'a motor that moves': ('cylinder.xml', {'ram': 3.0}, ''),
    'bars in line': ('folded.urdf', {'elbow': 0.2, 'shoulder': 0.1}, 'as with')}


@pytest.mark.parametrize('seeds', [
    [7], pytest.param(range(1, 20), marks=pytest.mark.nightly)], ids=['', 'more'])
@pytest.mark.parametrize('name', OPEN)
def test_no_answer_depends_on_the_starts_of_a_search(tmp_path, name, seeds):
    file, pose, question = OPEN[name]
    if file.startswith('<'):
        file = of_text(tmp_path / 'robot.urdf', file)
    robot = with_positions(readers.read(str(ROBOTS / file)), pose)

    def answer(seed):
        made = closing.closed(robot, seed)
        # A pose at a dead point has half of the digits.
        faults = {re.sub(r'-?\d+\.\d+', lambda match: f'{float(match[0]):.2f}', str(why))
                  for why in made.faults.values()}
        # A rod on balls spins freely.
        return faults, made.report, {} if faults else {
            name: value for name, value in made.robot.positions.items() if name[1] != '_'}

    faults, report, positions = answer(0)
    assert all(question in why for why in faults) and bool(faults) == bool(question)
    for seed in seeds:
        assert answer(seed) == (faults, report, pytest.approx(positions, abs=1e-6))


def answer(robot, *lines):
    """Return what is said of a robot with lines that were pasted, as the command reads them."""
    more = {'--driven': [], '--pose': [], '--hold': []}
    for option, *values in lines:
        more[option] += values
    robot = with_positions(replace(robot, driven=more['--driven'] or robot.driven),
                           cli.positions(more['--pose']))
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
    names = [name for name in robot.positions if not name.startswith('cut')]
    if kind == 0:
        robot.driven = robot.driven[1:] + names[:not robot.driven[1:]]
    if kind == 1:
        robot.driven = [*dict.fromkeys([*robot.driven, *rng.permutation(names)[:1]])]
    return with_positions(
        robot, {name: float(rng.uniform(-1.5, 1.5)) for name in names if kind == 2})


@pytest.mark.parametrize('seeds', [
    [10], pytest.param(range(120), marks=pytest.mark.nightly)], ids=['', 'more'])
def test_a_line_that_is_pasted_leads_on(seeds):
    pasted = 0
    for robot in filter(None, map(undecided, seeds)):
        lines, reports = [], [answer(robot)]
        while offered := choices('\n'.join([*reports[-1], ''])):
            lines.append(offered[-1])
            reports.append(answer(robot, *lines))
            assert reports[-1] not in reports[:-1], reports
            pasted += 1
    # Some robots are decided at once, and some refused for good.
    assert pasted >= max(1, len(seeds) // 10)


def test_where_other_loops_of_the_same_source_end_a_loop_goes_on():
    assert 'compared with' not in '\n'.join(answer(undecided(358)))


def quoted(node):
    """Return the texts in a part of a module, with dots between them."""
    return '...'.join(each.value for each in ast.walk(node) if isinstance(
        each, ast.Constant) and isinstance(each.value, str))


def refusals(tree):
    """Yield the text of each error, and of each reason for which a loop is left out."""
    for node in ast.walk(tree):
        is_reason = isinstance(node, ast.FunctionDef) and node.name[:4] == '_why'
        for part in ast.walk(node) if is_reason else [node]:
            if isinstance(part, (ast.Raise, ast.Return) if is_reason else ast.Raise):
                # What is passed on has no words of its own.
                yield from [quoted(part)] * bool(re.search('[a-z]{2}', quoted(part)))


def test_the_table_of_messages_has_all_refusals_and_no_others():
    text = (ROBOTS.parents[1] / 'docs' / 'robot-files.md').read_text()
    section = text.partition('## When it refuses')[2].partition('\n## ')[0]
    rows = [row.split('|')[1] for row in section.splitlines() if row.startswith('| ')][1:]
    quotes = [quote for row in rows for quote in re.findall('`(.*?)`', row)]
    package = Path(cli.__file__).parents[1]
    trees = [ast.parse(path.read_text()) for path in (
        *package.glob('robot_*/*.py'), package / 'linkage' / 'dyads.py')]
    reports = [each for tree in trees for each in refusals(tree)]
    assert len(reports) > 45
    assert not [each for each in reports if not any(quote in each for quote in quotes)]
    assert not [quote for quote in quotes if not any(quote in quoted(tree) for tree in trees)]


@pytest.mark.nightly
def test_the_twelve_legs_of_a_strandbeest_come_back_from_its_sdf(tmp_path, capsys):
    config = ROBOTS.parents[1] / 'config' / 'strandbeest.yaml'
    assert robot_model(['--format', 'sdf', str(config)]) == 0
    assert 'Checked: strandbeest_crank: in 240 poses' in said(
        of_text(tmp_path / 'legs.sdf', capsys.readouterr().out))


@pytest.mark.parametrize('ends, ref, limits, ram, sign', [
    ('-0.4 0.5', 0.0, ' within -0.4 0.5', '', 1.0),
    ('-0.2 0.7', 0.2, ' within -0.4 0.5', '', 1.0), ('-4 4', 0.0, '', '', 1.0),
    # It is longer where its position is less.
    ('-0.4 0.5', 0.0, ' within -0.4 0.5', ' range="0.1 0.45"', -1.0)])
def test_a_cylinder_in_space_turns_a_foot(tmp_path, ends, ref, limits, ram, sign):
    way = ' '.join(str(sign * x) for x in (0.1, -0.4, 1.1))
    file = written(tmp_path, 'cylinder.xml', ('range="-0.4 0.5"', f'ref="{ref}" range="{ends}"'),
                   ('axis="0.1 -0.4 1.1"', f'axis="{way}"{ram}'))
    code, out, err = printed(file)
    assert code == 0 and 'in 240 poses of the robot, ram from ' in err and 'Left out' not in err
    assert f'- pitch hinge ground at 0 0 0.1 axis 0 1 0{limits} - ram' in ' '.join(out.split())
    mechanism, = imported(file)
    settings, = mechanism.inputs.values()
    assert (mechanism.name, settings.source, mechanism.frame_id) == ('ram_rods', 'ram', 'shin')
    pivot, base, eye = np.array([[0.0, 0.0, 0.1], [-0.6, 0.3, -0.8], [-0.5, -0.1, 0.2]])
    start = np.linalg.norm(pivot + eye - base)
    assert settings.start == pytest.approx(start)
    if ram:
        low, high = sorted(start + sign * (end - 0.3) for end in (0.1, 0.45))
        assert low <= settings.ends[0] < settings.ends[1] == pytest.approx(high)
    for angle in np.linspace(-0.39, 0.49, 9):
        length = np.linalg.norm(pivot + rotation((0.0, angle, 0.0)) @ eye - base)
        ram = 0.3 + sign * (length - start)
        assert published(mechanism, ram=ram) == pytest.approx(
            {'pitch': angle + ref, 'ram': ram}, abs=1e-9)


@pytest.mark.parametrize('name', ['robot.xml', 'robot.mjcf', 'robot'])
def test_a_file_of_mujoco_needs_no_meshes_and_no_names(tmp_path, name):
    robot = readers.read(str(of_text(tmp_path / name, """<mujoco><asset>
      <mesh name="m" file="none.obj"/><hfield name="h" file="none.png" size="1 1 1 1"/>
      <texture name="t" type="2d" file="none.png"/><material name="c" texture="t"/></asset>
      <worldbody><geom type="hfield" hfield="h"/>
      <body pos="1 2 3"><joint type="slide" axis="0 2 0" ref="0.5" range="0.1 0.7"/>
      <joint axis="1 0 0"/><geom type="mesh" mesh="m" material="c"/></body>
      <body name="free"><freejoint/></body><body name="fixed"><geom size="1"/>
      </body></worldbody><equality><weld body1="free" body2="fixed" active="false"/></equality>
      </mujoco>""")))
    assert robot.root == 'world' and robot.frames['body1'][:3, 3].tolist() == [1.0, 2.0, 3.0]
    assert [(joint.name, joint.kind, joint.bodies, joint.position, joint.limits)
            for joint in robot.joints] == [
        ('joint0', 'slide', ('world', 'body1/joint0'), 0.5, (0.1, 0.7)),
        ('joint1', 'hinge', ('body1/joint0', 'body1'), 0.0, None),
        ('joint2', 'free', ('world', 'free'), None, None),
        ('fixed', 'fixed', ('world', 'fixed'), None, None)]
    assert robot.joints[0].axes[0].tolist() == [0.0, 1.0, 0.0] and not robot.driven
