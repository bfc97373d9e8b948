# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
How many solutions inverses lose and invent, judged by sampled and bisected poses.

    python -m benchmark.inverse_rule [--linkages 2000] [--minutes 60] [--document]

The judge is `test/truth/inverse_judge.py`. All of the catalogue are asked, and random linkages:
three outputs of each at ordinary poses, next to and at ends of the reach, at extremes and at dead
points. Beside it is the CPU time of the first question of an inverse. With --document both go
into docs/design/accuracy.md.
"""

from collections import Counter
from itertools import chain
import time

from linkage_ros import mechanisms
from linkage_ros.linkage import theta_of
import numpy as np
from truth import inverse_judge, linkage_checks

from . import document

# Choices of several outputs, of which most do not determine the inputs.
TRIES = 20
COLUMNS = 'questions', 'lost', 'invented', 'duplicates'


def linkages(count):
    """Yield linkages of the catalogue, then random ones, each with its own generator."""
    for kind in mechanisms.TYPES:
        yield mechanisms.create(kind), np.random.default_rng(0)
    for _, linkage, rng in linkage_checks.assembled(range(count)):
        yield linkage, rng


def judged(linkage, rng):
    """Yield what is asked, its counts and the worst error, for some outputs of a linkage."""
    names = [name for name in (*linkage.joints, *(
        f'{point}.{axis}' for point in linkage.points for axis in 'xy')) if linkage.moves(name)]
    others = [float(rng.uniform(each.low, each.high)) for each in linkage.inputs[1:]]
    kind = 'held' if others else 'geared' if linkage.geared else 'one output'
    for name in map(str, rng.choice(names, min(3, len(names)), replace=False) if names else ()):
        if name != linkage.inputs[0].name:
            yield kind, inverse_judge.judge(linkage, name, rng, 4, tuple(others))
    if others and len(names) > len(others):
        yield 'several', several(linkage, names, rng)


def several(linkage, names, rng):
    """Return what is judged of outputs, as many as inputs, that determine them."""
    for _ in range(TRIES):
        chosen = tuple(map(str, rng.choice(names, len(linkage.inputs), replace=False)))
        try:
            return inverse_judge.judge_several(linkage, chosen, rng, 3)
        except ValueError as refused:
            assert 'do not determine' in str(refused)
    return Counter(), 0.0


def first_question(linkage):
    """Return the CPU time [ms] from making an inverse of a joint angle to its solutions."""
    name = [name for name in linkage.joints if linkage.moves(name)][-1]
    inputs = [0.7 * each.low + 0.3 * each.high for each in linkage.inputs]
    value = linkage.joint_angles(theta_of(inputs), [name])[name]
    start = time.process_time()
    linkage.inverse((name, *(each.name for each in linkage.inputs[1:]))).all(
        [value if value == value else 0.0, *inputs[1:]])
    return 1e3 * (time.process_time() - start)


def measure(count, minutes):
    """Return counts by what is asked and where, the worst error, and first questions' times."""
    total, worst, times, start = Counter(), 0.0, [], time.monotonic()
    for linkage, rng in linkages(count):
        if time.monotonic() - start > 60.0 * minutes:
            break
        try:
            times.append(first_question(linkage))
            for kind, (found, error) in judged(linkage, rng):
                worst = max(worst, error)
                total.update({(kind, *key): number for key, number in found.items()
                              if len(key) == 2})
        except ValueError as refused:
            assert 'do not determine' in str(refused) or 'does not move' in str(refused)
    return total, worst, times


def main():
    """Print the table."""
    parser = document.parser(__doc__)
    parser.add_argument('--linkages', type=int, default=2000, help='random linkages')
    parser.add_argument('--minutes', type=float, default=60.0, help='stop after these')
    options = parser.parse_args()
    total, worst, times = measure(options.linkages, options.minutes)
    places = dict.fromkeys(chain.from_iterable([key[:2]] for key in sorted(total)))
    text = document.table(('asked', *COLUMNS), [
        (f'{kind}, {where}', *(total[kind, where, what] for what in COLUMNS))
        for kind, where in places])
    median, most, slowest = np.percentile(times, [50.0, 99.0, 100.0])
    text += (f'\n\n{len(times)} linkages. Their first questions take {median:.0f} ms in the '
             f'median, {most:.0f} ms at the 99th percentile, {slowest:.0f} ms at most. The '
             f'largest error of a solution at an ordinary value is {worst:.2g} in units of the '
             "rule: half an ulp of the output's size and half an ulp of the input times the rate.")
    text += '\n\n' + document.machine()
    document.show(options, 'design/accuracy.md', text, 'measured: inverse')


if __name__ == '__main__':
    main()
