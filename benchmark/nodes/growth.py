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
What a scene costs as it grows: `kinematics`, and a bare node that sends as much.

The bare node has the same publishers and as many parameters, and answers a crank message with
ready bytes of the same joint states. The linkages are equal but for their size; in the last scene
all have dimensions of their own. As processes of their own:

    python -m benchmark.nodes.growth bare|ear READY --ros-args ...
"""

from contextlib import contextmanager
import pickle
import statistics
import sys
import time

from linkage_ros import mechanisms, scene
from linkage_ros.nodes import scene_node
from linkage_ros.nodes.joint_state_reader import ANY
from linkage_ros.nodes.kinematics import Kinematics
from linkage_ros.nodes.publishers import LATCHED
from linkage_ros.scene.motion import Motion
from rcl_interfaces.msg import ParameterDescriptor
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from visualization_msgs.msg import Marker, MarkerArray
import yaml

from .driving import Process
from .quiet import until_the_end
from .report import BARE, KINEMATICS

COUNTS, LEGS = (1, 4, 16, 64, 256, 1000), (1, 12, 100)
TOPICS = {'markers': (MarkerArray, 1), 'locus': (Marker, LATCHED),
          'robot_description': (String, LATCHED)}
# Messages and changes of each round, ticks of a body, and the shortest time between messages [s].
MESSAGES, CHANGES, TICKS, PAUSE = 20, 5, 300, 0.02
# How often a scene is started at most; one of so many mechanisms, which takes a minute, once.
ROUNDS, LARGE = 3, 1000
# Of the motion, between two messages [ns].
STEP = 10_000_019


def mechanisms_of(count, own_dimensions=False):
    """Return a scene of so many mechanisms of the catalogue."""
    names = [f'm{i}' for i in range(count)]
    given = {'mechanisms': names}
    for i, name in enumerate(names):
        type_, scale = list(mechanisms.CATALOGUE.items())[i % len(mechanisms.CATALOGUE)]
        given.update({f'{name}.type': type_, f'{name}.scale': scale * (1.0 + i / 1000)})
        if own_dimensions:
            given.update({f'{name}.dimensions.{key}': value * (1.0 + 1e-6 * i)
                          for key, value in mechanisms.defaults(type_).items()})
    return given


def walker(legs):
    """Return a scene of one mechanism with so many legs."""
    return {'mechanisms': ['m0'], 'm0.type': 'jansen', 'm0.scale': 0.01,
            'm0.leg_pairs': max(legs // 2, 1)}


SCENES = {**{f'{count} mechanism{"s"[:count - 1]}': mechanisms_of(count) for count in COUNTS},
          **{f'{legs} leg{"s"[:legs - 1]}': walker(legs) for legs in LEGS},
          '1000, all different': mechanisms_of(1000, own_dimensions=True)}


class Bare(Node):
    """Has publishers and parameters as `kinematics` has them, and sends ready bytes."""

    # The bytes of each mechanism's joint states, and how many parameters there are.
    ready = {}, 0

    def __init__(self, **kwargs):
        super().__init__(BARE, **kwargs)
        self._out = []
        states, parameters = self.ready
        for name, text in states.items():
            self._out.append((self.create_publisher(JointState, f'{name}/joint_states', 10), text))
            for topic, (type_, qos) in TOPICS.items():
                self.create_publisher(type_, f'{name}/{topic}', qos)
            for i in range(parameters // len(states)):
                self.declare_parameter(f'{name}.parameter{i}', 1.0, ParameterDescriptor(
                    description='What it means.', additional_constraints='What it may be.'))
        self.create_subscription(JointState, 'crank_states', self._turn, ANY, raw=True)

    @until_the_end
    def _turn(self, _):
        for publisher, text in self._out:
            publisher.publish(text)


class Ear(Node):
    """Subscribes to all joint states, and never takes what arrives."""

    ready = {}, 0

    def __init__(self):
        super().__init__('ear')
        # No executor knows of this one.
        self._idle = Node('idle')
        for name in self.ready[0]:
            self._idle.create_subscription(
                JointState, f'{name}/joint_states', lambda _: None, 10, raw=True)


class Cranks:
    """One crank message after the other."""

    def __init__(self, machines):
        self._motions = {f'{name}_crank': Motion.of(one.first) for name, one in machines.items()}
        self._count = 0

    def __next__(self):
        self._count += 1
        angles, speeds = zip(*(m.at(self._count * STEP) for m in self._motions.values()))
        message = JointState(name=list(self._motions), position=angles, velocity=speeds)
        message.header.stamp.nanosec = self._count
        return message


class Line:
    """From the driver to the node of a scene and back."""

    def __init__(self, driver, kind, machines):
        self._driver, self._node, self.kind = driver, driver.node, kind
        self._cranks, self.heard, self._missing = Cranks(machines), {}, set(machines)
        self._publisher = self._node.create_publisher(JointState, f'/{kind}/crank_states', 10)
        self._ears = [self._node.create_subscription(
            JointState, f'/{kind}/{name}/joint_states',
            lambda text, name=name: self._hear(name, text), 10, raw=True) for name in machines]
        self._setting = self._node.create_client(
            SetParameters, f'/{kind}/{kind}/set_parameters')

    def _hear(self, name, text):
        self.heard[name] = text
        self._missing.discard(name)

    def answered(self):
        """Send a crank message, and let all answers come."""
        self._missing.update(self.heard)
        self._publisher.publish(next(self._cranks))
        self._driver.until(lambda: not self._missing, 2.0)

    def begun(self):
        """Let the first answers of all come; send a message again and again till then."""
        deadline = time.perf_counter() + 60.0
        while self._missing:
            assert time.perf_counter() < deadline, f'{self.kind} does not answer'
            self._publisher.publish(next(self._cranks))
            until = time.perf_counter() + PAUSE + 1e-4 * len(self._ears)
            self._driver.until(lambda: not self._missing, until - time.perf_counter())

    def cpu(self, process):
        """Return the CPU time of a process for a message [us]."""
        before = process.cpu()
        for _ in range(MESSAGES):
            self.answered()
            self._driver.wait(PAUSE)
        return 1e6 * (process.cpu() - before) / MESSAGES

    def changes(self, process, name):
        """Return the time until a change is answered, and of it that of the executor [ms]."""
        assert self._driver.until(self._setting.service_is_ready)
        answered, held = [], []
        for i in range(CHANGES):
            self._driver.wait(5 * PAUSE)
            request = SetParameters.Request(parameters=[
                Parameter(name, value=1.0 + 0.001 * i).to_parameter_msg()])
            before, start = process.executor(), time.perf_counter()
            future = self._setting.call_async(request)
            assert self._driver.until(future.done)
            answered.append(1e3 * (time.perf_counter() - start))
            assert future.result().results[0].successful
            held.append(1e3 * (process.executor() - before))
        return statistics.median(answered), statistics.median(held)

    def close(self):
        """Hear no more."""
        self._node.destroy_publisher(self._publisher)
        self._node.destroy_client(self._setting)
        for ear in self._ears:
            self._node.destroy_subscription(ear)


def grow(bench, most=None):
    """Return rows of both nodes in all scenes or some of them; all take some six minutes."""
    rows, began = [], time.time()
    for title, given in list(SCENES.items())[:most]:
        rows += _Scene(bench, title, given).rows()
        print(f'{title}: {time.time() - began:.0f} s', file=sys.stderr)
    return rows


class _Scene:
    """Measures one scene."""

    def __init__(self, bench, title, given):
        self._bench, self._title, self._given = bench, title, given
        self._machines = scene.read(given).machines
        self._rounds = min(bench.rounds, ROUNDS) if len(self._machines) < LARGE else 1
        self._file, self._ready = (bench.folder / f'growth.{end}' for end in ('yaml', 'ready'))
        self._file.write_text(yaml.safe_dump({'/**': {'ros__parameters': given}}))

    def rows(self):
        """Return a row of each node."""
        rows = {kind: {'scene': self._title, 'mechanisms': len(self._machines), 'subject': kind,
                       'start': [], 'begun': [], 'cpu': [], 'memory': [], 'changed': [],
                       'held': []}
                for kind in (KINEMATICS, BARE)}
        for _ in range(self._rounds):
            for kind, row in rows.items():
                self._measure(kind, row)
        for kind, ticks in self._bodies().items():
            rows[kind]['ticks'] = ticks
        return list(rows.values())

    def _measure(self, kind, row):
        line = Line(self._bench.driver, kind, self._machines)
        begin = time.perf_counter()
        with self._process(kind, kind) as process:
            line.begun()
            row['start'].append(time.perf_counter() - begin)
            row['begun'].append(process.cpu())
            # What is made beside the first ticks is made, and taken up.
            for _ in range(3):
                self._bench.driver.wait(1.0 + 1e-3 * len(self._machines))
                line.answered()
            if kind == KINEMATICS:
                row['parameters'] = sum(
                    KINEMATICS in p.field.readers for one in self._machines.values()
                    for p in one.parameters)
                self._ready.write_bytes(pickle.dumps((
                    {name: bytes(line.heard[name]) for name in self._machines},
                    row['parameters'])))
            row['cpu'].append(line.cpu(process))
            row['memory'].append(process.proportional() / 2 ** 20)
            for key, value in zip(('changed', 'held'), line.changes(
                    process, 'm0.scale' if kind == KINEMATICS else 'm0.parameter0')):
                row[key].append(value)
        line.close()

    @contextmanager
    def _process(self, kind, name):
        given = (('-m', 'linkage_ros.nodes.kinematics') if kind == KINEMATICS else
                 ('-m', 'benchmark.nodes.growth', kind, str(self._ready)))
        process = Process(name, *given, parameters=self._file if kind == KINEMATICS else None)
        try:
            yield process
        finally:
            process.end()

    def _bodies(self):
        """Return what a tick takes the thread [us], one after the other in this process."""
        Bare.ready = pickle.loads(self._ready.read_bytes())
        given = [Parameter(name, value=value) for name, value in self._given.items()]
        nodes = {kind: made(namespace=f'/{kind}', **more) for kind, made, more in (
            (KINEMATICS, Kinematics, {'parameter_overrides': given}), (BARE, Bare, {}))}
        count = max(TICKS // len(self._machines), 5)
        ticks, cranks = {kind: [] for kind in nodes}, Cranks(self._machines)
        # Nodes hear from their executor who listens.
        executor = scene_node.Executor()
        for node in nodes.values():
            executor.add_node(node)
        try:
            with self._process('ear', KINEMATICS), self._process('ear', BARE):
                states = [p for kind, node in nodes.items() for p in node.publishers
                          if p.topic_name.startswith(f'/{kind}/m')
                          and p.topic_name.endswith('/joint_states')]
                deadline = time.perf_counter() + 60.0
                while not all(p.get_subscription_count() for p in states):
                    assert time.perf_counter() < deadline, 'nobody listens'
                    _spin(executor, 0.1)
                # Machine code is made beside the first ticks, and taken up between some.
                for _ in range(3):
                    _spin(executor, 1.0)
                    for node in nodes.values():
                        _ticks(node, cranks, 3)
                for _ in range(2 * self._rounds):
                    for kind, node in nodes.items():
                        ticks[kind].append(statistics.median(_ticks(node, cranks, count)))
        finally:
            executor.shutdown()
            for node in nodes.values():
                node.destroy_node()
        return ticks


def _spin(executor, seconds):
    until = time.perf_counter() + seconds
    while time.perf_counter() < until:
        executor.spin_once(timeout_sec=0.1)


def _ticks(node, cranks, count):
    turn = next(s for s in node.subscriptions if s.topic_name.endswith('crank_states')).callback
    times = []
    for _ in range(count):
        given = serialize_message(next(cranks))
        start = time.thread_time_ns()
        turn(given)
        times.append(1e-3 * (time.thread_time_ns() - start))
    return times


def main():
    """Run a node; return the exit code."""
    kind, path = remove_ros_args()[1:]
    with open(path, 'rb') as file:
        Bare.ready = Ear.ready = pickle.load(file)
    own = len(remove_ros_args())
    return scene_node.run({BARE: Bare, 'ear': Ear}[kind], kind, sys.argv[:1] + sys.argv[own:])


if __name__ == '__main__':
    sys.exit(main())
