# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What is remembered of the sources of crank messages, so that machine code can answer them."""

import time
from typing import Callable, List, Optional

import numpy as np

from .joint_state_reader import Reader, Source

# So many sources have a tick each, at the most.
MOST = 64
# How long nothing is prepared after something was, in times of what that took: while the listeners
# of a large scene come one by one, little time goes into each state.
REST = 20


class Ticks:
    """
    A tick for each source, until something changes.

    Parameters
    ----------
    now : callable
        Returns the time, packed, for messages that have none.
    send_whole : callable
        From a stamp: shows the joints of the whole scene in the usual way.

    """

    def __init__(self, now: Callable[[], bytes], send_whole: Callable[[bytes], None]):
        self._now, self._send_whole = now, send_whole
        self._ticks, self._last, self._rested = {}, None, 0.0
        self._stamp = np.zeros(2, np.int64)

    @property
    def stamp(self) -> bytes:
        """The stamp of the last message, packed."""
        return self._stamp[:1].tobytes()

    def run(self, text: bytes, reader: Reader) -> bool:
        """Return whether a message is of a source that has a tick; if so, show what it says."""
        if self._last and self._last.run(text):
            return True
        self._last = self._ticks and self._ticks.get(reader.source(text))
        return bool(self._last) and self._last.run(text)

    def catch_up(self, stamp: bytes):
        """Let the mechanisms take note of what ticks have done before a message with a stamp."""
        for tick in self._ticks.values():
            for part in tick.moved:
                part.shown.forget(self.stamp)
        self._stamp[0] = np.frombuffer(stamp, np.int64)[0]

    def forget(self):
        """Let all messages go the long way: something has changed."""
        self.catch_up(self.stamp)
        self._ticks, self._last = {}, None

    def learn(self, source: Optional[Source], routes, mechanisms, whole):
        """
        Let machine code do what a source sets off from now on, where it can.

        Parameters
        ----------
        source : Source, optional
            Who sent a message that has just been shown.
        routes : sequence of (MechanismPublisher, places, bool)
            What it moves, by which of its numbers, and whether it tells of speeds.
        mechanisms : mapping
            All that is in the scene.
        whole : WholeScene
            Its topics.

        """
        started = time.monotonic()
        if source is None or source in self._ticks or started < self._rested:
            return
        moved = [shown.moved(*where) for shown, *where in routes]
        if None not in moved and (tick := self._tick(source, moved, mechanisms, whole)):
            self._ticks[source] = self._last = tick
            ended = time.monotonic()
            self._rested = ended + REST * (ended - started)

    def _tick(self, source, moved, mechanisms, whole):
        poses = _poses(mechanisms, {part.shown for part in moved}) if whole.is_heard else []
        # It needs llvmlite, which is there where there is machine code.
        from .tick import is_ready, Tick, Whole

        if None in poses or not is_ready():
            return None
        if len(self._ticks) == MOST:
            self.forget()
        joints = Whole(whole.wire(poses), [pose.values for _, pose in poses],
                       self._send_anew) if poses else None
        return Tick(source, moved, joints, self._now, self._stamp)

    def _send_anew(self, stamp):
        self.catch_up(stamp)
        self._send_whole(stamp)


def _poses(mechanisms, moved) -> List:
    """Return models and poses of all mechanisms that are known; None: one lacks legs."""
    known = [(shown, *it) for shown in mechanisms.values() if (it := shown.known())]
    return [(model, pose.entire()) if shown in moved or pose.held is None else None
            for shown, model, pose in known]
