# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A thread for jobs that would delay messages on the thread of rclpy's executor."""

from __future__ import annotations

from collections import deque
from functools import partial
import threading
from typing import Any, Callable, Deque, Dict, Iterable, Optional, Tuple

# Longest wait for the worker when a node ends [s].
TIMEOUT = 0.1

# Kind of the jobs from `add`, for error messages.
OTHER = 'a latched message'
# A job runs in the worker's thread; the function that it returns runs on rclpy's executor.
Job = Callable[[], Optional[Callable[[], None]]]


class Worker:
    """
    A thread that runs jobs one after the other, and ends when none is left.

    The function that a job returns is called on the thread of rclpy's executor. `failed` is called
    with the kind of job and the exception that it or its function has raised.
    """

    def __init__(self, node: Any, failed: Callable[[str, Exception], None]):
        self._node, self._failed = node, failed
        self._lock = threading.Lock()
        # The newest job of each kind; these run before the others.
        self._newest: Dict[str, Job] = {}
        self._others: Deque[Job] = deque()
        self._thread: Optional[threading.Thread] = None
        self._ended = threading.Event()
        # Set when rclpy's executor has called a job's result, or will not call it any more.
        self._called = threading.Event()

    def replace(self, kind: str, job: Job) -> None:
        """Queue a job; it replaces a job of the same kind that has not begun."""
        with self._lock:
            self._newest[kind] = job
            self._start()

    def add(self, jobs: Iterable[Job]) -> None:
        """Queue jobs; they run when no job from `replace` is left."""
        with self._lock:
            self._others.extend(jobs)
            self._start()

    def is_newest(self, kind: str) -> bool:
        """Return whether a running job of this kind should go on: no newer one is queued."""
        return kind not in self._newest and not self._ended.is_set()

    def end(self) -> None:
        """Drop the queued jobs, and wait up to TIMEOUT for the running one."""
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
        """Call `act` on rclpy's executor and wait: a queue of such calls would delay messages."""
        executor = self._node.executor
        with self._lock:
            if executor is None or self._ended.is_set():
                return
            self._called.clear()
        try:
            executor.create_task(partial(self._act, kind, act))
        except AttributeError:
            # Jazzy's executor has been shut down.
            return
        self._called.wait()

    def _act(self, kind: str, act: Callable[[], None]) -> None:
        try:
            if not self._ended.is_set():
                act()
        except Exception as error:
            self._failed(kind, error)
        finally:
            self._called.set()
