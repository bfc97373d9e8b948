# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What the motion of a linkage tells: inverse, transmission angles and dead points.

Numbers come from the linkage's own closures and outputs, each with its exact rate.
"""

from __future__ import annotations

from itertools import repeat
import math
from typing import Callable, Optional, Sequence, Tuple

import numpy as np

from .arguments import numbers
from .curves import extremes, refined, sampled
from .inputs import Arc
from .inverse import distinct, in_order, MonotoneBranches, nearest
from .mechanism import Mechanism
from .planar import GRAZE
from ..words import listed, quoted

# How near to zero a closure comes, as a part of its size, for the output to change quickly there.
NEAR = 1e-2
# Dead points nearer to an end of the reach than this [rad] are that end.
ONE = 1e-9
# A closure whose size is less than so many times its rounding never leaves zero.
FLAT = 256.0


class Analysed(Mechanism):
    """A mechanism that also answers questions about its motion."""

    def input_for(self, output: str, value, near=None, others: Sequence[float] = ()):
        """
        Return the values of the first input that give an output the value that is wanted.

        Parameters
        ----------
        output : str
            A joint's coordinate, such as 'C.x' or 'C.y' [m], or a link's name: its joint angle
            [rad], whole turns aside, or its slide [m], as `joint_angles` gives it.
        value : float or array-like
            What the output is to be.
        near : float or array-like, optional
            The answer nearest to this is taken, a crank's with whole turns included.
        others : sequence of float
            The values [rad or m] at which further inputs are held, if there are any.

        Returns
        -------
        float or array
            Without `near` all answers, crank angles in [-pi, pi), ascending, on a last axis that
            is filled up with NaN and at least one long; with `near` the one chosen, in the shape
            of value and near broadcast. NaN where the output cannot be had, or never changes.

        Raises
        ------
        ValueError
            If there is no such output, it stands still, a dimension is an array, or not every
            other input is given.

        Notes
        -----
        A value beyond an extreme by no more than rounding counts as the extreme. Every answer is
        bracketed between extremes of the output and refined to the last digit.

        A linkage with one change point in a turn is the same only after two turns: for it the
        answers are those of the turn [-pi, pi), and `near` should lie there.

        """
        value, first = numbers('value', value), self.inputs[0]
        solver = self._inverse(output, tuple(map(float, others)))
        answers = in_order(solver(value.ravel()), first) * first.size
        answers = answers.reshape(*value.shape, answers.shape[-1])
        return answers if near is None else nearest(answers, numbers('near', near), first)

    def extremes(self, output: str, arcs: Optional[Sequence[Arc]] = None) -> list:
        """
        Return how far an output goes.

        Parameters
        ----------
        output : str
            What `input_for` takes, of a linkage with one input.
        arcs : sequence of (float, float), optional
            Where the input may be [rad or m]. Default: its reach.

        Returns
        -------
        list of ((float, float), (float, float))
            For each arc the least value and the input there, then the greatest; an angle is
            followed past -pi and pi.

        """
        self._check_output(output)
        pose, angular = self._bound('output', output), np.array([self._structure.turns(output)])
        return [tuple(map(tuple, extremes(lambda value: pose.searched(value)[:1], *arc,
                                          angular)[0].tolist()))
                for arc in (self.reach() if arcs is None else arcs)]

    def transmission_angles(self, theta, joints: Optional[Sequence[str]] = None) -> dict:
        """
        Return the angle at which each joint passes on its force.

        Parameters
        ----------
        theta : float or array-like
            What `solve` takes.
        joints : sequence of str, optional
            The joints wanted: those that a dyad, cylinder, mirror, inversor, slot or slider line
            places first. Default: all.

        Returns
        -------
        dict
            For each joint an array of theta's shape, rad in [0, pi], best at pi/2; 0 and pi are
            dead points. For a dyad the angle between its bars, a cylinder being one; for a slider
            between its rod and the normal of its line; for a slot between its line and the normal
            of the radius from pivot to pin. NaN where it cannot be assembled.

        Raises
        ------
        ValueError
            If a joint has no transmission angle.

        Notes
        -----
        Sources: Norton, "Design of Machinery", sec. 3.3; Balli and Chand, "Transmission angle in
        mechanisms", Mechanism and Machine Theory 37 (2002).

        """
        return self._scalars('transmissions', theta, joints)

    def dead_points(self, *others: float) -> list:
        """
        Return the values of the first input at which a dyad stretches or folds.

        These are the ends of the reach and the change points: there a transmission angle is 0
        or pi, and the input alone cannot tell how the linkage goes on.

        Parameters
        ----------
        *others : float
            The values [rad or m] at which further inputs are held, if there are any.

        Returns
        -------
        list of float
            Values [rad or m], ascending; crank angles in [-pi, pi).

        Raises
        ------
        ValueError
            If not every other input is given, or a dimension is an array.

        """
        return [dead * self.inputs[0].size for dead in self._dead_points(others)]

    def distance_to_dead_point(self, theta, *others: float):
        """
        Return how far the first input is from the nearest dead point.

        Parameters
        ----------
        theta : float or array-like
            Value of the first input [rad or m].
        *others : float
            The values [rad or m] at which further inputs are held, if there are any.

        Returns
        -------
        float or array
            Distance [rad or m] in the shape of theta, of a crank at most pi; infinite without
            dead points.

        """
        theta = numbers('theta', theta)
        away = [self.inputs[0].apart(theta, dead) for dead in self.dead_points(*others)]
        return np.min([np.full(np.shape(theta), np.inf), *away], axis=0)[()]

    # From here on the first input is counted in its size.

    def _counted_reach(self, others) -> list:
        """Return the reach in arcs, none of them on both sides of -pi or pi."""
        first = self.inputs[0]
        return [part for lo, hi in self.reach(*others)
                for part in first.within(lo / first.size, hi / first.size)]

    def _curve(self, kind, name, others) -> Callable:
        """Return the function from the first input to numbers, and each one's rate by it."""
        pose, size = self._bound(kind, name), self.inputs[0].size

        def curve(theta):
            rows = pose.searched(theta * size, *others)
            rows[1::2] *= size
            return rows
        return curve

    def _dead_points(self, others):
        first = self.inputs[0].counted()
        # At -pi and pi a reach may only be cut, and a dead point there is found as a touch.
        ends = [end for arc in self._counted_reach(others) for end in arc
                if not first.is_cut(end)]
        touched = [theta for theta, gap, rounding, _ in self._near_closures(others)
                   if gap <= rounding and all(first.apart(theta, end) > ONE for end in ends)]
        return distinct([*ends, *touched], first)

    def _near_closures(self, others) -> list:
        """
        Return the values next to which a dyad stretches or folds, or nearly does.

        Each with how near the closure comes to zero, its rounding and its size.
        """
        return self._remembered('near closures', others, lambda: [
            found for arc in self._counted_reach(others)
            for found in self._near_closures_on(*arc, others)])

    def _near_closures_on(self, lo, hi, others):
        curve = self._curve('closures', (), others)
        rounding = [2.0 * float(self._value(x.tolerance)) for x in self._structure.closures]
        if not rounding:
            return
        theta = sampled(lo, hi)
        values, rates = self._split(curve(theta))
        size = np.fmax.reduce(np.abs(values), axis=1, initial=0.0)
        # An arm vanishes where it is as short as rounding makes it. What is never more than
        # rounding, as the area of a kite that always lies flat, tells nothing.
        rounding = np.where(size > FLAT * np.array(rounding),
                            np.array(rounding) + GRAZE ** 2 * size, -np.inf)
        for place in (0, -1):
            if self.inputs[0].is_cut(theta[place]):
                yield from zip(repeat(theta[place]), abs(values[:, place]), rounding, size)
        folds = [x in self._structure.sketch.folds for x in self._structure.closures]
        searched = ((_crossings(values, folds), values),
                    (_approaches(theta, values, rates, NEAR * size[:, None]), rates))
        for kind, ((row, place), sampled_) in enumerate(searched):
            def unchanged(angles, kind=kind, row=row, start=sampled_[row, place] >= 0.0):
                now = self._split(curve(angles.ravel()))[kind]
                now = now.reshape(-1, *angles.shape)[row, np.arange(len(row))]
                return (now >= 0.0) == start[:, None]

            found, _ = refined(unchanged, theta[place], theta[place + 1])
            gaps = np.abs(self._split(curve(found))[0][row, np.arange(len(row))])
            # A fold that changes sign vanishes between two neighbouring angles.
            yield from ((angle, gap if kind else 0.0, rounding[i], size[i])
                        for angle, gap, i in zip(found.tolist(), gaps.tolist(), row.tolist())
                        if rounding[i] > 0.0)

    @staticmethod
    def _split(rows):
        """Return the closures and their rates."""
        return rows[0::2], rows[1::2]

    def _inverse(self, output: str, others: Tuple[float, ...]) -> Callable:
        """Return the function from values of an output, shape (n,), to candidates (k, n)."""
        self._check_output(output)
        return self._remembered('inverse', (output, *others),
                                lambda: self._branches(output, others).answers)

    def _branches(self, output, others):
        angular = self._structure.turns(output)
        marks = distinct((theta for theta, gap, _, size in self._near_closures(others)
                          if gap <= NEAR * size), self.inputs[0].counted())
        return MonotoneBranches(
            self._curve('output', output, others), self._counted_reach(others), marks, angular,
            GRAZE * (math.pi if angular else self.longest))

    def _check_output(self, output):
        allowed = (*self.joints, *(f'{name}.{axis}' for name in self.points for axis in 'xy'))
        if output not in allowed:
            raise ValueError(f'{self.type} has no output {quoted(output)}; '
                             f'allowed: {listed(allowed)}')
        if not self._structure.moves(output):
            raise ValueError(f'{output} of {self.type} does not move with '
                             f'{self.inputs[0].name}')


def _crossings(values, folds) -> tuple:
    """Return row and place of the samples after which one of the folds changes sign."""
    above = values >= 0.0
    return np.nonzero((above[:, 1:] != above[:, :-1]) & np.array(folds)[:, None]
                      & np.isfinite(values[:, 1:]) & np.isfinite(values[:, :-1]))


def _approaches(theta, values, rates, near) -> tuple:
    """Return row and place of the samples after which a closure turns away close to zero."""
    sign = np.sign(values[:, :-1])
    with np.errstate(all='ignore'):
        before, after = sign * rates[:, :-1], sign * rates[:, 1:]
        # Where the tangents meet a smooth curve between two samples is lower than it gets.
        ahead = (sign * (values[:, 1:] - values[:, :-1]) - after * np.diff(theta)) / (
            before - after)
        bound = sign * values[:, :-1] + before * ahead
        return np.nonzero((before < 0.0) & (after >= 0.0) & ~(bound > near))
