# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A ROS_DOMAIN_ID of one's own: what runs on this machine at the same time never meets."""

from itertools import count, islice
import os
import socket

# As ROS's domain_coordinator does it, which is not installed everywhere: whoever has bound the
# port of a domain has the domain. Its users and ours keep off each other.
FIRST_LOCK = 32768
DOMAINS = 100
# Where the first participant of domain 0 listens, and how far apart domains are. Somebody may be
# there who knows of no locks.
FIRST_PORT, PORTS_PER_DOMAIN = 7410, 250

# What was in use last may still be ending: it comes last.
candidates = (1 + number % DOMAINS for number in count(os.getpid()))


class Domain:
    """
    A domain that is held until it is released, or until this process ends.

    Attributes
    ----------
    id : int
        ROS_DOMAIN_ID, from 1 to 100.

    Raises
    ------
    RuntimeError
        If all are in use.

    """

    def __init__(self):
        for self.id in islice(candidates, DOMAINS):
            self._lock = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
            try:
                self._lock.bind(('', FIRST_LOCK + self.id))
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                    probe.bind(('', FIRST_PORT + PORTS_PER_DOMAIN * self.id))
                return
            except OSError:
                self._lock.close()
        raise RuntimeError(f'every ROS_DOMAIN_ID from 1 to {DOMAINS} is in use on this machine')

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.release()

    def release(self):
        """Let others have it."""
        self._lock.close()
