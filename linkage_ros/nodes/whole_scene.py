# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The topics of the whole scene, for one robot_state_publisher: all joints, and a robot model."""

import numpy as np
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from .heard import Topic
from .message_layout import unpack, Wire
from .messages import JointStates

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class WholeScene:
    """
    Publishes `joint_states` and `robot_description`.

    Parameters
    ----------
    node : rclpy.node.Node
        Whose topics they are.
    sources : iterable of str
        The joints that it hears on `crank_states`: where that is the same topic, they are not
        said again.

    changed : callable
        Called when somebody begins to listen to the joints, or nobody does any more.

    """

    def __init__(self, node, sources, changed):
        same = node.resolve_topic_name('joint_states') == node.resolve_topic_name('crank_states')
        # The node hears its own joints there.
        self._joint_states = Topic(node, JointState, 'joint_states', 10, changed, int(same))
        self._descriptions = node.create_publisher(String, 'robot_description', LATCHED)
        self._said = frozenset(sources if same else ())
        self._logger, self._joints = node.get_logger(), JointStates()
        self._kind = self._wire = None
        self._description = ''

    @property
    def is_heard(self) -> bool:
        """Whether anybody but the node itself listens to the joints."""
        return self._joint_states.is_heard

    def describe(self, text: str):
        """Publish a robot model, if there is one and it is another."""
        if text not in ('', self._description):
            self._description = text
            self._descriptions.publish(String(data=text))

    def send(self, mechanisms, stamp: bytes):
        """
        Publish the joints that are known, if anybody listens.

        Parameters
        ----------
        mechanisms : iterable of MechanismPublisher
            What is in the scene.
        stamp : bytes
            The time, packed.

        """
        shown = [known for mechanism in mechanisms if (known := mechanism.known())
                 and known[1].can_be] if self.is_heard else []
        if not shown:
            return
        if any(pose.held is not None or model.machine.loads for model, pose in shown):
            self._joint_states.publish(self._message(unpack(stamp), shown))
            return
        self.wire(shown).send(stamp, np.concatenate([pose.values for _, pose in shown]))

    def wire(self, shown) -> Wire:
        """Return what patches the message of models and poses, which have all their legs."""
        kind = [(model, pose.layout, pose.moving) for model, pose in shown]
        if kind != self._kind:
            self._kind, self._wire = kind, Wire(
                self._joint_states.publisher,
                lambda stamp, values: self._message(stamp, _with(shown, values)),
                sum(pose.values.size for _, pose in shown), self._logger)
        return self._wire

    def _message(self, stamp, shown) -> JointState:
        names, positions, velocities, efforts = map(np.concatenate, zip(
            *(model.joints(pose) for model, pose in shown)))
        chosen = [name not in self._said for name in names]
        known = all(pose.moving for _, pose in shown)
        loaded = any(model.machine.loads for model, _ in shown) and not np.isnan(efforts).any()
        return self._joints.message(stamp, names[chosen].tolist(), positions[chosen],
                                    velocities[chosen] if known else (),
                                    efforts[chosen] if loaded else ())


def _with(shown, values):
    """Return models with poses of other values, which follow each other."""
    ends = np.cumsum([pose.values.size for _, pose in shown])
    return [(model, pose._replace(values=part))
            for (model, pose), part in zip(shown, np.split(values, ends))]
