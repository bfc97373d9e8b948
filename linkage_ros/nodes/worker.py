# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A thread beside a node's executor: it makes what takes longer than a message may wait."""

from __future__ import annotations

from collections import deque
from functools import partial
import threading
from typing import Any, Callable, Deque, Dict, Iterable, Optional, Tuple

# How long the end of a node waits for its worker [s].
TIMEOUT = 0.1

# What other jobs make.
OTHER = 'what is published once'
# A job makes something in the worker's thread; what it returns acts on the executor's thread.
Job = Callable[[], Optional[Callable[[], None]]]


class Worker:
    """
    A thread that does one job after the other, while there are any.

    What a job returns is called on the thread of the node's executor. `failed` is called on the
    worker's thread with what was being done, and the exception that ended it.
    """

    def __init__(self, node: Any, failed: Callable[[str, Exception], None]):
        self._node, self._failed = node, failed
        self._lock = threading.Lock()
        # Of each kind only the newest job counts; they come before the others.
        self._newest: Dict[str, Job] = {}
        self._others: Deque[Job] = deque()
        self._thread: Optional[threading.Thread] = None
        self._ended = threading.Event()

    def replace(self, kind: str, job: Job) -> None:
        """Do a job soon, instead of one of its kind that has not begun."""
        with self._lock:
            self._newest[kind] = job
            self._start()

    def add(self, jobs: Iterable[Job]) -> None:
        """Do jobs when there is nothing to be done soon."""
        with self._lock:
            self._others.extend(jobs)
            self._start()

    def is_newest(self, kind: str) -> bool:
        """Return whether no other job of a kind waits; long jobs end where there is one."""
        return kind not in self._newest and not self._ended.is_set()

    def end(self) -> None:
        """Begin no other job, and wait for the present one, but not for long."""
        with self._lock:
            self._ended.set()
            thread = self._thread
        if thread is not None and thread is not threading.current_thread():
            thread.join(TIMEOUT)

    def _start(self) -> None:
        if self._thread is None and not self._ended.is_set():
            self._thread = threading.Thread(target=self._run, name='linkage_ros worker',
                                            daemon=True)
            self._thread.start()

    def _run(self) -> None:
        while chosen := self._next_job():
            kind, job = chosen
            try:
                act = job()
            except Exception as error:
                self._failed(kind, error)
            else:
                if act:
                    self._hand_over(kind, act)

    def _next_job(self) -> Optional[Tuple[str, Job]]:
        with self._lock:
            if self._ended.is_set() or not (self._newest or self._others):
                self._thread = None
                return None
            if self._newest:
                kind = next(iter(self._newest))
                return kind, self._newest.pop(kind)
            return OTHER, self._others.popleft()

    def _hand_over(self, kind: str, act: Callable[[], None]) -> None:
        """Let the executor act, and wait until it has: one act at a time holds up messages."""
        executor, done = self._node.executor, threading.Event()
        if executor is not None:
            executor.create_task(partial(self._act, kind, act, done))
            while not done.wait(TIMEOUT) and not self._ended.is_set():
                pass

    def _act(self, kind: str, act: Callable[[], None], done: threading.Event) -> None:
        try:
            if not self._ended.is_set():
                act()
        except Exception as error:
            self._failed(kind, error)
        finally:
            done.set()
