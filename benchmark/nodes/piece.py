# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
A piece of the measurement, in a process of its own: a scene, or changes.

    python -m benchmark.nodes.piece NAME JSON [--quick]
"""

import json
import os
from pathlib import Path
import sys
import tempfile

from . import campaign, changes, driving, scenes
from .. import document

# Bursts of each subject, and of a look.
ROUNDS, QUICK_ROUNDS = 7, 2


def measured(name, quick):
    """Return what a piece finds."""
    driver = driving.Driver()
    try:
        with tempfile.TemporaryDirectory() as folder:
            bench = campaign.Bench(driver, Path(folder), QUICK_ROUNDS if quick else ROUNDS)
            if name not in scenes.SCENES:
                return changes.measure(bench)
            rates = campaign.rates(name)[-1 if quick else 0:]
            return {'rows': bench.cost(name, rates), 'bodies': bench.bodies(name)}
    finally:
        driver.end()


if __name__ == '__main__':
    name, path, *quick = sys.argv[1:]
    Path(path).write_text(json.dumps({
        'found': measured(name, bool(quick)), 'load': os.getloadavg()[2],
        'machine': document.machine('ros-rclpy', 'ros-rmw-fastrtps-cpp')}))
