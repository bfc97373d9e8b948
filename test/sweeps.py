# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How much of a sweep `make test` runs, how much `make long`, and how much nobody waits for."""

import pytest

# Many more than `.ci/run` has time for.
EXHAUSTIVE = [pytest.mark.long, pytest.mark.exhaustive]


def few_and_many(few, many):
    """Return the cases of a test, each a tuple of arguments: many of them are exhaustive."""
    return [*few, *(pytest.param(*case, marks=EXHAUSTIVE) for case in many)]
