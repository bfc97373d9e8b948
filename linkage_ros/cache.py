# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Results by key: bounded, and safe to use from several threads.

A function of hashable arguments is decorated; an object with results of its own has a `Cache`::

    @cached(64)
    def design(joints, tracer): ...

    self._sources = Cache(read_source)    # self._sources[text] is read_source(text)
    self._found = Cache()                 # self._found.get_or_make(key, make) is make()

A `make` that is a method of the cache's owner is a reference cycle, which only the garbage
collector frees; `get_or_make` with a lambda avoids that.
"""

from __future__ import annotations

from functools import update_wrapper
from threading import RLock
from typing import Any, Callable, cast, Hashable, TypeVar
from weakref import WeakValueDictionary

Function = TypeVar('Function', bound=Callable)
# Default size: a few times the results of one mechanism that nodes, pages and services request.
SIZE = 128
_MISSING = object()


class Cache(dict[Any, Any]):
    """
    A dictionary that makes missing values, and drops its oldest entry if it grows too large.

    A look-up is as fast as in a dictionary. No lock is held while a value is made, so no thread
    waits for another's. If two threads make the same value, both get the first one.

    Parameters
    ----------
    make : callable, optional
        From a key to its value, for `cache[key]`.
    size : int
        Maximum number of entries.
    shared : bool
        Whether a dropped entry is found again as long as its value is in use elsewhere. Such
        values must support weak references.

    """

    def __init__(self, make: Callable | None = None, size: int = SIZE, shared: bool = False):
        super().__init__()
        self._make, self._size = make, size
        # A finalizer may look up a value while the same thread stores one.
        self._lock = RLock()
        self._in_use: Any = WeakValueDictionary() if shared else {}
        self._shared = shared

    def __missing__(self, key: Hashable) -> Any:
        make = self._make
        if make is None:
            raise KeyError(key)
        return self._put(key, lambda: make(key))

    def get_or_make(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """Return the value of a key, made if there is none."""
        value = self.get(key, _MISSING)
        return self._put(key, make) if value is _MISSING else value

    def _put(self, key: Hashable, make: Callable[[], Any]) -> Any:
        with self._lock:
            value = self._in_use.get(key, _MISSING)
        if value is _MISSING:
            value = make()
        with self._lock:
            if self._shared:
                value = self._in_use.setdefault(key, value)
            value = self.setdefault(key, value)
            while len(self) > self._size:
                del self[next(iter(self))]
        return value


def cached(size: int = SIZE, shared: bool = False) -> Callable[[Function], Function]:
    """Return a decorator for a function of hashable arguments, with a `Cache` of its results."""
    def decorated(function: Function) -> Function:
        cache = Cache(lambda arguments: function(*arguments), size, shared)

        def look_up(*arguments: Hashable) -> Any:
            return cache[arguments]

        look_up.cache = cache  # type: ignore[attr-defined]
        return cast(Function, update_wrapper(look_up, function))

    return decorated
