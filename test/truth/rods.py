# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Linkages of rods in space, another way, in 90 digits.

A rod across one hinge is a cos + b sin = c, solved with an arc cosine, which cancels badly, and
90 digits do not mind. Two rods across two hinges are closed from an answer by Newton's method:
that judges its digits alone; which assembly it is, the polynomial of degree eight tells.
"""

from functools import partial
import itertools
import math
from typing import NamedTuple

import gmpy2
from gmpy2 import mpfr
import numpy as np

BITS = 300
# Of difference quotients.
STEP = 2.0 ** -110
UNIT = 2.0 ** -53
# Ankles of public models, and the ranges of pitch and roll that their makers name [rad].
REAL = {name: (parts, np.radians(limits)) for name, (parts, limits) in {
    'Digit': (([-0.325998, -0.038658, -0.014], [0.0, 0.0, -1.0],
               [-0.328453, -0.029999, 0.0], [0.272692, -0.962101, 0.0],
               [[-0.0888, -0.026114, 0.03], [-0.0888, -0.026114, -0.03]],
               [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]],
               [[-0.083933, -0.082906, 0.0275], [-0.082649, -0.082781, -0.0275]],
               [[-0.323444, -0.083473, 0.01385], [-0.322206, -0.083122, -0.014673]]),
              [(-44, -37), (34, 33)]),
    'battobot': (([0.25, 0.0, 0.0], [0.0, 0.0, -1.0],
                  [0.263995, -0.021827, 0.0165], [0.305869, 0.952074, 0.0],
                  [[0.051, 0.0, -0.001], [0.131946, 0.0, 0.034]],
                  [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]],
                  [[0.045877, 0.029559, -0.025], [0.145471, 0.026778, 0.058]],
                  [[0.289183, 0.057935, -0.020861], [0.308263, 0.051805, 0.048294]]),
                 [(-28, -36), (30, 4)]),
    'TienKung': (([0, 0, 0], [0, 1, 0], [0, 0, 0], [1, 0, 0],
                  [[0, 0.045, 0.315], [0, -0.045, 0.24]], [[0, 1, 0], [0, 1, 0]],
                  [[-0.055827, 0.045, 0.336999], [-0.055827, -0.045, 0.261999]],
                  [[-0.05582, 0.045, 0.022], [-0.05582, -0.045, 0.022]]),
                 [(-70, -25), (30, 25)]),
    'AgiBot': (([0, 0, 0], [0, 1, 0], [0, 0, 0], [1, 0, 0],
                [[-0.041, 0, 0.195], [-0.041, 0, 0.14]], [[1, 0, 0], [1, 0, 0]],
                [[-0.041, -0.023326, 0.203993], [-0.041, 0.023328, 0.148989]],
                [[-0.041, -0.025, 0.009], [-0.041, 0.025, 0.009]]),
               [(-57.3, -57.3), (57.3, 57.3)])}.items()}


def exactly():
    """Return the context in which all this is computed."""
    return gmpy2.context(precision=BITS)


class Rod(NamedTuple):
    """A motor with an axis, a rod of a length from its crank, and a hinge that carries its end."""

    motor: list
    motor_axis: list
    pivot: list
    hinge: list
    hinge_axis: list
    end: list
    length: list
    angle: list
    # By how much both ends are off, as seen from the hinge.
    pivot_off: tuple = (0, 0, 0)
    end_off: tuple = (0, 0, 0)


def dot(x, y):
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]


def cross(x, y):
    return [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]]


def turned(point, origin, axis, angle):
    """Return a point turned about an axis of any length, after Rodrigues, in digits or floats."""
    length = dot(axis, axis) ** 0.5
    axis = [x / length for x in axis]
    arm = [x - o for x, o in zip(point, origin)]
    do = gmpy2 if isinstance(angle, mpfr) else np
    c, s, along = do.cos(angle), do.sin(angle), dot(axis, arm)
    return [o + x * c + y * s + a * along * (1 - c)
            for o, x, y, a in zip(origin, arm, cross(axis, arm), axis)]


def seen(rod):
    """Return both ends of a rod as seen from the hinge, that on the hinge at angle zero."""
    points = turned(rod.pivot, rod.motor, rod.motor_axis, rod.angle[0]), rod.end
    return [[x - o + off for x, o, off in zip(point, rod.hinge, offs)]
            for point, offs in zip(points, (rod.pivot_off, rod.end_off))]


def equation(rod):
    """Return a, b, c of a cos + b sin = c for the angle of the hinge."""
    axis = [x / gmpy2.sqrt(dot(rod.hinge_axis, rod.hinge_axis)) for x in rod.hinge_axis]
    foot, end = seen(rod)
    up, along = dot(axis, foot), dot(axis, end)
    return (dot(foot, end) - up * along, dot(axis, cross(end, foot)),
            (dot(foot, foot) + dot(end, end) - rod.length[0] ** 2) / 2 - up * along)


def angle(rod, side):
    """Return the angle of the hinge on a side; None where the rod does not reach."""
    a, b, c = equation(rod)
    size = gmpy2.hypot(a, b)
    if abs(c) > size:
        return None
    return gmpy2.atan2(b, a) + side * gmpy2.acos(c / size)


def rate(rod, side):
    """Return d hinge / d motor on a side."""
    psi, (a, b, _) = angle(rod, side), equation(rod)
    by_motor, = slopes(lambda value: equation(rod._replace(angle=[value])), rod.angle, mpfr(STEP))
    cos, sin = gmpy2.cos(psi), gmpy2.sin(psi)
    return (by_motor[2] - by_motor[0] * cos - by_motor[1] * sin) / (b * cos - a * sin)


def slopes(of, at, step):
    """Return the derivatives of numbers by each argument, as difference quotients."""
    return [[(x - y) / (2 * step) for x, y in zip(*(
        of(*at[:i], at[i] + way, *at[i + 1:]) for way in (step, -step)))] for i in range(len(at))]


def drawn_side(rod):
    """Return the side on which the rod is drawn, at angle zero."""
    foot, end = ([x - o for x, o in zip(point, rod.hinge)] for point in (rod.pivot, rod.end))
    return 1 if dot(rod.hinge_axis, cross(foot, end)) >= 0 else -1


def sensitivity(of, vectors, sizes):
    """
    Return what half a last digit of each number, the largest of its vector, does to values.

    `of` returns them, or None, from vectors; as large as `sizes` are these at last rounded.
    """
    totals = 0
    for i, (vector, size) in enumerate(zip(vectors, sizes)):
        half = float(np.spacing(max(abs(float(x)) for x in size)) / 2) if vector else 0.0
        for k in range(len(vector or ())):
            ends = [of([*vectors[:i], [*vector[:k], vector[k] + way, *vector[k + 1:]],
                        *vectors[i + 1:]]) for way in (mpfr(half) * STEP, -mpfr(half) * STEP)]
            if None in ends:
                return [mpfr('inf')]
            totals += np.array([abs(x - y) / (2 * STEP) for x, y in zip(*ends)])
    return totals


class Ankle(NamedTuple):
    """
    Two hinges in a row that two rods hold: numbers as in its lines.

    Of the motors, the pivots on their cranks, the ends on the foot and the lengths there are two
    each; a rod that is a cylinder has a motor without an axis.
    """

    first: list
    first_axis: list
    second: list
    second_axis: list
    motors: list
    motor_axes: list
    pivots: list
    ends: list
    lengths: list

    @property
    def lines(self):
        """Return the lines of it, without limits."""
        def text(vector):
            return ' '.join(map(repr, map(float, vector)))

        def joint(word, at, axis):
            return f'{word} at {text(at)} axis {text(axis)}'

        lines = [joint('pitch hinge ground', self.first, self.first_axis),
                 joint('roll hinge pitch', self.second, self.second_axis)]
        for name, at, axis, pivot, end, length in zip('lr', *self[4:]):
            if axis is None:
                lines.append(f'{name} cylinder ground {text(pivot)} roll {text(end)}')
            else:
                lines += [joint(f'{name} motor ground', at, axis),
                          f'{name}rod rod {name} {text(pivot)} roll {text(end)} '
                          f'length {length!r}']
        return lines

    def within(self, low, high):
        """Return its lines with limits of both hinges [rad]."""
        return [f'{line} within {float(a)!r} {float(b)!r}' if i < 2 else line
                for i, (line, a, b) in enumerate(zip(self.lines, [*low, 0, 0, 0, 0],
                                                     [*high, 0, 0, 0, 0]))]


def drawn(*parts):
    """Return an ankle whose rods are as long as drawn, rounded."""
    return Ankle(*parts, [math.dist(*each) for each in zip(*parts[6:])])


def random_ankle(rng, plausible=True):
    """Return an ankle like those of robots, or with everything anywhere."""
    def vector(size, about=(0.0, 0.0, 0.0)):
        return (np.array(about) + rng.normal(size=3) * size).tolist()

    cylinders = rng.random() < 0.3
    if not plausible:
        return drawn(*(vector(1.0) for _ in range(4)), [vector(1.0) for _ in range(2)],
                     [None if cylinders else vector(1.0) for _ in range(2)],
                     *([vector(1.0) for _ in range(2)] for _ in range(2)))
    high, side = rng.uniform(0.1, 0.3, 2), rng.uniform(0.02, 0.06)
    motors = [vector(0.01, (0.02, y, z)) for y, z in zip((side, -side), high)]
    return drawn(vector(0.001), vector(0.05, (0, 1, 0)), vector(0.01), vector(0.05, (1, 0, 0)),
                 motors, [None if cylinders else vector(0.1, (0, 1, 0)) for _ in range(2)],
                 [vector(0.01, np.array(m) + (rng.uniform(0.02, 0.06), 0, 0)) for m in motors],
                 [vector(0.005, (rng.uniform(0.03, 0.06), y, -0.02)) for y in (side, -side)])


def gap(ankle, which, value, pitch, roll):
    """Return by how much half the squared length of a rod is off, in digits or floats."""
    pivot, length = ankle.pivots[which], value
    # A cylinder is as long as its input is.
    if ankle.motor_axes[which] is not None:
        pivot = turned(pivot, ankle.motors[which], ankle.motor_axes[which], value)
        length = ankle.lengths[which]
    end = turned(ankle.ends[which], ankle.second, ankle.second_axis, roll)
    rod = [x - y for x, y in zip(pivot, turned(end, ankle.first, ankle.first_axis, pitch))]
    return (dot(rod, rod) - length ** 2) / 2


def gaps(ankle, motors, pitch, roll):
    """Return the gaps of both rods."""
    return [gap(ankle, which, value, pitch, roll) for which, value in enumerate(motors)]


def assemblies(ankle, motors):
    """
    Return all real poses of each motor pair: pitch and roll, arrays (n, 8), NaN for none.

    Both equations are a cos(pitch) + b sin(pitch) = c with a, b, c linear in cos and sin of the
    roll; without the pitch a polynomial of degree eight in e^(i roll) is left. Its roots next to
    the unit circle are refined by Newton's method on both equations and told apart.
    """
    motors = [np.asarray(value, float) for value in motors]
    turns = np.exp(2j * np.pi * np.arange(16) / 16)

    def parts(roll):
        zero, quarter, half = (np.stack(np.broadcast_arrays(*gaps(
            ankle, [value[:, None] for value in motors], pitch, roll)))
            for pitch in (0.0, 0.5 * np.pi, np.pi))
        c = 0.5 * (zero + half)
        return zip(zero - c, quarter - c, c)

    (a1, b1, c1), (a2, b2, c2) = parts(np.angle(turns)[None])
    values = (b1 * c2 - b2 * c1) ** 2 + (c1 * a2 - c2 * a1) ** 2 - (a1 * b2 - a2 * b1) ** 2
    series = np.fft.fft(values, axis=1) / 16
    poly = np.concatenate([series[:, -4:], series[:, :5]], axis=1)[:, ::-1]
    scale = np.abs(poly).max(axis=1, keepdims=True)
    poly = np.where(np.abs(poly) > 1e-14 * scale, poly, 1e-14 * scale) / scale
    companion = np.zeros((len(poly), 8, 8), complex)
    companion[:, 0] = -poly[:, 1:] / poly[:, :1]
    companion[:, np.arange(1, 8), np.arange(7)] = 1.0
    roots = np.linalg.eigvals(companion)
    roll = np.where(np.abs(np.abs(roots) - 1.0) < 0.05, np.angle(roots), np.nan)
    (a1, b1, c1), (a2, b2, c2) = parts(roll)
    sign = np.sign(a1 * b2 - a2 * b1)
    pitch = np.arctan2(sign * (c1 * a2 - c2 * a1), sign * (b1 * c2 - b2 * c1))
    return _distinct(*_refined(ankle, motors, pitch, roll))


def _refined(ankle, motors, pitch, roll):
    residuals = partial(gaps, ankle, [value[:, None] for value in motors])
    with np.errstate(all='ignore'):
        for _ in range(20):
            moves = _solved(slopes(residuals, (pitch, roll), 1e-7), residuals(pitch, roll))
            pitch, roll = (x - np.clip(move, -0.5, 0.5) for x, move in zip((pitch, roll), moves))
        scale = max(np.abs(np.array([*ankle.pivots, *ankle.ends])).max(), 1e-3) ** 2
        kept = np.maximum(*map(np.abs, residuals(pitch, roll))) < 1e-11 * scale
    turn = 2.0 * np.pi
    return [np.where(kept, x - turn * np.round(x / turn), np.nan) for x in (pitch, roll)]


def _distinct(pitch, roll):
    """Return poses that are named once."""
    turn = 2.0 * np.pi
    for i in range(1, pitch.shape[1]):
        for j in range(i):
            errors = [x[:, i] - x[:, j] for x in (pitch, roll)]
            same = np.all([np.abs(x - turn * np.round(x / turn)) < 1e-6 for x in errors], axis=0)
            pitch[same, i] = roll[same, i] = np.nan
    return pitch, roll


def pose_error(ankle, motors, pitch, roll):
    """Return both angles' errors, and what half a last digit of each number does to them."""
    vectors = [None if vector is None else list(map(mpfr, vector)) for vector in (
        *ankle[:4], *(vector for pair in ankle[4:8] for vector in pair),
        *([x] for x in (*ankle.lengths, *motors)))]
    # The length of a cylinder is an input.
    vectors[12:14] = [axis and length for axis, length in zip(ankle.motor_axes, vectors[12:14])]
    start = p, r = mpfr(pitch), mpfr(roll)

    def gaps_of(vectors, p, r):
        pairs = [vectors[i:i + 2] for i in range(4, 12, 2)]
        return gaps(Ankle(*vectors[:4], *pairs, [x and x[0] for x in vectors[12:14]]),
                    [x for x, in vectors[14:]], p, r)

    for _ in range(4):
        columns = slopes(partial(gaps_of, vectors), (p, r), mpfr(STEP))
        moved = _solved(columns, gaps_of(vectors, p, r))
        p, r = p - moved[0], r - moved[1]
    return [abs(float(x - y)) for x, y in zip(start, (p, r))], sensitivity(
        lambda vectors: _solved(columns, gaps_of(vectors, p, r)), vectors, vectors)


