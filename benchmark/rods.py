# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Measure ankles on two rods: their set-up with its proof, refusals, and poses against all roots.

    python -m benchmark.rods [--ankles 5] [--pairs 100000] [--document]

Those of public models have the ranges of their makers, random ones the largest limits that are
proved; refused are 1.6 rad of pitch and 1.4 rad of roll to each side. Motor pairs of the whole
circle are held to the real roots of the polynomial of degree eight (test/truth/rods.py). Exits
with 1 if a window has a second pose, or if a pose is another one, is missing or is invented. With
--document the table goes into docs/design/rods.md.
"""

import sys
from time import process_time

from linkage_ros import mechanisms
from linkage_ros.linkage import WindowError
import numpy as np
from truth import rods

from . import document

# Motor pairs that are judged at a time.
CHUNK = 5000
# A root this near to the edge of the limits [rad] is in them or not, but for rounding.
EDGE = 1e-6
# Limits of pitch and roll that are refused [rad].
WIDE = [-1.6, -1.4], [1.6, 1.4]


def created(lines):
    """Return a linkage or its error, and the CPU time that this took [ms]."""
    start = process_time()
    try:
        made = mechanisms.create('rods', joints=lines)
    except WindowError as error:
        made = error
    return made, 1e3 * (process_time() - start)


def ankles(count):
    """Yield public and random ankles, with a name, a window and the time of a refusal."""
    for name, (parts, window) in rods.REAL.items():
        ankle = rods.drawn(*parts)
        error, refusal = created(ankle.within(*WIDE))
        yield name, ankle, window, refusal if isinstance(error, WindowError) else None
    rng = np.random.default_rng(0)
    while count:
        ankle = rods.random_ankle(rng)
        error, refusal = created(ankle.within(*WIDE))
        if ankle.motor_axes[0] is not None and getattr(error, 'limits', None):
            yield f'random {count}', ankle, np.transpose([*error.limits.values()]), refusal
            count -= 1


def wrong(ankle, window, linkage, inputs):
    """Return how many windows have a second pose, and how many poses are wrong or wrongly NaN."""
    found = np.stack([*linkage.joint_angles(inputs, ['pitch', 'roll']).values()], axis=-1)
    roots = np.stack(rods.assemblies(ankle, inputs), axis=-1)
    inside = ((roots > window[0]) & (roots < window[1])).all(axis=-1)
    inside &= rods.are_drawn(ankle, inputs[..., None], roots[..., 0], roots[..., 1])
    edge = np.abs(np.minimum(roots - window[0], window[1] - roots)).min(axis=-1) < EDGE
    clear, there = ~edge.any(axis=1), inside.any(axis=1)
    away = np.where(inside, np.abs(roots - found[:, None]).max(axis=-1), np.inf).min(axis=1)
    return np.array([np.sum(inside.sum(axis=1) > 1),
                     np.sum(clear & there & ~(away < 1e-5)),
                     np.sum(clear & ~there & np.isfinite(found[:, 0]))])


def main():
    """Print, or write, a table with a row for each ankle."""
    parser = document.parser(__doc__)
    parser.add_argument('--ankles', type=int, default=5)
    parser.add_argument('--pairs', type=int, default=100_000, help='motor pairs for each ankle')
    options, rows, bad = parser.parse_args(), [], 0
    for i, (name, ankle, window, refusal) in enumerate(ankles(options.ankles)):
        linkage, setup = created(ankle.within(*window))
        rng, counts = np.random.default_rng(i), np.zeros(3, int)
        for _ in range(-(-options.pairs // CHUNK)):
            counts += wrong(ankle, window, linkage, rng.uniform(-np.pi, np.pi, (2, CHUNK)))
        bad += counts.sum()
        rows.append([name, f'{setup:.0f}', f'{refusal:.0f}' if refusal else 'proved',
                     options.pairs, *counts])
    text = document.table(
        ['ankle', 'set-up [ms]', 'refusal [ms]', 'motor pairs', 'second poses', 'other or missing',
         'invented'], rows) + '\n\n' + document.machine()
    document.show(options, 'design/rods.md', text, 'measured: windows')
    return int(bad > 0)


if __name__ == '__main__':
    sys.exit(main())
