# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The formulas of the original documents, to be measured beside the library.

Written as they stand there (acos, sqrt(1 - cos^2), a plain atan, the sign rule for 0 to 180
degrees), with slips of the pen set right where the documents' own programs are right: B.y of the
water drop, d for b in Jansen's D. Angles are in radians throughout. Each formula is written once
and given the functions that suit what it works on: those of `math` for one pose after the other,
numpy's for arrays of any shape, whose precision they keep, float32 or float64.

Sources: "Water drop linkage", "Jansen linkage", "Peaucellier-Lipkin linkage" (H. Shigeyoshi,
gnuplot programs); a Processing sketch of the slotted lever.
"""

import math
from types import SimpleNamespace

import numpy as np

FLOATS = SimpleNamespace(
    sin=math.sin, cos=math.cos, sqrt=math.sqrt, acos=math.acos, atan=math.atan, atan2=math.atan2,
    sign=lambda theta: 1.0 if 0.0 <= theta <= math.pi else -1.0)
ARRAYS = SimpleNamespace(
    sin=np.sin, cos=np.cos, sqrt=np.sqrt, acos=np.arccos, atan=np.arctan, atan2=np.arctan2,
    sign=lambda theta: np.where((0.0 <= theta) & (theta <= np.pi), 1.0, -1.0).astype(theta.dtype))


def written(functions, kind, dimensions):
    """
    Return a function of a crank angle [rad] that returns x and y of each moving joint [m].

    Of floats it raises ValueError where an acos or a root ends. A slot offset is not known to the
    documents and is left out.
    """
    return _FORMULAS[kind](functions, **dimensions)


def _water_drop(f, a):
    sin, cos, sqrt, sign = f.sin, f.cos, f.sqrt, f.sign

    square = 3.0 * a * a

    def pose(theta):
        cos_theta = cos(theta)
        length = a * sqrt(5.0 + 4.0 * cos_theta)
        cosine = (length * length + square) / (4 * a * length)
        sine = sign(theta) * sqrt(1.0 - cosine * cosine)
        ax, ay = -a * sin(theta), a * cos_theta
        bx, by = -4 * a * cosine * sine, -2.0 * a + 2 * a * (2 * cosine * cosine - 1)
        return ax, ay, bx, by, 4 * ax - 3 * bx, 4 * ay - 3 * by

    return pose


def _jansen(function, a, b, c, d, e, f, g, h, i, j, k, l, m):  # noqa: E741
    sin, cos, sqrt, acos, atan2 = (
        function.sin, function.cos, function.sqrt, function.acos, function.atan2)
    bx, by = -a, -l
    bb, cc, ff, gg, jj, kk = (length * length for length in (b, c, f, g, j, k))
    gamma, eta = np.arccos([(b ** 2 + d ** 2 - e ** 2) / (2 * b * d),
                            (g ** 2 + i ** 2 - h ** 2) / (2 * g * i)]).tolist()

    def pose(theta):
        ax, ay = m * cos(theta), m * sin(theta)
        x, y = ax - bx, ay - by
        ab = sqrt(x * x + y * y)
        alpha = atan2(y, x)
        beta = alpha + acos((ab * ab + bb - jj) / (2 * ab * b))
        delta = alpha - acos((ab * ab + cc - kk) / (2 * ab * c))
        cx, cy = bx + b * cos(beta), by + b * sin(beta)
        dx, dy = bx + d * cos(beta + gamma), by + d * sin(beta + gamma)
        ex, ey = bx + c * cos(delta), by + c * sin(delta)
        x, y = dx - ex, dy - ey
        de = sqrt(x * x + y * y)
        zeta = atan2(y, x) + acos((de * de + gg - ff) / (2 * de * g))
        return (ax, ay, cx, cy, dx, dy, ex, ey, ex + g * cos(zeta), ey + g * sin(zeta),
                ex + i * cos(zeta + eta), ey + i * sin(zeta + eta))

    return pose


def _peaucellier(f, r, a, b):
    sin, cos, sqrt, acos = f.sin, f.cos, f.sqrt, f.acos
    aa, bb = a * a, b * b

    def pose(theta):
        ax, ay = r * cos(theta), r * sin(theta)
        px, py = -r - ax, -ay
        ap = sqrt(px * px + py * py)
        alpha = acos((ap * ap + bb - aa) / (2 * ap * b))
        x, y, cosine, sine = b * px / ap, b * py / ap, cos(alpha), sin(alpha)
        bx, by = x * cosine - y * sine, x * sine + y * cosine
        dx, dy = x * cosine + y * sine, y * cosine - x * sine
        return ax, ay, ax + bx, ay + by, ax + bx + dx, ay + by + dy, ax + dx, ay + dy

    return pose


def _slotted_lever(f, a, b, e=0.0):
    """Draw the lever as long as the catalogue's, 1.8 b in the sketches."""
    sin, cos, atan = f.sin, f.cos, f.atan
    length = max(1.8 * b, a + b)

    def pose(theta):
        across, up = a * sin(theta), a * cos(theta)
        lever = atan(across / (up + b)) + math.pi / 2
        return -across, up, length * cos(lever), -b + length * sin(lever)

    return pose


_FORMULAS = {'water_drop': _water_drop, 'jansen': _jansen, 'peaucellier': _peaucellier,
             'slotted_lever': _slotted_lever}