def _solved(columns, f):
    (a, c), (b, d) = columns
    det = a * d - b * c
    return (f[0] * d - f[1] * b) / det, (a * f[1] - c * f[0]) / det


def measured(case):
    """
    Return the true angle of a rod's hinge and its rate, each with its sensitivity.

    None where the rod does not reach; the rate is None next to a dead point.
    """
    side = drawn_side(case)

    def with_sensitivity(of):
        def values(vectors):
            value = of(Rod(*vectors), side)
            return None if value is None else [value]

        # Like joints in a plane, both ends as seen from the hinge are rounded once more.
        return of(case, side), sensitivity(values, [*map(list, case)], [*case[:8], *seen(case)])[0]

    if angle(case, side) is None:
        return None, None
    a, b, c = equation(case)
    is_dead = abs(abs(c) / gmpy2.hypot(a, b) - 1) < 1e-6
    return with_sensitivity(angle), None if is_dead else with_sensitivity(rate)


def apart(angle_, other):
    """Return how far angles are from each other, whole turns aside."""
    turn = 2 * gmpy2.const_pi()
    difference = angle_ - other
    return abs(difference - turn * gmpy2.rint(difference / turn))


def beyond(case):
    """Return how far a rod is from reaching, as a part of what rounding its numbers does."""
    a, b, c = equation(case)
    size = sum(abs(float(x)) for vector in case[:7] for x in vector) ** 2
    return float((abs(c) - gmpy2.hypot(a, b)) / (size * UNIT))


