# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What the nodes cost, next to what any node costs, in the same run.

    python -m benchmark.nodes             everything but what is below, in some ten minutes
    python -m benchmark.nodes --quick     a look, within a minute or two
    python -m benchmark.nodes --soak      a million messages, in three minutes or so
    python -m benchmark.nodes --hold      a minute at 1000 Hz, twice
    python -m benchmark.nodes --changes   how long poses wait for a change, in two minutes
    python -m benchmark.nodes --processes a scene in one process, and in three; its driver
    python -m benchmark.nodes --growth    1 to 1000 mechanisms and 1 to 100 legs, in six minutes
    python -m benchmark.nodes --stream    commands for actuators
    python -m benchmark.nodes --trouble   two minutes of changes, bad bytes and stalled listeners

Results go to benchmark/results/nodes.json, each mode into its own part, those of a look to
benchmark/.cache/; the tables are printed, and written into docs/performance.md where --document is
given.
"""

import argparse
import json
import os
from pathlib import Path
import sys
import tempfile
import time
import timeit
from types import SimpleNamespace

from domains import Domain

from . import report
from .. import document

ROS = [SimpleNamespace(package=name) for name in ('ros-rclpy', 'ros-rmw-fastrtps-cpp')]
HERE = Path(__file__).parents[1]


def main():
    """Run, write and print."""
    # The processes find each other here and nobody else.
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    domain = Domain()
    os.environ.setdefault('ROS_DOMAIN_ID', str(domain.id))
    options = arguments()
    result = json.loads(options.output.read_text()) if options.output.exists() else {}
    if not options.tables:
        result.update(run(options))
    options.output.parent.mkdir(parents=True, exist_ok=True)
    options.output.write_text(json.dumps(result, indent=1) + '\n')
    tables = report.document(result)
    if options.document:
        document.write('performance.md', report.in_short(result), 'measured: in short')
        document.write('performance.md', tables)
        if 'growth' in result:
            from . import growth_plot

            growth_plot.draw(result['growth'], document.DOCS / 'images' / 'growth.png')
    print(report.in_short(result), tables, sep='\n\n')


def arguments():
    """Return what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    mode = parser.add_mutually_exclusive_group()
    mode.add_argument('--quick', action='store_true', help='one rate and fewer rounds')
    mode.add_argument('--soak', type=int, nargs='?', const=10 ** 6, metavar='MESSAGES')
    mode.add_argument('--hold', type=float, nargs='?', const=60.0, metavar='SECONDS')
    mode.add_argument('--trouble', type=float, nargs='?', const=120.0, metavar='SECONDS')
    mode.add_argument('--changes', action='store_true', help='how long poses wait for a change')
    mode.add_argument('--processes', action='store_true', help='one process against three')
    mode.add_argument('--growth', action='store_true', help='1 to 1000 mechanisms')
    mode.add_argument('--stream', action='store_true', help='commands for actuators')
    mode.add_argument('--tables', action='store_true', help='run nothing, show the last results')
    parser.add_argument('--document', action='store_true', help='write the tables to docs/')
    parser.add_argument('--rounds', type=int, help='bursts of each subject')
    parser.add_argument('--output', type=Path, metavar='JSON')
    options = parser.parse_args()
    options.output = options.output or (
        HERE / ('.cache' if options.quick else 'results') / 'nodes.json')
    return options


def run(options):
    """Return the parts of the result that were asked for."""
    from benchmark.machine import machine

    from . import campaign, changes, driving, growth, long, processes, scenes, stream

    started = time.time()
    driver = driving.Driver()
    try:
        with tempfile.TemporaryDirectory() as folder:
            bench = campaign.Bench(
                driver, Path(folder), options.rounds or (2 if options.quick else 7))
            if options.soak:
                return {'soak': long.soak(bench, options.soak)}
            if options.hold:
                return {'hold': [long.hold(bench, scene, 1000.0, options.hold)
                                 for scene in ('12 legs', 'sixteen mechanisms')]}
            if options.trouble:
                return {'trouble': long.trouble(bench, options.trouble)}
            if options.changes:
                return {'changes': changes.measure(bench)}
            if options.growth:
                return {'growth': growth.grow(bench)}
            if options.stream:
                return {'stream': stream.compare(bench, campaign.RATES)}
            if options.processes:
                return {what: [row for scene in scenes.SCENES for rate in (50.0, 200.0)
                               for row in measure(bench, scene, rate)] for what, measure in (
                    ('processes', processes.compare), ('drivers', processes.drive))}
            rows, bodies = [], []
            compared = {scene: rates[-1:] for scene, rates in campaign.COMPARED.items()
                        if scene in scenes.SCENES} if options.quick else campaign.COMPARED
            for scene, rates in compared.items():
                rows += bench.cost(scene, rates)
                bodies += bench.bodies(scene)
                print(f'{scene}: {time.time() - started:.0f} s', file=sys.stderr)
            rates = campaign.RATES[-1:] if options.quick else campaign.RATES
            parts = [part for rate in rates for part in bench.parts('12 legs', rate)]
            return {'rows': rows, 'parts': parts, 'bodies': bodies,
                    'starts': bench.starts(),
                    'services': bench.services(40 if options.quick else 200),
                    'yardstick': 1e6 * min(timeit.repeat(
                        report.YARDSTICK, number=50, repeat=20)) / 50,
                    'machine': machine(ROS), 'cores': os.cpu_count(),
                    'load': os.getloadavg()[2],
                    'seconds': round(time.time() - started)}
    finally:
        driver.end()


if __name__ == '__main__':
    main()
