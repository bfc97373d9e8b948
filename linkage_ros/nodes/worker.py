# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A thread for jobs that would delay messages on the thread of rclpy's executor."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from threading import Lock
from typing import Any, Callable

# Longest wait for the worker when a node ends [s].
TIMEOUT_S = 0.1

# A job runs in the worker's thread; the function that it returns runs on rclpy's executor.
Job = Callable[[], Callable[[], None] | None]


class Worker:
    """
    A thread that runs jobs one after the other.

    The function that a job returns is called on the thread of rclpy's executor, before the next
    job runs: a queue of such calls would delay messages. Jobs that are queued before the node has
    an executor wait for `run_next`. `guarded(kind, function)` returns a function that reports its
    exceptions.
    """

    def __init__(self, node: Any, guarded: Callable[[str, Callable], Callable]):
        self._node, self._guarded = node, guarded
        self._thread = ThreadPoolExecutor(1, 'linkage_ros worker')
        self._lock, self._is_busy, self.has_ended = Lock(), False, False
        self._jobs: dict[str, Job] = {}

    def queue(self, kind: str, job: Job, is_next: bool = False) -> None:
        """Queue a job; it replaces a job of the same kind that has not begun."""
        with self._lock:
            self._jobs.pop(kind, None)
            self._jobs = {kind: job, **self._jobs} if is_next else {**self._jobs, kind: job}
        self.run_next()

    def end(self) -> None:
        """Drop the queued jobs, and wait up to TIMEOUT_S for the running one."""
        with self._lock:
            self.has_ended = True
        # It raises if it has ended before.
        with suppress(RuntimeError):
            wait([self._thread.submit(lambda: None)], TIMEOUT_S)
        self._thread.shutdown(wait=False)

    def run_next(self) -> None:
        """Run the next job, unless one is running."""
        with self._lock:
            if self._is_busy or self.has_ended or not self._node.executor or not self._jobs:
                return
            self._is_busy = True
            kind = next(iter(self._jobs))
            self._thread.submit(self._run, kind, self._jobs.pop(kind))

    def _run(self, kind: str, job: Job) -> None:
        act, executor = self._guarded(kind, job)(), self._node.executor
        if act and executor:
            # Jazzy's executor raises it once it has been shut down.
            with suppress(AttributeError):
                executor.create_task(self._finish, self._guarded(kind, act))
        else:
            self._finish(lambda: None)

    def _finish(self, act: Callable[[], None]) -> None:
        if not self.has_ended:
            act()
        self._is_busy = False
        self.run_next()
