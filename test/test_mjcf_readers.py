# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Robots in MJCF, against MuJoCo: where its bodies are, what it ties, and how far that is open."""

import numpy as np
import pytest
from robots import MuJoCo, of_text, Pinocchio, words

pytest.importorskip('mujoco', reason='MJCF is read by MuJoCo: pip install mujoco')

from linkage_ros.robot_files import readers  # noqa: E402
from linkage_ros.robot_model.urdf import write  # noqa: E402

NAMES = ['a b', 'joint-1', '3', 'Hüfte', 'x&quot;y', "o'k", 'l&#10;e', *'fghimnopq']


class Tree:
    """
    A random tree of bodies with several joints each, as MJCF with a keyframe.

    Attributes
    ----------
    joints, bodies : list of str
        Names in the text, where signs of XML are escaped.
    text : str
        The MJCF, with what ties bodies as `equality`.

    """

    def __init__(self, rng, equality=''):
        self._rng, self._names = rng, iter(rng.permutation(NAMES))
        self.joints, self.bodies = [], []
        bodies = self._body(0) + self._body(0)
        motors = ''.join(f'<motor joint="{name}"/>' for name in self.joints[::2])
        self.text = (
            f'<mujoco><compiler angle="{rng.choice(["degree", "radian"])}" eulerseq="zyx"/>'
            f'<worldbody>{bodies}</worldbody><equality>{equality}</equality>'
            f'<tendon><fixed name="t"><joint joint="{self.joints[1]}" coef="2"/></fixed></tendon>'
            f'<actuator>{motors}<position tendon="t"/></actuator><keyframe>'
            f'<key qpos="{words(rng.normal(size=len(self.joints)))}"/></keyframe></mujoco>')

    def _vector(self, scale=1.0):
        return words(self._rng.normal(size=3) * scale)

    def _body(self, depth):
        rng, name, joints = self._rng, f'b{len(self.bodies)}', ''
        self.bodies.append(name)
        for _ in range(rng.integers(depth == 0, 3)):
            self.joints.append(next(self._names, f'k{len(self.joints)}'))
            joints += (f'<joint name="{self.joints[-1]}" pos="{self._vector(0.1)}" '
                       f'axis="{self._vector()}" type="{rng.choice(["hinge", "slide"])}" '
                       f'ref="{rng.normal():.3f}" armature="0.1"/>')
        return (f'<body name="{name}" pos="{self._vector()}" euler="{self._vector(50)}">{joints}'
                f'<geom size="0.1"/><site name="{name}" pos="{self._vector()}" '
                f'euler="{self._vector(50)}"/>'
                f'{"".join(self._body(depth + 1) for _ in range(rng.integers(3 - depth)))}</body>')


@pytest.mark.parametrize('seed', range(12))
def test_a_tree_of_mujoco_is_the_same_tree_as_urdf(tmp_path, seed):
    rng = np.random.default_rng(seed)
    tree = Tree(rng)
    file = of_text(tmp_path / 'tree.xml', tree.text)
    robot = readers.read(str(file))
    there = MuJoCo(tree.text)
    data = there.data
    for i, body in enumerate(tree.bodies):
        assert robot.frames[body][:3, 3] == pytest.approx(data.xpos[i + 1], abs=1e-13)
        assert robot.frames[body][:3, :3].ravel() == pytest.approx(data.xmat[i + 1], abs=1e-13)
    names = there.joints
    assert robot.positions == {name: data.joint(name).qpos[0] for name in names}
    assert robot.driven == [*names[::2], names[1]]
    positions = dict(zip(names, rng.normal(size=len(names)).tolist()))
    places = Pinocchio(write(robot)).places(positions, tree.bodies)
    there.place(positions)
    for i, place in enumerate(data.xpos[1:]):
        assert places[tree.bodies[i]] == pytest.approx(place, abs=1e-13)


TIES = {
    'connect': '<connect body1="b0" body2="b1" anchor="{0} {1} {2}"/>',
    'connect of sites': '<connect site1="b0" site2="b1"/>',
    'weld': '<weld body1="b0" body2="b1" anchor="{0} {1} {2}" relpose="{3} {4} {5} {6} {7} {8} '
            '{9}"/>',
    'weld of the pose': '<weld body1="b0" body2="b1"/>',
    'weld of sites': '<weld site1="b0" site2="b1"/>'}


@pytest.mark.parametrize('seed', range(4))
@pytest.mark.parametrize('tie', TIES)
def test_a_tie_is_open_as_far_as_mujoco_has_it(tmp_path, tie, seed):
    rng = np.random.default_rng(seed)
    more = TIES[tie].format(*rng.normal(size=10))
    file = of_text(tmp_path / 'tree.xml', Tree(rng, more + (
        '<weld body1="b0" body2="world" active="false"/>')).text)
    cut, = (joint for joint in readers.read(str(file)).joints if joint.is_cut)
    data = MuJoCo(file.read_text()).data
    assert (cut.kind, cut.bodies) == ('fixed' if 'weld' in tie else 'ball', ('b0', 'b1'))
    apart, *turned = np.split(data.efc_pos, [3])
    assert np.linalg.norm(np.subtract(*cut.places)) == pytest.approx(np.linalg.norm(apart))
    if 'weld' in tie:
        # MuJoCo has the sine of half the angle.
        half = np.linalg.norm(turned[0])
        assert np.trace(cut.axes[0].T @ cut.axes[1]) == pytest.approx(3.0 - 4.0 * half ** 2)
    else:
        assert not turned[0].size


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
    there = MuJoCo(file.read_text())
    there.place(positions)
    assert there.data.ne == 1 and there.open() < 1e-15
