# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
The formulas of the original documents, to be measured beside the library.

Written as they stand there (acos, sqrt(1 - cos^2), a plain atan, the sign rule for 0 to 180
degrees), with slips of the pen set right where the documents' own programs are right: B.y of the
water drop, d for b in Jansen's D. Angles are in radians throughout. Everything works on arrays of
any shape and keeps the precision of `theta`, float32 or float64.

Sources: "Water drop linkage", "Jansen linkage", "Peaucellier-Lipkin linkage" (H. Shigeyoshi,
gnuplot programs); two Processing sketches of the slotted lever.
"""

import numpy as np


def solve(kind, dimensions, theta):
    """
    Place the joints of a linkage.

    Parameters
    ----------
    kind : str
        The type, as in the catalogue.
    dimensions : mapping of str to float
        Lengths [m]; a slot offset is not known to the documents and is left out.
    theta : array
        Crank angle [rad].

    Returns
    -------
    dict
        For each joint an array of shape (*theta.shape, 2) [m].

    """
    theta = np.asarray(theta)
    lengths = {name: float(value) for name, value in dimensions.items()}
    with np.errstate(invalid='ignore', divide='ignore'):
        joints = _SOLVE[kind](theta, **lengths)
    return {name: _stack(theta, *joint) for name, joint in joints.items()}


def lever_angle(theta, a, b):
    """Return the lever angle [rad] of the first sketch: atan of a quotient."""
    return np.arctan(a * np.sin(theta) / (a * np.cos(theta) + b))


def servo_angle(lever, a, b):
    """Return the crank angle [rad] of the second sketch, NaN where asin ends."""
    with np.errstate(invalid='ignore'):
        return lever + np.arcsin(b * np.sin(lever) / a)


def _stack(theta, x, y):
    shaped = [np.broadcast_to(np.asarray(part, theta.dtype), theta.shape) for part in (x, y)]
    return np.stack(shaped, -1)


def _water_drop(theta, a):
    length = a * np.sqrt(5.0 + 4.0 * np.cos(theta))
    cosine = (length ** 2 + 3.0 * a ** 2) / (4 * a * length)
    sine = np.where((0.0 <= theta) & (theta <= np.pi), 1, -1) * np.sqrt(1.0 - cosine ** 2)
    sine = sine.astype(theta.dtype)
    ax, ay = -a * np.sin(theta), a * np.cos(theta)
    bx, by = -4 * a * cosine * sine, -2.0 * a + 2 * a * (2 * cosine ** 2 - 1)
    return {'O': (0.0, 0.0), 'C': (0.0, -2.0 * a), 'A': (ax, ay), 'B': (bx, by),
            'P': (4 * ax - 3 * bx, 4 * ay - 3 * by)}


def _jansen(theta, a, b, c, d, e, f, g, h, i, j, k, l, m):  # noqa: E741
    ax, ay = m * np.cos(theta), m * np.sin(theta)
    bx, by = -a, -l
    ab = np.sqrt((ax - bx) ** 2 + (ay - by) ** 2)
    alpha = np.arctan2(ay - by, ax - bx)
    beta = np.arccos((ab ** 2 + b ** 2 - j ** 2) / (2 * ab * b))
    gamma = np.arccos((b ** 2 + d ** 2 - e ** 2) / (2 * b * d)).item()
    delta = np.arccos((ab ** 2 + c ** 2 - k ** 2) / (2 * ab * c))
    cx, cy = bx + b * np.cos(alpha + beta), by + b * np.sin(alpha + beta)
    dx, dy = bx + d * np.cos(alpha + beta + gamma), by + d * np.sin(alpha + beta + gamma)
    ex, ey = bx + c * np.cos(alpha - delta), by + c * np.sin(alpha - delta)
    de = np.sqrt((dx - ex) ** 2 + (dy - ey) ** 2)
    epsilon = np.arctan2(dy - ey, dx - ex)
    zeta = np.arccos((de ** 2 + g ** 2 - f ** 2) / (2 * de * g))
    eta = np.arccos((g ** 2 + i ** 2 - h ** 2) / (2 * g * i)).item()
    fx, fy = ex + g * np.cos(epsilon + zeta), ey + g * np.sin(epsilon + zeta)
    gx, gy = ex + i * np.cos(epsilon + zeta + eta), ey + i * np.sin(epsilon + zeta + eta)
    return {'O': (0.0, 0.0), 'B': (bx, by), 'A': (ax, ay), 'C': (cx, cy), 'D': (dx, dy),
            'E': (ex, ey), 'F': (fx, fy), 'G': (gx, gy)}


def _peaucellier(theta, r, a, b):
    ax, ay = r * np.cos(theta), r * np.sin(theta)
    px, py = -r - ax, -ay
    ap = np.sqrt(px ** 2 + py ** 2)
    alpha = np.arccos((ap ** 2 + b ** 2 - a ** 2) / (2 * ap * b))
    bx, by = _rotated(b * px / ap, b * py / ap, alpha)
    dx, dy = _rotated(b * px / ap, b * py / ap, -alpha)
    return {'O': (0.0, 0.0), 'P': (-r, 0.0), 'A': (ax, ay), 'B': (ax + bx, ay + by),
            'C': (ax + bx + dx, ay + by + dy), 'D': (ax + dx, ay + dy)}


def _rotated(x, y, angle):
    return x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)


def _slotted_lever(theta, a, b, e=0.0):
    """Draw the lever as long as the catalogue's, 1.8 b in the sketches."""
    lever = lever_angle(theta, a, b) + np.pi / 2
    length = max(1.8 * b, a + b)
    return {'O': (0.0, 0.0), 'Q': (0.0, -b), 'A': (-a * np.sin(theta), a * np.cos(theta)),
            'L': (length * np.cos(lever), -b + length * np.sin(lever))}


_SOLVE = {'water_drop': _water_drop, 'jansen': _jansen, 'peaucellier': _peaucellier,
          'slotted_lever': _slotted_lever}
