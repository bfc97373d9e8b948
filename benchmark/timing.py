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
How long a method takes: samples taken in turn with all the others.

All methods run on one core, and the CPU time of the process is what is counted, threads of a
method's own with it: other programs on the machine then matter less.
"""

import gc
import math
import time

import numpy as np

from .methods.method import Method
from .problems import pose, REACH

BATCHES = Method.batches
ROUNDS = 9
# A sample is to last this long at least, so that the clock does not matter [s].
SAMPLE = 2e-4
# A cell whose three samples would take longer than this is not run [s].
LIMIT = 0.9


class Stopwatch:
    """One method on one linkage at one batch size."""

    def __init__(self, method, kind, batch):
        self._method = method
        self._batch = batch
        self._theta = _sweep(kind, batch) if method.follows else _scattered(kind, batch)
        self._repeats = 1
        self.samples = []
        if method.follows:
            self._start = 2 * self._theta[0] - self._theta[1]
            self._pose = pose(kind, self._start)

    def warm_up(self):
        """Run until caches are warm, and return the seconds that the last run took."""
        for _ in range(2 if self._batch < 1000 else 1):
            self._set_down()
            took = self._once()
        if not self._method.follows:
            self._repeats = max(1, math.ceil(SAMPLE / max(took, 1e-9)))
        return took

    @property
    def repeats(self):
        """How often a sample repeats what it measures."""
        return self._repeats

    def sample(self):
        """Take one sample: microseconds a pose."""
        self._set_down()
        took = 0.0
        for _ in range(self._repeats):
            took += self._once()
        self.samples.append(1e6 * took / (self._repeats * self._theta.size))

    def _set_down(self):
        if self._method.follows:
            self._method.start(self._start, self._pose)

    def _once(self):
        if self._batch > 1:
            start = time.process_time()
            self._method.solve(self._theta)
            return time.process_time() - start
        solve, angles = self._method.solve_one, self._theta.tolist()
        start = time.process_time()
        for theta in angles:
            try:
                solve(theta)
            except Exception:  # counted among the failures, not here
                pass
        return time.process_time() - start


def _scattered(kind, batch):
    """Return random angles within reach; for single poses a handful to go through."""
    reach = 0.99 * REACH[kind]
    return np.random.default_rng(1).uniform(-reach, reach, batch if batch > 1 else 64)


def _sweep(kind, batch):
    """Return angles in even steps of a degree at most: onwards, or across the reach."""
    count = batch if batch > 1 else 64
    if REACH[kind] == math.pi:
        return 0.3 + np.radians(np.arange(count))
    reach = 0.95 * REACH[kind]
    step = min(math.radians(1), 2 * reach / count)
    return (np.arange(count) - count / 2) * step


def measure(methods, kind, batch, budget):
    """
    Time methods in turn, a slice of the budget [s] each in every round.

    Returns {method: samples [us a pose]}, None where three samples would break the `LIMIT`.
    """
    watches, slices = {}, {}
    for method in methods:
        watch = Stopwatch(method, kind, batch)
        if _too_long(method, kind, batch):
            continue
        slices[method] = max(watch.warm_up(), 1e-9) * watch.repeats
        watches[method] = watch
    gc.collect()
    gc.disable()
    try:
        for n in range(ROUNDS):
            for method, watch in watches.items():
                count = int(budget / (ROUNDS * slices[method]))
                # A slow method gets its three samples in the first, middle and last round.
                due = min(count, 50) or int(n in (0, ROUNDS // 2, ROUNDS - 1))
                for _ in range(due):
                    watch.sample()
    finally:
        gc.enable()
    return {method: watches[method].samples if method in watches else None for method in methods}


def _too_long(method, kind, batch):
    """Tell from smaller batches whether three samples would break the limit."""
    for smaller in BATCHES[1:BATCHES.index(batch)]:
        took = Stopwatch(method, kind, smaller).warm_up()
        if 3 * took / smaller * batch > LIMIT * (1 if smaller * 100 >= batch else 10):
            return True
    return False
