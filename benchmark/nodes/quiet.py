# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Callbacks of the nodes that ours are compared with."""

from functools import wraps

from rclpy.impl.implementation_singleton import rclpy_implementation


def until_the_end(callback):
    """Let a callback of a node fail in silence where it fails because its context has ended."""
    @wraps(callback)
    def guarded(self, *args):
        try:
            callback(self, *args)
        except rclpy_implementation.RCLError:
            if self.context.ok():
                raise
    return guarded
