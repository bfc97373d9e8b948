# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Fixtures; message fields are checked, which is off by default."""

import atexit
import os

from domains import Domain
import pytest

os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'
os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
# Of whatever a test starts that is not told another.
_domain = Domain()
atexit.register(_domain.release)
os.environ['ROS_DOMAIN_ID'] = str(_domain.id)


@pytest.fixture
def graph():
    """Real nodes in this process, in a context and a domain of their own."""
    pytest.importorskip('rclpy')
    from ros_harness import Graph

    with Graph() as one:
        yield one