def random_rods(rng, count):
    """
    Return rods at random, as arrays by what `Rod` calls them.

    Axes are a third each anywhere, parallel but for 1e-16 to 1e-1, and along x, y and z; rods are
    a quarter each long enough, every decade to 1e-17 from a dead point, at it but for some last
    digits, and with an end next to the hinge's axis.
    """
    def any_of(many=3):
        return rng.normal(size=(count, many))

    motor, hinge, pivot, end, axis, other = (any_of() for _ in range(6))
    kind = rng.integers(3, size=count)
    near = axis + any_of() * 10.0 ** rng.uniform(-16, -1, size=(count, 1))
    other[kind == 1] = near[kind == 1]
    for vectors in (axis, other):
        vectors[kind == 2] = np.eye(3)[rng.integers(3, size=count)][kind == 2]
    value = rng.uniform(-np.pi, np.pi, count)
    along = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    kind = rng.integers(4, size=count)
    close = hinge + along * any_of(1) + (end - hinge) * 10.0 ** rng.uniform(-12, 0, (count, 1))
    end[kind == 3] = close[kind == 3]
    foot = np.array([turned(*each) for each in zip(pivot, motor, other, value)]) - hinge
    up = ((foot - end + hinge) * along).sum(axis=1)
    w, rho = (np.linalg.norm(np.cross(along, x), axis=1) for x in (foot, end - hinge))
    low, high = np.hypot(up, w - rho), np.hypot(up, w + rho)
    sign = rng.choice([-1, 1], count)
    edge = np.where(sign > 0, low, high)
    length = rng.uniform(low, high)
    decades = edge * (1 + sign * 10.0 ** rng.uniform(-17, 0, count))
    digits = edge * (1 + rng.integers(-4, 5, size=count) * 2.0 ** -52)
    length = np.select([kind == 1, kind == 2], [decades, digits], length)
    sided = np.einsum('ij,ij->i', along, np.cross(pivot - hinge, end - hinge))
    seen = np.abs(sided) > 2e-6 * np.linalg.norm(np.cross(along, pivot - hinge), axis=1) * rho
    kept = seen & (length > 0.0)
    return {name: part[kept] for name, part in zip(Rod._fields[:8], (
        motor, other, pivot, hinge, axis, end, length, value))}


