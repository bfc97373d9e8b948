# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Textbook examples come out to the digits that are printed.

Norton: R. L. Norton, "Design of Machinery" (examples of ch. 4, answers to the tables of problems
P4-1 to P4-3, table 3-1). Mabie and Reinholtz: "Mechanisms and Dynamics of Machinery", the table of
Geneva wheels. H. Shigeyoshi: jansen-linkage and water-drop-linkage (MIT licence), the tables that
come with the programs.
"""

import math

from linkage_ros import mechanisms
import numpy as np
import pytest

TURN = 2 * math.pi


def degrees(vector):
    """Return the direction of a vector [deg]."""
    return math.degrees(math.atan2(vector[1], vector[0]))


def printed(value, text):
    """Tell whether a number is what is printed; books round on the way: to one last digit."""
    return abs(value - float(text)) <= 10.0 ** -len(text.partition('.')[2])


@pytest.mark.parametrize('lengths, theta, side, coupler, rocker', [
    # Example 4-1, open and crossed, and problem 4-6, row a.
    ({'a': 40.0, 'b': 120.0, 'c': 80.0, 'd': 100.0}, 40.0, 1, '20.298', '57.325'),
    ({'a': 40.0, 'b': 120.0, 'c': 80.0, 'd': 100.0}, 40.0, -1, '-60.98', '-98.01'),
    ({'a': 2.0, 'b': 7.0, 'c': 9.0, 'd': 6.0, 'p': 1.0}, 30.0, 1, '88.8', '117.3'),
    ({'a': 2.0, 'b': 7.0, 'c': 9.0, 'd': 6.0, 'p': 1.0}, 30.0, -1, '-115.2', '-143.6')])
def test_norton_s_four_bars(lengths, theta, side, coupler, rocker):
    linkage = mechanisms.create('four_bar', branches={'B': side}, **lengths)
    place = linkage.solve(math.radians(theta))
    assert printed(degrees(place['B'] - place['A']), coupler)
    assert printed(degrees(place['B'] - place['Q']), rocker)


@pytest.mark.parametrize('turn, d, b, length, bend, speed', [
    (40, '2.950', '3.925', '1.193', '0.00004', '1.717'),
    (140, '2.500', '3.250', '3.623', '0.023', '1.565'),
    (180, '2.200', '2.800', '4.181', '0.096', '1.436')])
def test_hoeken_s_straight_lines_are_norton_s_table(turn, d, b, length, bend, speed):
    linkage = mechanisms.create('hoeken', a=1.0, b=float(b), d=float(d))
    theta = math.pi + np.radians(np.linspace(-0.5, 0.5, 4001) * turn)
    place = linkage.solve(theta, ('P',))['P']
    assert printed(np.ptp(place[:, 0]), length)
    assert printed(100.0 * np.ptp(place[:, 1]) / np.ptp(place[:, 0]), bend)
    assert printed(abs(linkage.velocity(math.pi, ('P',))['P'][0]), speed)


# deg, A, C, D, E, F, G
JANSEN = """
90.0 0.0 15.0 -46.736 32.77 -77.668 -13.672 -20.995 -43.231 -57.448 -47.487 -7.689 -90.389
225.0 -10.607 -10.607 -34.122 33.518 -77.596 -1.462 -68.451 -32.644 -105.035 -29.737 -64.562 -81.49
315.0 10.607 -10.607 -19.472 29.334 -72.64 12.4 -39.41 -47.075 -70.078 -26.916 -59.513 -91.761
"""
# deg, A, B, P
WATER_DROP = """
60.0 -0.866 0.5 -1.237 -0.429 0.247 3.286
120.0 -0.866 -0.5 -1.732 -1.0 1.732 1.0
185.0 0.087 -0.996 0.345 -0.03 -0.685 -3.895
"""


@pytest.mark.parametrize('kind, lengths, joints, table', [
    ('jansen', {}, 'ACDEFG', JANSEN), ('water_drop', {'a': 1.0}, 'ABP', WATER_DROP)])
def test_places_are_those_of_the_table_of_the_original_program(kind, lengths, joints, table):
    linkage = mechanisms.create(kind, **lengths)
    for theta, *places in (map(float, line.split()) for line in table.strip().splitlines()):
        solved = linkage.solve(math.radians(theta), [*joints])
        np.testing.assert_allclose(np.ravel([*solved.values()]), places, rtol=0.0, atol=5e-4)
