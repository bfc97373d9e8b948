# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Robot models as libraries see them that know nothing of this package; the command from_robot."""

from contextlib import redirect_stderr, redirect_stdout
from functools import lru_cache
from importlib.util import find_spec
from io import BytesIO, StringIO
import math
from pathlib import Path
from tempfile import TemporaryDirectory

from linkage_ros import scene
from linkage_ros.robot_files import cli
import numpy as np
import pytest

ROBOTS = Path(__file__).with_name('robot_files')


def written(folder, file, *changes):
    """Return a file that is another with some of its text changed."""
    text = (ROBOTS / file).read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return of_text(folder / file, text)


def of_text(path, text):
    """Return a file with a text; the test is skipped where nothing reads it."""
    if '<mujoco' in text:
        pytest.importorskip('mujoco', reason='MJCF is read by MuJoCo: pip install mujoco')
    path.write_text(text, encoding='utf-8')
    return path


def printed(file, *args):
    """Return the exit code of the command, and what it prints as output and as errors."""
    if str(file).endswith('.xml'):
        pytest.importorskip('mujoco')
    pytest.importorskip('yaml')
    args = [str(ROBOTS / file), *map(str, args)]
    return _printed(*args, texts=tuple(
        Path(arg).read_bytes() for arg in args if Path(arg).is_file()))


@lru_cache(None)
def _printed(*args, texts):
    with redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()) as err:
        code = cli.main([*args])
    return code, out.getvalue(), err.getvalue()


def refused(file, *args):
    """Return the sentences that refuse a file, a line for each loop."""
    code, out, err = printed(file, *args)
    assert code == 1 and not out and 'Traceback' not in err
    assert err.count('\n') == err.count('from_robot: ') > 0
    return err


def said(file, *args):
    """Return what is said of a file from which a scene is made."""
    code, _, err = printed(file, *args)
    assert code == 0, err
    return err


def imported(file, *args):
    """Return the mechanisms of the scene of a file."""
    code, out, err = printed(file, *args)
    assert code == 0, err
    with TemporaryDirectory() as folder:
        return [*scene.load(str(of_text(Path(folder, 'scene.yaml'), out))).mechanisms.values()]


def published(mechanism, **motors):
    """Return the positions of a robot's joints where its motors are, motors included."""
    values = [settings.ratio * motors[settings.source] + settings.offset
              for settings in mechanism.inputs.values()]
    angles = mechanism.linkage.joint_angles(values if len(values) > 1 else values[0])
    assert mechanism.only_named
    return {**motors, **{called.name: float(called.of(angles[link]))
                         for link, called in mechanism.joints.items() if called.published}}


class Yourdfpy:
    """A robot of yourdfpy, in Python."""

    def __init__(self, text):
        library = pytest.importorskip('yourdfpy')
        self.robot = library.URDF.load(BytesIO(text.encode()), load_meshes=False)
        assert self.robot.validate()
        self.joints = self.robot.actuated_joint_names

    def places(self, positions, names, base=None):
        """Return where frames are in another [m], by name, at joint positions."""
        self.robot.update_cfg({name: float(value) for name, value in positions.items()})
        return {name: self.robot.get_transform(name, base)[:3, 3] for name in names}


class Pinocchio:
    """A robot of Pinocchio, in C++, read by the parser of ROS."""

    def __init__(self, text):
        self._library = pytest.importorskip('pinocchio')
        self._model = self._library.buildModelFromXML(text)
        self._data = self._model.createData()
        self.joints = list(self._model.names)[1:]

    def places(self, positions, names, base='universe'):
        """Return where frames are in another [m], by name, at joint positions."""
        q = self._library.neutral(self._model)
        for name, value in positions.items():
            joint = self._model.joints[self._model.getJointId(name)]
            ends = [value] if joint.nq == 1 else [math.cos(value), math.sin(value)]
            q[joint.idx_q:joint.idx_q + joint.nq] = ends
        self._library.framesForwardKinematics(self._model, self._data, q)
        base, *frames = (self._data.oMf[self._model.getFrameId(name)] for name in (base, *names))
        return {name: base.actInv(frame).translation for name, frame in zip(names, frames)}


class MuJoCo:
    """A model of MuJoCo in its keyframe, if it has one; it knows its loops."""

    def __init__(self, text):
        self.library = pytest.importorskip('mujoco', reason='pip install mujoco')
        self.model = self.library.MjModel.from_xml_string(text)
        self.data = self.library.MjData(self.model)
        self.joints = [self.model.joint(i).name for i in range(self.model.njnt)]
        if self.model.nkey:
            self.library.mj_resetDataKeyframe(self.model, self.data, 0)
        self.place({})

    def place(self, positions):
        """Put joints at positions, and what they move."""
        for name, value in positions.items():
            self.data.joint(name).qpos = value
        self.library.mj_forward(self.model, self.data)

    def open(self):
        """Return how far what is tied together is apart [m]."""
        self.library.mj_forward(self.model, self.data)
        return np.abs(self.data.efc_pos[:self.data.ne]).max(initial=0.0)


def words(numbers):
    """Return numbers as a file has them, with all their digits."""
    return ' '.join(repr(float(number)) for number in numbers)


def rotation(angles):
    """Return the rotation by angles about fixed x, y, z in turn."""
    turned = np.eye(3)
    for angle, (i, j) in zip(angles, ((1, 2), (2, 0), (0, 1))):
        step = np.eye(3)
        step[[i, j], [i, j]], step[j, i], step[i, j] = np.cos(angle), np.sin(angle), -np.sin(angle)
        turned = step @ turned
    return turned


def turned(x, y, z, *angles):
    """Return a pose as a matrix: about the fixed axes x, y and z in turn."""
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = rotation(angles), (x, y, z)
    return made


def in_frame(pose, point):
    """Return a marker's point [m] in the marker's frame, turned by the quaternion of its pose."""
    q, p = pose.orientation, np.array([point.x, point.y, point.z])
    axis = np.array([q.x, q.y, q.z])
    turned = p + 2.0 * np.cross(axis, np.cross(axis, p) + q.w * p)
    return turned + [pose.position.x, pose.position.y, pose.position.z]


# Pinocchio has no wheels for numpy 1, and yourdfpy takes half a second to be imported.
FIRST, OTHER = (Pinocchio, Yourdfpy) if find_spec('pinocchio') else (Yourdfpy, Pinocchio)
LIBRARIES = [FIRST, pytest.param(OTHER, marks=pytest.mark.nightly)]
