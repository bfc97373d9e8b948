# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Processes that are measured, and the one that drives them and hears them."""

import pickle
import signal
import subprocess
import sys
import time

from linkage_ros.nodes import scene_node
import rclpy
from sensor_msgs.msg import JointState
from visualization_msgs.msg import MarkerArray

from . import scenes

DEADLINE = 30.0
# How late a message may be sent before all that follow are sent later [s].
LATE = 0.01
# After the last message of a burst, answers are waited for this long [s].
PATIENCE = 0.5
# Between two messages to which an answer is waited for [s].
PAUSE = 0.05


class Process:
    """A node in a process and a namespace of its own."""

    def __init__(self, name, *arguments, parameters=None):
        self.name = name
        given = ['--params-file', str(parameters)] if parameters else []
        self._process = subprocess.Popen(
            [sys.executable, *arguments, '--ros-args', '-r', f'__ns:=/{name}', *given])
        # The number of a process's CPU clock is made from its id, as clock_getcpuclockid does.
        self._clock = (~self._process.pid << 3) | 2

    def cpu(self) -> float:
        """Return the CPU time of all its threads [s]."""
        return time.clock_gettime(self._clock)

    def executor(self) -> float:
        """Return the CPU time of the thread that it began with [s]."""
        with open(f'/proc/{self._process.pid}/task/{self._process.pid}/schedstat') as text:
            return 1e-9 * int(text.read().split()[0])

    def end(self):
        """End it as a user does."""
        self._process.send_signal(signal.SIGINT)
        try:
            self._process.wait(DEADLINE)
        finally:
            self._process.kill()


class Burst:
    """What came of a number of crank messages at a rate."""

    def __init__(self, sent, heard, cpu):
        self.lost = max((len(sent) - len(times) for times in heard), default=0)
        self.cpu = 1e6 * cpu / (len(sent) - self.lost)
        # Answers come in order: where none is missing, the nth is to the nth message.
        self.latencies = [] if self.lost or not heard else [
            1e6 * (max(answers) - asked) for asked, *answers in zip(sent, *heard)]


class Driver:
    """The node that sends crank messages and hears joint states."""

    def __init__(self):
        rclpy.init()
        self.node = rclpy.create_node('driver')
        # Nobody takes what arrives for this one: what a drawing program does is not measured.
        self.idle = rclpy.create_node('viewer')
        self.executor = scene_node.Executor()
        self.executor.add_node(self.node)

    def end(self):
        """End it."""
        self.executor.shutdown()
        self.node.destroy_node()
        self.idle.destroy_node()
        rclpy.try_shutdown()

    def wait(self, seconds):
        """Let what arrives be heard for a while."""
        until = time.perf_counter() + seconds
        while (left := until - time.perf_counter()) > 0.0:
            self.executor.spin_once(timeout_sec=left)

    def until(self, predicate, seconds=DEADLINE, executor=None):
        """Let what arrives be heard until something holds; return whether it did."""
        deadline = time.perf_counter() + seconds
        while not (held := predicate()) and time.perf_counter() < deadline:
            (executor or self.executor).spin_once(timeout_sec=0.02)
        return held

    def line(self, process, scene, topics):
        """Return what drives a process that answers on some topics, when both are connected."""
        line = Line(self, process, scene, topics)
        if not self.until(line.connected):
            raise RuntimeError(f'{process.name} did not answer in {DEADLINE} s')
        return line

    def capture(self, process, scene, path):
        """Write down what a process answers."""
        line = self.line(process, scene, scenes.topics(scene))
        heard = {}
        subscriptions = [
            self.node.create_subscription(
                JointState if topic.joints else MarkerArray, f'/{process.name}/{topic.name}',
                lambda text, topic=topic: heard.update({topic: bytes(text)}), 10, raw=True)
            for topic in scenes.topics(scene)]

        def complete():
            line.send()
            return len(heard) == len(subscriptions)

        assert self.until(complete)
        for subscription in subscriptions:
            self.node.destroy_subscription(subscription)
        path.write_bytes(pickle.dumps(heard))
        line.close()


class Line:
    """From the driver to one process and back."""

    def __init__(self, driver, process, scene, topics):
        self.process, self._driver = process, driver
        self.cranks = scenes.Cranks(scene)
        self.publisher = driver.node.create_publisher(
            JointState, f'/{process.name}/crank_states', 10)
        self.heard, self._sent = [], 0.0
        self._subscriptions = [
            self._hear(f'/{process.name}/{topic.name}') if topic.joints
            else driver.idle.create_subscription(
                MarkerArray, f'/{process.name}/{topic.name}', self._ignore, 1, raw=True)
            for topic in topics]

    def _hear(self, path):
        times = []
        self.heard.append(times)
        return self._driver.node.create_subscription(
            JointState, path, lambda _: times.append(time.perf_counter()), 1000, raw=True)

    def _ignore(self, _):
        pass

    def close(self):
        """Hear no more."""
        self._driver.node.destroy_publisher(self.publisher)
        for subscription in self._subscriptions:
            self._driver.node.destroy_subscription(subscription)
            self._driver.idle.destroy_subscription(subscription)
        self._driver.wait(0.1)

    def send(self):
        """
        Send the next crank message, unless one was just sent.

        Each answer wakes who waits for all of them: of sixty, each would ask for sixty more.
        """
        if time.perf_counter() > self._sent + PAUSE:
            self._sent = time.perf_counter()
            self.publisher.publish(next(self.cranks))

    def connected(self):
        """Return whether both ends know each other; sends a message."""
        if not self.publisher.get_subscription_count():
            return False
        self.send()
        return all(self.heard)

    def burst(self, rate, count):
        """Send crank messages at a rate [Hz]; return what came of it."""
        self._driver.wait(0.05)
        for times in self.heard:
            times.clear()
        spin, sent, cpu = self._driver.executor.spin_once, [], self.process.cpu()
        start = time.perf_counter()
        while len(sent) < count:
            now = time.perf_counter()
            # A driver that the machine kept waiting does not send in a heap what it missed.
            start = max(start, now - len(sent) / rate - LATE)
            left = start + len(sent) / rate - now
            if left > 0.0:
                spin(timeout_sec=left)
            else:
                message = next(self.cranks)
                sent.append(time.perf_counter())
                self.publisher.publish(message)
        deadline = time.perf_counter() + PATIENCE
        while (any(len(times) < count for times in self.heard)
               and time.perf_counter() < deadline):
            spin(timeout_sec=0.01)
        if not self.heard:
            self._driver.wait(0.05)
        return Burst(sent, self.heard, self.process.cpu() - cpu)
