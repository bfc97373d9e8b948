# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What something costs, counted: the same on any mechanism, however busy it is."""

from contextlib import contextmanager
import cProfile
import os

import linkage_ros

PACKAGE = os.path.dirname(linkage_ros.__file__) + os.sep


def calls(do) -> int:
    """Return how many functions of the package are called by something."""
    profile = cProfile.Profile()
    with profile:
        do()
    return sum(entry.callcount for entry in profile.getstats()
               if getattr(entry.code, 'co_filename', '').startswith(PACKAGE))


@contextmanager
def few_calls(most: int, about: str = ''):
    """Hold that what is done inside calls at most so many functions, those in C included."""
    profile = cProfile.Profile()
    try:
        with profile:
            yield
    finally:
        done = sum(entry.callcount for entry in profile.getstats())
        assert done <= most, f'{done} calls: {about}'
