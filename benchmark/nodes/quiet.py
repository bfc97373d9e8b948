# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

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
