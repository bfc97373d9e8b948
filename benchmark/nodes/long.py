# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What takes long: a million messages, a minute at 1000 Hz, and ten minutes of trouble."""

import os
import signal
import time

from linkage_ros.nodes.kinematics import Kinematics
import numpy as np
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message

from . import changes, scenes
from .campaign import NODE, SUBJECT
from .driving import Process, resident

MIB = 2 ** 20


def soak(bench, count):
    """Return the growth of a node that turns 12 legs again and again, heard by a process [MiB]."""
    scene = '12 legs'
    ready = bench.ready(scene)
    node = Kinematics(namespace='/soak', parameter_overrides=[
        Parameter(name, value=value) for name, value in scenes.SCENES[scene].items()])
    turn = next(s for s in node.subscriptions if s.topic_name.endswith('crank_states')).callback
    ear = Process('soak', *SUBJECT, 'ear', '--ready', str(ready))
    try:
        assert bench.driver.until(lambda: all(
            node.count_subscribers(topic.name) for topic in scenes.topics(scene)))
        cranks, sizes = scenes.Cranks(scene), []
        for done in range(1, count + 1):
            turn(serialize_message(next(cranks)))
            if done % (count // 100) == 0:
                sizes.append(resident())
                assert ear.running()
    finally:
        ear.end()
        node.destroy_node()
    # A tenth is left out: buffers and caches fill.
    settled = sizes[9:]
    return {'messages': count, 'growth_mib': (settled[-1] - settled[0]) / MIB,
            'span_mib': (max(settled) - min(settled)) / MIB,
            'resident_mib': settled[-1] / MIB}


def hold(bench, rate, seconds):
    """Return what came of turning 12 legs at a rate [Hz] for some seconds."""
    scene = '12 legs'
    process = Process('held', *NODE, parameters=scenes.write(scene, bench.folder))
    try:
        line = bench.driver.line(process, scene, scenes.topics(scene))
        line.burst(200.0, 200)
        size, began = process.resident(), time.perf_counter()
        burst = line.burst(rate, round(rate * seconds))
        took = time.perf_counter() - began
        grown = process.resident() - size
    finally:
        process.end()
    found = burst.latencies or [float('nan')]
    return {'rate': rate, 'seconds': seconds, 'took': took, 'lost': burst.lost, 'cpu': burst.cpu,
            'p50': float(np.percentile(found, 50)), 'p99': float(np.percentile(found, 99)),
            'max': float(max(found)), 'growth_mib': grown / MIB,
            'load': os.getloadavg()[0]}


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
                given = changes.CHANGES[kinds[second % len(kinds)]](second % 40)
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
    settled = sizes[len(sizes) // 10:]
    return {'seconds': len(sizes), 'growth_mib': (settled[-1] - settled[0]) / MIB,
            'span_mib': (max(settled) - min(settled)) / MIB,
            'resident_mib': settled[-1] / MIB, 'answered_ms': float(np.median(took)),
            'longest_answer_ms': max(took)}
