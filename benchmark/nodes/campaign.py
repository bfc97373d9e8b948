# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Short bursts, each subject in turn, round after round."""

from contextlib import contextmanager
import pickle
import statistics
import threading
import time

from linkage_ros.nodes import scene_node
import numpy as np
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from . import scenes, subject
from .driving import Process

SUBJECT = ('-m', 'benchmark.nodes.subject')
NODE = ('-m', 'linkage_ros.nodes.kinematics')
# How long a burst takes [s], by rate [Hz].
SECONDS = {50.0: 1.2, 200.0: 1.0, 500.0: 0.8, 1000.0: 0.6}
WARM_UP = 60
# The scene whose leg is closed numerically, too.
RELAYED = 'one leg'
# In a loop, in a round: topics to publish on, and ticks at least. After so long, all is known and
# made [s].
PUBLISHED, TICKS, COMPILING = 600, 20, 1.0


def rates(scene):
    """Return the rates [Hz]; for sixty mechanisms no core is enough at 1000 Hz."""
    return [50.0, 200.0, 500.0 if scene == 'sixty mechanisms' else 1000.0]


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
        if scene == RELAYED:
            wanted['relay'] = (*SUBJECT, 'relay'), heard[:1]
        if scene == '12 legs':
            wanted['joints'] = NODE, heard[:1]
            wanted['unheard'], wanted['deaf'] = (NODE, ()), ((*SUBJECT, 'deaf'), ())
        with self.subjects(scene, wanted) as lines:
            for line in lines.values():
                line.burst(200.0, WARM_UP)
            return [row for rate in rates for row in self._rows(scene, rate, lines)]

    def _rows(self, scene, rate, lines):
        bursts = {name: [] for name in lines}
        for _ in range(self.rounds):
            for name, line in lines.items():
                bursts[name].append(line.burst(rate, round(rate * SECONDS[rate])))
        return [{'scene': scene, 'rate': rate, 'subject': name, **_summary(found)}
                for name, found in bursts.items()]

    def bodies(self, scene):
        """Return what a tick takes [us], one after the other without a pause, in this process."""
        ready = self.ready(scene)
        subject.Floor.ready = subject.ready(pickle.loads(ready.read_bytes()))
        kinds = ['kinematics', 'floor', *['relay'] * (scene == RELAYED)]
        given = [Parameter(name, value=value) for name, value in scenes.SCENES[scene].items()]
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


def _summary(bursts):
    return {'cpus': [b.cpu for b in bursts], 'cpu': statistics.median(b.cpu for b in bursts),
            **latency(np.concatenate([b.latencies for b in bursts])),
            'lost': sum(b.lost for b in bursts)}


def latency(times):
    """Return the percentiles of times [us], None of none."""
    return {f'p{percent}': float(np.percentile(times, percent)) if len(times) else None
            for percent in (50, 99)}
