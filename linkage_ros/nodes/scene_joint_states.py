# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Topics of the whole scene for robot_state_publisher: all joints, and a robot model."""

from __future__ import annotations

from typing import Any, Callable, Iterable, List, Optional, Sequence, Tuple

import numpy as np
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from .mechanism_model import MechanismModel, Pose
from .messages import joint_states
from .publishers import LATCHED, PatchedPublisher, TrackedPublisher
from ..cache import Cache

# Cached arrangements of the message.
ARRANGEMENTS = 16


class SceneJointStates:
    """
    Publishes `joint_states` and `robot_description`.

    `sources` are the joints on `crank_states`, which are omitted if that is the same topic.
    `changed` is called when subscribers come or go.
    """

    def __init__(self, node: Any, sources: Iterable[str], changed: Callable[[], None]):
        same = node.resolve_topic_name('joint_states') == node.resolve_topic_name('crank_states')
        # The node subscribes to its own joints there.
        self._joint_states = TrackedPublisher(
            node, JointState, 'joint_states', 10, changed, int(same))
        self._descriptions = node.create_publisher(String, 'robot_description', LATCHED)
        self._received = frozenset(sources if same else ())
        self._logger = node.get_logger()
        self._publishers = Cache(self._publisher, ARRANGEMENTS)
        self._description = ''

    @property
    def has_subscribers(self) -> bool:
        """Whether the joints have subscribers other than the node itself."""
        return self._joint_states.has_subscribers

    def describe(self, text: str) -> None:
        """Publish a robot model, unless it is empty or unchanged."""
        if text not in ('', self._description):
            self._description = text
            self._descriptions.publish(String(data=text))

    def message(self, members: Iterable[Any]) -> Optional[Tuple[PatchedPublisher, List]]:
        """Return the publisher of mechanisms' joints, and the arrays of their values."""
        poses = tuple((member.model, member.pose) for member in members
                      if member.pose and member.pose.exists)
        if not poses:
            return None
        return self._publishers[poses], [pose.solution.values for _, pose in poses]

    def _publisher(self, poses: Sequence[Tuple[MechanismModel, Pose]]) -> PatchedPublisher:
        return PatchedPublisher(
            self._joint_states.publisher,
            lambda stamp, values: self._built(poses, values, stamp),
            sum(pose.solution.layout.size for _, pose in poses), self._logger)

    def _built(self, poses: Sequence[Tuple[MechanismModel, Pose]], values: np.ndarray,
               stamp: Any) -> JointState:
        ends = np.cumsum([pose.solution.layout.size for _, pose in poses])
        names, positions, velocities, efforts = map(np.concatenate, zip(
            *(model.joints(pose, part)
              for (model, pose), part in zip(poses, np.split(values, ends)))))
        chosen = [name not in self._received for name in names]
        loaded = {pose.loaded for _, pose in poses if pose.solution.layout.efforts} == {True}
        moving = all(pose.moving for _, pose in poses)
        return joint_states(
            stamp, names[chosen].tolist(), positions[chosen], velocities[chosen] if moving else (),
            efforts[chosen] if loaded else ())
