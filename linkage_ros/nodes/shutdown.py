# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Shutdown of the executables within a second of SIGINT or SIGTERM."""

from __future__ import annotations

import os
import signal
import sys
from typing import Any, Callable

# Time from a signal to the forced end of the process [s].
TIMEOUT_S = 0.6


def run(main: Callable[[], int]) -> None:
    """Run the main function of a node, and end the process with the exit code that it returns."""
    # Importing ROS is too slow for a signal to wait; ShutdownHandler replaces this meanwhile.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: os._exit(0))
    # A compiling thread or much garbage would delay the end, and a second signal would change the
    # exit code.
    _exit(main())


class ShutdownHandler:
    """
    A context in which SIGINT and SIGTERM set `is_over`, and interrupt no callback.

    If the context is not left within TIMEOUT_S, the process ends with exit code 0.
    """

    is_over = False

    def __enter__(self) -> ShutdownHandler:
        # Python's default handler would raise KeyboardInterrupt in a callback.
        self._before = {number: signal.signal(number, handler) for number, handler in (
            (signal.SIGALRM, lambda *_: _exit(0)), (signal.SIGINT, self._receive),
            (signal.SIGTERM, self._receive))}
        return self

    def __exit__(self, *_: Any) -> None:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _receive(self, *_: Any) -> None:
        if not self.is_over:
            self.is_over = True
            signal.setitimer(signal.ITIMER_REAL, TIMEOUT_S)


def _exit(code: int) -> None:
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
