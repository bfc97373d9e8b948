# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Publishers that track whether they have subscribers, and publishers that patch a message."""

from __future__ import annotations

from typing import Any, Callable, Sequence, Tuple

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from .message_layout import NoLayout, Template, unpack

# Later subscribers receive the last message, too.
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class TrackedPublisher:
    """
    A publisher that events tell whether it has subscribers, so that no message needs a query.

    `own` is the number of this process's subscriptions, which do not count.

    Attributes
    ----------
    has_subscribers : bool
        Whether there are any.
    subscribed : Publisher, optional
        The publisher if there are any, else None.

    """

    def __init__(self, node: Node, type_: Any, name: str, qos: Any, own: int = 0):
        self.has_subscribers, self.subscribed, self._own = False, None, own
        self.publisher = node.create_publisher(
            type_, name, qos, event_callbacks=PublisherEventCallbacks(matched=self._count))
        self.publish = self.publisher.publish

    def _count(self, _: Any) -> None:
        self.has_subscribers = self.publisher.get_subscription_count() > self._own
        self.subscribed = self.publisher if self.has_subscribers else None


class PatchedPublisher:
    """
    Publishes messages again and again with new values.

    `parts` are, for each message, its publisher and its builder; builders and `count` are as for
    Template. If a message cannot be patched, a warning is logged, `template` is None, and every
    message is built.
    """

    def __init__(self, parts: Sequence[Tuple[Any, Callable]], count: int, logger: Any):
        self._parts, self.template = parts, None
        self._publish = [publisher.publish for publisher, _ in parts]
        try:
            self.template = Template([build for _, build in parts], count)
        except NoLayout as reason:
            topics = ', '.join(publisher.topic_name for publisher, _ in parts)
            logger.warning(f'{topics}: {reason}; each message is built anew, which takes longer',
                           once=True)

    def publish(self, stamp: bytes, values: Any) -> None:
        """Publish the messages with a packed stamp and values (count,)."""
        if self.template:
            for publish, data in zip(self._publish, self.template.patched(stamp, values)):
                publish(data)
        else:
            for publish, (_, build) in zip(self._publish, self._parts):
                publish(build(unpack(stamp), values))
