# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Shutdown of the executables within a second of SIGINT or SIGTERM."""

from __future__ import annotations

import os
import signal
import socket
import sys
from threading import Event, Thread
from typing import Any, Callable

# Time from a signal to the forced end of the process [s].
TIMEOUT_S = 0.6


def run(main: Callable[[], int]) -> None:
    """Run the main function of a node, and end the process with the exit code that it returns."""
    # Importing ROS is too slow for a signal to wait; ShutdownHandler replaces this meanwhile.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: os._exit(0))
    code = main()
    # A compiling thread or much garbage would delay the end, and a second signal would change the
    # exit code.
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


class ShutdownHandler:
    """
    A context that handles SIGINT and SIGTERM in a thread, so that no callback is interrupted.

    The first signal sets `is_over` and calls `wake`, which is to stop rclpy's executor. If the
    context is not left within TIMEOUT_S, `before_exit` is called, and the process ends with exit
    code 0.
    """

    def __init__(self) -> None:
        self.wake: Callable[[], Any] = lambda: None
        self.before_exit: Callable[[], Any] = lambda: None
        self.is_over = False
        self._left = Event()

    def __enter__(self) -> ShutdownHandler:
        self._received, self._sent = socket.socketpair()
        self._sent.setblocking(False)
        Thread(target=self._wait, name='linkage_ros signals', daemon=True).start()
        signal.set_wakeup_fd(self._sent.fileno(), warn_on_full_buffer=False)
        # Python's default handler would raise KeyboardInterrupt in a callback.
        self._before = {number: signal.signal(number, lambda *_: None)
                        for number in (signal.SIGINT, signal.SIGTERM)}
        return self

    def __exit__(self, *_: Any) -> None:
        signal.set_wakeup_fd(-1)
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._left.set()
        self._sent.close()

    def _wait(self) -> None:
        # The socket stays open, because a further signal would print an error if it were closed.
        with self._received:
            if not self._received.recv(1):
                return
            self.is_over = True
            self.wake()
            if not self._left.wait(TIMEOUT_S):
                self.before_exit()
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(0)
