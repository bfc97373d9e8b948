# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Fixtures; message fields are checked, which is off by default."""

import atexit
import gc
import os

from domains import Domain
import pytest

os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'
os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
# Of whatever a test starts that is not told another.
_domain = Domain()
atexit.register(_domain.release)
os.environ['ROS_DOMAIN_ID'] = str(_domain.id)


def pytest_collection_finish():
    """Leave what has been imported and collected to itself: collecting garbage takes less."""
    gc.collect()
    gc.freeze()


@pytest.fixture
def graph():
    """Real nodes in this process, in a context and a domain of their own."""
    pytest.importorskip('rclpy')
    from ros_harness import Graph

    with Graph() as one:
        yield one
