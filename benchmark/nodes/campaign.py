# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Short bursts, each subject in turn, round after round."""

from contextlib import contextmanager
import json
import pickle
import statistics
import subprocess
import sys
import threading
import time

from linkage_interfaces.srv import ServoInverse
from linkage_ros.nodes import scene_node
import numpy as np
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from . import scenes, subject
from .driving import Process

SUBJECT = ('-m', 'benchmark.nodes.subject')
NODE = ('-m', 'linkage_ros.nodes.kinematics')
RATES = (50.0, 200.0, 1000.0)
# The scenes whose cost is compared. With sixty mechanisms one core is not enough for 1000 Hz, not
# even for the floor.
COMPARED = {'one leg': RATES, '12 legs': RATES, 'four mechanisms': RATES,
            'sixty mechanisms': RATES[:2]}
# How long a burst takes [s], by rate.
SECONDS = {50.0: 1.2, 200.0: 1.0, 1000.0: 0.6}
WARM_UP = 60
# After so long all is known and made [s].
COMPILING = 1.0
# What else is compared in a scene, in a loop and in processes.
BESIDE = {'one leg': ('relay',), '12 legs': ('fresh',)}
# In a loop, in a round: topics to publish on, and ticks at least.
PUBLISHED, TICKS = 600, 20
MAKE = ('import rclpy; from linkage_ros.nodes.kinematics import Kinematics; '
        'rclpy.init(); Kinematics()')


