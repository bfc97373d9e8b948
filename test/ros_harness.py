# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Real nodes on real topics: in this process, or as the processes that users start."""

import gc
import itertools
import math
import os
import subprocess
import sys
import tempfile
import time

from domains import Domain
from linkage_ros import scene
from linkage_ros.nodes import ownership
from linkage_ros.nodes.kinematics import Kinematics
from rcl_interfaces.msg import Log, ParameterEvent
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from sensor_msgs.msg import JointState

DEADLINE = 20.0
InvalidHandle = rclpy_implementation.InvalidHandle
# Until a service is asked once more [s]: of 1000 to 5000 responses one gets lost.
PATIENCE = 5.0
# Between publishing once more what may have been lost because nobody was found yet [s]; once an
# answer has come, what is repeated would be answered among what a test does next.
RETRY = 0.1


class Graph:
    """
    Nodes in a context and a domain of their own.

    `node` is there to publish, subscribe and call with; nothing moves but in `until`.
    """

    def __init__(self, domain=None, executor=SingleThreadedExecutor):
        self._domain, self._is_logged, self._executor = domain, False, executor

    def __enter__(self):
        self._own = None if self._domain else Domain()
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=self._domain or self._own.id)
        self.executor = self._executor(context=self.context)
        self._nodes = []
        self.node = self._add(rclpy.create_node(
            'tester', context=self.context, start_parameter_services=False))
        return self

    def __exit__(self, *_):
        self.executor.shutdown()
        for node in self._nodes:
            node.destroy_node()
        rclpy.try_shutdown(context=self.context)
        if self._own:
            self._own.release()

    def _add(self, node):
        self._nodes.append(node)
        self.executor.add_node(node)
        return node

    def start(self, node_class, parameters=None, **kwargs):
        """Start a node of this package with parameter values by name."""
        overrides = [Parameter(name, value=value) for name, value in (parameters or {}).items()]
        node = self._add(node_class(context=self.context, parameter_overrides=overrides, **kwargs))
        if self._is_logged:
            self.until(lambda: node.count_subscribers('/rosout'))
        return node

    def end(self, node):
        """End a node."""
        self.executor.remove_node(node)
        self._nodes.remove(node)
        node.destroy_node()

    def listen(self, type_, topic, qos=10):
        """Return the list that the messages of a topic are gathered in."""
        gathered = []
        self.node.create_subscription(type_, topic, gathered.append, qos)
        return gathered

    def publisher(self, type_, topic, qos=10):
        """Return a publisher of a topic once somebody subscribes to that."""
        publisher = self.node.create_publisher(type_, topic, qos)
        self.until(publisher.get_subscription_count)
        return publisher

    def announcer(self, node='/owner'):
        """Return a function that announces values by name as those of a node."""
        publisher = self.publisher(ParameterEvent, ownership.TOPIC, ownership.LATCHED)
        return lambda values: publisher.publish(ParameterEvent(node=node, changed_parameters=[
            Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]))

    def until(self, predicate, seconds=DEADLINE):
        """Let the nodes work until something holds; return what the predicate returned."""
        deadline = time.monotonic() + seconds
        while not (held := predicate()):
            assert time.monotonic() < deadline, 'did not happen in time'
            self.executor.spin_once(timeout_sec=0.005)
        return held

    def log(self):
        """Return a list that gathers the log messages of nodes that are started later."""
        # An ended node of the same name that is not collected yet would still own their loggers.
        gc.collect()
        gc.freeze()
        self._is_logged = True
        return self.listen(Log, '/rosout', 1000)

    def all_logged(self, node, log):
        """Return a list of log messages once it has all that a node has logged."""
        end = f'so far {len(log)}'
        node.get_logger().info(end)
        self.until(lambda: any(message.msg == end for message in log))
        return log

    def parameters(self, node):
        """Return a client of a node's parameters."""
        client = AsyncParameterClient(self.node, node.get_fully_qualified_name())
        self.until(client.services_are_ready)
        return client

    def set(self, node, meanwhile=lambda: None, **values):
        """
        Set parameters through the node's service; __ stands for a point in a name.

        `meanwhile` is called once they are answered, and before what they change is waited for.
        """
        client = self.parameters(node)
        parameters = [value if isinstance(value, Parameter) else
                      Parameter(name.replace('__', '.'), value=value)
                      for name, value in values.items()]
        result = self.answer(lambda: client.set_parameters_atomically(parameters)).result
        meanwhile()
        # What is accepted acts when it has been prepared.
        self.until(lambda: getattr(node, 'is_settled', True))
        return result

    def change(self, follower, parameters, **values):
        """Set parameters on a `kinematics` of these parameters, and wait until a node follows."""
        expected = {name.replace('__', '.'): scene.plain(value) for name, value in values.items()}
        owner = next((node for node in self._nodes if isinstance(node, Kinematics)), None)
        assert self.set(owner or self.start(Kinematics, parameters), **expected).successful
        self.until(lambda: expected == {one.name: one.value for one in follower.scene.parameters
                                        if one.name in expected})

    def call(self, client, request):
        """Return what a service answers."""
        self.until(client.service_is_ready)
        return self.answer(lambda: client.call_async(request))

    def answer(self, ask):
        """Return the result of a call; where its response gets lost, as some do, of the next."""
        futures, asked = [], -math.inf

        def answered():
            nonlocal asked
            if time.monotonic() > asked + PATIENCE:
                futures.append(ask())
                asked = time.monotonic()
            return [future for future in futures if future.done()]

        return self.until(answered)[0].result()

    def crank(self, names, topic='crank_states'):
        """Return a publisher of crank angles."""
        return Crank(self, names, topic)


