# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a command costs `servo_inverse` that follows a stream, next to a node that sends bytes."""

import itertools
import pickle

from linkage_ros import mechanisms
import numpy as np
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from . import driving, scenes
from .campaign import SECONDS, SUBJECT

SCENE = 'one leg'
# What is wanted, by the output: a lever has a closed form, any other output is searched for.
WANTED = {'leg_lever': 'slotted_lever', 'leg_BC': 'jansen', 'leg_G.x': 'jansen'}
NODE = ('-m', 'linkage_ros.nodes.servo_inverse')
BARE = ('-r', 'crank_states:=wanted_states')


class Line:
    """From the driver to one process and back, as driving.Line, for commands."""

    def __init__(self, driver, process, wanted):
        self.process, self._driver, self.heard = process, driver, [[]]
        output = wanted.partition('_')[2]
        linkage = mechanisms.create(WANTED[wanted])
        (_, low), (_, high) = linkage.extremes(output)[0]
        way = 0.5 * (low + high) + 0.45 * (high - low) * np.sin(np.linspace(0.0, 6.28, 500))
        values = linkage.joint_angles(way, [output])[output].tolist()
        self.cranks = (JointState(name=[wanted], position=[value], velocity=[0.1])
                       for value in itertools.cycle(values))
        self.publisher = driver.node.create_publisher(
            JointState, f'/{process.name}/wanted_states', 10)
        self._ear = driver.node.create_subscription(
            JointState, f'/{process.name}/servo_commands', self._hear, 1000, raw=True)

    def _hear(self, text):
        self.text = bytes(text)
        self.heard[0].append(driving.time.perf_counter())

    send = driving.Line.send
    connected = driving.Line.connected
    burst = driving.Line.burst

    def close(self):
        """Hear no more."""
        self._driver.node.destroy_publisher(self.publisher)
        self._driver.node.destroy_subscription(self._ear)


def compare(bench, rates):
    """Return rows: CPU time [us a command] of the node and of the floor, a value a round."""
    rows, ready = [], bench.folder / 'commands.ready'
    message = JointState(name=['leg_crank'], position=[1.0], velocity=[1.0])
    ready.write_bytes(pickle.dumps({
        scenes.Topic('servo_commands', True): serialize_message(message)}))
    for wanted, type_ in WANTED.items():
        path = bench.folder / f'{type_}.yaml'
        path.write_text('/**:\n  ros__parameters:\n    mechanisms: [leg]\n'
                        f'    leg.type: {type_}\n')
        processes = [driving.Process('stream', *NODE, parameters=path),
                     driving.Process('floor', *SUBJECT, 'floor', '--ready', str(ready),
                                     '--ros-args', *BARE)]
        lines = []
        try:
            for process in processes:
                lines.append(Line(bench.driver, process, wanted))
                assert bench.driver.until(lines[-1].connected)
            for rate in rates:
                cpus = [[line.burst(rate, round(rate * SECONDS[rate])).cpu for line in lines]
                        for _ in range(bench.rounds + 1)][1:]
                rows += [{'wanted': wanted, 'rate': rate, 'subject': kind, 'cpus': list(own)}
                         for kind, own in zip(('stream', 'floor'), zip(*cpus))]
        finally:
            for line in lines:
                line.close()
            for process in processes:
                process.end()
    return rows
