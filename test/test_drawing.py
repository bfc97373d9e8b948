# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The truth is true: it keeps every length and agrees with numbers that others published."""

from collections import Counter

import gmpy2
from gmpy2 import mpfr
from linkage_ros import mechanisms
import pytest
from truth import hard_cases, linkage_checks
from truth.drawing import DIGITS, draw, Linkage, precisely

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


def bars(line, row, at):
    """Yield pairs of joints with their distance, as the line of one of them says."""
    name, stands, word = line.names[0], line.joints, line.word
    if word in ('crank', 'slider', 'dyad', 'rigid'):
        yield from zip(stands, (name, name), row[:2 if word in ('dyad', 'rigid') else 1])
    elif word == 'cylinder':
        yield stands[1], name, row[0]
    elif word in ('mirror', 'parallelogram', 'antiparallelogram'):
        corner, *ends = stands
        for end, like in zip(ends, ends if word == 'mirror' else ends[::-1]):
            yield end, name, abs(at[corner] - at[like])
    elif word == 'inversor':
        right, tip, left = line.names
        for side in (right, left):
            yield from ((stands[0], side, row[0]), (stands[1], side, row[1]), (side, tip, row[1]))


@precisely
def test_every_bar_keeps_its_length_to_1e_45_and_a_pin_is_in_its_slot():
    words = Counter()
    for _, mechanism, rng in linkage_checks.assembled(range(120)):
        linkage = Linkage(mechanism.design.joints, mechanism.dimensions, mechanism.branches)
        way = linkage.passings()[0]
        values = [mpfr(float(rng.uniform(x.low, x.high))) for x in mechanism.inputs]
        pose = draw(DIGITS, linkage, linkage.prepared(linkage.numbers), values, way,
                    linkage.turns(linkage.numbers, way))
        if min([1, *pose.gaps.values(), *pose.arms.values()]) <= 0:
            continue
        for line, row in zip(linkage.lines, linkage.numbers):
            for p, q, bar in bars(line, row, pose.points):
                assert abs(abs(pose.points[p] - pose.points[q]) - bar) < 1e-45 * linkage.longest
            if line.word == 'slot':
                # Seen along the lever, the pin is where it slides, at the slot's offset.
                lever, pivot = line.names[0], pose.points[line.joints[0]]
                along = (pose.points[lever] - pivot) / row[1]
                pin = (pose.points[line.joints[1]] - pivot) / along
                assert abs(pin - gmpy2.mpc(pose.slides[lever], row[0])) < 1e-45 * linkage.longest
            words[line.word] += 1
    assert len(words) == 16 and min(words.values()) > 5, words


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
