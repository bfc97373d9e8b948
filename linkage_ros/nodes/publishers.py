# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Publishers that track whether they have subscribers."""

from __future__ import annotations

from typing import Any

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

# Later subscribers receive the last message, too.
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class TextPublisher:
    """A publisher of a latched text whenever it changes."""

    def __init__(self, node: Node, name: str):
        self._publisher, self._text = node.create_publisher(String, name, LATCHED), ''

    def publish(self, text: str) -> None:
        """Publish a text if it has changed, also to an empty one."""
        if text != self._text:
            self._text = text
            self._publisher.publish(String(data=text))


class TrackedPublisher:
    """
    A publisher that events tell whether it has subscribers, so that no message needs a query.

    `ignored` is the number of this process's subscriptions, which do not count.

    Attributes
    ----------
    has_subscribers : bool
        Whether there are any.
    subscribed : Publisher, optional
        The publisher if there are any, else None.

    """

    def __init__(self, node: Node, type_: Any, name: str, qos: Any, ignored: int = 0):
        self.has_subscribers, self.subscribed, self._ignored = False, None, ignored
        self.publisher = node.create_publisher(
            type_, name, qos, event_callbacks=PublisherEventCallbacks(matched=self._count))
        self.publish = self.publisher.publish

    def _count(self, _: Any) -> None:
        self.has_subscribers = self.publisher.get_subscription_count() > self._ignored
        self.subscribed = self.publisher if self.has_subscribers else None
