# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What is remembered of the sources of crank messages, so that machine code can answer them."""

import time
from typing import Callable, Iterable, List, Mapping, Optional

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

    """

    def __init__(self, now: Callable[[], bytes]):
        self._now = now
        self._mechanisms, self._whole = {}, None
        self._ticks, self._last = {}, None
        self._stale, self._rested = False, 0.0
        self._stamp = np.zeros(2, np.int64)

    def begin(self, mechanisms: Mapping, whole):
        """Take note of the mechanisms, {name: MechanismPublisher}, and of the whole scene."""
        self._mechanisms, self._whole = mechanisms, whole

    @property
    def stamp(self) -> bytes:
        """The stamp of the last message, packed."""
        return self._stamp[:1].tobytes()

    def run(self, text: bytes, reader: Reader) -> bool:
        """Return whether a message is of a source that has a tick; if so, show what it says."""
        if self._stale and time.monotonic() >= self._rested:
            self.learn(self.forget())
        if self._last is not None and self._last.run(text):
            return True
        self._last = self._ticks.get(reader.source(text)) if self._ticks else None
        return self._last is not None and self._last.run(text)

    def renew_soon(self):
        """Take note that others listen now."""
        self._stale = True

    def catch_up(self, stamp: bytes):
        """Let the mechanisms take note of what ticks have done before a message with a stamp."""
        for tick in self._ticks.values():
            for part in tick.moved:
                part.shown.forget(self.stamp)
        self._stamp[0] = np.frombuffer(stamp, np.int64)[0]

    def forget(self) -> List[Source]:
        """Let all messages go the long way; return whose took the short one."""
        self.catch_up(self.stamp)
        sources, self._ticks, self._last, self._stale = list(self._ticks), {}, None, False
        return sources

    def learn(self, sources: Iterable[Optional[Source]]):
        """Let machine code do what sources set off from now on, where it can."""
        for source in sources:
            started = time.monotonic()
            if source is None or source in self._ticks or started < self._rested:
                continue
            moved = [shown.moved(tuple(places), known)
                     for shown, places, known in source.understood]
            if moved and None not in moved and (tick := self._tick(source, moved)):
                self._ticks[source] = self._last = tick
                ended = time.monotonic()
                self._rested = ended + REST * (ended - started)

    def _tick(self, source, moved):
        poses = self._poses({part.shown for part in moved}) if self._whole.is_heard else []
        try:
            from .tick import is_ready, Tick, Whole
        except ImportError:
            # Without llvmlite there is no machine code.
            return None
        if None in poses or not is_ready():
            return None
        if len(self._ticks) == MOST:
            self.forget()
        joints = Whole(self._whole.wire(poses), [pose.values for _, pose in poses],
                       self._send_whole) if poses else None
        return Tick(source, moved, joints, self._now, self._stamp)

    def _poses(self, moved):
        """Return models and poses of all mechanisms that are known; None: one lacks legs."""
        known = [(shown, *it) for shown in self._mechanisms.values() if (it := shown.known())]
        return [None if model.machine.loads or shown not in moved and not pose.is_entire
                else (model, pose.entire()) for shown, model, pose in known]

    def _send_whole(self, stamp):
        self.catch_up(stamp)
        self._whole.send(self._mechanisms.values(), stamp)
