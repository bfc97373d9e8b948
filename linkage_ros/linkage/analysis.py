# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
What the motion of a linkage tells: inverse, transmission angles and dead points.

Numbers come from the linkage's own closures and outputs, each with its exact rate.
"""

from __future__ import annotations

import math
from typing import Any, Callable, List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import ArrayLike

from .arguments import numbers
from .curves import extremes
from .dead_points import NEAR, near_zeros, NearZero
from .dynamics import Driven
from .inputs import Arc
from .inverse import distinct, in_order, MonotoneBranches, nearest
from .mechanism import Inputs
from .planar import GRAZE
from ..formula.program import Pose
from ..words import listed, meant, plain_text, quoted

# Dead points nearer to an end of the reach than this [rad] are that end.
ONE = 1e-9


class Analysed(Driven):
    """A mechanism that also answers questions about its motion."""

    def input_for(self, output: str, value: ArrayLike, near: Optional[ArrayLike] = None,
                  others: Sequence[float] = ()) -> Any:
        """
        Return the values of the first input that give an output the value that is wanted.

        Parameters
        ----------
        output : str
            A link's name: its joint angle [rad], whole turns aside, or its slide [m]; a joint's
            coordinate such as 'C.x' [m]; 'distance(A,C)' [m]; 'angle(A,C)' [rad] from +x.
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
        branches = self._inverse(output, tuple(map(float, others)))
        answers = in_order(branches.answers(value.ravel()), first) * first.size
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
        self.check_output(output)
        pose, angular = self._bound('output', output), np.array([self._structure.turns(output)])
        found = [extremes(lambda value: pose.searched(value)[:1], low, high, angular)[0].tolist()
                 for low, high in (self.reach() if arcs is None else arcs)]
        return [(tuple(least), tuple(greatest)) for least, greatest in found]

    def transmission_angles(self, theta: Inputs, joints: Optional[Sequence[str]] = None) -> dict:
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

    def distance_to_dead_point(self, theta: ArrayLike, *others: float) -> Any:
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

    def _counted_reach(self, others: Tuple[float, ...]) -> List[Arc]:
        """Return the reach in arcs, none of them on both sides of -pi or pi."""
        first = self.inputs[0]
        return [part for lo, hi in self.reach(*others)
                for part in first.within(lo / first.size, hi / first.size)]

    def _curve(self, kind: str, name: Any, others: Tuple[float, ...]) -> Callable:
        """Return the function from the first input to numbers, and each one's rate by it."""
        pose, size = self._bound(kind, name), self.inputs[0].size

        def curve(value: np.ndarray) -> np.ndarray:
            rows = pose.searched(value * size, *others)
            rows[1::2] *= size
            return rows
        return curve

    def _dead_points(self, others: Tuple[float, ...]) -> List[float]:
        first = self.inputs[0].counted()
        # Where a reach may only be cut off, a dead point is found as a touch.
        ends = [end for arc in self._counted_reach(others) for end in arc
                if not first.is_cut(end)]
        touched = [near.value for near in self._near_zeros(others)
                   if near.gap <= near.rounding
                   and all(first.apart(near.value, end) > ONE for end in ends)]
        return distinct([*ends, *touched], first)

    def _near_zeros(self, others: Tuple[float, ...]) -> List[NearZero]:
        """Return where a dyad stretches or folds, or nearly does."""
        closures, folds = self._structure.closures, self._structure.built.folds

        def find() -> List[NearZero]:
            reach = self._counted_reach(others) if closures else []
            rounding = np.array([2.0 * float(self._value(x.tolerance)) for x in closures])
            return [near for arc in reach for near in near_zeros(
                self._curve('closures', (), others), arc, self.inputs[0].counted(), rounding,
                np.array([x in folds for x in closures]))]

        return self.cache.get_or_make(('near zeros', *others), find)

    def follow(self, output: str, value: float, near: float) -> Tuple[float, float]:
        """
        Return the input that gives an output a value, going on from another without a jump.

        Parameters
        ----------
        output : str
            What `input_for` takes, of a linkage with one input.
        value : float
            What the output is [rad or m].
        near : float
            Where the input was [rad or m]; whole turns of a crank are kept.

        Returns
        -------
        (float, float)
            The input [rad or m], between the dead points and extremes of the output that `near` is
            between, and d output / d input there; NaN if the output has no such value there.

        """
        branches, pose = self.cache.get_or_make(('follow', output), lambda: (
            self._inverse(output, ()), self._bound('output', output).at))
        first = self.inputs[0]
        turns = first.turns_of(near)
        found, rate = branches.follow(pose, first.size, value, near - turns)
        if branches.is_one and first.is_whole(self.reach()):
            # The output turns all round with the crank: beyond pi they go on together.
            turns = float(first.beside(found, near)) - found
        return found + turns, rate

    def monotone(self, output: str, most: float) -> Tuple[List[Tuple[float, ...]], Pose]:
        """
        Return what an inverse of one's own starts from, of a linkage with one input.

        Parameters
        ----------
        output : str
            What `input_for` takes.
        most : float
            By how much the output changes in one piece at most [rad or m].

        Returns
        -------
        (list of (float, float, float, float), Pose)
            Pieces of the reach on which the output rises or falls all along: the input [rad or m]
            at both ends, and the output there; the code for the output and its rate.

        """
        size = self.inputs[0].size
        return [(low * size, high * size, *values) for low, high, *values
                in self._inverse(output, ()).pieces(most)], self._bound('output', output)

    def _inverse(self, output: str, others: Tuple[float, ...]) -> MonotoneBranches:
        """Return the branches of an output."""
        if not isinstance(output, str):
            self.check_output(output)
        return self.cache.get_or_make(('inverse', output, *others),
                                      lambda: self._branches(output, others))

    def _branches(self, output: str, others: Tuple[float, ...]) -> MonotoneBranches:
        self.check_output(output)
        angular = self._structure.turns(output)
        marks = distinct((near.value for near in self._near_zeros(others)
                          if near.gap <= NEAR * near.size), self.inputs[0].counted())
        return MonotoneBranches(
            self._curve('output', output, others), self._counted_reach(others), marks, angular,
            GRAZE * (math.pi if angular else self.longest))

    def check_output(self, output: str) -> None:
        """Raise ValueError if there is no such output, or it stands still."""
        self.check_there(output)
        if not self._structure.moves(output):
            raise ValueError(f'{plain_text(output)} of {self.type} does not move with the '
                             f'{self.inputs[0].name}')

    def check_there(self, output: str) -> None:
        """Raise ValueError if there is no such output."""
        if not self.has_output(output):
            allowed = (*self.joints, *(f'{name}.{axis}' for name in self.points for axis in 'xy'),
                       'distance(A,B)', 'angle(A,B)')
            raise ValueError(f'{self.type} has no output {quoted(output)}; '
                             f'allowed: {listed(allowed)}{meant(output, allowed)}')
