# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Log repeated events: throttled, or once each up to a limit."""

from __future__ import annotations

from functools import wraps
import math
import time
import traceback
from typing import Any, Callable, Hashable, Iterable

from rclpy.impl.implementation_singleton import rclpy_implementation

RCLError = rclpy_implementation.RCLError
InvalidHandle = rclpy_implementation.InvalidHandle
# Most subjects that are throttled; most kinds of errors that are logged; unknown names after which
# further ones are not logged: a sender that makes up names would fill the log.
MAX_SUBJECTS, MAX_ERRORS, MAX_NAMES = 1000, 100, 20


class Throttle:
    """Logs warnings, about each subject at most one in some `seconds`."""

    seconds = 5.0

    def __init__(self, logger: Any):
        self._logger = logger
        self._logged: dict[Any, float] = {}

    def warn(self, subject: Any, text: Callable[[], str]) -> None:
        """Log the result of `text`, unless the subject was logged within the last `seconds`."""
        now = time.monotonic()
        if now < self._logged.get(subject, -math.inf) + self.seconds:
            return
        if len(self._logged) == MAX_SUBJECTS:
            self._logged.clear()
        self._logged[subject] = now
        self._logger.warning(text())


class Once:
    """A record of logged subjects, so that each is logged once, and no more after `limit`."""

    def __init__(self, limit: int):
        self._limit = limit
        # Hashes, because names may be long.
        self._logged: set[int] = set()

    def new(self, subjects: Iterable[Hashable]) -> list[Any]:
        """Return the subjects that no call has returned before; none after `limit` of them."""
        if len(self._logged) >= self._limit:
            return []
        new = [subject for subject in dict.fromkeys(subjects)
               if hash(subject) not in self._logged]
        self._logged.update(map(hash, new))
        return new

    @property
    def ending(self) -> str:
        """Text that ends the warning which reaches the limit; empty before."""
        return '; no more will be named' if len(self._logged) >= self._limit else ''


class Incidents:
    """Logs unexpected exceptions once each, unless `is_ending` returns true."""

    def __init__(self, logger: Any, is_ending: Callable[[], bool]):
        self._logger, self._is_ending, self._once = logger, is_ending, Once(MAX_ERRORS)

    def report(self, what: str, error: Exception) -> None:
        """Log an exception with the place where it was raised; `what` was being handled."""
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
