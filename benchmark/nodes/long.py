# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What takes long: a million messages, a minute at 1000 Hz, and ten minutes of trouble."""

import os
import signal
import time

from linkage_ros import scene
import numpy as np
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message

from . import changes, scenes
from .campaign import latency, NODE, SUBJECT
from .driving import Process

MIB = 2 ** 20
# Between two changes of a parameter [s].
PAUSE = 1.0


class Changes:
    """Changes a dimension by a thousandth again and again, of one mechanism after the other."""

    def __init__(self, driver, process, name):
        self._node, self.answered, self._count = driver.node, 0, 0
        self._client = self._node.create_client(
            SetParameters, f'/{process.name}/kinematics/set_parameters')
        read = scene.read(scenes.given(name))
        self._dimensions = [next(p for p in read.parameters
                                 if p.name.startswith(f'{machine}.dimensions.'))
                            for machine in read.machines]

    def __enter__(self):
        self._timer = self._node.create_timer(PAUSE, self._ask)
        return self

    def _ask(self):
        turn, which = divmod(self._count, len(self._dimensions))
        self._count += 1
        name, value = self._dimensions[which].name, self._dimensions[which].value
        self._client.call_async(SetParameters.Request(parameters=[Parameter(
            name, value=value * (1.0 - 1e-3 * (turn % 2))).to_parameter_msg()
        ])).add_done_callback(self._take)

    def _take(self, future):
        self.answered += future.result().results[0].successful

    def __exit__(self, *_):
        self._node.destroy_timer(self._timer)
        self._node.destroy_client(self._client)


def soak(bench, count):
    """Return what became of a node that turned 12 legs again and again, as fast as it could."""
    name = '12 legs'
    process = Process('soak', *NODE, parameters=scenes.write(name, bench.folder))
    try:
        line = bench.driver.line(process, name, scenes.topics(name), stamped=True)
        sizes, lost, began = [], 0, time.perf_counter()
        with Changes(bench.driver, process, name) as changed:
            for _ in range(100):
                lost += line.flow(count // 100)
                sizes.append(process.resident())
        took = time.perf_counter() - began
        line.close()
    finally:
        process.end()
    return {'messages': count, 'took': took, 'lost': lost, 'changes': changed.answered,
            **_grown(sizes)}


def hold(bench, name, rate, seconds):
    """Return what came of turning a scene at a rate [Hz] for some seconds."""
    process = Process('held', *NODE, parameters=scenes.write(name, bench.folder))
    try:
        line = bench.driver.line(process, name, scenes.topics(name), stamped=True)
        line.burst(200.0, 200)
        began = time.perf_counter()
        with Changes(bench.driver, process, name) as changed:
            burst = line.burst(rate, round(rate * seconds))
        took = time.perf_counter() - began
        line.close()
    finally:
        process.end()
    return {'scene': name, 'rate': rate, 'seconds': seconds, 'took': took, 'lost': burst.lost,
            'changes': changed.answered, 'cpu': burst.cpu, **latency(burst.latencies),
            'longest': max(burst.latencies, default=None), 'load': os.getloadavg()[0]}


def _grown(sizes):
    """Return what memory did [MiB]; a tenth is left out, while buffers and caches fill."""
    settled = sizes[len(sizes) // 10:]
    return {'growth_mib': (settled[-1] - settled[0]) / MIB,
            'span_mib': (max(settled) - min(settled)) / MIB, 'resident_mib': settled[-1] / MIB}


def trouble(bench, seconds):
    """
    Return what became of a node that turns 12 legs at 500 Hz for some seconds, in trouble.

    Each second a parameter is changed, another is refused, and bytes come that are no message; a
    subscriber and a client that never take what they are sent stand still all the time.
    """
    scene, kinds = '12 legs', [name for name in changes.CHANGES if name != 'none']
    process = Process('troubled', *NODE, parameters=scenes.write(scene, bench.folder))
    stalled = Process('troubled', *SUBJECT, 'ear', '--ready', str(bench.ready(scene)))
    random, sizes, took = np.random.default_rng(0), [], []
    try:
        line = bench.driver.line(process, scene, scenes.topics(scene))
        client, deaf = (node.create_client(SetParameters, '/troubled/kinematics/set_parameters')
                        for node in (bench.driver.node, bench.driver.idle))
        bench.driver.wait(2.0)
        stalled.signal(signal.SIGSTOP)
        with changes.turning(line):
            for second in range(round(seconds)):
                given = changes.made(changes.CHANGES[kinds[second % len(kinds)]](second % 40))
                took.append(1e3 * changes.change(bench.driver, client, given))
                deaf.call_async(SetParameters.Request())
                text = serialize_message(next(line.cranks))
                line.publisher.publish(random.bytes(int(random.integers(1, 300))))
                line.publisher.publish(text[:int(random.integers(1, len(text)))])
                bench.driver.wait(max(0.0, 1.0 - 1e-3 * took[-1]))
                for times in line.heard:
                    assert times, f'nothing was published in second {second}'
                    times.clear()
                sizes.append(process.resident())
                assert process.running(), f'the node ended in second {second}'
    finally:
        stalled.signal(signal.SIGCONT)
        stalled.end()
        process.end()
    return {'seconds': len(sizes), **_grown(sizes), 'answered_ms': float(np.median(took)),
            'longest_answer_ms': max(took)}
