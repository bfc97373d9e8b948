# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The catalogue in 80-digit arithmetic, placed as with ruler and compasses.

Nothing here comes from the library and no formula is shared with it. Joints are intersections of
circles and lines, taken on a stated side; the water drop is the law of cosines with a signed
angle. Such formulas cancel badly, and 80 digits do not mind. Lengths and angles are exactly the
float64 values given: metres, radians, counterclockwise, x right, y up.

A mechanism is one function and one entry of `KINDS`. The kind `custom` is `MOVING`, joint lines
that use every construction where it moves.
"""

from typing import Callable, Dict, NamedTuple, Optional

import mpmath

mp = mpmath.MPContext()
mp.dps = 80

I = mp.mpc(0, 1)  # noqa: E741
LEFT, RIGHT = 1, -1
# The second crank of the five-bar stands at this angle.
HELD = 1.25


class Pose(NamedTuple):
    """
    Where the joints are, as complex numbers, and how far each closure is from impossible.

    A closure is named after the joint that it places. Where its gap is negative the linkage cannot
    be assembled, and the joint is put where the parts come nearest to each other.
    """

    points: Dict[str, mpmath.mpc]
    gaps: Dict[str, mpmath.mpf]
    slide: Optional[mpmath.mpf] = None

    @property
    def assembled(self):
        """Tell whether every closure can be met."""
        return all(gap >= 0 for gap in self.gaps.values())


class Kind(NamedTuple):
    """
    A mechanism: how it is placed, its usual branches, and what its joints stand on.

    `needs` are the closures that decide whether a joint has a place.
    """

    place: Callable
    branches: Dict[str, int]
    needs: Dict[str, str]


class Servo(NamedTuple):
    """The crank angle at which the lever has a given angle, and the pin's place in the slot."""

    angle: mpmath.mpf
    slide: mpmath.mpf
    gap: mpmath.mpf


def exact(numbers):
    """Return a mapping of float64 numbers as the same numbers in this precision."""
    return {name: mp.mpf(number) for name, number in numbers.items()}


def pose(kind, dimensions, theta, branches=None):
    """Return the `Pose` at a crank angle, None where the linkage cannot be assembled."""
    found = place(kind, exact(dimensions), mp.mpf(theta), branches)
    return found if found.assembled else None


def place(kind, length, theta, branches=None):
    """Return the `Pose` at a crank angle; the gaps tell whether it can be assembled."""
    sides = {**KINDS[kind].branches, **(branches or {})}
    return KINDS[kind].place(theta, sides, **length)


def bars(kind, length):
    """Return the constant distances of a linkage as {(joint, joint): length}."""
    return _BARS[kind](**length)


def circles(p, radius_p, q, radius_q, side):
    """
    Return the meeting point of two circles on a side of the line from p to q, and the gap.

    The gap is the square of the point's height over pq, in units of pq: negative where the
    circles do not meet, and then the point is the foot of the common chord.
    """
    across = squared(q - p)
    along = (across + radius_p * radius_p - radius_q * radius_q) / (2 * across)
    gap = radius_p * radius_p / across - along * along
    height = mp.sqrt(gap) if gap > 0 else mp.zero
    return p + (q - p) * mp.mpc(along, side * height), gap


def squared(z):
    """Return the square of a vector's length."""
    return z.real * z.real + z.imag * z.imag


def cross(v, w):
    """Return the cross product of two vectors: positive when w is on the left of v."""
    return v.real * w.imag - v.imag * w.real


def servo(length, lever_angle, cut):
    """
    Return the `Servo` of a slotted lever: where the slot's line cuts the crank's circle.

    There are two cuts; `cut` +1 is the one further along the lever.
    """
    a, b, e = length['a'], length['b'], length['e']
    lever = I * mp.expj(lever_angle)
    foot = -I * b + I * lever * e
    along = foot.real * lever.real + foot.imag * lever.imag
    offset = cross(lever, foot)
    gap = a * a - offset * offset
    slide = cut * mp.sqrt(gap if gap > 0 else mp.zero) - along
    return Servo(mp.arg((foot + slide * lever) / I), slide, gap)


