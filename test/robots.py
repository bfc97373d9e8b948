# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Robot models as libraries see them that know nothing of this package."""

from io import BytesIO
import math

import numpy as np
import pytest


class Yourdfpy:
    """A robot of yourdfpy, in Python."""

    def __init__(self, text):
        library = pytest.importorskip('yourdfpy')
        self.robot = library.URDF.load(BytesIO(text.encode()), load_meshes=False)
        self.joints = self.robot.actuated_joint_names

    def places(self, positions, names):
        """Return where frames are [m], by name, at joint positions."""
        self.robot.update_cfg({name: float(value) for name, value in positions.items()})
        return {name: self.seen_from(None, name) for name in names}

    def seen_from(self, base, name):
        """Return where a frame is now, in another [m]."""
        return self.robot.get_transform(name, base)[:3, 3]


class Pinocchio:
    """A robot of Pinocchio, in C++, read by the parser of ROS."""

    def __init__(self, text):
        self._library = pytest.importorskip('pinocchio')
        self._model = self._library.buildModelFromXML(text)
        self._data = self._model.createData()
        self.joints = list(self._model.names)[1:]

    def places(self, positions, names):
        """Return where frames are [m], by name, at joint positions."""
        q = self._library.neutral(self._model)
        for name, value in positions.items():
            joint = self._model.joints[self._model.getJointId(name)]
            ends = [value] if joint.nq == 1 else [math.cos(value), math.sin(value)]
            q[joint.idx_q:joint.idx_q + joint.nq] = ends
        self._library.framesForwardKinematics(self._model, self._data, q)
        return {name: self._data.oMf[self._model.getFrameId(name)].translation.copy()
                for name in names}


def in_frame(pose, point):
    """Return a marker's point [m] in the marker's frame, turned by the quaternion of its pose."""
    q, p = pose.orientation, np.array([point.x, point.y, point.z])
    axis = np.array([q.x, q.y, q.z])
    turned = p + 2.0 * np.cross(axis, np.cross(axis, p) + q.w * p)
    return turned + [pose.position.x, pose.position.y, pose.position.z]


LIBRARIES = [Yourdfpy, Pinocchio]
