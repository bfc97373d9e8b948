# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""
What reading joint states from their bytes costs, next to deserialising every message.

    python -m benchmark.nodes.reader

Sources take turns. Both readers get the same messages in turn; the first row of a count is what a
new reader needs for all, what it learns included.
"""

from itertools import cycle, islice
import statistics
import time

from linkage_ros.nodes.joint_state_reader import Reader
from linkage_ros.nodes.message_layout import pack
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from .report import table

SOURCES, JOINTS = (1, 2, 8, 9, 16, 64, 256, 300, 1000), (1, 10, 100, 1000, 3000, 10000)
ROUNDS, NUMBERS = 7, 100_000


def plain(text: bytes) -> tuple:
    """Return the numbers of a message, deserialised."""
    message = deserialize_message(text, JointState)
    return pack(message.header.stamp), *message.position, *message.velocity


class Quick:
    """Reads messages as the nodes do."""

    def __init__(self):
        self._reader = Reader(lambda message: message.name)

    def __call__(self, text: bytes) -> tuple:
        """Return the numbers of a message."""
        return self._reader.sender(text).read(text)


def texts(sources, joints):
    """Return a message of each source; the names of all are equally long."""
    numbers = [0.5] * joints
    return [serialize_message(JointState(
        name=[f'source{source:04}_joint{joint:05}' for joint in range(joints)],
        position=numbers, velocity=numbers)) for source in range(sources)]


def took(read, messages):
    """Return the CPU time of this thread for messages [s]."""
    start = time.thread_time()
    for text in messages:
        read(text)
    return time.thread_time() - start


def ratios(sources, joints):
    """Return the medians of quick to plain, while a reader learns and afterwards."""
    given = texts(sources, joints)
    learning, learnt = [], []
    for _ in range(ROUNDS):
        messages = list(islice(cycle(given), max(4 * sources, NUMBERS // (20 + joints))))
        quick = Quick()
        learning.append(took(quick, messages) / took(plain, messages))
        learnt.append(took(quick, messages) / took(plain, messages))
    return statistics.median(learning), statistics.median(learnt)


def main():
    """Measure and print."""
    rows = []
    for sources, joints in [(n, 1) for n in SOURCES] + [(1, n) for n in JOINTS] + [(64, 100)]:
        rows.append([str(sources), str(joints), *(f'{x:.2f}' for x in ratios(sources, joints))])
    print(table(['sources', 'joints', 'quick / plain, from the start', 'afterwards'], rows))


if __name__ == '__main__':
    main()
