# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Publishers that track their subscriber count, and publishers that patch one message."""

from __future__ import annotations

from typing import Any, Callable, Optional, Sequence

import numpy as np
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from .message_layout import NoLayout, Template, unpack

# For messages published once, which later subscribers receive, too.
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class TrackedPublisher:
    """
    A publisher that updates `has_subscribers` on events, without a query for each message.

    `own` is the number of this process's subscriptions, which do not count. `changed` is called on
    the executor's thread when the first subscriber comes and when the last one leaves.
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


class PatchedPublisher:
    """
    Publishes one message repeatedly with new values; `build` and `count` as for Template.

    If the message cannot be patched, `template` is None, and ordinary messages are built, which is
    logged once.
    """

    def __init__(self, publisher: Any, build: Callable, count: int, logger: Any):
        self.publisher = publisher
        self._build = build
        self.template: Optional[Template] = None
        try:
            self.template = Template(build, count)
        except NoLayout as reason:
            logger.warning(f'{publisher.topic_name}: {reason}; publishing ordinary messages',
                           once=True)

    def publish(self, stamp: bytes, values: Sequence[Any]) -> None:
        """Publish the message with a packed stamp and values, given as consecutive arrays."""
        joined: Any = np.concatenate(values) if len(values) > 1 else values[0]
        if self.template:
            self.publisher.publish(self.template.patched(stamp, joined))
        else:
            self.publisher.publish(self._build(unpack(stamp), joined))
