# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Logging of repeated events: throttled, once, and up to a limit."""

from __future__ import annotations

from collections import OrderedDict
from functools import wraps
import math
import time
import traceback
from typing import Any, Callable, Hashable, Iterable, List, Set

from rclpy.impl.implementation_singleton import rclpy_implementation

RCLError = rclpy_implementation.RCLError
InvalidHandle = rclpy_implementation.InvalidHandle
# Time between two warnings about one subject [s], cached subjects, and logged errors.
SECONDS, SUBJECTS, ERRORS = 5.0, 1000, 100


class Throttle:
    """Warnings of a logger, each subject at most once in `SECONDS`."""

    def __init__(self, logger: Any):
        self._logger = logger
        self._logged: OrderedDict[Any, float] = OrderedDict()

    def warn(self, subject: Any, text: Callable[[], str]) -> None:
        """Log the result of `text`, which is called only if needed."""
        now = time.monotonic()
        if now < self._logged.get(subject, -math.inf) + SECONDS:
            return
        self._logged[subject] = now
        self._logged.move_to_end(subject)
        if len(self._logged) > SUBJECTS:
            self._logged.popitem(last=False)
        self._logger.warning(text())


class Once:
    """Subjects that are logged once each, up to a limit."""

    def __init__(self, most: int):
        self._most = most
        # Names may be long: their hashes are enough.
        self._seen: Set[int] = set()

    def new(self, subjects: Iterable[Hashable]) -> List[Any]:
        """Return the new subjects, up to the limit."""
        room = self._most - len(self._seen)
        new = [one for one in dict.fromkeys(subjects) if hash(one) not in self._seen][:room]
        self._seen.update(map(hash, new))
        return new

    @property
    def ending(self) -> str:
        """The ending of the last warning."""
        return '; no more will be named' if len(self._seen) == self._most else ''


class Incidents:
    """Logs unexpected exceptions, each kind once; none while the context `is_ending`."""

    def __init__(self, logger: Any, is_ending: Callable[[], bool]):
        self._logger, self._is_ending, self._once = logger, is_ending, Once(ERRORS)

    def report(self, what: str, error: Exception) -> None:
        """Log an exception, what was being handled, and where it was raised."""
        frame = traceback.extract_tb(error.__traceback__)[-1]
        if not self._is_ending() and self._once.new([
                (what, type(error), frame.filename, frame.lineno)]):
            self._logger.error(f'internal error in {what}, which is dropped: {error!r} '
                               f'({frame.filename}:{frame.lineno}); logged once')

    def guarded(self, what: str, callback: Callable) -> Callable:
        """Return a callback whose exceptions are reported."""
        @wraps(callback)
        def guarded(*args: Any) -> Any:
            try:
                return callback(*args)
            except Exception as error:
                self.report(what, error)
                return None

        return guarded