class Crank:
    """A publisher of crank angles, each message with a stamp of its own."""

    _stamps = itertools.count(1)

    def __init__(self, graph, names, topic):
        self._graph, self.names = graph, names
        self._publisher = graph.node.create_publisher(JointState, topic, 10)
        # The lists in which an answer has come, by their number.
        self._answered = {}

    def __call__(self, angles, answers, velocities=()):
        """Publish angles until they are answered; return the answer."""
        message, published = self._message(angles, velocities), -math.inf
        pause = PATIENCE if id(answers) in self._answered else RETRY

        def answered():
            nonlocal published
            if time.monotonic() > published + pause:
                self._publisher.publish(message)
                published = time.monotonic()
            return [m for m in answers if _stamp(m) == message.header.stamp.sec]

        answer = self._graph.until(answered)[0]
        self._answered[id(answers)] = answers
        return answer

    def send(self, angles, velocities=()):
        """Publish angles once, return the stamp [s]; what is published later is handled later."""
        message = self._message(angles, velocities)
        self._publisher.publish(message)
        return message.header.stamp.sec

    def _message(self, angles, velocities):
        message = JointState(name=self.names, position=angles, velocity=velocities)
        message.header.stamp.sec = next(self._stamps)
        return message


def _stamp(message):
    header = message.markers[0].header if hasattr(message, 'markers') else message.header
    return header.stamp.sec


def hastened(node, seconds):
    """Return the timer of a node with a period [s], which now is a hundredth of a second."""
    timer, = (timer for timer in node.timers if timer.timer_period_ns == 1e9 * seconds)
    timer.timer_period_ns = 10 ** 7
    timer.reset()
    return timer


def module(name):
    """Return the module of an executable."""
    rooms = {'viewer': 'web.viewer', 'scene': 'nodes.scene_process'}
    return f'linkage_ros.{rooms.get(name, f"nodes.{name}")}'


class Process:
    """
    An executable of this package as users start it, with a parameter file.

    What a folder has that is `first` is imported before anything else.
    """

    def __init__(self, name, parameter_file, *arguments, domain=None, first='', as_module=False):
        self._domain = None if domain else Domain()
        self.domain = domain or self._domain.id
        start = ('-m', module(name)) if as_module else (
            '-c', f'from linkage_ros import executables; executables.{name}()')
        # A pipe that nobody reads would hold up who writes more than it holds.
        path = os.pathsep.join([str(first), os.environ.get('PYTHONPATH', '')])
        with tempfile.NamedTemporaryFile() as file:
            self._printed = open(file.name, encoding='utf-8')
            self._process = subprocess.Popen(
                [sys.executable, *start, *arguments, '--ros-args',
                 '--params-file', str(parameter_file)], stdout=file, stderr=subprocess.STDOUT,
                env={**os.environ, 'ROS_DOMAIN_ID': str(self.domain), 'PYTHONPATH': path})

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if not self.has_ended:
            self._process.kill()
            self.end()

    def interrupt(self, signal):
        """Send a signal."""
        self._process.send_signal(signal)

    @property
    def id(self):
        """Its number."""
        return self._process.pid

    @property
    def has_ended(self):
        """Whether it has ended."""
        return self._process.poll() is not None

    def line(self):
        """Return the next line that is printed, '' after the last."""
        line, has_ended = '', False
        while not line.endswith('\n') and not has_ended:
            has_ended = self.has_ended
            line += self._printed.readline()
            time.sleep(0.0 if line else 0.005)
        # `kinematics` says so once where that is not installed.
        return self.line() if 'instead of machine code' in line else line

    def end(self, seconds=DEADLINE):
        """Wait for the end; return exit code and all else that was printed."""
        with self._printed:
            try:
                code = self._process.wait(seconds)
            finally:
                self._process.kill()
                if self._domain:
                    self._domain.release()
            return code, self._printed.read()
