# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The slotted lever, or inverted slider-crank: a crank pin moves a lever by its slot, and back.

The pin A = i a e^(i theta) turns about O, the lever turns about Q = (0, -b), both angles from +y.
The slot is parallel to the lever at distance e on its left, L is the lever's tip, 1.8 b from Q or
as far as the pin gets if that is more. Closure: a e^(i theta) + b = e^(i phi) (t + i e) with the
lever angle phi and the pin's place t along the slot; branch L, +1 or -1, is the half of the slot.
Differentiated, it gives d phi / d theta = a cos(theta - phi) / t.

Sources: Norton, "Design of Machinery", sec. 4.8 (inverted slider-crank); the inverse closes the
same triangle: a e^(i theta) = e^(i phi) (W + i (e + b sin phi)), W^2 = a^2 - (e + b sin phi)^2.
"""

import math
from typing import Any, Sequence

from numpy.typing import ArrayLike

from .. import linkage
from ..linkage import Design, reachable_arcs

DESIGN = Design('slotted_lever', {'a': 80.0, 'b': 150.0, 'e': 0.0}, tracer='L',
                signed=frozenset('e'), joints=(
    'O ground 0 0',
    'Q ground 0 -b',
    'A crank O a up',
    'L slot Q A e out max(1.8*b,a+b)'))


class Mechanism(linkage.Mechanism):
    """A slotted lever: also solved from the lever angle."""

    def servo_angle(self, lever_angle: ArrayLike, near: ArrayLike | None = None) -> Any:
        """
        Return the crank angle for a lever angle.

        Parameters
        ----------
        lever_angle : float or array-like
            Lever angle phi [rad], from +y.
        near : float or array-like, optional
            The result is the solution nearest to this angle, whole turns included. Default: the
            working branch, on which lever and crank turn the same way.

        Returns
        -------
        float or array
            Crank angle [rad] in the shape of the arguments broadcast, in (-pi, pi] or, with
            near, within half a turn of it; NaN where the lever angle is unreachable on this half
            of the slot.

        """
        return self.servo_for('lever', lever_angle, near)[0]

    def servo(self, lever_angle: ArrayLike, near: ArrayLike | None = None) -> Sequence:
        """Return the result of `servo_angle`, and d lever / d servo there."""
        return self.servo_for('lever', lever_angle, near)

    def reduction(self, servo_angle: ArrayLike) -> Any:
        """Return d lever / d servo at a crank angle [rad], in its shape."""
        return self.joint_rates(servo_angle, ('lever',))['lever'][()]

    def lever_reach(self) -> list:
        """Return the arcs (lo, hi) [rad] of lever angles that the crank can reach."""
        a, b, e = (self.dimensions[name] for name in 'abe')
        sines = [(a - e) / b, (-a - e) / b]
        if e:
            sines.append((a - b) / e * (a + b) / (2.0 * b) - e / (2.0 * b))
        ends = [end for s in sines if abs(s) <= 1.0
                for end in (math.asin(s), math.pi - math.asin(s))]
        ends += [-0.5 * math.pi, 0.5 * math.pi]
        return reachable_arcs(ends, lambda phi: not math.isnan(self.servo_angle(phi)))