class Bench:
    """A driver, a folder for what processes are given and give back, and how many rounds."""

    def __init__(self, driver, folder, rounds):
        self.driver, self.folder, self.rounds = driver, folder, rounds

    @contextmanager
    def subjects(self, scene, wanted):
        """Start processes, {name: (arguments, topics that are heard)}; yield their lines."""
        parameters = scenes.write(scene, self.folder)
        started, lines = {}, {}
        try:
            for name, (arguments, _) in wanted.items():
                started[name] = Process(name, *arguments, parameters=parameters)
            for name, (_, topics) in wanted.items():
                lines[name] = self.driver.line(started[name], scene, topics)
            yield lines
        finally:
            for line in lines.values():
                line.close()
            for process in started.values():
                process.end()

    def ready(self, scene):
        """Return the file with what `kinematics` answers on each topic."""
        path = self.folder / f'{scene.replace(" ", "_")}.ready'
        if not path.exists():
            process = Process('model', *NODE, parameters=scenes.write(scene, self.folder))
            try:
                self.driver.capture(process, scene, path)
            finally:
                process.end()
        return path

    def cost(self, scene, rates):
        """Return rows of CPU time a message and latency, for every subject and rate."""
        heard = scenes.topics(scene)
        floor = (*SUBJECT, 'floor', '--ready', str(self.ready(scene)))
        wanted = {'kinematics': (NODE, heard), 'floor': (floor, heard)}
        for kind in BESIDE.get(scene, ()):
            wanted[kind] = (*SUBJECT, kind), heard[:1] if kind == 'relay' else heard
        if scene == '12 legs':
            wanted['joints'] = NODE, heard[:1]
            wanted['unheard'], wanted['deaf'] = (NODE, ()), ((*SUBJECT, 'deaf'), ())
            wanted['kinematics_plain'] = (*SUBJECT, 'kinematics', '--single'), heard
        with self.subjects(scene, wanted) as lines:
            for line in lines.values():
                line.burst(200.0, WARM_UP)
            return [row for rate in rates for row in self._rows(scene, rate, lines)]

    def _rows(self, scene, rate, lines):
        return [{'scene': scene, 'rate': rate, 'subject': name, **_summary(found)}
                for name, found in self._bursts(rate, lines).items()]

    def _bursts(self, rate, lines):
        bursts = {name: [] for name in lines}
        for _ in range(self.rounds):
            for name, line in lines.items():
                bursts[name].append(line.burst(rate, round(rate * SECONDS[rate])))
        return bursts

    def parts(self, scene, rate):
        """Return the parts of a tick [us] in a process that is driven at a rate [Hz]."""
        heard = scenes.topics(scene)
        wanted = {}
        for kind in ('kinematics', 'floor'):
            given = ('--ready', str(self.ready(scene))) if kind == 'floor' else ()
            wanted[kind] = (*SUBJECT, kind, '--times', str(self.folder / kind), *given), heard
        with self.subjects(scene, wanted) as lines:
            self._bursts(rate, lines)
        return [{'scene': scene, 'rate': rate, 'subject': kind,
                 **json.loads((self.folder / kind).read_text())} for kind in wanted]

    def bodies(self, scene):
        """Return what a tick takes [us], one after the other without a pause, in this process."""
        ready = self.ready(scene)
        subject.Floor.ready = subject.ready(pickle.loads(ready.read_bytes()))
        kinds = ['kinematics', 'floor', *BESIDE.get(scene, ())]
        given = [Parameter(name, value=value) for name, value in scenes.given(scene).items()]
        nodes = {kind: subject.KINDS[kind](
            namespace=f'/{kind}', parameter_overrides=given) for kind in kinds}
        ears = [Process(kind, *SUBJECT, 'ear', '--ready', str(ready)) for kind in kinds]
        cranks, ticks = scenes.Cranks(scene), {kind: [] for kind in kinds}
        count = max(TICKS, PUBLISHED // len(scenes.topics(scene)))
        executor = scene_node.Executor()
        try:
            for node in nodes.values():
                executor.add_node(node)
            assert self.driver.until(lambda: all(
                _is_heard(node, scenes.topics(scene)) for node in nodes.values()))
            # Who listens is told to those that spin, and machine code is made beside first ticks.
            for _ in range(4):
                self.driver.until(lambda: False, COMPILING, executor)
                assert self.driver.until(lambda: not any(
                    thread.name.startswith('linkage_ros compiler')
                    for thread in threading.enumerate()), executor=executor)
                for node in nodes.values():
                    _ticks(node, cranks, count)
            for _ in range(3 * self.rounds):
                for kind, node in nodes.items():
                    ticks[kind].append(statistics.median(_ticks(node, cranks, count)))
        finally:
            for ear in ears:
                ear.end()
            executor.shutdown()
            for node in nodes.values():
                node.destroy_node()
        return [{'scene': scene, 'subject': kind, 'ticks': times,
                 'tick': statistics.median(times)} for kind, times in ticks.items()]

    def starts(self, scene='12 legs'):
        """Return the seconds from the start of a process to its first joint states, or its end."""
        heard = scenes.topics(scene)[:1]
        floor = (*SUBJECT, 'floor', '--ready', str(self.ready(scene)))
        found = {'kinematics': [], 'floor': [], 'made': []}
        for _ in range(2 * self.rounds):
            begin = time.perf_counter()
            subprocess.run([sys.executable, '-c', MAKE], check=True)
            found['made'].append(time.perf_counter() - begin)
            for name, arguments in (('kinematics', NODE), ('floor', floor)):
                begin = time.perf_counter()
                with self.subjects(scene, {name: (arguments, heard)}):
                    found[name].append(time.perf_counter() - begin)
        return found

    def services(self, calls):
        """Return rows of round trips [us] and CPU time a call [us]."""
        servo = Process('servo', '-m', 'linkage_ros.nodes.servo_inverse')
        trigger = Process('plain', *SUBJECT, 'trigger')
        echo = Process('echo', *SUBJECT, 'echo')
        try:
            node = self.driver.node
            asks = node.create_client(ServoInverse, '/servo/servo_inverse')
            pulls = node.create_client(Trigger, '/plain/trigger')
            shouts = node.create_client(ServoInverse, '/echo/servo_inverse')
            clients = asks, pulls, shouts
            assert self.driver.until(lambda: all(c.service_is_ready() for c in clients))
            wanted = {
                'trigger': (trigger, pulls, Trigger.Request(), calls),
                'echo 1': (echo, shouts, _request(1), calls),
                'servo 1': (servo, asks, _request(1), calls),
                'echo 1000': (echo, shouts, _request(1000), calls // 4),
                'servo 1000': (servo, asks, _request(1000), calls // 4)}
            bursts = {name: [] for name in wanted}
            for _ in range(self.rounds + 1):
                for name, call in wanted.items():
                    bursts[name].append(self._calls(*call))
        finally:
            for process in (servo, trigger, echo):
                process.end()
        return [{'subject': name,
                 'round_trips': [statistics.median(times) for times, _ in found[1:]],
                 'p50': statistics.median(statistics.median(times) for times, _ in found[1:]),
                 'p99': float(np.percentile(np.concatenate([t for t, _ in found[1:]]), 99)),
                 'cpus': [cpu for _, cpu in found[1:]],
                 'cpu': statistics.median(cpu for _, cpu in found[1:])}
                for name, found in bursts.items()]

    def _calls(self, process, client, request, count):
        times, spin, cpu = [], self.driver.executor.spin_once, process.cpu()
        for _ in range(count):
            start = time.perf_counter()
            future = client.call_async(request)
            while not future.done():
                spin(timeout_sec=1.0)
            times.append(1e6 * (time.perf_counter() - start))
        return times, 1e6 * (process.cpu() - cpu) / count


def _is_heard(node, topics):
    """Return whether somebody listens to each of some topics that a node publishes on."""
    names = {node.resolve_topic_name(topic.name) for topic in topics}
    return all(publisher.get_subscription_count() for publisher in node.publishers
               if publisher.topic_name in names)


def _ticks(node, cranks, count):
    """Return the CPU time of this thread in each of some ticks, after a few others."""
    heard = next(s for s in node.subscriptions if s.topic_name.endswith('crank_states'))
    times, texts = [], [serialize_message(next(cranks)) for _ in range(count)]
    for given in texts if heard.raw else [deserialize_message(t, JointState) for t in texts]:
        start = time.thread_time_ns()
        heard.callback(given)
        times.append(1e-3 * (time.thread_time_ns() - start))
    return times[count // 10:]


def _request(count):
    angles = np.linspace(-0.5, 0.5, count) if count > 1 else np.array([0.1])
    return ServoInverse.Request(lever_angle=angles.tolist())


def _summary(bursts):
    return {'cpus': [b.cpu for b in bursts], 'cpu': statistics.median(b.cpu for b in bursts),
            **latency(np.concatenate([b.latencies for b in bursts])),
            'lost': sum(b.lost for b in bursts)}


def latency(times):
    """Return the percentiles of times [us], None of none."""
    return {f'p{percent}': float(np.percentile(times, percent)) if len(times) else None
            for percent in (50, 99)}
