# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The truth of a linkage from the lengths of its bars alone: Newton's method in 50 digits.

A law says what must vanish; a sketch, read off a drawing by eye, says which way it is assembled.
From there the inputs are followed in small steps, so that the way stays what it was.
"""

import cmath
from types import SimpleNamespace

from mpmath import mp, mpc, mpf
import numpy as np

STEPS, DIGITS = 24, 50


def cis(angle):
    """Return the unit vector at an angle."""
    return mp.expj(angle) if isinstance(angle, mpf) else cmath.exp(1j * angle)


def cross(one, other):
    """Return what vanishes where two vectors are parallel."""
    return (one.conjugate() * other).imag


class ClosedLoops:
    """
    A law with its numbers.

    Parameters
    ----------
    law : callable
        From joints (complex, by name), numbers and inputs to what must vanish [m]: lengths, and
        complex numbers for both coordinates.
    numbers : dict
        The dimensions, as floats.

    """

    def __init__(self, law, numbers):
        self._law, self._numbers = law, numbers

    def follow(self, sketch, path):
        """Yield joints in 50 digits and half an ulp's worth of each, for inputs along a path."""
        names, place = list(sketch), np.array(list(sketch.values()), complex)
        before = path[0]
        for inputs in path:
            for part in np.linspace(0.0, 1.0, STEPS)[1:]:
                between = [x + part * (y - x) for x, y in zip(before, inputs)]
                for _ in range(4 if part < 1.0 else 20):
                    place = place + self._step(names, place, between)
            before = inputs
            yield self.refined(dict(zip(names, place)), inputs)

    def refined(self, near, inputs):
        """Return joints in many digits, and how far half an ulp of every length moves each."""
        names, place = list(near), np.array(list(near.values()), complex)
        slope = np.linalg.inv(self._slopes(names, place, [float(x) for x in inputs]))
        with mp.workdps(DIGITS):
            exact, inputs = [mpc(each) for each in place], [mpf(x) for x in inputs]
            for _ in range(60):
                left = self._left(names, exact, inputs, mpf)
                if max(map(abs, left)) < mpf(10) ** (6 - DIGITS) * (1 + max(map(abs, exact))):
                    break
                scale = max(map(abs, left))
                move = slope @ np.array([float(x / scale) for x in left])
                exact = [x - scale * complex(*xy) for x, xy in zip(exact, move.reshape(-1, 2))]
            else:
                raise ArithmeticError('Newton does not settle')
        spread = np.abs(slope).sum(axis=1).reshape(-1, 2)
        size = max(map(abs, place))
        return dict(zip(names, exact)), dict(zip(names, np.hypot(*spread.T) * size * 2.0 ** -53))

    def _step(self, names, place, inputs):
        moved = np.linalg.solve(self._slopes(names, place, inputs),
                                np.array(self._left(names, place, inputs, float)))
        return -moved.reshape(-1, 2) @ (1.0, 1j)

    def _left(self, names, place, inputs, number):
        numbers = {name: number(value) for name, value in self._numbers.items()}
        rows = self._law(SimpleNamespace(**dict(zip(names, place))), SimpleNamespace(**numbers),
                         *inputs)
        return [part for row in rows for part in (
            (row.real, row.imag) if isinstance(row, (complex, mpc)) else (row,))]

    def _slopes(self, names, place, inputs):
        step = 1e-6 * max(map(abs, place))
        columns = []
        for k in range(len(place)):
            for way in (1.0, 1j):
                there, back = place.copy(), place.copy()
                there[k], back[k] = there[k] + step * way, back[k] - step * way
                columns.append(np.subtract(self._left(names, there, inputs, float),
                                           self._left(names, back, inputs, float)) / (2 * step))
        return np.array(columns).T
