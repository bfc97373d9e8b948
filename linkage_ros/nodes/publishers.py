# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Publishers that track their subscriber count, so that no message has to ask for it."""

from __future__ import annotations

from typing import Any, Callable

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

# For what is published once and wanted by every later subscriber.
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class TrackedPublisher:
    """
    A publisher that knows whether it has subscribers.

    Parameters
    ----------
    node, type_, name, qos
        As for `Node.create_publisher`.
    changed : callable
        Called on the executor's thread when the first subscriber comes and when the last leaves.
    own : int
        Subscriptions of this process that do not count.

    Attributes
    ----------
    has_subscribers : bool
        Whether there are more subscriptions than those, as of the last event of the middleware.

    """

    def __init__(self, node: Node, type_: Any, name: str, qos: Any,
                 changed: Callable[[], None] = lambda: None, own: int = 0):
        self.has_subscribers, self._own, self._changed = False, own, changed
        self.publisher = node.create_publisher(
            type_, name, qos, event_callbacks=PublisherEventCallbacks(matched=self._count))
        self.publish = self.publisher.publish

    def _count(self, _: Any) -> None:
        has_subscribers = self.publisher.get_subscription_count() > self._own
        if has_subscribers != self.has_subscribers:
            self.has_subscribers = has_subscribers
            self._changed()
