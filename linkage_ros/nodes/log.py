# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What is logged of what comes again and again: now and then, once, and how much at most."""

from __future__ import annotations

from collections import OrderedDict
from functools import wraps
import math
import time
import traceback
from typing import Any, Callable, Hashable, Iterable, List, Set

from rcl_interfaces.msg import SetParametersResult
from rclpy.impl.implementation_singleton import rclpy_implementation

RCLError = rclpy_implementation.RCLError
InvalidHandle = rclpy_implementation.InvalidHandle
# Between two warnings about one subject [s], how many subjects are cached, and how many different
# errors are logged.
SECONDS, SUBJECTS, ERRORS = 5.0, 1000, 100


class Throttle:
    """Warnings of a logger, each subject at most once in `SECONDS`."""

    def __init__(self, logger: Any):
        self._logger = logger
        self._logged: OrderedDict[Any, float] = OrderedDict()

    def warn(self, subject: Any, text: Callable[[], str]) -> None:
        """Log what `text` returns, which is called only if it is logged."""
        now = time.monotonic()
        if now < self._logged.get(subject, -math.inf) + SECONDS:
            return
        self._logged[subject] = now
        self._logged.move_to_end(subject)
        if len(self._logged) > SUBJECTS:
            self._logged.popitem(last=False)
        self._logger.warning(text())


class Once:
    """Subjects that are logged once each, up to a number of them."""

    def __init__(self, most: int):
        self._most = most
        # Names may be long: their hashes are enough.
        self._seen: Set[int] = set()

    def new(self, subjects: Iterable[Hashable]) -> List[Any]:
        """Return the subjects that come for the first time, as long as there is room."""
        room = self._most - len(self._seen)
        new = [one for one in dict.fromkeys(subjects) if hash(one) not in self._seen][:room]
        self._seen.update(map(hash, new))
        return new

    @property
    def ending(self) -> str:
        """What the last warning ends with."""
        return '; no more will be named' if len(self._seen) == self._most else ''


class Incidents:
    """Logs unexpected exceptions, each kind once; none while the context `is_ending`."""

    def __init__(self, logger: Any, is_ending: Callable[[], bool]):
        self._logger, self._is_ending, self._once = logger, is_ending, Once(ERRORS)

    def report(self, what: str, error: Exception) -> None:
        """Log what was being handled when an exception was raised, and where that was."""
        frame = traceback.extract_tb(error.__traceback__)[-1]
        if not self._is_ending() and self._once.new([
                (what, type(error), frame.filename, frame.lineno)]):
            self._logger.error(f'internal error in {what}, which is dropped: {error!r} '
                               f'({frame.filename}:{frame.lineno}); logged once')

    def guarded(self, what: str, callback: Callable) -> Callable:
        """Return a callback that reports what is raised."""
        @wraps(callback)
        def guarded(*args: Any) -> Any:
            try:
                return callback(*args)
            except Exception as error:
                self.report(what, error)
                return None

        return guarded


def refused(response: Any, reason: str) -> Any:
    """Return the response of a service whose request could not be handled."""
    result = SetParametersResult(successful=False, reason=reason)
    if hasattr(response, 'results'):
        response.results.append(result)
    elif hasattr(response, 'message'):
        response.success, response.message = False, reason
    elif isinstance(getattr(response, 'result', None), SetParametersResult):
        response.result = result
    return response
