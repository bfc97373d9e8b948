# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""How much of a sweep `make test` runs, how much `make long`, and how much nobody waits for."""

import pytest

# Many more than `.ci/run` has time for.
EXHAUSTIVE = [pytest.mark.long, pytest.mark.exhaustive]


def few_and_many(few, many):
    """Return the cases of a test, each a tuple of arguments: many of them are exhaustive."""
    return [*few, *(pytest.param(*case, marks=EXHAUSTIVE) for case in many)]
