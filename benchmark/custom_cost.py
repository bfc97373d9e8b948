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
What a linkage of the user's own costs, beside Jansen's leg of the catalogue.

Both are timed in turn, pose by pose and in arrays, and divided by the number of their
constructions; the last column is the ratio. Run it with `python -m benchmark.custom_cost`.
"""

import time

from linkage_ros import mechanisms
import numpy as np

# Twelve joints: an excavator-like chain of dyads and triangles behind a crank.
JOINTS = (
    'O ground 0 0', 'Q ground 4 0', 'R ground 8 1', 'A crank O m', 'B dyad A Q 4 3 left',
    'C rigid A B 3 2 left', 'D dyad C R 5 3 left', 'E rigid R D 2 2 right',
    'F dyad D E 3 2.5 left', 'G dyad C F 6 5 right', 'H rigid F G 4 3 left', 'I dyad G H 3 3 left')

BATCHES = 1, 100, 10_000
ROUNDS = 15
SAMPLE = 0.02


def linkages():
    """Return Jansen's leg and the custom linkage, each with how many constructions move."""
    leg, own = mechanisms.create('jansen'), mechanisms.create('custom', joints=JOINTS, m=1.0)
    assert len(own.points) == 12 and own.reach(), own.reach()
    return [(linkage, sum(line.word != 'ground' for line in design.lines)) for linkage, design in (
        (leg, mechanisms.design('jansen')), (own, mechanisms.design('custom', JOINTS, None, 'm')))]


def repeated(linkage, batch):
    """Return a function that solves poses for a while and returns the seconds each took."""
    lo, hi = linkage.reach()[0]
    theta = np.random.default_rng(1).uniform(lo, hi, max(batch, 64))
    if batch == 1:
        pose, scattered = linkage.function(), theta.tolist()

        def once():
            for angle in scattered:
                pose(angle)
    else:
        def once():
            linkage.solve(theta)

    def sample():
        poses, start = 0, time.thread_time()
        while time.thread_time() - start < SAMPLE:
            once()
            poses += len(theta)
        return (time.thread_time() - start) / poses

    once()
    return sample


def main():
    """Print the cost of a pose and of a construction in it."""
    both = linkages()
    print(f'{"poses at once":>14} {"Jansen [us]":>12} {"12 joints [us]":>15} '
          f'{"to one, a construction":>24}')
    for batch in BATCHES:
        samplers = [repeated(linkage, batch) for linkage, _ in both]
        took = np.array([[sample() for sample in samplers] for _ in range(ROUNDS)])
        best = took.min(axis=0)
        ratio = np.median(took[:, 1] / both[1][1] / (took[:, 0] / both[0][1]))
        print(f'{batch:>14} {1e6 * best[0]:>12.3f} {1e6 * best[1]:>15.3f} {ratio:>24.2f}')


if __name__ == '__main__':
    main()
