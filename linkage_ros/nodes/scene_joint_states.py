# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Topics of the whole scene, as robot_state_publisher uses them: joints and a robot model."""

from __future__ import annotations

from functools import partial
from typing import Any, Iterable, Sequence

import numpy as np
from sensor_msgs.msg import JointState

from .mechanism_model import AssemblyState, MAX_MESSAGES, MechanismModel
from .message_layout import Outgoing, PatchedMessages
from .messages import joint_states
from .publishers import TextPublisher, TrackedPublisher
from ..cache import Cache

# The model and the state of each mechanism in a message.
Parts = tuple[tuple[MechanismModel, AssemblyState], ...]


class SceneJointStates:
    """
    Publishes `joint_states` and `robot_description`.

    If `crank_states` is remapped to `joint_states`, the source joints `sources` are on that topic
    already, and are not published again.

    Attributes
    ----------
    joint_states : TrackedPublisher
        Its subscribers are those other than the node itself.
    description : TextPublisher
        Of the URDF of the scene.

    """

    def __init__(self, node: Any, sources: Iterable[str]):
        same = node.resolve_topic_name('joint_states') == node.resolve_topic_name('crank_states')
        # If the topics are the same, the node's own subscription does not count.
        self.joint_states = TrackedPublisher(node, JointState, 'joint_states', 10, int(same))
        self.description = TextPublisher(node, 'robot_description')
        self._omitted = frozenset(sources if same else ())
        self._patched = Cache(self._patched_messages, MAX_MESSAGES)

    def outgoing(self, stamp: bytes, parts: Parts) -> Sequence[Outgoing]:
        """Return the message to publish, the joints of assembled mechanisms; none without any."""
        return self._patched[parts].patched(
            stamp, np.concatenate([state.solution.values for _, state in parts])) if parts else ()

    def _patched_messages(self, parts: Parts) -> PatchedMessages:
        return PatchedMessages([(self.joint_states.publish, partial(self._build, parts))],
                               sum(state.solution.values.size for _, state in parts))

    def _build(self, parts: Parts, stamp: Any, values: np.ndarray) -> JointState:
        """Build the message from the consecutive values of the solutions."""
        ends = np.cumsum([state.solution.values.size for _, state in parts])
        names, positions, velocities, efforts = map(np.concatenate, zip(
            *(model.joints(state, part)
              for (model, state), part in zip(parts, np.split(values, ends)))))
        chosen = [name not in self._omitted for name in names]
        moving = all(state.has_velocities for _, state in parts)
        loaded = {state.has_efforts for _, state in parts
                  if state.solution.parts['efforts'].size} == {True}
        return joint_states(
            stamp, names[chosen].tolist(), positions[chosen], velocities[chosen] if moving else (),
            efforts[chosen] if loaded else ())
