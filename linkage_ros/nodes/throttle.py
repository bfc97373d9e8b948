# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Warnings that are worded and logged now and then, or once, however often their reason comes."""

from __future__ import annotations

from collections import OrderedDict
import math
import time
from typing import Any, Callable, Iterable, List, Set

# Between two warnings about one subject [s], and how many subjects are remembered.
SECONDS, SUBJECTS = 5.0, 1000


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
    """
    Names that are warned about once each, up to a number of them.

    Parameters
    ----------
    most : int
        How many names are warned about.

    """

    def __init__(self, most: int):
        self._most = most
        # Names may be long: their hashes are enough.
        self._seen: Set[int] = set()

    def new(self, names: Iterable[str]) -> List[str]:
        """Return those of the names that come for the first time, as long as there is room."""
        room = self._most - len(self._seen)
        new = [name for name in dict.fromkeys(names) if hash(name) not in self._seen][:room]
        self._seen.update(map(hash, new))
        return new

    @property
    def ending(self) -> str:
        """What the warning ends with."""
        return '; no more will be named' if len(self._seen) == self._most else ''
