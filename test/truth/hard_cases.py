# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Dimensions that are hard on the catalogue, drawn from a seeded generator.

Three tenths of the random ones are nearly or exactly degenerate: a kite almost folded, a dyad that
only just reaches, equal arms.
"""

import math

from linkage_ros import mechanisms
import numpy as np

# The documents' own parameter sets, the other ones people know, and every change point.
CATALOGUE = {
    'water_drop': [{'a': 1.0}, {'a': 0.1}, {'a': 0.7}],
    'jansen': [mechanisms.defaults('jansen')],
    'peaucellier': [
        {'r': r, 'a': a, 'b': b} for r, a, b in (
            (3.0, 9.0, 4.0), (4.0, 9.0, 2.0), (2.0, 5.0, 3.0), (3.0, 6.0, 3.0), (3.0, 4.0, 2.0),
            (3.0, 4.0, 4.0), (2.0, 4.0, 4.0), (3.0, 2.0 + 1e-8, 2.0))],
    'slotted_lever': [
        {'a': a, 'b': b, 'e': e} for a, b, e in (
            (80.0, 150.0, 0.0), (150.0, 80.0, 0.0), (80.0, 150.0, 25.0), (80.0, 150.0, -70.0),
            (80.0, 150.0, 100.0), (150.0, 80.0, 30.0), (1.0, 1.0, 0.0), (1.0, 1.0 + 1e-9, 0.0),
            (1.0, 1.0, 0.5))]}


def log_uniform(rng, low, high):
    """Return a number whose logarithm is uniform."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def tiny(rng, least=1e-15, exact=0.1):
    """Return a signed distance of 1e-1 at most, or zero with the probability `exact`."""
    if rng.random() < exact:
        return 0.0
    return float(rng.choice((-1.0, 1.0)) * log_uniform(rng, least, 1e-1))


# Degenerate lengths, from the others. A leg never has a change point: its ground line is oblique,
# and rounding would decide. Its crank takes C's and E's dyads this far and near.
_FAR, _NEAR = 'hypot(a,l)+m', 'abs(hypot(a,l)-m)'
DEGENERATE = {
    'water_drop': [], 'peaucellier': ['a=b', 'r=(a+b)/2', 'r=abs(a-b)/2'],
    'slotted_lever': ['a=b', 'e=abs(b-a)', 'e=a+b', 'e=-a-b'],
    'jansen': [f'j={_FAR}-b', f'k={_FAR}-c', f'j=b+{_NEAR}', f'k=c+{_NEAR}', 'e=b+d', 'h=g+i']}


def dimensions(kind, rng):
    """
    Return random dimensions of a linkage, three tenths of them nearly degenerate.

    A leg is within 35 % of the holy numbers: few others can walk at all. An inversor's crank is
    rarely too short to reach, 2 r being at least about |a - b|.
    """
    size = log_uniform(rng, 0.01, 1.0)
    lengths = {name: size * length * float(rng.uniform(0.65, 1.35)) if kind == 'jansen'
               else log_uniform(rng, 0.1, 10.0) for name, length in CATALOGUE[kind][0].items()}
    if kind == 'peaucellier':
        least = abs(lengths['a'] - lengths['b']) * log_uniform(rng, 0.45, 2.0)
        lengths['r'] = max(lengths['r'], least)
    if kind == 'slotted_lever':
        lengths['e'] *= float(rng.choice((-1.0, 0.0, 1.0)))
    if DEGENERATE[kind] and rng.random() < 0.3:
        name, _, length = str(rng.choice(DEGENERATE[kind])).partition('=')
        value = eval(length, {**lengths, 'hypot': math.hypot})
        near = tiny(rng, 1e-13, 0.0) if kind == 'jansen' else tiny(rng)
        if value > 0.0 or name == 'e':
            lengths[name] = value * (1.0 + near)
    return lengths


def linkages(kind, seed, count):
    """Yield random mechanisms of a kind, on random branches, with a generator for their angles."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        branches = {name: int(rng.choice((-1, 1))) for name in mechanisms.design(kind).branches}
        yield mechanisms.create(kind, branches=branches, **dimensions(kind, rng)), rng


def lever_gap(lengths, lever, half):
    """Return the smallest gap at lever angles [rad]: the slot cuts the circle on its own half."""
    a, b, e = (lengths[name] for name in 'abe')
    offset = e + b * np.sin(lever)
    height = np.sqrt(np.maximum(a * a - offset * offset, 0.0))
    ahead = half * b * np.cos(lever) + height
    return np.minimum(a - np.abs(offset), ahead) / (a + b + abs(e))
