# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Sine, cosine and arctangent by arithmetic alone, for SIMD code.

The error of sine and cosine is below one ulp, that of the arctangent below two. The polynomials
are those of fdlibm (k_sin.c, k_cos.c, s_atan.c; Sun Microsystems, 1993). The argument reduction is
that of Cody and Waite (Software Manual for the Elementary Functions, 1980).
"""

from __future__ import annotations

from functools import reduce
import math
from typing import Sequence

from .expression import Real, real, where

# A quarter turn. The first two parts have 38 bits: up to 2^15 times each is exact.
QUARTER = (float.fromhex('0x1.921fb54440000p+0'), float.fromhex('0x1.68c234c4c0000p-39'),
           float.fromhex('0x1.98a2e03707345p-77'))
PER_QUARTER = 0.6366197723675814
# Sums with this number are rounded to integers.
WHOLE = 1.5 * 2.0 ** 52
# The C library computes larger angles.
MAX_ANGLE = 2.0 ** 15 * QUARTER[0]
SINE = (-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
        2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10)
COSINE = (4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
          -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11)
ARCTANGENT = (3.33333333333329318027e-01, -1.99999999998764832476e-01, 1.42857142725034663711e-01,
              -1.11111104054623557880e-01, 9.09088713343650656196e-02, -7.69187620504482999495e-02,
              6.66107313738753120669e-02, -5.83357013379057348645e-02, 4.97687799461593236017e-02,
              -3.65315727442169155270e-02, 1.62858201153657823623e-02)
# Above the first slope, angles are relative to that of the second: its angle, to two floats.
ARCTANGENT_STARTS = ((0.4375, 0.5, 4.63647609000806093515e-01, 2.26987774529616870924e-17),
                     (0.6875, 1.0, 7.85398163397448278999e-01, 3.06161699786838301793e-17))
# pi - math.pi.
REST_OF_PI = 1.2246467991473532e-16
# Between these, halves are exact and sums are finite.
MIN_HALVED, MAX_ADDED = 2.0 ** -1000, 2.0 ** 1000


def sine_and_cosine(x: Real) -> tuple[Real, Real, Real]:
    """Return sin x and cos x, and whether they are valid."""
    quarters = _rounded(x * PER_QUARTER)
    angle, rest = _reduced(x, quarters)
    sine, cosine = _sine(angle, rest), _cosine(angle, rest)
    # From -2 to 2; both ends are half a turn.
    quarter = quarters - 4.0 * _rounded(0.25 * quarters)
    crossed = abs(abs(quarter) - 1.0) < 0.5
    return (_signed(where(crossed, cosine, sine), abs(quarter - 0.5) < 1.0),
            _signed(where(crossed, sine, cosine), abs(quarter + 0.5) < 1.0),
            abs(x) <= MAX_ANGLE)


def _rounded(x: Real) -> Real:
    """Return the nearest integer, with a positive zero: a negative one would change signs."""
    return (x + WHOLE) - WHOLE


def _reduced(x: Real, quarters: Real) -> tuple[Real, Real]:
    """Return x minus quarter turns to twice the precision, as a sum of two numbers."""
    high, middle, low = (quarters * part for part in QUARTER)
    first = x - high
    second = first - middle
    less = low - ((first - second) - middle)
    angle = second - less
    return angle, (second - angle) - less


def _sine(x: Real, rest: Real) -> Real:
    square = x * x
    cube = square * x
    higher = square * (0.5 * rest - cube * _polynomial(SINE[1:], square)) - rest
    return x - (higher - cube * SINE[0])


def _cosine(x: Real, rest: Real) -> Real:
    square = x * x
    half = 0.5 * square
    near = 1.0 - half
    higher = square * (square * _polynomial(COSINE, square)) - x * rest
    return near + (((1.0 - near) - half) + higher)


def _polynomial(coefficients: Sequence[float], x: Real) -> Real:
    *rest, last = coefficients
    return reduce(lambda sum_, coefficient: coefficient + x * sum_, reversed(rest),
                  real(last))


def _signed(x: Real, positive: Real) -> Real:
    return where(positive, x, -x)


def arctangent(y: Real, x: Real) -> tuple[Real, Real]:
    """Return the angle of (x, y), and whether it is valid."""
    height, width = abs(y), abs(x)
    steep = width < height
    low, high = where(steep, width, height), where(steep, height, width)
    numerator, denominator, start, rest = low, high, real(0.0), real(0.0)
    for slope_limit, slope, angle_start, rest_start in ARCTANGENT_STARTS:
        is_above = slope_limit * high < low
        numerator = where(is_above, low - slope * high, numerator)
        denominator = where(is_above, high + slope * low, denominator)
        start, rest = where(is_above, angle_start, start), where(is_above, rest_start, rest)
    ratio = numerator / denominator
    square = ratio * ratio
    angle = start - ((ratio * (square * _polynomial(ARCTANGENT, square)) - rest) - ratio)
    angle = where(steep, math.pi / 2 - (angle - REST_OF_PI / 2), angle)
    angle = where(x < 0.0, math.pi - (angle - REST_OF_PI), angle)
    # The C library handles infinities and signs of zeros.
    valid = where(high > MIN_HALVED, where(high < MAX_ADDED, height, 0.0), 0.0) > 0.0
    return _signed(angle, y > 0.0), valid
