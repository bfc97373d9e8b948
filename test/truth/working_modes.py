# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A slotted lever; inputs of a five-bar, an arm and an excavator, by circles from the output."""

import cmath
import math

from . import drawing

LEFT, RIGHT = 1, -1


def lever_of(crank, a=80.0, b=150.0):
    """Return the angle of a slotted lever from the pin's place: the loop closure, written out."""
    return math.atan2(a * math.sin(crank), b + a * math.cos(crank))


def meet(one, radius, other, radius_, side):
    """Return where circles about two points meet, to the left of the way from one to the other."""
    place, gap = drawing.meet(drawing.FLOATS, one, radius, other, radius_, side)
    return complex(place) if gap >= 0.0 else None


def side(start, joint, end):
    """Return to which side the way through a joint bends."""
    return LEFT if ((end - joint) / (joint - start)).imag > 0.0 else RIGHT


def five_bar(n, foot):
    """Yield both crank angles for a foot, and the bends at their pins."""
    ground = complex(n['f'], 0.0)
    for one in (LEFT, RIGHT):
        for other in (LEFT, RIGHT):
            a = meet(0.0, n['a'], foot, n['b'], one)
            c = meet(ground, n['d'], foot, n['c'], other)
            if a and c and side(a, c, foot) == LEFT:
                yield (cmath.phase(a), cmath.phase(c - ground)), {
                    'AP': side(0.0, a, foot), 'CP': side(ground, c, foot)}


def arm(n, wrist):
    """Yield both motors' angles of a parallelogram arm for its wrist."""
    for elbow in (LEFT, RIGHT):
        if a := meet(0.0, n['l'], wrist, n['u'], elbow):
            yield (cmath.phase(a), cmath.phase(a - wrist)), {'AR': -side(0.0, a, wrist)}


def excavator(n, h, angle):
    """Yield three cylinders' lengths for a bucket's pivot and its angle."""
    p, j = -1j * n['p'], h + cmath.rect(n['m'], angle)
    for elbow in (LEFT, RIGHT):
        if not (a := meet(0.0, n['l'], h, n['q'], elbow)):
            continue
        b, c = meet(0.0, n['b'], a, n['q'], LEFT), meet(0.0, n['o'], a, n['c'], RIGHT)
        d = meet(a, n['d'], h, n['r'], LEFT)
        e = h + n['g'] * (a - h) / abs(a - h)
        f = meet(h, n['f'], e, n['e'], LEFT)
        for idler in (LEFT, RIGHT):
            g = meet(e, n['i'], j, n['k'], idler)
            bends = (p, b, 0.0), (c, d, a), (f, g, e), (g, j, h)
            if g and [side(*bend) for bend in bends] == [LEFT, RIGHT, LEFT, LEFT]:
                yield (abs(p - b), abs(c - d), abs(f - g)), {}
