# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A linkage as its users have it: its kinematics, forces, inverse and reach."""

from __future__ import annotations

import math
from typing import Any, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from . import statics
from .inputs import Arc
from .inverse import Inverse, inverse_of, segments_of, Solution
from .kinematics import Inputs, Kinematics
from .motion.reach import extremes_of, reach_of
from .motion.singularities import Analysis
from .text.arguments import numbers
from ..words import n_inputs, short_repr


class Mechanism(Kinematics):
    """
    A linkage with given dimensions; create one with `linkage_ros.mechanisms.create`.

    A pose depends on the inputs alone, not on earlier calls. Joint angles in arrays may differ by
    two ulps from those of single poses. In all methods `theta` is the input, a crank's angle [rad]
    or a cylinder's length [m], a float or an array; for several inputs it is a sequence of as
    many. Results have its shape, and are NaN where the linkage cannot be assembled. `points` and
    `joints` are names, by default all; fewer names cost less. ValueError names the wrong argument
    and the allowed values.

    Attributes
    ----------
    type : str
        Name of its type.
    design : Design
        Its joint lines and default dimensions.
    dimensions : mapping
        Dimensions [m] by name; `with_dimensions` returns a linkage with others.
    branches : mapping
        Assembly sign, +1 or -1, of each joint with two.
    inputs : tuple of Input
        Cranks, by their angles [rad], and cylinders and carriages, by their lengths [m].
    points : tuple of str
        Joints, in the order of the joint lines.
    joints : tuple of str
        Moving links, which have the joint angles.
    links : tuple of Link
        Definition of each joint angle: name, parent, joint, kind, zero [rad] and tip.
    bars : tuple of (str, str)
        Joints at the ends of each bar.
    cylinders : tuple of (str, str)
        Joints at the ends of each cylinder, its base first.
    tracer : str
        Joint of the locus.
    is_accelerated : bool
        Whether compiled code solves arrays.
    formulas : LinkageFormulas
        Its formulas, for any dimensions.
    cache : Cache
        Cached results: reach, inverses, travels.

    """

    # --- forces ---

    def effort(self, theta: Inputs, loads: Mapping[str, ArrayLike]) -> np.ndarray:
        """
        Return the inputs' efforts that balance loads at rest.

        `loads` are by name: for a joint a force (x, y) [N], for a link a moment [N m],
        counterclockwise positive; each may have leading axes of theta's shape.
        The result has theta's shape and a last axis for the inputs: the torque of a crank
        [N m], the force of a cylinder [N], positive in the direction of a growing input. It
        grows without bound next to a dead point, and is infinite or NaN at it.
        """
        return statics.effort(self, theta, loads)

    def output_effort(self, output: str, theta: Inputs, effort: ArrayLike) -> Any:
        """
        Return the effort of an output [N m of an angle, else N] for the only input's `effort`.

        Infinite where the output turns back, 0 at a dead point.
        """
        return statics.output_effort(self, output, theta, effort)

    # --- the inverse ---

    def inverse(self, outputs: str | Sequence[str]) -> Inverse:
        """
        Return the inverse of as many outputs as there are inputs; see `has_output`.

        It finds all solutions, the nearest, or the continuation of the last; `print` shows the
        joint lines of its linkage. Raises ValueError if an output does not exist, their number is
        not that of the inputs, they do not determine all inputs, or a dimension is an array.
        """
        return inverse_of(self, outputs)

    def input_for(self, output: str, value: ArrayLike, near: ArrayLike | None = None,
                  others: Sequence[float] = ()) -> Any:
        """
        Return the values of the first input for given values of an output.

        `output` is as for `inverse`; angles are equal up to whole turns. `others` are the fixed
        values of the other inputs. Without `near`, the result has all solutions, crank angles in
        [-pi, pi) or within their period, ascending, on a last axis of length one or more, padded
        with NaN. With `near` it has the nearest, including whole turns, in the broadcast shape of
        value and near. It is NaN where the output is unreachable or constant up to rounding; a
        value beyond an extreme by rounding counts as the extreme. Raises ValueError if the
        output's formula does not depend on the input.
        """
        is_alone = len(self.inputs) == 1 and type(others) is tuple and not others
        fixed = () if is_alone else self._fixed(others)
        inverse = self.inverse((output, *(input_.name for input_ in self.inputs[1:])))
        if near is not None:
            return inverse.nearest((value, *fixed), (near, *fixed))[0][0]
        if type(value) is not float and numbers('value', value).ndim:
            return inverse.over(value, *fixed)[0][0]
        values: Any = (value, *fixed)
        solutions = inverse.all(values)
        return np.array([solution.inputs[0] for solution in solutions] or [math.nan])

    def _fixed(self, others: Any) -> tuple[float, ...]:
        """Return the values of all inputs but the first; raise ValueError if they are not that."""
        if self.shape:
            raise ValueError('the reach, dead points and inverse are for one set of dimensions, '
                             'not for arrays')
        values = numbers('others', others)
        if values.shape != (len(self.inputs) - 1,):
            raise ValueError(f'{self.type} has {n_inputs(len(self.inputs))}: the values of all '
                             f'except the first are needed, got {short_repr(values.tolist())}')
        return tuple(values.tolist())

    def servo_for(self, output: str, value: ArrayLike, near: ArrayLike | None = None,
                  ends: tuple[float, float] | None = None) -> Sequence:
        """
        Return one value of the input for a value of an output, and d output / d input there.

        Parameters and choice are those of `Inverse.nearest`, `ends` those of the one input.
        Without `near` it is on the working branch, on which lever and crank turn the same way.
        Floats, or arrays in the broadcast shape of value and near; NaN without a solution.
        """
        (theta,), (rate,) = self.inverse(output).nearest(
            (value,), None if near is None else (near,), None if ends is None else (ends,))
        return theta, rate

    def follow(self, output: str, value: float, near: float) -> tuple[float, float]:
        """
        Return the input for a value of an output, continuous from another input.

        See `Inverse.follow`, for a linkage with one input: the input [rad or m] with its whole
        turns, and d output / d input; NaN beyond the next dead point or extreme of the output.
        """
        (theta,), (rate,) = self.inverse(output).follow((value,), (near,))
        return theta, rate

    def inputs_for(self, outputs: Sequence[str], values: ArrayLike,
                   near: ArrayLike | None = None) -> list[Solution]:
        """Return all values of the inputs for values of the outputs; see `Inverse.all`."""
        return self.inverse(outputs).all(values, near)

    # --- the whole motion; other inputs are fixed at the values `others` ---

    def reach(self, *others: float) -> list:
        """
        Return the values of the first input with which the linkage can be assembled.

        Arcs (lo, hi) of a crank [rad] have lo in [-pi, pi) and hi > lo, and a full turn is
        [(-pi, pi)]; strokes (lo, hi) of a cylinder are in m; the list may be empty. Raises
        ValueError if not every other input is given, or a dimension is an array.
        """
        return list(reach_of(self, self._fixed(others)))

    def dead_points(self, *others: float) -> list:
        """
        Return the values of the first input at which a dyad stretches or folds, ascending.

        These are the ends of the reach and the change points: there a transmission angle is 0
        or pi, and the input alone does not determine the motion. Crank angles are in
        [-pi, pi). Raises ValueError as `reach` does.
        """
        return [dead * self.inputs[0].step
                for dead in Analysis(self, self._fixed(others)).dead_points()]

    def distance_to_dead_point(self, theta: ArrayLike, *others: float) -> Any:
        """Return the distance of the first input to the nearest dead point [rad or m], or inf."""
        theta = numbers('theta', theta)
        with np.errstate(invalid='ignore'):  # of infinite angles
            distances = [self.inputs[0].distance(theta, x) for x in self.dead_points(*others)]
        return np.min([np.full(np.shape(theta), np.inf), *distances], axis=0)[()]

    def extremes(self, output: str, arcs: Sequence[Arc] | None = None,
                 others: Sequence[float] = ()) -> list:
        """
        Return the extremes of an output on arcs of the first input, by default its reach.

        Each arc has its minimum and the input there, then its maximum; an angle continues
        past -pi and pi. Where the output jumps, as an angle may where its ends meet, not all
        values between the two are reached; see `monotone`.
        """
        pairs = numbers('arcs', () if arcs is None else arcs)
        if pairs.size and pairs.shape[1:] != (2,) or not np.isfinite(pairs).all():
            raise ValueError(f'arcs must be pairs of two finite numbers, got {short_repr(arcs)}')
        return extremes_of(self, output, arcs, self._fixed(others))

    def monotone(self, output: str, others: Sequence[float] = ()) -> np.ndarray:
        """
        Return pieces of the reach on which an output rises, or falls, by half a turn at most.

        Each row has the input [rad or m] at both ends, and the output.
        """
        self.check_there(output)
        return segments_of(self, output, self._fixed(others)).pieces()
