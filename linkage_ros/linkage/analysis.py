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
from .curves import refined, sampled
from .inverse import distinct, in_order, MonotoneBranches, nearest, within_a_turn, wrapped
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

    def crank_angle(self, output: str, value, near=None, others: Sequence[float] = ()):
        """
        Return the crank angles that give an output the value that is wanted.

        Parameters
        ----------
        output : str
            A joint's coordinate, such as 'C.x' or 'C.y' [m], or a link's name: its joint angle
            [rad], whole turns aside, or its slide [m], as `joint_angles` gives it.
        value : float or array-like
            What the output is to be.
        near : float or array-like, optional
            The answer nearest to this angle is taken, whole turns included.
        others : sequence of float
            The angles [rad] at which further cranks are held, if there are any.

        Returns
        -------
        float or array
            Without `near` all answers in [-pi, pi), ascending, on a last axis that is filled up
            with NaN and at least one long; with `near` the one chosen, in the shape of value and
            near broadcast. NaN where the output cannot be had, or never changes.

        Raises
        ------
        ValueError
            If there is no such output, it stands still, a dimension is an array, or not every
            other crank is given.

        Notes
        -----
        A value beyond an extreme by no more than rounding counts as the extreme. Every answer is
        bracketed between extremes of the output and refined to the last digit.

        A linkage with one change point in a turn is the same only after two turns: for it the
        answers are those of the turn [-pi, pi), and `near` should lie there.

        """
        value = numbers('value', value)
        solver = self._inverse(output, tuple(map(float, others)))
        answers = in_order(solver(value.ravel()))
        answers = answers.reshape(*value.shape, answers.shape[-1])
        return answers if near is None else nearest(answers, numbers('near', near))

    def transmission_angles(self, theta, joints: Optional[Sequence[str]] = None) -> dict:
        """
        Return the angle at which each joint passes on its force.

        Parameters
        ----------
        theta : float or array-like
            Crank angle [rad]; for a linkage with several cranks a sequence of as many.
        joints : sequence of str, optional
            The joints wanted: those that a dyad, mirror, inversor, slot or slider line places
            first. Default: all.

        Returns
        -------
        dict
            For each joint an array of theta's shape, rad in [0, pi], best at pi/2; 0 and pi are
            dead points. For a dyad the angle between its bars; for a slider between its rod and
            the normal of its line; for a slot between its line and the normal of the radius from
            pivot to pin. NaN where it cannot be assembled.

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
        Return the angles of the first crank at which a dyad stretches or folds.

        These are the ends of the reach and the change points: there a transmission angle is 0
        or pi, and the crank alone cannot tell how the linkage goes on.

        Parameters
        ----------
        *others : float
            The angles [rad] at which further cranks are held, if there are any.

        Returns
        -------
        list of float
            Crank angles in [-pi, pi), ascending.

        Raises
        ------
        ValueError
            If not every other crank is given, or a dimension is an array.

        """
        return list(self._dead_points(others))

    def distance_to_dead_point(self, theta, *others: float):
        """
        Return how far the first crank is from the nearest dead point.

        Parameters
        ----------
        theta : float or array-like
            Crank angle [rad].
        *others : float
            The angles [rad] at which further cranks are held, if there are any.

        Returns
        -------
        float or array
            Distance [rad] in the shape of theta, at most pi; infinite without dead points.

        """
        theta = numbers('theta', theta)
        away = [abs(wrapped(theta - dead)) for dead in self._dead_points(others)]
        return np.min([np.full(np.shape(theta), np.inf), *away], axis=0)[()]

    def _dead_points(self, others):
        reach = self.reach(*others)
        # At -pi and pi a reach may only be cut, and a dead point there is found as a touch.
        ends = [end for arc in reach for end in arc if abs(end) != math.pi]
        touched = [theta for theta, gap, rounding, _ in self._near_closures(others)
                   if gap <= rounding and all(abs(wrapped(theta - end)) > ONE for end in ends)]
        return distinct([*ends, *touched])

    def _near_closures(self, others) -> list:
        """
        Return the crank angles next to which a dyad stretches or folds, or nearly does.

        Each with how near the closure comes to zero, its rounding and its size.
        """
        return self._remembered('near closures', others, lambda: [
            found for arc in self.reach(*others) for lo, hi in within_a_turn(*arc)
            for found in self._near_closures_on(lo, hi, others)])

    def _near_closures_on(self, lo, hi, others):
        pose = self._bound('closures', ())
        rounding = [2.0 * float(self._value(x.tolerance)) for x in self._structure.closures]
        if not rounding:
            return
        theta = sampled(lo, hi)
        values, rates = self._split(pose.searched(theta, *others))
        size = np.fmax.reduce(np.abs(values), axis=1, initial=0.0)
        # An arm vanishes where it is as short as rounding makes it. What is never more than
        # rounding, as the area of a kite that always lies flat, tells nothing.
        rounding = np.where(size > FLAT * np.array(rounding),
                            np.array(rounding) + GRAZE ** 2 * size, -np.inf)
        for place in (0, -1):
            if abs(theta[place]) == math.pi:
                yield from zip(repeat(theta[place]), abs(values[:, place]), rounding, size)
        folds = [x in self._structure.sketch.folds for x in self._structure.closures]
        searched = ((_crossings(values, folds), values),
                    (_approaches(theta, values, rates, NEAR * size[:, None]), rates))
        for kind, ((row, place), sampled_) in enumerate(searched):
            def unchanged(angles, kind=kind, row=row, start=sampled_[row, place] >= 0.0):
                now = self._split(pose.searched(angles.ravel(), *others))[kind]
                now = now.reshape(-1, *angles.shape)[row, np.arange(len(row))]
                return (now >= 0.0) == start[:, None]

            found, _ = refined(unchanged, theta[place], theta[place + 1])
            gaps = np.abs(self._split(pose.searched(found, *others))[0][row, np.arange(len(row))])
            # A fold that changes sign vanishes between two neighbouring angles.
            yield from ((angle, gap if kind else 0.0, rounding[i], size[i])
                        for angle, gap, i in zip(found.tolist(), gaps.tolist(), row.tolist())
                        if rounding[i] > 0.0)

    @staticmethod
    def _split(rows):
        """Return the closures and their rates."""
        return rows[0::2], rows[1::2]

    def _curve(self, kind, name, others):
        pose = self._bound(kind, name)
        return lambda theta: pose.searched(theta, *others)

    def _inverse(self, output: str, others: Tuple[float, ...]) -> Callable:
        """Return the function from values of an output, shape (n,), to candidates (k, n)."""
        self._check_output(output)
        return self._remembered('inverse', (output, *others),
                                lambda: self._branches(output, others).answers)

    def _branches(self, output, others):
        angular = self._structure.turns(output)
        marks = distinct(theta for theta, gap, _, size in self._near_closures(others)
                         if gap <= NEAR * size)
        return MonotoneBranches(self._curve('output', output, others), self.reach(*others),
                                marks, angular, GRAZE * (math.pi if angular else self.longest))

    def _check_output(self, output):
        allowed = (*self.joints, *(f'{name}.{axis}' for name in self.points for axis in 'xy'))
        if output not in allowed:
            raise ValueError(f'{self.type} has no output {quoted(output)}; '
                             f'allowed: {listed(allowed)}')
        if not self._structure.moves(output):
            raise ValueError(f'{output} of {self.type} does not move with the first crank')


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
