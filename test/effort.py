# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What something costs, counted: the same on any machine, however busy it is."""

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
