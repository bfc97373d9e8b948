# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The truth is true: it keeps every length and agrees with numbers that others published."""

import numpy as np
import pytest
from truth import exact_poses, hard_cases
from truth.exact_poses import LEFT, mp, RIGHT

KINDS = list(hard_cases.CATALOGUE)
FLIPPED = {
    'water_drop': [{}],
    'jansen': [{}, {'C': RIGHT}, {'E': LEFT}, {'F': RIGHT}, {'C': RIGHT, 'E': LEFT, 'F': RIGHT}],
    'peaucellier': [{}],
    'slotted_lever': [{}, {'L': -1}],
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


def drawn(kind, seed, count=100):
    """Yield random lengths and angles of a linkage, as (lengths, theta, branches)."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        dimensions = hard_cases.dimensions(kind, rng)
        branches = FLIPPED[kind][rng.integers(len(FLIPPED[kind]))]
        yield exact_poses.exact(dimensions), mp.mpf(hard_cases.angles(rng, 1)[0]), branches


@pytest.mark.parametrize('kind', KINDS)
def test_every_bar_keeps_its_length_to_1e_45(kind):
    assembled = 0
    for length, theta, branches in drawn(kind, seed=1):
        pose = exact_poses.place(kind, length, theta, branches)
        if pose.assembled:
            assembled += 1
            for (p, q), bar in exact_poses.bars(kind, length).items():
                distance = abs(pose.points[p] - pose.points[q])
                assert abs(distance - bar) < 1e-45 * bar, (p, q)
    assert assembled >= 15


def test_the_jansen_leg_agrees_with_the_table_of_the_original_program():
    for line in JANSEN_TABLE.split('\n')[1:-1]:
        degrees, *published = map(mp.mpf, line.split())
        pose = exact_poses.place('jansen', exact_poses.exact(hard_cases.HOLY), mp.radians(degrees))
        check_rounded(pose, 'ACDEFG', published)


def test_the_water_drop_agrees_with_the_table_of_the_original_program():
    for line in WATER_DROP_TABLE.split('\n')[1:-1]:
        degrees, *published = map(mp.mpf, line.split())
        pose = exact_poses.place('water_drop', {'a': mp.one}, mp.radians(degrees))
        check_rounded(pose, 'ABP', published)


def check_rounded(pose, joints, published):
    """Compare joints with published x y x y ..., which have three decimals."""
    ours = [number for name in joints
            for number in (pose.points[name].real, pose.points[name].imag)]
    assert len(ours) == len(published)
    assert max(abs(x - y) for x, y in zip(ours, published)) <= 0.0005


def test_the_inversor_ends_where_the_original_document_says():
    r, a, b = mp.mpf(3), mp.mpf(9), mp.mpf(4)
    half = mp.acos((a - b) / (2 * r))
    inside, outside = (
        exact_poses.place('peaucellier', {'r': r, 'a': a, 'b': b}, 2 * half + step)
        for step in (mp.mpf('-1e-40'), mp.mpf('1e-40')))
    assert inside.assembled and not outside.assembled
    assert abs(inside.points['C'].imag - (a + b) * mp.sin(half)) < 1e-38


def test_the_pin_lies_in_the_slot():
    """Check a e^(i theta) + b = e^(i phi) (t + i e), the loop equation."""
    for length, theta, branches in drawn('slotted_lever', seed=3):
        pose = exact_poses.place('slotted_lever', length, theta, branches)
        if pose.assembled:
            a, b, e = (length[name] for name in 'abe')
            lever = pose.points['L'] - pose.points['Q']
            turn = lever / abs(lever) / exact_poses.I
            loop = a * mp.expj(theta) + b - turn * mp.mpc(pose.slide, e)
            assert abs(loop) < 1e-45 * (a + b)


def test_the_inverse_of_the_lever_leads_back():
    for length, theta, branches in drawn('slotted_lever', seed=4):
        pose = exact_poses.place('slotted_lever', length, theta, branches)
        if pose.assembled:
            lever = mp.arg((pose.points['L'] - pose.points['Q']) / exact_poses.I)
            found = [exact_poses.servo(length, lever, cut) for cut in (1, -1)]
            misses = [abs(mp.expj(theta) - mp.expj(answer.angle)) for answer in found]
            slides = [abs(pose.slide - answer.slide) for answer in found]
            assert min(misses) < 1e-30
            assert min(slides) < 1e-30 * (length['a'] + length['b'])


@pytest.mark.parametrize('kind, dimensions, theta', [
    ('peaucellier', {'r': 3.0, 'a': 9.0, 'b': 4.0}, 3.0),
    ('peaucellier', {'r': 9.0, 'a': 4.0, 'b': 3.0}, 0.0),
    ('slotted_lever', {'a': 80.0, 'b': 150.0, 'e': 100.0}, 3.0),
    ('jansen', {**hard_cases.HOLY, 'j': 90.0}, 3.0),
    ('jansen', {**hard_cases.HOLY, 'e': 82.0}, 0.0),
])
def test_what_cannot_be_assembled_has_no_pose(kind, dimensions, theta):
    assert exact_poses.pose(kind, dimensions, theta) is None