def _water_drop(theta, sides, a, rocker=None, tail=None):
    """Turn CO by twice the angle OCA, which has the sign of the crank's sine."""
    sine = mp.sin(theta)
    with mp.extraprec(-2 * min(0, mp.mag(sine)) if sine else 0):
        c = rocker or 2 * a
        A = I * a * mp.expj(theta)
        C = mp.mpc(0, -c)
        reach = mp.sqrt(squared(A - C))
        cosine = (reach * reach + c * c - a * a) / (2 * c * reach)
        height = mp.sqrt(max(mp.zero, 1 - cosine * cosine))
        half = mp.mpc(cosine, height if sine > 0 else -height)
        B = C + c * I * half * half
        P = A + (tail or 3 * a) / a * (A - B)
    return Pose({'O': mp.mpc(0), 'C': C, 'A': A, 'B': B, 'P': P}, {})


def _jansen(theta, sides, a, b, c, d, e, f, g, h, i, j, k, l, m):  # noqa: E741
    A = m * mp.expj(theta)
    B = mp.mpc(-a, -l)
    C, gap_c = circles(B, b, A, j, sides['C'])
    D, gap_d = circles(B, d, C, e, LEFT)
    E, gap_e = circles(B, c, A, k, sides['E'])
    F, gap_f = circles(E, g, D, f, sides['F'])
    G, gap_g = circles(E, i, F, h, LEFT)
    return Pose({'O': mp.mpc(0), 'B': B, 'A': A, 'C': C, 'D': D, 'E': E, 'F': F, 'G': G},
                {'C': gap_c, 'D': gap_d, 'E': gap_e, 'F': gap_f, 'G': gap_g})


def _peaucellier(theta, sides, r, a, b):
    P = mp.mpc(-r)
    A = r * mp.expj(theta)
    B, gap = circles(P, a, A, b, RIGHT)
    D, _ = circles(P, a, A, b, LEFT)
    C = _other_corner(A, B, D, b)
    return Pose({'O': mp.mpc(0), 'P': P, 'A': A, 'B': B, 'C': C, 'D': D}, {'B': gap})


def _other_corner(A, B, D, b):
    """Return where the circles about B and D meet, other than at A."""
    if B == D:
        return B + D - A
    side = LEFT if cross(D - B, A - B) < 0 else RIGHT
    return circles(B, b, D, b, side)[0]


def _slotted_lever(theta, sides, a, b, e, tip=None):
    """Lay the slot from the pin as a tangent, at the foot, to the circle of its offset about Q."""
    A = I * a * mp.expj(theta)
    Q = mp.mpc(0, -b)
    gap = squared(A - Q) - e * e
    slide = sides['L'] * mp.sqrt(gap if gap > 0 else mp.zero)
    foot, _ = circles(Q, abs(e), A, abs(slide), LEFT if slide * e > 0 else RIGHT)
    lever = (A - foot) / slide if abs(slide) > abs(e) else (foot - Q) / (I * e)
    end = Q + lever * (tip or max(9 * b / 5, a + b))
    return Pose({'O': mp.mpc(0), 'Q': Q, 'A': A, 'L': end}, {'L': gap}, slide)


KINDS = {
    'water_drop': Kind(_water_drop, {}, {}),
    'jansen': Kind(_jansen, {'C': LEFT, 'E': RIGHT, 'F': LEFT},
                   {'C': 'C', 'D': 'CD', 'E': 'E', 'F': 'CDEF', 'G': 'CDEFG'}),
    'peaucellier': Kind(_peaucellier, {}, {'B': 'B', 'C': 'B', 'D': 'B'}),
    'slotted_lever': Kind(_slotted_lever, {'L': 1}, {'L': 'L'}),

}

_BARS = {
    'water_drop': lambda a: {
        'OA': a, 'AB': a, 'CB': 2 * a, 'AP': 3 * a, 'BP': 4 * a, 'OC': 2 * a},
    'jansen': lambda a, b, c, d, e, f, g, h, i, j, k, l, m: {  # noqa: E741
        'OA': m, 'BC': b, 'AC': j, 'BD': d, 'CD': e, 'BE': c, 'AE': k, 'EF': g, 'DF': f,
        'EG': i, 'FG': h, 'OB': mp.hypot(a, l)},
    'peaucellier': lambda r, a, b: {
        'OA': r, 'OP': r, 'PB': a, 'PD': a, 'AB': b, 'BC': b, 'CD': b, 'AD': b},
    'slotted_lever': lambda a, b, e: {'OA': a, 'OQ': b, 'QL': max(9 * b / 5, a + b)},
}
