# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
How long poses are held up by changes of parameters, at 500 Hz and 12 legs.

`kinematics` runs as a process; a thread publishes crank messages at equal times, the time between
one joint state and the next is taken as it arrives here. What no change at all brings is printed
beside: the machine's own part. The CPU time of the executor for a change is taken without crank
messages. At 200 Hz it is counted how many messages 100 requests at once cost, and by how much they
delay one.
"""

from contextlib import contextmanager
import itertools
import threading
import time

import numpy as np
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState

from . import scenes
from .driving import Process

SCENE, NODE, RATE = '12 legs', ('-m', 'linkage_ros.nodes.kinematics'), 500.0
ROUNDS, BREAK = 12, 0.25
# Rate of the messages among which 100 requests come [Hz], and the kind of these.
CROWD_RATE, CROWD = 200.0, '100 requests'
# The requests that a change is made of, by its number: of each request names and values.
CHANGES = {
    'none': lambda i: [],
    'dimension': lambda i: [[('walker.dimensions.m', 14.0 + 0.02 * i)]],
    'branch': lambda i: [[('walker.branches.F', (-1) ** i)]],
    'scale': lambda i: [[('walker.scale', 0.01 + 1e-5 * i)]],
    'legs': lambda i: [[('walker.leg_pairs', 6 - i % 2)]],
    'points': lambda i: [[('walker.points', ['O', 'A', 'C', 'G'][i % 2:])]],
    'pose': lambda i: [[('walker.pose', [0.01 * i, 0.0, 0.0, 0.0, 0.0, 0.0])]],
    'frame_id': lambda i: [[('frame_id', f'frame{i}')]],
    'refused': lambda i: [[('walker.dimensions.b', 1.0 + 0.01 * i)]],
    '100 in one request': lambda i: [[('walker.dimensions.m', value) for value in _hundred(i)]],
    CROWD: lambda i: [[('walker.dimensions.m', value)] for value in _hundred(i)],
}


def _hundred(i):
    return [14.0 + 0.01 * j + 1e-4 * i for j in range(100)]


@contextmanager
def turning(line, rate=RATE):
    """Send crank messages at a rate [Hz] from a thread; yield the times, by their stamps."""
    over, sent = threading.Event(), {}

    def run():
        start = time.perf_counter()
        for count in itertools.count(1):
            left = start + count / rate - time.perf_counter()
            if over.wait(max(left, 0.0)):
                break
            message = next(line.cranks)
            sent[message.header.stamp.nanosec] = time.perf_counter()
            line.publisher.publish(message)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield sent
    finally:
        over.set()
        thread.join()


def made(requests):
    """Return requests, each given as names and values."""
    return [SetParameters.Request(parameters=[
        Parameter(name, value=value).to_parameter_msg() for name, value in request])
        for request in requests]


def change(driver, client, requests):
    """Send requests at once; return the seconds until all are answered."""
    asked = time.perf_counter()
    futures = [client.call_async(request) for request in requests]
    driver.until(lambda: all(future.done() for future in futures), 5.0)
    return time.perf_counter() - asked


def gaps(driver, line, client, kind):
    """Return the longest time between two poses [ms] around each change, and what each took."""
    times, found, took = line.heard[0], [], []
    for i in range(ROUNDS):
        # What takes the driver's time is not the node's.
        requests = made(CHANGES[kind](i))
        driver.wait(BREAK)
        times[:] = times[-1:]
        driver.wait(0.05)
        took.append(1e3 * change(driver, client, requests))
        driver.wait(BREAK)
        found.append(1e3 * np.diff([*times, time.perf_counter()]).max())
    return found, took


def crowd(driver, line, client, kind):
    """Return how many messages requests at once cost, and the longest delays of one [ms]."""
    heard, delays, lost = {}, [], 0
    topic = f'/{line.process.name}/{scenes.topics(SCENE)[0].name}'
    ear = driver.node.create_subscription(
        JointState, topic, lambda message: heard.setdefault(
            message.header.stamp.nanosec, time.perf_counter()), 1000)
    with turning(line, CROWD_RATE) as sent:
        driver.wait(1.0)
        for i in range(ROUNDS):
            requests = made(CHANGES[kind](i))
            driver.wait(BREAK)
            first = len(sent)
            change(driver, client, requests)
            driver.wait(BREAK)
            stamps = [*sent][first:len(sent) - int(0.5 * BREAK * CROWD_RATE)]
            lost += sum(stamp not in heard for stamp in stamps)
            delays.append(1e3 * max(heard[stamp] - sent[stamp]
                                    for stamp in stamps if stamp in heard))
    driver.node.destroy_subscription(ear)
    return lost, delays


def executor(driver, process, client, kind):
    """Return the CPU time [ms] of the executor until a change is answered, and until the end."""
    found = []
    for i in range(4 * ROUNDS):
        requests, start = made(CHANGES[kind](i)), process.executor()
        change(driver, client, requests)
        answered = process.executor()
        driver.wait(0.1)
        found.append([1e3 * (answered - start), 1e3 * (process.executor() - start)])
    return np.median(found, axis=0).tolist()


def measure(bench):
    """Return rows: gaps, answers and CPU time of the executor [ms] of each kind of change."""
    driver = bench.driver
    process = Process('changed', *NODE, parameters=scenes.write(SCENE, bench.folder))
    try:
        line = driver.line(process, SCENE, scenes.topics(SCENE))
        client = driver.node.create_client(SetParameters, '/changed/kinematics/set_parameters')
        rows, cpus = [], {kind: executor(driver, process, client, kind)
                          for kind in CHANGES if '100' not in kind and kind != 'none'}
        crowds = {kind: crowd(driver, line, client, kind) for kind in ('none', CROWD)}
        with turning(line):
            driver.wait(2.0)
            for kind in CHANGES:
                found, took = gaps(driver, line, client, kind)
                rows.append({'kind': kind, 'gap': float(np.median(found)),
                             'longest': float(max(found)), 'answered': float(np.median(took)),
                             **dict(zip(('validated', 'executor'), cpus.get(kind, ())))})
        for row in rows:
            if row['kind'] in crowds:
                row['lost'], delays = crowds[row['kind']]
                row['delay'] = float(np.median(delays))
        line.close()
    finally:
        process.end()
    return rows
