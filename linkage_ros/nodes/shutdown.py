# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Shutdown of the executables: they end within a second after SIGINT or SIGTERM."""

from __future__ import annotations

import os
import signal
import socket
import sys
from threading import Event, Thread
from typing import Any, Callable

# Time after a signal until the process is ended by force [s].
TIMEOUT = 0.6


class ShutdownHandler:
    """
    Handles SIGINT and SIGTERM in a thread, so that callbacks are not interrupted.

    The first signal sets `is_over` and calls `wake`, so that spinning stops. If that takes longer
    than TIMEOUT, `before_exit` is called, and the process ends with exit code 0.
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
        # Stays open: without it, another signal would print an error.
        with self._received:
            if not self._received.recv(1):
                return
            self.is_over = True
            self.wake()
            if not self._left.wait(TIMEOUT):
                self.before_exit()
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(0)
