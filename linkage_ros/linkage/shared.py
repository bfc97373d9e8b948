# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What equal linkages share: they are one object, and what is found of it is remembered there.

So reach, travels and code are found once for a thousand equal mechanisms, and gone with the last.
"""

from __future__ import annotations

from collections import deque
from functools import update_wrapper
from typing import Any, Callable
from weakref import WeakValueDictionary


class Shared:
    """
    A function that returns the same thing for the same arguments as long as anybody holds it.

    Parameters
    ----------
    make : callable
        The function.
    latest : int
        How many things, the last that were made, are held though nobody else may hold them.

    """

    def __init__(self, make: Callable, latest: int):
        self._make, self._latest = make, latest
        self.cache_clear()
        update_wrapper(self, make)

    def __call__(self, *args: Any) -> Any:
        made = self._made.get(args)
        if made is None:
            made = self._made[args] = self._make(*args)
            self._held.append(made)
        return made

    def cache_clear(self) -> None:
        """Make all anew."""
        self._made: WeakValueDictionary = WeakValueDictionary()
        self._held: deque = deque(maxlen=self._latest)
