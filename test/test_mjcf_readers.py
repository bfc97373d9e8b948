# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Random planar linkages in MJCF: how each joint moves is known before it is written.

Source of what each way means: MuJoCo's XML reference (mujoco.readthedocs.io) on frame
orientations, several joints of one body, `ref`, keyframes, and the constraints connect, weld and
joint.
"""

import math
import re
from xml.sax.saxutils import quoteattr

from linkage_ros.cli import RequestError
from linkage_ros.robot_files import readers
from linkage_ros.robot_model.urdf import write
import numpy as np
import pytest
from robots import Pinocchio, words
from test_robot_files import check_comes_back, random_robot
from test_sdf_readers import frame, quaternion

mujoco = pytest.importorskip('mujoco', reason='MJCF is read by MuJoCo: pip install mujoco')


def motion(joint, change):
    """Return the displacement by a joint of its second body, as the pose of the robot has it."""
    made, axis = np.eye(4), joint.axis
    if joint.kind == 'slide':
        made[:3, 3] = change * axis
        return made
    skew = np.cross(np.eye(3), axis)
    made[:3, :3] += math.sin(change) * skew + (1.0 - math.cos(change)) * skew @ skew
    made[:3, 3] = joint.places[0] - made[:3, :3] @ joint.places[0]
    return made


class Writer:
    """
    Writes a robot whose bodies have no frames of their own, and whose joints are at zero.

    Attributes
    ----------
    text : str
        The MJCF.
    zeros : dict
        The position in the file of each joint, in the pose in which the robot is.

    """

    def __init__(self, robot, rng):
        self.robot, self.rng = robot, rng
        self.degrees, self.has_key = rng.random(2) < 0.5
        self.tree, cuts = robot.spanning_tree()
        self.cuts = [joint for joint in cuts if joint.name]
        self.names = [joint.name for _, joint in self.tree.values()]
        # The position of each joint where the file has the bodies, and in its keyframe from there.
        self.refs = {name: rng.normal() for name in self.names}
        self.keys = {name: 0.3 * rng.normal() * self.has_key for name in self.names}
        self.zeros = {name: self.refs[name] + self.keys[name] for name in self.names}
        self.frames = {body: frame(rng) for body in robot.frames}
        self.inside = {body: [] for body in robot.frames}
        self.known = {body for cut in self.cuts for body in cut.bodies}
        self.more = []
        self.close()
        base = self.pose(self.frames[robot.root])
        bodies = f'<body name="ground" {base}>{self.content(robot.root)}</body>'
        # Those of pins, which `weld` adds, are at zero.
        key = words(self.zeros.get(name, 0.0)
                    for name in re.findall('<joint name="(.*?)"', bodies))
        self.text = (
            f'<mujoco><compiler angle="{"degree" if self.degrees else "radian"}"/>'
            f'<worldbody>{bodies}</worldbody><equality>{self.ties()}{"".join(self.more)}'
            f'</equality>{self.motors()}'
            + f'<keyframe><key qpos="{key}"/></keyframe>' * bool(self.has_key) + '</mujoco>')

    def pose(self, at):
        """Return a pose in one of the ways of MJCF."""
        x, y, z, w = quaternion(at[:3, :3])
        angle = 2.0 * math.atan2(math.hypot(x, y, z), w)
        axis = np.array([x, y, z]) / math.hypot(x, y, z)
        turned = [f'quat="{words([w, x, y, z])}"', f'xyaxes="{words(at[:3, :2].T.ravel())}"',
                  f'axisangle="{words([*axis, self.angle(angle)])}"'][self.rng.integers(3)]
        return f'pos="{words(at[:3, 3])}" {turned}'

    def angle(self, value):
        return math.degrees(value) if self.degrees else value

    def content(self, body):
        """Return what is on a body: sites, and the bodies that hang on it."""
        text = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>' + ''.join(self.inside[body])
        for child, (base, joint) in self.tree.items():
            if base == body:
                chain = [(child, joint)]
                # A body of which nobody needs to know may be one with the next.
                while (below := [(one, each) for one, (base, each) in self.tree.items()
                                 if base == chain[-1][0]])[1:] == [] and below \
                        and chain[-1][0] not in self.known and self.rng.random() < 0.5:
                    chain += below
                text += self.body(body, chain)
        return text

    def body(self, base, chain):
        """Return a body with one joint or with several."""
        child, seen = chain[-1][0], np.linalg.inv(self.frames[base])
        starts = []
        for body, joint in chain:
            forward = 1.0 if joint.bodies[1] == body else -1.0
            starts.append((joint, forward, seen))
            seen = seen @ motion(joint, -forward * self.keys[joint.name])
        there = seen @ self.frames[child]
        joints = ''
        for joint, forward, seen in starts:
            own = np.linalg.solve(there, seen)
            ref, slides = self.refs[joint.name], joint.kind == 'slide'
            place = own[:3, :3] @ joint.places[0] + own[:3, 3]
            joints += (f'<joint name={quoteattr(joint.name)} type="{joint.kind}" '
                       f'pos="{words(place)}" axis="{words(own[:3, :3] @ joint.axis * forward)}" '
                       f'ref="{ref if slides else self.angle(ref)!r}"/>')
        return f'<body name="{child}" {self.pose(there)}>{joints}{self.content(child)}</body>'

    def close(self):
        """Close each loop in one of the ways of MJCF."""
        for i, cut in enumerate(self.cuts):
            way = self.rng.integers(self.has_key, 4)
            at, other_at = (np.linalg.solve(self.frames[body], [*place, 1.0])[:3]
                            for body, place in zip(cut.bodies, cut.places))
            one, other = cut.bodies
            if way == 0:
                self.more.append(f'<connect body1="{one}" body2="{other}" anchor="{words(at)}"/>')
            elif way == 1:
                for end, body, place in zip('ab', cut.bodies, (at, other_at)):
                    self.inside[body].append(f'<site name="{i}{end}" pos="{words(place)}"/>')
                self.more.append(f'<connect site1="{i}a" site2="{i}b"/>')
            else:
                self.weld(i, cut, other_at, way == 2)
        # What is not active ties nothing.
        self.more.append('<weld body1="ground" body2="world" active="false"/>')

    def weld(self, i, cut, other_at, by_sites):
        """Weld what turns on the second body to the first."""
        (one, other), pin = cut.bodies, frame(self.rng)
        there = np.linalg.inv(self.frames[other]) @ pin
        own = np.linalg.solve(there, [*other_at, 1.0])[:3]
        axis = pin[:3, :3].T @ cut.axis
        site = frame(self.rng)
        self.inside[other].append(
            f'<body name="pin{i}" {self.pose(there)}><joint name="turn{i}" pos="{words(own)}" '
            f'axis="{words(axis)}"/><site name="{i}b" {self.pose(site)}/>'
            '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>')
        seen = np.linalg.inv(self.frames[one]) @ pin
        self.inside[one].append(f'<site name="{i}a" {self.pose(seen @ site)}/>')
        # The first three numbers say where the first body has the anchor, which is on the second.
        anchor, (x, y, z, w) = self.rng.normal(size=3), quaternion(seen[:3, :3])
        numbers = [*(seen @ [*anchor, 1.0])[:3], w, x, y, z]
        self.more.append(f'<weld site1="{i}a" site2="{i}b"/>' if by_sites else (
            f'<weld body1="{one}" body2="pin{i}" relpose="{words(numbers)}" '
            f'anchor="{words(anchor)}"/>'))

    def ties(self):
        """Return the joints that follow others."""
        return ''.join(
            f'<joint joint1="{name}" joint2="{other}" polycoef="'
            f'{words([self.keys[name] - ratio * self.keys[other], ratio, 0.0, 0.0, 0.0])}"/>'
            for name, (other, ratio, _) in self.robot.follows.items())

    def motors(self):
        """Return the motors, of joints or of tendons."""
        tendons, motors = '', ''
        for i, name in enumerate(self.robot.driven):
            if self.rng.random() < 0.5:
                tendons += f'<fixed name="t{i}"><joint joint="{name}" coef="2"/></fixed>'
                motors += f'<position tendon="t{i}"/>'
            else:
                motors += f'<motor joint="{name}"/>'
        return f'<tendon>{tendons}</tendon><actuator>{motors}</actuator>'


def check_is_read(folder, seeds):
    """Check that linkages move as they do where they were written as MJCF."""
    moved, robots = 0, {seed: made for seed in seeds if (made := random_robot(seed))}
    for seed, (linkage, values, robot, steps) in robots.items():
        for joint in robot.joints:
            joint.is_cut = joint.name.startswith('cut_')
        writer, file = Writer(robot, np.random.default_rng(seed)), folder / f'{seed}.xml'
        file.write_text(writer.text)
        robot = readers.read(str(file))
        check_is_tree(file, robot, np.random.default_rng(seed))
        try:
            moved += check_comes_back(
                linkage, values, robot, steps if len(steps[0]) > 1
                else steps.ravel(), writer.zeros)[1] > 0
        except RequestError as error:
            assert re.search('closes a loop|not of dyads|it cannot move', str(error)), seed
    assert moved > 0.9 * len(robots)


def check_is_tree(file, robot, rng):
    """Check that the URDF of a robot moves as MuJoCo moves its file, loops open."""
    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    positions = {name: float(rng.normal()) for name in robot.positions}
    for name, value in positions.items():
        data.joint(name).qpos = value
    mujoco.mj_kinematics(model, data)
    bodies = [model.body(i).name for i in range(1, model.nbody)]
    found = Pinocchio(write(readers.drawn(robot))).places(positions, bodies)
    for i, body in enumerate(bodies):
        assert found[body] == pytest.approx(data.xpos[i + 1], abs=1e-12)


TIED = """<mujoco><compiler angle="radian"/><worldbody>
  <body><joint name="a" type="{}" axis="0 0 1" ref="{}"/><geom size="1"/></body>
  <body><joint name="b" type="{}" axis="0 0 1" ref="{}"/><geom size="1"/></body></worldbody>
  <equality><joint joint1="a" {} polycoef="{} {} 0 0 0"/></equality></mujoco>"""


@pytest.mark.parametrize('seed', range(6))
@pytest.mark.parametrize('other', ['joint2="b"', ''])
def test_joints_with_zeros_of_their_own_are_where_mujoco_ties_them(tmp_path, seed, other):
    # By MuJoCo's residual: what is tied counts from `ref`, in both joints.
    rng, file = np.random.default_rng(seed), tmp_path / 'tied.xml'
    kinds = rng.choice(['hinge', 'slide'], 2)
    ref, ref_b, start, ratio, b = rng.normal(size=5)
    file.write_text(TIED.format(kinds[0], ref, kinds[1], ref_b, other, start, ratio))
    robot = readers.read(str(file))
    if other:
        (leader, factor, offset), = robot.follows.values()
        positions = {'b': b, 'a': factor * b + offset}
        assert leader == 'b' and not robot.held
    else:
        positions = {'b': b, **robot.held}
    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    for name, value in positions.items():
        data.joint(name).qpos = value
    mujoco.mj_forward(model, data)
    assert data.ne == 1 and abs(data.efc_pos[0]) < 1e-15


# The second has a hinge on a block of which no word can tell the angle.
def test_random_linkages_come_back_from_mjcf(tmp_path):
    check_is_read(tmp_path, [3, 18])


@pytest.mark.nightly
def test_more_random_linkages_come_back_from_mjcf(tmp_path):
    check_is_read(tmp_path, range(18))
