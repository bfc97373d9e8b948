# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A scene in one process, in three, and what any process costs. Its driver alone."""

from contextlib import contextmanager
import pickle
import time

from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from . import scenes
from .campaign import SUBJECT
from .driving import Process

APART = ('crank_driver', 'kinematics', 'servo_inverse')
NODES = {'apart': [('-m', f'linkage_ros.nodes.{name}') for name in APART],
         'together': [('-m', 'linkage_ros.nodes.scene_process')],
         'floor': [(*SUBJECT, 'timed', '--ready')]}
# How long each runs in a round [s].
SECONDS = 2.5


def compare(bench, scene, rate):
    """
    Return rows: CPU [us a tick], memory [MiB] and start [s] of each, a value a round.

    The floor is a timer that publishes ready joint states.
    """
    path = bench.folder / 'joints.ready'
    path.write_bytes(pickle.dumps({topic: text for topic, text in pickle.loads(
        bench.ready(scene).read_bytes()).items() if topic.joints}))
    rows = {kind: {'scene': scene, 'rate': rate, 'kind': kind, 'cpu': [], 'memory': [],
                   'start': []} for kind in NODES}
    for _ in range(bench.rounds):
        for kind, row in rows.items():
            begin = time.perf_counter()
            with _started(bench, kind, scene, rate, path) as (processes, heard):
                assert bench.driver.until(lambda heard=heard: all(map(len, heard)))
                row['start'].append(time.perf_counter() - begin)
                # Machine code is made beside the first ticks.
                bench.driver.wait(1.0)
                before, ticks = sum(p.cpu() for p in processes), len(heard[0])
                bench.driver.wait(SECONDS)
                row['cpu'].append(1e6 * (sum(p.cpu() for p in processes) - before)
                                  / (len(heard[0]) - ticks))
                row['memory'].append(sum(p.proportional() for p in processes) / 2 ** 20)
    return list(rows.values())


def drive(bench, scene, rate):
    """Return rows: CPU [us a message] of `crank_driver` and of a bare timer, a value a round."""
    ready = bench.folder / 'cranks.ready'
    ready.write_bytes(pickle.dumps({scenes.Topic('crank_states', True): serialize_message(
        next(scenes.Cranks(scene)))}))
    node, parameters, rows, ears = bench.driver.node, scenes.write(scene, bench.folder), {}, []
    pace = '--ros-args', '-p', f'rate:={rate}'
    processes = {
        'driver': Process('driver', '-m', 'linkage_ros.nodes.crank_driver', *pace,
                          parameters=parameters),
        'timed': Process('timed', *SUBJECT, 'timed', '--ready', str(ready), *pace)}
    try:
        heard = {kind: [] for kind in processes}
        ears = [node.create_subscription(JointState, f'/{kind}/crank_states', times.append, 1000,
                                         raw=True) for kind, times in heard.items()]
        assert bench.driver.until(lambda: all(len(times) > rate for times in heard.values()))
        rows = {kind: {'scene': scene, 'rate': rate, 'kind': kind, 'cpu': []} for kind in heard}
        for _ in range(bench.rounds):
            before = {kind: (process.cpu(), len(heard[kind]))
                      for kind, process in processes.items()}
            bench.driver.wait(SECONDS)
            for kind, (cpu, ticks) in before.items():
                rows[kind]['cpu'].append(1e6 * (processes[kind].cpu() - cpu)
                                         / (len(heard[kind]) - ticks))
    finally:
        for process in processes.values():
            process.end()
        for ear in ears:
            node.destroy_subscription(ear)
    return list(rows.values())


@contextmanager
def _started(bench, kind, scene, rate, ready):
    """Start the nodes of a scene; yield the processes and what is heard of each mechanism."""
    node, parameters = bench.driver.node, scenes.write(scene, bench.folder)
    heard, ears, processes = [], [], []
    for topic in scenes.topics(scene):
        if topic.joints:
            heard.append([])
            ears.append(node.create_subscription(
                JointState, f'/{kind}/{topic.name}', heard[-1].append, 1000, raw=True))
    try:
        for arguments in NODES[kind]:
            given = [*arguments, ready] if kind == 'floor' else arguments
            processes.append(Process(kind, *given, '--ros-args', '-p', f'rate:={rate}',
                                     parameters=parameters))
        yield processes, heard
    finally:
        for process in processes:
            process.end()
        for ear in ears:
            node.destroy_subscription(ear)
