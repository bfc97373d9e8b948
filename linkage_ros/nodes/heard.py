# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Topics that know whether anybody hears them, without asking at each message."""

from rclpy.event_handler import PublisherEventCallbacks


class Topic:
    """
    What is published under a name.

    Parameters
    ----------
    node, type_, name, qos
        As for `Node.create_publisher`.
    changed : callable
        Called when it has become heard, or unheard, on the executor's thread.
    own : int
        How many of its subscriptions do not count.

    Attributes
    ----------
    is_heard : bool
        Whether it has more subscriptions than those, as the middleware last told the executor.

    """

    def __init__(self, node, type_, name: str, qos, changed, own: int = 0):
        self.is_heard, self.own, self._changed = False, own, changed
        self.publisher = node.create_publisher(
            type_, name, qos, event_callbacks=PublisherEventCallbacks(matched=self._count))
        self.publish = self.publisher.publish

    def _count(self, _):
        heard = self.publisher.get_subscription_count() > self.own
        if heard != self.is_heard:
            self.is_heard = heard
            self._changed()
