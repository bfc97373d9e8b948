# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The truth of the wider catalogue, placed in 80-digit arithmetic as with ruler and compasses.

Importing this module teaches `reference` its linkages, so that `accuracy` can measure them. The
kinds whose names end in a construction's are for that construction where it moves.
"""

import reference
from reference import circles, cross, LEFT, mp, Pose, RIGHT

# The second crank of the five-bar stands at this angle.
HELD = 1.25


def on_line(pin, rod, origin, along, side):
    """Return where a rod from a pin meets a line, ahead of the pin for side +1, and the gap."""
    height, foot = cross(along, pin - origin), ((pin - origin) * mp.conj(along)).real
    gap = rod * rod - height * height
    reach = mp.sqrt(gap) if gap > 0 else mp.zero
    return origin + along * (foot + side * reach), gap / (rod * rod)


def _towards(p, q, distance):
    return p + (q - p) / abs(q - p) * distance


def _mirror(point, p, q):
    """Return the other meeting point of the circles about p and q through a point."""
    side = RIGHT if cross(q - p, point - p) > 0 else LEFT
    return circles(p, abs(point - p), q, abs(point - q), side)[0]


def _four_bar(theta, sides, a, b, c, d, p):
    A, Q = a * mp.expj(theta), mp.mpc(d)
    B, gap = circles(A, b, Q, c, sides['B'])
    return Pose({'O': mp.mpc(0), 'Q': Q, 'A': A, 'B': B, 'P': _towards(A, B, p)}, {'B': gap})


def _slider_crank(theta, sides, a, b, c):
    A, G = a * mp.expj(theta), mp.mpc(0, c)
    B, gap = on_line(A, b, G, mp.mpc(1), sides['B'])
    return Pose({'O': mp.mpc(0), 'G': G, 'A': A, 'B': B}, {'B': gap})


def _hoeken(theta, sides, a, b, d):
    return _four_bar(theta, sides, a, b, b, d, 2 * b)


def _chebyshev_lambda(theta, sides, a):
    b = mp.mpf(2.8228756555322954) * a
    return _four_bar(theta, sides, a, b, b, mp.mpf(2.2152504370215302) * a, 2 * b)


def _watt(theta, sides, a, c):
    A, Q = a * mp.expj(theta), mp.mpc(2 * a, -c)
    B, gap = circles(A, c, Q, a, sides['B'])
    return Pose({'O': mp.mpc(0), 'Q': Q, 'A': A, 'B': B, 'P': (A + B) / 2}, {'B': gap})


def _klann(theta, sides, a, b, c, d, e, f, g, h, i, j, k, l, m):  # noqa: E741
    A, B, C = m * mp.expj(theta), mp.mpc(-i, -j), mp.mpc(-k, l)
    D, gap_d = circles(A, a, B, b, sides['D'])
    E, gap_e = circles(A, d, D, c, RIGHT)
    F, gap_f = circles(E, f, C, e, sides['F'])
    G, gap_g = circles(E, g, F, h, RIGHT)
    return Pose({'O': mp.mpc(0), 'B': B, 'C': C, 'A': A, 'D': D, 'E': E, 'F': F, 'G': G},
                {'D': gap_d, 'E': gap_e, 'F': gap_f, 'G': gap_g})


def _whitworth(theta, sides, a, b, c, d):
    A, Q = mp.mpc(0, a) * mp.expj(theta), mp.mpc(0, -b)
    slide = abs(A - Q)
    L = Q + (A - Q) / slide * sides['L'] * c
    R, gap = on_line(L, d, Q, mp.mpc(1), sides['R'])
    return Pose({'O': mp.mpc(0), 'Q': Q, 'A': A, 'L': L, 'R': R}, {'R': gap},
                sides['L'] * slide)


def _pantograph(theta, sides, a, b, c, d, g):
    A, F = a * mp.expj(theta), mp.mpc(-g)
    B, gap = circles(F, b, A, c, sides['B'])
    D = _towards(F, B, d)
    return Pose({'O': mp.mpc(0), 'F': F, 'A': A, 'B': B, 'D': D, 'C': A + D - B,
                 'T': F + (A - F) * d / b}, {'B': gap})


def _five_bar(theta, sides, a, b, c, d, f):
    A, Q = a * mp.expj(theta), mp.mpc(f)
    C = Q + d * mp.expj(mp.mpf(HELD))
    P, gap = circles(A, b, C, c, sides['P'])
    return Pose({'O': mp.mpc(0), 'Q': Q, 'A': A, 'C': C, 'P': P}, {'P': gap})


def _moving(theta, sides, a, b, c, d, e, f, g, h):
    """Place a four-bar whose coupler carries a kite, a slot's pin and a slider's rod."""
    A, Q = a * mp.expj(theta), mp.mpc(d)
    B, gap_b = circles(A, b, Q, c, sides['B'])
    P, gap_p = circles(A, e, B, f, LEFT)
    M = _mirror(A, B, P)
    S, gap_s = on_line(P, g, Q, mp.expj(mp.mpf(0.3)), sides['S'])
    pivot = mp.mpc(d, -h)
    slide = sides['L'] * abs(P - pivot)
    return Pose({'O': mp.mpc(0), 'Q': Q, 'N': pivot, 'A': A, 'B': B, 'P': P, 'M': M, 'S': S,
                 'L': pivot + (P - pivot) / slide * h},
                {'B': gap_b, 'P': gap_p, 'S': gap_s}, slide)


MOVING = (
    'O ground 0 0', 'Q ground d 0', 'N ground d -h', 'A crank O a', 'B dyad A Q b c left',
    'P rigid A B e f left', 'M mirror A B P', 'S slider P g Q 0.3 out', 'L slot N P 0 out h')

PLACE = {
    'four_bar': (_four_bar, {'B': LEFT}, {'B': 'B', 'P': 'B'}),
    'slider_crank': (_slider_crank, {'B': 1}, {'B': 'B'}),
    'hoeken': (_hoeken, {'B': LEFT}, {'B': 'B', 'P': 'B'}),
    'chebyshev_lambda': (_chebyshev_lambda, {'B': LEFT}, {'B': 'B', 'P': 'B'}),
    'watt': (_watt, {'B': RIGHT}, {'B': 'B', 'P': 'B'}),
    'klann': (_klann, {'D': RIGHT, 'F': LEFT},
              {'D': 'D', 'E': 'DE', 'F': 'DEF', 'G': 'DEFG'}),
    'whitworth': (_whitworth, {'L': 1, 'R': 1}, {'L': '', 'R': 'R'}),
    'pantograph': (_pantograph, {'B': LEFT},
                   {'B': 'B', 'D': 'B', 'C': 'B', 'T': 'B'}),
    'five_bar': (_five_bar, {'P': LEFT}, {'P': 'P'}),
    'custom': (_moving, {'B': LEFT, 'S': 1, 'L': 1},
               {'B': 'B', 'P': 'BP', 'M': 'BP', 'S': 'BPS', 'L': 'BP'}),
}

for _kind, (_place, _branches, _needs) in PLACE.items():
    reference.teach(_kind, _place, _branches, _needs)
