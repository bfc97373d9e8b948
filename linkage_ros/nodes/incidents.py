# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Errors of a callback: they are logged once each, and end nothing."""

from __future__ import annotations

from functools import wraps
import traceback
from typing import Any, Callable, Optional, Set, Tuple

from rcl_interfaces.msg import SetParametersResult
from rclpy.impl.implementation_singleton import rclpy_implementation

RCLError = rclpy_implementation.RCLError
InvalidHandle = rclpy_implementation.InvalidHandle
# How many different errors are logged.
MOST = 100


class Incidents:
    """
    Logs unexpected exceptions, each kind once.

    Parameters
    ----------
    logger : rclpy logger
        Where they go.
    is_ending : callable
        Whether the context is being shut down: what fails then is not worth a word.

    """

    def __init__(self, logger: Any, is_ending: Callable[[], bool]):
        self._logger, self._is_ending = logger, is_ending
        self._logged: Set[Tuple] = set()

    def report(self, what: str, error: Exception) -> None:
        """Log what was being handled when an exception was raised, and where that was."""
        if self._is_ending():
            return
        frame = traceback.extract_tb(error.__traceback__)[-1]
        kind = what, type(error), frame.filename, frame.lineno
        if kind not in self._logged and len(self._logged) < MOST:
            self._logged.add(kind)
            self._logger.error(f'internal error in {what}, which is dropped: {error!r} '
                               f'({frame.filename}:{frame.lineno}); logged once')

    def guarded(self, what: str, callback: Callable,
                failed: Optional[Callable[[], None]] = None) -> Callable:
        """Return a callback that reports what is raised, and calls `failed` then."""
        @wraps(callback)
        def guarded(*args: Any) -> Any:
            try:
                return callback(*args)
            except Exception as error:
                self.report(what, error)
                if failed:
                    failed()
                return None

        return guarded


def refused(response: Any, reason: str) -> Any:
    """Return the response of a service whose request could not be handled."""
    if hasattr(response, 'results'):
        response.results.append(SetParametersResult(successful=False, reason=reason))
    elif hasattr(response, 'message'):
        response.success, response.message = False, reason
    elif isinstance(getattr(response, 'result', None), SetParametersResult):
        response.result = SetParametersResult(successful=False, reason=reason)
    return response