def motor_values(ankle, which, pitch, roll):
    """Return a motor's values for poses, one array for each side of its crank, in float64."""
    zero, quarter, half = (gap(ankle, which, value, pitch, roll)
                           for value in (0.0, 0.5 * np.pi, np.pi))
    if ankle.motor_axes[which] is None:
        return [np.sqrt(2.0 * zero)]
    c = 0.5 * (zero + half)
    a, b = zero - c, quarter - c
    with np.errstate(invalid='ignore'):
        off = np.arccos(-c / np.hypot(a, b))
    return [np.arctan2(b, a) + side * off for side in (1, -1)]


def are_drawn(ankle, motors, pitch, roll):
    """Return whether all cranks are on their drawn sides, by difference quotients."""
    drawn_values = [0.0 if axis else length
                    for axis, length in zip(ankle.motor_axes, ankle.lengths)]

    def sides(values, pose):
        by_motors = slopes(lambda *values: gaps(ankle, values, *pose), (*values,), 1e-6)
        return by_motors[0][0], by_motors[1][1]

    return np.all([x * y > 0.0 for x, y in zip(
        sides(motors, (pitch, roll)), sides(drawn_values, (0.0, 0.0)))], axis=0)


def is_ambiguous(ankle, low, high, count=11):
    """
    Return whether a window has a second or a singular pose for some motors that it needs.

    All cranks are on their drawn sides.

    Between poses next to each other with determinants of opposite signs one is singular. Poses
    that are not may have such signs: a rod that does not reach all of a window may leave two parts
    of it, each with a determinant of its own that comes nowhere near zero.
    """
    axes = [np.linspace(*ends, count) for ends in zip(low, high)]
    pitch, roll = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2).T
    for motors in itertools.product(*(motor_values(ankle, i, pitch, roll) for i in (0, 1))):
        there = ~np.isnan(motors).any(axis=0) & are_drawn(ankle, motors, pitch, roll)
        if not there.any():
            continue
        motors = [np.where(there, x, np.nan) for x in motors]
        # Of the derivatives of the gaps by both angles.
        (a, c), (b, d) = slopes(partial(gaps, ankle, motors), (pitch, roll), 1e-6)
        signs = np.sign(a * d - b * c).reshape(count, count)
        if any((one * other < 0.0).any() for one, other in (
                (signs[1:], signs[:-1]), (signs[:, 1:], signs[:, :-1]))):
            return True
        motors = [x[there] for x in motors]
        all_ = np.stack(assemblies(ankle, motors), axis=-1)
        inside = ((all_ > low + 1e-6) & (all_ < high - 1e-6)).all(axis=-1)
        inside &= are_drawn(ankle, [x[:, None] for x in motors], all_[..., 0], all_[..., 1])
        if inside.sum(axis=1).max() > 1:
            return True
    return False
