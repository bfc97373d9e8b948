# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A thread for jobs that would delay messages on a node's executor."""

from __future__ import annotations

from collections import deque
from functools import partial
import threading
from typing import Any, Callable, Deque, Dict, Iterable, Optional, Tuple

# Longest wait for the worker when a node ends [s].
TIMEOUT = 0.1

# What other jobs make.
OTHER = 'what is published once'
# A job runs in the worker's thread; the function that it returns runs on the executor's thread.
Job = Callable[[], Optional[Callable[[], None]]]


class Worker:
    """
    A thread that runs jobs one after the other, and ends when none is left.

    A job's result is called on the thread of the node's executor. `failed` is called on the
    worker's thread with the kind of job and its exception.
    """

    def __init__(self, node: Any, failed: Callable[[str, Exception], None]):
        self._node, self._failed = node, failed
        self._lock = threading.Lock()
        # The newest job of each kind; these run before the others.
        self._newest: Dict[str, Job] = {}
        self._others: Deque[Job] = deque()
        self._thread: Optional[threading.Thread] = None
        self._ended = threading.Event()
        # Set when the executor has called a job's result, or will not any more.
        self._called = threading.Event()

    def replace(self, kind: str, job: Job) -> None:
        """Queue a job in place of one of its kind that has not begun."""
        with self._lock:
            self._newest[kind] = job
            self._start()

    def add(self, jobs: Iterable[Job]) -> None:
        """Queue jobs behind those of `replace`."""
        with self._lock:
            self._others.extend(jobs)
            self._start()

    def is_newest(self, kind: str) -> bool:
        """Return whether no newer job of a kind waits; otherwise long jobs should end."""
        return kind not in self._newest and not self._ended.is_set()

    def end(self) -> None:
        """Cancel queued jobs, and wait up to TIMEOUT for the present one."""
        with self._lock:
            self._ended.set()
            self._called.set()
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
        """Call `act` on the executor's thread and wait: only one at a time delays messages."""
        executor = self._node.executor
        with self._lock:
            if executor is None or self._ended.is_set():
                return
            self._called.clear()
        executor.create_task(partial(self._act, kind, act))
        self._called.wait()

    def _act(self, kind: str, act: Callable[[], None]) -> None:
        try:
            if not self._ended.is_set():
                act()
        except Exception as error:
            self._failed(kind, error)
        finally:
            self._called.set()
