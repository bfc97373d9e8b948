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
The pieces of the measurement, each in a process of its own.

    python -m benchmark.nodes.piece NAME JSON [--rounds N] [--quick]
"""

import argparse
from functools import partial
import json
import os
from pathlib import Path
import tempfile
import time
import timeit
from types import SimpleNamespace
from typing import Callable, NamedTuple

from benchmark.machine import machine

from . import campaign, changes, driving, growth, long, processes, report, scenes, stream

ROS = [SimpleNamespace(package=name) for name in ('ros-rclpy', 'ros-rmw-fastrtps-cpp')]
ROUNDS, QUICK_ROUNDS = 7, 2
HELD = '12 legs', 'sixteen mechanisms'
STARTED = '12 legs', 'sixty mechanisms'


class Piece(NamedTuple):
    """What is measured in one go, and how long that takes [minutes]; also without llvmlite."""

    minutes: float
    measure: Callable
    is_plain: bool = False


def _scene(scene, bench, quick):
    rates = campaign.COMPARED[scene]
    return {'rows': bench.cost(scene, rates[-1:] if quick else rates),
            'bodies': bench.bodies(scene)}


def _layers(bench, quick):
    return [part for rate in campaign.RATES[-1 if quick else 0:]
            for part in bench.parts('12 legs', rate)]


def _processes(scene, bench, _):
    return {what: [row for rate in (50.0, 200.0) for row in measure(bench, scene, rate)]
            for what, measure in (('processes', processes.compare), ('drivers', processes.drive))}


PIECES = {
    # Without the legs of a walker there is no machine code.
    **{scene: Piece(minutes, partial(_scene, scene), scene == '12 legs') for scene, minutes in (
        ('one leg', 2.5), ('12 legs', 4.0), ('four mechanisms', 2.0), ('sixty mechanisms', 2.5))},
    'layers': Piece(2.0, _layers),
    'services': Piece(1.0, lambda bench, quick: bench.services(40 if quick else 200), True),
    'starts': Piece(4.0, lambda bench, _: {scene: bench.starts(scene) for scene in STARTED}, True),
    'changes': Piece(3.0, lambda bench, _: changes.measure(bench), True),
    'hold': Piece(3.0, lambda bench, quick: [
        long.hold(bench, scene, 1000.0, 3.0 if quick else 60.0) for scene in HELD], True),
    'soak': Piece(9.0, lambda bench, quick: long.soak(bench, 10 ** (4 if quick else 6)), True),
    'trouble': Piece(3.0, lambda bench, quick: long.trouble(bench, 10.0 if quick else 120.0)),
    **{f'processes, {scene}': Piece(6.0, partial(_processes, scene)) for scene in scenes.SCENES},
    'stream': Piece(5.0, lambda bench, quick: stream.compare(
        bench, campaign.RATES[-1 if quick else 0:])),
    'growth': Piece(8.0, lambda bench, quick: growth.grow(bench, 3 if quick else None)),
}


def main():
    """Measure one piece, and write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('name', choices=PIECES)
    parser.add_argument('output', type=Path)
    parser.add_argument('--rounds', type=int)
    parser.add_argument('--quick', action='store_true')
    options = parser.parse_args()
    started, driver = time.time(), driving.Driver()
    try:
        with tempfile.TemporaryDirectory() as folder:
            bench = campaign.Bench(driver, Path(folder), options.rounds or (
                QUICK_ROUNDS if options.quick else ROUNDS))
            found = PIECES[options.name].measure(bench, options.quick)
    finally:
        driver.end()
    options.output.write_text(json.dumps({
        'found': found, 'machine': machine(ROS), 'cores': os.cpu_count(),
        'load': os.getloadavg()[2], 'seconds': round(time.time() - started),
        'yardstick': 1e6 * min(timeit.repeat(report.YARDSTICK, number=50, repeat=20)) / 50}))


if __name__ == '__main__':
    main()
