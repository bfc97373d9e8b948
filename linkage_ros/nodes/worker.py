# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A thread for jobs that would delay messages on the thread of rclpy's executor."""

from __future__ import annotations

from collections import deque
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from functools import partial
from threading import Lock
from typing import Any, Callable, Deque, Dict, Iterable, Optional

# Longest wait for the worker when a node ends [s].
TIMEOUT_S = 0.1

# Kind of the jobs from `add`, for error messages.
OTHER = 'a latched message'
# A job runs in the worker's thread; the function that it returns runs on rclpy's executor.
Job = Callable[[], Optional[Callable[[], None]]]


class Worker:
    """
    A thread that runs jobs one after the other.

    The function that a job returns is called on the thread of rclpy's executor, before the next
    job runs: a queue of such calls would delay messages. Jobs that are queued before the node has
    an executor wait for `run_next`. `failed` is called with the kind of job
    and the exception that it or its function has raised.
    """

    def __init__(self, node: Any, failed: Callable[[str, Exception], None]):
        self._node, self._failed = node, failed
        self._thread = ThreadPoolExecutor(1, 'linkage_ros worker')
        self._lock, self._is_busy, self._has_ended = Lock(), False, False
        # The newest job of each kind; these run before the others.
        self._newest: Dict[str, Job] = {}
        self._others: Deque[Job] = deque()

    def replace(self, kind: str, job: Job) -> None:
        """Queue a job; it replaces a job of the same kind that has not begun."""
        self._newest[kind] = job
        self.run_next()

    def add(self, jobs: Iterable[Job]) -> None:
        """Queue jobs; they run when no job from `replace` is left."""
        self._others.extend(jobs)
        self.run_next()

    def is_newest(self, kind: str) -> bool:
        """Return whether a running job of this kind should go on: no newer one is queued."""
        return kind not in self._newest and not self._has_ended

    def end(self) -> None:
        """Drop the queued jobs, and wait up to TIMEOUT_S for the running one."""
        with self._lock:
            is_first, self._has_ended = not self._has_ended, True
        if is_first:
            last = self._thread.submit(lambda: None)
            self._thread.shutdown(wait=False)
            wait([last], TIMEOUT_S)

    def run_next(self) -> None:
        """Run the next job, unless one is running."""
        with self._lock:
            if (self._is_busy or self._has_ended or not self._node.executor
                    or not (self._newest or self._others)):
                return
            self._is_busy = True
            kind = next(iter(self._newest), OTHER)
            job = self._newest.pop(kind, None) or self._others.popleft()
            self._thread.submit(self._run, kind, job)

    def _run(self, kind: str, job: Job) -> None:
        act = None
        try:
            act = job()
        except Exception as error:
            self._failed(kind, error)
        executor = self._node.executor
        if act and executor and not self._has_ended:
            # Jazzy's executor raises it once it has been shut down.
            with suppress(AttributeError):
                executor.create_task(partial(self._call, kind, act))
        else:
            self._end_of_job()

    def _call(self, kind: str, act: Callable[[], None]) -> None:
        try:
            if not self._has_ended:
                act()
        except Exception as error:
            self._failed(kind, error)
        self._end_of_job()

    def _end_of_job(self) -> None:
        self._is_busy = False
        self.run_next()
