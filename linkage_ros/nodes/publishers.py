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

from typing import Any, Callable, Optional, Sequence

import numpy as np
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from .message_layout import NoLayout, Template, unpack

# Later subscribers receive the last message, too.
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class TrackedPublisher:
    """
    A publisher whose flag `has_subscribers` is updated by events, not by a query per message.

    `own` is the number of this process's subscriptions, which do not count. `changed` is called on
    the thread of rclpy's executor when the flag has changed.
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
    Publishes a message again and again with new values; `build` and `count` as for Template.

    If the message cannot be patched, a warning is logged, `template` is None, and every message
    is built.
    """

    def __init__(self, publisher: Any, build: Callable, count: int, logger: Any):
        self.publisher = publisher
        self._build = build
        self.template: Optional[Template] = None
        try:
            self.template = Template(build, count)
        except NoLayout as reason:
            logger.warning(f'{publisher.topic_name}: {reason}; each message is built anew, which '
                           'takes longer', once=True)

    def publish(self, stamp: bytes, values: Sequence[Any]) -> None:
        """Publish the message with a packed stamp and the numbers of all arrays `values`."""
        joined: Any = np.concatenate(values) if len(values) > 1 else values[0]
        if self.template:
            self.publisher.publish(self.template.patched(stamp, joined))
        else:
            self.publisher.publish(self._build(unpack(stamp), joined))
