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
What the motion of a linkage tells: inverse, transmission angles and dead points.

Numbers come from the linkage's own closures and outputs, each with its exact rate.
"""

from __future__ import annotations

from typing import Callable, Optional, Sequence, Tuple

import numpy as np

from .inverse import ClosedForm, distinct, EXTREMES, in_order, nearest, Pieces, wrapped
from .planar import GRAZE
from .reach import sign_changes


class Analysis:
    """Questions about a mechanism's motion, asked of its poses and reach."""

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
        A value beyond an extreme by no more than rounding counts as the extreme. An output that
        a bar or a slot ties to the crank pin (a rocker, a block, a lever), a coordinate of the
        pin or of such a link, and the corner of an inversor with its pole on the crank circle
        are closed forms; any other is bracketed and refined to the last digit.

        A linkage with one change point in a turn is the same only after two turns: for it the
        answers are those of the turn [-pi, pi), and `near` should lie there.

        """
        value = np.asarray(value, float)
        solver = self._inverse(output, tuple(map(float, others)))
        answers = in_order(solver(value.ravel())).reshape(*value.shape, -1)
        return answers if near is None else nearest(answers, near)

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
        away = [abs(wrapped(np.asarray(theta, float) - dead))
                for dead in self._dead_points(others)]
        return np.min([np.full(np.shape(theta), np.inf), *away], axis=0)[()]

    def _dead_points(self, others):
        key = ('dead points', *others)
        if key not in self._poses:
            reach, found = self.reach(*others), []
            for tolerance, curve in self._closures(others):
                pieces = Pieces(curve, reach, (), False, 2.0 * tolerance, tolerance)
                found += in_order(pieces.answers(np.zeros(1))).ravel().tolist()
            self._poses[key] = distinct(theta for theta in found if theta == theta)
        return self._poses[key]

    def _closures(self, others):
        """Return for all that vanishes at dead points its tolerance, and its curve and rate."""
        pose = self._curve('closures', (), others)
        return [(float(self._value(closure.tolerance)),
                 lambda theta, i=i: pose(theta)[2 * i:2 * i + 2])
                for i, closure in enumerate(self._structure.closures)]

    def _curve(self, kind, name, others):
        pose = self._bound(kind, name)
        return lambda theta: pose.over(theta, *others)

    def _inverse(self, output: str, others: Tuple[float, ...]) -> Callable:
        """Return the function from values of an output, shape (n,), to candidates (k, n)."""
        key = ('inverse', output, others)
        if key not in self._poses:
            self._check_output(output)
            self._poses[key] = self._solver(output, others)
        return self._poses[key]

    def _solver(self, output, others):
        reach, angular = self.reach(*others), self._structure.turns(output)
        curve = self._curve('output', output, others)
        pieces = Pieces(curve, reach, self._marks(others), angular,
                        GRAZE * (np.pi if angular else self.longest))
        backward = None if others or not pieces.moves else self._structure.backward(output)
        if backward is None:
            return pieces.answers
        twin = backward.joint and self._on_other_branch(backward.joint)
        return ClosedForm(self._curve('backward', output, ()), curve,
                          twin and twin._curve('output', output, ()), reach, angular).answers

    def _marks(self, others):
        """Return the crank angles at which the linkage is nearest to closing or coming apart."""
        key = ('marks', *others)
        if key not in self._poses:
            self._poses[key] = [
                end for arc in self.reach(*others) for _, closure in self._closures(others)
                for end in sign_changes(lambda theta, f=closure: f(theta)[1], *arc, EXTREMES)]
        return self._poses[key]

    def _check_output(self, output):
        allowed = (*self.joints, *(f'{name}.{axis}' for name in self.points for axis in 'xy'))
        if output not in allowed:
            raise ValueError(f'{self.type} has no output {output!r}; '
                             f'allowed: {", ".join(allowed)}')
        if not self._structure.moves(output):
            raise ValueError(f'{output} of {self.type} does not move with the first crank')
