# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Run time against error, side by side: ours, C, the original formulas, what one would pick instead.

    python -m benchmark.run [--document] [--budget SECONDS]

All are asked for the same poses in turn, on one core; times are CPU time, medians. A peer whose
package is not installed is left out. With --document the table goes into docs/design/accuracy.md.
"""

import os
import sys
import time

# One core for every method.
for library in ('OMP', 'OPENBLAS', 'MKL', 'NUMEXPR'):
    os.environ.setdefault(f'{library}_NUM_THREADS', '1')
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})

from gmpy2 import mpc  # noqa: E402
import numpy as np  # noqa: E402

from . import document, peers  # noqa: E402

ROUNDS, BATCHES = 9, (1, 1000, 100_000)
# Half of the crank's reach: half a turn, or nearly up to where a Peaucellier cell folds.
REACH = {'peaucellier': 0.999 * 2 * np.arccos(5 / 6)}
# What is off by more of the longest bar is another assembly, or no answer.
ASTRAY = 0.05


def angles(kind):
    """Return the crank angles [rad] at which errors are looked at, in order."""
    reach, tiny = REACH.get(kind, np.pi), 10.0 ** -np.arange(1, 16)
    near = np.concatenate([-tiny, [0.0], tiny])
    return np.unique(np.concatenate([np.linspace(-reach, reach, 721), near, *(
        [reach - tiny, tiny - reach] if kind not in REACH else [])]))


def errors(method, theta, places, size):
    """Return the median and largest error [2^-53 of the longest bar] and how many are wrong."""
    found = []
    for value, true in zip(theta.tolist(), places):
        try:
            answer = method.one(value) if method.one else method.many(np.array([value]))
            row = np.reshape(method.rows(answer), (-1, 2))
            error = max(float(abs(mpc(x, y) - place))
                        for (x, y), place in zip(row.tolist(), true))
        except (ValueError, ArithmeticError, RuntimeError):  # no pose
            error = np.inf
        found.append(error if error < ASTRAY * size else np.inf)
    found = np.array(found) / (size * 2.0 ** -53)
    right = found[np.isfinite(found)]
    return np.median(right), right.max(), len(found) - len(right)


def times(methods, kind, batch, budget):
    """Return the CPU time of a pose [us] of each method, all in turn; None where it has none."""
    reach, begin = 0.99 * REACH.get(kind, np.pi), angles(kind)[-1]
    scattered = np.random.default_rng(1).uniform(-reach, reach, batch)
    even = begin + 0.01 * np.arange(1, batch + 1)
    steps = begin + np.radians(np.arange(1, 64 * (ROUNDS + 1) + 1))
    taken = {method: [] for method in methods if (method.one if batch == 1 else method.many)}
    for n in range(-1, ROUNDS):
        for method, samples in taken.items():
            if batch == 1:
                # Those that follow go on from where they stand; all others may as well.
                given = steps[64 * (n + 1):64 * (n + 2)].tolist()
            start, count = time.process_time(), 0
            while count == 0 or (time.process_time() - start < budget and not (
                    method.follows or n < 0)):
                if batch == 1:
                    for theta in given:
                        _try(method.one, theta)
                    count += len(given)
                else:
                    method.many(even if method.follows else scattered)
                    count += batch
            if n >= 0:
                samples.append(1e6 * (time.process_time() - start) / count)
    return {method: np.median(samples) for method, samples in taken.items()}


def _try(solve, theta):
    try:
        solve(theta)
    except (ValueError, ArithmeticError):
        pass


def compared(kind, budget):
    """Yield the rows of a linkage."""
    theta = angles(kind)
    true = [[places[name] for name in peers.POINTS[kind]]
            for places in (peers.truth(kind, value) for value in theta.tolist())]
    size = peers.longest(kind)
    methods = [method for make in peers.KINDS for method in make(kind)]
    if kind == peers.LEG:
        for package, make in peers.PEERS.items():
            try:
                methods += make(float(theta[0]) - 0.01)
            except ImportError as missing:
                print(f'left out: {package}: {missing}', file=sys.stderr)
    wrong = {method: errors(method, theta, true, size) for method in methods}
    took = [times(methods, kind, batch, budget) for batch in BATCHES]
    for method in methods:
        median, most, failed = wrong[method]
        yield [f'{kind}, {method.name}' + ' *' * method.follows, *(
            f'{each[method]:#.3g}' if method in each else '' for each in took),
            f'{median:.2g}', f'{most:.2g}', f'{failed} of {len(theta)}']


def main():
    """Measure and print."""
    parser = document.parser(__doc__)
    parser.add_argument('--budget', type=float, default=0.02, help='a sample [s]')
    options = parser.parse_args()
    np.seterr(all='ignore')
    rows = [row for kind in peers.POINTS for row in compared(kind, options.budget)]
    text = document.table(['CPU time per pose [us]', *BATCHES, 'median error [uL]', 'worst [uL]',
                           'wrong'], rows)
    text += '\n\n' + document.machine('llvmlite', *peers.PEERS)
    document.show(options, 'design/accuracy.md', text, 'measured: comparison')


if __name__ == '__main__':
    main()
