# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Signals that end a node while it can still publish: it says goodbye, then stops to spin."""

import os
import signal
import socket
from threading import Event, Thread

from rclpy.signals import install_signal_handlers, SignalHandlerOptions

# How long what the node is doing may take to end [s].
PATIENCE = 0.5


class Goodbye:
    """
    What happens at the first SIGINT or SIGTERM, in a thread, whatever goes on meanwhile.

    The client library must not have handlers of its own. What ends the executor's waiting is to be
    put into `wake`.

    Attributes
    ----------
    nodes : list of rclpy.node.Node
        Those that spin; what has a method `say_goodbye` does so.
    is_over : bool
        Whether the node is to spin no more. Its context goes on for a while: an executor whose
        context ends while it looks for what there is may end the process.
    left : Event
        Set once it spins no more.

    """

    def __init__(self):
        self.nodes, self.wake, self.is_over = [], None, False
        self.left = Event()

    def __enter__(self):
        self._heard, told = socket.socketpair()
        told.setblocking(False)
        self._told = told
        self._thread = Thread(target=self._wait, daemon=True)
        self._thread.start()
        # An interrupt is not to raise amid a callback.
        self._before = {number: signal.signal(number, lambda *_: None)
                        for number in (signal.SIGINT, signal.SIGTERM)}
        signal.set_wakeup_fd(told.fileno(), warn_on_full_buffer=False)
        return self

    def __exit__(self, *_):
        signal.set_wakeup_fd(-1)
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._told.close()
        self.left.set()
        self._thread.join()
        self._heard.close()

    def _wait(self):
        number = self._heard.recv(1)
        if not number:
            return
        try:
            for node in self.nodes:
                if hasattr(node, 'say_goodbye'):
                    node.say_goodbye()
        finally:
            # From here on it is as if nobody caught signals: another one ends the context, and so
            # does this one where something holds the node up.
            install_signal_handlers(SignalHandlerOptions.ALL)
            self.is_over = True
            if self.wake:
                self.wake()
            if not self.left.wait(PATIENCE):
                os.kill(os.getpid(), *number)
