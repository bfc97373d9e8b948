# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The truth is true: it keeps every length and agrees with numbers that others published."""

import gmpy2
from gmpy2 import mpfr
from linkage_ros import mechanisms
import numpy as np
import pytest
from truth import hard_cases
from truth.drawing import DIGITS, draw, Linkage, precisely

FLIPPED = {
    'water_drop': [{}],
    'jansen': [{}, {'C': -1}, {'E': 1}, {'F': -1}, {'C': -1, 'E': 1, 'F': -1}],
    'peaucellier': [{}],
    'slotted_lever': [{}, {'L': -1}],
}
BARS = {
    'water_drop': lambda a: {
        'OA': a, 'AB': a, 'CB': 2 * a, 'AP': 3 * a, 'BP': 4 * a, 'OC': 2 * a},
    'jansen': lambda a, b, c, d, e, f, g, h, i, j, k, l, m: {  # noqa: E741
        'OA': m, 'BC': b, 'AC': j, 'BD': d, 'CD': e, 'BE': c, 'AE': k, 'EF': g, 'DF': f,
        'EG': i, 'FG': h, 'OB': gmpy2.hypot(a, l)},
    'peaucellier': lambda r, a, b: {
        'OA': r, 'OP': r, 'PB': a, 'PD': a, 'AB': b, 'BC': b, 'CD': b, 'AD': b},
    'slotted_lever': lambda a, b, e: {'OA': a, 'OQ': b},
}

# deg, A, C, D, E, F, G: rows of the table that comes with the original Jansen program
# (H. Shigeyoshi, jansen-linkage, MIT licence), rounded to three decimals there.
JANSEN_TABLE = """
45.0 10.607 10.607 -33.849 33.492 -77.553 -1.2 -20.427 -42.952 -56.076 -34.232 -24.399 -91.791
90.0 0.0 15.0 -46.736 32.77 -77.668 -13.672 -20.995 -43.231 -57.448 -47.487 -7.689 -90.389
180.0 -15.0 0.0 -54.934 30.088 -75.597 -21.745 -65.315 -36.056 -96.76 -54.979 -33.73 -73.517
225.0 -10.607 -10.607 -34.122 33.518 -77.596 -1.462 -68.451 -32.644 -105.035 -29.737 -64.562 -81.49
315.0 10.607 -10.607 -19.472 29.334 -72.64 12.4 -39.41 -47.075 -70.078 -26.916 -59.513 -91.761
"""

# deg, A, B, P: likewise from water-drop-linkage by the same author, a = 1.
WATER_DROP_TABLE = """
1.0 -0.017 1.0 -0.023 0.0 0.0 4.0
60.0 -0.866 0.5 -1.237 -0.429 0.247 3.286
120.0 -0.866 -0.5 -1.732 -1.0 1.732 1.0
170.0 -0.174 -0.985 -0.665 -0.114 1.3 -3.598
185.0 0.087 -0.996 0.345 -0.03 -0.685 -3.895
"""


def drawn(kind, theta, lengths=None, branches=None):
    """Return the drawing of a linkage of the catalogue at a crank angle, and whether it fits."""
    linkage = Linkage(mechanisms.design(kind).joints, lengths or mechanisms.defaults(kind),
                      branches)
    found = draw(DIGITS, linkage, linkage.prepared(linkage.numbers), [mpfr(theta)])
    return found, all(gap >= 0 for gap in found.gaps.values())


@pytest.mark.parametrize('kind', BARS)
@precisely
def test_every_bar_keeps_its_length_to_1e_45_and_the_pin_lies_in_the_slot(kind):
    rng, assembled = np.random.default_rng(1), 0
    for _ in range(100):
        lengths, theta = hard_cases.dimensions(kind, rng), hard_cases.angles(rng, 1)[0]
        pose, fits = drawn(kind, theta, lengths, FLIPPED[kind][rng.integers(len(FLIPPED[kind]))])
        exact = {name: mpfr(length) for name, length in lengths.items()}
        triangles = [('b', 'd', 'e'), ('g', 'i', 'h')] if kind == 'jansen' else []
        if not fits or any(2 * max(exact[x] for x in sides) > sum(exact[x] for x in sides)
                           for sides in triangles):
            continue
        assembled += 1
        for (p, q), bar in BARS[kind](**exact).items():
            assert abs(abs(pose.points[p] - pose.points[q]) - bar) < 1e-45 * bar, (p, q)
        if kind == 'slotted_lever':
            # a e^(i theta) + b = e^(i phi) (t + i e), the loop equation, both angles from +y.
            lever = pose.points['L'] - pose.points['Q']
            loop = pose.points['A'] - pose.points['Q'] - lever / abs(lever) * gmpy2.mpc(
                pose.slides['L'], exact['e'])
            assert abs(loop) < 1e-45 * (exact['a'] + exact['b'])
    assert assembled >= 15


@pytest.mark.parametrize('kind, lengths, joints, table', [
    ('jansen', hard_cases.HOLY, 'ACDEFG', JANSEN_TABLE),
    ('water_drop', {'a': 1.0}, 'ABP', WATER_DROP_TABLE)])
@precisely
def test_places_are_those_of_the_table_of_the_original_program(kind, lengths, joints, table):
    for line in table.split('\n')[1:-1]:
        degrees, *published = map(mpfr, line.split())
        pose, _ = drawn(kind, degrees * gmpy2.const_pi() / 180, lengths)
        ours = [number for name in joints
                for number in (pose.points[name].real, pose.points[name].imag)]
        assert len(ours) == len(published)
        assert max(abs(x - y) for x, y in zip(ours, published)) <= 0.0005


@precisely
def test_the_inversor_ends_where_the_original_document_says():
    r, a, b = mpfr(3), mpfr(9), mpfr(4)
    half = gmpy2.acos((a - b) / (2 * r))
    (inside, fits), (_, beyond) = (
        drawn('peaucellier', 2 * half + step, {'r': 3.0, 'a': 9.0, 'b': 4.0})
        for step in (mpfr('-1e-40'), mpfr('1e-40')))
    assert fits and not beyond
    assert abs(inside.points['C'].imag - (a + b) * gmpy2.sin(half)) < 1e-38


@pytest.mark.parametrize('kind, lengths, theta', [
    ('peaucellier', {'r': 3.0, 'a': 9.0, 'b': 4.0}, 3.0),
    ('peaucellier', {'r': 9.0, 'a': 4.0, 'b': 3.0}, 0.0),
    ('slotted_lever', {'a': 80.0, 'b': 150.0, 'e': 100.0}, 3.0),
    ('jansen', {**hard_cases.HOLY, 'j': 90.0}, 3.0)])
@precisely
def test_what_cannot_be_assembled_does_not_fit(kind, lengths, theta):
    assert not drawn(kind, theta, lengths)[1]
